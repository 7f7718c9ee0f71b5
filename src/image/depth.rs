//! Depth maps: for every pixel of a camera the depth along its optical axis.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::view::MAX_SIDE;
use crate::error::{Error, Result};

/// Pixels on each side of one that its depth is taken from.
const RADIUS: isize = 2;
/// Least share of those pixels that must have a depth.
const MIN_KNOWN: f64 = 0.6;
/// Standard deviations that the depths around a pixel may scatter about a plane.
const MAX_SCATTER: f64 = 3.0;

/// How far a depth sensor's depths are off: inverse depths by `inverse_depth`, and depths by `depth`
/// besides.
///
/// Triangulating sensors (structured light, stereo) measure disparities, so that their inverse
/// depths are equally good everywhere; times of flight are equally good in depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthNoise {
    /// 1/m.
    pub inverse_depth: f64,
    /// Metres.
    pub depth: f64,
}

impl Default for DepthNoise {
    /// A Kinect of the first kind: Khoshelham and Oude Elberink, "Accuracy and resolution of Kinect
    /// depth data", Sensors 12 (2012), sigma_Z = 1.425e-3 Z^2.
    fn default() -> Self {
        Self { inverse_depth: 1.425e-3, depth: 1e-3 }
    }
}

impl DepthNoise {
    pub fn check(&self) -> Result<()> {
        for (name, value) in [("inverse_depth_sigma", self.inverse_depth), ("depth_sigma", self.depth)] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(Error::invalid(name, format!("{value} is no standard deviation")));
            }
        }
        if self.inverse_depth == 0.0 && self.depth == 0.0 {
            return Err(Error::invalid("depth_sigma", "no depth is without noise"));
        }
        Ok(())
    }

    /// Variance of an inverse depth, 1/m^2.
    pub fn variance(&self, rho: f64) -> f64 {
        self.inverse_depth.powi(2) + (self.depth * rho * rho).powi(2)
    }
}

/// An inverse depth with its variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InverseDepth {
    /// 1/m.
    pub rho: f64,
    /// 1/m^2.
    pub variance: f64,
}

/// Depths along the optical axis, metres.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthMap {
    width: usize,
    height: usize,
    /// Row by row; 0 where there is none.
    metres: Vec<f32>,
}

impl DepthMap {
    /// Depths row by row, without padding. What is not a positive number (0, negative, NaN, infinite)
    /// is a pixel without depth.
    pub fn new(width: u32, height: u32, mut metres: Vec<f32>) -> Result<Self> {
        if width == 0 || height == 0 || width > MAX_SIDE || height > MAX_SIDE {
            return Err(Error::invalid("depth", format!("{width} x {height} pixels")));
        }
        let [width, height] = [width as usize, height as usize];
        if metres.len() != width * height {
            let reason = format!("{} depths for {width} x {height} pixels", metres.len());
            return Err(Error::invalid("depth", reason));
        }
        metres.iter_mut().filter(|z| !(z.is_finite() && **z > 0.0)).for_each(|z| *z = 0.0);
        Ok(Self { width, height, metres })
    }

    pub fn width(&self) -> usize {
        self.width
    }

    pub fn height(&self) -> usize {
        self.height
    }

    /// Row by row; 0 where there is none.
    pub fn metres(&self) -> &[f32] {
        &self.metres
    }

    /// Pixels that have a depth.
    pub fn known(&self) -> usize {
        self.metres.iter().filter(|z| **z > 0.0).count()
    }

    /// Depth of a pixel; `None` outside the map and where there is none.
    pub fn at(&self, x: usize, y: usize) -> Option<f64> {
        if x >= self.width || y >= self.height {
            return None;
        }
        let z = f64::from(self.metres[y * self.width + x]);
        (z > 0.0).then_some(z)
    }

    /// Inverse depth at a place between pixels, from the plane through the depths around it: in the
    /// image the inverse depth of a plane is linear, whatever its slope. `None` where too few have a
    /// depth or where they do not lie in a plane: at the edges of things depth cameras mix what is
    /// before with what is behind.
    ///
    /// Neighbouring errors of depth cameras are alike, so that the mean of many is taken to be no
    /// better than one.
    pub fn inverse_depth(&self, at: &Vector2<f64>, noise: &DepthNoise) -> Option<InverseDepth> {
        if !(at.x > -0.5 && at.y > -0.5 && at.x < self.width as f64 - 0.5 && at.y < self.height as f64 - 0.5) {
            return None;
        }
        let [x, y] = [at.x.round() as isize, at.y.round() as isize];
        let around = |dy: isize| (-RADIUS..=RADIUS).map(move |dx| (x + dx, y + dy));
        let inside = |(x, y): (isize, isize)| Some((usize::try_from(x).ok()?, usize::try_from(y).ok()?));
        let window = (-RADIUS..=RADIUS).flat_map(around).filter_map(inside);
        let window = window.filter(|(x, y)| *x < self.width && *y < self.height);
        let (mut normal, mut right, mut square) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
        let (mut count, mut all) = (0.0, 0.0);
        for (x, y) in window {
            all += 1.0;
            let Some(z) = self.at(x, y) else { continue };
            let (row, rho) = (Vector3::new(x as f64 - at.x, y as f64 - at.y, 1.0), 1.0 / z);
            normal += row * row.transpose();
            right += row * rho;
            square += rho * rho;
            count += 1.0;
        }
        if count < MIN_KNOWN * all || count < 4.0 {
            return None;
        }
        let plane = normal.cholesky()?.solve(&right);
        let rho = plane.z;
        let scatter = ((square - right.dot(&plane)).max(0.0) / (count - 3.0)).sqrt();
        let variance = noise.variance(rho);
        if !(rho > 0.0 && scatter <= MAX_SCATTER * variance.sqrt()) {
            return None;
        }
        Some(InverseDepth { rho, variance: variance.max(scatter * scatter) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane through (0, 0, 2) seen by a camera of f = 100 px, with a step of 0.5 m at x = 32.
    fn map(step: bool) -> DepthMap {
        let metres = (0..48 * 64).map(|i| {
            let (x, y) = ((i % 64) as f32, (i / 64) as f32);
            let z = 1.0 / (0.5 + 0.001 * (x - 32.0) - 0.0005 * (y - 24.0));
            if step && x >= 32.0 { z + 0.5 } else { z }
        });
        DepthMap::new(64, 48, metres.collect()).unwrap()
    }

    #[test]
    fn a_slanted_plane_is_exact_between_pixels() {
        let map = map(false);
        for at in [Vector2::new(20.3, 10.8), Vector2::new(0.4, 0.2), Vector2::new(62.9, 46.7)] {
            let found = map.inverse_depth(&at, &DepthNoise::default()).unwrap();
            let rho = 0.5 + 0.001 * (at.x - 32.0) - 0.0005 * (at.y - 24.0);
            assert!((found.rho - rho).abs() < 1e-6, "{at} {found:?} {rho}");
        }
    }

    #[test]
    fn edges_holes_and_the_outside_have_no_depth() {
        let noise = DepthNoise::default();
        let mut map = map(true);
        assert!(map.inverse_depth(&Vector2::new(31.5, 20.0), &noise).is_none());
        assert!(map.inverse_depth(&Vector2::new(33.0, 20.0), &noise).is_none());
        assert!(map.inverse_depth(&Vector2::new(36.0, 20.0), &noise).is_some());
        for at in [[-0.6, 3.0], [63.6, 3.0], [3.0, 48.0], [f64::NAN, 3.0], [1e300, 3.0]] {
            assert!(map.inverse_depth(&at.into(), &noise).is_none(), "{at:?}");
        }
        for i in 0..11 {
            map.metres[20 * 64 + 8 + i % 5 + 64 * (i / 5)] = 0.0;
        }
        assert!(map.inverse_depth(&Vector2::new(10.0, 21.0), &noise).is_none());
    }

    #[test]
    fn what_is_no_depth_is_unknown() {
        let map = DepthMap::new(3, 2, vec![1.0, f32::NAN, -1.0, f32::INFINITY, 0.0, 2.5]).unwrap();
        assert_eq!(map.known(), 2);
        assert_eq!((map.at(2, 1), map.at(1, 0), map.at(3, 0)), (Some(2.5), None, None));
        assert!(DepthMap::new(3, 2, vec![1.0; 5]).is_err());
        assert!(DepthMap::new(0, 2, vec![]).is_err());
        assert!(DepthNoise { inverse_depth: f64::NAN, depth: 0.0 }.check().is_err());
        assert!(DepthNoise { inverse_depth: 0.0, depth: 0.0 }.check().is_err());
    }
}
