//! The rig's measurement model: a pan-tilt camera with a laser line fixed to its moving head.
//!
//! Eqs (13)-(16) of the thesis in their right form (maths.md sections 2, 6 and 9). World = head
//! frame at pan = tilt = 0; M_w = R_y(pan) (R_x(tilt) (M + a_t) + a_p) - a_t - a_p.

use nalgebra::{Matrix2, Vector2, Vector3};

use super::camera::{Camera, Intrinsics};
use super::distortion::Distortion;
use super::inverse_depth::InverseDepthPoint;
use super::rigid::{Rigid, rotation_x, rotation_y};
use crate::error::{Error, Result};

/// The laser's line in the head camera's frame: points (x0 + vx Z, y0 + vy Z, Z).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LaserLine {
    /// Metres.
    pub x0: f64,
    pub y0: f64,
    /// Slopes, metres per metre of depth.
    pub vx: f64,
    pub vy: f64,
}

/// Positions of the rotation axes relative to the head camera's centre, in metres. The tilt axis
/// (parallel to x) passes (y, z) = -(tilt_y, tilt_z); the pan axis (parallel to y) is displaced
/// from it by (pan_x, pan_z). All zero: both axes pass through the camera's centre.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AxisOffsets {
    pub tilt_y: f64,
    pub tilt_z: f64,
    pub pan_x: f64,
    pub pan_z: f64,
}

impl AxisOffsets {
    fn tilt(&self) -> Vector3<f64> {
        Vector3::new(0.0, self.tilt_y, self.tilt_z)
    }

    fn pan(&self) -> Vector3<f64> {
        Vector3::new(self.pan_x, 0.0, self.pan_z)
    }
}

/// True angle = scale * reading + zero (radians).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Encoders {
    pub pan_zero: f64,
    pub pan_scale: f64,
    pub tilt_zero: f64,
    pub tilt_scale: f64,
}

impl Default for Encoders {
    fn default() -> Self {
        Self { pan_zero: 0.0, pan_scale: 1.0, tilt_zero: 0.0, tilt_scale: 1.0 }
    }
}

/// Everything that turns (pan, tilt, spot in the head camera's image) into a point in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigModel {
    /// Image size of the head camera.
    pub width: u32,
    pub height: u32,
    pub intrinsics: Intrinsics,
    pub distortion: Distortion,
    pub laser: LaserLine,
    pub offsets: AxisOffsets,
    pub encoders: Encoders,
}

/// What one spot says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpotDepth {
    pub point: InverseDepthPoint,
    /// Squared distance of the spot from the laser's image line, in units of its covariance:
    /// chi-square with one degree of freedom for a true spot.
    pub epipolar_chi2: f64,
}

/// Shortest baseline that still measures depth.
const MIN_BASELINE: f64 = 1e-3;

impl RigModel {
    /// Checks finiteness, sizes, focal length, baseline and encoder scales.
    pub fn validate(&self) -> Result<()> {
        let (l, o, e) = (&self.laser, &self.offsets, &self.encoders);
        let numbers = [
            ("laser", [l.x0, l.y0, l.vx, l.vy]),
            ("offsets", [o.tilt_y, o.tilt_z, o.pan_x, o.pan_z]),
            ("encoders", [e.pan_zero, e.pan_scale, e.tilt_zero, e.tilt_scale]),
        ];
        for (name, values) in numbers {
            if let Some(index) = values.iter().position(|v| !v.is_finite()) {
                return Err(Error::NotFinite { name, index });
            }
        }
        self.head_camera(0.0, 0.0).validate()?;
        if l.x0.hypot(l.y0) < MIN_BASELINE {
            return Err(Error::invalid(
                "laser",
                format!("a baseline of {:.4} m measures no depth (lengths are metres)", l.x0.hypot(l.y0)),
            ));
        }
        if e.pan_scale.abs() < 1e-3 || e.tilt_scale.abs() < 1e-3 {
            return Err(Error::invalid("encoders", "a scale is (nearly) zero; 1 means none"));
        }
        Ok(())
    }

    /// Angles in the model from the device's readings.
    pub fn true_angles(&self, pan: f64, tilt: f64) -> (f64, f64) {
        let e = &self.encoders;
        (e.pan_scale * pan + e.pan_zero, e.tilt_scale * tilt + e.tilt_zero)
    }

    /// The device's readings from angles in the model.
    pub fn readings(&self, true_pan: f64, true_tilt: f64) -> (f64, f64) {
        let e = &self.encoders;
        ((true_pan - e.pan_zero) / e.pan_scale, (true_tilt - e.tilt_zero) / e.tilt_scale)
    }

    /// Head camera frame to world at the given readings.
    pub fn head_to_world(&self, pan: f64, tilt: f64) -> Rigid {
        let (pan, tilt) = self.true_angles(pan, tilt);
        let (rp, rt) = (rotation_y(pan), rotation_x(tilt));
        let (at, ap) = (self.offsets.tilt(), self.offsets.pan());
        Rigid { rotation: rp * rt, translation: rp * (rt * at + ap) - at - ap }
    }

    /// The head camera as a camera of the world at the given readings.
    pub fn head_camera(&self, pan: f64, tilt: f64) -> Camera {
        Camera {
            width: self.width,
            height: self.height,
            intrinsics: self.intrinsics,
            distortion: self.distortion,
            pose: self.head_to_world(pan, tilt).inverse(),
        }
    }

    /// The laser in the world: points o + Z d with Z the depth along the head camera's axis.
    pub fn laser_in_world(&self, pan: f64, tilt: f64) -> (Vector3<f64>, Vector3<f64>) {
        let head = self.head_to_world(pan, tilt);
        let l = &self.laser;
        (head.apply(&Vector3::new(l.x0, l.y0, 0.0)), head.rotation * Vector3::new(l.vx, l.vy, 1.0))
    }

    /// Image of the laser's point at inverse depth `rho` in the head camera: on the normalised plane
    /// v + (x0, y0) rho, a straight line (the epipolar line) before distortion.
    pub fn spot_pixel(&self, rho: f64) -> Option<Vector2<f64>> {
        let l = &self.laser;
        let ideal = Vector2::new(l.vx + l.x0 * rho, l.vy + l.y0 * rho);
        Some(self.intrinsics.to_pixel(&self.distortion.distort(ideal)?))
    }

    /// Inverse depth of a spot from both its coordinates, weighted by its covariance (px^2), with
    /// its variance and its distance from the laser's image line.
    pub fn measure(&self, pan: f64, tilt: f64, pixel: &Vector2<f64>, covariance: &Matrix2<f64>) -> Result<SpotDepth> {
        let lost = || Error::invalid("spot", format!("({:.1}, {:.1}) is outside the lens model", pixel.x, pixel.y));
        let ideal = self.distortion.undistort(self.intrinsics.to_normalised(pixel)).ok_or_else(lost)?;
        let lens = self.distortion.distort_with_jacobian(ideal).ok_or_else(lost)?;
        let k = Matrix2::new(self.intrinsics.fx, self.intrinsics.skew, 0.0, self.intrinsics.fy);
        let to_pixel = k * lens.by_point;
        // Weight on the normalised plane: J^T Sigma^-1 J.
        let weight = covariance
            .try_inverse()
            .filter(|w| w.iter().all(|v| v.is_finite()) && w.m11 > 0.0 && w.m22 > 0.0 && w.determinant() > 0.0)
            .map(|w| to_pixel.transpose() * w * to_pixel)
            .ok_or_else(|| Error::invalid("covariance", "not positive definite"))?;
        let baseline = Vector2::new(self.laser.x0, self.laser.y0);
        let offset = ideal - Vector2::new(self.laser.vx, self.laser.vy);
        let information = baseline.dot(&(weight * baseline));
        let rho = baseline.dot(&(weight * offset)) / information;
        let residual = offset - baseline * rho;
        let (origin, direction) = self.laser_in_world(pan, tilt);
        Ok(SpotDepth {
            point: InverseDepthPoint { origin, direction, rho, variance: 1.0 / information },
            epipolar_chi2: residual.dot(&(weight * residual)),
        })
    }
}

/// Rigs of tests.
#[cfg(test)]
impl RigModel {
    /// The thesis's: both axes through the camera, encoders that tell the truth.
    pub(crate) fn ideal() -> Self {
        Self {
            width: 720,
            height: 576,
            intrinsics: Intrinsics::new(800.0, 360.0, 288.0),
            distortion: Distortion::None,
            laser: LaserLine { x0: 0.1, y0: 0.005, vx: -0.005, vy: 0.003 },
            offsets: AxisOffsets::default(),
            encoders: Encoders::default(),
        }
    }

    /// The same with all of it a little off.
    pub(crate) fn crooked() -> Self {
        Self {
            intrinsics: Intrinsics { fx: 800.0, fy: 802.0, skew: 0.4, cx: 361.0, cy: 287.0 },
            distortion: Distortion::BrownConrady([-0.1, 0.02, 0.001, -0.0005, 0.0]),
            offsets: AxisOffsets { tilt_y: 0.01, tilt_z: 0.02, pan_x: 0.005, pan_z: 0.02 },
            encoders: Encoders { pan_zero: 0.01, pan_scale: 1.01, tilt_zero: -0.02, tilt_scale: 0.98 },
            ..Self::ideal()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spot_gives_back_its_point() {
        let rig = RigModel::crooked();
        for (pan, tilt, depth) in [(0.0, 0.0, 2.0), (-0.5, 0.3, 1.1), (0.4, -0.35, 5.0)] {
            let (o, d) = rig.laser_in_world(pan, tilt);
            let point = o + d * depth;
            // The head camera, as a camera of the world, sees that point where the spot model says.
            let pixel = rig.head_camera(pan, tilt).project(&point).unwrap();
            assert!((pixel - rig.spot_pixel(1.0 / depth).unwrap()).norm() < 1e-9);
            let measured = rig.measure(pan, tilt, &pixel, &Matrix2::identity()).unwrap();
            assert!((measured.point.point().unwrap() - point).norm() < 1e-9);
            assert!(measured.epipolar_chi2 < 1e-12);
        }
    }

    #[test]
    fn inverse_depth_variance_is_that_of_its_formula() {
        // Without distortion and skew: sigma_rho = sigma / (f * baseline).
        let rig = RigModel { offsets: RigModel::crooked().offsets, ..RigModel::ideal() };
        let pixel = rig.spot_pixel(0.4).unwrap();
        let m = rig.measure(0.1, 0.2, &pixel, &(Matrix2::identity() * 0.04)).unwrap();
        let wanted = 0.2 / (800.0 * 0.1f64.hypot(0.005));
        assert!((m.point.variance.sqrt() - wanted).abs() < 1e-12);
        // One pixel across the line is one sigma squared over 0.04.
        let across = Vector2::new(-0.005, 0.1).normalize();
        let m = rig.measure(0.1, 0.2, &(pixel + across), &(Matrix2::identity() * 0.04)).unwrap();
        assert!((m.epipolar_chi2 - 25.0).abs() < 1e-6);
    }

    #[test]
    fn readings_and_true_angles_are_inverse() {
        let rig = RigModel::crooked();
        let (p, t) = rig.true_angles(0.3, -0.2);
        let (pan, tilt) = rig.readings(p, t);
        assert!((pan - 0.3).abs() < 1e-15 && (tilt + 0.2).abs() < 1e-15);
    }

    #[test]
    fn bad_models_are_refused() {
        assert!(RigModel::crooked().validate().is_ok());
        let mut r = RigModel::crooked();
        r.laser.x0 = 0.0;
        r.laser.y0 = 0.0;
        assert!(r.validate().is_err());
        let mut r = RigModel::crooked();
        r.offsets.pan_z = f64::INFINITY;
        assert_eq!(r.validate(), Err(Error::NotFinite { name: "offsets", index: 3 }));
        let singular = Matrix2::new(1.0, 1.0, 1.0, 1.0);
        assert!(RigModel::crooked().measure(0.0, 0.0, &Vector2::new(400.0, 300.0), &singular).is_err());
    }
}
