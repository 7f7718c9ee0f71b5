//! What the frames tell: their pace and age, when a picture comes to rest, and how long a command or the
//! laser takes to be seen.

use super::super::report::{Measured, ProbeReport};
use super::super::shift::differs;
use super::super::statistics::mean;
use super::{POLL, Session, both};
use crate::device::{Frame, Motion};
use crate::error::{Error, Result};
use crate::rig::laser::LaserGuard;
use crate::rig::stillness::shift_between;

/// Frames that are looked at for the first sign of a change, at most.
const MAX_FRAMES: usize = 120;
/// Greatest shift between frames of a still picture, px.
const STILL: f64 = 0.3;
/// Consecutive pairs of frames that must be still.
const STILL_PAIRS: usize = 3;
/// Longest time the laser is on, seconds.
const LASER_ON: f64 = 1.0;

impl Session<'_, '_> {
    pub(super) fn look_at_frames(&mut self, report: &mut ProbeReport) -> Result<()> {
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
        if looked.is_err() {
            // Frames that do not come are as none.
            self.frames = None;
        }
        let (interval, age) = both(looked);
        (report.frame_interval, report.frame_age) = (interval, age.flatten());
        Ok(())
    }

    /// The next frame that is newer than the last.
    pub(super) fn grab(&mut self, frame: &mut Frame) -> Result<()> {
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
    pub(super) fn arrival(&mut self) -> Result<Measured> {
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
    pub(super) fn first_sight(&mut self) -> Result<(Measured, Measured)> {
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
    pub(super) fn laser_sight(&mut self) -> Result<(Measured, Measured)> {
        let open = |reason: &str| Error::NotFound { reason: reason.into() };
        let Some(laser) = self.laser else { return Err(open("no laser was given")) };
        if !self.options.toggle_laser {
            return Err(open("switching the laser was not asked for"));
        }
        self.settle(self.base, true)?;
        let (mut times, mut counts) = (Vec::new(), Vec::new());
        for _ in 0..3 {
            let mut reference = Frame::empty();
            // The last toggle must be out of the buffers.
            let since = self.clock.now() + 0.2;
            while !(reference.timestamp >= since || self.clock.now() >= since + 0.5) {
                self.grab(&mut reference)?;
            }
            let mut guard = None;
            let seen = self.until_seen(
                |_| laser.light().map(|lit| guard = Some(lit)),
                |now| Ok(differs(&reference.image.view()?, &now.image.view()?)),
            );
            // Off, whatever happened; and it is heard of when that fails.
            guard.map_or(Ok(()), LaserGuard::off)?;
            let (time, count) = seen?;
            times.push(time);
            counts.push(count);
        }
        Ok((mean(&times), mean(&counts)))
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
}
