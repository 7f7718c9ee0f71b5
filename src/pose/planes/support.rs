//! Where a plane was measured, and how even its surface is.

use nalgebra::{Matrix3, Vector3};

use super::kernels;
use crate::geometry::chi_square::upper_tail;
use crate::geometry::linalg::symmetric_eigen3;

/// Share of the measurements beyond each end of the extent.
const BEYOND: f64 = 0.01;
/// Cells along each side of the extent, over which residuals are compared.
pub(super) const UNEVENNESS_CELLS: usize = 8;
/// Probability below which residuals contradict that they are independent.
const BEYOND_CHANCE: f64 = 1e-3;
/// The largest grid that the area is counted on.
const MAX_SIDE: usize = 1024;

/// Where a plane was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneSupport {
    /// Middle of the measurements, on the plane.
    pub centre: Vector3<f64>,
    /// Unit vectors in the plane, that of the larger extent first.
    pub axes: [Vector3<f64>; 2],
    /// How far the measurements reach along the axes, from where to where as seen from the centre,
    /// metres; one in a hundred lies beyond each end.
    pub extent: [[f64; 2]; 2],
    /// What of it is covered by measurements, metres^2.
    pub area: f64,
}

impl PlaneSupport {
    /// Of at least one place, with the plane's unit normal and distance; without the area.
    pub(super) fn of(places: &[Vector3<f64>], normal: &Vector3<f64>, distance: f64) -> Self {
        let count = places.len() as f64;
        let mean = places.iter().sum::<Vector3<f64>>() / count;
        let centre = mean - normal * (normal.dot(&mean) - distance);
        let spread: Matrix3<f64> = places.iter().map(|p| (p - centre) * (p - centre).transpose()).sum();
        let flat = Matrix3::identity() - normal * normal.transpose();
        let first = symmetric_eigen3(&(flat * spread * flat)).map_or_else(Vector3::x, |(_, v)| v[0]);
        // Whatever a single point gives, the axes span the plane.
        let first = (flat * first).try_normalize(1e-9).unwrap_or_else(|| {
            let least = normal.iamin();
            normal.cross(&Vector3::ith(least, 1.0)).normalize()
        });
        let axes = [first, normal.cross(&first)];
        let extent = axes.map(|axis| reach(places.iter().map(|p| axis.dot(&(p - centre))).collect()));
        Self { centre, axes, extent, area: 0.0 }
    }

    /// Moves the centre by so much along the axes. What was measured stays where it is.
    pub(super) fn shift(&mut self, by: [f64; 2]) {
        self.centre += self.axes[0] * by[0] + self.axes[1] * by[1];
        for (extent, by) in self.extent.iter_mut().zip(by) {
            extent.iter_mut().for_each(|end| *end -= by);
        }
    }

    /// Lengths of the sides of the extent, metres.
    pub fn sides(&self) -> [f64; 2] {
        self.extent.map(|[low, high]| high - low)
    }

    /// So many cells on the extent.
    pub(super) fn grid(&self, counts: [usize; 2]) -> Grid {
        let per_metre = [0, 1].map(|k| counts[k] as f64 / (self.extent[k][1] - self.extent[k][0]));
        Grid { low: self.extent.map(|e| e[0]), per_metre, counts: counts.map(|c| c as u32) }
    }

    /// The cells whose area is counted: so large that they would hold four of these measurements.
    pub(super) fn covered_by(&self, measurements: usize) -> Grid {
        let sides = self.sides();
        let cell = (4.0 * sides[0] * sides[1] / measurements as f64).sqrt();
        let clear = cell > 0.0 && cell.is_finite();
        self.grid(sides.map(|s| if clear { ((s / cell).ceil() as usize).clamp(1, MAX_SIDE) } else { 1 }))
    }
}

/// Cells on a plane, row by row. Places are along its axes from its centre.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    low: [f64; 2],
    per_metre: [f64; 2],
    counts: [u32; 2],
}

impl Grid {
    pub fn cells(&self) -> usize {
        self.counts[0] as usize * self.counts[1] as usize
    }

    /// Of all cells, square metres; 0 without a plane's extent.
    pub fn area(&self) -> f64 {
        let area = [0, 1].map(|k| f64::from(self.counts[k]) / self.per_metre[k]).iter().product::<f64>();
        if area.is_finite() { area } else { 0.0 }
    }

    /// The cells of places; beyond the grid the one after the last.
    pub fn find(&self, cells: &mut [u32], u: &[f64], v: &[f64]) {
        kernels::cells(cells, u, v, self.low, self.per_metre, self.counts, self.cells() as u32);
    }
}

/// By how much the variance of a fit to residuals (in standard deviations) is larger than
/// independent ones would make it: neighbours on an uneven wall, or of a depth camera, are off
/// alike. 1 unless they contradict their independence. `cells`: how many residuals each holds, and their sum.
pub(super) fn unevenness(cells: &[(f64, f64)]) -> f64 {
    let used = cells.iter().filter(|(count, _)| *count > 0.0);
    let (freedom, chi_square) =
        used.fold((-3.0, 0.0), |(f, c), (count, sum): &(f64, f64)| (f + 1.0, c + sum * sum / count));
    if freedom > 0.0 && upper_tail(chi_square, freedom) < BEYOND_CHANCE { (chi_square / freedom).max(1.0) } else { 1.0 }
}

/// From where to where numbers reach, but for a few at either end.
fn reach(mut numbers: Vec<f64>) -> [f64; 2] {
    let last = numbers.len() - 1;
    let beyond = (BEYOND * last as f64) as usize;
    let mut at = |i: usize| *numbers.select_nth_unstable_by(i, f64::total_cmp).1;
    [at(beyond), at(last - beyond)]
}
