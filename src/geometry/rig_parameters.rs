//! The rig model's parameters as a vector, and derivatives of the laser's ray and spot by them.

use nalgebra::{Matrix2, Vector2, Vector3};

use super::rig_model::RigModel;
use super::rigid::{rotation_x, rotation_y};

/// Number of parameters that an adjustment can estimate of a rig.
pub const RIG_PARAMETERS: usize = 15;

/// Parameters of a rig, in the order of every vector and covariance of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(usize)]
pub enum RigParameter {
    /// Laser line, metres.
    LaserX0 = 0,
    LaserY0 = 1,
    /// Laser line, slopes.
    LaserVx = 2,
    LaserVy = 3,
    /// ln of the head camera's focal length: one scale for fx and fy (and skew).
    HeadFocal = 4,
    /// Head camera's principal point, pixels.
    HeadCx = 5,
    HeadCy = 6,
    /// Axis offsets, metres.
    TiltAxisY = 7,
    TiltAxisZ = 8,
    PanAxisX = 9,
    PanAxisZ = 10,
    /// Encoders: zero in radians, scale about 1.
    PanZero = 11,
    PanScale = 12,
    TiltZero = 13,
    TiltScale = 14,
}

impl RigParameter {
    pub const ALL: [Self; RIG_PARAMETERS] = [
        Self::LaserX0,
        Self::LaserY0,
        Self::LaserVx,
        Self::LaserVy,
        Self::HeadFocal,
        Self::HeadCx,
        Self::HeadCy,
        Self::TiltAxisY,
        Self::TiltAxisZ,
        Self::PanAxisX,
        Self::PanAxisZ,
        Self::PanZero,
        Self::PanScale,
        Self::TiltZero,
        Self::TiltScale,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::LaserX0 => "laser x0",
            Self::LaserY0 => "laser y0",
            Self::LaserVx => "laser vx",
            Self::LaserVy => "laser vy",
            Self::HeadFocal => "head focal length",
            Self::HeadCx => "head cx",
            Self::HeadCy => "head cy",
            Self::TiltAxisY => "tilt axis y",
            Self::TiltAxisZ => "tilt axis z",
            Self::PanAxisX => "pan axis x",
            Self::PanAxisZ => "pan axis z",
            Self::PanZero => "pan zero",
            Self::PanScale => "pan scale",
            Self::TiltZero => "tilt zero",
            Self::TiltScale => "tilt scale",
        }
    }
}

/// The laser's ray o + Z d in the rig's frame, with derivatives.
#[derive(Debug, Clone)]
pub struct LaserRay {
    pub origin: Vector3<f64>,
    pub direction: Vector3<f64>,
    pub origin_by: [Vector3<f64>; RIG_PARAMETERS],
    pub direction_by: [Vector3<f64>; RIG_PARAMETERS],
    /// By the true pan and tilt angles: of the origin, of the direction.
    pub by_pan: [Vector3<f64>; 2],
    pub by_tilt: [Vector3<f64>; 2],
}

/// The laser's spot in the head camera, with derivatives.
#[derive(Debug, Clone)]
pub struct SpotImage {
    pub pixel: Vector2<f64>,
    pub by_rho: Vector2<f64>,
    pub by: [Vector2<f64>; RIG_PARAMETERS],
}

impl RigModel {
    /// All parameters; lengths in metres, angles in radians, ln of the focal length in pixels.
    pub fn parameters(&self) -> [f64; RIG_PARAMETERS] {
        let (l, k, o, e) = (&self.laser, &self.intrinsics, &self.offsets, &self.encoders);
        [
            l.x0,
            l.y0,
            l.vx,
            l.vy, //
            k.fx.ln(),
            k.cx,
            k.cy, //
            o.tilt_y,
            o.tilt_z,
            o.pan_x,
            o.pan_z, //
            e.pan_zero,
            e.pan_scale,
            e.tilt_zero,
            e.tilt_scale,
        ]
    }

    /// The model with `step` added to its parameters.
    pub fn moved(&self, step: &[f64; RIG_PARAMETERS]) -> Self {
        let mut m = *self;
        let scale = step[4].exp();
        (m.intrinsics.fx, m.intrinsics.fy, m.intrinsics.skew) =
            (m.intrinsics.fx * scale, m.intrinsics.fy * scale, m.intrinsics.skew * scale);
        let (l, k, o, e) = (&mut m.laser, &mut m.intrinsics, &mut m.offsets, &mut m.encoders);
        let additive = [
            (&mut l.x0, 0),
            (&mut l.y0, 1),
            (&mut l.vx, 2),
            (&mut l.vy, 3),
            (&mut k.cx, 5),
            (&mut k.cy, 6),
            (&mut o.tilt_y, 7),
            (&mut o.tilt_z, 8),
            (&mut o.pan_x, 9),
            (&mut o.pan_z, 10),
            (&mut e.pan_zero, 11),
            (&mut e.pan_scale, 12),
            (&mut e.tilt_zero, 13),
            (&mut e.tilt_scale, 14),
        ];
        for (value, i) in additive {
            *value += step[i];
        }
        m
    }

    /// The laser's ray in the rig's frame at the given readings plus small true angles, as
    /// [`laser_in_world`](Self::laser_in_world), with derivatives.
    pub fn laser_ray(&self, pan: f64, tilt: f64, turned: [f64; 2]) -> LaserRay {
        let (true_pan, true_tilt) = self.true_angles(pan, tilt);
        let (rp, rt) = (rotation_y(true_pan + turned[0]), rotation_x(true_tilt + turned[1]));
        let both = rp * rt;
        let o = &self.offsets;
        let (at, ap) = (Vector3::new(0.0, o.tilt_y, o.tilt_z), Vector3::new(o.pan_x, 0.0, o.pan_z));
        let l = &self.laser;
        let lever = rt * (Vector3::new(l.x0, l.y0, 0.0) + at);
        let aim = rt * Vector3::new(l.vx, l.vy, 1.0);
        let turned_lever = rp * (lever + ap);
        let direction = rp * aim;
        // d R_y / d pan = [e_y]x R_y, d R_x / d tilt = [e_x]x R_x.
        let by_pan = [Vector3::y().cross(&turned_lever), Vector3::y().cross(&direction)];
        let by_tilt = [rp * Vector3::x().cross(&lever), rp * Vector3::x().cross(&aim)];
        let zero = Vector3::zeros();
        let column = |m: &nalgebra::Matrix3<f64>, i: usize| -> Vector3<f64> { m.column(i).into() };
        let (e1, e2, e3) = (column(&both, 0), column(&both, 1), column(&both, 2));
        let origin_by = [
            e1,
            e2,
            zero,
            zero,
            zero,
            zero,
            zero,
            e2 - Vector3::y(),
            e3 - Vector3::z(),
            column(&rp, 0) - Vector3::x(),
            column(&rp, 2) - Vector3::z(),
            by_pan[0],
            by_pan[0] * pan,
            by_tilt[0],
            by_tilt[0] * tilt,
        ];
        let mut direction_by = [zero; RIG_PARAMETERS];
        (direction_by[2], direction_by[3]) = (e1, e2);
        (direction_by[11], direction_by[12]) = (by_pan[1], by_pan[1] * pan);
        (direction_by[13], direction_by[14]) = (by_tilt[1], by_tilt[1] * tilt);
        LaserRay { origin: turned_lever - at - ap, direction, origin_by, direction_by, by_pan, by_tilt }
    }

    /// [`spot_pixel`](Self::spot_pixel) with derivatives; `None` outside the lens model.
    pub fn spot_image(&self, rho: f64) -> Option<SpotImage> {
        let l = &self.laser;
        let baseline = Vector2::new(l.x0, l.y0);
        let lens = self.distortion.distort_with_jacobian(Vector2::new(l.vx, l.vy) + baseline * rho)?;
        let k = &self.intrinsics;
        let by_ideal = Matrix2::new(k.fx, k.skew, 0.0, k.fy) * lens.by_point;
        let pixel = k.to_pixel(&lens.point);
        let mut by = [Vector2::zeros(); RIG_PARAMETERS];
        let (bx, by_) = (by_ideal.column(0), by_ideal.column(1));
        (by[0], by[1], by[2], by[3]) = (bx * rho, by_ * rho, bx.into(), by_.into());
        by[4] = pixel - Vector2::new(k.cx, k.cy);
        (by[5], by[6]) = (Vector2::x(), Vector2::y());
        Some(SpotImage { pixel, by_rho: by_ideal * baseline, by })
    }

    /// How the point measured by a spot at inverse depth `rho` moves with the parameters, the spot
    /// staying where it is: d point / d parameter in the rig's frame. `weight`: inverse covariance of
    /// the spot, up to a factor. `None` outside the lens model and without a baseline.
    pub fn measured_point_by(
        &self,
        pan: f64,
        tilt: f64,
        rho: f64,
        weight: &Matrix2<f64>,
    ) -> Option<[Vector3<f64>; RIG_PARAMETERS]> {
        let (ray, image) = (self.laser_ray(pan, tilt, [0.0; 2]), self.spot_image(rho)?);
        // d rho / d parameter by the implicit function theorem at the spot's own optimum.
        let lever = weight * image.by_rho / image.by_rho.dot(&(weight * image.by_rho));
        let along = -ray.direction / (rho * rho);
        let moved = |i: usize| ray.origin_by[i] + ray.direction_by[i] / rho - along * lever.dot(&image.by[i]);
        let by = std::array::from_fn(moved);
        by.iter().all(|v| v.iter().all(|x| x.is_finite())).then_some(by)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stepped(i: usize, h: f64) -> RigModel {
        let mut step = [0.0; RIG_PARAMETERS];
        step[i] = h;
        rig().moved(&step)
    }

    fn rig() -> RigModel {
        RigModel::crooked()
    }

    #[test]
    fn moving_adds_to_the_parameters() {
        let before = rig().parameters();
        for i in 0..RIG_PARAMETERS {
            let after = stepped(i, 0.01).parameters();
            for j in 0..RIG_PARAMETERS {
                let wanted = before[j] + if i == j { 0.01 } else { 0.0 };
                assert!((after[j] - wanted).abs() < 1e-12, "{} {j}", RigParameter::ALL[i].name());
            }
            assert_eq!(RigParameter::ALL[i] as usize, i);
        }
        let m = stepped(4, 0.01);
        assert!((m.intrinsics.fy / m.intrinsics.fx - 802.0 / 800.0).abs() < 1e-12, "the aspect is kept");
    }

    #[test]
    fn derivatives_match_finite_differences() {
        let (pan, tilt, rho, h) = (0.4, -0.3, 0.45, 1e-6);
        let ray = rig().laser_ray(pan, tilt, [0.0; 2]);
        let (o, d) = rig().laser_in_world(pan, tilt);
        assert!((ray.origin - o).norm() < 1e-15 && (ray.direction - d).norm() < 1e-15);
        let spot = rig().spot_image(rho).unwrap();
        assert!((spot.pixel - rig().spot_pixel(rho).unwrap()).norm() < 1e-12);
        for i in 0..RIG_PARAMETERS {
            let (plus, minus) = (stepped(i, h), stepped(i, -h));
            let ((o1, d1), (o0, d0)) = (plus.laser_in_world(pan, tilt), minus.laser_in_world(pan, tilt));
            let name = RigParameter::ALL[i].name();
            assert!((ray.origin_by[i] - (o1 - o0) / (2.0 * h)).norm() < 1e-8, "origin by {name}");
            assert!((ray.direction_by[i] - (d1 - d0) / (2.0 * h)).norm() < 1e-8, "direction by {name}");
            let numeric = (plus.spot_pixel(rho).unwrap() - minus.spot_pixel(rho).unwrap()) / (2.0 * h);
            assert!((spot.by[i] - numeric).norm() < 1e-4, "spot by {name}");
        }
        let numeric = (rig().spot_pixel(rho + h).unwrap() - rig().spot_pixel(rho - h).unwrap()) / (2.0 * h);
        assert!((spot.by_rho - numeric).norm() < 1e-5);
        for (k, by) in [&ray.by_pan, &ray.by_tilt].into_iter().enumerate() {
            let at = |s: f64| rig().laser_ray(pan, tilt, std::array::from_fn(|i| if i == k { s } else { 0.0 }));
            let (plus, minus) = (at(h), at(-h));
            assert!((by[0] - (plus.origin - minus.origin) / (2.0 * h)).norm() < 1e-8);
            assert!((by[1] - (plus.direction - minus.direction) / (2.0 * h)).norm() < 1e-8);
        }
    }

    #[test]
    fn a_measured_point_moves_as_finite_differences_say() {
        let (pan, tilt, h) = (0.4, -0.3, 1e-6);
        // On the laser's line: of one beside it the residual's share, of second order, is left out.
        let spot = rig().spot_pixel(0.45).unwrap();
        let covariance = Matrix2::new(0.04, 0.01, 0.01, 0.09);
        let point = |rig: &RigModel| rig.measure(pan, tilt, &spot, &covariance).unwrap().point;
        let weight = covariance.try_inverse().unwrap();
        let by = rig().measured_point_by(pan, tilt, point(&rig()).rho, &weight).unwrap();
        for (i, by) in by.iter().enumerate() {
            let (plus, minus) = (point(&stepped(i, h)).point().unwrap(), point(&stepped(i, -h)).point().unwrap());
            let numeric = (plus - minus) / (2.0 * h);
            let name = RigParameter::ALL[i].name();
            assert!((by - numeric).norm() < 2e-3 * (1.0 + numeric.norm()), "{name}: {by} {numeric}");
        }
    }
}
