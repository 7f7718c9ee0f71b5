//! Gaussian noise, many numbers at a time: the greater part of a noise study's work.
//!
//! Sixteen xoshiro128++ generators run side by side (Blackman and Vigna, "Scrambled linear pseudorandom number
//! generators", 2021), seeded by ChaCha8 from the study's seed and the trial's number, so that a
//! trial's noise does not depend on which thread draws it or when. Each 64 random bits make a pair of
//! deviates by Box and Muller's transform: 31 for the radius (deviates up to 6.7), 30 for the angle
//! within a quadrant, 2 for the quadrant. Logarithm, sine and cosine are polynomials, so that the compiler
//! vectorises the loop, and all is in single precision: noise that is rounded at its seventh digit
//! is as good, and twice as many of it fit into a vector. The loop is compiled for AVX-512, for AVX2 and
//! for whatever the target has; nothing is fused or reordered: all give the same bits.
#![allow(unsafe_code)]

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Numbers that are worked on together.
pub const LANES: usize = 16;
pub type Lanes = [f32; LANES];

/// Streams of independent standard normal deviates, one a lane.
pub struct Normals {
    state: [[u32; LANES]; 4],
}

impl Normals {
    /// Noise number `stream` of a seed.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        Self { state: std::array::from_fn(|_| std::array::from_fn(|_| rng.next_u32())) }
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
        let pair = |(x, y): (&f32, &f32)| [f64::from(*x), f64::from(*y)];
        x.iter().flatten().zip(y.iter().flatten()).map(pair).take(count).collect()
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
        use crate::vectors::{Vectors, widest};
        #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
        fn avx512(kernel: impl Kernel) {
            kernel.run();
        }
        #[target_feature(enable = "avx2")]
        fn avx2(kernel: impl Kernel) {
            kernel.run();
        }
        match widest() {
            // SAFETY: the processor has the features.
            Vectors::Avx512 => return unsafe { avx512(kernel) },
            // SAFETY: the processor has the feature.
            Vectors::Avx2 => return unsafe { avx2(kernel) },
            Vectors::Baseline => {}
        }
    }
    kernel.run();
}

/// Standard normal deviates into x and y.
struct Fill<'a> {
    state: &'a mut [[u32; LANES]; 4],
    x: &'a mut [Lanes],
    y: &'a mut [Lanes],
}

impl Kernel for Fill<'_> {
    #[inline(always)]
    fn run(self) {
        let mut state = *self.state;
        for (x, y) in self.x.iter_mut().zip(self.y) {
            let (radius, angle) = (next(&mut state), next(&mut state));
            for l in 0..LANES {
                (x[l], y[l]) = pair(radius[l], angle[l]);
            }
        }
        *self.state = state;
    }
}

/// xoshiro128++, a step of all lanes.
#[inline(always)]
fn next(s: &mut [[u32; LANES]; 4]) -> [u32; LANES] {
    let mut out = [0; LANES];
    for l in 0..LANES {
        out[l] = s[0][l].wrapping_add(s[3][l]).rotate_left(7).wrapping_add(s[0][l]);
        let t = s[1][l] << 9;
        s[2][l] ^= s[0][l];
        s[3][l] ^= s[1][l];
        s[1][l] ^= s[2][l];
        s[0][l] ^= s[3][l];
        s[2][l] ^= t;
        s[3][l] = s[3][l].rotate_left(11);
    }
    out
}

/// Two normal deviates from random bits of their radius and of their angle.
#[inline(always)]
fn pair(radius: u32, angle: u32) -> (f32, f32) {
    // The middle of one of 2^31 intervals of (0, 1), rounded where they are finer than numbers are.
    let u = ((radius >> 1) as i32 as f32 + 0.5) * (0.5f32).powi(31);
    let radius = (-2.0 * ln(u)).sqrt();
    // In [-1, 1]: an angle in units of pi / 4.
    let t = ((angle as i32 >> 2) as f32 + 0.5) * (0.5f32).powi(29);
    let (sin, cos) = sin_cos(t);
    // The quadrant: which of the two is the sine, and the greater one's sign.
    let cos = f32::from_bits(cos.to_bits() ^ (angle << 30 & 1 << 31));
    let (a, b) = if angle & 1 == 0 { (cos, sin) } else { (sin, cos) };
    (radius * a, radius * b)
}

/// Natural logarithm of a positive normal number, to a few units in the last place: 2^e m with m in
/// [sqrt 1/2, sqrt 2), and ln m = 2 artanh((m - 1) / (m + 1)).
#[inline(always)]
fn ln(x: f32) -> f32 {
    /// Bits of sqrt(1/2), of 1, and of a fraction.
    const LOW: u32 = 0x3F35_04F3;
    const ONE: u32 = 0x3F80_0000;
    const FRACTION: u32 = (1 << 23) - 1;
    const ARTANH: [f32; 4] = odd_reciprocals();
    let shifted = x.to_bits().wrapping_sub(LOW).wrapping_add(ONE);
    let exponent = (shifted >> 23) as i32 as f32 - 127.0;
    let m = f32::from_bits((shifted & FRACTION).wrapping_add(LOW));
    let s = (m - 1.0) / (m + 1.0);
    let z = s * s;
    exponent * std::f32::consts::LN_2 + (2.0 * s + s * z * polynomial(z, &ARTANH))
}

/// Sine and cosine of t pi / 4 for t in [-1, 1], to a unit in the last place or two: their Taylor series.
#[inline(always)]
fn sin_cos(t: f32) -> (f32, f32) {
    const SIN: [f32; 5] = inverse_factorials(1);
    const COS: [f32; 5] = inverse_factorials(0);
    let x = t * std::f32::consts::FRAC_PI_4;
    let z = x * x;
    (x * polynomial(z, &SIN), polynomial(z, &COS))
}

/// c0 + c1 z + c2 z^2 ...
#[inline(always)]
fn polynomial<const N: usize>(z: f32, coefficients: &[f32; N]) -> f32 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * z + c)
}

/// 1 / first!, -1 / (first + 2)!, 1 / (first + 4)!, ...
const fn inverse_factorials<const N: usize>(first: u32) -> [f32; N] {
    let (mut c, mut value, mut k) = ([1.0; N], 1.0, 1);
    while k < N {
        let n = first + 2 * k as u32;
        value = -value / (n * (n - 1)) as f64;
        c[k] = value as f32;
        k += 1;
    }
    c
}

/// 2 / 3, 2 / 5, 2 / 7, ...
const fn odd_reciprocals<const N: usize>() -> [f32; N] {
    let (mut c, mut k) = ([0.0; N], 0);
    while k < N {
        c[k] = 2.0 / (2 * k + 3) as f32;
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
            let u = i as f32 / 4000.0;
            for u in [u, u * 2f32.powi(-32)] {
                let wanted = f64::from(u).ln();
                assert!((f64::from(ln(u)) - wanted).abs() < 4e-7 * wanted.abs().max(0.1), "{u}");
            }
            let t = 2.0 * u - 1.0;
            let (sin, cos) = sin_cos(t);
            let (sine, cosine) = (f64::from(t) * std::f64::consts::FRAC_PI_4).sin_cos();
            assert!((f64::from(sin) - sine).abs() < 2e-7 && (f64::from(cos) - cosine).abs() < 2e-7, "{t}");
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
