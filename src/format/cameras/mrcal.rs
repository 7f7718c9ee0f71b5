//! Camera models of mrcal (.cameramodel): a dict of Python with lensmodel, intrinsics (fx fy cx cy and
//! the lens), imagersize and the pose as rt_cam_ref, the rotation vector and the translation from the
//! reference frame (our world) to the camera. Files before mrcal 2.5 call the pose extrinsics.
//!
//! mrcal's splined, stereographic and CAHVOR models are not ours and are refused, as are our division
//! and fisheye models in its files: mrcal has neither.

use nalgebra::{Rotation3, UnitQuaternion, Vector3};

use super::super::tree::{self, Place};
use super::number::numbers;
use super::{CameraFormat, NamedCamera, checked, lens, no_lens, nowhere, without_skew};
use crate::error::Result;
use crate::geometry::rigid::exp;
use crate::geometry::{Camera, Distortion, Intrinsics, Rigid};

pub(super) fn read(text: &str, name: &str) -> Result<Vec<NamedCamera>> {
    let tree = tree::python(text).map_err(|fault| fault.of_file(name))?;
    let root = Place::root(name, &tree);
    let model = root.need("lensmodel")?;
    let count = match model.text()? {
        "LENSMODEL_PINHOLE" => 0,
        "LENSMODEL_OPENCV4" => 4,
        "LENSMODEL_OPENCV5" => 5,
        "LENSMODEL_OPENCV8" => 8,
        "LENSMODEL_OPENCV12" => 12,
        other => return Err(model.unsupported(format!("the lens model '{}'", tree::shown(other)))),
    };
    let place = root.need("intrinsics")?;
    let values = place.reals()?;
    let (&[fx, fy, cx, cy], coefficients) =
        values.split_first_chunk().ok_or_else(|| place.wrong("fewer than 4 numbers"))?;
    if coefficients.len() != count {
        return Err(place.wrong(format!("{} numbers of a lens that has {count}", coefficients.len())));
    }
    let size = root.need("imagersize")?;
    let [width, height] = match &size.items()?[..] {
        [width, height] => [width.count()?, height.count()?],
        _ => return Err(size.wrong("not two numbers")),
    };
    let (new, old) = (root.get("rt_cam_ref")?, root.get("extrinsics")?);
    let pose = match (new, old) {
        (None, None) => None,
        (Some(place), None) | (None, Some(place)) => Some(place.numbers::<6>()?),
        (Some(new), Some(old)) => {
            let pose = new.numbers::<6>()?;
            if pose != old.numbers::<6>()? {
                return Err(old.wrong("not what rt_cam_ref is"));
            }
            Some(pose)
        }
    };
    let camera = Camera {
        width,
        height,
        intrinsics: Intrinsics { fx, fy, skew: 0.0, cx, cy },
        distortion: lens::on_plane(coefficients, &place)?,
        pose: pose.map_or(nowhere(), |[r0, r1, r2, t0, t1, t2]| Rigid {
            rotation: exp(&Vector3::new(r0, r1, r2)),
            translation: Vector3::new(t0, t1, t2),
        }),
    };
    Ok(vec![NamedCamera { name: String::new(), camera: checked(camera, &root)?, has_pose: pose.is_some() }])
}

/// Both names of the pose, so that every version of mrcal finds the one it knows.
pub(super) fn write(file: &NamedCamera) -> Result<String> {
    let format = CameraFormat::Mrcal;
    let camera = &file.camera;
    without_skew(camera, format)?;
    let lens = camera.distortion;
    let model = match &lens {
        Distortion::None => "LENSMODEL_PINHOLE",
        Distortion::BrownConrady(_) => "LENSMODEL_OPENCV5",
        Distortion::Division(_) => return Err(no_lens("the division model", format)),
        Distortion::Fisheye(_) => return Err(no_lens("the fisheye model", format)),
    };
    let k = camera.intrinsics;
    let intrinsics = [&[k.fx, k.fy, k.cx, k.cy], lens.coefficients()].concat();
    // By way of the quaternion, which is exact for half turns too.
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(camera.pose.rotation));
    let pose = [turn.scaled_axis().as_slice(), camera.pose.translation.as_slice()].concat();
    let pose = numbers(&pose, ", ");
    Ok(format!(
        "{{\n    'lensmodel': '{model}',\n\n    # fx, fy, cx, cy, then the lens\n    'intrinsics': [ {} ],\n\n    \
         # rotation vector and translation, from the world to the camera\n    'rt_cam_ref': [ {pose} ],\n    \
         'extrinsics': [ {pose} ],\n\n    'imagersize': [ {}, {} ]\n}}\n",
        numbers(&intrinsics, ", "),
        camera.width,
        camera.height,
    ))
}
