//! Sums of outer products of many rows, gathered in panels so that matrix products do the work.

use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Mat, MatRef, Par};

const PANEL: usize = 256;

/// The lower triangle of sum row^T row. One thread, fixed order: the same input gives the same bits.
pub(super) struct Gram {
    width: usize,
    panel: Vec<f64>,
    sum: Mat<f64>,
}

impl Gram {
    pub fn new(width: usize) -> Self {
        Self { width, panel: Vec::with_capacity(PANEL * width), sum: Mat::zeros(width, width) }
    }

    /// A new row of zeros to fill.
    pub fn row(&mut self) -> &mut [f64] {
        if self.panel.len() == PANEL * self.width {
            self.flush();
        }
        let start = self.panel.len();
        self.panel.resize(start + self.width, 0.0);
        &mut self.panel[start..]
    }

    fn flush(&mut self) {
        let rows = self.panel.len().checked_div(self.width).unwrap_or(0);
        if rows > 0 {
            let panel = MatRef::from_row_major_slice(&self.panel, rows, self.width);
            matmul(
                self.sum.as_mut(),
                BlockStructure::TriangularLower,
                Accum::Add,
                panel.transpose(),
                BlockStructure::Rectangular,
                panel,
                BlockStructure::Rectangular,
                1.0,
                Par::Seq,
            );
        }
        self.panel.clear();
    }

    /// The sum; only its lower triangle counts.
    pub fn finish(&mut self) -> MatRef<'_, f64> {
        self.flush();
        self.sum.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equals_the_sum_of_outer_products() {
        let mut gram = Gram::new(5);
        let row = |k: usize| -> Vec<f64> { (0..5).map(|i| ((k * 7 + i * 3) % 11) as f64 - 4.0).collect() };
        for k in 0..600 {
            gram.row().copy_from_slice(&row(k));
        }
        let sum = gram.finish();
        for i in 0..5 {
            for j in 0..=i {
                let wanted: f64 = (0..600).map(|k| row(k)[i] * row(k)[j]).sum();
                assert!((sum[(i, j)] - wanted).abs() < 1e-9);
            }
        }
        assert_eq!(Gram::new(0).finish().nrows(), 0);
    }
}
