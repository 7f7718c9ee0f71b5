//! What the data determine worst, in words.

use faer::{Mat, Side};
use nalgebra::DMatrix;

use super::Calibration;
use crate::geometry::linalg::invert_spd;

/// The direction of all parameters, each in units of what it would be known to if the others were,
/// that the data and priors determine worst.
#[derive(Debug, Clone, PartialEq)]
pub struct Weakness {
    /// Condition number of the normal equations at unit diagonal: 1 is perfect, beyond 10^10 digits
    /// are lost.
    pub condition: f64,
    /// Groups of parameters that trade off in it with their shares (sum of squares 1), largest first.
    pub groups: Vec<(String, f64)>,
    /// The same as a sentence, with what to add.
    pub text: String,
    /// Parameters of which the data say next to nothing beyond the prior: at least 0.95 of their
    /// prior standard deviation is left.
    pub prior_only: Vec<String>,
}

/// Parameters that belong together, from a column's name.
fn group(name: &str) -> String {
    if let Some(number) = name.strip_prefix("plane ").and_then(|rest| rest.split(' ').next()) {
        return format!("plane {number}");
    }
    let (owner, what) = if name.starts_with("camera") || name.starts_with("station") {
        // "camera 2 fx", or "camera fx" when there is but one.
        let numbered = name.split(' ').nth(1).is_some_and(|word| word.parse::<usize>().is_ok());
        let split = name.match_indices(' ').nth(usize::from(numbered)).map_or(name.len(), |(i, _)| i);
        name.split_at(split)
    } else {
        ("rig", name)
    };
    let what = what.trim();
    let what = match what {
        "fx" | "fy" => "focal length",
        "cx" | "cy" => "principal point",
        "laser x0" | "laser y0" => "laser offset",
        "laser vx" | "laser vy" => "laser slope",
        "head cx" | "head cy" => "head principal point",
        w if w.starts_with("lens coefficient") => "lens",
        w if w.starts_with("rotation") => "rotation",
        w if w.starts_with("position") => "position",
        w if w.starts_with("tilt axis") || w.starts_with("pan axis") => "axis offsets",
        w if w.starts_with("pan ") => "pan encoder",
        w if w.starts_with("tilt ") => "tilt encoder",
        w => w,
    };
    format!("{owner} {what}")
}

/// Shares of groups in the eigenvector of the smallest eigenvalue, largest first: two, and those with a tenth.
pub(crate) fn shares(vectors: &Mat<f64>, names: &[String]) -> Vec<(String, f64)> {
    let mut groups: Vec<(String, f64)> = Vec::new();
    for (i, name) in names.iter().enumerate() {
        let share = vectors[(i, 0)] * vectors[(i, 0)];
        let group = group(name);
        match groups.iter_mut().find(|(g, _)| *g == group) {
            Some((_, s)) => *s += share,
            None => groups.push((group, share)),
        }
    }
    groups.sort_by(|a, b| b.1.total_cmp(&a.1));
    // Two at least: with many cameras none has a tenth.
    let large = groups.iter().filter(|(_, s)| *s >= 0.1).count();
    groups.truncate(large.max(2));
    groups
}

pub(crate) fn sentence(groups: &[(String, f64)]) -> String {
    let names: Vec<&str> = groups.iter().take(3).map(|(g, _)| g.as_str()).collect();
    names.join(" against ")
}

/// What to add so that the groups come apart. `depths`: range of the camera's shots, metres.
pub(crate) fn advice(groups: &[(String, f64)], depths: Option<(f64, f64)>) -> String {
    let has = |what: &str| groups.iter().any(|(g, _)| g.ends_with(what));
    let spread = depths.map_or_else(
        || "add shots much nearer or farther".to_owned(),
        |(near, far)| format!("add shots nearer than {:.1} m or farther than {:.1} m", 0.7 * near, 1.4 * far),
    );
    let planes = groups.iter().any(|(g, _)| g.starts_with("plane "));
    let stations = groups.iter().any(|(g, _)| g.starts_with("station "));
    let text = if planes && stations {
        "add planes that face other ways, or cameras that both stations light".to_owned()
    } else if has("laser offset") && groups.len() > 1 {
        "the scale hangs on the laser's offset: calibrate it from boards, or survey a distance".to_owned()
    } else if has("axis offsets") {
        "widen the range of pan and tilt, add cameras, or measure the offsets once and give them a prior".to_owned()
    } else if has("tilt encoder") || has("pan encoder") {
        "force square pixels, or calibrate the encoders and give them a prior".to_owned()
    } else if has(" focal length") && has(" position") {
        spread
    } else if has("principal point") || has(" lens") || has("skew") {
        "spread the shots to the image's corners and over depth, or fix the lens".to_owned()
    } else if has("head focal length") || has("head principal point") {
        "calibrate the head camera from boards and give it a prior".to_owned()
    } else if has("position") || has("rotation") {
        spread
    } else {
        "add shots at other depths and directions".to_owned()
    };
    format!(": {text}")
}

/// Scales a symmetric matrix (lower triangle given) to unit diagonal; `None` for a diagonal entry
/// that is not positive.
pub(crate) fn scaled(h: &Mat<f64>) -> Option<(Mat<f64>, Vec<f64>)> {
    let n = h.nrows();
    let scale: Vec<f64> = (0..n).map(|i| 1.0 / h[(i, i)].sqrt()).collect();
    if scale.iter().any(|s| !s.is_finite()) {
        return None;
    }
    let at = |i: usize, j: usize| h[(i.max(j), i.min(j))] * scale[i] * scale[j];
    Some((Mat::from_fn(n, n, at), scale))
}

/// Eigenvalues (ascending) and eigenvectors of normal equations at unit diagonal.
pub(crate) fn spectrum(h: &Mat<f64>) -> Option<(Vec<f64>, Mat<f64>)> {
    let (a, _) = scaled(h)?;
    let eigen = a.self_adjoint_eigen(Side::Lower).ok()?;
    let values: Vec<f64> = eigen.S().column_vector().iter().copied().collect();
    Some((values, eigen.U().to_owned()))
}

impl Calibration {
    /// What the data determine worst. `None` when nothing was free.
    pub fn weakest(&self) -> Option<Weakness> {
        let c = &self.covariance;
        let lens = c.nrows().checked_sub(6)?;
        let name = |i: usize| match i {
            0..5 => ["fx", "fy", "skew", "cx", "cy"][i].to_owned(),
            i if i < lens => format!("lens coefficient {}", i - 5),
            i if i < lens + 3 => "rotation".to_owned(),
            _ => "position".to_owned(),
        };
        // Parameters that move as one (fx and fy of forced square pixels) count once.
        let one = |i: usize, j: usize| c[(i, j)] * c[(i, j)] > (1.0 - 1e-12) * c[(i, i)] * c[(j, j)];
        let mut kept: Vec<usize> = Vec::new();
        for i in (0..c.nrows()).filter(|i| c[(*i, *i)] > 0.0) {
            if !kept.iter().any(|j| one(i, *j)) {
                kept.push(i);
            }
        }
        let block = DMatrix::from_fn(kept.len(), kept.len(), |i, j| c[(kept[i], kept[j])]);
        let (information, _) = invert_spd(&block)?;
        let information = Mat::from_fn(kept.len(), kept.len(), |i, j| information[(i, j)]);
        let names: Vec<String> = kept.iter().map(|i| format!("camera {}", name(*i))).collect();
        Weakness::of(&information, &names, |_| None)
    }
}

impl Weakness {
    /// Of normal equations whose columns have these names; `depths` knows the range of a numbered
    /// camera's shots.
    pub(crate) fn of(h: &Mat<f64>, names: &[String], depths: impl Fn(usize) -> Option<(f64, f64)>) -> Option<Self> {
        let (values, vectors) = spectrum(h)?;
        let (low, high) = (*values.first()?, *values.last()?);
        let groups = shares(&vectors, names);
        let camera = groups.iter().find_map(|(g, _)| g.strip_prefix("camera ")?.split(' ').next()?.parse().ok());
        let text = format!("weakest: {}{}", sentence(&groups), advice(&groups, camera.and_then(depths)));
        Some(Self { condition: high / low, groups, text, prior_only: Vec::new() })
    }
}
