//! The planes of a scene, found in the points, shots or depths of one station, or fitted to regions
//! that the user names.

mod measured;
mod order;
mod patch;
mod rays;
mod search;
mod support;
pub(super) mod view;

use std::borrow::Cow;

use nalgebra::{Matrix3, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_core::SeedableRng;

use self::measured::{Cloud, Measured, Shots};
pub use self::rays::{shots_of_depth_map, shots_of_ranges};
use self::search::{Contrast, Limits, search};
pub use self::support::PlaneSupport;
use self::view::View;
use super::plane_fit::{PlaneEstimate, PlaneFitOptions, fit_plane_to_points, fit_plane_to_shots};
use crate::error::{Error, Result};
use crate::geometry::InverseDepthPoint;
use crate::geometry::linalg::symmetric_eigen3;

/// Measurements that planes are sought in; more are thinned out at random before the search, and all
/// are used after it.
const SOUGHT: usize = 40_000;
/// Measurements that make a view, about: sixteen for each of its cells.
const VIEWED: usize = 200_000;
/// Neighbours that the noise of points is estimated from.
const PATCH: usize = 12;
/// Scatter about a region's plane, relative to its shorter side, beyond which it is none.
const MAX_THICKNESS: f64 = 0.1;
/// Noise in units of the stated one beyond which that does not explain the scatter.
const MAX_NOISE_FACTOR: f64 = 3.0;
/// Most planes of a station: numbers of planes are 16 bits long.
const MAX_PLANES: usize = 1000;

/// How planes are found.
#[derive(Debug, Clone, PartialEq)]
pub struct FindPlanesOptions {
    /// Standard deviations within which a measurement belongs to a plane.
    pub threshold: f64,
    /// Standard deviation of real surfaces from planes, metres; added to that of the measurements.
    pub flatness: f64,
    /// Least share of the measurements that make a plane, 0 to 1.
    pub min_share: f64,
    /// Least number of measurements that make a plane.
    pub min_points: usize,
    pub max_planes: usize,
    /// Distances from the station, metres: what is nearer (its own parts) or farther is left out.
    pub range: [f64; 2],
    pub seed: u64,
}

impl Default for FindPlanesOptions {
    fn default() -> Self {
        Self {
            threshold: 3.0,
            flatness: 0.005,
            min_share: 0.003,
            min_points: 25,
            max_planes: 64,
            range: [0.0, f64::INFINITY],
            seed: 1,
        }
    }
}

impl FindPlanesOptions {
    fn check(&self) -> Result<()> {
        if !(self.threshold > 0.0 && self.threshold.is_finite()) {
            return Err(Error::invalid("threshold", format!("{} is not positive", self.threshold)));
        }
        if !(self.flatness >= 0.0 && self.flatness.is_finite()) {
            return Err(Error::invalid("flatness", format!("{} m", self.flatness)));
        }
        if !(0.0..=1.0).contains(&self.min_share) {
            return Err(Error::invalid("min_share", format!("{} is no share", self.min_share)));
        }
        if self.min_points < 4 {
            return Err(Error::invalid("min_points", format!("{}, at least 4 are needed", self.min_points)));
        }
        if !(1..=MAX_PLANES).contains(&self.max_planes) {
            return Err(Error::invalid("max_planes", format!("{} is not in 1 to {MAX_PLANES}", self.max_planes)));
        }
        let [near, far] = self.range;
        if !(near >= 0.0 && near.is_finite() && far > near) {
            return Err(Error::invalid("range", format!("{near} to {far} m")));
        }
        Ok(())
    }
}

/// One plane of a station.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundPlane {
    /// n with its covariance; its flags are empty, for [`StationPlanes::labels`] tells the inliers.
    /// The covariance is larger than that of independent noise where the surface is not even.
    pub estimate: PlaneEstimate,
    pub support: PlaneSupport,
    /// Measurements that belong to it.
    pub count: usize,
    /// Root mean square distance of their positions from it, metres.
    pub rms: f64,
}

/// The planes that one station sees, in its frame.
#[derive(Debug, Clone, PartialEq)]
pub struct StationPlanes {
    /// As found, the largest first, or in the order of the regions.
    pub planes: Vec<FoundPlane>,
    /// The plane of each measurement.
    pub labels: Vec<Option<u16>>,
    /// Standard deviation of points, metres: as given, or as estimated. 0 for shots, which have each
    /// their own.
    pub sigma: f64,
    pub(super) view: View,
}

/// A part of the measurements that the user names.
#[derive(Debug, Clone, PartialEq)]
pub enum PlaneRegion {
    /// Which ones.
    Indices(Vec<usize>),
    /// Those between two corners, metres, in the station's frame.
    Box([Vector3<f64>; 2]),
}

/// Planes in points that a station at the origin measured. `sigma`: their standard deviation in every
/// direction, metres; `None`: estimated from neighbours. Points that are not finite are passed over. Where the
/// noise is along the rays only, [`shots_of_ranges`] says so, and a slanted wall is known better for it.
///
/// # Errors
/// `TooFewPoints` without as many usable points as make a plane; `NotFound` where they show none;
/// `InvalidArgument` for bad options; `Degenerate` where their noise cannot be estimated.
pub fn find_planes_in_points(
    points: &[Vector3<f64>],
    sigma: Option<f64>,
    options: &FindPlanesOptions,
) -> Result<StationPlanes> {
    options.check()?;
    check_sigma(sigma)?;
    let usable = within(points.iter().map(|p| p.iter().all(|v| v.is_finite()).then_some(*p)), options)?;
    let points = if usable.chosen.len() == points.len() {
        Cow::Borrowed(points)
    } else {
        Cow::Owned(usable.chosen.iter().map(|i| points[*i as usize]).collect())
    };
    let mut cloud = Cloud { points, sigma: 0.0 };
    let sought = thinned(&cloud, options.seed);
    let sigma = match sigma {
        Some(s) => s,
        None => local_noise(&sought.points).ok_or_else(|| {
            Error::degenerate(crate::error::Degeneracy::Collinear, "the points' noise cannot be estimated: give sigma")
        })?,
    };
    cloud.sigma = sigma.hypot(options.flatness);
    let planes = found(&cloud, Cloud { sigma: cloud.sigma, ..sought }, &usable, options)?;
    Ok(StationPlanes { sigma, ..planes })
}

/// Planes in laser shots. Those at infinity, and those that are not finite, are passed over.
///
/// # Errors
/// As [`find_planes_in_points`].
pub fn find_planes_in_shots(shots: &[InverseDepthPoint], options: &FindPlanesOptions) -> Result<StationPlanes> {
    options.check()?;
    let usable = within(shots.iter().map(usable_point), options)?;
    let all = Shots::new(usable.chosen.iter().map(|i| uneven(&shots[*i as usize], options)).collect());
    let sought = thinned(&all, options.seed);
    found(&all, sought, &usable, options)
}

/// One plane for each region of the points, in their order, whatever else the regions hold up to half.
/// A point of two regions is labelled with the first.
///
/// # Errors
/// `InvalidArgument` for an index that is none; `Region` with what a region lacks, as
/// [`fit_plane_to_points`] tells.
pub fn fit_regions_of_points(
    points: &[Vector3<f64>],
    sigma: Option<f64>,
    regions: &[PlaneRegion],
    options: &FindPlanesOptions,
) -> Result<StationPlanes> {
    options.check()?;
    check_sigma(sigma)?;
    let usable = within(points.iter().map(|p| p.iter().all(|v| v.is_finite()).then_some(*p)), options)?;
    let noise = sigma.map(|s| s.hypot(options.flatness));
    let fit_options = fit_options(options);
    let fit = |used: &[u32]| {
        let points: Vec<Vector3<f64>> = used.iter().map(|i| points[*i as usize]).collect();
        let estimate = fit_plane_to_points(&points, noise, &fit_options)?;
        let inside: Vec<u32> = flagged(&estimate.inliers);
        let off = |i: &u32| (estimate.n.dot(&points[*i as usize]) - 1.0).powi(2) / estimate.n.norm_squared();
        let rms = (inside.iter().map(off).sum::<f64>() / inside.len().saturating_sub(3).max(1) as f64).sqrt();
        let cloud = Cloud { sigma: noise.unwrap_or(rms.max(f64::MIN_POSITIVE)), points: points.into() };
        Ok((estimate, describe(&cloud, &inside)))
    };
    let position = |i: u32| Some(points[i as usize]);
    let planes = fitted(regions, &usable, position, sigma.is_some(), fit)?;
    Ok(StationPlanes { sigma: sigma.unwrap_or(0.0), ..planes })
}

/// The same for shots.
///
/// # Errors
/// As [`fit_regions_of_points`] and [`fit_plane_to_shots`].
pub fn fit_regions_of_shots(
    shots: &[InverseDepthPoint],
    regions: &[PlaneRegion],
    options: &FindPlanesOptions,
) -> Result<StationPlanes> {
    options.check()?;
    let usable = within(shots.iter().map(usable_point), options)?;
    let fit_options = fit_options(options);
    let fit = |used: &[u32]| {
        let shots: Vec<_> = used.iter().map(|i| uneven(&shots[*i as usize], options)).collect();
        let estimate = fit_plane_to_shots(&shots, &fit_options)?;
        let inside = flagged(&estimate.inliers);
        Ok((estimate, describe(&Shots::new(shots), &inside)))
    };
    fitted(regions, &usable, |i| shots[i as usize].point(), true, fit)
}

fn fit_options(options: &FindPlanesOptions) -> PlaneFitOptions {
    PlaneFitOptions { robust: true, outlier_threshold: options.threshold.max(3.0), seed: options.seed }
}

fn flagged(flags: &[bool]) -> Vec<u32> {
    flags.iter().enumerate().filter(|(_, f)| **f).map(|(i, _)| i as u32).collect()
}

/// Fits a plane to each region; `stated`: the measurements' noise is known.
fn fitted(
    regions: &[PlaneRegion],
    usable: &Usable,
    position: impl Fn(u32) -> Option<Vector3<f64>>,
    stated: bool,
    fit: impl Fn(&[u32]) -> Result<(PlaneEstimate, Option<FoundPlane>)>,
) -> Result<StationPlanes> {
    if regions.is_empty() || regions.len() > MAX_PLANES {
        return Err(Error::invalid("regions", format!("{} are not 1 to {MAX_PLANES}", regions.len())));
    }
    let mut labels = vec![None; usable.total];
    let mut planes = Vec::new();
    for (k, region) in regions.iter().enumerate() {
        let used = usable.of(region, &position).map_err(|e| Error::in_region(k, e))?;
        let (estimate, found) = fit(&used).map_err(|e| Error::in_region(k, e))?;
        // What `fit` accepts can be described.
        let unclear = || Error::in_region(k, Error::NoPlanes { measurements: used.len() });
        let plane = found.ok_or_else(unclear)?;
        // Half of anything agrees on some plane, if it may be thick enough. Stated noise may be large.
        let side = plane.support.sides().into_iter().fold(f64::INFINITY, f64::min);
        let explained = stated && plane.estimate.noise_factor().is_none_or(|f| f < MAX_NOISE_FACTOR);
        if plane.rms > MAX_THICKNESS * side && !explained {
            return Err(Error::in_region(k, Error::NoConsensus { inliers: 0, total: used.len() }));
        }
        planes.push(plane);
        for i in flagged(&estimate.inliers) {
            labels[used[i as usize] as usize].get_or_insert(k as u16);
        }
    }
    let view = seen(&planes, &labels, usable.chosen.iter().map(|i| (*i, position(*i))));
    Ok(StationPlanes { planes, labels, sigma: 0.0, view })
}

/// The view of measurements with their labels.
fn seen(
    planes: &[FoundPlane],
    labels: &[Option<u16>],
    places: impl Iterator<Item = (u32, Option<Vector3<f64>>)> + Clone,
) -> View {
    let normals: Vec<Vector3<f64>> = planes.iter().map(|p| p.estimate.n.normalize()).collect();
    let every = labels.len() / VIEWED;
    // One of each so many, any: every so manieth of a scan line would leave gaps.
    let shown = |i: u32| every < 2 || i as usize % every == (i as usize / every).wrapping_mul(40_503) % every;
    let places = places.filter(|(i, _)| shown(*i));
    View::of(places.filter_map(|(i, place)| Some((place?, labels[i as usize].map(|k| normals[k as usize])))))
}

/// Where a shot is, if it can be used.
fn usable_point(shot: &InverseDepthPoint) -> Option<Vector3<f64>> {
    (shot.variance > 0.0 && shot.variance.is_finite()).then(|| shot.point()).flatten()
}

/// A shot with the variance of an uneven surface besides its own.
fn uneven(shot: &InverseDepthPoint, options: &FindPlanesOptions) -> InverseDepthPoint {
    let unevenness = options.flatness * shot.rho.powi(2) * shot.direction.norm();
    InverseDepthPoint { variance: shot.variance + unevenness.powi(2), ..*shot }
}

fn check_sigma(sigma: Option<f64>) -> Result<()> {
    match sigma {
        Some(s) if !(s > 0.0 && s.is_finite()) => {
            Err(Error::invalid("sigma", format!("{s} is not a positive standard deviation")))
        }
        _ => Ok(()),
    }
}

/// The measurements that are finite and within range.
struct Usable {
    /// Of all measurements.
    total: usize,
    chosen: Vec<u32>,
}

impl Usable {
    /// The usable measurements of a region, each once.
    fn of(&self, region: &PlaneRegion, position: impl Fn(u32) -> Option<Vector3<f64>>) -> Result<Vec<u32>> {
        match region {
            PlaneRegion::Indices(indices) => {
                if let Some(i) = indices.iter().find(|i| **i >= self.total) {
                    return Err(Error::invalid("regions", format!("there is no measurement {i}")));
                }
                let mut used: Vec<u32> = indices.iter().map(|i| *i as u32).collect();
                used.sort_unstable();
                used.dedup();
                used.retain(|i| self.chosen.binary_search(i).is_ok());
                Ok(used)
            }
            PlaneRegion::Box([low, high]) => {
                if low.iter().zip(high.iter()).any(|(l, h)| !(l.is_finite() && h.is_finite() && l < h)) {
                    return Err(Error::invalid("regions", "a box without inside"));
                }
                let inside = |i: &&u32| position(**i).is_some_and(|p| p.inf(low) == *low && p.sup(high) == *high);
                Ok(self.chosen.iter().filter(inside).copied().collect())
            }
        }
    }
}

fn within(
    positions: impl ExactSizeIterator<Item = Option<Vector3<f64>>>,
    options: &FindPlanesOptions,
) -> Result<Usable> {
    let total = positions.len();
    if u32::try_from(total).is_err() {
        return Err(Error::invalid("points", format!("{total} are too many")));
    }
    let [near, far] = options.range;
    let inside = |p: &Vector3<f64>| (near..=far).contains(&p.norm());
    let chosen: Vec<u32> =
        positions.enumerate().filter(|(_, p)| p.as_ref().is_some_and(inside)).map(|(i, _)| i as u32).collect();
    if chosen.len() < options.min_points {
        return Err(Error::TooFewPoints { given: chosen.len(), needed: options.min_points });
    }
    Ok(Usable { total, chosen })
}

/// As many measurements as are sought in, in Morton order.
fn thinned<M: Measured>(m: &M, seed: u64) -> M {
    let mut chosen: Vec<u32> = (0..m.count() as u32).collect();
    if m.count() > SOUGHT {
        search::shuffle(&mut chosen, SOUGHT, &mut ChaCha8Rng::seed_from_u64(seed));
        chosen.truncate(SOUGHT);
    }
    let positions: Vec<_> = chosen.iter().map(|i| m.position(*i as usize)).collect();
    let order = order::morton(&positions);
    m.subset(&order.into_iter().map(|i| chosen[i as usize]).collect::<Vec<_>>())
}

/// The noise of points in Morton order, from planes through patches of neighbours. Most patches of a
/// scene are flat, and the others are rougher: the lower third of them tells.
fn local_noise(points: &[Vector3<f64>]) -> Option<f64> {
    let rms = |patch: &[Vector3<f64>]| {
        let centre = patch.iter().sum::<Vector3<f64>>() / PATCH as f64;
        let spread: Matrix3<f64> = patch.iter().map(|p| (p - centre) * (p - centre).transpose()).sum();
        let (values, _) = symmetric_eigen3(&spread)?;
        // Points of one scan line have no plane.
        (values[1] > 0.01 * values[0]).then(|| (values[2].max(0.0) / (PATCH - 3) as f64).sqrt())
    };
    let mut found: Vec<f64> = points.chunks_exact(PATCH).filter_map(rms).collect();
    if found.is_empty() {
        return None;
    }
    let third = found.len() / 3;
    let noise = *found.select_nth_unstable_by(third, f64::total_cmp).1;
    let size = points.iter().fold(0.0f64, |m, p| m.max(p.amax()));
    Some(noise.max(1e-9 * size)).filter(|s| *s > 0.0)
}

/// Searches, then fits what was found to all measurements.
fn found<M: Measured>(all: &M, sought: M, usable: &Usable, options: &FindPlanesOptions) -> Result<StationPlanes> {
    let least = |count: usize| ((options.min_share * count as f64).ceil() as usize).max(options.min_points);
    // Of those sought in, a plane's share scatters.
    let thin = sought.count() as f64 / all.count() as f64;
    let limits = Limits {
        threshold: options.threshold,
        min_points: ((0.7 * thin * least(all.count()) as f64) as usize).max(options.min_points.min(12)),
        max_planes: options.max_planes,
    };
    let mut normals = search(&sought, &limits, &mut ChaCha8Rng::seed_from_u64(options.seed));
    let mut labels = Vec::new();
    for _ in 0..2 {
        labels = label(all, &normals, options.threshold);
        let members = members(&labels, normals.len());
        for (n, used) in normals.iter_mut().zip(&members) {
            if let Some(better) = all.quick_fit(used).filter(|_| used.len() >= 3) {
                *n = better;
            }
        }
    }
    let members = members(&labels, normals.len());
    let mut numbers = vec![None; normals.len()];
    let mut planes = Vec::new();
    for (k, used) in members.iter().enumerate() {
        if !contrast(all, &normals[k], &labels, k, options.threshold).is_surface(least(all.count())) {
            continue;
        }
        let Some(plane) = describe(all, used) else { continue };
        numbers[k] = Some(planes.len() as u16);
        planes.push(plane);
    }
    if planes.is_empty() {
        return Err(Error::NoPlanes { measurements: all.count() });
    }
    let mut whole = vec![None; usable.total];
    for (i, label) in usable.chosen.iter().zip(&labels) {
        whole[*i as usize] = label.and_then(|k| numbers[k as usize]);
    }
    let view = seen(&planes, &whole, usable.chosen.iter().enumerate().map(|(k, i)| (*i, all.position(k))));
    Ok(StationPlanes { planes, labels: whole, sigma: 0.0, view })
}

/// The first plane that each measurement agrees with: larger ones come first.
fn label<M: Measured>(m: &M, normals: &[Vector3<f64>], threshold: f64) -> Vec<Option<u16>> {
    let residuals: Vec<_> = normals.iter().map(|n| m.residuals(n)).collect();
    let first = |i: usize| residuals.iter().position(|r| r(i).abs() <= threshold).map(|k| k as u16);
    (0..m.count()).map(first).collect()
}

fn members(labels: &[Option<u16>], planes: usize) -> Vec<Vec<u32>> {
    let mut counts = vec![0; planes];
    labels.iter().flatten().for_each(|k| counts[*k as usize] += 1);
    let mut members: Vec<Vec<u32>> = counts.into_iter().map(Vec::with_capacity).collect();
    for (i, label) in labels.iter().enumerate() {
        if let Some(k) = label {
            members[*k as usize].push(i as u32);
        }
    }
    members
}

/// Measurements of no larger plane in and around a plane.
fn contrast<M: Measured>(m: &M, n: &Vector3<f64>, labels: &[Option<u16>], plane: usize, threshold: f64) -> Contrast {
    let (mut contrast, residual) = (Contrast::default(), m.residuals(n));
    for (i, label) in labels.iter().enumerate() {
        if label.is_none_or(|k| k as usize >= plane) {
            contrast.add(residual(i), threshold);
        }
    }
    contrast
}

/// The plane of some measurements; `None` where they fix none (all but on one line, or the plane
/// passes the station so close that its n is unsure).
fn describe<M: Measured>(m: &M, used: &[u32]) -> Option<FoundPlane> {
    let fit = m.fit(used).ok()?;
    let n = fit.n;
    let places: Vec<Vector3<f64>> = used.iter().filter_map(|i| m.position(*i as usize)).collect();
    if places.is_empty() {
        return None;
    }
    let (normal, distance) = (n.normalize(), 1.0 / n.norm());
    let support = PlaneSupport::of(&places, &normal, distance);
    let off = places.iter().map(|p| (normal.dot(p) - distance).powi(2)).sum::<f64>();
    let residual = m.residuals(&n);
    let residuals = used.iter().filter_map(|i| Some((m.position(*i as usize)?, residual(*i as usize))));
    let covariance = fit.covariance * support.unevenness(residuals);
    let degrees_of_freedom = used.len().saturating_sub(3);
    let estimate = PlaneEstimate { n, covariance, chi_square: fit.chi_square, degrees_of_freedom, inliers: Vec::new() };
    Some(FoundPlane { estimate, support, count: used.len(), rms: (off / places.len() as f64).sqrt() })
}
