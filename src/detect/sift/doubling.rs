//! The doubled image, blurred, from the image itself: of a filter on pixels half of which are means of
//! their neighbours, half is the same on the neighbours.
//!
//! Sample 2 i of the doubled image is pixel i, sample 2 i + 1 the mean of pixels i and i + 1.

use std::ops::Range;

use super::kernels::{LANES, Lanes, double_columns, double_row};
use super::rows::Rows;
use super::scale_space::{BATCH, MARGIN};

/// Pixels on either side that a sample takes.
pub const RADIUS: usize = 3;

/// Symmetrical filters for what lies on a pixel (centre first) and halfway to the next (nearest first).
#[derive(Debug, Clone, Copy)]
pub struct Doubling {
    pub on: [f32; RADIUS + 1],
    pub between: [f32; RADIUS],
}

impl Doubling {
    /// `weights`: half of a filter of the doubled image, from the centre out to 5 samples at most.
    pub fn new(weights: &[f32]) -> Self {
        debug_assert!(weights.len() <= 2 * RADIUS);
        let k = |i: i64| weights.get(i.unsigned_abs() as usize).copied().unwrap_or(0.0);
        // A mean gives half of its weight to either neighbour.
        let shared = |i: i64| k(i) + 0.5 * (k(i - 1) + k(i + 1));
        Self {
            on: std::array::from_fn(|i| shared(2 * i as i64)),
            between: std::array::from_fn(|i| shared(2 * i as i64 + 1)),
        }
    }
}

/// Rows `ys`, from an even one on and an even number of them, of the doubled image. `size`: of that.
pub fn blur(
    source: &Rows,
    target: &mut Rows,
    filters: &Doubling,
    ys: Range<usize>,
    [width, height]: [usize; 2],
    lines: &mut [f32],
) {
    let (width, height) = (width / 2, height / 2);
    let groups = width.div_ceil(LANES);
    let long = groups * LANES + 2 * MARGIN;
    // Row y + i - RADIUS, where the image ends the last one.
    let mut rows: [&[Lanes]; BATCH / 2 + 2 * RADIUS] = [&[]; BATCH / 2 + 2 * RADIUS];
    let rows = &mut rows[..ys.len() / 2 + 2 * RADIUS];
    for (i, row) in rows.iter_mut().enumerate() {
        let y = (ys.start / 2 + i).saturating_sub(RADIUS).min(height - 1);
        *row = &source.row(y).as_chunks().0[..groups];
    }
    double_columns(lines, long, MARGIN, rows, filters);
    for (_, line) in ys.zip(lines.chunks_exact_mut(long)) {
        let (first, last) = (line[MARGIN], line[MARGIN + width - 1]);
        line[..MARGIN].fill(first);
        line[MARGIN + width..].fill(last);
        double_row(&mut target.push()[..2 * width], &line[MARGIN - RADIUS..], filters);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the doubled image itself, filtered.
    #[test]
    fn a_doubled_image_need_not_be_there() {
        let weights = [0.3, 0.2, 0.1, 0.03, 0.015, 0.005];
        let (width, height) = (70, 9);
        let pixel = |x: usize, y: usize| ((31 * x + 57 * y + x * y) % 97) as f32;
        let mut source = Rows::new(LANES * 2, height);
        for y in 0..height {
            source.push()[..width].iter_mut().enumerate().for_each(|(x, p)| *p = pixel(x, y));
        }
        let doubled = |x: i64, y: i64| {
            let part = |i: i64, n: usize| {
                let i = i.clamp(0, 2 * n as i64 - 1) as usize;
                (i / 2, i.div_ceil(2).min(n - 1))
            };
            let ((x0, x1), (y0, y1)) = (part(x, width), part(y, height));
            0.25 * (pixel(x0, y0) + pixel(x1, y0) + pixel(x0, y1) + pixel(x1, y1))
        };
        let mut target = Rows::new(LANES * 3, 2 * height);
        let mut lines = vec![0.0; BATCH * (2 * LANES + 2 * MARGIN)];
        for from in (0..2 * height).step_by(BATCH) {
            let ys = from..(from + BATCH).min(2 * height);
            blur(&source, &mut target, &Doubling::new(&weights), ys, [2 * width, 2 * height], &mut lines);
        }
        for y in 0..2 * height as i64 {
            for x in 0..2 * width as i64 {
                let k = |i: i64| weights[i.unsigned_abs() as usize];
                let wanted: f32 = (-5..6)
                    .flat_map(|dy| (-5..6).map(move |dx| (dx, dy)))
                    .map(|(dx, dy)| k(dx) * k(dy) * doubled(x + dx, y + dy))
                    .sum();
                let found = target.row(y as usize)[x as usize];
                assert!((found - wanted).abs() < 1e-4, "{found} {wanted} at {x} {y}");
            }
        }
    }
}
