//! Cameras in the files of other programs, and in our own, behind one entry: [`read_cameras`] and
//! [`write_cameras`].
//!
//! What a format cannot hold is refused with the reason, never rounded to what it can. All of them mean
//! the same pixel by (0, 0), the centre of the top-left one, except COLMAP, where that is (0.5, 0.5).
//!
//! To add a format: a file here with `read` and `write`, a value of [`CameraFormat`], its marks in
//! `guess`, and the peer that reads it in tests/camera_formats.rs.

mod colmap;
mod kalibr;
mod lens;
mod mrcal;
mod number;
pub mod opencv;
mod ros;
#[cfg(test)]
mod tests;

use std::path::Path;

use super::file::{format_error, read_bounded, write_atomically};
use super::model_json::{self, CameraRecord};
use super::tree::{Place, yaml};
use crate::error::{Error, Result};
use crate::geometry::{Camera, Rigid};

/// A calibration is a page of text; with what it was made from (our own, mrcal's) some megabytes.
const MAX_BYTES: u64 = 64 << 20;
/// Most cameras of one file.
pub const MAX_CAMERAS: usize = 10_000;

/// File formats of cameras.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraFormat {
    /// Our own JSON: every model, to the last bit. One camera.
    Json,
    /// OpenCV's FileStorage as YAML, with the keys of its calibration sample. One camera.
    OpenCvYaml,
    /// The same as XML.
    OpenCvXml,
    /// The same as JSON.
    OpenCvJson,
    /// ROS's camera_info as YAML (camera_calibration_parsers). One camera, without a pose.
    Ros,
    /// A folder with COLMAP's cameras.txt, images.txt and points3D.txt. Any number of cameras.
    Colmap,
    /// mrcal's .cameramodel. One camera.
    Mrcal,
    /// Kalibr's camchain as YAML. Any number of cameras, whose world is the first one's frame.
    Kalibr,
}

impl CameraFormat {
    pub const ALL: [Self; 8] = [
        Self::Json,
        Self::OpenCvYaml,
        Self::OpenCvXml,
        Self::OpenCvJson,
        Self::Ros,
        Self::Colmap,
        Self::Mrcal,
        Self::Kalibr,
    ];

    /// For messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Json => "ptzcal's JSON",
            Self::OpenCvYaml => "OpenCV's YAML",
            Self::OpenCvXml => "OpenCV's XML",
            Self::OpenCvJson => "OpenCV's JSON",
            Self::Ros => "ROS's camera_info",
            Self::Colmap => "COLMAP's text",
            Self::Mrcal => "mrcal's .cameramodel",
            Self::Kalibr => "Kalibr's camchain",
        }
    }

    /// Does a file hold any number of cameras, not just one?
    pub fn holds_many(self) -> bool {
        matches!(self, Self::Colmap | Self::Kalibr)
    }
}

/// A camera of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedCamera {
    /// As the file calls it; empty where it has no name.
    pub name: String,
    pub camera: Camera,
    /// Does the file say where the camera is? If not, its pose is the identity and means nothing.
    pub has_pose: bool,
}

impl NamedCamera {
    /// A camera with its pose.
    pub fn new(name: impl Into<String>, camera: Camera) -> Self {
        Self { name: name.into(), camera, has_pose: true }
    }
}

/// Reads all cameras of a file, or none. Without a `format` its content tells; COLMAP's is told by the
/// folder, or by the file cameras.txt or images.txt in it.
///
/// # Errors
/// `FileIo`; `FileFormat`, which names the line and the key; `FileVersion`; `Unsupported` for what
/// our camera models do not have.
pub fn read_cameras(path: &Path, format: Option<CameraFormat>) -> Result<(CameraFormat, Vec<NamedCamera>)> {
    if format == Some(CameraFormat::Colmap) || (format.is_none() && colmap::is_model(path)) {
        return Ok((CameraFormat::Colmap, colmap::read(path)?));
    }
    let name = path.display().to_string();
    let bytes = read_bounded(path, MAX_BYTES)?;
    let text = text_of(&bytes, &name)?;
    let format = match format {
        Some(format) => format,
        None => guess(text, &name)?,
    };
    Ok((format, from_text(text, format, &name)?))
}

/// Reads the text of a file in any format but COLMAP's, which is not one file.
fn from_text(text: &str, format: CameraFormat, name: &str) -> Result<Vec<NamedCamera>> {
    match format {
        CameraFormat::Json => {
            let record = model_json::from_json(text.as_bytes(), name)?;
            Ok(vec![NamedCamera::new("", record.camera)])
        }
        CameraFormat::OpenCvYaml => opencv::read(text, opencv::Dialect::Yaml, name),
        CameraFormat::OpenCvXml => opencv::read(text, opencv::Dialect::Xml, name),
        CameraFormat::OpenCvJson => opencv::read(text, opencv::Dialect::Json, name),
        CameraFormat::Ros => ros::read(text, name),
        CameraFormat::Colmap => Err(Error::invalid("format", "COLMAP's cameras are in a folder of files")),
        CameraFormat::Mrcal => mrcal::read(text, name),
        CameraFormat::Kalibr => kalibr::read(text, name),
    }
}

/// UTF-8 without its mark, which Windows' editors put in front.
pub(in crate::format) fn text_of<'a>(bytes: &'a [u8], name: &str) -> Result<&'a str> {
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let line = 1 + bytes[..e.valid_up_to()].iter().filter(|b| **b == b'\n').count();
        format_error(name, format!("line {line}: not UTF-8 text"))
    })?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

/// The format of a text, by what it begins with and the keys that only one format has.
fn guess(text: &str, name: &str) -> Result<CameraFormat> {
    let begin = text.lines().map(str::trim_start).find(|l| !l.is_empty() && !l.starts_with('#')).unwrap_or_default();
    if begin.starts_with('<') {
        return Ok(CameraFormat::OpenCvXml);
    }
    if begin.starts_with('{') {
        return Ok(match text {
            t if t.contains("lensmodel") => CameraFormat::Mrcal,
            t if t.contains(model_json::FORMAT) => CameraFormat::Json,
            _ => CameraFormat::OpenCvJson,
        });
    }
    let tree = yaml(text).map_err(|fault| fault.of_file(name))?;
    let root = Place::root(name, &tree);
    let keys: Vec<&str> = root.entries()?.map(|(key, _)| key).collect();
    let has_lens = |place: Place<'_>| place.is_map() && matches!(place.get("camera_model"), Ok(Some(_)));
    if root.entries()?.any(|(_, place)| has_lens(place)) {
        Ok(CameraFormat::Kalibr)
    } else if ["distortion_model", "projection_matrix"].iter().all(|key| keys.contains(key)) {
        Ok(CameraFormat::Ros)
    } else if keys.iter().any(|key| key.eq_ignore_ascii_case("camera_matrix")) {
        Ok(CameraFormat::OpenCvYaml)
    } else {
        Err(format_error(name, "no camera in any format that this library reads"))
    }
}

/// Writes cameras at once: on an error the old file, if any, is still there (of COLMAP's three files:
/// each). Without a `format` the file's ending tells: .json is our own, .yaml and .yml OpenCV's, .xml
/// OpenCV's, .cameramodel mrcal's; ROS's, Kalibr's and COLMAP's have to be asked for.
///
/// # Errors
/// `FileIo`; `InvalidArgument` for no cameras, more than the format holds, names that it cannot hold;
/// `Unsupported` for a lens or skew that it cannot hold.
pub fn write_cameras(path: &Path, cameras: &[NamedCamera], format: Option<CameraFormat>) -> Result<()> {
    let format = match format {
        Some(format) => format,
        None => by_ending(path)?,
    };
    cameras.iter().try_for_each(|c| c.camera.validate())?;
    if format == CameraFormat::Colmap {
        check_number(cameras, format)?;
        return colmap::write(path, cameras);
    }
    write_atomically(path, to_text(cameras, format)?.as_bytes())
}

fn check_number(cameras: &[NamedCamera], format: CameraFormat) -> Result<()> {
    match cameras.len() {
        0 => Err(Error::invalid("cameras", "none")),
        n if n > MAX_CAMERAS => Err(Error::invalid("cameras", format!("{n}, at most {MAX_CAMERAS} go into a file"))),
        n if n > 1 && !format.holds_many() => {
            Err(Error::invalid("cameras", format!("{n}, and {} holds one a file", format.name())))
        }
        _ => Ok(()),
    }
}

/// The text of a file in any format but COLMAP's, which is not one file.
fn to_text(cameras: &[NamedCamera], format: CameraFormat) -> Result<String> {
    check_number(cameras, format)?;
    let first = &cameras[0];
    match format {
        CameraFormat::Json => model_json::to_json(&CameraRecord { camera: first.camera, calibration: None }),
        CameraFormat::OpenCvYaml => opencv::write(first, None, opencv::Dialect::Yaml),
        CameraFormat::OpenCvXml => opencv::write(first, None, opencv::Dialect::Xml),
        CameraFormat::OpenCvJson => opencv::write(first, None, opencv::Dialect::Json),
        CameraFormat::Ros => ros::write(first),
        CameraFormat::Colmap => Err(Error::invalid("format", "COLMAP's cameras are in a folder of files")),
        CameraFormat::Mrcal => mrcal::write(first),
        CameraFormat::Kalibr => kalibr::write(cameras),
    }
}

fn by_ending(path: &Path) -> Result<CameraFormat> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match ending.as_str() {
        "json" => Ok(CameraFormat::Json),
        "yaml" | "yml" => Ok(CameraFormat::OpenCvYaml),
        "xml" => Ok(CameraFormat::OpenCvXml),
        "cameramodel" => Ok(CameraFormat::Mrcal),
        _ => Err(Error::invalid(
            "format",
            format!("{}: no ending .json, .yaml, .yml, .xml or .cameramodel tells the format", path.display()),
        )),
    }
}

/// The camera of a file, if it is valid; `place` is where errors point to.
fn checked(camera: Camera, place: &Place<'_>) -> Result<Camera> {
    camera.validate().map_err(|e| place.wrong(e))?;
    Ok(camera)
}

/// Refuses skew, which none of the other formats has.
fn without_skew(camera: &Camera, format: CameraFormat) -> Result<()> {
    match camera.intrinsics.skew {
        0.0 => Ok(()),
        skew => Err(Error::Unsupported { what: format!("skew {skew} in {}: calibrate without skew", format.name()) }),
    }
}

/// The error for what a format has no place for.
fn no_lens(what: &str, format: CameraFormat) -> Error {
    Error::Unsupported { what: format!("{what} in {}, which does not have it: calibrate without", format.name()) }
}

/// What a camera without a pose is given.
fn nowhere() -> Rigid {
    Rigid::identity()
}
