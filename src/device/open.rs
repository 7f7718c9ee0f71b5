//! From an address to the device behind it.

use std::sync::Arc;

use super::{Address, Credentials, FrameSource, Laser, PanTiltZoom, onvif, pelco, visca};
use crate::control::{Clock, Log, SystemClock};
use crate::error::{Error, Result};

/// What a device needs besides its address.
#[derive(Clone)]
pub struct Surroundings {
    /// Frames are stamped with it; it bounds all waiting.
    pub clock: Arc<dyn Clock>,
    pub log: Log,
    pub credentials: Option<Credentials>,
}

impl Default for Surroundings {
    fn default() -> Self {
        Self { clock: Arc::new(SystemClock::default()), log: Log::silent(), credentials: None }
    }
}

/// Opens a pan-tilt head.
///
/// # Errors
/// `InvalidAddress`; `Unsupported` for a kind of device that has no head or that this build does not
/// know; the device's own.
pub fn open_ptz(address: &Address, surroundings: &Surroundings) -> Result<Box<dyn PanTiltZoom>> {
    match address.scheme() {
        _ if visca::is_visca(address) => Ok(Box::new(visca::open(address, surroundings)?)),
        "onvif" => Ok(Box::new(onvif::open_head(address, surroundings)?)),
        "onvifs" | "onvif+https" => Err(onvif::encrypted()),
        scheme if scheme.starts_with("pelco-") => Ok(Box::new(pelco::open_head(address, surroundings)?)),
        _ => Err(unknown(address, "a head")),
    }
}

/// Opens a laser and switches it off.
///
/// # Errors
/// As [`open_ptz`].
pub fn open_laser(address: &Address, surroundings: &Surroundings) -> Result<Box<dyn Laser>> {
    match address.scheme() {
        #[cfg(target_os = "linux")]
        "gpio" => super::gpio::open(address, surroundings),
        #[cfg(not(target_os = "linux"))]
        "gpio" => Err(Error::Unsupported { what: "gpio:// addresses, but on Linux".into() }),
        _ => Err(unknown(address, "a laser")),
    }
}

/// Opens a camera's frames.
///
/// # Errors
/// As [`open_ptz`].
pub fn open_frames(address: &Address, surroundings: &Surroundings) -> Result<Box<dyn FrameSource>> {
    match address.scheme() {
        "onvif" => Ok(Box::new(onvif::open_frames(address, surroundings)?)),
        "onvifs" | "onvif+https" => Err(onvif::encrypted()),
        #[cfg(all(target_os = "linux", feature = "v4l2"))]
        "v4l2" => super::v4l2::open(address, surroundings),
        #[cfg(not(all(target_os = "linux", feature = "v4l2")))]
        "v4l2" => Err(Error::Unsupported {
            what: "v4l2:// addresses in this build: it was made without the cargo feature v4l2 (needs Linux, and libclang \
                   to build)"
                .into(),
        }),
        _ => Err(unknown(address, "frames")),
    }
}

fn unknown(address: &Address, what: &str) -> Error {
    Error::Unsupported { what: format!("{what} at an address that begins with {}://", address.scheme()) }
}
