//! How a camera is calibrated
//!
//! Options for ptzcal_calibrate_camera. Without any the defaults are used, which are right for laser
//! shots and surveyed points.

use super::args::number;
use super::call::{ErrorOut, guard, guard_or};
use super::camera::{camera_in, ptzcal_camera};
use super::cancel::ptzcal_cancel;
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, borrow_optional, free};
use super::status::ptzcal_status;
use crate::calibrate::{CalibrationOptions, DistortionModel};
use crate::error::{Error, Result};

/// How a camera is calibrated.
pub struct ptzcal_calibration_options(pub(super) Exclusive<CalibrationOptions>);

impl Handle for ptzcal_calibration_options {
    const NAME: &'static str = "options";
}

impl ptzcal_calibration_options {
    /// The caller's options, or the defaults for NULL.
    ///
    /// # Safety
    /// `options` is NULL or live options.
    pub(super) unsafe fn settings(options: *const Self) -> Result<CalibrationOptions> {
        // SAFETY: by this function's contract.
        let options = unsafe { borrow_optional(options) };
        options.map_or_else(|| Ok(CalibrationOptions::default()), |o| Ok(o.0.read(Self::NAME)?.clone()))
    }

    /// Changes one setting.
    ///
    /// # Safety
    /// `options` is NULL or live options.
    unsafe fn change(options: *mut Self, change: impl FnOnce(&mut CalibrationOptions)) -> Result<()> {
        // SAFETY: by this function's contract.
        change(&mut *unsafe { borrow(options)? }.0.write(Self::NAME)?);
        Ok(())
    }
}

pub(super) fn distortion_model(value: u32) -> Result<DistortionModel> {
    use DistortionModel::{BrownConrady, Division, Fisheye, None, Radial1, Radial2};
    [None, Radial1, Radial2, BrownConrady, Division, Fisheye]
        .into_iter()
        .find(|m| *m as u32 == value)
        .ok_or_else(|| Error::invalid("model", format!("{value} is no lens model")))
}

/// Zero or more; infinity where it means "free".
fn sigma(value: f64, name: &'static str) -> Result<f64> {
    match value {
        v if v.is_nan() => Err(Error::NotFinite { name, index: 0 }),
        v if v < 0.0 => Err(Error::invalid(name, format!("{v} is negative"))),
        v => Ok(v),
    }
}

/// Makes options with their defaults, which are right for laser shots and surveyed points: no
/// distortion, hardly any skew, nearly square pixels, outliers set aside, seed 1.
///
/// @param options Receives the options; free them with ptzcal_calibration_options_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_options_new(
    options: *mut *mut ptzcal_calibration_options,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let options = unsafe { HandleOut::new(options)? };
        options.give(ptzcal_calibration_options(Exclusive::new(CalibrationOptions::default())));
        Ok(())
    })
}

/// Frees options.
///
/// @param options The options; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_options_free(options: *mut ptzcal_calibration_options) {
    // SAFETY: NULL or live options that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(options) });
}

/// Sets the lens model that is fitted. Each coefficient wants points towards the image's corners.
///
/// @param options The options.
/// @param model   A ptzcal_distortion_model; the default is PTZCAL_DISTORTION_MODEL_NONE.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_options_set_distortion(
    options: *mut ptzcal_calibration_options,
    model: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let model = distortion_model(model)?;
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { ptzcal_calibration_options::change(options, |o| o.distortion = model) }
    })
}

/// Keeps a known lens, so that only the pose is found: the points may then lie in a plane.
///
/// @param options The options.
/// @param camera  A camera whose intrinsics and distortion are kept (its pose is ignored); may be
///                NULL: the lens is found, which is the default.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_options_set_lens(
    options: *mut ptzcal_calibration_options,
    camera: *const ptzcal_camera,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let camera = if camera.is_null() { None } else { Some(unsafe { camera_in(camera)? }) };
        let lens = camera.map(|c| (c.intrinsics, c.distortion));
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { ptzcal_calibration_options::change(options, |o| o.fixed_lens = lens) }
    })
}

/// Sets how much the pixels' axes may lean: the prior standard deviation of skew / f about 0.
///
/// @param options The options.
/// @param sigma   0 forces no skew; INFINITY leaves it to the data; the default is 0.001.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_options_set_skew_sigma(
    options: *mut ptzcal_calibration_options,
    sigma: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let sigma = self::sigma(sigma, "sigma")?;
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { ptzcal_calibration_options::change(options, |o| o.skew_sigma = sigma) }
    })
}

/// Sets how far pixels may be from square: the prior standard deviation of fx / fy about 1.
///
/// @param options The options.
/// @param sigma   0 forces fx = fy; INFINITY leaves it to the data; the default is 0.001.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_options_set_aspect_sigma(
    options: *mut ptzcal_calibration_options,
    sigma: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let sigma = self::sigma(sigma, "sigma")?;
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { ptzcal_calibration_options::change(options, |o| o.aspect_sigma = sigma) }
    })
}

/// Sets the noise of pixels that were added without a covariance.
///
/// @param options The options.
/// @param sigma   Standard deviation of each coordinate, pixels; 0 (the default): estimated from the
///                residuals.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_options_set_pixel_sigma(
    options: *mut ptzcal_calibration_options,
    sigma: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let sigma = self::sigma(number(sigma, "sigma")?, "sigma")?;
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { ptzcal_calibration_options::change(options, |o| o.pixel_sigma = (sigma > 0.0).then_some(sigma)) }
    })
}

/// Chooses whether gross outliers are searched and set aside.
///
/// @param options The options.
/// @param robust  0: every measurement is used; anything else (the default): outliers are set aside.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_options_set_robust(
    options: *mut ptzcal_calibration_options,
    robust: i32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(error, || unsafe { ptzcal_calibration_options::change(options, |o| o.robust = robust != 0) })
}

/// Sets the seed of the search for outliers. The same seed gives the same result, bit for bit, on
/// the same machine.
///
/// @param options The options.
/// @param seed    Any number; the default is 1.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_options_set_seed(
    options: *mut ptzcal_calibration_options,
    seed: u64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(error, || unsafe { ptzcal_calibration_options::change(options, |o| o.seed = seed) })
}

/// Sets how uncertain the focal length may be: above it the calibration is refused
/// (PTZCAL_STATUS_DEGENERATE) rather than returned.
///
/// @param options  The options.
/// @param relative Standard deviation over focal length, positive; the default is 0.1; INFINITY
///                 returns whatever was found.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_options_set_max_focal_deviation(
    options: *mut ptzcal_calibration_options,
    relative: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let relative = sigma(relative, "relative")?;
        if relative == 0.0 {
            return Err(Error::invalid("relative", "0 would refuse every calibration"));
        }
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { ptzcal_calibration_options::change(options, |o| o.max_focal_deviation = relative) }
    })
}

/// Sets how many iterations a refinement may take before it is PTZCAL_STATUS_NO_CONVERGENCE.
///
/// @param options    The options.
/// @param iterations 1 to 10000; the default is 100.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_options_set_max_iterations(
    options: *mut ptzcal_calibration_options,
    iterations: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        if !(1..=10_000).contains(&iterations) {
            return Err(Error::invalid("iterations", format!("{iterations} is not in 1 to 10000")));
        }
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { ptzcal_calibration_options::change(options, |o| o.max_iterations = iterations as usize) }
    })
}

/// Sets the token that stops the calibration.
///
/// @param options The options.
/// @param token   The token; may be NULL: none (the default). It may be freed before the options.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_options_set_cancel(
    options: *mut ptzcal_calibration_options,
    token: *const ptzcal_cancel,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            let token = ptzcal_cancel::share(token);
            ptzcal_calibration_options::change(options, |o| o.cancel = token)
        }
    })
}
