//! Aiming the laser at a point in space, in closed form (thesis IV.C; maths.md section 2).

use nalgebra::{Vector2, Vector3};

use crate::error::{Error, Result};
use crate::geometry::RigModel;

/// Where to turn the head so that the laser's line passes through a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aim {
    /// The device's readings, radians, turned back into [-pi, pi] of the model's true pan.
    pub pan: f64,
    pub tilt: f64,
    /// Depth of the point along the head camera's axis, metres.
    pub depth: f64,
}

impl Aim {
    /// A head that turns further than half way round may read the same direction a turn on: the pan
    /// within the range, where there is one.
    pub(crate) fn turned_into(self, model: &RigModel, [low, high]: [f64; 2]) -> Self {
        let turn = std::f64::consts::TAU / model.encoders.pan_scale.abs();
        let within = |p: &f64| (low..=high).contains(p);
        let pan = [self.pan, self.pan + turn, self.pan - turn].into_iter().find(within).unwrap_or(self.pan);
        Self { pan, ..self }
    }
}

/// Accepted distance of the point from the aimed laser line, metres, and its growth with distance
/// (rounding in the rotations).
const MAX_MISS: f64 = 1e-9;
const MAX_RELATIVE_MISS: f64 = 1e-13;

/// The pan and tilt at which the laser's line passes through `point` (world, metres), in front of
/// the head.
///
/// With M = (x0 + vx Z, y0 + vy Z, Z) and W = point + a_t + a_p, the model reads
/// W = R_y(pan) (R_x(tilt) (M + a_t) + a_p). R_x keeps the length of the (y, z) part and R_y that of
/// the (x, z) part, which leaves one equation in Z. Without an offset of the pan axis along z it is
/// a quadratic; with one, its root starts Newton's method. The angles follow from Z.
///
/// # Errors
/// `NotFinite`; `Unreachable` for points nearer than the laser's distance from the axes.
pub fn aim_at_point(model: &RigModel, point: &Vector3<f64>) -> Result<Aim> {
    if let Some(index) = point.iter().position(|v| !v.is_finite()) {
        return Err(Error::NotFinite { name: "point", index });
    }
    let out_of_reach = |why: &str| Error::Unreachable {
        reason: format!("({:.4}, {:.4}, {:.4}) m is {why}", point.x, point.y, point.z),
    };
    let equation = DepthEquation::new(model, point);
    let depth = equation.solve().ok_or_else(|| out_of_reach("nearer than the laser's distance from the axes"))?;
    let beam = equation.origin + equation.slope * depth;
    let forward = equation.forward(depth).ok_or_else(|| out_of_reach("above or below the axes"))?;
    let w = &equation.target;
    let tilt = beam.y.atan2(beam.z) - w.y.atan2(forward);
    let pan = wrap(w.x.atan2(w.z) - (beam.x + model.offsets.pan_x).atan2(forward + model.offsets.pan_z));
    let (pan, tilt) = model.readings(pan, tilt);
    let miss = miss(model, pan, tilt, point);
    if miss.is_nan() || miss > MAX_MISS + MAX_RELATIVE_MISS * point.norm() {
        return Err(out_of_reach("not on any laser line"));
    }
    Ok(Aim { pan, tilt, depth })
}

/// The world point seen at a pixel of the head camera, `depth` metres along its axis, at the given
/// readings.
///
/// # Errors
/// `NotFinite`; `InvalidArgument` for a depth that is not positive and pixels outside the lens model.
pub fn point_at_pixel(model: &RigModel, pan: f64, tilt: f64, pixel: &Vector2<f64>, depth: f64) -> Result<Vector3<f64>> {
    if let Some(index) = [pixel.x, pixel.y, depth].iter().position(|v| !v.is_finite()) {
        return Err(Error::NotFinite { name: "pixel and depth", index });
    }
    if depth <= 0.0 {
        return Err(Error::invalid("depth", format!("{depth} m is not in front of the camera")));
    }
    let ideal = model
        .head_camera(pan, tilt)
        .undistort_pixel(pixel)
        .ok_or_else(|| Error::invalid("pixel", format!("({}, {}) is outside the lens model", pixel.x, pixel.y)))?;
    Ok(model.head_to_world(pan, tilt).apply(&(ideal.push(1.0) * depth)))
}

/// Distance of a point from the laser's line at the given readings, metres.
fn miss(model: &RigModel, pan: f64, tilt: f64, point: &Vector3<f64>) -> f64 {
    let (origin, direction) = model.laser_in_world(pan, tilt);
    (point - origin).cross(&direction).norm() / direction.norm()
}

fn wrap(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    (angle + PI).rem_euclid(TAU) - PI
}

/// |(x, z) of W|^2 = (x(Z) + pan_x)^2 + (forward(Z) + pan_z)^2, whose root Z is the depth.
struct DepthEquation {
    /// W.
    target: Vector3<f64>,
    /// M + a_t = origin + slope Z.
    origin: Vector3<f64>,
    slope: Vector3<f64>,
    pan_x: f64,
    pan_z: f64,
}

impl DepthEquation {
    fn new(model: &RigModel, point: &Vector3<f64>) -> Self {
        let (l, o) = (&model.laser, &model.offsets);
        Self {
            target: point + Vector3::new(o.pan_x, o.tilt_y, o.tilt_z + o.pan_z),
            origin: Vector3::new(l.x0, l.y0 + o.tilt_y, o.tilt_z),
            slope: Vector3::new(l.vx, l.vy, 1.0),
            pan_x: o.pan_x,
            pan_z: o.pan_z,
        }
    }

    /// z of R_x(tilt) (M + a_t), ahead of the axes.
    fn forward(&self, depth: f64) -> Option<f64> {
        let beam = self.origin + self.slope * depth;
        let square = beam.y * beam.y + beam.z * beam.z - self.target.y * self.target.y;
        (square > 0.0).then(|| square.sqrt())
    }

    fn solve(&self) -> Option<f64> {
        let mut depth = self.solve_without_pan_z()?;
        if self.pan_z != 0.0 {
            depth = self.polish(depth)?;
        }
        (depth > 0.0 && depth.is_finite()).then_some(depth)
    }

    /// pan_z = 0 turns the equation into |origin + (pan_x, 0, 0) + slope Z|^2 = |W|^2; + root.
    fn solve_without_pan_z(&self) -> Option<f64> {
        let mut origin = self.origin;
        origin.x += self.pan_x;
        let a = self.slope.norm_squared();
        let b = self.slope.dot(&origin);
        let c = origin.norm_squared() - self.target.norm_squared();
        let discriminant = b * b - a * c;
        if discriminant < 0.0 {
            return None;
        }
        // The form without cancellation, for either sign of b.
        let root = discriminant.sqrt();
        Some(if b > 0.0 { -c / (b + root) } else { (root - b) / a })
    }

    /// Newton's method inside a bracket: the equation grows with depth from where the beam's end is
    /// level with the pan axis. Converges quadratically as the offset is small against the distance.
    fn polish(&self, start: f64) -> Option<f64> {
        let target = self.target.x.hypot(self.target.z);
        // The depth at which forward(Z) = max(0, -pan_z).
        let least = self.pan_z.min(0.0);
        let (origin, slope) = (self.origin.yz(), self.slope.yz());
        let (a, b) = (slope.norm_squared(), slope.dot(&origin));
        let c = origin.norm_squared() - self.target.y * self.target.y - least * least;
        let mut low = ((b * b - a * c).max(0.0).sqrt() - b) / a;
        let mut high = f64::INFINITY;
        let mut depth = start.max(low);
        for _ in 0..200 {
            let beam = self.origin + self.slope * depth;
            let forward = self.forward(depth).unwrap_or(0.0);
            let (x, z) = (beam.x + self.pan_x, forward + self.pan_z);
            let value = x.hypot(z) - target;
            if value > 0.0 {
                high = depth
            } else {
                low = depth
            }
            let forward_slope = (beam.y * self.slope.y + beam.z * self.slope.z) / forward;
            let step = value * x.hypot(z) / (x * self.slope.x + z * forward_slope);
            let mut next = depth - step;
            if !(next > low && next < high) {
                next = if high.is_finite() { 0.5 * (low + high) } else { 2.0 * depth.abs() + 1.0 };
            }
            if (next - depth).abs() <= 4.0 * f64::EPSILON * depth.abs() {
                break;
            }
            depth = next;
        }
        // The caller judges the result by its distance from the laser line.
        Some(depth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rig_model::{AxisOffsets, Encoders, LaserLine};
    use crate::geometry::{Distortion, Intrinsics};
    use crate::rig::fake::Random;

    fn random_model(random: &mut Random, offset: f64) -> RigModel {
        RigModel {
            width: 720,
            height: 576,
            intrinsics: Intrinsics::new(800.0, 360.0, 288.0),
            distortion: Distortion::BrownConrady([-0.1, 0.02, 0.001, -0.0005, 0.0]),
            laser: LaserLine {
                x0: random.between(-0.2, 0.2),
                y0: random.between(-0.2, 0.2),
                vx: random.between(-0.05, 0.05),
                vy: random.between(-0.05, 0.05),
            },
            offsets: AxisOffsets {
                tilt_y: random.between(-offset, offset),
                tilt_z: random.between(-offset, offset),
                pan_x: random.between(-offset, offset),
                pan_z: random.between(-offset, offset),
            },
            encoders: Encoders {
                pan_zero: random.between(-0.2, 0.2),
                pan_scale: random.between(0.95, 1.05),
                tilt_zero: random.between(-0.1, 0.1),
                tilt_scale: random.between(0.95, 1.05) * if random.between(0.0, 1.0) < 0.2 { -1.0 } else { 1.0 },
            },
        }
    }

    #[test]
    fn the_laser_passes_through_every_point_it_is_aimed_at() {
        let mut random = Random(1);
        for case in 0..20_000 {
            let model = random_model(&mut random, [0.0, 0.02, 0.1][case % 3]);
            // Any direction up to 75 degrees of elevation, far enough out for every laser and offset.
            let azimuth = random.between(-3.0, 3.0);
            let elevation = random.between(-1.3, 1.3);
            let (sin, cos) = elevation.sin_cos();
            let distance = 0.7 / cos * (random.between(0.0, 1.0) * 5.0f64).exp();
            let point =
                Vector3::new(azimuth.sin() * cos, -sin, azimuth.cos() * cos) * distance + random.vector() * 0.01;
            let aim = aim_at_point(&model, &point).unwrap_or_else(|e| panic!("{case}: {e} {model:?}"));
            assert!(miss(&model, aim.pan, aim.tilt, &point) < 1e-9, "{case}: {aim:?}");
            let (origin, direction) = model.laser_in_world(aim.pan, aim.tilt);
            assert!(aim.depth > 0.0 && (origin + direction * aim.depth - point).norm() < 1e-9, "{case}: {aim:?}");
        }
    }

    #[test]
    fn an_aim_gives_back_the_pan_and_tilt_of_a_shot() {
        let mut random = Random(2);
        for case in 0..5_000 {
            let model = RigModel { encoders: Encoders::default(), ..random_model(&mut random, 0.05) };
            let (pan, tilt, depth) = (random.between(-3.0, 3.0), random.between(-1.2, 1.2), random.between(0.8, 50.0));
            let (origin, direction) = model.laser_in_world(pan, tilt);
            let aim = aim_at_point(&model, &(origin + direction * depth)).unwrap();
            assert!((aim.pan - pan).abs() < 1e-9 && (aim.tilt - tilt).abs() < 1e-9, "{case}: {aim:?} {pan} {tilt}");
            assert!((aim.depth - depth).abs() < 1e-8, "{case}: {aim:?}");
        }
    }

    #[test]
    fn points_out_of_reach_are_refused_with_a_reason() {
        let mut random = Random(3);
        for case in 0..1000 {
            let model = random_model(&mut random, [0.0, 0.05][case % 2]);
            let axes =
                Vector3::new(model.offsets.pan_x, model.offsets.tilt_y, model.offsets.tilt_z + model.offsets.pan_z);
            // Inside the cylinder and the sphere that the laser's line cannot enter.
            let inside = random.vector().normalize() * 1e-4 - axes;
            match aim_at_point(&model, &inside) {
                Err(Error::Unreachable { reason }) => assert!(reason.contains(" m is ")),
                // A laser that happens to pass the axes within 0.1 mm reaches it.
                Ok(aim) => assert!(miss(&model, aim.pan, aim.tilt, &inside) < 1e-9 && aim.depth > 0.0),
                Err(e) => panic!("{e}"),
            }
        }
        let plain = RigModel { offsets: AxisOffsets::default(), ..random_model(&mut random, 0.0) };
        for point in [Vector3::zeros(), Vector3::y() * 3.0, Vector3::new(0.0, 0.0, 0.5 * plain.laser.x0.abs())] {
            let refused = aim_at_point(&plain, &point);
            assert!(matches!(refused, Err(Error::Unreachable { .. })), "{point}: {refused:?}");
        }
        let nan = Vector3::new(0.0, f64::NAN, 1.0);
        assert_eq!(aim_at_point(&plain, &nan), Err(Error::NotFinite { name: "point", index: 1 }));
        assert!(aim_at_point(&plain, &Vector3::new(1.0, f64::INFINITY, 1.0)).is_err());
    }

    #[test]
    fn a_pixel_with_its_depth_is_the_point_seen_there() {
        let mut random = Random(4);
        for _ in 0..200 {
            let model = random_model(&mut random, 0.05);
            let (pan, tilt) = (random.between(-1.0, 1.0), random.between(-0.5, 0.5));
            let pixel = Vector2::new(random.between(0.0, 719.0), random.between(0.0, 575.0));
            let depth = random.between(0.5, 20.0);
            let point = point_at_pixel(&model, pan, tilt, &pixel, depth).unwrap();
            let camera = model.head_camera(pan, tilt);
            assert!((camera.project(&point).unwrap() - pixel).norm() < 1e-7);
            assert!((camera.pose.apply(&point).z - depth).abs() < 1e-9);
        }
        let model = random_model(&mut random, 0.0);
        assert!(point_at_pixel(&model, 0.0, 0.0, &Vector2::new(360.0, 288.0), -1.0).is_err());
        assert!(point_at_pixel(&model, 0.0, 0.0, &Vector2::new(f64::NAN, 288.0), 1.0).is_err());
    }
}
