//! LZF, the compression inside PCD files (M. Lehmann's liblzf): runs of literal bytes, and copies from
//! up to 8 kB before.
//!
//! A control byte below 32 is followed by that many literals and one more. In any other its upper three
//! bits are the length of a copy less 2 (7: the next byte is added), its lower five and the next byte
//! the distance less 1.

const MAX_LITERALS: usize = 32;
const MAX_DISTANCE: usize = 1 << 13;
const MAX_LENGTH: usize = 2 + 7 + 255;
const HASH_BITS: u32 = 15;

pub(super) fn compress(input: &[u8]) -> Vec<u8> {
    // Where three bytes were last seen, one more than the index; 0 for never.
    let mut seen = vec![0usize; 1 << HASH_BITS];
    let mut output = Vec::with_capacity(input.len() / 2 + 64);
    let (mut at, mut literals) = (0, 0);
    while at + 2 < input.len() {
        let three = u32::from_le_bytes([input[at], input[at + 1], input[at + 2], 0]);
        let hash = (three.wrapping_mul(0x9E37_79B1) >> (32 - HASH_BITS)) as usize;
        let before = std::mem::replace(&mut seen[hash], at + 1);
        let copy = before > 0 && at + 1 - before <= MAX_DISTANCE && input[before - 1..before + 2] == input[at..at + 3];
        if !copy {
            at += 1;
            continue;
        }
        let from = before - 1;
        let most = MAX_LENGTH.min(input.len() - at);
        let length = (3..most).find(|i| input[from + i] != input[at + i]).unwrap_or(most);
        put_literals(&mut output, &input[literals..at]);
        let (distance, code) = (at - from - 1, length - 2);
        output.push(((code.min(7) << 5) | distance >> 8) as u8);
        if code >= 7 {
            output.push((code - 7) as u8);
        }
        output.push(distance as u8);
        at += length;
        literals = at;
    }
    put_literals(&mut output, &input[literals..]);
    output
}

fn put_literals(output: &mut Vec<u8>, literals: &[u8]) {
    for run in literals.chunks(MAX_LITERALS) {
        output.push((run.len() - 1) as u8);
        output.extend(run);
    }
}

/// The `length` bytes that were compressed; `None` when it is not exactly these.
pub(super) fn decompress(input: &[u8], length: usize) -> Option<Vec<u8>> {
    // A copy makes at most 264 bytes of 3.
    if length > input.len().saturating_mul(MAX_LENGTH / 3) {
        return None;
    }
    let mut output = Vec::with_capacity(length);
    let mut rest = input.iter();
    while let Some(control) = rest.next() {
        let control = usize::from(*control);
        if control < MAX_LITERALS {
            let run = rest.as_slice().get(..control + 1)?;
            output.extend_from_slice(run);
            rest = rest.as_slice()[control + 1..].iter();
        } else {
            let mut count = (control >> 5) + 2;
            if count == 9 {
                count += usize::from(*rest.next()?);
            }
            let distance = ((control & 31) << 8 | usize::from(*rest.next()?)) + 1;
            let from = output.len().checked_sub(distance)?;
            if output.len() + count > length {
                return None;
            }
            // What is copied may be copied again.
            for i in from..from + count {
                output.push(output[i]);
            }
        }
        if output.len() > length {
            return None;
        }
    }
    (output.len() == length).then_some(output)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fuzz::{Random, fuzz_inputs, mutated};

    #[test]
    fn what_is_compressed_comes_back() {
        let mut random = Random(1);
        for length in (0..70).chain([1000, 8191, 8192, 8193, 100_000]) {
            for letters in [1, 2, 4, 256] {
                let bytes: Vec<u8> = (0..length).map(|_| random.below(letters) as u8).collect();
                let packed = compress(&bytes);
                assert_eq!(decompress(&packed, length).as_ref(), Some(&bytes), "{length} of {letters}");
                assert!(packed.len() <= length + length.div_ceil(32));
            }
        }
        assert!(compress(&[7; 10_000]).len() < 150);
    }

    #[test]
    fn by_the_books() {
        // "abc", then 9 bytes from 3 before: a length of 9 needs the extra byte.
        assert_eq!(decompress(&[2, b'a', b'b', b'c', 7 << 5, 0, 2], 12).unwrap(), b"abcabcabcabc");
        assert_eq!(decompress(&[0, b'x', 1 << 5, 0], 4).unwrap(), b"xxxx");
        for bad in [&[5, 1, 2][..], &[32], &[0, 1, 32], &[0, 1, 32, 1], &[7 << 5, 0]] {
            assert_eq!(decompress(bad, 4), None, "{bad:?}");
        }
        assert_eq!((decompress(&[0, b'x'], 2), decompress(&[0, b'x'], usize::MAX)), (None, None));
    }

    #[test]
    fn fuzz_lzf() {
        let mut random = Random(3);
        let bytes: Vec<u8> = (0..400).map(|i| (i % 7 * i / 50) as u8).collect();
        let good = compress(&bytes);
        for _ in 0..fuzz_inputs() {
            let bad = mutated(&good, &mut random);
            if let Some(found) = decompress(&bad, 400) {
                assert_eq!(found.len(), 400);
            }
        }
    }
}
