//! What is in a cloud
//!
//! Its numbers, its files, and what a camera sees of it.

use std::ffi::c_char;

use super::args::{BufferOut, Out};
use super::call::{ErrorOut, guard};
use super::camera::{camera_in, ptzcal_camera};
use super::cloud::ptzcal_cloud;
use super::depth::ptzcal_depth_map;
use super::error::ptzcal_error;
use super::file::path as path_in;
use super::handle::{Handle, HandleOut, borrow};
use super::status::ptzcal_status;
use crate::cloud::{CloudNoise, cloud_depth};
use crate::error::{Error, Result};
use crate::format::{CloudFile, read_cloud, write_cloud};

fn unknown(what: &str) -> Error {
    Error::BadState { reason: format!("the {what} of this cloud are not known") }
}

/// Copies the points: n x 3 numbers, x, y, z, metres.
///
/// @param cloud    The cloud.
/// @param buffer   Receives the numbers; may be NULL when `capacity` is 0.
/// @param capacity Numbers that fit into `buffer`.
/// @param needed   Receives how many numbers there are; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cloud_copy_points(
    cloud: *const ptzcal_cloud,
    buffer: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (cloud, out) = unsafe { (borrow(cloud)?, BufferOut::new(buffer, capacity, needed)?) };
        let cloud = cloud.0.read(ptzcal_cloud::NAME)?;
        out.write(&cloud.positions.iter().flatten().copied().collect::<Vec<f64>>())
    })
}

/// Copies the colours: n x 3 bytes, red, green, blue.
///
/// @param cloud    The cloud.
/// @param buffer   Receives the bytes; may be NULL when `capacity` is 0.
/// @param capacity Bytes that fit into `buffer`.
/// @param needed   Receives how many bytes there are; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cloud_copy_colours(
    cloud: *const ptzcal_cloud,
    buffer: *mut u8,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (cloud, out) = unsafe { (borrow(cloud)?, BufferOut::new(buffer, capacity, needed)?) };
        out.write(cloud.0.read(ptzcal_cloud::NAME)?.colours.as_flattened())
    })
}

/// Copies the normals: n x 3 numbers, unit vectors out of the surface, zeros where there is none.
///
/// @param cloud    The cloud.
/// @param buffer   Receives the numbers; may be NULL when `capacity` is 0.
/// @param capacity Numbers that fit into `buffer`.
/// @param needed   Receives how many numbers there are; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BAD_STATE for a cloud without
///         normals; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cloud_copy_normals(
    cloud: *const ptzcal_cloud,
    buffer: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (cloud, out) = unsafe { (borrow(cloud)?, BufferOut::new(buffer, capacity, needed)?) };
        let cloud = cloud.0.read(ptzcal_cloud::NAME)?;
        let normals = cloud.normals.as_ref().ok_or_else(|| unknown("normals"))?;
        out.write(&normals.iter().flatten().copied().collect::<Vec<f64>>())
    })
}

/// Copies the standard deviations: n numbers, metres, the root mean square distance of each point from
/// its truth, which is the root of its covariance's trace.
///
/// @param cloud    The cloud.
/// @param buffer   Receives the numbers; may be NULL when `capacity` is 0.
/// @param capacity Numbers that fit into `buffer`.
/// @param needed   Receives how many numbers there are; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BAD_STATE where the noise is
///         unknown; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cloud_copy_deviations(
    cloud: *const ptzcal_cloud,
    buffer: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (cloud, out) = unsafe { (borrow(cloud)?, BufferOut::new(buffer, capacity, needed)?) };
        let cloud = cloud.0.read(ptzcal_cloud::NAME)?;
        let deviations: Option<Vec<f64>> = (0..cloud.len()).map(|i| cloud.noise.deviation(i)).collect();
        out.write(&deviations.filter(|_| cloud.noise != CloudNoise::Unknown).ok_or_else(|| unknown("deviations"))?)
    })
}

/// Copies the covariances: n x 6 numbers, xx, xy, xz, yy, yz, zz, m^2.
///
/// @param cloud    The cloud.
/// @param buffer   Receives the numbers; may be NULL when `capacity` is 0.
/// @param capacity Numbers that fit into `buffer`.
/// @param needed   Receives how many numbers there are; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BAD_STATE where they are
///         unknown; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cloud_copy_covariances(
    cloud: *const ptzcal_cloud,
    buffer: *mut f64,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (cloud, out) = unsafe { (borrow(cloud)?, BufferOut::new(buffer, capacity, needed)?) };
        match &cloud.0.read(ptzcal_cloud::NAME)?.noise {
            CloudNoise::Covariances(c) => out.write(c.as_flattened()),
            _ => Err(unknown("covariances")),
        }
    })
}

/// Writes a cloud, in the format that the file's ending names: .ply, .pcd (both binary, with normals and
/// noise), .glb (glTF 2.0, with normals and noise) or .wrl (VRML97).
///
/// @param cloud The cloud.
/// @param path  The file.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNSUPPORTED for another ending; PTZCAL_STATUS_FILE_IO;
///         PTZCAL_STATUS_DISK_FULL; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cloud_save(
    cloud: *const ptzcal_cloud,
    path: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (cloud, path) = unsafe { (borrow(cloud)?, path_in(path)?) };
        write_cloud(&path, &*cloud.0.read(ptzcal_cloud::NAME)?)
    })
}

/// Reads a cloud: .ply, .pcd, .glb or .wrl, ours or another's; of a mesh its vertices.
///
/// @param path    The file.
/// @param cloud   Receives the cloud; free it with ptzcal_cloud_free.
/// @param skipped Receives how many points were left out because a coordinate is NaN or infinite, as
///                depth cameras mark what they did not measure; may be NULL.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNSUPPORTED for another ending, and for more than 50,000,000
///         points; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT; PTZCAL_STATUS_FILE_VERSION.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cloud_load(
    path: *const c_char,
    cloud: *mut *mut ptzcal_cloud,
    skipped: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || -> Result<()> {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, path, left_out) =
            unsafe { (HandleOut::new(cloud)?, path_in(path)?, Out::optional(skipped, "skipped")?) };
        let CloudFile { cloud, skipped } = read_cloud(&path)?;
        if let Some(left_out) = left_out {
            left_out.write(skipped);
        }
        out.give(cloud.into());
        Ok(())
    })
}

/// Depths of the points in a camera's image, lens distortion included: the nearest one in each pixel,
/// with its variance where the noise is known. Between the points there is no depth; a surface
/// (ptzcal_mesh_depth_map) has no gaps.
///
/// @param cloud  The cloud.
/// @param camera The camera, of at most 2^25 pixels.
/// @param map    Receives the map; free it with ptzcal_depth_map_free.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_cloud_depth_map(
    cloud: *const ptzcal_cloud,
    camera: *const ptzcal_camera,
    map: *mut *mut ptzcal_depth_map,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (map, cloud, camera) = unsafe { (HandleOut::new(map)?, borrow(cloud)?, camera_in(camera)?) };
        let seen = cloud_depth(&*cloud.0.read(ptzcal_cloud::NAME)?, &camera)?;
        map.give(seen.into());
        Ok(())
    })
}
