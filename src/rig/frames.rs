//! Frames that are certainly newer than a moment: after a move, after a toggle of the laser.

use super::laser::LaserGuard;
use crate::control::{Cancel, Clock};
use crate::device::{Frame, FrameSource};
use crate::error::{Error, Result};

/// How frames are waited for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameOptions {
    /// Longest wait for a frame, seconds; shorter while the laser is on.
    pub timeout: f64,
    /// Frames to drop after a move or toggle from a source without timestamps: the depth of its
    /// buffers and one.
    pub stale_frames: u32,
}

impl Default for FrameOptions {
    fn default() -> Self {
        Self { timeout: 3.0, stale_frames: 4 }
    }
}

impl FrameOptions {
    pub(crate) fn validate(&self) -> Result<()> {
        if !(self.timeout > 0.0 && self.timeout <= 3600.0) {
            return Err(Error::invalid("frames.timeout", format!("{} s is not in (0, 3600]", self.timeout)));
        }
        Ok(())
    }
}

/// Longest single wait: how late a cancel can be noticed, seconds.
const SLICE: f64 = 0.5;
/// Calls of a source for one frame, whatever the clock says.
const MAX_CALLS: usize = 1000;

/// Which frames will do.
#[derive(Debug, Clone, Copy)]
pub(crate) enum After {
    /// Exposure began at this moment or later.
    Moment(f64),
    /// The one after the frame with this timestamp (NaN: whatever comes next).
    Frame(f64),
}

/// One camera of a workflow.
pub(crate) struct CameraPort<'a> {
    pub source: &'a mut dyn FrameSource,
    pub name: &'static str,
    pub width: u32,
    pub height: u32,
}

pub(crate) struct Grabber<'a> {
    pub clock: &'a dyn Clock,
    pub cancel: &'a Cancel,
    pub options: FrameOptions,
}

impl Grabber<'_> {
    /// Waits for a frame. With a `light`, no longer than the laser may stay on.
    pub fn grab(
        &self,
        port: &mut CameraPort<'_>,
        after: After,
        light: Option<&LaserGuard>,
        frame: &mut Frame,
    ) -> Result<()> {
        let start = self.clock.now();
        let late = Error::DeviceTimeout { what: port.name, seconds: self.options.timeout };
        let (not_before, mut to_skip) = match after {
            After::Moment(moment) => (moment, self.options.stale_frames),
            // Any two frames are further apart than a microsecond.
            After::Frame(timestamp) => (if timestamp.is_finite() { timestamp + 1e-6 } else { start }, 0),
        };
        for _ in 0..MAX_CALLS {
            self.cancel.check()?;
            let mut wait = (start + self.options.timeout - self.clock.now()).min(SLICE);
            if wait <= 0.0 {
                return Err(late);
            }
            if let Some(light) = light {
                wait = wait.min(light.time_left()?);
            }
            let called = self.clock.now();
            match port.source.next_frame(not_before, wait, frame) {
                Ok(()) => {}
                Err(Error::DeviceTimeout { .. }) => {
                    // A source that gives up at once is asked again, but not in a spin.
                    if self.clock.now() <= called {
                        self.clock.sleep(0.01);
                    }
                    continue;
                }
                Err(error) => return Err(error),
            }
            let view = frame.image.view()?;
            if (view.width(), view.height()) != (port.width, port.height) {
                return Err(Error::Device {
                    reason: format!(
                        "{}: a frame of {} x {} where {} x {} was agreed",
                        port.name,
                        view.width(),
                        view.height(),
                        port.width,
                        port.height
                    ),
                });
            }
            if frame.timestamp.is_nan() {
                if to_skip == 0 {
                    return self.still_lit(light);
                }
                to_skip -= 1;
            } else if frame.timestamp >= not_before {
                return self.still_lit(light);
            }
        }
        Err(late)
    }

    /// A frame only counts when the laser was on to its end.
    fn still_lit(&self, light: Option<&LaserGuard>) -> Result<()> {
        self.cancel.check()?;
        light.map_or(Ok(()), |light| light.time_left().map(|_| ()))
    }
}
