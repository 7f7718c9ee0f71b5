//! The noise about the line, by level, and how alike it is in neighbours.

use super::line::Line;
use super::sample::{RUN, Sample};
use super::{CLIPPED, kernels};

/// Grey levels whose noise is pooled.
pub const BIN_WIDTH: usize = 32;
pub const BINS: usize = 256 / BIN_WIDTH;
/// Cells of a bin's histogram of |on - predicted|, an eighth of the standard deviation each.
pub const CELLS: usize = 96;
/// Neighbours whose noise may be alike.
pub const LAGS: usize = 3;

/// Histograms of |on - predicted| by level; the last cell takes what does not count. One for each of four
/// pixels in turn, as neighbours often fall into one cell and would wait for each other.
pub type Cells = [[Cell; BINS * CELLS + 1]; 4];

/// A count and a sum of squares in one number, so that a pixel is added at once: integers, whose sum
/// does not depend on its order.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Cell(u64);

impl Cell {
    /// The sum's share of the bits: 16,384 pixels of 2^29 units each.
    const COUNT: u32 = 43;
    /// A grey level's square in units; larger residuals than 724 levels are cut to that.
    pub const UNIT: f32 = 1024.0;
    pub const MOST: f32 = (1 << 29) as f32;

    /// A pixel with a square in units.
    #[inline(always)]
    pub fn pixel(square: i32) -> Self {
        Self((1 << Self::COUNT) | square as u64)
    }

    #[inline(always)]
    pub fn add(&mut self, other: Self) {
        self.0 += other.0;
    }

    fn count(self) -> u32 {
        (self.0 >> Self::COUNT) as u32
    }

    fn square(self) -> f32 {
        (self.0 & ((1 << Self::COUNT) - 1)) as f32 / Self::UNIT
    }
}

#[derive(Debug)]
pub struct Tally(Box<Cells>);

impl Default for Tally {
    fn default() -> Self {
        Self(Box::new([[Cell::default(); BINS * CELLS + 1]; 4]))
    }
}

pub struct Noise {
    /// Variance of the difference: base + slope x off level.
    pub base: f32,
    pub slope: f32,
    pub measured: [f32; BINS],
    pub correlation: f32,
}

impl Sample {
    /// Variances by level from second moments clipped at 3 standard deviations.
    pub fn noise(&mut self, line: &Line, floor: f32) -> Noise {
        let scale = 8.0 / line.pixel_deviation;
        let cells = &mut self.scratch.tally.0;
        cells.iter_mut().for_each(|c| c.fill(Cell::default()));
        kernels::tally(cells, &self.blocks, [line.gain, line.offset], scale);
        let bins: [(f32, f32); BINS] = std::array::from_fn(|bin| {
            let mut up_to = [Cell::default(); CELLS];
            let mut sum = Cell::default();
            for (i, up_to) in up_to.iter_mut().enumerate() {
                cells.iter().for_each(|c| sum.add(c[bin * CELLS + i]));
                *up_to = sum;
            }
            clipped_variance(&up_to, scale, 4.0 * floor.sqrt())
        });
        let total: f32 = bins.iter().map(|b| b.0).sum();
        // In a black scene the few others are not its noise but what changed.
        let enough = total >= 16.0 && total >= 0.1 * self.size as f32;
        let pooled = if enough { bins.iter().map(|b| b.0 * b.1).sum::<f32>() / total } else { 0.0 };

        // Weighted line through the bins; a variance's own variance is 2 variance^2 / count.
        let (mut base, mut slope) = (pooled, 0.0);
        let good = || bins.iter().enumerate().filter(|(_, b)| enough && b.0 >= 64.0);
        if good().count() >= 3 {
            let [mut s, mut sx, mut sxx, mut sy, mut sxy] = [0.0f32; 5];
            for (i, (count, variance)) in good() {
                let x = ((i * BIN_WIDTH) as f32 + 0.5 * BIN_WIDTH as f32) / 256.0;
                let weight = count / (variance + floor).powi(2);
                s += weight;
                sx += weight * x;
                sxx += weight * x * x;
                sy += weight * variance;
                sxy += weight * x * variance;
            }
            let determinant = s * sxx - sx * sx;
            if determinant > 1e-6 * s * sxx {
                slope = (s * sxy - sx * sy) / determinant;
                base = (sy - slope * sx) / s;
                if slope < 0.0 {
                    (base, slope) = (sy / s, 0.0);
                } else if base < floor {
                    (base, slope) = (floor, ((sxy - floor * sx) / sxx).max(0.0));
                }
                slope /= 256.0;
            }
        }
        base = base.max(floor);
        let mut measured = [0.0; BINS];
        for (i, (count, variance)) in good() {
            let model = base + slope * (i * BIN_WIDTH + BIN_WIDTH / 2) as f32;
            if *variance > model * (1.0 + 4.0 * (2.0 / count).sqrt()) {
                measured[i] = *variance;
            }
        }
        let correlation = self.correlation(line, base, slope);
        Noise { base, slope, measured, correlation }
    }

    /// Sum of the autocorrelation over the neighbours along a row, squared for the two directions: columns
    /// are taken to be like rows.
    fn correlation(&self, line: &Line, base: f32, slope: f32) -> f32 {
        let products = kernels::lagged_products(&self.blocks, [line.gain, line.offset], [base, slope]);
        let [square, neighbours @ ..] = products;
        let count = (self.size as f32).max(1.0);
        let sum = 1.0 + 2.0 * neighbours.iter().sum::<f32>() / square.max(1e-12);
        // The estimate itself scatters by this; only a clear excess counts.
        let scatter = 2.0 * (LAGS as f32 / count).sqrt();
        (sum - 2.0 * scatter).clamp(1.0, 1.0 + 2.0 * LAGS as f32).powi(2)
    }
}

/// Count and variance of a histogram of absolute values, given as sums up to each cell, `scale` cells a
/// unit: clipped at three standard deviations, so that a minority of changed pixels does not matter, but
/// not below `least`, as rounding makes most of silent noise vanish and the rest a whole grey level.
fn clipped_variance(up_to: &[Cell; CELLS], scale: f32, least: f32) -> (f32, f32) {
    let total = up_to[CELLS - 1].count();
    if total == 0 {
        return (0.0, 0.0);
    }
    let middle = up_to.partition_point(|c| 2 * c.count() < total);
    // In cells; half a cell more than the median, and never none.
    let mut deviation = 1.4826 * (middle as f32 + 1.0);
    let mut variance = 0.0;
    for _ in 0..4 {
        let end = ((3.0 * deviation).max(least * scale).ceil() as usize).clamp(1, CELLS);
        let sum = up_to[end - 1];
        // Variance of a normal distribution cut at 3 standard deviations.
        variance = sum.square() / sum.count().max(1) as f32 / 0.9733;
        deviation = (variance.sqrt() * scale).max(1.0);
    }
    (total as f32, variance)
}

// A run's residuals are looked at with their neighbours.
const _: () = assert!(LAGS < RUN);
// What does not count is one of the ways not to.
const _: () = assert!(CLIPPED < super::sample::NO_PIXEL);
