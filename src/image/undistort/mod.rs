//! Pictures without lens distortion: what an ideal camera, without a lens, would see from the place of
//! a calibrated one. The ideal camera may look elsewhere and have another size and focal length, so
//! that a part of a fixed camera's picture can be turned and zoomed as a pan-tilt-zoom camera's.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod ideal;
mod map;
mod remap;
#[cfg(test)]
mod tests;

pub use ideal::undistorted_camera;

use self::map::Cell;
use self::remap::{Source, draw};
use super::area::Region;
use super::pixel_format::PixelFormat;
use super::view::{ImageView, PlaneViewMut};
use crate::error::{Error, Result};
use crate::geometry::{Camera, Distortion, Rigid};

/// Most pixels of an ideal picture: twice those of 8K video.
pub const MAX_PIXELS: u64 = 1 << 26;

/// Takes the lens distortion out of a camera's images. Made once; it does not change, and many threads may
/// use it together.
///
/// The positions in the image are those of [`Camera::project`] to within 1/64 pixel, and the values
/// between its pixels are interpolated bilinearly.
#[derive(Debug, Clone)]
pub struct Undistorter {
    source: [u32; 2],
    ideal: Camera,
    bands: Vec<Vec<Cell>>,
}

impl Undistorter {
    /// From the calibrated camera and the ideal one, which has no lens. Both look from the same place:
    /// of the ideal camera's pose only the rotation counts, and its translation becomes the one that
    /// goes with the camera's centre.
    ///
    /// # Errors
    /// `InvalidArgument` and `NotFinite` for cameras that are none ([`Camera::validate`]), an ideal one
    /// with a lens, or with more than [`MAX_PIXELS`].
    pub fn new(camera: &Camera, ideal: &Camera) -> Result<Self> {
        camera.validate()?;
        ideal.validate()?;
        if ideal.distortion != Distortion::None {
            return Err(Error::invalid("ideal", "an ideal camera has no lens distortion"));
        }
        if u64::from(ideal.width) * u64::from(ideal.height) > MAX_PIXELS {
            let reason = format!("{} x {} pixels, {MAX_PIXELS} are the most", ideal.width, ideal.height);
            return Err(Error::invalid("ideal", reason));
        }
        let pose = Rigid::from_centre(ideal.pose.rotation, &camera.centre());
        let ideal = Camera { pose, ..*ideal };
        Ok(Self { source: [camera.width, camera.height], ideal, bands: map::bands(camera, &ideal) })
    }

    /// The ideal camera: what [`apply`](Self::apply) makes is its picture.
    pub fn camera(&self) -> &Camera {
        &self.ideal
    }

    /// Refuses a region that is empty or not inside the ideal camera's picture.
    pub fn check_region(&self, region: &Region) -> Result<()> {
        let Region { x, y, width, height } = *region;
        let within =
            |start: u32, length: u32, side: u32| length > 0 && u64::from(start) + u64::from(length) <= u64::from(side);
        if within(x, width, self.ideal.width) && within(y, height, self.ideal.height) {
            return Ok(());
        }
        let [w, h] = [self.ideal.width, self.ideal.height];
        Err(Error::invalid("region", format!("{region:?} is not inside the {w} x {h} picture")))
    }

    /// Draws a region of the ideal camera's picture.
    ///
    /// `image` is the calibrated camera's, `out` has the region's size and the image's format. Pixels
    /// beyond the image's border have the value of `border` (as many bytes of it as the format's pixels
    /// have); within a pixel of the border the two are blended. A fourth byte is interpolated as the
    /// others are.
    ///
    /// # Errors
    /// `InvalidArgument` for an image of another size than the camera's, a region that is empty or not
    /// inside the ideal picture, or an `out` of another size; `Unsupported` for YUV formats.
    pub fn apply(&self, image: &ImageView, region: &Region, border: [u8; 4], out: &mut PlaneViewMut) -> Result<()> {
        self.apply_with(image, region, border, true, out)
    }

    /// As [`apply`](Self::apply), also without vectors, to compare the two.
    fn apply_with(
        &self,
        image: &ImageView,
        region: &Region,
        border: [u8; 4],
        vectors: bool,
        out: &mut PlaneViewMut,
    ) -> Result<()> {
        let size = [image.width(), image.height()];
        if size != self.source {
            let [[w, h], [width, height]] = [size, self.source];
            return Err(Error::invalid("image", format!("{w} x {h} pixels, the camera's have {width} x {height}")));
        }
        self.check_region(region)?;
        let Region { width, height, .. } = *region;
        use PixelFormat::{Bgr24, Bgra32, Gray8, Rgb24, Rgba32};
        let format = image.format();
        let plane = match (format, image.plane(0)) {
            (Gray8 | Rgb24 | Bgr24 | Rgba32 | Bgra32, Some(plane)) => plane,
            _ => {
                let what = format!("undistorting {format:?} images: convert them, or give their Y plane as Gray8");
                return Err(Error::Unsupported { what });
            }
        };
        if format.row_bytes(0, width) != Some(out.row_bytes()) || out.rows() != height as usize {
            let reason = format!("rows of {} bytes, {} of them, for {region:?}", out.row_bytes(), out.rows());
            return Err(Error::invalid("out", reason));
        }
        let [width, height] = size;
        let [b0, b1, b2, _] = border;
        match format {
            Gray8 => draw(&self.bands, &Source::new(plane, width, height, [b0]), region, vectors, out),
            Rgb24 | Bgr24 => draw(&self.bands, &Source::new(plane, width, height, [b0, b1, b2]), region, vectors, out),
            _ => draw(&self.bands, &Source::new(plane, width, height, border), region, vectors, out),
        }
        Ok(())
    }
}
