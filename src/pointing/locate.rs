//! The way back: from a pixel of the head's camera to the fixed camera's picture.

use nalgebra::Vector3;

use super::chain::Noise;
use super::surface::{Depth, Edge};
use super::sweep::distances;
use super::{Click, Pointer, check_distance};
use crate::calibrate::{UncertainPixel, UncertainPoint};
use crate::error::{Error, Result};
use crate::geometry::Ray;

/// Samples of a ray whose depth is unknown.
const SAMPLES: usize = 65;
/// A point is hidden by a surface that is nearer by this many standard deviations and this part of its
/// distance.
const HIDDEN_SIGMAS: f64 = 4.0;
const HIDDEN_PART: f64 = 0.02;

/// Where the fixed camera sees what the head camera sees.
#[derive(Debug, Clone, PartialEq)]
pub struct Located {
    pub pixel: UncertainPixel,
    /// In the world.
    pub point: UncertainPoint,
    /// From the head camera's centre, metres.
    pub distance: f64,
    pub edge: Option<Edge>,
    /// The cloud has a surface between the fixed camera and the point.
    pub hidden: bool,
}

/// A place on the image of the head camera's ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocatedAlong {
    /// From the head camera's centre, metres.
    pub distance: f64,
    pub pixel: UncertainPixel,
}

impl Pointer {
    /// Where the fixed camera sees what the head camera, at the given readings (and zoom, on the
    /// curve's scale), sees at a pixel.
    ///
    /// # Errors
    /// As [`aim`](Self::aim); `Unreachable` also for a point outside the fixed camera's picture,
    /// `BehindCamera` and `OutsideLens` for one that it cannot see.
    pub fn locate(&self, at: [f64; 2], zoom: Option<f64>, click: &Click, depth: &Depth<'_>) -> Result<Located> {
        let (noise, ray) = self.head_ray(at, zoom, click)?;
        let meeting = depth.meeting(&ray.ray(), ray.angular_deviation(&noise))?;
        let noise = noise.with_plane(&meeting.plane);
        let point = noise.meet(&ray, &meeting.plane, |p| self.surface_by(p, meeting.plane.measured_by))?;
        let Ray { origin, direction } = ray.ray();
        let distance = (point.value - origin).norm();
        let covariance = noise.covariance_of(&point);
        check_distance(distance, direction.dot(&(covariance * direction)).max(0.0).sqrt())?;
        let pixel = noise.pixel(&noise.fixed_pixel(self.calibration.pixel_with_derivatives(&point.value)?, &point));
        if !self.calibration.camera.contains(&pixel.pixel) {
            return Err(Error::Unreachable {
                reason: format!(
                    "the point is outside the fixed camera's picture, at ({:.1}, {:.1})",
                    pixel.pixel.x, pixel.pixel.y
                ),
            });
        }
        let hidden = match depth {
            Depth::Cloud(cloud) => {
                let centre = self.calibration.camera.centre();
                let offset: Vector3<f64> = point.value - centre;
                let own = offset.norm();
                let sight = Ray { origin: centre, direction: offset / own };
                let deviation = sight.direction.dot(&(covariance * sight.direction)).max(0.0);
                cloud.hit(&sight, 0.0).is_ok_and(|hit| {
                    own - hit.distance > HIDDEN_SIGMAS * (deviation + hit.variance).sqrt() + HIDDEN_PART * own
                })
            }
            _ => false,
        };
        let point = UncertainPoint { point: point.value, covariance };
        Ok(Located { pixel, point, distance, edge: meeting.edge, hidden })
    }

    /// The part of the fixed camera's picture that what the head camera sees at a pixel can be in, for
    /// distances from the nearest to the farthest (metres, from the head camera): what is in the
    /// picture of 65 samples, evenly spread in inverse distance, nearest first.
    ///
    /// # Errors
    /// `Unreachable` when all of it is outside the picture; otherwise as [`locate`](Self::locate).
    pub fn locate_along(
        &self,
        at: [f64; 2],
        zoom: Option<f64>,
        click: &Click,
        range: [f64; 2],
    ) -> Result<Vec<LocatedAlong>> {
        let (noise, ray) = self.head_ray(at, zoom, click)?;
        let see = |distance: f64| {
            let point = noise.at(&ray, distance);
            let seen = self.calibration.pixel_with_derivatives(&point.value).ok()?;
            let pixel = noise.pixel(&noise.fixed_pixel(seen, &point));
            self.calibration.camera.contains(&pixel.pixel).then_some(LocatedAlong { distance, pixel })
        };
        let found: Vec<LocatedAlong> = distances(range, SAMPLES)?.into_iter().filter_map(see).collect();
        if found.is_empty() {
            let reason = format!("from {} to {} m the ray is outside the fixed camera's picture", range[0], range[1]);
            return Err(Error::Unreachable { reason });
        }
        Ok(found)
    }

    fn head_ray(&self, at: [f64; 2], zoom: Option<f64>, click: &Click) -> Result<(Noise, super::chain::LinearRay)> {
        if let Some(index) = at.iter().position(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name: "pan and tilt", index });
        }
        click.validate(self.rig.width, self.rig.height)?;
        let lens = self.lens(zoom)?;
        let noise = lens.noise(&Noise::new(&self.joint, &click.covariance, self.head_sigma));
        let ray =
            noise.head_ray(&lens.model, &self.station, at, &click.pixel).ok_or(Error::OutsideLens { index: 0 })?;
        Ok((noise, ray))
    }
}
