//! What a rig is made of
//!
//! Devices by callbacks or by an address, the rig's model, and how it behaves. The options are read
//! when a rig is opened.

use super::angle_map::{map_of, ptzcal_angle_map};
use super::args::{number, string_optional};
use super::call::{ErrorOut, guard};
use super::devices::{
    HostClock, HostFrames, HostLaser, HostPtz, ptzcal_clock_now_fn, ptzcal_clock_sleep_fn, ptzcal_frame_fn,
    ptzcal_laser_fn, ptzcal_ptz,
};
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, free};
use super::log::{log, ptzcal_log_fn};
use super::rig_model::{model_in, ptzcal_rig_model};
use super::status::ptzcal_status;
use crate::control::{Clock, Log};
use crate::device::{Credentials, LaserLimits};
use crate::error::{Error, Result};
use crate::geometry::{AngleMap, RigModel};
use crate::rig::RigOptions;
use std::ffi::{c_char, c_void};
use std::sync::Arc;

/// What a rig is made of, and how it behaves.
pub struct ptzcal_rig_options(pub(super) Exclusive<Settings>);

#[derive(Default)]
pub(super) struct Settings {
    pub(super) address: Option<String>,
    pub(super) ptz_address: Option<String>,
    pub(super) laser_address: Option<String>,
    pub(super) frames_address: Option<String>,
    pub(super) angle_map: Option<AngleMap>,
    pub(super) credentials: Option<Credentials>,
    pub(super) model: Option<RigModel>,
    pub(super) ptz: Option<HostPtz>,
    pub(super) laser: Option<HostLaser>,
    pub(super) frames: Option<HostFrames>,
    pub(super) clock: Option<Arc<dyn Clock>>,
    pub(super) log: Log,
    pub(super) options: RigOptions,
}

impl Handle for ptzcal_rig_options {
    const NAME: &'static str = "options";
}

impl ptzcal_rig_options {
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

/// Makes options: no devices, defaults for everything else.
///
/// @param options Receives the options; free them with ptzcal_rig_options_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_options_new(
    options: *mut *mut ptzcal_rig_options,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let options = unsafe { HandleOut::new(options)? };
        options.give(ptzcal_rig_options(Exclusive::new(Settings::default())));
        Ok(())
    })
}

/// Frees options. Rigs opened with them live on, and go on using the callbacks.
///
/// @param options The options; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_options_free(options: *mut ptzcal_rig_options) {
    // SAFETY: NULL or live options that nobody uses any more, as the header demands.
    super::call::guard_or((), || unsafe { free(options) });
}

/// Sets the address of a whole rig: the simulator, or a recorded scan. Callbacks and addresses of
/// single devices that are set as well take their place one by one.
///
/// @param options The options.
/// @param address "sim:room?key=value&..." or "folder:///path"; may be NULL: none. It may hold no
///                password.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; opening says whether the address exists.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_options_set_address(
    options: *mut ptzcal_rig_options,
    address: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            let address = string_optional(address, "address")?;
            ptzcal_rig_options::change(options, |o| o.address = address)
        }
    })
}

/// Sets the address of the head; a host's head takes its place.
///
/// @param options The options.
/// @param address Such as "visca:///dev/ttyUSB0?model=evi-d100" (docs/addresses.md); may be NULL: none. It may hold no
///                password.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; opening says what is wrong with it.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_options_set_ptz_address(
    options: *mut ptzcal_rig_options,
    address: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            let address = string_optional(address, "address")?;
            ptzcal_rig_options::change(options, |o| o.ptz_address = address)
        }
    })
}

/// Sets the address of the laser; a host's laser takes its place.
///
/// @param options The options.
/// @param address Such as "gpio:///dev/gpiochip0/laser" (docs/addresses.md); may be NULL: none. It may hold no
///                password.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; opening says what is wrong with it.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_options_set_laser_address(
    options: *mut ptzcal_rig_options,
    address: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            let address = string_optional(address, "address")?;
            ptzcal_rig_options::change(options, |o| o.laser_address = address)
        }
    })
}

/// Sets the address of the head camera's frames; a host's frames take its place.
///
/// @param options The options.
/// @param address Such as "v4l2:///dev/video0?format=YUYV" (docs/addresses.md); may be NULL: none. It may hold no
///                password.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; opening says what is wrong with it.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_options_set_frames_address(
    options: *mut ptzcal_rig_options,
    address: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            let address = string_optional(address, "address")?;
            ptzcal_rig_options::change(options, |o| o.frames_address = address)
        }
    })
}

/// Sets which angles the numbers of a head without angles are: the rig refuses such a head without it.
///
/// @param options The options.
/// @param map     The map, copied; may be NULL: none.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; opening refuses the map for a head that knows angles itself.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_options_set_angle_map(
    options: *mut ptzcal_rig_options,
    map: *const ptzcal_angle_map,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            let map = map_of(map);
            ptzcal_rig_options::change(options, |o| o.angle_map = map)
        }
    })
}

/// Sets the greatest share of the time that the laser is on, in any window. Scans pause where they have to.
///
/// @param options The options.
/// @param duty    More than 0, at most 1; the default is 1: no limit.
/// @param window  Seconds, more than 0, at most 3600; the default is 10.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_options_set_laser_duty(
    options: *mut ptzcal_rig_options,
    duty: f64,
    window: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let limits =
            LaserLimits { duty: number(duty, "duty")?, window: number(window, "window")?, ..LaserLimits::default() };
        limits.validate()?;
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            ptzcal_rig_options::change(options, |o| {
                o.options.laser_duty = duty;
                o.options.laser_duty_window = window;
            })
        }
    })
}

/// Sets who opens the devices that ask for it (ONVIF).
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
pub unsafe extern "C" fn ptzcal_rig_options_set_credentials(
    options: *mut ptzcal_rig_options,
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
            ptzcal_rig_options::change(options, |o| o.credentials = credentials)
        }
    })
}

/// Who opens a device; `None` without a user.
///
/// # Safety
/// Both are NULL or strings.
pub(super) unsafe fn credentials(user: *const c_char, password: *const c_char) -> Result<Option<Credentials>> {
    // SAFETY: by this function's contract.
    let (user, password) = unsafe { (string_optional(user, "user")?, string_optional(password, "password")?) };
    Ok(user.map(|user| Credentials { user, password: password.unwrap_or_default() }))
}

/// Sets the rig model. Simulators and recordings bring one of their own; all other rigs need it.
///
/// @param options The options.
/// @param model   The model.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT for a model that
///         makes no sense.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_options_set_model(
    options: *mut ptzcal_rig_options,
    model: *const ptzcal_rig_model,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            let model = model_in(model)?;
            ptzcal_rig_options::change(options, |o| o.model = Some(model))
        }
    })
}

/// Sets the host's head.
///
/// @param options The options.
/// @param ptz     The head; the struct is copied.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NULL_POINTER for a missing callback.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_options_set_ptz(
    options: *mut ptzcal_rig_options,
    ptz: *const ptzcal_ptz,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers and callbacks.
        unsafe {
            let ptz = HostPtz::new(ptz)?;
            ptzcal_rig_options::change(options, |o| o.ptz = Some(ptz))
        }
    })
}

/// Sets the host's laser. ptzcal_rig_emergency_off calls it from its own thread.
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
pub unsafe extern "C" fn ptzcal_rig_options_set_laser(
    options: *mut ptzcal_rig_options,
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
            ptzcal_rig_options::change(options, |o| o.laser = Some(laser))
        }
    })
}

/// Sets where the head camera's frames come from.
///
/// @param options    The options.
/// @param next_frame Hands over a frame.
/// @param user       Handed to the callback.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NULL_POINTER.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_options_set_frames(
    options: *mut ptzcal_rig_options,
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
            ptzcal_rig_options::change(options, |o| o.frames = Some(frames))
        }
    })
}

/// Sets the clock that stamps the host's frames. Without one it is the system's monotonic clock,
/// counted from the opening of the rig: frames then need no timestamp (NAN).
///
/// @param options The options.
/// @param now     Reads the clock.
/// @param sleep   Waits.
/// @param user    Handed to the callbacks.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NULL_POINTER.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_options_set_clock(
    options: *mut ptzcal_rig_options,
    now: ptzcal_clock_now_fn,
    sleep: ptzcal_clock_sleep_fn,
    user: *mut c_void,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers and callbacks.
        unsafe {
            let clock: Arc<dyn Clock> = Arc::new(HostClock::new(now, sleep, user)?);
            ptzcal_rig_options::change(options, |o| o.clock = Some(clock))
        }
    })
}

/// Sets where the rig's messages go.
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
pub unsafe extern "C" fn ptzcal_rig_options_set_log(
    options: *mut ptzcal_rig_options,
    callback: ptzcal_log_fn,
    user: *mut c_void,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers and callbacks.
        unsafe {
            let log = log(callback, user);
            ptzcal_rig_options::change(options, |o| o.log = log)
        }
    })
}

/// Sets when a move is finished: the device says so (where it does), some readings in a row are
/// equal, and the head camera's picture stands still.
///
/// @param options      The options.
/// @param readings     Equal readings in a row, at least 2; the default is 3.
/// @param duration     Seconds that they span; the default is 0.15.
/// @param overshoot    Radians that a move goes past its target first when it comes from the upper
///                     side, so that every target is approached from below (backlash); the default
///                     is 0.01, 0 goes straight there.
/// @param move_timeout Longest time for a move, seconds; the default is 30.
/// @param picture      Longest wait for a still picture, seconds; the default is 5, 0 does not look.
/// @param error        Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; opening refuses what makes no sense
///         together.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_options_set_settle(
    options: *mut ptzcal_rig_options,
    readings: u32,
    duration: f64,
    overshoot: f64,
    move_timeout: f64,
    picture: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let numbers =
            [(duration, "duration"), (overshoot, "overshoot"), (move_timeout, "move_timeout"), (picture, "picture")];
        for (value, name) in numbers {
            if number(value, name)? < 0.0 {
                return Err(Error::invalid(name, format!("{value} is negative")));
            }
        }
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            ptzcal_rig_options::change(options, |o| {
                let settle = &mut o.options.settle;
                settle.readings = readings;
                settle.duration = duration;
                settle.overshoot = overshoot;
                settle.move_timeout = move_timeout;
                settle.picture_timeout = picture;
            })
        }
    })
}

/// Sets how frames are waited for.
///
/// @param options      The options.
/// @param timeout      Longest wait for a frame, seconds; the default is 3.
/// @param stale_frames Frames without timestamps to drop after each change; the default is 4: the
///                     depth of the source's buffers and one.
/// @param error        Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_options_set_frame_wait(
    options: *mut ptzcal_rig_options,
    timeout: f64,
    stale_frames: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        if number(timeout, "timeout")? <= 0.0 {
            return Err(Error::invalid("timeout", format!("{timeout} is not positive")));
        }
        if stale_frames > 100 {
            return Err(Error::invalid("stale_frames", format!("{stale_frames}, 100 are the most")));
        }
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            ptzcal_rig_options::change(options, |o| {
                o.options.frames.timeout = timeout;
                o.options.frames.stale_frames = stale_frames;
            })
        }
    })
}

/// Sets the longest time that the laser stays on. It is enforced whenever the library has control:
/// a callback that does not return keeps it from acting.
///
/// @param options The options.
/// @param seconds Positive; the default is 2.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_options_set_laser_max_on(
    options: *mut ptzcal_rig_options,
    seconds: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        if number(seconds, "seconds")? <= 0.0 {
            return Err(Error::invalid("seconds", format!("{seconds} is not positive")));
        }
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { ptzcal_rig_options::change(options, |o| o.options.laser_max_on = seconds) }
    })
}
