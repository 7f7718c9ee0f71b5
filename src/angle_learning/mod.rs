//! Learning what angles a head's own numbers mean: the camera turns over a scene with texture to planned
//! positions, and the turns between its pictures give both axes' maps, the camera's mounting on them, and
//! how well the head repeats itself.
//!
//! [`learn_angles`] drives a head and takes the pictures; [`solve`] is the pure part: matches between
//! frames to a [`LearnedAngles`]. Steps: features and turns of pairs of frames (`pairs`), a start from
//! them (`start`), pan and tilt of all frames together (`bundle`), smooth curves through them (`smooth`).
//!
//! What is not observable: where pan is 0 (a convention: where the device's number is 0, or the middle of
//! its range), and where the plumb line is. Tilt is 0 where the optical axis is perpendicular to the pan
//! axis. The camera's centre is hardly ever on the axes: in a near scene its shift looks like a part of
//! the turn, so the scene should be many times farther than a metre; what cannot be told apart is in the
//! result's standard deviations.

mod bundle;
mod capture;
mod pairs;
mod smooth;
mod start;
#[cfg(test)]
mod tests;

pub use bundle::Sight;
pub use capture::{LearningParts, LearningProgress, learn_angles};

use nalgebra::{DMatrix, DVector, Vector2};

use crate::control::Cancel;
use crate::error::{Degeneracy, Error, Result};
use crate::format::{AngleMapRecord, LearningRecord};
use crate::geometry::Camera;
use crate::geometry::angle_map::{AngleMap, AxisMap, MAX_NODES, Mounting};
use crate::rig::{FrameOptions, SettleOptions};
use bundle::{DepthPrior, Problem, Solution};
use pairs::Pair;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngleLearningOptions {
    /// Share of the picture by which neighbouring frames are apart.
    pub step: f64,
    /// Least number of positions of an axis; more when the picture is narrow.
    pub min_positions: usize,
    /// Most frames.
    pub max_frames: usize,
    /// Nearest and farthest distance of what is seen, metres (infinite is possible).
    pub scene: [f64; 2],
    /// How far the camera's centre is from the axes, metres: tilt_y, tilt_z, pan_x, pan_z as
    /// [`AxisOffsets`](crate::geometry::rig_model::AxisOffsets) has them, and their standard deviation.
    pub levers: [f64; 4],
    pub lever_sigma: f64,
    /// Least share of each axis's range that the map must cover.
    pub min_cover: f64,
    /// Greatest root mean square of the residuals, px.
    pub max_rms: f64,
    /// Every position is approached from below by this share of the range, against backlash.
    pub approach: f64,
    /// Tolerance and overshoot are replaced: they are in the device's unit.
    pub settle: SettleOptions,
    pub frames: FrameOptions,
}

impl Default for AngleLearningOptions {
    fn default() -> Self {
        Self {
            step: 0.3,
            min_positions: 7,
            max_frames: 400,
            scene: [2.0, 100.0],
            // Most lenses stand a little ahead of the axes.
            levers: [0.0, 0.02, 0.0, 0.02],
            lever_sigma: 0.015,
            min_cover: 0.5,
            max_rms: 2.0,
            approach: 0.01,
            settle: SettleOptions::default(),
            frames: FrameOptions::default(),
        }
    }
}

impl AngleLearningOptions {
    fn validate(&self) -> Result<()> {
        let within = |name, value: f64, [low, high]: [f64; 2]| {
            if value >= low && value <= high {
                Ok(())
            } else {
                Err(Error::invalid(name, format!("{value} is not in [{low}, {high}]")))
            }
        };
        within("step", self.step, [0.05, 0.6])?;
        within("scene", self.scene[0], [0.1, 1e6])?;
        within("lever_sigma", self.lever_sigma, [0.0, 1.0])?;
        within("min_cover", self.min_cover, [0.0, 1.0])?;
        within("max_rms", self.max_rms, [0.1, 100.0])?;
        within("approach", self.approach, [0.0, 0.2])?;
        for lever in self.levers {
            within("levers", lever, [-1.0, 1.0])?;
        }
        if self.scene[1].is_nan() || self.scene[1] < self.scene[0] {
            return Err(Error::invalid("scene", format!("{:?} m is no range", self.scene)));
        }
        if !(3..=MAX_NODES).contains(&self.min_positions) {
            return Err(Error::invalid("min_positions", format!("{} is not in [3, {MAX_NODES}]", self.min_positions)));
        }
        if !(9..=1000).contains(&self.max_frames) {
            return Err(Error::invalid("max_frames", format!("{} is not in [9, 1000]", self.max_frames)));
        }
        self.settle.validate()?;
        self.frames.validate()
    }

    fn depth_prior(&self) -> DepthPrior {
        let [near, far] = self.scene.map(f64::recip);
        let sigma = (0.5 * (near - far)).max(1e-6);
        DepthPrior::new([0.5 * (near + far), sigma], self.levers, self.lever_sigma)
    }
}

/// One frame's place, and how far from the map it turned out to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameResidual {
    /// The device's pan and tilt.
    pub raw: [f64; 2],
    /// Deviation of pan and tilt from the map, radians.
    pub deviation: [f64; 2],
    /// Root mean square of its sights' residuals, px, and their number.
    pub rms: f64,
    pub sights: u32,
}

/// How far two frames' matches are from the result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairResidual {
    /// Indices of frames.
    pub frames: [u32; 2],
    pub matches: u32,
    /// px: of the sights of the scene points that both frames see.
    pub rms: f64,
}

/// A map and how it was found.
#[derive(Debug, Clone, PartialEq)]
pub struct LearnedAngles {
    pub map: AngleMap,
    pub frames: Vec<FrameResidual>,
    pub pairs: Vec<PairResidual>,
    /// Of all sights, px, outliers (beyond 5 times the median) left out.
    pub rms: f64,
    /// Share of outliers.
    pub outliers: f64,
    /// How far the head is from the map each time, pan and tilt, radians (standard deviation).
    pub repeatability: [f64; 2],
    /// Which share of a pan the pictures' shift would be mistaken for were the camera taken to be on the
    /// axis (lever arm over distance, on average), and its standard deviation: 0.01 is 1 degree of 100.
    pub parallax: f64,
    pub parallax_sigma: f64,
}

impl LearnedAngles {
    /// What a file of the map holds.
    pub fn record(&self) -> AngleMapRecord {
        let learned = LearningRecord {
            rms: self.rms,
            outliers: self.outliers,
            repeatability: self.repeatability,
            parallax: self.parallax,
            parallax_sigma: self.parallax_sigma,
            frames: self.frames.iter().map(|f| (f.raw, f.deviation, f.rms, f.sights)).collect(),
            pairs: self.pairs.iter().map(|p| (p.frames, p.matches, p.rms)).collect(),
        };
        AngleMapRecord { map: self.map.clone(), learned: Some(learned) }
    }
}

/// Frames and the scene points that they see.
#[derive(Debug, Clone, Default)]
pub struct AngleViews {
    /// The device's pan and tilt of each frame, as it read them.
    pub raw: Vec<[f64; 2]>,
    /// Start values: pan and tilt of each frame, radians.
    pub angles: Vec<[f64; 2]>,
    pub mounting: Mounting,
    /// Sights of the same point by different frames, two at least; their sigma in px.
    pub tracks: Vec<Vec<Sight>>,
}

/// The maps of both axes from what frames see.
///
/// # Errors
/// `InvalidArgument`; `TooFewMatches`; `NoConvergence`; `Degenerate` when the frames hang together too
/// loosely, or only with a parallax that contradicts the options; `NoConsensus` when
/// the residuals are too large for a camera that turns about two axes; `Ambiguous` when an axis's angle
/// turns back.
pub fn solve(
    views: &AngleViews,
    camera: &Camera,
    options: &AngleLearningOptions,
    cancel: &Cancel,
) -> Result<LearnedAngles> {
    options.validate()?;
    camera.validate()?;
    check(views)?;
    let problem = Problem { camera, tracks: &views.tracks, prior: options.depth_prior(), reference: 0, cancel };
    let start = bundle::State::new(views.mounting, views.angles.clone(), &problem);
    let solution = problem.solve(start)?;
    let (rms, outliers) = spread(&solution.residuals);
    if !(rms <= options.max_rms && outliers < 0.5) {
        let total: usize = views.tracks.iter().map(Vec::len).sum();
        return Err(Error::NoConsensus { inliers: ((1.0 - outliers) * total as f64) as usize, total });
    }
    check_parallax(&solution, &problem.prior)?;
    let (pan, pan_curve) = axis(0, views, &solution)?;
    let (tilt, tilt_curve) = axis(1, views, &solution)?;
    let map = AngleMap::new(pan, tilt, solution.state.mounting, solution.mounting_sigma)?;
    let frames = frame_residuals(views, &solution, [&pan_curve.deviations, &tilt_curve.deviations]);
    Ok(LearnedAngles {
        map,
        frames,
        pairs: pair_residuals(views, &solution),
        rms,
        outliers,
        repeatability: [pan_curve.repeatability, tilt_curve.repeatability],
        parallax: solution.state.ahead() * solution.state.mean,
        parallax_sigma: solution.state.ahead().abs() * solution.mean_sigma,
    })
}

fn check(views: &AngleViews) -> Result<()> {
    let n = views.raw.len();
    if n < 3 || views.angles.len() != n {
        return Err(Error::invalid("views", format!("{n} frames with {} angles; 3 are needed", views.angles.len())));
    }
    if let Some(index) = views.raw.iter().chain(&views.angles).flatten().position(|v| !v.is_finite()) {
        return Err(Error::NotFinite { name: "views", index: index / 2 % n });
    }
    let mut seen = vec![0usize; n];
    for (index, track) in views.tracks.iter().enumerate() {
        let good = |s: &Sight| s.frame < n && s.pixel.iter().all(|v| v.is_finite()) && s.sigma > 0.0 && s.sigma < 1e6;
        if track.len() < 2 || !track.iter().all(good) {
            return Err(Error::invalid(
                "tracks",
                format!("track {index} is not two or more sights by frames that exist"),
            ));
        }
        track.iter().for_each(|s| seen[s.frame] += 1);
    }
    if let Some(frame) = seen.iter().position(|count| *count < pairs::MIN_MATCHES) {
        let detail = format!("frame {frame} shares {} points with others", seen[frame]);
        return Err(Error::TooFewMatches { needed: pairs::MIN_MATCHES, detail });
    }
    Ok(())
}

/// A wrong lens, and a scene that is nearer than said, look like a camera far off the axes.
fn check_parallax(solution: &Solution, prior: &DepthPrior) -> Result<()> {
    const MOST: f64 = 4.0;
    let (mean, ahead) = (solution.state.mean, solution.state.ahead());
    if (mean - prior.inverse_depth).abs() <= MOST * prior.sigma {
        return Ok(());
    }
    let detail = format!(
        "the pictures fit only when the camera's shift makes {:.1} % of a turn, where lever arms and distances of the options \
         say {:.1} % (standard deviation {:.1} %): another lens or zoom than the camera's, or a nearer scene",
        100.0 * ahead * mean,
        100.0 * ahead * prior.inverse_depth,
        100.0 * ahead.abs() * prior.sigma
    );
    Err(Error::degenerate(Degeneracy::IllConditioned, detail))
}

/// One axis: nodes at the distinct positions, the pan's zero at the device's 0 or in the middle.
fn axis(k: usize, views: &AngleViews, solution: &Solution) -> Result<(AxisMap, smooth::Curve)> {
    let raw: Vec<f64> = views.raw.iter().map(|r| r[k]).collect();
    let n = raw.len();
    let y = DVector::from_iterator(n, solution.state.angles.iter().map(|a| a[k]));
    let covariance = DMatrix::from_fn(n, n, |i, j| solution.covariance[(2 * i + k, 2 * j + k)]);
    let nodes = nodes(&raw);
    let mut curve = smooth::fit(&raw, &y, &covariance, &nodes)?;
    let map = |curve: &smooth::Curve| {
        let places = nodes.iter().copied().zip(curve.angles.iter().copied()).map(|(r, a)| [r, a]).collect();
        AxisMap::new(places, curve.covariance.clone(), curve.roughness)
    };
    let turns_back = |_| Error::Ambiguous {
        reason: format!("the angle of {} does not go one way over the device's range", ["pan", "tilt"][k]),
    };
    if k == 0 {
        let [low, high] = [nodes[0], nodes[nodes.len() - 1]];
        let zero = if low <= 0.0 && high >= 0.0 { 0.0 } else { 0.5 * (low + high) };
        let before = map(&curve).map_err(turns_back)?;
        let weights = crate::geometry::spline::monotone(&nodes, curve.angles.as_slice(), zero).1;
        let shift = before.angle(zero)?;
        let count = nodes.len();
        let by = DMatrix::from_fn(count, count, |i, j| f64::from(i == j) - weights[j]);
        let c = &by * &curve.covariance * by.transpose();
        curve.covariance = DMatrix::from_fn(count, count, |i, j| 0.5 * (c[(i, j)] + c[(j, i)]));
        curve.angles.add_scalar_mut(-shift);
    }
    let map = map(&curve).map_err(turns_back)?;
    Ok((map, curve))
}

/// Distinct numbers, 64 at most, ascending; the first and the last are among them.
fn nodes(raw: &[f64]) -> Vec<f64> {
    let mut sorted = raw.to_vec();
    sorted.sort_by(f64::total_cmp);
    let span = sorted[sorted.len() - 1] - sorted[0];
    // What the device's rounding makes of one position is one node.
    let apart = span / (2 * (MAX_NODES - 1)) as f64;
    let mut nodes: Vec<f64> = Vec::new();
    for r in sorted.iter().copied() {
        if nodes.last().is_none_or(|last| r - last > apart) {
            nodes.push(r);
        }
    }
    if let Some(last) = nodes.last_mut() {
        *last = sorted[sorted.len() - 1];
    }
    if nodes.len() > MAX_NODES {
        nodes = (0..MAX_NODES).map(|i| sorted[0] + span * i as f64 / (MAX_NODES - 1) as f64).collect();
    }
    nodes
}

/// Root mean square of the residuals within 5 times the median, and the share of the others.
fn spread(residuals: &[Vec<Vector2<f64>>]) -> (f64, f64) {
    let mut norms: Vec<f64> = residuals.iter().flatten().map(|r| r.norm()).collect();
    if norms.is_empty() {
        return (0.0, 0.0);
    }
    norms.sort_by(f64::total_cmp);
    let limit = 5.0 * norms[norms.len() / 2];
    let inside: Vec<f64> = norms.iter().copied().take_while(|n| *n <= limit).collect();
    (root_mean_square(inside.iter().map(|n| n * n)), 1.0 - inside.len() as f64 / norms.len() as f64)
}

fn root_mean_square(squares: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for square in squares {
        sum += square;
        count += 1.0;
    }
    if count > 0.0 { f64::sqrt(sum / count) } else { 0.0 }
}

fn frame_residuals(views: &AngleViews, solution: &Solution, deviations: [&Vec<f64>; 2]) -> Vec<FrameResidual> {
    let mut squares: Vec<Vec<f64>> = vec![Vec::new(); views.raw.len()];
    for (track, residuals) in views.tracks.iter().zip(&solution.residuals) {
        track.iter().zip(residuals).for_each(|(s, r)| squares[s.frame].push(r.norm_squared()));
    }
    let frame = |k: usize| FrameResidual {
        raw: views.raw[k],
        deviation: deviations.map(|d| d[k]),
        // Wrong matches would hide the rest.
        rms: trimmed(&mut squares[k].clone()),
        sights: squares[k].len() as u32,
    };
    (0..views.raw.len()).map(frame).collect()
}

fn pair_residuals(views: &AngleViews, solution: &Solution) -> Vec<PairResidual> {
    let mut squares = std::collections::BTreeMap::<[u32; 2], Vec<f64>>::new();
    for (track, residuals) in views.tracks.iter().zip(&solution.residuals) {
        for (i, j) in (0..track.len()).flat_map(|i| (i + 1..track.len()).map(move |j| (i, j))) {
            let [a, b] = [track[i].frame as u32, track[j].frame as u32];
            let square = 0.5 * (residuals[i].norm_squared() + residuals[j].norm_squared());
            squares.entry([a.min(b), a.max(b)]).or_default().push(square);
        }
    }
    squares
        .into_iter()
        .map(|(frames, mut all)| PairResidual { frames, matches: all.len() as u32, rms: trimmed(&mut all) })
        .collect()
}

/// Root mean square of the squares within 25 times their median.
fn trimmed(squares: &mut [f64]) -> f64 {
    squares.sort_by(f64::total_cmp);
    let limit = 25.0 * squares.get(squares.len() / 2).copied().unwrap_or(0.0);
    root_mean_square(squares.iter().copied().take_while(|s| *s <= limit))
}

/// Points that several frames see, from matches of pairs: features that are matched, directly or by way of
/// others, are one point. `frames[k]`: the new number of frame k, if it is used.
fn tracks(features: &[pairs::Features], pairs: &[Pair], frames: &[Option<usize>]) -> Vec<Vec<Sight>> {
    let first: Vec<usize> = features
        .iter()
        .scan(0, |sum, f| {
            let at = *sum;
            *sum += f.pixels.len();
            Some(at)
        })
        .collect();
    let total: usize = features.iter().map(|f| f.pixels.len()).sum();
    let mut parent: Vec<usize> = (0..total).collect();
    fn root(parent: &mut [usize], mut i: usize) -> usize {
        while parent[i] != i {
            parent[i] = parent[parent[i]];
            i = parent[i];
        }
        i
    }
    for p in pairs.iter().filter(|p| frames[p.a].is_some() && frames[p.b].is_some()) {
        for [i, j] in &p.matches {
            let (a, b) = (root(&mut parent, first[p.a] + i), root(&mut parent, first[p.b] + j));
            parent[a.max(b)] = a.min(b);
        }
    }
    let mut found = std::collections::BTreeMap::<usize, Vec<Sight>>::new();
    for (k, f) in features.iter().enumerate() {
        let Some(frame) = frames[k] else { continue };
        for i in 0..f.pixels.len() {
            let sight = Sight { frame, pixel: f.pixels[i], sigma: f.sigmas[i] };
            found.entry(root(&mut parent, first[k] + i)).or_default().push(sight);
        }
    }
    // A frame that sees a point twice has matched something wrongly.
    let once = |t: &Vec<Sight>| (1..t.len()).all(|i| t[..i].iter().all(|s| s.frame != t[i].frame));
    found.into_values().filter(|t| t.len() >= 2 && once(t)).collect()
}
