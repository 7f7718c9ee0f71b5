//! Rigs over zoom
//!
//! Lens and laser line of a rig at every zoom between those that were calibrated
//! (ptzcal_rig_calibrated_get_curve), with covariances: the focal length by a monotone spline, the
//! principal point and the laser line's image by a smooth one. Zoom is the device's own number, in any
//! unit that grows or falls with the focal length.

use std::ffi::c_char;

use super::args::{ArrayOut, Out, number};
use super::call::{ErrorOut, guard, guard_or};
use super::error::ptzcal_error;
use super::file::path;
use super::handle::{Handle, HandleOut, borrow, free};
use super::rig_model::ptzcal_rig_model;
use super::sized::SizedOut;
use super::status::ptzcal_status;
use crate::format::{read_zoom_curve, write_zoom_curve};
use crate::geometry::ZoomCurve;

/// A rig over zoom. Immutable: any number of threads may read it.
pub struct ptzcal_zoom_curve(pub(super) ZoomCurve);

impl Handle for ptzcal_zoom_curve {
    const NAME: &'static str = "curve";
}

/// Row-major.
pub(super) fn numbers49(c: &nalgebra::SMatrix<f64, 7, 7>) -> [f64; 49] {
    std::array::from_fn(|i| c[(i / 7, i % 7)])
}

/// Frees a curve.
///
/// @param curve The curve; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_zoom_curve_free(curve: *mut ptzcal_zoom_curve) {
    // SAFETY: NULL or a live curve that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(curve) });
}

/// The rig at a zoom; axes through the camera's centre, true encoders.
///
/// @param curve      The curve.
/// @param zoom       Within the curve's range; of a single calibrated position: that position.
/// @param model      Receives the rig model; set up by ptzcal_rig_model_init.
/// @param covariance Receives 49 numbers, 7 x 7: as in ptzcal_laser_line, with the interpolation's own error;
///                   may be NULL.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (outside the range);
///         PTZCAL_STATUS_LENS_NOT_MONOTONE (the interpolated lens folds inside the image).
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_zoom_curve_get_rig_model(
    curve: *const ptzcal_zoom_curve,
    zoom: f64,
    model: *mut ptzcal_rig_model,
    covariance: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (curve, model, covariance) = unsafe {
            (borrow(curve)?, SizedOut::new(model)?, ArrayOut::vectors_optional::<49>(covariance, 1, "covariance")?)
        };
        let rig = curve.0.at(number(zoom, "zoom")?)?;
        model.write(&(&rig.model).into());
        if let Some(covariance) = covariance {
            covariance.write(&[numbers49(&rig.rig_covariance())]);
        }
        Ok(())
    })
}

/// The zooms that a curve answers for.
///
/// @param curve The curve.
/// @param low   Receives the least.
/// @param high  Receives the greatest.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_zoom_curve_get_range(
    curve: *const ptzcal_zoom_curve,
    low: *mut f64,
    high: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (curve, low, high) = unsafe { (borrow(curve)?, Out::new(low, "low")?, Out::new(high, "high")?) };
        let [a, b] = curve.0.range();
        low.write(a);
        high.write(b);
        Ok(())
    })
}

/// Writes a curve as JSON, every number to its last bit.
///
/// @param curve The curve.
/// @param path  The file.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_zoom_curve_save(
    curve: *const ptzcal_zoom_curve,
    path: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (curve, path) = unsafe { (borrow(curve)?, self::path(path)?) };
        write_zoom_curve(&path, &curve.0)
    })
}

/// Reads a curve from a file of ptzcal_zoom_curve_save.
///
/// @param path  The file.
/// @param curve Receives the curve; free it with ptzcal_zoom_curve_free.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT (the message names the key
///         or the line); PTZCAL_STATUS_FILE_VERSION.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_zoom_curve_load(
    path: *const c_char,
    curve: *mut *mut ptzcal_zoom_curve,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (curve, path) = unsafe { (HandleOut::new(curve)?, self::path(path)?) };
        curve.give(ptzcal_zoom_curve(read_zoom_curve(&path)?));
        Ok(())
    })
}
