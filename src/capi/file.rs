//! Files
//!
//! Cameras and clouds on disk. A file is written at once or not at all: on an error the old one, if
//! there was one, is still there.

use std::ffi::c_char;
use std::path::PathBuf;

use super::args::string;
use super::calibrate::ptzcal_calibration;
use super::call::{ErrorOut, guard};
use super::camera::{camera_in, ptzcal_camera};
use super::error::ptzcal_error;
use super::handle::borrow;
use super::scan::ptzcal_scan;
use super::sized::SizedOut;
use super::status::ptzcal_status;
use crate::error::Result;
use crate::format::{
    CameraRecord, OpenCvCamera, read_camera, read_opencv_yaml, write_camera, write_opencv_yaml, write_ply,
};

/// # Safety
/// As for [`string`].
pub(super) unsafe fn path(ptr: *const c_char) -> Result<PathBuf> {
    // SAFETY: by this function's contract.
    Ok(PathBuf::from(unsafe { string(ptr, "path")? }))
}

/// Writes a calibration as JSON: the camera, its covariance, the residuals and what else it says of
/// itself, every number to its last bit.
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
        write_camera(&path, &calibration.answer.record())
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

/// Reads a camera from OpenCV's YAML. Without our keys its pose is the identity.
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
        camera.write(&(&read_opencv_yaml(&path)?.camera).into());
        Ok(())
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
