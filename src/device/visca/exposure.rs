//! Holding exposure and white balance as they are.

use super::codec::{Register, Request};
use super::driver::ViscaHead;
use crate::error::{Error, Result};

const MANUAL_EXPOSURE: u16 = 3;
const MANUAL_WHITE: u16 = 5;
const ONE_PUSH_WHITE: u16 = 3;

/// Settings that an exposure lock changes, as they were.
#[derive(Debug, Clone, Copy)]
pub struct Modes {
    exposure: u16,
    white: u16,
}

impl ViscaHead {
    pub(super) fn lock(&mut self) -> Result<()> {
        let earlier =
            Modes { exposure: self.register(Register::ExposureMode)?, white: self.register(Register::WhiteBalance)? };
        // What the automatic has chosen. Asked for before the modes change, because cameras then
        // fall back to what was set by hand the last time.
        const HELD: [Register; 5] =
            [Register::Shutter, Register::Iris, Register::Gain, Register::RedGain, Register::BlueGain];
        let mut held = [None; HELD.len()];
        for (value, register) in held.iter_mut().zip(HELD) {
            *value = self.optional_register(register)?;
        }
        // From here on there is something to restore.
        self.unlocked = Some(earlier);
        self.set(Register::ExposureMode, MANUAL_EXPOSURE)?;
        if self.model().manual_white {
            self.set(Register::WhiteBalance, MANUAL_WHITE)?;
        } else {
            self.set(Register::WhiteBalance, ONE_PUSH_WHITE)?;
            self.session.command(Request::OnePushWhite)?;
        }
        for (register, value) in HELD.into_iter().zip(held) {
            let is_white = matches!(register, Register::RedGain | Register::BlueGain);
            match value {
                Some(value) if self.model().manual_white || !is_white => match self.set(register, value) {
                    // Some cameras tell a gain that cannot be set.
                    Ok(()) | Err(Error::DeviceRefused { .. }) => (),
                    Err(error) => return Err(error),
                },
                _ => (),
            }
        }
        Ok(())
    }

    pub(super) fn unlock(&mut self) -> Result<()> {
        if let Some(modes) = self.unlocked {
            self.set(Register::ExposureMode, modes.exposure)?;
            self.set(Register::WhiteBalance, modes.white)?;
            self.unlocked = None;
        }
        Ok(())
    }
}
