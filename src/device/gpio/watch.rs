//! The guard's judgement: when a laser may be on and when it goes off. No clock, no device of its own.

use std::io;

use crate::device::laser_limits::{LaserLimits, OnTimes};

/// A line that switches a laser.
pub trait Output: Send {
    /// Drives it active (laser on) or inactive.
    fn drive(&mut self, active: bool) -> io::Result<()>;
}

/// What became of a command, or of the laser by itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    On,
    Off,
    /// It stays off, for this reason.
    Refused(String),
    /// It went off without a command, for this reason.
    WentOff(String),
    /// The line was not driven: the operating system's error number.
    Fault(i32),
}

/// How often the host is looked at while the laser is on, and a failed "off" is tried again, seconds.
const LOOK_EVERY: f64 = 0.02;

/// Lights a laser within its limits. Times are seconds of one clock.
pub struct Watch<O: Output> {
    output: O,
    times: OnTimes,
    /// The line is active, for all we know: from before it is driven until it was driven inactive.
    lit: bool,
    forbidden: Option<String>,
}

impl<O: Output> Watch<O> {
    /// Of a line that is inactive.
    pub fn new(output: O, limits: LaserLimits) -> Self {
        Self { output, times: OnTimes::new(limits), lit: false, forbidden: None }
    }

    /// A laser that is on stays so, and its time on goes on counting.
    pub fn on(&mut self, now: f64) -> Outcome {
        if let Some(reason) = &self.forbidden {
            return Outcome::Refused(reason.clone());
        }
        if self.times.since().is_some() && self.times.left(now) > 0.0 {
            return Outcome::On;
        }
        if self.lit {
            // Its time is over, or it did not go off.
            if let Err(error) = self.extinguish(now) {
                return fault(&error);
            }
        }
        if let Some(reason) = self.times.refusal(now) {
            return Outcome::Refused(reason);
        }
        self.lit = true;
        self.times.begin(now);
        match self.output.drive(true) {
            Ok(()) => Outcome::On,
            Err(error) => {
                let _ = self.extinguish(now);
                fault(&error)
            }
        }
    }

    pub fn off(&mut self, now: f64) -> Outcome {
        match self.extinguish(now) {
            Ok(()) => Outcome::Off,
            Err(error) => fault(&error),
        }
    }

    /// Switches off when a limit is reached or the host does not run (`host_stands`, only asked while
    /// the laser is on).
    pub fn look(&mut self, now: f64, host_stands: impl FnOnce() -> bool) -> Option<Outcome> {
        if !self.lit {
            return None;
        }
        let limits = self.times.limits();
        let reason = match self.times.since() {
            None => "an earlier \"off\" had failed".to_owned(),
            Some(since) if now - since >= limits.max_on => format!("its longest time on, {} s, is over", limits.max_on),
            Some(_) if self.times.left(now) <= 0.0 => {
                format!("it was on for {} of the last {} s", limits.duty, limits.window)
            }
            Some(_) if host_stands() => "the process that lit it stands still".to_owned(),
            Some(_) => return None,
        };
        self.extinguish(now).ok().map(|()| Outcome::WentOff(reason))
    }

    /// Seconds until [`look`](Self::look) has to be called; `None` while the laser is off.
    pub fn next_look(&self, now: f64) -> Option<f64> {
        self.lit.then(|| self.times.left(now).clamp(0.001, LOOK_EVERY))
    }

    /// Off, and refused from now on.
    pub fn forbid(&mut self, now: f64, reason: &str) -> Option<Outcome> {
        self.forbidden.get_or_insert_with(|| reason.to_owned());
        let was_lit = self.lit;
        self.extinguish(now).ok().filter(|()| was_lit).map(|()| Outcome::WentOff(reason.to_owned()))
    }

    fn extinguish(&mut self, now: f64) -> io::Result<()> {
        let driven = self.output.drive(false);
        if driven.is_ok() {
            self.lit = false;
        }
        self.times.end(now);
        driven
    }
}

impl<O: Output> Drop for Watch<O> {
    fn drop(&mut self) {
        // Three times, then whoever waits for the guard's end tries it.
        let _ = (0..3).find(|_| self.output.drive(false).is_ok());
    }
}

fn fault(error: &io::Error) -> Outcome {
    Outcome::Fault(error.raw_os_error().unwrap_or(libc::EIO))
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;

    /// A line that remembers, and fails when told.
    #[derive(Clone, Default)]
    struct Line(Arc<Mutex<(bool, usize)>>);

    impl Line {
        fn high(&self) -> bool {
            self.0.lock().unwrap().0
        }
        fn fail(&self, times: usize) {
            self.0.lock().unwrap().1 = times;
        }
    }

    impl Output for Line {
        fn drive(&mut self, active: bool) -> io::Result<()> {
            let mut state = self.0.lock().unwrap();
            if state.1 > 0 {
                state.1 -= 1;
                return Err(io::Error::from_raw_os_error(libc::ENODEV));
            }
            state.0 = active;
            Ok(())
        }
    }

    fn watch(limits: LaserLimits) -> (Line, Watch<Line>) {
        let line = Line::default();
        (line.clone(), Watch::new(line, limits))
    }

    #[test]
    fn the_longest_time_on_is_kept_however_often_it_is_lit() {
        let (line, mut watch) = watch(LaserLimits::default());
        assert_eq!((watch.next_look(0.0), watch.look(0.0, || true)), (None, None));
        assert_eq!(watch.on(1.0), Outcome::On);
        assert!(line.high() && watch.next_look(1.0).unwrap() <= LOOK_EVERY);
        // Saying it again does not lengthen the lease.
        assert_eq!(watch.on(2.9), Outcome::On);
        assert_eq!(watch.look(2.99, || false), None);
        let Some(Outcome::WentOff(reason)) = watch.look(3.0, || false) else { panic!("still on") };
        assert!(reason.contains("longest time") && !line.high());
        assert_eq!(watch.look(3.1, || false), None);
        assert_eq!(watch.on(3.2), Outcome::On);
        assert_eq!((watch.off(3.3), line.high()), (Outcome::Off, false));
        drop(watch);
    }

    #[test]
    fn a_host_that_stands_still_a_signal_and_the_end_switch_off() {
        let (line, mut watch) = watch(LaserLimits::default());
        watch.on(0.0);
        assert!(matches!(watch.look(0.02, || true), Some(Outcome::WentOff(_))) && !line.high());
        watch.on(1.0);
        assert_eq!(watch.forbid(1.1, "signal 15"), Some(Outcome::WentOff("signal 15".into())));
        assert!(!line.high());
        assert_eq!(watch.on(1.2), Outcome::Refused("signal 15".into()));
        assert_eq!(watch.forbid(1.3, "signal 2"), None);
        assert!(!line.high());

        let (line, mut watch) = self::watch(LaserLimits::default());
        watch.on(0.0);
        drop(watch);
        assert!(!line.high());
    }

    #[test]
    fn an_off_that_failed_is_repeated_and_reported() {
        let (line, mut watch) = watch(LaserLimits::default());
        watch.on(0.0);
        line.fail(2);
        assert_eq!(watch.off(0.1), Outcome::Fault(libc::ENODEV));
        assert!(line.high() && watch.lit && watch.next_look(0.1).is_some());
        assert_eq!(watch.look(0.12, || false), None);
        assert!(matches!(watch.look(0.14, || false), Some(Outcome::WentOff(_))));
        assert!(!line.high() && !watch.lit);
        // An "on" that failed leaves it off.
        line.fail(1);
        assert_eq!(watch.on(1.0), Outcome::Fault(libc::ENODEV));
        assert!(!line.high() && !watch.lit);
        // At the end it is tried three times.
        watch.on(2.0);
        line.fail(2);
        drop(watch);
        assert!(!line.high());
    }

    #[test]
    fn the_share_of_time_is_kept() {
        let (line, mut watch) = watch(LaserLimits { max_on: 2.0, duty: 0.1, window: 10.0 });
        watch.on(0.0);
        assert!(matches!(watch.look(1.0, || false), Some(Outcome::WentOff(_))));
        let Outcome::Refused(reason) = watch.on(1.5) else { panic!("lit again") };
        assert!(reason.contains("wait") && !line.high());
        assert_eq!(watch.on(10.11), Outcome::On);
    }
}
