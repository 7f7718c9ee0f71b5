//! The homography of each view, by all corners or, where some are far off, by least median of squares.

use nalgebra::{Matrix3, Vector2};
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use crate::calibrate::consensus::{GLANCE, PROMISING};
use crate::geometry::homography;

/// Samples of four corners: a clean one is missed once in 10^5 when half of the corners are wrong.
const SAMPLES: usize = 180;
/// A corner this many times farther off than the median one calls for the search, as does a median one
/// that is off by this part of the board's image.
const SUSPICIOUS: f64 = 6.0;
const SUSPICIOUS_MEDIAN: f64 = 0.01;

pub(crate) struct ViewHomography {
    pub matrix: Matrix3<f64>,
    /// Median distance of the corners from their prediction, in the units of the image.
    pub median: f64,
}

/// Board to image; `None` when the corners determine none.
pub(crate) fn of_view(
    board: &[Vector2<f64>],
    image: &[Vector2<f64>],
    robust: bool,
    seed: u64,
) -> Option<ViewHomography> {
    let mut distances = Vec::with_capacity(board.len());
    let all = homography::estimate(board, image).ok()?;
    let (mut best, largest) = scored(all, board, image, &mut distances);
    let clean = largest <= SUSPICIOUS * best.median && best.median <= SUSPICIOUS_MEDIAN * extent(image);
    if !robust || board.len() <= 4 || clean {
        return Some(best);
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut order: Vec<usize> = (0..board.len()).collect();
    for _ in 0..SAMPLES {
        for i in 0..4 {
            let left = (order.len() - i) as u64;
            let j = i + ((u128::from(rng.next_u64()) * u128::from(left)) >> 64) as usize;
            order.swap(i, j);
        }
        let pick = |points: &[Vector2<f64>]| -> [Vector2<f64>; 4] { std::array::from_fn(|i| points[order[i]]) };
        let Some(sample) = homography::of_four(&pick(board), &pick(image)) else { continue };
        if is_hopeless(&sample, board, image, best.median) {
            continue;
        }
        let (candidate, _) = scored(sample, board, image, &mut distances);
        if candidate.median < best.median {
            best = candidate;
        }
    }
    // The better half of the corners: steadier than four of them.
    let limit = 4.0 * best.median * best.median;
    let (b, i): (Vec<_>, Vec<_>) =
        board.iter().zip(image).filter(|(b, i)| distance2(&best.matrix, b, i) <= limit).unzip();
    if let Ok(matrix) = homography::estimate(&b, &i) {
        best = scored(matrix, board, image, &mut distances).0;
    }
    Some(best)
}

/// Does a glance at some of the corners show that their median distance is not below `best`?
fn is_hopeless(h: &Matrix3<f64>, board: &[Vector2<f64>], image: &[Vector2<f64>], best: f64) -> bool {
    let step = board.len() / GLANCE;
    let seen = board.iter().zip(image).step_by(step.max(1)).take(GLANCE);
    step >= 2 && seen.filter(|(b, i)| distance2(h, b, i) < best * best).count() < PROMISING
}

/// Mean distance from the middle.
fn extent(points: &[Vector2<f64>]) -> f64 {
    let n = points.len() as f64;
    let middle = points.iter().sum::<Vector2<f64>>() / n;
    points.iter().map(|p| (p - middle).norm()).sum::<f64>() / n
}

fn distance2(h: &Matrix3<f64>, board: &Vector2<f64>, image: &Vector2<f64>) -> f64 {
    homography::apply(h, board).map_or(f64::INFINITY, |p| (p - image).norm_squared())
}

/// With its median distance, and the largest.
fn scored(
    matrix: Matrix3<f64>,
    board: &[Vector2<f64>],
    image: &[Vector2<f64>],
    distances: &mut Vec<f64>,
) -> (ViewHomography, f64) {
    distances.clear();
    distances.extend(board.iter().zip(image).map(|(b, i)| distance2(&matrix, b, i)));
    let largest = distances.iter().copied().fold(0.0, f64::max).sqrt();
    let middle = distances.len() / 2;
    let median = distances.select_nth_unstable_by(middle, f64::total_cmp).1.sqrt();
    (ViewHomography { matrix, median }, largest)
}
