//! The loops over the sample: see [`crate::vectors`].
#![allow(unsafe_code)]

use super::noise::{BIN_WIDTH, BINS, CELLS, Cell, Cells, LAGS};
use super::sample::{Block, LANES, RUN};
use super::{CLIPPED, Limits, Photometry};
use crate::vectors::{for_each_processor, greater, less};

/// Sums of the regression that are kept apart.
const SUMS: usize = 8;

for_each_processor! {
    /// Means, variances and greatest levels of the runs.
    pub fn summarise(blocks: &mut [Block]) {
        for block in blocks {
            let [mut sum_on, mut sum_off, mut square, mut top] = [[0.0f32; LANES]; 4];
            for (i, (on, off)) in block.on.iter().zip(&block.off).enumerate() {
                for l in 0..LANES {
                    let counts = block.length[l] > i as f32;
                    let [on, off] = [on[l], off[l]].map(|v| if counts { v } else { 0.0 });
                    sum_on[l] += on;
                    sum_off[l] += off;
                    square[l] += (on - off) * (on - off);
                    top[l] = greater(top[l], greater(on, off));
                }
            }
            for l in 0..LANES {
                let n = greater(block.length[l], 1.0);
                let mean = (sum_on[l] - sum_off[l]) / n;
                block.variance[l] = greater(square[l] - n * mean * mean, 0.0) / greater(n - 1.0, 1.0);
                block.mean[0][l] = sum_on[l] / n;
                block.mean[1][l] = sum_off[l] / n;
            }
            block.top = top;
        }
    }

    /// The key of this rank, 0 the least, by halving what it can be: `None` when there are not so many.
    pub fn order_statistic(keys: &[i32], rank: usize) -> Option<i32> {
        if rank >= keys.len() {
            return None;
        }
        // The order of the signed keys as that of unsigned ones.
        let flip = |key: u32| key ^ (1 << 31);
        let differing = keys.iter().fold(0, |d, key| d | (key ^ keys[0]));
        let bits = 32 - differing.leading_zeros();
        let mut least = (flip(keys[0] as u32) as u64 >> bits << bits) as u32;
        for bit in (0..bits).rev() {
            let trial = least | (1 << bit);
            let limit = flip(trial) as i32;
            let below: u32 = keys.iter().map(|key| u32::from(*key < limit)).sum();
            if below as usize <= rank {
                least = trial;
            }
        }
        Some(flip(least) as i32)
    }

    /// |y - gain x - offset|.
    pub fn residuals(out: &mut [f32], x: &[f32], y: &[f32], gain: f32, offset: f32) {
        for ((out, x), y) in out.iter_mut().zip(x).zip(y) {
            *out = (y - gain * x - offset).abs();
        }
    }

    /// Sums of w, w x, w y, w x^2, w x y with Tukey's weights w of the residuals from the line.
    pub fn biweight_sums(x: &[f32], y: &[f32], gain: f32, offset: f32, scale: f32) -> [f64; 5] {
        let mut sums = [[0.0f64; SUMS]; 5];
        let reciprocal = 1.0 / scale;
        let add = |sums: &mut [[f64; SUMS]; 5], lane: usize, x: f32, y: f32| {
            let t = (y - gain * x - offset) * reciprocal;
            let rest = 1.0 - t * t;
            let rest = if rest > 0.0 { rest } else { 0.0 };
            let w = (rest * rest) as f64;
            let (x, y) = (x as f64, y as f64);
            let (wx, wy) = (w * x, w * y);
            for (sum, term) in sums.iter_mut().zip([w, wx, wy, wx * x, wx * y]) {
                sum[lane] += term;
            }
        };
        let ((x, x_rest), (y, y_rest)) = (x.as_chunks::<SUMS>(), y.as_chunks::<SUMS>());
        for (x, y) in x.iter().zip(y) {
            for lane in 0..SUMS {
                add(&mut sums, lane, x[lane], y[lane]);
            }
        }
        for (lane, (x, y)) in x_rest.iter().zip(y_rest).enumerate() {
            add(&mut sums, lane, *x, *y);
        }
        sums.map(|s| s.iter().sum())
    }

    /// Adds the pixels' residuals from the line (gain, offset) to the histograms, `scale` cells a grey level.
    pub fn tally(cells: &mut Cells, blocks: &[Block], line: [f32; 2], scale: f32) {
        let (mut index, mut square) = ([0u32; RUN * LANES], [0i32; RUN * LANES]);
        for block in blocks {
            let (on, off) = (block.on.as_flattened(), block.off.as_flattened());
            for i in 0..RUN * LANES {
                let (on, off) = (on[i], off[i]);
                let top = greater(on, off);
                // Two black pixels are no evidence of silence.
                let counts = (0.5..CLIPPED).contains(&top);
                let r = on - line[0] * off - line[1];
                let cell = less(r.abs() * scale, (CELLS - 1) as f32);
                let units = less(r * r * Cell::UNIT + 0.5, Cell::MOST);
                // SAFETY: levels are means of bytes, and `less` gives its second argument for what is no number.
                let [cell, level, units]: [i32; 3] = [cell, off, units].map(|v| unsafe { v.to_int_unchecked() });
                let bin = level / BIN_WIDTH as i32;
                index[i] = if counts { bin * CELLS as i32 + cell } else { (BINS * CELLS) as i32 } as u32;
                square[i] = units;
            }
            add(cells, &index, &square);
        }
    }

    /// Over the runs without a clipped pixel, sums of the mean products of the residuals with those 0, 1,
    /// ... pixels farther on. What leaves the noise (base, slope by level) is not noise and counts as 0.
    pub fn lagged_products(blocks: &[Block], line: [f32; 2], noise: [f32; 2]) -> [f32; LAGS + 1] {
        let mut sums = [[0.0f32; LANES]; LAGS + 1];
        let mut residuals = [[0.0f32; LANES]; RUN];
        for block in blocks {
            for (i, residuals) in residuals.iter_mut().enumerate() {
                let (on, off) = (&block.on[i], &block.off[i]);
                for l in 0..LANES {
                    let r = on[l] - line[0] * off[l] - line[1];
                    let is_noise = (r * r < 9.0 * (noise[0] + noise[1] * off[l])) & (block.length[l] > i as f32);
                    residuals[l] = if is_noise { r } else { 0.0 };
                }
            }
            for (lag, sums) in sums.iter_mut().enumerate() {
                let mut products = [0.0f32; LANES];
                for (a, b) in residuals.iter().zip(&residuals[lag..]) {
                    for l in 0..LANES {
                        products[l] += a[l] * b[l];
                    }
                }
                for l in 0..LANES {
                    let counts = (block.top[l] < CLIPPED) & (block.length[l] > LAGS as f32);
                    let mean = products[l] / greater(block.length[l] - lag as f32, 1.0);
                    sums[l] += if counts { mean } else { 0.0 };
                }
            }
        }
        sums.map(|s| s.iter().sum())
    }

    /// Standard deviations by off level: those of the model, or the measured scatter where drift is not
    /// linear and the model fails; but not when all that has this level has moved.
    pub fn deviations(photometry: &mut Photometry, measured: &[f32; BINS]) {
        let mut deviation = [0.0; 256];
        for level in 0..256 {
            let off = level as f32;
            let model = photometry.variance(photometry.predict(off), off).sqrt();
            deviation[level] = greater(model, less(measured[level / BIN_WIDTH].sqrt(), 3.0 * model + 3.0));
        }
        photometry.deviation = deviation;
    }

    /// The levels within `k` standard deviations.
    pub fn limits(limits: &mut Limits, photometry: &Photometry, k: f32) {
        let [low, high] = limits;
        for level in 0..256 {
            let off = level as f32;
            let predicted = photometry.predict(off);
            let band = k * photometry.deviation[level];
            low[level] = less(predicted, CLIPPED) - band;
            // A clipped off pixel only says that the scene is brighter than that.
            high[level] = if off >= CLIPPED { f32::INFINITY } else { predicted + band };
        }
    }
}

/// Adds pixels to the cells of these indices.
#[inline(always)]
fn add(cells: &mut Cells, index: &[u32], square: &[i32]) {
    for (index, square) in index.as_chunks::<4>().0.iter().zip(square.as_chunks::<4>().0) {
        for (cells, (index, square)) in cells.iter_mut().zip(index.iter().zip(square)) {
            cells[*index as usize].add(Cell::pixel(*square));
        }
    }
}
