//! Joint adjustment: planes
//!
//! Walls, floors, sides of furniture: surfaces that shots of several stations hit. Where each plane lies is
//! found with the rest; a station that shares three planes across each other with another one needs no
//! known pose and no camera in common with it. Planes count from 0 in the order of adding.

use super::adjusted::ptzcal_adjusted;
use super::adjustment::ptzcal_adjustment;
use super::args::{ArrayOut, BufferOut, Out, array};
use super::call::{ErrorOut, guard};
use super::error::ptzcal_error;
use super::handle::{Handle, borrow};
use super::status::ptzcal_status;
use crate::error::Error;

/// For ptzcal_adjustment_set_planes: a shot that hit none.
pub const PTZCAL_NO_PLANE: u32 = 4294967295;

/// Adds a plane, whose place is found.
///
/// @param adjustment The survey.
/// @param flatness   How far its surface strays from it: standard deviation, 1e-6 to 1 m. A painted wall
///                   has about 0.002.
/// @param plane      Receives its index; may be NULL.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for another flatness; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjustment_add_plane(
    adjustment: *mut ptzcal_adjustment,
    flatness: f64,
    plane: *mut u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjustment, plane) = unsafe { (borrow(adjustment)?, Out::optional(plane, "plane")?) };
        let flatness = super::args::number(flatness, "flatness")?;
        let added = adjustment.0.write(ptzcal_adjustment::NAME)?.add_plane(flatness)?;
        if let Some(plane) = plane {
            plane.write(added as u32);
        }
        Ok(())
    })
}

/// Says which plane each of several shots hit. Where that is wrong, it is set aside like any other outlier.
///
/// @param adjustment The survey.
/// @param first      The first shot; the others follow it.
/// @param hits       n indices of planes, or PTZCAL_NO_PLANE.
/// @param n          Number of shots.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a shot or a plane that does not exist and
///         for a shot that was said to hit one already (none is taken then); PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjustment_set_planes(
    adjustment: *mut ptzcal_adjustment,
    first: usize,
    hits: *const u32,
    n: usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjustment, hits) = unsafe { (borrow(adjustment)?, array(hits, n, "hits")?) };
        let mut adjustment = adjustment.0.write(ptzcal_adjustment::NAME)?;
        if first.checked_add(n).is_none_or(|end| end > adjustment.shots().len()) {
            let detail = format!("{n} from {first} on, of {}", adjustment.shots().len());
            return Err(Error::invalid("shots", detail));
        }
        let hits = hits.iter().enumerate().filter(|(_, plane)| **plane != PTZCAL_NO_PLANE);
        adjustment.set_planes(hits.map(|(i, plane)| (first + i, *plane as usize)))
    })
}

/// A plane of the scene in the world: normal . X = distance.
///
/// @param adjusted   The answer.
/// @param plane      The plane's index.
/// @param values     Receives 4 numbers: its unit normal and its distance from the origin, metres.
/// @param covariance Receives 16 numbers: the covariance of these, row-major; the normal moves only across
///                   itself, so that its rank is three; may be NULL.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT when there is no such plane.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjusted_get_plane(
    adjusted: *const ptzcal_adjusted,
    plane: u32,
    values: *mut f64,
    covariance: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjusted, values, covariance) = unsafe {
            (
                borrow(adjusted)?,
                ArrayOut::vectors::<4>(values, 1, "values")?,
                ArrayOut::vectors_optional::<16>(covariance, 1, "covariance")?,
            )
        };
        let adjusted = &adjusted.adjusted;
        let c = adjusted.plane_covariance(plane as usize)?;
        let found = adjusted.planes[plane as usize];
        values.write(&[[found.normal.x, found.normal.y, found.normal.z, found.distance]]);
        if let Some(covariance) = covariance {
            // Symmetric: by columns is by rows.
            covariance.write(&[std::array::from_fn(|i| c.as_slice()[i])]);
        }
        Ok(())
    })
}

/// Which shots hit the plane that they were said to hit: one byte a shot, 1 where the answer uses it, 0
/// where it was set aside or no plane was named.
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
pub unsafe extern "C" fn ptzcal_adjusted_copy_plane_inliers(
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
        let inliers: Vec<u8> = adjusted.adjusted.plane_inliers.iter().map(|i| u8::from(*i)).collect();
        buffer.write(&inliers)
    })
}
