//! Views of boards
//!
//! A camera by itself is calibrated from views of a planar board with corners at known places, such
//! as a chessboard, held in different ways: three views or more, tilted by 20 to 40 degrees this way
//! and that, over the whole image, near and far. Corners may be missing, boards may differ. With the
//! laser on, the same views calibrate the laser's line (ptzcal_calibrate_laser_line). Views are
//! numbered from 0 in the order of adding.

use std::ffi::{CString, c_char};

use nalgebra::Vector2;

use super::args::{ArrayOut, Out, number, vectors, vectors_optional};
use super::calibrate::ptzcal_calibration;
use super::calibration_options::ptzcal_calibration_options;
use super::call::{ErrorOut, guard, guard_or};
use super::error::{c_string, ptzcal_error};
use super::handle::{Exclusive, Handle, HandleOut, borrow, free};
use super::rig_model::covariance2;
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::calibrate::boards::{BoardPose, BoardSpot};
use crate::calibrate::{BoardCalibration, BoardCorner, Boards, calibrate_from_boards};
use crate::error::Error;

/// Views of boards by one camera.
pub struct ptzcal_boards(pub(super) Exclusive<Boards>);

impl Handle for ptzcal_boards {
    const NAME: &'static str = "boards";
}

/// A camera calibrated from boards. Immutable: any number of threads may read it.
pub struct ptzcal_board_calibration {
    pub(super) result: BoardCalibration,
    advice: CString,
}

impl Handle for ptzcal_board_calibration {
    const NAME: &'static str = "calibration";
}

impl From<BoardCalibration> for ptzcal_board_calibration {
    fn from(result: BoardCalibration) -> Self {
        let advice = c_string(&result.advice.join("\n"));
        Self { result, advice }
    }
}

/// What was found about one view of a board.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_board_view {
    /// Set by ptzcal_board_view_init.
    pub struct_size: u32,
    /// 0 for a view that was set aside because most of its corners disagree with the other views: its
    /// pose is then the best that could be had, and its covariance 0.
    pub used: u32,
    /// Corners given.
    pub corners: u64,
    /// Corners used; the others are outliers.
    pub inliers: u64,
    /// Root mean square length of the used corners' residuals, pixels; of all corners of a view that
    /// was set aside.
    pub rms: f64,
    /// R, row-major: board axes to camera axes.
    pub rotation: [f64; 9],
    /// t: the board's origin in the camera frame, in the board's unit.
    pub translation: [f64; 3],
    /// 6 x 6, row-major: of w in R <- exp([w]x) R, a turn about the camera's axes (radians), then of
    /// the camera's centre in the board's frame (the board's unit).
    pub covariance: [f64; 36],
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_board_view {
    const NAME: &'static str = "view";
    const FIRST_SIZE: usize = 24 + 49 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            used: 0,
            corners: 0,
            inliers: 0,
            rms: 0.0,
            rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            translation: [0.0; 3],
            covariance: [0.0; 36],
        }
    }
}

impl From<&BoardPose> for ptzcal_board_view {
    fn from(view: &BoardPose) -> Self {
        let r = &view.pose.rotation;
        Self {
            struct_size: size_of::<Self>() as u32,
            used: u32::from(view.used),
            corners: view.corners as u64,
            inliers: view.inliers as u64,
            rms: view.rms,
            rotation: [r.m11, r.m12, r.m13, r.m21, r.m22, r.m23, r.m31, r.m32, r.m33],
            translation: view.pose.translation.into(),
            covariance: std::array::from_fn(|i| view.covariance[(i / 6, i % 6)]),
        }
    }
}

/// Makes an empty set of views for a camera with the given image size.
///
/// @param image_width  Pixels, 1 to 65536.
/// @param image_height Pixels, 1 to 65536.
/// @param boards       Receives the set; free it with ptzcal_boards_free.
/// @param error        Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_boards_new(
    image_width: u32,
    image_height: u32,
    boards: *mut *mut ptzcal_boards,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let boards = unsafe { HandleOut::new(boards)? };
        boards.give(ptzcal_boards(Exclusive::new(Boards::new(image_width, image_height)?)));
        Ok(())
    })
}

/// Frees a set of views. Calibrations made from it live on.
///
/// @param boards The set; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_boards_free(boards: *mut ptzcal_boards) {
    // SAFETY: NULL or a live set that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(boards) });
}

/// Adds the corners of a board that one image shows.
///
/// @param boards        The set.
/// @param board_xy      n x 2 numbers: places on the board, in any unit (metres for a laser line), the same
///                      for all boards; all boards must show the same side of their x and y axes.
/// @param uv            n x 2 numbers: their pixels; (0, 0) is the centre of the top-left pixel.
/// @param uv_covariance n x 3 numbers: xx, xy, yy of each pixel, positive definite, px^2; may be NULL: the
///                      common noise that the options state, or that the residuals show.
/// @param n             Number of corners, 4 or more.
/// @param error         Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NOT_FINITE (index: the
///         corner); PTZCAL_STATUS_DEGENERATE (all corners, or all but one, on one line);
///         PTZCAL_STATUS_INVALID_ARGUMENT for a covariance that is none; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_boards_add_view(
    boards: *mut ptzcal_boards,
    board_xy: *const f64,
    uv: *const f64,
    uv_covariance: *const f64,
    n: usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (boards, board_xy, uv, uv_covariance) = unsafe {
            (
                borrow(boards)?,
                vectors::<2>(board_xy, n, "board_xy")?,
                vectors::<2>(uv, n, "uv")?,
                vectors_optional::<3>(uv_covariance, n, "uv_covariance")?,
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
        boards.0.write(ptzcal_boards::NAME)?.add_view(&corners)?;
        Ok(())
    })
}

/// Sets where the laser's spot on the board of a view was seen; a later one replaces it.
///
/// @param boards        The set.
/// @param view          The view.
/// @param uv            2 numbers: the spot's pixel.
/// @param uv_covariance 3 numbers: xx, xy, yy, positive definite, px^2; may be NULL: the common noise of
///                      the corners.
/// @param error         Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (no such view, or a covariance that is none);
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_boards_set_spot(
    boards: *mut ptzcal_boards,
    view: u32,
    uv: *const f64,
    uv_covariance: *const f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (boards, uv, uv_covariance) = unsafe {
            (borrow(boards)?, vectors::<2>(uv, 1, "uv")?, vectors_optional::<3>(uv_covariance, 1, "uv_covariance")?)
        };
        let spot = BoardSpot {
            pixel: Vector2::from(uv[0]),
            pixel_covariance: uv_covariance.map(|c| covariance2(Some(&c[0]))),
        };
        boards.0.write(ptzcal_boards::NAME)?.set_spot(view as usize, spot)
    })
}

/// Lets the board be a smoothly bent sheet, z = b1 x^2 + b2 x y + b3 y^2 with x and y from the middle of
/// all corners, in units of the greatest distance from there. All views must then be of one board.
///
/// @param boards The set.
/// @param sigma  Prior standard deviation of each b, in the board's unit; 0, the default: boards are flat.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_boards_set_bending(
    boards: *mut ptzcal_boards,
    sigma: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let boards = unsafe { borrow(boards)? };
        boards.0.write(ptzcal_boards::NAME)?.set_bending(number(sigma, "sigma")?)
    })
}

/// How many views there are.
///
/// @param boards The set.
/// @param count  Receives the number.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_boards_count(
    boards: *const ptzcal_boards,
    count: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (boards, count) = unsafe { (borrow(boards)?, Out::new(count, "count")?) };
        count.write(boards.0.read(ptzcal_boards::NAME)?.views().len());
        Ok(())
    })
}

/// Calibrates a camera from views of boards. With a lens that the options keep
/// (ptzcal_calibration_options_set_lens) only the boards' poses are found. One view is enough when it is
/// tilted; the principal point is then expected near the image's centre.
///
/// @param boards  The views.
/// @param options The options; may be NULL: the defaults.
/// @param result  Receives the calibration; free it with ptzcal_board_calibration_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_DEGENERATE (parallel boards;
///         message and hint say what to add); PTZCAL_STATUS_NO_CONSENSUS;
///         PTZCAL_STATUS_INVALID_ARGUMENT (the message names a view that is mirrored or does not fit);
///         PTZCAL_STATUS_NO_CONVERGENCE; PTZCAL_STATUS_LENS_NOT_MONOTONE; PTZCAL_STATUS_CANCELLED;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibrate_from_boards(
    boards: *const ptzcal_boards,
    options: *const ptzcal_calibration_options,
    result: *mut *mut ptzcal_board_calibration,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (result, boards, options) =
            unsafe { (HandleOut::new(result)?, borrow(boards)?, ptzcal_calibration_options::settings(options)?) };
        let boards = boards.0.read(ptzcal_boards::NAME)?;
        result.give(calibrate_from_boards(&boards, &options)?.into());
        Ok(())
    })
}

/// Frees a calibration from boards. Strings taken from it die with it.
///
/// @param calibration The calibration; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_board_calibration_free(calibration: *mut ptzcal_board_calibration) {
    // SAFETY: NULL or a live calibration that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(calibration) });
}

/// The camera's calibration, as any other: intrinsics, lens and their covariance; its pose is the
/// identity. Its measurements are all corners, view after view.
///
/// @param calibration The calibration from boards.
/// @param camera      Receives a calibration of its own; free it with ptzcal_calibration_free.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_board_calibration_copy_camera(
    calibration: *const ptzcal_board_calibration,
    camera: *mut *mut ptzcal_calibration,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (camera, calibration) = unsafe { (HandleOut::new(camera)?, borrow(calibration)?) };
        camera.give(ptzcal_calibration::from(calibration.result.calibration.clone()));
        Ok(())
    })
}

/// How many views there are.
///
/// @param calibration The calibration from boards.
/// @param count       Receives the number.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_board_calibration_count(
    calibration: *const ptzcal_board_calibration,
    count: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibration, count) = unsafe { (borrow(calibration)?, Out::new(count, "count")?) };
        count.write(calibration.result.views.len());
        Ok(())
    })
}

/// Sets up a view: rotation 1, everything else 0.
///
/// @param view The struct.
/// @param size sizeof *view.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_board_view_init(view: *mut ptzcal_board_view, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(view, size) })
}

/// What was found about one view.
///
/// @param calibration The calibration from boards.
/// @param number      The view.
/// @param view        Receives it; set up by ptzcal_board_view_init.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a view that there is not.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_board_calibration_get_view(
    calibration: *const ptzcal_board_calibration,
    number: u32,
    view: *mut ptzcal_board_view,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibration, view) = unsafe { (borrow(calibration)?, SizedOut::new(view)?) };
        let views = &calibration.result.views;
        let found = views
            .get(number as usize)
            .ok_or_else(|| Error::invalid("number", format!("view {number} of {}", views.len())))?;
        view.write(&found.into());
        Ok(())
    })
}

/// How the boards bend: b1 b2 b3 of ptzcal_boards_set_bending; 0 for flat ones.
///
/// @param calibration The calibration from boards.
/// @param bending     Receives 3 numbers, in the board's unit.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_board_calibration_get_bending(
    calibration: *const ptzcal_board_calibration,
    bending: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibration, bending) = unsafe { (borrow(calibration)?, ArrayOut::new(bending, 3, "bending")?) };
        bending.write(calibration.result.bending.as_slice());
        Ok(())
    })
}

/// What to add to make the calibration better, lines of English UTF-8, the most needed first.
///
/// @param calibration The calibration from boards; may be NULL.
/// @return A string that lives as long as the calibration; "" when nothing is missing, and for NULL;
///         never NULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_board_calibration_advice(
    calibration: *const ptzcal_board_calibration,
) -> *const c_char {
    // SAFETY: NULL or a live calibration, as the header demands.
    unsafe { calibration.as_ref() }.map_or(c"".as_ptr(), |c| c.advice.as_ptr())
}
