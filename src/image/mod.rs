//! Images: borrowed views of any supported pixel format, and owned buffers.

pub mod pixel_format;
pub mod view;

pub use pixel_format::PixelFormat;
pub use view::{Image, ImageView, PlaneView};
