//! Lenses: from a direction in the camera frame to the distorted position on the normalised plane,
//! whose centre is the principal point, and back.
//!
//! One file a model. A new one needs its `image` and `direction` (or, where it lives on the plane
//! (X/Z, Y/Z), `distort` and `undistort`), the limit up to which it grows, and derivatives that the
//! tests here hold against finite differences.

mod brown_conrady;
mod division;
mod fisheye;
mod roots;

use nalgebra::{Matrix2, Matrix2x3, Vector2, Vector3};

/// Most coefficients that any model has.
pub const MAX_COEFFICIENTS: usize = 5;

/// Shortest vector (smallest depth of a plane model) that still has an image: below it the position
/// means nothing.
pub(crate) const MIN_LENGTH: f64 = 1e-9;

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
    /// Fisheye (Kannala, Brandt 2006) with OpenCV's meaning and order: k1 k2 k3 k4. The angle theta
    /// from the axis is imaged at the radius theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 +
    /// k4 theta^8); sees beyond 90 degrees. All zero is the equidistant lens.
    Fisheye([f64; 4]),
}

/// A distorted point with its derivatives.
pub struct Distorted {
    pub point: Vector2<f64>,
    /// d point / d (x, y).
    pub by_point: Matrix2<f64>,
    /// d point / d coefficient, one column for each coefficient of the model.
    pub by_coefficient: [Vector2<f64>; MAX_COEFFICIENTS],
}

/// The image of a direction, on the normalised plane, with its derivatives.
pub struct Image {
    pub point: Vector2<f64>,
    /// d point / d (x, y, z).
    pub by_direction: Matrix2x3<f64>,
    /// d point / d coefficient, one column for each coefficient of the model.
    pub by_coefficient: [Vector2<f64>; MAX_COEFFICIENTS],
}

impl Distortion {
    pub fn coefficients(&self) -> &[f64] {
        match self {
            Self::None => &[],
            Self::BrownConrady(k) => k,
            Self::Division(lambda) => std::slice::from_ref(lambda),
            Self::Fisheye(k) => k,
        }
    }

    pub fn coefficients_mut(&mut self) -> &mut [f64] {
        match self {
            Self::None => &mut [],
            Self::BrownConrady(k) => k,
            Self::Division(lambda) => std::slice::from_mut(lambda),
            Self::Fisheye(k) => k,
        }
    }

    pub fn is_finite(&self) -> bool {
        self.coefficients().iter().all(|k| k.is_finite())
    }

    /// Distorted position of what lies in the direction `x` of the camera frame (any length).
    /// `None` at the camera's centre, behind the camera (a fisheye lens: beyond the angle up to which
    /// it grows), and where the model has no image.
    pub fn image(&self, x: &Vector3<f64>) -> Option<Vector2<f64>> {
        match self {
            Self::Fisheye(k) => fisheye::image(k, x).map(|i| i.point),
            _ => self.distort(on_plane(x)?),
        }
    }

    /// Like [`image`](Self::image), with derivatives.
    pub fn image_with_jacobian(&self, x: &Vector3<f64>) -> Option<Image> {
        if let Self::Fisheye(k) = self {
            return fisheye::image(k, x);
        }
        let p = on_plane(x)?;
        let Distorted { point, by_point, by_coefficient } = self.distort_with_jacobian(p)?;
        let iz = 1.0 / x.z;
        let plane_by_direction = Matrix2x3::new(iz, 0.0, -p.x * iz, 0.0, iz, -p.y * iz);
        Some(Image { point, by_direction: by_point * plane_by_direction, by_coefficient })
    }

    /// Unit direction in the camera frame of what is imaged at `q`; `None` where nothing is on the
    /// lens's monotone part.
    pub fn direction(&self, q: &Vector2<f64>) -> Option<Vector3<f64>> {
        match self {
            Self::Fisheye(k) => fisheye::direction(k, q),
            _ => Some(self.undistort(*q)?.push(1.0).normalize()),
        }
    }

    /// Ideal to distorted, both on the normalised plane (x, y) = (X/Z, Y/Z). `None` where the model
    /// has no image (the division model beyond its largest radius) or the result is not finite.
    pub fn distort(&self, p: Vector2<f64>) -> Option<Vector2<f64>> {
        let q = match self {
            Self::None => p,
            Self::BrownConrady(k) => brown_conrady::distort(k, &p),
            Self::Division(lambda) => division::distort(*lambda, &p)?,
            Self::Fisheye(k) => fisheye::image(k, &p.push(1.0))?.point,
        };
        (q.x.is_finite() && q.y.is_finite()).then_some(q)
    }

    /// Like [`distort`](Self::distort), with derivatives.
    pub fn distort_with_jacobian(&self, p: Vector2<f64>) -> Option<Distorted> {
        let distorted = match self {
            Self::None => Distorted {
                point: p,
                by_point: Matrix2::identity(),
                by_coefficient: [Vector2::zeros(); MAX_COEFFICIENTS],
            },
            Self::BrownConrady(k) => brown_conrady::distort_with_jacobian(k, &p),
            Self::Division(lambda) => division::distort_with_jacobian(*lambda, &p)?,
            Self::Fisheye(k) => {
                let Image { point, by_direction, by_coefficient } = fisheye::image(k, &p.push(1.0))?;
                Distorted { point, by_point: by_direction.fixed_columns::<2>(0).into(), by_coefficient }
            }
        };
        distorted.point.iter().all(|v| v.is_finite()).then_some(distorted)
    }

    /// Distorted to ideal, both on the normalised plane. `None` where no ideal point maps there on
    /// the lens's monotone part, or none on this plane (a fisheye lens from 90 degrees on).
    pub fn undistort(&self, q: Vector2<f64>) -> Option<Vector2<f64>> {
        match self {
            Self::None => Some(q),
            Self::Division(lambda) => division::undistort(*lambda, &q),
            Self::BrownConrady(k) => brown_conrady::undistort(k, &q),
            Self::Fisheye(k) => on_plane(&fisheye::direction(k, &q)?),
        }
    }

    /// The ideal radius on the normalised plane up to which the radial part grows: beyond it the lens
    /// folds back. Infinite for a lens that never does, and for one that does so only from 90 degrees on.
    pub fn monotone_radius(&self) -> f64 {
        match self {
            Self::None => f64::INFINITY,
            Self::Division(lambda) => division::monotone_radius(*lambda),
            Self::BrownConrady(k) => brown_conrady::monotone_radius(k),
            Self::Fisheye(k) => {
                let angle = fisheye::monotone_angle(k);
                if angle < std::f64::consts::FRAC_PI_2 { angle.tan() } else { f64::INFINITY }
            }
        }
    }
}

/// Where a direction in front of the camera meets the normalised plane.
fn on_plane(x: &Vector3<f64>) -> Option<Vector2<f64>> {
    (x.z > MIN_LENGTH).then(|| x.xy() / x.z)
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
            Distortion::Fisheye([-0.012, 0.02, -0.017, 0.0035]),
        ]
    }

    #[test]
    fn undistort_inverts_distort_and_direction_inverts_image() {
        for model in models() {
            for i in -6..=6 {
                for j in -4..=4 {
                    let p = Vector2::new(i as f64 * 0.1, j as f64 * 0.1);
                    let q = model.distort(p).unwrap();
                    let back = model.undistort(q).unwrap();
                    assert!((back - p).norm() < 1e-11, "{model:?} {p} {back}");
                    let x = p.push(1.0) * 2.0;
                    assert!((model.image(&x).unwrap() - q).norm() < 1e-14);
                    assert!((model.direction(&q).unwrap() - x.normalize()).norm() < 1e-11);
                }
            }
        }
    }

    #[test]
    fn derivatives_match_finite_differences() {
        let h = 1e-6;
        for model in models() {
            for p in [Vector2::new(0.31, -0.22), Vector2::new(-0.05, 0.4), Vector2::new(0.0, 0.0)] {
                let d = model.distort_with_jacobian(p).unwrap();
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
                let x = p.push(1.0) * 1.7;
                let image = model.image_with_jacobian(&x).unwrap();
                for i in 0..3 {
                    let e = Vector3::ith(i, h);
                    let numeric = (model.image(&(x + e)).unwrap() - model.image(&(x - e)).unwrap()) / (2.0 * h);
                    assert!((image.by_direction.column(i) - numeric).norm() < 1e-8, "{model:?} {i}");
                }
            }
        }
    }

    #[test]
    fn beyond_the_fold_there_is_no_ideal_point() {
        let lens = Distortion::BrownConrady([-0.3, 0.0, 0.0, 0.0, 0.0]);
        let r = lens.monotone_radius();
        let largest = r * (1.0 - 0.3 * r * r);
        assert!(lens.undistort(Vector2::new(largest * 1.01, 0.0)).is_none());
        assert!(lens.undistort(Vector2::new(largest * 0.99, 0.0)).is_some());
        assert!(Distortion::Division(0.04).undistort(Vector2::new(5.1, 0.0)).is_none());
        assert!((Distortion::Division(0.04).monotone_radius() - 2.5).abs() < 1e-12);
        assert!(Distortion::None.monotone_radius().is_infinite());
        // 45 degrees: tan is 1.
        let k1 = -1.0 / (3.0 * std::f64::consts::FRAC_PI_4.powi(2));
        assert!((Distortion::Fisheye([k1, 0.0, 0.0, 0.0]).monotone_radius() - 1.0).abs() < 1e-9);
        assert!(Distortion::Fisheye([-0.1, 0.0, 0.0, 0.0]).monotone_radius().is_infinite());
    }

    #[test]
    fn only_a_fisheye_lens_sees_beyond_90_degrees() {
        let aside = Vector3::new(1.0, 0.5, -0.2);
        for model in models() {
            let wide = matches!(model, Distortion::Fisheye(_));
            assert_eq!(model.image(&aside).is_some(), wide, "{model:?}");
            if let Some(q) = model.image(&aside) {
                assert!((model.direction(&q).unwrap() - aside.normalize()).norm() < 1e-12);
                assert!(model.undistort(q).is_none());
            }
        }
    }
}
