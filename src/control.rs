//! What a caller uses to steer long work: cancelling, logging, and the clock that paces it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::error::{Error, Result};

/// The lock, also after a panic of another thread that held it: what it guards is whole at every moment.
pub(crate) fn unpoisoned<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A token that stops long work from any thread. Clones share the same state.
#[derive(Debug, Clone, Default)]
pub struct Cancel {
    own: Arc<AtomicBool>,
    /// Another token that stops the same work.
    other: Option<Arc<AtomicBool>>,
}

impl Cancel {
    pub fn new() -> Self {
        Self::default()
    }

    /// A view of this token that `other` cancels too.
    pub fn or(&self, other: &Self) -> Self {
        Self { own: self.own.clone(), other: Some(other.own.clone()) }
    }

    pub fn cancel(&self) {
        self.own.store(true, Ordering::SeqCst);
    }

    pub fn reset(&self) {
        self.own.store(false, Ordering::SeqCst);
    }

    pub fn is_cancelled(&self) -> bool {
        let set = |flag: &AtomicBool| flag.load(Ordering::SeqCst);
        set(&self.own) || self.other.as_deref().is_some_and(set)
    }

    /// `Err(Cancelled)` once the token was cancelled.
    pub fn check(&self) -> Result<()> {
        if self.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(i32)]
pub enum LogLevel {
    Error = 1,
    Warning = 2,
    Info = 3,
    Debug = 4,
}

type Sink = dyn Fn(LogLevel, &str) + Send + Sync;

/// Where messages go. Silent by default; nothing is ever printed by the library itself.
#[derive(Clone, Default)]
pub struct Log(Option<Arc<Sink>>);

impl Log {
    pub fn silent() -> Self {
        Self(None)
    }

    pub fn to(sink: impl Fn(LogLevel, &str) + Send + Sync + 'static) -> Self {
        Self(Some(Arc::new(sink)))
    }

    /// The message is only made when somebody listens.
    pub fn write(&self, level: LogLevel, message: impl FnOnce() -> String) {
        if let Some(sink) = &self.0 {
            sink(level, &message());
        }
    }
}

/// Time for workflows. Real rigs use [`SystemClock`], the simulator a virtual clock that runs as
/// fast as the work is done, a host its own when its frames are stamped with it.
pub trait Clock: Send + Sync {
    /// Seconds since any fixed moment; never goes back.
    fn now(&self) -> f64;
    /// Lets `seconds` pass.
    fn sleep(&self, seconds: f64);
}

/// The operating system's monotonic clock, counted from its creation.
pub struct SystemClock(std::time::Instant);

impl Default for SystemClock {
    fn default() -> Self {
        Self(std::time::Instant::now())
    }
}

impl Clock for SystemClock {
    fn now(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }

    fn sleep(&self, seconds: f64) {
        if seconds > 0.0 {
            std::thread::sleep(std::time::Duration::from_secs_f64(seconds.min(3600.0)));
        }
    }
}
