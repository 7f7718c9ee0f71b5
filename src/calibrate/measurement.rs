//! Observations as the solver sees them: points and shots share one form, a homogeneous point that is
//! linear in an unknown inverse depth; lines have their own.

use nalgebra::{Matrix2, Matrix3, Matrix3x4, Vector2, Vector3, Vector4};

use super::correspondences::Observation;
use super::line_measurement::LineMeasurement;
use crate::error::Result;
use crate::geometry::linalg::symmetric_eigen3;
use crate::geometry::{Camera, InverseDepthPoint};

/// One observation: a residual of two numbers with its covariance under every camera.
#[derive(Debug, Clone)]
pub(crate) enum Measurement {
    Point(PointMeasurement),
    Line(LineMeasurement),
}

impl Measurement {
    /// `pixel_sigma`: noise of pixels without a covariance of their own.
    pub fn new(observation: &Observation, pixel_sigma: f64, sigma_is_assumed: bool) -> Self {
        match observation {
            Observation::Shot { shot, pixel, pixel_covariance } => {
                Self::Point(PointMeasurement::shot(shot, *pixel, *pixel_covariance))
            }
            Observation::Point { world, world_covariance, pixel, pixel_covariance } => Self::Point(PointMeasurement {
                pixel_covariance: pixel_covariance.unwrap_or_else(|| Matrix2::identity() * (pixel_sigma * pixel_sigma)),
                assumed_noise: pixel_covariance.is_none() && sigma_is_assumed,
                ..PointMeasurement::point(world, world_covariance.as_ref(), *pixel)
            }),
            Observation::Line(line) => Self::Line(LineMeasurement::new(line, pixel_sigma, sigma_is_assumed)),
        }
    }

    pub fn as_point(&self) -> Option<&PointMeasurement> {
        if let Self::Point(point) = self { Some(point) } else { None }
    }

    pub fn as_line(&self) -> Option<&LineMeasurement> {
        if let Self::Line(line) = self { Some(line) } else { None }
    }

    /// The pixels' noise is not known but assumed.
    pub fn assumed_noise(&self) -> bool {
        match self {
            Self::Point(point) => point.assumed_noise,
            Self::Line(line) => line.assumed_noise,
        }
    }

    /// A point without any noise of its own.
    pub fn is_exact(&self) -> bool {
        self.as_point().is_some_and(PointMeasurement::is_exact)
    }

    /// Where it was seen: one pixel, or a segment's ends.
    pub fn pixels(&self) -> &[Vector2<f64>] {
        match self {
            Self::Point(point) => std::slice::from_ref(&point.pixel),
            Self::Line(line) => &line.ends,
        }
    }

    /// The same measurement with its pixels and their covariances in another image.
    pub fn map_pixels(
        &self,
        map: impl Fn(&Vector2<f64>, &Matrix2<f64>) -> Result<(Vector2<f64>, Matrix2<f64>)>,
    ) -> Result<Self> {
        let mut mapped = self.clone();
        match &mut mapped {
            Self::Point(m) => (m.pixel, m.pixel_covariance) = map(&m.pixel, &m.pixel_covariance)?,
            Self::Line(m) => {
                for (end, covariance) in m.ends.iter_mut().zip(&mut m.end_covariances) {
                    (*end, *covariance) = map(end, covariance)?;
                }
            }
        }
        Ok(mapped)
    }

    /// Squared Mahalanobis distance from the prediction by a pinhole matrix, errors of the point or
    /// line included to first order; infinite behind the camera (P scaled to depths > 0).
    pub fn distance_by_matrix(&self, p: &Matrix3x4<f64>) -> f64 {
        match self {
            Self::Point(point) => point.residual_by_matrix(p),
            Self::Line(line) => line.residual_by_matrix(p),
        }
        .map_or(f64::INFINITY, |(r, c)| squared_distance(&r, &c))
    }

    /// Residual (px) and its first-order covariance: measured minus predicted pixel at the measured
    /// depth; of a line the distances of the segment's ends.
    pub fn residual(&self, camera: &Camera) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        match self {
            Self::Point(point) => point.residual(camera),
            Self::Line(line) => line.residual(camera),
        }
    }

    /// Like [`distance_by_matrix`](Self::distance_by_matrix), for a camera with its lens.
    pub fn distance(&self, camera: &Camera) -> f64 {
        self.residual(camera).map_or(f64::INFINITY, |(r, c)| squared_distance(&r, &c))
    }
}

/// X(rho) = base + rho * slope, rho ~ N(measured, sigma_rho^2), seen at `pixel`.
#[derive(Debug, Clone)]
pub(crate) struct PointMeasurement {
    base: Vector4<f64>,
    slope: Vector4<f64>,
    /// Measured inverse depth; 0 for points.
    pub rho: f64,
    /// 0 when there is no unknown depth.
    pub sigma_rho: f64,
    /// Square root of a point's covariance, `None` when exact. Apart, so that many points are few bytes.
    world_root: Option<Box<Matrix3<f64>>>,
    pub pixel: Vector2<f64>,
    pub pixel_covariance: Matrix2<f64>,
    /// The pixel's noise is not known but assumed.
    pub assumed_noise: bool,
}

impl PointMeasurement {
    fn shot(shot: &InverseDepthPoint, pixel: Vector2<f64>, pixel_covariance: Matrix2<f64>) -> Self {
        Self {
            base: shot.direction.push(0.0),
            slope: shot.origin.push(1.0),
            rho: shot.rho,
            sigma_rho: shot.variance.sqrt(),
            world_root: None,
            pixel,
            pixel_covariance,
            assumed_noise: false,
        }
    }

    /// With a pixel noise of 1 px.
    fn point(world: &Vector3<f64>, covariance: Option<&Matrix3<f64>>, pixel: Vector2<f64>) -> Self {
        // Eigenvectors times root eigenvalues: right for semi-definite matrices too.
        let root = |c| {
            let (values, axes) = symmetric_eigen3(c).unwrap_or_default();
            Box::new(Matrix3::from_columns(&[0, 1, 2].map(|i| axes[i] * values[i].max(0.0).sqrt())))
        };
        Self {
            base: world.push(1.0),
            slope: Vector4::zeros(),
            rho: 0.0,
            sigma_rho: 0.0,
            world_root: covariance.map(root),
            pixel,
            pixel_covariance: Matrix2::identity(),
            assumed_noise: false,
        }
    }

    pub fn has_depth(&self) -> bool {
        self.sigma_rho > 0.0
    }

    pub fn is_exact(&self) -> bool {
        !self.has_depth() && !self.has_world_covariance()
    }

    pub fn has_world_covariance(&self) -> bool {
        self.world_root.is_some()
    }

    pub fn homogeneous(&self, rho: f64) -> Vector4<f64> {
        self.base + self.slope * rho
    }

    /// Metric position at the measured depth; `None` at or beyond infinity.
    pub fn position(&self) -> Option<Vector3<f64>> {
        let x = self.homogeneous(self.rho);
        (x.w > 1e-6).then(|| x.xyz() / x.w)
    }

    pub fn slope(&self) -> &Vector4<f64> {
        &self.slope
    }

    /// Independent unit-variance errors of the homogeneous point, one column each (shots: one).
    pub fn noise_columns(&self) -> impl Iterator<Item = Vector4<f64>> + '_ {
        let depth = self.has_depth().then(|| self.slope * self.sigma_rho);
        let world = self.world_root.iter().flat_map(|root| root.column_iter().map(|column| column.push(0.0)));
        depth.into_iter().chain(world)
    }

    fn residual_by_matrix(&self, p: &Matrix3x4<f64>) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        let y = p * self.homogeneous(self.rho);
        if y.z.is_nan() || y.z <= 0.0 {
            return None;
        }
        let image = y.xy() / y.z;
        let mut covariance = self.pixel_covariance;
        for column in self.noise_columns() {
            let e = p * column;
            let g = (e.xy() - image * e.z) / y.z;
            covariance += g * g.transpose();
        }
        Some((self.pixel - image, covariance))
    }

    fn residual(&self, camera: &Camera) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        let x = self.homogeneous(self.rho);
        if self.is_exact() {
            let pixel = camera.project(&x.xyz())?;
            return Some((self.pixel - pixel, self.pixel_covariance));
        }
        let p = camera.project_homogeneous(&x.xyz(), x.w)?;
        let mut covariance = self.pixel_covariance;
        for column in self.noise_columns() {
            let g = p.by_point * column.xyz() + p.by_weight * column.w;
            covariance += g * g.transpose();
        }
        Some((self.pixel - p.pixel, covariance))
    }
}

/// r^T C^-1 r.
pub(crate) fn squared_distance(r: &Vector2<f64>, c: &Matrix2<f64>) -> f64 {
    let d = (c.m22 * r.x * r.x - 2.0 * c.m12 * r.x * r.y + c.m11 * r.y * r.y) / c.determinant();
    if d.is_finite() { d } else { f64::INFINITY }
}
