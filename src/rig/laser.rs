//! Laser safety: whatever happens, the laser ends up off, or somebody hears about it.
//!
//! Only [`LaserControl`] talks to the laser. It lights it for the life of a [`LaserGuard`], refuses
//! while the head moves and after an emergency stop, limits how long and how often it is on, and
//! repeats a failed "off" before it reports it. Behind a callback it promises nothing when the process
//! is killed or the host never calls again: a laser on a GPIO line has a guard process for that
//! (`gpio://` addresses), others need hardware (a one-shot, a pull-down).

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, TryLockError};
use std::thread::ThreadId;
use std::time::{Duration, Instant};

use crate::control::{Cancel, Clock, Log, LogLevel, unpoisoned};
use crate::device::{Laser, LaserLimits, OnTimes};
use crate::error::{Error, Result};

/// A failed "off" is repeated this often, with this pause (seconds) before each.
const OFF_RETRIES: usize = 3;
const OFF_PAUSE: f64 = 0.02;
/// How long an emergency stop waits for a laser call of another thread.
const EMERGENCY_WAIT: Duration = Duration::from_secs(1);
/// How late a wait for the laser's share of time hears of a cancel, seconds.
const SLICE: f64 = 0.1;

/// The only way to the laser. Clones share the laser; any thread may use them.
#[derive(Clone)]
pub struct LaserControl(Arc<Shared>);

struct Shared {
    /// Set before anything else by an emergency stop, so that no lock can delay it.
    emergency: AtomicBool,
    /// The thread inside the laser's own call: it must not wait for itself.
    holder: Mutex<Option<ThreadId>>,
    state: Mutex<State>,
    clock: Arc<dyn Clock>,
    log: Log,
}

struct State {
    laser: Box<dyn Laser>,
    /// When (clock seconds) it is on, for all we know.
    times: OnTimes,
    /// Counts on-periods, so that a guard only ends its own.
    period: u64,
    refusal: Option<&'static str>,
    fault: Option<Error>,
}

const MOVING: &str = "the head is not known to stand still";
const CLOSED: &str = "the rig is closed";
const EMERGENCY: &str = "emergency stop";

fn refused(reason: impl Into<String>) -> Error {
    Error::LaserRefused { reason: reason.into() }
}

impl LaserControl {
    /// Takes over a laser and switches it off. The laser's own limits count as well.
    pub fn new(laser: Box<dyn Laser>, clock: Arc<dyn Clock>, log: Log, limits: &LaserLimits) -> Result<Self> {
        limits.validate()?;
        let times = OnTimes::new(limits.stricter(&laser.limits()));
        let state = State { laser, times, period: 0, refusal: None, fault: None };
        let control = Self(Arc::new(Shared {
            emergency: AtomicBool::new(false),
            holder: Mutex::new(None),
            state: Mutex::new(state),
            clock,
            log,
        }));
        control.0.lock().switch_off()?;
        Ok(control)
    }

    /// Switches the laser on until the guard is dropped.
    ///
    /// # Errors
    /// `LaserRefused` after an emergency stop, while the head moves, after a failed "off", when its
    /// share of time is used up, when closed; `Busy` while another guard is alive; the device's own error, with the laser off.
    pub fn light(&self) -> Result<LaserGuard> {
        let mut held = self.0.lock();
        self.check_emergency()?;
        if let Some(reason) = held.state.refusal {
            return Err(refused(reason));
        }
        if let Some(fault) = &held.state.fault {
            return Err(refused(fault.to_string()));
        }
        if held.is_on() {
            return Err(Error::Busy { what: "the laser" });
        }
        let now = self.0.clock.now();
        if let Some(reason) = held.state.times.refusal(now) {
            return Err(refused(reason));
        }
        held.state.period += 1;
        // Before the call: if it fails or panics, the laser may be on.
        held.state.times.begin(now);
        if let Err(error) = held.state.laser.set(true).and_then(|()| self.check_emergency()) {
            held.switch_off()?;
            return Err(error);
        }
        Ok(LaserGuard { control: self.clone(), period: held.state.period })
    }

    /// Switches off at once and refuses the laser until [`release`](Self::release). From any thread,
    /// also from inside a callback: inside the laser's own, the laser goes off as that call returns.
    ///
    /// # Errors
    /// When switching off failed, or another thread's laser call does not return within 1 s (that
    /// call then switches off when it does).
    pub fn emergency_off(&self) -> Result<()> {
        self.0.emergency.store(true, Ordering::SeqCst);
        let me = std::thread::current().id();
        let give_up = Instant::now() + EMERGENCY_WAIT;
        loop {
            match self.0.state.try_lock() {
                Ok(state) => return self.0.hold(state).switch_off(),
                Err(TryLockError::Poisoned(state)) => return self.0.hold(state.into_inner()).switch_off(),
                Err(TryLockError::WouldBlock) if *unpoisoned(&self.0.holder) == Some(me) => return Ok(()),
                Err(TryLockError::WouldBlock) if Instant::now() >= give_up => {
                    self.0.log.write(LogLevel::Error, || "emergency stop: the laser's driver does not return".into());
                    return Err(Error::DeviceTimeout { what: "laser", seconds: EMERGENCY_WAIT.as_secs_f64() });
                }
                Err(TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(1)),
            }
        }
    }

    /// Ends an emergency stop; the laser stays off until it is lit again.
    pub fn release(&self) -> Result<()> {
        self.0.lock().switch_off()?;
        self.0.emergency.store(false, Ordering::SeqCst);
        Ok(())
    }

    pub fn is_emergency(&self) -> bool {
        self.0.emergency.load(Ordering::SeqCst)
    }

    /// Is the laser on, or not known to be off?
    pub fn is_on(&self) -> bool {
        let held = self.0.lock();
        held.is_on() || held.state.fault.is_some()
    }

    /// Switches off, whoever lit it.
    pub fn off(&self) -> Result<()> {
        let mut held = self.0.lock();
        if held.is_on() || held.state.fault.is_some() { held.switch_off() } else { Ok(()) }
    }

    /// Switches off a laser that is on for longer than allowed, or that is no longer as it was set.
    /// Workflows call this whenever they regain control; a host may call it from a timer of its own.
    pub fn enforce(&self) -> Result<()> {
        let mut held = self.0.lock();
        if held.is_on() && (held.state.laser.check().is_err() || held.state.times.left(self.0.clock.now()) <= 0.0) {
            held.switch_off()?;
        }
        Ok(())
    }

    /// Lets time pass until the laser's share of it allows to light it for `needed` seconds.
    pub(super) fn wait_until_allowed(&self, needed: f64, cancel: &Cancel) -> Result<()> {
        loop {
            cancel.check()?;
            self.check_emergency()?;
            // Not under the lock: an emergency stop must not wait.
            let wait = self.0.lock().state.times.wait_for(self.0.clock.now(), needed);
            if wait <= 0.0 {
                return Ok(());
            }
            self.0.clock.sleep(wait.min(SLICE));
        }
    }

    /// Why the laser could not be switched off, while that lasts.
    pub fn fault(&self) -> Option<Error> {
        self.0.lock().state.fault.clone()
    }

    /// Off, and refused until [`end_move`](Self::end_move). An error means: do not move.
    pub(super) fn begin_move(&self) -> Result<()> {
        self.0.lock().state.refusal.get_or_insert(MOVING);
        self.off()
    }

    /// The head stands still again.
    pub(super) fn end_move(&self) {
        let mut held = self.0.lock();
        if held.state.refusal == Some(MOVING) {
            held.state.refusal = None;
        }
    }

    /// Off and refused for good.
    pub(super) fn close(&self) -> Result<()> {
        let mut held = self.0.lock();
        held.state.refusal = Some(CLOSED);
        held.switch_off()
    }

    pub(super) fn check_emergency(&self) -> Result<()> {
        if self.is_emergency() { Err(refused(EMERGENCY)) } else { Ok(()) }
    }
}

impl Shared {
    fn lock(&self) -> Held<'_> {
        self.hold(unpoisoned(&self.state))
    }

    fn hold<'a>(&'a self, state: MutexGuard<'a, State>) -> Held<'a> {
        *unpoisoned(&self.holder) = Some(std::thread::current().id());
        Held { state, shared: self }
    }
}

impl Drop for Shared {
    fn drop(&mut self) {
        // No clone is left, so a guard cannot be either; this is for a failed "off" before.
        let _ = self.lock().switch_off();
    }
}

/// The locked laser. Leaving it switches off when an emergency stop came in or a panic goes out.
struct Held<'a> {
    state: MutexGuard<'a, State>,
    shared: &'a Shared,
}

impl Held<'_> {
    fn is_on(&self) -> bool {
        self.state.times.since().is_some()
    }

    fn switch_off(&mut self) -> Result<()> {
        let mut reason = String::new();
        for attempt in 0..=OFF_RETRIES {
            if attempt > 0 {
                self.shared.clock.sleep(OFF_PAUSE);
            }
            let laser = &mut self.state.laser;
            // A driver that panics here must not stop the retries, nor abort while unwinding.
            match catch_unwind(AssertUnwindSafe(|| laser.set(false))) {
                Ok(Ok(())) => {
                    self.state.times.end(self.shared.clock.now());
                    self.state.fault = None;
                    return Ok(());
                }
                Ok(Err(error)) => reason = error.to_string(),
                Err(_) => reason = "its driver panicked".into(),
            }
        }
        let error = Error::Device {
            reason: format!("THE LASER MAY BE ON: switching it off failed {} times ({reason})", OFF_RETRIES + 1),
        };
        self.state.fault = Some(error.clone());
        self.shared.log.write(LogLevel::Error, || error.to_string());
        Err(error)
    }
}

impl Drop for Held<'_> {
    fn drop(&mut self) {
        let emergency = self.shared.emergency.load(Ordering::SeqCst);
        if self.is_on() && self.state.fault.is_none() && (emergency || std::thread::panicking()) {
            // A failure is kept in `fault` and logged.
            let _ = self.switch_off();
        }
        *unpoisoned(&self.shared.holder) = None;
    }
}

/// The laser is on while this lives; dropping it switches off, also when unwinding.
#[must_use = "dropping the guard switches the laser off"]
pub struct LaserGuard {
    control: LaserControl,
    period: u64,
}

impl LaserGuard {
    /// Seconds that the laser may still stay on.
    ///
    /// # Errors
    /// `DeviceTimeout` when its longest time on is over (it goes off), `LaserRefused` when its share
    /// of time is used up or it was switched off by others: an emergency stop, a guard; the device's
    /// own when it is lost. A frame taken meanwhile is not to be trusted.
    pub fn time_left(&self) -> Result<f64> {
        let shared = &self.control.0;
        let mut held = shared.lock();
        self.control.check_emergency()?;
        let Some(since) = held.state.times.since().filter(|_| held.state.period == self.period) else {
            return Err(refused("it was switched off meanwhile"));
        };
        if let Err(error) = held.state.laser.check() {
            held.switch_off()?;
            return Err(error);
        }
        let now = shared.clock.now();
        let left = held.state.times.left(now);
        if left > 0.0 {
            return Ok(left);
        }
        let LaserLimits { max_on, duty, window } = *held.state.times.limits();
        held.switch_off()?;
        if now - since >= max_on {
            return Err(Error::DeviceTimeout { what: "frame while the laser may be on", seconds: max_on });
        }
        Err(refused(format!("it was on for {duty} of the last {window} s")))
    }

    /// Switches off and says so when that failed.
    pub fn off(self) -> Result<()> {
        self.end()
    }

    fn end(&self) -> Result<()> {
        let mut held = self.control.0.lock();
        let mine = held.state.period == self.period;
        // After a failed attempt each chance is used again.
        if mine && held.is_on() { held.switch_off() } else { Ok(()) }
    }
}

impl Drop for LaserGuard {
    fn drop(&mut self) {
        // A failure is kept in `fault`, logged, and makes `light` refuse.
        let _ = self.end();
    }
}
