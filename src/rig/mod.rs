//! The rig: a pan-tilt head with a camera and a laser, behind the three ports.
//!
//! [`Rig`] moves, aims and switches the laser; [`scan_region`] surveys a region with it. Nothing here
//! starts a thread: every call blocks its caller, is stopped by a [`Cancel`], and leaves the laser
//! off on every way out ([`laser`]).

mod acquire;
pub mod aim;
pub mod explore;
#[cfg(test)]
pub(crate) mod fake;
pub mod frames;
pub mod gate;
pub mod journal;
pub mod laser;
mod level_set;
mod moves;
pub mod region;
pub mod scan;
mod scan_planes;
pub mod settle;
pub mod shot;
pub mod single;
pub(crate) mod stillness;
pub mod whole;

use std::sync::Arc;

use nalgebra::{Vector2, Vector3};

pub use acquire::FixedCamera;
pub use aim::{Aim, aim_at_point, point_at_pixel};
pub use explore::{ExploreOptions, Explored, Visible, explore};
pub use frames::FrameOptions;
pub use gate::GateOptions;
pub use journal::JournalRepair;
pub use laser::{LaserControl, LaserGuard};
pub use region::ScanRegion;
pub use scan::{Phase, Progress, ScanOptions, scan_region};
pub use scan_planes::ScanPart;
pub use settle::SettleOptions;
pub use shot::{Miss, Scan, ScanCounts, ScanEnd, ScanPoint, Shot, Sighting};
pub use single::{ShotProgress, fire_shots};
pub use whole::WholeRig;

use crate::control::{Cancel, Clock, Log};
use crate::device::{Brake, Frame, FrameSource, Laser, LaserLimits, PanTiltZoom, PtzCapabilities, PtzPosition};
use crate::error::{Error, Result};
use crate::geometry::RigModel;

/// What a rig is made of.
pub struct RigParts {
    pub model: RigModel,
    pub ptz: Box<dyn PanTiltZoom>,
    pub laser: Box<dyn Laser>,
    /// The head camera's frames.
    pub frames: Box<dyn FrameSource>,
    /// The clock that stamps the frames.
    pub clock: Arc<dyn Clock>,
    pub log: Log,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigOptions {
    pub settle: SettleOptions,
    pub frames: FrameOptions,
    /// Longest time that the laser stays on, seconds.
    pub laser_max_on: f64,
    /// Greatest share of any `laser_duty_window` seconds that the laser is on; 1 is no limit. Scans
    /// wait when it is used up.
    pub laser_duty: f64,
    /// Seconds.
    pub laser_duty_window: f64,
}

impl Default for RigOptions {
    fn default() -> Self {
        Self {
            settle: SettleOptions::default(),
            frames: FrameOptions::default(),
            laser_max_on: LaserLimits::DEFAULT_MAX_ON,
            laser_duty: 1.0,
            laser_duty_window: LaserLimits::DEFAULT_WINDOW,
        }
    }
}

/// An open rig. Dropping it stops the head and switches the laser off for good.
pub struct Rig {
    model: RigModel,
    ptz: Box<dyn PanTiltZoom>,
    capabilities: PtzCapabilities,
    laser: LaserControl,
    frames: Box<dyn FrameSource>,
    clock: Arc<dyn Clock>,
    log: Log,
    options: RigOptions,
    /// A laser switched on by hand.
    lit: Option<LaserGuard>,
    /// The head came to where it is from lower pan and tilt.
    approached: bool,
    /// The last two frames of a settled head.
    pictures: [Frame; 2],
    /// Frames of it from here on may be measured in.
    rested: f64,
    closed: bool,
}

impl Rig {
    /// Takes the devices over and switches the laser off; the head does not move.
    ///
    /// # Errors
    /// For a model, options or capabilities that make no sense, and a laser that cannot be switched
    /// off.
    pub fn open(parts: RigParts, options: RigOptions) -> Result<Self> {
        let RigParts { model, ptz, laser, frames, clock, log } = parts;
        // First of all, whatever else may be wrong.
        let limits =
            LaserLimits { max_on: options.laser_max_on, duty: options.laser_duty, window: options.laser_duty_window };
        let laser = LaserControl::new(laser, clock.clone(), log.clone(), &limits)?;
        model.validate()?;
        model.head_camera(0.0, 0.0).check_lens()?;
        options.settle.validate()?;
        options.frames.validate()?;
        let capabilities = ptz.capabilities();
        check_capabilities(&capabilities)?;
        Ok(Self {
            model,
            ptz,
            capabilities,
            laser,
            frames,
            clock,
            log,
            options,
            lit: None,
            approached: false,
            pictures: [Frame::empty(), Frame::empty()],
            rested: f64::NEG_INFINITY,
            closed: false,
        })
    }

    pub fn model(&self) -> &RigModel {
        &self.model
    }

    pub fn capabilities(&self) -> &PtzCapabilities {
        &self.capabilities
    }

    /// The head's brake, where it has one: stops it from any thread, beside another call.
    pub fn brake(&self) -> Option<Arc<dyn Brake>> {
        self.ptz.brake()
    }

    /// The laser's control, for an emergency stop from any thread.
    pub fn laser(&self) -> LaserControl {
        self.laser.clone()
    }

    /// Where the head is, as the device reads it.
    pub fn position(&mut self) -> Result<PtzPosition> {
        self.laser.enforce()?;
        settle::read_position(&mut *self.ptz)
    }

    /// Stops the head and switches the laser off. Works in every state and waits for nothing.
    pub fn stop(&mut self) -> Result<()> {
        self.lit = None;
        let off = self.laser.begin_move();
        let stopped = self.ptz.stop();
        self.approached = false;
        off.and(stopped)
    }

    /// Switches the laser by hand. It goes off by itself only when a call of this library notices
    /// that its longest time on is over: call [`LaserControl::enforce`] from a timer, or this again.
    ///
    /// # Errors
    /// `LaserRefused` while the head moves and after an emergency stop; the device's own.
    pub fn set_laser(&mut self, on: bool) -> Result<()> {
        if !on {
            self.lit = None;
            return self.laser.off();
        }
        self.laser.enforce()?;
        if self.lit.as_ref().is_some_and(|guard| guard.time_left().is_ok()) {
            return Ok(());
        }
        self.lit = None;
        self.laser.check_emergency()?;
        if !self.stands_still()? {
            return Err(Error::LaserRefused { reason: "the head is moving".into() });
        }
        self.laser.end_move();
        self.lit = Some(self.laser.light()?);
        Ok(())
    }

    /// Turns the head so that the laser's line passes through a point of the world (metres).
    ///
    /// # Errors
    /// As [`aim_at_point`] and [`move_to`](Self::move_to).
    pub fn aim_at_point(&mut self, point: &Vector3<f64>, cancel: &Cancel) -> Result<Aim> {
        let aim = aim_at_point(&self.model, point)?.turned_into(&self.model, self.capabilities.pan_range);
        self.move_to(aim.pan, aim.tilt, cancel)?;
        Ok(aim)
    }

    /// Aims the laser at what the head camera sees now at `pixel`, `depth` metres along its axis.
    ///
    /// # Errors
    /// As [`point_at_pixel`] and [`aim_at_point`](Self::aim_at_point).
    pub fn aim_at_pixel(&mut self, pixel: &Vector2<f64>, depth: f64, cancel: &Cancel) -> Result<Aim> {
        let at = self.position()?;
        let point = point_at_pixel(&self.model, at.pan, at.tilt, pixel, depth)?;
        self.aim_at_point(&point, cancel)
    }

    /// Stops the head and switches the laser off for good; says so when that failed.
    pub fn close(mut self) -> Result<()> {
        self.shut()
    }

    fn shut(&mut self) -> Result<()> {
        self.closed = true;
        let off = self.laser.close();
        self.lit = None;
        off.and(self.ptz.stop())
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        if !self.closed {
            // A laser that stays on is logged by its control.
            let _ = self.shut();
        }
    }
}

/// Refuses angles (device readings, radians) that the head cannot reach.
pub(crate) fn check_reach(capabilities: &PtzCapabilities, pan: f64, tilt: f64) -> Result<()> {
    for (name, angle, [low, high]) in [("pan", pan, capabilities.pan_range), ("tilt", tilt, capabilities.tilt_range)] {
        if !angle.is_finite() {
            return Err(Error::NotFinite { name, index: 0 });
        }
        if angle < low || angle > high {
            return Err(Error::Unreachable {
                reason: format!(
                    "{name} {angle:.4} rad ({:.2} deg) is outside the head's {low:.4} to {high:.4} rad ({:.2} to {:.2} deg)",
                    angle.to_degrees(),
                    low.to_degrees(),
                    high.to_degrees()
                ),
            });
        }
    }
    Ok(())
}

fn check_capabilities(capabilities: &PtzCapabilities) -> Result<()> {
    let PtzCapabilities { pan_range, tilt_range, pan_step, tilt_step, raw_units, .. } = *capabilities;
    if raw_units {
        return Err(Error::Unsupported {
            what: "a head whose pan and tilt are numbers without known angles: learn its angle map and open the rig \
                   with a MappedPtz"
                .into(),
        });
    }
    let ordered = |range: [f64; 2]| range.iter().all(|v| v.is_finite()) && range[0] <= range[1];
    let step = |v: f64| (0.0..1.0).contains(&v);
    if ordered(pan_range) && ordered(tilt_range) && step(pan_step) && step(tilt_step) {
        return Ok(());
    }
    Err(Error::Device { reason: format!("the head reports capabilities that make no sense: {capabilities:?}") })
}

#[cfg(test)]
mod tests;
