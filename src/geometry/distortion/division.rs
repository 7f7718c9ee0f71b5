//! The division model (Fitzgibbon 2001) on the normalised plane: p = q / (1 + lambda |q|^2).

use nalgebra::{Matrix2, Vector2};

use super::{Distorted, MAX_COEFFICIENTS};

/// `None` beyond the largest radius that has an image.
pub(super) fn distort(lambda: f64, p: &Vector2<f64>) -> Option<Vector2<f64>> {
    let discriminant = 1.0 - 4.0 * lambda * p.norm_squared();
    (discriminant > 0.0).then(|| p * (2.0 / (1.0 + discriminant.sqrt())))
}

pub(super) fn distort_with_jacobian(lambda: f64, p: &Vector2<f64>) -> Option<Distorted> {
    let point = distort(lambda, p)?;
    // g = 2 / (1 + q), q = sqrt(1 - 4 lambda r^2); dg/d(r^2) = lambda h, dg/dlambda = r^2 h.
    let r2 = p.norm_squared();
    let q = (1.0 - 4.0 * lambda * r2).sqrt();
    let g = 2.0 / (1.0 + q);
    let h = 4.0 / (q * (1.0 + q) * (1.0 + q));
    let mut by_coefficient = [Vector2::zeros(); MAX_COEFFICIENTS];
    by_coefficient[0] = p * (h * r2);
    let by_point = Matrix2::identity() * g + p * p.transpose() * (2.0 * lambda * h);
    Some(Distorted { point, by_point, by_coefficient })
}

pub(super) fn undistort(lambda: f64, q: &Vector2<f64>) -> Option<Vector2<f64>> {
    let product = lambda * q.norm_squared();
    // The ideal radius is monotone in the distorted one while lambda r_d^2 < 1.
    (1.0 + product > 1e-9 && product < 1.0).then(|| q / (1.0 + product))
}

pub(super) fn monotone_radius(lambda: f64) -> f64 {
    if lambda > 0.0 { 1.0 / (2.0 * lambda.sqrt()) } else { f64::INFINITY }
}
