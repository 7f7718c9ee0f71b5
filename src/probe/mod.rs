//! What a device really is and does, found out by moving it a little and watching: limits, speeds,
//! repeatability, backlash, latencies, and whether what it reports is true.
//!
//! The head stays within the range that it reports, within a part of it about where it stands unless the
//! limits are asked for, and comes back. The laser is touched only when one is given and asked for.

mod report;
mod session;
mod shift;
mod statistics;
#[cfg(test)]
mod tests;

pub use report::{Figure, Measured, ProbeReport};

use crate::control::{Cancel, Clock, Log};
use crate::device::{FrameSource, PanTiltZoom};
use crate::error::{Error, Result};
use crate::geometry::Camera;
use crate::rig::{FrameOptions, LaserControl, SettleOptions};
use session::Session;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProbeOptions {
    /// Size of the moves, share of each axis's range.
    pub amplitude: f64,
    /// Returns to a place from each side.
    pub repeats: u32,
    /// Go to the four limits of the reported range, too.
    pub reach_limits: bool,
    /// Switch the laser for a second at most, where one is given.
    pub toggle_laser: bool,
    /// Longest time, seconds: what is not measured then stays open.
    pub max_time: f64,
    /// Tolerance, overshoot and the look at the picture are replaced.
    pub settle: SettleOptions,
    pub frames: FrameOptions,
}

impl Default for ProbeOptions {
    fn default() -> Self {
        Self {
            amplitude: 0.1,
            repeats: 5,
            reach_limits: false,
            toggle_laser: false,
            max_time: 300.0,
            settle: SettleOptions::default(),
            frames: FrameOptions::default(),
        }
    }
}

impl ProbeOptions {
    fn validate(&self) -> Result<()> {
        if !(0.005..=0.4).contains(&self.amplitude) {
            return Err(Error::invalid("amplitude", format!("{} is not in [0.005, 0.4]", self.amplitude)));
        }
        if !(2..=100).contains(&self.repeats) {
            return Err(Error::invalid("repeats", format!("{} is not in [2, 100]", self.repeats)));
        }
        if !(self.max_time > 0.0 && self.max_time <= 86_400.0) {
            return Err(Error::invalid("max_time", format!("{} s is not in (0, 86400]", self.max_time)));
        }
        self.settle.validate()?;
        self.frames.validate()
    }
}

/// What is probed.
pub struct ProbeParts<'a> {
    pub head: &'a mut dyn PanTiltZoom,
    /// Frames of the camera on the head.
    pub frames: Option<&'a mut dyn FrameSource>,
    pub laser: Option<&'a LaserControl>,
    /// Lens of the camera, to give what the picture shows in radians.
    pub camera: Option<Camera>,
    /// The clock that stamps the frames.
    pub clock: &'a dyn Clock,
    pub log: &'a Log,
}

/// Probes a device. A figure that cannot be had carries its reason; the head is back where it was at the
/// end, and stopped on every way out that is an error.
///
/// # Errors
/// `InvalidArgument` for options; `Cancelled`; `Device` for a range that makes no sense; `DeviceLost` and
/// `Unauthorised`. A laser that was on is off again, or its error is reported.
pub fn probe(parts: ProbeParts<'_>, options: &ProbeOptions, cancel: &Cancel) -> Result<ProbeReport> {
    options.validate()?;
    if let Some(camera) = &parts.camera {
        camera.validate()?;
    }
    let mut session = Session::new(parts, options, cancel)?;
    let report = session.run();
    if report.is_err() {
        // The first error is the one to report.
        let _ = session.stop();
    }
    report
}
