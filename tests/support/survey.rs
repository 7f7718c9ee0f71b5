//! What a joint adjustment found, against the truth.
#![allow(dead_code)]

use nalgebra::DVector;
use ptzcal::adjust::{AdjustOptions, Adjusted, Adjustment, adjust};
use ptzcal::geometry::{Rigid, rigid};

/// By the defaults.
pub fn solve(input: &Adjustment) -> Adjusted {
    adjust(input, &AdjustOptions::default()).unwrap()
}

/// Rotation and position of a station beyond the truth's.
pub fn station_error(a: &Adjusted, station: usize, truth: &Rigid) -> DVector<f64> {
    let pose = &a.stations[station];
    let turn = rigid::log(&(pose.rotation * truth.rotation.transpose()));
    let shift = pose.translation - truth.translation;
    DVector::from_iterator(6, turn.iter().chain(shift.iter()).copied())
}

/// An error's squared length by the covariance of the parameters from `first` on.
pub fn squared(a: &Adjusted, first: usize, error: &DVector<f64>) -> f64 {
    let n = error.len();
    let block = a.covariance.view((first, first), (n, n)).into_owned();
    error.dot(&block.cholesky().unwrap().solve(error))
}
