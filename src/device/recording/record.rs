//! Writing a recording, shot by shot.

use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::{INFO, SHOTS};
use crate::device::PtzPosition;
use crate::error::{Error, Result};
use crate::format::recording_json::{
    self, RecordedPictures, RecordedShot, RecordingInfo, shot_to_line, shots_from_lines,
};
use crate::format::{io_error, write_atomically, write_png};
use crate::image::{ImageView, PixelFormat};

/// Adds shots to a recording's folder. A shot is in it when its line in `shots.jsonl` is, which is
/// written after its pictures.
#[derive(Debug)]
pub struct Recorder {
    folder: PathBuf,
    shots: File,
    /// Length of `shots.jsonl`.
    end: u64,
    /// Number of the next shot, in the names of its pictures.
    next: usize,
    cameras: usize,
}

impl Recorder {
    /// Starts a recording in a new or empty folder, or goes on with the one of the same scan.
    ///
    /// # Errors
    /// `FileMismatch` for a folder that holds anything else; `FileIo`; `DiskFull`; `FileFormat` for a
    /// recording that is damaged.
    pub fn open(folder: &Path, info: &RecordingInfo) -> Result<Self> {
        let text = recording_json::to_json(info)?;
        fs::create_dir_all(folder).map_err(|e| io_error(folder, &e))?;
        let path = folder.join(INFO);
        let mismatch = |reason: &str| Error::FileMismatch { path: folder.display().to_string(), reason: reason.into() };
        match fs::read(&path) {
            Ok(found) if found == text.as_bytes() => {}
            Ok(_) => return Err(mismatch("the recording of another scan")),
            Err(e) if e.kind() == ErrorKind::NotFound => {
                let mut entries = fs::read_dir(folder).map_err(|e| io_error(folder, &e))?;
                if entries.next().is_some() {
                    return Err(mismatch("the folder is not empty and holds no recording"));
                }
                write_atomically(&path, text.as_bytes())?;
            }
            Err(e) => return Err(io_error(&path, &e)),
        }
        let path = folder.join(SHOTS);
        let open = || {
            let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path)?;
            let mut lines = Vec::new();
            std::io::Read::read_to_end(&mut file, &mut lines)?;
            Ok((file, lines))
        };
        let (mut shots, lines) = open().map_err(|e: std::io::Error| io_error(&path, &e))?;
        if let Err(std::fs::TryLockError::WouldBlock) = shots.try_lock() {
            return Err(Error::Busy { what: "the recording" });
        }
        let (recorded, whole) = shots_from_lines(&lines, info.cameras.len(), &path.display().to_string())?;
        let cut = shots.set_len(whole as u64).and_then(|()| shots.seek(SeekFrom::End(0)));
        cut.map_err(|e| io_error(&path, &e))?;
        Ok(Self { folder: folder.into(), shots, end: whole as u64, next: recorded.len(), cameras: info.cameras.len() })
    }

    /// Adds a shot: for each camera its frames with the laser off, and on.
    pub fn add(&mut self, position: PtzPosition, cameras: &[(Vec<ImageView<'_>>, Vec<ImageView<'_>>)]) -> Result<()> {
        if cameras.len() != self.cameras {
            return Err(Error::Internal { reason: format!("{} cameras, not {}", cameras.len(), self.cameras) });
        }
        let mut written = Vec::with_capacity(cameras.len());
        for (camera, (off, on)) in cameras.iter().enumerate() {
            let state = |name: &str, views: &[ImageView<'_>]| -> Result<Vec<String>> {
                let stem = |i| format!("{:06}-camera{camera}-{name}{i}", self.next);
                views.iter().enumerate().map(|(i, view)| write_frame(&self.folder, &stem(i), view)).collect()
            };
            written.push(RecordedPictures { off: state("off", off)?, on: state("on", on)? });
        }
        let PtzPosition { pan, tilt, zoom } = position;
        let line = shot_to_line(&RecordedShot { pan, tilt, zoom, cameras: written })?;
        match self.shots.write_all(line.as_bytes()) {
            Ok(()) => {
                self.end += line.len() as u64;
                self.next += 1;
                Ok(())
            }
            Err(e) => {
                // Half a line would spoil the next; opening cuts it off if this cannot.
                let _ = self.shots.set_len(self.end).and_then(|()| self.shots.seek(SeekFrom::Start(self.end)));
                Err(io_error(&self.folder.join(SHOTS), &e))
            }
        }
    }
}

/// Writes a frame without loss and gives its name: PNG, or the bare samples of formats that PNG would
/// convert.
fn write_frame(folder: &Path, stem: &str, view: &ImageView<'_>) -> Result<String> {
    let raw = match view.format() {
        PixelFormat::Yuyv => "yuyv",
        PixelFormat::Nv12 => "nv12",
        PixelFormat::I420 => "i420",
        _ => {
            let name = format!("{stem}.png");
            write_png(&folder.join(&name), view)?;
            return Ok(name);
        }
    };
    let name = format!("{stem}.{raw}");
    write_atomically(&folder.join(&name), &view.to_image().data)?;
    Ok(name)
}
