//! Answers to inquiries.

use super::reply::Payload;
use super::{Inquiry, put_nibbles, signed_nibbles};
use crate::device::visca::models::Model;

/// What an inquiry is answered with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answer {
    Version(Version),
    /// In the device's units.
    Position {
        pan: i32,
        tilt: i32,
    },
    /// Codes of speed.
    MaxSpeed {
        pan: u8,
        tilt: u8,
    },
    Mode(ModeWord),
    /// Of a [`Register`](super::Register).
    Value(u16),
}

/// What a camera says it is. Clones state vendors of their own: only the model counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Version {
    pub vendor: u16,
    pub model: u16,
    pub rom: u16,
    pub sockets: u8,
}

/// State of pan and tilt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ModeWord(pub u16);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriveState {
    /// No move since it was switched on, or stopped.
    None,
    Moving,
    Completed,
    Failed,
}

impl ModeWord {
    pub fn new(state: DriveState) -> Self {
        Self((state as u16) << 10)
    }

    pub fn state(self) -> DriveState {
        match self.0 >> 10 & 3 {
            0 => DriveState::None,
            1 => DriveState::Moving,
            2 => DriveState::Completed,
            _ => DriveState::Failed,
        }
    }

    /// At the left, right, upper, lower end.
    pub fn at_end(self) -> [bool; 4] {
        std::array::from_fn(|bit| self.0 >> bit & 1 == 1)
    }

    /// The camera does not know where it is (a motor or a sensor does not work).
    pub fn is_lost(self) -> bool {
        self.0 & 0x0330 != 0
    }
}

impl Answer {
    /// None when the bytes do not answer the inquiry.
    pub fn decode(model: &Model, inquiry: Inquiry, payload: &Payload) -> Option<Self> {
        let bytes = payload.bytes();
        match inquiry {
            Inquiry::Version => match *bytes {
                [a, b, c, d, e, f, sockets] => {
                    let word = |high, low| u16::from_be_bytes([high, low]);
                    Some(Self::Version(Version { vendor: word(a, b), model: word(c, d), rom: word(e, f), sockets }))
                }
                _ => None,
            },
            Inquiry::Position => {
                let (pan, tilt) = bytes.split_at_checked(model.pan.nibbles as usize)?;
                let tilt = (tilt.len() == model.tilt.nibbles as usize).then_some(tilt)?;
                Some(Self::Position { pan: signed_nibbles(pan)?, tilt: signed_nibbles(tilt)? })
            }
            Inquiry::MaxSpeed => match *bytes {
                [pan, tilt] => Some(Self::MaxSpeed { pan, tilt }),
                _ => None,
            },
            Inquiry::Mode => match *bytes {
                [high, low] => Some(Self::Mode(ModeWord(u16::from_be_bytes([high, low])))),
                _ => None,
            },
            Inquiry::Register(register) => register.value(bytes).map(Self::Value),
        }
    }

    /// The bytes that answer `inquiry`; None when this is no answer to it, or when they would hold FF.
    pub fn encode(&self, model: &Model, inquiry: Inquiry) -> Option<Payload> {
        let mut body = Vec::with_capacity(13);
        match (inquiry, *self) {
            (Inquiry::Version, Self::Version(v)) => {
                for word in [v.vendor, v.model, v.rom] {
                    body.extend(word.to_be_bytes());
                }
                body.push(v.sockets);
            }
            (Inquiry::Position, Self::Position { pan, tilt }) => {
                put_nibbles(pan, model.pan.nibbles, &mut body);
                put_nibbles(tilt, model.tilt.nibbles, &mut body);
            }
            (Inquiry::MaxSpeed, Self::MaxSpeed { pan, tilt }) => body.extend([pan, tilt]),
            (Inquiry::Mode, Self::Mode(word)) => body.extend(word.0.to_be_bytes()),
            (Inquiry::Register(register), Self::Value(value)) => register.put(value, &mut body),
            _ => return None,
        }
        Payload::new(&body)
    }
}
