//! Fixed cameras from real and rendered RGB-D images of ../shared/data (or $PTZCAL_DATA); skipped when
//! they are absent.

#[path = "support/data.rs"]
mod data;

use std::path::Path;

use data::{folder, numbers};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use ptzcal::calibrate::{Calibration, CalibrationOptions};
use ptzcal::error::{Result, Status};
use ptzcal::format::{read_depth, read_picture};
use ptzcal::geometry::{Camera, Distortion, Intrinsics, Rigid, rigid};
use ptzcal::rgbd::{RgbdCalibration, RgbdCalibrator, RgbdOptions};

/// The auxiliary camera at the origin.
fn auxiliary(intrinsics: Intrinsics) -> Camera {
    Camera { width: 640, height: 480, intrinsics, distortion: Distortion::None, pose: Rigid::identity() }
}

/// (colour, depth) of the auxiliary view, colour of the fixed camera's.
fn calibrate(
    files: [&Path; 3],
    metres: f64,
    intrinsics: Intrinsics,
    options: RgbdOptions,
    calibration: &CalibrationOptions,
) -> Result<RgbdCalibration> {
    let [colour, depth, fixed] = files;
    let fixed = read_picture(fixed)?;
    let mut calibrator = RgbdCalibrator::new(&fixed.view()?, options)?;
    let depth = read_depth(depth, metres)?;
    calibrator.add_view(&read_picture(colour)?.view()?, &depth, &auxiliary(intrinsics))?;
    calibrator.calibrate(calibration)
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

/// The camera's error within its own standard deviations, and within bounds: of the focal lengths
/// relative, of the principal point pixels, of the pose degrees and millimetres.
fn check(name: &str, found: &RgbdCalibration, lens: &Intrinsics, truth: &Rigid, bounds: [f64; 4]) {
    let c = &found.calibration;
    let (angle, distance) = pose_error(c, truth);
    let k = &c.camera.intrinsics;
    let errors = [
        (k.fx / lens.fx - 1.0).abs().max((k.fy / lens.fy - 1.0).abs()),
        (k.cx - lens.cx).abs().max((k.cy - lens.cy).abs()),
        angle.to_degrees(),
        1e3 * distance,
    ];
    let used = c.inliers.iter().filter(|i| **i).count();
    println!(
        "{name}: f {:.1} {:.1} c {:.1} {:.1}, {:.3} deg {:.1} mm, {used} of {} points and lines",
        k.fx,
        k.fy,
        k.cx,
        k.cy,
        errors[2],
        errors[3],
        c.inliers.len()
    );
    for (error, bound) in errors.iter().zip(bounds) {
        assert!(*error <= bound, "{name}: {errors:?} {bounds:?}");
    }
}

/// The truth is a SLAM estimate that the data's notes give up to 0.8 degrees and 79 mm.
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
        for lines in [false, true] {
            let options = RgbdOptions { lines, ..RgbdOptions::default() };
            let found =
                calibrate(files.each_ref().map(|f| f.as_path()), 1e-3, k, options, &CalibrationOptions::default());
            let found = found.unwrap();
            assert_eq!(found.lines.is_empty(), !lines);
            check(&format!("NYU {from} -> {to}"), &found, &k, &truth, [0.01, 6.0, 1.0, 80.0]);
        }
    }
}

/// Camera to world.
fn redwood_pose(rows: &[Vec<f64>], frame: usize) -> Rigid {
    let m = &rows[5 * frame + 1..5 * frame + 4];
    let rotation = Matrix3::from_fn(|r, c| m[r][c]);
    Rigid { rotation, translation: Vector3::new(m[0][3], m[1][3], m[2][3]) }
}

/// Rendered, with exact poses; depths have a sensor's noise and low-frequency errors. With an unknown
/// lens the rotation takes up what the principal point is off (0.7 pixels, a tenth of a degree).
#[test]
fn rendered_frames_calibrate_each_other() {
    let Some(folder) = folder("rgbd_redwood_open3d") else { return };
    let rows = numbers(&folder.join("trajectory.log")).unwrap();
    let k = Intrinsics::new(525.0, 319.5, 239.5);
    let lens = CalibrationOptions { fixed_lens: Some((k, Distortion::None)), ..CalibrationOptions::default() };
    for to in 1..5 {
        let truth = redwood_pose(&rows, to).inverse().after(&redwood_pose(&rows, 0));
        let files = [folder.join("color0.jpg"), folder.join("depth0.png"), folder.join(format!("color{to}.jpg"))];
        let files = files.each_ref().map(|f| f.as_path());
        let run = |options: &CalibrationOptions| calibrate(files, 1e-3, k, RgbdOptions::default(), options).unwrap();
        let name = format!("Redwood 0 -> {to}");
        check(&name, &run(&CalibrationOptions::default()), &k, &truth, [0.004, 1.2, 0.2, 5.0]);
        check(&format!("{name}, lens known"), &run(&lens), &k, &truth, [1e-12, 1e-9, 0.1, 5.0]);
    }
}

#[test]
fn frames_without_texture_are_refused() {
    let Some(folder) = folder("rgbd_icl") else { return };
    let files = [folder.join("color1.png"), folder.join("depth1.png"), folder.join("color4.png")];
    let k = Intrinsics { fx: 481.2, fy: 480.0, skew: 0.0, cx: 319.5, cy: 239.5 };
    let files = files.each_ref().map(|f| f.as_path());
    let e = calibrate(files, 2e-4, k, RgbdOptions::default(), &CalibrationOptions::default()).unwrap_err();
    assert_eq!(e.status(), Status::TooFewPoints);
    assert!(e.to_string().contains("features in the fixed camera's image"), "{e}");
}

/// More views tell more: four frames with their poses, in the world of the data.
#[test]
fn several_views_calibrate_together() {
    let Some(folder) = folder("rgbd_redwood_open3d") else { return };
    let rows = numbers(&folder.join("trajectory.log")).unwrap();
    let k = Intrinsics::new(525.0, 319.5, 239.5);
    let fixed = read_picture(&folder.join("color4.jpg")).unwrap();
    let mut calibrator = RgbdCalibrator::new(&fixed.view().unwrap(), RgbdOptions::default()).unwrap();
    for i in 0..4 {
        let colour = read_picture(&folder.join(format!("color{i}.jpg"))).unwrap();
        let depth = read_depth(&folder.join(format!("depth{i}.png")), 1e-3).unwrap();
        let camera = Camera { pose: redwood_pose(&rows, i).inverse(), ..auxiliary(k) };
        calibrator.add_view(&colour.view().unwrap(), &depth, &camera).unwrap();
    }
    let found = calibrator.calibrate(&CalibrationOptions::default()).unwrap();
    assert!((0..4).all(|view| found.points.iter().any(|p| p.view == view)));
    let truth = redwood_pose(&rows, 4).inverse();
    check("Redwood 0 to 3 -> 4", &found, &k, &truth, [0.004, 1.2, 0.2, 5.0]);
}
