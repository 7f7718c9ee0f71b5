//! The laser's light: where the beam falls, what glossy faces throw on, and how a camera sees it.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::scene::{self, Person, SurfacePoint};
use crate::geometry::Camera;

/// Standard deviation of the beam's Gaussian profile at its exit and its growth: a beam of 2 mm
/// that spreads by 1 mrad (both 1/e^2 diameters).
const EXIT_DEVIATION: f64 = 0.5e-3;
const DIVERGENCE: f64 = 0.25e-3;

/// Red, green and blue of the laser's light: a red pointer, seen a little by the other filters.
const COLOUR: [f64; 3] = [1.0, 0.12, 0.06];

/// Light of a spot on white paper seen square on from 1 m, in grey levels summed over its pixels.
const POWER: f64 = 4e4;

/// The laser's beam in the room.
#[derive(Debug, Clone, Copy)]
pub struct Beam {
    pub origin: Vector3<f64>,
    /// Unit.
    pub direction: Vector3<f64>,
}

/// A place where the beam falls.
#[derive(Debug, Clone, Copy)]
pub struct Glow {
    pub surface: SurfacePoint,
    /// Share of the laser's light that is scattered here.
    share: f64,
    /// Covariance of the beam's footprint on the surface, m^2.
    footprint: Matrix3<f64>,
}

/// A spot in a camera's image.
#[derive(Debug, Clone, Copy)]
pub struct SpotImage {
    pub centre: Vector2<f64>,
    /// Point spread included, px^2.
    pub covariance: Matrix2<f64>,
    /// Blue, green, red in grey levels, summed over the spot's pixels.
    pub light: [f64; 3],
}

impl Beam {
    /// The beam's first footprint and, when that is on a glossy face, its second, with `reflection`
    /// the share of the light that is thrown on. (A footprint that reaches over an edge is taken as
    /// flat.)
    pub fn glows(&self, reflection: f64, person: Option<&Person>) -> (Glow, Option<Glow>) {
        let surface = scene::trace(&self.origin, &self.direction, person);
        let length = (surface.position - self.origin).norm();
        let thrown_on = if surface.glossy { reflection } else { 0.0 };
        let main =
            Glow { surface, share: 1.0 - thrown_on, footprint: footprint(&self.direction, &surface.normal, length) };
        let second = (thrown_on > 0.0).then(|| {
            let way = self.direction - surface.normal * (2.0 * surface.normal.dot(&self.direction));
            let start = surface.position + surface.normal * 1e-6;
            let next = scene::trace(&start, &way, person);
            let length = length + (next.position - start).norm();
            Glow { surface: next, share: thrown_on, footprint: footprint(&way, &next.normal, length) }
        });
        (main, second)
    }
}

/// Covariance on a surface of a round beam that arrives along `way` after `length` metres.
fn footprint(way: &Vector3<f64>, normal: &Vector3<f64>, length: f64) -> Matrix3<f64> {
    let deviation = EXIT_DEVIATION + DIVERGENCE * length;
    // Points of the beam's cross section slide along the beam onto the surface.
    let across = Matrix3::identity() - way * way.transpose();
    let slide = Matrix3::identity() - way * normal.transpose() / normal.dot(way);
    slide * across * slide.transpose() * (deviation * deviation)
}

impl Glow {
    /// Pixel where a camera (pose from the room) sees it; `None` when hidden or outside the image.
    pub fn pixel(&self, camera: &Camera, person: Option<&Person>) -> Option<Vector2<f64>> {
        let position = &self.surface.position;
        let pixel = camera.project(position).filter(|p| camera.contains(p))?;
        scene::visible(&camera.centre(), position, person).then_some(pixel)
    }

    /// Its picture in a camera (pose from the room) with a point spread in px, under a laser of
    /// `power` (1: the usual one).
    pub fn image(&self, camera: &Camera, point_spread: f64, power: f64, person: Option<&Person>) -> Option<SpotImage> {
        let centre = self.pixel(camera, person)?;
        let by_point = camera.project_with_jacobian(&self.surface.position)?.by_point;
        let covariance =
            by_point * self.footprint * by_point.transpose() + Matrix2::identity() * (point_spread * point_spread);
        let way = camera.centre() - self.surface.position;
        // A matt surface: the light in the spot's image falls with the cosine and the squared distance.
        let cosine = (self.surface.normal.dot(&way) / way.norm()).max(0.0);
        let light = POWER * power * self.share * cosine / way.norm_squared();
        let [r, g, b] = std::array::from_fn(|k| light * COLOUR[k] * self.surface.albedo[k]);
        Some(SpotImage { centre, covariance, light: [b, g, r] })
    }
}
