//! How pairs are found in colour and depth.

use crate::detect::sift::{SiftMatchOptions, SiftOptions};
use crate::error::{Error, Result};
use crate::image::DepthNoise;

/// Pairs that a camera needs at least.
const MIN_PAIRS: usize = 6;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RgbdOptions {
    pub sift: SiftOptions,
    pub matching: SiftMatchOptions,
    pub depth_noise: DepthNoise,
    /// Standard deviation of a keypoint's place across its elongation, pixels of either image; `None`:
    /// estimated from the residuals.
    pub keypoint_sigma: Option<f64>,
    /// Once more with those pairs of features that look less distinct but lie where a first camera
    /// expects them.
    pub guided: bool,
    /// Add lines that a first camera lets match.
    pub lines: bool,
    /// Least number of pairs that agree with the camera.
    pub min_pairs: usize,
}

impl Default for RgbdOptions {
    fn default() -> Self {
        Self {
            // More and weaker features than for matching alone: geometry tells the wrong ones.
            sift: SiftOptions { contrast_threshold: 0.02, ..SiftOptions::default() },
            matching: SiftMatchOptions::default(),
            depth_noise: DepthNoise::default(),
            keypoint_sigma: None,
            guided: true,
            lines: true,
            min_pairs: 20,
        }
    }
}

impl RgbdOptions {
    pub(super) fn check(&self) -> Result<()> {
        self.sift.check()?;
        self.matching.check()?;
        self.depth_noise.check()?;
        if self.min_pairs < MIN_PAIRS {
            return Err(Error::invalid("min_pairs", format!("{}; at least {MIN_PAIRS}", self.min_pairs)));
        }
        if let Some(sigma) = self.keypoint_sigma
            && !(sigma.is_finite() && sigma > 0.0)
        {
            return Err(Error::invalid("keypoint_sigma", format!("{sigma} is not positive")));
        }
        Ok(())
    }
}
