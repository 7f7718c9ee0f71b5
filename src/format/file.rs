//! Reading with a bound, at once or from front to back, and whole-file writing by rename.

use std::fs::{self, File, OpenOptions};
use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use crate::error::{Error, Result};

/// Writes `bytes` to a temporary file in the same folder and renames it to `path`, so that `path`
/// is at every moment either the old file or the whole new one.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    write_streamed(path, &mut |file| file.write_all(bytes))
}

/// Like [`write_atomically`], with what `write` writes.
pub(super) fn write_streamed(path: &Path, write: &mut dyn FnMut(&mut dyn Write) -> std::io::Result<()>) -> Result<()> {
    let temporary = temporary_beside(path)?;
    let written = OpenOptions::new().write(true).create_new(true).open(&temporary).and_then(|mut file| {
        write(&mut file)?;
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

/// A file that is read from front to back, with as many bytes as are still to come.
pub(super) struct Source<'a> {
    reader: Box<dyn BufRead + 'a>,
    pub name: String,
    pub left: u64,
}

impl<'a> Source<'a> {
    pub fn open(path: &Path) -> Result<Self> {
        let name = path.display().to_string();
        let file = File::open(path).map_err(|e| io_error(path, &e))?;
        let about = file.metadata().map_err(|e| io_error(path, &e))?;
        if !about.is_file() {
            return Err(Error::FileIo { path: name, reason: "not a file".into() });
        }
        Ok(Self { reader: Box::new(BufReader::with_capacity(1 << 18, file)), name, left: about.len() })
    }

    pub fn of(bytes: &'a [u8], name: &str) -> Self {
        Self { reader: Box::new(bytes), name: name.into(), left: bytes.len() as u64 }
    }

    pub fn wrong(&self, reason: impl Into<String>) -> Error {
        format_error(&self.name, reason)
    }

    /// Fills `bytes`.
    pub fn read(&mut self, bytes: &mut [u8]) -> Result<()> {
        self.left = self.left.checked_sub(bytes.len() as u64).ok_or_else(|| self.wrong("cut short"))?;
        self.reader.read_exact(bytes).map_err(|e| self.failed(&e))
    }

    /// The bytes before the next one that `end` takes, which is passed over too; at most `limit` of them.
    /// And whether there was one before the file's end.
    fn until(&mut self, end: impl Fn(u8) -> bool, limit: usize) -> Result<(Vec<u8>, bool)> {
        let mut found = Vec::new();
        loop {
            let failed = |e: &std::io::Error| Error::FileIo { path: self.name.clone(), reason: e.to_string() };
            let buffer = self.reader.fill_buf().map_err(|e| failed(&e))?;
            if buffer.is_empty() {
                self.left = 0;
                return Ok((found, false));
            }
            let stop = buffer.iter().position(|b| end(*b));
            let taken = stop.unwrap_or(buffer.len());
            if found.len() + taken > limit {
                return Err(self.wrong(format!("no line or number is longer than {limit} bytes")));
            }
            found.extend_from_slice(&buffer[..taken]);
            let passed = taken + usize::from(stop.is_some());
            self.reader.consume(passed);
            self.left = self.left.saturating_sub(passed as u64);
            if stop.is_some() {
                return Ok((found, true));
            }
        }
    }

    /// The next line as text without its end; `None` where the file ends before the line.
    pub fn line(&mut self, limit: usize) -> Result<Option<String>> {
        let (mut line, ended) = self.until(|b| b == b'\n', limit)?;
        if !ended {
            return Ok(None);
        }
        if line.last() == Some(&b'\r') {
            line.pop();
        }
        String::from_utf8(line).map(Some).map_err(|_| self.wrong("the header is not text"))
    }

    /// The next word; `None` at the file's end.
    pub fn word(&mut self) -> Result<Option<Vec<u8>>> {
        const LONGEST_NUMBER: usize = 1 << 10;
        loop {
            let (word, ended) = self.until(|b| b.is_ascii_whitespace(), LONGEST_NUMBER)?;
            if !word.is_empty() || !ended {
                return Ok((!word.is_empty()).then_some(word));
            }
        }
    }

    /// Refuses fewer than `count` pieces of at least `size` bytes: a file that promises more than it
    /// has is found out before memory is taken for it.
    pub fn expect(&self, count: usize, size: usize, what: &str) -> Result<()> {
        let needed = (count as u128) * (size as u128);
        if needed > u128::from(self.left) {
            return Err(self.wrong(format!("{} bytes of {what}, the header promises {needed}", self.left)));
        }
        Ok(())
    }

    fn failed(&self, e: &std::io::Error) -> Error {
        match e.kind() {
            ErrorKind::UnexpectedEof => self.wrong("cut short"),
            _ => Error::FileIo { path: self.name.clone(), reason: e.to_string() },
        }
    }
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
