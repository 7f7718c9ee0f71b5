//! Normal equations of one camera: points a block at a time, with one inverse depth per laser shot
//! eliminated by its Schur complement (maths.md 9.3), lines by the distances of their segments' ends.

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use super::block::{Block, LANES, Lanes, POINT, Points, Products, RESIDUAL};
use super::freedom::{ALL, Freedom, Row, full_jacobian, parameters};
use super::line_measurement::LineMeasurement;
use super::measurement::{Measurement, PointMeasurement};
use crate::error::{Error, Result};
use crate::geometry::Camera;

/// What another noise of the measurements that have an assumed one changes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Noise {
    /// Nothing: all noises are stated.
    Stated,
    /// The scale of all equations.
    Common,
    /// Weights that depend on noise and camera.
    Mixed,
}

/// What a camera is refined on, each residual whitened.
pub(crate) struct Equations<'a> {
    /// In the order of the blocks' lanes.
    points: Vec<&'a PointMeasurement>,
    blocks: Vec<Points>,
    lines: Vec<(&'a LineMeasurement, Matrix2<f64>)>,
    noise: Noise,
    factor: f64,
}

/// What the linearisation of the measurements at one estimate gives, inverse depths eliminated.
pub(super) struct System {
    /// The upper triangle counts.
    h: [Row; ALL],
    g: Row,
    pub chi2: f64,
    depths: Vec<Depths>,
}

/// With the priors.
pub(super) struct Normal {
    pub h: DMatrix<f64>,
    pub g: DVector<f64>,
    pub cost: f64,
}

/// Eliminated inverse depths of a block: their information, gradients, and couplings to the unknowns.
struct Depths {
    /// Place of the first lane among the points.
    first: usize,
    information: Lanes,
    gradient: Lanes,
    coupling: Vec<Lanes>,
}

impl<'a> Equations<'a> {
    /// Assumed noises are multiplied by `factor`; a point's own covariance is propagated at the given
    /// camera and then held.
    ///
    /// # Errors
    /// `BehindCamera`, `InvalidArgument` for a singular covariance.
    pub fn new(measurements: &[&'a Measurement], camera: &Camera, factor: f64) -> Result<Self> {
        let mut points = Vec::with_capacity(measurements.len());
        let mut blocks: Vec<Points> = Vec::with_capacity(measurements.len().div_ceil(LANES));
        let mut lines = Vec::new();
        let mut last = (Matrix2::identity(), Matrix2::identity());
        for (index, m) in measurements.iter().enumerate() {
            let scale = if m.assumed_noise() { factor * factor } else { 1.0 };
            let covariance = match m {
                Measurement::Point(m) => held_covariance(m, camera, scale),
                Measurement::Line(m) => m.feet(camera).map(|feet| m.covariance(&feet, scale)),
            }
            .ok_or(Error::BehindCamera { index })?;
            // Most are alike.
            if covariance != last.0 {
                let singular = || Error::invalid("covariance", format!("of point {index} is singular"));
                last = (covariance, whitening(&covariance).ok_or_else(singular)?);
            }
            match m {
                Measurement::Point(m) => {
                    let lane = points.len() % LANES;
                    if lane == 0 {
                        blocks.push(Points::NONE);
                    }
                    if let Some(block) = blocks.last_mut() {
                        block.set(lane, &m.homogeneous(m.rho), &m.pixel, &last.1);
                    }
                    points.push(m);
                }
                Measurement::Line(m) => lines.push((m, last.1)),
            }
        }
        if let Some(block) = blocks.last_mut() {
            block.fill((points.len() - 1) % LANES + 1);
        }
        let noise = if points.iter().all(|m| m.is_exact() && m.assumed_noise) && lines.is_empty() {
            Noise::Common
        } else if points.iter().all(|m| !m.has_world_covariance() && !m.assumed_noise) && lines.is_empty() {
            Noise::Stated
        } else {
            Noise::Mixed
        };
        Ok(Self { points, blocks, lines, noise, factor })
    }

    /// The measured inverse depths; none at all where no point has one.
    pub fn rhos(&self) -> Vec<f64> {
        let deep = self.points.iter().any(|m| m.has_depth());
        if deep { self.points.iter().map(|m| m.rho).collect() } else { Vec::new() }
    }

    /// Another factor of the assumed noises. By what the equations' whitenings, and with its square all that was
    /// made of them, changes; `None` where they must be made anew.
    pub fn set_noise(&mut self, factor: f64) -> Option<f64> {
        match self.noise {
            Noise::Stated => Some(1.0),
            Noise::Common => {
                let ratio = self.factor / factor;
                self.blocks.iter_mut().for_each(|block| block.scale_whitening(ratio));
                self.factor = factor;
                Some(ratio)
            }
            Noise::Mixed => None,
        }
    }

    /// At an estimate; `None` when something cannot be projected.
    pub fn linearise(&self, camera: &Camera, rhos: &[f64], freedom: &Freedom) -> Option<System> {
        let n = freedom.count();
        let (mut block, mut products) = (Block::new(), Products::new(n + 1));
        let mut system = System { h: [[0.0; ALL]; ALL], g: [0.0; ALL], chi2: 0.0, depths: Vec::new() };
        for (index, (points, measured)) in self.blocks.iter().zip(self.points.chunks(LANES)).enumerate() {
            let first = index * LANES;
            let deep = !rhos.is_empty() && measured.iter().any(|m| m.has_depth());
            if deep {
                let mut moved = points.clone();
                for (lane, (m, rho)) in measured.iter().zip(&rhos[first..]).enumerate() {
                    moved.move_to(lane, &m.homogeneous(*rho));
                }
                moved.fill(measured.len());
                block.project_points(&moved, camera)?;
            } else {
                block.project_points(points, camera)?;
            }
            system.chi2 += block.squares().iter().sum::<f64>();
            products.take(&block, &freedom.unknowns, 0);
            for (to, row) in products.column(n).into_iter().zip(&block.rows) {
                *to = row[RESIDUAL];
            }
            if deep {
                system.eliminate_depths(first, measured, &rhos[first..], &block, &mut products, n);
            }
            products.add();
        }
        for (a, (h, g)) in system.h.iter_mut().zip(&mut system.g).enumerate().take(n) {
            h.iter_mut().enumerate().take(n).skip(a).for_each(|(b, h)| *h = products.at(a, b));
            *g = products.at(a, n);
        }
        for (m, w) in &self.lines {
            system.add_line(m, w, camera, freedom)?;
        }
        system.chi2.is_finite().then_some(system)
    }
}

/// L^-1 with L L^T the covariance; `None` when that is singular.
fn whitening(c: &Matrix2<f64>) -> Option<Matrix2<f64>> {
    let l11 = c.m11.sqrt();
    let l21 = c.m21 / l11;
    let l22 = (c.m22 - l21 * l21).sqrt();
    let w = Matrix2::new(1.0 / l11, 0.0, -l21 / (l11 * l22), 1.0 / l22);
    w.iter().all(|v| v.is_finite()).then_some(w)
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

/// Adds row^T row to the upper triangle of the first `n` rows.
fn accumulate(h: &mut [Row; ALL], row: &Row, n: usize) {
    for (a, h) in h.iter_mut().enumerate().take(n) {
        for (h, r) in h[a..n].iter_mut().zip(&row[a..n]) {
            *h += row[a] * r;
        }
    }
}

impl System {
    /// With slope s of a residual r by its inverse depth, whose own measurement is off by o with the
    /// information i: rows J and r become M J and M r - q o s with M = I - (1 - q) s s^T / s^2 and
    /// q^2 = i / (s^2 + i), so that their products are the Schur complement.
    fn eliminate_depths(
        &mut self,
        first: usize,
        measured: &[&PointMeasurement],
        rhos: &[f64],
        block: &Block,
        products: &mut Products,
        n: usize,
    ) {
        let mut slope = [[0.0; LANES]; 2];
        let (mut information, mut gradient) = ([1.0; LANES], [0.0; LANES]);
        // (1 - q) / s^2 and q o.
        let (mut share, mut shift) = ([0.0; LANES], [0.0; LANES]);
        for (lane, (m, rho)) in measured.iter().zip(rhos).enumerate().filter(|(_, (m, _))| m.has_depth()) {
            let along = |row: &[Lanes]| (0..4).map(|c| row[POINT + c][lane] * m.slope()[c]).sum::<f64>();
            let [x, y] = block.rows.each_ref().map(|row| along(row));
            let residual = block.rows.each_ref().map(|row| row[RESIDUAL][lane]);
            (slope[0][lane], slope[1][lane]) = (x, y);
            let stated = 1.0 / (m.sigma_rho * m.sigma_rho);
            let off = m.rho - rho;
            let squared = x * x + y * y;
            information[lane] = squared + stated;
            gradient[lane] = x * residual[0] + y * residual[1] + off * stated;
            self.chi2 += off * off * stated;
            let q = (stated / information[lane]).sqrt();
            share[lane] = if squared > 0.0 { (1.0 - q) / squared } else { 0.0 };
            shift[lane] = q * off;
        }
        let mut coupling = Vec::with_capacity(n + 1);
        let [sx, sy] = &slope;
        for k in 0..=n {
            let [x, y] = products.column(k);
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
        self.depths.push(Depths { first, information, gradient, coupling });
    }

    /// Adds a line's equations. `None` when the camera does not see it.
    fn add_line(&mut self, m: &LineMeasurement, w: &Matrix2<f64>, camera: &Camera, freedom: &Freedom) -> Option<()> {
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
            accumulate(&mut self.h, row, freedom.count());
            self.g.iter_mut().zip(row).for_each(|(g, x)| *g += x * r);
        }
        self.chi2 += r.norm_squared();
        Some(())
    }

    /// By the square of what all whitenings change by.
    pub fn scale(&mut self, by: f64) {
        self.h.iter_mut().flatten().chain(&mut self.g).for_each(|x| *x *= by);
        self.chi2 *= by;
    }

    /// With the freedom's priors, whose unit is `focal`.
    pub fn normal(&self, camera: &Camera, freedom: &Freedom, focal: f64) -> Normal {
        let n = freedom.count();
        let (mut h, mut g, mut cost) = (self.h, self.g, self.chi2);
        let now = parameters(camera);
        for prior in &freedom.priors {
            let value: f64 = prior.iter().zip(&now).map(|(a, b)| a * b).sum::<f64>() / focal;
            cost += value * value;
            let mut row = [0.0; ALL];
            for (r, unknown) in row.iter_mut().zip(&freedom.unknowns) {
                *r = unknown.derivative(prior) / focal;
            }
            accumulate(&mut h, &row, n);
            g.iter_mut().zip(&row).for_each(|(g, r)| *g -= r * value);
        }
        let h = DMatrix::from_fn(n, n, |a, b| h[a.min(b)][a.max(b)]);
        Normal { h, g: DVector::from_column_slice(&g[..n]), cost }
    }

    /// Changes of the inverse depths with a step of the unknowns; their share of its squared length.
    pub fn follow(&self, step: &DVector<f64>, damping: f64, rhos: &mut [f64]) -> f64 {
        let mut size = 0.0;
        for d in &self.depths {
            let mut open = d.gradient;
            for (coupling, s) in d.coupling.iter().zip(step.iter()) {
                open.iter_mut().zip(coupling).for_each(|(o, b)| *o -= b * s);
            }
            for ((rho, open), information) in rhos[d.first..].iter_mut().zip(&open).zip(&d.information) {
                let change = open / (information * (1.0 + damping));
                *rho += change;
                size += change * change * information;
            }
        }
        size
    }

    /// What the linearisation says of itself after a step that the inverse depths have followed undamped.
    pub fn advance(&mut self, step: &DVector<f64>) {
        let n = step.len();
        for d in &mut self.depths {
            self.chi2 -= d.gradient.iter().zip(&d.information).map(|(g, i)| g * g / i).sum::<f64>();
            d.gradient = [0.0; LANES];
        }
        for a in 0..n {
            let change: f64 = (0..n).map(|b| self.h[a.min(b)][a.max(b)] * step[b]).sum();
            self.chi2 -= (2.0 * self.g[a] - change) * step[a];
            self.g[a] -= change;
        }
    }
}
