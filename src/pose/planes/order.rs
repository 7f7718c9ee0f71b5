//! Morton order: points that are close in it are close in space.

use nalgebra::Vector3;

use super::kernels::bounds;

/// Bits of each coordinate in a Morton code.
const BITS: u32 = 21;
/// Bits of a code that are sorted by at a time, and how often: what is equal then is sorted on its own.
const DIGIT: u32 = 11;
const DIGITS: u32 = 3;

/// Indices of finite points in Morton order; equal ones stay in theirs.
pub(super) fn morton(places: &[Vector3<f64>]) -> Vec<u32> {
    let [low, high] = bounds(places).map(Vector3::from);
    let size = (high - low).amax();
    let scale = if size > 0.0 && size.is_finite() { f64::from((1u32 << BITS) - 1) / size } else { 0.0 };
    let code = |p: &Vector3<f64>| {
        let cell = (p - low) * scale;
        spread(cell.x as u64) | spread(cell.y as u64) << 1 | spread(cell.z as u64) << 2
    };
    let order = places.iter().enumerate().map(|(i, p)| (code(p), i as u32)).collect();
    sorted(order).into_iter().map(|(_, i)| i).collect()
}

/// Sorted by codes, of equal ones by indices, which rise: by the first digits from the last of them on.
fn sorted(mut order: Vec<(u64, u32)>) -> Vec<(u64, u32)> {
    let mut room = vec![(0, 0); order.len()];
    let mut starts = [0u32; 1 << DIGIT];
    for digit in (0..DIGITS).rev() {
        let of = |code: u64| (code >> (3 * BITS - (digit + 1) * DIGIT)) as usize & ((1 << DIGIT) - 1);
        starts.fill(0);
        order.iter().for_each(|(code, _)| starts[of(*code)] += 1);
        let mut before = 0;
        for start in &mut starts {
            before += std::mem::replace(start, before);
        }
        for one in &order {
            let place = &mut starts[of(one.0)];
            room[*place as usize] = *one;
            *place += 1;
        }
        std::mem::swap(&mut order, &mut room);
    }
    let first_digits = |one: &(u64, u32)| one.0 >> (3 * BITS - DIGITS * DIGIT);
    order
        .chunk_by_mut(|p, q| first_digits(p) == first_digits(q))
        .filter(|c| c.len() > 1)
        .for_each(|c| c.sort_unstable());
    order
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
    fn octants_come_one_after_the_other() {
        let corner = |i: u32| Vector3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2 & 1));
        let points: Vec<Vector3<f64>> = (0..8).rev().map(corner).collect();
        assert_eq!(morton(&points), [7, 6, 5, 4, 3, 2, 1, 0]);
        assert_eq!(morton(&[Vector3::x(), Vector3::x()]), [0, 1]);
        assert!(morton(&[]).is_empty());
    }

    #[test]
    fn codes_are_sorted_and_equal_ones_stay() {
        let codes = (0..5000u64).map(|i| i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (1 + i % 40));
        let order: Vec<(u64, u32)> = codes.zip(0..).collect();
        let mut wanted = order.clone();
        wanted.sort();
        assert_eq!(sorted(order), wanted);
    }
}
