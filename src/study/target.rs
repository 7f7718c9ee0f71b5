//! Is the fixed camera sure enough by now? Asked while a scan is at work.

use nalgebra::{Matrix2, Vector2};

use super::expected::expected_of;
use super::information::{Accuracy, NoiseLevel};
use super::setup::{NoiselessShot, Site};
use crate::adjust::Prior;
use crate::calibrate::{CalibrationOptions, Correspondences, Observation, calibrate_camera};
use crate::error::{Error, Result};
use crate::geometry::{InverseDepthPoint, RIG_PARAMETERS, RigModel};

/// Shots before the first look.
const FIRST: usize = 20;

/// A shot that both cameras saw: readings (radians), spots (px) with covariances (px^2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenShot {
    pub pan: f64,
    pub tilt: f64,
    pub head: (Vector2<f64>, Matrix2<f64>),
    pub fixed: (Vector2<f64>, Matrix2<f64>),
}

/// Watches one fixed camera's accuracy during a scan, shot by shot.
#[derive(Debug, Clone)]
pub struct AccuracyWatch {
    pub rig: RigModel,
    /// How well the rig is known, in the order of [`RigParameter`](crate::geometry::RigParameter).
    pub rig_prior: Prior,
    /// Standard deviation of a move's pan and tilt, radians.
    pub pointing_sigma: [f64; 2],
    pub width: u32,
    pub height: u32,
    pub estimate: CalibrationOptions,
    /// Root mean square error of the position that is wanted, metres.
    pub target: f64,
    shots: Vec<SeenShot>,
    /// Shots at which it is looked at next: solving costs as much as all shots so far, so they grow by a tenth,
    /// and a shot costs the same on average however many there were.
    next: usize,
}

impl AccuracyWatch {
    /// For a rig that is known exactly.
    ///
    /// # Errors
    /// `InvalidArgument`: a target that is not positive, an image without size, a rig that is none.
    pub fn new(rig: RigModel, width: u32, height: u32, target: f64) -> Result<Self> {
        rig.validate()?;
        Correspondences::new(width, height)?;
        if !(target.is_finite() && target > 0.0) {
            return Err(Error::invalid("target", format!("{target} m")));
        }
        let (rig_prior, estimate) = (Prior::fixed(RIG_PARAMETERS), CalibrationOptions::default());
        let (pointing_sigma, shots) = ([0.0; 2], Vec::new());
        Ok(Self { rig, rig_prior, pointing_sigma, width, height, estimate, target, shots, next: FIRST })
    }

    /// Takes a shot in.
    pub fn add(&mut self, shot: SeenShot) {
        self.shots.push(shot);
    }

    /// Forgets all shots, but not after how many to look next.
    pub fn clear(&mut self) {
        self.shots.clear();
    }

    /// Shots so far.
    pub fn count(&self) -> usize {
        self.shots.len()
    }

    /// To be called after every shot: the accuracy once the target is met. While there are too few shots, or
    /// they do not determine the camera yet, it is not.
    ///
    /// # Errors
    /// `Cancelled`; what [`accuracy`](Self::accuracy) refuses for another reason than the geometry.
    pub fn reached(&mut self) -> Result<Option<Accuracy>> {
        let count = self.count();
        if count < self.next {
            return Ok(None);
        }
        self.next = count + (count / 10).max(1);
        match self.accuracy() {
            Ok(accuracy) => Ok(Some(accuracy).filter(|a| a.rms <= self.target)),
            Err(e @ (Error::Cancelled | Error::InvalidArgument { .. } | Error::NotFinite { .. })) => Err(e),
            Err(_) => Ok(None),
        }
    }

    /// Expected accuracy of the position: the camera is calibrated from the shots, and what the joint
    /// adjustment would make of those that agree is computed at its estimate, the rig's prior
    /// included.
    ///
    /// # Errors
    /// Those of [`calibrate_camera`]; `Degenerate`.
    pub fn accuracy(&self) -> Result<Accuracy> {
        let shots = &self.shots;
        let mut set = Correspondences::new(self.width, self.height)?;
        let mut depths = Vec::with_capacity(shots.len());
        for s in shots {
            let shot: InverseDepthPoint = self.rig.measure(s.pan, s.tilt, &s.head.0, &s.head.1)?.point;
            depths.push(1.0 / shot.rho);
            set.add(Observation::Shot { shot, pixel: s.fixed.0, pixel_covariance: s.fixed.1 })?;
        }
        let found = calibrate_camera(&set, &self.estimate)?;
        let site = Site {
            rig_prior: self.rig_prior.clone(),
            pointing_sigma: self.pointing_sigma,
            estimate: self.estimate.clone(),
            ..Site::new(self.rig, found.camera)
        };
        let used: Vec<NoiselessShot> = shots
            .iter()
            .zip(&depths)
            .zip(&found.inliers)
            .filter(|((_, depth), inlier)| **inlier && **depth > 0.0)
            .filter_map(|((s, depth), _)| site.shot(s.pan, s.tilt, *depth))
            .collect();
        let deviation = |of: fn(&SeenShot) -> Matrix2<f64>| {
            let mean = shots.iter().map(|s| of(s).determinant().sqrt()).sum::<f64>() / shots.len() as f64;
            mean.sqrt() * found.noise_factor.max(1.0)
        };
        let level = NoiseLevel { head: deviation(|s| s.head.1), fixed: deviation(|s| s.fixed.1) };
        Ok(expected_of(&site, &used, &level, &[])?.position)
    }
}
