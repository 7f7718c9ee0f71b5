//! Direct linear transforms: from 2D-3D sets to the 3x4 projection matrix.
//!
//! `points` is the thesis's DLT-Points, eqs (2)-(3) with Hartley's normalisation; `inverse_depth` the
//! closed form that is statistically efficient for laser shots (maths.md section 9.2); `minimal` the
//! null vector of six points for sampling.

use nalgebra::{Matrix2, Matrix3x4, SVector, Vector2, Vector3, Vector4};

use super::measurement::Measurement;
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::linalg::{
    Matrix12, Normalisation2, Normalisation3, largest_generalised_eigenvector, right_singular,
};

/// Fewest points that determine a projection matrix.
pub const MIN_POINTS: usize = 6;

/// DLT-Points: the matrix P with (u, v, 1) ~ P (X, Y, Z, 1), scaled so that depths are positive and
/// the third row's first three entries have unit length. World in metres, pixels in pixels.
///
/// # Errors
/// `TooFewPoints` below six, `NotFinite`, `Degenerate` when the points do not determine P.
pub fn points(world: &[Vector3<f64>], pixels: &[Vector2<f64>]) -> Result<Matrix3x4<f64>> {
    if world.len() != pixels.len() {
        return Err(Error::invalid("uv", format!("{} pixels for {} points", pixels.len(), world.len())));
    }
    if world.len() < MIN_POINTS {
        return Err(Error::TooFewPoints { given: world.len(), needed: MIN_POINTS });
    }
    let bad = |name, index: Option<usize>| index.map_or(Ok(()), |index| Err(Error::NotFinite { name, index }));
    bad("xyz", world.iter().position(|p| p.iter().any(|v| !v.is_finite())))?;
    bad("uv", pixels.iter().position(|p| p.iter().any(|v| !v.is_finite())))?;
    let space = Normalisation3::of(world.iter().copied())
        .ok_or_else(|| Error::degenerate(Degeneracy::Coincident, "all 3D points coincide"))?;
    let image = Normalisation2::of(pixels)
        .ok_or_else(|| Error::degenerate(Degeneracy::ImageCollapsed, "all image points coincide"))?;
    let rows: Vec<[f64; 12]> =
        world.iter().zip(pixels).flat_map(|(x, m)| rows(&space.apply(x).push(1.0), &image.apply(m))).collect();
    let svd = right_singular(&rows);
    if svd.values[10] <= 1e-10 * svd.values[0] {
        return Err(Error::degenerate(
            Degeneracy::IllConditioned,
            "more than one projection matrix explains the points (coplanar, or on a twisted cubic)",
        ));
    }
    let p = image.inverse_matrix() * Matrix3x4::from_row_slice(&svd.vectors[11]) * space.matrix();
    oriented(&p).ok_or_else(|| Error::degenerate(Degeneracy::IllConditioned, "P has no finite camera centre"))
}

/// The two independent rows of eq. (2) for the row-ordered entries of P.
fn rows(x: &Vector4<f64>, m: &Vector2<f64>) -> [[f64; 12]; 2] {
    let mut r = [[0.0; 12]; 2];
    for i in 0..4 {
        r[0][i] = x[i];
        r[0][8 + i] = -m.x * x[i];
        r[1][4 + i] = x[i];
        r[1][8 + i] = -m.y * x[i];
    }
    r
}

/// P scaled to det(P[:, :3]) > 0 and |P3[:3]| = 1, so that P3 . X is the depth.
fn oriented(p: &Matrix3x4<f64>) -> Option<Matrix3x4<f64>> {
    let m = p.fixed_columns::<3>(0);
    let det = m.determinant();
    let scale = det.signum() / m.row(2).norm();
    (det != 0.0 && scale.is_finite() && p.iter().all(|v| v.is_finite())).then(|| p * scale)
}

/// Normalisation of both sides for a set of measurements; `None` when they collapse.
pub(crate) struct Frame {
    space: Normalisation3,
    image: Normalisation2,
}

impl Frame {
    /// Points at or beyond infinity are left out of the centroid.
    pub fn of(measurements: &[Measurement]) -> Option<Self> {
        let finite = measurements.iter().filter_map(Measurement::position);
        let pixels: Vec<_> = measurements.iter().map(|m| m.pixel).collect();
        Some(Self { space: Normalisation3::of(finite)?, image: Normalisation2::of(&pixels)? })
    }

    fn denormalise(&self, p: &[f64]) -> Option<Matrix3x4<f64>> {
        oriented(&(self.image.inverse_matrix() * Matrix3x4::from_row_slice(p) * self.space.matrix()))
    }
}

/// P from six measurements, taking eleven of their twelve equations: for sampling, where speed
/// counts and a refinement follows.
pub(crate) fn minimal(frame: &Frame, six: &[Measurement; MIN_POINTS]) -> Option<Matrix3x4<f64>> {
    let t = frame.space.matrix();
    let mut a = [[0.0; 12]; 12];
    for (i, m) in six.iter().enumerate() {
        let x = t * m.homogeneous(m.rho);
        let pair = rows(&(x / x.norm()), &frame.image.apply(&m.pixel));
        a[2 * i] = pair[0];
        a[2 * i + 1] = pair[1];
    }
    frame.denormalise(&null_vector(&mut a)?)
}

/// Null vector of the first eleven rows by Gaussian elimination with complete pivoting.
fn null_vector(a: &mut [[f64; 12]; 12]) -> Option<[f64; 12]> {
    const ROWS: usize = 11;
    let mut order: [usize; 12] = std::array::from_fn(|i| i);
    for k in 0..ROWS {
        let (mut best, mut row, mut column) = (0.0, k, k);
        for (i, r) in a.iter().enumerate().take(ROWS).skip(k) {
            for (j, v) in r.iter().enumerate().skip(k) {
                if v.abs() > best {
                    (best, row, column) = (v.abs(), i, j);
                }
            }
        }
        if best < 1e-10 {
            return None;
        }
        a.swap(k, row);
        order.swap(k, column);
        for r in a.iter_mut() {
            r.swap(k, column);
        }
        let pivot = a[k];
        for r in a.iter_mut().take(ROWS).skip(k + 1) {
            let factor = r[k] / pivot[k];
            for j in k..12 {
                r[j] -= factor * pivot[j];
            }
        }
    }
    let mut y = [0.0; 12];
    y[11] = 1.0;
    for k in (0..ROWS).rev() {
        let sum: f64 = (k + 1..12).map(|j| a[k][j] * y[j]).sum();
        y[k] = -sum / a[k][k];
    }
    let mut p = [0.0; 12];
    for (k, &column) in order.iter().enumerate() {
        p[column] = y[k];
    }
    p.iter().all(|v| v.is_finite()).then_some(p)
}

/// Closed form for noisy points: the algebraic error under Taubin's norm (the noise's known
/// covariance), then once more with each row whitened by its own noise. For laser shots in inverse
/// depth this sits on the Cramer-Rao bound without iteration; for exact points it is DLT-Points with
/// its rows weighted by depth. Depends only on the ratio of the noises.
pub(crate) fn inverse_depth(measurements: &[Measurement]) -> Option<Matrix3x4<f64>> {
    if measurements.len() < MIN_POINTS {
        return None;
    }
    let frame = Frame::of(measurements)?;
    let t = frame.space.matrix();
    let s = frame.image.scale;
    let mut weights = vec![Matrix2::identity(); measurements.len()];
    let mut p = SVector::<f64, 12>::zeros();
    for pass in 0..2 {
        let (mut h, mut n) = (Matrix12::zeros(), Matrix12::zeros());
        for (m, w) in measurements.iter().zip(&mut weights) {
            let x = t * m.homogeneous(m.rho);
            let pixel = frame.image.apply(&m.pixel);
            let noise = m.pixel_covariance * (s * s);
            if pass == 1 {
                *w = whitening(&p, &t, m, &x, &pixel, &noise)?;
            }
            accumulate(&mut h, w, &x, &pixel);
            for column in m.noise_columns() {
                accumulate(&mut n, w, &(t * column), &pixel);
            }
            let third = (*w * noise).trace();
            for i in 0..4 {
                for j in i..4 {
                    n[(8 + i, 8 + j)] += third * x[i] * x[j];
                }
            }
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

/// Inverse covariance of the two algebraic residuals of a point under the current P.
fn whitening(
    p: &SVector<f64, 12>,
    t: &nalgebra::Matrix4<f64>,
    m: &Measurement,
    x: &Vector4<f64>,
    pixel: &Vector2<f64>,
    noise: &Matrix2<f64>,
) -> Option<Matrix2<f64>> {
    let row =
        |k: usize, y: &Vector4<f64>| p[4 * k] * y.x + p[4 * k + 1] * y.y + p[4 * k + 2] * y.z + p[4 * k + 3] * y.w;
    let depth = row(2, x);
    let mut covariance = noise * (depth * depth);
    for column in m.noise_columns() {
        let y = t * column;
        let third = row(2, &y);
        let q = Vector2::new(row(0, &y) - pixel.x * third, row(1, &y) - pixel.y * third);
        covariance += q * q.transpose();
    }
    covariance.try_inverse().filter(|w| w.iter().all(|v| v.is_finite()))
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

/// The closed form for a whole set of measurements, taken as free of outliers: P with depths positive.
///
/// # Errors
/// `TooFewPoints`, `Degenerate`.
pub fn closed_form(set: &super::Correspondences) -> Result<Matrix3x4<f64>> {
    if set.len() < MIN_POINTS {
        return Err(Error::TooFewPoints { given: set.len(), needed: MIN_POINTS });
    }
    let measurements: Vec<Measurement> = set.observations().iter().map(|o| Measurement::new(o, 1.0, true)).collect();
    inverse_depth(&measurements)
        .ok_or_else(|| Error::degenerate(Degeneracy::IllConditioned, "the points do not determine a projection matrix"))
}
