//! A sample of the frames' pixels: short runs of neighbours spread over the area.

use std::ops::Range;

use super::noise::Tally;
use super::{CLIPPED, kernels};
use crate::image::area::SearchArea;
use crate::image::frames::{Channel, FrameMean};

/// Neighbouring pixels taken together: their mean is quiet enough to regress on.
pub const RUN: usize = 16;
/// Most pixels of the sample: its noise is then known to 1 %.
const MAX_SAMPLE: usize = 4096;
/// Below this all pixels are taken.
const MIN_SAMPLE: usize = 1024;
/// Runs that are worked on together.
pub const LANES: usize = 64;
/// A pixel that is none, of a run shorter than the others: as good as clipped.
pub const NO_PIXEL: f32 = 255.0;

/// A number for each run of a block.
pub type Lanes = [f32; LANES];
/// First pixels of a block's runs, second pixels, ...
pub type Pixels = [Lanes; RUN];

/// Memory that serves one estimate after the other.
#[derive(Debug, Default)]
pub struct Sample {
    pub blocks: Vec<Block>,
    /// Number of pixels.
    pub size: usize,
    /// Mean off and on levels of the runs without a clipped pixel.
    pub x: Vec<f32>,
    pub y: Vec<f32>,
    pub scratch: Scratch,
    spans: Vec<Range<usize>>,
}

/// Runs of neighbouring pixels.
#[derive(Debug)]
pub struct Block {
    pub on: Pixels,
    pub off: Pixels,
    /// Numbers of pixels, 0 where there is no run.
    pub length: Lanes,
    /// Means of the on and off levels, and the greatest level of either.
    pub mean: [Lanes; 2],
    pub top: Lanes,
    /// Variances of on - off within the runs.
    pub variance: Lanes,
}

impl Block {
    const EMPTY: Self = Self {
        on: [[NO_PIXEL; LANES]; RUN],
        off: [[NO_PIXEL; LANES]; RUN],
        length: [0.0; LANES],
        mean: [[0.0; LANES]; 2],
        top: [0.0; LANES],
        variance: [0.0; LANES],
    };

    /// The runs without a clipped pixel.
    pub fn good(&self) -> impl Iterator<Item = usize> {
        (0..LANES).filter(|l| self.length[*l] > 0.0 && self.top[*l] < CLIPPED)
    }
}

#[derive(Debug, Default)]
pub struct Scratch {
    pub values: Vec<f32>,
    pub keys: Vec<i32>,
    pub pairs: Vec<[f32; 2]>,
    pub tally: Tally,
}

impl Scratch {
    fn reserve(&mut self, runs: usize) {
        self.values.clear();
        self.values.reserve(runs);
        self.keys.clear();
        self.keys.reserve(runs);
        self.pairs.clear();
        self.pairs.reserve(runs);
    }
}

impl Sample {
    pub fn take(&mut self, on: &FrameMean<'_>, off: &FrameMean<'_>, channel: Channel, area: &SearchArea) {
        let pixels = area.pixels();
        let wanted = (pixels / 4).clamp(MIN_SAMPLE, MAX_SAMPLE);
        // Every row_step-th row, and there every run_step-th run, a run farther on each time: all columns
        // have their turn.
        let skip = pixels.div_ceil(wanted);
        let row_step = skip.isqrt().max(1);
        let run_step = skip.div_ceil(row_step);
        self.blocks.clear();
        self.blocks.reserve(pixels.min(MAX_SAMPLE).div_ceil(RUN * LANES));
        self.size = 0;
        let (mut spans, mut lane) = (std::mem::take(&mut self.spans), LANES);
        for (row, y) in area.rows().skip(row_step / 2).step_by(row_step).enumerate() {
            area.spans(y, &mut spans);
            let runs = spans.iter().flat_map(|s| s.clone().step_by(RUN).map(|x| (x, RUN.min(s.end - x))));
            for (x, length) in runs.skip(row % run_step).step_by(run_step) {
                if lane == LANES {
                    self.blocks.push(Block::EMPTY);
                    lane = 0;
                }
                let Some(block) = self.blocks.last_mut() else { break };
                for (frames, pixels) in [(on, &mut block.on), (off, &mut block.off)] {
                    let mut levels = [0.0; RUN];
                    frames.read(channel, x, y, &mut levels[..length]);
                    pixels.iter_mut().zip(&levels[..length]).for_each(|(p, level)| p[lane] = *level);
                }
                block.length[lane] = length as f32;
                self.size += length;
                lane += 1;
            }
        }
        self.spans = spans;
        kernels::summarise(&mut self.blocks);
        self.x.clear();
        self.y.clear();
        // Room for all runs, however many count.
        let most = self.blocks.len() * LANES;
        self.x.reserve(most);
        self.y.reserve(most);
        self.scratch.reserve(most);
        for (block, lane) in self.blocks.iter().flat_map(|b| b.good().map(move |l| (b, l))) {
            self.y.push(block.mean[0][lane]);
            self.x.push(block.mean[1][lane]);
        }
    }
}

/// The middle one, of an even number the upper; `None` of none.
pub fn median(values: &[f32], keys: &mut Vec<i32>) -> Option<f32> {
    // The order of the bits of a number is its own, that of negative ones the reverse.
    let key = |v: f32| {
        let bits = v.to_bits() as i32;
        bits ^ ((bits >> 31) & i32::MAX)
    };
    keys.clear();
    keys.extend(values.iter().map(|v| key(*v)));
    let middle = kernels::order_statistic(keys, keys.len() / 2)?;
    Some(f32::from_bits((middle ^ ((middle >> 31) & i32::MAX)) as u32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_core::{Rng, SeedableRng};

    #[test]
    fn the_median_is_that_of_sorting() {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        assert_eq!(median(&[], &mut Vec::new()), None);
        for n in 1..200 {
            // Of few different values, of many, and with both signs.
            let mut values: Vec<f32> = (0..n)
                .map(|i| match n % 3 {
                    0 => (rng.next_u32() % 5) as f32 - 2.0,
                    1 => (rng.next_u32() as i32) as f32 * 1e-9,
                    _ => (i as f32).sin() * 1e-3,
                })
                .collect();
            let found = median(&values, &mut Vec::new());
            values.sort_by(f32::total_cmp);
            assert_eq!(found.map(f32::to_bits), Some(values[n / 2].to_bits()), "{n}");
        }
    }
}
