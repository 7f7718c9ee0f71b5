//! From pictures to a calibrated rig, in one go: rendered ones with known truth, and photographs.

#[path = "support/board_pictures.rs"]
mod board_pictures;
#[path = "support/data.rs"]
mod data;
#[path = "support/thesis.rs"]
mod thesis;

use std::path::Path;

use board_pictures::Scene;
use nalgebra::{Vector2, Vector3};
use ptzcal::calibrate::boards::BoardSpot;
use ptzcal::calibrate::{BoardCorner, CalibrationOptions, DistortionModel};
use ptzcal::error::{Error, Status};
use ptzcal::geometry::rig_model::LaserLine;
use ptzcal::geometry::{Camera, Distortion, Intrinsics, Rigid, rigid};
use ptzcal::image::{Image, PixelFormat};
use ptzcal::rig_calibration::{ChessboardSpec, RigCalibrated, RigCalibration, RigCalibrationOptions};
use thesis::Noise;

const SPEC: ChessboardSpec = ChessboardSpec { columns: 9, rows: 6, square: 0.04 };
const LINE: LaserLine = LaserLine { x0: 0.1, y0: 0.005, vx: -0.005, vy: 0.003 };

fn camera(f: f64) -> Camera {
    Camera {
        width: 720,
        height: 576,
        intrinsics: Intrinsics { fx: f, fy: f, skew: 0.0, cx: 363.0, cy: 285.0 },
        distortion: Distortion::BrownConrady([-0.15 * 800.0 / f, 0.0, 0.0, 0.0, 0.0]),
        pose: Rigid::identity(),
    }
}

fn calibration() -> CalibrationOptions {
    CalibrationOptions {
        distortion: DistortionModel::Radial1,
        aspect_sigma: 0.0,
        skew_sigma: 0.0,
        ..Default::default()
    }
}

fn empty(calibration: CalibrationOptions) -> RigCalibration {
    RigCalibration::new(SPEC, RigCalibrationOptions { calibration, ..Default::default() }).unwrap()
}

/// Where the laser meets boards tilted each another way, `near` to `far` metres away; the place on the
/// board is the middle of a bright square.
fn poses(count: usize, near: f64, far: f64, seed: u64) -> Vec<Rigid> {
    let mut noise = Noise::new(seed);
    let mut uniform = |half: f64| (2.0 * noise.uniform() - 1.0) * half;
    (0..count)
        .map(|i| {
            let z = near + (far - near) * i as f64 / (count - 1) as f64;
            let hit = Vector3::new(LINE.x0 + LINE.vx * z, LINE.y0 + LINE.vy * z, z);
            let turn = rigid::exp(&Vector3::new(uniform(0.6), uniform(0.6), uniform(0.2)));
            let place = Vector3::new(uniform(0.06), uniform(0.05), 0.0);
            Rigid { rotation: turn, translation: hit - turn * place }
        })
        .collect()
}

fn scene<'a>(camera: &'a Camera, pose: &Rigid) -> Scene<'a> {
    Scene { camera, spec: &SPEC, pose: *pose, line: LINE, beam: 0.0015, blur: 0.8, noise: 2.0 }
}

fn hit(camera: &Camera, pose: &Rigid) -> Vector2<f64> {
    let (o, v) = (Vector3::new(LINE.x0, LINE.y0, 0.0), Vector3::new(LINE.vx, LINE.vy, 1.0));
    let n: Vector3<f64> = pose.rotation.column(2).into();
    camera.project(&(o + v * (n.dot(&(pose.translation - o)) / n.dot(&v)))).unwrap()
}

#[test]
fn pictures_at_two_zooms_give_the_rig() {
    let mut rig = empty(calibration());
    let mut noise = Noise::new(5);
    let mut truths = Vec::new();
    let mut spots = Vec::new();
    for (zoom, f, near, far) in [(1.0, 800.0, 1.0, 2.6), (3.0, 2400.0, 2.4, 5.0)] {
        let camera = camera(f);
        truths.push(camera);
        for pose in poses(8, near, far, 11) {
            let [off, on] = scene(&camera, &pose).render(&mut noise);
            rig.add_images(zoom, &off.view().unwrap(), Some(&on.view().unwrap())).unwrap();
            spots.push(hit(&camera, &pose));
        }
    }
    // Views that say nothing, each for its reason.
    let grey = Image { data: vec![90; 720 * 576], ..Image::new(PixelFormat::Gray8, 720, 576) };
    let empty_view = rig.add_images(1.0, &grey.view().unwrap(), None).unwrap();
    let [off, _] = scene(&truths[0], &poses(8, 1.0, 2.6, 11)[2]).render(&mut noise);
    let dark_view = rig.add_images(1.0, &off.view().unwrap(), Some(&off.view().unwrap())).unwrap();
    // The spot beside the board, as when the laser passes it and hits the wall.
    let away = LaserLine { x0: -0.25, ..LINE };
    let pose = poses(8, 1.0, 2.6, 11)[1];
    let [off, on] = Scene { line: away, ..scene(&truths[0], &pose) }.render(&mut noise);
    let beside_view = rig.add_images(1.0, &off.view().unwrap(), Some(&on.view().unwrap())).unwrap();
    assert_eq!(rig.fault(empty_view).map(Error::status), Some(Status::NotFound));
    assert_eq!(rig.spot_fault(dark_view).map(Error::status), Some(Status::NotFound));
    assert_eq!(rig.spot_fault(beside_view).map(Error::status), Some(Status::NotFound), "{beside_view}");
    // Another zoom without a board.
    rig.add_images(7.0, &grey.view().unwrap(), None).unwrap();

    let found = rig.solve().unwrap();
    assert_eq!(found.zooms.iter().map(|z| z.zoom).collect::<Vec<_>>(), [1.0, 3.0, 7.0]);
    for (i, camera) in truths.iter().enumerate() {
        let (model, covariance) = found.rig_model(i).unwrap();
        let (k, l) = (camera.intrinsics, model.laser);
        let e = [
            l.x0 - LINE.x0,
            l.y0 - LINE.y0,
            l.vx - LINE.vx,
            l.vy - LINE.vy,
            (model.intrinsics.fx / k.fx).ln(),
            model.intrinsics.cx - k.cx,
            model.intrinsics.cy - k.cy,
        ];
        for (j, e) in e.iter().enumerate() {
            let sigma = covariance[(j, j)].sqrt();
            println!("{i} {j}: off by {e:.3e}, sigma {sigma:.3e}");
            assert!(e.abs() < 3.0 * sigma, "{i} {j}: {e} {sigma}");
        }
        // And not by a sigma that says nothing: 0.3 mm, 1 mrad, 0.2 %.
        assert!(covariance[(0, 0)].sqrt() < 3e-4 && covariance[(2, 2)].sqrt() < 1e-3, "{i}");
        assert!(covariance[(4, 4)].sqrt() < 2e-3, "{i}");
    }
    assert!(found.common.as_ref().is_some_and(|c| c.agrees && c.freedom == 4));
    // Every view's fate.
    let used = |v: usize| found.views[v].fault.is_none();
    assert!((0..16).all(used) && !used(empty_view) && used(dark_view) && used(beside_view));
    assert_eq!(found.views[dark_view].spot_fault.as_ref().map(|f| f.status), Some(Status::NotFound));
    let lit = (0..16).filter(|v| found.views[*v].spot_used).count();
    assert!(lit >= 14, "{lit}");
    for (v, truth) in spots.iter().enumerate() {
        let view = &found.views[v];
        assert_eq!((view.corners.len(), view.residuals.len(), view.inliers.len()), (54, 54, 54));
        let Some(spot) = view.spot else { continue };
        let c = spot.pixel_covariance.unwrap();
        assert!((spot.pixel - truth).norm() < 4.0 * c.trace().sqrt(), "{v}: {} {truth} {c}", spot.pixel);
    }
    // The zoom without a board says so, and the others do not suffer.
    let lost = &found.zooms[2];
    assert_eq!(lost.boards.as_ref().map(|_| ()).map_err(Error::status), Err(Status::NotFound));
    assert_eq!(found.rig_model(2).map(|_| ()).map_err(|e| e.status()), Err(Status::NotFound));
    assert!(matches!(found.rig_model(3), Err(Error::InvalidArgument { .. })));
    // And a curve between the two.
    let curve = found.curve().unwrap();
    let f = curve.at(2.0).unwrap().model.intrinsics.fx;
    assert!((800.0..2400.0).contains(&f), "{f}");
}

#[test]
fn what_cannot_be_is_refused() {
    let new = |spec, options| RigCalibration::new(spec, options).map(|_| ());
    let default = RigCalibrationOptions::default;
    let invalid = |r: Result<(), Error>| assert!(matches!(r, Err(Error::InvalidArgument { .. })), "{r:?}");
    invalid(new(ChessboardSpec { columns: 2, ..SPEC }, default()));
    invalid(new(ChessboardSpec { rows: 200, ..SPEC }, default()));
    for square in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        invalid(new(ChessboardSpec { square, ..SPEC }, default()));
    }
    invalid(new(SPEC, RigCalibrationOptions { min_found: 1.5, ..default() }));
    for pupil_sigma in [-1.0, f64::NAN, f64::INFINITY] {
        invalid(new(SPEC, RigCalibrationOptions { pupil_sigma, ..default() }));
    }
    let lens = Some((camera(800.0).intrinsics, Distortion::None));
    let fixed = CalibrationOptions { fixed_lens: lens, ..Default::default() };
    invalid(new(SPEC, RigCalibrationOptions { calibration: fixed, ..default() }));

    let mut rig = empty(calibration());
    assert!(matches!(rig.solve(), Err(Error::TooFewPoints { given: 0, .. })));
    let image = |w, h| Image::new(PixelFormat::Gray8, w, h);
    let (a, b) = (image(720, 576), image(640, 480));
    let (a, b) = (a.view().unwrap(), b.view().unwrap());
    assert!(matches!(rig.add_images(f64::NAN, &a, None), Err(Error::NotFinite { name: "zoom", .. })));
    assert!(matches!(rig.add_images(1.0, &a, Some(&b)), Err(Error::InvalidArgument { name: "on", .. })));
    rig.add_images(1.0, &a, None).unwrap();
    assert!(matches!(rig.add_images(1.0, &b, None), Err(Error::InvalidArgument { name: "image size", .. })));
    assert_eq!(rig.len(), 1);
    let spot = |x: f64| BoardSpot { pixel: Vector2::new(x, 1.0), pixel_covariance: None };
    assert!(matches!(rig.set_spot(0, spot(1.0)), Err(Error::InvalidArgument { name: "view", .. })));
    assert!(matches!(rig.set_spot(1, spot(1.0)), Err(Error::InvalidArgument { name: "view", .. })));
    let corner = |i: usize| BoardCorner {
        board: Vector2::new((i % 3) as f64, (i / 3) as f64),
        pixel: Vector2::new(100.0 + 30.0 * (i % 3) as f64, 100.0 + 30.0 * (i / 3) as f64),
        pixel_covariance: None,
    };
    let corners: Vec<_> = (0..9).map(corner).collect();
    assert!(matches!(rig.add_corners(1.0, [720, 576], &corners[..3]), Err(Error::TooFewPoints { .. })));
    let view = rig.add_corners(1.0, [720, 576], &corners).unwrap();
    assert!(matches!(rig.set_spot(view, spot(f64::NAN)), Err(Error::NotFinite { .. })));
    // One frontal view: its position says why it has no answer, and the curve that there is none.
    let found = rig.solve().unwrap();
    assert!(found.zooms[0].boards.is_err() && found.views[1].fault.is_some());
    assert!(matches!(found.curve(), Err(Error::TooFewSpots { .. })));
    // A cancelled solve is the only one that fails as a whole.
    let options = calibration();
    options.cancel.cancel();
    let mut rig = empty(options);
    rig.add_corners(1.0, [720, 576], &corners).unwrap();
    assert!(matches!(rig.solve(), Err(Error::Cancelled)));
}

fn photographs(folder: &Path, prefix: &str, spec: ChessboardSpec, distortion: DistortionModel) -> RigCalibrated {
    let calibration = CalibrationOptions {
        distortion,
        aspect_sigma: f64::INFINITY,
        skew_sigma: 0.0,
        ..CalibrationOptions::default()
    };
    let mut rig =
        RigCalibration::new(spec, RigCalibrationOptions { calibration, ..RigCalibrationOptions::default() }).unwrap();
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()).collect();
    paths.retain(|p| {
        let name = p.file_name().unwrap().to_string_lossy();
        name.starts_with(prefix) && (name.ends_with(".jpg") || name.ends_with(".png"))
    });
    paths.sort();
    for path in paths {
        rig.add_images(1.0, &data::picture(&path).view().unwrap(), None).unwrap();
    }
    rig.solve().unwrap()
}

/// Bouguet's toolbox (truth.json) and OpenCV 5's calibrateCamera on its own corners (SOURCE.md), from
/// photographs through detection and calibration in one go. Two sets of corners differ by their own noise:
/// ours has a standard deviation of 0.35 px in f, the toolbox states 1.1 px (three sigmas).
#[test]
fn the_stereo_photographs_give_the_toolboxs_cameras() {
    let Some(folder) = data::folder("bouguet_opencv_stereo14") else { return };
    // The toolbox's size of a square.
    let spec = ChessboardSpec { columns: 9, rows: 6, square: 0.03 };
    let sides = ["left", "right"].map(|side| photographs(&folder, side, spec, DistortionModel::BrownConrady));
    for (found, [fx, fy, cx, cy], opencv_rms) in
        [(&sides[0], [532.99, 533.15, 341.76, 234.10], 0.199), (&sides[1], [536.94, 536.53, 326.47, 249.33], 0.2109)]
    {
        let c = &found.zooms[0].boards.as_ref().unwrap().calibration;
        let k = c.camera.intrinsics;
        println!("{k:?} {:?} rms {}", c.camera.distortion, c.rms);
        assert!((k.fx - fx).abs() < 0.8 && (k.fy - fy).abs() < 0.8, "{k:?}");
        assert!((k.cx - cx).abs() < 0.8 && (k.cy - cy).abs() < 0.8, "{k:?}");
        assert!(c.rms <= opencv_rms, "{}", c.rms);
        assert!(found.views.iter().all(|v| v.fault.is_none() && v.corners.len() == 54));
        // No laser here, and that is no fault of a view.
        assert!(found.zooms[0].laser.is_err() && found.views.iter().all(|v| v.spot_fault.is_none()));
    }
    // The pair's baseline, each view's board seen by both.
    let poses = |found: &RigCalibrated| -> Vec<Rigid> { found.views.iter().map(|v| v.pose.unwrap().pose).collect() };
    let pairs: Vec<Vector3<f64>> = poses(&sides[0])
        .iter()
        .zip(poses(&sides[1]))
        .map(|(l, r)| r.translation - r.rotation * l.rotation.transpose() * l.translation)
        .collect();
    let mean = pairs.iter().sum::<Vector3<f64>>() * (1000.0 / pairs.len() as f64);
    println!("baseline {mean:?} mm");
    assert!((mean - Vector3::new(-99.80, 1.12, 0.05)).amax() < 0.6 && (mean.norm() - 99.81).abs() < 0.3, "{mean}");
}

/// OpenCV 5 with two coefficients: 13 of 13 boards, rms 0.1624 px.
#[test]
fn the_sony_photographs_give_opencvs_camera() {
    let Some(folder) = data::folder("boof_sony_chess") else { return };
    let spec = ChessboardSpec { columns: 4, rows: 6, square: 0.03 };
    let found = photographs(&folder, "frame", spec, DistortionModel::Radial2);
    let c = &found.zooms[0].boards.as_ref().unwrap().calibration;
    let k = c.camera.intrinsics;
    println!("{k:?} {:?} rms {}, sigma f {}", c.camera.distortion, c.rms, c.covariance[(0, 0)].sqrt());
    assert!(found.views.iter().all(|v| v.fault.is_none()), "all 13 boards");
    assert!((k.fx - 700.93).abs() < 1.0 && (k.fy - 698.55).abs() < 1.0, "{k:?}");
    assert!((k.cx - 307.78).abs() < 1.5 && (k.cy - 247.47).abs() < 1.5, "{k:?}");
    assert!(c.rms <= 0.1624, "{}", c.rms);
}
