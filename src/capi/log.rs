//! Logging
//!
//! The library never prints. Where a verb takes a log callback, messages go there; without one they
//! are not even made.

use std::ffi::{c_char, c_void};

use super::error::c_string;
use crate::control::{Log, LogLevel};

/// How much a message matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum ptzcal_log_level {
    /// Something failed.
    Error = 1,
    /// Something is not as it should be, but the work goes on.
    Warning = 2,
    /// What is being done.
    Info = 3,
    /// Details for whoever searches a fault.
    Debug = 4,
}

/// Receives a message: one line of English UTF-8, valid during the call. It runs on the thread that
/// called the library, never under a lock of the library, and must not throw or longjmp.
///
/// @param user    What was given with the callback.
/// @param level   A ptzcal_log_level; treat unknown ones as PTZCAL_LOG_LEVEL_DEBUG.
/// @param message The message.
pub type ptzcal_log_fn = Option<unsafe extern "C" fn(user: *mut c_void, level: i32, message: *const c_char)>;

/// The host's pointer, carried along and never followed.
#[derive(Clone, Copy)]
pub(super) struct User(*mut c_void);

// SAFETY: only handed back to the host, which was told in the header from which threads.
unsafe impl Send for User {}
// SAFETY: as above.
unsafe impl Sync for User {}

impl User {
    pub fn new(user: *mut c_void) -> Self {
        Self(user)
    }

    pub fn get(self) -> *mut c_void {
        self.0
    }
}

/// The host's callback as a [`Log`]; silent for NULL.
///
/// # Safety
/// `callback` may be called with `user` for as long as the log or a clone of it lives.
pub unsafe fn log(callback: ptzcal_log_fn, user: *mut c_void) -> Log {
    let user = User::new(user);
    callback.map_or_else(Log::silent, |callback| {
        Log::to(move |level: LogLevel, text: &str| {
            let message = c_string(text);
            // SAFETY: by this function's contract; the message lives through the call.
            unsafe { callback(user.get(), level as i32, message.as_ptr()) }
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    unsafe extern "C" fn collect(user: *mut c_void, level: i32, message: *const c_char) {
        // SAFETY: the test hands in a Vec<String> and the library a string.
        unsafe {
            let text = std::ffi::CStr::from_ptr(message).to_str().unwrap();
            (*user.cast::<Vec<String>>()).push(format!("{level} {text}"));
        }
    }

    #[test]
    fn messages_reach_the_host() {
        let mut lines: Vec<String> = Vec::new();
        // SAFETY: `lines` outlives the log.
        let log_to_host = unsafe { log(Some(collect), (&raw mut lines).cast()) };
        log_to_host.write(LogLevel::Warning, || "drift of 3\0 px".into());
        // SAFETY: nothing is called.
        let silent = unsafe { log(None, std::ptr::null_mut()) };
        silent.write(LogLevel::Error, || unreachable!("nobody listens"));
        assert_eq!(lines, ["2 drift of 3  px"]);
        for (ours, crates) in [
            (ptzcal_log_level::Error, LogLevel::Error),
            (ptzcal_log_level::Warning, LogLevel::Warning),
            (ptzcal_log_level::Info, LogLevel::Info),
            (ptzcal_log_level::Debug, LogLevel::Debug),
        ] {
            assert_eq!(ours as i32, crates as i32);
        }
    }
}
