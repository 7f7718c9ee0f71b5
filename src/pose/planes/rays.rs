//! What cameras and scanners measure, as shots: their noise is along their rays.

use nalgebra::{Vector2, Vector3};

use crate::error::{Error, Result};
use crate::geometry::{Camera, InverseDepthPoint};
use crate::image::depth::{DepthMap, DepthNoise};

/// A ray on which nothing was measured: passed over.
const NOTHING: InverseDepthPoint = InverseDepthPoint {
    origin: Vector3::new(0.0, 0.0, 0.0),
    direction: Vector3::new(0.0, 0.0, 0.0),
    rho: f64::NAN,
    variance: f64::NAN,
};

/// The shots of points that a scanner at the origin measured by their ranges: `sigma` is the standard
/// deviation of a range, metres. Those of points that are not finite are not either.
///
/// # Errors
/// `InvalidArgument` for a standard deviation that is none.
pub fn shots_of_ranges(points: &[Vector3<f64>], sigma: f64) -> Result<Vec<InverseDepthPoint>> {
    super::check_sigma(Some(sigma))?;
    let shot = |p: &Vector3<f64>| {
        let range = p.norm();
        // d(1/r) = dr / r^2.
        let (rho, deviation) = (1.0 / range, sigma / (range * range));
        let usable = range.is_finite() && rho.is_finite();
        if usable {
            InverseDepthPoint { direction: p * rho, rho, variance: deviation * deviation, ..NOTHING }
        } else {
            NOTHING
        }
    };
    Ok(points.iter().map(shot).collect())
}

/// The shots of a depth map, one a pixel; those of pixels without depth are not finite.
/// The frame is the camera's, its pose plays no part.
///
/// # Errors
/// `InvalidArgument` for a map of another size than the camera's image.
pub fn shots_of_depth_map(map: &DepthMap, camera: &Camera, noise: &DepthNoise) -> Result<Vec<InverseDepthPoint>> {
    noise.check()?;
    if [map.width(), map.height()] != [camera.width as usize, camera.height as usize] {
        let reason =
            format!("{} x {}, the camera's image is {} x {}", map.width(), map.height(), camera.width, camera.height);
        return Err(Error::invalid("depth", reason));
    }
    let shot = |x: usize, y: usize| {
        let rho = 1.0 / map.at(x, y)?;
        let q = camera.undistort_pixel(&Vector2::new(x as f64, y as f64))?;
        Some(InverseDepthPoint { direction: q.push(1.0), rho, variance: noise.variance(rho), ..NOTHING })
    };
    let pixels = (0..map.height()).flat_map(|y| (0..map.width()).map(move |x| (x, y)));
    Ok(pixels.map(|(x, y)| shot(x, y).unwrap_or(NOTHING)).collect())
}
