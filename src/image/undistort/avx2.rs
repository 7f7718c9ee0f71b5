//! Sixteen pixels of a row at a time, by AVX2: the same arithmetic as the scalar path, operation by
//! operation, so that both give the same bytes.
#![allow(unsafe_code)]

use std::arch::x86_64::*;

use super::map::{CubicRow, FRACTION_BITS};
use super::remap::{HALF_STEP, Source, cubic_row};

/// Pixels that are worked on together.
const LANES: usize = 16;
/// Bytes of a row that are read at once.
const WINDOW: i32 = 16;
/// Rows below, of which the processor is told to fetch what the same columns of the picture will need:
/// the lines of a distorted row are scattered, and it does not find out in time.
const ROWS_AHEAD: isize = 8;
/// Pixel positions are compared as 16-bit numbers; one more than the largest is still outside.
const MAX_SIDE: i32 = i16::MAX as i32;

/// A source image that these kernels can read: its sides and distances fit their numbers.
pub struct Wide<'a, const N: usize> {
    source: &'a Source<'a, N>,
    /// The top row's first byte.
    top: *const u8,
    stride: i32,
    /// The last pixel in a row, and the last row, from which a pixel's four neighbours, and all bytes that
    /// are read with them, are inside the image.
    last: [i16; 2],
    /// The same for a window of three rows of sixteen bytes.
    last_window: [i16; 2],
}

/// Of sixteen positions, in order: the pixels and the fractions.
struct Positions {
    /// In units of 2^-14 pixels, for the pixels 0-3 and 8-11, and 4-7 and 12-15.
    fixed: [[__m256i; 2]; 2],
    /// Pixels, signed 16 bits.
    x: __m256i,
    y: __m256i,
    /// The weights of a pixel and of the one on its right, bytes whose sum is 128.
    weights: __m256i,
    /// 15 bits.
    fy: __m256i,
}

impl<'a, const N: usize> Wide<'a, N> {
    /// `None` where the processor has no AVX2, or the image does not fit.
    pub fn new(source: &'a Source<'a, N>) -> Option<Self> {
        const { assert!(N == 1 || N == 3 || N == 4) };
        let (data, first, stride) = source.plane().memory();
        let [width, height] = source.size();
        // Colours are read eight bytes at a time, which are almost three pixels of three bytes.
        let reach = if N == 3 { 3 } else { 2 };
        let fits = (WINDOW..=MAX_SIDE).contains(&width) && (3..=MAX_SIDE).contains(&height);
        if !fits || data.len() > i32::MAX as usize || !is_x86_feature_detected!("avx2") {
            return None;
        }
        Some(Self {
            source,
            top: data.as_ptr().wrapping_add(first),
            stride: i32::try_from(stride).ok()?,
            last: [(width - reach) as i16, (height - 2) as i16],
            last_window: [(width - WINDOW) as i16, (height - 3) as i16],
        })
    }

    /// A row of a cubic cell from its pixel `first` on.
    pub fn cubic_row(&self, row: &CubicRow, first: usize, out: &mut [u8]) {
        // SAFETY: there is a `Wide` only where the processor has AVX2.
        unsafe { self.row(row, first, out) }
    }

    #[target_feature(enable = "avx2")]
    fn row(&self, row: &CubicRow, first: usize, out: &mut [u8]) {
        let mut x = first;
        // In this order packing two vectors into one gives the pixels in order.
        let a = _mm256_setr_ps(0.5, 1.5, 2.5, 3.5, 8.5, 9.5, 10.5, 11.5);
        let b = _mm256_setr_ps(4.5, 5.5, 6.5, 7.5, 12.5, 13.5, 14.5, 15.5);
        let u = |lanes: __m256| {
            let x = _mm256_add_ps(lanes, _mm256_set1_ps(first as f32));
            _mm256_sub_ps(_mm256_mul_ps(x, _mm256_set1_ps(row.step)), _mm256_set1_ps(1.0))
        };
        // Sums of powers of two: exact, so the same as for each pixel alone.
        let (mut u, step) = ([u(a), u(b)], _mm256_set1_ps(row.step * LANES as f32));
        let mut chunks = out.chunks_exact_mut(LANES * N);
        for out in &mut chunks {
            let positions = self.positions(row, u);
            // SAFETY: `out` has sixteen pixels.
            if !unsafe { self.draw_inside(&positions, out) } {
                if self.is_outside(&positions) {
                    out.as_chunks_mut::<N>().0.fill(self.source.border());
                } else {
                    cubic_row(self.source, row, x, out);
                }
            }
            x += LANES;
            u = [_mm256_add_ps(u[0], step), _mm256_add_ps(u[1], step)];
        }
        cubic_row(self.source, row, x, chunks.into_remainder());
    }

    #[target_feature(enable = "avx2")]
    fn positions(&self, row: &CubicRow, [a, b]: [__m256; 2]) -> Positions {
        let cubic = |axis: usize, u: __m256, base: i32| {
            let c = |i: usize| _mm256_set1_ps(row.coefficients[4 * axis + i]);
            let step = |sum, c| _mm256_add_ps(_mm256_mul_ps(sum, u), c);
            let value = step(step(step(c(3), c(2)), c(1)), c(0));
            _mm256_add_epi32(_mm256_cvttps_epi32(value), _mm256_set1_epi32(base))
        };
        let [base_x, base_y] = [row.base[0] + HALF_STEP, row.base[1]];
        let fixed = [[cubic(0, a, base_x), cubic(0, b, base_x)], [cubic(1, a, base_y), cubic(1, b, base_y)]];
        let (x, y) = (packed(whole(fixed[0])), packed(whole(fixed[1])));
        let (fx, fy) = (packed(fraction(fixed[0])), packed(fraction(fixed[1])));
        // 128 - fx in the lower byte, fx in the upper one.
        let fx = _mm256_srli_epi16::<{ BITS - 7 }>(fx);
        let weights = _mm256_add_epi16(_mm256_sub_epi16(_mm256_slli_epi16::<8>(fx), fx), _mm256_set1_epi16(128));
        Positions { fixed, x, y, weights, fy: _mm256_slli_epi16::<{ 15 - BITS }>(fy) }
    }

    /// Draws sixteen pixels if all of them and their neighbours are inside the image.
    ///
    /// # Safety
    /// `out` has sixteen pixels.
    #[target_feature(enable = "avx2")]
    unsafe fn draw_inside(&self, positions: &Positions, out: &mut [u8]) -> bool {
        if N == 1
            && let Some(rows) = self.windows(positions)
        {
            // SAFETY: by this function's contract.
            unsafe { grey(rows, positions, out) };
            return true;
        }
        let [last_x, last_y] = self.last;
        if !all(_mm256_and_si256(at_most(positions.x, last_x), at_most(positions.y, last_y))) {
            return false;
        }
        let offsets = self.offsets(positions);
        // SAFETY: all pixels were just found inside; `out` is as this function's contract says.
        unsafe {
            if N == 1 {
                grey(self.pairs(&offsets), positions, out);
            } else {
                self.colour(&offsets, positions, out);
            }
        }
        true
    }

    /// Grey pixels, each with the one on its right, and those below. Of eight that follow each
    /// other, all are mostly in a window of two rows of sixteen bytes, and in the row below it.
    #[target_feature(enable = "avx2")]
    fn windows(&self, positions: &Positions) -> Option<[__m256i; 2]> {
        let Positions { x, y, .. } = *positions;
        let first = _mm256_broadcastsi128_si256(_mm_setr_epi8(0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1));
        let end = _mm256_add_epi8(first, _mm256_set1_epi8(14));
        let left = _mm256_shuffle_epi8(x, first);
        let top = _mm256_min_epi16(_mm256_shuffle_epi8(y, first), _mm256_shuffle_epi8(y, end));
        let (column, row) = (_mm256_sub_epi16(x, left), _mm256_sub_epi16(y, top));
        let [last_x, last_y] = self.last_window;
        let place = _mm256_and_si256(at_most(left, last_x), at_most(top, last_y));
        let within = _mm256_and_si256(at_most(column, WINDOW as i16 - 2), at_most(row, 1));
        if !all(_mm256_and_si256(place, within)) {
            return None;
        }
        let start = |left: i32, top: i32| {
            let offset = (top & 0xffff) as isize * self.stride as isize + (left & 0xffff) as isize;
            self.top.wrapping_offset(offset)
        };
        let low = start(_mm256_extract_epi16::<0>(left), _mm256_extract_epi16::<0>(top));
        let high = start(_mm256_extract_epi16::<8>(left), _mm256_extract_epi16::<8>(top));
        let ahead = ROWS_AHEAD * self.stride as isize;
        _mm_prefetch::<_MM_HINT_T0>(low.wrapping_offset(ahead).cast());
        // Each pixel's byte and the next.
        let bytes = _mm256_add_epi16(_mm256_or_si256(column, _mm256_slli_epi16::<8>(column)), _mm256_set1_epi16(0x100));
        let pairs = |i: isize| {
            let below = i * self.stride as isize;
            // SAFETY: the windows were just found inside the image.
            let load = |p: *const u8| unsafe { _mm_loadu_si128(p.wrapping_offset(below).cast()) };
            _mm256_shuffle_epi8(_mm256_set_m128i(load(high), load(low)), bytes)
        };
        let (first, second, third) = (pairs(0), pairs(1), pairs(2));
        let upper = _mm256_cmpeq_epi16(row, _mm256_setzero_si256());
        Some([_mm256_blendv_epi8(second, first, upper), _mm256_blendv_epi8(third, second, upper)])
    }

    /// Does no pixel have one of its four neighbours in the image?
    #[target_feature(enable = "avx2")]
    fn is_outside(&self, positions: &Positions) -> bool {
        let [width, height] = self.source.size();
        let near = |p, size: i32| at_most(_mm256_add_epi16(p, _mm256_set1_epi16(1)), size as i16);
        _mm256_movemask_epi8(_mm256_and_si256(near(positions.x, width), near(positions.y, height))) == 0
    }

    /// The pixels' distances in bytes from the image's first.
    #[target_feature(enable = "avx2")]
    fn offsets(&self, positions: &Positions) -> [i32; LANES] {
        let (x, y) = (whole(positions.fixed[0]), whole(positions.fixed[1]));
        let offset = |i: usize| {
            let row = _mm256_mullo_epi32(y[i], _mm256_set1_epi32(self.stride));
            _mm256_add_epi32(row, _mm256_mullo_epi32(x[i], _mm256_set1_epi32(N as i32)))
        };
        let (a, b) = (offset(0), offset(1));
        let mut offsets = [0; LANES];
        let to = offsets.as_mut_ptr();
        // SAFETY: sixteen numbers of 32 bits.
        unsafe {
            _mm256_storeu_si256(to.cast(), _mm256_permute2x128_si256::<0x20>(a, b));
            _mm256_storeu_si256(to.add(8).cast(), _mm256_permute2x128_si256::<0x31>(a, b));
        }
        offsets
    }

    /// Grey pixels, each with the one on its right, and those below.
    ///
    /// # Safety
    /// The pixels are inside, up to `last`.
    #[target_feature(enable = "avx2")]
    unsafe fn pairs(&self, o: &[i32; LANES]) -> [__m256i; 2] {
        let pairs = |row: *const u8| {
            // SAFETY: both are in the image's rows, by this function's contract.
            let p = |i: usize| unsafe { row.wrapping_offset(o[i] as isize).cast::<i16>().read_unaligned() };
            let low = _mm_setr_epi16(p(0), p(1), p(2), p(3), p(4), p(5), p(6), p(7));
            let high = _mm_setr_epi16(p(8), p(9), p(10), p(11), p(12), p(13), p(14), p(15));
            _mm256_set_m128i(high, low)
        };
        [pairs(self.top), pairs(self.top.wrapping_offset(self.stride as isize))]
    }

    /// # Safety
    /// The pixels are inside, up to `last`; `out` has sixteen pixels; N is 3 or 4.
    #[target_feature(enable = "avx2")]
    unsafe fn colour(&self, offsets: &[i32; LANES], positions: &Positions, out: &mut [u8]) {
        let (mut weights, mut fractions) = ([0i64; 4], [0i64; 4]);
        // SAFETY: four numbers of 64 bits each.
        unsafe {
            _mm256_storeu_si256(weights.as_mut_ptr().cast(), positions.weights);
            _mm256_storeu_si256(fractions.as_mut_ptr().cast(), positions.fy);
        }
        // Of two pixels of eight bytes each sample beside the one on its right.
        let pairs = _mm256_broadcastsi128_si256(if N == 3 {
            _mm_setr_epi8(0, 3, 1, 4, 2, 5, -1, -1, 8, 11, 9, 12, 10, 13, -1, -1)
        } else {
            _mm_setr_epi8(0, 4, 1, 5, 2, 6, 3, 7, 8, 12, 9, 13, 10, 14, 11, 15)
        });
        // The fractions of four pixels, four times each.
        let repeat = _mm256_setr_epi8(
            0, 1, 0, 1, 0, 1, 0, 1, 2, 3, 2, 3, 2, 3, 2, 3, 4, 5, 4, 5, 4, 5, 4, 5, 6, 7, 6, 7, 6, 7, 6, 7,
        );
        let (top, bottom) = (self.top, self.top.wrapping_offset(self.stride as isize));
        let ahead = offsets[0] as isize + ROWS_AHEAD * self.stride as isize;
        _mm_prefetch::<_MM_HINT_T0>(top.wrapping_offset(ahead).cast());
        let four = |group: usize| {
            let row = |row: *const u8| {
                let pixel = |i: usize| {
                    let p = row.wrapping_offset(offsets[4 * group + i] as isize);
                    // SAFETY: eight bytes from a pixel on are in the image, by this function's contract.
                    unsafe { p.cast::<i64>().read_unaligned() }
                };
                _mm256_shuffle_epi8(_mm256_setr_epi64x(pixel(0), pixel(1), pixel(2), pixel(3)), pairs)
            };
            let repeated = |f: [i64; 4]| _mm256_shuffle_epi8(_mm256_set1_epi64x(f[group]), repeat);
            interpolate([row(top), row(bottom)], repeated(weights), repeated(fractions))
        };
        for half in 0..2 {
            let packed = _mm256_packus_epi16(four(2 * half), four(2 * half + 1));
            let pixels = _mm256_permute4x64_epi64::<0b11_01_10_00>(packed);
            let to = out[half * 8 * N..(half + 1) * 8 * N].as_mut_ptr();
            if N == 4 {
                // SAFETY: eight pixels of four bytes.
                unsafe { _mm256_storeu_si256(to.cast(), pixels) };
                continue;
            }
            let close = _mm_setr_epi8(0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, -1, -1, -1, -1);
            let pixels = _mm256_shuffle_epi8(pixels, _mm256_broadcastsi128_si256(close));
            let high = _mm256_extracti128_si256::<1>(pixels);
            // SAFETY: eight pixels of three bytes: twelve from the first, of sixteen that are written, then
            // eight and four.
            unsafe {
                _mm_storeu_si128(to.cast(), _mm256_castsi256_si128(pixels));
                _mm_storel_epi64(to.add(12).cast(), high);
                to.add(20).cast::<i32>().write_unaligned(_mm_extract_epi32::<2>(high));
            }
        }
    }
}

const BITS: i32 = FRACTION_BITS as i32;

// No `array::map` here: what is inside would be compiled for processors without AVX2.

#[target_feature(enable = "avx2")]
fn whole(p: [__m256i; 2]) -> [__m256i; 2] {
    [_mm256_srai_epi32::<BITS>(p[0]), _mm256_srai_epi32::<BITS>(p[1])]
}

#[target_feature(enable = "avx2")]
fn fraction(p: [__m256i; 2]) -> [__m256i; 2] {
    let mask = _mm256_set1_epi32((1 << BITS) - 1);
    [_mm256_and_si256(p[0], mask), _mm256_and_si256(p[1], mask)]
}

/// Sixteen numbers as 16 bits, in order.
#[target_feature(enable = "avx2")]
fn packed(p: [__m256i; 2]) -> __m256i {
    _mm256_packs_epi32(p[0], p[1])
}

/// Which 16-bit numbers are from 0 to `most`?
#[target_feature(enable = "avx2")]
fn at_most(p: __m256i, most: i16) -> __m256i {
    _mm256_cmpeq_epi16(_mm256_min_epu16(p, _mm256_set1_epi16(most)), p)
}

#[target_feature(enable = "avx2")]
fn all(mask: __m256i) -> bool {
    _mm256_movemask_epi8(mask) == -1
}

/// Between four samples: `rows` has pairs of bytes, `weights` their weights, `fy` is the part of the lower row.
#[target_feature(enable = "avx2")]
fn interpolate(rows: [__m256i; 2], weights: __m256i, fy: __m256i) -> __m256i {
    // The instruction takes unsigned weights and signed samples: 128 less, so 2^14 less in the sum.
    let row = |r| _mm256_maddubs_epi16(weights, _mm256_xor_si256(r, _mm256_set1_epi8(-128)));
    let (above, below) = (row(rows[0]), row(rows[1]));
    let value = _mm256_add_epi16(above, _mm256_mulhrs_epi16(_mm256_sub_epi16(below, above), fy));
    _mm256_srli_epi16::<7>(_mm256_add_epi16(value, _mm256_set1_epi16((1 << 14) + 64)))
}

/// # Safety
/// `out` has sixteen bytes.
#[target_feature(enable = "avx2")]
unsafe fn grey(rows: [__m256i; 2], positions: &Positions, out: &mut [u8]) {
    let value = interpolate(rows, positions.weights, positions.fy);
    let bytes = _mm_packus_epi16(_mm256_castsi256_si128(value), _mm256_extracti128_si256::<1>(value));
    // SAFETY: by this function's contract.
    unsafe { _mm_storeu_si128(out.as_mut_ptr().cast(), bytes) };
}
