//! The loops over the sample: see [`crate::image::vectors`].
#![allow(unsafe_code)]

use super::noise::{BIN_WIDTH, BINS, CELLS, Cell, Cells, LAGS};
use super::sample::{Pixels, RUN, Run};
use super::{CLIPPED, Limits, Photometry};
use crate::image::vectors::for_each_processor;

/// Runs whose sums are kept apart.
const LANES: usize = 8;

for_each_processor! {
    /// Means, variance and whether any pixel is clipped; what a run lacks in length is zero.
    pub fn summarise(on: &[Pixels], off: &[Pixels], runs: &mut [Run]) {
        for ((on, off), run) in on.iter().zip(off).zip(runs) {
            let mut square = [0.0f32; RUN];
            let mut top = [0.0f32; RUN];
            for i in 0..RUN {
                square[i] = (on[i] - off[i]) * (on[i] - off[i]);
                top[i] = if on[i] > off[i] { on[i] } else { off[i] };
            }
            let n = run.length as f32;
            let (sum_on, sum_off) = (sum(*on), sum(*off));
            let mean = (sum_on - sum_off) / n;
            run.variance = (sum(square) - n * mean * mean).max(0.0) / (n - 1.0).max(1.0);
            (run.on, run.off) = (sum_on / n, sum_off / n);
            run.clipped = top.iter().fold(false, |any, t| any | (*t >= CLIPPED));
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
        let mut sums = [[0.0f64; LANES]; 5];
        let reciprocal = 1.0 / scale;
        let add = |sums: &mut [[f64; LANES]; 5], lane: usize, x: f32, y: f32| {
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
        let ((x, x_rest), (y, y_rest)) = (x.as_chunks::<LANES>(), y.as_chunks::<LANES>());
        for (x, y) in x.iter().zip(y) {
            for lane in 0..LANES {
                add(&mut sums, lane, x[lane], y[lane]);
            }
        }
        for (lane, (x, y)) in x_rest.iter().zip(y_rest).enumerate() {
            add(&mut sums, lane, *x, *y);
        }
        sums.map(|s| s.iter().sum())
    }

    /// Adds the pixels' residuals from the line (gain, offset) to the histograms, `scale` cells a grey level.
    pub fn tally(cells: &mut Cells, on: &[Pixels], off: &[Pixels], line: [f32; 2], scale: f32) {
        for (on, off) in on.iter().zip(off) {
            let (mut index, mut square) = ([0u32; RUN], [0i32; RUN]);
            for i in 0..RUN {
                let top = if on[i] > off[i] { on[i] } else { off[i] };
                // Two black pixels are no evidence of silence.
                let counts = (top < CLIPPED) & (top >= 0.5);
                let r = on[i] - line[0] * off[i] - line[1];
                let cell = less(r.abs() * scale, (CELLS - 1) as f32) as i32;
                let bin = off[i] as i32 / BIN_WIDTH as i32;
                index[i] = if counts { bin * CELLS as i32 + cell } else { (BINS * CELLS) as i32 } as u32;
                square[i] = less(r * r * Cell::UNIT + 0.5, Cell::MOST) as i32;
            }
            for i in 0..RUN {
                cells[i % 4][index[i] as usize].add(Cell::pixel(square[i]));
            }
        }
    }

    /// Over the runs without a clipped pixel, sums of the mean products of the residuals with those 0, 1,
    /// ... pixels farther on. What leaves the noise (base, slope by level) is not noise and counts as 0.
    pub fn lagged_products(
        on: &[Pixels],
        off: &[Pixels],
        runs: &[Run],
        line: [f32; 2],
        noise: [f32; 2],
    ) -> [f32; LAGS + 1] {
        let mut sums = [[0.0f32; RUN]; LAGS + 1];
        for ((on, off), run) in on.iter().zip(off).zip(runs) {
            if run.clipped || run.length <= LAGS {
                continue;
            }
            let mut residuals = [0.0f32; RUN + LAGS];
            for i in 0..RUN {
                let r = on[i] - line[0] * off[i] - line[1];
                let counts = (r * r < 9.0 * (noise[0] + noise[1] * off[i])) & (i < run.length);
                residuals[i] = if counts { r } else { 0.0 };
            }
            for (lag, sum) in sums.iter_mut().enumerate() {
                let share = 1.0 / (run.length - lag) as f32;
                for i in 0..RUN {
                    sum[i] += share * (residuals[i] * residuals[i + lag]);
                }
            }
        }
        sums.map(|s| sum(s))
    }

    /// Standard deviations by off level: those of the model, or the measured scatter where drift is not
    /// linear and the model fails; but not when all that has this level has moved.
    pub fn deviations(photometry: &mut Photometry, measured: &[f32; BINS]) {
        for (bin, measured) in measured.iter().enumerate() {
            let measured = measured.sqrt();
            for level in bin * BIN_WIDTH..(bin + 1) * BIN_WIDTH {
                let off = level as f32;
                let model = photometry.variance(photometry.predict(off), off).sqrt();
                photometry.deviation[level] = greater(model, less(measured, 3.0 * model + 3.0));
            }
        }
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

/// In pairs, as vectors add: the same order everywhere.
#[inline(always)]
fn sum(values: Pixels) -> f32 {
    let mut values = values;
    let mut half = RUN / 2;
    while half > 0 {
        for i in 0..half {
            values[i] += values[i + half];
        }
        half /= 2;
    }
    values[0]
}

#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn less(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
