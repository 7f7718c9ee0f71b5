//! Precision label
//!
//! What can be expected of a set-up (thesis VIII.D): the fixed camera's error against working distance and
//! noise, simulated and by the closed-form covariance, with the error of points handed off at that
//! distance. Shots up to a distance are what a rig has that works no farther.

use std::ffi::{c_char, c_void};

use super::args::{Out, vectors};
use super::call::{ErrorOut, guard, guard_or};
use super::cancel::ptzcal_cancel;
use super::error::ptzcal_error;
use super::file::path;
use super::handle::{Handle, HandleOut, borrow, free};
use super::progress::{ptzcal_progress_fn, reporter};
use super::set_up::ptzcal_set_up;
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use super::study::{levels_of, ptzcal_study_options, quantity};
use crate::error::Error;
use crate::format::write_atomically;
use crate::study::{LabelOptions, PrecisionLabel, StudyOptions};

/// One line of a label: root mean square errors.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_label_row {
    /// Set by ptzcal_label_row_init.
    pub struct_size: u32,
    /// Shots up to the distance.
    pub shots: u32,
    /// Trials that gave no camera.
    pub failures: u32,
    /// 0.
    pub reserved: u32,
    /// Working distance, metres.
    pub distance: f64,
    /// Noise of the head camera's spot, px.
    pub head_sigma: f64,
    /// Noise of the fixed camera's, px.
    pub fixed_sigma: f64,
    /// Simulated, by ptzcal_study_quantity; INFINITY when no trial gave a camera.
    pub simulated: [f64; 4],
    /// By the closed-form covariance of the maximum-likelihood estimate; INFINITY for methods that take
    /// no shots.
    pub expected: [f64; 4],
    /// Of a point handed off at the distance, metres.
    pub handoff_simulated: f64,
    /// The same by the covariance.
    pub handoff_expected: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_label_row {
    const NAME: &'static str = "row";
    const FIRST_SIZE: usize = 4 * 4 + 13 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            shots: 0,
            failures: 0,
            reserved: 0,
            distance: 0.0,
            head_sigma: 0.0,
            fixed_sigma: 0.0,
            simulated: [0.0; 4],
            expected: [0.0; 4],
            handoff_simulated: 0.0,
            handoff_expected: 0.0,
        }
    }
}

/// A precision label. Immutable: any number of threads may read it.
pub struct ptzcal_label(PrecisionLabel);

impl Handle for ptzcal_label {
    const NAME: &'static str = "label";
}

/// Sets up a row: everything 0.
///
/// @param row  The struct.
/// @param size sizeof *row.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_label_row_init(row: *mut ptzcal_label_row, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(row, size) })
}

/// Makes a label.
///
/// @param set_up    The set-up.
/// @param distances m working distances, metres.
/// @param m         Distances, 1 to 1000.
/// @param levels    n pairs of noises, px: of the head camera's spot, of the fixed camera's.
/// @param n         Levels, 1 to 10,000.
/// @param options   Of the method (the highest bit), trials, threads and seed; may be NULL: the defaults,
///                  maximum likelihood.
/// @param progress  Hears how many trials are done, and can stop it; may be NULL.
/// @param user      Handed to it.
/// @param token     Stops it from another thread; may be NULL.
/// @param label     Receives the label; free it with ptzcal_label_free.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS or PTZCAL_STATUS_DEGENERATE when the shots up to
///         none of the distances determine a camera; PTZCAL_STATUS_INVALID_ARGUMENT;
///         PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_CANCELLED; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_label_make(
    set_up: *const ptzcal_set_up,
    distances: *const f64,
    m: usize,
    levels: *const f64,
    n: usize,
    options: *const ptzcal_study_options,
    progress: ptzcal_progress_fn,
    user: *mut c_void,
    token: *const ptzcal_cancel,
    label: *mut *mut ptzcal_label,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, set_up, distances, levels, options, cancel) = unsafe {
            let options = if options.is_null() { SizedStruct::initial() } else { sized::read(options)? };
            (
                HandleOut::new(label)?,
                borrow(set_up)?,
                vectors::<1>(distances, m, "distances")?,
                vectors::<2>(levels, n, "levels")?,
                options,
                ptzcal_cancel::share(token),
            )
        };
        let study = StudyOptions::try_from(options)?;
        let method = study.methods.last().copied();
        let options = LabelOptions {
            distances: distances.as_flattened().to_vec(),
            levels: levels_of(levels),
            method: method.ok_or_else(|| Error::invalid("methods", "none"))?,
            trials: study.trials,
            seed: study.seed,
            threads: study.threads,
            cancel,
        };
        let set_up = set_up.0.read(ptzcal_set_up::NAME)?;
        out.give(ptzcal_label(PrecisionLabel::make(&set_up, &options, reporter(progress, user))?));
        Ok(())
    })
}

/// The number of rows: distance by distance, level by level within. Distances up to which the shots do not
/// determine a camera have none.
///
/// @param label The label.
/// @param count Receives the number.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_label_get_count(
    label: *const ptzcal_label,
    count: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (label, count) = unsafe { (borrow(label)?, Out::new(count, "count")?) };
        count.write(label.0.rows.len());
        Ok(())
    })
}

/// A row of a label.
///
/// @param label The label.
/// @param index The row.
/// @param row   Receives the row; set up by ptzcal_label_row_init.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_label_get_row(
    label: *const ptzcal_label,
    index: usize,
    row: *mut ptzcal_label_row,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (label, out) = unsafe { (borrow(label)?, SizedOut::new(row)?) };
        let count = label.0.rows.len();
        let r = label.0.rows.get(index).ok_or_else(|| Error::invalid("index", format!("{index} of {count}")))?;
        out.write(&ptzcal_label_row {
            shots: r.shots as u32,
            failures: r.failures as u32,
            distance: r.distance,
            head_sigma: r.level.head,
            fixed_sigma: r.level.fixed,
            simulated: r.simulated,
            expected: r.expected,
            handoff_simulated: r.handoff_simulated,
            handoff_expected: r.handoff_expected,
            ..SizedStruct::initial()
        });
        Ok(())
    })
}

/// Writes a label as JSON; an infinite figure is null.
///
/// @param label The label.
/// @param path  The file.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_label_save_json(
    label: *const ptzcal_label,
    path: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (label, path) = unsafe { (borrow(label)?, self::path(path)?) };
        write_atomically(&path, label.0.to_json().as_bytes())
    })
}

/// Writes a label as CSV, a line for each row.
///
/// @param label The label.
/// @param path  The file.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_label_save_csv(
    label: *const ptzcal_label,
    path: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (label, path) = unsafe { (borrow(label)?, self::path(path)?) };
        write_atomically(&path, label.0.to_csv().as_bytes())
    })
}

/// What ptzcal_label_save_plot takes, besides a ptzcal_study_quantity, for the error of points handed off.
pub const PTZCAL_LABEL_HANDOFF: u32 = 4;

/// Draws errors against the working distance, a line for each level, as a self-contained SVG.
///
/// @param label The label.
/// @param of    A ptzcal_study_quantity, or PTZCAL_LABEL_HANDOFF.
/// @param path  The file.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_FILE_IO.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_label_save_plot(
    label: *const ptzcal_label,
    of: u32,
    path: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (label, path) = unsafe { (borrow(label)?, self::path(path)?) };
        let svg = if of == PTZCAL_LABEL_HANDOFF { label.0.plot_handoff() } else { label.0.plot(quantity(of)?) };
        write_atomically(&path, svg.as_bytes())
    })
}

/// Frees a label.
///
/// @param label The label; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_label_free(label: *mut ptzcal_label) {
    // SAFETY: NULL or a live label that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(label) });
}
