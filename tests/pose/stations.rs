//! Stations registered by the planes that both saw, without being told which they are: simulated rooms
//! with their truth, and real ones.

use nalgebra::{Matrix3, SMatrix, Vector3};
use ptzcal::error::{Degeneracy, Error, Status};
use ptzcal::format::read_depth;
use ptzcal::geometry::rigid::{exp, log};
use ptzcal::geometry::{Camera, Distortion, Intrinsics, Rigid};
use ptzcal::image::DepthNoise;
use ptzcal::pose::{
    FindPlanesOptions, PlaneRegion, PoseOptions, PosePrior, StationOptions, StationPlanes, StationPose,
    common_roof_edges, estimate_pose_roof_edges, find_planes_in_points, find_planes_in_shots, fit_regions_of_points,
    register_matched, register_stations, shots_of_depth_map, shots_of_ranges,
};

use crate::room::{Dice, Rectangle, cuboid, furnished, scan, somewhere};
use crate::{data, pcd};

/// Surfaces are exactly plane here.
fn exact() -> FindPlanesOptions {
    FindPlanesOptions { flatness: 0.0, ..Default::default() }
}

/// The noise is along the rays, and stated so: points of 5 mm in all directions would be worse ones.
fn planes(room: &[Rectangle], station: &Rigid, count: usize, dice: &mut Dice) -> StationPlanes {
    let points = scan(room, station, count, 0.005, dice).points;
    find_planes_in_shots(&shots_of_ranges(&points, 0.005).unwrap(), &exact()).unwrap()
}

/// Error as (w, t) in the order of the covariance.
fn error(found: &StationPose, truth: &Rigid) -> SMatrix<f64, 6, 1> {
    let w = log(&(found.b_to_a.rotation * truth.rotation.transpose()));
    let t = found.b_to_a.translation - truth.translation;
    SMatrix::from_iterator(w.iter().chain(t.iter()).copied())
}

fn pair(room: &[Rectangle], seed: u64, count: usize) -> ([StationPlanes; 2], Rigid) {
    let dice = &mut Dice::new(seed);
    let poses = [somewhere(dice), somewhere(dice)];
    let stations = [0, 1].map(|k| planes(room, &poses[k], count, dice));
    (stations, poses[0].after(&poses[1].inverse()))
}

#[test]
fn stations_in_a_furnished_room_are_registered_without_a_guess() {
    let (mut nees, runs) = (0.0, 30);
    for seed in 0..runs {
        let ([a, b], truth) = pair(&furnished(), seed, 20_000);
        let found = register_stations(&a, &b, &StationOptions::default()).unwrap();
        let e = error(&found, &truth);
        assert!(e.amax() < 1e-3, "seed {seed}: {e}");
        assert!(found.matches.len() >= 6 && found.agreement > 0.95 && found.runner_up < 0.9);
        nees += e.dot(&found.covariance.cholesky().unwrap().solve(&e)) / 6.0;
    }
    let nees = (nees / runs as f64).sqrt();
    println!("sqrt(NEES / 6) {nees:.3}");
    // 180 numbers would scatter by 0.05. Some planes have points of others, and what that does is estimated
    // from a handful of planes, so that few runs carry much of the sum. (100 runs: 0.97.)
    assert!((0.8..1.2).contains(&nees));
}

/// Partial and whole views of one room or of two: right or refused, never wrong.
#[test]
fn a_pose_is_right_or_refused() {
    let (mut solved, mut whole) = (0, 0);
    for seed in 0..60 {
        let dice = &mut Dice::new(7000 + seed);
        let (same, partial) = (seed % 2 == 0, seed % 4 >= 2);
        let rooms = [random_room(dice), random_room(dice)];
        let poses = [somewhere(dice), somewhere(dice)];
        let [a, b] = [0, 1].map(|k| {
            let mut points = scan(&rooms[if same { 0 } else { k }], &poses[k], 30_000, 0.005, dice).points;
            // A cone of 120 degrees that looks anywhere.
            points.retain(|p| !partial || p.z > 0.5 * p.norm());
            find_planes_in_points(&points, Some(0.005), &exact()).unwrap()
        });
        let truth = poses[0].after(&poses[1].inverse());
        match register_stations(&a, &b, &StationOptions::default()) {
            Ok(found) => {
                assert!(same && error(&found, &truth).norm() < 0.02, "seed {seed}: wrong, {found:?}");
                solved += 1;
                whole += usize::from(!partial);
            }
            Err(e) => {
                let known = matches!(
                    e,
                    Error::NoSharedPlanes { .. } | Error::AmbiguousStations { .. } | Error::Degenerate { .. }
                );
                assert!(known && e.hint().is_some(), "{e}");
            }
        }
    }
    println!("{solved} of 30 solved, {whole} of 15 whole views; the rest was refused");
    assert!(whole >= 12);
}

/// A room with four pieces of furniture along its longer walls.
fn random_room(dice: &mut Dice) -> Vec<Rectangle> {
    let (x, y, z) = (dice.uniform(2.0, 4.0), dice.uniform(1.0, 1.3), dice.uniform(1.6, 3.0));
    let mut room = cuboid([-x, -1.5, -z], [x, y, z]);
    for _ in 0..4 {
        let (width, height, depth) = (dice.uniform(0.4, 1.4), dice.uniform(0.4, 2.0), dice.uniform(0.4, 1.0));
        let (left, front) = (dice.uniform(-x, x - width), if dice.uniform(0.0, 1.0) < 0.5 { -z } else { z - depth });
        room.extend(cuboid([left, y - height, front], [left + width, y, front + depth]));
    }
    room
}

#[test]
fn an_empty_room_is_ambiguous_and_a_prior_settles_it() {
    let room = cuboid([-3.0, -1.5, -2.0], [3.0, 1.1, 2.4]);
    for seed in 0..20 {
        let ([a, b], truth) = pair(&room, seed, 10_000);
        let e = register_stations(&a, &b, &StationOptions::default()).unwrap_err();
        assert!(matches!(e, Error::AmbiguousStations { .. }) && e.status() == Status::Ambiguous, "{e}");
        // The other pose is the room turned upside down, or by half a turn.
        assert!(e.to_string().contains("turned by 1"), "{e}");
        let off = Rigid {
            rotation: exp(&Vector3::new(0.1, -0.2, 0.1)) * truth.rotation,
            translation: truth.translation + Vector3::new(0.3, 0.2, -0.3),
        };
        let prior = PosePrior { b_to_a: off, rotation_sigma: 0.2, position_sigma: 0.3 };
        let options = StationOptions { prior: Some(prior), ..Default::default() };
        let found = register_stations(&a, &b, &options).unwrap();
        assert!(error(&found, &truth).norm() < 5e-3, "seed {seed}");
        assert_eq!(found.matches.len(), 6);
    }
}

#[test]
fn corridors_say_what_they_leave_free() {
    let corridor = cuboid([-1.2, -1.5, -15.0], [1.2, 1.1, 15.0]);
    for (seed, [first, second]) in [[-12.0, 12.0], [-12.0, -9.0], [0.0, 3.0]].into_iter().enumerate() {
        let dice = &mut Dice::new(seed as u64);
        let poses = [first, second].map(|z| {
            let turn = exp(&Vector3::new(0.02, dice.uniform(-1.0, 1.0), 0.01));
            Rigid::from_centre(turn, &Vector3::new(dice.uniform(-0.4, 0.4), 0.0, z))
        });
        let register = |room: &[Rectangle], dice: &mut Dice| {
            let [a, b] = poses.map(|pose| {
                let mut points = scan(room, &pose, 10_000, 0.005, dice).points;
                points.retain(|p| p.norm() < 8.0);
                find_planes_in_points(&points, Some(0.005), &exact()).unwrap()
            });
            register_stations(&a, &b, &StationOptions::default()).unwrap_err()
        };
        // Without ends.
        let e = register(&corridor[..4], dice);
        assert!(matches!(e, Error::Degenerate { kind: Degeneracy::Parallel, .. }), "{e}");
        let along = poses[0].rotation * Vector3::z();
        let text = e.to_string();
        let numbers = text.split_once("translation along (").and_then(|(_, rest)| rest.split_once(')')).unwrap().0;
        let told = Vector3::from_iterator(numbers.split(", ").map(|v| v.parse::<f64>().unwrap()));
        assert!(told.dot(&along).abs() > 0.999, "{text}, not {along}");
        // Each station sees an end, the same one or not: nothing tells.
        if seed < 2 {
            let e = register(&corridor, dice);
            assert!(matches!(e, Error::AmbiguousStations { .. } | Error::Degenerate { .. }), "{e}");
        }
    }
}

/// Many planes in few directions, and in all: the search is bounded, and its answer right or none.
#[test]
fn a_hundred_planes_are_registered_in_bounded_time() {
    for shelves in [true, false] {
        let dice = &mut Dice::new(4);
        let mut points: Vec<Vector3<f64>> = Vec::new();
        let mut labels = Vec::new();
        for k in 0..100 {
            let normal = if shelves { Vector3::ith(k % 3, [1.0, -1.0][k / 3 % 2]) } else { dice.direction() };
            let centre = normal * dice.uniform(1.0, 6.0);
            let first = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
            let second = normal.cross(&first);
            labels.push((points.len()..points.len() + 60).collect());
            for _ in 0..60 {
                let place = centre + first * dice.uniform(-0.4, 0.4) + second * dice.uniform(-0.4, 0.4);
                points.push(place + normal * 0.002 * dice.gaussian());
            }
        }
        let motion = Rigid { rotation: exp(&Vector3::new(0.1, 0.7, -0.1)), translation: Vector3::new(0.3, 0.1, -0.2) };
        let moved: Vec<_> = points.iter().map(|p| motion.apply(p)).collect();
        let regions: Vec<PlaneRegion> = labels.into_iter().map(PlaneRegion::Indices).collect();
        let [a, b] = [&moved, &points].map(|p| fit_regions_of_points(p, Some(0.002), &regions, &exact()).unwrap());
        let begin = std::time::Instant::now();
        let found = register_stations(&a, &b, &StationOptions::default());
        println!("{:.2} s", begin.elapsed().as_secs_f64());
        // A minute on a busy machine; unbounded, it would be hours.
        assert!(begin.elapsed().as_secs() < 60);
        match found {
            Ok(found) => assert!(error(&found, &motion).norm() < 0.01),
            Err(e) => assert!(matches!(e, Error::AmbiguousStations { .. } | Error::NoSharedPlanes { .. }), "{e}"),
        }
    }
}

#[test]
fn parallel_walls_and_bad_options_are_refused() {
    let walls = &cuboid([-3.0, -1.5, -2.0], [3.0, 1.1, 2.4])[..2];
    let dice = &mut Dice::new(1);
    let a = planes(walls, &Rigid::identity(), 5000, dice);
    let e = register_stations(&a, &a, &StationOptions::default()).unwrap_err();
    assert!(matches!(e, Error::Degenerate { kind: Degeneracy::Parallel, .. }));
    let text = e.to_string();
    assert!(text.contains("rotation about (1.000, 0.000, 0.000)") && text.contains("translation along"), "{text}");

    let ([a, b], truth) = pair(&furnished(), 1, 20_000);
    let prior = PosePrior { b_to_a: truth, rotation_sigma: 0.1, position_sigma: 0.1 };
    let with = |prior: PosePrior| StationOptions { prior: Some(prior), ..Default::default() };
    let nan = Rigid { translation: Vector3::repeat(f64::NAN), ..truth };
    let mirror = Rigid { rotation: -truth.rotation, ..truth };
    for (name, options) in [
        ("max_angle", StationOptions { max_angle: 0.0, ..Default::default() }),
        ("max_angle", StationOptions { max_angle: f64::NAN, ..Default::default() }),
        ("max_distance", StationOptions { max_distance: f64::INFINITY, ..Default::default() }),
        ("min_agreement", StationOptions { min_agreement: 1.1, ..Default::default() }),
        ("max_runner_up", StationOptions { max_runner_up: -0.1, ..Default::default() }),
        ("rotation_sigma", with(PosePrior { rotation_sigma: 0.0, ..prior.clone() })),
        ("position_sigma", with(PosePrior { position_sigma: f64::NAN, ..prior.clone() })),
        ("prior", with(PosePrior { b_to_a: mirror, ..prior.clone() })),
        ("prior", with(PosePrior { b_to_a: nan, ..prior.clone() })),
    ] {
        let e = register_stations(&a, &b, &options).unwrap_err();
        assert!(e.to_string().starts_with(name), "{name}: {e}");
    }
    // A prior that excludes the truth.
    let away = Rigid { translation: truth.translation + Vector3::new(5.0, 0.0, 0.0), ..truth };
    let e = register_stations(&a, &b, &with(PosePrior { b_to_a: away, ..prior })).unwrap_err();
    assert!(matches!(e, Error::NoSharedPlanes { .. }), "{e}");
}

/// The thesis's method on planes that nobody named: its edges are where the matched planes meet.
#[test]
fn common_edges_give_the_pose_of_the_thesis() {
    let ([a, b], truth) = pair(&furnished(), 3, 20_000);
    let found = register_stations(&a, &b, &StationOptions::default()).unwrap();
    // The same planes, named, give the same pose; too few of them say what they leave free.
    let named = register_matched(&a, &b, &found.matches).unwrap();
    assert!((named.b_to_a.translation - found.b_to_a.translation).norm() < 1e-12);
    for wrong in [vec![[0, 99]], vec![[99, 0]], [found.matches.as_slice(), &found.matches[..1]].concat()] {
        let e = register_matched(&a, &b, &wrong).unwrap_err();
        assert_eq!(e.status(), Status::InvalidArgument, "{e}");
    }
    let e = register_matched(&a, &b, &found.matches[..2]).unwrap_err();
    assert!(matches!(e, Error::Degenerate { .. }) && e.to_string().contains("station_a"), "{e}");
    assert!(register_matched(&a, &b, &[]).unwrap_err().to_string().contains("no planes"));
    let [edges_a, edges_b] = common_roof_edges(&a, &b, &found.matches, 0.3).unwrap();
    assert_eq!(edges_a.planes().len(), found.matches.len());
    let pose = estimate_pose_roof_edges(&edges_a, &edges_b, &PoseOptions::default()).unwrap();
    let off = (pose.b_to_a.translation - truth.translation).norm();
    assert!(off < 0.01, "{off}");
    assert!(common_roof_edges(&a, &b, &[[99, 0]], 0.3).is_err());
    assert!(common_roof_edges(&a, &b, &[[0, 99]], 0.3).is_err());
}

/// Two rendered depth images, 36 degrees and 1.2 m apart; their published poses are off by about one
/// frame (1.5 degrees, 30 mm).
#[test]
fn two_depth_images_are_registered_by_their_planes() {
    let Some(folder) = data::folder("rgbd_icl") else { return };
    // Its y axis points up.
    let intrinsics = Intrinsics { fx: 481.2, fy: -480.0, skew: 0.0, cx: 319.5, cy: 239.5 };
    let camera = Camera { width: 640, height: 480, intrinsics, distortion: Distortion::None, pose: Rigid::identity() };
    let rows = data::numbers(&folder.join("pose.txt")).unwrap();
    let [first, second] = [0, 1].map(|k| {
        let v = &rows[k];
        let rotation = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(v[6], v[3], v[4], v[5]));
        Rigid { rotation: *rotation.to_rotation_matrix().matrix(), translation: Vector3::new(v[0], v[1], v[2]) }
    });
    let truth = first.inverse().after(&second);
    for seed in 1..6 {
        let [a, b] = ["depth1.png", "depth4.png"].map(|name| {
            let map = read_depth(&folder.join(name), 1.0 / 5000.0).unwrap();
            let shots = shots_of_depth_map(&map, &camera, &DepthNoise::default()).unwrap();
            find_planes_in_shots(&shots, &FindPlanesOptions { seed, ..Default::default() }).unwrap()
        });
        let found = register_stations(&a, &b, &StationOptions::default()).unwrap();
        let e = error(&found, &truth);
        let (angle, off) = (e.fixed_rows::<3>(0).norm().to_degrees(), e.fixed_rows::<3>(3).norm());
        println!("seed {seed}: {angle:.2} degrees, {:.1} mm, {:?}", off * 1e3, found.matches);
        assert!(angle < 1.5 && off < 0.03);
    }
}

/// Two laser scans of a real room, against ICP of all points: 1 degree, 5 cm, without the odometry. The seed
/// decides which planes are found: of each the pose is found, and right.
#[test]
fn two_scans_of_a_real_room_are_registered_by_their_planes() {
    let Some(folder) = data::folder("cloud_pcl_room_scans") else { return };
    // truth.json: peer_icp_point_to_plane_scan2_to_scan1.
    let rotation = Matrix3::new(0.75671, -0.65347, 0.01917, 0.65331, 0.75695, 0.01459, -0.02404, 0.00149, 0.99971);
    let truth = Rigid { rotation, translation: Vector3::new(1.97048, 0.05691, 0.03037) };
    // What is nearer than 0.5 m is the robot; the scanner is good to a centimetre.
    let scans = ["room_scan1.pcd", "room_scan2.pcd"].map(|name| pcd::read(&folder.join(name)));
    assert!(scans.iter().all(|points| points.len() > 112_000));
    let mut angles = Vec::new();
    for seed in 1..=20 {
        let options = FindPlanesOptions { flatness: 0.01, range: [0.5, f64::INFINITY], seed, ..Default::default() };
        let [a, b] = scans.each_ref().map(|points| find_planes_in_points(points, None, &options).unwrap());
        let found = register_stations(&a, &b, &StationOptions::default()).unwrap();
        let e = error(&found, &truth);
        let (angle, off) = (e.fixed_rows::<3>(0).norm().to_degrees(), e.fixed_rows::<3>(3).norm());
        let sigma = found.covariance.fixed_view::<3, 3>(0, 0).trace().sqrt().to_degrees();
        println!(
            "seed {seed}: {angle:.2} degrees (stated {sigma:.2}), {:.1} mm, {} planes",
            off * 1e3,
            found.matches.len()
        );
        assert!(angle < 1.0 && off < 0.05);
        angles.push(angle);
    }
    angles.sort_by(f64::total_cmp);
    println!("median {:.2} degrees", angles[angles.len() / 2]);
    assert!(angles[angles.len() / 2] < 0.5);
}
