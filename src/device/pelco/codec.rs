//! Pelco-D and Pelco-P: messages to bytes and back.
//!
//! Both carry two command and two data bytes. D: `FF address c1 c2 d1 d2 sum`, the sum over bytes 2
//! to 6 modulo 256. P: `A0 address-1 c1 c2 d1 d2 AF xor`. They share all codes but those of focus.
//! Source: Pelco engineering standard TF-0002 (D); the makers' lists of P agree with it, but not on
//! which bytes the xor covers.

/// What a `xor` of Pelco-P is taken over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum XorCoverage {
    /// Bytes 1 to 7, as Pelco and nearly all makers have it.
    Whole,
    /// Bytes 2 to 6: without the marks of start and end.
    Inner,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dialect {
    D,
    P(XorCoverage),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    Pan,
    Tilt,
    Zoom,
}

/// The standard command: which motors turn. All zero stops every one of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Drive {
    /// -63 (left) to 63 (right).
    pub pan: i8,
    /// -63 (down) to 63 (up).
    pub tilt: i8,
    /// -1 wide, 1 tele.
    pub zoom: i8,
    /// -1 far, 1 near.
    pub focus: i8,
}

/// Either way's messages; only [`Position`](Self::Position) comes from the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Message {
    Drive(Drive),
    SetPreset(u8),
    ClearPreset(u8),
    GotoPreset(u8),
    /// 0 (slow) to 3.
    ZoomSpeed(u8),
    AutoFocus(bool),
    /// Hundredths of a degree; zoom 0 to 65535 of its range.
    SetPosition(Quantity, u16),
    Query(Quantity),
    Position(Quantity, u16),
}

/// Greatest speed of pan and tilt short of "turbo".
pub const FULL_SPEED: i8 = 0x3F;

const RIGHT: u8 = 0x02;
const LEFT: u8 = 0x04;
const UP: u8 = 0x08;
const DOWN: u8 = 0x10;
const TELE: u8 = 0x20;
const WIDE: u8 = 0x40;
/// "On" and "off" of autofocus. 0, "auto", is left alone: makers disagree on it.
const FOCUS_ON: u8 = 1;
const FOCUS_OFF: u8 = 2;

impl Quantity {
    const ALL: [Self; 3] = [Self::Pan, Self::Tilt, Self::Zoom];

    /// Of setting, query and reply.
    fn codes(self) -> (u8, u8, u8) {
        match self {
            Self::Pan => (0x4B, 0x51, 0x59),
            Self::Tilt => (0x4D, 0x53, 0x5B),
            Self::Zoom => (0x4F, 0x55, 0x5D),
        }
    }
}

impl Dialect {
    /// Bytes of a whole message.
    pub fn frame_length(self) -> usize {
        match self {
            Self::D => 7,
            Self::P(_) => 8,
        }
    }

    fn start(self) -> u8 {
        match self {
            Self::D => 0xFF,
            Self::P(_) => 0xA0,
        }
    }

    /// The first two bytes of every message from and to a device.
    pub fn header(self, address: u8) -> [u8; 2] {
        match self {
            Self::D => [0xFF, address],
            // Camera 1 is 0 on the wire.
            Self::P(_) => [0xA0, address.wrapping_sub(1)],
        }
    }

    /// Speeds out of range are cut to it.
    pub fn encode(self, address: u8, message: &Message) -> Vec<u8> {
        let word = |code: u8, value: u16| {
            let [high, low] = value.to_be_bytes();
            [0, code, high, low]
        };
        let body = match *message {
            Message::Drive(drive) => self.drive(drive),
            Message::SetPreset(n) => [0, 0x03, 0, n],
            Message::ClearPreset(n) => [0, 0x05, 0, n],
            Message::GotoPreset(n) => [0, 0x07, 0, n],
            Message::ZoomSpeed(speed) => [0, 0x25, 0, speed.min(3)],
            Message::AutoFocus(on) => [0, 0x2B, 0, if on { FOCUS_ON } else { FOCUS_OFF }],
            Message::SetPosition(quantity, value) => word(quantity.codes().0, value),
            Message::Query(quantity) => word(quantity.codes().1, 0),
            Message::Position(quantity, value) => word(quantity.codes().2, value),
        };
        let mut frame = Vec::with_capacity(self.frame_length());
        frame.extend(self.header(address));
        frame.extend(body);
        if let Self::P(_) = self {
            frame.push(0xAF);
        }
        frame.push(self.checksum(&frame));
        frame
    }

    /// The address and message of one whole frame.
    pub fn decode(self, frame: &[u8]) -> Option<(u8, Message)> {
        let (&sum, rest) = frame.split_last()?;
        if frame.len() != self.frame_length() || self.checksum(rest) != sum {
            return None;
        }
        let &[start, address, c1, c2, d1, d2, ..] = frame else { return None };
        let address = match self {
            Self::D => address,
            Self::P(_) if rest.last() != Some(&0xAF) => return None,
            Self::P(_) => address.wrapping_add(1),
        };
        if start != self.start() {
            return None;
        }
        Some((address, self.message(c1, c2, d1, d2)?))
    }

    fn message(self, c1: u8, c2: u8, d1: u8, d2: u8) -> Option<Message> {
        if c2 & 1 == 0 {
            return self.driven(c1, c2, d1, d2).map(Message::Drive);
        }
        let value = u16::from_be_bytes([d1, d2]);
        let of_quantity = Quantity::ALL.into_iter().find_map(|quantity| match quantity.codes() {
            (set, _, _) if c2 == set => Some(Message::SetPosition(quantity, value)),
            (_, query, _) if c2 == query => Some(Message::Query(quantity)),
            (_, _, reply) if c2 == reply => Some(Message::Position(quantity, value)),
            _ => None,
        });
        match (c1, c2, d2) {
            (0, 0x03, n) => Some(Message::SetPreset(n)),
            (0, 0x05, n) => Some(Message::ClearPreset(n)),
            (0, 0x07, n) => Some(Message::GotoPreset(n)),
            (0, 0x25, 0..=3) => Some(Message::ZoomSpeed(d2)),
            (0, 0x2B, FOCUS_ON | FOCUS_OFF) => Some(Message::AutoFocus(d2 == FOCUS_ON)),
            (0, _, _) => of_quantity,
            _ => None,
        }
    }

    /// Bits of (far, near) as one 16-bit word of both command bytes.
    fn focus_bits(self) -> (u16, u16) {
        match self {
            Self::D => (0x0080, 0x0100),
            Self::P(_) => (0x0100, 0x0200),
        }
    }

    fn drive(self, drive: Drive) -> [u8; 4] {
        let either = |value: i8, negative: u8, positive: u8| match value.signum() {
            0 => 0,
            1 => positive,
            _ => negative,
        };
        let motors = either(drive.pan, LEFT, RIGHT) | either(drive.tilt, DOWN, UP) | either(drive.zoom, WIDE, TELE);
        let (far, near) = self.focus_bits();
        let focus = match drive.focus.signum() {
            0 => 0,
            1 => near,
            _ => far,
        };
        let [c1, c2] = (u16::from(motors) | focus).to_be_bytes();
        let speed = |value: i8| value.unsigned_abs().min(FULL_SPEED.unsigned_abs());
        [c1, c2, speed(drive.pan), speed(drive.tilt)]
    }

    fn driven(self, c1: u8, c2: u8, d1: u8, d2: u8) -> Option<Drive> {
        let speed = |value: u8, negative: bool, positive: bool| -> Option<i8> {
            let size = value.min(FULL_SPEED.unsigned_abs()) as i8;
            match (negative, positive) {
                (false, false) => Some(0),
                (true, false) => Some(-size),
                (false, true) => Some(size),
                (true, true) => None,
            }
        };
        let bit = |mask: u8| c2 & mask != 0;
        let word = u16::from_be_bytes([c1, c2]);
        let (far, near) = self.focus_bits();
        let motors = u16::from(RIGHT | LEFT | UP | DOWN | TELE | WIDE);
        if word & !(motors | far | near) != 0 {
            // Iris, camera on and off, automatic scan: not ours.
            return None;
        }
        Some(Drive {
            pan: speed(d1, bit(LEFT), bit(RIGHT))?,
            tilt: speed(d2, bit(DOWN), bit(UP))?,
            zoom: speed(1, bit(WIDE), bit(TELE))?,
            focus: speed(1, word & far != 0, word & near != 0)?,
        })
    }

    /// Over a frame without its last byte.
    fn checksum(self, frame: &[u8]) -> u8 {
        let inner = frame.get(1..6).unwrap_or_default();
        match self {
            Self::D => inner.iter().fold(0, |sum, b| sum.wrapping_add(*b)),
            Self::P(XorCoverage::Whole) => frame.iter().fold(0, |sum, b| sum ^ b),
            Self::P(XorCoverage::Inner) => inner.iter().fold(0, |sum, b| sum ^ b),
        }
    }
}

/// Finds messages in a stream of bytes; after damage it goes on with the next start byte.
#[derive(Debug, Clone)]
pub struct Framer {
    dialect: Dialect,
    /// The start of a message, always shorter than one.
    pending: Vec<u8>,
}

impl Framer {
    pub fn new(dialect: Dialect) -> Self {
        Self { dialect, pending: Vec::with_capacity(dialect.frame_length()) }
    }

    /// Takes one more byte; the address and message that it completes.
    pub fn push(&mut self, byte: u8) -> Option<(u8, Message)> {
        self.pending.push(byte);
        let found = if self.pending.len() == self.dialect.frame_length() {
            let found = self.dialect.decode(&self.pending);
            // What was taken for a start may hide the true one behind it.
            self.pending.drain(..if found.is_some() { self.pending.len() } else { 1 });
            found
        } else {
            None
        };
        let start = self.dialect.start();
        let skip = self.pending.iter().position(|b| *b == start).unwrap_or(self.pending.len());
        self.pending.drain(..skip);
        found
    }

    pub fn clear(&mut self) {
        self.pending.clear();
    }
}
