//! Calibration from lines, alone and together with points, against simulated truth; its refusals.

#[path = "support/edges.rs"]
mod edges;
#[path = "support/thesis.rs"]
mod thesis;

use edges::{Edge, edges, line_set, observed};
use nalgebra::{Matrix2, Matrix3, Matrix6, Vector2, Vector3};
use ptzcal::Error;
use ptzcal::calibrate::{
    CalibrationOptions, Correspondences, DistortionModel, Observation, ObservedLine, calibrate_camera, decompose, dlt,
};
use ptzcal::error::Degeneracy;
use ptzcal::geometry::{Camera, Distortion, Line3};
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
