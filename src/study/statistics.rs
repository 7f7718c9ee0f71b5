//! What a study keeps of its trials.

use nalgebra::{Vector2, Vector3};

use super::information::NoiseLevel;
use super::method::Method;
use crate::geometry::{Camera, rigid};

/// What is measured of a camera's error, in the order of every array of four.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(usize)]
pub enum Quantity {
    /// Distance of the centre from the true one, metres.
    Centre = 0,
    /// Angle of the rotation from the true one, radians.
    Rotation = 1,
    /// |(dfx, dfy)|, px.
    Focal = 2,
    /// Distance of the principal point from the true one, px.
    PrincipalPoint = 3,
}

impl Quantity {
    pub const COUNT: usize = 4;
}

/// Trials whose centres are kept, for a scatter plot.
pub const KEPT_CENTRES: usize = 200;
/// Components of the error vectors: centre 3, rotation 3, focal 2, principal point 2.
const COMPONENTS: usize = 10;
const GROUPS: [std::ops::Range<usize>; Quantity::COUNT] = [0..3, 3..6, 6..8, 8..10];

/// Errors of one method at one noise level over all trials.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    pub method: Method,
    pub level: NoiseLevel,
    /// Trials that gave a camera, and those that did not.
    pub used: usize,
    pub failures: usize,
    /// Mean size of the error, by [`Quantity`].
    pub mean: [f64; Quantity::COUNT],
    /// Root mean square size.
    pub rms: [f64; Quantity::COUNT],
    /// Size of the mean error: what more trials, or more shots, do not take away.
    pub bias: [f64; Quantity::COUNT],
    /// Root mean square error of a point handed off at each of the study's distances, metres.
    pub handoff: Vec<f64>,
    /// The first trials' centre errors, metres.
    pub centres: Vec<Vector3<f64>>,
}

/// Sums over trials.
#[derive(Debug, Clone, Default)]
pub(super) struct Sums {
    used: usize,
    failures: usize,
    errors: [f64; COMPONENTS],
    sizes: [f64; Quantity::COUNT],
    squares: [f64; Quantity::COUNT],
    handoff: Vec<f64>,
    centres: Vec<Vector3<f64>>,
}

/// Where points are handed off: rays of the true camera, and distances along them.
pub(super) struct HandOff {
    rays: Vec<(Vector2<f64>, Vector3<f64>, Vector3<f64>)>,
    pub distances: Vec<f64>,
}

impl HandOff {
    /// A 3 x 3 grid of pixels, a sixth of the image from its border.
    pub fn pixels(camera: &Camera) -> Vec<Vector2<f64>> {
        let at = |i: usize, size: u32| (2 * i + 1) as f64 / 6.0 * f64::from(size) - 0.5;
        (0..9).map(|k| Vector2::new(at(k % 3, camera.width), at(k / 3, camera.height))).collect()
    }

    pub fn new(camera: &Camera, distances: &[f64]) -> Self {
        let ray = |pixel: Vector2<f64>| {
            let ray = camera.back_project(&pixel)?;
            Some((pixel, ray.origin, ray.direction))
        };
        Self { rays: Self::pixels(camera).into_iter().filter_map(ray).collect(), distances: distances.to_vec() }
    }

    /// Mean squared distance at each distance between where the true camera and another one see the pixels.
    fn squared_errors(&self, camera: &Camera) -> Option<Vec<f64>> {
        let mut sums = vec![0.0; self.distances.len()];
        for (pixel, origin, direction) in &self.rays {
            let ray = camera.back_project(pixel)?;
            for (sum, d) in sums.iter_mut().zip(&self.distances) {
                *sum += (ray.at(*d) - (origin + direction * *d)).norm_squared() / self.rays.len() as f64;
            }
        }
        Some(sums)
    }
}

impl Sums {
    /// Adds a trial; `None`: it gave no camera.
    pub fn add(&mut self, found: Option<&Camera>, truth: &Camera, handoff: &HandOff) {
        let squares = found.and_then(|c| handoff.squared_errors(c));
        let (Some(camera), Some(squares)) = (found, squares) else {
            self.failures += 1;
            return;
        };
        let centre = camera.centre() - truth.centre();
        let turn = rigid::log(&(camera.pose.rotation * truth.pose.rotation.transpose()));
        let (k, t) = (&camera.intrinsics, &truth.intrinsics);
        let lens = [k.fx - t.fx, k.fy - t.fy, k.cx - t.cx, k.cy - t.cy];
        let error: [f64; COMPONENTS] = std::array::from_fn(|i| match i {
            0..3 => centre[i],
            3..6 => turn[i - 3],
            _ => lens[i - 6],
        });
        self.used += 1;
        self.errors.iter_mut().zip(&error).for_each(|(sum, e)| *sum += e);
        for (q, group) in GROUPS.into_iter().enumerate() {
            let square = error[group].iter().map(|e| e * e).sum::<f64>();
            self.sizes[q] += square.sqrt();
            self.squares[q] += square;
        }
        self.handoff.resize(squares.len(), 0.0);
        self.handoff.iter_mut().zip(&squares).for_each(|(sum, e)| *sum += e);
        if self.centres.len() < KEPT_CENTRES {
            self.centres.push(centre);
        }
    }

    /// Appends the sums of later trials.
    pub fn append(&mut self, later: &Self) {
        let add = |a: &mut [f64], b: &[f64]| a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        self.used += later.used;
        self.failures += later.failures;
        add(&mut self.errors, &later.errors);
        add(&mut self.sizes, &later.sizes);
        add(&mut self.squares, &later.squares);
        self.handoff.resize(self.handoff.len().max(later.handoff.len()), 0.0);
        add(&mut self.handoff, &later.handoff);
        let room = KEPT_CENTRES - self.centres.len();
        self.centres.extend(later.centres.iter().take(room));
    }

    /// Without a used trial all figures are infinite.
    pub fn finish(self, method: Method, level: NoiseLevel, distances: usize) -> Cell {
        let n = self.used as f64;
        let over = |sum: f64| if self.used > 0 { sum / n } else { f64::INFINITY };
        let bias = |q: usize| over(self.errors[GROUPS[q].clone()].iter().map(|e| e * e).sum::<f64>().sqrt());
        let mut handoff: Vec<f64> = self.handoff.iter().map(|sum| over(*sum).sqrt()).collect();
        handoff.resize(distances, f64::INFINITY);
        Cell {
            method,
            level,
            used: self.used,
            failures: self.failures,
            mean: self.sizes.map(over),
            rms: self.squares.map(|sum| over(sum).sqrt()),
            bias: std::array::from_fn(bias),
            handoff,
            centres: self.centres,
        }
    }
}
