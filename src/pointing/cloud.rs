//! The surface that a point cloud samples, for rays: what a ray meets first, where, and how surely.
//!
//! Each point stands for a disc as large as the spacing of the points about it (surfels; Pfister and
//! others, Surfels, SIGGRAPH 2000), so that a ray does not slip between the samples of what is near
//! and hit what is behind. The nearest discs along the ray that support each other say where the
//! surface is; a plane fitted to its points there, by local and robust least squares, says it exactly.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::surface::Edge;
use super::tree::Tree;
use crate::error::{Error, Result};
use crate::geometry::Ray;

/// Fewest points of a cloud, and of a surface that is believed.
const MIN_POINTS: usize = 4;
const MIN_SUPPORT: usize = 3;
/// A disc reaches as far as its eighth neighbour: in a square grid to the diagonal one, twice as far as
/// a ray can be from the nearest sample.
const SPACING_NEIGHBOURS: usize = 8;
/// Points that the local plane is fitted to, at most.
const FIT_NEIGHBOURS: usize = 24;
/// No disc is larger than this as seen from the ray's origin, radians: a lonely point is no surface.
const LARGEST_DISC: f64 = 0.05;
/// Residuals of the local plane beyond this many standard deviations lose their weight (Tukey).
const TUKEY: f64 = 4.685;
const ROUNDS: usize = 8;

/// How well the points of a cloud are known.
#[derive(Debug, Clone, Copy)]
pub enum PointNoise<'a> {
    /// Not known: estimated from the points' scatter about the surface.
    Unknown,
    /// Variances of each coordinate, m^2, the same in all directions.
    Variances(&'a [f64]),
    /// m^2.
    Covariances(&'a [Matrix3<f64>]),
}

/// A point cloud, arranged for rays. Made once, in about a second for a million points.
#[derive(Debug)]
pub struct CloudSurface {
    tree: Tree,
    /// In the tree's order; empty when not known.
    covariances: Vec<Matrix3<f64>>,
    /// Radius of each point's disc, metres.
    discs: Vec<f64>,
}

/// Where a ray meets a cloud's surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudHit {
    /// From the ray's origin, metres.
    pub distance: f64,
    /// Of that distance, m^2.
    pub variance: f64,
    /// Of the surface, unit, away from the ray's origin.
    pub normal: Vector3<f64>,
    /// Points that it comes from.
    pub points: usize,
    /// The surface ends about here, so that what is met may as well be what is behind.
    pub edge: Option<Edge>,
}

/// A point near the ray.
struct Candidate {
    index: usize,
    along: f64,
    disc: f64,
}

impl CloudSurface {
    /// # Errors
    /// `TooFewPoints` below four; `NotFinite`; `InvalidArgument`: variances or covariances of another
    /// number than the points, or that are none; all points in one place.
    pub fn new(positions: &[Vector3<f64>], noise: PointNoise<'_>) -> Result<Self> {
        if positions.len() < MIN_POINTS {
            return Err(Error::TooFewPoints { given: positions.len(), needed: MIN_POINTS });
        }
        if let Some(index) = positions.iter().position(|p| p.iter().any(|v| v.is_nan() || v.abs() > 1e9)) {
            return Err(Error::NotFinite { name: "points", index });
        }
        let covariances = covariances(positions.len(), noise)?;
        let tree = Tree::new(positions);
        let discs = tree.spacings(SPACING_NEIGHBOURS);
        if discs.iter().all(|d| *d == 0.0) {
            return Err(Error::invalid("points", "all are in one place"));
        }
        let covariances = match covariances.is_empty() {
            true => covariances,
            false => tree.order().iter().map(|i| covariances[*i as usize]).collect(),
        };
        Ok(Self { tree, covariances, discs })
    }

    pub fn len(&self) -> usize {
        self.discs.len()
    }

    pub fn is_empty(&self) -> bool {
        self.discs.is_empty()
    }

    /// What a ray meets first. `deviation`: standard deviation of its direction, radians.
    ///
    /// # Errors
    /// `NotFound`: no surface near the ray.
    pub fn hit(&self, ray: &Ray, deviation: f64) -> Result<CloudHit> {
        let clusters = self.clusters(ray, deviation);
        let none = || Error::NotFound { reason: "the cloud has no surface near the ray".into() };
        let mut hits = clusters.iter().filter_map(|c| self.fit(ray, c));
        let first = hits.next().ok_or_else(none)?;
        let edge = match first.edge {
            Some(_) => Some(Edge { behind: hits.next().map(|h| h.distance) }),
            None => None,
        };
        Ok(CloudHit { edge, ..first })
    }

    /// Discs that the ray meets, front to back, in groups that are one surface each.
    fn clusters(&self, ray: &Ray, deviation: f64) -> Vec<Vec<Candidate>> {
        let points = self.tree.points();
        let mut found = Vec::new();
        self.tree.along(ray, LARGEST_DISC + deviation, |i| {
            let offset = points[i] - ray.origin;
            let along = offset.dot(&ray.direction);
            let disc = self.discs[i].min(LARGEST_DISC * along) + deviation * along;
            if along > 0.0 && (offset - ray.direction * along).norm_squared() <= disc * disc {
                found.push(Candidate { index: i, along, disc });
            }
        });
        found.sort_by(|a, b| a.along.total_cmp(&b.along).then(a.index.cmp(&b.index)));
        let mut clusters: Vec<Vec<Candidate>> = Vec::new();
        for c in found {
            let near = |last: &Candidate| {
                let gap = 2.0 * last.disc.max(c.disc)
                    + 3.0 * (self.noise(last.index, &ray.direction) + self.noise(c.index, &ray.direction)).sqrt();
                c.along - last.along <= gap
            };
            match clusters.last_mut() {
                Some(cluster) if cluster.last().is_some_and(near) => cluster.push(c),
                _ => clusters.push(vec![c]),
            }
        }
        clusters.retain(|c| c.len() >= MIN_SUPPORT);
        clusters
    }

    /// Variance of a point along a direction.
    fn noise(&self, index: usize, direction: &Vector3<f64>) -> f64 {
        self.covariances.get(index).map_or(0.0, |c| direction.dot(&(c * direction)))
    }

    /// The surface of a cluster's discs, where the ray meets it.
    fn fit(&self, ray: &Ray, cluster: &[Candidate]) -> Option<CloudHit> {
        let guess = ray.at(cluster[cluster.len() / 2].along);
        let near = self.tree.nearest(&guess, FIT_NEIGHBOURS);
        let points = self.tree.points();
        let e1 = ray.direction.cross(&Vector3::ith(ray.direction.iamin(), 1.0)).normalize();
        let e2 = ray.direction.cross(&e1);
        let reach = near.iter().map(|i| (points[*i] - guess).norm_squared()).fold(0.0, f64::max).sqrt();
        let samples: Vec<Sample> = near
            .iter()
            .map(|&i| {
                let offset = points[i] - guess;
                let across = Vector2::new(e1.dot(&offset), e2.dot(&offset));
                // A kernel (Epanechnikov) that ends beyond the last neighbour.
                let kernel = 1.0 - across.norm_squared() / (1.21 * reach * reach).max(1e-300);
                Sample { index: i, across, along: ray.direction.dot(&offset), kernel: kernel.max(0.0) }
            })
            .collect();
        let fit = self.robust_plane(&samples, ray, &e1, &e2)?;
        let distance = (guess - ray.origin).norm() + fit.offset;
        let normal = (ray.direction - e1 * fit.slope.x - e2 * fit.slope.y).normalize();
        let inside = surrounded(samples.iter().zip(&fit.weights).filter(|(_, w)| **w > 0.0).map(|(s, _)| s.across));
        Some(CloudHit {
            distance,
            variance: fit.variance,
            normal,
            points: fit.weights.iter().filter(|w| **w > 0.0).count(),
            edge: (!inside).then_some(Edge { behind: None }),
        })
        .filter(|h| h.distance > 0.0 && h.distance.is_finite() && h.variance.is_finite())
    }

    /// along = offset + slope . across by weighted least squares, reweighted.
    fn robust_plane(&self, samples: &[Sample], ray: &Ray, e1: &Vector3<f64>, e2: &Vector3<f64>) -> Option<LocalPlane> {
        let known = !self.covariances.is_empty();
        let mut slope = Vector2::zeros();
        let mut robust: Vec<f64> = vec![1.0; samples.len()];
        let mut result = None;
        for _ in 0..ROUNDS {
            // Of each sample's distance from the plane along the ray.
            let n = ray.direction - e1 * slope.x - e2 * slope.y;
            let variances: Vec<f64> =
                samples.iter().map(|s| if known { self.noise(s.index, &n).max(1e-18) } else { 1.0 }).collect();
            let mut h = Matrix3::zeros();
            let mut meat = Matrix3::zeros();
            let mut g = Vector3::zeros();
            for ((s, v), r) in samples.iter().zip(&variances).zip(&robust) {
                let row = Vector3::new(1.0, s.across.x, s.across.y);
                let w = r * s.kernel / v;
                h += row * row.transpose() * w;
                meat += row * row.transpose() * (w * w * v);
                g += row * (w * s.along);
            }
            let inverse = h.try_inverse()?;
            let x = inverse * g;
            slope = x.yz();
            let residual = |s: &Sample| s.along - x.x - slope.dot(&s.across);
            let mut sizes: Vec<f64> =
                samples.iter().zip(&variances).map(|(s, v)| residual(s).abs() / v.sqrt()).collect();
            // Scale of the residuals: median, no less than what the noise says.
            let mut sorted = sizes.clone();
            sorted.sort_by(f64::total_cmp);
            let median = 1.4826 * sorted[sorted.len() / 2];
            let scale = if known { median.max(1.0) } else { median.max(1e-12) };
            sizes.iter_mut().for_each(|s| *s /= scale);
            // chi-square of the weighted residuals beside what it should be.
            let used: Vec<bool> = robust.iter().zip(samples).map(|(r, s)| *r > 0.0 && s.kernel > 0.0).collect();
            let count = used.iter().filter(|u| **u).count();
            if count < MIN_SUPPORT {
                return None;
            }
            let (mut sum, mut total) = (0.0, 0.0);
            for ((s, v), r) in samples.iter().zip(&variances).zip(&robust) {
                sum += r * s.kernel * residual(s).powi(2) / v;
                total += r * s.kernel;
            }
            let spread = if count > 3 { sum / total * count as f64 / (count - 3) as f64 } else { 0.0 };
            let factor = if known { spread.max(1.0) } else { spread };
            let variance = (inverse * meat * inverse)[(0, 0)] * factor;
            let weights = robust.iter().zip(samples).map(|(r, s)| r * s.kernel).collect();
            result = Some(LocalPlane { offset: x.x, slope, variance, weights });
            robust = sizes.iter().map(|s| (1.0 - (s / TUKEY).powi(2)).max(0.0).powi(2)).collect();
        }
        result
    }
}

struct Sample {
    index: usize,
    across: Vector2<f64>,
    along: f64,
    kernel: f64,
}

struct LocalPlane {
    offset: f64,
    slope: Vector2<f64>,
    variance: f64,
    weights: Vec<f64>,
}

/// Is the origin inside the convex hull of the points?
fn surrounded(points: impl Iterator<Item = Vector2<f64>>) -> bool {
    let mut angles: Vec<f64> = points.map(|p| p.y.atan2(p.x)).collect();
    angles.sort_by(f64::total_cmp);
    let (Some(first), Some(last)) = (angles.first(), angles.last()) else { return false };
    let round = first + std::f64::consts::TAU - last;
    let widest = angles.windows(2).map(|a| a[1] - a[0]).fold(round, f64::max);
    widest < std::f64::consts::PI
}

fn covariances(points: usize, noise: PointNoise<'_>) -> Result<Vec<Matrix3<f64>>> {
    let other = |name, n| Error::invalid(name, format!("{n} for {points} points"));
    match noise {
        PointNoise::Unknown => Ok(Vec::new()),
        PointNoise::Variances(v) => {
            if v.len() != points {
                return Err(other("variances", v.len()));
            }
            if let Some(index) = v.iter().position(|v| !v.is_finite()) {
                return Err(Error::NotFinite { name: "variances", index });
            }
            if let Some(i) = v.iter().position(|v| *v < 0.0) {
                return Err(Error::invalid("variances", format!("{} of point {i}", v[i])));
            }
            Ok(v.iter().map(|v| Matrix3::identity() * *v).collect())
        }
        PointNoise::Covariances(c) => {
            if c.len() != points {
                return Err(other("covariances", c.len()));
            }
            if let Some(index) = c.iter().position(|c| c.iter().any(|v| !v.is_finite())) {
                return Err(Error::NotFinite { name: "covariances", index });
            }
            c.iter().try_for_each(|c| crate::calibrate::uncertainty::semidefinite(c, "covariances"))?;
            Ok(c.to_vec())
        }
    }
}
