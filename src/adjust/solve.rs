//! Levenberg-Marquardt on the reduced normal equations, outliers set aside in turns, and the gates.

use faer::prelude::Solve;
use faer::{Mat, Side};
use nalgebra::DMatrix;

use super::adjusted::{Adjusted, Solution};
use super::layout::{Layout, State};
use super::linearise::{Problem, System, Witness};
use super::problem::{AdjustOptions, Adjustment};
use super::{outliers, start, weakness};
use crate::calibrate::weakness::scaled;
use crate::error::{Degeneracy, Error, Result};

const MAX_ROUNDS: usize = 20;
/// Squared step, in standard deviations of all unknowns together, at which the outliers are looked at again:
/// residuals then move by far less than their noise. And the end.
const PROVISIONAL: f64 = 1.0;
const FINAL: f64 = 1e-9;
/// Damping of the first step, and the least after one that failed.
const CAUTIOUS: f64 = 1e-4;
/// The least until all directions are known to be determined: along others steps have no end.
const HELD: f64 = 1e-8;
/// None any more.
const UNDAMPED: f64 = 1e-12;
/// With more of it a short step says nothing of convergence.
const DAMPED: f64 = 1e-2;
/// Steps far below the noise and yet uphill, from which on the cost has no minimum that its curvature describes.
const FLAT: usize = 10;
/// Information that is left of a parameter at unit diagonal, inverted, beyond which it is not determined: rounding
/// alone leaves 1e-13 to 1e-16 of a direction that the data do not have.
const MAX_CONDITION: f64 = 1e12;

/// Solves a survey: all free parameters with their covariance.
///
/// # Errors
/// `InvalidArgument` (with the parameter's name), `TooFewPoints`, `Camera` (with the camera's index
/// and its own reason), `BadState` (a station that nothing ties), `Degenerate` (with the weakest
/// direction in words), `BehindCamera` (shot; only when not robust), `NoConsensus`, `NoConvergence`,
/// `LensNotMonotone`, `Cancelled`.
pub fn adjust(input: &Adjustment, options: &AdjustOptions) -> Result<Adjusted> {
    validate(options)?;
    let layout = Layout::of(input)?;
    if layout.count == 0 {
        return Err(Error::BadState { reason: "every parameter is fixed: there is nothing to estimate".into() });
    }
    demand_sightings(input, &layout)?;
    let mut state = start::start(input, options)?;
    let mut problem = Problem::new(input, &layout, &state, options)?;
    let mut used = vec![true; problem.views.len()];
    let mut factor = 1.0;
    let mut search = Search { tolerance: PROVISIONAL, damping: CAUTIOUS, iterations: 0 };
    for round in 0..MAX_ROUNDS {
        let distances = outliers::distances(&problem, &state, &used);
        // Before the first solution all is provisional.
        let mut settled = round > 0;
        if options.robust {
            factor = outliers::noise_factor(&distances, &problem, &used);
            let next = outliers::classify(&distances, &problem, &used, factor, round == 0);
            settled &= next == used;
            used = next;
        } else {
            outliers::demand_all(&distances, &problem)?;
        }
        if settled && search.tolerance == FINAL {
            break;
        }
        demand_enough(&problem, &used)?;
        if settled || !options.robust || round + 1 == MAX_ROUNDS {
            search.tolerance = FINAL;
        }
        problem.huber = options.huber * factor;
        state = search.minimise(&problem, state, &used, options)?;
    }
    finish(&problem, state, used, factor, search.iterations, options)
}

fn validate(options: &AdjustOptions) -> Result<()> {
    for s in options.pointing_sigma {
        if !(s.is_finite() && s >= 0.0) {
            return Err(Error::invalid("pointing_sigma", format!("{s} is no standard deviation")));
        }
    }
    if options.huber.is_nan() || options.huber <= 0.0 {
        return Err(Error::invalid("huber", format!("{} is not positive", options.huber)));
    }
    if options.max_focal_deviation.is_nan() || options.max_focal_deviation <= 0.0 {
        return Err(Error::invalid("max_focal_deviation", format!("{}", options.max_focal_deviation)));
    }
    if options.max_station_deviation.is_nan() || options.max_station_deviation <= 0.0 {
        return Err(Error::invalid("max_station_deviation", format!("{}", options.max_station_deviation)));
    }
    if options.max_iterations == 0 {
        return Err(Error::invalid("max_iterations", "0"));
    }
    Ok(())
}

/// Every camera with something to find must have been lit at all.
fn demand_sightings(input: &Adjustment, layout: &Layout) -> Result<()> {
    if input.shots().is_empty() {
        return Err(Error::TooFewPoints { given: 0, needed: 6 });
    }
    let mut counts = vec![0; input.cameras().len()];
    input.shots().iter().flat_map(|s| &s.sightings).for_each(|s| counts[s.camera] += 1);
    for (index, count) in counts.iter().enumerate() {
        if *count == 0 && layout.cameras[index].freedom.count() > 0 && input.cameras()[index].prior.is_none() {
            return Err(Error::in_camera(index, Error::TooFewPoints { given: 0, needed: 6 }));
        }
    }
    Ok(())
}

/// A camera of which most spots disagree was not calibrated.
fn demand_enough(problem: &Problem<'_>, used: &[bool]) -> Result<()> {
    let mut counts = vec![(0, 0); problem.input.cameras().len()];
    for (view, used) in problem.views.iter().zip(used) {
        if let Some(Witness::Camera(camera)) = view.by {
            counts[camera].0 += usize::from(*used);
            counts[camera].1 += 1;
        }
    }
    match counts.iter().position(|(inliers, total)| inliers * 5 < total * 2) {
        None => Ok(()),
        Some(i) => Err(Error::in_camera(i, Error::NoConsensus { inliers: counts[i].0, total: counts[i].1 })),
    }
}

fn no_convergence(iterations: usize, detail: impl Into<String>) -> Error {
    Error::NoConvergence { iterations, detail: detail.into() }
}

/// Levenberg-Marquardt that is taken up again after every look at the outliers.
struct Search {
    /// Squared length of a step, in standard deviations, that ends it.
    tolerance: f64,
    /// Kept from one turn to the next: from too much of it the least determined directions creep.
    damping: f64,
    iterations: usize,
}

impl Search {
    fn minimise(
        &mut self,
        problem: &Problem<'_>,
        mut state: State,
        used: &[bool],
        options: &AdjustOptions,
    ) -> Result<State> {
        let mut system = problem
            .linearise(&state, used)
            .ok_or_else(|| no_convergence(0, "a spot cannot be predicted at the first estimate"))?;
        let last = self.tolerance == FINAL;
        if last {
            demand_determined(&system, problem.layout, &state)?;
        }
        let (mut undamped_failed, mut flat) = (false, 0);
        for _ in 0..options.max_iterations {
            options.cancel.check()?;
            self.iterations += 1;
            let next = damped_step(&system, self.damping).and_then(|step| {
                let next = stepped(problem, &state, &system, &step)?;
                Some((next, squared_length(&system, &step, self.damping)))
            });
            // Far below the noise, and no longer to be told from rounding in the cost.
            if let Some((next, length)) = &next
                && self.damping < DAMPED
                && *length <= self.tolerance.max(1e-13 * system.cost)
            {
                if !last || self.damping <= UNDAMPED || undamped_failed {
                    return Ok(next.clone());
                }
                // Perhaps short only because the least determined directions are held.
                self.damping = UNDAMPED;
                continue;
            }
            let below_noise = next.as_ref().is_some_and(|(_, length)| *length < PROVISIONAL);
            let better = next.and_then(|(next, _)| {
                let system_there = problem.linearise(&next, used)?;
                (system_there.cost <= system.cost).then_some((next, system_there))
            });
            if let Some(better) = better {
                (state, system) = better;
                self.damping = (self.damping * 0.1).max(if last { UNDAMPED } else { HELD });
            } else {
                undamped_failed |= self.damping <= UNDAMPED;
                flat += usize::from(below_noise);
                self.damping = (self.damping * 10.0).max(CAUTIOUS);
                if self.damping > 1e12 {
                    break;
                }
            }
        }
        // Along a direction that the data do not have, steps never end.
        if flat >= FLAT || covariance(&system.h).is_none() {
            return Err(undetermined(&system, problem.layout, &state));
        }
        Err(no_convergence(self.iterations, format!("cost {:.6e}, damping {:.1e}", system.cost, self.damping)))
    }
}

/// The state after a step of the columns and what goes with it for every shot.
pub(super) fn stepped(problem: &Problem<'_>, state: &State, system: &System, step: &[f64]) -> Option<State> {
    let mut next = state.moved(problem.layout, step)?;
    for (local, e) in next.locals.iter_mut().zip(&system.eliminated) {
        let change = e.back_substitute(problem.columns_of(e.batch), step, problem.local_count());
        local.iter_mut().zip(change).for_each(|(l, c)| *l += c);
    }
    Some(next)
}

/// step^T H step, for a step that solves the damped equations.
fn squared_length(system: &System, step: &[f64], damping: f64) -> f64 {
    step.iter().enumerate().map(|(i, s)| s * (system.g[i] - damping * s * system.h[(i, i)])).sum()
}

/// (H + damping diag H) step = g.
fn damped_step(system: &System, damping: f64) -> Option<Vec<f64>> {
    let (mut a, scale) = scaled(&system.h)?;
    let n = scale.len();
    for i in 0..n {
        a[(i, i)] += damping;
    }
    let right = Mat::from_fn(n, 1, |i, _| system.g[i] * scale[i]);
    let solution = a.llt(Side::Lower).ok()?.solve(&right);
    let step: Vec<f64> = (0..n).map(|i| solution[(i, 0)] * scale[i]).collect();
    step.iter().all(|v| v.is_finite()).then_some(step)
}

/// Inverse of the normal equations; `None` when a direction is not determined.
pub(super) fn covariance(h: &Mat<f64>) -> Option<DMatrix<f64>> {
    let (a, scale) = scaled(h)?;
    let n = scale.len();
    let inverse = a.llt(Side::Lower).ok()?.solve(Mat::<f64>::identity(n, n));
    // 1 / variance at unit diagonal is what is left of a parameter's information beside the others.
    let lost = (0..n).any(|i| inverse[(i, i)].is_nan() || inverse[(i, i)] > MAX_CONDITION);
    let symmetric = |i: usize, j: usize| 0.5 * (inverse[(i, j)] + inverse[(j, i)]) * (scale[i] * scale[j]);
    (!lost).then(|| DMatrix::from_fn(n, n, symmetric))
}

/// The covariance of all columns, or what the data say nothing of.
fn demand_determined(system: &System, layout: &Layout, state: &State) -> Result<DMatrix<f64>> {
    covariance(&system.h).ok_or_else(|| undetermined(system, layout, state))
}

fn undetermined(system: &System, layout: &Layout, state: &State) -> Error {
    Error::degenerate(Degeneracy::IllConditioned, weakness::undetermined(&system.h, layout, state))
}

/// The last linearisation, the gates, and the answer.
fn finish(
    problem: &Problem<'_>,
    state: State,
    used: Vec<bool>,
    factor: f64,
    iterations: usize,
    options: &AdjustOptions,
) -> Result<Adjusted> {
    let system = problem
        .linearise(&state, &used)
        .ok_or_else(|| no_convergence(iterations, "a spot cannot be predicted at the solution"))?;
    let layout = problem.layout;
    let covariance = demand_determined(&system, layout, &state)?;
    for (index, camera) in state.cameras.iter().enumerate() {
        camera.check_lens().map_err(|e| Error::in_camera(index, e))?;
    }
    let solution = Solution { state, layout: layout.clone(), used, covariance, normal: system.h };
    Adjusted::new(problem, solution, system.eliminated, system.chi2, factor, iterations, options)
}
