//! Roof edges: the lines where two measured planes meet, and a station's list of them.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::plane_fit::{PlaneEstimate, PlaneFitOptions, fit_plane_to_shots};
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::rigid::skew;
use crate::geometry::{InverseDepthPoint, Line3};

/// The line where two planes meet. Its direction is n_a x n_b: both normals point away from the
/// rig, so that every station on the same side of the planes gives the line the same direction,
/// and the twofold ambiguity of an undirected line does not arise (maths.md section 7).
#[derive(Debug, Clone, PartialEq)]
pub struct RoofEdge {
    /// `point` is the line's point nearest to the rig's origin.
    pub line: Line3,
    /// Covariance of (point, direction) from those of the planes: metres^2, metres, 1.
    pub covariance: SMatrix<f64, 6, 6>,
}

impl RoofEdge {
    /// Refuses planes that meet at less than `min_angle` (radians).
    pub fn between(a: &PlaneEstimate, b: &PlaneEstimate, min_angle: f64) -> Result<Self> {
        let line = a.plane().intersect(&b.plane(), min_angle.sin().max(1e-9)).ok_or_else(|| {
            Error::degenerate(
                Degeneracy::Parallel,
                format!("the planes of an edge meet at less than {:.1} degrees", min_angle.to_degrees()),
            )
        })?;
        let (by_a, by_b) = derivatives(&a.n, &b.n, &line);
        let covariance = by_a * a.covariance * by_a.transpose() + by_b * b.covariance * by_b.transpose();
        Ok(Self { line, covariance })
    }
}

/// Derivatives of (point, direction) by n_a and by n_b. With c = n_a x n_b: direction c / |c|,
/// point (n_b - n_a) x c / |c|^2.
fn derivatives(a: &Vector3<f64>, b: &Vector3<f64>, line: &Line3) -> (SMatrix<f64, 6, 3>, SMatrix<f64, 6, 3>) {
    let c = a.cross(b);
    let norm2 = c.norm_squared();
    let v = line.direction;
    let by_c_direction = (Matrix3::identity() - v * v.transpose()) / norm2.sqrt();
    let by_c_point = (skew(&(b - a)) - line.point * c.transpose() * 2.0) / norm2;
    // Without the change of c, the point moves by -[c]x (dn_b - dn_a) / |c|^2.
    let direct = -skew(&c) / norm2;
    let stack = |c_by_n: Matrix3<f64>, sign: f64| {
        let mut m = SMatrix::<f64, 6, 3>::zeros();
        m.fixed_view_mut::<3, 3>(0, 0).copy_from(&(by_c_point * c_by_n + direct * sign));
        m.fixed_view_mut::<3, 3>(3, 0).copy_from(&(by_c_direction * c_by_n));
        m
    };
    (stack(-skew(b), -1.0), stack(skew(a), 1.0))
}

/// What one station measured: planes, and edges as ordered pairs of them. Two edges may share a
/// plane (a floor, say). Both stations list the same edges in the same order, the planes of each
/// edge too.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RoofEdges {
    planes: Vec<PlaneEstimate>,
    edges: Vec<[usize; 2]>,
}

impl RoofEdges {
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a plane, from [`fit_plane_to_shots`], [`fit_plane_to_points`](super::fit_plane_to_points)
    /// or [`PlaneEstimate::given`], and returns its index.
    pub fn add_plane(&mut self, plane: PlaneEstimate) -> Result<usize> {
        plane.validate()?;
        self.planes.push(plane);
        Ok(self.planes.len() - 1)
    }

    /// Adds the edge where two of the planes meet, in this order.
    pub fn add_edge(&mut self, first: usize, second: usize) -> Result<()> {
        let count = self.planes.len();
        if first >= count || second >= count || first == second {
            return Err(Error::invalid("edge", format!("planes {first} and {second} of {count}")));
        }
        self.edges.push([first, second]);
        Ok(())
    }

    /// Fits the planes of two regions' shots and adds the edge between them. Adds all or nothing.
    pub fn add_shots(
        &mut self,
        first: &[InverseDepthPoint],
        second: &[InverseDepthPoint],
        options: &PlaneFitOptions,
    ) -> Result<()> {
        let (first, second) = (fit_plane_to_shots(first, options)?, fit_plane_to_shots(second, options)?);
        let (first, second) = (self.add_plane(first)?, self.add_plane(second)?);
        self.add_edge(first, second)
    }

    pub fn planes(&self) -> &[PlaneEstimate] {
        &self.planes
    }

    /// Pairs of indices into [`planes`](Self::planes).
    pub fn edges(&self) -> &[[usize; 2]] {
        &self.edges
    }

    /// The lines of all edges. Refuses planes that meet at less than `min_angle` (radians).
    pub fn lines(&self, min_angle: f64) -> Result<Vec<RoofEdge>> {
        self.edges.iter().map(|[i, j]| RoofEdge::between(&self.planes[*i], &self.planes[*j], min_angle)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Plane;

    fn plane(x: f64, y: f64, z: f64, variance: f64) -> PlaneEstimate {
        let plane = Plane::new(Vector3::new(x, y, z), 1.0).unwrap();
        PlaneEstimate::given(&plane, Some(Matrix3::from_diagonal_element(variance))).unwrap()
    }

    #[test]
    fn the_direction_follows_the_order_of_the_planes_and_not_the_sign_of_the_normals() {
        let (wall, floor) = (plane(0.0, 0.0, 0.25, 0.0), plane(0.0, 0.8, 0.0, 0.0));
        let edge = RoofEdge::between(&wall, &floor, 0.1).unwrap();
        assert!((edge.line.direction + Vector3::x()).norm() < 1e-15);
        assert!((edge.line.point - Vector3::new(0.0, 1.25, 4.0)).norm() < 1e-14);
        let turned = Plane { normal: -Vector3::z(), distance: -4.0 };
        let again = RoofEdge::between(&PlaneEstimate::given(&turned, None).unwrap(), &floor, 0.1).unwrap();
        assert_eq!(again.line, edge.line);
        assert!((RoofEdge::between(&floor, &wall, 0.1).unwrap().line.direction - Vector3::x()).norm() < 1e-15);
    }

    #[test]
    fn derivatives_match_finite_differences() {
        let (a, b) = (Vector3::new(0.1, -0.2, 0.4), Vector3::new(-0.3, 0.25, 0.2));
        let at = |a: Vector3<f64>, b: Vector3<f64>| {
            let line = Plane::new(a, 1.0).unwrap().intersect(&Plane::new(b, 1.0).unwrap(), 1e-9).unwrap();
            SMatrix::<f64, 6, 1>::from_iterator(line.point.iter().chain(line.direction.iter()).copied())
        };
        let line = Plane::new(a, 1.0).unwrap().intersect(&Plane::new(b, 1.0).unwrap(), 1e-9).unwrap();
        let (by_a, by_b) = derivatives(&a, &b, &line);
        for i in 0..3 {
            let e = Vector3::ith(i, 1e-6);
            let numeric = (at(a + e, b) - at(a - e, b)) / 2e-6;
            assert!((numeric - by_a.column(i)).norm() < 1e-7 * (1.0 + numeric.norm()));
            let numeric = (at(a, b + e) - at(a, b - e)) / 2e-6;
            assert!((numeric - by_b.column(i)).norm() < 1e-7 * (1.0 + numeric.norm()));
        }
    }

    #[test]
    fn near_parallel_planes_make_no_edge() {
        let (a, b) = (plane(0.0, 0.0, 0.25, 0.0), plane(0.0, 0.01, 0.25, 0.0));
        let e = RoofEdge::between(&a, &b, 0.1).unwrap_err();
        assert!(matches!(e, Error::Degenerate { kind: Degeneracy::Parallel, .. }), "{e}");
        assert!(RoofEdge::between(&a, &a, 0.0).is_err());
        assert!(RoofEdge::between(&a, &b, 0.01).is_ok());
    }

    #[test]
    fn an_edge_needs_two_planes_that_are_there() {
        let mut station = RoofEdges::new();
        let i = station.add_plane(plane(0.0, 0.0, 0.25, 0.0)).unwrap();
        assert!(station.add_edge(i, i).is_err());
        assert!(station.add_edge(i, 1).is_err());
        let mut bad = plane(0.0, 0.5, 0.0, 0.0);
        bad.n.x = f64::NAN;
        assert!(matches!(station.add_plane(bad), Err(Error::NotFinite { .. })));
        assert_eq!((station.planes().len(), station.edges().len()), (1, 0));
    }
}
