//! The exponential of many numbers: plain arithmetic that the compiler vectorises.

/// e^x of x <= 0 to 1e-14, and of those below -700 that of -700: 2^n times the Taylor series of the rest,
/// which is at most ln 2 / 2.
#[inline(always)]
pub fn exponential(x: f64) -> f64 {
    /// 1 / 11!, 1 / 10!, ..., 1 / 0!.
    const COEFFICIENTS: [f64; 12] = {
        let mut c = [1.0; 12];
        let mut k = 1;
        while k < 12 {
            c[11 - k] = c[12 - k] / k as f64;
            k += 1;
        }
        c
    };
    /// Leaves whole numbers in the last bits of a sum.
    const ROUNDING: f64 = 1.5 * (1u64 << 52) as f64;
    /// ln 2 in two parts, the first with zeros at its end so that n times it is exact.
    const LN_2: [f64; 2] = [f64::from_bits(0x3fe6_2e42_fee0_0000), f64::from_bits(0x3dea_39ef_3579_3c76)];
    let x = if x > -700.0 { x } else { -700.0 };
    let rounded = x * std::f64::consts::LOG2_E + ROUNDING;
    let n = rounded - ROUNDING;
    let power = f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52);
    let r = (x - n * LN_2[0]) - n * LN_2[1];
    let mut series = COEFFICIENTS[0];
    for c in &COEFFICIENTS[1..] {
        series = series * r + c;
    }
    power * series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_is_good_to_1e_14() {
        for i in 0..200_000 {
            let x = -f64::from(i) * 3.5e-3;
            let wanted = x.max(-700.0).exp();
            assert!((exponential(x) - wanted).abs() <= 1e-14 * wanted, "{x}: {} {wanted}", exponential(x));
        }
        assert_eq!(exponential(0.0), 1.0);
        assert_eq!(exponential(f64::NEG_INFINITY), exponential(-700.0));
    }
}
