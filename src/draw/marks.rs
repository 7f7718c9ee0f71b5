//! The marks of each kind of answer, alike in every picture.

use nalgebra::Vector2;

use super::canvas::{Canvas, Colour};

/// Residual arrows are by default this much longer than the residuals.
pub const EXAGGERATION: f64 = 50.0;

const GREEN: Colour = [60, 255, 60];
const YELLOW: Colour = [255, 220, 0];
const RED: Colour = [255, 40, 40];

/// A colour for each of a row of things, far from its neighbours'.
fn hue(index: usize) -> Colour {
    const COLOURS: [Colour; 8] = [
        [255, 80, 80],
        [80, 160, 255],
        [255, 200, 0],
        [120, 230, 120],
        [255, 120, 255],
        [0, 220, 220],
        [255, 150, 60],
        [180, 140, 255],
    ];
    COLOURS[index % COLOURS.len()]
}

/// A chessboard's corners, row by row with `columns` in each: each row a colour, joined in order; the
/// first corner has a ring.
pub fn board(canvas: &mut Canvas, corners: &[Option<Vector2<f64>>], columns: usize) {
    let mut last: Option<Vector2<f64>> = None;
    for (i, corner) in corners.iter().enumerate() {
        let colour = hue(i / columns.max(1));
        if let (Some(from), Some(to)) = (last, corner) {
            canvas.line(from, *to, 1.0, colour);
        }
        last = corner.or(last);
    }
    for (i, corner) in corners.iter().enumerate().filter_map(|(i, c)| Some((i, c.as_ref()?))) {
        canvas.circle(*corner, 4.0, 1.5, hue(i / columns.max(1)));
        if i == 0 {
            canvas.circle(*corner, 8.0, 2.0, hue(0));
        }
    }
}

/// Residuals as arrows from where each point was seen, `scale` times as long; outliers are red rings.
pub fn residuals(canvas: &mut Canvas, seen: &[Vector2<f64>], residuals: &[Vector2<f64>], inliers: &[bool], scale: f64) {
    for ((at, residual), inlier) in seen.iter().zip(residuals).zip(inliers) {
        if *inlier {
            canvas.arrow(*at, at + residual * scale, 1.2, GREEN);
            canvas.disc(*at, 1.5, YELLOW);
        } else {
            canvas.circle(*at, 5.0, 1.5, RED);
        }
    }
}

/// Pairs of points of two pictures that stand side by side (`Canvas::beside`), the second `offset`
/// pixels to the right: kept ones joined by a line, each in a colour of its own; the others red rings.
pub fn matches(canvas: &mut Canvas, left: &[Vector2<f64>], right: &[Vector2<f64>], kept: &[bool], offset: f64) {
    let shift = Vector2::new(offset, 0.0);
    for (i, ((a, b), kept)) in left.iter().zip(right).zip(kept).enumerate() {
        let (a, b) = (*a, b + shift);
        if *kept {
            canvas.line(a, b, 0.8, hue(i));
            canvas.circle(a, 3.0, 1.2, hue(i));
            canvas.circle(b, 3.0, 1.2, hue(i));
        } else {
            canvas.circle(a, 2.0, 0.8, RED);
            canvas.circle(b, 2.0, 0.8, RED);
        }
    }
}
