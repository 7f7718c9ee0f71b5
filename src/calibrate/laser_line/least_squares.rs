//! The thesis's way: points by homographies, a line by least squares.

use nalgebra::{Vector2, Vector3};

use crate::error::{Degeneracy, Error, Result};
use crate::geometry::rig_model::LaserLine;
use crate::geometry::{Rigid, homography};

/// The spot's place in the camera's frame by the homography from the image to the board, eqs (8)-(9):
/// M = R (x, y, 0) + t. The thesis takes four corners; all give a better answer. Pixels must be free
/// of lens distortion.
///
/// # Errors
/// As [`homography::estimate`]; `Degenerate` when the spot lies on the board's horizon.
pub fn point_by_homography(
    board: &[Vector2<f64>],
    pixels: &[Vector2<f64>],
    spot: &Vector2<f64>,
    pose: &Rigid,
) -> Result<Vector3<f64>> {
    let h = homography::estimate(pixels, board)?;
    let at = homography::apply(&h, spot)
        .ok_or_else(|| Error::degenerate(Degeneracy::IllConditioned, "the spot lies on the board's horizon"))?;
    Ok(pose.apply(&at.push(0.0)))
}

/// The line through points in the camera's frame by eqs (6)-(7): least squares of
/// x = x0 + vx Z, y = y0 + vy Z with Z taken as exact, every point weighing the same.
///
/// # Errors
/// `TooFewPoints` (2 are needed), `NotFinite`, `Degenerate` (all at one depth).
pub fn least_squares(points: &[Vector3<f64>]) -> Result<LaserLine> {
    if points.len() < super::MIN_BOARDS {
        return Err(Error::TooFewPoints { given: points.len(), needed: super::MIN_BOARDS });
    }
    if let Some(index) = points.iter().position(|p| p.iter().any(|v| !v.is_finite())) {
        return Err(Error::NotFinite { name: "points", index });
    }
    let n = points.len() as f64;
    let middle = points.iter().map(|p| p.z).sum::<f64>() / n;
    let (mut zz, mut by_z, mut sum) = (0.0, Vector2::zeros(), Vector2::zeros());
    for p in points {
        let z = p.z - middle;
        zz += z * z;
        by_z += p.xy() * z;
        sum += p.xy();
    }
    if zz <= 1e-16 * n * middle * middle {
        return Err(Error::degenerate(Degeneracy::OneDistance, "the points are at one depth"));
    }
    // About the middle depth the normal equations are diagonal.
    let v = by_z / zz;
    let start = sum / n - v * middle;
    Ok(LaserLine { x0: start.x, y0: start.y, vx: v.x, vy: v.y })
}
