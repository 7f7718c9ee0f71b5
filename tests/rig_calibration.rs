//! From pictures to a calibrated rig, in one go: rendered ones with known truth, and photographs.

#[path = "support/board_pictures.rs"]
mod board_pictures;
#[path = "support/data.rs"]
mod data;
#[path = "support/thesis.rs"]
mod thesis;

use std::path::Path;

use board_pictures::Scene;
use nalgebra::{Matrix3, Vector2, Vector3};
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
    CalibrationOptions { distortion: DistortionModel::Radial1, aspect_sigma: 0.0, skew_sigma: 0.0, ..Default::default() }
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

fn report(found: &RigCalibrated) {
    for z in &found.zooms {
        let k = z.boards.as_ref().map(|b| (b.calibration.camera.intrinsics, b.calibration.rms));
        println!("zoom {}: {k:?}; {:?}", z.zoom, z.laser.as_ref().map(|l| (l.line, l.rms)));
    }
    for (i, v) in found.views.iter().enumerate() {
        println!("{i}: {:?} {:?} spot {:?} {:?}", v.fault, v.spot_fault, v.spot.map(|s| s.pixel), v.spot_residual);
    }
    println!("{:?}", found.common);
}

#[test]
fn pictures_at_two_zooms_give_the_rig() {
    let mut rig = empty(calibration());
    let mut noise = Noise::new(5);
    let mut truths = Vec::new();
    for (zoom, f, near, far) in [(1.0, 800.0, 1.0, 3.0), (3.0, 2400.0, 2.4, 5.0)] {
        let camera = camera(f);
        truths.push(camera);
        for pose in poses(10, near, far, 11) {
            let [off, on] = scene(&camera, &pose).render(&mut noise);
            let view = rig.add_images(zoom, &off.view().unwrap(), Some(&on.view().unwrap())).unwrap();
            let (o, v) = (Vector3::new(LINE.x0, LINE.y0, 0.0), Vector3::new(LINE.vx, LINE.vy, 1.0));
            let n: Vector3<f64> = pose.rotation.column(2).into();
            let spot = camera.project(&(o + v * (n.dot(&(pose.translation - o)) / n.dot(&v)))).unwrap();
            println!("{view}: {:?} {:?}; true spot {spot:?}", rig.fault(view), rig.spot_fault(view));
        }
    }
    let found = rig.solve().unwrap();
    report(&found);
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
            println!("{i} {j}: off by {e:.3e}, sigma {:.3e}", covariance[(j, j)].sqrt());
        }
    }
}

fn load(path: &Path) -> Image {
    let rgb = image::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display())).to_rgb8();
    let (width, height) = rgb.dimensions();
    Image { format: PixelFormat::Rgb24, width, height, data: rgb.into_raw() }
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
        rig.add_images(1.0, &load(&path).view().unwrap(), None).unwrap();
    }
    rig.solve().unwrap()
}

#[test]
fn the_stereo_photographs_give_the_toolboxs_cameras() {
    let Some(folder) = data::folder("bouguet_opencv_stereo14") else { return };
    let spec = ChessboardSpec { columns: 9, rows: 6, square: 0.025 };
    for side in ["left", "right"] {
        let found = photographs(&folder, side, spec, DistortionModel::BrownConrady);
        let c = &found.zooms[0].boards.as_ref().unwrap().calibration;
        println!("{side}: {:?} {:?} rms {}", c.camera.intrinsics, c.camera.distortion, c.rms);
        for i in 0..4 {
            println!("sigma {}", c.covariance[(i, i)].sqrt());
        }
    }
}
