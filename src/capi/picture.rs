//! Pictures
//!
//! Photographs from files, and pictures of what was found: an image with marks on it, written as PNG.
//! Colours are 0xRRGGBB. Marks outside the picture, or at places that are not finite, are left out.

use std::ffi::{c_char, c_void};
use std::path::Path;

use super::args::{array, number, string, vectors};
use super::call::{ErrorOut, guard, guard_or};
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, free};
use super::image::{ptzcal_image, view};
use super::sized::{SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::draw::{self, Canvas, Colour};
use crate::error::{Error, Result};
use crate::format::{read_picture, write_png};

const WHAT: &str = "picture";

/// A picture in the library's memory.
pub struct ptzcal_picture(Exclusive<Canvas>);

impl Handle for ptzcal_picture {
    const NAME: &'static str = "picture";
}

impl From<Canvas> for ptzcal_picture {
    fn from(canvas: Canvas) -> Self {
        Self(Exclusive::new(canvas))
    }
}

/// Reads a photograph: PNG, JPEG or PNM, told by what it holds; 16 bits per sample are cut to 8.
///
/// @param path    The file.
/// @param picture Receives the picture; free it with ptzcal_picture_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_picture_read(
    path: *const c_char,
    picture: *mut *mut ptzcal_picture,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (picture, path) = unsafe { (HandleOut::new(picture)?, string(path, "path")?) };
        picture.give(Canvas::from_image(read_picture(Path::new(path))?)?.into());
        Ok(())
    })
}

/// Copies an image, to draw on it.
///
/// @param image   The image.
/// @param picture Receives the picture; free it with ptzcal_picture_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a malformed image;
///         PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_picture_new(
    image: *const ptzcal_image,
    picture: *mut *mut ptzcal_picture,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (picture, image) = unsafe { (HandleOut::new(picture)?, view(image)?) };
        picture.give(Canvas::new(&image).into());
        Ok(())
    })
}

/// Copies two images side by side, to draw what matches in them.
///
/// @param left    The left one.
/// @param right   The right one; it begins at x = the left one's width.
/// @param picture Receives the picture; free it with ptzcal_picture_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a malformed image, and for two that are
///         together wider than 65536 pixels; PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_picture_beside(
    left: *const ptzcal_image,
    right: *const ptzcal_image,
    picture: *mut *mut ptzcal_picture,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (picture, left, right) = unsafe { (HandleOut::new(picture)?, view(left)?, view(right)?) };
        picture.give(Canvas::beside(&left, &right)?.into());
        Ok(())
    })
}

/// Frees a picture.
///
/// @param picture The picture; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_picture_free(picture: *mut ptzcal_picture) {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard_or((), || unsafe { free(picture) })
}

/// The picture's pixels, for every function that takes an image. They stay where they are until the
/// picture is freed; drawing changes them.
///
/// @param picture The picture.
/// @param image   Receives the view; set up by ptzcal_image_init.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY while another thread draws.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_picture_image(
    picture: *const ptzcal_picture,
    image: *mut ptzcal_image,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (picture, image) = unsafe { (borrow(picture)?, SizedOut::new(image)?) };
        let canvas = picture.0.read(WHAT)?;
        let pixels = canvas.image();
        let mut seen = ptzcal_image::initial();
        (seen.format, seen.width, seen.height) = (pixels.format as u32, pixels.width, pixels.height);
        seen.plane[0] = pixels.data.as_ptr().cast::<c_void>();
        seen.stride[0] = (pixels.data.len() / pixels.height.max(1) as usize) as isize;
        seen.size[0] = pixels.data.len();
        image.write(&seen);
        Ok(())
    })
}

/// Writes a picture as PNG, at once or not at all.
///
/// @param picture The picture.
/// @param path    The file.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_picture_save(
    picture: *const ptzcal_picture,
    path: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (picture, path) = unsafe { (borrow(picture)?, string(path, "path")?) };
        write_png(Path::new(path), &picture.0.read(WHAT)?.view()?)
    })
}

/// Darkens a picture, so that marks stand out.
///
/// @param picture The picture.
/// @param light   What is left of its light, 0 to 1.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_picture_dim(
    picture: *mut ptzcal_picture,
    light: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let picture = unsafe { borrow(picture)? };
        let light = number(light, "light")?;
        if !(0.0..=1.0).contains(&light) {
            return Err(Error::invalid("light", format!("{light} is no part")));
        }
        picture.0.write(WHAT)?.dim(light);
        Ok(())
    })
}

fn colour(rgb: u32) -> Result<Colour> {
    let [high, red, green, blue] = rgb.to_be_bytes();
    if high == 0 {
        Ok([red, green, blue])
    } else {
        Err(Error::invalid("colour", format!("{rgb:#x} is above 0xffffff")))
    }
}

/// A length that is drawn, pixels.
fn length(value: f64, name: &'static str) -> Result<f64> {
    let value = number(value, name)?;
    if value > 0.0 { Ok(value) } else { Err(Error::invalid(name, format!("{value} is not positive"))) }
}

/// Draws lines.
///
/// @param picture The picture.
/// @param ends    n x 4 numbers: x, y of the one end and of the other, pixels.
/// @param n       Number of lines.
/// @param width   Width of the lines, pixels.
/// @param colour  0xRRGGBB.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_picture_draw_lines(
    picture: *mut ptzcal_picture,
    ends: *const f64,
    n: usize,
    width: f64,
    colour: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (picture, ends) = unsafe { (borrow(picture)?, vectors::<4>(ends, n, "ends")?) };
        let (width, colour) = (length(width, "width")?, self::colour(colour)?);
        let mut canvas = picture.0.write(WHAT)?;
        for [x0, y0, x1, y1] in ends {
            canvas.line([*x0, *y0].into(), [*x1, *y1].into(), width, colour);
        }
        Ok(())
    })
}

/// Draws circles.
///
/// @param picture The picture.
/// @param centres n x 2 numbers, pixels.
/// @param n       Number of circles.
/// @param radius  Radius, pixels.
/// @param width   Width of the line, pixels.
/// @param colour  0xRRGGBB.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_picture_draw_circles(
    picture: *mut ptzcal_picture,
    centres: *const f64,
    n: usize,
    radius: f64,
    width: f64,
    colour: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (picture, centres) = unsafe { (borrow(picture)?, vectors::<2>(centres, n, "centres")?) };
        let (radius, width, colour) = (length(radius, "radius")?, length(width, "width")?, self::colour(colour)?);
        let mut canvas = picture.0.write(WHAT)?;
        for centre in centres {
            canvas.circle((*centre).into(), radius, width, colour);
        }
        Ok(())
    })
}

/// Draws a chessboard's corners, as ptzcal_detect_chessboard gives them: each row in a colour, joined in
/// order, a ring around the first.
///
/// @param picture The picture.
/// @param corners columns x rows x 2 numbers, pixels.
/// @param found   columns x rows numbers: 0 where there is no corner; may be NULL: all are there.
/// @param columns Corners in a row.
/// @param rows    Corners in a column.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_picture_draw_board(
    picture: *mut ptzcal_picture,
    corners: *const f64,
    found: *const u8,
    columns: usize,
    rows: usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let sizes = || Error::invalid("columns", format!("{columns} x {rows} corners"));
        let n = columns.checked_mul(rows).ok_or_else(sizes)?;
        // SAFETY: the caller keeps the header's rules for pointers.
        let (picture, corners, found) = unsafe {
            (
                borrow(picture)?,
                vectors::<2>(corners, n, "corners")?,
                if found.is_null() { None } else { Some(array(found, n, "found")?) },
            )
        };
        let there = |i: usize| found.is_none_or(|f| f[i] != 0);
        let corners: Vec<_> = corners.iter().enumerate().map(|(i, c)| there(i).then(|| (*c).into())).collect();
        draw::board(&mut *picture.0.write(WHAT)?, &corners, columns);
        Ok(())
    })
}

/// Draws residuals as arrows from where each point was seen; outliers are red rings.
///
/// @param picture   The picture.
/// @param uv        n x 2 numbers: where the points were seen, pixels.
/// @param residuals n x 2 numbers, pixels; they may be infinite: those are left out.
/// @param inliers   n numbers: 0 for outliers; may be NULL: there are none.
/// @param n         Number of points.
/// @param scale     How much longer than the residuals the arrows are.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_picture_draw_residuals(
    picture: *mut ptzcal_picture,
    uv: *const f64,
    residuals: *const f64,
    inliers: *const u8,
    n: usize,
    scale: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (picture, uv, residuals, inliers) = unsafe {
            (
                borrow(picture)?,
                vectors::<2>(uv, n, "uv")?,
                array(residuals.cast::<[f64; 2]>(), n, "residuals")?,
                if inliers.is_null() { None } else { Some(array(inliers, n, "inliers")?) },
            )
        };
        let scale = length(scale, "scale")?;
        let seen: Vec<_> = uv.iter().map(|p| (*p).into()).collect();
        let residuals: Vec<_> = residuals.iter().map(|r| (*r).into()).collect();
        draw::residuals(&mut *picture.0.write(WHAT)?, &seen, &residuals, &kept(inliers, n), scale);
        Ok(())
    })
}

/// Draws pairs of points of two pictures that stand side by side (ptzcal_picture_beside): kept ones are
/// joined by a line, the others are red rings.
///
/// @param picture The picture.
/// @param left    n x 2 numbers, pixels of the left picture.
/// @param right   n x 2 numbers, pixels of the right picture.
/// @param kept    n numbers: 0 for pairs that are not kept; may be NULL: all are.
/// @param n       Number of pairs.
/// @param offset  Width of the left picture, pixels.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_picture_draw_matches(
    picture: *mut ptzcal_picture,
    left: *const f64,
    right: *const f64,
    kept: *const u8,
    n: usize,
    offset: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (picture, left, right, kept) = unsafe {
            (
                borrow(picture)?,
                vectors::<2>(left, n, "left")?,
                vectors::<2>(right, n, "right")?,
                if kept.is_null() { None } else { Some(array(kept, n, "kept")?) },
            )
        };
        let offset = number(offset, "offset")?;
        let points = |p: &[[f64; 2]]| p.iter().map(|p| (*p).into()).collect::<Vec<_>>();
        draw::matches(&mut *picture.0.write(WHAT)?, &points(left), &points(right), &self::kept(kept, n), offset);
        Ok(())
    })
}

/// Flags, all of them set for none.
fn kept(flags: Option<&[u8]>, n: usize) -> Vec<bool> {
    flags.map_or_else(|| vec![true; n], |f| f.iter().map(|v| *v != 0).collect())
}
