//! Matches between two images' features: exact nearest neighbours, Lowe's ratio test, mutual check.

use super::SiftFeatures;
use super::distances::nearest;
use crate::error::{Error, Result};

/// Most pairs of features that are compared: minutes.
pub const MAX_PAIRS: u64 = 1 << 36;

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

impl SiftMatchOptions {
    pub(crate) fn check(&self) -> Result<()> {
        let possible = self.max_ratio > 0.0 && self.max_ratio <= 1.0;
        if possible { Ok(()) } else { Err(Error::invalid("max_ratio", format!("{} is not in (0, 1]", self.max_ratio))) }
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
/// `InvalidArgument` for a ratio out of range, and for more than [`MAX_PAIRS`] pairs.
pub fn match_sift(a: &SiftFeatures, b: &SiftFeatures, options: &SiftMatchOptions) -> Result<Vec<SiftMatch>> {
    options.check()?;
    let (a, b) = (&a.descriptors, &b.descriptors);
    if a.len() as u64 * b.len() as u64 > MAX_PAIRS {
        let reason = format!("{} x {} pairs; keep only the strongest features", a.len(), b.len());
        return Err(Error::invalid("features", reason));
    }
    let (forward, backward) = nearest(a, b);
    let matches = forward.iter().enumerate().filter_map(|(i, near)| {
        let distance = f64::from(near.best?).sqrt();
        if options.mutual && backward.get(near.index) != Some(&i) {
            return None;
        }
        let ratio = match near.second {
            Some(second) if second > 0 => distance / f64::from(second).sqrt(),
            _ => 1.0,
        };
        (ratio <= options.max_ratio).then_some(SiftMatch { a: i, b: near.index, distance, ratio })
    });
    Ok(matches.collect())
}
