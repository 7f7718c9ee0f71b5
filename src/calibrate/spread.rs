//! Do the 3D points and lines span space? Refusal of coincident, collinear and coplanar sets, with the
//! noise of the points themselves taken into account, and of lines that are parallel or all meet.

use nalgebra::{Matrix3, Vector3};

use super::line_measurement::LineMeasurement;
use super::measurement::{Measurement, PointMeasurement};
use super::stand_ins::{Bundle, StandIn, stand_ins};
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::linalg::symmetric_eigen3;

/// Below this part of the largest extent an extent is zero to rounding.
const NUMERICALLY_ZERO: f64 = 1e-6;

/// How the points' own noise counts.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Noise {
    /// Not at all: outliers may still be among the points, with noise beyond measure.
    Ignored,
    /// An extent that is no more than noise is none.
    Counted,
}

/// Part of the second extent below which the third is treated as none when only a start is wanted.
const NEARLY_PLANAR: f64 = 0.02;

/// Refuses coincident and collinear sets, and coplanar ones unless `plane_is_enough`. Is it nearly a
/// plane? A few stray points off it (outliers that a degenerate fit took in) do not make a relief.
pub(crate) fn check(measurements: &[&Measurement], plane_is_enough: bool, needed: usize, noise: Noise) -> Result<bool> {
    let overflow = || Error::degenerate(Degeneracy::IllConditioned, "the points' extents overflow");
    let different = count_different(measurements, needed);
    if different < needed {
        let detail = format!("only {different} different 3D points or lines, at least {needed} are needed");
        return Err(Error::degenerate(Degeneracy::Coincident, detail));
    }
    check_lines(measurements, noise)?;
    let points = stand_ins(measurements, position).ok_or_else(overflow)?;
    let counted = if noise == Noise::Counted { 1.0 } else { 0.0 };
    let (axes, extents, noise) = principal(points.iter()).ok_or_else(overflow)?;
    let size = points.iter().fold(0.0f64, |m, (x, _)| m.max(x.norm()));
    let flat = |extent: f64, noise: f64| extent <= NUMERICALLY_ZERO * extents[0] || extent < 1.5 * noise * counted;
    if extents[0] <= 1e-9 * size || flat(extents[0], noise[0]) {
        return Err(Error::degenerate(Degeneracy::Coincident, format!("extent {:.2e} m", extents[0])));
    }
    if flat(extents[1], noise[1]) {
        let detail = format!("extents {:.3} x {:.2e} m", extents[0], extents[1]);
        return Err(Error::degenerate(Degeneracy::Collinear, detail));
    }
    let planar = flat(extents[2], noise[2]) || flat_but_for_strays(&points, &axes[2], counted);
    if planar && !plane_is_enough {
        let detail = format!("extents {:.3} x {:.3} x {:.2e} m", extents[0], extents[1], extents[2]);
        return Err(Error::degenerate(Degeneracy::Coplanar, detail));
    }
    Ok(planar || extents[2] < NEARLY_PLANAR * extents[1])
}

/// Measurements of different points or lines, counted up to `enough`.
fn count_different(measurements: &[&Measurement], enough: usize) -> usize {
    let bits = |x: &Vector3<f64>, d: &Vector3<f64>| [x.x, x.y, x.z, d.x, d.y, d.z].map(f64::to_bits);
    let key = |m: &&Measurement| match m {
        Measurement::Point(m) => position(m).map(|(x, _)| bits(&x, &Vector3::zeros())),
        Measurement::Line(m) => Some(bits(&m.point, &m.direction)),
    };
    let mut keys: Vec<[u64; 6]> = Vec::with_capacity(enough);
    for key in measurements.iter().filter_map(key) {
        if keys.len() == enough {
            break;
        }
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    keys.len()
}

/// Lines that all meet in one point, at infinity if they are parallel, show it and nothing of the
/// depth behind it: four of the eleven parameters are left open, and only two points close them.
fn check_lines(measurements: &[&Measurement], noise: Noise) -> Result<()> {
    let lines: Vec<&LineMeasurement> = measurements.iter().filter_map(|m| m.as_line()).collect();
    if lines.is_empty() || measurements.len() - lines.len() > 1 {
        return Ok(());
    }
    let n = lines.len() as f64;
    let scatter = lines.iter().map(|l| l.direction * l.direction.transpose()).sum::<Matrix3<f64>>() / n;
    let turned = lines.iter().flat_map(|l| l.errors()).map(|[_, d]| d.norm_squared()).sum::<f64>() / n;
    let second = symmetric_eigen3(&scatter).map_or(0.0, |(values, _)| values[1].max(0.0).sqrt());
    let counted = if noise == Noise::Counted { 1.5 } else { 0.0 };
    if second <= NUMERICALLY_ZERO || second < counted * turned.sqrt() {
        let detail = format!("the lines' directions differ by {second:.2e} rad");
        return Err(Error::degenerate(Degeneracy::Parallel, detail));
    }
    let bundle = Bundle::of(std::iter::empty(), lines.iter().copied())
        .ok_or_else(|| Error::degenerate(Degeneracy::IllConditioned, "the lines' extents overflow"))?;
    let reach = lines.iter().fold(bundle.centre.norm(), |m, l| m.max(l.point.norm()));
    let moved = lines
        .iter()
        .flat_map(|l| {
            let near = l.parameter_near(&bundle.centre);
            l.errors().iter().map(move |[p, d]| (p + d * near).norm_squared())
        })
        .sum::<f64>()
        / n;
    if bundle.size <= NUMERICALLY_ZERO * reach || bundle.size < counted * moved.sqrt() {
        let detail = format!("the lines pass their common point within {:.2e} m", bundle.size);
        return Err(Error::degenerate(Degeneracy::Concurrent, detail));
    }
    Ok(())
}

/// Metric position and covariance, where there is one.
fn position(m: &PointMeasurement) -> Option<StandIn> {
    // Near infinity a position and its covariance mean nothing.
    let point = m.position().filter(|_| m.rho >= 3.0 * m.sigma_rho)?;
    let weight = m.homogeneous(m.rho).w;
    let covariance = m
        .noise_columns()
        .map(|e| {
            let g = (e.xyz() - point * e.w) / weight;
            g * g.transpose()
        })
        .sum();
    Some((point, covariance))
}

/// Axes, standard deviations along them (descending), and the part of them that is noise.
type Principal = ([Vector3<f64>; 3], [f64; 3], [f64; 3]);

fn principal<'a>(points: impl Iterator<Item = &'a StandIn> + Clone) -> Option<Principal> {
    let n = points.clone().count() as f64;
    let centre = points.clone().map(|(x, _)| x).sum::<Vector3<f64>>() / n;
    let scatter = points.clone().map(|(x, _)| (x - centre) * (x - centre).transpose()).sum::<Matrix3<f64>>() / n;
    let noise = points.map(|(_, c)| c).sum::<Matrix3<f64>>() / n;
    let (values, axes) = symmetric_eigen3(&scatter)?;
    let extents = values.map(|v| v.max(0.0).sqrt());
    let noises = axes.map(|a| a.dot(&(noise * a)).max(0.0).sqrt());
    Some((axes, extents, noises))
}

/// Is the set no plane, whatever strays are left out, because too many fours of its points are none? Each
/// stray is in one of them, and a four is off every plane by its scatter's least eigenvalue or more. Says no
/// where it cannot tell.
fn fours_have_volume(points: &[StandIn], strays: usize, counted: f64) -> bool {
    // Far apart in the set: neighbours are often of one wall.
    let fours = points.len() / 4;
    if fours <= strays {
        return false;
    }
    let off = |i: usize| {
        let four = [0, 1, 2, 3].map(|k| points[i + k * fours].0);
        let centre = four.iter().sum::<Vector3<f64>>() * 0.25;
        let scatter = four.iter().map(|x| (x - centre) * (x - centre).transpose()).sum::<Matrix3<f64>>();
        // The other two eigenvalues' product is at most the square of half their sum.
        let half = 0.5 * scatter.trace();
        if half > 0.0 { (scatter.determinant() / (half * half)).max(0.0) } else { 0.0 }
    };
    let mut offs: Vec<f64> = (0..fours).map(off).collect();
    let (most, _, _) = offs.select_nth_unstable_by(fours - strays, f64::total_cmp);
    let least: f64 = most.iter().sum();
    // What the largest extent and the noise of what is left can be at most, squared and summed.
    let mean = points.iter().map(|(x, _)| x).sum::<Vector3<f64>>() / points.len() as f64;
    let extent: f64 = points.iter().map(|(x, _)| (x - mean).norm_squared()).sum();
    let noise: f64 = points.iter().map(|(_, c)| c.trace()).sum();
    least > 2.0 * (NUMERICALLY_ZERO * NUMERICALLY_ZERO * extent).max(1.2 * 1.2 * counted * noise)
}

/// Is the set a plane once a few points are left out (three, or 2 %)?
fn flat_but_for_strays(points: &[StandIn], normal: &Vector3<f64>, counted: f64) -> bool {
    let strays = 3.max(points.len() / 50);
    if points.len() < strays + 6 || fours_have_volume(points, strays, counted) {
        return false;
    }
    // Distances of all points from the median height, those of the strays beyond the limit.
    let (mut heights, mut away, mut limit) = (Vec::with_capacity(points.len()), vec![0.0; points.len()], 0.0);
    let kept = |away: &[f64], limit: f64| {
        let within: Vec<&StandIn> = points.iter().zip(away).filter(|(_, d)| **d <= limit).map(|(p, _)| p).collect();
        principal(within.into_iter())
    };
    let mut normal = *normal;
    for _ in 0..5 {
        let within = |d: &f64| *d <= limit;
        heights.clear();
        heights.extend(points.iter().zip(&away).filter(|(_, d)| within(d)).map(|((x, _), _)| normal.dot(x)));
        let middle = heights.len() / 2;
        let median = *heights.select_nth_unstable_by(middle, f64::total_cmp).1;
        away.iter_mut().zip(points).for_each(|(d, (x, _))| *d = (normal.dot(x) - median).abs());
        heights.clear();
        heights.extend_from_slice(&away);
        limit = *heights.select_nth_unstable_by(points.len() - strays - 1, f64::total_cmp).1;
        let next = kept(&away, limit).map_or(normal, |(axes, ..)| axes[2]);
        let settled = normal.dot(&next).abs() >= 1.0 - f64::EPSILON;
        normal = next;
        if settled {
            break;
        }
    }
    kept(&away, limit).is_some_and(|(_, extents, noise)| {
        extents[2] <= NUMERICALLY_ZERO * extents[0] || extents[2] < 1.2 * noise[2] * counted
    })
}
