//! The thesis's DLT with radial distortion, eqs (4)-(5), in its right form (maths.md section 2).
//!
//! With the division model (Fitzgibbon 2001) the undistorted point is ~ m + lambda e, m = (u, v, 1) and
//! e = (0, 0, r^2) about the centre of distortion, so eq. (2) becomes (A1 + lambda A2) p = 0. Multiplied
//! by A1^T it is the linear generalised eigenproblem (A1^T A1 + lambda A1^T A2) p = 0, with at most
//! eight finite eigenvalues.
//!
//! It is the weaker of the two linear methods. At lambda = 0 the pencil is singular (A1 p = 0 solves it
//! for every lambda), and near it noise shifts lambda by about sigma^2 / lambda, however many points
//! there are: 6 to 10^4 times the Cramer-Rao bound, or no real eigenvalue at all (make accuracy).
//! `radial_alignment` has neither fault; this one is here by its name.

use faer::Mat;
use nalgebra::{Matrix3x4, Vector2, Vector4};

use super::Correspondences;
use super::division_camera::DivisionCamera;
use super::measurement::{Measurement, PointMeasurement};
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::Distortion;
use crate::geometry::linalg::Normalisation3;

/// Fewest points: twelve unknowns up to scale, and lambda.
pub const MIN_POINTS: usize = 6;

/// Largest |lambda| r^2 at the mean radius that is taken for a lens; spurious ones lie at -3 and beyond.
const MAX_LAMBDA: f64 = 0.5;
/// Imaginary part, relative to the real one, up to which an eigenvalue is real but for rounding.
const REAL: f64 = 1e-6;

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
    let (mut a, mut b) = (Mat::<f64>::zeros(12, 12), Mat::<f64>::zeros(12, 12));
    for (x, m) in points {
        let r2 = m.norm_squared();
        for (first, second) in equations(x, m, r2) {
            for i in 0..12 {
                for j in 0..12 {
                    a[(i, j)] += first[i] * first[j];
                    b[(i, j)] -= first[i] * second[j];
                }
            }
        }
    }
    // A p = lambda B p; faer says nothing about values that are not finite.
    if (0..12).any(|i| (0..12).any(|j| !a[(i, j)].is_finite() || !b[(i, j)].is_finite())) {
        return Err(Error::degenerate(Degeneracy::IllConditioned, "the normal matrices overflow"));
    }
    let eigen = a.generalized_eigen(&b).map_err(|e| Error::NoConvergence {
        iterations: 0,
        detail: format!("the generalised eigenproblem of eq. (5): {e:?}"),
    })?;
    let (mut real, mut roots) = (0, Vec::new());
    for i in 0..12 {
        let (alpha, beta) = (eigen.S_a().column_vector()[i], eigen.S_b().column_vector()[i]);
        let lambda = alpha / beta;
        if !(lambda.re.is_finite() && lambda.im.abs() <= REAL * lambda.re.abs()) {
            continue;
        }
        real += 1;
        let p: [f64; 12] = std::array::from_fn(|k| eigen.U()[(k, i)].re);
        if lambda.re.abs() <= MAX_LAMBDA && p.iter().all(|v| v.is_finite()) {
            let p = Matrix3x4::from_row_slice(&p);
            let facing = points.iter().filter(|(x, _)| p.row(2).transpose().dot(x) > 0.0).count();
            let p = if 2 * facing < points.len() { -p } else { p };
            roots.push(Root { lambda: lambda.re, p });
        }
    }
    Ok((real, roots))
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
