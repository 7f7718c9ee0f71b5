//! The loops over the pixels: see [`crate::vectors`].
#![allow(unsafe_code)]

use super::{BRIGHTER, CHUNK, DARKER, Gate, UNIT};
use crate::image::photometry::{Limits, Photometry};
use crate::vectors::for_each_processor;

/// Sums that are kept apart.
const LANES: usize = 32;

for_each_processor! {
    /// The first chunk of `step` x 64 bytes in which the gate finds something.
    pub fn first_beyond(gate: &Gate, on: &[u8], off: &[u8], step: usize) -> Option<usize> {
        match step {
            1 => first::<{ CHUNK }>(gate, on, off),
            2 => first::<{ 2 * CHUNK }>(gate, on, off),
            3 => first::<{ 3 * CHUNK }>(gate, on, off),
            _ => first::<{ 4 * CHUNK }>(gate, on, off),
        }
    }

    /// on - predicted, and marks of the pixels that leave the limits.
    pub fn compare(
        class: &mut [u8; CHUNK],
        difference: &mut [f32; CHUNK],
        on: &[f32; CHUNK],
        off: &[f32; CHUNK],
        photometry: &Photometry,
        limits: &Limits,
    ) {
        for i in 0..CHUNK {
            // SAFETY: levels are means of bytes.
            let level = unsafe { (off[i] + 0.5).to_int_unchecked::<i32>() } as usize & 255;
            difference[i] = on[i] - photometry.predict(off[i]);
            let (bright, dark) = (on[i] > limits[1][level], on[i] < limits[0][level]);
            class[i] |= if bright { BRIGHTER } else { dark as u8 * DARKER };
        }
    }

    /// The least of sign x (UNIT x limit - slope x level).
    pub fn least_bound(limit: &[f32; 256], slope: f32, sign: f32) -> f32 {
        let mut least = [f32::INFINITY; LANES];
        for start in (0..256).step_by(LANES) {
            for l in 0..LANES {
                let value = sign * (UNIT * limit[start + l] - slope * (start + l) as f32);
                least[l] = if value < least[l] { value } else { least[l] };
            }
        }
        least.into_iter().fold(f32::INFINITY, f32::min)
    }
}

#[inline(always)]
fn first<const BYTES: usize>(gate: &Gate, on: &[u8], off: &[u8]) -> Option<usize> {
    let ((on, on_rest), (off, off_rest)) = (on.as_chunks::<BYTES>(), off.as_chunks::<BYTES>());
    for (i, (a, b)) in on.iter().zip(off).enumerate() {
        if gate.trips(a, b) {
            return Some(i);
        }
    }
    gate.trips(on_rest, off_rest).then_some(on.len())
}

impl Gate {
    #[inline(always)]
    pub(super) fn trips(&self, on: &[u8], off: &[u8]) -> bool {
        let [mut high, mut low] = [[i16::MIN; LANES], [i16::MAX; LANES]];
        let mut meet = |lane: usize, a: u8, b: u8| {
            // Within 16 bits (see UNIT); checks of it, where a build has them, would keep it from vectors.
            let (a, b) = ((a as i16).wrapping_mul(UNIT as i16), b as i16);
            high[lane] = high[lane].max(a.wrapping_sub(self.slope[1].wrapping_mul(b)));
            low[lane] = low[lane].min(a.wrapping_sub(self.slope[0].wrapping_mul(b)));
        };
        let ((on, on_rest), (off, off_rest)) = (on.as_chunks::<LANES>(), off.as_chunks::<LANES>());
        for (a, b) in on.iter().zip(off) {
            for lane in 0..LANES {
                meet(lane, a[lane], b[lane]);
            }
        }
        for (lane, (a, b)) in on_rest.iter().zip(off_rest).enumerate() {
            meet(lane, *a, *b);
        }
        let bright = high.iter().fold(false, |any, v| any | (*v > self.bound[1]));
        let dark = low.iter().fold(false, |any, v| any | (*v < self.bound[0]));
        bright | dark
    }
}
