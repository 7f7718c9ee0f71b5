//! The driver against a scripted camera in memory, under a virtual clock.

mod dialogue;
mod head;
mod lines;

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard};

use super::bus::{Bus, Transport};
use super::codec::ip::{Control, Kind, Message};
use super::codec::{
    Answer, DriveState, Fault, Framer, Inquiry, ModeWord, Packet, PresetAction, Register, Reply, Request, Version,
};
use super::driver::ViscaHead;
use super::models::Model;
use crate::control::{Clock, Log};
use crate::device::{Link, Sender, Surroundings};
use crate::error::{Error, Result};

/// A reply takes so long, seconds.
const LATENCY: f64 = 0.02;
/// A move takes so long.
const MOVE: f64 = 0.5;

type Matching = fn(&Request) -> bool;
type Hook = Box<dyn FnMut(&Request) + Send>;

/// What the next matching requests get instead of the usual reply.
#[derive(Clone)]
enum Instead {
    /// Nothing, and the camera does nothing.
    Nothing,
    /// Nothing, though the camera does it.
    Silently,
    Fault(Fault),
    /// These bytes after so many seconds, and the camera does nothing.
    Bytes(f64, Vec<u8>),
    /// These bytes before the usual reply.
    Before(Vec<u8>),
}

/// A chain of cameras that do what they are told, but for what the script says.
struct Script {
    now: f64,
    transport: Transport,
    model: &'static Model,
    ids: Vec<u16>,
    at: [i32; 2],
    registers: Vec<(Register, u16)>,
    /// End and target of the move, if one is under way.
    moving: Option<(f64, [i32; 2], u8)>,
    failed: bool,
    tells_completion: bool,
    knows_version: bool,
    sockets: u8,
    instead: VecDeque<(Matching, Instead)>,
    /// Moment and bytes of what is on its way to the controller.
    coming: Vec<(f64, Vec<u8>)>,
    framer: Framer,
    last_number: Option<u32>,
    /// All requests so far, as they were understood, with the camera's address.
    heard: Vec<(u8, Request)>,
    messages: Vec<Vec<u8>>,
    plugged: bool,
    openings: u32,
    /// Called with each request while the controller waits.
    on_request: Option<Hook>,
}

#[derive(Clone)]
struct Camera(Arc<Mutex<Script>>);

impl Camera {
    fn new(model: &'static Model, transport: Transport) -> Self {
        Self(Arc::new(Mutex::new(Script {
            now: 100.0,
            transport,
            model,
            ids: vec![model.ids.first().copied().unwrap_or(0x999)],
            at: [0, 0],
            registers: Register::ALL.map(|r| (r, 0)).to_vec(),
            moving: None,
            failed: false,
            tells_completion: true,
            knows_version: true,
            sockets: 0,
            instead: VecDeque::new(),
            coming: Vec::new(),
            framer: Framer::new(),
            last_number: None,
            heard: Vec::new(),
            messages: Vec::new(),
            plugged: true,
            openings: 0,
            on_request: None,
        })))
    }

    fn script(&self) -> MutexGuard<'_, Script> {
        self.0.lock().unwrap()
    }

    fn surroundings(&self) -> Surroundings {
        Surroundings { clock: Arc::new(self.clone()), log: Log::silent(), credentials: None }
    }

    fn bus(&self) -> Arc<Bus> {
        let (camera, transport) = (self.clone(), self.script().transport);
        Bus::new("script", transport, Box::new(move || camera.open()))
    }

    fn open(&self) -> Result<Box<dyn Link>> {
        let mut script = self.script();
        script.openings += 1;
        if !script.plugged {
            return Err(Error::DeviceNotFound { device: "script".into(), reason: "unplugged".into() });
        }
        Ok(Box::new(self.clone()))
    }

    /// A head, and nothing in the record.
    fn head(&self) -> ViscaHead {
        let model = self.script().model;
        let head = ViscaHead::open(self.bus(), 1, Some(model), &self.surroundings()).unwrap();
        self.script().heard.clear();
        self.script().messages.clear();
        head
    }

    fn instead(&self, matching: Matching, what: Instead) -> &Self {
        self.script().instead.push_back((matching, what));
        self
    }

    fn heard(&self) -> Vec<Request> {
        self.script().heard.iter().map(|(_, request)| *request).collect()
    }

    fn count(&self, matching: Matching) -> usize {
        self.heard().iter().filter(|request| matching(request)).count()
    }

    fn pass(&self, seconds: f64) {
        self.script().now += seconds;
    }

    /// Sends bytes of its own accord.
    fn say(&self, bytes: &[u8]) {
        let mut script = self.script();
        let now = script.now;
        script.coming.push((now, bytes.to_vec()));
    }
}

impl Clock for Camera {
    fn now(&self) -> f64 {
        self.script().now
    }

    fn sleep(&self, seconds: f64) {
        self.pass(seconds);
    }
}

impl Link for Camera {
    fn receive(&mut self, buffer: &mut [u8], timeout: f64) -> Result<usize> {
        let mut script = self.script();
        if !script.plugged {
            return Err(Error::DeviceLost { reason: "unplugged".into() });
        }
        let end = script.now + timeout;
        let next = (0..script.coming.len()).min_by(|&a, &b| script.coming[a].0.total_cmp(&script.coming[b].0));
        match next {
            Some(i) if script.coming[i].0 <= end => {
                let (time, bytes) = script.coming.remove(i);
                script.now = script.now.max(time);
                buffer[..bytes.len()].copy_from_slice(&bytes);
                Ok(bytes.len())
            }
            _ => {
                script.now = end;
                Ok(0)
            }
        }
    }

    fn sender(&self) -> Arc<dyn Sender> {
        Arc::new(self.clone())
    }
}

impl Sender for Camera {
    fn send(&self, bytes: &[u8]) -> Result<()> {
        let hook = {
            let mut script = self.script();
            if !script.plugged {
                return Err(Error::DeviceLost { reason: "unplugged".into() });
            }
            script.messages.push(bytes.to_vec());
            let before = script.heard.len();
            script.take(bytes);
            let request = script.heard.get(before).map(|(_, request)| *request);
            request.and_then(|request| script.on_request.take().map(|hook| (hook, request)))
        };
        if let Some((mut hook, request)) = hook {
            hook(&request);
            self.script().on_request.get_or_insert(hook);
        }
        Ok(())
    }
}

impl Script {
    fn take(&mut self, bytes: &[u8]) {
        if self.transport != Transport::OverIp {
            for &byte in bytes {
                if let Some(packet) = self.framer.push(byte) {
                    self.answer(&packet, None);
                }
            }
            return;
        }
        let message = Message::decode(bytes).unwrap();
        let control = |control: Control, number| {
            Message { kind: Kind::ControlReply, sequence: number, payload: control.payload() }.encode()
        };
        if message.kind == Kind::Control {
            self.last_number = None;
            self.coming.push((self.now + LATENCY, control(Control::Reset, message.sequence)));
        } else if self.last_number.is_some_and(|last| message.sequence <= last) {
            self.coming.push((self.now + LATENCY, control(Control::BadSequence, message.sequence)));
        } else {
            let packet = Packet::from_bytes(message.payload).unwrap();
            let script_says_nothing = {
                let request = Request::decode(self.model, &packet).unwrap();
                matches!(self.instead.front(), Some((matching, Instead::Nothing)) if matching(&request))
            };
            if !script_says_nothing {
                self.last_number = Some(message.sequence);
            }
            self.answer(&packet, Some(message.sequence));
        }
    }

    fn answer(&mut self, packet: &Packet, number: Option<u32>) {
        let request = Request::decode(self.model, packet);
        let address = packet.receiver();
        self.heard.extend(request.map(|request| (address, request)));
        let mut mute = false;
        if let Some((_, what)) =
            request.ok().and_then(|r| if self.instead.front()?.0(&r) { self.instead.pop_front() } else { None })
        {
            match what {
                Instead::Nothing => return,
                Instead::Silently => mute = true,
                Instead::Fault(fault) => return self.say(address, Reply::Error { socket: 0, fault }, LATENCY, number),
                Instead::Bytes(delay, bytes) => return self.coming.push((self.now + delay, bytes)),
                Instead::Before(bytes) => self.coming.push((self.now, bytes)),
            }
        }
        let count = self.coming.len();
        match request {
            Ok(request) => self.obey(address, request, number),
            Err(fault) => self.say(address, Reply::Error { socket: 0, fault }, LATENCY, number),
        }
        if mute {
            self.coming.truncate(count);
        }
    }

    fn say(&mut self, address: u8, reply: Reply, delay: f64, number: Option<u32>) {
        let packet = reply.encode(address);
        let bytes = match number {
            None => packet.bytes().to_vec(),
            Some(sequence) => Message { kind: Kind::Reply, sequence, payload: packet.bytes() }.encode(),
        };
        self.coming.push((self.now + delay, bytes));
    }

    fn position(&mut self) -> [i32; 2] {
        if let Some((_, target, _)) = self.moving.filter(|m| m.0 <= self.now) {
            self.at = target;
            self.moving = None;
        }
        self.at
    }

    fn obey(&mut self, address: u8, request: Request, number: Option<u32>) {
        let at = self.position();
        if usize::from(address) > self.ids.len() && !request.is_broadcast() {
            return;
        }
        if let Request::Inquire(inquiry) = request {
            if inquiry == Inquiry::Version && !self.knows_version {
                return self.say(address, Reply::Error { socket: 0, fault: Fault::Syntax }, LATENCY, number);
            }
            let state = match (self.failed, self.moving) {
                (true, _) => DriveState::Failed,
                (_, Some(_)) => DriveState::Moving,
                _ => DriveState::Completed,
            };
            let id = self.ids[usize::from(address) - 1];
            let answer = match inquiry {
                Inquiry::Version => Answer::Version(Version { vendor: 1, model: id, rom: 0x102, sockets: 2 }),
                Inquiry::Position => Answer::Position { pan: at[0], tilt: at[1] },
                Inquiry::MaxSpeed => Answer::MaxSpeed { pan: 0x18, tilt: 0x14 },
                Inquiry::Mode => Answer::Mode(ModeWord::new(state)),
                Inquiry::Register(register) => {
                    Answer::Value(self.registers.iter().find(|r| r.0 == register).unwrap().1)
                }
            };
            let payload = answer.encode(self.model, inquiry).unwrap();
            return self.say(address, Reply::Inquiry(payload), LATENCY, number);
        }
        match request {
            Request::AddressSet => {
                let next = self.ids.len() as u8 + 1;
                return self.say(1, Reply::AddressSet { next }, LATENCY, number);
            }
            Request::ClearAll => return self.say(1, Reply::ClearedAll, LATENCY, number),
            Request::Clear => return self.say(address, Reply::Cleared, LATENCY, number),
            Request::Cancel(socket) => {
                return self.say(address, Reply::Error { socket, fault: Fault::NoSocket }, LATENCY, number);
            }
            _ => (),
        }
        self.sockets = self.sockets % 2 + 1;
        let socket = self.sockets;
        let mut duration = 0.05;
        let go = |script: &mut Self, target| {
            script.moving = Some((script.now + MOVE, target, socket));
            MOVE
        };
        match request {
            Request::MoveTo { pan, tilt, .. } => duration = go(self, [pan, tilt]),
            Request::MoveBy { pan, tilt, .. } => duration = go(self, [at[0] + pan, at[1] + tilt]),
            Request::Home => duration = go(self, [0, 0]),
            Request::Preset(PresetAction::Recall, _) => duration = go(self, [7, 7]),
            Request::Drive { pan: 0, tilt: 0 } => self.moving = None,
            Request::Set(register, value) => {
                self.registers.iter_mut().find(|r| r.0 == register).unwrap().1 = value;
            }
            _ => (),
        }
        self.say(address, Reply::Ack { socket }, LATENCY, number);
        if self.tells_completion {
            self.say(address, Reply::Completion { socket }, LATENCY + duration, number);
        }
    }
}

fn hex(text: &str) -> Vec<u8> {
    text.split_whitespace().map(|b| u8::from_str_radix(b, 16).unwrap()).collect()
}

fn is_move(request: &Request) -> bool {
    matches!(request, Request::MoveTo { .. })
}

fn is_position(request: &Request) -> bool {
    *request == Request::Inquire(Inquiry::Position)
}

fn is_stop(request: &Request) -> bool {
    *request == Request::STOP
}

fn any(_: &Request) -> bool {
    true
}

fn serial(model: &'static Model) -> Camera {
    Camera::new(model, Transport::Serial)
}
