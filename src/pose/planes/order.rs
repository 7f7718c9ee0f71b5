//! Morton order: points that are close in it are close in space.

use nalgebra::Vector3;

/// Bits of each coordinate in a Morton code.
const BITS: u32 = 21;

/// Indices of finite points in Morton order; those without a position come last.
pub(super) fn morton(positions: &[Option<Vector3<f64>>]) -> Vec<u32> {
    let known = || positions.iter().flatten();
    let low = known().fold(Vector3::repeat(f64::INFINITY), |m, p| m.inf(p));
    let high = known().fold(Vector3::repeat(f64::NEG_INFINITY), |m, p| m.sup(p));
    let size = (high - low).amax();
    let scale = if size > 0.0 && size.is_finite() { f64::from((1u32 << BITS) - 1) / size } else { 0.0 };
    let code = |p: &Option<Vector3<f64>>| {
        let Some(p) = p else { return u64::MAX };
        let cell = (p - low) * scale;
        spread(cell.x as u64) | spread(cell.y as u64) << 1 | spread(cell.z as u64) << 2
    };
    let mut order: Vec<(u64, u32)> = positions.iter().enumerate().map(|(i, p)| (code(p), i as u32)).collect();
    order.sort_unstable();
    order.into_iter().map(|(_, i)| i).collect()
}

/// Two zero bits before each bit.
fn spread(x: u64) -> u64 {
    [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ]
    .iter()
    .fold(x & ((1 << BITS) - 1), |x, (shift, mask)| (x | x << shift) & mask)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_interleaved() {
        for x in [0u64, 1, 2, 5, 0x15_5555, (1 << BITS) - 1] {
            let wanted = (0..BITS).fold(0, |code, bit| code | (x >> bit & 1) << (3 * bit));
            assert_eq!(spread(x), wanted);
        }
    }

    #[test]
    fn octants_come_one_after_the_other_and_what_is_nowhere_last() {
        let corner = |i: u32| Vector3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2 & 1));
        let mut points: Vec<Option<Vector3<f64>>> = (0..8).rev().map(|i| Some(corner(i))).collect();
        points.insert(3, None);
        assert_eq!(morton(&points), [8, 7, 6, 5, 4, 2, 1, 0, 3]);
        assert_eq!(morton(&[Some(Vector3::x()), Some(Vector3::x())]), [0, 1]);
        assert!(morton(&[]).is_empty());
    }
}
