//! 2D-3D measurements
//!
//! What a camera is calibrated from: a growing set of measurements of one camera, in any mixture of
//! points whose position is known, points with covariances, laser shots of a rig, and straight lines.
//! Each function that adds does it for all its measurements or for none. Indices count from 0 in the order of
//! adding, and the results of a calibration keep that order. A set takes 10,000,000 measurements at most.

use nalgebra::{Matrix3, Matrix6, Vector2, Vector3};

use super::args::{Out, vectors, vectors_optional};
use super::call::{ErrorOut, guard, guard_or};
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, free};
use super::rig_model::{covariance2, model_in, ptzcal_rig_model};
use super::status::ptzcal_status;
use crate::calibrate::{Correspondences, Observation, ObservedLine};

/// 2D-3D measurements of one camera.
pub struct ptzcal_correspondences(pub(super) Exclusive<Correspondences>);

impl Handle for ptzcal_correspondences {
    const NAME: &'static str = "set";
}

/// Makes an empty set for a camera with the given image size.
///
/// @param image_width  Pixels, 1 to 65536.
/// @param image_height Pixels, 1 to 65536.
/// @param set          Receives the set; free it with ptzcal_correspondences_free.
/// @param error        Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_correspondences_new(
    image_width: u32,
    image_height: u32,
    set: *mut *mut ptzcal_correspondences,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let set = unsafe { HandleOut::new(set)? };
        set.give(ptzcal_correspondences(Exclusive::new(Correspondences::new(image_width, image_height)?)));
        Ok(())
    })
}

/// Frees a set. Calibrations made from it live on.
///
/// @param set The set; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_correspondences_free(set: *mut ptzcal_correspondences) {
    // SAFETY: NULL or a live set that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(set) });
}

/// Adds points whose 3D position is exact (surveyed, or far better known than a pixel).
///
/// @param set   The set.
/// @param xyz   n x 3 numbers: points, metres, world frame.
/// @param uv    n x 2 numbers: their pixels; (0, 0) is the centre of the top-left pixel.
/// @param n     Number of points.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE (index: the point, in this call);
///         PTZCAL_STATUS_INVALID_ARGUMENT for more than a set takes; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_correspondences_add_points(
    set: *mut ptzcal_correspondences,
    xyz: *const f64,
    uv: *const f64,
    n: usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers; no covariances is one of them.
    unsafe { ptzcal_correspondences_add_points_weighted(set, xyz, std::ptr::null(), uv, std::ptr::null(), n, error) }
}

/// Adds points with the covariances of their 3D positions, of their pixels, or of both.
///
/// @param set            The set.
/// @param xyz            n x 3 numbers: points, metres, world frame.
/// @param xyz_covariance n x 9 numbers: of each point, row-major, symmetric, positive semi-definite,
///                       m^2; may be NULL: the points are exact.
/// @param uv             n x 2 numbers: their pixels.
/// @param uv_covariance  n x 3 numbers: xx, xy, yy of each pixel, positive definite, px^2; may be
///                       NULL: the calibration's pixel noise.
/// @param n              Number of points.
/// @param error          Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE (index: the point, in this call);
///         PTZCAL_STATUS_INVALID_ARGUMENT for a covariance that is none; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_correspondences_add_points_weighted(
    set: *mut ptzcal_correspondences,
    xyz: *const f64,
    xyz_covariance: *const f64,
    uv: *const f64,
    uv_covariance: *const f64,
    n: usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (set, xyz, xyz_covariance, uv, uv_covariance) = unsafe {
            (
                borrow(set)?,
                vectors::<3>(xyz, n, "xyz")?,
                vectors_optional::<9>(xyz_covariance, n, "xyz_covariance")?,
                vectors::<2>(uv, n, "uv")?,
                vectors_optional::<3>(uv_covariance, n, "uv_covariance")?,
            )
        };
        let points = xyz.iter().zip(uv).enumerate().map(|(i, (world, pixel))| Observation::Point {
            world: Vector3::from(*world),
            world_covariance: xyz_covariance.map(|c| Matrix3::from_row_slice(&c[i])),
            pixel: Vector2::from(*pixel),
            pixel_covariance: uv_covariance.map(|c| covariance2(Some(&c[i]))),
        });
        set.0.write(ptzcal_correspondences::NAME)?.add_all(points)
    })
}

/// Adds laser shots: what the rig's head read and saw, and where this camera saw the spot. The
/// solver then knows each point by its ray and its inverse depth, whose noise, unlike that of the
/// depth, is Gaussian; this is what makes the calibration as good as the shots are.
///
/// @param set             The set. Its world becomes the rig's.
/// @param model           The rig model.
/// @param pan_tilt        n x 2 numbers: readings at each shot, radians.
/// @param spots           n x 2 numbers: the spot's pixel in the head camera.
/// @param spot_covariance n x 3 numbers: xx, xy, yy, px^2; may be NULL: 1 px, uncorrelated.
/// @param uv              n x 2 numbers: the spot's pixel in the camera to be calibrated.
/// @param uv_covariance   n x 3 numbers: xx, xy, yy, px^2; may be NULL: 1 px, uncorrelated.
/// @param n               Number of shots.
/// @param error           Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE (index: the shot, in this call);
///         PTZCAL_STATUS_INVALID_ARGUMENT for a spot outside the rig's lens model or a covariance
///         that is none; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_correspondences_add_laser_shots(
    set: *mut ptzcal_correspondences,
    model: *const ptzcal_rig_model,
    pan_tilt: *const f64,
    spots: *const f64,
    spot_covariance: *const f64,
    uv: *const f64,
    uv_covariance: *const f64,
    n: usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (set, model, pan_tilt, spots, spot_covariance, uv, uv_covariance) = unsafe {
            (
                borrow(set)?,
                model_in(model)?,
                vectors::<2>(pan_tilt, n, "pan_tilt")?,
                vectors::<2>(spots, n, "spots")?,
                vectors_optional::<3>(spot_covariance, n, "spot_covariance")?,
                vectors::<2>(uv, n, "uv")?,
                vectors_optional::<3>(uv_covariance, n, "uv_covariance")?,
            )
        };
        let mut set = set.0.write(ptzcal_correspondences::NAME)?;
        set.check_room(n)?;
        let mut shots = Vec::with_capacity(n);
        for (i, ([pan, tilt], spot)) in pan_tilt.iter().zip(spots).enumerate() {
            let noise = covariance2(spot_covariance.map(|c| &c[i]));
            shots.push(Observation::Shot {
                shot: model.measure(*pan, *tilt, &Vector2::from(*spot), &noise)?.point,
                pixel: Vector2::from(uv[i]),
                pixel_covariance: covariance2(uv_covariance.map(|c| &c[i])),
            });
        }
        set.add_all(shots)
    })
}

/// Adds straight lines by two points of each in space, exact or with covariances. The ends of a segment
/// are images of no particular points of its line: how long the segment is, and how far apart the two
/// points, does not matter beyond their noise. A line is worth a point: two equations. Its residual in
/// ptzcal_calibration_copy_residuals are the distances of its two ends from the line's image, which a
/// distorting lens bends.
///
/// @param set            The set.
/// @param xyz            n x 6 numbers: two points of each line, metres, world frame.
/// @param xyz_covariance n x 18 numbers: of the two points of each line, row-major, positive
///                       semi-definite, m^2; may be NULL: the lines are exact.
/// @param uv             n x 4 numbers: the two ends of each line's segment in the image, pixels.
/// @param uv_covariance  n x 6 numbers: xx, xy, yy of each end, positive definite, px^2; may be NULL:
///                       the calibration's pixel noise.
/// @param n              Number of lines.
/// @param error          Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE (index: the line, in this call);
///         PTZCAL_STATUS_INVALID_ARGUMENT for two points or two ends that are one, or a covariance
///         that is none; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_correspondences_add_lines(
    set: *mut ptzcal_correspondences,
    xyz: *const f64,
    xyz_covariance: *const f64,
    uv: *const f64,
    uv_covariance: *const f64,
    n: usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (set, xyz, xyz_covariance, uv, uv_covariance) = unsafe {
            (
                borrow(set)?,
                vectors::<6>(xyz, n, "xyz")?,
                vectors_optional::<18>(xyz_covariance, n, "xyz_covariance")?,
                vectors::<4>(uv, n, "uv")?,
                vectors_optional::<6>(uv_covariance, n, "uv_covariance")?,
            )
        };
        let lines = xyz.iter().zip(uv).enumerate().map(|(i, (x, ends))| {
            let points = [Vector3::new(x[0], x[1], x[2]), Vector3::new(x[3], x[4], x[5])];
            let covariances = xyz_covariance.map(|c| [&c[i][..9], &c[i][9..]].map(Matrix3::from_row_slice));
            seen(ObservedLine::through(points, covariances, segment(ends)), uv_covariance.map(|c| &c[i]))
        });
        set.0.write(ptzcal_correspondences::NAME)?.add_all(lines)
    })
}

/// Adds straight lines like ptzcal_correspondences_add_lines, each by a point and a direction, as a fit
/// of a line to a cloud gives them.
///
/// @param set             The set.
/// @param point_direction n x 6 numbers: a point of each line, metres, world frame, and its direction,
///                        of any length but zero.
/// @param line_covariance n x 36 numbers: of point and direction together, 6 x 6 row-major, positive
///                        semi-definite; may be NULL: the lines are exact.
/// @param uv              n x 4 numbers: the two ends of each line's segment in the image, pixels.
/// @param uv_covariance   n x 6 numbers: xx, xy, yy of each end, positive definite, px^2; may be NULL:
///                        the calibration's pixel noise.
/// @param n               Number of lines.
/// @param error           Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE (index: the line, in this call);
///         PTZCAL_STATUS_INVALID_ARGUMENT for a direction that is zero, two ends that are one, or a
///         covariance that is none; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_correspondences_add_directed_lines(
    set: *mut ptzcal_correspondences,
    point_direction: *const f64,
    line_covariance: *const f64,
    uv: *const f64,
    uv_covariance: *const f64,
    n: usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (set, given, line_covariance, uv, uv_covariance) = unsafe {
            (
                borrow(set)?,
                vectors::<6>(point_direction, n, "point_direction")?,
                vectors_optional::<36>(line_covariance, n, "line_covariance")?,
                vectors::<4>(uv, n, "uv")?,
                vectors_optional::<6>(uv_covariance, n, "uv_covariance")?,
            )
        };
        let lines = given.iter().zip(uv).enumerate().map(|(i, (x, ends))| {
            let (point, direction) = (Vector3::new(x[0], x[1], x[2]), Vector3::new(x[3], x[4], x[5]));
            let covariance = line_covariance.map(|c| Matrix6::from_row_slice(&c[i]));
            let line = ObservedLine { covariance, ..ObservedLine::new(point, direction, segment(ends)) };
            seen(line, uv_covariance.map(|c| &c[i]))
        });
        set.0.write(ptzcal_correspondences::NAME)?.add_all(lines)
    })
}

fn segment(ends: &[f64; 4]) -> [Vector2<f64>; 2] {
    [Vector2::new(ends[0], ends[1]), Vector2::new(ends[2], ends[3])]
}

/// The line with the noise of its segment's ends.
fn seen(line: ObservedLine, noise: Option<&[f64; 6]>) -> Observation {
    let end_covariances =
        noise.map(|[a, b, c, d, e, f]| [covariance2(Some(&[*a, *b, *c])), covariance2(Some(&[*d, *e, *f]))]);
    ObservedLine { end_covariances, ..line }.into()
}

/// How many measurements there are.
///
/// @param set   The set.
/// @param count Receives the number.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_correspondences_count(
    set: *const ptzcal_correspondences,
    count: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (set, count) = unsafe { (borrow(set)?, Out::new(count, "count")?) };
        count.write(set.0.read(ptzcal_correspondences::NAME)?.len());
        Ok(())
    })
}
