//! The three ports behind which all devices are equals: [`PanTiltZoom`], [`Laser`], [`FrameSource`].
//!
//! A workflow is given the three and a clock, and never learns which device is behind them: the
//! host's callbacks, a driver, or the simulator. Angles are radians, positive pan right, positive
//! tilt up; drivers translate. Times are seconds of the workflow's clock.

mod address;
mod angle;
#[cfg(target_os = "linux")]
mod gpio;
mod io;
mod laser_limits;
mod link;
mod mapped;
pub mod onvif;
mod open;
pub mod pelco;
mod poll;
pub mod recording;
pub mod serial;
pub mod tcp;
pub mod udp;
#[cfg(all(target_os = "linux", feature = "v4l2"))]
mod v4l2;
pub mod visca;

use std::sync::Arc;

pub use address::{Address, Credentials};
pub(crate) use angle::turned_into;
#[cfg(target_os = "linux")]
#[doc(hidden)]
pub use gpio::laser_guard_main;
pub use io::device_error;
pub use laser_limits::{LaserLimits, OnTimes};
pub use link::{Link, Sender};
pub use mapped::MappedPtz;
pub use open::{Surroundings, open_frames, open_laser, open_ptz};

use crate::error::{Error, Result};
use crate::image::{Image, PixelFormat};

/// What a head can do.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PtzCapabilities {
    /// Least and greatest pan and tilt, radians (raw units when [`raw_units`](Self::raw_units)).
    pub pan_range: [f64; 2],
    pub tilt_range: [f64; 2],
    /// Size of an encoder step, radians; 0 when unknown.
    pub pan_step: f64,
    pub tilt_step: f64,
    /// Greatest speed of pan and tilt, radians per second; 0 when unknown.
    pub max_speed: [f64; 2],
    /// The device's pan and tilt are numbers without a known angle: an angle map has to
    /// be learned before a workflow takes the head.
    pub raw_units: bool,
    /// Does [`PanTiltZoom::motion`] tell the truth? When not, only equal positions and frames count.
    pub reports_motion: bool,
    /// Does [`PanTiltZoom::position`] read the head? When not it says where the head was sent.
    pub reports_position: bool,
    pub has_zoom: bool,
    pub has_drive: bool,
    pub has_relative: bool,
    pub has_view_moves: bool,
    pub has_home: bool,
    pub has_focus: bool,
    pub has_exposure_lock: bool,
    /// Number of presets, numbered from 0; 0 without.
    pub presets: u32,
}

/// Where the head is, as the device reads it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PtzPosition {
    pub pan: f64,
    pub tilt: f64,
    /// Device's own zoom scale, 0 (wide) to 1 (tele); 0 without zoom.
    pub zoom: f64,
}

/// How fast a head is driven.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PtzVelocity {
    /// Radians per second, positive right and up; cut to what the device can.
    pub pan: f64,
    pub tilt: f64,
    /// -1 (to wide at full speed) to 1 (to tele).
    pub zoom: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Focus {
    Auto,
    /// Stays where it is.
    Manual,
    /// Manual, at this place of the device's own scale, 0 (far) to 1 (near).
    At(f64),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    Idle,
    Moving,
    /// The last move ended without reaching its target.
    Failed,
    /// The device does not say.
    Unknown,
}

/// What a device says it is; empty where it does not say.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Identity {
    /// The protocol that it is spoken to with, such as "VISCA".
    pub protocol: String,
    pub vendor: String,
    pub model: String,
    pub firmware: String,
}

/// A pan-tilt(-zoom) head. What a device does not have answers `Unsupported`.
pub trait PanTiltZoom: Send {
    fn capabilities(&self) -> PtzCapabilities;
    /// Starts a move and returns; it may also return only when the head is there.
    fn move_absolute(&mut self, pan: f64, tilt: f64) -> Result<()>;
    fn position(&mut self) -> Result<PtzPosition>;
    fn motion(&mut self) -> Result<Motion>;
    /// Stops pan, tilt and zoom at once. Works in every state; waits for no answer.
    fn stop(&mut self) -> Result<()>;
    /// A second way to stop, from any thread, while another call of this head is at work.
    fn brake(&self) -> Option<Arc<dyn Brake>> {
        None
    }
    /// What the device says it is.
    fn identity(&mut self) -> Result<Identity> {
        Ok(Identity::default())
    }
    /// Starts a move by angles from where the head is.
    fn move_relative(&mut self, _pan: f64, _tilt: f64) -> Result<()> {
        Err(unsupported("relative moves"))
    }
    /// Starts a move that brings a place of the present picture to its centre: `x` and `y` from -1 to 1,
    /// from the centre to the picture's right and upper edge. Needs no known angles and no lens.
    fn move_in_view(&mut self, _x: f64, _y: f64) -> Result<()> {
        Err(unsupported("moves within the picture"))
    }
    /// Drives until told otherwise; 0 stops an axis. `timeout` seconds (infinite: none) is handed to
    /// devices that stop by themselves; for others the caller has to.
    fn drive(&mut self, _velocity: PtzVelocity, _timeout: f64) -> Result<()> {
        Err(unsupported("continuous drive"))
    }
    fn home(&mut self) -> Result<()> {
        Err(unsupported("home"))
    }
    /// Starts zooming to a place of the device's own scale, 0 (wide) to 1 (tele).
    fn set_zoom(&mut self, _zoom: f64) -> Result<()> {
        Err(unsupported("zoom"))
    }
    fn set_focus(&mut self, _focus: Focus) -> Result<()> {
        Err(unsupported("focus"))
    }
    /// Where the focus is, 0 (far) to 1 (near).
    fn focus(&mut self) -> Result<f64> {
        Err(unsupported("focus"))
    }
    /// Holds exposure and white balance as they are, as image differencing wants it, or lets them go.
    fn lock_exposure(&mut self, _locked: bool) -> Result<()> {
        Err(unsupported("exposure lock"))
    }
    /// Remembers the present position under a number.
    fn store_preset(&mut self, _preset: u32) -> Result<()> {
        Err(unsupported("presets"))
    }
    /// Starts a move to a preset.
    fn recall_preset(&mut self, _preset: u32) -> Result<()> {
        Err(unsupported("presets"))
    }
    fn clear_preset(&mut self, _preset: u32) -> Result<()> {
        Err(unsupported("presets"))
    }
}

fn unsupported(what: &str) -> Error {
    Error::Unsupported { what: format!("{what} by this device") }
}

/// Stops a head from any thread and waits for no answer.
pub trait Brake: Send + Sync {
    fn stop(&self) -> Result<()>;
}

/// A laser that is on or off. An implementation also switches off when it is dropped, where it can.
pub trait Laser: Send {
    fn set(&mut self, on: bool) -> Result<()>;
    /// Is it still as it was set? Returns at once. An error when it went off by itself.
    fn check(&mut self) -> Result<()> {
        Ok(())
    }
    /// What the laser allows by itself; workflows keep within it.
    fn limits(&self) -> LaserLimits {
        LaserLimits::NONE
    }
}

/// One frame of a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    pub image: Image,
    /// Start of exposure on the workflow's clock, seconds; NaN when the source cannot tell.
    pub timestamp: f64,
}

impl Frame {
    pub fn empty() -> Self {
        Self { image: Image::new(PixelFormat::Gray8, 0, 0), timestamp: f64::NAN }
    }
}

/// A camera's frames. Implementations hold on to nothing of `frame`, whose buffer is reused.
pub trait FrameSource: Send {
    /// The next frame whose exposure began at `not_before` or later (clock seconds), waiting at most
    /// `timeout` seconds: `DeviceTimeout` then. A source without timestamps gives a frame taken after
    /// the call and sets the timestamp to NaN.
    fn next_frame(&mut self, not_before: f64, timeout: f64, frame: &mut Frame) -> Result<()>;
}
