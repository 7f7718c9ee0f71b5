//! Projection with uncertainty
//!
//! What the covariance of a calibration means for its use: pixels of points, viewing rays of pixels,
//! and points on a plane under pixels (the floor under a click), each with its covariance, to first
//! order. Each function takes n of them; outputs are written for all of them or for none.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::args::{ArrayOut, number, vectors, vectors_optional};
use super::calibrate::ptzcal_calibration;
use super::call::{ErrorOut, guard};
use super::error::ptzcal_error;
use super::handle::borrow;
use super::status::ptzcal_status;
use crate::calibrate::{Calibration, UncertainRay};
use crate::error::{Error, Result};
use crate::geometry::Plane;

/// The pixels of world points and their covariances.
///
/// @param calibration    The calibration.
/// @param xyz            n x 3 numbers: points, metres, world frame.
/// @param xyz_covariance n x 9 numbers: of each point, row-major, positive semi-definite, m^2; may be
///                       NULL: the points are exact.
/// @param n              Number of points.
/// @param uv             Receives n x 2 numbers: pixels.
/// @param uv_covariance  Receives n x 3 numbers: xx, xy, yy of each pixel, px^2; may be NULL. The
///                       camera's uncertainty and the point's; not the noise of a measured pixel.
/// @param error          Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BEHIND_CAMERA, PTZCAL_STATUS_OUTSIDE_LENS,
///         PTZCAL_STATUS_NOT_FINITE (index: the point); PTZCAL_STATUS_INVALID_ARGUMENT for a
///         covariance that is none.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_project(
    calibration: *const ptzcal_calibration,
    xyz: *const f64,
    xyz_covariance: *const f64,
    n: usize,
    uv: *mut f64,
    uv_covariance: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibration, xyz, xyz_covariance, uv, uv_covariance) = unsafe {
            (
                borrow(calibration)?,
                vectors::<3>(xyz, n, "xyz")?,
                vectors_optional::<9>(xyz_covariance, n, "xyz_covariance")?,
                ArrayOut::vectors::<2>(uv, n, "uv")?,
                ArrayOut::vectors_optional::<3>(uv_covariance, n, "uv_covariance")?,
            )
        };
        let (mut pixels, mut covariances) = (Vec::with_capacity(n), Vec::with_capacity(n));
        for (i, point) in xyz.iter().enumerate() {
            let covariance = xyz_covariance.map(|c| Matrix3::from_row_slice(&c[i]));
            let seen = calibration.answer.project(&Vector3::from(*point), covariance.as_ref()).map_err(|e| at(e, i))?;
            pixels.push(seen.pixel.into());
            covariances.push([seen.covariance.m11, seen.covariance.m12, seen.covariance.m22]);
        }
        uv.write(&pixels);
        if let Some(out) = uv_covariance {
            out.write(&covariances);
        }
        Ok(())
    })
}

/// The viewing rays of pixels, from the camera's centre (ptzcal_camera_centre), and their
/// covariances.
///
/// @param calibration    The calibration.
/// @param uv             n x 2 numbers: pixels.
/// @param uv_covariance  n x 3 numbers: xx, xy, yy of each pixel, positive semi-definite, px^2; may be
///                       NULL: the pixels are exact.
/// @param n              Number of pixels.
/// @param directions     Receives n x 3 numbers: unit vectors in the world frame.
/// @param ray_covariance Receives n x 36 numbers: of the centre (metres) and the direction, in that
///                       order, 6 x 6 row-major; may be NULL. The centre is the same for all pixels:
///                       so is its part.
/// @param error          Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_OUTSIDE_LENS (index: the first pixel that no ray reaches
///         through the lens model); PTZCAL_STATUS_NOT_FINITE (index: the pixel);
///         PTZCAL_STATUS_INVALID_ARGUMENT for a covariance that is none.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_back_project(
    calibration: *const ptzcal_calibration,
    uv: *const f64,
    uv_covariance: *const f64,
    n: usize,
    directions: *mut f64,
    ray_covariance: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibration, uv, uv_covariance, directions, ray_covariance) = unsafe {
            (
                borrow(calibration)?,
                vectors::<2>(uv, n, "uv")?,
                vectors_optional::<3>(uv_covariance, n, "uv_covariance")?,
                ArrayOut::vectors::<3>(directions, n, "directions")?,
                ArrayOut::vectors_optional::<36>(ray_covariance, n, "ray_covariance")?,
            )
        };
        let rays = rays(&calibration.answer, uv, uv_covariance)?;
        directions.write(&rays.iter().map(|r| r.ray.direction.into()).collect::<Vec<[f64; 3]>>());
        if let Some(out) = ray_covariance {
            // Symmetric: the order of rows and columns is all one.
            let flat = |r: &UncertainRay| std::array::from_fn(|i| r.covariance.as_slice()[i]);
            out.write(&rays.iter().map(flat).collect::<Vec<[f64; 36]>>());
        }
        Ok(())
    })
}

/// The points of a plane under pixels, and their covariances: where on the floor is what was clicked
/// on?
///
/// @param calibration    The calibration.
/// @param uv             n x 2 numbers: pixels.
/// @param uv_covariance  n x 3 numbers: xx, xy, yy of each pixel, positive semi-definite, px^2; may be
///                       NULL: the pixels are exact.
/// @param n              Number of pixels.
/// @param normal         3 numbers: the plane's normal in the world frame, of any length but zero.
/// @param distance       The plane is normal . x = distance (metres, for a normal of unit length).
/// @param xyz            Receives n x 3 numbers: points, metres, world frame.
/// @param xyz_covariance Receives n x 9 numbers: of each point, row-major, m^2; may be NULL. The plane
///                       is exact: across it nothing varies.
/// @param error          Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BEHIND_CAMERA (index: the first pixel whose ray does not
///         meet the plane in front of the camera); PTZCAL_STATUS_OUTSIDE_LENS (index: the first pixel
///         that no ray reaches through the lens model); PTZCAL_STATUS_NOT_FINITE (index: the pixel);
///         PTZCAL_STATUS_INVALID_ARGUMENT for a normal or covariance that is none.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_back_project_to_plane(
    calibration: *const ptzcal_calibration,
    uv: *const f64,
    uv_covariance: *const f64,
    n: usize,
    normal: *const f64,
    distance: f64,
    xyz: *mut f64,
    xyz_covariance: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibration, uv, uv_covariance, normal, xyz, xyz_covariance) = unsafe {
            (
                borrow(calibration)?,
                vectors::<2>(uv, n, "uv")?,
                vectors_optional::<3>(uv_covariance, n, "uv_covariance")?,
                vectors::<3>(normal, 1, "normal")?[0],
                ArrayOut::vectors::<3>(xyz, n, "xyz")?,
                ArrayOut::vectors_optional::<9>(xyz_covariance, n, "xyz_covariance")?,
            )
        };
        let plane = Plane::new(Vector3::from(normal), number(distance, "distance")?)
            .ok_or_else(|| Error::invalid("normal", "the plane has none"))?;
        let points = rays(&calibration.answer, uv, uv_covariance)?
            .iter()
            .enumerate()
            .map(|(index, ray)| ray.intersect(&plane).ok_or(Error::BehindCamera { index }))
            .collect::<Result<Vec<_>>>()?;
        xyz.write(&points.iter().map(|p| p.point.into()).collect::<Vec<[f64; 3]>>());
        if let Some(out) = xyz_covariance {
            let flat = |c: &Matrix3<f64>| std::array::from_fn(|i| c.as_slice()[i]);
            out.write(&points.iter().map(|p| flat(&p.covariance)).collect::<Vec<[f64; 9]>>());
        }
        Ok(())
    })
}

fn rays(calibration: &Calibration, uv: &[[f64; 2]], uv_covariance: Option<&[[f64; 3]]>) -> Result<Vec<UncertainRay>> {
    uv.iter()
        .enumerate()
        .map(|(i, pixel)| {
            let covariance = uv_covariance.map(|c| Matrix2::new(c[i][0], c[i][1], c[i][1], c[i][2]));
            calibration.back_project(&Vector2::from(*pixel), covariance.as_ref()).map_err(|e| at(e, i))
        })
        .collect()
}

/// The same error, of the element with this index.
fn at(e: Error, index: usize) -> Error {
    match e {
        Error::BehindCamera { .. } => Error::BehindCamera { index },
        Error::OutsideLens { .. } => Error::OutsideLens { index },
        Error::NotFinite { name, .. } => Error::NotFinite { name, index },
        other => other,
    }
}
