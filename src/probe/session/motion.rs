//! What readings of the position tell of the head's motion.

use super::super::report::{Figure, Measured};
use super::super::statistics::{mean, slope};
use super::{Reading, Session};
use crate::error::{Error, Result};
use crate::rig::settle::read_position;

/// A head that has not begun to move by then does not, seconds.
const NO_START: f64 = 2.0;
/// Most doublings of the smallest move.
const DOUBLINGS: i32 = 20;
/// Speed of a head that does not tell its greatest, radians per second: faster than any that is sold.
const FASTEST: f64 = 12.0;
const AXES: [&str; 2] = ["pan", "tilt"];

impl Session<'_, '_> {
    pub(super) fn position_time(&mut self) -> Result<Measured> {
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
    pub(super) fn sweep(&mut self, k: usize) -> Result<(Figure, Figure, std::result::Result<bool, String>)> {
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

    /// Ever larger moves upwards until a reading shows one.
    pub(super) fn smallest_move(&mut self, k: usize) -> Result<Measured> {
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

    /// STOP in the middle of a pan: how far and how long the readings go on.
    pub(super) fn stopping(&mut self) -> Result<(Measured, Measured)> {
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

    pub(super) fn limit(&mut self, i: usize) -> Result<Measured> {
        if !self.options.reach_limits {
            return Err(Error::NotFound { reason: "going to the limits was not asked for".into() });
        }
        let (k, end) = (i / 2, i % 2);
        let at = self.settle(self.with(k, self.range(k)[end]), false)?;
        Ok(Measured { value: at[k], sigma: self.step(k) / 12f64.sqrt(), count: 1 })
    }
}
