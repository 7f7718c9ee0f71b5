//! What cameras say.

use super::{BROADCAST, MAX_PACKET, Packet};

/// A reply, or a message that nobody asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reply {
    /// The [`AddressSet`](super::Request::AddressSet) that went round; `next` is the first address
    /// that no camera has taken.
    AddressSet {
        next: u8,
    },
    /// The [`ClearAll`](super::Request::ClearAll) that went round.
    ClearedAll,
    /// One camera has forgotten its commands.
    Cleared,
    /// A camera was added or switched on: addresses have to be set anew.
    NetworkChange,
    /// The command was taken and runs in this socket.
    Ack {
        socket: u8,
    },
    /// It has ended.
    Completion {
        socket: u8,
    },
    /// Answer to an inquiry, for [`Answer::decode`](super::Answer::decode).
    Inquiry(Payload),
    Error {
        socket: u8,
        fault: Fault,
    },
}

/// Why a camera does not do what it was told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    Length,
    Syntax,
    /// Both sockets are busy.
    BufferFull,
    Cancelled,
    NoSocket,
    /// Not in the present state.
    NotExecutable,
    Other(u8),
}

/// Bytes of an answer, 1 to 13.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Payload {
    bytes: [u8; MAX_PACKET - 3],
    length: u8,
}

impl Payload {
    /// None when the bytes cannot be an answer: none, too many, or FF among them.
    pub fn new(bytes: &[u8]) -> Option<Self> {
        let mut payload = Self { bytes: [0; MAX_PACKET - 3], length: bytes.len() as u8 };
        if bytes.is_empty() || bytes.contains(&super::END) {
            return None;
        }
        payload.bytes.get_mut(..bytes.len())?.copy_from_slice(bytes);
        Some(payload)
    }

    pub fn bytes(&self) -> &[u8] {
        &self.bytes[..usize::from(self.length)]
    }
}

impl std::fmt::Debug for Payload {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:02X?}", self.bytes())
    }
}

impl Reply {
    /// The packet of the camera with this address (1 to 7; no matter for what goes round).
    pub fn encode(&self, address: u8) -> Packet {
        let address = address.clamp(1, 7);
        match *self {
            Self::AddressSet { next } => Packet::request(BROADCAST, &[0x30, next & 0x0f]),
            Self::ClearedAll => Packet::request(BROADCAST, &[0x01, 0x00, 0x01]),
            Self::Cleared => Packet::reply(address, &[0x50]),
            Self::NetworkChange => Packet::reply(address, &[0x38]),
            Self::Ack { socket } => Packet::reply(address, &[0x40 | socket & 0x0f]),
            Self::Completion { socket } => Packet::reply(address, &[0x50 | socket & 0x0f]),
            Self::Inquiry(payload) => {
                let mut body = [0x50; MAX_PACKET - 2];
                let length = payload.bytes().len();
                body[1..=length].copy_from_slice(payload.bytes());
                Packet::reply(address, &body[..=length])
            }
            Self::Error { socket, fault } => Packet::reply(address, &[0x60 | socket & 0x0f, fault.code()]),
        }
    }

    /// The sender's address (0 for what goes round) and what it says; None for what is no reply.
    pub fn decode(packet: &Packet) -> Option<(u8, Self)> {
        let body = packet.body();
        if packet.receiver() == BROADCAST {
            return match *body {
                [0x30, next @ 1..=8] => Some((0, Self::AddressSet { next })),
                [0x01, 0x00, 0x01] => Some((0, Self::ClearedAll)),
                _ => None,
            };
        }
        if packet.sender() == 0 || packet.receiver() != 0 {
            return None;
        }
        let socket = body[0] & 0x0f;
        let reply = match (body[0] & 0xf0, &body[1..]) {
            (0x30, []) if socket == 8 => Self::NetworkChange,
            (0x40, []) => Self::Ack { socket },
            (0x50, []) if socket == 0 => Self::Cleared,
            (0x50, []) => Self::Completion { socket },
            // Some cameras put a socket here too.
            (0x50, payload) => Self::Inquiry(Payload::new(payload)?),
            (0x60, &[code]) => Self::Error { socket, fault: Fault::from_code(code) },
            _ => return None,
        };
        Some((packet.sender(), reply))
    }
}

impl Fault {
    fn code(self) -> u8 {
        match self {
            Self::Length => 0x01,
            Self::Syntax => 0x02,
            Self::BufferFull => 0x03,
            Self::Cancelled => 0x04,
            Self::NoSocket => 0x05,
            Self::NotExecutable => 0x41,
            Self::Other(code) => code,
        }
    }

    fn from_code(code: u8) -> Self {
        match code {
            0x01 => Self::Length,
            0x02 => Self::Syntax,
            0x03 => Self::BufferFull,
            0x04 => Self::Cancelled,
            0x05 => Self::NoSocket,
            0x41 => Self::NotExecutable,
            other => Self::Other(other),
        }
    }
}
