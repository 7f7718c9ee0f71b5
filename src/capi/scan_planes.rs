//! Planes of a scan
//!
//! A scan as it is: its shots need not be copied. The frame is the rig's. Labels (ptzcal_planes_copy_labels)
//! are those of the scan's shots, in their order; a shot that measured no depth has -1.

use super::args::vectors;
use super::call::{ErrorOut, guard};
use super::error::ptzcal_error;
use super::handle::{HandleOut, borrow};
use super::plane_regions::{corners_in, count_in};
use super::planes::{ptzcal_planes, ptzcal_planes_options};
use super::scan::ptzcal_scan;
use super::status::ptzcal_status;
use crate::rig::ScanPart;

/// Finds the planes that a scan shows.
///
/// @param scan    The scan.
/// @param options The options; may be NULL: the defaults.
/// @param planes  Receives the planes; free them with ptzcal_planes_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NOT_FOUND when there is no plane;
///         PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_planes_find_scan(
    scan: *const ptzcal_scan,
    options: *const ptzcal_planes_options,
    planes: *mut *mut ptzcal_planes,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (planes, scan, options) =
            unsafe { (HandleOut::new(planes)?, borrow(scan)?, ptzcal_planes_options::settings(options)?) };
        planes.give(ptzcal_planes(scan.0.find_planes(&options)?));
        Ok(())
    })
}

/// Fits one plane to the shots of a scan whose readings lie in a range, for each of several ranges. Up to half
/// of them may have hit something else.
///
/// @param scan     The scan.
/// @param readings 4 numbers a region: least and greatest pan, least and greatest tilt, radians, ends included.
/// @param regions  Number of regions, 1 to 1000.
/// @param options  The options; may be NULL: the defaults.
/// @param planes   Receives the planes, in the order of the regions; free them with ptzcal_planes_free.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NO_CONSENSUS when half of a region
///         is on no plane; PTZCAL_STATUS_DEGENERATE for a region on one line or a plane through the
///         rig; PTZCAL_STATUS_INVALID_ARGUMENT, also for a range that ends before it begins;
///         PTZCAL_STATUS_NOT_FINITE. The error's index is the region's number.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_planes_fit_scan(
    scan: *const ptzcal_scan,
    readings: *const f64,
    regions: u32,
    options: *const ptzcal_planes_options,
    planes: *mut *mut ptzcal_planes,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (planes, scan, readings, options) = unsafe {
            (
                HandleOut::new(planes)?,
                borrow(scan)?,
                vectors::<4>(readings, count_in(regions)?, "readings")?,
                ptzcal_planes_options::settings(options)?,
            )
        };
        let part = |[a, b, c, d]: &[f64; 4]| ScanPart::Readings { pan: [*a, *b], tilt: [*c, *d] };
        let parts: Vec<ScanPart> = readings.iter().map(part).collect();
        planes.give(ptzcal_planes(scan.0.fit_planes(&parts, &options)?));
        Ok(())
    })
}

/// Fits one plane to the shots of a scan that hit something in a box, for each of several boxes. Up to half of
/// them may have hit something else.
///
/// @param scan    The scan.
/// @param boxes   6 numbers a region: least x, y, z of a box, then greatest, metres, in the rig's frame.
/// @param regions Number of boxes, 1 to 1000.
/// @param options The options; may be NULL: the defaults.
/// @param planes  Receives the planes, in the order of the boxes; free them with ptzcal_planes_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NO_CONSENSUS when half of a region
///         is on no plane; PTZCAL_STATUS_DEGENERATE for a region on one line or a plane through the
///         rig; PTZCAL_STATUS_INVALID_ARGUMENT, also for a box without inside;
///         PTZCAL_STATUS_NOT_FINITE. The error's index is the box's number.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_planes_fit_scan_in_boxes(
    scan: *const ptzcal_scan,
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
        let (planes, scan, boxes, options) = unsafe {
            (
                HandleOut::new(planes)?,
                borrow(scan)?,
                corners_in(boxes, regions)?,
                ptzcal_planes_options::settings(options)?,
            )
        };
        let parts: Vec<ScanPart> = boxes.into_iter().map(ScanPart::Box).collect();
        planes.give(ptzcal_planes(scan.0.fit_planes(&parts, &options)?));
        Ok(())
    })
}
