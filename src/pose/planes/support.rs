//! Where a plane was measured, and how even its surface is.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::chi_square::upper_tail;
use crate::geometry::linalg::symmetric_eigen3;

/// Share of the measurements beyond each end of the extent.
const BEYOND: f64 = 0.01;
/// Cells along each side of the extent, over which residuals are compared.
const CELLS: usize = 8;
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
    /// Of at least one place, with the plane's unit normal and distance.
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
        let mut support = Self { centre, axes, extent, area: 0.0 };
        support.area = support.covered(places);
        support
    }

    /// Lengths of the sides of the extent, metres.
    pub fn sides(&self) -> [f64; 2] {
        self.extent.map(|[low, high]| high - low)
    }

    /// Area of the cells that hold a measurement; of cells so large that they would hold four.
    fn covered(&self, places: &[Vector3<f64>]) -> f64 {
        let sides = self.sides();
        let cell = (4.0 * sides[0] * sides[1] / places.len() as f64).sqrt();
        if !(cell > 0.0 && cell.is_finite()) {
            return 0.0;
        }
        let counts = sides.map(|s| ((s / cell).ceil() as usize).clamp(1, MAX_SIDE));
        let mut hit = vec![false; counts[0] * counts[1]];
        for place in places {
            if let Some([i, j]) = self.cell(place, counts) {
                hit[i * counts[1] + j] = true;
            }
        }
        hit.iter().filter(|h| **h).count() as f64 * sides[0] * sides[1] / hit.len() as f64
    }

    /// In which of so many cells of the extent a place is; `None` beyond it.
    fn cell(&self, place: &Vector3<f64>, counts: [usize; 2]) -> Option<[usize; 2]> {
        let mut cell = [0; 2];
        for k in 0..2 {
            let [low, high] = self.extent[k];
            let share = (self.axes[k].dot(&(place - self.centre)) - low) / (high - low);
            if !(0.0..=1.0).contains(&share) {
                return None;
            }
            cell[k] = ((share * counts[k] as f64) as usize).min(counts[k] - 1);
        }
        Some(cell)
    }

    /// By how much the variance of a fit to these residuals (in standard deviations) is larger than
    /// independent ones would make it: neighbours on an uneven wall, or of a depth camera, are off
    /// alike. 1 unless they contradict their independence.
    pub(super) fn unevenness(&self, residuals: impl Iterator<Item = (Vector3<f64>, f64)>) -> f64 {
        let mut cells = [(0.0, 0.0); CELLS * CELLS];
        for (place, residual) in residuals {
            if let Some([i, j]) = self.cell(&place, [CELLS; 2]) {
                let (count, sum) = &mut cells[i * CELLS + j];
                *count += 1.0;
                *sum += residual;
            }
        }
        let used = cells.iter().filter(|(count, _)| *count > 0.0);
        let (freedom, chi_square) =
            used.fold((-3.0, 0.0), |(f, c), (count, sum): &(f64, f64)| (f + 1.0, c + sum * sum / count));
        if freedom > 0.0 && upper_tail(chi_square, freedom) < BEYOND_CHANCE {
            (chi_square / freedom).max(1.0)
        } else {
            1.0
        }
    }
}

/// From where to where numbers reach, but for a few at either end.
fn reach(mut numbers: Vec<f64>) -> [f64; 2] {
    let last = numbers.len() - 1;
    let beyond = (BEYOND * last as f64) as usize;
    let mut at = |i: usize| *numbers.select_nth_unstable_by(i, f64::total_cmp).1;
    [at(beyond), at(last - beyond)]
}
