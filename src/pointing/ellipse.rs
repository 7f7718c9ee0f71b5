//! Error ellipses.

use nalgebra::Matrix2;

use crate::calibrate::uncertainty::semidefinite;
use crate::error::{Error, Result};

/// An ellipse about a Gaussian's mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipse {
    /// The longer half axis and the shorter, in the units whose squares the covariance has.
    pub semi_axes: [f64; 2],
    /// Of the longer axis from x towards y, radians, from -pi/2 to pi/2.
    pub angle: f64,
}

/// The ellipse that holds a Gaussian with a probability: chi-square with two degrees of freedom, whose
/// quantile is -2 ln(1 - p).
///
/// # Errors
/// `NotFinite`, `InvalidArgument`: no covariance, no probability.
pub fn ellipse(covariance: &Matrix2<f64>, probability: f64) -> Result<Ellipse> {
    semidefinite(covariance, "covariance")?;
    if !(probability > 0.0 && probability < 1.0) {
        return Err(Error::invalid("probability", format!("{probability} is not between 0 and 1")));
    }
    let (mean, half) = (0.5 * (covariance.m11 + covariance.m22), 0.5 * (covariance.m11 - covariance.m22));
    let radius = half.hypot(covariance.m12);
    let scale = -2.0 * (-probability).ln_1p();
    Ok(Ellipse {
        semi_axes: [(scale * (mean + radius)).sqrt(), (scale * (mean - radius).max(0.0)).sqrt()],
        angle: 0.5 * covariance.m12.atan2(half),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ellipse_has_the_axes_of_its_covariance() {
        // 95 %: 2.4477 standard deviations (tables).
        let e = ellipse(&Matrix2::new(9.0, 0.0, 0.0, 4.0), 0.95).unwrap();
        assert!((e.semi_axes[0] - 3.0 * 2.447_747).abs() < 1e-5 && (e.semi_axes[1] - 2.0 * 2.447_747).abs() < 1e-5);
        assert!(e.angle.abs() < 1e-15);
        let (s, c) = 0.7f64.sin_cos();
        let turn = Matrix2::new(c, -s, s, c);
        let turned = ellipse(&(turn * Matrix2::new(9.0, 0.0, 0.0, 4.0) * turn.transpose()), 0.95).unwrap();
        assert!((turned.angle - 0.7).abs() < 1e-12 && (turned.semi_axes[0] - e.semi_axes[0]).abs() < 1e-12);
        assert_eq!(ellipse(&Matrix2::zeros(), 0.5).unwrap().semi_axes, [0.0; 2]);
        assert!(ellipse(&Matrix2::new(1.0, 2.0, 2.0, 1.0), 0.5).is_err());
        assert!(ellipse(&Matrix2::new(-1.0, 0.0, 0.0, 1.0), 0.5).is_err());
        assert!(ellipse(&Matrix2::new(f64::NAN, 0.0, 0.0, 1.0), 0.5).is_err());
        for p in [0.0, 1.0, -0.5, f64::NAN] {
            assert!(ellipse(&Matrix2::identity(), p).is_err());
        }
    }
}
