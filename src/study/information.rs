//! What shots tell before anybody fires them: the Fisher information of the joint problem (docs/maths.md
//! sections 4 and 8), each shot's inverse depth and pointing eliminated, and the covariance that follows.

use nalgebra::{DMatrix, SMatrix, Vector2, Vector3};

use super::setup::Site;
use crate::adjust::Prior;
use crate::calibrate::freedom::{ALL, CENTRE, Freedom, full_jacobian};
use crate::error::Result;
use crate::geometry::linalg::{invert_spd, symmetric_eigen3};
use crate::geometry::{RIG_PARAMETERS, RigParameter};

/// Unknowns at most: of rig and camera.
pub const WIDTH: usize = RIG_PARAMETERS + ALL;
/// Rows of one shot: two pixels, and beliefs about two angles; less the unknowns that only it has.
const ROWS: usize = 6;
const REDUCED: usize = 3;
/// Noise below this is taken for this, px: information stays finite.
pub const LEAST_NOISE: f64 = 1e-6;

/// Standard deviations of a spot's position in the two cameras, px.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseLevel {
    pub head: f64,
    pub fixed: f64,
}

/// One shot's whitened equations over the unknowns: information = sum of row^T row.
pub type ShotRows = SMatrix<f64, REDUCED, WIDTH>;

/// Expected error of the fixed camera's position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Root mean square distance from the true position, metres: the root of the covariance's trace.
    pub rms: f64,
    /// Largest semi-axis of the one-sigma ellipsoid, metres.
    pub semi_axis: f64,
}

impl Accuracy {
    /// Of a position's covariance, m^2; `None` when it is none.
    pub fn of(covariance: &nalgebra::Matrix3<f64>) -> Option<Self> {
        let ([largest, ..], _) = symmetric_eigen3(covariance)?;
        let trace = covariance.trace();
        (trace >= 0.0 && largest >= 0.0).then(|| Self { rms: trace.sqrt(), semi_axis: largest.sqrt() })
    }
}

/// The unknowns of a site: free parameters of the rig, then those of the camera; its position last.
pub struct Unknowns<'a> {
    pub site: &'a Site,
    rig: Vec<usize>,
    freedom: Freedom,
    rig_information: DMatrix<f64>,
}

impl<'a> Unknowns<'a> {
    pub fn of(site: &'a Site) -> Result<Self> {
        Self::with_rig_prior(site, &site.rig_prior)
    }

    /// The same with another belief about the rig.
    pub fn with_rig_prior(site: &'a Site, prior: &Prior) -> Result<Self> {
        let belief = prior.belief(|i| RigParameter::ALL.get(i).map_or_else(String::new, |p| p.name().to_owned()))?;
        let rig = (0..RIG_PARAMETERS).filter(|i| belief.free[*i]).collect();
        Ok(Self { site, rig, freedom: Freedom::of(&site.estimate), rig_information: belief.information })
    }

    pub fn count(&self) -> usize {
        self.rig.len() + self.freedom.count()
    }

    /// What is believed beforehand.
    pub fn priors(&self) -> DMatrix<f64> {
        let (n, first) = (self.count(), self.rig.len());
        let mut h = DMatrix::zeros(n, n);
        for (i, a) in self.rig.iter().enumerate() {
            for (j, b) in self.rig.iter().enumerate() {
                h[(i, j)] = self.rig_information[(*a, *b)];
            }
        }
        let focal = self.site.camera.intrinsics.fx;
        for prior in &self.freedom.priors {
            let row: Vec<f64> = self.freedom.unknowns.iter().map(|u| u.derivative(prior) / focal).collect();
            for (i, a) in row.iter().enumerate() {
                for (j, b) in row.iter().enumerate() {
                    h[(first + i, first + j)] += a * b;
                }
            }
        }
        h
    }

    /// A belief so wide that it only keeps a covariance finite before there are enough shots.
    pub fn diffuse(&self) -> DMatrix<f64> {
        let focal = self.site.camera.intrinsics.fx;
        let size = f64::from(self.site.camera.width.max(self.site.camera.height));
        let rig = self.rig.iter().map(|i| if (5..7).contains(i) { 1e3 } else { 10.0 });
        let camera = self.freedom.unknowns.iter().map(|u| match u.parameter {
            0..3 => focal,
            3..5 => size,
            5..CENTRE => 3.0,
            _ => 100.0,
        });
        let information = rig.chain(camera).map(|sigma| 1.0 / (sigma * sigma));
        DMatrix::from_diagonal(&nalgebra::DVector::from_iterator(self.count(), information))
    }

    /// Equations of a shot whose point is at `depth`; `None` where a camera cannot see it.
    pub fn rows(&self, pan: f64, tilt: f64, depth: f64, noise: &NoiseLevel) -> Option<ShotRows> {
        let (site, rho) = (self.site, 1.0 / depth);
        let ray = site.rig.laser_ray(pan, tilt, [0.0; 2]);
        let spot = site.rig.spot_image(rho)?;
        let seen = site.camera.project_homogeneous(&(ray.direction + ray.origin * rho), rho)?;
        let (head, fixed) = (1.0 / noise.head.max(LEAST_NOISE), 1.0 / noise.fixed.max(LEAST_NOISE));
        // Columns: inverse depth, pan, tilt; then the unknowns.
        let mut a = SMatrix::<f64, ROWS, { WIDTH + 3 }>::zeros();
        let mut put = |row: usize, column: usize, v: Vector2<f64>| {
            (a[(row, column)], a[(row + 1, column)]) = (v.x, v.y);
        };
        let image = |by: Vector3<f64>| seen.by_point * by * fixed;
        put(0, 0, spot.by_rho * head);
        put(2, 0, image(ray.origin) + seen.by_weight * fixed);
        put(2, 1, image(ray.by_pan[1] + ray.by_pan[0] * rho));
        put(2, 2, image(ray.by_tilt[1] + ray.by_tilt[0] * rho));
        for (k, &i) in self.rig.iter().enumerate() {
            put(0, 3 + k, spot.by[i] * head);
            put(2, 3 + k, image(ray.direction_by[i] + ray.origin_by[i] * rho));
        }
        let full = full_jacobian(&seen);
        for (k, unknown) in self.freedom.unknowns.iter().enumerate() {
            put(2, 3 + self.rig.len() + k, unknown.derivative(&full) * fixed);
        }
        // An angle without noise is held far tighter than any head holds it.
        for (k, sigma) in site.pointing_sigma.iter().enumerate() {
            a[(4 + k, 1 + k)] = 1.0 / sigma.max(1e-12);
        }
        eliminate(&mut a);
        let rows: ShotRows = a.fixed_view::<REDUCED, WIDTH>(3, 3).into_owned();
        rows.iter().all(|v| v.is_finite()).then_some(rows)
    }

    /// Adds a shot's information.
    pub fn add(&self, h: &mut DMatrix<f64>, rows: &ShotRows) {
        let n = self.count();
        let used = rows.columns(0, n);
        h.gemm_tr(1.0, &used, &used, 1.0);
    }

    /// Inverse of an information matrix; `None` when it does not determine the unknowns.
    pub fn covariance(&self, h: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        /// Condition at unit diagonal beyond which a direction is not determined.
        const MAX_CONDITION: f64 = 1e14;
        invert_spd(h).filter(|(_, condition)| *condition < MAX_CONDITION).map(|(inverse, _)| inverse)
    }

    /// The camera's block of a covariance, in the order of
    /// [`Calibration::covariance`](crate::calibrate::Calibration::covariance).
    pub fn camera_covariance(&self, covariance: &DMatrix<f64>) -> DMatrix<f64> {
        let (first, count) = (self.rig.len(), self.freedom.count());
        let coefficients = self.site.camera.distortion.coefficients().len();
        let kept: Vec<usize> = (0..5 + coefficients).chain(10..ALL).collect();
        let moves = |i: usize, j: usize| f64::from(self.freedom.unknowns[j].moves(kept[i]));
        let s = DMatrix::from_fn(kept.len(), count, moves);
        &s * covariance.view((first, first), (count, count)) * s.transpose()
    }

    /// Accuracy of the position under a covariance of the unknowns.
    pub fn accuracy(&self, covariance: &DMatrix<f64>) -> Option<Accuracy> {
        let first = self.count() - (ALL - CENTRE);
        Accuracy::of(&covariance.fixed_view::<3, 3>(first, first).into_owned())
    }
}

/// Householder's reflections that leave the first three columns, a shot's own unknowns, to the first three
/// rows: the others are what it tells about everything else.
fn eliminate(a: &mut SMatrix<f64, ROWS, { WIDTH + 3 }>) {
    for k in 0..3 {
        let norm = (k..ROWS).map(|i| a[(i, k)] * a[(i, k)]).sum::<f64>().sqrt();
        if norm == 0.0 {
            continue;
        }
        let alpha = -norm.copysign(a[(k, k)]);
        let mut v = [0.0; ROWS];
        (k..ROWS).for_each(|i| v[i] = a[(i, k)]);
        v[k] -= alpha;
        let beta = -1.0 / (alpha * v[k]);
        for mut column in a.column_iter_mut().skip(k) {
            let s = beta * (k..ROWS).map(|i| v[i] * column[i]).sum::<f64>();
            (k..ROWS).for_each(|i| column[i] -= s * v[i]);
        }
    }
}
