//! How probable it is that a target is wholly in the picture, and the tightest zoom at which it is
//! probable enough.

use nalgebra::{Matrix2, Vector2};

use crate::error::Result;
use crate::geometry::ZoomCurve;
use crate::geometry::chi_square::upper_tail;

/// Zooms that are looked at before the interval with the tightest is halved, and halvings of it.
const STEPS: usize = 24;
const HALVINGS: usize = 20;
/// Intervals of the integral over x (Simpson): good to 1e-7 and better.
const INTERVALS: usize = 256;
/// Standard deviations beyond which nothing is.
const FAR: f64 = 8.5;

/// Probability that a Gaussian about `mean` is within `half` of the origin in both coordinates.
pub(super) fn in_rectangle(mean: &Vector2<f64>, covariance: &Matrix2<f64>, half: &Vector2<f64>) -> f64 {
    if !(half.x > 0.0 && half.y > 0.0) {
        return 0.0;
    }
    let (sx, sy) = (covariance.m11.max(0.0).sqrt(), covariance.m22.max(0.0).sqrt());
    // Far narrower than a pixel: a number, not a distribution.
    let (sx, sy) = (sx.max(1e-9), sy.max(1e-9));
    let correlation = (covariance.m12 / (sx * sy)).clamp(-1.0, 1.0);
    let rest = sy * (1.0 - correlation * correlation).max(0.0).sqrt().max(1e-6);
    let low = ((-half.x - mean.x) / sx).max(-FAR);
    let high = ((half.x - mean.x) / sx).min(FAR);
    if low >= high {
        return 0.0;
    }
    // x = sx z; given z, y is Gaussian about mean.y + correlation sy z.
    let step = (high - low) / INTERVALS as f64;
    let density = |i: usize| {
        let z = low + step * i as f64;
        let y = mean.y + correlation * sy * z;
        let strip = normal_cdf((half.y - y) / rest) - normal_cdf((-half.y - y) / rest);
        strip * (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt()
    };
    let weight = |i: usize| if i == 0 || i == INTERVALS { 1.0 } else { [2.0, 4.0][i % 2] };
    let sum: f64 = (0..=INTERVALS).map(|i| weight(i) * density(i)).sum();
    (sum * step / 3.0).clamp(0.0, 1.0)
}

fn normal_cdf(x: f64) -> f64 {
    let tail = 0.5 * upper_tail(x * x, 1.0);
    if x > 0.0 { 1.0 - tail } else { tail }
}

/// The zoom with the longest focal length at which `holds` answers at least `probability`, with that
/// answer and what else it said; the widest zoom where none does.
pub(super) fn tightest<T>(
    curve: &ZoomCurve,
    probability: f64,
    mut holds: impl FnMut(f64) -> Result<(f64, T)>,
) -> Result<(f64, f64, T)> {
    let [low, high] = curve.range();
    let focal = |zoom: f64| curve.at(zoom).map(|z| z.model.intrinsics.fx);
    let (wide, tele) = if focal(low)? <= focal(high)? { (low, high) } else { (high, low) };
    let mut too_tight = None;
    let mut best = None;
    for i in 0..=STEPS {
        let zoom = tele + (wide - tele) * i as f64 / STEPS as f64;
        let (p, found) = holds(zoom)?;
        best = Some((zoom, p, found));
        if p >= probability {
            break;
        }
        too_tight = Some(zoom);
        if wide == tele {
            break;
        }
    }
    let (mut zoom, mut p, mut found) =
        best.ok_or_else(|| crate::error::Error::Internal { reason: "no zoom was looked at".into() })?;
    if let Some(mut tight) = too_tight.filter(|_| p >= probability) {
        for _ in 0..HALVINGS {
            let middle = 0.5 * (tight + zoom);
            let (q, there) = holds(middle)?;
            if q >= probability { (zoom, p, found) = (middle, q, there) } else { tight = middle }
        }
    }
    Ok((zoom, p, found))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_probability_of_a_rectangle_is_that_of_closed_forms_and_of_counting() {
        // Independent coordinates: a product of two intervals (tables: 0.682689, 0.954500).
        let c = Matrix2::new(4.0, 0.0, 0.0, 9.0);
        let p = in_rectangle(&Vector2::zeros(), &c, &Vector2::new(2.0, 6.0));
        assert!((p - 0.682_689_492 * 0.954_499_736).abs() < 1e-7, "{p}");
        // Half of it beyond an edge that is far from the others.
        let p = in_rectangle(&Vector2::new(100.0, 0.0), &c, &Vector2::new(100.0, 1e3));
        assert!((p - 0.5).abs() < 1e-7, "{p}");
        // Entirely correlated: |x| < 1 and |2 x| < 1 is |x| < 0.5 (tables: 0.382925).
        let c = Matrix2::new(1.0, 2.0, 2.0, 4.0);
        let p = in_rectangle(&Vector2::zeros(), &c, &Vector2::new(1.0, 1.0));
        assert!((p - 0.382_924_923).abs() < 1e-4, "{p}");
        // A quadrant about the mean: 1/4 + asin(r) / (2 pi) (Sheppard).
        let c = Matrix2::new(1.0, 0.6, 0.6, 1.0);
        let p = in_rectangle(&Vector2::new(-50.0, -50.0), &c, &Vector2::new(50.0, 50.0));
        assert!((p - 0.25 - 0.6f64.asin() / std::f64::consts::TAU).abs() < 1e-6, "{p}");
        // What is exact is inside or it is not.
        assert_eq!(in_rectangle(&Vector2::new(3.0, 0.0), &Matrix2::zeros(), &Vector2::new(4.0, 1.0)).round(), 1.0);
        assert_eq!(in_rectangle(&Vector2::new(5.0, 0.0), &Matrix2::zeros(), &Vector2::new(4.0, 1.0)), 0.0);
        assert_eq!(in_rectangle(&Vector2::zeros(), &c, &Vector2::new(-1.0, 1.0)), 0.0);
    }
}
