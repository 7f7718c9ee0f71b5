//! A straight run to a few hundredths of a pixel, from the image itself.
//!
//! Every column (row) that crosses the line is compared with a blurred step between two levels of its
//! own (`profile`), so that light and texture along the line do not matter; its pixels are its own
//! too, so that the columns' positions are independent. A line through them by weighted least squares
//! then has the covariance that their scatter says. For a step between unknown levels in a window of
//! this size that is the maximum-likelihood estimate.

use super::profile::{Pixels, REACH, Template, Templates, WIDTH, dot};
use super::track::Track;
use crate::image::pyramid::Grey;

/// Columns that are enough for a window, a blur and a start.
const SAMPLED: i32 = 48;
const ITERATIONS: usize = 3;
/// Columns that agree on the contrast, on each side.
const SMOOTHING: usize = 4;
/// Standard deviations beyond which a column shows something else.
const REJECT: f64 = 4.0;
/// Greatest distance of a column's edge from the line, pixels.
const MAX_SHIFT: f64 = 1.5;
/// Least share of a run's columns that must agree.
const MIN_SHARE: f64 = 0.6;
/// Columns of the blocks whose means show whether neighbouring columns err alike.
const BLOCK: usize = 8;
/// Blurs that a corner reaches along its edges.
const CORNER: f64 = 2.0;
/// Share of the contrast below which the light stands still.
const STILL: f64 = 0.04;

/// A line v = at + slope (t - mean) with its statistics; t is x for lines along x, else y.
#[derive(Debug, Clone, Copy)]
pub struct LineFit {
    pub along_x: bool,
    pub rising: bool,
    pub first: f64,
    pub last: f64,
    /// Centroid of the columns, by weight.
    pub mean: f64,
    pub at: f64,
    pub slope: f64,
    /// Root mean square of t - mean, by weight.
    pub spread: f64,
    /// Variance of `at`; that of the slope is `variance / spread^2`, and they are independent.
    pub variance: f64,
    /// Grey levels.
    pub contrast: f64,
    /// Standard deviation of the contrast for white noise of one grey level.
    pub contrast_gain: f64,
    /// Standard deviation, pixels along v.
    pub blur: f64,
    /// Of the columns about the line, grey levels.
    pub noise: f64,
}

/// What one column says.
#[derive(Debug, Clone, Copy)]
struct Column {
    t: f64,
    contrast: f64,
    /// Minus contrast times distance from the line.
    shift: f64,
    blur: f64,
    contrast_variance: f64,
    shift_variance: f64,
    /// Mean contrast of the columns around.
    smooth: f64,
    used: bool,
}

impl Column {
    /// Distance of its edge from the line, and its weight.
    fn place(&self) -> (f64, f64) {
        (-self.shift / self.smooth, self.smooth * self.smooth / self.shift_variance)
    }
}

/// Memory that is used again.
pub struct Fitter<'a> {
    image: &'a Grey<'a>,
    templates: Templates,
    columns: Vec<Column>,
    sizes: Vec<f64>,
}

impl<'a> Fitter<'a> {
    pub fn new(image: &'a Grey<'a>) -> Self {
        Self { image, templates: Templates::new(), columns: Vec::new(), sizes: Vec::new() }
    }

    /// `None` when the columns do not agree on a line.
    pub fn fit(&mut self, track: &Track) -> Option<LineFit> {
        let window = self.window(track)?;
        let (mut at, mut slope) = (window.at, track.slope);
        let mut blur = window.blur;
        let origin = 0.5 * f64::from(track.first + track.last);
        let mut result = None;
        for last in (0..ITERATIONS).map(|i| i + 1 == ITERATIONS) {
            let (template, actual) = self.templates.get(blur, window.before, window.after)?;
            self.columns.clear();
            let line = |t| at + slope * (t - origin);
            let step = if last { 1 } else { 1 + (track.last - track.first) as usize / SAMPLED as usize };
            read(self.image, track, template, margin(track, slope, blur), step, line, &mut self.columns);
            let sums = smooth(&mut self.columns)?;
            let line = self.regress(origin, if last { 3 } else { 1 })?;
            at += line.at - line.slope * (line.mean - origin);
            slope += line.slope;
            blur = actual * sums.clamp(-0.4, 0.4).exp();
            if last {
                result = self.finish(track, &line, at + slope * (line.mean - origin), slope, actual);
            }
        }
        result
    }

    /// How far the light keeps rising on both sides of the line, on the average of some columns: the
    /// next edge must not be fitted with this one.
    fn window(&self, track: &Track) -> Option<Window> {
        const N: usize = 2 * REACH + 1;
        let sign = if track.rising { 1.0 } else { -1.0 };
        let step = ((track.last - track.first) / SAMPLED).max(1);
        let (mut sum, mut count, mut offset) = ([0f64; N], 0.0, 0.0);
        let mut pixels = [0f32; N];
        for t in (track.first..=track.last).step_by(step as usize) {
            let v = track.at + track.slope * f64::from(t - track.first);
            if pixels_at(self.image, track.along_x, t, v.round() as i64, REACH, &mut pixels) {
                sum.iter_mut().zip(pixels).for_each(|(s, p)| *s += sign * f64::from(p));
                offset += v - v.round();
                count += 1.0;
            }
        }
        if count == 0.0 {
            return None;
        }
        let rise: [f64; N - 1] = std::array::from_fn(|k| (sum[k + 1] - sum[k]) / count);
        // The steepest rise within two pixels; rise k lies between pixels k and k + 1.
        let peak = (REACH - 2..=REACH + 1).max_by(|a, b| rise[*a].total_cmp(&rise[*b]))?;
        let least = STILL * rise[REACH - 2..=REACH + 1].iter().filter(|r| **r > 0.0).sum::<f64>();
        let goes_on = |here: f64, nearer: f64| here > -least && here < nearer + least;
        let below = (0..peak).rev().take_while(|k| goes_on(rise[*k], rise[*k + 1])).count();
        let above = (peak + 1..N - 1).take_while(|k| goes_on(rise[*k], rise[*k - 1])).count();
        let inside = peak - below..=peak + above;
        let weight = |k: &usize| rise[*k].max(0.0);
        let place = |k: &usize| *k as f64 + 0.5 - REACH as f64;
        let total: f64 = inside.clone().map(|k| weight(&k)).sum();
        if total <= 0.0 {
            return None;
        }
        let mean = inside.clone().map(|k| weight(&k) * place(&k)).sum::<f64>() / total;
        let square = inside.map(|k| weight(&k) * (place(&k) - mean).powi(2)).sum::<f64>() / total;
        // A difference of pixels is blurred by two of them, less by one's own.
        let blur = (square - 1.0 / 12.0).max(0.16).sqrt();
        let wanted = ((1.5 + 3.0 * blur).round() as usize).clamp(3, REACH);
        let at = track.at + track.slope * 0.5 * f64::from(track.last - track.first);
        // Pixels peak - below .. peak + above + 1 belong to this edge.
        let before = (REACH + below).saturating_sub(peak).min(wanted);
        let after = (peak + above + 1).saturating_sub(REACH).min(wanted);
        let shift = (mean - offset / count).clamp(-MAX_SHIFT, MAX_SHIFT);
        (before >= 2 && after >= 2).then_some(Window { before, after, blur, at: at + shift })
    }

    /// Line through the columns that agree, relative to the present one, with outliers marked.
    fn regress(&mut self, origin: f64, rounds: usize) -> Option<Regression> {
        let mut line = Regression::of(&self.columns, origin)?;
        for _ in 0..rounds {
            self.sizes.clear();
            let residual = |c: &Column| (c.shift + c.smooth * line.value(c.t)) / c.shift_variance.sqrt();
            self.sizes.extend(self.columns.iter().filter(|c| c.used).map(|c| residual(c).abs()));
            let middle = self.sizes.len() / 2;
            let median = *self.sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
            let limit = REJECT * 1.4826 * median.max(1e-3);
            let mut changed = false;
            for c in &mut self.columns {
                let used = c.smooth > 0.0 && residual(c).abs() <= limit && (c.shift / c.smooth).abs() <= MAX_SHIFT;
                changed |= used != c.used;
                c.used = used;
            }
            line = Regression::of(&self.columns, origin)?;
            if !changed {
                break;
            }
        }
        Some(line)
    }

    fn finish(&self, track: &Track, line: &Regression, at: f64, slope: f64, blur: f64) -> Option<LineFit> {
        let used = || self.columns.iter().filter(|c| c.used);
        let (first, last) = (used().next()?.t, used().next_back()?.t);
        let count = used().count();
        if (count as f64) < MIN_SHARE * (last - first + 1.0) || count < 4 {
            return None;
        }
        let residual = |c: &Column| (c.shift + c.smooth * line.value(c.t)) / c.shift_variance.sqrt();
        let residuals: Vec<f64> = used().map(residual).collect();
        let noise2 = (residuals.iter().map(|r| r * r).sum::<f64>() / (count as f64 - 2.0)).max(1e-6);
        // Neighbouring columns that err alike (a bent line, texture) say less than independent ones.
        let blocks = residuals.chunks_exact(BLOCK).map(|b| b.iter().sum::<f64>().powi(2) / BLOCK as f64);
        let number = blocks.len() as f64;
        let alike = blocks.sum::<f64>() / (number * noise2);
        let beyond_chance = number > 3.0 && alike > 1.0 + 3.0 * (2.0 / number).sqrt();
        let inflation = if beyond_chance { alike } else { 1.0 };
        let n = count as f64;
        Some(LineFit {
            along_x: track.along_x,
            rising: track.rising,
            first: f64::from(track.first).min(first),
            last: f64::from(track.last).max(last),
            mean: line.mean,
            at,
            slope,
            spread: line.spread,
            variance: inflation * noise2 / line.weight,
            contrast: used().map(|c| c.contrast).sum::<f64>() / n,
            contrast_gain: (used().map(|c| c.contrast_variance).sum::<f64>()).sqrt() / n,
            blur,
            noise: noise2.sqrt(),
        })
    }
}

/// Columns at each end that are left out, where there are enough: on their way across the line the
/// blurred corner shows.
fn margin(track: &Track, slope: f64, blur: f64) -> i32 {
    let margin = (CORNER * blur * (1.0 + slope.abs())).round() as i32;
    margin.min((track.last - track.first) / 8)
}

struct Window {
    before: usize,
    after: usize,
    blur: f64,
    /// Of the line at its middle.
    at: f64,
}

/// v = at + slope (t - mean).
struct Regression {
    mean: f64,
    at: f64,
    slope: f64,
    spread: f64,
    weight: f64,
}

impl Regression {
    fn of(columns: &[Column], origin: f64) -> Option<Self> {
        let (mut n, mut t, mut v, mut tt, mut tv) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for c in columns.iter().filter(|c| c.used) {
            let (place, w) = c.place();
            let s = c.t - origin;
            (n, t, v) = (n + w, t + w * s, v + w * place);
            (tt, tv) = (tt + w * s * s, tv + w * s * place);
        }
        let (mean, at) = (t / n, v / n);
        let spread2 = tt / n - mean * mean;
        // Two columns are a pixel apart at least.
        if !(n > 0.0 && spread2 > 0.1) {
            return None;
        }
        let slope = (tv / n - mean * at) / spread2;
        Some(Self { mean: mean + origin, at, slope, spread: spread2.sqrt(), weight: n })
    }

    fn value(&self, t: f64) -> f64 {
        self.at + self.slope * (t - self.mean)
    }
}

/// Pixels v - reach ..= v + reach of column t; false where the image ends.
fn pixels_at(image: &Grey<'_>, along_x: bool, t: i32, v: i64, reach: usize, out: &mut [f32]) -> bool {
    span(image, along_x, t, v - reach as i64, &mut out[..2 * reach + 1])
}

fn span(image: &Grey<'_>, along_x: bool, t: i32, from: i64, out: &mut [f32]) -> bool {
    let (Ok(t), Ok(from)) = (usize::try_from(t), usize::try_from(from)) else { return false };
    let (across, along) = if along_x { (image.height(), image.width()) } else { (image.width(), image.height()) };
    if from + out.len() > across || t >= along {
        return false;
    }
    if along_x {
        out.iter_mut().enumerate().for_each(|(k, o)| *o = f32::from(image.row(from + k)[t]));
    } else {
        out.iter_mut().zip(&image.row(t)[from..]).for_each(|(o, p)| *o = f32::from(*p));
    }
    true
}

/// What every column says about the line `v`.
fn read(
    image: &Grey<'_>,
    track: &Track,
    template: &Template,
    margin: i32,
    step: usize,
    v: impl Fn(f64) -> f64,
    columns: &mut Vec<Column>,
) {
    let n = template.before + template.after + 1;
    let sign = if track.rising { 1.0 } else { -1.0 };
    let mut pixels: Pixels = [0.0; WIDTH];
    for t in (track.first + margin..=track.last - margin).step_by(step) {
        let v = v(f64::from(t));
        let middle = v.round();
        if !span(image, track.along_x, t, middle as i64 - template.before as i64, &mut pixels[..n]) {
            continue;
        }
        let (w, offset) = template.at(v - middle);
        let contrast = sign * dot(&pixels, &w.contrast);
        columns.push(Column {
            t: f64::from(t),
            contrast,
            // The weights measure from their own offset.
            shift: sign * dot(&pixels, &w.shift) - contrast * (middle + offset - v),
            blur: sign * dot(&pixels, &w.blur),
            contrast_variance: w.contrast_variance,
            shift_variance: w.shift_variance,
            smooth: 0.0,
            used: true,
        });
    }
}

/// Mean contrasts; returns the mean relative change of the blur.
fn smooth(columns: &mut [Column]) -> Option<f64> {
    let n = columns.len();
    if n < 4 {
        return None;
    }
    let mut sum: f64 = columns[..SMOOTHING.min(n)].iter().map(|c| c.contrast).sum();
    let mut held = SMOOTHING.min(n);
    for i in 0..n {
        if let Some(c) = columns.get(i + SMOOTHING) {
            sum += c.contrast;
            held += 1;
        }
        if i > SMOOTHING {
            sum -= columns[i - SMOOTHING - 1].contrast;
            held -= 1;
        }
        columns[i].smooth = sum / held as f64;
        columns[i].used = columns[i].smooth > 0.0;
    }
    let (change, square) = columns
        .iter()
        .filter(|c| c.used)
        .fold((0.0, 0.0), |(a, b), c| (a + c.smooth * c.blur, b + c.smooth * c.smooth));
    (square > 0.0).then(|| change / square)
}
