//! Pixels that changed between frames by more than their noise: one pass, nothing stored but them.

mod kernels;

use std::ops::Range;

use super::area::SearchArea;
use super::components::{Run, USUAL_RUNS};
use super::frames::{Channel, FrameMean, RowBuffer};
use super::photometry::{Limits, Photometry};
use kernels::{compare, first_beyond, least_bound};

/// Pixels that are looked at together.
const CHUNK: usize = 64;
/// Fixed point of the coarse test: 255 x 64 and 255 x 127 fit in 16 bits.
const UNIT: f32 = 64.0;

/// [`Run::class`] of pixels that became brighter, or darker.
pub const BRIGHTER: u8 = 1;
pub const DARKER: u8 = 2;

/// A channel and how its off frames predict its on frames.
#[derive(Debug)]
pub struct Carrier {
    pub channel: Channel,
    pub photometry: Photometry,
}

/// on - predicted over a run's pixels, by carrier.
#[derive(Debug, Clone, Copy, Default)]
pub struct RunSignal {
    pub sum: [f32; 3],
    /// The value of greatest magnitude with the sign of the run's class.
    pub peak: [f32; 3],
}

/// Runs of changed pixels, ascending by row and column, and their signals; and memory that serves one
/// search after the other.
#[derive(Debug, Default)]
pub struct Changes {
    pub runs: Vec<Run>,
    pub signals: Vec<RunSignal>,
    limits: Vec<Limits>,
    spans: Vec<Range<usize>>,
    buffers: [RowBuffer; 2],
}

/// The frames and how the off frames predict the on frames, by carrier.
#[derive(Clone, Copy)]
pub struct Pair<'a> {
    pub on: &'a FrameMean<'a>,
    pub off: &'a FrameMean<'a>,
    /// At most three.
    pub carriers: &'a [Carrier],
}

impl Changes {
    /// Finds the pixels of `area` where any of the carriers leaves its prediction by more than `k` standard
    /// deviations; false when they make more than `max_runs` runs.
    pub fn find(&mut self, pair: Pair<'_>, area: &SearchArea, k: f32, max_runs: usize) -> bool {
        let Pair { on, off, carriers } = pair;
        self.runs.clear();
        self.signals.clear();
        self.runs.reserve(USUAL_RUNS);
        self.signals.reserve(USUAL_RUNS);
        self.limits.clear();
        self.limits.extend(carriers.iter().map(|c| c.photometry.limits(k)));
        // Means are rounded to bytes for the coarse test, to a half and what the fixed point leaves.
        let rounding = |frames: &FrameMean<'_>| if frames.count() > 1 { 0.505 } else { 0.0 };
        let gate = Gate::new(&self.limits, rounding(on), rounding(off));
        let step = carriers[0].channel.step;
        let (mut spans, mut buffers) = (std::mem::take(&mut self.spans), std::mem::take(&mut self.buffers));
        let [on_buffer, off_buffer] = &mut buffers;
        for y in area.rows() {
            area.spans(y, &mut spans);
            for span in &spans {
                let bytes = span.start * step..span.end * step;
                let on_row = on.bytes(y, bytes.clone(), on_buffer);
                let off_row = off.bytes(y, bytes, off_buffer);
                let mut start = 0;
                while start < on_row.len()
                    && let Some(chunk) = first_beyond(&gate, &on_row[start..], &off_row[start..], step)
                {
                    start += chunk * CHUNK * step;
                    let x = span.start + start / step;
                    self.look_closely(pair, x, y, CHUNK.min(span.end - x));
                    start += CHUNK * step;
                }
            }
            if self.runs.len() > max_runs {
                break;
            }
        }
        (self.spans, self.buffers) = (spans, buffers);
        self.runs.len() <= max_runs
    }

    /// Adds what changed of `length` pixels.
    fn look_closely(&mut self, pair: Pair<'_>, x: usize, y: usize, length: usize) {
        let mut class = [0u8; CHUNK];
        let mut difference = [[0f32; CHUNK]; 3];
        let (mut a, mut b) = ([0f32; CHUNK], [0f32; CHUNK]);
        for ((carrier, limits), difference) in pair.carriers.iter().zip(&self.limits).zip(&mut difference) {
            pair.on.read(carrier.channel, x, y, &mut a[..length]);
            pair.off.read(carrier.channel, x, y, &mut b[..length]);
            compare(&mut class, difference, &a, &b, &carrier.photometry, limits);
        }
        for i in (0..length).filter(|i| class[*i] != 0) {
            // Brighter in one channel, darker in another: light was added.
            let class = if class[i] & BRIGHTER != 0 { BRIGHTER } else { DARKER };
            let column = (x + i) as u32;
            match self.runs.last_mut() {
                Some(run) if run.row == y as u32 && run.end == column && run.class == class => run.end += 1,
                _ => {
                    self.runs.push(Run { row: y as u32, start: column, end: column + 1, class });
                    self.signals.push(RunSignal::default());
                }
            }
            if let Some(signal) = self.signals.last_mut() {
                for (c, difference) in difference.iter().enumerate() {
                    let d = difference[i];
                    signal.sum[c] += d;
                    signal.peak[c] = if class == BRIGHTER { signal.peak[c].max(d) } else { signal.peak[c].min(d) };
                }
            }
        }
    }
}

/// A coarse test of bytes in 16-bit integers, whichever channel they belong to: it passes over nothing
/// that the exact limits would find.
struct Gate {
    /// Bright: on x 64 - slope x off > bound; dark: < bound.
    slope: [i16; 2],
    bound: [i16; 2],
}

impl Gate {
    fn new(limits: &[Limits], on_rounding: f32, off_rounding: f32) -> Self {
        let mut gate = Self { slope: [0; 2], bound: [0; 2] };
        for (side, sign) in [(1, 1.0f32), (0, -1.0)] {
            // The slope of the limits' chord; what matters is that the bound then holds at every level.
            let chord = |l: &Limits| (l[side][208] - l[side][16]) / 192.0;
            let mean = limits.iter().map(chord).sum::<f32>() / limits.len() as f32;
            let slope = (mean * UNIT).round().clamp(0.0, 127.0);
            let margin = UNIT * on_rounding + slope * off_rounding;
            let bound = limits.iter().map(|l| least_bound(&l[side], slope, sign)).fold(f32::INFINITY, f32::min);
            gate.slope[side] = slope as i16;
            // The sums stay within 16 bits; a bound beyond them is never passed, as it should be.
            gate.bound[side] = (sign * (bound - margin - 1.0)).clamp(-32_768.0, 32_767.0) as i16;
        }
        gate
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vectors::tests::of_each_processor;
    use rand_chacha::ChaCha8Rng;
    use rand_core::{Rng, SeedableRng};

    /// Limits as photometry makes them, of any drift and noise.
    fn limits(gain: f32, offset: f32, k: f32, read: f32, shot: f32) -> Limits {
        let limit = |level: usize, side: f32| {
            let predicted = (gain * level as f32 + offset).clamp(0.0, 255.0);
            predicted + side * k * (read + shot * level as f32).sqrt()
        };
        let high = |level| if level > 251 { f32::INFINITY } else { limit(level, 1.0) };
        [std::array::from_fn(|level| limit(level, -1.0)), std::array::from_fn(high)]
    }

    #[test]
    fn the_coarse_test_passes_over_nothing() {
        for gain in [0.25, 0.8, 1.0, 1.2, 4.0] {
            for (offset, read, shot) in [(0.0, 0.16, 0.0), (-30.0, 4.0, 0.3), (25.0, 60.0, 2.0)] {
                let l = limits(gain, offset, 4.7, read, shot);
                let gate = Gate::new(std::slice::from_ref(&l), 0.0, 0.0);
                let mut tripped = 0;
                for (on, off) in (0..256).flat_map(|a| (0..256).map(move |b| (a, b))) {
                    let changed = on as f32 > l[1][off] || (on as f32) < l[0][off];
                    let trips = gate.trips(&[on as u8], &[off as u8]);
                    assert!(trips || !changed, "gain {gain} offset {offset}: {on} {off}");
                    tripped += (trips && !changed) as u32;
                }
                // And where drift is moderate it spares most of the rest.
                assert!(gain > 2.0 || tripped < 16_000, "gain {gain} offset {offset}: {tripped} in vain");
            }
        }
    }

    /// Any length, from any address: the first chunk with a pixel that the formula finds.
    #[test]
    fn every_processor_stops_at_the_same_chunk() {
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let l = limits(0.93, 4.0, 5.0, 4.0, 0.1);
        let gate = Gate::new(std::slice::from_ref(&l), 0.0, 0.0);
        let mut found = 0;
        for trial in 0..2000 {
            let step = 1 + trial % 4;
            let [start, other, length] = [67, 67, 900].map(|n| (rng.next_u32() % n) as usize);
            let mut on: Vec<u8> = (0..start + length * step).map(|_| 60 + (rng.next_u32() % 8) as u8).collect();
            let off: Vec<u8> = (0..other + length * step).map(|_| 60 + (rng.next_u32() % 8) as u8).collect();
            if length > 0 && trial % 3 > 0 {
                let at = start + rng.next_u32() as usize % (length * step);
                on[at] = if trial % 2 == 0 { 120 } else { 5 };
            }
            let (on, off) = (&on[start..], &off[other..]);
            let trips = |a: &u8, b: &u8| {
                let [dark, bright] = gate.slope.map(|s| *a as i32 * UNIT as i32 - s as i32 * *b as i32);
                bright > gate.bound[1] as i32 || dark < gate.bound[0] as i32
            };
            let wanted = on.iter().zip(off).position(|(a, b)| trips(a, b)).map(|i| i / (CHUNK * step));
            for chunk in of_each_processor(|| first_beyond(&gate, on, off, step)) {
                assert_eq!(chunk, wanted, "{start} {other} {length} {step}");
            }
            found += wanted.is_some() as u32;
        }
        assert!(found > 1000 && found < 1500, "{found}");
    }
}
