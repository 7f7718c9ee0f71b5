//! Moving a head and knowing when it stands still. [`Mover`] needs no rig: a head, the camera on it
//! and a clock will do.
//!
//! A move is finished when the device says so (where it does), AND its position has been the same
//! for several readings within a step of the target, AND two consecutive frames show the same picture,
//! exposed when the readings had been equal for half of their time: completion messages come early,
//! positions are echoed commands, and a head swings after its motors stand.

use nalgebra::Vector2;

use super::frames::{After, CameraPort, FrameOptions, Grabber};
use super::stillness;
use crate::control::{Cancel, Clock, Log, LogLevel};
use crate::device::{Frame, FrameSource, Motion, PanTiltZoom, PtzCapabilities, PtzPosition};
use crate::error::{Error, Result};

/// When a move counts as finished, and how a target is approached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SettleOptions {
    /// This many equal readings in a row ...
    pub readings: u32,
    /// ... that span at least this long, seconds.
    pub duration: f64,
    /// Time between readings, seconds.
    pub poll_interval: f64,
    /// Accepted distance from the target, radians; 0: one encoder step of the device.
    pub tolerance: f64,
    /// Longest time for a move, seconds.
    pub move_timeout: f64,
    /// A head that stands elsewhere for this long (seconds) is sent again ...
    pub patience: f64,
    /// ... until it was sent this often.
    pub attempts: u32,
    /// Backlash: a target is always approached from lower pan and tilt; a move from the other side
    /// first goes this far past it, radians. 0: straight to the target.
    pub overshoot: f64,
    /// How long to wait for the head camera's picture to stand still, seconds; 0: do not look.
    pub picture_timeout: f64,
    /// Greatest shift between consecutive frames of a still picture, pixels.
    pub picture_shift: f64,
}

impl Default for SettleOptions {
    fn default() -> Self {
        Self {
            readings: 3,
            duration: 0.15,
            poll_interval: 0.01,
            tolerance: 0.0,
            move_timeout: 30.0,
            patience: 1.0,
            attempts: 3,
            overshoot: 0.01,
            picture_timeout: 5.0,
            picture_shift: 0.2,
        }
    }
}

impl SettleOptions {
    pub(crate) fn validate(&self) -> Result<()> {
        let positive = [
            ("settle.poll_interval", self.poll_interval),
            ("settle.move_timeout", self.move_timeout),
            ("settle.patience", self.patience),
            ("settle.picture_shift", self.picture_shift),
        ];
        let not_negative = [
            ("settle.duration", self.duration),
            ("settle.tolerance", self.tolerance),
            ("settle.overshoot", self.overshoot),
            ("settle.picture_timeout", self.picture_timeout),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value <= 3600.0) {
                return Err(Error::invalid(name, format!("{value} is not in (0, 3600]")));
            }
        }
        for (name, value) in not_negative {
            if !(0.0..=3600.0).contains(&value) {
                return Err(Error::invalid(name, format!("{value} is not in [0, 3600]")));
            }
        }
        if self.readings == 0 || self.attempts == 0 {
            return Err(Error::invalid("settle", "readings and attempts are at least 1"));
        }
        Ok(())
    }

    /// Accepted distances from a target in pan and tilt, radians.
    pub(crate) fn tolerances(&self, capabilities: &PtzCapabilities) -> [f64; 2] {
        [capabilities.pan_step, capabilities.tilt_step].map(|step| match self.tolerance {
            // A whisker more than a step, for the rounding of the target to it.
            0.0 if step > 0.0 => step * 1.01,
            0.0 => DEFAULT_TOLERANCE,
            tolerance => tolerance,
        })
    }
}

/// Accepted distance from the target when neither the options nor the device tell, radians.
const DEFAULT_TOLERANCE: f64 = 1e-3;
/// How long the head must be seen to stand before the laser may be switched on by hand, seconds.
const STANDSTILL_TIMEOUT: f64 = 1.0;

/// Bound on pairs of frames, should the clock stand still.
const MAX_LOOKS: u32 = 100_000;

/// Equal readings in a row.
#[derive(Clone, Copy)]
struct Steady {
    position: PtzPosition,
    since: f64,
    readings: u32,
}

/// A head and the camera on it while it is moved. All that is said in radians is in the device's raw
/// units for a head without known angles.
pub(crate) struct Mover<'a> {
    pub ptz: &'a mut dyn PanTiltZoom,
    pub capabilities: &'a PtzCapabilities,
    pub frames: &'a mut dyn FrameSource,
    /// Width and height of the camera's frames.
    pub size: [u32; 2],
    pub clock: &'a dyn Clock,
    pub log: &'a Log,
    pub settle: SettleOptions,
    pub frame_options: FrameOptions,
    /// The head came to where it is from lower pan and tilt.
    pub approached: &'a mut bool,
    /// The last two frames of a settled head.
    pub pictures: &'a mut [Frame; 2],
    /// Frames are looked at from this share of [`SettleOptions::duration`] on. Below 1 both waits overlap,
    /// and the frames may show the last tenths of a pixel of a swing: not to be measured in.
    pub earliest_look: f64,
}

/// A head that stands.
pub(crate) struct Settled {
    pub position: PtzPosition,
    /// Frames from here on may be measured in.
    pub rested: f64,
}

/// Where the head is, as the device reads it.
pub(crate) fn read_position(ptz: &mut dyn PanTiltZoom) -> Result<PtzPosition> {
    let position = ptz.position()?;
    let values = [position.pan, position.tilt, position.zoom];
    if values.iter().any(|v| !v.is_finite()) {
        return Err(Error::Device { reason: format!("the head reports the position {values:?}") });
    }
    Ok(position)
}

impl Mover<'_> {
    /// Goes to the target from lower pan and tilt and waits until it stands there. On an error the head
    /// may still be moving.
    pub fn approach(&mut self, target: Vector2<f64>, cancel: &Cancel) -> Result<Settled> {
        let [pan_tolerance, tilt_tolerance] = self.tolerances();
        let overshoot = self.settle.overshoot;
        if overshoot > 0.0 {
            // A device that does not tell its position has none to give before its first move.
            let beyond = !*self.approached || {
                let from = read_position(self.ptz)?;
                from.pan > target.x + pan_tolerance || from.tilt > target.y + tilt_tolerance
            };
            if beyond {
                let c = self.capabilities;
                let via = Vector2::new(
                    (target.x - overshoot).max(c.pan_range[0]),
                    (target.y - overshoot).max(c.tilt_range[0]),
                );
                self.go(via)?;
                self.arrive(via, true, cancel)?;
            }
        }
        self.go(target)?;
        let settled = self.settled(target, cancel)?;
        *self.approached = true;
        Ok(settled)
    }

    fn go(&mut self, target: Vector2<f64>) -> Result<()> {
        self.ptz.move_absolute(target.x, target.y)
    }

    fn tolerances(&self) -> [f64; 2] {
        self.settle.tolerances(self.capabilities)
    }

    /// Waits for arrival and for a picture that stands still.
    fn settled(&mut self, target: Vector2<f64>, cancel: &Cancel) -> Result<Settled> {
        let mut looking_since = None;
        loop {
            let arrived = self.arrive(target, false, cancel)?;
            let settled = Settled { position: arrived.position, rested: arrived.since + self.settle.duration };
            if self.settle.picture_timeout == 0.0 {
                return Ok(settled);
            }
            let since = *looking_since.get_or_insert(self.clock.now());
            let earliest = arrived.since + self.earliest_look * self.settle.duration;
            let looks = self.watch(earliest, since, cancel)?;
            // A picture that still moved at first may have gone on to another place.
            if looks == 1 {
                return Ok(settled);
            }
            let position = read_position(self.ptz)?;
            if self.same(&position, &settled.position) {
                return Ok(settled);
            }
        }
    }

    /// Takes frames from a moment on until two in a row show the same; they are in `pictures` then.
    /// Returns how many pairs it took.
    fn watch(&mut self, not_before: f64, looking_since: f64, cancel: &Cancel) -> Result<u32> {
        let timeout = self.settle.picture_timeout;
        let grabber = Grabber { clock: self.clock, cancel, options: self.frame_options };
        let mut port =
            CameraPort { source: &mut *self.frames, name: "head camera", width: self.size[0], height: self.size[1] };
        grabber.grab(&mut port, After::Moment(not_before), None, &mut self.pictures[0])?;
        let (mut looks, mut still, mut enough) = (0, 0, 1);
        loop {
            looks += 1;
            let [first, second] = &mut *self.pictures;
            grabber.grab(&mut port, After::Frame(first.timestamp), None, second)?;
            let (a, b) = (first.image.view()?, second.image.view()?);
            match stillness::shift_between(&a, &b, self.settle.picture_shift)? {
                None => {
                    still += 1;
                    if still == enough {
                        return Ok(looks);
                    }
                }
                Some(shift) => {
                    self.log.write(LogLevel::Debug, || {
                        format!("the head says it stands, its picture moves ({shift:.2} px)")
                    });
                    if self.clock.now() - looking_since >= timeout || looks > MAX_LOOKS {
                        let reason = format!(
                            "the head reports to stand at its target, but its picture keeps moving ({shift:.1} px a frame)"
                        );
                        return Err(Error::Device { reason });
                    }
                    // Two frames may catch a swing at the same place, on its way there and back; three do not.
                    (still, enough) = (0, 2);
                }
            }
            self.pictures.swap(0, 1);
        }
    }

    /// Are two readings the same, within half a step?
    fn same(&self, a: &PtzPosition, b: &PtzPosition) -> bool {
        let [pan_tolerance, tilt_tolerance] = self.tolerances().map(|t| 0.5 * t);
        (a.pan - b.pan).abs() <= pan_tolerance && (a.tilt - b.tilt).abs() <= tilt_tolerance
    }

    /// Waits until the device reports to stand within a step of the target; sends it there again
    /// when it stands elsewhere. When `passing`, a head that was seen on its way need not stay there.
    fn arrive(&mut self, target: Vector2<f64>, passing: bool, cancel: &Cancel) -> Result<Steady> {
        let options = self.settle;
        let [pan_tolerance, tilt_tolerance] = self.tolerances();
        let start = self.clock.now();
        let mut steady: Option<Steady> = None;
        let (mut attempts, mut first, mut on_its_way) = (1, None, false);
        let late = Error::DeviceTimeout { what: "pan-tilt head", seconds: options.move_timeout };
        for _ in 0..self.most_polls(options.move_timeout) {
            cancel.check()?;
            let motion = self.motion()?;
            let state = self.observe(&mut steady)?;
            let now = self.clock.now();
            let near = |x: f64, y: f64| {
                (state.position.pan - x).abs() <= pan_tolerance && (state.position.tilt - y).abs() <= tilt_tolerance
            };
            let there = near(target.x, target.y);
            let from: PtzPosition = *first.get_or_insert(state.position);
            // A reading between shows that positions are no echoes.
            on_its_way |= !there && !near(from.pan, from.tilt);
            let stands = state.readings >= options.readings && now - state.since >= options.duration;
            match motion {
                Motion::Idle | Motion::Unknown if there && (stands || (passing && on_its_way)) => return Ok(*state),
                Motion::Moving => {}
                _ if stands && (motion == Motion::Failed || now - state.since >= options.patience) => {
                    let at = state.position;
                    let detail = format!(
                        "the head stands at pan {:.4}, tilt {:.4} rad instead of {:.4}, {:.4}",
                        at.pan, at.tilt, target.x, target.y
                    );
                    if attempts == options.attempts {
                        return Err(Error::Device { reason: format!("{detail}, after {attempts} attempts") });
                    }
                    attempts += 1;
                    self.log.write(LogLevel::Warning, || format!("{detail}; sent again"));
                    self.ptz.stop()?;
                    self.go(target)?;
                    steady = None;
                }
                _ => {}
            }
            if now - start >= options.move_timeout {
                return Err(late);
            }
            self.clock.sleep(options.poll_interval);
        }
        Err(late)
    }

    /// Does the head stand still, wherever it is?
    pub fn stands_still(&mut self) -> Result<bool> {
        let options = self.settle;
        let start = self.clock.now();
        let mut steady = None;
        for _ in 0..self.most_polls(STANDSTILL_TIMEOUT) {
            let moving = self.motion()? == Motion::Moving;
            let state = self.observe(&mut steady)?;
            let now = self.clock.now();
            if !moving && state.readings >= options.readings && now - state.since >= options.duration {
                return Ok(true);
            }
            if now - start >= STANDSTILL_TIMEOUT.max(2.0 * options.duration) {
                break;
            }
            self.clock.sleep(options.poll_interval);
        }
        Ok(false)
    }

    fn motion(&mut self) -> Result<Motion> {
        if self.capabilities.reports_motion { self.ptz.motion() } else { Ok(Motion::Unknown) }
    }

    /// Takes one more reading; a reading that differs starts the count anew.
    fn observe<'a>(&mut self, steady: &'a mut Option<Steady>) -> Result<&'a Steady> {
        let position = read_position(self.ptz)?;
        let now = self.clock.now();
        let next = match steady.take() {
            Some(s) if self.same(&position, &s.position) => Steady { readings: s.readings + 1, ..s },
            _ => Steady { position, since: now, readings: 1 },
        };
        Ok(steady.insert(next))
    }

    /// Bound on the turns of a polling loop, should the clock stand still.
    fn most_polls(&self, timeout: f64) -> u64 {
        (timeout / self.settle.poll_interval).min(1e6) as u64 + 100
    }
}
