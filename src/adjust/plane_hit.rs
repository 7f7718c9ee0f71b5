//! How far a shot is from a plane that it is said to have hit.

use super::layout::PLANE;
use super::linearise::ShotPoint;
use crate::geometry::Plane;

/// A shot's distance from a plane, metres, with its derivatives.
pub(super) struct PlaneHit {
    pub distance: f64,
    pub by_plane: [f64; PLANE],
    pub by_local: [f64; 3],
}

impl PlaneHit {
    /// `None` for a shot at or beyond infinity.
    pub fn of(plane: &Plane, point: &ShotPoint, rho: f64) -> Option<Self> {
        let x = Some(point.xyz / rho).filter(|x| rho > 0.0 && x.iter().all(|v| v.is_finite()))?;
        let [a, b] = plane.tangents();
        let [depth, pan, tilt] = point.by_local;
        Some(Self {
            distance: plane.signed_distance(&x),
            by_plane: [a.dot(&x), b.dot(&x), -1.0],
            by_local: [depth - x, pan, tilt].map(|by| plane.normal.dot(&by) / rho),
        })
    }
}
