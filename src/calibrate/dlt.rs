//! Direct linear transforms: from 2D-3D sets to the 3x4 projection matrix.
//!
//! `points` is the thesis's DLT-Points, eqs (2)-(3) with Hartley's normalisation; `lines` its DLT-Lines;
//! `inverse_depth` the closed form for every mixture, statistically efficient for laser shots too
//! (maths.md section 9.2); `minimal` the null vector of six measurements for sampling.

use nalgebra::{Matrix3, Matrix3x4, Matrix4, Vector2, Vector3, Vector4};

pub(crate) use super::closed_form::inverse_depth;
use super::line_measurement::{LineMeasurement, Span};
use super::measurement::Measurement;
use super::stand_ins::stand_ins;
use super::{Correspondences, ObservedLine};
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::Line3;
use crate::geometry::linalg::{Matrix12, Normalisation2, Normalisation3, right_singular};
use crate::geometry::rigid::skew;

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
    let normalised = || world.iter().zip(pixels).map(|(x, m)| (space.apply(x).push(1.0), image.apply(m)));
    let p = match by_moments(normalised()) {
        Some(p) => p,
        None => {
            let rows: Vec<[f64; 12]> = normalised().flat_map(|(x, m)| rows(&x, &m)).collect();
            let svd = right_singular(&rows);
            if svd.values[10] <= 1e-10 * svd.values[0] {
                return Err(Error::degenerate(
                    Degeneracy::IllConditioned,
                    "more than one projection matrix explains the points (coplanar, or on a twisted cubic)",
                ));
            }
            Matrix3x4::from_row_slice(&svd.vectors[11])
        }
    };
    let p = image.inverse_matrix() * p * space.matrix();
    oriented(&p).ok_or_else(|| Error::degenerate(Degeneracy::IllConditioned, "P has no finite camera centre"))
}

/// DLT-Lines: the matrix P that maps each line of space onto the image line of its segment, from
/// l^T P X1 = 0 and l^T P X2 = 0 with l the line through the segment's ends and X1, X2 two points of
/// the line in space; scaled like that of [`points`]. Both sides are Hartley-normalised, l is scaled so
/// that l^T m is a distance, and all lines weigh the same. Section IV.B of the thesis names it without
/// equations; they are those of Hartley and Zisserman, Multiple View Geometry (2nd ed., 2004), section
/// 7.1. World in metres, segments by their two ends in pixels, no lens distortion.
///
/// # Errors
/// `TooFewPoints` below six, `NotFinite`, `InvalidArgument` for a segment without length,
/// `Degenerate` when the lines do not determine P: they are coplanar, parallel, meet in one point.
pub fn lines(world: &[Line3], segments: &[[Vector2<f64>; 2]]) -> Result<Matrix3x4<f64>> {
    if world.len() != segments.len() {
        return Err(Error::invalid("uv", format!("{} segments for {} lines", segments.len(), world.len())));
    }
    let mut set = Correspondences::new(1, 1)?;
    for (line, ends) in world.iter().zip(segments) {
        set.add(ObservedLine::new(line.point, line.direction, *ends).into())?;
    }
    let measurements = measurements(&set)?;
    let frame = Frame::of(&measurements.iter().collect::<Vec<_>>())
        .ok_or_else(|| Error::degenerate(Degeneracy::Concurrent, "the lines or their segments coincide"))?;
    let rows: Vec<[f64; 12]> =
        measurements.iter().filter_map(Measurement::as_line).flat_map(|m| line_rows(&frame, m)).collect();
    let svd = right_singular(&rows);
    if svd.values[10] <= 1e-10 * svd.values[0] {
        return Err(Error::degenerate(
            Degeneracy::IllConditioned,
            "more than one projection matrix explains the lines (coplanar, parallel, or through one point)",
        ));
    }
    frame
        .denormalise(&svd.vectors[11])
        .ok_or_else(|| Error::degenerate(Degeneracy::IllConditioned, "P has no finite camera centre"))
}

/// The two rows l^T P X = 0 of a line for the row-ordered entries of P.
fn line_rows(frame: &Frame, m: &LineMeasurement) -> [[f64; 12]; 2] {
    let (l, _) = frame.image_line(m);
    frame.span(m).points.map(|x| std::array::from_fn(|i| l[i / 4] * x[i % 4]))
}

/// The null vector of all rows of eq. (2) from their normal equations, which are forty sums over the points.
/// They square the condition: `None` where the second smallest singular value is so near to nothing that
/// more than six digits would be lost, and the rows themselves must tell.
fn by_moments(points: impl Iterator<Item = (Vector4<f64>, Vector2<f64>)>) -> Option<Matrix3x4<f64>> {
    const LOST: f64 = 1e-6;
    // Of x x^T, upper triangle, times 1, u, v and u^2 + v^2.
    let mut moments = [[0.0; 10]; 4];
    for (x, m) in points {
        let [a, b, c, d] = [x.x, x.y, x.z, x.w];
        let products = [a * a, a * b, a * c, a * d, b * b, b * c, b * d, c * c, c * d, d * d];
        for (sums, factor) in moments.iter_mut().zip([1.0, m.x, m.y, m.norm_squared()]) {
            sums.iter_mut().zip(&products).for_each(|(sum, product)| *sum += factor * product);
        }
    }
    let [plain, u, v, squares] = moments.map(|[aa, ab, ac, ad, bb, bc, bd, cc, cd, dd]| {
        Matrix4::new(aa, ab, ac, ad, ab, bb, bc, bd, ac, bc, cc, cd, ad, bd, cd, dd)
    });
    let mut h = Matrix12::zeros();
    for (i, j, block) in [(0, 0, plain), (1, 1, plain), (0, 2, -u), (2, 0, -u), (1, 2, -v), (2, 1, -v), (2, 2, squares)]
    {
        h.fixed_view_mut::<4, 4>(4 * i, 4 * j).copy_from(&block);
    }
    let eigen = h.try_symmetric_eigen(f64::EPSILON, 1000)?;
    let mut order: [usize; 12] = std::array::from_fn(|i| i);
    order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
    let sound = eigen.eigenvalues[order[1]] > LOST * eigen.eigenvalues[order[11]];
    sound.then(|| Matrix3x4::from_row_slice(eigen.eigenvectors.column(order[0]).as_slice()))
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
    pub space: Normalisation3,
    pub image: Normalisation2,
}

impl Frame {
    /// Points at or beyond infinity are left out of the centroid.
    pub fn of(measurements: &[&Measurement]) -> Option<Self> {
        let finite = stand_ins(measurements, |m| Some((m.position()?, Matrix3::zeros())))?;
        let pixels: Vec<_> = measurements.iter().flat_map(|m| m.pixels()).copied().collect();
        Some(Self { space: Normalisation3::of(finite.iter().map(|(x, _)| *x))?, image: Normalisation2::of(&pixels)? })
    }

    pub fn span(&self, m: &LineMeasurement) -> Span {
        m.span(&self.space.centre, self.space.scale)
    }

    /// The line l through a segment's ends with l^T m the distance of m, and l's covariance.
    pub fn image_line(&self, m: &LineMeasurement) -> (Vector3<f64>, Matrix3<f64>) {
        let [a, b] = m.ends.map(|end| self.image.apply(&end).push(1.0));
        let l = a.cross(&b);
        let unit = 1.0 / l.xy().norm();
        // d(a x b) = -[b]x da + [a]x db, and an end moves in the image only.
        let (by_a, by_b) = (skew(&b) * -unit, skew(&a) * unit);
        let moved = |by: Matrix3<f64>, end: usize| {
            let by = by.fixed_columns::<2>(0).into_owned();
            by * (m.end_covariances[end] * (self.image.scale * self.image.scale)) * by.transpose()
        };
        (l * unit, moved(by_a, 0) + moved(by_b, 1))
    }

    pub fn denormalise(&self, p: &[f64]) -> Option<Matrix3x4<f64>> {
        oriented(&(self.image.inverse_matrix() * Matrix3x4::from_row_slice(p) * self.space.matrix()))
    }
}

/// P from six measurements, taking eleven of their twelve equations: for sampling, where speed
/// counts and a refinement follows.
pub(crate) fn minimal(frame: &Frame, six: &[&Measurement; MIN_POINTS]) -> Option<Matrix3x4<f64>> {
    let t = frame.space.matrix();
    let mut a = [[0.0; 12]; 12];
    for (i, m) in six.iter().enumerate() {
        let pair = match m {
            Measurement::Point(m) => {
                let x = t * m.homogeneous(m.rho);
                rows(&(x / x.norm()), &frame.image.apply(&m.pixel))
            }
            Measurement::Line(m) => line_rows(frame, m),
        };
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

/// The closed form for a whole set of measurements, taken as free of outliers: P with depths positive.
///
/// # Errors
/// `TooFewPoints`, `Degenerate`.
pub fn closed_form(set: &Correspondences) -> Result<Matrix3x4<f64>> {
    inverse_depth(&measurements(set)?.iter().collect::<Vec<_>>())
        .ok_or_else(|| Error::degenerate(Degeneracy::IllConditioned, "the points do not determine a projection matrix"))
}

/// At a common noise of 1 px where none is stated.
fn measurements(set: &Correspondences) -> Result<Vec<Measurement>> {
    if set.len() < MIN_POINTS {
        return Err(Error::TooFewPoints { given: set.len(), needed: MIN_POINTS });
    }
    Ok(set.observations().iter().map(|o| Measurement::new(o, 1.0, true)).collect())
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_core::{Rng, SeedableRng};

    use super::*;

    /// Points in a box as deep as `relief`, seen with noise.
    fn seen(relief: f64) -> Vec<(Vector4<f64>, Vector2<f64>)> {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut uniform = || rng.next_u64() as f64 / 2f64.powi(64) - 0.5;
        let p = Matrix3x4::new(1.0, 0.1, -0.2, 0.3, 0.0, 1.2, 0.1, -0.1, 0.05, -0.1, 0.3, 2.0);
        let mut point = || {
            let x = Vector4::new(3.0 * uniform(), 3.0 * uniform(), relief * uniform(), 1.0);
            let y = p * x;
            (x, y.xy() / y.z + Vector2::new(uniform(), uniform()) * 1e-3)
        };
        (0..200).map(|_| point()).collect()
    }

    #[test]
    fn moments_give_what_the_rows_give() {
        let points = seen(3.0);
        let p = by_moments(points.iter().copied()).unwrap();
        let rows: Vec<[f64; 12]> = points.iter().flat_map(|(x, m)| rows(x, m)).collect();
        let wanted = Matrix3x4::from_row_slice(&right_singular(&rows).vectors[11]);
        assert!((p * p.dot(&wanted).signum() - wanted).norm() < 1e-11);
    }

    #[test]
    fn moments_are_not_asked_where_they_lose_digits() {
        assert!(by_moments(seen(1e-3).into_iter()).is_none());
        assert!(by_moments(seen(0.0).into_iter()).is_none());
    }
}
