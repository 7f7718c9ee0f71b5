//! The Brown-Conrady model on the normalised plane, with OpenCV's meaning and order: k1 k2 p1 p2 k3.

use nalgebra::{Matrix2, Vector2};

use super::roots::smallest_positive_root;
use super::{Distorted, MAX_COEFFICIENTS};

type Coefficients = [f64; 5];

pub(super) fn distort([k1, k2, p1, p2, k3]: &Coefficients, p: &Vector2<f64>) -> Vector2<f64> {
    let r2 = p.norm_squared();
    let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    Vector2::new(
        p.x * radial + 2.0 * p1 * p.x * p.y + p2 * (r2 + 2.0 * p.x * p.x),
        p.y * radial + p1 * (r2 + 2.0 * p.y * p.y) + 2.0 * p2 * p.x * p.y,
    )
}

pub(super) fn distort_with_jacobian(k: &Coefficients, p: &Vector2<f64>) -> Distorted {
    let [k1, k2, p1, p2, k3] = k;
    let (x, y, r2) = (p.x, p.y, p.norm_squared());
    let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    let slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
    let by_coefficient: [Vector2<f64>; MAX_COEFFICIENTS] = [
        p * r2,
        p * (r2 * r2),
        Vector2::new(2.0 * x * y, r2 + 2.0 * y * y),
        Vector2::new(r2 + 2.0 * x * x, 2.0 * x * y),
        p * (r2 * r2 * r2),
    ];
    let cross = x * y * slope + 2.0 * (p1 * x + p2 * y);
    let by_point = Matrix2::new(
        radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x,
        cross,
        cross,
        radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x,
    );
    Distorted { point: distort(k, p), by_point, by_coefficient }
}

/// Newton's method, started from the radial part alone (bisection on the monotone interval), so that
/// it cannot slip to another branch.
pub(super) fn undistort(k: &Coefficients, q: &Vector2<f64>) -> Option<Vector2<f64>> {
    let limit = monotone_radius(k);
    let mut p = undistort_radius(k, q.norm(), limit).map_or(*q, |r| {
        let n = q.norm();
        if n > 0.0 { q * (r / n) } else { *q }
    });
    for _ in 0..50 {
        let d = distort_with_jacobian(k, &p);
        let step = d.by_point.try_inverse()? * (q - d.point);
        p += step;
        if !(p.x.is_finite() && p.y.is_finite()) {
            return None;
        }
        if step.norm() <= 1e-14 * (1.0 + p.norm()) {
            let d = distort_with_jacobian(k, &p);
            let valid = (d.point - q).norm() <= 1e-10 * (1.0 + q.norm()) && d.by_point.determinant() > 0.0;
            return (valid && p.norm() <= limit * 1.05).then_some(p);
        }
    }
    None
}

/// Ideal radius whose radial distortion is `r_d`, on [0, limit].
fn undistort_radius([k1, k2, _, _, k3]: &Coefficients, r_d: f64, limit: f64) -> Option<f64> {
    let radial = |r: f64| {
        let r2 = r * r;
        r * (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3)))
    };
    let mut high = if limit.is_finite() { limit } else { (2.0 * r_d).max(1e-6) };
    let mut doublings = 0;
    while radial(high) < r_d {
        if limit.is_finite() || doublings > 60 {
            return None;
        }
        high *= 2.0;
        doublings += 1;
    }
    let mut low = 0.0;
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if radial(middle) < r_d { low = middle } else { high = middle }
    }
    Some(0.5 * (low + high))
}

pub(super) fn monotone_radius([k1, k2, _, _, k3]: &Coefficients) -> f64 {
    smallest_positive_root(&[1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3]).map_or(f64::INFINITY, f64::sqrt)
}

#[cfg(test)]
mod tests {
    use super::monotone_radius;

    #[test]
    fn monotone_radius_is_where_the_slope_vanishes() {
        // r (1 - 0.3 r^2): slope 1 - 0.9 r^2.
        assert!((monotone_radius(&[-0.3, 0.0, 0.0, 0.0, 0.0]) - (1.0f64 / 0.9).sqrt()).abs() < 1e-9);
        // The quadratic 1 - 0.9 s + 2 s^2 has no real root.
        assert!(monotone_radius(&[-0.3, 0.4, 0.0, 0.0, 0.0]).is_infinite());
        // 1 + 3 k1 s + 5 k2 s^2 + 7 k3 s^3 with a fold far out.
        let s = monotone_radius(&[0.1, 0.0, 0.0, 0.0, -0.01]).powi(2);
        assert!((1.0 + 0.3 * s - 0.07 * s * s * s).abs() < 1e-9);
    }
}
