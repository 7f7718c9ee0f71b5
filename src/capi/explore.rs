//! Exploring
//!
//! Finds by itself the range of pan and tilt in which each fixed camera sees the laser's spot, coarse to
//! fine; and fires single shots again where a scan has measured before.

use std::ffi::c_void;
use std::ops::ControlFlow;
use std::time::Instant;

use super::args::{BufferOut, array};
use super::call::{ErrorOut, guard, guard_or};
use super::error::ptzcal_error;
use super::handle::{Handle, HandleOut, borrow, free};
use super::log::User;
use super::progress::{ptzcal_progress, ptzcal_progress_fn};
use super::rig::ptzcal_rig;
use super::scan::{ptzcal_region, ptzcal_scan};
use super::scan_options::ptzcal_scan_options;
use super::shot::ptzcal_shot;
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::control::Cancel;
use crate::error::{Error, Result};
use crate::rig::{ExploreOptions, Explored, FixedCamera, Rig, ScanOptions, ShotProgress, Visible, explore, fire_shots};

/// Where fixed cameras see the laser's spot. Immutable: any number of threads may read it.
pub struct ptzcal_exploration(Explored);

impl Handle for ptzcal_exploration {
    const NAME: &'static str = "exploration";
}

/// How the head's reach is explored.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_explore_options {
    /// Set by ptzcal_explore_options_init.
    pub struct_size: u32,
    /// Most shots, 4 to 500.
    pub max_shots: u32,
    /// 0.
    pub reserved: [u32; 2],
    /// Least reading of pan to look at, radians; -INFINITY: as far as the head reaches.
    pub pan_min: f64,
    /// Greatest reading of pan, radians; INFINITY likewise.
    pub pan_max: f64,
    /// Least reading of tilt, radians; -INFINITY likewise.
    pub tilt_min: f64,
    /// Greatest reading of tilt, radians; INFINITY likewise.
    pub tilt_max: f64,
    /// Shots are no nearer to each other than this, 0.01 to 1 radians.
    pub tolerance: f64,
    /// Steps of the regions that come out, radians.
    pub spacing: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_explore_options {
    const NAME: &'static str = "options";
    const FIRST_SIZE: usize = 16 + 6 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            max_shots: 59,
            reserved: [0; 2],
            pan_min: f64::NEG_INFINITY,
            pan_max: f64::INFINITY,
            tilt_min: f64::NEG_INFINITY,
            tilt_max: f64::INFINITY,
            tolerance: 2.5f64.to_radians(),
            spacing: 1f64.to_radians(),
        }
    }
}

/// Where a fixed camera sees the spot.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_visible {
    /// Set by ptzcal_visible_init.
    pub struct_size: u32,
    /// Shots taken in all.
    pub shots: u32,
    /// Shots that the camera saw.
    pub seen: u32,
    /// Of them those that the head camera saw too.
    pub measured: u32,
    /// Part of the region's positions that the camera sees, as far as the shots tell.
    pub share: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_visible {
    const NAME: &'static str = "visible";
    const FIRST_SIZE: usize = 16 + 8;
    fn initial() -> Self {
        Self { struct_size: size_of::<Self>() as u32, shots: 0, seen: 0, measured: 0, share: 0.0 }
    }
}

/// Sets up options: all that the head reaches, at most 59 shots, to 2.5 degrees, steps of 1 degree.
///
/// @param options The struct.
/// @param size    sizeof *options.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_explore_options_init(
    options: *mut ptzcal_explore_options,
    size: usize,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(options, size) })
}

/// Sets up a result: everything 0.
///
/// @param visible The struct.
/// @param size    sizeof *visible.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_visible_init(visible: *mut ptzcal_visible, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(visible, size) })
}

/// Does work with a rig and the fixed cameras of scan options, and tells the host of each shot.
///
/// # Safety
/// `progress` may be called with `user`.
unsafe fn with_cameras<T>(
    handle: &ptzcal_rig,
    scan_options: Option<&ptzcal_scan_options>,
    progress: ptzcal_progress_fn,
    user: *mut c_void,
    work: impl FnOnce(
        &mut Rig,
        ScanOptions,
        &mut [FixedCamera],
        &mut dyn FnMut(&ShotProgress<'_>) -> ControlFlow<()>,
    ) -> Result<T>,
) -> Result<T> {
    let (mut options, cameras) = match scan_options {
        Some(o) => {
            let settings = o.0.read(ptzcal_scan_options::NAME)?;
            (settings.options.clone(), settings.cameras.clone())
        }
        None => (ScanOptions::default(), Vec::new()),
    };
    let (mut rig, cancel): (_, Cancel) = handle.work(options.cancel)?;
    options.cancel = cancel;
    let mut fixed =
        cameras.iter().map(|c| c.open(handle.whole.as_ref(), &handle.around)).collect::<Result<Vec<FixedCamera>>>()?;
    let (user, begun) = (User::new(user), Instant::now());
    let mut report = |now: &ShotProgress<'_>| {
        let Some(callback) = progress else { return ControlFlow::Continue(()) };
        let shot = now.shot.map(ptzcal_shot::from);
        let message = ptzcal_progress {
            struct_size: size_of::<ptzcal_progress>() as u32,
            pass: 1,
            passes: 1,
            measured: shot.map_or(0, |s| s.found),
            done: now.done as u64,
            total: now.total as u64,
            elapsed: begun.elapsed().as_secs_f64(),
            seconds_left: -1.0,
            shot: shot.as_ref().map_or(std::ptr::null(), std::ptr::from_ref),
        };
        // SAFETY: by this function's contract.
        unsafe { message.tell(callback, user) }
    };
    work(&mut rig, options, &mut fixed, &mut report)
}

/// Finds the range of pan and tilt in which each fixed camera sees the laser's spot. What ends early
/// (stopped, cancelled, a device failed) is PTZCAL_STATUS_OK with what was found until then:
/// ptzcal_scan_end of ptzcal_exploration_get_scan says why. However it ends, the laser is off and the head
/// was told to stop.
///
/// @param rig          The rig.
/// @param options      The options; may be NULL: the defaults.
/// @param scan_options How shots are taken and which fixed cameras watch; journal, recording and coarse
///                     pass do not matter.
/// @param progress     Hears of each shot and can stop the work; may be NULL.
/// @param user         Handed to the callback.
/// @param exploration  Receives the answer; free it with ptzcal_exploration_free.
/// @param error        Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND: no camera saw a spot; and before anything moves
///         PTZCAL_STATUS_INVALID_ARGUMENT, PTZCAL_STATUS_NOT_FINITE, PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_explore(
    rig: *mut ptzcal_rig,
    options: *const ptzcal_explore_options,
    scan_options: *const ptzcal_scan_options,
    progress: ptzcal_progress_fn,
    user: *mut c_void,
    exploration: *mut *mut ptzcal_exploration,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, handle, given, scan_options) = unsafe {
            (
                HandleOut::new(exploration)?,
                borrow(rig)?,
                if options.is_null() { SizedStruct::initial() } else { sized::read(options)? },
                borrow(scan_options)?,
            )
        };
        let given: ptzcal_explore_options = given;
        // SAFETY: the caller keeps the header's rules for callbacks.
        let found = unsafe {
            with_cameras(handle, Some(scan_options), progress, user, |rig, scan, fixed, report| {
                let options = ExploreOptions {
                    pan: [given.pan_min, given.pan_max],
                    tilt: [given.tilt_min, given.tilt_max],
                    tolerance: given.tolerance,
                    max_shots: given.max_shots as usize,
                    spacing: given.spacing,
                    scan,
                };
                explore(rig, &options, fixed, report)
            })?
        };
        out.give(ptzcal_exploration(found));
        Ok(())
    })
}

/// Frees an exploration.
///
/// @param exploration The exploration; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_exploration_free(exploration: *mut ptzcal_exploration) {
    // SAFETY: NULL or a live handle that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(exploration) });
}

fn visible(exploration: &ptzcal_exploration, camera: u32) -> Result<&Visible> {
    let cameras = &exploration.0.cameras;
    let none = || Error::invalid("camera", format!("{camera} of {}", cameras.len()));
    cameras.get(camera as usize).ok_or_else(none)?.as_ref().map_err(Clone::clone)
}

/// Where a fixed camera sees the spot.
///
/// @param exploration The exploration.
/// @param camera      The fixed camera's number.
/// @param region      Receives the range, ready for ptzcal_rig_scan_region; set up by
///                    ptzcal_region_init.
/// @param visible     Receives how much of it is seen; set up by ptzcal_visible_init.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND: the camera saw none;
///         PTZCAL_STATUS_INVALID_ARGUMENT for a camera that did not watch.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_exploration_get_visible(
    exploration: *const ptzcal_exploration,
    camera: u32,
    region: *mut ptzcal_region,
    visible: *mut ptzcal_visible,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (exploration, region, out) =
            unsafe { (borrow(exploration)?, SizedOut::new(region)?, SizedOut::new(visible)?) };
        let found = self::visible(exploration, camera)?;
        region.write(&(&found.region).into());
        out.write(&ptzcal_visible {
            shots: exploration.0.scan.shots.len() as u32,
            seen: found.seen as u32,
            measured: found.measured as u32,
            share: found.share,
            ..SizedStruct::initial()
        });
        Ok(())
    })
}

/// For each position of the region, tilt step * pan_steps + pan step: 1 when the camera sees the spot there,
/// as far as the shots about it tell, else 0.
///
/// @param exploration The exploration.
/// @param camera      The fixed camera's number.
/// @param buffer      Receives the bytes; may be NULL when capacity is 0.
/// @param capacity    How many bytes the buffer holds.
/// @param needed      Receives how many there are, also when they do not fit; may be NULL.
/// @param error       Receives the error; may be NULL.
/// @return As ptzcal_exploration_get_visible; PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_exploration_copy_mask(
    exploration: *const ptzcal_exploration,
    camera: u32,
    buffer: *mut u8,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (exploration, buffer) = unsafe { (borrow(exploration)?, BufferOut::new(buffer, capacity, needed)?) };
        let mask: Vec<u8> = visible(exploration, camera)?.mask.iter().map(|m| u8::from(*m)).collect();
        buffer.write(&mask)
    })
}

/// The shots of an exploration, and how it ended, as a scan.
///
/// @param exploration The exploration.
/// @param scan        Receives a scan of its own; free it with ptzcal_scan_free.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_exploration_get_scan(
    exploration: *const ptzcal_exploration,
    scan: *mut *mut ptzcal_scan,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, exploration) = unsafe { (HandleOut::new(scan)?, borrow(exploration)?) };
        out.give(ptzcal_scan(exploration.0.scan.clone()));
        Ok(())
    })
}

/// Fires single shots again at the readings of an earlier scan's, for ptzcal_health_check. A work that
/// ends early returns what it measured; ptzcal_scan_end says why. However it ends, the laser is off and the
/// head was told to stop.
///
/// @param rig          The rig.
/// @param before       The earlier scan.
/// @param indices      n indices of its shots, as ptzcal_scan_choose_health_shots gives them.
/// @param n            Number of shots, at least 1.
/// @param scan_options How shots are taken and which fixed cameras watch; journal, recording and coarse
///                     pass do not matter.
/// @param progress     Hears of each shot and can stop the work; may be NULL.
/// @param user         Handed to the callback.
/// @param again        Receives the shots, in this order; free it with ptzcal_scan_free.
/// @param error        Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; and before anything moves PTZCAL_STATUS_INVALID_ARGUMENT (an index that
///         does not exist), PTZCAL_STATUS_UNREACHABLE, PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_fire_again(
    rig: *mut ptzcal_rig,
    before: *const ptzcal_scan,
    indices: *const usize,
    n: usize,
    scan_options: *const ptzcal_scan_options,
    progress: ptzcal_progress_fn,
    user: *mut c_void,
    again: *mut *mut ptzcal_scan,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, handle, before, indices, scan_options) = unsafe {
            (
                HandleOut::new(again)?,
                borrow(rig)?,
                borrow(before)?,
                array(indices, n, "indices")?,
                Some(borrow(scan_options)?),
            )
        };
        let shots = &before.0.shots;
        let reading = |i: &usize| {
            let none = || Error::invalid("indices", format!("{i} of {} shots", shots.len()));
            shots.get(*i).map(|s| (s.pan, s.tilt)).ok_or_else(none)
        };
        let readings = indices.iter().map(reading).collect::<Result<Vec<_>>>()?;
        // SAFETY: the caller keeps the header's rules for callbacks.
        let scan = unsafe {
            with_cameras(handle, scan_options, progress, user, |rig, options, fixed, report| {
                fire_shots(rig, &readings, &options, fixed, report)
            })?
        };
        out.give(ptzcal_scan(scan));
        Ok(())
    })
}
