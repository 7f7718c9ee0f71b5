//! Clocks for tests and emulated devices: one that stands until somebody waits, and the system's at
//! another speed.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crate::control::{Clock, unpoisoned};

/// Virtual time: it passes when something sleeps. Clones share it.
#[derive(Debug, Clone, Default)]
pub struct VirtualClock(Arc<Mutex<f64>>);

impl Clock for VirtualClock {
    fn now(&self) -> f64 {
        *unpoisoned(&self.0)
    }

    fn sleep(&self, seconds: f64) {
        if seconds > 0.0 && seconds.is_finite() {
            *unpoisoned(&self.0) += seconds;
        }
    }
}

/// The system's monotonic clock, counted from its creation and made faster or slower.
#[derive(Debug, Clone)]
pub struct ScaledClock {
    start: Instant,
    factor: f64,
}

/// Longest single sleep, real seconds.
const LONGEST_SLEEP: f64 = 3600.0;

impl ScaledClock {
    /// Its time runs `factor` times as fast as the system's; one that is no positive number counts
    /// as 1.
    pub fn new(factor: f64) -> Self {
        let factor = if factor > 0.0 && factor.is_finite() { factor } else { 1.0 };
        Self { start: Instant::now(), factor }
    }
}

impl Clock for ScaledClock {
    fn now(&self) -> f64 {
        self.start.elapsed().as_secs_f64() * self.factor
    }

    fn sleep(&self, seconds: f64) {
        if seconds > 0.0 {
            std::thread::sleep(Duration::from_secs_f64((seconds / self.factor).min(LONGEST_SLEEP)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn virtual_time_passes_when_somebody_waits() {
        let clock = VirtualClock::default();
        clock.clone().sleep(2.5);
        for nothing in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            clock.sleep(nothing);
        }
        assert_eq!(clock.now(), 2.5);
    }

    #[test]
    fn scaled_time_runs_faster() {
        let (clock, start) = (ScaledClock::new(50.0), Instant::now());
        let before = clock.now();
        clock.sleep(1.0);
        let (virtual_time, real) = (clock.now() - before, start.elapsed().as_secs_f64());
        assert!(virtual_time >= 1.0 && real >= 0.02, "{virtual_time} s in {real} s");
        assert!(virtual_time <= 50.0 * real);
        assert_eq!(ScaledClock::new(f64::NAN).factor, 1.0);
    }
}
