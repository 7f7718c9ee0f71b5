//! Exploring: where, of all that the head can reach, a fixed camera sees the laser's spot.
//!
//! A wide lattice of shots, made denser until every camera has seen some. Then, for each camera in turn,
//! the shot whose outcome is the most doubtful (active learning of a level set): the rim of what is
//! visible becomes dense, and nothing else does.

use std::ops::ControlFlow;

use super::acquire::FixedCamera;
use super::level_set::LevelSet;
use super::region::ScanRegion;
use super::scan::ScanOptions;
use super::shot::{Scan, ScanEnd, Shot};
use super::single::{ShotProgress, fire};
use super::{Rig, check_reach};
use crate::error::{Error, Result};

/// Widest distances of the first lattice's shots, pan and tilt, radians.
const FIRST_SPACING: [f64; 2] = [0.61, 0.31];
/// Sightings of a camera before what is about them is looked at.
const ENOUGH: usize = 2;
/// How the head's reach is explored.
#[derive(Debug, Clone)]
pub struct ExploreOptions {
    /// Least and greatest readings to look at, radians; the head's reach is the limit.
    pub pan: [f64; 2],
    pub tilt: [f64; 2],
    /// Shots are no nearer to each other than this, 0.01 to 1 radians.
    pub tolerance: f64,
    /// Most shots, 4 to 500.
    pub max_shots: usize,
    /// Steps of the regions that come out, radians.
    pub spacing: f64,
    /// How each shot is taken; journal, recording and coarse pass do not matter.
    pub scan: ScanOptions,
}

impl Default for ExploreOptions {
    fn default() -> Self {
        Self {
            pan: [f64::NEG_INFINITY, f64::INFINITY],
            tilt: [f64::NEG_INFINITY, f64::INFINITY],
            tolerance: 2.5f64.to_radians(),
            max_shots: 59,
            spacing: 1f64.to_radians(),
            scan: ScanOptions::default(),
        }
    }
}

/// Where a fixed camera sees the spot.
#[derive(Debug, Clone, PartialEq)]
pub struct Visible {
    /// The range, with the steps asked for: ready for [`scan_region`](super::scan_region).
    pub region: ScanRegion,
    /// For each position of the region, row by row: does the camera see the spot there, as far as the
    /// shots about it tell?
    pub mask: Vec<bool>,
    /// Part of the mask that is seen.
    pub share: f64,
    /// Shots that the camera saw, and of them those that the head camera saw too.
    pub seen: usize,
    pub measured: usize,
}

/// What exploring came to.
#[derive(Debug, Clone)]
pub struct Explored {
    /// One for each fixed camera; why there is none (`NotFound`).
    pub cameras: Vec<Result<Visible>>,
    /// All shots, and how it ended.
    pub scan: Scan,
}

/// Finds the range of pan and tilt in which each fixed camera sees the laser's spot.
///
/// # Errors
/// Before anything moves: arguments that make no sense, limits that the head cannot reach. `NotFound`
/// when no camera saw a spot in a complete search. What ends early (stopped, cancelled, a device) is
/// `Ok`, with what was found until then; [`Scan::end`] says why.
pub fn explore(
    rig: &mut Rig,
    options: &ExploreOptions,
    fixed: &mut [FixedCamera],
    progress: &mut dyn FnMut(&ShotProgress<'_>) -> ControlFlow<()>,
) -> Result<Explored> {
    let limits = options.limits(rig)?;
    if fixed.is_empty() {
        return Err(Error::invalid("fixed cameras", "none: nobody to see the spot"));
    }
    let mut search = Search::new(limits, options, fixed.len());
    let scan = fire(rig, &options.scan, fixed, options.max_shots, &mut |shots| search.next(shots), progress)?;
    let mut found = |camera| search.visible(&scan.shots, camera, options);
    let cameras: Vec<Result<Visible>> = (0..fixed.len()).map(&mut found).collect();
    let none = cameras.iter().all(Result::is_err);
    if none && scan.end == ScanEnd::Complete {
        let head = scan.counts().head;
        let reason = format!(
            "no fixed camera saw the laser's spot in {} shots over pan {:.0} to {:.0}, tilt {:.0} to {:.0} deg (the head camera saw {head}): \
             check the laser, exposure and where the cameras look",
            scan.shots.len(),
            limits[0][0].to_degrees(),
            limits[0][1].to_degrees(),
            limits[1][0].to_degrees(),
            limits[1][1].to_degrees(),
        );
        return Err(Error::NotFound { reason });
    }
    Ok(Explored { cameras, scan })
}

impl ExploreOptions {
    fn limits(&self, rig: &Rig) -> Result<[[f64; 2]; 2]> {
        let reach = [rig.capabilities.pan_range, rig.capabilities.tilt_range];
        let mut limits = [[0.0; 2]; 2];
        for (i, (name, wanted)) in [("explore.pan", self.pan), ("explore.tilt", self.tilt)].into_iter().enumerate() {
            if let Some(index) = wanted.iter().position(|v| v.is_nan()) {
                return Err(Error::NotFinite { name, index });
            }
            limits[i] = [wanted[0].max(reach[i][0]), wanted[1].min(reach[i][1])];
            if !limits[i].iter().all(|v| v.is_finite()) {
                return Err(Error::invalid(name, "the head's reach is not known: give limits"));
            }
            if wanted[0] >= wanted[1] || limits[i][0] >= limits[i][1] {
                let [low, high] = reach[i];
                let reason =
                    format!("{wanted:?} rad, the head reaches {low:.3} to {high:.3}: least first, within that");
                return Err(Error::invalid(name, reason));
            }
        }
        check_reach(&rig.capabilities, limits[0][0], limits[1][0])?;
        for (name, value, least) in
            [("explore.tolerance", self.tolerance, 0.01), ("explore.spacing", self.spacing, 1e-3)]
        {
            if !(least..=1.0).contains(&value) {
                return Err(Error::invalid(name, format!("{value} rad is not in [{least}, 1]")));
            }
        }
        if !(4..=500).contains(&self.max_shots) {
            return Err(Error::invalid("explore.max_shots", format!("{} is not in [4, 500]", self.max_shots)));
        }
        Ok(limits)
    }
}

/// The state of a search.
struct Search {
    limits: [[f64; 2]; 2],
    tolerance: f64,
    most: usize,
    cameras: usize,
    /// Cells of the lattice in pan and tilt, and its positions that are still to come.
    cells: [usize; 2],
    waiting: Vec<[f64; 2]>,
    /// Where each camera sees the spot, from the shots so far.
    field: LevelSet,
}

/// `count` places from end to end of a range.
fn spread([low, high]: [f64; 2], count: usize) -> impl Iterator<Item = f64> + Clone {
    (0..count).map(move |i| low + (high - low) * i as f64 / (count - 1).max(1) as f64)
}

/// Steps of at most `spacing` from end to end of a range, both ends counted.
fn steps([low, high]: [f64; 2], spacing: f64) -> usize {
    ((high - low) / spacing).ceil() as usize + 1
}

impl Search {
    fn new(limits: [[f64; 2]; 2], options: &ExploreOptions, cameras: usize) -> Self {
        let cells = [0, 1].map(|i| (((limits[i][1] - limits[i][0]) / FIRST_SPACING[i]).ceil() as usize).max(2));
        let [pans, tilts] = limits.map(|range| spread(range, steps(range, options.tolerance)));
        let candidates = tilts.flat_map(|tilt| pans.clone().map(move |pan| [pan, tilt]));
        let mut search = Self {
            limits,
            tolerance: options.tolerance,
            most: options.max_shots,
            cameras,
            cells,
            waiting: Vec::new(),
            field: LevelSet::new(cameras, candidates),
        };
        search.waiting = search.lattice(0.5);
        search
    }

    /// The middles (offset 0.5) or the inner corners (0) of the lattice's cells, walked to and fro; the
    /// next is the last.
    fn lattice(&self, offset: f64) -> Vec<[f64; 2]> {
        let at = |axis: usize, i: usize| {
            let [low, high] = self.limits[axis];
            low + (high - low) * (i as f64 + offset) / self.cells[axis] as f64
        };
        let first = usize::from(offset == 0.0);
        let mut all = Vec::new();
        for row in first..self.cells[1] {
            let columns = (first..self.cells[0]).map(|c| [at(0, c), at(1, row)]);
            if row % 2 == 0 { all.extend(columns) } else { all.extend(columns.rev()) }
        }
        all
    }

    /// Takes in the shots that are new.
    fn learn(&mut self, shots: &[Shot]) {
        for shot in shots.iter().skip(self.field.len()) {
            self.field.add([shot.pan, shot.tilt], shot.fixed.iter().map(|f| f.is_ok()));
        }
    }

    /// Where the next shot is to be.
    fn next(&mut self, shots: &[Shot]) -> Option<(f64, f64)> {
        self.learn(shots);
        if let Some([pan, tilt]) = self.waiting.pop() {
            return Some((pan, tilt));
        }
        let seen = |camera: usize| shots.iter().filter(|s| s.fixed[camera].is_ok()).count();
        let wanting = (0..self.cameras).any(|c| seen(c) < ENOUGH);
        let corners = (self.cells[0] - 1) * (self.cells[1] - 1);
        if wanting && shots.len() + corners <= self.most {
            self.waiting = self.lattice(0.0);
            // The corners and the middles together are the middles' lattice turned by 45 degrees; half
            // as large cells have corners between them.
            self.cells = self.cells.map(|c| 2 * c);
            return self.next(shots);
        }
        // Each camera in its turn; when nothing is in doubt of it, the others.
        let doubtful = |i| self.field.most_doubtful((shots.len() + i) % self.cameras, self.tolerance);
        (0..self.cameras).find_map(doubtful).map(|[pan, tilt]| (pan, tilt))
    }

    /// The range in which a camera sees the spot.
    fn visible(&mut self, shots: &[Shot], camera: usize, options: &ExploreOptions) -> Result<Visible> {
        self.learn(shots);
        let seen: Vec<&Shot> = shots.iter().filter(|s| s.fixed[camera].is_ok()).collect();
        let Some(first) = seen.first() else {
            let reason = format!("fixed camera {camera} saw the laser's spot in none of {} shots", shots.len());
            return Err(Error::NotFound { reason });
        };
        let sees = self.field.rule(camera);
        // Around all that is seen, half a step wider.
        let mut ranges = [[first.pan; 2], [first.tilt; 2]];
        let [pans, tilts] = self.limits.map(|range| spread(range, steps(range, options.spacing)));
        let places = tilts.flat_map(|tilt| pans.clone().map(move |pan| [pan, tilt]));
        for at in places.filter(|at| sees(*at)) {
            for (range, value) in ranges.iter_mut().zip(at) {
                *range = [range[0].min(value), range[1].max(value)];
            }
        }
        let half = 0.5 * options.spacing;
        let widened = |axis: usize| {
            let ([low, high], [least, most]) = (ranges[axis], self.limits[axis]);
            [(low - half).max(least), (high + half).min(most)]
        };
        let (pan, tilt) = (widened(0), widened(1));
        let count = |range| steps(range, options.spacing) as u32;
        let region = ScanRegion { pan, tilt, pan_steps: count(pan), tilt_steps: count(tilt) };
        let position = |i| {
            let (pan, tilt) = region.position(i);
            sees([pan, tilt])
        };
        let mask: Vec<bool> = (0..region.len() as u32).map(position).collect();
        Ok(Visible {
            share: mask.iter().filter(|m| **m).count() as f64 / mask.len() as f64,
            region,
            mask,
            seen: seen.len(),
            measured: seen.iter().filter(|s| s.point.is_some()).count(),
        })
    }
}
