//! Do the 3D points span space? Refusal of coincident, collinear and coplanar sets, with the noise of
//! the points themselves taken into account.

use nalgebra::{Matrix3, Vector3};

use super::measurement::Measurement;
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
pub(crate) fn check(measurements: &[Measurement], plane_is_enough: bool, needed: usize, noise: Noise) -> Result<bool> {
    let points: Vec<(Vector3<f64>, Matrix3<f64>)> = measurements.iter().filter_map(position).collect();
    let mut keys: Vec<[u64; 3]> = points.iter().map(|(x, _)| [x.x, x.y, x.z].map(f64::to_bits)).collect();
    keys.sort_unstable();
    keys.dedup();
    if keys.len() < needed {
        let detail = format!("only {} different 3D points, at least {needed} are needed", keys.len());
        return Err(Error::degenerate(Degeneracy::Coincident, detail));
    }
    let counted = if noise == Noise::Counted { 1.0 } else { 0.0 };
    let (axes, extents, noise) = principal(&points)
        .ok_or_else(|| Error::degenerate(Degeneracy::IllConditioned, "the points' extents overflow"))?;
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

/// Metric position and covariance, where there is one.
fn position(m: &Measurement) -> Option<(Vector3<f64>, Matrix3<f64>)> {
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

fn principal(points: &[(Vector3<f64>, Matrix3<f64>)]) -> Option<Principal> {
    let n = points.len() as f64;
    let centre = points.iter().map(|(x, _)| x).sum::<Vector3<f64>>() / n;
    let scatter = points.iter().map(|(x, _)| (x - centre) * (x - centre).transpose()).sum::<Matrix3<f64>>() / n;
    let noise = points.iter().map(|(_, c)| c).sum::<Matrix3<f64>>() / n;
    let (values, axes) = symmetric_eigen3(&scatter)?;
    let extents = values.map(|v| v.max(0.0).sqrt());
    let noises = axes.map(|a| a.dot(&(noise * a)).max(0.0).sqrt());
    Some((axes, extents, noises))
}

/// Is the set a plane once a few points are left out (three, or 2 %)?
fn flat_but_for_strays(points: &[(Vector3<f64>, Matrix3<f64>)], normal: &Vector3<f64>, counted: f64) -> bool {
    let strays = 3.max(points.len() / 50);
    if points.len() < strays + 6 {
        return false;
    }
    let mut kept = points.to_vec();
    let mut normal = *normal;
    for _ in 0..5 {
        let mut heights: Vec<f64> = kept.iter().map(|(x, _)| normal.dot(x)).collect();
        let middle = heights.len() / 2;
        let median = *heights.select_nth_unstable_by(middle, f64::total_cmp).1;
        kept = points.to_vec();
        kept.sort_by(|(x, _), (y, _)| (normal.dot(x) - median).abs().total_cmp(&(normal.dot(y) - median).abs()));
        kept.truncate(points.len() - strays);
        normal = principal(&kept).map_or(normal, |(axes, ..)| axes[2]);
    }
    principal(&kept).is_some_and(|(_, extents, noise)| {
        extents[2] <= NUMERICALLY_ZERO * extents[0] || extents[2] < 1.2 * noise[2] * counted
    })
}
