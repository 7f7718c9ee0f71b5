//! The exposure drift: on = gain x off + offset of most of the sample.

use super::kernels;
use super::sample::{RUN, Sample, median};

pub struct Line {
    pub gain: f32,
    pub offset: f32,
    pub steady: f32,
    /// Standard deviation of a pixel's difference, robust but rough.
    pub pixel_deviation: f32,
}

impl Sample {
    /// The line on = gain off + offset of most runs' means.
    pub fn fit_line(&mut self, floor: f32) -> Line {
        let (values, keys) = (&mut self.scratch.values, &mut self.scratch.keys);
        values.clear();
        for block in &self.blocks {
            values.extend(block.good().filter(|l| block.length[*l] > 4.0).map(|l| block.variance[l]));
        }
        let mut pixel = median(values, keys).map(f32::sqrt);
        if pixel.is_none() {
            values.extend(self.y.iter().zip(&self.x).map(|(y, x)| y - x));
            let middle = median(values, keys).unwrap_or(0.0);
            values.iter_mut().for_each(|d| *d = (*d - middle).abs());
            pixel = median(values, keys).map(|m| 1.4826 * m);
        }
        let pixel_deviation = pixel.unwrap_or(floor).max(floor);
        let run_deviation = pixel_deviation / (RUN as f32).sqrt();
        let mut line = Line { gain: 1.0, offset: 0.0, steady: 1.0, pixel_deviation };
        let count = self.x.len();
        if count < 4 {
            return line;
        }

        let mut best = f32::INFINITY;
        for try_pairs in [false, true] {
            // A line that leaves little but noise is the one.
            if best < count as f32 * (1.5 * run_deviation).powi(2) {
                break;
            }
            let start = if try_pairs { self.pair_slope(run_deviation) } else { Some(1.0) };
            let Some(start) = start else { break };
            let (gain, offset, cost) = self.reweighted_line(start, run_deviation);
            if cost < best {
                (best, line.gain, line.offset) = (cost, gain, offset);
            }
        }
        self.residuals(line.gain, line.offset);
        let tolerance = 3.0 * pixel_deviation + 1.5;
        let explained = self.scratch.values.iter().filter(|r| **r <= tolerance).count();
        line.steady = explained as f32 / count as f32;
        line
    }

    /// |on - gain x off - offset| of the runs, into the scratch values.
    fn residuals(&mut self, gain: f32, offset: f32) {
        self.scratch.values.resize(self.x.len(), 0.0);
        kernels::residuals(&mut self.scratch.values, &self.x, &self.y, gain, offset);
    }

    /// Median slope of pairs half the levels apart, when the levels spread enough.
    fn pair_slope(&mut self, run_deviation: f32) -> Option<f32> {
        let (order, slopes) = (&mut self.scratch.pairs, &mut self.scratch.values);
        order.clear();
        order.extend(self.x.iter().zip(&self.y).map(|(x, y)| [*x, *y]));
        order.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
        let (low, high) = order.split_at(order.len() / 2);
        slopes.clear();
        let apart = low.iter().zip(high).filter(|(a, b)| b[0] - a[0] > (6.0 * run_deviation).max(3.0));
        slopes.extend(apart.map(|(a, b)| (b[1] - a[1]) / (b[0] - a[0])));
        if slopes.len() < 8 { None } else { median(slopes, &mut self.scratch.keys).map(|g| g.clamp(0.25, 4.0)) }
    }

    /// Line by iteratively reweighted least squares (Tukey's biweight) from a starting gain: gain, offset
    /// and the sum of truncated squares. The off levels' own noise is taken out of the regression, and a
    /// scene without contrast leaves the gain at 1.
    fn reweighted_line(&mut self, start: f32, run_deviation: f32) -> (f32, f32, f32) {
        let mut gain = start;
        let values = &mut self.scratch.values;
        values.clear();
        values.extend(self.y.iter().zip(&self.x).map(|(y, x)| y - gain * x));
        let mut offset = median(values, &mut self.scratch.keys).unwrap_or(0.0);
        for _ in 0..8 {
            self.residuals(gain, offset);
            let middle = median(&self.scratch.values, &mut self.scratch.keys).unwrap_or(0.0);
            let scale = 4.685 * (1.4826 * middle).max(run_deviation);
            let [s, sx, sy, sxx, sxy] = kernels::biweight_sums(&self.x, &self.y, gain, offset, scale);
            if s < 1.0 {
                break;
            }
            let noise = s * (run_deviation as f64).powi(2) / 2.0;
            // Contrast below the runs' noise cannot tell a gain: it is drawn to 1 by as much as one run's
            // noise.
            let prior = 2.0 * noise;
            let contrast = (sxx - sx * sx / s - noise).max(0.0);
            let new_gain = (((sxy - sx * sy / s + prior) / (contrast + prior).max(1e-9)) as f32).clamp(0.25, 4.0);
            let new_offset = ((sy - new_gain as f64 * sx) / s) as f32;
            let settled = (new_gain - gain).abs() < 1e-5 && (new_offset - offset).abs() < 1e-3;
            (gain, offset) = (new_gain, new_offset);
            if settled {
                break;
            }
        }
        self.residuals(gain, offset);
        let limit = (4.0 * run_deviation).powi(2);
        let cost = self.scratch.values.iter().map(|r| r.powi(2).min(limit)).sum();
        (gain, offset, cost)
    }
}
