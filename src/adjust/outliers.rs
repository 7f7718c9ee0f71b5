//! Which spots agree with the others: each is tested against what the other views of its shot predict.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::layout::State;
use super::linearise::Problem;
use crate::error::{Error, Result};

/// Squared Mahalanobis distance beyond which a spot is an outlier: a chance of 1 in 1000.
pub(super) const GATE: f64 = 13.8;
/// Median of chi-square with two degrees of freedom.
const MEDIAN: f64 = 1.386_294_361_119_890_6;

/// A view's whitened residual with its derivatives by the shot's own unknowns.
struct Prediction {
    residual: Vector2<f64>,
    by_local: [Vector2<f64>; 3],
}

/// Squared distance (chi-square, two degrees of freedom) of every view from what the used views of
/// its shot, itself left out, predict; infinite where it cannot be predicted.
pub(super) fn distances(problem: &Problem<'_>, state: &State, used: &[bool]) -> Vec<f64> {
    let count = problem.local_count();
    let mut distances = vec![f64::INFINITY; problem.views.len()];
    for shot in 0..problem.input.shots().len() {
        let span = problem.span(shot);
        let predictions: Vec<Option<Prediction>> = span.clone().map(|v| predict(problem, state, shot, v)).collect();
        for (k, v) in span.clone().enumerate() {
            let Some(own) = &predictions[k] else { continue };
            let mut information = problem.pointing_matrix();
            let local = state.locals[shot];
            let mut gradient = -(information * Vector3::new(0.0, local[1], local[2]));
            // A view tested alone: only what no depth explains counts.
            information[(0, 0)] += 1e-6 * own.by_local[0].norm_squared();
            for (other, u) in predictions.iter().zip(span.clone()) {
                if let (Some(other), true, true) = (other, u != v, used[u]) {
                    for a in 0..count {
                        gradient[a] += other.by_local[a].dot(&other.residual);
                        for b in 0..count {
                            information[(a, b)] += other.by_local[a].dot(&other.by_local[b]);
                        }
                    }
                }
            }
            if let Some(d) = distance(own, &information, &gradient, count) {
                distances[v] = d;
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

fn predict(problem: &Problem<'_>, state: &State, shot: usize, v: usize) -> Option<Prediction> {
    let view = &problem.views[v];
    let w = view.whitening;
    let Some(camera) = view.camera else {
        let spot = state.rig.spot_image(state.locals[shot][0])?;
        let by_local = [w * spot.by_rho, Vector2::zeros(), Vector2::zeros()];
        return Some(Prediction { residual: w * (view.pixel - spot.pixel), by_local });
    };
    let point = problem.point(state, shot);
    let p = state.cameras[camera].project_homogeneous(&point.xyz, state.locals[shot][0])?;
    let mut by_local = point.by_local.map(|by| w * (p.by_point * by));
    by_local[0] += w * p.by_weight;
    Some(Prediction { residual: w * (view.pixel - p.pixel), by_local })
}

/// Noise in units of the stated one from the median of the used views' distances, never below 1.
pub(super) fn noise_factor(distances: &[f64], used: &[bool]) -> f64 {
    let mut d: Vec<f64> = distances.iter().zip(used).filter(|(_, u)| **u).map(|(d, _)| *d).collect();
    if d.is_empty() {
        return 1.0;
    }
    let middle = d.len() / 2;
    (*d.select_nth_unstable_by(middle, f64::total_cmp).1 / MEDIAN).sqrt().max(1.0)
}

/// Views to use next: those within the gate, and of the shots with views beyond it all but the worst.
pub(super) fn classify(distances: &[f64], problem: &Problem<'_>, used: &[bool], factor: f64) -> Vec<bool> {
    let gate = GATE * factor * factor;
    let mut next: Vec<bool> = used.to_vec();
    for shot in 0..problem.input.shots().len() {
        let span = problem.span(shot);
        for v in span.clone() {
            next[v] = used[v] || distances[v] <= gate;
        }
        let worst = span.filter(|v| used[*v]).max_by(|a, b| distances[*a].total_cmp(&distances[*b]));
        if let Some(worst) = worst.filter(|w| distances[*w] > gate) {
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
