//! What a head is opened with
//!
//! The head of a camera, to drive it as an operator does: without a rig, a laser, a scan. The options
//! are read when a head is opened.

use super::args::string_optional;
use super::call::{ErrorOut, guard, guard_or};
use super::devices::{HostPtz, ptzcal_ptz};
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, free};
use super::log::{User, log, ptzcal_log_fn};
use super::rig_options::credentials;
use super::status::ptzcal_status;
use crate::control::Log;
use crate::device::Credentials;
use crate::error::Result;
use crate::ptz::{MoveEnd, MoveEvent, OnMoveEnd};
use std::ffi::{c_char, c_void};

/// What a head is opened with.
pub struct ptzcal_head_options(pub(super) Exclusive<Settings>);

#[derive(Default)]
pub(super) struct Settings {
    pub(super) address: Option<String>,
    pub(super) ptz: Option<HostPtz>,
    pub(super) credentials: Option<Credentials>,
    pub(super) log: Log,
    on_end: Option<(unsafe extern "C" fn(*mut c_void, u64, i32, i32, f64, f64), User)>,
}

impl Handle for ptzcal_head_options {
    const NAME: &'static str = "options";
}

impl ptzcal_head_options {
    /// Changes settings.
    ///
    /// # Safety
    /// `options` is NULL or live options.
    unsafe fn change(options: *mut Self, change: impl FnOnce(&mut Settings)) -> Result<()> {
        // SAFETY: by this function's contract.
        change(&mut *unsafe { borrow(options)? }.0.write(Self::NAME)?);
        Ok(())
    }
}

impl Settings {
    /// The host's callback for the ends of moves.
    pub fn on_end(&self) -> Option<OnMoveEnd> {
        let (callback, user) = self.on_end?;
        Some(Box::new(move |event: &MoveEvent| {
            let (end, status) = end_in_c(&event.end);
            let [pan, tilt] = event.position.map_or([f64::NAN; 2], |p| [p.pan, p.tilt]);
            // SAFETY: the header demands that the callback may be called until the head is closed.
            unsafe { callback(user.get(), event.number, end as i32, status as i32, pan, tilt) }
        }))
    }
}

/// How a move ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum ptzcal_move_end {
    /// The head stands where it was sent.
    Arrived = 0,
    /// It stands elsewhere: at a limit, blocked, or the device gave up.
    Missed = 1,
    /// It was stopped.
    Stopped = 2,
    /// A drive was not renewed in time, and was stopped.
    DeadMan = 3,
    /// A later move took its place.
    Replaced = 4,
    /// The device tells neither its position nor whether it moves.
    Unknown = 5,
    /// The device failed; the status says how.
    Failed = 6,
}

/// The end as C knows it, and the status of a failed one.
pub(super) fn end_in_c(end: &MoveEnd) -> (ptzcal_move_end, ptzcal_status) {
    let ok = ptzcal_status::Ok;
    match end {
        MoveEnd::Arrived => (ptzcal_move_end::Arrived, ok),
        MoveEnd::Missed => (ptzcal_move_end::Missed, ok),
        MoveEnd::Stopped => (ptzcal_move_end::Stopped, ok),
        MoveEnd::DeadMan => (ptzcal_move_end::DeadMan, ok),
        MoveEnd::Replaced => (ptzcal_move_end::Replaced, ok),
        MoveEnd::Unknown => (ptzcal_move_end::Unknown, ok),
        MoveEnd::Failed(error) => (ptzcal_move_end::Failed, error.status().into()),
    }
}

/// Hears of the end of a move. It runs on the head's own thread (that of a move which takes another's
/// place: on the caller's), under no lock, and must not throw or longjmp. It may call the head's
/// functions, also ptzcal_head_close.
///
/// @param user   What was given with the callback.
/// @param number The move's number, from the call that started it.
/// @param end    A ptzcal_move_end.
/// @param status PTZCAL_STATUS_OK, or how the device failed.
/// @param pan    Where the head stands, radians; NAN when that is not known.
/// @param tilt   Where the head stands, radians; NAN when that is not known.
pub type ptzcal_move_end_fn =
    Option<unsafe extern "C" fn(user: *mut c_void, number: u64, end: i32, status: i32, pan: f64, tilt: f64)>;

/// Makes options: no device, silent.
///
/// @param options Receives the options; free them with ptzcal_head_options_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_options_new(
    options: *mut *mut ptzcal_head_options,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let options = unsafe { HandleOut::new(options)? };
        options.give(ptzcal_head_options(Exclusive::new(Settings::default())));
        Ok(())
    })
}

/// Frees options. Heads opened with them live on.
///
/// @param options The options; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_options_free(options: *mut ptzcal_head_options) {
    // SAFETY: NULL or live options that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(options) });
}

/// Sets the head's address; a host's head takes its place.
///
/// @param options The options.
/// @param address Such as "visca+udp://camera.lan", "onvif://camera.lan", "sim:room"
///                (docs/addresses.md); may be NULL: none. It may hold no password.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; opening says what is wrong with it.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_options_set_address(
    options: *mut ptzcal_head_options,
    address: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            let address = string_optional(address, "address")?;
            ptzcal_head_options::change(options, |o| o.address = address)
        }
    })
}

/// Sets a head of the host.
///
/// @param options The options.
/// @param ptz     The head; the struct is copied. Its callbacks run on whatever thread calls, and on
///                the head's own, one at a time.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NULL_POINTER for a missing callback.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_options_set_ptz(
    options: *mut ptzcal_head_options,
    ptz: *const ptzcal_ptz,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers and callbacks.
        unsafe {
            let ptz = HostPtz::new(ptz)?;
            ptzcal_head_options::change(options, |o| o.ptz = Some(ptz))
        }
    })
}

/// Sets who opens a device that asks for it (ONVIF).
///
/// @param options  The options.
/// @param user     The user's name; may be NULL: nobody.
/// @param password The password; may be NULL: empty. It is neither logged nor written anywhere.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_options_set_credentials(
    options: *mut ptzcal_head_options,
    user: *const c_char,
    password: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            let credentials = credentials(user, password)?;
            ptzcal_head_options::change(options, |o| o.credentials = credentials)
        }
    })
}

/// Sets where the head's messages go. They come from its own thread too.
///
/// @param options  The options.
/// @param callback Receives messages; may be NULL: none are made (the default).
/// @param user     Handed to the callback.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_options_set_log(
    options: *mut ptzcal_head_options,
    callback: ptzcal_log_fn,
    user: *mut c_void,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            let log = log(callback, user);
            ptzcal_head_options::change(options, |o| o.log = log)
        }
    })
}

/// Sets who hears of the ends of moves.
///
/// @param options  The options.
/// @param callback Hears of each move's end; may be NULL: nobody (the default).
/// @param user     Handed to the callback; it must live until the head is closed.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_options_set_on_move_end(
    options: *mut ptzcal_head_options,
    callback: ptzcal_move_end_fn,
    user: *mut c_void,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let on_end = callback.map(|callback| (callback, User::new(user)));
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { ptzcal_head_options::change(options, |o| o.on_end = on_end) }
    })
}
