//! The two text files of a recorded scan (docs/recordings.md): `recording.json` says what was
//! recorded, `shots.jsonl` has a line for each shot that names its pictures.

use serde::{Deserialize, Serialize};

use super::file::format_error;
use super::model_json::{DistortionSchema, IntrinsicsSchema, text_of, versioned};
use super::zoom_json::LaserSchema;
use crate::error::{Error, Result};
use crate::geometry::rig_model::{AxisOffsets, Encoders};
use crate::geometry::{Distortion, Intrinsics, RigModel};
use crate::image::view::MAX_SIDE;

const FORMAT: &str = "ptzcal-recording";
const VERSION: u32 = 1;
/// Most cameras of a recording, the head's included.
pub const MAX_CAMERAS: usize = 65;
/// Most frames of a shot with the laser on, or off.
pub const MAX_FRAMES: usize = 256;
/// Longest line of a shot, bytes.
pub const MAX_LINE: usize = 1 << 20;

/// What was recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingInfo {
    pub rig: RigModel,
    /// Least and greatest pan and tilt of the head, radians.
    pub pan_range: [f64; 2],
    pub tilt_range: [f64; 2],
    /// Encoder steps, radians; 0 when unknown.
    pub pan_step: f64,
    pub tilt_step: f64,
    /// The grid that was scanned.
    pub region: RecordedRegion,
    /// Image sizes (width, height); camera 0 is the head's.
    pub cameras: Vec<(u32, u32)>,
}

/// A grid of positions, radians.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordedRegion {
    pub pan: [f64; 2],
    pub tilt: [f64; 2],
    pub pan_steps: u32,
    pub tilt_steps: u32,
}

/// One shot: where the head stood (as the device reads it) and the pictures that were taken.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordedShot {
    /// Radians.
    pub pan: f64,
    pub tilt: f64,
    /// 0 (wide) to 1 (tele).
    #[serde(default)]
    pub zoom: f64,
    /// One for each camera of the recording.
    pub cameras: Vec<RecordedPictures>,
}

/// Files in the recording's folder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordedPictures {
    /// With the laser off, and on; at least one of each.
    pub off: Vec<String>,
    pub on: Vec<String>,
}

impl RecordingInfo {
    pub fn validate(&self) -> Result<()> {
        self.rig.validate()?;
        let wrong = |name, reason: String| Err(Error::invalid(name, reason));
        let intervals = [
            ("head.pan_range", self.pan_range),
            ("head.tilt_range", self.tilt_range),
            ("region.pan", self.region.pan),
            ("region.tilt", self.region.tilt),
        ];
        for (name, [low, high]) in intervals {
            if !(low.is_finite() && high.is_finite() && low <= high) {
                return wrong(name, format!("[{low}, {high}] is no interval"));
            }
        }
        if ![self.pan_step, self.tilt_step].iter().all(|step| (0.0..1.0).contains(step)) {
            return wrong("head", format!("steps of {} and {} rad", self.pan_step, self.tilt_step));
        }
        if self.cameras.is_empty() || self.cameras.len() > MAX_CAMERAS {
            return wrong("cameras", format!("{}, not 1 to {MAX_CAMERAS}", self.cameras.len()));
        }
        if let Some((w, h)) = self.cameras.iter().find(|(w, h)| [w, h].iter().any(|v| !(1..=MAX_SIDE).contains(*v))) {
            return wrong("cameras", format!("an image of {w} x {h}"));
        }
        if self.cameras[0] != (self.rig.width, self.rig.height) {
            return wrong("cameras", "the first is not of the rig model's image size".into());
        }
        Ok(())
    }
}

impl RecordedShot {
    /// Checks numbers, counts, and that the names stay inside the folder.
    fn validate(&self, cameras: usize) -> std::result::Result<(), String> {
        if ![self.pan, self.tilt, self.zoom].iter().all(|v| v.is_finite()) {
            return Err("a number is not finite".into());
        }
        if self.cameras.len() != cameras {
            return Err(format!("{} cameras, the recording has {cameras}", self.cameras.len()));
        }
        for names in self.cameras.iter().flat_map(|c| [&c.off, &c.on]) {
            if names.is_empty() || names.len() > MAX_FRAMES {
                return Err(format!("{} pictures of one state, not 1 to {MAX_FRAMES}", names.len()));
            }
            if let Some(name) = names.iter().find(|name| !stays_inside(name)) {
                return Err(format!("{name:?} is no file of the recording's folder"));
            }
        }
        Ok(())
    }
}

/// A relative path of plain names.
fn stays_inside(name: &str) -> bool {
    name.len() <= 1024
        && !name.contains(['\\', '\0'])
        && name.split('/').all(|part| !part.is_empty() && part != "." && part != "..")
}

/// The text of `recording.json`.
pub fn to_json(info: &RecordingInfo) -> Result<String> {
    info.validate()?;
    text_of(&FileSchema::from(info))
}

/// Reads the text of `recording.json`; `name` is what errors call it.
///
/// # Errors
/// `FileFormat` that names the key; `FileVersion`.
pub fn from_json(text: &[u8], name: &str) -> Result<RecordingInfo> {
    let file: FileSchema = versioned(text, name, FORMAT, VERSION)?;
    let info = RecordingInfo::try_from(file).map_err(|reason| format_error(name, reason))?;
    info.validate().map_err(|e| format_error(name, e.to_string()))?;
    Ok(info)
}

/// A line of `shots.jsonl`, with its end.
pub fn shot_to_line(shot: &RecordedShot) -> Result<String> {
    let mut line = serde_json::to_string(shot).map_err(|e| Error::Internal { reason: format!("to JSON: {e}") })?;
    line.push('\n');
    Ok(line)
}

/// Reads `shots.jsonl`: the shots, and how many bytes of it are whole lines. What follows the last
/// line's end was being written when the recorder was killed, and is left out.
///
/// # Errors
/// `FileFormat` that names the line.
pub fn shots_from_lines(text: &[u8], cameras: usize, name: &str) -> Result<(Vec<RecordedShot>, usize)> {
    let whole = text.iter().rposition(|b| *b == b'\n').map_or(0, |i| i + 1);
    let mut shots = Vec::new();
    for (number, line) in text[..whole].split(|b| *b == b'\n').enumerate() {
        if line.trim_ascii().is_empty() {
            continue;
        }
        let wrong = |reason: String| format_error(name, format!("line {}: {reason}", number + 1));
        if line.len() > MAX_LINE {
            return Err(wrong(format!("longer than {MAX_LINE} bytes")));
        }
        let shot: RecordedShot = serde_json::from_slice(line).map_err(|e| wrong(e.to_string()))?;
        shot.validate(cameras).map_err(wrong)?;
        shots.push(shot);
    }
    Ok((shots, whole))
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileSchema {
    format: String,
    version: u32,
    rig: RigSchema,
    head: HeadSchema,
    region: RecordedRegion,
    cameras: Vec<SizeSchema>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RigSchema {
    image_width: u32,
    image_height: u32,
    intrinsics: IntrinsicsSchema,
    distortion: DistortionSchema,
    laser: LaserSchema,
    /// tilt_y tilt_z pan_x pan_z, metres.
    axis_offsets: [f64; 4],
    /// Zero (radians) and scale.
    pan_encoder: [f64; 2],
    tilt_encoder: [f64; 2],
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct HeadSchema {
    pan_range: [f64; 2],
    tilt_range: [f64; 2],
    pan_step: f64,
    tilt_step: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SizeSchema {
    image_width: u32,
    image_height: u32,
}

impl From<&RecordingInfo> for FileSchema {
    fn from(info: &RecordingInfo) -> Self {
        let RigModel { width, height, intrinsics, distortion, laser, offsets: o, encoders: e } = &info.rig;
        Self {
            format: FORMAT.into(),
            version: VERSION,
            rig: RigSchema {
                image_width: *width,
                image_height: *height,
                intrinsics: intrinsics.into(),
                distortion: distortion.into(),
                laser: laser.into(),
                axis_offsets: [o.tilt_y, o.tilt_z, o.pan_x, o.pan_z],
                pan_encoder: [e.pan_zero, e.pan_scale],
                tilt_encoder: [e.tilt_zero, e.tilt_scale],
            },
            head: HeadSchema {
                pan_range: info.pan_range,
                tilt_range: info.tilt_range,
                pan_step: info.pan_step,
                tilt_step: info.tilt_step,
            },
            region: info.region,
            cameras: info
                .cameras
                .iter()
                .map(|&(image_width, image_height)| SizeSchema { image_width, image_height })
                .collect(),
        }
    }
}

impl TryFrom<FileSchema> for RecordingInfo {
    type Error = String;

    fn try_from(file: FileSchema) -> std::result::Result<Self, String> {
        let FileSchema { rig, head, region, cameras, .. } = file;
        let [tilt_y, tilt_z, pan_x, pan_z] = rig.axis_offsets;
        let ([pan_zero, pan_scale], [tilt_zero, tilt_scale]) = (rig.pan_encoder, rig.tilt_encoder);
        Ok(Self {
            rig: RigModel {
                width: rig.image_width,
                height: rig.image_height,
                intrinsics: Intrinsics::from(&rig.intrinsics),
                distortion: Distortion::try_from(&rig.distortion)?,
                laser: rig.laser.into(),
                offsets: AxisOffsets { tilt_y, tilt_z, pan_x, pan_z },
                encoders: Encoders { pan_zero, pan_scale, tilt_zero, tilt_scale },
            },
            pan_range: head.pan_range,
            tilt_range: head.tilt_range,
            pan_step: head.pan_step,
            tilt_step: head.tilt_step,
            region,
            cameras: cameras.iter().map(|c| (c.image_width, c.image_height)).collect(),
        })
    }
}
