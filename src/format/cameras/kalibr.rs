//! Camera chains of Kalibr: cam0, cam1, ... with the motion T_cn_cnm1 from each camera's frame to the
//! next one's. There is no other world than the frame of cam0: written poses are taken relative to the
//! first camera's, and the ones read have cam0 at the identity. Cameras have the names of their ROS
//! topics, or cam0, cam1, ...

use nalgebra::{Matrix3, Vector3};

use super::super::tree::{self, Place};
use super::number::{numbers, quoted};
use super::{CameraFormat, MAX_CAMERAS, NamedCamera, checked, lens, no_lens, without_skew};
use crate::error::{Error, Result};
use crate::geometry::{Camera, Distortion, Intrinsics, Rigid};

pub(super) fn read(text: &str, name: &str) -> Result<Vec<NamedCamera>> {
    let tree = tree::yaml(text).map_err(|fault| fault.of_file(name))?;
    let root = Place::root(name, &tree);
    let is_camera = |key: &str| key.strip_prefix("cam").is_some_and(|n| n.parse::<u32>().is_ok());
    let count = root.entries()?.filter(|(key, _)| is_camera(key)).count();
    if count == 0 || count > MAX_CAMERAS {
        return Err(root.wrong(format!("{count} cameras")));
    }
    let mut cameras: Vec<NamedCamera> = Vec::new();
    for i in 0..count {
        let key = format!("cam{i}");
        // A chain with a link missing ends there.
        let place = root.need(&key)?;
        let pose = match cameras.last() {
            None => Rigid::identity(),
            Some(before) => motion(&place.need("T_cn_cnm1")?)?.after(&before.camera.pose),
        };
        let camera = Camera { pose, ..lens_of(&place)? };
        let name = place.get("rostopic")?.map_or(Ok(key.as_str()), |topic| topic.text())?.to_owned();
        cameras.push(NamedCamera { name, camera: checked(camera, &place)?, has_pose: true });
    }
    Ok(cameras)
}

fn lens_of(place: &Place<'_>) -> Result<Camera> {
    let model = place.need("camera_model")?;
    match model.text()? {
        "pinhole" => {}
        other => return Err(model.unsupported(format!("the camera model '{}'", tree::shown(other)))),
    }
    let [fx, fy, cx, cy] = place.need("intrinsics")?.numbers()?;
    let model = place.need("distortion_model")?;
    let coefficients = place.need("distortion_coeffs")?;
    let distortion = match model.text()? {
        "none" if coefficients.reals()?.iter().all(|k| *k == 0.0) => Distortion::None,
        "none" => return Err(coefficients.wrong("coefficients of no distortion")),
        "radtan" => lens::on_plane(&coefficients.numbers::<4>()?, &coefficients)?,
        "equidistant" | "equi" => lens::fisheye(&coefficients.reals()?, &coefficients)?,
        other => return Err(model.unsupported(format!("the distortion model '{}'", tree::shown(other)))),
    };
    let size = place.need("resolution")?;
    let [width, height] = match &size.items()?[..] {
        [width, height] => [width.count()?, height.count()?],
        _ => return Err(size.wrong("not two numbers")),
    };
    let intrinsics = Intrinsics { fx, fy, skew: 0.0, cx, cy };
    Ok(Camera { width, height, intrinsics, distortion, pose: Rigid::identity() })
}

/// Four rows of four.
fn motion(place: &Place<'_>) -> Result<Rigid> {
    let rows = place.items()?;
    let [a, b, c, d] = &rows[..] else { return Err(place.wrong(format!("{} rows, not 4", rows.len()))) };
    if d.numbers::<4>()? != [0.0, 0.0, 0.0, 1.0] {
        return Err(d.wrong("not 0 0 0 1"));
    }
    let [a, b, c] = [a.numbers::<4>()?, b.numbers::<4>()?, c.numbers::<4>()?];
    let rotation = Matrix3::new(a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]);
    Ok(Rigid { rotation, translation: Vector3::new(a[3], b[3], c[3]) })
}

pub(super) fn write(cameras: &[NamedCamera]) -> Result<String> {
    let mut text = String::new();
    for (i, NamedCamera { name, camera, has_pose }) in cameras.iter().enumerate() {
        text += &lens_text(i, camera).map_err(|e| Error::in_camera(i, e))?;
        if !name.is_empty() {
            text += &format!("  rostopic: {}\n", quoted(name));
        }
        // Last, because its end shows where a file was cut short.
        if let Some(before) = i.checked_sub(1).and_then(|b| cameras.get(b)) {
            if !(*has_pose && before.has_pose) {
                return Err(Error::in_camera(i, no_lens("a camera without a pose", CameraFormat::Kalibr)));
            }
            let Rigid { rotation: r, translation: t } = camera.pose.after(&before.camera.pose.inverse());
            text += "  T_cn_cnm1:\n";
            for row in 0..3 {
                text += &format!("  - [{}]\n", numbers(&[r[(row, 0)], r[(row, 1)], r[(row, 2)], t[row]], ", "));
            }
            text += "  - [0.0, 0.0, 0.0, 1.0]\n";
        }
    }
    Ok(text)
}

fn lens_text(i: usize, camera: &Camera) -> Result<String> {
    let format = CameraFormat::Kalibr;
    without_skew(camera, format)?;
    let (model, coefficients) = match &camera.distortion {
        Distortion::None => ("none", &[][..]),
        Distortion::BrownConrady([four @ .., 0.0]) => ("radtan", &four[..]),
        Distortion::BrownConrady(_) => return Err(no_lens("k3", format)),
        Distortion::Fisheye(k) => ("equidistant", &k[..]),
        Distortion::Division(_) => return Err(no_lens("the division model", format)),
    };
    let k = camera.intrinsics;
    Ok(format!(
        "cam{i}:\n  camera_model: pinhole\n  intrinsics: [{}]\n  distortion_model: {model}\n  distortion_coeffs: [{}]\n  \
         resolution: [{}, {}]\n",
        numbers(&[k.fx, k.fy, k.cx, k.cy], ", "),
        numbers(coefficients, ", "),
        camera.width,
        camera.height,
    ))
}
