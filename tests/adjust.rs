//! The joint adjustment of rig and cameras on the simulated set-ups, from a cold start.

#[path = "support/thesis.rs"]
mod thesis;

use nalgebra::{DMatrix, DVector, Matrix2, Matrix3, Vector2, Vector3};
use ptzcal::Error;
use ptzcal::adjust::{AdjustOptions, Adjusted, Adjustment, CameraSetup, Prior, Shot, Sighting, Station, adjust};
use ptzcal::control::Cancel;
use ptzcal::error::{Degeneracy, Status};
use ptzcal::geometry::rig_model::AxisOffsets;
use ptzcal::geometry::rigid::{self, nearest_rotation};
use ptzcal::geometry::{Camera, RIG_PARAMETERS, RigModel, Rigid};
use thesis::{Noise, SharedShot, choose, far, grid, near, rig};

/// Standard deviations of a rig's parameters, in groups.
#[derive(Default)]
struct Known {
    offsets: f64,
    laser: f64,
}

fn prior(known: &Known) -> Prior {
    let mut s = [0.0; RIG_PARAMETERS];
    s[..4].fill(known.laser);
    s[7..11].fill(known.offsets);
    Prior::of_sigmas(&s)
}

/// The second viewpoint of eq. (24): its frame to the first one's.
fn second_station() -> Rigid {
    let r = Matrix3::new(0.7958, -0.0079, 0.6056, 0.0295, 0.9992, -0.0257, -0.6049, 0.0383, 0.7954);
    Rigid { rotation: nearest_rotation(&r).unwrap(), translation: Vector3::new(-0.94237, -0.06594, 0.32666) }
}

/// Noise of a simulated survey.
struct Noisy {
    sigma: f64,
    pointing: f64,
    seed: u64,
}

impl Noisy {
    fn new(sigma: f64, seed: u64) -> Self {
        Self { sigma, pointing: 0.0, seed }
    }
}

/// Shots of the true rig from stations (the first is the world, the others unknown), `n` from each.
fn survey(
    believed: RigModel,
    truth: &RigModel,
    stations: &[Rigid],
    cameras: &[Camera],
    n: usize,
    noisy: &Noisy,
) -> Adjustment {
    let mut input = Adjustment::new(believed).unwrap();
    for c in cameras {
        input.add_camera(CameraSetup::new(c.width, c.height)).unwrap();
    }
    let mut noise = Noise::new(noisy.seed);
    for (index, pose) in stations.iter().enumerate() {
        input.add_station(if index == 0 { Station::world() } else { Station::unknown() }).unwrap();
        let mut shots = grid(truth, pose, cameras);
        shots.retain(|s| s.fixed.iter().any(Option::is_some));
        choose(&mut shots, n);
        for s in &shots {
            input.add_shot(noisy_shot(s, index, noisy, &mut noise)).unwrap();
        }
    }
    input
}

fn noisy_shot(s: &SharedShot, station: usize, noisy: &Noisy, noise: &mut Noise) -> Shot {
    let covariance = Matrix2::identity() * (noisy.sigma * noisy.sigma);
    let head = Some((s.head + noise.pixel(noisy.sigma), covariance));
    let sighting = |(camera, p): (usize, &Option<Vector2<f64>>)| {
        p.map(|p| Sighting { camera, pixel: p + noise.pixel(noisy.sigma), covariance })
    };
    let sightings = s.fixed.iter().enumerate().filter_map(sighting).collect();
    let off = noise.pixel(noisy.pointing);
    Shot { station, pan: s.pan + off.x, tilt: s.tilt + off.y, head, sightings }
}

fn single(believed: RigModel, truth: &RigModel, camera: &Camera, n: usize, noisy: &Noisy) -> Adjustment {
    survey(believed, truth, &[Rigid::identity()], &[*camera], n, noisy)
}

fn solve(input: &Adjustment) -> Adjusted {
    adjust(input, &AdjustOptions::default()).unwrap()
}

fn centre_error(a: &Adjusted, camera: usize, truth: &Camera) -> f64 {
    (a.cameras[camera].camera.centre() - truth.centre()).norm()
}

fn centre_sigma(a: &Adjusted, camera: usize) -> f64 {
    a.cameras[camera].covariance.view((8, 8), (3, 3)).trace().sqrt()
}

fn offset_rig() -> RigModel {
    RigModel { offsets: AxisOffsets { tilt_y: 0.0, tilt_z: 0.04, pan_x: 0.0, pan_z: 0.04 }, ..rig() }
}

#[test]
fn axis_offsets_are_calibrated_from_a_cold_start() {
    for camera in [near(), far()] {
        let mut input = single(rig(), &offset_rig(), &camera, 2021, &Noisy::new(0.5, 1));
        let ignoring = solve(&input);
        input.set_rig_prior(prior(&Known { offsets: 0.1, ..Known::default() })).unwrap();
        let freed = solve(&input);
        assert!(centre_error(&freed, 0, &camera) < 3.0 * centre_sigma(&freed, 0));
        assert!(centre_error(&ignoring, 0, &camera) > 2.0 * centre_error(&freed, 0, &camera));
        for (i, wanted) in [(7, 0.0), (8, 0.04), (9, 0.0), (10, 0.04)] {
            let sigma = freed.covariance[(i, i)].sqrt();
            assert!(sigma < 0.02 && (freed.rig.parameters()[i] - wanted).abs() < 4.0 * sigma, "offset {i}");
        }
        assert!(freed.check.passed(), "{:?}", freed.check);
        // The self-check finds what was left out.
        let suspect = &ignoring.check.suspects[0];
        assert_eq!(suspect.group, "the axis offsets");
        assert!(ignoring.check.probability < 1e-10 && !ignoring.check.passed());
        let drop = ignoring.check.chi2 - freed.check.chi2;
        assert!((suspect.gain / drop - 1.0).abs() < 0.25, "first order gain {} of {drop}", suspect.gain);
        assert!(ignoring.check.warnings.iter().any(|w| w.contains("the axis offsets should not be fixed")));
    }
}

#[test]
fn a_station_is_found_through_the_cameras_it_shares() {
    let (cameras, second) = ([near(), far()], second_station());
    let (mut squares, mut count) = (0.0, 0);
    for seed in 0..20 {
        let input = survey(rig(), &rig(), &[Rigid::identity(), second], &cameras, 150, &Noisy::new(0.3, seed));
        let a = solve(&input);
        let turn = rigid::log(&(a.stations[1].rotation * second.rotation.transpose()));
        let off = a.stations[1].translation - second.translation;
        let e = DVector::from_iterator(6, turn.iter().chain(off.iter()).copied());
        let place = a.places()[2].clone();
        let c = a.covariance.view((place.start, place.start), (6, 6)).into_owned();
        squares += e.dot(&c.cholesky().unwrap().solve(&e));
        count += 6;
        assert!(off.norm() < 0.02, "{off}");
        assert_eq!(a.covariance.view((15, 15), (6, 6)).amax(), 0.0, "the first station is the world");
        assert_eq!(a.parameter_names()[place.start], "station 1 rotation x");
    }
    let root = (squares / f64::from(count)).sqrt();
    assert!((0.85..1.15).contains(&root), "sqrt(NEES / 6) = {root}");
}

#[test]
fn points_of_shots_have_honest_covariances() {
    // The rig is believed wrongly within its prior: the chain rig -> shot must carry that.
    let (cameras, known) = ([near(), far()], Known { offsets: 0.01, laser: 3e-4 });
    let (mut estimated, mut measured, mut n) = (0.0, 0.0, 0);
    for seed in 0..25 {
        let mut noise = Noise::new(1000 + seed);
        let mut step = [0.0; RIG_PARAMETERS];
        step[..4].iter_mut().for_each(|s| *s = known.laser * noise.gaussian());
        step[7..11].iter_mut().for_each(|s| *s = known.offsets * noise.gaussian());
        let believed = rig().moved(&step);
        let noisy = Noisy::new(0.3, seed);
        let mut input = survey(believed, &rig(), &[Rigid::identity()], &cameras, 100, &noisy);
        input.set_rig_prior(prior(&known)).unwrap();
        let a = solve(&input);
        assert!(a.check.passed(), "{:?}", a.check);
        let mut shots = grid(&rig(), &Rigid::identity(), &cameras);
        shots.retain(|s| s.fixed.iter().any(Option::is_some));
        choose(&mut shots, 100);
        // A few far apart: their errors share the rig's.
        for i in [3, 40, 77] {
            let (x, c) = a.shot_point(i).unwrap();
            let e = x - shots[i].point;
            estimated += e.dot(&c.cholesky().unwrap().solve(&e));
            let spot = shots[i].head + noise.pixel(0.3);
            let covariance = Matrix2::identity() * 0.09;
            let (x, c) = a.measure(0, shots[i].pan, shots[i].tilt, &spot, &covariance).unwrap();
            let e = x - shots[i].point;
            measured += e.dot(&c.cholesky().unwrap().solve(&e));
            n += 3;
        }
    }
    for (name, sum) in [("estimated", estimated), ("measured", measured)] {
        let root = (sum / f64::from(n)).sqrt();
        assert!((0.85..1.15).contains(&root), "{name}: sqrt(NEES / 3) = {root}");
    }
}

#[test]
fn outliers_in_head_and_cameras_are_set_aside() {
    let cameras = [near(), far()];
    let mut clean = survey(offset_rig(), &offset_rig(), &[Rigid::identity()], &cameras, 400, &Noisy::new(0.3, 3));
    clean.set_rig_prior(prior(&Known { offsets: 0.02, ..Known::default() })).unwrap();
    let mut spoiled = Adjustment::new(offset_rig()).unwrap();
    spoiled.set_rig_prior(clean.rig_prior().clone()).unwrap();
    spoiled.add_station(Station::world()).unwrap();
    for c in &cameras {
        spoiled.add_camera(CameraSetup::new(c.width, c.height)).unwrap();
    }
    let mut noise = Noise::new(8);
    let mut wrong = (Vec::new(), vec![Vec::new(), Vec::new()]);
    for shot in clean.shots() {
        let mut shot = shot.clone();
        let bad_head = noise.uniform() < 0.1;
        wrong.0.push(bad_head);
        if bad_head {
            shot.head.as_mut().unwrap().0 += Vector2::new(20.0 + 60.0 * noise.uniform(), 30.0);
        }
        for s in &mut shot.sightings {
            let bad = noise.uniform() < 0.2;
            wrong.1[s.camera].push(bad);
            if bad {
                s.pixel = Vector2::new(800.0 * noise.uniform(), 600.0 * noise.uniform());
            }
        }
        spoiled.add_shot(shot).unwrap();
    }
    let (a, reference) = (solve(&spoiled), solve(&clean));
    for (i, camera) in cameras.iter().enumerate() {
        let sigma = centre_sigma(&a, i);
        assert!(sigma < 2.0 * centre_sigma(&reference, i));
        assert!(centre_error(&a, i, camera) < 3.5 * sigma, "{} of {sigma}", centre_error(&a, i, camera));
        let missed = a.cameras[i].inliers.iter().zip(&wrong.1[i]).filter(|(used, bad)| **used && **bad).count();
        let lost = a.cameras[i].inliers.iter().zip(&wrong.1[i]).filter(|(used, bad)| !**used && !**bad).count();
        assert!(missed <= 4 && lost <= 12, "camera {i}: {missed} outliers kept, {lost} good spots lost");
    }
    let kept = a.head_inliers.iter().zip(&wrong.0).filter(|(used, bad)| **used && **bad).count();
    assert!(kept <= 4, "{kept} wrong head spots kept");
}

#[test]
fn solving_again_gives_the_same_bits() {
    let mut input = survey(rig(), &offset_rig(), &[Rigid::identity()], &[near(), far()], 200, &Noisy::new(0.5, 2));
    input.set_rig_prior(prior(&Known { offsets: 0.1, laser: 1e-4 })).unwrap();
    let a = solve(&input);
    let b = a.resolve().unwrap();
    assert_eq!(a.covariance, b.covariance);
    assert_eq!((a.rig, &a.stations), (b.rig, &b.stations));
    assert_eq!(a.cameras[1].camera, b.cameras[1].camera);
    // And on another thread.
    let c = std::thread::scope(|s| s.spawn(|| solve(&input)).join().unwrap());
    assert_eq!(a.covariance, c.covariance);
}

#[test]
fn repeatability_of_the_head_is_part_of_the_model() {
    let noisy = Noisy { pointing: 0.1f64.to_radians(), ..Noisy::new(0.3, 4) };
    let input = survey(rig(), &rig(), &[Rigid::identity()], &[near(), far()], 300, &noisy);
    let rigid_head = solve(&input);
    assert!(rigid_head.check.probability < 1e-6);
    assert!(rigid_head.check.warnings[0].contains("times the stated noise"));
    let options = AdjustOptions { pointing_sigma: [noisy.pointing; 2], ..AdjustOptions::default() };
    let loose = adjust(&input, &options).unwrap();
    assert!(loose.check.passed(), "{:?}", loose.check);
    for (i, camera) in [near(), far()].iter().enumerate() {
        assert!(centre_error(&loose, i, camera) < 3.5 * centre_sigma(&loose, i));
    }
}

#[test]
fn a_prior_that_the_data_contradict_is_named() {
    let mut truth = rig();
    truth.laser.vy += 0.004;
    let mut input = single(rig(), &truth, &near(), 400, &Noisy::new(0.3, 5));
    input.set_rig_prior(prior(&Known { laser: 1e-4, ..Known::default() })).unwrap();
    let a = solve(&input);
    assert!(a.check.warnings.iter().any(|w| w.contains("the prior of the rig contradicts the data")), "{:?}", a.check);
}

/// Of one station with its axes through the head, a longer baseline and a larger world look the same:
/// the other directions of the laser line are tested all the same.
#[test]
fn a_wrong_laser_is_named_though_the_scale_is_open() {
    let mut believed = rig();
    believed.laser.vx += 0.003;
    let a = solve(&single(believed, &rig(), &near(), 400, &Noisy::new(0.2, 5)));
    let laser = a.check.suspects.iter().find(|s| s.group == "the laser line").expect("the laser line is suspected");
    assert!(laser.parameters == 3 && laser.gain > 30.0, "{laser:?}");
}

#[test]
fn an_earlier_calibration_is_a_prior() {
    let first = solve(&single(rig(), &rig(), &far(), 500, &Noisy::new(0.3, 6)));
    let mut again = Adjustment::new(rig()).unwrap();
    again.add_station(Station::world()).unwrap();
    let known = Prior::of_covariance(first.cameras[0].covariance.clone());
    let setup = CameraSetup { prior: Some((first.cameras[0].camera, known)), ..CameraSetup::new(800, 600) };
    again.add_camera(setup).unwrap();
    for shot in single(rig(), &rig(), &far(), 60, &Noisy::new(0.3, 7)).shots() {
        again.add_shot(shot.clone()).unwrap();
    }
    let second = solve(&again);
    assert!(centre_sigma(&second, 0) < centre_sigma(&first, 0));
    assert!(centre_error(&second, 0, &far()) < 3.5 * centre_sigma(&second, 0));
    // Fixed by a zero covariance: nothing left to estimate.
    let fixed = CameraSetup { prior: Some((far(), Prior::fixed(11))), ..CameraSetup::new(800, 600) };
    let mut input = Adjustment::new(rig()).unwrap();
    input.add_station(Station::world()).unwrap();
    input.add_camera(fixed).unwrap();
    let options = AdjustOptions::default();
    input.add_shot(again.shots()[0].clone()).unwrap();
    assert_eq!(adjust(&input, &options).unwrap_err().status(), Status::BadState);
}

#[test]
fn what_the_data_leave_open_is_said() {
    // The pan zero of a single station turns the world.
    let mut input = single(rig(), &rig(), &near(), 300, &Noisy::new(0.3, 9));
    let mut s = [0.0; RIG_PARAMETERS];
    s[11] = f64::INFINITY;
    input.set_rig_prior(Prior::of_sigmas(&s)).unwrap();
    let e = adjust(&input, &AdjustOptions::default()).unwrap_err();
    assert!(matches!(&e, Error::Degenerate { kind: Degeneracy::IllConditioned, .. }), "{e}");
    assert!(e.to_string().contains("pan encoder"), "{e}");
    // Under a prior it is only said.
    s[11] = 0.01;
    input.set_rig_prior(Prior::of_sigmas(&s)).unwrap();
    let weakest = solve(&input).weakest().unwrap();
    assert_eq!(weakest.prior_only, ["pan zero"]);
    assert!(weakest.condition > 1.0 && weakest.text.starts_with("weakest: "), "{weakest:?}");
    // A camera that saw little depth: focal length against position, with distances to add.
    let mut shots = grid(&rig(), &Rigid::identity(), &[far()]);
    shots.retain(|s| s.fixed[0].is_some() && (2.2..3.2).contains(&s.point.norm()));
    let mut narrow = Adjustment::new(rig()).unwrap();
    narrow.add_station(Station::world()).unwrap();
    narrow.add_camera(CameraSetup::new(800, 600)).unwrap();
    let mut noise = Noise::new(1);
    choose(&mut shots, 300);
    for s in &shots {
        narrow.add_shot(noisy_shot(s, 0, &Noisy::new(0.2, 0), &mut noise)).unwrap();
    }
    let text = solve(&narrow).weakest().unwrap().text;
    assert!(text.contains("camera 0"), "{text}");
}

#[test]
fn bad_input_is_refused_by_name() {
    let good = single(rig(), &rig(), &near(), 60, &Noisy::new(0.3, 9));
    let status = |input: &Adjustment| adjust(input, &AdjustOptions::default()).unwrap_err();
    // Variances.
    let mut input = good.clone();
    let mut s = [0.0; RIG_PARAMETERS];
    s[8] = -0.1;
    assert!(input.set_rig_prior(Prior::of_sigmas(&s)).unwrap_err().to_string().contains("tilt axis z"));
    assert!(input.set_rig_prior(Prior::fixed(4)).is_err());
    let contradictory =
        DMatrix::from_fn(15, 15, |i, j| if i < 2 && j < 2 { if i == j { 1.0 } else { 2.0 } } else { 0.0 });
    assert!(input.set_rig_prior(Prior::of_covariance(contradictory)).unwrap_err().to_string().contains("laser y0"));
    // A camera that nothing lit, and one whose shots do not suffice.
    let mut input = good.clone();
    input.add_camera(CameraSetup::new(640, 480)).unwrap();
    let e = status(&input);
    assert_eq!((e.status(), e.index()), (Status::TooFewPoints, Some(1)), "{e}");
    let few = single(rig(), &rig(), &near(), 4, &Noisy::new(0.3, 9));
    assert_eq!((status(&few).status(), status(&few).index()), (Status::TooFewPoints, Some(0)));
    let two = survey(rig(), &rig(), &[Rigid::identity()], &[near(), far()], 4, &Noisy::new(0.3, 9));
    assert_eq!((status(&two).status(), status(&two).index()), (Status::TooFewPoints, Some(0)), "the first is named");
    // A station that shares nothing.
    let mut input = good.clone();
    input.add_station(Station::unknown()).unwrap();
    let e = status(&input);
    assert!(e.status() == Status::BadState && e.to_string().contains("station 1"), "{e}");
    // Shots.
    let mut input = good.clone();
    let shot = good.shots()[0].clone();
    assert!(input.add_shot(Shot { station: 3, ..shot.clone() }).unwrap_err().to_string().contains("station"));
    assert!(input.add_shot(Shot { pan: f64::NAN, ..shot.clone() }).is_err());
    let twice = vec![shot.sightings[0], shot.sightings[0]];
    assert!(input.add_shot(Shot { sightings: twice, ..shot.clone() }).is_err());
    let singular = Some((Vector2::new(1.0, 1.0), Matrix2::new(1.0, 1.0, 1.0, 1.0)));
    assert!(input.add_shot(Shot { head: singular, ..shot.clone() }).is_err());
    assert_eq!(input, good, "refused shots leave nothing behind");
    // A station with a prior about nothing; a mirrored one.
    assert!(input.add_station(Station { pose: None, prior: Prior::fixed(6) }).is_err());
    let mirrored = Rigid { rotation: -Matrix3::identity(), translation: Vector3::zeros() };
    assert!(input.add_station(Station { pose: Some(mirrored), prior: Prior::fixed(6) }).is_err());
    // Nothing at all, and options out of range.
    let mut empty = Adjustment::new(rig()).unwrap();
    assert_eq!(status(&empty).status(), Status::BadState);
    empty.add_camera(CameraSetup::new(640, 480)).unwrap();
    assert_eq!(status(&empty).status(), Status::TooFewPoints);
    for options in [
        AdjustOptions { huber: 0.0, ..AdjustOptions::default() },
        AdjustOptions { max_iterations: 0, ..AdjustOptions::default() },
        AdjustOptions { pointing_sigma: [f64::NAN, 0.0], ..AdjustOptions::default() },
    ] {
        assert_eq!(adjust(&good, &options).unwrap_err().status(), Status::InvalidArgument);
    }
    let cancel = Cancel::new();
    cancel.cancel();
    let e = adjust(&good, &AdjustOptions { cancel, ..AdjustOptions::default() }).unwrap_err();
    assert_eq!(e.status(), Status::Cancelled);
}

#[test]
fn shots_and_sightings_are_added_whole_or_not_at_all() {
    let good = single(rig(), &rig(), &near(), 60, &Noisy::new(0.3, 9));
    let mut input = good.clone();
    let bare: Vec<Shot> = good.shots().iter().map(|s| Shot { sightings: Vec::new(), ..s.clone() }).collect();
    let mut bad = bare.clone();
    bad[40].tilt = f64::INFINITY;
    assert!(input.add_shots(bad).is_err());
    assert_eq!(input, good);
    assert_eq!(input.add_shots(bare), Ok(60));
    let before = input.clone();
    let seen: Vec<(usize, Sighting)> = (60..120).map(|i| (i, good.shots()[i - 60].sightings[0])).collect();
    let spot = seen[0].1;
    for (fault, what) in [
        ((120, spot), "shot: 120 of 120"),
        ((3, spot), "shot 3 is seen twice by camera 0"),
        ((110, Sighting { camera: 1, ..spot }), "shot 110: 1 of 1"),
        ((110, Sighting { covariance: Matrix2::zeros(), ..spot }), "not positive definite"),
        ((110, Sighting { pixel: Vector2::new(f64::NAN, 0.0), ..spot }), "uv[110]"),
    ] {
        let mut bad = seen.clone();
        bad[50] = fault;
        let e = input.add_sightings(&bad).unwrap_err();
        assert!(e.to_string().contains(what), "{e}");
        assert_eq!(input, before);
    }
    input.add_sightings(&seen).unwrap();
    assert_eq!(input.shots()[60..], good.shots()[..], "the same survey twice");
}

#[test]
fn a_calibration_with_square_pixels_is_a_prior() {
    let square = CameraSetup { aspect_sigma: 0.0, skew_sigma: 0.0, ..CameraSetup::new(800, 600) };
    let survey = |setup: CameraSetup, n, seed| {
        let mut input = Adjustment::new(rig()).unwrap();
        input.add_station(Station::world()).unwrap();
        input.add_camera(setup).unwrap();
        let shots = single(rig(), &rig(), &far(), n, &Noisy::new(0.3, seed));
        input.add_shots(shots.shots().iter().cloned()).unwrap();
        solve(&input)
    };
    let first = survey(square.clone(), 300, 6);
    let again = survey(CameraSetup::calibrated(&first.cameras[0]), 100, 7);
    let (k, c) = (&again.cameras[0].camera.intrinsics, &again.cameras[0].covariance);
    assert!(k.fx == k.fy && k.skew == 0.0 && c[(2, 2)] == 0.0);
    assert!((c[(0, 0)] - c[(1, 1)]).abs() <= 1e-12 * c[(0, 0)]);
    // The prior carries what the first 300 shots say: as good as all at once, and no better.
    let together = single(rig(), &rig(), &far(), 300, &Noisy::new(0.3, 6));
    let more = single(rig(), &rig(), &far(), 100, &Noisy::new(0.3, 7));
    let mut input = Adjustment::new(rig()).unwrap();
    input.add_station(Station::world()).unwrap();
    input.add_camera(square).unwrap();
    input.add_shots(together.shots().iter().chain(more.shots()).cloned()).unwrap();
    let whole = solve(&input);
    for i in 0..3 {
        let ratio = centre_sigma(&again, 0) / centre_sigma(&whole, 0);
        assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
        let off = (again.cameras[0].camera.centre() - whole.cameras[0].camera.centre())[i].abs();
        assert!(off < 0.3 * whole.cameras[0].covariance[(8 + i, 8 + i)].sqrt(), "{off}");
    }
    // Priors of infinite width add no degrees of freedom.
    let known = survey(CameraSetup::known(far(), Prior::free(11)), 100, 7);
    let free = CameraSetup { aspect_sigma: f64::INFINITY, skew_sigma: f64::INFINITY, ..CameraSetup::new(800, 600) };
    let free = survey(free, 100, 7);
    let rows = |a: &Adjusted| 2 * a.head_inliers.iter().chain(&a.cameras[0].inliers).filter(|i| **i).count();
    for a in [known, free] {
        assert_eq!(a.check.freedom, rows(&a) - 100 - 11);
    }
}

#[test]
fn without_outlier_handling_a_shot_behind_the_camera_is_named() {
    let mut input = single(rig(), &rig(), &near(), 60, &Noisy::new(0.3, 9));
    // Seen by a camera that looks the other way, whose pose is known.
    let mut backwards = near();
    backwards.pose.rotation = rigid::rotation_y(std::f64::consts::PI) * backwards.pose.rotation;
    let mut sigmas = [0.0; 11];
    sigmas[0] = 1.0;
    let setup = CameraSetup { prior: Some((backwards, Prior::of_sigmas(&sigmas))), ..CameraSetup::new(800, 600) };
    let camera = input.add_camera(setup).unwrap();
    let mut shot = input.shots()[0].clone();
    shot.sightings = vec![Sighting { camera, ..shot.sightings[0] }];
    let index = input.add_shot(shot).unwrap();
    let e = adjust(&input, &AdjustOptions { robust: false, ..AdjustOptions::default() }).unwrap_err();
    assert_eq!(e, Error::BehindCamera { index });
    let e = adjust(&input, &AdjustOptions::default()).unwrap_err();
    assert_eq!((e.status(), e.index()), (Status::NoConsensus, Some(1)), "{e}");
}
