//! Exploring: where, of all that the head can reach, a fixed camera sees the laser's spot.
//!
//! A wide lattice of shots, made denser until every camera has seen some; then each side of each
//! camera's range is narrowed down: of the rows (or columns) through what was seen, only those that can
//! still reach beyond the farthest seen so far are tried, halfway to the next miss.

use std::ops::ControlFlow;

use super::acquire::FixedCamera;
use super::region::ScanRegion;
use super::scan::ScanOptions;
use super::shot::{Scan, ScanEnd, Shot};
use super::single::{ShotProgress, fire};
use super::{Rig, check_reach};
use crate::error::{Error, Result};

/// Widest distances of the first lattice's shots, pan and tilt, radians.
const FIRST_SPACING: [f64; 2] = [0.7, 0.44];
/// Sightings of a camera before its sides are looked for.
const ENOUGH: usize = 3;
/// What is seen, or not, in one row is taken for as much in rows nearer than this, in parts of the
/// lattice's spacing: the rim of what a camera sees has no teeth.
const SAME_ROW: f64 = 0.5;

/// How the head's reach is explored.
#[derive(Debug, Clone)]
pub struct ExploreOptions {
    /// Least and greatest readings to look at, radians; the head's reach is the limit.
    pub pan: [f64; 2],
    pub tilt: [f64; 2],
    /// To which the range is found, radians.
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
            max_shots: 60,
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
                let reason = format!("{wanted:?} rad, the head reaches {low:.3} to {high:.3}: least first, within that");
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

/// A side of a camera's range that may be farther out.
struct Bracket {
    at: [f64; 2],
    width: f64,
}

impl Search {
    fn new(limits: [[f64; 2]; 2], options: &ExploreOptions, cameras: usize) -> Self {
        let cells = [0, 1].map(|i| (((limits[i][1] - limits[i][0]) / FIRST_SPACING[i]).ceil() as usize).max(2));
        let mut search = Self {
            limits,
            tolerance: options.tolerance,
            most: options.max_shots,
            cameras,
            cells,
            waiting: Vec::new(),
        };
        search.waiting = search.lattice(0.5);
        search
    }

    /// The middles (offset 0.5) or the inner corners (0) of the lattice's cells, walked to and fro.
    fn lattice(&self, offset: f64) -> Vec<[f64; 2]> {
        let at = |axis: usize, i: usize| {
            let [low, high] = self.limits[axis];
            low + (high - low) * (i as f64 + offset) / self.cells[axis] as f64
        };
        let first = usize::from(offset == 0.0);
        let mut all = Vec::new();
        for row in first..self.cells[1] {
            let mut columns: Vec<[f64; 2]> = (first..self.cells[0]).map(|c| [at(0, c), at(1, row)]).collect();
            if row % 2 == 0 {
                columns.reverse();
            }
            all.extend(columns);
        }
        // Taken from the end.
        all.reverse();
        all
    }

    fn spacing(&self, axis: usize) -> f64 {
        (self.limits[axis][1] - self.limits[axis][0]) / self.cells[axis] as f64
    }

    /// Where the next shot is to be.
    fn next(&mut self, shots: &[Shot]) -> Option<(f64, f64)> {
        if let Some([pan, tilt]) = self.waiting.pop() {
            return Some((pan, tilt));
        }
        let wanting = (0..self.cameras).any(|c| shots.iter().filter(|s| s.fixed[c].is_ok()).count() < ENOUGH);
        // Half of the shots at most go into a lattice.
        let corners = (self.cells[0] - 1) * (self.cells[1] - 1);
        if wanting && shots.len() + corners <= self.most / 2 {
            self.waiting = self.lattice(0.0);
            // The middles of cells half as large are the corners' and the middles' next neighbours.
            self.cells = self.cells.map(|c| 2 * c);
            return self.next(shots);
        }
        let brackets = (0..self.cameras).flat_map(|c| (0..4).filter_map(move |side| Some((c, side))));
        let widest = brackets
            .filter_map(|(camera, side)| self.bracket(shots, camera, side / 2, side % 2 == 1))
            .filter(|b| b.width > self.tolerance)
            .max_by(|a, b| a.width.total_cmp(&b.width))?;
        Some((widest.at[0], widest.at[1]))
    }

    /// The row that can reach farthest beyond what is seen on a side, and where to try it.
    fn bracket(&self, shots: &[Shot], camera: usize, axis: usize, high: bool) -> Option<Bracket> {
        let sign = if high { 1.0 } else { -1.0 };
        let limit = sign * self.limits[axis][usize::from(high)];
        let place = |s: &Shot| [s.pan, s.tilt];
        let out = |s: &Shot| sign * place(s)[axis];
        let row = |s: &Shot| place(s)[1 - axis];
        let seen = |s: &&Shot| s.fixed[camera].is_ok();
        let farthest = shots.iter().filter(seen).map(out).max_by(f64::total_cmp)?;
        let window = SAME_ROW * self.spacing(1 - axis).max(2.0 * self.tolerance);
        let open = shots.iter().filter(seen).filter_map(|s| {
            let beside = |m: &&Shot| (row(m) - row(s)).abs() <= window;
            let own = shots.iter().filter(seen).filter(beside).map(out).fold(out(s), f64::max);
            let miss = shots.iter().filter(|m| m.fixed[camera].is_err() && out(m) > own).filter(beside).map(out);
            let end = miss.fold(f64::INFINITY, f64::min);
            let width = end.min(limit) - farthest;
            // Where nothing was tried yet, no farther than the lattice is wide.
            let step = if end <= limit { 0.5 * width } else { width.min(0.5 * self.spacing(axis)) };
            (width > 0.0).then_some((width, farthest + step, row(s)))
        });
        let (width, to, row) = open.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let mut at = [0.0; 2];
        (at[axis], at[1 - axis]) = (sign * to, row);
        Some(Bracket { at, width })
    }

    /// The range of what a camera saw, half way to what it did not see.
    fn visible(&self, shots: &[Shot], camera: usize, options: &ExploreOptions) -> Result<Visible> {
        let seen: Vec<&Shot> = shots.iter().filter(|s| s.fixed[camera].is_ok()).collect();
        if seen.is_empty() {
            let reason = format!("fixed camera {camera} saw the laser's spot in none of {} shots", shots.len());
            return Err(Error::NotFound { reason });
        }
        let side = |axis: usize, high: bool| {
            let sign = if high { 1.0 } else { -1.0 };
            let out = |s: &&Shot| sign * [s.pan, s.tilt][axis];
            let farthest = seen.iter().map(|s| out(s)).fold(f64::NEG_INFINITY, f64::max);
            let open = self.bracket(shots, camera, axis, high).map_or(0.0, |b| b.width);
            let end = farthest + 0.5 * open.min(2.0 * self.tolerance);
            sign * end.min(sign * self.limits[axis][usize::from(high)])
        };
        let range = |axis| [side(axis, false), side(axis, true)];
        let steps = |[low, high]: [f64; 2]| ((high - low) / options.spacing).ceil() as u32 + 1;
        let (pan, tilt) = (range(0), range(1));
        let region = ScanRegion { pan, tilt, pan_steps: steps(pan), tilt_steps: steps(tilt) };
        let mask: Vec<bool> = (0..region.len() as u32)
            .map(|i| {
                let (pan, tilt) = region.position(i);
                let apart = |s: &&Shot| (s.pan - pan).hypot(s.tilt - tilt);
                let nearest = shots.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
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
}
