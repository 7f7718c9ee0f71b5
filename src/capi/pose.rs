//! Rig poses by roof edges
//!
//! A roof edge is the line where two planes meet: wall and floor, two faces of a box. Two stations of
//! a rig that measured the same two edges (or more) are tied by them. Add to each station's set its
//! planes, fitted to the laser shots of a region, and its edges as pairs of planes: the same edges in
//! the same order, with their planes in the same order.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::args::{BufferOut, Out, number, vectors, vectors_optional};
use super::call::{ErrorOut, guard, guard_or};
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, borrow_optional, free};
use super::rig_model::{covariance2, model_in, ptzcal_rig_model};
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::error::{Error, Result};
use crate::geometry::rigid::log;
use crate::geometry::{Plane, Rigid};
use crate::pose::{
    PlaneEstimate, PlaneFitOptions, PoseEstimate, PoseMethod, PoseOptions, RoofEdges, estimate_pose_roof_edges,
    fit_plane_to_points, fit_plane_to_shots,
};

/// The planes and roof edges that one station measured.
pub struct ptzcal_roof_edges(pub(super) Exclusive<RoofEdges>);

impl Handle for ptzcal_roof_edges {
    const NAME: &'static str = "edges";
}

impl ptzcal_roof_edges {
    /// Adds a plane and tells its number.
    pub(super) fn add(&self, plane: PlaneEstimate, number: Out<u32>) -> Result<()> {
        let index = self.0.write(Self::NAME)?.add_plane(plane)?;
        number.write(u32::try_from(index).map_err(|_| Error::invalid("edges", "too many planes"))?);
        Ok(())
    }
}

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

/// Makes an empty set of planes and edges for one station.
///
/// @param edges Receives the set; free it with ptzcal_roof_edges_free.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_roof_edges_new(
    edges: *mut *mut ptzcal_roof_edges,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let edges = unsafe { HandleOut::new(edges)? };
        edges.give(ptzcal_roof_edges(Exclusive::new(RoofEdges::new())));
        Ok(())
    })
}

/// Frees a set.
///
/// @param edges The set; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_roof_edges_free(edges: *mut ptzcal_roof_edges) {
    // SAFETY: NULL or a live set that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(edges) });
}

/// Adds a plane fitted to laser shots by maximum likelihood in inverse depth. Gross outliers are set
/// aside.
///
/// @param edges           The set.
/// @param model           The rig model.
/// @param pan_tilt        n x 2 numbers: readings at each shot, radians.
/// @param spots           n x 2 numbers: the spot's pixel in the head camera.
/// @param spot_covariance n x 3 numbers: xx, xy, yy, px^2; may be NULL: 1 px, uncorrelated.
/// @param n               Number of shots, at least 3.
/// @param plane           Receives the plane's number in the set, for ptzcal_roof_edges_add_edge.
/// @param error           Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NOT_FINITE;
///         PTZCAL_STATUS_DEGENERATE for shots on one line or a plane through the rig;
///         PTZCAL_STATUS_NO_CONSENSUS when no half of the shots agrees on a plane;
///         PTZCAL_STATUS_BEHIND_CAMERA; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_roof_edges_add_plane_shots(
    edges: *mut ptzcal_roof_edges,
    model: *const ptzcal_rig_model,
    pan_tilt: *const f64,
    spots: *const f64,
    spot_covariance: *const f64,
    n: usize,
    plane: *mut u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (edges, model, pan_tilt, spots, covariance, plane) = unsafe {
            (
                borrow(edges)?,
                model_in(model)?,
                vectors::<2>(pan_tilt, n, "pan_tilt")?,
                vectors::<2>(spots, n, "spots")?,
                vectors_optional::<3>(spot_covariance, n, "spot_covariance")?,
                Out::new(plane, "plane")?,
            )
        };
        let shots = pan_tilt.iter().zip(spots).enumerate().map(|(i, ([pan, tilt], spot))| {
            let noise = covariance2(covariance.map(|c| &c[i]));
            Ok(model.measure(*pan, *tilt, &Vector2::from(*spot), &noise)?.point)
        });
        let shots = shots.collect::<Result<Vec<_>>>()?;
        edges.add(fit_plane_to_shots(&shots, &PlaneFitOptions::default())?, plane)
    })
}

/// Adds a plane fitted to points in the station's frame by total least squares. Gross outliers are
/// set aside.
///
/// @param edges The set.
/// @param xyz   n x 3 numbers: points, metres.
/// @param n     Number of points: at least 3, or 4 when sigma is 0.
/// @param sigma Standard deviation of the points in each direction, metres; 0: estimated from how
///              far they are from the plane.
/// @param plane Receives the plane's number in the set.
/// @param error Receives the error; may be NULL.
/// @return As ptzcal_roof_edges_add_plane_shots.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_roof_edges_add_plane_points(
    edges: *mut ptzcal_roof_edges,
    xyz: *const f64,
    n: usize,
    sigma: f64,
    plane: *mut u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (edges, xyz, plane) = unsafe { (borrow(edges)?, vectors::<3>(xyz, n, "xyz")?, Out::new(plane, "plane")?) };
        let points: Vec<Vector3<f64>> = xyz.iter().map(|p| Vector3::from(*p)).collect();
        let sigma = (number(sigma, "sigma")? != 0.0).then_some(sigma);
        edges.add(fit_plane_to_points(&points, sigma, &PlaneFitOptions::default())?, plane)
    })
}

/// Adds a plane that is known: normal . X = distance in the station's frame.
///
/// @param edges      The set.
/// @param normal     3 numbers of any length but 0.
/// @param distance   Metres; not 0: the plane must not pass through the station.
/// @param covariance 9 numbers: covariance of n = normal / distance, row-major, 1 / m^2; may be NULL:
///                   the plane is exact.
/// @param plane      Receives the plane's number in the set.
/// @param error      Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT;
///         PTZCAL_STATUS_DEGENERATE for a plane through the station; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_roof_edges_add_plane(
    edges: *mut ptzcal_roof_edges,
    normal: *const f64,
    distance: f64,
    covariance: *const f64,
    plane: *mut u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (edges, normal, covariance, plane) = unsafe {
            (
                borrow(edges)?,
                vectors::<3>(normal, 1, "normal")?,
                vectors_optional::<9>(covariance, 1, "covariance")?,
                Out::new(plane, "plane")?,
            )
        };
        let known = Plane::new(Vector3::from(normal[0]), number(distance, "distance")?)
            .ok_or_else(|| Error::invalid("normal", "it is zero"))?;
        let covariance = covariance.map(|c| Matrix3::from_row_slice(&c[0]));
        edges.add(PlaneEstimate::given(&known, covariance)?, plane)
    })
}

/// Adds the edge where two of the station's planes meet.
///
/// @param edges  The set.
/// @param first  Number of a plane.
/// @param second Number of another plane. The order matters: it must be the same in both stations.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_roof_edges_add_edge(
    edges: *mut ptzcal_roof_edges,
    first: u32,
    second: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let edges = unsafe { borrow(edges)? };
        edges.0.write(ptzcal_roof_edges::NAME)?.add_edge(first as usize, second as usize)
    })
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
