//! What the controller says.

use super::{BROADCAST, Fault, Packet, put_nibbles, signed_nibbles, unsigned_nibbles};
use crate::device::visca::models::Model;

/// A command or an inquiry. Positions and speeds are the device's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// To all: every camera takes the next address.
    AddressSet,
    /// To all: forget all commands.
    ClearAll,
    /// The same to one camera.
    Clear,
    /// Stops the command in a socket.
    Cancel(u8),
    /// Turns until told otherwise. Codes of speed, positive right and up; 0 stops the axis.
    Drive {
        pan: i8,
        tilt: i8,
    },
    /// Codes of speed from 1; a model with one speed for both takes pan's.
    MoveTo {
        speed: [u8; 2],
        pan: i32,
        tilt: i32,
    },
    MoveBy {
        speed: [u8; 2],
        pan: i32,
        tilt: i32,
    },
    Home,
    /// Finds the ends of pan and tilt anew.
    Reset,
    Zoom(Zooming),
    /// Measures white once, in the white balance's one-push mode.
    OnePushWhite,
    Preset(PresetAction, u8),
    /// Sets a number of the camera block.
    Set(Register, u16),
    Inquire(Inquiry),
}

/// Zooming until told otherwise, at speed 0 to 7 or the standard speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Zooming {
    Stop,
    Tele(Option<u8>),
    Wide(Option<u8>),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PresetAction {
    Clear,
    Store,
    Recall,
}

/// A number that is set by `01 04 cc ..`, asked for by `09 04 cc` and answered in the same form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Register {
    /// 2 on, 3 standby.
    Power,
    /// 0 automatic, 5 manual, 3 one push.
    WhiteBalance,
    /// 2 automatic, 3 manual.
    FocusMode,
    /// 0 automatic, 3 manual.
    ExposureMode,
    RedGain,
    BlueGain,
    Zoom,
    Focus,
    Shutter,
    Iris,
    Gain,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Inquiry {
    Version,
    Position,
    /// The greatest codes of speed.
    MaxSpeed,
    /// Whether pan and tilt move.
    Mode,
    Register(Register),
}

impl Register {
    pub const ALL: [Self; 11] = [
        Self::Power,
        Self::WhiteBalance,
        Self::FocusMode,
        Self::ExposureMode,
        Self::RedGain,
        Self::BlueGain,
        Self::Zoom,
        Self::Focus,
        Self::Shutter,
        Self::Iris,
        Self::Gain,
    ];

    fn code(self) -> u8 {
        match self {
            Self::Power => 0x00,
            Self::WhiteBalance => 0x35,
            Self::FocusMode => 0x38,
            Self::ExposureMode => 0x39,
            Self::RedGain => 0x43,
            Self::BlueGain => 0x44,
            Self::Zoom => 0x47,
            Self::Focus => 0x48,
            Self::Shutter => 0x4a,
            Self::Iris => 0x4b,
            Self::Gain => 0x4c,
        }
    }

    fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|r| r.code() == code)
    }

    /// One byte, or four nibbles.
    fn is_byte(self) -> bool {
        matches!(self, Self::Power | Self::WhiteBalance | Self::FocusMode | Self::ExposureMode)
    }

    pub(super) fn put(self, value: u16, body: &mut Vec<u8>) {
        if self.is_byte() {
            body.push(value.min(0xfe) as u8);
        } else {
            body.extend((0..4).rev().map(|k| (value >> (4 * k) & 0x0f) as u8));
        }
    }

    pub(super) fn value(self, bytes: &[u8]) -> Option<u16> {
        match bytes {
            &[byte] if self.is_byte() => Some(byte.into()),
            [_, _, _, _] if !self.is_byte() => unsigned_nibbles(bytes).map(|v| v as u16),
            _ => None,
        }
    }
}

impl Request {
    /// Pan, tilt and nothing else stand still.
    pub const STOP: Self = Self::Drive { pan: 0, tilt: 0 };

    pub fn is_inquiry(&self) -> bool {
        matches!(self, Self::Inquire(_))
    }

    pub fn is_broadcast(&self) -> bool {
        matches!(self, Self::AddressSet | Self::ClearAll)
    }

    /// The packet for the camera with this address (1 to 7; no matter for broadcasts). Numbers that
    /// the model's form has no room for are cut to the nearest that fit.
    pub fn encode(&self, model: &Model, address: u8) -> Packet {
        let mut body = Vec::with_capacity(14);
        match *self {
            Self::AddressSet => body.extend([0x30, 0x01]),
            Self::ClearAll | Self::Clear => body.extend([0x01, 0x00, 0x01]),
            Self::Cancel(socket) => body.push(0x20 | socket & 0x0f),
            Self::Drive { pan, tilt } => {
                // Speed 0 is refused by some cameras, even of an axis that stands still.
                let speed = |code: i8, max: u8| code.unsigned_abs().clamp(1, max);
                let way = |code: i8, back: u8, forth: u8| match code.signum() {
                    -1 => back,
                    1 => forth,
                    _ => 3,
                };
                let (v, w) = (speed(pan, model.pan.max_speed_code()), speed(tilt, model.tilt.max_speed_code()));
                body.extend([0x01, 0x06, 0x01, v, w, way(pan, 1, 2), way(tilt, 2, 1)]);
            }
            Self::MoveTo { speed, pan, tilt } => put_move(0x02, model, speed, [pan, tilt], &mut body),
            Self::MoveBy { speed, pan, tilt } => put_move(0x03, model, speed, [pan, tilt], &mut body),
            Self::Home => body.extend([0x01, 0x06, 0x04]),
            Self::Reset => body.extend([0x01, 0x06, 0x05]),
            Self::Zoom(zooming) => body.extend([0x01, 0x04, 0x07, zooming.byte()]),
            Self::OnePushWhite => body.extend([0x01, 0x04, 0x10, 0x05]),
            Self::Preset(action, number) => body.extend([0x01, 0x04, 0x3f, action as u8, number]),
            Self::Set(register, value) => {
                body.extend([0x01, 0x04, register.code()]);
                register.put(value, &mut body);
            }
            Self::Inquire(inquiry) => {
                let [category, code] = inquiry.code();
                body.extend([0x09, category, code]);
            }
        }
        Packet::request(if self.is_broadcast() { BROADCAST } else { address.clamp(1, 7) }, &body)
    }

    /// # Errors
    /// What a camera of this model would answer.
    pub fn decode(model: &Model, packet: &Packet) -> Result<Self, Fault> {
        let body = packet.body();
        if packet.receiver() == BROADCAST {
            return match body {
                [0x30, 0x01] => Ok(Self::AddressSet),
                [0x01, 0x00, 0x01] => Ok(Self::ClearAll),
                _ => Err(Fault::Syntax),
            };
        }
        match *body {
            [0x01, 0x00, 0x01] => Ok(Self::Clear),
            [byte] if byte & 0xf0 == 0x20 => Ok(Self::Cancel(byte & 0x0f)),
            [0x01, 0x06, 0x01, v, w, a, b] => drive(model, [v, w], [a, b]),
            [0x01, 0x06, kind @ (0x02 | 0x03), v, w, ref rest @ ..] => {
                let (speed, [pan, tilt]) = moved(model, [v, w], rest)?;
                Ok(if kind == 0x02 { Self::MoveTo { speed, pan, tilt } } else { Self::MoveBy { speed, pan, tilt } })
            }
            [0x01, 0x06, 0x04] => Ok(Self::Home),
            [0x01, 0x06, 0x05] => Ok(Self::Reset),
            [0x01, 0x04, 0x07, byte] => Zooming::from_byte(byte).map(Self::Zoom).ok_or(Fault::Syntax),
            [0x01, 0x04, 0x10, 0x05] => Ok(Self::OnePushWhite),
            [0x01, 0x04, 0x3f, action, number] => PresetAction::from_byte(action)
                .filter(|_| u32::from(number) < model.presets)
                .map(|action| Self::Preset(action, number))
                .ok_or(Fault::Syntax),
            [0x01, 0x04, code, ref value @ ..] => Register::from_code(code)
                .and_then(|register| register.value(value).map(|value| Self::Set(register, value)))
                .ok_or(Fault::Syntax),
            [0x09, category, code] => Inquiry::from_code([category, code]).map(Self::Inquire).ok_or(Fault::Syntax),
            _ => Err(Fault::Syntax),
        }
    }
}

impl Inquiry {
    fn code(self) -> [u8; 2] {
        match self {
            Self::Version => [0x00, 0x02],
            Self::Mode => [0x06, 0x10],
            Self::MaxSpeed => [0x06, 0x11],
            Self::Position => [0x06, 0x12],
            Self::Register(register) => [0x04, register.code()],
        }
    }

    fn from_code([category, code]: [u8; 2]) -> Option<Self> {
        match [category, code] {
            [0x00, 0x02] => Some(Self::Version),
            [0x06, 0x10] => Some(Self::Mode),
            [0x06, 0x11] => Some(Self::MaxSpeed),
            [0x06, 0x12] => Some(Self::Position),
            [0x04, code] => Register::from_code(code).map(Self::Register),
            _ => None,
        }
    }
}

impl Zooming {
    fn byte(self) -> u8 {
        match self {
            Self::Stop => 0x00,
            Self::Tele(None) => 0x02,
            Self::Wide(None) => 0x03,
            Self::Tele(Some(speed)) => 0x20 | speed.min(7),
            Self::Wide(Some(speed)) => 0x30 | speed.min(7),
        }
    }

    fn from_byte(byte: u8) -> Option<Self> {
        match byte {
            0x00 => Some(Self::Stop),
            0x02 => Some(Self::Tele(None)),
            0x03 => Some(Self::Wide(None)),
            0x20..=0x27 => Some(Self::Tele(Some(byte & 7))),
            0x30..=0x37 => Some(Self::Wide(Some(byte & 7))),
            _ => None,
        }
    }
}

impl PresetAction {
    fn from_byte(byte: u8) -> Option<Self> {
        [Self::Clear, Self::Store, Self::Recall].into_iter().find(|&action| action as u8 == byte)
    }
}

fn put_move(kind: u8, model: &Model, speed: [u8; 2], target: [i32; 2], body: &mut Vec<u8>) {
    let v = speed[0].clamp(1, model.pan.max_speed_code());
    let w = if model.one_speed { 0 } else { speed[1].clamp(1, model.tilt.max_speed_code()) };
    body.extend([0x01, 0x06, kind, v, w]);
    put_nibbles(target[0], model.pan.nibbles, body);
    put_nibbles(target[1], model.tilt.nibbles, body);
}

fn moved(model: &Model, [v, w]: [u8; 2], rest: &[u8]) -> Result<([u8; 2], [i32; 2]), Fault> {
    let speed = match (model.one_speed, w) {
        (true, 0) => [v, v],
        (true, _) => return Err(Fault::Syntax),
        (false, _) => [v, w],
    };
    let speed = checked_speed(model, speed)?;
    let (pan, tilt) = rest.split_at_checked(model.pan.nibbles as usize).ok_or(Fault::Syntax)?;
    if tilt.len() != model.tilt.nibbles as usize {
        return Err(Fault::Syntax);
    }
    match (signed_nibbles(pan), signed_nibbles(tilt)) {
        (Some(pan), Some(tilt)) => Ok((speed, [pan, tilt])),
        _ => Err(Fault::Syntax),
    }
}

fn drive(model: &Model, speed: [u8; 2], ways: [u8; 2]) -> Result<Request, Fault> {
    let [v, w] = checked_speed(model, speed)?;
    let code = |speed: u8, way: u8, back: u8| match way {
        3 => Ok(0),
        1 | 2 if way == back => Ok(-(speed as i8)),
        1 | 2 => Ok(speed as i8),
        _ => Err(Fault::Syntax),
    };
    Ok(Request::Drive { pan: code(v, ways[0], 1)?, tilt: code(w, ways[1], 2)? })
}

/// Cameras are lenient with codes that only the other axis has.
fn checked_speed(model: &Model, speed: [u8; 2]) -> Result<[u8; 2], Fault> {
    let most = [model.pan.max_speed_code(), model.tilt.max_speed_code()];
    let good = u8::from(model.refuses_speed_zero)..=most[0].max(most[1]);
    if !speed.iter().all(|code| good.contains(code)) {
        return Err(Fault::Syntax);
    }
    Ok([speed[0].clamp(1, most[0]), speed[1].clamp(1, most[1])])
}
