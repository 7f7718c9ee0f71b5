//! Sequential consensus of planes (RANSAC; Fischler and Bolles, CACM 1981) with local samples
//! (Schnabel, Wahl and Klein, "Efficient RANSAC for point-cloud shape detection", CGF 2007).
//!
//! A plane that holds one measurement in a hundred is hit once in a million samples of any three
//! measurements, but once in a few hundred of three neighbours. Neighbours are had without a search
//! tree: in Morton order, a window is a neighbourhood, of whatever size.

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_core::Rng;

use super::kernels::{Columns, Cut, Tally, common, count, residuals, sums, tally};
use super::patch;
use super::rows::{Kind, Rows};

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
/// Best candidates that are no surfaces after which there are no more: cuts through clutter, which are not
/// looked at again.
const MISSES: usize = 5;
/// Measurements whose distances are held at a time.
const STRETCH: usize = 1024;
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
}

impl From<&Tally> for Contrast {
    fn from(tally: &Tally) -> Self {
        Self { inliers: tally.inside.count, shells: tally.shells }
    }
}

pub(super) struct Limits {
    /// Standard deviations within which a measurement agrees.
    pub threshold: f64,
    pub min_points: usize,
    pub max_planes: usize,
}

/// Planes, the most significant first. The measurements are in Morton order.
pub(super) fn search(m: Rows, kind: &Kind, limits: &Limits, rng: &mut ChaCha8Rng) -> Vec<Vector3<f64>> {
    let mut free = m;
    let (mut planes, mut rejected) = (Vec::new(), Vec::new());
    while planes.len() < limits.max_planes && free.count() >= limits.min_points && rejected.len() < MISSES {
        let scored = free.gather(&some_of(free.count(), SCORED, rng));
        let hunt = Hunt { limits, kind, free: &free, scored: &scored, rejected: &rejected };
        let Some(n) = hunt.best(rng) else { break };
        if !hunt.contrast(&n, &free.columns()).is_surface(limits.min_points) {
            rejected.push(n);
            continue;
        }
        planes.push(n);
        if planes.len() < limits.max_planes {
            // The shells go too: what noise and unevenness leave there would look like planes of its own.
            let left = chosen(&free, &kind.cut(&n), |size| size > 2.0 * limits.threshold || size.is_nan());
            free.keep(&left);
        }
    }
    planes
}

/// A random choice in random order, as many as are wanted if there are.
pub(super) fn some_of(count: usize, wanted: usize, rng: &mut ChaCha8Rng) -> Vec<u32> {
    let mut all: Vec<u32> = (0..count as u32).collect();
    for i in 0..wanted.min(count) {
        let other = i + below(count - i, rng);
        all.swap(i, other);
    }
    all.truncate(wanted);
    all
}

fn below(count: usize, rng: &mut ChaCha8Rng) -> usize {
    (rng.next_u64() % count as u64) as usize
}

/// Which rows are so far from a plane.
fn chosen(rows: &Rows, cut: &Cut, is_chosen: impl Fn(f64) -> bool) -> Vec<u32> {
    let (mut residual, mut all, mut count) = ([0.0; STRETCH], vec![0; rows.count()], 0);
    for start in (0..rows.count()).step_by(STRETCH) {
        let end = rows.count().min(start + STRETCH);
        residuals(&mut residual[..end - start], &rows.part(start, end), cut);
        for (i, r) in residual[..end - start].iter().enumerate() {
            // Without a branch that noise decides.
            all[count] = (start + i) as u32;
            count += usize::from(is_chosen(r.abs()));
        }
    }
    all.truncate(count);
    all
}

/// The search for one plane.
struct Hunt<'a> {
    limits: &'a Limits,
    kind: &'a Kind,
    /// Those of no plane yet, in Morton order.
    free: &'a Rows,
    /// A random choice of them, in random order.
    scored: &'a Rows,
    /// Candidates that were the best before and are no surfaces.
    rejected: &'a [Vector3<f64>],
}

impl Hunt<'_> {
    /// The most significant candidate, fitted to all that agrees with it; `None` where none was met.
    fn best(&self, rng: &mut ChaCha8Rng) -> Option<Vector3<f64>> {
        let mut best: Option<(Contrast, Vector3<f64>)> = None;
        let (mut needed, mut tried) = (MAX_SAMPLES, 0);
        while tried < needed {
            tried += 1;
            let Some((n, around)) = self.sample(rng) else { continue };
            if self.contrast(&n, &around).significance() < PROMISING {
                continue;
            }
            let known = || self.rejected.iter().copied().chain(best.map(|(_, n)| n));
            if known().any(|known| self.is_part_of(&n, &known, &around)) {
                continue;
            }
            let least = best.map_or(0, |(b, _)| b.inliers / 4);
            // A rough candidate grows by being fitted: a quarter of the best may become the best.
            let score = self.tally(&n, self.scored);
            if score.inside.count < least {
                continue;
            }
            let (score, n) = self.grow(score, n);
            let all = self.scored.columns();
            if self.rejected.iter().any(|known| self.is_part_of(&n, known, &all)) {
                continue;
            }
            if best.is_none_or(|(b, _)| score.significance() > b.significance()) {
                best = Some((score, n));
                needed = samples_needed(score.inliers as f64 / self.scored.count() as f64);
            }
        }
        Some(self.on_one_patch(self.refine(best?.1, 3)))
    }

    /// A plane through neighbours, and those around them that must bear it out.
    fn sample(&self, rng: &mut ChaCha8Rng) -> Option<(Vector3<f64>, Columns<'_>)> {
        let count = self.free.count();
        let middle = below(count, rng);
        let window = |half: usize| [middle.saturating_sub(half), middle.saturating_add(half).min(count)];
        let part = |[start, end]: [usize; 2]| self.free.part(start, end);
        let half = *WINDOWS.get(below(WINDOWS.len() + 1, rng)).unwrap_or(&count);
        let near = window(half);
        let around = if half < count {
            part(window(half.max(GLANCE / 2)))
        } else {
            self.scored.part(0, self.scored.count().min(GLANCE))
        };
        if half <= FITTED {
            return Some((self.kind.solve(&sums(&part(near)))?, around));
        }
        let mut any = || near[0] + below(near[1] - near[0], rng);
        let three = [middle, any(), any()];
        if three[0] == three[1] || three[1] == three[2] || three[2] == three[0] {
            return None;
        }
        Some((self.kind.through(three.map(|i| self.free.row(i)))?, around))
    }

    fn contrast(&self, n: &Vector3<f64>, among: &Columns<'_>) -> Contrast {
        let [inliers, shells] = count(among, &self.kind.cut(n), self.limits.threshold);
        Contrast { inliers, shells }
    }

    fn tally(&self, n: &Vector3<f64>, among: &Rows) -> Tally {
        tally(&among.columns(), &self.kind.cut(n), self.limits.threshold)
    }

    /// Whether nearly all that agrees with a candidate agrees with a known plane, to which it would grow.
    fn is_part_of(&self, n: &Vector3<f64>, known: &Vector3<f64>, among: &Columns<'_>) -> bool {
        let [own, both] = common(among, [&self.kind.cut(n), &self.kind.cut(known)], self.limits.threshold);
        10 * both >= 9 * own
    }

    /// Fits a candidate to what agrees with it as long as that makes it more significant.
    fn grow(&self, mut tally: Tally, n: Vector3<f64>) -> (Contrast, Vector3<f64>) {
        let mut best = (Contrast::from(&tally), n);
        for _ in 0..ROUNDS {
            let Some(n) = self.fit(&tally) else { break };
            tally = self.tally(&n, self.scored);
            let score = Contrast::from(&tally);
            if score.significance() <= best.0.significance() {
                break;
            }
            best = (score, n);
        }
        best
    }

    fn fit(&self, tally: &Tally) -> Option<Vector3<f64>> {
        if tally.inside.count >= 3 { self.kind.solve(&tally.inside) } else { None }
    }

    fn refine(&self, mut n: Vector3<f64>, rounds: usize) -> Vector3<f64> {
        for _ in 0..rounds {
            let Some(better) = self.fit(&self.tally(&n, self.free)) else { break };
            n = better;
        }
        n
    }

    /// The plane of the largest connected part, and of whatever else lies on that.
    fn on_one_patch(&self, n: Vector3<f64>) -> Vector3<f64> {
        let inliers = chosen(self.free, &self.kind.cut(&n), |size| size <= self.limits.threshold);
        let places: Vec<Vector3<f64>> = inliers.iter().map(|i| self.free.place(*i as usize)).collect();
        let part: Vec<u32> = patch::largest(&places, &n).into_iter().map(|k| inliers[k]).collect();
        if part.len() == inliers.len() || part.len() < 3 {
            return n;
        }
        let part = self.free.gather(&part);
        self.kind.solve(&sums(&part.columns())).map_or(n, |n| self.refine(n, 1))
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
