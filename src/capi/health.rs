//! Health check
//!
//! Ten stored shots fired again (ptzcal_rig_fire_again) say whether a fixed camera still is where it was
//! calibrated: unchanged, moved (and where to), a rig that moved, or that it cannot be told; with the
//! test statistic and a false alarm rate that is chosen.

use std::ffi::{CString, c_char};

use nalgebra::{Matrix2, Vector2};

use super::args::{BufferOut, array, vectors};
use super::calibrate::ptzcal_calibration;
use super::call::{ErrorOut, guard, guard_or};
use super::error::{c_string, ptzcal_error};
use super::handle::{Handle, HandleOut, borrow, free};
use super::rig_model::ptzcal_rig_model;
use super::scan::ptzcal_scan;
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::error::{Error, Result};
use crate::geometry::RigModel;
use crate::health::{
    HealthOptions, HealthReport, HealthShot, MAX_SHOTS, ShotState, Spot, check_health, choose_shots, pair_shots,
};

/// What a check says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum ptzcal_verdict {
    Unchanged = 0,
    /// The fixed camera was turned or moved; its pose is refitted. One camera cannot tell that from a rig
    /// that was moved where the laser still meets the same depths: with several cameras, all of them
    /// say so then.
    CameraMoved = 1,
    /// The rig was moved, its head has lost its zero, or its laser has moved on the head.
    RigMoved = 2,
    /// Too few spots, or nothing explains them, or more than one thing does.
    CannotTell = 3,
}

/// What became of a shot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum ptzcal_shot_state {
    Used = 0,
    /// The head camera, the fixed camera or both do not see its spot again.
    NotSeen = 1,
    /// The laser meets something else there now.
    SceneChanged = 2,
    /// The fixed camera's spot contradicts all others.
    Outlier = 3,
}

/// The answer of a check. Immutable: any number of threads may read it.
pub struct ptzcal_health_report {
    report: HealthReport,
    reason: CString,
}

impl Handle for ptzcal_health_report {
    const NAME: &'static str = "report";
}

/// How a check decides.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_health_options {
    /// Set by ptzcal_health_options_init.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Probability of not saying unchanged when nothing has changed, between 0 and 0.5.
    pub false_alarm: f64,
    /// Standard deviation of where the head comes to rest about its reading of pan, radians.
    pub pan_sigma: f64,
    /// The same of tilt, radians.
    pub tilt_sigma: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_health_options {
    const NAME: &'static str = "options";
    const FIRST_SIZE: usize = 8 + 3 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            reserved: 0,
            false_alarm: 0.01,
            pan_sigma: 1e-4,
            tilt_sigma: 1e-4,
        }
    }
}

/// What a check came to.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_health {
    /// Set by ptzcal_health_init.
    pub struct_size: u32,
    /// A ptzcal_verdict.
    pub verdict: u32,
    /// 1 when there were enough spots for a test.
    pub has_statistic: u32,
    /// 1 when the camera's pose is refitted (ptzcal_health_report_refitted).
    pub has_refit: u32,
    /// 1 when a head that lost its zero explains the spots.
    pub has_head_shift: u32,
    /// Shots compared.
    pub shots: u32,
    /// Shots used.
    pub used: u32,
    /// Shots that are not seen again.
    pub not_seen: u32,
    /// Shots where the laser meets something else.
    pub scene_changed: u32,
    /// Shots that contradict all others.
    pub outliers: u32,
    /// Test of unchanged: chi-square, when nothing has changed.
    pub chi2: f64,
    /// Of it.
    pub degrees_of_freedom: f64,
    /// Of a statistic as large or larger, were nothing changed.
    pub probability: f64,
    /// What the refit turned and moved the camera by: w in R <- exp([w]x) R (camera axes, radians) and its centre (world, metres).
    pub change: [f64; 6],
    /// Of it, row-major.
    pub change_covariance: [f64; 36],
    /// What comes to the true pan and tilt, radians.
    pub head_shift: [f64; 2],
    /// Of it: pan pan, pan tilt, tilt tilt, rad^2.
    pub head_shift_covariance: [f64; 3],
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_health {
    const NAME: &'static str = "health";
    const FIRST_SIZE: usize = 40 + 50 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            verdict: 0,
            has_statistic: 0,
            has_refit: 0,
            has_head_shift: 0,
            shots: 0,
            used: 0,
            not_seen: 0,
            scene_changed: 0,
            outliers: 0,
            chi2: 0.0,
            degrees_of_freedom: 0.0,
            probability: 0.0,
            change: [0.0; 6],
            change_covariance: [0.0; 36],
            head_shift: [0.0; 2],
            head_shift_covariance: [0.0; 3],
        }
    }
}

/// Sets up options: one false alarm in a hundred, a head that comes to rest to 0.1 mrad.
///
/// @param options The struct.
/// @param size    sizeof *options.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_health_options_init(options: *mut ptzcal_health_options, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(options, size) })
}

/// Sets up a result: everything 0.
///
/// @param health The struct.
/// @param size   sizeof *health.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_health_init(health: *mut ptzcal_health, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(health, size) })
}

/// The shots of a scan that are worth firing again to check a fixed camera: seen by both cameras, as far
/// from each other in the picture and in depth as can be.
///
/// @param scan     The scan.
/// @param camera   The fixed camera's number.
/// @param count    How many are wanted; ten are enough. Fewer where there are no more.
/// @param buffer   Receives their indices, ascending; may be NULL when capacity is 0.
/// @param capacity How many fit.
/// @param needed   Receives how many there are, also when they do not fit; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS below four usable shots;
///         PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_choose_health_shots(
    scan: *const ptzcal_scan,
    camera: u32,
    count: usize,
    buffer: *mut usize,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (scan, buffer) = unsafe { (borrow(scan)?, BufferOut::new(buffer, capacity, needed)?) };
        if count == 0 || count > MAX_SHOTS {
            return Err(Error::invalid("count", format!("{count} is not in [1, {MAX_SHOTS}]")));
        }
        buffer.write(&choose_shots(&scan.0, camera as usize, count)?)
    })
}

/// Compares the shots of a scan with those fired again. Shots of the earlier scan that were not seen by
/// both cameras do not count:
/// only shots at the readings of the later scan are compared.
///
/// @param model       The rig.
/// @param calibration The fixed camera as it was, in the rig's frame.
/// @param before      The earlier scan.
/// @param again       The shots fired again.
/// @param camera      The fixed camera's number in both.
/// @param options     The options; may be NULL: the defaults.
/// @param report      Receives the report; free it with ptzcal_health_report_free.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK, whatever the verdict; PTZCAL_STATUS_INVALID_ARGUMENT,
///         PTZCAL_STATUS_NOT_FINITE for input that makes no sense.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_health_check(
    model: *const ptzcal_rig_model,
    calibration: *const ptzcal_calibration,
    before: *const ptzcal_scan,
    again: *const ptzcal_scan,
    camera: u32,
    options: *const ptzcal_health_options,
    report: *mut *mut ptzcal_health_report,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, model, calibration, before, again, given) = unsafe {
            (
                HandleOut::new(report)?,
                sized::read(model)?,
                borrow(calibration)?,
                borrow(before)?,
                borrow(again)?,
                if options.is_null() { SizedStruct::initial() } else { sized::read(options)? },
            )
        };
        let shots = pair_shots(&before.0, &again.0, camera as usize)?;
        out.give(check(model, calibration, &shots, given)?);
        Ok(())
    })
}

fn check(
    model: ptzcal_rig_model,
    calibration: &ptzcal_calibration,
    shots: &[HealthShot],
    given: ptzcal_health_options,
) -> Result<ptzcal_health_report> {
    let options = HealthOptions {
        false_alarm: given.false_alarm,
        pointing_sigma: [given.pan_sigma, given.tilt_sigma],
        ..HealthOptions::default()
    };
    let report = check_health(&RigModel::try_from(model)?, &calibration.answer, shots, &options)?;
    let reason = c_string(&report.reason);
    Ok(ptzcal_health_report { report, reason })
}

/// The same from spots that the host measured itself, at the same readings before and now, without a rig
/// and without scans.
///
/// @param model       The rig.
/// @param calibration The fixed camera as it was, in the rig's frame.
/// @param readings    2 n numbers: pan and tilt of each shot, the device's readings, radians.
/// @param spots       20 n numbers: for each shot the spot in the head camera and in the fixed one before,
///                    then in the head camera and in the fixed one now; of each u, v, pixels, and its
///                    covariance xx, xy, yy, px^2, positive definite.
/// @param seen        2 n bytes: was the spot of each shot seen now in the head camera, in the fixed one? 0:
///                    no, and its numbers do not matter, but for being finite; may be NULL: all were seen.
/// @param n           Number of shots, 1 to 10000.
/// @param options     The options; may be NULL: the defaults.
/// @param report      Receives the report; free it with ptzcal_health_report_free.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK, whatever the verdict; PTZCAL_STATUS_INVALID_ARGUMENT,
///         PTZCAL_STATUS_NOT_FINITE for input that makes no sense.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_health_check_spots(
    model: *const ptzcal_rig_model,
    calibration: *const ptzcal_calibration,
    readings: *const f64,
    spots: *const f64,
    seen: *const u8,
    n: usize,
    options: *const ptzcal_health_options,
    report: *mut *mut ptzcal_health_report,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, model, calibration, readings, spots, given) = unsafe {
            (
                HandleOut::new(report)?,
                sized::read(model)?,
                borrow(calibration)?,
                vectors::<2>(readings, n, "readings")?,
                vectors::<20>(spots, n, "spots")?,
                if options.is_null() { SizedStruct::initial() } else { sized::read(options)? },
            )
        };
        if n == 0 || n > MAX_SHOTS {
            return Err(Error::invalid("n", format!("{n} is not in [1, {MAX_SHOTS}]")));
        }
        // SAFETY: the caller keeps the header's rules for pointers; 2 n does not overflow.
        let seen = if seen.is_null() { &[] } else { unsafe { array(seen, 2 * n, "seen")? } };
        let shot = |(i, (reading, spots)): (usize, (&[f64; 2], &[f64; 20]))| {
            let spot = |k: usize| {
                let [u, v, xx, xy, yy] = std::array::from_fn(|j| spots[5 * k + j]);
                Spot { pixel: Vector2::new(u, v), covariance: Matrix2::new(xx, xy, xy, yy) }
            };
            let now = |k: usize| (seen.get(2 * i + k) != Some(&0)).then(|| spot(2 + k));
            HealthShot {
                pan: reading[0],
                tilt: reading[1],
                head: spot(0),
                fixed: spot(1),
                head_again: now(0),
                fixed_again: now(1),
            }
        };
        let shots: Vec<HealthShot> = readings.iter().zip(spots).enumerate().map(shot).collect();
        out.give(check(model, calibration, &shots, given)?);
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
pub unsafe extern "C" fn ptzcal_health_report_free(report: *mut ptzcal_health_report) {
    // SAFETY: NULL or a live handle that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(report) });
}

/// What a check came to.
///
/// @param report The report.
/// @param health Receives it; set up by ptzcal_health_init.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_health_report_get(
    report: *const ptzcal_health_report,
    health: *mut ptzcal_health,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (report, health) = unsafe { (borrow(report)?, SizedOut::new(health)?) };
        let r = &report.report;
        let count = |state| r.shots.iter().filter(|s| **s == state).count() as u32;
        let (change, change_covariance) = r.change.unwrap_or_default();
        let mut out = ptzcal_health {
            verdict: r.verdict as u32,
            has_statistic: u32::from(r.statistic.is_some()),
            has_refit: u32::from(r.refitted.is_some()),
            has_head_shift: u32::from(r.head_shift.is_some()),
            shots: r.shots.len() as u32,
            used: count(ShotState::Used),
            not_seen: count(ShotState::NotSeen),
            scene_changed: count(ShotState::SceneChanged),
            outliers: count(ShotState::Outlier),
            change: change.into(),
            change_covariance: std::array::from_fn(|i| change_covariance[(i / 6, i % 6)]),
            ..SizedStruct::initial()
        };
        if let Some(s) = &r.statistic {
            (out.chi2, out.degrees_of_freedom, out.probability) = (s.chi_square, s.freedom, s.probability);
        }
        if let Some(s) = &r.head_shift {
            out.head_shift = s.angles.into();
            out.head_shift_covariance = [s.covariance.m11, s.covariance.m12, s.covariance.m22];
        }
        health.write(&out);
        Ok(())
    })
}

/// The verdict in words.
///
/// @param report The report; may be NULL: "".
/// @return A string that lives as long as the report. Never NULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_health_report_reason(report: *const ptzcal_health_report) -> *const c_char {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard_or(c"".as_ptr(), || unsafe { borrow(report) }.map_or(c"".as_ptr(), |r| r.reason.as_ptr()))
}

/// What became of each shot that was compared, in the order of the earlier scan: ptzcal_shot_state.
///
/// @param report   The report.
/// @param buffer   Receives the states; may be NULL when capacity is 0.
/// @param capacity How many fit.
/// @param needed   Receives how many there are, also when they do not fit; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_health_report_copy_shots(
    report: *const ptzcal_health_report,
    buffer: *mut u32,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (report, buffer) = unsafe { (borrow(report)?, BufferOut::new(buffer, capacity, needed)?) };
        let states: Vec<u32> = report.report.shots.iter().map(|s| *s as u32).collect();
        buffer.write(&states)
    })
}

/// The camera with its pose refitted and its lens held.
///
/// @param report      The report.
/// @param calibration Receives a calibration of its own, without residuals; free it with
///                    ptzcal_calibration_free.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND when nothing was refitted.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_health_report_refitted(
    report: *const ptzcal_health_report,
    calibration: *mut *mut ptzcal_calibration,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, report) = unsafe { (HandleOut::new(calibration)?, borrow(report)?) };
        let none = || Error::NotFound { reason: format!("nothing was refitted: {}", report.report.reason) };
        out.give(report.report.refitted.clone().ok_or_else(none)?.into());
        Ok(())
    })
}
