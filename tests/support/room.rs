//! Rooms of rectangles, and what a station in one measures: truth for planes and stations.
#![allow(dead_code)]

use nalgebra::{Matrix3, Vector3};
use ptzcal::geometry::rigid::{exp, rotation_y};
use ptzcal::geometry::{InverseDepthPoint, Rigid};
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

/// Seeded uniform and Gaussian numbers.
pub struct Dice(ChaCha8Rng);

impl Dice {
    pub fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.0.next_u64() >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    pub fn gaussian(&mut self) -> f64 {
        (-2.0 * self.uniform(0.0, 1.0).ln()).sqrt() * (self.uniform(0.0, std::f64::consts::TAU)).cos()
    }

    pub fn direction(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.gaussian()).normalize()
    }
}

/// A rectangle by a corner and two sides that are perpendicular, metres; y down.
#[derive(Clone, Copy)]
pub struct Rectangle {
    pub corner: Vector3<f64>,
    pub sides: [Vector3<f64>; 2],
}

impl Rectangle {
    /// How far along a ray it is met.
    fn hit(&self, from: &Vector3<f64>, direction: &Vector3<f64>) -> Option<f64> {
        let normal = self.sides[0].cross(&self.sides[1]);
        let range = normal.dot(&(self.corner - from)) / normal.dot(direction);
        let at = from + direction * range - self.corner;
        let inside = self.sides.iter().all(|s| (0.0..=s.norm_squared()).contains(&at.dot(s)));
        (range > 1e-6 && inside).then_some(range)
    }
}

/// The six faces of a box between two corners.
pub fn cuboid(low: [f64; 3], high: [f64; 3]) -> Vec<Rectangle> {
    let (low, size) = (Vector3::from(low), Vector3::from(high) - Vector3::from(low));
    let face = |axis: usize, far: bool| {
        let side = |k: usize| Vector3::ith((axis + k) % 3, size[(axis + k) % 3]);
        let corner = if far { low + Vector3::ith(axis, size[axis]) } else { low };
        Rectangle { corner, sides: [side(1), side(2)] }
    };
    (0..6).map(|i| face(i / 2, i % 2 == 1)).collect()
}

/// A room of 6 x 2.6 x 4.4 m with a cupboard, a table, a pillar and a crate.
pub fn furnished() -> Vec<Rectangle> {
    let mut room = cuboid([-3.0, -1.5, -2.0], [3.0, 1.1, 2.4]);
    room.extend(cuboid([-3.0, -0.7, 1.4], [-1.8, 1.1, 2.4]));
    room.extend(cuboid([1.2, 0.3, -2.0], [2.4, 1.1, -1.2]));
    room.extend(cuboid([2.5, -1.5, 1.7], [3.0, 1.1, 2.4]));
    room.extend(cuboid([-2.6, 0.6, -1.8], [-1.9, 1.1, -1.1]));
    room
}

/// What a station measures: its frame's pose is world to station.
pub struct Scan {
    pub points: Vec<Vector3<f64>>,
    /// Which rectangle each point is of.
    pub surfaces: Vec<usize>,
}

/// Points in evenly random directions of the whole sphere, with noise along the ray, metres.
pub fn scan(room: &[Rectangle], station: &Rigid, count: usize, sigma: f64, dice: &mut Dice) -> Scan {
    let (centre, to_world) = (station.centre(), station.rotation.transpose());
    let mut scan = Scan { points: Vec::new(), surfaces: Vec::new() };
    while scan.points.len() < count {
        let direction = dice.direction();
        let ray = to_world * direction;
        let hits = room.iter().enumerate().filter_map(|(k, r)| Some((r.hit(&centre, &ray)?, k)));
        if let Some((range, k)) = hits.min_by(|p, q| p.0.total_cmp(&q.0)) {
            scan.points.push(direction * (range + sigma * dice.gaussian()));
            scan.surfaces.push(k);
        }
    }
    scan
}

/// Points as shots from the station's centre with noise in inverse depth, 1 / metres.
pub fn as_shots(points: &[Vector3<f64>], sigma: f64, dice: &mut Dice) -> Vec<InverseDepthPoint> {
    let shot = |p: &Vector3<f64>| {
        let rho = 1.0 / p.norm() + sigma * dice.gaussian();
        InverseDepthPoint { origin: Vector3::zeros(), direction: p.normalize(), rho, variance: sigma * sigma }
    };
    points.iter().map(shot).collect()
}

/// A station somewhere in the middle of the room, turned anyhow about the vertical and a little about
/// the other axes.
pub fn somewhere(dice: &mut Dice) -> Rigid {
    let centre = Vector3::new(dice.uniform(-1.2, 0.9), dice.uniform(-0.3, 0.2), dice.uniform(-0.8, 0.9));
    let tilt = exp(&Vector3::new(dice.uniform(-0.1, 0.1), 0.0, dice.uniform(-0.1, 0.1)));
    let rotation: Matrix3<f64> = tilt * rotation_y(dice.uniform(-3.1, 3.1));
    Rigid::from_centre(rotation, &centre)
}
