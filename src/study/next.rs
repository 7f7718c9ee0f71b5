//! Next best shots: where to point the laser so that the fixed camera's position becomes surer.

use std::collections::BTreeSet;

use nalgebra::Vector3;

use super::greedy::{Candidate, choose};
use super::information::{Accuracy, NoiseLevel, Unknowns};
use super::run::MAX_NOISE;
use super::setup::Site;
use crate::error::{Error, Result};
use crate::rig::ScanRegion;

/// Most candidates, and most scanned shots.
pub const MAX_CANDIDATES: usize = 100_000;
/// Of more scanned shots than these, evenly chosen ones predict depths.
const PREDICTORS: usize = 4096;
const NEIGHBOURS: usize = 6;

/// A shot that was taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScannedShot {
    /// The device's readings, radians.
    pub pan: f64,
    pub tilt: f64,
    /// Measured along the head camera's axis, metres.
    pub depth: f64,
    /// Did the fixed camera see its spot? One that it did not see still tells of the depths there, and
    /// that something stands in between.
    pub seen: bool,
}

/// A shot to take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NextShot {
    pub pan: f64,
    pub tilt: f64,
    /// Depth that is expected there, metres.
    pub depth: f64,
    /// Expected accuracy of the fixed camera's position after this shot and all before it.
    pub after: Accuracy,
}

#[derive(Debug, Clone, PartialEq)]
pub struct NextOptions {
    /// Positions to choose from, besides those that are scanned already. Each is taken once before its
    /// depth is known; one that the fixed camera saw may be shot again and again.
    pub candidates: ScanRegion,
    /// Noise of a spot.
    pub level: NoiseLevel,
    /// How many to choose at most.
    pub count: usize,
    /// Stop where the position's expected rms error is below this, metres; 0: never.
    pub target: f64,
}

/// The answer.
#[derive(Debug, Clone, PartialEq)]
pub struct NextShots {
    /// Of what is scanned already; infinite while that does not determine the camera.
    pub now: Accuracy,
    /// In the order of their value.
    pub shots: Vec<NextShot>,
}

/// Chooses shots by the information of the joint adjustment: of camera, free rig parameters and priors of
/// `site`, whose camera is the best estimate so far. Depths at the candidates are predicted from those
/// that are scanned; only positions that both cameras have in view count, and their information counts
/// by the share of neighbours in view that the fixed camera did see.
///
/// Depths and hidden places are known the better the more is scanned: ask again after every few dozen shots.
///
/// # Errors
/// `InvalidArgument`, `NotFinite`; `TooFewPoints` without a scanned shot to predict depths from;
/// `NotFound` when the fixed camera is expected to see none of the candidates; `Degenerate`.
pub fn next_shots(site: &Site, scanned: &[ScannedShot], options: &NextOptions) -> Result<NextShots> {
    site.validate()?;
    options.candidates.validate()?;
    check_level(&options.level)?;
    check_scanned(scanned)?;
    if options.candidates.len() > MAX_CANDIDATES {
        let detail = format!("{} positions; {MAX_CANDIDATES} are possible", options.candidates.len());
        return Err(Error::invalid("candidates", detail));
    }
    if options.count == 0 {
        return Err(Error::invalid("count", "none are asked for"));
    }
    if !(options.target.is_finite() && options.target >= 0.0) {
        return Err(Error::invalid("target", format!("{} m", options.target)));
    }
    let surroundings = Surroundings::new(site, scanned);
    let unknowns = Unknowns::of(site)?;
    let mut h = unknowns.priors();
    let mut seen = 0;
    for s in scanned.iter().filter(|s| s.seen) {
        if let Some(rows) = unknowns.rows(s.pan, s.tilt, s.depth, &options.level) {
            unknowns.add(&mut h, &rows);
            seen += 1;
        }
    }
    let now = unknowns.covariance(&h).and_then(|c| unknowns.accuracy(&c));
    let now = now.unwrap_or(Accuracy { rms: f64::INFINITY, semi_axis: f64::INFINITY });
    let ScanRegion { pan, tilt, .. } = options.candidates;
    let inside = |s: &&ScannedShot| (pan[0]..=pan[1]).contains(&s.pan) && (tilt[0]..=tilt[1]).contains(&s.tilt);
    let mut taken = BTreeSet::new();
    let mut first = |pan: f64, tilt: f64| taken.insert([pan.to_bits(), tilt.to_bits()]);
    let known: Vec<_> = scanned
        .iter()
        .filter(|s| s.seen && first(s.pan, s.tilt))
        .filter(inside)
        .filter_map(|s| {
            let rows = unknowns.rows(s.pan, s.tilt, s.depth, &options.level)?;
            Some(((s.pan, s.tilt, s.depth), Candidate { rows, again: true }))
        })
        .collect();
    let positions = (0..options.candidates.len() as u32).map(|i| options.candidates.position(i));
    let fresh = positions.filter(|(pan, tilt)| first(*pan, *tilt)).filter_map(|(pan, tilt)| {
        let (depth, chance) = surroundings.expect(site, pan, tilt)?;
        site.shot(pan, tilt, depth).filter(|_| chance > 0.0)?;
        // The expected information: chance times that of a shot that is seen.
        let rows = unknowns.rows(pan, tilt, depth, &options.level)? * chance.sqrt();
        Some(((pan, tilt, depth), Candidate { rows, again: false }))
    });
    let (places, candidates): (Vec<(f64, f64, f64)>, Vec<_>) = known.into_iter().chain(fresh).unzip();
    if places.is_empty() {
        return Err(Error::NotFound { reason: "the fixed camera is expected to see none of the candidates".into() });
    }
    let chosen = choose(&unknowns, &h, seen, &candidates, |chosen, accuracy| {
        Ok(chosen.len() >= options.count || accuracy.rms <= options.target)
    })?;
    let shot = |c: super::greedy::Chosen| {
        let (pan, tilt, depth) = places[c.candidate];
        NextShot { pan, tilt, depth, after: c.after }
    };
    Ok(NextShots { now, shots: chosen.into_iter().map(shot).collect() })
}

pub(super) fn check_level(level: &NoiseLevel) -> Result<()> {
    for (name, s) in [("head noise", level.head), ("fixed noise", level.fixed)] {
        if !s.is_finite() {
            return Err(Error::NotFinite { name, index: 0 });
        }
        if !(s > 0.0 && s <= MAX_NOISE) {
            return Err(Error::invalid(name, format!("{s} px")));
        }
    }
    Ok(())
}

fn check_scanned(scanned: &[ScannedShot]) -> Result<()> {
    if scanned.is_empty() {
        return Err(Error::TooFewPoints { given: 0, needed: 1 });
    }
    if scanned.len() > MAX_CANDIDATES {
        return Err(Error::invalid("scanned", format!("{} shots; {MAX_CANDIDATES} are possible", scanned.len())));
    }
    for (index, s) in scanned.iter().enumerate() {
        if [s.pan, s.tilt, s.depth].iter().any(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name: "scanned", index });
        }
        if s.depth <= 0.0 {
            return Err(Error::invalid("scanned", format!("shot {index} has a depth of {} m", s.depth)));
        }
    }
    Ok(())
}

/// The surroundings as far as they are scanned.
struct Surroundings {
    found: Vec<Found>,
}

struct Found {
    /// Of the laser, unit length.
    direction: Vector3<f64>,
    rho: f64,
    /// Was it seen? `None` where it could not: it is out of the fixed camera's view.
    seen: Option<bool>,
}

impl Surroundings {
    fn new(site: &Site, scanned: &[ScannedShot]) -> Self {
        let every = scanned.len().div_ceil(PREDICTORS);
        let found = |s: &ScannedShot| Found {
            direction: direction(site, s.pan, s.tilt),
            rho: 1.0 / s.depth,
            seen: (s.seen || site.shot(s.pan, s.tilt, s.depth).is_some()).then_some(s.seen),
        };
        Self { found: scanned.iter().step_by(every).map(found).collect() }
    }

    /// Depth at a position, and the chance that the fixed camera sees a spot there: the share of the
    /// neighbours that were not hidden and whose depth is in view here.
    ///
    /// The depth is that of the plane through the nearest neighbours, whose inverse depth is linear in
    /// the direction, kept between the least and the greatest among them.
    fn expect(&self, site: &Site, pan: f64, tilt: f64) -> Option<(f64, f64)> {
        let d = direction(site, pan, tilt);
        let mut near: Vec<(f64, usize)> =
            self.found.iter().enumerate().map(|(i, f)| ((f.direction - d).norm_squared(), i)).collect();
        let count = NEIGHBOURS.min(near.len());
        near.select_nth_unstable_by(count - 1, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.truncate(count);
        let reach = near.iter().map(|(squared, _)| squared).sum::<f64>() / count as f64;
        // rho = slope.(f - d) + rho0, the slope held to zero where neighbours leave it open.
        let (mut h, mut g) = (nalgebra::Matrix4::zeros(), nalgebra::Vector4::zeros());
        let (mut least, mut greatest) = (f64::INFINITY, 0.0f64);
        let (mut all, mut saw) = (0.0, 0.0);
        for (squared, i) in &near {
            let found = &self.found[*i];
            let row = (found.direction - d).push(1.0);
            let weight = 1.0 / (squared + 0.01 * reach + 1e-12);
            h += row * row.transpose() * weight;
            g += row * (found.rho * weight);
            (least, greatest) = (least.min(found.rho), greatest.max(found.rho));
            all += weight;
            if found.seen != Some(false) && site.shot(pan, tilt, 1.0 / found.rho).is_some() {
                saw += weight;
            }
        }
        let ridge = 1e-6 * h.trace();
        (0..3).for_each(|i| h[(i, i)] += ridge);
        let rho = h.cholesky()?.solve(&g).w.clamp(least, greatest);
        Some((1.0 / rho, saw / all))
    }
}

fn direction(site: &Site, pan: f64, tilt: f64) -> Vector3<f64> {
    site.rig.laser_in_world(pan, tilt).1.normalize()
}
