//! Rotations and rigid transforms, cameras and lenses, lines, planes, homographies, clouds and meshes: pure maths.

pub mod angle_map;
pub mod camera;
pub mod chi_square;
pub mod distortion;
pub mod head_image;
pub mod homography;
pub mod inverse_depth;
pub mod linalg;
pub mod line;
pub mod mesh;
pub mod plane;
pub mod point_cloud;
pub mod rig_model;
pub mod rig_parameters;
pub mod rigid;
pub mod spline;
pub mod zoom_curve;

pub use angle_map::AngleMap;
pub use camera::{Camera, Intrinsics};
pub use distortion::Distortion;
pub use head_image::HeadImage;
pub use inverse_depth::InverseDepthPoint;
pub use line::{Line3, MeasuredLine, Ray};
pub use mesh::{Mesh, Texture};
pub use plane::Plane;
pub use point_cloud::{CloudNoise, MAX_POINTS, PointCloud};
pub use rig_model::RigModel;
pub use rig_parameters::{RIG_PARAMETERS, RigParameter};
pub use rigid::Rigid;
pub use zoom_curve::ZoomCurve;

pub use nalgebra::{Matrix2, Matrix2x3, Matrix3, Matrix3x4, Vector2, Vector3};
