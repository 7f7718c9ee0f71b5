//! Straight runs of edge pixels. From a strong pixel the line that its gradient suggests is followed
//! both ways, one column (or row) at a time: at each the pixel on the line, whose gradient points as
//! the line's does, joins the line's fit. What was followed is taken out of the map, so that every
//! edge pixel is in one run, and lines that cross cost each other a pixel or two.

use std::f32::consts::TAU;

use crate::detect::edges::gradient::{Maximum, Smoothing, maxima};
use crate::image::pyramid::Grey;

/// Directions of a gradient are known to 1 / 64 of a turn.
const BINS: i32 = 64;
const PRESENT: u8 = 0x80;
/// Was on a run that is too short: not worth another.
const SPENT: u8 = 0x40;
/// Greatest difference of directions, 28 degrees: near the noise, gradients scatter.
const DIRECTION_TOLERANCE: i32 = 5;
/// Pixels from the line.
const DISTANCE: f32 = 1.2;
/// Columns (or rows) in a row that may lack a pixel: a line that crosses takes away two or three.
const GAP: i32 = 3;
/// Weight of the seed's gradient in the slope: as good as this sum of squares of positions.
const PRIOR: f32 = 12.0;
/// Least share of columns that have a pixel.
const DENSITY: f32 = 0.7;
/// Seeds are taken in every fourth column (or row): no run that is long enough is missed.
const SEED_STEP: usize = 4;

/// The edge pixels that are left: 0, or the direction of the gradient.
pub struct EdgeMap {
    width: usize,
    height: usize,
    cells: Vec<u8>,
    seeds: Vec<u32>,
}

/// A straight run: v = at + slope (t - first), where t is x for runs along x and y for the others, and
/// v the other coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Track {
    pub along_x: bool,
    pub first: i32,
    pub last: i32,
    pub at: f64,
    pub slope: f64,
    /// Does it get brighter towards greater v?
    pub rising: bool,
}

impl Track {
    pub fn length(&self) -> f64 {
        f64::from(self.last - self.first) * (1.0 + self.slope * self.slope).sqrt()
    }
}

/// To the nearest; the standard function is a call where there is no instruction for it.
fn round(v: f32) -> i32 {
    const BIAS: f32 = 16384.0;
    (v + (BIAS + 0.5)) as i32 - BIAS as i32
}

/// Direction of a gradient.
fn bin(gx: f32, gy: f32) -> i32 {
    // atan to 0.2 degrees (Rajan et al., IEEE Signal Processing Magazine 2006).
    let (a, b) = (gx.abs(), gy.abs());
    let r = a.min(b) / a.max(b).max(1e-30);
    let octant = r * (std::f32::consts::FRAC_PI_4 + 0.273 * (1.0 - r));
    let quadrant = if b > a { 0.25 * TAU - octant } else { octant };
    let half = if gx < 0.0 { 0.5 * TAU - quadrant } else { quadrant };
    let angle = if gy < 0.0 { TAU - half } else { half };
    (angle * (BINS as f32 / TAU) + 0.5) as i32 & (BINS - 1)
}

fn direction(cell: u8) -> i32 {
    i32::from(cell) & (BINS - 1)
}

fn alike(a: i32, b: i32) -> bool {
    let d = (a - b + DIRECTION_TOLERANCE) & (BINS - 1);
    d <= 2 * DIRECTION_TOLERANCE
}

/// Least squares of v by t, both from the seed, with the seed's slope as a prior.
#[derive(Clone, Copy)]
struct Fit {
    n: f32,
    t: f32,
    v: f32,
    tt: f32,
    tv: f32,
    prior: f32,
    /// v = at + slope t, of the points so far.
    slope: f32,
    at: f32,
}

impl Fit {
    fn add(&mut self, t: f32, v: f32) {
        self.n += 1.0;
        self.t += t;
        self.v += v;
        self.tt += t * t;
        self.tv += t * v;
        // A long run does not change with every point.
        if self.n < 32.0 || self.n as i32 % 8 == 0 {
            self.solve();
        }
    }

    fn solve(&mut self) {
        let scale = 1.0 / self.n;
        let t = self.t * scale;
        self.slope = (self.tv - t * self.v + PRIOR * self.prior) / (self.tt - t * self.t + PRIOR);
        self.at = (self.v - self.slope * self.t) * scale;
    }

    /// Direction of the gradient across the line.
    fn facing(&self, along_x: bool, rising: bool) -> i32 {
        let sign = if rising { 1.0 } else { -1.0 };
        if along_x { bin(-self.slope * sign, sign) } else { bin(sign, -self.slope * sign) }
    }
}

impl EdgeMap {
    /// Edges above `low`, seeds above `high`, in the gradient's units.
    pub fn new(image: &Grey<'_>, low: f64, high: f64) -> Self {
        let (width, height) = (image.width(), image.height());
        let mut cells = vec![0u8; width * height];
        let mut seeds = Vec::new();
        let high = high * high;
        maxima(image, &Smoothing::Binomial, low, |m: Maximum| {
            let index = m.y * width + m.x;
            cells[index] = PRESENT | bin(m.gx as f32, m.gy as f32) as u8;
            let along = if m.along_x() { m.x } else { m.y };
            if along.is_multiple_of(SEED_STEP) && f64::from(m.squares[0]) >= high {
                seeds.push(index as u32);
            }
        });
        Self { width, height, cells, seeds }
    }

    /// All runs of at least this length in pixels, in the order of their seeds.
    pub fn tracks(mut self, min_length: f64, mut found: impl FnMut(Track)) {
        for seed in std::mem::take(&mut self.seeds) {
            let cell = self.cells[seed as usize];
            if cell == 0 || cell & SPENT != 0 {
                continue;
            }
            let (track, share) = self.grow(seed as usize);
            if track.length() < min_length || share < DENSITY {
                self.along(&track, 0, |cell| *cell |= SPENT);
            } else {
                // The pixels beside it that belong to the same edge too.
                self.along(&track, 1, |cell| *cell = 0);
                found(track);
            }
        }
    }

    fn cell(&self, along_x: bool, t: i32, v: i32) -> u8 {
        let (x, y) = if along_x { (t, v) } else { (v, t) };
        // Negative coordinates are great ones.
        let (x, y) = (x as u32 as usize, y as u32 as usize);
        if x < self.width && y < self.height { self.cells[y * self.width + x] } else { 0 }
    }

    /// The run through a seed, and the share of its columns that have a pixel.
    fn grow(&self, seed: usize) -> (Track, f32) {
        let (x, y) = ((seed % self.width) as i32, (seed / self.width) as i32);
        let mut facing = direction(self.cells[seed]);
        let (sin, cos) = (facing as f32 * (TAU / BINS as f32)).sin_cos();
        let along_x = sin.abs() > cos.abs();
        let (t0, v0, prior) = if along_x { (x, y, -cos / sin) } else { (y, x, -sin / cos) };
        let rising = if along_x { sin > 0.0 } else { cos > 0.0 };
        let mut fit = Fit { n: 0.0, t: 0.0, v: 0.0, tt: 0.0, tv: 0.0, prior, slope: prior, at: 0.0 };
        fit.add(0.0, 0.0);
        let mut ends = [0, 0];
        for (end, step) in [(1, 1), (0, -1)] {
            let mut t = ends[end];
            let mut missing = 0;
            while missing <= GAP {
                t += step;
                let expected = fit.at + fit.slope * t as f32;
                let nearest = round(expected);
                let beside = if expected > nearest as f32 { 1 } else { -1 };
                let candidate = [nearest, nearest + beside, nearest - beside].into_iter().find(|v| {
                    let cell = self.cell(along_x, t0 + t, v0 + v);
                    cell != 0 && alike(direction(cell), facing) && (*v as f32 - expected).abs() <= DISTANCE
                });
                let Some(v) = candidate else {
                    missing += 1;
                    continue;
                };
                missing = 0;
                ends[end] = t;
                fit.add(t as f32, v as f32);
                // The line's own direction is better than a pixel's.
                if fit.n as i32 % 4 == 0 {
                    facing = fit.facing(along_x, rising);
                }
            }
        }
        fit.solve();
        let [first, last] = ends;
        let at = f64::from(v0) + f64::from(fit.at) + f64::from(fit.slope) * f64::from(first);
        let slope = f64::from(fit.slope);
        let track = Track { along_x, first: t0 + first, last: t0 + last, at, slope, rising };
        (track, fit.n / (last - first + 1) as f32)
    }

    /// Changes the pixels of a run, with those up to `beside` off it.
    fn along(&mut self, track: &Track, beside: i32, change: impl Fn(&mut u8)) {
        let sign = if track.rising { 1.0 } else { -1.0 };
        let across = -track.slope as f32 * sign;
        let facing = if track.along_x { bin(across, sign) } else { bin(sign, across) };
        for t in track.first..=track.last {
            let v = (track.at + track.slope * f64::from(t - track.first) + 0.5) as i32;
            for v in v - beside..=v + beside {
                let cell = self.cell(track.along_x, t, v);
                if cell != 0 && alike(direction(cell), facing) {
                    let (x, y) = if track.along_x { (t, v) } else { (v, t) };
                    change(&mut self.cells[y as usize * self.width + x as usize]);
                }
            }
        }
    }
}
