//! What of a file's records makes a point, and points as records.
//!
//! Names that PLY and PCD share: x, y, z (metres); nx, ny, nz (PCD: normal_x, ...); standard_deviation
//! (metres, the root of the covariance's trace); covariance_xx, _xy, _xz, _yy, _yz, _zz (m^2).

use nalgebra::Vector3;

use super::file::Source;
use super::scalar::Scalar;
use crate::error::{Error, Result};
use crate::geometry::point_cloud::MAX_POINTS;
use crate::geometry::{CloudNoise, PointCloud};

pub(super) const DEVIATION: &str = "standard_deviation";
pub(super) const COVARIANCE: [&str; 6] =
    ["covariance_xx", "covariance_xy", "covariance_xz", "covariance_yy", "covariance_yz", "covariance_zz"];

/// Beyond this a float's steps are more than 0.1 mm.
pub(super) const FLOAT_RANGE: f64 = 1024.0;

/// A cloud as a file has it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CloudFile {
    pub cloud: PointCloud,
    /// Points left out because a coordinate is NaN or infinite, as depth cameras mark pixels that
    /// measured nothing.
    pub skipped: usize,
}

#[derive(Debug, Clone, Copy)]
enum Colour {
    None,
    /// Red, green, blue, and what each is divided by to be a byte.
    Channels([usize; 3], f64),
    /// 0x00rrggbb.
    Packed(usize),
    /// The same bits as a float.
    PackedFloat(usize),
}

#[derive(Debug, Clone, Copy)]
enum Noise {
    None,
    Deviation(usize),
    Covariance([usize; 6]),
}

/// Which of a record's numbers are a point's.
pub(super) struct PointFields {
    axes: [usize; 3],
    colour: Colour,
    normal: Option<[usize; 3]>,
    noise: Noise,
}

impl PointFields {
    pub fn find(fields: &[(String, Scalar)], source: &Source<'_>) -> Result<Self> {
        let field = |name: &str| fields.iter().position(|(n, _)| n == name);
        let three = |names: [&str; 3]| Some([field(names[0])?, field(names[1])?, field(names[2])?]);
        let axes = three(["x", "y", "z"]).ok_or_else(|| source.wrong("the points have no x, y and z"))?;
        let channels = three(["red", "green", "blue"]).or_else(|| three(["r", "g", "b"]));
        let colour = match (channels, field("rgb").or_else(|| field("rgba"))) {
            (Some(channels), _) => {
                let scale = match channels.map(|c| fields[c].1) {
                    [Scalar::U8, Scalar::U8, Scalar::U8] => 1.0,
                    [Scalar::U16, Scalar::U16, Scalar::U16] => 257.0,
                    [Scalar::F32 | Scalar::F64, Scalar::F32 | Scalar::F64, Scalar::F32 | Scalar::F64] => 1.0 / 255.0,
                    other => {
                        return Err(Error::Unsupported {
                            what: format!("{}: colours of types {other:?}", source.name),
                        });
                    }
                };
                Colour::Channels(channels, scale)
            }
            (None, Some(packed)) => match fields[packed].1 {
                Scalar::U32 | Scalar::I32 => Colour::Packed(packed),
                Scalar::F32 => Colour::PackedFloat(packed),
                other => {
                    return Err(Error::Unsupported { what: format!("{}: colours of type {other:?}", source.name) });
                }
            },
            (None, None) => Colour::None,
        };
        let covariance = COVARIANCE.map(field);
        let noise = match (covariance.iter().all(Option::is_some), field(DEVIATION)) {
            (true, _) => Noise::Covariance(covariance.map(Option::unwrap_or_default)),
            (false, Some(deviation)) => Noise::Deviation(deviation),
            (false, None) => Noise::None,
        };
        let normal = three(["nx", "ny", "nz"]).or_else(|| three(["normal_x", "normal_y", "normal_z"]));
        Ok(Self { axes, colour, normal, noise })
    }

    /// An empty cloud for `count` points, which the file is known to have.
    pub fn cloud(&self, count: usize, source: &Source<'_>) -> Result<CloudFile> {
        if count > MAX_POINTS {
            return Err(Error::Unsupported {
                what: format!("{}: {count} points, at most {MAX_POINTS} are read", source.name),
            });
        }
        let cloud = PointCloud {
            positions: Vec::with_capacity(count),
            colours: Vec::with_capacity(count),
            normals: self.normal.map(|_| Vec::with_capacity(count)),
            noise: match self.noise {
                Noise::None => CloudNoise::Unknown,
                Noise::Deviation(_) => CloudNoise::Deviations(Vec::with_capacity(count)),
                Noise::Covariance(_) => CloudNoise::Covariances(Vec::with_capacity(count)),
            },
        };
        Ok(CloudFile { cloud, skipped: 0 })
    }

    /// Adds the point whose numbers `at` tells.
    #[inline]
    pub fn push(&self, file: &mut CloudFile, at: impl Fn(usize) -> f64) {
        let position = Vector3::from(self.axes.map(&at));
        if !position.iter().all(|v| v.is_finite()) {
            file.skipped += 1;
            return;
        }
        let cloud = &mut file.cloud;
        cloud.positions.push(position);
        cloud.colours.push(match self.colour {
            Colour::None => [255; 3],
            // A cast saturates, and takes NaN for 0.
            Colour::Channels(channels, scale) => channels.map(|c| (at(c) / scale).round() as u8),
            Colour::Packed(packed) => unpack(at(packed) as i64 as u32),
            Colour::PackedFloat(packed) => unpack((at(packed) as f32).to_bits()),
        });
        if let (Some(normals), Some(normal)) = (&mut cloud.normals, self.normal) {
            let n = Vector3::from(normal.map(&at));
            // Where a normal cannot be estimated, PCL writes NaN.
            normals.push(if n.iter().all(|v| v.is_finite()) { n } else { Vector3::zeros() });
        }
        match (&mut cloud.noise, self.noise) {
            (CloudNoise::Deviations(list), Noise::Deviation(i)) => list.push(at(i)),
            (CloudNoise::Covariances(list), Noise::Covariance(c)) => list.push(c.map(&at)),
            _ => {}
        }
    }
}

impl PointFields {
    /// Adds the points of little-endian records, whose numbers begin at these bytes and are of these types, without
    /// asking for the type of each: of records as most files have them, coordinates as floats or doubles, colours
    /// as bytes or none, and nothing else. False, and nothing is added, for other records and where a coordinate
    /// is not finite.
    pub fn push_common<'a>(
        &self,
        file: &mut CloudFile,
        records: impl Iterator<Item = &'a [u8]> + Clone,
        places: &[(usize, Scalar)],
    ) -> bool {
        let starts = self.axes.map(|axis| places[axis].0);
        let colours = match self.colour {
            Colour::None => None,
            Colour::Channels(channels, _) if channels.iter().all(|c| places[*c].1 == Scalar::U8) => {
                Some(channels.map(|c| places[c].0))
            }
            _ => return false,
        };
        if self.normal.is_some() || !matches!(self.noise, Noise::None) {
            return false;
        }
        let cloud = &mut file.cloud;
        let before = cloud.positions.len();
        match self.axes.map(|axis| places[axis].1) {
            [Scalar::F32, Scalar::F32, Scalar::F32] => cloud.positions.extend(
                records.clone().map(|r| Vector3::from(starts.map(|at| f64::from(f32::from_le_bytes(bytes(r, at)))))),
            ),
            [Scalar::F64, Scalar::F64, Scalar::F64] => cloud
                .positions
                .extend(records.clone().map(|r| Vector3::from(starts.map(|at| f64::from_le_bytes(bytes(r, at)))))),
            _ => return false,
        }
        // Infinity times zero is NaN, and NaN stays.
        let sum: f64 = cloud.positions[before..].iter().map(|p| (p.x * 0.0 + p.y * 0.0) + p.z * 0.0).sum();
        if sum.is_nan() {
            cloud.positions.truncate(before);
            return false;
        }
        match colours {
            None => cloud.colours.resize(cloud.positions.len(), [255; 3]),
            Some(at) => cloud.colours.extend(records.map(|r| at.map(|at| r[at]))),
        }
        true
    }
}

fn bytes<const N: usize>(record: &[u8], start: usize) -> [u8; N] {
    let mut bytes = [0; N];
    bytes.copy_from_slice(&record[start..start + N]);
    bytes
}

fn unpack(bits: u32) -> [u8; 3] {
    let [_, r, g, b] = bits.to_be_bytes();
    [r, g, b]
}

/// The checked cloud of a file.
pub(super) fn finish(file: CloudFile, source: &Source<'_>) -> Result<CloudFile> {
    file.cloud.validate().map_err(|e| source.wrong(e.to_string()))?;
    Ok(file)
}
