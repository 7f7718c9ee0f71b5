//! A pseudo-terminal as a serial line.

use std::fs;
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use serialport::{SerialPort, TTYPort};

use super::emulator::Emulator;
use super::ports::Port;
use super::wire::{Origin, Outgoing};
use crate::device::device_error;
use crate::error::{Error, Result};

pub(super) struct Pty {
    /// A symbolic link to the slave.
    path: PathBuf,
    line: Option<Line>,
}

struct Line {
    master: TTYPort,
    /// Held open, so that the line stays when a controller closes it.
    _slave: TTYPort,
}

impl Pty {
    pub fn open(path: &Path) -> Result<Self> {
        let line = Some(plugged_in(path)?);
        Ok(Self { path: path.to_owned(), line })
    }

    fn remove_link(&self) {
        // Not when somebody has put a file there meanwhile.
        if fs::symlink_metadata(&self.path).is_ok_and(|m| m.is_symlink()) {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// A new pseudo-terminal, raw, behind the link.
fn plugged_in(path: &Path) -> Result<Line> {
    let device = path.display().to_string();
    let (mut master, slave) = TTYPort::pair().map_err(|e| device_error(&device, &e.into()))?;
    master.set_timeout(Duration::ZERO).map_err(|e| device_error(&device, &e.into()))?;
    let unnamed = || Error::Device { reason: "the system's pseudo-terminal has no name".into() };
    let target = slave.name().ok_or_else(unnamed)?;
    match fs::symlink_metadata(path) {
        Ok(found) if !found.is_symlink() => return Err(Error::DeviceBusy { device }),
        Ok(_) => fs::remove_file(path).map_err(|e| device_error(&device, &e))?,
        Err(_) => {}
    }
    std::os::unix::fs::symlink(target, path).map_err(|e| device_error(&device, &e))?;
    Ok(Line { master, _slave: slave })
}

impl Port for Pty {
    fn plug(&mut self, plugged: bool) {
        if !plugged && self.line.take().is_some() {
            self.remove_link();
        } else if plugged && self.line.is_none() {
            // Tried again in the next turn.
            self.line = plugged_in(&self.path).ok();
        }
    }

    fn hear(&mut self, number: u16, emulator: &mut Emulator, now: f64) -> bool {
        let Some(line) = &mut self.line else { return false };
        let mut buffer = [0; 256];
        match line.master.read(&mut buffer) {
            Ok(count) => {
                emulator.feed_line(&buffer[..count], Origin { port: number, ..Origin::default() }, now);
                count > 0
            }
            Err(error) => {
                if !matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted | ErrorKind::WouldBlock) {
                    self.line = None;
                }
                false
            }
        }
    }

    fn say(&mut self, outgoing: &Outgoing) {
        // A line that nobody reads is full at last, and what is said is lost, as on a real one.
        if let Some(line) = &mut self.line {
            let _ = line.master.write(&outgoing.bytes);
        }
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        self.remove_link();
    }
}
