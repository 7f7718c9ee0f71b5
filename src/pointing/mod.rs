//! Pointing: what a pixel of a calibrated fixed camera means for the pan-tilt(-zoom) head, and what a
//! pixel of the head's camera means for the fixed one.
//!
//! A [`Pointer`] holds the fixed camera, the rig and how well both are known; a [`Depth`] says where
//! along the pixel's ray the target is. [`Pointer::aim`] gives pan, tilt and the tightest zoom that
//! keeps the target in the picture, [`Pointer::sweep`] what to do where the depth is unknown,
//! [`Pointer::locate`] the way back. Every answer carries its covariance through the whole chain: the
//! click, the camera's calibration, the surface, the rig, and the head's coming to rest; what camera
//! and rig have in common (a joint adjustment's cross-covariance) is kept.

mod chain;
mod cloud;
mod ellipse;
mod locate;
mod plane;
mod surface;
mod sweep;
mod tree;
mod zoom;

use nalgebra::{DMatrix, Matrix2, Matrix6, SMatrix, Vector2, Vector3};

use crate::adjust::Adjusted;
use crate::calibrate::uncertainty::semidefinite;
use crate::calibrate::{Calibration, UncertainPixel, UncertainPoint};
use crate::device::PtzCapabilities;
use crate::error::{Error, Result};
use crate::geometry::rig_model::LaserLine;
use crate::geometry::rigid::skew;
use crate::geometry::{RIG_PARAMETERS, RigModel, Rigid, ZoomCurve};
use crate::rig::aim::aim_at_point;

use chain::{CAMERA, Linear, Noise, STATION, in_station};
pub use cloud::{CloudHit, CloudSurface, PointNoise};
pub use ellipse::{Ellipse, ellipse};
pub use locate::{Located, LocatedAlong};
pub use surface::{Depth, Edge, MeasuredBy, UncertainPlane};
pub use sweep::{Sweep, SweepPoint};

/// Beyond this relative standard deviation of the distance the linearised chain no longer covers: such
/// a pixel's depth is as good as unknown.
const MAX_DISTANCE_DEVIATION: f64 = 0.2;

/// A pixel that somebody clicked or a detector found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Click {
    pub pixel: Vector2<f64>,
    /// px^2, positive semi-definite.
    pub covariance: Matrix2<f64>,
}

impl Click {
    /// With the same standard deviation in both coordinates, pixels.
    pub fn new(pixel: Vector2<f64>, sigma: f64) -> Self {
        Self { pixel, covariance: Matrix2::identity() * (sigma * sigma) }
    }
}

/// What is asked of an aim.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AimOptions {
    /// With which the whole target is to be in the picture, between 0 and 1.
    pub probability: f64,
    /// Diameter of the target, metres; 0 for a point.
    pub target_size: f64,
}

impl Default for AimOptions {
    fn default() -> Self {
        Self { probability: 0.95, target_size: 0.0 }
    }
}

/// Where to turn the head.
#[derive(Debug, Clone, PartialEq)]
pub struct Aim {
    /// The device's readings, radians, at which the target is at the picture's centre.
    pub pan: f64,
    pub tilt: f64,
    /// Of the target's direction about them, in readings: rad^2.
    pub angles: Matrix2<f64>,
    /// The tightest zoom (the curve's own scale) that keeps the target in the picture with the
    /// probability asked for, or the widest when none does; `None` without a zoom curve.
    pub zoom: Option<f64>,
    /// Of the whole target being in the picture.
    pub probability: f64,
    /// Where the target is in the head camera's picture then.
    pub pixel: UncertainPixel,
    /// The target in the world.
    pub point: UncertainPoint,
    /// From the fixed camera's centre, metres.
    pub distance: f64,
    /// The surface ends about here: the target may be what is behind.
    pub edge: Option<Edge>,
}

/// A fixed camera, the rig, and how well both are known.
#[derive(Debug, Clone)]
pub struct Pointer {
    calibration: Calibration,
    rig: RigModel,
    station: Rigid,
    /// Of the rig's parameters, six of the station, the camera's.
    joint: DMatrix<f64>,
    head_sigma: [f64; 2],
    zoom: Option<ZoomCurve>,
    reach: Option<[[f64; 2]; 2]>,
}

impl Pointer {
    /// A camera whose world is the rig's frame. The rig is taken as exact until
    /// [`set_rig_covariance`](Self::set_rig_covariance).
    ///
    /// # Errors
    /// For a camera, a covariance or a rig that makes no sense.
    pub fn new(calibration: Calibration, rig: RigModel) -> Result<Self> {
        rig.validate()?;
        rig.head_camera(0.0, 0.0).check_lens()?;
        calibration.camera.validate()?;
        let parameters = 11 + calibration.camera.distortion.coefficients().len();
        check_covariance(&calibration.covariance, parameters, "camera covariance")?;
        let mut joint = DMatrix::zeros(CAMERA + parameters, CAMERA + parameters);
        joint.view_mut((CAMERA, CAMERA), (parameters, parameters)).copy_from(&calibration.covariance);
        let station = Rigid::identity();
        Ok(Self { calibration, rig, station, joint, head_sigma: [0.0; 2], zoom: None, reach: None })
    }

    /// A camera of a joint adjustment and the rig where it stood at one of its stations, with all that
    /// their covariances have in common.
    ///
    /// # Errors
    /// `InvalidArgument` for a camera or station that does not exist.
    pub fn of_adjusted(adjusted: &Adjusted, camera: usize, station: usize) -> Result<Self> {
        let none = |name, index, count| Error::invalid(name, format!("{index} of {count}"));
        let calibration =
            adjusted.cameras.get(camera).ok_or_else(|| none("camera", camera, adjusted.cameras.len()))?.clone();
        let pose = *adjusted.stations.get(station).ok_or_else(|| none("station", station, adjusted.stations.len()))?;
        let mut pointer = Self::new(calibration, adjusted.rig)?;
        let places = adjusted.places();
        let camera_place = &places[1 + adjusted.stations.len() + camera];
        let columns: Vec<usize> =
            places[0].clone().chain(places[1 + station].clone()).chain(camera_place.clone()).collect();
        pointer.joint =
            DMatrix::from_fn(columns.len(), columns.len(), |i, j| adjusted.covariance[(columns[i], columns[j])]);
        pointer.station = pose;
        Ok(pointer)
    }

    /// How well the rig's parameters are known, in the order of
    /// [`RigParameter`](crate::geometry::RigParameter), independent of the camera.
    pub fn set_rig_covariance(&mut self, covariance: &SMatrix<f64, RIG_PARAMETERS, RIG_PARAMETERS>) -> Result<()> {
        semidefinite(covariance, "rig covariance")?;
        self.set_block(0, covariance.as_slice(), RIG_PARAMETERS);
        Ok(())
    }

    /// Where the rig stands: station frame to world, with the covariance of its rotation w in
    /// `R <- exp([w]x) R` (radians) and its position (metres), independent of camera and rig.
    pub fn set_station(&mut self, pose: Rigid, covariance: &Matrix6<f64>) -> Result<()> {
        if !pose.is_finite() {
            return Err(Error::NotFinite { name: "station", index: 0 });
        }
        if crate::geometry::rigid::rotation_defect(&pose.rotation) > 1e-6 {
            return Err(Error::invalid("station", "not a rotation"));
        }
        semidefinite(covariance, "station covariance")?;
        self.set_block(STATION, covariance.as_slice(), 6);
        self.station = pose;
        Ok(())
    }

    fn set_block(&mut self, first: usize, values: &[f64], n: usize) {
        self.joint.rows_mut(first, n).fill(0.0);
        self.joint.columns_mut(first, n).fill(0.0);
        self.joint.view_mut((first, first), (n, n)).copy_from_slice(values);
    }

    /// Standard deviations of where the head comes to rest about its readings, pan and tilt, radians:
    /// its repeatability and, of a head with steps, step / sqrt(12).
    pub fn set_head_deviation(&mut self, sigma: [f64; 2]) -> Result<()> {
        if let Some(index) = sigma.iter().position(|s| !s.is_finite()) {
            return Err(Error::NotFinite { name: "head deviation", index });
        }
        if sigma.iter().any(|s| *s < 0.0 || *s > 1.0) {
            return Err(Error::invalid("head deviation", format!("{sigma:?} rad are not from 0 to 1")));
        }
        self.head_sigma = sigma;
        Ok(())
    }

    /// The head camera's lens over zoom. Its errors are taken as independent of the rig's axes and
    /// encoders.
    pub fn set_zoom_curve(&mut self, curve: ZoomCurve) -> Result<()> {
        let [width, height] = curve.size();
        if (width, height) != (self.rig.width, self.rig.height) {
            let (w, h) = (self.rig.width, self.rig.height);
            return Err(Error::invalid("zoom curve", format!("of {width} x {height} px, the rig's is {w} x {h}")));
        }
        self.zoom = Some(curve);
        Ok(())
    }

    /// Aims beyond what the head can reach are refused then.
    pub fn set_reach(&mut self, capabilities: &PtzCapabilities) -> Result<()> {
        let reach = [capabilities.pan_range, capabilities.tilt_range];
        for (name, range) in ["pan_range", "tilt_range"].into_iter().zip(reach) {
            if range.iter().any(|v| v.is_nan()) || range[0] > range[1] {
                return Err(Error::invalid(name, format!("{range:?}: least first")));
            }
        }
        self.reach = Some(reach);
        Ok(())
    }

    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    pub fn rig(&self) -> &RigModel {
        &self.rig
    }

    /// Station frame to world.
    pub fn station(&self) -> &Rigid {
        &self.station
    }

    pub fn zoom_curve(&self) -> Option<&ZoomCurve> {
        self.zoom.as_ref()
    }

    /// Where to turn the head, and how far to zoom, so that its camera shows what the fixed camera
    /// shows at a pixel.
    ///
    /// # Errors
    /// `InvalidArgument`: a pixel outside the picture, options or a covariance that make no sense;
    /// `OutsideLens`; `Unreachable`: a pixel above the plane's horizon, one so near to it that its
    /// distance is known to no better than 20 %, an aim that the head cannot reach; `NotFound`: no
    /// surface near the ray; `NotFinite`.
    pub fn aim(&self, click: &Click, depth: &Depth<'_>, options: &AimOptions) -> Result<Aim> {
        options.validate()?;
        let target = self.target(click, depth)?;
        let Some(curve) = &self.zoom else {
            let (_, aim) = self.aim_at(&target, &Lens::of(self.rig), options)?;
            return Ok(aim);
        };
        let (zoom, probability, aim) =
            zoom::tightest(curve, options.probability, |zoom| self.aim_at(&target, &self.lens(Some(zoom))?, options))?;
        Ok(Aim { zoom: Some(zoom), probability, ..aim })
    }

    /// What a pixel of the fixed camera is a picture of.
    fn target(&self, click: &Click, depth: &Depth<'_>) -> Result<Target> {
        let seen = self.clicked(click)?;
        let noise = Noise::new(&self.joint, &click.covariance, self.head_sigma);
        let ray = noise.fixed_ray(&seen);
        let meeting = depth.meeting(&ray.ray(), ray.angular_deviation(&noise))?;
        let noise = noise.with_plane(&meeting.plane);
        let point = noise.meet(&ray, &meeting.plane, |p| self.surface_by(p, meeting.plane.measured_by))?;
        let distance = (point.value - seen.ray.origin).norm();
        let along = seen.ray.direction;
        let deviation = along.dot(&(noise.covariance_of(&point) * along)).max(0.0).sqrt();
        check_distance(distance, deviation)?;
        Ok(Target { noise, point, distance, edge: meeting.edge })
    }

    /// How a surface that this rig measured moves with what is uncertain of rig and station.
    fn surface_by(&self, point: &Vector3<f64>, measured_by: MeasuredBy) -> Result<Option<SMatrix<f64, 3, CAMERA>>> {
        if measured_by == MeasuredBy::Others {
            return Ok(None);
        }
        let shot = aim_at_point(&self.rig, &in_station(&self.station, point))?;
        let unlit = || Error::Unreachable { reason: "this rig's laser cannot have measured the target".into() };
        let weight = Matrix2::identity();
        let by_rig = self.rig.measured_point_by(shot.pan, shot.tilt, 1.0 / shot.depth, &weight).ok_or_else(unlit)?;
        let mut by = SMatrix::<f64, 3, CAMERA>::zeros();
        for (i, moved) in by_rig.iter().enumerate() {
            by.set_column(i, &(self.station.rotation * moved));
        }
        let arm = point - self.station.translation;
        by.fixed_view_mut::<3, 3>(0, STATION).copy_from(&-skew(&arm));
        by.fixed_view_mut::<3, 3>(0, STATION + 3).fill_with_identity();
        Ok(Some(by))
    }

    fn clicked(&self, click: &Click) -> Result<crate::calibrate::uncertainty::RayDerivatives> {
        click.validate(self.calibration.camera.width, self.calibration.camera.height)?;
        self.calibration.ray_with_derivatives(&click.pixel)
    }

    /// The aim with a lens, and the probability of the target being in its picture.
    fn aim_at(&self, target: &Target, lens: &Lens, options: &AimOptions) -> Result<(f64, Aim)> {
        let noise = lens.noise(&target.noise);
        let [pan, tilt] = self.angles(&lens.model, &target.point.value)?;
        let (image, pixel) = noise
            .head_pixel(&lens.model, &self.station, [pan, tilt], &target.point)
            .ok_or_else(|| Error::Unreachable { reason: "the target is outside the head camera's lens".into() })?;
        let seen = noise.pixel(&pixel);
        let by_angles = Matrix2::from_columns(&[image.by_pan, image.by_tilt]);
        let back = by_angles
            .try_inverse()
            .ok_or_else(|| Error::Unreachable { reason: "the target is on the head's axis".into() })?;
        let half = lens.half_picture() - extent(&image.by_point, options.target_size);
        let probability = zoom::in_rectangle(&(seen.pixel - lens.centre()), &seen.covariance, &half);
        let point = UncertainPoint { point: target.point.value, covariance: target.noise.covariance_of(&target.point) };
        let aim = Aim {
            pan,
            tilt,
            angles: back * seen.covariance * back.transpose(),
            zoom: None,
            probability,
            pixel: seen,
            point,
            distance: target.distance,
            edge: target.edge,
        };
        Ok((probability, aim))
    }

    /// Readings at which a point of the world is at the picture's centre.
    fn angles(&self, model: &RigModel, point: &Vector3<f64>) -> Result<[f64; 2]> {
        let centre = Lens::of(*model).centre();
        let v = model
            .head_camera(0.0, 0.0)
            .undistort_pixel(&centre)
            .ok_or_else(|| Error::invalid("rig", "the picture's centre is outside the lens model"))?;
        // The picture's centre is seen along a laser from the camera's centre.
        let line = LaserLine { x0: 0.0, y0: 0.0, vx: v.x, vy: v.y };
        let aim = aim_at_point(&RigModel { laser: line, ..*model }, &in_station(&self.station, point))?;
        let Some([pan_range, tilt_range]) = self.reach else { return Ok([aim.pan, aim.tilt]) };
        let aim = aim.turned_into(model, pan_range);
        let capabilities = PtzCapabilities { pan_range, tilt_range, ..PtzCapabilities::default() };
        crate::rig::check_reach(&capabilities, aim.pan, aim.tilt)?;
        Ok([aim.pan, aim.tilt])
    }

    /// The head camera at a zoom of the curve, or as the rig's model has it.
    fn lens(&self, zoom: Option<f64>) -> Result<Lens> {
        let Some(zoom) = zoom else { return Ok(Lens::of(self.rig)) };
        let curve = self.zoom.as_ref().ok_or_else(|| Error::invalid("zoom", "there is no zoom curve"))?;
        let there = curve.at(zoom)?;
        let covariance = there.rig_covariance();
        let model = RigModel { offsets: self.rig.offsets, encoders: self.rig.encoders, ..there.model };
        Ok(Lens { model, covariance: Some(covariance) })
    }
}

/// What a pixel is a picture of, with all that is uncertain about it.
struct Target {
    noise: Noise,
    point: Linear<3>,
    distance: f64,
    edge: Option<Edge>,
}

/// The head camera at one zoom.
struct Lens {
    model: RigModel,
    /// Of the rig's first seven parameters, where they are not those of the joint covariance.
    covariance: Option<SMatrix<f64, 7, 7>>,
}

impl Lens {
    fn of(model: RigModel) -> Self {
        Self { model, covariance: None }
    }

    fn noise(&self, noise: &Noise) -> Noise {
        match &self.covariance {
            Some(c) => noise.clone().with_lens(c),
            None => noise.clone(),
        }
    }

    /// The picture's centre, and its half width and height.
    fn centre(&self) -> Vector2<f64> {
        self.half_picture() - Vector2::repeat(0.5)
    }

    fn half_picture(&self) -> Vector2<f64> {
        Vector2::new(f64::from(self.model.width), f64::from(self.model.height)) * 0.5
    }
}

/// How far a ball of this diameter reaches in the image, pixels.
fn extent(by_point: &nalgebra::Matrix2x3<f64>, diameter: f64) -> Vector2<f64> {
    Vector2::new(by_point.row(0).norm(), by_point.row(1).norm()) * (0.5 * diameter)
}

impl Click {
    fn validate(&self, width: u32, height: u32) -> Result<()> {
        if let Some(index) = self.pixel.iter().position(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name: "pixel", index });
        }
        let (w, h) = (f64::from(width) - 0.5, f64::from(height) - 0.5);
        if self.pixel.iter().any(|v| *v < -0.5) || self.pixel.x > w || self.pixel.y > h {
            let [[x, y]] = self.pixel.data.0;
            return Err(Error::invalid(
                "pixel",
                format!("({x:.1}, {y:.1}) is outside the picture of {width} x {height}"),
            ));
        }
        semidefinite(&self.covariance, "pixel covariance")
    }
}

impl AimOptions {
    fn validate(&self) -> Result<()> {
        if !(self.probability > 0.0 && self.probability < 1.0) {
            return Err(Error::invalid("probability", format!("{} is not between 0 and 1", self.probability)));
        }
        if !(0.0..=1e6).contains(&self.target_size) {
            return Err(Error::invalid("target_size", format!("{} m", self.target_size)));
        }
        Ok(())
    }
}

fn check_distance(distance: f64, deviation: f64) -> Result<()> {
    if deviation <= MAX_DISTANCE_DEVIATION * distance {
        return Ok(());
    }
    let reason = format!(
        "the pixel's distance is {distance:.2} m +- {deviation:.2} m, as good as unknown: near the plane's horizon"
    );
    Err(Error::Unreachable { reason })
}

/// Refuses what is no covariance of this size.
fn check_covariance(c: &DMatrix<f64>, size: usize, name: &'static str) -> Result<()> {
    if c.shape() != (size, size) {
        return Err(Error::invalid(name, format!("{} x {}, {size} x {size} expected", c.nrows(), c.ncols())));
    }
    if let Some(index) = c.iter().position(|v| !v.is_finite()) {
        return Err(Error::NotFinite { name, index });
    }
    let bounded = |i: usize, j: usize| {
        let bound = (c[(i, i)] * c[(j, j)]).sqrt() * (1.0 + 1e-9);
        c[(i, i)] >= 0.0 && c[(i, j)].abs() <= bound && (c[(i, j)] - c[(j, i)]).abs() <= 1e-9 * bound
    };
    let ok = (0..size).all(|i| (0..size).all(|j| bounded(i, j)));
    if ok { Ok(()) } else { Err(Error::invalid(name, "not positive semi-definite")) }
}
