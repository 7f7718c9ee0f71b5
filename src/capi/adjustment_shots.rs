//! Joint adjustment: what was measured
//!
//! Laser shots with the spots that the head camera and the fixed cameras saw of them. A shot needs
//! no spot in the head camera: two cameras that see it measure it too.

use nalgebra::Vector2;

use super::adjustment::ptzcal_adjustment;
use super::args::{Out, array, vectors, vectors_optional};
use super::call::{ErrorOut, guard};
use super::error::ptzcal_error;
use super::handle::{Handle, borrow};
use super::rig_model::covariance2;
use super::scan::ptzcal_scan;
use super::status::ptzcal_status;
use crate::adjust::{Shot, Sighting};

/// For ptzcal_adjustment_add_scan: a fixed camera whose spots are left out.
pub const PTZCAL_NO_CAMERA: u32 = 4294967294;

/// Adds laser shots: what the head read and where its camera saw the spot.
///
/// @param adjustment      The survey.
/// @param station         Where the rig stood.
/// @param pan_tilt        n x 2 numbers: readings at each shot, radians.
/// @param spots           n x 2 numbers: the spot's pixel in the head camera; may be NULL: the head
///                        camera saw none of them.
/// @param spot_covariance n x 3 numbers: xx, xy, yy, positive definite, px^2; may be NULL: 1 px,
///                        uncorrelated.
/// @param seen            n bytes: 0 where the head camera saw no spot, and what stands in `spots`
///                        does not matter (but is finite); may be NULL: it saw all.
/// @param n               Number of shots.
/// @param first           Receives the index of the first; the others follow it; may be NULL.
/// @param error           Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE (index: the shot, in this call);
///         PTZCAL_STATUS_INVALID_ARGUMENT for a station that does not exist or a covariance that is
///         none; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjustment_add_shots(
    adjustment: *mut ptzcal_adjustment,
    station: u32,
    pan_tilt: *const f64,
    spots: *const f64,
    spot_covariance: *const f64,
    seen: *const u8,
    n: usize,
    first: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjustment, pan_tilt, spots, spot_covariance, seen, first) = unsafe {
            (
                borrow(adjustment)?,
                vectors::<2>(pan_tilt, n, "pan_tilt")?,
                vectors_optional::<2>(spots, n, "spots")?,
                vectors_optional::<3>(spot_covariance, n, "spot_covariance")?,
                if seen.is_null() { None } else { Some(array(seen, n, "seen")?) },
                Out::optional(first, "first")?,
            )
        };
        let shots = pan_tilt.iter().enumerate().map(|(i, [pan, tilt])| Shot {
            station: station as usize,
            pan: *pan,
            tilt: *tilt,
            head: spots
                .filter(|_| seen.is_none_or(|seen| seen[i] != 0))
                .map(|spots| (Vector2::from(spots[i]), covariance2(spot_covariance.map(|c| &c[i])))),
            sightings: Vec::new(),
        });
        let added = adjustment.0.write(ptzcal_adjustment::NAME)?.add_shots(shots)?;
        if let Some(first) = first {
            first.write(added);
        }
        Ok(())
    })
}

/// Adds where a fixed camera saw shots that were added before. The residuals and inliers of its
/// calibration are in the order of the shots.
///
/// @param adjustment    The survey.
/// @param camera        The fixed camera.
/// @param shots         n indices of shots; a camera sees each at most once.
/// @param uv            n x 2 numbers: the spot's pixel in the camera.
/// @param uv_covariance n x 3 numbers: xx, xy, yy, positive definite, px^2; may be NULL: 1 px,
///                      uncorrelated.
/// @param n             Number of sightings.
/// @param error         Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE (index: the sighting, in this call);
///         PTZCAL_STATUS_INVALID_ARGUMENT for a camera or a shot that does not exist, a shot that is
///         seen twice, or a covariance that is none; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjustment_add_sightings(
    adjustment: *mut ptzcal_adjustment,
    camera: u32,
    shots: *const usize,
    uv: *const f64,
    uv_covariance: *const f64,
    n: usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjustment, shots, uv, uv_covariance) = unsafe {
            (
                borrow(adjustment)?,
                array(shots, n, "shots")?,
                vectors::<2>(uv, n, "uv")?,
                vectors_optional::<3>(uv_covariance, n, "uv_covariance")?,
            )
        };
        let sighting = |(i, (shot, pixel)): (usize, (&usize, &[f64; 2]))| {
            let covariance = covariance2(uv_covariance.map(|c| &c[i]));
            (*shot, Sighting { camera: camera as usize, pixel: Vector2::from(*pixel), covariance })
        };
        let sightings: Vec<(usize, Sighting)> = shots.iter().zip(uv).enumerate().map(sighting).collect();
        adjustment.0.write(ptzcal_adjustment::NAME)?.add_sightings(&sightings)
    })
}

/// Adds all shots of a scan, with what the head camera and the fixed cameras saw: shot i of the scan
/// becomes shot `first` + i.
///
/// @param adjustment The survey, for a head camera of the scan's image size.
/// @param station    Where the rig stood during the scan.
/// @param scan       The scan.
/// @param cameras    For each fixed camera of the scan its index in the survey (of the same image
///                   size), or PTZCAL_NO_CAMERA.
/// @param n          Number of fixed cameras of the scan.
/// @param first      Receives the index of the scan's first shot; may be NULL.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a station or a camera that does not
///         exist, another number of cameras, or another image size; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjustment_add_scan(
    adjustment: *mut ptzcal_adjustment,
    station: u32,
    scan: *const ptzcal_scan,
    cameras: *const u32,
    n: usize,
    first: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjustment, scan, cameras, first) = unsafe {
            (borrow(adjustment)?, borrow(scan)?, array(cameras, n, "cameras")?, Out::optional(first, "first")?)
        };
        let cameras: Vec<Option<usize>> =
            cameras.iter().map(|c| (*c != PTZCAL_NO_CAMERA).then_some(*c as usize)).collect();
        let mut adjustment = adjustment.0.write(ptzcal_adjustment::NAME)?;
        let added = scan.0.add_to(&mut adjustment, station as usize, &cameras)?;
        if let Some(first) = first {
            first.write(added);
        }
        Ok(())
    })
}
