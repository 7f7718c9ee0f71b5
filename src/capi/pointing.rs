//! Pointing
//!
//! A pixel of a calibrated fixed camera as pan, tilt and zoom of the head, and a pixel of the head's
//! camera as a pixel of the fixed one. A pointing holds the camera, the rig, how well both are known, and
//! where the targets are: on a plane, on the surface of a point cloud, or at a distance. Every answer has
//! a covariance through the whole chain: click, calibration, surface, rig and the head's coming to rest.

use nalgebra::{Matrix2, Matrix3, Matrix4, Matrix6, SMatrix, Vector2, Vector3};

use super::adjusted::ptzcal_adjusted;
use super::args::{ArrayOut, BufferOut, number, vectors, vectors_optional};
use super::calibrate::ptzcal_calibration;
use super::call::{ErrorOut, guard, guard_or};
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, free};
use super::pose::{pose_in, ptzcal_pose};
use super::rig_model::ptzcal_rig_model;
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use super::zoom_curve::ptzcal_zoom_curve;
use crate::calibrate::{UncertainPixel, UncertainPoint};
use crate::device::PtzCapabilities;
use crate::error::{Error, Result};
use crate::geometry::{Plane, RIG_PARAMETERS, RigModel};
use crate::pointing::{
    AimOptions, Click, CloudSurface, Depth, Edge, MeasuredBy, PointNoise, Pointer, UncertainPlane, ellipse,
};

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
    fn depth(&self) -> Result<Depth<'_>> {
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

/// A click from its pixel and xx, xy, yy.
pub(super) fn click(uv: &[[f64; 2]], covariance: Option<&[[f64; 3]]>) -> Click {
    let [xx, xy, yy] = covariance.and_then(|c| c.first()).copied().unwrap_or([0.0; 3]);
    let pixel = uv.first().map_or_else(Vector2::zeros, |uv| Vector2::from(*uv));
    Click { pixel, covariance: Matrix2::new(xx, xy, xy, yy) }
}

/// A number or infinity.
pub(super) fn not_nan(value: f64, name: &'static str) -> Result<f64> {
    if value.is_nan() { Err(Error::NotFinite { name, index: 0 }) } else { Ok(value) }
}

fn three(c: &Matrix2<f64>) -> [f64; 3] {
    [c.m11, c.m12, c.m22]
}

/// Symmetric: by columns is by rows.
fn nine(c: &Matrix3<f64>) -> [f64; 9] {
    std::array::from_fn(|i| c[(i / 3, i % 3)])
}

/// Where to turn the head, and how surely.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_aim {
    /// Set by ptzcal_aim_init.
    pub struct_size: u32,
    /// 1 when there is a zoom curve, and `zoom` is set.
    pub has_zoom: u32,
    /// 1 when the surface ends or bends about the target, or is sampled too thinly to tell: the target may be what is at `other_distance` instead.
    pub edge: u32,
    /// 0.
    pub reserved: u32,
    /// The device's reading at which the target is at the picture's centre, radians.
    pub pan: f64,
    /// The device's reading, radians.
    pub tilt: f64,
    /// Of the target's direction about them, in readings: pan pan, pan tilt, tilt tilt, rad^2.
    pub angle_covariance: [f64; 3],
    /// The tightest zoom (the curve's own scale) that keeps the whole target in the picture with the probability asked for; the widest when none does.
    pub zoom: f64,
    /// Of the whole target being in the picture.
    pub probability: f64,
    /// Where the target is in the head camera's picture then, pixels.
    pub uv: [f64; 2],
    /// Its covariance: xx, xy, yy, px^2.
    pub uv_covariance: [f64; 3],
    /// The target in the world, metres.
    pub point: [f64; 3],
    /// Its covariance, row-major, m^2.
    pub point_covariance: [f64; 9],
    /// From the fixed camera's centre, metres.
    pub distance: f64,
    /// From the fixed camera's centre, of what the target may be instead, metres; 0: the cloud shows nothing else.
    pub other_distance: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_aim {
    const NAME: &'static str = "aim";
    const FIRST_SIZE: usize = 16 + 26 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            has_zoom: 0,
            edge: 0,
            reserved: 0,
            pan: 0.0,
            tilt: 0.0,
            angle_covariance: [0.0; 3],
            zoom: 0.0,
            probability: 0.0,
            uv: [0.0; 2],
            uv_covariance: [0.0; 3],
            point: [0.0; 3],
            point_covariance: [0.0; 9],
            distance: 0.0,
            other_distance: 0.0,
        }
    }
}

/// Where the fixed camera sees what the head camera sees.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_located {
    /// Set by ptzcal_located_init.
    pub struct_size: u32,
    /// As in ptzcal_aim.
    pub edge: u32,
    /// 1 when the cloud has a surface between the fixed camera and the point.
    pub hidden: u32,
    /// 0.
    pub reserved: u32,
    /// Pixel of the fixed camera.
    pub uv: [f64; 2],
    /// Its covariance: xx, xy, yy, px^2.
    pub uv_covariance: [f64; 3],
    /// In the world, metres.
    pub point: [f64; 3],
    /// Its covariance, row-major, m^2.
    pub point_covariance: [f64; 9],
    /// From the head camera's centre, metres.
    pub distance: f64,
    /// As in ptzcal_aim, from the head camera's centre.
    pub other_distance: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_located {
    const NAME: &'static str = "located";
    const FIRST_SIZE: usize = 16 + 19 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            edge: 0,
            hidden: 0,
            reserved: 0,
            uv: [0.0; 2],
            uv_covariance: [0.0; 3],
            point: [0.0; 3],
            point_covariance: [0.0; 9],
            distance: 0.0,
            other_distance: 0.0,
        }
    }
}

fn other(edge: Option<Edge>) -> f64 {
    edge.and_then(|e| e.other).unwrap_or(0.0)
}

fn pixel_members(p: &UncertainPixel) -> ([f64; 2], [f64; 3]) {
    (p.pixel.into(), three(&p.covariance))
}

fn point_members(p: &UncertainPoint) -> ([f64; 3], [f64; 9]) {
    (p.point.into(), nine(&p.covariance))
}

/// Sets up an aim: everything 0.
///
/// @param aim  The struct.
/// @param size sizeof *aim.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_aim_init(aim: *mut ptzcal_aim, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(aim, size) })
}

/// Sets up a location: everything 0.
///
/// @param located The struct.
/// @param size    sizeof *located.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_located_init(located: *mut ptzcal_located, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(located, size) })
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

/// Where to turn the head, and how far to zoom, so that its camera shows at its picture's centre what the
/// fixed camera shows at a pixel.
///
/// @param pointing      The pointing.
/// @param uv            2 numbers: a pixel of the fixed camera.
/// @param uv_covariance 3 numbers: xx, xy, yy, px^2, positive semi-definite; may be NULL: the pixel is
///                      exact.
/// @param probability   With which the whole target is to be in the picture, between 0 and 1.
/// @param target_size   Diameter of the target, metres; 0 for a point.
/// @param aim           Receives the aim; set up by ptzcal_aim_init.
/// @param error         Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (a pixel outside the picture, a
///         probability or size that is none); PTZCAL_STATUS_OUTSIDE_LENS; PTZCAL_STATUS_UNREACHABLE:
///         a pixel above the plane's horizon, one so near to it that its distance is known to no
///         better than 20 %, or an aim that the head cannot reach; PTZCAL_STATUS_NOT_FOUND: the cloud
///         has no surface near the ray; PTZCAL_STATUS_BAD_STATE: neither plane nor cloud nor distance
///         is set.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pointing_aim(
    pointing: *const ptzcal_pointing,
    uv: *const f64,
    uv_covariance: *const f64,
    probability: f64,
    target_size: f64,
    aim: *mut ptzcal_aim,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        number(probability, "probability")?;
        number(target_size, "target_size")?;
        // SAFETY: the caller keeps the header's rules for pointers.
        let (pointing, uv, c, aim) = unsafe {
            (
                borrow(pointing)?,
                vectors::<2>(uv, 1, "uv")?,
                vectors_optional::<3>(uv_covariance, 1, "uv_covariance")?,
                SizedOut::new(aim)?,
            )
        };
        let state = pointing.0.read(ptzcal_pointing::NAME)?;
        let options = AimOptions { probability, target_size };
        let found = state.pointer.aim(&click(uv, c), &state.depth()?, &options)?;
        let ((uv, uv_covariance), (point, point_covariance)) =
            (pixel_members(&found.pixel), point_members(&found.point));
        aim.write(&ptzcal_aim {
            has_zoom: u32::from(found.zoom.is_some()),
            edge: u32::from(found.edge.is_some()),
            pan: found.pan,
            tilt: found.tilt,
            angle_covariance: three(&found.angles),
            zoom: found.zoom.unwrap_or(0.0),
            probability: found.probability,
            uv,
            uv_covariance,
            point,
            point_covariance,
            distance: found.distance,
            other_distance: other(found.edge),
            ..SizedStruct::initial()
        });
        Ok(())
    })
}

/// Where the fixed camera sees what the head camera sees at a pixel.
///
/// @param pointing      The pointing.
/// @param pan           Reading of the head, radians.
/// @param tilt          Reading of the head, radians.
/// @param zoom          Zoom on the curve's scale; without a curve it does not matter.
/// @param uv            2 numbers: a pixel of the head camera.
/// @param uv_covariance 3 numbers: xx, xy, yy, px^2, positive semi-definite; may be NULL: the pixel is
///                      exact.
/// @param located       Receives the location; set up by ptzcal_located_init.
/// @param error         Receives the error; may be NULL.
/// @return As ptzcal_pointing_aim; PTZCAL_STATUS_UNREACHABLE also for a point outside the fixed
///         camera's picture, PTZCAL_STATUS_BEHIND_CAMERA for one that it cannot see.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pointing_locate(
    pointing: *const ptzcal_pointing,
    pan: f64,
    tilt: f64,
    zoom: f64,
    uv: *const f64,
    uv_covariance: *const f64,
    located: *mut ptzcal_located,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        number(pan, "pan")?;
        number(tilt, "tilt")?;
        number(zoom, "zoom")?;
        // SAFETY: the caller keeps the header's rules for pointers.
        let (pointing, uv, c, located) = unsafe {
            (
                borrow(pointing)?,
                vectors::<2>(uv, 1, "uv")?,
                vectors_optional::<3>(uv_covariance, 1, "uv_covariance")?,
                SizedOut::new(located)?,
            )
        };
        let state = pointing.0.read(ptzcal_pointing::NAME)?;
        let zoom = state.pointer.zoom_curve().map(|_| zoom);
        let found = state.pointer.locate([pan, tilt], zoom, &click(uv, c), &state.depth()?)?;
        let ((uv, uv_covariance), (point, point_covariance)) =
            (pixel_members(&found.pixel), point_members(&found.point));
        located.write(&ptzcal_located {
            edge: u32::from(found.edge.is_some()),
            hidden: u32::from(found.hidden),
            uv,
            uv_covariance,
            point,
            point_covariance,
            distance: found.distance,
            other_distance: other(found.edge),
            ..SizedStruct::initial()
        });
        Ok(())
    })
}

/// The part of the fixed camera's picture in which what the head camera sees at a pixel can be, its depth
/// unknown: of 65 places evenly spread in inverse distance those that are in the picture, nearest first.
///
/// @param pointing      The pointing.
/// @param pan           Reading of the head, radians.
/// @param tilt          Reading of the head, radians.
/// @param zoom          Zoom on the curve's scale; without a curve it does not matter.
/// @param uv            2 numbers: a pixel of the head camera.
/// @param uv_covariance 3 numbers: xx, xy, yy, px^2, positive semi-definite; may be NULL: the pixel is
///                      exact.
/// @param nearest       Metres, positive.
/// @param farthest      Metres; INFINITY is far enough.
/// @param buffer        Receives 6 numbers a place: distance from the head camera's centre (metres), u,
///                      v, and xx, xy, yy of the pixel (px^2); may be NULL when capacity is 0.
/// @param capacity      Numbers that fit.
/// @param needed        Receives how many numbers there are; may be NULL.
/// @param error         Receives the error; may be NULL.
/// @return As ptzcal_pointing_locate; PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pointing_copy_located_along(
    pointing: *const ptzcal_pointing,
    pan: f64,
    tilt: f64,
    zoom: f64,
    uv: *const f64,
    uv_covariance: *const f64,
    nearest: f64,
    farthest: f64,
    buffer: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        number(pan, "pan")?;
        number(tilt, "tilt")?;
        number(zoom, "zoom")?;
        number(nearest, "nearest")?;
        not_nan(farthest, "farthest")?;
        // SAFETY: the caller keeps the header's rules for pointers.
        let (pointing, uv, c, buffer) = unsafe {
            (
                borrow(pointing)?,
                vectors::<2>(uv, 1, "uv")?,
                vectors_optional::<3>(uv_covariance, 1, "uv_covariance")?,
                BufferOut::new(buffer, capacity, needed)?,
            )
        };
        let state = pointing.0.read(ptzcal_pointing::NAME)?;
        let zoom = state.pointer.zoom_curve().map(|_| zoom);
        let places = state.pointer.locate_along([pan, tilt], zoom, &click(uv, c), [nearest, farthest])?;
        let numbers: Vec<f64> = places
            .iter()
            .flat_map(|p| {
                let ([u, v], [xx, xy, yy]) = pixel_members(&p.pixel);
                [p.distance, u, v, xx, xy, yy]
            })
            .collect();
        buffer.write(&numbers)
    })
}

/// The ellipse about a Gaussian's mean that holds it with a probability: of a pixel, or of pan and tilt.
///
/// @param covariance  3 numbers: xx, xy, yy, positive semi-definite.
/// @param probability Between 0 and 1.
/// @param semi_axes   Receives 2 numbers: the longer half axis and the shorter, in the covariance's
///                    units.
/// @param angle       Receives the longer axis's angle from x towards y, radians, from -pi/2 to pi/2.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_ellipse(
    covariance: *const f64,
    probability: f64,
    semi_axes: *mut f64,
    angle: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        number(probability, "probability")?;
        // SAFETY: the caller keeps the header's rules for pointers.
        let (c, axes, angle) = unsafe {
            (
                vectors::<3>(covariance, 1, "covariance")?,
                ArrayOut::new(semi_axes, 2, "semi_axes")?,
                ArrayOut::new(angle, 1, "angle")?,
            )
        };
        let [xx, xy, yy] = c[0];
        let found = ellipse(&Matrix2::new(xx, xy, xy, yy), probability)?;
        axes.write(&found.semi_axes);
        angle.write(&[found.angle]);
        Ok(())
    })
}
