//! Where planes were measured, how well their measurements fit, and how even their surfaces are: one pass
//! over all measurements for all planes.

use nalgebra::Vector3;

use super::assign::{BLOCK, NONE};
use super::kernels::{self, Columns, Cut};
use super::measured::Measured;
use super::rows::Kind;
use super::support::{Grid, PlaneSupport, UNEVENNESS_CELLS, unevenness};
use super::{FoundPlane, any_of};
use crate::pose::plane_fit::{Fit, PlaneEstimate};

/// Measurements that tell a plane's axes and how far it reaches: the ends are known to a thousandth of a side.
const SAMPLED: usize = 65_536;

/// What is known of one plane during the pass.
struct Described {
    fit: Fit,
    cut: Cut,
    /// Its centre and extent are of a sample, its area is not known yet.
    support: PlaneSupport,
    /// As rows are: from the middle.
    offsets: [f64; 3],
    area: Grid,
    hit: Vec<bool>,
    even: Grid,
    /// How many residuals are in each cell, and their sum; beyond the extent in the last.
    cells: Vec<(f64, f64)>,
    count: usize,
    /// Of squared residuals, squared distances, and places along the axes.
    chi_square: f64,
    off: f64,
    along: [f64; 2],
}

/// The planes that are fitted to the measurements with their labels.
pub(super) fn describe<M: Measured>(
    m: &M,
    labels: &[u16],
    counts: &[usize],
    fits: Vec<Option<Fit>>,
) -> Vec<Option<FoundPlane>> {
    let samples = sampled(labels, counts);
    let kind = m.kind();
    let mut all: Vec<Option<Described>> = fits
        .into_iter()
        .zip(samples)
        .zip(counts)
        .map(|((fit, sample), count)| {
            Some(Described::new(m, &kind, fit.filter(|_| !sample.is_empty())?, *count, &sample))
        })
        .collect();
    let (mut rows, mut own, mut room) = (m.rows(BLOCK), m.rows(BLOCK), Room::new());
    // Of each plane in a block, and of none: a list as long as the block, and how long it is.
    let (mut members, mut lengths) = (vec![0u32; (all.len() + 1) * BLOCK], vec![0usize; all.len() + 1]);
    for start in (0..m.count()).step_by(BLOCK) {
        let end = m.count().min(start + BLOCK);
        m.load(start, end, &mut rows);
        // Without a branch: who comes next cannot be guessed.
        for (i, label) in labels[start..end].iter().enumerate() {
            let k = (*label as usize).min(all.len());
            members[k * BLOCK + lengths[k]] = i as u32;
            lengths[k] += 1;
        }
        for (k, plane) in all.iter_mut().enumerate() {
            if let Some(plane) = plane
                && lengths[k] > 0
            {
                rows.gather_into(&members[k * BLOCK..][..lengths[k]], &mut own);
                plane.add(&own.columns(), &kind, &mut room);
            }
        }
        lengths.fill(0);
    }
    all.into_iter().map(|plane| plane.map(Described::finish)).collect()
}

/// Some of the measurements of each plane, which has so many.
fn sampled(labels: &[u16], counts: &[usize]) -> Vec<Vec<u32>> {
    let mut samples: Vec<Vec<u32>> = vec![Vec::new(); counts.len()];
    let is_small = |k: usize| counts[k] < 2 * SAMPLED;
    if (0..counts.len()).any(|k| counts[k] > 0 && is_small(k)) {
        for (i, label) in labels.iter().enumerate() {
            if *label != NONE && is_small(*label as usize) {
                samples[*label as usize].push(i as u32);
            }
        }
    }
    for (k, sample) in samples.iter_mut().enumerate().filter(|(k, _)| !is_small(*k)) {
        let every = counts[k] / SAMPLED;
        let some = (0..labels.len() / every).map(|group| any_of(group, every));
        sample.extend(some.filter(|i| labels[*i] == k as u16).map(|i| i as u32));
    }
    samples
}

/// Numbers of a block's measurements.
struct Room {
    places: [Vec<f64>; 3],
    numbers: [Vec<f64>; 4],
    cells: Vec<u32>,
}

impl Room {
    fn new() -> Self {
        Self { places: Default::default(), numbers: Default::default(), cells: Vec::new() }
    }

    fn resize(&mut self, count: usize) {
        self.numbers.iter_mut().for_each(|v| v.resize(count, 0.0));
        self.cells.resize(count, 0);
    }
}

impl Described {
    fn new<M: Measured>(m: &M, kind: &Kind, fit: Fit, count: usize, sample: &[u32]) -> Self {
        let (normal, distance) = (fit.n.normalize(), 1.0 / fit.n.norm());
        let places: Vec<Vector3<f64>> = sample.iter().map(|i| m.position(*i as usize)).collect();
        let support = PlaneSupport::of(&places, &normal, distance);
        let middle = kind.middle();
        let along = support.axes.map(|axis| axis.dot(&(middle - support.centre)));
        let (area, even) = (support.covered_by(count), support.grid([UNEVENNESS_CELLS; 2]));
        Self {
            cut: kind.cut(&fit.n),
            offsets: [along[0], along[1], normal.dot(&middle) - distance],
            hit: vec![false; area.cells() + 1],
            cells: vec![(0.0, 0.0); even.cells() + 1],
            fit,
            support,
            area,
            even,
            count: 0,
            chi_square: 0.0,
            off: 0.0,
            along: [0.0; 2],
        }
    }

    fn add(&mut self, rows: &Columns<'_>, kind: &Kind, room: &mut Room) {
        room.resize(rows.b.len());
        let Room { places, numbers: [u, v, off, residuals], cells } = room;
        let places = match kind {
            Kind::Points { .. } => rows.a,
            Kind::Shots => {
                places.iter_mut().zip(rows.a).for_each(|(to, a)| a.clone_into(to));
                let [x, y, z] = &mut *places;
                kernels::divide(x, y, z, rows.b);
                [x.as_slice(), y, z]
            }
        };
        let axes = self.support.axes;
        kernels::project(u, &places, &axes[0].into(), self.offsets[0]);
        kernels::project(v, &places, &axes[1].into(), self.offsets[1]);
        kernels::project(off, &places, &self.fit.n.normalize().into(), self.offsets[2]);
        kernels::residuals(residuals, rows, &self.cut);
        self.count += rows.b.len();
        self.along[0] += kernels::sum(u);
        self.along[1] += kernels::sum(v);
        self.off += kernels::sum_of_squares(off);
        self.chi_square += kernels::sum_of_squares(residuals);
        self.area.find(cells, u, v);
        cells.iter().for_each(|c| self.hit[*c as usize] = true);
        self.even.find(cells, u, v);
        for (cell, residual) in cells.iter().zip(residuals) {
            let (count, sum) = &mut self.cells[*cell as usize];
            *count += 1.0;
            *sum += *residual;
        }
    }

    fn finish(self) -> FoundPlane {
        let Self { fit, mut support, count, .. } = self;
        let hit = self.hit[..self.area.cells()].iter().filter(|h| **h).count();
        support.area = self.area.area() * hit as f64 / self.area.cells() as f64;
        support.shift(self.along.map(|sum| sum / count as f64));
        let covariance = fit.covariance * unevenness(&self.cells[..self.even.cells()]);
        let estimate = PlaneEstimate {
            n: fit.n,
            covariance,
            chi_square: self.chi_square,
            degrees_of_freedom: count.saturating_sub(3),
            inliers: Vec::new(),
        };
        FoundPlane { estimate, support, count, rms: (self.off / count as f64).sqrt() }
    }
}
