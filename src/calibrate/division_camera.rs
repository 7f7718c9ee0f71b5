//! What the linear methods with the division model answer.

use nalgebra::{Matrix3x4, Vector2};

use super::Correspondences;
use super::decompose::decompose;
use super::measurement::Measurement;
use crate::error::{Error, Result};
use crate::geometry::{Camera, Distortion};

/// A projection matrix and the division model's coefficient, both in pixels: the undistorted pixel
/// centre + (m - centre) / (1 + lambda |m - centre|^2) is ~ projection (X; 1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DivisionCamera {
    /// Image size, px.
    pub width: u32,
    pub height: u32,
    /// To undistorted pixels, scaled so that its third row gives the depth (metres).
    pub projection: Matrix3x4<f64>,
    /// px^-2; negative is barrel distortion.
    pub lambda: f64,
    /// Centre of distortion, px: given, not estimated.
    pub centre: Vector2<f64>,
}

impl DivisionCamera {
    pub(crate) fn new(
        set: &Correspondences,
        centre: Vector2<f64>,
        projection: Matrix3x4<f64>,
        lambda: f64,
    ) -> Result<Self> {
        let camera = Self { width: set.width(), height: set.height(), projection, lambda, centre };
        camera.camera().map(|_| camera)
    }

    /// The set's points and shots.
    ///
    /// # Errors
    /// `InvalidArgument` for a set with lines, which the lens bends: the linear methods have no place
    /// for them.
    pub(crate) fn points(set: &Correspondences) -> Result<Vec<Measurement>> {
        let measurement = |(i, o)| match Measurement::new(o, 1.0, true) {
            Measurement::Line(_) => Err(Error::invalid("set", format!("measurement {i} is a line"))),
            point => Ok(point),
        };
        set.observations().iter().enumerate().map(measurement).collect()
    }

    /// The centre of distortion that a linear method works with.
    pub(crate) fn centre_for(set: &Correspondences, centre: Option<Vector2<f64>>) -> Result<Vector2<f64>> {
        let centre = centre.unwrap_or_else(|| image_centre(set.width(), set.height()));
        match centre.iter().position(|v| !v.is_finite()) {
            Some(index) => Err(Error::NotFinite { name: "centre", index }),
            None => Ok(centre),
        }
    }

    /// As a camera, whose distortion is centred at the principal point: the same camera when that is
    /// at `centre`, otherwise one to begin a refinement with.
    ///
    /// # Errors
    /// `Degenerate` when the matrix is no camera's.
    pub fn camera(&self) -> Result<Camera> {
        let (intrinsics, pose) = decompose(&self.projection)?;
        let distortion = Distortion::Division(self.lambda * intrinsics.fx * intrinsics.fy);
        Ok(Camera { width: self.width, height: self.height, intrinsics, distortion, pose })
    }
}

/// Middle of the image; pixel (0, 0) is the centre of the top-left pixel.
pub(crate) fn image_centre(width: u32, height: u32) -> Vector2<f64> {
    Vector2::new((f64::from(width) - 1.0) * 0.5, (f64::from(height) - 1.0) * 0.5)
}
