//! A point on a known ray by its inverse depth: X(rho) = o + d / rho, homogeneous (o rho + d; rho).
//!
//! Laser shots are kept this way because the spot's image position is linear in rho, so that its
//! noise is Gaussian in rho and strongly skewed in depth (maths.md section 2, row (14)).

use nalgebra::{Matrix3, Vector3, Vector4};

/// A measured point on a ray. `direction` is not normalised: depth 1 / rho counts along the
/// optical axis of the camera that measured it. rho may be <= 0 (at or beyond infinity).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InverseDepthPoint {
    pub origin: Vector3<f64>,
    pub direction: Vector3<f64>,
    /// 1 / metres.
    pub rho: f64,
    /// 1 / metres^2.
    pub variance: f64,
}

impl InverseDepthPoint {
    /// Homogeneous coordinates (o rho + d; rho), defined for every rho.
    pub fn homogeneous(&self) -> Vector4<f64> {
        Self::homogeneous_at(&self.origin, &self.direction, self.rho)
    }

    pub fn homogeneous_at(origin: &Vector3<f64>, direction: &Vector3<f64>, rho: f64) -> Vector4<f64> {
        (origin * rho + direction).push(rho)
    }

    /// Metric position; `None` at or beyond infinity.
    pub fn point(&self) -> Option<Vector3<f64>> {
        let x = self.origin + self.direction / self.rho;
        (self.rho > 0.0 && x.iter().all(|v| v.is_finite())).then_some(x)
    }

    /// First-order covariance of [`point`](Self::point) in metres^2: rank one, along the ray.
    pub fn point_covariance(&self) -> Option<Matrix3<f64>> {
        let slope = self.direction / (self.rho * self.rho);
        let c = slope * slope.transpose() * self.variance;
        (self.rho > 0.0 && c.iter().all(|v| v.is_finite())).then_some(c)
    }
}
