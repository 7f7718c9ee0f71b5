//! A camera, with how it was calibrated, as versioned JSON.
//!
//! The schema is spelt out here, apart from the types of the library, so that a change of those
//! cannot change files that users keep.

use std::io::{self, Write};
use std::path::Path;

use nalgebra::{DMatrix, Matrix3, Vector2};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::ser::{Formatter, PrettyFormatter};

use super::file::{format_error, read_bounded, write_atomically};
use super::observation::{InputsRecord, InputsSchema};
use crate::error::{Error, Result};
use crate::geometry::{Camera, Distortion, Intrinsics, Rigid};

pub(super) const FORMAT: &str = "ptzcal-camera";
const VERSION: u32 = 1;
/// Some two million residuals, or half a million with the measurements that they are of.
const MAX_BYTES: u64 = 256 << 20;

/// What a camera file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraRecord {
    pub camera: Camera,
    pub calibration: Option<CalibrationRecord>,
}

/// How good the camera is; the fields mean what those of
/// [`Calibration`](crate::calibrate::Calibration) mean.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationRecord {
    pub covariance: DMatrix<f64>,
    /// px.
    pub residuals: Vec<Vector2<f64>>,
    pub inliers: Vec<bool>,
    /// px.
    pub rms: f64,
    pub noise_factor: f64,
    pub condition: f64,
    pub iterations: usize,
    /// What it was made from.
    pub inputs: Option<InputsRecord>,
}

/// Writes the file at once: on an error the old one, if any, is still there.
pub fn write_camera(path: &Path, record: &CameraRecord) -> Result<()> {
    write_atomically(path, to_json(record)?.as_bytes())
}

/// Errors: `FileIo`; `FileVersion`; `FileFormat` that names the key or the line.
pub fn read_camera(path: &Path) -> Result<CameraRecord> {
    from_json(&read_bounded(path, MAX_BYTES)?, &path.display().to_string())
}

/// The file's text. Refuses NaN, infinity and a camera that is not valid.
pub fn to_json(record: &CameraRecord) -> Result<String> {
    record.camera.validate()?;
    if let Some(c) = &record.calibration {
        c.validate()?;
    }
    text_of(&FileSchema::from(record))
}

/// The text of a file that a person can read.
pub(super) fn text_of(file: &impl Serialize) -> Result<String> {
    let mut text = Vec::new();
    let mut serializer = serde_json::Serializer::with_formatter(&mut text, Layout::default());
    file.serialize(&mut serializer).map_err(|e| Error::Internal { reason: format!("to JSON: {e}") })?;
    text.push(b'\n');
    String::from_utf8(text).map_err(|e| Error::Internal { reason: e.to_string() })
}

/// Reads a file's text after its format and version are found to be `format` and `version`.
pub(super) fn versioned<T: DeserializeOwned>(text: &[u8], name: &str, format: &str, version: u32) -> Result<T> {
    let malformed = |e: serde_json::Error| format_error(name, e.to_string());
    // Another version may hold anything else, so its number is read alone.
    let header: Header = serde_json::from_slice(text).map_err(malformed)?;
    if header.format != format {
        return Err(format_error(name, format!("format is '{}', not '{format}'", header.format)));
    }
    if header.version != version {
        return Err(Error::FileVersion { path: name.into(), found: header.version, supported: version });
    }
    serde_json::from_slice(text).map_err(malformed)
}

/// Reads a file's text; `name` is what errors call it.
pub fn from_json(text: &[u8], name: &str) -> Result<CameraRecord> {
    let file: FileSchema = versioned(text, name, FORMAT, VERSION)?;
    let record = CameraRecord::try_from(file).map_err(|reason| format_error(name, reason))?;
    let checked = record.camera.validate().and(record.calibration.as_ref().map_or(Ok(()), CalibrationRecord::validate));
    checked.map_err(|e| format_error(name, e.to_string()))?;
    Ok(record)
}

/// Objects over indented lines, arrays on one line: a person can read the file.
#[derive(Default)]
struct Layout(PrettyFormatter<'static>);

impl Formatter for Layout {
    fn begin_object<W: ?Sized + Write>(&mut self, w: &mut W) -> io::Result<()> {
        self.0.begin_object(w)
    }

    fn end_object<W: ?Sized + Write>(&mut self, w: &mut W) -> io::Result<()> {
        self.0.end_object(w)
    }

    fn begin_object_key<W: ?Sized + Write>(&mut self, w: &mut W, first: bool) -> io::Result<()> {
        self.0.begin_object_key(w, first)
    }

    fn begin_object_value<W: ?Sized + Write>(&mut self, w: &mut W) -> io::Result<()> {
        self.0.begin_object_value(w)
    }

    fn end_object_value<W: ?Sized + Write>(&mut self, w: &mut W) -> io::Result<()> {
        self.0.end_object_value(w)
    }
}

impl CalibrationRecord {
    fn validate(&self) -> Result<()> {
        let residuals = self.residuals.iter().flat_map(|r| r.iter());
        let lists: [(&'static str, Vec<&f64>); 3] = [
            ("covariance", self.covariance.iter().collect()),
            ("residuals", residuals.collect()),
            ("rms, noise_factor, condition", vec![&self.rms, &self.noise_factor, &self.condition]),
        ];
        for (name, values) in lists {
            if let Some(index) = values.iter().position(|v| !v.is_finite()) {
                return Err(Error::NotFinite { name, index });
            }
        }
        if !self.covariance.is_square() {
            return Err(Error::invalid("covariance", "not square"));
        }
        if self.residuals.len() != self.inliers.len() {
            return Err(Error::invalid("inliers", "not as many as residuals"));
        }
        if self.inputs.as_ref().is_some_and(|i| i.observations.len() != self.residuals.len()) {
            return Err(Error::invalid("inputs.observations", "not as many as residuals"));
        }
        Ok(())
    }
}

#[derive(Deserialize)]
pub(super) struct Header {
    pub format: String,
    pub version: u32,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileSchema {
    format: String,
    version: u32,
    image_width: u32,
    image_height: u32,
    intrinsics: IntrinsicsSchema,
    distortion: DistortionSchema,
    /// World to camera: x_camera = rotation x_world + translation.
    pose: PoseSchema,
    #[serde(skip_serializing_if = "Option::is_none")]
    calibration: Option<CalibrationSchema>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct IntrinsicsSchema {
    fx: f64,
    fy: f64,
    skew: f64,
    cx: f64,
    cy: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DistortionSchema {
    model: String,
    coefficients: Vec<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PoseSchema {
    /// Rows.
    rotation: [[f64; 3]; 3],
    translation: [f64; 3],
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CalibrationSchema {
    rms: f64,
    noise_factor: f64,
    condition: f64,
    iterations: usize,
    covariance: Vec<Vec<f64>>,
    residuals: Vec<[f64; 2]>,
    inliers: Vec<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    inputs: Option<InputsSchema>,
}

impl From<&Intrinsics> for IntrinsicsSchema {
    fn from(k: &Intrinsics) -> Self {
        Self { fx: k.fx, fy: k.fy, skew: k.skew, cx: k.cx, cy: k.cy }
    }
}

impl From<&IntrinsicsSchema> for Intrinsics {
    fn from(k: &IntrinsicsSchema) -> Self {
        Self { fx: k.fx, fy: k.fy, skew: k.skew, cx: k.cx, cy: k.cy }
    }
}

impl From<&Distortion> for DistortionSchema {
    fn from(distortion: &Distortion) -> Self {
        let model = match distortion {
            Distortion::None => "none",
            Distortion::BrownConrady(_) => "brown_conrady",
            Distortion::Division(_) => "division",
            Distortion::Fisheye(_) => "fisheye",
        };
        Self { model: model.into(), coefficients: distortion.coefficients().to_vec() }
    }
}

impl TryFrom<&DistortionSchema> for Distortion {
    type Error = String;

    fn try_from(d: &DistortionSchema) -> std::result::Result<Self, String> {
        match (d.model.as_str(), d.coefficients.as_slice()) {
            ("none", []) => Ok(Self::None),
            ("brown_conrady", &[k1, k2, p1, p2, k3]) => Ok(Self::BrownConrady([k1, k2, p1, p2, k3])),
            ("division", &[lambda]) => Ok(Self::Division(lambda)),
            ("fisheye", &[k1, k2, k3, k4]) => Ok(Self::Fisheye([k1, k2, k3, k4])),
            (model, c) => Err(format!("distortion: model '{model}' with {} coefficients", c.len())),
        }
    }
}

impl From<&CameraRecord> for FileSchema {
    fn from(record: &CameraRecord) -> Self {
        let Camera { width, height, intrinsics, distortion, pose } = record.camera;
        Self {
            format: FORMAT.into(),
            version: VERSION,
            image_width: width,
            image_height: height,
            intrinsics: IntrinsicsSchema::from(&intrinsics),
            distortion: DistortionSchema::from(&distortion),
            // nalgebra keeps columns.
            pose: PoseSchema { rotation: pose.rotation.transpose().into(), translation: pose.translation.into() },
            calibration: record.calibration.as_ref().map(CalibrationSchema::from),
        }
    }
}

impl From<&CalibrationRecord> for CalibrationSchema {
    fn from(c: &CalibrationRecord) -> Self {
        Self {
            rms: c.rms,
            noise_factor: c.noise_factor,
            condition: c.condition,
            iterations: c.iterations,
            covariance: c.covariance.row_iter().map(|row| row.iter().copied().collect()).collect(),
            residuals: c.residuals.iter().map(|r| (*r).into()).collect(),
            inliers: c.inliers.clone(),
            inputs: c.inputs.as_ref().map(InputsSchema::from),
        }
    }
}

impl TryFrom<FileSchema> for CameraRecord {
    type Error = String;

    fn try_from(file: FileSchema) -> std::result::Result<Self, String> {
        let rotation = Matrix3::from(file.pose.rotation).transpose();
        let camera = Camera {
            width: file.image_width,
            height: file.image_height,
            intrinsics: Intrinsics::from(&file.intrinsics),
            distortion: Distortion::try_from(&file.distortion)?,
            pose: Rigid { rotation, translation: file.pose.translation.into() },
        };
        Ok(Self { camera, calibration: file.calibration.map(CalibrationRecord::try_from).transpose()? })
    }
}

impl TryFrom<CalibrationSchema> for CalibrationRecord {
    type Error = String;

    fn try_from(c: CalibrationSchema) -> std::result::Result<Self, String> {
        let size = c.covariance.len();
        if let Some(row) = c.covariance.iter().position(|row| row.len() != size) {
            return Err(format!("covariance: row {row} has not {size} numbers"));
        }
        Ok(Self {
            covariance: DMatrix::from_fn(size, size, |i, j| c.covariance[i][j]),
            residuals: c.residuals.into_iter().map(Vector2::from).collect(),
            inliers: c.inliers,
            rms: c.rms,
            noise_factor: c.noise_factor,
            condition: c.condition,
            iterations: c.iterations,
            inputs: c.inputs.map(InputsRecord::try_from).transpose()?,
        })
    }
}
