//! A rig calibrated at several zoom positions: truth, the bound, coverage between the positions,
//! refusals.

#[path = "support/boards.rs"]
mod board;
#[path = "support/thesis.rs"]
mod thesis;
#[path = "support/zoom.rs"]
mod zoom;

use nalgebra::{DMatrix, DVector};
use ptzcal::calibrate::CalibrationOptions;
use ptzcal::error::{Degeneracy, Error, Status};
use ptzcal::format::{read_zoom_curve, write_zoom_curve, zoom_json};
use ptzcal::geometry::zoom_curve::ZoomNode;
use ptzcal::geometry::{Distortion, Rigid, ZoomCurve};
use ptzcal::rig_calibration::{RigCalibrated, RigCalibration};
use thesis::Noise;
use zoom::{PUPIL_SIGMA, SIZE, TrueView, ZOOMS, add, information, joint_bound, options, spec, truth, views};

fn free() -> CalibrationOptions {
    CalibrationOptions { skew_sigma: f64::INFINITY, aspect_sigma: f64::INFINITY, ..Default::default() }
}

fn head(zooms: &[f64], count: usize) -> Vec<(ZoomNode, Vec<TrueView>)> {
    zooms
        .iter()
        .map(|z| {
            let node = truth(*z, Distortion::None);
            let views = views(&node, count);
            (node, views)
        })
        .collect()
}

fn simulate(
    head: &[(ZoomNode, Vec<TrueView>)],
    sigma: f64,
    calibration: CalibrationOptions,
    seed: u64,
) -> RigCalibrated {
    let mut rig = RigCalibration::new(spec(), options(sigma, calibration)).unwrap();
    let mut noise = Noise::new(seed);
    head.iter().for_each(|(node, views)| add(&mut rig, node, views, sigma, &mut noise));
    rig.solve().unwrap()
}

fn nees(e: &[f64], c: &DMatrix<f64>) -> f64 {
    let s: Vec<f64> = (0..e.len()).map(|i| c[(i, i)].sqrt()).collect();
    let scaled = DMatrix::from_fn(e.len(), e.len(), |i, j| c[(i, j)] / (s[i] * s[j]));
    let z = DVector::from_fn(e.len(), |i, _| e[i] / s[i]);
    z.dot(&scaled.cholesky().expect("positive definite").solve(&z))
}

fn off(found: &[f64], truth: &ZoomNode) -> Vec<f64> {
    found.iter().zip(truth.parameters()).map(|(a, b)| a - b).collect()
}

#[test]
fn one_line_at_all_zooms_is_on_the_joint_bound() {
    let head = head(&ZOOMS, 12);
    let sigma = 0.3;
    let informations: Vec<_> = head.iter().map(|(node, views)| information(node, views, sigma)).collect();
    let bound = joint_bound(&informations, PUPIL_SIGMA);
    let runs = 40;
    let (mut squares, mut covered, mut alone) = (vec![0.0; 36], 0.0, 0.0);
    for run in 0..runs {
        let found = simulate(&head, sigma, CalibrationOptions { robust: false, ..free() }, run);
        let common = found.common.as_ref().unwrap();
        assert!(common.agrees && common.freedom == 12 && common.positions == 4, "{common:?}");
        alone += common.chi2 / (12 * runs) as f64;
        for (k, (z, (truth, _))) in found.zooms.iter().zip(&head).enumerate() {
            let e = off(&z.node.as_ref().unwrap().parameters(), truth);
            e.iter().zip(&mut squares[9 * k..]).for_each(|(e, s)| *s += e * e / runs as f64);
            covered += nees(&e, &found.covariance.view((9 * k, 9 * k), (9, 9)).into_owned()) / (36 * runs) as f64;
        }
    }
    // 40 runs: a ratio's standard deviation is 11 %. `make accuracy` has the figures of many.
    for j in 0..36 {
        let ratio = squares[j].sqrt() / bound[(j, j)].sqrt();
        assert!((0.65..1.4).contains(&ratio), "zoom {} parameter {}: {ratio}", j / 9, j % 9);
    }
    let mean = (0..36).map(|j| squares[j] / bound[(j, j)] / 36.0).sum::<f64>().sqrt();
    println!("rms over the bound {mean}, sqrt(NEES/p) {}, chi2 / freedom {alone}", covered.sqrt());
    assert!((0.85..1.1).contains(&mean) && (0.9..1.1).contains(&covered.sqrt()) && (0.7..1.3).contains(&alone));
    // What sharing is for: at 8x the principal point is known more than twice as well as from its own views.
    let own = zoom::inverse(&informations[3])[(3, 3)].sqrt();
    assert!(bound[(30, 30)].sqrt() < 0.5 * own, "{} {own}", bound[(30, 30)].sqrt());
}

#[test]
fn a_head_whose_line_moves_keeps_its_lines() {
    let mut head = head(&ZOOMS, 10);
    // At 4x a lens group turns the view by 20 mrad against the laser.
    head[2].0.laser.vx += 0.02;
    head[2].1 = views(&head[2].0, 10);
    let found = simulate(&head, 0.2, free(), 3);
    let common = found.common.as_ref().unwrap();
    assert!(!common.agrees && common.probability < 1e-3, "{common:?}");
    assert_eq!(common.odd, Some(ZOOMS[2]));
    assert!(found.common_line().is_none());
    // Every position answers for itself, the odd one too.
    for (k, (truth, _)) in head.iter().enumerate() {
        let own = found.zooms[k].laser.as_ref().unwrap();
        let node = found.zooms[k].node.as_ref().unwrap();
        assert_eq!(node.laser, own.line);
        let e = off(&node.parameters(), truth);
        let c = found.covariance.view((9 * k, 9 * k), (9, 9)).into_owned();
        assert!(nees(&e, &c) < 35.0, "zoom {k}: {}", nees(&e, &c));
    }
    // Off between the positions: independent.
    assert!(found.covariance.view((0, 9), (9, 9)).iter().all(|c| *c == 0.0));
}

#[test]
fn a_position_without_spots_gets_the_line_of_the_others() {
    let head = head(&ZOOMS, 10);
    let mut rig = RigCalibration::new(spec(), options(0.3, free())).unwrap();
    let mut noise = Noise::new(1);
    for (k, (node, views)) in head.iter().enumerate() {
        if k == 1 {
            zoom::add_corners(&mut rig, node, views, 0.3, &mut noise);
        } else {
            add(&mut rig, node, views, 0.3, &mut noise);
        }
    }
    let found = rig.solve().unwrap();
    let dark = &found.zooms[1];
    assert_eq!(dark.laser.as_ref().map(|_| ()).map_err(|e| e.status()), Err(ptzcal::error::Status::TooFewPoints));
    let e = off(&dark.node.as_ref().unwrap().parameters(), &head[1].0);
    let c = found.covariance.view((9, 9), (9, 9)).into_owned();
    assert!(nees(&e, &c) < 35.0, "{}", nees(&e, &c));
    let (model, c) = found.rig_model(1).unwrap();
    assert!((model.laser.x0 - 0.1).abs() < 1e-3 && c[(0, 0)] > 0.0);
    // Left to themselves, it has none.
    let mut own = rig.clone();
    own.set_common_line(false, 0.05).unwrap();
    let found = own.solve().unwrap();
    assert!(found.common.is_none() && found.zooms[1].node.is_none() && found.zooms[3].node.is_some());
    assert!(found.rig_model(1).is_err() && found.rig_model(3).is_ok());
    assert_eq!(found.curve().unwrap().nodes().len(), 3);
}

#[test]
fn wrong_spots_and_wrong_views_are_named_and_cost_nothing_else() {
    let head = head(&ZOOMS[..2], 12);
    let mut rig = RigCalibration::new(spec(), options(0.3, CalibrationOptions::default())).unwrap();
    let mut noise = Noise::new(4);
    head.iter().for_each(|(node, views)| add(&mut rig, node, views, 0.3, &mut noise));
    // A reflection in views 3 and 15.
    for view in [3, 15] {
        let spot = ptzcal::calibrate::BoardSpot { pixel: nalgebra::Vector2::new(300.0, 250.0), pixel_covariance: None };
        rig.set_spot(view, spot).unwrap();
    }
    let found = rig.solve().unwrap();
    for view in [3, 15] {
        let v = &found.views[view];
        let fault = v.spot_fault.as_ref().unwrap();
        assert!(v.fault.is_none() && !v.spot_used && fault.reason.contains("reflection"), "{fault:?}");
        assert!(v.spot_residual.unwrap().norm() > 5.0);
    }
    assert!(found.views.iter().filter(|v| v.spot_fault.is_some()).count() <= 3);
    for (k, (truth, _)) in head.iter().enumerate() {
        let (model, c) = found.rig_model(k).unwrap();
        assert!((model.laser.x0 - truth.laser.x0).abs() < 4.0 * c[(0, 0)].sqrt());
    }
}

/// Between the positions: the error is covered by the covariance, of which the spline's own error is part.
#[test]
fn between_the_zooms_the_covariance_covers() {
    let zooms: Vec<f64> = (0..6).map(|i| f64::from(i) / 5.0).collect();
    let head = head(&zooms, 10);
    let places: Vec<f64> = (0..10).map(|i| f64::from(i) / 10.0 + 0.05).collect();
    let (runs, sigma) = (20, 0.3);
    let (mut covered, mut worst) = (vec![0.0; 9], 0.0f64);
    for run in 0..runs {
        let found = simulate(&head, sigma, CalibrationOptions { robust: false, ..free() }, run);
        let curve = found.curve().unwrap();
        for z in &places {
            let at = curve.at(*z).unwrap();
            let truth = truth(*z, Distortion::None);
            let node = ZoomNode {
                zoom: *z,
                intrinsics: at.model.intrinsics,
                distortion: at.model.distortion,
                laser: at.model.laser,
            };
            let e = off(&node.parameters(), &truth);
            for i in 0..9 {
                covered[i] += e[i] * e[i] / at.covariance[(i, i)] / (runs as usize * places.len()) as f64;
            }
            worst = worst.max(nees(&e, &at.covariance) / 9.0);
        }
    }
    let roots: Vec<f64> = covered.iter().map(|c| c.sqrt()).collect();
    println!("sqrt(NEES) by parameter {roots:.2?}, worst of all {worst:.2}");
    // The spline's error is a bound rather than a noise: covered, and not by ten times.
    assert!(roots.iter().all(|r| (0.3..1.15).contains(r)), "{roots:?}");
    assert!(worst < 5.0, "{worst}");
}

#[test]
fn exact_positions_leave_the_splines_error_which_is_stated() {
    for zooms in [vec![0.0, 1.0], vec![0.0, 0.4, 1.0], ZOOMS.to_vec(), (0..9).map(|i| f64::from(i) / 8.0).collect()] {
        for lens in [Distortion::None, Distortion::BrownConrady([-0.2, 0.0, 0.0, 0.0, 0.0])] {
            let nodes: Vec<ZoomNode> = zooms.iter().map(|z| truth(*z, lens)).collect();
            let n = nodes[0].parameters().len() * nodes.len();
            let curve = ZoomCurve::new(SIZE, nodes.clone(), DMatrix::zeros(n, n)).unwrap();
            for node in &nodes {
                let at = curve.at(node.zoom).unwrap();
                assert!((at.model.intrinsics.fx - node.intrinsics.fx).abs() < 1e-9 * node.intrinsics.fx);
                assert!((at.model.laser.vx - node.laser.vx).abs() < 1e-12 && at.covariance.amax() < 1e-12);
            }
            let mut last = 0.0;
            for i in 0..=100 {
                let z = f64::from(i) / 100.0;
                let at = curve.at(z).unwrap();
                let true_f = truth(z, lens).intrinsics.fx;
                let f = at.model.intrinsics.fx;
                assert!(f > last, "monotone");
                last = f;
                let sigma = at.covariance[(0, 0)].max(0.0).sqrt();
                assert!(
                    (f - true_f).abs() <= 3.0 * sigma + 1e-9 * f,
                    "{} nodes, {z}: {f} {true_f} {sigma}",
                    zooms.len()
                );
            }
        }
    }
}

#[test]
fn curves_refuse_what_they_cannot_answer() {
    let nodes: Vec<ZoomNode> = ZOOMS.iter().map(|z| truth(*z, Distortion::None)).collect();
    let new = |nodes: Vec<ZoomNode>| {
        let n = 9 * nodes.len();
        ZoomCurve::new(SIZE, nodes, DMatrix::zeros(n, n))
    };
    let curve = new(nodes.clone()).unwrap();
    assert_eq!(curve.range(), [0.0, 1.0]);
    for z in [-1e-9, 1.0 + 1e-9, 1e300] {
        assert!(matches!(curve.at(z), Err(Error::InvalidArgument { name: "zoom", .. })), "{z}");
    }
    assert!(matches!(curve.at(f64::NAN), Err(Error::NotFinite { name: "zoom", .. })));
    // One position: there, and nowhere else.
    let one = new(vec![nodes[1].clone()]).unwrap();
    assert!((one.at(ZOOMS[1]).unwrap().model.intrinsics.fx - nodes[1].intrinsics.fx).abs() < 1e-9);
    assert!(one.at(0.34).is_err());
    assert!(matches!(new(Vec::new()), Err(Error::TooFewPoints { .. })));
    let refused = |change: &dyn Fn(&mut Vec<ZoomNode>), word: &str| {
        let mut bad = nodes.clone();
        change(&mut bad);
        let e = new(bad).unwrap_err();
        assert!(matches!(e, Error::InvalidArgument { .. } | Error::NotFinite { .. }), "{e}");
        assert!(e.to_string().contains(word), "{e}");
    };
    refused(&|n| n[2].intrinsics.fx = 1000.0, "zoom 0.33");
    refused(&|n| n.swap(1, 2), "followed by");
    refused(&|n| n[3].zoom = n[2].zoom, "followed by");
    refused(&|n| n[1].zoom = f64::NAN, "zoom");
    refused(&|n| n[1].distortion = Distortion::Division(-0.01), "lens model");
    refused(&|n| (n[1].laser.x0, n[1].laser.y0) = (0.0, 0.0), "zoom 0.33");
    refused(&|n| n[0].intrinsics.fx = -1.0, "zoom 0");
    let long: Vec<ZoomNode> = (0..65).map(|i| truth(f64::from(i) / 64.0, Distortion::None)).collect();
    assert!(new(long).is_err());
    // Falling focal lengths are as good.
    let mut falling = nodes.clone();
    falling.iter_mut().for_each(|n| n.zoom = -n.zoom);
    falling.reverse();
    assert!(new(falling).is_ok());
    // Covariances that are none.
    let mut c = DMatrix::<f64>::identity(36, 36);
    assert!(ZoomCurve::new(SIZE, nodes.clone(), c.clone()).is_ok());
    c[(3, 4)] = 0.5;
    assert!(ZoomCurve::new(SIZE, nodes.clone(), c.clone()).is_err(), "not symmetric");
    c[(4, 3)] = 0.5;
    assert!(ZoomCurve::new(SIZE, nodes.clone(), c.clone()).is_ok());
    (c[(3, 4)], c[(4, 3)]) = (1.5, 1.5);
    assert!(ZoomCurve::new(SIZE, nodes.clone(), c.clone()).is_err(), "indefinite");
    (c[(3, 4)], c[(4, 3)], c[(0, 0)]) = (0.0, 0.0, -1.0);
    assert!(ZoomCurve::new(SIZE, nodes.clone(), c.clone()).is_err(), "a negative variance");
    c[(0, 0)] = f64::NAN;
    assert!(matches!(ZoomCurve::new(SIZE, nodes.clone(), c), Err(Error::NotFinite { .. })));
    assert!(ZoomCurve::new(SIZE, nodes, DMatrix::zeros(35, 35)).is_err());
}

#[test]
fn files_keep_every_bit_and_refuse_damage() {
    let head = head(&ZOOMS[..3], 8);
    let curve = simulate(&head, 0.2, free(), 1).curve().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("zoom.json");
    write_zoom_curve(&path, &curve).unwrap();
    assert_eq!(read_zoom_curve(&path).unwrap(), curve);
    let text = zoom_json::to_json(&curve).unwrap();
    let read = |text: &str| zoom_json::from_json(text.as_bytes(), "file").map(|_| ());
    assert!(read(&text).is_ok());
    let status = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        read(&text.replacen(from, to, 1)).map_err(|e| e.status())
    };
    assert_eq!(status("\"version\": 1", "\"version\": 2"), Err(Status::FileVersion));
    assert_eq!(status("ptzcal-zoom-curve", "ptzcal-camera"), Err(Status::FileFormat));
    assert_eq!(status("\"zoom\": 0.0", "\"zoom\": 5.0"), Err(Status::FileFormat));
    assert_eq!(status("\"none\"", "\"some\""), Err(Status::FileFormat));
    assert_eq!(status("\"image_width\": 720", "\"image_width\": 0"), Err(Status::FileFormat));
    assert_eq!(status("\"x0\"", "\"x1\""), Err(Status::FileFormat));
    for end in [0, 1, text.len() / 2, text.len() - 3] {
        assert_eq!(read(&text[..end]).map_err(|e| e.status()), Err(Status::FileFormat), "{end}");
    }
    assert_eq!(read_zoom_curve(&folder.path().join("none")).unwrap_err().status(), Status::FileIo);
}

/// One position may be all there is; and one whose views do not do says why.
#[test]
fn positions_fail_by_themselves() {
    let head = head(&ZOOMS[..3], 8);
    let mut rig = RigCalibration::new(spec(), options(0.2, free())).unwrap();
    let mut noise = Noise::new(2);
    add(&mut rig, &head[0].0, &head[0].1, 0.2, &mut noise);
    // All boards parallel at the second, at one distance at the third.
    let mut parallel = head[1].1.clone();
    for view in &mut parallel {
        let middle = view.pose.apply(&nalgebra::Vector3::zeros());
        view.pose = Rigid { rotation: nalgebra::Matrix3::identity(), translation: middle };
        let at = ptzcal::geometry::Camera { pose: view.pose, ..zoom::camera(&head[1].0) };
        view.board = board::grid(15, 15, 0.03);
        view.board.retain(|p| at.project(&p.push(0.0)).is_some_and(|q| at.contains(&q)));
    }
    add(&mut rig, &head[1].0, &parallel, 0.2, &mut noise);
    let mut one_distance = head[2].1.clone();
    one_distance.iter_mut().for_each(|view| {
        let hit = zoom::meet(&head[2].0.laser, &view.pose);
        let l = head[2].0.laser;
        let there = nalgebra::Vector3::new(l.x0 + 3.0 * l.vx, l.y0 + 3.0 * l.vy, 3.0);
        view.pose.translation += there - hit;
        let at = ptzcal::geometry::Camera { pose: view.pose, ..zoom::camera(&head[2].0) };
        view.board = board::grid(15, 15, 0.03);
        view.board.retain(|p| at.project(&p.push(0.0)).is_some_and(|q| at.contains(&q)));
    });
    add(&mut rig, &head[2].0, &one_distance, 0.2, &mut noise);
    let found = rig.solve().unwrap();
    let kind = |e: &Error| match e {
        Error::Degenerate { kind, .. } => Some(*kind),
        _ => None,
    };
    assert!(found.rig_model(0).is_ok());
    let parallel = found.zooms[1].boards.as_ref().unwrap_err();
    assert_eq!(kind(parallel), Some(Degeneracy::ParallelBoards), "{parallel}");
    assert!(found.rig_model(1).is_err() && found.views[9].fault.is_some());
    let flat = found.zooms[2].laser.as_ref().map(|_| ()).unwrap_err();
    assert_eq!(kind(flat), Some(Degeneracy::OneDistance), "{flat}");
    // It has a lens, and the line of the first.
    assert!(found.zooms[2].boards.is_ok() && found.rig_model(2).is_ok());
    assert_eq!(found.curve().unwrap().nodes().len(), 2);
}
