//! The calibration as a whole: gates, consensus, refinement, outliers set aside, verdict.

use nalgebra::{DMatrix, Vector2};

use super::check;
use super::consensus::{CHI2_MEDIAN, ENOUGH};
use super::freedom::{ALL, Freedom};
use super::measurement::Measurement;
use super::refine::{CONVERGED, PROVISIONAL, Refined, Refinement};
use super::residuals::{distances, residuals};
use super::spread::{self, Noise};
use super::start::{Search, Start};
use super::{Calibration, CalibrationOptions, Correspondences, DistortionModel, Observation};
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::{Camera, Intrinsics};

/// Squared Mahalanobis distance beyond which a point is an outlier: a chance of 1 in 1000.
pub(super) const OUTLIER: f64 = 13.8;
/// Residuals above this part of the image's diagonal mean that nothing was calibrated.
pub(super) const MAX_RMS: f64 = 0.02;
/// Noise when nobody said: only its ratio to the estimate matters.
pub(super) const ASSUMED_SIGMA: f64 = 1.0;
pub(super) const MAX_ROUNDS: usize = 20;

/// Calibrates one camera from its 2D-3D set: closed form by consensus, then maximum likelihood.
///
/// Laser shots enter with one unknown inverse depth each, points with a covariance by their
/// propagated noise, exact points as they are (maths.md sections 3 and 9).
///
/// # Errors
/// `TooFewPoints`, `Degenerate` (with what to add), `NoConsensus`, `NoConvergence`,
/// `LensNotMonotone`, `BehindCamera` (only when not robust), `InvalidArgument`, `Cancelled`.
pub fn calibrate_camera(set: &Correspondences, options: &CalibrationOptions) -> Result<Calibration> {
    validate(options)?;
    let freedom = Freedom::of(options);
    // Two equations a point; a pose alone starts from four points in a plane or six in space.
    let minimum = if options.fixed_lens.is_some() { 4 } else { super::dlt::MIN_POINTS };
    let needed = minimum.max(freedom.count().div_ceil(2));
    if set.len() < needed {
        return Err(Error::TooFewPoints { given: set.len(), needed });
    }
    let sigma = options.pixel_sigma.unwrap_or(ASSUMED_SIGMA);
    let (mut shots, mut exact) = (false, true);
    let measurement = |o| {
        let m = Measurement::new(o, sigma, options.pixel_sigma.is_none());
        shots |= matches!(o, Observation::Shot { .. });
        exact &= m.is_exact();
        m
    };
    let measurements: Vec<Measurement> = set.observations().iter().map(measurement).collect();
    let known = options.fixed_lens.is_some();
    let all: Vec<&Measurement> = measurements.iter().collect();
    let planar = spread::check(&all, known, needed, Noise::Ignored)?;
    check_image(set, &measurements)?;

    let search = Search {
        width: set.width(),
        height: set.height(),
        model: options.distortion,
        robust: options.robust,
        whole: false,
        seed: options.seed,
        cancel: &options.cancel,
    };
    let fitter =
        Fitter { measurements: &measurements, all: &all, freedom: &freedom, options, needed, robust: options.robust };
    let mut fitted = fitter.fit(&search, planar);
    if options.robust && fitted.as_ref().map_or_else(is_geometry, |f| !fitter.supports(f)) {
        // Too few points to tell outliers from the rest: all of them, if they make a camera at all.
        let every = Fitter { robust: false, ..fitter };
        let plain = every.fit(&Search { robust: false, ..search }, planar);
        fitted = match (plain, fitted) {
            (Err(Error::Cancelled), _) => Err(Error::Cancelled),
            (Ok(plain), _) => Ok(plain),
            (Err(_), Ok(f)) => Err(Error::NoConsensus { inliers: f.count(), total: measurements.len() }),
            (Err(_), Err(e)) => Err(e),
        };
    }
    let fitted = fitted.map_err(|e| {
        // A fit that fails on points without relief fails because of that.
        if is_geometry(&e) { spread::check(&all, known, needed, Noise::Counted).err().unwrap_or(e) } else { e }
    })?;
    // Again without the outliers, which can lend relief to a plane, and with what noise there is.
    if !(exact && fitted.inliers.iter().all(|i| *i)) {
        spread::check(fitted.refinement.measurements(), known, needed, Noise::Counted)?;
    }
    verdict(set, &measurements, shots, options, &freedom, fitted)
}

fn is_geometry(e: &Error) -> bool {
    matches!(e, Error::NoConvergence { .. } | Error::Degenerate { .. } | Error::NoConsensus { .. })
}

/// Could this be a camera at all? Far outside it a better start is looked for.
pub(super) fn plausible(camera: &Camera) -> bool {
    let k = &camera.intrinsics;
    let (w, h) = (camera.width as f64, camera.height as f64);
    let ratio = k.fx / k.fy;
    (0.8..1.25).contains(&ratio)
        && (0.1..50.0).contains(&(k.fx / w))
        && (-0.5..1.5).contains(&(k.cx / w))
        && (-0.5..1.5).contains(&(k.cy / h))
}

fn better(a: &Fitted<'_>, b: &Fitted<'_>) -> bool {
    (plausible(&a.refined.camera), a.count()) > (plausible(&b.refined.camera), b.count())
}

pub(super) fn validate(options: &CalibrationOptions) -> Result<()> {
    let sigma = |name, value: f64| {
        if value.is_nan() || value < 0.0 {
            Err(Error::invalid(name, format!("{value} is no standard deviation")))
        } else {
            Ok(())
        }
    };
    sigma("skew_sigma", options.skew_sigma)?;
    sigma("aspect_sigma", options.aspect_sigma)?;
    sigma("max_focal_deviation", options.max_focal_deviation)?;
    if let Some(s) = options.pixel_sigma
        && !(s.is_finite() && s > 0.0)
    {
        return Err(Error::invalid("pixel_sigma", format!("{s} is not positive")));
    }
    if options.max_iterations == 0 {
        return Err(Error::invalid("max_iterations", "0"));
    }
    if let Some((k, d)) = &options.fixed_lens {
        let camera =
            Camera { width: 1, height: 1, intrinsics: *k, distortion: *d, pose: crate::geometry::Rigid::identity() };
        camera.validate()?;
    }
    Ok(())
}

/// The image points must cover some of the image, and belong to it at all.
fn check_image(set: &Correspondences, measurements: &[Measurement]) -> Result<()> {
    let (w, h) = (set.width() as f64, set.height() as f64);
    let (mut low, mut high) = (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY));
    let (mut inside, mut count) = (0, 0);
    for m in measurements.iter().flat_map(|m| m.pixels()) {
        (low, high) = (low.inf(m), high.sup(m));
        inside += usize::from(m.x > -0.5 * w && m.x < 1.5 * w && m.y > -0.5 * h && m.y < 1.5 * h);
        count += 1;
    }
    let extent = (high - low).norm();
    if extent < 1e-3 * w.hypot(h) {
        let detail = format!("the image points span {extent:.3} px");
        return Err(Error::degenerate(Degeneracy::ImageCollapsed, detail));
    }
    if inside * 2 < count {
        return Err(Error::invalid("uv", format!("most image points lie far outside the {w} x {h} image")));
    }
    Ok(())
}

struct Fitted<'a> {
    refinement: Refinement<'a>,
    refined: Refined,
    inliers: Vec<bool>,
    noise_factor: f64,
}

impl Fitted<'_> {
    /// Measurements used.
    fn count(&self) -> usize {
        self.inliers.iter().filter(|i| **i).count()
    }
}

#[derive(Clone, Copy)]
struct Fitter<'a> {
    measurements: &'a [Measurement],
    all: &'a [&'a Measurement],
    freedom: &'a Freedom,
    options: &'a CalibrationOptions,
    needed: usize,
    /// Are outliers set aside?
    robust: bool,
}

impl<'a> Fitter<'a> {
    /// Does what was used outweigh what was set aside? Of a handful of points some can always be left
    /// out so that the rest fit: their equations beyond the unknowns must be half as many again.
    fn supports(&self, fitted: &Fitted<'_>) -> bool {
        let used = fitted.count();
        let redundant = (2 * used).saturating_sub(self.freedom.count());
        2 * redundant >= 3 * (self.measurements.len() - used)
    }

    fn fit(&self, search: &Search<'_>, planar: bool) -> Result<Fitted<'a>> {
        match &self.options.fixed_lens {
            Some(lens) => search.pose(self.all, lens, planar).and_then(|s| self.run(s)),
            None => self.best_of(search),
        }
    }

    /// From the closed forms, the likeliest first; a start that does not lead to a camera gives way to
    /// the next one, guessed focal lengths come last.
    fn best_of(&self, search: &Search<'_>) -> Result<Fitted<'a>> {
        let mut best: Option<Result<Fitted<'a>>> = None;
        // True when what there is needs no other start.
        let mut attempt = |start: Result<Start>| -> Result<bool> {
            let other = start.and_then(|s| self.run(s));
            if let Err(Error::Cancelled) = other {
                return Err(Error::Cancelled);
            }
            // Of errors the first is the likeliest start's.
            let wins = match (&other, &best) {
                (_, None) | (Ok(_), Some(Err(_))) => true,
                (Ok(other), Some(Ok(best))) => better(other, best),
                (Err(_), Some(_)) => false,
            };
            if wins {
                best = Some(other);
            }
            Ok(matches!(&best, Some(Ok(f)) if plausible(&f.refined.camera)))
        };
        let mut done = false;
        if self.options.distortion != DistortionModel::None {
            match search.radial(self.all) {
                Ok(starts) => {
                    for start in starts {
                        done = done || attempt(Ok(start))?;
                    }
                }
                // Lines with few points start from the pinhole camera.
                Err(Error::TooFewPoints { .. }) => {}
                Err(e) => done = attempt(Err(e))?,
            }
        }
        done = done || attempt(search.projection(self.all))?;
        if self.all.len() > ENOUGH {
            done = done || attempt(Search { robust: false, whole: true, ..*search }.projection(self.all))?;
        }
        if !done {
            for guess in search.guesses(self.all) {
                attempt(Ok(guess))?;
            }
        }
        best.unwrap_or_else(|| Err(Error::Internal { reason: "no start was tried".into() }))
    }

    /// Refines and sets outliers aside in turn until the set stands still.
    fn run(&self, start: Start) -> Result<Fitted<'a>> {
        let mut camera = start.camera;
        let mut factor = self.floor(start.noise_factor);
        let mut inliers = self.classify(&distances(self.measurements, &camera), factor)?;
        self.force(&mut camera.intrinsics);
        let mut refinement = Refinement::new(self.select(&inliers), camera, self.freedom, factor)?;
        let rounds = if self.robust { MAX_ROUNDS } else { 0 };
        if !self.robust {
            self.minimise(&mut refinement, PROVISIONAL)?;
            refinement.set_noise(factor)?;
        }
        for round in 0..rounds {
            self.minimise(&mut refinement, PROVISIONAL)?;
            let distances = distances(self.measurements, &refinement.camera);
            factor = self.floor(self.noise_factor(&distances, &inliers));
            let next = self.classify(&distances, factor)?;
            if next == inliers {
                refinement.set_noise(factor)?;
                // The first rounds bring in the lens; then a set that stands still is final.
                if round > 0 {
                    break;
                }
            } else {
                inliers = next;
                refinement = Refinement::new(self.select(&inliers), refinement.camera, self.freedom, factor)?;
            }
        }
        self.finish(refinement, inliers, factor)
    }

    /// What a prior of no width forces is not among the refinement's unknowns: it begins forced.
    fn force(&self, intrinsics: &mut Intrinsics) {
        if self.options.fixed_lens.is_none() {
            if self.options.skew_sigma == 0.0 {
                intrinsics.skew = 0.0;
            }
            if self.options.aspect_sigma == 0.0 {
                let f = (intrinsics.fx * intrinsics.fy).sqrt();
                (intrinsics.fx, intrinsics.fy) = (f, f);
            }
        }
    }

    /// The last refinement, at the noise that its own residuals show.
    fn finish(&self, mut refinement: Refinement<'a>, inliers: Vec<bool>, factor: f64) -> Result<Fitted<'a>> {
        self.minimise(&mut refinement, CONVERGED)?;
        let used = refinement.measurements();
        let freedom = (2 * used.len()).saturating_sub(self.freedom.count());
        let spread = if freedom > 0 { (refinement.chi2() / freedom as f64).sqrt() } else { 1.0 };
        let assumed = used.iter().any(|m| m.assumed_noise());
        let mut noise_factor = spread;
        if assumed {
            noise_factor = self.floor(factor * spread);
            refinement.set_noise(noise_factor)?;
            self.minimise(&mut refinement, CONVERGED)?;
        }
        let mut refined = refinement.refined()?;
        if !assumed && spread > significant(freedom) {
            // Known noises that the residuals contradict: the covariance says what the data show.
            refined.covariance *= spread * spread;
            refined.focal_deviation *= spread;
        }
        Ok(Fitted { refinement, refined, inliers, noise_factor })
    }

    fn minimise(&self, refinement: &mut Refinement<'a>, tolerance: f64) -> Result<()> {
        refinement.minimise(tolerance, self.options.max_iterations, &self.options.cancel)
    }

    fn select(&self, mask: &[bool]) -> Vec<&'a Measurement> {
        self.all.iter().zip(mask).filter(|(_, used)| **used).map(|(m, _)| *m).collect()
    }

    /// Noise from the median distance of the inliers, in units of the assumed one.
    fn noise_factor(&self, distances: &[f64], inliers: &[bool]) -> f64 {
        let mut d: Vec<f64> = distances.iter().zip(inliers).filter(|(_, i)| **i).map(|(d, _)| *d).collect();
        let rank = ((d.len() + self.needed) / 2).min(d.len() - 1);
        (*d.select_nth_unstable_by(rank, f64::total_cmp).1 / CHI2_MEDIAN).sqrt()
    }

    /// A stated noise is never taken for smaller; an assumed one has no floor but rounding.
    fn floor(&self, factor: f64) -> f64 {
        let stated = !self.measurements.iter().any(|m| m.assumed_noise());
        factor.max(if stated { 1.0 } else { 1e-6 })
    }

    fn classify(&self, distances: &[f64], factor: f64) -> Result<Vec<bool>> {
        let limit = if self.robust { OUTLIER * factor * factor } else { f64::MAX };
        let mask: Vec<bool> = distances.iter().map(|d| *d <= limit).collect();
        if !self.robust
            && let Some(index) = mask.iter().position(|i| !i)
        {
            return Err(Error::BehindCamera { index });
        }
        let count = mask.iter().filter(|i| **i).count();
        let total = mask.len();
        if count < self.needed || count * 5 < total * 2 {
            return Err(Error::NoConsensus { inliers: count, total });
        }
        Ok(mask)
    }
}

/// Ratio of observed to stated noise that chance exceeds once in 1000 (normal approximation).
pub(super) fn significant(freedom: usize) -> f64 {
    1.0 + 3.1 / (2.0 * freedom.max(1) as f64).sqrt()
}

/// The last gates, and the answer.
fn verdict(
    set: &Correspondences,
    measurements: &[Measurement],
    shots: bool,
    options: &CalibrationOptions,
    freedom: &Freedom,
    fitted: Fitted<'_>,
) -> Result<Calibration> {
    let Fitted { refinement, refined, inliers, noise_factor } = fitted;
    let camera = refined.camera;
    let residuals = residuals(measurements, &camera);
    let used = inliers.iter().filter(|i| **i).count();
    let sum: f64 = residuals.iter().zip(&inliers).filter(|(_, i)| **i).map(|(r, _)| r.norm_squared()).sum();
    let rms = (sum / used as f64).sqrt();
    let diagonal = (set.width() as f64).hypot(set.height() as f64);
    // Shots carry their own depth noise into the residual; points must simply fit.
    if !shots && rms > MAX_RMS * diagonal {
        return Err(Error::NoConsensus { inliers: 0, total: measurements.len() });
    }
    if options.fixed_lens.is_none() {
        let deviation = refined.focal_deviation;
        if deviation.is_nan() || deviation > options.max_focal_deviation {
            let detail = format!(
                "the focal length is determined to {:.1} % only (limit {:.1} %)",
                100.0 * deviation,
                100.0 * options.max_focal_deviation
            );
            return Err(Error::degenerate(Degeneracy::NoRelief, detail));
        }
        camera.check_lens()?;
    }
    let check = check::check(&refinement, &refined, freedom, options.distortion);
    let covariance = compact(&refined.covariance, camera.distortion.coefficients().len());
    Ok(Calibration {
        camera,
        covariance,
        residuals,
        inliers,
        rms,
        noise_factor,
        condition: refined.condition,
        iterations: refined.iterations,
        check,
    })
}

/// Leaves out the distortion coefficients that the model does not have.
fn compact(full: &DMatrix<f64>, coefficients: usize) -> DMatrix<f64> {
    let kept: Vec<usize> = (0..5 + coefficients).chain(10..ALL).collect();
    DMatrix::from_fn(kept.len(), kept.len(), |i, j| full[(kept[i], kept[j])])
}
