//! Stations along a path, tied by planes that nobody named, with the fixed cameras that they light.

#[path = "support/survey.rs"]
mod survey;
#[path = "support/thesis.rs"]
mod thesis;

use std::ops::ControlFlow;

use nalgebra::{DVector, Matrix2, Vector3};
use ptzcal::Error;
use ptzcal::adjust::{Adjustment, CameraSetup, Prior, Shot, Sighting, Station};
use ptzcal::error::Status;
use ptzcal::geometry::{Camera, Rigid, rigid};
use ptzcal::network::{TieOptions, tie_stations};
use ptzcal::pose::PosePrior;
use survey::{solve, squared, station_error};
use thesis::{Noise, far, grid, rig};

fn silent(_: usize, _: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// What a robot says of its pose: 4 cm and 2 degrees off.
fn odometry(truth: &Rigid, index: usize) -> Station {
    let side = if index.is_multiple_of(2) { 1.0 } else { -1.0 };
    let pose = Rigid {
        rotation: rigid::rotation_y(0.035 * side) * truth.rotation,
        translation: truth.translation + Vector3::new(0.03, -0.01, 0.025) * side,
    };
    Station { pose: Some(pose), prior: Prior::of_sigmas(&[0.03, 0.03, 0.03, 0.05, 0.05, 0.05]) }
}

/// All shots of the grid from every station, of which nothing is said but where they were fired.
fn whole_survey(stations: &[Rigid], cameras: &[Camera], sigma: f64, told: bool) -> Adjustment {
    let mut noise = Noise::new(3);
    let mut input = Adjustment::new(rig()).unwrap();
    for c in cameras {
        input.add_camera(CameraSetup::new(c.width, c.height)).unwrap();
    }
    let covariance = Matrix2::identity() * (sigma * sigma);
    for (index, pose) in stations.iter().enumerate() {
        input
            .add_station(match index {
                0 => Station { pose: Some(*pose), prior: Prior::fixed(6) },
                _ if told => odometry(pose, index),
                _ => Station::unknown(),
            })
            .unwrap();
        for (i, s) in grid(&rig(), pose, cameras).iter().enumerate() {
            // One shot in five hundred went wrong.
            let head = s.head + noise.pixel(if i % 500 == 7 { 20.0 } else { sigma });
            let sighting = |(camera, p): (usize, &Option<_>)| {
                p.map(|p: nalgebra::Vector2<f64>| Sighting { camera, pixel: p + noise.pixel(sigma), covariance })
            };
            let sightings: Vec<Sighting> = s.fixed.iter().enumerate().filter_map(sighting).collect();
            // The camera is lit from the last station alone.
            let sightings = if index + 1 == stations.len() { sightings } else { Vec::new() };
            let head = Some((head, covariance));
            input.add_shot(Shot { station: index, pan: s.pan, tilt: s.tilt, head, sightings }).unwrap();
        }
    }
    input
}

/// Short steps, all turned to the corner of the left and the far wall.
fn walk() -> [Rigid; 3] {
    let at = |x: f64, y: f64, z: f64, turn: f64| Rigid {
        rotation: rigid::rotation_y(turn),
        translation: Vector3::new(x, y, z),
    };
    [at(0.0, 0.0, 0.0, -0.45), at(0.35, 0.05, 0.15, -0.55), at(0.55, 0.0, -0.1, -0.5)]
}

/// A camera above the path that looks to the same corner.
fn above() -> Camera {
    let pose = Rigid::look_at(&Vector3::new(0.5, -0.7, -0.3), &Vector3::new(-0.9, 0.2, 3.5)).unwrap();
    Camera { pose, ..far() }
}

/// Nobody says which shots hit which plane; odometry says roughly where the stations are.
#[test]
fn a_path_of_stations_is_tied_by_what_they_saw() {
    let stations = walk();
    let truth = above();
    let mut input = whole_survey(&stations, &[truth], 0.2, true);
    let ties = tie_stations(&mut input, &TieOptions::default(), silent).unwrap();
    for link in &ties.links {
        let pose = link.pose.as_ref().unwrap_or_else(|e| panic!("{:?}: {e}", link.stations));
        println!("{:?}: {} planes, agreement {:.2}", link.stations, pose.matches.len(), pose.agreement);
    }
    for l in &ties.loops {
        println!(
            "{:?}: {:.2} mrad, {:.1} mm left, chance {:.2}",
            l.stations,
            l.rotation * 1e3,
            l.position * 1e3,
            l.probability
        );
    }
    assert!(ties.planes >= 5 && ties.shots > input.shots().len() / 3);
    assert_eq!(ties.loops.len(), 1, "three links of three stations");
    let a = solve(&input);
    for (station, truth) in stations.iter().enumerate().skip(1) {
        let error = station_error(&a, station, truth);
        let distance = squared(&a, a.places()[1 + station].start, &error);
        println!(
            "station {station}: {:.2} mrad, {:.2} mm, chi-square {distance:.1} of 6",
            error.rows(0, 3).norm() * 1e3,
            error.rows(3, 3).norm() * 1e3
        );
        // One in a thousand.
        assert!(distance < 22.5, "{distance}");
        assert!(error.rows(0, 3).norm() < 5e-3 && error.rows(3, 3).norm() < 0.02);
    }
    let at = a.cameras[0].camera.centre() - truth.centre();
    println!("the camera at the end of the path: {:.1} mm", at.norm() * 1e3);
    let place = a.places()[1 + stations.len()].clone();
    assert!(squared(&a, place.end - 3, &DVector::from_column_slice(at.as_slice())) < 16.3);
}

/// How far surfaces stray from planes, metres.
const FLATNESS: f64 = 1e-3;

/// There and back again, all turned to the corner of the left and the far wall and tipped towards the floor.
fn round_walk() -> [Rigid; 4] {
    let at = |x: f64, y: f64, z: f64, turn: f64| Rigid {
        rotation: rigid::rotation_y(turn) * rigid::exp(&Vector3::new(-0.25, 0.0, 0.0)),
        translation: Vector3::new(x, y, z),
    };
    [at(0.0, 0.0, 0.0, -0.45), at(0.35, 0.05, 0.15, -0.55), at(0.6, 0.0, -0.15, -0.5), at(0.25, -0.05, -0.3, -0.4)]
}

/// All shots of the grid from every station, on rough surfaces; each camera sees those of two stations or more.
fn round_survey(stations: &[Rigid], cameras: &[Camera], sigma: f64, seed: u64) -> Adjustment {
    let mut noise = Noise::new(seed);
    let mut input = Adjustment::new(rig()).unwrap();
    for c in cameras {
        input.add_camera(CameraSetup::new(c.width, c.height)).unwrap();
    }
    let covariance = Matrix2::identity() * (sigma * sigma);
    for (index, pose) in stations.iter().enumerate() {
        let world = Station { pose: Some(*pose), prior: Prior::fixed(6) };
        input.add_station(if index == 0 { world } else { odometry(pose, index) }).unwrap();
        for s in &grid(&rig(), pose, cameras) {
            // Along the ray, so that the surface strays by FLATNESS along its normal.
            let (origin, direction) = rig().laser_in_world(s.pan, s.tilt);
            let (origin, direction) = (pose.apply(&origin), pose.rotation * direction);
            let slope = direction[thesis::axis_of(&s.point)].abs();
            let point = s.point + direction * (FLATNESS * noise.gaussian() / slope);
            let depth = (point - origin).norm() / direction.norm();
            let head = rig().spot_pixel(1.0 / depth).unwrap() + noise.pixel(sigma);
            let sightings = cameras.iter().enumerate().filter_map(|(camera, c)| {
                s.fixed[camera]?;
                Some(Sighting { camera, pixel: c.project(&point)? + noise.pixel(sigma), covariance })
            });
            // The first camera is lit from the ends of the path, the second from between them.
            let lit = |camera: usize| (camera == 0) == (index % 3 == 0);
            let sightings = sightings.filter(|s| lit(s.camera)).collect();
            let shot = Shot { station: index, pan: s.pan, tilt: s.tilt, head: Some((head, covariance)), sightings };
            input.add_shot(shot).unwrap();
        }
    }
    input
}

/// From finding the planes to the covariances of stations and cameras in the common frame, against their
/// truth in many runs.
#[test]
fn a_tied_loop_of_stations_has_honest_covariances() {
    const RUNS: usize = 12;
    let stations = round_walk();
    let beside = Rigid::look_at(&Vector3::new(-0.2, -0.8, 0.2), &Vector3::new(-0.6, 0.3, 3.5)).unwrap();
    let cameras = [above(), Camera { pose: beside, ..far() }];
    let mut sums = [0.0; 5];
    for run in 0..RUNS {
        let mut input = round_survey(&stations, &cameras, 0.2, run as u64);
        let mut options = TieOptions::default();
        options.planes.flatness = FLATNESS;
        let ties = tie_stations(&mut input, &options, silent).unwrap();
        assert_eq!(ties.links.len(), 6);
        let linked = ties.links.iter().filter(|link| link.pose.is_ok()).count();
        assert!(linked >= 4 && ties.loops.len() == linked - 3, "{:?}", ties.links);
        assert!(ties.loops.iter().all(|l| l.probability > 1e-4), "{:?}", ties.loops);
        let a = solve(&input);
        let places = a.places();
        for station in 1..stations.len() {
            let error = station_error(&a, station, &stations[station]);
            sums[station - 1] += squared(&a, places[1 + station].start, &error) / 6.0;
        }
        for (camera, truth) in cameras.iter().enumerate() {
            // Its turn and its centre are the last of its parameters.
            let found = &a.cameras[camera].camera;
            let turn = rigid::log(&(found.pose.rotation * truth.pose.rotation.transpose()));
            let shift = found.centre() - truth.centre();
            let error = DVector::from_iterator(6, turn.iter().chain(shift.iter()).copied());
            let place = &places[1 + stations.len() + camera];
            sums[3 + camera] += squared(&a, place.end - 6, &error) / 6.0;
        }
    }
    let nees = sums.map(|sum| (sum / RUNS as f64).sqrt());
    println!("sqrt(NEES / 6) of three stations and two cameras: {nees:.3?}");
    // 72 numbers each scatter by 0.08; the stations of one run share their planes, so that all 216 of them
    // scatter like less.
    assert!(nees.iter().all(|n| (0.75..1.25).contains(n)), "{nees:?}");
    let all = (sums.iter().sum::<f64>() / (5 * RUNS) as f64).sqrt();
    assert!((0.85..1.15).contains(&all), "{all}");
}

#[test]
fn stations_that_share_nothing_and_bad_options_are_refused() {
    let stations = walk();
    let input = whole_survey(&stations[..2], &[], 0.2, false);
    let mut options = TieOptions { pairs: Some(Vec::new()), ..TieOptions::default() };
    let mut survey = input.clone();
    let error = tie_stations(&mut survey, &options, silent).unwrap_err();
    assert!(matches!(&error, Error::BadState { reason } if reason.contains("station 1")), "{error}");
    assert!(survey == input, "as it was");
    for pairs in [vec![[0, 0]], vec![[0, 2]]] {
        options.pairs = Some(pairs);
        assert_eq!(tie_stations(&mut survey, &options, silent).unwrap_err().status(), Status::InvalidArgument);
    }
    // A station that looked at the ceiling only.
    let mut blind = Adjustment::new(rig()).unwrap();
    blind.add_station(Station::world()).unwrap();
    blind.add_station(Station::unknown()).unwrap();
    for shot in input.shots().iter().filter(|s| s.station == 0 || s.tilt < -0.3) {
        blind.add_shot(shot.clone()).unwrap();
    }
    let error = tie_stations(&mut blind, &TieOptions::default(), silent).unwrap_err();
    println!("{error}");
    assert!(matches!(&error, Error::BadState { reason } if reason.contains("0 and 1: ")), "{error}");
    assert!(blind.planes().is_empty());
    for pairs in [vec![[0, 1], [1, 0]], vec![[0, 1], [0, 1]]] {
        options.pairs = Some(pairs);
        let error = tie_stations(&mut survey, &options, silent).unwrap_err();
        assert!(error.to_string().contains("twice"), "{error}");
    }
    for min_closure in [f64::NAN, -0.1, 1.1] {
        let options = TieOptions { min_closure, ..TieOptions::default() };
        assert_eq!(tie_stations(&mut survey, &options, silent).unwrap_err().status(), Status::InvalidArgument);
    }
    // A prior is of one pair.
    let mut three = survey.clone();
    three.add_station(Station::unknown()).unwrap();
    let mut options = TieOptions::default();
    options.stations.prior = Some(PosePrior { b_to_a: stations[1], rotation_sigma: 0.1, position_sigma: 0.1 });
    let error = tie_stations(&mut three, &options, silent).unwrap_err();
    assert!(matches!(&error, Error::InvalidArgument { name: "prior", .. }), "{error}");
    options.stations.max_angle = f64::NAN;
    assert_eq!(tie_stations(&mut survey, &options, silent).unwrap_err().status(), Status::InvalidArgument);
    // Stopped by the one who hears of its progress, and by the token.
    let mut heard = Vec::new();
    let stop = |done, total| {
        heard.push((done, total));
        if done == 1 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    assert_eq!(tie_stations(&mut survey, &TieOptions::default(), stop).unwrap_err(), Error::Cancelled);
    assert_eq!(heard, [(0, 3), (1, 3)]);
    let cancelled = TieOptions::default();
    cancelled.cancel.cancel();
    assert_eq!(tie_stations(&mut survey, &cancelled, silent).unwrap_err(), Error::Cancelled);
}
