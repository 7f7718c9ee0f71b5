//! Versions
//!
//! PTZCAL_ABI_VERSION is what this header was written for; ptzcal_abi_version() is what the loaded
//! library keeps. They are equal whenever the dynamic linker found the library by its soname
//! (libptzcal.so.N, N the ABI number); who loads it with dlopen compares them. New functions and new
//! members do not change the number: it changes when, and only when, a program that was compiled
//! against an older header would break.

use std::ffi::{CStr, c_char};

/// ABI number of this header; see ptzcal_abi_version.
pub const PTZCAL_ABI_VERSION: u32 = 1;

const VERSION: &CStr = match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
    Ok(version) => version,
    Err(_) => panic!("a version has no NUL inside"),
};

/// Version of the library, such as "0.1.0" (semantic versioning).
///
/// @return A static string; never NULL, never freed.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub extern "C" fn ptzcal_version() -> *const c_char {
    VERSION.as_ptr()
}

/// ABI number of the loaded library; compare it with PTZCAL_ABI_VERSION after dlopen.
///
/// @return The number.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub extern "C" fn ptzcal_abi_version() -> u32 {
    PTZCAL_ABI_VERSION
}
