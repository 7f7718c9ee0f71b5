//! Writing binary glTF.

use std::io::{self, Write};
use std::path::Path;

use nalgebra::Vector3;
use serde_json::{Map, Value, json};

use super::super::file::write_streamed;
use super::super::picture::encode_png;
use super::super::point_fields::FLOAT_RANGE;
use super::{
    BIN, DEVIATION, DIAGONAL, FLOAT, HIDDEN_COLOUR, JSON, MAGIC, OFF_DIAGONAL, POINTS, TRIANGLES, UNSIGNED_INT,
    UNSIGNED_SHORT, to_linear,
};
use crate::error::{Error, Result};
use crate::geometry::{CloudNoise, Mesh, PointCloud};

/// Targets of buffer views.
const ARRAY: u64 = 34962;
const INDICES: u64 = 34963;

/// Writes a mesh; one without triangles, which is a cloud, as points.
///
/// # Errors
/// The mesh's own; `FileIo`; `Unsupported` above 4 GiB.
pub fn write_glb(path: &Path, mesh: &Mesh) -> Result<()> {
    let parts = parts(mesh)?;
    write_streamed(path, &mut |file| parts.write(file))
}

/// A mesh's file as bytes.
pub fn to_glb(mesh: &Mesh) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    parts(mesh)?.write(&mut bytes).map_err(|e| Error::Internal { reason: e.to_string() })?;
    Ok(bytes)
}

struct Parts {
    json: Vec<u8>,
    binary: Vec<u8>,
}

impl Parts {
    fn length(&self) -> usize {
        12 + 8 + self.json.len() + if self.binary.is_empty() { 0 } else { 8 + self.binary.len() }
    }

    fn write(&self, file: &mut dyn Write) -> io::Result<()> {
        let mut numbers = |list: &[u32]| list.iter().try_for_each(|n| file.write_all(&n.to_le_bytes()));
        numbers(&[MAGIC, 2, self.length() as u32, self.json.len() as u32, JSON])?;
        file.write_all(&self.json)?;
        if !self.binary.is_empty() {
            file.write_all(&(self.binary.len() as u32).to_le_bytes())?;
            file.write_all(&BIN.to_le_bytes())?;
            file.write_all(&self.binary)?;
        }
        Ok(())
    }
}

/// The buffer and what describes it.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    fn view(&mut self, bytes: &[u8], target: Option<u64>) -> usize {
        let mut view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.bytes.extend_from_slice(bytes);
        // Everything begins at a multiple of 4.
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Floats, `N` a vertex.
    fn floats<const N: usize>(&mut self, vectors: impl Iterator<Item = [f32; N]>, bounds: bool) -> usize {
        let (mut bytes, mut count) = (Vec::new(), 0usize);
        let (mut least, mut greatest) = ([f32::INFINITY; N], [f32::NEG_INFINITY; N]);
        for vector in vectors {
            for (i, v) in vector.into_iter().enumerate() {
                bytes.extend(v.to_le_bytes());
                least[i] = least[i].min(v);
                greatest[i] = greatest[i].max(v);
            }
            count += 1;
        }
        let view = self.view(&bytes, Some(ARRAY));
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        let mut accessor = json!({"bufferView": view, "componentType": FLOAT, "count": count, "type": kind});
        if bounds {
            accessor["min"] = least.map(f64::from).to_vec().into();
            accessor["max"] = greatest.map(f64::from).to_vec().into();
        }
        self.accessor(accessor)
    }

    fn colours(&mut self, colours: &[[u8; 3]]) -> usize {
        let linear: [u16; 256] = std::array::from_fn(|i| (to_linear(i as f64 / 255.0) * 65_535.0).round() as u16);
        let mut bytes = Vec::with_capacity(8 * colours.len());
        for colour in colours {
            let [r, g, b] = colour.map(|c| linear[usize::from(c)]);
            [r, g, b, u16::MAX].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        }
        let view = self.view(&bytes, Some(ARRAY));
        self.accessor(json!({
            "bufferView": view, "componentType": UNSIGNED_SHORT, "normalized": true, "count": colours.len(), "type": "VEC4"
        }))
    }

    fn triangles(&mut self, mesh: &Mesh, triangles: &[u32]) -> usize {
        let indices = triangles.iter().flat_map(|t| mesh.triangles[*t as usize]);
        let bytes: Vec<u8> = indices.flat_map(u32::to_le_bytes).collect();
        let view = self.view(&bytes, Some(INDICES));
        self.accessor(json!({
            "bufferView": view, "componentType": UNSIGNED_INT, "count": 3 * triangles.len(), "type": "SCALAR"
        }))
    }
}

fn parts(mesh: &Mesh) -> Result<Parts> {
    mesh.validate()?;
    let too_large = || Error::Unsupported { what: "more than 4 GiB in a glTF file, which has 32-bit sizes".into() };
    let cloud = &mesh.vertices;
    let per_vertex = 12 + 12 + 8 + 4 + 24 + 8 * mesh.textures.len();
    if (cloud.len() * per_vertex).saturating_add(mesh.triangles.len() * 12) > u32::MAX as usize {
        return Err(too_large());
    }
    let mut buffer = Buffer::default();
    let centre = centre(cloud);
    let mut node = json!({
        "name": "world",
        "rotation": [1.0, 0.0, 0.0, 0.0],
        "extras": {"frame": "before this node's turn: x right, y down, z forward, metres"},
    });
    if centre != Vector3::zeros() {
        node["translation"] = json!([centre.x, -centre.y, -centre.z]);
    }
    let mut file = json!({
        "asset": {"version": "2.0", "generator": concat!("ptzcal ", env!("CARGO_PKG_VERSION"))},
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
    });
    if !cloud.is_empty() {
        node["mesh"] = 0.into();
        let primitives = primitives(mesh, &centre, &mut buffer, &mut file)?;
        file["meshes"] = json!([{"primitives": primitives}]);
        file["accessors"] = std::mem::take(&mut buffer.accessors).into();
        file["bufferViews"] = std::mem::take(&mut buffer.views).into();
        file["buffers"] = json!([{"byteLength": buffer.bytes.len()}]);
    }
    file["nodes"] = json!([node]);
    let mut json = serde_json::to_vec(&file).map_err(|e| Error::Internal { reason: e.to_string() })?;
    json.resize(json.len().next_multiple_of(4), b' ');
    let parts = Parts { json, binary: buffer.bytes };
    if parts.length() > u32::MAX as usize { Err(too_large()) } else { Ok(parts) }
}

/// Whole metres in the middle of a cloud far from the origin; 0 for one near it.
fn centre(cloud: &PointCloud) -> Vector3<f64> {
    let Some(first) = cloud.positions.first().filter(|_| cloud.reach() > FLOAT_RANGE) else { return Vector3::zeros() };
    let (low, high) = cloud.positions.iter().fold((*first, *first), |(l, h), p| (l.inf(p), h.sup(p)));
    ((low + high) * 0.5).map(f64::round)
}

fn primitives(mesh: &Mesh, centre: &Vector3<f64>, buffer: &mut Buffer, file: &mut Value) -> Result<Vec<Value>> {
    let cloud = &mesh.vertices;
    let float = |v: &Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32];
    let mut shared = Map::new();
    let positions = buffer.floats(cloud.positions.iter().map(|p| float(&(p - centre))), true);
    shared.insert("POSITION".into(), positions.into());
    if let Some(normals) = cloud.normals.as_ref().filter(|n| n.iter().all(|n| (n.norm() - 1.0).abs() < 1e-3)) {
        // glTF takes unit vectors only.
        shared.insert("NORMAL".into(), buffer.floats(normals.iter().map(float), false).into());
    } else if let Some(normals) = &cloud.normals {
        shared.insert("_NORMAL".into(), buffer.floats(normals.iter().map(float), false).into());
    }
    if let CloudNoise::Deviations(d) = &cloud.noise {
        shared.insert(DEVIATION.into(), buffer.floats(d.iter().map(|d| [*d as f32]), false).into());
    }
    if let CloudNoise::Covariances(c) = &cloud.noise {
        let [diagonal, rest] =
            [[0, 3, 5], [1, 2, 4]].map(|i| buffer.floats(c.iter().map(|c| i.map(|i| c[i] as f32)), false));
        shared.insert(DIAGONAL.into(), diagonal.into());
        shared.insert(OFF_DIAGONAL.into(), rest.into());
    }
    let colours = buffer.colours(&cloud.colours);
    let unlit = |pbr: Value| {
        let mut pbr = pbr;
        pbr["metallicFactor"] = 0.into();
        json!({"pbrMetallicRoughness": pbr, "doubleSided": true, "extensions": {"KHR_materials_unlit": {}}})
    };
    let mut materials = vec![unlit(json!({}))];
    let (mut images, mut textures, mut primitives) = (Vec::new(), Vec::new(), Vec::new());
    let with = |name: &str, accessor: usize| {
        let mut attributes = shared.clone();
        attributes.insert(name.into(), accessor.into());
        attributes
    };
    if mesh.triangles.is_empty() {
        primitives.push(json!({"mode": POINTS, "material": 0, "attributes": with("COLOR_0", colours)}));
    }
    let plain = mesh.untextured();
    if !plain.is_empty() {
        let indices = buffer.triangles(mesh, &plain);
        primitives.push(json!({
            "mode": TRIANGLES, "material": 0, "indices": indices, "attributes": with("COLOR_0", colours)
        }));
    }
    for texture in mesh.textures.iter().filter(|t| !t.triangles.is_empty()) {
        let view = buffer.view(&encode_png(&texture.image.view()?)?, None);
        images.push(json!({"bufferView": view, "mimeType": "image/png"}));
        textures.push(json!({"source": images.len() - 1, "sampler": 0}));
        materials.push(unlit(json!({"baseColorTexture": {"index": textures.len() - 1}})));
        let [w, h] = [texture.image.width as f32, texture.image.height as f32];
        // glTF's (0, 0) is the upper left CORNER of the picture.
        let places = buffer.floats(texture.places.iter().map(|[x, y]| [(x + 0.5) / w, (y + 0.5) / h]), false);
        let mut attributes = with("TEXCOORD_0", places);
        attributes.insert(HIDDEN_COLOUR.into(), colours.into());
        let indices = buffer.triangles(mesh, &texture.triangles);
        primitives.push(json!({
            "mode": TRIANGLES, "material": materials.len() - 1, "indices": indices, "attributes": attributes
        }));
    }
    file["materials"] = materials.into();
    if !images.is_empty() {
        file["images"] = images.into();
        file["textures"] = textures.into();
        // Linear, clamped to the edge.
        file["samplers"] = json!([{"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071}]);
    }
    Ok(primitives)
}
