//! Emulated VISCA cameras, which a controller cannot tell from real ones but by their honesty: what
//! goes wrong is said beforehand ([`Fault`]).

mod body;
mod camera;
mod emulator;
mod faults;
mod registers;
mod wire;

pub use camera::Behaviour;
pub use emulator::{Emulator, EmulatorOptions};
pub use faults::{Fault, FaultKind, When};
pub use wire::{Origin, Outgoing};
