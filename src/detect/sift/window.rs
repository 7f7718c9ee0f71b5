//! Sums over the gradients of a keypoint's window, compiled for the processor at hand: see
//! [`crate::vectors`].
//!
//! Levels are blurred by two pixels and more, so that not every pixel is needed: orientations take every
//! second one as the black fields of a chessboard do, descriptors those of even column and row. A quarter
//! turn changes nothing.
#![allow(unsafe_code)]

use std::f32::consts::TAU;

use super::arctangent::arctangent;
use super::scale_space::{Octave, PADDING};
use crate::image::exponential::exponential;
use crate::vectors::{for_each_processor, greater, less};

/// Most pixels of a row of a window: 2 x 38 + 1.
const ROW: usize = 80;
/// Pixels that are worked on together, and what a row is read beyond the first of them.
const GROUP: usize = 16;
const _: () = assert!(PADDING > 2 * GROUP);
/// Bins of the orientation histogram.
pub const ORIENTATIONS: usize = 36;
/// Orientations of a descriptor's cell.
pub const BINS: usize = 8;
/// Cells along a side of a descriptor, with a rim that takes what falls beyond.
pub const SIDE: usize = 6;
pub const DESCRIPTOR_SIZE: usize = 128;
pub type Descriptor = [u8; DESCRIPTOR_SIZE];
/// A descriptor in the making.
pub type Histograms = [[f32; BINS]; SIDE * SIDE];

/// Where a keypoint lies in its octave: the level that suits its scale, place and sigma in pixels.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    pub level: usize,
    pub x: f32,
    pub y: f32,
    pub sigma: f32,
}

for_each_processor! {
    /// Gradients within `radius` by their angle, from -pi on, each in the two bins about it. Their weights
    /// are Gaussian, of standard deviation `window`.
    pub fn directions(octave: &Octave, place: &Place, window: f32, radius: f32) -> [f32; ORIENTATIONS] {
        let (left, right) = span(place.x, radius, octave.width());
        let (top, bottom) = span(place.y, radius, octave.height());
        let first = left as f32 - place.x;
        let across: [[f32; ROW / 2 + 8]; 2] = [weights(first, 2.0, window), weights(first + 1.0, 2.0, window)];
        let down: [f32; ROW] = weights(top as f32 - place.y, 1.0, window);
        // Apart from those of a pixel's neighbours, which it would have to wait for; two of the next turn.
        let mut halves = [[0.0f32; ORIENTATIONS + 2]; 2];
        for (y, down) in (top..bottom).zip(down) {
            let odd = (left ^ y) & 1;
            let groups = (left + odd..right).step_by(2 * GROUP);
            for (x, across) in groups.zip(across[odd].as_chunks::<GROUP>().0) {
                let (magnitude, angle) = gradients(octave, place.level, x, y);
                let mut bin = [0u32; GROUP];
                let mut shares = [[0.0f32; GROUP]; 2];
                for i in 0..GROUP {
                    // From half a turn back, so that it is positive.
                    let turn = angle[i] * (ORIENTATIONS as f32 / TAU) + 0.5 * ORIENTATIONS as f32;
                    let turn = less(greater(turn, 0.0), ORIENTATIONS as f32);
                    // SAFETY: it is within 0 and 36.
                    let whole: i32 = unsafe { turn.to_int_unchecked() };
                    bin[i] = whole as u32;
                    let weight = magnitude[i] * across[i] * down;
                    shares[1][i] = weight * (turn - whole as f32);
                    shares[0][i] = weight - shares[1][i];
                }
                for i in 0..(right - x).div_ceil(2).min(GROUP) {
                    let (half, bin) = (&mut halves[i % 2], (bin[i] as usize).min(ORIENTATIONS));
                    half[bin] += shares[0][i];
                    half[bin + 1] += shares[1][i];
                }
            }
        }
        let both = |i: usize| halves[0][i] + halves[1][i];
        std::array::from_fn(|i| if i < 2 { both(i) + both(i + ORIENTATIONS) } else { both(i) })
    }

    /// Gradients within the square of side 2 `half` about the place that is turned by an angle with this
    /// sine and cosine, each spread over the four cells and the two orientations about it. `cell`: the
    /// side of a cell in pixels. The weights are Gaussian, of standard deviation `window`.
    pub fn cells(
        octave: &Octave,
        place: &Place,
        orientation: f32,
        turned: [f32; 2],
        half: f32,
        cell: f32,
        window: f32,
    ) -> Histograms {
        let [sin, cos] = turned;
        let radius = half * (sin.abs() + cos.abs());
        let (left, right) = span(place.x, radius, octave.width());
        let (top, bottom) = span(place.y, radius, octave.height());
        let (left, top) = (left.next_multiple_of(2), top.next_multiple_of(2));
        let across: [f32; ROW / 2 + GROUP] = weights(left as f32 - place.x, 2.0, window);
        let down: [f32; ROW / 2] = weights(top as f32 - place.y, 2.0, window);
        let step = [cos / cell, -sin / cell];
        let middle = 0.5 * (SIDE - 1) as f32;
        let (inverse, by_cell) = ([1.0 / cos, -1.0 / sin], 1.0 / cell);
        let mut samples = Samples::new();
        let mut sums = Sums::new();
        for (y, down) in (top..bottom).step_by(2).zip(down) {
            let dy = y as f32 - place.y;
            // |cos dx + sin dy| < half and |cos dy - sin dx| < half.
            let (mut low, mut high) = (-radius, radius);
            for ((slope, inverse), offset) in [cos, sin].into_iter().zip(inverse).zip([sin * dy, cos * dy]) {
                if slope.abs() > 1e-6 {
                    let (a, b) = ((-half - offset) * inverse, (half - offset) * inverse);
                    (low, high) = (greater(low, less(a, b)), less(high, greater(a, b)));
                }
            }
            let from = greater((place.x + low).ceil(), left as f32);
            let to = greater(less((place.x + high).floor() + 1.0, right as f32), 0.0);
            // SAFETY: both are within 0 and the width, `from` by half of the window more.
            let (from, to): (i32, i32) = unsafe { (from.to_int_unchecked(), to.to_int_unchecked()) };
            let (from, to) = ((from as usize).next_multiple_of(2), to as usize);
            prefetch(octave, place.level, y + AHEAD, left, right);
            prefetch(octave, place.level, y + AHEAD + 1, left, right);
            for x in (from..to).step_by(2 * GROUP) {
                let (magnitude, angle) = gradients(octave, place.level, x, y);
                let dx = x as f32 - place.x;
                // Cell k of 1 to 4 is centred at k.
                let first = [(cos * dx + sin * dy) * by_cell + middle, (cos * dy - sin * dx) * by_cell + middle];
                samples.add(&magnitude, &angle, &across[(x - left) / 2..], down, first, step, orientation);
                samples.n += (to - x).div_ceil(2).min(GROUP);
                if samples.n >= ENOUGH {
                    sums.take(&mut samples);
                }
            }
        }
        sums.take(&mut samples);
        sums.histograms()
    }

    /// Clipped at a share of its length, scaled to a length and rounded.
    pub fn quantise(vector: &[f32; DESCRIPTOR_SIZE], clip: f32, length: f32) -> Descriptor {
        let most = clip * norm(vector);
        let vector = vector.map(|a| less(a, most));
        let scale = length / greater(norm(&vector), f32::MIN_POSITIVE);
        let mut bytes = [0; DESCRIPTOR_SIZE];
        for (byte, a) in bytes.iter_mut().zip(vector) {
            // SAFETY: within 0 and 255, also where the input was NaN.
            let rounded: i32 = unsafe { less(greater(a * scale + 0.5, 0.0), 255.0).to_int_unchecked() };
            *byte = rounded as u8;
        }
        bytes
    }
}

/// Length, summed in lanes.
#[inline(always)]
fn norm(vector: &[f32; DESCRIPTOR_SIZE]) -> f32 {
    let mut sums = [0.0f32; GROUP];
    for part in vector.as_chunks::<GROUP>().0 {
        for (sum, a) in sums.iter_mut().zip(part) {
            *sum += a * a;
        }
    }
    sums.iter().sum::<f32>().sqrt()
}

/// first..end of the pixels within `radius` of `centre` that have neighbours on both sides.
#[inline(always)]
fn span(centre: f32, radius: f32, size: usize) -> (usize, usize) {
    let first = (centre - radius).ceil().max(1.0) as usize;
    let end = ((centre + radius).floor() as i64 + 1).clamp(0, size as i64 - 1) as usize;
    (first, end.max(first).min(first + ROW))
}

/// exp(-x^2 / 2 window^2) of x = first, first + step, ...
#[inline(always)]
fn weights<const N: usize>(first: f32, step: f32, window: f32) -> [f32; N] {
    let scale = -0.5 / f64::from(window).powi(2);
    let mut weights = [0.0; N];
    for (i, w) in weights.iter_mut().enumerate() {
        let x = f64::from(first + step * i as f32);
        *w = exponential(scale * x * x) as f32;
    }
    weights
}

/// Rows of a window are far apart in memory, so that the processor does not guess the next one.
const AHEAD: usize = 7;

#[inline(always)]
#[cfg_attr(not(target_arch = "x86_64"), allow(unused_variables))]
fn prefetch(octave: &Octave, level: usize, y: usize, from: usize, to: usize) {
    #[cfg(target_arch = "x86_64")]
    if y < octave.rows(level) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        for part in octave.padded_row(level, y).get(from..to).into_iter().flat_map(|row| row.chunks(16)) {
            // SAFETY: it only hints.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(part.as_ptr().cast()) };
        }
    }
}

/// Magnitude and angle (-pi to pi, from x towards y) of the central differences at `x`, `x` + 2, ...
#[inline(always)]
fn gradients(octave: &Octave, level: usize, x: usize, y: usize) -> ([f32; GROUP], [f32; GROUP]) {
    const WIDTH: usize = 2 * GROUP;
    let above: &[f32; WIDTH] = part(octave.padded_row(level, y - 1), x);
    let below: &[f32; WIDTH] = part(octave.padded_row(level, y + 1), x);
    let row = octave.padded_row(level, y);
    let (left, right): (&[f32; WIDTH], &[f32; WIDTH]) = (part(row, x - 1), part(row, x + 1));
    let (mut dx, mut dy) = ([0.0f32; WIDTH], [0.0f32; WIDTH]);
    for i in 0..WIDTH {
        dx[i] = right[i] - left[i];
        dy[i] = below[i] - above[i];
    }
    let (dx, dy) = (every_second(dx), every_second(dy));
    let (mut magnitude, mut angle) = ([0.0; GROUP], [0.0; GROUP]);
    for i in 0..GROUP {
        magnitude[i] = (dx[i] * dx[i] + dy[i] * dy[i]).sqrt();
        angle[i] = arctangent(dy[i], dx[i]);
    }
    (magnitude, angle)
}

/// What follows a place in a row, which is padded for that.
#[inline(always)]
fn part<const N: usize>(row: &[f32], at: usize) -> &[f32; N] {
    row[at..].first_chunk().expect("padding")
}

/// The first of each pair. Reading at every second place keeps the compiler from vectorising; dropping
/// one half of a wider number does not.
#[inline(always)]
fn every_second(values: [f32; 2 * GROUP]) -> [f32; GROUP] {
    // SAFETY: any bits are numbers, and these are as many.
    let pairs: [u64; GROUP] = unsafe { std::mem::transmute(values) };
    let mut first = [0.0; GROUP];
    for i in 0..GROUP {
        first[i] = f32::from_bits(if cfg!(target_endian = "big") { pairs[i] >> 32 } else { pairs[i] } as u32);
    }
    first
}

/// Gradients that are gathered before they are added to the histograms, and room for a group more.
const ENOUGH: usize = 128;
const SAMPLES: usize = ENOUGH + GROUP;

/// Where gradients belong in a descriptor.
struct Samples {
    n: usize,
    /// Of the first of the four cells.
    cell: [u32; SAMPLES],
    /// Shares of the four cells, with the gradient's weight.
    shares: [[f32; SAMPLES]; 4],
    /// Orientation, whole and rest.
    bin: [u32; SAMPLES],
    rest: [f32; SAMPLES],
}

impl Samples {
    #[inline(always)]
    fn new() -> Self {
        Self { n: 0, cell: [0; SAMPLES], shares: [[0.0; SAMPLES]; 4], bin: [0; SAMPLES], rest: [0.0; SAMPLES] }
    }

    /// A group behind the `n` that count. `first` and `step`: column and row, in cells, of the first pixel,
    /// and the steps from pixel to pixel.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    fn add(
        &mut self,
        magnitude: &[f32; GROUP],
        angle: &[f32; GROUP],
        across: &[f32],
        down: f32,
        first: [f32; 2],
        step: [f32; 2],
        orientation: f32,
    ) {
        let limit = (SIDE - 1) as f32 - 1e-5;
        let across: &[f32; GROUP] = across.first_chunk().unwrap_or(&[0.0; GROUP]);
        let n = self.n.min(ENOUGH);
        let (cell, bin, rest) =
            (&mut self.cell[n..n + GROUP], &mut self.bin[n..n + GROUP], &mut self.rest[n..n + GROUP]);
        let [s0, s1, s2, s3] = &mut self.shares;
        let (s0, s1) = (&mut s0[n..n + GROUP], &mut s1[n..n + GROUP]);
        let (s2, s3) = (&mut s2[n..n + GROUP], &mut s3[n..n + GROUP]);
        for i in 0..GROUP {
            let x = (2 * i) as f32;
            let column = less(greater(first[0] + x * step[0], 0.0), limit);
            let row = less(greater(first[1] + x * step[1], 0.0), limit);
            // SAFETY: both are within 0 to SIDE - 1, also where the input was NaN.
            let (c, r): (i32, i32) = unsafe { (column.to_int_unchecked(), row.to_int_unchecked()) };
            cell[i] = r.wrapping_mul(SIDE as i32 - 1).wrapping_add(c) as u32;
            let (right, below) = (column - c as f32, row - r as f32);
            let weight = magnitude[i] * across[i] * down;
            let (upper, lower) = (weight * (1.0 - below), weight * below);
            s0[i] = upper * (1.0 - right);
            s1[i] = upper * right;
            s2[i] = lower * (1.0 - right);
            s3[i] = lower * right;
            let turn = (orientation - angle[i]) * (BINS as f32 / TAU);
            let turn = if turn < 0.0 { turn + BINS as f32 } else { turn };
            let turn = if turn >= BINS as f32 { turn - BINS as f32 } else { turn };
            // SAFETY: not NaN: it is what an angle became.
            let whole: i32 = unsafe { less(greater(turn, 0.0), (BINS - 1) as f32).to_int_unchecked() };
            bin[i] = whole as u32;
            rest[i] = turn - whole as f32;
        }
    }
}

/// 1 at a bin, and the way from there to the next.
const AT: [[f32; BINS]; BINS] = around_the_circle(1.0, 0.0);
const ON: [[f32; BINS]; BINS] = around_the_circle(-1.0, 1.0);

const fn around_the_circle(here: f32, next: f32) -> [[f32; BINS]; BINS] {
    let mut table = [[0.0; BINS]; BINS];
    let mut k = 0;
    while k < BINS {
        table[k][k] = here;
        table[k][(k + 1) % BINS] = next;
        k += 1;
    }
    table
}

/// Sums for the four cells about a gradient, apart from those of its neighbours: what one gradient has
/// written, the next but one may have to wait for.
struct Sums {
    halves: [[[[f32; BINS]; 4]; (SIDE - 1) * (SIDE - 1)]; 2],
}

impl Sums {
    #[inline(always)]
    fn new() -> Self {
        Self { halves: [[[[0.0; BINS]; 4]; (SIDE - 1) * (SIDE - 1)]; 2] }
    }

    /// Adds all samples, and leaves none.
    #[inline(always)]
    fn take(&mut self, samples: &mut Samples) {
        for i in 0..samples.n.min(SAMPLES) {
            let bin = samples.bin[i] as usize % BINS;
            let mut share = [0.0; BINS];
            for k in 0..BINS {
                share[k] = AT[bin][k] + samples.rest[i] * ON[bin][k];
            }
            let sums = &mut self.halves[i % 2][(samples.cell[i] as usize).min((SIDE - 1) * (SIDE - 1) - 1)];
            for (sum, shares) in sums.iter_mut().zip(&samples.shares) {
                for (sum, share) in sum.iter_mut().zip(&share) {
                    *sum += shares[i] * share;
                }
            }
        }
        samples.n = 0;
    }

    #[inline(always)]
    fn histograms(&self) -> Histograms {
        let mut histograms = [[0.0; BINS]; SIDE * SIDE];
        for (i, (a, b)) in self.halves[0].iter().zip(&self.halves[1]).enumerate() {
            let cell = i / (SIDE - 1) * SIDE + i % (SIDE - 1);
            for (corner, offset) in [0, 1, SIDE, SIDE + 1].into_iter().enumerate() {
                for k in 0..BINS {
                    histograms[cell + offset][k] += a[corner][k] + b[corner][k];
                }
            }
        }
        histograms
    }
}
