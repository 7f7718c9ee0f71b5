//! Changed regions, and whether one of them is a laser's spot.

use std::ops::Range;

use super::gaussian_fit::{Fit, Gaussian, Patch, Pixel};
use crate::image::PixelFormat;
use crate::image::area::SearchArea;
use crate::image::components::Components;
use crate::image::difference::{BRIGHTER, Carrier, Changes, Pair};
use crate::image::frames::Channel;
use crate::image::photometry::Photometry;

/// Pixels of a patch beyond which it is thinned out.
const MAX_PATCH: usize = 4096;
/// A spot on a slanted wall is drawn out; a laser line is more so.
const MAX_ELONGATION: f64 = 4.0;
/// Nothing that a lens has blurred is smaller: a hot pixel is.
const MIN_SIGMA: f64 = 0.4;
/// Share of the signal's energy that a Gaussian must explain: of a flat disc it is 0.81, as a spot out of
/// focus may be; a large flat patch is something else that became brighter.
const MIN_EXPLAINED: f64 = 0.75;
const MIN_EXPLAINED_LARGE: f64 = 0.95;
const LARGE: u32 = 400;
/// Fewer pixels than this have no shape to judge.
const SHAPED: u32 = 12;
/// Room is made for as many at once.
pub const USUAL_BLOBS: usize = 64;
/// Pixels that are read together.
const SPAN: usize = 64;

/// A connected region that became brighter or darker.
#[derive(Debug, Clone)]
pub struct Blob {
    pub brighter: bool,
    pub area: u32,
    /// Least and greatest column and row.
    pub low: [u32; 2],
    pub high: [u32; 2],
    /// Sum and peak of the difference by carrier.
    pub sum: [f32; 3],
    pub peak: [f32; 3],
    /// Sums over its pixels of x, y, xx, xy, yy.
    moments: [f64; 5],
}

/// A blob that passed for a spot.
#[derive(Debug, Clone)]
pub struct Candidate {
    pub carrier: usize,
    pub fit: Fit,
    pub clipped: bool,
    /// Total signal, by which spots are compared.
    pub strength: f64,
}

/// The components of the changed pixels, in order of their first one.
#[derive(Debug, Default)]
pub struct Blobs {
    pub all: Vec<Blob>,
    components: Components,
}

impl Blobs {
    pub fn find(&mut self, changes: &Changes) {
        let (labels, _) = self.components.label(&changes.runs);
        let blobs = &mut self.all;
        blobs.clear();
        blobs.reserve(USUAL_BLOBS);
        for ((run, signal), label) in changes.runs.iter().zip(&changes.signals).zip(labels) {
            let (low, high) = ([run.start, run.row], [run.end - 1, run.row]);
            // Labels are numbered in order of their first run.
            if *label as usize == blobs.len() {
                let (sum, peak, moments) = ([0.0; 3], [0.0; 3], [0.0; 5]);
                blobs.push(Blob { brighter: run.class == BRIGHTER, area: 0, low, high, sum, peak, moments });
            }
            let blob = &mut blobs[*label as usize];
            blob.area += run.end - run.start;
            for i in 0..2 {
                blob.low[i] = blob.low[i].min(low[i]);
                blob.high[i] = blob.high[i].max(high[i]);
            }
            for c in 0..3 {
                blob.sum[c] += signal.sum[c];
                blob.peak[c] = if signal.peak[c].abs() > blob.peak[c].abs() { signal.peak[c] } else { blob.peak[c] };
            }
            // Closed sums of x and x^2 over the run.
            let (n, y) = ((run.end - run.start) as f64, run.row as f64);
            let middle = 0.5 * (run.start as f64 + (run.end - 1) as f64);
            let xx = n * middle * middle + n * (n * n - 1.0) / 12.0;
            let run_moments = [n * middle, n * y, xx, n * middle * y, n * y * y];
            blob.moments.iter_mut().zip(run_moments).for_each(|(m, r)| *m += r);
        }
    }
}

impl Blob {
    pub fn centre(&self) -> [f64; 2] {
        [self.moments[0] / self.area as f64, self.moments[1] / self.area as f64]
    }

    /// Variances xx, xy, yy of its pixels, each a unit square.
    fn shape(&self) -> [f64; 3] {
        let n = self.area as f64;
        let [x, y] = self.centre();
        let [_, _, xx, xy, yy] = self.moments.map(|m| m / n);
        [xx - x * x + 1.0 / 12.0, xy - x * y, yy - y * y + 1.0 / 12.0]
    }

    /// The Gaussian that is cut off to this blob: at a level e^-l of its peak, the mean height is
    /// (1 - e^-l) / l of the peak and the variances of the pixels are l / 2 of the Gaussian's.
    fn start(&self, carrier: usize, clipped: bool) -> Gaussian {
        let [x, y] = self.centre();
        let peak = self.peak[carrier].max(1e-3) as f64;
        if clipped {
            return Gaussian { x, y, amplitude: 1.5 * peak, shape: self.shape() };
        }
        let mean = (self.sum[carrier] as f64 / (peak * self.area as f64)).clamp(0.2, 0.9);
        let l = (0..6).fold(1.0 / mean, |l: f64, _| (1.0 - (-l).exp()) / mean);
        // Few pixels have no shape.
        let shape = if self.area < 5 { [1.0, 0.0, 1.0] } else { self.shape().map(|v| v * 2.0 / l) };
        Gaussian { x, y, amplitude: peak, shape }
    }

    /// The columns and rows that such a spot takes, at most a few pixels and so many times the blob's size.
    fn reach(&self, spot: &Gaussian, times: f64) -> [[f64; 2]; 2] {
        let most = times * self.size() as f64 + 4.0;
        let side = |centre: f64, variance: f64| {
            let reach = (3.2 * variance.max(0.0).sqrt() + 1.0).min(most);
            [centre - reach, centre + reach]
        };
        [side(spot.x, spot.shape[0]), side(spot.y, spot.shape[2])]
    }

    /// Is the point within `margin` pixels of the bounding box?
    pub fn is_near(&self, point: [f64; 2], margin: f64) -> bool {
        (0..2).all(|i| point[i] >= self.low[i] as f64 - margin && point[i] <= self.high[i] as f64 + margin)
    }

    pub fn size(&self) -> u32 {
        (self.high[0] - self.low[0]).max(self.high[1] - self.low[1]) + 1
    }

    /// The carrier in which it stands out most.
    pub fn carrier(&self, carriers: &[Carrier]) -> usize {
        let score = |c: usize| self.sum[c].abs() / carriers[c].photometry.deviation(128.0);
        (1..carriers.len()).fold(0, |best, c| if score(c) > score(best) { c } else { best })
    }

    pub fn greatest(&self) -> f32 {
        self.peak.iter().fold(0.0, |m: f32, p| m.max(p.abs()))
    }
}

/// Levels from which a pixel counts as clipped: studio-range luma ends at 235.
pub fn clip_level(format: PixelFormat) -> u8 {
    match format {
        PixelFormat::Yuyv | PixelFormat::Nv12 | PixelFormat::I420 => 234,
        _ => 250,
    }
}

/// Where patches are cut from: the signal and its noise by pixel.
pub trait Signal {
    /// Pixels of row y from column x on.
    fn read(&self, x: usize, y: usize, row: &mut [Pixel]);
    /// Variance that each grey level of signal adds.
    fn signal_variance(&self) -> f32;
}

/// on - predicted from off.
pub struct DifferenceSignal<'a> {
    pub frames: Pair<'a>,
    pub carrier: usize,
}

impl DifferenceSignal<'_> {
    fn channel(&self) -> Channel {
        self.frames.carriers[self.carrier].channel
    }

    fn photometry(&self) -> &Photometry {
        &self.frames.carriers[self.carrier].photometry
    }
}

impl Signal for DifferenceSignal<'_> {
    fn read(&self, x: usize, y: usize, row: &mut [Pixel]) {
        let (channel, photometry) = (self.channel(), self.photometry());
        let Pair { on, off, .. } = self.frames;
        let clip = clip_level(on.first().format());
        let (mut a, mut b, mut brightest) = ([0.0; SPAN], [0.0; SPAN], [0; SPAN]);
        for (i, row) in row.chunks_mut(SPAN).enumerate() {
            let (x, n) = (x + i * SPAN, row.len());
            on.read(channel, x, y, &mut a[..n]);
            off.read(channel, x, y, &mut b[..n]);
            on.brightest(channel, x, y, &mut brightest[..n]);
            for (((pixel, on), off), brightest) in row.iter_mut().zip(a).zip(b).zip(brightest) {
                let predicted = photometry.predict(off);
                *pixel = Pixel::default();
                if off < clip as f32 && predicted < clip as f32 {
                    pixel.signal = on - predicted;
                    pixel.variance = photometry.deviation(off).powi(2);
                    pixel.clipped = brightest >= clip;
                }
            }
        }
    }

    fn signal_variance(&self) -> f32 {
        self.photometry().signal_variance()
    }
}

/// Fits a spot to a blob; the error says why it is none.
pub fn examine(
    blob: &Blob,
    carrier: usize,
    signal: &impl Signal,
    area: &SearchArea,
    cutter: &mut Cutter,
) -> Result<Candidate, &'static str> {
    let [major, minor] = Gaussian { x: 0.0, y: 0.0, amplitude: 0.0, shape: blob.shape() }.axes();
    if blob.area >= SHAPED && major > MAX_ELONGATION * minor {
        return Err("it is a line");
    }
    let start = blob.start(carrier, false);
    // What stands out of the noise and some about it. Faint blobs are flat, and their start may be far too wide.
    let margin = |i: usize| 2.5 + 0.25 * (blob.high[i] - blob.low[i]) as f64;
    let stands_out = [0, 1].map(|i| [blob.low[i] as f64 - margin(i), blob.high[i] as f64 + margin(i)]);
    let bounds = joined(stands_out, blob.reach(&start, 0.75));
    let mut patch = cutter.cut(signal, area, bounds);
    let clipped = patch.has_clipped();
    let start = if clipped { blob.start(carrier, true) } else { start };
    let rough = patch.fit_roughly(&start).ok_or("it has no peak")?;
    let reach = blob.reach(&rough.gaussian(), 3.0);
    if (0..2).any(|i| reach[i][0] < bounds[i][0] - 1.0 || reach[i][1] > bounds[i][1] + 1.0) {
        patch = cutter.cut(signal, area, joined(bounds, reach));
    }
    let fit = patch.fit(&rough).ok_or("it has no peak")?;

    let gaussian = &fit.gaussian;
    let [major, minor] = gaussian.axes();
    if !blob.is_near([gaussian.x, gaussian.y], 1.0) {
        return Err("its peak lies outside of the searched area");
    }
    if major > MAX_ELONGATION * minor {
        return Err("it is drawn out like a line");
    }
    if minor < MIN_SIGMA {
        return Err("it is as sharp as a single pixel, which no lens makes");
    }
    if fit.explained < if blob.area > LARGE { MIN_EXPLAINED_LARGE } else { MIN_EXPLAINED } {
        return Err("it has not the shape of a spot");
    }
    // A clipped spot's height is extrapolated, but not far.
    let measured = blob.sum[carrier] as f64;
    let strength = if clipped { gaussian.flux().clamp(measured, 4.0 * measured) } else { gaussian.flux() };
    Ok(Candidate { carrier, fit, clipped, strength })
}

/// The bounds that hold both.
fn joined(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    [0, 1].map(|i| [a[i][0].min(b[i][0]), a[i][1].max(b[i][1])])
}

/// Memory that serves one patch after the other.
#[derive(Debug, Default)]
pub struct Cutter {
    patch: Patch,
    row: Vec<Pixel>,
    thinned: Vec<Pixel>,
    spans: Vec<Range<usize>>,
}

impl Cutter {
    /// The patch of these columns and rows, from and to.
    fn cut(&mut self, signal: &impl Signal, area: &SearchArea, bounds: [[f64; 2]; 2]) -> &mut Patch {
        let inside = |[low, high]: [f64; 2], side: Range<usize>| {
            let start = (low.max(0.0).floor() as usize).clamp(side.start, side.end - 1);
            start..(high.max(0.0).ceil() as usize + 1).clamp(start + 1, side.end)
        };
        let (columns, rows) = (inside(bounds[0], area.columns()), inside(bounds[1], area.rows()));
        let step = ((columns.len() * rows.len()) as f64 / MAX_PATCH as f64).sqrt().ceil().max(1.0) as usize;
        self.patch.begin(columns.start, rows.start, step, signal.signal_variance());
        self.row.clear();
        self.row.reserve(2 * SPAN);
        self.row.resize(columns.len(), Pixel::default());
        for y in rows.step_by(step) {
            signal.read(columns.start, y, &mut self.row);
            // What lies between the spans does not count.
            area.spans(y, &mut self.spans);
            let mut outside = 0;
            let ends = self.spans.iter().map(|s| [s.start, s.end]).chain([[columns.end, columns.end]]);
            for [start, end] in ends.map(|s| s.map(|x| x.clamp(columns.start, columns.end) - columns.start)) {
                self.row[outside..start].fill(Pixel::default());
                outside = end;
            }
            if step == 1 {
                self.patch.push(&self.row);
            } else {
                self.thinned.clear();
                self.thinned.extend(self.row.iter().step_by(step));
                self.patch.push(&self.thinned);
            }
        }
        &mut self.patch
    }
}
