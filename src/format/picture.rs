//! Pictures: photographs as PNG, JPEG or PNM, depth maps as 16-bit PNG or PGM.

use std::io::Cursor;
use std::path::Path;

use image::{ColorType, DynamicImage, ImageFormat, ImageReader, Limits};

use super::file::{format_error, read_bounded, write_atomically};
use crate::error::{Error, Result};
use crate::image::view::MAX_SIDE;
use crate::image::{DepthMap, Image, ImageView, PixelFormat};

const MAX_BYTES: u64 = 1 << 30;
/// Memory that a decoded picture may take: 100 megapixels of 16-bit colour.
const MAX_DECODED: u64 = 1 << 30;

/// Reads a photograph: GRAY8 or, of what has colours, RGB24. 16 bits per sample are cut to 8, an
/// alpha channel is dropped.
pub fn read_picture(path: &Path) -> Result<Image> {
    decode(path).map(to_image)
}

/// GRAY8 or, of what has colours, RGB24.
pub(crate) fn to_image(picture: DynamicImage) -> Image {
    let (width, height) = (picture.width(), picture.height());
    let (format, data) = if picture.color().has_color() {
        (PixelFormat::Rgb24, picture.into_rgb8().into_raw())
    } else {
        (PixelFormat::Gray8, picture.into_luma8().into_raw())
    };
    Image { format, width, height, data }
}

/// Reads a depth map: one channel of 16 bits, `metres` per unit; 0 is no depth.
pub fn read_depth(path: &Path, metres: f64) -> Result<DepthMap> {
    if !(metres.is_finite() && metres > 0.0) {
        return Err(Error::invalid("metres", format!("{metres} per unit")));
    }
    let picture = decode(path)?;
    let DynamicImage::ImageLuma16(depth) = picture else {
        let reason = format!("a depth map has one channel of 16 bits, this has {:?}", picture.color());
        return Err(format_error(&path.display().to_string(), reason));
    };
    let (width, height) = depth.dimensions();
    DepthMap::new(width, height, depth.into_raw().iter().map(|z| (f64::from(*z) * metres) as f32).collect())
}

/// Writes a depth map as 16-bit PNG, `metres` per unit; 0 is no depth.
///
/// # Errors
/// `InvalidArgument` for units in which a depth is less than half of one, or more than 65535.
pub fn write_depth(path: &Path, map: &DepthMap, metres: f64) -> Result<()> {
    if !(metres.is_finite() && metres > 0.0) {
        return Err(Error::invalid("metres", format!("{metres} per unit")));
    }
    let unit = |z: &f32| {
        let units = (f64::from(*z) / metres).round();
        let fits = *z == 0.0 || (1.0..=65_535.0).contains(&units);
        if fits { Ok(units as u16) } else { Err(Error::invalid("metres", format!("{z} m are {units} units"))) }
    };
    let units = map.metres().iter().map(unit).collect::<Result<Vec<u16>>>()?;
    let [width, height] = [map.width() as u32, map.height() as u32];
    let internal = |reason: String| Error::Internal { reason: format!("PNG: {reason}") };
    let picture: image::ImageBuffer<image::Luma<u16>, _> =
        image::ImageBuffer::from_raw(width, height, units).ok_or_else(|| internal("sizes differ".into()))?;
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, ImageFormat::Png).map_err(|e| internal(e.to_string()))?;
    write_atomically(path, &bytes.into_inner())
}

fn decode(path: &Path) -> Result<DynamicImage> {
    let bytes = read_bounded(path, MAX_BYTES)?;
    let wrong = |reason: String| format_error(&path.display().to_string(), reason);
    // By what it holds, not by its name.
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| wrong(e.to_string()))?;
    match reader.format() {
        Some(ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Pnm) => {}
        _ => return Err(wrong("neither PNG nor JPEG nor PNM".into())),
    }
    reader.limits(limits(MAX_DECODED));
    reader.decode().map_err(|e| wrong(e.to_string()))
}

/// No sides longer than images have, and no more memory than `max_alloc` bytes.
pub(crate) fn limits(max_alloc: u64) -> Limits {
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(max_alloc);
    limits
}

/// A PNG or JPEG inside another file, GRAY8 or RGB24; `name`: of that file; `most`: bytes of memory.
pub(super) fn decode_bytes(bytes: &[u8], name: &str, most: u64) -> Result<Image> {
    let wrong = |e: image::ImageError| format_error(name, format!("a picture: {e}"));
    let mut reader = ImageReader::new(Cursor::new(bytes));
    reader.set_format(match image::guess_format(bytes).map_err(wrong)? {
        format @ (ImageFormat::Png | ImageFormat::Jpeg) => format,
        other => return Err(format_error(name, format!("a picture is {other:?}"))),
    });
    reader.limits(limits(most.min(MAX_DECODED)));
    reader.decode().map(to_image).map_err(wrong)
}

/// Writes a picture as PNG.
pub fn write_png(path: &Path, view: &ImageView<'_>) -> Result<()> {
    write_atomically(path, &encode_png(view)?)
}

/// A picture as the bytes of a PNG.
pub(super) fn encode_png(view: &ImageView<'_>) -> Result<Vec<u8>> {
    encode(view, ImageFormat::Png)
}

/// A picture as the bytes of a JPEG: for looking at.
pub fn encode_jpeg(view: &ImageView<'_>) -> Result<Vec<u8>> {
    encode(view, ImageFormat::Jpeg)
}

fn encode(view: &ImageView<'_>, format: ImageFormat) -> Result<Vec<u8>> {
    let (width, height) = (view.width(), view.height());
    let (data, colour) = if view.format().has_colour() {
        let pixels = (0..height).flat_map(|y| (0..width).flat_map(move |x| view.rgb(x, y)));
        (pixels.collect::<Vec<u8>>(), ColorType::Rgb8)
    } else {
        (view.to_image().data, ColorType::L8)
    };
    let mut bytes = Cursor::new(Vec::new());
    image::write_buffer_with_format(&mut bytes, &data, width, height, colour, format)
        .map_err(|e| Error::Internal { reason: format!("{format:?}: {e}") })?;
    Ok(bytes.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Status;

    fn folder() -> tempfile::TempDir {
        tempfile::tempdir().unwrap()
    }

    #[test]
    fn what_is_written_is_read() {
        let folder = folder();
        let path = folder.path().join("picture.png");
        let mut grey = Image::new(PixelFormat::Gray8, 5, 3);
        grey.data.iter_mut().enumerate().for_each(|(i, v)| *v = 16 * i as u8);
        write_png(&path, &grey.view().unwrap()).unwrap();
        assert_eq!(read_picture(&path).unwrap(), grey);
        let bgr = Image { format: PixelFormat::Bgr24, width: 1, height: 2, data: vec![1, 2, 3, 4, 5, 6] };
        write_png(&path, &bgr.view().unwrap()).unwrap();
        let back = read_picture(&path).unwrap();
        assert_eq!((back.format, back.data), (PixelFormat::Rgb24, vec![3, 2, 1, 6, 5, 4]));
    }

    #[test]
    fn depths_are_scaled_and_zero_is_none() {
        let folder = folder();
        let path = folder.path().join("depth.pgm");
        std::fs::write(&path, b"P5\n3 1\n65535\n\x00\x00\x07\xd0\xff\xff").unwrap();
        let depth = read_depth(&path, 0.001).unwrap();
        assert_eq!((depth.at(0, 0), depth.at(1, 0)), (None, Some(2.0)));
        assert_eq!(read_depth(&path, f64::NAN).unwrap_err().status(), Status::InvalidArgument);
        let copy = folder.path().join("depth.png");
        write_depth(&copy, &depth, 0.001).unwrap();
        assert_eq!(read_depth(&copy, 0.001).unwrap(), depth);
        for metres in [0.0, f64::NAN, 1e-4, 10.0] {
            assert_eq!(write_depth(&copy, &depth, metres).unwrap_err().status(), Status::InvalidArgument, "{metres}");
        }
        let image = Image::new(PixelFormat::Rgb24, 2, 2);
        write_png(&path, &image.view().unwrap()).unwrap();
        assert!(read_depth(&path, 0.001).unwrap_err().to_string().contains("16 bits"));
    }

    #[test]
    fn damaged_and_foreign_files_are_refused() {
        let folder = folder();
        let path = folder.path().join("picture");
        assert_eq!(read_picture(&path).unwrap_err().status(), Status::FileIo);
        let mut png = std::io::Cursor::new(Vec::new());
        image::write_buffer_with_format(&mut png, &[0; 64], 8, 8, ColorType::L8, ImageFormat::Png).unwrap();
        let png = png.into_inner();
        // A header that claims 60000 x 60000 pixels.
        let huge = b"P5\n60000 60000\n255\nabc";
        for bytes in [&png[..40], &huge[..], b"GIF89a......", b"", b"P5\n-1 4\n255\n"] {
            std::fs::write(&path, bytes).unwrap();
            assert_eq!(read_picture(&path).unwrap_err().status(), Status::FileFormat, "{bytes:?}");
        }
    }
}
