//! Images without lens distortion
//!
//! Draws what an ideal camera, without a lens, would see from the place of a calibrated one: straight
//! lines are straight in its pictures. It may look elsewhere and have another size and focal length,
//! so that a part of a fixed camera's picture can be turned and zoomed as a pan-tilt-zoom camera's. The
//! positions are made once; then each image takes little more than its memory does.

use super::args::{ArrayOut, array, number};
use super::call::{ErrorOut, guard, guard_or};
use super::camera::{camera_in, ptzcal_camera};
use super::error::ptzcal_error;
use super::handle::{Handle, HandleOut, borrow, free};
use super::image::{ptzcal_image, view};
use super::sized::SizedOut;
use super::status::ptzcal_status;
use crate::error::{Error, Result};
use crate::image::area::Region;
use crate::image::{ImageView, PlaneViewMut, Undistorter, undistorted_camera};

/// Takes the lens distortion out of a camera's images. Immutable: any number of threads may use it.
pub struct ptzcal_undistorter(Undistorter);

impl Handle for ptzcal_undistorter {
    const NAME: &'static str = "undistorter";
}

/// The ideal camera that shows what a camera sees: at its place, of its size, its rotation and its
/// ratio of focal lengths, without lens and skew. Change its rotation, focal lengths, principal point or
/// size for another view.
///
/// @param camera The calibrated camera.
/// @param keep   How much of the image's border is kept, as the alpha of OpenCV's
///               getOptimalNewCameraMatrix. 0: the largest view whose pixels are all inside the image; 1: the
///               smallest that holds all pixels of the image, with empty margins; between them something
///               between.
/// @param ideal  Receives the ideal camera; set up by ptzcal_camera_init.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for an image of fewer than 2 pixels on a side
///         and for a lens that sees 180 degrees or more, unless keep is 0 and a part of its image's border
///         is less far out; PTZCAL_STATUS_LENS_NOT_MONOTONE where the lens model folds back inside the
///         image; PTZCAL_STATUS_NOT_FINITE.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_camera_undistorted(
    camera: *const ptzcal_camera,
    keep: f64,
    ideal: *mut ptzcal_camera,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (camera, ideal) = unsafe { (camera_in(camera)?, SizedOut::new(ideal)?) };
        ideal.write(&ptzcal_camera::from(&undistorted_camera(&camera, number(keep, "keep")?)?));
        Ok(())
    })
}

/// Makes an undistorter. Both cameras look from the same place: of the ideal camera's pose only the
/// rotation counts, its translation becomes the one that goes with the camera's centre.
///
/// @param camera      The calibrated camera, of any lens model.
/// @param ideal       The ideal camera, as ptzcal_camera_undistorted gives it or any other without a lens;
///                    2^26 pixels at most.
/// @param undistorter Receives the undistorter; free it with ptzcal_undistorter_free.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT, also for an ideal camera with a lens;
///         PTZCAL_STATUS_NOT_FINITE.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_undistorter_new(
    camera: *const ptzcal_camera,
    ideal: *const ptzcal_camera,
    undistorter: *mut *mut ptzcal_undistorter,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (undistorter, camera, ideal) =
            unsafe { (HandleOut::new(undistorter)?, camera_in(camera)?, camera_in(ideal)?) };
        undistorter.give(ptzcal_undistorter(Undistorter::new(&camera, &ideal)?));
        Ok(())
    })
}

/// Frees an undistorter.
///
/// @param undistorter The undistorter; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_undistorter_free(undistorter: *mut ptzcal_undistorter) {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard_or((), || unsafe { free(undistorter) })
}

/// The ideal camera, whose pictures an undistorter draws: with it points are projected into them and
/// pixels of them back into the world (ptzcal_camera_project, ptzcal_camera_back_project).
///
/// @param undistorter The undistorter.
/// @param camera      Receives the ideal camera; set up by ptzcal_camera_init.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_undistorter_get_camera(
    undistorter: *const ptzcal_undistorter,
    camera: *mut ptzcal_camera,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (undistorter, camera) = unsafe { (borrow(undistorter)?, SizedOut::new(camera)?) };
        camera.write(&undistorter.0.camera().into());
        Ok(())
    })
}

/// Draws the ideal camera's picture. Pixels outside the image are black (all bytes 0).
///
/// @param undistorter The undistorter.
/// @param image       The calibrated camera's image, of its size: GRAY8, RGB24, BGR24, RGBA32 or BGRA32. Of
///                    NV12 and I420 the Y plane alone is a GRAY8 image.
/// @param pixels      Receives n bytes: the picture, in the image's format. Not the image's memory. What is
///                    between the rows stays as it is.
/// @param n           Number of bytes; for a picture of height h at least |stride| (h - 1) and a row's bytes.
/// @param stride      Bytes from a row to the one below; negative = bottom-up: the bottom row is the first in
///                    memory.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for an image of another size than the
///         camera's; PTZCAL_STATUS_UNSUPPORTED for other formats; PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_undistorter_apply(
    undistorter: *const ptzcal_undistorter,
    image: *const ptzcal_image,
    pixels: *mut u8,
    n: usize,
    stride: isize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            let undistorter = borrow(undistorter)?;
            let [width, height] = [undistorter.0.camera().width, undistorter.0.camera().height];
            let region = Region { x: 0, y: 0, width, height };
            apply(undistorter, image, region, [0; 4], pixels, n, stride)
        }
    })
}

/// Draws a part of the ideal camera's picture: a tile that is shown, or a thread's share of the rows.
///
/// @param undistorter The undistorter.
/// @param image       As for ptzcal_undistorter_apply.
/// @param x           First column.
/// @param y           First row.
/// @param width       Columns, at least 1; the region is inside the ideal camera's picture.
/// @param height      Rows, at least 1.
/// @param border      4 bytes: the value of pixels outside the image, of which as many count as a pixel of its
///                    format has; may be NULL: 0.
/// @param pixels      Receives n bytes: the region's pixels, as for ptzcal_undistorter_apply.
/// @param n           Number of bytes.
/// @param stride      As for ptzcal_undistorter_apply.
/// @param error       Receives the error; may be NULL.
/// @return As for ptzcal_undistorter_apply; PTZCAL_STATUS_INVALID_ARGUMENT also for a region that is not
///         inside the picture.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_undistorter_apply_region(
    undistorter: *const ptzcal_undistorter,
    image: *const ptzcal_image,
    x: u32,
    y: u32,
    width: u32,
    height: u32,
    border: *const u8,
    pixels: *mut u8,
    n: usize,
    stride: isize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            let undistorter = borrow(undistorter)?;
            let border = if border.is_null() { [0; 4] } else { array(border.cast::<[u8; 4]>(), 1, "border")?[0] };
            apply(undistorter, image, Region { x, y, width, height }, border, pixels, n, stride)
        }
    })
}

/// # Safety
/// `image` as for [`view`]; `n` bytes at `pixels` are writable until the call ends.
unsafe fn apply(
    undistorter: &ptzcal_undistorter,
    image: *const ptzcal_image,
    region: Region,
    border: [u8; 4],
    pixels: *mut u8,
    n: usize,
    stride: isize,
) -> Result<()> {
    // SAFETY: by this function's contract.
    let image = unsafe {
        ArrayOut::new(pixels, n, "pixels")?;
        view(image)?
    };
    undistorter.0.check_region(&region)?;
    if overlaps(&image, pixels.addr(), n) {
        return Err(Error::invalid("pixels", "the picture cannot be drawn into the image that it is made of"));
    }
    let row = image.format().row_bytes(0, region.width).unwrap_or(usize::MAX);
    let memory = match n {
        0 => &mut [],
        // SAFETY: `n` bytes are writable, by contract, and the image, all else that is borrowed, is elsewhere.
        _ => unsafe { std::slice::from_raw_parts_mut(pixels, n) },
    };
    let mut out = PlaneViewMut::new(memory, stride, row, region.height as usize)?;
    undistorter.0.apply(&image, &region, border, &mut out)
}

/// Does the image have bytes among the `n` ones from `start` on?
fn overlaps(image: &ImageView, start: usize, n: usize) -> bool {
    let format = image.format();
    (0..format.planes()).any(|plane| {
        let mut rows = [0, format.rows(plane, image.height()) - 1].map(|y| image.row(plane, y).as_ptr_range());
        rows.sort_by_key(|r| r.start);
        rows[0].start.addr() < start.saturating_add(n) && start < rows[1].end.addr()
    })
}
