//! The cold start: every camera from its own shots by the closed form, stations through the cameras and
//! the planes that they share. What is said of a station's pose without certainty (odometry) comes last:
//! centimetres and degrees between two stations tear a camera apart that both lit.

use std::collections::BTreeMap;

use super::layout::{State, options as camera_options};
use super::problem::{AdjustOptions, Adjustment, CameraSetup, Sighting, Station};
use crate::calibrate::{CalibrationOptions, Correspondences, Observation, calibrate_camera};
use crate::error::{Error, Result};
use crate::geometry::{Camera, InverseDepthPoint, Plane, RigModel, Rigid};
use crate::pose::plane_registration::{MatchedPlane, maximum_likelihood, plane_to_plane};
use crate::pose::{PlaneEstimate, PlaneFitOptions, fit_plane_to_shots};

/// Shots that a station and a camera must share before one places the other.
const MIN_SHARED: usize = 6;

/// Shots of a camera that its start is taken from, spread over all of them: more would only sharpen what
/// the adjustment does better.
const ENOUGH: usize = 400;

/// Standard deviation (radians, metres) up to which what is said of a station's pose is as good as what its
/// shots say: a few pixels in a camera.
const CERTAIN: f64 = 3e-3;

/// Of the normals of planes that place a station: they leave a common plane by two degrees at least.
const MAX_CONDITION: f64 = 1e3;

/// Depths by the head camera where it saw the spot; `None` elsewhere.
struct Depths(Vec<Option<InverseDepthPoint>>);

impl Depths {
    fn of(input: &Adjustment) -> Self {
        let depth = |rig: &RigModel, shot: &super::Shot| {
            let (pixel, covariance) = shot.head.as_ref()?;
            rig.measure(shot.pan, shot.tilt, pixel, covariance).ok().map(|m| m.point)
        };
        Self(input.shots().iter().map(|s| depth(input.rig(), s)).collect())
    }

    /// The camera's shots from the stations for which `pose` has one, in its frame.
    fn set(&self, input: &Adjustment, camera: usize, pose: impl Fn(usize) -> Option<Rigid>) -> Result<Correspondences> {
        let setup = &input.cameras()[camera];
        let mut set = Correspondences::new(setup.width, setup.height)?;
        let of_camera = |(shot, depth): (&super::Shot, &Option<InverseDepthPoint>)| {
            let seen = *shot.sightings.iter().find(|s| s.camera == camera)?;
            Some((seen, pose(shot.station)?, (*depth)?))
        };
        let all: Vec<(Sighting, Rigid, InverseDepthPoint)> =
            input.shots().iter().zip(&self.0).filter_map(of_camera).collect();
        let taken = all.len().min(ENOUGH);
        for i in 0..taken {
            let (seen, pose, p) = &all[i * all.len() / taken];
            let shot =
                InverseDepthPoint { origin: pose.apply(&p.origin), direction: pose.rotation * p.direction, ..*p };
            set.add(Observation::Shot { shot, pixel: seen.pixel, pixel_covariance: seen.covariance })?;
        }
        Ok(set)
    }
}

/// Every plane as each station measured it, in the station's frame.
struct SeenPlanes(Vec<BTreeMap<usize, PlaneEstimate>>);

impl SeenPlanes {
    fn of(input: &Adjustment, depths: &Depths, options: &AdjustOptions) -> Self {
        let mut shots: BTreeMap<(usize, usize), Vec<InverseDepthPoint>> = BTreeMap::new();
        for (index, (shot, depth)) in input.shots().iter().zip(&depths.0).enumerate() {
            if let (Some(plane), Some(depth)) = (input.plane_of(index), depth) {
                shots.entry((plane, shot.station)).or_default().push(*depth);
            }
        }
        let fit = PlaneFitOptions { robust: options.robust, seed: options.seed, ..PlaneFitOptions::default() };
        let mut seen = vec![BTreeMap::new(); input.planes().len()];
        for ((plane, station), shots) in shots {
            // A station that hit one only in a few places, or on a line, has nothing to start from.
            if let Ok(estimate) = fit_plane_to_shots(&shots, &fit) {
                seen[plane].insert(station, estimate);
            }
        }
        Self(seen)
    }

    /// The station's pose by the planes that it shares with one that is placed, the one with the most.
    fn place_station(&self, station: usize, stations: &[Option<Rigid>]) -> Option<Rigid> {
        let shared = |other: usize| -> Vec<MatchedPlane> {
            let both = self.0.iter().filter_map(|seen| Some((seen.get(&other)?, seen.get(&station)?)));
            both.map(|(a, b)| MatchedPlane { a: a.n, b: b.n, covariance_a: a.covariance, covariance_b: b.covariance })
                .collect()
        };
        let placed = stations.iter().enumerate().filter_map(|(other, pose)| Some((shared(other), (*pose)?)));
        let mut placed: Vec<_> = placed.filter(|(shared, _)| shared.len() >= 3).collect();
        placed.sort_by_key(|(shared, _)| std::cmp::Reverse(shared.len()));
        placed.iter().find_map(|(shared, pose)| {
            let (relative, _) = plane_to_plane(shared).ok().filter(|(_, c)| *c < MAX_CONDITION)?;
            // With their whole covariances, planes that are hit in a small patch do less harm.
            let better = maximum_likelihood(shared, relative).map_or(relative, |fit| fit.b_to_a);
            Some(pose.after(&better))
        })
    }

    fn in_world(&self, stations: &[Rigid]) -> Result<Vec<Plane>> {
        let plane = |(index, seen): (usize, &BTreeMap<usize, PlaneEstimate>)| {
            // The station that knows it best.
            let unsure = |e: &PlaneEstimate| e.covariance.trace() / e.n.norm_squared();
            let best = seen.iter().min_by(|(_, a), (_, b)| unsure(a).total_cmp(&unsure(b)));
            let (station, estimate) = best.ok_or_else(|| Error::BadState {
                reason: format!(
                    "plane {index} was hit from no station by three shots with a depth, in three directions"
                ),
            })?;
            Ok(estimate.plane().transform(&stations[*station]))
        };
        self.0.iter().enumerate().map(plane).collect()
    }
}

/// First values of all unknowns.
///
/// # Errors
/// `Camera` with the reason why a camera cannot be started; `BadState` for a station that shares no
/// camera with the others.
pub(super) fn start(input: &Adjustment, options: &AdjustOptions) -> Result<State> {
    let depths = Depths::of(input);
    let mut stations: Vec<Option<Rigid>> = input.stations().iter().map(certain).collect();
    let mut cameras: Vec<Option<Camera>> = vec![None; input.cameras().len()];
    let planes = SeenPlanes::of(input, &depths, options);
    // Cameras that were started before all stations were placed.
    let mut early = vec![false; cameras.len()];
    loop {
        options.cancel.check()?;
        let mut failure = None;
        let mut progress = false;
        for (index, camera) in cameras.iter_mut().enumerate().filter(|(_, c)| c.is_none()) {
            match start_camera(input, index, &depths, &stations, options) {
                Ok(found) => {
                    *camera = Some(found);
                    early[index] = stations.contains(&None);
                    progress = true;
                }
                Err(Error::Cancelled) => return Err(Error::Cancelled),
                Err(e) => failure = failure.or_else(|| Some(Error::in_camera(index, e))),
            }
        }
        for index in 0..stations.len() {
            if stations[index].is_none() {
                stations[index] = match place_station(input, index, &depths, &cameras, options)? {
                    None => planes.place_station(index, &stations),
                    found => found,
                };
                progress |= stations[index].is_some();
            }
        }
        let known = |found: &[Option<Camera>]| found.iter().copied().collect::<Option<Vec<_>>>();
        let placed = || stations.iter().copied().collect::<Option<Vec<_>>>();
        if let (Some(mut cameras), Some(places)) = (known(&cameras), placed()) {
            // From all their shots, as far as these agree.
            for index in (0..cameras.len()).filter(|i| early[*i]) {
                match start_camera(input, index, &depths, &stations, options) {
                    Ok(better) => cameras[index] = better,
                    Err(Error::Cancelled) => return Err(Error::Cancelled),
                    Err(_) => {}
                }
            }
            let (locals, planes) = (first_locals(&depths), planes.in_world(&places)?);
            return Ok(State { rig: *input.rig(), stations: places, cameras, planes, locals });
        }
        if !progress {
            let told = |(index, s): (usize, &Station)| Some(index).filter(|i| stations[*i].is_none()).zip(s.pose);
            if let Some((index, pose)) = input.stations().iter().enumerate().find_map(told) {
                stations[index] = Some(pose);
                continue;
            }
            let lost = stations.iter().position(Option::is_none).unwrap_or(0);
            return Err(failure.unwrap_or_else(|| Error::BadState {
                reason: format!(
                    "station {lost} shares neither a camera that {MIN_SHARED} of its shots are seen by nor three \
                     planes across each other; give its pose"
                ),
            }));
        }
    }
}

/// The pose of a station that is known well enough to start from, or of which a part is fixed.
fn certain(station: &Station) -> Option<Rigid> {
    let covariance = station.prior.covariance();
    let fixed = (0..6).any(|i| covariance[(i, i)] == 0.0);
    let known = (0..6).all(|i| covariance[(i, i)] <= CERTAIN * CERTAIN);
    station.pose.filter(|_| fixed || known)
}

/// Inverse depths as measured; the median where the head camera saw nothing.
fn first_locals(depths: &Depths) -> Vec<[f64; 3]> {
    let mut known: Vec<f64> = depths.0.iter().flatten().map(|d| d.rho).collect();
    let middle = known.len() / 2;
    let median = if known.is_empty() { 0.3 } else { *known.select_nth_unstable_by(middle, f64::total_cmp).1 };
    depths.0.iter().map(|d| [d.map_or(median, |d| d.rho), 0.0, 0.0]).collect()
}

/// What a camera's prior says of it before any shot.
enum Known {
    All(Camera),
    Lens(Camera),
    Nothing,
}

fn known(setup: &CameraSetup) -> Known {
    let Some((camera, prior)) = &setup.prior else { return Known::Nothing };
    let c = prior.covariance();
    let (n, lens) = (prior.count(), prior.count() - 6);
    let says = |range: std::ops::Range<usize>| range.into_iter().any(|i| c[(i, i)].is_finite());
    if says(lens..n) {
        Known::All(*camera)
    } else if says(0..lens) {
        Known::Lens(*camera)
    } else {
        Known::Nothing
    }
}

fn start_camera(
    input: &Adjustment,
    index: usize,
    depths: &Depths,
    stations: &[Option<Rigid>],
    options: &AdjustOptions,
) -> Result<Camera> {
    let setup = &input.cameras()[index];
    let mut own = CalibrationOptions {
        robust: options.robust,
        seed: options.seed,
        cancel: options.cancel.clone(),
        // The gate comes at the end, with all that the others add.
        max_focal_deviation: f64::INFINITY,
        ..camera_options(setup)
    };
    match known(setup) {
        Known::All(camera) => return Ok(camera),
        Known::Lens(camera) => own.fixed_lens = Some((camera.intrinsics, camera.distortion)),
        Known::Nothing => {}
    }
    let set = depths.set(input, index, |station| stations[station])?;
    Ok(calibrate_camera(&set, &own)?.camera)
}

/// The station's pose through the camera with the most shots from it.
fn place_station(
    input: &Adjustment,
    station: usize,
    depths: &Depths,
    cameras: &[Option<Camera>],
    options: &AdjustOptions,
) -> Result<Option<Rigid>> {
    let own_frame = |s: usize| (s == station).then(Rigid::identity);
    let mut sets = Vec::new();
    for (index, camera) in cameras.iter().enumerate() {
        if let Some(camera) = camera {
            let set = depths.set(input, index, own_frame)?;
            if set.len() >= MIN_SHARED {
                sets.push((camera, set));
            }
        }
    }
    sets.sort_by_key(|(_, set)| std::cmp::Reverse(set.len()));
    for (camera, set) in sets {
        let own = CalibrationOptions {
            fixed_lens: Some((camera.intrinsics, camera.distortion)),
            robust: options.robust,
            seed: options.seed,
            cancel: options.cancel.clone(),
            ..CalibrationOptions::default()
        };
        match calibrate_camera(&set, &own) {
            Ok(seen) => {
                let (world, here) = (camera.pose.inverse(), seen.camera.pose);
                return Ok(Some(Rigid {
                    rotation: world.rotation * here.rotation,
                    translation: world.apply(&here.translation),
                }));
            }
            Err(Error::Cancelled) => return Err(Error::Cancelled),
            Err(_) => {}
        }
    }
    Ok(None)
}
