//! Passes over all measurements: which plane each belongs to, and what the planes are fitted from.

use nalgebra::Vector3;

use super::kernels::{self, Cut, Sums, Tally};
use super::measured::Measured;

/// Measurements that are looked at together: their rows stay in the cache.
pub(super) const BLOCK: usize = 1024;
/// The label of what belongs to no plane.
pub(super) const NONE: u16 = u16::MAX;

/// Which measurements of every `every`-th block belong to the planes, each to the first that it agrees with: larger
/// ones come first. A plane's tally has in its shells what belongs to no larger one. `labels`: receives
/// the plane of each measurement.
pub(super) fn assign<M: Measured>(
    m: &M,
    normals: &[Vector3<f64>],
    threshold: f64,
    every: usize,
    mut labels: Option<&mut [u16]>,
) -> Vec<Tally> {
    let kind = m.kind();
    let cuts: Vec<Cut> = normals.iter().map(|n| kind.cut(n)).collect();
    let mut tallies = vec![Tally::default(); cuts.len()];
    let (mut rows, mut block) = (m.rows(BLOCK), [0.0; BLOCK]);
    for start in (0..m.count()).step_by(every * BLOCK) {
        let end = m.count().min(start + BLOCK);
        m.load(start, end, &mut rows);
        let columns = rows.columns();
        block.fill(-1.0);
        for (k, (cut, tally)) in cuts.iter().zip(&mut tallies).enumerate() {
            let [inside, shells] = kernels::label(&mut block, k as f64, &columns, cut, threshold);
            tally.shells += shells;
            if inside > 0 {
                tally.inside += kernels::labelled(&columns, &block, k as f64, inside);
            }
        }
        if let Some(labels) = &mut labels {
            kernels::numbers(&mut labels[start..end], &block, NONE);
        }
    }
    tallies
}

/// What a plane of all measurements is fitted from.
pub(super) fn sums_of<M: Measured>(m: &M) -> Sums {
    let (mut all, mut rows) = (Sums::default(), m.rows(BLOCK));
    for start in (0..m.count()).step_by(BLOCK) {
        m.load(start, m.count().min(start + BLOCK), &mut rows);
        all += kernels::sums(&rows.columns());
    }
    all
}
