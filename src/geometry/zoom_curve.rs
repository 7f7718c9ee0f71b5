//! Lens and laser line of a rig at any zoom between those that were calibrated.
//!
//! Interpolated are, over the device's zoom number: the logarithms of fx and fy by a monotone spline,
//! and by one of parabolas what is smooth and well determined at every zoom: skew / fx, the principal
//! point, the distortion in units of the image (coefficients times powers of half the diagonal / fx),
//! and the laser line's image, spot = b + A rho: its vanishing point b = c + f v and its scale
//! A = f (x0, y0) by (x0, y0) (maths.md section 6). The slope v itself would not do: it is known much
//! better together with c than alone, and between two zooms the two errors would not cancel.
//!
//! Covariances are those of the calibrated positions, carried through the spline, and the spline's own
//! error: each inner position is predicted from the others, and what its prediction is off by, beyond
//! its noise, grows as the error of an interpolation does, with (x - a)(b - x) (a and b the positions
//! about x). A prediction may be right by chance, so that no less is taken than if the curvature changed
//! by a third of itself between neighbours. Of two positions nothing shows how the curve bends: the error
//! is then taken as even within the rectangle that a monotone curve stays in.

use nalgebra::{DMatrix, DVector, SMatrix, Vector2};

use super::rig_model::{AxisOffsets, Encoders, LaserLine, RigModel};
use super::spline::{monotone, weights};
use super::{Distortion, Intrinsics};
use crate::error::{Error, Result};

/// Part of the curvature that is taken for the spline's error where the positions predict each other well.
const CHANGE_OF_CURVATURE: f64 = 1.0 / 3.0;
/// Most positions of a curve.
pub const MAX_NODES: usize = 64;

/// What was calibrated at one zoom position.
#[derive(Debug, Clone, PartialEq)]
pub struct ZoomNode {
    /// The device's own number of the position, in any unit that grows or falls with the focal length.
    pub zoom: f64,
    pub intrinsics: Intrinsics,
    pub distortion: Distortion,
    /// In the camera's frame at this position.
    pub laser: LaserLine,
}

impl ZoomNode {
    /// fx fy skew cx cy, the distortion's coefficients, x0 y0 vx vy.
    pub fn parameters(&self) -> Vec<f64> {
        let l = &self.laser;
        let k = self.intrinsics.to_array();
        k.iter().chain(self.distortion.coefficients()).chain(&[l.x0, l.y0, l.vx, l.vy]).copied().collect()
    }

    /// Takes parameters in the order of [`parameters`](Self::parameters), as many.
    pub(crate) fn set_parameters(&mut self, p: &[f64]) {
        let (lens, line) = p.split_at(p.len() - 4);
        self.intrinsics = Intrinsics::from_array(std::array::from_fn(|i| lens[i]));
        self.distortion.coefficients_mut().copy_from_slice(&lens[5..]);
        self.laser = LaserLine { x0: line[0], y0: line[1], vx: line[2], vy: line[3] };
    }

    fn model(&self, size: [u32; 2]) -> RigModel {
        RigModel {
            width: size[0],
            height: size[1],
            intrinsics: self.intrinsics,
            distortion: self.distortion,
            laser: self.laser,
            offsets: AxisOffsets::default(),
            encoders: Encoders::default(),
        }
    }
}

/// A rig's lens and laser line at some zoom.
#[derive(Debug, Clone)]
pub struct ZoomedRig {
    /// Axes through the camera's centre, true encoders.
    pub model: RigModel,
    /// Of fx fy skew cx cy, the distortion's coefficients, x0 y0 vx vy.
    pub covariance: DMatrix<f64>,
}

impl ZoomedRig {
    /// Of x0 y0 vx vy, ln of the common scale of fx and fy, cx, cy: what depths depend on.
    pub fn rig_covariance(&self) -> SMatrix<f64, 7, 7> {
        rig_covariance(&self.model.intrinsics, &self.covariance)
    }
}

/// From the covariance of fx fy skew cx cy, any coefficients and x0 y0 vx vy to that of x0 y0 vx vy, ln
/// of the common scale of fx and fy, cx, cy.
pub(crate) fn rig_covariance(k: &Intrinsics, covariance: &DMatrix<f64>) -> SMatrix<f64, 7, 7> {
    let first = covariance.nrows() - 4;
    let mut by = DMatrix::zeros(7, covariance.nrows());
    (0..4).for_each(|i| by[(i, first + i)] = 1.0);
    (by[(4, 0)], by[(4, 1)]) = (0.5 / k.fx, 0.5 / k.fy);
    (by[(5, 3)], by[(6, 4)]) = (1.0, 1.0);
    let c = &by * covariance * by.transpose();
    SMatrix::from_fn(|i, j| 0.5 * (c[(i, j)] + c[(j, i)]))
}

/// A rig's lens and laser line over zoom.
#[derive(Debug, Clone, PartialEq)]
pub struct ZoomCurve {
    size: [u32; 2],
    nodes: Vec<ZoomNode>,
    covariance: DMatrix<f64>,
    /// What is interpolated, a row for each node, and its covariance.
    smooth: DMatrix<f64>,
    smooth_covariance: DMatrix<f64>,
    /// Of each smooth quantity: the spline's error over (x - a)(b - x), at every node.
    bends: DMatrix<f64>,
}

impl ZoomCurve {
    /// `covariance`: joint, of the nodes' parameters, node after node.
    ///
    /// # Errors
    /// `TooFewPoints` (no node); `InvalidArgument`: more than 64 nodes, zooms that do not ascend, a focal
    /// length that does not grow (or fall) from node to node, nodes of several lens models, models that
    /// are not valid, a covariance of another size or not positive semidefinite; `NotFinite`.
    pub fn new(size: [u32; 2], nodes: Vec<ZoomNode>, covariance: DMatrix<f64>) -> Result<Self> {
        check_nodes(size, &nodes)?;
        let n = nodes[0].parameters().len();
        check_covariance(&covariance, n * nodes.len())?;
        let scale = Scale::new(size, &nodes[0].distortion);
        let mut by = DMatrix::zeros(n * nodes.len(), n * nodes.len());
        let mut smooth = DMatrix::zeros(nodes.len(), n);
        for (i, node) in nodes.iter().enumerate() {
            smooth.row_mut(i).copy_from_slice(&scale.smooth(node));
            by.view_mut((i * n, i * n), (n, n)).copy_from(&scale.jacobian(node));
        }
        let smooth_covariance = &by * &covariance * by.transpose();
        let mut curve =
            Self { size, bends: DMatrix::zeros(nodes.len(), n), nodes, covariance, smooth, smooth_covariance };
        curve.bends = curve.bends();
        Ok(curve)
    }

    /// Image size.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    pub fn nodes(&self) -> &[ZoomNode] {
        &self.nodes
    }

    /// Joint, of the nodes' parameters, node after node.
    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }

    /// The least and the greatest zoom that it answers for.
    pub fn range(&self) -> [f64; 2] {
        let zoom = |n: Option<&ZoomNode>| n.map_or(f64::NAN, |n| n.zoom);
        [zoom(self.nodes.first()), zoom(self.nodes.last())]
    }

    /// Lens and laser line at a zoom, with their covariance. Of one node alone: at its zoom only.
    ///
    /// # Errors
    /// `NotFinite`; `InvalidArgument` (outside the range: a spline says nothing there); `LensNotMonotone`.
    pub fn at(&self, zoom: f64) -> Result<ZoomedRig> {
        if !zoom.is_finite() {
            return Err(Error::NotFinite { name: "zoom", index: 0 });
        }
        let [low, high] = self.range();
        if zoom < low || zoom > high {
            return Err(Error::invalid("zoom", format!("{zoom} is outside the calibrated range {low} to {high}")));
        }
        let (places, n) = (self.places(), self.smooth.ncols());
        let mut by = DMatrix::zeros(n, n * places.len());
        let mut smooth = vec![0.0; n];
        for (j, value) in smooth.iter_mut().enumerate() {
            let (at, weights) = interpolated(&places, &self.values(j), j, zoom);
            *value = at;
            weights.iter().enumerate().for_each(|(i, w)| by[(j, i * n + j)] = *w);
        }
        let mut covariance = &by * &self.smooth_covariance * by.transpose();
        for j in 0..n {
            covariance[(j, j)] += self.spline_error(&places, j, zoom).powi(2);
        }
        let scale = Scale::new(self.size, &self.nodes[0].distortion);
        let mut node = ZoomNode { zoom, ..self.nodes[0].clone() };
        node.set_parameters(&scale.parameters(&smooth));
        let singular = || Error::Internal { reason: "a zoom's parameters have no inverse".into() };
        let back = scale.jacobian(&node).try_inverse().ok_or_else(singular)?;
        let c = &back * covariance * back.transpose();
        let covariance = DMatrix::from_fn(n, n, |i, j| 0.5 * (c[(i, j)] + c[(j, i)]));
        let model = node.model(self.size);
        model.validate()?;
        model.head_camera(0.0, 0.0).check_lens()?;
        Ok(ZoomedRig { model, covariance })
    }

    fn places(&self) -> Vec<f64> {
        self.nodes.iter().map(|n| n.zoom).collect()
    }

    fn values(&self, quantity: usize) -> Vec<f64> {
        self.smooth.column(quantity).iter().copied().collect()
    }

    /// Standard deviation of the spline's own error.
    fn spline_error(&self, places: &[f64], quantity: usize, zoom: f64) -> f64 {
        let right = places.partition_point(|p| *p <= zoom);
        if right == 0 || right == places.len() {
            return 0.0;
        }
        let bend = self.bends[(right - 1, quantity)].max(self.bends[(right, quantity)]);
        bend * (zoom - places[right - 1]) * (places[right] - zoom)
    }

    /// The size of a weighted sum of a quantity's values beyond what their noise makes of it.
    fn excess(&self, weights: &[f64], quantity: usize) -> f64 {
        let (nodes, n) = (weights.len(), self.smooth.ncols());
        let value: f64 = (0..nodes).map(|a| weights[a] * self.smooth[(a, quantity)]).sum();
        let covariance = |a: usize, b: usize| self.smooth_covariance[(a * n + quantity, b * n + quantity)];
        let variance: f64 =
            (0..nodes).map(|a| (0..nodes).map(|b| weights[a] * weights[b] * covariance(a, b)).sum::<f64>()).sum();
        (value * value - variance).max(0.0).sqrt()
    }

    /// How much each quantity bends at each node, by leaving the node out; no less than it does on the
    /// whole, for one prediction may be right by chance.
    fn bends(&self) -> DMatrix<f64> {
        let (places, n) = (self.places(), self.smooth.ncols());
        let mut bends = DMatrix::zeros(places.len(), n);
        for j in 0..n {
            let values = self.values(j);
            if let ([a, b], [u, v]) = (places.as_slice(), values.as_slice()) {
                bends.column_mut(j).fill(2.0 / 3f64.sqrt() * (v - u).abs() / ((b - a) * (b - a)));
                continue;
            }
            let inner = 1..places.len().saturating_sub(1);
            let (count, mut sum) = (inner.len(), 0.0);
            for i in inner {
                let without = |all: &[f64]| -> Vec<f64> { [&all[..i], &all[i + 1..]].concat() };
                let (_, mut weights) = interpolated(&without(&places), &without(&values), j, places[i]);
                weights.insert(i, -1.0);
                let span = (places[i] - places[i - 1]) * (places[i + 1] - places[i]);
                let third = CHANGE_OF_CURVATURE * self.excess(&divided_difference(&places, i), j);
                bends[(i, j)] = (self.excess(&weights, j) / span).max(third);
                sum += bends[(i, j)].powi(2);
            }
            if count > 0 {
                let overall = (sum / count as f64).sqrt();
                bends.column_mut(j).iter_mut().for_each(|b| *b = b.max(overall));
            }
        }
        bends
    }
}

/// Half the second derivative at an inner place, as weights of the values.
fn divided_difference(places: &[f64], i: usize) -> Vec<f64> {
    let mut weights = vec![0.0; places.len()];
    let about = [i - 1, i, i + 1];
    for a in about {
        let product: f64 = about.iter().filter(|b| **b != a).map(|b| places[a] - places[*b]).product();
        weights[a] = 1.0 / product;
    }
    weights
}

/// Value and weights of one smooth quantity; the first two are ln fx and ln fy.
fn interpolated(places: &[f64], values: &[f64], quantity: usize, zoom: f64) -> (f64, Vec<f64>) {
    if quantity < 2 {
        return monotone(places, values, zoom);
    }
    let weights = weights(places, zoom);
    (weights.iter().zip(values).map(|(w, v)| w * v).sum(), weights)
}

/// From parameters to what is smooth, and back.
struct Scale {
    /// Half the image's diagonal, px.
    half: f64,
    /// Powers of the angle that the coefficients go with.
    powers: &'static [i32],
}

impl Scale {
    fn new(size: [u32; 2], distortion: &Distortion) -> Self {
        let powers: &'static [i32] = match distortion {
            Distortion::None => &[],
            Distortion::BrownConrady(_) => &[2, 4, 1, 1, 6],
            Distortion::Division(_) => &[2],
            Distortion::Fisheye(_) => &[2, 4, 6, 8],
        };
        Self { half: 0.5 * f64::from(size[0]).hypot(f64::from(size[1])), powers }
    }

    /// ln fx, ln fy, skew / fx, cx, cy, the coefficients at the image's rim, b, x0, y0.
    fn smooth(&self, node: &ZoomNode) -> Vec<f64> {
        let (k, l) = (&node.intrinsics, &node.laser);
        let coefficients =
            node.distortion.coefficients().iter().zip(self.powers).map(|(c, p)| c * (self.half / k.fx).powi(*p));
        let b = k.to_pixel(&Vector2::new(l.vx, l.vy));
        let lens = [k.fx.ln(), k.fy.ln(), k.skew / k.fx, k.cx, k.cy];
        lens.into_iter().chain(coefficients).chain([b.x, b.y, l.x0, l.y0]).collect()
    }

    fn parameters(&self, smooth: &[f64]) -> Vec<f64> {
        let (fx, fy) = (smooth[0].exp(), smooth[1].exp());
        let k = Intrinsics { fx, fy, skew: smooth[2] * fx, cx: smooth[3], cy: smooth[4] };
        let (lens, line) = smooth.split_at(smooth.len() - 4);
        let coefficients = lens[5..].iter().zip(self.powers).map(|(c, p)| c * (fx / self.half).powi(*p));
        let v = k.to_normalised(&Vector2::new(line[0], line[1]));
        k.to_array().into_iter().chain(coefficients).chain([line[2], line[3], v.x, v.y]).collect()
    }

    /// Of `smooth` by the parameters.
    fn jacobian(&self, node: &ZoomNode) -> DMatrix<f64> {
        let (k, l, d) = (&node.intrinsics, &node.laser, node.distortion.coefficients());
        let n = 9 + d.len();
        let mut by = DMatrix::zeros(n, n);
        (by[(0, 0)], by[(1, 1)]) = (1.0 / k.fx, 1.0 / k.fy);
        (by[(2, 0)], by[(2, 2)]) = (-k.skew / (k.fx * k.fx), 1.0 / k.fx);
        (by[(3, 3)], by[(4, 4)]) = (1.0, 1.0);
        for (i, (c, p)) in d.iter().zip(self.powers).enumerate() {
            let scale = (self.half / k.fx).powi(*p);
            (by[(5 + i, 5 + i)], by[(5 + i, 0)]) = (scale, -f64::from(*p) * c * scale / k.fx);
        }
        let (b, line) = (5 + d.len(), 5 + d.len());
        (by[(b, 0)], by[(b, 2)], by[(b, 3)]) = (l.vx, l.vy, 1.0);
        (by[(b, line + 2)], by[(b, line + 3)]) = (k.fx, k.skew);
        (by[(b + 1, 1)], by[(b + 1, 4)], by[(b + 1, line + 3)]) = (l.vy, 1.0, k.fy);
        (by[(b + 2, line)], by[(b + 3, line + 1)]) = (1.0, 1.0);
        by
    }
}

fn check_nodes(size: [u32; 2], nodes: &[ZoomNode]) -> Result<()> {
    let Some(first) = nodes.first() else { return Err(Error::TooFewPoints { given: 0, needed: 1 }) };
    if nodes.len() > MAX_NODES {
        return Err(Error::invalid("nodes", format!("{} zoom positions, at most {MAX_NODES}", nodes.len())));
    }
    for (index, node) in nodes.iter().enumerate() {
        if !node.zoom.is_finite() {
            return Err(Error::NotFinite { name: "zoom", index });
        }
        let at = |e: Error| Error::invalid("nodes", format!("zoom {}: {e}", node.zoom));
        let model = node.model(size);
        model.validate().map_err(at)?;
        model.head_camera(0.0, 0.0).check_lens().map_err(at)?;
        if std::mem::discriminant(&node.distortion) != std::mem::discriminant(&first.distortion) {
            return Err(Error::invalid("nodes", format!("zoom {}: another lens model", node.zoom)));
        }
    }
    let grows = nodes.len() < 2 || nodes[1].intrinsics.fx > first.intrinsics.fx;
    for pair in nodes.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        if a.zoom >= b.zoom {
            return Err(Error::invalid("nodes", format!("zoom {} is followed by {}", a.zoom, b.zoom)));
        }
        let step = [b.intrinsics.fx - a.intrinsics.fx, b.intrinsics.fy - a.intrinsics.fy];
        if step.iter().any(|s| *s == 0.0 || (*s > 0.0) != grows) {
            let focal = |n: &ZoomNode| n.intrinsics.fx;
            let reason = format!(
                "the focal length does not {} from zoom {} ({:.1} px) to zoom {} ({:.1} px)",
                if grows { "grow" } else { "fall" },
                a.zoom,
                focal(a),
                b.zoom,
                focal(b)
            );
            return Err(Error::invalid("nodes", reason));
        }
    }
    Ok(())
}

pub(super) fn check_covariance(c: &DMatrix<f64>, size: usize) -> Result<()> {
    if c.shape() != (size, size) {
        let reason = format!("{} x {}, {size} x {size} expected", c.nrows(), c.ncols());
        return Err(Error::invalid("covariance", reason));
    }
    if let Some(index) = c.iter().position(|v| !v.is_finite()) {
        return Err(Error::NotFinite { name: "covariance", index });
    }
    let bad = || Error::invalid("covariance", "it is not positive semidefinite and symmetric");
    let sigma = DVector::from_fn(size, |i, _| c[(i, i)].max(0.0).sqrt());
    // What is not free has zeros; what is tied to another is correlated with it entirely.
    let mut correlation = DMatrix::identity(size, size) * (1.0 + 1e-6);
    for (i, j) in (0..size).flat_map(|i| (0..size).map(move |j| (i, j))) {
        let scale = sigma[i] * sigma[j];
        if (c[(i, j)] - c[(j, i)]).abs() > 1e-9 * scale || (scale == 0.0 && c[(i, j)] != 0.0) {
            return Err(bad());
        }
        if i != j && scale > 0.0 {
            correlation[(i, j)] = c[(i, j)] / scale;
        }
    }
    nalgebra::Cholesky::new(correlation).map(|_| ()).ok_or_else(bad)
}
