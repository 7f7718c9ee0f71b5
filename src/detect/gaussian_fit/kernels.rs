//! The sums over a patch's pixels: see [`crate::vectors`].
#![allow(unsafe_code)]

use super::{FOOT_ERROR, HUBER, LANES, MODEL_ERROR, Model, Patch};
use crate::image::exponential::exponential;
use crate::vectors::for_each_processor;

type Lanes = [f64; LANES];

/// Residuals are all less.
const NO_LIMIT: f64 = 1e300;

/// Sums over the pixels, w their weights, h the model's heights and r the residuals.
pub struct Moments {
    /// Of w h^2 x^i y^j, i + j <= 4.
    pub squares: [[f64; 5]; 5],
    /// Of w h x^i y^j and of w h r x^i y^j, i + j <= 2.
    pub heights: [[f64; 3]; 3],
    pub residuals: [[f64; 3]; 3],
    /// Of w, w r, w r^2.
    pub weight: f64,
    pub residual: f64,
    pub cost: f64,
}

/// Sums over the pixels that tell how well a model fits, v their variances and s their signals.
pub struct Quality {
    /// Of t s / v and t^2 / v, t the model cut to what is seen of clipped pixels.
    pub matched: f64,
    pub matched_square: f64,
    /// Pixels that may object to the model, and their sum of r^2 / v.
    pub all: f64,
    pub all_square: f64,
    /// The same of those that hold the spot; and of these the sums of s^2, r^2, v, h,
    pub near: f64,
    pub near_square: f64,
    pub energy: f64,
    pub missed: f64,
    pub noise: f64,
    pub light: f64,
    /// r x, r y, v x^2, v y^2.
    pub skew: [f64; 2],
    pub spread: [f64; 2],
}

for_each_processor! {
    pub fn moments(patch: &Patch, model: &Model) -> Moments {
        let background = model.parameters[6];
        let mut squares = [[[0.0; LANES]; 5]; 5];
        let [mut heights, mut residuals] = [[[[0.0; LANES]; 3]; 3]; 2];
        let [mut weight_sum, mut residual_sum, mut cost] = [[0.0; LANES]; 3];
        for block in 0..patch.blocks {
            let columns = Columns::new(patch, model, block);
            // Times powers of y; those of x are the same for a column.
            let mut square = [[0.0; LANES]; 5];
            let [mut height, mut product] = [[[0.0; LANES]; 3]; 2];
            for row in 0..patch.rows {
                let i = row * patch.blocks + block;
                let dy = patch.dy(model, row);
                let (dy2, e) = (dy * dy, columns.exponentials(dy));
                let powers = [1.0, dy, dy2, dy2 * dy, dy2 * dy2];
                for l in 0..LANES {
                    let h = model.amplitude * e[l];
                    let r = patch.signal[i][l] as f64 - h - background;
                    let w = if r <= patch.least[i][l] { 0.0 } else { patch.weights[i][l] };
                    let (wh, wr) = (w * h, w * r);
                    let (whh, whr) = (wh * h, wh * r);
                    weight_sum[l] += w;
                    residual_sum[l] += wr;
                    cost[l] += wr * r;
                    for (sum, power) in square.iter_mut().zip(powers) {
                        sum[l] += whh * power;
                    }
                    for j in 0..3 {
                        height[j][l] += wh * powers[j];
                        product[j][l] += whr * powers[j];
                    }
                }
            }
            let mut power = [1.0; LANES];
            for i in 0..5 {
                for j in 0..5 - i {
                    accumulate(&mut squares[i][j], &power, &square[j]);
                }
                for j in 0..3usize.saturating_sub(i) {
                    accumulate(&mut heights[i][j], &power, &height[j]);
                    accumulate(&mut residuals[i][j], &power, &product[j]);
                }
                for (power, dx) in power.iter_mut().zip(&columns.dx) {
                    *power *= dx;
                }
            }
        }
        Moments {
            squares: squares.map(|s| s.map(sum)),
            heights: heights.map(|s| s.map(sum)),
            residuals: residuals.map(|s| s.map(sum)),
            weight: sum(weight_sum),
            residual: sum(residual_sum),
            cost: sum(cost),
        }
    }

    /// Sets the weights to the inverse variances under the model, robustly or not; true when they are not
    /// those of the background alone.
    pub fn weigh(patch: &mut Patch, model: &Model, robust: bool) -> bool {
        let background = model.parameters[6];
        let foot_error = if patch.has_clipped { FOOT_ERROR } else { 0.0 };
        let bound = if robust { 0.0 } else { NO_LIMIT };
        let mut outlier = [0.0; LANES];
        for block in 0..patch.blocks {
            let columns = Columns::new(patch, model, block);
            for row in 0..patch.rows {
                let i = row * patch.blocks + block;
                let e = columns.exponentials(patch.dy(model, row));
                // Written at once: the compiler cannot know that the weights are none of these.
                let (signal, variance, least) = (patch.signal[i], patch.variance[i], patch.least[i]);
                let mut weights = [0.0; LANES];
                for l in 0..LANES {
                    let h = model.amplitude * e[l];
                    let v = noise(variance[l], patch.signal_variance, h, foot_error);
                    let r = residual(signal[l], h + background, least[l]).abs();
                    let limit = HUBER * v.sqrt() + MODEL_ERROR * h + bound;
                    // Of a pixel that does not count it would be infinite.
                    let limit = if limit < NO_LIMIT { limit } else { NO_LIMIT };
                    let share = limit / if r > limit { r } else { limit };
                    weights[l] = share / v;
                    outlier[l] += 1.0 - share;
                }
                patch.weights[i] = weights;
            }
        }
        sum(outlier) > 0.0 || robust && (patch.has_clipped || patch.signal_variance > 0.0)
    }

    pub fn quality(patch: &Patch, model: &Model) -> Quality {
        let background = model.parameters[6];
        let foot_error = if patch.has_clipped { FOOT_ERROR } else { 0.0 };
        let mut top = [0.0f32; LANES];
        for signal in &patch.signal {
            for l in 0..LANES {
                top[l] = if signal[l] > top[l] { signal[l] } else { top[l] };
            }
        }
        let top = top.into_iter().fold(0.0, f32::max) as f64;
        let foot = 0.05 * model.amplitude.min(top);
        let mut sums = [[0.0; LANES]; 14];
        for block in 0..patch.blocks {
            let columns = Columns::new(patch, model, block);
            for row in 0..patch.rows {
                let i = row * patch.blocks + block;
                let dy = patch.dy(model, row);
                let e = columns.exponentials(dy);
                for l in 0..LANES {
                    let dx = columns.dx[l];
                    let h = model.amplitude * e[l];
                    let v = noise(patch.variance[i][l], patch.signal_variance, h, foot_error);
                    let known = v < f64::INFINITY;
                    let s = patch.signal[i][l] as f64 - background;
                    let r = residual(patch.signal[i][l], h + background, patch.least[i][l]);
                    let clipped = patch.least[i][l] == 0.0;
                    let template = if clipped & (s < h) { s } else { h };
                    let objects = known & !(clipped & (r == 0.0));
                    let near = objects & (h >= foot);
                    let w = 1.0 / v;
                    let [w_all, w_near, one, one_near] =
                        [(known, w), (near, w), (objects, 1.0), (near, 1.0)].map(|(is, v)| if is { v } else { 0.0 });
                    let v_near = if near { v } else { 0.0 };
                    let r_near = one_near * r;
                    let terms = [
                        w_all * template * s,
                        w_all * template * template,
                        one,
                        one * w_all * r * r,
                        one_near,
                        w_near * r * r,
                        one_near * s * s,
                        r_near * r,
                        v_near,
                        one_near * h,
                        r_near * dx,
                        r_near * dy,
                        v_near * dx * dx,
                        v_near * dy * dy,
                    ];
                    for (sum, term) in sums.iter_mut().zip(terms) {
                        sum[l] += term;
                    }
                }
            }
        }
        let [matched, matched_square, all, all_square, near, near_square, energy, missed, noise, light, ..] =
            sums.map(sum);
        let [.., skew_x, skew_y, spread_x, spread_y] = sums.map(sum);
        let (skew, spread) = ([skew_x, skew_y], [spread_x, spread_y]);
        Quality {
            matched, matched_square, all, all_square, near, near_square, energy, missed, noise, light, skew, spread,
        }
    }

    /// Inverse of the mean variance of the pixels that count; 0 for none.
    pub fn mean_weight(patch: &Patch) -> f64 {
        let [mut count, mut variance] = [[0.0; LANES]; 2];
        for v in &patch.variance {
            for l in 0..LANES {
                let known = v[l] < f32::INFINITY;
                count[l] += if known { 1.0 } else { 0.0 };
                variance[l] += if known { v[l] as f64 } else { 0.0 };
            }
        }
        sum(count) / sum(variance).max(1e-9)
    }
}

/// A block of columns of a model: exp(-q / 2) is that of a parabola in y.
struct Columns {
    dx: Lanes,
    constant: Lanes,
    linear: Lanes,
    quadratic: f64,
}

impl Columns {
    #[inline(always)]
    fn new(patch: &Patch, model: &Model, block: usize) -> Self {
        let [x, _, _, xx, xy, yy, _] = model.parameters.data.0[0];
        let mut columns = Self { dx: [0.0; LANES], constant: [0.0; LANES], linear: [0.0; LANES], quadratic: -0.5 * yy };
        let first = patch.left as f64 - x;
        for l in 0..LANES {
            let dx = first + ((block * LANES + l) * patch.step) as f64;
            columns.dx[l] = dx;
            columns.constant[l] = -0.5 * xx * dx * dx;
            columns.linear[l] = -xy * dx;
        }
        columns
    }

    #[inline(always)]
    fn exponentials(&self, dy: f64) -> Lanes {
        let square = self.quadratic * dy * dy;
        let mut e = [0.0; LANES];
        for ((e, constant), linear) in e.iter_mut().zip(&self.constant).zip(&self.linear) {
            *e = exponential(constant + linear * dy + square);
        }
        e
    }
}

impl Patch {
    #[inline(always)]
    fn dy(&self, model: &Model, row: usize) -> f64 {
        (self.top + row * self.step) as f64 - model.parameters[1]
    }
}

/// Variance of a pixel under the model.
#[inline(always)]
fn noise(variance: f32, signal_variance: f32, height: f64, foot_error: f64) -> f64 {
    let foot = foot_error * height;
    variance as f64 + signal_variance as f64 * height + foot * foot
}

/// Signal minus model; a clipped pixel only objects to a model below it.
#[inline(always)]
fn residual(signal: f32, model: f64, least: f64) -> f64 {
    let residual = signal as f64 - model;
    if residual > least { residual } else { least }
}

#[inline(always)]
fn accumulate(sums: &mut Lanes, a: &Lanes, b: &Lanes) {
    for l in 0..LANES {
        sums[l] += a[l] * b[l];
    }
}

/// In pairs, as vectors add: the same order everywhere.
#[inline(always)]
fn sum([a, b, c, d, e, f, g, h]: Lanes) -> f64 {
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}
