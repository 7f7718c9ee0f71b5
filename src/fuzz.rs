//! Random input for the tests of what reads bytes from outside.

/// How many inputs a fuzz test takes: `make fuzz` asks for ten million.
pub fn fuzz_inputs() -> u64 {
    std::env::var("PTZCAL_FUZZ_INPUTS").ok().and_then(|n| n.parse().ok()).unwrap_or(100_000)
}

/// `good` with some bytes changed, cut out or doubled, or its end cut off.
pub fn mutated(good: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for _ in 0..1 + random.below(4) {
        let at = random.below(bytes.len().max(1) as u64) as usize;
        match random.below(5) {
            _ if bytes.is_empty() => {}
            0 => bytes[at] = random.below(256) as u8,
            1 => bytes[at] ^= 1 << random.below(8),
            2 => bytes.truncate(at),
            3 => drop(bytes.drain(at..(at + random.below(20) as usize).min(bytes.len()))),
            _ => {
                let piece = bytes[at..(at + random.below(40) as usize).min(bytes.len())].to_vec();
                bytes.splice(at..at, piece);
            }
        }
    }
    bytes
}

/// A linear congruential generator: the same inputs on every machine.
pub struct Random(pub u64);

impl Random {
    /// From 0 to `limit` - 1.
    pub fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) % limit.max(1)
    }
}
