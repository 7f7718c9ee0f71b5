//! Rig poses by roof edges
//!
//! The pose of one station of a rig in another's frame, from the roof edges that both measured.

use nalgebra::{Matrix3, Vector3};

use super::args::{BufferOut, number};
use super::call::{ErrorOut, guard, guard_or};
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, borrow_optional, free};
use super::roof_edges::ptzcal_roof_edges;
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::error::{Error, Result};
use crate::geometry::Rigid;
use crate::geometry::rigid::log;
use crate::pose::{PoseEstimate, PoseMethod, PoseOptions, estimate_pose_roof_edges};

/// How a pose is computed from roof edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ptzcal_pose_method {
    /// Rigid Procrustes on points of the edges (Gois and Gaspar): the default.
    RoofEdgeProcrustes = 0,
    /// Closed form on the planes themselves; more accurate.
    PlaneToPlane = 1,
    /// The planes weighted by their full covariances; the most accurate.
    MaximumLikelihood = 2,
}

/// How a pose is estimated.
pub struct ptzcal_pose_options(Exclusive<PoseOptions>);

impl Handle for ptzcal_pose_options {
    const NAME: &'static str = "options";
}

impl ptzcal_pose_options {
    /// Changes one setting.
    ///
    /// # Safety
    /// `options` is NULL or live options.
    unsafe fn change(options: *mut Self, change: impl FnOnce(&mut PoseOptions)) -> Result<()> {
        // SAFETY: by this function's contract.
        change(&mut *unsafe { borrow(options)? }.0.write(Self::NAME)?);
        Ok(())
    }
}

/// The pose of station b in station a's frame. Immutable: any number of threads may read it.
pub struct ptzcal_pose_estimate(PoseEstimate);

impl Handle for ptzcal_pose_estimate {
    const NAME: &'static str = "estimate";
}

/// The pose of one station in another's frame.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_pose {
    /// Set by ptzcal_pose_init.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// R, row-major, in X_a = R X_b + t.
    pub rotation: [f64; 9],
    /// t, metres: the position of station b in station a's frame.
    pub translation: [f64; 3],
    /// Angle of R, radians.
    pub rotation_angle: f64,
    /// Root mean square distance between the two stations' points on the edges, metres.
    pub residual_rms: f64,
    /// Largest difference that is left between the two stations' planes: of their unit normals, and
    /// of their distances relative to the edges' mean distance.
    pub disagreement: f64,
    /// How much better the best-determined direction is than the worst; 1 at best.
    pub condition: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_pose {
    const NAME: &'static str = "pose";
    const FIRST_SIZE: usize = 8 + 16 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            reserved: 0,
            rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            translation: [0.0; 3],
            rotation_angle: 0.0,
            residual_rms: 0.0,
            disagreement: 0.0,
            condition: 0.0,
        }
    }
}

impl ptzcal_pose {
    /// A transform without the figures of an estimate.
    pub(super) fn of(transform: &Rigid) -> Self {
        let mut rotation = [0.0; 9];
        rotation.copy_from_slice(transform.rotation.transpose().as_slice());
        let rotation_angle = log(&transform.rotation).norm();
        Self { rotation, translation: transform.translation.into(), rotation_angle, ..Self::initial() }
    }
}

impl From<&PoseEstimate> for ptzcal_pose {
    fn from(e: &PoseEstimate) -> Self {
        Self {
            residual_rms: e.residual_rms,
            disagreement: e.disagreement,
            condition: e.condition,
            ..Self::of(&e.b_to_a)
        }
    }
}

/// The caller's pose as a transform; its other members do not matter.
///
/// # Safety
/// `pose` is NULL or a struct as long as its `struct_size` says.
pub(super) unsafe fn pose_in(pose: *const ptzcal_pose) -> Result<Rigid> {
    // SAFETY: by this function's contract.
    let pose = unsafe { sized::read(pose)? };
    Ok(Rigid { rotation: Matrix3::from_row_slice(&pose.rotation), translation: Vector3::from(pose.translation) })
}

/// Makes options with their defaults: roof-edge Procrustes, levers of the scene's size, planes and
/// edges at least 5 degrees apart.
///
/// @param options Receives the options; free them with ptzcal_pose_options_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pose_options_new(
    options: *mut *mut ptzcal_pose_options,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let options = unsafe { HandleOut::new(options)? };
        options.give(ptzcal_pose_options(Exclusive::new(PoseOptions::default())));
        Ok(())
    })
}

/// Frees options.
///
/// @param options The options; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pose_options_free(options: *mut ptzcal_pose_options) {
    // SAFETY: NULL or live options that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(options) });
}

/// Sets the method.
///
/// @param options The options.
/// @param method  A ptzcal_pose_method; the default is PTZCAL_POSE_METHOD_ROOF_EDGE_PROCRUSTES.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pose_options_set_method(
    options: *mut ptzcal_pose_options,
    method: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        let method = [PoseMethod::RoofEdgeProcrustes, PoseMethod::PlaneToPlane, PoseMethod::MaximumLikelihood]
            .into_iter()
            .find(|m| *m as u32 == method)
            .ok_or_else(|| Error::invalid("method", format!("{method} is no method")))?;
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { ptzcal_pose_options::change(options, |o| o.method = method) }
    })
}

/// Sets how far along an edge its second point lies (Procrustes only).
///
/// @param options The options.
/// @param lever   Metres, positive; 0 (the default): the edges' mean distance from the stations.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pose_options_set_lever(
    options: *mut ptzcal_pose_options,
    lever: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        if number(lever, "lever")? < 0.0 {
            return Err(Error::invalid("lever", format!("{lever} m")));
        }
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { ptzcal_pose_options::change(options, |o| o.lever = (lever > 0.0).then_some(lever)) }
    })
}

/// Sets the angles below which planes make no edge and edges count as parallel.
///
/// @param options        The options.
/// @param min_plane_angle Radians, 0 to pi/2; the default is 5 degrees.
/// @param min_edge_angle  Radians, 0 to pi/2; the default is 5 degrees.
/// @param error          Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pose_options_set_min_angles(
    options: *mut ptzcal_pose_options,
    min_plane_angle: f64,
    min_edge_angle: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        for (name, angle) in [("min_plane_angle", min_plane_angle), ("min_edge_angle", min_edge_angle)] {
            if !(0.0..=std::f64::consts::FRAC_PI_2).contains(&number(angle, name)?) {
                return Err(Error::invalid(name, format!("{angle} is not in 0 to pi/2")));
            }
        }
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe {
            ptzcal_pose_options::change(options, |o| {
                o.min_plane_angle = min_plane_angle;
                o.min_edge_angle = min_edge_angle;
            })
        }
    })
}

/// Estimates the pose of station b in station a's frame from the roof edges that both measured.
///
/// @param station_a The first station's planes and edges.
/// @param station_b The second station's: the same edges in the same order.
/// @param options   The options; may be NULL: the defaults.
/// @param result    Receives the estimate; free it with ptzcal_pose_estimate_free.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for unequal or fewer than two edges and
///         for stations that did not see the same planes; PTZCAL_STATUS_DEGENERATE for parallel
///         planes or edges (the message says what is unobservable); PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_estimate_pose_roof_edges(
    station_a: *const ptzcal_roof_edges,
    station_b: *const ptzcal_roof_edges,
    options: *const ptzcal_pose_options,
    result: *mut *mut ptzcal_pose_estimate,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (result, a, b, options) =
            unsafe { (HandleOut::new(result)?, borrow(station_a)?, borrow(station_b)?, borrow_optional(options)) };
        let options = match options {
            Some(o) => o.0.read(ptzcal_pose_options::NAME)?.clone(),
            None => PoseOptions::default(),
        };
        let (a, b) = (a.0.read(ptzcal_roof_edges::NAME)?, b.0.read(ptzcal_roof_edges::NAME)?);
        result.give(ptzcal_pose_estimate(estimate_pose_roof_edges(&a, &b, &options)?));
        Ok(())
    })
}

/// Frees an estimate.
///
/// @param estimate The estimate; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pose_estimate_free(estimate: *mut ptzcal_pose_estimate) {
    // SAFETY: NULL or a live estimate that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(estimate) });
}

/// Sets up a pose: the identity.
///
/// @param pose The struct.
/// @param size sizeof *pose.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pose_init(pose: *mut ptzcal_pose, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(pose, size) })
}

/// The pose.
///
/// @param estimate The estimate.
/// @param pose     Receives the pose; set up by ptzcal_pose_init.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pose_estimate_get(
    estimate: *const ptzcal_pose_estimate,
    pose: *mut ptzcal_pose,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (estimate, pose) = unsafe { (borrow(estimate)?, SizedOut::new(pose)?) };
        pose.write(&(&estimate.0).into());
        Ok(())
    })
}

/// Copies the 6 x 6 covariance of the pose, row-major: of the rotation vector w in R <- exp([w]x) R
/// (radians, axes of station a) and of the translation (metres).
///
/// @param estimate The estimate.
/// @param buffer   Receives 36 numbers; may be NULL when capacity is 0.
/// @param capacity Numbers that fit.
/// @param needed   Receives 36; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: nothing was copied.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_pose_estimate_copy_covariance(
    estimate: *const ptzcal_pose_estimate,
    buffer: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (estimate, buffer) = unsafe { (borrow(estimate)?, BufferOut::new(buffer, capacity, needed)?) };
        // Symmetric: by columns is by rows.
        buffer.write(estimate.0.covariance.as_slice())
    })
}
