//! Least median of squares over minimal samples (Rousseeuw 1984): a plane that the majority of the
//! measurements agrees with, whatever the others are.

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

/// With half of the measurements gross outliers, all samples are spoilt once in 5e8 fits.
const SAMPLES: usize = 150;
/// Measurements on which samples are scored.
const SCORED: usize = 1000;

/// The model of three measurements with the smallest median residual. `fit` may refuse a sample.
pub(super) fn least_median(
    count: usize,
    seed: u64,
    fit: impl Fn([usize; 3]) -> Option<Vector3<f64>>,
    residual: impl Fn(&Vector3<f64>, usize) -> f64,
) -> Option<Vector3<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = || (rng.next_u64() % count as u64) as usize;
    // The median of a random thousand is that of all to a few per cent.
    let scored: Vec<usize> =
        if count > 2 * SCORED { (0..SCORED).map(|_| draw()).collect() } else { (0..count).collect() };
    let mut best: Option<(f64, Vector3<f64>)> = None;
    for _ in 0..SAMPLES {
        let sample = [draw(), draw(), draw()];
        let [i, j, k] = sample;
        if i == j || j == k || k == i {
            continue;
        }
        let Some(model) = fit(sample) else { continue };
        let median = median_of(scored.len(), |i| residual(&model, scored[i]));
        if median.is_finite() && best.as_ref().is_none_or(|(least, _)| median < *least) {
            best = Some((median, model));
        }
    }
    best.map(|(_, model)| model)
}

/// Which measurements lie within `threshold` robust standard deviations of a model. The deviation
/// is taken from the median residual, but is at least `floor`.
pub(super) fn inliers(count: usize, threshold: f64, floor: f64, residual: impl Fn(usize) -> f64) -> Vec<bool> {
    // 1.4826: median to standard deviation of a Gaussian; the rest corrects for few measurements.
    let scale = 1.4826 * (1.0 + 5.0 / (count as f64 - 3.0).max(1.0)) * median_of(count, &residual);
    let limit = threshold * scale.max(floor);
    (0..count).map(|i| residual(i).abs() <= limit).collect()
}

fn median_of(count: usize, residual: impl Fn(usize) -> f64) -> f64 {
    let mut sizes: Vec<f64> = (0..count).map(|i| residual(i).abs()).collect();
    // Enough of them for a majority together with the three that the model passes through.
    let middle = (count / 2 + 1).min(count - 1);
    *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
}
