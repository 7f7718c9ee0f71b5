//! Errors
//!
//! A status says what kind of failure it was; an error object says what exactly went wrong, which
//! point, view or sample is at fault, and what to do about it. Functions take `ptzcal_error **error`
//! as their last argument. Pass NULL when the status is enough. Otherwise `*error` is set to NULL on
//! entry (it is not freed: an older error is yours to free first) and, when the call fails, to a new
//! error object, which you free with ptzcal_error_free.

use std::ffi::{CString, c_char};

use super::call::guard_or;
use super::handle::{Handle, free};
use super::status::ptzcal_status;
use crate::error::Error;

/// Why a call failed. Immutable: any number of threads may read it.
pub struct ptzcal_error {
    status: ptzcal_status,
    message: CString,
    hint: CString,
    index: Option<usize>,
}

impl Handle for ptzcal_error {
    const NAME: &'static str = "error";
}

impl From<&Error> for ptzcal_error {
    fn from(error: &Error) -> Self {
        Self {
            status: error.status().into(),
            message: c_string(&error.to_string()),
            hint: c_string(error.hint().unwrap_or_default()),
            index: error.index(),
        }
    }
}

/// Text for C: a NUL inside would cut it short, so it becomes a space.
pub(super) fn c_string(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).unwrap_or_default()
}

/// Status of an error: the one that the failed call returned.
///
/// @param error The error; may be NULL.
/// @return Its status; PTZCAL_STATUS_OK for NULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_error_status(error: *const ptzcal_error) -> ptzcal_status {
    // SAFETY: NULL or a live error, as the header demands.
    unsafe { error.as_ref() }.map_or(ptzcal_status::Ok, |e| e.status)
}

/// What went wrong, one line of English UTF-8, with the offending value in it. For logs and people:
/// the wording may change in any version, so decide by the status.
///
/// @param error The error; may be NULL.
/// @return A string that lives as long as the error; "" for NULL; never NULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_error_message(error: *const ptzcal_error) -> *const c_char {
    // SAFETY: NULL or a live error, as the header demands.
    unsafe { error.as_ref() }.map_or(c"".as_ptr(), |e| e.message.as_ptr())
}

/// What the user can do about it, one line of English UTF-8.
///
/// @param error The error; may be NULL.
/// @return A string that lives as long as the error; "" when there is nothing to say, and for NULL;
///         never NULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_error_hint(error: *const ptzcal_error) -> *const c_char {
    // SAFETY: NULL or a live error, as the header demands.
    unsafe { error.as_ref() }.map_or(c"".as_ptr(), |e| e.hint.as_ptr())
}

/// Which point, view or sample is at fault, counted from 0.
///
/// @param error The error; may be NULL.
/// @return The index, or -1 when no single one is at fault, and for NULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_error_index(error: *const ptzcal_error) -> i64 {
    // SAFETY: NULL or a live error, as the header demands.
    let index = unsafe { error.as_ref() }.and_then(|e| e.index);
    index.and_then(|i| i64::try_from(i).ok()).unwrap_or(-1)
}

/// Frees an error. Strings taken from it die with it.
///
/// @param error The error; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_error_free(error: *mut ptzcal_error) {
    // SAFETY: NULL or a live error that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(error) });
}
