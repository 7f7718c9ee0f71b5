//! Pictures of what was found: an image with marks on it, and charts.

mod axis;
mod canvas;
pub mod chart;
mod marks;
pub mod svg;

pub use axis::significant;
pub use canvas::{Canvas, Colour};
pub use marks::{EXAGGERATION, board, matches, residuals};
