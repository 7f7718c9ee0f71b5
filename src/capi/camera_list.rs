//! Cameras in files of other programs
//!
//! One entry for all formats: ptzcal_camera_read and ptzcal_camera_write for one camera, a list with names
//! for the formats that hold several. A file is read whole or refused, with its line and key in the
//! message; what a format cannot hold (skew, the division model, k3 in Kalibr's) is refused with
//! PTZCAL_STATUS_UNSUPPORTED, never rounded to what it can.

use std::ffi::{CString, c_char};

use super::args::{Out, string_optional};
use super::call::{ErrorOut, guard, guard_or};
use super::camera::{camera_in, ptzcal_camera};
use super::error::{c_string, ptzcal_error};
use super::file::path;
use super::handle::{Exclusive, Handle, HandleOut, borrow, borrow_optional, free};
use super::sized::SizedOut;
use super::status::ptzcal_status;
use crate::error::{Error, Result};
use crate::format::{CameraFormat, NamedCamera, read_cameras, write_cameras};

/// File formats of cameras. The lens is told by its own keys in each; all numbers are pixels, metres
/// and radians, as everywhere, whatever the format's own origin of pixels is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ptzcal_camera_format {
    /// Reading: the file's content tells. Writing: the ending does: .json our own, .yaml and .yml OpenCV's,
    /// .xml OpenCV's, .cameramodel mrcal's.
    Auto = 0,
    /// Our own, to the last bit. One camera.
    Json = 1,
    /// OpenCV's FileStorage, with the keys of its calibration sample and the pose in two keys of our
    /// own. One camera.
    OpencvYaml = 2,
    /// The same as XML.
    OpencvXml = 3,
    /// The same as JSON.
    OpencvJson = 4,
    /// ROS's camera_info: lens and name of one camera. It has no pose.
    Ros = 5,
    /// The folder of a COLMAP model as text. Any number of cameras, an image each.
    Colmap = 6,
    /// mrcal's .cameramodel. One camera.
    Mrcal = 7,
    /// Kalibr's camchain. Any number of cameras; the world is the first one's frame.
    Kalibr = 8,
}

/// The caller's format; `None` for AUTO.
fn format_in(value: u32) -> Result<Option<CameraFormat>> {
    if value == ptzcal_camera_format::Auto as u32 {
        return Ok(None);
    }
    let found = CameraFormat::ALL.into_iter().find(|f| number_of(*f) as u32 == value);
    found.map(Some).ok_or_else(|| Error::invalid("format", format!("{value} is no format of cameras")))
}

fn number_of(format: CameraFormat) -> ptzcal_camera_format {
    match format {
        CameraFormat::Json => ptzcal_camera_format::Json,
        CameraFormat::OpenCvYaml => ptzcal_camera_format::OpencvYaml,
        CameraFormat::OpenCvXml => ptzcal_camera_format::OpencvXml,
        CameraFormat::OpenCvJson => ptzcal_camera_format::OpencvJson,
        CameraFormat::Ros => ptzcal_camera_format::Ros,
        CameraFormat::Colmap => ptzcal_camera_format::Colmap,
        CameraFormat::Mrcal => ptzcal_camera_format::Mrcal,
        CameraFormat::Kalibr => ptzcal_camera_format::Kalibr,
    }
}

/// Cameras with names.
pub struct ptzcal_camera_list(Exclusive<List>);

impl Handle for ptzcal_camera_list {
    const NAME: &'static str = "list";
}

#[derive(Default)]
struct List {
    format: Option<CameraFormat>,
    cameras: Vec<NamedCamera>,
    /// What C borrows.
    names: Vec<CString>,
}

impl List {
    fn add(&mut self, camera: NamedCamera) {
        self.names.push(c_string(&camera.name));
        self.cameras.push(camera);
    }
}

/// Reads the one camera of a file.
///
/// @param path   The file; of COLMAP its folder.
/// @param format A ptzcal_camera_format.
/// @param camera Receives the camera; set up by ptzcal_camera_init. Its pose is the identity when the
///               file has none.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT (the message names the line
///         and the key); PTZCAL_STATUS_FILE_VERSION; PTZCAL_STATUS_UNSUPPORTED for a lens that this
///         library does not have; PTZCAL_STATUS_AMBIGUOUS for a file with several cameras.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_camera_read(
    path: *const c_char,
    format: u32,
    camera: *mut ptzcal_camera,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (path, camera) = unsafe { (self::path(path)?, SizedOut::new(camera)?) };
        let (_, cameras) = read_cameras(&path, format_in(format)?)?;
        match &cameras[..] {
            [one] => camera.write(&(&one.camera).into()),
            _ => {
                let reason = format!("{} holds {} cameras: read them as a list", path.display(), cameras.len());
                return Err(Error::Ambiguous { reason });
            }
        }
        Ok(())
    })
}

/// Writes one camera. The file is at every moment the old one or the whole new one.
///
/// @param camera The camera.
/// @param path   The file; of COLMAP its folder, which is made where it is not there.
/// @param format A ptzcal_camera_format.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_DISK_FULL; PTZCAL_STATUS_UNSUPPORTED for
///         what the format cannot hold; PTZCAL_STATUS_INVALID_ARGUMENT.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_camera_write(
    camera: *const ptzcal_camera,
    path: *const c_char,
    format: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (camera, path) = unsafe { (camera_in(camera)?, self::path(path)?) };
        write_cameras(&path, &[NamedCamera::new("", camera)], format_in(format)?)
    })
}

/// Makes an empty list.
///
/// @param list  Receives the list; free it with ptzcal_camera_list_free.
/// @param error Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_camera_list_new(
    list: *mut *mut ptzcal_camera_list,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        unsafe { HandleOut::new(list)? }.give(ptzcal_camera_list(Exclusive::new(List::default())));
        Ok(())
    })
}

/// Frees a list.
///
/// @param list The list; may be NULL: nothing happens.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_camera_list_free(list: *mut ptzcal_camera_list) {
    // SAFETY: NULL or a live list that nobody uses any more, as the header demands.
    guard_or((), || unsafe { free(list) });
}

/// Adds a camera with its pose.
///
/// @param list   The list.
/// @param camera The camera.
/// @param name   What files call it; may be NULL: it has no name.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
///
/// Threads: exclusive.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_camera_list_add(
    list: *mut ptzcal_camera_list,
    camera: *const ptzcal_camera,
    name: *const c_char,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (list, camera, name) = unsafe { (borrow(list)?, camera_in(camera)?, string_optional(name, "name")?) };
        list.0.write(ptzcal_camera_list::NAME)?.add(NamedCamera::new(name.unwrap_or_default(), camera));
        Ok(())
    })
}

/// Reads all cameras of a file.
///
/// @param path   The file; of COLMAP its folder.
/// @param format A ptzcal_camera_format.
/// @param list   Receives the list; free it with ptzcal_camera_list_free.
/// @param error  Receives the error; may be NULL.
/// @return As ptzcal_camera_read, for any number of cameras.
///
/// Threads: free.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_camera_list_read(
    path: *const c_char,
    format: u32,
    list: *mut *mut ptzcal_camera_list,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (out, path) = unsafe { (HandleOut::new(list)?, self::path(path)?) };
        let (format, cameras) = read_cameras(&path, format_in(format)?)?;
        let mut list = List { format: Some(format), ..List::default() };
        cameras.into_iter().for_each(|camera| list.add(camera));
        out.give(ptzcal_camera_list(Exclusive::new(list)));
        Ok(())
    })
}

/// Writes all cameras of a list into one file, or COLMAP's folder. COLMAP calls an image without a name
/// camera0, camera1, ...; names of its images have no white space.
///
/// @param list   The list.
/// @param path   The file; of COLMAP its folder, which is made where it is not there.
/// @param format A ptzcal_camera_format.
/// @param error  Receives the error; may be NULL.
/// @return As ptzcal_camera_write (index: the camera); PTZCAL_STATUS_INVALID_ARGUMENT for an empty list
///         and for several cameras in a format that holds one; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_camera_list_write(
    list: *const ptzcal_camera_list,
    path: *const c_char,
    format: u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (list, path) = unsafe { (borrow(list)?, self::path(path)?) };
        write_cameras(&path, &list.0.read(ptzcal_camera_list::NAME)?.cameras, format_in(format)?)
    })
}

/// How many cameras a list has, and the format that it was read from.
///
/// @param list   The list.
/// @param count  Receives the number.
/// @param format Receives the ptzcal_camera_format, PTZCAL_CAMERA_FORMAT_AUTO for a list that was not
///               read from a file; may be NULL.
/// @param error  Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_camera_list_count(
    list: *const ptzcal_camera_list,
    count: *mut usize,
    format: *mut u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (list, count, format) =
            unsafe { (borrow(list)?, Out::new(count, "count")?, Out::optional(format, "format")?) };
        let list = list.0.read(ptzcal_camera_list::NAME)?;
        count.write(list.cameras.len());
        if let Some(format) = format {
            format.write(list.format.map_or(ptzcal_camera_format::Auto, number_of) as u32);
        }
        Ok(())
    })
}

/// A camera of a list.
///
/// @param list     The list.
/// @param index    The camera, from 0.
/// @param camera   Receives the camera; set up by ptzcal_camera_init.
/// @param has_pose Receives 0 when the file did not say where the camera is, so that its pose is the
///                 identity and means nothing, otherwise 1; may be NULL.
/// @param error    Receives the error; may be NULL.
/// @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for no such camera; PTZCAL_STATUS_BUSY.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_camera_list_get(
    list: *const ptzcal_camera_list,
    index: usize,
    camera: *mut ptzcal_camera,
    has_pose: *mut u32,
    error: *mut *mut ptzcal_error,
) -> ptzcal_status {
    // SAFETY: the caller keeps the header's rules for pointers.
    let error = unsafe { ErrorOut::new(error) };
    guard(error, || {
        // SAFETY: the caller keeps the header's rules for pointers.
        let (list, camera, has_pose) =
            unsafe { (borrow(list)?, SizedOut::new(camera)?, Out::optional(has_pose, "has_pose")?) };
        let list = list.0.read(ptzcal_camera_list::NAME)?;
        let none = || Error::invalid("index", format!("{index}, the list has {} cameras", list.cameras.len()));
        let found = list.cameras.get(index).ok_or_else(none)?;
        camera.write(&(&found.camera).into());
        if let Some(has_pose) = has_pose {
            has_pose.write(found.has_pose.into());
        }
        Ok(())
    })
}

/// Name of a camera of a list.
///
/// @param list  The list; may be NULL.
/// @param index The camera, from 0.
/// @return A string that lives as long as the list; "" when the camera has no name or is not there;
///         never NULL.
///
/// Threads: shared.
/// Since 0.1.0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ptzcal_camera_list_name(list: *const ptzcal_camera_list, index: usize) -> *const c_char {
    guard_or(c"".as_ptr(), || {
        // SAFETY: NULL or a live list, as the header demands.
        let list = unsafe { borrow_optional(list) };
        let list = list.and_then(|l| l.0.read(ptzcal_camera_list::NAME).ok());
        // The characters stay where they are when the list grows.
        list.and_then(|l| l.names.get(index).map(|name| name.as_ptr())).unwrap_or(c"".as_ptr())
    })
}
