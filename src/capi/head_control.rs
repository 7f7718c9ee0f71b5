//! Driving a head
//!
//! Moves return at once with a number; ptzcal_head_wait waits for their end, and the callback of the
//! options hears of it.

use super::args::{Out, flag, number as finite};
use super::call::{ErrorOut, guard};
use super::error::ptzcal_error;
use super::handle::borrow;
use super::head::ptzcal_head;
use super::status::ptzcal_status;
use crate::device::{Focus, PtzVelocity};
use crate::error::{Error, Result};

/// How a lens is focused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ptzcal_focus {
    /// The camera focuses by itself.
    Auto = 0,
    /// The focus stays where it is.
    Manual = 1,
    /// The focus goes to a place and stays there.
    At = 2,
}

/// Starts a move and returns. ptzcal_head_wait waits for its end, the callback hears of it.
///
/// @param head   The head.
/// @param pan    Reading of the device, radians; positive is right.
/// @param tilt   Reading of the device, radians; positive is up.
/// @param number Receives the move's number; may be NULL.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE outside the head's range; PTZCAL_STATUS_NOT_FINITE;
///         a device's own.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_move(
    head: *const ptzcal_head,
    pan: f64,
    tilt: f64,
    number: *mut u64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (head, number) = unsafe { (borrow(head)?, Out::optional(number, "number")?) };
        started(head.0.move_absolute(pan, tilt)?, number)
    })
}

/// Starts a move from where the head is and returns.
///
/// @param head   The head.
/// @param pan    Radians; positive is right.
/// @param tilt   Radians; positive is up.
/// @param number Receives the move's number; may be NULL.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE outside the head's range; PTZCAL_STATUS_NOT_FINITE;
///         a device's own.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_move_by(
    head: *const ptzcal_head,
    pan: f64,
    tilt: f64,
    number: *mut u64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (head, number) = unsafe { (borrow(head)?, Out::optional(number, "number")?) };
        started(head.0.move_relative(pan, tilt)?, number)
    })
}

/// Starts a move that brings a place of the present picture to its centre, where the device itself can
/// do that (has_view_moves): it needs no known angles and no calibrated lens.
///
/// @param head   The head.
/// @param x      From the picture's centre, 0, to its right edge, 1, or left edge, -1.
/// @param y      From the picture's centre, 0, to its upper edge, 1, or lower edge, -1.
/// @param number Receives the move's number; may be NULL.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT beyond the edges;
///         PTZCAL_STATUS_UNSUPPORTED; a device's own.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_move_in_view(
    head: *const ptzcal_head,
    x: f64,
    y: f64,
    number: *mut u64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (head, number) = unsafe { (borrow(head)?, Out::optional(number, "number")?) };
        started(head.0.move_in_view(x, y)?, number)
    })
}

/// Drives at a speed until told otherwise, and no longer than dead_man seconds after the last call:
/// a host that hangs, or whose operator is gone, lets go. Call it again in time to go on. All speeds 0
/// stop the head.
///
/// @param head       The head.
/// @param pan_speed  Radians per second, positive right; cut to what the device can.
/// @param tilt_speed Radians per second, positive up; cut to what the device can.
/// @param zoom_speed -1 (to wide at full speed) to 1 (to tele).
/// @param dead_man   Seconds, more than 0, at most 60.
/// @param number     Receives the move's number; may be NULL.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT;
///         PTZCAL_STATUS_UNSUPPORTED by a device without continuous drive; a device's own.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_drive(
    head: *const ptzcal_head,
    pan_speed: f64,
    tilt_speed: f64,
    zoom_speed: f64,
    dead_man: f64,
    number: *mut u64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (head, number) = unsafe { (borrow(head)?, Out::optional(number, "number")?) };
        let velocity = PtzVelocity { pan: pan_speed, tilt: tilt_speed, zoom: zoom_speed };
        started(head.0.drive(velocity, finite(dead_man, "dead_man")?)?, number)
    })
}

/// Stops pan, tilt and zoom. It waits neither for an answer of the device nor for another thread's
/// call; where the device cannot be reached beside that call, the stop follows as the call returns.
///
/// @param head  The head.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; a device's own when it could not be told.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_stop(head: *const ptzcal_head, error: *mut *mut ptzcal_error) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let head = unsafe { borrow(head)? };
        head.0.stop()
    })
}

/// Starts the move to the device's home position.
///
/// @param head   The head.
/// @param number Receives the move's number; may be NULL.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNSUPPORTED; a device's own.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_home(
    head: *const ptzcal_head,
    number: *mut u64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (head, number) = unsafe { (borrow(head)?, Out::optional(number, "number")?) };
        started(head.0.home()?, number)
    })
}

/// Starts zooming.
///
/// @param head   The head.
/// @param zoom   0 (wide) to 1 (tele).
/// @param number Receives the move's number; may be NULL.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_UNSUPPORTED; a device's own.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_set_zoom(
    head: *const ptzcal_head,
    zoom: f64,
    number: *mut u64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (head, number) = unsafe { (borrow(head)?, Out::optional(number, "number")?) };
        started(head.0.set_zoom(finite(zoom, "zoom")?)?, number)
    })
}

/// Sets how the lens is focused.
///
/// @param head  The head.
/// @param focus A ptzcal_focus.
/// @param at    0 (far) to 1 (near) for PTZCAL_FOCUS_AT; else it is not used, but finite.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_UNSUPPORTED; a device's own.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_set_focus(
    head: *const ptzcal_head,
    focus: u32,
    at: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let head = unsafe { borrow(head)? };
        let at = finite(at, "at")?;
        head.0.set_focus(match focus {
            f if f == ptzcal_focus::Auto as u32 => Focus::Auto,
            f if f == ptzcal_focus::Manual as u32 => Focus::Manual,
            f if f == ptzcal_focus::At as u32 => Focus::At(at),
            other => return Err(Error::invalid("focus", format!("{other} is no ptzcal_focus"))),
        })
    })
}

/// Reads where the focus is.
///
/// @param head  The head.
/// @param at    Receives 0 (far) to 1 (near).
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNSUPPORTED; a device's own.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_focus(
    head: *const ptzcal_head,
    at: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (head, at) = unsafe { (borrow(head)?, Out::new(at, "at")?) };
        at.write(head.0.focus()?);
        Ok(())
    })
}

/// Holds exposure and white balance as they are, as taking differences of frames wants it, or lets the
/// camera have them again.
///
/// @param head   The head.
/// @param locked 1 or 0.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_UNSUPPORTED; a device's own.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_lock_exposure(
    head: *const ptzcal_head,
    locked: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let head = unsafe { borrow(head)? };
        head.0.lock_exposure(flag(locked, "locked")?)
    })
}

/// Remembers where the head is.
///
/// @param head   The head.
/// @param preset Which, from 0.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_UNSUPPORTED; a device's own.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_store_preset(
    head: *const ptzcal_head,
    preset: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let head = unsafe { borrow(head)? };
        head.0.store_preset(preset)
    })
}

/// Starts the move to what was remembered.
///
/// @param head   The head.
/// @param preset Which, from 0.
/// @param number Receives the move's number; may be NULL.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_UNSUPPORTED; a device's own.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_recall_preset(
    head: *const ptzcal_head,
    preset: u32,
    number: *mut u64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (head, number) = unsafe { (borrow(head)?, Out::optional(number, "number")?) };
        started(head.0.recall_preset(preset)?, number)
    })
}

/// Forgets a preset.
///
/// @param head   The head.
/// @param preset Which, from 0.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_UNSUPPORTED; a device's own.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_clear_preset(
    head: *const ptzcal_head,
    preset: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let head = unsafe { borrow(head)? };
        head.0.clear_preset(preset)
    })
}

/// Tells a move's number to whoever wants it.
fn started(move_number: u64, number: Option<Out<u64>>) -> Result<()> {
    if let Some(number) = number {
        number.write(move_number);
    }
    Ok(())
}
