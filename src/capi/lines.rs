//! Detecting edges and straight lines
//!
//! Edges are pixels where the light changes fastest (Canny), to a fraction of a pixel. Line segments are
//! straight edges, to a few hundredths of a pixel, each with its covariance: what
//! ptzcal_correspondences_add_lines takes as `uv` and `uv_covariance`.
//!
//! A segment's `uv` are two points on it whose errors across it are independent, one radius of gyration
//! from its middle. Together they say all that is known of the line; on a line that a lens bends evenly
//! they still lie on it, which its ends do not. On the way from the first to the second the bright side
//! is on the right.

use super::args::{ArrayOut, Out, number};
use super::call::{ErrorOut, guard};
use super::error::ptzcal_error;
use super::image::{ptzcal_image, view};
use super::sized::{self, SizedStruct};
use super::status::ptzcal_status;
use crate::detect::edges::{EdgeOptions, detect_edges};
use crate::detect::lines::{LineOptions, detect_line_segments};
use crate::error::{Error, Result};

/// Which line segments are looked for.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_line_options {
    /// Set by ptzcal_line_options_init.
    pub struct_size: u32,
    /// Most segments that are returned, the longest first: 1 or more; the default is 10000.
    pub max_segments: u32,
    /// Least length, pixels: 8 or more; the default is 20.
    pub min_length: f64,
    /// Least step from dark to bright, grey levels: above 0 to 255; the default is 12. Where the image's
    /// noise asks for more, more is demanded.
    pub min_contrast: f64,
    /// Longest gap between two pieces of one line that are joined, pixels; the default is 40. It is never
    /// longer than the shorter piece. 0: nothing is joined.
    pub max_gap: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_line_options {
    const NAME: &'static str = "options";
    const FIRST_SIZE: usize = 8 + 3 * 8;
    fn initial() -> Self {
        let o = LineOptions::default();
        Self {
            struct_size: size_of::<Self>() as u32,
            max_segments: o.max_segments as u32,
            min_length: o.min_length,
            min_contrast: o.min_contrast,
            max_gap: o.max_gap,
        }
    }
}

impl ptzcal_line_options {
    /// The caller's options, or the defaults for NULL.
    ///
    /// # Safety
    /// `options` is NULL or a struct as long as its `struct_size` says.
    unsafe fn settings(options: *const Self) -> Result<LineOptions> {
        if options.is_null() {
            return Ok(LineOptions::default());
        }
        // SAFETY: by this function's contract.
        let o = unsafe { sized::read(options)? };
        Ok(LineOptions {
            min_length: number(o.min_length, "min_length")?,
            min_contrast: number(o.min_contrast, "min_contrast")?,
            max_gap: number(o.max_gap, "max_gap")?,
            max_segments: o.max_segments as usize,
        })
    }
}

/// Sets up options with their defaults.
///
/// @param options The struct.
/// @param size    sizeof *options.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_line_options_init(options: *mut ptzcal_line_options, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(options, size) })
}

/// Finds edges: Canny's maxima of the gradient, row by row.
///
/// @param image    The image; of colours their luma is used.
/// @param sigma    Standard deviation of the Gaussian that smooths the image first, pixels, at most 10;
///                 0: a 3 x 3 binomial filter (0.71 pixels), which is faster.
/// @param low      Gradient from which on an edge goes on, grey levels per pixel of the smoothed image,
///                 above 0.
/// @param high     Gradient that an edge must reach somewhere, `low` or more.
/// @param edges    Receives 5 numbers an edge pixel: x and y, pixels; the unit vector across the edge
///                 towards its bright side, x and y; the gradient.
/// @param capacity Number of edge pixels that the array holds.
/// @param count    Receives their number, also when the capacity is too small.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL for the capacity (nothing was written), or
///         when a plane's size cannot hold the image; PTZCAL_STATUS_INVALID_ARGUMENT for impossible
///         numbers, a malformed image and one of more than 2^28 pixels; PTZCAL_STATUS_NOT_FINITE.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_detect_edges(
    image: *const ptzcal_image,
    sigma: f64,
    low: f64,
    high: f64,
    edges: *mut f64,
    capacity: usize,
    count: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (image, edges, count) =
            unsafe { (view(image)?, ArrayOut::vectors::<5>(edges, capacity, "edges")?, Out::new(count, "count")?) };
        let [sigma, low, high] = [number(sigma, "sigma")?, number(low, "low")?, number(high, "high")?];
        let found = detect_edges(&image, &EdgeOptions { sigma, low, high })?;
        count.write(found.len());
        if found.len() > capacity {
            return Err(Error::BufferTooSmall { needed: found.len(), capacity });
        }
        let numbers = found.iter().map(|e| [e.x, e.y, e.normal[0], e.normal[1], e.gradient]);
        edges.write(&numbers.collect::<Vec<_>>());
        Ok(())
    })
}

/// Finds straight line segments, the longest first. In an image of nothing but white noise there is
/// about one at most.
///
/// A line that a lens bends is one segment while it leaves a straight line by a pixel or so, and several
/// otherwise. What is needed besides the image is a byte a pixel.
///
/// @param image         The image; of colours their luma is used.
/// @param options       The options; may be NULL: the defaults.
/// @param uv            Receives n x 4 numbers: two points of each line with independent errors, pixels.
/// @param uv_covariance Receives n x 6 numbers: xx, xy, yy of each point, px^2: that across the line, in
///                      all directions; may be NULL.
/// @param ends          Receives n x 4 numbers: from where to where the line is seen, pixels, to a pixel or
///                      two; may be NULL.
/// @param details       Receives n x 3 numbers: the step from dark to bright, grey levels; standard
///                      deviation of the edge's blur, pixels; length less gaps, pixels; may be NULL.
/// @param capacity      Number of segments that the arrays hold; the options' max_segments is always
///                      enough.
/// @param count         Receives the number n of segments, also when the capacity is too small.
/// @param error         Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL for the capacity (nothing was written), or
///         when a plane's size cannot hold the image; PTZCAL_STATUS_INVALID_ARGUMENT for options out of
///         range, a malformed image and one of more than 2^28 pixels; PTZCAL_STATUS_NOT_FINITE.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_detect_line_segments(
    image: *const ptzcal_image,
    options: *const ptzcal_line_options,
    uv: *mut f64,
    uv_covariance: *mut f64,
    ends: *mut f64,
    details: *mut f64,
    capacity: usize,
    count: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (image, options, uv, uv_covariance, ends, details, count) = unsafe {
            (
                view(image)?,
                ptzcal_line_options::settings(options)?,
                ArrayOut::vectors::<4>(uv, capacity, "uv")?,
                ArrayOut::vectors_optional::<6>(uv_covariance, capacity, "uv_covariance")?,
                ArrayOut::vectors_optional::<4>(ends, capacity, "ends")?,
                ArrayOut::vectors_optional::<3>(details, capacity, "details")?,
                Out::new(count, "count")?,
            )
        };
        let found = detect_line_segments(&image, &options)?;
        count.write(found.len());
        if found.len() > capacity {
            return Err(Error::BufferTooSmall { needed: found.len(), capacity });
        }
        let all = || found.iter();
        let places = |[a, b]: [nalgebra::Vector2<f64>; 2]| [a.x, a.y, b.x, b.y];
        uv.write(&all().map(|s| places(s.points)).collect::<Vec<_>>());
        if let Some(out) = uv_covariance {
            out.write(&all().map(|s| [s.variance, 0.0, s.variance, s.variance, 0.0, s.variance]).collect::<Vec<_>>());
        }
        if let Some(out) = ends {
            out.write(&all().map(|s| places(s.ends)).collect::<Vec<_>>());
        }
        if let Some(out) = details {
            out.write(&all().map(|s| [s.contrast, s.blur, s.support]).collect::<Vec<_>>());
        }
        Ok(())
    })
}
