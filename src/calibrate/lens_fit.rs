//! A lens model's camera from the polynomial that radial alignment gives.

use nalgebra::{DMatrix, DVector};

use super::DistortionModel;
use super::decompose::decompose;
use super::radial_alignment::RadialCamera;
use crate::geometry::{Camera, Distortion};

/// Radii at which lens and polynomial are compared.
const SAMPLES: usize = 40;
/// Largest ideal radius at which the normalised plane is of use: 80 degrees.
pub(crate) const WIDEST: f64 = 5.7;

/// Coefficients of g that a sample determines, and those that a model needs.
pub(crate) fn terms(model: DistortionModel) -> (usize, usize) {
    match model {
        DistortionModel::Fisheye => (2, 3),
        DistortionModel::Radial2 | DistortionModel::BrownConrady => (1, 2),
        _ => (1, 1),
    }
}

/// The camera of a radial camera with the lens `model`, fitted up to the radius `reach` (px).
pub(crate) fn camera(
    radial: &RadialCamera,
    model: DistortionModel,
    reach: f64,
    width: u32,
    height: u32,
) -> Option<Camera> {
    let (intrinsics, pose) = decompose(&radial.undistorted()).ok()?;
    let f = (intrinsics.fx * intrinsics.fy).sqrt();
    // (ideal radius or angle, distorted radius) on the normalised plane.
    let pairs = (1..=SAMPLES).filter_map(|i| {
        let r = reach * i as f64 / SAMPLES as f64;
        let (g, _) = radial.g(r);
        let ideal = match model {
            DistortionModel::Fisheye => Some(r.atan2(f * g)),
            _ => Some(r / (f * g)).filter(|radius| *radius > 0.0 && *radius < WIDEST),
        };
        ideal.map(|ideal| (ideal, r / f))
    });
    let distortion = match model {
        DistortionModel::None => Distortion::None,
        DistortionModel::Division => Distortion::Division(radial.coefficients[0] * f * f),
        DistortionModel::Radial1 => {
            let [k1] = odd_polynomial(pairs)?;
            Distortion::BrownConrady([k1, 0.0, 0.0, 0.0, 0.0])
        }
        DistortionModel::Radial2 | DistortionModel::BrownConrady => {
            let [k1, k2] = odd_polynomial(pairs)?;
            Distortion::BrownConrady([k1, k2, 0.0, 0.0, 0.0])
        }
        DistortionModel::Fisheye => {
            let [k1, k2] = odd_polynomial(pairs)?;
            Distortion::Fisheye([k1, k2, 0.0, 0.0])
        }
    };
    let camera = Camera { width, height, intrinsics, distortion, pose };
    camera.validate().is_ok().then_some(camera)
}

/// k in y = x (1 + k1 x^2 + k2 x^4 + ...), least squares.
fn odd_polynomial<const N: usize>(pairs: impl Iterator<Item = (f64, f64)>) -> Option<[f64; N]> {
    let pairs: Vec<(f64, f64)> = pairs.collect();
    if pairs.len() < 2 * N {
        return None;
    }
    let a = DMatrix::from_fn(pairs.len(), N, |i, j| pairs[i].0.powi(2 * j as i32 + 3));
    let b = DVector::from_fn(pairs.len(), |i, _| pairs[i].1 - pairs[i].0);
    let k = (a.transpose() * &a).cholesky()?.solve(&(a.transpose() * b));
    Some(std::array::from_fn(|i| k[i]))
}
