//! From a pixel and its depth to a point in the world.

use std::f64::consts::SQRT_2;

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2, Vector3};

use crate::geometry::Camera;
use crate::image::InverseDepth;

/// A pixel with depth as a point in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lifted {
    /// Of the auxiliary image.
    pub pixel: Vector2<f64>,
    /// Metres.
    pub world: Vector3<f64>,
    /// What the depth's noise does to `world`, m^2.
    by_depth: Matrix3<f64>,
    /// What a pixel noise of `shape` does to it, m^2.
    by_pixel: Matrix3<f64>,
    /// Size of a pixel at the point, metres.
    pub metres_per_pixel: f64,
}

impl Lifted {
    /// Covariance (m^2) of the point where the pixel's is sigma^2 times its shape.
    pub fn covariance(&self, sigma: f64) -> Matrix3<f64> {
        self.by_depth + self.by_pixel * sigma.powi(2)
    }
}

/// The point that `camera` sees at `pixel`, at an inverse depth along its axis; `shape`: covariance of
/// the pixel up to a factor.
pub(super) fn lift(
    camera: &Camera,
    pixel: &Vector2<f64>,
    shape: &Matrix2<f64>,
    depth: &InverseDepth,
) -> Option<Lifted> {
    // Scaled to advance by 1 along the optical axis.
    let direction = |pixel: Vector2<f64>| {
        let direction = camera.back_project(&pixel)?.direction;
        let z = camera.pose.rotation.row(2).transpose().dot(&direction);
        (z > 0.0).then(|| direction / z)
    };
    let ray = direction(*pixel)?;
    let half = 0.5;
    let slope = |step: Vector2<f64>| {
        let difference = direction(pixel + step)? - direction(pixel - step)?;
        Some(difference / (2.0 * half * depth.rho))
    };
    let slopes = Matrix3x2::from_columns(&[slope(Vector2::new(half, 0.0))?, slope(Vector2::new(0.0, half))?]);
    let by_pixel = slopes * shape * slopes.transpose();
    Some(Lifted {
        pixel: *pixel,
        world: camera.pose.centre() + ray / depth.rho,
        by_depth: ray * ray.transpose() * (depth.variance / depth.rho.powi(4)),
        by_pixel,
        metres_per_pixel: slopes.norm() / SQRT_2,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Distortion, Intrinsics, Rigid};

    #[test]
    fn a_lifted_point_projects_back_and_carries_its_noise() {
        let pose = Rigid::look_at(&Vector3::new(1.0, -0.5, 0.2), &Vector3::new(0.0, 0.0, 4.0)).unwrap();
        let camera = Camera {
            width: 640,
            height: 480,
            intrinsics: Intrinsics::new(500.0, 320.0, 240.0),
            distortion: Distortion::None,
            pose,
        };
        let (pixel, sigma) = (Vector2::new(400.0, 100.0), 0.5);
        let depth = InverseDepth { rho: 0.4, variance: 1e-4 };
        let lifted = lift(&camera, &pixel, &Matrix2::identity(), &depth).unwrap();
        let (point, covariance) = (lifted.world, lifted.covariance(sigma));
        assert!((camera.project(&point).unwrap() - pixel).norm() < 1e-9);
        let at = camera.pose.apply(&point);
        assert!((at.z - 2.5).abs() < 1e-12);
        // In camera axes: f moves x / z by sigma / f, and Z by sigma_rho Z^2.
        let local = camera.pose.rotation * covariance * camera.pose.rotation.transpose();
        assert!((local.m33.sqrt() - 0.01 * 6.25).abs() < 1e-9, "{local}");
        let across = (sigma / 500.0 * 2.5f64).powi(2) + (at.x / at.z).powi(2) * local.m33;
        assert!((local.m11 - across).abs() < 1e-9);
    }
}
