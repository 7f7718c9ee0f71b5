//! Addresses of Pelco heads: `pelco-d:///dev/...?address=1&baud=2400`, `pelco-p://...`, and both over
//! a serial device server: `pelco-d+tcp://host:port`, `pelco-d+udp://host:port`.

use super::codec::{Dialect, XorCoverage};
use super::driver::{PelcoHead, PelcoOptions, TiltDirection};
use crate::device::{Address, Link, Surroundings, serial, tcp, udp};
use crate::error::{Error, Result};

const OPTIONS: [&str; 10] =
    ["address", "baud", "tilt", "pan_range", "tilt_range", "step", "pan_speed", "tilt_speed", "reply_timeout", "xor"];
/// What device servers use when nobody says otherwise is no standard: the port has to be named.
const NEEDS_PORT: &str = "it names no port";

/// Opens a head.
///
/// # Errors
/// `InvalidAddress`; the link's own; `DeviceGarbled` when the line carries something else.
pub fn open_head(address: &Address, surroundings: &Surroundings) -> Result<PelcoHead> {
    let scheme = address.scheme();
    let (protocol, carrier) = scheme.split_once('+').unwrap_or((scheme, "serial"));
    let options = options(address, protocol)?;
    let host = || Ok::<_, Error>((address.need_host()?, address.port().ok_or_else(|| address.wrong(NEEDS_PORT))?));
    // Rates that lines are set to in practice; the port itself says what it can.
    let baud = address.number("baud", 2400, 300..=4_000_000)?;
    let link: Box<dyn Link> = match carrier {
        "serial" => serial::open(address.need_local_path()?, baud)?,
        "tcp" | "udp" if address.option("baud").is_some() => {
            return Err(address.wrong("option \"baud\": the device server has it"));
        }
        "tcp" => {
            let (host, port) = host()?;
            tcp::open(host, port)?
        }
        "udp" => {
            let (host, port) = host()?;
            udp::open(host, port, None)?
        }
        _ => return Err(Error::Unsupported { what: format!("Pelco over {carrier:?}") }),
    };
    PelcoHead::open(link, options, surroundings.clock.clone(), &surroundings.log)
}

fn options(address: &Address, protocol: &str) -> Result<PelcoOptions> {
    address.check_options(&OPTIONS)?;
    let coverage = match (address.option("xor"), protocol) {
        (None | Some("whole"), "pelco-p") => XorCoverage::Whole,
        (Some("inner"), "pelco-p") => XorCoverage::Inner,
        (None, _) => XorCoverage::Whole,
        (Some(_), "pelco-p") => return Err(address.wrong("option xor is whole or inner")),
        (Some(_), _) => return Err(address.wrong("option xor belongs to pelco-p")),
    };
    let dialect = match protocol {
        "pelco-d" => Dialect::D,
        "pelco-p" => Dialect::P(coverage),
        _ => {
            return Err(Error::Unsupported { what: format!("a head at {protocol}://: there are pelco-d and pelco-p") });
        }
    };
    let default = PelcoOptions::new(dialect);
    let speed = |name| address.number(name, 0.0, 0.0..=1000.0).map(f64::to_radians);
    Ok(PelcoOptions {
        address: address.number("address", default.address, 1..=255)?,
        tilt_direction: match address.option("tilt") {
            None | Some("down") => TiltDirection::Down,
            Some("up") => TiltDirection::Up,
            Some(_) => return Err(address.wrong("option tilt is down or up: which way the device counts")),
        },
        pan_range: range(address, "pan_range", 360.0)?.unwrap_or(default.pan_range),
        tilt_range: range(address, "tilt_range", 180.0)?.unwrap_or(default.tilt_range),
        step: address.number("step", 0.0, 0.0..=10.0).map(f64::to_radians)?,
        full_speed: [speed("pan_speed")?, speed("tilt_speed")?],
        reply_timeout: address.number("reply_timeout", default.reply_timeout, 0.01..=10.0)?,
        ..default
    })
}

/// `low..high` in degrees, within `most` of zero and no wider than a turn.
fn range(address: &Address, name: &str, most: f64) -> Result<Option<[f64; 2]>> {
    let Some(text) = address.option(name) else { return Ok(None) };
    let number = |text: &str| text.parse::<f64>().ok().filter(|v| v.abs() <= most);
    let limits = text.split_once("..").and_then(|(low, high)| Some([number(low)?, number(high)?]));
    match limits.filter(|[low, high]| low < high && high - low <= 360.0) {
        Some(limits) => Ok(Some(limits.map(f64::to_radians))),
        None => Err(address.wrong(format!("option {name}={text:?} is no low..high in degrees"))),
    }
}
