//! More pairs than features alone can tell: of all that are each other's nearest, those that lie where
//! a first camera expects them.

use nalgebra::Vector2;

use super::lift::Lifted;
use super::view::View;
use crate::calibrate::Calibration;
use crate::detect::sift::{SiftFeatures, SiftKeypoint};

/// Squared Mahalanobis distance of a feature from its expected place: a chance of 1 in 1000.
const GATE: f64 = 13.8;
/// Greatest ratio of a feature's scale to the one expected, either way.
const MAX_SCALE_RATIO: f64 = 1.6;
/// Furthest standard deviation, pixels, of an expected place: a camera that says less is no guide.
const MAX_REACH: f64 = 10.0;

/// The view's candidates that agree with the camera. `sigma`: of keypoints, pixels.
pub(super) fn pairs(view: &View, fixed: &SiftFeatures, first: &Calibration, sigma: f64) -> Vec<(usize, usize)> {
    let agrees = |(a, b): &(usize, usize)| {
        let lifted = view.lifted[*a].as_ref()?;
        agrees(first, lifted, &view.features.keypoints[*a], &fixed.keypoints[*b], sigma)
    };
    view.candidates.iter().filter(|pair| agrees(pair) == Some(true)).copied().collect()
}

fn agrees(first: &Calibration, lifted: &Lifted, own: &SiftKeypoint, other: &SiftKeypoint, sigma: f64) -> Option<bool> {
    let intrinsics = &first.camera.intrinsics;
    let z = first.camera.pose.apply(&lifted.world).z;
    let scale = own.scale * lifted.metres_per_pixel * (intrinsics.fx * intrinsics.fy).sqrt() / z;
    let ratio = other.scale / scale;
    let expected = first.project(&lifted.world, Some(&lifted.covariance(sigma))).ok()?;
    let off = Vector2::new(other.x, other.y) - expected.pixel;
    let information = (expected.covariance + other.shape() * sigma.powi(2)).try_inverse()?;
    let near =
        expected.covariance.symmetric_eigenvalues().max() <= MAX_REACH.powi(2) && off.dot(&(information * off)) <= GATE;
    Some(near && (1.0 / MAX_SCALE_RATIO..=MAX_SCALE_RATIO).contains(&ratio))
}
