//! What a joint adjustment determines worst, or not at all.

use faer::Mat;

use super::adjusted::Solution;
use super::layout::{Layout, State};
use super::problem::Adjustment;
use crate::calibrate::weakness::{Weakness, advice, sentence, shares, spectrum};

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

/// The weakest direction of a solution.
pub(super) fn weakest(input: &Adjustment, solution: &Solution) -> Option<Weakness> {
    let names = solution.layout.names(&solution.state);
    let weakness = Weakness::of(&solution.normal, &names, |camera| depth_range(input, solution, camera))?;
    Some(Weakness { prior_only: prior_only(solution, &names), ..weakness })
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
        for &(column, parameter) in &prior.columns {
            let Some(k) = prior.parameters.iter().position(|p| *p == parameter) else { continue };
            if solution.covariance[(column, column)] > 0.95 * 0.95 * before[(k, k)] {
                found.push(names[column].clone());
            }
        }
    }
    found
}
