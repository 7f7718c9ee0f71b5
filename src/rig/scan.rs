//! Scanning a region with the laser on and off in all cameras (thesis IV.D.8 and IV.E).
//!
//! A coarse, evenly spread subset of the positions comes first and is searched over the fixed
//! cameras' whole frames. They are calibrated with it, and for the rest the spot is only looked for
//! where the measured point must be. Spots of the coarse pass that contradict the calibration are
//! marked as missed.

use std::ops::ControlFlow;
use std::path::PathBuf;

use nalgebra::Vector2;

use super::acquire::{Exposures, FixedCamera};
use super::gate::{Gate, GateOptions, Search, head_band, on_epipolar_line};
use super::journal::{Fingerprint, Identity, Journal, Resumed};
use super::region::ScanRegion;
use super::shot::{Miss, Scan, ScanEnd, Shot, Sighting, correspondences, spot_covariance};
use super::{Rig, RigModel};
use crate::calibrate::{CalibrationOptions, calibrate_camera};
use crate::control::{Cancel, LogLevel};
use crate::detect::spot::{Band, Spot, SpotOptions, detect_spot};
use crate::device::PtzCapabilities;
use crate::device::recording::Recorder;
use crate::error::{Error, Result};
use crate::format::recording_json::{RecordedRegion, RecordingInfo};
use crate::study::{AccuracyWatch, SeenShot};

/// How a region is scanned.
#[derive(Debug, Clone)]
pub struct ScanOptions {
    /// Frames with the laser off and with it on, averaged; 1 to 256. They have to fit into the
    /// laser's longest time on.
    pub frames_per_state: u32,
    /// Positions of the coarse pass, about.
    pub coarse_shots: u32,
    /// How often a position is tried when a device fails.
    pub attempts: u32,
    /// How long a device that is gone (unplugged, switched off) is waited for, seconds. Drivers of the
    /// library open their device again; 0: the scan ends at once.
    pub reconnect: f64,
    /// From a toggle's return until the light has changed, seconds.
    pub laser_latency: f64,
    /// How spots are found; region and band are set by the scan.
    pub spot: SpotOptions,
    pub gate: GateOptions,
    /// Ends the scan once every fixed camera's position is expected to be known to this, root mean square,
    /// metres, the rig taken as exact; positions are then visited in eight passes over the region. 0: the
    /// whole region.
    pub target_accuracy: f64,
    /// Where each shot is written before it is acknowledged; an existing journal of the same scan is
    /// resumed.
    pub journal: Option<PathBuf>,
    /// Wait for the disk at each shot, so that a power cut loses none either.
    pub journal_sync: bool,
    /// A folder where all frames are written, to be scanned again without the rig
    /// ([`crate::device::recording`]); what a scan of the same region has recorded there is kept.
    pub record: Option<PathBuf>,
    pub cancel: Cancel,
}

impl Default for ScanOptions {
    fn default() -> Self {
        Self {
            frames_per_state: 1,
            coarse_shots: 80,
            attempts: 3,
            reconnect: 0.0,
            laser_latency: 0.0,
            spot: SpotOptions::default(),
            gate: GateOptions::default(),
            target_accuracy: 0.0,
            journal: None,
            journal_sync: true,
            record: None,
            cancel: Cancel::new(),
        }
    }
}

/// Between two looks for a lost device, seconds.
const RECONNECT_PAUSE: f64 = 1.0;

/// Is a device gone that may come back?
fn is_lost(error: &Error) -> bool {
    matches!(error, Error::DeviceLost { .. } | Error::DeviceNotFound { .. })
}

/// A calibration is not tried again with fewer than twice as many shots.
const MIN_CALIBRATION_SHOTS: usize = 8;

/// Most fixed cameras of one scan.
pub const MAX_FIXED_CAMERAS: usize = 64;

impl ScanOptions {
    pub(super) fn validate(&self) -> Result<()> {
        if !(1..=256).contains(&self.frames_per_state) {
            return Err(Error::invalid("frames_per_state", format!("{} is not in [1, 256]", self.frames_per_state)));
        }
        if self.attempts == 0 {
            return Err(Error::invalid("attempts", "at least 1"));
        }
        if !(0.0..=86_400.0).contains(&self.reconnect) {
            return Err(Error::invalid("reconnect", format!("{} s is not in [0, 86400]", self.reconnect)));
        }
        if !(0.0..=10.0).contains(&self.laser_latency) {
            return Err(Error::invalid("laser_latency", format!("{} s is not in [0, 10]", self.laser_latency)));
        }
        if !(self.target_accuracy.is_finite() && self.target_accuracy >= 0.0) {
            return Err(Error::invalid("target_accuracy", format!("{} m", self.target_accuracy)));
        }
        self.spot.check()?;
        self.gate.validate()
    }
}

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

fn watch(model: &RigModel, camera: &FixedCamera, options: &ScanOptions) -> Result<Watched> {
    let mut watch = AccuracyWatch::new(*model, camera.width, camera.height, options.target_accuracy)?;
    watch.estimate.distortion = camera.distortion;
    watch.estimate.cancel = options.cancel.clone();
    Ok(Watched { watch, told: 0, met: false })
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
    /// Shots with which each fixed camera could not be calibrated.
    tried_with: Vec<usize>,
    /// Longest time that a shot has had the laser on, seconds.
    longest_on: f64,
    start: f64,
    /// One for each fixed camera; empty without a target.
    watches: Vec<Watched>,
}

/// How well a fixed camera is known.
struct Watched {
    watch: AccuracyWatch,
    /// The scan's shots that it was told of.
    told: usize,
    met: bool,
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

    /// Are all fixed cameras known as well as is wanted?
    fn target_is_met(&mut self) -> Result<bool> {
        for (camera, Watched { watch, told, met }) in self.watches.iter_mut().enumerate().filter(|(_, w)| !w.met) {
            let seen = |shot: &Shot| {
                let (head, fixed) = (shot.head.ok()?, shot.fixed[camera].ok()?);
                let spot = |s: &Spot| (Vector2::new(s.x, s.y), spot_covariance(s));
                shot.point?;
                Some(SeenShot { pan: shot.pan, tilt: shot.tilt, head: spot(&head), fixed: spot(&fixed) })
            };
            let fresh = self.scan.shots.iter().skip(*told);
            fresh.filter_map(seen).for_each(|shot| watch.add(shot));
            *told = self.scan.shots.len();
            let Some(accuracy) = watch.reached()? else { continue };
            self.rig.log.write(LogLevel::Info, || {
                format!("fixed camera {camera}: known to {:.2} mm after {} shots", 1e3 * accuracy.rms, watch.count())
            });
            *met = true;
        }
        Ok(!self.watches.is_empty() && self.watches.iter().all(|w| w.met))
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

    /// Takes a shot, again when a device fails and may recover, and when a lost one comes back. Between
    /// attempts the laser is off and the head stands, where it can be told to.
    pub(super) fn take(&mut self, index: u32) -> Result<Shot> {
        let (mut attempt, mut lost_since) = (1, None);
        loop {
            self.options.cancel.check()?;
            self.rig.laser.check_emergency()?;
            let error = match self.try_shot(index) {
                Ok(shot) => return Ok(shot),
                Err(error) => error,
            };
            let stopped = self.rig.stop();
            if self.options.reconnect > 0.0 && is_lost(&error) && self.rig.laser.fault().is_none() {
                let now = self.rig.clock.now();
                let since = *lost_since.get_or_insert(now);
                if now - since < self.options.reconnect {
                    self.rig.log.write(LogLevel::Warning, || format!("position {index}: {error}; waiting for it"));
                    self.pause(RECONNECT_PAUSE)?;
                    continue;
                }
            }
            let may_recover = matches!(
                error,
                Error::Device { .. }
                    | Error::DeviceTimeout { .. }
                    | Error::DeviceGarbled { .. }
                    | Error::DeviceRefused { .. }
            );
            if attempt == self.options.attempts || !may_recover || stopped.is_err() {
                return Err(error);
            }
            self.rig.log.write(LogLevel::Warning, || format!("position {index}, attempt {attempt}: {error}"));
            attempt += 1;
        }
    }

    /// Lets time pass, and hears a cancel meanwhile.
    fn pause(&self, seconds: f64) -> Result<()> {
        for _ in 0..10 {
            self.options.cancel.check()?;
            self.rig.clock.sleep(0.1 * seconds);
        }
        Ok(())
    }

    fn try_shot(&mut self, index: u32) -> Result<Shot> {
        let (pan, tilt) = self.scan.region.position(index);
        let (pan, tilt) = whole_steps(&self.rig.capabilities, pan, tilt);
        let position = self.rig.move_to(pan, tilt, &self.options.cancel)?;
        if self.scan.shots.first().is_some_and(|first| (first.zoom - position.zoom).abs() > 1e-3) {
            return Err(Error::Device { reason: "the zoom has changed: the rig's model does not hold".into() });
        }
        // A shot that begins with less than it needs would be cut short. Half as much again, for frames
        // that come late.
        self.rig.laser.wait_until_allowed(1.5 * self.longest_on, &self.options.cancel)?;
        self.exposures.take_off(self.rig, self.fixed, &self.options.cancel)?;
        let light = self.rig.laser.light()?;
        let time = self.rig.clock.now();
        let lit = time + self.options.laser_latency;
        self.exposures.take_on(self.rig, self.fixed, &self.options.cancel, &light, lit)?;
        light.off()?;
        self.longest_on = self.longest_on.max(self.rig.clock.now() - time);
        let after = self.rig.position()?;
        let [pan_tolerance, tilt_tolerance] = self.rig.tolerances();
        if (after.pan - position.pan).abs() > pan_tolerance || (after.tilt - position.tilt).abs() > tilt_tolerance {
            return Err(Error::Device { reason: "the head was moved during a shot".into() });
        }
        if let Some(recorder) = &mut self.recorder {
            let views = |camera| self.exposures.views(camera).map(|(on, off)| (off, on));
            let frames = (0..=self.fixed.len()).map(views).collect::<Result<Vec<_>>>()?;
            recorder.add(position, &frames)?;
        }
        let mut shot = Shot {
            index,
            pan: position.pan,
            tilt: position.tilt,
            zoom: position.zoom,
            time,
            head: self.find_in_head()?,
            fixed: Vec::with_capacity(self.fixed.len()),
            colour: [0; 3],
            point: None,
        };
        shot.locate(&self.scan.model);
        if let Ok(spot) = &shot.head {
            shot.colour = self.exposures.colour(spot.x, spot.y)?;
        }
        for camera in 0..self.fixed.len() {
            let sighting = self.find_in_fixed(camera, &shot)?;
            shot.fixed.push(sighting);
        }
        Ok(shot)
    }

    fn find_in_head(&self) -> Result<Sighting> {
        let found = self.detect(0, Some(self.head_band.clone()))?;
        let reflection = found.is_ok_and(|spot| !on_epipolar_line(&self.scan.model, &spot, &self.options.gate));
        Ok(if reflection { Err(Miss::OffEpipolarLine) } else { found })
    }

    fn find_in_fixed(&self, camera: usize, shot: &Shot) -> Result<Sighting> {
        let laser = self.scan.model.laser_in_world(shot.pan, shot.tilt);
        let point = shot.point.map(|depth| depth.point);
        match self.gates[camera].search(point.as_ref(), laser, &self.options.gate) {
            Search::OutsideView => Ok(Err(Miss::OutsideView)),
            Search::Everywhere => self.detect(1 + camera, None),
            Search::Band(band) => self.detect(1 + camera, Some(band)),
        }
    }

    fn detect(&self, camera: usize, band: Option<Band>) -> Result<Sighting> {
        let (on, off) = self.exposures.views(camera)?;
        let options = SpotOptions { region: None, band, ..self.options.spot.clone() };
        match detect_spot(&on, &off, &options) {
            // What is of no use later is not found.
            Ok(spot) if spot_covariance(&spot).cholesky().is_none() => Ok(Err(Miss::NotFound)),
            Ok(spot) => Ok(Ok(spot)),
            Err(Error::NotFound { .. }) => Ok(Err(Miss::NotFound)),
            Err(Error::Ambiguous { .. }) => Ok(Err(Miss::Ambiguous)),
            Err(error) => Err(error),
        }
    }

    /// Calibrates the cameras that are not known, to know where to look, and marks the coarse spots
    /// that contradict it. A camera whose coarse shots do not suffice is searched over its whole
    /// frames until more have come.
    fn calibrate_with_coarse(&mut self, coarse: &[u32]) -> Result<()> {
        let mut is_coarse = vec![false; self.scan.region.len()];
        coarse.iter().for_each(|index| is_coarse[*index as usize] = true);
        for camera in 0..self.fixed.len() {
            self.calibrate(camera, |shot| is_coarse[shot.index as usize])?;
            self.mark(camera);
        }
        Ok(())
    }

    /// Tries cameras again that could not be calibrated, whenever they have twice as many spots.
    fn calibrate_latecomers(&mut self) -> Result<()> {
        for camera in 0..self.fixed.len() {
            let usable = |shot: &&Shot| shot.point.is_some() && shot.fixed[camera].is_ok();
            if matches!(self.gates[camera], Gate::Unknown)
                && self.scan.shots.iter().filter(usable).count()
                    >= 2 * self.tried_with[camera].max(MIN_CALIBRATION_SHOTS)
            {
                self.calibrate(camera, |_| true)?;
                self.mark(camera);
            }
        }
        Ok(())
    }

    fn calibrate(&mut self, camera: usize, wanted: impl Fn(&Shot) -> bool) -> Result<()> {
        if !matches!(self.gates[camera], Gate::Unknown) {
            return Ok(());
        }
        // In the order of positions, so that a resumed scan gets the same calibration.
        let mut shots: Vec<&Shot> = self.scan.shots.iter().filter(|shot| wanted(shot)).collect();
        shots.sort_by_key(|shot| shot.index);
        let FixedCamera { width, height, distortion, .. } = self.fixed[camera];
        let set = correspondences(shots.into_iter(), camera, width, height)?;
        self.tried_with[camera] = set.len();
        let options =
            CalibrationOptions { distortion, cancel: self.options.cancel.clone(), ..CalibrationOptions::default() };
        match calibrate_camera(&set, &options) {
            Ok(calibration) => {
                self.rig.log.write(LogLevel::Info, || {
                    let used = calibration.inliers.iter().filter(|inlier| **inlier).count();
                    format!(
                        "fixed camera {camera}: calibrated from {used} of {} shots, to know where to look",
                        set.len()
                    )
                });
                self.scan.search_calibrations[camera] = Some(calibration.clone());
                self.gates[camera] = Gate::Calibrated(Box::new(calibration));
            }
            Err(Error::Cancelled) => return Err(Error::Cancelled),
            Err(error) => self.rig.log.write(LogLevel::Warning, || {
                format!(
                    "fixed camera {camera}: whole frames are searched on; {} shots do not calibrate it: {error}",
                    set.len()
                )
            }),
        }
        Ok(())
    }

    /// Marks the spots of a camera that contradict what is known of it now.
    fn mark(&mut self, camera: usize) {
        for shot in &mut self.scan.shots {
            let (Some(depth), Ok(spot)) = (shot.point, shot.fixed[camera]) else { continue };
            if !self.gates[camera].accepts(&spot, &depth.point, &self.options.gate) {
                shot.fixed[camera] = Err(Miss::OffPrediction);
            }
        }
        // What it was told may not be true any more.
        if let Some(watched) = self.watches.get_mut(camera) {
            watched.watch.clear();
            watched.told = 0;
        }
    }
}

/// What a journal has to agree in: all that decides what a shot is.
fn identity(region: &ScanRegion, model: &RigModel, options: &ScanOptions, fixed: &[FixedCamera]) -> Identity {
    let ScanRegion { pan, tilt, pan_steps, tilt_steps } = region;
    let (l, o, e) = (&model.laser, &model.offsets, &model.encoders);
    let (gate, spot) = (&options.gate, &options.spot);
    let mut settings = Fingerprint::new()
        .integers(&[options.frames_per_state, options.coarse_shots, spot.colour as u32, spot.max_area].map(u64::from))
        .numbers(&[spot.min_signal_to_noise, spot.ambiguity_ratio])
        .numbers(&gate.depth_range)
        .numbers(&[gate.half_width, gate.model_sigma, gate.sigmas]);
    for camera in fixed {
        settings = settings.integers(&[camera.width, camera.height, camera.distortion as u32].map(u64::from));
        settings = settings.integers(&[u64::from(camera.known.is_some())]);
        if let Some(known) = &camera.known {
            settings = settings
                .numbers(&known.intrinsics.to_array())
                .numbers(known.distortion.coefficients())
                .numbers(known.pose.rotation.as_slice())
                .numbers(known.pose.translation.as_slice());
        }
    }
    Identity {
        fixed_cameras: fixed.len() as u32,
        region: Fingerprint::new()
            .numbers(pan)
            .numbers(tilt)
            .integers(&[*pan_steps, *tilt_steps].map(u64::from))
            .finish(),
        model: Fingerprint::new()
            .integers(&[model.width, model.height].map(u64::from))
            .numbers(&model.intrinsics.to_array())
            .numbers(model.distortion.coefficients())
            .numbers(&[l.x0, l.y0, l.vx, l.vy])
            .numbers(&[o.tilt_y, o.tilt_z, o.pan_x, o.pan_z])
            .numbers(&[e.pan_zero, e.pan_scale, e.tilt_zero, e.tilt_scale])
            .finish(),
        options: settings.finish(),
    }
}

/// What a recording of the scan holds.
fn recording_info(region: &ScanRegion, rig: &Rig, fixed: &[FixedCamera]) -> RecordingInfo {
    let ScanRegion { pan, tilt, pan_steps, tilt_steps } = *region;
    let head = (rig.model.width, rig.model.height);
    RecordingInfo {
        rig: rig.model,
        pan_range: rig.capabilities.pan_range,
        tilt_range: rig.capabilities.tilt_range,
        pan_step: rig.capabilities.pan_step,
        tilt_step: rig.capabilities.tilt_step,
        region: RecordedRegion { pan, tilt, pan_steps, tilt_steps },
        cameras: std::iter::once(head).chain(fixed.iter().map(|c| (c.width, c.height))).collect(),
    }
}

/// The nearest position on whole encoder steps: between two steps the reading is a toss-up, and off by
/// a step where it lands on the wrong one; on a step it is exact (maths.md section 6).
fn whole_steps(capabilities: &PtzCapabilities, pan: f64, tilt: f64) -> (f64, f64) {
    let snap = |angle: f64, step: f64, [low, high]: [f64; 2]| {
        let snapped = if step > 0.0 { (angle / step).round() * step } else { angle };
        if (low..=high).contains(&snapped) { snapped } else { angle }
    };
    (
        snap(pan, capabilities.pan_step, capabilities.pan_range),
        snap(tilt, capabilities.tilt_step, capabilities.tilt_range),
    )
}
