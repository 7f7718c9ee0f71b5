//! Matches between two images' features: exact nearest neighbours, Lowe's ratio test, mutual check.

use super::{Descriptor, SiftFeatures};
use crate::error::{Error, Result};

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SiftMatchOptions {
    /// Greatest ratio of the distances to the nearest and the second nearest descriptor, above 0 to 1;
    /// 1 switches the test off. Lowe: 0.8.
    pub max_ratio: f64,
    /// Whether each of a pair must be the nearest of the other.
    pub mutual: bool,
}

impl Default for SiftMatchOptions {
    fn default() -> Self {
        Self { max_ratio: 0.8, mutual: true }
    }
}

/// Feature `a` of the first image looks like feature `b` of the second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SiftMatch {
    pub a: usize,
    pub b: usize,
    /// Euclidean, between descriptors of length 512.
    pub distance: f64,
    /// To the distance of the second nearest of the second image; 1 where there is none.
    pub ratio: f64,
}

/// For each feature of `a` that passes the tests, in order, its nearest of `b`; of equals, the first.
///
/// # Errors
/// `InvalidArgument` for a ratio out of range, and where keypoints and descriptors differ in number.
pub fn match_sift(a: &SiftFeatures, b: &SiftFeatures, options: &SiftMatchOptions) -> Result<Vec<SiftMatch>> {
    if !(options.max_ratio > 0.0 && options.max_ratio <= 1.0) {
        return Err(Error::invalid("max_ratio", format!("{} is not in (0, 1]", options.max_ratio)));
    }
    let (forward, backward) = nearest(&a.descriptors, &b.descriptors);
    let matches = forward.iter().enumerate().filter_map(|(i, near)| {
        if near.best == i32::MAX || (options.mutual && backward[near.index] != i) {
            return None;
        }
        let distance = f64::from(near.best).sqrt();
        let ratio =
            if near.second == i32::MAX || near.second == 0 { 1.0 } else { distance / f64::from(near.second).sqrt() };
        (ratio <= options.max_ratio).then_some(SiftMatch { a: i, b: near.index, distance, ratio })
    });
    Ok(matches.collect())
}

#[derive(Clone, Copy)]
struct Nearest {
    best: i32,
    second: i32,
    index: usize,
}

fn nearest(a: &[Descriptor], b: &[Descriptor]) -> (Vec<Nearest>, Vec<usize>) {
    let mut forward = vec![Nearest { best: i32::MAX, second: i32::MAX, index: 0 }; a.len()];
    let mut backward = vec![(i32::MAX, 0); b.len()];
    for (i, (da, near)) in a.iter().zip(&mut forward).enumerate() {
        for (j, (db, back)) in b.iter().zip(&mut backward).enumerate() {
            let d: i32 = da.iter().zip(db).map(|(x, y)| (i32::from(*x) - i32::from(*y)).pow(2)).sum();
            if d < near.best {
                *near = Nearest { best: d, second: near.best, index: j };
            } else if d < near.second {
                near.second = d;
            }
            if d < back.0 {
                *back = (d, i);
            }
        }
    }
    (forward, backward.into_iter().map(|b| b.1).collect())
}
