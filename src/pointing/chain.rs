//! The covariance chain: every quantity of a pointing as a value with its derivatives by all that is
//! uncertain, in one common order, so that what two steps have in common cancels or adds as it must.

use nalgebra::{Const, DMatrix, Dyn, Matrix2, Matrix3, OMatrix, SMatrix, SVector, Vector2, Vector3};

use super::surface::UncertainPlane;
use crate::calibrate::UncertainPixel;
use crate::calibrate::uncertainty::RayDerivatives;
use crate::error::{Error, Result};
use crate::geometry::rigid::skew;
use crate::geometry::{HeadImage, RIG_PARAMETERS, Ray, RigModel, Rigid};

/// First column of the station's pose: rotation w in `R <- exp([w]x) R`, then position.
pub(super) const STATION: usize = RIG_PARAMETERS;
/// First column of the fixed camera's parameters.
pub(super) const CAMERA: usize = STATION + 6;
/// Columns after the camera's: the click's pixel, the head's pan and tilt, a plane's normal and distance,
/// a lens other than the rig's own.
const CLICK: usize = 0;
const HEAD: usize = 2;
const PLANE: usize = 4;
const LENS: usize = 8;
const EXTRA: usize = LENS + 7;

/// What is uncertain in one pointing: rig, station and camera jointly, and independent of them and of
/// each other the click, the head's coming to rest and the surface.
#[derive(Debug, Clone)]
pub(super) struct Noise {
    covariance: DMatrix<f64>,
    joint: usize,
    /// First of the seven columns of the head camera's lens (and the laser with it).
    lens: usize,
}

/// A vector with its derivatives by the columns of [`Noise`].
#[derive(Debug, Clone)]
pub(super) struct Linear<const N: usize> {
    pub value: SVector<f64, N>,
    by: OMatrix<f64, Const<N>, Dyn>,
}

/// A ray whose direction has length 1.
#[derive(Debug, Clone)]
pub(super) struct LinearRay {
    origin: Linear<3>,
    direction: Linear<3>,
}

impl Noise {
    pub fn new(joint: &DMatrix<f64>, click: &Matrix2<f64>, head: [f64; 2]) -> Self {
        let n = joint.nrows();
        let mut covariance = DMatrix::zeros(n + EXTRA, n + EXTRA);
        covariance.view_mut((0, 0), (n, n)).copy_from(joint);
        covariance.view_mut((n + CLICK, n + CLICK), (2, 2)).copy_from(click);
        (0..2).for_each(|i| covariance[(n + HEAD + i, n + HEAD + i)] = head[i] * head[i]);
        Self { covariance, joint: n, lens: 0 }
    }

    /// The same with what is not known of a surface.
    pub fn with_plane(mut self, plane: &UncertainPlane) -> Self {
        let first = self.joint + PLANE;
        self.covariance.view_mut((first, first), (4, 4)).copy_from(&plane.covariance);
        self
    }

    /// The same with another lens: covariance of the rig's first seven parameters at its zoom, which
    /// has nothing to do with all else.
    pub fn with_lens(mut self, lens: &SMatrix<f64, 7, 7>) -> Self {
        self.lens = self.joint + LENS;
        self.covariance.view_mut((self.lens, self.lens), (7, 7)).copy_from(lens);
        self
    }

    /// The column of a rig parameter.
    fn rig_column(&self, parameter: usize) -> usize {
        if parameter < 7 { self.lens + parameter } else { parameter }
    }

    pub fn covariance_of<const N: usize>(&self, x: &Linear<N>) -> SMatrix<f64, N, N> {
        let c = &x.by * &self.covariance * x.by.transpose();
        (c + c.transpose()) * 0.5
    }

    fn columns(&self) -> usize {
        self.covariance.nrows()
    }

    fn still<const N: usize>(&self, value: SVector<f64, N>) -> Linear<N> {
        Linear { value, by: OMatrix::<f64, Const<N>, Dyn>::zeros(self.columns()) }
    }

    /// The fixed camera's ray through a clicked pixel.
    pub fn fixed_ray(&self, seen: &RayDerivatives) -> LinearRay {
        let (mut origin, mut direction) = (self.still(seen.ray.origin), self.still(seen.ray.direction));
        let camera = self.joint - CAMERA;
        origin.by.columns_mut(CAMERA, camera).copy_from(&seen.by_parameters.fixed_rows::<3>(0));
        direction.by.columns_mut(CAMERA, camera).copy_from(&seen.by_parameters.fixed_rows::<3>(3));
        direction.by.columns_mut(self.joint + CLICK, 2).copy_from(&seen.by_pixel.fixed_rows::<3>(3));
        LinearRay { origin, direction }
    }

    /// The head camera's ray through a clicked pixel, in the world; `None` outside the lens model.
    pub fn head_ray(
        &self,
        rig: &RigModel,
        station: &Rigid,
        [pan, tilt]: [f64; 2],
        pixel: &Vector2<f64>,
    ) -> Option<LinearRay> {
        let k = &rig.intrinsics;
        let ideal = rig.distortion.undistort(k.to_normalised(pixel))?;
        let lens = rig.distortion.distort_with_jacobian(ideal)?;
        let by_ideal = Matrix2::new(k.fx, k.skew, 0.0, k.fy) * lens.by_point;
        let by_pixel = by_ideal.try_inverse()?;
        // A laser from the camera's centre through that pixel has the ray's derivatives.
        let mut virtual_laser = *rig;
        let laser = &mut virtual_laser.laser;
        (laser.x0, laser.y0, laser.vx, laser.vy) = (0.0, 0.0, ideal.x, ideal.y);
        let ray = virtual_laser.laser_ray(pan, tilt, [0.0; 2]);
        let (mut origin, mut direction) = (self.still(ray.origin), self.still(ray.direction));
        for i in 7..RIG_PARAMETERS {
            origin.by.set_column(i, &ray.origin_by[i]);
            direction.by.set_column(i, &ray.direction_by[i]);
        }
        let turn = |moved: Vector2<f64>| {
            let v = by_pixel * moved;
            ray.direction_by[2] * v.x + ray.direction_by[3] * v.y
        };
        // A lens that images the same direction further out has the pixel see further in.
        direction.by.set_column(self.lens + 4, &turn(Vector2::new(k.cx, k.cy) - pixel));
        direction.by.set_column(self.lens + 5, &turn(-Vector2::x()));
        direction.by.set_column(self.lens + 6, &turn(-Vector2::y()));
        direction.by.set_column(self.joint + CLICK, &turn(Vector2::x()));
        direction.by.set_column(self.joint + CLICK + 1, &turn(Vector2::y()));
        let e = &rig.encoders;
        for (column, by, scale) in [(0, ray.by_pan, e.pan_scale), (1, ray.by_tilt, e.tilt_scale)] {
            origin.by.set_column(self.joint + HEAD + column, &(by[0] * scale));
            direction.by.set_column(self.joint + HEAD + column, &(by[1] * scale));
        }
        let [mut origin, direction] = [origin, direction].map(|x| {
            let mut x = x.mapped(&station.rotation);
            let by = -skew(&x.value);
            x.by.columns_mut(STATION, 3).copy_from(&by);
            x
        });
        origin.by.fixed_view_mut::<3, 3>(0, STATION + 3).fill_with_identity();
        origin.value += station.translation;
        Some(LinearRay { origin, direction: direction.unit()? })
    }

    /// Where the head camera sees a point of the world; `None` behind it.
    pub fn head_pixel(
        &self,
        rig: &RigModel,
        station: &Rigid,
        [pan, tilt]: [f64; 2],
        point: &Linear<3>,
    ) -> Option<(HeadImage, Linear<2>)> {
        let back = station.rotation.transpose();
        let arm = point.value - station.translation;
        let image = rig.head_image(pan, tilt, &(back * arm))?;
        let by_world = image.by_point * back;
        let mut by = by_world * &point.by;
        for (i, b) in image.by.iter().enumerate() {
            let sum = by.column(self.rig_column(i)) + b;
            by.set_column(self.rig_column(i), &sum);
        }
        let turned = by_world * skew(&arm);
        let mut of_station = by.columns_mut(STATION, 6);
        let mut rotation = of_station.columns_mut(0, 3);
        rotation += turned;
        let mut position = of_station.columns_mut(3, 3);
        position -= by_world;
        for (column, b) in [image.by_pan, image.by_tilt].iter().enumerate() {
            let sum = by.column(self.joint + HEAD + column) + b;
            by.set_column(self.joint + HEAD + column, &sum);
        }
        let pixel = Linear { value: image.pixel, by };
        Some((image, pixel))
    }

    /// Where the fixed camera sees a point, from its own derivatives.
    pub fn fixed_pixel(
        &self,
        (pixel, by_parameters, by_point): (Vector2<f64>, nalgebra::Matrix2xX<f64>, nalgebra::Matrix2x3<f64>),
        point: &Linear<3>,
    ) -> Linear<2> {
        let mut by = by_point * &point.by;
        let mut of_camera = by.columns_mut(CAMERA, self.joint - CAMERA);
        of_camera += by_parameters;
        Linear { value: pixel, by }
    }

    /// A pixel with its covariance.
    pub fn pixel(&self, pixel: &Linear<2>) -> UncertainPixel {
        UncertainPixel { pixel: pixel.value, covariance: self.covariance_of(pixel) }
    }

    /// Where a ray meets a plane. `surface_by` says how the surface there moves with rig and station
    /// that measured it: derivatives by the columns up to the camera's.
    ///
    /// # Errors
    /// `Unreachable`: the plane is not in front of the ray's origin.
    pub fn meet(
        &self,
        ray: &LinearRay,
        plane: &UncertainPlane,
        surface_by: impl Fn(&Vector3<f64>) -> Result<Option<SMatrix<f64, 3, CAMERA>>>,
    ) -> Result<Linear<3>> {
        let (o, d, n) = (&ray.origin, &ray.direction, &plane.plane.normal);
        let slope = n.dot(&d.value);
        let gap = plane.plane.distance - n.dot(&o.value);
        let distance = gap / slope;
        if slope.abs() < 1e-9 || !(distance > 0.0 && distance.is_finite()) {
            return Err(Error::Unreachable { reason: no_meeting(gap, slope) });
        }
        let point = o.value + d.value * distance;
        let slide = Matrix3::identity() - d.value * n.transpose() / slope;
        let mut by = slide * (&o.by + &d.by * distance);
        let along = d.value / slope;
        let first = self.joint + PLANE;
        by.columns_mut(first, 3).copy_from(&(-along * point.transpose()));
        by.set_column(first + 3, &along);
        if let Some(surface) = surface_by(&point)? {
            let mut common = by.columns_mut(0, CAMERA);
            common += along * n.transpose() * surface;
        }
        Ok(Linear { value: point, by })
    }

    /// The point of a ray at a distance, known exactly.
    pub fn at(&self, ray: &LinearRay, distance: f64) -> Linear<3> {
        let (o, d) = (&ray.origin, &ray.direction);
        Linear { value: o.value + d.value * distance, by: &o.by + &d.by * distance }
    }
}

fn no_meeting(gap: f64, slope: f64) -> String {
    if slope.abs() < 1e-9 {
        "the ray runs along the plane: the pixel is on its horizon".into()
    } else if gap.abs() < 1e-9 {
        "the camera stands in the plane".into()
    } else {
        "the ray leads away from the plane: the pixel is beyond its horizon, or the plane is behind the camera".into()
    }
}

impl<const N: usize> Linear<N> {
    fn mapped(&self, map: &SMatrix<f64, N, N>) -> Self {
        Self { value: map * self.value, by: map * &self.by }
    }
}

impl Linear<3> {
    fn unit(&self) -> Option<Self> {
        let norm = self.value.norm();
        let value = self.value.try_normalize(1e-300)?;
        let across = (Matrix3::identity() - value * value.transpose()) / norm;
        Some(Self { value, by: across * &self.by })
    }
}

impl LinearRay {
    pub fn ray(&self) -> Ray {
        Ray { origin: self.origin.value, direction: self.direction.value }
    }

    /// Standard deviation of the direction across the ray, radians.
    pub fn angular_deviation(&self, noise: &Noise) -> f64 {
        let c: Matrix3<f64> = noise.covariance_of(&self.direction);
        (0.5 * c.trace()).max(0.0).sqrt()
    }
}

/// The rig-frame position of a world point.
pub(super) fn in_station(station: &Rigid, point: &Vector3<f64>) -> Vector3<f64> {
    station.rotation.transpose() * (point - station.translation)
}
