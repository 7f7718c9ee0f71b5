//! A fixed camera from an auxiliary camera with depth (thesis IV.B): SIFT features in both images,
//! the auxiliary ones lifted to points by their depth, the camera from those pairs by a robust
//! DLT-Points and maximum likelihood; then, where that first camera expects them, more pairs and the
//! lines of both images; and the camera once more from all.

mod lift;
mod options;
#[cfg(test)]
mod tests;
mod view;

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use crate::calibrate::{Calibration, Correspondences, Observation, calibrate_camera};
use crate::detect::sift::{SiftFeatures, detect_sift};
use crate::error::{Error, Result};
use crate::geometry::Camera;
use crate::image::{DepthMap, ImageView};
pub use options::RgbdOptions;
use view::View;
pub use view::ViewCounts;

/// Most auxiliary views of one calibration.
pub const MAX_VIEWS: usize = 1024;

/// A feature of an auxiliary image and what it looks like in the fixed camera's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointPair {
    /// Number of the auxiliary view.
    pub view: usize,
    /// Pixels of the auxiliary image.
    pub auxiliary: Vector2<f64>,
    /// Pixels of the fixed camera's image.
    pub fixed: Vector2<f64>,
    /// Metres.
    pub world: Vector3<f64>,
    /// Of `world`, m^2.
    pub covariance: Matrix3<f64>,
}

/// The fixed camera, and the pairs that it comes from.
#[derive(Debug, Clone)]
pub struct RgbdCalibration {
    /// Its residuals and inliers are those of the point pairs, in order, and then of the line pairs.
    pub calibration: Calibration,
    pub points: Vec<PointPair>,
}

/// A fixed camera's image, and what auxiliary views share with it.
#[derive(Debug, Clone)]
pub struct RgbdCalibrator {
    options: RgbdOptions,
    width: u32,
    height: u32,
    features: SiftFeatures,
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
        Ok(Self { options, width: fixed.width(), height: fixed.height(), features, views: Vec::new() })
    }

    /// Adds a view of an auxiliary camera: a colour image, the depth of each of its pixels, and the
    /// camera with its pose, which says what the world is.
    ///
    /// # Errors
    /// `InvalidArgument` for a depth map or camera of another size than the image, `TooManyViews`.
    /// A view without texture or depth is none: its counts say so.
    pub fn add_view(&mut self, colour: &ImageView<'_>, depth: &DepthMap, camera: &Camera) -> Result<ViewCounts> {
        if self.views.len() >= MAX_VIEWS {
            return Err(Error::invalid("views", format!("more than {MAX_VIEWS}")));
        }
        let view = View::new(self.views.len(), colour, depth, camera, &self.features, &self.options)?;
        let counts = view.counts;
        self.views.push(view);
        Ok(counts)
    }

    /// Calibrates the fixed camera from all views.
    ///
    /// # Errors
    /// `TooFewMatches` where the images have too little in common, and the errors of
    /// [`calibrate_camera`].
    pub fn calibrate(&self) -> Result<RgbdCalibration> {
        let points: Vec<PointPair> = self.views.iter().flat_map(|v| v.points.iter().copied()).collect();
        self.enough(points.len(), None)?;
        let calibration = self.fit(&points)?;
        Ok(RgbdCalibration { calibration, points })
    }

    fn fit(&self, points: &[PointPair]) -> Result<Calibration> {
        let mut set = Correspondences::new(self.width, self.height)?;
        let variance = Matrix2::identity() * self.options.keypoint_sigma.powi(2);
        set.add_all(points.iter().map(|p| Observation::Point {
            world: p.world,
            world_covariance: Some(p.covariance),
            pixel: p.fixed,
            pixel_covariance: Some(variance),
        }))?;
        let calibration = calibrate_camera(&set, &self.options.calibration).map_err(|e| match e {
            Error::NoConsensus { inliers, .. } => self.enough(inliers, Some(points.len())).err().unwrap_or(e),
            e => e,
        })?;
        let agree = calibration.inliers.iter().filter(|i| **i).count();
        self.enough(agree, Some(points.len()))?;
        Ok(calibration)
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
