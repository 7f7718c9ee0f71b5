//! The thesis's DLT with radial distortion, eqs (4)-(5), in its right form (maths.md section 2).
//!
//! With the division model (Fitzgibbon 2001) the undistorted point is ~ m + lambda e, m = (u, v, 1) and
//! e = (0, 0, r^2) about the centre of distortion, so eq. (2) becomes (A1 + lambda A2) p = 0. Multiplied
//! by A1^T it is the linear generalised eigenproblem (A1^T A1 + lambda A1^T A2) p = 0. e does not touch
//! the third row of P: its four entries are eliminated, which leaves an ordinary eigenproblem of the eight
//! others.
//!
//! It is the weaker of the two linear methods. At lambda = 0 the pencil is singular (A1 p = 0 solves it
//! for every lambda), and near it noise shifts lambda by about sigma^2 / lambda, however many points
//! there are: 6 to 10^4 times the Cramer-Rao bound, or no real eigenvalue at all (make accuracy).
//! `radial_alignment` has neither fault; this one is here by its name.

use nalgebra::{Matrix3x4, Matrix4, SMatrix, SVector, Schur, Vector2, Vector4};

use super::Correspondences;
use super::division_camera::DivisionCamera;
use super::measurement::{Measurement, PointMeasurement};
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::Distortion;
use crate::geometry::linalg::{Normalisation3, right_singular};

/// Fewest points: twelve unknowns up to scale, and lambda.
pub const MIN_POINTS: usize = 6;

/// Largest |lambda| r^2 at the mean radius that is taken for a lens; spurious ones lie at -3 and beyond.
const MAX_LAMBDA: f64 = 0.5;
/// Imaginary part, relative to the real one, up to which an eigenvalue is real but for rounding.
const REAL: f64 = 1e-6;
/// QR steps for all eight eigenvalues: more than enough, two to three each are usual.
const QR_STEPS: usize = 400;

/// The camera and lambda from a set of measurements, taken as free of outliers and with their points
/// as exact. `centre` is the centre of distortion, px (`None`: the image's centre).
///
/// Of the eigenvalues that are real, that are a lens at all and put all points in front of the camera,
/// the one with the smallest reprojection error in the distorted image.
///
/// # Errors
/// `TooFewPoints` below six, `NotFinite`, `Degenerate` with what was wrong with the eigenvalues.
pub fn division_eigenproblem(set: &Correspondences, centre: Option<Vector2<f64>>) -> Result<DivisionCamera> {
    let centre = DivisionCamera::centre_for(set, centre)?;
    if set.len() < MIN_POINTS {
        return Err(Error::TooFewPoints { given: set.len(), needed: MIN_POINTS });
    }
    let none = |detail: &str| Error::degenerate(Degeneracy::IllConditioned, detail);
    let measurements = DivisionCamera::points(set)?;
    let measurements: Vec<&PointMeasurement> = measurements.iter().filter_map(Measurement::as_point).collect();
    let space = Normalisation3::of(measurements.iter().filter_map(|m| m.position()))
        .ok_or_else(|| Error::degenerate(Degeneracy::Coincident, "all 3D points coincide"))?;
    let radius = measurements.iter().map(|m| (m.pixel - centre).norm()).sum::<f64>() / set.len() as f64;
    if radius <= 0.0 {
        return Err(Error::degenerate(Degeneracy::ImageCollapsed, "all image points are at the centre"));
    }
    // The image is scaled about the centre, isotropically: Hartley's translation would move e.
    let points: Vec<(Vector4<f64>, Vector2<f64>)> = measurements
        .iter()
        .map(|m| {
            let x = space.matrix() * m.homogeneous(m.rho);
            (x / x.norm(), (m.pixel - centre) / radius)
        })
        .collect();
    let (real, roots) = eigenvectors(&points)?;
    if roots.is_empty() {
        return Err(none(if real == 0 { "no eigenvalue is real" } else { "no real eigenvalue is a lens" }));
    }
    let best = roots
        .iter()
        .filter_map(|root| Some((reprojection_error(root, &points)?, root)))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .ok_or_else(|| none("no eigenvector puts all points in front of the camera"))?;
    let Root { lambda, p } = best.1;
    // Back to pixels: (u, v) = centre + radius (a, b).
    let mut projection = p * space.matrix();
    for (i, c) in [centre.x, centre.y].into_iter().enumerate() {
        let row = projection.row(i) * radius + projection.row(2) * c;
        projection.set_row(i, &row);
    }
    let depth_scale = projection.fixed_view::<1, 3>(2, 0).norm();
    DivisionCamera::new(set, centre, projection / depth_scale, lambda / (radius * radius))
}

/// A solution in normalised coordinates, its points in front of the camera.
struct Root {
    lambda: f64,
    p: Matrix3x4<f64>,
}

/// How many eigenvalues are real, and those of them that may be a lens.
fn eigenvectors(points: &[(Vector4<f64>, Vector2<f64>)]) -> Result<(usize, Vec<Root>)> {
    let reduced = Reduced::of(points)?;
    let real: Vec<f64> = reduced.real_eigenvalues()?;
    let roots = real.iter().filter(|lambda| lambda.abs() <= MAX_LAMBDA).filter_map(|&lambda| {
        let p = reduced.eigenvector(lambda)?;
        let facing = points.iter().filter(|(x, _)| p.row(2).transpose().dot(x) > 0.0).count();
        Some(Root { lambda, p: if 2 * facing < points.len() { -p } else { p } })
    });
    Ok((real.len(), roots.collect()))
}

/// (A + lambda B) p = 0 with A = A1^T A1 and B = A1^T A2, of which the last four columns are zero, on the
/// first two rows q of P: (S + lambda T) q = 0 with p3 = U q + lambda V q.
struct Reduced {
    s: SMatrix<f64, 8, 8>,
    t: SMatrix<f64, 8, 8>,
    u: SMatrix<f64, 4, 8>,
    v: SMatrix<f64, 4, 8>,
}

impl Reduced {
    fn of(points: &[(Vector4<f64>, Vector2<f64>)]) -> Result<Self> {
        let (mut a, mut b) = (SMatrix::<f64, 12, 12>::zeros(), SMatrix::<f64, 12, 8>::zeros());
        for (x, m) in points {
            for (first, second) in equations(x, m, m.norm_squared()) {
                let (first, second) = (SVector::from(first), SVector::from(second));
                a += first * first.transpose();
                b += first * second.fixed_rows::<8>(0).transpose();
            }
        }
        if !a.iter().chain(&b).all(|v| v.is_finite()) {
            return Err(Error::degenerate(Degeneracy::IllConditioned, "the normal matrices overflow"));
        }
        let third: Matrix4<f64> = a.fixed_view::<4, 4>(8, 8).into();
        let third = third
            .cholesky()
            .ok_or_else(|| Error::degenerate(Degeneracy::IllConditioned, "the points do not fix P's third row"))?;
        let u = -third.solve(&a.fixed_view::<4, 8>(8, 0).into_owned());
        let v = -third.solve(&b.fixed_view::<4, 8>(8, 0).into_owned());
        let across = a.fixed_view::<8, 4>(0, 8);
        Ok(Self { s: a.fixed_view::<8, 8>(0, 0) + across * u, t: b.fixed_view::<8, 8>(0, 0) + across * v, u, v })
    }

    fn real_eigenvalues(&self) -> Result<Vec<f64>> {
        let unsolved = || Error::NoConvergence {
            iterations: QR_STEPS,
            detail: "the eigenproblem of eq. (5): its eigenvalues are not found".into(),
        };
        let quotient = self.t.lu().solve(&-self.s).filter(|m| m.iter().all(|v| v.is_finite()));
        let schur = Schur::try_new(quotient.ok_or_else(unsolved)?, f64::EPSILON, QR_STEPS).ok_or_else(unsolved)?;
        let all = schur.complex_eigenvalues();
        Ok(all.iter().filter(|l| l.re.is_finite() && l.im.abs() <= REAL * l.re.abs()).map(|l| l.re).collect())
    }

    /// P for an eigenvalue; `None` if it is not finite.
    fn eigenvector(&self, lambda: f64) -> Option<Matrix3x4<f64>> {
        let null: [[f64; 8]; 8] = (self.s + self.t * lambda).transpose().into();
        let q = SVector::from(right_singular(&null).vectors[7]);
        let p3 = self.u * q + self.v * q * lambda;
        let p = Matrix3x4::from_fn(|i, j| if i < 2 { q[4 * i + j] } else { p3[j] });
        p.iter().all(|v| v.is_finite()).then_some(p)
    }
}

/// The rows of A1 and A2 of a point, M^T (x) [m]x and M^T (x) [e]x, on the row-ordered entries of P:
/// all three, as eq. (2) has them.
fn equations(x: &Vector4<f64>, m: &Vector2<f64>, r2: f64) -> [([f64; 12], [f64; 12]); 3] {
    // Rows of [m]x; those of [e]x with e = (0, 0, r^2).
    let first = [[0.0, -1.0, m.y], [1.0, 0.0, -m.x], [-m.y, m.x, 0.0]];
    let second = [[0.0, -r2, 0.0], [r2, 0.0, 0.0], [0.0; 3]];
    let spread = |row: [f64; 3]| std::array::from_fn(|i| row[i / 4] * x[i % 4]);
    std::array::from_fn(|k| (spread(first[k]), spread(second[k])))
}

/// Sum of squared distances in the distorted image; `None` with a point behind the camera or beyond the
/// lens.
fn reprojection_error(root: &Root, points: &[(Vector4<f64>, Vector2<f64>)]) -> Option<f64> {
    let lens = Distortion::Division(root.lambda);
    points
        .iter()
        .map(|(x, m)| {
            let y = root.p * x;
            let image = (y.z > 0.0).then(|| lens.distort(y.xy() / y.z))??;
            Some((image - m).norm_squared())
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All finite eigenvalues of A p = -lambda B p by the QZ algorithm of another library.
    fn qz(points: &[(Vector4<f64>, Vector2<f64>)]) -> Vec<f64> {
        let (mut a, mut b) = (faer::Mat::<f64>::zeros(12, 12), faer::Mat::<f64>::zeros(12, 12));
        for (x, m) in points {
            for (first, second) in equations(x, m, m.norm_squared()) {
                for i in 0..12 {
                    for j in 0..12 {
                        a[(i, j)] += first[i] * first[j];
                        b[(i, j)] -= first[i] * second[j];
                    }
                }
            }
        }
        let eigen = a.generalized_eigen(&b).unwrap();
        let (alpha, beta) = (eigen.S_a().column_vector(), eigen.S_b().column_vector());
        let values = (0..12).map(|i| alpha[i] / beta[i]);
        values.filter(|l| l.norm() < 1e3 && l.im.abs() <= REAL * l.re.abs()).map(|l| l.re).collect()
    }

    #[test]
    fn eigenvalues_are_those_of_the_whole_pencil() {
        let mut state = 7u64;
        let mut uniform = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        for _ in 0..20 {
            let points: Vec<_> = (0..40)
                .map(|_| {
                    let x = Vector4::new(uniform(), uniform(), 2.0 + uniform(), 1.0);
                    let m = Vector2::new(x.x / x.z, x.y / x.z) * 2.0;
                    (x, m * (1.0 - 0.1 * m.norm_squared()) + Vector2::new(uniform(), uniform()) * 0.01)
                })
                .collect();
            let mut expected = qz(&points);
            let mut found = Reduced::of(&points).unwrap().real_eigenvalues().unwrap();
            found.retain(|l| l.abs() < 1e3);
            expected.sort_by(f64::total_cmp);
            found.sort_by(f64::total_cmp);
            assert_eq!(found.len(), expected.len(), "{found:?} {expected:?}");
            for (ours, theirs) in found.iter().zip(&expected) {
                assert!((ours / theirs - 1.0).abs() < 1e-6, "{found:?} {expected:?}");
            }
        }
    }
}
