//! Does the model fit the data? A chi-square test of all residuals and, for every group of
//! parameters that was kept fixed, a score test (Rao 1948) of what freeing it would gain.

use nalgebra::{DMatrix, DVector};

use super::adjusted::Solution;
use super::layout::{CameraColumns, Group, Layout, State};
use super::linearise::Problem;
use crate::calibrate::freedom::{Freedom, Unknown};
use crate::geometry::chi_square::upper_tail;
use crate::geometry::{Distortion, RIG_PARAMETERS};

/// A chance below which a misfit is no accident.
pub(super) const SURE: f64 = 1e-3;
/// The same for one of many groups.
const SUSPECT: f64 = 1e-5;

/// The self-check of an adjustment.
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

pub(super) fn check(problem: &Problem<'_>, solution: &Solution, data_chi2: f64) -> FitCheck {
    let layout = &solution.layout;
    let (mut rows, mut unknowns) = (0, layout.count);
    for shot in 0..problem.input.shots().len() {
        let views = problem.span(shot).filter(|v| solution.used[*v]).count();
        if views > 0 {
            rows += 2 * views + problem.local_count() - 1;
            unknowns += problem.local_count();
        }
    }
    let mut chi2 = data_chi2;
    let mut warnings = Vec::new();
    for prior in &layout.priors {
        let offset = prior.offset(problem.input, &solution.state);
        let distance = offset.dot(&(&prior.information * &offset));
        rows += prior.columns.len();
        chi2 += distance;
        if upper_tail(distance, prior.columns.len() as f64) < SUSPECT {
            let owner = match prior.group {
                Group::Rig => "the rig".to_owned(),
                Group::Station(i) => format!("station {i}"),
                Group::Camera(i) => format!("camera {i}"),
            };
            warnings.push(format!(
                "the prior of {owner} contradicts the data: the estimate is {:.1} of its standard deviations away",
                distance.sqrt()
            ));
        }
    }
    rows += layout.cameras.iter().map(|c| c.freedom.priors.len()).sum::<usize>();
    let freedom = rows.saturating_sub(unknowns);
    let probability = upper_tail(chi2, freedom as f64);
    let suspects = suspects(problem, solution);
    let mut fit = FitCheck { chi2, freedom, probability, suspects, warnings };
    let misfit = probability < SURE;
    if misfit {
        fit.warnings.insert(
            0,
            format!(
                "the residuals are {:.2} times the stated noise (chi-square {chi2:.0} for {freedom} degrees of freedom)",
                fit.spread()
            ),
        );
    }
    for s in &fit.suspects {
        let part = 100.0 * s.gain / (chi2 - freedom as f64).max(s.gain);
        fit.warnings.push(format!(
            "{} should not be fixed: freeing it would lower chi-square by {:.0}, {part:.0} % of the excess",
            s.group, s.gain
        ));
    }
    if misfit && fit.suspects.is_empty() {
        fit.warnings.push("no fixed parameter explains it: check the spots' covariances and the lens models".into());
    }
    fit
}

/// A group of columns that the extended problem has beyond the solved one.
struct Candidate {
    name: String,
    columns: Vec<usize>,
}

/// Score tests of all fixed groups, at the solution, with every parameter's derivatives at hand.
fn suspects(problem: &Problem<'_>, solution: &Solution) -> Vec<Suspect> {
    let (layout, state, original, candidates) = extended(problem, solution);
    if candidates.is_empty() {
        return Vec::new();
    }
    let wide = problem.with_layout(&layout);
    let Some(system) = wide.linearise(&state, &solution.used) else { return Vec::new() };
    let h = |i: usize, j: usize| system.h[(i.max(j), i.min(j))];
    let mut found: Vec<Suspect> = candidates
        .into_iter()
        .filter_map(|candidate| {
            let (g, n) = (&candidate.columns, original.len());
            let across = DMatrix::from_fn(g.len(), n, |i, j| h(g[i], original[j]));
            let own = DMatrix::from_fn(g.len(), g.len(), |i, j| h(g[i], g[j]));
            let left = &own - &across * &solution.covariance * across.transpose();
            // What the others explain entirely cannot be tested: it only moves the frame.
            let kept: Vec<usize> = (0..g.len()).filter(|i| left[(*i, *i)] > 1e-9 * own[(*i, *i)]).collect();
            let block = DMatrix::from_fn(kept.len(), kept.len(), |i, j| left[(kept[i], kept[j])]);
            let score = DVector::from_fn(kept.len(), |i, _| system.g[g[kept[i]]]);
            if kept.is_empty() {
                return None;
            }
            let (inverse, _) = crate::geometry::linalg::invert_spd(&block)?;
            let gain = score.dot(&(inverse * &score));
            let probability = upper_tail(gain, kept.len() as f64);
            (probability < SUSPECT).then_some(Suspect {
                group: candidate.name,
                gain,
                parameters: kept.len(),
                probability,
            })
        })
        .collect();
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    found
}

/// The problem with everything free that a solution could have freed: layout, state, the solved
/// columns' places in it, and the new ones by group.
fn extended(problem: &Problem<'_>, solution: &Solution) -> (Layout, State, Vec<usize>, Vec<Candidate>) {
    let solved = &solution.layout;
    let mut state = solution.state.clone();
    let (mut original, mut candidates) = (vec![0; solved.count], Vec::new());
    let mut layout = Layout {
        rig: (0..RIG_PARAMETERS).collect(),
        stations: Vec::new(),
        cameras: Vec::new(),
        // Scores are of the data: at the solution the priors' pull on solved columns cancels theirs.
        priors: Vec::new(),
        count: RIG_PARAMETERS,
    };
    for (column, parameter) in solved.rig.iter().enumerate() {
        original[column] = *parameter;
    }
    // The pan zero turns the world: no data know it.
    for (name, parameters) in [
        ("the laser line", vec![0, 1, 2, 3]),
        ("the head camera's intrinsics", vec![4, 5, 6]),
        ("the axis offsets", vec![7, 8, 9, 10]),
        ("the pan encoder", vec![12]),
        ("the tilt encoder", vec![13, 14]),
    ] {
        let columns: Vec<usize> = parameters.into_iter().filter(|p| !solved.rig.contains(p)).collect();
        if !columns.is_empty() {
            candidates.push(Candidate { name: name.into(), columns });
        }
    }
    for (index, (first, free)) in solved.stations.iter().enumerate() {
        let start = layout.count;
        free.iter().enumerate().for_each(|(k, i)| original[first + k] = start + i);
        let columns: Vec<usize> = (0..6).filter(|i| !free.contains(i)).map(|i| start + i).collect();
        // The first station's pose is the world's frame.
        if index > 0 && !columns.is_empty() {
            candidates.push(Candidate { name: format!("the pose of station {index}"), columns });
        }
        layout.stations.push((start, (0..6).collect()));
        layout.count += 6;
    }
    for (index, c) in solved.cameras.iter().enumerate() {
        let camera = &mut state.cameras[index];
        if camera.distortion == Distortion::None {
            camera.distortion = Distortion::BrownConrady([0.0; 5]);
        }
        let mut unknowns = c.freedom.unknowns.clone();
        let start = layout.count;
        (0..unknowns.len()).for_each(|k| original[c.first + k] = start + k);
        let lens = problem.input.cameras()[index].distortion;
        for (what, parameters) in lens_groups(lens, &camera.distortion) {
            let mut columns = Vec::new();
            for parameter in parameters {
                if !unknowns.iter().any(|u| u.moves(parameter)) {
                    columns.push(start + unknowns.len());
                    unknowns.push(Unknown { parameter, tied: None });
                }
            }
            if !columns.is_empty() {
                candidates.push(Candidate { name: format!("{what} of camera {index}"), columns });
            }
        }
        layout.count += unknowns.len();
        let freedom = Freedom { unknowns, priors: c.freedom.priors.clone() };
        layout.cameras.push(CameraColumns { first: start, freedom });
    }
    (layout, state, original, candidates)
}

/// Groups of a camera's sixteen parameters to test.
fn lens_groups(model: crate::calibrate::DistortionModel, distortion: &Distortion) -> Vec<(&'static str, Vec<usize>)> {
    use crate::calibrate::DistortionModel as M;
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
