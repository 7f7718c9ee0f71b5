//! Calibration from views of boards: published calibrations, simulated truth, refusals.

#[path = "support/boards.rs"]
mod board;
#[path = "support/data.rs"]
mod data;
#[path = "support/thesis.rs"]
mod thesis;

use std::path::Path;

use board::{corners, grid, head, poses};
use nalgebra::{DVector, Matrix2, Vector2, Vector3};
use ptzcal::calibrate::{
    BoardCalibration, BoardCorner, Boards, CalibrationOptions, DistortionModel, calibrate_from_boards,
};
use ptzcal::error::Degeneracy;
use ptzcal::geometry::{Camera, Distortion, Intrinsics, Rigid, rigid};
use ptzcal::{Error, Result};
use thesis::Noise;

/// Everything that the model has is free, nothing is set aside.
fn free(distortion: DistortionModel) -> CalibrationOptions {
    CalibrationOptions {
        distortion,
        skew_sigma: f64::INFINITY,
        aspect_sigma: f64::INFINITY,
        robust: false,
        ..Default::default()
    }
}

fn zhang(folder: &Path, views: usize) -> Boards {
    let model: Vec<f64> = data::numbers(&folder.join("Model.txt")).unwrap().concat();
    let mut boards = Boards::new(640, 480).unwrap();
    for view in 1..=views {
        let seen: Vec<f64> = data::numbers(&folder.join(format!("data{view}.txt"))).unwrap().concat();
        let corners: Vec<BoardCorner> = model
            .chunks_exact(2)
            .zip(seen.chunks_exact(2))
            .map(|(x, m)| BoardCorner {
                board: Vector2::new(x[0], x[1]),
                pixel: Vector2::new(m[0], m[1]),
                pixel_covariance: None,
            })
            .collect();
        assert_eq!(corners.len(), 256);
        boards.add_view(&corners).unwrap();
    }
    boards
}

/// maths.md T1: the optimum of an independent fit to Zhang's own corners, and its standard deviations.
#[test]
fn zhangs_views_give_the_optimum_to_all_digits() {
    let Some(folder) = data::folder("zhang_msr") else { return };
    let cases = [
        (
            2,
            [830.4683, 830.2414, 0.0, 307.0321, 206.5501, -0.226881, 0.193930],
            [4.750, 4.851, 0.0, 1.368, 0.926, 0.0060, 0.0318],
            0.294804,
        ),
        (
            3,
            [831.5381, 831.4404, 0.336047, 305.3095, 207.0939, -0.229594, 0.197298],
            [2.112, 2.149, 0.155, 1.479, 1.093, 0.0059, 0.0344],
            0.393727,
        ),
        (
            5,
            [832.4998, 832.5296, 0.204499, 303.9589, 206.5852, -0.228602, 0.190354],
            [1.407, 1.386, 0.078, 0.712, 0.659, 0.0041, 0.0249],
            0.336434,
        ),
    ];
    for (views, optimum, deviations, rms) in cases {
        let skew_sigma = if views == 2 { 0.0 } else { f64::INFINITY };
        let options = CalibrationOptions { skew_sigma, ..free(DistortionModel::Radial2) };
        let found = calibrate_from_boards(&zhang(&folder, views), &options).unwrap().calibration;
        let k = found.camera.intrinsics;
        let d = found.camera.distortion.coefficients();
        let values = [k.fx, k.fy, k.skew, k.cx, k.cy, d[0], d[1]];
        // A unit of the last digit that the table prints.
        let digits = [1e-4, 1e-4, 1e-6, 1e-4, 1e-4, 1e-6, 1e-6];
        let deviation_digits = [1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-4, 1e-4];
        for i in 0..7 {
            let sigma = found.covariance[(i, i)].sqrt();
            println!("{views} views, {i}: {} {}; {sigma} {}", values[i], optimum[i], deviations[i]);
            assert!((values[i] - optimum[i]).abs() < digits[i], "{views} views: {} {}", values[i], optimum[i]);
            assert!((sigma - deviations[i]).abs() < deviation_digits[i], "{views} views: {sigma} {}", deviations[i]);
        }
        println!("rms {}", found.rms);
        assert!((found.rms - rms).abs() < 1e-6);
    }
}

/// Zhang's published poses of the five views: board to camera, inches.
#[test]
fn zhangs_poses_are_the_published_ones() {
    let Some(folder) = data::folder("zhang_msr") else { return };
    let published = data::numbers(&folder.join("calibration-result-zhang-withdistortion.txt")).unwrap();
    let found = calibrate_from_boards(&zhang(&folder, 5), &free(DistortionModel::Radial2)).unwrap();
    for (view, pose) in found.views.iter().enumerate() {
        let rows = &published[2 + 4 * view..6 + 4 * view];
        let r = nalgebra::Matrix3::from_fn(|i, j| rows[i][j]);
        let t = Vector3::from_column_slice(&rows[3]);
        assert!((pose.pose.rotation - r).amax() < 1e-4, "{}", pose.pose.rotation - r);
        assert!((pose.pose.translation - t).amax() < 1e-3, "{}", pose.pose.translation - t);
    }
}

/// Bouguet's toolbox on its own corners of the stereo example: k1 k2 p1 p2 there, k3 too here.
#[test]
fn the_toolboxs_corners_give_the_toolboxs_camera() {
    let Some(folder) = data::folder("bouguet_opencv_stereo14") else { return };
    let camera = |side: &str| -> BoardCalibration {
        let mut boards = Boards::new(640, 480).unwrap();
        for view in 1..=14 {
            let rows = data::numbers(&folder.join(format!("corners_toolbox/{side}{view:02}.csv"))).unwrap();
            let corners: Vec<BoardCorner> = rows
                .iter()
                .map(|r| BoardCorner {
                    board: Vector2::new(r[0], r[1]),
                    pixel: Vector2::new(r[2], r[3]),
                    pixel_covariance: None,
                })
                .collect();
            boards.add_view(&corners).unwrap();
        }
        let options = CalibrationOptions { skew_sigma: 0.0, ..free(DistortionModel::BrownConrady) };
        calibrate_from_boards(&boards, &options).unwrap()
    };
    for (side, f, c, rms) in [
        ("left", [533.0037, 533.1526], [341.5861, 234.2594], 0.1868),
        ("right", [536.9826, 536.5694], [326.4721, 249.3326], 0.1925),
    ] {
        let found = camera(side);
        let k = found.calibration.camera.intrinsics;
        println!(
            "{side}: {k:?} {:?} {} {:?}",
            found.calibration.camera.distortion, found.calibration.rms, found.advice
        );
        let s = |i: usize| found.calibration.covariance[(i, i)].sqrt();
        println!("{} {} {} {}", s(0), s(1), s(3), s(4));
        // One coefficient more changes the others by less than their standard deviations.
        assert!((k.fx - f[0]).abs() < s(0) && (k.fy - f[1]).abs() < s(1), "{k:?}");
        assert!((k.cx - c[0]).abs() < s(3) && (k.cy - c[1]).abs() < s(4), "{k:?}");
        assert!(found.calibration.rms <= rms + 1e-4, "{} {rms}", found.calibration.rms);
    }
}

fn simulated(camera: &Camera, poses: &[Rigid], sigma: f64, noise: &mut Noise) -> Boards {
    let board = grid(9, 7, 0.05);
    let mut boards = Boards::new(camera.width, camera.height).unwrap();
    for pose in poses {
        boards.add_view(&corners(camera, pose, &board, sigma, noise)).unwrap();
    }
    boards
}

/// Boards that fill the image here and there, tilted every way.
fn spread(n: usize) -> Vec<Rigid> {
    let mut noise = Noise::new(11);
    let mut uniform = |half: f64| (2.0 * noise.uniform() - 1.0) * half;
    (0..n)
        .map(|i| {
            let z = 0.8 + 0.8 * (i % 5) as f64 / 4.0;
            Rigid {
                rotation: rigid::exp(&Vector3::new(uniform(0.7), uniform(0.7), uniform(1.5))),
                translation: Vector3::new(uniform(0.2) * z, uniform(0.15) * z, z),
            }
        })
        .collect()
}

fn lenses() -> [(Distortion, DistortionModel); 4] {
    [
        (Distortion::None, DistortionModel::None),
        (Distortion::BrownConrady([-0.28, 0.09, 0.001, -0.0005, 0.0]), DistortionModel::BrownConrady),
        (Distortion::BrownConrady([-0.25, 0.08, 0.0, 0.0, 0.0]), DistortionModel::Radial2),
        (Distortion::Division(-0.22), DistortionModel::Division),
    ]
}

#[test]
fn exact_corners_give_the_exact_camera() {
    for (lens, model) in lenses() {
        let truth =
            Camera { intrinsics: Intrinsics { fx: 812.0, fy: 809.0, skew: 0.8, cx: 350.0, cy: 300.0 }, ..head(lens) };
        for n in [3, 12] {
            let poses = spread(n);
            let found =
                calibrate_from_boards(&simulated(&truth, &poses, 0.0, &mut Noise::new(1)), &free(model)).unwrap();
            let (k, k0) = (found.calibration.camera.intrinsics.to_array(), truth.intrinsics.to_array());
            assert!(k.iter().zip(k0).all(|(a, b)| (a - b).abs() < 1e-5), "{model:?} {n} {k:?}");
            for (pose, truth) in found.views.iter().zip(&poses) {
                assert!((pose.pose.translation - truth.translation).norm() < 1e-7);
                assert!((pose.pose.rotation - truth.rotation).amax() < 1e-7);
            }
            assert!(found.calibration.rms < 1e-6);
        }
    }
}

/// Normalised error squared of the lens, and of each pose, over many noisy sets: T2's lesson.
#[test]
fn covariances_are_honest() {
    let truth = head(Distortion::BrownConrady([-0.25, 0.08, 0.0, 0.0, 0.0]));
    let poses = spread(8);
    let options = CalibrationOptions { robust: true, ..free(DistortionModel::Radial2) };
    let (mut lens, mut pose, mut count, runs) = (0.0, 0.0, 0.0, 200);
    for run in 0..runs {
        let found = calibrate_from_boards(&simulated(&truth, &poses, 0.4, &mut Noise::new(run)), &options).unwrap();
        let c = &found.calibration;
        let (k, k0) = (c.camera.intrinsics.to_array(), truth.intrinsics.to_array());
        let (d, d0) = (c.camera.distortion.coefficients(), truth.distortion.coefficients());
        let e: Vec<f64> = (0..5).map(|i| k[i] - k0[i]).chain((0..2).map(|i| d[i] - d0[i])).collect();
        lens += nees(&e, |i, j| c.covariance[(i, j)]) / 7.0;
        for (found, truth) in found.views.iter().zip(&poses) {
            let turn = rigid::log(&(found.pose.rotation * truth.rotation.transpose()));
            let off = found.pose.centre() - truth.centre();
            let e: Vec<f64> = turn.iter().chain(off.iter()).copied().collect();
            pose += nees(&e, |i, j| found.covariance[(i, j)]) / 6.0;
            count += 1.0;
        }
        assert!((c.noise_factor - 0.4).abs() < 0.05, "{}", c.noise_factor);
    }
    let (lens, pose) = ((lens / runs as f64).sqrt(), (pose / count).sqrt());
    println!("sqrt(NEES / p): lens {lens}, poses {pose}");
    assert!((0.95..1.05).contains(&lens) && (0.95..1.05).contains(&pose), "{lens} {pose}");
}

fn nees(e: &[f64], covariance: impl Fn(usize, usize) -> f64) -> f64 {
    let s: Vec<f64> = (0..e.len()).map(|i| covariance(i, i).sqrt()).collect();
    let scaled = nalgebra::DMatrix::from_fn(e.len(), e.len(), |i, j| covariance(i, j) / (s[i] * s[j]));
    let z = DVector::from_fn(e.len(), |i, _| e[i] / s[i]);
    z.dot(&scaled.cholesky().expect("positive definite").solve(&z))
}

#[test]
fn wrong_corners_and_wrong_views_are_named() {
    let truth = head(Distortion::BrownConrady([-0.25, 0.08, 0.0, 0.0, 0.0]));
    let options = CalibrationOptions { distortion: DistortionModel::Radial2, ..Default::default() };
    let poses = spread(10);
    let board = grid(9, 7, 0.05);
    for seed in 0..20 {
        let mut noise = Noise::new(seed);
        let mut boards = Boards::new(720, 576).unwrap();
        let mut wrong = Vec::new();
        for (v, pose) in poses.iter().enumerate() {
            // View 3's board is crumpled, view 7's corners are numbered from elsewhere. (A view that was
            // squeezed or cropped would hardly be noticed: another pose looks the same.)
            let mut seen = corners(&truth, pose, &board, 0.3, &mut noise);
            if v == 3 {
                let camera = Camera { pose: *pose, ..truth };
                let crumpled = |p: &Vector2<f64>| p.push(0.03 * (20.0 * p.x).sin() * (23.0 * p.y).cos());
                seen.iter_mut().for_each(|c| c.pixel = camera.project(&crumpled(&c.board)).unwrap());
            }
            for c in &mut seen {
                let before = c.pixel;
                if noise.uniform() < 0.2 {
                    c.pixel = Vector2::new(noise.uniform() * 720.0, noise.uniform() * 576.0);
                }
                // Some land beside their place by chance.
                wrong.push((c.pixel - before).norm() > 3.0 || v == 3 || v == 7);
            }
            if v == 7 {
                let pixels: Vec<_> = seen.iter().map(|c| c.pixel).collect();
                let n = pixels.len();
                seen.iter_mut().enumerate().for_each(|(i, c)| c.pixel = pixels[i * 17 % n]);
            }
            boards.add_view(&seen).unwrap();
        }
        let found = calibrate_from_boards(&boards, &options).unwrap();
        let set_aside: Vec<usize> = (0..10).filter(|v| !found.views[*v].used).collect();
        assert_eq!(set_aside, [3, 7], "seed {seed}");
        let c = &found.calibration;
        assert!(c.inliers.iter().zip(&wrong).all(|(inlier, wrong)| !(*inlier && *wrong)), "seed {seed}");
        let lost = c.inliers.iter().zip(&wrong).filter(|(inlier, wrong)| !**inlier && !**wrong).count();
        assert!(lost < 10, "{lost} good corners lost");
        let s = c.covariance[(0, 0)].sqrt();
        assert!((c.camera.intrinsics.fx - 800.0).abs() < 4.0 * s, "{} +- {s}", c.camera.intrinsics.fx);
    }
}

#[test]
fn stated_noise_weighs_corners() {
    // Half of the corners are ten times as noisy, and say so.
    let truth = head(Distortion::None);
    let poses = spread(6);
    let board = grid(9, 7, 0.05);
    let set = |run: u64, stated: bool| {
        let mut noise = Noise::new(run);
        let mut boards = Boards::new(720, 576).unwrap();
        for pose in &poses {
            let mut seen = corners(&truth, pose, &board, 0.0, &mut noise);
            for (i, c) in seen.iter_mut().enumerate() {
                let sigma = if i % 2 == 0 { 0.1 } else { 1.0 };
                c.pixel += noise.pixel(sigma);
                c.pixel_covariance = stated.then(|| Matrix2::identity() * (sigma * sigma));
            }
            boards.add_view(&seen).unwrap();
        }
        boards
    };
    let error = |stated: bool| -> f64 {
        let one = |run| {
            let found = calibrate_from_boards(&set(run, stated), &free(DistortionModel::None)).unwrap().calibration;
            if stated {
                assert!((found.noise_factor - 1.0).abs() < 0.15, "{}", found.noise_factor);
            }
            (found.camera.intrinsics.fx - 800.0).powi(2)
        };
        ((0..40).map(one).sum::<f64>() / 40.0).sqrt()
    };
    let (weighted, unweighted) = (error(true), error(false));
    assert!(weighted < 0.35 * unweighted, "{weighted} {unweighted}");
}

#[test]
fn a_bent_board_is_straightened() {
    let truth = head(Distortion::None);
    let poses = spread(8);
    let board = grid(9, 7, 0.05);
    // 2 mm at the rim; b2 along the diagonal.
    let bend = Vector3::new(0.002, -0.001, 0.0015);
    let middle = board.iter().fold(0.0f64, |m, p| m.max(p.norm()));
    let mut noise = Noise::new(2);
    let mut boards = Boards::new(720, 576).unwrap();
    for pose in &poses {
        let camera = Camera { pose: *pose, ..truth };
        let seen: Vec<BoardCorner> = board
            .iter()
            .map(|p| {
                let q = p / middle;
                let z = bend.dot(&Vector3::new(q.x * q.x, q.x * q.y, q.y * q.y));
                let pixel = camera.project(&p.push(z)).unwrap() + noise.pixel(0.1);
                BoardCorner { board: *p, pixel, pixel_covariance: None }
            })
            .collect();
        boards.add_view(&seen).unwrap();
    }
    let flat = calibrate_from_boards(&boards, &free(DistortionModel::None)).unwrap();
    boards.set_bending(0.005).unwrap();
    let bent = calibrate_from_boards(&boards, &free(DistortionModel::None)).unwrap();
    assert!((bent.bending - bend).norm() < 1e-4, "{}", bent.bending);
    assert!(bent.calibration.rms < 0.15 && flat.calibration.rms > 0.25, "{}", flat.calibration.rms);
    assert!((bent.calibration.camera.intrinsics.fx - 800.0).abs() < 0.5);
    assert_eq!(flat.bending, Vector3::zeros());
    assert!(boards.set_bending(-1.0).is_err() && boards.set_bending(f64::NAN).is_err());
}

fn failure(boards: &Boards, options: &CalibrationOptions) -> Error {
    calibrate_from_boards(boards, options).map(|c| c.calibration.camera.intrinsics).unwrap_err()
}

fn degeneracy(e: &Error) -> Degeneracy {
    match e {
        Error::Degenerate { kind, .. } => *kind,
        other => panic!("{other}"),
    }
}

#[test]
fn parallel_boards_are_refused() {
    let truth = head(Distortion::None);
    let facing: Vec<Rigid> = (0..6)
        .map(|i| Rigid {
            rotation: rigid::exp(&Vector3::new(0.0, 0.0, 0.3 * i as f64)),
            translation: Vector3::new(0.05 * i as f64, -0.1, 0.8 + 0.3 * i as f64),
        })
        .collect();
    let tilt = rigid::exp(&Vector3::new(0.02, 0.01, 0.0));
    let nearly: Vec<Rigid> = facing.iter().map(|p| Rigid { rotation: tilt * p.rotation, ..*p }).collect();
    for poses in [&facing[..], &facing[..1], &nearly] {
        for robust in [true, false] {
            for sigma in [0.0, 0.3] {
                let boards = simulated(&truth, poses, sigma, &mut Noise::new(4));
                let options = CalibrationOptions { robust, ..Default::default() };
                let e = failure(&boards, &options);
                assert_eq!(degeneracy(&e), Degeneracy::ParallelBoards, "{robust} {sigma} {e}");
                assert!(e.hint().unwrap().contains("tilted"));
            }
        }
    }
    // Exact corners of one board straight ahead: what rounding leaves is no focal length.
    for z in [1.0, 2.0, 3.0] {
        let ahead = Rigid { translation: Vector3::new(0.0, 0.0, z), ..Rigid::identity() };
        let e = failure(&simulated(&truth, &[ahead], 0.0, &mut Noise::new(4)), &Default::default());
        assert_eq!(degeneracy(&e), Degeneracy::ParallelBoards, "{e}");
    }
    // The lens known, they pose no question.
    let lens = Some((truth.intrinsics, truth.distortion));
    let options = CalibrationOptions { fixed_lens: lens, ..Default::default() };
    let found = calibrate_from_boards(&simulated(&truth, &facing, 0.3, &mut Noise::new(4)), &options).unwrap();
    assert!(found.views.iter().zip(&facing).all(|(v, t)| (v.pose.translation - t.translation).norm() < 0.01));
    assert_eq!(found.calibration.covariance[(0, 0)], 0.0);
}

#[test]
fn one_view_is_enough_when_it_is_tilted() {
    let truth = head(Distortion::None);
    let tilted = Rigid { rotation: rigid::exp(&Vector3::new(0.6, 0.5, 0.1)), translation: Vector3::new(0.0, 0.0, 0.6) };
    let found =
        calibrate_from_boards(&simulated(&truth, &[tilted], 0.2, &mut Noise::new(1)), &Default::default()).unwrap();
    let c = &found.calibration;
    assert!((c.camera.intrinsics.fx - 800.0).abs() < 3.0 * c.covariance[(0, 0)].sqrt(), "{}", c.camera.intrinsics.fx);
    assert!(found.advice.iter().any(|a| a.contains("one view")), "{:?}", found.advice);
    // A little tilt is too little.
    let slight = Rigid { rotation: rigid::exp(&Vector3::new(0.05, 0.03, 0.0)), ..tilted };
    let e = failure(&simulated(&truth, &[slight], 0.2, &mut Noise::new(1)), &Default::default());
    assert_eq!(degeneracy(&e), Degeneracy::ParallelBoards);
}

#[test]
fn mirrored_views_are_named() {
    let truth = head(Distortion::None);
    let mut boards = Boards::new(720, 576).unwrap();
    for (v, pose) in spread(5).iter().enumerate() {
        let mut seen = corners(&truth, pose, &grid(9, 7, 0.05), 0.2, &mut Noise::new(v as u64));
        if v == 3 {
            seen.iter_mut().for_each(|c| c.board.x = -c.board.x);
        }
        boards.add_view(&seen).unwrap();
    }
    for robust in [true, false] {
        let e = failure(&boards, &CalibrationOptions { robust, ..Default::default() });
        assert!(matches!(e, Error::InvalidArgument { name: "views", .. }) && e.to_string().contains("view 3"), "{e}");
    }
}

#[test]
fn a_view_that_does_not_fit_is_named_also_when_nothing_is_set_aside() {
    let truth = head(Distortion::None);
    let mut boards = Boards::new(720, 576).unwrap();
    for (v, pose) in spread(5).iter().enumerate() {
        let mut seen = corners(&truth, pose, &grid(9, 7, 0.05), 0.2, &mut Noise::new(v as u64));
        if v == 2 {
            let pixels: Vec<_> = seen.iter().map(|c| c.pixel).collect();
            seen.iter_mut().enumerate().for_each(|(i, c)| c.pixel = pixels[i * 17 % pixels.len()]);
        }
        boards.add_view(&seen).unwrap();
    }
    let e = failure(&boards, &CalibrationOptions { robust: false, ..Default::default() });
    assert!(e.to_string().contains("view 2"), "{e}");
}

#[test]
fn bad_views_are_refused() -> Result<()> {
    let truth = head(Distortion::None);
    let pose = spread(1)[0];
    let good = corners(&truth, &pose, &grid(9, 7, 0.05), 0.2, &mut Noise::new(0));
    let mut boards = Boards::new(720, 576)?;
    assert!(Boards::new(0, 576).is_err() && Boards::new(720, 1 << 17).is_err());
    assert_eq!(boards.add_view(&good[..3]).unwrap_err(), Error::TooFewPoints { given: 3, needed: 4 });
    assert_eq!(degeneracy(&boards.add_view(&good[..9]).unwrap_err()), Degeneracy::Collinear);
    for i in 0..4 {
        let mut bad = good.clone();
        match i {
            0 => bad[5].board.x = f64::NAN,
            1 => bad[5].pixel.y = f64::INFINITY,
            2 => bad[5].pixel_covariance = Some(Matrix2::new(1.0, 2.0, 2.0, 1.0)),
            _ => bad[5].board.y = 1e300,
        }
        let e = boards.add_view(&bad).unwrap_err();
        assert!(if i < 2 { e.index() == Some(5) } else { matches!(e, Error::InvalidArgument { .. }) }, "{e}");
    }
    assert!(boards.views().is_empty(), "a refused view is not added");
    assert!(matches!(failure(&boards, &Default::default()), Error::TooFewPoints { .. }));
    // Three of four on a line.
    assert_eq!(
        degeneracy(&boards.add_view(&[good[0], good[1], good[2], good[40]]).unwrap_err()),
        Degeneracy::Collinear
    );
    Ok(())
}

#[test]
fn four_corners_pose_a_known_camera() {
    let truth = head(Distortion::None);
    let pose = spread(1)[0];
    let good = corners(&truth, &pose, &grid(9, 7, 0.05), 0.0, &mut Noise::new(0));
    let mut boards = Boards::new(720, 576).unwrap();
    boards.add_view(&[good[0], good[8], good[54], good[62]]).unwrap();
    let options = CalibrationOptions { fixed_lens: Some((truth.intrinsics, truth.distortion)), ..Default::default() };
    let found = calibrate_from_boards(&boards, &options).unwrap();
    assert!((found.views[0].pose.translation - pose.translation).norm() < 1e-8);
}

#[test]
fn cancelling_stops_it() {
    let options = CalibrationOptions::default();
    options.cancel.cancel();
    let boards = simulated(&head(Distortion::None), &spread(5), 0.2, &mut Noise::new(0));
    assert_eq!(failure(&boards, &options), Error::Cancelled);
}

#[test]
fn advice_says_what_is_missing() {
    let truth = head(Distortion::None);
    let advice = |poses: &[Rigid]| {
        let boards = simulated(&truth, poses, 0.1, &mut Noise::new(0));
        calibrate_from_boards(&boards, &CalibrationOptions { max_focal_deviation: f64::INFINITY, ..Default::default() })
            .unwrap()
            .advice
    };
    // Leaning forwards and backwards only, at one distance, in the middle of the image.
    let leaning: Vec<Rigid> = (0..6)
        .map(|i| Rigid {
            rotation: rigid::exp(&Vector3::new(-0.6 + 0.24 * i as f64, 0.0, 0.0)),
            translation: Vector3::new(0.0, 0.0, 1.5),
        })
        .collect();
    let said = advice(&leaning);
    assert!(said[0].contains("about the vertical axis"), "{said:?}");
    assert!(said.iter().any(|a| a.contains("upper left") && a.contains("lower right")), "{said:?}");
    assert!(said.iter().any(|a| a.contains("same distance")), "{said:?}");
    assert!(!said.iter().any(|a| a.contains("horizontal axis") || a.contains("only")), "{said:?}");
    let good: Vec<Rigid> = spread(12).iter().map(|p| Rigid { translation: p.translation * 0.7, ..*p }).collect();
    assert!(advice(&good).is_empty(), "{:?}", advice(&good));
}

#[test]
fn distant_boards_are_not_taken_for_reversed_ones() {
    // 0.4 m boards at 5 m: weak perspective, two poses look alike.
    let truth = head(Distortion::None);
    let truths = poses(25, 1.0, 5.0);
    let options = CalibrationOptions { fixed_lens: Some((truth.intrinsics, truth.distortion)), ..Default::default() };
    for run in 0..20 {
        let boards = board::with_spots(&truth, &truths, 0.5, &mut Noise::new(run));
        let found = calibrate_from_boards(&boards, &options).unwrap();
        for (view, (found, truth)) in found.views.iter().zip(&truths).enumerate() {
            let turn = rigid::log(&(found.pose.rotation * truth.rotation.transpose()));
            let sigma = (0..3).map(|i| found.covariance[(i, i)]).sum::<f64>().sqrt();
            assert!(turn.norm() < 5.0 * sigma, "run {run} view {view}: {} +- {sigma}", turn.norm());
        }
    }
}
