//! Set-ups: a site with noiseless shots
//!
//! The data set of a noise study: what both cameras would see of every shot without noise (thesis VII.2). It
//! comes from the site's surroundings, from a scan whose points are taken for true, or from any points.

use nalgebra::Vector3;

use super::args::{Out, vectors};
use super::call::{ErrorOut, guard, guard_or};
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, free};
use super::scan::{ptzcal_region, ptzcal_scan};
use super::site::ptzcal_site;
use super::sized;
use super::status::ptzcal_status;
use crate::error::Result;
use crate::rig::ScanRegion;
use crate::study::SetUp;

/// A site with its noiseless shots.
pub struct ptzcal_set_up(pub(super) Exclusive<SetUp>);

impl Handle for ptzcal_set_up {
    const NAME: &'static str = "set-up";
}

/// # Safety
/// `region` is NULL or a region set up by ptzcal_region_init.
pub(super) unsafe fn region_in(region: *const ptzcal_region) -> Result<ScanRegion> {
    // SAFETY: by this function's contract.
    let r = unsafe { sized::read(region)? };
    let region = ScanRegion {
        pan: [r.pan_min, r.pan_max],
        tilt: [r.tilt_min, r.tilt_max],
        pan_steps: r.pan_steps,
        tilt_steps: r.tilt_steps,
    };
    region.validate()?;
    Ok(region)
}

/// The shots of a region that both cameras would see in the site's surroundings.
///
/// @param site   The site.
/// @param region The positions.
/// @param set_up Receives the set-up; free it with ptzcal_set_up_free.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BAD_STATE for a site without surroundings;
///         PTZCAL_STATUS_TOO_FEW_POINTS when fewer than six are in view; PTZCAL_STATUS_INVALID_ARGUMENT;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_set_up_from_region(
    site: *const ptzcal_site,
    region: *const ptzcal_region,
    set_up: *mut *mut ptzcal_set_up,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, site, region) = unsafe { (HandleOut::new(set_up)?, borrow(site)?, region_in(region)?) };
        let held = site.0.read(ptzcal_site::NAME)?;
        out.give(ptzcal_set_up(Exclusive::new(SetUp::from_scene(held.site.clone(), &region, held.scene()?)?)));
        Ok(())
    })
}

/// The points of a scan, taken for true and projected anew into both cameras; those that are not in view of
/// both are left out.
///
/// @param site   The site; its camera is where the scan's fixed camera was found, its rig the scan's.
/// @param scan   The scan.
/// @param set_up Receives the set-up; free it with ptzcal_set_up_free.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_set_up_from_scan(
    site: *const ptzcal_site,
    scan: *const ptzcal_scan,
    set_up: *mut *mut ptzcal_set_up,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, site, scan) = unsafe { (HandleOut::new(set_up)?, borrow(site)?, borrow(scan)?) };
        let found = scan.0.shots.iter().filter_map(|s| Some([s.pan, s.tilt, 1.0 / s.point.as_ref()?.point.rho]));
        let in_front: Vec<[f64; 3]> = found.filter(|[.., depth]| *depth > 0.0 && depth.is_finite()).collect();
        let held = site.0.read(ptzcal_site::NAME)?;
        out.give(ptzcal_set_up(Exclusive::new(SetUp::from_scan(held.site.clone(), &in_front)?)));
        Ok(())
    })
}

/// Points at which the laser is aimed; those out of its reach or not in view of both cameras are left out.
///
/// @param site   The site.
/// @param xyz    n points in the rig's frame, metres.
/// @param n      Points, 1,000,000 at most.
/// @param set_up Receives the set-up; free it with ptzcal_set_up_free.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NOT_FINITE (index: the point);
///         PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_set_up_from_points(
    site: *const ptzcal_site,
    xyz: *const f64,
    n: usize,
    set_up: *mut *mut ptzcal_set_up,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, site, xyz) = unsafe { (HandleOut::new(set_up)?, borrow(site)?, vectors::<3>(xyz, n, "xyz")?) };
        let points: Vec<Vector3<f64>> = xyz.iter().map(|x| Vector3::from(*x)).collect();
        let held = site.0.read(ptzcal_site::NAME)?;
        out.give(ptzcal_set_up(Exclusive::new(SetUp::from_points(held.site.clone(), &points)?)));
        Ok(())
    })
}

/// Gives the points by which the cascade as printed (PTZCAL_STUDY_METHOD_DLT_CASCADE_PRINTED) finds the head
/// camera's pose: the corners of the thesis's boards. No other method needs them.
///
/// @param set_up The set-up.
/// @param xyz    n points in the rig's frame, metres, in front of the head camera at pan = tilt = 0.
/// @param n      Points.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE (index: the point); PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_set_up_set_control(
    set_up: *mut ptzcal_set_up,
    xyz: *const f64,
    n: usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (set_up, xyz) = unsafe { (borrow(set_up)?, vectors::<3>(xyz, n, "xyz")?) };
        set_up.0.write(ptzcal_set_up::NAME)?.control = xyz.iter().map(|x| Vector3::from(*x)).collect();
        Ok(())
    })
}

/// The number of shots that both cameras see.
///
/// @param set_up The set-up.
/// @param count  Receives the number.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_set_up_get_count(
    set_up: *const ptzcal_set_up,
    count: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (set_up, count) = unsafe { (borrow(set_up)?, Out::new(count, "count")?) };
        count.write(set_up.0.read(ptzcal_set_up::NAME)?.shots.len());
        Ok(())
    })
}

/// Frees a set-up.
///
/// @param set_up The set-up; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_set_up_free(set_up: *mut ptzcal_set_up) {
    // SAFETY: NULL or a live set-up that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(set_up) });
}
