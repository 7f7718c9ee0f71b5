//! Coloured point clouds as binary little-endian PLY.

use std::path::Path;

use nalgebra::Vector3;

use super::file::{format_error, read_bounded, write_atomically};
use crate::error::{Error, Result};

/// Name of the property that holds a point's standard deviation.
const DEVIATION: &str = "standard_deviation";
/// Some fifty million points.
const MAX_BYTES: u64 = 1 << 30;
const MAX_HEADER: usize = 64 << 10;

/// Points with colours and, where they are known, standard deviations.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PointCloud {
    /// Metres.
    pub positions: Vec<Vector3<f64>>,
    /// Red, green, blue; one for each point.
    pub colours: Vec<[u8; 3]>,
    /// Metres; one for each point.
    pub deviations: Option<Vec<f64>>,
}

impl PointCloud {
    fn validate(&self) -> Result<()> {
        let count = self.positions.len();
        if self.colours.len() != count || self.deviations.as_ref().is_some_and(|d| d.len() != count) {
            return Err(Error::invalid("cloud", "colours and deviations must be as many as positions"));
        }
        if let Some(index) = self.positions.iter().position(|p| p.iter().any(|v| !v.is_finite())) {
            return Err(Error::NotFinite { name: "positions", index });
        }
        let deviations = self.deviations.as_deref().unwrap_or_default();
        if let Some(index) = deviations.iter().position(|v| !(*v as f32).is_finite()) {
            return Err(Error::NotFinite { name: "deviations", index });
        }
        Ok(())
    }
}

/// Beyond this a float's steps are more than 0.1 mm.
const FLOAT_RANGE: f64 = 1024.0;

/// Writes a cloud. Coordinates are floats, which every viewer reads, or doubles where a float is
/// too coarse (further than a kilometre from the origin). Deviations are floats.
pub fn write_ply(path: &Path, cloud: &PointCloud) -> Result<()> {
    write_atomically(path, &to_ply(cloud)?)
}

/// The file's bytes.
pub fn to_ply(cloud: &PointCloud) -> Result<Vec<u8>> {
    cloud.validate()?;
    let double = cloud.positions.iter().any(|p| p.amax() > FLOAT_RANGE);
    let real = if double { "double" } else { "float" };
    let mut header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", cloud.positions.len());
    for axis in ["x", "y", "z"] {
        header += &format!("property {real} {axis}\n");
    }
    header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    if cloud.deviations.is_some() {
        header += &format!("property float {DEVIATION}\n");
    }
    header += "end_header\n";
    let mut bytes = header.into_bytes();
    bytes.reserve(cloud.positions.len() * 31);
    for (i, (position, colour)) in cloud.positions.iter().zip(&cloud.colours).enumerate() {
        for v in position.iter() {
            if double { bytes.extend(v.to_le_bytes()) } else { bytes.extend((*v as f32).to_le_bytes()) }
        }
        bytes.extend(colour);
        if let Some(deviations) = &cloud.deviations {
            bytes.extend((deviations[i] as f32).to_le_bytes());
        }
    }
    Ok(bytes)
}

/// Reads the points of a binary little-endian PLY file, ours or another's: x, y, z and, when they
/// are there, red, green, blue (else white) and standard_deviation. Other properties and what
/// follows the vertices (faces) are passed over.
///
/// Errors: `FileIo`; `Unsupported` for ASCII and big-endian files and for lists in vertices;
/// `FileFormat` for what is cut short, too long, or not finite.
pub fn read_ply(path: &Path) -> Result<PointCloud> {
    from_ply(&read_bounded(path, MAX_BYTES)?, &path.display().to_string())
}

/// Reads a file's bytes; `name` is what errors call it.
pub fn from_ply(bytes: &[u8], name: &str) -> Result<PointCloud> {
    let header = Header::parse(bytes, name)?;
    let body = &bytes[header.length..];
    let stride: usize = header.properties.iter().map(|(_, t)| t.size()).sum();
    let needed = header.count.saturating_mul(stride);
    if body.len() < needed || (body.len() > needed && header.vertices_last) {
        return Err(format_error(name, format!("{} bytes of points, the header promises {needed}", body.len())));
    }
    let offset = |property: &str| {
        let index = header.properties.iter().position(|(n, _)| n == property)?;
        let start = header.properties[..index].iter().map(|(_, t)| t.size()).sum::<usize>();
        Some((start, header.properties[index].1))
    };
    let required = |property: &str| {
        offset(property).ok_or_else(|| format_error(name, format!("vertices have no property {property}")))
    };
    let axes = [required("x")?, required("y")?, required("z")?];
    let colours = offset("red").zip(offset("green")).zip(offset("blue")).map(|((r, g), b)| [r, g, b]);
    if let Some((_, t)) = colours.iter().flatten().find(|(_, t)| *t != Scalar::U8) {
        return Err(Error::Unsupported { what: format!("{name}: colours of type {t:?}") });
    }
    let deviation = offset(DEVIATION);
    let mut cloud = PointCloud { deviations: deviation.map(|_| Vec::new()), ..Default::default() };
    for record in body[..needed].chunks_exact(stride) {
        let at = |(start, scalar): (usize, Scalar)| scalar.read(&record[start..]);
        cloud.positions.push(Vector3::from(axes.map(at)));
        cloud.colours.push(colours.map_or([255; 3], |c| c.map(|(start, _)| record[start])));
        if let (Some(list), Some(property)) = (&mut cloud.deviations, deviation) {
            list.push(at(property));
        }
    }
    cloud.validate().map_err(|e| format_error(name, e.to_string()))?;
    Ok(cloud)
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The number at the start of `bytes`, which hold it whole.
    fn read(self, bytes: &[u8]) -> f64 {
        fn first<const N: usize>(bytes: &[u8]) -> [u8; N] {
            std::array::from_fn(|i| bytes[i])
        }
        match self {
            Self::I8 => i8::from_le_bytes(first(bytes)).into(),
            Self::U8 => bytes[0].into(),
            Self::I16 => i16::from_le_bytes(first(bytes)).into(),
            Self::U16 => u16::from_le_bytes(first(bytes)).into(),
            Self::I32 => i32::from_le_bytes(first(bytes)).into(),
            Self::U32 => u32::from_le_bytes(first(bytes)).into(),
            Self::F32 => f32::from_le_bytes(first(bytes)).into(),
            Self::F64 => f64::from_le_bytes(first(bytes)),
        }
    }
}

struct Header {
    /// Bytes up to the first vertex.
    length: usize,
    count: usize,
    properties: Vec<(String, Scalar)>,
    vertices_last: bool,
}

impl Header {
    fn parse(bytes: &[u8], name: &str) -> Result<Self> {
        let start = &bytes[..bytes.len().min(MAX_HEADER)];
        let (mut lines, mut position) = (Vec::new(), 0);
        loop {
            let end = start[position..].iter().position(|b| *b == b'\n');
            let end = end.ok_or_else(|| format_error(name, "the header does not end"))?;
            let line = std::str::from_utf8(&start[position..position + end])
                .map_err(|_| format_error(name, format!("line {} is not text", lines.len() + 1)))?;
            position += end + 1;
            lines.push(line.trim_end_matches('\r'));
            if lines[0] != "ply" {
                return Err(format_error(name, "not a PLY file"));
            }
            if lines.last() == Some(&"end_header") {
                break;
            }
        }
        let bad = |number: usize| format_error(name, format!("line {}: '{}'", number + 1, lines[number]));
        let mut header = Self { length: position, count: 0, properties: Vec::new(), vertices_last: true };
        let (mut seen, mut in_vertex, mut binary) = (false, false, false);
        for (number, line) in lines.iter().enumerate().skip(1) {
            match line.split_ascii_whitespace().collect::<Vec<_>>().as_slice() {
                ["format", "binary_little_endian", "1.0"] => binary = true,
                ["format", other, ..] => {
                    return Err(Error::Unsupported { what: format!("{name}: PLY format {other}") });
                }
                ["comment" | "obj_info", ..] | ["end_header"] | [] => {}
                ["element", "vertex", count] if !seen => {
                    header.count = count.parse().map_err(|_| bad(number))?;
                    (seen, in_vertex) = (true, true);
                }
                ["element", _, count] => {
                    let count: u64 = count.parse().map_err(|_| bad(number))?;
                    if !seen && count > 0 {
                        return Err(Error::Unsupported { what: format!("{name}: elements before the vertices") });
                    }
                    header.vertices_last &= !seen || count == 0;
                    in_vertex = false;
                }
                ["property", "list", ..] if in_vertex => {
                    return Err(Error::Unsupported { what: format!("{name}: lists in vertices") });
                }
                ["property", scalar, property] if in_vertex => {
                    let scalar = Scalar::parse(scalar).ok_or_else(|| bad(number))?;
                    header.properties.push(((*property).into(), scalar));
                }
                ["property", ..] if !in_vertex => {}
                _ => return Err(bad(number)),
            }
        }
        if !(binary && seen) {
            return Err(format_error(name, "the header names no format or no vertices"));
        }
        Ok(header)
    }
}
