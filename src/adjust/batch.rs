//! Shots that touch the same columns, whose own unknowns are eliminated together.

use std::collections::BTreeMap;

use super::layout::Layout;
use super::linearise::Witness;

/// Shots whose rows cost as much as a batch's own matrix.
const MATRIX: usize = 64;

/// Shots from one station with the same witnesses, or nearly: they touch the same columns.
pub(super) struct Batch {
    pub station: usize,
    pub shots: Vec<usize>,
    pub columns: Vec<usize>,
    /// In their order, each with its place in `columns`.
    pub witnesses: Vec<(Witness, usize)>,
}

impl Batch {
    pub fn new(layout: &Layout, station: usize, witnesses: impl Iterator<Item = Witness>, shots: Vec<usize>) -> Self {
        let mut columns = layout.common_columns(station);
        let mut places = Vec::new();
        for witness in witnesses {
            places.push((witness, columns.len()));
            columns.extend(layout.witness_columns(witness));
        }
        Self { station, shots, columns, witnesses: places }
    }

    /// Of a witness's first column among the batch's.
    pub fn place(&self, witness: Witness) -> Option<usize> {
        let k = self.witnesses.binary_search_by_key(&witness, |(w, _)| *w).ok()?;
        Some(self.witnesses[k].1)
    }
}

/// Groups of shots, each with its station and witnesses.
pub(super) type Groups = BTreeMap<(usize, Vec<Witness>), Vec<usize>>;

/// The groups of a station as one with all their witnesses, where rows with zeros in them cost less than
/// many small matrices.
pub(super) fn merged(layout: &Layout, groups: Groups) -> Groups {
    let mut stations: BTreeMap<usize, Groups> = BTreeMap::new();
    for (key, shots) in groups {
        stations.entry(key.0).or_default().insert(key, shots);
    }
    let cost = |station: usize, witnesses: &[Witness], shots: usize| {
        let own: usize = witnesses.iter().map(|w| layout.witness_columns(*w).len()).sum();
        let width = layout.common_columns(station).len() + own;
        (shots + MATRIX) * width * width
    };
    let mut merged = Groups::new();
    for (station, groups) in stations {
        let mut all: Vec<Witness> = groups.keys().flat_map(|(_, witnesses)| witnesses).copied().collect();
        all.sort_unstable();
        all.dedup();
        let mut shots: Vec<usize> = groups.values().flatten().copied().collect();
        shots.sort_unstable();
        let apart: usize = groups.iter().map(|((_, witnesses), shots)| cost(station, witnesses, shots.len())).sum();
        if cost(station, &all, shots.len()) < apart {
            merged.insert((station, all), shots);
        } else {
            merged.extend(groups);
        }
    }
    merged
}
