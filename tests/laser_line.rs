//! The laser's line from views of boards: truth, the bound, coverage, refusals.

#[path = "support/boards.rs"]
mod board;
#[path = "support/thesis.rs"]
mod thesis;

use board::{corners, grid, head, hit, poses, with_spots};
use nalgebra::{DMatrix, DVector, Vector2, Vector3};
use ptzcal::Error;
use ptzcal::calibrate::boards::BoardSpot;
use ptzcal::calibrate::laser_line::{least_squares, point_by_homography};
use ptzcal::calibrate::{
    Boards, CalibrationOptions, DistortionModel, LaserCalibration, calibrate_from_boards, calibrate_laser_line,
};
use ptzcal::error::Degeneracy;
use ptzcal::geometry::rig_model::LaserLine;
use ptzcal::geometry::{Camera, Distortion, Intrinsics, Rigid, rigid};
use thesis::{Noise, rig};

fn known(camera: &Camera) -> CalibrationOptions {
    CalibrationOptions { fixed_lens: Some((camera.intrinsics, camera.distortion)), ..Default::default() }
}

fn error(line: &LaserLine) -> [f64; 4] {
    let l = rig().laser;
    [line.x0 - l.x0, line.y0 - l.y0, line.vx - l.vx, line.vy - l.vy]
}

fn nees(e: &[f64], c: &DMatrix<f64>) -> f64 {
    let s: Vec<f64> = (0..e.len()).map(|i| c[(i, i)].sqrt()).collect();
    let scaled = DMatrix::from_fn(e.len(), e.len(), |i, j| c[(i, j)] / (s[i] * s[j]));
    let z = DVector::from_fn(e.len(), |i, _| e[i] / s[i]);
    z.dot(&scaled.cholesky().expect("positive definite").solve(&z))
}

#[test]
fn exact_views_give_the_exact_line_by_both_methods() {
    for lens in [Distortion::None, Distortion::BrownConrady([-0.2, 0.05, 0.001, -0.0005, 0.0])] {
        let camera = head(lens);
        let truths = poses(6, 1.0, 4.0);
        let boards = with_spots(&camera, &truths, 0.0, &mut Noise::new(0));
        let found = calibrate_laser_line(&boards, None, &known(&camera)).unwrap();
        assert!(error(&found.line).iter().all(|e| e.abs() < 1e-9), "{:?}", found.line);
        assert!(found.rms < 1e-6 && found.used.iter().all(|u| *u));
        let free = CalibrationOptions { distortion: DistortionModel::BrownConrady, ..Default::default() };
        let found = calibrate_laser_line(&boards, None, &free).unwrap();
        assert!(error(&found.line).iter().all(|e| e.abs() < 1e-7), "{:?}", found.line);
        let rig = found.rig_model();
        assert!((rig.intrinsics.fx - 800.0).abs() < 1e-4 && rig.validate().is_ok());
    }
    // The thesis's way, with four corners and with all.
    let camera = head(Distortion::None);
    for every in [1, 14] {
        let points: Vec<Vector3<f64>> = poses(6, 1.0, 4.0)
            .iter()
            .map(|pose| {
                let seen = corners(&camera, pose, &grid(15, 15, 0.03), 0.0, &mut Noise::new(0));
                let corner = |i: &usize| every == 1 || [0, 14, 210, 224].contains(i);
                let (b, p): (Vec<_>, Vec<_>) = (0..225).filter(corner).map(|i| (seen[i].board, seen[i].pixel)).unzip();
                point_by_homography(&b, &p, &camera.project(&hit(pose)).unwrap(), pose).unwrap()
            })
            .collect();
        assert!(error(&least_squares(&points).unwrap()).iter().all(|e| e.abs() < 1e-9));
    }
}

/// maths.md section 2: CRLB with K known, 25 boards, 0.5 px: 0.60 0.59 mm, 0.27 0.27 mrad; and the
/// covariance covers. `make accuracy` measures the ratio on many runs.
#[test]
fn the_line_is_on_the_bound_and_its_covariance_covers() {
    let camera = head(Distortion::None);
    let truths = poses(25, 1.0, 5.0);
    let runs = 40;
    let (mut squares, mut stated, mut covered) = ([0.0; 4], [0.0; 4], 0.0);
    for run in 0..runs {
        let boards = with_spots(&camera, &truths, 0.5, &mut Noise::new(run));
        let found = calibrate_laser_line(&boards, None, &known(&camera)).unwrap();
        let e = error(&found.line);
        let c = found.line_covariance();
        for i in 0..4 {
            squares[i] += e[i] * e[i] / runs as f64;
            stated[i] += c[(i, i)] / runs as f64;
        }
        covered += nees(&e, &DMatrix::from_fn(4, 4, |i, j| c[(i, j)])) / (4 * runs) as f64;
        assert!(found.used.iter().filter(|u| **u).count() >= 23);
    }
    for i in 0..4 {
        let (rms, sigma) = (squares[i].sqrt(), stated[i].sqrt());
        println!("{i}: rms {rms:.3e}, stated {sigma:.3e}");
        assert!(rms < 1.3 * sigma, "{i}: {rms} {sigma}");
        // The bound of the notes is of other random boards.
        assert!(sigma < 1.3 * if i < 2 { 0.60e-3 } else { 0.27e-3 }, "{i}: {sigma}");
    }
    println!("sqrt(NEES / 4) {}", covered.sqrt());
    assert!((0.85..1.15).contains(&covered.sqrt()), "{covered}");
}

fn joint_error(found: &LaserCalibration) -> Vec<f64> {
    let k = found.boards.calibration.camera.intrinsics.to_array();
    let k0 = rig().intrinsics.to_array();
    (0..5).map(|i| k[i] - k0[i]).chain(error(&found.line)).collect()
}

#[test]
fn the_joint_covariance_covers_lens_and_line() {
    let camera = head(Distortion::None);
    let truths = poses(12, 0.7, 3.0);
    let options = CalibrationOptions { skew_sigma: f64::INFINITY, aspect_sigma: f64::INFINITY, ..Default::default() };
    let (mut joint, mut seven, runs) = (0.0, 0.0, 100);
    for run in 0..runs {
        let boards = with_spots(&camera, &truths, 0.3, &mut Noise::new(run));
        let found = calibrate_laser_line(&boards, None, &options).unwrap();
        assert_eq!(found.covariance.nrows(), 9);
        let e = joint_error(&found);
        joint += nees(&e, &found.covariance) / (9 * runs) as f64;
        let k = found.boards.calibration.camera.intrinsics;
        let scale = 0.5 * ((k.fx / 800.0).ln() + (k.fy / 800.0).ln());
        let e7 = [e[5], e[6], e[7], e[8], scale, e[3], e[4]];
        let c = found.rig_covariance();
        seven += nees(&e7, &DMatrix::from_fn(7, 7, |i, j| c[(i, j)])) / (7 * runs) as f64;
    }
    println!("sqrt(NEES / p): {} {}", joint.sqrt(), seven.sqrt());
    assert!((0.9..1.1).contains(&joint.sqrt()) && (0.9..1.1).contains(&seven.sqrt()), "{joint} {seven}");
}

/// A lens measured elsewhere is a prior: between known and unknown, and its covariance covers too.
#[test]
fn a_measured_lens_is_a_prior() {
    let camera = head(Distortion::BrownConrady([-0.2, 0.05, 0.0, 0.0, 0.0]));
    let truths = poses(10, 1.0, 4.0);
    let options = CalibrationOptions { distortion: DistortionModel::Radial2, ..Default::default() };
    let (mut covered, runs) = (0.0, 60);
    for run in 0..runs {
        let mut noise = Noise::new(run);
        let other = with_spots(&camera, &poses(14, 0.6, 2.0), 0.3, &mut noise);
        let lens = calibrate_from_boards(&other, &options).unwrap().calibration;
        let boards = with_spots(&camera, &truths, 0.3, &mut noise);
        let found = calibrate_laser_line(&boards, Some(&lens), &options).unwrap();
        let alone = calibrate_laser_line(&boards, None, &options).unwrap();
        let exact = calibrate_laser_line(&boards, None, &known(&camera)).unwrap();
        let sigma = |f: &LaserCalibration| f.line_covariance()[(0, 0)].sqrt();
        assert!(sigma(&exact) < 1.05 * sigma(&found) && sigma(&found) < 1.05 * sigma(&alone), "run {run}");
        let c = found.line_covariance();
        covered += nees(&error(&found.line), &DMatrix::from_fn(4, 4, |i, j| c[(i, j)])) / (4 * runs) as f64;
    }
    println!("sqrt(NEES / 4) {}", covered.sqrt());
    assert!((0.85..1.15).contains(&covered.sqrt()), "{covered}");
    // Both kinds of a known lens at once.
    let boards = with_spots(&camera, &truths, 0.3, &mut Noise::new(0));
    let lens = calibrate_from_boards(&boards, &options).unwrap().calibration;
    assert!(matches!(calibrate_laser_line(&boards, Some(&lens), &known(&camera)), Err(Error::InvalidArgument { .. })));
}

#[test]
fn tied_focal_lengths_make_a_prior_too() {
    let camera = head(Distortion::None);
    let tied = CalibrationOptions { aspect_sigma: 0.0, skew_sigma: 0.0, ..Default::default() };
    let lens =
        calibrate_from_boards(&with_spots(&camera, &poses(10, 0.6, 2.0), 0.3, &mut Noise::new(1)), &tied).unwrap();
    let boards = with_spots(&camera, &poses(10, 1.0, 4.0), 0.3, &mut Noise::new(2));
    let found = calibrate_laser_line(&boards, Some(&lens.calibration), &tied).unwrap();
    let k = found.boards.calibration.camera.intrinsics;
    assert!((k.fx - k.fy).abs() < 1e-3 && k.skew == 0.0, "{k:?}");
}

#[test]
fn wrong_spots_are_named() {
    let camera = head(Distortion::None);
    let truths = poses(15, 1.0, 5.0);
    for seed in 0..10 {
        let mut noise = Noise::new(seed);
        let mut boards = with_spots(&camera, &truths, 0.4, &mut noise);
        for view in [2, 5, 9, 13] {
            let pixel = boards.views()[view].spot().unwrap().pixel + Vector2::new(20.0, 12.0 - view as f64 * 3.0);
            boards.set_spot(view, BoardSpot { pixel, pixel_covariance: None }).unwrap();
        }
        let found = calibrate_laser_line(&boards, None, &known(&camera)).unwrap();
        let wrong: Vec<usize> = (0..15).filter(|v| !found.used[*v]).collect();
        assert!([2, 5, 9, 13].iter().all(|v| wrong.contains(v)) && wrong.len() < 6, "seed {seed}: {wrong:?}");
        let c = found.line_covariance();
        assert!(error(&found.line).iter().enumerate().all(|(i, e)| e.abs() < 4.5 * c[(i, i)].sqrt()), "seed {seed}");
        assert!(found.residuals[2].unwrap().norm() > 10.0);
    }
}

#[test]
fn a_bent_board_is_met_where_it_bends() {
    let camera = head(Distortion::None);
    let (board, l) = (grid(15, 15, 0.03), rig().laser);
    let size = board[0].norm();
    let height = |p: &Vector2<f64>| 0.006 * (p.x / size).powi(2) - 0.004 * (p.x * p.y) / (size * size);
    let mut boards = Boards::new(720, 576).unwrap();
    for pose in poses(8, 1.0, 3.0) {
        let at = Camera { pose, ..camera };
        let seen: Vec<_> = board
            .iter()
            .map(|p| ptzcal::calibrate::BoardCorner {
                board: *p,
                pixel: at.project(&p.push(height(p))).unwrap(),
                pixel_covariance: None,
            })
            .collect();
        let view = boards.add_view(&seen).unwrap();
        // Bisection along the beam for the height above the sheet.
        let point = |z: f64| Vector3::new(l.x0 + l.vx * z, l.y0 + l.vy * z, z);
        let above = |z: f64| {
            let x = pose.inverse().apply(&point(z));
            x.z - height(&x.xy())
        };
        let middle = hit(&pose).z;
        let (mut a, mut b) = (middle - 0.1, middle + 0.1);
        for _ in 0..60 {
            let m = 0.5 * (a + b);
            if (above(m) > 0.0) == (above(a) > 0.0) { a = m } else { b = m }
        }
        let pixel = camera.project(&point(a)).unwrap();
        boards.set_spot(view, BoardSpot { pixel, pixel_covariance: None }).unwrap();
    }
    boards.set_bending(0.01).unwrap();
    // A prior about 0 pulls exact data a little.
    let found = calibrate_laser_line(&boards, None, &known(&camera)).unwrap();
    assert!(error(&found.line).iter().all(|e| e.abs() < 1e-6), "{:?}", error(&found.line));
}

fn degeneracy(boards: &Boards, options: &CalibrationOptions) -> Degeneracy {
    match calibrate_laser_line(boards, None, options).map(|f| f.line).unwrap_err() {
        Error::Degenerate { kind, detail } => {
            println!("{detail}");
            kind
        }
        other => panic!("{other}"),
    }
}

/// Views of the given poses with spots where the given line meets them.
fn lit(camera: &Camera, poses: &[Rigid], line: &LaserLine, sigma: f64) -> Boards {
    let mut noise = Noise::new(9);
    let mut boards = Boards::new(camera.width, camera.height).unwrap();
    for pose in poses {
        let view = boards.add_view(&corners(camera, pose, &grid(15, 15, 0.03), sigma, &mut noise)).unwrap();
        let (o, v) = (Vector3::new(line.x0, line.y0, 0.0), Vector3::new(line.vx, line.vy, 1.0));
        let n: Vector3<f64> = pose.rotation.column(2).into();
        let x = o + v * (n.dot(&(pose.translation - o)) / n.dot(&v));
        let pixel = camera.project(&x).unwrap() + noise.pixel(sigma);
        boards.set_spot(view, BoardSpot { pixel, pixel_covariance: None }).unwrap();
    }
    boards
}

#[test]
fn what_leaves_the_line_open_is_refused() {
    let camera = head(Distortion::None);
    let options = known(&camera);
    let all = poses(8, 1.0, 4.0);
    // No spot, and one.
    let mut boards = Boards::new(720, 576).unwrap();
    for pose in &all {
        boards.add_view(&corners(&camera, pose, &grid(15, 15, 0.03), 0.2, &mut Noise::new(0))).unwrap();
    }
    let few = |given| Err(Error::TooFewSpots { given, needed: 2 });
    assert_eq!(calibrate_laser_line(&boards, None, &options).map(|f| f.line), few(0));
    boards.set_spot(3, BoardSpot { pixel: Vector2::new(380.0, 290.0), pixel_covariance: None }).unwrap();
    assert_eq!(calibrate_laser_line(&boards, None, &options).map(|f| f.line), few(1));

    let line = rig().laser;
    for sigma in [0.0, 0.3] {
        for robust in [true, false] {
            let options = CalibrationOptions { robust, ..known(&camera) };
            // All boards at one distance.
            let flat = poses(8, 2.0, 2.0);
            assert_eq!(degeneracy(&lit(&camera, &flat, &line, sigma), &options), Degeneracy::OneDistance);
            // A laser through the camera's centre: the spot does not move.
            let through = LaserLine { x0: 0.0, y0: 0.0, ..line };
            assert_eq!(degeneracy(&lit(&camera, &all, &through, sigma), &options), Degeneracy::Coincident);
            // A board along the laser.
            let mut along = all.clone();
            let turn = rigid::rotation_y(1.57 - 0.015);
            along[4] = Rigid { rotation: turn, translation: hit(&all[4]) + turn * Vector3::new(0.01, 0.0, 0.0) };
            assert_eq!(degeneracy(&lit(&camera, &along, &line, sigma), &options), Degeneracy::IllConditioned);
        }
    }
    // Noise that hides the little depth that there is.
    let near = poses(8, 2.0, 2.1);
    assert_eq!(degeneracy(&lit(&camera, &near, &line, 2.0), &options), Degeneracy::OneDistance);
    // Spots of which most are elsewhere.
    let mut scattered = lit(&camera, &all, &line, 0.2);
    let mut noise = Noise::new(5);
    for view in 0..8 {
        let pixel = Vector2::new(720.0 * noise.uniform(), 576.0 * noise.uniform());
        scattered.set_spot(view, BoardSpot { pixel, pixel_covariance: None }).unwrap();
    }
    assert!(calibrate_laser_line(&scattered, None, &options).is_err());
    // Bad spots.
    let spot = |x: f64| BoardSpot { pixel: Vector2::new(x, 1.0), pixel_covariance: None };
    assert!(matches!(scattered.set_spot(8, spot(1.0)), Err(Error::InvalidArgument { name: "view", .. })));
    assert!(matches!(scattered.set_spot(0, spot(f64::NAN)), Err(Error::NotFinite { name: "spot", .. })));
}

#[test]
fn least_squares_refuses_what_it_cannot_answer() {
    let p = Vector3::new(0.1, 0.0, 2.0);
    assert!(matches!(least_squares(&[p]), Err(Error::TooFewPoints { given: 1, needed: 2 })));
    assert!(matches!(least_squares(&[p, p]), Err(Error::Degenerate { kind: Degeneracy::OneDistance, .. })));
    assert!(matches!(least_squares(&[p, Vector3::new(0.0, f64::NAN, 1.0)]), Err(Error::NotFinite { index: 1, .. })));
    let few = [Vector2::new(0.0, 0.0), Vector2::new(1.0, 0.0), Vector2::new(0.0, 1.0)];
    assert!(point_by_homography(&few, &few, &few[0], &Rigid::identity()).is_err());
}

#[test]
fn two_boards_are_enough_when_the_lens_is_known() {
    let camera = Camera { intrinsics: Intrinsics::new(800.0, 360.0, 288.0), ..head(Distortion::None) };
    let boards = with_spots(&camera, &poses(2, 1.0, 4.0), 0.2, &mut Noise::new(1));
    let found = calibrate_laser_line(&boards, None, &known(&camera)).unwrap();
    let c = found.line_covariance();
    assert!(error(&found.line).iter().enumerate().all(|(i, e)| e.abs() < 4.0 * c[(i, i)].sqrt()));
}
