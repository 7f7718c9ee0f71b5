//! Lines in space
//!
//! Straight lines through points of a cloud, or where an image with depths shows line segments, and which
//! of them is which segment of a camera's image.
//! Lines have the form that ptzcal_correspondences_add_directed_lines takes.

use nalgebra::{Matrix3, Matrix6, Vector2, Vector3};

use super::args::{ArrayOut, Out, flag, number, vectors, vectors_optional};
use super::call::{ErrorOut, guard};
use super::camera::{camera_in, ptzcal_camera};
use super::depth::ptzcal_depth_map;
use super::error::ptzcal_error;
use super::handle::borrow;
use super::rig_model::covariance2;
use super::sized::{self, SizedStruct};
use super::status::ptzcal_status;
use crate::detect::lines::{LineMatchOptions, LineSegment, lift_segments, match_lines};
use crate::error::{Error, Result};
use crate::geometry::MeasuredLine;
use crate::image::DepthNoise;
use crate::pose::{LineFitOptions, PointNoise, fit_line_3d};

/// How a line is fitted to points.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_line_fit_options {
    /// Set by ptzcal_line_fit_options_init.
    pub struct_size: u32,
    /// 1 (the default): outliers are found and set aside, from five points on. 0: all points are used.
    pub robust: u32,
    /// Seed of the search for outliers; the default is 1.
    pub seed: u64,
    /// Standard deviation of every coordinate of points without covariance, metres; the default is 0.01.
    pub sigma: f64,
    /// Outliers lie beyond this many standard deviations; the default is 3.7.
    pub outlier_threshold: f64,
    /// Least share of the points that must agree, 0 to 1; the default is 0.3.
    pub min_inliers: f64,
}

/// Of points without covariance, metres.
const SIGMA: f64 = 0.01;

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_line_fit_options {
    const NAME: &'static str = "options";
    const FIRST_SIZE: usize = 8 + 4 * 8;
    fn initial() -> Self {
        let o = LineFitOptions::default();
        Self {
            struct_size: size_of::<Self>() as u32,
            robust: o.robust.into(),
            seed: o.seed,
            sigma: SIGMA,
            outlier_threshold: o.outlier_threshold,
            min_inliers: o.min_inliers,
        }
    }
}

impl ptzcal_line_fit_options {
    /// The caller's options and sigma, or the defaults for NULL.
    ///
    /// # Safety
    /// `options` is NULL or a struct as long as its `struct_size` says.
    unsafe fn settings(options: *const Self) -> Result<(LineFitOptions, f64)> {
        if options.is_null() {
            return Ok((LineFitOptions::default(), SIGMA));
        }
        // SAFETY: by this function's contract.
        let o = unsafe { sized::read(options)? };
        let options = LineFitOptions {
            robust: flag(o.robust, "robust")?,
            outlier_threshold: number(o.outlier_threshold, "outlier_threshold")?,
            min_inliers: number(o.min_inliers, "min_inliers")?,
            seed: o.seed,
        };
        Ok((options, number(o.sigma, "sigma")?))
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
pub unsafe extern "C" fn ptzcal_line_fit_options_init(
    options: *mut ptzcal_line_fit_options,
    size: usize,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(options, size) })
}

/// Fits a straight line to points in space, of which some may be of other things: consensus of minimal
/// samples (RANSAC), then maximum likelihood. Of several lines the one that most points agree with is
/// taken. Points of a depth image need their covariances: along the ray their errors grow with the square
/// of the depth. Pixels without depth must be left out.
///
/// @param xyz             n x 3 numbers: points, metres.
/// @param xyz_covariance  n x 9 numbers: of each point, row-major, positive definite, m^2; may be NULL: the
///                        options' sigma.
/// @param n               Number of points, 2 or more.
/// @param options         The options; may be NULL: the defaults.
/// @param point_direction Receives 6 numbers: a point of the line in the middle of the inliers, and its
///                        unit direction.
/// @param line_covariance Receives 36 numbers: of point and direction together, row-major; may be NULL.
///                        Larger than the stated noise makes it where the residuals contradict that
///                        (1 in 1000).
/// @param extent          Receives 2 numbers: the first and last inlier's distance from the point along the
///                        direction, metres; may be NULL.
/// @param inliers         Receives n numbers: 1 for points that agree, else 0; may be NULL.
/// @param noise_factor    Receives the root of chi-square over its degrees of freedom, about 1 where the
///                        noise is as stated; 0 without redundancy; may be NULL.
/// @param error           Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NO_CONSENSUS;
///         PTZCAL_STATUS_DEGENERATE for points that are in one place as far as their noise tells;
///         PTZCAL_STATUS_INVALID_ARGUMENT for a covariance that is none and options out of range;
///         PTZCAL_STATUS_NOT_FINITE (index: the point).
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_fit_line_3d(
    xyz: *const f64,
    xyz_covariance: *const f64,
    n: usize,
    options: *const ptzcal_line_fit_options,
    point_direction: *mut f64,
    line_covariance: *mut f64,
    extent: *mut f64,
    inliers: *mut u8,
    noise_factor: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (xyz, xyz_covariance, (options, sigma), point_direction, line_covariance, extent) = unsafe {
            (
                vectors::<3>(xyz, n, "xyz")?,
                vectors_optional::<9>(xyz_covariance, n, "xyz_covariance")?,
                ptzcal_line_fit_options::settings(options)?,
                ArrayOut::vectors::<6>(point_direction, 1, "point_direction")?,
                ArrayOut::vectors_optional::<36>(line_covariance, 1, "line_covariance")?,
                ArrayOut::vectors_optional::<2>(extent, 1, "extent")?,
            )
        };
        // SAFETY: the caller keeps the header's rules for pointers.
        let (inliers, noise_factor) = unsafe {
            (
                if inliers.is_null() { None } else { Some(ArrayOut::new(inliers, n, "inliers")?) },
                if noise_factor.is_null() { None } else { Some(Out::new(noise_factor, "noise_factor")?) },
            )
        };
        let points: Vec<Vector3<f64>> = xyz.iter().map(|x| Vector3::from(*x)).collect();
        let covariances: Option<Vec<Matrix3<f64>>> =
            xyz_covariance.map(|c| c.iter().map(|c| Matrix3::from_row_slice(c)).collect());
        let noise = covariances.as_ref().map_or(PointNoise::Same(sigma), |c| PointNoise::Each(c));
        let found = fit_line_3d(&points, noise, &options)?;
        let line = &found.line;
        let (p, d) = (line.point, line.direction);
        point_direction.write(&[[p.x, p.y, p.z, d.x, d.y, d.z]]);
        if let Some(out) = line_covariance {
            out.write(&[covariance_out(line)]);
        }
        if let Some(out) = extent {
            out.write(&[line.extent]);
        }
        if let Some(out) = inliers {
            out.write(&found.inliers.iter().map(|i| u8::from(*i)).collect::<Vec<_>>());
        }
        if let Some(out) = noise_factor {
            let freedom = found.degrees_of_freedom as f64;
            out.write(if freedom > 0.0 { (found.chi_square / freedom).sqrt() } else { 0.0 });
        }
        Ok(())
    })
}

/// Finds where line segments of an image with depths lie in space: where the surfaces beside them meet
/// their viewing planes. Where the depth differs from side to side, the line is the edge of what is in
/// front; it is taken to be an edge of the thing itself, not the outline of a round one.
///
/// @param uv              n x 4 numbers: two points of each segment with independent errors, pixels, as
///                        ptzcal_detect_line_segments gives them.
/// @param uv_covariance   n x 6 numbers: xx, xy, yy of each point, px^2; may be NULL: 1 px, uncorrelated.
/// @param ends            n x 4 numbers: from where to where each segment is seen, pixels.
/// @param n               Number of segments.
/// @param camera          The camera of the image and of the depths. Its pose gives the frame of the lines.
/// @param map             The depths, of the camera's image size.
/// @param inverse_depth_sigma Standard deviation of the inverse depths, 1 / metre: 0.0014 for a Kinect.
/// @param depth_sigma     Standard deviation of the depths besides, metres; not 0 with the other.
/// @param point_direction Receives n x 6 numbers: a point of each line, metres, and its unit direction, that
///                        of its segment; 0 where there is none.
/// @param line_covariance Receives n x 36 numbers: of point and direction, row-major; may be NULL.
/// @param extents         Receives n x 2 numbers: from where to where each line is seen: distances from its
///                        point along its direction, metres; may be NULL.
/// @param found           Receives n numbers: 1 for a line, 0 where depths are missing on either side or
///                        contradict each other.
/// @param error           Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for segments without length, a camera or noise
///         that are none, and a map of another size; PTZCAL_STATUS_NOT_FINITE (index: the segment).
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_lift_line_segments(
    uv: *const f64,
    uv_covariance: *const f64,
    ends: *const f64,
    n: usize,
    camera: *const ptzcal_camera,
    map: *const ptzcal_depth_map,
    inverse_depth_sigma: f64,
    depth_sigma: f64,
    point_direction: *mut f64,
    line_covariance: *mut f64,
    extents: *mut f64,
    found: *mut u8,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (uv, uv_covariance, ends, camera, map) = unsafe {
            (
                vectors::<4>(uv, n, "uv")?,
                vectors_optional::<6>(uv_covariance, n, "uv_covariance")?,
                vectors::<4>(ends, n, "ends")?,
                camera_in(camera)?,
                borrow(map)?,
            )
        };
        // SAFETY: the caller keeps the header's rules for pointers.
        let (point_direction, line_covariance, extents, found) = unsafe {
            (
                ArrayOut::vectors::<6>(point_direction, n, "point_direction")?,
                ArrayOut::vectors_optional::<36>(line_covariance, n, "line_covariance")?,
                ArrayOut::vectors_optional::<2>(extents, n, "extents")?,
                ArrayOut::new(found, n, "found")?,
            )
        };
        let noise = DepthNoise {
            inverse_depth: number(inverse_depth_sigma, "inverse_depth_sigma")?,
            depth: number(depth_sigma, "depth_sigma")?,
        };
        let segments = segments_in(uv, uv_covariance, ends)?;
        let lines = lift_segments(&segments, &camera, &map.0, &noise)?;
        let all = || lines.iter();
        let numbers = |l: &MeasuredLine| {
            let (p, d) = (l.point, l.direction);
            [p.x, p.y, p.z, d.x, d.y, d.z]
        };
        point_direction.write(&all().map(|l| l.as_ref().map_or([0.0; 6], numbers)).collect::<Vec<_>>());
        if let Some(out) = line_covariance {
            out.write(&all().map(|l| l.as_ref().map_or([0.0; 36], covariance_out)).collect::<Vec<_>>());
        }
        if let Some(out) = extents {
            out.write(&all().map(|l| l.as_ref().map_or([0.0; 2], |l| l.extent)).collect::<Vec<_>>());
        }
        found.write(&all().map(|l| u8::from(l.is_some())).collect::<Vec<_>>());
        Ok(())
    })
}

/// Symmetric: rows are columns.
fn covariance_out(line: &MeasuredLine) -> [f64; 36] {
    std::array::from_fn(|i| line.covariance.as_slice()[i])
}

/// Which line in space is which segment.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_line_match_options {
    /// Set by ptzcal_line_match_options_init.
    pub struct_size: u32,
    /// 1 (the default): the bright side must be on the same hand. Both cameras must then see the same
    /// surfaces on both sides of a line, and directions of lines in space be those of segments that they
    /// were made from. 0: either.
    pub same_polarity: u32,
    /// Standard deviation of the camera's projections, pixels; the default is 2.
    pub camera_sigma: f64,
    /// Greatest distance of segment and line, in standard deviations; the default is 3.
    pub max_distance: f64,
    /// By how much the next candidate's squared distance, in standard deviations, must be greater; the
    /// default is 9.
    pub min_lead: f64,
    /// Least share of the shorter one that segment and line's image have in common, 0 to 1; the default is
    /// 0.5.
    pub min_overlap: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_line_match_options {
    const NAME: &'static str = "options";
    const FIRST_SIZE: usize = 8 + 4 * 8;
    fn initial() -> Self {
        let o = LineMatchOptions::default();
        Self {
            struct_size: size_of::<Self>() as u32,
            same_polarity: o.same_polarity.into(),
            camera_sigma: o.camera_sigma,
            max_distance: o.max_distance,
            min_lead: o.min_lead,
            min_overlap: o.min_overlap,
        }
    }
}

impl ptzcal_line_match_options {
    /// The caller's options, or the defaults for NULL.
    ///
    /// # Safety
    /// `options` is NULL or a struct as long as its `struct_size` says.
    unsafe fn settings(options: *const Self) -> Result<LineMatchOptions> {
        if options.is_null() {
            return Ok(LineMatchOptions::default());
        }
        // SAFETY: by this function's contract.
        let o = unsafe { sized::read(options)? };
        Ok(LineMatchOptions {
            camera_sigma: number(o.camera_sigma, "camera_sigma")?,
            max_distance: number(o.max_distance, "max_distance")?,
            min_lead: number(o.min_lead, "min_lead")?,
            min_overlap: number(o.min_overlap, "min_overlap")?,
            same_polarity: flag(o.same_polarity, "same_polarity")?,
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
pub unsafe extern "C" fn ptzcal_line_match_options_init(
    options: *mut ptzcal_line_match_options,
    size: usize,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(options, size) })
}

/// Matches lines in space with the segments of a camera's image, by a first estimate of the camera. A line
/// and a segment are matched once at most. What is not certain is not matched: lines with a second
/// candidate nearly as good have none (but of pieces of one line the longest is taken).
///
/// @param point_direction n_lines x 6 numbers: a point of each line, metres, world frame, and its
///                        direction, of any length but zero.
/// @param line_covariance n_lines x 36 numbers: of point and direction, row-major; may be NULL: the lines
///                        are exact.
/// @param extents         n_lines x 2 numbers: from where to where each line was seen: multiples of its
///                        direction from its point.
/// @param n_lines         Number of lines.
/// @param camera          The camera.
/// @param uv              n_segments x 4 numbers: two points of each segment with independent errors,
///                        pixels, as ptzcal_detect_line_segments gives them.
/// @param uv_covariance   n_segments x 6 numbers: xx, xy, yy of each point, px^2; may be NULL: 1 px,
///                        uncorrelated. Only what it says across the segment counts.
/// @param ends            n_segments x 4 numbers: from where to where each segment is seen, pixels.
/// @param n_segments      Number of segments.
/// @param options         The options; may be NULL: the defaults.
/// @param pairs           Receives 2 numbers a match, by ascending line: the indices of line and segment.
/// @param residuals       Receives 2 numbers a match: distances of the segment's points from the line's
///                        image, pixels; may be NULL.
/// @param capacity        Number of matches that the arrays hold; n_lines is always enough.
/// @param count           Receives the number of matches, also when the capacity is too small.
/// @param error           Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: no match was written;
///         PTZCAL_STATUS_INVALID_ARGUMENT for directions that are zero, segments without length, and
///         options or a camera that are none; PTZCAL_STATUS_NOT_FINITE (index: the line or segment).
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_match_lines(
    point_direction: *const f64,
    line_covariance: *const f64,
    extents: *const f64,
    n_lines: usize,
    camera: *const ptzcal_camera,
    uv: *const f64,
    uv_covariance: *const f64,
    ends: *const f64,
    n_segments: usize,
    options: *const ptzcal_line_match_options,
    pairs: *mut u32,
    residuals: *mut f64,
    capacity: usize,
    count: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (point_direction, line_covariance, extents, camera, uv, uv_covariance, ends) = unsafe {
            (
                vectors::<6>(point_direction, n_lines, "point_direction")?,
                vectors_optional::<36>(line_covariance, n_lines, "line_covariance")?,
                vectors::<2>(extents, n_lines, "extents")?,
                camera_in(camera)?,
                vectors::<4>(uv, n_segments, "uv")?,
                vectors_optional::<6>(uv_covariance, n_segments, "uv_covariance")?,
                vectors::<4>(ends, n_segments, "ends")?,
            )
        };
        // SAFETY: the caller keeps the header's rules for pointers.
        let (options, pairs, residuals, count) = unsafe {
            (
                ptzcal_line_match_options::settings(options)?,
                ArrayOut::<[u32; 2]>::new(pairs.cast(), capacity, "pairs")?,
                ArrayOut::vectors_optional::<2>(residuals, capacity, "residuals")?,
                Out::new(count, "count")?,
            )
        };
        let mut lines = Vec::with_capacity(n_lines);
        for (i, (numbers, extent)) in point_direction.iter().zip(extents).enumerate() {
            lines.push(line_in(numbers, line_covariance.map(|c| &c[i]), extent, i)?);
        }
        let segments = segments_in(uv, uv_covariance, ends)?;
        let found = match_lines(&lines, &camera, &segments, &options)?;
        count.write(found.len());
        if found.len() > capacity {
            return Err(Error::BufferTooSmall { needed: found.len(), capacity });
        }
        pairs.write(&found.iter().map(|m| [m.line as u32, m.segment as u32]).collect::<Vec<_>>());
        if let Some(residuals) = residuals {
            residuals.write(&found.iter().map(|m| m.residual.into()).collect::<Vec<[f64; 2]>>());
        }
        Ok(())
    })
}

/// A line with a direction of any length, which scales its extent and its covariance.
fn line_in(
    numbers: &[f64; 6],
    covariance: Option<&[f64; 36]>,
    extent: &[f64; 2],
    index: usize,
) -> Result<MeasuredLine> {
    let [x, y, z, dx, dy, dz] = *numbers;
    let direction = Vector3::new(dx, dy, dz);
    let length = direction.norm();
    let scale = 1.0 / length;
    if !(length > 0.0 && scale.is_finite() && length.is_finite()) {
        return Err(Error::invalid("point_direction", format!("line {index} has no direction")));
    }
    let mut to_unit = Matrix6::identity();
    (3..6).for_each(|i| to_unit[(i, i)] = scale);
    let covariance = covariance.map_or_else(Matrix6::zeros, |c| to_unit * Matrix6::from_row_slice(c) * to_unit);
    let mut extent = extent.map(|s| s * length);
    extent.sort_by(f64::total_cmp);
    Ok(MeasuredLine { point: Vector3::new(x, y, z), direction: direction * scale, covariance, extent })
}

fn segments_in(uv: &[[f64; 4]], covariance: Option<&[[f64; 6]]>, ends: &[[f64; 4]]) -> Result<Vec<LineSegment>> {
    uv.iter().zip(ends).enumerate().map(|(i, (uv, ends))| segment_in(uv, covariance.map(|c| &c[i]), ends, i)).collect()
}

fn segment_in(uv: &[f64; 4], covariance: Option<&[f64; 6]>, ends: &[f64; 4], index: usize) -> Result<LineSegment> {
    let pair = |[a, b, c, d]: [f64; 4]| [Vector2::new(a, b), Vector2::new(c, d)];
    let (points, ends) = (pair(*uv), pair(*ends));
    let along = points[1] - points[0];
    let normal = Vector2::new(-along.y, along.x).try_normalize(0.0);
    let normal = normal.ok_or_else(|| Error::invalid("uv", format!("segment {index} has no length")))?;
    if along.dot(&(ends[1] - ends[0])) <= 0.0 {
        return Err(Error::invalid("ends", format!("segment {index} has no length, or another direction than uv")));
    }
    let halves = covariance.map_or([None; 2], |[a, b, c, d, e, f]| [Some([*a, *b, *c]), Some([*d, *e, *f])]);
    let across = halves.map(|c| normal.dot(&(covariance2(c.as_ref()) * normal)));
    let variance = 0.5 * (across[0] + across[1]);
    Ok(LineSegment { ends, points, variance, contrast: 0.0, blur: 0.0, support: (ends[1] - ends[0]).norm() })
}
