//! A line and the cameras on it.
//!
//! Cameras are chained: several heads share one line, each with an address. One head at a time has
//! its [`Turn`]: it asks and waits for its reply, and what arrives for the others meanwhile is kept
//! for them. Stops go past all that through the [`Outlet`].

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};

use super::codec::ip::{Control, Kind, Message};
use super::codec::{Framer, Packet, Reply, Request, Zooming};
use super::models::Model;
use crate::control::{Clock, unpoisoned};
use crate::device::{Brake, Link, Sender};
use crate::error::{Error, Result};

/// A line that is gone is opened again at most this often, seconds.
const REOPEN_INTERVAL: f64 = 1.0;
/// Time for a message to go round the chain, seconds.
const ROUND: f64 = 0.4;
/// Messages kept for a head that does not ask for them.
const MAX_INBOX: usize = 32;
/// Bytes without a message for whom is waiting: more than a second at 38400 baud.
const FLOOD: usize = 1 << 13;

/// What carries the packets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transport {
    /// A chain of cameras, whose addresses are set.
    Serial,
    /// Packets in a TCP connection, one after the other.
    Stream,
    /// One packet in a datagram.
    Datagrams,
    /// VISCA over IP: numbered datagrams.
    OverIp,
}

/// Opens the line anew.
pub type Opener = Box<dyn Fn() -> Result<Box<dyn Link>> + Send + Sync>;

/// One line. Heads on it hold it together.
pub struct Bus {
    name: String,
    transport: Transport,
    open: Opener,
    outlet: Arc<Outlet>,
    line: Mutex<Line>,
}

struct Line {
    link: Option<Box<dyn Link>>,
    framer: Framer,
    /// Bytes that were framed and meant nothing.
    meaningless: u64,
    /// By address; 0 for what goes round and for the numbering.
    inbox: [VecDeque<Incoming>; 8],
    taken: [bool; 8],
    /// Counts how often the cameras were made to forget everything.
    generation: u64,
    /// A camera says that the chain has changed.
    changed: bool,
    /// How many there are, where that is known.
    cameras: Option<u8>,
    last_opening: Option<f64>,
    was_open: bool,
}

/// What arrived for a head.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Incoming {
    /// A reply, and over IP the number of what it replies to.
    Reply(Reply, Option<u32>),
    Control(Control, u32),
}

/// The sending half of a line, for all threads.
pub struct Outlet {
    transport: Transport,
    sender: Mutex<Option<Arc<dyn Sender>>>,
    sequence: AtomicU32,
    /// Stops that were sent past the turns, by address.
    stops: [AtomicU64; 8],
}

/// The right to speak on the line.
pub struct Turn<'a> {
    bus: &'a Bus,
    line: MutexGuard<'a, Line>,
    clock: &'a dyn Clock,
}

impl Bus {
    /// `name` is the device's, for errors. Nothing is opened yet.
    pub fn new(name: impl Into<String>, transport: Transport, open: Opener) -> Arc<Self> {
        Arc::new(Self {
            name: name.into(),
            transport,
            open,
            outlet: Arc::new(Outlet {
                transport,
                sender: Mutex::new(None),
                sequence: AtomicU32::new(0),
                stops: Default::default(),
            }),
            line: Mutex::new(Line {
                link: None,
                framer: Framer::new(),
                meaningless: 0,
                inbox: Default::default(),
                taken: [false; 8],
                generation: 0,
                changed: false,
                cameras: None,
                last_opening: None,
                was_open: false,
            }),
        })
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    pub fn transport(&self) -> Transport {
        self.transport
    }

    pub fn outlet(&self) -> &Arc<Outlet> {
        &self.outlet
    }

    /// Reserves an address.
    ///
    /// # Errors
    /// `DeviceBusy` when a head has it.
    pub fn take_address(&self, address: u8) -> Result<()> {
        let mut line = self.lock();
        if std::mem::replace(&mut line.taken[usize::from(address & 7)], true) {
            return Err(Error::DeviceBusy { device: format!("camera {address} at {}", self.name) });
        }
        Ok(())
    }

    pub fn free_address(&self, address: u8) {
        let mut line = self.lock();
        line.taken[usize::from(address & 7)] = false;
        line.inbox[usize::from(address & 7)].clear();
    }

    /// Waits for the line, opens it where needed, and sets its cameras up where they have changed.
    ///
    /// # Errors
    /// Those of opening; `DeviceLost` while it is gone.
    pub fn turn<'a>(&'a self, clock: &'a dyn Clock) -> Result<Turn<'a>> {
        let mut turn = Turn { bus: self, line: self.lock(), clock };
        if turn.line.link.is_none() {
            turn.open()?;
        } else if turn.line.changed {
            turn.set_up()?;
        }
        Ok(turn)
    }

    fn lock(&self) -> MutexGuard<'_, Line> {
        unpoisoned(&self.line)
    }
}

impl Turn<'_> {
    /// Changes when the cameras have forgotten their commands.
    pub fn generation(&self) -> u64 {
        self.line.generation
    }

    /// Bytes so far that meant nothing.
    pub fn garbage(&self) -> u64 {
        self.line.framer.garbage() + self.line.meaningless
    }

    /// # Errors
    /// `DeviceLost`; `DeviceTimeout` when the line takes nothing.
    pub fn send(&mut self, packet: &Packet, inquiry: bool, number: u32) -> Result<()> {
        let sent = self.bus.outlet.send(packet, inquiry, number);
        self.closed_if_lost(sent)
    }

    /// The next message for a head, None when none has come until the clock shows `until`.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub fn receive(&mut self, address: u8, until: f64) -> Result<Option<Incoming>> {
        let mut taken_in = 0;
        loop {
            if let Some(incoming) = self.line.inbox[usize::from(address & 7)].pop_front() {
                return Ok(Some(incoming));
            }
            let left = until - self.clock.now();
            if taken_in > FLOOD || (taken_in > 0 && left <= 0.0) {
                return Ok(None);
            }
            let mut buffer = [0; 256];
            let Some(link) = self.line.link.as_mut() else { return Err(self.bus.gone()) };
            let received = link.receive(&mut buffer, left.max(0.0));
            match self.closed_if_lost(received)? {
                0 => return Ok(None),
                count => {
                    taken_in += count;
                    let transport = self.bus.transport;
                    self.line.take_in(transport, buffer.get(..count).unwrap_or(&buffer));
                }
            }
        }
    }

    /// Length of the chain, where that is known.
    pub fn cameras(&self) -> Option<u8> {
        self.line.cameras
    }

    /// Gives the cameras their addresses (the numbers of messages over IP start afresh), and makes all
    /// forget what they were doing.
    ///
    /// # Errors
    /// `DeviceLost`. Silence is none: some cameras have fixed addresses and do not answer.
    pub fn set_up(&mut self) -> Result<()> {
        self.line.changed = false;
        self.line.generation += 1;
        self.line.inbox.iter_mut().for_each(VecDeque::clear);
        match self.bus.transport {
            Transport::Serial => {
                self.line.cameras = self.set_addresses()?;
                self.broadcast(&Request::ClearAll)?;
                let until = self.clock.now() + ROUND;
                while let Some(incoming) = self.receive(0, until)? {
                    if incoming == Incoming::Reply(Reply::ClearedAll, None) {
                        break;
                    }
                }
                Ok(())
            }
            Transport::OverIp => self.reset_numbers(),
            Transport::Stream | Transport::Datagrams => Ok(()),
        }
    }

    fn set_addresses(&mut self) -> Result<Option<u8>> {
        for _ in 0..2 {
            self.broadcast(&Request::AddressSet)?;
            let until = self.clock.now() + ROUND;
            while let Some(incoming) = self.receive(0, until)? {
                match incoming {
                    // Next 1 is our own request: an echo, or a line without cameras.
                    Incoming::Reply(Reply::AddressSet { next }, _) if next > 1 => return Ok(Some(next - 1)),
                    _ => (),
                }
            }
        }
        Ok(None)
    }

    fn broadcast(&mut self, request: &Request) -> Result<()> {
        // The same bytes for every model.
        let packet = request.encode(&Model::EVI_D100, 0);
        self.send(&packet, false, 0)
    }

    fn reset_numbers(&mut self) -> Result<()> {
        for _ in 0..3 {
            let sent = self.bus.outlet.send_reset();
            self.closed_if_lost(sent)?;
            let until = self.clock.now() + ROUND / 2.0;
            while let Some(incoming) = self.receive(0, until)? {
                if matches!(incoming, Incoming::Control(Control::Reset, _)) {
                    return Ok(());
                }
            }
        }
        Ok(())
    }

    fn open(&mut self) -> Result<()> {
        let now = self.clock.now();
        if self.line.last_opening.is_some_and(|last| now < last + REOPEN_INTERVAL) {
            return Err(self.bus.gone());
        }
        self.line.last_opening = Some(now);
        let link = (self.bus.open)().map_err(|error| {
            if !self.line.was_open {
                return error;
            }
            Error::DeviceLost { reason: format!("{} is not back ({error})", self.bus.name) }
        })?;
        *self.bus.outlet.slot() = Some(link.sender());
        self.line.link = Some(link);
        self.line.was_open = true;
        self.line.framer.restart();
        self.set_up()
    }

    fn closed_if_lost<T>(&mut self, result: Result<T>) -> Result<T> {
        if matches!(result, Err(Error::DeviceLost { .. })) {
            // Dropped at once, or the kernel gives the device another name when it is back.
            *self.bus.outlet.slot() = None;
            self.line.link = None;
            self.line.last_opening = Some(self.clock.now());
        }
        result
    }
}

impl Bus {
    fn gone(&self) -> Error {
        Error::DeviceLost { reason: format!("{} is gone; it is tried again once a second", self.name) }
    }
}

impl Line {
    fn take_in(&mut self, transport: Transport, bytes: &[u8]) {
        match transport {
            Transport::OverIp => self.take_message(bytes),
            Transport::Serial | Transport::Stream | Transport::Datagrams => {
                if transport == Transport::Datagrams {
                    // Packets do not span datagrams.
                    self.framer.restart();
                }
                for &byte in bytes {
                    if let Some(packet) = self.framer.push(byte) {
                        self.take_packet(transport, &packet, None);
                    }
                }
            }
        }
    }

    fn take_message(&mut self, bytes: &[u8]) {
        let Some(message) = Message::decode(bytes) else {
            self.meaningless += bytes.len() as u64;
            return;
        };
        match message.kind {
            Kind::Control | Kind::ControlReply => match Control::from_payload(message.payload) {
                Some(Control::Reset) => self.deliver(0, Incoming::Control(Control::Reset, message.sequence)),
                Some(other) => self.deliver_to_taken(Incoming::Control(other, message.sequence)),
                None => self.meaningless += bytes.len() as u64,
            },
            Kind::Reply => match Packet::from_bytes(message.payload) {
                Some(packet) => self.take_packet(Transport::OverIp, &packet, Some(message.sequence)),
                None => self.meaningless += bytes.len() as u64,
            },
            Kind::Command | Kind::Inquiry | Kind::DeviceSetting => (),
        }
    }

    fn take_packet(&mut self, transport: Transport, packet: &Packet, number: Option<u32>) {
        match Reply::decode(packet) {
            Some((_, Reply::NetworkChange)) => self.changed |= transport == Transport::Serial,
            Some((from, reply)) => {
                let incoming = Incoming::Reply(reply, number);
                if from == 0 || self.taken[usize::from(from)] {
                    self.deliver(usize::from(from), incoming);
                } else if transport != Transport::Serial {
                    // One camera at the other end, whatever address it believes to have.
                    self.deliver_to_taken(incoming);
                }
            }
            // The echo of a line that hears itself.
            None if packet.sender() == 0 => (),
            None => self.meaningless += packet.bytes().len() as u64,
        }
    }

    fn deliver(&mut self, address: usize, incoming: Incoming) {
        let inbox = &mut self.inbox[address];
        if inbox.len() == MAX_INBOX {
            inbox.pop_front();
        }
        inbox.push_back(incoming);
    }

    fn deliver_to_taken(&mut self, incoming: Incoming) {
        for address in 1..self.taken.len() {
            if self.taken[address] {
                self.deliver(address, incoming);
            }
        }
    }
}

impl Outlet {
    /// The number of the next request.
    pub fn next_number(&self) -> u32 {
        self.sequence.fetch_add(1, Ordering::SeqCst)
    }

    /// How often a head was stopped past its turns.
    pub fn stops(&self, address: u8) -> u64 {
        self.stops[usize::from(address & 7)].load(Ordering::SeqCst)
    }

    fn send(&self, packet: &Packet, inquiry: bool, number: u32) -> Result<()> {
        if self.transport != Transport::OverIp {
            return self.send_bytes(packet.bytes());
        }
        let kind = if inquiry { Kind::Inquiry } else { Kind::Command };
        self.send_bytes(&Message { kind, sequence: number, payload: packet.bytes() }.encode())
    }

    fn send_reset(&self) -> Result<()> {
        self.sequence.store(0, Ordering::SeqCst);
        self.send_bytes(&Message { kind: Kind::Control, sequence: 0, payload: Control::Reset.payload() }.encode())
    }

    fn send_bytes(&self, bytes: &[u8]) -> Result<()> {
        // Not held while sending: a line that takes nothing must not keep others from trying.
        let sender = self.slot().clone();
        let gone = || Error::DeviceLost { reason: "the line is not open".into() };
        sender.ok_or_else(gone)?.send(bytes)
    }

    fn slot(&self) -> MutexGuard<'_, Option<Arc<dyn Sender>>> {
        unpoisoned(&self.sender)
    }

    /// Stops a head and its zoom, past all turns and without waiting. Twice, and what runs is
    /// cancelled in between: a camera with both sockets busy refuses the first time.
    pub fn stop(&self, model: &Model, address: u8) -> Result<()> {
        self.stops[usize::from(address & 7)].fetch_add(1, Ordering::SeqCst);
        let stop = [Request::STOP, Request::Zoom(Zooming::Stop)];
        let cancel = [Request::Cancel(1), Request::Cancel(2)];
        let sent = stop
            .iter()
            .chain(&cancel)
            .chain(&stop)
            .map(|request| self.send(&request.encode(model, address), false, self.next_number()))
            .collect::<Vec<_>>();
        // Each is worth trying, whatever became of the others.
        sent.into_iter().collect()
    }
}

/// Stops one head.
pub struct LineBrake {
    pub outlet: Arc<Outlet>,
    pub model: &'static Model,
    pub address: u8,
}

impl Brake for LineBrake {
    fn stop(&self) -> Result<()> {
        self.outlet.stop(self.model, self.address)
    }
}
