//! Messages and their bytes.

mod answer;
mod framer;
pub mod ip;
mod reply;
mod request;

#[cfg(test)]
mod tests;

pub use answer::{Answer, DriveState, ModeWord, Version};
pub use framer::Framer;
pub use reply::{Fault, Payload, Reply};
pub use request::{Inquiry, PresetAction, Register, Request, Zooming};

use std::fmt;

/// The byte that ends a packet, and that no packet holds anywhere else.
pub const END: u8 = 0xff;
/// Address of a broadcast.
pub const BROADCAST: u8 = 8;
/// Bytes of the longest packet, header and end included.
pub const MAX_PACKET: usize = 16;
const MIN_PACKET: usize = 3;

/// One packet: a header, 1 to 14 bytes of body, [`END`].
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Packet {
    bytes: [u8; MAX_PACKET],
    length: u8,
}

impl Packet {
    /// None when the bytes are not exactly one packet.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (&[header, ref body @ ..], &end) = (bytes.split_last()?.1, bytes.last()?) else { return None };
        let proper = (MIN_PACKET..=MAX_PACKET).contains(&bytes.len())
            && header & 0x80 != 0
            && end == END
            && header != END
            && !body.contains(&END);
        proper.then(|| Self::new(header, body))
    }

    /// `body` is at most 14 bytes. FF would end the packet early: the nearest that can be sent is FE.
    fn new(header: u8, body: &[u8]) -> Self {
        debug_assert!((1..=MAX_PACKET - 2).contains(&body.len()));
        let mut bytes = [END; MAX_PACKET];
        bytes[0] = header;
        for (to, from) in bytes[1..MAX_PACKET - 1].iter_mut().zip(body) {
            *to = (*from).min(END - 1);
        }
        Self { bytes, length: (body.len() + 2).min(MAX_PACKET) as u8 }
    }

    /// From the controller to a camera, or to all.
    fn request(address: u8, body: &[u8]) -> Self {
        Self::new(0x80 | address & 0x0f, body)
    }

    /// From a camera to the controller.
    fn reply(address: u8, body: &[u8]) -> Self {
        Self::new(0x80 | (address & 7) << 4, body)
    }

    /// 0 is the controller, 1 to 7 are cameras.
    pub fn sender(&self) -> u8 {
        self.bytes[0] >> 4 & 7
    }

    /// 0 is the controller, 1 to 7 are cameras, 8 is everybody.
    pub fn receiver(&self) -> u8 {
        self.bytes[0] & 0x0f
    }

    /// Between header and end.
    pub fn body(&self) -> &[u8] {
        &self.bytes[1..usize::from(self.length) - 1]
    }

    pub fn bytes(&self) -> &[u8] {
        &self.bytes[..usize::from(self.length)]
    }
}

/// As manuals write it: `81 01 06 04 FF`.
impl fmt::Debug for Packet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text: Vec<String> = self.bytes().iter().map(|b| format!("{b:02X}")).collect();
        f.write_str(&text.join(" "))
    }
}

/// A signed number in the low halves of bytes, most significant first. What does not fit is cut to
/// the nearest that does.
fn put_nibbles(value: i32, count: u32, body: &mut Vec<u8>) {
    let limit = 1 << (4 * count - 1);
    let value = value.clamp(-limit, limit - 1);
    body.extend((0..count).rev().map(|k| (value >> (4 * k) & 0x0f) as u8));
}

/// The unsigned number; None when a byte is no nibble.
fn unsigned_nibbles(bytes: &[u8]) -> Option<u32> {
    bytes.iter().try_fold(0u32, |value, &b| (b < 16).then_some(value << 4 | u32::from(b)))
}

/// The signed number; None when a byte is no nibble.
fn signed_nibbles(bytes: &[u8]) -> Option<i32> {
    let shift = 32 - 4 * bytes.len() as u32;
    unsigned_nibbles(bytes).map(|value| ((value << shift) as i32) >> shift)
}
