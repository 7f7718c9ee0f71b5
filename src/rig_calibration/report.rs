//! What a calibration of a rig found: for every zoom position and for every view.

use nalgebra::{DMatrix, SMatrix, Vector2};

use super::CommonLine;
use crate::calibrate::laser_line::MIN_BOARDS;
use crate::calibrate::{BoardCalibration, BoardCorner, BoardPose, BoardSpot, LaserCalibration};
use crate::error::{Error, Result, Status};
use crate::geometry::RigModel;
use crate::geometry::rig_model::{AxisOffsets, Encoders, LaserLine};
use crate::geometry::zoom_curve::{ZoomCurve, ZoomNode, rig_covariance};

/// Why something was not used.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    pub status: Status,
    pub reason: String,
}

impl Fault {
    pub(super) fn new(status: Status, reason: impl Into<String>) -> Self {
        Self { status, reason: reason.into() }
    }
}

impl From<&Error> for Fault {
    fn from(e: &Error) -> Self {
        Self { status: e.status(), reason: e.to_string() }
    }
}

/// One zoom position.
#[derive(Debug, Clone)]
pub struct ZoomCalibration {
    pub zoom: f64,
    /// Numbers of its views, in the order of adding, those without a board included.
    pub views: Vec<usize>,
    /// From this position's views alone: lens and poses, or why there are none.
    pub boards: Result<BoardCalibration>,
    /// The same with the laser's line (its `boards` are those above).
    pub laser: Result<LaserCalibration>,
    /// The answer, with what the other positions say of the laser's line; `None` where there is no lens,
    /// or no line from anywhere.
    pub node: Option<ZoomNode>,
}

/// One view.
#[derive(Debug, Clone)]
pub struct ViewResult {
    pub zoom: f64,
    /// Why the view was not used; `None` when it was.
    pub fault: Option<Fault>,
    /// Why its spot was not used; `None` when it was, or there is no picture with the laser on.
    pub spot_fault: Option<Fault>,
    pub corners: Vec<BoardCorner>,
    /// Measured minus predicted, px, one for each corner; none where the zoom position has no lens.
    pub residuals: Vec<Vector2<f64>>,
    /// Which corners were used.
    pub inliers: Vec<bool>,
    /// The board's pose in the camera's frame, metres: the plane that the spot lies on.
    pub pose: Option<BoardPose>,
    pub spot: Option<BoardSpot>,
    pub spot_used: bool,
    /// Measured minus predicted, px.
    pub spot_residual: Option<Vector2<f64>>,
}

/// All that a calibration of a rig found.
#[derive(Debug, Clone)]
pub struct RigCalibrated {
    /// Image size.
    pub size: [u32; 2],
    /// Zoom positions, ascending.
    pub zooms: Vec<ZoomCalibration>,
    /// Views, in the order of adding.
    pub views: Vec<ViewResult>,
    /// The laser's line as all positions see it; `None` when fewer than two of them saw it or it was
    /// not asked for.
    pub common: Option<CommonLine>,
    /// Joint covariance of the nodes' parameters, node after node, positions without one left out.
    pub covariance: DMatrix<f64>,
}

impl RigCalibrated {
    /// The rig at a zoom position that was calibrated, with the 7 x 7 covariance of
    /// [`LaserCalibration::rig_covariance`](crate::calibrate::LaserCalibration::rig_covariance).
    ///
    /// # Errors
    /// `InvalidArgument` (no such position); what went wrong there.
    pub fn rig_model(&self, index: usize) -> Result<(RigModel, SMatrix<f64, 7, 7>)> {
        let count = self.zooms.len();
        let zoom = self
            .zooms
            .get(index)
            .ok_or_else(|| Error::invalid("index", format!("{index} of {count} zoom positions")))?;
        let Some(node) = &zoom.node else {
            let own = zoom.boards.as_ref().err().or(zoom.laser.as_ref().err());
            return Err(own
                .cloned()
                .unwrap_or_else(|| Error::Internal { reason: "a zoom position without an answer".into() }));
        };
        let before = self.zooms[..index].iter().filter(|z| z.node.is_some()).count();
        let n = node.parameters().len();
        let own = self.covariance.view((before * n, before * n), (n, n)).into_owned();
        Ok((self.model(node), rig_covariance(&node.intrinsics, &own)))
    }

    fn model(&self, node: &ZoomNode) -> RigModel {
        RigModel {
            width: self.size[0],
            height: self.size[1],
            intrinsics: node.intrinsics,
            distortion: node.distortion,
            laser: node.laser,
            offsets: AxisOffsets::default(),
            encoders: Encoders::default(),
        }
    }

    /// Lens and laser line at all zooms between those that were calibrated.
    ///
    /// # Errors
    /// `TooFewSpots` (no position with a laser line); those of [`ZoomCurve::new`].
    pub fn curve(&self) -> Result<ZoomCurve> {
        let nodes: Vec<ZoomNode> = self.zooms.iter().filter_map(|z| z.node.clone()).collect();
        if nodes.is_empty() {
            return Err(Error::TooFewSpots { given: 0, needed: MIN_BOARDS });
        }
        ZoomCurve::new(self.size, nodes, self.covariance.clone())
    }

    /// The laser's line that all zoom positions share, in the frame of the first of them.
    pub fn common_line(&self) -> Option<&LaserLine> {
        self.common.as_ref().filter(|c| c.agrees).map(|c| &c.line)
    }
}
