//! Heads
//!
//! PTZ control as an operator needs it: drive with a joystick, moves in radians, presets, and a stop
//! that waits for nobody. All functions of a head may be called from several threads at once. From
//! its first move on an open head has one thread of its own: it stops a drive that nobody renews, and
//! watches each move until it ends.

use super::args::{BufferOut, Out, number as finite};
use super::call::{ErrorOut, guard};
use super::cancel::ptzcal_cancel;
use super::devices::ptzcal_motion;
use super::error::ptzcal_error;
use super::handle::{Handle, HandleOut, borrow, take};
use super::head_options::{end_in_c, ptzcal_head_options};
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::error::Error;
use crate::ptz::Head;
use std::ffi::c_char;

/// An open head.
pub struct ptzcal_head(pub(super) Head);

impl Handle for ptzcal_head {
    const NAME: &'static str = "head";
}

/// What a head can do.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_head_capabilities {
    /// Set by ptzcal_head_capabilities_init.
    pub struct_size: u32,
    /// 1: the device's pan and tilt are numbers without a known angle.
    pub raw_units: u32,
    /// Least pan, radians.
    pub pan_min: f64,
    /// Greatest pan, radians.
    pub pan_max: f64,
    /// Least tilt, radians.
    pub tilt_min: f64,
    /// Greatest tilt, radians.
    pub tilt_max: f64,
    /// Size of an encoder step of pan, radians; 0 when unknown.
    pub pan_step: f64,
    /// Size of an encoder step of tilt, radians; 0 when unknown.
    pub tilt_step: f64,
    /// Greatest speed of pan, radians per second; 0 when unknown.
    pub pan_speed: f64,
    /// Greatest speed of tilt, radians per second; 0 when unknown.
    pub tilt_speed: f64,
    /// Number of presets, from 0; 0: none.
    pub presets: u32,
    /// 1: the device says whether it moves.
    pub reports_motion: u32,
    /// 1: positions are read from the head; 0: they are where it was sent.
    pub reports_position: u32,
    /// 1: ptzcal_head_drive works.
    pub has_drive: u32,
    /// 1: relative moves are the device's own; 0: they are made of absolute ones.
    pub has_relative: u32,
    /// 1: ptzcal_head_home works.
    pub has_home: u32,
    /// 1: ptzcal_head_set_zoom works.
    pub has_zoom: u32,
    /// 1: ptzcal_head_set_focus works.
    pub has_focus: u32,
    /// 1: ptzcal_head_lock_exposure works.
    pub has_exposure_lock: u32,
    /// 1: ptzcal_head_move_in_view works.
    pub has_view_moves: u32,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_head_capabilities {
    const NAME: &'static str = "capabilities";
    const FIRST_SIZE: usize = 8 + 8 * 8 + 10 * 4;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            raw_units: 0,
            pan_min: 0.0,
            pan_max: 0.0,
            tilt_min: 0.0,
            tilt_max: 0.0,
            pan_step: 0.0,
            tilt_step: 0.0,
            pan_speed: 0.0,
            tilt_speed: 0.0,
            presets: 0,
            reports_motion: 0,
            reports_position: 0,
            has_drive: 0,
            has_relative: 0,
            has_home: 0,
            has_zoom: 0,
            has_focus: 0,
            has_exposure_lock: 0,
            has_view_moves: 0,
        }
    }
}

/// What a device says of itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ptzcal_identity {
    /// The protocol that it is spoken to with.
    Protocol = 0,
    /// Who made it.
    Vendor = 1,
    /// Its model.
    Model = 2,
    /// Its firmware's version.
    Firmware = 3,
}

/// Sets up capabilities: everything 0.
///
/// @param capabilities The struct.
/// @param size         sizeof *capabilities.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_capabilities_init(
    capabilities: *mut ptzcal_head_capabilities,
    size: usize,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(capabilities, size) })
}

/// Opens a head: takes it over; it does not move.
///
/// @param options What it is opened with.
/// @param head    Receives the head; close it with ptzcal_head_close.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT without a device;
///         PTZCAL_STATUS_INVALID_ADDRESS; PTZCAL_STATUS_UNSUPPORTED for an address of something else;
///         PTZCAL_STATUS_DEVICE_NOT_FOUND, _PERMISSION, _BUSY, _TIMEOUT, _GARBLED, _MISMATCH,
///         PTZCAL_STATUS_UNAUTHORISED: what is wrong, with a hint what to do.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_open(
    options: *const ptzcal_head_options,
    head: *mut *mut ptzcal_head,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, options) = unsafe { (HandleOut::new(head)?, borrow(options)?) };
        let s = options.0.read(ptzcal_head_options::NAME)?;
        out.give(ptzcal_head(Head::new(s.open_head()?, s.log.clone(), s.on_end())));
        Ok(())
    })
}

/// Closes a head: stops it, ends its thread, frees the handle. The handle is gone whatever is
/// returned. From inside its callback the thread ends when the callback returns.
///
/// @param head  The head; may be NULL: nothing happens. No other call may be at work with it.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; the device's own when it could not be stopped.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_close(head: *mut ptzcal_head, error: *mut *mut ptzcal_error) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    // SAFETY: NULL or a live head that nobody uses any more, as the header demands.
    guard(error, || unsafe { take(head) }.map_or(Ok(()), |head| head.0.close()))
}

/// What the head can do.
///
/// @param head         The head.
/// @param capabilities Receives them; set up by ptzcal_head_capabilities_init.
/// @param error        Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_get_capabilities(
    head: *const ptzcal_head,
    capabilities: *mut ptzcal_head_capabilities,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (head, out) = unsafe { (borrow(head)?, SizedOut::new(capabilities)?) };
        let c = head.0.capabilities();
        let [[pan_min, pan_max], [tilt_min, tilt_max], [pan_speed, tilt_speed]] =
            [c.pan_range, c.tilt_range, c.max_speed];
        out.write(&ptzcal_head_capabilities {
            raw_units: c.raw_units.into(),
            pan_min,
            pan_max,
            tilt_min,
            tilt_max,
            pan_step: c.pan_step,
            tilt_step: c.tilt_step,
            pan_speed,
            tilt_speed,
            presets: c.presets,
            reports_motion: c.reports_motion.into(),
            reports_position: c.reports_position.into(),
            has_drive: c.has_drive.into(),
            has_relative: c.has_relative.into(),
            has_home: c.has_home.into(),
            has_zoom: c.has_zoom.into(),
            has_focus: c.has_focus.into(),
            has_exposure_lock: c.has_exposure_lock.into(),
            has_view_moves: c.has_view_moves.into(),
            ..SizedStruct::initial()
        });
        Ok(())
    })
}

/// What the device says of itself, as UTF-8 without a NUL.
///
/// @param head     The head.
/// @param which    A ptzcal_identity.
/// @param buffer   Receives the text; may be NULL when capacity is 0.
/// @param capacity Bytes of the buffer.
/// @param needed   Receives the number of bytes, 0 when the device does not say; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: needed says the size;
///         PTZCAL_STATUS_INVALID_ARGUMENT; a device's own.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_copy_identity(
    head: *const ptzcal_head,
    which: u32,
    buffer: *mut c_char,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (head, out) = unsafe { (borrow(head)?, BufferOut::new(buffer.cast::<u8>(), capacity, needed)?) };
        let pick = match which {
            w if w == ptzcal_identity::Protocol as u32 => |i: crate::device::Identity| i.protocol,
            w if w == ptzcal_identity::Vendor as u32 => |i: crate::device::Identity| i.vendor,
            w if w == ptzcal_identity::Model as u32 => |i: crate::device::Identity| i.model,
            w if w == ptzcal_identity::Firmware as u32 => |i: crate::device::Identity| i.firmware,
            other => return Err(Error::invalid("which", format!("{other} is no ptzcal_identity"))),
        };
        out.write(pick(head.0.identity()?).as_bytes())
    })
}

/// Reads where the head is.
///
/// @param head  The head.
/// @param pan   Receives the reading, radians.
/// @param tilt  Receives the reading, radians.
/// @param zoom  Receives the zoom, 0 (wide) to 1 (tele), 0 without zoom; may be NULL.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; a device's own.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_position(
    head: *const ptzcal_head,
    pan: *mut f64,
    tilt: *mut f64,
    zoom: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (head, pan, tilt, zoom) =
            unsafe { (borrow(head)?, Out::new(pan, "pan")?, Out::new(tilt, "tilt")?, Out::optional(zoom, "zoom")?) };
        let position = head.0.position()?;
        pan.write(position.pan);
        tilt.write(position.tilt);
        if let Some(zoom) = zoom {
            zoom.write(position.zoom);
        }
        Ok(())
    })
}

/// Says whether the head moves.
///
/// @param head   The head.
/// @param motion Receives a ptzcal_motion.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; a device's own.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_motion(
    head: *const ptzcal_head,
    motion: *mut i32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (head, motion) = unsafe { (borrow(head)?, Out::new(motion, "motion")?) };
        motion.write(ptzcal_motion::from(head.0.motion()?) as i32);
        Ok(())
    })
}

/// Waits until a move has ended. The end of a move that is long gone is PTZCAL_MOVE_END_REPLACED.
///
/// @param head        The head.
/// @param move_number The move, from the call that started it.
/// @param timeout     Longest wait, seconds, not negative.
/// @param token       Ends the waiting from another thread, not the move; may be NULL.
/// @param end         Receives a ptzcal_move_end.
/// @param status      Receives PTZCAL_STATUS_OK or how the device failed; may be NULL.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_DEVICE_TIMEOUT: the move goes on; PTZCAL_STATUS_CANCELLED: the same;
///         PTZCAL_STATUS_INVALID_ARGUMENT for a number that no move has.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_wait(
    head: *const ptzcal_head,
    move_number: u64,
    timeout: f64,
    token: *const ptzcal_cancel,
    end: *mut i32,
    status: *mut i32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (head, end, status) = unsafe { (borrow(head)?, Out::new(end, "end")?, Out::optional(status, "status")?) };
        let timeout = finite(timeout, "timeout")?;
        // SAFETY: the caller keeps the header's rules for pointers.
        let token = unsafe { ptzcal_cancel::share(token) };
        let (ended, failure) = end_in_c(&head.0.wait(move_number, timeout, &token)?);
        end.write(ended as i32);
        if let Some(status) = status {
            status.write(failure as i32);
        }
        Ok(())
    })
}
