//! Planes from laser shots, by maximum likelihood in inverse depth, and from plain points.
//!
//! A plane is n . X = 1: n is the unit normal, turned away from the rig, over the distance. A shot
//! along o + d / rho meets it at rho = n . d / (1 - n . o), and its noise is Gaussian in rho. A
//! least-squares fit of the metric points instead is biased, since their noise grows with the
//! square of the depth (maths.md section 7).

use nalgebra::{Matrix3, Vector3};

use super::consensus;
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::linalg::{right_singular, symmetric_eigen3};
use crate::geometry::{InverseDepthPoint, Plane};

/// How a plane is fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneFitOptions {
    /// Set gross outliers aside. Needs six measurements or more: fewer are all used.
    pub robust: bool,
    /// Outliers lie beyond this many standard deviations.
    pub outlier_threshold: f64,
    /// Seed of the minimal-sample consensus.
    pub seed: u64,
}

impl Default for PlaneFitOptions {
    fn default() -> Self {
        Self { robust: true, outlier_threshold: 4.0, seed: 1 }
    }
}

/// A measured plane n . X = 1 that does not pass through the rig's origin.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneEstimate {
    /// Unit normal, away from the origin, over the distance: 1 / metres.
    pub n: Vector3<f64>,
    /// Covariance of `n`, 1 / metres^2; zero: taken as exact.
    pub covariance: Matrix3<f64>,
    /// Sum of squared residuals of the inliers, in standard deviations.
    pub chi_square: f64,
    /// Inliers less the three parameters; 0 for a plane that was handed in.
    pub degrees_of_freedom: usize,
    /// One flag a measurement; empty for a plane that was handed in.
    pub inliers: Vec<bool>,
}

impl PlaneEstimate {
    /// A known plane, with the covariance of its n = normal / distance when there is one.
    pub fn given(plane: &Plane, covariance: Option<Matrix3<f64>>) -> Result<Self> {
        let n = plane.normal / plane.distance;
        if !plane.normal.iter().chain([&plane.distance]).all(|v| v.is_finite()) {
            return Err(Error::NotFinite { name: "plane", index: 0 });
        }
        if !(n.iter().all(|v| v.is_finite()) && n.norm() > 0.0) {
            return Err(through_origin());
        }
        let covariance = covariance.unwrap_or_else(Matrix3::zeros);
        let estimate = Self { n, covariance, chi_square: 0.0, degrees_of_freedom: 0, inliers: Vec::new() };
        estimate.validate()?;
        Ok(estimate)
    }

    /// The plane with its normal away from the rig's origin.
    pub fn plane(&self) -> Plane {
        let norm = self.n.norm();
        Plane { normal: self.n / norm, distance: 1.0 / norm }
    }

    /// Root of chi-square over its degrees of freedom: about 1 when the shots' variances were right
    /// and the surface is flat. `None` without redundancy.
    pub fn noise_factor(&self) -> Option<f64> {
        let f = self.degrees_of_freedom;
        (f > 0).then(|| (self.chi_square / f as f64).sqrt())
    }

    /// Refuses what is not finite and a covariance that is not symmetric and positive semi-definite.
    pub(super) fn validate(&self) -> Result<()> {
        if let Some(index) = self.n.iter().position(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name: "plane", index });
        }
        if let Some(index) = self.covariance.iter().position(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name: "plane covariance", index });
        }
        let norm = self.n.norm();
        if !(norm > 0.0 && norm.recip().is_finite() && norm.is_finite()) {
            return Err(Error::invalid("plane", "its n is zero or its distance is beyond all numbers"));
        }
        let size = self.covariance.amax();
        if size > 0.0 {
            let unit = self.covariance / size;
            if (unit - unit.transpose()).amax() > 1e-9 || unit.symmetric_eigenvalues().min() < -1e-9 {
                return Err(Error::invalid("plane covariance", "not symmetric and positive semi-definite"));
            }
        }
        Ok(())
    }
}

/// Fits a plane to laser shots by maximum likelihood. The shots' variances weigh them and make the
/// covariance; it is not scaled by the residuals, which [`PlaneEstimate::noise_factor`] tells.
///
/// Errors: `TooFewPoints` below three shots; `NotFinite`, `InvalidArgument` for bad shots;
/// `Degenerate` for coincident or collinear shots and for a plane through the rig's origin;
/// `BehindCamera` when the plane lies behind the shots; `NoConsensus` when no half of them agrees.
pub fn fit_plane_to_shots(shots: &[InverseDepthPoint], options: &PlaneFitOptions) -> Result<PlaneEstimate> {
    check_count(shots.len(), 3)?;
    for (index, shot) in shots.iter().enumerate() {
        let numbers = shot.origin.iter().chain(shot.direction.iter()).chain([&shot.rho, &shot.variance]);
        if numbers.into_iter().any(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name: "shots", index });
        }
        if shot.variance <= 0.0 || shot.direction.norm_squared() == 0.0 {
            return Err(Error::invalid("shots", format!("shot {index}: variance and direction must not be zero")));
        }
    }
    let residual = |n: &Vector3<f64>, i: usize| {
        let (_, r) = linearise(&shots[i], n);
        if r.is_nan() { f64::INFINITY } else { r }
    };
    // The inverse depth is known to `variance`: a smaller spread of residuals is luck.
    robustly(
        shots.len(),
        options,
        1.0,
        |sample| fit_three(sample.map(|i| shots[i])),
        residual,
        |used| {
            let kept: Vec<InverseDepthPoint> = shots.iter().zip(used).filter(|(_, u)| **u).map(|(s, _)| *s).collect();
            maximum_likelihood(&kept)
        },
    )
    .and_then(|plane| {
        let n = plane.n;
        let behind = |s: &InverseDepthPoint| n.dot(&s.direction) <= 0.0 || n.dot(&s.origin) >= 1.0;
        let used = || shots.iter().enumerate().filter(|(i, _)| plane.inliers[*i]);
        match used().find(|(_, s)| behind(s)) {
            // A few rays that only just miss a slanted plane do no harm.
            Some((index, _)) if 2 * used().filter(|(_, s)| behind(s)).count() > used().count() => {
                Err(Error::BehindCamera { index })
            }
            _ => Ok(plane),
        }
    })
}

/// Fits a plane to points by total least squares. `sigma` is their standard deviation in each
/// direction (metres); `None` estimates it from the residuals and needs a fourth point.
///
/// Errors as [`fit_plane_to_shots`].
pub fn fit_plane_to_points(
    points: &[Vector3<f64>],
    sigma: Option<f64>,
    options: &PlaneFitOptions,
) -> Result<PlaneEstimate> {
    check_count(points.len(), if sigma.is_some() { 3 } else { 4 })?;
    if let Some(index) = points.iter().position(|p| p.iter().any(|v| !v.is_finite())) {
        return Err(Error::NotFinite { name: "points", index });
    }
    if let Some(s) = sigma.filter(|s| !(*s > 0.0 && s.is_finite())) {
        return Err(Error::invalid("sigma", format!("{s} is not a positive standard deviation")));
    }
    let size = points.iter().fold(0.0f64, |m, p| m.max(p.amax()));
    let residual = |n: &Vector3<f64>, i: usize| (n.dot(&points[i]) - 1.0) / n.norm();
    let through_three = |sample: [usize; 3]| {
        let [p, q, r] = sample.map(|i| points[i]);
        let normal = (q - p).cross(&(r - p));
        Some(normal / normal.dot(&p)).filter(|n| n.iter().all(|v| v.is_finite()))
    };
    robustly(points.len(), options, sigma.unwrap_or(1e-12 * size), through_three, residual, |used| {
        let kept: Vec<Vector3<f64>> = points.iter().zip(used).filter(|(_, u)| **u).map(|(p, _)| *p).collect();
        total_least_squares(&kept, sigma)
    })
}

fn check_count(given: usize, needed: usize) -> Result<()> {
    if given < needed { Err(Error::TooFewPoints { given, needed }) } else { Ok(()) }
}

/// What a fit to some of the measurements says.
pub(super) struct Fit {
    pub n: Vector3<f64>,
    pub covariance: Matrix3<f64>,
    pub chi_square: f64,
}

/// Consensus, then alternately fit and choose the inliers until they stay.
fn robustly(
    count: usize,
    options: &PlaneFitOptions,
    floor: f64,
    sample: impl Fn([usize; 3]) -> Option<Vector3<f64>>,
    residual: impl Fn(&Vector3<f64>, usize) -> f64,
    fit: impl Fn(&[bool]) -> Result<Fit>,
) -> Result<PlaneEstimate> {
    if !(options.outlier_threshold > 0.0 && options.outlier_threshold.is_finite()) {
        return Err(Error::invalid("outlier_threshold", format!("{} is not positive", options.outlier_threshold)));
    }
    let choose = |n: &Vector3<f64>| consensus::inliers(count, options.outlier_threshold, floor, |i| residual(n, i));
    let mut inliers = vec![true; count];
    if options.robust && count >= 6 {
        // Without any usable sample the fit itself says why.
        if let Some(n) = consensus::least_median(count, options.seed, sample, &residual) {
            inliers = choose(&n);
            for _ in 0..5 {
                let again = choose(&fit(&inliers)?.n);
                if again == inliers {
                    break;
                }
                inliers = again;
            }
        }
    }
    let used = inliers.iter().filter(|u| **u).count();
    if used < 3 || 2 * used < count {
        return Err(Error::NoConsensus { inliers: used, total: count });
    }
    let Fit { n, covariance, chi_square } = fit(&inliers)?;
    Ok(PlaneEstimate { n, covariance, chi_square, degrees_of_freedom: used - 3, inliers })
}

/// Derivative of the predicted inverse depth by n, and measured minus predicted, both divided by
/// the standard deviation.
fn linearise(shot: &InverseDepthPoint, n: &Vector3<f64>) -> (Vector3<f64>, f64) {
    let clearance = 1.0 - n.dot(&shot.origin);
    let rho = n.dot(&shot.direction) / clearance;
    let weight = shot.variance.sqrt().recip();
    ((shot.direction + shot.origin * rho) * (weight / clearance), (shot.rho - rho) * weight)
}

/// n . (o rho + d) = rho, which is linear in n, for three shots.
fn fit_three(shots: [InverseDepthPoint; 3]) -> Option<Vector3<f64>> {
    let m = Matrix3::from_rows(&shots.map(|s| (s.origin * s.rho + s.direction).transpose()));
    let n = m.try_inverse()? * Vector3::from(shots.map(|s| s.rho));
    n.iter().all(|v| v.is_finite()).then_some(n)
}

/// Null vector (n, 1) of the homogeneous rows (o rho + d, -rho): the start of the iteration.
fn linear_start(shots: &[InverseDepthPoint]) -> Result<Vector3<f64>> {
    // The last column is brought to the size of the others, so that the unit of length is no matter.
    let unit = (shots.iter().map(|s| s.rho * s.rho).sum::<f64>() / shots.len() as f64).sqrt();
    if unit < f64::MIN_POSITIVE || !unit.is_finite() {
        return Err(Error::degenerate(Degeneracy::IllConditioned, "all shots lie at infinity"));
    }
    let rows: Vec<[f64; 4]> = shots
        .iter()
        .map(|s| {
            let (x, w) = (s.origin * s.rho + s.direction, s.variance.sqrt().recip());
            [x.x * w, x.y * w, x.z * w, -s.rho / unit * w]
        })
        .collect();
    let svd = right_singular(&rows);
    // On a line, any plane about it is a null vector.
    check_spread(svd.values[0], svd.values[1], svd.values[2], 1e-7, 1e-7)?;
    let [x, y, z, last] = svd.vectors[3];
    let n = Vector3::new(x, y, z);
    if last.abs() <= 1e-9 * n.norm() {
        // One scan line, whose points leave it only by their noise, looks like such a plane too.
        let noise = shots.iter().map(|s| s.origin.norm_squared() + unit.powi(-2)).sum::<f64>().sqrt();
        return Err(if svd.values[2] <= 3.0 * noise { on_one_line() } else { through_origin() });
    }
    Ok(n * (unit / last))
}

/// Gauss-Newton on the whitened inverse depths.
pub(super) fn maximum_likelihood(shots: &[InverseDepthPoint]) -> Result<Fit> {
    const MAX_ITERATIONS: usize = 50;
    let system = |n: &Vector3<f64>| {
        let (mut rows, mut gradient, mut chi_square) = (Vec::with_capacity(shots.len()), Vector3::zeros(), 0.0);
        for shot in shots {
            let (row, residual) = linearise(shot, n);
            rows.push([row.x, row.y, row.z]);
            gradient += row * residual;
            chi_square += residual * residual;
        }
        (rows, gradient, chi_square)
    };
    let mut n = linear_start(shots)?;
    for _ in 0..MAX_ITERATIONS {
        let (rows, gradient, chi_square) = system(&n);
        let covariance = inverse_information(&rows)?;
        let step = covariance * gradient;
        // The step's length in standard deviations; quadratic convergence leaves its square.
        if gradient.dot(&step) <= 1e-16 * (1.0 + chi_square) || step.norm() <= 1e-14 * n.norm() {
            check_deviation(&n, &covariance)?;
            return Ok(Fit { n, covariance, chi_square });
        }
        n += step;
        if n.iter().any(|v| !v.is_finite()) {
            break;
        }
    }
    Err(Error::NoConvergence { iterations: MAX_ITERATIONS, detail: "plane through laser shots".into() })
}

pub(super) fn total_least_squares(points: &[Vector3<f64>], sigma: Option<f64>) -> Result<Fit> {
    let count = points.len() as f64;
    let centre = points.iter().sum::<Vector3<f64>>() / count;
    let size = points.iter().fold(0.0f64, |m, p| m.max(p.amax()));
    // Moments about the centre, in units of the size: the squares of singular values, at a hundredth of
    // the time. They are exact to 1e-16 of the largest, and no plane is taken that needs more.
    let scale = if size > 0.0 { size.recip() } else { 1.0 };
    let moments: Matrix3<f64> = points
        .iter()
        .map(|p| {
            let x = (p - centre) * scale;
            x * x.transpose()
        })
        .sum();
    let plane = OfMoments::new(count, size, centre, &moments)?;
    let spread = points.iter().map(|p| plane.normal.dot(&(p - centre)).powi(2)).sum::<f64>();
    let variance = sigma.map_or(spread / (count - 3.0).max(1.0), |s| s * s);
    let chi_square = if sigma.is_some() { spread / variance } else { count - 3.0 };
    plane.fit(variance, chi_square)
}

/// The plane of points by their moments.
pub(super) struct OfMoments {
    normal: Vector3<f64>,
    distance: f64,
    size: f64,
    /// (sum of feet feet^T)^-1, in units of the size.
    inverse: Matrix3<f64>,
}

impl OfMoments {
    /// Of so many points of this size and centre. `moments`: their sum of x x^T about it, in units of the size.
    pub fn new(count: f64, size: f64, centre: Vector3<f64>, moments: &Matrix3<f64>) -> Result<Self> {
        let far = || Error::degenerate(Degeneracy::IllConditioned, "the points are too far away");
        let (values, axes) = symmetric_eigen3(moments).ok_or_else(far)?;
        let roots = values.map(|v| v.max(0.0).sqrt() * size);
        check_spread(size * count.sqrt(), roots[0], roots[1], 1e-7, 1e-3)?;
        let normal = axes[2];
        let distance = normal.dot(&centre);
        if distance.abs() <= 1e-9 * size {
            return Err(through_origin());
        }
        // n . X - 1 changes by X . dn; the points' feet on the plane keep their noise out of it. Their
        // moments about the origin are those about the centre, along the plane, and the centre's.
        let along = [0, 1].map(|k| axes[k] * axes[k].transpose() * (roots[k] * roots[k]));
        let feet = along[0] + along[1] + centre * centre.transpose() * count;
        let (values, axes) = symmetric_eigen3(&(feet / (size * size))).ok_or_else(far)?;
        let roots = values.map(|v| v.max(0.0).sqrt());
        check_spread(roots[0], roots[1], roots[2], 1e-7, 1e-3)?;
        let inverse = (0..3).map(|k| axes[k] * axes[k].transpose() / values[k]).sum();
        Ok(Self { normal, distance, size, inverse })
    }

    /// With the points' variance in each direction.
    pub fn fit(&self, variance: f64, chi_square: f64) -> Result<Fit> {
        let n = self.normal / self.distance;
        let covariance = self.inverse * (variance / (self.size * self.size * self.distance * self.distance));
        check_deviation(&n, &covariance)?;
        Ok(Fit { n, covariance, chi_square })
    }
}

/// (J^T J)^-1 of the whitened rows, from their singular values.
fn inverse_information(rows: &[[f64; 3]]) -> Result<Matrix3<f64>> {
    let svd = right_singular(rows);
    let [mean, wide, narrow] = svd.values;
    if !narrow.is_finite() {
        return Err(Error::degenerate(Degeneracy::IllConditioned, "the laser starts on the plane"));
    }
    check_spread(mean, wide, narrow, 1e-7, 1e-3)?;
    let inverse = svd.vectors.iter().zip(svd.values).map(|(v, s)| {
        let scaled = Vector3::from(*v) / s;
        scaled * scaled.transpose()
    });
    Ok(inverse.sum())
}

/// From the extents of the measurements in falling order: refuses one place and one line.
fn check_spread(size: f64, wide: f64, narrow: f64, least_wide: f64, least_narrow: f64) -> Result<()> {
    if wide <= least_wide * size {
        return Err(Error::degenerate(Degeneracy::Coincident, "the measurements of a plane are all in one place"));
    }
    if narrow <= least_narrow * wide {
        return Err(on_one_line());
    }
    Ok(())
}

fn on_one_line() -> Error {
    Error::degenerate(
        Degeneracy::Collinear,
        "the measurements of a plane lie on one line, or in one plane with the rig's origin",
    )
}

/// Refuses a plane whose n is uncertain by a good part of itself: first-order propagation, the side
/// that faces the rig and the direction of its edges would mean nothing.
fn check_deviation(n: &Vector3<f64>, covariance: &Matrix3<f64>) -> Result<()> {
    const MAX_DEVIATION: f64 = 0.3;
    let deviation = covariance.symmetric_eigenvalues().max().max(0.0).sqrt() / n.norm();
    if deviation <= MAX_DEVIATION {
        return Ok(());
    }
    Err(Error::degenerate(
        Degeneracy::IllConditioned,
        format!(
            "n is uncertain by {deviation:.2} of its length: the measurements are too few, too close together or too \
             near one line for their noise, or the plane passes too near the rig's origin"
        ),
    ))
}

fn through_origin() -> Error {
    Error::degenerate(
        Degeneracy::IllConditioned,
        "the plane passes (nearly) through the rig's origin: n . X = 1 cannot hold there and its normal has no side that faces the rig",
    )
}
