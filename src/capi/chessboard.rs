//! Detecting chessboards
//!
//! Finds the inner corners of a chessboard, where four squares meet, in one image. A board of c x r
//! inner corners has (c + 1) x (r + 1) squares. Every corner comes with its covariance, so that it can
//! be weighed in a calibration.
//!
//! The order: row by row. From column to column and then from row to row one turns clockwise as seen
//! in the image; a mirrored view is read as its mirror image. Of the orders that are left, those come
//! first whose first corner has a dark square diagonally outside; of several, the one whose first
//! corner has the least x + y. With one even and one odd number of corners the order is the board's
//! own, however the camera is turned. Otherwise a view turned by 180 degrees (90 on square boards)
//! looks the same.

use super::args::{ArrayOut, Out, number};
use super::call::{ErrorOut, guard};
use super::error::ptzcal_error;
use super::image::{ptzcal_image, view};
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::detect::chessboard::{ChessboardOptions, detect_chessboard};
use crate::error::{Error, Result};

/// Which chessboard is looked for.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_chessboard_options {
    /// Set by ptzcal_chessboard_options_init.
    pub struct_size: u32,
    /// Inner corners in a row, 3 to 128; 0, with rows 0 too: any size.
    pub columns: u32,
    /// Inner corners in a column, 3 to 128.
    pub rows: u32,
    /// 0.
    pub reserved: u32,
    /// Least share of the corners that must be found, 0 to 1; never fewer than 8 corners. Some corner of
    /// each outer row and column must be among them.
    pub min_found: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_chessboard_options {
    const NAME: &'static str = "options";
    const FIRST_SIZE: usize = 16 + 8;
    fn initial() -> Self {
        let min_found = ChessboardOptions::default().min_found;
        Self { struct_size: size_of::<Self>() as u32, columns: 0, rows: 0, reserved: 0, min_found }
    }
}

impl ptzcal_chessboard_options {
    /// The caller's options, or the defaults for NULL.
    ///
    /// # Safety
    /// `options` is NULL or a struct as long as its `struct_size` says.
    unsafe fn settings(options: *const Self) -> Result<ChessboardOptions> {
        if options.is_null() {
            return Ok(ChessboardOptions::default());
        }
        // SAFETY: by this function's contract.
        let options = unsafe { sized::read(options)? };
        let min_found = number(options.min_found, "min_found")?;
        let size = (options.columns != 0 || options.rows != 0).then_some([options.columns, options.rows]);
        Ok(ChessboardOptions { size, min_found })
    }
}

/// A chessboard found.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_chessboard {
    /// Set by ptzcal_chessboard_init.
    pub struct_size: u32,
    /// Inner corners in a row; of a board of unknown size the larger number.
    pub columns: u32,
    /// Inner corners in a column.
    pub rows: u32,
    /// Number of corners found, at most columns x rows.
    pub found: u32,
    /// Standard deviation of the image's blur at the corners, pixels.
    pub blur: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_chessboard {
    const NAME: &'static str = "board";
    const FIRST_SIZE: usize = 16 + 8;
    fn initial() -> Self {
        Self { struct_size: size_of::<Self>() as u32, columns: 0, rows: 0, found: 0, blur: 0.0 }
    }
}

/// Sets up options with their defaults: any size, half of the corners.
///
/// @param options The struct.
/// @param size    sizeof *options.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_chessboard_options_init(
    options: *mut ptzcal_chessboard_options,
    size: usize,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(options, size) })
}

/// Sets up a board: everything 0.
///
/// @param board The struct.
/// @param size  sizeof *board.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_chessboard_init(board: *mut ptzcal_chessboard, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(board, size) })
}

/// Finds a chessboard in an image.
///
/// Corners that are hidden, outside the image or unlike a corner are left out: their entry of `found`
/// is 0, and so are their other numbers.
///
/// @param image      The image; of colours their luma is used.
/// @param options    The options; may be NULL: any size.
/// @param board      Receives what was found; set up by ptzcal_chessboard_init.
/// @param corners    Receives columns x rows x 2 numbers: pixels x, y; (0, 0) is the centre of the
///                   top-left pixel.
/// @param covariance Receives columns x rows x 3 numbers: xx, xy, yy, px^2, from the image's noise;
///                   may be NULL.
/// @param found      Receives columns x rows numbers: 1 where the corner was found, else 0.
/// @param capacity   Number of corners that the arrays hold; 16384 is always enough.
/// @param needed     Receives columns x rows, also when the capacity is too small; may be NULL.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND; PTZCAL_STATUS_AMBIGUOUS for two whole boards
///         whose squares look alike large (of others the one with the larger squares is taken);
///         PTZCAL_STATUS_BUFFER_TOO_SMALL for the capacity, or when a plane's size cannot hold the
///         image; PTZCAL_STATUS_INVALID_ARGUMENT for impossible sizes, a malformed image and one that is
///         too small for the board; PTZCAL_STATUS_NOT_FINITE.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_detect_chessboard(
    image: *const ptzcal_image,
    options: *const ptzcal_chessboard_options,
    board: *mut ptzcal_chessboard,
    corners: *mut f64,
    covariance: *mut f64,
    found: *mut u8,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (image, options, board, corners, covariance, found, needed) = unsafe {
            (
                view(image)?,
                ptzcal_chessboard_options::settings(options)?,
                SizedOut::new(board)?,
                ArrayOut::vectors::<2>(corners, capacity, "corners")?,
                ArrayOut::vectors_optional::<3>(covariance, capacity, "covariance")?,
                ArrayOut::new(found, capacity, "found")?,
                Out::optional(needed, "needed")?,
            )
        };
        let seen = detect_chessboard(&image, &options)?;
        let count = seen.corners.len();
        if let Some(needed) = needed {
            needed.write(count);
        }
        if count > capacity {
            return Err(Error::BufferTooSmall { needed: count, capacity });
        }
        let all = || seen.corners.iter();
        corners.write(&all().map(|c| c.map_or([0.0; 2], |c| [c.x, c.y])).collect::<Vec<_>>());
        if let Some(covariance) = covariance {
            covariance.write(&all().map(|c| c.map_or([0.0; 3], |c| c.covariance)).collect::<Vec<_>>());
        }
        found.write(&all().map(|c| c.is_some().into()).collect::<Vec<u8>>());
        board.write(&ptzcal_chessboard {
            struct_size: size_of::<ptzcal_chessboard>() as u32,
            columns: seen.columns as u32,
            rows: seen.rows as u32,
            found: seen.found() as u32,
            blur: seen.blur,
        });
        Ok(())
    })
}
