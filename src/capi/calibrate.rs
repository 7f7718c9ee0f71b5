//! Calibrating a camera
//!
//! One solver for every mixture of measurements: ptzcal_calibrate_camera finds intrinsics, lens and
//! pose with their covariance, sets gross outliers aside, and refuses sets that cannot determine the
//! answer, with a hint that says what to add. The same input and seed give the same result.

use std::ffi::CString;
use std::sync::OnceLock;

use super::args::BufferOut;
use super::calibration_options::ptzcal_calibration_options;
use super::call::{ErrorOut, guard, guard_or};
use super::camera::ptzcal_camera;
use super::correspondences::ptzcal_correspondences;
use super::error::{c_string, ptzcal_error};
use super::handle::{Handle, HandleOut, borrow, free};
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::calibrate::{Calibration, CalibrationOptions, Correspondences, calibrate_camera};

/// A calibrated camera with all that says how good it is. Immutable: any number of threads may read
/// it.
pub struct ptzcal_calibration {
    pub(super) answer: Calibration,
    /// What ptzcal_calibrate_camera made it from; other functions' inputs are not a set alone.
    pub(super) inputs: Option<(Correspondences, CalibrationOptions)>,
    /// The texts that C borrows.
    pub(super) warnings: Vec<CString>,
    pub(super) weakest: OnceLock<CString>,
}

impl Handle for ptzcal_calibration {
    const NAME: &'static str = "calibration";
}

impl From<Calibration> for ptzcal_calibration {
    fn from(answer: Calibration) -> Self {
        let warnings = answer.check.warnings.iter().map(|w| c_string(w)).collect();
        Self { answer, inputs: None, warnings, weakest: OnceLock::new() }
    }
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
    /// Sum of squared residuals, each over its stated standard deviation, priors included.
    pub chi2: f64,
    /// Its degrees of freedom.
    pub degrees_of_freedom: u64,
    /// Chance of such residuals or larger ones when model and stated noise are right. Below 0.001 the
    /// model does not fit. Means nothing where the noise was estimated from the residuals.
    pub probability: f64,
    /// How many warnings there are: see ptzcal_calibration_warning.
    pub warnings: u64,
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
            chi2: 0.0,
            degrees_of_freedom: 0,
            probability: 0.0,
            warnings: 0,
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
            chi2: c.check.chi2,
            degrees_of_freedom: c.check.freedom as u64,
            probability: c.check.probability,
            warnings: c.check.warnings.len() as u64,
        }
    }
}

/// Calibrates a camera from 2D-3D measurements. The set is in use until the call returns: other
/// threads may read it, but adding to it is PTZCAL_STATUS_BUSY. The calibration keeps a copy of both,
/// which ptzcal_calibration_save writes.
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
        let answer = calibrate_camera(&set, &options)?;
        result.give(ptzcal_calibration { inputs: Some((set.clone(), options)), ..answer.into() });
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
        camera.write(&(&calibration.answer.camera).into());
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
        summary.write(&(&calibration.answer).into());
        Ok(())
    })
}

/// The covariance of all parameters: p x p numbers, row-major, symmetric, p = the summary's
/// `parameters`. Their order:
///   0 fx, 1 fy, 2 skew, 3 cx, 4 cy (pixels),
///   5 ... the coefficients of the camera's lens model, in its order (0, 1, 4 or 5 of them),
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
        buffer.write(calibration.answer.covariance.transpose().as_slice())
    })
}

/// Measured minus predicted pixel of every measurement, outliers included: n x 2 numbers, n = the
/// summary's `measurements`, in the order of adding. Of a line they are the signed distances of its
/// segment's two ends from the line's image, positive to the right of it as seen from the first end to
/// the second. Infinite for an outlier that the camera cannot see (behind it).
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
        let residuals: Vec<f64> = calibration.answer.residuals.iter().flat_map(|r| [r.x, r.y]).collect();
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
        let inliers: Vec<u8> = calibration.answer.inliers.iter().map(|i| u8::from(*i)).collect();
        buffer.write(&inliers)
    })
}
