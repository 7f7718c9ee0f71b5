//! Joint maximum-likelihood adjustment of a laser rig with the fixed cameras that watched it
//! (docs/maths.md section 9.3): laser line, head intrinsics, axis offsets and encoders of the rig, its
//! pose at every station, and every camera's intrinsics, lens and pose, from all shots at once.
//!
//! Each shot has an unknown inverse depth, and where the head's pointing is noisy two unknown
//! angles, which a Schur complement eliminates; each group of parameters has a Gaussian prior.

mod adjusted;
mod batch;
mod check;
mod eliminate;
mod gram;
mod layout;
mod linearise;
mod outliers;
mod plane_hit;
mod prior;
mod problem;
mod solve;
mod start;
#[cfg(test)]
mod tests;
mod tile;
mod weakness;

pub use crate::calibrate::{FitCheck, Suspect, Weakness};
pub use adjusted::Adjusted;
pub use prior::Prior;
pub use problem::{AdjustOptions, Adjustment, CameraSetup, Shot, Sighting, Station};
pub use solve::adjust;
