//! Exploring: where, of all that the head can reach, a fixed camera sees the laser's spot.
//!
//! A wide lattice of shots, made denser until every camera has seen some. Then, for each camera in turn,
//! the shot that is farthest from all others and yet next to what the camera has seen (farthest-point
//! sampling; Eldar and others 1997): what is visible and its rim become dense, and nothing else does.

use std::ops::ControlFlow;

use super::acquire::FixedCamera;
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
/// A shot is next to a sighting when its distance from that is at most so many times its distance from
/// the nearest shot.
const NEXT_TO: f64 = 1.3;
/// Tilt counts more than pan: pictures are wider than high.
const TILT_WEIGHT: f64 = 1.3;

/// How the head's reach is explored.
#[derive(Debug, Clone)]
pub struct ExploreOptions {
    /// Least and greatest readings to look at, radians; the head's reach is the limit.
    pub pan: [f64; 2],
    pub tilt: [f64; 2],
    /// Distance of shots that are near enough to each other, radians.
    pub tolerance: f64,
    /// Most shots.
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
    /// For each position of the region, row by row: did the camera see the spot of the shot nearest to
    /// it?
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
    let found = |camera| search.visible(&scan.shots, camera, options);
    let cameras: Vec<Result<Visible>> = (0..scan.fixed_sizes.len()).map(found).collect();
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
        for (name, value) in [("explore.tolerance", self.tolerance), ("explore.spacing", self.spacing)] {
            if !(1e-3..=1.0).contains(&value) {
                return Err(Error::invalid(name, format!("{value} rad is not in [0.001, 1]")));
            }
        }
        if !(4..=10_000).contains(&self.max_shots) {
            return Err(Error::invalid("explore.max_shots", format!("{} is not in [4, 10000]", self.max_shots)));
        }
        Ok(limits)
    }
}

/// The state of a search: nothing but the lattice; all else follows from the shots.
struct Search {
    limits: [[f64; 2]; 2],
    tolerance: f64,
    most: usize,
    cameras: usize,
    /// Cells of the lattice in pan and tilt, and its positions that are still to come.
    cells: [usize; 2],
    waiting: Vec<[f64; 2]>,
}

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(TILT_WEIGHT * (a[1] - b[1]))
}

fn place(s: &Shot) -> [f64; 2] {
    [s.pan, s.tilt]
}

impl Search {
    fn new(limits: [[f64; 2]; 2], options: &ExploreOptions, cameras: usize) -> Self {
        let cells = [0, 1].map(|i| (((limits[i][1] - limits[i][0]) / FIRST_SPACING[i]).ceil() as usize).max(2));
        let mut search =
            Self { limits, tolerance: options.tolerance, most: options.max_shots, cameras, cells, waiting: Vec::new() };
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

    /// Where the next shot is to be.
    fn next(&mut self, shots: &[Shot]) -> Option<(f64, f64)> {
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
        // Each camera in its turn; when it has enough, the others.
        (0..self.cameras).find_map(|i| self.widest_gap(shots, (shots.len() + i) % self.cameras))
    }

    /// The place farthest from all shots and next to what a camera has seen.
    fn widest_gap(&self, shots: &[Shot], camera: usize) -> Option<(f64, f64)> {
        let nearest = |at: [f64; 2], wanted: &dyn Fn(&Shot) -> bool| {
            let all = shots.iter().filter(|s| wanted(s)).map(|s| apart(place(s), at));
            all.fold(f64::INFINITY, f64::min)
        };
        let counts = [0, 1].map(|i| ((self.limits[i][1] - self.limits[i][0]) / self.tolerance).ceil() as usize + 1);
        let mut best = (self.tolerance, None);
        for i in 0..counts[0] * counts[1] {
            let at: [f64; 2] = std::array::from_fn(|axis| {
                let [low, high] = self.limits[axis];
                let k = if axis == 0 { i % counts[0] } else { i / counts[0] };
                low + (high - low) * k as f64 / (counts[axis] - 1).max(1) as f64
            });
            let gap = nearest(at, &|_| true);
            if gap > best.0 && nearest(at, &|s| s.fixed[camera].is_ok()) <= NEXT_TO * gap {
                best = (gap, Some((at[0], at[1])));
            }
        }
        best.1
    }

    /// The range of what a camera saw, half way to what it did not see.
    fn visible(&self, shots: &[Shot], camera: usize, options: &ExploreOptions) -> Result<Visible> {
        let seen: Vec<&Shot> = shots.iter().filter(|s| s.fixed[camera].is_ok()).collect();
        if seen.is_empty() {
            let reason = format!("fixed camera {camera} saw the laser's spot in none of {} shots", shots.len());
            return Err(Error::NotFound { reason });
        }
        let range = |axis: usize| {
            let mut range = [-1.0, 1.0].map(|sign| sign * self.end(shots, &seen, camera, axis, sign));
            // Of a single sighting without room about it.
            if range[0] >= range[1] {
                range = [range[1], range[0]];
            }
            range
        };
        let steps = |[low, high]: [f64; 2]| ((high - low) / options.spacing).ceil() as u32 + 1;
        let (pan, tilt) = (range(0), range(1));
        let region = ScanRegion { pan, tilt, pan_steps: steps(pan), tilt_steps: steps(tilt) };
        let mask: Vec<bool> = (0..region.len() as u32)
            .map(|i| {
                let (pan, tilt) = region.position(i);
                let from = |s: &&Shot| apart(place(s), [pan, tilt]);
                let nearest = shots.iter().min_by(|a, b| from(a).total_cmp(&from(b)));
                nearest.is_some_and(|s| s.fixed[camera].is_ok())
            })
            .collect();
        Ok(Visible {
            region,
            share: mask.iter().filter(|m| **m).count() as f64 / mask.len() as f64,
            mask,
            seen: seen.len(),
            measured: seen.iter().filter(|s| s.point.is_some()).count(),
        })
    }

    /// How far out a camera sees, along an axis times `sign`: half way from its outermost sighting to the
    /// next miss in about the same row, but no more than two tolerances.
    fn end(&self, shots: &[Shot], seen: &[&Shot], camera: usize, axis: usize, sign: f64) -> f64 {
        let out = |s: &Shot| sign * place(s)[axis];
        let limit = sign * self.limits[axis][usize::from(sign > 0.0)];
        let Some(outermost) = seen.iter().max_by(|a, b| out(a).total_cmp(&out(b))) else { return limit };
        let row = 4.0 * self.tolerance;
        let beside = |m: &&Shot| (place(m)[1 - axis] - place(outermost)[1 - axis]).abs() <= row;
        let misses = shots.iter().filter(|m| m.fixed[camera].is_err() && out(m) > out(outermost)).filter(beside);
        let next = misses.map(out).fold(limit, f64::min);
        (out(outermost) + (0.5 * (next - out(outermost))).min(2.0 * self.tolerance)).min(limit)
    }
}
