//! Straight runs of edge pixels. From a strong pixel the line that its gradient suggests is followed
//! both ways, one column (or row) at a time: at each the pixel on the line, whose gradient points as
//! the line's does, joins the line's fit. What was followed is taken out of the map, so that every
//! edge pixel is in one run, and lines that cross cost each other a pixel or two.

use std::f64::consts::TAU;

use crate::detect::edges::gradient::{Maximum, Smoothing, maxima};
use crate::image::pyramid::Grey;

/// Directions of a gradient are known to 1 / 128 of a turn.
const BINS: i32 = 128;
const PRESENT: u8 = 0x80;
/// Greatest difference of directions, 31 degrees: near the noise, gradients scatter.
const DIRECTION_TOLERANCE: i32 = 11;
/// Pixels from the line.
const DISTANCE: f64 = 1.2;
/// Columns (or rows) in a row that may lack a pixel: a line that crosses takes away two or three.
const GAP: i32 = 3;
/// Weight of the seed's gradient in the slope: as good as this sum of squares of positions.
const PRIOR: f64 = 12.0;
/// Least share of columns that have a pixel.
const DENSITY: f64 = 0.7;
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

fn bin(gx: f64, gy: f64) -> i32 {
    // atan to 0.2 degrees (Rajan et al., IEEE Signal Processing Magazine 2006).
    let (a, b) = (gx.abs(), gy.abs());
    let r = a.min(b) / a.max(b).max(1e-300);
    let octant = r * (std::f64::consts::FRAC_PI_4 + 0.273 * (1.0 - r));
    let quadrant = if b > a { 0.25 * TAU - octant } else { octant };
    let half = if gx < 0.0 { 0.5 * TAU - quadrant } else { quadrant };
    let angle = if gy < 0.0 { TAU - half } else { half };
    (angle * (f64::from(BINS) / TAU) + 0.5) as i32 % BINS
}

fn apart(a: i32, b: i32) -> i32 {
    let d = (a - b).rem_euclid(BINS);
    d.min(BINS - d)
}

/// Least squares of v by t, with the seed's slope as a prior.
#[derive(Clone, Copy)]
struct Fit {
    n: f64,
    t: f64,
    v: f64,
    tt: f64,
    tv: f64,
    prior: f64,
}

impl Fit {
    fn add(&mut self, t: f64, v: f64) {
        self.n += 1.0;
        self.t += t;
        self.v += v;
        self.tt += t * t;
        self.tv += t * v;
    }

    /// Slope, and v at t = 0.
    fn line(&self) -> [f64; 2] {
        let (t, v) = (self.t / self.n, self.v / self.n);
        let slope = (self.tv - self.t * v + PRIOR * self.prior) / (self.tt - self.t * t + PRIOR);
        [slope, v - slope * t]
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
            cells[index] = PRESENT | bin(f64::from(m.gx), f64::from(m.gy)) as u8;
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
            if self.cells[seed as usize] == 0 {
                continue;
            }
            if let Some(track) = self.grow(seed as usize)
                && track.length() >= min_length
            {
                self.erase(&track);
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

    fn grow(&self, seed: usize) -> Option<Track> {
        let (x, y) = ((seed % self.width) as i32, (seed / self.width) as i32);
        let direction = i32::from(self.cells[seed] & !PRESENT);
        let (sin, cos) = (f64::from(direction) * (TAU / f64::from(BINS))).sin_cos();
        let along_x = sin.abs() > cos.abs();
        let (t0, v0, prior) = if along_x { (x, y, -cos / sin) } else { (y, x, -sin / cos) };
        let rising = if along_x { sin > 0.0 } else { cos > 0.0 };
        let mut fit = Fit { n: 0.0, t: 0.0, v: 0.0, tt: 0.0, tv: 0.0, prior };
        fit.add(0.0, 0.0);
        let mut ends = [0, 0];
        let mut facing = direction;
        for (end, step) in [(1, 1), (0, -1)] {
            let mut t = ends[end];
            let mut missing = 0;
            while missing <= GAP {
                t += step;
                let [slope, at] = fit.line();
                let expected = at + slope * f64::from(t);
                let nearest = expected.round();
                let beside = if expected > nearest { 1.0 } else { -1.0 };
                let candidate = [nearest, nearest + beside, nearest - beside].into_iter().find(|v| {
                    let cell = self.cell(along_x, t0 + t, v0 + *v as i32);
                    cell != 0
                        && (v - expected).abs() <= DISTANCE
                        && apart(i32::from(cell & !PRESENT), facing) <= DIRECTION_TOLERANCE
                });
                let Some(v) = candidate else {
                    missing += 1;
                    continue;
                };
                missing = 0;
                ends[end] = t;
                fit.add(f64::from(t), v);
                // The line's own direction is better than a pixel's.
                if fit.n as i32 % 4 == 0 {
                    let sign = if rising { 1.0 } else { -1.0 };
                    let [slope, _] = fit.line();
                    facing = if along_x { bin(-slope * sign, sign) } else { bin(sign, -slope * sign) };
                }
            }
        }
        let [first, last] = ends;
        if fit.n < DENSITY * f64::from(last - first + 1) {
            return None;
        }
        let [slope, at] = fit.line();
        let at = f64::from(v0) + at + slope * f64::from(first);
        Some(Track { along_x, first: t0 + first, last: t0 + last, at, slope, rising })
    }

    /// Takes out the run's pixels, and those beside them that belong to the same edge.
    fn erase(&mut self, track: &Track) {
        let sign = if track.rising { 1.0 } else { -1.0 };
        let across = -track.slope * sign;
        let facing = if track.along_x { bin(across, sign) } else { bin(sign, across) };
        for t in track.first..=track.last {
            let v = (track.at + track.slope * f64::from(t - track.first)).round() as i32;
            for v in v - 1..=v + 1 {
                let cell = self.cell(track.along_x, t, v);
                if cell != 0 && apart(i32::from(cell & !PRESENT), facing) <= DIRECTION_TOLERANCE {
                    let (x, y) = if track.along_x { (t, v) } else { (v, t) };
                    self.cells[y as usize * self.width + x as usize] = 0;
                }
            }
        }
    }
}
