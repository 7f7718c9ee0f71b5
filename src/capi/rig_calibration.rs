//! Calibrating a rig from pictures
//!
//! The whole way from pictures of a chessboard to a rig: the board held in different ways 1 to 5 m
//! away, tilted by 20 to 40 degrees this way and that, near and far; of each place one picture with
//! the laser off and one with it on; for one zoom position, or for several. Views in which nothing is
//! found keep the reason and cost nothing else; a zoom position that stays open costs none of the
//! others. Without pictures with the laser on, the lens alone is calibrated. Views are numbered from 0
//! in the order of adding.

use nalgebra::Vector2;

use super::args::{Out, number, vectors, vectors_optional};
use super::calibration_options::ptzcal_calibration_options;
use super::call::{ErrorOut, guard, guard_or};
use super::detect::ptzcal_spot_options;
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, free};
use super::image::{ptzcal_image, view};
use super::rig_calibrated::ptzcal_rig_calibrated;
use super::rig_model::covariance2;
use super::status::ptzcal_status;
use crate::calibrate::{BoardCorner, BoardSpot};
use crate::error::{Error, Result};
use crate::rig_calibration::{ChessboardSpec, RigCalibration, RigCalibrationOptions};

/// Views of chessboards by the camera of a rig.
pub struct ptzcal_rig_calibration(Exclusive<RigCalibration>);

impl Handle for ptzcal_rig_calibration {
    const NAME: &'static str = "calibration";
}

/// A view's number.
fn number32(view: usize) -> Result<u32> {
    u32::try_from(view).map_err(|_| Error::invalid("view", "too many views"))
}

/// Makes an empty set of views. The options are copied.
///
/// @param columns     Inner corners in a row of the board, 3 to 128.
/// @param rows        Inner corners in a column, 3 to 128. With one even and one odd number boards cannot be
///                    mistaken for turned ones.
/// @param square      Side of a square, metres.
/// @param options     Lens model and how it is fitted, without a fixed lens; may be NULL: the defaults.
/// @param spot        The search for the spot, which is looked for on the board only; may be NULL: the
///                    defaults.
/// @param calibration Receives the set; free it with ptzcal_rig_calibration_free.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (a board that cannot be, a fixed lens, options
///         out of range); PTZCAL_STATUS_NOT_FINITE.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibration_new(
    columns: u32,
    rows: u32,
    square: f64,
    options: *const ptzcal_calibration_options,
    spot: *const ptzcal_spot_options,
    calibration: *mut *mut ptzcal_rig_calibration,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, options, spot) = unsafe {
            (
                HandleOut::new(calibration)?,
                ptzcal_calibration_options::settings(options)?,
                ptzcal_spot_options::settings(spot)?,
            )
        };
        let board = ChessboardSpec { columns, rows, square: number(square, "square")? };
        let options = RigCalibrationOptions { calibration: options, spot, ..RigCalibrationOptions::default() };
        out.give(ptzcal_rig_calibration(Exclusive::new(RigCalibration::new(board, options)?)));
        Ok(())
    })
}

/// Frees a set of views. What was calibrated from it lives on.
///
/// @param calibration The set; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibration_free(calibration: *mut ptzcal_rig_calibration) {
    // SAFETY: NULL or a live set that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(calibration) });
}

/// The board of the views that are added from now on: near, or at a long focal length, a smaller one
/// fits into the image.
///
/// @param calibration The set.
/// @param columns     Inner corners in a row, 3 to 128.
/// @param rows        Inner corners in a column, 3 to 128.
/// @param square      Side of a square, metres.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibration_set_board(
    calibration: *mut ptzcal_rig_calibration,
    columns: u32,
    rows: u32,
    square: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let calibration = unsafe { borrow(calibration)? };
        let board = ChessboardSpec { columns, rows, square: number(square, "square")? };
        calibration.0.write(ptzcal_rig_calibration::NAME)?.set_board(board)
    })
}

/// Whether the zoom positions share one laser line. They do by default: the laser is fixed to the
/// camera, and zooming moves the camera's centre along its axis only. The data are asked: where they
/// contradict it, every position keeps its own line.
///
/// @param calibration The set.
/// @param share       0: every position keeps its own line; else they share one.
/// @param pupil_sigma How far the camera's centre moves with the zoom: a standard deviation in metres; 0.05 by
///                    default.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (negative); PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibration_set_common_line(
    calibration: *mut ptzcal_rig_calibration,
    share: i32,
    pupil_sigma: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let calibration = unsafe { borrow(calibration)? };
        let pupil = number(pupil_sigma, "pupil_sigma")?;
        calibration.0.write(ptzcal_rig_calibration::NAME)?.set_common_line(share != 0, pupil)
    })
}

/// Adds a picture of the board with the laser off and one with it on, the head at rest. That nothing
/// is found in them is no error: the view keeps the reason (ptzcal_rig_calibrated_view_reason).
///
/// @param calibration The set.
/// @param zoom        The device's own number of the zoom position, in any unit that grows or falls with
///                    the focal length; views of one position have the same number.
/// @param off         With the laser off.
/// @param on          The same with the laser on; may be NULL: this view is for the lens only.
/// @param view        Receives the view's number; may be NULL.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (a malformed image, or one of another size than
///         those before); PTZCAL_STATUS_BUFFER_TOO_SMALL (a plane's size cannot hold the image);
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibration_add_images(
    calibration: *mut ptzcal_rig_calibration,
    zoom: f64,
    off: *const ptzcal_image,
    on: *const ptzcal_image,
    view: *mut u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibration, off, on, out) = unsafe {
            (
                borrow(calibration)?,
                self::view(off)?,
                if on.is_null() { None } else { Some(self::view(on)?) },
                if view.is_null() { None } else { Some(Out::new(view, "view")?) },
            )
        };
        let zoom = number(zoom, "zoom")?;
        let view = calibration.0.write(ptzcal_rig_calibration::NAME)?.add_images(zoom, &off, on.as_ref())?;
        let view = number32(view)?;
        if let Some(out) = out {
            out.write(view);
        }
        Ok(())
    })
}

/// Adds corners that were found elsewhere.
///
/// @param calibration   The set.
/// @param zoom          As for ptzcal_rig_calibration_add_images.
/// @param image_width   Pixels; the same for all views.
/// @param image_height  Pixels; the same for all views.
/// @param board_xy      n x 2 numbers: places on the board, metres.
/// @param uv            n x 2 numbers: their pixels.
/// @param uv_covariance n x 3 numbers: xx, xy, yy of each pixel, positive definite, px^2; may be NULL: the
///                      common noise that the options state, or that the residuals show.
/// @param n             Number of corners, 4 or more.
/// @param view          Receives the view's number; may be NULL.
/// @param error         Receives the error; may be NULL.
/// @return What ptzcal_boards_add_view returns; PTZCAL_STATUS_INVALID_ARGUMENT also for an image of another
///         size than those before.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibration_add_corners(
    calibration: *mut ptzcal_rig_calibration,
    zoom: f64,
    image_width: u32,
    image_height: u32,
    board_xy: *const f64,
    uv: *const f64,
    uv_covariance: *const f64,
    n: usize,
    view: *mut u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibration, board_xy, uv, uv_covariance, out) = unsafe {
            (
                borrow(calibration)?,
                vectors::<2>(board_xy, n, "board_xy")?,
                vectors::<2>(uv, n, "uv")?,
                vectors_optional::<3>(uv_covariance, n, "uv_covariance")?,
                if view.is_null() { None } else { Some(Out::new(view, "view")?) },
            )
        };
        let corners: Vec<BoardCorner> = board_xy
            .iter()
            .zip(uv)
            .enumerate()
            .map(|(i, (board, pixel))| BoardCorner {
                board: Vector2::from(*board),
                pixel: Vector2::from(*pixel),
                pixel_covariance: uv_covariance.map(|c| covariance2(Some(&c[i]))),
            })
            .collect();
        let (zoom, size) = (number(zoom, "zoom")?, [image_width, image_height]);
        let view = calibration.0.write(ptzcal_rig_calibration::NAME)?.add_corners(zoom, size, &corners)?;
        let view = number32(view)?;
        if let Some(out) = out {
            out.write(view);
        }
        Ok(())
    })
}

/// Sets where the laser's spot on the board of a view was seen; replaces what was found.
///
/// @param calibration   The set.
/// @param view          The view; a board was found in it.
/// @param uv            2 numbers: the spot's pixel.
/// @param uv_covariance 3 numbers: xx, xy, yy, positive definite, px^2; may be NULL: the common noise of
///                      the corners.
/// @param error         Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (no such view, no board in it, a covariance
///         that is none); PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibration_set_spot(
    calibration: *mut ptzcal_rig_calibration,
    view: u32,
    uv: *const f64,
    uv_covariance: *const f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibration, uv, uv_covariance) = unsafe {
            (
                borrow(calibration)?,
                vectors::<2>(uv, 1, "uv")?,
                vectors_optional::<3>(uv_covariance, 1, "uv_covariance")?,
            )
        };
        let spot = BoardSpot {
            pixel: Vector2::from(uv[0]),
            pixel_covariance: uv_covariance.map(|c| covariance2(Some(&c[0]))),
        };
        calibration.0.write(ptzcal_rig_calibration::NAME)?.set_spot(view as usize, spot)
    })
}

/// Calibrates every zoom position: lens, laser line and all board poses by maximum likelihood
/// together, then one laser line for all positions. What fails at a position is said there
/// (ptzcal_rig_calibrated_get_position).
///
/// @param calibration The set.
/// @param calibrated  Receives the answer; free it with ptzcal_rig_calibrated_free.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS (no views); PTZCAL_STATUS_CANCELLED (the options'
///         token); PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_calibration_solve(
    calibration: *const ptzcal_rig_calibration,
    calibrated: *mut *mut ptzcal_rig_calibrated,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, calibration) = unsafe { (HandleOut::new(calibrated)?, borrow(calibration)?) };
        let answer = calibration.0.read(ptzcal_rig_calibration::NAME)?.solve()?;
        out.give(answer.into());
        Ok(())
    })
}
