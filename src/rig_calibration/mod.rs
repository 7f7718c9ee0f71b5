//! The calibration of a rig's camera and laser as one workflow (section IV.D of the thesis): pictures
//! of a chessboard with the laser off and on, at one or several zoom positions, to intrinsics, lens and
//! laser line at each of them, with covariances.
//!
//! [`RigCalibration`] collects views; what could not be found in one is kept beside it, and says
//! nothing against the others. [`RigCalibration::solve`] answers for every zoom position by itself
//! ([`calibrate_laser_line`](crate::calibrate::calibrate_laser_line): closed forms, then maximum
//! likelihood of lens, laser line and all board poses together) and then lets the positions share what
//! is one thing, the laser's line (`common_line`).

mod common_line;
mod picture;
mod report;
mod solve;

pub use common_line::CommonLine;
pub use report::{Fault, RigCalibrated, ViewResult, ZoomCalibration};

use nalgebra::Vector2;

use crate::calibrate::{BoardCorner, BoardSpot, Boards, CalibrationOptions};
use crate::detect::chessboard::{MAX_SIDE, MIN_SIDE};
use crate::detect::spot::SpotOptions;
use crate::error::{Error, Result};
use crate::image::ImageView;

/// A flat chessboard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChessboardSpec {
    /// Inner corners in a row and in a column, 3 to 128.
    pub columns: u32,
    pub rows: u32,
    /// Side of a square, metres.
    pub square: f64,
}

impl ChessboardSpec {
    fn check(&self) -> Result<()> {
        let sides = MIN_SIDE..=MAX_SIDE;
        if !sides.contains(&self.columns) || !sides.contains(&self.rows) {
            let reason =
                format!("{} x {} inner corners; {MIN_SIDE} to {MAX_SIDE} are possible", self.columns, self.rows);
            return Err(Error::invalid("board", reason));
        }
        if !(self.square > 0.0 && self.square <= 100.0) {
            return Err(Error::invalid("square", format!("{} m is no side of a square", self.square)));
        }
        Ok(())
    }

    /// Where a corner lies on the board, metres from its middle.
    fn position(&self, index: usize) -> Vector2<f64> {
        let (column, row) = (index % self.columns as usize, index / self.columns as usize);
        let middle = Vector2::new(f64::from(self.columns - 1), f64::from(self.rows - 1)) * 0.5;
        (Vector2::new(column as f64, row as f64) - middle) * self.square
    }
}

#[derive(Debug, Clone)]
pub struct RigCalibrationOptions {
    /// Lens model and how it is fitted; a fixed lens is refused.
    pub calibration: CalibrationOptions,
    /// Least share of a board's corners that must be found.
    pub min_found: f64,
    /// The search for the spot; its region is replaced by the board's.
    pub spot: SpotOptions,
    /// Let all zoom positions share one laser line where the data do not contradict it.
    pub common_line: bool,
    /// Prior standard deviation, metres, of how far the camera's centre of projection moves along its
    /// axis from one zoom position to the others.
    pub pupil_sigma: f64,
}

impl Default for RigCalibrationOptions {
    fn default() -> Self {
        Self {
            calibration: CalibrationOptions::default(),
            min_found: 0.5,
            spot: SpotOptions::default(),
            common_line: true,
            pupil_sigma: 0.05,
        }
    }
}

/// A view as it came in.
#[derive(Debug, Clone, PartialEq)]
struct View {
    zoom: f64,
    corners: Result<Vec<BoardCorner>>,
    /// `None`: no picture with the laser on.
    spot: Option<Result<BoardSpot>>,
}

/// A growing set of views of chessboards by the camera of a rig.
#[derive(Debug, Clone)]
pub struct RigCalibration {
    options: RigCalibrationOptions,
    board: ChessboardSpec,
    /// Of the first view's image.
    size: Option<[u32; 2]>,
    views: Vec<View>,
}

impl RigCalibration {
    /// # Errors
    /// `InvalidArgument`: a board that cannot be, a fixed lens, a share or standard deviation out of range.
    pub fn new(board: ChessboardSpec, options: RigCalibrationOptions) -> Result<Self> {
        board.check()?;
        if options.calibration.fixed_lens.is_some() {
            return Err(Error::invalid("options", "a fixed lens leaves nothing to calibrate"));
        }
        if !(0.0..=1.0).contains(&options.min_found) {
            return Err(Error::invalid("min_found", format!("{} is no share", options.min_found)));
        }
        check_pupil(options.pupil_sigma)?;
        options.spot.check()?;
        options.calibration.validate()?;
        Ok(Self { options, board, size: None, views: Vec::new() })
    }

    pub fn board(&self) -> &ChessboardSpec {
        &self.board
    }

    pub fn options(&self) -> &RigCalibrationOptions {
        &self.options
    }

    /// Views so far, those in which nothing was found included.
    pub fn len(&self) -> usize {
        self.views.len()
    }

    pub fn is_empty(&self) -> bool {
        self.views.is_empty()
    }

    /// The board of the views that are added from now on: a near one may be smaller than a far one.
    pub fn set_board(&mut self, board: ChessboardSpec) -> Result<()> {
        board.check()?;
        self.board = board;
        Ok(())
    }

    /// Whether the zoom positions share one laser line, and how far the camera's centre moves with the zoom
    /// (standard deviation, metres).
    pub fn set_common_line(&mut self, share: bool, pupil_sigma: f64) -> Result<()> {
        check_pupil(pupil_sigma)?;
        (self.options.common_line, self.options.pupil_sigma) = (share, pupil_sigma);
        Ok(())
    }

    /// Adds a picture of the board with the laser off and, if there is one, the same with it on; answers
    /// the view's number. `zoom` is the device's own number of the zoom position, in any unit that grows
    /// or falls with the focal length; views of one position have the same number.
    ///
    /// A board or a spot that is not found is no error here: the view keeps the reason
    /// ([`fault`](Self::fault), [`spot_fault`](Self::spot_fault)). The board is looked for with the laser
    /// off first; the spot only on the board.
    ///
    /// # Errors
    /// `InvalidArgument` (a picture of another size than those before, or than its pair), `NotFinite` (zoom).
    pub fn add_images(&mut self, zoom: f64, off: &ImageView<'_>, on: Option<&ImageView<'_>>) -> Result<usize> {
        let size = [off.width(), off.height()];
        if let Some(on) = on
            && [on.width(), on.height()] != size
        {
            let reason = format!("{} x {}, without the laser {} x {}", on.width(), on.height(), size[0], size[1]);
            return Err(Error::invalid("on", reason));
        }
        self.check(zoom, size)?;
        let found = picture::find(off, on, &self.board, &self.options);
        // Few corners, all on one line, are no view either.
        let corners = found.corners.and_then(|c| check_view(size, &c, None).map(|()| c));
        let spot = match &corners {
            Ok(c) => found.spot.map(|s| s.and_then(|s| check_view(size, c, Some(s)).map(|()| s))),
            Err(_) => None,
        };
        self.push(size, View { zoom, corners, spot })
    }

    /// Adds corners that were found elsewhere, in an image of the given size; places on the board in
    /// metres.
    ///
    /// # Errors
    /// As [`add_images`](Self::add_images), and those of [`Boards::add_view`].
    pub fn add_corners(&mut self, zoom: f64, size: [u32; 2], corners: &[BoardCorner]) -> Result<usize> {
        self.check(zoom, size)?;
        check_view(size, corners, None)?;
        self.push(size, View { zoom, corners: Ok(corners.to_vec()), spot: None })
    }

    /// Sets where the spot on the board of a view was seen; replaces what was found.
    ///
    /// # Errors
    /// `InvalidArgument` (no such view, no board in it, a covariance that is not positive definite),
    /// `NotFinite`.
    pub fn set_spot(&mut self, view: usize, spot: BoardSpot) -> Result<()> {
        let (count, size) = (self.views.len(), self.size.unwrap_or([1, 1]));
        let slot =
            self.views.get_mut(view).ok_or_else(|| Error::invalid("view", format!("{view} of {count} views")))?;
        let Ok(corners) = &slot.corners else {
            return Err(Error::invalid("view", format!("no board was found in view {view}")));
        };
        check_view(size, corners, Some(spot))?;
        slot.spot = Some(Ok(spot));
        Ok(())
    }

    /// Why no board was found in a view; `None` when one was, or there is no such view.
    pub fn fault(&self, view: usize) -> Option<&Error> {
        self.views.get(view)?.corners.as_ref().err()
    }

    /// Why no spot was found in a view with a board and a picture with the laser on.
    pub fn spot_fault(&self, view: usize) -> Option<&Error> {
        self.views.get(view)?.spot.as_ref()?.as_ref().err()
    }

    /// Calibrates every zoom position. What fails at one is said there ([`ZoomCalibration`]); only a
    /// cancellation, or no views at all, is an error of the whole.
    ///
    /// # Errors
    /// `TooFewPoints` (no views), `Cancelled`.
    pub fn solve(&self) -> Result<RigCalibrated> {
        solve::solve(self)
    }

    fn check(&self, zoom: f64, size: [u32; 2]) -> Result<()> {
        if !zoom.is_finite() {
            return Err(Error::NotFinite { name: "zoom", index: 0 });
        }
        match self.size {
            Some(first) if first != size => {
                let reason = format!("{} x {} pixels, those before {} x {}", size[0], size[1], first[0], first[1]);
                Err(Error::invalid("image size", reason))
            }
            _ => Ok(()),
        }
    }

    fn push(&mut self, size: [u32; 2], view: View) -> Result<usize> {
        self.size = Some(size);
        self.views.push(view);
        Ok(self.views.len() - 1)
    }
}

/// Refuses what a set of boards would refuse.
fn check_view(size: [u32; 2], corners: &[BoardCorner], spot: Option<BoardSpot>) -> Result<()> {
    let mut boards = Boards::new(size[0], size[1])?;
    let view = boards.add_view(corners)?;
    spot.map_or(Ok(()), |spot| boards.set_spot(view, spot))
}

fn check_pupil(sigma: f64) -> Result<()> {
    if (0.0..=1.0).contains(&sigma) {
        return Ok(());
    }
    Err(Error::invalid("pupil_sigma", format!("{sigma} m is no standard deviation of a camera's centre")))
}
