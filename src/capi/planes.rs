//! Planes of scans
//!
//! The planes that a station sees (walls, floor, ceiling, faces of furniture), found in points, in laser
//! shots or in depths; each with its covariance, where it was measured, and which measurements belong to
//! it. Those of a scan, and those of regions that you name, have chapters of their own. Two stations' planes give the pose between them:
//! ptzcal_register_stations.
//!
//! A plane is n . X = 1 in the station's frame: n is the unit normal, away from the station, over the
//! distance. A plane through the station itself cannot be seen from it and is left out.

use nalgebra::{Vector2, Vector3};

use super::args::{BufferOut, Out, array, number, vectors, vectors_optional};
use super::call::{ErrorOut, guard, guard_or};
use super::camera::{camera_in, ptzcal_camera};
use super::depth::ptzcal_depth_map;
use super::error::ptzcal_error;
use super::handle::{Handle, HandleOut, borrow, free};
use super::rig_model::{covariance2, model_in, ptzcal_rig_model};
use super::sized::{self, SizedOut, SizedStruct};
use super::status::ptzcal_status;
use crate::error::{Error, Result};
use crate::geometry::{InverseDepthPoint, RigModel};
use crate::image::DepthNoise;
use crate::pose::{
    FindPlanesOptions, FoundPlane, StationPlanes, find_planes_in_points, find_planes_in_shots, shots_of_depth_map,
    shots_of_ranges,
};

/// How planes are found.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_planes_options {
    /// Set by ptzcal_planes_options_init.
    pub struct_size: u32,
    /// Least number of measurements that make a plane, 4 or more.
    pub min_points: u32,
    /// Most planes, 1 to 1000.
    pub max_planes: u32,
    /// 0.
    pub reserved: u32,
    /// Seed of the search: the same input and seed give the same planes.
    pub seed: u64,
    /// Standard deviations within which a measurement belongs to a plane.
    pub threshold: f64,
    /// Standard deviation of real surfaces from planes, metres; added to that of the measurements. State
    /// systematic errors of the instrument here too.
    pub flatness: f64,
    /// Least share of the measurements that make a plane, 0 to 1.
    pub min_share: f64,
    /// What is nearer to the station is left out (its own parts), metres.
    pub min_range: f64,
    /// What is farther is left out, metres; may be infinite.
    pub max_range: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_planes_options {
    const NAME: &'static str = "options";
    const FIRST_SIZE: usize = 16 + 6 * 8;
    fn initial() -> Self {
        let defaults = FindPlanesOptions::default();
        Self {
            struct_size: size_of::<Self>() as u32,
            min_points: defaults.min_points as u32,
            max_planes: defaults.max_planes as u32,
            reserved: 0,
            seed: defaults.seed,
            threshold: defaults.threshold,
            flatness: defaults.flatness,
            min_share: defaults.min_share,
            min_range: defaults.range[0],
            max_range: defaults.range[1],
        }
    }
}

impl ptzcal_planes_options {
    /// The caller's options, or the defaults for NULL.
    ///
    /// # Safety
    /// `options` is NULL or a struct as long as its `struct_size` says.
    pub(super) unsafe fn settings(options: *const Self) -> Result<FindPlanesOptions> {
        if options.is_null() {
            return Ok(FindPlanesOptions::default());
        }
        // SAFETY: by this function's contract.
        let options = unsafe { sized::read(options)? };
        Ok(FindPlanesOptions {
            threshold: number(options.threshold, "threshold")?,
            flatness: number(options.flatness, "flatness")?,
            min_share: number(options.min_share, "min_share")?,
            min_points: options.min_points as usize,
            max_planes: options.max_planes as usize,
            range: [number(options.min_range, "min_range")?, options.max_range],
            seed: options.seed,
        })
    }
}

/// The planes of one station. Immutable: any number of threads may read it.
pub struct ptzcal_planes(pub(super) StationPlanes);

impl Handle for ptzcal_planes {
    const NAME: &'static str = "planes";
}

/// One plane of a station.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ptzcal_plane {
    /// Set by ptzcal_plane_init.
    pub struct_size: u32,
    /// Measurements that belong to it.
    pub count: u32,
    /// n . X = 1: the unit normal, away from the station, over the distance, 1 / m.
    pub n: [f64; 3],
    /// Of n, row-major, 1 / m^2. Larger than that of independent noise where the surface is not even.
    pub covariance: [f64; 9],
    /// Middle of its measurements, on the plane, metres.
    pub centre: [f64; 3],
    /// Two unit vectors in the plane, one after the other, that of the larger extent first.
    pub axes: [f64; 6],
    /// How far the measurements reach along the first axis, from where to where as seen from the centre,
    /// and along the second, metres; one in a hundred lies beyond each end.
    pub extent: [f64; 4],
    /// What of it is covered by measurements, m^2.
    pub area: f64,
    /// Root mean square distance of the measurements from it, metres.
    pub rms: f64,
    /// Root of chi-square over its degrees of freedom: about 1 when the stated noise was right.
    pub noise_factor: f64,
}

// SAFETY: numbers, `struct_size` first.
unsafe impl SizedStruct for ptzcal_plane {
    const NAME: &'static str = "plane";
    const FIRST_SIZE: usize = 8 + 28 * 8;
    fn initial() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            count: 0,
            n: [0.0; 3],
            covariance: [0.0; 9],
            centre: [0.0; 3],
            axes: [0.0; 6],
            extent: [0.0; 4],
            area: 0.0,
            rms: 0.0,
            noise_factor: 0.0,
        }
    }
}

impl From<&FoundPlane> for ptzcal_plane {
    fn from(p: &FoundPlane) -> Self {
        let (mut covariance, mut axes, mut extent) = ([0.0; 9], [0.0; 6], [0.0; 4]);
        // Symmetric: by columns is by rows.
        covariance.copy_from_slice(p.estimate.covariance.as_slice());
        for (k, axis) in p.support.axes.iter().enumerate() {
            axes[3 * k..3 * k + 3].copy_from_slice(axis.as_slice());
            extent[2 * k..2 * k + 2].copy_from_slice(&p.support.extent[k]);
        }
        Self {
            count: u32::try_from(p.count).unwrap_or(u32::MAX),
            n: p.estimate.n.into(),
            covariance,
            centre: p.support.centre.into(),
            axes,
            extent,
            area: p.support.area,
            rms: p.rms,
            noise_factor: p.estimate.noise_factor().unwrap_or(1.0),
            ..Self::initial()
        }
    }
}

/// The caller's points; those that are not finite are left to the search, which passes them over.
///
/// # Safety
/// As for [`array`], with 3 n numbers.
pub(super) unsafe fn points_in<'a>(xyz: *const f64, n: usize) -> Result<&'a [Vector3<f64>]> {
    // SAFETY: by this function's contract.
    let points = unsafe { array(xyz.cast::<[f64; 3]>(), n, "xyz")? };
    // SAFETY: a vector is three numbers one after the other, and nothing else.
    Ok(unsafe { std::slice::from_raw_parts(points.as_ptr().cast(), points.len()) })
}

/// The caller's shots.
///
/// # Safety
/// As for [`vectors`].
pub(super) unsafe fn shots_in(
    model: &RigModel,
    pan_tilt: *const f64,
    spots: *const f64,
    covariance: *const f64,
    n: usize,
) -> Result<Vec<InverseDepthPoint>> {
    // SAFETY: by this function's contract.
    let (pan_tilt, spots, covariance) = unsafe {
        (
            vectors::<2>(pan_tilt, n, "pan_tilt")?,
            vectors::<2>(spots, n, "spots")?,
            vectors_optional::<3>(covariance, n, "spot_covariance")?,
        )
    };
    let shots = pan_tilt.iter().zip(spots).enumerate().map(|(i, ([pan, tilt], spot))| {
        let noise = covariance2(covariance.map(|c| &c[i]));
        Ok(model.measure(*pan, *tilt, &Vector2::from(*spot), &noise)?.point)
    });
    shots.collect()
}

pub(super) fn sigma_in(sigma: f64) -> Result<Option<f64>> {
    Ok((number(sigma, "sigma")? != 0.0).then_some(sigma))
}

/// Sets up options: three standard deviations, surfaces flat to 5 mm, planes of 0.3 % of the measurements
/// and of 25 at least, at any distance.
///
/// @param options The struct.
/// @param size    sizeof *options.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_planes_options_init(options: *mut ptzcal_planes_options, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(options, size) })
}

/// Finds the planes of a cloud of points, in the frame of the station that measured them.
///
/// @param xyz     n x 3 numbers: points, metres; they may be infinite or NaN: those are passed over.
/// @param n       Number of points.
/// @param sigma   Standard deviation of the points in each direction, metres; 0: estimated from
///                neighbours.
/// @param options The options; may be NULL: the defaults.
/// @param planes  Receives the planes; free them with ptzcal_planes_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NOT_FOUND when there is no plane;
///         PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_DEGENERATE
///         when sigma cannot be estimated.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_planes_find_points(
    xyz: *const f64,
    n: usize,
    sigma: f64,
    options: *const ptzcal_planes_options,
    planes: *mut *mut ptzcal_planes,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (planes, points, options) =
            unsafe { (HandleOut::new(planes)?, points_in(xyz, n)?, ptzcal_planes_options::settings(options)?) };
        planes.give(ptzcal_planes(find_planes_in_points(points, sigma_in(sigma)?, &options)?));
        Ok(())
    })
}

/// Finds the planes of a cloud of points that a scanner at the origin measured by their ranges: the noise is
/// along the rays, so that a slanted wall is known better than from points with the same noise in all
/// directions.
///
/// @param xyz     n x 3 numbers: points, metres; they may be infinite or NaN: those are passed over.
/// @param n       Number of points.
/// @param sigma   Standard deviation of the ranges, metres, more than 0.
/// @param options The options; may be NULL: the defaults.
/// @param planes  Receives the planes; free them with ptzcal_planes_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NOT_FOUND when there is no plane;
///         PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_planes_find_ranges(
    xyz: *const f64,
    n: usize,
    sigma: f64,
    options: *const ptzcal_planes_options,
    planes: *mut *mut ptzcal_planes,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (planes, points, options) =
            unsafe { (HandleOut::new(planes)?, points_in(xyz, n)?, ptzcal_planes_options::settings(options)?) };
        let shots = shots_of_ranges(points, number(sigma, "sigma")?)?;
        planes.give(ptzcal_planes(find_planes_in_shots(&shots, &options)?));
        Ok(())
    })
}

/// Finds the planes of laser shots, in the rig's frame. Spots at or beyond infinity are passed over.
///
/// @param model           The rig model.
/// @param pan_tilt        n x 2 numbers: readings at each shot, radians.
/// @param spots           n x 2 numbers: the spot's pixel in the head camera.
/// @param spot_covariance n x 3 numbers: xx, xy, yy, px^2; may be NULL: 1 px, uncorrelated.
/// @param n               Number of shots.
/// @param options         The options; may be NULL: the defaults.
/// @param planes          Receives the planes; free them with ptzcal_planes_free.
/// @param error           Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NOT_FOUND when there is no plane;
///         PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_planes_find_shots(
    model: *const ptzcal_rig_model,
    pan_tilt: *const f64,
    spots: *const f64,
    spot_covariance: *const f64,
    n: usize,
    options: *const ptzcal_planes_options,
    planes: *mut *mut ptzcal_planes,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (planes, options) = unsafe { (HandleOut::new(planes)?, ptzcal_planes_options::settings(options)?) };
        // SAFETY: the caller keeps the header's rules for pointers.
        let shots = unsafe { shots_in(&model_in(model)?, pan_tilt, spots, spot_covariance, n)? };
        planes.give(ptzcal_planes(find_planes_in_shots(&shots, &options)?));
        Ok(())
    })
}

/// Finds the planes of a depth map, in the camera's frame. The camera's pose plays no part. The labels
/// (ptzcal_planes_copy_labels) are the pixels', row by row.
///
/// @param map                 The depths.
/// @param camera              The camera that they are of.
/// @param inverse_depth_sigma Standard deviation of inverse depths, 1/m: for cameras that triangulate.
/// @param depth_sigma         Standard deviation of depths besides, metres.
/// @param options             The options; may be NULL: the defaults.
/// @param planes              Receives the planes; free them with ptzcal_planes_free.
/// @param error               Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NOT_FOUND when there is no plane;
///         PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_planes_find_depths(
    map: *const ptzcal_depth_map,
    camera: *const ptzcal_camera,
    inverse_depth_sigma: f64,
    depth_sigma: f64,
    options: *const ptzcal_planes_options,
    planes: *mut *mut ptzcal_planes,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (planes, map, camera, options) = unsafe {
            (HandleOut::new(planes)?, borrow(map)?, camera_in(camera)?, ptzcal_planes_options::settings(options)?)
        };
        let noise = DepthNoise {
            inverse_depth: number(inverse_depth_sigma, "inverse_depth_sigma")?,
            depth: number(depth_sigma, "depth_sigma")?,
        };
        let shots = shots_of_depth_map(&map.0, &camera, &noise)?;
        planes.give(ptzcal_planes(find_planes_in_shots(&shots, &options)?));
        Ok(())
    })
}

/// Frees planes.
///
/// @param planes The planes; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_planes_free(planes: *mut ptzcal_planes) {
    // SAFETY: NULL or a live handle that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(planes) });
}

/// How many planes there are.
///
/// @param planes The planes.
/// @param count  Receives their number.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_planes_count(
    planes: *const ptzcal_planes,
    count: *mut u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (planes, count) = unsafe { (borrow(planes)?, Out::new(count, "count")?) };
        count.write(planes.0.planes.len() as u32);
        Ok(())
    })
}

/// Sets up a plane: all zero.
///
/// @param plane The struct.
/// @param size  sizeof *plane.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_plane_init(plane: *mut ptzcal_plane, size: usize) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard(ErrorOut::none(), || unsafe { sized::init(plane, size) })
}

/// One plane: those that were found come the most significant first, those of regions in their order.
///
/// @param planes The planes.
/// @param index  Which one, from 0.
/// @param plane  Receives the plane; set up by ptzcal_plane_init.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for an index that is none.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_planes_get(
    planes: *const ptzcal_planes,
    index: u32,
    plane: *mut ptzcal_plane,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (planes, plane) = unsafe { (borrow(planes)?, SizedOut::new(plane)?) };
        let found = planes.0.planes.get(index as usize);
        let found = found.ok_or_else(|| Error::invalid("index", format!("{index} of {}", planes.0.planes.len())))?;
        plane.write(&found.into());
        Ok(())
    })
}

/// Copies the plane of each measurement (point, shot or pixel) that was handed in: its number, or -1.
///
/// @param planes   The planes.
/// @param buffer   Receives the numbers; may be NULL when capacity is 0.
/// @param capacity Numbers that fit.
/// @param needed   Receives the number of measurements; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: nothing was copied.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_planes_copy_labels(
    planes: *const ptzcal_planes,
    buffer: *mut i32,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (planes, buffer) = unsafe { (borrow(planes)?, BufferOut::new(buffer, capacity, needed)?) };
        buffer.write(&planes.0.labels.iter().map(|l| l.map_or(-1, i32::from)).collect::<Vec<_>>())
    })
}

/// The standard deviation of the points, metres: as stated, or as estimated; 0 for shots and depths,
/// which have each their own.
///
/// @param planes The planes.
/// @param sigma  Receives the standard deviation.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_planes_sigma(
    planes: *const ptzcal_planes,
    sigma: *mut f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (planes, sigma) = unsafe { (borrow(planes)?, Out::new(sigma, "sigma")?) };
        sigma.write(planes.0.sigma);
        Ok(())
    })
}
