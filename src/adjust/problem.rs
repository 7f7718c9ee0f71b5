//! What goes into a joint adjustment.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, Matrix2, Vector2};

use super::prior::Prior;
use crate::calibrate::{Calibration, DistortionModel};
use crate::control::Cancel;
use crate::error::{Error, Result};
use crate::geometry::{Camera, Distortion, Intrinsics, RIG_PARAMETERS, RigModel, RigParameter, Rigid};

/// Largest coordinate that is taken for one, in metres or pixels.
const MAX_COORDINATE: f64 = 1e12;

/// A place where the rig stood.
#[derive(Debug, Clone, PartialEq)]
pub struct Station {
    /// Station frame (the rig's at pan = tilt = 0) to world: x_world = R x_station + t. `None`: found
    /// from cameras that another station calibrates too.
    pub pose: Option<Rigid>,
    /// Of the rotation w in `R <- exp([w]x) R` (world axes, radians), then the position (metres).
    pub prior: Prior,
}

impl Station {
    /// The station whose frame is the world.
    pub fn world() -> Self {
        Self { pose: Some(Rigid::identity()), prior: Prior::fixed(6) }
    }

    /// A station of which nothing is known.
    pub fn unknown() -> Self {
        Self { pose: None, prior: Prior::free(6) }
    }
}

/// A fixed camera to calibrate, and what is known of it.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraSetup {
    pub width: u32,
    pub height: u32,
    pub distortion: DistortionModel,
    /// Keep this lens.
    pub fixed_lens: Option<(Intrinsics, Distortion)>,
    /// Prior standard deviation of skew / f about 0; 0 forces 0, infinity frees it.
    pub skew_sigma: f64,
    /// Prior standard deviation of fx / fy about 1; 0 forces 1, infinity frees it.
    pub aspect_sigma: f64,
    /// An earlier calibration: the camera and the covariance of its parameters, in the order of
    /// [`Calibration::covariance`](crate::calibrate::Calibration::covariance).
    pub prior: Option<(Camera, Prior)>,
}

impl CameraSetup {
    /// All that [`CalibrationOptions`](crate::calibrate::CalibrationOptions) say by default.
    pub fn new(width: u32, height: u32) -> Self {
        let defaults = crate::calibrate::CalibrationOptions::default();
        Self {
            width,
            height,
            distortion: defaults.distortion,
            fixed_lens: None,
            skew_sigma: defaults.skew_sigma,
            aspect_sigma: defaults.aspect_sigma,
            prior: None,
        }
    }

    /// A camera that is known already: `prior` says how well, in the order of
    /// [`Calibration::covariance`]. Nothing else is believed of its skew and aspect.
    pub fn known(camera: Camera, prior: Prior) -> Self {
        let distortion = match camera.distortion {
            Distortion::None => DistortionModel::None,
            Distortion::BrownConrady(_) => DistortionModel::BrownConrady,
            Distortion::Division(_) => DistortionModel::Division,
            Distortion::Fisheye(_) => DistortionModel::Fisheye,
        };
        Self {
            distortion,
            skew_sigma: f64::INFINITY,
            aspect_sigma: f64::INFINITY,
            prior: Some((camera, prior)),
            ..Self::new(camera.width, camera.height)
        }
    }

    /// A camera as an earlier calibration left it, from other measurements than those to come; what
    /// was fixed there stays fixed.
    pub fn calibrated(earlier: &Calibration) -> Self {
        let mut covariance = earlier.covariance.clone();
        // Square pixels were forced: fx and fy are one unknown, whose variance must not count twice.
        let difference = covariance[(0, 0)] + covariance[(1, 1)] - 2.0 * covariance[(0, 1)];
        let square = covariance[(0, 0)] > 0.0 && difference.abs() <= 1e-12 * covariance[(0, 0)];
        if square {
            covariance.row_mut(1).fill(0.0);
            covariance.column_mut(1).fill(0.0);
        }
        let known = Self::known(earlier.camera, Prior::of_covariance(covariance));
        if square { Self { aspect_sigma: 0.0, ..known } } else { known }
    }
}

/// A spot in a fixed camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighting {
    pub camera: usize,
    pub pixel: Vector2<f64>,
    /// px^2.
    pub covariance: Matrix2<f64>,
}

/// One laser shot with all who saw it.
#[derive(Debug, Clone, PartialEq)]
pub struct Shot {
    pub station: usize,
    /// The device's readings, radians.
    pub pan: f64,
    pub tilt: f64,
    /// The spot in the head camera with its covariance (px^2); `None`: not seen there.
    pub head: Option<(Vector2<f64>, Matrix2<f64>)>,
    pub sightings: Vec<Sighting>,
}

/// How an adjustment is solved. [`Default`] is right for detected spots.
#[derive(Debug, Clone)]
pub struct AdjustOptions {
    /// Standard deviation of a single move's pan and tilt about the encoders' readings, radians:
    /// repeatability and quantisation. 0: none.
    pub pointing_sigma: [f64; 2],
    /// Find and set aside gross outliers.
    pub robust: bool,
    /// Residuals longer than this many standard deviations count linearly (Huber 1964); infinity:
    /// least squares.
    pub huber: f64,
    /// Refuse when a camera's focal length has a larger relative standard deviation.
    pub max_focal_deviation: f64,
    /// Refuse when a free station's rotation is determined worse than this (radians), or its position
    /// worse than this share of the median range of its shots.
    pub max_station_deviation: f64,
    /// Seed of the consensus that starts each camera.
    pub seed: u64,
    pub max_iterations: usize,
    pub cancel: Cancel,
}

impl Default for AdjustOptions {
    fn default() -> Self {
        Self {
            pointing_sigma: [0.0; 2],
            robust: true,
            huber: 3.0,
            max_focal_deviation: 0.1,
            max_station_deviation: 0.1,
            seed: 1,
            max_iterations: 100,
            cancel: Cancel::new(),
        }
    }
}

/// All measurements of a survey with the priors of its unknowns.
#[derive(Debug, Clone, PartialEq)]
pub struct Adjustment {
    rig: RigModel,
    rig_prior: Prior,
    stations: Vec<Station>,
    cameras: Vec<CameraSetup>,
    shots: Vec<Shot>,
    /// Per plane, how far its surface strays from it: standard deviation, metres.
    planes: Vec<f64>,
    /// Shots that hit a plane, with the plane.
    hits: BTreeMap<usize, usize>,
}

impl Adjustment {
    /// A survey with a rig that is known exactly, until [`set_rig_prior`](Self::set_rig_prior) says
    /// otherwise.
    pub fn new(rig: RigModel) -> Result<Self> {
        rig.validate()?;
        let rig_prior = Prior::fixed(RIG_PARAMETERS);
        let (stations, cameras, shots, planes) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Ok(Self { rig, rig_prior, stations, cameras, shots, planes, hits: BTreeMap::new() })
    }

    /// How well the rig's parameters are known, in the order of [`RigParameter`].
    pub fn set_rig_prior(&mut self, prior: Prior) -> Result<()> {
        if prior.count() != RIG_PARAMETERS {
            return Err(Error::invalid("prior", format!("of {} parameters, a rig has 15", prior.count())));
        }
        prior.belief(rig_name)?;
        self.rig_prior = prior;
        Ok(())
    }

    /// Adds a station; returns its index. The first is usually [`Station::world`].
    pub fn add_station(&mut self, station: Station) -> Result<usize> {
        let index = self.stations.len();
        if station.prior.count() != 6 {
            return Err(Error::invalid("prior", "a station has 6 parameters"));
        }
        let belief = station.prior.belief(|i| station_name(index, i))?;
        match &station.pose {
            Some(pose) => {
                let defect = crate::geometry::rigid::rotation_defect(&pose.rotation);
                if !pose.is_finite() {
                    return Err(Error::NotFinite { name: "station", index });
                }
                if defect > 1e-6 {
                    return Err(Error::invalid("station", format!("not a rotation (off by {defect:.2e})")));
                }
            }
            None if belief.free.iter().any(|f| !f) || !belief.held.is_empty() => {
                return Err(Error::invalid("station", "a prior needs a pose that it is about"));
            }
            None => {}
        }
        self.stations.push(station);
        Ok(index)
    }

    /// Adds a camera; returns its index.
    pub fn add_camera(&mut self, setup: CameraSetup) -> Result<usize> {
        let index = self.cameras.len();
        if setup.width == 0 || setup.height == 0 || setup.width > 1 << 16 || setup.height > 1 << 16 {
            return Err(Error::invalid("camera", format!("image size {} x {}", setup.width, setup.height)));
        }
        for (name, s) in [("skew_sigma", setup.skew_sigma), ("aspect_sigma", setup.aspect_sigma)] {
            if s.is_nan() || s < 0.0 {
                return Err(Error::invalid(name, format!("{s} is no standard deviation")));
            }
        }
        if let Some((camera, prior)) = &setup.prior {
            camera.validate()?;
            let coefficients = camera.distortion.coefficients().len();
            if prior.count() != 11 + coefficients {
                let detail = format!("{} parameters, this camera has {}", prior.count(), 11 + coefficients);
                return Err(Error::invalid("prior", detail));
            }
            let fitted = crate::calibrate::freedom::blank_distortion(setup.distortion);
            let same = std::mem::discriminant(&fitted) == std::mem::discriminant(&camera.distortion);
            if !same && setup.fixed_lens.is_none() {
                return Err(Error::invalid("prior", "its lens model is not the one to fit"));
            }
            prior.belief(|i| camera_name(index, i, coefficients))?;
        }
        if let Some((intrinsics, distortion)) = setup.fixed_lens {
            let (width, height, pose) = (setup.width, setup.height, Rigid::identity());
            Camera { width, height, intrinsics, distortion, pose }.validate()?;
        }
        self.cameras.push(setup);
        Ok(index)
    }

    /// Adds a shot; refuses what is not finite, covariances that are not positive, and indices that
    /// do not exist. Returns its index.
    pub fn add_shot(&mut self, shot: Shot) -> Result<usize> {
        let index = self.shots.len();
        if shot.station >= self.stations.len() {
            return Err(Error::invalid(
                "station",
                format!("shot {index}: {} of {}", shot.station, self.stations.len()),
            ));
        }
        if !(shot.pan.is_finite() && shot.tilt.is_finite()) || shot.pan.abs() > 100.0 || shot.tilt.abs() > 100.0 {
            return Err(Error::invalid("pan and tilt", format!("shot {index}: {} {} rad", shot.pan, shot.tilt)));
        }
        if let Some((pixel, covariance)) = &shot.head {
            check_spot(pixel, covariance, index)?;
        }
        let mut seen = vec![false; self.cameras.len()];
        for s in &shot.sightings {
            check_spot(&s.pixel, &s.covariance, index)?;
            match seen.get_mut(s.camera) {
                Some(seen) if !*seen => *seen = true,
                Some(_) => {
                    return Err(Error::invalid("camera", format!("shot {index} is seen twice by camera {}", s.camera)));
                }
                None => {
                    let detail = format!("shot {index}: {} of {}", s.camera, self.cameras.len());
                    return Err(Error::invalid("camera", detail));
                }
            }
        }
        self.shots.push(shot);
        Ok(index)
    }

    /// Adds shots, all or none; returns the first one's index.
    pub fn add_shots(&mut self, shots: impl IntoIterator<Item = Shot>) -> Result<usize> {
        let first = self.shots.len();
        for shot in shots {
            if let Err(e) = self.add_shot(shot) {
                self.shots.truncate(first);
                return Err(e);
            }
        }
        Ok(first)
    }

    /// Adds where a camera saw a shot that is there already.
    ///
    /// # Errors
    /// As for [`add_shot`](Self::add_shot).
    pub fn add_sighting(&mut self, shot: usize, sighting: Sighting) -> Result<()> {
        let (count, cameras) = (self.shots.len(), self.cameras.len());
        let seen = self.shots.get_mut(shot).ok_or_else(|| Error::invalid("shot", format!("{shot} of {count}")))?;
        if sighting.camera >= cameras {
            return Err(Error::invalid("camera", format!("shot {shot}: {} of {cameras}", sighting.camera)));
        }
        if seen.sightings.iter().any(|s| s.camera == sighting.camera) {
            return Err(Error::invalid("camera", format!("shot {shot} is seen twice by camera {}", sighting.camera)));
        }
        check_spot(&sighting.pixel, &sighting.covariance, shot)?;
        seen.sightings.push(sighting);
        Ok(())
    }

    /// Adds sightings with the shots that they are of, all or none.
    pub fn add_sightings(&mut self, sightings: &[(usize, Sighting)]) -> Result<()> {
        for (done, (shot, sighting)) in sightings.iter().enumerate() {
            if let Err(e) = self.add_sighting(*shot, *sighting) {
                for (shot, _) in sightings.iter().take(done).rev() {
                    self.shots[*shot].sightings.pop();
                }
                return Err(e);
            }
        }
        Ok(())
    }

    /// Adds a plane of the scene, whose place is found: walls that two stations hit tie them. `flatness`:
    /// how far its surface strays from it, standard deviation in metres. Returns its index.
    ///
    /// # Errors
    /// `InvalidArgument` unless flatness is from a micrometre to a metre.
    pub fn add_plane(&mut self, flatness: f64) -> Result<usize> {
        if !(1e-6..=1.0).contains(&flatness) {
            return Err(Error::invalid("flatness", format!("{flatness} m is not from 1e-6 to 1")));
        }
        self.planes.push(flatness);
        Ok(self.planes.len() - 1)
    }

    /// Says which plane a shot hit.
    ///
    /// # Errors
    /// `InvalidArgument` for indices that do not exist and for a shot that hit one already.
    pub fn set_plane(&mut self, shot: usize, plane: usize) -> Result<()> {
        if shot >= self.shots.len() {
            return Err(Error::invalid("shot", format!("{shot} of {}", self.shots.len())));
        }
        if plane >= self.planes.len() {
            return Err(Error::invalid("plane", format!("shot {shot}: {plane} of {}", self.planes.len())));
        }
        if self.hits.contains_key(&shot) {
            return Err(Error::invalid("plane", format!("shot {shot} hit one already")));
        }
        self.hits.insert(shot, plane);
        Ok(())
    }

    /// Says which planes shots hit, all or none.
    pub fn set_planes(&mut self, hits: impl IntoIterator<Item = (usize, usize)>) -> Result<()> {
        let before = self.hits.clone();
        for (shot, plane) in hits {
            if let Err(e) = self.set_plane(shot, plane) {
                self.hits = before;
                return Err(e);
            }
        }
        Ok(())
    }

    pub fn rig(&self) -> &RigModel {
        &self.rig
    }

    pub fn rig_prior(&self) -> &Prior {
        &self.rig_prior
    }

    pub fn stations(&self) -> &[Station] {
        &self.stations
    }

    pub fn cameras(&self) -> &[CameraSetup] {
        &self.cameras
    }

    pub fn shots(&self) -> &[Shot] {
        &self.shots
    }

    /// The planes' flatness, metres.
    pub fn planes(&self) -> &[f64] {
        &self.planes
    }

    /// The plane that a shot hit, as far as it was said.
    pub fn plane_of(&self, shot: usize) -> Option<usize> {
        self.hits.get(&shot).copied()
    }
}

fn check_spot(pixel: &Vector2<f64>, c: &Matrix2<f64>, index: usize) -> Result<()> {
    if pixel.iter().any(|v| v.is_nan() || v.abs() > MAX_COORDINATE) {
        return Err(Error::NotFinite { name: "uv", index });
    }
    let positive = c.m11 > 0.0 && c.determinant() > 0.0 && c.m12 == c.m21 && c.iter().all(|v| v.is_finite());
    if !positive {
        return Err(Error::invalid("uv covariance", format!("of shot {index} is not positive definite")));
    }
    Ok(())
}

pub(super) fn rig_name(i: usize) -> String {
    RigParameter::ALL.get(i).map_or_else(String::new, |p| p.name().to_owned())
}

pub(super) fn station_name(station: usize, i: usize) -> String {
    let what = ["rotation x", "rotation y", "rotation z", "position x", "position y", "position z"];
    format!("station {station} {}", what.get(i).copied().unwrap_or_default())
}

pub(super) fn plane_name(plane: usize, i: usize) -> String {
    format!("plane {plane} {}", ["tilt a", "tilt b", "distance"].get(i).copied().unwrap_or_default())
}

/// Parameter `i` of a camera with `coefficients` lens coefficients, compact order.
pub(super) fn camera_name(camera: usize, i: usize, coefficients: usize) -> String {
    let what = match i {
        0..5 => ["fx", "fy", "skew", "cx", "cy"][i].to_owned(),
        i if i < 5 + coefficients => format!("lens coefficient {}", i - 5),
        i => {
            let pose = ["rotation x", "rotation y", "rotation z", "position x", "position y", "position z"];
            pose.get(i - 5 - coefficients).copied().unwrap_or_default().to_owned()
        }
    };
    format!("camera {camera} {what}")
}

/// The rows of a camera's sixteen parameters (see [`freedom`](crate::calibrate::freedom)) that its
/// compact order has.
pub(super) fn compact_rows(coefficients: usize) -> Vec<usize> {
    (0..5 + coefficients).chain(10..16).collect()
}

/// A covariance in compact order spread over the sixteen.
pub(super) fn spread(compact: &DMatrix<f64>, coefficients: usize) -> DMatrix<f64> {
    let rows = compact_rows(coefficients);
    let mut full = DMatrix::zeros(16, 16);
    for (a, &i) in rows.iter().enumerate() {
        for (b, &j) in rows.iter().enumerate() {
            full[(i, j)] = compact[(a, b)];
        }
    }
    full
}
