//! Fixed cameras from real and rendered RGB-D images of ../shared/data (or $PTZCAL_DATA); skipped when
//! they are absent.

#[path = "support/data.rs"]
mod data;

use std::path::Path;

use data::{folder, numbers};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use ptzcal::calibrate::Calibration;
use ptzcal::error::Result;
use ptzcal::format::{read_depth, read_picture};
use ptzcal::geometry::{Camera, Distortion, Intrinsics, Rigid, rigid};
use ptzcal::rgbd::{RgbdCalibration, RgbdCalibrator, RgbdOptions};

/// The auxiliary camera at the origin.
fn auxiliary(intrinsics: Intrinsics) -> Camera {
    Camera { width: 640, height: 480, intrinsics, distortion: Distortion::None, pose: Rigid::identity() }
}

/// (colour, depth) of the auxiliary view, colour of the fixed camera's.
fn calibrate(files: [&Path; 3], metres: f64, intrinsics: Intrinsics, options: RgbdOptions) -> Result<RgbdCalibration> {
    let [colour, depth, fixed] = files;
    let fixed = read_picture(fixed)?;
    let mut calibrator = RgbdCalibrator::new(&fixed.view()?, options)?;
    let depth = read_depth(depth, metres)?;
    let counts = calibrator.add_view(&read_picture(colour)?.view()?, &depth, &auxiliary(intrinsics))?;
    eprintln!("{counts:?}");
    calibrator.calibrate()
}

/// Angle (radians) and distance (metres) between a calibrated camera and a pose.
fn pose_error(calibration: &Calibration, truth: &Rigid) -> (f64, f64) {
    let pose = &calibration.camera.pose;
    (rigid::log(&(pose.rotation * truth.rotation.transpose())).norm(), (pose.centre() - truth.centre()).norm())
}

/// Pose of camera `to` in the frame of camera `from`; rows are tx ty tz qx qy qz qw, camera to world.
fn relative(rows: &[Vec<f64>], from: usize, to: usize) -> Rigid {
    let pose = |row: &[f64]| {
        let q = UnitQuaternion::from_quaternion(Quaternion::new(row[6], row[3], row[4], row[5]));
        Rigid { rotation: *q.to_rotation_matrix().matrix(), translation: Vector3::new(row[0], row[1], row[2]) }
    };
    pose(&rows[to]).inverse().after(&pose(&rows[from]))
}

fn report(name: &str, r: &RgbdCalibration, truth: &Rigid) {
    let c = &r.calibration;
    let (angle, distance) = pose_error(c, truth);
    let k = &c.camera.intrinsics;
    let used = c.inliers.iter().filter(|i| **i).count();
    eprintln!(
        "{name}: f {:.2} {:.2} c {:.2} {:.2} +- {:.2} {:.2} {:.2}, {:.3} deg {:.1} mm, {used} of {} used, rms {:.3}, noise {:.2}, sigma {:.2}",
        k.fx,
        k.fy,
        k.cx,
        k.cy,
        c.covariance[(0, 0)].sqrt(),
        c.covariance[(3, 3)].sqrt(),
        c.covariance[(4, 4)].sqrt(),
        angle.to_degrees(),
        1e3 * distance,
        c.inliers.len(),
        c.rms,
        c.noise_factor,
        r.keypoint_sigma
    );
}

#[test]
fn kinect_frames_calibrate_each_other() {
    let Some(folder) = folder("rgbd_nyu") else { return };
    let poses = numbers(&folder.join("pose.txt")).unwrap();
    let k = Intrinsics { fx: 518.0, fy: 519.0, skew: 0.0, cx: 325.5, cy: 253.5 };
    for (from, to) in [(3, 4), (4, 5)] {
        let truth = relative(&poses, from - 3, to - 3);
        let file = |name: String| folder.join(name);
        let files =
            [file(format!("color{from}.png")), file(format!("depth{from}.pgm")), file(format!("color{to}.png"))];
        let found = calibrate(files.each_ref().map(|f| f.as_path()), 1e-3, k, tuned());
        match found {
            Ok(found) => report(&format!("nyu {from}->{to}"), &found, &truth),
            Err(e) => eprintln!("{e}"),
        }
    }
}

#[test]
fn rendered_frames_calibrate_each_other() {
    let Some(folder) = folder("rgbd_redwood_open3d") else { return };
    let rows = numbers(&folder.join("trajectory.log")).unwrap();
    let pose = |i: usize| {
        let m = &rows[5 * i + 1..5 * i + 4];
        let rotation = Matrix3::from_fn(|r, c| m[r][c]);
        Rigid { rotation, translation: Vector3::new(m[0][3], m[1][3], m[2][3]) }
    };
    for to in [1, 2, 3, 4] {
        let truth = pose(to).inverse().after(&pose(0));
        let files = [folder.join("color0.jpg"), folder.join("depth0.png"), folder.join(format!("color{to}.jpg"))];
        let k = Intrinsics::new(525.0, 319.5, 239.5);
        match calibrate(files.each_ref().map(|f| f.as_path()), 1e-3, k, tuned()) {
            Ok(f) => {
                report(&format!("redwood {to}"), &f, &truth);
                dump(&format!("{to}"), &f, k, &truth)
            }
            Err(e) => eprintln!("{e}"),
        }
    }
}

#[test]
fn frames_without_texture_are_refused() {
    let Some(folder) = folder("rgbd_icl") else { return };
    let files = [folder.join("color1.png"), folder.join("depth1.png"), folder.join("color4.png")];
    let k = Intrinsics { fx: 481.2, fy: 480.0, skew: 0.0, cx: 319.5, cy: 239.5 };
    let e = calibrate(files.each_ref().map(|f| f.as_path()), 2e-4, k, tuned())
        .map(|r| report("icl", &r, &Rigid::identity()));
    eprintln!("{e:?}");
}

fn dump(name: &str, r: &RgbdCalibration, k: Intrinsics, truth: &Rigid) {
    let camera = Camera { pose: *truth, ..auxiliary(k) };
    for (p, i) in r.points.iter().zip(&r.calibration.inliers) {
        let seen = camera.project(&p.lifted.world).unwrap();
        let e = p.fixed - seen;
        eprintln!(
            "D {name} {:.1} {:.1} {:.3} {:.3} {:.3} {} {:.3}",
            p.lifted.pixel.x, p.lifted.pixel.y, p.lifted.world.z, e.x, e.y, i, 1.0
        );
    }
}

fn tuned() -> RgbdOptions {
    let mut o = RgbdOptions::default();
    let v = |n: &str, d: f64| std::env::var(n).ok().and_then(|v| v.parse().ok()).unwrap_or(d);
    o.sift.contrast_threshold = v("CONTRAST", 0.04);
    o.sift.edge_ratio = v("EDGE", 10.0);
    o.matching.max_ratio = v("RATIO", 0.8);
    o.depth_noise.inverse_depth = v("RHO", 1.425e-3);
    if v("KNOWN", 0.0) > 0.0 {
        o.calibration.fixed_lens = Some((Intrinsics::new(525.0, 319.5, 239.5), Distortion::None));
    }
    o.guided = v("GUIDED", 1.0) > 0.0;
    o
}
