//! Scanning a region
//!
//! A scan turns the head over a grid of positions, measures a point with the laser at each, and
//! watches any number of fixed cameras at the same time. It goes over the region twice: a coarse
//! subset of positions tells roughly where each fixed camera stands, and for all others the spot is
//! looked for only where it can be. With a journal, a scan that is killed goes on where it was.

use super::args::{BufferOut, Out};
use super::call::{ErrorOut, guard, guard_or};
use super::correspondences::ptzcal_correspondences;
use super::detect::ptzcal_spot;
use super::error::ptzcal_error;
use super::handle::{Handle, HandleOut, borrow, borrow_optional, free};
use super::log::User;
use super::progress::{ptzcal_progress, ptzcal_progress_fn};
use super::rig::ptzcal_rig;
use super::roof_edges::ptzcal_roof_edges;
use super::scan_options::ptzcal_scan_options;
use super::shot::ptzcal_shot;
use super::simulator::PTZCAL_HEAD_CAMERA;
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::calibrate::Observation;
use crate::error::{Error, Result};
use crate::geometry::InverseDepthPoint;
use crate::pose::{PlaneFitOptions, fit_plane_to_shots};
use crate::rig::{
    FixedCamera, Phase, Progress, Scan, ScanEnd, ScanOptions, ScanRegion, Sighting, WholeRig, scan_region,
};
use std::ffi::c_void;
use std::ops::ControlFlow;
use std::time::Instant;

/// The pan and tilt positions of a scan: a grid, both ends included; a single step stands in the
/// middle.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_region {
    /// Set by ptzcal_region_init.
    pub struct_size: u32,
    /// Positions of pan, at least 1.
    pub pan_steps: u32,
    /// Positions of tilt, at least 1. At most 1,000,000 positions in all.
    pub tilt_steps: u32,
    /// 0.
    pub reserved: u32,
    /// Least reading of pan, radians.
    pub pan_min: f64,
    /// Greatest reading of pan, radians.
    pub pan_max: f64,
    /// Least reading of tilt, radians.
    pub tilt_min: f64,
    /// Greatest reading of tilt, radians.
    pub tilt_max: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_region {
    const NAME: &'static str = "region";
    const FIRST_SIZE: usize = 16 + 4 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            pan_steps: 1,
            tilt_steps: 1,
            reserved: 0,
            pan_min: 0.0,
            pan_max: 0.0,
            tilt_min: 0.0,
            tilt_max: 0.0,
        }
    }
}

impl From<&ScanRegion> for ptzcal_region {
    fn from(region: &ScanRegion) -> Self {
        let ScanRegion { pan: [pan_min, pan_max], tilt: [tilt_min, tilt_max], pan_steps, tilt_steps } = *region;
        Self { pan_steps, tilt_steps, pan_min, pan_max, tilt_min, tilt_max, ..SizedStruct::initial() }
    }
}

/// What a scan came to.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_scan_summary {
    /// Set by ptzcal_scan_summary_init.
    pub struct_size: u32,
    /// 1 when every position was visited; ptzcal_scan_end says why not.
    pub complete: u32,
    /// Positions of the region.
    pub positions: u64,
    /// Shots taken, those of the journal included.
    pub shots: u64,
    /// Shots read from the journal.
    pub resumed: u64,
    /// Shots whose spot the head camera saw.
    pub found: u64,
    /// Fixed cameras watched.
    pub fixed_cameras: u64,
    /// Records of the journal that were damaged; their positions were measured again.
    pub journal_damaged: u64,
    /// Bytes of an unfinished record that were cut off the journal's end.
    pub journal_cut: u64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_scan_summary {
    const NAME: &'static str = "summary";
    const FIRST_SIZE: usize = 8 + 7 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            complete: 0,
            positions: 0,
            shots: 0,
            resumed: 0,
            found: 0,
            fixed_cameras: 0,
            journal_damaged: 0,
            journal_cut: 0,
        }
    }
}

/// What a scan measured. Immutable: any number of threads may read it.
pub struct ptzcal_scan(pub(super) Scan);

impl Handle for ptzcal_scan {
    const NAME: &'static str = "scan";
}

/// Sets up a region: one position, straight ahead.
///
/// @param region The struct.
/// @param size   sizeof *region.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_region_init(region: *mut ptzcal_region, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(region, size) })
}

/// The region that a recorded scan covers, of a rig that was opened on a recording's folder.
///
/// @param rig    The rig.
/// @param region Receives the region; set up by ptzcal_region_init.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNSUPPORTED for any other rig.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_recorded_region(
    rig: *const ptzcal_rig,
    region: *mut ptzcal_region,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (rig, region) = unsafe { (borrow(rig)?, SizedOut::new(region)?) };
        let none = || Error::Unsupported { what: "the recorded region of a rig that is no recording".into() };
        region.write(&(&rig.whole.as_ref().and_then(WholeRig::region).ok_or_else(none)?).into());
        Ok(())
    })
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
pub unsafe extern "C" fn ptzcal_scan_summary_init(summary: *mut ptzcal_scan_summary, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(summary, size) })
}

/// Scans a region. A scan that ends early (stopped by the callback, cancelled, a device or the
/// journal failed) still returns what it measured: PTZCAL_STATUS_OK with a scan that is not
/// complete, and ptzcal_scan_end says why. However it ends, the laser is off and the head was told to
/// stop.
///
/// @param rig      The rig.
/// @param region   The positions.
/// @param options  The options; may be NULL: the defaults, without fixed cameras.
/// @param progress Hears of each shot and can stop the scan; may be NULL.
/// @param user     Handed to the callback.
/// @param scan     Receives the scan; free it with ptzcal_scan_free.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; and before anything moves PTZCAL_STATUS_INVALID_ARGUMENT,
///         PTZCAL_STATUS_UNREACHABLE for a region out of the head's reach, PTZCAL_STATUS_FILE_IO and
///         its kin for the journal, PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rig_scan_region(
    rig: *mut ptzcal_rig,
    region: *const ptzcal_region,
    options: *const ptzcal_scan_options,
    progress: ptzcal_progress_fn,
    user: *mut c_void,
    scan: *mut *mut ptzcal_scan,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, handle, region, options) =
            unsafe { (HandleOut::new(scan)?, borrow(rig)?, sized::read(region)?, borrow_optional(options)) };
        let region = ScanRegion {
            pan: [region.pan_min, region.pan_max],
            tilt: [region.tilt_min, region.tilt_max],
            pan_steps: region.pan_steps,
            tilt_steps: region.tilt_steps,
        };
        let (mut options, cameras) = match options {
            Some(o) => {
                let settings = o.0.read(ptzcal_scan_options::NAME)?;
                (settings.options.clone(), settings.cameras.clone())
            }
            None => (ScanOptions::default(), Vec::new()),
        };
        let (mut rig, cancel) = handle.work(options.cancel)?;
        options.cancel = cancel;
        let mut fixed = cameras
            .iter()
            .map(|c| c.open(handle.whole.as_ref(), &handle.around))
            .collect::<Result<Vec<FixedCamera>>>()?;
        let (user, begun) = (User::new(user), Instant::now());
        let mut report = |now: &Progress<'_>| {
            let Some(callback) = progress else { return ControlFlow::Continue(()) };
            let shot = now.shot.map(ptzcal_shot::from);
            let message = ptzcal_progress {
                struct_size: size_of::<ptzcal_progress>() as u32,
                pass: now.phase as u32,
                passes: Phase::Fine as u32,
                measured: shot.map_or(0, |s| s.found),
                done: now.done as u64,
                total: now.total as u64,
                elapsed: begun.elapsed().as_secs_f64(),
                seconds_left: now.seconds_left.unwrap_or(-1.0),
                shot: shot.as_ref().map_or(std::ptr::null(), std::ptr::from_ref),
            };
            // SAFETY: the caller keeps the header's rules for callbacks.
            unsafe { message.tell(callback, user) }
        };
        out.give(ptzcal_scan(scan_region(&mut rig, &region, &options, &mut fixed, &mut report)?));
        Ok(())
    })
}

/// Frees a scan.
///
/// @param scan The scan; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_free(scan: *mut ptzcal_scan) {
    // SAFETY: NULL or a live scan that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(scan) });
}

/// What a scan came to.
///
/// @param scan    The scan.
/// @param summary Receives the summary; set up by ptzcal_scan_summary_init.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_get_summary(
    scan: *const ptzcal_scan,
    summary: *mut ptzcal_scan_summary,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (scan, summary) = unsafe { (borrow(scan)?, SizedOut::new(summary)?) };
        let scan = &scan.0;
        let counts = scan.counts();
        summary.write(&ptzcal_scan_summary {
            struct_size: 0,
            complete: u32::from(scan.is_complete()),
            positions: scan.region.len() as u64,
            shots: counts.shots as u64,
            resumed: scan.resumed as u64,
            found: counts.head as u64,
            fixed_cameras: counts.fixed.len() as u64,
            journal_damaged: scan.repair.as_ref().map_or(0, |r| r.damaged as u64),
            journal_cut: scan.repair.as_ref().map_or(0, |r| r.cut_bytes),
        });
        Ok(())
    })
}

/// Image size of a fixed camera of a scan: what ptzcal_correspondences_new wants.
///
/// @param scan   The scan.
/// @param camera The fixed camera's number.
/// @param width  Receives its width, pixels.
/// @param height Receives its height, pixels.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a camera that was not watched.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_camera_size(
    scan: *const ptzcal_scan,
    camera: u32,
    width: *mut u32,
    height: *mut u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (scan, width, height) = unsafe { (borrow(scan)?, Out::new(width, "width")?, Out::new(height, "height")?) };
        let sizes = &scan.0.fixed_sizes;
        let none = || Error::invalid("camera", format!("{camera} of {}", sizes.len()));
        let (w, h) = sizes.get(camera as usize).ok_or_else(none)?;
        width.write(*w);
        height.write(*h);
        Ok(())
    })
}

/// How a scan ended: fails with the reason when it ended before its time.
///
/// @param scan  The scan.
/// @param error Receives the reason; may be NULL.
/// @return PTZCAL_STATUS_OK for a complete scan, and for one that met its target accuracy before
///         (ptzcal_scan_options_set_target_accuracy); PTZCAL_STATUS_CANCELLED when it was stopped or
///         cancelled; the status of the device or file that failed.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_end(scan: *const ptzcal_scan, error: *mut *mut ptzcal_error) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(error, || match &unsafe { borrow(scan)? }.0.end {
        ScanEnd::Complete | ScanEnd::TargetMet => Ok(()),
        ScanEnd::Stopped | ScanEnd::Cancelled => Err(Error::Cancelled),
        ScanEnd::Failed(e) => Err(e.clone()),
    })
}

/// A shot of a scan, in the order in which they were taken.
///
/// @param scan  The scan.
/// @param index From 0 to the number of shots less 1.
/// @param shot  Receives the shot; set up by ptzcal_shot_init.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT when there is no such shot.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_get_shot(
    scan: *const ptzcal_scan,
    index: usize,
    shot: *mut ptzcal_shot,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (scan, shot) = unsafe { (borrow(scan)?, SizedOut::new(shot)?) };
        shot.write(&shot_at(&scan.0, index)?.into());
        Ok(())
    })
}

fn shot_at(scan: &Scan, index: usize) -> Result<&crate::rig::Shot> {
    scan.shots.get(index).ok_or_else(|| Error::invalid("index", format!("{index} of {} shots", scan.shots.len())))
}

/// Where a camera saw the spot of a shot.
///
/// @param scan   The scan.
/// @param index  The shot.
/// @param camera A fixed camera's number, or PTZCAL_HEAD_CAMERA.
/// @param spot   Receives the spot; set up by ptzcal_spot_init.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND or PTZCAL_STATUS_AMBIGUOUS when the camera has no
///         spot for this shot (the message says why); PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_get_spot(
    scan: *const ptzcal_scan,
    index: usize,
    camera: u32,
    spot: *mut ptzcal_spot,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (scan, spot) = unsafe { (borrow(scan)?, SizedOut::new(spot)?) };
        let shot = shot_at(&scan.0, index)?;
        let sighting: &Sighting = if camera == PTZCAL_HEAD_CAMERA {
            &shot.head
        } else {
            let none = || Error::invalid("camera", format!("{camera} of {}", shot.fixed.len()));
            shot.fixed.get(camera as usize).ok_or_else(none)?
        };
        match sighting {
            Ok(found) => spot.write(&found.into()),
            Err(miss) => return Err(miss.error()),
        }
        Ok(())
    })
}

/// Copies the measured points, in the order of the shots; shots without a point are left out.
///
/// @param scan     The scan.
/// @param xyz      Receives 3 numbers a point, metres; may be NULL when capacity is 0.
/// @param capacity Numbers that fit.
/// @param needed   Receives how many numbers there are; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: nothing was copied.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_copy_points(
    scan: *const ptzcal_scan,
    xyz: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (scan, buffer) = unsafe { (borrow(scan)?, BufferOut::new(xyz, capacity, needed)?) };
        let numbers: Vec<f64> =
            scan.0.points().iter().flat_map(|p| [p.position.x, p.position.y, p.position.z]).collect();
        buffer.write(&numbers)
    })
}

/// Adds to a set what the head camera and a fixed camera saw together: the calibration of that
/// camera from this scan.
///
/// @param set    The set, for the camera's image size.
/// @param scan   The scan.
/// @param camera The fixed camera's number.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a camera that was not watched or has
///         another image size; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_correspondences_add_scan(
    set: *mut ptzcal_correspondences,
    scan: *const ptzcal_scan,
    camera: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (set, scan) = unsafe { (borrow(set)?, borrow(scan)?) };
        let seen = scan.0.correspondences(camera as usize)?;
        let mut set = set.0.write(ptzcal_correspondences::NAME)?;
        if (set.width(), set.height()) != (seen.width(), seen.height()) {
            let reason =
                format!("{} x {}, the camera has {} x {}", set.width(), set.height(), seen.width(), seen.height());
            return Err(Error::invalid("set", reason));
        }
        let shots: Vec<Observation> = seen.observations().to_vec();
        set.add_all(shots)
    })
}

/// Adds a plane fitted to the shots of a scan within a range of readings: the scan of a region that
/// shows one plane, or a part of it that does.
///
/// @param edges  The set.
/// @param scan   The scan.
/// @param region The range of readings; its steps do not matter; may be NULL: all shots.
/// @param plane  Receives the plane's number in the set.
/// @param error  Receives the error; may be NULL.
/// @return As ptzcal_roof_edges_add_plane_shots.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_roof_edges_add_plane_scan(
    edges: *mut ptzcal_roof_edges,
    scan: *const ptzcal_scan,
    region: *const ptzcal_region,
    plane: *mut u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (edges, scan, region, plane) = unsafe {
            let region = if region.is_null() { None } else { Some(sized::read(region)?) };
            (borrow(edges)?, borrow(scan)?, region, Out::new(plane, "plane")?)
        };
        let inside = |pan: f64, tilt: f64| {
            region.is_none_or(|r| (r.pan_min..=r.pan_max).contains(&pan) && (r.tilt_min..=r.tilt_max).contains(&tilt))
        };
        let shots: Vec<InverseDepthPoint> =
            (scan.0.shots.iter()).filter(|s| inside(s.pan, s.tilt)).filter_map(|s| s.point.map(|p| p.point)).collect();
        edges.add(fit_plane_to_shots(&shots, &PlaneFitOptions::default())?, plane)
    })
}
