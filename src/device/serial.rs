//! Serial lines: 8 data bits, no parity, 1 stop bit, no flow control.
//!
//! The crate `serialport` opens and sets up the line. Reading and writing are done here, because its
//! `write` to a line that takes nothing blocks for ever, and a signal ends its calls.
#![allow(unsafe_code)]

use std::io::{self, ErrorKind, IsTerminal};
use std::os::fd::{AsRawFd, BorrowedFd};
use std::os::unix::fs::OpenOptionsExt;
use std::sync::{Arc, Mutex, PoisonError, RwLock};
use std::time::{Duration, Instant};

use serialport::{ClearBuffer, SerialPort, TTYPort};

use super::poll::{Ready, wait};
use super::{Link, Sender, device_error};
use crate::control::unpoisoned;
use crate::error::{Error, Result};

/// A line that has taken nothing for this long is given up, seconds.
const WRITE_TIMEOUT: f64 = 1.0;

/// Opens a serial line for this process alone, and raises DTR.
///
/// # Errors
/// `DeviceNotFound`, `DevicePermission`, `DeviceBusy` when another program (or another call of this
/// one) has it, `DeviceMismatch` for a file that is no serial line or does not do this baud rate.
pub fn open(path: &str, baud: u32) -> Result<Box<dyn Link>> {
    let port = serialport::new(path, baud)
        .dtr_on_open(true)
        .open_native()
        .map_err(|error| why_not_opened(path, baud, &error))?;
    set_nonblocking(&port).map_err(|error| device_error(path, &error))?;
    // What arrived before is no answer to anything.
    let _ = port.clear(ClearBuffer::All);
    Ok(Box::new(SerialLink(Arc::new(Line {
        name: path.to_owned(),
        port: RwLock::new(Some(port)),
        sending: Mutex::new(()),
    }))))
}

struct SerialLink(Arc<Line>);

struct Line {
    name: String,
    /// None once the device is gone: the descriptor is closed at once, or the kernel would keep the
    /// name and give the device another one when it is back.
    port: RwLock<Option<TTYPort>>,
    /// Held for a whole message.
    sending: Mutex<()>,
}

impl Link for SerialLink {
    fn receive(&mut self, buffer: &mut [u8], timeout: f64) -> Result<usize> {
        self.0.with_port(|port| {
            let fd = borrow(port);
            if buffer.is_empty() || !wait([fd], Ready::Read, timeout)?[0] {
                return Ok(0);
            }
            // SAFETY: the pointer and length are those of `buffer`.
            match retried(|| unsafe { libc::read(fd.as_raw_fd(), buffer.as_mut_ptr().cast(), buffer.len()) }) {
                // Ready and empty: hung up.
                Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
                Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(0),
                other => other,
            }
        })
    }

    fn sender(&self) -> Arc<dyn Sender> {
        self.0.clone()
    }
}

impl Sender for Line {
    fn send(&self, message: &[u8]) -> Result<()> {
        let _whole = unpoisoned(&self.sending);
        let sent = self.with_port(|port| {
            let end = Instant::now() + Duration::from_secs_f64(WRITE_TIMEOUT);
            let mut rest = message;
            while !rest.is_empty() {
                let left = end.saturating_duration_since(Instant::now()).as_secs_f64();
                let fd = borrow(port);
                if left == 0.0 || !wait([fd], Ready::Write, left)?[0] {
                    // The rest of this message must not come out later, before the next.
                    let _ = port.clear(ClearBuffer::Output);
                    return Ok(false);
                }
                // SAFETY: the pointer and length are those of `rest`.
                match retried(|| unsafe { libc::write(fd.as_raw_fd(), rest.as_ptr().cast(), rest.len()) }) {
                    Ok(count) => rest = rest.get(count..).unwrap_or_default(),
                    Err(error) if error.kind() == ErrorKind::WouldBlock => (),
                    Err(error) => return Err(error),
                }
            }
            Ok(true)
        })?;
        if sent { Ok(()) } else { Err(Error::DeviceTimeout { what: "serial line", seconds: WRITE_TIMEOUT }) }
    }
}

impl Line {
    /// Does something with the port; closes it when it turns out to be gone.
    fn with_port<T>(&self, work: impl FnOnce(&TTYPort) -> io::Result<T>) -> Result<T> {
        let result = {
            let port = self.port.read().unwrap_or_else(PoisonError::into_inner);
            let Some(port) = port.as_ref() else { return Err(self.lost("it is gone")) };
            work(port)
        };
        result.map_err(|error| {
            // A line that was open and fails is gone, whatever the driver calls it.
            *self.port.write().unwrap_or_else(PoisonError::into_inner) = None;
            self.lost(error)
        })
    }

    fn lost(&self, reason: impl ToString) -> Error {
        Error::DeviceLost { reason: format!("{}: {}", self.name, reason.to_string()) }
    }
}

fn borrow(port: &TTYPort) -> BorrowedFd<'_> {
    // SAFETY: the port owns the descriptor and outlives the borrow.
    unsafe { BorrowedFd::borrow_raw(port.as_raw_fd()) }
}

/// The result of a call that gives a count or -1, made again when a signal interrupted it.
fn retried(mut call: impl FnMut() -> isize) -> io::Result<usize> {
    loop {
        match usize::try_from(call()) {
            Ok(count) => return Ok(count),
            Err(_) => {
                let error = io::Error::last_os_error();
                if error.kind() != ErrorKind::Interrupted {
                    return Err(error);
                }
            }
        }
    }
}

fn set_nonblocking(port: &TTYPort) -> io::Result<()> {
    // SAFETY: fcntl on an open descriptor with an integer argument.
    let done = unsafe {
        let flags = libc::fcntl(port.as_raw_fd(), libc::F_GETFL);
        flags >= 0 && libc::fcntl(port.as_raw_fd(), libc::F_SETFL, flags | libc::O_NONBLOCK) >= 0
    };
    if done { Ok(()) } else { Err(io::Error::last_os_error()) }
}

/// `serialport` keeps a description of what failed, not the number of the error.
fn why_not_opened(path: &str, baud: u32, error: &serialport::Error) -> Error {
    if error.kind() == serialport::ErrorKind::NoDevice {
        return Error::DeviceBusy { device: path.to_owned() };
    }
    let flags = libc::O_NONBLOCK | libc::O_NOCTTY;
    match std::fs::OpenOptions::new().read(true).write(true).custom_flags(flags).open(path) {
        // EISDIR: not a device at all.
        Err(error) if error.raw_os_error() == Some(libc::EISDIR) => no_line(path),
        Err(error) => match device_error(path, &error) {
            // A name without a device behind it.
            Error::DeviceLost { .. } => Error::DeviceNotFound { device: path.to_owned(), reason: error.to_string() },
            other => other,
        },
        Ok(file) if !file.is_terminal() => no_line(path),
        Ok(_) => Error::DeviceMismatch {
            device: path.to_owned(),
            reason: format!("the line cannot be set to {baud} baud: {error}"),
        },
    }
}

fn no_line(path: &str) -> Error {
    Error::DeviceMismatch { device: path.to_owned(), reason: "this is no serial line".into() }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};

    use super::*;

    /// The far end, and the name of the near one, which stays alive through the second port.
    fn pair() -> (TTYPort, String) {
        let (far, near) = TTYPort::pair().unwrap();
        let name = near.name().unwrap();
        drop(near);
        (far, name)
    }

    #[test]
    fn bytes_go_both_ways() {
        let (mut far, name) = pair();
        let mut link = open(&name, 9600).unwrap();
        let sender = link.sender();
        sender.send(&[0x81, 0x09, 0x06, 0x12, 0xff]).unwrap();
        let mut asked = [0; 5];
        far.read_exact(&mut asked).unwrap();
        assert_eq!(asked, [0x81, 0x09, 0x06, 0x12, 0xff]);
        // Raw: no byte is changed, and none means anything to the line.
        let all: Vec<u8> = (0..=255).collect();
        far.write_all(&all).unwrap();
        let mut got = Vec::new();
        while got.len() < all.len() {
            let mut buffer = [0; 100];
            let count = link.receive(&mut buffer, 1.0).unwrap();
            assert!(count > 0);
            got.extend_from_slice(&buffer[..count]);
        }
        assert_eq!(got, all);
        let start = Instant::now();
        assert_eq!(link.receive(&mut [0; 8], 0.05).unwrap(), 0);
        assert_eq!(link.receive(&mut [0; 8], f64::NAN).unwrap(), 0);
        assert!(start.elapsed().as_secs_f64() >= 0.05 && start.elapsed().as_secs_f64() < 1.0);
    }

    #[test]
    fn a_second_opening_is_refused_and_a_later_one_is_not() {
        let (_far, name) = pair();
        let link = open(&name, 9600).unwrap();
        assert!(matches!(open(&name, 9600), Err(Error::DeviceBusy { .. })));
        drop(link);
        open(&name, 38400).unwrap();
    }

    #[test]
    fn an_unplugged_line_is_lost_at_once_and_for_all() {
        let (far, name) = pair();
        let mut link = open(&name, 9600).unwrap();
        let sender = link.sender();
        let waiting = std::thread::spawn(move || {
            let start = Instant::now();
            let result = link.receive(&mut [0; 8], 10.0);
            (result, start.elapsed().as_secs_f64(), link)
        });
        std::thread::sleep(Duration::from_millis(50));
        drop(far);
        let (result, seconds, mut link) = waiting.join().unwrap();
        assert!(matches!(result, Err(Error::DeviceLost { .. })) && seconds < 5.0, "{result:?}");
        assert!(matches!(sender.send(&[1]), Err(Error::DeviceLost { .. })));
        assert!(matches!(link.receive(&mut [0; 8], 1.0), Err(Error::DeviceLost { .. })));
    }

    #[test]
    fn a_line_that_takes_nothing_fails_in_time() {
        let (_far, name) = pair();
        let link = open(&name, 9600).unwrap();
        let sender = link.sender();
        let start = Instant::now();
        let error = (0..100).find_map(|_| sender.send(&[0x55; 4096]).err()).unwrap();
        assert!(matches!(error, Error::DeviceTimeout { what: "serial line", .. }));
        assert!(start.elapsed().as_secs_f64() < WRITE_TIMEOUT + 2.0);
    }

    #[test]
    fn what_is_no_line_says_so() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "x").unwrap();
        for path in [file.to_str().unwrap(), folder.path().to_str().unwrap(), "/dev/null"] {
            assert!(matches!(open(path, 9600), Err(Error::DeviceMismatch { .. })), "{path}");
        }
        assert!(matches!(open("/dev/serial/by-id/none", 9600), Err(Error::DeviceNotFound { .. })));
        assert!(matches!(open("", 9600), Err(Error::DeviceNotFound { .. })));
    }
}
