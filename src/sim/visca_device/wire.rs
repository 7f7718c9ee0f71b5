//! What the camera has said and has not yet arrived: a line that carries so many bytes a second, or
//! datagrams.

use super::faults::{Dealer, FaultKind};

/// Whose request is answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Origin {
    /// Number of the way that it came in by, and of the peer there.
    pub port: u16,
    pub peer: u16,
    /// Its sequence number, of VISCA over IP.
    pub sequence: u32,
}

/// What leaves the emulator: a reply, or a part of one.
#[derive(Debug, Clone, PartialEq)]
pub struct Outgoing {
    /// When its last byte has arrived, seconds.
    pub time: f64,
    pub origin: Origin,
    pub bytes: Vec<u8>,
}

/// Bits of a byte on a serial line: start, eight, stop.
const BITS: f64 = 10.0;
/// Replies that wait at most; more than that nobody reads.
const MAX_QUEUE: usize = 1024;

/// Seconds a byte takes at so many bits per second; 0 at 0.
pub(super) fn byte_time(baud: f64) -> f64 {
    if baud > 0.0 { BITS / baud } else { 0.0 }
}

pub(super) struct Wire {
    /// In the order in which they are sent; `time` is when that begins.
    queue: Vec<Outgoing>,
    /// No reply begins before this: one was delayed.
    held_until: f64,
    /// Until then the line is busy.
    free: f64,
    /// Seconds a byte takes.
    byte_time: f64,
}

impl Wire {
    /// `baud` 0: at once.
    pub fn new(baud: f64) -> Self {
        Self { queue: Vec::new(), held_until: 0.0, free: 0.0, byte_time: byte_time(baud) }
    }

    /// Sends a reply at a moment, with what goes wrong on its way. The first byte is the header.
    pub fn send(&mut self, time: f64, origin: Origin, packet: &[u8], dealer: &mut Dealer) {
        let mut bytes = packet.to_vec();
        if dealer.strikes(FaultKind::WrongAddress, time).is_some()
            && let Some(header) = bytes.first_mut()
        {
            // Another of the seven, in bits 4 to 6.
            let address = usize::from(*header >> 4 & 7);
            *header = *header & 0x8f | (((address + dealer.below(6)) % 7 + 1) as u8) << 4;
        }
        let bytes = dealer.damage(&bytes, time);
        if dealer.strikes(FaultKind::Lose, time).is_some() {
            return;
        }
        if let Some(seconds) = dealer.strikes(FaultKind::Delay, time) {
            self.held_until = self.held_until.max(time + seconds);
        }
        // This one alone: the next overtake it.
        let late = dealer.strikes(FaultKind::Reorder, time).unwrap_or(0.0);
        let mut pieces = vec![(time.max(self.held_until) + late, bytes)];
        if let Some(pause) = dealer.strikes(FaultKind::Split, time) {
            let (begin, bytes) = &mut pieces[0];
            let rest = bytes.split_off(bytes.len().min(1 + dealer.below(packet.len().max(2) - 1)));
            let then = *begin + pause;
            pieces.push((then, rest));
        }
        if dealer.strikes(FaultKind::Duplicate, time).is_some() {
            pieces.extend(pieces.clone());
        }
        for (time, bytes) in pieces.into_iter().filter(|(_, bytes)| !bytes.is_empty()) {
            if self.queue.len() < MAX_QUEUE {
                let behind = self.queue.partition_point(|o| o.time <= time);
                self.queue.insert(behind, Outgoing { time, origin, bytes });
            }
        }
    }

    /// When the next has arrived.
    pub fn next(&self) -> Option<f64> {
        self.queue.first().map(|o| self.arrival(o))
    }

    /// The next that has arrived by now.
    pub fn receive(&mut self, now: f64) -> Option<Outgoing> {
        let arrival = self.next().filter(|t| *t <= now)?;
        self.free = arrival;
        let outgoing = self.queue.remove(0);
        Some(Outgoing { time: arrival, ..outgoing })
    }

    /// Loses all that is on its way.
    pub fn clear(&mut self) {
        self.queue.clear();
    }

    fn arrival(&self, outgoing: &Outgoing) -> f64 {
        outgoing.time.max(self.free) + outgoing.bytes.len() as f64 * self.byte_time
    }
}

#[cfg(test)]
mod tests {
    use super::super::faults::{Fault, When};
    use super::*;

    const REPLY: [u8; 3] = [0x90, 0x41, 0xff];

    fn sent(kind: FaultKind, seconds: f64) -> Vec<(f64, Vec<u8>)> {
        let (mut wire, mut dealer) = (Wire::new(0.0), Dealer::new(1));
        dealer.set(&[Fault { kind, when: When::Chance(1.0), seconds }]);
        wire.send(1.0, Origin::default(), &REPLY, &mut dealer);
        std::iter::from_fn(|| wire.receive(9.0)).map(|o| (o.time, o.bytes)).collect()
    }

    #[test]
    fn a_line_takes_its_time() {
        let (mut wire, mut dealer) = (Wire::new(9600.0), Dealer::new(1));
        for time in [2.0, 1.0, 1.0] {
            wire.send(time, Origin::default(), &REPLY, &mut dealer);
        }
        let byte = 10.0 / 9600.0;
        assert!(wire.receive(1.0 + 2.9 * byte).is_none());
        let times: Vec<f64> = std::iter::from_fn(|| wire.receive(9.0)).map(|o| o.time).collect();
        for (time, wanted) in times.iter().zip([1.0 + 3.0 * byte, 1.0 + 6.0 * byte, 2.0 + 3.0 * byte]) {
            assert!((time - wanted).abs() < 1e-12, "{times:?}");
        }
        assert_eq!(wire.next(), None);
    }

    #[test]
    fn replies_go_wrong_as_they_should() {
        assert_eq!(sent(FaultKind::Silence, 0.0), [(1.0, REPLY.to_vec())]);
        assert!(sent(FaultKind::Lose, 0.0).is_empty());
        assert_eq!(sent(FaultKind::Delay, 0.5), [(1.5, REPLY.to_vec())]);
        assert_eq!(sent(FaultKind::Duplicate, 0.0).len(), 2);
        let pieces = sent(FaultKind::Split, 0.25);
        assert!(pieces.len() == 2 && pieces[1].0 == 1.25, "{pieces:?}");
        assert_eq!([&pieces[0].1[..], &pieces[1].1[..]].concat(), REPLY);
        let wrong = &sent(FaultKind::WrongAddress, 0.0)[0].1;
        assert!(wrong[0] > 0x90 && wrong[0] & 0x8f == 0x80 && wrong[1..] == REPLY[1..]);
        assert!(sent(FaultKind::DropByte, 0.0).is_empty());
    }

    #[test]
    fn a_delay_holds_the_line_and_a_datagram_is_overtaken() {
        for (kind, wanted) in [(FaultKind::Delay, [1, 2]), (FaultKind::Reorder, [2, 1])] {
            let (mut wire, mut dealer) = (Wire::new(0.0), Dealer::new(1));
            dealer.set(&[Fault { kind, when: When::At(0.0), seconds: 0.5 }]);
            wire.send(1.0, Origin::default(), &[1], &mut dealer);
            wire.send(1.1, Origin::default(), &[2], &mut dealer);
            let order: Vec<u8> = std::iter::from_fn(|| wire.receive(9.0)).map(|o| o.bytes[0]).collect();
            assert_eq!(order, wanted);
        }
    }

    #[test]
    fn the_queue_is_bounded() {
        let (mut wire, mut dealer) = (Wire::new(0.0), Dealer::new(1));
        for _ in 0..5000 {
            wire.send(0.0, Origin::default(), &REPLY, &mut dealer);
        }
        assert_eq!(std::iter::from_fn(|| wire.receive(1.0)).count(), MAX_QUEUE);
    }
}
