//! Lens distortion on the normalised image plane (x, y) = (X/Z, Y/Z), centre at the principal point.

use nalgebra::{Matrix2, Vector2};

/// Most coefficients that any model has.
pub const MAX_COEFFICIENTS: usize = 5;

/// A distortion model with its coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Distortion {
    #[default]
    None,
    /// Brown-Conrady with OpenCV's meaning and order: k1 k2 p1 p2 k3.
    /// x_d = x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2), y_d likewise with
    /// p1 (r^2 + 2 y^2) + 2 p2 x y.
    BrownConrady([f64; 5]),
    /// Division model (Fitzgibbon 2001): x_u = x_d / (1 + lambda r_d^2), lambda in units of the
    /// normalised plane, as COLMAP's; in pixels it is lambda / f^2. Negative is barrel.
    Division(f64),
}

/// A distorted point with its derivatives.
pub struct Distorted {
    pub point: Vector2<f64>,
    /// d point / d (x, y).
    pub by_point: Matrix2<f64>,
    /// d point / d coefficient, one column for each coefficient of the model.
    pub by_coefficient: [Vector2<f64>; MAX_COEFFICIENTS],
}

impl Distortion {
    pub fn coefficients(&self) -> &[f64] {
        match self {
            Self::None => &[],
            Self::BrownConrady(k) => k,
            Self::Division(lambda) => std::slice::from_ref(lambda),
        }
    }

    pub fn coefficients_mut(&mut self) -> &mut [f64] {
        match self {
            Self::None => &mut [],
            Self::BrownConrady(k) => k,
            Self::Division(lambda) => std::slice::from_mut(lambda),
        }
    }

    pub fn is_finite(&self) -> bool {
        self.coefficients().iter().all(|k| k.is_finite())
    }

    /// Ideal to distorted. `None` where the model has no image (the division model beyond its
    /// largest radius) or the result is not finite.
    pub fn distort(&self, p: Vector2<f64>) -> Option<Vector2<f64>> {
        let q = match self {
            Self::None => p,
            Self::BrownConrady([k1, k2, p1, p2, k3]) => {
                let r2 = p.norm_squared();
                let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
                Vector2::new(
                    p.x * radial + 2.0 * p1 * p.x * p.y + p2 * (r2 + 2.0 * p.x * p.x),
                    p.y * radial + p1 * (r2 + 2.0 * p.y * p.y) + 2.0 * p2 * p.x * p.y,
                )
            }
            Self::Division(lambda) => {
                let discriminant = 1.0 - 4.0 * lambda * p.norm_squared();
                if discriminant <= 0.0 {
                    return None;
                }
                p * (2.0 / (1.0 + discriminant.sqrt()))
            }
        };
        (q.x.is_finite() && q.y.is_finite()).then_some(q)
    }

    /// Like [`distort`](Self::distort), with derivatives.
    pub fn distort_with_jacobian(&self, p: Vector2<f64>) -> Option<Distorted> {
        let mut by_coefficient = [Vector2::zeros(); MAX_COEFFICIENTS];
        let point = self.distort(p)?;
        let (x, y, r2) = (p.x, p.y, p.norm_squared());
        let by_point = match self {
            Self::None => Matrix2::identity(),
            Self::BrownConrady([k1, k2, p1, p2, k3]) => {
                let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
                let slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
                by_coefficient = [
                    p * r2,
                    p * (r2 * r2),
                    Vector2::new(2.0 * x * y, r2 + 2.0 * y * y),
                    Vector2::new(r2 + 2.0 * x * x, 2.0 * x * y),
                    p * (r2 * r2 * r2),
                ];
                let cross = x * y * slope + 2.0 * (p1 * x + p2 * y);
                Matrix2::new(
                    radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x,
                    cross,
                    cross,
                    radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x,
                )
            }
            Self::Division(lambda) => {
                // g = 2 / (1 + q), q = sqrt(1 - 4 lambda r^2); dg/d(r^2) = lambda h, dg/dlambda = r^2 h.
                let q = (1.0 - 4.0 * lambda * r2).sqrt();
                let g = 2.0 / (1.0 + q);
                let h = 4.0 / (q * (1.0 + q) * (1.0 + q));
                by_coefficient[0] = p * (h * r2);
                Matrix2::identity() * g + p * p.transpose() * (2.0 * lambda * h)
            }
        };
        Some(Distorted { point, by_point, by_coefficient })
    }

    /// Distorted to ideal. `None` where no ideal point maps there on the lens's monotone part.
    pub fn undistort(&self, q: Vector2<f64>) -> Option<Vector2<f64>> {
        match self {
            Self::None => Some(q),
            Self::Division(lambda) => {
                let denominator = 1.0 + lambda * q.norm_squared();
                // The ideal radius is monotone in the distorted one while lambda r_d^2 < 1.
                (denominator > 1e-9 && lambda * q.norm_squared() < 1.0).then(|| q / denominator)
            }
            Self::BrownConrady(_) => self.undistort_by_newton(q),
        }
    }

    /// Newton's method, started from the radial part alone (bisection on the monotone interval), so
    /// that it cannot slip to another branch.
    fn undistort_by_newton(&self, q: Vector2<f64>) -> Option<Vector2<f64>> {
        let limit = self.monotone_radius();
        let mut p = self.undistort_radius(q.norm(), limit).map_or(q, |r| {
            let n = q.norm();
            if n > 0.0 { q * (r / n) } else { q }
        });
        for _ in 0..50 {
            let d = self.distort_with_jacobian(p)?;
            let step = d.by_point.try_inverse()? * (q - d.point);
            p += step;
            if !(p.x.is_finite() && p.y.is_finite()) {
                return None;
            }
            if step.norm() <= 1e-14 * (1.0 + p.norm()) {
                let d = self.distort_with_jacobian(p)?;
                let valid = (d.point - q).norm() <= 1e-10 * (1.0 + q.norm()) && d.by_point.determinant() > 0.0;
                return (valid && p.norm() <= limit * 1.05).then_some(p);
            }
        }
        None
    }

    /// Ideal radius whose radial distortion is `r_d`, on [0, limit].
    fn undistort_radius(&self, r_d: f64, limit: f64) -> Option<f64> {
        let Self::BrownConrady([k1, k2, _, _, k3]) = self else { return Some(r_d) };
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

    /// The ideal radius up to which the radial part grows: beyond it the lens folds back.
    /// Infinite for a lens that never does.
    pub fn monotone_radius(&self) -> f64 {
        match self {
            Self::None => f64::INFINITY,
            Self::Division(lambda) if *lambda > 0.0 => 1.0 / (2.0 * lambda.sqrt()),
            Self::Division(_) => f64::INFINITY,
            Self::BrownConrady([k1, k2, _, _, k3]) => {
                smallest_positive_root([1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3]).map_or(f64::INFINITY, f64::sqrt)
            }
        }
    }
}

/// Smallest positive root of c0 + c1 s + c2 s^2 + c3 s^3 with c0 > 0, found between the extrema.
fn smallest_positive_root(c: [f64; 4]) -> Option<f64> {
    let value = |s: f64| c[0] + s * (c[1] + s * (c[2] + s * c[3]));
    // Extrema of the cubic split [0, infinity) into intervals on which it is monotone.
    let mut knots = vec![0.0];
    let (a, b) = (3.0 * c[3], 2.0 * c[2]);
    let discriminant = b * b - 4.0 * a * c[1];
    let mut extrema = Vec::new();
    if a.abs() > 1e-300 && discriminant >= 0.0 {
        let q = -0.5 * (b + discriminant.sqrt().copysign(b));
        extrema.push(q / a);
        if q != 0.0 {
            extrema.push(c[1] / q);
        }
    } else if a.abs() <= 1e-300 && b != 0.0 {
        extrema.push(-c[1] / b);
    }
    extrema.retain(|s| s.is_finite() && *s > 0.0);
    extrema.sort_by(f64::total_cmp);
    knots.extend(extrema);
    // Cauchy's bound: every root is below it.
    let lead = c.iter().rev().find(|v| v.abs() > 0.0).copied().unwrap_or(1.0);
    let bound = 1.0 + c.iter().map(|v| (v / lead).abs()).fold(0.0, f64::max);
    knots.push(bound.max(knots[knots.len() - 1] * 2.0));
    for pair in knots.windows(2) {
        let (mut low, mut high) = (pair[0], pair[1]);
        if value(low) > 0.0 && value(high) <= 0.0 {
            for _ in 0..200 {
                let middle = 0.5 * (low + high);
                if value(middle) > 0.0 { low = middle } else { high = middle }
            }
            return Some(low);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn models() -> Vec<Distortion> {
        vec![
            Distortion::None,
            Distortion::BrownConrady([-0.2886, 0.0971, 0.00109, -0.000295, 0.0]),
            Distortion::BrownConrady([-0.2286, 0.19035, 0.002, -0.003, -0.04]),
            Distortion::Division(-0.22),
            Distortion::Division(0.05),
        ]
    }

    #[test]
    fn undistort_inverts_distort() {
        for model in models() {
            for i in -6..=6 {
                for j in -4..=4 {
                    let p = Vector2::new(i as f64 * 0.1, j as f64 * 0.1);
                    let q = model.distort(p).unwrap();
                    let back = model.undistort(q).unwrap();
                    assert!((back - p).norm() < 1e-11, "{model:?} {p} {back}");
                }
            }
        }
    }

    #[test]
    fn derivatives_match_finite_differences() {
        for model in models() {
            for p in [Vector2::new(0.31, -0.22), Vector2::new(-0.05, 0.4), Vector2::new(0.0, 0.0)] {
                let d = model.distort_with_jacobian(p).unwrap();
                let h = 1e-6;
                for (column, e) in [Vector2::x(), Vector2::y()].iter().enumerate() {
                    let numeric = (model.distort(p + e * h).unwrap() - model.distort(p - e * h).unwrap()) / (2.0 * h);
                    assert!((d.by_point.column(column) - numeric).norm() < 1e-8, "{model:?}");
                }
                for k in 0..model.coefficients().len() {
                    let (mut plus, mut minus) = (model, model);
                    plus.coefficients_mut()[k] += h;
                    minus.coefficients_mut()[k] -= h;
                    let numeric = (plus.distort(p).unwrap() - minus.distort(p).unwrap()) / (2.0 * h);
                    assert!((d.by_coefficient[k] - numeric).norm() < 1e-8, "{model:?} {k}");
                }
            }
        }
    }

    #[test]
    fn monotone_radius_is_where_the_slope_vanishes() {
        // r (1 - 0.3 r^2): slope 1 - 0.9 r^2.
        let lens = Distortion::BrownConrady([-0.3, 0.0, 0.0, 0.0, 0.0]);
        assert!((lens.monotone_radius() - (1.0f64 / 0.9).sqrt()).abs() < 1e-9);
        // The quadratic 1 - 0.9 s + 2 s^2 has no real root.
        assert!(Distortion::BrownConrady([-0.3, 0.4, 0.0, 0.0, 0.0]).monotone_radius().is_infinite());
        // 1 + 3 k1 s + 5 k2 s^2 + 7 k3 s^3 with a fold far out.
        let lens = Distortion::BrownConrady([0.1, 0.0, 0.0, 0.0, -0.01]);
        let s = lens.monotone_radius().powi(2);
        assert!((1.0 + 0.3 * s - 0.07 * s * s * s).abs() < 1e-9);
        assert!((Distortion::Division(0.04).monotone_radius() - 2.5).abs() < 1e-12);
        assert!(Distortion::None.monotone_radius().is_infinite());
    }

    #[test]
    fn beyond_the_fold_there_is_no_ideal_point() {
        let lens = Distortion::BrownConrady([-0.3, 0.0, 0.0, 0.0, 0.0]);
        let r = lens.monotone_radius();
        let largest = r * (1.0 - 0.3 * r * r);
        assert!(lens.undistort(Vector2::new(largest * 1.01, 0.0)).is_none());
        assert!(lens.undistort(Vector2::new(largest * 0.99, 0.0)).is_some());
        assert!(Distortion::Division(0.04).undistort(Vector2::new(5.1, 0.0)).is_none());
    }
}
