//! How far a shot is from a plane that it is said to have hit.
//!
//! The point is homogeneous, (o rho + d; rho), and so is its distance from the plane: n . (o rho + d) - D rho,
//! linear in the inverse depth, metres times rho. It is whitened by the surface's flatness and the inverse
//! depth at which the START of the adjustment meets the plane. A distance in metres would shrink with the
//! world: a rig whose laser is not exactly known would be pulled nearer to its camera, since that makes all
//! walls flatter.

use nalgebra::Vector3;

use super::layout::PLANE;
use super::linearise::ShotPoint;
use crate::geometry::Plane;

/// A shot's homogeneous distance from a plane, with its derivatives.
pub(super) struct PlaneHit {
    pub distance: f64,
    pub by_plane: [f64; PLANE],
    pub by_local: [f64; 3],
}

impl PlaneHit {
    /// `rho`: the shot's inverse depth, to which `point` belongs.
    pub fn of(plane: &Plane, point: &ShotPoint, rho: f64) -> Self {
        let [a, b] = plane.tangents();
        let x: &Vector3<f64> = &point.xyz;
        let [depth, pan, tilt] = point.by_local.map(|by| plane.normal.dot(&by));
        Self {
            distance: plane.normal.dot(x) - plane.distance * rho,
            by_plane: [a.dot(x), b.dot(x), -rho],
            by_local: [depth - plane.distance, pan, tilt],
        }
    }

    /// The inverse depth at which the shot's ray meets the plane; its own where that is behind it or it
    /// never does.
    pub fn met_at(&self, rho: f64) -> f64 {
        let met = rho - self.distance / self.by_local[0];
        if met.is_finite() && met > 0.0 { met } else { rho }
    }
}
