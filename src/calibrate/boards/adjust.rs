//! Joint Levenberg-Marquardt of lens, board poses and, when there is one, the laser's line. Each
//! view's pose is eliminated by its own 6x6 Schur complement, so that the work grows with the number
//! of corners and the equations that are left do not grow at all.

use nalgebra::{DMatrix, DVector, Matrix2, Matrix6, SMatrix, SVector, Vector2};

use super::model::{self, GLOBALS, POSE, Prediction, Sheet, State, moved_pose};
use crate::calibrate::freedom::Unknown;
use crate::control::Cancel;
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::linalg::invert_spd;
use crate::geometry::{Camera, Rigid};

const WIDTH: usize = POSE + GLOBALS;
/// Part of an unknown's information that must be left when the poses are eliminated.
const TAKEN_UP: f64 = 1e-9;
type Coupling = SMatrix<f64, POSE, GLOBALS>;

/// A pixel that was seen, with the root of its information.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen {
    pub pixel: Vector2<f64>,
    white: Whitening,
}

/// L^-1 with L L^T a covariance: its first column's lower entry and its diagonal.
#[derive(Debug, Clone, Copy)]
struct Whitening {
    w11: f64,
    w21: f64,
    w22: f64,
}

impl Seen {
    /// `None` when the covariance is not positive definite.
    pub fn new(pixel: Vector2<f64>, covariance: &Matrix2<f64>) -> Option<Self> {
        let l11 = covariance.m11.sqrt();
        let l21 = covariance.m21 / l11;
        let l22 = (covariance.m22 - l21 * l21).sqrt();
        let white = Whitening { w11: 1.0 / l11, w21: -l21 / (l11 * l22), w22: 1.0 / l22 };
        (white.w11 > 0.0 && white.w22 > 0.0 && white.w21.is_finite()).then_some(Self { pixel, white })
    }

    pub fn whiten(&self, v: &Vector2<f64>) -> Vector2<f64> {
        let w = &self.white;
        Vector2::new(w.w11 * v.x, w.w21 * v.x + w.w22 * v.y)
    }
}

/// What is used of one view.
#[derive(Debug, Clone, Default)]
pub(crate) struct ViewData {
    pub corners: Vec<(Vector2<f64>, Seen)>,
    pub spot: Option<Seen>,
}

/// Something known beforehand: row . parameters ~ N(value, 1).
#[derive(Debug, Clone)]
pub(crate) struct Prior {
    pub row: [f64; GLOBALS],
    pub value: f64,
}

/// How residuals count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Loss {
    Squares,
    /// c^2 ln(1 + d^2 / c^2) of the whitened distance d (Cauchy): gross errors hardly pull.
    Cauchy(f64),
}

impl Loss {
    /// Value and weight at a squared distance.
    fn at(self, d2: f64) -> (f64, f64) {
        match self {
            Self::Squares => (d2, 1.0),
            Self::Cauchy(c) => {
                let c2 = c * c;
                (c2 * (d2 / c2).ln_1p(), 1.0 / (1.0 + d2 / c2))
            }
        }
    }
}

/// When an adjustment ends.
#[derive(Debug, Clone)]
pub(crate) struct Stop<'a> {
    pub max_iterations: usize,
    /// Squared length of a step in units of the estimates' own noise below which it is done.
    pub step: f64,
    pub cancel: &'a Cancel,
}

/// A least-squares problem.
pub(crate) struct Problem<'a> {
    pub views: &'a [ViewData],
    pub unknowns: &'a [Unknown],
    pub priors: &'a [Prior],
    pub sheet: Sheet,
    pub loss: Loss,
}

/// One view's part of the normal equations.
#[derive(Clone)]
struct Block {
    /// Of the pose.
    h: Matrix6<f64>,
    g: SVector<f64, POSE>,
    /// Pose by shared unknowns.
    coupling: Coupling,
}

#[derive(Clone)]
struct System {
    h: [[f64; GLOBALS]; GLOBALS],
    g: [f64; GLOBALS],
    blocks: Vec<Block>,
    cost: f64,
    chi2: f64,
}

pub(crate) struct Adjusted {
    pub state: State,
    /// Whitened squares of the residuals, priors not counted.
    pub chi2: f64,
    pub cost: f64,
    pub iterations: usize,
    system: System,
}

impl Problem<'_> {
    /// Minimises from `state` on.
    ///
    /// # Errors
    /// `NoConvergence`, `Cancelled`.
    pub fn adjust(&self, state: State, stop: &Stop<'_>) -> Result<Adjusted> {
        let mut state = state;
        let mut system = System::new(self.views.len());
        self.linearise(&state, &mut system)
            .ok_or_else(|| no_convergence(0, "a board is behind the first estimate of the camera"))?;
        let mut spare = system.clone();
        let (mut damping, mut converged, mut iterations) = (1e-4, false, 0);
        while iterations < stop.max_iterations && !converged {
            stop.cancel.check()?;
            iterations += 1;
            let next = self.step(&system, &state, damping).and_then(|(next, size)| {
                self.linearise(&next, &mut spare)?;
                (spare.cost <= system.cost * (1.0 + 1e-12)).then_some((next, size))
            });
            if let Some((next, size)) = next {
                let gain = system.cost - spare.cost;
                converged =
                    (size < stop.step && damping < 1.0) || (gain <= 1e-14 * (1e-12 + system.cost) && damping < 1e-2);
                state = next;
                std::mem::swap(&mut system, &mut spare);
                damping = (damping * 0.1).max(1e-12);
            } else {
                damping *= 10.0;
                if damping > 1e12 {
                    // No downhill step of any length: at the minimum to rounding.
                    converged = system.gradient() <= 1e-3;
                    break;
                }
            }
        }
        if !converged {
            return Err(no_convergence(iterations, &format!("cost {:.6e}, damping {damping:.1e}", system.cost)));
        }
        Ok(Adjusted { state, chi2: system.chi2, cost: system.cost, iterations, system })
    }

    /// Normal equations at a state; `None` when something cannot be projected.
    fn linearise(&self, state: &State, system: &mut System) -> Option<()> {
        system.clear();
        for ((view, pose), block) in self.views.iter().zip(&state.poses).zip(&mut system.blocks) {
            let mut sum = ViewSum::new();
            let camera = Camera { pose: *pose, ..state.camera };
            for (at, seen) in &view.corners {
                sum.add(&model::corner(&camera, &self.sheet, &state.bend, at)?, seen, self);
            }
            if let Some(seen) = &view.spot {
                sum.add(&model::spot(state, &self.sheet, pose)?, seen, self);
            }
            sum.add_to(block, &mut system.h, &mut system.g, self.unknowns.len());
            system.cost += sum.cost;
            system.chi2 += sum.chi2;
        }
        let now = state.globals();
        for prior in self.priors {
            let dot = |row: &[f64; GLOBALS]| row.iter().zip(&now).map(|(a, b)| a * b).sum::<f64>();
            let residual = prior.value - dot(&prior.row);
            system.cost += residual * residual;
            for (a, u) in self.unknowns.iter().enumerate() {
                let by_a = u.derivative(&prior.row);
                system.g[a] += by_a * residual;
                for (b, w) in self.unknowns.iter().enumerate().skip(a) {
                    system.h[a][b] += by_a * w.derivative(&prior.row);
                }
            }
        }
        system.cost.is_finite().then_some(())
    }

    /// The damped step's state, and the step's squared length in the metric of the normal equations.
    fn step(&self, system: &System, state: &State, damping: f64) -> Option<(State, f64)> {
        let n = self.unknowns.len();
        let mut h = system.shared(n);
        for i in 0..n {
            h[(i, i)] *= 1.0 + damping;
        }
        let mut g = DVector::from_column_slice(&system.g[..n]);
        // Per view V^-1 [W | g], V damped like the rest.
        let mut solved = Vec::with_capacity(system.blocks.len());
        for block in &system.blocks {
            let mut v = block.h;
            for i in 0..POSE {
                v[(i, i)] *= 1.0 + damping;
            }
            let v = v.cholesky()?;
            let (gain, own) = (v.solve(&block.coupling), v.solve(&block.g));
            for a in 0..n {
                let w = block.coupling.column(a);
                g[a] -= w.dot(&own);
                for b in a..n {
                    h[(a, b)] -= w.dot(&gain.column(b));
                }
            }
            solved.push((gain, own));
        }
        let step = solve_upper(&h, &g)?;
        let mut change = [0.0; GLOBALS];
        for (unknown, s) in self.unknowns.iter().zip(step.iter()) {
            change[unknown.parameter] += s;
            if let Some(tied) = unknown.tied {
                change[tied] += s;
            }
        }
        let mut size: f64 = system.g[..n].iter().zip(step.iter()).map(|(g, s)| g * s).sum();
        let mut next = state.moved(&change)?;
        for (((gain, own), block), pose) in solved.iter().zip(&system.blocks).zip(&mut next.poses) {
            let mut turn = *own;
            for (a, s) in step.iter().enumerate() {
                turn -= gain.column(a) * *s;
            }
            size += block.g.dot(&turn);
            *pose = moved_pose(pose, &turn.into())?;
        }
        size.is_finite().then_some((next, size))
    }
}

impl System {
    fn new(views: usize) -> Self {
        let block = Block { h: Matrix6::zeros(), g: SVector::zeros(), coupling: Coupling::zeros() };
        Self { h: [[0.0; GLOBALS]; GLOBALS], g: [0.0; GLOBALS], blocks: vec![block; views], cost: 0.0, chi2: 0.0 }
    }

    fn clear(&mut self) {
        self.h = [[0.0; GLOBALS]; GLOBALS];
        self.g = [0.0; GLOBALS];
        (self.cost, self.chi2) = (0.0, 0.0);
    }

    /// The shared unknowns' own block, upper triangle.
    fn shared(&self, n: usize) -> DMatrix<f64> {
        DMatrix::from_fn(n, n, |a, b| self.h[a.min(b)][a.max(b)])
    }

    /// The gradient's length in units of the parameters' own noise.
    fn gradient(&self) -> f64 {
        let own = |g: f64, h: f64| if h > 0.0 { g * g / h } else { 0.0 };
        let shared: f64 = (0..GLOBALS).map(|i| own(self.g[i], self.h[i][i])).sum();
        let poses: f64 = self.blocks.iter().map(|b| (0..POSE).map(|i| own(b.g[i], b.h[(i, i)])).sum::<f64>()).sum();
        (shared + poses).sqrt()
    }
}

/// Sums over the observations of one view: first the pose, then the shared unknowns.
struct ViewSum {
    h: [[f64; WIDTH]; WIDTH],
    g: [f64; WIDTH],
    cost: f64,
    chi2: f64,
}

impl ViewSum {
    fn new() -> Self {
        Self { h: [[0.0; WIDTH]; WIDTH], g: [0.0; WIDTH], cost: 0.0, chi2: 0.0 }
    }

    fn add(&mut self, p: &Prediction, seen: &Seen, problem: &Problem<'_>) {
        let r = seen.whiten(&(seen.pixel - p.pixel));
        let d2 = r.norm_squared();
        let (value, weight) = problem.loss.at(d2);
        self.chi2 += d2;
        self.cost += value;
        let m = POSE + problem.unknowns.len();
        let (mut x, mut y) = ([0.0; WIDTH], [0.0; WIDTH]);
        for (i, by) in p.by_pose.iter().enumerate() {
            let white = seen.whiten(by);
            (x[i], y[i]) = (white.x, white.y);
        }
        for (i, unknown) in problem.unknowns.iter().enumerate() {
            let white = seen.whiten(&unknown.derivative(&p.by_globals));
            (x[POSE + i], y[POSE + i]) = (white.x, white.y);
        }
        for a in 0..m {
            let (wx, wy) = (weight * x[a], weight * y[a]);
            self.g[a] += wx * r.x + wy * r.y;
            for ((h, x), y) in self.h[a][a..m].iter_mut().zip(&x[a..m]).zip(&y[a..m]) {
                *h += wx * x + wy * y;
            }
        }
    }

    fn add_to(&self, block: &mut Block, h: &mut [[f64; GLOBALS]; GLOBALS], g: &mut [f64; GLOBALS], n: usize) {
        block.h = Matrix6::from_fn(|a, b| self.h[a.min(b)][a.max(b)]);
        block.g = SVector::from_fn(|a, _| self.g[a]);
        block.coupling = Coupling::from_fn(|a, b| self.h[a][POSE + b]);
        for (a, (h, g)) in h.iter_mut().zip(g.iter_mut()).enumerate().take(n) {
            *g += self.g[POSE + a];
            h.iter_mut().zip(&self.h[POSE + a][POSE..]).skip(a).for_each(|(h, own)| *h += own);
        }
    }
}

/// H x = g for the upper triangle of H, scaled to unit diagonal.
fn solve_upper(h: &DMatrix<f64>, g: &DVector<f64>) -> Option<DVector<f64>> {
    let n = g.len();
    if (0..n).any(|i| h[(i, i)].is_nan() || h[(i, i)] <= 0.0) {
        return None;
    }
    let scale = DVector::from_fn(n, |i, _| 1.0 / h[(i, i)].sqrt());
    let scaled = DMatrix::from_fn(n, n, |i, j| h[(i.min(j), i.max(j))] * scale[i] * scale[j]);
    let y = nalgebra::Cholesky::new(scaled)?.solve(&g.component_mul(&scale));
    let step = y.component_mul(&scale);
    step.iter().all(|v| v.is_finite()).then_some(step)
}

fn no_convergence(iterations: usize, detail: &str) -> Error {
    Error::NoConvergence { iterations, detail: detail.into() }
}

/// The inverse of the normal equations, by parts.
pub(crate) struct Covariance {
    /// Of all shared parameters; rows of those that are not free are zero.
    pub globals: DMatrix<f64>,
    /// Of each view's pose.
    pub poses: Vec<Matrix6<f64>>,
    /// Condition number of the equations without the poses, at unit diagonal.
    pub condition: f64,
}

impl Adjusted {
    /// # Errors
    /// `Degenerate` when the normal equations are singular.
    pub fn covariance(&self, unknowns: &[Unknown]) -> Result<Covariance> {
        let singular = || Error::degenerate(Degeneracy::IllConditioned, "the normal equations are singular");
        let n = unknowns.len();
        let mut h = self.system.shared(n);
        let mut parts = Vec::with_capacity(self.system.blocks.len());
        let mut pose_condition = 1.0f64;
        for block in &self.system.blocks {
            let (inverse, condition) =
                invert_spd(&DMatrix::from_column_slice(POSE, POSE, block.h.as_slice())).ok_or_else(singular)?;
            pose_condition = pose_condition.max(condition);
            // W^T V^-1 W by half, so that what is left of an unknown that the poses take up is nothing.
            let l = block.h.cholesky().ok_or_else(singular)?.unpack();
            let half = l.solve_lower_triangular(&block.coupling).ok_or_else(singular)?;
            let gain = l.tr_solve_lower_triangular(&half).ok_or_else(singular)?;
            for a in 0..n {
                for b in 0..n {
                    h[(a, b)] -= half.column(a).dot(&half.column(b));
                }
            }
            parts.push((Matrix6::from_column_slice(inverse.as_slice()), gain));
        }
        // The rest would be rounding, which looks like a small but sound number when data are exact.
        if (0..n).any(|i| h[(i, i)] <= TAKEN_UP * self.system.h[i][i]) {
            return Err(singular());
        }
        let (shared, condition) =
            if n > 0 { invert_spd(&h).ok_or_else(singular)? } else { (DMatrix::zeros(0, 0), pose_condition) };
        let spread = DMatrix::from_fn(GLOBALS, n, |i, j| f64::from(unknowns[j].moves(i)));
        let poses = parts
            .iter()
            .map(|(inverse, gain)| {
                let gain = gain.columns(0, n);
                let follow = gain * &shared * gain.transpose();
                inverse + Matrix6::from_fn(|i, j| 0.5 * (follow[(i, j)] + follow[(j, i)]))
            })
            .collect();
        Ok(Covariance { globals: &spread * shared * spread.transpose(), poses, condition })
    }
}

/// Squared whitened distance of a corner from its prediction; infinite where there is none.
pub(crate) fn distance2(camera: &Camera, sheet: &Sheet, state: &State, at: &Vector2<f64>, seen: &Seen) -> f64 {
    camera
        .project(&sheet.point(&state.bend, at))
        .map_or(f64::INFINITY, |pixel| seen.whiten(&(seen.pixel - pixel)).norm_squared())
}

/// The pose of one view with the rest as it is.
pub(crate) fn adjust_pose(
    view: &ViewData,
    state: &State,
    pose: Rigid,
    sheet: Sheet,
    loss: Loss,
    stop: &Stop<'_>,
) -> Result<(Rigid, f64)> {
    let problem = Problem { views: std::slice::from_ref(view), unknowns: &[], priors: &[], sheet, loss };
    let adjusted = problem.adjust(State { poses: vec![pose], ..state.clone() }, stop)?;
    Ok((adjusted.state.poses[0], adjusted.cost))
}
