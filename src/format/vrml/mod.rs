//! Clouds and meshes as VRML97 (.wrl), as the thesis made them: IndexedFaceSet or PointSet with
//! colours, and pictures inside the file (PixelTexture).
//!
//! VRML's frame is x right, y UP, z towards the viewer, ours y down and z forward: a Transform at the
//! root turns ours into it (half a turn about x), and reading takes the turn back. Normals and noise
//! have no place in it: a viewer makes normals itself, PLY, PCD and glTF keep noise.
//!
//! Specification: ISO/IEC 14772-1:1997.

mod read;
mod syntax;
#[cfg(test)]
mod tests;
mod write;

pub use read::{from_vrml, read_vrml};
pub use write::{to_vrml, write_vrml};
