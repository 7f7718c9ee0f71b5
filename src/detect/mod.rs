//! Finding things in images: the laser's spot, chessboards, features that look alike in other images.

mod blobs;
pub mod chessboard;
mod gaussian_fit;
pub mod sift;
mod single_image;
pub mod spot;
#[cfg(test)]
mod spot_tests;
