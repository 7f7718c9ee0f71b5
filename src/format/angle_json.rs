//! A head's angle map, with what was left over when it was learned, as versioned JSON.

use std::path::Path;

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::file::{format_error, read_bounded, write_atomically};
use super::model_json::{text_of, versioned};
use crate::error::{Error, Result};
use crate::geometry::angle_map::{AngleMap, AxisMap, Mounting};

const FORMAT: &str = "ptzcal-angle-map";
const VERSION: u32 = 1;
/// Twice what 64 nodes an axis, 1000 frames and all their pairs take.
const MAX_BYTES: u64 = 8 << 20;
/// Most frames and pairs of a record.
const MAX_RESIDUALS: usize = 100_000;

/// What an angle map's file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct AngleMapRecord {
    pub map: AngleMap,
    pub learned: Option<LearningRecord>,
}

/// How the map was found; the fields mean what those of
/// [`LearnedAngles`](crate::angle_learning::LearnedAngles) mean.
#[derive(Debug, Clone, PartialEq)]
pub struct LearningRecord {
    /// px.
    pub rms: f64,
    pub outliers: f64,
    /// Radians.
    pub repeatability: [f64; 2],
    pub parallax: f64,
    pub parallax_sigma: f64,
    /// Device's pan and tilt, deviation of pan and tilt (radians), rms (px), sights.
    pub frames: Vec<([f64; 2], [f64; 2], f64, u32)>,
    /// Two frames, points that both see, rms (px).
    pub pairs: Vec<([u32; 2], u32, f64)>,
}

/// Writes the file at once: on an error the old one, if any, is still there.
pub fn write_angle_map(path: &Path, record: &AngleMapRecord) -> Result<()> {
    write_atomically(path, to_json(record)?.as_bytes())
}

/// Errors: `FileIo`; `FileVersion`; `FileFormat` that names the key or the line.
pub fn read_angle_map(path: &Path) -> Result<AngleMapRecord> {
    from_json(&read_bounded(path, MAX_BYTES)?, &path.display().to_string())
}

/// The file's text. Refuses residuals that are not finite.
pub fn to_json(record: &AngleMapRecord) -> Result<String> {
    if let Some(learned) = &record.learned {
        learned.check().map_err(|reason| Error::invalid("learned", reason))?;
    }
    text_of(&FileSchema::from(record))
}

/// Reads a file's text; `name` is what errors call it. All that [`AxisMap::new`] and [`AngleMap::new`]
/// check is checked.
pub fn from_json(text: &[u8], name: &str) -> Result<AngleMapRecord> {
    if text.len() as u64 > MAX_BYTES {
        return Err(format_error(name, format!("longer than {MAX_BYTES} bytes")));
    }
    let file: FileSchema = versioned(text, name, FORMAT, VERSION)?;
    AngleMapRecord::try_from(file).map_err(|reason| format_error(name, reason))
}

impl LearningRecord {
    fn check(&self) -> std::result::Result<(), String> {
        if self.frames.len() > MAX_RESIDUALS || self.pairs.len() > MAX_RESIDUALS {
            return Err(format!("more than {MAX_RESIDUALS} frames or pairs"));
        }
        let scalars = [self.rms, self.outliers, self.parallax, self.parallax_sigma];
        let frames = self.frames.iter().flat_map(|(raw, off, rms, _)| [raw[0], raw[1], off[0], off[1], *rms]);
        let mut all = scalars.into_iter().chain(self.repeatability).chain(frames).chain(self.pairs.iter().map(|p| p.2));
        if all.any(|v| !v.is_finite()) {
            return Err("a residual is NaN or infinite".into());
        }
        match self.pairs.iter().position(|p| p.0.iter().any(|f| *f as usize >= self.frames.len())) {
            Some(i) => Err(format!("pair {i} names a frame that is not there")),
            None => Ok(()),
        }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileSchema {
    format: String,
    version: u32,
    pan: AxisSchema,
    tilt: AxisSchema,
    mounting: MountingSchema,
    #[serde(skip_serializing_if = "Option::is_none")]
    learned: Option<LearnedSchema>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct AxisSchema {
    /// Device's number, angle in radians; in the order of ascending numbers.
    nodes: Vec<[f64; 2]>,
    /// Of the angles, rows.
    covariance: Vec<Vec<f64>>,
    roughness: f64,
}

/// Radians; sigma in the order collimation, roll, trunnion.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct MountingSchema {
    collimation: f64,
    roll: f64,
    trunnion: f64,
    sigma: [f64; 3],
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LearnedSchema {
    rms: f64,
    outliers: f64,
    repeatability: [f64; 2],
    parallax: f64,
    parallax_sigma: f64,
    frames: Vec<FrameSchema>,
    pairs: Vec<PairSchema>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FrameSchema {
    raw: [f64; 2],
    deviation: [f64; 2],
    rms: f64,
    sights: u32,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PairSchema {
    frames: [u32; 2],
    matches: u32,
    rms: f64,
}

impl From<&AxisMap> for AxisSchema {
    fn from(axis: &AxisMap) -> Self {
        Self {
            nodes: axis.nodes().to_vec(),
            covariance: axis.covariance().row_iter().map(|row| row.iter().copied().collect()).collect(),
            roughness: axis.roughness(),
        }
    }
}

impl From<&AngleMapRecord> for FileSchema {
    fn from(record: &AngleMapRecord) -> Self {
        let Mounting { collimation, roll, trunnion } = record.map.mounting;
        let learned = record.learned.as_ref().map(|l| LearnedSchema {
            rms: l.rms,
            outliers: l.outliers,
            repeatability: l.repeatability,
            parallax: l.parallax,
            parallax_sigma: l.parallax_sigma,
            frames: l
                .frames
                .iter()
                .map(|&(raw, deviation, rms, sights)| FrameSchema { raw, deviation, rms, sights })
                .collect(),
            pairs: l.pairs.iter().map(|&(frames, matches, rms)| PairSchema { frames, matches, rms }).collect(),
        });
        Self {
            format: FORMAT.into(),
            version: VERSION,
            pan: AxisSchema::from(&record.map.pan),
            tilt: AxisSchema::from(&record.map.tilt),
            mounting: MountingSchema { collimation, roll, trunnion, sigma: record.map.mounting_sigma },
            learned,
        }
    }
}

fn axis(name: &str, schema: AxisSchema) -> std::result::Result<AxisMap, String> {
    let size = schema.covariance.len();
    if let Some(row) = schema.covariance.iter().position(|row| row.len() != size) {
        return Err(format!("{name}: covariance: row {row} has not {size} numbers"));
    }
    let covariance = DMatrix::from_fn(size, size, |i, j| schema.covariance[i][j]);
    AxisMap::new(schema.nodes, covariance, schema.roughness).map_err(|e| format!("{name}: {e}"))
}

impl TryFrom<FileSchema> for AngleMapRecord {
    type Error = String;

    fn try_from(file: FileSchema) -> std::result::Result<Self, String> {
        let MountingSchema { collimation, roll, trunnion, sigma } = file.mounting;
        let (pan, tilt) = (axis("pan", file.pan)?, axis("tilt", file.tilt)?);
        let map =
            AngleMap::new(pan, tilt, Mounting { collimation, roll, trunnion }, sigma).map_err(|e| e.to_string())?;
        let learned = file.learned.map(|l| LearningRecord {
            rms: l.rms,
            outliers: l.outliers,
            repeatability: l.repeatability,
            parallax: l.parallax,
            parallax_sigma: l.parallax_sigma,
            frames: l.frames.iter().map(|f| (f.raw, f.deviation, f.rms, f.sights)).collect(),
            pairs: l.pairs.iter().map(|p| (p.frames, p.matches, p.rms)).collect(),
        });
        if let Some(learned) = &learned {
            learned.check()?;
        }
        Ok(Self { map, learned })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> AngleMapRecord {
        let axis = |scale: f64| {
            let nodes = (0..5).map(|i| f64::from(i) * 0.5 - 1.0).map(|r| [r, scale * r + 0.1 * r.sin()]).collect();
            AxisMap::new(nodes, DMatrix::identity(5, 5) * 1e-9, 1e-10).unwrap()
        };
        let mounting = Mounting { collimation: 0.01, roll: -0.02, trunnion: 0.003 };
        let map = AngleMap::new(axis(-1.7), axis(0.4), mounting, [1e-4, 2e-4, 3e-4]).unwrap();
        let learned = LearningRecord {
            rms: 0.4,
            outliers: 0.05,
            repeatability: [1e-4, 2e-4],
            parallax: 0.01,
            parallax_sigma: 0.002,
            frames: vec![([0.0, 0.5], [1e-5, -2e-5], 0.3, 40), ([0.1, 0.5], [0.0, 0.0], 0.35, 41)],
            pairs: vec![([0, 1], 30, 0.4)],
        };
        AngleMapRecord { map, learned: Some(learned) }
    }

    #[test]
    fn what_is_written_is_read_to_the_last_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.json");
        for record in [record(), AngleMapRecord { learned: None, ..record() }] {
            write_angle_map(&path, &record).unwrap();
            assert_eq!(read_angle_map(&path).unwrap(), record);
        }
        assert!(read_angle_map(&folder.path().join("none.json")).is_err());
    }

    #[test]
    fn hostile_files_are_refused() {
        let text = to_json(&record()).unwrap();
        let read = |text: &str| from_json(text.as_bytes(), "file").map(|_| ()).unwrap_err();
        for (from, to) in [
            ("ptzcal-angle-map", "ptzcal-camera"),
            ("\"roughness\": 1e-10", "\"roughness\": -1"),
            ("\"roughness\": 1e-10", "\"roughness\": 1e999"),
            ("\"roughness\"", "\"rough\""),
            ("[-1.0,", "[7.0,"),
            ("[1e-9,0.0,", "[1e-9,"),
            ("\"roll\": -0.02", "\"roll\": 4"),
            ("[0,1]", "[0,2]"),
            ("\"matches\": 30", "\"matches\": -30"),
            ("0.0001,0.0002,0.0003", "0.0001,-0.0002,0.0003"),
        ] {
            assert!(text.contains(from), "{from} in {text}");
            let error = read(&text.replacen(from, to, 1));
            assert!(matches!(error, Error::FileFormat { .. }), "{from} -> {to}: {error}");
        }
        let error = read(&text.replacen("\"version\": 1", "\"version\": 2", 1));
        assert_eq!(error, Error::FileVersion { path: "file".into(), found: 2, supported: 1 });
        for end in (0..text.len() - 1).step_by(7) {
            read(&text[..end]);
        }
        let mut bad = record();
        bad.learned.as_mut().unwrap().frames[0].2 = f64::NAN;
        assert!(to_json(&bad).is_err());
        read(&" ".repeat(MAX_BYTES as usize + 1));
    }

    /// Bytes that are no file, and a file with bytes changed, end in an error or in a map that is one.
    #[test]
    fn fuzz_files_never_panic() {
        let inputs = crate::fuzz::fuzz_inputs();
        // A file takes some hundred times as long as a packet.
        let text = to_json(&AngleMapRecord { learned: None, ..record() }).unwrap().into_bytes();
        let mut state = 1u64;
        let mut random = move |n: usize| {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as usize % n
        };
        for _ in 0..inputs / 50 {
            let mut bytes = text.clone();
            for _ in 0..=random(3) {
                let at = random(bytes.len());
                bytes[at] = b"0123456789.-e[]{},:\"\xff"[random(21)];
            }
            if let Ok(record) = from_json(&bytes, "fuzz") {
                let [low, high] = record.map.pan.raw_range();
                assert!(record.map.pan.angle(0.5 * (low + high)).is_ok());
            }
        }
    }
}
