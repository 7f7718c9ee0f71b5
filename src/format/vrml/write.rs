//! Writing VRML97.

use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::super::file::write_streamed;
use crate::error::{Error, Result};
use crate::geometry::{Mesh, Texture};
use crate::image::PixelFormat;

/// Writes a mesh; one without triangles, which is a cloud, as points.
///
/// # Errors
/// The mesh's own; `FileIo`.
pub fn write_vrml(path: &Path, mesh: &Mesh) -> Result<()> {
    mesh.validate()?;
    write_streamed(path, &mut |file| write(&mut BufWriter::with_capacity(1 << 16, file), mesh))
}

/// A mesh's file as text.
pub fn to_vrml(mesh: &Mesh) -> Result<Vec<u8>> {
    mesh.validate()?;
    let mut bytes = Vec::new();
    write(&mut bytes, mesh).map_err(|e| Error::Internal { reason: e.to_string() })?;
    Ok(bytes)
}

fn write(file: &mut dyn Write, mesh: &Mesh) -> io::Result<()> {
    let cloud = &mesh.vertices;
    write!(
        file,
        "#VRML V2.0 utf8\n# From ptzcal. Inside the Transform: x right, y down, z forward, metres.\n\
         Transform {{ rotation 1 0 0 3.14159265358979312 children [\n"
    )?;
    if mesh.triangles.is_empty() && !cloud.is_empty() {
        writeln!(file, "Shape {{ geometry PointSet {{")?;
        coordinates(file, mesh)?;
        colours(file, mesh)?;
        writeln!(file, "}} }}")?;
    }
    let mut defined = mesh.triangles.is_empty();
    let mut shape = |file: &mut dyn Write, triangles: &[u32], texture: Option<&Texture>| {
        writeln!(file, "Shape {{")?;
        if let Some(texture) = texture {
            write!(file, "appearance Appearance {{ texture ")?;
            picture(file, texture)?;
            writeln!(file, " }}")?;
        }
        writeln!(file, "geometry IndexedFaceSet {{ solid FALSE")?;
        if std::mem::replace(&mut defined, true) {
            writeln!(file, "coord USE POINTS")?;
        } else {
            coordinates(file, mesh)?;
        }
        match texture {
            Some(texture) => places(file, texture)?,
            None => colours(file, mesh)?,
        }
        writeln!(file, "coordIndex [")?;
        for t in triangles {
            let [a, b, c] = mesh.triangles[*t as usize];
            writeln!(file, "{a} {b} {c} -1")?;
        }
        writeln!(file, "] }} }}")
    };
    let plain = mesh.untextured();
    if !plain.is_empty() {
        shape(file, &plain, None)?;
    }
    for texture in mesh.textures.iter().filter(|t| !t.triangles.is_empty()) {
        shape(file, &texture.triangles, Some(texture))?;
    }
    writeln!(file, "] }}")?;
    file.flush()
}

fn coordinates(file: &mut dyn Write, mesh: &Mesh) -> io::Result<()> {
    writeln!(file, "coord DEF POINTS Coordinate {{ point [")?;
    for p in &mesh.vertices.positions {
        // A tenth of a micrometre.
        writeln!(file, "{:.7} {:.7} {:.7}", p.x, p.y, p.z)?;
    }
    writeln!(file, "] }}")
}

fn colours(file: &mut dyn Write, mesh: &Mesh) -> io::Result<()> {
    writeln!(file, "color Color {{ color [")?;
    for colour in &mesh.vertices.colours {
        let [r, g, b] = colour.map(|c| f64::from(c) / 255.0);
        writeln!(file, "{r:.4} {g:.4} {b:.4}")?;
    }
    writeln!(file, "] }}")
}

/// VRML's (0, 0) is the lower left corner of the picture, (1, 1) the upper right.
fn places(file: &mut dyn Write, texture: &Texture) -> io::Result<()> {
    let [w, h] = [f64::from(texture.image.width), f64::from(texture.image.height)];
    writeln!(file, "texCoord TextureCoordinate {{ point [")?;
    for [x, y] in &texture.places {
        writeln!(file, "{:.7} {:.7}", (f64::from(*x) + 0.5) / w, 1.0 - (f64::from(*y) + 0.5) / h)?;
    }
    writeln!(file, "] }}")
}

/// Its rows go up from the bottom.
fn picture(file: &mut dyn Write, texture: &Texture) -> io::Result<()> {
    let image = &texture.image;
    let channels = if image.format == PixelFormat::Gray8 { 1 } else { 3 };
    write!(file, "PixelTexture {{ repeatS FALSE repeatT FALSE image {} {} {channels}", image.width, image.height)?;
    let row = image.width as usize * channels;
    for line in image.data.chunks_exact(row.max(1)).take(image.height as usize).rev() {
        for (x, pixel) in line.chunks_exact(channels).enumerate() {
            file.write_all(if x % 16 == 0 { b"\n0x" } else { b" 0x" })?;
            pixel.iter().try_for_each(|v| write!(file, "{v:02X}"))?;
        }
    }
    write!(file, " }}")
}
