//! The board in a picture with the laser off, and the spot on it in one with the laser on.

use nalgebra::{Matrix2, Vector2};

use super::{ChessboardSpec, RigCalibrationOptions};
use crate::calibrate::{BoardCorner, BoardSpot};
use crate::detect::chessboard::{ChessboardOptions, detect_chessboard};
use crate::detect::spot::{Region, Spot, SpotOptions, detect_spot};
use crate::error::{Error, Result};
use crate::geometry::homography;
use crate::image::ImageView;

/// What was found in a view.
pub(super) struct Found {
    pub corners: Result<Vec<BoardCorner>>,
    pub spot: Option<Result<BoardSpot>>,
}

pub(super) fn find(
    off: &ImageView<'_>,
    on: Option<&ImageView<'_>>,
    board: &ChessboardSpec,
    options: &RigCalibrationOptions,
) -> Found {
    let corners = corners(off, board, options).or_else(|e| match on {
        // A head that stands still shows the same board.
        Some(on) => corners(on, board, options).map_err(|_| e),
        None => Err(e),
    });
    let spot = match (on, &corners) {
        (Some(on), Ok(corners)) => Some(spot(off, on, corners, board, &options.spot)),
        _ => None,
    };
    Found { corners, spot }
}

/// The corners' common noise is estimated from the residuals: their own covariances say what the
/// pixels can tell, a few hundredths of a pixel, and no printed board is that flat.
fn corners(image: &ImageView<'_>, board: &ChessboardSpec, options: &RigCalibrationOptions) -> Result<Vec<BoardCorner>> {
    let size = Some([board.columns, board.rows]);
    let found = detect_chessboard(image, &ChessboardOptions { size, min_found: options.min_found })?;
    let seen = found.corners.iter().enumerate().filter_map(|(i, c)| c.map(|c| (i, c)));
    Ok(seen
        .map(|(i, c)| BoardCorner { board: board.position(i), pixel: Vector2::new(c.x, c.y), pixel_covariance: None })
        .collect())
}

/// The spot, which must lie on the board's squares.
fn spot(
    off: &ImageView<'_>,
    on: &ImageView<'_>,
    corners: &[BoardCorner],
    board: &ChessboardSpec,
    options: &SpotOptions,
) -> Result<BoardSpot> {
    let (on_board, in_image): (Vec<_>, Vec<_>) = corners.iter().map(|c| (c.board, c.pixel)).unzip();
    let to_image = homography::estimate(&on_board, &in_image)?;
    let to_board = homography::estimate(&in_image, &on_board)?;
    // The outer squares are part of the board.
    let half = Vector2::new(f64::from(board.columns + 1), f64::from(board.rows + 1)) * (0.5 * board.square);
    let outline = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(x, y)| homography::apply(&to_image, &Vector2::new(x * half.x, y * half.y)));
    let region = region(outline.iter().flatten().chain(&in_image), off);
    let options = SpotOptions { region, ..options.clone() };
    let spot = detect_spot(&[*on], &[*off], &options)?;
    let Spot { x, y, covariance: [xx, xy, yy], .. } = spot;
    let pixel = Vector2::new(x, y);
    let place = homography::apply(&to_board, &pixel).filter(|p| p.x.abs() <= half.x && p.y.abs() <= half.y);
    if place.is_none() {
        return Err(Error::NotFound { reason: format!("the spot at ({x:.1}, {y:.1}) is not on the board") });
    }
    let drawn = edge_deviation(off, &spot).powi(2);
    Ok(BoardSpot { pixel, pixel_covariance: Some(Matrix2::new(xx + drawn, xy, xy, yy + drawn)) })
}

/// A spot across the edge of a square is drawn towards the bright side: with reflectances a and b, by
/// sqrt(2 / pi) sigma (b - a) / (b + a) when the edge halves it, half of sigma (b - a) / (b + a) root mean
/// square over the edges that touch it. Its fit cannot know; the standard deviation has to.
fn edge_deviation(off: &ImageView<'_>, spot: &Spot) -> f64 {
    // What stands out of the noise of a Gaussian spot reaches to about twice its sigma.
    let reach = (f64::from(spot.area) / std::f64::consts::PI).sqrt().max(1.0);
    let range = |centre: f64, size: u32| {
        let last = f64::from(size - 1);
        (centre - reach).round().clamp(0.0, last) as u32..=(centre + reach).round().clamp(0.0, last) as u32
    };
    let light = |x: u32, y: u32| off.rgb(x, y).iter().map(|c| f64::from(*c)).sum::<f64>();
    let pixels = range(spot.y, off.height()).flat_map(|y| range(spot.x, off.width()).map(move |x| (x, y)));
    let (low, high) = pixels
        .filter(|(x, y)| (f64::from(*x) - spot.x).hypot(f64::from(*y) - spot.y) <= reach + 0.5)
        .map(|(x, y)| light(x, y))
        .fold((f64::INFINITY, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
    let contrast = if low + high > 0.0 { (high - low) / (high + low) } else { 0.0 };
    0.5 * (0.5 * reach) * contrast.max(0.0)
}

/// The rectangle about the points, cut to the image; `None` (all of it) when nothing is left.
fn region<'a>(points: impl Iterator<Item = &'a Vector2<f64>>, image: &ImageView<'_>) -> Option<Region> {
    let empty = (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY));
    let (low, high) = points.fold(empty, |(l, h), p| (l.inf(p), h.sup(p)));
    let clip = |low: f64, high: f64, size: u32| {
        let size = f64::from(size);
        let (a, b) = (low.floor().clamp(0.0, size), (high.ceil() + 1.0).clamp(0.0, size));
        (a as u32, (b - a).max(0.0) as u32)
    };
    let ((x, width), (y, height)) = (clip(low.x, high.x, image.width()), clip(low.y, high.y, image.height()));
    (width > 0 && height > 0).then_some(Region { x, y, width, height })
}
