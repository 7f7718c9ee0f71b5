//! The loops where the time goes, compiled for the processor at hand.
//!
//! The same bits on every processor: see [`crate::vectors`].
#![allow(unsafe_code)]

use std::ops::Range;

use super::doubling::Doubling;
use super::scale_space::LEVELS;
use crate::vectors::{for_each_processor, greater, less};

/// Columns that are worked on together; rows are padded to a multiple of it.
pub const LANES: usize = 64;
pub type Lanes = [f32; LANES];
/// Pixels that are searched together.
pub const GROUP: usize = 16;

for_each_processor! {
    /// A symmetric filter along columns: every line of `out` is weights[0] times its row plus the sum of
    /// weights[j] times the rows j above and below, in groups `columns`. `rows`: those of the lines, and as
    /// many before and behind as there are weights but one. Lines are `stride` apart, and begin with
    /// `margin` numbers that are left as they are.
    pub fn filter_columns(
        out: &mut [f32],
        stride: usize,
        margin: usize,
        columns: Range<usize>,
        rows: &[&[Lanes]],
        weights: &[f32],
    ) {
        let Some((first, weights)) = weights.split_first() else { return };
        for (line, rows) in out.chunks_exact_mut(stride).zip(rows.windows(2 * weights.len() + 1)) {
            let (above, rows) = rows.split_at(weights.len());
            let Some((centre, below)) = rows.split_first() else { return };
            for (x, out) in columns.clone().zip(&mut line[margin..].as_chunks_mut().0[columns.clone()]) {
                let mut sum = centre[x].map(|c| first * c);
                for ((a, b), w) in above.iter().rev().zip(below).zip(weights) {
                    let (a, b) = (&a[x], &b[x]);
                    for l in 0..LANES {
                        sum[l] += w * (a[l] + b[l]);
                    }
                }
                *out = sum;
            }
        }
    }

    /// The same along a row: `line` has as many numbers more on both sides as there are weights but one.
    pub fn filter_row(out: &mut [Lanes], line: &[f32], weights: &[f32]) {
        let Some((first, weights)) = weights.split_first() else { return };
        let radius = weights.len();
        for (x, out) in out.iter_mut().enumerate() {
            let line = &line[x * LANES..][..LANES + 2 * radius];
            let mut sum = [0.0; LANES];
            for l in 0..LANES {
                sum[l] = first * line[radius..][l];
            }
            for (j, w) in (1..=radius).zip(weights) {
                let (a, b) = (&line[radius - j..][..LANES], &line[radius + j..][..LANES]);
                for l in 0..LANES {
                    sum[l] += w * (a[l] + b[l]);
                }
            }
            *out = sum;
        }
    }

    /// Lines halfway between rows and on them, blurred: of each two lines the first lies on the fourth of
    /// seven rows, the second halfway to the fifth. See [`filter_columns`].
    pub fn double_columns(
        out: &mut [f32],
        stride: usize,
        margin: usize,
        rows: &[&[Lanes]],
        filters: &Doubling,
    ) {
        for (lines, rows) in out.chunks_exact_mut(2 * stride).zip(rows.windows(7)) {
            let (on, between) = lines.split_at_mut(stride);
            let (on, between) = (on[margin..].as_chunks_mut().0, between[margin..].as_chunks_mut().0);
            for (x, (on, between)) in on.iter_mut().zip(between).enumerate().take(rows[0].len()) {
                let [a, b, c, d, e, f, g] = [0, 1, 2, 3, 4, 5, 6].map(|i| &rows[i][x]);
                let (mut first, mut second) = ([0.0; LANES], [0.0; LANES]);
                for l in 0..LANES {
                    [first[l], second[l]] = doubled([a[l], b[l], c[l], d[l], e[l], f[l], g[l]], filters);
                }
                (*on, *between) = (first, second);
            }
        }
    }

    /// The same along a row. `line` has three numbers more on both sides.
    pub fn double_row(out: &mut [f32], line: &[f32], filters: &Doubling) {
        let n = (out.len() / 2).min(line.len().saturating_sub(6));
        let [a, b, c, d, e, f, g] = [0, 1, 2, 3, 4, 5, 6].map(|i| &line[i..i + n]);
        let out = &mut out.as_chunks_mut::<2>().0[..n];
        for i in 0..n {
            out[i] = doubled([a[i], b[i], c[i], d[i], e[i], f[i], g[i]], filters);
        }
    }

    /// Values of `line` from the fourth on, and between each and the next. `line`: three more on both sides.
    pub fn raise(out: &mut [f32], line: &[f32]) {
        let n = (out.len() / 2).min(line.len().saturating_sub(6));
        let [a, b, c, d, e, f] = [1, 2, 3, 4, 5, 6].map(|i| &line[i..i + n]);
        let out = &mut out.as_chunks_mut::<2>().0[..n];
        for i in 0..n {
            out[i] = [c[i], between([a[i], b[i], c[i], d[i], e[i], f[i]])];
        }
    }

    /// Halfway between the third and the fourth row.
    pub fn between_rows(out: &mut [f32], rows: [&[f32]; 6]) {
        let n = out.len();
        let [a, b, c, d, e, f] = rows;
        let (a, b, c, d, e, f) = (&a[..n], &b[..n], &c[..n], &d[..n], &e[..n], &f[..n]);
        for i in 0..n {
            out[i] = between([a[i], b[i], c[i], d[i], e[i], f[i]]);
        }
    }

    /// Each level but the first minus the one before.
    pub fn differences(out: [&mut [f32]; LEVELS - 1], levels: [&[f32]; LEVELS]) {
        let [o0, o1, o2, o3, o4] = out;
        let n = o0.len();
        let (o1, o2, o3, o4) = (&mut o1[..n], &mut o2[..n], &mut o3[..n], &mut o4[..n]);
        let [a, b, c, d, e, f] = levels.map(|level| &level[..n]);
        for x in 0..n {
            o0[x] = b[x] - a[x];
            o1[x] = c[x] - b[x];
            o2[x] = d[x] - c[x];
            o3[x] = e[x] - d[x];
            o4[x] = f[x] - e[x];
        }
    }

    /// Sets flags[x] where |row[x]| exceeds the threshold and none of its six nearest neighbours (left,
    /// right and the four of `around`) is farther from zero on the same side. `row` begins a group before
    /// the first pixel and ends one behind the last. Returns how many groups have flags; `hits` begins with them.
    pub fn peaks(
        flags: &mut [[u8; GROUP]],
        hits: &mut [u32],
        row: &[f32],
        around: [&[f32]; 4],
        threshold: f32,
    ) -> usize {
        let mut found = 0;
        let hits = &mut hits[..flags.len()];
        let n = GROUP * flags.len();
        let (left, right) = (&row[GROUP - 1..][..n], &row[GROUP + 1..][..n]);
        let [left, middle, right, a, b, c, d] =
            [left, &row[GROUP..][..n], right, &around[0][..n], &around[1][..n], &around[2][..n], &around[3][..n]]
                .map(|row| row.as_chunks::<GROUP>().0);
        for (i, flags) in flags.iter_mut().enumerate() {
            let (left, middle, right, a, b, c, d) = (&left[i], &middle[i], &right[i], &a[i], &b[i], &c[i], &d[i]);
            for x in 0..GROUP {
                let v = middle[x];
                let high = greater(greater(greater(left[x], right[x]), greater(a[x], b[x])), greater(c[x], d[x]));
                let low = less(less(less(left[x], right[x]), less(a[x], b[x])), less(c[x], d[x]));
                let top = (v > threshold) & (v >= high);
                let bottom = (v < -threshold) & (v <= low);
                flags[x] = (top | bottom) as u8;
            }
            hits[found.min(i)] = i as u32;
            found += (u128::from_ne_bytes(*flags) != 0) as usize;
        }
        found
    }
}

/// On the fourth of seven equidistant values, and halfway to the fifth.
#[inline(always)]
fn doubled([a, b, c, d, e, f, g]: [f32; 7], filters: &Doubling) -> [f32; 2] {
    let (on, between) = (&filters.on, &filters.between);
    [
        on[0] * d + on[1] * (c + e) + on[2] * (b + f) + on[3] * (a + g),
        between[0] * (d + e) + between[1] * (c + f) + between[2] * (b + g),
    ]
}

/// Halfway between the third and the fourth of six equidistant values: exact for a polynomial of degree 5.
#[inline(always)]
fn between([a, b, c, d, e, f]: [f32; 6]) -> f32 {
    (3.0 / 256.0) * (a + f) + (-25.0 / 256.0) * (b + e) + (150.0 / 256.0) * (c + d)
}
