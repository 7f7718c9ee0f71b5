//! Errors of a camera in the groups that the mathematics notes tabulate.

use nalgebra::{DMatrix, DVector};
use ptzcal::geometry::{Camera, rigid};

/// Centre, focal lengths, principal point, rotation; unit, factor to it.
pub const GROUPS: [(&str, &str, f64); 4] =
    [("centre", "mm", 1e3), ("f", "px", 1.0), ("principal point", "px", 1.0), ("rotation", "mrad", 1e3)];

/// Estimate minus truth: fx fy skew cx cy, lens coefficients, rotation, centre.
pub fn error(estimate: &Camera, truth: &Camera) -> DVector<f64> {
    let (k, k0) = (estimate.intrinsics.to_array(), truth.intrinsics.to_array());
    let (d, d0) = (estimate.distortion.coefficients(), truth.distortion.coefficients());
    let turn = rigid::log(&(estimate.pose.rotation * truth.pose.rotation.transpose()));
    let off = estimate.centre() - truth.centre();
    let parameters = k.iter().zip(&k0).chain(d.iter().zip(d0)).map(|(a, b)| a - b);
    DVector::from_vec(parameters.chain(turn.iter().copied()).chain(off.iter().copied()).collect())
}

/// Rows of each group among a camera's `count` parameters.
fn rows(group: usize, count: usize) -> Vec<usize> {
    match group {
        0 => (count - 3..count).collect(),
        1 => vec![0, 1],
        2 => vec![3, 4],
        _ => (count - 6..count - 3).collect(),
    }
}

/// Squared length of the error in each group.
pub fn squared(error: &DVector<f64>) -> [f64; 4] {
    std::array::from_fn(|g| rows(g, error.len()).iter().map(|i| error[*i] * error[*i]).sum())
}

/// Root of a camera covariance's trace over each group.
pub fn roots(covariance: &DMatrix<f64>) -> [f64; 4] {
    std::array::from_fn(|g| rows(g, covariance.nrows()).iter().map(|i| covariance[(*i, *i)]).sum::<f64>().sqrt())
}

/// Normalised estimation error squared, e^T C^-1 e, over the parameters with a variance, and their number.
pub fn nees(error: &DVector<f64>, covariance: &DMatrix<f64>) -> (f64, usize) {
    let kept: Vec<usize> = (0..error.len()).filter(|i| covariance[(*i, *i)] > 0.0).collect();
    let s: Vec<f64> = kept.iter().map(|i| 1.0 / covariance[(*i, *i)].sqrt()).collect();
    let n = kept.len();
    let scaled = DMatrix::from_fn(n, n, |i, j| covariance[(kept[i], kept[j])] * s[i] * s[j]);
    let z = DVector::from_fn(n, |i, _| error[kept[i]] * s[i]);
    (z.dot(&scaled.cholesky().expect("a covariance").solve(&z)), n)
}
