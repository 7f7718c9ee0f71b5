//! Pixels that changed between frames by more than their noise: one pass, nothing stored but them.

use super::area::SearchArea;
use super::components::Run;
use super::frames::{Channel, FrameMean, RowBuffer};
use super::photometry::Photometry;

/// Pixels that are looked at together.
const CHUNK: usize = 64;
/// Fixed point of the coarse test: 255 x 64 and 255 x 127 fit in 16 bits.
const UNIT: f32 = 64.0;

/// [`Run::class`] of pixels that became brighter, or darker.
pub const BRIGHTER: u8 = 1;
pub const DARKER: u8 = 2;

/// A channel and how its off frames predict its on frames.
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

/// Runs of changed pixels, ascending by row and column, and their signals.
#[derive(Debug, Default)]
pub struct Changes {
    pub runs: Vec<Run>,
    pub signals: Vec<RunSignal>,
}

/// The pixels of `area` where any of the (at most three) carriers leaves its prediction by more than
/// `k` standard deviations; `None` when they make more than `max_runs` runs.
pub fn changes(
    on: &FrameMean<'_>,
    off: &FrameMean<'_>,
    carriers: &[Carrier],
    area: &SearchArea,
    k: f32,
    max_runs: usize,
) -> Option<Changes> {
    let limits: Vec<_> = carriers.iter().map(|c| c.photometry.limits(k)).collect();
    // Means are rounded to bytes for the coarse test.
    let rounding = |frames: &FrameMean<'_>| if frames.count() > 1 { 0.5 } else { 0.0 };
    let gate = Gate::new(&limits, rounding(on), rounding(off));
    let step = carriers[0].channel.step;
    let mut buffers = [RowBuffer::default(), RowBuffer::default()];
    let [on_buffer, off_buffer] = &mut buffers;
    let mut spans = Vec::new();
    let mut found = Changes::default();
    for y in area.rows() {
        area.spans(y, &mut spans);
        for span in &spans {
            let bytes = span.start * step..span.end * step;
            let on_row = on.bytes(y, bytes.clone(), on_buffer);
            let off_row = off.bytes(y, bytes, off_buffer);
            for (i, (a, b)) in on_row.chunks(CHUNK * step).zip(off_row.chunks(CHUNK * step)).enumerate() {
                if gate.trips(a, b) {
                    let x = span.start + i * CHUNK;
                    exact(on, off, carriers, &limits, x, y, a.len() / step, &mut found);
                    if found.runs.len() > max_runs {
                        return None;
                    }
                }
            }
        }
    }
    Some(found)
}

/// A coarse test of bytes in 16-bit integers, whichever channel they belong to: it passes over nothing
/// that the exact limits would find.
struct Gate {
    /// Bright: on x 64 - slope x off > bound; dark: < bound.
    slope: [i16; 2],
    bound: [i16; 2],
}

impl Gate {
    fn new(limits: &[Box<[[f32; 256]; 2]>], on_rounding: f32, off_rounding: f32) -> Self {
        let mut gate = Self { slope: [0; 2], bound: [0; 2] };
        for (side, sign) in [(1, 1.0f32), (0, -1.0)] {
            // The slope of the limits' chord; what matters is that the bound then holds at every level.
            let chord = |l: &[[f32; 256]; 2]| (l[side][208] - l[side][16]) / 192.0;
            let mean = limits.iter().map(|l| chord(l)).sum::<f32>() / limits.len() as f32;
            let slope = (mean * UNIT).round().clamp(0.0, 127.0);
            let margin = UNIT * on_rounding + slope * off_rounding;
            let bound = limits
                .iter()
                .flat_map(|l| l[side].iter().enumerate())
                .map(|(level, limit)| sign * (UNIT * limit - slope * level as f32))
                .fold(f32::INFINITY, f32::min);
            gate.slope[side] = slope as i16;
            // The sums stay within 16 bits; a bound beyond them is never passed, as it should be.
            gate.bound[side] = (sign * (bound - margin - 1.0)).clamp(-32_768.0, 32_767.0) as i16;
        }
        gate
    }

    fn trips(&self, on: &[u8], off: &[u8]) -> bool {
        let mut hit = 0i16;
        for (a, b) in on.iter().zip(off) {
            let (a, b) = (*a as i16 * UNIT as i16, *b as i16);
            let bright = a - self.slope[1] * b > self.bound[1];
            let dark = a - self.slope[0] * b < self.bound[0];
            hit |= (bright | dark) as i16;
        }
        hit != 0
    }
}

#[allow(clippy::too_many_arguments)]
fn exact(
    on: &FrameMean<'_>,
    off: &FrameMean<'_>,
    carriers: &[Carrier],
    limits: &[Box<[[f32; 256]; 2]>],
    x: usize,
    y: usize,
    length: usize,
    found: &mut Changes,
) {
    let mut class = [0u8; CHUNK];
    let mut difference = [[0f32; CHUNK]; 3];
    let (mut a, mut b) = ([0f32; CHUNK], [0f32; CHUNK]);
    for ((carrier, limits), difference) in carriers.iter().zip(limits).zip(&mut difference) {
        on.read(carrier.channel, x, y, &mut a[..length]);
        off.read(carrier.channel, x, y, &mut b[..length]);
        for i in 0..length {
            let level = (b[i] + 0.5) as usize & 255;
            difference[i] = a[i] - carrier.photometry.predict(b[i]);
            class[i] |= if a[i] > limits[1][level] {
                BRIGHTER
            } else if a[i] < limits[0][level] {
                DARKER
            } else {
                0
            };
        }
    }
    for i in (0..length).filter(|i| class[*i] != 0) {
        // Brighter in one channel, darker in another: light was added.
        let class = if class[i] & BRIGHTER != 0 { BRIGHTER } else { DARKER };
        let column = (x + i) as u32;
        match found.runs.last_mut() {
            Some(run) if run.row == y as u32 && run.end == column && run.class == class => run.end += 1,
            _ => {
                found.runs.push(Run { row: y as u32, start: column, end: column + 1, class });
                found.signals.push(RunSignal::default());
            }
        }
        if let Some(signal) = found.signals.last_mut() {
            for (c, difference) in difference.iter().enumerate() {
                let d = difference[i];
                signal.sum[c] += d;
                signal.peak[c] = if class == BRIGHTER { signal.peak[c].max(d) } else { signal.peak[c].min(d) };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Limits as photometry makes them, of any drift and noise.
    fn limits(gain: f32, offset: f32, k: f32, read: f32, shot: f32) -> Box<[[f32; 256]; 2]> {
        let mut limits = Box::new([[0.0; 256]; 2]);
        for level in 0..256 {
            let predicted = (gain * level as f32 + offset).clamp(0.0, 255.0);
            let band = k * (read + shot * level as f32).sqrt();
            limits[0][level] = predicted - band;
            limits[1][level] = if level > 251 { f32::INFINITY } else { predicted + band };
        }
        limits
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
}
