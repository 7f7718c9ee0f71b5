//! Finding things in images: the laser's spot, chessboards.

mod blobs;
pub mod chessboard;
mod gaussian_fit;
mod single_image;
pub mod spot;
#[cfg(test)]
mod spot_tests;
