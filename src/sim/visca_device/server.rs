//! Emulated cameras that other programs reach, in real time: a pseudo-terminal, UDP and TCP. All of a
//! device's ways are served by one thread, which ends with the [`Server`].

use std::io;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use super::ViscaDevice;
use super::emulator::Emulator;
use super::ports::{Port, RawTcp, Udp};
#[cfg(unix)]
use super::pty::Pty;
use super::wire::Outgoing;
use crate::device::device_error;
use crate::error::{Error, Result};

/// Between two looks at ways where nothing happened, real time.
const IDLE: Duration = Duration::from_millis(1);

/// The ways to an emulated device, until it is started.
///
/// Its clock has to be real time at some factor: a [`ScaledClock`](crate::sim::ScaledClock), or that
/// of a simulator with the option `real_time`.
pub struct ServerBuilder {
    device: ViscaDevice,
    ports: Vec<Box<dyn Port>>,
}

/// A served device. Dropped, it ends its thread and closes its ways.
pub struct Server {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl ServerBuilder {
    pub fn new(device: &ViscaDevice) -> Self {
        Self { device: device.clone(), ports: Vec::new() }
    }

    /// A pseudo-terminal. `path` becomes a symbolic link to what controllers open. Unplugged, both
    /// vanish; plugged in again, the link leads to a new pseudo-terminal.
    ///
    /// # Errors
    /// `DeviceBusy` when `path` is there and no symbolic link; the system's.
    #[cfg(unix)]
    pub fn pty(&mut self, path: &Path) -> Result<()> {
        let pty = Pty::open(path)?;
        self.ports.push(Box::new(pty));
        Ok(())
    }

    /// # Errors
    /// `Unsupported`: this system has no pseudo-terminals.
    #[cfg(not(unix))]
    pub fn pty(&mut self, _path: &Path) -> Result<()> {
        Err(Error::Unsupported { what: "pseudo-terminals on this system".into() })
    }

    /// VISCA over IP: datagrams with a header, which cameras have on port 52381. Says where it
    /// listens, as port 0 asks for any.
    ///
    /// # Errors
    /// `DeviceBusy` when the port is in use; the system's.
    pub fn ip(&mut self, address: SocketAddr) -> Result<SocketAddr> {
        self.udp(address, true)
    }

    /// A packet in each datagram, without a header, as some cameras have on port 1259.
    ///
    /// # Errors
    /// As [`ip`](Self::ip).
    pub fn raw_udp(&mut self, address: SocketAddr) -> Result<SocketAddr> {
        self.udp(address, false)
    }

    /// The serial line's bytes over TCP, as some cameras have on port 5678.
    ///
    /// # Errors
    /// As [`ip`](Self::ip).
    pub fn raw_tcp(&mut self, address: SocketAddr) -> Result<SocketAddr> {
        let (port, address) = named(address, RawTcp::bind(address))?;
        self.ports.push(Box::new(port));
        Ok(address)
    }

    fn udp(&mut self, address: SocketAddr, header: bool) -> Result<SocketAddr> {
        let (port, address) = named(address, Udp::bind(address, header))?;
        self.ports.push(Box::new(port));
        Ok(address)
    }

    /// Starts the thread.
    ///
    /// # Errors
    /// `BadState` when the system gives no thread.
    pub fn start(self) -> Result<Server> {
        let stop = Arc::new(AtomicBool::new(false));
        let (stopped, Self { device, mut ports }) = (stop.clone(), self);
        let run = move || {
            while !stopped.load(Ordering::Relaxed) {
                let now = device.now();
                if !turn(&mut device.emulator(), &mut ports, now) {
                    std::thread::sleep(IDLE);
                }
            }
        };
        let thread = std::thread::Builder::new().name("visca-device".into()).spawn(run);
        let thread = thread.map_err(|e| Error::BadState { reason: format!("no thread for the emulator: {e}") })?;
        Ok(Server { stop, thread: Some(thread) })
    }
}

fn named<T>(address: SocketAddr, bound: io::Result<T>) -> Result<T> {
    bound.map_err(|error| device_error(&address.to_string(), &error))
}

/// Carries what there is in both directions; false when there was nothing.
fn turn(emulator: &mut Emulator, ports: &mut [Box<dyn Port>], now: f64) -> bool {
    let plugged = emulator.is_plugged(now);
    let mut busy = false;
    for (number, port) in ports.iter_mut().enumerate() {
        port.plug(plugged);
        if plugged {
            busy |= port.hear(number as u16, emulator, now);
        }
    }
    while let Some(outgoing) = emulator.poll(now) {
        busy = true;
        say(ports, &outgoing);
    }
    busy
}

fn say(ports: &mut [Box<dyn Port>], outgoing: &Outgoing) {
    if let Some(port) = ports.get_mut(usize::from(outgoing.origin.port)) {
        port.say(outgoing);
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // It has panicked: there is nothing left to end.
            let _ = thread.join();
        }
    }
}
