//! Maximum-likelihood refinement: Levenberg-Marquardt on the reprojection error in the distorted
//! image, with soft priors on skew and aspect.

use nalgebra::{DMatrix, DVector};

use super::equations::{Equations, Normal, System};
use super::freedom::{ALL, Freedom, moved};
use super::measurement::Measurement;
use crate::control::Cancel;
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::Camera;
use crate::geometry::linalg::invert_spd;

/// Squared lengths of steps, in units of the noise, after which outliers are looked at again (residuals
/// then move by far less than their noise), and after which nothing that matters changes.
pub(crate) const PROVISIONAL: f64 = 1e-2;
pub(crate) const CONVERGED: f64 = 1e-10;
/// Damping of the first step: starts are good; and the least after a step that failed.
const CONFIDENT: f64 = 1e-6;
const CAUTIOUS: f64 = 1e-4;
/// As good as no damping of what is determined at all.
const UNDAMPED: f64 = 1e-9;
/// Steps that shorten this much (squared) go on to do so: the next one's length is told without it.
const FAST: f64 = 1e-2;

/// A camera on its way to the least squares of the measurements.
pub(crate) struct Refinement<'a> {
    measurements: Vec<&'a Measurement>,
    freedom: &'a Freedom,
    equations: Equations<'a>,
    pub camera: Camera,
    /// Inverse depths, those of shots estimated; see [`Equations::rhos`].
    rhos: Vec<f64>,
    /// Unit of the priors on skew and aspect, px.
    focal: f64,
    system: Option<System>,
    /// The linearisation is of the estimate before a last step of this squared length (0: of this one),
    slack: f64,
    /// after which one of this squared length may be left.
    left: f64,
    /// Squared length of the last step but that one; 0 after none.
    before: f64,
    damping: f64,
    iterations: usize,
}

/// What the end of a refinement says.
pub(crate) struct Refined {
    pub camera: Camera,
    /// Of all sixteen parameters; zero where not free.
    pub covariance: DMatrix<f64>,
    /// Standard deviation of ln(focal length), priors included.
    pub focal_deviation: f64,
    pub condition: f64,
    /// Sum of squared whitened residuals of pixels and depths, with the priors' share.
    pub cost: f64,
    /// Covariance of the freedom's unknowns.
    pub columns: DMatrix<f64>,
    pub iterations: usize,
}

struct Step {
    by: DVector<f64>,
    camera: Camera,
    rhos: Vec<f64>,
    /// Squared length in units of the noise.
    size: f64,
}

impl<'a> Refinement<'a> {
    /// Of `camera` on `measurements`, whose assumed noises are multiplied by `noise_factor`.
    ///
    /// # Errors
    /// `BehindCamera`, `InvalidArgument` for a singular covariance.
    pub fn new(
        measurements: Vec<&'a Measurement>,
        camera: Camera,
        freedom: &'a Freedom,
        noise_factor: f64,
    ) -> Result<Self> {
        let equations = Equations::new(&measurements, &camera, noise_factor)?;
        Ok(Self {
            measurements,
            freedom,
            rhos: equations.rhos(),
            equations,
            camera,
            focal: camera.intrinsics.fx,
            system: None,
            slack: 0.0,
            left: f64::INFINITY,
            before: 0.0,
            damping: CONFIDENT,
            iterations: 0,
        })
    }

    pub fn measurements(&self) -> &[&'a Measurement] {
        &self.measurements
    }

    /// Goes on with the noise that is now believed, and all that depends on the camera at its estimate.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn set_noise(&mut self, noise_factor: f64) -> Result<()> {
        self.focal = self.camera.intrinsics.fx;
        match self.equations.set_noise(noise_factor) {
            Some(ratio) => {
                let squared = ratio * ratio;
                if let Some(system) = &mut self.system {
                    system.scale(squared);
                }
                [&mut self.left, &mut self.slack, &mut self.before].into_iter().for_each(|size| *size *= squared);
            }
            None => {
                self.equations = Equations::new(&self.measurements, &self.camera, noise_factor)?;
                self.system = None;
            }
        }
        Ok(())
    }

    /// Until the squared length of a step in units of the noise is below `tolerance`.
    ///
    /// # Errors
    /// `NoConvergence`, `Cancelled`.
    pub fn minimise(&mut self, tolerance: f64, max_iterations: usize, cancel: &Cancel) -> Result<()> {
        let mut system = match self.system.take().filter(|_| self.left < tolerance) {
            Some(system) => system,
            None => {
                (self.before, self.slack) = (self.slack, 0.0);
                let behind = || no_convergence(0, "a point is behind the first estimate of the camera");
                self.equations.linearise(&self.camera, &self.rhos, self.freedom).ok_or_else(behind)?
            }
        };
        let mut normal = self.normal(&system);
        let (mut converged, mut iterations) = (false, 0);
        while iterations < max_iterations && !converged {
            cancel.check()?;
            iterations += 1;
            let before = self.before;
            let left = |size: f64| if size < FAST * before.min(1.0) { 2.0 * size * size / before } else { size };
            let next = self.step(&system, &normal, self.damping);
            // Damping shortens steps along what is hardly determined: without it the step must be short too.
            if next.as_ref().is_some_and(|next| left(next.size) < tolerance)
                && let Some(last) = self.step(&system, &normal, self.damping.min(UNDAMPED))
                && left(last.size) < tolerance
            {
                // Too short for the equations to be others after it.
                system.advance(&last.by);
                (self.left, self.slack) = (left(last.size), last.size);
                (self.camera, self.rhos) = (last.camera, last.rhos);
                converged = true;
                break;
            }
            let next = next.and_then(|next| {
                let system = self.equations.linearise(&next.camera, &next.rhos, self.freedom)?;
                let cost = system.normal(&next.camera, self.freedom, self.focal).cost;
                (cost <= normal.cost * (1.0 + 1e-12) + self.slack).then_some((next, system))
            });
            match next {
                Some((next, linearised)) => {
                    (self.camera, self.rhos, system) = (next.camera, next.rhos, linearised);
                    (self.before, self.slack) = (next.size, 0.0);
                    let cost = normal.cost;
                    normal = self.normal(&system);
                    // Standing still is the end too.
                    converged = cost - normal.cost <= 1e-14 * (1e-12 + cost) && self.damping < 1e-2;
                    self.damping = (self.damping * 0.1).max(1e-12);
                }
                None => {
                    self.before = 0.0;
                    self.damping = (self.damping * 10.0).max(CAUTIOUS);
                    if self.damping > 1e12 {
                        // No downhill step of any length: at the minimum to rounding.
                        converged = normal.g.norm() <= 1e-3 * normal.h.diagonal().map(f64::sqrt).norm();
                        self.damping = CAUTIOUS;
                        break;
                    }
                }
            }
        }
        self.iterations += iterations;
        self.system = Some(system);
        if converged {
            Ok(())
        } else {
            Err(no_convergence(iterations, format!("cost {:.6e}, damping {:.1e}", normal.cost, self.damping)))
        }
    }

    /// Sum of squared whitened residuals of pixels and depths.
    pub fn chi2(&self) -> f64 {
        self.system.as_ref().map_or(f64::INFINITY, |system| system.chi2)
    }

    /// The estimate and its covariance.
    ///
    /// # Errors
    /// `Degenerate` when the normal equations are singular.
    pub fn refined(&self) -> Result<Refined> {
        let normal = self.system.as_ref().map(|system| self.normal(system));
        let (columns, condition, cost) = normal
            .and_then(|normal| invert_spd(&normal.h).map(|(inverse, condition)| (inverse, condition, normal.cost)))
            .ok_or_else(|| Error::degenerate(Degeneracy::IllConditioned, "the normal equations are singular"))?;
        let freedom = self.freedom;
        let s = DMatrix::from_fn(ALL, freedom.count(), |i, j| f64::from(freedom.unknowns[j].moves(i)));
        let covariance = &s * &columns * s.transpose();
        let camera = self.camera;
        let focal_deviation = covariance[(0, 0)].max(covariance[(1, 1)]).max(0.0).sqrt() / camera.intrinsics.fx;
        let iterations = self.iterations;
        Ok(Refined { camera, covariance, focal_deviation, condition, cost, columns, iterations })
    }

    /// The normal equations at the estimate with another freedom and, to make it testable, another lens.
    pub fn widened(&self, camera: &Camera, freedom: &Freedom) -> Option<Normal> {
        let system = self.equations.linearise(camera, &self.rhos, freedom)?;
        Some(system.normal(camera, freedom, self.focal))
    }

    fn normal(&self, system: &System) -> Normal {
        system.normal(&self.camera, self.freedom, self.focal)
    }

    fn step(&self, system: &System, normal: &Normal, damping: f64) -> Option<Step> {
        let by = solve(normal, damping)?;
        let camera = moved(&self.camera, self.freedom, by.as_slice())?;
        let mut rhos = self.rhos.clone();
        let size = by.dot(&(&normal.h * &by)) + system.follow(&by, damping, &mut rhos);
        Some(Step { by, camera, rhos, size })
    }
}

fn no_convergence(iterations: usize, detail: impl Into<String>) -> Error {
    Error::NoConvergence { iterations, detail: detail.into() }
}

/// (H + damping diag H) step = g.
fn solve(normal: &Normal, damping: f64) -> Option<DVector<f64>> {
    let scale = normal.h.diagonal().map(|v| 1.0 / v.sqrt());
    if scale.iter().any(|v| !(v.is_finite() && *v > 0.0)) {
        return None;
    }
    let mut a = normal.h.map_with_location(|i, k, v| v * scale[i] * scale[k]);
    for i in 0..scale.len() {
        a[(i, i)] += damping;
    }
    let step = nalgebra::Cholesky::new(a)?.solve(&normal.g.component_mul(&scale)).component_mul(&scale);
    step.iter().all(|v| v.is_finite()).then_some(step)
}
