//! What carries bytes to a device and back: a serial line, a socket, or an emulated device's memory.

use std::sync::Arc;

use crate::error::Result;

/// A way to a device that another thread may send on at the same time.
pub trait Link: Send {
    /// Takes what has arrived into `buffer`, waiting at most `timeout` seconds, and gives its number
    /// of bytes; 0 when nothing came. From datagrams one at a time.
    ///
    /// # Errors
    /// `DeviceLost` when the device is gone: the link is of no more use.
    fn receive(&mut self, buffer: &mut [u8], timeout: f64) -> Result<usize>;

    /// The sending half, which lives on its own.
    fn sender(&self) -> Arc<dyn Sender>;
}

/// Sends whole messages: those of two threads never mix.
pub trait Sender: Send + Sync {
    /// Sends one message, or fails in bounded time.
    ///
    /// # Errors
    /// `DeviceLost` when the device is gone, `DeviceTimeout` when the line takes nothing.
    fn send(&self, message: &[u8]) -> Result<()>;
}
