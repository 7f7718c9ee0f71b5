//! A rig's lens and laser line over zoom, as versioned JSON.

use std::path::Path;

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::file::{format_error, read_bounded, write_atomically};
use super::model_json::{DistortionSchema, IntrinsicsSchema, text_of, versioned};
use crate::error::Result;
use crate::geometry::rig_model::LaserLine;
use crate::geometry::zoom_curve::{ZoomCurve, ZoomNode};
use crate::geometry::{Distortion, Intrinsics};

const FORMAT: &str = "ptzcal-zoom-curve";
const VERSION: u32 = 1;
/// Twice what 64 positions take.
const MAX_BYTES: u64 = 64 << 20;

/// Writes the file at once: on an error the old one, if any, is still there.
pub fn write_zoom_curve(path: &Path, curve: &ZoomCurve) -> Result<()> {
    write_atomically(path, to_json(curve)?.as_bytes())
}

/// Errors: `FileIo`; `FileVersion`; `FileFormat` that names the key or the line.
pub fn read_zoom_curve(path: &Path) -> Result<ZoomCurve> {
    from_json(&read_bounded(path, MAX_BYTES)?, &path.display().to_string())
}

/// The file's text.
pub fn to_json(curve: &ZoomCurve) -> Result<String> {
    text_of(&FileSchema::from(curve))
}

/// Reads a file's text; `name` is what errors call it. All that [`ZoomCurve::new`] checks is checked.
pub fn from_json(text: &[u8], name: &str) -> Result<ZoomCurve> {
    let file: FileSchema = versioned(text, name, FORMAT, VERSION)?;
    ZoomCurve::try_from(file).map_err(|reason| format_error(name, reason))
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileSchema {
    format: String,
    version: u32,
    image_width: u32,
    image_height: u32,
    /// In the order of ascending zoom.
    positions: Vec<PositionSchema>,
    /// Of fx fy skew cx cy, the coefficients, x0 y0 vx vy of all positions, position after position.
    covariance: Vec<Vec<f64>>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PositionSchema {
    zoom: f64,
    intrinsics: IntrinsicsSchema,
    distortion: DistortionSchema,
    laser: LaserSchema,
}

/// Metres, and metres per metre of depth.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LaserSchema {
    x0: f64,
    y0: f64,
    vx: f64,
    vy: f64,
}

impl From<&LaserLine> for LaserSchema {
    fn from(line: &LaserLine) -> Self {
        let LaserLine { x0, y0, vx, vy } = *line;
        Self { x0, y0, vx, vy }
    }
}

impl From<LaserSchema> for LaserLine {
    fn from(schema: LaserSchema) -> Self {
        let LaserSchema { x0, y0, vx, vy } = schema;
        Self { x0, y0, vx, vy }
    }
}

impl From<&ZoomCurve> for FileSchema {
    fn from(curve: &ZoomCurve) -> Self {
        let position = |n: &ZoomNode| PositionSchema {
            zoom: n.zoom,
            intrinsics: IntrinsicsSchema::from(&n.intrinsics),
            distortion: DistortionSchema::from(&n.distortion),
            laser: LaserSchema::from(&n.laser),
        };
        let [image_width, image_height] = curve.size();
        Self {
            format: FORMAT.into(),
            version: VERSION,
            image_width,
            image_height,
            positions: curve.nodes().iter().map(position).collect(),
            covariance: curve.covariance().row_iter().map(|row| row.iter().copied().collect()).collect(),
        }
    }
}

impl TryFrom<FileSchema> for ZoomCurve {
    type Error = String;

    fn try_from(file: FileSchema) -> std::result::Result<Self, String> {
        let node = |p: PositionSchema| -> std::result::Result<ZoomNode, String> {
            Ok(ZoomNode {
                zoom: p.zoom,
                intrinsics: Intrinsics::from(&p.intrinsics),
                distortion: Distortion::try_from(&p.distortion)?,
                laser: p.laser.into(),
            })
        };
        let size = file.covariance.len();
        if let Some(row) = file.covariance.iter().position(|row| row.len() != size) {
            return Err(format!("covariance: row {row} has not {size} numbers"));
        }
        let covariance = DMatrix::from_fn(size, size, |i, j| file.covariance[i][j]);
        let nodes = file.positions.into_iter().map(node).collect::<std::result::Result<_, _>>()?;
        ZoomCurve::new([file.image_width, file.image_height], nodes, covariance).map_err(|e| e.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Status;
    use crate::fuzz::{Random, fuzz_inputs, mutated};

    #[test]
    fn fuzz_zoom_curves() {
        let node = |zoom: f64| ZoomNode {
            zoom,
            intrinsics: Intrinsics::new(700.0 + 300.0 * zoom, 360.0, 288.0),
            distortion: Distortion::None,
            laser: LaserLine { x0: 0.1, y0: 0.005, vx: -0.005, vy: 0.003 },
        };
        let curve = ZoomCurve::new([720, 576], vec![node(1.0), node(2.0)], DMatrix::identity(18, 18)).unwrap();
        let text = to_json(&curve).unwrap();
        assert_eq!(from_json(text.as_bytes(), "file").unwrap(), curve);
        let mut random = Random(5);
        let (mut read, mut refused) = (0, 0u64);
        for _ in 0..fuzz_inputs() / 20 {
            match from_json(&mutated(text.as_bytes(), &mut random), "file") {
                Ok(curve) => {
                    read += 1;
                    let [low, high] = curve.range();
                    assert!(curve.at(0.5 * low + 0.5 * high).is_ok());
                }
                Err(e) => {
                    refused += 1;
                    assert!(matches!(e.status(), Status::FileFormat | Status::FileVersion), "{e}");
                }
            }
        }
        // Most changes of a covariance leave none.
        assert!(read > fuzz_inputs() / 5000 && refused > fuzz_inputs() / 200, "{read} {refused}");
    }
}
