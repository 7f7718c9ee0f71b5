//! Images
//!
//! Images are borrowed for the call: the library reads your memory where it is, keeps no pointer to
//! it, and never writes to it. All 8 bits per sample.

use std::ffi::c_void;

use super::call::{ErrorOut, guard};
use super::sized::{self, SizedStruct};
use super::status::ptzcal_status;
use crate::error::{Error, Result};
use crate::image::view::MAX_SIDE;
use crate::image::{ImageView, PixelFormat};

/// Layouts of pixels in memory: the values of ptzcal_image.format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ptzcal_pixel_format {
    /// One byte per pixel.
    Gray8 = 1,
    /// R, G, B.
    Rgb24 = 2,
    /// B, G, R.
    Bgr24 = 3,
    /// R, G, B, ignored.
    Rgba32 = 4,
    /// B, G, R, ignored.
    Bgra32 = 5,
    /// Y0 U Y1 V for two pixels; the width is even.
    Yuyv = 6,
    /// Plane 0: Y; plane 1: U, V interleaved, half the size in both directions, rounded up.
    Nv12 = 7,
    /// Plane 0: Y; plane 1: U; plane 2: V, both half the size in both directions, rounded up.
    I420 = 8,
}

/// An image in the caller's memory.
///
/// `plane[i]` points at the first byte of the top row. `stride[i]` is the distance in bytes from a
/// row to the next one below it: negative for an image stored bottom-up, at least a row's bytes in
/// size. `size[i]` is the number of bytes that may be read, counted from the plane's LOWEST address:
/// that is `plane[i]`, or the beginning of the bottom row when the stride is negative. Planes that
/// the format does not have are ignored.
///
/// A packed, top-down GRAY8 image:
/// `image.plane[0] = pixels; image.stride[0] = width; image.size[0] = width * height;`
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_image {
    /// Set by ptzcal_image_init.
    pub struct_size: u32,
    /// A ptzcal_pixel_format.
    pub format: u32,
    /// Pixels, 1 to 65536.
    pub width: u32,
    /// Pixels, 1 to 65536.
    pub height: u32,
    /// First byte of the top row of each plane.
    pub plane: [*const c_void; 4],
    /// Bytes from a row to the one below; negative = bottom-up.
    pub stride: [isize; 4],
    /// Readable bytes from the plane's lowest address.
    pub size: [usize; 4],
}

// SAFETY: numbers and raw pointers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_image {
    const NAME: &'static str = "image";
    const FIRST_SIZE: usize = size_of::<u32>() * 4 + size_of::<usize>() * 12;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            format: 0,
            width: 0,
            height: 0,
            plane: [std::ptr::null(); 4],
            stride: [0; 4],
            size: [0; 4],
        }
    }
}

/// The caller's image as a view.
///
/// # Safety
/// `image` is NULL or a struct as long as its `struct_size` says; each plane of its format has
/// `size` readable bytes that nobody writes to until `'a` ends.
pub(super) unsafe fn view<'a>(image: *const ptzcal_image) -> Result<ImageView<'a>> {
    // SAFETY: by this function's contract.
    let image = unsafe { sized::read(image)? };
    let format = PixelFormat::try_from(image.format)?;
    let sides = 1..=MAX_SIDE;
    if !sides.contains(&image.width) || !sides.contains(&image.height) {
        return Err(Error::invalid("image", format!("{} x {} pixels", image.width, image.height)));
    }
    let mut planes: [(&[u8], isize); 4] = [(&[], 0); 4];
    for (i, plane) in planes.iter_mut().enumerate().take(format.planes()) {
        let (first, stride, size) = (image.plane[i].cast::<u8>(), image.stride[i], image.size[i]);
        if first.is_null() {
            return Err(Error::NullPointer { name: "image plane" });
        }
        let overflow = || Error::invalid("image", format!("{} x {} with stride {stride}", image.width, image.height));
        let row = format.row_bytes(i, image.width).ok_or_else(overflow)?;
        let below = format.rows(i, image.height) - 1;
        let above_lowest = stride.unsigned_abs().checked_mul(below).ok_or_else(overflow)?;
        let needed = above_lowest.checked_add(row).filter(|n| *n <= isize::MAX as usize).ok_or_else(overflow)?;
        if size < needed {
            return Err(Error::BufferTooSmall { needed, capacity: size });
        }
        let lowest = if stride < 0 { first.wrapping_sub(above_lowest) } else { first };
        // SAFETY: `needed` <= `size` bytes are readable from the lowest address, by contract.
        *plane = (unsafe { std::slice::from_raw_parts(lowest, needed) }, stride);
    }
    ImageView::new(format, image.width, image.height, &planes[..format.planes()])
}

/// The caller's images, all of them.
///
/// # Safety
/// `images` is NULL or has `n` pointers, each as for [`view`].
pub(super) unsafe fn views<'a>(
    images: *const *const ptzcal_image,
    n: usize,
    name: &'static str,
) -> Result<Vec<ImageView<'a>>> {
    // SAFETY: by this function's contract; pointers are plain.
    let images = unsafe { super::args::array(images.cast::<*const c_void>(), n, name)? };
    // SAFETY: by this function's contract.
    images.iter().map(|image| unsafe { view(image.cast()) }).collect()
}

/// Frames that [`with_views`] takes without an allocation.
const FEW: usize = 8;

/// As [`views`], for a function that looks at them.
///
/// # Safety
/// As [`views`].
pub(super) unsafe fn with_views<R>(
    images: *const *const ptzcal_image,
    n: usize,
    name: &'static str,
    look: impl FnOnce(&[ImageView<'_>]) -> Result<R>,
) -> Result<R> {
    if n == 0 || n > FEW {
        // SAFETY: by this function's contract.
        return look(&unsafe { views(images, n, name)? });
    }
    // SAFETY: by this function's contract; pointers are plain.
    let images = unsafe { super::args::array(images.cast::<*const c_void>(), n, name)? };
    // SAFETY: by this function's contract.
    let at = |i: usize| unsafe { view(images[i].cast()) };
    let mut few = [at(0)?; FEW];
    for (i, slot) in few.iter_mut().enumerate().take(n).skip(1) {
        *slot = at(i)?;
    }
    look(&few[..n])
}

/// Sets up an image view: no planes, no format.
///
/// @param image The struct.
/// @param size  sizeof *image.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_image_init(image: *mut ptzcal_image, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(image, size) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Status;

    fn gray(data: &[u8], width: u32, height: u32, stride: isize) -> ptzcal_image {
        let mut image = ptzcal_image::initial();
        (image.format, image.width, image.height) = (ptzcal_pixel_format::Gray8 as u32, width, height);
        (image.plane[0], image.stride[0], image.size[0]) = (data.as_ptr().cast(), stride, data.len());
        image
    }

    fn status(image: &ptzcal_image) -> Status {
        // SAFETY: the images below describe their memory truly, or are refused.
        unsafe { view(image) }.map_or_else(|e| e.status(), |_| Status::Ok)
    }

    #[test]
    fn bottom_up_images_begin_at_their_last_row_in_memory() {
        let data = [1u8, 2, 0, 3, 4, 0, 5, 6];
        let mut image = gray(&data, 2, 3, -3);
        image.plane[0] = data[6..].as_ptr().cast();
        // SAFETY: rows at 6, 3 and 0 of eight bytes.
        let view = unsafe { view(&image) }.unwrap();
        assert_eq!([view.row(0, 0), view.row(0, 1), view.row(0, 2)], [[5, 6], [3, 4], [1, 2]]);
    }

    #[test]
    fn what_would_read_outside_is_refused() {
        let data = [0u8; 12];
        assert_eq!(status(&gray(&data, 4, 3, 4)), Status::Ok);
        assert_eq!(status(&gray(&data, 4, 4, 4)), Status::BufferTooSmall);
        assert_eq!(status(&gray(&data, 4, 3, 3)), Status::InvalidArgument);
        assert_eq!(status(&gray(&data, 4, 3, 0)), Status::InvalidArgument);
        assert_eq!(status(&gray(&data, 4, 3, isize::MIN)), Status::InvalidArgument);
        assert_eq!(status(&gray(&data, 4, 2, isize::MAX)), Status::InvalidArgument);
        assert_eq!(status(&gray(&data, 0, 3, 4)), Status::InvalidArgument);
        assert_eq!(status(&gray(&data, u32::MAX, u32::MAX, isize::MAX)), Status::InvalidArgument);
        let mut image = gray(&data, 4, 3, 4);
        image.format = 9;
        assert_eq!(status(&image), Status::InvalidArgument);
        image = gray(&data, 4, 3, 4);
        image.plane[0] = std::ptr::null();
        assert_eq!(status(&image), Status::NullPointer);
        // The chroma planes of I420 count too.
        image = gray(&data, 2, 2, 2);
        image.format = ptzcal_pixel_format::I420 as u32;
        assert_eq!(status(&image), Status::NullPointer);
    }

    #[test]
    fn formats_are_the_crates() {
        for (ours, crates) in [
            (ptzcal_pixel_format::Gray8, PixelFormat::Gray8),
            (ptzcal_pixel_format::Rgb24, PixelFormat::Rgb24),
            (ptzcal_pixel_format::Bgr24, PixelFormat::Bgr24),
            (ptzcal_pixel_format::Rgba32, PixelFormat::Rgba32),
            (ptzcal_pixel_format::Bgra32, PixelFormat::Bgra32),
            (ptzcal_pixel_format::Yuyv, PixelFormat::Yuyv),
            (ptzcal_pixel_format::Nv12, PixelFormat::Nv12),
            (ptzcal_pixel_format::I420, PixelFormat::I420),
        ] {
            assert_eq!(ours as u32, crates as u32);
        }
    }
}
