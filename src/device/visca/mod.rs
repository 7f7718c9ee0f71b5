//! VISCA: Sony's protocol for pan-tilt-zoom cameras, on serial lines (RS-232, RS-422) and over IP.
//!
//! - [`codec`], [`models`]: bytes to messages and back, units to radians and back. Pure, and the same
//!   for the driver and the emulated camera.
//! - [`bus`]: one line with its chain of cameras.
//! - `session`: the dialogue with one camera: which reply belongs to what, and what is tried again.
//! - [`ViscaHead`]: the camera as a head.
//!
//! Sources: Sony's technical manuals of the EVI-D30, D70, D80/D90, D100 and H100, Sony's command
//! lists of the BRC-300 and SRG-300H (VISCA over IP).

pub mod bus;
pub mod codec;
mod driver;
mod exposure;
mod jobs;
pub mod models;
mod open;
mod session;

#[cfg(test)]
mod tests;

pub use driver::ViscaHead;
pub use open::{is_visca, open};
pub use session::LONGEST_CALL;
