//! Matching SIFT features
//!
//! Pairs of features of two images whose descriptors are each other's nearest, and much nearer than the
//! next (Lowe's ratio test). The search is exact.

use super::args::{ArrayOut, Out, flag, number};
use super::call::{ErrorOut, guard};
use super::error::ptzcal_error;
use super::handle::borrow;
use super::sift::ptzcal_sift_features;
use super::sized::{self, SizedStruct};
use super::status::ptzcal_status;
use crate::detect::sift::{SiftMatchOptions, match_sift};
use crate::error::{Error, Result};

/// Which pairs of features are matches.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_sift_match_options {
    /// Set by ptzcal_sift_match_options_init.
    pub struct_size: u32,
    /// 1: each must be the nearest of the other, 0: that of the second image the nearest of the first's.
    pub mutual: u32,
    /// Greatest ratio of the distances to the nearest and to the second nearest, above 0 to 1; 1: any.
    pub max_ratio: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_sift_match_options {
    const NAME: &'static str = "options";
    const FIRST_SIZE: usize = 8 + 8;
    fn initial() -> Self {
        let defaults = SiftMatchOptions::default();
        Self { struct_size: size_of::<Self>() as u32, mutual: defaults.mutual.into(), max_ratio: defaults.max_ratio }
    }
}

impl ptzcal_sift_match_options {
    /// The caller's options, or the defaults for NULL.
    ///
    /// # Safety
    /// `options` is NULL or a struct as long as its `struct_size` says.
    unsafe fn settings(options: *const Self) -> Result<SiftMatchOptions> {
        if options.is_null() {
            return Ok(SiftMatchOptions::default());
        }
        // SAFETY: by this function's contract.
        let options = unsafe { sized::read(options)? };
        let max_ratio = number(options.max_ratio, "max_ratio")?;
        Ok(SiftMatchOptions { max_ratio, mutual: flag(options.mutual, "mutual")? })
    }
}

/// Sets up options with their defaults: a ratio of 0.8, each other's nearest.
///
/// @param options The struct.
/// @param size    sizeof *options.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_sift_match_options_init(
    options: *mut ptzcal_sift_match_options,
    size: usize,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(options, size) })
}

/// Matches the features of two images. A feature of `a` has at most one match; without the mutual check
/// one of `b` can have several.
///
/// @param a         Features of the first image.
/// @param b         Features of the second image.
/// @param options   The options; may be NULL: the defaults.
/// @param pairs     Receives 2 numbers a match, by ascending feature of `a`: the features' indices in `a`
///                  and `b`.
/// @param distances Receives 2 numbers a match: the distance (of descriptors of length 512), and its ratio
///                  to the distance of the second nearest (1 where there is none); may be NULL.
/// @param capacity  Number of matches that the arrays hold; the number of features of `a` is always enough.
/// @param count     Receives the number of matches, also when the capacity is too small.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: no match was written;
///         PTZCAL_STATUS_INVALID_ARGUMENT for options out of range and for more than 2^36 pairs of
///         features; PTZCAL_STATUS_NOT_FINITE.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_match_sift(
    a: *const ptzcal_sift_features,
    b: *const ptzcal_sift_features,
    options: *const ptzcal_sift_match_options,
    pairs: *mut u32,
    distances: *mut f64,
    capacity: usize,
    count: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (a, b, options, pairs, distances, count) = unsafe {
            (
                borrow(a)?,
                borrow(b)?,
                ptzcal_sift_match_options::settings(options)?,
                ArrayOut::<[u32; 2]>::new(pairs.cast(), capacity, "pairs")?,
                ArrayOut::vectors_optional::<2>(distances, capacity, "distances")?,
                Out::new(count, "count")?,
            )
        };
        let matches = match_sift(&a.0, &b.0, &options)?;
        count.write(matches.len());
        if matches.len() > capacity {
            return Err(Error::BufferTooSmall { needed: matches.len(), capacity });
        }
        pairs.write(&matches.iter().map(|m| [m.a as u32, m.b as u32]).collect::<Vec<_>>());
        if let Some(distances) = distances {
            distances.write(&matches.iter().map(|m| [m.distance, m.ratio]).collect::<Vec<_>>());
        }
        Ok(())
    })
}
