//! The planes of a scene, found in the points, shots or depths of one station, or fitted to regions
//! that the user names.

mod assign;
mod describe;
mod kernels;
mod measured;
mod order;
mod patch;
mod rays;
mod rows;
mod search;
mod support;
pub(super) mod view;

use std::borrow::Cow;

use nalgebra::{Matrix3, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_core::SeedableRng;

use self::assign::{NONE, assign, sums_of};
use self::describe::describe;
use self::kernels::{Tally, is_usable, usable};
use self::measured::{Cloud, Measured, Shots};
pub use self::rays::{shots_of_depth_map, shots_of_ranges};
use self::rows::Rows;
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
/// Measurements that the planes found are fitted to before all are.
const FITTED: usize = 4 * SOUGHT;
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
    let usable = usable_points(points, options)?;
    let points = match &usable.chosen {
        None => Cow::Borrowed(points),
        Some(chosen) => Cow::Owned(chosen.iter().map(|i| points[*i as usize]).collect()),
    };
    let cloud = Cloud::new(points, 0.0);
    let sought = thinned(&cloud, options.seed);
    let sigma = match sigma {
        Some(s) => s,
        None => local_noise(&sought, &cloud.kind().middle()).ok_or_else(|| {
            Error::degenerate(crate::error::Degeneracy::Collinear, "the points' noise cannot be estimated: give sigma")
        })?,
    };
    let planes = found(&cloud.with_sigma(sigma.hypot(options.flatness)), sought, &usable, options)?;
    Ok(StationPlanes { sigma, ..planes })
}

/// Planes in laser shots. Those at infinity, and those that are not finite, are passed over.
///
/// # Errors
/// As [`find_planes_in_points`].
pub fn find_planes_in_shots(shots: &[InverseDepthPoint], options: &FindPlanesOptions) -> Result<StationPlanes> {
    options.check()?;
    let usable = usable_shots(shots, options)?;
    let all = Shots::new(usable.iter().map(|i| uneven(&shots[i as usize], options)).collect());
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
    let usable = usable_points(points, options)?;
    let noise = sigma.map(|s| s.hypot(options.flatness));
    let fit_options = fit_options(options);
    let fit = |used: &[u32]| {
        let points: Vec<Vector3<f64>> = used.iter().map(|i| points[*i as usize]).collect();
        let estimate = fit_plane_to_points(&points, noise, &fit_options)?;
        let inside: Vec<u32> = flagged(&estimate.inliers);
        let off = |i: &u32| (estimate.n.dot(&points[*i as usize]) - 1.0).powi(2) / estimate.n.norm_squared();
        let rms = (inside.iter().map(off).sum::<f64>() / inside.len().saturating_sub(3).max(1) as f64).sqrt();
        let cloud = Cloud::new(points.into(), noise.unwrap_or(rms.max(f64::MIN_POSITIVE)));
        Ok((estimate, described(&cloud.subset(&inside))))
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
    let usable = usable_shots(shots, options)?;
    let fit_options = fit_options(options);
    let fit = |used: &[u32]| {
        let shots: Vec<_> = used.iter().map(|i| uneven(&shots[*i as usize], options)).collect();
        let estimate = fit_plane_to_shots(&shots, &fit_options)?;
        let inside = flagged(&estimate.inliers);
        Ok((estimate, described(&Shots::new(shots).subset(&inside))))
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
    let view = seen(&planes, &labels, usable, |_, i| position(i).unwrap_or_else(|| Vector3::repeat(f64::NAN)));
    Ok(StationPlanes { planes, labels, sigma: 0.0, view })
}

/// Any one of a group of `every` measurements: every so manieth of a scan line would be columns of it, with gaps.
fn any_of(group: usize, every: usize) -> usize {
    every * group + group.wrapping_mul(40_503) % every
}

/// The view of measurements with their labels. `place`: of a usable one, by its number among those, and of all.
fn seen(
    planes: &[FoundPlane],
    labels: &[Option<u16>],
    usable: &Usable,
    place: impl Fn(usize, u32) -> Vector3<f64>,
) -> View {
    let normals: Vec<Vector3<f64>> = planes.iter().map(|p| p.estimate.n.normalize()).collect();
    let count = usable.count();
    let every = (count / VIEWED).max(1);
    let shown = |group: usize| any_of(group, every);
    let normal = |k: usize| labels[usable.at(k) as usize].map(|k| normals[k as usize]);
    let place = |k: usize| place(k, usable.at(k));
    View::of(count / every, |group| place(shown(group)), |group| normal(shown(group)))
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
    /// In rising order; `None`: all.
    chosen: Option<Vec<u32>>,
}

impl Usable {
    fn count(&self) -> usize {
        self.chosen.as_ref().map_or(self.total, Vec::len)
    }

    /// The k-th of them.
    fn at(&self, k: usize) -> u32 {
        self.chosen.as_ref().map_or(k as u32, |chosen| chosen[k])
    }

    fn iter(&self) -> impl Iterator<Item = u32> {
        (0..self.count()).map(|k| self.at(k))
    }

    fn contains(&self, i: u32) -> bool {
        self.chosen.as_ref().is_none_or(|chosen| chosen.binary_search(&i).is_ok())
    }

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
                used.retain(|i| self.contains(*i));
                Ok(used)
            }
            PlaneRegion::Box([low, high]) => {
                if low.iter().zip(high.iter()).any(|(l, h)| !(l.is_finite() && h.is_finite() && l < h)) {
                    return Err(Error::invalid("regions", "a box without inside"));
                }
                let inside = |i: &u32| position(*i).is_some_and(|p| p.inf(low) == *low && p.sup(high) == *high);
                Ok(self.iter().filter(inside).collect())
            }
        }
    }
}

fn usable_points(points: &[Vector3<f64>], options: &FindPlanesOptions) -> Result<Usable> {
    within(points.len(), usable(points, &options.range), |i| is_usable(&points[i], &options.range), options)
}

fn usable_shots(shots: &[InverseDepthPoint], options: &FindPlanesOptions) -> Result<Usable> {
    let is_usable = |i: usize| usable_point(&shots[i]).is_some_and(|p| is_usable(&p, &options.range));
    within(shots.len(), (0..shots.len()).filter(|i| is_usable(*i)).count(), is_usable, options)
}

/// `count`: how many are usable.
fn within(
    total: usize,
    count: usize,
    is_usable: impl Fn(usize) -> bool,
    options: &FindPlanesOptions,
) -> Result<Usable> {
    if u32::try_from(total).is_err() {
        return Err(Error::invalid("points", format!("{total} are too many")));
    }
    if count < options.min_points {
        return Err(Error::TooFewPoints { given: count, needed: options.min_points });
    }
    let some = || (0..total).filter(|i| is_usable(*i)).map(|i| i as u32).collect();
    Ok(Usable { total, chosen: (count < total).then(some) })
}

/// As many measurements as are sought in, in Morton order.
fn thinned<M: Measured>(m: &M, seed: u64) -> Rows {
    let chosen: Vec<u32> = if m.count() > SOUGHT {
        search::some_of(m.count(), SOUGHT, &mut ChaCha8Rng::seed_from_u64(seed))
    } else {
        (0..m.count() as u32).collect()
    };
    let places: Vec<Vector3<f64>> = chosen.iter().map(|i| m.position(*i as usize)).collect();
    let order: Vec<u32> = order::morton(&places).into_iter().map(|i| chosen[i as usize]).collect();
    m.gather(&order)
}

/// The noise of points in Morton order, from planes through patches of neighbours. Most patches of a
/// scene are flat, and the others are rougher: the lower third of them tells.
fn local_noise(rows: &Rows, middle: &Vector3<f64>) -> Option<f64> {
    let points: Vec<Vector3<f64>> = (0..rows.count()).map(|i| rows.place(i)).collect();
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
    let size = points.iter().fold(0.0f64, |m, p| m.max((p + middle).amax()));
    Some(noise.max(1e-9 * size)).filter(|s| *s > 0.0)
}

/// Searches, then fits what was found to all measurements.
fn found<M: Measured>(all: &M, sought: Rows, usable: &Usable, options: &FindPlanesOptions) -> Result<StationPlanes> {
    let least = |count: usize| ((options.min_share * count as f64).ceil() as usize).max(options.min_points);
    // Of those sought in, a plane's share scatters.
    let thin = sought.count() as f64 / all.count() as f64;
    let limits = Limits {
        threshold: options.threshold,
        min_points: ((0.7 * thin * least(all.count()) as f64) as usize).max(options.min_points.min(12)),
        max_planes: options.max_planes,
    };
    let kind = all.kind();
    let mut normals = search(sought, &kind, &limits, &mut ChaCha8Rng::seed_from_u64(options.seed));
    let tallies = assign(all, &normals, options.threshold, (all.count() / FITTED).max(1), None);
    for (n, tally) in normals.iter_mut().zip(&tallies).filter(|(_, tally)| tally.inside.count >= 3) {
        *n = kind.solve(&tally.inside).unwrap_or(*n);
    }
    let mut labels = vec![NONE; all.count()];
    let tallies = assign(all, &normals, options.threshold, 1, Some(&mut labels));
    let fit = |(k, tally): (usize, &Tally)| {
        let used = || (0..all.count() as u32).filter(|i| labels[*i as usize] == k as u16).collect();
        let is_surface = Contrast::from(tally).is_surface(least(all.count()));
        if is_surface { all.fit(&tally.inside, used).ok() } else { None }
    };
    let fits = tallies.iter().enumerate().map(fit).collect();
    let mut numbers = vec![None; normals.len()];
    let mut planes = Vec::new();
    let counts: Vec<usize> = tallies.iter().map(|tally| tally.inside.count).collect();
    for (k, plane) in describe(all, &labels, &counts, fits).into_iter().enumerate() {
        let Some(plane) = plane else { continue };
        numbers[k] = Some(planes.len() as u16);
        planes.push(plane);
    }
    if planes.is_empty() {
        return Err(Error::NoPlanes { measurements: all.count() });
    }
    numbers.push(None);
    let number = |label: &u16| numbers[(*label as usize).min(numbers.len() - 1)];
    let labels = match &usable.chosen {
        None => labels.iter().map(number).collect(),
        Some(chosen) => {
            let mut whole = vec![None; usable.total];
            chosen.iter().zip(&labels).for_each(|(i, label)| whole[*i as usize] = number(label));
            whole
        }
    };
    let view = seen(&planes, &labels, usable, |k, _| all.position(k));
    Ok(StationPlanes { planes, labels, sigma: 0.0, view })
}

/// The plane of all measurements; `None` where they fix none (all but on one line, or the plane
/// passes the station so close that its n is unsure).
fn described<M: Measured>(m: &M) -> Option<FoundPlane> {
    let fit = m.fit(&sums_of(m), || (0..m.count() as u32).collect()).ok();
    describe(m, &vec![0; m.count()], &[m.count()], vec![fit]).pop()?
}
