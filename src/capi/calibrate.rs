//! Calibrating a camera
//!
//! One solver for every mixture of measurements: ptzcal_calibrate_camera finds intrinsics, lens and
//! pose with their covariance, sets gross outliers aside, and refuses sets that cannot determine the
//! answer, with a hint that says what to add. The same input and seed give the same result.

use super::args::{BufferOut, number};
use super::call::{ErrorOut, guard, guard_or};
use super::camera::{camera_in, ptzcal_camera};
use super::cancel::ptzcal_cancel;
use super::correspondences::ptzcal_correspondences;
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, borrow_optional, free};
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::calibrate::{Calibration, CalibrationOptions, DistortionModel, calibrate_camera};
use crate::error::{Error, Result};

/// How a camera is calibrated.
pub struct ptzcal_calibration_options(Exclusive<CalibrationOptions>);

impl Handle for ptzcal_calibration_options {
    const NAME: &'static str = "options";
}

impl ptzcal_calibration_options {
    /// The caller's options, or the defaults for NULL.
    ///
    /// # Safety
    /// `options` is NULL or live options.
    unsafe fn settings(options: *const Self) -> Result<CalibrationOptions> {
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
    use DistortionModel::{BrownConrady, Division, None, Radial1, Radial2};
    [None, Radial1, Radial2, BrownConrady, Division]
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

/// A calibrated camera with all that says how good it is. Immutable: any number of threads may read
/// it.
pub struct ptzcal_calibration(Calibration);

impl Handle for ptzcal_calibration {
    const NAME: &'static str = "calibration";
}

/// What a calibration says about itself.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_calibration_summary {
    /// Set by ptzcal_calibration_summary_init.
    pub struct_size: u32,
    /// Iterations of the last refinement.
    pub iterations: u32,
    /// Measurements given.
    pub measurements: u64,
    /// Measurements used; the others are outliers.
    pub inliers: u64,
    /// Parameters: the side of the covariance matrix.
    pub parameters: u64,
    /// Root mean square length of the inliers' residuals, pixels.
    pub rms: f64,
    /// Noise that the residuals show over noise that was assumed: 1 when the covariances were right.
    pub noise_factor: f64,
    /// Condition number of the normal equations, scaled to unit diagonal; 1 is perfect.
    pub condition: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_calibration_summary {
    const NAME: &'static str = "summary";
    const FIRST_SIZE: usize = 8 + 6 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            iterations: 0,
            measurements: 0,
            inliers: 0,
            parameters: 0,
            rms: 0.0,
            noise_factor: 0.0,
            condition: 0.0,
        }
    }
}

impl From<&Calibration> for ptzcal_calibration_summary {
    fn from(c: &Calibration) -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            iterations: u32::try_from(c.iterations).unwrap_or(u32::MAX),
            measurements: c.residuals.len() as u64,
            inliers: c.inliers.iter().filter(|i| **i).count() as u64,
            parameters: c.covariance.nrows() as u64,
            rms: c.rms,
            noise_factor: c.noise_factor,
            condition: c.condition,
        }
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

/// Calibrates a camera from 2D-3D measurements. The set is in use until the call returns: other
/// threads may read it, but adding to it is PTZCAL_STATUS_BUSY.
///
/// @param set     The measurements.
/// @param options The options; may be NULL: the defaults.
/// @param result  Receives the calibration; free it with ptzcal_calibration_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_DEGENERATE (the hint says
///         what to add); PTZCAL_STATUS_NO_CONSENSUS; PTZCAL_STATUS_NO_CONVERGENCE;
///         PTZCAL_STATUS_LENS_NOT_MONOTONE; PTZCAL_STATUS_CANCELLED; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibrate_camera(
    set: *const ptzcal_correspondences,
    options: *const ptzcal_calibration_options,
    result: *mut *mut ptzcal_calibration,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (result, set, options) =
            unsafe { (HandleOut::new(result)?, borrow(set)?, ptzcal_calibration_options::settings(options)?) };
        let set = set.0.read(ptzcal_correspondences::NAME)?;
        result.give(ptzcal_calibration(calibrate_camera(&set, &options)?));
        Ok(())
    })
}

/// Frees a calibration.
///
/// @param calibration The calibration; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_free(calibration: *mut ptzcal_calibration) {
    // SAFETY: NULL or a live calibration that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(calibration) });
}

/// The calibrated camera.
///
/// @param calibration The calibration.
/// @param camera      Receives the camera; set up by ptzcal_camera_init.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_get_camera(
    calibration: *const ptzcal_calibration,
    camera: *mut ptzcal_camera,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibration, camera) = unsafe { (borrow(calibration)?, SizedOut::new(camera)?) };
        camera.write(&(&calibration.0.camera).into());
        Ok(())
    })
}

/// Sets up a summary: everything 0.
///
/// @param summary The struct.
/// @param size    sizeof *summary.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_summary_init(
    summary: *mut ptzcal_calibration_summary,
    size: usize,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(summary, size) })
}

/// What the calibration says about itself.
///
/// @param calibration The calibration.
/// @param summary     Receives the summary; set up by ptzcal_calibration_summary_init.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_get_summary(
    calibration: *const ptzcal_calibration,
    summary: *mut ptzcal_calibration_summary,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibration, summary) = unsafe { (borrow(calibration)?, SizedOut::new(summary)?) };
        summary.write(&(&calibration.0).into());
        Ok(())
    })
}

/// The covariance of all parameters: p x p numbers, row-major, symmetric, p = the summary's
/// `parameters`. Their order:
///   0 fx, 1 fy, 2 skew, 3 cx, 4 cy (pixels),
///   5 ... the coefficients of the camera's lens model, in its order (0, 1 or 5 of them),
///   then 3 for the rotation: w in R <- exp([w]x) R, a turn about the camera's own axes (radians),
///   then 3 for the camera's centre in the world (metres).
/// Rows and columns of parameters that were not free are 0.
///
/// @param calibration The calibration.
/// @param buffer      Receives the numbers; may be NULL when capacity is 0.
/// @param capacity    How many numbers the buffer holds.
/// @param needed      Receives how many there are, also when they do not fit; may be NULL.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_copy_covariance(
    calibration: *const ptzcal_calibration,
    buffer: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibration, buffer) = unsafe { (borrow(calibration)?, BufferOut::new(buffer, capacity, needed)?) };
        // nalgebra is column-major; the transpose of it is row-major, whatever its symmetry.
        buffer.write(calibration.0.covariance.transpose().as_slice())
    })
}

/// Measured minus predicted pixel of every measurement, outliers included: n x 2 numbers, n = the
/// summary's `measurements`, in the order of adding. Infinite for an outlier that lies behind the
/// camera.
///
/// @param calibration The calibration.
/// @param buffer      Receives the numbers; may be NULL when capacity is 0.
/// @param capacity    How many numbers the buffer holds.
/// @param needed      Receives how many there are, also when they do not fit; may be NULL.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_copy_residuals(
    calibration: *const ptzcal_calibration,
    buffer: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibration, buffer) = unsafe { (borrow(calibration)?, BufferOut::new(buffer, capacity, needed)?) };
        let residuals: Vec<f64> = calibration.0.residuals.iter().flat_map(|r| [r.x, r.y]).collect();
        buffer.write(&residuals)
    })
}

/// Which measurements were used: n bytes, n = the summary's `measurements`, in the order of adding;
/// 1 for an inlier, 0 for an outlier.
///
/// @param calibration The calibration.
/// @param buffer      Receives the bytes; may be NULL when capacity is 0.
/// @param capacity    How many bytes the buffer holds.
/// @param needed      Receives how many there are, also when they do not fit; may be NULL.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_copy_inliers(
    calibration: *const ptzcal_calibration,
    buffer: *mut u8,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibration, buffer) = unsafe { (borrow(calibration)?, BufferOut::new(buffer, capacity, needed)?) };
        let inliers: Vec<u8> = calibration.0.inliers.iter().map(|i| u8::from(*i)).collect();
        buffer.write(&inliers)
    })
}
