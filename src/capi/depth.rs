//! Depth maps
//!
//! For every pixel of a camera the depth along its optical axis: as depth cameras give it, registered
//! to their colour image, or as a cloud or mesh has it (ptzcal_cloud_depth_map, ptzcal_mesh_depth_map).
//! The map is a copy: the caller's memory is free after the call.

use std::ffi::c_char;
use std::path::Path;

use super::args::{BufferOut, Out, PTZCAL_MAX_COUNT, Plain, array, number, string};
use super::call::{ErrorOut, guard, guard_or};
use super::error::ptzcal_error;
use super::handle::{Handle, HandleOut, borrow, free};
use super::status::ptzcal_status;
use crate::cloud::DepthView;
use crate::error::{Error, Result};
use crate::format::{read_depth, write_depth};
use crate::image::DepthMap;

/// Depths of an image's pixels. Immutable: any number of threads may read it.
pub struct ptzcal_depth_map(pub(super) DepthMap, Option<Vec<f32>>);

impl From<DepthMap> for ptzcal_depth_map {
    fn from(map: DepthMap) -> Self {
        Self(map, None)
    }
}

impl From<DepthView> for ptzcal_depth_map {
    fn from(DepthView { map, variance }: DepthView) -> Self {
        Self(map, variance)
    }
}

impl Handle for ptzcal_depth_map {
    const NAME: &'static str = "depth map";
}

/// A map of the caller's values, whatever their type.
///
/// # Safety
/// As for [`array`], with as many values as [`count`] says.
unsafe fn of_values<T: Plain + Into<f64>>(
    values: *const T,
    [width, height]: [u32; 2],
    stride: usize,
    metres: f64,
) -> Result<ptzcal_depth_map> {
    // SAFETY: by this function's contract.
    let values = unsafe { array(values, count(width, height, stride)?, "values")? };
    let metres = positive(metres)?;
    // Without the padding.
    let rows = values.chunks(stride).flat_map(|row| row[..width as usize].iter());
    let depths = rows.map(|z| ((*z).into() * metres) as f32).collect();
    Ok(DepthMap::new(width, height, depths)?.into())
}

/// Values that a map of this size takes; refuses strides that are too short.
fn count(width: u32, height: u32, stride: usize) -> Result<usize> {
    if width == 0 || height == 0 {
        return Err(Error::invalid("depth", format!("{width} x {height} pixels")));
    }
    if stride < width as usize || stride > PTZCAL_MAX_COUNT {
        return Err(Error::invalid("stride", format!("{stride} for rows of {width}")));
    }
    let count = stride.checked_mul(height as usize - 1).and_then(|n| n.checked_add(width as usize));
    count
        .filter(|n| *n <= PTZCAL_MAX_COUNT)
        .ok_or_else(|| Error::invalid("depth", format!("{width} x {height} pixels with stride {stride}")))
}

fn positive(metres: f64) -> Result<f64> {
    let metres = number(metres, "metres")?;
    if metres > 0.0 { Ok(metres) } else { Err(Error::invalid("metres", format!("{metres} per unit"))) }
}

/// Makes a depth map of 16-bit values, as most depth cameras give; 0 is no depth.
///
/// @param values Rows from the top, `stride` values apart.
/// @param width  Pixels.
/// @param height Pixels.
/// @param stride Values from a row to the next, at least `width`.
/// @param metres Metres per unit: 0.001 for millimetres.
/// @param map    Receives the map; free it with ptzcal_depth_map_free.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_depth_map_new_u16(
    values: *const u16,
    width: u32,
    height: u32,
    stride: usize,
    metres: f64,
    map: *mut *mut ptzcal_depth_map,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (map, made) = unsafe { (HandleOut::new(map)?, of_values(values, [width, height], stride, metres)?) };
        map.give(made);
        Ok(())
    })
}

/// Makes a depth map of floats; what is not a positive number (0, negative, NaN, infinite) is no depth.
///
/// @param values Rows from the top, `stride` values apart.
/// @param width  Pixels.
/// @param height Pixels.
/// @param stride Values from a row to the next, at least `width`.
/// @param metres Metres per unit: 1 for metres.
/// @param map    Receives the map; free it with ptzcal_depth_map_free.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE for `metres`.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_depth_map_new_f32(
    values: *const f32,
    width: u32,
    height: u32,
    stride: usize,
    metres: f64,
    map: *mut *mut ptzcal_depth_map,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (map, made) = unsafe { (HandleOut::new(map)?, of_values(values, [width, height], stride, metres)?) };
        map.give(made);
        Ok(())
    })
}

/// Reads a depth map: a PNG or PGM with one channel of 16 bits; 0 is no depth.
///
/// @param path   The file.
/// @param metres Metres per unit: 0.001 for millimetres.
/// @param map    Receives the map; free it with ptzcal_depth_map_free.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT;
///         PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_depth_map_read(
    path: *const c_char,
    metres: f64,
    map: *mut *mut ptzcal_depth_map,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (map, path) = unsafe { (HandleOut::new(map)?, string(path, "path")?) };
        map.give(read_depth(Path::new(path), positive(metres)?)?.into());
        Ok(())
    })
}

/// Frees a depth map.
///
/// @param map The map; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_depth_map_free(map: *mut ptzcal_depth_map) {
    // SAFETY: the caller keeps the header's rules for pointers.
    guard_or((), || unsafe { free(map) })
}

/// Size of a depth map and how many of its pixels have a depth.
///
/// @param map    The map.
/// @param width  Receives the width, pixels; may be NULL.
/// @param height Receives the height, pixels; may be NULL.
/// @param known  Receives the number of pixels with a depth; may be NULL.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_depth_map_size(
    map: *const ptzcal_depth_map,
    width: *mut u32,
    height: *mut u32,
    known: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (map, width, height, known) = unsafe {
            (
                borrow(map)?,
                Out::optional(width, "width")?,
                Out::optional(height, "height")?,
                Out::optional(known, "known")?,
            )
        };
        if let Some(width) = width {
            width.write(map.0.width() as u32);
        }
        if let Some(height) = height {
            height.write(map.0.height() as u32);
        }
        if let Some(known) = known {
            known.write(map.0.known());
        }
        Ok(())
    })
}

/// Copies the depths: width x height numbers, row by row, metres; 0 where there is none.
///
/// @param map      The map.
/// @param buffer   Receives the numbers; may be NULL when `capacity` is 0.
/// @param capacity Numbers that fit into `buffer`.
/// @param needed   Receives how many numbers there are; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_depth_map_copy_metres(
    map: *const ptzcal_depth_map,
    buffer: *mut f32,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (map, out) = unsafe { (borrow(map)?, BufferOut::new(buffer, capacity, needed)?) };
        out.write(map.0.metres())
    })
}

/// Copies the variances of a map that was made of a cloud or mesh: width x height numbers, row by row,
/// m^2; 0 where there is no depth.
///
/// @param map      The map.
/// @param buffer   Receives the numbers; may be NULL when `capacity` is 0.
/// @param capacity Numbers that fit into `buffer`.
/// @param needed   Receives how many numbers there are; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BAD_STATE where the noise is
///         unknown.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_depth_map_copy_variances(
    map: *const ptzcal_depth_map,
    buffer: *mut f32,
    capacity: usize,
    needed: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (map, out) = unsafe { (borrow(map)?, BufferOut::new(buffer, capacity, needed)?) };
        let unknown = || Error::BadState { reason: "the variances of this depth map are not known".into() };
        out.write(map.1.as_ref().ok_or_else(unknown)?)
    })
}

/// Writes a depth map as a PNG with one channel of 16 bits; 0 is no depth.
///
/// @param map    The map.
/// @param path   The file.
/// @param metres Metres per unit: 0.001 for millimetres, up to 65.535 m.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for units in which a depth is none, or too
///         large; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_DISK_FULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_depth_map_save(
    map: *const ptzcal_depth_map,
    path: *const c_char,
    metres: f64,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (map, path) = unsafe { (borrow(map)?, string(path, "path")?) };
        write_depth(Path::new(path), &map.0, positive(metres)?)
    })
}
