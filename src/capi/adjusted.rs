//! Joint adjustment: the answer
//!
//! Estimates of everything with their joint covariance. The answer holds its input, so that it can be
//! solved again.

use std::ffi::{CString, c_char};

use super::args::BufferOut;
use super::calibrate::ptzcal_calibration;
use super::call::{ErrorOut, guard, guard_or};
use super::cancel::ptzcal_cancel;
use super::error::{c_string, ptzcal_error};
use super::handle::{Handle, HandleOut, borrow, free};
use super::pose::ptzcal_pose;
use super::rig_model::ptzcal_rig_model;
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::adjust::{AdjustOptions, Adjusted, adjust};
use crate::error::Error;

/// A survey solved. Immutable: any number of threads may read it.
pub struct ptzcal_adjusted {
    pub(super) adjusted: Adjusted,
    /// The texts that C borrows.
    names: Vec<CString>,
    pub(super) warnings: Vec<CString>,
    pub(super) suspects: Vec<CString>,
    pub(super) prior_only: Vec<CString>,
    pub(super) weakest: CString,
    condition: f64,
}

impl Handle for ptzcal_adjusted {
    const NAME: &'static str = "adjusted";
}

fn c_strings(texts: impl IntoIterator<Item = impl AsRef<str>>) -> Vec<CString> {
    texts.into_iter().map(|t| c_string(t.as_ref())).collect()
}

impl ptzcal_adjusted {
    pub(super) fn new(adjusted: Adjusted) -> Self {
        let weakest = adjusted.weakest();
        let (text, condition) = weakest.as_ref().map_or(("", f64::INFINITY), |w| (&w.text, w.condition));
        Self {
            names: c_strings(adjusted.parameter_names()),
            warnings: c_strings(&adjusted.check.warnings),
            suspects: c_strings(adjusted.check.suspects.iter().map(|s| &s.group)),
            prior_only: c_strings(weakest.iter().flat_map(|w| &w.prior_only)),
            weakest: c_string(text),
            condition,
            adjusted,
        }
    }

    /// One of its texts, "" when there is none.
    ///
    /// # Safety
    /// `adjusted` is NULL or a live answer.
    pub(super) unsafe fn text(adjusted: *const Self, choose: impl Fn(&Self) -> Option<&CString>) -> *const c_char {
        // SAFETY: by this function's contract.
        unsafe { adjusted.as_ref() }.and_then(choose).map_or(c"".as_ptr(), |text| text.as_ptr())
    }
}

/// What an adjustment says about itself.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_adjusted_summary {
    /// Set by ptzcal_adjusted_summary_init.
    pub struct_size: u32,
    /// Iterations of all refinements.
    pub iterations: u32,
    /// Parameters, fixed ones included: the side of the covariance matrix.
    pub parameters: u64,
    /// Stations.
    pub stations: u64,
    /// Fixed cameras.
    pub cameras: u64,
    /// Shots.
    pub shots: u64,
    /// Spots given, those of the head camera and of the fixed ones.
    pub spots: u64,
    /// Spots used; the others are outliers.
    pub used: u64,
    /// How many warnings there are: see ptzcal_adjusted_warning.
    pub warnings: u64,
    /// How many groups of fixed parameters the data want to move: see ptzcal_adjusted_get_suspect.
    pub suspects: u64,
    /// How many parameters the data say next to nothing of: see ptzcal_adjusted_prior_only.
    pub prior_only: u64,
    /// Degrees of freedom of chi2.
    pub degrees_of_freedom: u64,
    /// Sum of squared residuals in units of their standard deviations, priors included.
    pub chi2: f64,
    /// Chance of such residuals or larger when model and stated noise are right. Below 1e-3 the
    /// covariance was scaled by chi2 / degrees_of_freedom, where that is more than 1, and a warning says so.
    pub probability: f64,
    /// Noise that the residuals' median shows over the stated one, at least 1.
    pub noise_factor: f64,
    /// Condition number of the normal equations, scaled to unit diagonal; 1 is perfect.
    pub condition: f64,
    /// Planes.
    pub planes: u64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_adjusted_summary {
    const NAME: &'static str = "summary";
    const FIRST_SIZE: usize = 8 + 15 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            iterations: 0,
            parameters: 0,
            stations: 0,
            cameras: 0,
            shots: 0,
            spots: 0,
            used: 0,
            warnings: 0,
            suspects: 0,
            prior_only: 0,
            degrees_of_freedom: 0,
            chi2: 0.0,
            probability: 0.0,
            noise_factor: 0.0,
            condition: 0.0,
            planes: 0,
        }
    }
}

impl From<&ptzcal_adjusted> for ptzcal_adjusted_summary {
    fn from(answer: &ptzcal_adjusted) -> Self {
        let a = &answer.adjusted;
        let heads = a.input.shots().iter().filter(|s| s.head.is_some()).count();
        let inliers = |flags: &[bool]| flags.iter().filter(|i| **i).count();
        let (mut spots, mut used) = (heads, inliers(&a.head_inliers));
        for camera in &a.cameras {
            spots += camera.inliers.len();
            used += inliers(&camera.inliers);
        }
        Self {
            struct_size: size_of::<Self>() as u32,
            iterations: u32::try_from(a.iterations).unwrap_or(u32::MAX),
            parameters: a.covariance.nrows() as u64,
            stations: a.stations.len() as u64,
            cameras: a.cameras.len() as u64,
            shots: a.input.shots().len() as u64,
            spots: spots as u64,
            used: used as u64,
            warnings: answer.warnings.len() as u64,
            suspects: answer.suspects.len() as u64,
            prior_only: answer.prior_only.len() as u64,
            degrees_of_freedom: a.check.freedom as u64,
            chi2: a.check.chi2,
            probability: a.check.probability,
            noise_factor: a.noise_factor,
            condition: answer.condition,
            planes: a.planes.len() as u64,
        }
    }
}

/// Frees an answer. Texts taken from it die with it; calibrations taken from it live on.
///
/// @param adjusted The answer; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjusted_free(adjusted: *mut ptzcal_adjusted) {
    // SAFETY: NULL or a live answer that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(adjusted) });
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
pub unsafe extern "C" fn ptzcal_adjusted_summary_init(
    summary: *mut ptzcal_adjusted_summary,
    size: usize,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(summary, size) })
}

/// What the adjustment says about itself.
///
/// @param adjusted The answer.
/// @param summary  Receives the summary; set up by ptzcal_adjusted_summary_init.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjusted_get_summary(
    adjusted: *const ptzcal_adjusted,
    summary: *mut ptzcal_adjusted_summary,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjusted, summary) = unsafe { (borrow(adjusted)?, SizedOut::new(summary)?) };
        summary.write(&adjusted.into());
        Ok(())
    })
}

/// The adjusted rig.
///
/// @param adjusted The answer.
/// @param model    Receives the model; set up by ptzcal_rig_model_init.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjusted_get_rig_model(
    adjusted: *const ptzcal_adjusted,
    model: *mut ptzcal_rig_model,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjusted, model) = unsafe { (borrow(adjusted)?, SizedOut::new(model)?) };
        model.write(&(&adjusted.adjusted.rig).into());
        Ok(())
    })
}

/// Where the rig stood: X_world = rotation X_station + translation.
///
/// @param adjusted The answer.
/// @param station  The station's index.
/// @param pose     Receives the pose; set up by ptzcal_pose_init; the figures of an estimate by roof
///                 edges are 0.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT when there is no such station.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjusted_get_station(
    adjusted: *const ptzcal_adjusted,
    station: u32,
    pose: *mut ptzcal_pose,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjusted, pose) = unsafe { (borrow(adjusted)?, SizedOut::new(pose)?) };
        let stations = &adjusted.adjusted.stations;
        let none = || Error::invalid("station", format!("{station} of {}", stations.len()));
        pose.write(&ptzcal_pose::of(stations.get(station as usize).ok_or_else(none)?));
        Ok(())
    })
}

/// A fixed camera as a calibration of its own. Its covariance contains what is not known of rig and
/// stations; its residuals and inliers are of its sightings in the order of the shots.
///
/// @param adjusted    The answer.
/// @param camera      The camera's index.
/// @param calibration Receives the calibration; free it with ptzcal_calibration_free.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT when there is no such camera.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjusted_get_calibration(
    adjusted: *const ptzcal_adjusted,
    camera: u32,
    calibration: *mut *mut ptzcal_calibration,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibration, adjusted) = unsafe { (HandleOut::new(calibration)?, borrow(adjusted)?) };
        let cameras = &adjusted.adjusted.cameras;
        let none = || Error::invalid("camera", format!("{camera} of {}", cameras.len()));
        calibration.give(ptzcal_calibration::from(cameras.get(camera as usize).ok_or_else(none)?.clone()));
        Ok(())
    })
}

/// The covariance of all parameters: p x p numbers, row-major, symmetric, p = the summary's
/// `parameters`. Their order: PTZCAL_RIG_PARAMETERS of the rig (ptzcal_rig_parameter); six of every
/// station (as ptzcal_adjustment_add_station takes them); those of every camera (as
/// ptzcal_calibration_copy_covariance has them); then three of every plane, of which
/// ptzcal_adjusted_get_plane says more. Rows and columns of fixed parameters are 0.
///
/// @param adjusted The answer.
/// @param buffer   Receives the numbers; may be NULL when capacity is 0.
/// @param capacity How many numbers the buffer holds.
/// @param needed   Receives how many there are, also when they do not fit; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjusted_copy_covariance(
    adjusted: *const ptzcal_adjusted,
    buffer: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjusted, buffer) = unsafe { (borrow(adjusted)?, BufferOut::new(buffer, capacity, needed)?) };
        // Symmetric: by columns is by rows.
        buffer.write(adjusted.adjusted.covariance.as_slice())
    })
}

/// Name of a parameter of the covariance, such as "laser x0" or "camera 1 position z".
///
/// @param adjusted The answer; may be NULL.
/// @param index    The parameter.
/// @return A string that lives as long as the answer; "" when there is no such parameter; never NULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjusted_parameter_name(
    adjusted: *const ptzcal_adjusted,
    index: usize,
) -> *const c_char {
    // SAFETY: NULL or a live answer, as the header demands.
    unsafe { ptzcal_adjusted::text(adjusted, |a| a.names.get(index)) }
}

/// Solves the same survey again with the same options: the same bits.
///
/// @param adjusted The answer.
/// @param cancel   Ends the call early from another thread; may be NULL.
/// @param result   Receives the new answer; free it with ptzcal_adjusted_free.
/// @param error    Receives the error; may be NULL.
/// @return As ptzcal_adjustment_solve.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjusted_resolve(
    adjusted: *const ptzcal_adjusted,
    cancel: *const ptzcal_cancel,
    result: *mut *mut ptzcal_adjusted,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (result, adjusted, cancel) =
            unsafe { (HandleOut::new(result)?, borrow(adjusted)?, ptzcal_cancel::share(cancel)) };
        let earlier = &adjusted.adjusted;
        let options = AdjustOptions { cancel, ..earlier.options.clone() };
        result.give(ptzcal_adjusted::new(adjust(&earlier.input, &options)?));
        Ok(())
    })
}
