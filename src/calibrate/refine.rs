//! Maximum-likelihood refinement: Levenberg-Marquardt on the reprojection error in the distorted
//! image, with one inverse depth per laser shot eliminated by its Schur complement (maths.md 9.3),
//! lines by the distances of their segments' ends, and soft priors on skew and aspect.

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use super::freedom::{ALL, Freedom, Row, full_jacobian, moved, parameters};
use super::measurement::{Measurement, PointMeasurement};
use crate::control::Cancel;
use crate::error::{Error, Result};
use crate::geometry::Camera;
use crate::geometry::linalg::invert_spd;

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
    /// Of the eliminated inverse depths, in the order of the shots.
    depths: Vec<Depth>,
}

/// One eliminated inverse depth: its information, gradient, and coupling to the free parameters.
struct Depth {
    information: f64,
    gradient: f64,
    coupling: Row,
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
        let step = solve(&system, damping);
        let next = step.as_ref().and_then(|step| {
            let next_state = moved(&state, freedom, step.as_slice())?;
            let mut next_rhos = rhos.clone();
            let mut shots = system.depths.iter();
            for (m, rho) in measurements.iter().zip(&mut next_rhos) {
                if m.as_point().is_some_and(PointMeasurement::has_depth) {
                    let d = shots.next()?;
                    let moved: f64 = d.coupling.iter().zip(step.iter()).map(|(b, s)| b * s).sum();
                    *rho += (d.gradient - moved) / (d.information * (1.0 + damping));
                }
            }
            let next_system = linearise(measurements, &weights, &next_state, &next_rhos, freedom, focal)?;
            (next_system.cost <= system.cost * (1.0 + 1e-12)).then_some((next_state, next_rhos, next_system))
        });
        match (next, step) {
            (Some((next_state, next_rhos, next_system)), Some(step)) => {
                // Steps far below the noise change nothing that matters; so does standing still.
                let size = step.dot(&(&system.h * &step));
                let gain = system.cost - next_system.cost;
                converged = (size < 1e-10 && damping < 1.0) || gain <= 1e-14 * (1e-12 + system.cost) && damping < 1e-2;
                (state, rhos, system) = (next_state, next_rhos, next_system);
                damping = (damping * 0.1).max(1e-12);
            }
            _ => {
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
    let mut h = [[0.0; ALL]; ALL];
    let mut g = [0.0; ALL];
    let mut cost = 0.0;
    let mut depths = Vec::with_capacity(measurements.len());
    let mut j = [[0.0; ALL]; 2];
    for ((m, w), &rho) in measurements.iter().zip(weights).zip(rhos) {
        let Prediction { residual, by_parameter, by_depth } = predict(m, camera, rho)?;
        let r = w * residual;
        cost += r.norm_squared();
        for (k, unknown) in freedom.unknowns.iter().enumerate() {
            let white = w * unknown.derivative(&by_parameter);
            (j[0][k], j[1][k]) = (white.x, white.y);
        }
        accumulate(&mut h, &j[0], 1.0, n);
        accumulate(&mut h, &j[1], 1.0, n);
        for (a, g) in g.iter_mut().enumerate() {
            *g += j[0][a] * r.x + j[1][a] * r.y;
        }
        if let Some(m) = m.as_point().filter(|m| m.has_depth()) {
            let slope = w * by_depth;
            let stated = 1.0 / (m.sigma_rho * m.sigma_rho);
            let off = m.rho - rho;
            cost += off * off * stated;
            let information = slope.norm_squared() + stated;
            let gradient = slope.dot(&r) + off * stated;
            let coupling: Row = std::array::from_fn(|a| slope.x * j[0][a] + slope.y * j[1][a]);
            accumulate(&mut h, &coupling, -1.0 / information, n);
            for (g, b) in g.iter_mut().zip(&coupling) {
                *g -= b * gradient / information;
            }
            depths.push(Depth { information, gradient, coupling });
        }
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
    cost.is_finite().then_some(System { h, g, cost, chi2, depths })
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

/// A residual and how its prediction moves.
struct Prediction {
    residual: Vector2<f64>,
    by_parameter: [Vector2<f64>; ALL],
    /// By a shot's inverse depth; zero for others.
    by_depth: Vector2<f64>,
}

/// `None` when the camera does not see it.
fn predict(m: &Measurement, camera: &Camera, rho: f64) -> Option<Prediction> {
    match m {
        Measurement::Point(m) => {
            let x = m.homogeneous(rho);
            let p = camera.project_homogeneous(&x.xyz(), x.w)?;
            let by_depth = p.by_point * m.slope().xyz() + p.by_weight * m.slope().w;
            Some(Prediction { residual: m.pixel - p.pixel, by_parameter: full_jacobian(&p), by_depth })
        }
        Measurement::Line(m) => {
            let [a, b] = m.feet(camera)?;
            let (of_a, of_b) = (full_jacobian(&a.projection), full_jacobian(&b.projection));
            // Only what moves the line across itself counts.
            let by_parameter = std::array::from_fn(|i| Vector2::new(a.normal.dot(&of_a[i]), b.normal.dot(&of_b[i])));
            let residual = Vector2::new(a.distance, b.distance);
            Some(Prediction { residual, by_parameter, by_depth: Vector2::zeros() })
        }
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
