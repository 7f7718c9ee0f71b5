//! A camera prepared for drawing: the ray of each pixel, and what lies in its view.

use nalgebra::{Vector2, Vector3};

use crate::error::{Error, Result};
use crate::geometry::{Camera, Distortion};

/// Most pixels of a depth map: 8K video has fewer.
pub const MAX_PIXELS: u64 = 1 << 25;

/// A camera with the direction of every pixel.
pub struct Lens<'a> {
    pub camera: &'a Camera,
    pub width: usize,
    pub height: usize,
    /// x and y in the camera's frame at z = 1, row by row; NaN where the lens has no ray in front.
    directions: Vec<[f64; 2]>,
    /// Squared radius on the normalised plane up to which the lens grows.
    radius2: f64,
    /// Cosine of the greatest angle to the axis that a pixel sees.
    cos_limit: f64,
    /// Less than the angle of half a pixel, radians.
    pub fine: f64,
}

impl<'a> Lens<'a> {
    /// Checks the camera; `rays`: with the pixels' directions.
    pub fn new(camera: &'a Camera, rays: bool) -> Result<Self> {
        camera.validate()?;
        if u64::from(camera.width) * u64::from(camera.height) > MAX_PIXELS {
            let reason = format!("{} x {} pixels, {MAX_PIXELS} are the most", camera.width, camera.height);
            return Err(Error::invalid("camera", reason));
        }
        let [width, height] = [camera.width as usize, camera.height as usize];
        let radius2 = match camera.distortion {
            // Its image() knows its end.
            Distortion::Fisheye(_) => f64::INFINITY,
            lens => lens.monotone_radius().powi(2),
        };
        let f = camera.intrinsics.fx.max(camera.intrinsics.fy);
        let mut lens = Self { camera, width, height, directions: Vec::new(), radius2, cos_limit: -1.0, fine: 0.5 / f };
        if rays {
            let pixels = (0..height).flat_map(|y| (0..width).map(move |x| Vector2::new(x as f64, y as f64)));
            let directions = pixels.map(|pixel| lens.compute(&pixel).map_or([f64::NAN; 2], |d| [d.x, d.y])).collect();
            lens.directions = directions;
            lens.cos_limit = lens.border_cosine();
        }
        Ok(lens)
    }

    fn compute(&self, pixel: &Vector2<f64>) -> Option<Vector2<f64>> {
        let p = self.camera.undistort_pixel(pixel)?;
        (p.norm_squared() <= self.radius2).then_some(p)
    }

    fn is_fisheye(&self) -> bool {
        matches!(self.camera.distortion, Distortion::Fisheye(_))
    }

    /// The ray of a pixel, in the camera's frame, at z = 1.
    pub fn direction(&self, pixel: usize) -> Option<Vector3<f64>> {
        let [x, y] = *self.directions.get(pixel)?;
        (!x.is_nan()).then(|| Vector3::new(x, y, 1.0))
    }

    /// Of the pixels on the border, which see furthest from the axis. Where one has no ray the lens
    /// ends inside the image, and everything may be in view.
    fn border_cosine(&self) -> f64 {
        let (w, h) = (self.width, self.height);
        let border = (0..w).flat_map(|x| [x, (h - 1) * w + x]).chain((0..h).flat_map(|y| [y * w, y * w + w - 1]));
        let cosine = border.map(|pixel| self.direction(pixel).map_or(-1.0, |d| 1.0 / d.norm())).fold(1.0, f64::min);
        // The outer half of the border's pixels, and rounding.
        let wider = cosine.clamp(-1.0, 1.0).acos() + 4.0 * self.fine + 1e-6;
        if cosine <= 0.0 || wider >= std::f64::consts::PI { -1.0 } else { wider.cos() }
    }

    /// Pixel of a point in the camera's frame; `None` where the lens has no image of it.
    pub fn pixel(&self, x: &Vector3<f64>) -> Option<Vector2<f64>> {
        if x.z <= 0.0 && !self.is_fisheye() || x.xy().norm_squared() > self.radius2 * x.z * x.z {
            return None;
        }
        self.camera.project_camera_point(x)
    }

    /// Is a sphere certainly out of view?
    pub fn misses(&self, centre: &Vector3<f64>, radius: f64) -> bool {
        let distance = centre.norm();
        if distance <= radius || self.cos_limit <= -1.0 {
            return false;
        }
        let angle = (centre.z / distance).clamp(-1.0, 1.0).acos();
        angle - (radius / distance).asin() > self.cos_limit.acos()
    }
}
