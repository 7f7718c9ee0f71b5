//! The laser's line in the camera's frame, from views of boards that the laser hits (IV.D.3-5 of the
//! thesis). Two methods, both by name:
//!
//! * [`least_squares`], eqs (6)-(7) as the thesis has them (in their right form, maths.md section 2),
//!   of points from [`point_by_homography`], eqs (8)-(9). Unweighted, though a point's noise grows
//!   with the square of its distance: 1.2 to 1.8 times worse than the bound.
//! * [`calibrate_laser_line`], maximum likelihood: each spot's pixel is that of the laser's line meeting
//!   the board's plane, adjusted together with all board poses and with the lens. On the bound.

mod joint;
mod least_squares;

pub use joint::calibrate_laser_line;
pub use least_squares::{least_squares, point_by_homography};

use nalgebra::{DMatrix, Matrix4, SMatrix, Vector2};

use super::BoardCalibration;
use crate::geometry::RigModel;
use crate::geometry::rig_model::{AxisOffsets, Encoders, LaserLine};
use crate::geometry::zoom_curve::rig_covariance;

/// Fewer boards leave the line open.
pub const MIN_BOARDS: usize = 2;

/// A calibrated laser line.
#[derive(Debug, Clone)]
pub struct LaserCalibration {
    /// In the camera's frame, metres.
    pub line: LaserLine,
    /// Lens and poses as the joint adjustment left them.
    pub boards: BoardCalibration,
    /// Joint covariance of fx fy skew cx cy, the distortion's coefficients, then x0 y0 vx vy. Rows of
    /// a lens that was not free are zero.
    pub covariance: DMatrix<f64>,
    /// Measured minus predicted pixel of each view's spot, outliers included; `None` where there is no
    /// spot, or none is predicted.
    pub residuals: Vec<Option<Vector2<f64>>>,
    /// Which views' spots were used.
    pub used: Vec<bool>,
    /// Root mean square length of the used spots' residuals, px.
    pub rms: f64,
}

impl LaserCalibration {
    /// Covariance of x0 y0 vx vy (metres, slopes), the lens's uncertainty included.
    pub fn line_covariance(&self) -> Matrix4<f64> {
        let first = self.covariance.nrows() - 4;
        Matrix4::from_fn(|i, j| self.covariance[(first + i, first + j)])
    }

    /// Covariance of what a rig's depth depends on: x0 y0 vx vy (metres, slopes), the logarithm of the
    /// common scale of fx and fy, cx, cy (pixels). Line and lens come from the same images and are
    /// correlated: a prior must hold them together.
    pub fn rig_covariance(&self) -> SMatrix<f64, 7, 7> {
        rig_covariance(&self.boards.calibration.camera.intrinsics, &self.covariance)
    }

    /// A rig with this lens and laser, axes through the camera's centre and true encoders.
    pub fn rig_model(&self) -> RigModel {
        let camera = &self.boards.calibration.camera;
        RigModel {
            width: camera.width,
            height: camera.height,
            intrinsics: camera.intrinsics,
            distortion: camera.distortion,
            laser: self.line,
            offsets: AxisOffsets::default(),
            encoders: Encoders::default(),
        }
    }
}
