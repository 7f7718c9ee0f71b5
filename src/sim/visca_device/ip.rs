//! VISCA over IP as cameras speak it: a header with a sequence number about each packet.
//!
//! From Sony's command lists: a number that was already heard is answered by "abnormal sequence
//! number" and not executed again, unless it was answered by an error; RESET starts anew. A number
//! below the last one heard counts as heard.

use super::emulator::Emulator;
use super::faults::FaultKind;
use super::wire::{Origin, Outgoing};
use crate::device::visca::codec::ip::{Control, Kind, Message};

/// Controllers that are told apart.
pub(super) const MAX_PEERS: usize = 16;

/// The last number heard from a controller.
#[derive(Debug, Clone, Copy, Default)]
struct Peer {
    last: Option<u32>,
    /// It was answered by an error.
    failed: bool,
}

#[derive(Debug, Default)]
pub(super) struct IpSession {
    peers: [Peer; MAX_PEERS],
}

impl IpSession {
    /// Takes a datagram; what is to be answered at once.
    pub fn hear(&mut self, origin: Origin, datagram: &[u8], emulator: &mut Emulator, now: f64) -> Option<Vec<u8>> {
        if !emulator.is_reached(now) {
            return None;
        }
        let message = Message::decode(datagram)?;
        let control = |control: Control| {
            let reply = Message { kind: Kind::ControlReply, payload: control.payload(), ..message };
            Some(reply.encode())
        };
        let peer = self.peers.get_mut(usize::from(origin.peer))?;
        match message.kind {
            Kind::Control if Control::from_payload(message.payload) == Some(Control::Reset) => {
                *peer = Peer::default();
                control(Control::Reset)
            }
            Kind::Control | Kind::Reply | Kind::ControlReply => control(Control::BadMessage),
            Kind::Command | Kind::Inquiry | Kind::DeviceSetting => {
                let fault = emulator.dealer().strikes(FaultKind::SequenceError, now).is_some();
                if fault || peer.has_heard(message.sequence) {
                    return control(Control::BadSequence);
                }
                *peer = Peer { last: Some(message.sequence), failed: false };
                emulator.take_packet(message.payload, Origin { sequence: message.sequence, ..origin }, now);
                None
            }
        }
    }

    /// Another controller takes this place.
    pub fn forget(&mut self, peer: usize) {
        if let Some(peer) = self.peers.get_mut(peer) {
            *peer = Peer::default();
        }
    }

    /// The datagram of a reply.
    pub fn say(&mut self, outgoing: &Outgoing) -> Vec<u8> {
        let sequence = outgoing.origin.sequence;
        if let Some(peer) = self.peers.get_mut(usize::from(outgoing.origin.peer)) {
            let is_error = outgoing.bytes.get(1).is_some_and(|b| b & 0xf0 == 0x60);
            peer.failed |= is_error && peer.last == Some(sequence);
        }
        Message { kind: Kind::Reply, sequence, payload: &outgoing.bytes }.encode()
    }
}

impl Peer {
    fn has_heard(&self, sequence: u32) -> bool {
        self.last.is_some_and(|last| {
            // Numbers start again after the greatest.
            let ahead = sequence.wrapping_sub(last) as i32;
            ahead < 0 || ahead == 0 && !self.failed
        })
    }
}
