//! Files
//!
//! Calibrations, cameras, tables of points and clouds on disk. A file is written at once or not at all: on an error the old one, if
//! there was one, is still there.

use std::ffi::c_char;
use std::path::PathBuf;

use super::args::{Out, string};
use super::calibrate::ptzcal_calibration;
use super::calibration_options::ptzcal_calibration_options;
use super::call::{ErrorOut, guard};
use super::camera::{camera_in, ptzcal_camera};
use super::correspondences::ptzcal_correspondences;
use super::error::ptzcal_error;
use super::handle::{Exclusive, Handle, HandleOut, borrow};
use super::scan::ptzcal_scan;
use super::sized::SizedOut;
use super::status::ptzcal_status;
use crate::calibrate::{Observation, inputs_of, inputs_record};
use crate::error::Result;
use crate::format::{
    CameraRecord, ObservationRecord, OpenCvCamera, read_camera, read_correspondences_csv, read_opencv, write_camera,
    write_correspondences_csv, write_opencv_yaml, write_ply,
};

/// # Safety
/// As for [`string`].
pub(super) unsafe fn path(ptr: *const c_char) -> Result<PathBuf> {
    // SAFETY: by this function's contract.
    Ok(PathBuf::from(unsafe { string(ptr, "path")? }))
}

/// Writes a calibration as JSON: the camera, its covariance, the residuals and what else it says of
/// itself, every number to its last bit; of ptzcal_calibrate_camera also the measurements and options that
/// it was made from, so that ptzcal_calibration_load_inputs can solve it again.
///
/// @param calibration The calibration.
/// @param path        The file.
/// @param error       Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_save(
    calibration: *const ptzcal_calibration,
    path: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (calibration, path) = unsafe { (borrow(calibration)?, self::path(path)?) };
        let inputs = calibration.inputs.as_ref().map(|(set, options)| inputs_record(set, options));
        write_camera(&path, &calibration.answer.record(inputs))
    })
}

/// Writes a camera alone as JSON.
///
/// @param camera The camera.
/// @param path   The file.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_camera_save(
    camera: *const ptzcal_camera,
    path: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (camera, path) = unsafe { (camera_in(camera)?, self::path(path)?) };
        write_camera(&path, &CameraRecord { camera, calibration: None })
    })
}

/// Reads the camera of a file written by ptzcal_camera_save or ptzcal_calibration_save.
///
/// @param path   The file.
/// @param camera Receives the camera; set up by ptzcal_camera_init.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT (the message names the
///         key or the line); PTZCAL_STATUS_FILE_VERSION.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_camera_load(
    path: *const c_char,
    camera: *mut ptzcal_camera,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (path, camera) = unsafe { (self::path(path)?, SizedOut::new(camera)?) };
        camera.write(&(&read_camera(&path)?.camera).into());
        Ok(())
    })
}

/// Writes a camera as OpenCV's YAML, with the pose in keys of our own.
///
/// @param camera The camera: without skew, with no lens model or Brown-Conrady.
/// @param path   The file.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_UNSUPPORTED for what OpenCV's file
///         cannot hold.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_camera_save_opencv(
    camera: *const ptzcal_camera,
    path: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (camera, path) = unsafe { (camera_in(camera)?, self::path(path)?) };
        write_opencv_yaml(&path, &OpenCvCamera { camera, rms: None })
    })
}

/// Reads a camera from OpenCV's YAML, XML or JSON. Without our keys its pose is the identity.
///
/// @param path   The file.
/// @param camera Receives the camera; set up by ptzcal_camera_init.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT;
///         PTZCAL_STATUS_UNSUPPORTED for lens models that this library does not have.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_camera_load_opencv(
    path: *const c_char,
    camera: *mut ptzcal_camera,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (path, camera) = unsafe { (self::path(path)?, SizedOut::new(camera)?) };
        camera.write(&(&read_opencv(&path)?.camera).into());
        Ok(())
    })
}

/// Reads what a calibration was made from, out of a file of ptzcal_calibration_save. With the same version
/// of the library on the same kind of machine ptzcal_calibrate_camera makes the same calibration of it, to
/// the last bit.
///
/// @param path    The file.
/// @param set     Receives the measurements; free them with ptzcal_correspondences_free.
/// @param options Receives the options; free them with ptzcal_calibration_options_free.
/// @param error   Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT; PTZCAL_STATUS_FILE_VERSION;
///         PTZCAL_STATUS_NOT_FOUND for a camera without them; PTZCAL_STATUS_INVALID_ARGUMENT for
///         measurements or options that are none.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_calibration_load_inputs(
    path: *const c_char,
    set: *mut *mut ptzcal_correspondences,
    options: *mut *mut ptzcal_calibration_options,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (set, options, path) = unsafe { (HandleOut::new(set)?, HandleOut::new(options)?, self::path(path)?) };
        let (measurements, settings) = inputs_of(&read_camera(&path)?)?;
        set.give(ptzcal_correspondences(Exclusive::new(measurements)));
        options.give(ptzcal_calibration_options(Exclusive::new(settings)));
        Ok(())
    })
}

/// Adds the points of a table of comma-separated values, all or none. Its first line names the columns, in
/// any order: x y z (metres, world) and u v (pixels). Optional: sigma_x sigma_y sigma_z (m), or cov_xx
/// cov_xy cov_xz cov_yy cov_yz cov_zz (m^2); sigma_u sigma_v (px), or cov_uu cov_uv cov_vv (px^2), each
/// group empty where a point has none; name and comment, which are passed over. So are lines that begin
/// with #. The last line has its end, or the file was cut short.
///
/// @param set   The set.
/// @param path  The file.
/// @param added Receives the number of points; may be NULL.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT (the message names the line
///         and the column); PTZCAL_STATUS_INVALID_ARGUMENT for a covariance that is none;
///         PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_correspondences_add_csv(
    set: *mut ptzcal_correspondences,
    path: *const c_char,
    added: *mut usize,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (set, path, added) = unsafe { (borrow(set)?, self::path(path)?, Out::optional(added, "added")?) };
        let points = read_correspondences_csv(&path)?;
        let count = points.len();
        set.0.write(ptzcal_correspondences::NAME)?.add_all(points.into_iter().map(Observation::from))?;
        if let Some(added) = added {
            added.write(count);
        }
        Ok(())
    })
}

/// Writes the points of a set as a table of comma-separated values, every number to its last bit: see
/// ptzcal_correspondences_add_csv.
///
/// @param set   The set, of points only.
/// @param path  The file.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_DISK_FULL; PTZCAL_STATUS_UNSUPPORTED for
///         laser shots and lines, which are no points (ptzcal_calibration_save writes all kinds);
///         PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_correspondences_save_csv(
    set: *const ptzcal_correspondences,
    path: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (set, path) = unsafe { (borrow(set)?, self::path(path)?) };
        let set = set.0.read(ptzcal_correspondences::NAME)?;
        let points: Vec<ObservationRecord> = set.observations().iter().map(ObservationRecord::from).collect();
        write_correspondences_csv(&path, &points)
    })
}

/// Writes the measured points of a scan as binary PLY, with their colours and covariances:
/// ptzcal_cloud_from_scan and ptzcal_cloud_save in one.
///
/// @param scan  The scan.
/// @param path  The file.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_scan_save_ply(
    scan: *const ptzcal_scan,
    path: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (scan, path) = unsafe { (borrow(scan)?, self::path(path)?) };
        write_ply(&path, &scan.0.cloud())
    })
}
