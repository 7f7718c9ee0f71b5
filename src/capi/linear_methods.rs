//! Closed forms with lens distortion
//!
//! The two linear methods with the division model, by their names. Both take every measurement as it
//! is (no outliers are set aside) and the centre of distortion as given; ptzcal_calibrate_camera begins
//! with the first one where a lens is fitted, and finds the centre, which is the principal point, too.

use nalgebra::Vector2;

use super::args::vectors_optional;
use super::call::{ErrorOut, guard};
use super::camera::ptzcal_camera;
use super::correspondences::ptzcal_correspondences;
use super::error::ptzcal_error;
use super::handle::{Handle, borrow};
use super::sized::SizedOut;
use super::status::ptzcal_status;
use crate::calibrate::Correspondences;
use crate::calibrate::division_camera::DivisionCamera;
use crate::calibrate::division_eigenproblem::division_eigenproblem;
use crate::calibrate::radial_alignment::radial_alignment;
use crate::error::Result;

/// A linear method on the caller's set.
///
/// # Safety
/// The pointers keep the header's rules.
unsafe fn solve(
    method: fn(&Correspondences, Option<Vector2<f64>>) -> Result<DivisionCamera>,
    set: *const ptzcal_correspondences,
    centre: *const f64,
    camera: *mut ptzcal_camera,
) -> Result<()> {
    // SAFETY: by this function's contract.
    let (camera, set, centre) =
        unsafe { (SizedOut::new(camera)?, borrow(set)?, vectors_optional::<2>(centre, 1, "centre")?) };
    let set = set.0.read(ptzcal_correspondences::NAME)?;
    let found = method(&set, centre.and_then(|c| c.first()).map(|c| Vector2::from(*c)))?;
    camera.write(&(&found.camera()?).into());
    Ok(())
}

/// Radial alignment (Tsai 1987) with the division model: a camera with a radial lens in two linear
/// steps, from at least 7 measurements. Its lambda is within about a fifth of the best possible
/// accuracy, and it works without distortion too.
///
/// @param set    The measurements, free of outliers; not in one plane.
/// @param centre 2 numbers: the centre of distortion, pixels; may be NULL: the image's centre.
/// @param camera Receives the camera, with a lens PTZCAL_DISTORTION_MODEL_DIVISION about its principal
///               point; set up by ptzcal_camera_init. Lambda in pixels^-2 is
///               distortion[0] / (fx fy).
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_DEGENERATE;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_radial_alignment(
    set: *const ptzcal_correspondences,
    centre: *const f64,
    camera: *mut ptzcal_camera,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(error, || unsafe { solve(radial_alignment, set, centre, camera) })
}

/// The direct linear transform with the division model as a generalised eigenproblem (Fitzgibbon
/// 2001), from at least 6 measurements. The weaker method: lambda is off by about sigma^2 / lambda
/// however many measurements there are, and a lens without distortion is refused or answered with a
/// lambda that means nothing. Use ptzcal_radial_alignment.
///
/// @param set    The measurements, free of outliers; their own errors in space are not used.
/// @param centre 2 numbers: the centre of distortion, pixels; may be NULL: the image's centre.
/// @param camera Receives the camera, with a lens PTZCAL_DISTORTION_MODEL_DIVISION about its principal
///               point; set up by ptzcal_camera_init. Lambda in pixels^-2 is
///               distortion[0] / (fx fy).
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_DEGENERATE (no eigenvalue is
///         real, is a lens, or puts all points in front of the camera);
///         PTZCAL_STATUS_NO_CONVERGENCE; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_division_eigenproblem(
    set: *const ptzcal_correspondences,
    centre: *const f64,
    camera: *mut ptzcal_camera,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(error, || unsafe { solve(division_eigenproblem, set, centre, camera) })
}
