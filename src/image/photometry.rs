//! How frames of one still scene relate: the exposure drift between them and their noise, estimated
//! from a sample of their own pixels, most of which must show the same in both.

use super::area::SearchArea;
use super::frames::{Channel, FrameMean};

/// Rounding to whole grey levels.
const QUANTISATION: f32 = 1.0 / 12.0;
/// Above this a pixel may be clipped and tells neither level nor noise.
const CLIPPED: f32 = 252.0;
/// Neighbouring pixels taken together: their mean is quiet enough to regress on.
const RUN: usize = 16;
/// Neighbours whose noise may be alike.
const LAGS: usize = 3;
/// Most pixels of the sample: its noise is then known to 2 %.
const MAX_SAMPLE: usize = 8192;
/// Below this all pixels are taken.
const MIN_SAMPLE: usize = 1024;

/// on = gain x off + offset, and the noise about it.
#[derive(Debug, Clone)]
pub struct Photometry {
    pub gain: f32,
    pub offset: f32,
    /// Share of the sample that gain and offset explain: the rest changed.
    pub steady: f32,
    /// A frame's noise variance at level l is `read` + `shot` l (photon transfer: read noise and
    /// quantisation, then photon noise).
    pub read: f32,
    pub shot: f32,
    /// Variance of the mean of a few pixels over what independent noise would give; above 1 for
    /// compressed video.
    pub correlation: f32,
    /// Standard deviation of on - predicted by off level.
    deviation: Box<[f32; 256]>,
    /// 1 / number of on and off frames.
    weight: [f32; 2],
}

impl Photometry {
    pub fn estimate(on: &FrameMean<'_>, off: &FrameMean<'_>, channel: Channel, area: &SearchArea) -> Self {
        let weight = [1.0 / on.count() as f32, 1.0 / off.count() as f32];
        let sample = Sample::take(on, off, channel, area);
        let floor = QUANTISATION * (weight[0] + weight[1]);
        let line = sample.fit_line(floor.sqrt());
        let noise = sample.noise(&line, floor);

        // From the difference's variance back to a single frame's.
        let [w_on, w_off] = weight;
        let shot = noise.slope / (line.gain * w_on + line.gain * line.gain * w_off);
        let read = (noise.base - shot * line.offset * w_on) / (w_on + line.gain * line.gain * w_off);
        let mut photometry = Self {
            gain: line.gain,
            offset: line.offset,
            steady: line.steady,
            read: read.max(QUANTISATION),
            shot,
            correlation: noise.correlation,
            deviation: Box::new([0.0; 256]),
            weight,
        };
        for level in 0..256 {
            let off = level as f32;
            let model = photometry.variance(photometry.predict(off), off);
            // Where drift is not linear the model fails, and the measured scatter counts; but not when all
            // that has this level has moved.
            let measured = noise.measured[level / BIN_WIDTH].sqrt();
            let most = 3.0 * model.sqrt() + 3.0;
            photometry.deviation[level] = model.sqrt().max(measured.min(most));
        }
        photometry
    }

    /// The on level that belongs to an off level when nothing changed.
    pub fn predict(&self, off: f32) -> f32 {
        (self.gain * off + self.offset).clamp(0.0, 255.0)
    }

    /// Variance of on - predict(off) at these levels.
    pub fn variance(&self, on: f32, off: f32) -> f32 {
        let single = |level: f32| self.read + self.shot * level;
        self.weight[0] * single(on) + self.gain * self.gain * self.weight[1] * single(off)
    }

    /// What a grey level of signal adds to that variance.
    pub fn signal_variance(&self) -> f32 {
        self.weight[0] * self.shot
    }

    /// Standard deviation of on - predict(off), never below the measured scatter.
    pub fn deviation(&self, off: f32) -> f32 {
        self.deviation[off as usize & 255]
    }

    /// The on levels (least, greatest) within `k` standard deviations for each off level.
    pub fn limits(&self, k: f32) -> Box<[[f32; 256]; 2]> {
        let mut limits = Box::new([[0.0; 256]; 2]);
        for level in 0..256 {
            let predicted = self.predict(level as f32);
            let band = k * self.deviation[level];
            limits[0][level] = predicted.min(CLIPPED) - band;
            // A clipped off pixel only says that the scene is brighter than that.
            limits[1][level] = if level as f32 >= CLIPPED { f32::INFINITY } else { predicted + band };
        }
        limits
    }
}

const BIN_WIDTH: usize = 32;
const BINS: usize = 256 / BIN_WIDTH;
/// Cells of a bin's histogram of |on - predicted|, an eighth of the standard deviation each.
const CELLS: usize = 96;

/// Runs of neighbouring pixels spread over the area.
struct Sample {
    on: Vec<f32>,
    off: Vec<f32>,
    runs: Vec<SampleRun>,
}

struct SampleRun {
    length: usize,
    on: f32,
    off: f32,
    clipped: bool,
    /// Variance of on - off within the run.
    variance: f32,
}

struct Line {
    gain: f32,
    offset: f32,
    steady: f32,
    /// Standard deviation of a pixel's difference, robust but rough.
    pixel_deviation: f32,
}

struct Noise {
    /// Variance of the difference: base + slope x off level.
    base: f32,
    slope: f32,
    measured: [f32; BINS],
    correlation: f32,
}

impl Sample {
    fn take(on: &FrameMean<'_>, off: &FrameMean<'_>, channel: Channel, area: &SearchArea) -> Self {
        let pixels = area.pixels();
        let wanted = (pixels / 4).clamp(MIN_SAMPLE, MAX_SAMPLE);
        // Every row_step-th row, and there every run_step-th run, a run farther on each time: all columns
        // have their turn.
        let skip = pixels.div_ceil(wanted);
        let row_step = skip.isqrt().max(1);
        let run_step = skip.div_ceil(row_step);
        let mut sample = Self { on: Vec::new(), off: Vec::new(), runs: Vec::new() };
        let mut spans = Vec::new();
        for (row, y) in area.rows().skip(row_step / 2).step_by(row_step).enumerate() {
            area.spans(y, &mut spans);
            let runs = spans.iter().flat_map(|s| s.clone().step_by(RUN).map(|x| (x, RUN.min(s.end - x))));
            for (x, length) in runs.skip(row % run_step).step_by(run_step) {
                sample.push(on, off, channel, x, y, length);
            }
        }
        sample
    }

    fn push(&mut self, on: &FrameMean<'_>, off: &FrameMean<'_>, channel: Channel, x: usize, y: usize, length: usize) {
        let start = self.on.len();
        self.on.resize(start + length, 0.0);
        self.off.resize(start + length, 0.0);
        let (a, b) = (&mut self.on[start..], &mut self.off[start..]);
        on.read(channel, x, y, a);
        off.read(channel, x, y, b);
        let n = length as f32;
        let (mut sum_on, mut sum_off, mut square, mut top) = (0.0, 0.0, 0.0, 0.0f32);
        for (a, b) in a.iter().zip(&*b) {
            sum_on += a;
            sum_off += b;
            square += (a - b) * (a - b);
            top = top.max(a.max(*b));
        }
        let mean = (sum_on - sum_off) / n;
        let variance = (square - n * mean * mean).max(0.0) / (n - 1.0).max(1.0);
        let (on, off) = (sum_on / n, sum_off / n);
        self.runs.push(SampleRun { length, on, off, clipped: top >= CLIPPED, variance });
    }

    /// The line on = gain off + offset of most runs' means.
    fn fit_line(&self, floor: f32) -> Line {
        let runs: Vec<&SampleRun> = self.runs.iter().filter(|r| !r.clipped).collect();
        let mut buffer: Vec<f32> = runs.iter().filter(|r| r.length > 4).map(|r| r.variance).collect();
        let mut pixel = median(&mut buffer).map(f32::sqrt);
        if pixel.is_none() {
            buffer.extend(runs.iter().map(|r| r.on - r.off));
            let middle = median(&mut buffer).unwrap_or(0.0);
            buffer.iter_mut().for_each(|d| *d = (*d - middle).abs());
            pixel = median(&mut buffer).map(|m| 1.4826 * m);
        }
        let pixel_deviation = pixel.unwrap_or(floor).max(floor);
        let run_deviation = pixel_deviation / (RUN as f32).sqrt();
        let mut line = Line { gain: 1.0, offset: 0.0, steady: 1.0, pixel_deviation };
        if runs.len() < 4 {
            return line;
        }

        let mut best = f32::INFINITY;
        for try_pairs in [false, true] {
            // A line that leaves little but noise is the one.
            if best < runs.len() as f32 * (1.5 * run_deviation).powi(2) {
                break;
            }
            let start = if try_pairs { pair_slope(&runs, run_deviation) } else { Some(1.0) };
            let Some(start) = start else { break };
            let (gain, offset, cost) = reweighted_line(&runs, start, run_deviation);
            if cost < best {
                (best, line.gain, line.offset) = (cost, gain, offset);
            }
        }
        let tolerance = 3.0 * pixel_deviation + 1.5;
        let explained = |r: &&&SampleRun| (r.on - line.gain * r.off - line.offset).abs() <= tolerance;
        line.steady = runs.iter().filter(explained).count() as f32 / runs.len() as f32;
        line
    }

    /// Variances by level from second moments clipped at 3 standard deviations.
    fn noise(&self, line: &Line, floor: f32) -> Noise {
        let scale = 8.0 / line.pixel_deviation;
        let mut cells = vec![(0u32, 0f32); BINS * CELLS];
        for (on, off) in self.on.iter().zip(&self.off) {
            // Two black pixels are no evidence of silence.
            if on.max(*off) >= CLIPPED || on.max(*off) < 0.5 {
                continue;
            }
            let r = on - line.gain * off - line.offset;
            let cell = ((r.abs() * scale) as usize).min(CELLS - 1);
            let (count, square) = &mut cells[(*off as usize / BIN_WIDTH) * CELLS + cell];
            *count += 1;
            *square += r * r;
        }
        let bins: Vec<(f32, f32)> =
            cells.chunks_exact(CELLS).map(|bin| clipped_variance(bin, scale, 4.0 * floor.sqrt())).collect();
        let total: f32 = bins.iter().map(|b| b.0).sum();
        // In a black scene the few others are not its noise but what changed.
        let enough = total >= 16.0 && total >= 0.1 * self.on.len() as f32;
        let pooled = if enough { bins.iter().map(|b| b.0 * b.1).sum::<f32>() / total } else { 0.0 };

        // Weighted line through the bins; a variance's own variance is 2 variance^2 / count.
        let (mut base, mut slope) = (pooled, 0.0);
        let good = || bins.iter().enumerate().filter(|(_, b)| enough && b.0 >= 64.0);
        if good().count() >= 3 {
            let [mut s, mut sx, mut sxx, mut sy, mut sxy] = [0.0f32; 5];
            for (i, (count, variance)) in good() {
                let x = ((i * BIN_WIDTH) as f32 + 0.5 * BIN_WIDTH as f32) / 256.0;
                let weight = count / (variance + floor).powi(2);
                s += weight;
                sx += weight * x;
                sxx += weight * x * x;
                sy += weight * variance;
                sxy += weight * x * variance;
            }
            let determinant = s * sxx - sx * sx;
            if determinant > 1e-6 * s * sxx {
                slope = (s * sxy - sx * sy) / determinant;
                base = (sy - slope * sx) / s;
                if slope < 0.0 {
                    (base, slope) = (sy / s, 0.0);
                } else if base < floor {
                    (base, slope) = (floor, ((sxy - floor * sx) / sxx).max(0.0));
                }
                slope /= 256.0;
            }
        }
        base = base.max(floor);
        let mut measured = [0.0; BINS];
        for (i, (count, variance)) in good() {
            let model = base + slope * (i * BIN_WIDTH + BIN_WIDTH / 2) as f32;
            if *variance > model * (1.0 + 4.0 * (2.0 / count).sqrt()) {
                measured[i] = *variance;
            }
        }
        let correlation = self.correlation(line, base, slope);
        Noise { base, slope, measured, correlation }
    }

    /// Sum of the autocorrelation over the neighbours along a row, squared for the two directions: columns
    /// are taken to be like rows.
    fn correlation(&self, line: &Line, base: f32, slope: f32) -> f32 {
        let mut products = [0f32; LAGS + 1];
        let mut residuals = [0f32; RUN];
        let mut start = 0;
        for run in &self.runs {
            let pixels = start..start + run.length;
            start = pixels.end;
            if run.clipped || run.length <= LAGS {
                continue;
            }
            let residuals = &mut residuals[..run.length];
            for ((r, on), off) in residuals.iter_mut().zip(&self.on[pixels.clone()]).zip(&self.off[pixels]) {
                let value = on - line.gain * off - line.offset;
                // What changed, or is not described, is not noise.
                *r = if value * value < 9.0 * (base + slope * off) { value } else { 0.0 };
            }
            for (lag, product) in products.iter_mut().enumerate() {
                let pairs: f32 = residuals.iter().zip(&residuals[lag..]).map(|(a, b)| a * b).sum();
                *product += pairs / (run.length - lag) as f32;
            }
        }
        let [square, neighbours @ ..] = products;
        let count = (self.on.len() as f32).max(1.0);
        let sum = 1.0 + 2.0 * neighbours.iter().sum::<f32>() / square.max(1e-12);
        // The estimate itself scatters by this; only a clear excess counts.
        let scatter = 2.0 * (LAGS as f32 / count).sqrt();
        (sum - 2.0 * scatter).clamp(1.0, 1.0 + 2.0 * LAGS as f32).powi(2)
    }
}

/// Median slope of pairs half the levels apart, when the levels spread enough.
fn pair_slope(runs: &[&SampleRun], run_deviation: f32) -> Option<f32> {
    let mut order: Vec<(f32, f32)> = runs.iter().map(|r| (r.off, r.on)).collect();
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let half = order.len() / 2;
    let (low, high) = order.split_at(half);
    let mut slopes: Vec<f32> = low
        .iter()
        .zip(high)
        .filter(|(a, b)| b.0 - a.0 > (6.0 * run_deviation).max(3.0))
        .map(|(a, b)| (b.1 - a.1) / (b.0 - a.0))
        .collect();
    if slopes.len() < 8 { None } else { median(&mut slopes).map(|g| g.clamp(0.25, 4.0)) }
}

/// Line by iteratively reweighted least squares (Tukey's biweight) from a starting gain: gain, offset
/// and the sum of truncated squares. The off levels' own noise is taken out of the regression, and a
/// scene without contrast leaves the gain at 1.
fn reweighted_line(runs: &[&SampleRun], start: f32, run_deviation: f32) -> (f32, f32, f32) {
    let mut gain = start;
    let mut residuals: Vec<f32> = runs.iter().map(|r| r.on - gain * r.off).collect();
    let mut offset = median(&mut residuals).unwrap_or(0.0);
    for _ in 0..8 {
        residuals.clear();
        residuals.extend(runs.iter().map(|r| (r.on - gain * r.off - offset).abs()));
        let scale = 4.685 * (1.4826 * median(&mut residuals).unwrap_or(0.0)).max(run_deviation);
        let [mut s, mut sx, mut sy, mut sxx, mut sxy] = [0.0f64; 5];
        for r in runs {
            let t = (r.on - gain * r.off - offset) / scale;
            let w = (1.0 - t * t).max(0.0).powi(2) as f64;
            let (x, y) = (r.off as f64, r.on as f64);
            s += w;
            sx += w * x;
            sy += w * y;
            sxx += w * x * x;
            sxy += w * x * y;
        }
        if s < 1.0 {
            break;
        }
        let noise = s * (run_deviation as f64).powi(2) / 2.0;
        // Contrast below the runs' noise cannot tell a gain: it is drawn to 1 by as much as one run's noise.
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
    let limit = (4.0 * run_deviation).powi(2);
    let cost = runs.iter().map(|r| (r.on - gain * r.off - offset).powi(2).min(limit)).sum();
    (gain, offset, cost)
}

/// Count and variance of a histogram of (count, sum of squares) of absolute values, `scale` cells a
/// unit: clipped at three standard deviations, so that a minority of changed pixels does not matter, but
/// not below `least`, as rounding makes most of silent noise vanish and the rest a whole grey level.
fn clipped_variance(cells: &[(u32, f32)], scale: f32, least: f32) -> (f32, f32) {
    let total: u32 = cells.iter().map(|c| c.0).sum();
    if total == 0 {
        return (0.0, 0.0);
    }
    let mut below = 0;
    let middle = cells.iter().position(|c| {
        below += c.0;
        2 * below >= total
    });
    // In cells; half a cell more than the median, and never none.
    let mut deviation = 1.4826 * (middle.unwrap_or(0) as f32 + 1.0);
    let mut variance = 0.0;
    for _ in 0..4 {
        let end = ((3.0 * deviation).max(least * scale).ceil() as usize).min(cells.len());
        let (count, square) = cells[..end].iter().fold((0, 0.0), |(n, s), c| (n + c.0, s + c.1));
        // Variance of a normal distribution cut at 3 standard deviations.
        variance = square / count.max(1) as f32 / 0.9733;
        deviation = (variance.sqrt() * scale).max(1.0);
    }
    (total as f32, variance)
}

fn median(values: &mut [f32]) -> Option<f32> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f32::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::frames::channels;
    use crate::image::{Image, PixelFormat};
    use rand_chacha::ChaCha8Rng;
    use rand_core::{Rng, SeedableRng};

    /// Frames of a shaded scene with noise of variance read + shot x level, the sum of 12 uniforms.
    fn frame(gain: f64, offset: f64, read: f64, shot: f64, moved: bool, rng: &mut ChaCha8Rng) -> Image {
        let mut image = Image::new(PixelFormat::Gray8, 400, 300);
        for (i, byte) in image.data.iter_mut().enumerate() {
            let (x, y) = (i % 400, i / 400);
            let mut level = 30.0 + 0.4 * (3 * x % 400) as f64 + 12.0 * ((y / 20) % 2) as f64;
            if moved && x < 100 {
                level = 140.0 - 0.4 * y as f64;
            }
            level = gain * level + offset;
            let normal: f64 = (0..12).map(|_| rng.next_u32() as f64 / 2f64.powi(32) - 0.5).sum();
            *byte = (level + (read + shot * level).sqrt() * normal).round().clamp(0.0, 255.0) as u8;
        }
        image
    }

    #[test]
    fn drift_and_noise_are_measured() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for (gain, offset) in [(1.0, 0.0), (0.8, 6.0), (1.2, -4.0)] {
            // A quarter of the scene is another one.
            for (read, shot, moved) in [(4.0, 0.0, false), (1.0, 0.15, false), (4.0, 0.0, true)] {
                let off = frame(1.0, 0.0, read, shot, false, &mut rng);
                let on = frame(gain, offset, read, shot, moved, &mut rng);
                let (on, off) = ([on.view().unwrap()], [off.view().unwrap()]);
                let [on, off] = [&on, &off].map(|f| FrameMean::new("frames", f).unwrap());
                let area = SearchArea::new([400, 300], None, None).unwrap();
                let p = Photometry::estimate(&on, &off, channels(PixelFormat::Gray8)[0], &area);
                for level in [50.0f32, 120.0, 180.0] {
                    let wanted = gain as f32 * level + offset as f32;
                    assert!(
                        (p.predict(level) - wanted).abs() < 0.8,
                        "{gain} {offset}: {level} -> {}",
                        p.predict(level)
                    );
                    let on_level = wanted as f64;
                    let variance = read + shot * on_level + gain * gain * (read + shot * level as f64);
                    let ratio = p.deviation(level) as f64 / (variance + 0.15).sqrt();
                    let allowed = if moved { 0.8..1.6 } else { 0.92..1.1 };
                    assert!(allowed.contains(&ratio), "{gain} {read} {shot} {moved} at {level}: {ratio}");
                }
                let steady = if moved { 0.65..0.9 } else { 0.97..1.01 };
                assert!(steady.contains(&p.steady), "{}", p.steady);
            }
        }
    }
}
