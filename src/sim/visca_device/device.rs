//! An emulated device with its clock, and the link to it that is nothing but memory.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard};

use super::emulator::{Emulator, EmulatorOptions};
use super::ip::IpSession;
use super::wire::Origin;
use crate::control::{Clock, Log, unpoisoned};
use crate::device::visca::ViscaHead;
use crate::device::visca::bus::{Bus, Transport};
use crate::device::visca::models::Model;
use crate::device::{Link, Sender, Surroundings};
use crate::error::{Error, Result};
use crate::sim::Simulator;

/// An emulator and the clock that it lives by. Clones share both. It is reached by links in memory
/// ([`link`](Self::link), [`ip_link`](Self::ip_link)), one at a time, or by a
/// [`Server`](super::Server).
#[derive(Clone)]
pub struct ViscaDevice(Arc<Shared>);

struct Shared {
    emulator: Mutex<Emulator>,
    clock: Arc<dyn Clock>,
}

impl ViscaDevice {
    /// # Errors
    /// As [`Emulator::new`].
    pub fn new(options: &EmulatorOptions, clock: Arc<dyn Clock>) -> Result<Self> {
        Ok(Self(Arc::new(Shared { emulator: Mutex::new(Emulator::new(options)?), clock })))
    }

    /// Moves the simulator's head, by the simulator's clock.
    ///
    /// # Errors
    /// As [`Emulator::new`].
    pub fn with_simulator(options: &EmulatorOptions, simulator: &Simulator) -> Result<Self> {
        let emulator = Mutex::new(Emulator::with_simulator(options, simulator)?);
        Ok(Self(Arc::new(Shared { emulator, clock: simulator.clock() })))
    }

    pub fn clock(&self) -> Arc<dyn Clock> {
        self.0.clock.clone()
    }

    /// The emulator itself, to look at it or to change its faults. Everything waits meanwhile.
    pub fn emulator(&self) -> MutexGuard<'_, Emulator> {
        unpoisoned(&self.0.emulator)
    }

    pub(super) fn now(&self) -> f64 {
        self.0.clock.now()
    }

    /// A serial line. Waiting on it lets the clock's time pass, virtual time at once.
    ///
    /// # Errors
    /// `DeviceNotFound` while it is unplugged.
    pub fn link(&self) -> Result<Box<dyn Link>> {
        self.open(None)
    }

    /// Datagrams of VISCA over IP, one at a time.
    ///
    /// # Errors
    /// As [`link`](Self::link).
    pub fn ip_link(&self) -> Result<Box<dyn Link>> {
        self.open(Some(IpSession::default()))
    }

    /// The library's own driver of the camera with this address, on a line in memory.
    ///
    /// # Errors
    /// As [`ViscaHead::open`].
    pub fn head(&self, address: u8, model: Option<&'static Model>, log: Log) -> Result<ViscaHead> {
        let device = self.clone();
        let bus = Bus::new(NAME, Transport::Serial, Box::new(move || device.link()));
        ViscaHead::open(bus, address, model, &Surroundings { clock: self.clock(), log, credentials: None })
    }

    fn open(&self, ip: Option<IpSession>) -> Result<Box<dyn Link>> {
        let mut emulator = self.emulator();
        if !emulator.is_plugged(self.now()) {
            return Err(Error::DeviceNotFound { device: NAME.into(), reason: "it is unplugged".into() });
        }
        let wire = Line {
            device: self.clone(),
            plug: emulator.times_unplugged(),
            ip: ip.map(Mutex::new),
            said: Mutex::new(Vec::new()),
        };
        Ok(Box::new(MemoryLink(Arc::new(wire))))
    }
}

impl fmt::Debug for ViscaDevice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("ViscaDevice")
    }
}

const NAME: &str = "emulated camera";
/// Longest single sleep, seconds: how late a waiting link notices what another thread sent.
const SLICE: f64 = 0.05;
/// Shortest single sleep, so that rounding does not stop the time.
const TICK: f64 = 1e-6;

/// Answers that nobody reads wait up to this number.
const MAX_SAID: usize = 64;

/// Bytes between a controller and the emulator. Locks are taken in the order emulator, ip, said.
struct Line {
    device: ViscaDevice,
    /// It is dead once the device was unplugged more often.
    plug: u64,
    ip: Option<Mutex<IpSession>>,
    /// Arrived and not yet read: what did not fit into a buffer, and answers to the header itself.
    said: Mutex<Vec<Vec<u8>>>,
}

struct MemoryLink(Arc<Line>);

impl Line {
    fn check(&self, emulator: &mut Emulator, now: f64) -> Result<()> {
        if emulator.is_plugged(now) && emulator.times_unplugged() == self.plug {
            return Ok(());
        }
        Err(Error::DeviceLost { reason: format!("the {NAME} was unplugged") })
    }

    /// What has arrived, or when to look again.
    fn arrived(&self, now: f64) -> Result<std::result::Result<Vec<u8>, f64>> {
        let mut emulator = self.device.emulator();
        self.check(&mut emulator, now)?;
        let mut said = unpoisoned(&self.said);
        if !said.is_empty() {
            return Ok(Ok(said.remove(0)));
        }
        let outgoing = emulator.poll(now);
        Ok(match (outgoing, &self.ip) {
            (Some(outgoing), Some(ip)) => Ok(unpoisoned(ip).say(&outgoing)),
            (Some(outgoing), None) => Ok(outgoing.bytes),
            (None, _) => Err(emulator.next_event(now).unwrap_or(f64::INFINITY)),
        })
    }
}

impl Link for MemoryLink {
    fn receive(&mut self, buffer: &mut [u8], timeout: f64) -> Result<usize> {
        let clock = self.0.device.clock();
        let end = clock.now() + if timeout > 0.0 { timeout } else { 0.0 };
        loop {
            let now = clock.now();
            match self.0.arrived(now)? {
                Ok(mut bytes) => {
                    let count = bytes.len().min(buffer.len());
                    let rest = bytes.split_off(count);
                    buffer[..count].copy_from_slice(&bytes);
                    // Of a datagram that does not fit the rest is lost.
                    if self.0.ip.is_none() && !rest.is_empty() {
                        unpoisoned(&self.0.said).insert(0, rest);
                    }
                    return Ok(count);
                }
                Err(_) if now >= end => return Ok(0),
                Err(next) => clock.sleep((next.min(end) - now).clamp(TICK, SLICE)),
            }
        }
    }

    fn sender(&self) -> Arc<dyn Sender> {
        self.0.clone()
    }
}

impl Sender for Line {
    fn send(&self, message: &[u8]) -> Result<()> {
        let now = self.device.now();
        let mut emulator = self.device.emulator();
        self.check(&mut emulator, now)?;
        match &self.ip {
            None => emulator.feed(message, now),
            Some(ip) => {
                let answer = unpoisoned(ip).hear(Origin::default(), message, &mut emulator, now);
                let mut said = unpoisoned(&self.said);
                if said.len() < MAX_SAID {
                    said.extend(answer);
                }
            }
        }
        Ok(())
    }
}
