//! A level of the next octave in the pixels of this one: interpolated with six pixels, to which a blur
//! of two and more of them leaves nothing to err about.

use super::kernels::{LANES, between_rows, raise};
use super::rows::Rows;
use super::scale_space::{NEAR, Octave};

/// Pixels on either side that an interpolation takes.
const TAPS: usize = 3;

pub struct Raised {
    height: usize,
    /// Rows 0, 2, 4, ... and 1, 3, 5, ...
    even: Rows,
    odd: Rows,
    /// A row of the next octave, its ends repeated.
    line: Vec<f32>,
}

impl Raised {
    pub fn new(width: usize, height: usize) -> Self {
        let half = Octave::half(width);
        let stride = (2 * half).next_multiple_of(LANES);
        Self {
            height,
            even: Rows::new(stride, (NEAR + 2 * TAPS + 3).min(Octave::half(height))),
            odd: Rows::new(stride, NEAR + 3),
            line: vec![0.0; half + 2 * TAPS],
        }
    }

    #[inline]
    pub fn row(&self, y: usize) -> &[f32] {
        if y.is_multiple_of(2) { self.even.row(y / 2) } else { self.odd.row(y / 2) }
    }

    /// Rows of the next octave that those before `end` take.
    pub fn needed(end: usize) -> usize {
        end / 2 + TAPS
    }

    /// Works out the rows before `end` from a level of the next octave.
    pub fn advance(&mut self, next: &Octave, level: usize, end: usize) {
        let last = next.height() - 1;
        let end = end.min(self.height);
        while 2 * self.odd.count() + 1 < end || self.even.count() < end.div_ceil(2) {
            let y = self.odd.count();
            while self.even.count() <= (y + TAPS).min(last) {
                let row = next.row(level, self.even.count());
                let (left, inner) = self.line.split_at_mut(TAPS);
                let (inner, right) = inner.split_at_mut(row.len());
                inner.copy_from_slice(row);
                left.fill(row[0]);
                right.fill(row[row.len() - 1]);
                raise(self.even.push(), &self.line);
            }
            let rows = [0, 1, 2, 3, 4, 5].map(|i| self.even.row((y + 1 + i).saturating_sub(TAPS).min(last)));
            between_rows(self.odd.push(), rows);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::scale_space::Input;
    use super::*;

    /// What is as smooth as such a level is: sines of a period of ten of the next octave's pixels.
    #[test]
    fn interpolation_errs_by_less_than_a_thousandth() {
        let (width, height) = (90, 64);
        let wave = |x: f32, y: f32| 100.0 * (0.3 * x + 1.0).sin() * (0.3 * y).cos();
        let half = [width, height].map(Octave::half);
        let mut next = Octave::new(half[0], half[1], Input::Level);
        for y in 0..half[1] {
            next.push(|row| row.iter_mut().enumerate().for_each(|(x, v)| *v = wave(2.0 * x as f32, 2.0 * y as f32)));
        }
        let mut raised = Raised::new(width, height);
        for y in 0..height {
            raised.advance(&next, 0, y + 1);
            // Beyond the border the last pixel is repeated.
            let inside = 2 * TAPS..width - 2 * TAPS;
            for x in inside.filter(|_| (2 * TAPS..height - 2 * TAPS).contains(&y)) {
                let (found, wanted) = (raised.row(y)[x], wave(x as f32, y as f32));
                assert!((found - wanted).abs() < 0.1, "{found} {wanted} at {x} {y}");
            }
        }
    }
}
