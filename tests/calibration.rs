//! Calibration from 2D-3D sets against simulated truth, and its refusals.

#[path = "support/thesis.rs"]
mod thesis;

use nalgebra::{Matrix2, Vector2, Vector3};
use ptzcal::Error;
use ptzcal::calibrate::{CalibrationOptions, Correspondences, DistortionModel, Observation, calibrate_camera, dlt};
use ptzcal::error::Degeneracy;
use ptzcal::geometry::{Camera, Distortion, rigid};
use thesis::{Noise, far, laser_set, near, point_set, world};

fn free() -> CalibrationOptions {
    CalibrationOptions { skew_sigma: f64::INFINITY, aspect_sigma: f64::INFINITY, ..Default::default() }
}

fn centre_error(camera: &Camera, truth: &Camera) -> f64 {
    (camera.centre() - truth.centre()).norm()
}

#[test]
fn dlt_points_is_exact_on_exact_data() {
    for truth in [near(), far()] {
        let shots = world(&truth, 40);
        let points: Vec<_> = shots.iter().map(|s| s.point).collect();
        let pixels: Vec<_> = shots.iter().map(|s| s.fixed).collect();
        let p = dlt::points(&points, &pixels).unwrap();
        let (k, pose) = ptzcal::calibrate::decompose::decompose(&p).unwrap();
        assert!((k.fx - 845.19).abs() < 1e-6 && (k.cy - 285.53).abs() < 1e-6);
        assert!((pose.centre() - truth.centre()).norm() < 1e-9);
    }
}

#[test]
fn exact_data_give_the_exact_camera() {
    for truth in [near(), far()] {
        for n in [12, 40, 500] {
            let set = point_set(&world(&truth, n), 0.0, &mut Noise::new(1));
            let c = calibrate_camera(&set, &free()).unwrap();
            assert!(centre_error(&c.camera, &truth) < 1e-7, "{n}: {}", centre_error(&c.camera, &truth));
            assert!((c.camera.intrinsics.fx - 845.19).abs() < 1e-5);
            assert!(c.inliers.iter().all(|i| *i));
            assert!(c.rms < 1e-6);
        }
    }
}

#[test]
fn laser_shots_reach_the_bound() {
    // maths.md section 3: CRLB rms 0.139 mm (NEAR) and 1.21 mm (FAR) at 0.2 px, N = 2021.
    for (truth, bound) in [(near(), 0.139e-3), (far(), 1.21e-3)] {
        let shots = world(&truth, 2021);
        let (mut sum, runs) = (0.0, 20);
        for run in 0..runs {
            let set = laser_set(&shots, 0.2, 0.2, &mut Noise::new(run));
            let c = calibrate_camera(&set, &free()).unwrap();
            sum += centre_error(&c.camera, &truth).powi(2);
            assert!(c.inliers.iter().filter(|i| !**i).count() < 20);
            assert!((c.noise_factor - 1.0).abs() < 0.1, "{}", c.noise_factor);
        }
        let ratio = (sum / runs as f64).sqrt() / bound;
        assert!(ratio < 1.4, "rms {ratio} x the bound");
    }
}

#[test]
fn gross_outliers_are_set_aside() {
    let truth = near();
    for (fraction, n) in [(0.3, 2021), (0.4, 2021), (0.4, 100), (0.3, 30)] {
        for seed in 0..5 {
            let mut noise = Noise::new(100 + seed);
            let shots = world(&truth, n);
            let mut set = Correspondences::new(800, 600).unwrap();
            let mut bad = Vec::new();
            for s in &shots {
                let outlier = noise.uniform() < fraction;
                let pixel = if outlier {
                    Vector2::new(noise.uniform() * 800.0, noise.uniform() * 600.0)
                } else {
                    s.fixed + noise.pixel(0.5)
                };
                bad.push(outlier && (pixel - s.fixed).norm() > 10.0);
                set.add_points(&[s.point], &[pixel]).unwrap();
            }
            let c = calibrate_camera(&set, &CalibrationOptions::default()).unwrap();
            assert!(centre_error(&c.camera, &truth) < 10e-3 * (2021.0 / n as f64).sqrt(), "{fraction} {n} {seed}");
            assert!(c.inliers.iter().zip(&bad).all(|(inlier, bad)| !(*inlier && *bad)), "{fraction} {n} {seed}");
            assert!((c.noise_factor - 0.5).abs() < 0.2);
        }
    }
}

#[test]
fn distorted_cameras_with_outliers_are_recovered() {
    for (lens, model) in [
        (Distortion::BrownConrady([-0.28, 0.09, 0.001, -0.0005, 0.0]), DistortionModel::BrownConrady),
        (Distortion::BrownConrady([-0.2, 0.0, 0.0, 0.0, 0.0]), DistortionModel::Radial1),
        (Distortion::BrownConrady([-0.25, 0.08, 0.0, 0.0, 0.0]), DistortionModel::Radial2),
        (Distortion::Division(-0.22), DistortionModel::Division),
    ] {
        let truth = Camera { distortion: lens, ..near() };
        let shots = world(&truth, 1000);
        let mut noise = Noise::new(3);
        let mut set = laser_set(&shots, 0.2, 0.2, &mut noise);
        for (i, s) in shots.iter().enumerate().filter(|(i, _)| i % 4 == 0) {
            let rig = thesis::rig();
            let spot = s.head + Vector2::new(3.0 + (i % 7) as f64, 0.0);
            let shot = rig.measure(s.pan, s.tilt, &spot, &(Matrix2::identity() * 0.04)).unwrap().point;
            let pixel = s.fixed + Vector2::new(40.0, -25.0 + (i % 50) as f64);
            set.add(Observation::Shot { shot, pixel, pixel_covariance: Matrix2::identity() * 0.04 }).unwrap();
        }
        let options = CalibrationOptions { distortion: model, ..Default::default() };
        let c = calibrate_camera(&set, &options).unwrap();
        assert!(centre_error(&c.camera, &truth) < 2e-3, "{model:?} {}", centre_error(&c.camera, &truth));
        assert!((c.camera.intrinsics.fx - 845.19).abs() < 1.0, "{model:?} {}", c.camera.intrinsics.fx);
        assert!(c.inliers[1000..].iter().filter(|i| **i).count() <= 2, "{model:?}");
        assert!(c.inliers[..1000].iter().filter(|i| !**i).count() < 20, "{model:?}");
    }
}

#[test]
fn covariance_is_honest() {
    // sqrt(NEES / 11) over runs; make accuracy shows it for every set-up.
    let truth = near();
    let shots = world(&truth, 200);
    let (mut nees, runs) = (0.0, 200);
    for run in 0..runs {
        let set = point_set(&shots, 0.5, &mut Noise::new(run));
        let c =
            calibrate_camera(&set, &CalibrationOptions { pixel_sigma: Some(0.5), robust: false, ..free() }).unwrap();
        let k = c.camera.intrinsics.to_array();
        let k0 = truth.intrinsics.to_array();
        let turn = rigid::log(&(c.camera.pose.rotation * truth.pose.rotation.transpose()));
        let off = c.camera.centre() - truth.centre();
        let e = nalgebra::DVector::from_iterator(
            11,
            (0..5).map(|i| k[i] - k0[i]).chain(turn.iter().copied()).chain(off.iter().copied()),
        );
        let scale = nalgebra::DVector::from_fn(11, |i, _| 1.0 / c.covariance[(i, i)].sqrt());
        let scaled = nalgebra::DMatrix::from_fn(11, 11, |i, j| c.covariance[(i, j)] * scale[i] * scale[j]);
        let z = e.component_mul(&scale);
        nees += z.dot(&nalgebra::Cholesky::new(scaled).unwrap().solve(&z));
    }
    let ratio = (nees / (11 * runs) as f64).sqrt();
    assert!((0.93..1.07).contains(&ratio), "{ratio}");
}

#[test]
fn known_lens_finds_the_pose_from_a_plane_and_from_space() {
    let truth = Camera { distortion: Distortion::BrownConrady([-0.2, 0.05, 0.001, 0.0, 0.0]), ..far() };
    let options = CalibrationOptions { fixed_lens: Some((truth.intrinsics, truth.distortion)), ..Default::default() };
    let mut noise = Noise::new(8);
    let plane: Vec<Vector3<f64>> = (0..54)
        .map(|i| Vector3::new((i % 9) as f64 * 0.03, (i / 9) as f64 * 0.03, 2.5 + (i % 9) as f64 * 0.01))
        .collect();
    let space: Vec<Vector3<f64>> = world(&truth, 60).iter().map(|s| s.point).collect();
    for points in [&plane, &space, &plane[..4].iter().copied().chain([plane[50], plane[30]]).collect()] {
        let pixels: Vec<_> = points.iter().map(|x| truth.project(x).unwrap() + noise.pixel(0.02)).collect();
        let mut set = Correspondences::new(800, 600).unwrap();
        set.add_points(points, &pixels).unwrap();
        let c = calibrate_camera(&set, &options).unwrap();
        assert_eq!(c.camera.intrinsics, truth.intrinsics);
        assert!(centre_error(&c.camera, &truth) < 20e-3, "{}", centre_error(&c.camera, &truth));
        assert_eq!(c.covariance[(0, 0)], 0.0);
        assert!(c.covariance[(10, 10)] > 0.0);
    }
}

#[test]
fn a_pose_needs_four_points_in_a_plane_or_six_in_space() {
    let truth = near();
    let options = CalibrationOptions { fixed_lens: Some((truth.intrinsics, truth.distortion)), ..Default::default() };
    let shots = world(&truth, 5);
    let set = point_set(&shots, 0.0, &mut Noise::new(1));
    assert_eq!(calibrate_camera(&set, &options).unwrap_err(), Error::TooFewPoints { given: 5, needed: 6 });
    let square = [[-0.5, -0.4], [0.5, -0.4], [0.5, 0.4], [-0.5, 0.4]].map(|[x, y]| Vector3::new(x, y, 3.0 + 0.2 * x));
    let pixels = square.map(|x| truth.project(&x).unwrap());
    let mut set = Correspondences::new(800, 600).unwrap();
    set.add_points(&square, &pixels).unwrap();
    let c = calibrate_camera(&set, &options).unwrap();
    assert!(centre_error(&c.camera, &truth) < 1e-6);
}

fn kind(points: &[Vector3<f64>], truth: &Camera, sigma: f64) -> Error {
    let mut noise = Noise::new(4);
    let pixels: Vec<_> = points.iter().map(|x| truth.project(x).unwrap() + noise.pixel(sigma)).collect();
    let mut set = Correspondences::new(800, 600).unwrap();
    set.add_points(points, &pixels).unwrap();
    calibrate_camera(&set, &CalibrationOptions::default()).unwrap_err()
}

#[test]
fn degenerate_sets_are_refused_with_the_reason() {
    let truth = near();
    let grid = |f: &dyn Fn(f64, f64) -> Vector3<f64>| -> Vec<Vector3<f64>> {
        (0..100).map(|i| f((i % 10) as f64 / 9.0 - 0.5, (i / 10) as f64 / 9.0 - 0.5)).collect()
    };
    let wall = grid(&|a, b| Vector3::new(a * 1.5, b, 2.5 + 0.3 * a));
    let degenerate = |e: Error| match e {
        Error::Degenerate { kind, .. } => kind,
        other => panic!("{other:?}"),
    };
    for sigma in [0.0, 0.3] {
        assert_eq!(degenerate(kind(&wall, &truth, sigma)), Degeneracy::Coplanar);
        let line = grid(&|a, b| Vector3::new(a + 0.1 * b, 0.1, 2.5 + a + 0.1 * b));
        assert_eq!(degenerate(kind(&line, &truth, sigma)), Degeneracy::Collinear);
        assert_eq!(degenerate(kind(&[Vector3::new(0.1, 0.2, 3.0); 50], &truth, sigma)), Degeneracy::Coincident);
    }
    // A wall with a few points off it that are gross outliers is still a wall.
    let mut noise = Noise::new(9);
    let mut set = Correspondences::new(800, 600).unwrap();
    for (i, x) in wall.iter().enumerate() {
        let pixel = truth.project(x).unwrap() + noise.pixel(0.3);
        let world = if i % 50 == 7 { x + Vector3::new(0.3, 0.2, -0.8) } else { *x };
        set.add_points(&[world], &[pixel]).unwrap();
    }
    let e = calibrate_camera(&set, &CalibrationOptions::default()).unwrap_err();
    assert_eq!(degenerate(e), Degeneracy::Coplanar);
    // Relief of 5 mm at 2.5 m with 0.5 px of noise: the focal length is not determined.
    let mut rough = wall.clone();
    rough.iter_mut().for_each(|x| x.z += 5e-3 * noise.gaussian());
    assert_eq!(degenerate(kind(&rough, &truth, 0.5)), Degeneracy::NoRelief);
}

#[test]
fn too_few_points_and_nonsense_are_refused() {
    let truth = near();
    let shots = world(&truth, 60);
    let set = |n: usize| point_set(&shots[..n], 0.1, &mut Noise::new(2));
    assert_eq!(
        calibrate_camera(&set(5), &CalibrationOptions::default()).unwrap_err(),
        Error::TooFewPoints { given: 5, needed: 6 }
    );
    let brown = CalibrationOptions { distortion: DistortionModel::BrownConrady, ..Default::default() };
    assert_eq!(calibrate_camera(&set(7), &brown).unwrap_err(), Error::TooFewPoints { given: 7, needed: 8 });
    // Pixels that have nothing to do with the points.
    let mut noise = Noise::new(6);
    let mut random = Correspondences::new(800, 600).unwrap();
    for s in &shots {
        let pixel = Vector2::new(noise.uniform() * 800.0, noise.uniform() * 600.0);
        random.add_points(&[s.point], &[pixel]).unwrap();
    }
    assert!(calibrate_camera(&random, &CalibrationOptions::default()).is_err());
    // Points given in millimetres are fine: scale is the user's.
    let mut millimetres = Correspondences::new(800, 600).unwrap();
    for s in &shots {
        millimetres.add_points(&[s.point * 1000.0], &[s.fixed]).unwrap();
    }
    let c = calibrate_camera(&millimetres, &CalibrationOptions::default()).unwrap();
    assert!((c.camera.centre() * 1e-3 - truth.centre()).norm() < 1e-6);
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let set = laser_set(&world(&far(), 300), 0.5, 0.5, &mut Noise::new(1));
    let a = calibrate_camera(&set, &CalibrationOptions::default()).unwrap();
    let b = calibrate_camera(&set, &CalibrationOptions::default()).unwrap();
    assert_eq!(a.camera, b.camera);
    assert_eq!(a.covariance, b.covariance);
}

#[test]
fn cancelled_work_stops() {
    let set = point_set(&world(&near(), 100), 0.5, &mut Noise::new(1));
    let options = CalibrationOptions::default();
    options.cancel.cancel();
    assert_eq!(calibrate_camera(&set, &options).unwrap_err(), Error::Cancelled);
}

#[test]
fn the_self_check_names_what_was_left_out_and_nothing_else() {
    let truth = near();
    let shots = world(&truth, 300);
    let options = |distortion| CalibrationOptions { pixel_sigma: Some(0.3), distortion, ..Default::default() };
    // No false alarm: 200 checks at one in a thousand, several groups at 1e-5 each.
    let alarms = (0..200)
        .filter(|seed| {
            let set = laser_set(&shots, 0.3, 0.3, &mut Noise::new(*seed));
            !calibrate_camera(&set, &options(DistortionModel::None)).unwrap().check.passed()
        })
        .count();
    assert!(alarms <= 2, "{alarms} false alarms in 200");
    // A lens that was left out.
    let mut bent = truth;
    bent.distortion = Distortion::Division(-0.05);
    let shots = world(&bent, 300);
    let set = point_set(&shots, 0.3, &mut Noise::new(1));
    let without = calibrate_camera(&set, &options(DistortionModel::None)).unwrap().check;
    assert_eq!(without.suspects[0].group, "the lens distortion");
    let with = calibrate_camera(&set, &options(DistortionModel::Division)).unwrap();
    assert!(with.check.passed(), "{:?}", with.check);
    let gain = without.chi2 - with.check.chi2;
    assert!((without.suspects[0].gain / gain - 1.0).abs() < 0.3, "first order {} of {gain}", without.suspects[0].gain);
    // What is weakest has a name, and forced square pixels do not break it.
    let square = CalibrationOptions { aspect_sigma: 0.0, skew_sigma: 0.0, ..options(DistortionModel::Division) };
    for c in [with, calibrate_camera(&set, &square).unwrap()] {
        let weakest = c.weakest().unwrap();
        assert!(weakest.text.starts_with("weakest: camera ") && weakest.condition > 1.0, "{weakest:?}");
        assert!(!weakest.groups.is_empty() && weakest.prior_only.is_empty());
    }
}
