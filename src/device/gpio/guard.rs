//! The guard process: it alone holds the laser's line, and lets it be high only while its host lives,
//! runs and keeps within the limits.
//!
//! The host starts the guard's executable with one end of a socket as its standard input. The guard
//! leaves the host's session and process group, so that nothing sent to those reaches it, and splits
//! in three: the process that the host started ends at once (the host keeps no child to wait for);
//! the HOLDER holds the line and obeys the socket; the KEEPER waits for the holder's end, and when
//! that was not an orderly one (killed, crashed, stopped) takes the line over and drives it inactive.
//!
//! The host's death is noticed by the socket's end and, should a forked copy of the host hold that
//! open, by a pidfd. (`PR_SET_PDEATHSIG` would follow the thread that opened the laser, not the
//! process.) A host that was stopped is noticed in /proc; one that hangs runs into the longest time on.
#![allow(unsafe_code)]

use std::ffi::OsString;
use std::io::{self, Read};
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd, RawFd};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::process::exit;
use std::time::{Duration, Instant};

use super::line::LineId;
use super::message::{self, Message};
use super::watch::{Outcome, Watch};
use crate::device::laser_limits::LaserLimits;

const USAGE: &str = "ptzcal-laser-guard holds the line of a laser for libptzcal, which starts it.";
/// How long the keeper tries to get the line of a holder that is gone.
const TAKE_OVER: Duration = Duration::from_secs(2);

/// What the guard is started with, in this order: [`message::VERSION`], chip, offset, `high` or `low`,
/// `max_on`, `duty`, `window`.
pub struct Arguments {
    pub line: LineId,
    pub limits: LaserLimits,
}

impl Arguments {
    pub fn to_strings(&self) -> Vec<OsString> {
        let LaserLimits { max_on, duty, window } = self.limits;
        let mut strings = vec![OsString::from(message::VERSION), self.line.chip.clone().into_os_string()];
        strings.push(self.line.offset.to_string().into());
        strings.push(if self.line.active_low { "low" } else { "high" }.into());
        strings.extend([max_on, duty, window].map(|v| OsString::from(v.to_string())));
        strings
    }

    fn parse(strings: impl Iterator<Item = OsString>) -> Option<Self> {
        let strings: Vec<OsString> = strings.collect();
        let [version, chip, offset, active, max_on, duty, window] = strings.as_slice() else { return None };
        let number = |s: &OsString| s.to_str()?.parse::<f64>().ok();
        let active_low = match active.to_str()? {
            "high" => false,
            "low" => true,
            _ => return None,
        };
        let line = LineId { chip: PathBuf::from(chip), offset: offset.to_str()?.parse().ok()?, active_low };
        let limits = LaserLimits { max_on: number(max_on)?, duty: number(duty)?, window: number(window)? };
        (version == message::VERSION && limits.validate().is_ok()).then_some(Self { line, limits })
    }
}

/// The guard's `main`: `arguments` without the program's name. Returns only for wrong use.
pub fn laser_guard_main(arguments: impl Iterator<Item = OsString>) -> std::process::ExitCode {
    let Some(arguments) = Arguments::parse(arguments).filter(|_| is_socket(0)) else {
        eprintln!("{USAGE}");
        return std::process::ExitCode::from(2);
    };
    // SAFETY: plain system calls; this process has one thread, so its copies may go on as they like.
    unsafe {
        // Before all else: from here on no signal but SIGKILL and SIGSTOP does anything by itself.
        let mut all: libc::sigset_t = std::mem::zeroed();
        libc::sigfillset(&mut all);
        libc::sigprocmask(libc::SIG_BLOCK, &all, std::ptr::null_mut());
        libc::setsid();
        close_inherited();
        let host = libc::getppid();
        let host_end = libc::syscall(libc::SYS_pidfd_open, host, 0) as RawFd;
        if libc::getppid() != host {
            exit(1);
        }
        // Out of memory: take another process. Allowed to root only.
        let _ = std::fs::write("/proc/self/oom_score_adj", "-1000");
        match libc::fork() {
            0 => {}
            -1 => exit(1),
            _ => exit(0),
        }
        match libc::fork() {
            0 => {
                named(c"ptzcal-guard");
                exit(hold(&arguments, host, host_end));
            }
            -1 => exit(1),
            holder => {
                named(c"ptzcal-keeper");
                keep(holder, &arguments.line);
                exit(0);
            }
        }
    }
}

/// Obeys the host until it closes the socket or dies; the exit status is 0 when the line is inactive.
fn hold(arguments: &Arguments, host: libc::pid_t, host_end: RawFd) -> i32 {
    // SAFETY: descriptor 0 is the socket, and nothing else uses it in this process.
    let mut socket = UnixStream::from(unsafe { OwnedFd::from_raw_fd(0) });
    if socket.set_nonblocking(true).is_err() {
        return 0;
    }
    let line = match arguments.line.request() {
        Ok(line) => line,
        Err(error) => {
            let errno = error.raw_os_error().unwrap_or(libc::EIO);
            let _ = Message::Outcome(Outcome::Fault(errno)).send(&mut socket);
            return 0;
        }
    };
    // Whatever happens from here, panics included: the watch's drop drives the line inactive.
    let mut watch = Watch::new(line, arguments.limits);
    let signals = signal_descriptor();
    let mut remark = String::new();
    if host_end < 0 || host_is_stopped(host).is_none() {
        remark.push_str("this system does not show whether the host is alive (pidfd) and runs (/proc): a forked copy of it, or a stop, leaves the laser on up to its longest time on");
    }
    if Message::Ready(remark).send(&mut socket).is_err() {
        return 0;
    }
    let start = Instant::now();
    loop {
        let now = start.elapsed().as_secs_f64();
        let wait = watch.next_look(now).map_or(-1, |seconds| (seconds * 1e3).ceil() as i32);
        let [told, ended, signalled] = wait_for([socket.as_raw_fd(), host_end, signals], wait);
        let now = start.elapsed().as_secs_f64();
        if ended {
            break;
        }
        let mut said = Vec::new();
        if signalled && let Some(signal) = take_signal(signals) {
            said.extend(watch.forbid(now, &format!("its guard was sent signal {signal}")));
        }
        if told {
            let mut command = [0];
            match socket.read(&mut command) {
                Ok(0) => break,
                Ok(_) => said.push(match command[0] {
                    message::ON => watch.on(now),
                    message::OFF => watch.off(now),
                    _ => {
                        watch.forbid(now, "the guard did not understand");
                        Outcome::Refused("the guard did not understand".into())
                    }
                }),
                Err(e) if matches!(e.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => {}
                Err(_) => break,
            }
        }
        said.extend(watch.look(now, || host_is_stopped(host) == Some(true)));
        for outcome in said {
            // A host that does not read hears of it when the socket ends.
            let _ = Message::Outcome(outcome).send(&mut socket);
        }
    }
    let off = watch.off(start.elapsed().as_secs_f64());
    i32::from(off != Outcome::Off)
}

/// Waits for the holder's end. The socket stays open meanwhile: when the host sees it end, the line
/// is inactive, or both processes were killed.
fn keep(holder: libc::pid_t, line: &LineId) {
    let mut status = 0;
    loop {
        // SAFETY: waits for a child of this process; `status` lives as long as the call.
        let waited = unsafe { libc::waitpid(holder, &mut status, libc::WUNTRACED) };
        if waited == holder || io::Error::last_os_error().raw_os_error() != Some(libc::EINTR) {
            break;
        }
    }
    if libc::WIFEXITED(status) && libc::WEXITSTATUS(status) == 0 {
        return;
    }
    if libc::WIFSTOPPED(status) {
        // It would hold the line for ever.
        // SAFETY: the child was not waited for to its end, so this is still its id.
        unsafe { libc::kill(holder, libc::SIGKILL) };
    }
    let start = Instant::now();
    while start.elapsed() < TAKE_OVER && line.request().is_err() {
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Which of the descriptors (negative: none) have something, after at most `timeout` milliseconds.
fn wait_for<const N: usize>(descriptors: [RawFd; N], timeout: i32) -> [bool; N] {
    let mut polled = descriptors.map(|fd| libc::pollfd { fd, events: libc::POLLIN, revents: 0 });
    // SAFETY: `polled` has N entries and lives as long as the call.
    if unsafe { libc::poll(polled.as_mut_ptr(), N as libc::nfds_t, timeout) } <= 0 {
        return [false; N];
    }
    polled.map(|p| p.revents != 0)
}

fn signal_descriptor() -> RawFd {
    // SAFETY: plain system calls on a set that lives as long as they.
    unsafe {
        let mut all: libc::sigset_t = std::mem::zeroed();
        libc::sigfillset(&mut all);
        libc::signalfd(-1, &all, libc::SFD_NONBLOCK | libc::SFD_CLOEXEC)
    }
}

/// The next signal, unless it is one that asks for nothing.
fn take_signal(signals: RawFd) -> Option<u32> {
    // SAFETY: `info` is as long as the read, and any bytes make one.
    let info = unsafe {
        let mut info: libc::signalfd_siginfo = std::mem::zeroed();
        let size = std::mem::size_of_val(&info);
        (libc::read(signals, (&raw mut info).cast(), size) == size as isize).then_some(info)
    }?;
    let signal = info.ssi_signo as i32;
    let harmless = [libc::SIGCHLD, libc::SIGCONT, libc::SIGURG, libc::SIGWINCH];
    (!harmless.contains(&signal)).then_some(info.ssi_signo)
}

/// Was the process stopped, by a signal or a debugger? `None` when that is not to be seen.
fn host_is_stopped(host: libc::pid_t) -> Option<bool> {
    let stat = std::fs::read(format!("/proc/{host}/stat")).ok()?;
    // "pid (name) state ...", where a name may hold anything.
    let state = *stat.get(stat.iter().rposition(|&b| b == b')')? + 2)?;
    Some(matches!(state, b'T' | b't'))
}

fn is_socket(fd: RawFd) -> bool {
    // SAFETY: `stat` is filled by the call before it is read.
    unsafe {
        let mut stat: libc::stat = std::mem::zeroed();
        libc::fstat(fd, &mut stat) == 0 && stat.st_mode & libc::S_IFMT == libc::S_IFSOCK
    }
}

/// Closes what the host had open: a camera must not stay busy because of the guard.
fn close_inherited() {
    // SAFETY: nothing in this process uses descriptors above 2 yet.
    unsafe {
        if libc::syscall(libc::SYS_close_range, 3, libc::c_uint::MAX, 0) != 0 {
            // Kernels before 5.9.
            let most = libc::sysconf(libc::_SC_OPEN_MAX).clamp(256, 65_536) as RawFd;
            for fd in 3..most {
                libc::close(fd);
            }
        }
    }
}

/// The name that `ps` shows; memory that is there stays there.
fn named(name: &std::ffi::CStr) {
    // SAFETY: `name` ends with a zero byte.
    unsafe {
        libc::prctl(libc::PR_SET_NAME, name.as_ptr());
        libc::mlockall(libc::MCL_CURRENT);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_survive_the_command_line() {
        let arguments = Arguments {
            line: LineId { chip: "/dev/gpio chip".into(), offset: 17, active_low: true },
            limits: LaserLimits { max_on: 0.1, duty: 1.0 / 3.0, window: 10.0 },
        };
        let strings = arguments.to_strings();
        let back = Arguments::parse(strings.clone().into_iter()).unwrap();
        assert_eq!((back.line, back.limits), (arguments.line, arguments.limits));
        assert!(Arguments::parse(strings[1..].iter().cloned()).is_none());
        for (i, bad) in [(0, "2"), (2, "-1"), (3, "maybe"), (4, "NaN"), (4, "0"), (5, "2"), (6, "x")] {
            let mut strings = strings.clone();
            strings[i] = bad.into();
            assert!(Arguments::parse(strings.into_iter()).is_none(), "{bad} at {i}");
        }
    }

    #[test]
    fn a_stopped_process_is_told_from_one_that_runs() {
        let mut child = std::process::Command::new("sleep").arg("10").spawn().unwrap();
        let pid = child.id() as libc::pid_t;
        assert_eq!(host_is_stopped(pid), Some(false));
        // SAFETY: signals to a child of ours that was not waited for.
        unsafe { libc::kill(pid, libc::SIGSTOP) };
        let give_up = Instant::now() + Duration::from_secs(5);
        while host_is_stopped(pid) != Some(true) {
            assert!(Instant::now() < give_up);
            std::thread::yield_now();
        }
        child.kill().unwrap();
        child.wait().unwrap();
        assert_eq!(host_is_stopped(pid), None);
    }
}
