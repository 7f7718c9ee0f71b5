//! The measurements, one after the other.

use nalgebra::Vector2;

use super::report::{Figure, Measured, ProbeReport};
use super::shift::{Shift, differs, shift};
use super::{ProbeOptions, ProbeParts};
use crate::control::{Cancel, Clock, Log, LogLevel};
use crate::device::{Frame, FrameSource, Laser, Motion, PanTiltZoom, PtzCapabilities};
use crate::error::{Error, Result};
use crate::geometry::Camera;
use crate::rig::settle::{Mover, SettleOptions, read_position};
use crate::rig::stillness::shift_between;

/// Time between readings while something is watched, seconds; devices' calls take longer as a rule.
const POLL: f64 = 0.002;
/// A head that has not begun to move by then does not, seconds.
const NO_START: f64 = 2.0;
/// Frames that are looked at for the first sign of a change, at most.
const MAX_FRAMES: usize = 120;
/// A picture may swing for so long after an honest arrival, seconds.
const SWING: f64 = 0.3;
/// Greatest shift between frames of a still picture, px.
const STILL: f64 = 0.3;
/// Consecutive pairs of frames that must be still.
const STILL_PAIRS: usize = 3;
/// Most doublings of the smallest move.
const DOUBLINGS: i32 = 20;
/// Longest time the laser is on, seconds.
const LASER_ON: f64 = 1.0;
/// Speed of a head that does not tell its greatest, radians per second: faster than any that is sold.
const FASTEST: f64 = 12.0;

pub(super) struct Session<'a, 'o> {
    head: &'a mut dyn PanTiltZoom,
    frames: Option<&'a mut dyn FrameSource>,
    laser: Option<&'a mut dyn Laser>,
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
        let position_time = self.attempt(Self::position_time)?;
        report.position_time = figure(position_time);
        for k in 0..2 {
            let swept = self.attempt(|s| s.sweep(k))?;
            match swept {
                Ok((speed, latency, follows)) => {
                    report.speed[k] = speed;
                    if k == 0 {
                        (report.start_latency, report.position_follows) = (latency, follows);
                    }
                }
                Err(reason) => {
                    report.speed[k] = Err(reason.clone());
                    if k == 0 {
                        (report.start_latency, report.position_follows) = (Err(reason.clone()), Err(reason));
                    }
                }
            }
            let returns = self.attempt(|s| s.returns(k))?;
            match returns {
                Ok(r) => self.report_returns(k, &r, &mut report),
                Err(reason) => {
                    report.position_error[k] = Err(reason.clone());
                    report.reading_repeatability[k] = Err(reason.clone());
                    self.no_picture(k, &reason, &mut report);
                }
            }
            let smallest = self.attempt(|s| s.smallest_move(k))?;
            report.smallest_move[k] = figure(smallest);
        }
        match self.attempt(Self::stopping)? {
            Ok((distance, time)) => (report.stop_distance, report.stop_time) = (Ok(distance), Ok(time)),
            Err(reason) => (report.stop_distance, report.stop_time) = (Err(reason.clone()), Err(reason)),
        }
        let arrival = self.attempt(Self::arrival)?;
        report.arrival_honest = arrival.as_ref().map(|m| m.value - 2.0 * m.sigma < SWING).map_err(Clone::clone);
        report.moves_after_arrival = figure(arrival);
        match self.attempt(Self::first_sight)? {
            Ok((time, count)) => (report.visible_after, report.visible_after_frames) = (Ok(time), Ok(count)),
            Err(reason) => (report.visible_after, report.visible_after_frames) = (Err(reason.clone()), Err(reason)),
        }
        match self.attempt(Self::laser_sight)? {
            Ok((time, count)) => {
                (report.laser_visible_after, report.laser_visible_after_frames) = (Ok(time), Ok(count))
            }
            Err(reason) => {
                (report.laser_visible_after, report.laser_visible_after_frames) = (Err(reason.clone()), Err(reason));
            }
        }
        for i in 0..4 {
            let reached = self.attempt(|s| s.limit(i))?;
            report.limits[i] = figure(reached);
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
    fn attempt<T>(&mut self, measure: impl FnOnce(&mut Self) -> Result<T>) -> Result<std::result::Result<T, String>> {
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

    fn position_time(&mut self) -> Result<Measured> {
        let mut times = Vec::new();
        for _ in 0..10 {
            self.check()?;
            let before = self.clock.now();
            read_position(self.head)?;
            times.push(self.clock.now() - before);
        }
        Ok(mean(&times))
    }

    /// A move over twice the amplitude: speed, latency of the first reading, and whether readings follow.
    fn sweep(&mut self, k: usize) -> Result<(Figure, Figure, std::result::Result<bool, String>)> {
        let (from, to) = (self.base[k] - self.amplitude[k], self.base[k] + self.amplitude[k]);
        self.settle(self.with(k, from), false)?;
        let rest = self.read()?;
        let call = self.clock.now();
        self.send(self.with(k, to))?;
        let (mut readings, step) = (vec![rest], self.step(k));
        let near = |r: &Reading| (r.at[k] - to).abs() <= 1.01 * step;
        let started = |r: &Reading| (r.at[k] - rest.at[k]).abs() > 0.5 * step;
        loop {
            let r = self.read()?;
            readings.push(r);
            if near(&r) {
                break;
            }
            let late = if readings.iter().any(started) { self.options.settle.move_timeout } else { NO_START };
            if r.time - call > late {
                let reason = format!("{} does not arrive within {late} s of its command", AXES[k]);
                return Err(Error::Device { reason });
            }
        }
        let span = to - rest.at[k];
        let share = |r: &Reading| (r.at[k] - rest.at[k]) / span;
        let between: Vec<&Reading> = readings.iter().filter(|r| (0.02..0.98).contains(&share(r))).collect();
        let follows = !between.is_empty();
        // A head that travels that fast looks the same between two readings.
        let top = Some(self.capabilities.max_speed[k]).filter(|s| *s > 0.0).unwrap_or(FASTEST);
        let gap = readings.windows(2).map(|r| r[1].time - r[0].time.max(call)).fold(0.0, f64::max);
        let blind = !follows && top * gap > 0.5 * span.abs();
        let echoes = || match blind {
            true => format!("readings come only every {gap:.2} s, too seldom to see the head on its way"),
            false => "readings jump to the target: they repeat the command".to_owned(),
        };
        let middle: Vec<(f64, f64)> =
            readings.iter().filter(|r| (0.2..0.8).contains(&share(r))).map(|r| (r.time, r.at[k])).collect();
        let speed = match slope(&middle) {
            _ if !follows => Err(echoes()),
            Some(m) => Ok(m),
            None => Err("too few readings on the way: the move is too short".into()),
        };
        let latency = match readings.iter().position(started) {
            Some(i) if follows => {
                // Between the last reading before and this.
                let (a, b) = ((readings[i - 1].time - call).max(0.0), readings[i].time - call);
                Ok(Measured { value: 0.5 * (a + b), sigma: (b - a) / 12f64.sqrt(), count: 1 })
            }
            _ => Err(echoes()),
        };
        let follows = if blind { Err(echoes()) } else { Ok(follows) };
        Ok((speed, latency, follows))
    }

    /// Returns to a place from below and from above in turn.
    fn returns(&mut self, k: usize) -> Result<Returns> {
        let mut found = Returns::default();
        let look = self.frames.is_some();
        let mut reference = None;
        for _ in 0..self.options.repeats {
            for (side, sign) in [-1.0, 1.0].into_iter().enumerate() {
                self.settle(self.with(k, self.base[k] + sign * self.amplitude[k]), false)?;
                let at = self.settle(self.base, look)?;
                found.readings[side].push(at[k]);
                found.error = found.error.max((at[k] - self.base[k]).abs());
                if !look {
                    continue;
                }
                let reference = reference.get_or_insert_with(|| self.pictures[1].clone());
                if let Some(s) = shift(&reference.image.view()?, &self.pictures[1].image.view()?) {
                    found.shifts[side].push(s);
                }
            }
        }
        Ok(found)
    }

    fn no_picture(&self, k: usize, reason: &str, report: &mut ProbeReport) {
        for figures in [
            &mut report.picture_repeatability_px,
            &mut report.picture_repeatability,
            &mut report.backlash_px,
            &mut report.backlash,
        ] {
            figures[k] = Err(reason.to_owned());
        }
    }

    fn report_returns(&self, k: usize, found: &Returns, report: &mut ProbeReport) {
        let all = found.readings[0].len() + found.readings[1].len();
        report.position_error[k] =
            Ok(Measured { value: found.error, sigma: 0.5 * self.step(k) / 3f64.sqrt(), count: all as u32 });
        report.reading_repeatability[k] = Ok(deviation(&found.readings[0], &found.readings[1]));
        if self.frames.is_none() {
            return self.no_picture(k, "no frames were given", report);
        }
        let [below, above] = [0, 1].map(|side| found.shifts[side].iter().map(|s| s.by[k]).collect::<Vec<f64>>());
        if below.len() < 2 || above.len() < 2 {
            return self.no_picture(k, "the picture has no texture to measure shifts by", report);
        }
        let repeat = deviation(&below, &above);
        let (low, high) = (mean(&below), mean(&above));
        // What is turned further right or up moves the picture left or down.
        let sense = [-1.0, 1.0][k];
        let shifts = found.shifts.iter().flatten();
        let own = shifts.map(|s| s.sigma[k].powi(2)).sum::<f64>().sqrt() / all as f64;
        let backlash = Measured {
            value: sense * (high.value - low.value),
            sigma: low.sigma.hypot(high.sigma).hypot(own),
            count: all as u32,
        };
        report.picture_repeatability_px[k] = Ok(repeat);
        report.backlash_px[k] = Ok(backlash);
        let focal = self.camera.map(|c| [c.intrinsics.fx, c.intrinsics.fy][k]);
        let angle = |m: Measured| match focal {
            Some(f) => Ok(Measured { value: m.value / f, sigma: m.sigma / f, count: m.count }),
            None => Err("the camera's intrinsics were not given".to_owned()),
        };
        (report.picture_repeatability[k], report.backlash[k]) = (angle(repeat), angle(backlash));
    }

    /// Ever larger moves upwards until a reading shows one.
    fn smallest_move(&mut self, k: usize) -> Result<Measured> {
        self.settle(self.with(k, self.base[k] - self.amplitude[k]), false)?;
        let from = self.settle(self.base, false)?[k];
        let [low, high] = self.range(k);
        let known = [self.capabilities.pan_step, self.capabilities.tilt_step][k];
        let first = if known > 0.0 && known.is_finite() { known / 8.0 } else { (high - low) / f64::from(1 << 20) };
        for doubling in 0..DOUBLINGS {
            let size = first * f64::from(doubling).exp2();
            if size > self.amplitude[k] {
                break;
            }
            self.send(self.with(k, from + size))?;
            let at = self.wait_equal()?.at[k];
            if at != from {
                // Between this and half of it.
                return Ok(Measured { value: size, sigma: 0.5 * size / 3f64.sqrt(), count: 1 });
            }
        }
        Err(Error::Device { reason: format!("{} shows no small move", AXES[k]) })
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

    /// STOP in the middle of a pan: how far and how long the readings go on.
    fn stopping(&mut self) -> Result<(Measured, Measured)> {
        let (from, to) = (self.base[0] - self.amplitude[0], self.base[0] + self.amplitude[0]);
        let (mut distances, mut times) = (Vec::new(), Vec::new());
        for _ in 0..3 {
            self.settle(self.with(0, from), false)?;
            self.send(self.with(0, to))?;
            let call = self.clock.now();
            let mut r = self.read()?;
            while (r.at[0] - from) / (to - from) < 0.4 {
                if r.time - call > self.options.settle.move_timeout {
                    return Err(Error::Device { reason: "the head does not move".into() });
                }
                r = self.read()?;
            }
            if (r.at[0] - from) / (to - from) > 0.9 {
                return Err(Error::Device { reason: "the move is over before it can be stopped".into() });
            }
            let stop = self.clock.now();
            self.head.stop()?;
            let rest = self.wait_equal()?;
            distances.push((rest.at[0] - r.at[0]).abs());
            times.push((rest.time - stop).max(0.0));
        }
        Ok((mean(&distances), mean(&times)))
    }

    fn look_at_frames(&mut self, report: &mut ProbeReport) -> Result<()> {
        let looked = self.attempt(|s| {
            s.settle(s.base, false)?;
            let mut frame = Frame::empty();
            let (mut stamps, mut ages, mut arrivals) = (Vec::new(), Vec::new(), Vec::new());
            for i in 0..16 {
                s.grab(&mut frame)?;
                let view = frame.image.view()?;
                s.size = [view.width(), view.height()];
                // The first may be old ones.
                if i >= 4 {
                    stamps.push(frame.timestamp);
                    ages.push(s.clock.now() - frame.timestamp);
                    arrivals.push(s.clock.now());
                }
            }
            let stamped = stamps.iter().all(|t| t.is_finite());
            let times = if stamped { &stamps } else { &arrivals };
            let gaps: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
            let age = if stamped { Ok(mean(&ages)) } else { Err("frames carry no timestamps".to_owned()) };
            Ok((mean(&gaps), age))
        })?;
        match looked {
            Ok((interval, age)) => (report.frame_interval, report.frame_age) = (Ok(interval), age),
            Err(reason) => {
                (report.frame_interval, report.frame_age) = (Err(reason.clone()), Err(reason));
                // Frames that do not come are as none.
                self.frames = None;
            }
        }
        Ok(())
    }

    /// The next frame that is newer than the last.
    fn grab(&mut self, frame: &mut Frame) -> Result<()> {
        self.check()?;
        let Some(frames) = self.frames.as_mut() else {
            return Err(Error::NotFound { reason: "no frames were given".into() });
        };
        let now = self.clock.now();
        // At first from now on, then one after the other.
        let not_before = if self.last.is_finite() { self.last + 1e-6 } else { now };
        frames.next_frame(not_before, self.options.frames.timeout, frame)?;
        self.last = frame.timestamp;
        if self.clock.now() <= now && frame.timestamp.is_nan() {
            // A source that takes no time must not spin.
            self.clock.sleep(POLL);
        }
        Ok(())
    }

    /// How long the picture moves on after the device reports a pan's end.
    fn arrival(&mut self) -> Result<Measured> {
        if self.frames.is_none() {
            return Err(Error::NotFound { reason: "no frames were given".into() });
        }
        let mut times = Vec::new();
        let mut interval = 0.0f64;
        for sign in [-1.0, 1.0, -1.0] {
            self.settle(self.with(0, self.base[0] + sign * self.amplitude[0]), true)?;
            let target = self.with(0, self.base[0] - sign * self.amplitude[0]);
            self.send(target)?;
            let call = self.clock.now();
            loop {
                self.check()?;
                let motion = if self.capabilities.reports_motion { self.head.motion()? } else { Motion::Unknown };
                let r = self.read()?;
                let there = (r.at[0] - target[0]).abs() <= 1.01 * self.step(0);
                // The device's word: its motion state where it has one, else its position.
                let done = match motion {
                    Motion::Idle => true,
                    Motion::Unknown => there,
                    Motion::Moving | Motion::Failed => false,
                };
                if done {
                    break;
                }
                if r.time - call > self.options.settle.move_timeout {
                    return Err(Error::Device { reason: "the device does not report the end of a move".into() });
                }
            }
            let report = self.clock.now();
            let (moved_until, gap) = self.watch_until_still(report)?;
            times.push((moved_until - report).max(0.0));
            interval = interval.max(gap);
        }
        let mut m = mean(&times);
        // No better than a frame.
        m.sigma = m.sigma.max(interval / 12f64.sqrt());
        Ok(m)
    }

    /// Time of the last frame that differs from the one before, and the greatest gap between frames.
    fn watch_until_still(&mut self, since: f64) -> Result<(f64, f64)> {
        let [mut before, mut now] = [Frame::empty(), Frame::empty()];
        let (mut still, mut last_moving, mut gap) = (0, since, 0.0f64);
        let mut previous = f64::NAN;
        let begin = self.clock.now();
        while still < STILL_PAIRS {
            self.grab(&mut now)?;
            let arrived = self.clock.now();
            let time = if now.timestamp.is_finite() { now.timestamp } else { arrived };
            if time < since {
                continue;
            }
            if previous.is_finite() {
                gap = gap.max(time - previous);
                if shift_between(&before.image.view()?, &now.image.view()?, STILL)?.is_some() {
                    (still, last_moving) = (0, time);
                } else {
                    still += 1;
                }
            }
            previous = time;
            std::mem::swap(&mut before, &mut now);
            if arrived - begin > self.options.settle.move_timeout {
                return Err(Error::Device { reason: "the picture does not come to rest".into() });
            }
        }
        Ok((last_moving, gap))
    }

    /// From a pan's command to the first frame that shows it.
    fn first_sight(&mut self) -> Result<(Measured, Measured)> {
        let (mut times, mut counts) = (Vec::new(), Vec::new());
        for sign in [1.0, -1.0, 1.0, -1.0] {
            self.settle(self.with(0, self.base[0] - sign * self.amplitude[0]), true)?;
            let reference = self.pictures[1].clone();
            let target = self.with(0, self.base[0] + sign * self.amplitude[0]);
            let (time, count) = self.until_seen(
                |s| s.send(target),
                |now| Ok(shift_between(&reference.image.view()?, &now.image.view()?, 2.0 * STILL)?.is_some()),
            )?;
            times.push(time);
            counts.push(count);
        }
        Ok((mean(&times), mean(&counts)))
    }

    /// The same for the laser: off, on, off.
    fn laser_sight(&mut self) -> Result<(Measured, Measured)> {
        let open = |reason: &str| Error::NotFound { reason: reason.into() };
        if self.laser.is_none() {
            return Err(open("no laser was given"));
        }
        if !self.options.toggle_laser {
            return Err(open("switching the laser was not asked for"));
        }
        self.settle(self.base, true)?;
        let seen = self.laser_toggles();
        // Off, whatever happened; and it is heard of when that fails.
        let off = self.set_laser(false);
        off.and(seen)
    }

    fn laser_toggles(&mut self) -> Result<(Measured, Measured)> {
        self.set_laser(false)?;
        let (mut times, mut counts) = (Vec::new(), Vec::new());
        for _ in 0..3 {
            let mut reference = Frame::empty();
            // The last toggle must be out of the buffers.
            let since = self.clock.now() + 0.2;
            while !(reference.timestamp >= since || self.clock.now() >= since + 0.5) {
                self.grab(&mut reference)?;
            }
            let (time, count) = self
                .until_seen(|s| s.set_laser(true), |now| Ok(differs(&reference.image.view()?, &now.image.view()?)))?;
            self.set_laser(false)?;
            times.push(time);
            counts.push(count);
        }
        Ok((mean(&times), mean(&counts)))
    }

    fn set_laser(&mut self, on: bool) -> Result<()> {
        match self.laser.as_mut() {
            Some(laser) => laser.set(on),
            None => Ok(()),
        }
    }

    /// Seconds from the call to the delivery of the first frame that shows its effect, and the number of
    /// frames delivered until then.
    fn until_seen(
        &mut self,
        act: impl FnOnce(&mut Self) -> Result<()>,
        seen: impl Fn(&Frame) -> Result<bool>,
    ) -> Result<(f64, f64)> {
        let call = self.clock.now();
        act(self)?;
        let mut frame = Frame::empty();
        for count in 1..=MAX_FRAMES {
            self.grab(&mut frame)?;
            let now = self.clock.now();
            if seen(&frame)? {
                return Ok((now - call, count as f64));
            }
            if now - call > LASER_ON.min(self.options.frames.timeout) {
                break;
            }
        }
        Err(Error::NotFound { reason: "no frame shows it within a second".into() })
    }

    fn limit(&mut self, i: usize) -> Result<Measured> {
        if !self.options.reach_limits {
            return Err(Error::NotFound { reason: "going to the limits was not asked for".into() });
        }
        let (k, end) = (i / 2, i % 2);
        let at = self.settle(self.with(k, self.range(k)[end]), false)?;
        Ok(Measured { value: at[k], sigma: self.step(k) / 12f64.sqrt(), count: 1 })
    }
}

const AXES: [&str; 2] = ["pan", "tilt"];

/// Readings and pictures on returns from below and above.
#[derive(Default)]
struct Returns {
    readings: [Vec<f64>; 2],
    shifts: [Vec<Shift>; 2],
    error: f64,
}

fn figure(measured: std::result::Result<Measured, String>) -> Figure {
    measured
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

/// Mean and its standard deviation.
fn mean(values: &[f64]) -> Measured {
    let n = values.len() as f64;
    let value = values.iter().sum::<f64>() / n.max(1.0);
    let square = values.iter().map(|v| (v - value).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    Measured { value, sigma: (square / n.max(1.0)).sqrt(), count: values.len() as u32 }
}

/// Standard deviation within two groups, and that of it.
fn deviation(a: &[f64], b: &[f64]) -> Measured {
    let within = |v: &[f64]| {
        let m = mean(v).value;
        v.iter().map(|x| (x - m).powi(2)).sum::<f64>()
    };
    let freedom = (a.len() + b.len()).saturating_sub(2).max(1) as f64;
    let value = ((within(a) + within(b)) / freedom).sqrt();
    Measured { value, sigma: value / (2.0 * freedom).sqrt(), count: (a.len() + b.len()) as u32 }
}

/// Slope of a line through (time, angle), absolute.
fn slope(points: &[(f64, f64)]) -> Option<Measured> {
    let n = points.len() as f64;
    if points.len() < 4 {
        return None;
    }
    let (t, y) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let tt: f64 = points.iter().map(|p| (p.0 - t).powi(2)).sum();
    let ty: f64 = points.iter().map(|p| (p.0 - t) * (p.1 - y)).sum();
    if tt <= 0.0 {
        return None;
    }
    let value = ty / tt;
    let rest: f64 = points.iter().map(|p| (p.1 - y - value * (p.0 - t)).powi(2)).sum();
    Some(Measured { value: value.abs(), sigma: (rest / (n - 2.0) / tt).sqrt(), count: points.len() as u32 })
}
