//! The planes that a scan's shots hit.

use nalgebra::Vector3;

use super::shot::Scan;
use crate::error::{Error, Result};
use crate::geometry::InverseDepthPoint;
use crate::pose::{FindPlanesOptions, PlaneRegion, StationPlanes, find_planes_in_shots, fit_regions_of_shots};

/// A part of a scan that the user names.
#[derive(Debug, Clone, PartialEq)]
pub enum ScanPart {
    /// The shots whose readings lie between these, radians, ends included.
    Readings { pan: [f64; 2], tilt: [f64; 2] },
    /// Those between two corners, metres, in the rig's frame.
    Box([Vector3<f64>; 2]),
}

impl Scan {
    /// The planes that the scan shows, in the rig's frame; their labels are the shots', in their order. Shots
    /// without a measured depth belong to none.
    ///
    /// # Errors
    /// As [`find_planes_in_shots`].
    pub fn find_planes(&self, options: &FindPlanesOptions) -> Result<StationPlanes> {
        find_planes_in_shots(&self.inverse_depths(), options)
    }

    /// One plane for each part of the scan, in their order, whatever else the parts hold up to half.
    ///
    /// # Errors
    /// `InvalidArgument` for readings that are no range; otherwise as [`fit_regions_of_shots`].
    pub fn fit_planes(&self, parts: &[ScanPart], options: &FindPlanesOptions) -> Result<StationPlanes> {
        let regions = parts.iter().map(|part| self.region_of(part)).collect::<Result<Vec<_>>>()?;
        fit_regions_of_shots(&self.inverse_depths(), &regions, options)
    }

    fn region_of(&self, part: &ScanPart) -> Result<PlaneRegion> {
        let (pan, tilt) = match part {
            ScanPart::Box(corners) => return Ok(PlaneRegion::Box(*corners)),
            ScanPart::Readings { pan, tilt } => (pan, tilt),
        };
        let is_range = |[low, high]: &[f64; 2]| low.is_finite() && high.is_finite() && low <= high;
        if let Some([low, high]) = [pan, tilt].into_iter().find(|r| !is_range(r)) {
            return Err(Error::invalid("regions", format!("readings from {low} to {high}")));
        }
        let inside = |[low, high]: &[f64; 2], reading: f64| (*low..=*high).contains(&reading);
        let shots = self.shots.iter().enumerate();
        Ok(PlaneRegion::Indices(
            shots.filter(|(_, s)| inside(pan, s.pan) && inside(tilt, s.tilt)).map(|(i, _)| i).collect(),
        ))
    }

    /// One for each shot; not finite where there is none, which the search passes over.
    fn inverse_depths(&self) -> Vec<InverseDepthPoint> {
        let nothing = InverseDepthPoint {
            origin: Vector3::zeros(),
            direction: Vector3::zeros(),
            rho: f64::NAN,
            variance: f64::NAN,
        };
        self.shots.iter().map(|s| s.point.map_or(nothing, |depth| depth.point)).collect()
    }
}
