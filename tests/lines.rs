//! Calibration from lines, alone and together with points, against simulated truth; its refusals.

#[path = "support/edges.rs"]
mod edges;
#[path = "support/thesis.rs"]
mod thesis;

use edges::{edges, line_set, observed};
use nalgebra::{Matrix2, Matrix3, Matrix6, Vector2, Vector3};
use ptzcal::Error;
use ptzcal::calibrate::{
    CalibrationOptions, Correspondences, DistortionModel, Observation, ObservedLine, calibrate_camera, decompose, dlt,
};
use ptzcal::error::Degeneracy;
use ptzcal::geometry::{Camera, Distortion, Intrinsics, Line3, Rigid};
use thesis::{Noise, far, near, point_set, world};

fn free() -> CalibrationOptions {
    CalibrationOptions { skew_sigma: f64::INFINITY, aspect_sigma: f64::INFINITY, ..Default::default() }
}

fn centre_error(camera: &Camera, truth: &Camera) -> f64 {
    (camera.centre() - truth.centre()).norm()
}

#[test]
fn dlt_lines_is_exact_on_exact_data() {
    for truth in [near(), far()] {
        for n in [12, 60] {
            let seen = edges(&truth, n);
            let lines: Vec<Line3> =
                seen.iter().map(|e| Line3::new(e.ends[0], e.ends[1] - e.ends[0]).unwrap()).collect();
            let segments: Vec<_> = seen.iter().map(|e| e.pixels).collect();
            let p = dlt::lines(&lines, &segments).unwrap();
            let (k, pose) = decompose::decompose(&p).unwrap();
            assert!((k.fx - 845.19).abs() < 1e-6 && (k.cy - 285.53).abs() < 1e-6, "{n} {k:?}");
            assert!((pose.centre() - truth.centre()).norm() < 1e-8);
        }
    }
}

#[test]
fn exact_lines_give_the_exact_camera() {
    for truth in [near(), far()] {
        for n in [12, 40, 300] {
            let set = line_set(&edges(&truth, n), 0.0, false, &mut Noise::new(1));
            let c = calibrate_camera(&set, &free()).unwrap();
            assert!(centre_error(&c.camera, &truth) < 1e-7, "{n}: {}", centre_error(&c.camera, &truth));
            assert!((c.camera.intrinsics.fx - 845.19).abs() < 1e-5);
            assert!(c.inliers.iter().all(|i| *i));
            assert!(c.rms < 1e-6);
        }
    }
}

#[test]
fn exact_lines_through_a_lens_give_the_exact_camera() {
    for (lens, model) in [
        (Distortion::BrownConrady([-0.28, 0.09, 0.001, -0.0005, 0.0]), DistortionModel::BrownConrady),
        (Distortion::Division(-0.22), DistortionModel::Division),
    ] {
        for truth in [near(), far()].map(|c| Camera { distortion: lens, ..c }) {
            let set = line_set(&edges(&truth, 200), 0.0, false, &mut Noise::new(1));
            let c = calibrate_camera(&set, &CalibrationOptions { distortion: model, ..free() }).unwrap();
            assert!(centre_error(&c.camera, &truth) < 1e-6, "{model:?} {}", centre_error(&c.camera, &truth));
            assert!(c.rms < 1e-5, "{model:?} {}", c.rms);
        }
    }
}

#[test]
fn lines_through_a_fisheye_lens_are_used_beyond_ninety_degrees() {
    let truth = Camera {
        width: 1000,
        height: 1000,
        intrinsics: Intrinsics::new(290.0, 503.0, 495.0),
        distortion: Distortion::Fisheye([0.03, 0.004, -0.0005, 0.0001]),
        pose: Rigid::look_at(&Vector3::new(0.2, -2.5, 0.1), &Vector3::new(0.3, 0.0, 0.4)).unwrap(),
    };
    let options = CalibrationOptions { distortion: DistortionModel::Fisheye, ..Default::default() };
    let mut error = Vec::new();
    for with_lines in [false, true] {
        let mut noise = Noise::new(21);
        let mut set = Correspondences::new(1000, 1000).unwrap();
        let point = |noise: &mut Noise| {
            let (theta, azimuth) = (1.65 * noise.uniform().sqrt(), std::f64::consts::TAU * noise.uniform());
            let ray = Vector3::new(theta.sin() * azimuth.cos(), theta.sin() * azimuth.sin(), theta.cos());
            truth.pose.inverse().apply(&(ray * (1.0 + 4.0 * noise.uniform())))
        };
        for _ in 0..100 {
            let x = point(&mut noise);
            set.add_points(&[x], &[truth.project(&x).unwrap() + noise.pixel(0.2)]).unwrap();
        }
        for _ in 0..if with_lines { 200 } else { 0 } {
            let a = point(&mut noise);
            let b = a + Vector3::new(noise.gaussian(), noise.gaussian(), noise.gaussian()) * 0.4;
            if let [Some(p), Some(q)] = [a, b].map(|x| truth.project(&x)) {
                let ends = [p, q].map(|m| m + noise.pixel(0.2));
                set.add(ObservedLine::through([a + (a - b), b], None, ends).into()).unwrap();
            }
        }
        let c = calibrate_camera(&set, &options).unwrap();
        let lines = c.inliers.len() - 100;
        assert!(c.inliers[100..].iter().filter(|i| !**i).count() * 50 <= lines, "all but 2 % of the lines");
        assert!((c.noise_factor - 0.2).abs() < 0.02, "{}", c.noise_factor);
        for i in 0..3 {
            let sigma = c.covariance[(12 + i, 12 + i)].sqrt();
            let off = (c.camera.centre() - truth.centre())[i];
            assert!(off.abs() < 4.0 * sigma, "{with_lines}: {off} against {sigma}");
        }
        error.push((12..15).map(|i| c.covariance[(i, i)]).sum::<f64>());
    }
    assert!(error[1] < 0.6 * error[0], "the lines help: {error:?}");
}

/// Every kind of line data in one set: half exact points, half lines.
fn mixture(truth: &Camera, n: usize, sigma: f64, seed: u64) -> Correspondences {
    let noise = &mut Noise::new(seed);
    let mut set = point_set(&world(truth, n / 2), sigma, noise);
    set.add_all(edges(truth, n - n / 2).iter().map(|e| observed(e, noise, sigma, false).into())).unwrap();
    set
}

#[test]
fn wrong_lines_and_points_are_set_aside() {
    let truth = near();
    for (n, lines_only) in [(200, true), (200, false), (60, false)] {
        for seed in 0..10 {
            let mut noise = Noise::new(500 + seed);
            let good = if lines_only {
                line_set(&edges(&truth, n), 0.5, false, &mut noise)
            } else {
                mixture(&truth, n, 0.5, seed)
            };
            let mut set = Correspondences::new(800, 600).unwrap();
            let mut bad = Vec::new();
            for o in good.observations() {
                let wrong = noise.uniform() < 0.3;
                let mut random = || Vector2::new(noise.uniform() * 800.0, noise.uniform() * 600.0);
                bad.push(wrong);
                set.add(match o.clone() {
                    Observation::Line(line) if wrong => ObservedLine { ends: [random(), random()], ..*line }.into(),
                    Observation::Point { world, .. } if wrong => {
                        Observation::Point { world, world_covariance: None, pixel: random(), pixel_covariance: None }
                    }
                    o => o,
                })
                .unwrap();
            }
            let c = calibrate_camera(&set, &CalibrationOptions::default()).unwrap();
            let error = centre_error(&c.camera, &truth);
            assert!(error < 10e-3 * (200.0 / n as f64).sqrt(), "{n} {lines_only} {seed}: {error}");
            // A random segment or pixel may lie right; a few do.
            let taken = c.inliers.iter().zip(&bad).filter(|(inlier, bad)| **inlier && **bad).count();
            let lost = c.inliers.iter().zip(&bad).filter(|(inlier, bad)| !**inlier && !**bad).count();
            assert!(taken <= 1 && lost <= 2, "{n} {lines_only} {seed}: {taken} wrong used, {lost} good lost");
            assert!((c.noise_factor - 0.5).abs() < 0.2, "{}", c.noise_factor);
        }
    }
}

#[test]
fn residuals_are_signed_distances_of_the_ends() {
    let truth = near();
    let seen = edges(&truth, 60);
    let mut set = line_set(&seen, 0.0, false, &mut Noise::new(1));
    // The right of the way from the first end to the second: (dx, dy) -> (-dy, dx) with y down.
    let e = seen[0];
    let along = (e.pixels[1] - e.pixels[0]).normalize();
    let right = Vector2::new(-along.y, along.x);
    let ends = [e.pixels[0] + right * 3.0 - along * 20.0, e.pixels[1] - right * 2.0 + along * 5.0];
    set.add(ObservedLine::through(e.ends, None, ends).into()).unwrap();
    let c = calibrate_camera(&set, &free()).unwrap();
    let r = c.residuals[60];
    assert!(!c.inliers[60] && c.inliers[..60].iter().all(|i| *i));
    assert!((r - Vector2::new(3.0, -2.0)).norm() < 1e-6, "{r}");
}

#[test]
fn covariance_of_lines_is_honest() {
    // Noisy segments and noisy lines, whose noise is stated; sqrt(NEES / 11) over runs.
    let truth = far();
    let seen = edges(&truth, 100);
    let (mut sum, mut chi2, runs) = (0.0, 0.0, 150);
    for run in 0..runs {
        let mut noise = Noise::new(run);
        let mut set = Correspondences::new(800, 600).unwrap();
        for (i, e) in seen.iter().enumerate() {
            // Points measured to 2 mm, some far better along one axis.
            let deviations = [2e-3, 1e-3, if i % 2 == 0 { 2e-3 } else { 1e-5 }];
            let covariance = Matrix3::from_diagonal(&Vector3::from(deviations.map(|s| s * s)));
            let points = e.ends.map(|x| x + Vector3::from(deviations.map(|s| s * noise.gaussian())));
            let line = ObservedLine::through(points, Some([covariance; 2]), e.pixels.map(|m| m + noise.pixel(0.3)));
            let end_covariances = Some([Matrix2::identity() * 0.09; 2]);
            set.add(ObservedLine { end_covariances, ..line }.into()).unwrap();
        }
        let c = calibrate_camera(&set, &CalibrationOptions { robust: false, ..free() }).unwrap();
        chi2 += c.noise_factor.powi(2);
        let (k, k0) = (c.camera.intrinsics.to_array(), truth.intrinsics.to_array());
        let turn = ptzcal::geometry::rigid::log(&(c.camera.pose.rotation * truth.pose.rotation.transpose()));
        let off = c.camera.centre() - truth.centre();
        let e: Vec<f64> = (0..5).map(|i| k[i] - k0[i]).chain(turn.iter().copied()).chain(off.iter().copied()).collect();
        let scale: Vec<f64> = (0..11).map(|i| 1.0 / c.covariance[(i, i)].sqrt()).collect();
        let scaled = nalgebra::DMatrix::from_fn(11, 11, |i, j| c.covariance[(i, j)] * scale[i] * scale[j]);
        let z = nalgebra::DVector::from_fn(11, |i, _| e[i] * scale[i]);
        sum += z.dot(&nalgebra::Cholesky::new(scaled).unwrap().solve(&z));
    }
    let (ratio, factor) = ((sum / (11 * runs) as f64).sqrt(), (chi2 / runs as f64).sqrt());
    // 150 runs of 11 parameters: a scatter of 1.7 %.
    assert!((0.93..1.07).contains(&ratio), "{ratio}");
    assert!((0.97..1.03).contains(&factor), "{factor}");
}

#[test]
fn the_line_and_its_segment_have_no_direction_and_no_ends() {
    // Other points and directions of the same lines, ends swapped: the same camera.
    let truth = far();
    let seen = edges(&truth, 80);
    let set = line_set(&seen, 0.3, false, &mut Noise::new(3));
    let mut other = Correspondences::new(800, 600).unwrap();
    for o in set.observations() {
        let Observation::Line(line) = o else { unreachable!() };
        let [a, b] = line.ends;
        let point = line.point + line.direction * 40.0;
        other.add(ObservedLine::new(point, line.direction * -1e3, [b, a]).into()).unwrap();
    }
    let [a, b] = [&set, &other].map(|s| calibrate_camera(s, &CalibrationOptions::default()).unwrap());
    assert!((a.camera.centre() - b.camera.centre()).norm() < 1e-8);
    assert!((a.camera.intrinsics.fx - b.camera.intrinsics.fx).abs() < 1e-6);
    for (r, s) in a.residuals.iter().zip(&b.residuals) {
        assert!((r + Vector2::new(s.y, s.x)).norm() < 1e-6, "turned round, the distances change sign and place");
    }
}

#[test]
fn lines_that_reach_to_their_vanishing_point_and_beyond_are_used() {
    // Edges of a long corridor along the view: the far ends are noise away from the vanishing point,
    // on either side of it.
    let truth = near();
    let mut noise = Noise::new(2);
    let mut set = line_set(&edges(&truth, 60), 0.3, false, &mut noise);
    let ahead = truth.pose.rotation.row(2).transpose();
    let vanishing = truth.project(&(truth.centre() + ahead * 1e9)).unwrap();
    for i in 0..20 {
        let angle = i as f64 * std::f64::consts::TAU / 20.0;
        let across = truth.pose.rotation.transpose() * Vector3::new(angle.cos(), angle.sin(), 0.0);
        let point = truth.centre() + across * 1.5;
        let near_end = truth.project(&(point + ahead * 5.0)).unwrap();
        let ends = [near_end + noise.pixel(0.3), vanishing + noise.pixel(0.3)];
        set.add(ObservedLine::new(point, ahead, ends).into()).unwrap();
    }
    let c = calibrate_camera(&set, &CalibrationOptions::default()).unwrap();
    assert!(c.inliers[60..].iter().filter(|i| **i).count() >= 19);
    assert!(centre_error(&c.camera, &truth) < 5e-3);
    // Seen on the other side of the vanishing point only: nothing in front of the camera is there.
    let e = edges(&truth, 1)[0];
    let behind = truth.centre() + ahead * -3.0 + truth.pose.rotation.transpose() * Vector3::new(0.5, 0.2, 0.0);
    let side = truth.pose.rotation.transpose() * Vector3::x();
    let mirrored = [-1.0, 1.0].map(|s| truth.project(&(truth.centre() * 2.0 - behind - side * s)).unwrap());
    set.add(ObservedLine::new(behind, side, mirrored).into()).unwrap();
    set.add(ObservedLine::new(truth.centre(), ahead, e.pixels).into()).unwrap();
    let c = calibrate_camera(&set, &CalibrationOptions::default()).unwrap();
    assert!(!c.inliers[80] && c.residuals[80].x.is_infinite(), "behind the camera");
    assert!(!c.inliers[81], "through the camera's centre");
}

#[test]
fn known_lens_finds_the_pose_from_six_lines() {
    let truth = Camera { distortion: Distortion::BrownConrady([-0.2, 0.05, 0.001, 0.0, 0.0]), ..far() };
    let options = CalibrationOptions { fixed_lens: Some((truth.intrinsics, truth.distortion)), ..Default::default() };
    for n in [6, 7, 30] {
        let c = calibrate_camera(&line_set(&edges(&truth, n), 0.0, false, &mut Noise::new(4)), &options).unwrap();
        assert!(centre_error(&c.camera, &truth) < 1e-6, "{n}: {}", centre_error(&c.camera, &truth));
        let c = calibrate_camera(&mixture(&truth, n, 0.02, 9), &options).unwrap();
        assert!(centre_error(&c.camera, &truth) < 20e-3, "{n}: {}", centre_error(&c.camera, &truth));
        assert_eq!(c.camera.intrinsics, truth.intrinsics);
    }
    let five = line_set(&edges(&truth, 5), 0.0, false, &mut Noise::new(4));
    assert_eq!(calibrate_camera(&five, &options).unwrap_err(), Error::TooFewPoints { given: 5, needed: 6 });
}

fn refusal(lines: &[[Vector3<f64>; 2]], truth: &Camera, sigma: f64) -> Degeneracy {
    let mut noise = Noise::new(4);
    let mut set = Correspondences::new(800, 600).unwrap();
    for ends in lines {
        let pixels = ends.map(|x| truth.project(&x).unwrap() + noise.pixel(sigma));
        set.add(ObservedLine::through(*ends, None, pixels).into()).unwrap();
    }
    match calibrate_camera(&set, &CalibrationOptions::default()).unwrap_err() {
        Error::Degenerate { kind, .. } => kind,
        other => panic!("{other:?}"),
    }
}

#[test]
fn degenerate_lines_are_refused_with_the_reason() {
    let truth = near();
    let mut noise = Noise::new(12);
    let mut random = || Vector3::new(noise.uniform() - 0.6, 0.8 * noise.uniform() - 0.4, 2.0 + 1.5 * noise.uniform());
    let pairs: Vec<_> = (0..40).map(|_| [random(), random()]).collect();
    for sigma in [0.0, 0.3] {
        let along = Vector3::new(0.3, 0.1, 0.2);
        let parallel: Vec<_> = pairs.iter().map(|[a, _]| [*a, a + along]).collect();
        assert_eq!(refusal(&parallel, &truth, sigma), Degeneracy::Parallel);
        let corner = Vector3::new(0.1, 0.2, 2.7);
        let concurrent: Vec<_> = pairs.iter().map(|[a, _]| [*a, corner + (corner - a) * 0.2]).collect();
        assert_eq!(refusal(&concurrent, &truth, sigma), Degeneracy::Concurrent);
        let wall = |x: &Vector3<f64>| Vector3::new(x.x, x.y, 2.5 + 0.3 * x.x);
        let coplanar: Vec<_> = pairs.iter().map(|p| p.map(|x| wall(&x))).collect();
        assert_eq!(refusal(&coplanar, &truth, sigma), Degeneracy::Coplanar);
        let one = vec![pairs[0]; 30];
        assert_eq!(refusal(&one, &truth, sigma), Degeneracy::Coincident);
    }
    // The linear method by itself refuses them too, on exact data.
    let along = Vector3::new(0.3, 0.1, 0.2);
    let line =
        |a: Vector3<f64>, b: Vector3<f64>| (Line3::new(a, b - a).unwrap(), [a, b].map(|x| truth.project(&x).unwrap()));
    let (lines, segments): (Vec<_>, Vec<_>) = pairs.iter().map(|[a, _]| line(*a, a + along)).unzip();
    assert!(matches!(dlt::lines(&lines, &segments), Err(Error::Degenerate { .. })));
    let (lines, segments): (Vec<_>, Vec<_>) = pairs.iter().map(|[a, b]| line(*a, *b)).unzip();
    assert!(dlt::lines(&lines, &segments).is_ok());
    assert_eq!(dlt::lines(&lines[..5], &segments[..5]), Err(Error::TooFewPoints { given: 5, needed: 6 }));
    assert!(dlt::lines(&lines, &segments[..20]).is_err());
    // Parallel lines with two points off them are enough.
    let mut set = Correspondences::new(800, 600).unwrap();
    for [a, b] in &pairs {
        set.add(ObservedLine::new(*a, along, [*a, a + along].map(|x| truth.project(&x).unwrap())).into()).unwrap();
        set.add_points(&[*b], &[truth.project(b).unwrap()]).unwrap();
    }
    assert!(centre_error(&calibrate_camera(&set, &free()).unwrap().camera, &truth) < 1e-6);
}

#[test]
fn what_is_no_line_is_refused() {
    let (a, b) = (Vector3::new(0.0, 0.0, 2.0), Vector3::new(1.0, 0.0, 2.0));
    let ends = [Vector2::new(100.0, 100.0), Vector2::new(200.0, 100.0)];
    let mut set = Correspondences::new(800, 600).unwrap();
    let mut add = |line: ObservedLine| set.add(line.into());
    assert!(add(ObservedLine::through([a, b], None, ends)).is_ok());
    let invalid = |r: Result<(), Error>, what: &str| match r {
        Err(Error::InvalidArgument { name, .. }) => assert_eq!(name, what),
        other => panic!("{other:?}"),
    };
    invalid(add(ObservedLine::through([a, a], None, ends)), "line");
    invalid(add(ObservedLine::new(a, Vector3::zeros(), ends)), "line");
    invalid(add(ObservedLine::through([a, b], None, [ends[0]; 2])), "uv");
    invalid(add(ObservedLine::new(a * 1e13, b, ends)), "line");
    let nan = Vector3::new(0.0, f64::NAN, 0.0);
    assert_eq!(add(ObservedLine::new(nan, b, ends)), Err(Error::NotFinite { name: "line", index: 1 }));
    assert_eq!(add(ObservedLine::new(a, nan, ends)), Err(Error::NotFinite { name: "line", index: 1 }));
    let lost = [ends[0], Vector2::new(f64::INFINITY, 0.0)];
    assert_eq!(add(ObservedLine::new(a, b, lost)), Err(Error::NotFinite { name: "uv", index: 1 }));
    let with = |covariance| ObservedLine { covariance: Some(covariance), ..ObservedLine::new(a, b, ends) };
    assert!(add(with(Matrix6::zeros())).is_ok(), "exact");
    invalid(add(with(Matrix6::identity() * -1.0)), "line covariance");
    assert!(matches!(add(with(Matrix6::identity() * f64::NAN)), Err(Error::NotFinite { .. })));
    let noisy = |c| ObservedLine { end_covariances: Some([Matrix2::identity(), c]), ..ObservedLine::new(a, b, ends) };
    invalid(add(noisy(Matrix2::zeros())), "uv covariance");
    invalid(add(noisy(Matrix2::new(1.0, 2.0, 2.0, 1.0))), "uv covariance");
    assert!(add(noisy(Matrix2::new(1.0, 0.5, 0.5, 1.0))).is_ok());
}

#[test]
fn small_mixtures_are_as_good_as_they_say() {
    // Minimal and small sets: answers agree with the truth as their own covariance says, or are refused.
    let truth = far();
    let mut answers = 0;
    for seed in 0..100 {
        let set = mixture(&truth, 8 + seed as usize % 30, 0.2, 1000 + seed);
        let options = CalibrationOptions { robust: false, pixel_sigma: Some(0.2), ..Default::default() };
        let Ok(c) = calibrate_camera(&set, &options) else { continue };
        answers += 1;
        for i in 0..3 {
            let sigma = c.covariance[(8 + i, 8 + i)].sqrt();
            let off = (c.camera.centre() - truth.centre())[i];
            assert!(off.abs() < 5.0 * sigma, "{seed}: {off} against {sigma}");
        }
    }
    assert!(answers > 80, "{answers}");
}
