//! Real cameras: measured 2D-3D points against published calibrations.

use std::path::Path;

use nalgebra::{Matrix3, Vector2, Vector3};
use ptzcal::calibrate::{Calibration, CalibrationOptions, Correspondences, DistortionModel, calibrate_camera};
use ptzcal::geometry::{Distortion, Intrinsics};

use super::figure::Figure;
use super::{data, meva};

pub fn run(report: &mut impl FnMut(Vec<Figure>)) {
    for (name, measure) in
        [("meva", meva as fn(&Path) -> Option<Vec<Figure>>), ("zhang_msr", zhang), ("bouguet_opencv_stereo14", stereo)]
    {
        if let Some(path) = data::folder(name) {
            // Data that are there but do not calibrate are a figure that is missed.
            report(
                measure(&path).unwrap_or_else(|| vec![against(format!("{name}: no calibration"), 1.0, 0.0, 0.0, "")]),
            );
        }
    }
}

fn against(setup: impl Into<String>, figure: f64, truth: f64, tolerance: f64, unit: &'static str) -> Figure {
    let off = (figure - truth).abs();
    Figure {
        goal: "real",
        setup: setup.into(),
        figure,
        unit,
        bound: truth,
        ratio: off / tolerance,
        limit: 1.0,
        runs: 1,
    }
}

fn calibrate(
    size: (u32, u32),
    world: &[Vector3<f64>],
    pixels: &[Vector2<f64>],
    options: &CalibrationOptions,
) -> Option<Calibration> {
    let mut set = Correspondences::new(size.0, size.1).ok()?;
    set.add_points(world, pixels).ok()?;
    calibrate_camera(&set, options).map_err(|e| println!("{e}")).ok()
}

/// Surveillance cameras from hand-annotated pixels of surveyed points. G341 has no distortion; G506 has
/// much, and its points are nearly flat; G436 has eleven points, so its answer must fit its covariance.
fn meva(folder: &Path) -> Option<Vec<Figure>> {
    let mut figures = Vec::new();
    for (name, distortion) in [
        ("G341", DistortionModel::None),
        ("G506", DistortionModel::Division),
        ("G506", DistortionModel::Radial2),
        ("G436", DistortionModel::Division),
    ] {
        let truth = meva::camera(folder, name).map_err(|e| println!("{e}")).ok()?;
        let options = CalibrationOptions { distortion, ..Default::default() };
        let c = calibrate_camera(&truth.set, &options).map_err(|e| println!("{e}")).ok()?;
        let f = c.camera.intrinsics.fx;
        let off = (c.camera.centre() - truth.centre).norm();
        let size = c.covariance.nrows();
        let of_centre = (size - 3..size).map(|i| c.covariance[(i, i)]).sum::<f64>().sqrt();
        let (f_within, off_within) = match name {
            "G341" => (0.005 * truth.focal, 0.15),
            "G506" => (0.005 * truth.focal, 0.05),
            _ => (3.0 * c.covariance[(0, 0)].sqrt(), 3.0 * of_centre),
        };
        let setup = format!("MEVA {name}, {} surveyed points, {distortion:?}", truth.set.len());
        figures.push(against(format!("{setup}: f"), f, truth.focal, f_within, "px"));
        figures.push(against(format!("{setup}: centre off by"), off, 0.0, off_within, "m"));
    }
    Some(figures)
}

/// Zhang's measured corners in the camera frame of his published poses.
fn zhang(folder: &Path) -> Option<Vec<Figure>> {
    let published = data::numbers(&folder.join("calibration-result-zhang-withdistortion.txt")).ok()?;
    let k = &published[0];
    let model: Vec<f64> = data::numbers(&folder.join("Model.txt")).ok()?.concat();
    let (mut world, mut pixels) = (Vec::new(), Vec::new());
    for view in 0..5 {
        let rows = &published[2 + 4 * view..6 + 4 * view];
        let r = Matrix3::from_fn(|i, j| rows[i][j]);
        let t = Vector3::from_column_slice(&rows[3]);
        let seen: Vec<f64> = data::numbers(&folder.join(format!("data{}.txt", view + 1))).ok()?.concat();
        for (m, x) in seen.chunks_exact(2).zip(model.chunks_exact(2)) {
            world.push(r * Vector3::new(x[0], x[1], 0.0) + t);
            pixels.push(Vector2::new(m[0], m[1]));
        }
    }
    let options = CalibrationOptions {
        distortion: DistortionModel::Radial2,
        skew_sigma: f64::INFINITY,
        aspect_sigma: f64::INFINITY,
        robust: false,
        ..Default::default()
    };
    let c = calibrate((640, 480), &world, &pixels, &options)?;
    let i = c.camera.intrinsics;
    let d = c.camera.distortion.coefficients().to_vec();
    Some(vec![
        against("Zhang, 1280 points: fx", i.fx, k[0], 0.5, "px"),
        against("Zhang: fy", i.fy, k[2], 0.5, "px"),
        against("Zhang: cx", i.cx, k[3], 0.5, "px"),
        against("Zhang: cy", i.cy, k[4], 0.5, "px"),
        against("Zhang: k1", d[0], -0.228601, 0.005, ""),
        against("Zhang: k2", d[1], 0.190353, 0.02, ""),
        against("Zhang: rms", c.rms, 0.336434, 0.003, "px"),
    ])
}

/// The right camera as a fixed camera, from 3D points that the left one measures: boards posed by the
/// left camera's published lens.
fn stereo(folder: &Path) -> Option<Vec<Figure>> {
    let text = std::fs::read_to_string(folder.join("truth.json")).ok()?;
    let truth: serde_json::Value = serde_json::from_str(&text).ok()?;
    let list = |side: &str, key: &str| -> Vec<f64> {
        truth[side][key].as_array().into_iter().flatten().filter_map(|v| v.as_f64()).collect()
    };
    let (fc, cc, kc) = (list("toolbox_left", "fc"), list("toolbox_left", "cc"), list("toolbox_left", "kc"));
    let left = CalibrationOptions {
        fixed_lens: Some((
            Intrinsics { fx: fc[0], fy: fc[1], skew: 0.0, cx: cc[0], cy: cc[1] },
            Distortion::BrownConrady([kc[0], kc[1], kc[2], kc[3], kc[4]]),
        )),
        ..Default::default()
    };
    let (mut world, mut pixels) = (Vec::new(), Vec::new());
    for view in 1..=14 {
        let corners = |side: &str| data::numbers(&folder.join(format!("corners_toolbox/{side}{view:02}.csv")));
        let (a, b) = (corners("left").ok()?, corners("right").ok()?);
        let board: Vec<_> = a.iter().map(|r| Vector3::new(r[0] * 1e-3, r[1] * 1e-3, 0.0)).collect();
        let seen: Vec<_> = a.iter().map(|r| Vector2::new(r[2], r[3])).collect();
        let pose = calibrate((640, 480), &board, &seen, &left)?.camera.pose;
        world.extend(board.iter().map(|x| pose.apply(x)));
        pixels.extend(b.iter().map(|r| Vector2::new(r[2], r[3])));
    }
    let options = CalibrationOptions { distortion: DistortionModel::BrownConrady, ..Default::default() };
    let c = calibrate((640, 480), &world, &pixels, &options)?;
    let right = list("toolbox_right", "fc");
    let t = c.camera.pose.translation * 1e3;
    Some(vec![
        against("stereo14, right camera from the left's points: fx", c.camera.intrinsics.fx, right[0], 2.0, "px"),
        against("stereo14: fy", c.camera.intrinsics.fy, right[1], 2.0, "px"),
        against("stereo14: baseline t_x", t.x, -99.80, 0.5, "mm"),
        against("stereo14: rms", c.rms, 0.2109, 0.1, "px"),
    ])
}
