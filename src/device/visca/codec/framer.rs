//! From a stream of bytes to packets.

use super::{END, MAX_PACKET, Packet};

/// Cuts a stream into packets. After bytes that are none it starts afresh at the next [`END`].
/// It holds one packet at most.
#[derive(Debug, Clone, Default)]
pub struct Framer {
    bytes: [u8; MAX_PACKET],
    length: usize,
    /// Skips to the next end.
    lost: bool,
    garbage: u64,
}

impl Framer {
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes the next byte, and gives the packet that it ends.
    pub fn push(&mut self, byte: u8) -> Option<Packet> {
        if self.lost {
            self.garbage += 1;
            self.lost = byte != END;
            return None;
        }
        // The first byte of a packet has its high bit set and is not the end.
        if self.length == 0 && (byte & 0x80 == 0 || byte == END) {
            self.garbage += 1;
            self.lost = byte != END;
            return None;
        }
        self.bytes[self.length] = byte;
        self.length += 1;
        if byte != END && self.length < MAX_PACKET {
            return None;
        }
        let packet = Packet::from_bytes(&self.bytes[..self.length]);
        if packet.is_none() {
            self.garbage += self.length as u64;
            self.lost = byte != END;
        }
        self.length = 0;
        packet
    }

    /// Number of bytes so far that belonged to no packet: at a wrong baud rate nearly all.
    pub fn garbage(&self) -> u64 {
        self.garbage
    }

    /// Forgets a packet that has begun, as after a long silence.
    pub fn restart(&mut self) {
        self.garbage += self.length as u64;
        self.length = 0;
        self.lost = false;
    }
}
