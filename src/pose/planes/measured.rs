//! What planes are sought in: points, whose noise is the same in all directions, and shots, whose
//! noise is along their rays. Both are rows of numbers, so that one search serves both.

use std::borrow::Cow;

use nalgebra::Vector3;

use super::kernels::{Sums, columns_of};
use super::rows::{Kind, Rows};
use crate::error::Result;
use crate::geometry::InverseDepthPoint;
use crate::pose::plane_fit::{Fit, OfMoments, maximum_likelihood};

/// Points that tell where the middle is.
const MIDDLE: usize = 1024;

/// Measurements of surfaces. Planes are n . X = 1.
pub(super) trait Measured {
    fn count(&self) -> usize;
    fn kind(&self) -> Kind;
    /// Where a measurement is.
    fn position(&self, i: usize) -> Vector3<f64>;
    /// Room for so many rows.
    fn rows(&self, capacity: usize) -> Rows;
    /// The rows from `start` to before `end`, instead of those there.
    fn load(&self, start: usize, end: usize, rows: &mut Rows);
    /// The rows of some.
    fn gather(&self, chosen: &[u32]) -> Rows;
    /// The plane by maximum likelihood, with its covariance, or why there is none. The sums are of `used`, which
    /// are listed where they must be. Chi-square is left to the caller.
    fn fit(&self, sums: &Sums, used: impl FnOnce() -> Vec<u32>) -> Result<Fit>;
    /// The same kind of measurements, fewer.
    fn subset(&self, chosen: &[u32]) -> Self;
}

/// Points with one standard deviation in every direction, metres.
pub(super) struct Cloud<'p> {
    points: Cow<'p, [Vector3<f64>]>,
    sigma: f64,
    middle: Vector3<f64>,
}

impl<'p> Cloud<'p> {
    pub fn new(points: Cow<'p, [Vector3<f64>]>, sigma: f64) -> Self {
        let some = || points.iter().step_by(points.len() / MIDDLE + 1);
        let count = some().count().max(1) as f64;
        let middle = some().map(|p| p / count).sum();
        Self { points, sigma, middle }
    }

    /// The same points with another noise.
    pub fn with_sigma(self, sigma: f64) -> Self {
        Self { sigma, ..self }
    }
}

impl Measured for Cloud<'_> {
    fn count(&self) -> usize {
        self.points.len()
    }

    fn kind(&self) -> Kind {
        Kind::Points { sigma: self.sigma, middle: self.middle }
    }

    fn position(&self, i: usize) -> Vector3<f64> {
        self.points[i]
    }

    fn rows(&self, capacity: usize) -> Rows {
        Rows::new(false, capacity)
    }

    fn load(&self, start: usize, end: usize, rows: &mut Rows) {
        let before = rows.count();
        let [x, y, z, b] = rows.resize(end - start);
        columns_of(&self.points[start..end], &self.middle, x, y, z);
        // Those of the last block are still there.
        if before < b.len() {
            b[before..].fill(1.0);
        }
    }

    fn gather(&self, chosen: &[u32]) -> Rows {
        let column = |k: usize| chosen.iter().map(|i| self.points[*i as usize][k] - self.middle[k]).collect();
        Rows::of_points([column(0), column(1), column(2)])
    }

    fn fit(&self, sums: &Sums, _: impl FnOnce() -> Vec<u32>) -> Result<Fit> {
        let (centre, spread) = sums.about_centre();
        let centre = centre + self.middle;
        let size = (centre.norm_squared() + spread.trace()).sqrt();
        let count = sums.count as f64;
        OfMoments::new(count, size, centre, &(spread * (count / (size * size))))?.fit(self.sigma * self.sigma, 0.0)
    }

    fn subset(&self, chosen: &[u32]) -> Self {
        Self { points: chosen.iter().map(|i| self.points[*i as usize]).collect(), ..*self }
    }
}

/// Points on rays.
pub(super) struct Shots {
    shots: Vec<InverseDepthPoint>,
    /// Not all rays start at the station.
    with_origins: bool,
}

impl Shots {
    pub fn new(shots: Vec<InverseDepthPoint>) -> Self {
        let with_origins = shots.iter().any(|s| s.origin != Vector3::zeros());
        Self { shots, with_origins }
    }
}

fn push(rows: &mut Rows, shot: &InverseDepthPoint) {
    let weight = shot.variance.sqrt().recip();
    rows.push(&((shot.origin * shot.rho + shot.direction) * weight), shot.rho * weight, &shot.origin);
}

impl Measured for Shots {
    fn count(&self) -> usize {
        self.shots.len()
    }

    fn kind(&self) -> Kind {
        Kind::Shots
    }

    fn position(&self, i: usize) -> Vector3<f64> {
        let shot = &self.shots[i];
        shot.origin + shot.direction / shot.rho
    }

    fn rows(&self, capacity: usize) -> Rows {
        Rows::new(self.with_origins, capacity)
    }

    fn load(&self, start: usize, end: usize, rows: &mut Rows) {
        rows.clear();
        self.shots[start..end].iter().for_each(|shot| push(rows, shot));
    }

    fn gather(&self, chosen: &[u32]) -> Rows {
        let mut rows = self.rows(chosen.len());
        chosen.iter().for_each(|i| push(&mut rows, &self.shots[*i as usize]));
        rows
    }

    fn fit(&self, _: &Sums, used: impl FnOnce() -> Vec<u32>) -> Result<Fit> {
        maximum_likelihood(&used().iter().map(|i| self.shots[*i as usize]).collect::<Vec<_>>())
    }

    fn subset(&self, chosen: &[u32]) -> Self {
        Self { shots: chosen.iter().map(|i| self.shots[*i as usize]).collect(), with_origins: self.with_origins }
    }
}
