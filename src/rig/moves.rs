//! The rig's moves: the laser is off before the head starts, and lit only when it stands.

use nalgebra::Vector2;

use super::settle::Mover;
use super::{Rig, check_reach};
use crate::control::Cancel;
use crate::device::PtzPosition;
use crate::error::Result;

/// Settling is over 60 ms sooner than with 1; shots are taken in frames that are exposed later.
const EARLIEST_LOOK: f64 = 0.55;

impl Rig {
    /// Moves the head to the given readings and waits until it stands still there. The laser is off
    /// before the head starts.
    ///
    /// # Errors
    /// `NotFinite`, `Unreachable` (with the range); `Cancelled`; `DeviceTimeout` and `Device` when
    /// it does not arrive. After an error in a move the head was told to stop.
    pub fn move_to(&mut self, pan: f64, tilt: f64, cancel: &Cancel) -> Result<PtzPosition> {
        check_reach(&self.capabilities, pan, tilt)?;
        cancel.check()?;
        self.lit = None;
        self.laser.begin_move()?;
        let moved = self.mover().approach(Vector2::new(pan, tilt), cancel);
        match &moved {
            Ok(settled) => {
                self.rested = settled.rested;
                self.laser.end_move();
            }
            Err(_) => {
                self.approached = false;
                // The first error is the one to report.
                let _ = self.stop();
            }
        }
        moved.map(|settled| settled.position)
    }

    /// Accepted distances from a target in pan and tilt, radians.
    pub(super) fn tolerances(&self) -> [f64; 2] {
        self.options.settle.tolerances(&self.capabilities)
    }

    /// Does the head stand still, wherever it is?
    pub(super) fn stands_still(&mut self) -> Result<bool> {
        self.mover().stands_still()
    }

    fn mover(&mut self) -> Mover<'_> {
        Mover {
            ptz: &mut *self.ptz,
            capabilities: &self.capabilities,
            frames: &mut *self.frames,
            size: [self.model.width, self.model.height],
            clock: &*self.clock,
            log: &self.log,
            settle: self.options.settle,
            frame_options: self.options.frames,
            approached: &mut self.approached,
            pictures: &mut self.pictures,
            earliest_look: EARLIEST_LOOK,
        }
    }
}
