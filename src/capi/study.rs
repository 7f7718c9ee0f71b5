//! Noise study
//!
//! How do noises of head and fixed camera reach the fixed camera's estimate? (thesis VII, VIII.D) Monte Carlo
//! with every estimator that is asked for, at every noise level, beside what the closed-form covariance
//! expects. The same set-up, options and seed give the same bits with any number of threads.

use std::ffi::{c_char, c_void};

use super::args::{BufferOut, vectors};
use super::call::{ErrorOut, guard, guard_or};
use super::cancel::ptzcal_cancel;
use super::error::ptzcal_error;
use super::file::path;
use super::handle::{Handle, HandleOut, borrow, free};
use super::progress::{ptzcal_progress_fn, reporter};
use super::set_up::ptzcal_set_up;
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::error::{Error, Result};
use crate::format::write_atomically;
use crate::study::{Draws, Method, NoiseLevel, Quantity, Study, StudyOptions};

/// How the fixed camera is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ptzcal_study_method {
    /// DLT-Points from exact 3D points: no cascade.
    DltExact = 0,
    /// The thesis's eq. (23) as printed: exact points moved by the head camera's noisy pose. A rigid
    /// motion, which does not touch the lens and says little of a laser rig; needs
    /// ptzcal_set_up_set_control.
    DltCascadePrinted = 1,
    /// The cascade in its right form: noisy spots, so noisy points, then DLT-Points.
    DltCascade = 2,
    /// The closed form in inverse depth, weighted by the noise.
    ClosedForm = 3,
    /// Maximum likelihood with the site's beliefs: as ptzcal_calibrate_camera or
    /// ptzcal_adjustment_solve would do it.
    JointMl = 4,
}

/// Which noise the levels share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ptzcal_study_draws {
    /// A trial's noise is drawn once and scaled to every level: differences between levels are theirs
    /// and not luck's, and most of the work is shared.
    Common = 0,
    /// Every level draws its own.
    Independent = 1,
}

/// What is measured of a camera's error: the order of every array of four.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ptzcal_study_quantity {
    /// Distance of the position from the true one, metres.
    Position = 0,
    /// Angle of the rotation from the true one, radians.
    Rotation = 1,
    /// Of (fx, fy), pixels.
    Focal = 2,
    /// Of (cx, cy), pixels.
    PrincipalPoint = 3,
}

/// Charts of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ptzcal_study_plot {
    /// Root mean square error against noise, a line for each method; of a ptzcal_study_quantity.
    Errors = 0,
    /// Mean position error over the noises of both cameras; of a ptzcal_study_method.
    Grid = 1,
    /// Estimated positions from above; of a level, by its index.
    Scatter = 2,
}

/// How a study is made.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_study_options {
    /// Set by ptzcal_study_options_init.
    pub struct_size: u32,
    /// Bit 1 << method for each ptzcal_study_method; the default is all but the printed cascade. A label
    /// takes the highest one.
    pub methods: u32,
    /// A ptzcal_study_draws; the default is common noise.
    pub draws: u32,
    /// Trials, 1 to 100,000; the default is 100.
    pub trials: u32,
    /// Threads that work, 1 to 1024, the caller's among them; the default is 1.
    pub threads: u32,
    /// 0.
    pub reserved: u32,
    /// The default is 1.
    pub seed: u64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_study_options {
    const NAME: &'static str = "options";
    const FIRST_SIZE: usize = 6 * 4 + 8;
    fn initial() -> Self {
        let o = StudyOptions::default();
        Self {
            struct_size: size_of::<Self>() as u32,
            methods: o.methods.iter().map(|m| 1 << *m as u32).sum(),
            draws: o.draws as u32,
            trials: o.trials as u32,
            threads: o.threads as u32,
            reserved: 0,
            seed: o.seed,
        }
    }
}

impl TryFrom<ptzcal_study_options> for StudyOptions {
    type Error = Error;

    fn try_from(o: ptzcal_study_options) -> Result<Self> {
        let methods: Vec<Method> = Method::ALL.into_iter().filter(|m| o.methods >> *m as u32 & 1 == 1).collect();
        if o.methods >> Method::ALL.len() != 0 {
            return Err(Error::invalid("methods", format!("{:#x} has a bit of no ptzcal_study_method", o.methods)));
        }
        let draws = [Draws::Common, Draws::Independent].into_iter().find(|d| *d as u32 == o.draws);
        Ok(Self {
            methods,
            draws: draws.ok_or_else(|| Error::invalid("draws", format!("{} is no ptzcal_study_draws", o.draws)))?,
            trials: o.trials as usize,
            threads: o.threads as usize,
            seed: o.seed,
            ..Self::default()
        })
    }
}

/// Errors of one method at one noise level.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_study_cell {
    /// Set by ptzcal_study_cell_init.
    pub struct_size: u32,
    /// Trials that gave a camera.
    pub used: u32,
    /// Trials that gave none.
    pub failures: u32,
    /// 0.
    pub reserved: u32,
    /// Noise of the head camera's spot, px.
    pub head_sigma: f64,
    /// Noise of the fixed camera's, px.
    pub fixed_sigma: f64,
    /// Mean size of the error, by ptzcal_study_quantity; INFINITY when no trial gave a camera.
    pub mean: [f64; 4],
    /// Root mean square.
    pub rms: [f64; 4],
    /// Size of the mean error: what more trials, or more shots, do not take away.
    pub bias: [f64; 4],
    /// Root mean square that the closed-form covariance of the maximum-likelihood estimate expects at this
    /// level; INFINITY in a study whose methods take no shots.
    pub expected: [f64; 4],
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_study_cell {
    const NAME: &'static str = "cell";
    const FIRST_SIZE: usize = 4 * 4 + 18 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            used: 0,
            failures: 0,
            reserved: 0,
            head_sigma: 0.0,
            fixed_sigma: 0.0,
            mean: [0.0; 4],
            rms: [0.0; 4],
            bias: [0.0; 4],
            expected: [0.0; 4],
        }
    }
}

/// The answer of a study. Immutable: any number of threads may read it.
pub struct ptzcal_study(Study);

impl Handle for ptzcal_study {
    const NAME: &'static str = "study";
}

impl ptzcal_study {
    fn cell(&self, of: u32, level: usize) -> Result<&crate::study::Cell> {
        let method = method(of)?;
        let cells = self.0.cells_of(method);
        if cells.is_empty() {
            return Err(Error::invalid("method", format!("{} was not asked for", method.name())));
        }
        cells.get(level).ok_or_else(|| Error::invalid("level", format!("{level} of {}", cells.len())))
    }
}

fn method(value: u32) -> Result<Method> {
    let found = Method::ALL.into_iter().find(|m| *m as u32 == value);
    found.ok_or_else(|| Error::invalid("method", format!("{value} is no ptzcal_study_method")))
}

pub(super) fn quantity(value: u32) -> Result<Quantity> {
    let found = Quantity::ALL.into_iter().find(|q| *q as u32 == value);
    found.ok_or_else(|| Error::invalid("quantity", format!("{value} is no ptzcal_study_quantity")))
}

/// Pairs of head and fixed noise.
pub(super) fn levels_of(levels: &[[f64; 2]]) -> Vec<NoiseLevel> {
    levels.iter().map(|[head, fixed]| NoiseLevel { head: *head, fixed: *fixed }).collect()
}

/// Sets up options with their defaults.
///
/// @param options The struct.
/// @param size    sizeof *options.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_study_options_init(options: *mut ptzcal_study_options, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(options, size) })
}

/// Sets up a cell: everything 0.
///
/// @param cell The struct.
/// @param size sizeof *cell.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_study_cell_init(cell: *mut ptzcal_study_cell, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(cell, size) })
}

/// Makes a study.
///
/// @param set_up    The set-up.
/// @param levels    n pairs of noises, px: of the head camera's spot, of the fixed camera's; 0 to 1000.
/// @param n         Levels, 1 to 10,000.
/// @param distances m distances from the fixed camera at which points are handed off, metres; may be NULL
///                  when there is none.
/// @param m         Distances, at most 1000.
/// @param options   The options; may be NULL: the defaults.
/// @param progress  Hears how many trials are done, and can stop the study; may be NULL.
/// @param user      Handed to it.
/// @param token     Stops the study from another thread; may be NULL.
/// @param study     Receives the study; free it with ptzcal_study_free.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE;
///         PTZCAL_STATUS_DEGENERATE or PTZCAL_STATUS_TOO_FEW_POINTS when the shots cannot determine the
///         camera; PTZCAL_STATUS_CANCELLED when it was stopped; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_study_run(
    set_up: *const ptzcal_set_up,
    levels: *const f64,
    n: usize,
    distances: *const f64,
    m: usize,
    options: *const ptzcal_study_options,
    progress: ptzcal_progress_fn,
    user: *mut c_void,
    token: *const ptzcal_cancel,
    study: *mut *mut ptzcal_study,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, set_up, levels, distances, options, cancel) = unsafe {
            let options = if options.is_null() { SizedStruct::initial() } else { sized::read(options)? };
            (
                HandleOut::new(study)?,
                borrow(set_up)?,
                vectors::<2>(levels, n, "levels")?,
                vectors::<1>(distances, m, "distances")?,
                options,
                ptzcal_cancel::share(token),
            )
        };
        let options = StudyOptions {
            levels: levels_of(levels),
            distances: distances.as_flattened().to_vec(),
            cancel,
            ..options.try_into()?
        };
        let set_up = set_up.0.read(ptzcal_set_up::NAME)?;
        out.give(ptzcal_study(Study::run(&set_up, &options, reporter(progress, user))?));
        Ok(())
    })
}

/// The errors of a method at a level.
///
/// @param study  The study.
/// @param method A ptzcal_study_method that was asked for.
/// @param level  Index of the level.
/// @param cell   Receives the errors; set up by ptzcal_study_cell_init.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_study_get_cell(
    study: *const ptzcal_study,
    method: u32,
    level: usize,
    cell: *mut ptzcal_study_cell,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (study, out) = unsafe { (borrow(study)?, SizedOut::new(cell)?) };
        let found = study.cell(method, level)?;
        out.write(&ptzcal_study_cell {
            used: found.used as u32,
            failures: found.failures as u32,
            head_sigma: found.level.head,
            fixed_sigma: found.level.fixed,
            mean: found.mean,
            rms: found.rms,
            bias: found.bias,
            expected: study.0.expected.get(level).map_or([f64::INFINITY; 4], |e| e.rms),
            ..SizedStruct::initial()
        });
        Ok(())
    })
}

/// Root mean square errors of points handed off: where the fixed camera believes a pixel's point at a
/// distance to be, over 3 x 3 pixels of its image.
///
/// @param study    The study.
/// @param method   A ptzcal_study_method that was asked for.
/// @param level    Index of the level.
/// @param buffer   Receives metres, one for each distance of the study; may be NULL when capacity is 0.
/// @param capacity Numbers that fit.
/// @param needed   Receives the number of distances; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_study_copy_handoff(
    study: *const ptzcal_study,
    method: u32,
    level: usize,
    buffer: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (study, out) = unsafe { (borrow(study)?, BufferOut::new(buffer, capacity, needed)?) };
        out.write(&study.cell(method, level)?.handoff)
    })
}

/// Writes all figures of a study as JSON; an infinite one is null.
///
/// @param study The study.
/// @param path  The file.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_study_save_json(
    study: *const ptzcal_study,
    path: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (study, path) = unsafe { (borrow(study)?, self::path(path)?) };
        write_atomically(&path, study.0.to_json().as_bytes())
    })
}

/// Writes all figures of a study as CSV, a line for each method and level.
///
/// @param study The study.
/// @param path  The file.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_study_save_csv(
    study: *const ptzcal_study,
    path: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (study, path) = unsafe { (borrow(study)?, self::path(path)?) };
        write_atomically(&path, study.0.to_csv().as_bytes())
    })
}

/// Draws a chart as a self-contained SVG.
///
/// @param study The study.
/// @param plot  A ptzcal_study_plot.
/// @param of    What it is of: a quantity, a method or a level, as the plot says.
/// @param path  The file.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_FILE_IO.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_study_save_plot(
    study: *const ptzcal_study,
    plot: u32,
    of: u32,
    path: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (study, path) = unsafe { (borrow(study)?, self::path(path)?) };
        let svg = match plot {
            p if p == ptzcal_study_plot::Errors as u32 => study.0.plot_errors(quantity(of)?),
            p if p == ptzcal_study_plot::Grid as u32 => study.0.plot_grid(method(of)?)?,
            p if p == ptzcal_study_plot::Scatter as u32 => study.0.plot_scatter(of as usize)?,
            _ => return Err(Error::invalid("plot", format!("{plot} is no ptzcal_study_plot"))),
        };
        write_atomically(&path, svg.as_bytes())
    })
}

/// Frees a study.
///
/// @param study The study; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_study_free(study: *mut ptzcal_study) {
    // SAFETY: NULL or a live study that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(study) });
}
