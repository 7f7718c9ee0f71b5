//! Images: borrowed views of any supported pixel format, owned buffers, and what changed between frames.

pub mod area;
pub mod components;
pub mod depth;
pub mod difference;
pub mod exponential;
pub mod frames;
pub mod photometry;
pub mod pixel_format;
pub mod pyramid;
pub mod undistort;
pub mod view;

pub use depth::{DepthMap, DepthNoise, InverseDepth};
pub use pixel_format::PixelFormat;
pub use undistort::{Undistorter, undistorted_camera};
pub use view::{Image, ImageView, PlaneView, PlaneViewMut};
