//! Joint adjustment: what is known
//!
//! A survey of one rig, from one or several stations, with all fixed cameras that watched it, to be
//! solved at once: the rig's laser line, head camera, axes and encoders, its pose at every station,
//! and each camera's intrinsics, lens and pose. What is known of them beforehand goes in as a prior:
//! a covariance about given values, where a variance of 0 fixes a parameter and INFINITY frees it.
//! Stations, cameras and shots count from 0 in the order of adding. Each function that adds does it
//! whole or not at all.

use nalgebra::DMatrix;

use super::args::{Out, array};
use super::calibrate::ptzcal_calibration;
use super::calibration_options::ptzcal_calibration_options;
use super::call::{ErrorOut, guard, guard_or};
use super::camera::{camera_in, ptzcal_camera};
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, free};
use super::pose::{pose_in, ptzcal_pose};
use super::rig_model::{model_in, ptzcal_rig_model};
use super::status::ptzcal_status;
use crate::adjust::{Adjustment, CameraSetup, Prior, Station};
use crate::error::{Error, Result};
use crate::geometry::RIG_PARAMETERS;

/// How many parameters a rig has: see ptzcal_rig_parameter.
pub const PTZCAL_RIG_PARAMETERS: usize = 15;

/// A rig's parameters, in the order of all vectors and covariances of them; the names are those of
/// ptzcal_rig_model's members.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ptzcal_rig_parameter {
    /// Metres.
    LaserX0 = 0,
    /// Metres.
    LaserY0 = 1,
    /// Slope, metres per metre of depth.
    LaserVx = 2,
    /// Slope, metres per metre of depth.
    LaserVy = 3,
    /// One scale for fx, fy and skew of the head camera: the natural logarithm of fx, so that a
    /// standard deviation is relative. The head's lens is taken as given.
    HeadFocal = 4,
    /// Pixels.
    HeadCx = 5,
    /// Pixels.
    HeadCy = 6,
    /// Metres.
    AxisTiltY = 7,
    /// Metres.
    AxisTiltZ = 8,
    /// Metres.
    AxisPanX = 9,
    /// Metres.
    AxisPanZ = 10,
    /// Radians. Turns the world of a single station: free it only beside something that holds it.
    PanZero = 11,
    /// About 1.
    PanScale = 12,
    /// Radians.
    TiltZero = 13,
    /// About 1.
    TiltScale = 14,
}

/// A survey to be adjusted.
pub struct ptzcal_adjustment(pub(super) Exclusive<Adjustment>);

impl Handle for ptzcal_adjustment {
    const NAME: &'static str = "adjustment";
}

/// Numbers of a prior: finite, or INFINITY.
///
/// # Safety
/// As for [`array`].
unsafe fn prior_numbers<'a>(ptr: *const f64, n: usize, name: &'static str) -> Result<&'a [f64]> {
    // SAFETY: by this function's contract.
    let numbers = unsafe { array(ptr, n, name)? };
    match numbers.iter().position(|x| x.is_nan() || *x == f64::NEG_INFINITY) {
        Some(index) => Err(Error::NotFinite { name, index }),
        None => Ok(numbers),
    }
}

/// A row-major covariance of `n` parameters.
///
/// # Safety
/// As for [`array`], with n x n numbers.
unsafe fn prior_covariance(ptr: *const f64, n: usize) -> Result<Prior> {
    // SAFETY: by this function's contract.
    let numbers = unsafe { prior_numbers(ptr, n * n, "covariance")? };
    Ok(Prior::of_covariance(DMatrix::from_row_slice(n, n, numbers)))
}

pub(super) fn index(value: usize, name: &'static str) -> Result<u32> {
    u32::try_from(value).map_err(|_| Error::invalid(name, "too many"))
}

/// Makes a survey without stations, cameras and shots. Its rig is known exactly until
/// ptzcal_adjustment_set_rig_sigmas or ptzcal_adjustment_set_rig_covariance says otherwise.
///
/// @param model      The rig as it is believed to be: the mean of its prior.
/// @param adjustment Receives the survey; free it with ptzcal_adjustment_free.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjustment_new(
    model: *const ptzcal_rig_model,
    adjustment: *mut *mut ptzcal_adjustment,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjustment, model) = unsafe { (HandleOut::new(adjustment)?, model_in(model)?) };
        adjustment.give(ptzcal_adjustment(Exclusive::new(Adjustment::new(model)?)));
        Ok(())
    })
}

/// Frees a survey. What was solved from it lives on.
///
/// @param adjustment The survey; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjustment_free(adjustment: *mut ptzcal_adjustment) {
    // SAFETY: NULL or a live survey that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(adjustment) });
}

/// Says how well each of the rig's parameters is known, independently of the others.
///
/// @param adjustment The survey.
/// @param sigmas     PTZCAL_RIG_PARAMETERS standard deviations in the order of ptzcal_rig_parameter:
///                   0 fixes a parameter, INFINITY frees it.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE for NaN (index: the parameter);
///         PTZCAL_STATUS_INVALID_ARGUMENT (the message names the parameter); PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjustment_set_rig_sigmas(
    adjustment: *mut ptzcal_adjustment,
    sigmas: *const f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjustment, sigmas) = unsafe { (borrow(adjustment)?, prior_numbers(sigmas, RIG_PARAMETERS, "sigmas")?) };
        adjustment.0.write(ptzcal_adjustment::NAME)?.set_rig_prior(Prior::of_sigmas(sigmas))
    })
}

/// Says how well the rig's parameters are known together, as the rig's own calibration left them: the
/// first 7 rows and columns are in the order of ptzcal_laser_line's `covariance`.
///
/// @param adjustment The survey.
/// @param covariance 15 x 15 numbers in the order of ptzcal_rig_parameter, row-major, symmetric:
///                   a variance of 0 fixes a parameter, INFINITY frees it (the rest of its row and
///                   column is 0 then); those of the others are positive definite.
/// @param error      Receives the error; may be NULL.
/// @return As ptzcal_adjustment_set_rig_sigmas.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjustment_set_rig_covariance(
    adjustment: *mut ptzcal_adjustment,
    covariance: *const f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjustment, prior) = unsafe { (borrow(adjustment)?, prior_covariance(covariance, RIG_PARAMETERS)?) };
        adjustment.0.write(ptzcal_adjustment::NAME)?.set_rig_prior(prior)
    })
}

/// Adds a place where the rig stood. Its frame is the rig's at pan = tilt = 0. The world is the
/// frame in which poses are given: usually the first station's, added with a pose as
/// ptzcal_pose_init leaves it. Other stations may be unknown: they are found from cameras that
/// another station's shots calibrate.
///
/// @param adjustment The survey.
/// @param pose       The station in the world, X_world = rotation X_station + translation; its other
///                   members do not matter, so that what ptzcal_pose_estimate_get gave can be handed
///                   over; may be NULL: nothing is known.
/// @param covariance 36 numbers, row-major: of w in R <- exp([w]x) R (axes of the world, radians) and
///                   of the translation (metres), as ptzcal_pose_estimate_copy_covariance gives them;
///                   0 fixes and INFINITY frees as for the rig; may be NULL: the pose is exact. NULL
///                   when the pose is.
/// @param station    Receives the station's index.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT for what is no
///         rotation or no covariance (the message names the parameter); PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjustment_add_station(
    adjustment: *mut ptzcal_adjustment,
    pose: *const ptzcal_pose,
    covariance: *const f64,
    station: *mut u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjustment, pose, prior, station) = unsafe {
            (
                borrow(adjustment)?,
                if pose.is_null() { None } else { Some(pose_in(pose)?) },
                if covariance.is_null() { None } else { Some(prior_covariance(covariance, 6)?) },
                Out::new(station, "station")?,
            )
        };
        let prior = prior.unwrap_or_else(|| if pose.is_some() { Prior::fixed(6) } else { Prior::free(6) });
        let added = adjustment.0.write(ptzcal_adjustment::NAME)?.add_station(Station { pose, prior })?;
        station.write(index(added, "station")?);
        Ok(())
    })
}

impl ptzcal_adjustment {
    fn add(&self, setup: CameraSetup, camera: Out<u32>) -> Result<()> {
        camera.write(index(self.0.write(Self::NAME)?.add_camera(setup)?, "camera")?);
        Ok(())
    }
}

/// Adds a fixed camera of which no more is known than the options say.
///
/// @param adjustment The survey.
/// @param width      Image size in pixels, 1 to 65536.
/// @param height     Image size in pixels, 1 to 65536.
/// @param options    Lens model, known lens, and the priors of skew and aspect are taken from them,
///                   nothing else; may be NULL: the defaults.
/// @param camera     Receives the camera's index.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjustment_add_camera(
    adjustment: *mut ptzcal_adjustment,
    width: u32,
    height: u32,
    options: *const ptzcal_calibration_options,
    camera: *mut u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjustment, options, camera) = unsafe {
            (borrow(adjustment)?, ptzcal_calibration_options::settings(options)?, Out::new(camera, "camera")?)
        };
        let setup = CameraSetup {
            distortion: options.distortion,
            fixed_lens: options.fixed_lens,
            skew_sigma: options.skew_sigma,
            aspect_sigma: options.aspect_sigma,
            ..CameraSetup::new(width, height)
        };
        adjustment.add(setup, camera)
    })
}

/// Adds a fixed camera that was calibrated earlier, in the same world: the calibration with its
/// covariance becomes its prior. The measurements behind it must not be added again. Parameters that
/// were fixed there stay fixed.
///
/// @param adjustment  The survey.
/// @param calibration The calibration.
/// @param camera      Receives the camera's index.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjustment_add_calibrated_camera(
    adjustment: *mut ptzcal_adjustment,
    calibration: *const ptzcal_calibration,
    camera: *mut u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjustment, calibration, camera) =
            unsafe { (borrow(adjustment)?, borrow(calibration)?, Out::new(camera, "camera")?) };
        adjustment.add(CameraSetup::calibrated(&calibration.answer), camera)
    })
}

/// Adds a fixed camera of which some parameters are known, each to a standard deviation.
///
/// @param adjustment The survey.
/// @param known      The camera as it is believed to be.
/// @param sigmas     n standard deviations in the order of ptzcal_calibration_copy_covariance: fx fy
///                   skew cx cy (pixels), the coefficients of the camera's lens model, a turn about
///                   the camera's own axes (3, radians), the centre (3, metres). 0 fixes a parameter,
///                   INFINITY frees it.
/// @param n          11 plus the number of coefficients (0, 1, 4 or 5).
/// @param camera     Receives the camera's index.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE for NaN (index: the parameter);
///         PTZCAL_STATUS_INVALID_ARGUMENT (the message names the parameter); PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjustment_add_known_camera(
    adjustment: *mut ptzcal_adjustment,
    known: *const ptzcal_camera,
    sigmas: *const f64,
    n: usize,
    camera: *mut u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjustment, known, sigmas, camera) = unsafe {
            (borrow(adjustment)?, camera_in(known)?, prior_numbers(sigmas, n, "sigmas")?, Out::new(camera, "camera")?)
        };
        adjustment.add(CameraSetup::known(known, Prior::of_sigmas(sigmas)), camera)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::RigParameter;

    #[test]
    fn the_parameters_are_the_crates() {
        assert_eq!(PTZCAL_RIG_PARAMETERS, RIG_PARAMETERS);
        use ptzcal_rig_parameter::*;
        let pairs = [
            (LaserX0, RigParameter::LaserX0),
            (LaserY0, RigParameter::LaserY0),
            (LaserVx, RigParameter::LaserVx),
            (LaserVy, RigParameter::LaserVy),
            (HeadFocal, RigParameter::HeadFocal),
            (HeadCx, RigParameter::HeadCx),
            (HeadCy, RigParameter::HeadCy),
            (AxisTiltY, RigParameter::TiltAxisY),
            (AxisTiltZ, RigParameter::TiltAxisZ),
            (AxisPanX, RigParameter::PanAxisX),
            (AxisPanZ, RigParameter::PanAxisZ),
            (PanZero, RigParameter::PanZero),
            (PanScale, RigParameter::PanScale),
            (TiltZero, RigParameter::TiltZero),
            (TiltScale, RigParameter::TiltScale),
        ];
        assert_eq!(pairs.len(), RIG_PARAMETERS);
        assert!(pairs.iter().all(|(c, rust)| *c as usize == *rust as usize));
    }
}
