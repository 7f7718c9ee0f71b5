//! Camera files of OpenCV (FileStorage YAML, the keys of its calibration sample). The reader also
//! takes ROS camera_info files, which have the same keys and matrices.
//!
//! A fisheye lens is what OpenCV's sample makes of one: `fisheye_model: 1` and the D of `cv::fisheye`,
//! k1 k2 k3 k4, under `distortion_coefficients`; in ROS's files `distortion_model: equidistant`.
//!
//! OpenCV has no place for a pose in such files: ours adds `rotation_matrix` and
//! `translation_vector` (world to camera), which OpenCV passes over.

use std::path::Path;

use nalgebra::{Matrix3, Vector3};

use super::file::{format_error, read_bounded, write_atomically};
use crate::error::{Error, Result};
use crate::geometry::{Camera, Distortion, Intrinsics, Rigid};

const MAX_BYTES: u64 = 16 << 20;

/// What an OpenCV camera file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenCvCamera {
    /// The pose is the identity when the file has none.
    pub camera: Camera,
    /// Root mean square reprojection error, px.
    pub rms: Option<f64>,
}

/// Writes the file at once. `Unsupported` for skew and for the division model, which OpenCV's
/// functions do not know.
pub fn write_opencv_yaml(path: &Path, file: &OpenCvCamera) -> Result<()> {
    write_atomically(path, to_yaml(file)?.as_bytes())
}

/// Errors: `FileIo`; `Unsupported` for other lens models; `FileFormat` that names the key or line.
pub fn read_opencv_yaml(path: &Path) -> Result<OpenCvCamera> {
    from_yaml(&read_bounded(path, MAX_BYTES)?, &path.display().to_string())
}

/// The file's text.
pub fn to_yaml(file: &OpenCvCamera) -> Result<String> {
    let OpenCvCamera { camera, rms } = file;
    camera.validate()?;
    if rms.is_some_and(|v| !v.is_finite()) {
        return Err(Error::NotFinite { name: "rms", index: 0 });
    }
    let k = camera.intrinsics;
    if k.skew != 0.0 {
        return Err(Error::Unsupported { what: format!("skew {} in OpenCV's model: calibrate without skew", k.skew) });
    }
    let lens = camera.distortion;
    let coefficients = match &lens {
        Distortion::None => &[0.0; 5],
        Distortion::BrownConrady(_) | Distortion::Fisheye(_) => lens.coefficients(),
        Distortion::Division(_) => {
            return Err(Error::Unsupported {
                what: "the division model in OpenCV's: calibrate with k1 k2 p1 p2 k3".into(),
            });
        }
    };
    let mut text = format!("%YAML:1.0\n---\nimage_width: {}\nimage_height: {}\n", camera.width, camera.height);
    if let Some(rms) = rms {
        text += &format!("avg_reprojection_error: {}\n", number(*rms));
    }
    if matches!(lens, Distortion::Fisheye(_)) {
        text += "fisheye_model: 1\n";
    }
    let r = camera.pose.rotation.transpose();
    text += &matrix("rotation_matrix", 3, 3, r.as_slice());
    text += &matrix("translation_vector", 3, 1, camera.pose.translation.as_slice());
    text += &matrix("distortion_coefficients", coefficients.len(), 1, coefficients);
    // Last, because it must be there and its end shows: a file that was cut short has none.
    text += &matrix("camera_matrix", 3, 3, &[k.fx, 0.0, k.cx, 0.0, k.fy, k.cy, 0.0, 0.0, 1.0]);
    Ok(text)
}

fn matrix(key: &str, rows: usize, columns: usize, data: &[f64]) -> String {
    let lines: Vec<String> =
        data.chunks(columns.max(3)).map(|row| row.iter().map(|v| number(*v)).collect::<Vec<_>>().join(", ")).collect();
    let data = lines.join(",\n       ");
    format!("{key}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {data} ]\n")
}

/// Shortest digits that read back exactly, with the point and the exponent's sign that YAML 1.1
/// readers want to see in a number: 8.4519e+02.
fn number(value: f64) -> String {
    let text = format!("{value:e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let point = if mantissa.contains('.') { "" } else { "." };
    let (sign, digits) = exponent.strip_prefix('-').map_or(('+', exponent), |digits| ('-', digits));
    if digits == "0" { format!("{mantissa}{point}") } else { format!("{mantissa}{point}e{sign}{digits:0>2}") }
}

/// Reads a file's text; `name` is what errors call it.
pub fn from_yaml(text: &[u8], name: &str) -> Result<OpenCvCamera> {
    let text = std::str::from_utf8(text).map_err(|_| format_error(name, "not UTF-8 text"))?;
    let file = File { name, entries: entries(text, name)? };
    let size = |key: &str| -> Result<u32> {
        let text = file.scalar(key).ok_or_else(|| file.error(key, "missing"))?;
        text.parse().map_err(|_| file.error(key, format!("'{text}' is not a number of pixels")))
    };
    let (width, height) = (size("image_width")?, size("image_height")?);
    let k = file.matrix("camera_matrix", 9)?.ok_or_else(|| file.error("camera_matrix", "missing"))?;
    let [fx, skew, cx, 0.0, fy, cy, 0.0, 0.0, 1.0] = k[..] else {
        return Err(file.error("camera_matrix", "not of the form fx s cx; 0 fy cy; 0 0 1"));
    };
    let rotation = file.matrix("rotation_matrix", 9)?.map_or(Matrix3::identity(), |r| Matrix3::from_row_slice(&r));
    let translation = file.matrix("translation_vector", 3)?.map_or(Vector3::zeros(), |t| Vector3::from_row_slice(&t));
    let rms = match file.scalar("avg_reprojection_error") {
        Some(text) => Some(real(text).ok_or_else(|| file.error("avg_reprojection_error", format!("'{text}'")))?),
        None => None,
    };
    let camera = Camera {
        width,
        height,
        intrinsics: Intrinsics { fx, fy, skew, cx, cy },
        distortion: distortion(&file)?,
        pose: Rigid { rotation, translation },
    };
    camera.validate().map_err(|e| format_error(name, e.to_string()))?;
    Ok(OpenCvCamera { camera, rms })
}

/// k1 k2 p1 p2 [k3]; the longer vectors of OpenCV's other models only when their rest is zero. With a
/// fisheye lens k1 k2 k3 k4.
fn distortion(file: &File) -> Result<Distortion> {
    let unsupported = |what: String| Err(Error::Unsupported { what: format!("{}: {what}", file.name) });
    let fisheye = match (file.scalar("distortion_model"), file.scalar("fisheye_model")) {
        (None | Some("plumb_bob" | "rational_polynomial"), flag) => flag.is_some_and(|v| v != "0"),
        (Some("equidistant" | "fisheye"), _) => true,
        (Some(model), _) => return unsupported(format!("distortion_model {model}")),
    };
    let Some(entry) = file.entry("distortion_coefficients") else {
        return Ok(if fisheye { Distortion::Fisheye([0.0; 4]) } else { Distortion::None });
    };
    let Value::Matrix { data, .. } = &entry.value else {
        return Err(file.error("distortion_coefficients", "not a matrix"));
    };
    if fisheye {
        let coefficients = data.as_slice().try_into();
        return coefficients
            .map(Distortion::Fisheye)
            .map_err(|_| file.error("distortion_coefficients", format!("{} numbers of a fisheye lens", data.len())));
    }
    if ![0, 4, 5, 8, 12, 14].contains(&data.len()) {
        return Err(file.error("distortion_coefficients", format!("{} numbers", data.len())));
    }
    if data.iter().skip(5).any(|v| *v != 0.0) {
        return unsupported(format!("a lens with {} coefficients", data.len()));
    }
    if data.iter().all(|v| *v == 0.0) {
        return Ok(Distortion::None);
    }
    let mut coefficients = [0.0; 5];
    coefficients.iter_mut().zip(data).for_each(|(c, v)| *c = *v);
    Ok(Distortion::BrownConrady(coefficients))
}

enum Value {
    Scalar(String),
    Matrix {
        rows: usize,
        columns: usize,
        data: Vec<f64>,
    },
    /// Some other mapping or list.
    Other,
}

struct Entry {
    key: String,
    line: usize,
    value: Value,
}

struct File<'a> {
    name: &'a str,
    entries: Vec<Entry>,
}

impl File<'_> {
    /// Older samples of OpenCV write Camera_Matrix: case is no matter.
    fn entry(&self, key: &str) -> Option<&Entry> {
        self.entries.iter().find(|e| e.key.eq_ignore_ascii_case(key))
    }

    fn scalar(&self, key: &str) -> Option<&str> {
        match &self.entry(key)?.value {
            Value::Scalar(text) => Some(text),
            _ => None,
        }
    }

    /// The numbers of a matrix or vector of `count`, by rows; `None` when the key is not there.
    fn matrix(&self, key: &str, count: usize) -> Result<Option<Vec<f64>>> {
        match self.entry(key).map(|e| &e.value) {
            None => Ok(None),
            Some(Value::Matrix { rows, columns, data }) if data.len() == count && (count != 9 || rows == columns) => {
                Ok(Some(data.clone()))
            }
            Some(Value::Matrix { rows, columns, .. }) => Err(self.error(key, format!("{rows} x {columns}"))),
            Some(_) => Err(self.error(key, "not a matrix")),
        }
    }

    fn error(&self, key: &str, reason: impl std::fmt::Display) -> Error {
        let line = self.entry(key).map_or(String::new(), |e| format!("line {}: ", e.line));
        format_error(self.name, format!("{line}{key}: {reason}"))
    }
}

/// The top-level entries of the part of YAML that such files use.
fn entries(text: &str, name: &str) -> Result<Vec<Entry>> {
    let mut blocks: Vec<(usize, &str, Vec<&str>)> = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let line = line.trim_end();
        if line == "..." {
            break;
        }
        if line.is_empty() || line.starts_with(['%', '#']) || line == "---" {
            continue;
        }
        if line.starts_with([' ', '\t', '-', ']']) {
            let (_, _, body) = blocks
                .last_mut()
                .ok_or_else(|| format_error(name, format!("line {}: indented, but under no key", index + 1)))?;
            body.push(line.trim_start());
            continue;
        }
        let (key, rest) = line
            .split_once(':')
            .ok_or_else(|| format_error(name, format!("line {}: '{line}' is not a key and a value", index + 1)))?;
        blocks.push((index + 1, key.trim().trim_matches('"'), vec![rest.trim()]));
    }
    let mut entries: Vec<Entry> = Vec::new();
    for (line, key, body) in blocks {
        if entries.iter().any(|e| e.key == key) {
            return Err(format_error(name, format!("line {line}: {key} is there twice")));
        }
        let value = value(&body).map_err(|reason| format_error(name, format!("line {line}: {key}: {reason}")))?;
        entries.push(Entry { key: key.into(), line, value });
    }
    Ok(entries)
}

/// The value of a key from what follows it on its line (`body[0]`) and below.
fn value(body: &[&str]) -> std::result::Result<Value, String> {
    let head = without_comment(body[0]);
    if body.len() == 1 {
        return Ok(Value::Scalar(head.trim_matches('"').into()));
    }
    let field = |name: &str| body.iter().skip(1).position(|l| l.split(':').next() == Some(name)).map(|i| i + 1);
    let (Some(rows), Some(columns), Some(data)) = (field("rows"), field("cols"), field("data")) else {
        return if head == "!!opencv-matrix" {
            Err("a matrix needs rows, cols and data".into())
        } else {
            Ok(Value::Other)
        };
    };
    let count = |index: usize| -> std::result::Result<usize, String> {
        let text = without_comment(body[index].split_once(':').map_or("", |(_, v)| v));
        text.parse().map_err(|_| format!("'{}'", body[index]))
    };
    let (rows, columns) = (count(rows)?, count(columns)?);
    let text = body[data..].join(" ");
    let list = text
        .split_once('[')
        .and_then(|(_, rest)| rest.split_once(']'))
        .map(|(list, _)| list.trim())
        .ok_or("data has no [ ] around its numbers")?;
    let numbers = || list.split(',').map(str::trim);
    let data: Vec<f64> = if list.is_empty() {
        Vec::new()
    } else {
        numbers()
            .map(|t| real(t).ok_or_else(|| format!("'{t}' is not a finite number")))
            .collect::<std::result::Result<_, _>>()?
    };
    if rows.checked_mul(columns) != Some(data.len()) {
        return Err(format!("{} numbers in {rows} x {columns}", data.len()));
    }
    Ok(Value::Matrix { rows, columns, data })
}

fn real(text: &str) -> Option<f64> {
    text.parse().ok().filter(|v: &f64| v.is_finite())
}

fn without_comment(text: &str) -> &str {
    text.split(" #").next().unwrap_or(text).trim()
}
