//! How a region is scanned.

use std::path::PathBuf;

use super::super::gate::GateOptions;
use crate::control::Cancel;
use crate::detect::spot::SpotOptions;
use crate::error::{Error, Result};

/// How a region is scanned.
#[derive(Debug, Clone)]
pub struct ScanOptions {
    /// Frames with the laser off and with it on, averaged; 1 to 256. They have to fit into the
    /// laser's longest time on.
    pub frames_per_state: u32,
    /// Positions of the coarse pass, about.
    pub coarse_shots: u32,
    /// How often a position is tried when a device fails.
    pub attempts: u32,
    /// How long a device that is gone (unplugged, switched off) is waited for, seconds. Drivers of the
    /// library open their device again; 0: the scan ends at once.
    pub reconnect: f64,
    /// From a toggle's return until the light has changed, seconds.
    pub laser_latency: f64,
    /// How spots are found; region and band are set by the scan.
    pub spot: SpotOptions,
    pub gate: GateOptions,
    /// Ends the scan once every fixed camera's position is expected to be known to this, root mean square,
    /// metres, the rig taken as exact; positions are then visited in eight passes over the region. 0: the
    /// whole region.
    pub target_accuracy: f64,
    /// Where each shot is written before it is acknowledged; an existing journal of the same scan is
    /// resumed.
    pub journal: Option<PathBuf>,
    /// Wait for the disk at each shot, so that a power cut loses none either.
    pub journal_sync: bool,
    /// A folder where all frames are written, to be scanned again without the rig
    /// ([`crate::device::recording`]); what a scan of the same region has recorded there is kept.
    pub record: Option<PathBuf>,
    pub cancel: Cancel,
}

impl Default for ScanOptions {
    fn default() -> Self {
        Self {
            frames_per_state: 1,
            coarse_shots: 80,
            attempts: 3,
            reconnect: 0.0,
            laser_latency: 0.0,
            spot: SpotOptions::default(),
            gate: GateOptions::default(),
            target_accuracy: 0.0,
            journal: None,
            journal_sync: true,
            record: None,
            cancel: Cancel::new(),
        }
    }
}

impl ScanOptions {
    pub(in crate::rig) fn validate(&self) -> Result<()> {
        if !(1..=256).contains(&self.frames_per_state) {
            return Err(Error::invalid("frames_per_state", format!("{} is not in [1, 256]", self.frames_per_state)));
        }
        if self.attempts == 0 {
            return Err(Error::invalid("attempts", "at least 1"));
        }
        if !(0.0..=86_400.0).contains(&self.reconnect) {
            return Err(Error::invalid("reconnect", format!("{} s is not in [0, 86400]", self.reconnect)));
        }
        if !(0.0..=10.0).contains(&self.laser_latency) {
            return Err(Error::invalid("laser_latency", format!("{} s is not in [0, 10]", self.laser_latency)));
        }
        if !(self.target_accuracy.is_finite() && self.target_accuracy >= 0.0) {
            return Err(Error::invalid("target_accuracy", format!("{} m", self.target_accuracy)));
        }
        self.spot.check()?;
        self.gate.validate()
    }
}
