//! A camera's parameters as a vector: which of them are free, which move together, what is believed
//! of them beforehand.

use nalgebra::{Vector2, Vector3};

use super::{CalibrationOptions, DistortionModel};
use crate::geometry::camera::Projection;
use crate::geometry::rigid::{exp, nearest_rotation};
use crate::geometry::{Camera, Distortion, Intrinsics, Rigid};

/// All parameters: fx fy skew cx cy, five distortion coefficients, rotation, centre.
pub(crate) const ALL: usize = 16;
pub(crate) const DISTORTION: usize = 5;
pub(crate) const ROTATION: usize = 10;
pub(crate) const CENTRE: usize = 13;

pub(crate) type Row = [f64; ALL];

/// An unknown of the refinement: a parameter, and another one that moves along with it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Unknown {
    pub parameter: usize,
    pub tied: Option<usize>,
}

impl Unknown {
    pub fn moves(&self, parameter: usize) -> bool {
        parameter == self.parameter || Some(parameter) == self.tied
    }

    /// The derivative by this unknown, from those by all parameters.
    pub fn derivative<T: Copy + std::ops::Add<Output = T>>(&self, by_parameter: &[T]) -> T {
        let own = by_parameter[self.parameter];
        self.tied.map_or(own, |tied| own + by_parameter[tied])
    }
}

/// Which parameters are free, and what is believed of them beforehand.
#[derive(Debug, Clone)]
pub(crate) struct Freedom {
    pub unknowns: Vec<Unknown>,
    /// Residuals of priors, linear in the parameters: row . parameters ~ N(0, 1), lens scale divided out.
    pub priors: Vec<Row>,
}

impl Freedom {
    pub fn of(options: &CalibrationOptions) -> Self {
        let unit = |parameter: usize| Unknown { parameter, tied: None };
        let (mut unknowns, mut priors) = (Vec::new(), Vec::new());
        if options.fixed_lens.is_none() {
            if options.aspect_sigma > 0.0 {
                unknowns.extend([unit(0), unit(1)]);
                let mut aspect = [0.0; ALL];
                (aspect[0], aspect[1]) = (1.0 / options.aspect_sigma, -1.0 / options.aspect_sigma);
                priors.push(aspect);
            } else {
                unknowns.push(Unknown { parameter: 0, tied: Some(1) });
            }
            if options.skew_sigma > 0.0 {
                unknowns.push(unit(2));
                let mut skew = [0.0; ALL];
                skew[2] = 1.0 / options.skew_sigma;
                priors.push(skew);
            }
            unknowns.extend([unit(3), unit(4)]);
            let coefficients: &[usize] = match options.distortion {
                DistortionModel::None => &[],
                DistortionModel::Radial1 | DistortionModel::Division => &[0],
                DistortionModel::Radial2 => &[0, 1],
                DistortionModel::Fisheye => &[0, 1, 2, 3],
                DistortionModel::BrownConrady => &[0, 1, 2, 3, 4],
            };
            unknowns.extend(coefficients.iter().map(|i| unit(DISTORTION + i)));
        }
        unknowns.extend((ROTATION..ALL).map(unit));
        Self { unknowns, priors }
    }

    pub fn count(&self) -> usize {
        self.unknowns.len()
    }

    /// Priors that say something: one of infinite width is no measurement.
    pub fn soft_priors(&self) -> usize {
        self.priors.iter().filter(|row| row.iter().any(|v| *v != 0.0)).count()
    }
}

/// A model without distortion of the kind that `model` fits; of a fisheye the equidistant lens.
pub(crate) fn blank_distortion(model: DistortionModel) -> Distortion {
    match model {
        DistortionModel::None => Distortion::None,
        DistortionModel::Division => Distortion::Division(0.0),
        DistortionModel::Fisheye => Distortion::Fisheye([0.0; 4]),
        _ => Distortion::BrownConrady([0.0; 5]),
    }
}

/// Those parameters that have a value of their own; rotation and centre are zero.
pub(crate) fn parameters(camera: &Camera) -> Row {
    let mut p = [0.0; ALL];
    p[..5].copy_from_slice(&camera.intrinsics.to_array());
    let k = camera.distortion.coefficients();
    p[DISTORTION..DISTORTION + k.len()].copy_from_slice(k);
    p
}

/// d pixel / d each of the sixteen parameters.
pub(crate) fn full_jacobian(p: &Projection) -> [Vector2<f64>; ALL] {
    std::array::from_fn(|i| match i {
        0..DISTORTION => p.by_intrinsics.column(i).into(),
        DISTORTION..ROTATION => p.by_distortion.column(i - DISTORTION).into(),
        ROTATION..CENTRE => p.by_rotation.column(i - ROTATION).into(),
        _ => p.by_centre.column(i - CENTRE).into(),
    })
}

/// The camera after a step; `None` when a focal length would not be positive.
pub(crate) fn moved(camera: &Camera, freedom: &Freedom, step: &[f64]) -> Option<Camera> {
    let mut change = [0.0; ALL];
    for (unknown, s) in freedom.unknowns.iter().zip(step) {
        change[unknown.parameter] += s;
        if let Some(tied) = unknown.tied {
            change[tied] += s;
        }
    }
    let k = camera.intrinsics.to_array();
    let intrinsics = Intrinsics::from_array(std::array::from_fn(|i| k[i] + change[i]));
    let mut distortion = camera.distortion;
    for (k, c) in distortion.coefficients_mut().iter_mut().zip(&change[DISTORTION..ROTATION]) {
        *k += c;
    }
    let turn = Vector3::from_column_slice(&change[ROTATION..CENTRE]);
    let centre = camera.centre() + Vector3::from_column_slice(&change[CENTRE..]);
    // A turn of more than a quarter is never a good step, and repeated products drift: both are mended here.
    if turn.norm() > 1.5 || intrinsics.fx <= 0.0 || intrinsics.fy <= 0.0 {
        return None;
    }
    let rotation = nearest_rotation(&(exp(&turn) * camera.pose.rotation))?;
    Some(Camera { intrinsics, distortion, pose: Rigid::from_centre(rotation, &centre), ..*camera })
}
