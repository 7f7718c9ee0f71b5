//! Health check: stored shots fired again say whether a fixed camera still is where it was calibrated.
//!
//! The same readings of the head put the laser's spot onto the same place, unless the scene there has
//! changed (the head camera sees another depth) or the rig has moved. Where the spot is the same, the
//! fixed camera's pixel is too, but for noise, and all that a calibration has wrong cancels in the
//! difference. A chi-square test in the six directions that a camera can move says "unchanged" with a
//! false alarm rate that is chosen; what it rejects is explained by a moved camera, a moved rig, or not
//! at all.

mod explain;
mod fit;
mod shots;

use nalgebra::{Matrix6, SMatrix, Vector2, Vector6};

use crate::calibrate::Calibration;
use crate::error::{Error, Result};
use crate::geometry::chi_square::upper_tail;
use crate::geometry::{RigModel, Rigid};
use explain::{Explained, Explainer};
use shots::Pair;
pub use shots::{HealthShot, Spot, choose_shots, pair_shots};

/// Fewest shots that both cameras see again: below, six unknowns leave nothing to test with.
pub const MIN_SHOTS: usize = 4;
/// Most shots of a check.
pub const MAX_SHOTS: usize = 10_000;

/// How a check decides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HealthOptions {
    /// Probability of not saying "unchanged" when nothing has changed.
    pub false_alarm: f64,
    /// Standard deviations of where the head comes to rest about its readings, pan and tilt, radians.
    pub pointing_sigma: [f64; 2],
    /// Where the rig stands: its frame to the camera's world.
    pub station: Rigid,
}

impl Default for HealthOptions {
    fn default() -> Self {
        Self { false_alarm: 0.01, pointing_sigma: [1e-4; 2], station: Rigid::identity() }
    }
}

/// What a check says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Verdict {
    Unchanged = 0,
    /// The fixed camera was turned or moved; its pose is refitted.
    CameraMoved = 1,
    /// The rig was moved, its head has lost its zero, or its laser has moved on the head.
    RigMoved = 2,
    /// Too few spots, or nothing explains them, or more than one thing does.
    CannotTell = 3,
}

/// What became of a shot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ShotState {
    /// Its spots were used.
    Used = 0,
    /// The head camera, the fixed camera or both do not see its spot again.
    NotSeen = 1,
    /// The laser meets something else there now: the head camera sees another depth.
    SceneChanged = 2,
    /// The fixed camera's spot contradicts all others.
    Outlier = 3,
}

/// The head's zero that explains the spots.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadShift {
    /// Added to the true pan and tilt, radians.
    pub angles: Vector2<f64>,
    /// rad^2.
    pub covariance: SMatrix<f64, 2, 2>,
}

/// The answer of a check.
#[derive(Debug, Clone)]
pub struct HealthReport {
    pub verdict: Verdict,
    /// In words.
    pub reason: String,
    /// The test of "unchanged": chi-square with `freedom` degrees of freedom when nothing has changed.
    /// `None`: too few spots.
    pub statistic: Option<Statistic>,
    /// One for each shot.
    pub shots: Vec<ShotState>,
    /// The camera with its pose refitted and its lens held, of a camera that has moved. Of a rig that
    /// was moved as a whole: the camera in the rig's new frame.
    pub refitted: Option<Calibration>,
    /// What the refit turned and moved the camera by: rotation w in `R <- exp([w]x) R` (radians, camera
    /// axes) and centre (metres, world), with its covariance.
    pub change: Option<(Vector6<f64>, Matrix6<f64>)>,
    /// Of a head that has lost its zero.
    pub head_shift: Option<HeadShift>,
}

/// A test statistic.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Statistic {
    pub chi_square: f64,
    pub freedom: f64,
    /// Of a statistic as large or larger, were nothing changed.
    pub probability: f64,
}

impl Statistic {
    fn new(chi_square: f64, freedom: f64) -> Self {
        Self { chi_square, freedom, probability: upper_tail(chi_square, freedom) }
    }
}

/// Part of the false alarms that is left to spots which scatter without a move.
const SCATTER_PART: f64 = 0.1;
/// Below this probability a shot's depth has changed, or its pixel is an outlier.
const ODD_SHOT: f64 = 1e-3;
const ODD_PIXEL: f64 = 1e-4;
/// Part of the shots that may be outliers.
const MOST_OUTLIERS: f64 = 0.25;
/// Part of the shots beyond which it is no longer the scene that has changed but the rig.
const MANY_CHANGED: f64 = 1.0 / 3.0;

/// Compares shots with what the same readings gave before.
///
/// # Errors
/// Only for input that makes no sense: `InvalidArgument`, `NotFinite`. What cannot be told is a verdict.
pub fn check_health(
    rig: &RigModel,
    calibration: &Calibration,
    shots: &[HealthShot],
    options: &HealthOptions,
) -> Result<HealthReport> {
    options.validate()?;
    rig.validate()?;
    calibration.camera.validate()?;
    if shots.len() > MAX_SHOTS {
        return Err(Error::invalid("shots", format!("{}, at most {MAX_SHOTS}", shots.len())));
    }
    let parameters = 11 + calibration.camera.distortion.coefficients().len();
    if calibration.covariance.shape() != (parameters, parameters) {
        return Err(Error::invalid("camera covariance", format!("{parameters} x {parameters} expected")));
    }
    shots.iter().enumerate().try_for_each(|(i, s)| s.validate(i))?;
    let pairs: Vec<Option<Pair>> = shots.iter().map(|s| Pair::new(rig, &calibration.camera, s, options)).collect();
    let mut states: Vec<ShotState> = pairs
        .iter()
        .map(|p| match p {
            None => ShotState::NotSeen,
            Some(p) if p.depth_probability() < ODD_SHOT => ShotState::SceneChanged,
            Some(_) => ShotState::Used,
        })
        .collect();
    let seen: Vec<&Pair> = pairs.iter().flatten().collect();
    let mut report = HealthReport {
        verdict: Verdict::CannotTell,
        reason: String::new(),
        statistic: None,
        shots: Vec::new(),
        refitted: None,
        change: None,
        head_shift: None,
    };
    if seen.len() < MIN_SHOTS {
        report.reason =
            format!("{} of {} spots are seen again by both cameras, {MIN_SHOTS} are needed", seen.len(), shots.len());
        report.shots = states;
        return Ok(report);
    }
    let changed = states.iter().filter(|s| **s == ShotState::SceneChanged).count();
    let explainer = Explainer { rig, calibration, options };
    let test = test_unchanged(&pairs, &mut states, options);
    report.statistic = test.as_ref().map(|t| t.statistic);
    match test {
        Some(t) if t.unchanged => {
            report.verdict = Verdict::Unchanged;
            report.reason = "the spots are where they were".into();
            if changed > 0 {
                report.reason = format!("the spots are where they were; the scene has changed at {changed} of them");
            }
        }
        Some(t) if !t.moved => {
            report.reason = "the spots scatter more than their covariances say, and no move explains it".into();
        }
        _ => {
            // Each depth may pass for noise where all of them together do not.
            let steady = || pairs.iter().zip(&states).filter(|(_, s)| **s == ShotState::Used);
            let sum: f64 = steady().filter_map(|(p, _)| Some(p.as_ref()?.depth_chi_square())).sum();
            let elsewhere = upper_tail(sum, 2.0 * steady().count() as f64) < ODD_SHOT;
            let many = elsewhere || changed as f64 > MANY_CHANGED * seen.len() as f64;
            explainer.explain(&pairs, &mut states, many, &mut report)?;
        }
    }
    report.shots = states;
    Ok(report)
}

/// The test of "unchanged".
struct Test {
    statistic: Statistic,
    unchanged: bool,
    /// It is a move of the camera that the spots show.
    moved: bool,
}

/// Tests the shots whose depth is the same; marks outliers when the others then are unchanged. `None`
/// for too few of them.
fn test_unchanged(pairs: &[Option<Pair>], states: &mut [ShotState], options: &HealthOptions) -> Option<Test> {
    let used = |states: &[ShotState]| -> Vec<&Pair> {
        let both = pairs.iter().zip(states).filter(|(_, s)| **s == ShotState::Used);
        both.filter_map(|(p, _)| p.as_ref()).collect()
    };
    let steady = used(states);
    let first = test(&steady, options)?;
    if first.unchanged {
        return Some(first);
    }
    let mut without = states.to_vec();
    for (state, pair) in without.iter_mut().zip(pairs) {
        let odd = pair.as_ref().is_some_and(|p| upper_tail(p.pixel_chi_square(), 2.0) < ODD_PIXEL);
        if *state == ShotState::Used && odd {
            *state = ShotState::Outlier;
        }
    }
    let rest = used(&without);
    if steady.len() - rest.len() <= (MOST_OUTLIERS * steady.len() as f64) as usize
        && let Some(second) = test(&rest, options).filter(|t| t.unchanged)
    {
        states.copy_from_slice(&without);
        return Some(second);
    }
    Some(first)
}

fn test(pairs: &[&Pair], options: &HealthOptions) -> Option<Test> {
    if pairs.len() < MIN_SHOTS {
        return None;
    }
    let (mut h, mut g, mut total) = (Matrix6::zeros(), Vector6::zeros(), 0.0);
    for p in pairs {
        let j = p.white * p.by_pose;
        let e = p.white * p.shift;
        h += j.transpose() * j;
        g += j.transpose() * e;
        total += e.norm_squared();
    }
    let (explained, rank) = fit::quadratic_gain(&h, &g)?;
    let statistic = Statistic::new(explained, rank as f64);
    let rest = Statistic::new((total - explained).max(0.0), (2 * pairs.len() - rank) as f64);
    let moved = statistic.probability < (1.0 - SCATTER_PART) * options.false_alarm;
    let scattered = rest.probability < SCATTER_PART * options.false_alarm;
    Some(Test { statistic, unchanged: !moved && !scattered, moved })
}

impl HealthOptions {
    fn validate(&self) -> Result<()> {
        if !(self.false_alarm > 0.0 && self.false_alarm < 0.5) {
            return Err(Error::invalid("false_alarm", format!("{} is not between 0 and 0.5", self.false_alarm)));
        }
        if self.pointing_sigma.iter().any(|s| !(0.0..=0.1).contains(s)) {
            return Err(Error::invalid("pointing_sigma", format!("{:?} rad", self.pointing_sigma)));
        }
        if !self.station.is_finite() || crate::geometry::rigid::rotation_defect(&self.station.rotation) > 1e-6 {
            return Err(Error::invalid("station", "not a pose"));
        }
        Ok(())
    }
}

impl From<Explained> for (Vector6<f64>, Matrix6<f64>) {
    fn from(e: Explained) -> Self {
        (e.change, e.covariance)
    }
}
