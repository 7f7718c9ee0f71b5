//! What the data determine worst, in words.

use faer::Mat;

use super::adjusted::Solution;
use super::layout::{Layout, State};
use super::problem::Adjustment;
use super::solve::spectrum;

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
    let (owner, what) = if name.starts_with("camera") || name.starts_with("station") {
        let split = name.match_indices(' ').nth(1).map_or(name.len(), |(i, _)| i);
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

/// Shares of groups in the eigenvector of the smallest eigenvalue, largest first, down to a tenth.
fn shares(vectors: &Mat<f64>, names: &[String]) -> Vec<(String, f64)> {
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
    groups.retain(|(_, s)| *s >= 0.1);
    groups
}

fn sentence(groups: &[(String, f64)]) -> String {
    let names: Vec<&str> = groups.iter().take(3).map(|(g, _)| g.as_str()).collect();
    names.join(" against ")
}

/// The direction that singular normal equations leave open.
pub(super) fn undetermined(h: &Mat<f64>, layout: &Layout, state: &State) -> String {
    let names = layout.names(state);
    if let Some(i) = (0..h.nrows()).find(|i| h[(*i, *i)].is_nan() || h[(*i, *i)] <= 0.0) {
        return format!("no measurement depends on {}", names[i]);
    }
    spectrum(h).map_or_else(
        || "the normal equations are singular".to_owned(),
        |(_, vectors)| {
            let groups = shares(&vectors, &names);
            format!("the data do not determine {}{}", sentence(&groups), advice(&groups, None))
        },
    )
}

/// What to add so that the groups come apart. `depths`: range of the camera's shots, metres.
fn advice(groups: &[(String, f64)], depths: Option<(f64, f64)>) -> String {
    let has = |what: &str| groups.iter().any(|(g, _)| g.ends_with(what));
    let spread = depths.map_or_else(
        || "add shots much nearer or farther".to_owned(),
        |(near, far)| format!("add shots nearer than {:.1} m or farther than {:.1} m", 0.7 * near, 1.4 * far),
    );
    let text = if has("laser offset") && groups.len() > 1 {
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

/// The weakest direction of a solution.
pub(super) fn weakest(input: &Adjustment, solution: &Solution) -> Option<Weakness> {
    let names = solution.layout.names(&solution.state);
    let (values, vectors) = spectrum(&solution.normal)?;
    let (low, high) = (*values.first()?, *values.last()?);
    let groups = shares(&vectors, &names);
    let camera = groups.iter().find_map(|(g, _)| {
        let mut words = g.split(' ');
        (words.next() == Some("camera")).then(|| words.next()?.parse::<usize>().ok()).flatten()
    });
    let depths = camera.and_then(|c| depth_range(input, solution, c));
    let text = format!("weakest: {}{}", sentence(&groups), advice(&groups, depths));
    Some(Weakness { condition: high / low, groups, text, prior_only: prior_only(solution, &names) })
}

/// Nearest and farthest shot of a camera, by the head's depth.
fn depth_range(input: &Adjustment, solution: &Solution, camera: usize) -> Option<(f64, f64)> {
    let seen = |shot: &super::Shot| shot.sightings.iter().any(|s| s.camera == camera);
    let depths: Vec<f64> = input
        .shots()
        .iter()
        .zip(&solution.state.locals)
        .filter(|(shot, local)| seen(shot) && local[0] > 0.0)
        .map(|(_, local)| 1.0 / local[0])
        .collect();
    let (near, far) = (depths.iter().copied().reduce(f64::min)?, depths.iter().copied().reduce(f64::max)?);
    Some((near, far))
}

fn prior_only(solution: &Solution, names: &[String]) -> Vec<String> {
    let mut found = Vec::new();
    for prior in &solution.layout.priors {
        let Some((before, _)) = crate::geometry::linalg::invert_spd(&prior.information) else { continue };
        for (k, column) in prior.columns.iter().enumerate() {
            if solution.covariance[(*column, *column)] > 0.95 * 0.95 * before[(k, k)] {
                found.push(names[*column].clone());
            }
        }
    }
    found
}
