//! The numbers of the camera block: which there are, which values they take, and when.

use crate::device::visca::codec::{Fault, Register};

const ON: u16 = 2;
const STANDBY: u16 = 3;
const AUTO_FOCUS: u16 = 2;
const MANUAL_FOCUS: u16 = 3;
const ONE_PUSH: u16 = 3;
const MANUAL_WHITE: u16 = 5;
const MANUAL_EXPOSURE: u16 = 3;
const SHUTTER_PRIORITY: u16 = 0x0a;
const IRIS_PRIORITY: u16 = 0x0b;

/// Values of all registers but zoom and focus, which move.
#[derive(Debug, Clone)]
pub(super) struct Registers {
    values: [u16; Register::ALL.len()],
    manual_white: bool,
}

impl Registers {
    /// Switched on, all automatic.
    pub fn new(manual_white: bool) -> Self {
        let mut registers = Self { values: [0; Register::ALL.len()], manual_white };
        for (register, value) in [
            (Register::Power, ON),
            (Register::FocusMode, AUTO_FOCUS),
            (Register::RedGain, 0x80),
            (Register::BlueGain, 0x80),
            (Register::Shutter, 0x05),
            (Register::Iris, 0x0c),
            (Register::Gain, 0x03),
        ] {
            registers.values[register as usize] = value;
        }
        registers
    }

    pub fn get(&self, register: Register) -> u16 {
        self.values[register as usize]
    }

    pub fn is_on(&self) -> bool {
        self.get(Register::Power) == ON
    }

    pub fn focuses_itself(&self) -> bool {
        self.get(Register::FocusMode) == AUTO_FOCUS
    }

    /// # Errors
    /// `Syntax` for a value that does not exist, `NotExecutable` for one that is set by itself in the
    /// present mode.
    pub fn set(&mut self, register: Register, value: u16) -> Result<(), Fault> {
        let exposure = self.get(Register::ExposureMode);
        let manual = |modes: &[u16]| modes.contains(&exposure);
        let (exists, free) = match register {
            Register::Power => ((ON..=STANDBY).contains(&value), true),
            Register::WhiteBalance => (value < MANUAL_WHITE || value == MANUAL_WHITE && self.manual_white, true),
            Register::FocusMode => ((AUTO_FOCUS..=MANUAL_FOCUS).contains(&value), true),
            Register::ExposureMode => ([0, MANUAL_EXPOSURE, SHUTTER_PRIORITY, IRIS_PRIORITY].contains(&value), true),
            Register::RedGain | Register::BlueGain => (value <= 0xff, self.get(Register::WhiteBalance) == MANUAL_WHITE),
            Register::Shutter => (value <= 0x15, manual(&[MANUAL_EXPOSURE, SHUTTER_PRIORITY])),
            Register::Iris => (value <= 0x11, manual(&[MANUAL_EXPOSURE, IRIS_PRIORITY])),
            Register::Gain => (value <= 0x0f, manual(&[MANUAL_EXPOSURE])),
            Register::Zoom | Register::Focus => (false, false),
        };
        if !exists {
            return Err(Fault::Syntax);
        }
        if !free {
            return Err(Fault::NotExecutable);
        }
        self.values[register as usize] = value;
        Ok(())
    }

    /// Measures white now.
    pub fn one_push_white(&self) -> Result<(), Fault> {
        if self.get(Register::WhiteBalance) == ONE_PUSH { Ok(()) } else { Err(Fault::NotExecutable) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_automatic_cannot_be_set() {
        let mut r = Registers::new(true);
        assert!(r.is_on() && r.focuses_itself());
        assert_eq!(r.set(Register::Shutter, 0x10), Err(Fault::NotExecutable));
        assert_eq!(r.set(Register::ExposureMode, MANUAL_EXPOSURE), Ok(()));
        assert_eq!(r.set(Register::Shutter, 0x10), Ok(()));
        assert_eq!(r.get(Register::Shutter), 0x10);
        assert_eq!(r.set(Register::Shutter, 0x16), Err(Fault::Syntax));
        assert_eq!(r.set(Register::ExposureMode, 7), Err(Fault::Syntax));
        assert_eq!(r.set(Register::RedGain, 9), Err(Fault::NotExecutable));
        assert_eq!(r.one_push_white(), Err(Fault::NotExecutable));
        assert_eq!(r.set(Register::WhiteBalance, ONE_PUSH), Ok(()));
        assert_eq!(r.one_push_white(), Ok(()));
        assert_eq!(r.set(Register::Zoom, 0), Err(Fault::Syntax));
        assert_eq!(r.set(Register::Power, STANDBY), Ok(()));
        assert!(!r.is_on());
        assert_eq!(Registers::new(false).set(Register::WhiteBalance, MANUAL_WHITE), Err(Fault::Syntax));
    }
}
