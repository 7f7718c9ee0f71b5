//! Planes n . x = d with unit normal n.

use nalgebra::Vector3;

use super::line::{Line3, Ray};
use super::rigid::Rigid;

/// The plane n . x = d, |n| = 1, d in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    pub normal: Vector3<f64>,
    pub distance: f64,
}

impl Plane {
    /// From n . x = d with any length of n; `None` when n vanishes.
    pub fn new(normal: Vector3<f64>, distance: f64) -> Option<Self> {
        let norm = normal.norm();
        (norm > 1e-300 && norm.is_finite() && distance.is_finite())
            .then(|| Self { normal: normal / norm, distance: distance / norm })
    }

    /// Signed distance of a point, positive on the normal's side.
    pub fn signed_distance(&self, x: &Vector3<f64>) -> f64 {
        self.normal.dot(x) - self.distance
    }

    /// Normal turned away from the origin (distance >= 0), so that its sign means the same in
    /// every view of the plane from the same side.
    pub fn facing_away_from_origin(&self) -> Self {
        if self.distance < 0.0 { Self { normal: -self.normal, distance: -self.distance } } else { *self }
    }

    /// Where a ray meets the plane, in front of the ray's origin.
    pub fn intersect_ray(&self, ray: &Ray) -> Option<Vector3<f64>> {
        let slope = self.normal.dot(&ray.direction);
        if slope.abs() < 1e-12 {
            return None;
        }
        let s = (self.distance - self.normal.dot(&ray.origin)) / slope;
        (s > 0.0 && s.is_finite()).then(|| ray.at(s))
    }

    /// The line where two planes meet, directed along n_self x n_other; its point is the one
    /// nearest to the origin. `None` when the sine of their angle is below `min_sine`.
    pub fn intersect(&self, other: &Self, min_sine: f64) -> Option<Line3> {
        let cross = self.normal.cross(&other.normal);
        let sine2 = cross.norm_squared();
        if sine2 <= min_sine * min_sine {
            return None;
        }
        let point = (other.normal.cross(&cross) * self.distance + cross.cross(&self.normal) * other.distance) / sine2;
        Line3::new(point, cross)
    }

    /// Two unit vectors along the plane, at right angles to each other and to the normal.
    pub fn tangents(&self) -> [Vector3<f64>; 2] {
        let first = self.normal.cross(&Vector3::ith(self.normal.iamin(), 1.0)).normalize();
        [first, self.normal.cross(&first)]
    }

    /// The same plane in another frame, x' = T(x).
    pub fn transform(&self, transform: &Rigid) -> Self {
        let normal = transform.rotation * self.normal;
        Self { normal, distance: self.distance + normal.dot(&transform.translation) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rigid::exp;

    #[test]
    fn the_meeting_line_lies_in_both_planes() {
        let a = Plane::new(Vector3::new(0.3, 0.1, 2.0), 4.0).unwrap();
        let b = Plane::new(Vector3::new(-1.0, 0.7, 0.2), -0.5).unwrap();
        let line = a.intersect(&b, 1e-6).unwrap();
        for s in [-3.0, 0.0, 2.0] {
            assert!(a.signed_distance(&line.at(s)).abs() < 1e-12);
            assert!(b.signed_distance(&line.at(s)).abs() < 1e-12);
        }
        assert!(line.point.dot(&line.direction).abs() < 1e-12);
        assert!(line.direction.dot(&a.normal.cross(&b.normal)) > 0.0);
        assert!(a.intersect(&a, 1e-9).is_none());
    }

    #[test]
    fn rays_meet_planes_only_in_front() {
        let wall = Plane::new(Vector3::z(), 4.6).unwrap();
        let ray = Ray { origin: Vector3::zeros(), direction: Vector3::new(0.6, 0.0, 0.8) };
        assert!((wall.intersect_ray(&ray).unwrap().z - 4.6).abs() < 1e-12);
        let back = Ray { direction: -ray.direction, ..ray };
        assert!(wall.intersect_ray(&back).is_none());
        assert!(wall.intersect_ray(&Ray { direction: Vector3::x(), ..ray }).is_none());
    }

    #[test]
    fn transform_moves_the_plane_with_its_points() {
        let plane = Plane::new(Vector3::new(0.3, -0.4, 1.0), 2.0).unwrap();
        let t = Rigid { rotation: exp(&Vector3::new(0.3, 0.1, -0.7)), translation: Vector3::new(1.0, 2.0, 3.0) };
        let x = plane.intersect_ray(&Ray { origin: Vector3::zeros(), direction: Vector3::z() }).unwrap();
        assert!(plane.transform(&t).signed_distance(&t.apply(&x)).abs() < 1e-12);
    }
}
