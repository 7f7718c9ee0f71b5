//! The loops where the time goes, compiled for the processor at hand.
//!
//! The same bits on every processor: see [`crate::vectors`].
#![allow(unsafe_code)]

use crate::vectors::for_each_processor;

/// Columns that are worked on together; rows are padded to a multiple of it.
pub const LANES: usize = 64;
pub type Lanes = [f32; LANES];

for_each_processor! {
    /// A symmetric filter: out = weights[0] centre + sum of weights[j] (pairs[j - 1][0] + pairs[j - 1][1]),
    /// over all of `out`.
    pub fn filter(out: &mut [Lanes], centre: &[Lanes], pairs: &[[&[Lanes]; 2]], weights: &[f32]) {
        let Some((first, weights)) = weights.split_first() else { return };
        for (i, (out, centre)) in out.iter_mut().zip(centre).enumerate() {
            let mut sum = centre.map(|c| first * c);
            for ([a, b], w) in pairs.iter().zip(weights) {
                let (a, b) = (&a[i], &b[i]);
                for l in 0..LANES {
                    sum[l] += w * (a[l] + b[l]);
                }
            }
            *out = sum;
        }
    }

    /// out = a - b.
    pub fn subtract(out: &mut [f32], a: &[f32], b: &[f32]) {
        for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
            *out = a - b;
        }
    }

    /// Sets flags[x] where |row[x]| exceeds the threshold and none of its six nearest neighbours (left,
    /// right and the four of `around`) is farther from zero on the same side. First and last get none.
    pub fn peaks(flags: &mut [u8], row: &[f32], around: [&[f32]; 4], threshold: f32) {
        let n = flags.len();
        if n < 3 {
            return flags.fill(0);
        }
        let (left, middle, right) = (&row[..n - 2], &row[1..n - 1], &row[2..n]);
        let [a, b, c, d] = around.map(|s| &s[1..n - 1]);
        (flags[0], flags[n - 1]) = (0, 0);
        let flags = &mut flags[1..n - 1];
        for x in 0..n - 2 {
            let v = middle[x];
            let high = greater(greater(greater(left[x], right[x]), greater(a[x], b[x])), greater(c[x], d[x]));
            let low = less(less(less(left[x], right[x]), less(a[x], b[x])), less(c[x], d[x]));
            let top = (v > threshold) & (v >= high);
            let bottom = (v < -threshold) & (v <= low);
            flags[x] = (top | bottom) as u8;
        }
    }

    /// Magnitude and angle (-pi to pi, from x towards y) of the central differences of `rows`[1], whose
    /// slices are one longer on both sides than the outputs.
    pub fn gradients(magnitude: &mut [f32], angle: &mut [f32], rows: [&[f32]; 3]) {
        let n = magnitude.len();
        let angle = &mut angle[..n];
        let [above, row, below] = rows.map(|r| &r[..n + 2]);
        for x in 0..n {
            let (dx, dy) = (row[x + 2] - row[x], below[x + 1] - above[x + 1]);
            magnitude[x] = (dx * dx + dy * dy).sqrt();
            angle[x] = arctangent(dy, dx);
        }
    }
}

/// Most pixels of a row of a descriptor's window: 2 x 38 + 1.
pub const ROW: usize = 80;
/// Orientations of a descriptor's cell.
pub const BINS: usize = 8;
/// Cells along a side of a descriptor, with a rim that takes what falls beyond.
pub const SIDE: usize = 6;
/// A descriptor in the making.
pub type Histograms = [[f32; BINS]; SIDE * SIDE];

for_each_processor! {
    /// Adds a row of gradients to the histograms, each to the four cells and the two orientations about
    /// it. `across`: their weights; `cell`: column and row, in cells, of the first pixel and the steps from
    /// pixel to pixel.
    pub fn spread(
        histograms: &mut Histograms,
        magnitude: &[f32],
        angle: &[f32],
        across: &[f32],
        down: f32,
        cell: [[f32; 2]; 2],
        orientation: f32,
    ) {
        let n = magnitude.len().min(ROW);
        let (magnitude, angle, across) = (&magnitude[..n], &angle[..n], &across[..n]);
        let mut index = [0u32; ROW];
        let [mut turns, mut right, mut below, mut weights] = [[0.0f32; ROW]; 4];
        let limit = (SIDE - 1) as f32 - 1e-3;
        for i in 0..n {
            let column = less(greater(cell[0][0] + i as f32 * cell[1][0], 0.0), limit);
            let row = less(greater(cell[0][1] + i as f32 * cell[1][1], 0.0), limit);
            // SAFETY: both are within 0 to SIDE - 1, also where the input was NaN.
            let (c, r): (i32, i32) = unsafe { (column.to_int_unchecked(), row.to_int_unchecked()) };
            index[i] = (SIDE as i32 * r + c) as u32;
            right[i] = column - c as f32;
            below[i] = row - r as f32;
            weights[i] = magnitude[i] * across[i] * down;
            let turn = (orientation - angle[i]) * (BINS as f32 / std::f32::consts::TAU);
            let turn = if turn < 0.0 { turn + BINS as f32 } else { turn };
            turns[i] = if turn >= BINS as f32 { turn - BINS as f32 } else { turn };
        }
        // Runs of pixels fall between the same four cells: these are summed apart from the histograms.
        let mut sums = [[0.0f32; BINS]; 4];
        let mut cells = 0;
        for i in 0..n {
            if index[i] as usize != cells {
                add_cells(histograms, cells, &sums);
                sums = [[0.0; BINS]; 4];
                cells = index[i] as usize;
            }
            let mut share = [0.0f32; BINS];
            for (k, s) in share.iter_mut().enumerate() {
                let apart = (turns[i] - k as f32).abs();
                // Around the circle.
                let apart = less(apart, BINS as f32 - apart);
                *s = weights[i] * greater(1.0 - apart, 0.0);
            }
            let (r, b) = (right[i], below[i]);
            let parts = [(1.0 - b) * (1.0 - r), (1.0 - b) * r, b * (1.0 - r), b * r];
            for (sum, part) in sums.iter_mut().zip(parts) {
                for (sum, s) in sum.iter_mut().zip(&share) {
                    *sum += part * s;
                }
            }
        }
        add_cells(histograms, cells, &sums);
    }
}

/// Adds to a cell, the next, and the two below them.
#[inline(always)]
fn add_cells(histograms: &mut Histograms, first: usize, sums: &[[f32; BINS]; 4]) {
    let first = first.min(SIDE * (SIDE - 1) - 2);
    for (offset, sums) in [0, 1, SIDE, SIDE + 1].into_iter().zip(sums) {
        for (h, s) in histograms[first + offset].iter_mut().zip(sums) {
            *h += s;
        }
    }
}

#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn less(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// atan2(y, x) to 3e-6 rad, 0 for the null vector: an odd polynomial of degree 11 up to 45 degrees.
#[inline(always)]
fn arctangent(y: f32, x: f32) -> f32 {
    use std::f32::consts::{FRAC_PI_2, PI};
    let (ax, ay) = (x.abs(), y.abs());
    let t = less(ax, ay) / greater(greater(ax, ay), f32::MIN_POSITIVE);
    let s = t * t;
    let p = -0.011_721_2 * s + 0.052_653_32;
    let p = p * s - 0.116_432_87;
    let p = p * s + 0.193_543_46;
    let p = p * s - 0.332_623_47;
    let p = (p * s + 0.999_977_26) * t;
    let p = if ay > ax { FRAC_PI_2 - p } else { p };
    let p = if x < 0.0 { PI - p } else { p };
    if y < 0.0 { -p } else { p }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arctangent_is_good_to_3e_6() {
        let worst = (0..100_000)
            .map(|i| {
                let a = (f64::from(i) / 50_000.0 - 1.0) * std::f64::consts::PI;
                let (y, x) = ((7.0 * a.sin()) as f32, (7.0 * a.cos()) as f32);
                (f64::from(arctangent(y, x)) - f64::from(y).atan2(f64::from(x))).abs()
            })
            .fold(0.0, f64::max);
        assert!(worst < 3e-6, "{worst}");
        assert_eq!(arctangent(0.0, 0.0), 0.0);
    }
}
