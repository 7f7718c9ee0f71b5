//! The angle of many vectors: plain arithmetic that the compiler vectorises.

use crate::vectors::{greater, less};

/// atan2(y, x) to 3e-6 rad, 0 for the null vector: an odd polynomial of degree 11 up to 45 degrees.
#[inline(always)]
pub fn arctangent(y: f32, x: f32) -> f32 {
    use std::f32::consts::{FRAC_PI_2, PI};
    let (ax, ay) = (x.abs(), y.abs());
    let t = less(ax, ay) / greater(greater(ax, ay), f32::MIN_POSITIVE);
    let s = t * t;
    let p = -0.011_721_2 * s + 0.052_653_32;
    let p = p * s - 0.116_432_87;
    let p = p * s + 0.193_543_46;
    let p = p * s - 0.332_623_47;
    let p = (p * s + 0.999_977_26) * t;
    let p = if ay > ax { FRAC_PI_2 - p } else { p };
    let p = if x < 0.0 { PI - p } else { p };
    if y < 0.0 { -p } else { p }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arctangent_is_good_to_3e_6() {
        let worst = (0..100_000)
            .map(|i| {
                let a = (f64::from(i) / 50_000.0 - 1.0) * std::f64::consts::PI;
                let (y, x) = ((7.0 * a.sin()) as f32, (7.0 * a.cos()) as f32);
                (f64::from(arctangent(y, x)) - f64::from(y).atan2(f64::from(x))).abs()
            })
            .fold(0.0, f64::max);
        assert!(worst < 3e-6, "{worst}");
        assert_eq!(arctangent(0.0, 0.0), 0.0);
    }
}
