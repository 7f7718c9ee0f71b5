//! Heads that speak Pelco-D or Pelco-P over a serial line.

mod codec;
mod driver;
#[cfg(test)]
mod emulator;
mod open;
#[cfg(test)]
mod tests;

pub use codec::{Dialect, Drive, Framer, Message, Quantity, XorCoverage};
pub use driver::{PelcoHead, PelcoOptions, TiltDirection};
pub use open::open_head;
