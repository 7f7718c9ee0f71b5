//! Segments of an image with depths, as lines in space.
//!
//! Depth cameras are worst just where lines are: at the edges of things they mix what is before with
//! what is behind, and their edges are off by a pixel or two from the colour image's. So the depths
//! are taken from a strip on either side, a little away from the line. A plane's inverse depth is
//! linear in the undistorted image: a robust fit of such a plane to each strip says how deep the
//! surface is where it meets the line's viewing plane, and the two meet in the line.

use nalgebra::{Matrix2, Matrix3, Matrix6, SMatrix, Vector2, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use super::LineSegment;
use crate::error::{Error, Result};
use crate::geometry::{Camera, MeasuredLine};
use crate::image::{DepthMap, DepthNoise};

/// The strips begin and end at these distances from the line, pixels.
const STRIP: std::ops::RangeInclusive<i32> = 2..=7;
/// Most places along the line.
const MAX_STATIONS: f64 = 64.0;
/// Fewest depths of a strip, and the least share of its pixels that must lie in one plane.
const MIN_DEPTHS: usize = 18;
const MIN_SHARE: f64 = 0.5;
const SAMPLES: usize = 60;
/// Standard deviations beyond which a depth belongs to something else.
const REJECT: f64 = 3.0;
/// Depths within this area, px^2, err alike: depth cameras match windows of about 5 x 5 pixels.
const ALIKE: f64 = 25.0;
/// Chi-square with two degrees of freedom, 1 in 1000: both sides are at one depth below it.
const CHI_SQUARE: f64 = 13.8;

/// The segments of an image as lines in space (the camera's world), each in its segment's direction and
/// `None` where depths are missing on either side or contradict each other.
///
/// Where the depth differs from side to side, the line is the edge of what is in front. It is taken to
/// be an edge of the thing itself: the outline of a round one is a line too, but another one from
/// every side.
///
/// # Errors
/// `InvalidArgument` for noise or a camera that are none, and a map that has not the image's size;
/// `NotFinite` for segments that are not finite.
pub fn lift_segments(
    segments: &[LineSegment],
    camera: &Camera,
    depth: &DepthMap,
    noise: &DepthNoise,
) -> Result<Vec<Option<MeasuredLine>>> {
    camera.validate()?;
    noise.check()?;
    let size = |w: usize, h: usize| format!("{w} x {h} pixels");
    let [given, wanted] = [(depth.width(), depth.height()), (camera.width as usize, camera.height as usize)];
    if given != wanted {
        let reason = format!("{}, the camera's image has {}", size(given.0, given.1), size(wanted.0, wanted.1));
        return Err(Error::invalid("depth", reason));
    }
    super::check_segments(segments)?;
    let view = View { camera, depth, noise };
    Ok(segments.iter().map(|s| view.lift(s)).collect())
}

/// An image with depths.
struct View<'a> {
    camera: &'a Camera,
    depth: &'a DepthMap,
    noise: &'a DepthNoise,
}

/// A place in a strip: along and across the line in the undistorted image, and its inverse depth.
struct Depth {
    along: f64,
    across: f64,
    rho: f64,
    variance: f64,
}

/// Inverse depth on the line, as `rho[0]` where `along` is 0 and `rho[1]` where it is 1, and its
/// covariance.
#[derive(Clone, Copy)]
struct Surface {
    rho: Vector2<f64>,
    covariance: Matrix2<f64>,
}

impl View<'_> {
    fn lift(&self, segment: &LineSegment) -> Option<MeasuredLine> {
        let camera = self.camera;
        let [a, b] = segment.points.map(|p| camera.undistort_pixel(&p));
        let [a, b] = [a?, b?];
        let base = b - a;
        let frame = Frame { origin: a, base, scale: 1.0 / base.norm_squared() };
        let sides = [-1.0, 1.0].map(|side| {
            let (depths, places, area) = self.strip(segment, &frame, side);
            surface(&depths, places, area)
        });
        let front = choose(sides[0]?, sides[1]?)?;
        if front.rho.min() <= 0.0 {
            return None;
        }
        // Both points with their covariance: across the image line, and in depth.
        let to_world = camera.pose.rotation.transpose();
        let mut x = [Vector3::zeros(); 2];
        let mut covariance = Matrix6::zeros();
        let mut by_depth = SMatrix::<f64, 6, 2>::zeros();
        for (i, m) in [a, b].iter().enumerate() {
            let ray = m.push(1.0) / front.rho[i];
            x[i] = to_world * (ray - camera.pose.translation);
            by_depth.fixed_view_mut::<3, 1>(3 * i, i).copy_from(&(to_world * ray / -front.rho[i]));
            let moved = camera.undistort_pixel(&(segment.points[i] + segment.normal()))? - m;
            let across = to_world * moved.push(0.0) / front.rho[i];
            let c: Matrix3<f64> = across * across.transpose() * segment.variance;
            covariance.fixed_view_mut::<3, 3>(3 * i, 3 * i).copy_from(&c);
        }
        covariance += by_depth * front.covariance * by_depth.transpose();
        let length = (x[1] - x[0]).norm();
        let direction = (x[1] - x[0]).try_normalize(1e-12)?;
        let point = (x[0] + x[1]) * 0.5;
        // (point, direction) is linear in the two points but for the length, which has no effect.
        let mut t = Matrix6::zeros();
        for (row, column, value) in [(0, 0, 0.5), (0, 3, 0.5), (3, 0, -1.0 / length), (3, 3, 1.0 / length)] {
            t.fixed_view_mut::<3, 3>(row, column).copy_from(&(Matrix3::identity() * value));
        }
        let covariance = t * covariance * t.transpose();
        let mut extent = [0.0; 2];
        for (s, end) in extent.iter_mut().zip(&segment.ends) {
            let m = camera.undistort_pixel(end)?;
            let [along, _] = frame.place(&m);
            let rho = front.rho[0] + along * (front.rho[1] - front.rho[0]);
            if rho <= 0.0 {
                return None;
            }
            let at = to_world * (m.push(1.0) / rho - camera.pose.translation);
            *s = (at - point).dot(&direction);
        }
        let covariance = (covariance + covariance.transpose()) * 0.5;
        let finite = covariance.iter().chain(point.iter()).all(|v| v.is_finite());
        finite.then_some(MeasuredLine { point, direction, covariance, extent })
    }

    /// The depths of one strip, how many there could be, and the area that each stands for, px^2.
    fn strip(&self, segment: &LineSegment, frame: &Frame, side: f64) -> (Vec<Depth>, usize, f64) {
        let length = segment.length();
        let stations = length.min(MAX_STATIONS).floor().max(2.0);
        let normal = segment.normal() * side;
        let mut depths = Vec::new();
        let mut places = 0;
        for i in 0..stations as usize {
            let on = segment.ends[0] + (segment.ends[1] - segment.ends[0]) * ((i as f64 + 0.5) / stations);
            for k in STRIP {
                places += 1;
                let pixel = (on + normal * f64::from(k)).map(f64::round);
                if pixel.x < 0.0 || pixel.y < 0.0 {
                    continue;
                }
                let Some(z) = self.depth.at(pixel.x as usize, pixel.y as usize) else { continue };
                let Some(m) = self.camera.undistort_pixel(&pixel) else { continue };
                let [along, across] = frame.place(&m);
                let rho = 1.0 / z;
                depths.push(Depth { along, across, rho, variance: self.noise.variance(rho) });
            }
        }
        (depths, places, length / stations)
    }
}

/// Coordinates in the undistorted image: from the first point (along 0) to the second (along 1).
struct Frame {
    origin: Vector2<f64>,
    base: Vector2<f64>,
    scale: f64,
}

impl Frame {
    fn place(&self, m: &Vector2<f64>) -> [f64; 2] {
        let d = m - self.origin;
        [d.dot(&self.base) * self.scale, d.perp(&self.base) * self.scale]
    }
}

/// The plane that most depths of a strip agree with, where it meets the line.
fn surface(depths: &[Depth], places: usize, area: f64) -> Option<Surface> {
    let n = depths.len();
    if n < MIN_DEPTHS || (n as f64) < MIN_SHARE * places as f64 {
        return None;
    }
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut draw = || &depths[(rng.next_u64() % n as u64) as usize];
    let row = |d: &Depth| Vector3::new(1.0 - d.along, d.along, d.across);
    let limit = REJECT * REJECT;
    let off = |plane: &Vector3<f64>, d: &Depth| (d.rho - plane.dot(&row(d))).powi(2) / d.variance;
    let mut best: Option<(f64, Vector3<f64>)> = None;
    for _ in 0..SAMPLES {
        let sample = [draw(), draw(), draw()];
        let m = Matrix3::from_rows(&sample.map(|d| row(d).transpose()));
        let Some(plane) = m.try_inverse().map(|m| m * Vector3::from(sample.map(|d| d.rho))) else { continue };
        let score: f64 = depths.iter().map(|d| off(&plane, d).min(limit)).sum();
        if score.is_finite() && best.as_ref().is_none_or(|(least, _)| score < *least) {
            best = Some((score, plane));
        }
    }
    let mut plane = best?.1;
    let mut result = None;
    for _ in 0..4 {
        let (mut h, mut g, mut chi, mut count) = (Matrix3::zeros(), Vector3::zeros(), 0.0, 0.0);
        for d in depths.iter().filter(|d| off(&plane, d) <= limit) {
            let r = row(d);
            h += r * r.transpose() / d.variance;
            g += r * (d.rho / d.variance);
            chi += off(&plane, d);
            count += 1.0;
        }
        if count < MIN_SHARE * places as f64 || count < MIN_DEPTHS as f64 {
            return None;
        }
        let inverse = h.try_inverse()?;
        plane = inverse * g;
        let independent = (ALIKE / area).max(1.0);
        let factor = independent * (chi / (count - 3.0)).max(1.0);
        result = Some(Surface { rho: plane.xy(), covariance: inverse.fixed_view::<2, 2>(0, 0) * factor });
    }
    result
}

/// Both sides at one depth: their mean by weight. Else the one in front, if it is at both points.
fn choose(a: Surface, b: Surface) -> Option<Surface> {
    let apart = a.rho - b.rho;
    let sum = (a.covariance + b.covariance).try_inverse()?;
    if apart.dot(&(sum * apart)) <= CHI_SQUARE {
        // a + C_a (C_a + C_b)^-1 (b - a)
        let gain = a.covariance * sum;
        let covariance = a.covariance - gain * a.covariance;
        return Some(Surface { rho: a.rho - gain * apart, covariance: (covariance + covariance.transpose()) * 0.5 });
    }
    if apart.min() > 0.0 {
        Some(a)
    } else if apart.max() < 0.0 {
        Some(b)
    } else {
        None
    }
}
