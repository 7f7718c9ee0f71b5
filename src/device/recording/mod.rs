//! Recorded scans: [`Recorder`] writes the frames of a scan to a folder, [`Recording`] plays such a
//! folder back as a head, a laser and cameras. The format is docs/recordings.md.

mod record;
mod replay;

pub use record::Recorder;
pub use replay::{Recording, RecordingFrames, RecordingHead, RecordingLaser};

/// In a recording's folder.
const INFO: &str = "recording.json";
const SHOTS: &str = "shots.jsonl";

#[cfg(test)]
mod tests;
