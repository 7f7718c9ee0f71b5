//! What a scan learns of the fixed cameras on its way: where to look for their spots, and whether they are
//! known well enough.

use nalgebra::Vector2;

use super::super::RigModel;
use super::super::acquire::FixedCamera;
use super::super::gate::Gate;
use super::super::shot::{Miss, Shot, correspondences, spot_covariance};
use super::{ScanOptions, Scanner};
use crate::calibrate::{CalibrationOptions, calibrate_camera};
use crate::control::LogLevel;
use crate::detect::spot::Spot;
use crate::error::{Error, Result};
use crate::study::{AccuracyWatch, SeenShot};

/// A calibration is not tried again with fewer than twice as many shots.
const MIN_CALIBRATION_SHOTS: usize = 8;

/// How well a fixed camera is known.
pub(super) struct Watched {
    watch: AccuracyWatch,
    /// The scan's shots that it was told of.
    told: usize,
    met: bool,
}

pub(super) fn watch(model: &RigModel, camera: &FixedCamera, options: &ScanOptions) -> Result<Watched> {
    let mut watch = AccuracyWatch::new(*model, camera.width, camera.height, options.target_accuracy)?;
    watch.estimate.distortion = camera.distortion;
    watch.estimate.cancel = options.cancel.clone();
    Ok(Watched { watch, told: 0, met: false })
}

impl Scanner<'_> {
    /// Are all fixed cameras known as well as is wanted?
    pub(super) fn target_is_met(&mut self) -> Result<bool> {
        for (camera, Watched { watch, told, met }) in self.watches.iter_mut().enumerate().filter(|(_, w)| !w.met) {
            let seen = |shot: &Shot| {
                let (head, fixed) = (shot.head.ok()?, shot.fixed[camera].ok()?);
                let spot = |s: &Spot| (Vector2::new(s.x, s.y), spot_covariance(s));
                shot.point?;
                Some(SeenShot { pan: shot.pan, tilt: shot.tilt, head: spot(&head), fixed: spot(&fixed) })
            };
            let fresh = self.scan.shots.iter().skip(*told);
            fresh.filter_map(seen).for_each(|shot| watch.add(shot));
            *told = self.scan.shots.len();
            let Some(accuracy) = watch.reached()? else { continue };
            self.rig.log.write(LogLevel::Info, || {
                format!("fixed camera {camera}: known to {:.2} mm after {} shots", 1e3 * accuracy.rms, watch.count())
            });
            *met = true;
        }
        Ok(!self.watches.is_empty() && self.watches.iter().all(|w| w.met))
    }

    /// Calibrates the cameras that are not known, to know where to look, and marks the coarse spots
    /// that contradict it. A camera whose coarse shots do not suffice is searched over its whole
    /// frames until more have come.
    pub(super) fn calibrate_with_coarse(&mut self, coarse: &[u32]) -> Result<()> {
        let mut is_coarse = vec![false; self.scan.region.len()];
        coarse.iter().for_each(|index| is_coarse[*index as usize] = true);
        for camera in 0..self.fixed.len() {
            self.calibrate(camera, |shot| is_coarse[shot.index as usize])?;
            self.mark(camera);
        }
        Ok(())
    }

    /// Tries cameras again that could not be calibrated, whenever they have twice as many spots.
    pub(super) fn calibrate_latecomers(&mut self) -> Result<()> {
        for camera in 0..self.fixed.len() {
            if matches!(self.gates[camera], Gate::Unknown)
                && self.sighted[camera] >= 2 * self.tried_with[camera].max(MIN_CALIBRATION_SHOTS)
            {
                self.calibrate(camera, |_| true)?;
                self.mark(camera);
            }
        }
        Ok(())
    }

    fn calibrate(&mut self, camera: usize, wanted: impl Fn(&Shot) -> bool) -> Result<()> {
        if !matches!(self.gates[camera], Gate::Unknown) {
            return Ok(());
        }
        // In the order of positions, so that a resumed scan gets the same calibration.
        let mut shots: Vec<&Shot> = self.scan.shots.iter().filter(|shot| wanted(shot)).collect();
        shots.sort_by_key(|shot| shot.index);
        let FixedCamera { width, height, distortion, .. } = self.fixed[camera];
        let set = correspondences(shots.into_iter(), camera, width, height)?;
        self.tried_with[camera] = set.len();
        let options =
            CalibrationOptions { distortion, cancel: self.options.cancel.clone(), ..CalibrationOptions::default() };
        match calibrate_camera(&set, &options) {
            Ok(calibration) => {
                self.rig.log.write(LogLevel::Info, || {
                    let used = calibration.inliers.iter().filter(|inlier| **inlier).count();
                    format!(
                        "fixed camera {camera}: calibrated from {used} of {} shots, to know where to look",
                        set.len()
                    )
                });
                self.scan.search_calibrations[camera] = Some(calibration.clone());
                self.gates[camera] = Gate::Calibrated(Box::new(calibration));
            }
            Err(Error::Cancelled) => return Err(Error::Cancelled),
            Err(error) => self.rig.log.write(LogLevel::Warning, || {
                format!(
                    "fixed camera {camera}: whole frames are searched on; {} shots do not calibrate it: {error}",
                    set.len()
                )
            }),
        }
        Ok(())
    }

    /// Marks the spots of a camera that contradict what is known of it now.
    fn mark(&mut self, camera: usize) {
        for shot in &mut self.scan.shots {
            let (Some(depth), Ok(spot)) = (shot.point, shot.fixed[camera]) else { continue };
            if !self.gates[camera].accepts(&spot, &depth.point, &self.options.gate) {
                shot.fixed[camera] = Err(Miss::OffPrediction);
            }
        }
        // What it was told may not be true any more.
        if let Some(watched) = self.watches.get_mut(camera) {
            watched.watch.clear();
            watched.told = 0;
        }
    }
}
