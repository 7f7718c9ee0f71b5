//! The loops over a row of bytes: see [`crate::vectors`].
#![allow(unsafe_code)]

use crate::vectors::for_each_processor;

for_each_processor! {
    /// At most 256 bytes to a sum: it fits.
    pub fn add_bytes(sums: &mut [u16], bytes: &[u8]) {
        for (sum, byte) in sums.iter_mut().zip(bytes) {
            *sum = sum.wrapping_add(*byte as u16);
        }
    }

    /// The sums over their count, rounded: times `share`, which is 2^24 over the count.
    pub fn scale_to_bytes(out: &mut [u8], sums: &[u16], share: u32) {
        for (out, sum) in out.iter_mut().zip(sums) {
            // At most 255 x 2^24 and a half.
            *out = ((*sum as u32).wrapping_mul(share).wrapping_add(1 << 23) >> 24) as u8;
        }
    }
}
