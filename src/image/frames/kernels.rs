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

    /// The sums times `share`, rounded.
    pub fn scale_to_bytes(out: &mut [u8], sums: &[u16], share: f32) {
        for (out, sum) in out.iter_mut().zip(sums) {
            *out = (*sum as f32 * share + 0.5) as i32 as u8;
        }
    }
}
