//! How long a laser may be on: at one time, and as a share of the time.

use std::collections::VecDeque;

use crate::error::{Error, Result};

/// Limits of a laser's time on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LaserLimits {
    /// Longest time on at once, seconds.
    pub max_on: f64,
    /// Greatest share of any `window` seconds that it may be on; 1 is no limit.
    pub duty: f64,
    /// Seconds.
    pub window: f64,
}

impl LaserLimits {
    pub const DEFAULT_MAX_ON: f64 = 2.0;
    pub const DEFAULT_WINDOW: f64 = 10.0;
    /// What a laser without limits of its own says.
    pub const NONE: Self = Self { max_on: f64::INFINITY, duty: 1.0, window: Self::DEFAULT_WINDOW };

    pub fn validate(&self) -> Result<()> {
        let Self { max_on, duty, window } = *self;
        if !(max_on > 0.0 && max_on <= 3600.0) {
            return Err(Error::invalid("laser_max_on", format!("{max_on} s is not in (0, 3600]")));
        }
        if !(duty > 0.0 && duty <= 1.0) {
            return Err(Error::invalid("laser_duty", format!("{duty} is not in (0, 1]")));
        }
        if !(window > 0.0 && window <= 3600.0) {
            return Err(Error::invalid("laser_duty_window", format!("{window} s is not in (0, 3600]")));
        }
        Ok(())
    }

    /// The shorter time on at once, and the smaller share.
    pub fn stricter(&self, other: &Self) -> Self {
        let share = if other.duty < self.duty { other } else { self };
        Self { max_on: self.max_on.min(other.max_on), duty: share.duty, window: share.window }
    }

    /// Seconds on in a window.
    fn budget(&self) -> f64 {
        if self.duty < 1.0 { self.duty * self.window } else { f64::INFINITY }
    }
}

impl Default for LaserLimits {
    fn default() -> Self {
        Self { max_on: Self::DEFAULT_MAX_ON, ..Self::NONE }
    }
}

/// Least share of a window's budget with which a laser is lit: no shavings of light.
const LEAST_SHARE: f64 = 0.1;
/// Periods remembered. Beyond it the two oldest count as one that was on throughout.
const MAX_PERIODS: usize = 256;

/// When a laser was on, of late. Times are seconds of any one clock.
#[derive(Debug, Clone)]
pub struct OnTimes {
    limits: LaserLimits,
    since: Option<f64>,
    /// Begin and end, oldest first.
    past: VecDeque<[f64; 2]>,
}

impl OnTimes {
    pub fn new(limits: LaserLimits) -> Self {
        Self { limits, since: None, past: VecDeque::new() }
    }

    pub fn limits(&self) -> &LaserLimits {
        &self.limits
    }

    /// Since when it is on.
    pub fn since(&self) -> Option<f64> {
        self.since
    }

    pub fn begin(&mut self, now: f64) {
        self.since.get_or_insert(now);
    }

    pub fn end(&mut self, now: f64) {
        let Some(since) = self.since.take() else { return };
        if self.limits.duty >= 1.0 {
            return;
        }
        let forgotten = now - self.limits.window;
        self.past.retain(|&[_, end]| end > forgotten);
        self.past.push_back([since, now]);
        if self.past.len() > MAX_PERIODS
            && let (Some(oldest), Some(next)) = (self.past.pop_front(), self.past.front_mut())
        {
            next[0] = oldest[0];
        }
    }

    /// Seconds that it may stay on from now, or could if it were lit now; not above 0 when it has to
    /// go off. Exact, or too small when earlier periods leave the window meanwhile: ask again then.
    pub fn left(&self, now: f64) -> f64 {
        let at_once = self.limits.max_on - self.since.map_or(0.0, |since| now - since);
        at_once.min(self.limits.budget() - self.used(now))
    }

    /// Seconds until it may be lit.
    pub fn wait(&self, now: f64) -> f64 {
        self.wait_for(now, 0.0)
    }

    /// Seconds until it may be lit for `needed` seconds (cut to the whole budget).
    pub fn wait_for(&self, now: f64, needed: f64) -> f64 {
        let budget = self.limits.budget();
        if budget.is_infinite() {
            return 0.0;
        }
        let mut excess = self.used(now) - (budget - needed.clamp(LEAST_SHARE * budget, budget));
        for &[begin, end] in &self.past {
            let begin = begin.max(now - self.limits.window);
            if excess <= 0.0 {
                break;
            }
            if excess <= end - begin {
                return begin + excess + self.limits.window - now;
            }
            excess -= (end - begin).max(0.0);
        }
        0.0
    }

    /// Why it may not be lit now, with the time to wait.
    pub fn refusal(&self, now: f64) -> Option<String> {
        let LaserLimits { duty, window, .. } = self.limits;
        let wait = self.wait(now);
        (wait > 0.0).then(|| format!("it was on for {duty} of the last {window} s: wait {wait:.2} s"))
    }

    /// Seconds on within the window that ends now.
    fn used(&self, now: f64) -> f64 {
        let current = self.since.map(|since| [since, now]);
        let begin = now - self.limits.window;
        self.past.iter().chain(&current).map(|&[from, to]| (to - from.max(begin)).max(0.0)).sum()
    }
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_core::{Rng, SeedableRng};

    use super::*;

    #[test]
    fn without_a_share_only_the_time_at_once_counts() {
        let mut times = OnTimes::new(LaserLimits::default());
        for k in 0..1000 {
            let now = f64::from(k) * 2.0;
            assert_eq!(times.wait(now), 0.0);
            times.begin(now);
            assert!((times.left(now + 1.5) - 0.5).abs() < 1e-9);
            times.end(now + 2.0);
        }
        assert!(times.past.is_empty());
    }

    #[test]
    fn the_share_is_never_exceeded_in_any_window() {
        // A laser that is lit whenever it may be, with pauses at random, against a fine raster of time.
        for (seed, duty) in [(1, 0.5), (2, 0.1), (3, 0.9)] {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let limits = LaserLimits { max_on: 2.0, duty, window: 10.0 };
            let mut times = OnTimes::new(limits);
            const STEP: f64 = 1e-3;
            let mut lit = Vec::new();
            let mut until = 0.0;
            for k in 0..60_000 {
                let now = f64::from(k) * STEP;
                if times.since().is_some() && (times.left(now) <= 0.0 || now >= until) {
                    times.end(now);
                    until = now + f64::from(random.next_u32() % 700) * STEP;
                } else if times.since().is_none() && now >= until && times.wait(now) <= 0.0 {
                    times.begin(now);
                    until = now + f64::from(random.next_u32() % 3000) * STEP;
                }
                lit.push(times.since().is_some());
            }
            let window = (limits.window / STEP) as usize;
            let mut on = 0;
            let mut most = 0;
            for k in 0..lit.len() {
                on += usize::from(lit[k]);
                on -= usize::from(k >= window && lit[k - window]);
                most = most.max(on);
            }
            let share = most as f64 / window as f64;
            // One step of the raster too many at most for each period in the window.
            assert!(share <= duty + 0.01, "{share} of {duty}");
            assert!(share > 0.9 * duty, "{share} of {duty}: more than needed is refused");
        }
    }

    #[test]
    fn the_wait_is_as_long_as_it_says() {
        let mut times = OnTimes::new(LaserLimits { max_on: 2.0, duty: 0.2, window: 10.0 });
        times.begin(0.0);
        times.end(1.0);
        times.begin(3.0);
        assert!((times.left(3.5) - 0.5).abs() < 1e-9);
        times.end(4.0);
        // 2 of 2 s are used; a tenth (0.2 s) is free when the first 0.2 s are 10 s ago.
        assert!((times.wait(5.0) - 5.2).abs() < 1e-9);
        assert!(times.refusal(5.0).unwrap().contains("5.20 s"));
        assert!(times.wait(10.199) > 0.0 && times.wait(10.2001) <= 0.0);
        assert!(times.refusal(10.21).is_none());
    }

    #[test]
    fn many_periods_are_counted_with_their_gaps_and_not_remembered() {
        let mut times = OnTimes::new(LaserLimits { max_on: 2.0, duty: 0.5, window: 100.0 });
        for k in 0..10_000 {
            times.begin(f64::from(k) * 1e-3);
            times.end(f64::from(k) * 1e-3 + 1e-4);
        }
        assert!(times.past.len() <= MAX_PERIODS);
        assert!(times.used(10.0) >= 1.0);
    }

    #[test]
    fn nonsense_is_refused() {
        let good = LaserLimits::default();
        assert!(good.validate().is_ok());
        for bad in [
            LaserLimits { max_on: 0.0, ..good },
            LaserLimits { max_on: f64::NAN, ..good },
            LaserLimits { max_on: 4000.0, ..good },
            LaserLimits { duty: 0.0, ..good },
            LaserLimits { duty: 1.1, ..good },
            LaserLimits { window: 0.0, ..good },
            LaserLimits { window: f64::INFINITY, ..good },
        ] {
            assert!(matches!(bad.validate(), Err(Error::InvalidArgument { .. })), "{bad:?}");
        }
        let duty = LaserLimits { max_on: 3.0, duty: 0.3, window: 5.0 };
        assert_eq!(good.stricter(&duty), LaserLimits { max_on: 2.0, duty: 0.3, window: 5.0 });
        assert_eq!(duty.stricter(&good), good.stricter(&duty));
    }
}
