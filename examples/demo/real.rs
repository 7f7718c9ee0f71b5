//! A real surveillance camera from hand-annotated pixels of surveyed points.

use std::path::Path;

use ptzcal::calibrate::{CalibrationOptions, calibrate_camera};
use ptzcal::format::{CameraRecord, write_camera};

use super::{Outcome, data, meva};

pub fn run(folder: &Path) -> Outcome<()> {
    let Some(path) = data::folder("meva") else { return Ok(()) };
    let truth = meva::camera(&path, "G341")?;
    let c = calibrate_camera(&truth.set, &CalibrationOptions::default())?;
    let sigma = |i: usize| c.covariance[(i, i)].sqrt();
    println!(
        "   f {:.1} +- {:.1} px (published {:.1}), centre off by {:.3} m (sigma {:.3}), {} of {} points used, rms {:.2} px",
        c.camera.intrinsics.fx,
        sigma(0),
        truth.focal,
        (c.camera.centre() - truth.centre).norm(),
        (c.covariance[(8, 8)] + c.covariance[(9, 9)] + c.covariance[(10, 10)]).sqrt(),
        c.inliers.iter().filter(|i| **i).count(),
        truth.set.len(),
        c.rms
    );
    write_camera(&folder.join("meva_G341.json"), &CameraRecord { camera: c.camera, calibration: None })?;
    Ok(())
}
