//! The views of planar boards that a camera, and its laser, are calibrated from.

use nalgebra::{Matrix2, Vector2};

use crate::error::{Degeneracy, Error, Result};

/// Largest coordinate that is taken for one: squares and their sums stay finite.
const MAX_COORDINATE: f64 = 1e12;
/// Fewer corners leave a view's pose open.
pub(crate) const MIN_CORNERS: usize = 4;
/// Width over length below which corners are taken for points of one line.
const MIN_ASPECT: f64 = 1e-4;

/// A corner of a planar board and where it was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardCorner {
    /// Position on the board, z = 0. Any unit; poses come out in the same one.
    pub board: Vector2<f64>,
    pub pixel: Vector2<f64>,
    /// px^2; `None`: the common noise of all such corners.
    pub pixel_covariance: Option<Matrix2<f64>>,
}

/// Where the laser's spot on a board was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardSpot {
    pub pixel: Vector2<f64>,
    /// px^2; `None`: the common noise of the corners.
    pub pixel_covariance: Option<Matrix2<f64>>,
}

/// One image of a board.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardView {
    pub(crate) corners: Vec<BoardCorner>,
    pub(crate) spot: Option<BoardSpot>,
}

impl BoardView {
    pub fn corners(&self) -> &[BoardCorner] {
        &self.corners
    }

    pub fn spot(&self) -> Option<&BoardSpot> {
        self.spot.as_ref()
    }
}

/// A growing set of views of boards by one camera. Corners may be missing and boards may differ from
/// view to view; all boards must be seen from the same side of their x-y axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Boards {
    width: u32,
    height: u32,
    views: Vec<BoardView>,
    bending: f64,
}

impl Boards {
    /// For a camera with the given image size (pixels).
    pub fn new(width: u32, height: u32) -> Result<Self> {
        if width == 0 || height == 0 || width > 1 << 16 || height > 1 << 16 {
            return Err(Error::invalid("image size", format!("{width} x {height}")));
        }
        Ok(Self { width, height, views: Vec::new(), bending: 0.0 })
    }

    pub fn width(&self) -> u32 {
        self.width
    }

    pub fn height(&self) -> u32 {
        self.height
    }

    pub fn views(&self) -> &[BoardView] {
        &self.views
    }

    /// Prior standard deviation of the board's bending, 0 for flat boards.
    pub fn bending(&self) -> f64 {
        self.bending
    }

    /// Lets the board be a smoothly bent sheet, z = b1 x^2 + b2 x y + b3 y^2 with x, y from the middle
    /// of all corners in units of the greatest distance from there: each b is how far the sheet's rim
    /// is off its tangent plane. All views must then be of one board. 0, the default, keeps it flat.
    ///
    /// # Errors
    /// `InvalidArgument`: `sigma` (the prior standard deviation of each b, in the board's unit) is
    /// negative or not finite.
    pub fn set_bending(&mut self, sigma: f64) -> Result<()> {
        if !(sigma.is_finite() && sigma >= 0.0) {
            return Err(Error::invalid("bending", format!("{sigma} is no standard deviation")));
        }
        self.bending = sigma;
        Ok(())
    }

    /// Adds a view; the answer is its number.
    ///
    /// # Errors
    /// `TooFewPoints` (fewer than 4 corners), `NotFinite` (index: the corner), `InvalidArgument` (a
    /// covariance that is not positive definite), `Degenerate` (all corners, or all but one, on one line).
    pub fn add_view(&mut self, corners: &[BoardCorner]) -> Result<usize> {
        if corners.len() < MIN_CORNERS {
            return Err(Error::TooFewPoints { given: corners.len(), needed: MIN_CORNERS });
        }
        for (index, c) in corners.iter().enumerate() {
            check_vector(&c.board, "board_xy", index)?;
            check_vector(&c.pixel, "uv", index)?;
            check_covariance(c.pixel_covariance.as_ref(), index)?;
        }
        let view = self.views.len();
        for (what, points) in [
            ("corners of the board", corners.iter().map(|c| c.board).collect::<Vec<_>>()),
            ("corners in the image", corners.iter().map(|c| c.pixel).collect()),
        ] {
            if aspect(&points) < MIN_ASPECT {
                let detail = format!("view {view}: the {what} lie on one line, or all but one do");
                return Err(Error::degenerate(Degeneracy::Collinear, detail));
            }
        }
        self.views.push(BoardView { corners: corners.to_vec(), spot: None });
        Ok(view)
    }

    /// Sets where the laser's spot on the board of a view was seen; a later one replaces it.
    ///
    /// # Errors
    /// `InvalidArgument` (no such view, a covariance that is not positive definite), `NotFinite`.
    pub fn set_spot(&mut self, view: usize, spot: BoardSpot) -> Result<()> {
        let count = self.views.len();
        let slot =
            self.views.get_mut(view).ok_or_else(|| Error::invalid("view", format!("{view} of {count} views")))?;
        check_vector(&spot.pixel, "spot", 0)?;
        check_covariance(spot.pixel_covariance.as_ref(), view)?;
        slot.spot = Some(spot);
        Ok(())
    }
}

fn check_vector(v: &Vector2<f64>, name: &'static str, index: usize) -> Result<()> {
    if !(v.x.is_finite() && v.y.is_finite()) {
        return Err(Error::NotFinite { name, index });
    }
    if v.amax() > MAX_COORDINATE {
        return Err(Error::invalid(name, format!("{:e} of point {index} is beyond measure", v.amax())));
    }
    Ok(())
}

fn check_covariance(c: Option<&Matrix2<f64>>, index: usize) -> Result<()> {
    let Some(c) = c else { return Ok(()) };
    if c.iter().any(|v| !v.is_finite()) {
        return Err(Error::NotFinite { name: "uv covariance", index });
    }
    if c.m11 > 0.0 && c.m22 > 0.0 && c.determinant() > 0.0 && c.m12 == c.m21 && c.amax() < MAX_COORDINATE {
        return Ok(());
    }
    Err(Error::invalid("uv covariance", format!("of point {index} is not positive definite")))
}

/// Width over length of a set of points less the one whose absence makes it least: four points of
/// which three are on a line, and the like, determine no homography either.
fn aspect(points: &[Vector2<f64>]) -> f64 {
    let n = points.len() as f64;
    let centre = points.iter().sum::<Vector2<f64>>() / n;
    let size = points.iter().fold(0.0f64, |m, p| m.max((p - centre).amax()));
    if size == 0.0 {
        return 0.0;
    }
    let scaled = || points.iter().map(|p| (p - centre) / size);
    let scatter: Matrix2<f64> = scaled().map(|d| d * d.transpose()).sum();
    // Leaving d out moves the centre by d / (n - 1), which adds to the point's own part.
    let without = |d: Vector2<f64>| scatter - d * d.transpose() * (n / (n - 1.0));
    scaled().map(|d| width_over_length(&without(d))).fold(f64::INFINITY, f64::min)
}

/// The root of the ratio of a scatter's eigenvalues.
fn width_over_length(scatter: &Matrix2<f64>) -> f64 {
    let half = 0.5 * scatter.trace();
    let root = (half * half - scatter.determinant()).max(0.0).sqrt();
    if half > 0.0 { ((half - root).max(0.0) / (half + root)).sqrt() } else { 0.0 }
}
