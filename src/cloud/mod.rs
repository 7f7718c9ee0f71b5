//! Clouds and surfaces: moved, merged, cut, thinned; triangulated from grids of rays; seen by cameras
//! as depth maps; and covered with cameras' pictures.

pub mod depth;
pub mod lens;
pub mod points;
pub mod raster;
pub mod surface;
pub mod texture;
pub mod thin;

pub use crate::geometry::{CloudNoise, MAX_POINTS, Mesh, PointCloud, Texture};
pub use depth::{DepthView, cloud_depth, mesh_depth};
pub use points::{crop, merge, transform};
pub use surface::{GridPoint, RayGrid, SurfaceOptions, depth_grid, grid_cloud, triangulate};
pub use texture::{Picture, texture};
pub use thin::thin;

#[cfg(test)]
mod tests;
