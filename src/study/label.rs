//! The precision label of a set-up (thesis VIII.D): the fixed camera's error against distance and noise, by
//! simulation beside the closed-form covariance.

use std::ops::ControlFlow;

use super::information::NoiseLevel;
use super::method::Method;
use super::run::{Draws, MAX_DISTANCES, Study, StudyOptions, check_distances};
use super::setup::SetUp;
use super::statistics::Quantity;
use crate::calibrate::dlt::MIN_POINTS;
use crate::control::Cancel;
use crate::error::{Error, Result};

#[derive(Debug, Clone)]
pub struct LabelOptions {
    /// Working distances, metres: shots up to this depth are taken, and points are handed off there.
    pub distances: Vec<f64>,
    /// Noise levels.
    pub levels: Vec<NoiseLevel>,
    /// The estimator that is labelled.
    pub method: Method,
    pub trials: usize,
    pub seed: u64,
    pub threads: usize,
    pub cancel: Cancel,
}

impl Default for LabelOptions {
    fn default() -> Self {
        Self {
            distances: vec![2.0, 3.0, 4.0, 5.0],
            levels: [0.1, 0.2, 0.5, 1.0].map(|s| NoiseLevel { head: s, fixed: s }).to_vec(),
            method: Method::JointMl,
            trials: 100,
            seed: 1,
            threads: 1,
            cancel: Cancel::new(),
        }
    }
}

/// One line of a label: root mean square errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LabelRow {
    pub distance: f64,
    pub level: NoiseLevel,
    /// Shots up to that distance.
    pub shots: usize,
    /// Trials that gave no camera.
    pub failures: usize,
    /// By [`Quantity`]: simulated, and by the closed-form covariance of the joint estimate.
    pub simulated: [f64; Quantity::COUNT],
    pub expected: [f64; Quantity::COUNT],
    /// Of a point handed off at the distance, metres.
    pub handoff_simulated: f64,
    pub handoff_expected: f64,
}

#[derive(Debug, Clone)]
pub struct PrecisionLabel {
    pub options: LabelOptions,
    /// Distance by distance, level by level within. Distances up to which there are fewer shots than a
    /// camera needs, or none that determine it, have no rows.
    pub rows: Vec<LabelRow>,
}

impl PrecisionLabel {
    /// Makes the label. `progress` hears on the calling thread how many of how many trials are done.
    ///
    /// # Errors
    /// `InvalidArgument`, `NotFinite`, `Cancelled`; `Degenerate` or `TooFewPoints` when no distance has rows.
    pub fn make(
        set_up: &SetUp,
        options: &LabelOptions,
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Self> {
        if options.distances.is_empty() || options.distances.len() > MAX_DISTANCES {
            let detail = format!("{}; 1 to {MAX_DISTANCES} are possible", options.distances.len());
            return Err(Error::invalid("distances", detail));
        }
        check_distances(&options.distances)?;
        let total = options.trials.saturating_mul(options.distances.len());
        let mut rows = Vec::new();
        let mut fault = Error::TooFewPoints { given: 0, needed: MIN_POINTS };
        for (i, &distance) in options.distances.iter().enumerate() {
            let part = set_up.within(distance);
            let study = StudyOptions {
                methods: vec![options.method],
                levels: options.levels.clone(),
                trials: options.trials,
                draws: Draws::Common,
                seed: options.seed,
                distances: vec![distance],
                threads: options.threads,
                cancel: options.cancel.clone(),
            };
            study.validate()?;
            if part.shots.len() < MIN_POINTS {
                fault = Error::TooFewPoints { given: part.shots.len(), needed: MIN_POINTS };
                continue;
            }
            match Study::run(&part, &study, |done, _| progress(i * options.trials + done, total)) {
                Ok(study) => rows.extend(label_rows(&study, distance)),
                Err(e @ (Error::Degenerate { .. } | Error::TooFewPoints { .. })) => fault = e,
                Err(e) => return Err(e),
            }
        }
        if rows.is_empty() { Err(fault) } else { Ok(Self { options: options.clone(), rows }) }
    }
}

fn label_rows(study: &Study, distance: f64) -> impl Iterator<Item = LabelRow> + '_ {
    study.cells.iter().enumerate().map(move |(i, cell)| {
        let expected = study.expected.get(i);
        LabelRow {
            distance,
            level: cell.level,
            shots: study.set_up.shots.len(),
            failures: cell.failures,
            simulated: cell.rms,
            expected: expected.map_or([f64::INFINITY; Quantity::COUNT], |e| e.rms),
            handoff_simulated: cell.handoff.first().copied().unwrap_or(f64::INFINITY),
            handoff_expected: expected.and_then(|e| e.handoff.first().copied()).unwrap_or(f64::INFINITY),
        }
    })
}
