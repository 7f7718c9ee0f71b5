//! The normal equations of one view: rows of its corners a block at a time, and of its spot.

use nalgebra::{Matrix6, SVector, Vector2, Vector3};

use super::adjust::{Coupling, Loss, PoseBlock, Problem, Seen};
use super::model::{BEND, GLOBALS, LASER, POSE, Prediction, State};
use crate::calibrate::block::{Block, LANES, POINT, Points, Products, RESIDUAL};
use crate::calibrate::freedom::{ROTATION, Unknown};
use crate::geometry::{Camera, Rigid};

/// Sums over the observations of one view: of the pose's columns, the shared unknowns' and the residual's.
pub(super) struct ViewSum<'a> {
    problem: &'a Problem<'a>,
    rows: Box<Block>,
    products: Products,
    pub cost: f64,
    pub chi2: f64,
}

impl<'a> ViewSum<'a> {
    pub fn new(problem: &'a Problem<'a>) -> Self {
        let products = Products::new(POSE + problem.unknowns.len() + 1);
        Self { problem, rows: Block::new(), products, cost: 0.0, chi2: 0.0 }
    }

    pub fn clear(&mut self) {
        self.products.clear();
        (self.cost, self.chi2) = (0.0, 0.0);
    }

    /// A block of corners, which are at these places on the board.
    pub fn add_corners(&mut self, points: &Points, at: &[Vector2<f64>], state: &State, pose: &Rigid) -> Option<()> {
        let (unknowns, sheet) = (self.problem.unknowns, &self.problem.sheet);
        let camera = Camera { pose: *pose, ..state.camera };
        if state.bend == Vector3::zeros() {
            self.rows.project_points(points, &camera)?;
        } else {
            let mut bent = points.clone();
            for (lane, at) in at.iter().enumerate() {
                bent.move_to(lane, &sheet.point(&state.bend, at).push(1.0));
            }
            self.rows.project_points(&bent, &camera)?;
        }
        let of_pose: [Unknown; POSE] = std::array::from_fn(|i| Unknown { parameter: ROTATION + i, tied: None });
        self.products.take(&self.rows, &of_pose, 0);
        for (k, unknown) in unknowns.iter().enumerate() {
            match unknown.parameter {
                0..BEND => self.products.take(&self.rows, std::slice::from_ref(unknown), POSE + k),
                BEND..LASER => {
                    // A coefficient of the sheet lifts the corner by its monomial.
                    for (to, row) in self.products.column(POSE + k).into_iter().zip(&self.rows.rows) {
                        *to = row[POINT + 2];
                        for (to, at) in to.iter_mut().zip(at) {
                            *to *= sheet.monomials(at)[unknown.parameter - BEND];
                        }
                    }
                }
                _ => self.products.column(POSE + k).into_iter().for_each(|column| column.fill(0.0)),
            }
        }
        for (to, row) in self.products.column(POSE + unknowns.len()).into_iter().zip(&self.rows.rows) {
            *to = row[RESIDUAL];
        }
        let squares = self.rows.squares();
        if self.problem.loss == Loss::Squares {
            let sum: f64 = squares.iter().sum();
            self.chi2 += sum;
            self.cost += sum;
        } else {
            let mut roots = [1.0; LANES];
            for (squared, root) in squares.iter().zip(&mut roots).take(at.len()) {
                *root = self.count(*squared);
            }
            for k in 0..=POSE + unknowns.len() {
                for column in self.products.column(k) {
                    column.iter_mut().zip(&roots).for_each(|(x, root)| *x *= root);
                }
            }
        }
        self.products.add();
        Some(())
    }

    pub fn add_spot(&mut self, p: &Prediction, seen: &Seen) {
        let r = seen.whiten(&(seen.pixel - p.pixel));
        let root = self.count(r.norm_squared());
        let shared = self.problem.unknowns.iter().map(|unknown| seen.whiten(&unknown.derivative(&p.by_globals)));
        let pose = p.by_pose.iter().map(|by| seen.whiten(by));
        for (k, column) in pose.chain(shared).chain([r]).enumerate() {
            for (to, x) in self.products.column(k).into_iter().zip(column.iter()) {
                to.fill(0.0);
                to[0] = root * x;
            }
        }
        self.products.add();
    }

    /// Counts a squared distance; the root of its weight.
    fn count(&mut self, squared: f64) -> f64 {
        let (value, weight) = self.problem.loss.at(squared);
        self.chi2 += squared;
        self.cost += value;
        weight.sqrt()
    }

    pub fn add_to(&self, block: &mut PoseBlock, h: &mut [[f64; GLOBALS]; GLOBALS], g: &mut [f64; GLOBALS]) {
        let n = self.problem.unknowns.len();
        let at = |a: usize, b: usize| self.products.at(a, b);
        block.h = Matrix6::from_fn(|a, b| at(a.min(b), a.max(b)));
        block.g = SVector::from_fn(|a, _| at(a, POSE + n));
        block.coupling = Coupling::from_fn(|a, b| if b < n { at(a, POSE + b) } else { 0.0 });
        for (a, (h, g)) in h.iter_mut().zip(g).enumerate().take(n) {
            *g += at(POSE + a, POSE + n);
            h.iter_mut().enumerate().take(n).skip(a).for_each(|(b, h)| *h += at(POSE + a, POSE + b));
        }
    }
}
