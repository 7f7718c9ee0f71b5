//! Files: cameras as JSON of our own and as OpenCV's YAML, rigs over zoom, heads' angle maps, point clouds as PLY,
//! photographs and depth maps as PNG, JPEG (photographs only) or PNM.
//!
//! A file is written whole or not at all, and read whole or not at all: what is missing, damaged,
//! too large or of another version is an error that says where.

pub mod angle_json;
mod file;
pub mod model_json;
pub mod opencv_yaml;
pub mod picture;
pub mod ply;
pub mod recording_json;
pub mod zoom_json;

pub use angle_json::{AngleMapRecord, LearningRecord, read_angle_map, write_angle_map};
pub use file::{io_error, read_bounded, write_atomically};
pub use model_json::{CalibrationRecord, CameraRecord, read_camera, write_camera};
pub use opencv_yaml::{OpenCvCamera, read_opencv_yaml, write_opencv_yaml};
pub use picture::{read_depth, read_picture, write_png};
pub use ply::{PointCloud, read_ply, write_ply};
pub use zoom_json::{read_zoom_curve, write_zoom_curve};
