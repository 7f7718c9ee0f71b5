//! The simulator behind the ports.

use std::fmt;
use std::sync::Arc;

use super::Shared;
use super::world::{CameraId, World};
use crate::control::Clock;
use crate::device::{Brake, Frame, FrameSource, Laser, Motion, PanTiltZoom, PtzCapabilities, PtzPosition, PtzVelocity};
use crate::error::{Error, Result};

const PAN_RANGE: [f64; 2] = [-100.0, 100.0];
const TILT_RANGE: [f64; 2] = [-25.0, 25.0];

/// The head. A call takes 8 ms of virtual time.
pub struct SimPtz(pub(super) Arc<Shared>);

/// The laser; off when dropped. A call takes 2 ms of virtual time.
pub struct SimLaser(pub(super) Arc<Shared>);

/// One camera's frames. Each source goes through the camera's frames on its own and gives none twice;
/// a camera keeps the frames of the last second.
pub struct SimFrames {
    pub(super) shared: Arc<Shared>,
    pub(super) camera: CameraId,
    /// The number of the next frame.
    pub(super) next: i64,
}

/// Virtual time: it passes when something waits, and as fast as the work is done. With the option
/// `real_time` it is the system's, times that factor.
pub struct SimClock(pub(super) Arc<Shared>);

fn radians(range: [f64; 2]) -> [f64; 2] {
    range.map(f64::to_radians)
}

impl PanTiltZoom for SimPtz {
    fn capabilities(&self) -> PtzCapabilities {
        let (step, speed) = {
            let options = &self.0.world().options;
            (options.step, options.speed)
        };
        PtzCapabilities {
            pan_range: radians(PAN_RANGE),
            tilt_range: radians(TILT_RANGE),
            pan_step: step,
            tilt_step: step,
            max_speed: [speed; 2],
            reports_motion: true,
            reports_position: true,
            has_drive: true,
            has_relative: true,
            has_view_moves: true,
            has_home: true,
            ..PtzCapabilities::default()
        }
    }

    fn move_absolute(&mut self, pan: f64, tilt: f64) -> Result<()> {
        let mut world = self.0.call_ptz()?;
        go(&mut world, [pan, tilt])
    }

    fn move_relative(&mut self, pan: f64, tilt: f64) -> Result<()> {
        let mut world = self.0.call_ptz()?;
        let [from_pan, from_tilt] = world.motion.reading(world.now);
        go(&mut world, [from_pan + pan, from_tilt + tilt])
    }

    fn move_in_view(&mut self, x: f64, y: f64) -> Result<()> {
        let mut world = self.0.call_ptz()?;
        let (k, half) = (world.rig.intrinsics, [world.rig.width, world.rig.height].map(|size| 0.5 * f64::from(size)));
        let [pan, tilt] = world.motion.reading(world.now);
        go(&mut world, [pan + (x * half[0] / k.fx).atan(), tilt + (y * half[1] / k.fy).atan()])
    }

    fn home(&mut self) -> Result<()> {
        self.move_absolute(0.0, 0.0)
    }

    /// Drives as far as the head goes. The lens is fixed.
    fn drive(&mut self, velocity: PtzVelocity, timeout: f64) -> Result<()> {
        let mut world = self.0.call_ptz()?;
        let PtzVelocity { pan, tilt, zoom } = velocity;
        if !(pan.is_finite() && tilt.is_finite()) || timeout.is_nan() {
            return Err(Error::invalid("velocity", format!("{velocity:?} for {timeout} s")));
        }
        if zoom != 0.0 {
            return Err(Error::Unsupported { what: "zoom by the simulator".into() });
        }
        let (now, limit) = (world.now, world.options.speed);
        let end = |speed: f64, range| radians(range)[usize::from(speed > 0.0)];
        let target = [end(pan, PAN_RANGE), end(tilt, TILT_RANGE)];
        world.move_head(now, target, [pan, tilt].map(|speed| speed.abs().min(limit)));
        if timeout.is_finite() {
            world.motion.stop(now + timeout.max(0.0));
        }
        Ok(())
    }

    fn position(&mut self) -> Result<PtzPosition> {
        let world = self.0.call_ptz()?;
        let [pan, tilt] = world.motion.reading(world.now);
        Ok(PtzPosition { pan, tilt, zoom: 0.0 })
    }

    fn motion(&mut self) -> Result<Motion> {
        let world = self.0.call_ptz()?;
        let moving = world.motion.moving(world.now) && !world.faults.ptz_lies;
        Ok(if moving { Motion::Moving } else { Motion::Idle })
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        Some(Arc::new(SimBrake(self.0.clone())))
    }

    fn stop(&mut self) -> Result<()> {
        let mut world = self.0.call_ptz()?;
        let now = world.now;
        world.motion.stop(now);
        Ok(())
    }
}

struct SimBrake(Arc<Shared>);

impl Brake for SimBrake {
    fn stop(&self) -> Result<()> {
        SimPtz(self.0.clone()).stop()
    }
}

/// Starts a move to angles that the head can reach.
fn go(world: &mut World, target: [f64; 2]) -> Result<()> {
    for ((name, degrees), angle) in [("pan", PAN_RANGE), ("tilt", TILT_RANGE)].into_iter().zip(target) {
        let [low, high] = radians(degrees);
        if !angle.is_finite() {
            return Err(Error::invalid(name, format!("{angle} is no angle")));
        }
        if angle < low || angle > high {
            let reason = format!("{name} {:.2} deg is not within {degrees:?} deg", angle.to_degrees());
            return Err(Error::Unreachable { reason });
        }
    }
    let (now, speed) = (world.now, world.options.speed);
    world.move_head(now, target, [speed; 2]);
    Ok(())
}

impl Laser for SimLaser {
    fn set(&mut self, on: bool) -> Result<()> {
        self.0.set_laser(on)
    }
}

impl Drop for SimLaser {
    fn drop(&mut self) {
        // Switching off never fails.
        let _ = self.0.set_laser(false);
    }
}

impl FrameSource for SimFrames {
    fn next_frame(&mut self, not_before: f64, timeout: f64, frame: &mut Frame) -> Result<()> {
        // Only the snapshot is taken under the world's lock: cameras render at the same time.
        let (number, begin, exposure) = {
            let world = self.shared.world();
            let wait = world.find_frame(self.camera, self.next, not_before, timeout)?;
            let mut world = self.shared.pass(world, wait.until);
            let (number, begin) = wait.frame?;
            world.forget();
            (number, begin, world.exposure(self.camera, number, begin))
        };
        self.next = number + 1;
        self.shared.sensor(self.camera).expose(&exposure, &mut frame.image);
        frame.timestamp = begin;
        self.shared.count_frame();
        Ok(())
    }
}

impl fmt::Debug for SimFrames {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SimFrames").field("camera", &self.camera).field("next", &self.next).finish_non_exhaustive()
    }
}

impl Clock for SimClock {
    fn now(&self) -> f64 {
        self.0.world().now
    }

    fn sleep(&self, seconds: f64) {
        if seconds > 0.0 && seconds.is_finite() {
            let world = self.0.world();
            let until = world.now + seconds;
            drop(self.0.pass(world, until));
        }
    }
}
