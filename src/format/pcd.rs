//! Clouds as PCD, the format of the Point Cloud Library: written and read as text, binary and
//! compressed.
//!
//! Fields, as they are written: x, y, z; normal_x, normal_y, normal_z where there are normals; rgb
//! (packed, 0x00rrggbb); standard_deviation and covariance_xx to covariance_zz as in PLY. The viewpoint
//! says where the sensor stood, and changes no coordinate: it is not read, and written as the origin.
//!
//! Format: <https://pointclouds.org/documentation/tutorials/pcd_file_format.html>, version 0.7.

use std::io::{self, Write};
use std::path::Path;

use super::file::{Source, write_streamed};
use super::lzf;
use super::point_fields::{COVARIANCE, CloudFile, DEVIATION, FLOAT_RANGE, PointFields, finish};
use super::scalar::{Encoding, Scalar};
use crate::error::{Error, Result};
use crate::geometry::{CloudNoise, PointCloud};

const MAX_HEADER: usize = 64 << 10;
/// Bytes of points that are read or written at a time.
const CHUNK: usize = 1 << 16;

/// How the points of a PCD file are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PcdData {
    Text,
    Binary,
    /// LZF, field by field.
    Compressed,
}

impl PcdData {
    fn name(self) -> &'static str {
        match self {
            Self::Text => "ascii",
            Self::Binary => "binary",
            Self::Compressed => "binary_compressed",
        }
    }
}

/// Writes a cloud. Coordinates are floats, or doubles further than a kilometre from the origin.
///
/// # Errors
/// The cloud's own; `FileIo`; `Unsupported` for what is above 4 GiB to compress.
pub fn write_pcd(path: &Path, cloud: &PointCloud, data: PcdData) -> Result<()> {
    cloud.validate()?;
    let writer = Writer::new(cloud);
    let bytes = cloud.len() * writer.stride();
    if data == PcdData::Compressed && bytes > u32::MAX as usize {
        return Err(Error::Unsupported {
            what: format!("{bytes} bytes in a compressed PCD file, which has 32-bit sizes"),
        });
    }
    write_streamed(path, &mut |file| writer.write(file, data))
}

/// A cloud's file as bytes.
pub fn to_pcd(cloud: &PointCloud, data: PcdData) -> Result<Vec<u8>> {
    cloud.validate()?;
    let mut bytes = Vec::new();
    Writer::new(cloud).write(&mut bytes, data).map_err(|e| Error::Internal { reason: e.to_string() })?;
    Ok(bytes)
}

struct Writer<'a> {
    cloud: &'a PointCloud,
    fields: Vec<(&'static str, Scalar)>,
}

impl<'a> Writer<'a> {
    fn new(cloud: &'a PointCloud) -> Self {
        let real = if cloud.reach() > FLOAT_RANGE { Scalar::F64 } else { Scalar::F32 };
        let mut fields = vec![("x", real), ("y", real), ("z", real)];
        if cloud.normals.is_some() {
            fields.extend(["normal_x", "normal_y", "normal_z"].map(|name| (name, Scalar::F32)));
        }
        fields.push(("rgb", Scalar::U32));
        if cloud.noise != CloudNoise::Unknown {
            fields.push((DEVIATION, Scalar::F32));
        }
        if matches!(cloud.noise, CloudNoise::Covariances(_)) {
            fields.extend(COVARIANCE.map(|name| (name, Scalar::F32)));
        }
        Self { cloud, fields }
    }

    fn stride(&self) -> usize {
        self.fields.iter().map(|(_, s)| s.size()).sum()
    }

    /// Numbers of a point, in the order of the fields.
    fn numbers(&self, index: usize, numbers: &mut Vec<f64>) {
        let cloud = self.cloud;
        numbers.clear();
        numbers.extend(&cloud.positions[index]);
        if let Some(normals) = &cloud.normals {
            numbers.extend(&normals[index]);
        }
        let [r, g, b] = cloud.colours[index];
        numbers.push(u32::from_be_bytes([0, r, g, b]).into());
        numbers.extend(cloud.noise.deviation(index));
        if let CloudNoise::Covariances(c) = &cloud.noise {
            numbers.extend(c[index]);
        }
    }

    fn write(&self, file: &mut dyn Write, data: PcdData) -> io::Result<()> {
        let count = self.cloud.len();
        let list = |of: &dyn Fn(&(&str, Scalar)) -> String| self.fields.iter().map(of).collect::<Vec<_>>().join(" ");
        // PCL's own readers expect packed colours to be called a float where they are binary.
        let kind = |name: &str| if name == "rgb" && data == PcdData::Text { "U" } else { "F" };
        write!(
            file,
            "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {}\nSIZE {}\nTYPE {}\nCOUNT {}\n\
             WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA {}\n",
            list(&|f| f.0.into()),
            list(&|f| f.1.size().to_string()),
            list(&|f| kind(f.0).into()),
            list(&|_| "1".into()),
            data.name(),
        )?;
        let mut numbers = Vec::new();
        let mut bytes = Vec::with_capacity(CHUNK + 1024);
        match data {
            PcdData::Text | PcdData::Binary => {
                for i in 0..count {
                    self.numbers(i, &mut numbers);
                    let pairs = numbers.iter().zip(&self.fields);
                    if data == PcdData::Binary {
                        pairs.for_each(|(v, (_, scalar))| put(&mut bytes, *v, *scalar));
                    } else {
                        for (at, (v, (_, scalar))) in pairs.enumerate() {
                            let gap = if at > 0 { " " } else { "" };
                            // The shortest text that reads back to the same number.
                            if *scalar == Scalar::F32 {
                                write!(bytes, "{gap}{}", *v as f32)
                            } else {
                                write!(bytes, "{gap}{v}")
                            }?;
                        }
                        bytes.push(b'\n');
                    }
                    if bytes.len() >= CHUNK {
                        file.write_all(&bytes)?;
                        bytes.clear();
                    }
                }
                file.write_all(&bytes)
            }
            PcdData::Compressed => {
                let mut columns = vec![Vec::new(); self.fields.len()];
                for i in 0..count {
                    self.numbers(i, &mut numbers);
                    for ((v, (_, scalar)), column) in numbers.iter().zip(&self.fields).zip(&mut columns) {
                        put(column, *v, *scalar);
                    }
                }
                let plain = columns.concat();
                drop(columns);
                let packed = lzf::compress(&plain);
                file.write_all(&(packed.len() as u32).to_le_bytes())?;
                file.write_all(&(plain.len() as u32).to_le_bytes())?;
                file.write_all(&packed)
            }
        }
    }
}

fn put(bytes: &mut Vec<u8>, v: f64, scalar: Scalar) {
    match scalar {
        Scalar::U32 => bytes.extend((v as u32).to_le_bytes()),
        Scalar::F32 => bytes.extend((v as f32).to_le_bytes()),
        _ => bytes.extend(v.to_le_bytes()),
    }
}

/// Reads a cloud, ours or another's: x, y, z and, when they are there, colours (rgb or rgba, packed;
/// else white), normals and noise. Points with a coordinate that is NaN, as depth cameras mark pixels
/// without depth, are left out and counted.
///
/// # Errors
/// `FileIo`; `Unsupported` for more than [`MAX_POINTS`](crate::geometry::MAX_POINTS) points;
/// `FileFormat` for what is cut short, too long, or no PCD.
pub fn read_pcd(path: &Path) -> Result<CloudFile> {
    parse(&mut Source::open(path)?)
}

/// Reads a file's bytes; `name` is what errors call it.
pub fn from_pcd(bytes: &[u8], name: &str) -> Result<CloudFile> {
    parse(&mut Source::of(bytes, name))
}

struct Header {
    /// Name, type, and how many numbers.
    fields: Vec<(String, Scalar, usize)>,
    points: usize,
    data: PcdData,
}

fn header(source: &mut Source<'_>) -> Result<Header> {
    let (mut names, mut sizes, mut types, mut counts) = (Vec::new(), Vec::new(), Vec::new(), None);
    let (mut width, mut height, mut points, mut budget) = (None, None, None, MAX_HEADER);
    let mut first = true;
    let data = loop {
        let line = source.line(budget)?.ok_or_else(|| source.wrong("the header does not end"))?;
        budget = budget.saturating_sub(line.len() + 1);
        let bad = || source.wrong(format!("'{}'", line.escape_debug()));
        let words: Vec<String> = line.split_ascii_whitespace().map(Into::into).collect();
        let Some((key, values)) = words.split_first() else { continue };
        let number = || values.first().and_then(|v| v.parse::<usize>().ok()).ok_or_else(bad);
        let numbers = || values.iter().map(|v| v.parse::<usize>().ok()).collect::<Option<Vec<_>>>().ok_or_else(bad);
        match key.as_str() {
            _ if key.starts_with('#') => {}
            "VERSION" | "VIEWPOINT" => {}
            "FIELDS" | "COLUMNS" => names = values.to_vec(),
            "SIZE" => sizes = numbers()?,
            "TYPE" => types = values.to_vec(),
            "COUNT" => counts = Some(numbers()?),
            "WIDTH" => width = Some(number()?),
            "HEIGHT" => height = Some(number()?),
            "POINTS" => points = Some(number()?),
            "DATA" => match values.first().map(String::as_str) {
                Some("ascii") => break PcdData::Text,
                Some("binary") => break PcdData::Binary,
                Some("binary_compressed") => break PcdData::Compressed,
                _ => return Err(Error::Unsupported { what: format!("{}: {line}", source.name) }),
            },
            _ if first => return Err(source.wrong("not a PCD file")),
            _ => return Err(bad()),
        }
        first = false;
    };
    let counts = counts.unwrap_or_else(|| vec![1; names.len()]);
    if names.is_empty() || [sizes.len(), types.len(), counts.len()] != [names.len(); 3] {
        return Err(source.wrong("FIELDS, SIZE, TYPE and COUNT are not of one length"));
    }
    let mut fields = Vec::new();
    for (i, name) in names.into_iter().enumerate() {
        let scalar = match (types[i].as_str(), sizes[i]) {
            // Bits of a colour: as a float they may be no number.
            ("F" | "U" | "I", 4) if data != PcdData::Text && (name == "rgb" || name == "rgba") => Scalar::U32,
            ("I", 1) => Scalar::I8,
            ("U", 1) => Scalar::U8,
            ("I", 2) => Scalar::I16,
            ("U", 2) => Scalar::U16,
            ("I", 4) => Scalar::I32,
            ("U", 4) => Scalar::U32,
            ("I", 8) => Scalar::I64,
            ("U", 8) => Scalar::U64,
            ("F", 4) => Scalar::F32,
            ("F", 8) => Scalar::F64,
            (kind, size) => return Err(source.wrong(format!("field {name} of type {kind} and {size} bytes"))),
        };
        fields.push((name, scalar, counts[i]));
    }
    let grid = width.zip(height).map(|(w, h)| w.saturating_mul(h));
    let points = match (points, grid) {
        (Some(points), Some(grid)) if points != grid => {
            return Err(source.wrong(format!("{points} points, but WIDTH x HEIGHT are {grid}")));
        }
        (Some(points), _) | (None, Some(points)) => points,
        (None, None) => return Err(source.wrong("the header names no number of points")),
    };
    Ok(Header { fields, points, data })
}

fn parse(source: &mut Source<'_>) -> Result<CloudFile> {
    let Header { fields, points, data } = header(source)?;
    let encoding = if data == PcdData::Text { Encoding::Text } else { Encoding::LittleEndian };
    // Where each number of a record begins; fields of several have no name that counts.
    let (mut places, mut names, mut stride) = (Vec::new(), Vec::new(), 0usize);
    for (name, scalar, count) in &fields {
        places.push((stride, *scalar));
        names.push((if *count == 1 { name.clone() } else { String::new() }, *scalar));
        stride = scalar
            .size()
            .checked_mul(*count)
            .and_then(|n| n.checked_add(stride))
            .filter(|n| *n <= CHUNK)
            .ok_or_else(|| source.wrong(format!("{count} numbers in field {name}")))?;
    }
    let find = PointFields::find(&names, source)?;
    let wanted = points.checked_mul(stride).ok_or_else(|| source.wrong(format!("{points} points")))?;
    let file = match data {
        PcdData::Text => {
            let words: usize = fields.iter().map(|(_, _, count)| count).sum();
            source.expect(points.saturating_sub(1), 2 * words, "points")?;
            text(&find, &fields, points, encoding, source)?
        }
        PcdData::Binary => {
            source.expect(points, stride, "points")?;
            let mut file = find.cloud(points, source)?;
            let mut chunk = vec![0; (CHUNK / stride).max(1) * stride];
            let mut left = points;
            while left > 0 {
                let now = left.min(chunk.len() / stride);
                source.read(&mut chunk[..now * stride])?;
                for record in chunk[..now * stride].chunks_exact(stride) {
                    find.push(&mut file, |i| places[i].1.read(&record[places[i].0..], false));
                }
                left -= now;
            }
            file
        }
        PcdData::Compressed => {
            let [packed, plain] =
                [encoding.next(Scalar::U32, source)? as usize, encoding.next(Scalar::U32, source)? as usize];
            if plain != wanted {
                return Err(source.wrong(format!("{plain} bytes for {points} points of {stride}")));
            }
            source.expect(1, packed, "points")?;
            let mut file = find.cloud(points, source)?;
            let mut bytes = vec![0; packed];
            source.read(&mut bytes)?;
            let bytes =
                lzf::decompress(&bytes, plain).ok_or_else(|| source.wrong("the compressed points are damaged"))?;
            // Field by field.
            for point in 0..points {
                find.push(&mut file, |i| {
                    let (start, scalar) = places[i];
                    scalar.read(&bytes[start * points + point * scalar.size()..], false)
                });
            }
            file
        }
    };
    if data == PcdData::Text {
        if source.word()?.is_some() {
            return Err(source.wrong("more numbers than the header promises"));
        }
    } else if source.left > 0 && !only_zeros(source)? {
        return Err(source.wrong("more bytes than the header promises"));
    }
    finish(file, source)
}

fn text(
    find: &PointFields,
    fields: &[(String, Scalar, usize)],
    points: usize,
    encoding: Encoding,
    source: &mut Source<'_>,
) -> Result<CloudFile> {
    let mut file = find.cloud(points, source)?;
    let mut record = vec![0.0; fields.len()];
    for _ in 0..points {
        for (value, (_, scalar, count)) in record.iter_mut().zip(fields) {
            for _ in 0..*count {
                *value = encoding.next(*scalar, source)?;
            }
        }
        find.push(&mut file, |i| record[i]);
    }
    Ok(file)
}

/// PCL fills files up to whole pages.
fn only_zeros(source: &mut Source<'_>) -> Result<bool> {
    let mut page = [0; 4096];
    while source.left > 0 {
        let now = source.left.min(4096) as usize;
        source.read(&mut page[..now])?;
        if page[..now].iter().any(|b| *b != 0) {
            return Ok(false);
        }
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::super::model_tests::cloud;
    use super::*;
    use crate::error::Status;
    use crate::fuzz::{Random, fuzz_inputs, mutated};
    use nalgebra::Vector3;

    const KINDS: [PcdData; 3] = [PcdData::Text, PcdData::Binary, PcdData::Compressed];

    #[test]
    fn what_is_written_is_read() {
        let plain = PointCloud { normals: None, noise: CloudNoise::Unknown, ..cloud() };
        let mut far = cloud();
        far.positions[0] = Vector3::new(487_523.123_456_7, 4_287_654.987_654_3, 102.1);
        for data in KINDS {
            for cloud in [&plain, &cloud(), &far, &PointCloud::default()] {
                let found = from_pcd(&to_pcd(cloud, data).unwrap(), "cloud").unwrap();
                assert_eq!((&found.cloud, found.skipped), (cloud, 0), "{data:?}");
            }
        }
    }

    const TEXT: &str = "# .PCD v.7 - Point Cloud Data file format\nVERSION .7\nFIELDS rgb z y x viewpoint\nSIZE 4 4 4 4 4\n\
        TYPE F F F F F\nCOUNT 1 1 1 1 2\nWIDTH 2\nHEIGHT 2\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 4\nDATA ascii\n\
        4.2108e+06 0.1 0.2 0.3 7 8\n0 nan nan nan 0 0\n0 1 2 3 4 5\n0 1 2 3 4 5\n";

    /// From the format's own documentation: colours as floats, points without depth, several numbers
    /// in a field.
    #[test]
    fn files_of_pcl_are_read() {
        let found = from_pcd(TEXT.as_bytes(), "text").unwrap();
        assert_eq!((found.cloud.len(), found.skipped), (3, 1));
        // 4210800 = 2^22 (1 + 0x80E0 / 2^23) as a float has the bits 0x4A8080E0.
        assert_eq!(
            (found.cloud.positions[0], found.cloud.colours[0]),
            (Vector3::new(0.3f32, 0.2, 0.1).cast(), [128, 128, 224])
        );
    }

    #[test]
    fn lies_are_refused() {
        for data in KINDS {
            let bytes = to_pcd(&cloud(), data).unwrap();
            // A text may do without its last digits.
            let last = if data == PcdData::Text { bytes.len() - 8 } else { bytes.len() };
            for length in 0..last {
                let e = from_pcd(&bytes[..length], "cloud").unwrap_err();
                assert!(matches!(e.status(), Status::FileFormat | Status::Unsupported), "{data:?} {length} {e}");
            }
            let longer = [bytes.as_slice(), b" 1"].concat();
            assert_eq!(from_pcd(&longer, "cloud").unwrap_err().status(), Status::FileFormat, "{data:?}");
        }
        let refused = |from: &str, to: &str| {
            assert!(TEXT.contains(from), "{from}");
            from_pcd(TEXT.replacen(from, to, 1).as_bytes(), "text").unwrap_err().status()
        };
        for (from, to) in [
            ("POINTS 4", "POINTS 5"),
            ("WIDTH 2", "WIDTH 200000000"),
            ("WIDTH 2", "WIDTH 18446744073709551615"),
            ("WIDTH 2", "WIDTH -2"),
            ("SIZE 4 4", "SIZE 4"),
            ("SIZE 4 4", "SIZE 4 3"),
            ("COUNT 1 1 1 1 2", "COUNT 1 1 1 1 18446744073709551615"),
            ("COUNT 1 1 1 1 2", "COUNT 1 1 1 1 3"),
            ("TYPE F", "TYPE Q"),
            ("z y x", "z y w"),
            ("0 1 2 3 4 5", "0 1 2 3 4 x"),
            ("# .PCD v.7 - Point Cloud Data file format\nVERSION", "BM"),
        ] {
            assert_eq!(refused(from, to), Status::FileFormat, "{from} -> {to}");
        }
        assert_eq!(refused("DATA ascii", "DATA zip"), Status::Unsupported);
    }

    #[test]
    fn fuzz_pcd() {
        let mut random = Random(6);
        let good: Vec<Vec<u8>> = KINDS.iter().map(|data| to_pcd(&cloud(), *data).unwrap()).collect();
        for i in 0..fuzz_inputs() {
            if let Ok(file) = from_pcd(&mutated(&good[i as usize % 3], &mut random), "cloud") {
                file.cloud.validate().unwrap();
            }
        }
    }
}
