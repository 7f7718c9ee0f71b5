//! Waiting for descriptors, for a bounded time whatever signals arrive.
#![allow(unsafe_code)]

use std::io;
use std::os::fd::{AsRawFd, BorrowedFd};
use std::time::{Duration, Instant};

/// What to wait for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ready {
    Read,
    Write,
}

/// Waits until one of the descriptors is ready or has hung up, at most `timeout` seconds. Gives
/// which: a call on it then does not block, and tells what is wrong with it.
pub fn wait<const N: usize>(fds: [BorrowedFd<'_>; N], ready: Ready, timeout: f64) -> io::Result<[bool; N]> {
    // NaN and negative numbers are none; an hour is for ever.
    let end = Instant::now() + Duration::from_secs_f64(timeout.clamp(0.0, 3600.0).max(0.0));
    let events = match ready {
        Ready::Read => libc::POLLIN,
        Ready::Write => libc::POLLOUT,
    };
    let mut polled = fds.map(|fd| libc::pollfd { fd: fd.as_raw_fd(), events, revents: 0 });
    loop {
        let left = end.saturating_duration_since(Instant::now());
        // Rounded up: a wait that ends early would spin.
        let milliseconds = left.as_micros().div_ceil(1000) as libc::c_int;
        // SAFETY: `polled` is an array of N pollfd.
        match unsafe { libc::poll(polled.as_mut_ptr(), N as libc::nfds_t, milliseconds) } {
            -1 => {
                let error = io::Error::last_os_error();
                if error.kind() != io::ErrorKind::Interrupted {
                    return Err(error);
                }
                if left.is_zero() {
                    return Ok([false; N]);
                }
            }
            _ => return Ok(polled.map(|p| p.revents != 0)),
        }
    }
}
