//! Pictures of what was found: an image with marks on it.

mod canvas;
pub mod chart;
mod marks;

pub use canvas::{Canvas, Colour};
pub use marks::{EXAGGERATION, board, matches, residuals};
