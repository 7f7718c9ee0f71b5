//! Straight lines through points in space: consensus of minimal samples (RANSAC; Fischler and Bolles,
//! CACM 1981, scored as MSAC; Torr and Zisserman, CVIU 2000), then maximum likelihood with each point's
//! own covariance. Depth cameras need that: their errors grow along the ray with the square of the
//! depth and are small across it.

use nalgebra::{Matrix3, Matrix4, Matrix6x4, SMatrix, Vector3, Vector4};
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use crate::error::{Degeneracy, Error, Result};
use crate::geometry::chi_square::upper_tail;
use crate::geometry::linalg::symmetric_eigen3;
use crate::geometry::line::MeasuredLine;

/// Minimal samples: with 70 % outliers, none is clean once in 10^8 fits.
const SAMPLES: usize = 200;
/// Points on which samples are scored.
const MAX_SCORED: usize = 1000;
/// Fewer points are all used.
const MIN_ROBUST: usize = 5;
const ITERATIONS: usize = 30;
/// Rounds of choosing the inliers and fitting them.
const ROUNDS: usize = 10;
/// Probability below which residuals contradict the stated noise.
const BEYOND_CHANCE: f64 = 1e-3;
/// Standard deviation of a direction, radians, from which on there is none.
const NO_DIRECTION: f64 = 0.3;

#[derive(Debug, Clone, PartialEq)]
pub struct LineFitOptions {
    /// Set outliers aside; below five points all are used.
    pub robust: bool,
    /// Outliers lie beyond this many standard deviations.
    pub outlier_threshold: f64,
    /// Least share of the points that must agree, 0 to 1.
    pub min_inliers: f64,
    /// Seed of the minimal samples.
    pub seed: u64,
}

impl Default for LineFitOptions {
    fn default() -> Self {
        Self { robust: true, outlier_threshold: 3.7, min_inliers: 0.3, seed: 1 }
    }
}

impl LineFitOptions {
    fn check(&self) -> Result<()> {
        if !(self.outlier_threshold > 0.0 && self.outlier_threshold.is_finite()) {
            return Err(Error::invalid("outlier_threshold", format!("{}", self.outlier_threshold)));
        }
        if !(0.0..=1.0).contains(&self.min_inliers) {
            return Err(Error::invalid("min_inliers", format!("{} is no share", self.min_inliers)));
        }
        Ok(())
    }
}

/// How far points are off.
#[derive(Debug, Clone, Copy)]
pub enum PointNoise<'a> {
    /// Standard deviation of every coordinate, metres.
    Same(f64),
    /// One covariance a point, positive definite, m^2.
    Each(&'a [Matrix3<f64>]),
}

/// A line fitted to points.
#[derive(Debug, Clone, PartialEq)]
pub struct LineEstimate {
    /// Its point is the middle of the inliers, its covariance that of the stated noise, or larger
    /// where the residuals contradict it (1 in 1000).
    pub line: MeasuredLine,
    /// Sum of squared residuals of the inliers, in stated standard deviations.
    pub chi_square: f64,
    /// Two for each inlier, less four.
    pub degrees_of_freedom: usize,
    /// One flag a point.
    pub inliers: Vec<bool>,
}

/// Fits a line to points, of which some may be of other things. Points that are not finite (pixels
/// without depth) are passed over. Of several lines the one that most points agree with is taken.
///
/// # Errors
/// `TooFewPoints` below two finite points; `InvalidArgument` for noise that is none; `NoConsensus`
/// when no line has the least share of inliers; `Degenerate` when the points lie in one place as far
/// as their noise tells.
pub fn fit_line_3d(points: &[Vector3<f64>], noise: PointNoise<'_>, options: &LineFitOptions) -> Result<LineEstimate> {
    options.check()?;
    let all = measured(points, noise)?;
    if all.len() < 2 {
        return Err(Error::TooFewPoints { given: all.len(), needed: 2 });
    }
    let robust = options.robust && all.len() >= MIN_ROBUST;
    let limit = options.outlier_threshold.powi(2);
    let mut line = if robust { consensus(&all, limit, options.seed) } else { principal_axis(&all) }
        .ok_or_else(|| coincident("they have no principal axis"))?;
    let mut used: Vec<bool> = all.iter().map(|m| !robust || line.residual(m).0 <= limit).collect();
    for _ in 0..ROUNDS {
        let count = used.iter().filter(|u| **u).count();
        if robust && (count < 3 || (count as f64) < options.min_inliers * all.len() as f64) {
            return Err(Error::NoConsensus { inliers: count, total: all.len() });
        }
        line = refine(line, &all, &used)?;
        if !robust {
            break;
        }
        let again: Vec<bool> = all.iter().map(|m| line.residual(m).0 <= limit).collect();
        if again == used {
            break;
        }
        used = again;
    }
    conclude(points.len(), &all, &used, line)
}

/// A finite point and the inverse of its covariance.
struct Measured {
    index: usize,
    x: Vector3<f64>,
    information: Matrix3<f64>,
}

fn measured(points: &[Vector3<f64>], noise: PointNoise<'_>) -> Result<Vec<Measured>> {
    let finite = |m: &[f64]| m.iter().all(|v| v.is_finite() && v.abs() < 1e12);
    let information = |i: usize| match noise {
        PointNoise::Same(sigma) => {
            let information = 1.0 / (sigma * sigma);
            let right = sigma > 0.0 && information.is_finite() && information > 0.0;
            right.then(|| Matrix3::identity() * information)
        }
        PointNoise::Each(covariances) => {
            let c = covariances[i];
            let c = (finite(c.as_slice()) && (c - c.transpose()).amax() <= 1e-9 * c.amax()).then_some(c)?;
            c.cholesky().map(|c| c.inverse()).filter(|w| w.iter().all(|v| v.is_finite()))
        }
    };
    if let PointNoise::Each(covariances) = noise
        && covariances.len() != points.len()
    {
        let reason = format!("{} covariances for {} points", covariances.len(), points.len());
        return Err(Error::invalid("xyz covariance", reason));
    }
    if let PointNoise::Same(sigma) = noise
        && information(0).is_none()
    {
        return Err(Error::invalid("sigma", format!("{sigma} is no standard deviation")));
    }
    let known = points.iter().enumerate().filter(|(_, x)| finite(x.as_slice()));
    known
        .map(|(index, x)| {
            let information = information(index).ok_or_else(|| {
                Error::invalid("xyz covariance", format!("of point {index} is not positive definite"))
            })?;
            Ok(Measured { index, x: *x, information })
        })
        .collect()
}

#[derive(Debug, Clone, Copy)]
struct Line {
    point: Vector3<f64>,
    direction: Vector3<f64>,
}

impl Line {
    fn through(a: &Vector3<f64>, b: &Vector3<f64>) -> Option<Self> {
        let direction = (b - a).try_normalize(1e-12 * (a.norm() + b.norm()).max(1e-12))?;
        Some(Self { point: (a + b) * 0.5, direction })
    }

    /// Squared distance in standard deviations, and where along the line it is least: the position
    /// along the line is one more unknown of each point, eliminated here.
    fn residual(&self, m: &Measured) -> (f64, f64) {
        let off = m.x - self.point;
        let along = m.information * self.direction;
        let s = along.dot(&off) / along.dot(&self.direction);
        let across = off - self.direction * s;
        (across.dot(&(m.information * across)), s)
    }

    /// Two directions across the line.
    fn across(&self) -> [Vector3<f64>; 2] {
        let e = self.direction.cross(&Vector3::ith(self.direction.iamin(), 1.0)).normalize();
        [e, self.direction.cross(&e)]
    }
}

/// The line of two points for which the sum of squared distances, each cut off at `limit`, is least.
fn consensus(all: &[Measured], limit: f64, seed: u64) -> Option<Line> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = || (rng.next_u64() % all.len() as u64) as usize;
    let step = all.len().div_ceil(MAX_SCORED);
    let mut best: Option<(f64, Line)> = None;
    for _ in 0..SAMPLES {
        let (i, j) = (draw(), draw());
        if i == j {
            continue;
        }
        let Some(line) = Line::through(&all[i].x, &all[j].x) else { continue };
        let score: f64 = all.iter().step_by(step).map(|m| line.residual(m).0.min(limit)).sum();
        if best.as_ref().is_none_or(|(least, _)| score < *least) {
            best = Some((score, line));
        }
    }
    best.map(|(_, line)| line)
}

fn principal_axis(all: &[Measured]) -> Option<Line> {
    let n = all.len() as f64;
    let mean = all.iter().map(|m| m.x).sum::<Vector3<f64>>() / n;
    let scatter = all.iter().map(|m| (m.x - mean) * (m.x - mean).transpose()).sum::<Matrix3<f64>>() / n;
    let (values, vectors) = symmetric_eigen3(&scatter)?;
    let i = (0..3).max_by(|a, b| values[*a].total_cmp(&values[*b]))?;
    (values[i] > 0.0).then(|| Line { point: mean, direction: vectors[i].normalize() })
}

/// Normal equations by the point's and the direction's two components across the line.
fn normal_equations(line: &Line, all: &[Measured], used: &[bool]) -> (Matrix4<f64>, Vector4<f64>, f64) {
    let (mut h, mut g, mut chi) = (Matrix4::zeros(), Vector4::zeros(), 0.0);
    let [e, f] = line.across();
    for (m, _) in all.iter().zip(used).filter(|(_, u)| **u) {
        let (square, s) = line.residual(m);
        let off = m.x - line.point - line.direction * s;
        let along = m.information * line.direction;
        let w = m.information - along * along.transpose() / along.dot(&line.direction);
        let j = SMatrix::<f64, 3, 4>::from_columns(&[e, f, e * s, f * s]);
        h += j.transpose() * w * j;
        g += j.transpose() * (w * off);
        chi += square;
    }
    (h, g, chi)
}

fn refine(mut line: Line, all: &[Measured], used: &[bool]) -> Result<Line> {
    for _ in 0..ITERATIONS {
        // About the middle of the points, place and direction are nearly independent.
        let (mut sum, mut count) = (0.0, 0.0);
        for (m, _) in all.iter().zip(used).filter(|(_, u)| **u) {
            sum += line.residual(m).1;
            count += 1.0;
        }
        line.point += line.direction * (sum / count);
        let (h, g, _) = normal_equations(&line, all, used);
        let step = h.cholesky().ok_or_else(|| coincident("their line has no direction"))?.solve(&g);
        let [e, f] = line.across();
        line.point += e * step[0] + f * step[1];
        line.direction = (line.direction + e * step[2] + f * step[3]).normalize();
        if !line.direction.iter().chain(line.point.iter()).all(|v| v.is_finite()) {
            return Err(coincident("their line has no direction"));
        }
        // Far below what the points determine.
        let settled = step.dot(&(h * step)) < 1e-12;
        if settled {
            break;
        }
    }
    Ok(line)
}

fn conclude(total: usize, all: &[Measured], used: &[bool], line: Line) -> Result<LineEstimate> {
    let (h, _, chi_square) = normal_equations(&line, all, used);
    let inverse = h.try_inverse().filter(|c| c.iter().all(|v| v.is_finite()));
    let inverse = inverse.ok_or_else(|| coincident("their line has no direction"))?;
    if inverse[(2, 2)].max(inverse[(3, 3)]) > NO_DIRECTION * NO_DIRECTION || one_place(all, used) {
        return Err(coincident("they are no farther apart than their noise"));
    }
    let count = used.iter().filter(|u| **u).count();
    let degrees_of_freedom = 2 * count - 4;
    let excess = chi_square / degrees_of_freedom.max(1) as f64;
    let contradicted = excess > 1.0 && upper_tail(chi_square, degrees_of_freedom as f64) < BEYOND_CHANCE;
    let [e, f] = line.across();
    let mut basis = Matrix6x4::zeros();
    for (i, across) in [e, f].iter().enumerate() {
        basis.fixed_view_mut::<3, 1>(0, i).copy_from(across);
        basis.fixed_view_mut::<3, 1>(3, 2 + i).copy_from(across);
    }
    let covariance = basis * inverse * basis.transpose() * if contradicted { excess } else { 1.0 };
    let mut inliers = vec![false; total];
    let mut extent = [f64::INFINITY, f64::NEG_INFINITY];
    for (m, _) in all.iter().zip(used).filter(|(_, u)| **u) {
        inliers[m.index] = true;
        let s = line.residual(m).1;
        extent = [extent[0].min(s), extent[1].max(s)];
    }
    let covariance = (covariance + covariance.transpose()) * 0.5;
    let line = MeasuredLine { point: line.point, direction: line.direction, covariance, extent };
    Ok(LineEstimate { line, chi_square, degrees_of_freedom, inliers })
}

/// Could all points be one?
fn one_place(all: &[Measured], used: &[bool]) -> bool {
    let used = || all.iter().zip(used).filter(|(_, u)| **u).map(|(m, _)| m);
    let sum: Matrix3<f64> = used().map(|m| m.information).sum();
    let weighted: Vector3<f64> = used().map(|m| m.information * m.x).sum();
    let Some(mean) = sum.cholesky().map(|s| s.solve(&weighted)) else { return true };
    let chi_square: f64 = used().map(|m| (m.x - mean).dot(&(m.information * (m.x - mean)))).sum();
    upper_tail(chi_square, 3.0 * (used().count() as f64 - 1.0)) >= BEYOND_CHANCE
}

fn coincident(detail: &str) -> Error {
    Error::degenerate(Degeneracy::Coincident, detail)
}
