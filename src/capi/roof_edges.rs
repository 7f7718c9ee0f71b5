//! Planes and roof edges
//!
//! A roof edge is the line where two planes meet: wall and floor, two faces of a box. Two stations of
//! a rig that measured the same two edges (or more) are tied by them. Add to each station's set its
//! planes, fitted to the laser shots of a region, and its edges as pairs of planes: the same edges in
//! the same order, with their planes in the same order.

use super::args::{Out, number, vectors, vectors_optional};
use super::call::{ErrorOut, guard, guard_or};
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, free};
use super::rig_model::{covariance2, model_in, ptzcal_rig_model};
use super::status::ptzcal_status;
use crate::error::{Error, Result};
use crate::geometry::Plane;
use crate::pose::{PlaneEstimate, PlaneFitOptions, RoofEdges, fit_plane_to_points, fit_plane_to_shots};
use nalgebra::{Matrix3, Vector2, Vector3};

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
