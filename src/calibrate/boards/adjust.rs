//! Joint Levenberg-Marquardt of lens, board poses and, when there is one, the laser's line. Each
//! view's pose is eliminated by its own 6x6 Schur complement, so that the work grows with the number
//! of corners and the equations that are left do not grow at all.

use nalgebra::{DMatrix, DVector, Matrix2, Matrix6, SMatrix, SVector, Vector2};

use super::model::{self, GLOBALS, POSE, Sheet, State, moved_pose};
use super::view_sum::ViewSum;
use crate::calibrate::block::{LANES, Points};
use crate::calibrate::freedom::Unknown;
use crate::control::Cancel;
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::Rigid;
use crate::geometry::linalg::invert_spd;

/// Part of an unknown's information that must be left when poses and other unknowns are eliminated.
const TAKEN_UP: f64 = 1e-9;
/// Damping of a first step from afar, which is the least after one that failed, and from near by.
pub(super) const CAUTIOUS: f64 = 1e-4;
pub(super) const CONFIDENT: f64 = 1e-7;
/// As good as no damping of what is determined at all.
const UNDAMPED: f64 = 1e-9;
/// Steps that shorten this much (squared) go on to do so: the next one's length is told without it.
const FAST: f64 = 1e-2;
pub(super) type Coupling = SMatrix<f64, POSE, GLOBALS>;

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

    pub fn whitening(&self) -> Matrix2<f64> {
        let w = &self.white;
        Matrix2::new(w.w11, 0.0, w.w21, w.w22)
    }

    pub fn whiten(&self, v: &Vector2<f64>) -> Vector2<f64> {
        let w = &self.white;
        Vector2::new(w.w11 * v.x, w.w21 * v.x + w.w22 * v.y)
    }
}

/// What is used of one view.
#[derive(Clone, Default)]
pub(crate) struct ViewData {
    /// Places of the corners on the board.
    pub at: Vec<Vector2<f64>>,
    /// The corners of a flat board, a block at a time.
    pub blocks: Vec<Points>,
    pub spot: Option<Seen>,
}

impl ViewData {
    pub fn add(&mut self, at: &Vector2<f64>, seen: &Seen) {
        let (lane, point) = (self.at.len() % LANES, at.push(0.0).push(1.0));
        if lane == 0 {
            self.blocks.push(Points::all_at(&point, &seen.pixel));
        }
        if let Some(block) = self.blocks.last_mut() {
            block.set(lane, &point, &seen.pixel, &seen.whitening());
        }
        self.at.push(*at);
    }
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
    pub fn at(self, d2: f64) -> (f64, f64) {
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
    /// Damping of the first step of an adjustment that begins.
    pub damping: f64,
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
pub(super) struct PoseBlock {
    /// Of the pose.
    pub h: Matrix6<f64>,
    pub g: SVector<f64, POSE>,
    /// Pose by shared unknowns.
    pub coupling: Coupling,
}

/// Of the observations, and what the priors add.
#[derive(Clone)]
struct System {
    /// The upper triangle counts.
    h: Square,
    g: [f64; GLOBALS],
    blocks: Vec<PoseBlock>,
    data_cost: f64,
    chi2: f64,
    priors: PriorSum,
}

type Square = [[f64; GLOBALS]; GLOBALS];

#[derive(Clone)]
struct PriorSum {
    h: Square,
    g: [f64; GLOBALS],
    cost: f64,
}

impl PriorSum {
    const NONE: Self = Self { h: [[0.0; GLOBALS]; GLOBALS], g: [0.0; GLOBALS], cost: 0.0 };
}

/// An adjustment that can be gone on with.
pub(crate) struct Adjusted {
    pub state: State,
    pub iterations: usize,
    system: Option<System>,
    /// The linearisation is of the state before a last step of this squared length (0: of this one),
    slack: f64,
    /// after which one of this squared length may be left.
    left: f64,
    /// Squared length of the last step but that one; 0 after none.
    before: f64,
    damping: f64,
}

impl Problem<'_> {
    /// Minimises from `state` on.
    ///
    /// # Errors
    /// `NoConvergence`, `Cancelled`.
    pub fn adjust(&self, state: State, stop: &Stop<'_>) -> Result<Adjusted> {
        let mut adjusted = Adjusted::new(state, stop.damping);
        self.go_on(&mut adjusted, stop)?;
        Ok(adjusted)
    }

    /// # Errors
    /// `NoConvergence`, `Cancelled`.
    pub fn go_on(&self, a: &mut Adjusted, stop: &Stop<'_>) -> Result<()> {
        let left = a.left;
        let mut system = match a.system.take().filter(|_| left < stop.step) {
            Some(mut system) => {
                // Those that scale with the focal length may be others now.
                system.priors = self.priors_at(&a.state);
                system
            }
            None => {
                (a.before, a.slack) = (a.slack, 0.0);
                let mut system = System::new(self.views.len());
                self.linearise(&a.state, &mut system)
                    .ok_or_else(|| no_convergence(0, "a board is behind the first estimate of the camera"))?;
                system
            }
        };
        let mut spare = System::new(self.views.len());
        let (mut converged, mut iterations) = (false, 0);
        while iterations < stop.max_iterations && !converged {
            stop.cancel.check()?;
            iterations += 1;
            let before = a.before;
            let left = |size: f64| if size < FAST * before.min(1.0) { 2.0 * size * size / before } else { size };
            let next = self.step(&system, &a.state, a.damping);
            // Damping shortens steps along what is hardly determined: without it the step must be short too.
            if next.as_ref().is_some_and(|next| left(next.size) < stop.step)
                && let Some(last) = self.step(&system, &a.state, a.damping.min(UNDAMPED))
                && left(last.size) < stop.step
            {
                // Too short for the equations to be others after it.
                system.advance(&last.shared, last.size);
                (a.state, a.left, a.slack) = (last.state, left(last.size), last.size);
                converged = true;
                break;
            }
            let next = next.and_then(|next| {
                self.linearise(&next.state, &mut spare)?;
                (spare.cost() <= system.cost() * (1.0 + 1e-12) + a.slack).then_some(next)
            });
            if let Some(next) = next {
                let gain = system.cost() - spare.cost();
                converged = gain <= 1e-14 * (1e-12 + system.cost()) && a.damping < 1e-2;
                (a.state, a.before, a.slack) = (next.state, next.size, 0.0);
                std::mem::swap(&mut system, &mut spare);
                a.damping = (a.damping * 0.1).max(1e-12);
            } else {
                a.before = 0.0;
                a.damping = (a.damping * 10.0).max(CAUTIOUS);
                if a.damping > 1e12 {
                    // No downhill step of any length: at the minimum to rounding.
                    converged = system.gradient() <= 1e-3;
                    a.damping = CAUTIOUS;
                    break;
                }
            }
        }
        a.iterations += iterations;
        let cost = system.cost();
        a.system = Some(system);
        if converged {
            Ok(())
        } else {
            Err(no_convergence(iterations, &format!("cost {cost:.6e}, damping {:.1e}", a.damping)))
        }
    }

    /// Normal equations at a state; `None` when something cannot be projected.
    fn linearise(&self, state: &State, system: &mut System) -> Option<()> {
        system.clear();
        let mut sum = ViewSum::new(self);
        for ((view, pose), block) in self.views.iter().zip(&state.poses).zip(&mut system.blocks) {
            sum.clear();
            for (points, at) in view.blocks.iter().zip(view.at.chunks(LANES)) {
                sum.add_corners(points, at, state, pose)?;
            }
            if let Some(seen) = &view.spot {
                sum.add_spot(&model::spot(state, &self.sheet, pose)?, seen);
            }
            sum.add_to(block, &mut system.h, &mut system.g);
            system.data_cost += sum.cost;
            system.chi2 += sum.chi2;
        }
        system.priors = self.priors_at(state);
        system.cost().is_finite().then_some(())
    }

    fn priors_at(&self, state: &State) -> PriorSum {
        let now = state.globals();
        let mut sum = PriorSum::NONE;
        for prior in self.priors {
            let residual = prior.value - prior.row.iter().zip(&now).map(|(a, b)| a * b).sum::<f64>();
            sum.cost += residual * residual;
            for (a, u) in self.unknowns.iter().enumerate() {
                let by_a = u.derivative(&prior.row);
                sum.g[a] += by_a * residual;
                for (b, w) in self.unknowns.iter().enumerate().skip(a) {
                    sum.h[a][b] += by_a * w.derivative(&prior.row);
                }
            }
        }
        sum
    }

    fn step(&self, system: &System, state: &State, damping: f64) -> Option<Step> {
        let n = self.unknowns.len();
        let mut h = system.shared(n);
        for i in 0..n {
            h[(i, i)] *= 1.0 + damping;
        }
        let whole = DVector::from_fn(n, |i, _| system.g[i] + system.priors.g[i]);
        let mut g = whole.clone();
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
        let mut size = whole.dot(&step);
        let mut next = state.moved(&change)?;
        for (((gain, own), block), pose) in solved.iter().zip(&system.blocks).zip(&mut next.poses) {
            let mut turn = *own;
            for (a, s) in step.iter().enumerate() {
                turn -= gain.column(a) * *s;
            }
            size += block.g.dot(&turn);
            *pose = moved_pose(pose, &turn.into())?;
        }
        size.is_finite().then_some(Step { shared: step, state: next, size })
    }
}

/// A damped step.
struct Step {
    shared: DVector<f64>,
    state: State,
    /// Squared length in the metric of the normal equations.
    size: f64,
}

impl System {
    fn new(views: usize) -> Self {
        let block = PoseBlock { h: Matrix6::zeros(), g: SVector::zeros(), coupling: Coupling::zeros() };
        let PriorSum { h, g, .. } = PriorSum::NONE;
        Self { h, g, blocks: vec![block; views], data_cost: 0.0, chi2: 0.0, priors: PriorSum::NONE }
    }

    fn clear(&mut self) {
        PriorSum { h: self.h, g: self.g, .. } = PriorSum::NONE;
        (self.data_cost, self.chi2) = (0.0, 0.0);
    }

    fn cost(&self) -> f64 {
        self.data_cost + self.priors.cost
    }

    /// What the linearisation says of itself after an undamped step, which leaves no gradient.
    fn advance(&mut self, step: &DVector<f64>, size: f64) {
        let n = step.len();
        let priors = &mut self.priors;
        let mut prior_change = 0.0;
        for a in 0..n {
            let moved: f64 = (0..n).map(|b| priors.h[a.min(b)][a.max(b)] * step[b]).sum();
            prior_change += (moved - 2.0 * priors.g[a]) * step[a];
            priors.g[a] -= moved;
            self.g[a] = -priors.g[a];
        }
        priors.cost += prior_change;
        self.data_cost -= size + prior_change;
        self.chi2 -= size + prior_change;
        self.blocks.iter_mut().for_each(|block| block.g = SVector::zeros());
    }

    /// All whitenings by `by`.
    fn scale(&mut self, by: f64) {
        let squared = by * by;
        self.h.iter_mut().flatten().chain(&mut self.g).for_each(|x| *x *= squared);
        for block in &mut self.blocks {
            block.h *= squared;
            block.g *= squared;
            block.coupling *= squared;
        }
        self.data_cost *= squared;
        self.chi2 *= squared;
    }

    /// The shared unknowns' own block, upper triangle.
    fn shared(&self, n: usize) -> DMatrix<f64> {
        DMatrix::from_fn(n, n, |a, b| self.h[a.min(b)][a.max(b)] + self.priors.h[a.min(b)][a.max(b)])
    }

    /// The gradient's length in units of the parameters' own noise.
    fn gradient(&self) -> f64 {
        let own = |g: f64, h: f64| if h > 0.0 { g * g / h } else { 0.0 };
        let p = &self.priors;
        let shared: f64 = (0..GLOBALS).map(|i| own(self.g[i] + p.g[i], self.h[i][i] + p.h[i][i])).sum();
        let poses: f64 = self.blocks.iter().map(|b| (0..POSE).map(|i| own(b.g[i], b.h[(i, i)])).sum::<f64>()).sum();
        (shared + poses).sqrt()
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
    fn new(state: State, damping: f64) -> Self {
        Self { state, iterations: 0, system: None, slack: 0.0, left: f64::INFINITY, before: 0.0, damping }
    }

    /// Where all noises are now this many times smaller.
    pub fn scale(&mut self, by: f64) {
        if let Some(system) = &mut self.system {
            system.scale(by);
        }
        // Lengths are in units of the noise.
        [&mut self.left, &mut self.slack, &mut self.before].into_iter().for_each(|size| *size *= by * by);
    }

    /// Whitened squares of the residuals, priors not counted.
    pub fn chi2(&self) -> f64 {
        self.system.as_ref().map_or(f64::INFINITY, |system| system.chi2)
    }

    fn cost(&self) -> f64 {
        self.system.as_ref().map_or(f64::INFINITY, System::cost)
    }

    /// # Errors
    /// `Degenerate` when the normal equations are singular.
    pub fn covariance(&self, unknowns: &[Unknown]) -> Result<Covariance> {
        let singular = || Error::degenerate(Degeneracy::IllConditioned, "the normal equations are singular");
        let n = unknowns.len();
        let system = self.system.as_ref().ok_or_else(singular)?;
        let mut h = system.shared(n);
        let mut parts = Vec::with_capacity(system.blocks.len());
        let mut pose_condition = 1.0f64;
        for block in &system.blocks {
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
        let (shared, condition) =
            if n > 0 { invert_spd(&h).ok_or_else(singular)? } else { (DMatrix::zeros(0, 0), pose_condition) };
        // The rest would be rounding, which looks like a small but sound number when data are exact: what the poses
        // leave of an unknown's information, and what the other unknowns leave of it.
        let own = |i: usize| TAKEN_UP * (system.h[i][i] + system.priors.h[i][i]);
        if (0..n).any(|i| h[(i, i)] <= own(i) || shared[(i, i)] * own(i) >= 1.0) {
            return Err(singular());
        }
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
    Ok((adjusted.state.poses[0], adjusted.cost()))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::geometry::rig_model::LaserLine;
    use crate::geometry::rigid::exp;
    use crate::geometry::{Camera, Distortion, Intrinsics};

    /// Of corners and a spot, by every unknown, squares and robust.
    #[test]
    fn the_gradient_is_that_of_the_cost() {
        let camera = Camera {
            width: 720,
            height: 576,
            intrinsics: Intrinsics { fx: 800.0, fy: 795.0, skew: 0.7, cx: 360.0, cy: 288.0 },
            distortion: Distortion::BrownConrady([-0.2, 0.05, 0.001, -0.002, 0.01]),
            pose: Rigid::identity(),
        };
        let pose = Rigid { rotation: exp(&Vector3::new(0.4, -0.5, 0.2)), translation: Vector3::new(0.1, -0.05, 2.0) };
        let state = State {
            camera,
            bend: Vector3::new(0.004, -0.003, 0.002),
            laser: LaserLine { x0: 0.1, y0: 0.005, vx: -0.005, vy: 0.003 },
            poses: vec![pose],
        };
        let seen = |x: f64, y: f64| Seen::new(Vector2::new(x, y), &Matrix2::new(0.5, 0.1, 0.1, 0.3)).unwrap();
        let corner = |i: usize| {
            let at = Vector2::new((i % 7) as f64 * 0.05 - 0.15, (i / 7) as f64 * 0.05 - 0.15);
            let pixel = Camera { pose, ..camera }.project(&at.push(0.001)).unwrap();
            (at, seen(pixel.x + (i % 3) as f64, pixel.y - (i % 5) as f64))
        };
        let mut view = ViewData { spot: Some(seen(380.0, 290.0)), ..ViewData::default() };
        (0..45).map(corner).for_each(|(at, seen)| view.add(&at, &seen));
        let views = [view];
        let unknowns: Vec<Unknown> = (0..GLOBALS).map(|parameter| Unknown { parameter, tied: None }).collect();
        for loss in [Loss::Squares, Loss::Cauchy(3.0)] {
            let sheet = Sheet { centre: Vector2::new(0.02, -0.01), scale: 0.3 };
            let problem = Problem { views: &views, unknowns: &unknowns, priors: &[], sheet, loss };
            let at = |state: &State| {
                let mut system = System::new(1);
                problem.linearise(state, &mut system).unwrap();
                system
            };
            let system = at(&state);
            let check = |name: &str, i: usize, g: f64, information: f64, moved: &dyn Fn(f64) -> State| {
                // A thousandth of what the parameter alone would be known to.
                let h = 1e-3 / information.sqrt();
                let numeric = (at(&moved(h)).cost() - at(&moved(-h)).cost()) / (2.0 * h);
                assert!((numeric + 2.0 * g).abs() < 1e-5 * information.sqrt() * system.cost().sqrt(), "{name} {i}");
            };
            for i in 0..GLOBALS {
                check("shared", i, system.g[i], system.h[i][i], &|h| {
                    let mut change = [0.0; GLOBALS];
                    change[i] = h;
                    state.moved(&change).unwrap()
                });
            }
            for i in 0..POSE {
                check("pose", i, system.blocks[0].g[i], system.blocks[0].h[(i, i)], &|h| {
                    let mut step = [0.0; POSE];
                    step[i] = h;
                    State { poses: vec![moved_pose(&pose, &step).unwrap()], ..state.clone() }
                });
            }
        }
    }
}
