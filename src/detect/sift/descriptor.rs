//! What a keypoint's surroundings look like: their dominant orientations, and Lowe's descriptor of 4 x 4
//! histograms of 8 orientations, relative to the keypoint's own.

use std::f32::consts::TAU;

use super::scale_space::Octave;
use super::window::{BINS, ORIENTATIONS, SIDE, cells, directions, quantise};
pub use super::window::{DESCRIPTOR_SIZE, Descriptor, Place};

/// The orientation histogram's Gaussian window, in sigmas of the keypoint, and how far it reaches in its own.
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
/// The vector's length.
const LENGTH: f32 = 512.0;

/// The dominant orientations, radians from x towards y, 0 to 2 pi.
pub fn orientations(octave: &Octave, place: &Place, found: &mut Vec<f32>) {
    let window = ORIENTATION_WINDOW * place.sigma;
    let turned = directions(octave, place, window, ORIENTATION_REACH * window);
    // Two bins more on either side.
    let around: [f32; ORIENTATIONS + 4] =
        std::array::from_fn(|i| turned[(i + 3 * ORIENTATIONS / 2 - 2) % ORIENTATIONS]);
    let mut smooth = [0.0f32; ORIENTATIONS];
    for (s, bins) in smooth.iter_mut().zip(around.windows(5)) {
        *s = (bins[0] + bins[4]) * (1.0 / 16.0) + (bins[1] + bins[3]) * (4.0 / 16.0) + bins[2] * (6.0 / 16.0);
    }
    let least = PEAK_SHARE * smooth.iter().copied().fold(0.0, f32::max);
    found.clear();
    for i in 0..ORIENTATIONS {
        let (before, after) = ((i + ORIENTATIONS - 1) % ORIENTATIONS, (i + 1) % ORIENTATIONS);
        let [before, here, after] = [before, i, after].map(|i| smooth[i]);
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
    // Half the side of the turned square of all samples that reach a cell.
    let half = 0.5 * (CELLS + 1) as f32 * cell;
    let histograms = cells(octave, place, orientation, [sin, cos], half, cell, 0.5 * CELLS as f32 * cell);
    let mut vector = [0.0f32; DESCRIPTOR_SIZE];
    let inner = (1..=CELLS).flat_map(|r| (1..=CELLS).map(move |c| SIDE * r + c));
    for (cell, out) in inner.zip(vector.as_chunks_mut::<BINS>().0) {
        *out = histograms[cell];
    }
    quantise(&vector, CLIP, LENGTH)
}
