//! Clouds and meshes as PLY: written binary, little-endian; read in every form that PLY has.
//!
//! Properties of a vertex, as they are written: x, y, z; nx, ny, nz where there are normals; red,
//! green, blue; standard_deviation where noise is known, and covariance_xx to covariance_zz where
//! covariances are. A mesh has faces besides, without its textures: PLY has no place for a picture.
//!
//! Format: G. Turk, "The PLY polygon file format", 1994.

use std::io::{self, Write};
use std::path::Path;

use super::file::{Source, write_streamed};
use super::point_fields::{COVARIANCE, CloudFile, DEVIATION, FLOAT_RANGE, PointFields, finish};
use super::scalar::{Encoding, Scalar};
use crate::error::{Error, Result};
use crate::geometry::point_cloud::MAX_POINTS;
use crate::geometry::{CloudNoise, Mesh, PointCloud};

const MAX_HEADER: usize = 64 << 10;
/// Bytes of records that are read or written at a time.
const CHUNK: usize = 1 << 16;

/// Writes a cloud. Coordinates are floats, which every viewer reads, or doubles where a float is
/// too coarse (further than a kilometre from the origin). Noise and normals are floats.
pub fn write_ply(path: &Path, cloud: &PointCloud) -> Result<()> {
    cloud.validate()?;
    write_streamed(path, &mut |file| write_to(file, cloud, None))
}

/// Writes a mesh, as [`write_ply`] its vertices; its textures are left out.
pub fn write_ply_mesh(path: &Path, mesh: &Mesh) -> Result<()> {
    mesh.validate()?;
    write_streamed(path, &mut |file| write_to(file, &mesh.vertices, Some(&mesh.triangles)))
}

/// A cloud's file as bytes.
pub fn to_ply(cloud: &PointCloud) -> Result<Vec<u8>> {
    cloud.validate()?;
    let mut bytes = Vec::new();
    write_to(&mut bytes, cloud, None).map_err(|e| Error::Internal { reason: e.to_string() })?;
    Ok(bytes)
}

fn write_to(file: &mut dyn Write, cloud: &PointCloud, triangles: Option<&[[u32; 3]]>) -> io::Result<()> {
    let double = cloud.reach() > FLOAT_RANGE;
    let real = if double { "double" } else { "float" };
    let mut header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", cloud.len());
    let mut stride = 0;
    let mut properties = |scalar: &str, size: usize, names: &[&str]| {
        names.iter().for_each(|name| header += &format!("property {scalar} {name}\n"));
        stride += size * names.len();
    };
    properties(real, if double { 8 } else { 4 }, &["x", "y", "z"]);
    if cloud.normals.is_some() {
        properties("float", 4, &["nx", "ny", "nz"]);
    }
    properties("uchar", 1, &["red", "green", "blue"]);
    match cloud.noise {
        CloudNoise::Unknown => {}
        CloudNoise::Deviations(_) => properties("float", 4, &[DEVIATION]),
        CloudNoise::Covariances(_) => {
            properties("float", 4, &[DEVIATION]);
            properties("float", 4, &COVARIANCE);
        }
    }
    if let Some(triangles) = triangles {
        header += &format!("element face {}\nproperty list uchar int vertex_indices\n", triangles.len());
    }
    header += "end_header\n";
    file.write_all(header.as_bytes())?;
    let mut bytes = vec![0; CHUNK / stride * stride];
    for first in (0..cloud.len()).step_by(CHUNK / stride) {
        let records = &mut bytes[..(cloud.len() - first).min(CHUNK / stride) * stride];
        fill(records, stride, cloud, first, double);
        file.write_all(records)?;
    }
    let mut bytes = Vec::new();
    for triangles in triangles.unwrap_or_default().chunks(CHUNK / 16) {
        bytes.clear();
        for triangle in triangles {
            bytes.push(3);
            triangle.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        }
        file.write_all(&bytes)?;
    }
    Ok(())
}

/// Fills records of vertices, from number `first` on. A column at a time: of a chunk, all stay in the processor's
/// cache.
fn fill(records: &mut [u8], stride: usize, cloud: &PointCloud, first: usize, double: bool) {
    let mut columns = Columns { records, stride, place: 0 };
    let positions = cloud.positions[first..].iter();
    if double {
        columns.put(positions.map(|p| little_endian::<8, 24>(p.as_slice(), f64::to_le_bytes)));
    } else {
        columns.put(positions.map(|p| floats::<12>(p.as_slice())));
    }
    if let Some(normals) = &cloud.normals {
        columns.put(normals[first..].iter().map(|n| floats::<12>(n.as_slice())));
    }
    columns.put(cloud.colours[first..].iter().copied());
    match &cloud.noise {
        CloudNoise::Unknown => {}
        CloudNoise::Deviations(d) => columns.put(d[first..].iter().map(|d| floats::<4>(&[*d]))),
        CloudNoise::Covariances(c) => {
            let deviation = |i: usize| cloud.noise.deviation(i).unwrap_or_default();
            columns.put((first..cloud.len()).map(|i| floats::<4>(&[deviation(i)])));
            columns.put(c[first..].iter().map(|c| floats::<24>(c)));
        }
    }
}

struct Columns<'a> {
    records: &'a mut [u8],
    stride: usize,
    /// Where in a record the next column is.
    place: usize,
}

impl Columns<'_> {
    /// As many of the values as there are records.
    fn put<const N: usize>(&mut self, values: impl Iterator<Item = [u8; N]>) {
        for (record, value) in self.records.chunks_exact_mut(self.stride).zip(values) {
            record[self.place..self.place + N].copy_from_slice(&value);
        }
        self.place += N;
    }
}

fn little_endian<const SIZE: usize, const BYTES: usize>(values: &[f64], of: fn(f64) -> [u8; SIZE]) -> [u8; BYTES] {
    let mut bytes = [0; BYTES];
    for (place, value) in bytes.chunks_exact_mut(SIZE).zip(values) {
        place.copy_from_slice(&of(*value));
    }
    bytes
}

fn floats<const BYTES: usize>(values: &[f64]) -> [u8; BYTES] {
    little_endian(values, |v| (v as f32).to_le_bytes())
}

/// Reads the points of a PLY file, ours or another's: x, y, z and, when they are there, colours (else
/// white), normals and noise. Other properties, and other elements, are passed over. Points with a
/// coordinate that is NaN or infinite are left out and counted.
///
/// # Errors
/// `FileIo`; `Unsupported` for more than [`MAX_POINTS`] points and colours of unusual types;
/// `FileFormat` for what is cut short, too long, or no PLY.
pub fn read_ply(path: &Path) -> Result<CloudFile> {
    parse(Source::open(path)?, false).map(|(file, _)| file)
}

/// Reads a file's bytes; `name` is what errors call it.
pub fn from_ply(bytes: &[u8], name: &str) -> Result<CloudFile> {
    parse(Source::of(bytes, name), false).map(|(file, _)| file)
}

/// Reads the vertices and faces of a PLY file; faces of more than three corners become fans.
///
/// # Errors
/// As [`read_ply`]; `FileFormat` also for vertices that are not finite and for faces of what does not
/// exist.
pub fn read_ply_mesh(path: &Path) -> Result<Mesh> {
    mesh_of(Source::open(path)?)
}

/// Reads a file's bytes.
pub fn mesh_from_ply(bytes: &[u8], name: &str) -> Result<Mesh> {
    mesh_of(Source::of(bytes, name))
}

fn mesh_of(source: Source<'_>) -> Result<Mesh> {
    let name = source.name.clone();
    let (file, triangles) = parse(source, true)?;
    let wrong = |reason: String| Error::FileFormat { path: name.clone(), reason };
    if file.skipped > 0 {
        return Err(wrong(format!("{} vertices are not finite", file.skipped)));
    }
    let mesh = Mesh { vertices: file.cloud, triangles, textures: Vec::new() };
    mesh.validate().map_err(|e| wrong(e.to_string()))?;
    Ok(mesh)
}

#[derive(Debug, Clone, PartialEq)]
struct Property {
    name: String,
    /// Of the number of items, for a list.
    list: Option<Scalar>,
    scalar: Scalar,
}

struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

fn scalar(name: &str) -> Option<Scalar> {
    Some(match name {
        "char" | "int8" => Scalar::I8,
        "uchar" | "uint8" => Scalar::U8,
        "short" | "int16" => Scalar::I16,
        "ushort" | "uint16" => Scalar::U16,
        "int" | "int32" => Scalar::I32,
        "uint" | "uint32" => Scalar::U32,
        "float" | "float32" => Scalar::F32,
        "double" | "float64" => Scalar::F64,
        _ => return None,
    })
}

fn header(source: &mut Source<'_>) -> Result<(Encoding, Vec<Element>)> {
    let (mut encoding, mut elements, mut budget, mut number) = (None, Vec::<Element>::new(), MAX_HEADER, 0);
    loop {
        let line = source.line(budget)?.ok_or_else(|| source.wrong("the header does not end"))?;
        budget = budget.saturating_sub(line.len() + 1);
        number += 1;
        let bad = || source.wrong(format!("line {number}: '{}'", line.escape_debug()));
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words.as_slice() {
            _ if number == 1 => {
                if line != "ply" {
                    return Err(source.wrong("not a PLY file"));
                }
            }
            ["format", "ascii", "1.0"] => encoding = Some(Encoding::Text),
            ["format", "binary_little_endian", "1.0"] => encoding = Some(Encoding::LittleEndian),
            ["format", "binary_big_endian", "1.0"] => encoding = Some(Encoding::BigEndian),
            ["format", other @ ..] => {
                return Err(Error::Unsupported { what: format!("{}: PLY format {}", source.name, other.join(" ")) });
            }
            ["comment" | "obj_info", ..] | [] => {}
            ["end_header"] => break,
            ["element", name, count] => {
                let count = count.parse().map_err(|_| bad())?;
                elements.push(Element { name: (*name).into(), count, properties: Vec::new() });
            }
            ["property", rest @ ..] => {
                let (list, kind, name) = match rest {
                    ["list", count, item, name] => (Some(scalar(count).ok_or_else(bad)?), item, name),
                    [kind, name] => (None, kind, name),
                    _ => return Err(bad()),
                };
                let property = Property { name: (*name).into(), list, scalar: scalar(kind).ok_or_else(bad)? };
                elements.last_mut().ok_or_else(bad)?.properties.push(property);
            }
            _ => return Err(bad()),
        }
    }
    let encoding = encoding.ok_or_else(|| source.wrong("the header names no format"))?;
    Ok((encoding, elements))
}

/// The vertices and, if asked for, the triangles of the faces.
fn parse(mut source: Source<'_>, faces: bool) -> Result<(CloudFile, Vec<[u32; 3]>)> {
    let source = &mut source;
    let (encoding, elements) = header(source)?;
    let (mut points, mut triangles) = (None, Vec::new());
    for element in &elements {
        let least = element.properties.iter().map(|p| encoding.least_size(p.list.unwrap_or(p.scalar))).sum::<usize>();
        // The last number of a text may end with the file.
        let sure = if encoding == Encoding::Text { element.count.saturating_sub(1) } else { element.count };
        source.expect(sure, least, &element.name)?;
        if element.properties.is_empty() {
            continue;
        }
        match element.name.as_str() {
            "vertex" if points.is_none() => points = Some(vertices(element, encoding, source)?),
            "face" if faces => triangles.extend(triangles_of(element, encoding, source)?),
            _ => skip(element, encoding, source)?,
        }
    }
    if encoding == Encoding::Text {
        if source.word()?.is_some() {
            return Err(source.wrong("more numbers than the header promises"));
        }
    } else if source.left > 0 {
        return Err(source.wrong(format!("{} bytes more than the header promises", source.left)));
    }
    let points = match points {
        Some(points) => points,
        // Without properties they have no place either.
        None if elements.iter().any(|e| e.name == "vertex" && e.count == 0) => CloudFile::default(),
        None => return Err(source.wrong("the header names no vertices")),
    };
    Ok((finish(points, source)?, triangles))
}

fn vertices(element: &Element, encoding: Encoding, source: &mut Source<'_>) -> Result<CloudFile> {
    let fields: Vec<(String, Scalar)> = element.properties.iter().map(|p| (p.name.clone(), p.scalar)).collect();
    let find = PointFields::find(&fields, source)?;
    let mut points = find.cloud(element.count, source)?;
    let fixed = encoding != Encoding::Text && element.properties.iter().all(|p| p.list.is_none());
    if !fixed {
        let mut record = vec![0.0; element.properties.len()];
        for _ in 0..element.count {
            for (value, property) in record.iter_mut().zip(&element.properties) {
                // A list is no coordinate: it reads as NaN.
                *value = match property.list {
                    None => encoding.next(property.scalar, source)?,
                    Some(_) => {
                        list(property, encoding, source, &mut |_| Ok(()))?;
                        f64::NAN
                    }
                };
            }
            find.push(&mut points, |i| record[i]);
        }
        return Ok(points);
    }
    let mut stride = 0;
    let place = |(_, scalar): &(String, Scalar)| {
        stride += scalar.size();
        (stride - scalar.size(), *scalar)
    };
    let places: Vec<(usize, Scalar)> = fields.iter().map(place).collect();
    let mut chunk = vec![0; (CHUNK / stride).max(1).min(element.count.max(1)) * stride];
    let (mut left, big) = (element.count, encoding == Encoding::BigEndian);
    while left > 0 {
        let now = left.min(chunk.len() / stride);
        let records = &mut chunk[..now * stride];
        source.read(records)?;
        if big || !find.push_common(&mut points, records.chunks_exact(stride), &places) {
            for record in records.chunks_exact(stride) {
                find.push(&mut points, |i| {
                    let (start, scalar) = places[i];
                    scalar.read(&record[start..], big)
                });
            }
        }
        left -= now;
    }
    Ok(points)
}

fn triangles_of(element: &Element, encoding: Encoding, source: &mut Source<'_>) -> Result<Vec<[u32; 3]>> {
    let mut triangles = Vec::new();
    for _ in 0..element.count {
        for property in &element.properties {
            if property.list.is_none() {
                encoding.next(property.scalar, source)?;
                continue;
            }
            let corners = matches!(property.name.as_str(), "vertex_indices" | "vertex_index");
            // Fans around the first corner.
            let (mut first, mut last) = (None, None);
            list(property, encoding, source, &mut |value| {
                if !corners {
                    return Ok(());
                }
                let index = if value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value) {
                    value as u32
                } else {
                    return Err(format!("{value} is no vertex"));
                };
                if let (Some(a), Some(b)) = (first, last) {
                    triangles.push([a, b, index]);
                }
                if first.is_none() {
                    first = Some(index);
                } else {
                    last = Some(index);
                }
                if triangles.len() > MAX_POINTS { Err(format!("more than {MAX_POINTS} triangles")) } else { Ok(()) }
            })?;
        }
    }
    Ok(triangles)
}

fn skip(element: &Element, encoding: Encoding, source: &mut Source<'_>) -> Result<()> {
    for _ in 0..element.count {
        for property in &element.properties {
            match property.list {
                None => {
                    encoding.next(property.scalar, source)?;
                }
                Some(_) => list(property, encoding, source, &mut |_| Ok(()))?,
            }
        }
    }
    Ok(())
}

/// Hands out the items of a list.
fn list(
    property: &Property,
    encoding: Encoding,
    source: &mut Source<'_>,
    item: &mut dyn FnMut(f64) -> std::result::Result<(), String>,
) -> Result<()> {
    let count = encoding.next(property.list.unwrap_or(property.scalar), source)?;
    if !(count >= 0.0 && count.fract() == 0.0) {
        return Err(source.wrong(format!("a list of {count} items")));
    }
    // The last number of a text may end with the file.
    let count = count as usize;
    source.expect(count.saturating_sub(1), encoding.least_size(property.scalar), &property.name)?;
    for _ in 0..count {
        let value = encoding.next(property.scalar, source)?;
        item(value).map_err(|reason| source.wrong(reason))?;
    }
    Ok(())
}

#[cfg(test)]
#[path = "ply_tests.rs"]
mod tests;
