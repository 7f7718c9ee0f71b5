//! VISCA: Sony's protocol for pan-tilt-zoom cameras, on serial lines (RS-232, RS-422) and over IP.
//!
//! `codec` and `models` are pure: bytes to messages and back, units to radians and back. They serve
//! the driver and the emulated camera alike.
//!
//! Sources: Sony's technical manuals of the EVI-D30, D70, D80/D90, D100 and H100, Sony's command
//! lists of the BRC-300 and SRG-300H (VISCA over IP).

pub mod codec;
pub mod models;
