//! Calibration of a camera from views of planar boards (Zhang 2000; Bouguet's toolbox, IV.D.1-2 of
//! the thesis): closed-form start by homographies, then maximum likelihood of intrinsics, lens and
//! all poses together, outliers set aside and named.

pub(crate) mod adjust;
mod advice;
pub(crate) mod fit;
mod homographies;
pub(crate) mod model;
pub(crate) mod solve;
mod start;
mod view_sum;
mod views;
mod zhang;

pub use solve::calibrate_from_boards;
pub use views::{BoardCorner, BoardSpot, BoardView, Boards};

use nalgebra::{Matrix6, Vector3};

use super::Calibration;
use crate::geometry::Rigid;

/// A camera calibrated from boards.
#[derive(Debug, Clone)]
pub struct BoardCalibration {
    /// Intrinsics and lens; the pose is the identity, its rows of the covariance are zero. Residuals
    /// and inliers are those of all corners, view after view in the order of adding.
    pub calibration: Calibration,
    pub views: Vec<BoardPose>,
    /// How far the sheet bends, in the board's unit ([`Boards::set_bending`]); zero for flat boards.
    pub bending: Vector3<f64>,
    /// What to add to make the calibration better, in words, the most needed first; may be empty.
    pub advice: Vec<String>,
}

/// What was found about one view.
#[derive(Debug, Clone, Copy)]
pub struct BoardPose {
    /// Board to camera, in the board's unit.
    pub pose: Rigid,
    /// Covariance of w (`R <- exp([w]x) R`, radians, camera axes) and of the camera's centre in the
    /// board's frame. Zero for a view that was set aside.
    pub covariance: Matrix6<f64>,
    /// False for a view that was set aside: most of its corners disagree with the other views.
    pub used: bool,
    /// Corners that were given.
    pub corners: usize,
    /// Corners that were used.
    pub inliers: usize,
    /// Root mean square length of the used corners' residuals, px; of all corners of a view that was
    /// set aside.
    pub rms: f64,
}
