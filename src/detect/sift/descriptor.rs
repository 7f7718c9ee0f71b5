//! What a keypoint's surroundings look like: their dominant orientations, and Lowe's descriptor of 4 x 4
//! histograms of 8 orientations, relative to the keypoint's own.

use std::f32::consts::TAU;

use super::kernels::{BINS, Histograms, ROW, SIDE, gradients, spread};
use super::scale_space::Octave;

pub const DESCRIPTOR_SIZE: usize = 128;
pub type Descriptor = [u8; DESCRIPTOR_SIZE];

/// Bins of the orientation histogram.
const ORIENTATIONS: usize = 36;
/// Its Gaussian window, in sigmas of the keypoint, and how far it reaches in its own.
const ORIENTATION_WINDOW: f32 = 1.5;
const ORIENTATION_REACH: f32 = 3.0;
/// Peaks above this share of the highest are orientations too.
const PEAK_SHARE: f32 = 0.8;
/// Cells along a side of the descriptor.
const CELLS: usize = SIDE - 2;
/// Width of a cell, in sigmas of the keypoint.
const CELL_SIGMAS: f32 = 3.0;
/// Greatest share of a single number in the vector's length, against light that is not linear.
const CLIP: f32 = 0.2;
/// The vector's length as bytes.
const LENGTH: f32 = 512.0;

/// Where a keypoint lies in its octave: the level that suits its scale, place and sigma in pixels.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    pub level: usize,
    pub x: f32,
    pub y: f32,
    pub sigma: f32,
}

/// A row of a window: magnitudes and angles of the gradients of its pixels.
struct Polar {
    magnitude: [f32; ROW],
    angle: [f32; ROW],
}

impl Polar {
    fn new() -> Self {
        Self { magnitude: [0.0; ROW], angle: [0.0; ROW] }
    }

    /// Columns `from`..`to` of row `y`, none of which is at the border.
    fn read(&mut self, octave: &Octave, level: usize, y: usize, from: usize, to: usize) {
        // In whole groups, where the row is long enough.
        let to = (from + (to - from).next_multiple_of(16)).min(octave.width() - 1).min(from + ROW);
        let rows = [y - 1, y, y + 1].map(|y| &octave.row(level, y)[from - 1..to + 1]);
        gradients(&mut self.magnitude[..to - from], &mut self.angle[..to - from], rows);
    }
}

/// first..end of the pixels within `radius` of `centre` that have neighbours on both sides.
fn span(centre: f32, radius: f32, size: usize) -> (usize, usize) {
    let first = (centre - radius).ceil().max(1.0) as usize;
    let end = ((centre + radius).floor() as i64 + 1).clamp(0, size as i64 - 1) as usize;
    (first, end.max(first))
}

/// The dominant orientations, radians from x towards y, 0 to 2 pi.
pub fn orientations(octave: &Octave, place: &Place, found: &mut Vec<f32>) {
    let window = ORIENTATION_WINDOW * place.sigma;
    let radius = ORIENTATION_REACH * window;
    let (left, right) = span(place.x, radius, octave.width());
    let (top, bottom) = span(place.y, radius, octave.height());
    let weight = |offset: f32| (-0.5 * (offset / window).powi(2)).exp();
    let mut across = [0.0; ROW];
    for (x, w) in (left..right).zip(&mut across) {
        *w = weight(x as f32 - place.x);
    }
    let mut polar = Polar::new();
    let mut turned = [0.0f32; ORIENTATIONS + 1];
    for y in top..bottom {
        polar.read(octave, place.level, y, left, right);
        let down = weight(y as f32 - place.y);
        for i in 0..right - left {
            // From half a turn back, so that it is positive.
            let bin = (polar.angle[i] * (ORIENTATIONS as f32 / TAU) + (0.5 * ORIENTATIONS as f32 + 0.5)) as u32;
            turned[(bin as usize).min(ORIENTATIONS)] += polar.magnitude[i] * across[i] * down;
        }
    }
    turned[0] += turned[ORIENTATIONS];
    let raw = std::array::from_fn(|i| turned[(i + ORIENTATIONS / 2) % ORIENTATIONS]);
    let at = |h: &[f32; ORIENTATIONS], i: usize, step: usize| h[(i + ORIENTATIONS + step - 2) % ORIENTATIONS];
    let mut smooth = [0.0f32; ORIENTATIONS];
    for (i, s) in smooth.iter_mut().enumerate() {
        let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(|step| at(&raw, i, step));
        *s = (a + e) * (1.0 / 16.0) + (b + d) * (4.0 / 16.0) + c * (6.0 / 16.0);
    }
    let least = PEAK_SHARE * smooth.iter().copied().fold(0.0, f32::max);
    found.clear();
    for i in 0..ORIENTATIONS {
        let [before, here, after] = [1, 2, 3].map(|step| at(&smooth, i, step));
        if here > before && here > after && here >= least {
            let peak = i as f32 + 0.5 * (before - after) / (before - 2.0 * here + after);
            found.push((peak * (TAU / ORIENTATIONS as f32)).rem_euclid(TAU));
        }
    }
}

/// The descriptor of a keypoint with this orientation. Its order is OpenCV's: rows of cells, cells, and
/// orientations from y towards x.
pub fn describe(octave: &Octave, place: &Place, orientation: f32) -> Descriptor {
    let cell = CELL_SIGMAS * place.sigma;
    let (sin, cos) = orientation.sin_cos();
    let mut histograms: Histograms = [[0.0; BINS]; SIDE * SIDE];
    // Half the side of the turned square of all samples that reach a cell.
    let half = 0.5 * (CELLS + 1) as f32 * cell;
    let radius = half * (sin.abs() + cos.abs());
    let (top, bottom) = span(place.y, radius, octave.height());
    let (left, right) = span(place.x, radius, octave.width());
    let weight = |offset: f32| (-0.5 * (offset / (0.5 * CELLS as f32 * cell)).powi(2)).exp();
    let mut across = [0.0; ROW];
    for (x, w) in (left..right).zip(&mut across) {
        *w = weight(x as f32 - place.x);
    }
    let mut polar = Polar::new();
    for y in top..bottom {
        let dy = y as f32 - place.y;
        // |cos dx + sin dy| < half and |cos dy - sin dx| < half.
        let (mut low, mut high) = (-radius, radius);
        for (slope, offset) in [(cos, sin * dy), (-sin, cos * dy)] {
            if slope.abs() > 1e-6 {
                let (a, b) = ((-half - offset) / slope, (half - offset) / slope);
                (low, high) = (low.max(a.min(b)), high.min(a.max(b)));
            }
        }
        let from = ((place.x + low).ceil().max(left as f32)) as usize;
        let to = ((place.x + high).floor() as i64 + 1).clamp(0, right as i64) as usize;
        if from >= to {
            continue;
        }
        polar.read(octave, place.level, y, from, to);
        let down = weight(dy);
        let dx = from as f32 - place.x;
        // Cell k of 1 to 4 is centred at k.
        let middle = 0.5 * (SIDE - 1) as f32;
        let first = [(cos * dx + sin * dy) / cell + middle, (cos * dy - sin * dx) / cell + middle];
        let step = [cos / cell, -sin / cell];
        let n = to - from;
        let (magnitude, angle) = (&polar.magnitude[..n], &polar.angle[..n]);
        spread(&mut histograms, magnitude, angle, &across[from - left..], down, [first, step], orientation);
    }
    let mut vector = [0.0f32; DESCRIPTOR_SIZE];
    let cells = (1..=CELLS).flat_map(|r| (1..=CELLS).map(move |c| SIDE * r + c));
    for (cell, out) in cells.zip(vector.as_chunks_mut::<BINS>().0) {
        *out = histograms[cell];
    }
    quantise(vector)
}

/// Clipped, scaled to a length of 512 and rounded.
fn quantise(mut vector: [f32; DESCRIPTOR_SIZE]) -> Descriptor {
    let norm = |v: &[f32; DESCRIPTOR_SIZE]| v.iter().map(|a| a * a).sum::<f32>().sqrt();
    let most = CLIP * norm(&vector);
    vector.iter_mut().for_each(|a| *a = a.min(most));
    let scale = LENGTH / norm(&vector).max(f32::MIN_POSITIVE);
    vector.map(|a| (a * scale + 0.5) as u8)
}
