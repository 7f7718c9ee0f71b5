//! Camera_info files of ROS, as camera_calibration_parsers reads and writes them: camera_matrix and
//! distortion_coefficients are of the raw image, as ours are; rectification_matrix and
//! projection_matrix make the rectified image, and are the identity and [K | 0] for a camera alone.
//!
//! The format has no pose (ROS keeps it in tf): none is read, and what is written holds none.

use super::super::tree::{self, Place};
use super::number::{numbers, quoted};
use super::opencv::{lens_of, matrix};
use super::{CameraFormat, NamedCamera, checked, no_lens, without_skew};
use crate::error::Result;
use crate::geometry::Distortion;

pub(super) fn read(text: &str, name: &str) -> Result<Vec<NamedCamera>> {
    let tree = tree::yaml(text).map_err(|fault| fault.of_file(name))?;
    let root = Place::root(name, &tree);
    root.need("distortion_model")?;
    root.need("distortion_coefficients")?;
    let camera = checked(lens_of(&root)?, &root)?;
    // Of the rectified image: ROS's own reader wants to see them.
    matrix::<9>(&root.need("rectification_matrix")?, 3)?;
    matrix::<12>(&root.need("projection_matrix")?, 3)?;
    let name = root.get("camera_name")?.map_or(Ok(""), |n| n.text())?.to_owned();
    Ok(vec![NamedCamera { name, camera, has_pose: false }])
}

pub(super) fn write(file: &NamedCamera) -> Result<String> {
    let format = CameraFormat::Ros;
    let camera = &file.camera;
    without_skew(camera, format)?;
    let lens = camera.distortion;
    let (model, coefficients) = match &lens {
        Distortion::None => ("plumb_bob", &[0.0; 5][..]),
        Distortion::BrownConrady(_) => ("plumb_bob", lens.coefficients()),
        Distortion::Fisheye(_) => ("equidistant", lens.coefficients()),
        Distortion::Division(_) => return Err(no_lens("the division model", format)),
    };
    let k = camera.intrinsics;
    let (width, height) = (camera.width, camera.height);
    let text = format!(
        "# Lens only: the format has no pose.\nimage_width: {width}\nimage_height: {height}\ncamera_name: {}\n{}\
         distortion_model: {model}\n{}{}{}",
        quoted(&file.name),
        entry("camera_matrix", 3, &[k.fx, 0.0, k.cx, 0.0, k.fy, k.cy, 0.0, 0.0, 1.0]),
        entry("distortion_coefficients", 1, coefficients),
        entry("rectification_matrix", 3, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]),
        entry("projection_matrix", 3, &[k.fx, 0.0, k.cx, 0.0, 0.0, k.fy, k.cy, 0.0, 0.0, 0.0, 1.0, 0.0]),
    );
    Ok(text)
}

fn entry(key: &str, rows: usize, data: &[f64]) -> String {
    format!("{key}:\n  rows: {rows}\n  cols: {}\n  data: [{}]\n", data.len() / rows, numbers(data, ", "))
}
