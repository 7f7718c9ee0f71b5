//! Planes of regions
//!
//! One plane for each part of a cloud or of laser shots that you name, in the order of naming: by a number
//! for each measurement, or by boxes.

use nalgebra::Vector3;

use super::args::{array, vectors};
use super::call::{ErrorOut, guard};
use super::error::ptzcal_error;
use super::handle::HandleOut;
use super::planes::{points_in, ptzcal_planes, ptzcal_planes_options, shots_in, sigma_in};
use super::rig_model::{model_in, ptzcal_rig_model};
use super::status::ptzcal_status;
use crate::error::{Error, Result};
use crate::pose::{PlaneRegion, fit_regions_of_points, fit_regions_of_shots};

/// Most regions of a call.
const MAX_REGIONS: u32 = 1000;

pub(super) fn count_in(regions: u32) -> Result<usize> {
    if !(1..=MAX_REGIONS).contains(&regions) {
        return Err(Error::invalid("regions", format!("{regions} is not in 1 to {MAX_REGIONS}")));
    }
    Ok(regions as usize)
}

/// The caller's regions: the number of each measurement's, -1 for none.
///
/// # Safety
/// As for [`array`].
unsafe fn named(region_of: *const i32, n: usize, regions: u32) -> Result<Vec<PlaneRegion>> {
    // SAFETY: by this function's contract.
    let region_of = unsafe { array(region_of, n, "region_of")? };
    let count = count_in(regions)?;
    let mut named = vec![Vec::new(); count];
    for (i, k) in region_of.iter().enumerate() {
        match usize::try_from(*k) {
            Ok(k) if k < count => named[k].push(i),
            _ if *k == -1 => {}
            _ => return Err(Error::invalid("region_of", format!("measurement {i}: {k} is no region"))),
        }
    }
    Ok(named.into_iter().map(PlaneRegion::Indices).collect())
}

/// The caller's boxes: least x, y, z, then greatest.
///
/// # Safety
/// As for [`vectors`], with 6 numbers a region.
pub(super) unsafe fn corners_in(boxes: *const f64, regions: u32) -> Result<Vec<[Vector3<f64>; 2]>> {
    // SAFETY: by this function's contract.
    let boxes = unsafe { vectors::<6>(boxes, count_in(regions)?, "boxes")? };
    Ok(boxes.iter().map(|[a, b, c, d, e, f]| [Vector3::new(*a, *b, *c), Vector3::new(*d, *e, *f)]).collect())
}

/// The same as regions of measurements.
///
/// # Safety
/// As for [`corners_in`].
unsafe fn boxes_in(boxes: *const f64, regions: u32) -> Result<Vec<PlaneRegion>> {
    // SAFETY: by this function's contract.
    Ok(unsafe { corners_in(boxes, regions)? }.into_iter().map(PlaneRegion::Box).collect())
}

/// Fits one plane to each region of a cloud of points. Up to half of a region may be something else.
///
/// @param xyz     n x 3 numbers: points, metres; they may be infinite or NaN: those are passed over.
/// @param n       Number of points.
/// @param sigma   Standard deviation of the points in each direction, metres; 0: estimated from how far
///                they are from their planes.
/// @param region_of n numbers: the region of each point, from 0; -1: of none.
/// @param regions Number of regions, 1 to 1000.
/// @param options The options; may be NULL: the defaults.
/// @param planes  Receives the planes; free them with ptzcal_planes_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NO_CONSENSUS when half of a region
///         is on no plane; PTZCAL_STATUS_DEGENERATE for a region on one line or a plane through the
///         station; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE. The error's index is the
///         region's number.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_planes_fit_points(
    xyz: *const f64,
    n: usize,
    sigma: f64,
    region_of: *const i32,
    regions: u32,
    options: *const ptzcal_planes_options,
    planes: *mut *mut ptzcal_planes,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (planes, points, regions, options) = unsafe {
            (
                HandleOut::new(planes)?,
                points_in(xyz, n)?,
                named(region_of, n, regions)?,
                ptzcal_planes_options::settings(options)?,
            )
        };
        planes.give(ptzcal_planes(fit_regions_of_points(points, sigma_in(sigma)?, &regions, &options)?));
        Ok(())
    })
}

/// Fits one plane to what each of several boxes holds of a cloud of points. Up to half of that may be
/// something else.
///
/// @param xyz     n x 3 numbers: points, metres; they may be infinite or NaN: those are passed over.
/// @param n       Number of points.
/// @param sigma   Standard deviation of the points in each direction, metres; 0: estimated from how far
///                they are from their planes.
/// @param boxes   6 numbers a region: least x, y, z of a box, then greatest, metres, in the station's frame.
/// @param regions Number of boxes, 1 to 1000.
/// @param options The options; may be NULL: the defaults.
/// @param planes  Receives the planes; free them with ptzcal_planes_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NO_CONSENSUS when half of a region
///         is on no plane; PTZCAL_STATUS_DEGENERATE for a region on one line or a plane through the
///         station; PTZCAL_STATUS_INVALID_ARGUMENT, also for a box without inside; PTZCAL_STATUS_NOT_FINITE. The
///         error's index is the box's number.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_planes_fit_points_in_boxes(
    xyz: *const f64,
    n: usize,
    sigma: f64,
    boxes: *const f64,
    regions: u32,
    options: *const ptzcal_planes_options,
    planes: *mut *mut ptzcal_planes,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (planes, points, regions, options) = unsafe {
            (
                HandleOut::new(planes)?,
                points_in(xyz, n)?,
                boxes_in(boxes, regions)?,
                ptzcal_planes_options::settings(options)?,
            )
        };
        planes.give(ptzcal_planes(fit_regions_of_points(points, sigma_in(sigma)?, &regions, &options)?));
        Ok(())
    })
}

/// Fits one plane to each region of laser shots. Up to half of a region may be something else.
///
/// @param model           The rig model.
/// @param pan_tilt        n x 2 numbers: readings at each shot, radians.
/// @param spots           n x 2 numbers: the spot's pixel in the head camera.
/// @param spot_covariance n x 3 numbers: xx, xy, yy, px^2; may be NULL: 1 px, uncorrelated.
/// @param n               Number of shots.
/// @param region_of       n numbers: the region of each shot, from 0; -1: of none.
/// @param regions         Number of regions, 1 to 1000.
/// @param options         The options; may be NULL: the defaults.
/// @param planes          Receives the planes; free them with ptzcal_planes_free.
/// @param error           Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NO_CONSENSUS when half of a region
///         is on no plane; PTZCAL_STATUS_DEGENERATE for a region on one line or a plane through the
///         station; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE. The error's index is the
///         region's number.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_planes_fit_shots(
    model: *const ptzcal_rig_model,
    pan_tilt: *const f64,
    spots: *const f64,
    spot_covariance: *const f64,
    n: usize,
    region_of: *const i32,
    regions: u32,
    options: *const ptzcal_planes_options,
    planes: *mut *mut ptzcal_planes,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (planes, options) = unsafe { (HandleOut::new(planes)?, ptzcal_planes_options::settings(options)?) };
        // SAFETY: the caller keeps the header's rules for pointers.
        let (regions, shots) = unsafe {
            (named(region_of, n, regions)?, shots_in(&model_in(model)?, pan_tilt, spots, spot_covariance, n)?)
        };
        planes.give(ptzcal_planes(fit_regions_of_shots(&shots, &regions, &options)?));
        Ok(())
    })
}

/// Fits one plane to what each of several boxes holds of laser shots. Up to half of that may be something
/// else.
///
/// @param model           The rig model.
/// @param pan_tilt        n x 2 numbers: readings at each shot, radians.
/// @param spots           n x 2 numbers: the spot's pixel in the head camera.
/// @param spot_covariance n x 3 numbers: xx, xy, yy, px^2; may be NULL: 1 px, uncorrelated.
/// @param n               Number of shots.
/// @param boxes           6 numbers a region: least x, y, z of a box, then greatest, metres, in the rig's
///                        frame.
/// @param regions         Number of boxes, 1 to 1000.
/// @param options         The options; may be NULL: the defaults.
/// @param planes          Receives the planes; free them with ptzcal_planes_free.
/// @param error           Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NO_CONSENSUS when half of a region
///         is on no plane; PTZCAL_STATUS_DEGENERATE for a region on one line or a plane through the
///         station; PTZCAL_STATUS_INVALID_ARGUMENT, also for a box without inside; PTZCAL_STATUS_NOT_FINITE. The
///         error's index is the box's number.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_planes_fit_shots_in_boxes(
    model: *const ptzcal_rig_model,
    pan_tilt: *const f64,
    spots: *const f64,
    spot_covariance: *const f64,
    n: usize,
    boxes: *const f64,
    regions: u32,
    options: *const ptzcal_planes_options,
    planes: *mut *mut ptzcal_planes,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (planes, options) = unsafe { (HandleOut::new(planes)?, ptzcal_planes_options::settings(options)?) };
        // SAFETY: the caller keeps the header's rules for pointers.
        let (regions, shots) =
            unsafe { (boxes_in(boxes, regions)?, shots_in(&model_in(model)?, pan_tilt, spots, spot_covariance, n)?) };
        planes.give(ptzcal_planes(fit_regions_of_shots(&shots, &regions, &options)?));
        Ok(())
    })
}
