//! Reading binary glTF: meshes of points and triangles, ours and others'.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Matrix3, Matrix4, Vector3};
use serde_json::Value;

use super::super::file::Source;
use super::super::picture::decode_bytes;
use super::super::scalar::Scalar;
use super::{
    BIN, BYTE, DEVIATION, DIAGONAL, FLOAT, HIDDEN_COLOUR, JSON, MAGIC, OFF_DIAGONAL, POINTS, SHORT, TRIANGLES,
    UNSIGNED_BYTE, UNSIGNED_INT, UNSIGNED_SHORT, to_srgb,
};
use crate::error::{Error, Result};
use crate::geometry::mesh::MAX_TEXTURES;
use crate::geometry::point_cloud::{MAX_POINTS, pack, unpack};
use crate::geometry::{CloudNoise, Mesh, Texture};

const MAX_JSON: usize = 64 << 20;
/// Memory that all pictures of a file may take, decoded.
const MAX_PICTURES: usize = 1 << 30;

/// Reads the meshes of a scene as one, in our frame, and its textures. What is not points or triangles
/// (lines, animations, cameras) is passed over.
///
/// # Errors
/// `FileIo`; `FileFormat`; `Unsupported` for files that need other files or an extension, for sparse
/// accessors, and for more than [`MAX_POINTS`] vertices or triangles.
pub fn read_glb(path: &Path) -> Result<Mesh> {
    parse(Source::open(path)?)
}

/// Reads a file's bytes; `name` is what errors call it.
pub fn from_glb(bytes: &[u8], name: &str) -> Result<Mesh> {
    parse(Source::of(bytes, name))
}

fn parse(mut source: Source<'_>) -> Result<Mesh> {
    let word = |source: &mut Source<'_>| {
        let mut bytes = [0; 4];
        source.read(&mut bytes).map(|()| u32::from_le_bytes(bytes))
    };
    let total = source.left;
    if word(&mut source)? != MAGIC {
        return Err(source.wrong("not a binary glTF file"));
    }
    let version = word(&mut source)?;
    if version != 2 {
        return Err(Error::FileVersion { path: source.name, found: version, supported: 2 });
    }
    if u64::from(word(&mut source)?) != total {
        return Err(source.wrong(format!("{total} bytes, the header promises another length")));
    }
    let (mut json, mut binary) = (None, None);
    while source.left > 0 {
        let [length, kind] = [word(&mut source)?, word(&mut source)?];
        source.expect(1, length as usize, "a chunk")?;
        if json.is_none() && (kind != JSON || length as usize > MAX_JSON) {
            return Err(source.wrong("the first chunk is not JSON, or too long"));
        }
        let mut bytes = vec![0; length as usize];
        source.read(&mut bytes)?;
        match kind {
            JSON if json.is_none() => json = Some(bytes),
            BIN if binary.is_none() => binary = Some(bytes),
            // Chunks of unknown kinds shall be ignored.
            _ => {}
        }
    }
    let json = json.ok_or_else(|| source.wrong("no JSON"))?;
    let json: Value = serde_json::from_slice(&json).map_err(|e| source.wrong(format!("JSON: {e}")))?;
    let mut scene = Scene {
        file: File { json: &json, binary: binary.as_deref().unwrap_or_default(), name: &source.name },
        mesh: Mesh::default(),
        bases: BTreeMap::new(),
        textures: BTreeMap::new(),
        pictures: 0,
        normals: Vec::new(),
        noise: Noise::default(),
    };
    scene.read()?;
    scene.finish()
}

struct File<'a> {
    json: &'a Value,
    binary: &'a [u8],
    name: &'a str,
}

/// Numbers in the buffer, checked to be there.
struct Accessor<'a> {
    bytes: &'a [u8],
    count: usize,
    components: usize,
    scalar: Scalar,
    stride: usize,
    /// What integers are divided by.
    divisor: f64,
}

impl Accessor<'_> {
    fn at(&self, index: usize, component: usize) -> f64 {
        let start = index * self.stride + component * self.scalar.size();
        self.scalar.read(&self.bytes[start..], false) / self.divisor
    }

    fn vector<const N: usize>(&self, index: usize) -> [f64; N] {
        std::array::from_fn(|c| self.at(index, c))
    }
}

impl<'a> File<'a> {
    fn wrong(&self, reason: impl Into<String>) -> Error {
        Error::FileFormat { path: self.name.into(), reason: reason.into() }
    }

    fn unsupported(&self, what: &str) -> Error {
        Error::Unsupported { what: format!("{}: {what}", self.name) }
    }

    fn list(&self, name: &str) -> &'a [Value] {
        self.json[name].as_array().map_or(&[], Vec::as_slice)
    }

    /// The thing that `index` names in a list.
    fn item(&self, list: &str, index: &Value) -> Result<(usize, &'a Value)> {
        let found =
            index.as_u64().and_then(|i| usize::try_from(i).ok()).and_then(|i| Some((i, self.list(list).get(i)?)));
        found.ok_or_else(|| self.wrong(format!("there is no {index} in {list}")))
    }

    /// A number that may be left out.
    fn size(&self, value: &Value, default: usize) -> Result<usize> {
        if value.is_null() {
            return Ok(default);
        }
        value.as_u64().and_then(|v| usize::try_from(v).ok()).ok_or_else(|| self.wrong(format!("{value} is no size")))
    }

    fn view(&self, index: &Value) -> Result<(&'a [u8], usize)> {
        let (_, view) = self.item("bufferViews", index)?;
        let (_, buffer) = self.item("buffers", &view["buffer"])?;
        if view["buffer"] != 0 || !buffer["uri"].is_null() {
            return Err(self.unsupported("buffers outside the file"));
        }
        let (start, length) = (self.size(&view["byteOffset"], 0)?, self.size(&view["byteLength"], 0)?);
        let bytes = start.checked_add(length).and_then(|end| self.binary.get(start..end));
        let bytes = bytes.ok_or_else(|| self.wrong("a view reaches beyond the buffer"))?;
        Ok((bytes, self.size(&view["byteStride"], 0)?))
    }

    fn accessor(&self, index: &Value) -> Result<Accessor<'a>> {
        let (number, accessor) = self.item("accessors", index)?;
        if !accessor["sparse"].is_null() || accessor["bufferView"].is_null() {
            return Err(self.unsupported("sparse accessors"));
        }
        let (bytes, stride) = self.view(&accessor["bufferView"])?;
        let (scalar, most) = match accessor["componentType"].as_u64() {
            Some(BYTE) => (Scalar::I8, 127.0),
            Some(UNSIGNED_BYTE) => (Scalar::U8, 255.0),
            Some(SHORT) => (Scalar::I16, 32_767.0),
            Some(UNSIGNED_SHORT) => (Scalar::U16, 65_535.0),
            Some(UNSIGNED_INT) => (Scalar::U32, f64::from(u32::MAX)),
            Some(FLOAT) => (Scalar::F32, 1.0),
            _ => return Err(self.wrong(format!("accessor {number}: componentType {}", accessor["componentType"]))),
        };
        let components = match accessor["type"].as_str() {
            Some("SCALAR") => 1,
            Some("VEC2") => 2,
            Some("VEC3") => 3,
            Some("VEC4") => 4,
            _ => return Err(self.wrong(format!("accessor {number}: type {}", accessor["type"]))),
        };
        let (count, start) = (self.size(&accessor["count"], 0)?, self.size(&accessor["byteOffset"], 0)?);
        let element = components * scalar.size();
        let stride = if stride == 0 { element } else { stride };
        if stride < element {
            return Err(self.wrong(format!("accessor {number}: a stride of {stride}")));
        }
        let needed = stride.checked_mul(count.saturating_sub(1)).and_then(|n| n.checked_add(element));
        let fits = needed.and_then(|n| n.checked_add(start)).is_some_and(|end| end <= bytes.len() || count == 0);
        if !fits {
            return Err(self.wrong(format!("accessor {number}: {count} elements are not in the file")));
        }
        let divisor = if accessor["normalized"] == true { most } else { 1.0 };
        let bytes = if count == 0 { &[] } else { &bytes[start..] };
        Ok(Accessor { bytes, count, components, scalar, stride, divisor })
    }

    /// An attribute of so many components, of as many vertices; `None` where there is none.
    fn attribute(
        &self,
        attributes: &Value,
        name: &str,
        components: &[usize],
        count: usize,
    ) -> Result<Option<Accessor<'a>>> {
        if attributes[name].is_null() {
            return Ok(None);
        }
        let accessor = self.accessor(&attributes[name])?;
        if accessor.count != count || !components.contains(&accessor.components) {
            return Err(self.wrong(format!("{name}: {} x {} numbers", accessor.count, accessor.components)));
        }
        Ok(Some(accessor))
    }

    /// A node's transform into its parent's frame.
    fn transform(&self, node: &Value) -> Result<Matrix4<f64>> {
        let numbers = |name: &str, default: &[f64]| {
            if node[name].is_null() {
                return Ok(default.to_vec());
            }
            let list = node[name].as_array().map(|l| l.iter().filter_map(Value::as_f64).collect::<Vec<_>>());
            list.filter(|l| l.len() == default.len() && l.iter().all(|v| v.is_finite()))
                .ok_or_else(|| self.wrong(format!("a node's {name}: {}", node[name])))
        };
        if !node["matrix"].is_null() {
            return Ok(Matrix4::from_column_slice(&numbers("matrix", &[0.0; 16])?));
        }
        let (t, s) = (numbers("translation", &[0.0; 3])?, numbers("scale", &[1.0; 3])?);
        let q = numbers("rotation", &[0.0, 0.0, 0.0, 1.0])?;
        let norm = q.iter().map(|v| v * v).sum::<f64>();
        if (norm - 1.0).abs() > 1e-2 {
            return Err(self.wrong(format!("a node's rotation: {}", node["rotation"])));
        }
        let (v, w) = (Vector3::new(q[0], q[1], q[2]), q[3]);
        let k = crate::geometry::rigid::skew(&v);
        // Of a unit quaternion, or one that rounding made not quite that.
        let rotation = Matrix3::identity() + (k * w + k * k) * (2.0 / norm);
        let linear = rotation * Matrix3::from_diagonal(&Vector3::from_column_slice(&s));
        Ok(linear.to_homogeneous().append_translation(&Vector3::from_column_slice(&t)))
    }
}

/// Noise of all vertices so far, as long as every primitive has it.
#[derive(Default)]
struct Noise {
    deviations: Vec<f64>,
    covariances: Vec<[f64; 6]>,
}

struct Scene<'a> {
    file: File<'a>,
    mesh: Mesh,
    /// First vertex of each node's position accessor: primitives of one mesh share their vertices.
    bases: BTreeMap<(usize, usize), usize>,
    /// Place in `mesh.textures` of each of the file's.
    textures: BTreeMap<usize, usize>,
    /// Bytes of decoded pictures.
    pictures: usize,
    normals: Vec<Vector3<f64>>,
    noise: Noise,
}

impl<'a> Scene<'a> {
    fn read(&mut self) -> Result<()> {
        let file = &self.file;
        if file.json["asset"]["version"].as_str().is_none_or(|v| !v.starts_with("2.")) {
            return Err(file.wrong("no asset of version 2"));
        }
        if let Some(needed) = file.json["extensionsRequired"].as_array().and_then(|l| l.first()) {
            return Err(file.unsupported(&format!("the extension {needed}")));
        }
        let roots: Vec<Value> = if file.json["scenes"].is_null() {
            (0..file.list("nodes").len()).map(Value::from).collect()
        } else {
            let first = Value::from(0);
            let scene = if file.json["scene"].is_null() { &first } else { &file.json["scene"] };
            file.item("scenes", scene)?.1["nodes"].as_array().cloned().unwrap_or_default()
        };
        // Half a turn about x, from y up to y down.
        let ours = Matrix4::from_diagonal(&nalgebra::Vector4::new(1.0, -1.0, -1.0, 1.0));
        let mut visited = vec![false; file.list("nodes").len()];
        let mut waiting: Vec<(Value, Matrix4<f64>)> = roots.into_iter().rev().map(|root| (root, ours)).collect();
        while let Some((index, parent)) = waiting.pop() {
            let (number, node) = self.file.item("nodes", &index)?;
            if std::mem::replace(&mut visited[number], true) {
                return Err(self.file.wrong(format!("node {number} has two parents")));
            }
            let transform = parent * self.file.transform(node)?;
            if !node["mesh"].is_null() {
                let (_, mesh) = self.file.item("meshes", &node["mesh"])?;
                for primitive in mesh["primitives"].as_array().map_or(&[][..], Vec::as_slice) {
                    self.primitive(number, primitive, &transform)?;
                }
            }
            for child in node["children"].as_array().map_or(&[][..], Vec::as_slice).iter().rev() {
                waiting.push((child.clone(), transform));
            }
        }
        Ok(())
    }

    fn primitive(&mut self, node: usize, primitive: &'a Value, transform: &Matrix4<f64>) -> Result<()> {
        let mode = primitive["mode"].as_u64().unwrap_or(TRIANGLES);
        if mode != POINTS && mode != TRIANGLES {
            return Ok(());
        }
        let attributes = &primitive["attributes"];
        let (accessor, _) = self.file.item("accessors", &attributes["POSITION"])?;
        let positions = self.file.accessor(&attributes["POSITION"])?;
        if positions.components != 3 || positions.scalar != Scalar::F32 {
            return Err(self.file.wrong("positions are not three floats"));
        }
        let base = match self.bases.get(&(node, accessor)) {
            Some(base) => *base,
            None => {
                let base = self.mesh.vertices.len();
                self.vertices(&positions, attributes, transform)?;
                self.bases.insert((node, accessor), base);
                base
            }
        };
        if mode == POINTS {
            return Ok(());
        }
        let indices =
            if primitive["indices"].is_null() { None } else { Some(self.file.accessor(&primitive["indices"])?) };
        if indices
            .as_ref()
            .is_some_and(|i| i.components != 1 || !matches!(i.scalar, Scalar::U8 | Scalar::U16 | Scalar::U32))
        {
            return Err(self.file.wrong("indices are not integers"));
        }
        let corners = indices.as_ref().map_or(positions.count, |i| i.count);
        self.room(self.mesh.triangles.len(), corners / 3, "triangles")?;
        let mirrored = transform.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        let first = self.mesh.triangles.len();
        for triangle in 0..corners / 3 {
            let mut corners = [0; 3];
            for (c, corner) in corners.iter_mut().enumerate() {
                let index = indices.as_ref().map_or((3 * triangle + c) as f64, |i| i.at(3 * triangle + c, 0)) as usize;
                if index >= positions.count {
                    return Err(self
                        .file
                        .wrong(format!("triangle {triangle} has vertex {index} of {}", positions.count)));
                }
                *corner = (base + index) as u32;
            }
            if mirrored {
                corners.swap(1, 2);
            }
            self.mesh.triangles.push(corners);
        }
        self.texture(primitive, base, first, positions.count)
    }

    fn room(&self, have: usize, more: usize, what: &str) -> Result<()> {
        if have.saturating_add(more) > MAX_POINTS {
            return Err(self.file.unsupported(&format!("more than {MAX_POINTS} {what}")));
        }
        Ok(())
    }

    fn vertices(&mut self, positions: &Accessor<'_>, attributes: &Value, transform: &Matrix4<f64>) -> Result<()> {
        let count = positions.count;
        self.room(self.mesh.vertices.len(), count, "vertices")?;
        let linear: Matrix3<f64> = transform.fixed_view::<3, 3>(0, 0).into();
        let offset: Vector3<f64> = transform.fixed_view::<3, 1>(0, 3).into();
        let file = &self.file;
        let colours = match file.attribute(attributes, "COLOR_0", &[3, 4], count)? {
            None => file.attribute(attributes, HIDDEN_COLOUR, &[3, 4], count)?,
            found => found,
        };
        let normals = match file.attribute(attributes, "NORMAL", &[3], count)? {
            None => file.attribute(attributes, "_NORMAL", &[3], count)?,
            found => found,
        };
        let deviations = file.attribute(attributes, DEVIATION, &[1], count)?;
        let diagonal = file.attribute(attributes, DIAGONAL, &[3], count)?;
        let off_diagonal = file.attribute(attributes, OFF_DIAGONAL, &[3], count)?;
        let turn_normal = linear.try_inverse().map_or(linear, |i| i.transpose());
        let cloud = &mut self.mesh.vertices;
        for i in 0..count {
            cloud.positions.push(linear * Vector3::from(positions.vector::<3>(i)) + offset);
            cloud.colours.push(
                colours
                    .as_ref()
                    .map_or([255; 3], |c| c.vector::<3>(i).map(|v| (to_srgb(v.clamp(0.0, 1.0)) * 255.0).round() as u8)),
            );
            if let Some(n) = &normals {
                let n = turn_normal * Vector3::from(n.vector::<3>(i));
                self.normals.push(n.try_normalize(0.0).unwrap_or_default());
            }
            if let Some(d) = &deviations {
                self.noise.deviations.push(d.at(i, 0));
            }
            if let (Some(d), Some(o)) = (&diagonal, &off_diagonal) {
                let ([xx, yy, zz], [xy, xz, yz]) = (d.vector::<3>(i), o.vector::<3>(i));
                let c = linear * unpack(&[xx, xy, xz, yy, yz, zz]) * linear.transpose();
                self.noise.covariances.push(pack(&c));
            }
        }
        Ok(())
    }

    fn texture(&mut self, primitive: &'a Value, base: usize, first: usize, count: usize) -> Result<()> {
        let file = &self.file;
        let places = file.attribute(&primitive["attributes"], "TEXCOORD_0", &[2], count)?;
        let (Some(places), false) = (places, primitive["material"].is_null()) else { return Ok(()) };
        let (_, material) = file.item("materials", &primitive["material"])?;
        let index = &material["pbrMetallicRoughness"]["baseColorTexture"]["index"];
        if index.is_null() || first == self.mesh.triangles.len() {
            return Ok(());
        }
        let (number, texture) = file.item("textures", index)?;
        let place = match self.textures.get(&number) {
            Some(place) => *place,
            None => {
                if self.mesh.textures.len() >= MAX_TEXTURES {
                    return Err(file.unsupported(&format!("more than {MAX_TEXTURES} textures")));
                }
                let (_, image) = file.item("images", &texture["source"])?;
                if image["bufferView"].is_null() {
                    return Err(file.unsupported("pictures outside the file"));
                }
                let left = MAX_PICTURES - self.pictures;
                let image = decode_bytes(file.view(&image["bufferView"])?.0, file.name, left as u64)?;
                self.pictures += image.data.len().min(left);
                self.mesh.textures.push(Texture { image, places: Vec::new(), triangles: Vec::new() });
                self.textures.insert(number, self.mesh.textures.len() - 1);
                self.mesh.textures.len() - 1
            }
        };
        let texture = &mut self.mesh.textures[place];
        texture.places.resize(self.mesh.vertices.len(), [0.0; 2]);
        let [w, h] = [f64::from(texture.image.width), f64::from(texture.image.height)];
        for i in 0..count {
            let [u, v] = places.vector::<2>(i);
            texture.places[base + i] = [(u * w - 0.5) as f32, (v * h - 0.5) as f32];
        }
        texture.triangles.extend(first as u32..self.mesh.triangles.len() as u32);
        Ok(())
    }

    fn finish(self) -> Result<Mesh> {
        let Self { file, mut mesh, normals, noise, .. } = self;
        let count = mesh.vertices.len();
        // What only some primitives have is not known of the cloud.
        mesh.vertices.normals = (normals.len() == count && count > 0).then_some(normals);
        if noise.covariances.len() == count && count > 0 {
            mesh.vertices.noise = CloudNoise::Covariances(noise.covariances);
        } else if noise.deviations.len() == count && count > 0 {
            mesh.vertices.noise = CloudNoise::Deviations(noise.deviations);
        }
        mesh.textures.iter_mut().for_each(|t| t.places.resize(count, [0.0; 2]));
        mesh.validate().map_err(|e| file.wrong(e.to_string()))?;
        Ok(mesh)
    }
}
