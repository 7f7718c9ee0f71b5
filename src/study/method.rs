//! The estimators that a study compares, each from the same noisy measurements.

use nalgebra::{Matrix2, Vector2};

use super::information::{LEAST_NOISE, NoiseLevel};
use super::normals::Normals;
use super::setup::{NoiselessShot, Site};
use crate::adjust::{AdjustOptions, Adjustment, CameraSetup, Shot, Sighting, Station, adjust};
use crate::calibrate::{CalibrationOptions, Correspondences, Observation, calibrate_camera, decompose, dlt};
use crate::control::Cancel;
use crate::error::{Error, Result};
use crate::geometry::{Camera, Distortion, InverseDepthPoint, RIG_PARAMETERS, RigModel};

/// How the fixed camera is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u32)]
pub enum Method {
    /// DLT-Points from exact 3D points: no cascade (thesis VII, case (i)).
    DltExact = 0,
    /// Eq. (23) as printed: exact points moved by the head camera's noisy pose, then DLT-Points. A rigid
    /// motion of exact points, which says little of a laser rig (docs/maths.md section 2).
    DltCascadePrinted = 1,
    /// The cascade in its right form: noisy spots give noisy points (eqs (14)-(16)), then DLT-Points.
    DltCascade = 2,
    /// The closed form in inverse depth, weighted by the noise (docs/maths.md section 9.2).
    ClosedForm = 3,
    /// Maximum likelihood, one inverse depth for each shot, with the priors of rig and pointing.
    JointMl = 4,
}

impl Method {
    pub const ALL: [Self; 5] =
        [Self::DltExact, Self::DltCascadePrinted, Self::DltCascade, Self::ClosedForm, Self::JointMl];

    pub fn name(self) -> &'static str {
        match self {
            Self::DltExact => "DLT, exact points",
            Self::DltCascadePrinted => "DLT, cascade as printed",
            Self::DltCascade => "DLT, cascade",
            Self::ClosedForm => "closed form",
            Self::JointMl => "joint ML",
        }
    }

    /// Is it estimated from laser shots, rather than from exact points?
    pub(super) fn takes_shots(self) -> bool {
        matches!(self, Self::DltCascade | Self::ClosedForm | Self::JointMl)
    }
}

/// One trial's noise of all shots, unit variance, and the rig as it truly is then.
pub(super) struct ShotNoise {
    head: Vec<[f64; 2]>,
    fixed: Vec<[f64; 2]>,
    pointing: Vec<[f64; 2]>,
    rig: RigModel,
}

impl ShotNoise {
    /// `step`: the true rig's parameters less the believed ones.
    pub fn draw(site: &Site, shots: usize, step: &[f64; RIG_PARAMETERS], normals: &mut Normals) -> Self {
        let (head, fixed) = (normals.pairs(shots), normals.pairs(shots));
        Self { head, fixed, pointing: normals.pairs(shots), rig: site.rig.moved(step) }
    }

    /// What both cameras measure; shots that they cannot are left out.
    pub fn measure(&self, site: &Site, shots: &[NoiselessShot], level: &NoiseLevel) -> Vec<Measured> {
        let exact = self.rig == site.rig && site.pointing_sigma == [0.0; 2];
        let measured = |(i, shot): (usize, &NoiselessShot)| {
            let (mut head, mut fixed) = (shot.head, shot.fixed);
            if !exact {
                let turned = [0, 1].map(|k| site.pointing_sigma[k] * self.pointing[i][k]);
                let ray = self.rig.laser_ray(shot.pan, shot.tilt, turned);
                head = self.rig.spot_pixel(1.0 / shot.depth)?;
                fixed = site.camera.project(&(ray.origin + ray.direction * shot.depth))?;
            }
            let head = head + Vector2::from(self.head[i]) * level.head;
            let fixed = fixed + Vector2::from(self.fixed[i]) * level.fixed;
            let shot_point = site.rig.measure(shot.pan, shot.tilt, &head, &variance(level.head)).ok()?.point;
            Some(Measured { shot: *shot, point: shot_point, head, fixed })
        };
        shots.iter().enumerate().filter_map(measured).collect()
    }
}

/// One shot with noise.
pub(super) struct Measured {
    shot: NoiselessShot,
    point: InverseDepthPoint,
    head: Vector2<f64>,
    fixed: Vector2<f64>,
}

fn variance(sigma: f64) -> Matrix2<f64> {
    let sigma = sigma.max(LEAST_NOISE);
    Matrix2::identity() * (sigma * sigma)
}

/// The camera by a method that takes shots.
pub(super) fn estimate(
    method: Method,
    site: &Site,
    measured: &[Measured],
    level: &NoiseLevel,
    depths: [f64; 2],
    cancel: &Cancel,
) -> Result<Camera> {
    match method {
        Method::DltCascade => {
            // Depths that no user would take for true: maths.md gates them in the same way.
            let kept = |m: &&Measured| (depths[0] / 3.0..depths[1] * 3.0).contains(&(1.0 / m.point.rho));
            let (world, pixels): (Vec<_>, Vec<_>) =
                measured.iter().filter(kept).filter_map(|m| Some((m.point.point()?, m.fixed))).unzip();
            pinhole(site, &dlt::points(&world, &pixels)?)
        }
        Method::ClosedForm => pinhole(site, &dlt::closed_form(&correspondences(site, measured, level)?)?),
        _ if site.rig_prior.covariance().iter().all(|v| *v == 0.0) && site.pointing_sigma == [0.0; 2] => {
            let options = CalibrationOptions {
                robust: false,
                max_focal_deviation: f64::INFINITY,
                cancel: cancel.clone(),
                ..site.estimate.clone()
            };
            Ok(calibrate_camera(&correspondences(site, measured, level)?, &options)?.camera)
        }
        _ => jointly(site, measured, level, cancel),
    }
}

/// A projection matrix as a camera without distortion.
pub(super) fn pinhole(site: &Site, p: &nalgebra::Matrix3x4<f64>) -> Result<Camera> {
    let (intrinsics, pose) = decompose::decompose(p)?;
    Ok(Camera { intrinsics, pose, distortion: Distortion::None, ..site.camera })
}

fn correspondences(site: &Site, measured: &[Measured], level: &NoiseLevel) -> Result<Correspondences> {
    let mut set = Correspondences::new(site.camera.width, site.camera.height)?;
    let pixel_covariance = variance(level.fixed);
    for m in measured {
        set.add(Observation::Shot { shot: m.point, pixel: m.fixed, pixel_covariance })?;
    }
    Ok(set)
}

/// With the rig's parameters, under their prior, and the pointing of every shot.
fn jointly(site: &Site, measured: &[Measured], level: &NoiseLevel, cancel: &Cancel) -> Result<Camera> {
    let mut survey = Adjustment::new(site.rig)?;
    survey.set_rig_prior(site.rig_prior.clone())?;
    let station = survey.add_station(Station::world())?;
    let (width, height) = (site.camera.width, site.camera.height);
    let camera = survey.add_camera(CameraSetup {
        distortion: site.estimate.distortion,
        fixed_lens: site.estimate.fixed_lens,
        skew_sigma: site.estimate.skew_sigma,
        aspect_sigma: site.estimate.aspect_sigma,
        ..CameraSetup::new(width, height)
    })?;
    survey.add_shots(measured.iter().map(|m| Shot {
        station,
        pan: m.shot.pan,
        tilt: m.shot.tilt,
        head: Some((m.head, variance(level.head))),
        sightings: vec![Sighting { camera, pixel: m.fixed, covariance: variance(level.fixed) }],
    }))?;
    let options = AdjustOptions {
        pointing_sigma: site.pointing_sigma,
        robust: false,
        huber: f64::INFINITY,
        max_focal_deviation: f64::INFINITY,
        cancel: cancel.clone(),
        ..AdjustOptions::default()
    };
    let adjusted = adjust(&survey, &options)?;
    let none = || Error::Internal { reason: "an adjustment without its camera".into() };
    Ok(adjusted.cameras.first().ok_or_else(none)?.camera)
}
