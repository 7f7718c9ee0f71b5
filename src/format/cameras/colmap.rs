//! COLMAP's text model: a folder with cameras.txt (lenses), images.txt (where they stood, and what
//! they are called) and points3D.txt (none of ours; COLMAP wants the file).
//!
//! COLMAP's pixel (0.5, 0.5) is the centre of the top-left pixel, ours (0, 0): the principal point moves
//! by half a pixel. An image's quaternion (w first) and translation are world to camera, as ours.
//! Every image is a camera here; a lens that no image has is one without a pose.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion};

use super::super::file::{format_error, io_error, read_bounded, write_atomically};
use super::super::tree::{real, shown};
use super::number::numbers;
use super::{CameraFormat, MAX_CAMERAS, NamedCamera, nowhere, text_of, without_skew};
use crate::error::{Error, Result};
use crate::geometry::{Camera, Distortion, Intrinsics, Rigid};

/// Images carry their keypoints.
const MAX_BYTES: u64 = 1 << 30;
/// Of the top-left pixel's centre.
const ORIGIN: f64 = 0.5;

/// Is this COLMAP's: the folder, or a file of it?
pub(super) fn is_model(path: &Path) -> bool {
    path.join("cameras.txt").is_file() || matches!(path.file_name(), Some(n) if n == "cameras.txt" || n == "images.txt")
}

fn folder(path: &Path) -> PathBuf {
    match path.file_name() {
        Some(name) if name == "cameras.txt" || name == "images.txt" => path.with_file_name(""),
        _ => path.to_owned(),
    }
}

pub(super) fn read(path: &Path) -> Result<Vec<NamedCamera>> {
    let folder = folder(path);
    let file = |name: &str| -> Result<(String, Vec<u8>)> {
        let path = folder.join(name);
        Ok((path.display().to_string(), read_bounded(&path, MAX_BYTES)?))
    };
    let cameras = file("cameras.txt")?;
    let images = if folder.join("images.txt").exists() { Some(file("images.txt")?) } else { None };
    let lenses = parse_cameras(text_of(&cameras.1, &cameras.0)?, &cameras.0)?;
    let mut found = match &images {
        Some((name, bytes)) => parse_images(text_of(bytes, name)?, name, &lenses)?,
        None => Vec::new(),
    };
    let used: BTreeSet<u32> = found.iter().map(|(id, _)| *id).collect();
    let unused = lenses.iter().filter(|(id, _)| !used.contains(id));
    found.extend(
        unused.map(|(id, camera)| (*id, NamedCamera { name: String::new(), camera: *camera, has_pose: false })),
    );
    match found.len() {
        0 => Err(format_error(&cameras.0, "no cameras")),
        _ => Ok(found.into_iter().map(|(_, camera)| camera).collect()),
    }
}

/// A line with its number and its words.
struct Line<'a> {
    file: &'a str,
    number: usize,
    text: &'a str,
}

impl<'a> Line<'a> {
    fn wrong(&self, reason: impl std::fmt::Display) -> Error {
        format_error(self.file, format!("line {}: {reason}", self.number))
    }

    fn real(&self, word: &str) -> Result<f64> {
        real(word).ok_or_else(|| self.wrong(format!("'{}' is not a finite number", shown(word))))
    }

    fn whole(&self, word: &str) -> Result<u32> {
        word.parse().map_err(|_| self.wrong(format!("'{}' is not a whole number", shown(word))))
    }

    fn is_comment(&self) -> bool {
        self.text.is_empty() || self.text.starts_with('#')
    }

    /// The next word of what is left of a line, and what is left then.
    fn word(&self, rest: &mut &'a str, what: &str) -> Result<&'a str> {
        let (word, left) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
        *rest = left.trim_start();
        if word.is_empty() { Err(self.wrong(format!("{what} is missing"))) } else { Ok(word) }
    }
}

/// The lines of a file, whose last one must have its end: a number that was cut short is a number too.
fn lines<'a>(text: &'a str, file: &'a str) -> Result<impl Iterator<Item = Line<'a>>> {
    if !text.is_empty() && !text.ends_with('\n') {
        return Err(format_error(file, format!("line {}: the file ends before the line does", text.lines().count())));
    }
    Ok(text.lines().enumerate().map(move |(i, text)| Line { file, number: i + 1, text: text.trim() }))
}

fn parse_cameras(text: &str, file: &str) -> Result<BTreeMap<u32, Camera>> {
    let mut cameras = BTreeMap::new();
    for line in lines(text, file)?.filter(|l| !l.is_comment()) {
        let mut rest = line.text;
        let id = line.whole(line.word(&mut rest, "CAMERA_ID")?)?;
        let model = line.word(&mut rest, "MODEL")?;
        let width = line.whole(line.word(&mut rest, "WIDTH")?)?;
        let height = line.whole(line.word(&mut rest, "HEIGHT")?)?;
        let parameters = rest.split_whitespace().map(|word| line.real(word)).collect::<Result<Vec<f64>>>()?;
        let (intrinsics, distortion) = lens(model, &parameters, &line)?;
        let camera = Camera { width, height, intrinsics, distortion, pose: nowhere() };
        camera.validate().map_err(|e| line.wrong(e))?;
        if cameras.len() == MAX_CAMERAS {
            return Err(line.wrong(format!("over {MAX_CAMERAS} cameras")));
        }
        if cameras.insert(id, camera).is_some() {
            return Err(line.wrong(format!("camera {id} is there twice")));
        }
    }
    Ok(cameras)
}

/// A lens by COLMAP's name and parameters.
fn lens(model: &str, p: &[f64], line: &Line<'_>) -> Result<(Intrinsics, Distortion)> {
    use Distortion::{BrownConrady, Division, Fisheye};
    let equal = |f: f64, cx: f64, cy: f64| Intrinsics::new(f, cx - ORIGIN, cy - ORIGIN);
    let apart = |fx: f64, fy: f64, cx: f64, cy: f64| Intrinsics { fx, fy, skew: 0.0, cx: cx - ORIGIN, cy: cy - ORIGIN };
    Ok(match (model, p) {
        ("SIMPLE_PINHOLE", &[f, cx, cy]) => (equal(f, cx, cy), Distortion::None),
        ("PINHOLE", &[fx, fy, cx, cy]) => (apart(fx, fy, cx, cy), Distortion::None),
        ("SIMPLE_RADIAL", &[f, cx, cy, k]) => (equal(f, cx, cy), BrownConrady([k, 0.0, 0.0, 0.0, 0.0])),
        ("RADIAL", &[f, cx, cy, k1, k2]) => (equal(f, cx, cy), BrownConrady([k1, k2, 0.0, 0.0, 0.0])),
        ("OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2]) => (apart(fx, fy, cx, cy), BrownConrady([k1, k2, p1, p2, 0.0])),
        ("FULL_OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2, k3, 0.0, 0.0, 0.0]) => {
            (apart(fx, fy, cx, cy), BrownConrady([k1, k2, p1, p2, k3]))
        }
        ("FULL_OPENCV", p) if p.len() == 12 => {
            let what =
                format!("{}: line {}: FULL_OPENCV with k4 k5 k6: only k1 k2 p1 p2 k3 are here", line.file, line.number);
            return Err(Error::Unsupported { what });
        }
        ("SIMPLE_DIVISION", &[f, cx, cy, k]) => (equal(f, cx, cy), Division(k)),
        ("DIVISION", &[fx, fy, cx, cy, k]) => (apart(fx, fy, cx, cy), Division(k)),
        ("SIMPLE_FISHEYE", &[f, cx, cy]) => (equal(f, cx, cy), Fisheye([0.0; 4])),
        ("FISHEYE", &[fx, fy, cx, cy]) => (apart(fx, fy, cx, cy), Fisheye([0.0; 4])),
        ("SIMPLE_RADIAL_FISHEYE", &[f, cx, cy, k]) => (equal(f, cx, cy), Fisheye([k, 0.0, 0.0, 0.0])),
        ("RADIAL_FISHEYE", &[f, cx, cy, k1, k2]) => (equal(f, cx, cy), Fisheye([k1, k2, 0.0, 0.0])),
        ("OPENCV_FISHEYE", &[fx, fy, cx, cy, k1, k2, k3, k4]) => (apart(fx, fy, cx, cy), Fisheye([k1, k2, k3, k4])),
        (name, p) if MODELS.contains(&name) => return Err(line.wrong(format!("{name} with {} parameters", p.len()))),
        (name, _) => {
            let what = format!("{}: line {}: the camera model '{}'", line.file, line.number, shown(name));
            return Err(Error::Unsupported { what });
        }
    })
}

/// COLMAP's models that ours can be.
const MODELS: [&str; 13] = [
    "SIMPLE_PINHOLE",
    "PINHOLE",
    "SIMPLE_RADIAL",
    "RADIAL",
    "OPENCV",
    "FULL_OPENCV",
    "SIMPLE_DIVISION",
    "DIVISION",
    "SIMPLE_FISHEYE",
    "FISHEYE",
    "SIMPLE_RADIAL_FISHEYE",
    "RADIAL_FISHEYE",
    "OPENCV_FISHEYE",
];

/// Two lines an image; the second one, its keypoints, may be empty but must be there.
fn parse_images(text: &str, file: &str, lenses: &BTreeMap<u32, Camera>) -> Result<Vec<(u32, NamedCamera)>> {
    let mut images = Vec::new();
    let mut lines = lines(text, file)?;
    while let Some(line) = lines.next() {
        if line.is_comment() {
            continue;
        }
        let mut rest = line.text;
        line.whole(line.word(&mut rest, "IMAGE_ID")?)?;
        let mut pose = [0.0; 7];
        for (to, what) in pose.iter_mut().zip(["QW", "QX", "QY", "QZ", "TX", "TY", "TZ"]) {
            *to = line.real(line.word(&mut rest, what)?)?;
        }
        let id = line.whole(line.word(&mut rest, "CAMERA_ID")?)?;
        let lens = lenses.get(&id).ok_or_else(|| line.wrong(format!("there is no camera {id}")))?;
        if rest.is_empty() {
            return Err(line.wrong("NAME is missing"));
        }
        let [w, x, y, z, translation @ ..] = pose;
        let camera = Camera {
            pose: Rigid { rotation: rotation([w, x, y, z], &line)?, translation: translation.into() },
            ..*lens
        };
        camera.validate().map_err(|e| line.wrong(e))?;
        if images.len() == MAX_CAMERAS {
            return Err(line.wrong(format!("over {MAX_CAMERAS} images")));
        }
        images.push((id, NamedCamera::new(rest, camera)));
        if lines.next().is_none() {
            return Err(line.wrong("the line with its keypoints is missing"));
        }
    }
    Ok(images)
}

/// Of a quaternion of about unit length, w first.
fn rotation([w, x, y, z]: [f64; 4], line: &Line<'_>) -> Result<Matrix3<f64>> {
    let quaternion = Quaternion::new(w, x, y, z);
    let length = quaternion.norm();
    if (length - 1.0).abs() > 1e-3 {
        return Err(line.wrong(format!("a quaternion of length {length}")));
    }
    Ok(UnitQuaternion::from_quaternion(quaternion).to_rotation_matrix().into_inner())
}

/// Makes the folder where it is not there.
pub(super) fn write(path: &Path, cameras: &[NamedCamera]) -> Result<()> {
    let folder = folder(path);
    let [lenses, images] = to_text(cameras)?;
    fs::create_dir_all(&folder).map_err(|e| io_error(&folder, &e))?;
    write_atomically(&folder.join("cameras.txt"), lenses.as_bytes())?;
    write_atomically(&folder.join("images.txt"), images.as_bytes())?;
    write_atomically(&folder.join("points3D.txt"), b"# 3D point list: none\n")
}

/// cameras.txt and images.txt.
fn to_text(cameras: &[NamedCamera]) -> Result<[String; 2]> {
    let mut lenses = String::from("# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n");
    let mut images = String::from("# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# (no keypoints)\n");
    let mut names = BTreeSet::new();
    for (i, NamedCamera { name, camera, has_pose }) in cameras.iter().enumerate() {
        without_skew(camera, CameraFormat::Colmap).map_err(|e| Error::in_camera(i, e))?;
        let (model, parameters) = parameters(camera);
        let (width, height, id) = (camera.width, camera.height, i + 1);
        lenses += &format!("{id} {model} {width} {height} {}\n", numbers(&parameters, " "));
        if !has_pose {
            continue;
        }
        let name = if name.is_empty() { format!("camera{i}") } else { name.clone() };
        if name.chars().any(|c| c.is_whitespace() || c.is_control()) {
            let reason = format!("'{}' has white space, which parts COLMAP's words", shown(&name));
            return Err(Error::in_camera(i, Error::invalid("name", reason)));
        }
        let Rigid { rotation, translation: t } = camera.pose;
        let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        let pose = numbers(&[q.w, q.i, q.j, q.k, t.x, t.y, t.z], " ");
        images += &format!("{id} {pose} {id} {name}\n\n");
        if !names.insert(name) {
            return Err(Error::in_camera(i, Error::invalid("name", "there twice")));
        }
    }
    Ok([lenses, images])
}

fn parameters(camera: &Camera) -> (&'static str, Vec<f64>) {
    let k = camera.intrinsics;
    let mut parameters = vec![k.fx, k.fy, k.cx + ORIGIN, k.cy + ORIGIN];
    parameters.extend(camera.distortion.coefficients());
    let model = match camera.distortion {
        Distortion::None => "PINHOLE",
        Distortion::BrownConrady([.., 0.0]) => {
            parameters.truncate(8);
            "OPENCV"
        }
        Distortion::BrownConrady(_) => {
            parameters.extend([0.0; 3]);
            "FULL_OPENCV"
        }
        Distortion::Division(_) => "DIVISION",
        Distortion::Fisheye(_) => "OPENCV_FISHEYE",
    };
    (model, parameters)
}

/// Reads the two files' texts.
#[cfg(test)]
pub(super) fn from_text(lenses: &str, images: &str) -> Result<Vec<NamedCamera>> {
    let lenses = parse_cameras(lenses, "cameras.txt")?;
    Ok(parse_images(images, "images.txt", &lenses)?.into_iter().map(|(_, camera)| camera).collect())
}

#[cfg(test)]
pub(super) fn texts(cameras: &[NamedCamera]) -> [String; 2] {
    to_text(cameras).unwrap()
}
