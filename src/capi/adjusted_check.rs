//! Joint adjustment: does it fit?
//!
//! A chi-square test of all residuals (`probability` of the summary), a score test of every group of
//! parameters that was kept fixed, and what the data determine worst, also in words for a person.

use std::ffi::c_char;

use super::adjusted::ptzcal_adjusted;
use super::call::{ErrorOut, guard};
use super::error::ptzcal_error;
use super::handle::borrow;
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::error::Error;

/// A group of parameters that was fixed, and should perhaps not have been (a score test, Rao 1948).
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_suspect {
    /// Set by ptzcal_suspect_init.
    pub struct_size: u32,
    /// Parameters of the group: the gain's degrees of freedom.
    pub parameters: u32,
    /// By how much chi2 would fall, to first order, were the group free.
    pub gain: f64,
    /// Chance of such a gain or a larger one when the group is rightly fixed.
    pub probability: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_suspect {
    const NAME: &'static str = "suspect";
    const FIRST_SIZE: usize = 8 + 2 * 8;
    fn initial() -> Self {
        Self { struct_size: size_of::<Self>() as u32, parameters: 0, gain: 0.0, probability: 0.0 }
    }
}

/// What a person should know of the answer, one line of English UTF-8: a misfit, what it comes
/// from, a prior that contradicts the data. The wording may change in any version; decide by their
/// number, by `probability` and by the suspects.
///
/// @param adjusted The answer; may be NULL.
/// @param index    From 0 to the summary's `warnings` less 1.
/// @return A string that lives as long as the answer; "" when there is no such warning; never NULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjusted_warning(adjusted: *const ptzcal_adjusted, index: usize) -> *const c_char {
    // SAFETY: NULL or a live answer, as the header demands.
    unsafe { ptzcal_adjusted::text(adjusted, |a| a.warnings.get(index)) }
}

/// What the data and priors determine worst, and what to add, one line of English UTF-8.
///
/// @param adjusted The answer; may be NULL.
/// @return A string that lives as long as the answer; "" for NULL; never NULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjusted_weakest(adjusted: *const ptzcal_adjusted) -> *const c_char {
    // SAFETY: NULL or a live answer, as the header demands.
    unsafe { ptzcal_adjusted::text(adjusted, |a| Some(&a.weakest)) }
}

/// Name of a parameter of which the data say next to nothing: 0.95 or more of its prior standard
/// deviation is left.
///
/// @param adjusted The answer; may be NULL.
/// @param index    From 0 to the summary's `prior_only` less 1.
/// @return A string that lives as long as the answer; "" when there is no such parameter; never NULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjusted_prior_only(adjusted: *const ptzcal_adjusted, index: usize) -> *const c_char {
    // SAFETY: NULL or a live answer, as the header demands.
    unsafe { ptzcal_adjusted::text(adjusted, |a| a.prior_only.get(index)) }
}

/// Sets up a suspect: everything 0.
///
/// @param suspect The struct.
/// @param size    sizeof *suspect.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_suspect_init(suspect: *mut ptzcal_suspect, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(suspect, size) })
}

/// A group of fixed parameters that the data want to move, the most wanted first.
///
/// @param adjusted The answer.
/// @param index    From 0 to the summary's `suspects` less 1.
/// @param suspect  Receives the suspect; set up by ptzcal_suspect_init.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT when there is no such suspect.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjusted_get_suspect(
    adjusted: *const ptzcal_adjusted,
    index: usize,
    suspect: *mut ptzcal_suspect,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (adjusted, suspect) = unsafe { (borrow(adjusted)?, SizedOut::new(suspect)?) };
        let suspects = &adjusted.adjusted.check.suspects;
        let none = || Error::invalid("index", format!("{index} of {} suspects", suspects.len()));
        let found = suspects.get(index).ok_or_else(none)?;
        suspect.write(&ptzcal_suspect {
            struct_size: 0,
            parameters: u32::try_from(found.parameters).unwrap_or(u32::MAX),
            gain: found.gain,
            probability: found.probability,
        });
        Ok(())
    })
}

/// Name of a suspect, such as "the axis offsets".
///
/// @param adjusted The answer; may be NULL.
/// @param index    From 0 to the summary's `suspects` less 1.
/// @return A string that lives as long as the answer; "" when there is no such suspect; never NULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_adjusted_suspect_name(adjusted: *const ptzcal_adjusted, index: usize) -> *const c_char {
    // SAFETY: NULL or a live answer, as the header demands.
    unsafe { ptzcal_adjusted::text(adjusted, |a| a.suspects.get(index)) }
}
