//! The surface that a point cloud samples, for rays: what a ray meets first, where, and how surely.
//!
//! Each point stands for a disc as large as the spacing of the points about it (surfels; Pfister and
//! others, Surfels, SIGGRAPH 2000), so that a ray does not slip between the samples of what is near
//! and hit what is behind. The nearest discs along the ray that support each other say where the
//! surface is; a plane fitted to its points there, by local and robust least squares, says it exactly.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::plane::{self, LocalPlane, Sample};
use super::surface::{Edge, MeasuredBy};
use super::tree::Tree;
use crate::error::{Error, Result};
use crate::geometry::Ray;

/// Fewest points of a cloud, and of a surface that is believed.
const MIN_POINTS: usize = 4;
const MIN_SUPPORT: usize = 3;
/// A disc reaches as far as its eighth neighbour: in a square grid to the diagonal one, twice as far as
/// a ray can be from the nearest sample.
const SPACING_NEIGHBOURS: usize = 8;
/// Points that the local plane is fitted to: wanted, and at most.
const FIT_POINTS: [usize; 2] = [16, 64];
/// Planes agree within this many standard deviations of the narrower one.
const AGREE: f64 = 1.5;
/// How often they are looked for in a wider tube about the ray, each time half as wide again.
const WIDENINGS: usize = 5;
/// Surfaces steeper against the ray than this many metres a metre are not told from edges.
const STEEPEST: f64 = 4.0;
/// No disc is larger than this as seen from the ray's origin, radians: a lonely point is no surface.
const LARGEST_DISC: f64 = 0.05;
/// A surface ends where the ray is nearer to its last points than this many of its standard deviations.
const EDGE_SIGMAS: f64 = 2.0;
/// Part of the points about the ray that have to lie on one plane, or the two of a bend.
const FLAT: f64 = 0.75;

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
    measured_by: MeasuredBy,
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
    pub fn new(positions: &[Vector3<f64>], noise: PointNoise<'_>, measured_by: MeasuredBy) -> Result<Self> {
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
        Ok(Self { tree, covariances, discs, measured_by })
    }

    pub fn measured_by(&self) -> MeasuredBy {
        self.measured_by
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
        let none = || Error::NotFound { reason: "the cloud has no surface near the ray".into() };
        let clusters = self.clusters(ray, deviation);
        let fitted: Vec<Option<CloudHit>> = clusters.iter().map(|c| self.fit(ray, deviation, c)).collect();
        let first = fitted.iter().position(Option::is_some).ok_or_else(none)?;
        let mut hits = fitted[first..].iter().flatten();
        let hit = *hits.next().ok_or_else(none)?;
        // Points in front that make no surface may be one that was sampled too thinly.
        let edge = match (first, hit.edge) {
            (0, None) => None,
            (0, Some(_)) => Some(Edge { other: hits.next().map(|h| h.distance) }),
            _ => Some(Edge { other: clusters[0].first().map(|c| c.along) }),
        };
        Ok(CloudHit { edge, ..hit })
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
        clusters
    }

    /// Variance of a point along a direction.
    fn noise(&self, index: usize, direction: &Vector3<f64>) -> f64 {
        self.covariances.get(index).map_or(0.0, |c| direction.dot(&(c * direction)))
    }

    /// The surface of a cluster's discs, where the ray meets it.
    fn fit(&self, ray: &Ray, deviation: f64, cluster: &[Candidate]) -> Option<CloudHit> {
        if cluster.len() < MIN_SUPPORT {
            return None;
        }
        let middle = &cluster[cluster.len() / 2];
        let guess = ray.at(middle.along);
        let mut samples = self.samples(ray, &guess, middle);
        let (fit, count) = widest_agreeing(&mut samples)?;
        let samples = &samples[..count];
        let distance = (guess - ray.origin).norm() + fit.offset;
        let axes = axes(ray);
        let normal = (axes[0] - axes[1] * fit.slope.x - axes[2] * fit.slope.y).normalize();
        let margin = EDGE_SIGMAS * deviation * distance;
        let (on, off): (Vec<_>, Vec<_>) = samples.iter().zip(&fit.used).partition(|(_, used)| **used);
        let [mut on, off] = [on, off].map(|part| part.into_iter().map(|(s, _)| s.clone()).collect::<Vec<Sample>>());
        let points = on.len();
        let mut variance = fit.variance + plane::bend(samples, &fit).unwrap_or(0.0);
        // Where the surface bends between the ray's next samples, it may follow either of its two planes.
        let reach = self.discs[middle.index] + margin;
        let beside = off.iter().any(|s| s.across().norm() <= reach);
        if let Some(other) = beside.then(|| plane::fit(&off)).flatten() {
            let apart = (other.offset - fit.offset).abs();
            if apart <= (other.slope - fit.slope).norm() * reach {
                variance += (0.5 * apart).powi(2);
                on.extend(off.into_iter().zip(&other.used).filter(|(_, used)| **used).map(|(s, _)| s));
            }
        }
        let explained = on.len() as f64 >= FLAT * samples.len() as f64;
        let places: Vec<Vector2<f64>> = on.iter().map(Sample::across).collect();
        let sure = explained && surrounds(&places, margin);
        let edge = (!sure).then_some(Edge { other: None });
        let hit = CloudHit { distance, variance, normal, points, edge };
        Some(hit).filter(|h| h.distance > 0.0 && h.distance.is_finite() && h.variance.is_finite())
    }

    /// The points about a place on the ray, in its axes: those next to the ray, of which there are
    /// enough, wider than their noise reaches across it and not behind or before each other.
    fn samples(&self, ray: &Ray, place: &Vector3<f64>, about: &Candidate) -> Vec<Sample> {
        let (points, axes) = (self.tree.points(), axes(ray));
        let turn = Matrix3::from_columns(&axes);
        let (along, total) = match self.covariances.get(about.index) {
            Some(c) => (ray.direction.dot(&(c * ray.direction)), c.trace()),
            None => (0.0, 0.0),
        };
        let across = (total - along).max(0.0).sqrt();
        let mut tube = (2.0 * self.discs[about.index]).max(3.0 * across);
        let mut found = Vec::new();
        for _ in 0..WIDENINGS {
            let window = STEEPEST * tube + 4.0 * along.sqrt();
            found.clear();
            self.tree.within(place, tube.hypot(window), |i| {
                let [z, x, y] = axes.map(|e| e.dot(&(points[i] - place)));
                let r = x.hypot(y);
                if r <= tube && z.abs() <= window {
                    found.push((r, i, Vector3::new(z, x, y)));
                }
            });
            if found.len() >= FIT_POINTS[0] {
                break;
            }
            tube *= 1.5;
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.truncate(FIT_POINTS[1]);
        let sample = |(_, i, p): &(f64, usize, Vector3<f64>)| Sample {
            row: Vector3::new(1.0, p.y, p.z),
            along: p.x,
            kernel: 1.0,
            covariance: self.covariances.get(*i).map(|c| turn.transpose() * c * turn),
        };
        found.iter().map(sample).collect()
    }
}

/// The plane through as many of the points next to the ray as agree with those that fewer give (Lepski
/// 1991): a wide neighbourhood where the surface is flat, a narrow one near its bends.
fn widest_agreeing(samples: &mut [Sample]) -> Option<(LocalPlane, usize)> {
    let mut fits: Vec<(LocalPlane, usize)> = Vec::new();
    let mut count = FIT_POINTS[0].min(samples.len());
    loop {
        let part = &mut samples[..count];
        // Epanechnikov's kernel, which ends beyond the last of them.
        let reach = 1.1 * part.last()?.row.yz().norm();
        part.iter_mut().for_each(|s| s.kernel = 1.0 - (s.row.yz().norm() / reach.max(1e-300)).powi(2));
        match plane::fit(part) {
            Some(fit) if fits.iter().all(|(f, _)| (f.offset - fit.offset).abs() <= AGREE * f.variance.sqrt()) => {
                fits.push((fit, count));
            }
            _ if fits.is_empty() && count < samples.len() => {}
            _ => break,
        }
        if count == samples.len() {
            break;
        }
        count = (count + count / 2).min(samples.len());
    }
    let (narrow, _) = fits.first()?;
    let (offset, variance) = (narrow.offset, narrow.variance);
    let (mut fit, count) = fits.pop()?;
    // What the wide one differs by, beyond what the noise of the points that it adds makes of it, is
    // the surface's bend.
    let expected = (variance - fit.variance).max(0.0);
    fit.variance += ((fit.offset - offset).powi(2) - expected).max(0.0);
    Some((fit, count))
}

/// Along the ray and two across it.
fn axes(ray: &Ray) -> [Vector3<f64>; 3] {
    let e1 = ray.direction.cross(&Vector3::ith(ray.direction.iamin(), 1.0)).normalize();
    [ray.direction, e1, ray.direction.cross(&e1)]
}

/// Are all places within `margin` of the origin inside the convex hull of the points?
fn surrounds(points: &[Vector2<f64>], margin: f64) -> bool {
    (0..8).all(|i| {
        let (sin, cos) = (f64::from(i) * std::f64::consts::FRAC_PI_4).sin_cos();
        let place = Vector2::new(cos, sin) * margin;
        let mut angles: Vec<f64> = points.iter().map(|p| (p.y - place.y).atan2(p.x - place.x)).collect();
        angles.sort_by(f64::total_cmp);
        let (Some(first), Some(last)) = (angles.first(), angles.last()) else { return false };
        let round = first + std::f64::consts::TAU - last;
        angles.windows(2).map(|a| a[1] - a[0]).fold(round, f64::max) < std::f64::consts::PI
    })
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
