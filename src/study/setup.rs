//! A set-up to study: rig, fixed camera, and the noiseless shots that both see (thesis VII.2).

use nalgebra::{Vector2, Vector3};

use super::scene::Scene;
use crate::adjust::Prior;
use crate::calibrate::{CalibrationOptions, DistortionModel};
use crate::error::{Error, Result};
use crate::geometry::{Camera, Distortion, RIG_PARAMETERS, RigModel};
use crate::rig::{ScanRegion, aim_at_point};

/// Most shots of a set-up.
pub const MAX_SHOTS: usize = 1_000_000;

/// One shot without noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiselessShot {
    /// The device's readings, radians.
    pub pan: f64,
    pub tilt: f64,
    /// Along the head camera's axis, metres.
    pub depth: f64,
    /// The lit point in the rig's frame, metres.
    pub point: Vector3<f64>,
    /// Its pixels in the head camera and in the fixed one.
    pub head: Vector2<f64>,
    pub fixed: Vector2<f64>,
}

/// What is known of rig and camera, and how the camera is estimated.
#[derive(Debug, Clone)]
pub struct Site {
    /// As it is believed to be.
    pub rig: RigModel,
    /// How well that is known, in the order of [`RigParameter`](crate::geometry::RigParameter).
    pub rig_prior: Prior,
    /// Standard deviation of a move's pan and tilt about the encoders' readings, radians.
    pub pointing_sigma: [f64; 2],
    /// The fixed camera: the truth of a study, a guess for a plan. Its pose is in the rig's frame.
    pub camera: Camera,
    /// Lens model, fixed lens, priors on skew and aspect; the rest is not used.
    pub estimate: CalibrationOptions,
}

impl Site {
    /// A rig that is known exactly, and a camera whose lens is found with it, with the lens model that
    /// the camera has.
    pub fn new(rig: RigModel, camera: Camera) -> Self {
        let distortion = match camera.distortion {
            Distortion::None => DistortionModel::None,
            Distortion::BrownConrady(_) => DistortionModel::BrownConrady,
            Distortion::Division(_) => DistortionModel::Division,
            Distortion::Fisheye(_) => DistortionModel::Fisheye,
        };
        let estimate = CalibrationOptions { distortion, ..CalibrationOptions::default() };
        Self { rig, rig_prior: Prior::fixed(RIG_PARAMETERS), pointing_sigma: [0.0; 2], camera, estimate }
    }

    /// # Errors
    /// `InvalidArgument`, `NotFinite`: a model, prior or deviation that is none.
    pub fn validate(&self) -> Result<()> {
        self.rig.validate()?;
        self.camera.validate()?;
        self.camera.check_lens()?;
        self.estimate.validate()?;
        if self.rig_prior.count() != RIG_PARAMETERS {
            let detail = format!("of {} parameters, a rig has {RIG_PARAMETERS}", self.rig_prior.count());
            return Err(Error::invalid("rig prior", detail));
        }
        let fitted = crate::calibrate::freedom::blank_distortion(self.estimate.distortion);
        let held = self.estimate.fixed_lens.is_some();
        if !held && std::mem::discriminant(&fitted) != std::mem::discriminant(&self.camera.distortion) {
            return Err(Error::invalid("distortion", "the lens model to fit is not the camera's"));
        }
        for s in self.pointing_sigma {
            if !(s.is_finite() && s >= 0.0) {
                return Err(Error::invalid("pointing_sigma", format!("{s} is no standard deviation")));
            }
        }
        Ok(())
    }

    /// The shot at these readings that meets a surface at `depth`, where both cameras see it.
    pub fn shot(&self, pan: f64, tilt: f64, depth: f64) -> Option<NoiselessShot> {
        let (origin, direction) = self.rig.laser_in_world(pan, tilt);
        let point = origin + direction * depth;
        let head = self.rig.spot_pixel(1.0 / depth)?;
        let inside = self.rig.head_camera(pan, tilt).contains(&head);
        let fixed = self.camera.project(&point).filter(|m| self.camera.contains(m))?;
        inside.then_some(NoiselessShot { pan, tilt, depth, point, head, fixed })
    }

    /// What a scan of the region would see: of its positions those whose spot both cameras have in view.
    pub fn scan(&self, region: &ScanRegion, scene: &Scene) -> Vec<NoiselessShot> {
        let centre = self.camera.centre();
        let shot = |index: usize| {
            let (pan, tilt) = region.position(index as u32);
            let (origin, direction) = self.rig.laser_in_world(pan, tilt);
            let shot = self.shot(pan, tilt, scene.depth(&origin, &direction, index)?)?;
            (!scene.hides(&centre, &shot.point)).then_some(shot)
        };
        (0..region.len()).filter_map(shot).collect()
    }
}

/// A site with its noiseless shots.
#[derive(Debug, Clone)]
pub struct SetUp {
    pub site: Site,
    pub shots: Vec<NoiselessShot>,
    /// Points in the rig's frame from which the printed cascade finds the head camera's pose: the
    /// corners of the thesis's boards. Only [`Method::DltCascadePrinted`](super::Method) needs them.
    pub control: Vec<Vector3<f64>>,
}

impl SetUp {
    /// From models alone.
    ///
    /// # Errors
    /// Those of [`Site::validate`], [`ScanRegion::validate`], [`Scene::validate`]; `TooFewPoints` when
    /// fewer than six positions are seen by both cameras.
    pub fn from_scene(site: Site, region: &ScanRegion, scene: &Scene) -> Result<Self> {
        site.validate()?;
        region.validate()?;
        scene.validate()?;
        let shots = site.scan(region, scene);
        Self::new(site, shots)
    }

    /// From a scan: readings of pan and tilt with the depth that was measured there, the camera as it
    /// was calibrated. The points are taken for true, and projected anew (eqs (17), (18)); those that
    /// are not in view of both cameras are left out.
    ///
    /// # Errors
    /// Those of [`Site::validate`]; `NotFinite`, `InvalidArgument` for a depth that is not positive;
    /// `TooFewPoints`.
    pub fn from_scan(site: Site, scanned: &[[f64; 3]]) -> Result<Self> {
        site.validate()?;
        if scanned.len() > MAX_SHOTS {
            return Err(Error::invalid("shots", format!("{}; {MAX_SHOTS} are possible", scanned.len())));
        }
        if let Some(index) = scanned.iter().position(|s| s.iter().any(|v| !v.is_finite())) {
            return Err(Error::NotFinite { name: "shots", index });
        }
        if let Some([_, _, depth]) = scanned.iter().find(|[.., depth]| *depth <= 0.0) {
            return Err(Error::invalid("shots", format!("a depth of {depth} m")));
        }
        let shots = scanned.iter().filter_map(|&[pan, tilt, depth]| site.shot(pan, tilt, depth)).collect();
        Self::new(site, shots)
    }

    /// From points in the rig's frame (metres) at which the laser is aimed; those out of its reach or not in
    /// view of both cameras are left out.
    ///
    /// # Errors
    /// Those of [`Site::validate`]; `NotFinite`, `InvalidArgument` for too many, `TooFewPoints`.
    pub fn from_points(site: Site, points: &[Vector3<f64>]) -> Result<Self> {
        site.validate()?;
        if points.len() > MAX_SHOTS {
            return Err(Error::invalid("points", format!("{}; {MAX_SHOTS} are possible", points.len())));
        }
        if let Some(index) = points.iter().position(|x| x.iter().any(|v| !v.is_finite())) {
            return Err(Error::NotFinite { name: "points", index });
        }
        let aimed = |x| aim_at_point(&site.rig, x).ok();
        let shots = points.iter().filter_map(aimed).filter_map(|a| site.shot(a.pan, a.tilt, a.depth)).collect();
        Self::new(site, shots)
    }

    fn new(site: Site, shots: Vec<NoiselessShot>) -> Result<Self> {
        if shots.len() < crate::calibrate::dlt::MIN_POINTS {
            let needed = crate::calibrate::dlt::MIN_POINTS;
            return Err(Error::TooFewPoints { given: shots.len(), needed });
        }
        Ok(Self { site, shots, control: Vec::new() })
    }

    /// The same with the shots up to a depth only.
    pub fn within(&self, depth: f64) -> Self {
        let shots = self.shots.iter().filter(|s| s.depth <= depth).copied().collect();
        Self { site: self.site.clone(), shots, control: self.control.clone() }
    }
}
