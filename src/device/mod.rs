//! The three ports behind which all devices are equals: [`PanTiltZoom`], [`Laser`], [`FrameSource`].
//!
//! A workflow is given the three and a clock, and never learns which device is behind them: the
//! host's callbacks, a driver, or the simulator. Angles are radians, positive pan right, positive
//! tilt up; drivers translate. Times are seconds of the workflow's clock.

use crate::error::{Error, Result};
use crate::image::{Image, PixelFormat};

/// What a head can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PtzCapabilities {
    /// Least and greatest pan and tilt, radians.
    pub pan_range: [f64; 2],
    pub tilt_range: [f64; 2],
    /// Size of an encoder step, radians; 0 when unknown.
    pub pan_step: f64,
    pub tilt_step: f64,
    /// Does [`PanTiltZoom::motion`] tell the truth? When not, only equal positions and frames count.
    pub reports_motion: bool,
    pub has_zoom: bool,
}

/// Where the head is, as the device reads it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PtzPosition {
    pub pan: f64,
    pub tilt: f64,
    /// Device's own zoom scale, 0 (wide) to 1 (tele); 0 without zoom.
    pub zoom: f64,
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

/// A pan-tilt(-zoom) head.
pub trait PanTiltZoom: Send {
    fn capabilities(&self) -> PtzCapabilities;
    /// Starts a move and returns; it may also return only when the head is there.
    fn move_absolute(&mut self, pan: f64, tilt: f64) -> Result<()>;
    fn position(&mut self) -> Result<PtzPosition>;
    fn motion(&mut self) -> Result<Motion>;
    /// Stops at once. Must work in every state.
    fn stop(&mut self) -> Result<()>;
    fn set_zoom(&mut self, _zoom: f64) -> Result<()> {
        Err(Error::Unsupported { what: "zoom".into() })
    }
}

/// A laser that is on or off. An implementation also switches off when it is dropped, where it can.
pub trait Laser: Send {
    fn set(&mut self, on: bool) -> Result<()>;
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
