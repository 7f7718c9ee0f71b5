//! Emulated VISCA cameras. A controller cannot tell them from real ones by their bytes; what goes
//! wrong is said beforehand ([`Fault`]).
//!
//! [`Emulator`] is the device and nothing else: bytes and moments in, bytes and moments out. It has
//! a head of its own, or that of a [`Simulator`](crate::sim::Simulator), whose pictures then show
//! where it really is. [`ViscaDevice`] gives it a clock and links in memory, so that a day of work
//! passes in seconds; [`Server`] puts it behind a pseudo-terminal and sockets for other programs, in
//! real time.
//!
//! Where the manuals leave open what a camera does, this one: takes a command that comes before the
//! acknowledgement of the last after it; answers not at all to what is for nobody; goes to the end of
//! its travel for positions beyond it; completes a move when the next takes its place; and needs a
//! free socket for a stop as for any command.
//!
//! ```
//! use std::sync::Arc;
//! use ptzcal::sim::VirtualClock;
//! use ptzcal::sim::visca_device::{EmulatorOptions, ViscaDevice};
//!
//! let device = ViscaDevice::new(&EmulatorOptions::default(), Arc::new(VirtualClock::default()))?;
//! let mut link = device.link()?;
//! link.sender().send(&[0x81, 0x09, 0x00, 0x02, 0xff])?;
//! let mut reply = [0; 16];
//! let count = link.receive(&mut reply, 1.0)?;
//! // An EVI-D100 of Sony's.
//! assert_eq!(reply[..count], [0x90, 0x50, 0x00, 0x01, 0x04, 0x0d, 0x01, 0x00, 0x02, 0xff]);
//! # Ok::<(), ptzcal::Error>(())
//! ```

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
