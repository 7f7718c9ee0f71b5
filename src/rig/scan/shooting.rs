//! One shot: the head goes there, frames are taken with the laser off and on, the spot is found in all.

use super::super::gate::{Search, on_epipolar_line};
use super::super::shot::{Miss, Shot, Sighting, spot_covariance};
use super::Scanner;
use crate::control::LogLevel;
use crate::detect::spot::{Band, SpotOptions, detect_spot};
use crate::device::PtzCapabilities;
use crate::error::{Error, Result};

/// Between two looks for a lost device, seconds.
const RECONNECT_PAUSE: f64 = 1.0;

/// Is a device gone that may come back?
fn is_lost(error: &Error) -> bool {
    matches!(error, Error::DeviceLost { .. } | Error::DeviceNotFound { .. })
}

impl Scanner<'_> {
    /// Takes a shot, again when a device fails and may recover, and when a lost one comes back. Between
    /// attempts the laser is off and the head stands, where it can be told to.
    pub(in crate::rig) fn take(&mut self, index: u32) -> Result<Shot> {
        let (mut attempt, mut lost_since) = (1, None);
        loop {
            self.options.cancel.check()?;
            self.rig.laser.check_emergency()?;
            let error = match self.try_shot(index) {
                Ok(shot) => return Ok(shot),
                Err(error) => error,
            };
            let stopped = self.rig.stop();
            if self.options.reconnect > 0.0 && is_lost(&error) && self.rig.laser.fault().is_none() {
                let now = self.rig.clock.now();
                let since = *lost_since.get_or_insert(now);
                if now - since < self.options.reconnect {
                    self.rig.log.write(LogLevel::Warning, || format!("position {index}: {error}; waiting for it"));
                    self.pause(RECONNECT_PAUSE)?;
                    continue;
                }
            }
            let may_recover = matches!(
                error,
                Error::Device { .. }
                    | Error::DeviceTimeout { .. }
                    | Error::DeviceGarbled { .. }
                    | Error::DeviceRefused { .. }
            );
            if attempt == self.options.attempts || !may_recover || stopped.is_err() {
                return Err(error);
            }
            self.rig.log.write(LogLevel::Warning, || format!("position {index}, attempt {attempt}: {error}"));
            attempt += 1;
        }
    }

    /// Lets time pass, and hears a cancel meanwhile.
    fn pause(&self, seconds: f64) -> Result<()> {
        for _ in 0..10 {
            self.options.cancel.check()?;
            self.rig.clock.sleep(0.1 * seconds);
        }
        Ok(())
    }

    fn try_shot(&mut self, index: u32) -> Result<Shot> {
        let (pan, tilt) = self.scan.region.position(index);
        let (pan, tilt) = whole_steps(&self.rig.capabilities, pan, tilt);
        let position = self.rig.move_to(pan, tilt, &self.options.cancel)?;
        if self.scan.shots.first().is_some_and(|first| (first.zoom - position.zoom).abs() > 1e-3) {
            return Err(Error::Device { reason: "the zoom has changed: the rig's model does not hold".into() });
        }
        // A shot that begins with less than it needs would be cut short. Half as much again, for frames
        // that come late.
        self.rig.laser.wait_until_allowed(1.5 * self.longest_on, &self.options.cancel)?;
        self.exposures.take_off(self.rig, self.fixed, &self.options.cancel)?;
        let light = self.rig.laser.light()?;
        let time = self.rig.clock.now();
        let lit = time + self.options.laser_latency;
        self.exposures.take_on(self.rig, self.fixed, &self.options.cancel, &light, lit)?;
        light.off()?;
        self.longest_on = self.longest_on.max(self.rig.clock.now() - time);
        let after = self.rig.position()?;
        let [pan_tolerance, tilt_tolerance] = self.rig.tolerances();
        if (after.pan - position.pan).abs() > pan_tolerance || (after.tilt - position.tilt).abs() > tilt_tolerance {
            return Err(Error::Device { reason: "the head was moved during a shot".into() });
        }
        if let Some(recorder) = &mut self.recorder {
            let views = |camera| self.exposures.views(camera).map(|(on, off)| (off, on));
            let frames = (0..=self.fixed.len()).map(views).collect::<Result<Vec<_>>>()?;
            recorder.add(position, &frames)?;
        }
        let mut shot = Shot {
            index,
            pan: position.pan,
            tilt: position.tilt,
            zoom: position.zoom,
            time,
            head: self.find_in_head()?,
            fixed: Vec::with_capacity(self.fixed.len()),
            colour: [0; 3],
            point: None,
        };
        shot.locate(&self.scan.model);
        if let Ok(spot) = &shot.head {
            shot.colour = self.exposures.colour(spot.x, spot.y)?;
        }
        for camera in 0..self.fixed.len() {
            let sighting = self.find_in_fixed(camera, &shot)?;
            shot.fixed.push(sighting);
        }
        Ok(shot)
    }

    fn find_in_head(&self) -> Result<Sighting> {
        let found = self.detect(0, Some(self.head_band.clone()))?;
        let reflection = found.is_ok_and(|spot| !on_epipolar_line(&self.scan.model, &spot, &self.options.gate));
        Ok(if reflection { Err(Miss::OffEpipolarLine) } else { found })
    }

    fn find_in_fixed(&self, camera: usize, shot: &Shot) -> Result<Sighting> {
        let laser = self.scan.model.laser_in_world(shot.pan, shot.tilt);
        let point = shot.point.map(|depth| depth.point);
        match self.gates[camera].search(point.as_ref(), laser, &self.options.gate) {
            Search::OutsideView => Ok(Err(Miss::OutsideView)),
            Search::Everywhere => self.detect(1 + camera, None),
            Search::Band(band) => self.detect(1 + camera, Some(band)),
        }
    }

    fn detect(&self, camera: usize, band: Option<Band>) -> Result<Sighting> {
        let (on, off) = self.exposures.views(camera)?;
        let options = SpotOptions { region: None, band, ..self.options.spot.clone() };
        match detect_spot(&on, &off, &options) {
            // What is of no use later is not found.
            Ok(spot) if spot_covariance(&spot).cholesky().is_none() => Ok(Err(Miss::NotFound)),
            Ok(spot) => Ok(Ok(spot)),
            Err(Error::NotFound { .. }) => Ok(Err(Miss::NotFound)),
            Err(Error::Ambiguous { .. }) => Ok(Err(Miss::Ambiguous)),
            Err(error) => Err(error),
        }
    }
}

/// The nearest position on whole encoder steps: between two steps the reading is a toss-up, and off by
/// a step where it lands on the wrong one; on a step it is exact (maths.md section 6).
fn whole_steps(capabilities: &PtzCapabilities, pan: f64, tilt: f64) -> (f64, f64) {
    let snap = |angle: f64, step: f64, [low, high]: [f64; 2]| {
        let snapped = if step > 0.0 { (angle / step).round() * step } else { angle };
        if (low..=high).contains(&snapped) { snapped } else { angle }
    };
    (
        snap(pan, capabilities.pan_step, capabilities.pan_range),
        snap(tilt, capabilities.tilt_step, capabilities.tilt_range),
    )
}
