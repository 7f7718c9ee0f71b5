//! What runs in the machine.

#[cfg(feature = "v4l2")]
mod camera;
#[cfg(feature = "v4l2")]
mod display;
mod laser;
mod laser_host;
#[cfg(feature = "v4l2")]
mod motion_jpeg;
#[cfg(feature = "v4l2")]
pub mod scene;
