//! The emulator: cameras on a chain, driven by a clock and nothing else.

use super::body::Head;
use super::camera::{Behaviour, Camera, Said};
use super::faults::{Dealer, Fault as LineFault, FaultKind};
use super::wire::{Origin, Outgoing, Wire, byte_time};
use crate::device::visca::codec::{BROADCAST, Fault, Framer, MAX_PACKET, Packet, Reply, Request};
use crate::device::visca::models::Model;
use crate::error::{Error, Result};
use crate::sim::Simulator;

/// Cameras that a chain has room for.
const MAX_CAMERAS: usize = 7;

/// What is emulated.
#[derive(Debug, Clone, PartialEq)]
pub struct EmulatorOptions {
    /// The cameras in the order of the chain, 1 to 7. The first has address 1.
    pub models: Vec<&'static Model>,
    pub behaviour: Behaviour,
    /// Bits per second of the line; 0: no time passes on it.
    pub baud: f64,
    /// Delays and faults follow from it.
    pub seed: u64,
    pub faults: Vec<LineFault>,
}

impl Default for EmulatorOptions {
    fn default() -> Self {
        Self {
            models: vec![&Model::EVI_D100],
            behaviour: Behaviour::default(),
            baud: 9600.0,
            seed: 1,
            faults: Vec::new(),
        }
    }
}

/// Emulated VISCA cameras. It does no input or output and knows no clock: bytes go in by
/// [`feed`](Self::feed) and come out of [`poll`](Self::poll), both with the moment, which never goes
/// back. The same calls give the same bytes.
pub struct Emulator {
    cameras: Vec<Camera>,
    wire: Wire,
    dealer: Dealer,
    framer: Framer,
    /// Seconds a byte takes, and until when the line from the controller is busy.
    byte_time: f64,
    heard_until: f64,
    /// Neither hears nor says anything until then.
    silent_until: f64,
    /// The link is down until then.
    unplugged_until: f64,
    /// How often it was unplugged.
    unplugged: u64,
    requests: u64,
}

impl Emulator {
    /// Cameras with heads of their own.
    ///
    /// # Errors
    /// `InvalidArgument` for no camera or more than 7, and for numbers out of range.
    pub fn new(options: &EmulatorOptions) -> Result<Self> {
        let EmulatorOptions { models, behaviour, baud, seed, faults } = options;
        if !(1..=MAX_CAMERAS).contains(&models.len()) {
            return Err(Error::invalid("models", format!("{} cameras, a chain has 1 to {MAX_CAMERAS}", models.len())));
        }
        if !(*baud == 0.0 || (300.0..=1e6).contains(baud)) {
            return Err(Error::invalid("baud", format!("{baud} is neither 0 nor from 300 to 1000000")));
        }
        if !(0.0..=1.0).contains(&behaviour.frame_time) {
            return Err(Error::invalid("frame_time", format!("{} s is not from 0 to 1", behaviour.frame_time)));
        }
        let camera = |(i, model): (usize, &&'static Model)| {
            Camera::new(model, i as u8 + 1, Head::own(model.pan.step().min(model.tilt.step())), *behaviour)
        };
        let mut emulator = Self {
            cameras: models.iter().enumerate().map(camera).collect(),
            wire: Wire::new(*baud),
            dealer: Dealer::new(*seed),
            framer: Framer::new(),
            byte_time: byte_time(*baud),
            heard_until: 0.0,
            silent_until: 0.0,
            unplugged_until: 0.0,
            unplugged: 0,
            requests: 0,
        };
        emulator.set_faults(faults)?;
        Ok(emulator)
    }

    /// The first camera moves the simulator's head, and its clock is the one that counts. The
    /// simulator's own encoder step should be 0: the camera's units are the steps.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_simulator(options: &EmulatorOptions, simulator: &Simulator) -> Result<Self> {
        let mut emulator = Self::new(options)?;
        let model = emulator.cameras[0].model;
        emulator.cameras[0] = Camera::new(model, 1, Head::Simulated(simulator.0.clone()), options.behaviour);
        Ok(emulator)
    }

    /// Changes what goes wrong from now on.
    ///
    /// # Errors
    /// `InvalidArgument` for a probability that is none, or a negative time.
    pub fn set_faults(&mut self, faults: &[LineFault]) -> Result<()> {
        faults.iter().try_for_each(LineFault::validate)?;
        self.dealer.set(faults);
        Ok(())
    }

    /// Takes bytes of a serial line.
    pub fn feed(&mut self, bytes: &[u8], now: f64) {
        self.feed_line(bytes, Origin::default(), now);
    }

    pub(super) fn feed_line(&mut self, bytes: &[u8], origin: Origin, now: f64) {
        self.finish(now);
        if !self.is_plugged(now) {
            return;
        }
        self.heard_until = self.heard_until.max(now);
        for byte in self.dealer.damage(bytes, now) {
            self.heard_until += self.byte_time;
            if let Some(packet) = self.framer.push(byte) {
                self.take(&packet, origin, self.heard_until);
            }
        }
    }

    /// Takes one datagram that holds one packet, and answers to its origin. What is no packet is
    /// answered by a syntax error.
    pub fn feed_packet(&mut self, bytes: &[u8], origin: Origin, now: f64) {
        if self.is_reached(now) {
            self.take_packet(bytes, origin, now);
        }
    }

    /// Does a datagram come through to the camera?
    pub(super) fn is_reached(&mut self, now: f64) -> bool {
        self.finish(now);
        self.is_plugged(now) && self.dealer.strikes(FaultKind::Lose, now).is_none()
    }

    /// What [`feed_packet`](Self::feed_packet) does with a datagram that came through.
    pub(super) fn take_packet(&mut self, bytes: &[u8], origin: Origin, now: f64) {
        let bytes = self.dealer.damage(bytes, now);
        match Packet::from_bytes(&bytes) {
            Some(packet) => self.take(&packet, origin, now),
            None => {
                let fault = if bytes.len() > MAX_PACKET { Fault::Length } else { Fault::Syntax };
                let address = self.cameras[0].address;
                self.say(address, &Said { time: now, origin, reply: Reply::Error { socket: 0, fault } });
            }
        }
    }

    /// The next that has left by `now`, if any.
    pub fn poll(&mut self, now: f64) -> Option<Outgoing> {
        self.finish(now);
        if !self.is_plugged(now) {
            self.wire.clear();
        }
        while let Some(outgoing) = self.wire.receive(now) {
            if outgoing.time >= self.silent_until {
                return Some(outgoing);
            }
        }
        None
    }

    /// When something happens next without anything being fed.
    pub fn next_event(&self, now: f64) -> Option<f64> {
        let ends = self.cameras.iter().filter_map(Camera::next_end);
        let plugged = (now < self.unplugged_until).then_some(self.unplugged_until);
        let moments = [self.wire.next(), plugged, self.dealer.next_moment(FaultKind::Unplug)];
        ends.chain(moments.into_iter().flatten()).min_by(f64::total_cmp)
    }

    /// Is the link up? A fault that unplugs at a moment does so here.
    pub fn is_plugged(&mut self, now: f64) -> bool {
        if self.dealer.next_moment(FaultKind::Unplug).is_some_and(|t| t <= now) {
            self.unplug(now);
        }
        now >= self.unplugged_until
    }

    /// How often the link was unplugged: one that was opened before is dead.
    pub fn times_unplugged(&self) -> u64 {
        self.unplugged
    }

    /// Packets heard so far, those for nobody included.
    pub fn requests(&self) -> u64 {
        self.requests
    }

    /// Where a camera's head is, device units (pan, tilt); `None` without such a camera.
    pub fn position(&mut self, camera: usize, now: f64) -> Option<[i32; 2]> {
        self.cameras.get_mut(camera).map(|c| c.position(now))
    }

    /// Where a camera's zoom is, device units.
    pub fn zoom(&self, camera: usize, now: f64) -> Option<u16> {
        self.cameras.get(camera).map(|c| c.zoom(now))
    }

    pub(super) fn dealer(&mut self) -> &mut Dealer {
        &mut self.dealer
    }

    fn unplug(&mut self, now: f64) {
        if let Some(seconds) = self.dealer.strikes(FaultKind::Unplug, now) {
            self.unplugged_until = now + seconds;
            self.unplugged += 1;
            self.wire.clear();
            self.framer = Framer::new();
        }
    }

    fn finish(&mut self, now: f64) {
        for i in 0..self.cameras.len() {
            let mut said = Vec::new();
            self.cameras[i].finish(now, &mut said);
            let address = self.cameras[i].address;
            said.iter().for_each(|s| self.say(address, s));
        }
    }

    fn take(&mut self, packet: &Packet, origin: Origin, now: f64) {
        // Its own echo, or what another camera says.
        if packet.sender() != 0 {
            return;
        }
        self.requests += 1;
        if let Some(seconds) = self.dealer.strikes(FaultKind::Silence, now) {
            self.silent_until = now + seconds;
        }
        self.unplug(now);
        if now < self.silent_until || now < self.unplugged_until {
            return;
        }
        if self.dealer.strikes(FaultKind::NetworkChange, now).is_some() {
            let address = self.cameras[0].address;
            self.say(address, &Said { time: now, origin, reply: Reply::NetworkChange });
        }
        if packet.receiver() == BROADCAST {
            return self.broadcast(packet, origin, now);
        }
        let Some(i) = self.cameras.iter().position(|c| c.address == packet.receiver()) else { return };
        let camera = &mut self.cameras[i];
        let mut said = Vec::new();
        camera.take(Request::decode(camera.model, packet), origin, now, &mut self.dealer, &mut said);
        let address = camera.address;
        said.iter().for_each(|s| self.say(address, s));
    }

    /// A broadcast goes through all cameras and comes back.
    fn broadcast(&mut self, packet: &Packet, origin: Origin, now: f64) {
        let reply = match Request::decode(self.cameras[0].model, packet) {
            Ok(Request::AddressSet) => {
                for (camera, address) in self.cameras.iter_mut().zip(1..) {
                    camera.address = address;
                }
                Reply::AddressSet { next: self.cameras.len() as u8 + 1 }
            }
            Ok(Request::ClearAll) => {
                self.cameras.iter_mut().for_each(|camera| camera.clear(now));
                Reply::ClearedAll
            }
            // Nobody is meant.
            _ => return,
        };
        self.say(0, &Said { time: now, origin, reply });
    }

    fn say(&mut self, address: u8, said: &Said) {
        self.wire.send(said.time, said.origin, said.reply.encode(address).bytes(), &mut self.dealer);
    }
}
