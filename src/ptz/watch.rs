//! The head's own thread: watches a move until it ends, and stops a drive that is not renewed.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::PoisonError;
use std::time::{Duration, Instant};

use super::{MoveEnd, MoveEvent, Shared};
use crate::control::{LogLevel, unpoisoned};
use crate::device::{Motion, PtzPosition};
use crate::error::{Error, Result};

/// Time between readings of a moving head.
const POLL: Duration = Duration::from_millis(50);
/// A head stands when its readings have been equal for so long, at least ...
const STANDS: Duration = Duration::from_millis(150);
/// ... and so many of them.
const READINGS: u32 = 3;
/// A head that stands elsewhere than where it was sent may still be about to start.
const PATIENCE: Duration = Duration::from_secs(1);
/// Longest move.
const MOVE_TIMEOUT: Duration = Duration::from_secs(120);
/// So many failed readings in a row end the watch.
const FAILURES: u32 = 3;
/// A drive that does not stop is stopped so often again, a reading's time apart.
const STOPS: u32 = 40;
/// Readings are equal within this, where the device does not know its step; radians.
const TOLERANCE: f64 = 1e-3;
/// Zoom readings are equal within this.
const ZOOM_TOLERANCE: f64 = 1e-4;
/// Ends that are remembered.
const ENDS: usize = 64;

/// What a move is to end in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Goal {
    At {
        pan: f64,
        tilt: f64,
    },
    /// Wherever the device takes it: home, a preset, a zoom.
    Anywhere,
    Drive {
        until: Instant,
    },
}

/// What the thread has to do.
#[derive(Default)]
pub(super) struct Duty {
    number: u64,
    move_: Option<Move>,
    /// The last moves' ends, the newest last.
    ends: VecDeque<(u64, MoveEnd)>,
    closing: bool,
}

struct Move {
    number: u64,
    goal: Goal,
    /// The device has taken the command.
    sent: Option<Instant>,
    /// It was told to stop, and why.
    stopped: Option<MoveEnd>,
    standing: Option<Standing>,
    failures: u32,
}

/// Equal readings in a row.
#[derive(Clone, Copy)]
struct Standing {
    at: PtzPosition,
    since: Instant,
    readings: u32,
}

impl Duty {
    /// Number of the newest move.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// A new move. A renewed drive is the same move; any other takes the place of the one before,
    /// whose end is returned.
    pub fn begin(&mut self, goal: Goal) -> (u64, Option<MoveEvent>) {
        let drives = |m: &&mut Move| matches!((m.goal, goal), (Goal::Drive { .. }, Goal::Drive { .. }));
        if let Some(m) = self.move_.as_mut().filter(drives).filter(|m| m.stopped.is_none()) {
            (m.goal, m.standing) = (goal, None);
            return (m.number, None);
        }
        let replaced = self.move_.take().map(|m| self.end(m.number, MoveEnd::Replaced, None));
        self.number += 1;
        let number = self.number;
        self.move_ = Some(Move { number, goal, sent: None, stopped: None, standing: None, failures: 0 });
        (number, replaced)
    }

    /// The device has taken the command of a move.
    pub fn sent(&mut self, number: u64) {
        if let Some(m) = self.move_.as_mut().filter(|m| m.number == number) {
            m.sent.get_or_insert_with(Instant::now);
        }
    }

    /// A move whose command failed never was.
    pub fn forget(&mut self, number: u64) {
        if self.move_.as_ref().is_some_and(|m| m.number == number) {
            self.move_ = None;
        }
        if self.end_of(number).is_none() {
            self.remember(number, MoveEnd::Stopped);
        }
    }

    pub fn stop(&mut self, why: MoveEnd) {
        if let Some(m) = &mut self.move_ {
            m.stopped.get_or_insert(why);
            m.standing = None;
        }
    }

    pub fn close(&mut self) {
        self.closing = true;
    }

    /// How a move ended; `None` while it has not. Of one that is long forgotten: it was replaced.
    pub fn end_of(&self, number: u64) -> Option<MoveEnd> {
        if self.move_.as_ref().is_some_and(|m| m.number == number) {
            return None;
        }
        let end = self.ends.iter().rev().find(|(n, _)| *n == number).map(|(_, end)| end.clone());
        end.or_else(|| (number < self.number).then_some(MoveEnd::Replaced))
    }

    fn end(&mut self, number: u64, end: MoveEnd, position: Option<PtzPosition>) -> MoveEvent {
        self.remember(number, end.clone());
        MoveEvent { number, end, position }
    }

    fn remember(&mut self, number: u64, end: MoveEnd) {
        if self.ends.len() == ENDS {
            self.ends.pop_front();
        }
        self.ends.push_back((number, end));
    }

    /// The drive whose time is over.
    fn overdue(&self) -> Option<u64> {
        let m = self.move_.as_ref()?;
        let over = |until| until <= Instant::now() && m.stopped.is_none();
        matches!(m.goal, Goal::Drive { until } if over(until)).then_some(m.number)
    }

    /// What came of stopping an overdue drive; it is tried again a few times.
    fn let_go(&mut self, number: u64, stopped: Result<()>) -> Option<MoveEvent> {
        let m = self.move_.as_mut().filter(|m| m.number == number)?;
        match stopped {
            Ok(()) => self.stop(MoveEnd::DeadMan),
            Err(_) if m.failures < STOPS && !self.closing => m.failures += 1,
            Err(error) => {
                self.move_ = None;
                return Some(self.end(number, MoveEnd::Failed(error), None));
            }
        }
        None
    }

    /// The move whose readings are to be watched.
    fn watched(&self) -> Option<u64> {
        self.move_.as_ref().filter(|m| m.sent.is_some()).map(|m| m.number)
    }

    /// Time until there is something to do; `None`: until somebody calls.
    fn pause(&self) -> Option<Duration> {
        let m = self.move_.as_ref()?;
        let due = match m.goal {
            Goal::Drive { until } if m.stopped.is_none() => Some(until.saturating_duration_since(Instant::now())),
            _ => None,
        };
        // An overdue drive is stopped again a reading's time later.
        let due = due.map(|due| if due.is_zero() { POLL } else { due });
        if m.sent.is_some() { Some(due.map_or(POLL, |due| due.min(POLL))) } else { due }
    }

    /// Of a device that tells nothing a move has ended as soon as it is sent, except a drive.
    fn end_blind(&mut self, number: u64) -> Option<MoveEvent> {
        let m = self.move_.as_ref().filter(|m| m.number == number)?;
        let end = match (&m.stopped, m.goal) {
            (Some(why), _) => why.clone(),
            (None, Goal::Drive { .. }) => return None,
            (None, _) => MoveEnd::Unknown,
        };
        self.move_ = None;
        Some(self.end(number, end, None))
    }

    /// Takes a reading of the move `number` in; its end, if that is it.
    fn observe(
        &mut self,
        number: u64,
        reading: Result<(PtzPosition, Motion)>,
        tolerance: [f64; 2],
    ) -> Option<MoveEvent> {
        let now = Instant::now();
        let m = self.move_.as_mut().filter(|m| m.number == number)?;
        let (end, position) = match reading {
            Ok((position, motion)) => {
                m.failures = 0;
                (m.judge(position, motion, tolerance, now)?, Some(position))
            }
            // A drive is not let out of sight before it was stopped.
            Err(_) if matches!(m.goal, Goal::Drive { .. }) && m.stopped.is_none() => return None,
            Err(error) => {
                m.failures += 1;
                if m.failures < FAILURES && !matches!(error, Error::DeviceLost { .. }) {
                    return None;
                }
                (MoveEnd::Failed(error), None)
            }
        };
        self.move_ = None;
        Some(self.end(number, end, position))
    }
}

impl Move {
    fn judge(
        &mut self,
        position: PtzPosition,
        motion: Motion,
        [pan_tolerance, tilt_tolerance]: [f64; 2],
        now: Instant,
    ) -> Option<MoveEnd> {
        let near = |pan: f64, tilt: f64, share: f64| {
            (position.pan - pan).abs() <= share * pan_tolerance
                && (position.tilt - tilt).abs() <= share * tilt_tolerance
        };
        let same = |s: &Standing| near(s.at.pan, s.at.tilt, 0.5) && (position.zoom - s.at.zoom).abs() <= ZOOM_TOLERANCE;
        let standing = match self.standing {
            Some(s) if same(&s) => Standing { readings: s.readings + 1, ..s },
            _ => Standing { at: position, since: now, readings: 1 },
        };
        self.standing = Some(standing);
        let sent = self.sent?;
        let still = now - standing.since;
        let stands = motion != Motion::Moving && standing.readings >= READINGS && still >= STANDS;
        if !stands && now - sent < MOVE_TIMEOUT {
            return None;
        }
        if let Some(why) = &self.stopped {
            return Some(why.clone());
        }
        match self.goal {
            Goal::At { pan, tilt } if near(pan, tilt, 1.0) => Some(MoveEnd::Arrived),
            Goal::At { .. } if motion == Motion::Failed => Some(MoveEnd::Missed),
            // Heads without a word about their motion may start late.
            Goal::Anywhere if motion == Motion::Idle || still >= PATIENCE => Some(MoveEnd::Arrived),
            // Stays at a limit, until it is stopped or its time is over.
            Goal::Drive { .. } => None,
            _ => (still >= PATIENCE || now - sent >= MOVE_TIMEOUT).then_some(MoveEnd::Missed),
        }
    }
}

/// The thread's work, until the head is closed.
pub(super) fn work(shared: &Shared) {
    let c = &shared.capabilities;
    let blind = !c.reports_position && !c.reports_motion;
    let tolerance = [c.pan_step, c.tilt_step].map(|step| if step > 0.0 { 1.01 * step } else { TOLERANCE });
    let mut duty = unpoisoned(&shared.duty);
    while !duty.closing {
        let mut event = None;
        if let Some(number) = duty.overdue() {
            drop(duty);
            let stopped = caught(|| shared.stop());
            if let Err(error) = &stopped {
                shared.log.write(LogLevel::Error, || format!("a drive ran out, and THE HEAD MAY STILL MOVE: {error}"));
            }
            duty = unpoisoned(&shared.duty);
            event = duty.let_go(number, stopped);
        } else if let Some(number) = duty.watched() {
            if blind {
                event = duty.end_blind(number);
            } else {
                drop(duty);
                let reading = caught(|| read(shared));
                duty = unpoisoned(&shared.duty);
                event = duty.observe(number, reading, tolerance);
            }
        }
        if let Some(event) = event {
            drop(duty);
            shared.wake.notify_all();
            shared.tell(&event);
            duty = unpoisoned(&shared.duty);
            continue;
        }
        if duty.closing {
            return;
        }
        duty = match duty.pause() {
            Some(pause) => shared.wake.wait_timeout(duty, pause).unwrap_or_else(PoisonError::into_inner).0,
            None => shared.wake.wait(duty).unwrap_or_else(PoisonError::into_inner),
        };
    }
}

fn read(shared: &Shared) -> Result<(PtzPosition, Motion)> {
    let motion = if shared.capabilities.reports_motion { shared.with(|ptz| ptz.motion())? } else { Motion::Unknown };
    Ok((shared.position()?, motion))
}

/// A driver that panics must not end the thread that has to stop the head.
fn caught<T>(call: impl FnOnce() -> Result<T>) -> Result<T> {
    catch_unwind(AssertUnwindSafe(call))
        .unwrap_or_else(|_| Err(Error::Panic { reason: "the head's driver panicked".into() }))
}
