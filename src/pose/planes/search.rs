//! Sequential consensus of planes (RANSAC; Fischler and Bolles, CACM 1981) with local samples
//! (Schnabel, Wahl and Klein, "Efficient RANSAC for point-cloud shape detection", CGF 2007).
//!
//! A plane that holds one measurement in a hundred is hit once in a million samples of any three
//! measurements, but once in a few hundred of three neighbours. Neighbours are had without a search
//! tree: in Morton order, a window is a neighbourhood, of whatever size.

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_core::Rng;

use super::measured::Measured;
use super::patch;

/// Half widths of the windows that samples are taken from. Of the narrow ones all are fitted: three
/// neighbours span no plane for their noise.
const WINDOWS: [usize; 4] = [6, 16, 64, 512];
const FITTED: usize = 16;
/// Measurements on which candidates are scored.
const SCORED: usize = 4096;
/// Measurements at which a first glance is taken, and the significance there of a promising candidate.
const GLANCE: usize = 128;
const PROMISING: f64 = 2.0;
/// Of the samples that start on a plane, those that lead to it.
const USEFUL: f64 = 0.15;
/// Samples for one plane, and the chance to overlook it.
const MIN_SAMPLES: usize = 60;
const MAX_SAMPLES: usize = 1500;
const OVERLOOKED: f64 = 0.01;
/// Hunts without a plane after which there are no more.
const MISSES: usize = 2;
/// Rounds in which a candidate is fitted to what agrees with it.
const ROUNDS: usize = 8;
/// Least significance of a surface. Thousands of candidates are tried, and not one may be luck.
const SIGNIFICANT: f64 = 5.0;

/// How many measurements agree with a plane, and how many lie in two shells of the same thickness
/// just before and behind it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Contrast {
    pub inliers: usize,
    pub shells: usize,
}

impl Contrast {
    /// By how many standard deviations there are more than twice as many measurements in it as around
    /// it. A cut through clutter has as many.
    pub fn significance(&self) -> f64 {
        let (inside, around) = (self.inliers as f64, self.shells as f64);
        (inside - 2.0 * around) / (inside + 4.0 * around).sqrt().max(1.0)
    }

    pub fn is_surface(&self, min_points: usize) -> bool {
        self.inliers >= min_points && self.significance() >= SIGNIFICANT
    }

    pub fn add(&mut self, residual: f64, threshold: f64) {
        let size = residual.abs();
        self.inliers += usize::from(size <= threshold);
        self.shells += usize::from(size > threshold && size <= 2.0 * threshold);
    }
}

pub(super) struct Limits {
    /// Standard deviations within which a measurement agrees.
    pub threshold: f64,
    pub min_points: usize,
    pub max_planes: usize,
}

/// Planes, the most significant first. The measurements are in Morton order.
pub(super) fn search<M: Measured>(m: &M, limits: &Limits, rng: &mut ChaCha8Rng) -> Vec<Vector3<f64>> {
    let mut free: Vec<u32> = (0..m.count() as u32).collect();
    let (mut planes, mut misses) = (Vec::new(), 0);
    while planes.len() < limits.max_planes && free.len() >= limits.min_points && misses < MISSES {
        let mut scored = free.clone();
        shuffle(&mut scored, SCORED, rng);
        scored.truncate(SCORED);
        // Beside each other in memory: they are looked at thousands of times.
        let (chosen, indices) = (m.subset(&scored), Vec::from_iter(0..scored.len() as u32));
        let scored = Part { m: &chosen, indices: &indices };
        let hunt = Hunt { limits, free: Part { m, indices: &free }, scored };
        let Some(n) = hunt.best(rng) else {
            misses += 1;
            continue;
        };
        // The shells go too: what noise and unevenness leave there would look like planes of its own.
        let residual = m.residuals(&n);
        free.retain(|i| residual(*i as usize).abs() > 2.0 * limits.threshold);
        planes.push(n);
    }
    planes
}

/// The first `count` places get a random choice of all.
pub(super) fn shuffle(order: &mut [u32], count: usize, rng: &mut ChaCha8Rng) {
    for i in 0..count.min(order.len()) {
        let other = i + below(order.len() - i, rng);
        order.swap(i, other);
    }
}

fn below(count: usize, rng: &mut ChaCha8Rng) -> usize {
    (rng.next_u64() % count as u64) as usize
}

/// Some of the measurements.
struct Part<'a, M> {
    m: &'a M,
    indices: &'a [u32],
}

impl<M> Clone for Part<'_, M> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M> Copy for Part<'_, M> {}

/// The search for one plane.
struct Hunt<'a, M> {
    limits: &'a Limits,
    /// Those of no plane yet, in Morton order.
    free: Part<'a, M>,
    /// A random choice of them, in random order.
    scored: Part<'a, M>,
}

impl<M: Measured> Hunt<'_, M> {
    /// The most significant plane; `None` where none was met.
    fn best(&self, rng: &mut ChaCha8Rng) -> Option<Vector3<f64>> {
        let mut best: Option<(Contrast, Vector3<f64>)> = None;
        let (mut needed, mut tried) = (MAX_SAMPLES, 0);
        while tried < needed {
            tried += 1;
            let Some((n, around)) = self.sample(rng) else { continue };
            if self.contrast(&n, around).significance() < PROMISING {
                continue;
            }
            if best.is_some_and(|(_, known)| self.is_part_of(&n, &known, around)) {
                continue;
            }
            let least = best.map_or(0, |(b, _)| b.inliers / 4);
            // A rough candidate grows by being fitted: a quarter of the best may become the best.
            let score = self.contrast(&n, self.scored);
            if score.inliers < least {
                continue;
            }
            let (score, n) = self.grow(score, n);
            if best.is_none_or(|(b, _)| score.significance() > b.significance()) {
                best = Some((score, n));
                needed = samples_needed(score.inliers as f64 / self.scored.indices.len() as f64);
            }
        }
        let n = self.on_one_patch(self.refine(best?.1, self.free, 3));
        self.contrast(&n, self.free).is_surface(self.limits.min_points).then_some(n)
    }

    /// A plane through neighbours, and those around them that must bear it out.
    fn sample(&self, rng: &mut ChaCha8Rng) -> Option<(Vector3<f64>, Part<'_, M>)> {
        let Part { m, indices: free } = self.free;
        let count = free.len();
        let middle = below(count, rng);
        let window = |half: usize| &free[middle.saturating_sub(half)..middle.saturating_add(half).min(count)];
        let half = *WINDOWS.get(below(WINDOWS.len() + 1, rng)).unwrap_or(&count);
        let near = window(half);
        let around = if half < count {
            Part { m, indices: window(half.max(GLANCE / 2)) }
        } else {
            let Part { m, indices } = self.scored;
            Part { m, indices: &indices[..indices.len().min(GLANCE)] }
        };
        if half <= FITTED {
            return Some((m.quick_fit(near)?, around));
        }
        let three = [free[middle], near[below(near.len(), rng)], near[below(near.len(), rng)]];
        if three[0] == three[1] || three[1] == three[2] || three[2] == three[0] {
            return None;
        }
        Some((m.quick_fit(&three)?, around))
    }

    fn contrast(&self, n: &Vector3<f64>, among: Part<'_, M>) -> Contrast {
        let (mut contrast, residual) = (Contrast::default(), among.m.residuals(n));
        among.indices.iter().for_each(|i| contrast.add(residual(*i as usize), self.limits.threshold));
        contrast
    }

    /// Whether nearly all that agrees with a candidate agrees with a known plane, to which it would grow.
    fn is_part_of(&self, n: &Vector3<f64>, known: &Vector3<f64>, among: Part<'_, M>) -> bool {
        let (residual, other) = (among.m.residuals(n), among.m.residuals(known));
        let (mut own, mut common) = (0, 0);
        for i in among.indices.iter().map(|i| *i as usize).filter(|i| residual(*i).abs() <= self.limits.threshold) {
            own += 1;
            common += usize::from(other(i).abs() <= self.limits.threshold);
        }
        10 * common >= 9 * own
    }

    /// Fits a candidate to what agrees with it as long as that makes it more significant.
    fn grow(&self, score: Contrast, n: Vector3<f64>) -> (Contrast, Vector3<f64>) {
        let mut best = (score, n);
        for _ in 0..ROUNDS {
            let n = self.refine(best.1, self.scored, 1);
            let score = self.contrast(&n, self.scored);
            if score.significance() <= best.0.significance() {
                break;
            }
            best = (score, n);
        }
        best
    }

    fn refine(&self, mut n: Vector3<f64>, among: Part<'_, M>, rounds: usize) -> Vector3<f64> {
        for _ in 0..rounds {
            let inliers = self.inliers(&n, among);
            match among.m.quick_fit(&inliers) {
                Some(better) if inliers.len() >= 3 => n = better,
                _ => break,
            }
        }
        n
    }

    /// The plane of the largest connected part, and of whatever else lies on that.
    fn on_one_patch(&self, n: Vector3<f64>) -> Vector3<f64> {
        let m = self.free.m;
        let inliers = self.inliers(&n, self.free);
        let (used, places): (Vec<u32>, Vec<Vector3<f64>>) =
            inliers.iter().filter_map(|i| Some((*i, m.position(*i as usize)?))).unzip();
        let part: Vec<u32> = patch::largest(&places, &n).into_iter().map(|k| used[k]).collect();
        if part.len() == inliers.len() || part.len() < 3 {
            return n;
        }
        m.quick_fit(&part).map_or(n, |n| self.refine(n, self.free, 1))
    }

    fn inliers(&self, n: &Vector3<f64>, among: Part<'_, M>) -> Vec<u32> {
        let residual = among.m.residuals(n);
        among.indices.iter().filter(|i| residual(**i as usize).abs() <= self.limits.threshold).copied().collect()
    }
}

/// Samples after which a plane with this share of the free measurements was overlooked by chance.
fn samples_needed(share: f64) -> usize {
    let missed = (1.0 - USEFUL * share).ln();
    if missed >= 0.0 {
        return MAX_SAMPLES;
    }
    ((OVERLOOKED.ln() / missed).ceil() as usize).clamp(MIN_SAMPLES, MAX_SAMPLES)
}
