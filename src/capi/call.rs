//! The frame of every export: panics are caught, errors become a status and an error object.

use std::any::Any;
use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, set_hook, take_hook};
use std::sync::Once;

use super::error::ptzcal_error;
use super::status::ptzcal_status;
use crate::error::{Error, Result};

/// Where the caller wants the error object, if anywhere.
pub(super) struct ErrorOut(*mut *mut ptzcal_error);

impl ErrorOut {
    /// Sets `*error` to NULL.
    ///
    /// # Safety
    /// `error` is NULL or writable until the call ends.
    pub unsafe fn new(error: *mut *mut ptzcal_error) -> Self {
        if !error.is_null() {
            // SAFETY: not NULL, and writable by this function's contract.
            unsafe { error.write(std::ptr::null_mut()) };
        }
        Self(error)
    }

    /// For exports without an error argument.
    pub fn none() -> Self {
        Self(std::ptr::null_mut())
    }

    fn set(self, error: &Error) {
        if !self.0.is_null() {
            // SAFETY: writable by the contract of `new`.
            unsafe { self.0.write(Box::into_raw(Box::new(error.into()))) };
        }
    }
}

/// Runs the body of a fallible export.
pub(super) fn guard(error: ErrorOut, body: impl FnOnce() -> Result<()>) -> ptzcal_status {
    match catch(body).unwrap_or_else(Err) {
        Ok(()) => ptzcal_status::Ok,
        Err(e) => {
            error.set(&e);
            e.status().into()
        }
    }
}

/// Runs the body of an export that has no status; `fallback` is the answer after a panic.
pub(super) fn guard_or<T>(fallback: T, body: impl FnOnce() -> T) -> T {
    catch(body).unwrap_or(fallback)
}

thread_local! {
    static INSIDE: Cell<bool> = const { Cell::new(false) };
    static PLACE: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Catches a panic. Handles stay sound across it: what a panic leaves half-changed is behind a lock
/// that is poisoned by it (handle.rs).
fn catch<T>(body: impl FnOnce() -> T) -> Result<T> {
    keep_panics_quiet();
    // A callback of the host may call the library again: the outer call stays inside.
    let outer = INSIDE.replace(true);
    let result = catch_unwind(AssertUnwindSafe(body));
    INSIDE.set(outer);
    result.map_err(|payload| Error::Panic { reason: format!("{} {}", text(&*payload), PLACE.take()) })
}

fn text(payload: &(dyn Any + Send)) -> &str {
    let text = payload.downcast_ref::<&str>().copied();
    text.or_else(|| payload.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message")
}

/// The default hook prints to stderr, which a library must not. Panics inside a call are noted for
/// the error's message instead; all others go to the hook that was there before.
fn keep_panics_quiet() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = take_hook();
        set_hook(Box::new(move |info: &PanicHookInfo<'_>| {
            if INSIDE.get() {
                let place = info.location().map(|l| format!("({}:{})", l.file(), l.line()));
                PLACE.set(place.unwrap_or_default());
            } else {
                before(info);
            }
        }));
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capi::error::{ptzcal_error_free, ptzcal_error_message, ptzcal_error_status};

    #[test]
    fn a_panic_becomes_a_status_with_its_place() {
        let mut error = std::ptr::null_mut();
        // SAFETY: a local variable.
        let status = guard(unsafe { ErrorOut::new(&mut error) }, || panic!("the {}th sample", 7));
        assert_eq!(status, ptzcal_status::Panic);
        // SAFETY: the error was just made, and is freed once.
        unsafe {
            assert_eq!(ptzcal_error_status(error), ptzcal_status::Panic);
            let message = std::ffi::CStr::from_ptr(ptzcal_error_message(error)).to_str().unwrap();
            assert!(message.contains("the 7th sample") && message.contains("call.rs:"), "{message}");
            ptzcal_error_free(error);
        }
        assert_eq!(guard_or(5, || panic!("again")), 5);
        assert!(!INSIDE.get());
    }
}
