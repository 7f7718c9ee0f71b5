//! The self-check of a joint adjustment: all residuals, all fixed groups, all priors.

use super::adjusted::Solution;
use super::layout::{CameraColumns, Group, Layout, PLANE, State};
use super::linearise::Problem;
use crate::calibrate::check::{FitCheck, SUSPECT, Suspect, score_test, testable, widened};
use crate::geometry::RIG_PARAMETERS;
use crate::geometry::chi_square::upper_tail;

pub(super) fn check(problem: &Problem<'_>, solution: &Solution, data_chi2: f64) -> FitCheck {
    let layout = &solution.layout;
    let (mut rows, mut unknowns) = (0, layout.count);
    for shot in 0..problem.input.shots().len() {
        let measured: usize = problem.span(shot).filter(|v| solution.used[*v]).map(|v| problem.views[v].rows()).sum();
        if measured > 0 {
            rows += measured + problem.local_count() - 1;
            unknowns += problem.local_count();
        }
    }
    let mut chi2 = data_chi2;
    let mut warnings = Vec::new();
    for prior in &layout.priors {
        let (offset, _) = prior.offset(problem.input, &solution.state);
        let distance = offset.dot(&(&prior.information * &offset));
        rows += offset.len();
        chi2 += distance;
        if upper_tail(distance, offset.len() as f64) < SUSPECT {
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
    rows += layout.cameras.iter().map(|c| c.freedom.soft_priors()).sum::<usize>();
    let freedom = rows.saturating_sub(unknowns);
    FitCheck::new(chi2, freedom, suspects(problem, solution), warnings)
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
    let test = |c: Candidate| score_test(c.name, &c.columns, &original, &solution.covariance, h, |i| system.g[i]);
    let mut found: Vec<Suspect> = candidates.into_iter().filter_map(test).collect();
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
        planes: Vec::new(),
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
        camera.distortion = testable(camera.distortion);
        let (freedom, groups) = widened(&c.freedom, problem.input.cameras()[index].distortion, &camera.distortion);
        let start = layout.count;
        (0..c.freedom.count()).for_each(|k| original[c.first + k] = start + k);
        candidates.extend(groups.into_iter().map(|(what, places)| Candidate {
            name: format!("{what} of camera {index}"),
            columns: places.into_iter().map(|k| start + k).collect(),
        }));
        layout.count += freedom.count();
        layout.cameras.push(CameraColumns { first: start, freedom });
    }
    layout.add_planes(solved.planes.len());
    for (old, new) in solved.planes.iter().zip(&layout.planes) {
        (0..PLANE).for_each(|k| original[old + k] = new + k);
    }
    (layout, state, original, candidates)
}
