//! Files: cameras as JSON of our own and as OpenCV, ROS, COLMAP, mrcal and Kalibr have them, rigs over
//! zoom, heads' angle maps, clouds and meshes as PLY, PCD, glTF and VRML, photographs and depth maps as
//! PNG, JPEG (photographs only) or PNM.
//!
//! A file is written whole or not at all, and read whole or not at all: what is missing, damaged,
//! too large or of another version is an error that says where.

pub mod angle_json;
mod base64;
pub mod cameras;
pub mod correspondence_csv;
mod file;
pub mod gltf;
mod lzf;
pub mod model;
pub mod model_json;
#[cfg(test)]
mod model_tests;
mod observation;
pub mod pcd;
pub mod picture;
pub mod ply;
mod point_fields;
pub mod recording_json;
mod scalar;
mod tree;
pub mod vrml;
pub mod zoom_json;

pub use angle_json::{AngleMapRecord, LearningRecord, read_angle_map, write_angle_map};
pub use base64::base64;
pub use cameras::opencv::{OpenCvCamera, read_opencv, write_opencv_yaml};
pub use cameras::{CameraFormat, NamedCamera, read_cameras, write_cameras};
pub use correspondence_csv::{read_correspondences_csv, write_correspondences_csv};
pub use file::{io_error, read_bounded, write_atomically};
pub use gltf::{read_glb, write_glb};
pub use model::{read_cloud, read_mesh, write_cloud, write_mesh};
pub use model_json::{CalibrationRecord, CameraRecord, read_camera, write_camera};
pub use observation::{InputsRecord, ObservationRecord, OptionsRecord};
pub use pcd::{PcdData, read_pcd, write_pcd};
pub use picture::{encode_jpeg, read_depth, read_picture, write_depth, write_png};
pub use ply::{read_ply, read_ply_mesh, write_ply, write_ply_mesh};
pub use point_fields::CloudFile;
pub use vrml::{read_vrml, write_vrml};
pub use zoom_json::{read_zoom_curve, write_zoom_curve};
