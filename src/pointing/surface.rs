//! What a pixel's ray ends at: a plane, the surface that a point cloud samples, or a known distance.
//! All three become a plane about the target with a covariance.

use nalgebra::{Matrix4, Matrix4x3, Vector3};

use super::cloud::CloudSurface;
use crate::error::{Error, Result};
use crate::geometry::{Plane, Ray};
use crate::pose::PlaneEstimate;

/// Who measured a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum MeasuredBy {
    /// Anything else: its errors have nothing to do with the rig's.
    #[default]
    Others = 0,
    /// The laser of this rig, from where it stands now: what is wrong with the rig is wrong with the
    /// surface too, and largely cancels when the same rig aims at it.
    ThisRig = 1,
}

/// A plane n . x = d of the world and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UncertainPlane {
    pub plane: Plane,
    /// Of n's three components and d (metres), in that order, positive semi-definite; zero: exact.
    /// Of a plane that this rig measured only what its shots' noise makes of it.
    pub covariance: Matrix4<f64>,
    pub measured_by: MeasuredBy,
}

impl UncertainPlane {
    /// A plane that is known exactly.
    pub fn exact(plane: Plane) -> Self {
        Self { plane, covariance: Matrix4::zeros(), measured_by: MeasuredBy::Others }
    }

    /// A plane that was fitted, with its covariance.
    pub fn estimated(estimate: &PlaneEstimate, measured_by: MeasuredBy) -> Self {
        let plane = estimate.plane();
        let (n, d) = (plane.normal, plane.distance);
        // normal = m / |m|, distance = 1 / |m| for m = normal / distance.
        let mut by = Matrix4x3::zeros();
        by.fixed_view_mut::<3, 3>(0, 0).copy_from(&((nalgebra::Matrix3::identity() - n * n.transpose()) * d));
        by.fixed_view_mut::<1, 3>(3, 0).copy_from(&(-n.transpose() * (d * d)));
        Self { plane, covariance: by * estimate.covariance * by.transpose(), measured_by }
    }

    /// # Errors
    /// `NotFinite`, `InvalidArgument`: no unit normal, or a covariance that is none.
    pub fn validate(&self) -> Result<()> {
        let Plane { normal, distance } = &self.plane;
        if let Some(index) = normal.iter().chain([distance]).position(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name: "plane", index });
        }
        if (normal.norm() - 1.0).abs() > 1e-6 {
            return Err(Error::invalid("plane", format!("its normal has length {}, not 1", normal.norm())));
        }
        crate::calibrate::uncertainty::semidefinite(&self.covariance, "plane covariance")
    }
}

/// Where along its ray a pixel's target is.
#[derive(Debug, Clone, Copy)]
pub enum Depth<'a> {
    /// On a plane: the floor, a wall, the road.
    Plane(&'a UncertainPlane),
    /// On the surface that a point cloud samples.
    Cloud(&'a CloudSurface),
    /// At a known distance along the ray, with its standard deviation; metres.
    Distance { metres: f64, sigma: f64 },
}

/// The surface ends or bends about the ray, or its points are too far apart to tell: the stated
/// covariance is that of the surface that was taken for the target's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Distance of what the ray may meet instead, metres; `None`: nothing that the cloud shows.
    pub other: Option<f64>,
}

/// The surface about a target, as a plane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Meeting {
    pub plane: UncertainPlane,
    pub edge: Option<Edge>,
}

impl Depth<'_> {
    /// `cone`: standard deviation of the ray's direction, radians.
    pub(super) fn meeting(&self, ray: &Ray, cone: f64) -> Result<Meeting> {
        match *self {
            Self::Plane(plane) => {
                plane.validate()?;
                Ok(Meeting { plane: *plane, edge: None })
            }
            Self::Cloud(cloud) => {
                let hit = cloud.hit(ray, cone)?;
                Ok(Meeting {
                    plane: across(ray, hit.distance, hit.normal, hit.variance, cloud.measured_by()),
                    edge: hit.edge,
                })
            }
            Self::Distance { metres, sigma } => {
                if let Some(index) = [metres, sigma].iter().position(|v| !v.is_finite()) {
                    return Err(Error::NotFinite { name: "distance", index });
                }
                if metres <= 0.0 || sigma < 0.0 {
                    return Err(Error::invalid("distance", format!("{metres} m, standard deviation {sigma} m")));
                }
                Ok(Meeting { plane: across(ray, metres, ray.direction, sigma * sigma, MeasuredBy::Others), edge: None })
            }
        }
    }
}

/// The plane through a ray's point whose distance along the ray has a variance.
fn across(ray: &Ray, distance: f64, normal: Vector3<f64>, variance: f64, measured_by: MeasuredBy) -> UncertainPlane {
    let mut covariance = Matrix4::zeros();
    covariance[(3, 3)] = variance * normal.dot(&ray.direction).powi(2);
    UncertainPlane { plane: Plane { normal, distance: normal.dot(&ray.at(distance)) }, covariance, measured_by }
}
