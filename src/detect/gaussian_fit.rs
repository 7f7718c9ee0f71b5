//! Maximum-likelihood fit of an elliptical Gaussian to a spot: its centre reaches the Cramer-Rao
//! bound where the spot is one, and says so in its covariance where it is not.

use nalgebra::{SMatrix, SVector};

/// Centre x, y; logarithm of the amplitude; background; inverse covariance of the shape xx, xy, yy; amplitude of the halo.
const PARAMETERS: usize = 8;
type Vector = SVector<f64, PARAMETERS>;
type Matrix = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// Standard deviations in pixels that a spot can have.
const MIN_SIGMA: f64 = 0.2;
const MAX_SIGMA: f64 = 100.0;
/// A hidden peak a million times as high as its foot is no estimate any more.
const MAX_LOG_AMPLITUDE: f64 = 20.0;
/// Residuals beyond this many standard deviations are weighed down (Huber).
const HUBER: f64 = 4.0;
/// Inverse variance of the halo's height, grey levels^-2, before it is seen.
const HALO: f64 = 1e-4;
/// Real spots are Gaussian to about this share of their height; no pixel is an outlier within it.
const MODEL_ERROR: f64 = 0.1;
/// A clipped spot's foot follows the model to this share of its height.
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
    /// Some pixel is clipped.
    pub has_halo: bool,
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

struct Model {
    parameters: Vector,
    amplitude: f64,
}

impl Patch {
    fn rows(&self) -> usize {
        self.signal.len() / self.columns.max(1)
    }

    /// Fits from a start; `None` when there is no such maximum.
    pub fn fit(&self, start: Gaussian) -> Option<Fit> {
        let mut weights: Vec<f64> = Vec::new();
        let mut model = Model::new(&start)?;
        // Once with the noise of the background, then with that of the model and without outliers.
        for pass in 0..3 {
            let changed = self.weigh(&model, pass > 0, &mut weights);
            if pass == 2 && !changed {
                break;
            }
            model = self.descend(model, &weights)?;
        }
        self.judge(&model, &weights)
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

    /// Inverse variances under the model; true when they are not plain background noise.
    fn weigh(&self, model: &Model, robust: bool, weights: &mut Vec<f64>) -> bool {
        weights.resize(self.signal.len(), 0.0);
        let mut changed = robust && (self.has_halo || self.signal_variance > 0.0);
        self.visit(model, |i, _, _, exponential| {
            let (height, _) = self.light(model, exponential);
            let variance = self.noise(i, height);
            let mut weight = 1.0 / variance;
            if robust {
                let residual = self.residual(i, height + model.parameters[3]).abs();
                let limit = HUBER * variance.sqrt() + MODEL_ERROR * height.abs();
                if residual > limit {
                    weight *= limit / residual;
                    changed = true;
                }
            }
            weights[i] = weight;
        });
        changed
    }

    /// Height of the spot where its Gaussian is `e`, and its derivative after the exponent. What is
    /// seen of a clipped spot is its foot, where lens and sensor spread light wider than a Gaussian: a
    /// halo of twice the width stands for that.
    fn light(&self, model: &Model, e: f64) -> (f64, f64) {
        let core = model.amplitude * e;
        if !self.has_halo {
            return (core, core);
        }
        let halo = model.parameters[7] * e.sqrt().sqrt();
        (core + halo, core + 0.25 * halo)
    }

    /// Variance of a pixel under the model. How light spreads about a clipped core is known no better
    /// than to a share of it.
    fn noise(&self, i: usize, height: f64) -> f64 {
        let model = if self.has_halo { FOOT_ERROR * height } else { 0.0 };
        self.variance[i] as f64 + self.signal_variance as f64 * height.max(0.0) + model * model
    }

    /// Signal minus model; a clipped pixel only objects to a model below it.
    fn residual(&self, i: usize, model: f64) -> f64 {
        let residual = self.signal[i] as f64 - model;
        if self.clipped[i] { residual.max(0.0) } else { residual }
    }

    /// Calls with index, dx, dy and exp(-q/2) for each pixel.
    fn visit(&self, model: &Model, mut f: impl FnMut(usize, f64, f64, f64)) {
        let p = &model.parameters;
        let step = self.step as f64;
        // Along a row the exponent is a parabola: its exponential is a recurrence of two products.
        let ratio_of_ratios = (-p[4] * step * step).exp();
        let mut i = 0;
        for row in 0..self.rows() {
            let dy = (self.top + row * self.step) as f64 - p[1];
            let dx0 = self.left as f64 - p[0];
            // Both ways from the column nearest the ridge, where the value is largest.
            let ridge = (-(dx0 + p[5] / p[4] * dy) / step).round().clamp(0.0, (self.columns - 1) as f64);
            let start = ridge as usize;
            let dx = dx0 + ridge * step;
            let value = (-0.5 * (p[4] * dx * dx + 2.0 * p[5] * dx * dy + p[6] * dy * dy)).exp();
            let slope = p[4] * dx + p[5] * dy;
            let mut ratio = (-(slope + 0.5 * p[4] * step) * step).exp();
            let mut v = value;
            for column in start..self.columns {
                f(i + column, dx0 + column as f64 * step, dy, v);
                v *= ratio;
                ratio *= ratio_of_ratios;
            }
            let mut ratio = ((slope - 0.5 * p[4] * step) * step).exp();
            let mut v = value;
            for column in (0..start).rev() {
                v *= ratio;
                ratio *= ratio_of_ratios;
                f(i + column, dx0 + column as f64 * step, dy, v);
            }
            i += self.columns;
        }
    }
    /// Levenberg-Marquardt with fixed weights. Weak priors keep faint spots from degenerating: a
    /// background within the noise, and a shape that is round to a factor of about two.
    fn descend(&self, mut model: Model, weights: &[f64]) -> Option<Model> {
        let prior = self.prior(&model);
        let cost_of = |m: &Model| {
            let mut cost = 0.0;
            self.visit(m, |i, _, _, e| {
                let r = self.residual(i, self.light(m, e).0 + m.parameters[3]);
                cost += weights[i] * r * r;
            });
            cost + prior.cost(&m.parameters)
        };
        let mut damping = 1e-3;
        let mut cost = cost_of(&model);
        for _ in 0..30 {
            let (normal, gradient) = self.normal_equations(&model, weights, &prior);
            let mut gain = 0.0;
            for _ in 0..8 {
                let mut damped = normal;
                for k in 0..PARAMETERS {
                    damped[(k, k)] *= 1.0 + damping;
                }
                let step = damped.cholesky()?.solve(&gradient);
                let trial = Model::of(model.parameters + step);
                let trial_cost = if trial.is_possible() && self.holds(&trial) { cost_of(&trial) } else { f64::INFINITY };
                if trial_cost <= cost {
                    (gain, cost, model) = (cost - trial_cost, trial_cost, trial);
                    damping = (0.1 * damping).max(1e-12);
                    break;
                }
                damping = (10.0 * damping).max(1e-6);
            }
            // In units of chi squared: a thousandth moves nothing by more than 3 % of its deviation.
            if gain < 1e-3 {
                return Some(model);
            }
        }
        // Height and width of a clipped spot trade off along a flat valley; its centre has long settled.
        Some(model)
    }

    fn normal_equations(&self, model: &Model, weights: &[f64], prior: &Prior) -> (Matrix, Vector) {
        let p = &model.parameters;
        // Sums of the upper triangle, and of the gradient.
        let mut upper = [0.0; PARAMETERS * (PARAMETERS + 1) / 2];
        let mut right = [0.0; PARAMETERS];
        self.visit(model, |i, dx, dy, e| {
            let (height, slope) = self.light(model, e);
            let residual = self.residual(i, height + p[3]);
            if self.clipped[i] && residual == 0.0 {
                return;
            }
            let weight = weights[i];
            let jacobian = [
                slope * (p[4] * dx + p[5] * dy),
                slope * (p[5] * dx + p[6] * dy),
                model.amplitude * e,
                1.0,
                -0.5 * slope * dx * dx,
                -slope * dx * dy,
                -0.5 * slope * dy * dy,
                if self.has_halo { e.sqrt().sqrt() } else { 0.0 },
            ];
            let mut k = 0;
            for a in 0..PARAMETERS {
                let weighted = weight * jacobian[a];
                right[a] += weighted * residual;
                for b in a..PARAMETERS {
                    upper[k] += weighted * jacobian[b];
                    k += 1;
                }
            }
        });
        let mut normal = Matrix::zeros();
        let mut k = 0;
        for a in 0..PARAMETERS {
            for b in a..PARAMETERS {
                normal[(a, b)] = upper[k];
                normal[(b, a)] = upper[k];
                k += 1;
            }
        }
        let mut gradient = Vector::from(right);
        prior.add(p, &mut normal, &mut gradient);
        (normal, gradient)
    }

    fn prior(&self, model: &Model) -> Prior {
        let finite = self.variance.iter().filter(|v| v.is_finite());
        let (count, sum) = finite.fold((0.0, 0.0), |(n, s), v| (n + 1.0, s + *v as f64));
        let sharpness = 0.5 * (model.parameters[4] + model.parameters[6]);
        Prior { background: count / f64::max(sum, 1e-9), shape: 4.0 / (sharpness * sharpness) }
    }

    /// Covariance and quality of a fit that converged.
    fn judge(&self, model: &Model, weights: &[f64]) -> Option<Fit> {
        let gaussian = model.gaussian();
        let p = &model.parameters;
        let (normal, _) = self.normal_equations(model, weights, &self.prior(model));
        let inverse = normal.cholesky()?.inverse();
        let mut covariance = [inverse[(0, 0)], inverse[(0, 1)], inverse[(1, 1)]];

        // Sums over all pixels, and over those that hold the spot.
        let [mut all, mut all_square, mut near, mut near_square] = [0.0; 4];
        let [mut energy, mut missed, mut noise] = [0.0; 3];
        let [mut light, mut skew_x, mut skew_y, mut spread_x, mut spread_y] = [0.0; 5];
        let [mut matched, mut matched_square] = [0.0; 2];
        self.visit(model, |i, dx, dy, e| {
            let (height, _) = self.light(model, e);
            let signal = self.signal[i] as f64 - p[3];
            let residual = self.residual(i, height + p[3]);
            let variance = self.noise(i, height);
            if !variance.is_finite() {
                return;
            }
            let template = if self.clipped[i] { height.min(signal) } else { height };
            matched += template * signal / variance;
            matched_square += template * template / variance;
            if self.clipped[i] && residual == 0.0 {
                return;
            }
            all += 1.0;
            all_square += residual * residual / variance;
            if e < 0.05 {
                return;
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
        // Neighbours are wrong in the same way, so that it adds up over about four of them.
        let excess = if self.has_halo { excess } else { 1.0 + 4.0 * (excess - 1.0) };
        covariance.iter_mut().for_each(|c| *c *= excess);
        // A lopsided spot has no one centre: the model's and that of its light differ.
        if skew_x * skew_x / spread_x.max(1e-12) + skew_y * skew_y / spread_y.max(1e-12) > 14.0 {
            let [x, y] = [skew_x / light, skew_y / light];
            covariance = [covariance[0] + x * x, covariance[1] + x * y, covariance[2] + y * y];
        }
        let explained = 1.0 - (missed - noise).max(0.0) / (energy - noise).max(1e-9);
        let fit = Fit { gaussian, covariance, signal_to_noise: matched / matched_square.sqrt(), explained };
        (covariance[0] > 0.0 && covariance[2] > 0.0 && fit.signal_to_noise.is_finite()).then_some(fit)
    }
}

impl Model {
    fn new(start: &Gaussian) -> Option<Self> {
        let [xx, xy, yy] = start.shape;
        let determinant = xx * yy - xy * xy;
        let inverse = [yy / determinant, -xy / determinant, xx / determinant];
        let p = [start.x, start.y, start.amplitude.ln(), 0.0, inverse[0], inverse[1], inverse[2], 0.0];
        let model = Self::of(Vector::from(p));
        model.is_possible().then_some(model)
    }

    fn of(parameters: Vector) -> Self {
        Self { parameters, amplitude: parameters[2].exp() }
    }

    /// Finite, brighter than its background, and an ellipse of a size that a spot can have.
    fn is_possible(&self) -> bool {
        let p = &self.parameters;
        let (mean, half) = (0.5 * (p[4] + p[6]), (0.5 * (p[4] - p[6])).hypot(p[5]));
        p.iter().all(|v| v.is_finite())
            && p[2].abs() < MAX_LOG_AMPLITUDE
            && mean + half <= MIN_SIGMA.powi(-2)
            && mean - half >= MAX_SIGMA.powi(-2)
    }

    fn gaussian(&self) -> Gaussian {
        let p = &self.parameters;
        let determinant = p[4] * p[6] - p[5] * p[5];
        let shape = [p[6] / determinant, -p[5] / determinant, p[4] / determinant];
        Gaussian { x: p[0], y: p[1], amplitude: self.amplitude, shape }
    }
}

/// Normal priors about zero with these inverse variances.
struct Prior {
    background: f64,
    /// Of xx - yy and of 2 xy of the inverse shape.
    shape: f64,
}

impl Prior {
    fn cost(&self, p: &Vector) -> f64 {
        self.background * p[3] * p[3] + HALO * p[7] * p[7] + self.shape * ((p[4] - p[6]).powi(2) + 4.0 * p[5] * p[5])
    }

    fn add(&self, p: &Vector, normal: &mut Matrix, gradient: &mut Vector) {
        normal[(3, 3)] += self.background;
        gradient[3] -= self.background * p[3];
        normal[(7, 7)] += HALO;
        gradient[7] -= HALO * p[7];
        for (a, sign) in [(4, 1.0), (6, -1.0)] {
            normal[(a, a)] += self.shape;
            gradient[a] -= sign * self.shape * (p[4] - p[6]);
        }
        normal[(4, 6)] -= self.shape;
        normal[(6, 4)] -= self.shape;
        normal[(5, 5)] += 4.0 * self.shape;
        gradient[5] -= 4.0 * self.shape * p[5];
    }
}
