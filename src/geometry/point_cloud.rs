//! Coloured points of the world, with what is known of their noise.

use nalgebra::{Matrix3, Vector3};

use crate::error::{Error, Result};

/// Most points of a cloud and vertices or triangles of a mesh: 1.4 GB of memory, 3.8 GB with
/// covariances. More are refused before memory is taken for them.
pub const MAX_POINTS: usize = 50_000_000;

/// What is known of the points' noise.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum CloudNoise {
    #[default]
    Unknown,
    /// Metres: the root mean square distance of each point from its truth, which is the root of its
    /// covariance's trace. Taken to be alike in all directions where a direction counts.
    Deviations(Vec<f64>),
    /// m^2, of each point the upper triangle xx, xy, xz, yy, yz, zz. Points are taken to be
    /// independent of each other. A covariance may be singular: a laser shot's is, across its ray.
    Covariances(Vec<[f64; 6]>),
}

/// Points with colours, and normals and noise where they are known.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PointCloud {
    /// Metres.
    pub positions: Vec<Vector3<f64>>,
    /// Red, green, blue, as pictures have them (sRGB); one for each point.
    pub colours: Vec<[u8; 3]>,
    /// Unit vectors out of the surface, zero where there is none; one for each point.
    pub normals: Option<Vec<Vector3<f64>>>,
    pub noise: CloudNoise,
}

/// The upper triangle of a symmetric matrix: xx, xy, xz, yy, yz, zz.
pub fn pack(c: &Matrix3<f64>) -> [f64; 6] {
    [c.m11, c.m12, c.m13, c.m22, c.m23, c.m33]
}

/// The symmetric matrix of an upper triangle.
pub fn unpack([xx, xy, xz, yy, yz, zz]: &[f64; 6]) -> Matrix3<f64> {
    Matrix3::new(*xx, *xy, *xz, *xy, *yy, *yz, *xz, *yz, *zz)
}

/// Refuses more points than a cloud may have.
pub fn check_count(count: usize) -> Result<()> {
    if count > MAX_POINTS {
        let reason = format!("{count} points, {MAX_POINTS} are the most: thin them out, or take them in parts");
        return Err(Error::invalid("points", reason));
    }
    Ok(())
}

impl CloudNoise {
    /// m^2; `None` where nothing is known, or there is no such point.
    pub fn covariance(&self, index: usize) -> Option<Matrix3<f64>> {
        match self {
            Self::Unknown => None,
            Self::Deviations(d) => Some(Matrix3::from_diagonal_element(d.get(index)?.powi(2) / 3.0)),
            Self::Covariances(c) => Some(unpack(c.get(index)?)),
        }
    }

    /// Metres, as for [`CloudNoise::Deviations`].
    pub fn deviation(&self, index: usize) -> Option<f64> {
        match self {
            Self::Unknown => None,
            Self::Deviations(d) => d.get(index).copied(),
            Self::Covariances(c) => c.get(index).map(|c| (c[0] + c[3] + c[5]).sqrt()),
        }
    }

    /// The same as covariances; what is unknown stays so.
    pub fn into_covariances(self) -> Self {
        match self {
            Self::Deviations(d) => Self::Covariances(d.iter().map(|d| isotropic(*d)).collect()),
            other => other,
        }
    }

    fn validate(&self, count: usize) -> Result<()> {
        let (given, bad) = match self {
            Self::Unknown => return Ok(()),
            // Files hold them as floats.
            Self::Deviations(d) => (d.len(), d.iter().position(|v| !(v.is_finite() && (*v as f32).is_finite()))),
            Self::Covariances(c) => {
                (c.len(), c.iter().position(|c| c.iter().any(|v| !(v.is_finite() && (*v as f32).is_finite()))))
            }
        };
        if given != count {
            return Err(Error::invalid("cloud", format!("the noise of {given} points for {count}")));
        }
        if let Some(index) = bad {
            return Err(Error::NotFinite { name: "noise", index });
        }
        let negative = match self {
            Self::Unknown => None,
            Self::Deviations(d) => d.iter().position(|d| *d < 0.0),
            Self::Covariances(c) => c.iter().position(|c| !is_covariance(c)),
        };
        match negative {
            Some(index) => Err(Error::invalid("noise", format!("that of point {index} is negative"))),
            None => Ok(()),
        }
    }
}

fn isotropic(deviation: f64) -> [f64; 6] {
    let v = deviation * deviation / 3.0;
    [v, 0.0, 0.0, v, 0.0, v]
}

/// No negative variance along the axes or in their planes; the rounding of floats is allowed.
fn is_covariance([xx, xy, xz, yy, yz, zz]: &[f64; 6]) -> bool {
    let minor = |a: f64, b: f64, c: f64| c * c <= a * b * (1.0 + 1e-5) + 1e-60;
    *xx >= 0.0 && *yy >= 0.0 && *zz >= 0.0 && minor(*xx, *yy, *xy) && minor(*xx, *zz, *xz) && minor(*yy, *zz, *yz)
}

impl PointCloud {
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Checks that all lists are as long as the positions, the number of points, and that every number
    /// is finite.
    pub fn validate(&self) -> Result<()> {
        let count = self.len();
        check_count(count)?;
        let other =
            |name: &str, given: usize| Err(Error::invalid("cloud", format!("{given} {name} for {count} points")));
        if self.colours.len() != count {
            return other("colours", self.colours.len());
        }
        if let Some(index) = self.positions.iter().position(|p| !is_finite(p)) {
            return Err(Error::NotFinite { name: "positions", index });
        }
        if let Some(normals) = &self.normals {
            if normals.len() != count {
                return other("normals", normals.len());
            }
            if let Some(index) = normals.iter().position(|n| !is_finite(n)) {
                return Err(Error::NotFinite { name: "normals", index });
            }
        }
        self.noise.validate(count)
    }

    /// The points of these indices, in their order; those that do not exist are left out.
    pub fn select(&self, indices: &[usize]) -> Self {
        fn of<T: Clone>(list: &[T], indices: &[usize]) -> Vec<T> {
            indices.iter().filter_map(|i| list.get(*i).cloned()).collect()
        }
        Self {
            positions: of(&self.positions, indices),
            colours: of(&self.colours, indices),
            normals: self.normals.as_ref().map(|n| of(n, indices)),
            noise: match &self.noise {
                CloudNoise::Unknown => CloudNoise::Unknown,
                CloudNoise::Deviations(d) => CloudNoise::Deviations(of(d, indices)),
                CloudNoise::Covariances(c) => CloudNoise::Covariances(of(c, indices)),
            },
        }
    }

    /// Greatest absolute coordinate, metres.
    pub fn reach(&self) -> f64 {
        self.positions.iter().map(Vector3::amax).fold(0.0, f64::max)
    }
}

pub(crate) fn is_finite(v: &Vector3<f64>) -> bool {
    v.iter().all(|x| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud() -> PointCloud {
        PointCloud {
            positions: vec![Vector3::new(1.0, 2.0, 3.0), Vector3::zeros()],
            colours: vec![[1, 2, 3]; 2],
            normals: None,
            noise: CloudNoise::Deviations(vec![0.3, 0.0]),
        }
    }

    #[test]
    fn a_deviation_is_the_root_of_the_trace() {
        let noise = cloud().noise;
        assert!((noise.covariance(0).unwrap().trace().sqrt() - 0.3).abs() < 1e-15);
        let packed = noise.clone().into_covariances();
        assert!((packed.deviation(0).unwrap() - noise.deviation(0).unwrap()).abs() < 1e-15);
        assert_eq!((packed.deviation(2), CloudNoise::Unknown.covariance(0)), (None, None));
    }

    #[test]
    fn faults_are_named() {
        assert_eq!(cloud().validate(), Ok(()));
        let noise = |noise| PointCloud { noise, ..cloud() }.validate();
        assert!(noise(CloudNoise::Deviations(vec![0.1])).is_err());
        assert!(noise(CloudNoise::Deviations(vec![0.1, -0.1])).is_err());
        let bad = noise(CloudNoise::Deviations(vec![0.1, f64::NAN]));
        assert_eq!(bad, Err(Error::NotFinite { name: "noise", index: 1 }));
        assert!(noise(CloudNoise::Covariances(vec![[1.0, 0.0, 0.0, 1.0, 0.0, 1.0]; 2])).is_ok());
        assert!(noise(CloudNoise::Covariances(vec![[1.0, 1.1, 0.0, 1.0, 0.0, 1.0]; 2])).is_err());
        assert!(noise(CloudNoise::Covariances(vec![[-1.0, 0.0, 0.0, 1.0, 0.0, 1.0]; 2])).is_err());
        // Along a ray: singular, and good.
        let d = Vector3::new(0.3, -0.7, 2.0);
        assert!(noise(CloudNoise::Covariances(vec![pack(&(d * d.transpose() * 1e-9)); 2])).is_ok());
        let normals = |n| PointCloud { normals: Some(n), ..cloud() }.validate();
        assert!(normals(vec![]).is_err() && normals(vec![Vector3::z(); 2]).is_ok());
        let nan = PointCloud { positions: vec![Vector3::zeros(), Vector3::repeat(f64::NAN)], ..cloud() };
        assert_eq!(nan.validate(), Err(Error::NotFinite { name: "positions", index: 1 }));
        assert!(PointCloud { colours: vec![], ..cloud() }.validate().is_err());
        assert_eq!(check_count(100_000_000).unwrap_err().status(), crate::error::Status::InvalidArgument);
    }
}
