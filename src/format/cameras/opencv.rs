//! Camera files of OpenCV: FileStorage's YAML, XML and JSON, with the keys of its calibration sample.
//!
//! A fisheye lens is what OpenCV's sample makes of one: `fisheye_model: 1` and the D of `cv::fisheye`,
//! k1 k2 k3 k4, under `distortion_coefficients`. The reader also takes ROS's `distortion_model`, which
//! many programs write into such files.
//!
//! OpenCV has no place for a pose in such files: ours adds `rotation_matrix` and
//! `translation_vector` (world to camera), which OpenCV passes over.

use std::path::Path;

use nalgebra::{Matrix3, Vector3};

use super::super::file::{read_bounded, write_atomically};
use super::super::tree::{self, Place};
use super::number::{number, numbers};
use super::{CameraFormat, MAX_BYTES, NamedCamera, checked, lens, no_lens, nowhere, text_of, without_skew};
use crate::error::{Error, Result};
use crate::geometry::{Camera, Distortion, Intrinsics, Rigid};

/// What an OpenCV camera file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenCvCamera {
    /// The pose is the identity when the file has none.
    pub camera: Camera,
    /// Root mean square reprojection error, px.
    pub rms: Option<f64>,
}

/// The three ways in which FileStorage writes the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dialect {
    Yaml,
    Xml,
    Json,
}

/// Writes a YAML file at once. `Unsupported` for skew and for the division model, which OpenCV's
/// functions do not know.
pub fn write_opencv_yaml(path: &Path, file: &OpenCvCamera) -> Result<()> {
    write_atomically(path, to_yaml(file)?.as_bytes())
}

/// Reads a file of any of the three dialects.
///
/// # Errors
/// `FileIo`; `Unsupported` for other lens models; `FileFormat` that names line and key.
pub fn read_opencv(path: &Path) -> Result<OpenCvCamera> {
    let name = path.display().to_string();
    let bytes = read_bounded(path, MAX_BYTES)?;
    let text = text_of(&bytes, &name)?;
    let dialect = match text.trim_start().chars().next() {
        Some('<') => Dialect::Xml,
        Some('{') => Dialect::Json,
        _ => Dialect::Yaml,
    };
    Ok(parse(text, dialect, &name)?.0)
}

/// The text of a YAML file.
pub fn to_yaml(file: &OpenCvCamera) -> Result<String> {
    file.camera.validate()?;
    write(&NamedCamera::new("", file.camera), file.rms, Dialect::Yaml)
}

/// Reads the text of a YAML file; `name` is what errors call it.
pub fn from_yaml(text: &[u8], name: &str) -> Result<OpenCvCamera> {
    Ok(parse(text_of(text, name)?, Dialect::Yaml, name)?.0)
}

pub(super) fn read(text: &str, dialect: Dialect, name: &str) -> Result<Vec<NamedCamera>> {
    let (OpenCvCamera { camera, .. }, has_pose) = parse(text, dialect, name)?;
    Ok(vec![NamedCamera { name: String::new(), camera, has_pose }])
}

/// The file, and whether it has a pose.
fn parse(text: &str, dialect: Dialect, name: &str) -> Result<(OpenCvCamera, bool)> {
    let tree = match dialect {
        Dialect::Yaml => tree::yaml(text),
        Dialect::Xml => tree::xml(text),
        Dialect::Json => tree::json(text),
    };
    let tree = tree.map_err(|fault| fault.of_file(name))?;
    let root = Place::root(name, &tree);
    let mut camera = lens_of(&root)?;
    let rotation = root.get("rotation_matrix")?.map(|r| matrix::<9>(&r, 3)).transpose()?;
    let translation = root.get("translation_vector")?.map(|t| vector::<3>(&t)).transpose()?;
    let has_pose = rotation.is_some() || translation.is_some();
    camera.pose = Rigid {
        rotation: rotation.map_or(Matrix3::identity(), |r| Matrix3::from_row_slice(&r)),
        translation: translation.map_or(Vector3::zeros(), Vector3::from),
    };
    let rms = root.get("avg_reprojection_error")?.map(|v| v.real()).transpose()?;
    Ok((OpenCvCamera { camera: checked(camera, &root)?, rms }, has_pose))
}

/// Image size, camera matrix and lens, which ROS's files have under the same keys. The pose is not set.
pub(super) fn lens_of(root: &Place<'_>) -> Result<Camera> {
    let (width, height) = (root.need("image_width")?.count()?, root.need("image_height")?.count()?);
    let place = root.need("camera_matrix")?;
    let [fx, skew, cx, 0.0, fy, cy, 0.0, 0.0, 1.0] = matrix::<9>(&place, 3)? else {
        return Err(place.wrong("not of the form fx s cx; 0 fy cy; 0 0 1"));
    };
    let intrinsics = Intrinsics { fx, fy, skew, cx, cy };
    Ok(Camera { width, height, intrinsics, distortion: distortion(root)?, pose: nowhere() })
}

fn distortion(root: &Place<'_>) -> Result<Distortion> {
    let flag = root.get("fisheye_model")?.map(|f| f.count()).transpose()?;
    let model = root.get("distortion_model")?;
    let fisheye = match model.as_ref().map(|m| m.text()).transpose()? {
        None | Some("plumb_bob" | "rational_polynomial") => flag.is_some_and(|f| f != 0),
        Some("equidistant" | "fisheye") => true,
        Some(other) => {
            // There is one, or it would not have a text.
            let place = model.unwrap_or_else(|| root.clone());
            return Err(place.unsupported(format!("the lens model '{}'", tree::shown(other))));
        }
    };
    let Some(place) = root.get("distortion_coefficients")? else {
        return Ok(if fisheye { Distortion::Fisheye([0.0; 4]) } else { Distortion::None });
    };
    let coefficients = elements(&place)?.2;
    if fisheye { lens::fisheye(&coefficients, &place) } else { lens::on_plane(&coefficients, &place) }
}

/// Rows, columns and numbers of a matrix.
fn elements(place: &Place<'_>) -> Result<(u32, u32, Vec<f64>)> {
    let (rows, columns) = (place.need("rows")?.count()?, place.need("cols")?.count()?);
    let data = place.need("data")?.reals()?;
    if u64::from(rows) * u64::from(columns) != data.len() as u64 {
        return Err(place.wrong(format!("{} numbers in {rows} x {columns}", data.len())));
    }
    Ok((rows, columns, data))
}

/// The numbers of a matrix with so many rows, row by row.
pub(super) fn matrix<const N: usize>(place: &Place<'_>, rows: u32) -> Result<[f64; N]> {
    let (found, columns, data) = elements(place)?;
    let wrong = |_| place.wrong(format!("{found} x {columns}, not {rows} x {}", N / rows as usize));
    if found != rows { Err(wrong(data)) } else { data.try_into().map_err(wrong) }
}

/// The numbers of a row or a column.
fn vector<const N: usize>(place: &Place<'_>) -> Result<[f64; N]> {
    let (rows, columns, data) = elements(place)?;
    data.try_into().map_err(|_| place.wrong(format!("{rows} x {columns}, not {N} x 1")))
}

enum Entry<'a> {
    Whole(u32),
    Real(f64),
    Matrix(usize, usize, &'a [f64]),
}

pub(super) fn write(file: &NamedCamera, rms: Option<f64>, dialect: Dialect) -> Result<String> {
    let format = match dialect {
        Dialect::Yaml => CameraFormat::OpenCvYaml,
        Dialect::Xml => CameraFormat::OpenCvXml,
        Dialect::Json => CameraFormat::OpenCvJson,
    };
    let camera = &file.camera;
    if rms.is_some_and(|v| !v.is_finite()) {
        return Err(Error::NotFinite { name: "rms", index: 0 });
    }
    without_skew(camera, format)?;
    let distortion = camera.distortion;
    let coefficients = match &distortion {
        Distortion::None => &[0.0; 5],
        Distortion::BrownConrady(_) | Distortion::Fisheye(_) => distortion.coefficients(),
        Distortion::Division(_) => return Err(no_lens("the division model", format)),
    };
    let k = camera.intrinsics.matrix().transpose();
    let r = camera.pose.rotation.transpose();
    let mut entries = vec![("image_width", Entry::Whole(camera.width)), ("image_height", Entry::Whole(camera.height))];
    entries.extend(rms.map(|rms| ("avg_reprojection_error", Entry::Real(rms))));
    if matches!(distortion, Distortion::Fisheye(_)) {
        entries.push(("fisheye_model", Entry::Whole(1)));
    }
    if file.has_pose {
        entries.push(("rotation_matrix", Entry::Matrix(3, 3, r.as_slice())));
        entries.push(("translation_vector", Entry::Matrix(3, 1, camera.pose.translation.as_slice())));
    }
    entries.push(("distortion_coefficients", Entry::Matrix(coefficients.len(), 1, coefficients)));
    // Last, because it must be there and its end shows: a YAML file that was cut short has none.
    entries.push(("camera_matrix", Entry::Matrix(3, 3, k.as_slice())));
    Ok(match dialect {
        Dialect::Yaml => "%YAML:1.0\n---\n".to_owned() + &lines(&entries, "\n", yaml_entry) + "\n",
        Dialect::Xml => format!(
            "<?xml version=\"1.0\"?>\n<opencv_storage>\n{}\n</opencv_storage>\n",
            lines(&entries, "\n", xml_entry)
        ),
        Dialect::Json => format!("{{\n{}\n}}\n", lines(&entries, ",\n", json_entry)),
    })
}

fn lines(entries: &[(&str, Entry<'_>)], between: &str, print: impl Fn(&str, &Entry<'_>) -> String) -> String {
    entries.iter().map(|(key, entry)| print(key, entry)).collect::<Vec<_>>().join(between)
}

fn yaml_entry(key: &str, entry: &Entry<'_>) -> String {
    match entry {
        Entry::Whole(n) => format!("{key}: {n}"),
        Entry::Real(v) => format!("{key}: {}", number(*v)),
        Entry::Matrix(rows, columns, values) => {
            let data = by_three(values, ", ", ",\n       ");
            format!("{key}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {data} ]")
        }
    }
}

fn xml_entry(key: &str, entry: &Entry<'_>) -> String {
    match entry {
        Entry::Whole(n) => format!("<{key}>{n}</{key}>"),
        Entry::Real(v) => format!("<{key}>{}</{key}>", number(*v)),
        Entry::Matrix(rows, columns, values) => {
            let data = by_three(values, " ", "\n    ");
            format!(
                "<{key} type_id=\"opencv-matrix\">\n  <rows>{rows}</rows>\n  <cols>{columns}</cols>\n  <dt>d</dt>\n  \
                 <data>\n    {data}</data></{key}>"
            )
        }
    }
}

fn json_entry(key: &str, entry: &Entry<'_>) -> String {
    match entry {
        Entry::Whole(n) => format!("    \"{key}\": {n}"),
        Entry::Real(v) => format!("    \"{key}\": {}", number(*v)),
        Entry::Matrix(rows, columns, values) => {
            let data = by_three(values, ", ", ",\n                  ");
            format!(
                "    \"{key}\": {{\n        \"type_id\": \"opencv-matrix\",\n        \"rows\": {rows},\n        \
                 \"cols\": {columns},\n        \"dt\": \"d\",\n        \"data\": [ {data} ]\n    }}"
            )
        }
    }
}

/// Three numbers a line.
fn by_three(values: &[f64], between: &str, line: &str) -> String {
    values.chunks(3).map(|row| numbers(row, between)).collect::<Vec<_>>().join(line)
}
