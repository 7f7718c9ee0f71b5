//! The cold start: every camera from its own shots by the closed form, stations through the cameras
//! that they share.

use super::layout::{State, options as camera_options};
use super::problem::{AdjustOptions, Adjustment, CameraSetup};
use crate::calibrate::{CalibrationOptions, Correspondences, Observation, calibrate_camera};
use crate::error::{Error, Result};
use crate::geometry::{Camera, InverseDepthPoint, RigModel, Rigid};

/// Shots that a station and a camera must share before one places the other.
const MIN_SHARED: usize = 6;

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
        for (shot, depth) in input.shots().iter().zip(&self.0) {
            let sighting = shot.sightings.iter().find(|s| s.camera == camera);
            if let (Some(seen), Some(pose), Some(p)) = (sighting, pose(shot.station), depth) {
                let shot =
                    InverseDepthPoint { origin: pose.apply(&p.origin), direction: pose.rotation * p.direction, ..*p };
                set.add(Observation::Shot { shot, pixel: seen.pixel, pixel_covariance: seen.covariance })?;
            }
        }
        Ok(set)
    }
}

/// First values of all unknowns.
///
/// # Errors
/// `Camera` with the reason why a camera cannot be started; `BadState` for a station that shares no
/// camera with the others.
pub(super) fn start(input: &Adjustment, options: &AdjustOptions) -> Result<State> {
    let depths = Depths::of(input);
    let mut stations: Vec<Option<Rigid>> = input.stations().iter().map(|s| s.pose).collect();
    let mut cameras: Vec<Option<Camera>> = vec![None; input.cameras().len()];
    loop {
        options.cancel.check()?;
        let mut failure = None;
        let mut progress = false;
        for (index, camera) in cameras.iter_mut().enumerate().filter(|(_, c)| c.is_none()) {
            match start_camera(input, index, &depths, &stations, options) {
                Ok(found) => {
                    *camera = Some(found);
                    progress = true;
                }
                Err(Error::Cancelled) => return Err(Error::Cancelled),
                Err(e) => failure = failure.or_else(|| Some(Error::in_camera(index, e))),
            }
        }
        for (index, station) in stations.iter_mut().enumerate().filter(|(_, s)| s.is_none()) {
            *station = place_station(input, index, &depths, &cameras, options)?;
            progress |= station.is_some();
        }
        let known = |found: &[Option<Camera>]| found.iter().copied().collect::<Option<Vec<_>>>();
        if let (Some(cameras), Some(stations)) = (known(&cameras), stations.iter().copied().collect::<Option<Vec<_>>>())
        {
            let locals = first_locals(&depths);
            return Ok(State { rig: *input.rig(), stations, cameras, locals });
        }
        if !progress {
            let lost = stations.iter().position(Option::is_none).unwrap_or(0);
            return Err(failure.unwrap_or_else(|| Error::BadState {
                reason: format!(
                    "station {lost} shares no camera that {MIN_SHARED} of its shots are seen by; give its pose"
                ),
            }));
        }
    }
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
