//! Straight line segments, to a few hundredths of a pixel, with their covariances.
//!
//! Edge pixels (Canny's maxima of the gradient) are followed along straight runs (`track`), every run
//! is fitted to the image with its blur (`fit`, `profile`), runs that white noise could have made are
//! dropped, and pieces of one line are joined (`merge`).
//!
//! Why not Hough: its accumulator knows position and direction to a cell of a pixel and a degree, and
//! counts pixels wherever they lie on the line; a segment needs both to hundredths, and where it ends.
//!
//! A line that a lens bends is found as one segment while it leaves a straight line by a pixel or so,
//! and as several otherwise. Its two `points` are on the bent line nevertheless (see there).

mod fit;
pub mod lift;
pub mod matching;
mod merge;
mod profile;
#[cfg(test)]
mod tests;
mod track;

use nalgebra::{Matrix2, Vector2};

use super::edges::check_size;
use super::edges::gradient::{NOISE_GAIN, UNITS, noise_level};
use crate::error::{Error, Result};
use crate::image::ImageView;
use crate::image::pyramid::Grey;
use fit::{Fitter, LineFit};
pub use lift::lift_segments;
pub use matching::{LineMatch, LineMatchOptions, match_lines};

/// Shortest segments that can be asked for, pixels.
pub const MIN_LENGTH: f64 = 8.0;
/// Gradient of a step of one grey level with a blur of one pixel, per pixel of the smoothed image.
const STEP_GRADIENT: f64 = 0.29;
/// Standard deviations of the noise that a gradient must have to be followed, and to begin with.
const NOISE_LOW: f64 = 3.0;
const NOISE_HIGH: f64 = 4.5;
/// Expected number of segments in an image of nothing but white noise.
const FALSE_ALARMS: f64 = 1.0;
/// Standard deviation that no segment's position is better than, pixels: edges are not quite
/// straight, pixels not quite square, and a blur not quite Gaussian.
const FLOOR: f64 = 0.003;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineOptions {
    /// Of segments, pixels; at least [`MIN_LENGTH`].
    pub min_length: f64,
    /// Least step from dark to bright, grey levels. Where the image's noise asks for more, more is
    /// demanded.
    pub min_contrast: f64,
    /// Longest gap between two pieces of one line that are joined, pixels. It is never longer than the
    /// shorter piece. 0: nothing is joined.
    pub max_gap: f64,
    /// Most segments that are returned: the longest. At least 1.
    pub max_segments: usize,
}

impl Default for LineOptions {
    fn default() -> Self {
        Self { min_length: 20.0, min_contrast: 12.0, max_gap: 40.0, max_segments: 10_000 }
    }
}

impl LineOptions {
    fn check(&self) -> Result<()> {
        if !(self.min_length >= MIN_LENGTH && self.min_length.is_finite()) {
            let reason = format!("{} pixels; {MIN_LENGTH} are the least", self.min_length);
            return Err(Error::invalid("min_length", reason));
        }
        if !(self.min_contrast > 0.0 && self.min_contrast <= 255.0) {
            return Err(Error::invalid("min_contrast", format!("{} grey levels", self.min_contrast)));
        }
        if !(self.max_gap >= 0.0 && self.max_gap.is_finite()) {
            return Err(Error::invalid("max_gap", format!("{} pixels", self.max_gap)));
        }
        if self.max_segments == 0 {
            return Err(Error::invalid("max_segments", "0"));
        }
        Ok(())
    }
}

/// A straight edge in the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineSegment {
    /// As far as it is seen, pixels. On the way from the first to the second end the bright side is on
    /// the right, as one sees the image. Where along the line they lie is known to a pixel or two.
    pub ends: [Vector2<f64>; 2],
    /// Two points of the line whose errors across it are independent, in the order of the ends: one
    /// radius of gyration from the middle, the place where a line of best fit is least off. Together
    /// they say all that is known of the line, and on a line that is bent evenly they still lie on
    /// it. They are what [`ObservedLine::ends`](crate::calibrate::ObservedLine::ends) should be.
    pub points: [Vector2<f64>; 2],
    /// Variance of each point across the line, px^2.
    pub variance: f64,
    /// Step from dark to bright, grey levels.
    pub contrast: f64,
    /// Standard deviation of the edge's blur, pixels.
    pub blur: f64,
    /// Pixels of its length that show it: gaps between joined pieces do not count.
    pub support: f64,
}

impl LineSegment {
    pub fn length(&self) -> f64 {
        (self.ends[1] - self.ends[0]).norm()
    }

    /// Unit vector from the first end to the second.
    pub fn direction(&self) -> Vector2<f64> {
        (self.ends[1] - self.ends[0]) / self.length()
    }

    /// Unit vector towards the bright side: to the right of the direction.
    pub fn normal(&self) -> Vector2<f64> {
        let d = self.direction();
        Vector2::new(-d.y, d.x)
    }

    /// Covariance of each of the points, px^2: that across the line, in all directions. Along it the
    /// points are images of nothing in particular; a circle does not turn with the camera that is
    /// being sought.
    pub fn covariances(&self) -> [Matrix2<f64>; 2] {
        [Matrix2::identity() * self.variance; 2]
    }

    fn new(f: &LineFit) -> Self {
        let at = |t: f64| {
            let v = f.at + f.slope * (t - f.mean);
            if f.along_x { Vector2::new(t, v) } else { Vector2::new(v, t) }
        };
        let cos2 = 1.0 / (1.0 + f.slope * f.slope);
        // Right of increasing x are greater y; right of increasing y are smaller x.
        let forward = f.rising == f.along_x;
        let order = |a: f64, b: f64| if forward { [at(a), at(b)] } else { [at(b), at(a)] };
        let ends = order(f.first - 0.5, f.last + 0.5);
        Self {
            ends,
            points: order(f.mean - f.spread, f.mean + f.spread),
            // Of the middle, and as much from the slope.
            variance: 2.0 * f.variance * cos2 + FLOOR * FLOOR,
            contrast: f.contrast,
            blur: f.blur * cos2.sqrt(),
            support: (ends[1] - ends[0]).norm(),
        }
    }
}

/// Finds the straight edges of an image, the longest first; of colours their luma is used.
///
/// An image of nothing but white noise has about one in all at most (Desolneux, Moisan and Morel,
/// "Meaningful alignments", IJCV 2000: as many lines are tried as there are pairs of pixels; here what
/// counts is the contrast along the line). Besides the image a byte a pixel is needed.
///
/// # Errors
/// `InvalidArgument` for impossible options and images of more than
/// [`MAX_PIXELS`](super::edges::MAX_PIXELS).
pub fn detect_line_segments(image: &ImageView<'_>, options: &LineOptions) -> Result<Vec<LineSegment>> {
    options.check()?;
    check_size(image)?;
    let grey = Grey::of(image);
    let noise = noise_level(&grey);
    let contrast = options.min_contrast * STEP_GRADIENT * UNITS;
    let low = (0.75 * contrast).max(NOISE_LOW * NOISE_GAIN * noise);
    let high = (1.25 * contrast).max(NOISE_HIGH * NOISE_GAIN * noise);
    let tests = 2.5 * ((grey.width() * grey.height()) as f64).log10() - FALSE_ALARMS.log10();
    let mut fitter = Fitter::new(&grey);
    let mut segments = Vec::new();
    track::EdgeMap::new(&grey, low, high).tracks(0.8 * options.min_length.min(25.0), |track| {
        let meaningful = |f: &LineFit| {
            let z = f.contrast / (f.contrast_gain * f.noise.max(noise));
            f.contrast >= 0.5 * options.min_contrast && log10_tail(z) < -tests
        };
        segments.extend(fitter.fit(&track).filter(meaningful).map(|f| LineSegment::new(&f)));
    });
    let mut segments = merge::merge(segments, options.max_gap);
    segments.retain(|s| s.support >= options.min_length && s.contrast >= options.min_contrast);
    segments.sort_by(|a, b| b.support.total_cmp(&a.support));
    segments.truncate(options.max_segments);
    Ok(segments)
}

/// Refuses segments that are not finite, or are points.
fn check_segments(segments: &[LineSegment]) -> Result<()> {
    for (index, s) in segments.iter().enumerate() {
        let places = s.ends.iter().chain(&s.points).flat_map(|p| p.iter());
        if !places.chain([&s.variance]).all(|v| v.is_finite()) {
            return Err(Error::NotFinite { name: "segments", index });
        }
        let apart = (s.points[1] - s.points[0]).norm().min(s.length());
        if !(apart > 0.0 && s.variance > 0.0) {
            return Err(Error::invalid("segments", format!("segment {index} has no length or no variance")));
        }
    }
    Ok(())
}

/// log10 of the probability that a normal variable exceeds z: its asymptotic series' first term, which
/// is an upper bound.
fn log10_tail(z: f64) -> f64 {
    if z < 1.0 {
        return 0.0;
    }
    -(0.5 * z * z * std::f64::consts::LOG10_E + (z * std::f64::consts::TAU.sqrt()).log10())
}
