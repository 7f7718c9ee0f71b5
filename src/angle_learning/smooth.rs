//! A smooth curve through measured angles: the cubic smoothing spline as the mean of an integrated Wiener
//! process about a straight line (Wahba 1978), its roughness and the head's repeatability by restricted
//! maximum likelihood (H. D. Patterson and R. Thompson, Recovery of inter-block information when block
//! sizes are unequal, Biometrika 58, 1971).

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::error::{Degeneracy, Error, Result};

/// Standard deviations of the head's repeatability that are tried, radians, and of the curve's bend over
/// the whole range; and steps of each search.
const REPEATABILITY: [f64; 2] = [1e-6, 1e-2];
const BEND: [f64; 2] = [1e-7, 1.0];
const STEPS: usize = 9;
const ZOOMS: usize = 3;

pub struct Curve {
    /// Angle at each node, radians, and their covariance.
    pub angles: DVector<f64>,
    pub covariance: DMatrix<f64>,
    /// rad^2 per cubed device's unit.
    pub roughness: f64,
    /// How far the head is from the curve each time, radians (standard deviation).
    pub repeatability: f64,
    /// Of each measured angle from the curve, radians.
    pub deviations: Vec<f64>,
}

/// A trial of both standard deviations.
struct Trial {
    factor: Cholesky<f64, Dyn>,
    normal: DMatrix<f64>,
    line: DVector<f64>,
    /// Minus twice the restricted log likelihood.
    cost: f64,
}

struct Data<'a> {
    y: &'a DVector<f64>,
    covariance: &'a DMatrix<f64>,
    /// Places in [0, 1].
    u: Vec<f64>,
    design: DMatrix<f64>,
}

/// Covariance of a unit integrated Wiener process.
fn kernel(s: f64, t: f64) -> f64 {
    let (a, b) = (s.min(t).max(0.0), s.max(t));
    a * a * (3.0 * b - a) / 6.0
}

fn design(u: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(u.len(), 2, |i, j| if j == 0 { 1.0 } else { u[i] })
}

/// Fits angles `y` with `covariance`, measured at the device's numbers `raw`, and answers at `nodes`.
///
/// # Errors
/// `Degenerate` when all numbers are the same or the covariance is none.
pub fn fit(raw: &[f64], y: &DVector<f64>, covariance: &DMatrix<f64>, nodes: &[f64]) -> Result<Curve> {
    let singular = || Error::degenerate(Degeneracy::IllConditioned, "the angles do not determine a curve");
    let low = raw.iter().copied().fold(f64::INFINITY, f64::min);
    let span = raw.iter().copied().fold(f64::NEG_INFINITY, f64::max) - low;
    if !(span > 0.0 && span.is_finite()) {
        return Err(singular());
    }
    let unit = |all: &[f64]| -> Vec<f64> { all.iter().map(|r| (r - low) / span).collect() };
    let u = unit(raw);
    let data = Data { y, covariance, design: design(&u), u };
    let (repeatability, bend, trial) = data.search().ok_or_else(singular)?;
    let process = bend * bend;
    let at = unit(nodes);
    let cross = DMatrix::from_fn(at.len(), data.u.len(), |i, j| process * kernel(at[i], data.u[j]));
    let rest = y - &data.design * &trial.line;
    let solved = trial.factor.solve(&rest);
    let angles = design(&at) * &trial.line + &cross * &solved;
    let across = trial.factor.solve(&cross.transpose());
    let left = design(&at) - across.transpose() * &data.design;
    let line = Cholesky::new(trial.normal.clone()).ok_or_else(singular)?.inverse();
    let prior = DMatrix::from_fn(at.len(), at.len(), |i, j| process * kernel(at[i], at[j]));
    let posterior = prior - &cross * across + &left * line * left.transpose();
    let covariance = DMatrix::from_fn(at.len(), at.len(), |i, j| 0.5 * (posterior[(i, j)] + posterior[(j, i)]));
    let own = DMatrix::from_fn(data.u.len(), data.u.len(), |i, j| process * kernel(data.u[i], data.u[j]));
    let deviations = (rest - own * solved).iter().copied().collect();
    Ok(Curve { angles, covariance, roughness: process / span.powi(3), repeatability, deviations })
}

impl Data<'_> {
    fn trial(&self, repeatability: f64, bend: f64) -> Option<Trial> {
        let n = self.u.len();
        let v = DMatrix::from_fn(n, n, |i, j| {
            let own = if i == j { repeatability * repeatability } else { 0.0 };
            self.covariance[(i, j)] + own + bend * bend * kernel(self.u[i], self.u[j])
        });
        let factor = Cholesky::new(v)?;
        let solved = factor.solve(&self.design);
        let normal = self.design.transpose() * &solved;
        let line = Cholesky::new(normal.clone())?.solve(&(solved.transpose() * self.y));
        let rest = self.y - &self.design * &line;
        let half: f64 = (0..n).map(|i| factor.l_dirty()[(i, i)].ln()).sum();
        let cost = 2.0 * half + normal.determinant().ln() + rest.dot(&factor.solve(&rest));
        cost.is_finite().then_some(Trial { factor, normal, line, cost })
    }

    /// The best pair of standard deviations on a grid of their logarithms that is refined about its best.
    fn search(&self) -> Option<(f64, f64, Trial)> {
        let mut ranges = [REPEATABILITY, BEND].map(|r| r.map(f64::ln));
        let mut best: Option<(f64, f64, Trial)> = None;
        for _ in 0..ZOOMS {
            let step = ranges.map(|[low, high]| (high - low) / (STEPS - 1) as f64);
            for (i, j) in (0..STEPS).flat_map(|i| (0..STEPS).map(move |j| (i, j))) {
                let (a, b) = (ranges[0][0] + step[0] * i as f64, ranges[1][0] + step[1] * j as f64);
                let Some(trial) = self.trial(a.exp(), b.exp()) else { continue };
                if best.as_ref().is_none_or(|(_, _, t)| trial.cost < t.cost) {
                    best = Some((a, b, trial));
                }
            }
            let (a, b, _) = best.as_ref()?;
            ranges = [[a - step[0], a + step[0]], [b - step[1], b + step[1]]];
        }
        best.map(|(a, b, trial)| (a.exp(), b.exp(), trial))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::fake::Random;

    /// Repeated fits of noisy angles: how often the truth lies within two standard deviations.
    fn coverage(truth: impl Fn(f64) -> f64, runs: u64) -> (f64, f64, f64) {
        let raw: Vec<f64> = (0..15).flat_map(|i| [-1.0 + f64::from(i) / 7.0; 5]).collect();
        let nodes: Vec<f64> = (0..15).map(|i| -1.0 + f64::from(i) / 7.0).collect();
        let sigma = 1e-4;
        let (mut inside, mut count, mut square, mut repeat) = (0.0, 0.0, 0.0, 0.0);
        for run in 0..runs {
            let mut random = Random(run);
            let y = DVector::from_iterator(raw.len(), raw.iter().map(|r| truth(*r) + sigma * random.normal()));
            let curve = fit(&raw, &y, &(DMatrix::identity(raw.len(), raw.len()) * 1e-12), &nodes).unwrap();
            repeat += curve.repeatability / runs as f64;
            for (i, r) in nodes.iter().enumerate() {
                let z = (curve.angles[i] - truth(*r)) / curve.covariance[(i, i)].sqrt();
                inside += f64::from(z.abs() < 2.0);
                square += z * z;
                count += 1.0;
            }
        }
        (inside / count, (square / count).sqrt(), repeat / sigma)
    }

    #[test]
    fn sigmas_are_those_of_the_errors() {
        for (name, result) in [
            ("line", coverage(|r| 0.1 - 1.5 * r, 40)),
            ("curve", coverage(|r| 1.5 * r + 0.08 * (2.0 * r).sin() + 0.05 * r * r, 40)),
        ] {
            let (inside, rms, repeat) = result;
            println!(
                "{name}: {inside:.3} within 2 sigma (0.954), errors {rms:.2} sigma, repeatability {repeat:.2} of the true"
            );
            // 600 correlated draws: about 40 x 4 independent ones, sigma 0.02 and 0.06.
            assert!(inside > 0.90 && (0.75..1.25).contains(&rms) && (0.9..1.1).contains(&repeat));
        }
    }

    #[test]
    fn one_place_is_no_curve() {
        let y = DVector::from_element(3, 0.5);
        assert!(fit(&[1.0; 3], &y, &DMatrix::identity(3, 3), &[1.0]).is_err());
    }
}
