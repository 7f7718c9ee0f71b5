//! What a head is opened with
//!
//! The head of a camera, to drive it as an operator does: without a rig, a laser, a scan. The options
//! are read when a head is opened.

use super::angle_map::{map_of, mapped, ptzcal_angle_map};
use super::args::string_optional;
use super::call::{ErrorOut, guard, guard_or};
use super::devices::{HostFrames, HostLaser, HostPtz, ptzcal_frame_fn, ptzcal_laser_fn, ptzcal_ptz};
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, free};
use super::log::{User, log, ptzcal_log_fn};
use super::rig_options::credentials;
use super::status::ptzcal_status;
use crate::control::{Clock, Log, SystemClock};
use crate::device::{
    Address, Credentials, FrameSource, Laser, PanTiltZoom, Surroundings, open_frames, open_laser, open_ptz,
};
use crate::error::{Error, Result};
use crate::geometry::AngleMap;
use crate::ptz::{MoveEnd, MoveEvent, OnMoveEnd};
use crate::rig::WholeRig;
use std::ffi::{c_char, c_void};
use std::sync::Arc;

/// What a head is opened with.
pub struct ptzcal_head_options(pub(super) Exclusive<Settings>);

#[derive(Default)]
pub(super) struct Settings {
    address: Option<String>,
    ptz: Option<HostPtz>,
    frames_address: Option<String>,
    frames: Option<HostFrames>,
    laser_address: Option<String>,
    laser: Option<HostLaser>,
    angle_map: Option<AngleMap>,
    credentials: Option<Credentials>,
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

/// The devices of options.
pub(super) struct Opened {
    pub(super) ptz: Box<dyn PanTiltZoom>,
    /// Where there are any.
    pub(super) frames: Option<Box<dyn FrameSource>>,
    pub(super) clock: Arc<dyn Clock>,
    whole: Option<WholeRig>,
    around: Surroundings,
}

impl Settings {
    /// The head alone.
    pub fn open_head(&self) -> Result<Box<dyn PanTiltZoom>> {
        self.ptz_of(self.whole()?.as_ref(), &self.around(None))
    }

    /// The head, and the frames where they are set.
    pub fn open(&self) -> Result<Opened> {
        let whole = self.whole()?;
        let around = self.around(whole.as_ref());
        let ptz = self.ptz_of(whole.as_ref(), &around)?;
        let frames: Option<Box<dyn FrameSource>> = match (&self.frames, &self.frames_address, &whole) {
            (Some(frames), _, _) => Some(Box::new(frames.clone())),
            (None, Some(address), _) => Some(open_frames(&Address::parse(address)?, &around)?),
            (None, None, Some(whole)) => Some(whole.frames()?),
            (None, None, None) => None,
        };
        Ok(Opened { ptz, frames, clock: around.clock.clone(), whole, around })
    }

    fn whole(&self) -> Result<Option<WholeRig>> {
        let is_whole = |address: &&str| ["sim:", "folder:"].iter().any(|scheme| address.starts_with(scheme));
        self.address.as_deref().filter(is_whole).map(WholeRig::open_to_drive).transpose()
    }

    fn around(&self, whole: Option<&WholeRig>) -> Surroundings {
        let clock = whole.map_or_else(|| Arc::new(SystemClock::default()) as Arc<dyn Clock>, WholeRig::clock);
        Surroundings { clock, log: self.log.clone(), credentials: self.credentials.clone() }
    }

    fn ptz_of(&self, whole: Option<&WholeRig>, around: &Surroundings) -> Result<Box<dyn PanTiltZoom>> {
        let ptz = match (&self.ptz, whole, self.address.as_deref()) {
            (Some(ptz), _, _) => Box::new(ptz.clone()),
            (None, Some(whole), _) => whole.ptz(self.log.clone())?,
            (None, None, Some(address)) => open_ptz(&Address::parse(address)?, around)?,
            (None, None, None) => return Err(Error::invalid("options", "no head: set an address or the callbacks")),
        };
        mapped(ptz, self.angle_map.as_ref())
    }

    /// The laser, where one is set.
    pub fn open_laser(&self, opened: &Opened) -> Result<Option<Box<dyn Laser>>> {
        Ok(match (&self.laser, &self.laser_address, &opened.whole) {
            (Some(laser), _, _) => Some(Box::new(laser.clone())),
            (None, Some(address), _) => Some(open_laser(&Address::parse(address)?, &opened.around)?),
            (None, None, Some(whole)) => Some(whole.laser()),
            (None, None, None) => None,
        })
    }

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

/// Sets where frames of the camera on the head come from, for ptzcal_probe and ptzcal_learn_angles; a
/// host's frames take their place. A simulator and a recording bring their own.
///
/// @param options The options.
/// @param address Such as "v4l2:///dev/video0", "onvif://camera.lan"; may be NULL: none. It may hold no
///                password.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; what opens it says what is wrong with it.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_options_set_frames_address(
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
            ptzcal_head_options::change(options, |o| o.frames_address = address)
        }
    })
}

/// Sets the laser of the head, for ptzcal_probe; a host's takes its place. A simulator brings its own.
///
/// @param options The options.
/// @param address Such as "gpio:///dev/gpiochip0/laser"; may be NULL: none. It may hold no
///                password.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; what opens it says what is wrong with it.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_options_set_laser_address(
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
            ptzcal_head_options::change(options, |o| o.laser_address = address)
        }
    })
}

/// Sets where the host's frames of the camera on the head come from.
///
/// @param options    The options.
/// @param next_frame Hands over a frame; timestamps are NAN, or seconds of no clock that the library knows.
/// @param user       Handed to the callback.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NULL_POINTER.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_options_set_frames(
    options: *mut ptzcal_head_options,
    next_frame: ptzcal_frame_fn,
    user: *mut c_void,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers and callbacks.
        unsafe {
            let frames = HostFrames::new(next_frame, user)?;
            ptzcal_head_options::change(options, |o| o.frames = Some(frames))
        }
    })
}

/// Sets the host's laser of the head.
///
/// @param options The options.
/// @param set     Switches the laser.
/// @param user    Handed to the callback.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NULL_POINTER.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_options_set_laser(
    options: *mut ptzcal_head_options,
    set: ptzcal_laser_fn,
    user: *mut c_void,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers and callbacks.
        unsafe {
            let laser = HostLaser::new(set, user)?;
            ptzcal_head_options::change(options, |o| o.laser = Some(laser))
        }
    })
}

/// Sets which angles the numbers of a head without angles are: it then speaks radians.
///
/// @param options The options.
/// @param map     The map, copied; may be NULL: none.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; opening refuses the map for a head that knows angles itself.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_head_options_set_angle_map(
    options: *mut ptzcal_head_options,
    map: *const ptzcal_angle_map,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            let map = map_of(map);
            ptzcal_head_options::change(options, |o| o.angle_map = map)
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
