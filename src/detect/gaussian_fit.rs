//! Maximum-likelihood fit of an elliptical Gaussian to a spot: its centre reaches the Cramer-Rao
//! bound where the spot is one, and says so in its covariance where it is not.

use nalgebra::{SMatrix, SVector};

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
const MAX_ITERATIONS: usize = 40;
/// Residuals beyond this many standard deviations are weighed down (Huber).
const HUBER: f64 = 4.0;
/// Real spots are Gaussian to about this share of their height; no pixel is an outlier within it.
const MODEL_ERROR: f64 = 0.1;
/// All that is seen of a clipped spot is its foot, where lens and sensor spread light wider than a
/// Gaussian: each pixel is trusted to this share of the model's height only.
const FOOT_ERROR: f64 = 0.05;

/// Signal about a spot on a grid of pixels, every `step`-th of each axis.
#[derive(Debug, Default)]
pub struct Patch {
    pub left: usize,
    pub top: usize,
    pub step: usize,
    pub columns: usize,
    /// On minus predicted, row by row.
    pub signal: Vec<f32>,
    /// Its noise variance without the spot; infinite for pixels that do not count.
    pub variance: Vec<f32>,
    /// Clipped: the signal is at least this.
    pub clipped: Vec<bool>,
    /// Is any pixel clipped?
    pub has_clipped: bool,
    /// Variance that each grey level of signal adds.
    pub signal_variance: f32,
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

#[derive(Debug, Clone, Copy)]
struct Model {
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
    /// Fits from a start; `None` when there is no such maximum.
    pub fn fit(&self, start: Gaussian) -> Option<Fit> {
        let mut model = Model::new(&start)?;
        let mut weights = vec![0.0; self.signal.len()];
        self.weigh(&model, false, &mut weights);
        let (mut fitted, mut normal) = self.descend(model, &weights)?;
        // With the noise of the background at first, then with that of the model and without outliers.
        for _ in 0..2 {
            model = fitted;
            if !self.weigh(&model, true, &mut weights) {
                break;
            }
            (fitted, normal) = self.descend(model, &weights)?;
        }
        self.judge(&fitted, normal)
    }

    fn rows(&self) -> usize {
        self.signal.len() / self.columns.max(1)
    }

    /// Is the centre on the patch or beside it? From farther away the model could not come back.
    fn holds(&self, model: &Model) -> bool {
        let inside = |value: f64, start: usize, count: usize| {
            let start = start as f64;
            (start - 2.0..=start + (count * self.step) as f64 + 1.0).contains(&value)
        };
        let p = &model.parameters;
        inside(p[0], self.left, self.columns) && inside(p[1], self.top, self.rows())
    }

    /// Inverse variances under the model; true when they are not those of the background alone.
    fn weigh(&self, model: &Model, robust: bool, weights: &mut [f64]) -> bool {
        let mut changed = robust && (self.has_clipped || self.signal_variance > 0.0);
        let background = model.parameters[6];
        self.visit(model, |first, _, _, exponentials| {
            for (i, e) in (first..).zip(exponentials) {
                let height = model.amplitude * e;
                let variance = self.noise(i, height);
                weights[i] = 1.0 / variance;
                if robust {
                    let residual = self.residual(i, height + background).abs();
                    let limit = HUBER * variance.sqrt() + MODEL_ERROR * height;
                    if residual > limit {
                        weights[i] *= limit / residual;
                        changed |= variance.is_finite();
                    }
                }
            }
        });
        changed
    }

    /// Variance of a pixel under the model.
    fn noise(&self, i: usize, height: f64) -> f64 {
        let foot = if self.has_clipped { FOOT_ERROR * height } else { 0.0 };
        self.variance[i] as f64 + self.signal_variance as f64 * height + foot * foot
    }

    /// Signal minus model; a clipped pixel only objects to a model below it.
    fn residual(&self, i: usize, model: f64) -> f64 {
        let residual = self.signal[i] as f64 - model;
        if self.clipped[i] { residual.max(0.0) } else { residual }
    }

    /// Calls for each row with the index of its first pixel, that pixel's dx, dy from the centre, and
    /// exp(-q/2) of its pixels.
    fn visit(&self, model: &Model, mut row: impl FnMut(usize, f64, f64, &[f64])) {
        let [x, y, _, xx, xy, yy, _] = model.parameters.data.0[0];
        let step = self.step as f64;
        // Along a row the exponent is a parabola: its exponential is a recurrence of two products.
        let second = (-xx * step * step).exp();
        let mut exponentials = vec![0.0; self.columns];
        for r in 0..self.rows() {
            let dy = (self.top + r * self.step) as f64 - y;
            let dx0 = self.left as f64 - x;
            // Both ways from the column nearest the ridge, where the value is largest.
            let start = ((0.5 - (dx0 + xy / xx * dy) / step).max(0.0) as usize).min(self.columns - 1);
            let dx = dx0 + start as f64 * step;
            let value = (-0.5 * (xx * dx * dx + 2.0 * xy * dx * dy + yy * dy * dy)).exp();
            let slope = (xx * dx + xy * dy) * step;
            let half = 0.5 * xx * step * step;
            let (low, high) = exponentials.split_at_mut(start);
            let (mut v, mut ratio) = (value, (-slope - half).exp());
            for e in high {
                *e = v;
                v *= ratio;
                ratio *= second;
            }
            let (mut v, mut ratio) = (value, (slope - half).exp());
            for e in low.iter_mut().rev() {
                v *= ratio;
                ratio *= second;
                *e = v;
            }
            row(r * self.columns, dx0, dy, &exponentials);
        }
    }

    /// Levenberg-Marquardt with fixed weights.
    fn descend(&self, mut model: Model, weights: &[f64]) -> Option<(Model, Normal)> {
        let prior = self.prior(&model);
        let mut damping = 1e-4;
        let mut normal = self.normal(&model, weights, &prior);
        for _ in 0..MAX_ITERATIONS {
            let mut damped = normal.matrix;
            for k in 0..PARAMETERS {
                damped[(k, k)] *= 1.0 + damping;
            }
            let step = damped.cholesky()?.solve(&normal.gradient);
            if step.dot(&normal.gradient) < SETTLED {
                break;
            }
            let trial = Model::of(model.parameters + step);
            if trial.is_possible() && self.holds(&trial) {
                let there = self.normal(&trial, weights, &prior);
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
    fn normal(&self, model: &Model, weights: &[f64], prior: &Prior) -> Normal {
        let background = model.parameters[6];
        // Of w h^2 x^i y^j by i and j; of w h and w h residual by i + j as in MONOMIALS.
        let mut squares = [[0.0f64; 5]; 5];
        let mut heights = [0.0f64; 6];
        let mut residuals = [0.0f64; 6];
        let [mut weight_sum, mut residual_sum, mut cost] = [0.0f64; 3];
        self.visit(model, |first, dx0, dy, exponentials| {
            let n = exponentials.len();
            let pixels = exponentials
                .iter()
                .zip(&weights[first..first + n])
                .zip(&self.signal[first..first + n])
                .zip(&self.clipped[first..first + n]);
            let (mut s, mut h, mut r) = ([0.0f64; 5], [0.0f64; 3], [0.0f64; 3]);
            let mut dx = dx0;
            for (((e, weight), signal), clipped) in pixels {
                let height = model.amplitude * e;
                let residual = *signal as f64 - height - background;
                let weight = if *clipped && residual <= 0.0 { 0.0 } else { *weight };
                let (wh, wr) = (weight * height, weight * residual);
                weight_sum += weight;
                residual_sum += wr;
                cost += wr * residual;
                let (whh, whr) = (wh * height, wh * residual);
                let dx2 = dx * dx;
                s[0] += whh;
                s[1] += whh * dx;
                s[2] += whh * dx2;
                s[3] += whh * dx2 * dx;
                s[4] += whh * dx2 * dx2;
                h[0] += wh;
                h[1] += wh * dx;
                h[2] += wh * dx2;
                r[0] += whr;
                r[1] += whr * dx;
                r[2] += whr * dx2;
                dx += self.step as f64;
            }
            let powers = [1.0, dy, dy * dy, dy * dy * dy, dy * dy * dy * dy];
            for (i, s) in s.iter().enumerate() {
                (0..5 - i).for_each(|j| squares[i][j] += s * powers[j]);
            }
            for (k, (i, j)) in MONOMIALS.into_iter().enumerate() {
                heights[k] += h[i] * powers[j];
                residuals[k] += r[i] * powers[j];
            }
        });

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
            squares[i + k][j + l]
        });
        let mut matrix = Matrix::zeros();
        matrix.fixed_view_mut::<6, 6>(0, 0).copy_from(&(derivatives * moments * derivatives.transpose()));
        let border = derivatives * SVector::<f64, 6>::from(heights);
        let descent = derivatives * SVector::<f64, 6>::from(residuals);
        let mut gradient = Vector::zeros();
        for k in 0..6 {
            matrix[(k, 6)] = border[k];
            matrix[(6, k)] = border[k];
            gradient[k] = descent[k];
        }
        matrix[(6, 6)] = weight_sum;
        gradient[6] = residual_sum;
        let mut normal = Normal { cost, matrix, gradient };
        prior.add(&model.parameters, &mut normal);
        normal
    }

    fn prior(&self, model: &Model) -> Prior {
        let finite = self.variance.iter().filter(|v| v.is_finite());
        let (count, sum) = finite.fold((0.0, 0.0), |(n, s), v| (n + 1.0, s + *v as f64));
        let sharpness = 0.5 * (model.parameters[3] + model.parameters[5]);
        Prior { background: count / f64::max(sum, 1e-9), shape: 4.0 / (sharpness * sharpness) }
    }

    /// Covariance and quality of a fit that converged.
    fn judge(&self, model: &Model, normal: Normal) -> Option<Fit> {
        let inverse = normal.matrix.cholesky()?.inverse();
        let mut covariance = [inverse[(0, 0)], inverse[(0, 1)], inverse[(1, 1)]];

        // Sums over all pixels, and over those that hold the spot.
        let [mut all, mut all_square, mut near, mut near_square] = [0.0; 4];
        let [mut energy, mut missed, mut noise] = [0.0; 3];
        let [mut light, mut skew_x, mut skew_y, mut spread_x, mut spread_y] = [0.0; 5];
        let [mut matched, mut matched_square] = [0.0; 2];
        let background = model.parameters[6];
        let top = self.signal.iter().fold(0.0, |m: f32, s| m.max(*s)) as f64;
        let foot = 0.05 * model.amplitude.min(top);
        self.visit(model, |first, dx0, dy, exponentials| {
            for (column, e) in exponentials.iter().enumerate() {
                let (i, dx) = (first + column, dx0 + (column * self.step) as f64);
                let height = model.amplitude * e;
                let variance = self.noise(i, height);
                if !variance.is_finite() {
                    continue;
                }
                let signal = self.signal[i] as f64 - background;
                let residual = self.residual(i, height + background);
                let template = if self.clipped[i] { height.min(signal) } else { height };
                matched += template * signal / variance;
                matched_square += template * template / variance;
                if self.clipped[i] && residual == 0.0 {
                    continue;
                }
                all += 1.0;
                all_square += residual * residual / variance;
                if height < foot {
                    continue;
                }
                near += 1.0;
                near_square += residual * residual / variance;
                energy += signal * signal;
                missed += residual * residual;
                noise += variance;
                light += height;
                skew_x += residual * dx;
                skew_y += residual * dy;
                spread_x += variance * dx * dx;
                spread_y += variance * dy * dy;
            }
        });
        if !(matched > 0.0 && near > 0.0 && light > 0.0) {
            return None;
        }
        // Chi squared beyond what chance gives: the model is wrong by that much everywhere.
        let misfit = |square: f64, freedom: f64| {
            let freedom = freedom.max(1.0);
            square / freedom / (1.0 + 2.0 * (2.0 / freedom).sqrt())
        };
        let excess = misfit(all_square, all - PARAMETERS as f64).max(misfit(near_square, near - 3.0)).max(1.0);
        // Neighbours are wrong in the same way, so that it adds up over about four of them; what is wrong
        // with a clipped spot was allowed for before.
        let excess = if self.has_clipped { excess } else { 1.0 + 4.0 * (excess - 1.0) };
        covariance.iter_mut().for_each(|c| *c *= excess);
        // A lopsided spot has no one centre: the model's and that of its light differ.
        if skew_x * skew_x / spread_x.max(1e-12) + skew_y * skew_y / spread_y.max(1e-12) > 14.0 {
            let [x, y] = [skew_x / light, skew_y / light];
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

    fn gaussian(&self) -> Gaussian {
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
