//! Which spots agree with the others: each is tested against what the other views of its shot predict.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::layout::State;
use super::linearise::{Problem, ShotPoint, Witness};
use super::plane_hit::PlaneHit;
use crate::error::{Error, Result};

/// Squared Mahalanobis distance beyond which a spot is an outlier: a chance of 1 in 1000.
pub(super) const GATE: f64 = 13.8;
/// The same for a distance from a plane, which is one number.
const PLANE_GATE: f64 = 10.8;
/// Median of chi-square with two degrees of freedom.
const MEDIAN: f64 = 1.386_294_361_119_890_6;

/// With one.
const PLANE_MEDIAN: f64 = 0.454_936_423_119_572_8;

/// A view's whitened residual with its derivatives by the shot's own unknowns.
struct Prediction {
    residual: Vector2<f64>,
    by_local: [Vector2<f64>; 3],
}

/// What views say of a shot's own unknowns.
#[derive(Clone, Copy, Default)]
struct Knowledge {
    information: Matrix3<f64>,
    gradient: Vector3<f64>,
}

impl Knowledge {
    fn add(&mut self, view: &Prediction, count: usize) {
        for a in 0..count {
            self.gradient[a] += view.by_local[a].dot(&view.residual);
            for b in 0..count {
                self.information[(a, b)] += view.by_local[a].dot(&view.by_local[b]);
            }
        }
    }
}

/// Squared distance (chi-square, two degrees of freedom) of every view from what the used views of
/// its shot, itself left out, predict; infinite where it cannot be predicted.
pub(super) fn distances(problem: &Problem<'_>, state: &State, used: &[bool]) -> Vec<f64> {
    let count = problem.local_count();
    let mut distances = vec![f64::INFINITY; problem.views.len()];
    let mut predictions: Vec<Option<Prediction>> = Vec::new();
    // Of each view what those after it say: sums from both ends leave a view out without a difference.
    let mut after: Vec<Knowledge> = Vec::new();
    for shot in 0..problem.input.shots().len() {
        let span = problem.span(shot);
        let point = problem.point(state, shot);
        predictions.clear();
        predictions.extend(span.clone().map(|v| predict(problem, state, &point, shot, v)));
        after.clear();
        let mut sum = Knowledge::default();
        for (prediction, v) in predictions.iter().zip(span.clone()).rev() {
            after.push(sum);
            if let (Some(view), true) = (prediction, used[v]) {
                sum.add(view, count);
            }
        }
        let local = state.locals[shot];
        let mut before = Knowledge { information: problem.pointing_matrix(), ..Knowledge::default() };
        before.gradient = -(before.information * Vector3::new(0.0, local[1], local[2]));
        for ((prediction, v), after) in predictions.iter().zip(span).zip(after.iter().rev()) {
            let Some(own) = prediction else { continue };
            let mut information = before.information + after.information;
            // A view tested alone: only what no depth explains counts.
            information[(0, 0)] += 1e-6 * own.by_local[0].norm_squared();
            if let Some(d) = distance(own, &information, &(before.gradient + after.gradient), count) {
                distances[v] = d;
            }
            if used[v] {
                before.add(own, count);
            }
        }
    }
    distances
}

fn distance(own: &Prediction, information: &Matrix3<f64>, gradient: &Vector3<f64>, count: usize) -> Option<f64> {
    let inverse = information.try_inverse()?;
    let change = inverse * gradient;
    let (mut residual, mut covariance) = (own.residual, Matrix2::identity());
    for a in 0..count {
        residual -= own.by_local[a] * change[a];
        for b in 0..count {
            covariance += own.by_local[a] * own.by_local[b].transpose() * inverse[(a, b)];
        }
    }
    let d = residual.dot(&(covariance.try_inverse()? * residual));
    d.is_finite().then_some(d)
}

fn predict(problem: &Problem<'_>, state: &State, point: &ShotPoint, shot: usize, v: usize) -> Option<Prediction> {
    let view = &problem.views[v];
    let w = view.whitening;
    let rho = state.locals[shot][0];
    Some(match view.by {
        None => {
            let spot = state.rig.spot_image(rho)?;
            let by_local = [w * spot.by_rho, Vector2::zeros(), Vector2::zeros()];
            Prediction { residual: w * (view.pixel - spot.pixel), by_local }
        }
        Some(Witness::Camera(camera)) => {
            let p = state.cameras[camera].project_homogeneous(&point.xyz, rho)?;
            let mut by_local = point.by_local.map(|by| w * (p.by_point * by));
            by_local[0] += w * p.by_weight;
            Prediction { residual: w * (view.pixel - p.pixel), by_local }
        }
        Some(Witness::Plane(plane)) => {
            let hit = PlaneHit::of(&state.planes[plane], point, rho);
            let residual = Vector2::new(-w.m11 * hit.distance, 0.0);
            Prediction { residual, by_local: hit.by_local.map(|by| Vector2::new(w.m11 * by, 0.0)) }
        }
    })
}

/// Noise in units of the stated one from the median of the used spots' distances, never below 1.
pub(super) fn noise_factor(distances: &[f64], problem: &Problem<'_>, used: &[bool]) -> f64 {
    let spots = problem.views.iter().zip(used).map(|(view, used)| *used && !view.is_plane());
    let used = distances.iter().zip(spots).filter(|(_, u)| *u).map(|(d, _)| *d);
    median(used).map_or(1.0, |m| (m / MEDIAN).sqrt().max(1.0))
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Views to use next: those within the gate, and of the shots with views beyond it all but the worst.
///
/// At `start` stations are where the planes' own fits put them, and shots miss a plane by that too.
pub(super) fn classify(distances: &[f64], problem: &Problem<'_>, used: &[bool], factor: f64, start: bool) -> Vec<bool> {
    let misses = || distances.iter().zip(&problem.views).filter(|(_, view)| view.is_plane()).map(|(d, _)| *d);
    let start_factor = if start { median(misses()).map_or(1.0, |m| (m / PLANE_MEDIAN).sqrt()) } else { 1.0 };
    let (spot_gate, plane_gate) =
        (GATE * factor * factor, PLANE_GATE * factor.max(start_factor) * factor.max(start_factor));
    let gate = |v: usize| if problem.views[v].is_plane() { plane_gate } else { spot_gate };
    let mut next: Vec<bool> = used.to_vec();
    for shot in 0..problem.input.shots().len() {
        let span = problem.span(shot);
        for v in span.clone() {
            next[v] = used[v] || distances[v] <= gate(v);
        }
        // A spot was seen; that it lies on a plane was only said.
        let rank = |v: &usize| (problem.views[*v].is_plane(), distances[*v]);
        let beyond = span.filter(|v| used[*v] && distances[*v] > gate(*v));
        let worst = beyond.max_by(|a, b| rank(a).0.cmp(&rank(b).0).then(rank(a).1.total_cmp(&rank(b).1)));
        if let Some(worst) = worst {
            next[worst] = false;
        }
    }
    next
}

/// Without outlier handling every spot must at least be in front of its camera.
pub(super) fn demand_all(distances: &[f64], problem: &Problem<'_>) -> Result<()> {
    match distances.iter().position(|d| d.is_infinite()) {
        None => Ok(()),
        Some(view) => Err(Error::BehindCamera { index: problem.spans.partition_point(|s| *s <= view) - 1 }),
    }
}
