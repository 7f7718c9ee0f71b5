//! Joint adjustment: solving
//!
//! The maximum-likelihood estimate of everything that is free, from a cold start, by
//! ptzcal_adjustment_solve. Gross outliers are set aside, and the residuals and every fixed group of
//! parameters are tested: the answer's warnings say whether model and stated noise can be believed.

use super::adjusted::ptzcal_adjusted;
use super::adjustment::ptzcal_adjustment;
use super::args::flag;
use super::call::{ErrorOut, guard};
use super::cancel::ptzcal_cancel;
use super::error::ptzcal_error;
use super::handle::{Handle, HandleOut, borrow};
use super::sized::{self, SizedStruct};
use super::status::ptzcal_status;
use crate::adjust::{AdjustOptions, adjust};
use crate::error::{Error, Result};

/// How a survey is solved. The defaults are right for spots that the library detected.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_adjust_options {
    /// Set by ptzcal_adjust_options_init.
    pub struct_size: u32,
    /// 1 (the default): gross outliers are found and set aside. 0: all spots are used.
    pub robust: u32,
    /// Most iterations of one refinement, 1 to 10000; the default is 100.
    pub max_iterations: u32,
    /// 0.
    pub reserved: u32,
    /// Seed of the consensus that starts each camera; the default is 1.
    pub seed: u64,
    /// Standard deviation of the head's true pan about its readings, from shot to shot
    /// (repeatability and quantisation), radians; the default is 0: the encoders are exact.
    pub pointing_sigma_pan: f64,
    /// The same of tilt.
    pub pointing_sigma_tilt: f64,
    /// Residuals of more standard deviations than this count linearly (Huber 1964), positive; the
    /// default is 3; INFINITY: least squares.
    pub huber: f64,
    /// Largest standard deviation over focal length of a camera, positive: above it the answer is
    /// refused (PTZCAL_STATUS_DEGENERATE); the default is 0.1; INFINITY takes whatever was found.
    pub max_focal_deviation: f64,
    /// Refuse (PTZCAL_STATUS_DEGENERATE, with the direction) when a station that is not fixed is
    /// determined worse than this: its rotation in radians, its position as a share of the median range
    /// of its shots; positive; the default is 0.1; INFINITY takes whatever was found.
    pub max_station_deviation: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_adjust_options {
    const NAME: &'static str = "options";
    const FIRST_SIZE: usize = 16 + 6 * 8;
    fn initial() -> Self {
        let o = AdjustOptions::default();
        Self {
            struct_size: size_of::<Self>() as u32,
            robust: u32::from(o.robust),
            max_iterations: o.max_iterations as u32,
            reserved: 0,
            seed: o.seed,
            pointing_sigma_pan: o.pointing_sigma[0],
            pointing_sigma_tilt: o.pointing_sigma[1],
            huber: o.huber,
            max_focal_deviation: o.max_focal_deviation,
            max_station_deviation: o.max_station_deviation,
        }
    }
}

impl TryFrom<ptzcal_adjust_options> for AdjustOptions {
    type Error = Error;

    fn try_from(o: ptzcal_adjust_options) -> Result<Self> {
        let robust = flag(o.robust, "robust")?;
        if !(1..=10_000).contains(&o.max_iterations) {
            return Err(Error::invalid("max_iterations", format!("{} is not in 1 to 10000", o.max_iterations)));
        }
        if o.max_focal_deviation.is_nan() || o.max_focal_deviation <= 0.0 {
            return Err(Error::invalid("max_focal_deviation", format!("{} is not positive", o.max_focal_deviation)));
        }
        Ok(Self {
            pointing_sigma: [o.pointing_sigma_pan, o.pointing_sigma_tilt],
            robust,
            huber: o.huber,
            max_focal_deviation: o.max_focal_deviation,
            max_station_deviation: o.max_station_deviation,
            seed: o.seed,
            max_iterations: o.max_iterations as usize,
            ..Self::default()
        })
    }
}

/// Sets up options with their defaults.
///
/// @param options The struct.
/// @param size    sizeof *options.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjust_options_init(options: *mut ptzcal_adjust_options, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(options, size) })
}

/// Solves a survey. It is in use until the call returns: other threads may solve it too, but adding
/// to it is PTZCAL_STATUS_BUSY. The same survey, options and seed give the same bits.
///
/// @param adjustment The survey.
/// @param options    The options, set up by ptzcal_adjust_options_init; may be NULL: the defaults.
/// @param cancel     Ends the call early from another thread; may be NULL.
/// @param result     Receives the answer; free it with ptzcal_adjusted_free.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS and other reasons of
///         ptzcal_calibrate_camera (index: the camera that cannot be calibrated);
///         PTZCAL_STATUS_DEGENERATE (the message names what trades off and what to add);
///         PTZCAL_STATUS_BAD_STATE when nothing is free, or for an unknown station that shares no
///         camera and no three planes with the others; PTZCAL_STATUS_BEHIND_CAMERA (index: the shot)
///         when robust is 0;
///         PTZCAL_STATUS_NO_CONSENSUS; PTZCAL_STATUS_NO_CONVERGENCE; PTZCAL_STATUS_LENS_NOT_MONOTONE;
///         PTZCAL_STATUS_CANCELLED; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjustment_solve(
    adjustment: *const ptzcal_adjustment,
    options: *const ptzcal_adjust_options,
    cancel: *const ptzcal_cancel,
    result: *mut *mut ptzcal_adjusted,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (result, adjustment, options, cancel) = unsafe {
            let options = if options.is_null() { None } else { Some(sized::read(options)?) };
            (HandleOut::new(result)?, borrow(adjustment)?, options, ptzcal_cancel::share(cancel))
        };
        let options = options.map_or_else(|| Ok(AdjustOptions::default()), AdjustOptions::try_from)?;
        let input = adjustment.0.read(ptzcal_adjustment::NAME)?;
        result.give(ptzcal_adjusted::new(adjust(&input, &AdjustOptions { cancel, ..options })?));
        Ok(())
    })
}
