//! `ptzcal` turns a pan-tilt-zoom camera with a laser pointer on its moving head into a surveying
//! instrument, and calibrates the fixed cameras of a surveillance network with it.
//!
//! Layers; a file imports only from its own layer or from below:
//!
//! ```text
//! capi                               the C API: translates and checks, computes nothing
//! ptz  rig  rig_calibration  rgbd    workflows: drive; aim and scan; calibrate the rig; colour and depth;
//! angle_learning  probe              learn what a head's numbers mean; find out what a device does;
//! network  study  pointing  health   tie stations; label and plan; click to point; has it moved?
//! report                             what was measured, as a page for people
//! detect  calibrate  adjust  pose    algorithms: pure functions of their input;
//! cloud                              clouds and surfaces
//! device  sim                        the ports (traits) and what implements them
//! geometry  image  draw  format      foundations: pure data, maths, pictures and files
//! control  error  vectors            cancel, progress, log; the error type; loops for wide vectors
//! ```
//!
//! Conventions everywhere: metres, radians, seconds, pixels. Camera frame x right, y down,
//! z forward; pixel (0, 0) is the CENTRE of the top-left pixel; poses are world to camera.
//! Rig frame = head frame at pan = tilt = 0; positive pan turns right, positive tilt turns up.
#![deny(unsafe_code)]

pub mod adjust;
pub mod angle_learning;
pub mod calibrate;
#[doc(hidden)]
pub mod capi;
pub mod cloud;
pub mod control;
pub mod detect;
pub mod device;
pub mod draw;
pub mod error;
pub mod format;
#[cfg(test)]
mod fuzz;
pub mod geometry;
pub mod health;
pub mod image;
pub mod network;
pub mod pointing;
pub mod pose;
pub mod probe;
pub mod ptz;
pub mod report;
pub mod rgbd;
pub mod rig;
pub mod rig_calibration;
pub mod sim;
pub mod study;
pub(crate) mod vectors;

pub use error::{Error, Result};
