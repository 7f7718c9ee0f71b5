//! The laser's spot in images with the laser on and off (thesis IV.E).

use crate::error::{Error, Result};
use crate::image::ImageView;

/// A rectangle of pixels: columns [x, x + width), rows [y, y + height).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
}

/// A band about a polyline of pixels, such as an epipolar line.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// At least two points; distorted epipolar lines bend.
    pub polyline: Vec<[f64; 2]>,
    /// Half its width in pixels.
    pub half_width: f64,
}

/// The laser's colour: which channels carry its light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum LaserColour {
    /// Whichever channel differs most between on and off.
    #[default]
    Unknown = 0,
    Red = 1,
    Green = 2,
    Blue = 3,
    /// Infrared or a monochrome camera: all channels alike.
    White = 4,
}

#[derive(Debug, Clone, PartialEq)]
pub struct SpotOptions {
    /// Search only here (both, when both are given).
    pub region: Option<Region>,
    pub band: Option<Band>,
    pub colour: LaserColour,
    /// Least signal-to-noise ratio of an accepted spot.
    pub min_signal_to_noise: f64,
    /// Greatest area of an accepted spot in pixels.
    pub max_area: u32,
    /// A second candidate at least this fraction as strong makes the result ambiguous.
    pub ambiguity_ratio: f64,
}

impl Default for SpotOptions {
    fn default() -> Self {
        Self {
            region: None,
            band: None,
            colour: LaserColour::Unknown,
            min_signal_to_noise: 8.0,
            max_area: 5000,
            ambiguity_ratio: 0.5,
        }
    }
}

/// A spot found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Centre in pixels.
    pub x: f64,
    pub y: f64,
    /// Covariance of the centre, px^2: xx, xy, yy.
    pub covariance: [f64; 3],
    /// Greatest difference between on and off, grey levels.
    pub peak: f64,
    /// Summed signal over its standard deviation under the frames' noise.
    pub signal_to_noise: f64,
    /// Pixels above the threshold.
    pub area: u32,
    pub saturated: bool,
}

/// The spot in `on` (one or more frames with the laser on, averaged) against `off` (the same number
/// or any other of frames with it off; empty for a single-image search, which is weaker). All frames
/// have one size and format.
///
/// # Errors
/// `NotFound`, `Ambiguous`, and `InvalidArgument` for frames that do not match.
pub fn detect_spot(_on: &[ImageView<'_>], _off: &[ImageView<'_>], _options: &SpotOptions) -> Result<Spot> {
    Err(Error::Unsupported { what: "spot detection".into() })
}
