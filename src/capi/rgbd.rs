//! Calibrating from colour and depth
//!
//! A fixed camera from the views of an auxiliary camera with depth, where both see the same textured
//! things: no laser and no marks are needed. SIFT features of both images are matched, the auxiliary
//! ones become points by their depth, and those pairs calibrate the fixed camera; then it tells which
//! straight edges of both images are one, and is calibrated once more from points and lines (thesis,
//! section IV.B).
//!
//! Make a ptzcal_rgbd of the fixed camera's image, add the auxiliary views, and calibrate. The world
//! is that of the auxiliary cameras' poses.

use super::args::{BufferOut, flag, number};
use super::calibrate::ptzcal_calibration;
use super::calibration_options::ptzcal_calibration_options;
use super::call::{ErrorOut, guard, guard_or};
use super::camera::{camera_in, ptzcal_camera};
use super::depth::ptzcal_depth_map;
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow, free};
use super::image::{ptzcal_image, view};
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::error::{Error, Result};
use crate::rgbd::{LinePair, PointPair, RgbdCalibration, RgbdCalibrator, RgbdOptions, ViewCounts};

const WHAT: &str = "rgbd";

/// Numbers of a pair of points: the view, x and y in its image, x and y in the fixed camera's (pixels),
/// and the point in the world (metres).
pub const PTZCAL_RGBD_PAIR_SIZE: usize = 8;

/// Numbers of a pair of lines: the view, x and y of both ends in its image, x and y of both ends in the
/// fixed camera's (pixels), and of the line in the world a point (metres) and its direction (length 1).
pub const PTZCAL_RGBD_LINE_SIZE: usize = 15;

/// How pairs are found.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_rgbd_options {
    /// Set by ptzcal_rgbd_options_init.
    pub struct_size: u32,
    /// Least number of pairs that agree with the camera, 6 or more.
    pub min_pairs: u32,
    /// 1: once more with those pairs of features that look less distinct but lie where a first camera
    /// expects them; 0: no.
    pub guided: u32,
    /// 1: with the straight edges that both images show; 0: with points alone.
    pub lines: u32,
    /// Least contrast of a SIFT feature, above 0 to 1.
    pub contrast_threshold: f64,
    /// Greatest ratio of a feature's principal curvatures, above 1.
    pub edge_ratio: f64,
    /// Greatest ratio of the distances to the nearest and the second nearest feature, above 0 to 1.
    pub max_ratio: f64,
    /// Standard deviation of inverse depths, 1/m: for cameras that triangulate. 0.001425 is a Kinect's of
    /// the first kind.
    pub inverse_depth_sigma: f64,
    /// Standard deviation of depths besides, metres: for cameras that measure time of flight.
    pub depth_sigma: f64,
    /// Standard deviation of a feature's place, across its elongation, in pixels; 0: estimated from the
    /// residuals.
    pub keypoint_sigma: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_rgbd_options {
    const NAME: &'static str = "options";
    const FIRST_SIZE: usize = 16 + 6 * 8;
    fn initial() -> Self {
        let defaults = RgbdOptions::default();
        Self {
            struct_size: size_of::<Self>() as u32,
            min_pairs: defaults.min_pairs as u32,
            guided: defaults.guided.into(),
            lines: defaults.lines.into(),
            contrast_threshold: defaults.sift.contrast_threshold,
            edge_ratio: defaults.sift.edge_ratio,
            max_ratio: defaults.matching.max_ratio,
            inverse_depth_sigma: defaults.depth_noise.inverse_depth,
            depth_sigma: defaults.depth_noise.depth,
            keypoint_sigma: 0.0,
        }
    }
}

impl ptzcal_rgbd_options {
    /// The caller's options, or the defaults for NULL.
    ///
    /// # Safety
    /// `options` is NULL or a struct as long as its `struct_size` says.
    unsafe fn settings(options: *const Self) -> Result<RgbdOptions> {
        let mut settings = RgbdOptions::default();
        if options.is_null() {
            return Ok(settings);
        }
        // SAFETY: by this function's contract.
        let options = unsafe { sized::read(options)? };
        settings.min_pairs = options.min_pairs as usize;
        settings.guided = flag(options.guided, "guided")?;
        settings.lines = flag(options.lines, "lines")?;
        settings.sift.contrast_threshold = number(options.contrast_threshold, "contrast_threshold")?;
        settings.sift.edge_ratio = number(options.edge_ratio, "edge_ratio")?;
        settings.matching.max_ratio = number(options.max_ratio, "max_ratio")?;
        settings.depth_noise.inverse_depth = number(options.inverse_depth_sigma, "inverse_depth_sigma")?;
        settings.depth_noise.depth = number(options.depth_sigma, "depth_sigma")?;
        let sigma = number(options.keypoint_sigma, "keypoint_sigma")?;
        settings.keypoint_sigma = (sigma != 0.0).then_some(sigma);
        Ok(settings)
    }
}

/// What an auxiliary view has to offer.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_rgbd_view {
    /// Set by ptzcal_rgbd_view_init.
    pub struct_size: u32,
    /// Features of its image.
    pub features: u32,
    /// Of them, those that have a depth.
    pub with_depth: u32,
    /// Features that look like one of the fixed camera's image.
    pub matches: u32,
    /// Of these, those that have a depth.
    pub pairs: u32,
    /// Straight edges of its image that have a depth.
    pub lines: u32,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_rgbd_view {
    const NAME: &'static str = "view";
    const FIRST_SIZE: usize = 24;
    fn initial() -> Self {
        Self { struct_size: size_of::<Self>() as u32, features: 0, with_depth: 0, matches: 0, pairs: 0, lines: 0 }
    }
}

impl From<ViewCounts> for ptzcal_rgbd_view {
    fn from(c: ViewCounts) -> Self {
        Self {
            features: c.features as u32,
            with_depth: c.with_depth as u32,
            matches: c.matches as u32,
            pairs: c.pairs as u32,
            lines: c.lines as u32,
            ..Self::initial()
        }
    }
}

struct Work {
    calibrator: RgbdCalibrator,
    /// Of the last calibration.
    pairs: Vec<PointPair>,
    lines: Vec<LinePair>,
}

/// A fixed camera's image and what auxiliary views share with it.
pub struct ptzcal_rgbd(Exclusive<Work>);

impl Handle for ptzcal_rgbd {
    const NAME: &'static str = "rgbd";
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
pub unsafe extern "C" fn ptzcal_rgbd_options_init(options: *mut ptzcal_rgbd_options, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(options, size) })
}

/// Sets up a view's counts: everything 0.
///
/// @param view The struct.
/// @param size sizeof *view.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rgbd_view_init(view: *mut ptzcal_rgbd_view, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(view, size) })
}

/// Begins with the fixed camera's image.
///
/// @param fixed   The image; it is not needed after the call.
/// @param options The options; may be NULL: the defaults.
/// @param rgbd    Receives the handle; free it with ptzcal_rgbd_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for options out of range and for a malformed
///         or too small image; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_NOT_FINITE.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rgbd_new(
    fixed: *const ptzcal_image,
    options: *const ptzcal_rgbd_options,
    rgbd: *mut *mut ptzcal_rgbd,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (rgbd, fixed, options) =
            unsafe { (HandleOut::new(rgbd)?, view(fixed)?, ptzcal_rgbd_options::settings(options)?) };
        let calibrator = RgbdCalibrator::new(&fixed, options)?;
        rgbd.give(ptzcal_rgbd(Exclusive::new(Work { calibrator, pairs: Vec::new(), lines: Vec::new() })));
        Ok(())
    })
}

/// Frees it.
///
/// @param rgbd The handle; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rgbd_free(rgbd: *mut ptzcal_rgbd) {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard_or((), || unsafe { free(rgbd) })
}

/// Adds a view of an auxiliary camera. A view without texture or depth adds nothing; its counts say so.
///
/// @param rgbd   The handle.
/// @param colour The auxiliary camera's image; it is not needed after the call.
/// @param depth  The depth of each of its pixels.
/// @param camera The auxiliary camera, of the image's size; its pose says what the world is.
/// @param counts Receives what the view has to offer; may be NULL.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for another size and for a malformed image or
///         camera; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rgbd_add_view(
    rgbd: *mut ptzcal_rgbd,
    colour: *const ptzcal_image,
    depth: *const ptzcal_depth_map,
    camera: *const ptzcal_camera,
    counts: *mut ptzcal_rgbd_view,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (rgbd, colour, depth, camera, counts) = unsafe {
            (
                borrow(rgbd)?,
                view(colour)?,
                borrow(depth)?,
                camera_in(camera)?,
                if counts.is_null() { None } else { Some(SizedOut::new(counts)?) },
            )
        };
        let found = rgbd.0.write(WHAT)?.calibrator.add_view(&colour, &depth.0, &camera)?;
        if let Some(counts) = counts {
            counts.write(&found.into());
        }
        Ok(())
    })
}

/// Calibrates the fixed camera from all views added so far. Views may be added later and the camera
/// calibrated again.
///
/// The calibration's residuals and inliers are those of the pairs that ptzcal_rgbd_copy_pairs gives, in
/// their order, and then of the lines of ptzcal_rgbd_copy_lines.
///
/// @param rgbd    The handle.
/// @param options The options; may be NULL: the defaults.
/// @param result  Receives the calibration; free it with ptzcal_calibration_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS where the images have too little in common
///         (the message says what there is); PTZCAL_STATUS_DEGENERATE; PTZCAL_STATUS_NO_CONSENSUS;
///         PTZCAL_STATUS_NO_CONVERGENCE; PTZCAL_STATUS_LENS_NOT_MONOTONE; PTZCAL_STATUS_CANCELLED;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rgbd_calibrate(
    rgbd: *mut ptzcal_rgbd,
    options: *const ptzcal_calibration_options,
    result: *mut *mut ptzcal_calibration,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (result, rgbd, options) =
            unsafe { (HandleOut::new(result)?, borrow(rgbd)?, ptzcal_calibration_options::settings(options)?) };
        let mut work = rgbd.0.write(WHAT)?;
        let RgbdCalibration { calibration, points, lines, .. } = work.calibrator.calibrate(&options)?;
        (work.pairs, work.lines) = (points, lines);
        result.give(calibration.into());
        Ok(())
    })
}

/// Copies the pairs of points of the last calibration, PTZCAL_RGBD_PAIR_SIZE numbers each.
///
/// @param rgbd     The handle.
/// @param pairs    Receives view, auxiliary x, y, fixed x, y, world X, Y, Z of each; may be NULL when
///                 `capacity` is 0.
/// @param capacity Numbers that the buffer holds.
/// @param needed   Receives how many numbers there are; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BAD_STATE before the first
///         calibration; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rgbd_copy_pairs(
    rgbd: *const ptzcal_rgbd,
    pairs: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (rgbd, buffer) = unsafe { (borrow(rgbd)?, BufferOut::new(pairs, capacity, needed)?) };
        let work = rgbd.0.read(WHAT)?;
        calibrated(&work)?;
        let numbers = |p: &PointPair| -> [f64; PTZCAL_RGBD_PAIR_SIZE] {
            let (seen, fixed, world) = (p.lifted.pixel, p.fixed, p.lifted.world);
            [p.view as f64, seen.x, seen.y, fixed.x, fixed.y, world.x, world.y, world.z]
        };
        buffer.write(work.pairs.iter().map(numbers).collect::<Vec<_>>().as_flattened())
    })
}

/// Copies the pairs of lines of the last calibration, PTZCAL_RGBD_LINE_SIZE numbers each.
///
/// @param rgbd     The handle.
/// @param lines    Receives view, auxiliary x0, y0, x1, y1, fixed x0, y0, x1, y1, point X, Y, Z, direction
///                 X, Y, Z of each; may be NULL when `capacity` is 0.
/// @param capacity Numbers that the buffer holds.
/// @param needed   Receives how many numbers there are; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BAD_STATE before the first
///         calibration; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_rgbd_copy_lines(
    rgbd: *const ptzcal_rgbd,
    lines: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (rgbd, buffer) = unsafe { (borrow(rgbd)?, BufferOut::new(lines, capacity, needed)?) };
        let work = rgbd.0.read(WHAT)?;
        calibrated(&work)?;
        let numbers = |l: &LinePair| {
            let direction = l.line.direction.normalize();
            let mut row = [0.0; PTZCAL_RGBD_LINE_SIZE];
            let values = std::iter::once(l.view as f64)
                .chain(l.auxiliary.ends.into_iter().chain(l.fixed.ends).flat_map(|p| [p.x, p.y]))
                .chain(l.line.point.iter().copied())
                .chain(direction.iter().copied());
            row.iter_mut().zip(values).for_each(|(to, value)| *to = value);
            row
        };
        buffer.write(work.lines.iter().map(numbers).collect::<Vec<_>>().as_flattened())
    })
}

fn calibrated(work: &Work) -> Result<()> {
    if work.pairs.is_empty() { Err(Error::BadState { reason: "nothing was calibrated yet".into() }) } else { Ok(()) }
}
