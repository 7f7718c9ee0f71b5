//! Rigs that come whole from one address: the simulator and recordings.

use std::path::Path;
use std::sync::Arc;

use super::ScanRegion;
use crate::control::{Clock, Log};
use crate::device::recording::Recording;
use crate::device::{Address, FrameSource, Laser, PanTiltZoom};
use crate::error::{Error, Result};
use crate::geometry::RigModel;
use crate::sim::{SimOptions, Simulator};

/// A rig with all that belongs to it: head, laser, cameras, clock, model.
#[derive(Debug, Clone)]
pub enum WholeRig {
    Simulated(Simulator),
    Recorded(Recording),
}

impl WholeRig {
    /// Opens `sim:room?...` or `folder:///path`.
    ///
    /// # Errors
    /// `InvalidAddress`, `InvalidArgument` (an option of the simulator); `Unsupported` for an address
    /// that is not of a whole rig; what [`Recording::open`] says.
    pub fn open(address: &str) -> Result<Self> {
        if address.starts_with("sim:") {
            return Self::simulated(SimOptions::parse(address)?);
        }
        let parsed = Address::parse(address)?;
        match parsed.scheme() {
            "folder" => {
                parsed.check_options(&[])?;
                Recording::open(Path::new(parsed.need_local_path()?)).map(Self::Recorded)
            }
            scheme => Err(Error::Unsupported {
                what: format!(
                    "a whole rig at {scheme}://, only at sim: and folder:// (give the head's, the laser's and the \
                     camera's addresses one by one, or callbacks)"
                ),
            }),
        }
    }

    /// The head of a whole rig to be driven by hand: a simulator's time is then the system's.
    pub fn open_to_drive(address: &str) -> Result<Self> {
        if !address.starts_with("sim:") {
            return Self::open(address);
        }
        let options = SimOptions::parse(address)?;
        let real_time = if options.real_time > 0.0 { options.real_time } else { 1.0 };
        Self::simulated(SimOptions { real_time, ..options })
    }

    fn simulated(options: SimOptions) -> Result<Self> {
        Simulator::new(options).map(Self::Simulated)
    }

    /// The nominal model, or the one that was recorded.
    pub fn model(&self) -> RigModel {
        match self {
            Self::Simulated(simulator) => simulator.nominal_rig(),
            Self::Recorded(recording) => recording.info().rig,
        }
    }

    /// The head; a simulated one may be a VISCA camera behind its bytes.
    pub fn ptz(&self, log: Log) -> Result<Box<dyn PanTiltZoom>> {
        match self {
            Self::Simulated(simulator) => simulator.open_ptz(log),
            Self::Recorded(recording) => Ok(Box::new(recording.ptz())),
        }
    }

    pub fn laser(&self) -> Box<dyn Laser> {
        match self {
            Self::Simulated(simulator) => Box::new(simulator.laser()),
            Self::Recorded(recording) => Box::new(recording.laser()),
        }
    }

    /// The head camera's.
    pub fn frames(&self) -> Result<Box<dyn FrameSource>> {
        Ok(match self {
            Self::Simulated(simulator) => Box::new(simulator.head_frames()),
            Self::Recorded(recording) => Box::new(recording.frames(0)?),
        })
    }

    pub fn clock(&self) -> Arc<dyn Clock> {
        match self {
            Self::Simulated(simulator) => simulator.clock(),
            Self::Recorded(recording) => recording.clock(),
        }
    }

    /// Frames and image size of a fixed camera, from 0.
    ///
    /// # Errors
    /// `InvalidArgument` when there is no such camera.
    pub fn fixed_camera(&self, index: usize) -> Result<(Box<dyn FrameSource>, (u32, u32))> {
        let none = |n: usize| Error::invalid("address", format!("fixed camera {index}: the rig has {n}"));
        match self {
            Self::Simulated(simulator) => {
                let truth = simulator.truth();
                let camera = truth.fixed.get(index).ok_or_else(|| none(truth.fixed.len()))?;
                Ok((Box::new(simulator.fixed_frames(index)?), (camera.width, camera.height)))
            }
            Self::Recorded(recording) => {
                let fixed = &recording.info().cameras[1..];
                let size = *fixed.get(index).ok_or_else(|| none(fixed.len()))?;
                Ok((Box::new(recording.frames(1 + index)?), size))
            }
        }
    }

    /// The region of a recording; a simulator has none.
    pub fn region(&self) -> Option<ScanRegion> {
        let Self::Recorded(recording) = self else { return None };
        let r = recording.info().region;
        Some(ScanRegion { pan: r.pan, tilt: r.tilt, pan_steps: r.pan_steps, tilt_steps: r.tilt_steps })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Status;

    #[test]
    fn addresses_of_other_things_are_refused() {
        for (address, status) in [
            ("sim:room?speed=-1", Status::InvalidArgument),
            ("folder:///no/such/folder", Status::FileIo),
            ("folder://host/path", Status::InvalidAddress),
            ("folder:///tmp?x=1", Status::InvalidAddress),
            ("visca:///dev/ttyS0", Status::Unsupported),
            ("room", Status::InvalidAddress),
        ] {
            assert_eq!(WholeRig::open(address).unwrap_err().status(), status, "{address}");
        }
        let rig = WholeRig::open("sim:room").unwrap();
        assert_eq!(rig.fixed_camera(99).err().unwrap().status(), Status::InvalidArgument);
        assert!(rig.region().is_none());
    }
}
