//! Planning, and the next best shots
//!
//! How many shots, and where, for a target accuracy of the fixed camera's position: before anyone scans
//! (ptzcal_plan_make), and between shots (ptzcal_next_shots). A shot is written as 5 numbers: pan and tilt
//! (the device's readings, radians), the depth that is expected there (metres), and the position's expected
//! error after it and all before it: root mean square, and largest semi-axis (metres).

use super::args::{ArrayOut, BufferOut, number, vectors};
use super::call::{ErrorOut, guard, guard_or};
use super::cancel::ptzcal_cancel;
use super::error::ptzcal_error;
use super::handle::{Handle, HandleOut, borrow, free};
use super::scan::ptzcal_region;
use super::set_up::region_in;
use super::site::ptzcal_site;
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::error::Error;
use crate::study::{NextOptions, NextShot, NoiseLevel, Plan, PlanOptions, ScannedShot, next_shots, plan};

/// What is wanted of a plan.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_plan_options {
    /// Set by ptzcal_plan_options_init.
    pub struct_size: u32,
    /// Most positions of a grid, 1 to 1,000,000; the default is 20,000.
    pub max_positions: u32,
    /// Least reading of pan, radians.
    pub pan_min: f64,
    /// Greatest reading of pan, radians.
    pub pan_max: f64,
    /// Least reading of tilt, radians.
    pub tilt_min: f64,
    /// Greatest reading of tilt, radians.
    pub tilt_max: f64,
    /// Noise of a spot in the head camera, px; the default is 0.2.
    pub head_sigma: f64,
    /// Noise of a spot in the fixed camera, px; the default is 0.2.
    pub fixed_sigma: f64,
    /// Wanted root mean square error of the fixed camera's position, metres; the default is 0.01.
    pub target: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_plan_options {
    const NAME: &'static str = "options";
    const FIRST_SIZE: usize = 8 + 7 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            max_positions: 20_000,
            pan_min: 0.0,
            pan_max: 0.0,
            tilt_min: 0.0,
            tilt_max: 0.0,
            head_sigma: 0.2,
            fixed_sigma: 0.2,
            target: 0.01,
        }
    }
}

/// What a plan comes to.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_plan_summary {
    /// Set by ptzcal_plan_summary_init.
    pub struct_size: u32,
    /// The coarsest grid over the region that reaches the target: positions of pan.
    pub pan_steps: u32,
    /// Positions of tilt.
    pub tilt_steps: u32,
    /// Of its positions those that both cameras see.
    pub grid_seen: u32,
    /// Chosen shots that reach it too: ptzcal_plan_copy_shots.
    pub shots: u32,
    /// The ptzcal_rig_parameter that limits any number of shots; -1 when the rig is known exactly.
    pub limited_by: i32,
    /// Expected root mean square error of the position after the grid, metres.
    pub grid_rms: f64,
    /// Its largest semi-axis, metres.
    pub grid_semi_axis: f64,
    /// What any number of shots would leave: what is not known of the rig, metres.
    pub limit_rms: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_plan_summary {
    const NAME: &'static str = "summary";
    const FIRST_SIZE: usize = 6 * 4 + 3 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            pan_steps: 0,
            tilt_steps: 0,
            grid_seen: 0,
            shots: 0,
            limited_by: -1,
            grid_rms: 0.0,
            grid_semi_axis: 0.0,
            limit_rms: 0.0,
        }
    }
}

/// A plan. Immutable: any number of threads may read it.
pub struct ptzcal_plan(Plan);

impl Handle for ptzcal_plan {
    const NAME: &'static str = "plan";
}

/// 5 numbers for each shot.
fn numbers(shots: &[NextShot]) -> Vec<f64> {
    shots.iter().flat_map(|s| [s.pan, s.tilt, s.depth, s.after.rms, s.after.semi_axis]).collect()
}

/// Sets up options with their defaults; the region must still be set.
///
/// @param options The struct.
/// @param size    sizeof *options.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_plan_options_init(options: *mut ptzcal_plan_options, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(options, size) })
}

/// Sets up a summary: everything 0.
///
/// @param summary The struct.
/// @param size    sizeof *summary.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_plan_summary_init(summary: *mut ptzcal_plan_summary, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(summary, size) })
}

/// Plans a scan in a site's surroundings.
///
/// @param site    The site; its camera is a guess.
/// @param options What is wanted.
/// @param token   Stops it from another thread; may be NULL.
/// @param result  Receives the plan; free it with ptzcal_plan_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE when neither max_positions nor any number of shots
///         reach the target (the message says which, and what limits it); PTZCAL_STATUS_DEGENERATE when
///         the surroundings cannot determine the camera; PTZCAL_STATUS_NOT_FOUND when it sees nothing of
///         the region; PTZCAL_STATUS_BAD_STATE for a site without surroundings;
///         PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_CANCELLED;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_plan_make(
    site: *const ptzcal_site,
    options: *const ptzcal_plan_options,
    token: *const ptzcal_cancel,
    result: *mut *mut ptzcal_plan,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, site, o, cancel) =
            unsafe { (HandleOut::new(result)?, borrow(site)?, sized::read(options)?, ptzcal_cancel::share(token)) };
        let held = site.0.read(ptzcal_site::NAME)?;
        let options = PlanOptions {
            pan: [o.pan_min, o.pan_max],
            tilt: [o.tilt_min, o.tilt_max],
            scene: held.scene()?.clone(),
            level: NoiseLevel { head: o.head_sigma, fixed: o.fixed_sigma },
            target: o.target,
            max_positions: o.max_positions,
            cancel,
        };
        out.give(ptzcal_plan(plan(&held.site, &options)?));
        Ok(())
    })
}

/// What a plan comes to.
///
/// @param result  The plan.
/// @param summary Receives the summary; set up by ptzcal_plan_summary_init.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_plan_get_summary(
    result: *const ptzcal_plan,
    summary: *mut ptzcal_plan_summary,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (result, out) = unsafe { (borrow(result)?, SizedOut::new(summary)?) };
        let p = &result.0;
        out.write(&ptzcal_plan_summary {
            pan_steps: p.grid.pan_steps,
            tilt_steps: p.grid.tilt_steps,
            grid_seen: p.grid_seen as u32,
            shots: p.shots.len() as u32,
            limited_by: p.limited_by.map_or(-1, |parameter| parameter as i32),
            grid_rms: p.grid_accuracy.rms,
            grid_semi_axis: p.grid_accuracy.semi_axis,
            limit_rms: p.limit.rms,
            ..SizedStruct::initial()
        });
        Ok(())
    })
}

/// The chosen shots of a plan, the most valuable first.
///
/// @param result   The plan.
/// @param buffer   Receives 5 numbers for each shot; may be NULL when capacity is 0.
/// @param capacity Numbers that fit.
/// @param needed   Receives their number; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_plan_copy_shots(
    result: *const ptzcal_plan,
    buffer: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (result, out) = unsafe { (borrow(result)?, BufferOut::new(buffer, capacity, needed)?) };
        out.write(&numbers(&result.0.shots))
    })
}

/// Frees a plan.
///
/// @param result The plan; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_plan_free(result: *mut ptzcal_plan) {
    // SAFETY: NULL or a live plan that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(result) });
}

/// Given what is scanned, where to shoot next so that the fixed camera's position becomes surer. Depths
/// at the candidates are predicted from the scanned ones, and so is whether the fixed camera sees them. With
/// a target the first shot may be a look at a place of which little is known, expected to save several shots
/// later. Asked after every shot, with the target, it needs fewest.
///
/// @param site        The site; its camera is the best estimate so far. Surroundings are not used.
/// @param scanned     n shots of 4 numbers: pan and tilt as read (radians), measured depth along the
///                    head's axis (metres), 1 when the fixed camera saw the spot, else 0.
/// @param n           Shots, 1 to 100,000.
/// @param candidates  Positions to choose from, 100,000 at most. Each is taken once before its depth is known;
///                    one that the fixed camera saw may be shot again and again.
/// @param head_sigma  Noise of a spot in the head camera, px.
/// @param fixed_sigma Noise of a spot in the fixed camera, px.
/// @param target      Stops where the position's expected root mean square error is below, metres; 0: never.
/// @param count       Most shots to choose, at least 1.
/// @param now         Receives 2 numbers, the position's expected error from what is scanned: root mean
///                    square and largest semi-axis, metres, both INFINITY while that does not determine the
///                    camera; may be NULL.
/// @param buffer      Receives 5 numbers for each chosen shot, in the order to take them; may be NULL when
///                    capacity is 0.
/// @param capacity    Numbers that fit; 5 count are always enough.
/// @param needed      Receives their number; may be NULL.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND when the fixed camera is expected to see none of the
///         candidates; PTZCAL_STATUS_TOO_FEW_POINTS without a scanned shot; PTZCAL_STATUS_INVALID_ARGUMENT;
///         PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_next_shots(
    site: *const ptzcal_site,
    scanned: *const f64,
    n: usize,
    candidates: *const ptzcal_region,
    head_sigma: f64,
    fixed_sigma: f64,
    target: f64,
    count: u32,
    now: *mut f64,
    buffer: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (site, scanned, candidates, now, out) = unsafe {
            (
                borrow(site)?,
                vectors::<4>(scanned, n, "scanned")?,
                region_in(candidates)?,
                ArrayOut::vectors_optional::<2>(now, 1, "now")?,
                BufferOut::new(buffer, capacity, needed)?,
            )
        };
        let level = NoiseLevel { head: number(head_sigma, "head_sigma")?, fixed: number(fixed_sigma, "fixed_sigma")? };
        let target = number(target, "target")?;
        let shot = |(i, &[pan, tilt, depth, seen]): (usize, &[f64; 4])| match seen {
            0.0 | 1.0 => Ok(ScannedShot { pan, tilt, depth, seen: seen == 1.0 }),
            _ => Err(Error::invalid("scanned", format!("shot {i}: seen is {seen}, neither 0 nor 1"))),
        };
        let scanned = scanned.iter().enumerate().map(shot).collect::<Result<Vec<_>, _>>()?;
        let options = NextOptions { candidates, level, count: count as usize, target };
        let held = site.0.read(ptzcal_site::NAME)?;
        let next = next_shots(&held.site, &scanned, &options)?;
        out.write(&numbers(&next.shots))?;
        if let Some(now) = now {
            now.write(&[[next.now.rms, next.now.semi_axis]]);
        }
        Ok(())
    })
}
