//! Before anyone scans: how many shots, where, for a target accuracy?

use nalgebra::DMatrix;

use super::greedy::{Candidate, choose};
use super::information::{Accuracy, NoiseLevel, Unknowns};
use super::next::{NextShot, check_level};
use super::scene::Scene;
use super::setup::{NoiselessShot, Site};
use crate::adjust::Prior;
use crate::control::Cancel;
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::{RIG_PARAMETERS, RigParameter};
use crate::rig::ScanRegion;
use crate::rig::region::MAX_POSITIONS;

/// Candidates of the chosen shots.
const CANDIDATES: usize = 8000;
/// So many shots instead of one are as good as any number: the error that they leave is 300 times less.
const ANY_NUMBER: f64 = 1e5;

#[derive(Debug, Clone)]
pub struct PlanOptions {
    /// Least and greatest pan and tilt, radians.
    pub pan: [f64; 2],
    pub tilt: [f64; 2],
    pub scene: Scene,
    /// Noise of a spot.
    pub level: NoiseLevel,
    /// Root mean square error of the fixed camera's position that is wanted, metres.
    pub target: f64,
    /// Most positions of a grid.
    pub max_positions: u32,
    pub cancel: Cancel,
}

/// How to reach the target.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The coarsest grid that reaches it: what a scan takes.
    pub grid: ScanRegion,
    /// Of its positions those that both cameras see.
    pub grid_seen: usize,
    pub grid_accuracy: Accuracy,
    /// The same by chosen shots, the most valuable first.
    pub shots: Vec<NextShot>,
    /// What any number of shots would leave: the rig's own uncertainty.
    pub limit: Accuracy,
    /// The parameter of the rig that leaves most of it.
    pub limited_by: Option<RigParameter>,
}

/// Plans a scan of a region with the rig and the guessed camera of `site`.
///
/// # Errors
/// `InvalidArgument`, `NotFinite`; `NotFound` when the camera sees nothing of the region; `Degenerate` when
/// the scene cannot determine the camera (a plane, and no lens given); `Unreachable`, with the reason,
/// when neither `max_positions` nor any number of shots reach the target; `Cancelled`.
pub fn plan(site: &Site, options: &PlanOptions) -> Result<Plan> {
    site.validate()?;
    options.scene.validate()?;
    check_level(&options.level)?;
    if !(options.target.is_finite() && options.target > 0.0) {
        return Err(Error::invalid("target", format!("{} m", options.target)));
    }
    if options.max_positions == 0 || u64::from(options.max_positions) > MAX_POSITIONS {
        let detail = format!("{}; 1 to {MAX_POSITIONS} are possible", options.max_positions);
        return Err(Error::invalid("max_positions", detail));
    }
    grid(options, 1).validate()?;
    let planner = Planner { site, options, unknowns: Unknowns::of(site)? };
    let (region, seen, accuracy) = planner.coarsest_grid()?;
    let shots = planner.choose(&region)?;
    let (limit, limited_by) = planner.limit(&seen)?;
    Ok(Plan { grid: region, grid_seen: seen.len(), grid_accuracy: accuracy, shots, limit, limited_by })
}

/// The grid with so many rows, its steps alike in pan and tilt.
fn grid(options: &PlanOptions, rows: u32) -> ScanRegion {
    let extent = |[low, high]: [f64; 2]| high - low;
    let (wide, high) = (extent(options.pan), extent(options.tilt));
    let steps = if high > 0.0 { f64::from(rows) * wide / high } else { f64::from(rows) };
    let pan_steps = if wide > 0.0 { steps.round().clamp(1.0, 1e6) as u32 } else { 1 };
    let tilt_steps = if high > 0.0 { rows } else { 1 };
    ScanRegion { pan: options.pan, tilt: options.tilt, pan_steps, tilt_steps }
}

struct Planner<'a> {
    site: &'a Site,
    options: &'a PlanOptions,
    unknowns: Unknowns<'a>,
}

impl Planner<'_> {
    /// Information of shots, beliefs left out.
    fn information(&self, unknowns: &Unknowns<'_>, shots: &[NoiselessShot]) -> DMatrix<f64> {
        let mut h = DMatrix::zeros(unknowns.count(), unknowns.count());
        for s in shots {
            if let Some(rows) = unknowns.rows(s.pan, s.tilt, s.depth, &self.options.level) {
                unknowns.add(&mut h, &rows);
            }
        }
        h
    }

    /// What a grid with so many rows sees, and how well that determines the position.
    fn look(&self, rows: u32) -> Result<(ScanRegion, Vec<NoiselessShot>, Option<Accuracy>)> {
        self.options.cancel.check()?;
        let region = grid(self.options, rows);
        let seen = self.site.scan(&region, &self.options.scene);
        let h = self.information(&self.unknowns, &seen) + self.unknowns.priors();
        let accuracy = self.unknowns.covariance(&h).and_then(|c| self.unknowns.accuracy(&c));
        Ok((region, seen, accuracy))
    }

    /// Rows are doubled until the target is met, then halved between.
    fn coarsest_grid(&self) -> Result<(ScanRegion, Vec<NoiselessShot>, Accuracy)> {
        let meets = |accuracy: &Option<Accuracy>| accuracy.is_some_and(|a| a.rms <= self.options.target);
        let fits = |rows: u32| grid(self.options, rows).len() <= self.options.max_positions as usize;
        let (mut low, mut high) = (1, 2);
        let mut best = loop {
            let found = self.look(high)?;
            if meets(&found.2) {
                break found;
            }
            low = high;
            if fits(2 * high) && grid(self.options, 2 * high) != grid(self.options, high) {
                high *= 2;
                continue;
            }
            // The finest that is allowed lies between this one and the double.
            let finest = (high..2 * high).rev().find(|rows| fits(*rows)).unwrap_or(high);
            let last = self.look(finest)?;
            if meets(&last.2) {
                high = finest;
                break last;
            }
            return Err(self.refusal(&last)?);
        };
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            let found = self.look(middle)?;
            if meets(&found.2) {
                (high, best) = (middle, found);
            } else {
                low = middle;
            }
        }
        let accuracy = best.2.ok_or_else(|| Error::Internal { reason: "a grid that meets nothing".into() })?;
        Ok((best.0, best.1, accuracy))
    }

    /// Why the finest grid does not do.
    fn refusal(&self, (region, seen, accuracy): &(ScanRegion, Vec<NoiselessShot>, Option<Accuracy>)) -> Result<Error> {
        if seen.is_empty() {
            return Ok(Error::NotFound { reason: "the fixed camera sees no spot of the region".into() });
        }
        let Some(accuracy) = accuracy else {
            let detail = "no number of shots on this scene determines the camera: it needs depth, or a known lens";
            return Ok(Error::degenerate(Degeneracy::NoRelief, detail));
        };
        let (limit, by) = self.limit(seen)?;
        let target = 1e3 * self.options.target;
        let reason = if limit.rms > self.options.target {
            let name = by.map_or("its priors", RigParameter::name);
            format!(
                "{target:.3} mm: any number of shots leaves {:.3} mm, because of what is not known of the rig ({name} above all)",
                1e3 * limit.rms
            )
        } else {
            format!(
                "{target:.3} mm: {} positions, {} of them in view, reach {:.3} mm; allow more, or scan more depths or nearer ones",
                region.len(),
                seen.len(),
                1e3 * accuracy.rms
            )
        };
        Ok(Error::Unreachable { reason })
    }

    /// What any number of such shots leaves, and the rig's parameter that would lower it most if it were known.
    fn limit(&self, shots: &[NoiselessShot]) -> Result<(Accuracy, Option<RigParameter>)> {
        let of = |unknowns: &Unknowns<'_>| {
            let h = self.information(unknowns, shots) * ANY_NUMBER + unknowns.priors();
            unknowns.covariance(&h).and_then(|c| unknowns.accuracy(&c))
        };
        let undetermined = || Error::degenerate(Degeneracy::NoRelief, "the shots do not determine the camera");
        let limit = of(&self.unknowns).ok_or_else(undetermined)?;
        let prior = self.site.rig_prior.covariance();
        let mut best = (limit.rms, None);
        for parameter in RigParameter::ALL {
            let i = parameter as usize;
            if prior[(i, i)] > 0.0 {
                let mut known = prior.clone();
                (0..RIG_PARAMETERS).for_each(|k| (known[(i, k)], known[(k, i)]) = (0.0, 0.0));
                let unknowns = Unknowns::with_rig_prior(self.site, &Prior::of_covariance(known))?;
                if let Some(accuracy) = of(&unknowns).filter(|a| a.rms < best.0) {
                    best = (accuracy.rms, Some(parameter));
                }
            }
        }
        Ok((limit, best.1))
    }

    /// The best shots of a grid a few times as fine.
    fn choose(&self, region: &ScanRegion) -> Result<Vec<NextShot>> {
        let rows = (1..).take_while(|rows| grid(self.options, *rows).len() <= CANDIDATES).last().unwrap_or(1);
        let rows = if region.len() > 1 { rows.min(4 * region.tilt_steps.max(region.pan_steps)) } else { 1 };
        let seen = self.site.scan(&grid(self.options, rows.max(region.tilt_steps)), &self.options.scene);
        let rows = |s: &NoiselessShot| self.unknowns.rows(s.pan, s.tilt, s.depth, &self.options.level);
        let (seen, candidates): (Vec<_>, Vec<_>) =
            seen.iter().filter_map(|s| Some((*s, Candidate { rows: rows(s)?, again: false }))).unzip();
        let chosen = choose(&self.unknowns, &self.unknowns.priors(), 0, &candidates, &[], |_, accuracy| {
            self.options.cancel.check()?;
            Ok(accuracy.rms <= self.options.target)
        })?;
        let shot = |c: super::greedy::Chosen| {
            let s = &seen[c.candidate];
            NextShot { pan: s.pan, tilt: s.tilt, depth: s.depth, after: c.after }
        };
        Ok(chosen.into_iter().map(shot).collect())
    }
}
