//! Maximum-likelihood refinement: Levenberg-Marquardt on the reprojection error in the distorted
//! image, with one inverse depth per laser shot eliminated by its Schur complement (maths.md 9.3),
//! lines by the distances of their segments' ends, and soft priors on skew and aspect.

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use super::block::{Block, LANES, Lanes, POINT, Products, RESIDUAL};
use super::freedom::{ALL, Freedom, Row, full_jacobian, moved, parameters};
use super::line_measurement::LineMeasurement;
use super::measurement::{Measurement, PointMeasurement};
use crate::control::Cancel;
use crate::error::{Error, Result};
use crate::geometry::Camera;
use crate::geometry::linalg::invert_spd;

/// Squared length of a step, in units of the noise, after which nothing that matters changes.
const CONVERGED: f64 = 1e-10;
/// As good as no damping of what is determined at all.
const UNDAMPED: f64 = 1e-9;

pub(crate) struct Refined {
    pub camera: Camera,
    /// Of all sixteen parameters; zero where not free.
    pub covariance: DMatrix<f64>,
    /// Standard deviation of ln(focal length), priors included.
    pub focal_deviation: f64,
    pub condition: f64,
    /// Sum of squared whitened residuals of pixels and depths.
    pub chi2: f64,
    /// The same with the priors' share.
    pub cost: f64,
    /// Inverse depths of all measurements, those of shots estimated.
    pub rhos: Vec<f64>,
    /// Covariance of the freedom's unknowns.
    pub columns: DMatrix<f64>,
    /// Unit of the priors on skew and aspect, px.
    pub focal: f64,
    pub iterations: usize,
}

/// What the linearisation at one estimate gives.
pub(super) struct System {
    pub h: DMatrix<f64>,
    pub g: DVector<f64>,
    /// Data and priors.
    cost: f64,
    chi2: f64,
    depths: Vec<Depths>,
}

/// Eliminated inverse depths of a block: their information, gradients, and couplings to the unknowns.
struct Depths {
    /// Lanes that have one, with their measurements.
    of: Vec<(usize, usize)>,
    information: Lanes,
    gradient: Lanes,
    coupling: Vec<Lanes>,
}

/// Refines `camera` on `measurements`, whose assumed noises are multiplied by `noise_factor`.
///
/// # Errors
/// `NoConvergence`, `Cancelled`, `Degenerate` when the normal equations are singular.
pub(crate) fn refine(
    measurements: &[Measurement],
    camera: Camera,
    freedom: &Freedom,
    noise_factor: f64,
    max_iterations: usize,
    cancel: &Cancel,
) -> Result<Refined> {
    let focal = camera.intrinsics.fx;
    let weights = whitenings(measurements, &camera, noise_factor)?;
    let mut state = camera;
    let depth = |m: &Measurement| m.as_point().map_or(0.0, |m| m.rho);
    let mut rhos: Vec<f64> = measurements.iter().map(depth).collect();
    let mut system = linearise(measurements, &weights, &state, &rhos, freedom, focal)
        .ok_or_else(|| no_convergence(0, "a point is behind the first estimate of the camera"))?;
    let mut damping = 1e-4;
    let mut converged = false;
    let mut iterations = 0;
    while iterations < max_iterations && !converged {
        cancel.check()?;
        iterations += 1;
        let next = system.step(&state, &rhos, freedom, damping);
        // Damping shortens steps along what is hardly determined: without it the step must be short too.
        if next.as_ref().is_some_and(|(.., size)| *size < CONVERGED)
            && let Some((last_state, last_rhos, size)) = system.step(&state, &rhos, freedom, damping.min(UNDAMPED))
            && size < CONVERGED
        {
            // Too short for the equations to be others after it.
            (state, rhos, converged) = (last_state, last_rhos, true);
            break;
        }
        let next = next.and_then(|(next_state, next_rhos, _)| {
            let next_system = linearise(measurements, &weights, &next_state, &next_rhos, freedom, focal)?;
            (next_system.cost <= system.cost * (1.0 + 1e-12)).then_some((next_state, next_rhos, next_system))
        });
        match next {
            Some((next_state, next_rhos, next_system)) => {
                // Standing still is the end too.
                let gain = system.cost - next_system.cost;
                converged = gain <= 1e-14 * (1e-12 + system.cost) && damping < 1e-2;
                (state, rhos, system) = (next_state, next_rhos, next_system);
                damping = (damping * 0.1).max(1e-12);
            }
            None => {
                damping *= 10.0;
                if damping > 1e12 {
                    // No downhill step of any length: at the minimum to rounding.
                    converged = system.g.norm() <= 1e-3 * system.h.diagonal().map(f64::sqrt).norm();
                    break;
                }
            }
        }
    }
    if !converged {
        return Err(no_convergence(iterations, format!("cost {:.6e}, damping {damping:.1e}", system.cost)));
    }
    let (inverse, condition) = invert_spd(&system.h).ok_or_else(|| {
        Error::degenerate(crate::error::Degeneracy::IllConditioned, "the normal equations are singular")
    })?;
    let s = DMatrix::from_fn(ALL, freedom.count(), |i, j| f64::from(freedom.unknowns[j].moves(i)));
    let covariance = &s * &inverse * s.transpose();
    let focal_deviation = covariance[(0, 0)].max(covariance[(1, 1)]).max(0.0).sqrt() / state.intrinsics.fx;
    Ok(Refined {
        camera: state,
        covariance,
        focal_deviation,
        condition,
        chi2: system.chi2,
        cost: system.cost,
        rhos,
        columns: inverse,
        focal,
        iterations,
    })
}

fn no_convergence(iterations: usize, detail: impl Into<String>) -> Error {
    Error::NoConvergence { iterations, detail: detail.into() }
}

/// Per measurement L^-1 with L L^T the covariance of its pixel; a point's own covariance is
/// propagated at the given camera and then held.
pub(super) fn whitenings(
    measurements: &[Measurement],
    camera: &Camera,
    noise_factor: f64,
) -> Result<Vec<Matrix2<f64>>> {
    measurements
        .iter()
        .enumerate()
        .map(|(index, m)| {
            let factor = if m.assumed_noise() { noise_factor * noise_factor } else { 1.0 };
            let c = match m {
                Measurement::Point(m) => held_covariance(m, camera, factor),
                Measurement::Line(m) => m.feet(camera).map(|feet| m.covariance(&feet, factor)),
            }
            .ok_or(Error::BehindCamera { index })?;
            let l11 = c.m11.sqrt();
            let l21 = c.m21 / l11;
            let l22 = (c.m22 - l21 * l21).sqrt();
            let w = Matrix2::new(1.0 / l11, 0.0, -l21 / (l11 * l22), 1.0 / l22);
            let ok = w.iter().all(|v| v.is_finite());
            if ok { Ok(w) } else { Err(Error::invalid("covariance", format!("of point {index} is singular"))) }
        })
        .collect()
}

/// Of a pixel and its point; a shot's depth has a residual of its own instead.
fn held_covariance(m: &PointMeasurement, camera: &Camera, factor: f64) -> Option<Matrix2<f64>> {
    let mut c = m.pixel_covariance * factor;
    if m.has_world_covariance() {
        let x = m.homogeneous(m.rho);
        let p = camera.project_homogeneous(&x.xyz(), x.w)?;
        for column in m.noise_columns() {
            let g = p.by_point * column.xyz();
            c += g * g.transpose();
        }
    }
    Some(c)
}

/// Normal equations at an estimate, inverse depths eliminated; `None` when a point cannot be projected.
pub(super) fn linearise(
    measurements: &[Measurement],
    weights: &[Matrix2<f64>],
    camera: &Camera,
    rhos: &[f64],
    freedom: &Freedom,
    focal: f64,
) -> Option<System> {
    let n = freedom.count();
    let mut points = Points::new(freedom);
    let (mut h, mut g) = ([[0.0; ALL]; ALL], [0.0; ALL]);
    let mut cost = 0.0;
    for (index, ((m, w), &rho)) in measurements.iter().zip(weights).zip(rhos).enumerate() {
        match m {
            Measurement::Point(m) => points.add(index, m, w, rho, camera)?,
            Measurement::Line(m) => cost += add_line(m, w, camera, freedom, &mut h, &mut g)?,
        }
    }
    points.flush(camera)?;
    cost += points.cost;
    for (a, (h, g)) in h.iter_mut().zip(&mut g).enumerate().take(n) {
        h.iter_mut().enumerate().take(n).skip(a).for_each(|(b, h)| *h += points.products.at(a, b));
        *g += points.products.at(a, n);
    }
    let chi2 = cost;
    let now = parameters(camera);
    for prior in &freedom.priors {
        let value: f64 = prior.iter().zip(&now).map(|(a, b)| a * b).sum::<f64>() / focal;
        cost += value * value;
        let mut row = [0.0; ALL];
        for (r, unknown) in row.iter_mut().zip(&freedom.unknowns) {
            *r = unknown.derivative(prior) / focal;
        }
        accumulate(&mut h, &row, 1.0, n);
        for (g, r) in g.iter_mut().zip(&row) {
            *g -= r * value;
        }
    }
    let h = DMatrix::from_fn(n, n, |a, b| if a <= b { h[a][b] } else { h[b][a] });
    let g = DVector::from_column_slice(&g[..n]);
    cost.is_finite().then_some(System { h, g, cost, chi2, depths: points.depths })
}

/// Adds weight * row^T row to the upper triangle of the first `n` rows.
fn accumulate(h: &mut [[f64; ALL]; ALL], row: &Row, weight: f64, n: usize) {
    for (a, h) in h.iter_mut().enumerate().take(n) {
        let scaled = weight * row[a];
        for (h, r) in h[a..n].iter_mut().zip(&row[a..n]) {
            *h += scaled * r;
        }
    }
}

/// The points' part of the normal equations.
struct Points<'a> {
    freedom: &'a Freedom,
    block: Box<Block>,
    /// What lies in the block's lanes: measurement, inverse depth.
    lanes: Vec<(usize, &'a PointMeasurement, f64)>,
    /// Of the unknowns' columns and the residual's.
    products: Products,
    depths: Vec<Depths>,
    cost: f64,
}

impl<'a> Points<'a> {
    fn new(freedom: &'a Freedom) -> Self {
        let products = Products::new(freedom.count() + 1);
        let lanes = Vec::with_capacity(LANES);
        Self { freedom, block: Block::new(), lanes, products, depths: Vec::new(), cost: 0.0 }
    }

    fn add(
        &mut self,
        index: usize,
        m: &'a PointMeasurement,
        whitening: &Matrix2<f64>,
        rho: f64,
        camera: &Camera,
    ) -> Option<()> {
        self.block.set(self.lanes.len(), &m.homogeneous(rho), &m.pixel, whitening);
        self.lanes.push((index, m, rho));
        if self.lanes.len() == LANES { self.flush(camera) } else { Some(()) }
    }

    /// Adds what is in the block.
    fn flush(&mut self, camera: &Camera) -> Option<()> {
        if self.lanes.is_empty() {
            return Some(());
        }
        self.block.project(camera, self.lanes.len())?;
        self.cost += self.block.squares().iter().sum::<f64>();
        self.products.take(&self.block, &self.freedom.unknowns, 0);
        for (to, row) in self.products.column(self.freedom.count()).into_iter().zip(&self.block.rows) {
            *to = row[RESIDUAL];
        }
        if self.lanes.iter().any(|(_, m, _)| m.has_depth()) {
            self.eliminate_depths();
        }
        self.products.add();
        self.lanes.clear();
        Some(())
    }

    /// With slope s of a residual r by its inverse depth, whose own measurement is off by o with the
    /// information i: rows J and r become M J and M r - q o s with M = I - (1 - q) s s^T / s^2 and
    /// q^2 = i / (s^2 + i), so that their products are the Schur complement.
    fn eliminate_depths(&mut self) {
        let n = self.freedom.count();
        let mut slope = [[0.0; LANES]; 2];
        let (mut information, mut gradient) = ([1.0; LANES], [0.0; LANES]);
        // (1 - q) / s^2 and q o.
        let (mut share, mut shift) = ([0.0; LANES], [0.0; LANES]);
        let mut of = Vec::with_capacity(self.lanes.len());
        for (lane, (index, m, rho)) in self.lanes.iter().enumerate().filter(|(_, (_, m, _))| m.has_depth()) {
            let along = |row: &[Lanes]| (0..4).map(|c| row[POINT + c][lane] * m.slope()[c]).sum::<f64>();
            let [x, y] = self.block.rows.each_ref().map(|row| along(row));
            let residual = self.block.rows.each_ref().map(|row| row[RESIDUAL][lane]);
            (slope[0][lane], slope[1][lane]) = (x, y);
            let stated = 1.0 / (m.sigma_rho * m.sigma_rho);
            let off = m.rho - rho;
            let squared = x * x + y * y;
            information[lane] = squared + stated;
            gradient[lane] = x * residual[0] + y * residual[1] + off * stated;
            self.cost += off * off * stated;
            let q = (stated / information[lane]).sqrt();
            share[lane] = if squared > 0.0 { (1.0 - q) / squared } else { 0.0 };
            shift[lane] = q * off;
            of.push((lane, *index));
        }
        let mut coupling = Vec::with_capacity(n + 1);
        let [sx, sy] = &slope;
        for k in 0..=n {
            let [x, y] = self.products.column(k);
            let dot: Lanes = std::array::from_fn(|l| sx[l] * x[l] + sy[l] * y[l]);
            for l in 0..LANES {
                let off = if k == n { shift[l] } else { 0.0 };
                x[l] -= sx[l] * (share[l] * dot[l] + off);
                y[l] -= sy[l] * (share[l] * dot[l] + off);
            }
            coupling.push(dot);
        }
        // The residual's is no coupling.
        coupling.truncate(n);
        self.depths.push(Depths { of, information, gradient, coupling });
    }
}

/// Adds a line's equations; its squared residual. `None` when the camera does not see it.
fn add_line(
    m: &LineMeasurement,
    w: &Matrix2<f64>,
    camera: &Camera,
    freedom: &Freedom,
    h: &mut [[f64; ALL]; ALL],
    g: &mut [f64; ALL],
) -> Option<f64> {
    let [a, b] = m.feet(camera)?;
    let (of_a, of_b) = (full_jacobian(&a.projection), full_jacobian(&b.projection));
    // Only what moves the line across itself counts.
    let by_parameter: [Vector2<f64>; ALL] =
        std::array::from_fn(|i| Vector2::new(a.normal.dot(&of_a[i]), b.normal.dot(&of_b[i])));
    let r = w * Vector2::new(a.distance, b.distance);
    let mut j = [[0.0; ALL]; 2];
    for (k, unknown) in freedom.unknowns.iter().enumerate() {
        let white = w * unknown.derivative(&by_parameter);
        (j[0][k], j[1][k]) = (white.x, white.y);
    }
    for (row, r) in j.iter().zip([r.x, r.y]) {
        accumulate(h, row, 1.0, freedom.count());
        g.iter_mut().zip(row).for_each(|(g, x)| *g += x * r);
    }
    Some(r.norm_squared())
}

impl System {
    /// Camera and inverse depths after a damped step, with its squared length in units of the noise.
    fn step(&self, camera: &Camera, rhos: &[f64], freedom: &Freedom, damping: f64) -> Option<(Camera, Vec<f64>, f64)> {
        let step = solve(self, damping)?;
        let next = moved(camera, freedom, step.as_slice())?;
        let mut next_rhos = rhos.to_vec();
        let mut size = step.dot(&(&self.h * &step));
        for d in &self.depths {
            let mut open = d.gradient;
            for (coupling, s) in d.coupling.iter().zip(step.iter()) {
                open.iter_mut().zip(coupling).for_each(|(o, b)| *o -= b * s);
            }
            for &(lane, index) in &d.of {
                let change = open[lane] / (d.information[lane] * (1.0 + damping));
                next_rhos[index] += change;
                size += change * change * d.information[lane];
            }
        }
        Some((next, next_rhos, size))
    }
}

/// (H + damping diag H) step = g.
fn solve(system: &System, damping: f64) -> Option<DVector<f64>> {
    let n = system.g.len();
    let d: Vec<f64> = (0..n).map(|i| system.h[(i, i)]).collect();
    if d.iter().any(|v| v.is_nan() || *v <= 0.0) {
        return None;
    }
    let scale = DVector::from_iterator(n, d.iter().map(|v| 1.0 / v.sqrt()));
    let mut a = DMatrix::from_fn(n, n, |i, k| system.h[(i, k)] * scale[i] * scale[k]);
    for i in 0..n {
        a[(i, i)] += damping;
    }
    let y = nalgebra::Cholesky::new(a)?.solve(&system.g.component_mul(&scale));
    let step = y.component_mul(&scale);
    step.iter().all(|v| v.is_finite()).then_some(step)
}
