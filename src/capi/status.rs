//! Statuses
//!
//! What every function that can fail returns. 0 is success, everything else is negative and grouped
//! by who can do something about it. The numbers are pinned for ever; new ones may be added, so
//! treat an unknown negative number as a failure.

use std::ffi::{CStr, c_char};

use crate::error::Status;

/// Result of a call. The values never change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum ptzcal_status {
    /// Success: every output was written.
    Ok = 0,

    /// Argument: a value, size, format, enum or string is not acceptable; the message names it.
    InvalidArgument = -1,
    /// Argument: a pointer that must not be NULL is NULL; the message names it.
    NullPointer = -2,
    /// Argument: a number is NaN or infinite; the error's index says which.
    NotFinite = -3,
    /// Argument: a buffer is smaller than what it must hold; nothing was written to it.
    BufferTooSmall = -4,
    /// What was asked for is not in this library or this build, or needs a newer one.
    Unsupported = -5,
    /// Another thread is inside a call that has the handle for itself.
    Busy = -6,
    /// The handle's state does not allow the call; after a PANIC only its _free or _close does.
    BadState = -7,
    /// Argument: the address of a device has not the form that its kind demands; the message says where.
    InvalidAddress = -8,

    /// Data: too few measurements are usable.
    TooFewPoints = -100,
    /// Data: the geometry cannot determine the result (coplanar, collinear, ...); the hint says what to add.
    Degenerate = -101,
    /// Data: the solver did not converge.
    NoConvergence = -102,
    /// Data: too many measurements contradict each other.
    NoConsensus = -103,
    /// Data: the fitted lens would fold back inside the image.
    LensNotMonotone = -104,
    /// Data: a point lies behind the camera; the error's index says which.
    BehindCamera = -105,
    /// Data: the target cannot be reached by the head.
    Unreachable = -106,
    /// Data: a point has no image (or a pixel no ray) in the lens model; the error's index says which.
    OutsideLens = -107,

    /// Detection: there is no laser spot that stands out from the noise.
    NotFound = -200,
    /// Detection: more than one spot could be the laser's.
    Ambiguous = -201,

    /// Device: a device reported a failure.
    Device = -300,
    /// Device: the connection is gone.
    DeviceLost = -301,
    /// Device: no answer in time.
    DeviceTimeout = -302,
    /// Device: the laser stays off (emergency stop, head moving, ...).
    LaserRefused = -303,
    /// Device: there is no such device file, line or host, or nobody listens there.
    DeviceNotFound = -304,
    /// Device: this user may not open it.
    DevicePermission = -305,
    /// Device: another process holds it.
    DeviceBusy = -306,
    /// Device: something answers, and it is not what the address says.
    DeviceMismatch = -307,
    /// Device: bytes arrive that are no messages: another baud rate, or a bad line.
    DeviceGarbled = -308,
    /// Device: it understood, and refuses.
    DeviceRefused = -309,
    /// Device: it wants another user's name or password.
    Unauthorised = -310,

    /// File: reading or writing failed.
    FileIo = -400,
    /// File: the content is not what it should be.
    FileFormat = -401,
    /// File: written by a version that this library does not read.
    FileVersion = -402,
    /// File: it belongs to another rig, region or run.
    FileMismatch = -403,
    /// File: the disk is full.
    DiskFull = -404,

    /// Stopped by a ptzcal_cancel token or a progress callback.
    Cancelled = -500,

    /// A fault of the library; please report the message.
    Internal = -900,
    /// A fault of the library was caught; handles that were being changed can only be closed.
    Panic = -901,
}

impl ptzcal_status {
    const ALL: [(Self, &'static CStr); 38] = [
        (Self::Ok, c"PTZCAL_STATUS_OK"),
        (Self::InvalidArgument, c"PTZCAL_STATUS_INVALID_ARGUMENT"),
        (Self::NullPointer, c"PTZCAL_STATUS_NULL_POINTER"),
        (Self::NotFinite, c"PTZCAL_STATUS_NOT_FINITE"),
        (Self::BufferTooSmall, c"PTZCAL_STATUS_BUFFER_TOO_SMALL"),
        (Self::Unsupported, c"PTZCAL_STATUS_UNSUPPORTED"),
        (Self::Busy, c"PTZCAL_STATUS_BUSY"),
        (Self::BadState, c"PTZCAL_STATUS_BAD_STATE"),
        (Self::InvalidAddress, c"PTZCAL_STATUS_INVALID_ADDRESS"),
        (Self::TooFewPoints, c"PTZCAL_STATUS_TOO_FEW_POINTS"),
        (Self::Degenerate, c"PTZCAL_STATUS_DEGENERATE"),
        (Self::NoConvergence, c"PTZCAL_STATUS_NO_CONVERGENCE"),
        (Self::NoConsensus, c"PTZCAL_STATUS_NO_CONSENSUS"),
        (Self::LensNotMonotone, c"PTZCAL_STATUS_LENS_NOT_MONOTONE"),
        (Self::BehindCamera, c"PTZCAL_STATUS_BEHIND_CAMERA"),
        (Self::Unreachable, c"PTZCAL_STATUS_UNREACHABLE"),
        (Self::OutsideLens, c"PTZCAL_STATUS_OUTSIDE_LENS"),
        (Self::NotFound, c"PTZCAL_STATUS_NOT_FOUND"),
        (Self::Ambiguous, c"PTZCAL_STATUS_AMBIGUOUS"),
        (Self::Device, c"PTZCAL_STATUS_DEVICE"),
        (Self::DeviceLost, c"PTZCAL_STATUS_DEVICE_LOST"),
        (Self::DeviceTimeout, c"PTZCAL_STATUS_DEVICE_TIMEOUT"),
        (Self::LaserRefused, c"PTZCAL_STATUS_LASER_REFUSED"),
        (Self::DeviceNotFound, c"PTZCAL_STATUS_DEVICE_NOT_FOUND"),
        (Self::DevicePermission, c"PTZCAL_STATUS_DEVICE_PERMISSION"),
        (Self::DeviceBusy, c"PTZCAL_STATUS_DEVICE_BUSY"),
        (Self::DeviceMismatch, c"PTZCAL_STATUS_DEVICE_MISMATCH"),
        (Self::DeviceGarbled, c"PTZCAL_STATUS_DEVICE_GARBLED"),
        (Self::DeviceRefused, c"PTZCAL_STATUS_DEVICE_REFUSED"),
        (Self::Unauthorised, c"PTZCAL_STATUS_UNAUTHORISED"),
        (Self::FileIo, c"PTZCAL_STATUS_FILE_IO"),
        (Self::FileFormat, c"PTZCAL_STATUS_FILE_FORMAT"),
        (Self::FileVersion, c"PTZCAL_STATUS_FILE_VERSION"),
        (Self::FileMismatch, c"PTZCAL_STATUS_FILE_MISMATCH"),
        (Self::DiskFull, c"PTZCAL_STATUS_DISK_FULL"),
        (Self::Cancelled, c"PTZCAL_STATUS_CANCELLED"),
        (Self::Internal, c"PTZCAL_STATUS_INTERNAL"),
        (Self::Panic, c"PTZCAL_STATUS_PANIC"),
    ];
}

impl From<Status> for ptzcal_status {
    fn from(status: Status) -> Self {
        match status {
            Status::Ok => Self::Ok,
            Status::InvalidArgument => Self::InvalidArgument,
            Status::NullPointer => Self::NullPointer,
            Status::NotFinite => Self::NotFinite,
            Status::BufferTooSmall => Self::BufferTooSmall,
            Status::Unsupported => Self::Unsupported,
            Status::Busy => Self::Busy,
            Status::BadState => Self::BadState,
            Status::InvalidAddress => Self::InvalidAddress,
            Status::TooFewPoints => Self::TooFewPoints,
            Status::Degenerate => Self::Degenerate,
            Status::NoConvergence => Self::NoConvergence,
            Status::NoConsensus => Self::NoConsensus,
            Status::LensNotMonotone => Self::LensNotMonotone,
            Status::BehindCamera => Self::BehindCamera,
            Status::Unreachable => Self::Unreachable,
            Status::OutsideLens => Self::OutsideLens,
            Status::NotFound => Self::NotFound,
            Status::Ambiguous => Self::Ambiguous,
            Status::Device => Self::Device,
            Status::DeviceLost => Self::DeviceLost,
            Status::DeviceTimeout => Self::DeviceTimeout,
            Status::LaserRefused => Self::LaserRefused,
            Status::DeviceNotFound => Self::DeviceNotFound,
            Status::DevicePermission => Self::DevicePermission,
            Status::DeviceBusy => Self::DeviceBusy,
            Status::DeviceMismatch => Self::DeviceMismatch,
            Status::DeviceGarbled => Self::DeviceGarbled,
            Status::DeviceRefused => Self::DeviceRefused,
            Status::Unauthorised => Self::Unauthorised,
            Status::FileIo => Self::FileIo,
            Status::FileFormat => Self::FileFormat,
            Status::FileVersion => Self::FileVersion,
            Status::FileMismatch => Self::FileMismatch,
            Status::DiskFull => Self::DiskFull,
            Status::Cancelled => Self::Cancelled,
            Status::Internal => Self::Internal,
            Status::Panic => Self::Panic,
        }
    }
}

/// Name of a status, such as "PTZCAL_STATUS_NOT_FOUND".
///
/// @param status A ptzcal_status, or any number.
/// @return A static string; "PTZCAL_STATUS_UNKNOWN" for a number that is no status. Never NULL.
///
/// Threads: free.
/// Since 0.1.0.
// An int32_t, not the enum: any number that C passes must be fine.
#[unsafe(no_mangle)]
pub extern "C" fn ptzcal_status_name(status: i32) -> *const c_char {
    let known = ptzcal_status::ALL.iter().find(|(s, _)| *s as i32 == status);
    known.map_or(c"PTZCAL_STATUS_UNKNOWN", |(_, name)| *name).as_ptr()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_are_the_crates() {
        let crates = [
            Status::Ok,
            Status::InvalidArgument,
            Status::NullPointer,
            Status::NotFinite,
            Status::BufferTooSmall,
            Status::Unsupported,
            Status::Busy,
            Status::BadState,
            Status::InvalidAddress,
            Status::TooFewPoints,
            Status::Degenerate,
            Status::NoConvergence,
            Status::NoConsensus,
            Status::LensNotMonotone,
            Status::BehindCamera,
            Status::Unreachable,
            Status::OutsideLens,
            Status::NotFound,
            Status::Ambiguous,
            Status::Device,
            Status::DeviceLost,
            Status::DeviceTimeout,
            Status::LaserRefused,
            Status::DeviceNotFound,
            Status::DevicePermission,
            Status::DeviceBusy,
            Status::DeviceMismatch,
            Status::DeviceGarbled,
            Status::DeviceRefused,
            Status::Unauthorised,
            Status::FileIo,
            Status::FileFormat,
            Status::FileVersion,
            Status::FileMismatch,
            Status::DiskFull,
            Status::Cancelled,
            Status::Internal,
            Status::Panic,
        ];
        assert_eq!(crates.len(), ptzcal_status::ALL.len());
        for status in crates {
            assert_eq!(ptzcal_status::from(status) as i32, status as i32);
        }
    }
}
