//! Views of a calibrated rig
//!
//! What became of each picture: its corners, their residuals, the board's pose, the spot, and the
//! reason where something was not used.

use std::ffi::c_char;

use super::args::{ArrayOut, Out};
use super::call::{ErrorOut, guard};
use super::error::ptzcal_error;
use super::handle::borrow;
use super::rig_calibrated::ptzcal_rig_calibrated;
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::error::Error;
use crate::rig_calibration::{Fault, ViewResult};

/// What became of a view.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_rig_view {
    /// Set by ptzcal_rig_view_init.
    pub struct_size: u32,
    /// A ptzcal_status: PTZCAL_STATUS_OK when the view was used; ptzcal_rig_calibrated_view_reason says why not.
    pub status: i32,
    /// A ptzcal_status: PTZCAL_STATUS_OK when its spot was used, or there is no picture with the laser on.
    pub spot_status: i32,
    /// 1 when a spot was seen.
    pub has_spot: u32,
    /// 1 when the board's pose is known.
    pub has_pose: u32,
    /// 0.
    pub reserved: u32,
    /// Corners found.
    pub corners: u64,
    /// Corners used.
    pub inliers: u64,
    /// The device's number of the zoom position.
    pub zoom: f64,
    /// Root mean square length of the used corners' residuals, pixels.
    pub rms: f64,
    /// The spot's pixel.
    pub spot: [f64; 2],
    /// Measured minus predicted, pixels; 0 where none is predicted.
    pub spot_residual: [f64; 2],
    /// R, row-major: board axes to camera axes. The board's plane is R's third column through t.
    pub rotation: [f64; 9],
    /// t: the middle of the board's corners in the camera frame, metres.
    pub translation: [f64; 3],
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_rig_view {
    const NAME: &'static str = "rig_view";
    const FIRST_SIZE: usize = 6 * 4 + 20 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            status: 0,
            spot_status: 0,
            has_spot: 0,
            has_pose: 0,
            reserved: 0,
            corners: 0,
            inliers: 0,
            zoom: 0.0,
            rms: 0.0,
            spot: [0.0; 2],
            spot_residual: [0.0; 2],
            rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            translation: [0.0; 3],
        }
    }
}

impl From<&ViewResult> for ptzcal_rig_view {
    fn from(v: &ViewResult) -> Self {
        let status = |f: &Option<Fault>| f.as_ref().map_or(0, |f| f.status as i32);
        let mut view = Self {
            status: status(&v.fault),
            spot_status: status(&v.spot_fault),
            has_spot: v.spot.is_some().into(),
            has_pose: v.pose.is_some().into(),
            corners: v.corners.len() as u64,
            inliers: v.inliers.iter().filter(|i| **i).count() as u64,
            zoom: v.zoom,
            spot: v.spot.map_or([0.0; 2], |s| s.pixel.into()),
            spot_residual: v.spot_residual.map_or([0.0; 2], Into::into),
            ..Self::initial()
        };
        if let Some(pose) = &v.pose {
            let r = pose.pose.rotation.transpose();
            view.rms = pose.rms;
            view.rotation.copy_from_slice(r.as_slice());
            view.translation = pose.pose.translation.into();
        }
        view
    }
}

/// Sets up a view: no turn, everything else 0.
///
/// @param rig_view The struct.
/// @param size     sizeof *rig_view.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_view_init(rig_view: *mut ptzcal_rig_view, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(rig_view, size) })
}

/// What became of a view.
///
/// @param calibrated The calibrated rig.
/// @param view       The view.
/// @param rig_view   Receives it; set up by ptzcal_rig_view_init.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (no such number).
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibrated_get_view(
    calibrated: *const ptzcal_rig_calibrated,
    view: u32,
    rig_view: *mut ptzcal_rig_view,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibrated, out) = unsafe { (borrow(calibrated)?, SizedOut::new(rig_view)?) };
        out.write(&calibrated.view(view)?.into());
        Ok(())
    })
}

/// Why a view was not used, one line of English UTF-8. The wording may change in any version; decide by the status.
///
/// @param calibrated The calibrated rig; may be NULL.
/// @param view       The view.
/// @return A string that lives as long as the calibrated rig; "" when there is no reason, no such number and
///         for NULL; never NULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibrated_view_reason(
    calibrated: *const ptzcal_rig_calibrated,
    view: u32,
) -> *const c_char {
    // SAFETY: NULL or a live answer, as the header demands.
    unsafe { ptzcal_rig_calibrated::text(calibrated, |c| c.view_reasons.get(view as usize).map(|r| &r[0])) }
}

/// Why a view's spot was not used, one line of English UTF-8. The wording may change in any version; decide by the status.
///
/// @param calibrated The calibrated rig; may be NULL.
/// @param view       The view.
/// @return A string that lives as long as the calibrated rig; "" when there is no reason, no such number and
///         for NULL; never NULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibrated_spot_reason(
    calibrated: *const ptzcal_rig_calibrated,
    view: u32,
) -> *const c_char {
    // SAFETY: NULL or a live answer, as the header demands.
    unsafe { ptzcal_rig_calibrated::text(calibrated, |c| c.view_reasons.get(view as usize).map(|r| &r[1])) }
}

/// The corners of a view, for tables and pictures.
///
/// @param calibrated The calibrated rig.
/// @param view       The view.
/// @param board_xy   Receives n x 2 numbers: places on the board, metres; may be NULL.
/// @param uv         Receives n x 2 numbers: their pixels; may be NULL.
/// @param residuals  Receives n x 2 numbers: measured minus predicted, px; infinite where none is predicted; may be NULL.
/// @param inliers    Receives n numbers: 1 for a corner that was used; may be NULL.
/// @param capacity   How many corners each array holds.
/// @param needed     Receives n, also when it is more than the capacity; may be NULL.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (no such view); PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibrated_copy_corners(
    calibrated: *const ptzcal_rig_calibrated,
    view: u32,
    board_xy: *mut f64,
    uv: *mut f64,
    residuals: *mut f64,
    inliers: *mut u8,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibrated, board_xy, uv, residuals, inliers, needed) = unsafe {
            (
                borrow(calibrated)?,
                ArrayOut::vectors_optional::<2>(board_xy, capacity, "board_xy")?,
                ArrayOut::vectors_optional::<2>(uv, capacity, "uv")?,
                ArrayOut::vectors_optional::<2>(residuals, capacity, "residuals")?,
                if inliers.is_null() { None } else { Some(ArrayOut::new(inliers, capacity, "inliers")?) },
                if needed.is_null() { None } else { Some(Out::new(needed, "needed")?) },
            )
        };
        let view = calibrated.view(view)?;
        let count = view.corners.len();
        if let Some(needed) = needed {
            needed.write(count);
        }
        if count > capacity {
            return Err(Error::BufferTooSmall { needed: count, capacity });
        }
        let none = [f64::INFINITY; 2];
        let rows: [(_, Vec<[f64; 2]>); 3] = [
            (board_xy, view.corners.iter().map(|c| c.board.into()).collect()),
            (uv, view.corners.iter().map(|c| c.pixel.into()).collect()),
            (residuals, (0..count).map(|i| view.residuals.get(i).map_or(none, |r| (*r).into())).collect()),
        ];
        for (out, values) in rows {
            if let Some(out) = out {
                out.write(&values);
            }
        }
        if let Some(inliers) = inliers {
            inliers.write(&view.inliers.iter().map(|i| u8::from(*i)).collect::<Vec<_>>());
        }
        Ok(())
    })
}
