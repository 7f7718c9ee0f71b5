//! What explains spots that are not where they were: a camera that moved, a head that lost its zero, a
//! rig that was moved, or a laser that moved on the head.

use nalgebra::{DVector, Matrix2, Matrix6, Vector2, Vector3, Vector6};

use super::fit::{Minimum, minimise};
use super::shots::Pair;
use super::{HeadShift, HealthOptions, HealthReport, MIN_SHOTS, MOST_OUTLIERS, ShotState, Verdict};
use crate::calibrate::Calibration;
use crate::error::Result;
use crate::geometry::chi_square::upper_tail;
use crate::geometry::rigid::{exp, nearest_rotation};
use crate::geometry::{Camera, RigModel, Rigid};

/// An explanation fits when chance gives residuals as large with this probability or more.
const FITS: f64 = 1e-3;
/// What chi-square with 4 degrees of freedom, and with 3, exceeds with that probability.
const FOUR_MORE: f64 = 18.47;
const THREE_MORE: f64 = 16.27;
/// Steps of numerical derivatives: radians, metres.
const STEP: f64 = 1e-5;

/// What is asked about.
pub(super) struct Explainer<'a> {
    pub rig: &'a RigModel,
    pub calibration: &'a Calibration,
    pub options: &'a HealthOptions,
}

/// A camera's change with its covariance.
#[derive(Debug, Clone)]
pub(super) struct Explained {
    pub change: Vector6<f64>,
    pub covariance: Matrix6<f64>,
}

/// An explanation and how well it fits.
struct Fit {
    minimum: Minimum,
    fits: bool,
}

impl Fit {
    fn new(minimum: Minimum, shots: usize, unknowns: usize) -> Self {
        let freedom = (2 * shots).saturating_sub(unknowns) as f64;
        let fits = upper_tail(minimum.chi_square, freedom) >= FITS;
        Self { minimum, fits }
    }
}

impl Explainer<'_> {
    /// Fills in verdict, reason and what was fitted. `many`: the depth has changed at so many shots
    /// that it is the rig that sees something else.
    pub fn explain(
        &self,
        pairs: &[Option<Pair>],
        states: &mut [ShotState],
        many: bool,
        report: &mut HealthReport,
    ) -> Result<()> {
        let seen: Vec<&Pair> = pairs.iter().flatten().collect();
        let zero = self.head_zero(&seen);
        if many {
            if laser_moved(&seen) {
                report.verdict = Verdict::RigMoved;
                report.reason = "the laser's spots moved alike in the head camera: the laser moved on the head".into();
            } else if let Some(zero) = zero.filter(|z| z.fits) {
                self.say_zero(&zero.minimum, report);
            } else if let Some(fit) = self.pose(&seen, true, 6).filter(|f| f.fits) {
                report.verdict = Verdict::RigMoved;
                report.reason =
                    "the laser meets other places, and a move of the rig against the camera explains where".into();
                self.refit(&fit.minimum, report);
            } else {
                report.reason = "the laser meets other places, and no move of the rig explains where".into();
            }
            return Ok(());
        }
        let camera = self.moved_camera(pairs, states);
        let zero_fits = zero.as_ref().is_some_and(|z| z.fits);
        match (camera, zero) {
            (Some((camera, steady)), zero) if camera.fits => {
                let mut head = None;
                if let Some(zero) = zero.filter(|_| zero_fits) {
                    // Two unknowns against six: the camera has to earn the other four.
                    let both = self.head_zero(&steady);
                    let needed = both.is_none_or(|z| z.minimum.chi_square - camera.minimum.chi_square > FOUR_MORE);
                    if !needed {
                        head = Some(zero);
                    }
                }
                let Some(head) = head else {
                    report.verdict = Verdict::CameraMoved;
                    report.reason = "the camera was turned or moved; its pose is refitted".into();
                    self.refit(&camera.minimum, report);
                    return Ok(());
                };
                // A camera that is knocked turns; that it moves as the head's error would have it, no.
                let turned = self.pose(&steady, false, 3);
                if turned.is_some_and(|t| t.minimum.chi_square - camera.minimum.chi_square < THREE_MORE) {
                    report.reason =
                        "something moved, but a turned camera and a head that lost its zero explain it alike".into();
                } else {
                    self.say_zero(&head.minimum, report);
                }
            }
            (_, Some(zero)) if zero_fits => self.say_zero(&zero.minimum, report),
            _ => report.reason = "the spots moved, and neither a moved camera nor a moved head explains how".into(),
        }
        Ok(())
    }

    /// The camera's move from the shots of unchanged depth, without up to a quarter of outliers.
    fn moved_camera<'p>(&self, pairs: &'p [Option<Pair>], states: &mut [ShotState]) -> Option<(Fit, Vec<&'p Pair>)> {
        let mut used: Vec<usize> = (0..pairs.len()).filter(|i| states[*i] == ShotState::Used).collect();
        let most = (MOST_OUTLIERS * used.len() as f64) as usize;
        let of = |used: &[usize]| -> Vec<&'p Pair> { used.iter().filter_map(|i| pairs[*i].as_ref()).collect() };
        if used.len() < MIN_SHOTS {
            return None;
        }
        let first = self.pose(&of(&used), false, 6)?;
        if first.fits {
            return Some((first, of(&used)));
        }
        for _ in 0..most {
            if used.len() <= MIN_SHOTS {
                break;
            }
            // The one without which the others fit best.
            let without = |k: usize| {
                let mut rest = used.clone();
                rest.remove(k);
                self.pose(&of(&rest), false, 6).map(|f| (f, rest))
            };
            let best = (0..used.len())
                .filter_map(without)
                .min_by(|a, b| a.0.minimum.chi_square.total_cmp(&b.0.minimum.chi_square))?;
            used = best.1;
            if best.0.fits {
                for (i, state) in states.iter_mut().enumerate() {
                    if *state == ShotState::Used && !used.contains(&i) {
                        *state = ShotState::Outlier;
                    }
                }
                return Some((best.0, of(&used)));
            }
        }
        Some((first, of(&used)))
    }

    /// The camera's turn (three unknowns) or move (six). `again`: with the depths of now, which a moved
    /// rig needs.
    fn pose(&self, pairs: &[&Pair], again: bool, unknowns: usize) -> Option<Fit> {
        let camera = &self.calibration.camera;
        let residuals = |x: &[f64]| {
            let moved = moved(camera, x)?;
            whitened(pairs, |p| {
                let rho = if again { p.rho_again } else { p.rho };
                let (now, by_rho) = image(&moved, p, rho)?;
                let (before, by_before) = image(camera, p, p.rho)?;
                // What a depth has wrong, both images have; of different depths each its own.
                let (by, variance) =
                    if again { (by_rho, p.variance_again) } else { (by_rho - by_before, p.variance_again) };
                Some((p.shift - (now - before), by * by.transpose() * variance))
            })
        };
        let minimum = minimise(&[STEP; 6][..unknowns], residuals)?;
        Some(Fit::new(minimum, pairs.len(), unknowns))
    }

    /// The head's zero: the same camera sees the spots where the turned laser meets the depths of now.
    fn head_zero(&self, pairs: &[&Pair]) -> Option<Fit> {
        let camera = &self.calibration.camera;
        let station = &self.options.station;
        let residuals = |x: &[f64]| {
            whitened(pairs, |p| {
                let ray = self.rig.laser_ray(p.pan, p.tilt, [x[0], x[1]]);
                let (o, d) = (station.apply(&ray.origin), station.rotation * ray.direction);
                let seen = camera.project_homogeneous(&(o * p.rho_again + d), p.rho_again)?;
                let by = seen.by_point * o + seen.by_weight;
                let (before, _) = image(camera, p, p.rho)?;
                Some((p.shift - (seen.pixel - before), by * by.transpose() * p.variance_again))
            })
        };
        let minimum = minimise(&[STEP; 2], residuals)?;
        Some(Fit::new(minimum, pairs.len(), 2))
    }

    fn say_zero(&self, minimum: &Minimum, report: &mut HealthReport) {
        let angles = Vector2::new(minimum.x[0], minimum.x[1]);
        report.verdict = Verdict::RigMoved;
        report.reason = format!(
            "the head points {:.3} deg to the right and {:.3} deg up of where it did: it lost its zero, or the rig was turned",
            angles.x.to_degrees(),
            angles.y.to_degrees()
        );
        let covariance = Matrix2::from_fn(|i, j| minimum.covariance[(i, j)]);
        report.head_shift = Some(HeadShift { angles, covariance });
    }

    fn refit(&self, minimum: &Minimum, report: &mut HealthReport) {
        let change = Vector6::from_fn(|i, _| minimum.x[i]);
        let covariance = Matrix6::from_fn(|i, j| minimum.covariance[(i, j)]);
        let Some(camera) = moved(&self.calibration.camera, change.as_slice()) else { return };
        let mut refitted = self.calibration.clone();
        refitted.camera = camera;
        // The earlier pose's errors stay, those of the change are new.
        let first = refitted.covariance.nrows() - 6;
        let mut block = refitted.covariance.view_mut((first, first), (6, 6));
        block += covariance;
        refitted.residuals.clear();
        refitted.inliers.clear();
        report.refitted = Some(refitted);
        report.change = Some(Explained { change, covariance }.into());
    }
}

/// The camera turned by the first three numbers and, where there are more, moved by the next.
fn moved(camera: &Camera, x: &[f64]) -> Option<Camera> {
    let turn = Vector3::from_column_slice(x.get(..3)?);
    let shift = x.get(3..6).map_or_else(Vector3::zeros, Vector3::from_column_slice);
    let rotation = nearest_rotation(&(exp(&turn) * camera.pose.rotation))?;
    (turn.norm() < 3.0).then(|| Camera { pose: Rigid::from_centre(rotation, &(camera.centre() + shift)), ..*camera })
}

/// The image of a shot's point at an inverse depth, with its derivative by that.
fn image(camera: &Camera, p: &Pair, rho: f64) -> Option<(Vector2<f64>, Vector2<f64>)> {
    let seen = camera.project_homogeneous(&(p.origin * rho + p.direction), rho)?;
    Some((seen.pixel, seen.by_point * p.origin + seen.by_weight))
}

/// All shots' residuals, each whitened by its own covariance and what comes to it.
fn whitened(pairs: &[&Pair], residual: impl Fn(&Pair) -> Option<(Vector2<f64>, Matrix2<f64>)>) -> Option<DVector<f64>> {
    let mut all = DVector::zeros(2 * pairs.len());
    for (i, p) in pairs.iter().enumerate() {
        let (r, more) = residual(p)?;
        let white = (p.covariance + more).cholesky()?.l().try_inverse()? * r;
        (all[2 * i], all[2 * i + 1]) = (white.x, white.y);
    }
    all.iter().all(|v| v.is_finite()).then_some(all)
}

/// Did all spots move alike in the head camera's picture?
fn laser_moved(pairs: &[&Pair]) -> bool {
    let (mut h, mut g) = (Matrix2::zeros(), Vector2::zeros());
    let inverse = |p: &Pair| p.head_covariance.try_inverse().unwrap_or_else(Matrix2::zeros);
    for p in pairs {
        h += inverse(p);
        g += inverse(p) * p.head_shift;
    }
    let Some(common) = h.try_inverse().map(|c| c * g) else { return false };
    let square = |p: &&Pair| (p.head_shift - common).dot(&(inverse(p) * (p.head_shift - common)));
    let rest: f64 = pairs.iter().map(square).sum();
    upper_tail(rest, (2 * pairs.len() - 2) as f64) >= FITS
}
