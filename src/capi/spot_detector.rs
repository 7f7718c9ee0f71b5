//! A spot detector for frame after frame
//!
//! ptzcal_detect_spot with memory of its own: once it has seen frames like those to come, it allocates no
//! more for a spot that it finds among up to 8 frames. For hosts that look at every frame of a stream.

use super::call::{ErrorOut, guard, guard_or};
use super::detect::{ptzcal_spot, ptzcal_spot_options};
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, free};
use super::image::{ptzcal_image, with_views};
use super::sized::SizedOut;
use super::status::ptzcal_status;
use crate::detect::spot::{SpotDetector, SpotOptions};
use crate::error::Error;

/// A spot detector. One thread at a time may use it; have one for each camera.
pub struct ptzcal_spot_detector(Exclusive<(SpotDetector, SpotOptions)>);

impl Handle for ptzcal_spot_detector {
    const NAME: &'static str = "detector";
}

/// Makes a detector.
///
/// @param options  The options, which are copied; may be NULL: the defaults.
/// @param detector Receives the detector; free it with ptzcal_spot_detector_free.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_spot_detector_new(
    options: *const ptzcal_spot_options,
    detector: *mut *mut ptzcal_spot_detector,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (detector, options) = unsafe { (HandleOut::new(detector)?, ptzcal_spot_options::settings(options)?) };
        detector.give(ptzcal_spot_detector(Exclusive::new((SpotDetector::default(), options))));
        Ok(())
    })
}

/// Frees a detector.
///
/// @param detector The detector; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_spot_detector_free(detector: *mut ptzcal_spot_detector) {
    // SAFETY: NULL or a live detector that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(detector) });
}

/// Finds the laser's spot, as ptzcal_detect_spot_averaged does: what the detector saw before does not
/// change the answer.
///
/// @param detector The detector.
/// @param on       n_on frames with the laser on, all of one size and format.
/// @param n_on     Number of frames, at least 1.
/// @param off      n_off frames of the same view with the laser off; may be NULL when n_off is 0.
/// @param n_off    Number of frames; 0: a much weaker search, without a background.
/// @param spot     Receives the spot; set up by ptzcal_spot_init.
/// @param error    Receives the error; may be NULL.
/// @return As ptzcal_detect_spot; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_spot_detector_detect(
    detector: *mut ptzcal_spot_detector,
    on: *const *const ptzcal_image,
    n_on: usize,
    off: *const *const ptzcal_image,
    n_off: usize,
    spot: *mut ptzcal_spot,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        if n_on == 0 {
            return Err(Error::invalid("n_on", "no frame with the laser on"));
        }
        // SAFETY: the caller keeps the header's rules for pointers.
        let (detector, spot) = unsafe { (borrow(detector)?, SizedOut::new(spot)?) };
        let mut held = detector.0.write(ptzcal_spot_detector::NAME)?;
        let (memory, options) = &mut *held;
        // SAFETY: the caller keeps the header's rules for pointers.
        let found = unsafe {
            with_views(on, n_on, "on", |on| with_views(off, n_off, "off", |off| memory.detect(on, off, options)))?
        };
        spot.write(&(&found).into());
        Ok(())
    })
}
