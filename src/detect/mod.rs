//! Finding things in images: the laser's spot, chessboards, edges and straight lines, features that look
//! alike in other images.

mod blobs;
pub mod chessboard;
pub mod edges;
mod gaussian_fit;
pub mod lines;
pub mod sift;
mod single_image;
pub mod spot;
#[cfg(test)]
mod spot_tests;
