//! Whole-file reading with a bound and whole-file writing by rename.

use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use crate::error::{Error, Result};

/// Writes `bytes` to a temporary file in the same folder and renames it to `path`, so that `path`
/// is at every moment either the old file or the whole new one.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    let temporary = temporary_beside(path)?;
    let written = OpenOptions::new().write(true).create_new(true).open(&temporary).and_then(|mut file| {
        file.write_all(bytes)?;
        // The name must not point at data that a power cut can still lose.
        file.sync_all()?;
        fs::rename(&temporary, path)
    });
    written.map_err(|e| {
        // The first failure is what the caller must hear of.
        let _ = fs::remove_file(&temporary);
        io_error(path, &e)
    })
}

/// A name that no other thread or process uses.
fn temporary_beside(path: &Path) -> Result<PathBuf> {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let name = path.file_name().ok_or_else(|| Error::FileIo {
        path: path.display().to_string(),
        reason: "this is not the name of a file".into(),
    })?;
    let mut temporary = std::ffi::OsString::from(".");
    temporary.push(name);
    temporary.push(format!(".{}.{}.tmp", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed)));
    Ok(path.with_file_name(temporary))
}

/// The whole file, if it is no longer than `limit` bytes.
pub fn read_bounded(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path).and_then(|file| file.take(limit + 1).read_to_end(&mut bytes)).map_err(|e| io_error(path, &e))?;
    if bytes.len() as u64 > limit {
        return Err(format_error(&path.display().to_string(), format!("longer than {limit} bytes")));
    }
    Ok(bytes)
}

/// The error for a failed call on a file.
pub fn io_error(path: &Path, e: &std::io::Error) -> Error {
    let path = path.display().to_string();
    match e.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => Error::DiskFull { path },
        _ => Error::FileIo { path, reason: e.to_string() },
    }
}

pub(super) fn format_error(path: &str, reason: impl Into<String>) -> Error {
    Error::FileFormat { path: path.into(), reason: reason.into() }
}
