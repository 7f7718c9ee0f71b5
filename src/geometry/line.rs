//! Rays and lines in space.

use nalgebra::{Matrix2, Matrix6, Vector2, Vector3};

/// A half line from `origin` along the unit vector `direction`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    pub origin: Vector3<f64>,
    pub direction: Vector3<f64>,
}

impl Ray {
    /// The point at `distance` (metres) from the origin.
    pub fn at(&self, distance: f64) -> Vector3<f64> {
        self.origin + self.direction * distance
    }
}

/// An infinite line through `point` along the unit vector `direction`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line3 {
    pub point: Vector3<f64>,
    pub direction: Vector3<f64>,
}

impl Line3 {
    /// `None` when the direction vanishes or is not finite.
    pub fn new(point: Vector3<f64>, direction: Vector3<f64>) -> Option<Self> {
        let direction = direction.try_normalize(1e-300)?;
        let finite = point.iter().chain(direction.iter()).all(|v| v.is_finite());
        finite.then_some(Self { point, direction })
    }

    pub fn at(&self, s: f64) -> Vector3<f64> {
        self.point + self.direction * s
    }

    /// Distance of a point to the line.
    pub fn distance(&self, x: &Vector3<f64>) -> f64 {
        (x - self.point).cross(&self.direction).norm()
    }

    /// Feet of the common perpendicular on `self` and on `other`; `None` when the sine of the angle
    /// between them is below `min_sine` (parallel lines have no unique one).
    pub fn common_perpendicular(&self, other: &Self, min_sine: f64) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let (v, u) = (self.direction, other.direction);
        if v.cross(&u).norm() <= min_sine {
            return None;
        }
        let w = other.point - self.point;
        let c = v.dot(&u);
        let s = Matrix2::new(1.0, -c, c, -1.0).try_inverse()? * Vector2::new(v.dot(&w), u.dot(&w));
        Some((self.at(s.x), other.at(s.y)))
    }
}

/// A piece of a line, measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredLine {
    /// Metres.
    pub point: Vector3<f64>,
    /// Unit length. Of a line seen in an image, the bright side is on its right there.
    pub direction: Vector3<f64>,
    /// Of `point` and `direction` together, in that order, positive semi-definite; what it says along
    /// the line has no meaning.
    pub covariance: Matrix6<f64>,
    /// From where to where it was seen: distances from `point` along `direction`, metres.
    pub extent: [f64; 2],
}

impl MeasuredLine {
    pub fn at(&self, s: f64) -> Vector3<f64> {
        self.point + self.direction * s
    }

    pub fn ends(&self) -> [Vector3<f64>; 2] {
        self.extent.map(|s| self.at(s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn common_perpendicular_is_perpendicular_to_both() {
        let a = Line3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(1.0, 0.2, -0.4)).unwrap();
        let b = Line3::new(Vector3::new(-2.0, 0.5, 7.0), Vector3::new(0.1, 1.0, 0.3)).unwrap();
        let (p, q) = a.common_perpendicular(&b, 1e-6).unwrap();
        assert!(a.distance(&p) < 1e-12 && b.distance(&q) < 1e-12);
        assert!((q - p).dot(&a.direction).abs() < 1e-12 && (q - p).dot(&b.direction).abs() < 1e-12);
    }

    #[test]
    fn parallel_lines_have_none() {
        let a = Line3::new(Vector3::zeros(), Vector3::x()).unwrap();
        let b = Line3::new(Vector3::y(), -Vector3::x()).unwrap();
        assert!(a.common_perpendicular(&b, 1e-9).is_none());
        assert!(Line3::new(Vector3::zeros(), Vector3::zeros()).is_none());
    }
}
