//! One shot's own unknowns: their normal equations, their elimination, and their return.

use nalgebra::{Vector2, Vector3};

use super::gram::Gram;
use super::linearise::ROW;

/// Normal equations of one shot's own unknowns.
pub(super) struct Own {
    count: usize,
    pub information: [[f64; 3]; 3],
    pub gradient: [f64; 3],
    width: usize,
    /// One row an unknown, over the columns of the batch.
    pub coupling: Vec<f64>,
}

impl Own {
    pub fn new(count: usize, width: usize) -> Self {
        Self { count, information: [[0.0; 3]; 3], gradient: [0.0; 3], width, coupling: vec![0.0; count * width] }
    }

    /// Adds two rows; `blocks`: (first in the rows, first in the batch's columns, length).
    pub fn add(
        &mut self,
        by_local: &[Vector2<f64>; 3],
        residual: &Vector2<f64>,
        rows: &[[f64; ROW]; 2],
        blocks: &[(usize, usize, usize)],
    ) {
        for a in 0..self.count {
            let d = &by_local[a];
            self.gradient[a] += d.dot(residual);
            for (information, by) in self.information[a].iter_mut().zip(&by_local[..=a]) {
                *information += d.dot(by);
            }
            let coupling = &mut self.coupling[a * self.width..(a + 1) * self.width];
            for &(from, to, length) in blocks {
                let (r0, r1) = (&rows[0][from..from + length], &rows[1][from..from + length]);
                for ((c, x), y) in coupling[to..to + length].iter_mut().zip(r0).zip(r1) {
                    *c += d.x * x + d.y * y;
                }
            }
        }
    }

    /// Cholesky of the information, and L^-1 applied to gradient and coupling.
    pub fn eliminate(mut self, gram: &mut Gram, batch: usize) -> Option<Eliminated> {
        let mut l = [[0.0; 3]; 3];
        for i in 0..self.count {
            for j in 0..=i {
                let done: f64 = l[i].iter().zip(&l[j]).take(j).map(|(a, b)| a * b).sum();
                let sum = self.information[i][j] - done;
                l[i][j] = if i == j { sum.sqrt() } else { sum / l[j][j] };
            }
            if l[i][i].is_nan() || l[i][i] <= 0.0 {
                return None;
            }
            let (done, rest) = self.coupling.split_at_mut(i * self.width);
            let row = &mut rest[..self.width];
            for (k, factor) in l[i].iter().enumerate().take(i) {
                let earlier = &done[k * self.width..(k + 1) * self.width];
                row.iter_mut().zip(earlier).for_each(|(r, e)| *r -= factor * e);
                self.gradient[i] -= factor * self.gradient[k];
            }
            row.iter_mut().for_each(|r| *r /= l[i][i]);
            self.gradient[i] /= l[i][i];
            let target = gram.row();
            target[..self.width].copy_from_slice(row);
            target[self.width] = self.gradient[i];
        }
        Some(Eliminated { root: l, gradient: self.gradient, coupling: self.coupling, batch })
    }
}

/// What is kept of a shot's own unknowns: with information L L^T, L^-1 gradient and L^-1 coupling.
#[derive(Debug, Clone, Default)]
pub(super) struct Eliminated {
    pub root: [[f64; 3]; 3],
    pub gradient: [f64; 3],
    /// One row an unknown, over the columns of the shot's batch.
    pub coupling: Vec<f64>,
    pub batch: usize,
}

impl Eliminated {
    /// The change of a shot's own unknowns that goes with a step of the columns.
    pub fn back_substitute(&self, columns: &[usize], step: &[f64], count: usize) -> [f64; 3] {
        let width = columns.len();
        let mut change = self.gradient;
        if !self.is_used() {
            return [0.0; 3];
        }
        for (a, c) in change.iter_mut().enumerate().take(count) {
            let row = &self.coupling[a * width..(a + 1) * width];
            *c -= row.iter().zip(columns).map(|(b, i)| b * step[*i]).sum::<f64>();
        }
        self.solve_transposed(&mut change, count);
        change
    }

    /// Was any spot of the shot used?
    pub fn is_used(&self) -> bool {
        self.root[0][0] > 0.0
    }

    /// Columns times L^-T: derivatives by the shot's own unknowns in units of their deviations.
    pub fn by_root(&self, by_local: &[Vector3<f64>; 3], count: usize) -> [Vector3<f64>; 3] {
        let mut x = *by_local;
        for a in 0..count {
            for b in 0..a {
                let done = x[b] * self.root[a][b];
                x[a] -= done;
            }
            x[a] /= self.root[a][a];
        }
        x
    }

    /// x <- L^-T x.
    pub fn solve_transposed(&self, x: &mut [f64; 3], count: usize) {
        for a in (0..count).rev() {
            for b in a + 1..count {
                x[a] -= self.root[b][a] * x[b];
            }
            x[a] /= self.root[a][a];
        }
    }
}
