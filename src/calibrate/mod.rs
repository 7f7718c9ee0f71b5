//! Calibration of a fixed camera from 2D-3D sets.

pub(crate) mod block;
pub mod boards;
pub(crate) mod check;
mod closed_form;
mod consensus;
pub mod correspondences;
pub mod decompose;
pub mod division_camera;
pub mod division_eigenproblem;
pub mod dlt;
mod equations;
pub(crate) mod freedom;
pub mod laser_line;
mod lens_fit;
pub mod line;
pub(crate) mod line_measurement;
pub(crate) mod measurement;
mod products;
pub mod radial_alignment;
mod record;
mod refine;
pub(crate) mod residuals;
mod solve;
mod spread;
mod stand_ins;
mod start;
pub mod uncertainty;
pub(crate) mod weakness;

pub use boards::{BoardCalibration, BoardCorner, BoardPose, BoardSpot, Boards, calibrate_from_boards};
pub use check::{FitCheck, Suspect};
pub use correspondences::{Correspondences, Observation};
pub use laser_line::{LaserCalibration, calibrate_laser_line};
pub use line::ObservedLine;
pub use record::{inputs_of, inputs_record};
pub use solve::calibrate_camera;
pub use uncertainty::{UncertainPixel, UncertainPoint, UncertainRay};
pub use weakness::Weakness;

use nalgebra::{DMatrix, Vector2};

use crate::control::Cancel;
use crate::error::Result;
use crate::geometry::{Camera, Distortion, Intrinsics};

/// Which lens model is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum DistortionModel {
    #[default]
    None = 0,
    /// k1 only.
    Radial1 = 1,
    /// k1, k2.
    Radial2 = 2,
    /// k1, k2, p1, p2, k3.
    BrownConrady = 3,
    Division = 4,
    /// k1 k2 k3 k4 of the angle from the axis: wide-angle and dome cameras.
    Fisheye = 5,
}

/// How a camera is calibrated. [`Default`] is right for laser shots and measured points.
#[derive(Debug, Clone)]
pub struct CalibrationOptions {
    pub distortion: DistortionModel,
    /// Keep this lens and only find the pose; the points may then lie in a plane.
    pub fixed_lens: Option<(Intrinsics, Distortion)>,
    /// Prior standard deviation of skew / f about 0; 0 forces 0, infinity frees it.
    pub skew_sigma: f64,
    /// Prior standard deviation of fx / fy about 1; 0 forces 1, infinity frees it.
    pub aspect_sigma: f64,
    /// Find and set aside gross outliers.
    pub robust: bool,
    /// Noise of image points without a covariance of their own, px; `None`: estimated from residuals.
    pub pixel_sigma: Option<f64>,
    /// Refuse when the focal length's relative standard deviation exceeds this.
    pub max_focal_deviation: f64,
    /// Seed of the minimal-sample consensus.
    pub seed: u64,
    pub max_iterations: usize,
    pub cancel: Cancel,
}

impl CalibrationOptions {
    /// # Errors
    /// `InvalidArgument`, `NotFinite`: an option out of its range.
    pub fn validate(&self) -> Result<()> {
        solve::validate(self)
    }
}

impl Default for CalibrationOptions {
    fn default() -> Self {
        Self {
            distortion: DistortionModel::None,
            fixed_lens: None,
            skew_sigma: 1e-3,
            aspect_sigma: 1e-3,
            robust: true,
            pixel_sigma: None,
            max_focal_deviation: 0.1,
            seed: 1,
            max_iterations: 100,
            cancel: Cancel::new(),
        }
    }
}

/// A calibrated camera with all that says how good it is.
#[derive(Debug, Clone)]
pub struct Calibration {
    pub camera: Camera,
    /// Covariance of fx fy skew cx cy, the distortion's coefficients, the rotation vector w
    /// (`R <- exp([w]x) R`, radians, camera axes) and the camera's centre in the world (metres).
    /// Rows of parameters that were not free are zero.
    pub covariance: DMatrix<f64>,
    /// Measured minus predicted pixel of each observation, px, at its measured depth; of a line the
    /// signed distances of its segment's two ends from the line's image, positive to the right of it
    /// as seen from the first end to the second. Outliers too; infinite where the camera cannot see
    /// the point or line.
    pub residuals: Vec<Vector2<f64>>,
    pub inliers: Vec<bool>,
    /// Root mean square length of the inliers' residuals, px.
    pub rms: f64,
    /// Estimated noise over assumed noise (1 when the covariances were right).
    pub noise_factor: f64,
    /// Condition number of the normal equations at unit diagonal.
    pub condition: f64,
    pub iterations: usize,
    /// Does the model fit? With noise that was estimated from the residuals only its suspects count.
    pub check: FitCheck,
}
