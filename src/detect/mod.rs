//! Finding things in images: the laser's spot, chessboards, edges and lines.

mod blobs;
pub mod chessboard;
pub mod edges;
mod gaussian_fit;
pub mod lines;
mod single_image;
pub mod spot;
#[cfg(test)]
mod spot_tests;
