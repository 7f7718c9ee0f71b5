//! Every zoom position by itself, then what they share; and what became of each view.

use nalgebra::{DMatrix, Vector2};

use super::common_line::{self, Own};
use super::report::{Fault, RigCalibrated, ViewResult, ZoomCalibration};
use super::{RigCalibration, View};
use crate::calibrate::{BoardCalibration, Boards, LaserCalibration, calibrate_from_boards, calibrate_laser_line};
use crate::error::{Error, Result, Status};

/// Why a position has no answer when none of its views has a board.
const NO_BOARD: &str = "no view at this zoom position shows the board";

pub(super) fn solve(given: &RigCalibration) -> Result<RigCalibrated> {
    let Some(size) = given.size else { return Err(Error::TooFewPoints { given: 0, needed: 1 }) };
    let mut positions: Vec<f64> = given.views.iter().map(|v| v.zoom).collect();
    positions.sort_by(f64::total_cmp);
    positions.dedup();
    let mut views: Vec<ViewResult> = given.views.iter().map(unused).collect();
    let mut zooms = Vec::new();
    for zoom in positions {
        given.options.calibration.cancel.check()?;
        let numbers: Vec<usize> = (0..given.views.len()).filter(|v| given.views[*v].zoom == zoom).collect();
        let zoom = position(given, size, zoom, numbers)?;
        tell(&zoom, &mut views);
        zooms.push(zoom);
    }
    let owns: Vec<Option<Own>> = zooms.iter().map(own).collect();
    let pupil = given.options.common_line.then_some(given.options.pupil_sigma);
    let shared = common_line::share(&owns, pupil);
    for (zoom, node) in zooms.iter_mut().zip(shared.nodes) {
        zoom.node = node;
    }
    Ok(RigCalibrated { size, zooms, views, common: shared.common, covariance: shared.covariance })
}

/// One position.
fn position(given: &RigCalibration, size: [u32; 2], zoom: f64, views: Vec<usize>) -> Result<ZoomCalibration> {
    let options = &given.options.calibration;
    let mut set = Boards::new(size[0], size[1])?;
    for view in views.iter().map(|v| &given.views[*v]) {
        let Ok(corners) = &view.corners else { continue };
        // Refused on the way in, if anything was wrong with it.
        let index = set.add_view(corners)?;
        if let Some(Ok(spot)) = view.spot {
            set.set_spot(index, spot)?;
        }
    }
    if set.views().is_empty() {
        let first = views.iter().find_map(|v| given.views[*v].corners.as_ref().err());
        let error = Error::NoChessboard { reason: first.map_or(NO_BOARD.into(), |e| format!("{NO_BOARD}: {e}")) };
        return Ok(ZoomCalibration { zoom, views, boards: Err(error.clone()), laser: Err(error), node: None });
    }
    let laser = match calibrate_laser_line(&set, None, options) {
        Err(Error::Cancelled) => return Err(Error::Cancelled),
        other => other,
    };
    let boards = match &laser {
        Ok(laser) => Ok(laser.boards.clone()),
        Err(_) => match calibrate_from_boards(&set, options) {
            Err(Error::Cancelled) => return Err(Error::Cancelled),
            other => other,
        },
    };
    Ok(ZoomCalibration { zoom, views, boards, laser, node: None })
}

/// Estimate and covariance of one position by itself.
fn own(zoom: &ZoomCalibration) -> Option<Own> {
    let boards = zoom.boards.as_ref().ok()?;
    let camera = &boards.calibration.camera;
    let lens = 5 + camera.distortion.coefficients().len();
    let (laser, covariance) = match &zoom.laser {
        Ok(laser) => (Some(laser.line), laser.covariance.clone()),
        Err(_) => (None, boards.calibration.covariance.view((0, 0), (lens, lens)).into_owned()),
    };
    Some(Own { zoom: zoom.zoom, intrinsics: camera.intrinsics, distortion: camera.distortion, laser, covariance })
}

/// A view of which nothing is known but what came in.
fn unused(view: &View) -> ViewResult {
    let corners = view.corners.as_ref().map_or(Vec::new(), Clone::clone);
    let spot_fault = match (&view.corners, &view.spot) {
        (_, Some(Err(e))) => Some(e.into()),
        _ => None,
    };
    ViewResult {
        zoom: view.zoom,
        fault: view.corners.as_ref().err().map(Fault::from),
        spot_fault,
        inliers: vec![false; corners.len()],
        corners,
        residuals: Vec::new(),
        pose: None,
        spot: view.spot.as_ref().and_then(|s| s.as_ref().ok()).copied(),
        spot_used: false,
        spot_residual: None,
    }
}

/// Tells the views of a position what became of them.
fn tell(zoom: &ZoomCalibration, views: &mut [ViewResult]) {
    let with_board: Vec<usize> = zoom.views.iter().copied().filter(|v| !views[*v].corners.is_empty()).collect();
    match &zoom.boards {
        Ok(boards) => tell_boards(boards, &with_board, views),
        Err(e) => with_board.iter().for_each(|v| views[*v].fault = Some(e.into())),
    }
    match &zoom.laser {
        Ok(laser) => tell_spots(laser, &with_board, views),
        Err(e) => {
            let with_spot = with_board.iter().filter(|v| views[**v].spot.is_some()).copied().collect::<Vec<_>>();
            with_spot.iter().for_each(|v| views[*v].spot_fault = Some(e.into()));
        }
    }
}

fn tell_boards(boards: &BoardCalibration, with_board: &[usize], views: &mut [ViewResult]) {
    let mut first = 0;
    for (v, pose) in with_board.iter().zip(&boards.views) {
        let view = &mut views[*v];
        let own = first..first + view.corners.len();
        first = own.end;
        view.residuals = boards.calibration.residuals[own.clone()].to_vec();
        view.inliers = boards.calibration.inliers[own].to_vec();
        view.pose = Some(*pose);
        if !pose.used {
            let reason = format!(
                "{} of {} corners disagree with the other views (rms {:.2} px): is it another board, or another zoom?",
                pose.corners - pose.inliers,
                pose.corners,
                pose.rms
            );
            view.fault = Some(Fault::new(Status::NoConsensus, reason));
        }
    }
}

fn tell_spots(laser: &LaserCalibration, with_board: &[usize], views: &mut [ViewResult]) {
    for (i, v) in with_board.iter().enumerate() {
        let view = &mut views[*v];
        (view.spot_used, view.spot_residual) = (laser.used[i], laser.residuals[i]);
        let Some(spot) = view.spot.filter(|_| !laser.used[i]) else { continue };
        let at = format!("the spot at ({:.1}, {:.1})", spot.pixel.x, spot.pixel.y);
        let reason = match laser.residuals[i].map(|r: Vector2<f64>| r.norm()) {
            _ if view.fault.is_some() => "its view is not used".to_string(),
            Some(off) => format!("{at} is {off:.1} px from where the laser meets the board: a reflection?"),
            None => format!("{at}: the laser does not meet the board"),
        };
        view.spot_fault = Some(Fault::new(Status::NoConsensus, reason));
    }
}

/// The block-diagonal matrix of the given ones.
pub(super) fn block_diagonal<'a>(blocks: impl Iterator<Item = &'a DMatrix<f64>> + Clone) -> DMatrix<f64> {
    let size = blocks.clone().map(DMatrix::nrows).sum();
    let mut all = DMatrix::zeros(size, size);
    let mut first = 0;
    for block in blocks {
        all.view_mut((first, first), block.shape()).copy_from(block);
        first += block.nrows();
    }
    all
}
