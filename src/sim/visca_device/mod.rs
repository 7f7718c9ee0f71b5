//! Emulated VISCA cameras, which a controller cannot tell from real ones but by their honesty: what
//! goes wrong is said beforehand ([`Fault`]).

mod body;
mod camera;
mod device;
mod emulator;
mod faults;
mod ip;
mod ports;
#[cfg(unix)]
mod pty;
mod registers;
mod server;
mod wire;

#[cfg(test)]
mod server_tests;
#[cfg(test)]
mod tests;

pub use camera::Behaviour;
pub use device::ViscaDevice;
pub use emulator::{Emulator, EmulatorOptions};
pub use faults::{Fault, FaultKind, When};
pub use server::{Server, ServerBuilder};
pub use wire::{Origin, Outgoing};
