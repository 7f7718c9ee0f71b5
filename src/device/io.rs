//! What the operating system says of a device, as an error that tells what to do.

use std::io::{self, ErrorKind};

use crate::error::Error;

/// The error for a failed call on `device` (its path or host). Anything that says that the device is
/// no longer there is `DeviceLost`.
pub fn device_error(device: &str, error: &io::Error) -> Error {
    let (device, reason) = (device.to_owned(), error.to_string());
    match error.kind() {
        ErrorKind::NotFound
        | ErrorKind::ConnectionRefused
        | ErrorKind::HostUnreachable
        | ErrorKind::NetworkUnreachable
        | ErrorKind::AddrNotAvailable => Error::DeviceNotFound { device, reason },
        ErrorKind::PermissionDenied => Error::DevicePermission { device },
        ErrorKind::ResourceBusy | ErrorKind::AddrInUse => Error::DeviceBusy { device },
        ErrorKind::BrokenPipe
        | ErrorKind::ConnectionReset
        | ErrorKind::ConnectionAborted
        | ErrorKind::NotConnected
        | ErrorKind::UnexpectedEof => Error::DeviceLost { reason: format!("{device}: {reason}") },
        _ => match error.raw_os_error() {
            // EIO, ENXIO, ENODEV: unplugged.
            Some(5 | 6 | 19) => Error::DeviceLost { reason: format!("{device}: {reason}") },
            // ENOTTY, EINVAL: another kind of file.
            Some(25 | 22) => Error::DeviceMismatch { device, reason },
            _ => Error::Device { reason: format!("{device}: {reason}") },
        },
    }
}
