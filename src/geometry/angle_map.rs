//! From a head's own pan and tilt numbers to angles and back.
//!
//! Each axis is a monotone cubic through nodes (number, angle): a straight line where the head is
//! linear, and any smooth gearing or linkage where it is not. Nodes carry a joint covariance, and the
//! curve between them the variance of an integrated Wiener process, whose mean is the cubic smoothing
//! spline (G. Wahba, Improper priors, spline smoothing and the problem of guarding against model errors
//! in regression, J. R. Statist. Soc. B 40, 1978): between two known nodes, and slopes, h apart it is
//! roughness x t^3 (h - t)^3 / (3 h^3).

use nalgebra::DMatrix;

use super::spline::{MonotoneSpline, monotone};
use super::zoom_curve::check_covariance;
use crate::error::{Error, Result};

/// Most nodes of an axis.
pub const MAX_NODES: usize = 64;

/// One axis.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisMap {
    /// Device's number and angle (radians); numbers ascend, angles ascend or descend.
    nodes: Vec<[f64; 2]>,
    covariance: DMatrix<f64>,
    roughness: f64,
    spline: MonotoneSpline,
}

impl AxisMap {
    /// `nodes`: (device's number, angle in radians), 2 to 64, the numbers ascending, the angles strictly
    /// monotone. `covariance`: of the nodes' angles, rad^2. `roughness`: rad^2 per cubed device's unit,
    /// 0 for a curve that is exact between its nodes.
    ///
    /// # Errors
    /// `TooFewPoints`; `NotFinite`; `InvalidArgument` for what is not so.
    pub fn new(nodes: Vec<[f64; 2]>, covariance: DMatrix<f64>, roughness: f64) -> Result<Self> {
        if nodes.len() < 2 {
            return Err(Error::TooFewPoints { given: nodes.len(), needed: 2 });
        }
        if nodes.len() > MAX_NODES {
            return Err(Error::invalid("nodes", format!("{}; at most {MAX_NODES} are possible", nodes.len())));
        }
        if let Some(index) = nodes.iter().flatten().position(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name: "nodes", index: index / 2 });
        }
        if let Some(i) = nodes.windows(2).position(|w| w[1][0] <= w[0][0]) {
            return Err(Error::invalid("nodes", format!("the number of node {} does not ascend", i + 1)));
        }
        let up = nodes[1][1] > nodes[0][1];
        if let Some(i) = nodes.windows(2).position(|w| w[1][1] == w[0][1] || (w[1][1] > w[0][1]) != up) {
            return Err(Error::invalid("nodes", format!("the angle turns back at node {}", i + 1)));
        }
        check_covariance(&covariance, nodes.len())?;
        if !(roughness >= 0.0 && roughness.is_finite()) {
            return Err(Error::invalid("roughness", format!("{roughness} is no variance")));
        }
        let (places, values) = nodes.iter().map(|[raw, angle]| (*raw, *angle)).unzip();
        Ok(Self { nodes, covariance, roughness, spline: MonotoneSpline::new(places, values) })
    }

    /// (Device's number, angle in radians).
    pub fn nodes(&self) -> &[[f64; 2]] {
        &self.nodes
    }

    /// Of the nodes' angles, rad^2.
    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }

    pub fn roughness(&self) -> f64 {
        self.roughness
    }

    /// Least and greatest device's number that it answers for.
    pub fn raw_range(&self) -> [f64; 2] {
        self.ends(0)
    }

    /// Least and greatest angle that it answers for, radians.
    pub fn angle_range(&self) -> [f64; 2] {
        let [a, b] = self.ends(1);
        [a.min(b), a.max(b)]
    }

    /// Angle of a device's number.
    ///
    /// # Errors
    /// `NotFinite`; `Unreachable` outside the range.
    pub fn angle(&self, raw: f64) -> Result<f64> {
        inside("number", raw, self.raw_range())?;
        Ok(self.spline.at(raw))
    }

    /// Device's number of an angle: the exact inverse of [`angle`](Self::angle).
    ///
    /// # Errors
    /// As there.
    pub fn raw(&self, angle: f64) -> Result<f64> {
        inside("angle", angle, self.angle_range())?;
        Ok(self.spline.place(angle))
    }

    /// Radians per device's unit; negative for a device that counts the other way.
    ///
    /// # Errors
    /// As [`angle`](Self::angle).
    pub fn slope(&self, raw: f64) -> Result<f64> {
        inside("number", raw, self.raw_range())?;
        Ok(self.spline.slope(raw))
    }

    /// Greatest radians per device's unit, either sign, over the range; sampled within every interval.
    pub fn steepest(&self) -> f64 {
        const SAMPLES: usize = 8;
        let spans = self
            .nodes
            .windows(2)
            .flat_map(|w| (0..=SAMPLES).map(move |k| w[0][0] + (w[1][0] - w[0][0]) * k as f64 / SAMPLES as f64));
        spans.map(|raw| self.spline.slope(raw).abs()).fold(0.0, f64::max)
    }

    /// Standard deviation of the angle of a device's number, radians, as far as the map goes: what the
    /// head does not repeat comes on top.
    ///
    /// # Errors
    /// As [`angle`](Self::angle).
    pub fn sigma(&self, raw: f64) -> Result<f64> {
        let weights = self.weights(raw)?;
        Ok((self.spread(&weights) + self.between(raw)).sqrt())
    }

    /// Standard deviation of the angle from one device's number to another, radians. It is free of the
    /// zero's.
    ///
    /// # Errors
    /// As [`angle`](Self::angle).
    pub fn sigma_between(&self, from: f64, to: f64) -> Result<f64> {
        let (a, b) = (self.weights(from)?, self.weights(to)?);
        let difference: Vec<f64> = a.iter().zip(&b).map(|(a, b)| b - a).collect();
        Ok((self.spread(&difference) + self.between(from) + self.between(to)).sqrt())
    }

    fn ends(&self, k: usize) -> [f64; 2] {
        // There are two nodes at least.
        [self.nodes.first(), self.nodes.last()].map(|n| n.map_or(f64::NAN, |n| n[k]))
    }

    /// Derivatives of the angle by the nodes' angles.
    fn weights(&self, raw: f64) -> Result<Vec<f64>> {
        inside("number", raw, self.raw_range())?;
        let (places, values): (Vec<f64>, Vec<f64>) = self.nodes.iter().map(|[raw, angle]| (*raw, *angle)).unzip();
        Ok(monotone(&places, &values, raw).1)
    }

    fn spread(&self, weights: &[f64]) -> f64 {
        let pairs = (0..weights.len()).flat_map(|i| (0..weights.len()).map(move |j| (i, j)));
        pairs.map(|(i, j)| weights[i] * weights[j] * self.covariance[(i, j)]).sum::<f64>().max(0.0)
    }

    /// Variance of the curve between its nodes.
    fn between(&self, raw: f64) -> f64 {
        let right = self.nodes.partition_point(|n| n[0] <= raw).clamp(1, self.nodes.len() - 1);
        let (t, h) = (raw - self.nodes[right - 1][0], self.nodes[right][0] - self.nodes[right - 1][0]);
        self.roughness * (t * (h - t)).max(0.0).powi(3) / (3.0 * h.powi(3))
    }
}

fn inside(what: &str, value: f64, [low, high]: [f64; 2]) -> Result<()> {
    if !value.is_finite() {
        return Err(Error::NotFinite { name: "pan or tilt", index: 0 });
    }
    if value < low || value > high {
        let reason =
            format!("{what} {value:.6} is outside the {low:.6} to {high:.6} that the angle map was learned for");
        return Err(Error::Unreachable { reason });
    }
    Ok(())
}

/// How camera and axes deviate from the model R_y(pan) R_x(tilt), radians. With them the rotation from
/// the camera to the world is R_y(pan) R_z(trunnion) R_x(tilt) R_y(collimation) R_z(roll), in the
/// surveyor's terms for a theodolite.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Mounting {
    /// The optical axis is not perpendicular to the tilt axis.
    pub collimation: f64,
    /// The camera is turned about its optical axis.
    pub roll: f64,
    /// The tilt axis is not perpendicular to the pan axis.
    pub trunnion: f64,
}

/// Both axes of a head. Positive pan turns the camera's view right, positive tilt up. Tilt is 0 where the
/// optical axis is perpendicular to the pan axis; where pan is 0 is a convention.
#[derive(Debug, Clone, PartialEq)]
pub struct AngleMap {
    pub pan: AxisMap,
    pub tilt: AxisMap,
    pub mounting: Mounting,
    /// Standard deviations of collimation, roll and trunnion, radians.
    pub mounting_sigma: [f64; 3],
}

impl AngleMap {
    /// # Errors
    /// `NotFinite`, `InvalidArgument`: a mounting turned by 90 degrees or more, negative deviations.
    pub fn new(pan: AxisMap, tilt: AxisMap, mounting: Mounting, mounting_sigma: [f64; 3]) -> Result<Self> {
        let turns = [mounting.collimation, mounting.roll, mounting.trunnion];
        if let Some(index) = turns.iter().chain(&mounting_sigma).position(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name: "mounting", index });
        }
        if turns.iter().any(|v| v.abs() >= std::f64::consts::FRAC_PI_2) {
            return Err(Error::invalid("mounting", format!("{turns:?} rad: a quarter of a turn or more")));
        }
        if mounting_sigma.iter().any(|v| *v < 0.0) {
            return Err(Error::invalid("mounting_sigma", format!("{mounting_sigma:?} are no standard deviations")));
        }
        Ok(Self { pan, tilt, mounting, mounting_sigma })
    }

    /// Pan and tilt in radians of the device's numbers.
    ///
    /// # Errors
    /// As [`AxisMap::angle`].
    pub fn angles(&self, raw: [f64; 2]) -> Result<[f64; 2]> {
        Ok([self.pan.angle(raw[0])?, self.tilt.angle(raw[1])?])
    }

    /// The device's numbers of pan and tilt.
    ///
    /// # Errors
    /// As [`AxisMap::angle`].
    pub fn raw(&self, angles: [f64; 2]) -> Result<[f64; 2]> {
        Ok([self.pan.raw(angles[0])?, self.tilt.raw(angles[1])?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(nodes: &[[f64; 2]]) -> Result<AxisMap> {
        AxisMap::new(nodes.to_vec(), DMatrix::identity(nodes.len(), nodes.len()) * 1e-8, 0.0)
    }

    #[test]
    fn a_line_is_a_line_and_a_curve_has_its_inverse() {
        let line = axis(&[[-1.0, 1.5], [0.2, 0.06], [1.0, -0.9]]).unwrap();
        for k in 0..=100 {
            let raw = -1.0 + 0.02 * f64::from(k);
            assert!((line.angle(raw).unwrap() - (0.3 - 1.2 * raw)).abs() < 1e-14);
            assert!((line.slope(raw).unwrap() + 1.2).abs() < 1e-12);
            assert!((line.raw(line.angle(raw).unwrap()).unwrap() - raw).abs() < 1e-14);
        }
        assert!((line.steepest() - 1.2).abs() < 1e-12);
        assert_eq!((line.raw_range(), line.angle_range()), ([-1.0, 1.0], [-0.9, 1.5]));

        let f = |raw: f64| (raw / 3000.0).sin() + raw / 2000.0;
        let nodes: Vec<[f64; 2]> = (0..=20).map(|i| -2400.0 + 240.0 * f64::from(i)).map(|r| [r, f(r)]).collect();
        let curve = axis(&nodes).unwrap();
        for k in 0..=960 {
            let raw = -2400.0 + 5.0 * f64::from(k);
            let angle = curve.angle(raw).unwrap();
            // h^3 f''' (1/3)(4/27), at the ends, where a parabola gives the slope.
            assert!((angle - f(raw)).abs() < 2.6e-5, "{raw}");
            assert!((curve.raw(angle).unwrap() - raw).abs() < 1e-9, "{raw}");
        }
    }

    #[test]
    fn sigmas_are_those_of_the_nodes_and_of_the_curve_between() {
        let nodes = vec![[0.0, 0.0], [1.0, 0.5], [2.0, 1.0]];
        // A common error: the same at every number, and none between two.
        let common = AxisMap::new(nodes.clone(), DMatrix::from_element(3, 3, 4e-6), 0.0).unwrap();
        for raw in [0.0, 0.3, 1.0, 1.9] {
            assert!((common.sigma(raw).unwrap() - 2e-3).abs() < 1e-8);
            assert!(common.sigma_between(0.2, raw).unwrap() < 1e-8);
        }
        let rough = AxisMap::new(nodes, DMatrix::zeros(3, 3), 1.92e-4).unwrap();
        // roughness h^3 / 192 in the middle.
        assert!((rough.sigma(1.5).unwrap() - 1e-3).abs() < 1e-12 && rough.sigma(1.0).unwrap() == 0.0);
    }

    #[test]
    fn what_is_no_map_is_refused() {
        for nodes in [
            &[[0.0, 0.0]][..],
            &[[0.0, 0.0], [0.0, 1.0]],
            &[[1.0, 0.0], [0.0, 1.0]],
            &[[0.0, 0.0], [1.0, 0.0]],
            &[[0.0, 0.0], [1.0, 1.0], [2.0, 0.5]],
            &[[0.0, 0.0], [1.0, f64::NAN]],
            &[[f64::INFINITY, 0.0], [1.0, 1.0]],
        ] {
            assert!(axis(nodes).is_err(), "{nodes:?}");
        }
        let many: Vec<[f64; 2]> = (0..=MAX_NODES).map(|i| [i as f64, i as f64]).collect();
        assert!(axis(&many).is_err());
        let nodes = vec![[0.0, 0.0], [1.0, 1.0]];
        for (covariance, roughness) in [
            (DMatrix::identity(3, 3), 0.0),
            (DMatrix::from_row_slice(2, 2, &[1.0, 0.5, 0.0, 1.0]), 0.0),
            (DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0]), 0.0),
            (DMatrix::identity(2, 2), -1.0),
            (DMatrix::identity(2, 2), f64::NAN),
        ] {
            assert!(AxisMap::new(nodes.clone(), covariance, roughness).is_err());
        }
        let good = axis(&nodes).unwrap();
        for outside in [-1e-9, 1.0 + 1e-9, f64::NAN, f64::NEG_INFINITY] {
            assert!(good.angle(outside).is_err() && good.raw(outside).is_err() && good.sigma(outside).is_err());
            assert!(good.slope(outside).is_err() && good.sigma_between(0.5, outside).is_err());
        }
        let map = |mounting, sigma| AngleMap::new(good.clone(), good.clone(), mounting, sigma);
        assert!(map(Mounting::default(), [0.0; 3]).is_ok());
        assert!(map(Mounting { roll: 1.6, ..Mounting::default() }, [0.0; 3]).is_err());
        assert!(map(Mounting { trunnion: f64::NAN, ..Mounting::default() }, [0.0; 3]).is_err());
        assert!(map(Mounting::default(), [0.0, -1.0, 0.0]).is_err());
        assert!(map(Mounting::default(), [0.0, f64::NAN, 0.0]).is_err());
    }
}
