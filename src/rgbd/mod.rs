//! A fixed camera from an auxiliary camera with depth (thesis IV.B): SIFT features in both images,
//! the auxiliary ones lifted to points by their depth, the camera from those pairs by a robust
//! DLT-Points and maximum likelihood; then, where that first camera expects them, more pairs and the
//! lines of both images; and the camera once more from all.

mod guide;
mod lift;
mod options;
mod robust;
#[cfg(test)]
mod tests;
mod view;

use std::collections::BTreeSet;

use nalgebra::{Matrix2, Vector2};

use crate::calibrate::{Calibration, CalibrationOptions, ObservedLine};
use crate::detect::lines::matching::observed;
use crate::detect::lines::{LineMatchOptions, LineOptions, LineSegment, detect_line_segments, match_lines};
use crate::detect::sift::{SiftFeatures, detect_sift};
use crate::error::{Error, Result};
use crate::geometry::{Camera, MeasuredLine};
use crate::image::{DepthMap, ImageView};
pub use lift::Lifted;
pub use options::RgbdOptions;
use robust::{Fitted, RobustFit};
use view::View;
pub use view::ViewCounts;

/// Most auxiliary views of one calibration.
pub const MAX_VIEWS: usize = 1024;

/// Standard deviation of keypoints that pairs are first judged by, pixels.
const FIRST_SIGMA: f64 = 0.7;
/// Times that pairs are looked for with the camera that the last ones gave.
const ROUNDS: usize = 3;

/// A feature of an auxiliary image and what it looks like in the fixed camera's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointPair {
    /// Number of the auxiliary view.
    pub view: usize,
    /// The feature in the auxiliary image and in the world.
    pub lifted: Lifted,
    /// Pixels of the fixed camera's image.
    pub fixed: Vector2<f64>,
    /// Covariance of `fixed` up to a factor.
    pub shape: Matrix2<f64>,
}

/// A straight edge of an auxiliary image, the line that it is, and the fixed camera's edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinePair {
    /// Number of the auxiliary view.
    pub view: usize,
    pub line: MeasuredLine,
    pub auxiliary: LineSegment,
    pub fixed: LineSegment,
}

/// The fixed camera, and the pairs that it comes from.
#[derive(Debug, Clone)]
pub struct RgbdCalibration {
    /// Its residuals and inliers are those of the point pairs, in order, and then of the line pairs.
    pub calibration: Calibration,
    pub points: Vec<PointPair>,
    pub lines: Vec<LinePair>,
    /// Standard deviation of a keypoint's place across its elongation, pixels: estimated or given.
    pub keypoint_sigma: f64,
    /// Standard deviation of the lines' errors in units of their stated ones; means nothing without lines.
    pub line_factor: f64,
}

/// A fixed camera's image, and what auxiliary views share with it.
#[derive(Debug, Clone)]
pub struct RgbdCalibrator {
    options: RgbdOptions,
    width: u32,
    height: u32,
    features: SiftFeatures,
    segments: Vec<LineSegment>,
    views: Vec<View>,
}

impl RgbdCalibrator {
    /// Takes the fixed camera's image.
    ///
    /// # Errors
    /// `InvalidArgument` for options and images that SIFT does not take.
    pub fn new(fixed: &ImageView<'_>, options: RgbdOptions) -> Result<Self> {
        options.check()?;
        let features = detect_sift(fixed, &options.sift)?;
        let segments = if options.lines { detect_line_segments(fixed, &LineOptions::default())? } else { Vec::new() };
        Ok(Self { options, width: fixed.width(), height: fixed.height(), features, segments, views: Vec::new() })
    }

    /// Adds a view of an auxiliary camera: a colour image, the depth of each of its pixels, and the
    /// camera with its pose, which says what the world is.
    ///
    /// # Errors
    /// `InvalidArgument` for a depth map or camera of another size than the image, and for too many views.
    /// A view without texture or depth is none: its counts say so.
    pub fn add_view(&mut self, colour: &ImageView<'_>, depth: &DepthMap, camera: &Camera) -> Result<ViewCounts> {
        if self.views.len() >= MAX_VIEWS {
            return Err(Error::invalid("views", format!("more than {MAX_VIEWS}")));
        }
        let view = View::new(colour, depth, camera, &self.features, &self.options)?;
        let counts = view.counts;
        self.views.push(view);
        Ok(counts)
    }

    /// Calibrates the fixed camera from all views.
    ///
    /// # Errors
    /// `TooFewMatches` where the images have too little in common, and the errors of
    /// [`calibrate_camera`](crate::calibrate::calibrate_camera).
    pub fn calibrate(&self, options: &CalibrationOptions) -> Result<RgbdCalibration> {
        let given = self.options.keypoint_sigma;
        let fit = RobustFit { size: [self.width, self.height], options, estimate: given.is_none() };
        let mut points = self.points(|view| view.pairs.clone());
        self.enough(points.len(), None)?;
        let mut fitted = fit.run(&points, &[], given.unwrap_or(FIRST_SIGMA)).map_err(|e| match e {
            Error::NoConsensus { inliers, total } => self.enough(inliers, Some(total)).err().unwrap_or(e),
            e => e,
        })?;
        if self.options.guided {
            for _ in 0..ROUNDS {
                let other = self.points(|view| guide::pairs(view, &self.features, &fitted.calibration, fitted.sigma));
                match fit.run(&other, &[], fitted.sigma) {
                    Ok(refit) => (points, fitted) = (other, refit),
                    Err(Error::Cancelled) => return Err(Error::Cancelled),
                    // Guided by a poor camera there may be none.
                    Err(_) => break,
                }
            }
        }
        let agreeing = fitted.calibration.inliers.iter().filter(|i| **i).count();
        self.enough(agreeing, Some(points.len()))?;
        let lines = self.lines(&fitted.calibration.camera)?;
        if !lines.is_empty() {
            let observed: Vec<ObservedLine> = lines.iter().map(|l| observed(&l.line, &l.fixed)).collect();
            fitted = fit.run(&points, &observed, fitted.sigma)?;
        }
        let Fitted { calibration, sigma, line_factor } = fitted;
        Ok(RgbdCalibration { calibration, points, lines, keypoint_sigma: sigma, line_factor })
    }

    /// Lines of every view with their segments, as a first camera sees them; no segment twice.
    fn lines(&self, camera: &Camera) -> Result<Vec<LinePair>> {
        let mut pairs = Vec::new();
        let mut taken = vec![false; self.segments.len()];
        for (view, of) in self.views.iter().enumerate() {
            let lines: Vec<MeasuredLine> = of.lines.iter().map(|(line, _)| *line).collect();
            for found in match_lines(&lines, camera, &self.segments, &LineMatchOptions::default())? {
                if !std::mem::replace(&mut taken[found.segment], true) {
                    let (line, auxiliary) = of.lines[found.line];
                    pairs.push(LinePair { view, line, auxiliary, fixed: self.segments[found.segment] });
                }
            }
        }
        Ok(pairs)
    }

    /// Pairs of features of every view as points and pixels. A keypoint with two orientations is two
    /// features but one measurement.
    fn points(&self, pairs: impl Fn(&View) -> Vec<(usize, usize)>) -> Vec<PointPair> {
        let (mut points, mut seen) = (Vec::new(), BTreeSet::new());
        for (view, of) in self.views.iter().enumerate() {
            points.extend(pairs(of).into_iter().filter_map(|(a, b)| {
                let (lifted, k) = (of.lifted[a]?, &self.features.keypoints[b]);
                let place = [lifted.pixel.x, lifted.pixel.y, k.x, k.y].map(f64::to_bits);
                seen.insert((view, place)).then_some(())?;
                Some(PointPair { view, lifted, fixed: Vector2::new(k.x, k.y), shape: k.shape() })
            }));
        }
        points
    }

    /// Refuses fewer pairs than the options ask for; `of`: those that are left of so many.
    fn enough(&self, found: usize, of: Option<usize>) -> Result<()> {
        if found >= self.options.min_pairs {
            return Ok(());
        }
        let total = |count: fn(&ViewCounts) -> usize| self.views.iter().map(|v| count(&v.counts)).sum::<usize>();
        let detail = match of {
            Some(of) => format!("of {of} pairs of points {found} agree with a camera"),
            None => format!(
                "{} features in the fixed camera's image and {} in {} auxiliary ones make {} pairs, {} of them with depth",
                self.features.keypoints.len(),
                total(|c| c.features),
                self.views.len(),
                total(|c| c.matches),
                found
            ),
        };
        Err(Error::TooFewMatches { needed: self.options.min_pairs, detail })
    }
}
