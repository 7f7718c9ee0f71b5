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
mod tests {
    use super::super::model_tests::{cloud, mesh};
    use super::*;
    use crate::error::Status;
    use crate::fuzz::{Random, fuzz_inputs, mutated};
    use nalgebra::Vector3;

    fn mesh_bytes() -> Vec<u8> {
        let (mesh, mut bytes) = (mesh(), Vec::new());
        write_to(&mut bytes, &mesh.vertices, Some(&mesh.triangles)).unwrap();
        bytes
    }

    #[test]
    fn normals_covariances_and_faces_come_back() {
        assert_eq!(from_ply(&to_ply(&cloud()).unwrap(), "cloud").unwrap(), CloudFile { cloud: cloud(), skipped: 0 });
        let found = mesh_from_ply(&mesh_bytes(), "mesh").unwrap();
        assert_eq!(found, Mesh { textures: vec![], ..mesh() });
        // The faces of a mesh are passed over for its points.
        assert_eq!(from_ply(&mesh_bytes(), "mesh").unwrap().cloud, cloud());
    }

    const TEXT: &str = "ply\nformat ascii 1.0\ncomment by hand\nelement camera 1\nproperty float f\n\
        property list uchar int names\nelement vertex 4\nproperty list uchar float quality\nproperty float y\n\
        property double x\nproperty float z\nproperty float red\nproperty float green\nproperty float blue\n\
        element face 2\nproperty uchar flags\nproperty list uchar uint vertex_index\nend_header\n\
        500.5 2 1 -2\n2 0.1 0.2 -0.5 1e-1 3 1 0.5 0\n0 0 0 0 0 0 0\n1 9 1 2 3 0 0 1\n0 4 5 6 1 1 1\n\
        0 4 0 1 2 3\n7 3 3 2 1";

    #[test]
    fn text_with_lists_is_read() {
        let mesh = mesh_from_ply(TEXT.as_bytes(), "text").unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [3, 2, 1]]);
        assert_eq!(mesh.vertices.positions[0], Vector3::new(0.1, -0.5, 3.0));
        assert_eq!(mesh.vertices.colours, [[255, 128, 0], [0; 3], [0, 0, 255], [255; 3]]);
        let refused = |from: &str, to: &str| {
            assert!(TEXT.contains(from), "{from}");
            mesh_from_ply(TEXT.replacen(from, to, 1).as_bytes(), "text").unwrap_err().status()
        };
        for (from, to) in [
            ("7 3 3 2 1", "7 3 3 2"),
            ("7 3 3 2 1", "7 3 3 2 1 1"),
            ("7 3 3 2 1", "7 3 3 2 4"),
            ("7 3 3 2 1", "7 3 3 2 0.5"),
            ("7 3 3 2 1", "7 -3 3 2 1"),
            ("1e-1", "1e-1x"),
            ("1e-1", "nan"),
            ("vertex 4", "vertex 5"),
            ("vertex 4", "vertex 100000000"),
            ("vertex 4", "vertex 49999999"),
            ("face 2", "face 18446744073709551615"),
            ("property uchar flags", "property list uchar flags"),
            ("comment by hand", "property float x"),
            ("500.5", &"5".repeat(2000)),
        ] {
            assert_eq!(refused(from, to), Status::FileFormat, "{from} -> {to}");
        }
        assert_eq!(refused("ascii 1.0", "ascii 2.0"), Status::Unsupported);
        // Points that are marked as not measured are no reason to lose the others.
        let nan = from_ply(TEXT.replacen("1e-1", "nan", 1).as_bytes(), "text").unwrap();
        assert_eq!((nan.cloud.len(), nan.skipped), (3, 1));
    }

    #[test]
    fn big_endian_is_read() {
        let own = to_ply(&PointCloud { normals: None, noise: CloudNoise::Unknown, ..cloud() }).unwrap();
        let start = own.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        let mut other = String::from_utf8(own[..start].to_vec()).unwrap().replace("little", "big").into_bytes();
        for record in own[start..].chunks(15) {
            record[..12].chunks(4).for_each(|v| other.extend(v.iter().rev()));
            other.extend(&record[12..]);
        }
        assert_eq!(from_ply(&other, "big").unwrap().cloud.positions, cloud().positions);
    }

    /// A header of a few bytes is found out before memory is taken for what it promises.
    #[test]
    fn a_hundred_million_points_are_refused() {
        let lie = |count: u64| {
            format!(
                "ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
            )
        };
        for count in [100_000_000, u64::MAX / 12, u64::MAX] {
            assert_eq!(from_ply(lie(count).as_bytes(), "lie").unwrap_err().status(), Status::FileFormat);
        }
        // One that does have them, of nothing but zeros.
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("huge.ply");
        std::fs::write(&path, lie(100_000_000)).unwrap();
        let length = lie(100_000_000).len() as u64 + 1_200_000_000;
        std::fs::File::options().write(true).open(&path).unwrap().set_len(length).unwrap();
        let e = read_ply(&path).unwrap_err();
        assert!(e.status() == Status::Unsupported && e.to_string().contains("50000000"), "{e}");
        assert_eq!(read_ply(folder.path()).unwrap_err().status(), Status::FileIo);
    }

    #[test]
    fn fuzz_ply() {
        let mut random = Random(1);
        let good = [to_ply(&cloud()).unwrap(), mesh_bytes(), TEXT.as_bytes().to_vec()];
        for i in 0..fuzz_inputs() {
            let bad = mutated(&good[i as usize % 3], &mut random);
            if let Ok(mesh) = mesh_from_ply(&bad, "mesh") {
                mesh.validate().unwrap();
            }
            if let Ok(file) = from_ply(&bad, "cloud") {
                file.cloud.validate().unwrap();
            }
        }
    }

    #[test]
    #[ignore = "a measurement; run it in release"]
    fn measure_a_million() {
        let folder = tempfile::tempdir().unwrap();
        let n = 1_000_000;
        let at = |i: usize| Vector3::new(i as f64 * 1e-3, (i % 1000) as f64 * 1e-2, 3.0);
        let cloud =
            PointCloud { positions: (0..n).map(at).collect(), colours: vec![[1, 2, 3]; n], ..Default::default() };
        let covariances = CloudNoise::Covariances(vec![[1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-4]; n]);
        for cloud in [&cloud, &PointCloud { noise: covariances, ..cloud.clone() }] {
            for ending in ["ply", "pcd", "glb", "wrl"] {
                let path = folder.path().join(format!("cloud.{ending}"));
                let begun = std::time::Instant::now();
                super::super::write_cloud(&path, cloud).unwrap();
                let written = begun.elapsed().as_secs_f64();
                let found = super::super::read_cloud(&path).unwrap();
                assert_eq!(found.cloud.len(), n);
                println!(
                    "{ending}: write {:.0} ms, read {:.0} ms, {} MB",
                    written * 1e3,
                    (begun.elapsed().as_secs_f64() - written) * 1e3,
                    std::fs::metadata(&path).unwrap().len() / 1_000_000
                );
            }
        }
    }
}
