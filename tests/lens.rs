//! Calibration with lens distortion: the linear methods by name, strong and fisheye lenses with
//! outliers, refusals. `make accuracy` holds the same methods against the Cramer-Rao bound.

#[path = "support/thesis.rs"]
mod thesis;

use nalgebra::{Matrix2, Vector2, Vector3};
use ptzcal::Error;
use ptzcal::calibrate::division_eigenproblem::division_eigenproblem;
use ptzcal::calibrate::radial_alignment::radial_alignment;
use ptzcal::calibrate::{CalibrationOptions, Correspondences, DistortionModel, Observation, calibrate_camera};
use ptzcal::error::Degeneracy;
use ptzcal::geometry::{Camera, Distortion, Intrinsics, Rigid};
use thesis::{Noise, laser_set, near, point_set, world};

/// NEAR with square pixels and lambda (px^-2) that is `lambda` at a radius of 500 px.
fn near_with(lambda: f64) -> (Camera, f64) {
    let intrinsics = Intrinsics { fx: 845.0, fy: 845.0, ..near().intrinsics };
    let of_pixels = lambda / 250_000.0;
    (Camera { intrinsics, distortion: Distortion::Division(of_pixels * 845.0 * 845.0), ..near() }, of_pixels)
}

/// A dome camera that looks down, and points around it up to `widest` from its axis.
fn dome(widest: f64, n: usize) -> (Camera, Vec<Vector3<f64>>) {
    let camera = Camera {
        width: 1000,
        height: 1000,
        intrinsics: Intrinsics::new(290.0, 503.0, 495.0),
        distortion: Distortion::Fisheye([0.03, 0.004, -0.0005, 0.0001]),
        pose: Rigid::look_at(&Vector3::new(0.2, -2.5, 0.1), &Vector3::new(0.3, 0.0, 0.4)).unwrap(),
    };
    let mut noise = Noise::new(17);
    let point = |_| {
        let (theta, azimuth) = (widest * noise.uniform().sqrt(), std::f64::consts::TAU * noise.uniform());
        let ray = Vector3::new(theta.sin() * azimuth.cos(), theta.sin() * azimuth.sin(), theta.cos());
        camera.pose.inverse().apply(&(ray * (1.0 + 4.0 * noise.uniform())))
    };
    (camera, (0..n).map(point).collect())
}

fn seen(camera: &Camera, points: &[Vector3<f64>], sigma: f64, noise: &mut Noise) -> Correspondences {
    let mut set = Correspondences::new(camera.width, camera.height).unwrap();
    let pixels: Vec<_> = points.iter().map(|x| camera.project(x).unwrap() + noise.pixel(sigma)).collect();
    set.add_points(points, &pixels).unwrap();
    set
}

fn with(distortion: DistortionModel) -> CalibrationOptions {
    CalibrationOptions { distortion, ..Default::default() }
}

fn degeneracy(e: Error) -> Degeneracy {
    match e {
        Error::Degenerate { kind, .. } => kind,
        other => panic!("{other:?}"),
    }
}

#[test]
fn linear_methods_are_exact_on_exact_points() {
    for lambda in [-0.15, -0.02, 0.05] {
        let (truth, of_pixels) = near_with(lambda);
        let centre = Some(Vector2::new(truth.intrinsics.cx, truth.intrinsics.cy));
        let set = point_set(&world(&truth, 60), 0.0, &mut Noise::new(1));
        for found in [radial_alignment(&set, centre).unwrap(), division_eigenproblem(&set, centre).unwrap()] {
            assert!((found.lambda / of_pixels - 1.0).abs() < 1e-5, "{lambda}: {}", found.lambda / of_pixels);
            let camera = found.camera().unwrap();
            assert!((camera.centre() - truth.centre()).norm() < 1e-5);
            assert!((camera.intrinsics.fx - 845.0).abs() < 1e-2 && (camera.intrinsics.cy - 285.53).abs() < 1e-2);
            let image = truth.project(&Vector3::new(0.4, 0.3, 2.0)).unwrap();
            assert!((camera.project(&Vector3::new(0.4, 0.3, 2.0)).unwrap() - image).norm() < 1e-2);
        }
    }
}

#[test]
fn radial_alignment_needs_no_distortion_and_takes_laser_shots() {
    // Bounds of lambda_n for exact points, make accuracy: 1e-4 at 0.2 px; shots add their depth noise.
    for lambda in [0.0, -0.08] {
        let (truth, of_pixels) = near_with(lambda);
        let centre = Some(Vector2::new(truth.intrinsics.cx, truth.intrinsics.cy));
        let shots = world(&truth, 2021);
        let found = radial_alignment(&laser_set(&shots, 0.2, 0.2, &mut Noise::new(2)), centre).unwrap();
        assert!((found.lambda - of_pixels).abs() * 250_000.0 < 1e-3, "{}", found.lambda * 250_000.0);
        assert!((found.camera().unwrap().centre() - truth.centre()).norm() < 2e-3);
    }
}

#[test]
fn linear_methods_refuse_what_does_not_determine_a_camera() {
    let (truth, _) = near_with(-0.1);
    let shots = world(&truth, 60);
    let set = |n: usize| point_set(&shots[..n], 0.1, &mut Noise::new(2));
    let few = |given, needed| Error::TooFewPoints { given, needed };
    assert_eq!(radial_alignment(&set(6), None).unwrap_err(), few(6, 7));
    assert_eq!(division_eigenproblem(&set(5), None).unwrap_err(), few(5, 6));
    let nowhere = Some(Vector2::new(400.0, f64::INFINITY));
    let wrong = Error::NotFinite { name: "centre", index: 1 };
    assert_eq!(radial_alignment(&set(60), nowhere).unwrap_err(), wrong);
    assert_eq!(division_eigenproblem(&set(60), nowhere).unwrap_err(), wrong);
    let mut same = Correspondences::new(800, 600).unwrap();
    same.add_points(&[shots[0].point; 20], &[shots[0].fixed; 20]).unwrap();
    assert_eq!(degeneracy(radial_alignment(&same, None).unwrap_err()), Degeneracy::IllConditioned);
    assert_eq!(degeneracy(division_eigenproblem(&same, None).unwrap_err()), Degeneracy::Coincident);
    // Points behind the camera that the pixels pretend to see: mirrored.
    let (world, pixels): (Vec<_>, Vec<_>) =
        shots.iter().map(|s| (s.point.component_mul(&Vector3::new(-1.0, 1.0, 1.0)), s.fixed)).unzip();
    let mut mirrored = Correspondences::new(800, 600).unwrap();
    mirrored.add_points(&world, &pixels).unwrap();
    assert_eq!(degeneracy(radial_alignment(&mirrored, None).unwrap_err()), Degeneracy::IllConditioned);
}

#[test]
fn the_eigenproblem_says_what_its_eigenvalues_lack() {
    // Without distortion lambda is arbitrary: some noise leaves no usable eigenvalue, and says so.
    let (truth, _) = near_with(0.0);
    let shots = world(&truth, 100);
    let refusals = (0..40)
        .filter_map(|run| division_eigenproblem(&point_set(&shots, 1.0, &mut Noise::new(run)), None).err())
        .map(|e| assert!(e.to_string().contains("eigenv"), "{e}"))
        .count();
    assert!((1..40).contains(&refusals), "{refusals} of 40");
}

#[test]
fn strong_lenses_with_outliers_are_recovered() {
    let (truth, _) = near_with(-0.15);
    let shots = world(&truth, 400);
    for (model, run) in [DistortionModel::Division, DistortionModel::Radial2, DistortionModel::BrownConrady]
        .into_iter()
        .flat_map(|model| (0..5).map(move |run| (model, run)))
    {
        let mut noise = Noise::new(run);
        let mut set = laser_set(&shots, 0.2, 0.2, &mut noise);
        // 30 % of the whole are seen somewhere else.
        for s in &shots[..171] {
            let shot = thesis::rig().measure(s.pan, s.tilt, &s.head, &(Matrix2::identity() * 0.04)).unwrap().point;
            let pixel = Vector2::new(noise.uniform() * 800.0, noise.uniform() * 600.0);
            set.add(Observation::Shot { shot, pixel, pixel_covariance: Matrix2::identity() * 0.04 }).unwrap();
        }
        let c = calibrate_camera(&set, &with(model)).unwrap();
        assert!((c.camera.centre() - truth.centre()).norm() < 4e-3, "{model:?} {run}");
        assert!((c.camera.intrinsics.fx - 845.0).abs() < 2.0, "{model:?} {run}: {}", c.camera.intrinsics.fx);
        assert!(c.inliers[..400].iter().filter(|i| !**i).count() < 20, "{model:?} {run}");
        assert!(c.inliers[400..].iter().filter(|i| **i).count() <= 3, "{model:?} {run}");
    }
}

#[test]
fn a_dome_camera_is_calibrated_beyond_90_degrees() {
    let (truth, points) = dome(1.68, 400);
    let beyond = points.iter().filter(|x| truth.pose.apply(x).z < 0.0).count();
    assert!(beyond > 20, "{beyond} points behind the image plane");
    let c = calibrate_camera(&seen(&truth, &points, 0.0, &mut Noise::new(1)), &with(DistortionModel::Fisheye)).unwrap();
    assert!((c.camera.centre() - truth.centre()).norm() < 1e-7);
    for (k, k0) in c.camera.distortion.coefficients().iter().zip(truth.distortion.coefficients()) {
        assert!((k - k0).abs() < 1e-6);
    }
    // With noise and 30 % outliers, its lens free and known.
    let known = CalibrationOptions { fixed_lens: Some((truth.intrinsics, truth.distortion)), ..Default::default() };
    for options in [with(DistortionModel::Fisheye), known] {
        let mut noise = Noise::new(3);
        let mut set = seen(&truth, &points, 0.3, &mut noise);
        for x in &points[..171] {
            set.add_points(&[*x], &[Vector2::new(noise.uniform() * 1000.0, noise.uniform() * 1000.0)]).unwrap();
        }
        let c = calibrate_camera(&set, &options).unwrap();
        assert!((c.camera.centre() - truth.centre()).norm() < 5e-3);
        assert!(c.inliers[..400].iter().filter(|i| !**i).count() < 10);
        assert!(c.inliers[400..].iter().filter(|i| **i).count() <= 3);
        assert!((c.noise_factor - 0.3).abs() < 0.03, "{}", c.noise_factor);
    }
}

#[test]
fn a_lens_that_folds_back_inside_the_image_is_refused() {
    // True lenses that fold between the points, which lie in the middle, and the corners.
    for (lens, reach, model) in [
        (Distortion::BrownConrady([-0.7, 0.0, 0.0, 0.0, 0.0]), 0.4, DistortionModel::Radial1),
        (Distortion::BrownConrady([-0.6, -0.3, 0.0, 0.0, 0.0]), 0.4, DistortionModel::Radial2),
        (Distortion::BrownConrady([-0.7, 0.0, 0.001, 0.0, 0.0]), 0.4, DistortionModel::BrownConrady),
        (Distortion::Division(-5.0), 0.4, DistortionModel::Division),
        (Distortion::Division(4.0), 0.2, DistortionModel::Division),
        // Four coefficients follow the lens only as far as they see it.
        (Distortion::Fisheye([-0.9, 0.0, 0.0, 0.0]), 0.68, DistortionModel::Fisheye),
    ] {
        let truth = Camera { distortion: lens, ..near() };
        let mut noise = Noise::new(4);
        let mut points = Vec::new();
        while points.len() < 300 {
            let ideal = Vector3::new(2.0 * noise.uniform() - 1.0, 2.0 * noise.uniform() - 1.0, 1.0);
            if ideal.xy().norm() < reach {
                points.push(truth.pose.inverse().apply(&(ideal * (1.0 + 4.0 * noise.uniform()))));
            }
        }
        let e = calibrate_camera(&seen(&truth, &points, 0.02, &mut noise), &with(model)).unwrap_err();
        assert!(matches!(e, Error::LensNotMonotone { .. }), "{model:?}: {e}");
    }
}

#[test]
fn a_handful_of_points_is_not_trimmed_until_it_fits() {
    // Twelve good points have twelve unknowns' worth of freedom to spare: leaving out four or five of
    // them would make the rest fit to nothing.
    for seed in 0..100 {
        let (truth, _) = near_with(-0.1);
        let shots = world(&truth, 2021);
        let mut noise = Noise::new(seed);
        let chosen: Vec<_> = (0..12).map(|_| shots[(noise.uniform() * 2021.0) as usize % shots.len()]).collect();
        let Ok(c) = calibrate_camera(&point_set(&chosen, 0.5, &mut noise), &with(DistortionModel::Division)) else {
            continue;
        };
        let used = c.inliers.iter().filter(|i| **i).count();
        assert!(used >= 9, "{seed}: {used} of 12");
    }
}
