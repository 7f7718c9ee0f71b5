//! Next best shots: where to point the laser so that the fixed camera's position becomes surer.

use std::collections::BTreeSet;

use super::greedy::{Candidate, choose};
use super::information::{Accuracy, NoiseLevel, Unknowns};
use super::probe::{Knowledge, Probe, best_probe};
use super::run::MAX_NOISE;
use super::setup::Site;
use super::surroundings::Surroundings;
use crate::error::{Error, Result};
use crate::rig::ScanRegion;

/// Most candidates, and most scanned shots.
pub const MAX_CANDIDATES: usize = 100_000;

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
    /// Stop where the position's expected rms error is below this, metres; 0: never. How many shots are
    /// left until then decides whether a look at an unknown place is worth one.
    pub target: f64,
}

/// The answer.
#[derive(Debug, Clone, PartialEq)]
pub struct NextShots {
    /// Of what is scanned already; infinite while that does not determine the camera.
    pub now: Accuracy,
    /// In the order of their value, a look at a place of which little is known before all others.
    pub shots: Vec<NextShot>,
}

/// Chooses shots by the information of the joint adjustment: of camera, free rig parameters and priors of
/// `site`, whose camera is the best estimate so far. Depths at the candidates are predicted from those
/// that are scanned; only positions that both cameras have in view count, and their information counts
/// by the share of neighbours in view that the fixed camera did see.
///
/// With a target the first shot is a look at an unknown place when that is expected to save several
/// shots; all others are chosen greedily. Depths and hidden places are known the better the more is
/// scanned: fewest shots are needed when it is asked after every one.
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
    let (mut places, mut candidates): (Vec<(f64, f64, f64)>, Vec<Candidate>) = scanned
        .iter()
        .filter(|s| s.seen && first(s.pan, s.tilt))
        .filter(inside)
        .filter_map(|s| {
            let rows = unknowns.rows(s.pan, s.tilt, s.depth, &options.level)?;
            Some(((s.pan, s.tilt, s.depth), Candidate { rows, again: true }))
        })
        .unzip();
    let known = candidates.len();
    // What was not seen once is not shot at again.
    scanned.iter().filter(|s| !s.seen).for_each(|s| {
        first(s.pan, s.tilt);
    });
    let positions = (0..options.candidates.len() as u32).map(|i| options.candidates.position(i));
    let fresh: Vec<(f64, f64)> = positions.filter(|(pan, tilt)| first(*pan, *tilt)).collect();
    for &(pan, tilt) in &fresh {
        let Some((depth, chance)) = surroundings.expect(site, pan, tilt) else { continue };
        if chance > 0.0 && site.shot(pan, tilt, depth).is_some() {
            // The expected information: chance times that of a shot that is seen.
            if let Some(rows) = unknowns.rows(pan, tilt, depth, &options.level) {
                places.push((pan, tilt, depth));
                candidates.push(Candidate { rows: rows * chance.sqrt(), again: false });
            }
        }
    }
    let knowledge = Knowledge {
        unknowns: &unknowns,
        surroundings: &surroundings,
        level: &options.level,
        information: &h,
        seen,
        target: options.target,
    };
    // Without a target there is no telling how often a place would be repeated.
    let wanted = options.target > 0.0 && now.rms > options.target;
    let probe = if wanted { best_probe(&knowledge, &candidates[..known], fresh.into_iter())? } else { None };
    let mut looked_at = Vec::new();
    if let Some(Probe { pan, tilt, depth, candidate }) = probe {
        match places.iter().skip(known).position(|(p, t, _)| *p == pan && *t == tilt) {
            Some(i) => {
                (places[known + i], candidates[known + i]) = ((pan, tilt, depth), candidate);
                looked_at.push(known + i);
            }
            None => {
                looked_at.push(places.len());
                places.push((pan, tilt, depth));
                candidates.push(candidate);
            }
        }
    }
    if places.is_empty() {
        return Err(Error::NotFound { reason: "the fixed camera is expected to see none of the candidates".into() });
    }
    let chosen = choose(&unknowns, &h, seen, &candidates, &looked_at, |chosen, accuracy| {
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
