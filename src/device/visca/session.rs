//! The dialogue with one camera: which reply belongs to what, and what is done when none comes.

use std::sync::Arc;

use super::bus::{Bus, Incoming, Transport, Turn};
use super::codec::ip::Control;
use super::codec::{Answer, DriveState, Fault, Inquiry, Packet, PresetAction, Register, Reply, Request, Version};
use super::jobs::{Axis, Jobs, Progress};
use super::models::Model;
use crate::control::{Clock, Log, LogLevel};
use crate::error::{Error, Result};

/// Time for a reply: four frames of the camera, and the way there and back, seconds.
const PATIENCE: f64 = 0.4;
/// Over IP, before the same message is sent again; and how often.
const PATIENCE_OVER_IP: f64 = 0.2;
const TRANSMISSIONS_OVER_IP: usize = 3;
/// Tries of what is not answered, of what finds the sockets busy, of what is not executable.
const TRIES: u32 = 3;
const TRIES_BUSY: u32 = 3;
const TRIES_REFUSED: u32 = 2;
/// For a socket to become free, seconds.
const BUSY_WAIT: f64 = 0.3;
/// For a head that was stopped to stand still, seconds.
const STOP_WAIT: f64 = 1.5;
/// Replies to a stop that nobody waited for: silence that ends them, and at most, seconds.
const HUSH: f64 = 0.15;
const LONGEST_HUSH: f64 = 0.6;
/// No request takes longer than this and one more try, whatever goes wrong, seconds.
pub const LONGEST_CALL: f64 = 10.0;
/// Replies during one try.
const MAX_REPLIES: usize = 100;
/// Meaningless bytes that point to a wrong baud rate.
const GARBAGE: u64 = 4;
/// A camera that was set up anew answers within this, seconds.
const RECOVERY: f64 = 2.0;

enum Outcome {
    Answered(Answer),
    Accepted,
    Refused(Fault),
    Silent,
}

/// A dialogue with one camera of a line.
pub struct Session {
    bus: Arc<Bus>,
    clock: Arc<dyn Clock>,
    log: Log,
    model: &'static Model,
    address: u8,
    generation: u64,
    /// Stops whose replies have been taken in, and those before the present call.
    stops: u64,
    stops_before: u64,
    jobs: Jobs,
    /// Answers of another form than the model's, during this call.
    unclear: u32,
    /// Kinds of requests that the camera has understood so far: the beginnings of their bytes.
    understood: Vec<[u8; 3]>,
}

impl Session {
    /// Takes the address; asks nothing yet.
    ///
    /// # Errors
    /// `DeviceBusy` when another head has the address.
    pub fn new(bus: Arc<Bus>, clock: Arc<dyn Clock>, log: Log, model: &'static Model, address: u8) -> Result<Self> {
        bus.take_address(address)?;
        Ok(Self {
            stops: bus.outlet().stops(address),
            stops_before: bus.outlet().stops(address),
            bus,
            clock,
            log,
            model,
            address,
            generation: 0,
            jobs: Jobs::default(),
            unclear: 0,
            understood: Vec::new(),
        })
    }

    pub fn model(&self) -> &'static Model {
        self.model
    }

    pub fn set_model(&mut self, model: &'static Model) {
        self.model = model;
    }

    pub fn address(&self) -> u8 {
        self.address
    }

    pub fn bus(&self) -> &Arc<Bus> {
        &self.bus
    }

    /// Changes when the camera was made to forget everything, as after it was unplugged.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    pub fn now(&self) -> f64 {
        self.clock.now()
    }

    pub fn progress(&self, axis: Axis) -> Progress {
        self.jobs.progress(axis)
    }

    /// Forgets the last move: it was stopped, or seen to have ended.
    pub fn set_done(&mut self) {
        self.jobs.set_done();
    }

    /// # Errors
    /// As [`command`](Self::command).
    pub fn inquire(&mut self, inquiry: Inquiry) -> Result<Answer> {
        match self.perform(&Request::Inquire(inquiry))? {
            Some(answer) => Ok(answer),
            None => Err(Error::Internal { reason: "an inquiry without an answer".into() }),
        }
    }

    /// # Errors
    /// `DeviceLost`, `DeviceTimeout`, `DeviceGarbled`, `DeviceMismatch`, `DeviceRefused`; `Cancelled`
    /// when the head was stopped from elsewhere meanwhile.
    pub fn command(&mut self, request: Request) -> Result<()> {
        self.perform(&request).map(drop)
    }

    /// Begins a call: takes in what has arrived. A stop from now on ends the call's moves.
    pub fn begin_call(&mut self) -> Result<()> {
        self.stops_before = self.bus.outlet().stops(self.address);
        let (bus, clock) = (self.bus.clone(), self.clock.clone());
        let mut turn = bus.turn(&*clock)?;
        self.catch_up(&mut turn)?;
        let now = clock.now();
        self.absorb(&mut turn, now)
    }

    /// Makes the camera known: its version; None when it does not answer that question.
    pub fn identify(&mut self) -> Result<Option<Version>> {
        match self.inquire(Inquiry::Version) {
            Ok(Answer::Version(version)) => Ok(Some(version)),
            Ok(_) | Err(Error::DeviceRefused { .. }) => Ok(None),
            Err(error) => Err(error),
        }
    }

    fn perform(&mut self, request: &Request) -> Result<Option<Answer>> {
        let (bus, clock) = (self.bus.clone(), self.clock.clone());
        let mut turn = bus.turn(&*clock)?;
        let start = clock.now();
        let garbage = turn.garbage();
        self.unclear = 0;
        let (mut silent, mut busy, mut refused, mut misread, mut recovered) = (0, 0, 0, 0, false);
        let kind = kind_of(&request.encode(self.model, self.address));
        self.catch_up(&mut turn)?;
        loop {
            self.give_way(request)?;
            let outcome = self.attempt(&mut turn, request)?;
            if matches!(outcome, Outcome::Answered(_) | Outcome::Accepted) && !self.understood.contains(&kind) {
                self.understood.push(kind);
            }
            self.give_way(request)?;
            match outcome {
                // Or is it a reply to the stop?
                Outcome::Refused(_) if bus.outlet().stops(self.address) != self.stops => self.catch_up(&mut turn)?,
                Outcome::Answered(answer) => return Ok(Some(answer)),
                Outcome::Accepted => return Ok(None),
                Outcome::Refused(Fault::BufferFull) => {
                    busy += 1;
                    if busy >= TRIES_BUSY {
                        return Err(refusal("it is busy with two other commands"));
                    }
                    self.absorb(&mut turn, clock.now() + BUSY_WAIT)?;
                }
                Outcome::Refused(Fault::NotExecutable) => {
                    refused += 1;
                    if refused >= TRIES_REFUSED || !moves(request) {
                        return Err(refusal("not in its present state (switched off, in its menu, or moving?)"));
                    }
                    self.halt(&mut turn)?;
                }
                // Never sent again: it would be no better understood, unless the line has damaged it.
                Outcome::Refused(fault) => {
                    misread += 1;
                    if misread >= TRIES || !is_repeatable(request) || !self.understood.contains(&kind) {
                        return Err(refusal(syntax(fault)));
                    }
                }
                Outcome::Silent => {
                    silent += 1;
                    self.log.write(LogLevel::Debug, || {
                        format!("{}: no reply to {:?}", bus.name(), request.encode(self.model, self.address))
                    });
                    if !is_repeatable(request) {
                        return Err(self.silence(&turn, start, garbage));
                    }
                    if silent >= TRIES {
                        if recovered {
                            return Err(self.silence(&turn, start, garbage));
                        }
                        recovered = true;
                        self.recover(&mut turn, start, garbage)?;
                    } else if moves(request) {
                        // Tells whether anybody is there, and brings in a late reply.
                        let _ = self.attempt(&mut turn, &Request::Inquire(Inquiry::Position))?;
                    }
                }
            }
            if clock.now() - start > LONGEST_CALL {
                return Err(self.silence(&turn, start, garbage));
            }
        }
    }

    /// A stop that came from elsewhere during this call wins, whatever their order on the line was.
    fn give_way(&self, request: &Request) -> Result<()> {
        let outlet = self.bus.outlet();
        if !moves(request) || outlet.stops(self.address) == self.stops_before {
            return Ok(());
        }
        outlet.stop(self.model, self.address)?;
        Err(Error::Cancelled)
    }

    /// What happened since the last turn: the cameras were made to forget, or the head was stopped.
    fn catch_up(&mut self, turn: &mut Turn<'_>) -> Result<()> {
        if turn.generation() != self.generation {
            self.generation = turn.generation();
            self.jobs.forget();
        }
        let stops = self.bus.outlet().stops(self.address);
        if stops != self.stops {
            self.stops = stops;
            let end = self.clock.now() + LONGEST_HUSH;
            for _ in 0..MAX_REPLIES {
                let until = (self.clock.now() + HUSH).min(end);
                let Some(incoming) = turn.receive(self.address, until)? else { break };
                self.judge(None, incoming, true);
            }
            self.set_done();
        }
        Ok(())
    }

    /// Takes in replies until the clock shows `until`.
    fn absorb(&mut self, turn: &mut Turn<'_>, until: f64) -> Result<()> {
        for _ in 0..MAX_REPLIES {
            let Some(incoming) = turn.receive(self.address, until)? else { break };
            self.judge(None, incoming, true);
        }
        Ok(())
    }

    /// Sends once (over IP: until it has arrived) and waits for what becomes of it.
    fn attempt(&mut self, turn: &mut Turn<'_>, request: &Request) -> Result<Outcome> {
        let now = self.clock.now();
        self.absorb(turn, now)?;
        let over_ip = self.bus.transport() == Transport::OverIp;
        let (patience, transmissions) = if over_ip { (PATIENCE_OVER_IP, TRANSMISSIONS_OVER_IP) } else { (PATIENCE, 1) };
        let packet = request.encode(self.model, self.address);
        let number = self.bus.outlet().next_number();
        for transmission in 0..transmissions {
            turn.send(&packet, request.is_inquiry(), number)?;
            let until = self.clock.now() + patience;
            for _ in 0..MAX_REPLIES {
                let Some(incoming) = turn.receive(self.address, until)? else { break };
                match incoming {
                    Incoming::Control(Control::BadSequence, of) if of == number && transmission > 0 => {
                        // It came through, and its reply was lost; or a stop has overtaken it.
                        if request.is_inquiry() || self.bus.outlet().stops(self.address) != self.stops {
                            return Ok(Outcome::Silent);
                        }
                        self.jobs.begin(axis_of(request), None);
                        return Ok(Outcome::Accepted);
                    }
                    Incoming::Control(Control::BadSequence, of) if of == number => {
                        turn.set_up()?;
                        self.catch_up(turn)?;
                        return Ok(Outcome::Silent);
                    }
                    Incoming::Control(..) => (),
                    Incoming::Reply(_, of) => {
                        let mine = of.is_none_or(|of| of == number);
                        if let Some(outcome) = self.judge(Some(request), incoming, mine) {
                            return Ok(outcome);
                        }
                    }
                }
            }
        }
        Ok(Outcome::Silent)
    }

    /// What a reply means while `request` waits for its own; None when it is about something else.
    fn judge(&mut self, request: Option<&Request>, incoming: Incoming, mine: bool) -> Option<Outcome> {
        let Incoming::Reply(reply, _) = incoming else { return None };
        let asked = request.filter(|_| mine);
        let command = asked.filter(|request| !request.is_inquiry());
        match reply {
            Reply::Ack { socket } => {
                if let Some(request) = command {
                    self.jobs.begin(axis_of(request), Some(socket));
                    return Some(Outcome::Accepted);
                }
                // Late, or to a stop that nobody waits for.
                self.jobs.begin_unknown(socket);
                None
            }
            Reply::Completion { socket } => {
                if self.jobs.end(socket, Progress::Done) {
                    return None;
                }
                // Its acknowledgement was lost.
                command.map(|request| self.begin_and_end(request))
            }
            Reply::Cleared => command.map(|request| self.begin_and_end(request)),
            Reply::Inquiry(payload) => {
                let Some(Request::Inquire(inquiry)) = asked else { return None };
                let answer = Answer::decode(self.model, *inquiry, &payload);
                self.unclear += u32::from(answer.is_none());
                answer.map(Outcome::Answered)
            }
            Reply::Error { socket, fault } => {
                let stopped = matches!(fault, Fault::Cancelled | Fault::NoSocket);
                // Refusals of what is new bear socket 0, or one that is free.
                let how = if stopped { Progress::Done } else { Progress::Failed };
                if (stopped || socket != 0) && self.jobs.end(socket, how) {
                    return None;
                }
                match fault {
                    Fault::Cancelled | Fault::NoSocket => None,
                    fault => asked.map(|_| Outcome::Refused(fault)),
                }
            }
            Reply::AddressSet { .. } | Reply::ClearedAll | Reply::NetworkChange => None,
        }
    }

    fn begin_and_end(&mut self, request: &Request) -> Outcome {
        self.jobs.begin_and_end(axis_of(request));
        Outcome::Accepted
    }

    /// Stops the head and waits until it stands.
    fn halt(&mut self, turn: &mut Turn<'_>) -> Result<()> {
        self.attempt(turn, &Request::STOP)?;
        let end = self.clock.now() + STOP_WAIT;
        while self.clock.now() < end {
            if self.model.reports_mode {
                match self.attempt(turn, &Request::Inquire(Inquiry::Mode))? {
                    Outcome::Answered(Answer::Mode(mode)) if mode.state() != DriveState::Moving => break,
                    _ => (),
                }
            }
            self.absorb(turn, self.clock.now() + 0.1)?;
            if !self.model.reports_mode {
                break;
            }
        }
        Ok(())
    }

    /// Starts from nothing with a camera that was silent too often.
    fn recover(&mut self, turn: &mut Turn<'_>, start: f64, garbage: u64) -> Result<()> {
        self.log.write(LogLevel::Warning, || format!("{}: silent; it is set up anew", self.bus.name()));
        turn.send(&Request::STOP.encode(self.model, self.address), false, self.bus.outlet().next_number())?;
        turn.set_up()?;
        self.catch_up(turn)?;
        if self.bus.transport() != Transport::Serial {
            self.attempt(turn, &Request::Clear)?;
        }
        let end = self.clock.now() + RECOVERY;
        while self.clock.now() < end {
            match self.attempt(turn, &Request::Inquire(Inquiry::Version))? {
                Outcome::Silent => self.absorb(turn, self.clock.now() + HUSH)?,
                // Whatever it says, it is there.
                _ => return Ok(()),
            }
        }
        Err(self.silence(turn, start, garbage))
    }

    /// Why nothing that could be understood came.
    fn silence(&self, turn: &Turn<'_>, start: f64, garbage: u64) -> Error {
        let device = format!("camera {} at {}", self.address, self.bus.name());
        let garbage = turn.garbage() - garbage;
        if let Some(cameras) = turn.cameras().filter(|&cameras| cameras < self.address) {
            return Error::DeviceNotFound { device, reason: format!("the chain has {cameras} camera(s)") };
        }
        if self.unclear > 1 {
            return Error::DeviceMismatch {
                device,
                reason: format!("its answers do not have the form of the {}'s", self.model.title),
            };
        }
        if garbage >= GARBAGE && self.bus.transport() == Transport::Serial {
            let reason = format!("{garbage} bytes came that are no VISCA messages: is the baud rate right?");
            return Error::DeviceGarbled { device, reason };
        }
        if garbage >= GARBAGE {
            return Error::DeviceMismatch { device, reason: "what answers there does not speak VISCA".into() };
        }
        Error::DeviceTimeout { what: "camera", seconds: ((self.clock.now() - start) * 10.0).round() / 10.0 }
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.bus.free_address(self.address);
    }
}

fn axis_of(request: &Request) -> Option<Axis> {
    match request {
        Request::MoveTo { .. }
        | Request::MoveBy { .. }
        | Request::Home
        | Request::Reset
        | Request::Preset(PresetAction::Recall, _) => Some(Axis::Head),
        Request::Set(Register::Zoom, _) => Some(Axis::Zoom),
        _ => None,
    }
}

/// The beginning of a request's body, which says what is asked.
fn kind_of(packet: &Packet) -> [u8; 3] {
    std::array::from_fn(|i| packet.body().get(i).copied().unwrap_or_default())
}

/// Does it set something in motion?
fn moves(request: &Request) -> bool {
    axis_of(request).is_some()
        || matches!(request, Request::Drive { .. } | Request::Zoom(_)) && *request != Request::STOP
}

/// Is it the same done once or twice?
fn is_repeatable(request: &Request) -> bool {
    !matches!(request, Request::MoveBy { .. } | Request::OnePushWhite)
}

fn refusal(reason: impl Into<String>) -> Error {
    Error::DeviceRefused { reason: reason.into() }
}

fn syntax(fault: Fault) -> String {
    match fault {
        Fault::Syntax | Fault::Length => "it does not know this command (syntax error)".into(),
        other => format!("{other:?}"),
    }
}
