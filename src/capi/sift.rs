//! Detecting SIFT features
//!
//! Keypoints of an image that are found again in other images of the same thing, and descriptors to
//! know them by: D. G. Lowe, Distinctive image features from scale-invariant keypoints, 2004. What is
//! found can be copied out, kept, and made features again later.

use super::args::{BufferOut, Out, array, flag, number, vectors};
use super::call::{ErrorOut, guard, guard_or};
use super::error::ptzcal_error;
use super::handle::{Handle, HandleOut, borrow, free};
use super::image::{ptzcal_image, view};
use super::sized::{self, SizedStruct};
use super::status::ptzcal_status;
use crate::detect::sift::{Descriptor, SiftFeatures, SiftKeypoint, SiftOptions, detect_sift};
use crate::error::Result;

/// Numbers of a keypoint: x, y, scale, angle, response, octave, sigma, elongation, direction.
///
/// x and y: pixels; (0, 0) is the centre of the top-left pixel. scale: standard deviation of the
/// Gaussian at which it was found, pixels (half of OpenCV's size). angle: radians from x towards y.
/// response: |difference of Gaussians| of an image from 0 to 1. octave: -1 for the doubled image, 0 for
/// the image, 1 for half of it, and so on. sigma: standard deviation of x and of y, pixels, that is
/// typical of the scale (measured, not estimated for this keypoint). elongation: how much less sure the
/// place is along `direction` than across it, ratio of the standard deviations, 1 or more. direction:
/// radians from x towards y, -pi/2 to pi/2.
pub const PTZCAL_SIFT_KEYPOINT_SIZE: usize = 9;

/// Bytes of a descriptor: 4 x 4 cells of 8 orientations, in OpenCV's order, of length 512.
pub const PTZCAL_SIFT_DESCRIPTOR_SIZE: usize = 128;

/// Which keypoints are looked for.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_sift_options {
    /// Set by ptzcal_sift_options_init.
    pub struct_size: u32,
    /// Most features; the strongest are kept. 0: all, up to 1048576.
    pub max_features: u32,
    /// 1: the image is doubled first, 0: it is not. Four times the time, for about three times the
    /// keypoints.
    pub upsample: u32,
    /// 0.
    pub reserved: u32,
    /// Least contrast, above 0 to 1: Lowe's threshold times 3 intervals, as OpenCV counts.
    pub contrast_threshold: f64,
    /// Greatest ratio of the principal curvatures, above 1: edges have a larger one.
    pub edge_ratio: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_sift_options {
    const NAME: &'static str = "options";
    const FIRST_SIZE: usize = 16 + 2 * 8;
    fn initial() -> Self {
        let defaults = SiftOptions::default();
        Self {
            struct_size: size_of::<Self>() as u32,
            max_features: defaults.max_features,
            upsample: defaults.upsample.into(),
            reserved: 0,
            contrast_threshold: defaults.contrast_threshold,
            edge_ratio: defaults.edge_ratio,
        }
    }
}

impl ptzcal_sift_options {
    /// The caller's options, or the defaults for NULL.
    ///
    /// # Safety
    /// `options` is NULL or a struct as long as its `struct_size` says.
    unsafe fn settings(options: *const Self) -> Result<SiftOptions> {
        if options.is_null() {
            return Ok(SiftOptions::default());
        }
        // SAFETY: by this function's contract.
        let options = unsafe { sized::read(options)? };
        Ok(SiftOptions {
            max_features: options.max_features,
            contrast_threshold: number(options.contrast_threshold, "contrast_threshold")?,
            edge_ratio: number(options.edge_ratio, "edge_ratio")?,
            upsample: flag(options.upsample, "upsample")?,
        })
    }
}

/// Keypoints and descriptors of an image.
pub struct ptzcal_sift_features(pub(super) SiftFeatures);

impl Handle for ptzcal_sift_features {
    const NAME: &'static str = "features";
}

fn numbers(k: &SiftKeypoint) -> [f64; PTZCAL_SIFT_KEYPOINT_SIZE] {
    [k.x, k.y, k.scale, k.angle, k.response, k.octave.into(), k.position_sigma(), k.elongation, k.direction]
}

fn keypoint(numbers: &[f64; PTZCAL_SIFT_KEYPOINT_SIZE]) -> SiftKeypoint {
    let [x, y, scale, angle, response, octave, _, elongation, direction] = *numbers;
    SiftKeypoint { x, y, scale, angle, response, octave: octave as i32, elongation, direction }
}

/// Sets up options with their defaults: all features, doubled image, contrast 0.04, edge ratio 10.
///
/// @param options The struct.
/// @param size    sizeof *options.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_sift_options_init(options: *mut ptzcal_sift_options, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(options, size) })
}

/// Finds and describes the keypoints of an image, the strongest first. An image without contrast has
/// none.
///
/// Memory: about 20 kB for each column of the image (5 kB when it is not doubled), and 0.2 kB a feature.
///
/// @param image    The image, at least 12 pixels high and wide, at most 32768 wide, at most 268435456 in
///                 all; of colours their luma is used.
/// @param options  The options; may be NULL: the defaults.
/// @param features Receives the features; free them with ptzcal_sift_features_free.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for options out of range, a malformed image
///         and one that is too small or too large; PTZCAL_STATUS_BUFFER_TOO_SMALL when a plane's size
///         cannot hold the image; PTZCAL_STATUS_NOT_FINITE.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_detect_sift(
    image: *const ptzcal_image,
    options: *const ptzcal_sift_options,
    features: *mut *mut ptzcal_sift_features,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (features, image, options) =
            unsafe { (HandleOut::new(features)?, view(image)?, ptzcal_sift_options::settings(options)?) };
        features.give(ptzcal_sift_features(detect_sift(&image, &options)?));
        Ok(())
    })
}

/// Makes features of keypoints and descriptors that were kept elsewhere, or come from elsewhere.
///
/// @param keypoints   n x 9 numbers, as ptzcal_sift_features_copy_keypoints writes them; sigma is ignored.
///                    Of keypoints whose elongation is not known: 1.
/// @param descriptors n x 128 bytes.
/// @param n           Number of features, at most 1048576.
/// @param features    Receives the features; free them with ptzcal_sift_features_free.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT for too many, for
///         a scale that is not positive and for an elongation below 1 or above 1000.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_sift_features_new(
    keypoints: *const f64,
    descriptors: *const u8,
    n: usize,
    features: *mut *mut ptzcal_sift_features,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (features, keypoints, descriptors) = unsafe {
            (
                HandleOut::new(features)?,
                vectors::<PTZCAL_SIFT_KEYPOINT_SIZE>(keypoints, n, "keypoints")?,
                array::<Descriptor>(descriptors.cast(), n, "descriptors")?,
            )
        };
        let made = SiftFeatures::new(keypoints.iter().map(keypoint).collect(), descriptors.to_vec())?;
        features.give(ptzcal_sift_features(made));
        Ok(())
    })
}

/// Frees features.
///
/// @param features The features; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_sift_features_free(features: *mut ptzcal_sift_features) {
    // SAFETY: NULL or live features that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(features) });
}

/// How many features there are.
///
/// @param features The features.
/// @param count    Receives the number.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_sift_features_count(
    features: *const ptzcal_sift_features,
    count: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (features, count) = unsafe { (borrow(features)?, Out::new(count, "count")?) };
        count.write(features.0.keypoints.len());
        Ok(())
    })
}

/// Copies the keypoints, PTZCAL_SIFT_KEYPOINT_SIZE numbers each.
///
/// @param features  The features.
/// @param keypoints Receives x, y, scale, angle, response, octave, sigma of each; may be NULL when
///                  capacity is 0.
/// @param capacity  Numbers that fit.
/// @param needed    Receives how many numbers there are; may be NULL.
/// @param error     Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: nothing was copied.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_sift_features_copy_keypoints(
    features: *const ptzcal_sift_features,
    keypoints: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (features, buffer) = unsafe { (borrow(features)?, BufferOut::new(keypoints, capacity, needed)?) };
        buffer.write(features.0.keypoints.iter().map(numbers).collect::<Vec<_>>().as_flattened())
    })
}

/// Copies the descriptors, PTZCAL_SIFT_DESCRIPTOR_SIZE bytes each.
///
/// @param features    The features.
/// @param descriptors Receives the descriptors; may be NULL when capacity is 0.
/// @param capacity    Bytes that fit.
/// @param needed      Receives how many bytes there are; may be NULL.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: nothing was copied.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_sift_features_copy_descriptors(
    features: *const ptzcal_sift_features,
    descriptors: *mut u8,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (features, buffer) = unsafe { (borrow(features)?, BufferOut::new(descriptors, capacity, needed)?) };
        buffer.write(features.0.descriptors.as_flattened())
    })
}
