//! Clouds and meshes by the ending of their file's name: .ply, .pcd (clouds), .glb, .wrl.

use std::path::Path;

use super::gltf::{read_glb, write_glb};
use super::pcd::{PcdData, read_pcd, write_pcd};
use super::ply::{read_ply, read_ply_mesh, write_ply, write_ply_mesh};
use super::point_fields::CloudFile;
use super::vrml::{read_vrml, write_vrml};
use crate::error::{Error, Result};
use crate::geometry::{Mesh, PointCloud};

#[derive(Clone, Copy)]
enum Format {
    Ply,
    Pcd,
    Glb,
    Vrml,
}

fn format(path: &Path) -> Result<Format> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match ending.as_str() {
        "ply" => Ok(Format::Ply),
        "pcd" => Ok(Format::Pcd),
        "glb" => Ok(Format::Glb),
        "wrl" => Ok(Format::Vrml),
        _ => Err(Error::Unsupported { what: format!("{}: neither .ply nor .pcd nor .glb nor .wrl", path.display()) }),
    }
}

/// Writes a cloud; PCD binary.
pub fn write_cloud(path: &Path, cloud: &PointCloud) -> Result<()> {
    match format(path)? {
        Format::Ply => write_ply(path, cloud),
        Format::Pcd => write_pcd(path, cloud, PcdData::Binary),
        Format::Glb => write_glb(path, &cloud.clone().into()),
        Format::Vrml => write_vrml(path, &cloud.clone().into()),
    }
}

/// Reads the points of a file; of a mesh its vertices.
pub fn read_cloud(path: &Path) -> Result<CloudFile> {
    let of = |mesh: Mesh| CloudFile { cloud: mesh.vertices, skipped: 0 };
    match format(path)? {
        Format::Ply => read_ply(path),
        Format::Pcd => read_pcd(path),
        Format::Glb => read_glb(path).map(of),
        Format::Vrml => read_vrml(path).map(of),
    }
}

/// Writes a mesh, in PLY without its textures.
///
/// # Errors
/// `Unsupported` for PCD, which has no triangles.
pub fn write_mesh(path: &Path, mesh: &Mesh) -> Result<()> {
    match format(path)? {
        Format::Ply => write_ply_mesh(path, mesh),
        Format::Glb => write_glb(path, mesh),
        Format::Vrml => write_vrml(path, mesh),
        Format::Pcd => Err(no_triangles(path)),
    }
}

/// Reads a mesh.
///
/// # Errors
/// `Unsupported` for PCD, which has no triangles.
pub fn read_mesh(path: &Path) -> Result<Mesh> {
    match format(path)? {
        Format::Ply => read_ply_mesh(path),
        Format::Glb => read_glb(path),
        Format::Vrml => read_vrml(path),
        Format::Pcd => Err(no_triangles(path)),
    }
}

fn no_triangles(path: &Path) -> Error {
    Error::Unsupported { what: format!("{}: PCD has no triangles", path.display()) }
}
