//! Pointing
//!
//! A pixel of a calibrated fixed camera as pan, tilt and zoom of the head, and a pixel of the head's
//! camera as a pixel of the fixed one (the next chapters). A pointing holds the camera, the rig, how well both are known, and
//! where the targets are: on a plane, on the surface of a point cloud, or at a distance. Every answer has
//! a covariance through the whole chain: click, calibration, surface, rig and the head's coming to rest.

use nalgebra::{Matrix3, Matrix4, Matrix6, SMatrix, Vector3};

use super::adjusted::ptzcal_adjusted;
use super::args::{number, vectors, vectors_optional};
use super::calibrate::ptzcal_calibration;
use super::call::{ErrorOut, guard, guard_or};
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, free};
use super::pose::{pose_in, ptzcal_pose};
use super::rig_model::ptzcal_rig_model;
use super::sized;
use super::status::ptzcal_status;
use super::zoom_curve::ptzcal_zoom_curve;
use crate::device::PtzCapabilities;
use crate::error::{Error, Result};
use crate::geometry::{Plane, RIG_PARAMETERS, RigModel};
use crate::pointing::{CloudSurface, Depth, MeasuredBy, PointNoise, Pointer, UncertainPlane};

/// Who measured a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum ptzcal_measured_by {
    /// Anything else: its errors have nothing to do with the rig's.
    Others = 0,
    /// The laser of the same rig, from where it stands now: what is wrong with the rig is wrong with the
    /// surface too, and largely cancels when the rig aims at it.
    ThisRig = 1,
}

/// A fixed camera and a rig, for pointing.
pub struct ptzcal_pointing(pub(super) Exclusive<State>);

pub(super) struct State {
    pub pointer: Pointer,
    surface: Surface,
}

enum Surface {
    None,
    Plane(UncertainPlane),
    Cloud(CloudSurface),
    Distance { metres: f64, sigma: f64 },
}

impl Handle for ptzcal_pointing {
    const NAME: &'static str = "pointing";
}

impl State {
    pub fn depth(&self) -> Result<Depth<'_>> {
        Ok(match &self.surface {
            Surface::None => {
                let reason = "where the targets are is not known: set a plane, a cloud or a distance, or sweep";
                return Err(Error::BadState { reason: reason.into() });
            }
            Surface::Plane(plane) => Depth::Plane(plane),
            Surface::Cloud(cloud) => Depth::Cloud(cloud),
            Surface::Distance { metres, sigma } => Depth::Distance { metres: *metres, sigma: *sigma },
        })
    }
}

impl From<Pointer> for ptzcal_pointing {
    fn from(pointer: Pointer) -> Self {
        Self(Exclusive::new(State { pointer, surface: Surface::None }))
    }
}

impl ptzcal_pointing {
    fn change<T>(&self, change: impl FnOnce(&mut State) -> Result<T>) -> Result<T> {
        change(&mut *self.0.write(Self::NAME)?)
    }
}

fn measured_by(value: u32) -> Result<MeasuredBy> {
    [MeasuredBy::Others, MeasuredBy::ThisRig]
        .into_iter()
        .find(|m| *m as u32 == value)
        .ok_or_else(|| Error::invalid("measured_by", format!("{value} is no ptzcal_measured_by")))
}

/// Makes a pointing of a camera whose world is the rig's frame. The rig is taken as exact until
/// ptzcal_pointing_set_rig_covariance; where the targets are must still be set.
///
/// @param calibration The fixed camera with its covariance.
/// @param model       The rig.
/// @param pointing    Receives the pointing; free it with ptzcal_pointing_free.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT, PTZCAL_STATUS_NOT_FINITE,
///         PTZCAL_STATUS_LENS_NOT_MONOTONE for a model that makes no sense.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pointing_new(
    calibration: *const ptzcal_calibration,
    model: *const ptzcal_rig_model,
    pointing: *mut *mut ptzcal_pointing,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, calibration, model) =
            unsafe { (HandleOut::new(pointing)?, borrow(calibration)?, sized::read(model)?) };
        out.give(Pointer::new(calibration.answer.clone(), RigModel::try_from(model)?)?.into());
        Ok(())
    })
}

/// Makes a pointing of a joint adjustment, with all that camera and rig have in common.
///
/// @param adjusted The adjustment's answer.
/// @param camera   The fixed camera's index.
/// @param station  The station at which the rig stands.
/// @param pointing Receives the pointing; free it with ptzcal_pointing_free.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a camera or station that does not
///         exist.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pointing_new_adjusted(
    adjusted: *const ptzcal_adjusted,
    camera: u32,
    station: u32,
    pointing: *mut *mut ptzcal_pointing,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, adjusted) = unsafe { (HandleOut::new(pointing)?, borrow(adjusted)?) };
        out.give(Pointer::of_adjusted(&adjusted.adjusted, camera as usize, station as usize)?.into());
        Ok(())
    })
}

/// Frees a pointing.
///
/// @param pointing The pointing; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pointing_free(pointing: *mut ptzcal_pointing) {
    // SAFETY: NULL or a live handle that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(pointing) });
}

/// Says how well the rig is known, independent of the camera.
///
/// @param pointing   The pointing.
/// @param covariance 225 numbers, 15 x 15: of the rig's parameters in the order of
///                   ptzcal_adjusted_copy_covariance, row-major, positive semi-definite.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pointing_set_rig_covariance(
    pointing: *mut ptzcal_pointing,
    covariance: *const f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (pointing, c) = unsafe { (borrow(pointing)?, vectors::<225>(covariance, 1, "covariance")?) };
        let covariance = SMatrix::<f64, RIG_PARAMETERS, RIG_PARAMETERS>::from_row_slice(&c[0]);
        pointing.change(|s| s.pointer.set_rig_covariance(&covariance))
    })
}

/// Says where the rig stands, when that is not where the world is.
///
/// @param pointing   The pointing.
/// @param pose       The station in the world, X_world = rotation X_station + translation; its other
///                   members do not matter.
/// @param covariance 36 numbers, row-major: of w in R <- exp([w]x) R (axes of the world, radians) and
///                   of the translation (metres); may be NULL: the pose is exact.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pointing_set_station(
    pointing: *mut ptzcal_pointing,
    pose: *const ptzcal_pose,
    covariance: *const f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (pointing, pose, c) =
            unsafe { (borrow(pointing)?, pose_in(pose)?, vectors_optional::<36>(covariance, 1, "covariance")?) };
        let covariance = c.map_or_else(Matrix6::zeros, |c| Matrix6::from_row_slice(&c[0]));
        pointing.change(|s| s.pointer.set_station(pose, &covariance))
    })
}

/// Says where the head comes to rest about its readings: its repeatability and, of a head with steps,
/// step / sqrt(12). 0 until then.
///
/// @param pointing The pointing.
/// @param pan      Standard deviation of pan, radians.
/// @param tilt     Standard deviation of tilt, radians.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pointing_set_head_deviation(
    pointing: *mut ptzcal_pointing,
    pan: f64,
    tilt: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let pointing = unsafe { borrow(pointing)? };
        pointing.change(|s| s.pointer.set_head_deviation([pan, tilt]))
    })
}

/// Gives the head camera's lens over zoom: aims then have a zoom. Its errors are taken as independent
/// of the rig's axes and encoders.
///
/// @param pointing The pointing.
/// @param curve    The curve, of the rig's image size; it is copied.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pointing_set_zoom_curve(
    pointing: *mut ptzcal_pointing,
    curve: *const ptzcal_zoom_curve,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (pointing, curve) = unsafe { (borrow(pointing)?, borrow(curve)?) };
        pointing.change(|s| s.pointer.set_zoom_curve(curve.0.clone()))
    })
}

/// Says how far the head reaches: aims beyond are refused.
///
/// @param pointing The pointing.
/// @param pan_min  Least reading of pan, radians.
/// @param pan_max  Greatest reading of pan, radians.
/// @param tilt_min Least reading of tilt, radians.
/// @param tilt_max Greatest reading of tilt, radians.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pointing_set_reach(
    pointing: *mut ptzcal_pointing,
    pan_min: f64,
    pan_max: f64,
    tilt_min: f64,
    tilt_max: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let pointing = unsafe { borrow(pointing)? };
        let [pan_min, pan_max] = [number(pan_min, "pan_min")?, number(pan_max, "pan_max")?];
        let [tilt_min, tilt_max] = [number(tilt_min, "tilt_min")?, number(tilt_max, "tilt_max")?];
        let reach = PtzCapabilities {
            pan_range: [pan_min, pan_max],
            tilt_range: [tilt_min, tilt_max],
            ..PtzCapabilities::default()
        };
        pointing.change(|s| s.pointer.set_reach(&reach))
    })
}

/// The targets are on a plane n . x = distance of the world: the floor, the road, a wall.
///
/// @param pointing    The pointing.
/// @param normal      3 numbers, of any length but 0.
/// @param distance    Metres times the normal's length.
/// @param covariance  16 numbers, 4 x 4 row-major, positive semi-definite: of the unit normal's three
///                    components and the distance (metres); may be NULL: the plane is exact, but for
///                    what `measured_by` makes of it.
/// @param measured_by A ptzcal_measured_by.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pointing_set_plane(
    pointing: *mut ptzcal_pointing,
    normal: *const f64,
    distance: f64,
    covariance: *const f64,
    measured_by: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (pointing, normal, c) = unsafe {
            (
                borrow(pointing)?,
                vectors::<3>(normal, 1, "normal")?,
                vectors_optional::<16>(covariance, 1, "covariance")?,
            )
        };
        let plane = Plane::new(Vector3::from(normal[0]), number(distance, "distance")?)
            .ok_or_else(|| Error::invalid("normal", "has no length"))?;
        let covariance = c.map_or_else(Matrix4::zeros, |c| Matrix4::from_row_slice(&c[0]));
        let plane = UncertainPlane { plane, covariance, measured_by: self::measured_by(measured_by)? };
        plane.validate()?;
        pointing.change(|s| {
            s.surface = Surface::Plane(plane);
            Ok(())
        })
    })
}

/// The targets are on the surface that a point cloud samples. The cloud is copied and arranged once: a
/// second or two for a million points.
///
/// @param pointing    The pointing.
/// @param xyz         n x 3 numbers: points in the world, metres.
/// @param covariances n x 9 numbers: of each point, row-major, positive semi-definite, m^2; may be
///                    NULL: estimated from the points' scatter.
/// @param n           Number of points, at least 4.
/// @param measured_by A ptzcal_measured_by.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NOT_FINITE (index: the
///         point); PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pointing_set_cloud(
    pointing: *mut ptzcal_pointing,
    xyz: *const f64,
    covariances: *const f64,
    n: usize,
    measured_by: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (pointing, xyz, covariances) = unsafe {
            (borrow(pointing)?, vectors::<3>(xyz, n, "xyz")?, vectors_optional::<9>(covariances, n, "covariances")?)
        };
        let measured_by = self::measured_by(measured_by)?;
        let points: Vec<Vector3<f64>> = xyz.iter().map(|p| Vector3::from(*p)).collect();
        let covariances: Option<Vec<Matrix3<f64>>> =
            covariances.map(|c| c.iter().map(|c| Matrix3::from_row_slice(c)).collect());
        let noise = covariances.as_deref().map_or(PointNoise::Unknown, PointNoise::Covariances);
        let cloud = CloudSurface::new(&points, noise, measured_by)?;
        pointing.change(|s| {
            s.surface = Surface::Cloud(cloud);
            Ok(())
        })
    })
}

/// The targets are at a known distance along their rays, from whichever camera sees the pixel.
///
/// @param pointing The pointing.
/// @param metres   The distance, positive.
/// @param sigma    Its standard deviation, metres; 0: exact.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pointing_set_distance(
    pointing: *mut ptzcal_pointing,
    metres: f64,
    sigma: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let pointing = unsafe { borrow(pointing)? };
        let (metres, sigma) = (number(metres, "metres")?, number(sigma, "sigma")?);
        if metres <= 0.0 || sigma < 0.0 {
            return Err(Error::invalid("metres", format!("{metres} m, standard deviation {sigma} m")));
        }
        pointing.change(|s| {
            s.surface = Surface::Distance { metres, sigma };
            Ok(())
        })
    })
}
