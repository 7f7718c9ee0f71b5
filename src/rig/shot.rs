//! What a scan measures, and what can be made of it.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::region::ScanRegion;
use crate::adjust::{self, Adjustment};
use crate::calibrate::{Calibration, Correspondences, Observation};
use crate::cloud::{CloudNoise, GridPoint, Mesh, PointCloud, RayGrid, SurfaceOptions, triangulate};
use crate::detect::spot::Spot;
use crate::error::{Error, Result, Status};
use crate::geometry::RigModel;
use crate::geometry::point_cloud::pack;
use crate::geometry::rig_model::SpotDepth;

use super::journal::JournalRepair;

/// Why a camera has no spot for a shot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
#[non_exhaustive]
pub enum Miss {
    /// No spot, or none that is strong enough.
    NotFound = 1,
    /// Several candidates.
    Ambiguous = 2,
    /// A spot off the laser's line in the head camera's image: a reflection.
    OffEpipolarLine = 3,
    /// A spot of the coarse pass that the camera, calibrated with it, sees elsewhere.
    OffPrediction = 4,
    /// The measured point is outside the fixed camera's view; the frame was not searched.
    OutsideView = 5,
}

impl Miss {
    pub(super) fn from_code(code: u8) -> Option<Self> {
        [Self::NotFound, Self::Ambiguous, Self::OffEpipolarLine, Self::OffPrediction, Self::OutsideView]
            .into_iter()
            .find(|m| *m as u8 == code)
    }

    pub fn status(self) -> Status {
        self.error().status()
    }

    /// The same as an error, with its reason.
    pub fn error(self) -> Error {
        let reason = match self {
            Self::NotFound => "no spot, or none that is strong enough",
            Self::Ambiguous => "several candidates",
            Self::OffEpipolarLine => "the spot is off the laser's line in the image: a reflection",
            Self::OffPrediction => "the spot is not where the camera, calibrated, must see it",
            Self::OutsideView => "the point is outside the camera's view",
        };
        let reason = reason.to_owned();
        if self == Self::Ambiguous { Error::Ambiguous { reason } } else { Error::NotFound { reason } }
    }
}

/// A camera's spot, or why there is none.
pub type Sighting = std::result::Result<Spot, Miss>;

/// One position of a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Shot {
    /// Position in the region: row * pan_steps + column.
    pub index: u32,
    /// The device's readings, radians, and its own zoom scale.
    pub pan: f64,
    pub tilt: f64,
    pub zoom: f64,
    /// Clock seconds.
    pub time: f64,
    pub head: Sighting,
    /// One for each fixed camera.
    pub fixed: Vec<Sighting>,
    /// Red, green, blue at the spot in the head camera's frame with the laser off; 0 without a spot.
    pub colour: [u8; 3],
    /// What the head camera's spot says about depth.
    pub point: Option<SpotDepth>,
}

impl Shot {
    /// Measured, and seen by a fixed camera.
    pub(super) fn is_seen_by(&self, camera: usize) -> bool {
        self.point.is_some() && self.fixed[camera].is_ok()
    }

    /// Inverse depth from the head camera's spot.
    pub(super) fn locate(&mut self, model: &RigModel) {
        self.point = self.head.ok().and_then(|spot| {
            model.measure(self.pan, self.tilt, &Vector2::new(spot.x, spot.y), &spot_covariance(&spot)).ok()
        });
    }
}

pub(super) fn spot_covariance(spot: &Spot) -> Matrix2<f64> {
    let [xx, xy, yy] = spot.covariance;
    Matrix2::new(xx, xy, xy, yy)
}

/// How a scan ended. Whatever it is, the shots taken are in the [`Scan`].
#[derive(Debug, Clone, PartialEq)]
pub enum ScanEnd {
    Complete,
    /// [`ScanOptions::target_accuracy`](super::ScanOptions) was met before the last position.
    TargetMet,
    /// The progress callback asked for it.
    Stopped,
    /// The cancel token.
    Cancelled,
    /// A device, the laser's safety, or the journal.
    Failed(Error),
}

/// A point of the world that the laser touched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScanPoint {
    /// Metres.
    pub position: Vector3<f64>,
    /// m^2; rank one, along the laser's line.
    pub covariance: Matrix3<f64>,
    pub colour: [u8; 3],
    /// Index of its shot in [`Scan::shots`].
    pub shot: usize,
}

/// Number of shots, of spots in the head camera, and of spots in each fixed camera.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScanCounts {
    pub shots: usize,
    pub head: usize,
    pub fixed: Vec<usize>,
}

/// The result of a scan.
#[derive(Debug, Clone)]
pub struct Scan {
    pub region: ScanRegion,
    pub model: RigModel,
    /// Image sizes of the fixed cameras.
    pub fixed_sizes: Vec<(u32, u32)>,
    /// In the order in which they were taken; those of a resumed journal first.
    pub shots: Vec<Shot>,
    pub end: ScanEnd,
    /// Shots read from the journal.
    pub resumed: usize,
    /// What had to be mended in the journal.
    pub repair: Option<JournalRepair>,
    /// Calibrations made on the way to know where to look, from the coarse pass; `None` for known
    /// cameras and where the shots did not suffice. [`correspondences`](Self::correspondences) of the
    /// whole scan give a better one.
    pub search_calibrations: Vec<Option<Calibration>>,
}

impl Scan {
    pub fn is_complete(&self) -> bool {
        self.end == ScanEnd::Complete
    }

    pub fn counts(&self) -> ScanCounts {
        ScanCounts {
            shots: self.shots.len(),
            head: self.shots.iter().filter(|s| s.head.is_ok()).count(),
            fixed: (0..self.fixed_sizes.len())
                .map(|i| self.shots.iter().filter(|s| s.fixed[i].is_ok()).count())
                .collect(),
        }
    }

    /// The shots that both the head camera and fixed camera `camera` saw, for its calibration, in
    /// the order of [`shots`](Self::shots).
    ///
    /// # Errors
    /// `InvalidArgument` for a camera that was not watched.
    pub fn correspondences(&self, camera: usize) -> Result<Correspondences> {
        let &(width, height) = self
            .fixed_sizes
            .get(camera)
            .ok_or_else(|| Error::invalid("camera", format!("{camera} of {}", self.fixed_sizes.len())))?;
        correspondences(self.shots.iter(), camera, width, height)
    }

    /// Adds all shots to a joint adjustment, taken from its `station`: shot i becomes shot first + i,
    /// where first is returned. `cameras` says for each fixed camera which one of the adjustment it
    /// is; `None` leaves its spots out. All shots are added, or none.
    ///
    /// # Errors
    /// `InvalidArgument` for another number of cameras, an index that does not exist, and image sizes
    /// that differ.
    pub fn add_to(&self, adjustment: &mut Adjustment, station: usize, cameras: &[Option<usize>]) -> Result<usize> {
        if cameras.len() != self.fixed_sizes.len() {
            let reason = format!("{}, the scan watched {}", cameras.len(), self.fixed_sizes.len());
            return Err(Error::invalid("cameras", reason));
        }
        let same = |name, own: (u32, u32), other: (u32, u32)| {
            let reason = || format!("{} x {}, the scan has {} x {}", other.0, other.1, own.0, own.1);
            if own == other { Ok(()) } else { Err(Error::invalid(name, reason())) }
        };
        let rig = adjustment.rig();
        same("rig", (self.model.width, self.model.height), (rig.width, rig.height))?;
        for (size, camera) in self.fixed_sizes.iter().zip(cameras) {
            let Some(camera) = *camera else { continue };
            let setups = adjustment.cameras();
            let none = || Error::invalid("cameras", format!("camera {camera} of {}", setups.len()));
            let setup = setups.get(camera).ok_or_else(none)?;
            same("cameras", *size, (setup.width, setup.height))?;
        }
        let pixel = |spot: &Spot| (Vector2::new(spot.x, spot.y), spot_covariance(spot));
        adjustment.add_shots(self.shots.iter().map(|s| {
            adjust::Shot {
                station,
                pan: s.pan,
                tilt: s.tilt,
                head: s.head.as_ref().ok().map(pixel),
                sightings: (s.fixed.iter().zip(cameras))
                    .filter_map(|(seen, camera)| {
                        let (pixel, covariance) = pixel(seen.as_ref().ok()?);
                        Some(adjust::Sighting { camera: (*camera)?, pixel, covariance })
                    })
                    .collect(),
            }
        }))
    }

    /// The points measured with the head camera, where their depth is finite.
    pub fn points(&self) -> Vec<ScanPoint> {
        let point = |(shot, s): (usize, &Shot)| {
            let measured = s.point?.point;
            Some(ScanPoint {
                position: measured.point()?,
                covariance: measured.point_covariance()?,
                colour: s.colour,
                shot,
            })
        };
        self.shots.iter().enumerate().filter_map(point).collect()
    }

    /// The [`points`](Self::points) as a cloud with covariances.
    pub fn cloud(&self) -> PointCloud {
        let points = self.points();
        PointCloud {
            positions: points.iter().map(|p| p.position).collect(),
            colours: points.iter().map(|p| p.colour).collect(),
            normals: None,
            noise: CloudNoise::Covariances(points.iter().map(|p| pack(&p.covariance)).collect()),
        }
    }

    /// The shots on the region's grid, rows in the direction of growing tilt. The latest of several
    /// shots of one position counts.
    pub fn grid(&self) -> RayGrid {
        let mut points = vec![None; self.region.len()];
        for shot in &self.shots {
            if let (Some(place), Some(depth)) = (points.get_mut(shot.index as usize), shot.point) {
                *place = Some(GridPoint { point: depth.point, colour: shot.colour });
            }
        }
        RayGrid::of_rows(self.region.pan_steps as usize, points)
    }

    /// The surface through the measured points, its front towards the rig.
    ///
    /// # Errors
    /// `InvalidArgument` for options out of range.
    pub fn surface(&self, options: &SurfaceOptions) -> Result<Mesh> {
        triangulate(&self.grid(), options)
    }
}

pub(super) fn correspondences<'a>(
    shots: impl Iterator<Item = &'a Shot>,
    camera: usize,
    width: u32,
    height: u32,
) -> Result<Correspondences> {
    let mut set = Correspondences::new(width, height)?;
    for shot in shots {
        if let (Some(depth), Ok(spot)) = (shot.point, shot.fixed[camera]) {
            set.add(Observation::Shot {
                shot: depth.point,
                pixel: Vector2::new(spot.x, spot.y),
                pixel_covariance: spot_covariance(&spot),
            })?;
        }
    }
    Ok(set)
}
