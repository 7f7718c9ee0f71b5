//! Devices of the host
//!
//! A host that owns its cameras and its PTZ control hands them in as callbacks. All callbacks of a
//! rig run on the thread that called the library, one at a time, and must not throw or longjmp. Each
//! returns a ptzcal_status: PTZCAL_STATUS_OK, or what went wrong (PTZCAL_STATUS_DEVICE,
//! PTZCAL_STATUS_DEVICE_LOST, PTZCAL_STATUS_DEVICE_TIMEOUT, PTZCAL_STATUS_UNSUPPORTED; any other
//! number counts as PTZCAL_STATUS_DEVICE). A callback that never returns hangs the call that it
//! serves: give it a time-out of its own. `user` is carried along and must live as long as the rig,
//! or the scan, that the callbacks were given to.

use std::ffi::c_void;

use super::call::{ErrorOut, guard};
use super::image::{ptzcal_image, view};
use super::log::User;
use super::sized::{self, SizedStruct};
use super::status::ptzcal_status;
use crate::control::Clock;
use crate::device::{Frame, FrameSource, Laser, Motion, PanTiltZoom, PtzCapabilities, PtzPosition};
use crate::error::{Error, Result};

/// What a head does at the moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum ptzcal_motion {
    /// It stands still.
    Idle = 0,
    /// It moves.
    Moving = 1,
    /// The last move ended without reaching its target.
    Failed = 2,
    /// The device does not say.
    Unknown = 3,
}

impl From<Motion> for ptzcal_motion {
    fn from(motion: Motion) -> Self {
        match motion {
            Motion::Idle => Self::Idle,
            Motion::Moving => Self::Moving,
            Motion::Failed => Self::Failed,
            Motion::Unknown => Self::Unknown,
        }
    }
}

/// Starts a move to pan and tilt (radians; positive pan right, positive tilt up) and returns, or
/// returns when the head is there.
pub type ptzcal_ptz_move_fn = Option<unsafe extern "C" fn(user: *mut c_void, pan: f64, tilt: f64) -> i32>;

/// Reads the position: pan and tilt in radians, zoom from 0 (wide) to 1 (tele), 0 without zoom.
pub type ptzcal_ptz_position_fn =
    Option<unsafe extern "C" fn(user: *mut c_void, pan: *mut f64, tilt: *mut f64, zoom: *mut f64) -> i32>;

/// Says whether the head moves: writes a ptzcal_motion.
pub type ptzcal_ptz_motion_fn = Option<unsafe extern "C" fn(user: *mut c_void, motion: *mut i32) -> i32>;

/// Stops the head at once, in every state.
pub type ptzcal_ptz_stop_fn = Option<unsafe extern "C" fn(user: *mut c_void) -> i32>;

/// Switches the laser: `on` is 1 or 0.
pub type ptzcal_laser_fn = Option<unsafe extern "C" fn(user: *mut c_void, on: i32) -> i32>;

/// Hands over a frame whose exposure began at `not_before` (seconds of the rig's clock) or later,
/// waiting at most `timeout` seconds: PTZCAL_STATUS_DEVICE_TIMEOUT then. `image` is set up; fill in
/// format, size, planes and strides. The pixels must stay until the callback returns and are then
/// copied before anything else is called. `timestamp` receives when the exposure began, on the rig's
/// clock; a source that does not know writes NAN and gives the newest frame: the library then drops
/// some frames after each change.
pub type ptzcal_frame_fn = Option<
    unsafe extern "C" fn(
        user: *mut c_void,
        not_before: f64,
        timeout: f64,
        image: *mut ptzcal_image,
        timestamp: *mut f64,
    ) -> i32,
>;

/// Seconds since any fixed moment; never goes back. The clock that stamps the frames.
pub type ptzcal_clock_now_fn = Option<unsafe extern "C" fn(user: *mut c_void) -> f64>;

/// Lets seconds pass on that clock.
pub type ptzcal_clock_sleep_fn = Option<unsafe extern "C" fn(user: *mut c_void, seconds: f64)>;

/// A pan-tilt head of the host.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_ptz {
    /// Set by ptzcal_ptz_init.
    pub struct_size: u32,
    /// 1: pan and tilt are numbers without known angles, and "radians" below are those numbers; 0: they
    /// are radians.
    pub raw_units: u32,
    /// Least pan that the head reaches, radians.
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
    /// Handed to the callbacks.
    pub user: *mut c_void,
    /// Required.
    pub move_absolute: ptzcal_ptz_move_fn,
    /// Required.
    pub position: ptzcal_ptz_position_fn,
    /// May be NULL: positions and frames then tell whether a move is finished.
    pub motion: ptzcal_ptz_motion_fn,
    /// Required.
    pub stop: ptzcal_ptz_stop_fn,
}

// SAFETY: numbers, raw pointers and nullable function pointers; `struct_size` first.
unsafe impl SizedStruct for ptzcal_ptz {
    const NAME: &'static str = "ptz";
    const FIRST_SIZE: usize = 8 + 6 * 8 + 5 * size_of::<usize>();
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
            user: std::ptr::null_mut(),
            move_absolute: None,
            position: None,
            motion: None,
            stop: None,
        }
    }
}

/// Sets up a head: no range, no callbacks.
///
/// @param ptz  The struct.
/// @param size sizeof *ptz.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_ptz_init(ptz: *mut ptzcal_ptz, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(ptz, size) })
}

/// What a callback returned, as a result.
fn check(status: i32, what: &'static str) -> Result<()> {
    let reason = || format!("the host's {what} callback returned {status}");
    match status {
        0 => Ok(()),
        s if s == ptzcal_status::DeviceTimeout as i32 => Err(Error::DeviceTimeout { what, seconds: f64::NAN }),
        s if s == ptzcal_status::DeviceLost as i32 => Err(Error::DeviceLost { reason: reason() }),
        s if s == ptzcal_status::Unsupported as i32 => Err(Error::Unsupported { what: reason() }),
        s if s == ptzcal_status::Cancelled as i32 => Err(Error::Cancelled),
        _ => Err(Error::Device { reason: reason() }),
    }
}

fn required<T>(callback: Option<T>, name: &'static str) -> Result<T> {
    callback.ok_or(Error::NullPointer { name })
}

/// A head behind callbacks.
#[derive(Clone)]
pub(super) struct HostPtz {
    capabilities: PtzCapabilities,
    user: User,
    move_absolute: unsafe extern "C" fn(*mut c_void, f64, f64) -> i32,
    position: unsafe extern "C" fn(*mut c_void, *mut f64, *mut f64, *mut f64) -> i32,
    motion: ptzcal_ptz_motion_fn,
    stop: unsafe extern "C" fn(*mut c_void) -> i32,
}

impl HostPtz {
    /// # Safety
    /// `ptz` is NULL or a struct as long as its `struct_size` says; its callbacks may be called with
    /// its user for as long as the head lives.
    pub unsafe fn new(ptz: *const ptzcal_ptz) -> Result<Self> {
        // SAFETY: by this function's contract.
        let p = unsafe { sized::read(ptz)? };
        Ok(Self {
            capabilities: PtzCapabilities {
                pan_range: [p.pan_min, p.pan_max],
                tilt_range: [p.tilt_min, p.tilt_max],
                pan_step: p.pan_step,
                tilt_step: p.tilt_step,
                raw_units: super::args::flag(p.raw_units, "ptz.raw_units")?,
                reports_motion: p.motion.is_some(),
                reports_position: true,
                ..PtzCapabilities::default()
            },
            user: User::new(p.user),
            move_absolute: required(p.move_absolute, "ptz.move_absolute")?,
            position: required(p.position, "ptz.position")?,
            motion: p.motion,
            stop: required(p.stop, "ptz.stop")?,
        })
    }
}

impl PanTiltZoom for HostPtz {
    fn capabilities(&self) -> PtzCapabilities {
        self.capabilities
    }

    fn move_absolute(&mut self, pan: f64, tilt: f64) -> Result<()> {
        // SAFETY: by the contract of `new`.
        check(unsafe { (self.move_absolute)(self.user.get(), pan, tilt) }, "move")
    }

    fn position(&mut self) -> Result<PtzPosition> {
        let mut p = PtzPosition { pan: f64::NAN, tilt: f64::NAN, zoom: 0.0 };
        // SAFETY: by the contract of `new`; the places outlive the call.
        check(unsafe { (self.position)(self.user.get(), &mut p.pan, &mut p.tilt, &mut p.zoom) }, "position")?;
        Ok(p)
    }

    fn motion(&mut self) -> Result<Motion> {
        let Some(callback) = self.motion else { return Ok(Motion::Unknown) };
        let mut motion = ptzcal_motion::Unknown as i32;
        // SAFETY: by the contract of `new`; the place outlives the call.
        check(unsafe { callback(self.user.get(), &mut motion) }, "motion")?;
        Ok(match motion {
            m if m == ptzcal_motion::Idle as i32 => Motion::Idle,
            m if m == ptzcal_motion::Moving as i32 => Motion::Moving,
            m if m == ptzcal_motion::Failed as i32 => Motion::Failed,
            _ => Motion::Unknown,
        })
    }

    fn stop(&mut self) -> Result<()> {
        // SAFETY: by the contract of `new`.
        check(unsafe { (self.stop)(self.user.get()) }, "stop")
    }
}

/// A laser behind a callback.
#[derive(Clone)]
pub(super) struct HostLaser {
    set: unsafe extern "C" fn(*mut c_void, i32) -> i32,
    user: User,
}

impl HostLaser {
    /// # Safety
    /// The callback may be called with `user`, from any thread that uses the rig, while the laser lives.
    pub unsafe fn new(set: ptzcal_laser_fn, user: *mut c_void) -> Result<Self> {
        Ok(Self { set: required(set, "set")?, user: User::new(user) })
    }
}

impl Laser for HostLaser {
    fn set(&mut self, on: bool) -> Result<()> {
        // SAFETY: by the contract of `new`.
        check(unsafe { (self.set)(self.user.get(), i32::from(on)) }, "laser")
    }
}

/// Frames behind a callback.
#[derive(Clone)]
pub(super) struct HostFrames {
    next: unsafe extern "C" fn(*mut c_void, f64, f64, *mut ptzcal_image, *mut f64) -> i32,
    user: User,
}

impl HostFrames {
    /// # Safety
    /// The callback may be called with `user` while the source lives, and hands over images whose
    /// planes are as long as it says.
    pub unsafe fn new(next: ptzcal_frame_fn, user: *mut c_void) -> Result<Self> {
        Ok(Self { next: required(next, "next_frame")?, user: User::new(user) })
    }
}

impl FrameSource for HostFrames {
    fn next_frame(&mut self, not_before: f64, timeout: f64, frame: &mut Frame) -> Result<()> {
        let (mut image, mut timestamp) = (ptzcal_image::initial(), f64::NAN);
        // SAFETY: by the contract of `new`; the places outlive the call.
        let status = unsafe { (self.next)(self.user.get(), not_before, timeout, &mut image, &mut timestamp) };
        match check(status, "frames") {
            Err(Error::DeviceTimeout { what, .. }) => return Err(Error::DeviceTimeout { what, seconds: timeout }),
            other => other?,
        }
        // What the host wrote over the size is not believed.
        image.struct_size = ptzcal_image::initial().struct_size;
        // SAFETY: the planes are as long as the host says, and stay until something else is called.
        let seen = unsafe { view(&image) }
            .map_err(|e| Error::Device { reason: format!("the host's frame is not usable: {e}") })?;
        seen.copy_to(&mut frame.image);
        frame.timestamp = timestamp;
        Ok(())
    }
}

/// The host's clock.
pub(super) struct HostClock {
    now: unsafe extern "C" fn(*mut c_void) -> f64,
    sleep: unsafe extern "C" fn(*mut c_void, f64),
    user: User,
}

impl HostClock {
    /// # Safety
    /// The callbacks may be called with `user` while the clock lives.
    pub unsafe fn new(now: ptzcal_clock_now_fn, sleep: ptzcal_clock_sleep_fn, user: *mut c_void) -> Result<Self> {
        Ok(Self { now: required(now, "now")?, sleep: required(sleep, "sleep")?, user: User::new(user) })
    }
}

impl Clock for HostClock {
    fn now(&self) -> f64 {
        // SAFETY: by the contract of `new`.
        unsafe { (self.now)(self.user.get()) }
    }

    fn sleep(&self, seconds: f64) {
        if seconds > 0.0 {
            // SAFETY: by the contract of `new`.
            unsafe { (self.sleep)(self.user.get(), seconds) }
        }
    }
}
