//! One emulated camera: what it does with a request, and what it answers.

use super::body::{Glide, Head};
use super::faults::{Dealer, FaultKind};
use super::registers::Registers;
use super::wire::Origin;
use crate::device::visca::codec::{
    Answer, DriveState, Fault, Inquiry, ModeWord, PresetAction, Register, Reply, Request, Version, Zooming,
};
use crate::device::visca::models::{Axis, Model};

/// Commands that run at the same time.
const SOCKETS: usize = 2;
/// Zoom from end to end at full speed, and focus, seconds.
const ZOOM_TIME: f64 = 2.5;
const FOCUS_TIME: f64 = 1.5;
/// The greatest code of zoom's speed, and the standard one.
const MAX_ZOOM_CODE: u8 = 7;
const STANDARD_ZOOM_CODE: u8 = 4;

/// Vendors as versions state them.
const SONY: u16 = 0x0001;
const OTHER_VENDOR: u16 = 0x0220;
/// Ends of focus, far and near, where the model's are not documented.
const FOCUS: [u16; 2] = [0x1000, 0xc000];

/// How an emulated camera behaves where cameras differ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Behaviour {
    /// Seconds between pictures: a command is acknowledged 1 to 4 of them after it came.
    pub frame_time: f64,
    /// Positions asked for before a move's completion are those of its beginning.
    pub stale_position: bool,
    /// Absolute moves are refused while it drives, moves relatively or goes home.
    pub stop_first: bool,
}

impl Default for Behaviour {
    fn default() -> Self {
        Self { frame_time: 1.0 / 60.0, stale_position: false, stop_first: true }
    }
}

/// A reply and when it begins.
pub(super) struct Said {
    pub time: f64,
    pub origin: Origin,
    pub reply: Reply,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    PanTilt,
    Zoom,
    Focus,
    Settings,
}

/// A command in a socket.
#[derive(Debug, Clone, Copy)]
struct Job {
    origin: Origin,
    part: Part,
    ends: f64,
}

/// What the head was last told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Activity {
    Absolute,
    /// A drive, a relative move or the way home.
    Other,
}

#[derive(Debug, Clone, Copy)]
struct Preset {
    position: [i32; 2],
    zoom: u16,
    focus: u16,
}

pub(super) struct Camera {
    pub model: &'static Model,
    /// 1 to 7.
    pub address: u8,
    behaviour: Behaviour,
    head: Head,
    zoom: Glide,
    focus: Glide,
    registers: Registers,
    presets: Vec<Option<Preset>>,
    sockets: [Option<Job>; SOCKETS],
    activity: Activity,
    /// What the mode word says once the head stands.
    state: DriveState,
    /// Where the last move began, device units.
    began_at: [i32; 2],
    /// Where it says that it is, and is not.
    lie: Option<[i32; 2]>,
    /// Requests are worked at one after the other: until then it is at one.
    busy_until: f64,
}

impl Camera {
    pub fn new(model: &'static Model, address: u8, head: Head, behaviour: Behaviour) -> Self {
        Self {
            model,
            address,
            behaviour,
            head,
            zoom: Glide::resting(model.zoom[0]),
            focus: Glide::resting(focus_ends(model)[0]),
            registers: Registers::new(model.manual_white),
            presets: vec![None; model.presets as usize],
            sockets: [None; SOCKETS],
            activity: Activity::Absolute,
            state: DriveState::None,
            began_at: [0; 2],
            lie: None,
            busy_until: 0.0,
        }
    }

    /// When the next command ends.
    pub fn next_end(&self) -> Option<f64> {
        // Spelt out: of the iterators' version valgrind believes that it reads what is not there.
        self.sockets.iter().fold(None, |earliest: Option<f64>, socket| match (socket, earliest) {
            (Some(job), Some(time)) => Some(job.ends.min(time)),
            (Some(job), None) => Some(job.ends),
            (None, earliest) => earliest,
        })
    }

    /// Says what has ended by then, in that order.
    pub fn finish(&mut self, until: f64, said: &mut Vec<Said>) {
        while let Some(time) = self.next_end().filter(|t| *t <= until) {
            for (i, socket) in self.sockets.iter_mut().enumerate() {
                if let Some(job) = socket.take_if(|job| job.ends <= time) {
                    let reply = Reply::Completion { socket: i as u8 + 1 };
                    said.push(Said { time, origin: job.origin, reply });
                }
            }
        }
    }

    /// Takes a request that came at `now`.
    pub fn take(
        &mut self,
        request: Result<Request, Fault>,
        origin: Origin,
        now: f64,
        dealer: &mut Dealer,
        said: &mut Vec<Said>,
    ) {
        let frames = if matches!(request, Ok(r) if !r.is_inquiry()) { 1.0 + 3.0 * dealer.uniform() } else { 1.0 };
        let time = self.busy_until.max(now) + frames * self.behaviour.frame_time;
        self.busy_until = time;
        self.finish(time, said);
        let reply = match request {
            Err(fault) => Reply::Error { socket: 0, fault },
            Ok(Request::Inquire(inquiry)) => self.answer(inquiry, time),
            Ok(Request::Clear | Request::ClearAll) => {
                self.clear(time);
                Reply::Cleared
            }
            Ok(Request::Cancel(socket)) => return self.cancel(socket, origin, time, said),
            Ok(command) => return self.command(command, origin, time, dealer, said),
        };
        said.push(Said { time, origin, reply });
    }

    /// Forgets all commands and stands still.
    pub fn clear(&mut self, time: f64) {
        for job in std::mem::take(&mut self.sockets).into_iter().flatten() {
            self.stop(job.part, time);
        }
        self.stop(Part::PanTilt, time);
    }

    /// Where the head is, device units.
    pub fn position(&mut self, time: f64) -> [i32; 2] {
        units(self.model, self.head.reading(time))
    }

    pub fn zoom(&self, time: f64) -> u16 {
        self.zoom.value(time)
    }

    fn stop(&mut self, part: Part, time: f64) {
        match part {
            Part::PanTilt => {
                self.head.stop(time);
                self.state = DriveState::None;
            }
            Part::Zoom => self.zoom.stop(time),
            Part::Focus => self.focus.stop(time),
            Part::Settings => {}
        }
    }

    fn cancel(&mut self, socket: u8, origin: Origin, time: f64, said: &mut Vec<Said>) {
        let slot = usize::from(socket).checked_sub(1).and_then(|i| self.sockets.get_mut(i));
        let (origin, fault) = match slot.and_then(Option::take) {
            None => (origin, Fault::NoSocket),
            Some(job) => {
                self.stop(job.part, time);
                (job.origin, Fault::Cancelled)
            }
        };
        said.push(Said { time, origin, reply: Reply::Error { socket, fault } });
    }

    fn command(&mut self, command: Request, origin: Origin, time: f64, dealer: &mut Dealer, said: &mut Vec<Said>) {
        let mut say = |reply| said.push(Said { time, origin, reply });
        let Some(free) = self.sockets.iter().position(Option::is_none) else {
            return say(Reply::Error { socket: 0, fault: Fault::BufferFull });
        };
        let socket = free as u8 + 1;
        match self.execute(command, time, dealer) {
            Err(Fault::Syntax) => say(Reply::Error { socket: 0, fault: Fault::Syntax }),
            Err(fault) => say(Reply::Error { socket, fault }),
            Ok((part, ends)) => {
                say(Reply::Ack { socket });
                // One command moves a part: that before it is over.
                for job in self.sockets.iter_mut().flatten().filter(|job| job.part == part) {
                    job.ends = job.ends.min(time);
                }
                self.sockets[free] = Some(Job { origin, part, ends: ends + self.behaviour.frame_time });
            }
        }
    }

    /// Does it, and says when what moves is there.
    fn execute(&mut self, command: Request, time: f64, dealer: &mut Dealer) -> Result<(Part, f64), Fault> {
        if !self.registers.is_on() && !matches!(command, Request::Set(Register::Power, _)) {
            return Err(Fault::NotExecutable);
        }
        let full = full_speed(self.model);
        let ends = match command {
            Request::Drive { pan: 0, tilt: 0 } => {
                self.stop(Part::PanTilt, time);
                return Ok((Part::PanTilt, time));
            }
            Request::Drive { pan, tilt } => {
                self.drive([pan, tilt], time);
                return Ok((Part::PanTilt, time));
            }
            Request::MoveTo { speed, pan, tilt } => {
                if self.behaviour.stop_first && self.activity == Activity::Other && self.head.is_moving(time) {
                    return Err(Fault::NotExecutable);
                }
                self.go([pan, tilt], speed, Activity::Absolute, time, dealer)
            }
            Request::MoveBy { speed, pan, tilt } => {
                let from = self.position(time);
                let to = [from[0].saturating_add(pan), from[1].saturating_add(tilt)];
                self.go(to, speed, Activity::Other, time, dealer)
            }
            Request::Home | Request::Reset => self.go([0; 2], full, Activity::Other, time, dealer),
            Request::Preset(action, number) => return self.preset(action, number, time, dealer),
            Request::Zoom(zooming) => {
                self.zooming(zooming, time);
                return Ok((Part::Zoom, time));
            }
            Request::Set(Register::Zoom, value) => return Ok((Part::Zoom, self.zoom_to(value, time))),
            Request::Set(Register::Focus, value) => {
                if self.registers.focuses_itself() {
                    return Err(Fault::NotExecutable);
                }
                return Ok((Part::Focus, self.focus_to(value, time)));
            }
            Request::Set(register, value) => {
                self.registers.set(register, value)?;
                return Ok((Part::Settings, time));
            }
            Request::OnePushWhite => {
                self.registers.one_push_white()?;
                return Ok((Part::Settings, time));
            }
            // They came through `take`, or are not for one camera.
            Request::AddressSet | Request::ClearAll | Request::Clear | Request::Cancel(_) | Request::Inquire(_) => {
                return Err(Fault::Syntax);
            }
        };
        Ok((Part::PanTilt, ends))
    }

    /// Starts a move; beyond its range the head goes to the end.
    fn go(&mut self, to: [i32; 2], codes: [u8; 2], activity: Activity, time: f64, dealer: &mut Dealer) -> f64 {
        self.began_at = self.position(time);
        let to = std::array::from_fn(|k| {
            let [low, high] = axes(self.model)[k].range;
            to[k].clamp(low, high)
        });
        if dealer.strikes(FaultKind::LieIgnored, time).is_some() {
            self.state = DriveState::Completed;
            return time;
        }
        if dealer.strikes(FaultKind::LieArrived, time).is_some() {
            self.state = DriveState::Completed;
            self.lie = Some(to);
            return time;
        }
        let mut target: [f64; 2] = std::array::from_fn(|k| axes(self.model)[k].to_radians(to[k]));
        self.state = DriveState::Completed;
        if dealer.strikes(FaultKind::Stall, time).is_some() {
            let from = self.head.reading(time);
            target = std::array::from_fn(|k| 0.5 * (from[k] + target[k]));
            self.state = DriveState::Failed;
        }
        self.lie = None;
        self.activity = activity;
        self.head.go(time, target, speeds(self.model, codes))
    }

    fn drive(&mut self, codes: [i8; 2], time: f64) {
        self.began_at = self.position(time);
        let speed = speeds(self.model, codes.map(i8::unsigned_abs));
        let target = std::array::from_fn(|k| axes(self.model)[k].range_radians()[usize::from(codes[k] > 0)]);
        self.lie = None;
        self.activity = Activity::Other;
        self.state = DriveState::None;
        self.head.go(time, target, std::array::from_fn(|k| if codes[k] == 0 { 0.0 } else { speed[k] }));
    }

    fn preset(
        &mut self,
        action: PresetAction,
        number: u8,
        time: f64,
        dealer: &mut Dealer,
    ) -> Result<(Part, f64), Fault> {
        let now = Preset { position: self.position(time), zoom: self.zoom.value(time), focus: self.focus.value(time) };
        let slot = self.presets.get_mut(usize::from(number)).ok_or(Fault::Syntax)?;
        match action {
            PresetAction::Clear => *slot = None,
            PresetAction::Store => *slot = Some(now),
            PresetAction::Recall => {
                let Preset { position, zoom, focus } = slot.ok_or(Fault::NotExecutable)?;
                let full = full_speed(self.model);
                let there = self.go(position, full, Activity::Absolute, time, dealer);
                let lens = self.zoom_to(zoom, time).max(self.focus_to(focus, time));
                return Ok((Part::PanTilt, there.max(lens)));
            }
        }
        Ok((Part::Settings, time))
    }

    fn zooming(&mut self, zooming: Zooming, time: f64) {
        let [wide, tele] = self.model.zoom;
        let (end, code) = match zooming {
            Zooming::Stop => return self.zoom.stop(time),
            Zooming::Tele(code) => (tele, code),
            Zooming::Wide(code) => (wide, code),
        };
        let code = code.unwrap_or(STANDARD_ZOOM_CODE).min(MAX_ZOOM_CODE);
        let share = f64::from(code + 1) / f64::from(MAX_ZOOM_CODE + 1);
        self.zoom.go(time, end, share * rate(self.model.zoom, ZOOM_TIME));
    }

    fn zoom_to(&mut self, value: u16, time: f64) -> f64 {
        let [wide, tele] = self.model.zoom;
        self.zoom.go(time, value.clamp(wide, tele), rate(self.model.zoom, ZOOM_TIME))
    }

    fn focus_to(&mut self, value: u16, time: f64) -> f64 {
        let [far, near] = focus_ends(self.model);
        self.focus.go(time, value.clamp(far, near), rate([far, near], FOCUS_TIME))
    }

    fn answer(&mut self, inquiry: Inquiry, time: f64) -> Reply {
        let [pan, tilt] = self.told_position(time);
        let answer = match inquiry {
            Inquiry::Version => Answer::Version(Version {
                vendor: if self.model.vendor == "Sony" { SONY } else { OTHER_VENDOR },
                model: self.model.ids.first().copied().unwrap_or(0),
                rom: 0x0100,
                sockets: SOCKETS as u8,
            }),
            Inquiry::Position => Answer::Position { pan, tilt },
            Inquiry::MaxSpeed => {
                let [pan, tilt] = full_speed(self.model);
                Answer::MaxSpeed { pan, tilt }
            }
            Inquiry::Mode if !self.model.reports_mode => return Reply::Error { socket: 0, fault: Fault::Syntax },
            Inquiry::Mode => Answer::Mode(self.mode(time)),
            Inquiry::Register(Register::Zoom) => Answer::Value(self.zoom.value(time)),
            Inquiry::Register(Register::Focus) => Answer::Value(self.focus.value(time)),
            Inquiry::Register(register) => Answer::Value(self.registers.get(register)),
        };
        match answer.encode(self.model, inquiry) {
            Some(payload) => Reply::Inquiry(payload),
            None => Reply::Error { socket: 0, fault: Fault::NotExecutable },
        }
    }

    fn told_position(&mut self, time: f64) -> [i32; 2] {
        let runs = self.sockets.iter().flatten().any(|job| job.part == Part::PanTilt);
        match self.lie {
            Some(lie) => lie,
            None if runs && self.behaviour.stale_position => self.began_at,
            None => self.position(time),
        }
    }

    fn mode(&mut self, time: f64) -> ModeWord {
        let moving = self.head.is_moving(time);
        let state = if moving { DriveState::Moving } else { self.state };
        let at = self.head.reading(time);
        let at_end = |k: usize, side: usize| {
            let axis = axes(self.model)[k];
            (at[k] - axis.range_radians()[side]).abs() < 0.5 * axis.step()
        };
        // Left, right, upper, lower.
        let ends = [at_end(0, 0), at_end(0, 1), at_end(1, 1), at_end(1, 0)];
        let bits = ends.iter().enumerate().fold(0, |word, (bit, &end)| word | u16::from(end) << bit);
        ModeWord(ModeWord::new(state).0 | bits)
    }
}

fn axes(model: &Model) -> [&Axis; 2] {
    [&model.pan, &model.tilt]
}

fn units(model: &Model, angles: [f64; 2]) -> [i32; 2] {
    // A head's angles are finite.
    [model.pan.to_units("pan", angles[0]).unwrap_or(0), model.tilt.to_units("tilt", angles[1]).unwrap_or(0)]
}

/// Radians per second.
fn speeds(model: &Model, codes: [u8; 2]) -> [f64; 2] {
    [model.pan.speed(codes[0]), model.tilt.speed(codes[1])]
}

fn full_speed(model: &Model) -> [u8; 2] {
    axes(model).map(Axis::max_speed_code)
}

fn focus_ends(model: &Model) -> [u16; 2] {
    model.focus.unwrap_or(FOCUS)
}

fn rate([from, to]: [u16; 2], seconds: f64) -> f64 {
    f64::from(to.abs_diff(from)) / seconds
}
