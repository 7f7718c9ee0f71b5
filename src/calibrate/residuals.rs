//! Residuals of all measurements under a camera. Exact points, of which there may be very many, are
//! projected a block at a time.
#![allow(unsafe_code)]

use nalgebra::{Matrix2, Vector2, Vector3};

use super::block::{LANES, Lanes};
use super::measurement::{Measurement, PointMeasurement, squared_distance};
use crate::geometry::distortion::MIN_LENGTH;
use crate::geometry::{Camera, Distortion, Intrinsics, Rigid};
use crate::vectors::for_each_processor;

/// Measured minus predicted pixel of each measurement at its measured depth (of a line the distances of
/// its segment's ends); infinite where the camera cannot see it.
pub(super) fn residuals(measurements: &[Measurement], camera: &Camera) -> Vec<Vector2<f64>> {
    let mut found = vec![Vector2::repeat(f64::INFINITY); measurements.len()];
    for_each_residual(measurements, camera, |index, r, _| found[index] = *r);
    found
}

/// Squared Mahalanobis distances, in units of the stated or assumed noise; infinite where the camera
/// cannot see the measurement.
pub(super) fn distances(measurements: &[Measurement], camera: &Camera) -> Vec<f64> {
    let mut found = vec![f64::INFINITY; measurements.len()];
    for_each_residual(measurements, camera, |index, r, c| found[index] = squared_distance(r, c));
    found
}

/// Measured minus predicted pixels of points, infinite where the camera cannot see them.
pub(crate) fn of_points(
    camera: &Camera,
    points: impl Iterator<Item = (Vector3<f64>, Vector2<f64>)>,
) -> Vec<Vector2<f64>> {
    let mut found = Vec::with_capacity(points.size_hint().0);
    let mut projector = Projector::new(camera);
    for (point, pixel) in points {
        if projector.add(&point, &pixel) {
            found.extend(projector.flush());
        }
    }
    found.extend(projector.flush());
    found
}

/// Residuals of what the camera sees, with their covariances.
fn for_each_residual(
    measurements: &[Measurement],
    camera: &Camera,
    mut each: impl FnMut(usize, &Vector2<f64>, &Matrix2<f64>),
) {
    let mut projector = Projector::new(camera);
    let mut points: Vec<(usize, &PointMeasurement)> = Vec::with_capacity(LANES);
    let mut take = |points: &mut Vec<(usize, &PointMeasurement)>, residuals: &mut dyn Iterator<Item = Vector2<f64>>| {
        for ((index, m), r) in points.drain(..).zip(residuals) {
            each(index, &r, &m.pixel_covariance);
        }
    };
    let mut others = Vec::new();
    for (index, m) in measurements.iter().enumerate() {
        match m {
            Measurement::Point(point) if point.is_exact() => {
                points.push((index, point));
                if projector.add(&point.homogeneous(0.0).xyz(), &point.pixel) {
                    take(&mut points, &mut projector.flush());
                }
            }
            _ => others.push((index, m)),
        }
    }
    take(&mut points, &mut projector.flush());
    for (index, m) in others {
        if let Some((r, c)) = m.residual(camera) {
            each(index, &r, &c);
        }
    }
}

/// Projects points of a camera a block at a time.
struct Projector<'a> {
    camera: &'a Camera,
    /// Of the lenses with a loop of their own here.
    lens: Option<[f64; 5]>,
    /// Points, then pixels.
    lanes: [Lanes; 5],
    count: usize,
}

impl<'a> Projector<'a> {
    fn new(camera: &'a Camera) -> Self {
        let lens = match camera.distortion {
            Distortion::None => Some([0.0; 5]),
            Distortion::BrownConrady(k) => Some(k),
            Distortion::Division(_) | Distortion::Fisheye(_) => None,
        };
        Self { camera, lens, lanes: [[0.0; LANES]; 5], count: 0 }
    }

    /// True when the block is full.
    fn add(&mut self, point: &Vector3<f64>, pixel: &Vector2<f64>) -> bool {
        for (lane, value) in self.lanes.iter_mut().zip([point.x, point.y, point.z, pixel.x, pixel.y]) {
            lane[self.count] = value;
        }
        self.count += 1;
        self.count == LANES
    }

    /// The residuals of what was added, infinite where nothing is seen.
    fn flush(&mut self) -> impl Iterator<Item = Vector2<f64>> + '_ {
        let count = std::mem::take(&mut self.count);
        let (camera, lanes) = (self.camera, &mut self.lanes);
        let depths = self.lens.map(|lens| project(lanes, &camera.pose, &camera.intrinsics, &lens));
        let lanes = &*lanes;
        (0..count).map(move |l| {
            let [x, y, z, u, v] = lanes.each_ref().map(|lane| lane[l]);
            let residual = match &depths {
                Some(depths) => (depths[l] > MIN_LENGTH).then_some(Vector2::new(u, v)),
                None => camera.project(&Vector3::new(x, y, z)).map(|pixel| Vector2::new(u, v) - pixel),
            };
            residual.filter(|r| r.x.is_finite() && r.y.is_finite()).unwrap_or(Vector2::repeat(f64::INFINITY))
        })
    }
}

for_each_processor! {
    /// From points and pixels to residuals, in place of the pixels; the depths.
    fn project(lanes: &mut [Lanes; 5], pose: &Rigid, k: &Intrinsics, lens: &[f64; 5]) -> Lanes {
        let (r, t) = (&pose.rotation, &pose.translation);
        let [k1, k2, p1, p2, k3] = *lens;
        let [px, py, pz, pixel_x, pixel_y] = lanes;
        let mut depth = [0.0; LANES];
        for l in 0..LANES {
            let x = r.m11 * px[l] + r.m12 * py[l] + r.m13 * pz[l] + t.x;
            let y = r.m21 * px[l] + r.m22 * py[l] + r.m23 * pz[l] + t.y;
            let z = r.m31 * px[l] + r.m32 * py[l] + r.m33 * pz[l] + t.z;
            depth[l] = z;
            let iz = 1.0 / z;
            let (u, v) = (x * iz, y * iz);
            let r2 = u * u + v * v;
            let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
            let uv = 2.0 * u * v;
            let a = u * radial + p1 * uv + p2 * (r2 + 2.0 * u * u);
            let b = v * radial + p1 * (r2 + 2.0 * v * v) + p2 * uv;
            pixel_x[l] -= k.fx * a + k.skew * b + k.cx;
            pixel_y[l] -= k.fy * b + k.cy;
        }
        depth
    }
}
