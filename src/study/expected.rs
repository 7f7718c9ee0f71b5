//! What the closed-form covariance says of a set-up, without a single trial.

use nalgebra::DMatrix;

use super::information::{Accuracy, NoiseLevel, Unknowns};
use super::setup::{NoiselessShot, SetUp, Site};
use super::statistics::{HandOff, Quantity};
use crate::calibrate::uncertainty::ray_covariance;
use crate::error::{Degeneracy, Error, Result};

/// Expected errors of the joint maximum-likelihood estimate, to first order: root mean squares.
///
/// Soft beliefs about skew and aspect (docs/maths.md section 3) count as information: over cameras that
/// scatter as believed the errors are these. One camera that is exactly as believed errs less, one that is
/// off errs more.
#[derive(Debug, Clone, PartialEq)]
pub struct Expected {
    pub level: NoiseLevel,
    /// By [`Quantity`].
    pub rms: [f64; Quantity::COUNT],
    pub position: Accuracy,
    /// Of a point handed off at each of the study's distances, metres.
    pub handoff: Vec<f64>,
    /// Of the camera, in the order of [`Calibration::covariance`](crate::calibrate::Calibration::covariance).
    pub covariance: DMatrix<f64>,
}

pub(super) fn expected(set_up: &SetUp, level: &NoiseLevel, distances: &[f64]) -> Result<Expected> {
    expected_of(&set_up.site, &set_up.shots, level, distances)
}

/// # Errors
/// `Degenerate` when the shots do not determine the camera.
pub fn expected_of(site: &Site, shots: &[NoiselessShot], level: &NoiseLevel, distances: &[f64]) -> Result<Expected> {
    let undetermined = || {
        let detail = format!("{} shots do not determine the camera", shots.len());
        Error::degenerate(Degeneracy::IllConditioned, detail)
    };
    let unknowns = Unknowns::of(site)?;
    let mut h = unknowns.priors();
    for s in shots {
        if let Some(rows) = unknowns.rows(s.pan, s.tilt, s.depth, level) {
            unknowns.add(&mut h, &rows);
        }
    }
    let all = unknowns.covariance(&h).ok_or_else(undetermined)?;
    let covariance = unknowns.camera_covariance(&all);
    let pose = covariance.nrows() - 6;
    let size = |of: &[usize]| of.iter().map(|i| covariance[(*i, *i)]).sum::<f64>().max(0.0).sqrt();
    let position = unknowns.accuracy(&all).ok_or_else(undetermined)?;
    let mut handoff = vec![0.0; distances.len()];
    let pixels = HandOff::pixels(&site.camera);
    let rays: Vec<_> = pixels.iter().filter_map(|p| ray_covariance(&site.camera, &covariance, p).ok()).collect();
    for ray in &rays {
        for (sum, d) in handoff.iter_mut().zip(distances) {
            *sum += ray.point_at(*d, 0.0)?.covariance.trace() / rays.len() as f64;
        }
    }
    Ok(Expected {
        level: *level,
        rms: [size(&[pose + 3, pose + 4, pose + 5]), size(&[pose, pose + 1, pose + 2]), size(&[0, 1]), size(&[3, 4])],
        position,
        handoff: handoff.into_iter().map(f64::sqrt).collect(),
        covariance,
    })
}
