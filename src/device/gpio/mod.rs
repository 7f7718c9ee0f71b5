//! A laser on a line of a GPIO chip: `gpio:///dev/gpiochip0/laser`.
//!
//! The line is held by a process of its own, so that a host that is killed, stopped or hangs does not
//! leave the laser on ([`guard`]); the library starts no thread for it. What the line's level means
//! once nobody holds it is the kernel driver's affair: some keep the last one.

mod guard;
mod guarded;
mod line;
mod message;
mod watch;

use std::io;
use std::path::{Path, PathBuf};

pub use guard::laser_guard_main;

use super::laser_limits::LaserLimits;
use super::{Address, Laser, Surroundings, device_error};
use crate::control::LogLevel;
use crate::error::{Error, Result};
use guard::Arguments;
use guarded::Guarded;
use line::{Line, LineId};
use watch::{Outcome, Output, Watch};

const OPTIONS: &[&str] = &["active", "max_on", "duty", "window", "guard"];
/// How often, and after which pause (seconds), the line of a guard that is gone is asked for.
const TAKE_OVER_TRIES: usize = 20;
const TAKE_OVER_PAUSE: f64 = 0.01;
/// A guard that was lost is started again at most this often, seconds.
const REOPEN_PAUSE: f64 = 1.0;

/// Opens a laser on a GPIO line and drives the line inactive.
///
/// # Errors
/// `InvalidAddress`; `DeviceNotFound` with the names of the lines there are; `DevicePermission`;
/// `DeviceBusy` with the line's holder; `DeviceMismatch` for a file that is no GPIO chip;
/// `LaserRefused` when the guard process is not found or does not start.
pub fn open(address: &Address, surroundings: &Surroundings) -> Result<Box<dyn Laser>> {
    address.check_options(OPTIONS)?;
    let limits = LaserLimits {
        max_on: address.number("max_on", LaserLimits::DEFAULT_MAX_ON, 0.01..=60.0)?,
        duty: address.number("duty", 1.0, 0.001..=1.0)?,
        window: address.number("window", LaserLimits::DEFAULT_WINDOW, 0.1..=3600.0)?,
    };
    let guarded = match address.option("guard") {
        None | Some("required") => true,
        Some("off") => false,
        Some(other) => return Err(address.wrong(format!("option guard={other:?} is neither required nor off"))),
    };
    let line = LineId::find(address)?;
    let executable = if guarded { Some(guarded::find_executable()?) } else { None };
    let warn = |message: String| surroundings.log.write(LogLevel::Warning, || format!("{address}: {message}"));
    if let Some(parameter) = kept_outputs(Path::new("/sys/module"), &line.chip_label()) {
        warn(format!(
            "this kernel keeps an output's level when its holder ends ({} is Y): should the guard be killed while \
             the laser is on, it stays on. Put dtparam=strict_gpiod into config.txt",
            parameter.display()
        ));
    }
    if !guarded {
        warn(
            "held without a guard process: if this process is killed, stops or hangs, the laser stays as it is".into(),
        );
    }
    let mut laser = GpioLaser {
        address: address.clone(),
        line,
        limits,
        executable,
        surroundings: surroundings.clone(),
        hold: Hold::Low(None),
        reopen_at: f64::NEG_INFINITY,
    };
    laser.hold = laser.take()?;
    Ok(Box::new(laser))
}

/// The kernel's parameter that keeps outputs as they are, when it is set (Raspberry Pi).
fn kept_outputs(modules: &Path, chip_label: &str) -> Option<PathBuf> {
    let module = ["pinctrl-bcm", "pinctrl-rp1"]
        .iter()
        .zip(["pinctrl_bcm2835", "pinctrl_rp1"])
        .find_map(|(label, module)| chip_label.starts_with(label).then_some(module))?;
    let parameter = modules.join(module).join("parameters/persist_gpio_outputs");
    std::fs::read(&parameter).is_ok_and(|value| matches!(value.first(), Some(b'Y' | b'1'))).then_some(parameter)
}

struct GpioLaser {
    address: Address,
    line: LineId,
    limits: LaserLimits,
    /// The guard's; without one the line is held by this process.
    executable: Option<PathBuf>,
    surroundings: Surroundings,
    hold: Hold,
    reopen_at: f64,
}

enum Hold {
    Guard(Guarded),
    /// By this process, within the limits as far as it is called.
    Own(Box<Watch<Line>>),
    /// The guard was lost; the line is held inactive, if it could be had.
    Low(Option<Line>),
}

impl GpioLaser {
    fn take(&self) -> Result<Hold> {
        match &self.executable {
            Some(executable) => {
                let arguments = Arguments { line: self.line.clone(), limits: self.limits };
                Guarded::start(executable, &arguments, self.surroundings.log.clone()).map(Hold::Guard)
            }
            None => {
                let line = self.line.request().map_err(|e| self.line.refused(&e))?;
                Ok(Hold::Own(Box::new(Watch::new(line, self.limits))))
            }
        }
    }

    fn result(&self, on: bool, outcome: Outcome) -> Result<()> {
        match outcome {
            Outcome::On if on => Ok(()),
            Outcome::Off if !on => Ok(()),
            Outcome::Refused(reason) | Outcome::WentOff(reason) => Err(Error::LaserRefused { reason }),
            Outcome::Fault(errno) => Err(device_error(&self.line.to_string(), &io::Error::from_raw_os_error(errno))),
            other => Err(Error::Device { reason: format!("{}: the guard says {other:?}", self.line) }),
        }
    }

    /// The guard is of no more use: makes sure that the line is inactive, and reports.
    fn lose(&mut self, why: &io::Error) -> Error {
        let why = match why.kind() {
            io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => "does not answer".to_owned(),
            io::ErrorKind::UnexpectedEof | io::ErrorKind::BrokenPipe | io::ErrorKind::ConnectionReset => {
                "has ended".to_owned()
            }
            _ => format!("cannot be spoken to ({why})"),
        };
        // Closes the socket first, at which a guard that still lives lets go of the line.
        self.hold = Hold::Low(None);
        self.reopen_at = self.surroundings.clock.now() + REOPEN_PAUSE;
        let off = match self.hold_low() {
            Ok(()) => "the laser is off".to_owned(),
            Err(e) => format!("THE LASER MAY BE ON ({e})"),
        };
        let error = Error::DeviceLost { reason: format!("{}: the laser's guard process {why}; {off}", self.line) };
        self.surroundings.log.write(LogLevel::Error, || error.to_string());
        error
    }

    /// Holds the line inactive in this process, in place of a guard that is gone.
    fn hold_low(&mut self) -> Result<()> {
        if let Hold::Low(Some(line)) = &mut self.hold {
            return line.drive(false).map_err(|e| device_error(&self.line.to_string(), &e));
        }
        let mut tried = self.line.request();
        for _ in 0..TAKE_OVER_TRIES {
            if !matches!(&tried, Err(e) if e.raw_os_error() == Some(libc::EBUSY)) {
                break;
            }
            self.surroundings.clock.sleep(TAKE_OVER_PAUSE);
            tried = self.line.request();
        }
        self.hold = Hold::Low(Some(tried.map_err(|e| self.line.refused(&e))?));
        Ok(())
    }

    /// Starts a guard anew in place of one that was lost.
    fn reopen(&mut self) -> Result<()> {
        let now = self.surroundings.clock.now();
        if now < self.reopen_at {
            return Err(Error::DeviceLost {
                reason: format!("{}: the laser's guard process was lost; it is started again in a second", self.line),
            });
        }
        self.reopen_at = now + REOPEN_PAUSE;
        // The guard needs the line.
        self.hold = Hold::Low(None);
        // A chip that was plugged in again may have another number.
        match LineId::find(&self.address).and_then(|line| {
            self.line = line;
            self.take()
        }) {
            Ok(hold) => {
                self.hold = hold;
                self.surroundings.log.write(LogLevel::Info, || format!("{}: a new guard holds the laser", self.line));
                Ok(())
            }
            Err(error) => {
                let _ = self.hold_low();
                Err(error)
            }
        }
    }
}

impl Laser for GpioLaser {
    fn set(&mut self, on: bool) -> Result<()> {
        if on && matches!(self.hold, Hold::Low(_)) {
            self.reopen()?;
        }
        let outcome = match &mut self.hold {
            Hold::Guard(guard) => guard.command(on),
            Hold::Own(watch) => {
                let now = self.surroundings.clock.now();
                Ok(if on { watch.on(now) } else { watch.off(now) })
            }
            Hold::Low(_) => return self.hold_low(),
        };
        match outcome {
            Ok(outcome) => {
                let result = self.result(on, outcome);
                if matches!(result, Err(Error::DeviceLost { .. })) {
                    // The chip is unplugged: nothing is held any more.
                    self.hold = Hold::Low(None);
                    self.reopen_at = self.surroundings.clock.now() + REOPEN_PAUSE;
                }
                result
            }
            Err(why) => {
                let lost = self.lose(&why);
                // Off is off, whoever did it; the loss is logged, and the next "on" starts a new guard.
                if !on && matches!(self.hold, Hold::Low(Some(_))) { Ok(()) } else { Err(lost) }
            }
        }
    }

    fn check(&mut self) -> Result<()> {
        let went_off = match &mut self.hold {
            Hold::Guard(guard) => guard.went_off(),
            Hold::Own(watch) => match watch.look(self.surroundings.clock.now(), || false) {
                Some(Outcome::WentOff(reason)) => Ok(Some(reason)),
                _ => Ok(None),
            },
            Hold::Low(_) => Ok(None),
        };
        match went_off {
            Ok(None) => Ok(()),
            Ok(Some(reason)) => {
                self.surroundings
                    .log
                    .write(LogLevel::Warning, || format!("{}: the laser went off: {reason}", self.line));
                Err(Error::LaserRefused { reason })
            }
            Err(why) => Err(self.lose(&why)),
        }
    }

    fn limits(&self) -> LaserLimits {
        self.limits
    }
}

impl Drop for GpioLaser {
    fn drop(&mut self) {
        if let Hold::Guard(guard) = std::mem::replace(&mut self.hold, Hold::Low(None)) {
            guard.end();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_checked_before_a_device_is_touched() {
        for (options, part) in [
            ("max_on=0", "max_on"),
            ("max_on=61", "max_on"),
            ("max_on=x", "max_on"),
            ("duty=0", "duty"),
            ("duty=1.1", "duty"),
            ("window=0", "window"),
            ("guard=maybe", "guard"),
            ("colour=red", "not among"),
        ] {
            let address = Address::parse(&format!("gpio:///dev/null/laser?{options}")).unwrap();
            let Err(error) = open(&address, &Surroundings::default()) else { panic!("{options}") };
            assert!(matches!(error, Error::InvalidAddress { .. }) && error.to_string().contains(part), "{error}");
        }
    }

    #[test]
    fn a_kernel_that_keeps_outputs_is_recognised() {
        let root = tempfile::tempdir().unwrap();
        for (label, module, value, kept) in [
            ("pinctrl-bcm2711", "pinctrl_bcm2835", "Y\n", true),
            ("pinctrl-bcm2835", "pinctrl_bcm2835", "N\n", false),
            ("pinctrl-rp1", "pinctrl_rp1", "Y\n", true),
            ("AMDIF031:00", "pinctrl_bcm2835", "Y\n", false),
        ] {
            let folder = root.path().join(module).join("parameters");
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(folder.join("persist_gpio_outputs"), value).unwrap();
            assert_eq!(kept_outputs(root.path(), label).is_some(), kept, "{label}");
        }
        assert!(kept_outputs(Path::new("/no/such/folder"), "pinctrl-bcm2711").is_none());
    }
}
