//! A straight line in space, and the segment in which the image shows it.

use nalgebra::{Matrix2, Matrix3, Matrix6, Vector2, Vector3};

use super::correspondences::{check_finite, check_positive};
use crate::error::{Error, Result};

/// Ends of a segment nearer to each other than this, in pixels, are one point.
const SHORTEST_SEGMENT: f64 = 1e-6;

/// A line of the scene seen as an image segment.
///
/// The segment's ends are images of no particular points of the line: what they measure is how far
/// the line's image passes them, one equation each, on the curve that a distorting lens makes of the
/// line too.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservedLine {
    /// Any point of the line, metres, world frame.
    pub point: Vector3<f64>,
    /// Of any length but zero.
    pub direction: Vector3<f64>,
    /// Of `point` and `direction` together, in that order, positive semi-definite; `None`: exact. What
    /// it says along the line has no effect.
    pub covariance: Option<Matrix6<f64>>,
    /// Of the segment, in any order, pixels.
    pub ends: [Vector2<f64>; 2],
    /// px^2, positive definite; `None`: the set's common noise.
    pub end_covariances: Option<[Matrix2<f64>; 2]>,
}

impl ObservedLine {
    /// An exact line by a point and a direction.
    pub fn new(point: Vector3<f64>, direction: Vector3<f64>, ends: [Vector2<f64>; 2]) -> Self {
        Self { point, direction, covariance: None, ends, end_covariances: None }
    }

    /// The line through two points, exact or with their covariances (m^2).
    pub fn through(points: [Vector3<f64>; 2], covariances: Option<[Matrix3<f64>; 2]>, ends: [Vector2<f64>; 2]) -> Self {
        let [a, b] = points;
        let covariance = covariances.map(|[of_a, of_b]| {
            // (a, b - a) is linear in the two independent points.
            let mut joint = Matrix6::zeros();
            joint.fixed_view_mut::<3, 3>(0, 0).copy_from(&of_a);
            joint.fixed_view_mut::<3, 3>(0, 3).copy_from(&-of_a);
            joint.fixed_view_mut::<3, 3>(3, 0).copy_from(&-of_a);
            joint.fixed_view_mut::<3, 3>(3, 3).copy_from(&(of_a + of_b));
            joint
        });
        Self { covariance, ..Self::new(a, b - a, ends) }
    }

    /// Refuses what is no line, no segment or no covariance; `index` is for the message.
    pub(super) fn check(&self, index: usize) -> Result<()> {
        check_finite(self.point.as_slice(), "line", index)?;
        check_finite(self.direction.as_slice(), "line", index)?;
        self.ends.iter().try_for_each(|end| check_finite(end.as_slice(), "uv", index))?;
        let length = self.direction.norm();
        // Two points of a line that differ in their last digits only give no direction.
        if length <= 1e-12 * self.point.norm() || length < 1e-150 {
            return Err(Error::invalid("line", format!("of measurement {index} has no direction")));
        }
        if (self.ends[1] - self.ends[0]).norm() < SHORTEST_SEGMENT {
            return Err(Error::invalid("uv", format!("the segment of line {index} has no length")));
        }
        if let Some(c) = &self.covariance {
            check_finite(c.as_slice(), "line covariance", index)?;
            // Semi-definite is fine: what is known of a line has rank four at most.
            let eigen = ((c + c.transpose()) * 0.5).try_symmetric_eigen(f64::EPSILON, 1000);
            if eigen.is_none_or(|e| e.eigenvalues.min() < -1e-9 * c.amax()) {
                let reason = format!("of measurement {index} is not positive semi-definite");
                return Err(Error::invalid("line covariance", reason));
            }
        }
        self.end_covariances.iter().flatten().try_for_each(|c| check_positive(c, index))
    }
}
