//! What can go wrong between a camera and its controller, each with a probability or at a moment.

use std::fmt;
use std::str::FromStr;

use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use crate::error::{Error, Result};

/// One way to fail. Where a fault takes time, [`Fault::seconds`] says how long.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultKind {
    /// A byte is lost. Asked of each byte, in both directions.
    DropByte,
    /// Bits of a byte turn over. Asked of each byte, in both directions.
    GarbleByte,
    /// A pause within a reply. Asked of each reply, as all to [`Reorder`](Self::Reorder).
    Split,
    /// A reply comes late, and those after it as well.
    Delay,
    /// A reply bears another camera's address.
    WrongAddress,
    /// A reply comes twice.
    Duplicate,
    /// A reply, or a datagram in either direction, is lost.
    Lose,
    /// A reply's datagram is late, and others overtake it.
    Reorder,
    /// A datagram is answered by "abnormal sequence number" and not heard.
    SequenceError,
    /// The camera hears and says nothing for a time. Asked of each request, as the next two.
    Silence,
    /// The camera says unasked that the network has changed.
    NetworkChange,
    /// The link dies, and is back after a time.
    Unplug,
    /// A move is accepted, and the position reported at once, but the head stands. Asked of each move.
    LieArrived,
    /// A move is accepted and completed, but the head stands. Asked of each move.
    LieIgnored,
    /// The head stops half way, and the mode word says "failed". Asked of each move.
    Stall,
}

impl FaultKind {
    pub const ALL: [Self; 15] = [
        Self::DropByte,
        Self::GarbleByte,
        Self::Split,
        Self::Delay,
        Self::WrongAddress,
        Self::Duplicate,
        Self::Lose,
        Self::Reorder,
        Self::SequenceError,
        Self::Silence,
        Self::NetworkChange,
        Self::Unplug,
        Self::LieArrived,
        Self::LieIgnored,
        Self::Stall,
    ];

    /// As faults are written, such as `drop-byte`.
    pub fn name(self) -> &'static str {
        match self {
            Self::DropByte => "drop-byte",
            Self::GarbleByte => "garble-byte",
            Self::Split => "split",
            Self::Delay => "delay",
            Self::WrongAddress => "wrong-address",
            Self::Duplicate => "duplicate",
            Self::Lose => "lose",
            Self::Reorder => "reorder",
            Self::SequenceError => "sequence-error",
            Self::Silence => "silence",
            Self::NetworkChange => "network-change",
            Self::Unplug => "unplug",
            Self::LieArrived => "lie-arrived",
            Self::LieIgnored => "lie-ignored",
            Self::Stall => "stall",
        }
    }

    fn default_seconds(self) -> f64 {
        match self {
            Self::Split | Self::Delay | Self::Reorder => 0.1,
            Self::Silence => 2.0,
            Self::Unplug => 5.0,
            _ => 0.0,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum When {
    /// At each occasion with this probability.
    Chance(f64),
    /// Once, at the first occasion from this moment on (seconds of the emulator's clock).
    At(f64),
}

/// Written `kind=probability` or `kind@moment`, and `:seconds` where it takes time:
/// `garble-byte=0.001`, `unplug@30:5`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fault {
    pub kind: FaultKind,
    pub when: When,
    /// How long it takes: pause of a split, delay, silence, until it is plugged in again.
    pub seconds: f64,
}

impl Fault {
    pub fn new(kind: FaultKind, when: When) -> Self {
        Self { kind, when, seconds: kind.default_seconds() }
    }

    pub(super) fn validate(&self) -> Result<()> {
        let good = match self.when {
            When::Chance(p) => (0.0..=1.0).contains(&p),
            When::At(t) => t >= 0.0 && t.is_finite(),
        };
        if good && self.seconds >= 0.0 && self.seconds.is_finite() {
            return Ok(());
        }
        Err(Error::invalid("fault", format!("{self}: probabilities are 0 to 1, moments and times 0 or more")))
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.when {
            When::Chance(p) => write!(f, "{}={p}", self.kind.name())?,
            When::At(t) => write!(f, "{}@{t}", self.kind.name())?,
        }
        if self.seconds > 0.0 { write!(f, ":{}", self.seconds) } else { Ok(()) }
    }
}

impl FromStr for Fault {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let wrong = |reason: &str| Error::invalid("fault", format!("{text:?}: {reason}"));
        let i = text.find(['=', '@']).ok_or_else(|| wrong("it wants kind=probability or kind@moment"))?;
        let (name, value) = (&text[..i], &text[i + 1..]);
        let known = || FaultKind::ALL.map(FaultKind::name).join(", ");
        let kind = FaultKind::ALL
            .into_iter()
            .find(|k| k.name() == name)
            .ok_or_else(|| wrong(&format!("kinds are {}", known())))?;
        let (value, seconds) = value.split_once(':').map_or((value, None), |(v, s)| (v, Some(s)));
        let number = |t: &str| t.parse::<f64>().map_err(|_| wrong(&format!("{t:?} is no number")));
        let value = number(value)?;
        let when = if text[i..].starts_with('=') { When::Chance(value) } else { When::At(value) };
        let seconds = seconds.map_or(Ok(kind.default_seconds()), number)?;
        let fault = Self { kind, when, seconds };
        fault.validate().map(|()| fault)
    }
}

/// Deals out faults; the same seed and the same occasions give the same ones.
pub(super) struct Dealer {
    /// Those that strike at a moment are taken out when they have.
    faults: Vec<Fault>,
    random: ChaCha8Rng,
}

impl Dealer {
    pub fn new(seed: u64) -> Self {
        Self { faults: Vec::new(), random: ChaCha8Rng::seed_from_u64(seed) }
    }

    pub fn set(&mut self, faults: &[Fault]) {
        self.faults = faults.to_vec();
    }

    /// Does it happen now? Then how long, seconds.
    pub fn strikes(&mut self, kind: FaultKind, now: f64) -> Option<f64> {
        for i in 0..self.faults.len() {
            let fault = self.faults[i];
            if fault.kind != kind {
                continue;
            }
            match fault.when {
                When::Chance(p) if self.uniform() < p => return Some(fault.seconds),
                When::At(moment) if now >= moment => {
                    self.faults.swap_remove(i);
                    return Some(fault.seconds);
                }
                _ => {}
            }
        }
        None
    }

    /// When the next fault that waits for a moment and for nothing else strikes.
    pub fn next_moment(&self, kind: FaultKind) -> Option<f64> {
        let moments = self.faults.iter().filter(|f| f.kind == kind).filter_map(|f| match f.when {
            When::At(t) => Some(t),
            When::Chance(_) => None,
        });
        moments.min_by(f64::total_cmp)
    }

    /// In [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// One of 0 to n - 1.
    pub fn below(&mut self, n: usize) -> usize {
        (self.uniform() * n as f64) as usize
    }

    /// Drops and garbles bytes.
    pub fn damage(&mut self, bytes: &[u8], now: f64) -> Vec<u8> {
        let mut damaged = Vec::with_capacity(bytes.len());
        for &byte in bytes {
            if self.strikes(FaultKind::DropByte, now).is_some() {
                continue;
            }
            let bits = if self.strikes(FaultKind::GarbleByte, now).is_some() { 1 + self.below(255) as u8 } else { 0 };
            damaged.push(byte ^ bits);
        }
        damaged
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_read_and_written() {
        for text in ["drop-byte=0.01", "unplug@30:5", "silence=0.25:2", "lie-arrived@0"] {
            let fault: Fault = text.parse().unwrap();
            assert_eq!(fault.to_string(), text);
        }
        let unplug: Fault = "unplug@30".parse().unwrap();
        assert_eq!(unplug, Fault::new(FaultKind::Unplug, When::At(30.0)));
        for kind in FaultKind::ALL {
            assert_eq!(format!("{}=1", kind.name()).parse::<Fault>().unwrap().kind, kind);
        }
    }

    #[test]
    fn bad_faults_are_refused() {
        for (text, part) in [
            ("drop-byte", "kind@moment"),
            ("drop-bit=1", "garble-byte"),
            ("silence=often", "no number"),
            ("silence=0.1:long", "no number"),
            ("silence=1.5", "0 to 1"),
            ("silence@-1", "0 or more"),
            ("silence=NaN", "0 to 1"),
            ("silence@inf", "0 or more"),
            ("delay=1:-1", "0 or more"),
        ] {
            let error = text.parse::<Fault>().unwrap_err().to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
    }

    #[test]
    fn faults_strike_as_often_as_they_say() {
        let mut dealer = Dealer::new(5);
        dealer.set(&[Fault::new(FaultKind::Lose, When::Chance(0.1)), Fault::new(FaultKind::Unplug, When::At(3.0))]);
        // Binomial: 1000 expected, standard deviation 30.
        let struck = (0..10_000).filter(|_| dealer.strikes(FaultKind::Lose, 0.0).is_some()).count();
        assert!((880..1120).contains(&struck), "{struck}");
        assert_eq!(dealer.strikes(FaultKind::Reorder, 9.0), None);
        assert_eq!(dealer.next_moment(FaultKind::Unplug), Some(3.0));
        let unplugged: Vec<bool> =
            [2.0, 3.5, 3.6].map(|t| dealer.strikes(FaultKind::Unplug, t).is_some()).into_iter().collect();
        assert_eq!(unplugged, [false, true, false]);
    }

    #[test]
    fn damage_drops_and_garbles() {
        let mut dealer = Dealer::new(7);
        let bytes: Vec<u8> = (0..=255).collect();
        assert_eq!(dealer.damage(&bytes, 0.0), bytes);
        dealer.set(&[Fault::new(FaultKind::GarbleByte, When::Chance(1.0))]);
        let garbled = dealer.damage(&bytes, 0.0);
        assert!(garbled.len() == 256 && garbled.iter().zip(&bytes).all(|(a, b)| a != b));
        dealer.set(&[Fault::new(FaultKind::DropByte, When::At(1.0))]);
        assert_eq!(dealer.damage(&bytes, 2.0), bytes[1..]);
    }
}
