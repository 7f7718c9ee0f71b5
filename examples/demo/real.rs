//! A real surveillance camera from hand-annotated pixels of surveyed points.

use std::path::Path;

use nalgebra::{Matrix3, Vector2, Vector3};
use ptzcal::calibrate::{CalibrationOptions, Correspondences, calibrate_camera};
use ptzcal::format::{CameraRecord, write_camera};

use super::{Outcome, data};

pub fn run(folder: &Path) -> Outcome<()> {
    let Some(meva) = data::folder("meva") else { return Ok(()) };
    let krtd = data::numbers(&meva.join("cameras/G341.krtd"))?;
    let r = Matrix3::from_fn(|i, j| krtd[3 + i][j]);
    let centre = -(r.transpose() * Vector3::from_column_slice(&krtd[6]));
    let mut set = Correspondences::new(1920, 1080)?;
    for row in data::numbers(&meva.join("corr/G341.csv"))? {
        set.add_points(&[Vector3::new(row[1], row[2], row[3])], &[Vector2::new(row[4], row[5])])?;
    }
    let c = calibrate_camera(&set, &CalibrationOptions::default())?;
    let sigma = |i: usize| c.covariance[(i, i)].sqrt();
    println!(
        "   f {:.1} +- {:.1} px (published {:.1}), centre off by {:.3} m (sigma {:.3}), {} of {} points used, rms {:.2} px",
        c.camera.intrinsics.fx,
        sigma(0),
        krtd[0][0],
        (c.camera.centre() - centre).norm(),
        (c.covariance[(8, 8)] + c.covariance[(9, 9)] + c.covariance[(10, 10)]).sqrt(),
        c.inliers.iter().filter(|i| **i).count(),
        set.len(),
        c.rms
    );
    write_camera(&folder.join("meva_G341.json"), &CameraRecord { camera: c.camera, calibration: None })?;
    Ok(())
}
