//! Maximum-likelihood fit of an elliptical Gaussian to a spot: its centre reaches the Cramer-Rao
//! bound where the spot is one, and says so in its covariance where it is not.

mod kernels;

use nalgebra::{SMatrix, SVector};

/// Columns that are worked on together.
const LANES: usize = 8;
/// Room is made for as many of them at once: a thousand pixels.
const USUAL_BLOCKS: usize = 128;

/// Centre x, y; logarithm of the amplitude; inverse covariance of the shape xx, xy, yy; background.
const PARAMETERS: usize = 7;
type Vector = SVector<f64, PARAMETERS>;
type Matrix = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// Standard deviations in pixels that a spot can have.
const MIN_SIGMA: f64 = 0.2;
const MAX_SIGMA: f64 = 100.0;
/// A hidden peak a million times as high as its foot is no estimate any more.
const MAX_LOG_AMPLITUDE: f64 = 20.0;
/// Expected gain in chi squared at which the fit has converged: nothing moves by more than 3 % of its
/// standard deviation any more.
const SETTLED: f64 = 1e-3;
/// The same, to within a standard deviation: enough where the weights are to be set anew.
const ROUGH: f64 = 1.0;
/// Spots take a few iterations, clipped ones more; what takes longer is none.
const MAX_ITERATIONS: usize = 12;
const MAX_CLIPPED_ITERATIONS: usize = 40;
/// Residuals beyond this many standard deviations are weighed down (Huber).
const HUBER: f64 = 4.0;
/// Real spots are Gaussian to about this share of their height; no pixel is an outlier within it.
const MODEL_ERROR: f64 = 0.1;
/// All that is seen of a clipped spot is its foot, where lens and sensor spread light wider than a
/// Gaussian: each pixel is trusted to this share of the model's height only.
const FOOT_ERROR: f64 = 0.05;

/// Signal about a spot on a grid of pixels, every `step`-th of each axis; memory that serves one fit
/// after the other. Rows are filled up to whole blocks of columns with pixels that do not count.
#[derive(Debug, Default)]
pub struct Patch {
    left: usize,
    top: usize,
    step: usize,
    columns: usize,
    /// Of columns.
    blocks: usize,
    rows: usize,
    /// On minus predicted, row by row.
    signal: Vec<[f32; LANES]>,
    /// Its noise variance without the spot; infinite for pixels that do not count.
    variance: Vec<[f32; LANES]>,
    /// Least residual: 0 of clipped pixels, whose signal is at least this, and none of others.
    least: Vec<[f64; LANES]>,
    has_clipped: bool,
    /// Variance that each grey level of signal adds.
    signal_variance: f32,
    weights: Vec<[f64; LANES]>,
}

/// A pixel of a patch; the default does not count.
#[derive(Debug, Clone, Copy)]
pub struct Pixel {
    pub signal: f32,
    pub variance: f32,
    pub clipped: bool,
}

impl Default for Pixel {
    fn default() -> Self {
        Self { signal: 0.0, variance: f32::INFINITY, clipped: false }
    }
}

#[derive(Debug, Clone, Copy)]
pub struct Gaussian {
    pub x: f64,
    pub y: f64,
    pub amplitude: f64,
    /// Variances xx, xy, yy of the shape, px^2.
    pub shape: [f64; 3],
}

impl Gaussian {
    /// Standard deviations along the major and minor axis.
    pub fn axes(&self) -> [f64; 2] {
        let [xx, xy, yy] = self.shape;
        let (mean, half) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
        [(mean + half).max(0.0).sqrt(), (mean - half).max(0.0).sqrt()]
    }

    /// Total signal.
    pub fn flux(&self) -> f64 {
        let [xx, xy, yy] = self.shape;
        std::f64::consts::TAU * self.amplitude * (xx * yy - xy * xy).max(0.0).sqrt()
    }
}

#[derive(Debug, Clone, Copy)]
pub struct Fit {
    pub gaussian: Gaussian,
    /// Covariance of the centre xx, xy, yy, px^2.
    pub covariance: [f64; 3],
    /// Of the matched filter of the fitted shape.
    pub signal_to_noise: f64,
    /// Share of the signal's energy that the model explains.
    pub explained: f64,
}

impl Fit {
    /// Nearly all of the light is in a peak that is nearly round.
    pub fn is_laser_like(&self) -> bool {
        let [major, minor] = self.gaussian.axes();
        self.explained >= 0.95 && major <= 2.0 * minor
    }
}

/// A Gaussian on a background.
#[derive(Debug, Clone, Copy)]
pub struct Model {
    parameters: Vector,
    amplitude: f64,
}

/// Weighted least squares about a model: cost, half its curvature and its descent.
struct Normal {
    cost: f64,
    matrix: Matrix,
    gradient: Vector,
}

impl Patch {
    /// An empty patch from this pixel on.
    pub fn begin(&mut self, left: usize, top: usize, step: usize, signal_variance: f32) {
        (self.left, self.top, self.step, self.signal_variance) = (left, top, step, signal_variance);
        (self.columns, self.blocks, self.rows, self.has_clipped) = (0, 0, 0, false);
        self.signal.clear();
        self.variance.clear();
        self.least.clear();
        self.signal.reserve(USUAL_BLOCKS);
        self.variance.reserve(USUAL_BLOCKS);
        self.least.reserve(USUAL_BLOCKS);
        self.weights.reserve(USUAL_BLOCKS);
    }

    /// Adds a row; all are of one length.
    pub fn push(&mut self, row: &[Pixel]) {
        (self.columns, self.blocks, self.rows) = (row.len(), row.len().div_ceil(LANES), self.rows + 1);
        for some in row.chunks(LANES) {
            let mut block = [Pixel::default(); LANES];
            block[..some.len()].copy_from_slice(some);
            self.signal.push(block.map(|p| p.signal));
            self.variance.push(block.map(|p| p.variance));
            self.least.push(block.map(|p| if p.clipped { 0.0 } else { f64::NEG_INFINITY }));
        }
        self.has_clipped |= row.iter().any(|p| p.clipped);
    }

    /// Is any pixel clipped?
    pub fn has_clipped(&self) -> bool {
        self.has_clipped
    }

    /// Fits to within a standard deviation, under the noise of the background and with all pixels; `None`
    /// when there is no such maximum.
    pub fn fit_roughly(&mut self, start: &Gaussian) -> Option<Model> {
        let start = Model::new(start)?;
        self.weigh(&start, false);
        Some(self.descend(start, ROUGH)?.0)
    }

    /// Fits from a rough one, under the noise of the model and without outliers; `None` when there is no
    /// such maximum.
    pub fn fit(&mut self, rough: &Model) -> Option<Fit> {
        self.weigh(rough, true);
        let (mut fitted, mut normal) = self.descend(*rough, SETTLED)?;
        if self.weigh(&fitted, true) {
            (fitted, normal) = self.descend(fitted, SETTLED)?;
        }
        self.judge(&fitted, normal)
    }

    /// As [`kernels::weigh`].
    fn weigh(&mut self, model: &Model, robust: bool) -> bool {
        self.weights.resize(self.signal.len(), [0.0; LANES]);
        kernels::weigh(self, model, robust)
    }

    /// Is the centre on the patch or beside it? From farther away the model could not come back.
    fn holds(&self, model: &Model) -> bool {
        let inside = |value: f64, start: usize, count: usize| {
            let start = start as f64;
            (start - 2.0..=start + (count * self.step) as f64 + 1.0).contains(&value)
        };
        let p = &model.parameters;
        inside(p[0], self.left, self.columns) && inside(p[1], self.top, self.rows)
    }

    /// Levenberg-Marquardt with fixed weights, until a step would gain less than `settled`.
    fn descend(&self, mut model: Model, settled: f64) -> Option<(Model, Normal)> {
        let prior = Prior::new(kernels::mean_weight(self), &model);
        let mut damping = 1e-4;
        let mut normal = self.normal(&model, &prior);
        let iterations = if self.has_clipped { MAX_CLIPPED_ITERATIONS } else { MAX_ITERATIONS };
        for _ in 0..iterations {
            let mut damped = normal.matrix;
            for k in 0..PARAMETERS {
                damped[(k, k)] *= 1.0 + damping;
            }
            let step = damped.cholesky()?.solve(&normal.gradient);
            if step.dot(&normal.gradient) < settled {
                break;
            }
            let trial = Model::of(model.parameters + step);
            if trial.is_possible() && self.holds(&trial) {
                let there = self.normal(&trial, &prior);
                if there.cost < normal.cost {
                    (model, normal) = (trial, there);
                    damping = (0.1 * damping).max(1e-12);
                    continue;
                }
            }
            damping = (10.0 * damping).max(1e-6);
        }
        // Height and width of a clipped spot trade off along a flat valley, where steps may run out; its
        // centre has long settled.
        Some((model, normal))
    }

    /// All derivatives but the background's are the height times a polynomial of the second degree, so
    /// that moments along the rows are all that needs summing over the pixels.
    fn normal(&self, model: &Model, prior: &Prior) -> Normal {
        let sums = kernels::moments(self, model);
        let [_, _, _, xx, xy, yy, _] = model.parameters.data.0[0];
        // Derivatives in MONOMIALS.
        let derivatives = SMatrix::<f64, 6, 6>::from_row_slice(&[
            0.0, xx, xy, 0.0, 0.0, 0.0, //
            0.0, xy, yy, 0.0, 0.0, 0.0, //
            1.0, 0.0, 0.0, 0.0, 0.0, 0.0, //
            0.0, 0.0, 0.0, -0.5, 0.0, 0.0, //
            0.0, 0.0, 0.0, 0.0, -1.0, 0.0, //
            0.0, 0.0, 0.0, 0.0, 0.0, -0.5,
        ]);
        let moments = SMatrix::<f64, 6, 6>::from_fn(|a, b| {
            let ((i, j), (k, l)) = (MONOMIALS[a], MONOMIALS[b]);
            sums.squares[i + k][j + l]
        });
        let mut matrix = Matrix::zeros();
        matrix.fixed_view_mut::<6, 6>(0, 0).copy_from(&(derivatives * moments * derivatives.transpose()));
        let of = |sums: &[[f64; 3]; 3]| SVector::<f64, 6>::from(MONOMIALS.map(|(i, j)| sums[i][j]));
        let border = derivatives * of(&sums.heights);
        let descent = derivatives * of(&sums.residuals);
        let mut gradient = Vector::zeros();
        for k in 0..6 {
            matrix[(k, 6)] = border[k];
            matrix[(6, k)] = border[k];
            gradient[k] = descent[k];
        }
        matrix[(6, 6)] = sums.weight;
        gradient[6] = sums.residual;
        let mut normal = Normal { cost: sums.cost, matrix, gradient };
        prior.add(&model.parameters, &mut normal);
        normal
    }

    /// Covariance and quality of a fit that converged.
    fn judge(&self, model: &Model, normal: Normal) -> Option<Fit> {
        let inverse = normal.matrix.cholesky()?.inverse();
        let mut covariance = [inverse[(0, 0)], inverse[(0, 1)], inverse[(1, 1)]];

        let q = kernels::quality(self, model);
        let kernels::Quality { matched, matched_square, near, energy, missed, noise, light, .. } = q;
        if !(matched > 0.0 && near > 0.0 && light > 0.0) {
            return None;
        }
        // Chi squared beyond what chance gives: the model is wrong by that much everywhere.
        let misfit = |square: f64, freedom: f64| {
            let freedom = freedom.max(1.0);
            square / freedom / (1.0 + 2.0 * (2.0 / freedom).sqrt())
        };
        let excess = misfit(q.all_square, q.all - PARAMETERS as f64).max(misfit(q.near_square, near - 3.0)).max(1.0);
        // Neighbours are wrong in the same way, so that it adds up over about four of them; what is wrong
        // with a clipped spot was allowed for before.
        let excess = if self.has_clipped { excess } else { 1.0 + 4.0 * (excess - 1.0) };
        covariance.iter_mut().for_each(|c| *c *= excess);
        // A lopsided spot has no one centre: the model's and that of its light differ.
        let lopsided = |axis: usize| q.skew[axis] * q.skew[axis] / q.spread[axis].max(1e-12);
        if lopsided(0) + lopsided(1) > 14.0 {
            let [x, y] = q.skew.map(|s| s / light);
            covariance = [covariance[0] + x * x, covariance[1] + x * y, covariance[2] + y * y];
        }
        let explained = 1.0 - (missed - noise).max(0.0) / (energy - noise).max(1e-9);
        let signal_to_noise = matched / matched_square.sqrt();
        let fit = Fit { gaussian: model.gaussian(), covariance, signal_to_noise, explained };
        (covariance[0] > 0.0 && covariance[2] > 0.0 && signal_to_noise.is_finite()).then_some(fit)
    }
}

/// Powers of dx and dy.
const MONOMIALS: [(usize, usize); 6] = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)];

impl Model {
    fn new(start: &Gaussian) -> Option<Self> {
        let [xx, xy, yy] = start.shape;
        let determinant = xx * yy - xy * xy;
        let inverse = [yy / determinant, -xy / determinant, xx / determinant];
        let p = [start.x, start.y, start.amplitude.ln(), inverse[0], inverse[1], inverse[2], 0.0];
        let model = Self::of(Vector::from(p));
        model.is_possible().then_some(model)
    }

    fn of(parameters: Vector) -> Self {
        Self { parameters, amplitude: parameters[2].exp() }
    }

    /// Finite, and an ellipse of a size that a spot can have.
    fn is_possible(&self) -> bool {
        let p = &self.parameters;
        let (mean, half) = (0.5 * (p[3] + p[5]), (0.5 * (p[3] - p[5])).hypot(p[4]));
        p.iter().all(|v| v.is_finite())
            && p[2].abs() < MAX_LOG_AMPLITUDE
            && mean + half <= MIN_SIGMA.powi(-2)
            && mean - half >= MAX_SIGMA.powi(-2)
    }

    pub fn gaussian(&self) -> Gaussian {
        let p = &self.parameters;
        let determinant = p[3] * p[5] - p[4] * p[4];
        let shape = [p[5] / determinant, -p[4] / determinant, p[3] / determinant];
        Gaussian { x: p[0], y: p[1], amplitude: self.amplitude, shape }
    }
}

/// Weak normal priors about zero, by their inverse variances, that keep faint spots from
/// degenerating: a background within the noise, and a shape that is round to a factor of about two.
struct Prior {
    background: f64,
    /// Of xx - yy and of 2 xy of the inverse shape.
    shape: f64,
}

impl Prior {
    /// `background`: the inverse variance of a pixel.
    fn new(background: f64, model: &Model) -> Self {
        let sharpness = 0.5 * (model.parameters[3] + model.parameters[5]);
        Self { background, shape: 4.0 / (sharpness * sharpness) }
    }

    fn add(&self, p: &Vector, normal: &mut Normal) {
        let Normal { cost, matrix, gradient } = normal;
        let difference = p[3] - p[5];
        *cost += self.background * p[6] * p[6] + self.shape * (difference * difference + 4.0 * p[4] * p[4]);
        matrix[(6, 6)] += self.background;
        gradient[6] -= self.background * p[6];
        matrix[(3, 3)] += self.shape;
        matrix[(5, 5)] += self.shape;
        matrix[(3, 5)] -= self.shape;
        matrix[(5, 3)] -= self.shape;
        gradient[3] -= self.shape * difference;
        gradient[5] += self.shape * difference;
        matrix[(4, 4)] += 4.0 * self.shape;
        gradient[4] -= 4.0 * self.shape * p[4];
    }
}
