//! Addresses of VISCA cameras, and the lines that are open.
//!
//! | address | line |
//! |---|---|
//! | `visca:///dev/serial/by-id/...?baud=9600` | serial |
//! | `visca+udp://host[:52381]` | VISCA over IP |
//! | `visca+tcp://host[:5678]` | packets in a TCP connection |
//! | `visca+udp-raw://host[:1259]` | packets in datagrams |
//!
//! Options of all: `model` (a name of [`Model`], or `auto`, the default: the camera is asked) and
//! `address` (1 to 7, default 1).

use std::path::Path;
use std::sync::{Arc, Mutex, Weak};

use super::bus::{Bus, Opener, Transport};
use super::codec::ip;
use super::driver::ViscaHead;
use super::models::Model;
use crate::control::unpoisoned;
use crate::device::{Address, Surroundings, serial, tcp, udp};
use crate::error::{Error, Result};

const TCP_PORT: u16 = 5678;
const RAW_UDP_PORT: u16 = 1259;
const DEFAULT_BAUD: u32 = 9600;

/// The lines that heads of this process hold. A line can be opened once only, so heads on one chain
/// have to find it, also when they are opened by separate calls that know nothing of each other.
static LINES: Mutex<Vec<Entry>> = Mutex::new(Vec::new());

struct Entry {
    /// The device behind all its names.
    key: String,
    baud: u32,
    bus: Weak<Bus>,
}

/// Is this an address of a VISCA camera?
pub fn is_visca(address: &Address) -> bool {
    ["visca", "visca+udp", "visca+tcp", "visca+udp-raw"].contains(&address.scheme())
}

/// Opens the head of a VISCA camera.
///
/// # Errors
/// `InvalidAddress`, or as [`ViscaHead::open`].
pub fn open(address: &Address, surroundings: &Surroundings) -> Result<ViscaHead> {
    let serial = address.scheme() == "visca";
    address.check_options(if serial { &["model", "address", "baud"] } else { &["model", "address"] })?;
    let camera = address.number("address", 1u8, 1..=7)?;
    let model = match address.option("model").unwrap_or("auto") {
        "auto" => None,
        name => Some(Model::named(name).ok_or_else(|| {
            let names = Model::ALL.map(|model| model.name).join(", ");
            address.wrong(format!("model {name:?} is not among auto, {names}"))
        })?),
    };
    let bus = if serial { serial_line(address)? } else { network_line(address)? };
    ViscaHead::open(bus, camera, model, surroundings)
}

fn serial_line(address: &Address) -> Result<Arc<Bus>> {
    let baud = address.number("baud", DEFAULT_BAUD, 300..=460_800)?;
    let path = address.need_local_path()?.to_owned();
    // Names under /dev/serial are links. What is not there yet has no other name.
    let device = Path::new(&path).canonicalize().map_or_else(|_| path.clone(), |p| p.to_string_lossy().into_owned());
    let name = path.clone();
    // Opened again by the name that was given: it finds the device wherever it comes back.
    let opener: Opener = Box::new(move || serial::open(&path, baud));
    shared(address, device, baud, || Bus::new(name, Transport::Serial, opener))
}

fn network_line(address: &Address) -> Result<Arc<Bus>> {
    let host = address.need_host()?.to_owned();
    if !matches!(address.path(), "" | "/") {
        return Err(address.wrong("a camera in the network has no path"));
    }
    let (transport, default_port) = match address.scheme() {
        "visca+udp" => (Transport::OverIp, ip::PORT),
        "visca+tcp" => (Transport::Stream, TCP_PORT),
        _ => (Transport::Datagrams, RAW_UDP_PORT),
    };
    let port = address.port().unwrap_or(default_port);
    let name = format!("{host}:{port}");
    let key = format!("{}://{}:{port}", address.scheme(), host.to_ascii_lowercase());
    let opener: Opener = Box::new(move || match transport {
        Transport::Stream => tcp::open(&host, port),
        // Some cameras answer to the port that they listen on themselves.
        Transport::OverIp => udp::open(&host, port, (port == ip::PORT).then_some(ip::PORT)),
        Transport::Datagrams | Transport::Serial => udp::open(&host, port, None),
    });
    shared(address, key, 0, || Bus::new(name, transport, opener))
}

/// The line with this key, if a head holds it, or a new one.
fn shared(address: &Address, key: String, baud: u32, make: impl FnOnce() -> Arc<Bus>) -> Result<Arc<Bus>> {
    let mut lines = unpoisoned(&LINES);
    lines.retain(|entry| entry.bus.strong_count() > 0);
    if let Some((entry, bus)) =
        lines.iter().filter(|entry| entry.key == key).find_map(|entry| Some((entry, entry.bus.upgrade()?)))
    {
        if entry.baud != baud {
            let reason = format!("another head has this line open at {} baud", entry.baud);
            return Err(Error::InvalidAddress { address: address.to_string(), reason });
        }
        return Ok(bus);
    }
    let bus = make();
    lines.push(Entry { key, baud, bus: Arc::downgrade(&bus) });
    Ok(bus)
}
