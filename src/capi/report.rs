//! Reports
//!
//! One HTML file that says what was measured and how good it is: cameras with their measurements,
//! residuals and uncertainties, scans with what was missed and why, surveys with their stations. It needs
//! no other file and no network, and prints as it looks. The same input makes the same bytes.

use std::ffi::c_char;

use super::adjusted::ptzcal_adjusted;
use super::args::{BufferOut, array, string, vectors};
use super::boards::{ptzcal_board_calibration, ptzcal_boards};
use super::calibrate::ptzcal_calibration;
use super::call::{ErrorOut, guard, guard_or};
use super::correspondences::ptzcal_correspondences;
use super::error::ptzcal_error;
use super::file::path as path_in;
use super::handle::{Exclusive, Handle, HandleOut, borrow, borrow_optional, free};
use super::image::{ptzcal_image, view};
use super::scan::ptzcal_scan;
use super::status::ptzcal_status;
use crate::report::Report;

/// A report that grows.
pub struct ptzcal_report(Exclusive<Report>);

impl Handle for ptzcal_report {
    const NAME: &'static str = "report";
}

/// Begins a report.
///
/// @param title  Its title, UTF-8.
/// @param report Receives the report; free it with ptzcal_report_free.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for text that is no UTF-8.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_report_new(
    title: *const c_char,
    report: *mut *mut ptzcal_report,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (report, title) = unsafe { (HandleOut::new(report)?, string(title, "title")?) };
        report.give(ptzcal_report(Exclusive::new(Report::new(title)?)));
        Ok(())
    })
}

/// Frees a report.
///
/// @param report The report; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_report_free(report: *mut ptzcal_report) {
    // SAFETY: NULL or a live report that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(report) });
}

/// Says which way is up in the world, for the view from above; without it -y, as in a rig's frame.
///
/// @param report The report.
/// @param up     3 numbers, of any length but zero.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT for a vector without
///         a length; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_report_set_up(
    report: *mut ptzcal_report,
    up: *const f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (report, up) = unsafe { (borrow(report)?, vectors::<3>(up, 1, "up")?) };
        report.0.write(ptzcal_report::NAME)?.set_up(&up[0].into())
    })
}

/// Adds a paragraph of the host's own: who measured, when, where, with what.
///
/// @param report The report.
/// @param note   The paragraph, UTF-8; it is shown as it is.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for text that is no UTF-8; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_report_add_note(
    report: *mut ptzcal_report,
    note: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (report, note) = unsafe { (borrow(report)?, string(note, "note")?) };
        report.0.write(ptzcal_report::NAME)?.add_note(note)
    })
}

/// Adds a calibrated camera: parameters with standard deviations, warnings in words, and drawings of its
/// measurements and residuals, of depths, and of how far off a click may be.
///
/// @param report      The report.
/// @param name        The camera's name, UTF-8.
/// @param calibration The calibration.
/// @param set         What it was calibrated from; may be NULL: then the drawings are left out.
/// @param picture     A picture of the camera's, of its size, drawn beneath the measurements; may be
///                    NULL.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a set of another calibration, a picture of
///         another size, and a report beyond 256 MB; PTZCAL_STATUS_BUFFER_TOO_SMALL for the picture;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_report_add_calibration(
    report: *mut ptzcal_report,
    name: *const c_char,
    calibration: *const ptzcal_calibration,
    set: *const ptzcal_correspondences,
    picture: *const ptzcal_image,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (report, name, calibration, set) =
            unsafe { (borrow(report)?, string(name, "name")?, borrow(calibration)?, borrow_optional(set)) };
        // SAFETY: the caller keeps the header's rules for pointers.
        let picture = if picture.is_null() { None } else { Some(unsafe { view(picture)? }) };
        let set = set.map(|set| set.0.read(ptzcal_correspondences::NAME)).transpose()?;
        let mut report = report.0.write(ptzcal_report::NAME)?;
        report.add_calibration(name, &calibration.answer, set.as_deref(), picture.as_ref())
    })
}

/// Adds a camera calibrated from boards: parameters with standard deviations, warnings in words, drawings
/// of its corners and residuals, every view, and what to add to make it better.
///
/// @param report      The report.
/// @param name        The camera's name, UTF-8.
/// @param calibration The calibration.
/// @param boards      What it was calibrated from.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for boards of another calibration and a report
///         beyond 256 MB; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_report_add_board_calibration(
    report: *mut ptzcal_report,
    name: *const c_char,
    calibration: *const ptzcal_board_calibration,
    boards: *const ptzcal_boards,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (report, name, calibration, boards) =
            unsafe { (borrow(report)?, string(name, "name")?, borrow(calibration)?, borrow(boards)?) };
        let boards = boards.0.read(ptzcal_boards::NAME)?;
        report.0.write(ptzcal_report::NAME)?.add_board_calibration(name, &calibration.result, &boards)
    })
}

/// Adds a scan: positions, who saw each spot and why not, depths.
///
/// @param report The report.
/// @param name   The scan's name, UTF-8.
/// @param scan   The scan.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_report_add_scan(
    report: *mut ptzcal_report,
    name: *const c_char,
    scan: *const ptzcal_scan,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (report, name, scan) = unsafe { (borrow(report)?, string(name, "name")?, borrow(scan)?) };
        report.0.write(ptzcal_report::NAME)?.add_scan(name, &scan.0)
    })
}

/// Adds a survey: rig, stations, planes, and each of its cameras as a section.
///
/// @param report   The report.
/// @param name     The survey's name, UTF-8.
/// @param adjusted The survey, solved.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_report_add_adjusted(
    report: *mut ptzcal_report,
    name: *const c_char,
    adjusted: *const ptzcal_adjusted,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (report, name, adjusted) = unsafe { (borrow(report)?, string(name, "name")?, borrow(adjusted)?) };
        report.0.write(ptzcal_report::NAME)?.add_survey(name, &adjusted.adjusted)
    })
}

/// Names something that the result was made from by its SHA-256, such as the bytes of a journal or of a
/// rig's file. What is added above is named without being asked.
///
/// @param report The report.
/// @param name   Its name, UTF-8.
/// @param bytes  n bytes; may be NULL when n is 0.
/// @param n      Number of bytes.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_report_add_input(
    report: *mut ptzcal_report,
    name: *const c_char,
    bytes: *const u8,
    n: usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (report, name, bytes) = unsafe { (borrow(report)?, string(name, "name")?, array(bytes, n, "bytes")?) };
        report.0.write(ptzcal_report::NAME)?.add_input(name, bytes)
    })
}

/// The report as HTML: UTF-8 without a NUL.
///
/// @param report   The report.
/// @param buffer   Receives the text; may be NULL when capacity is 0.
/// @param capacity Bytes of the buffer.
/// @param needed   Receives the number of bytes; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: needed says the size; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_report_copy_html(
    report: *const ptzcal_report,
    buffer: *mut c_char,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (report, out) = unsafe { (borrow(report)?, BufferOut::new(buffer.cast::<u8>(), capacity, needed)?) };
        let html = report.0.read(ptzcal_report::NAME)?.to_html();
        out.write(html.as_bytes())
    })
}

/// Writes the report as an HTML file, whole or not at all.
///
/// @param report The report.
/// @param path   The file, UTF-8.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_report_save(
    report: *const ptzcal_report,
    path: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (report, path) = unsafe { (borrow(report)?, path_in(path)?) };
        report.0.read(ptzcal_report::NAME)?.save(&path)
    })
}
