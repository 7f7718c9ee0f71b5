//! What planes are sought in: points, whose noise is the same in all directions, and shots, whose
//! noise is along their rays. Both say how far a measurement is from a plane in its own standard
//! deviations, so that one search serves both.

use std::borrow::Cow;

use nalgebra::{Matrix3, Vector3};

use crate::error::Result;
use crate::geometry::InverseDepthPoint;
use crate::geometry::linalg::symmetric_eigen3;
use crate::pose::plane_fit::{Fit, maximum_likelihood, total_least_squares};

/// Measurements of surfaces. Planes are n . X = 1.
pub(super) trait Measured {
    fn count(&self) -> usize;
    /// Where a measurement is, as well as it is known; `None` at infinity.
    fn position(&self, i: usize) -> Option<Vector3<f64>>;
    /// How far measurements are from a plane, in standard deviations.
    fn residuals<'a>(&'a self, n: &Vector3<f64>) -> impl Fn(usize) -> f64 + 'a;
    /// The plane through three measurements or more, without weights and without checks.
    fn quick_fit(&self, used: &[u32]) -> Option<Vector3<f64>>;
    /// The plane by maximum likelihood, with its covariance, or why there is none.
    fn fit(&self, used: &[u32]) -> Result<Fit>;
    /// The same kind of measurements, fewer.
    fn subset(&self, chosen: &[u32]) -> Self;
}

/// Points with one standard deviation in every direction, metres.
pub(super) struct Cloud<'p> {
    pub points: Cow<'p, [Vector3<f64>]>,
    pub sigma: f64,
}

impl Measured for Cloud<'_> {
    fn count(&self) -> usize {
        self.points.len()
    }

    fn position(&self, i: usize) -> Option<Vector3<f64>> {
        Some(self.points[i])
    }

    fn residuals<'a>(&'a self, n: &Vector3<f64>) -> impl Fn(usize) -> f64 + 'a {
        let distance = 1.0 / (n.norm() * self.sigma);
        let normal = n * distance;
        move |i| normal.dot(&self.points[i]) - distance
    }

    fn quick_fit(&self, used: &[u32]) -> Option<Vector3<f64>> {
        let (count, origin) = (used.len() as f64, self.points[*used.first()? as usize]);
        let (mut sum, mut square) = (Vector3::zeros(), Matrix3::zeros());
        for i in used {
            let x = self.points[*i as usize] - origin;
            sum += x;
            square += x * x.transpose();
        }
        let centre = sum / count;
        let (_, axes) = symmetric_eigen3(&(square / count - centre * centre.transpose()))?;
        let n = axes[2] / axes[2].dot(&(centre + origin));
        n.iter().all(|v| v.is_finite()).then_some(n)
    }

    fn fit(&self, used: &[u32]) -> Result<Fit> {
        total_least_squares(&self.subset(used).points, Some(self.sigma))
    }

    fn subset(&self, chosen: &[u32]) -> Self {
        Self { points: chosen.iter().map(|i| self.points[*i as usize]).collect(), sigma: self.sigma }
    }
}

/// Points on rays.
pub(super) struct Shots {
    shots: Vec<InverseDepthPoint>,
    /// Inverse standard deviations.
    weights: Vec<f64>,
}

impl Shots {
    pub fn new(shots: Vec<InverseDepthPoint>) -> Self {
        let weights = shots.iter().map(|s| s.variance.sqrt().recip()).collect();
        Self { shots, weights }
    }
}

impl Measured for Shots {
    fn count(&self) -> usize {
        self.shots.len()
    }

    fn position(&self, i: usize) -> Option<Vector3<f64>> {
        self.shots[i].point()
    }

    fn residuals<'a>(&'a self, n: &Vector3<f64>) -> impl Fn(usize) -> f64 + 'a {
        let n = *n;
        move |i| {
            let shot = &self.shots[i];
            let r = (shot.rho - n.dot(&shot.direction) / (1.0 - n.dot(&shot.origin))) * self.weights[i];
            if r.is_nan() { f64::INFINITY } else { r }
        }
    }

    /// n . (o rho + d) = rho is linear in n.
    fn quick_fit(&self, used: &[u32]) -> Option<Vector3<f64>> {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for i in used {
            let (s, w) = (&self.shots[*i as usize], self.weights[*i as usize]);
            let row = (s.origin * s.rho + s.direction) * w;
            normal += row * row.transpose();
            right += row * (s.rho * w);
        }
        let n = normal.cholesky()?.solve(&right);
        n.iter().all(|v| v.is_finite()).then_some(n)
    }

    fn fit(&self, used: &[u32]) -> Result<Fit> {
        maximum_likelihood(&self.subset(used).shots)
    }

    fn subset(&self, chosen: &[u32]) -> Self {
        Self::new(chosen.iter().map(|i| self.shots[*i as usize]).collect())
    }
}
