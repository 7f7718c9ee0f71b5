//! A line as the solver sees it. Its residual is the signed distances (px) of the segment's two ends
//! from the line's image: two equations with a 2x2 covariance, like a point's, so that every gate and
//! count is the same for both.
//!
//! The distance is that to the nearest point of the image curve, found anew for every camera. This
//! is the maximum-likelihood elimination of an unknown position along the line: at the nearest point
//! the derivative by that position vanishes, so that its Schur complement, the part of the residual
//! across the curve, is all that is left. Nothing of it is kept between steps, no position can run
//! away, and the line's two-point covariance couples the two ends as it should.

use nalgebra::{Matrix2, Matrix3x4, Vector2, Vector3, Vector4};

use super::line::ObservedLine;
use crate::geometry::Camera;
use crate::geometry::camera::Projection;

/// The nearest point of the line's image to an end.
pub(crate) struct Foot {
    /// Of the point on the line, with its derivatives.
    pub projection: Projection,
    /// Unit normal of the image curve there: to the right, seen from the first end to the second.
    pub normal: Vector2<f64>,
    /// Of the end from the curve, along the normal, px.
    pub distance: f64,
    /// The homogeneous point is `a (point; 1) + b (direction; 0)`.
    a: f64,
    b: f64,
}

#[derive(Debug, Clone)]
pub(crate) struct LineMeasurement {
    pub point: Vector3<f64>,
    /// Unit length.
    pub direction: Vector3<f64>,
    /// Square root of the line's covariance: independent unit errors of point and direction.
    errors: Vec<[Vector3<f64>; 2]>,
    pub ends: [Vector2<f64>; 2],
    pub end_covariances: [Matrix2<f64>; 2],
    pub assumed_noise: bool,
}

/// Newton steps to the nearest point of a curve that is nearly straight: two are enough.
const STEPS: usize = 8;
/// Movement along the curve, in pixels, that no longer matters.
const SETTLED: f64 = 1e-7;

impl LineMeasurement {
    pub fn new(line: &ObservedLine, pixel_sigma: f64, sigma_is_assumed: bool) -> Self {
        let scale = 1.0 / line.direction.norm();
        let common = Matrix2::identity() * (pixel_sigma * pixel_sigma);
        Self {
            point: line.point,
            direction: line.direction * scale,
            errors: line.covariance.as_ref().map_or_else(Vec::new, |c| square_root(c, scale)),
            ends: line.ends,
            end_covariances: line.end_covariances.unwrap_or([common; 2]),
            assumed_noise: line.end_covariances.is_none() && sigma_is_assumed,
        }
    }

    /// Independent unit-variance errors of point and direction.
    pub fn errors(&self) -> &[[Vector3<f64>; 2]] {
        &self.errors
    }

    /// Nearest points to both ends. `None` when the camera cannot see the line: it runs through the
    /// camera's centre, or both ends would show what is behind the camera. (One end beyond the
    /// line's vanishing point is noise; the image line runs on there.)
    pub fn feet(&self, camera: &Camera) -> Option<[Foot; 2]> {
        let [first, second] = [self.foot(camera, 0)?, self.foot(camera, 1)?];
        (first.a > 0.0 || second.a > 0.0).then_some([first, second])
    }

    fn foot(&self, camera: &Camera, end: usize) -> Option<Foot> {
        let pixel = &self.ends[end];
        let ray = camera.back_project(pixel)?;
        // The ray projected onto the plane of centre and line: nearest in angle, exact but for the
        // pixel's noise, and right for every direction from the centre.
        let offset = self.point - ray.origin;
        let unit = 1.0 / offset.norm();
        let (u, v) = (offset * unit, self.direction);
        let (cosine, sine2) = (u.dot(&v), u.cross(&v).norm_squared());
        let (on_u, on_v) = (u.dot(&ray.direction), v.dot(&ray.direction));
        let (mut a, mut b) = ((on_u - cosine * on_v) * unit / sine2, (on_v - cosine * on_u) / sine2);
        let along = self.ends[1] - self.ends[0];
        for step in 0.. {
            let p = camera.project_homogeneous(&(self.point * a + self.direction * b), a)?;
            // Another point of the line, independent of this one: the direction in which it moves.
            let (ta, tb) = (-b * unit * unit, a);
            let tangent = p.by_point * (self.point * ta + self.direction * tb) + p.by_weight * ta;
            let off = pixel - p.pixel;
            let speed2 = tangent.norm_squared();
            let advance = off.dot(&tangent) / speed2;
            if advance.is_nan() || speed2 == 0.0 {
                return None;
            }
            if step == STEPS || advance.abs() * speed2.sqrt() <= SETTLED {
                let t = tangent * (1f64.copysign(tangent.dot(&along)) / speed2.sqrt());
                let normal = Vector2::new(-t.y, t.x);
                return Some(Foot { projection: p, normal, distance: normal.dot(&off), a, b });
            }
            (a, b) = (a + advance * ta, b + advance * tb);
        }
        None
    }

    /// Covariance of the two distances at their feet; the noise of the ends times `factor`.
    pub fn covariance(&self, feet: &[Foot; 2], factor: f64) -> Matrix2<f64> {
        let of_end = |k: usize| factor * feet[k].normal.dot(&(self.end_covariances[k] * feet[k].normal));
        let mut covariance = Matrix2::new(of_end(0), 0.0, 0.0, of_end(1));
        for [point, direction] in &self.errors {
            let g = Vector2::from(
                feet.each_ref().map(|f| f.normal.dot(&(f.projection.by_point * (point * f.a + direction * f.b)))),
            );
            covariance += g * g.transpose();
        }
        covariance
    }

    /// The distances and their first-order covariance.
    pub fn residual(&self, camera: &Camera) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        let feet = self.feet(camera)?;
        Some((Vector2::new(feet[0].distance, feet[1].distance), self.covariance(&feet, 1.0)))
    }

    /// The same by a pinhole matrix with positive depths.
    pub fn residual_by_matrix(&self, p: &Matrix3x4<f64>) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        let [y, z] = [p * self.point.push(1.0), p * self.direction.push(0.0)];
        let line = y.cross(&z);
        let line = line / line.xy().norm();
        let ends = self.ends.map(|m| m.push(1.0));
        // The point's share in each end, of which one must be positive: not all behind the camera.
        let seen = ends.iter().any(|m| m.cross(&z).dot(&line) > 0.0);
        if !seen || !line.iter().all(|v| v.is_finite()) {
            return None;
        }
        let normal = line.xy();
        let of_end = |k: usize| normal.dot(&(self.end_covariances[k] * normal));
        let mut covariance = Matrix2::new(of_end(0), 0.0, 0.0, of_end(1));
        let scale = 1.0 / y.cross(&z).xy().norm();
        for [point, direction] in &self.errors {
            let moved = ((p * point.push(0.0)).cross(&z) + y.cross(&(p * direction.push(0.0)))) * scale;
            let g = Vector2::from(ends.map(|m| moved.dot(&m)));
            covariance += g * g.transpose();
        }
        Some((Vector2::from(ends.map(|m| line.dot(&m))), covariance))
    }

    /// Two homogeneous points that span the line in a frame scaled by `scale` about `centre`, the
    /// first one nearest to its origin, the second at infinity.
    pub fn span(&self, centre: &Vector3<f64>, scale: f64) -> Span {
        let near = self.parameter_near(centre);
        let base = (self.point + self.direction * near - centre) * scale;
        let errors =
            self.errors.iter().map(|[p, d]| [((p + d * near) * scale).push(0.0), d.push(0.0)]).collect::<Vec<_>>();
        Span { points: [base.push(1.0), self.direction.push(0.0)], errors }
    }

    /// Where along the line, from its point, it comes nearest to `x`.
    pub fn parameter_near(&self, x: &Vector3<f64>) -> f64 {
        self.direction.dot(&(x - self.point))
    }
}

/// Two points of a line, and their independent unit errors.
pub(crate) struct Span {
    pub points: [Vector4<f64>; 2],
    pub errors: Vec<[Vector4<f64>; 2]>,
}

/// Eigenvectors times root eigenvalues: right for semi-definite matrices too.
fn square_root(c: &nalgebra::Matrix6<f64>, direction_scale: f64) -> Vec<[Vector3<f64>; 2]> {
    let Some(eigen) = ((c + c.transpose()) * 0.5).try_symmetric_eigen(f64::EPSILON, 1000) else { return Vec::new() };
    (0..6)
        .filter(|i| eigen.eigenvalues[*i] > 0.0)
        .map(|i| {
            let column = eigen.eigenvectors.column(i) * eigen.eigenvalues[i].sqrt();
            let half = |from: usize| Vector3::new(column[from], column[from + 1], column[from + 2]);
            [half(0), half(3) * direction_scale]
        })
        .collect()
}
