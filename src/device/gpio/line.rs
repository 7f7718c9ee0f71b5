//! A line of a GPIO chip: found by name or number, held as an output.

use std::io;
use std::path::PathBuf;

use gpiocdev::line::Value;
use gpiocdev::{Chip, Request};

use super::watch::Output;
use crate::device::{Address, device_error};
use crate::error::{Error, Result};

/// Names shown when one is not found.
const NAMES_SHOWN: usize = 40;

/// Which line, and what its level means.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineId {
    pub chip: PathBuf,
    pub offset: u32,
    pub active_low: bool,
}

impl LineId {
    /// `/dev/gpiochipN/LINE`, `/LABEL/LINE` (a chip's label or name) or `/LINE` (a name on any chip),
    /// where LINE is a name, or a number: the offset on its chip.
    pub fn find(address: &Address) -> Result<Self> {
        let path = address.need_local_path()?;
        let active_low = match address.option("active") {
            None | Some("high") => false,
            Some("low") => true,
            Some(other) => return Err(address.wrong(format!("option active={other:?} is neither high nor low"))),
        };
        let (chip, line) = path.rsplit_once('/').unwrap_or(("", path));
        if line.is_empty() {
            return Err(address.wrong("it names no line: gpio:///dev/gpiochip0/laser"));
        }
        let number = if line.bytes().all(|b| b.is_ascii_digit()) {
            Some(line.parse::<u32>().map_err(|_| address.wrong(format!("line {line} does not exist")))?)
        } else {
            None
        };
        if chip.is_empty() && number.is_some() {
            return Err(address.wrong("a line's number needs its chip: gpio:///dev/gpiochip0/17"));
        }
        let chips = if chip.starts_with("/dev/") {
            vec![open_chip(&PathBuf::from(chip))?]
        } else {
            all_chips(chip.trim_start_matches('/'))?
        };
        let mut found = Vec::new();
        let mut names = Vec::new();
        for chip in &chips {
            let at = |e: &gpiocdev::Error| failed(&chip.path().display().to_string(), e);
            let lines = chip.info().map_err(|e| at(&e))?.num_lines;
            for offset in 0..lines {
                let info = chip.line_info(offset).map_err(|e| at(&e))?;
                if number == Some(offset) || (number.is_none() && info.name == line) {
                    found.push(Self { chip: chip.path().to_owned(), offset, active_low });
                }
                if !info.name.is_empty() {
                    names.push(info.name);
                }
            }
        }
        match (found.len(), found.pop()) {
            (1, Some(line)) => Ok(line),
            (0, _) => {
                let shown = names.len().min(NAMES_SHOWN);
                let named = match names.len() {
                    0 => "no line there has a name: give its number".to_owned(),
                    n => format!(
                        "the lines with a name are {}{}",
                        names[..shown].join(", "),
                        if n > shown { ", ..." } else { "" }
                    ),
                };
                Err(Error::DeviceNotFound { device: address.to_string(), reason: format!("no line {line:?}; {named}") })
            }
            (n, _) => Err(address.wrong(format!("{n} lines are called {line:?}: give the chip and the line's number"))),
        }
    }

    /// Takes the line as an output that is inactive.
    pub fn request(&self) -> io::Result<Line> {
        let mut builder = Request::builder();
        builder.on_chip(&self.chip).with_consumer("ptzcal laser").with_line(self.offset);
        if self.active_low {
            builder.as_active_low();
        }
        let request = builder.as_output(Value::Inactive).request().map_err(|e| system_error(&e))?;
        Ok(Line { request, offset: self.offset })
    }

    /// The error for a request that failed, with the name of whoever holds the line.
    pub fn refused(&self, error: &io::Error) -> Error {
        let holder =
            Chip::from_path(&self.chip).and_then(|chip| chip.line_info(self.offset)).map_or(String::new(), |info| {
                if info.used { format!(", held as {:?}", info.consumer) } else { String::new() }
            });
        device_error(&format!("{self}{holder}"), error)
    }

    /// The chip's label, such as "pinctrl-bcm2835".
    pub fn chip_label(&self) -> String {
        Chip::from_path(&self.chip).and_then(|chip| chip.info()).map_or(String::new(), |info| info.label)
    }
}

impl std::fmt::Display for LineId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} line {}", self.chip.display(), self.offset)
    }
}

/// A line held as an output. Letting go of it leaves its level to the kernel's driver.
pub struct Line {
    request: Request,
    offset: u32,
}

impl Output for Line {
    fn drive(&mut self, active: bool) -> io::Result<()> {
        let value = if active { Value::Active } else { Value::Inactive };
        self.request.set_value(self.offset, value).map_err(|e| system_error(&e))
    }
}

fn open_chip(path: &PathBuf) -> Result<Chip> {
    Chip::from_path(path).map_err(|e| failed(&path.display().to_string(), &e))
}

/// The chips that have this label or name; all when it is empty. Those that may not be opened are
/// passed over unless none is left.
fn all_chips(label: &str) -> Result<Vec<Chip>> {
    let paths = gpiocdev::chip::chips().map_err(|e| failed("/dev", &e))?;
    let mut first_error = None;
    let mut chips = Vec::new();
    let mut labels = Vec::new();
    for path in paths {
        let opened = Chip::from_path(&path).and_then(|chip| chip.info().map(|info| (chip, info)));
        match opened {
            Ok((chip, info)) => {
                if label.is_empty() || info.label == label || info.name == label {
                    chips.push(chip);
                }
                labels.push(info.label);
            }
            Err(e) => first_error = first_error.or(Some(failed(&path.display().to_string(), &e))),
        }
    }
    if !chips.is_empty() {
        return Ok(chips);
    }
    let reason = match labels.len() {
        0 => "there is no GPIO chip".to_owned(),
        _ => format!("no GPIO chip is called {label:?}; there are {}", labels.join(", ")),
    };
    Err(first_error.unwrap_or(Error::DeviceNotFound { device: format!("GPIO chip {label}"), reason }))
}

fn failed(device: &str, error: &gpiocdev::Error) -> Error {
    match error {
        gpiocdev::Error::GpioChip(..) => {
            Error::DeviceMismatch { device: device.to_owned(), reason: "it is no GPIO chip".into() }
        }
        _ => device_error(device, &system_error(error)),
    }
}

fn system_error(error: &gpiocdev::Error) -> io::Error {
    match error {
        gpiocdev::Error::Os(errno) | gpiocdev::Error::Uapi(_, gpiocdev_uapi::Error::Os(errno)) => {
            io::Error::from_raw_os_error(errno.0)
        }
        other => io::Error::other(other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn find(address: &str) -> Result<LineId> {
        LineId::find(&Address::parse(address).unwrap())
    }

    #[test]
    fn wrong_addresses_are_refused() {
        for (address, part) in [
            ("gpio://host/dev/gpiochip0/laser", "three slashes"),
            ("gpio:///", "names no path"),
            ("gpio:///dev/gpiochip0/", "names no line"),
            ("gpio:///17", "needs its chip"),
            ("gpio:///dev/gpiochip0/99999999999", "does not exist"),
            ("gpio:///dev/gpiochip0/laser?active=maybe", "neither high nor low"),
        ] {
            let error = find(address).unwrap_err();
            assert!(matches!(error, Error::InvalidAddress { .. }) && error.to_string().contains(part), "{error}");
        }
        assert!(matches!(find("gpio:///dev/no-such-chip/laser"), Err(Error::DeviceNotFound { .. })));
        assert!(matches!(find("gpio:///dev/null/laser"), Err(Error::DeviceMismatch { .. })));
        assert!(matches!(
            find("gpio:///no-such-label-at-all/laser"),
            Err(Error::DeviceNotFound { .. } | Error::DevicePermission { .. })
        ));
    }
}
