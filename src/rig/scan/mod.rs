//! Scanning a region with the laser on and off in all cameras (thesis IV.D.8 and IV.E).
//!
//! A coarse, evenly spread subset of the positions comes first and is searched over the fixed
//! cameras' whole frames. They are calibrated with it, and for the rest the spot is only looked for
//! where the measured point must be. Spots of the coarse pass that contradict the calibration are
//! marked as missed.

mod identity;
mod knowing;
mod options;
mod shooting;

use std::ops::ControlFlow;

use self::identity::{identity, recording_info};
use self::knowing::{Watched, watch};
pub use self::options::ScanOptions;
use super::acquire::{Exposures, FixedCamera};
use super::gate::{Gate, head_band};
use super::journal::{Journal, Resumed};
use super::region::ScanRegion;
use super::shot::{Scan, ScanEnd, Shot};
use super::{Rig, RigModel};
use crate::control::LogLevel;
use crate::detect::spot::Band;
use crate::device::recording::Recorder;
use crate::error::{Error, Result};

/// Most fixed cameras of one scan.
pub const MAX_FIXED_CAMERAS: usize = 64;

/// Which pass a scan is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Phase {
    /// An evenly spread subset, searched over whole frames.
    Coarse = 1,
    /// All else, searched where the spot must be.
    Fine = 2,
}

/// How far a scan is.
#[derive(Debug)]
pub struct Progress<'a> {
    pub phase: Phase,
    /// Positions measured, those of a resumed journal included.
    pub done: usize,
    pub total: usize,
    /// The newest shot, safe in the journal; `None` at the start.
    pub shot: Option<&'a Shot>,
    /// Estimated time left; `None` before the first shot.
    pub seconds_left: Option<f64>,
}

/// Scans a region with the rig and watches any number of fixed cameras at the same time.
///
/// `progress` is called at the start and after each shot, with the laser off and the head standing;
/// `Break` stops the scan. A scan that ends early (stopped, cancelled, a device or the journal
/// failed) is still `Ok`: [`Scan::end`] says why, and nothing that was measured is lost. Called again
/// with the same journal it goes on from there. However it ends, the laser is off and the head is
/// told to stop.
///
/// # Errors
/// Only before anything moves: arguments that make no sense, a region out of the head's reach
/// (`Unreachable`), and a journal or recording that cannot be opened or belongs to something else
/// (`FileIo`, `FileFormat`, `FileVersion`, `FileMismatch`, `DiskFull`).
pub fn scan_region(
    rig: &mut Rig,
    region: &ScanRegion,
    options: &ScanOptions,
    fixed: &mut [FixedCamera],
    progress: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
) -> Result<Scan> {
    options.validate()?;
    region.validate()?;
    region.check_reach(&rig.capabilities)?;
    check_fixed(fixed)?;
    let head_band = head_band(&rig.model, &options.gate)?;
    let (mut order, coarse) = region.path(options.coarse_shots, rig.options.settle.overshoot > 0.0);
    let watches = if options.target_accuracy > 0.0 {
        spread(&mut order[coarse..]);
        fixed.iter().map(|camera| watch(&rig.model, camera, options)).collect::<Result<_>>()?
    } else {
        Vec::new()
    };

    let identity = identity(region, &rig.model, options, fixed);
    let opened = options.journal.as_ref().map(|p| Journal::open(p, &identity, region.len(), options.journal_sync));
    let (journal, mut shots, repair) = match opened.transpose()? {
        Some(Resumed { journal, shots, repair }) => (Some(journal), shots, repair),
        None => (None, Vec::new(), None),
    };
    if let Some(repair) = &repair {
        rig.log.write(LogLevel::Warning, || format!("the journal was damaged and has been mended: {repair:?}"));
    }
    shots.iter_mut().for_each(|shot| shot.locate(&rig.model));
    let recorder = options.record.as_ref().map(|folder| Recorder::open(folder, &recording_info(region, rig, fixed)));
    let recorder = recorder.transpose()?;

    let scan = Scan { resumed: shots.len(), shots, repair, ..nothing_yet(*region, &rig.model, fixed) };
    Ok(guarded(rig, fixed, options, head_band, scan, |scanner| {
        (scanner.journal, scanner.recorder, scanner.watches) = (journal, recorder, watches);
        scanner.run(&order, coarse, progress)
    }))
}

/// The cameras that are to watch shots, and their number.
pub(super) fn check_fixed(fixed: &[FixedCamera]) -> Result<()> {
    if fixed.len() > MAX_FIXED_CAMERAS {
        return Err(Error::invalid("fixed cameras", format!("{}, at most {MAX_FIXED_CAMERAS}", fixed.len())));
    }
    fixed.iter().try_for_each(FixedCamera::validate)
}

/// A scan without a shot.
pub(super) fn nothing_yet(region: ScanRegion, model: &RigModel, fixed: &[FixedCamera]) -> Scan {
    Scan {
        region,
        model: *model,
        fixed_sizes: fixed.iter().map(|c| (c.width, c.height)).collect(),
        shots: Vec::new(),
        end: ScanEnd::Complete,
        resumed: 0,
        repair: None,
        search_calibrations: vec![None; fixed.len()],
    }
}

/// Lets `work` take shots. However it ends, the laser is off and the head is told to stop; the scan's
/// end says how.
pub(super) fn guarded(
    rig: &mut Rig,
    fixed: &mut [FixedCamera],
    options: &ScanOptions,
    head_band: Band,
    scan: Scan,
    work: impl FnOnce(&mut Scanner<'_>) -> Result<ScanEnd>,
) -> Scan {
    let gates = fixed.iter().map(|c| c.known.map_or(Gate::Unknown, Gate::Known)).collect();
    let exposures = Exposures::new(1 + fixed.len(), options.frames_per_state as usize);
    let (start, tried_with) = (rig.clock.now(), vec![0; fixed.len()]);
    let sighted = (0..fixed.len()).map(|camera| scan.shots.iter().filter(|s| s.is_seen_by(camera)).count()).collect();
    let halt = Halt(rig);
    let mut scanner = Scanner {
        rig: &mut *halt.0,
        fixed,
        options,
        head_band,
        gates,
        exposures,
        journal: None,
        recorder: None,
        scan,
        sighted,
        tried_with,
        longest_on: 0.0,
        start,
        watches: Vec::new(),
    };
    let end = match work(&mut scanner) {
        Ok(end) => end,
        Err(Error::Cancelled) => ScanEnd::Cancelled,
        Err(error) => ScanEnd::Failed(error),
    };
    let mut scan = scanner.scan;
    let control = halt.0.laser();
    drop(halt);
    // A laser that may be on is worse than whatever else happened.
    scan.end = control.fault().map_or(end, ScanEnd::Failed);
    scan
}

/// In eight passes over the same path, so that a scan that ends early has covered the region.
pub(super) fn spread(path: &mut [u32]) {
    let passes: Vec<u32> =
        [0, 4, 2, 6, 1, 5, 3, 7].into_iter().flat_map(|first| path.iter().copied().skip(first).step_by(8)).collect();
    path.copy_from_slice(&passes);
}

/// Whatever ends a scan, a panic of the host's code too: the laser is off and the head stops.
struct Halt<'a>(&'a mut Rig);

impl Drop for Halt<'_> {
    fn drop(&mut self) {
        if let Err(error) = self.0.stop() {
            self.0.log.write(LogLevel::Warning, || format!("after the scan: {error}"));
        }
    }
}

pub(super) struct Scanner<'a> {
    rig: &'a mut Rig,
    fixed: &'a mut [FixedCamera],
    options: &'a ScanOptions,
    head_band: Band,
    gates: Vec<Gate>,
    exposures: Exposures,
    journal: Option<Journal>,
    recorder: Option<Recorder>,
    pub(super) scan: Scan,
    /// Shots whose spot each fixed camera saw, and those with which it could not be calibrated.
    sighted: Vec<usize>,
    tried_with: Vec<usize>,
    /// Longest time that a shot has had the laser on, seconds.
    longest_on: f64,
    start: f64,
    /// One for each fixed camera; empty without a target.
    watches: Vec<Watched>,
}

impl Scanner<'_> {
    fn run(
        &mut self,
        order: &[u32],
        coarse: usize,
        progress: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    ) -> Result<ScanEnd> {
        let mut done = vec![false; order.len()];
        self.scan.shots.iter().for_each(|shot| done[shot.index as usize] = true);
        if self.report(Phase::Coarse, order.len(), false, progress).is_break() {
            return Ok(ScanEnd::Stopped);
        }
        let (coarse, fine) = order.split_at(coarse);
        for (phase, part) in [(Phase::Coarse, coarse), (Phase::Fine, fine)] {
            for &index in part {
                if done[index as usize] {
                    continue;
                }
                let shot = self.take(index)?;
                let written = self.journal.as_mut().map_or(Ok(()), |journal| journal.append(&shot));
                self.sighted.iter_mut().enumerate().for_each(|(i, count)| *count += usize::from(shot.is_seen_by(i)));
                self.scan.shots.push(shot);
                written?;
                if self.report(phase, order.len(), true, progress).is_break() {
                    return Ok(ScanEnd::Stopped);
                }
                if phase == Phase::Fine {
                    self.calibrate_latecomers()?;
                    if self.target_is_met()? {
                        return Ok(ScanEnd::TargetMet);
                    }
                }
            }
            if phase == Phase::Coarse {
                self.calibrate_with_coarse(coarse)?;
            }
        }
        Ok(ScanEnd::Complete)
    }

    fn report(
        &self,
        phase: Phase,
        total: usize,
        newest: bool,
        progress: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let done = self.scan.shots.len();
        let measured = done - self.scan.resumed;
        let elapsed = self.rig.clock.now() - self.start;
        progress(&Progress {
            phase,
            done,
            total,
            shot: self.scan.shots.last().filter(|_| newest),
            seconds_left: (measured > 0).then(|| elapsed / measured as f64 * (total - done) as f64),
        })
    }
}
