//! Gaussian noise, many numbers at a time: the greater part of a noise study's work.
//!
//! Eight xoshiro256++ generators run side by side (Blackman and Vigna 2021), seeded by ChaCha8 from the
//! study's seed and the trial's number, so that a trial's noise does not depend on which thread draws
//! it or when. Each 64 random bits make a pair of deviates by Box and Muller's transform: 32 for the
//! radius (deviates up to 6.7), 30 for the angle within a quadrant, 2 for the quadrant. Logarithm, sine
//! and cosine are polynomials, so that the compiler vectorises the loop. It is compiled for AVX-512,
//! for AVX2 and for whatever the target has; nothing is fused or reordered: all give the same bits.
#![allow(unsafe_code)]

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Numbers that are worked on together.
pub const LANES: usize = 8;
pub type Lanes = [f64; LANES];

/// Eight streams of independent standard normal deviates.
pub struct Normals {
    state: [[u64; LANES]; 4],
}

impl Normals {
    /// Noise number `stream` of a seed.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        Self { state: std::array::from_fn(|_| std::array::from_fn(|_| rng.next_u64())) }
    }

    /// Fills both with standard normal deviates, the first as many as the second.
    pub fn fill(&mut self, x: &mut [Lanes], y: &mut [Lanes]) {
        run_widest(Fill { state: &mut self.state, x, y });
    }

    /// Pairs of deviates.
    pub fn pairs(&mut self, count: usize) -> Vec<[f64; 2]> {
        let blocks = count.div_ceil(LANES);
        let (mut x, mut y) = (vec![[0.0; LANES]; blocks], vec![[0.0; LANES]; blocks]);
        self.fill(&mut x, &mut y);
        x.iter().flatten().zip(y.iter().flatten()).map(|(x, y)| [*x, *y]).take(count).collect()
    }
}

/// A loop that gains from wide vectors; `run` must be `#[inline(always)]`.
pub trait Kernel {
    fn run(self);
}

/// Runs a kernel, compiled for the widest vectors of the processor at hand.
pub fn run_widest(kernel: impl Kernel) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
        fn avx512(kernel: impl Kernel) {
            kernel.run();
        }
        #[target_feature(enable = "avx2")]
        fn avx2(kernel: impl Kernel) {
            kernel.run();
        }
        let wide = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl");
        if wide {
            // SAFETY: the processor has the features.
            return unsafe { avx512(kernel) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has the feature.
            return unsafe { avx2(kernel) };
        }
    }
    kernel.run();
}

/// Standard normal deviates into x and y.
struct Fill<'a> {
    state: &'a mut [[u64; LANES]; 4],
    x: &'a mut [Lanes],
    y: &'a mut [Lanes],
}

impl Kernel for Fill<'_> {
    #[inline(always)]
    fn run(self) {
        const CHUNK: usize = 16;
        let mut s = *self.state;
        for (x, y) in self.x.chunks_mut(CHUNK).zip(self.y.chunks_mut(CHUNK)) {
            // All bits first: a long plain loop over them is what the compiler vectorises.
            let mut random = [[0; LANES]; CHUNK];
            random[..x.len()].iter_mut().for_each(|r| *r = next(&mut s));
            let out = x.as_flattened_mut().iter_mut().zip(y.as_flattened_mut());
            for ((x, y), bits) in out.zip(random.as_flattened()) {
                (*x, *y) = pair(*bits);
            }
        }
        *self.state = s;
    }
}

/// xoshiro256++, a step of all lanes.
#[inline(always)]
fn next(s: &mut [[u64; LANES]; 4]) -> [u64; LANES] {
    let mut out = [0; LANES];
    for l in 0..LANES {
        out[l] = s[0][l].wrapping_add(s[3][l]).rotate_left(23).wrapping_add(s[0][l]);
        let t = s[1][l] << 17;
        s[2][l] ^= s[0][l];
        s[3][l] ^= s[1][l];
        s[1][l] ^= s[2][l];
        s[0][l] ^= s[3][l];
        s[2][l] ^= t;
        s[3][l] = s[3][l].rotate_left(45);
    }
    out
}

/// Bits of 1.0: with a fraction behind the exponent, a number in [1, 2).
const ONE: u64 = 0x3FF0_0000_0000_0000;
const FRACTION: u64 = (1 << 52) - 1;

/// Two normal deviates from 64 random bits.
#[inline(always)]
fn pair(bits: u64) -> (f64, f64) {
    // In (0, 1): the middle of one of 2^32 intervals.
    let u = f64::from_bits(ONE | (bits & 0xFFFF_FFFF) << 20 | 1 << 19) - 1.0;
    let radius = (-2.0 * ln(u)).sqrt();
    // In (-1, 1): an angle in units of pi / 4.
    let t = f64::from_bits(ONE | (bits >> 34) << 22 | 1 << 21) * 2.0 - 3.0;
    let (sin, cos) = sin_cos(t);
    // The quadrant: which of the two is the sine, and the greater one's sign.
    let cos = f64::from_bits(cos.to_bits() ^ (bits << 30 & 1 << 63));
    let (a, b) = if bits & 1 << 32 == 0 { (cos, sin) } else { (sin, cos) };
    (radius * a, radius * b)
}

/// Natural logarithm of a positive normal number, to 2e-15: 2^e m with m in [sqrt 1/2, sqrt 2), and
/// ln m = 2 artanh((m - 1) / (m + 1)).
#[inline(always)]
fn ln(x: f64) -> f64 {
    /// Bits of sqrt(1/2).
    const LOW: u64 = 0x3FE6_A09E_667F_3BCD;
    // 2^52 with an integer behind it: a conversion that vectorises everywhere.
    const INTEGER: u64 = 0x4330_0000_0000_0000;
    const ARTANH: [f64; 8] = odd_reciprocals();
    let shifted = x.to_bits().wrapping_sub(LOW).wrapping_add(ONE);
    let exponent = f64::from_bits(INTEGER | shifted >> 52) - f64::from_bits(INTEGER) - 1023.0;
    let m = f64::from_bits((shifted & FRACTION).wrapping_add(LOW));
    let s = (m - 1.0) / (m + 1.0);
    let z = s * s;
    let series = z * polynomial(z, &ARTANH);
    exponent * std::f64::consts::LN_2 + (2.0 * s + s * series)
}

/// Sine and cosine of t pi / 4 for t in [-1, 1], to 2e-15: their Taylor series.
#[inline(always)]
fn sin_cos(t: f64) -> (f64, f64) {
    const SIN: [f64; 8] = inverse_factorials(1);
    const COS: [f64; 8] = inverse_factorials(0);
    let x = t * std::f64::consts::FRAC_PI_4;
    let z = x * x;
    (x * polynomial(z, &SIN), polynomial(z, &COS))
}

/// c0 + c1 z + c2 z^2 ...
#[inline(always)]
fn polynomial<const N: usize>(z: f64, coefficients: &[f64; N]) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * z + c)
}

/// 1 / first!, -1 / (first + 2)!, 1 / (first + 4)!, ...
const fn inverse_factorials(first: u32) -> [f64; 8] {
    let mut c = [1.0; 8];
    let mut k = 1;
    while k < 8 {
        let n = first + 2 * k as u32;
        c[k] = -c[k - 1] / (n * (n - 1)) as f64;
        k += 1;
    }
    c
}

/// 2 / 3, 2 / 5, 2 / 7, ...
const fn odd_reciprocals() -> [f64; 8] {
    let mut c = [0.0; 8];
    let mut k = 0;
    while k < 8 {
        c[k] = 2.0 / (2 * k + 3) as f64;
        k += 1;
    }
    c
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithm_and_sine_are_those_of_the_standard_library() {
        for i in 1..4000 {
            let u = i as f64 / 4000.0;
            assert!((ln(u) - u.ln()).abs() < 4e-15 * u.ln().abs().max(0.1), "{u}");
            let tiny = u * 2f64.powi(-32);
            assert!((ln(tiny) - tiny.ln()).abs() < 1e-14);
            let t = 2.0 * u - 1.0;
            let (sin, cos) = sin_cos(t);
            let x = t * std::f64::consts::FRAC_PI_4;
            assert!((sin - x.sin()).abs() < 2e-15 && (cos - x.cos()).abs() < 2e-15, "{t}");
        }
    }

    #[test]
    fn deviates_are_standard_normal_and_independent() {
        let pairs = Normals::new(1, 0).pairs(1 << 20);
        let n = pairs.len() as f64;
        let mean = |f: &dyn Fn(f64, f64) -> f64| pairs.iter().map(|[x, y]| f(*x, *y)).sum::<f64>() / n;
        // Each within five standard deviations of the mean of so many.
        let near = |value: f64, wanted: f64, variance: f64| {
            assert!((value - wanted).abs() < 5.0 * (variance / n).sqrt(), "{value} {wanted}");
        };
        near(mean(&|x, _| x), 0.0, 1.0);
        near(mean(&|_, y| y), 0.0, 1.0);
        near(mean(&|x, _| x * x), 1.0, 2.0);
        near(mean(&|_, y| y * y), 1.0, 2.0);
        near(mean(&|x, _| x * x * x), 0.0, 15.0);
        near(mean(&|x, _| x.powi(4)), 3.0, 96.0);
        near(mean(&|_, y| y.powi(4)), 3.0, 96.0);
        near(mean(&|x, y| x * y), 0.0, 1.0);
        near(mean(&|x, y| x * x * y * y), 1.0, 8.0);
        // The cumulative distribution at some places.
        for (at, below) in [(-3.0, 0.001349898), (-1.0, 0.158655254), (0.5, 0.691462461), (2.0, 0.977249868)] {
            near(mean(&|x, _| f64::from(x < at)), below, below * (1.0 - below));
            near(mean(&|_, y| f64::from(y < at)), below, below * (1.0 - below));
        }
        // Neighbours in a lane, and in neighbouring lanes.
        for gap in [1, LANES, 2 * LANES] {
            let product: f64 = pairs.windows(gap + 1).map(|w| w[0][0] * w[gap][0]).sum::<f64>() / n;
            near(product, 0.0, 1.0);
        }
    }

    #[test]
    fn every_processor_draws_the_same_and_every_stream_another() {
        let mut plain = vec![[0.0; LANES]; 1000];
        let (mut vectors, mut other) = (plain.clone(), plain.clone());
        let mut y = plain.clone();
        let mut normals = Normals::new(3, 7);
        Fill { state: &mut normals.state, x: &mut plain, y: &mut y }.run();
        let plain_y = y.clone();
        Normals::new(3, 7).fill(&mut vectors, &mut y);
        assert_eq!((plain.clone(), plain_y), (vectors, y.clone()));
        Normals::new(3, 8).fill(&mut other, &mut y);
        assert!(plain.iter().flatten().zip(other.iter().flatten()).all(|(a, b)| a != b));
    }
}
