//! A plane through the points about a ray, local and robust: along = offset + slope . across.

use nalgebra::{DMatrix, DVector, Matrix3, Vector2, Vector3};

use crate::geometry::linalg::invert_spd;

/// Residuals beyond this many standard deviations do not count (Tukey's biweight at 95 % efficiency).
const TUKEY: f64 = 4.685;
/// Those within this many lie on the plane.
const ON_PLANE: f64 = 3.0;
const ROUNDS: usize = 10;
/// Planes through three points that the fit starts from.
const STARTS: usize = 60;
/// Surfaces are not flat: the points' spread may exceed their noise so many times before it is taken
/// for two surfaces.
const MOST_SPREAD: f64 = 2.0;
const MIN_POINTS: usize = 4;
/// Rays nearer than this to a surface do not measure it, radians.
const GRAZING: f64 = 0.02;

/// A point in the ray's axes.
#[derive(Debug, Clone)]
pub(super) struct Sample {
    /// 1 and the coordinates across the ray, metres.
    pub row: Vector3<f64>,
    /// Along the ray, metres.
    pub along: f64,
    /// Weight by its distance from the ray.
    pub kernel: f64,
    /// Along, then across; `None`: not known.
    pub covariance: Option<Matrix3<f64>>,
}

pub(super) struct LocalPlane {
    /// Where the ray meets it.
    pub offset: f64,
    pub slope: Vector2<f64>,
    /// Of the offset.
    pub variance: f64,
    /// Which points lie on it.
    pub used: Vec<bool>,
}

impl Sample {
    /// Its place across the ray, metres.
    pub fn across(&self) -> Vector2<f64> {
        self.row.yz()
    }

    /// A surface that a measurement's ray runs along cannot have been measured by it, and its residuals
    /// would have no variance.
    fn could_measure(&self, plane: &Vector3<f64>) -> bool {
        let normal = 1.0 + plane.y * plane.y + plane.z * plane.z;
        self.covariance.is_none_or(|c| self.variance(plane) >= GRAZING * GRAZING * normal * c.trace())
    }

    fn residual(&self, plane: &Vector3<f64>) -> f64 {
        self.along - self.row.dot(plane)
    }

    /// Variance of the residual; 1 when the noise is not known.
    fn variance(&self, plane: &Vector3<f64>) -> f64 {
        let by = Vector3::new(1.0, -plane.y, -plane.z);
        self.covariance.map_or(1.0, |c| by.dot(&(c * by)).max(1e-18))
    }
}

/// Median of the residuals in standard deviations, as that of a Gaussian.
fn spread(samples: &[Sample], plane: &Vector3<f64>) -> f64 {
    let mut sizes: Vec<f64> = samples.iter().map(|s| s.residual(plane).abs() / s.variance(plane).sqrt()).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(sizes.len() / 2).map_or(f64::NAN, |m| 1.4826 * m)
}

/// `None` where no plane is determined.
pub(super) fn fit(samples: &[Sample]) -> Option<LocalPlane> {
    let known = samples.first()?.covariance.is_some();
    let mut plane = start(samples, known)?;
    let mut result = None;
    for _ in 0..ROUNDS {
        let median = spread(samples, &plane);
        let scale = if known { median.clamp(1.0, MOST_SPREAD) } else { median.max(1e-12) };
        let size = |s: &Sample| s.residual(&plane).abs() / (scale * s.variance(&plane).sqrt());
        let used: Vec<bool> = samples.iter().map(|s| size(s) < ON_PLANE).collect();
        let (mut h, mut meat, mut g) = (Matrix3::zeros(), Matrix3::zeros(), Vector3::zeros());
        for s in samples {
            let (v, robust) = (s.variance(&plane), (1.0 - (size(s) / TUKEY).powi(2)).max(0.0).powi(2));
            let weight = s.kernel * robust / v;
            h += s.row * s.row.transpose() * weight;
            meat += s.row * s.row.transpose() * (weight * weight * v);
            g += s.row * (weight * s.along);
        }
        let inverse = inverse(&h)?;
        let next = inverse * g;
        let count = used.iter().filter(|u| **u).count();
        if count < MIN_POINTS {
            return None;
        }
        // What the points scatter beyond their noise is the surface's own.
        let sum: f64 = samples
            .iter()
            .zip(&used)
            .filter(|(_, used)| **used)
            .map(|(s, _)| s.residual(&next).powi(2) / s.variance(&next))
            .sum();
        let factor = sum / (count - 3) as f64;
        let factor = if known { factor.max(1.0) } else { factor };
        let variance = (inverse * meat * inverse)[(0, 0)] * factor;
        let seen = samples.iter().zip(&used).all(|(s, used)| !used || s.could_measure(&next));
        result = seen.then(|| LocalPlane { offset: next.x, slope: next.yz(), variance, used });
        plane = next;
    }
    result
}

/// Squared difference at the ray between a plane and a paraboloid through its points: what the surface may
/// bend. Added to the plane's variance it makes, on average, the paraboloid's and the bend's square: what
/// robust inference after a local fit allows for (Calonico, Cattaneo and Titiunik, Econometrica 2014).
pub(super) fn bend(samples: &[Sample], fit: &LocalPlane) -> Option<f64> {
    let plane = Vector3::new(fit.offset, fit.slope.x, fit.slope.y);
    let on: Vec<&Sample> = samples.iter().zip(&fit.used).filter(|(_, used)| **used).map(|(s, _)| s).collect();
    let (mut h, mut g) = (DMatrix::zeros(6, 6), DVector::zeros(6));
    let scale = on.iter().map(|s| s.across().norm()).fold(1e-12, f64::max);
    for s in &on {
        let (x, y) = (s.row.y / scale, s.row.z / scale);
        let row = DVector::from_row_slice(&[1.0, x, y, x * x, x * y, y * y]);
        let weight = s.kernel / s.variance(&plane);
        h += &row * row.transpose() * weight;
        g += row * (weight * s.residual(&plane));
    }
    let (inverse, condition) = invert_spd(&h)?;
    let found = &inverse * g;
    (condition < 1e12 && on.len() > 6).then(|| found[0].powi(2))
}

/// The plane through three points that most agree with, near ones before far ones.
fn start(samples: &[Sample], known: bool) -> Option<Vector3<f64>> {
    let cost = |plane: &Vector3<f64>| {
        if !known {
            return spread(samples, plane);
        }
        let one = |s: &Sample| s.kernel * (s.residual(plane).powi(2) / s.variance(plane)).min(ON_PLANE * ON_PLANE);
        samples.iter().map(one).sum()
    };
    let mut state = 1u64;
    let mut pick = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((state >> 33) as usize) % samples.len()
    };
    let mut best: Option<(f64, Vector3<f64>)> = None;
    for _ in 0..STARTS {
        let three = [pick(), pick(), pick()].map(|i| &samples[i]);
        let rows = Matrix3::from_rows(&three.map(|s| s.row.transpose()));
        let Some(back) = rows.try_inverse() else { continue };
        let plane = back * Vector3::from(three.map(|s| s.along));
        let cost = cost(&plane);
        if plane.iter().all(|v| v.is_finite())
            && three.iter().all(|s| s.could_measure(&plane))
            && best.as_ref().is_none_or(|(least, _)| cost < *least)
        {
            best = Some((cost, plane));
        }
    }
    best.map(|(_, plane)| plane)
}

fn inverse(h: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let dynamic = DMatrix::from_fn(3, 3, |i, j| h[(i, j)]);
    let (inverse, condition) = invert_spd(&dynamic)?;
    (condition < 1e12).then(|| Matrix3::from_fn(|i, j| inverse[(i, j)]))
}
