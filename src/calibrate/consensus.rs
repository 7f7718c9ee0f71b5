//! Minimal-sample consensus with local optimisation: a projection matrix that half of the measurements
//! agree on, and the scale of their noise. Needs no threshold: it minimises the median (Rousseeuw's
//! least median of squares), so that unmodelled lens distortion or wrong noise cannot mislead it.

use nalgebra::Matrix3x4;
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use super::measurement::Measurement;
use crate::control::Cancel;
use crate::error::{Error, Result};

const MAX_SAMPLES: usize = 1000;
const MIN_SAMPLES: usize = 60;
/// Starts are fitted to, and candidates scored on, at most this many points.
pub(crate) const ENOUGH: usize = 400;
/// Part of the samples without an outlier that lead to the answer.
const USEFUL_POINTS: f64 = 0.67;
/// Lines come in few directions, and several times along one edge: most minimal samples of them are
/// nearly degenerate. With the points' part, 5 % of 200-line sets with 30 % outliers were missed.
const USEFUL_WITH_LINES: f64 = 0.05;
/// Points on which a candidate is looked at first, and how many of them must be nearer than the best
/// candidate's median for a closer look: of a better one half are, and fewer than this by a chance of 1e-4.
pub(crate) const GLANCE: usize = 40;
pub(crate) const PROMISING: usize = 9;
/// Noise beyond the stated one up to which what half of the points agree on is taken for their consensus.
const AS_STATED: f64 = 1.5;
/// Median of a chi-square variable with two degrees of freedom.
pub(crate) const CHI2_MEDIAN: f64 = 1.386_294_361;

/// What a consensus is sought on.
pub(crate) trait Model: Copy {
    /// Squared Mahalanobis distance of the measurement from its prediction; infinite where there is none.
    fn distance(&self, m: &Measurement) -> f64;
}

impl Model for Matrix3x4<f64> {
    fn distance(&self, m: &Measurement) -> f64 {
        m.distance_by_matrix(self)
    }
}

pub(crate) struct Consensus<M> {
    pub projection: M,
    /// Noise in units of the assumed one, from the median distance: too large with outliers, never
    /// much too small.
    pub noise_factor: f64,
}

impl<M> Consensus<M> {
    /// `score`: the median of the squared distances.
    pub fn of(projection: M, score: f64) -> Self {
        Self { projection, noise_factor: (score / CHI2_MEDIAN).sqrt() }
    }
}

/// How candidates are made.
pub(crate) struct Solver<'a, M> {
    /// Points in a minimal sample.
    pub sample: usize,
    pub minimal: &'a dyn Fn(&[&Measurement]) -> Option<M>,
    /// From any number of points, for the local optimisation.
    pub fit: &'a dyn Fn(&[&Measurement]) -> Option<M>,
}

/// The best candidate. `None` when no sample gave a matrix at all.
pub(crate) fn search<M: Model>(
    measurements: &[&Measurement],
    solver: &Solver<'_, M>,
    seed: u64,
    cancel: &Cancel,
) -> Result<Option<Consensus<M>>> {
    let n = measurements.len();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let scored = some(measurements, ENOUGH, &mut rng);
    let mut distances = Vec::with_capacity(scored.len());
    let mut best: Option<(f64, M)> = None;
    let mut needed = MAX_SAMPLES;
    let mut tried = 0;
    // All of them at once: the answer when there are no outliers.
    if let Some(p) = (solver.fit)(&scored) {
        let score = median(&scored, &p, &mut distances);
        // With outliers in it a fit may look like a noisier one without, unless the noise is stated.
        let stated = !measurements.iter().any(|m| m.assumed_noise());
        if stated && score <= CHI2_MEDIAN * AS_STATED * AS_STATED {
            needed = samples_needed(&scored, &p, score, solver.sample, tried);
        }
        best = Some((score, p));
    }
    let mut order: Vec<usize> = (0..n).collect();
    let mut sample = Vec::with_capacity(solver.sample);
    while tried < needed && n > solver.sample {
        if tried % 16 == 0 && cancel.is_cancelled() {
            return Err(Error::Cancelled);
        }
        tried += 1;
        shuffle_front(&mut order, solver.sample, &mut rng);
        sample.clear();
        sample.extend(order[..solver.sample].iter().map(|&i| measurements[i]));
        let Some(p) = (solver.minimal)(&sample) else { continue };
        if best.as_ref().is_some_and(|(b, _)| is_hopeless(&scored, &p, *b)) {
            continue;
        }
        let score = median(&scored, &p, &mut distances);
        if best.as_ref().is_some_and(|(b, _)| score >= *b) {
            continue;
        }
        let (score, p) = optimise_locally(&scored, solver, score, p, &mut distances);
        best = Some((score, p));
        needed = samples_needed(&scored, &p, score, solver.sample, tried);
    }
    Ok(best.filter(|(score, _)| score.is_finite()).map(|(score, projection)| {
        let mut found = Consensus::of(projection, score);
        // The sample fits itself: Rousseeuw's correction for small sets.
        found.noise_factor *= 1.0 + 5.0 / n.saturating_sub(solver.sample).max(1) as f64;
        found
    }))
}

/// As many of the measurements, taken at random, as a start needs.
pub(crate) fn few<'a>(measurements: &[&'a Measurement], seed: u64) -> Vec<&'a Measurement> {
    some(measurements, ENOUGH, &mut ChaCha8Rng::seed_from_u64(seed))
}

/// As many as that, taken at random.
pub(crate) fn some<T: Copy>(all: &[T], count: usize, rng: &mut ChaCha8Rng) -> Vec<T> {
    if all.len() <= count {
        return all.to_vec();
    }
    let mut order: Vec<usize> = (0..all.len()).collect();
    shuffle_front(&mut order, count, rng);
    order[..count].iter().map(|&i| all[i]).collect()
}

/// Fits the better half of the points again and again while that lowers the median.
fn optimise_locally<M: Model>(
    scored: &[&Measurement],
    solver: &Solver<'_, M>,
    mut score: f64,
    mut p: M,
    distances: &mut Vec<f64>,
) -> (f64, M) {
    for _ in 0..4 {
        let half: Vec<&Measurement> = scored.iter().filter(|m| p.distance(m) <= score).copied().collect();
        let Some(q) = (solver.fit)(&half) else { break };
        let next = median(scored, &q, distances);
        if next.is_nan() || next >= score {
            break;
        }
        (score, p) = (next, q);
    }
    (score, p)
}

/// Does a glance at some of the points show that their median is not below `best`?
fn is_hopeless<M: Model>(scored: &[&Measurement], p: &M, best: f64) -> bool {
    let step = scored.len() / GLANCE;
    let seen = scored.iter().step_by(step.max(1)).take(GLANCE);
    step >= 4 && seen.filter(|m| p.distance(m) < best).count() < PROMISING
}

/// The median of the squared distances.
pub(crate) fn median<M: Model>(scored: &[&Measurement], p: &M, distances: &mut Vec<f64>) -> f64 {
    distances.clear();
    distances.extend(scored.iter().map(|m| p.distance(m)));
    *distances.select_nth_unstable_by(scored.len() / 2, f64::total_cmp).1
}

/// Samples after which a clean one has been missed with a chance below 1e-9, of which those are counted
/// that are of use for their geometry.
fn samples_needed<M: Model>(scored: &[&Measurement], p: &M, score: f64, sample: usize, tried: usize) -> usize {
    let limit = score / CHI2_MEDIAN * 9.2;
    let inliers = scored.iter().filter(|m| p.distance(m) <= limit).count();
    let ratio = inliers as f64 / scored.len() as f64;
    let useful = if scored.iter().any(|m| m.as_line().is_some()) { USEFUL_WITH_LINES } else { USEFUL_POINTS };
    let clean = ratio.powi(sample as i32) * useful;
    let needed = (1e-9f64.ln() / (1.0 - clean).ln()).ceil();
    (needed as usize).clamp(MIN_SAMPLES.max(tried), MAX_SAMPLES)
}

/// Puts a random selection of `count` entries first (a partial Fisher-Yates shuffle).
fn shuffle_front(order: &mut [usize], count: usize, rng: &mut ChaCha8Rng) {
    for i in 0..count {
        let left = (order.len() - i) as u64;
        let j = i + ((rng.next_u64() as u128 * left as u128) >> 64) as usize;
        order.swap(i, j);
    }
}
