//! The shots of a check: which to store, how to pair them, and what a pair says.

use nalgebra::{Matrix2, SMatrix, Vector2, Vector3};

use super::HealthOptions;
use crate::error::{Error, Result};
use crate::geometry::chi_square::upper_tail;
use crate::geometry::{Camera, RigModel};
use crate::rig::Scan;

/// Steepest surface whose depth the head's rest moves, metres a metre.
const STEEPEST: f64 = 2.0;
/// Error of a calibration in its own image, pixels: what weighs its depth against the head camera's.
const MODEL_SIGMA: f64 = 0.5;
/// Two readings are the same within this, radians.
const SAME_READING: f64 = 1e-3;

/// A spot and its covariance (px^2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    pub pixel: Vector2<f64>,
    pub covariance: Matrix2<f64>,
}

/// A stored shot and what the same readings gave again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HealthShot {
    /// The device's readings, radians.
    pub pan: f64,
    pub tilt: f64,
    /// As stored: in the head camera, in the fixed one.
    pub head: Spot,
    pub fixed: Spot,
    /// Fired again; `None`: not seen.
    pub head_again: Option<Spot>,
    pub fixed_again: Option<Spot>,
}

impl HealthShot {
    pub(super) fn validate(&self, index: usize) -> Result<()> {
        if !(self.pan.is_finite() && self.tilt.is_finite()) {
            return Err(Error::NotFinite { name: "shots", index });
        }
        for spot in [Some(self.head), Some(self.fixed), self.head_again, self.fixed_again].into_iter().flatten() {
            if !spot.pixel.iter().chain(spot.covariance.iter()).all(|v| v.is_finite()) {
                return Err(Error::NotFinite { name: "shots", index });
            }
            let c = spot.covariance;
            if !(c.m11 > 0.0 && c.determinant() > 0.0 && (c.m12 - c.m21).abs() <= 1e-9 * c.m11.max(c.m22)) {
                return Err(Error::invalid("shots", format!("a covariance of shot {index} is not positive definite")));
            }
        }
        Ok(())
    }
}

fn spot(found: &crate::detect::spot::Spot) -> Spot {
    let [xx, xy, yy] = found.covariance;
    Spot { pixel: Vector2::new(found.x, found.y), covariance: Matrix2::new(xx, xy, xy, yy) }
}

/// The shots of a scan that are worth storing for checks of fixed camera `camera`: seen by both cameras,
/// and as far from each other in the fixed camera's picture and in depth as `count` can be. Indices into
/// [`Scan::shots`].
///
/// # Errors
/// `InvalidArgument` for a camera that was not watched, `TooFewPoints` for fewer usable shots than four.
pub fn choose_shots(scan: &Scan, camera: usize, count: usize) -> Result<Vec<usize>> {
    let &(width, _) = scan
        .fixed_sizes
        .get(camera)
        .ok_or_else(|| Error::invalid("camera", format!("{camera} of {}", scan.fixed_sizes.len())))?;
    // Places in units of the picture's width, and inverse depth in units of its spread.
    let rhos: Vec<f64> = scan.shots.iter().filter_map(|s| Some(s.point?.point.rho)).collect();
    let (low, high) = rhos.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), r| (l.min(*r), h.max(*r)));
    let places: Vec<(usize, Vector3<f64>)> = scan
        .shots
        .iter()
        .enumerate()
        .filter_map(|(i, s)| {
            let seen = s.fixed[camera].ok().filter(|f| !f.saturated || f.signal_to_noise > 10.0)?;
            let depth = (s.point?.point.rho - low) / (high - low).max(1e-9);
            Some((i, Vector3::new(seen.x, seen.y, 0.0) / f64::from(width) + Vector3::z() * (0.5 * depth)))
        })
        .collect();
    if places.len() < super::MIN_SHOTS {
        return Err(Error::TooFewPoints { given: places.len(), needed: super::MIN_SHOTS });
    }
    // The farthest from all chosen so far, again and again; the first is the farthest from the middle.
    let middle = places.iter().map(|(_, p)| p).sum::<Vector3<f64>>() / places.len() as f64;
    let mut gap: Vec<f64> = places.iter().map(|(_, p)| (p - middle).norm()).collect();
    let mut chosen = Vec::new();
    while chosen.len() < count.min(places.len()) {
        let next = (0..places.len()).max_by(|a, b| gap[*a].total_cmp(&gap[*b]).then(b.cmp(a))).unwrap_or(0);
        chosen.push(places[next].0);
        for (g, (_, p)) in gap.iter_mut().zip(&places) {
            let distance = (p - places[next].1).norm();
            *g = if chosen.len() == 1 { distance } else { g.min(distance) };
        }
        gap[next] = f64::NEG_INFINITY;
    }
    chosen.sort_unstable();
    Ok(chosen)
}

/// The shots of one scan with those of a later one at the same readings; the others, and those that were
/// not seen by both cameras the first time, are left out.
///
/// # Errors
/// `InvalidArgument` for a camera that was not watched, and a zoom that is not the same.
pub fn pair_shots(before: &Scan, again: &Scan, camera: usize) -> Result<Vec<HealthShot>> {
    for scan in [before, again] {
        if camera >= scan.fixed_sizes.len() {
            return Err(Error::invalid("camera", format!("{camera} of {}", scan.fixed_sizes.len())));
        }
    }
    let zooms = before.shots.iter().chain(&again.shots).map(|s| s.zoom);
    let (low, high) = zooms.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(z), h.max(z)));
    if high - low > 1e-3 {
        return Err(Error::invalid("shots", format!("taken at zooms from {low} to {high}")));
    }
    let pair = |s: &crate::rig::Shot| {
        let (head, fixed) = (spot(s.head.as_ref().ok()?), spot(s.fixed[camera].as_ref().ok()?));
        let apart = |a: &&crate::rig::Shot| (a.pan - s.pan).abs().max((a.tilt - s.tilt).abs());
        let nearest = again.shots.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
        let same = nearest.filter(|a| apart(a) < SAME_READING)?;
        Some(HealthShot {
            pan: s.pan,
            tilt: s.tilt,
            head,
            fixed,
            head_again: same.head.as_ref().ok().map(spot),
            fixed_again: same.fixed[camera].as_ref().ok().map(spot),
        })
    };
    Ok(before.shots.iter().filter_map(pair).collect())
}

/// A shot that is seen again, prepared.
pub(super) struct Pair {
    pub pan: f64,
    pub tilt: f64,
    /// The laser's ray in the world.
    pub origin: Vector3<f64>,
    pub direction: Vector3<f64>,
    /// The best inverse depth of before, and the head camera's of now with its variance.
    pub rho: f64,
    pub rho_again: f64,
    pub variance_again: f64,
    /// The fixed camera's pixel of now less that of before, the inverse square root of its covariance.
    pub shift: Vector2<f64>,
    pub covariance: Matrix2<f64>,
    pub white: Matrix2<f64>,
    /// Derivatives of the fixed camera's pixel by its rotation and centre.
    pub by_pose: SMatrix<f64, 2, 6>,
    /// The head camera's spot of now less that of before, with its covariance.
    pub head_shift: Vector2<f64>,
    pub head_covariance: Matrix2<f64>,
}

impl Pair {
    /// `None` when it is not seen again, or its point has no depth before the camera.
    pub fn new(rig: &RigModel, camera: &Camera, shot: &HealthShot, options: &HealthOptions) -> Option<Self> {
        let (head_again, fixed_again) = (shot.head_again?, shot.fixed_again?);
        let before = rig.measure(shot.pan, shot.tilt, &shot.head.pixel, &shot.head.covariance).ok()?.point;
        let again = rig.measure(shot.pan, shot.tilt, &head_again.pixel, &head_again.covariance).ok()?.point;
        let station = &options.station;
        let origin = station.apply(&before.origin);
        let direction = station.rotation * before.direction;
        let rho = fused_depth(camera, &origin, &direction, before.rho, before.variance, &shot.fixed)?;
        let point = origin + direction / rho;
        let seen = camera.project_with_jacobian(&point)?;
        // The head's rest moves the spot in the fixed camera's picture, twice.
        let ray = rig.laser_ray(shot.pan, shot.tilt, [0.0; 2]);
        let scales = [rig.encoders.pan_scale, rig.encoders.tilt_scale];
        let mut rest = Matrix2::zeros();
        let mut depth_rest = 0.0;
        for ((by, scale), sigma) in [ray.by_pan, ray.by_tilt].iter().zip(scales).zip(options.pointing_sigma) {
            let moved = seen.by_point * (station.rotation * (by[0] + by[1] / rho)) * (scale * sigma);
            rest += moved * moved.transpose() * 2.0;
            depth_rest += 2.0 * (STEEPEST * rho * scale * sigma).powi(2);
        }
        let along = seen.by_point * (-direction / (rho * rho));
        rest += along * along.transpose() * depth_rest;
        let covariance = shot.fixed.covariance + fixed_again.covariance + rest;
        let white = covariance.cholesky()?.l().try_inverse()?;
        let by_rho = rig.spot_image(rho)?.by_rho;
        let mut by_pose = SMatrix::<f64, 2, 6>::zeros();
        by_pose.fixed_view_mut::<2, 3>(0, 0).copy_from(&seen.by_rotation);
        by_pose.fixed_view_mut::<2, 3>(0, 3).copy_from(&seen.by_centre);
        Some(Self {
            pan: shot.pan,
            tilt: shot.tilt,
            origin,
            direction,
            rho,
            rho_again: again.rho,
            variance_again: again.variance,
            shift: fixed_again.pixel - shot.fixed.pixel,
            covariance,
            white,
            by_pose,
            head_shift: head_again.pixel - shot.head.pixel,
            head_covariance: shot.head.covariance + head_again.covariance + by_rho * by_rho.transpose() * depth_rest,
        })
    }

    /// Probability that the head camera's spot is as far from where it was, by noise.
    pub fn depth_probability(&self) -> f64 {
        upper_tail(self.depth_chi_square(), 2.0)
    }

    pub fn depth_chi_square(&self) -> f64 {
        let inverse = self.head_covariance.try_inverse().unwrap_or_else(Matrix2::zeros);
        self.head_shift.dot(&(inverse * self.head_shift))
    }

    pub fn pixel_chi_square(&self) -> f64 {
        (self.white * self.shift).norm_squared()
    }
}

/// A shot's inverse depth from the head camera's and from where the fixed camera saw it.
fn fused_depth(
    camera: &Camera,
    origin: &Vector3<f64>,
    direction: &Vector3<f64>,
    measured: f64,
    variance: f64,
    seen: &Spot,
) -> Option<f64> {
    let weight = (seen.covariance + Matrix2::identity() * (MODEL_SIGMA * MODEL_SIGMA)).try_inverse()?;
    let mut rho = measured;
    for _ in 0..5 {
        let p = camera.project_homogeneous(&(origin * rho + direction), rho)?;
        let by_rho = p.by_point * origin + p.by_weight;
        let information = 1.0 / variance + by_rho.dot(&(weight * by_rho));
        let gradient = (measured - rho) / variance + by_rho.dot(&(weight * (seen.pixel - p.pixel)));
        rho += gradient / information;
    }
    (rho.is_finite() && rho > 1e-6).then_some(rho)
}
