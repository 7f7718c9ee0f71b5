//! A camera from pairs of features and of lines: most are good to a few tenths of a pixel, some, at the
//! edges of things and on what shines, are off by pixels without being wrong.
//!
//! Their errors are taken to be Student's t with four degrees of freedom, whose maximum likelihood is
//! least squares with weights (K. L. Lange, R. J. A. Little, J. M. G. Taylor, Robust statistical
//! modeling using the t distribution, JASA 84, 1989).

use super::PointPair;
use crate::calibrate::line_measurement::LineMeasurement;
use crate::calibrate::measurement::squared_distance;
use crate::calibrate::{Calibration, CalibrationOptions, Correspondences, Observation, ObservedLine, calibrate_camera};
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
/// How many times their stated errors those of lines may be, whose covariances know the image's noise
/// but not what else is wrong with image and depth.
const MAX_FACTOR: f64 = 100.0;

pub(super) struct RobustFit<'a> {
    /// Of the fixed camera's image.
    pub size: [u32; 2],
    pub options: &'a CalibrationOptions,
    /// Is the keypoints' standard deviation estimated?
    pub estimate: bool,
}

/// The camera with the spread of errors that goes with it.
pub(super) struct Fitted {
    pub calibration: Calibration,
    /// Standard deviation of keypoints, pixels.
    pub sigma: f64,
    /// Errors of lines in units of their stated ones.
    pub line_factor: f64,
}

/// Scale of a group's errors, the weights of its members, and what the next scale comes from.
struct Group {
    scale: f64,
    bounds: [f64; 2],
    weights: Vec<f64>,
    sum: f64,
    count: f64,
}

impl Group {
    fn new(n: usize, scale: f64, bounds: [f64; 2]) -> Self {
        Self { scale, bounds, weights: vec![1.0; n], sum: 0.0, count: 0.0 }
    }

    /// Takes the squared distance of member `i` in units of the scale.
    fn weigh(&mut self, i: usize, d: f64, inlier: bool) {
        self.weights[i] = if d < WRONG { (FREEDOM + NUMBERS) / (FREEDOM + d) } else { 1.0 };
        if inlier && d < WRONG {
            self.sum += self.weights[i] * d;
            self.count += NUMBERS;
        }
    }

    fn rescale(&mut self, estimate: bool) {
        if estimate && self.count > 0.0 {
            let [low, high] = self.bounds;
            self.scale = (self.scale * (self.sum / self.count).sqrt()).clamp(low, high);
        }
        (self.sum, self.count) = (0.0, 0.0);
    }
}

impl RobustFit<'_> {
    /// From point pairs and lines; `sigma`: of keypoints (pixels), to begin with or to keep.
    pub fn run(&self, points: &[PointPair], lines: &[ObservedLine], sigma: f64) -> Result<Fitted> {
        // The t distribution is scaled by its core.
        let mut of_points = Group::new(points.len(), sigma / spread(), [MIN_SIGMA, MAX_SIGMA].map(|s| s / spread()));
        let mut of_lines = Group::new(lines.len(), 1.0, [1.0, MAX_FACTOR]);
        let measured: Vec<LineMeasurement> = lines.iter().map(|l| LineMeasurement::new(l, 1.0, false)).collect();
        let mut calibration = self.fit(points, lines, &of_points, &of_lines)?;
        for _ in 0..ROUNDS {
            let (camera, inliers) = (&calibration.camera, &calibration.inliers);
            for (i, point) in points.iter().enumerate() {
                of_points.weigh(i, point_distance(camera, point, of_points.scale), inliers[i]);
            }
            for (i, line) in measured.iter().enumerate() {
                let d = line.residual(camera).map_or(f64::INFINITY, |(r, c)| squared_distance(&r, &c));
                of_lines.weigh(i, d / of_lines.scale.powi(2), inliers[points.len() + i]);
            }
            of_points.rescale(self.estimate);
            of_lines.rescale(true);
            calibration = self.fit(points, lines, &of_points, &of_lines)?;
        }
        // What the weights leave of the information is this part of what least squares counts.
        calibration.covariance *= (FREEDOM + NUMBERS + 2.0) / (FREEDOM + NUMBERS);
        let (sigma, line_factor) = (of_points.scale * spread(), of_lines.scale * spread());
        Ok(Fitted { calibration, sigma, line_factor })
    }

    fn fit(
        &self,
        points: &[PointPair],
        lines: &[ObservedLine],
        of_points: &Group,
        of_lines: &Group,
    ) -> Result<Calibration> {
        let [width, height] = self.size;
        let mut set = Correspondences::new(width, height)?;
        set.add_all(points.iter().zip(&of_points.weights).map(|(p, weight)| Observation::Point {
            world: p.lifted.world,
            world_covariance: Some(p.lifted.covariance(of_points.scale) / *weight),
            pixel: p.fixed,
            pixel_covariance: Some(p.shape * (of_points.scale.powi(2) / weight)),
        }))?;
        set.add_all(lines.iter().zip(&of_lines.weights).map(|(line, weight)| {
            let factor = of_lines.scale.powi(2) / weight;
            Observation::from(ObservedLine {
                covariance: line.covariance.map(|c| c * factor),
                end_covariances: line.end_covariances.map(|ends| ends.map(|c| c * factor)),
                ..line.clone()
            })
        }))?;
        calibrate_camera(&set, self.options)
    }
}

/// Standard deviation of the t distribution of scale 1.
fn spread() -> f64 {
    (FREEDOM / (FREEDOM - 2.0)).sqrt()
}

/// Squared distance of a pair in standard deviations; infinite behind the camera.
fn point_distance(camera: &Camera, point: &PointPair, sigma: f64) -> f64 {
    let Some(seen) = camera.project_with_jacobian(&point.lifted.world) else { return f64::INFINITY };
    let by_point = seen.by_point * point.lifted.covariance(sigma) * seen.by_point.transpose();
    squared_distance(&(point.fixed - seen.pixel), &(by_point + point.shape * sigma.powi(2)))
}
