//! A fixed camera from an auxiliary camera with depth (thesis IV.B): SIFT features in both images,
//! the auxiliary ones lifted to points by their depth, the camera from those pairs by a robust
//! DLT-Points and maximum likelihood; then, where that first camera expects them, more pairs and the
//! lines of both images; and the camera once more from all.

mod guide;
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

/// Standard deviation of keypoints that pairs are first judged by, and its bounds, pixels.
const FIRST_SIGMA: f64 = 0.7;
const MIN_SIGMA: f64 = 0.05;
const MAX_SIGMA: f64 = 2.0;
/// Median of chi-square with two degrees of freedom.
const MEDIAN: f64 = 2.0 * std::f64::consts::LN_2;
/// Times that pairs are looked for with the camera that the last ones gave.
const ROUNDS: usize = 3;

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
    /// Standard deviation of a keypoint's place along x and along y, pixels: estimated or given.
    pub keypoint_sigma: f64,
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
        let view = View::new(colour, depth, camera, &self.features, &self.options)?;
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
        let mut sigma = self.options.keypoint_sigma.unwrap_or(FIRST_SIGMA);
        let mut points = self.points(sigma, |view| view.pairs.clone());
        self.enough(points.len(), None)?;
        let mut calibration = self.fit(&points, sigma)?;
        for _ in 0..ROUNDS {
            if self.options.keypoint_sigma.is_none() {
                sigma = estimate_sigma(&points, &calibration, sigma);
            }
            let other = self.points(sigma, |view| match self.options.guided {
                true => guide::pairs(view, &self.features, &calibration, sigma, self.options.matching.max_ratio),
                false => view.pairs.clone(),
            });
            let Ok(refit) = self.fit(&other, sigma) else { break };
            (points, calibration) = (other, refit);
        }
        Ok(RgbdCalibration { calibration, points, keypoint_sigma: sigma })
    }

    /// Pairs of features of every view as points and pixels.
    fn points(&self, sigma: f64, pairs: impl Fn(&View) -> Vec<(usize, usize)>) -> Vec<PointPair> {
        let mut points = Vec::new();
        for (number, view) in self.views.iter().enumerate() {
            points.extend(pairs(view).into_iter().filter_map(|(a, b)| {
                let (lifted, k) = (view.lifted[a].as_ref()?, &self.features.keypoints[b]);
                Some(PointPair {
                    view: number,
                    auxiliary: lifted.pixel,
                    fixed: Vector2::new(k.x, k.y),
                    world: lifted.world,
                    covariance: lifted.covariance(sigma),
                })
            }));
        }
        points
    }

    fn fit(&self, points: &[PointPair], sigma: f64) -> Result<Calibration> {
        let mut set = Correspondences::new(self.width, self.height)?;
        let variance = Matrix2::identity() * sigma.powi(2);
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
        let agreeing = calibration.inliers.iter().filter(|i| **i).count();
        self.enough(agreeing, Some(points.len()))?;
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

/// Keypoints' standard deviation from the median distance of those that agree, in units of the last.
fn estimate_sigma(points: &[PointPair], calibration: &Calibration, sigma: f64) -> f64 {
    let distance = |(p, inlier): (&PointPair, &bool)| {
        let seen = calibration.camera.project_with_jacobian(&p.world).filter(|_| *inlier)?;
        let covariance = seen.by_point * p.covariance * seen.by_point.transpose() + Matrix2::identity() * sigma.powi(2);
        let off = p.fixed - seen.pixel;
        Some(off.dot(&(covariance.try_inverse()? * off)))
    };
    let mut distances: Vec<f64> = points.iter().zip(&calibration.inliers).filter_map(distance).collect();
    let middle = distances.len() / 2;
    if distances.is_empty() {
        return sigma;
    }
    let median = *distances.select_nth_unstable_by(middle, f64::total_cmp).1;
    (sigma * (median / MEDIAN).sqrt()).clamp(MIN_SIGMA, MAX_SIGMA)
}
