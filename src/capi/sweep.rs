//! Pointing: depth unknown
//!
//! Where the head would have to look along the ray of a fixed camera's pixel whose depth is unknown: the
//! curve of pan and tilt, a zoom that shows all of it, or the steps that sweep it.

use super::args::{BufferOut, number, vectors, vectors_optional};
use super::call::{ErrorOut, guard, guard_or};
use super::error::ptzcal_error;
use super::handle::{Handle, HandleOut, borrow, free};
use super::locating::{click, not_nan};
use super::pointing::ptzcal_pointing;
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::pointing::{AimOptions, Sweep};

/// Where the target of a pixel may be. Immutable: any number of threads may read it.
pub struct ptzcal_sweep(Sweep);

impl Handle for ptzcal_sweep {
    const NAME: &'static str = "sweep";
}

/// What a sweep comes to.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_sweep_summary {
    /// Set by ptzcal_sweep_summary_init.
    pub struct_size: u32,
    /// Pictures that together show the whole curve; 1: one does.
    pub steps: u32,
    /// Points of the curve.
    pub points: u32,
    /// 1 when there is a zoom curve, and `zoom` is set.
    pub has_zoom: u32,
    /// Least reading of pan on the curve, radians.
    pub pan_min: f64,
    /// Greatest reading of pan, radians.
    pub pan_max: f64,
    /// Least reading of tilt, radians.
    pub tilt_min: f64,
    /// Greatest reading of tilt, radians.
    pub tilt_max: f64,
    /// The middle of the range, radians.
    pub middle_pan: f64,
    /// The middle of the range, radians.
    pub middle_tilt: f64,
    /// The tightest zoom of one picture, the widest of several.
    pub zoom: f64,
    /// Of the whole target being in one of the pictures, at the worst distance.
    pub probability: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_sweep_summary {
    const NAME: &'static str = "summary";
    const FIRST_SIZE: usize = 16 + 8 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            steps: 0,
            points: 0,
            has_zoom: 0,
            pan_min: 0.0,
            pan_max: 0.0,
            tilt_min: 0.0,
            tilt_max: 0.0,
            middle_pan: 0.0,
            middle_tilt: 0.0,
            zoom: 0.0,
            probability: 0.0,
        }
    }
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
pub unsafe extern "C" fn ptzcal_sweep_summary_init(summary: *mut ptzcal_sweep_summary, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(summary, size) })
}

/// What to do about a pixel of the fixed camera whose depth is unknown, but for its nearest and farthest
/// distance from that camera.
///
/// @param pointing      The pointing.
/// @param uv            2 numbers: a pixel of the fixed camera.
/// @param uv_covariance 3 numbers: xx, xy, yy, px^2, positive semi-definite; may be NULL: the pixel is
///                      exact.
/// @param nearest       Metres, positive.
/// @param farthest      Metres; INFINITY is far enough.
/// @param probability   With which the whole target is to be in the picture, between 0 and 1.
/// @param target_size   Diameter of the target, metres; 0 for a point.
/// @param sweep         Receives the sweep; free it with ptzcal_sweep_free.
/// @param error         Receives the error; may be NULL.
/// @return As ptzcal_pointing_aim, but for what concerns the depth; PTZCAL_STATUS_INVALID_ARGUMENT
///         for a range that is none.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pointing_sweep(
    pointing: *const ptzcal_pointing,
    uv: *const f64,
    uv_covariance: *const f64,
    nearest: f64,
    farthest: f64,
    probability: f64,
    target_size: f64,
    sweep: *mut *mut ptzcal_sweep,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        number(nearest, "nearest")?;
        not_nan(farthest, "farthest")?;
        number(probability, "probability")?;
        number(target_size, "target_size")?;
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, pointing, uv, c) = unsafe {
            (
                HandleOut::new(sweep)?,
                borrow(pointing)?,
                vectors::<2>(uv, 1, "uv")?,
                vectors_optional::<3>(uv_covariance, 1, "uv_covariance")?,
            )
        };
        let state = pointing.0.read(ptzcal_pointing::NAME)?;
        let options = AimOptions { probability, target_size };
        out.give(ptzcal_sweep(state.pointer.sweep(&click(uv, c), [nearest, farthest], &options)?));
        Ok(())
    })
}

/// Frees a sweep.
///
/// @param sweep The sweep; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_sweep_free(sweep: *mut ptzcal_sweep) {
    // SAFETY: NULL or a live handle that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(sweep) });
}

/// What a sweep comes to.
///
/// @param sweep   The sweep.
/// @param summary Receives the summary; set up by ptzcal_sweep_summary_init.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_sweep_get_summary(
    sweep: *const ptzcal_sweep,
    summary: *mut ptzcal_sweep_summary,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (sweep, summary) = unsafe { (borrow(sweep)?, SizedOut::new(summary)?) };
        let sweep = &sweep.0;
        summary.write(&ptzcal_sweep_summary {
            steps: sweep.steps.len() as u32,
            points: sweep.curve.len() as u32,
            has_zoom: u32::from(sweep.zoom.is_some()),
            pan_min: sweep.pan[0],
            pan_max: sweep.pan[1],
            tilt_min: sweep.tilt[0],
            tilt_max: sweep.tilt[1],
            middle_pan: sweep.middle[0],
            middle_tilt: sweep.middle[1],
            zoom: sweep.zoom.unwrap_or(0.0),
            probability: sweep.probability,
            ..SizedStruct::initial()
        });
        Ok(())
    })
}

/// The pictures that together show the whole curve, nearest first.
///
/// @param sweep    The sweep.
/// @param buffer   Receives pan and tilt of each, radians; may be NULL when capacity is 0.
/// @param capacity Numbers that fit.
/// @param needed   Receives how many numbers there are; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_sweep_copy_steps(
    sweep: *const ptzcal_sweep,
    buffer: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (sweep, buffer) = unsafe { (borrow(sweep)?, BufferOut::new(buffer, capacity, needed)?) };
        buffer.write(&sweep.0.steps.concat())
    })
}

/// Pan and tilt over the distance, nearest first.
///
/// @param sweep    The sweep.
/// @param buffer   Receives 6 numbers a point: distance from the fixed camera (metres), pan, tilt
///                 (radians), and the covariance of the target's direction about them: pan pan, pan
///                 tilt, tilt tilt (rad^2); may be NULL when capacity is 0.
/// @param capacity Numbers that fit.
/// @param needed   Receives how many numbers there are; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_sweep_copy_curve(
    sweep: *const ptzcal_sweep,
    buffer: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (sweep, buffer) = unsafe { (borrow(sweep)?, BufferOut::new(buffer, capacity, needed)?) };
        let point =
            |p: &crate::pointing::SweepPoint| [p.distance, p.pan, p.tilt, p.angles.m11, p.angles.m12, p.angles.m22];
        let numbers: Vec<f64> = sweep.0.curve.iter().flat_map(point).collect();
        buffer.write(&numbers)
    })
}
