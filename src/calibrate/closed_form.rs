//! Closed form for noisy measurements: the algebraic error under Taubin's norm (the noise's known
//! covariance), then once more with each row whitened by its own noise. For laser shots in inverse
//! depth this sits on the Cramer-Rao bound without iteration (maths.md section 9.2); for exact points
//! it is DLT-Points with its rows weighted by depth, for lines DLT-Lines with the noise of the
//! segments' ends carried into l. Depends only on the ratio of the noises.

use nalgebra::{Matrix2, Matrix3, Matrix3x4, Matrix4, SVector, Vector2, Vector3, Vector4};

use super::dlt::{Frame, MIN_POINTS};
use super::line_measurement::Span;
use super::measurement::{Measurement, PointMeasurement};
use crate::geometry::linalg::{Matrix12, largest_generalised_eigenvector};

/// The rows of P, stacked.
type Stacked = SVector<f64, 12>;

/// P with depths positive; `None` when the measurements do not determine it.
pub(crate) fn inverse_depth(measurements: &[&Measurement]) -> Option<Matrix3x4<f64>> {
    if measurements.len() < MIN_POINTS {
        return None;
    }
    let frame = Frame::of(measurements)?;
    let t = frame.space.matrix();
    let mut p = Stacked::zeros();
    for pass in 0..2 {
        let (mut h, mut n) = (Matrix12::zeros(), Matrix12::zeros());
        for m in measurements {
            let e = Equations::of(m, &frame, &t);
            let w = if pass == 0 { Matrix2::identity() } else { inverse(&e.covariance(&p, &t))? };
            e.accumulate(&w, &t, &mut h, &mut n);
        }
        mirror(&mut h);
        mirror(&mut n);
        // Noiseless data make H singular along the answer: a ridge far below any noise keeps it definite.
        for i in 0..12 {
            h[(i, i)] *= 1.0 + 1e-14;
        }
        p = largest_generalised_eigenvector(&n, &h)?;
    }
    frame.denormalise(p.as_slice())
}

/// The two algebraic equations of a measurement in the normalised frame, and their noise.
enum Equations<'a> {
    /// P1.x - u P3.x = 0 and P2.x - v P3.x = 0; the noise is the pixel's.
    Point { m: &'a PointMeasurement, x: Vector4<f64>, pixel: Vector2<f64>, noise: Matrix2<f64> },
    /// l.(P x) = 0 for two points x of the line; the noise is l's.
    Line { l: Vector3<f64>, span: Span, noise: Matrix3<f64> },
}

impl<'a> Equations<'a> {
    fn of(m: &'a Measurement, frame: &Frame, t: &Matrix4<f64>) -> Self {
        match m {
            Measurement::Point(m) => Self::Point {
                m,
                x: t * m.homogeneous(m.rho),
                pixel: frame.image.apply(&m.pixel),
                noise: m.pixel_covariance * (frame.image.scale * frame.image.scale),
            },
            Measurement::Line(m) => {
                let (l, noise) = frame.image_line(m);
                Self::Line { l, span: frame.span(m), noise }
            }
        }
    }

    /// Covariance of the two algebraic residuals under the current P.
    fn covariance(&self, p: &Stacked, t: &Matrix4<f64>) -> Matrix2<f64> {
        match self {
            Self::Point { m, x, pixel, noise } => {
                let depth = row(p, 2, x);
                let mut covariance = noise * (depth * depth);
                for column in m.noise_columns() {
                    let y = t * column;
                    let third = row(p, 2, &y);
                    let q = Vector2::new(row(p, 0, &y) - pixel.x * third, row(p, 1, &y) - pixel.y * third);
                    covariance += q * q.transpose();
                }
                covariance
            }
            Self::Line { l, span, noise } => {
                let image = |x: &Vector4<f64>| Vector3::new(row(p, 0, x), row(p, 1, x), row(p, 2, x));
                let [y, z] = span.points.each_ref().map(image);
                let (ny, nz) = (noise * y, noise * z);
                let mut covariance = Matrix2::new(y.dot(&ny), y.dot(&nz), z.dot(&ny), z.dot(&nz));
                for error in &span.errors {
                    let q = Vector2::from(error.each_ref().map(|e| l.dot(&image(e))));
                    covariance += q * q.transpose();
                }
                covariance
            }
        }
    }

    /// Adds R^T W R to the upper triangle of `h`, and what noise adds to it on average to that of `n`.
    fn accumulate(&self, w: &Matrix2<f64>, t: &Matrix4<f64>, h: &mut Matrix12, n: &mut Matrix12) {
        match self {
            Self::Point { m, x, pixel, noise } => {
                accumulate(h, w, x, pixel);
                for column in m.noise_columns() {
                    accumulate(n, w, &(t * column), pixel);
                }
                let third = (w * noise).trace();
                for i in 0..4 {
                    for j in i..4 {
                        n[(8 + i, 8 + j)] += third * x[i] * x[j];
                    }
                }
            }
            Self::Line { l, span, noise } => {
                let weighted = |[a, b]: &[Vector4<f64>; 2]| {
                    let cross = a * b.transpose() * w.m12;
                    a * a.transpose() * w.m11 + cross + cross.transpose() + b * b.transpose() * w.m22
                };
                let ll = l * l.transpose();
                let points = weighted(&span.points);
                add_product(h, &ll, &points);
                add_product(n, noise, &points);
                for error in &span.errors {
                    add_product(n, &ll, &weighted(error));
                }
            }
        }
    }
}

/// P's row `k` times x.
fn row(p: &Stacked, k: usize, x: &Vector4<f64>) -> f64 {
    p[4 * k] * x.x + p[4 * k + 1] * x.y + p[4 * k + 2] * x.z + p[4 * k + 3] * x.w
}

fn inverse(covariance: &Matrix2<f64>) -> Option<Matrix2<f64>> {
    covariance.try_inverse().filter(|w| w.iter().all(|v| v.is_finite()))
}

/// Adds the Kronecker product of two symmetric matrices.
fn add_product(h: &mut Matrix12, a: &Matrix3<f64>, b: &Matrix4<f64>) {
    for i in 0..3 {
        for j in i..3 {
            let mut block = h.fixed_view_mut::<4, 4>(4 * i, 4 * j);
            block += b * a[(i, j)];
        }
    }
}

/// Upper triangle of R^T W R for the two rows of (x, m), added to `h`.
fn accumulate(h: &mut Matrix12, w: &Matrix2<f64>, x: &Vector4<f64>, m: &Vector2<f64>) {
    let wm = w * m;
    let mwm = m.dot(&wm);
    for i in 0..4 {
        for j in 0..4 {
            let xx = x[i] * x[j];
            if j >= i {
                h[(i, j)] += w.m11 * xx;
                h[(4 + i, 4 + j)] += w.m22 * xx;
                h[(8 + i, 8 + j)] += mwm * xx;
            }
            h[(i, 4 + j)] += w.m12 * xx;
            h[(i, 8 + j)] -= wm.x * xx;
            h[(4 + i, 8 + j)] -= wm.y * xx;
        }
    }
}

fn mirror(m: &mut Matrix12) {
    for i in 0..12 {
        for j in 0..i {
            m[(i, j)] = m[(j, i)];
        }
    }
}
