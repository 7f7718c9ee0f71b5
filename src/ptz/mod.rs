//! Pan-tilt-zoom control as an operator uses it: drive with a joystick, absolute and relative moves,
//! presets, and a stop that waits for nobody.
//!
//! A [`Head`] may be used by any number of threads. It has one thread of its own, from its first
//! move until it is dropped: this stops a drive that nobody renewed (the dead man's time-out) and
//! watches moves until they end.

mod end;
mod watch;

#[cfg(test)]
mod tests;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError, TryLockError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

pub use end::{MoveEnd, MoveEvent};
use watch::{Duty, Goal};

use crate::control::{Cancel, Log, unpoisoned};
use crate::device::{Brake, Focus, Identity, Motion, PanTiltZoom, PtzCapabilities, PtzPosition, PtzVelocity};
use crate::error::{Error, Result};

/// Longest dead man's time-out, seconds.
pub const MAX_DEAD_MAN: f64 = 60.0;

/// Receives the end of each move, on the head's own thread and under no lock.
pub type OnMoveEnd = Box<dyn Fn(&MoveEvent) + Send + Sync>;

/// An open pan-tilt head. Dropping it stops the head.
pub struct Head {
    shared: Arc<Shared>,
    worker: Mutex<Option<JoinHandle<()>>>,
}

struct Shared {
    ptz: Mutex<Box<dyn PanTiltZoom>>,
    brake: Option<Arc<dyn Brake>>,
    capabilities: PtzCapabilities,
    log: Log,
    /// Counts stops, so that a command that was under way meanwhile is stopped after it.
    stops: AtomicU64,
    /// The last stop that reached the device.
    stopped: AtomicU64,
    duty: Mutex<Duty>,
    wake: Condvar,
    on_end: Option<OnMoveEnd>,
}

impl Head {
    /// Takes a head over; it does not move.
    pub fn new(ptz: Box<dyn PanTiltZoom>, log: Log, on_end: Option<OnMoveEnd>) -> Self {
        let shared = Shared {
            brake: ptz.brake(),
            capabilities: ptz.capabilities(),
            ptz: Mutex::new(ptz),
            log,
            stops: AtomicU64::new(0),
            stopped: AtomicU64::new(0),
            duty: Mutex::new(Duty::default()),
            wake: Condvar::new(),
            on_end,
        };
        Self { shared: Arc::new(shared), worker: Mutex::new(None) }
    }

    pub fn capabilities(&self) -> &PtzCapabilities {
        &self.shared.capabilities
    }

    pub fn identity(&self) -> Result<Identity> {
        self.shared.with(|ptz| ptz.identity())
    }

    pub fn position(&self) -> Result<PtzPosition> {
        self.shared.position()
    }

    pub fn motion(&self) -> Result<Motion> {
        self.shared.with(|ptz| ptz.motion())
    }

    /// Starts a move and returns its number.
    ///
    /// # Errors
    /// `NotFinite`; `Unreachable`, with the range; the device's own.
    pub fn move_absolute(&self, pan: f64, tilt: f64) -> Result<u64> {
        crate::rig::check_reach(&self.shared.capabilities, pan, tilt)?;
        self.start(Goal::At { pan, tilt }, |ptz| ptz.move_absolute(pan, tilt))
    }

    /// Starts a move by angles from where the head is and returns its number.
    ///
    /// # Errors
    /// As [`move_absolute`](Self::move_absolute).
    pub fn move_relative(&self, pan: f64, tilt: f64) -> Result<u64> {
        if let Some(index) = [pan, tilt].iter().position(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name: "pan, tilt", index });
        }
        let from = self.position()?;
        let (to_pan, to_tilt) = (from.pan + pan, from.tilt + tilt);
        crate::rig::check_reach(&self.shared.capabilities, to_pan, to_tilt)?;
        let relative = self.shared.capabilities.has_relative;
        self.start(Goal::At { pan: to_pan, tilt: to_tilt }, |ptz| {
            if relative { ptz.move_relative(pan, tilt) } else { ptz.move_absolute(to_pan, to_tilt) }
        })
    }

    /// Starts a move that brings a place of the present picture to its centre, and returns its number: `x`
    /// and `y` from -1 to 1, from the centre to the picture's right and upper edge.
    ///
    /// # Errors
    /// `NotFinite`, `InvalidArgument`; `Unsupported`; the device's own.
    pub fn move_in_view(&self, x: f64, y: f64) -> Result<u64> {
        for (name, value) in [("x", x), ("y", y)] {
            if !value.is_finite() {
                return Err(Error::NotFinite { name, index: 0 });
            }
            if value.abs() > 1.0 {
                return Err(Error::invalid(name, format!("{value} is not in [-1, 1]")));
            }
        }
        self.start(Goal::Anywhere, |ptz| ptz.move_in_view(x, y))
    }

    /// Drives at a speed until told otherwise, and at most `dead_man` seconds after the last call: a
    /// host that hangs or loses its operator lets go. Call it again to go on.
    ///
    /// # Errors
    /// `NotFinite`, `InvalidArgument`; `Unsupported`; the device's own.
    pub fn drive(&self, velocity: PtzVelocity, dead_man: f64) -> Result<u64> {
        let PtzVelocity { pan, tilt, zoom } = velocity;
        if let Some(index) = [pan, tilt, zoom].iter().position(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name: "velocity", index });
        }
        if zoom.abs() > 1.0 {
            return Err(Error::invalid("velocity.zoom", format!("{zoom} is not in [-1, 1]")));
        }
        if !(dead_man > 0.0 && dead_man <= MAX_DEAD_MAN) {
            return Err(Error::invalid("dead_man", format!("{dead_man} s is not in (0, {MAX_DEAD_MAN}]")));
        }
        if pan == 0.0 && tilt == 0.0 && zoom == 0.0 {
            self.stop()?;
            return Ok(unpoisoned(&self.shared.duty).number());
        }
        let until = Instant::now() + Duration::from_secs_f64(dead_man);
        self.start(Goal::Drive { until }, |ptz| ptz.drive(velocity, dead_man))
    }

    pub fn home(&self) -> Result<u64> {
        self.start(Goal::Anywhere, |ptz| ptz.home())
    }

    /// Starts zooming, 0 (wide) to 1 (tele).
    pub fn set_zoom(&self, zoom: f64) -> Result<u64> {
        in_unit("zoom", zoom)?;
        self.start(Goal::Anywhere, |ptz| ptz.set_zoom(zoom))
    }

    pub fn set_focus(&self, focus: Focus) -> Result<()> {
        if let Focus::At(at) = focus {
            in_unit("focus", at)?;
        }
        self.shared.with(|ptz| ptz.set_focus(focus))
    }

    pub fn focus(&self) -> Result<f64> {
        self.shared.with(|ptz| ptz.focus())
    }

    pub fn lock_exposure(&self, locked: bool) -> Result<()> {
        self.shared.with(|ptz| ptz.lock_exposure(locked))
    }

    pub fn store_preset(&self, preset: u32) -> Result<()> {
        self.check_preset(preset)?;
        self.shared.with(|ptz| ptz.store_preset(preset))
    }

    /// Starts a move to a preset and returns its number.
    pub fn recall_preset(&self, preset: u32) -> Result<u64> {
        self.check_preset(preset)?;
        self.start(Goal::Anywhere, |ptz| ptz.recall_preset(preset))
    }

    pub fn clear_preset(&self, preset: u32) -> Result<()> {
        self.check_preset(preset)?;
        self.shared.with(|ptz| ptz.clear_preset(preset))
    }

    fn check_preset(&self, preset: u32) -> Result<()> {
        match self.shared.capabilities.presets {
            0 => Err(Error::Unsupported { what: "presets by this device".into() }),
            n if preset >= n => Err(Error::invalid("preset", format!("{preset} is not in 0 to {}", n - 1))),
            _ => Ok(()),
        }
    }

    /// Stops pan, tilt and zoom. It waits neither for an answer nor for another thread's call: where
    /// the device cannot be reached beside that call, the stop follows as the call returns.
    pub fn stop(&self) -> Result<()> {
        unpoisoned(&self.shared.duty).stop(MoveEnd::Stopped);
        self.shared.wake.notify_all();
        self.shared.stop()
    }

    /// Stops the head and ends its thread; says so when it could not be stopped.
    pub fn close(self) -> Result<()> {
        unpoisoned(&self.shared.duty).close();
        self.shared.wake.notify_all();
        self.shared.stop()
    }

    /// Waits until a move has ended and says how. A move that a later one replaced ends with it.
    ///
    /// # Errors
    /// `InvalidArgument` for a number that no move had; `DeviceTimeout`, the move going on;
    /// `Cancelled`, the same.
    pub fn wait(&self, number: u64, timeout: f64, cancel: &Cancel) -> Result<MoveEnd> {
        let late = || Error::DeviceTimeout { what: "end of the move", seconds: timeout };
        let wait =
            Duration::try_from_secs_f64(timeout).map_err(|_| Error::invalid("timeout", format!("{timeout} s")))?;
        let until = Instant::now().checked_add(wait);
        let mut duty = unpoisoned(&self.shared.duty);
        if number == 0 || number > duty.number() {
            return Err(Error::invalid("move", format!("there was no move {number}")));
        }
        loop {
            if let Some(end) = duty.end_of(number) {
                return Ok(end);
            }
            cancel.check()?;
            let left = until.map_or(CANCEL_CHECK, |until| until.saturating_duration_since(Instant::now()));
            if left.is_zero() {
                return Err(late());
            }
            let slept = self.shared.wake.wait_timeout(duty, left.min(CANCEL_CHECK));
            duty = slept.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Sends a command that moves the head and has its end watched.
    fn start(&self, goal: Goal, command: impl FnOnce(&mut dyn PanTiltZoom) -> Result<()>) -> Result<u64> {
        let shared = &self.shared;
        self.employ()?;
        let (number, replaced) = unpoisoned(&shared.duty).begin(goal);
        if let Some(event) = replaced {
            shared.tell(&event);
        }
        let stops = shared.stops.load(Ordering::SeqCst);
        let sent = shared.with(command);
        if shared.stops.load(Ordering::SeqCst) != stops {
            // Somebody stopped while the command was on its way: it may have come after the stop.
            shared.stop()?;
        }
        match sent {
            Ok(()) => {
                unpoisoned(&shared.duty).sent(number);
                shared.wake.notify_all();
                Ok(number)
            }
            Err(error) => {
                unpoisoned(&shared.duty).forget(number);
                shared.wake.notify_all();
                Err(error)
            }
        }
    }

    /// Starts the head's own thread if it is not there yet.
    fn employ(&self) -> Result<()> {
        let mut worker = unpoisoned(&self.worker);
        if worker.is_none() {
            let shared = self.shared.clone();
            let spawned = std::thread::Builder::new().name("ptzcal-head".into()).spawn(move || watch::work(&shared));
            *worker = Some(spawned.map_err(|e| Error::Device { reason: format!("no thread can be started: {e}") })?);
        }
        Ok(())
    }
}

/// How late a cancel is noticed.
const CANCEL_CHECK: Duration = Duration::from_millis(100);

fn in_unit(name: &'static str, value: f64) -> Result<()> {
    if (0.0..=1.0).contains(&value) { Ok(()) } else { Err(Error::invalid(name, format!("{value} is not in [0, 1]"))) }
}

impl Shared {
    /// One call of the device. A stop that came meanwhile follows.
    fn with<T>(&self, call: impl FnOnce(&mut dyn PanTiltZoom) -> Result<T>) -> Result<T> {
        let result = call(&mut **unpoisoned(&self.ptz));
        self.catch_up()?;
        result
    }

    fn position(&self) -> Result<PtzPosition> {
        let position = self.with(|ptz| ptz.position())?;
        if [position.pan, position.tilt, position.zoom].iter().all(|v| v.is_finite()) {
            return Ok(position);
        }
        Err(Error::Device { reason: format!("the head reports the position {position:?}") })
    }

    fn stop(&self) -> Result<()> {
        let mine = self.stops.fetch_add(1, Ordering::SeqCst) + 1;
        match &self.brake {
            Some(brake) => {
                brake.stop()?;
                self.stopped.fetch_max(mine, Ordering::SeqCst);
                Ok(())
            }
            None => self.catch_up(),
        }
    }

    /// Stops the head as long as there are stops that have not reached it. When another thread is
    /// inside the device, that thread does it.
    fn catch_up(&self) -> Result<()> {
        loop {
            let wanted = self.stops.load(Ordering::SeqCst);
            if self.stopped.load(Ordering::SeqCst) >= wanted || self.brake.is_some() {
                return Ok(());
            }
            let mut ptz = match self.ptz.try_lock() {
                Ok(ptz) => ptz,
                Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
                Err(TryLockError::WouldBlock) => return Ok(()),
            };
            // Marked first: a device that refuses is not asked for ever.
            self.stopped.fetch_max(wanted, Ordering::SeqCst);
            ptz.stop()?;
        }
    }

    fn tell(&self, event: &MoveEvent) {
        if let Some(on_end) = &self.on_end {
            on_end(event);
        }
    }
}

impl Drop for Head {
    fn drop(&mut self) {
        unpoisoned(&self.shared.duty).close();
        self.shared.wake.notify_all();
        // Nobody is left to hear of a failure.
        let _ = self.shared.stop();
        let worker = unpoisoned(&self.worker).take();
        // A host may drop the head inside its callback: the thread must not wait for itself.
        if let Some(worker) = worker.filter(|w| w.thread().id() != std::thread::current().id()) {
            let _ = worker.join();
        }
    }
}
