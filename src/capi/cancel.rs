//! Cancelling
//!
//! Long work runs on the thread that calls it. To stop it from another thread, make a token, hand it
//! to the work's options, and request cancellation: the call ends with PTZCAL_STATUS_CANCELLED. The
//! work looks at the token several times a second, except while it waits inside a callback of
//! yours or inside a device. One token may be given to any number of calls. The options keep what
//! they need of it, so it may be freed at any time; a token that is freed can just not be requested
//! any more.

use super::call::{ErrorOut, guard, guard_or};
use super::error::ptzcal_error;
use super::handle::{Handle, HandleOut, borrow, borrow_optional, free};
use super::status::ptzcal_status;
use crate::control::Cancel;

/// Stops long work from any thread.
pub struct ptzcal_cancel(Cancel);

impl Handle for ptzcal_cancel {
    const NAME: &'static str = "token";
}

impl ptzcal_cancel {
    /// Shares the caller's token; NULL is a token that nobody requests.
    ///
    /// # Safety
    /// `token` is NULL or a live token.
    pub(super) unsafe fn share(token: *const ptzcal_cancel) -> Cancel {
        // SAFETY: by this function's contract.
        unsafe { borrow_optional(token) }.map(|t| t.0.clone()).unwrap_or_default()
    }
}

/// Makes a token that is not requested.
///
/// @param token Receives the token; free it with ptzcal_cancel_free.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cancel_new(
    token: *mut *mut ptzcal_cancel,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let token = unsafe { HandleOut::new(token)? };
        token.give(ptzcal_cancel(Cancel::new()));
        Ok(())
    })
}

/// Requests that all work which has this token stops. May be called again, from any thread, and
/// from a signal handler: it only stores a flag.
///
/// @param token The token.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
// Not guarded: an atomic store cannot panic, and guard() is not safe in a signal handler.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cancel_request(token: *const ptzcal_cancel) -> ptzcal_status {
    // SAFETY: NULL or a live token, as the header demands.
    match unsafe { borrow(token) } {
        Ok(token) => {
            token.0.cancel();
            ptzcal_status::Ok
        }
        Err(_) => ptzcal_status::NullPointer,
    }
}

/// Takes a request back, so that the token can be used for the next work. Work that is still
/// running may or may not have seen the request.
///
/// @param token The token.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cancel_reset(token: *const ptzcal_cancel) -> ptzcal_status {
    // SAFETY: NULL or a live token, as the header demands.
    match unsafe { borrow(token) } {
        Ok(token) => {
            token.0.reset();
            ptzcal_status::Ok
        }
        Err(_) => ptzcal_status::NullPointer,
    }
}

/// Has cancellation been requested?
///
/// @param token The token; may be NULL.
/// @return 1 when it was requested, else 0; 0 for NULL.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cancel_is_requested(token: *const ptzcal_cancel) -> i32 {
    // SAFETY: NULL or a live token, as the header demands.
    unsafe { borrow_optional(token) }.is_some_and(|t| t.0.is_cancelled()).into()
}

/// Frees a token. Work that was given it goes on undisturbed.
///
/// @param token The token; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cancel_free(token: *mut ptzcal_cancel) {
    // SAFETY: NULL or a live token that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(token) });
}
