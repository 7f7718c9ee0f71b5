//! Joint adjustment: points
//!
//! Where the laser hit, in the world, with covariances that contain what is not known of the rig, its
//! stations and the cameras.

use nalgebra::{Matrix3, Vector2};

use super::adjusted::ptzcal_adjusted;
use super::args::{ArrayOut, BufferOut, vectors, vectors_optional};
use super::call::{ErrorOut, guard};
use super::error::ptzcal_error;
use super::handle::borrow;
use super::rig_model::covariance2;
use super::status::ptzcal_status;
use crate::error::Result;

/// By rows, which for a covariance is by columns.
fn rows(c: &Matrix3<f64>) -> [f64; 9] {
    let mut rows = [0.0; 9];
    rows.copy_from_slice(c.transpose().as_slice());
    rows
}

/// Which spots of the head camera were used: n bytes, n = the summary's `shots`; 1 for an inlier, 0
/// for an outlier and where the head camera saw none.
///
/// @param adjusted The answer.
/// @param buffer   Receives the bytes; may be NULL when capacity is 0.
/// @param capacity How many bytes the buffer holds.
/// @param needed   Receives how many there are, also when they do not fit; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjusted_copy_head_inliers(
    adjusted: *const ptzcal_adjusted,
    buffer: *mut u8,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjusted, buffer) = unsafe { (borrow(adjusted)?, BufferOut::new(buffer, capacity, needed)?) };
        let inliers: Vec<u8> = adjusted.adjusted.head_inliers.iter().map(|i| u8::from(*i)).collect();
        buffer.write(&inliers)
    })
}

/// Where a shot hit, by all who saw it.
///
/// @param adjusted   The answer.
/// @param shot       The shot's index.
/// @param xyz        Receives 3 numbers: the point in the world, metres.
/// @param covariance Receives 9 numbers: its covariance, row-major, m^2, which contains what is not
///                   known of rig, station and cameras (of rank one, along the beam, when rig and
///                   station are exact); may be NULL.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE for a shot at infinity or one of which no spot
///         was used; PTZCAL_STATUS_INVALID_ARGUMENT when there is no such shot.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjusted_shot_point(
    adjusted: *const ptzcal_adjusted,
    shot: usize,
    xyz: *mut f64,
    covariance: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjusted, xyz, covariance) = unsafe {
            (
                borrow(adjusted)?,
                ArrayOut::vectors::<3>(xyz, 1, "xyz")?,
                ArrayOut::vectors_optional::<9>(covariance, 1, "covariance")?,
            )
        };
        let (point, c) = adjusted.adjusted.shot_point(shot)?;
        xyz.write(&[point.into()]);
        if let Some(covariance) = covariance {
            covariance.write(&[rows(&c)]);
        }
        Ok(())
    })
}

/// Measures new spots of the head camera with the adjusted rig.
///
/// @param adjusted        The answer.
/// @param station         Where the rig stands.
/// @param pan_tilt        n x 2 numbers: readings at each shot, radians.
/// @param spots           n x 2 numbers: the spot's pixel in the head camera.
/// @param spot_covariance n x 3 numbers: xx, xy, yy, px^2; may be NULL: 1 px, uncorrelated.
/// @param n               Number of shots.
/// @param xyz             Receives n x 3 numbers: points in the world, metres.
/// @param covariance      Receives n x 9 numbers: covariance of each point, row-major, m^2, those of
///                        rig and station included; may be NULL.
/// @param error           Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE for a spot at or beyond infinity;
///         PTZCAL_STATUS_NOT_FINITE (index: the shot); PTZCAL_STATUS_INVALID_ARGUMENT for a station
///         that does not exist, a spot outside the lens model or a covariance that is none.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjusted_measure(
    adjusted: *const ptzcal_adjusted,
    station: u32,
    pan_tilt: *const f64,
    spots: *const f64,
    spot_covariance: *const f64,
    n: usize,
    xyz: *mut f64,
    covariance: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjusted, pan_tilt, spots, spot_covariance, xyz, covariance) = unsafe {
            (
                borrow(adjusted)?,
                vectors::<2>(pan_tilt, n, "pan_tilt")?,
                vectors::<2>(spots, n, "spots")?,
                vectors_optional::<3>(spot_covariance, n, "spot_covariance")?,
                ArrayOut::vectors::<3>(xyz, n, "xyz")?,
                ArrayOut::vectors_optional::<9>(covariance, n, "covariance")?,
            )
        };
        let measure = |(i, ([pan, tilt], spot)): (usize, (&[f64; 2], &[f64; 2]))| {
            let noise = covariance2(spot_covariance.map(|c| &c[i]));
            let (point, c) = adjusted.adjusted.measure(station as usize, *pan, *tilt, &Vector2::from(*spot), &noise)?;
            Ok(([point.x, point.y, point.z], rows(&c)))
        };
        let measured = pan_tilt.iter().zip(spots).enumerate().map(measure).collect::<Result<Vec<_>>>()?;
        let (points, covariances): (Vec<[f64; 3]>, Vec<[f64; 9]>) = measured.into_iter().unzip();
        xyz.write(&points);
        if let Some(covariance) = covariance {
            covariance.write(&covariances);
        }
        Ok(())
    })
}
