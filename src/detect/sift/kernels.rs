//! The loops where the time goes, compiled for the processor at hand.
//!
//! The same bits on every processor: see [`crate::vectors`].
#![allow(unsafe_code)]

use crate::vectors::for_each_processor;

/// Columns that are worked on together; rows are padded to a multiple of it.
pub const LANES: usize = 64;
pub type Lanes = [f32; LANES];
/// Pixels that are searched together.
pub const GROUP: usize = 16;

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

    /// out = a - b.
    pub fn subtract(out: &mut [f32], a: &[f32], b: &[f32]) {
        for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
            *out = a - b;
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

/// Halfway between the third and the fourth of six equidistant values: exact for a polynomial of degree 5.
#[inline(always)]
fn between([a, b, c, d, e, f]: [f32; 6]) -> f32 {
    (3.0 / 256.0) * (a + f) + (-25.0 / 256.0) * (b + e) + (150.0 / 256.0) * (c + d)
}

#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn less(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
