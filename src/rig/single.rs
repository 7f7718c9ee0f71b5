//! Single shots, wherever they are wanted: with all of a scan's care for laser and head, without its
//! order.

use std::ops::ControlFlow;

use super::acquire::FixedCamera;
use super::gate::head_band;
use super::region::ScanRegion;
use super::scan::{ScanOptions, Scanner, check_fixed, guarded, nothing_yet};
use super::shot::{Scan, ScanEnd, Shot};
use super::{Rig, check_reach};
use crate::error::{Error, Result};

/// Says where the next shot is to be; `None`: enough.
pub(super) type Next<'a> = dyn FnMut(&[Shot]) -> Option<(f64, f64)> + 'a;

/// How far single shots are.
#[derive(Debug)]
pub struct ShotProgress<'a> {
    /// Shots taken.
    pub done: usize,
    /// As many as there will be, or at most.
    pub total: usize,
    /// The newest.
    pub shot: Option<&'a Shot>,
}

/// Fires one shot at each of some readings (pan and tilt, radians): for a check of what an earlier scan
/// measured there. Journal, recording and coarse pass of the options do not matter. Shot i has index i.
///
/// However it ends, the laser is off and the head is told to stop; [`Scan::end`] says how.
///
/// # Errors
/// Only before anything moves, as [`scan_region`](super::scan_region).
pub fn fire_shots(
    rig: &mut Rig,
    readings: &[(f64, f64)],
    options: &ScanOptions,
    fixed: &mut [FixedCamera],
    progress: &mut dyn FnMut(&ShotProgress<'_>) -> ControlFlow<()>,
) -> Result<Scan> {
    if readings.is_empty() {
        return Err(Error::invalid("readings", "none"));
    }
    readings.iter().try_for_each(|(pan, tilt)| check_reach(&rig.capabilities, *pan, *tilt))?;
    fire(rig, options, fixed, readings.len(), &mut |shots| readings.get(shots.len()).copied(), progress)
}

/// Fires shots where `next` says, `total` at most.
pub(super) fn fire(
    rig: &mut Rig,
    options: &ScanOptions,
    fixed: &mut [FixedCamera],
    total: usize,
    next: &mut Next<'_>,
    progress: &mut dyn FnMut(&ShotProgress<'_>) -> ControlFlow<()>,
) -> Result<Scan> {
    options.validate()?;
    check_fixed(fixed)?;
    let head_band = head_band(&rig.model, &options.gate)?;
    let scan = nothing_yet(here(0.0, 0.0), &rig.model, fixed);
    let mut scan = guarded(rig, fixed, options, head_band, scan, |scanner| run(scanner, total, next, progress));
    scan.region = around(&scan.shots);
    Ok(scan)
}

fn run(
    scanner: &mut Scanner<'_>,
    total: usize,
    next: &mut Next<'_>,
    progress: &mut dyn FnMut(&ShotProgress<'_>) -> ControlFlow<()>,
) -> Result<ScanEnd> {
    loop {
        let shots = &scanner.scan.shots;
        let report = ShotProgress { done: shots.len(), total, shot: shots.last() };
        if progress(&report).is_break() {
            return Ok(ScanEnd::Stopped);
        }
        let Some((pan, tilt)) = next(shots).filter(|_| shots.len() < total) else {
            return Ok(ScanEnd::Complete);
        };
        let index = shots.len() as u32;
        scanner.scan.region = here(pan, tilt);
        let shot = scanner.take(0)?;
        scanner.scan.shots.push(Shot { index, ..shot });
    }
}

/// A region of one position.
fn here(pan: f64, tilt: f64) -> ScanRegion {
    ScanRegion { pan: [pan, pan], tilt: [tilt, tilt], pan_steps: 1, tilt_steps: 1 }
}

/// The least region about shots.
fn around(shots: &[Shot]) -> ScanRegion {
    let range = |angle: fn(&Shot) -> f64| {
        let ends = shots.iter().map(angle);
        ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)])
    };
    match shots {
        [] => here(0.0, 0.0),
        _ => {
            ScanRegion { pan: range(|s| s.pan), tilt: range(|s| s.tilt), pan_steps: shots.len() as u32, tilt_steps: 1 }
        }
    }
}
