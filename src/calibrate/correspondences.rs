//! A growing set of 2D-3D measurements of one camera.

use std::sync::Arc;

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::line::ObservedLine;
use crate::error::{Error, Result};
use crate::geometry::InverseDepthPoint;
use crate::geometry::linalg::symmetric_eigen3;

/// Largest coordinate that is taken for one, in metres or pixels: squares and their sums stay finite.
const MAX_COORDINATE: f64 = 1e12;

/// Most measurements of a set: 1.5 GB of memory, and about 8 GB while it is solved. More are refused
/// before memory is taken for them.
pub const MAX_OBSERVATIONS: usize = 10_000_000;

/// One 2D-3D measurement: two equations, whatever its kind.
#[derive(Debug, Clone, PartialEq)]
pub enum Observation {
    /// A point whose position is known, exactly or with a covariance (m^2).
    Point {
        world: Vector3<f64>,
        world_covariance: Option<Matrix3<f64>>,
        pixel: Vector2<f64>,
        /// px^2; `None`: the set's common noise.
        pixel_covariance: Option<Matrix2<f64>>,
    },
    /// A laser shot: the point lies on a known ray, its inverse depth is measured.
    Shot { shot: InverseDepthPoint, pixel: Vector2<f64>, pixel_covariance: Matrix2<f64> },
    /// A line whose position in space is known, seen as a segment.
    Line(Box<ObservedLine>),
}

impl Observation {
    /// Where it was seen: its pixel, or the two ends of its segment.
    pub fn pixels(&self) -> &[Vector2<f64>] {
        match self {
            Self::Point { pixel, .. } | Self::Shot { pixel, .. } => std::slice::from_ref(pixel),
            Self::Line(line) => &line.ends,
        }
    }

    fn check(&self, index: usize) -> Result<()> {
        match self {
            Self::Point { world, world_covariance, pixel, pixel_covariance } => {
                check_finite(pixel.as_slice(), "uv", index)?;
                check_finite(world.as_slice(), "xyz", index)?;
                if let Some(c) = world_covariance {
                    check_finite(c.as_slice(), "xyz covariance", index)?;
                    // Semi-definite is fine: a shot's covariance has rank one.
                    let least = symmetric_eigen3(&(c + c.transpose())).map(|(values, _)| values[2]);
                    if least.is_none_or(|least| least < -1e-9 * c.amax()) {
                        return Err(not_positive("xyz covariance", index));
                    }
                }
                if let Some(c) = pixel_covariance {
                    check_positive(c, index)?;
                }
            }
            Self::Shot { shot, pixel, pixel_covariance } => {
                check_finite(pixel.as_slice(), "uv", index)?;
                check_finite(shot.origin.as_slice(), "shot origin", index)?;
                check_finite(shot.direction.as_slice(), "shot direction", index)?;
                check_finite(&[shot.rho, shot.variance], "shot inverse depth", index)?;
                check_positive(pixel_covariance, index)?;
                if shot.variance <= 0.0 {
                    return Err(not_positive("inverse depth variance", index));
                }
                if shot.direction.norm_squared() == 0.0 {
                    return Err(Error::invalid("shot direction", format!("of point {index} is zero")));
                }
            }
            Self::Line(line) => line.check(index)?,
        }
        Ok(())
    }
}

impl From<ObservedLine> for Observation {
    fn from(line: ObservedLine) -> Self {
        Self::Line(Box::new(line))
    }
}

pub(super) fn check_finite(values: &[f64], name: &'static str, index: usize) -> Result<()> {
    match values.iter().find(|v| v.is_nan() || v.abs() > MAX_COORDINATE) {
        None => Ok(()),
        Some(v) if v.is_finite() => Err(Error::invalid(name, format!("{v:e} of point {index} is beyond measure"))),
        Some(_) => Err(Error::NotFinite { name, index }),
    }
}

fn check_room(given: usize, more: usize) -> Result<()> {
    let count = given.saturating_add(more);
    if count <= MAX_OBSERVATIONS {
        return Ok(());
    }
    let reason = format!("{count} of them, {MAX_OBSERVATIONS} are the most that a set takes: draw some of them");
    Err(Error::invalid("measurements", reason))
}

/// Refuses a pixel's covariance that is not positive definite.
pub(super) fn check_positive(c: &Matrix2<f64>, index: usize) -> Result<()> {
    check_finite(c.as_slice(), "uv covariance", index)?;
    if c.m11 > 0.0 && c.determinant() > 0.0 && c.m12 == c.m21 {
        Ok(())
    } else {
        Err(not_positive("uv covariance", index))
    }
}

fn not_positive(name: &'static str, index: usize) -> Error {
    Error::invalid(name, format!("of point {index} is not positive definite"))
}

/// 2D-3D measurements of one camera, in any mixture of points, laser shots and lines.
#[derive(Debug, Clone, PartialEq)]
pub struct Correspondences {
    width: u32,
    height: u32,
    /// Copies share them until one of them grows.
    observations: Arc<Vec<Observation>>,
}

impl Correspondences {
    /// For a camera with the given image size.
    pub fn new(width: u32, height: u32) -> Result<Self> {
        if width == 0 || height == 0 || width > 1 << 16 || height > 1 << 16 {
            return Err(Error::invalid("image size", format!("{width} x {height}")));
        }
        Ok(Self { width, height, observations: Arc::default() })
    }

    pub fn width(&self) -> u32 {
        self.width
    }

    pub fn height(&self) -> u32 {
        self.height
    }

    pub fn len(&self) -> usize {
        self.observations.len()
    }

    pub fn is_empty(&self) -> bool {
        self.observations.is_empty()
    }

    pub fn observations(&self) -> &[Observation] {
        &self.observations
    }

    /// Refuses more measurements than a set may have.
    pub(crate) fn check_room(&self, more: usize) -> Result<()> {
        check_room(self.observations.len(), more)
    }

    /// Adds one measurement; refuses what is not finite and covariances that are not positive.
    pub fn add(&mut self, observation: Observation) -> Result<()> {
        self.check_room(1)?;
        observation.check(self.observations.len())?;
        Arc::make_mut(&mut self.observations).push(observation);
        Ok(())
    }

    /// Adds all of them or, when one is refused, none.
    pub fn add_all(&mut self, observations: impl IntoIterator<Item = Observation>) -> Result<()> {
        let mut new = observations.into_iter();
        self.check_room(new.size_hint().0)?;
        let observations = Arc::make_mut(&mut self.observations);
        let before = observations.len();
        observations.reserve(new.size_hint().0);
        let result = new.try_for_each(|o| {
            check_room(observations.len(), 1)?;
            o.check(observations.len())?;
            observations.push(o);
            Ok(())
        });
        if result.is_err() {
            observations.truncate(before);
        }
        result
    }

    /// Adds exact 3D points (metres) with their pixels.
    pub fn add_points(&mut self, world: &[Vector3<f64>], pixels: &[Vector2<f64>]) -> Result<()> {
        if world.len() != pixels.len() {
            return Err(Error::invalid("uv", format!("{} pixels for {} points", pixels.len(), world.len())));
        }
        self.add_all(world.iter().zip(pixels).map(|(world, pixel)| Observation::Point {
            world: *world,
            world_covariance: None,
            pixel: *pixel,
            pixel_covariance: None,
        }))
    }
}
