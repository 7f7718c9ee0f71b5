//! More pairs than features alone can tell: with a first camera each auxiliary feature is looked for
//! only where that camera would see it, and there few others look alike.

use nalgebra::{Matrix2, Vector2};

use super::lift::Lifted;
use super::view::View;
use crate::calibrate::Calibration;
use crate::detect::sift::{Descriptor, SiftFeatures};

/// Squared Mahalanobis distance of a feature from its expected place: a chance of 1 in 1000.
const GATE: f64 = 13.8;
/// Furthest that a feature may be from its expected place, pixels: where the first camera says little
/// more it is no guide.
const MAX_REACH: f64 = 32.0;
/// Greatest ratio of a feature's scale to the one expected, either way.
const MAX_SCALE_RATIO: f64 = 1.6;
/// Side of a cell of the index, pixels.
const CELL: f64 = 32.0;

/// The fixed camera's features by where they are.
struct Index<'a> {
    features: &'a SiftFeatures,
    columns: usize,
    rows: usize,
    cells: Vec<Vec<usize>>,
}

impl<'a> Index<'a> {
    fn new(features: &'a SiftFeatures, width: u32, height: u32) -> Self {
        let [columns, rows] = [width, height].map(|n| (f64::from(n) / CELL) as usize + 1);
        let mut index = Self { features, columns, rows, cells: vec![Vec::new(); columns * rows] };
        for (i, k) in features.keypoints.iter().enumerate() {
            let cell = index.cell(k.x, columns) + columns * index.cell(k.y, rows);
            index.cells[cell].push(i);
        }
        index
    }

    fn cell(&self, at: f64, cells: usize) -> usize {
        ((at / CELL).max(0.0) as usize).min(cells - 1)
    }

    /// Features no further than `reach` from a place along x and y.
    fn near(&self, at: &Vector2<f64>, reach: f64) -> impl Iterator<Item = usize> {
        let (left, right) = (self.cell(at.x - reach, self.columns), self.cell(at.x + reach, self.columns));
        let (top, bottom) = (self.cell(at.y - reach, self.rows), self.cell(at.y + reach, self.rows));
        (top..=bottom)
            .flat_map(move |y| (left..=right).map(move |x| y * self.columns + x))
            .flat_map(|c| self.cells[c].iter().copied())
    }
}

/// Pairs of a view's features with depth and the fixed camera's, each the other's best where the camera
/// expects it and distinctly better than the next. `sigma`: of keypoints, pixels.
pub(super) fn pairs(
    view: &View,
    features: &SiftFeatures,
    first: &Calibration,
    sigma: f64,
    max_ratio: f64,
) -> Vec<(usize, usize)> {
    let guide = Guide { index: Index::new(features, first.camera.width, first.camera.height), first, sigma, max_ratio };
    let mut best: Vec<Option<(usize, i32)>> = vec![None; features.keypoints.len()];
    for (a, lifted) in view.lifted.iter().enumerate() {
        let Some((b, distance)) = lifted.as_ref().and_then(|l| guide.find(view, a, l)) else { continue };
        if best[b].is_none_or(|(_, other)| distance < other) {
            best[b] = Some((a, distance));
        }
    }
    best.iter().enumerate().filter_map(|(b, found)| Some((found.as_ref()?.0, b))).collect()
}

struct Guide<'a> {
    index: Index<'a>,
    first: &'a Calibration,
    sigma: f64,
    max_ratio: f64,
}

impl Guide<'_> {
    /// The feature that looks most like feature `a` of the view where it is expected.
    fn find(&self, view: &View, a: usize, lifted: &Lifted) -> Option<(usize, i32)> {
        let Self { index, first, sigma, max_ratio } = self;
        let expected = first.project(&lifted.world, Some(&lifted.covariance(*sigma))).ok()?;
        let covariance = expected.covariance + Matrix2::identity() * sigma.powi(2);
        let information = covariance.try_inverse()? / first.noise_factor.max(1.0).powi(2);
        let reach = (GATE * covariance.symmetric_eigenvalues().max()).sqrt() * first.noise_factor.max(1.0);
        if !(reach <= MAX_REACH) {
            return None;
        }
        let intrinsics = &first.camera.intrinsics;
        let z = first.camera.pose.apply(&lifted.world).z;
        let scale =
            view.features.keypoints[a].scale * lifted.metres_per_pixel * (intrinsics.fx * intrinsics.fy).sqrt() / z;
        let (mut best, mut second) = (None, i32::MAX);
        for b in index.near(&expected.pixel, reach) {
            let k = &index.features.keypoints[b];
            let ratio = k.scale / scale;
            let off = Vector2::new(k.x, k.y) - expected.pixel;
            if !(1.0 / ev("SCALE", 1.6)..=ev("SCALE", 1.6)).contains(&ratio) || off.dot(&(information * off)) > GATE {
                continue;
            }
            let distance = squared_distance(&view.features.descriptors[a], &index.features.descriptors[b]);
            match best {
                Some((_, least)) if distance >= least => second = second.min(distance),
                _ => {
                    second = best.map_or(second, |(_, d)| d);
                    best = Some((b, distance));
                }
            }
        }
        let (_, distance) = best?;
        let ratio = (f64::from(distance) / f64::from(second)).sqrt();
        // Of a lone candidate only likeness itself can tell.
        (ratio <= *max_ratio && f64::from(distance) <= ev("DIST", 300.0).powi(2)).then_some(best?)
    }
}

/// Of descriptors of length 512: of different things most differ by more.
const MAX_DISTANCE: i32 = 300;

fn squared_distance(a: &Descriptor, b: &Descriptor) -> i32 {
    a.iter().zip(b).map(|(a, b)| (i32::from(*a) - i32::from(*b)).pow(2)).sum()
}

fn ev(n: &str, d: f64) -> f64 {
    std::env::var(n).ok().and_then(|v| v.parse().ok()).unwrap_or(d)
}
