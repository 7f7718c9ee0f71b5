//! Radial alignment (Tsai 1987; maths.md sections 5 and 9.4): a camera with radial distortion in two
//! linear steps, without a choice among roots and without a singularity at zero distortion.
//!
//! A radial lens moves an image point along its ray from the centre, so the direction of (u, v) is
//! that of (P1.X, P2.X) whatever the lens: -v P1.X + u P2.X = 0 gives P1 and P2 (step 1). Along the ray
//! (u, v, g(r)) ~ (P1.X, P2.X, P3.X) with g = 1 + lambda1 r^2 + lambda2 r^4 + ... is linear in P3 and
//! the lambdas (step 2). One lambda is the division model; more of them follow any radial lens, also a
//! fisheye beyond 90 degrees, where g < 0 (Scaramuzza's polynomial).
//!
//! Both steps take measurements in inverse depth with their noise, like `dlt::inverse_depth`: the
//! algebraic error under Taubin's norm, then each row once more weighted by its own noise.

use nalgebra::{Matrix2, Matrix3x4, Matrix4, SMatrix, SVector, Vector2, Vector3, Vector4};

use super::Correspondences;
use super::consensus::Model;
use super::division_camera::DivisionCamera;
use super::measurement::{Measurement, PointMeasurement, squared_distance};
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::linalg::{Normalisation3, largest_generalised_eigenvector};

/// Fewest points: step 1 has eight unknowns up to scale and one equation a point.
pub const MIN_POINTS: usize = 7;

/// Most coefficients of g.
pub(crate) const MAX_TERMS: usize = 3;

/// Radial alignment with the division model on a whole set of measurements, taken as free of
/// outliers. `centre` is the centre of distortion, px (`None`: the image's centre); lambda is biased by
/// a wrong one, and `calibrate_camera` finds it.
///
/// Accuracy (make accuracy): lambda at 1.1 to 1.3 times the Cramer-Rao bound for exact points.
///
/// # Errors
/// `TooFewPoints` below seven, `NotFinite`, `Degenerate` when the points do not determine the camera.
pub fn radial_alignment(set: &Correspondences, centre: Option<Vector2<f64>>) -> Result<DivisionCamera> {
    let centre = DivisionCamera::centre_for(set, centre)?;
    if set.len() < MIN_POINTS {
        return Err(Error::TooFewPoints { given: set.len(), needed: MIN_POINTS });
    }
    let measurements = DivisionCamera::points(set)?;
    let measurements: Vec<&Measurement> = measurements.iter().collect();
    let found = Alignment::of(&measurements, centre, 1).and_then(|a| a.fit(&measurements, ThirdRow::Free));
    let camera = found.ok_or_else(|| {
        Error::degenerate(Degeneracy::IllConditioned, "the points do not determine a camera with radial distortion")
    })?;
    DivisionCamera::new(set, centre, camera.undistorted(), camera.coefficients[0])
}

/// A camera with a radial lens about a known centre: (u, v, g(r)) ~ P X, pixels about the centre.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RadialCamera {
    pub centre: Vector2<f64>,
    /// Scaled so that (P1.X, P2.X) points to where the point is seen.
    pub projection: Matrix3x4<f64>,
    /// Of r^2, r^4, r^6 in g, pixels^-2, ^-4, ^-6.
    pub coefficients: [f64; MAX_TERMS],
}

impl RadialCamera {
    /// g and its derivative at a radius.
    pub fn g(&self, r: f64) -> (f64, f64) {
        let [a, b, c] = self.coefficients;
        let s = r * r;
        (1.0 + s * (a + s * (b + s * c)), r * (2.0 * a + s * (4.0 * b + s * 6.0 * c)))
    }

    /// The projection matrix to undistorted pixels.
    pub fn undistorted(&self) -> Matrix3x4<f64> {
        let mut p = self.projection;
        for (i, c) in [self.centre.x, self.centre.y].into_iter().enumerate() {
            let shifted = p.row(i) + p.row(2) * c;
            p.set_row(i, &shifted);
        }
        p
    }
}

impl Model for RadialCamera {
    /// To first order along the ray from the centre, exact across it.
    fn distance(&self, m: &Measurement) -> f64 {
        // Lines take no part in this consensus: bent by the lens, they have no radial form.
        let Measurement::Point(m) = m else { return f64::INFINITY };
        let y = self.projection * m.homogeneous(m.rho);
        let spread = y.xy().norm();
        let along = y.xy() / spread;
        let across = Vector2::new(-along.y, along.x);
        let d = m.pixel - self.centre;
        let r = d.dot(&along);
        let (g, slope) = self.g(r);
        // d/dr of r z - S g, positive where the lens grows.
        let steep = y.z - spread * slope;
        if !(r >= 0.0 && steep > 0.0) {
            return f64::INFINITY;
        }
        let residual = Vector2::new((r * y.z - spread * g) / steep, d.dot(&across));
        let turn = Matrix2::from_columns(&[along, across]);
        let mut covariance = turn.transpose() * m.pixel_covariance * turn;
        for column in m.noise_columns() {
            let n = self.projection * column;
            let shift = Vector2::new((g * n.xy().dot(&along) - r * n.z) / steep, r * n.xy().dot(&across) / spread);
            covariance += shift * shift.transpose();
        }
        squared_distance(&residual, &covariance)
    }
}

/// What is asked of the third row of P.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ThirdRow {
    /// Nothing: skew, aspect and principal point are the data's.
    Free,
    /// Tsai's camera: square pixels, the principal point at the centre. For sets with little relief.
    Square,
}

/// The two steps in normalised coordinates.
pub(crate) struct Alignment {
    space: Matrix4<f64>,
    centre: Vector2<f64>,
    /// Pixels to units of the mean radius.
    scale: f64,
    terms: usize,
}

/// A measurement in normalised coordinates.
struct Row {
    x: Vector4<f64>,
    pixel: Vector2<f64>,
    covariance: Matrix2<f64>,
    noise: Vec<Vector4<f64>>,
}

impl Alignment {
    /// For sets like `measurements`, with `terms` coefficients of g (1 to 3).
    pub fn of(measurements: &[&Measurement], centre: Vector2<f64>, terms: usize) -> Option<Self> {
        let points = measurements.iter().filter_map(|m| m.as_point());
        let space = Normalisation3::of(points.clone().filter_map(PointMeasurement::position))?;
        let mean = points.clone().map(|m| (m.pixel - centre).norm()).sum::<f64>() / points.count() as f64;
        let scale = 1.0 / mean;
        scale.is_finite().then(|| Self { space: space.matrix(), centre, scale, terms: terms.clamp(1, MAX_TERMS) })
    }

    /// The efficient fit, to any number of measurements from seven on.
    pub fn fit(&self, measurements: &[&Measurement], third: ThirdRow) -> Option<RadialCamera> {
        self.fit_in_passes(measurements, third, 2)
    }

    /// The plain fit, for samples.
    pub fn fit_once(&self, measurements: &[&Measurement], third: ThirdRow) -> Option<RadialCamera> {
        self.fit_in_passes(measurements, third, 1)
    }

    fn fit_in_passes(&self, measurements: &[&Measurement], third: ThirdRow, passes: usize) -> Option<RadialCamera> {
        let rows: Vec<Row> = measurements.iter().filter_map(|m| m.as_point()).map(|m| self.row(m)).collect();
        if rows.len() < MIN_POINTS {
            return None;
        }
        let mut first_two = step_1(&rows, passes)?;
        let basis = match third {
            ThirdRow::Free => [Vector4::x(), Vector4::y(), Vector4::z(), Vector4::w()].to_vec(),
            ThirdRow::Square => {
                let normal = orthogonal(&mut first_two)?;
                vec![normal.push(0.0), Vector4::w()]
            }
        };
        let (third, g) = step_2(&rows, &first_two, &basis, self.terms, passes)?;
        let mut projection = Matrix3x4::zeros();
        projection.set_row(0, &(first_two[0] / self.scale).transpose());
        projection.set_row(1, &(first_two[1] / self.scale).transpose());
        projection.set_row(2, &third.transpose());
        let projection = projection * self.space;
        let size = projection.fixed_view::<1, 3>(2, 0).norm();
        let coefficients = std::array::from_fn(|i| g[i] * self.scale.powi(2 * i as i32 + 2));
        // A mirrored camera is none.
        let proper = projection.fixed_columns::<3>(0).determinant() > 0.0 && size.is_finite() && size > 0.0;
        proper.then(|| RadialCamera { centre: self.centre, projection: projection / size, coefficients })
    }

    fn row(&self, m: &PointMeasurement) -> Row {
        Row {
            x: self.space * m.homogeneous(m.rho),
            pixel: (m.pixel - self.centre) * self.scale,
            covariance: m.pixel_covariance * (self.scale * self.scale),
            noise: m.noise_columns().map(|column| self.space * column).collect(),
        }
    }
}

type Matrix8 = SMatrix<f64, 8, 8>;
type Vector8 = SVector<f64, 8>;

/// P1 and P2 from -v P1.X + u P2.X = 0, with u P1.X + v P2.X > 0 for most.
fn step_1(rows: &[Row], passes: usize) -> Option<[Vector4<f64>; 2]> {
    let mut p = Vector8::zeros();
    let equation = |pixel: &Vector2<f64>, x: &Vector4<f64>| {
        Vector8::from_fn(|i, _| if i < 4 { -pixel.y * x[i] } else { pixel.x * x[i - 4] })
    };
    for pass in 0..passes {
        let (mut h, mut n) = (Matrix8::zeros(), Matrix8::zeros());
        for row in rows {
            // Derivatives by the pixel's two coordinates, then by the point's own errors.
            let by_pixel = [equation(&Vector2::x(), &row.x), equation(&Vector2::y(), &row.x)];
            let c = &row.covariance;
            let mut noise = by_pixel[0] * by_pixel[0].transpose() * c.m11
                + by_pixel[1] * by_pixel[1].transpose() * c.m22
                + (by_pixel[0] * by_pixel[1].transpose() + by_pixel[1] * by_pixel[0].transpose()) * c.m12;
            for b in row.noise.iter().map(|y| equation(&row.pixel, y)) {
                noise += b * b.transpose();
            }
            let weight = if pass == 0 { 1.0 } else { 1.0 / p.dot(&(noise * p)) };
            let a = equation(&row.pixel, &row.x);
            h += a * a.transpose() * weight;
            n += noise * weight;
        }
        for i in 0..8 {
            h[(i, i)] *= 1.0 + RIDGE;
        }
        p = largest_generalised_eigenvector(&n, &h)?;
    }
    let (mut p1, mut p2) = (p.fixed_rows::<4>(0).into_owned(), p.fixed_rows::<4>(4).into_owned());
    let facing = rows.iter().filter(|r| r.pixel.x * p1.dot(&r.x) + r.pixel.y * p2.dot(&r.x) > 0.0).count();
    if 2 * facing < rows.len() {
        (p1, p2) = (-p1, -p2);
    }
    Some([p1, p2])
}

/// Noiseless data make the normal matrices singular along the answer: a ridge far below any noise
/// keeps them definite.
const RIDGE: f64 = 1e-14;

/// Makes the directions of both rows orthogonal and of one length, changing them as little as
/// possible; their normal.
fn orthogonal(rows: &mut [Vector4<f64>; 2]) -> Option<Vector3<f64>> {
    let (a, b) = (rows[0].xyz(), rows[1].xyz());
    let length = 0.5 * (a.norm() + b.norm());
    let (a, b) = (a.try_normalize(1e-12)?, b.try_normalize(1e-12)?);
    let (sum, difference) = ((a + b).try_normalize(1e-6)?, (a - b).try_normalize(1e-6)?);
    let (a, b) = ((sum + difference) / 2f64.sqrt(), (sum - difference) / 2f64.sqrt());
    for (row, direction) in rows.iter_mut().zip([a, b]) {
        *row = (direction * length).push(row.w);
    }
    Some(a.cross(&b))
}

/// P3, as a combination of `basis`, and the coefficients of g from r P3.X = S g(r), S the length of
/// (P1.X, P2.X) along the pixel's ray.
fn step_2(
    rows: &[Row],
    [p1, p2]: &[Vector4<f64>; 2],
    basis: &[Vector4<f64>],
    terms: usize,
    passes: usize,
) -> Option<(Vector4<f64>, [f64; MAX_TERMS])> {
    let head = basis.len();
    // Of the eight places those that are not needed stay empty.
    let size = head + 1 + terms;
    let mut q = Vector8::zeros();
    for pass in 0..passes {
        let (mut h, mut n) = (Matrix8::zeros(), Matrix8::zeros());
        for row in rows {
            let r = row.pixel.norm();
            let along = row.pixel / r;
            let spread = |x: &Vector4<f64>| along.x * p1.dot(x) + along.y * p2.dot(x);
            let seen = spread(&row.x);
            // On the other side of the centre: an outlier. At the centre: says nothing.
            if seen.is_nan() || seen <= 0.0 {
                continue;
            }
            let equation = |x: &Vector4<f64>| {
                let s = spread(x);
                Vector8::from_fn(|i, _| match i.checked_sub(head) {
                    None => r * basis[i].dot(x),
                    Some(k) if i < size => -s * r.powi(2 * k as i32),
                    Some(_) => 0.0,
                })
            };
            let by_radius = Vector8::from_fn(|i, _| match i.checked_sub(head) {
                None => basis[i].dot(&row.x),
                Some(k) if k > 0 && i < size => -seen * 2.0 * k as f64 * r.powi(2 * k as i32 - 1),
                Some(_) => 0.0,
            });
            let mut noise = by_radius * by_radius.transpose() * along.dot(&(row.covariance * along));
            for b in row.noise.iter().map(equation) {
                noise += b * b.transpose();
            }
            let weight = if pass == 0 { 1.0 } else { 1.0 / q.dot(&(noise * q)) };
            let a = equation(&row.x);
            h += a * a.transpose() * weight;
            n += noise * weight;
        }
        for i in 0..8 {
            h[(i, i)] = if i < size { h[(i, i)] * (1.0 + RIDGE) } else { 1.0 };
        }
        q = largest_generalised_eigenvector(&n, &h)?;
    }
    let q = q / q[head];
    if q.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let third = basis.iter().zip(q.iter()).map(|(b, k)| b * *k).sum();
    Some((third, std::array::from_fn(|i| if i < terms { q[head + 1 + i] } else { 0.0 })))
}
