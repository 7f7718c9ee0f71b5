//! One laser, several zoom positions.
//!
//! Laser and camera are one rigid head; what zooming moves is the camera's centre, along its axis (the
//! entrance pupil). So the laser has one direction (vx, vy) at all positions, and its point at depth 0
//! moves by (vx, vy) s with the centre's shift s. The positions' estimates are Gaussian and independent:
//! conditioning them on this is the joint maximum likelihood, to first order. Through their correlation
//! with the line the lenses gain too, and a position at which no spot was seen gets a line.
//!
//! Whether zooming does no more than that (a lens group may wander) is for the data to say: the
//! constraints' chi-square is tested, and where it fails every position keeps its own line.

use nalgebra::{DMatrix, DVector, Matrix4};

use super::solve::block_diagonal;
use crate::calibrate::check::SURE;
use crate::geometry::chi_square::upper_tail;
use crate::geometry::rig_model::LaserLine;
use crate::geometry::zoom_curve::ZoomNode;
use crate::geometry::{Distortion, Intrinsics};

/// The line's own parameters: x0 y0 vx vy.
const LINE: usize = 4;

/// The laser's line as all zoom positions see it.
#[derive(Debug, Clone, PartialEq)]
pub struct CommonLine {
    /// In the camera's frame at the first position that saw the spot.
    pub line: LaserLine,
    /// Of x0 y0 vx vy.
    pub covariance: Matrix4<f64>,
    /// Positions that saw the spot.
    pub positions: usize,
    /// Disagreement of the positions' own lines, chi-square distributed with `freedom` degrees of freedom
    /// when they are one line.
    pub chi2: f64,
    pub freedom: usize,
    /// Chance of such a disagreement or a larger one.
    pub probability: f64,
    /// Are they one line? (Chance of 1 in 1000 or more.) If not, every position keeps its own.
    pub agrees: bool,
    /// If not: the position without which the others agree best.
    pub odd: Option<f64>,
}

/// What one position says by itself.
#[derive(Debug, Clone)]
pub(super) struct Own {
    pub zoom: f64,
    pub intrinsics: Intrinsics,
    pub distortion: Distortion,
    pub laser: Option<LaserLine>,
    /// Of the lens and, with a laser, its line.
    pub covariance: DMatrix<f64>,
}

impl Own {
    fn lens(&self) -> usize {
        5 + self.distortion.coefficients().len()
    }

    fn node(&self, laser: LaserLine) -> ZoomNode {
        ZoomNode { zoom: self.zoom, intrinsics: self.intrinsics, distortion: self.distortion, laser }
    }
}

/// All positions' answers.
pub(super) struct Shared {
    pub nodes: Vec<Option<ZoomNode>>,
    pub common: Option<CommonLine>,
    pub covariance: DMatrix<f64>,
}

/// `pupil`: prior standard deviation of the centre's shift; `None`: every position keeps its own line.
pub(super) fn share(owns: &[Option<Own>], pupil: Option<f64>) -> Shared {
    let lit: Vec<&Own> = owns.iter().flatten().filter(|o| o.laser.is_some()).collect();
    let apart = |common: Option<CommonLine>| Shared {
        nodes: owns.iter().map(|o| o.as_ref().and_then(|o| o.laser.map(|l| o.node(l)))).collect(),
        common,
        covariance: block_diagonal(lit.iter().map(|o| &o.covariance)),
    };
    let Some(pupil) = pupil.filter(|_| !lit.is_empty()) else { return apart(None) };
    let Some(fused) = Fused::new(&lit, pupil) else { return apart(None) };
    let freedom = fused.freedom();
    let probability = upper_tail(fused.chi2, freedom as f64);
    let agrees = probability >= SURE;
    let common = CommonLine {
        line: fused.line(0),
        covariance: Matrix4::from_fn(|i, j| fused.covariance[(lit[0].lens() + i, lit[0].lens() + j)]),
        positions: lit.len(),
        chi2: fused.chi2,
        freedom,
        probability,
        agrees,
        odd: if agrees { None } else { odd_one_out(&lit, pupil) },
    };
    let common = (lit.len() > 1).then_some(common);
    if !agrees { apart(common) } else { fused.spread(owns, pupil, common) }
}

/// The position whose absence lowers the disagreement most.
fn odd_one_out(lit: &[&Own], pupil: f64) -> Option<f64> {
    let without = |skip: usize| {
        let rest: Vec<&Own> = lit.iter().enumerate().filter(|(i, _)| *i != skip).map(|(_, o)| *o).collect();
        Fused::new(&rest, pupil).map(|f| f.chi2)
    };
    // Of two that disagree nobody can tell which one is wrong.
    let enough = lit.len() > 2;
    let order = |a: &(usize, f64), b: &(usize, f64)| a.1.total_cmp(&b.1);
    let all = (0..lit.len()).filter(|_| enough).filter_map(|i| Some((i, without(i)?)));
    all.min_by(order).map(|(i, _)| lit[i].zoom)
}

/// The positions that saw the spot, conditioned on one line.
struct Fused<'a> {
    lit: Vec<&'a Own>,
    /// Their parameters, position after position, then the shifts of all but the first.
    state: DVector<f64>,
    covariance: DMatrix<f64>,
    chi2: f64,
}

impl<'a> Fused<'a> {
    fn new(lit: &[&'a Own], pupil: f64) -> Option<Self> {
        let shifts = lit.len() - 1;
        let variance = DMatrix::from_diagonal_element(shifts, shifts, pupil * pupil);
        let blocks = lit.iter().map(|o| &o.covariance).chain([&variance]);
        let mut covariance = block_diagonal(blocks.collect::<Vec<_>>().into_iter());
        let size = covariance.nrows();
        let mut state = DVector::zeros(size);
        for (k, own) in lit.iter().enumerate() {
            let node = own.node(own.laser?);
            let at = first(lit, k);
            state.rows_mut(at, own.lens() + LINE).copy_from_slice(&node.parameters());
        }
        // line_k - line_0 - shift_k (vx, vy, 0, 0) = 0; the shifts start at 0.
        let line = |k: usize| first(lit, k) + lit[k].lens();
        let mut by = DMatrix::zeros(LINE * shifts, size);
        let mut off = DVector::zeros(LINE * shifts);
        for k in 1..lit.len() {
            for i in 0..LINE {
                let row = LINE * (k - 1) + i;
                (by[(row, line(k) + i)], by[(row, line(0) + i)]) = (1.0, -1.0);
                if i < 2 {
                    by[(row, size - shifts + k - 1)] = -state[line(0) + 2 + i];
                }
                off[row] = state[line(k) + i] - state[line(0) + i];
            }
        }
        let mut chi2 = 0.0;
        if shifts > 0 {
            let gain = &covariance * by.transpose();
            let s = &by * &gain;
            let scale = DVector::from_fn(s.nrows(), |i, _| 1.0 / s[(i, i)].sqrt());
            let scaled = DMatrix::from_fn(s.nrows(), s.nrows(), |i, j| s[(i, j)] * scale[i] * scale[j]);
            let s = nalgebra::Cholesky::new(scaled)?;
            let off = off.component_mul(&scale);
            let gain = gain * DMatrix::from_diagonal(&scale);
            let solved = s.solve(&off);
            chi2 = off.dot(&solved);
            state -= &gain * solved;
            let l = s.unpack();
            let half = l.solve_lower_triangular(&gain.transpose())?;
            covariance -= half.transpose() * half;
        }
        let sound = chi2.is_finite() && state.iter().chain(covariance.iter()).all(|v| v.is_finite());
        sound.then_some(Self { lit: lit.to_vec(), state, covariance, chi2 })
    }

    /// The shifts have a prior each: no freedom is lost to them.
    fn freedom(&self) -> usize {
        LINE * (self.lit.len() - 1)
    }

    fn line(&self, k: usize) -> LaserLine {
        let at = first(&self.lit, k) + self.lit[k].lens();
        LaserLine { x0: self.state[at], y0: self.state[at + 1], vx: self.state[at + 2], vy: self.state[at + 3] }
    }

    /// To all positions that have a lens.
    fn spread(&self, owns: &[Option<Own>], pupil: f64, common: Option<CommonLine>) -> Shared {
        let dark: Vec<&Own> = owns.iter().flatten().filter(|o| o.laser.is_none()).collect();
        // What the nodes are made of: the fused state, then lens and shift of each position without a spot.
        let shift = DMatrix::from_element(1, 1, pupil * pupil);
        let more = dark.iter().flat_map(|o| [&o.covariance, &shift]);
        let sources = block_diagonal([&self.covariance].into_iter().chain(more).collect::<Vec<_>>().into_iter());
        let size: usize = owns.iter().flatten().map(|o| o.lens() + LINE).sum();
        let mut by = DMatrix::zeros(size, sources.nrows());
        let mut nodes = Vec::with_capacity(owns.len());
        let (mut row, mut k, mut other) = (0, 0, self.covariance.nrows());
        let (line0, reference) = (self.line(0), self.lit[0].lens());
        for own in owns {
            let Some(own) = own else {
                nodes.push(None);
                continue;
            };
            let lens = own.lens();
            let mut node = own.node(own.laser.unwrap_or(line0));
            if own.laser.is_some() {
                let at = first(&self.lit, k);
                (0..lens + LINE).for_each(|i| by[(row + i, at + i)] = 1.0);
                node.set_parameters(&self.state.as_slice()[at..at + lens + LINE]);
                k += 1;
            } else {
                (0..lens).for_each(|i| by[(row + i, other + i)] = 1.0);
                (0..LINE).for_each(|i| by[(row + lens + i, reference + i)] = 1.0);
                (by[(row + lens, other + lens)], by[(row + lens + 1, other + lens)]) = (line0.vx, line0.vy);
                other += lens + 1;
            }
            row += lens + LINE;
            nodes.push(Some(node));
        }
        let c = &by * sources * by.transpose();
        let covariance = DMatrix::from_fn(size, size, |i, j| 0.5 * (c[(i, j)] + c[(j, i)]));
        Shared { nodes, common, covariance }
    }
}

/// Where a position's parameters begin.
fn first(lit: &[&Own], k: usize) -> usize {
    lit[..k].iter().map(|o| o.lens() + LINE).sum()
}
