//! The measurements, one after the other.

use nalgebra::Vector2;

mod frames;
mod motion;
mod returns;

use super::report::ProbeReport;
use super::{ProbeOptions, ProbeParts};
use crate::control::{Cancel, Clock, Log, LogLevel};
use crate::device::{Frame, FrameSource, PanTiltZoom, PtzCapabilities};
use crate::error::{Error, Result};
use crate::geometry::Camera;
use crate::rig::laser::LaserControl;
use crate::rig::settle::{Mover, SettleOptions, read_position};

/// Time between readings while something is watched, seconds; devices' calls take longer as a rule.
const POLL: f64 = 0.002;
/// A picture may swing for so long after an honest arrival, seconds.
const SWING: f64 = 0.3;

/// What was measured, or why it stays open.
type Open<T> = std::result::Result<T, String>;

pub(super) struct Session<'a, 'o> {
    head: &'a mut dyn PanTiltZoom,
    frames: Option<&'a mut dyn FrameSource>,
    laser: Option<&'a LaserControl>,
    camera: Option<Camera>,
    clock: &'a dyn Clock,
    log: &'a Log,
    options: &'o ProbeOptions,
    cancel: &'o Cancel,
    capabilities: PtzCapabilities,
    /// Where moves are made about, and their size.
    base: [f64; 2],
    amplitude: [f64; 2],
    begin: f64,
    size: [u32; 2],
    /// Timestamp of the last frame.
    last: f64,
    pictures: [Frame; 2],
}

/// A head without a camera.
struct NoFrames;

impl FrameSource for NoFrames {
    fn next_frame(&mut self, _: f64, _: f64, _: &mut Frame) -> Result<()> {
        Err(Error::NotFound { reason: "no frames were given".into() })
    }
}

/// A reading and when it was taken.
#[derive(Clone, Copy)]
struct Reading {
    time: f64,
    at: [f64; 2],
}

impl<'a, 'o> Session<'a, 'o> {
    pub fn new(parts: ProbeParts<'a>, options: &'o ProbeOptions, cancel: &'o Cancel) -> Result<Self> {
        let ProbeParts { head, frames, laser, camera, clock, log } = parts;
        let capabilities = head.capabilities();
        let ranges = [capabilities.pan_range, capabilities.tilt_range];
        if ranges.iter().any(|[low, high]| !(low < high && (high - low).is_finite())) {
            return Err(Error::Device { reason: format!("the head reports the ranges {ranges:?}") });
        }
        Ok(Self {
            head,
            frames,
            laser,
            camera,
            clock,
            log,
            options,
            cancel,
            capabilities,
            base: ranges.map(|[low, high]| 0.5 * (low + high)),
            amplitude: ranges.map(|[low, high]| options.amplitude * (high - low)),
            begin: clock.now(),
            size: [0; 2],
            last: f64::NAN,
            pictures: [Frame::empty(), Frame::empty()],
        })
    }

    pub fn stop(&mut self) -> Result<()> {
        self.head.stop()
    }

    pub fn run(&mut self) -> Result<ProbeReport> {
        self.check()?;
        let identity = or_default(self.head.identity())?;
        let mut report = ProbeReport::new(identity, self.capabilities);
        // A head on its way comes back to where that ends.
        let rest = self.attempt(Self::wait_equal)?;
        let start = match rest {
            Ok(reading) => reading.at,
            Err(_) => self.read()?.at,
        };
        for (k, at) in start.iter().enumerate() {
            let [low, high] = self.range(k);
            // Moves fit in about here.
            self.base[k] = at.clamp(low + self.amplitude[k], high - self.amplitude[k]);
        }
        self.look_at_frames(&mut report)?;
        report.position_time = self.attempt(Self::position_time)?;
        for k in 0..2 {
            let swept = self.attempt(|s| s.sweep(k))?;
            let (speed, latency, follows) =
                swept.unwrap_or_else(|reason| (Err(reason.clone()), Err(reason.clone()), Err(reason)));
            report.speed[k] = speed;
            if k == 0 {
                (report.start_latency, report.position_follows) = (latency, follows);
            }
            match self.attempt(|s| s.returns(k))? {
                Ok(r) => self.report_returns(k, &r, &mut report),
                Err(reason) => {
                    report.position_error[k] = Err(reason.clone());
                    report.reading_repeatability[k] = Err(reason.clone());
                    self.no_picture(k, &reason, &mut report);
                }
            }
            report.smallest_move[k] = self.attempt(|s| s.smallest_move(k))?;
        }
        (report.stop_distance, report.stop_time) = both(self.attempt(Self::stopping)?);
        let arrival = self.attempt(Self::arrival)?;
        report.arrival_honest = arrival.as_ref().map(|m| m.value - 2.0 * m.sigma < SWING).map_err(Clone::clone);
        report.moves_after_arrival = arrival;
        let seen = self.attempt(Self::first_sight)?;
        (report.visible_after, report.visible_after_frames) = both(seen);
        let seen = self.attempt(Self::laser_sight)?;
        (report.laser_visible_after, report.laser_visible_after_frames) = both(seen);
        // No move under a laser that may be on.
        self.laser.map_or(Ok(()), LaserControl::off)?;
        for i in 0..4 {
            report.limits[i] = self.attempt(|s| s.limit(i))?;
        }
        let back = self.attempt(|s| s.settle(start, false).map(|_| ()))?;
        if let Err(reason) = back {
            self.log.write(LogLevel::Warning, || format!("the head is not back where it was: {reason}"));
        }
        report.duration = self.clock.now() - self.begin;
        Ok(report)
    }

    fn range(&self, k: usize) -> [f64; 2] {
        [self.capabilities.pan_range, self.capabilities.tilt_range][k]
    }

    /// Readings closer than this are equal: a step, or what 1 part in 10000 of the range is.
    fn step(&self, k: usize) -> f64 {
        let step = [self.capabilities.pan_step, self.capabilities.tilt_step][k];
        let [low, high] = self.range(k);
        if step > 0.0 && step.is_finite() { step } else { 1e-4 * (high - low) }
    }

    fn check(&self) -> Result<()> {
        self.cancel.check()?;
        if self.clock.now() - self.begin > self.options.max_time {
            return Err(out_of_time(self.options.max_time));
        }
        Ok(())
    }

    /// A measurement that fails leaves its reason; what ends everything is an error.
    fn attempt<T>(&mut self, measure: impl FnOnce(&mut Self) -> Result<T>) -> Result<Open<T>> {
        let measured = self.check().and_then(|()| measure(self));
        match measured {
            Ok(value) => Ok(Ok(value)),
            Err(error @ (Error::Cancelled | Error::DeviceLost { .. } | Error::Unauthorised { .. })) => Err(error),
            Err(error) => {
                self.log.write(LogLevel::Info, || format!("probe: {error}"));
                // The head may be on its way.
                match self.head.stop() {
                    Err(error @ Error::DeviceLost { .. }) => Err(error),
                    _ => Ok(Err(error.to_string())),
                }
            }
        }
    }

    fn read(&mut self) -> Result<Reading> {
        self.check()?;
        let before = self.clock.now();
        let at = read_position(self.head)?;
        let after = self.clock.now();
        if after - before < POLL {
            self.clock.sleep(POLL);
        }
        Ok(Reading { time: 0.5 * (before + after), at: [at.pan, at.tilt] })
    }

    fn with(&self, k: usize, value: f64) -> [f64; 2] {
        let mut target = self.base;
        let [low, high] = self.range(k);
        target[k] = value.clamp(low, high);
        target
    }

    fn send(&mut self, [pan, tilt]: [f64; 2]) -> Result<()> {
        self.head.move_absolute(pan, tilt)
    }

    /// Goes there directly, waits until the head stands by its own word and, with `look`, by its picture.
    fn settle(&mut self, target: [f64; 2], look: bool) -> Result<[f64; 2]> {
        self.check()?;
        let mut capabilities = self.capabilities;
        (capabilities.pan_step, capabilities.tilt_step) = (self.step(0), self.step(1));
        let left = (self.options.max_time - (self.clock.now() - self.begin)).max(0.1);
        let base = &self.options.settle;
        let settle = SettleOptions {
            tolerance: 0.0,
            overshoot: 0.0,
            picture_timeout: if look { base.picture_timeout.max(0.5) } else { 0.0 },
            move_timeout: base.move_timeout.min(left),
            ..*base
        };
        let mut none = NoFrames;
        let frames: &mut dyn FrameSource = match self.frames.as_mut() {
            Some(frames) => &mut **frames,
            None => &mut none,
        };
        let at = Mover {
            ptz: &mut *self.head,
            capabilities: &capabilities,
            frames,
            size: self.size,
            clock: self.clock,
            log: self.log,
            settle,
            frame_options: self.options.frames,
            approached: &mut false,
            pictures: &mut self.pictures,
            earliest_look: 1.0,
        }
        .approach(Vector2::from(target), self.cancel)?
        .position;
        if look {
            self.last = self.pictures[1].timestamp;
        }
        Ok([at.pan, at.tilt])
    }

    /// The first of equal readings that span the options' duration.
    fn wait_equal(&mut self) -> Result<Reading> {
        let begin = self.clock.now();
        let mut first = self.read()?;
        let mut equal = 1;
        loop {
            let r = self.read()?;
            if (0..2).all(|k| (r.at[k] - first.at[k]).abs() <= 1e-9 * self.step(k)) {
                equal += 1;
            } else {
                (first, equal) = (r, 1);
            }
            if equal >= self.options.settle.readings && r.time - first.time >= self.options.settle.duration {
                return Ok(first);
            }
            if r.time - begin > self.options.settle.move_timeout {
                return Err(Error::DeviceTimeout { what: "pan-tilt head", seconds: self.options.settle.move_timeout });
            }
        }
    }
}

/// Two figures of one measurement.
fn both<A, B>(measured: Open<(A, B)>) -> (Open<A>, Open<B>) {
    match measured {
        Ok((a, b)) => (Ok(a), Ok(b)),
        Err(reason) => (Err(reason.clone()), Err(reason)),
    }
}

fn out_of_time(seconds: f64) -> Error {
    Error::DeviceTimeout { what: "device in time for this figure", seconds }
}

/// A device that does not say what it is is none the worse.
fn or_default<T: Default>(result: Result<T>) -> Result<T> {
    match result {
        Err(Error::Unsupported { .. } | Error::Device { .. } | Error::DeviceTimeout { .. }) => Ok(T::default()),
        other => other,
    }
}
