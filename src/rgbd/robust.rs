//! A camera from pairs of features: most are good to a few tenths of a pixel, some, at the edges of
//! things and on what shines, are off by pixels without being wrong.
//!
//! Their errors are taken to be Student's t with four degrees of freedom, whose maximum likelihood is
//! least squares with weights (K. L. Lange, R. J. A. Little, J. M. G. Taylor, Robust statistical
//! modeling using the t distribution, JASA 84, 1989).

use super::PointPair;
use crate::calibrate::{Calibration, CalibrationOptions, Correspondences, Observation, calibrate_camera};
use crate::error::Result;
use crate::geometry::Camera;

/// Degrees of freedom of the errors' distribution.
const FREEDOM: f64 = 4.0;
/// Numbers of a residual.
const NUMBERS: f64 = 2.0;
/// Squared distances beyond this are wrong pairs, which get no smaller weight: the fit sets them aside.
const WRONG: f64 = 40.0;
/// Reweightings; they change little after the first few.
const ROUNDS: usize = 6;
/// Bounds of a keypoint's standard deviation, pixels.
const MIN_SIGMA: f64 = 0.05;
const MAX_SIGMA: f64 = 2.0;

pub(super) struct RobustFit<'a> {
    /// Of the fixed camera's image.
    pub size: [u32; 2],
    pub options: &'a CalibrationOptions,
}

impl RobustFit<'_> {
    /// The camera and the standard deviation of keypoints (pixels), which begins as `sigma` and is
    /// estimated or kept.
    pub fn run(&self, points: &[PointPair], sigma: f64, estimate: bool) -> Result<(Calibration, f64)> {
        // Of the distribution's core, by which the t distribution is scaled.
        let mut scale = sigma / spread();
        let mut weights = vec![1.0; points.len()];
        let mut calibration = self.fit(points, &weights, scale)?;
        for _ in 0..ROUNDS {
            let (mut sum, mut count) = (0.0, 0.0);
            for ((point, weight), inlier) in points.iter().zip(&mut weights).zip(&calibration.inliers) {
                let d = distance(&calibration.camera, point, scale);
                *weight = if d < WRONG { (FREEDOM + NUMBERS) / (FREEDOM + d) } else { 1.0 };
                if *inlier && d < WRONG {
                    sum += *weight * d;
                    count += NUMBERS;
                }
            }
            if estimate && count > 0.0 {
                scale = (scale * (sum / count).sqrt()).clamp(MIN_SIGMA / spread(), MAX_SIGMA / spread());
            }
            calibration = self.fit(points, &weights, scale)?;
        }
        // What the weights leave of the information is this part of what least squares counts.
        calibration.covariance *= (FREEDOM + NUMBERS + 2.0) / (FREEDOM + NUMBERS);
        Ok((calibration, scale * spread()))
    }

    fn fit(&self, points: &[PointPair], weights: &[f64], scale: f64) -> Result<Calibration> {
        let [width, height] = self.size;
        let mut set = Correspondences::new(width, height)?;
        set.add_all(points.iter().zip(weights).map(|(p, weight)| Observation::Point {
            world: p.lifted.world,
            world_covariance: Some(p.lifted.covariance(scale) / *weight),
            pixel: p.fixed,
            pixel_covariance: Some(p.shape * (scale.powi(2) / weight)),
        }))?;
        calibrate_camera(&set, self.options)
    }
}

/// Standard deviation of the t distribution of scale 1.
fn spread() -> f64 {
    (FREEDOM / (FREEDOM - 2.0)).sqrt()
}

/// Squared distance of a pair in standard deviations; infinite behind the camera.
fn distance(camera: &Camera, point: &PointPair, sigma: f64) -> f64 {
    let Some(seen) = camera.project_with_jacobian(&point.lifted.world) else { return f64::INFINITY };
    let by_point = seen.by_point * point.lifted.covariance(sigma) * seen.by_point.transpose();
    let off = point.fixed - seen.pixel;
    let information = (by_point + point.shape * sigma.powi(2)).try_inverse();
    information.map_or(f64::INFINITY, |i| off.dot(&(i * off)))
}
