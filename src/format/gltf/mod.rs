//! Clouds and meshes as binary glTF 2.0 (.glb), colours, textures and noise included.
//!
//! glTF's frame is x right, y UP, z towards the viewer, ours y down and z forward: the file's one node
//! turns ours into it (half a turn about x), so that a viewer looks at the scene as the rig did, and
//! the numbers in the file are ours. Reading takes the turn back. Further than a kilometre from the
//! origin, where floats are too coarse, the node also has a translation.
//!
//! Attributes of vertices: POSITION, NORMAL; COLOR_0, which glTF wants in linear light (16 bits);
//! TEXCOORD_0; and of our own _STANDARD_DEVIATION (metres), _COVARIANCE_DIAGONAL (xx, yy, zz, m^2),
//! _COVARIANCE_OFF_DIAGONAL (xy, xz, yz) and, where a texture takes COLOR_0's place, _COLOR_0. Materials
//! are unlit (KHR_materials_unlit): the light is in the pictures.
//!
//! Specification: Khronos, "glTF 2.0" (ISO/IEC 12113:2022).

mod read;
#[cfg(test)]
mod tests;
mod write;

pub use read::{from_glb, read_glb};
pub use write::{to_glb, write_glb};

const MAGIC: u32 = 0x4654_6C67;
const JSON: u32 = 0x4E4F_534A;
const BIN: u32 = 0x004E_4942;

const BYTE: u64 = 5120;
const UNSIGNED_BYTE: u64 = 5121;
const SHORT: u64 = 5122;
const UNSIGNED_SHORT: u64 = 5123;
const UNSIGNED_INT: u64 = 5125;
const FLOAT: u64 = 5126;

const POINTS: u64 = 0;
const TRIANGLES: u64 = 4;

const DEVIATION: &str = "_STANDARD_DEVIATION";
const DIAGONAL: &str = "_COVARIANCE_DIAGONAL";
const OFF_DIAGONAL: &str = "_COVARIANCE_OFF_DIAGONAL";
const HIDDEN_COLOUR: &str = "_COLOR_0";

/// A picture's value (sRGB, IEC 61966-2-1) in linear light, both 0 to 1.
fn to_linear(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// The inverse of [`to_linear`].
fn to_srgb(v: f64) -> f64 {
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}
