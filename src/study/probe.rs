//! Is it worth a shot to find out what is at a place that nobody shot at?
//!
//! With all depths known greedy choice comes close to the best design of all (0.5 % more shots for NEAR, 4 %
//! for FAR): what next shots lose, they lose because the best places are not known. A place that turns out
//! better than the known ones can be repeated until the target is met, so a first look at it is worth what it
//! saves until then, not what that one spot tells: expected improvement (Mockus 1975; Jones, Schonlau
//! and Welch 1998), here of the number of shots. Since repeating known places loses nothing by waiting, looking
//! comes first. How many shots a place would save is found by exchange (Fedorov 1972): shots that are planned
//! elsewhere are moved to it, from one place or from all alike.

use nalgebra::DMatrix;

use super::greedy::{Candidate, State, choose};
use super::information::{NoiseLevel, ShotRows, Unknowns};
use super::surroundings::Surroundings;
use crate::error::Result;

/// Shots that a look must save at the least: the best guess of thousands is too good. Of 1, 3, 6 and 12, on
/// twelve simulated cameras in one room, 3 took the fewest shots; from 3 on it matters little.
const WORTH: f64 = 3.0;
/// Planned ahead at most.
const PLANNED: usize = 1000;
/// Of more positions evenly chosen ones are looked at.
const POSITIONS: usize = 4096;
/// Shares of all planned shots that a place may take over, and of those at one place.
const OF_ALL: [f64; 5] = [0.05, 0.1, 0.2, 0.3, 0.45];
const OF_ONE: [f64; 2] = [0.5, 1.0];

/// What there is when next shots are asked for.
pub struct Knowledge<'a> {
    pub unknowns: &'a Unknowns<'a>,
    pub surroundings: &'a Surroundings,
    pub level: &'a NoiseLevel,
    /// The information of what is scanned, from so many shots that were seen.
    pub information: &'a DMatrix<f64>,
    pub seen: usize,
    /// Root mean square error of the position that is wanted, metres.
    pub target: f64,
}

/// A place to look at.
pub struct Probe {
    pub pan: f64,
    pub tilt: f64,
    /// The likeliest where the spot is seen, metres.
    pub depth: f64,
    /// Its expected information.
    pub candidate: Candidate,
}

/// The position that is most worth a look, if any is; `known` are the places that can be repeated.
///
/// # Errors
/// Those of [`choose`].
pub fn best_probe(
    knowledge: &Knowledge<'_>,
    known: &[Candidate],
    positions: impl ExactSizeIterator<Item = (f64, f64)>,
) -> Result<Option<Probe>> {
    let &Knowledge { unknowns, surroundings, level, .. } = knowledge;
    let Some(exchange) = Exchange::new(knowledge, known)? else { return Ok(None) };
    let every = positions.len().div_ceil(POSITIONS).max(1);
    let mut best: Option<(f64, Probe)> = None;
    for (pan, tilt) in positions.step_by(every) {
        let (mut saving, mut chance) = (0.0, 0.0);
        let mut likeliest: Option<(f64, f64, ShotRows)> = None;
        for p in surroundings.possibilities(unknowns.site, pan, tilt) {
            let Some(rows) = unknowns.rows(pan, tilt, p.depth, level) else { continue };
            saving += p.chance * exchange.saving(&rows);
            chance += p.chance;
            if likeliest.as_ref().is_none_or(|(most, ..)| p.chance > *most) {
                likeliest = Some((p.chance, p.depth, rows));
            }
        }
        // A spot that is not seen is a shot lost.
        saving -= 1.0 - chance;
        if saving > best.as_ref().map_or(WORTH, |(most, _)| *most) {
            best = likeliest.map(|(_, depth, rows)| {
                let candidate = Candidate { rows: rows * f64::sqrt(chance), again: false };
                (saving, Probe { pan, tilt, depth, candidate })
            });
        }
    }
    Ok(best.map(|(_, probe)| probe))
}

/// The plan by known places alone, and its covariances when some of its shots are left out.
struct Exchange {
    /// Trace of the position's covariance, m^2, and by how much the best shot more would lower it.
    left: f64,
    shot: f64,
    planned: State,
    /// Shots left out, and the covariance without them.
    without: Vec<(f64, State)>,
}

impl Exchange {
    /// `None` while the known places do not determine the camera.
    fn new(knowledge: &Knowledge<'_>, known: &[Candidate]) -> Result<Option<Self>> {
        let &Knowledge { unknowns, information, seen, target, .. } = knowledge;
        if seen < unknowns.count() {
            return Ok(None);
        }
        let plan = choose(unknowns, information, seen, known, &[], |chosen, accuracy| {
            Ok(chosen.len() >= PLANNED || accuracy.rms <= target)
        })?;
        let mut counts = vec![0.0; known.len()];
        plan.iter().for_each(|c| counts[c.candidate] += 1.0);
        let shots = |place: usize, count: f64| {
            let mut h = DMatrix::zeros(unknowns.count(), unknowns.count());
            unknowns.add(&mut h, &known[place].rows);
            h * count
        };
        let state = |h: &DMatrix<f64>| unknowns.covariance(h).map(|c| State::new(&c));
        let mut planned = information.clone();
        (0..known.len()).filter(|i| counts[*i] > 0.0).for_each(|i| planned += shots(i, counts[i]));
        let mut without = Vec::new();
        for share in OF_ALL {
            let h = information * share + &planned * (1.0 - share);
            without.extend(state(&h).map(|s| (share * plan.len() as f64, s)));
        }
        for (i, share) in (0..known.len()).flat_map(|i| OF_ONE.map(|share| (i, share))) {
            if counts[i] > 0.0 {
                let count = share * counts[i];
                without.extend(state(&(&planned - shots(i, count))).map(|s| (count, s)));
            }
        }
        let Some(planned) = state(&planned) else { return Ok(None) };
        let shot = known.iter().map(|k| planned.gain(&k.rows, false)).fold(0.0, f64::max);
        Ok((shot > 0.0).then(|| Self { left: planned.trace(), shot, planned, without }))
    }

    /// Shots of the plan that a place with these equations saves when it may be repeated; of one that is not
    /// worth it what its own shot is worth less than one of the plan.
    fn saving(&self, rows: &ShotRows) -> f64 {
        let worth = self.planned.gain(rows, false) / self.shot;
        if worth <= 1.0 {
            return worth - 1.0;
        }
        let moved = |(count, state): &(f64, State)| {
            (self.left - state.trace() + state.gain(&(rows * count.sqrt()), false)) / self.shot
        };
        self.without.iter().map(moved).fold(0.0, f64::max)
    }
}
