//! Small least-squares problems of a check: a handful of unknowns, two residuals a shot.

use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

use crate::geometry::linalg::invert_spd;

/// Directions whose information is below this part of the greatest are none.
const RANK: f64 = 1e-10;
const ITERATIONS: usize = 60;

/// g^T H^+ g and the rank of H.
pub(super) fn quadratic_gain(h: &Matrix6<f64>, g: &Vector6<f64>) -> Option<(f64, usize)> {
    if h.iter().chain(g.iter()).any(|v| !v.is_finite()) {
        return None;
    }
    // At unit diagonal, so that radians and metres do not matter.
    let scale = h.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 });
    let scaled = Matrix6::from_fn(|i, j| h[(i, j)] * scale[i] * scale[j]);
    let eigen = scaled.try_symmetric_eigen(f64::EPSILON, 1000)?;
    let greatest = eigen.eigenvalues.max();
    let along = eigen.eigenvectors.transpose() * g.component_mul(&scale);
    let kept = (0..6).filter(|i| eigen.eigenvalues[*i] > RANK * greatest);
    let (gain, rank) = kept.fold((0.0, 0), |(s, n), i| (s + along[i].powi(2) / eigen.eigenvalues[i], n + 1));
    Some((gain, rank))
}

/// A minimum of the sum of squares.
#[derive(Debug, Clone)]
pub(super) struct Minimum {
    pub x: DVector<f64>,
    pub covariance: DMatrix<f64>,
    pub chi_square: f64,
}

/// Levenberg-Marquardt from zero with central differences. `residuals`: whitened; `None` where a point
/// has no image. `steps`: for the differences, about a thousandth of what matters.
pub(super) fn minimise(steps: &[f64], residuals: impl Fn(&[f64]) -> Option<DVector<f64>>) -> Option<Minimum> {
    let n = steps.len();
    let mut x = DVector::zeros(n);
    let mut now = residuals(x.as_slice())?;
    let mut damping = 1e-3;
    for _ in 0..ITERATIONS {
        let j = jacobian(&x, steps, &residuals)?;
        let (h, g) = (j.transpose() * &j, j.transpose() * &now);
        let damped = DMatrix::from_fn(n, n, |a, b| h[(a, b)] * if a == b { 1.0 + damping } else { 1.0 });
        let step = -nalgebra::Cholesky::new(damped)?.solve(&g);
        let next = residuals((&x + &step).as_slice()).filter(|r| r.norm_squared() <= now.norm_squared());
        match next {
            Some(r) => {
                let gain = now.norm_squared() - r.norm_squared();
                (x, now) = (x + step, r);
                damping = (damping * 0.1).max(1e-12);
                if gain <= 1e-9 * (1.0 + now.norm_squared()) {
                    break;
                }
            }
            None => {
                damping *= 10.0;
                if damping > 1e10 {
                    break;
                }
            }
        }
    }
    let j = jacobian(&x, steps, &residuals)?;
    let (covariance, _) = invert_spd(&(j.transpose() * &j))?;
    Some(Minimum { x, covariance, chi_square: now.norm_squared() })
}

fn jacobian(
    x: &DVector<f64>,
    steps: &[f64],
    residuals: &impl Fn(&[f64]) -> Option<DVector<f64>>,
) -> Option<DMatrix<f64>> {
    let columns: Option<Vec<DVector<f64>>> = (0..steps.len())
        .map(|i| {
            let moved = |s: f64| {
                let mut y = x.clone();
                y[i] += s;
                residuals(y.as_slice())
            };
            Some((moved(steps[i])? - moved(-steps[i])?) / (2.0 * steps[i]))
        })
        .collect();
    Some(DMatrix::from_columns(&columns?))
}
