//! What a calibration's own covariance means for its use: pixels of points, viewing rays of pixels,
//! and points where those rays end, each with a first-order covariance.

use nalgebra::{
    Const, DMatrix, Dyn, Matrix2, Matrix2x3, Matrix2xX, Matrix3, Matrix3x6, Matrix6, Matrix6x2, Matrix6xX, OMatrix,
    SMatrix, Vector2, Vector3,
};

use super::Calibration;
use crate::error::{Error, Result};
use crate::geometry::camera::Projection;
use crate::geometry::{Camera, Plane, Ray};

/// Where a point is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UncertainPixel {
    pub pixel: Vector2<f64>,
    /// px^2.
    pub covariance: Matrix2<f64>,
}

/// What a pixel sees: a ray in the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UncertainRay {
    pub ray: Ray,
    /// Of the origin (metres) and the unit direction, in that order. The direction's part is singular
    /// along the direction.
    pub covariance: Matrix6<f64>,
}

/// A point in the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UncertainPoint {
    pub point: Vector3<f64>,
    /// m^2.
    pub covariance: Matrix3<f64>,
}

/// A pixel's ray with its derivatives.
pub(crate) struct RayDerivatives {
    pub ray: Ray,
    /// Of the origin and the unit direction by the parameters, in the order of the covariance.
    pub by_parameters: Matrix6xX<f64>,
    pub by_pixel: Matrix6x2<f64>,
}

impl Calibration {
    /// Where the camera sees a world point (metres). The covariance holds the camera's own uncertainty
    /// and, where given, the point's (m^2, positive semi-definite), independent of it; not the noise of
    /// a measurement of the pixel.
    ///
    /// # Errors
    /// `BehindCamera`, `OutsideLens`, `NotFinite`, `InvalidArgument` for a covariance that is none.
    pub fn project(&self, world: &Vector3<f64>, covariance: Option<&Matrix3<f64>>) -> Result<UncertainPixel> {
        let (pixel, by_parameters, by_point) = self.pixel_with_derivatives(world)?;
        let mut sum = self.propagate(&by_parameters);
        if let Some(c) = covariance {
            semidefinite(c, "xyz covariance")?;
            sum += by_point * c * by_point.transpose();
        }
        Ok(UncertainPixel { pixel, covariance: symmetric(&sum) })
    }

    /// The ray through a pixel, from the camera's centre. The covariance holds the camera's own
    /// uncertainty and, where given, the pixel's (px^2, positive semi-definite), independent of it.
    ///
    /// # Errors
    /// `OutsideLens` where no ray reaches the pixel, `NotFinite`, `InvalidArgument`.
    pub fn back_project(&self, pixel: &Vector2<f64>, covariance: Option<&Matrix2<f64>>) -> Result<UncertainRay> {
        let RayDerivatives { ray, by_parameters, by_pixel } = self.ray_with_derivatives(pixel)?;
        let mut sum = self.propagate(&by_parameters);
        if let Some(c) = covariance {
            semidefinite(c, "uv covariance")?;
            sum += by_pixel * c * by_pixel.transpose();
        }
        Ok(UncertainRay { ray, covariance: symmetric(&sum) })
    }

    /// The ray through a pixel and how it moves: the derivatives of the projection, inverted (the
    /// implicit function theorem), so that no lens model needs a second set.
    pub(crate) fn ray_with_derivatives(&self, pixel: &Vector2<f64>) -> Result<RayDerivatives> {
        ray_derivatives(&self.camera, pixel)
    }

    /// The pixel of a world point, with its derivatives by the parameters and by the point.
    pub(crate) fn pixel_with_derivatives(
        &self,
        world: &Vector3<f64>,
    ) -> Result<(Vector2<f64>, Matrix2xX<f64>, Matrix2x3<f64>)> {
        finite(world.as_slice(), "xyz")?;
        let p = self.camera.project_with_jacobian(world).ok_or_else(|| {
            let in_front = self.camera.pose.apply(world).z > 0.0;
            if in_front { Error::OutsideLens { index: 0 } } else { Error::BehindCamera { index: 0 } }
        })?;
        Ok((p.pixel, by_parameters(&self.camera, &p, &p.by_centre), p.by_point))
    }

    /// J C J^T with the calibration's covariance.
    fn propagate<const N: usize>(&self, j: &OMatrix<f64, Const<N>, Dyn>) -> SMatrix<f64, N, N> {
        j * &self.covariance * j.transpose()
    }
}

/// The ray through a pixel of a camera whose parameters have this covariance, in the order of
/// [`Calibration::covariance`]: [`Calibration::back_project`] without a pixel's noise.
pub(crate) fn ray_covariance(camera: &Camera, covariance: &DMatrix<f64>, pixel: &Vector2<f64>) -> Result<UncertainRay> {
    let RayDerivatives { ray, by_parameters, .. } = ray_derivatives(camera, pixel)?;
    let sum = &by_parameters * covariance * by_parameters.transpose();
    Ok(UncertainRay { ray, covariance: symmetric(&sum) })
}

fn ray_derivatives(camera: &Camera, pixel: &Vector2<f64>) -> Result<RayDerivatives> {
    finite(pixel.as_slice(), "uv")?;
    let outside = || Error::OutsideLens { index: 0 };
    let ray = camera.back_project(pixel).ok_or_else(outside)?;
    let d = ray.direction;
    // As a point at infinity the direction moves with everything but the centre.
    let p = camera.project_homogeneous(&d, 0.0).ok_or_else(outside)?;
    // Two unit vectors across the ray: all that a unit direction can do.
    let e1 = d.cross(&Vector3::ith(d.iamin(), 1.0)).normalize();
    let across = SMatrix::<f64, 3, 2>::from_columns(&[e1, d.cross(&e1)]);
    let direction_by_pixel = across * (p.by_point * across).try_inverse().ok_or_else(outside)?;
    let lens = by_parameters(camera, &p, &Matrix2x3::zeros());
    let parameters = lens.ncols();
    let mut by_parameters = Matrix6xX::zeros(parameters);
    by_parameters.view_mut((0, parameters - 3), (3, 3)).fill_with_identity();
    by_parameters.view_mut((3, 0), (3, parameters)).copy_from(&(direction_by_pixel * -lens));
    let mut by_pixel = Matrix6x2::zeros();
    by_pixel.fixed_view_mut::<3, 2>(3, 0).copy_from(&direction_by_pixel);
    Ok(RayDerivatives { ray, by_parameters, by_pixel })
}

/// Derivatives of a pixel by the parameters, in the order of the covariance.
fn by_parameters(camera: &Camera, p: &Projection, by_centre: &Matrix2x3<f64>) -> Matrix2xX<f64> {
    let coefficients = camera.distortion.coefficients().len();
    let mut j = Matrix2xX::zeros(11 + coefficients);
    j.columns_mut(0, 5).copy_from(&p.by_intrinsics);
    j.columns_mut(5, coefficients).copy_from(&p.by_distortion.columns(0, coefficients));
    j.columns_mut(5 + coefficients, 3).copy_from(&p.by_rotation);
    j.columns_mut(8 + coefficients, 3).copy_from(by_centre);
    j
}

impl UncertainRay {
    /// The point of the ray at `distance` (metres, along the ray) with that distance's variance (m^2),
    /// independent of the ray: 0 for one that is exact.
    ///
    /// # Errors
    /// `NotFinite`, `InvalidArgument` for a distance that is not positive or a negative variance.
    pub fn point_at(&self, distance: f64, variance: f64) -> Result<UncertainPoint> {
        finite(&[distance, variance], "distance")?;
        if distance <= 0.0 || variance < 0.0 {
            return Err(Error::invalid("distance", format!("{distance} m, variance {variance}")));
        }
        let d = self.ray.direction;
        let covariance = self.moved(distance, &Matrix3::identity()) + d * d.transpose() * variance;
        Ok(UncertainPoint { point: self.ray.at(distance), covariance })
    }

    /// Where the ray meets a plane that is exact: what a click on the floor means. `None` when it does
    /// not meet it in front of the camera.
    pub fn intersect(&self, plane: &Plane) -> Option<UncertainPoint> {
        let point = plane.intersect_ray(&self.ray)?;
        let d = self.ray.direction;
        // The point slides along the ray until it is back in the plane.
        let slide = Matrix3::identity() - d * plane.normal.transpose() / plane.normal.dot(&d);
        let covariance = self.moved((point - self.ray.origin).norm(), &slide);
        covariance.iter().all(|v| v.is_finite()).then_some(UncertainPoint { point, covariance })
    }

    /// Covariance of the ray's point at a distance, seen through `map`.
    fn moved(&self, distance: f64, map: &Matrix3<f64>) -> Matrix3<f64> {
        let mut j = Matrix3x6::zeros();
        j.fixed_view_mut::<3, 3>(0, 0).copy_from(map);
        j.fixed_view_mut::<3, 3>(0, 3).copy_from(&(map * distance));
        symmetric(&(j * self.covariance * j.transpose()))
    }
}

/// Without the rounding that makes it lopsided.
fn symmetric<const N: usize>(c: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    (c + c.transpose()) * 0.5
}

fn finite(values: &[f64], name: &'static str) -> Result<()> {
    if values.iter().all(|v| v.is_finite()) { Ok(()) } else { Err(Error::NotFinite { name, index: 0 }) }
}

/// Refuses what is no covariance; zero is one.
pub(crate) fn semidefinite<const N: usize>(c: &SMatrix<f64, N, N>, name: &'static str) -> Result<()> {
    finite(c.as_slice(), name)?;
    // Every two variables' covariance is bounded by their variances: enough to catch what is mistyped
    // or misordered, at the price of three numbers.
    let bounded = (0..N).all(|i| {
        c[(i, i)] >= 0.0
            && (0..N).all(|k| {
                let bound = (c[(i, i)] * c[(k, k)]).sqrt() * (1.0 + 1e-9);
                c[(i, k)].abs() <= bound && (c[(i, k)] - c[(k, i)]).abs() <= 1e-9 * bound
            })
    });
    if bounded { Ok(()) } else { Err(Error::invalid(name, "not positive semi-definite")) }
}
