//! Points of binary_compressed PCD files with the fields x y z as f32, for tests.
#![allow(dead_code)]

use std::path::Path;

use nalgebra::Vector3;

pub fn read(path: &Path) -> Vec<Vector3<f64>> {
    let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let head = b"DATA binary_compressed\n";
    let start = bytes.windows(head.len()).position(|w| w == head).expect("binary_compressed") + head.len();
    let size = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize;
    let fields = decompress(&bytes[start + 8..start + 8 + size(start)]);
    assert_eq!(fields.len(), size(start + 4));
    // All x, then all y, then all z.
    let values: Vec<f64> =
        fields.chunks_exact(4).map(|b| f64::from(f32::from_le_bytes(b.try_into().expect("four bytes")))).collect();
    let count = values.len() / 3;
    (0..count).map(|i| Vector3::new(values[i], values[count + i], values[2 * count + i])).collect()
}

/// LZF: runs of literals, and copies of what came before.
fn decompress(input: &[u8]) -> Vec<u8> {
    let (mut out, mut i) = (Vec::new(), 0);
    while i < input.len() {
        let control = usize::from(input[i]);
        i += 1;
        if control < 32 {
            out.extend_from_slice(&input[i..=i + control]);
            i += control + 1;
            continue;
        }
        let mut length = control >> 5;
        if length == 7 {
            length += usize::from(input[i]);
            i += 1;
        }
        let back = ((control & 31) << 8) + usize::from(input[i]) + 1;
        i += 1;
        for _ in 0..length + 2 {
            out.push(out[out.len() - back]);
        }
    }
    out
}
