//! Calibrating a camera: does it fit?
//!
//! A chi-square test of the residuals (`probability` of the summary), a score test of what was kept
//! fixed, and what the data determine worst, in words for a person.

use std::ffi::c_char;

use super::calibrate::ptzcal_calibration;
use super::call::guard_or;
use super::error::c_string;

/// What a person should know of the calibration, one line of English UTF-8: residuals beyond the stated
/// noise, a lens or skew that was kept fixed and should not be. The wording may change in any version;
/// decide by the number of warnings and by the summary's `probability`.
///
/// @param calibration The calibration; may be NULL.
/// @param index       From 0 to the summary's `warnings` less 1.
/// @return A string that lives as long as the calibration; "" when there is no such warning; never
///         NULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_warning(
    calibration: *const ptzcal_calibration,
    index: usize,
) -> *const c_char {
    // SAFETY: NULL or a live calibration, as the header demands.
    let calibration = unsafe { calibration.as_ref() };
    calibration.and_then(|c| c.warnings.get(index)).map_or(c"".as_ptr(), |text| text.as_ptr())
}

/// What the data determine worst, and what to add, one line of English UTF-8, such as "weakest: camera
/// focal length against camera position: add shots much nearer or farther".
///
/// @param calibration The calibration; may be NULL.
/// @return A string that lives as long as the calibration; "" for NULL; never NULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_weakest(calibration: *const ptzcal_calibration) -> *const c_char {
    guard_or(c"".as_ptr(), || {
        // SAFETY: NULL or a live calibration, as the header demands.
        let Some(calibration) = (unsafe { calibration.as_ref() }) else { return c"".as_ptr() };
        let text = || c_string(calibration.answer.weakest().as_ref().map_or("", |w| &w.text));
        calibration.weakest.get_or_init(text).as_ptr()
    })
}
