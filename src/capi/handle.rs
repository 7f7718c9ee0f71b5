//! Opaque handles: the Rust type that C knows by name only, boxed, and its lock.
//!
//! The struct behind `ptzcal_thing *` is the Rust type itself, not a marker that is cast to it: it
//! is not `repr(C)`, so the header shows its name only, and no cast can pick the wrong type.

use std::sync::{Mutex, MutexGuard, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard, TryLockError};

use crate::error::{Error, Result};

/// What C holds by pointer. `Send + Sync` is the header's promise that a handle may move between
/// threads and be read from several.
pub(super) trait Handle: Send + Sync + Sized + 'static {
    /// For messages.
    const NAME: &'static str;
}

/// Borrows a handle.
///
/// # Safety
/// `handle` is NULL or came from [`HandleOut::give`], and is not freed before `'a` ends.
pub(super) unsafe fn borrow<'a, H: Handle>(handle: *const H) -> Result<&'a H> {
    // SAFETY: by this function's contract.
    unsafe { handle.as_ref() }.ok_or(Error::NullPointer { name: H::NAME })
}

/// Borrows a handle that may be NULL.
///
/// # Safety
/// As for [`borrow`].
pub(super) unsafe fn borrow_optional<'a, H: Handle>(handle: *const H) -> Option<&'a H> {
    // SAFETY: by this function's contract.
    unsafe { handle.as_ref() }
}

/// Frees a handle; NULL is fine.
///
/// # Safety
/// `handle` is NULL or came from [`HandleOut::give`], and nobody uses it any more.
pub(super) unsafe fn free<H: Handle>(handle: *mut H) {
    if !handle.is_null() {
        // SAFETY: it came out of a Box, by this function's contract.
        drop(unsafe { Box::from_raw(handle) });
    }
}

/// Takes a handle back to consume it; `None` for NULL.
///
/// # Safety
/// As for [`free`].
pub(super) unsafe fn take<H: Handle>(handle: *mut H) -> Option<H> {
    // SAFETY: it came out of a Box, by this function's contract.
    (!handle.is_null()).then(|| *unsafe { Box::from_raw(handle) })
}

/// Where a new handle goes. NULL until then.
pub(super) struct HandleOut<H>(*mut *mut H);

impl<H: Handle> HandleOut<H> {
    /// # Safety
    /// `out` is NULL or writable until the call ends.
    pub unsafe fn new(out: *mut *mut H) -> Result<Self> {
        if out.is_null() {
            return Err(Error::NullPointer { name: H::NAME });
        }
        // SAFETY: not NULL, and writable by this function's contract.
        unsafe { out.write(std::ptr::null_mut()) };
        Ok(Self(out))
    }

    pub fn give(self, handle: H) {
        // SAFETY: writable by the contract of `new`.
        unsafe { self.0.write(Box::into_raw(Box::new(handle))) };
    }
}

/// State that `const T *` functions read together and a `T *` function has for itself. Nobody waits:
/// who comes second gets Busy. A panic in a `T *` function leaves it locked for good: BadState.
pub(super) struct Exclusive<T>(RwLock<T>);

impl<T> Exclusive<T> {
    pub fn new(value: T) -> Self {
        Self(RwLock::new(value))
    }

    pub fn read(&self, what: &'static str) -> Result<RwLockReadGuard<'_, T>> {
        self.0.try_read().map_err(|e| refuse(what, e))
    }

    pub fn write(&self, what: &'static str) -> Result<RwLockWriteGuard<'_, T>> {
        self.0.try_write().map_err(|e| refuse(what, e))
    }
}

/// State that every function has for itself, such as devices: as [`Exclusive`], for what threads
/// cannot even read together.
pub(super) struct Alone<T>(Mutex<T>);

impl<T> Alone<T> {
    pub fn new(value: T) -> Self {
        Self(Mutex::new(value))
    }

    pub fn lock(&self, what: &'static str) -> Result<MutexGuard<'_, T>> {
        self.0.try_lock().map_err(|e| refuse(what, e))
    }

    /// The state, also after a panic.
    pub fn into_inner(self) -> T {
        self.0.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

fn refuse<G>(what: &'static str, error: TryLockError<G>) -> Error {
    match error {
        TryLockError::WouldBlock => Error::Busy { what },
        TryLockError::Poisoned(_) => {
            Error::BadState { reason: format!("an earlier call on this {what} panicked: it can only be freed") }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capi::call::{ErrorOut, guard};
    use crate::capi::status::ptzcal_status;
    use crate::error::Status;

    #[test]
    fn readers_share_and_a_writer_is_alone() {
        let state = Exclusive::new(1);
        let first = state.read("thing").unwrap();
        assert_eq!(*state.read("thing").unwrap(), 1);
        assert_eq!(state.write("thing").unwrap_err(), Error::Busy { what: "thing" });
        drop(first);
        let writer = state.write("thing").unwrap();
        assert_eq!(state.read("thing").unwrap_err(), Error::Busy { what: "thing" });
        drop(writer);
        assert!(state.write("thing").is_ok());
    }

    #[test]
    fn after_a_panic_a_handle_can_only_be_freed() {
        let state = Exclusive::new(1);
        let status = guard(ErrorOut::none(), || {
            let _held = state.write("thing")?;
            panic!("half-changed");
        });
        assert_eq!(status, ptzcal_status::Panic);
        assert_eq!(state.read("thing").unwrap_err().status(), Status::BadState);
        assert_eq!(state.write("thing").unwrap_err().status(), Status::BadState);
    }
}
