//! The frames of one shot: all cameras with the laser off, then all with it on.

use super::Rig;
use super::frames::{After, CameraPort, Grabber};
use super::laser::LaserGuard;
use crate::calibrate::DistortionModel;
use crate::control::Cancel;
use crate::device::{Frame, FrameSource};
use crate::error::{Error, Result};
use crate::geometry::Camera;
use crate::image::ImageView;

/// A fixed camera that watches a scan.
pub struct FixedCamera {
    /// Stamped by the rig's clock.
    pub frames: Box<dyn FrameSource>,
    pub width: u32,
    pub height: u32,
    /// When it is calibrated already (its pose in the rig's world): spots are gated from the start.
    pub known: Option<Camera>,
    /// The lens that is fitted to find out where to look.
    pub distortion: DistortionModel,
}

impl FixedCamera {
    /// One that is to be calibrated.
    pub fn new(frames: Box<dyn FrameSource>, width: u32, height: u32) -> Self {
        Self { frames, width, height, known: None, distortion: DistortionModel::Radial1 }
    }

    pub(super) fn validate(&self) -> Result<()> {
        if self.width == 0 || self.height == 0 || self.width > 1 << 16 || self.height > 1 << 16 {
            return Err(Error::invalid("fixed camera", format!("image size {} x {}", self.width, self.height)));
        }
        let Some(known) = &self.known else { return Ok(()) };
        known.validate()?;
        if (known.width, known.height) != (self.width, self.height) {
            return Err(Error::invalid(
                "fixed camera",
                format!(
                    "calibrated at {} x {} px, used at {} x {}",
                    known.width, known.height, self.width, self.height
                ),
            ));
        }
        Ok(())
    }
}

/// Buffers for the frames of a shot; camera 0 is the head's.
pub(super) struct Exposures {
    on: Vec<Vec<Frame>>,
    off: Vec<Vec<Frame>>,
}

impl Exposures {
    pub fn new(cameras: usize, frames_per_state: usize) -> Self {
        let frames = || vec![vec![Frame::empty(); frames_per_state]; cameras];
        Self { on: frames(), off: frames() }
    }

    /// With the laser off, from now on; the head has settled.
    pub fn take_off(&mut self, rig: &mut Rig, fixed: &mut [FixedCamera], cancel: &Cancel) -> Result<()> {
        let since = rig.clock.now();
        // The last frame of settling will do as the first, unless it may show the end of the head's swing.
        let last = &mut rig.pictures[1];
        // One without a time is as new as it gets.
        let too_early = last.timestamp < rig.rested;
        let have_first = rig.options.settle.picture_timeout > 0.0 && !too_early;
        if have_first {
            std::mem::swap(&mut self.off[0][0], last);
        }
        take(&mut self.off, have_first, since, rig, fixed, cancel, None)
    }

    /// With the laser on since `since`.
    pub fn take_on(
        &mut self,
        rig: &mut Rig,
        fixed: &mut [FixedCamera],
        cancel: &Cancel,
        light: &LaserGuard,
        since: f64,
    ) -> Result<()> {
        take(&mut self.on, false, since, rig, fixed, cancel, Some(light))
    }

    /// Frames with the laser on and off of a camera.
    pub fn views(&self, camera: usize) -> Result<(Vec<ImageView<'_>>, Vec<ImageView<'_>>)> {
        Ok((views(&self.on[camera])?, views(&self.off[camera])?))
    }

    /// Colour in the head camera's frame with the laser off, at the nearest pixel.
    pub fn colour(&self, x: f64, y: f64) -> Result<[u8; 3]> {
        let view = self.off[0][0].image.view()?;
        let nearest = |v: f64, size: u32| v.round().clamp(0.0, f64::from(size - 1)) as u32;
        Ok(view.rgb(nearest(x, view.width()), nearest(y, view.height())))
    }
}

fn views(frames: &[Frame]) -> Result<Vec<ImageView<'_>>> {
    frames.iter().map(|frame| frame.image.view()).collect()
}

/// Round by round, so that all cameras are done soon after the slowest.
fn take(
    frames: &mut [Vec<Frame>],
    have_first_of_head: bool,
    since: f64,
    rig: &mut Rig,
    fixed: &mut [FixedCamera],
    cancel: &Cancel,
    light: Option<&LaserGuard>,
) -> Result<()> {
    let grabber = Grabber { clock: &*rig.clock, cancel, options: rig.options.frames };
    let (width, height) = (rig.model.width, rig.model.height);
    for round in 0..frames[0].len() {
        for (camera, frames) in frames.iter_mut().enumerate() {
            if round == 0 && camera == 0 && have_first_of_head {
                continue;
            }
            let mut port = match camera.checked_sub(1) {
                None => CameraPort { source: &mut *rig.frames, name: "head camera", width, height },
                Some(i) => {
                    let c = &mut fixed[i];
                    CameraPort { source: &mut *c.frames, name: "fixed camera", width: c.width, height: c.height }
                }
            };
            let (before, rest) = frames.split_at_mut(round);
            let after = before.last().map_or(After::Moment(since), |frame| After::Frame(frame.timestamp));
            grabber.grab(&mut port, after, light, &mut rest[0])?;
        }
    }
    Ok(())
}
