//! Does the model fit the data? A chi-square test of all residuals and, for every group of
//! parameters that was kept fixed, a score test (Rao 1948) of what freeing it would gain.

use nalgebra::{DMatrix, DVector};

use super::DistortionModel;
use super::freedom::{Freedom, Unknown};
use super::refine::{Refined, Refinement};
use crate::geometry::Distortion;
use crate::geometry::chi_square::upper_tail;

/// A chance below which a misfit is no accident.
pub(crate) const SURE: f64 = 1e-3;
/// The same for one of many groups.
pub(crate) const SUSPECT: f64 = 1e-5;

/// The self-check of a calibration or an adjustment.
#[derive(Debug, Clone, PartialEq)]
pub struct FitCheck {
    /// Sum of squared whitened residuals, priors included.
    pub chi2: f64,
    /// Its degrees of freedom.
    pub freedom: usize,
    /// Chance of such residuals or larger when model and stated noise are right.
    pub probability: f64,
    /// Groups of fixed parameters that the data want to move, the most wanted first.
    pub suspects: Vec<Suspect>,
    /// What a person should know, in words; empty when all is well.
    pub warnings: Vec<String>,
}

/// A group of parameters that was fixed, and should perhaps not have been.
#[derive(Debug, Clone, PartialEq)]
pub struct Suspect {
    pub group: String,
    /// By how much chi2 would fall if the group were free (first order).
    pub gain: f64,
    /// Parameters of the group: the gain's degrees of freedom.
    pub parameters: usize,
    pub probability: f64,
}

impl FitCheck {
    /// Do model and stated noise explain the residuals?
    pub fn passed(&self) -> bool {
        self.probability >= SURE && self.suspects.is_empty()
    }

    /// Observed over stated noise.
    pub fn spread(&self) -> f64 {
        if self.freedom == 0 { 1.0 } else { (self.chi2 / self.freedom as f64).sqrt() }
    }
}

impl FitCheck {
    /// Words for what was found; `warnings` come first.
    pub(crate) fn new(chi2: f64, freedom: usize, suspects: Vec<Suspect>, mut warnings: Vec<String>) -> Self {
        let probability = upper_tail(chi2, freedom as f64);
        let misfit = probability < SURE;
        let spread = (chi2 / freedom.max(1) as f64).sqrt();
        if misfit {
            warnings.push(format!(
                "the residuals are {spread:.2} times the stated noise (chi-square {chi2:.0} for {freedom} degrees of freedom)"
            ));
        }
        for s in &suspects {
            let part = 100.0 * s.gain / (chi2 - freedom as f64).max(s.gain);
            let excess = if misfit { format!(", {part:.0} % of the excess") } else { String::new() };
            warnings.push(format!(
                "{} should not be fixed: freeing it would lower chi-square by {:.0}{excess}",
                s.group, s.gain
            ));
        }
        if misfit && suspects.is_empty() {
            warnings.push("no fixed parameter explains it: check the spots' covariances and the lens models".into());
        }
        Self { chi2, freedom, probability, suspects, warnings }
    }
}

/// Rao's score test of the columns `group` that a solution left out: `h` and `g` with them, `solved`
/// the columns that it had, with their covariance. `None` when the data cannot tell, or are content.
pub(crate) fn score_test(
    name: String,
    group: &[usize],
    solved: &[usize],
    covariance: &DMatrix<f64>,
    h: impl Fn(usize, usize) -> f64,
    g: impl Fn(usize) -> f64,
) -> Option<Suspect> {
    let across = DMatrix::from_fn(group.len(), solved.len(), |i, j| h(group[i], solved[j]));
    let own = DMatrix::from_fn(group.len(), group.len(), |i, j| h(group[i], group[j]));
    let left = &own - &across * covariance * across.transpose();
    // Directions that the others explain entirely cannot be tested: they only move the frame, or scale
    // the world with the laser's offset.
    let unit: Vec<f64> = (0..group.len()).map(|i| 1.0 / own[(i, i)].max(f64::MIN_POSITIVE).sqrt()).collect();
    let scaled = DMatrix::from_fn(group.len(), group.len(), |i, j| left[(i, j)] * unit[i] * unit[j]);
    if scaled.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let eigen = scaled.try_symmetric_eigen(f64::EPSILON, 10_000)?;
    let score = DVector::from_fn(group.len(), |i, _| g(group[i]) * unit[i]);
    let (mut gain, mut parameters) = (0.0, 0);
    for (value, direction) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > 1e-9 {
            gain += direction.dot(&score).powi(2) / value;
            parameters += 1;
        }
    }
    if parameters == 0 {
        return None;
    }
    let probability = upper_tail(gain, parameters as f64);
    (probability < SUSPECT).then_some(Suspect { group: name, gain, parameters, probability })
}

/// A camera's freedom with all that it lacks, and by group the places of what was added. The
/// distortion must be one that has coefficients to test.
pub(crate) fn widened(
    freedom: &Freedom,
    model: DistortionModel,
    distortion: &Distortion,
) -> (Freedom, Vec<(&'static str, Vec<usize>)>) {
    let mut unknowns = freedom.unknowns.clone();
    let mut groups = Vec::new();
    for (what, parameters) in groups_of(model, distortion) {
        let mut places = Vec::new();
        for parameter in parameters {
            if !unknowns.iter().any(|u| u.moves(parameter)) {
                places.push(unknowns.len());
                unknowns.push(Unknown { parameter, tied: None });
            }
        }
        if !places.is_empty() {
            groups.push((what, places));
        }
    }
    (Freedom { unknowns, priors: freedom.priors.clone() }, groups)
}

/// A lens to test where a camera has none.
pub(crate) fn testable(distortion: Distortion) -> Distortion {
    if distortion == Distortion::None { Distortion::BrownConrady([0.0; 5]) } else { distortion }
}

/// Groups of a camera's sixteen parameters to test.
fn groups_of(model: DistortionModel, distortion: &Distortion) -> Vec<(&'static str, Vec<usize>)> {
    use DistortionModel as M;
    let lens = match (model, distortion) {
        (M::None | M::Radial1, Distortion::BrownConrady(_)) => vec![5, 6],
        (M::Radial2, _) => vec![7, 8],
        (_, Distortion::None) => Vec::new(),
        _ => vec![5],
    };
    vec![
        ("the focal length and principal point", vec![0, 3, 4]),
        ("the lens distortion", lens),
        ("the skew", vec![2]),
        ("the pose", (10..16).collect()),
    ]
}

/// The self-check of one camera's refinement on the measurements that it used.
pub(super) fn check(
    refinement: &Refinement<'_>,
    refined: &Refined,
    freedom: &Freedom,
    model: DistortionModel,
) -> FitCheck {
    let used = refinement.measurements().len();
    let count = (2 * used + freedom.soft_priors()).saturating_sub(freedom.count());
    let mut suspects = suspects(refinement, refined, freedom, model).unwrap_or_default();
    suspects.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    FitCheck::new(refined.cost, count, suspects, Vec::new())
}

fn suspects(
    refinement: &Refinement<'_>,
    refined: &Refined,
    freedom: &Freedom,
    model: DistortionModel,
) -> Option<Vec<Suspect>> {
    let mut camera = refined.camera;
    camera.distortion = testable(camera.distortion);
    let (wide, groups) = widened(freedom, model, &camera.distortion);
    let normal = refinement.widened(&camera, &wide)?;
    let solved: Vec<usize> = (0..freedom.count()).collect();
    let test = |(name, places): (&str, Vec<usize>)| {
        score_test(name.to_owned(), &places, &solved, &refined.columns, |i, j| normal.h[(i, j)], |i| normal.g[i])
    };
    Some(groups.into_iter().filter_map(test).collect())
}
