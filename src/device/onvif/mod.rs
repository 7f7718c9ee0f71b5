//! Cameras that speak ONVIF: their heads, and single pictures of them.
//!
//! `onvif://[user@]host[:port][/path]?profile=&timeout=&...`, over plain HTTP. Passwords are never sent:
//! HTTP Digest, or the digest of a WS-UsernameToken, proves them.

mod client;
mod digest;
mod discover;
mod driver;
mod focus;
mod http;
mod services;
mod snapshot;
#[cfg(test)]
mod tests;
mod time;
mod watch;
mod xml;

pub use discover::{Discovered, discover};
pub use driver::OnvifHead;
pub use snapshot::OnvifFrames;

use self::driver::Camera;
use self::http::Host;
use super::{Address, Credentials, Surroundings};
use crate::error::{Error, Result};

/// Where every camera's device service is, by the standard.
const DEVICE_PATH: &str = "/onvif/device_service";

/// What an address can say of a camera.
#[derive(Debug, Clone, PartialEq)]
struct OnvifOptions {
    /// Token of the media profile; the first that fits when there is none.
    profile: Option<String>,
    /// Longest time for each request, seconds.
    timeout: f64,
    /// Pan and tilt at full speed, radians per second; 0: unknown, and 1 is taken for it.
    full_speed: [f64; 2],
    /// Greatest age of a snapshot when it is asked for, seconds.
    latency: f64,
}

fn options(address: &Address) -> Result<OnvifOptions> {
    address.check_options(&["profile", "timeout", "pan_speed", "tilt_speed", "latency"])?;
    let speed = |name| address.number(name, 0.0, 0.0..=1000.0).map(f64::to_radians);
    Ok(OnvifOptions {
        profile: address.option("profile").map(str::to_owned),
        timeout: address.number("timeout", 5.0, 0.1..=60.0)?,
        full_speed: [speed("pan_speed")?, speed("tilt_speed")?],
        latency: address.number("latency", 0.0, 0.0..=60.0)?,
    })
}

fn camera(address: &Address, options: &OnvifOptions, surroundings: &Surroundings) -> Result<Camera> {
    let path = match address.path() {
        "" | "/" => DEVICE_PATH,
        path if path.bytes().all(|b| b.is_ascii_graphic()) => path,
        path => return Err(address.wrong(format!("{path:?} is no path of a web address"))),
    };
    let credentials = match (&surroundings.credentials, address.user()) {
        (Some(given), Some(user)) if given.user.is_empty() => {
            Some(Credentials { user: user.to_owned(), password: given.password.clone() })
        }
        (Some(given), Some(user)) if given.user != user => {
            return Err(address.wrong(format!("it names the user {user:?}, the credentials are another's")));
        }
        (given, _) => given.clone(),
    };
    Camera::open(Host::look_up(address)?, path, options, credentials, &surroundings.clock)
}

/// Opens the head of a camera.
///
/// # Errors
/// `InvalidAddress`; `DeviceNotFound`, `DeviceTimeout` and `DeviceLost` of the network;
/// `Unauthorised`; `DeviceMismatch` for what is no ONVIF camera with absolute pan and tilt.
pub fn open_head(address: &Address, surroundings: &Surroundings) -> Result<OnvifHead> {
    let options = options(address)?;
    let camera = camera(address, &options, surroundings)?;
    OnvifHead::open(camera, &options, surroundings.clock.clone(), surroundings.log.clone())
}

/// Opens a camera's snapshots.
///
/// # Errors
/// As [`open_head`].
pub fn open_frames(address: &Address, surroundings: &Surroundings) -> Result<OnvifFrames> {
    let options = options(address)?;
    let camera = camera(address, &options, surroundings)?;
    OnvifFrames::open(camera, &options, surroundings.clock.clone())
}

/// The answer to addresses of cameras behind TLS.
pub fn encrypted() -> Error {
    Error::Unsupported {
        what: "ONVIF over TLS (https) in this build: switch plain HTTP on in the camera, for this network only".into(),
    }
}
