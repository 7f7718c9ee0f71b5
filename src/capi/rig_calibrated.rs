//! A calibrated rig
//!
//! What became of every zoom position and of every view: nothing that was measured is lost because
//! something else failed. Zoom positions are numbered from 0, ascending; views as they were added.

use std::ffi::{CString, c_char};

use super::args::{ArrayOut, Out};
use super::boards::ptzcal_board_calibration;
use super::call::{ErrorOut, guard, guard_or};
use super::error::{c_string, ptzcal_error};
use super::handle::{Handle, HandleOut, borrow, free};
use super::laser_line::ptzcal_laser_calibration;
use super::rig_model::ptzcal_rig_model;
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use super::zoom_curve::{numbers49, ptzcal_zoom_curve};
use crate::error::{Error, Result};
use crate::rig_calibration::{CommonLine, Fault, RigCalibrated, ViewResult, ZoomCalibration};

/// A calibrated rig. Immutable: any number of threads may read it.
pub struct ptzcal_rig_calibrated {
    answer: RigCalibrated,
    /// Of the views: why one was not used, why its spot was not.
    pub(super) view_reasons: Vec<[CString; 2]>,
    /// Of the positions: why there is no lens, why there is no laser line.
    position_reasons: Vec<[CString; 2]>,
}

impl Handle for ptzcal_rig_calibrated {
    const NAME: &'static str = "calibrated";
}

impl From<RigCalibrated> for ptzcal_rig_calibrated {
    fn from(answer: RigCalibrated) -> Self {
        let fault = |f: &Option<Fault>| c_string(f.as_ref().map_or("", |f| &f.reason));
        let error = |e: Option<&Error>| c_string(&e.map_or(String::new(), Error::to_string));
        let view_reasons = answer.views.iter().map(|v| [fault(&v.fault), fault(&v.spot_fault)]).collect();
        let position_reasons =
            answer.zooms.iter().map(|z| [error(z.boards.as_ref().err()), error(z.laser.as_ref().err())]).collect();
        Self { answer, view_reasons, position_reasons }
    }
}

impl ptzcal_rig_calibrated {
    fn position(&self, index: u32) -> Result<&ZoomCalibration> {
        let all = &self.answer.zooms;
        all.get(index as usize).ok_or_else(|| Error::invalid("index", format!("{index} of {} positions", all.len())))
    }

    pub(super) fn view(&self, view: u32) -> Result<&ViewResult> {
        let all = &self.answer.views;
        all.get(view as usize).ok_or_else(|| Error::invalid("view", format!("{view} of {} views", all.len())))
    }

    /// # Safety
    /// `calibrated` is NULL or a live answer.
    pub(super) unsafe fn text(
        calibrated: *const Self,
        choose: impl FnOnce(&Self) -> Option<&CString>,
    ) -> *const c_char {
        guard_or(c"".as_ptr(), || {
            // SAFETY: by this function's contract.
            let calibrated = unsafe { calibrated.as_ref() };
            calibrated.and_then(choose).map_or(c"", CString::as_c_str).as_ptr()
        })
    }
}

/// What became of a zoom position.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_zoom_position {
    /// Set by ptzcal_zoom_position_init.
    pub struct_size: u32,
    /// A ptzcal_status: PTZCAL_STATUS_OK when lens and poses were found.
    pub status: i32,
    /// A ptzcal_status: PTZCAL_STATUS_OK when the laser's line was found from this position's views.
    pub laser_status: i32,
    /// 1 when there is a rig model: a lens, and a line of its own or from the other positions.
    pub has_model: u32,
    /// Views at this position, and how many of them were used.
    pub views: u32,
    /// Views used for the lens.
    pub views_used: u32,
    /// Spots used.
    pub spots_used: u32,
    /// 0.
    pub reserved: u32,
    /// The device's number of the position.
    pub zoom: f64,
    /// Root mean square length of the used corners' residuals, pixels.
    pub rms: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_zoom_position {
    const NAME: &'static str = "position";
    const FIRST_SIZE: usize = 8 * 4 + 2 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            status: 0,
            laser_status: 0,
            has_model: 0,
            views: 0,
            views_used: 0,
            spots_used: 0,
            reserved: 0,
            zoom: 0.0,
            rms: 0.0,
        }
    }
}

/// The laser's line as all zoom positions see it.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_common_line {
    /// Set by ptzcal_common_line_init.
    pub struct_size: u32,
    /// 1 when the positions' lines are one line (a chance of 1 in 1000 or more); else every position keeps
    /// its own.
    pub agrees: u32,
    /// Zoom positions that saw the spot.
    pub positions: u32,
    /// Degrees of freedom of chi2.
    pub degrees_of_freedom: u32,
    /// In the camera's frame at the first of them. Metres.
    pub x0: f64,
    /// Metres.
    pub y0: f64,
    /// Slope, metres per metre of depth.
    pub vx: f64,
    /// Slope, metres per metre of depth.
    pub vy: f64,
    /// 4 x 4, row-major: of x0, y0, vx, vy.
    pub covariance: [f64; 16],
    /// Disagreement of the positions' own lines.
    pub chi2: f64,
    /// Chance of such a disagreement or a larger one.
    pub probability: f64,
    /// When they do not agree: the position without which the others agree best; NaN when nobody can tell.
    pub odd_zoom: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_common_line {
    const NAME: &'static str = "line";
    const FIRST_SIZE: usize = 4 * 4 + 23 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            agrees: 0,
            positions: 0,
            degrees_of_freedom: 0,
            x0: 0.0,
            y0: 0.0,
            vx: 0.0,
            vy: 0.0,
            covariance: [0.0; 16],
            chi2: 0.0,
            probability: 0.0,
            odd_zoom: 0.0,
        }
    }
}

impl From<&CommonLine> for ptzcal_common_line {
    fn from(c: &CommonLine) -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            agrees: c.agrees.into(),
            positions: c.positions as u32,
            degrees_of_freedom: c.freedom as u32,
            x0: c.line.x0,
            y0: c.line.y0,
            vx: c.line.vx,
            vy: c.line.vy,
            covariance: std::array::from_fn(|i| c.covariance[(i / 4, i % 4)]),
            chi2: c.chi2,
            probability: c.probability,
            odd_zoom: c.odd.unwrap_or(f64::NAN),
        }
    }
}

fn status(result: Option<&Error>) -> i32 {
    result.map_or(0, |e| e.status() as i32)
}

/// Frees a calibrated rig.
///
/// @param calibrated The calibrated rig; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibrated_free(calibrated: *mut ptzcal_rig_calibrated) {
    // SAFETY: NULL or a live answer that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(calibrated) });
}

/// How many zoom positions and views there are.
///
/// @param calibrated The calibrated rig.
/// @param positions  Receives the number of zoom positions.
/// @param views      Receives the number of views.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibrated_count(
    calibrated: *const ptzcal_rig_calibrated,
    positions: *mut u32,
    views: *mut u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibrated, positions, views) =
            unsafe { (borrow(calibrated)?, Out::new(positions, "positions")?, Out::new(views, "views")?) };
        positions.write(calibrated.answer.zooms.len() as u32);
        views.write(calibrated.answer.views.len() as u32);
        Ok(())
    })
}

/// Sets up a zoom position: everything 0.
///
/// @param position The struct.
/// @param size     sizeof *position.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_zoom_position_init(position: *mut ptzcal_zoom_position, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(position, size) })
}

/// What became of a zoom position.
///
/// @param calibrated The calibrated rig.
/// @param index      The zoom position.
/// @param position   Receives it; set up by ptzcal_zoom_position_init.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (no such number).
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibrated_get_position(
    calibrated: *const ptzcal_rig_calibrated,
    index: u32,
    position: *mut ptzcal_zoom_position,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibrated, out) = unsafe { (borrow(calibrated)?, SizedOut::new(position)?) };
        let zoom = calibrated.position(index)?;
        let count = |used: &dyn Fn(&ViewResult) -> bool| {
            zoom.views.iter().filter(|v| calibrated.answer.views.get(**v).is_some_and(used)).count() as u32
        };
        out.write(&ptzcal_zoom_position {
            status: status(zoom.boards.as_ref().err()),
            laser_status: status(zoom.laser.as_ref().err()),
            has_model: zoom.node.is_some().into(),
            views: zoom.views.len() as u32,
            views_used: count(&|v| v.fault.is_none()),
            spots_used: count(&|v| v.spot_used),
            zoom: zoom.zoom,
            rms: zoom.boards.as_ref().map_or(0.0, |b| b.calibration.rms),
            ..ptzcal_zoom_position::initial()
        });
        Ok(())
    })
}

/// Why there is no lens at a zoom position, one line of English UTF-8. The wording may change in any version; decide by the status.
///
/// @param calibrated The calibrated rig; may be NULL.
/// @param index      The zoom position.
/// @return A string that lives as long as the calibrated rig; "" when there is no reason, no such number and
///         for NULL; never NULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibrated_position_reason(
    calibrated: *const ptzcal_rig_calibrated,
    index: u32,
) -> *const c_char {
    // SAFETY: NULL or a live answer, as the header demands.
    unsafe { ptzcal_rig_calibrated::text(calibrated, |c| c.position_reasons.get(index as usize).map(|r| &r[0])) }
}

/// Why a zoom position has no laser line of its own, one line of English UTF-8. The wording may change in any version; decide by the status.
///
/// @param calibrated The calibrated rig; may be NULL.
/// @param index      The zoom position.
/// @return A string that lives as long as the calibrated rig; "" when there is no reason, no such number and
///         for NULL; never NULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibrated_laser_reason(
    calibrated: *const ptzcal_rig_calibrated,
    index: u32,
) -> *const c_char {
    // SAFETY: NULL or a live answer, as the header demands.
    unsafe { ptzcal_rig_calibrated::text(calibrated, |c| c.position_reasons.get(index as usize).map(|r| &r[1])) }
}

/// The rig at a zoom position; axes through the camera's centre, true encoders. Its laser line is the one
/// that all positions share, if they do.
///
/// @param calibrated The calibrated rig.
/// @param index      The zoom position.
/// @param model      Receives the rig model; set up by ptzcal_rig_model_init.
/// @param covariance Receives 49 numbers, 7 x 7: as in ptzcal_laser_line; may be NULL.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (no such number); why there is no lens, or no laser line.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibrated_get_rig_model(
    calibrated: *const ptzcal_rig_calibrated,
    index: u32,
    model: *mut ptzcal_rig_model,
    covariance: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibrated, model, covariance) = unsafe {
            (borrow(calibrated)?, SizedOut::new(model)?, ArrayOut::vectors_optional::<49>(covariance, 1, "covariance")?)
        };
        let (rig, c) = calibrated.answer.rig_model(index as usize)?;
        model.write(&(&rig).into());
        if let Some(covariance) = covariance {
            covariance.write(&[numbers49(&c)]);
        }
        Ok(())
    })
}

/// Lens and poses of a zoom position, from its own views alone.
///
/// @param calibrated The calibrated rig.
/// @param index      The zoom position.
/// @param boards     Receives a calibration of its own; free it with ptzcal_board_calibration_free.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (no such number); why there is none.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibrated_copy_boards(
    calibrated: *const ptzcal_rig_calibrated,
    index: u32,
    boards: *mut *mut ptzcal_board_calibration,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, calibrated) = unsafe { (HandleOut::new(boards)?, borrow(calibrated)?) };
        out.give(calibrated.position(index)?.boards.clone()?.into());
        Ok(())
    })
}

/// Lens, poses and laser line of a zoom position, from its own views alone.
///
/// @param calibrated The calibrated rig.
/// @param index      The zoom position.
/// @param laser      Receives a calibration of its own; free it with ptzcal_laser_calibration_free.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (no such number); why there is none.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibrated_copy_laser(
    calibrated: *const ptzcal_rig_calibrated,
    index: u32,
    laser: *mut *mut ptzcal_laser_calibration,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, calibrated) = unsafe { (HandleOut::new(laser)?, borrow(calibrated)?) };
        out.give(calibrated.position(index)?.laser.clone()?.into());
        Ok(())
    })
}

/// Sets up a line: everything 0.
///
/// @param line The struct.
/// @param size sizeof *line.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_common_line_init(line: *mut ptzcal_common_line, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(line, size) })
}

/// The laser's line as all zoom positions see it, and whether they agree.
///
/// @param calibrated The calibrated rig.
/// @param line       Receives the line; set up by ptzcal_common_line_init.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND (fewer than two zoom positions saw the spot).
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibrated_get_common_line(
    calibrated: *const ptzcal_rig_calibrated,
    line: *mut ptzcal_common_line,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibrated, out) = unsafe { (borrow(calibrated)?, SizedOut::new(line)?) };
        let missing = "fewer than two zoom positions saw the spot, or none was to be shared";
        let common = calibrated.answer.common.as_ref();
        out.write(&common.ok_or_else(|| Error::NotFound { reason: missing.into() })?.into());
        Ok(())
    })
}

/// The rig over zoom, from all positions that have a rig model.
///
/// @param calibrated The calibrated rig.
/// @param curve      Receives a curve of its own; free it with ptzcal_zoom_curve_free.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS (no position has a rig model);
///         PTZCAL_STATUS_INVALID_ARGUMENT (the focal length does not grow or fall from position to position:
///         the message names two).
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibrated_get_curve(
    calibrated: *const ptzcal_rig_calibrated,
    curve: *mut *mut ptzcal_zoom_curve,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, calibrated) = unsafe { (HandleOut::new(curve)?, borrow(calibrated)?) };
        out.give(ptzcal_zoom_curve(calibrated.answer.curve()?));
        Ok(())
    })
}
