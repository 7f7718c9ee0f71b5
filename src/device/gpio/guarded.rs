//! The library's side of the guard process: finding, starting and commanding it.
#![allow(unsafe_code)]

use std::ffi::CStr;
use std::io::{self, ErrorKind};
use std::os::fd::{AsRawFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use super::guard::Arguments;
use super::message::{self, Message};
use super::watch::Outcome;
use crate::control::{Log, LogLevel};
use crate::error::{Error, Result};

const NAME: &str = "ptzcal-laser-guard";
/// Names the guard's executable, before any other place.
const VARIABLE: &str = "PTZCAL_LASER_GUARD";
/// How long a guard may take to start, and to answer.
const START: Duration = Duration::from_secs(5);
const ANSWER: Duration = Duration::from_millis(800);
/// Remarks that can stand before an answer.
const MAX_REMARKS: usize = 16;

/// A guard process that holds a line.
pub struct Guarded {
    socket: UnixStream,
    log: Log,
}

impl Guarded {
    /// Starts the guard and waits until it holds the line, inactive.
    pub fn start(executable: &Path, arguments: &Arguments, log: Log) -> Result<Self> {
        let refused =
            |reason: String| Error::LaserRefused { reason: format!("its guard {}: {reason}", executable.display()) };
        let (ours, theirs) = UnixStream::pair().map_err(|e| refused(e.to_string()))?;
        ours.set_read_timeout(Some(START)).map_err(|e| refused(e.to_string()))?;
        let mut child = Command::new(executable)
            .args(arguments.to_strings())
            .env_clear()
            .current_dir("/")
            .stdin(Stdio::from(OwnedFd::from(theirs)))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|e| refused(e.to_string()))?;
        let mut guarded = Self { socket: ours, log };
        let said = Message::receive(&mut guarded.socket);
        if said.is_err() {
            let _ = child.kill();
        }
        // The process that was started leaves its work to others and ends.
        let _ = child.wait();
        match said {
            Ok(Message::Ready(remark)) => {
                if !remark.is_empty() {
                    guarded.log.write(LogLevel::Warning, || format!("laser guard: {remark}"));
                }
                guarded.socket.set_read_timeout(Some(ANSWER)).map_err(|e| refused(e.to_string()))?;
                Ok(guarded)
            }
            Ok(Message::Outcome(Outcome::Fault(errno))) => {
                Err(arguments.line.refused(&io::Error::from_raw_os_error(errno)))
            }
            Ok(other) => Err(refused(format!("it began with {other:?}"))),
            Err(e) => Err(refused(format!("it did not say that it holds the line ({e}): is it of this version?"))),
        }
    }

    /// Switches and waits for the answer. An error means that the guard is of no more use.
    pub fn command(&mut self, on: bool) -> io::Result<Outcome> {
        self.send(if on { message::ON } else { message::OFF })?;
        for _ in 0..MAX_REMARKS {
            match Message::receive(&mut self.socket)? {
                Message::Outcome(Outcome::WentOff(reason)) => {
                    self.log.write(LogLevel::Warning, || format!("the laser went off: {reason}"));
                }
                Message::Outcome(outcome) => return Ok(outcome),
                Message::Ready(_) => break,
            }
        }
        Err(ErrorKind::InvalidData.into())
    }

    /// Why the laser went off by itself, when it did. An error means that the guard is gone.
    pub fn went_off(&mut self) -> io::Result<Option<String>> {
        self.socket.set_nonblocking(true)?;
        let said = Message::receive(&mut self.socket);
        self.socket.set_nonblocking(false)?;
        match said {
            Ok(Message::Outcome(Outcome::WentOff(reason))) => Ok(Some(reason)),
            Ok(_) => Err(ErrorKind::InvalidData.into()),
            Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => Ok(None),
            Err(e) => Err(e),
        }
    }

    /// Lets the guard end and waits, at most for [`ANSWER`], until it has let go of the line.
    pub fn end(mut self) {
        let _ = self.command(false);
        let _ = self.socket.shutdown(std::net::Shutdown::Write);
        while Message::receive(&mut self.socket).is_ok() {}
    }

    /// A C host's process would be ended by SIGPIPE for writing to a guard that is gone.
    fn send(&self, byte: u8) -> io::Result<()> {
        // SAFETY: one byte that lives as long as the call.
        let sent = unsafe { libc::send(self.socket.as_raw_fd(), (&raw const byte).cast(), 1, libc::MSG_NOSIGNAL) };
        if sent == 1 { Ok(()) } else { Err(io::Error::last_os_error()) }
    }
}

/// The guard's executable: what the environment names, beside the library, in the libexec folder
/// that belongs to the library's, in the libexec folder this library was built for.
pub fn find_executable() -> Result<PathBuf> {
    let named = std::env::var_os(VARIABLE).filter(|v| !v.is_empty() && !has_elevated_rights());
    let places = match named {
        // What was named, and nothing else instead of it.
        Some(path) => vec![PathBuf::from(path)],
        None => places(library_path().as_deref(), option_env!("PTZCAL_LIBEXECDIR")),
    };
    places.iter().find(|p| p.is_file()).cloned().ok_or_else(|| Error::LaserRefused {
        reason: format!(
            "its guard process is not found at {} ({VARIABLE} can name another place; guard=off in the address does \
             without, and a host that is killed then leaves the laser on)",
            places.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ")
        ),
    })
}

fn places(library: Option<&Path>, built_for: Option<&str>) -> Vec<PathBuf> {
    let mut places = Vec::new();
    if let Some(folder) = library.and_then(Path::parent) {
        places.push(folder.join(NAME));
        // lib/ and lib/x86_64-linux-gnu/ have libexec/ beside and above.
        places.extend(
            [folder.parent(), folder.parent().and_then(Path::parent)]
                .into_iter()
                .flatten()
                .map(|above| above.join("libexec/ptzcal").join(NAME)),
        );
    }
    places.extend(built_for.map(|folder| Path::new(folder).join(NAME)));
    places
}

/// Where this library's code was loaded from: the shared library, or the program that it is linked into.
fn library_path() -> Option<PathBuf> {
    // SAFETY: the address is one of this library; `info` is only read after success, and the name
    // it points at belongs to the loader and stays while this code does.
    let name = unsafe {
        let mut info: libc::Dl_info = std::mem::zeroed();
        if libc::dladdr(find_executable as *const () as *const libc::c_void, &mut info) == 0 || info.dli_fname.is_null()
        {
            return None;
        }
        PathBuf::from(std::ffi::OsStr::from_bytes(CStr::from_ptr(info.dli_fname).to_bytes()))
    };
    // A program is named as it was called.
    if name.is_absolute() { Some(name) } else { std::env::current_exe().ok() }
}

/// A set-uid program's environment is not to be trusted.
fn has_elevated_rights() -> bool {
    // SAFETY: reads a number that the kernel gave this process.
    unsafe { libc::getauxval(libc::AT_SECURE) != 0 }
}

#[cfg(test)]
mod tests {
    use super::super::line::LineId;
    use super::*;
    use crate::device::laser_limits::LaserLimits;

    #[test]
    fn the_executable_is_looked_for_in_order() {
        let shown = |library: Option<&str>, built| {
            places(library.map(Path::new), built).iter().map(|p| p.display().to_string()).collect::<Vec<_>>()
        };
        assert_eq!(
            shown(Some("/usr/lib/x86_64-linux-gnu/libptzcal.so.0"), Some("/opt/libexec")),
            [
                "/usr/lib/x86_64-linux-gnu/ptzcal-laser-guard",
                "/usr/lib/libexec/ptzcal/ptzcal-laser-guard",
                "/usr/libexec/ptzcal/ptzcal-laser-guard",
                "/opt/libexec/ptzcal-laser-guard",
            ]
        );
        assert!(shown(None, None).is_empty());
        assert!(library_path().unwrap().is_file());
    }

    fn start(executable: &str) -> Result<Guarded> {
        let line = LineId { chip: "/dev/no-such-chip".into(), offset: 5, active_low: false };
        let arguments = Arguments { line, limits: LaserLimits::default() };
        Guarded::start(Path::new(executable), &arguments, Log::silent())
    }

    #[test]
    fn what_is_no_guard_is_refused_in_bounded_time() {
        let start_time = std::time::Instant::now();
        for executable in ["/no/such/file", "/bin/true", "/bin/false", "/bin/cat", "/bin/echo", "/dev/null"] {
            assert!(matches!(start(executable), Err(Error::LaserRefused { .. })), "{executable}");
        }
        assert!(start_time.elapsed() < START);
    }

    #[test]
    fn a_guard_that_is_gone_is_an_error_and_no_signal() {
        let (ours, theirs) = UnixStream::pair().unwrap();
        let mut guarded = Guarded { socket: ours, log: Log::silent() };
        assert_eq!(guarded.went_off().unwrap(), None);
        Message::Outcome(Outcome::WentOff("x".into())).send(&mut &theirs).unwrap();
        assert_eq!(guarded.went_off().unwrap(), Some("x".into()));
        drop(theirs);
        assert_eq!(guarded.went_off().unwrap_err().kind(), ErrorKind::UnexpectedEof);
        // A test's process ignores SIGPIPE, a C host dies of it: blocked, it shows itself.
        // SAFETY: sets this thread's mask and puts it back, with sets that live as long as the calls.
        let pending = unsafe {
            let (mut pipe, mut before) = (std::mem::zeroed(), std::mem::zeroed());
            libc::sigemptyset(&mut pipe);
            libc::sigaddset(&mut pipe, libc::SIGPIPE);
            libc::pthread_sigmask(libc::SIG_BLOCK, &pipe, &mut before);
            assert!(guarded.command(true).is_err());
            let mut pending = std::mem::zeroed();
            libc::sigpending(&mut pending);
            libc::pthread_sigmask(libc::SIG_SETMASK, &before, std::ptr::null_mut());
            libc::sigismember(&pending, libc::SIGPIPE)
        };
        assert_eq!(pending, 0);
    }
}
