//! The laser's line
//!
//! Where the laser stands beside its camera and where it points, from views of boards with the laser
//! on (ptzcal_boards, places on the boards in metres): boards at all distances of the work, near ones
//! above all. Each spot is where the laser's line meets its board; line, poses and lens are adjusted
//! together. The result is a rig model that is ready for use, and a covariance of all that depths
//! depend on.

use super::args::BufferOut;
use super::boards::{ptzcal_board_calibration, ptzcal_boards};
use super::calibrate::ptzcal_calibration;
use super::calibration_options::ptzcal_calibration_options;
use super::call::{ErrorOut, guard, guard_or};
use super::error::ptzcal_error;
use super::handle::{Handle, HandleOut, borrow, borrow_optional, free};
use super::rig_model::ptzcal_rig_model;
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::calibrate::{LaserCalibration, calibrate_laser_line};

/// A calibrated laser line. Immutable: any number of threads may read it.
pub struct ptzcal_laser_calibration(LaserCalibration);

impl Handle for ptzcal_laser_calibration {
    const NAME: &'static str = "laser";
}

impl From<LaserCalibration> for ptzcal_laser_calibration {
    fn from(laser: LaserCalibration) -> Self {
        Self(laser)
    }
}

/// A laser's line in its camera's frame: points (x0 + vx Z, y0 + vy Z, Z).
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_laser_line {
    /// Set by ptzcal_laser_line_init.
    pub struct_size: u32,
    /// Spots used.
    pub spots: u32,
    /// Metres.
    pub x0: f64,
    /// Metres.
    pub y0: f64,
    /// Slope, metres per metre of depth.
    pub vx: f64,
    /// Slope, metres per metre of depth.
    pub vy: f64,
    /// Root mean square length of the used spots' residuals, pixels.
    pub rms: f64,
    /// 7 x 7, row-major: of x0, y0 (metres), vx, vy (slopes), the logarithm of the common scale of fx
    /// and fy, cx, cy (pixels). The first four rows and columns are the line's own; those of a lens
    /// that was not free are 0.
    pub covariance: [f64; 49],
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_laser_line {
    const NAME: &'static str = "line";
    const FIRST_SIZE: usize = 8 + 54 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            spots: 0,
            x0: 0.0,
            y0: 0.0,
            vx: 0.0,
            vy: 0.0,
            rms: 0.0,
            covariance: [0.0; 49],
        }
    }
}

impl From<&LaserCalibration> for ptzcal_laser_line {
    fn from(laser: &LaserCalibration) -> Self {
        let (line, covariance) = (&laser.line, laser.rig_covariance());
        Self {
            struct_size: size_of::<Self>() as u32,
            spots: u32::try_from(laser.used.iter().filter(|u| **u).count()).unwrap_or(u32::MAX),
            x0: line.x0,
            y0: line.y0,
            vx: line.vx,
            vy: line.vy,
            rms: laser.rms,
            covariance: std::array::from_fn(|i| covariance[(i / 7, i % 7)]),
        }
    }
}

/// Calibrates the laser's line. The lens comes from the same corners; or it is known exactly
/// (ptzcal_calibration_options_set_lens); or it was measured before, from other images, and its
/// covariance is believed. Spots that disagree with most others are set aside.
///
/// @param boards  The views, with the spots of two or more.
/// @param lens    The lens that was measured before; may be NULL. A calibration from these same views would
///                count them twice.
/// @param options The options; may be NULL: the defaults.
/// @param laser   Receives the result; free it with ptzcal_laser_calibration_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; what ptzcal_calibrate_from_boards returns; PTZCAL_STATUS_TOO_FEW_POINTS
///         (fewer than two spots); PTZCAL_STATUS_DEGENERATE (boards at one distance, a laser along a board,
///         spots that do not move: the message says which); PTZCAL_STATUS_NO_CONSENSUS;
///         PTZCAL_STATUS_INVALID_ARGUMENT (a baseline below 1 mm, or a lens in both places).
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibrate_laser_line(
    boards: *const ptzcal_boards,
    lens: *const ptzcal_calibration,
    options: *const ptzcal_calibration_options,
    laser: *mut *mut ptzcal_laser_calibration,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (laser, boards, lens, options) = unsafe {
            (
                HandleOut::new(laser)?,
                borrow(boards)?,
                borrow_optional(lens),
                ptzcal_calibration_options::settings(options)?,
            )
        };
        let boards = boards.0.read(ptzcal_boards::NAME)?;
        let found = calibrate_laser_line(&boards, lens.map(|l| &l.answer), &options)?;
        laser.give(ptzcal_laser_calibration(found));
        Ok(())
    })
}

/// Frees a laser calibration.
///
/// @param laser The laser calibration; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_laser_calibration_free(laser: *mut ptzcal_laser_calibration) {
    // SAFETY: NULL or a live laser calibration that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(laser) });
}

/// Sets up a line: everything 0.
///
/// @param line The struct.
/// @param size sizeof *line.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_laser_line_init(line: *mut ptzcal_laser_line, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(line, size) })
}

/// The laser's line and its covariance.
///
/// @param laser The laser calibration.
/// @param line  Receives the line; set up by ptzcal_laser_line_init.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_laser_calibration_get_line(
    laser: *const ptzcal_laser_calibration,
    line: *mut ptzcal_laser_line,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (laser, line) = unsafe { (borrow(laser)?, SizedOut::new(line)?) };
        line.write(&(&laser.0).into());
        Ok(())
    })
}

/// A rig with the lens and the laser that were found; axes through the camera's centre, true encoders.
///
/// @param laser The laser calibration.
/// @param model Receives the rig model; set up by ptzcal_rig_model_init.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_laser_calibration_get_rig_model(
    laser: *const ptzcal_laser_calibration,
    model: *mut ptzcal_rig_model,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (laser, model) = unsafe { (borrow(laser)?, SizedOut::new(model)?) };
        model.write(&(&laser.0.rig_model()).into());
        Ok(())
    })
}

/// Lens and poses as the joint adjustment left them.
///
/// @param laser  The laser calibration.
/// @param boards Receives a calibration of its own; free it with ptzcal_board_calibration_free.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_laser_calibration_copy_boards(
    laser: *const ptzcal_laser_calibration,
    boards: *mut *mut ptzcal_board_calibration,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (boards, laser) = unsafe { (HandleOut::new(boards)?, borrow(laser)?) };
        boards.give(laser.0.boards.clone().into());
        Ok(())
    })
}

/// Measured minus predicted pixel of the spot of every view, outliers included: n x 2 numbers, n the
/// number of views. Infinite where there is no spot, or none is predicted.
///
/// @param laser    The laser calibration.
/// @param buffer   Receives the numbers; may be NULL when capacity is 0.
/// @param capacity How many numbers the buffer holds.
/// @param needed   Receives how many there are, also when they do not fit; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_laser_calibration_copy_residuals(
    laser: *const ptzcal_laser_calibration,
    buffer: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (laser, buffer) = unsafe { (borrow(laser)?, BufferOut::new(buffer, capacity, needed)?) };
        let none = [f64::INFINITY; 2];
        let residuals: Vec<f64> = laser.0.residuals.iter().flat_map(|r| r.map_or(none, Into::into)).collect();
        buffer.write(&residuals)
    })
}

/// Which views' spots were used: n bytes, n the number of views; 1 for a spot that was used, 0 for an
/// outlier and where there is no spot.
///
/// @param laser    The laser calibration.
/// @param buffer   Receives the bytes; may be NULL when capacity is 0.
/// @param capacity How many bytes the buffer holds.
/// @param needed   Receives how many there are, also when they do not fit; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_laser_calibration_copy_inliers(
    laser: *const ptzcal_laser_calibration,
    buffer: *mut u8,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (laser, buffer) = unsafe { (borrow(laser)?, BufferOut::new(buffer, capacity, needed)?) };
        let used: Vec<u8> = laser.0.used.iter().map(|u| u8::from(*u)).collect();
        buffer.write(&used)
    })
}
