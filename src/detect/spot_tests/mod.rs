//! Spot detection on rendered frames whose truth is known.

mod accuracy;
mod disturbances;
mod formats;
mod render;
