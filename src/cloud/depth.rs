//! What a calibrated camera would measure of a cloud or a surface: its depth map.

use nalgebra::Vector3;

use super::lens::Lens;
use super::raster::{meet, rasterise};
use crate::error::Result;
use crate::geometry::{Camera, CloudNoise, Mesh, PointCloud};
use crate::image::DepthMap;

/// No triangle.
pub(super) const NONE: u32 = u32::MAX;

/// A depth map with its noise.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthView {
    pub map: DepthMap,
    /// m^2, row by row, first order in the points' noise; 0 where there is no depth. `None` when the
    /// points' noise is unknown.
    pub variance: Option<Vec<f32>>,
}

/// The nearest triangle of each pixel.
pub(super) struct Nearest {
    /// Metres; infinite where there is none.
    pub depth: Vec<f32>,
    pub triangle: Vec<u32>,
}

impl Nearest {
    pub fn of(mesh: &Mesh, lens: &Lens<'_>) -> Self {
        let pixels = lens.width * lens.height;
        let mut nearest = Self { depth: vec![f32::INFINITY; pixels], triangle: vec![NONE; pixels] };
        rasterise(mesh, lens, &mut |hit| {
            let depth = hit.depth as f32;
            if depth < nearest.depth[hit.pixel] {
                nearest.depth[hit.pixel] = depth;
                nearest.triangle[hit.pixel] = hit.triangle as u32;
            }
        });
        nearest
    }
}

/// Depths of the cloud's points in a camera's image, the nearest one in each pixel. Pixels that no
/// point falls into have no depth, and what is far shows between the points of what is near: for a
/// picture without gaps use a surface, [`mesh_depth`].
///
/// # Errors
/// The cloud's and the camera's own; `InvalidArgument` for more than 2^25 pixels.
pub fn cloud_depth(cloud: &PointCloud, camera: &Camera) -> Result<DepthView> {
    cloud.validate()?;
    let lens = Lens::new(camera, false)?;
    let pixels = lens.width * lens.height;
    let (mut depth, mut nearest) = (vec![0f32; pixels], vec![NONE; pixels]);
    for (i, position) in cloud.positions.iter().enumerate() {
        let x = camera.pose.apply(position);
        let Some(at) = lens.pixel(&x).filter(|at| x.z > 0.0 && camera.contains(at)) else { continue };
        // On the outermost border a pixel's half rounds outwards.
        let [u, v] = [(at.x.round() as usize).min(lens.width - 1), (at.y.round() as usize).min(lens.height - 1)];
        let pixel = v * lens.width + u;
        if nearest[pixel] == NONE || (x.z as f32) < depth[pixel] {
            depth[pixel] = x.z as f32;
            nearest[pixel] = i as u32;
        }
    }
    let axis = camera.pose.rotation.row(2).transpose();
    let variance = variances(&cloud.noise, &nearest, |i, _| cloud.noise.covariance(i).map(|c| axis.dot(&(c * axis))));
    Ok(DepthView { map: DepthMap::new(camera.width, camera.height, depth)?, variance })
}

/// Depths of a surface in a camera's image, at the centre of every pixel. Both sides of a triangle are
/// seen, and hide what is behind them; where there is no surface there is no depth.
///
/// The variance is that of the triangle's plane where the pixel's ray meets it: with weights b_i of
/// the corners there, normal n and ray d (d_z = 1), sum b_i^2 n^T C_i n / (n . d)^2. What the true
/// surface does between the points is not in it.
///
/// # Errors
/// The mesh's and the camera's own; `InvalidArgument` for more than 2^25 pixels.
pub fn mesh_depth(mesh: &Mesh, camera: &Camera) -> Result<DepthView> {
    mesh.validate()?;
    let lens = Lens::new(camera, true)?;
    let Nearest { depth, triangle } = Nearest::of(mesh, &lens);
    let noise = &mesh.vertices.noise;
    let variance = variances(noise, &triangle, |triangle, pixel| plane_variance(mesh, &lens, triangle, pixel));
    let known = depth.into_iter().map(|z| if z.is_finite() { z } else { 0.0 }).collect();
    Ok(DepthView { map: DepthMap::new(camera.width, camera.height, known)?, variance })
}

fn variances(noise: &CloudNoise, ids: &[u32], of: impl Fn(usize, usize) -> Option<f64>) -> Option<Vec<f32>> {
    let variance =
        |(pixel, id): (usize, &u32)| if *id == NONE { 0.0 } else { of(*id as usize, pixel).unwrap_or(0.0) as f32 };
    (*noise != CloudNoise::Unknown).then(|| ids.iter().enumerate().map(variance).collect())
}

fn plane_variance(mesh: &Mesh, lens: &Lens<'_>, triangle: usize, pixel: usize) -> Option<f64> {
    let pose = &lens.camera.pose;
    let corners = mesh.corners(triangle).map(|v| pose.apply(&v));
    let d = lens.direction(pixel)?;
    let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
    let (weights, _) = meet(&corners, &d).unwrap_or(([1.0 / 3.0; 3], 0.0));
    let world: Vector3<f64> = pose.rotation.transpose() * normal;
    let mut sum = 0.0;
    for (vertex, weight) in mesh.triangles[triangle].iter().zip(weights) {
        sum += weight * weight * world.dot(&(mesh.vertices.noise.covariance(*vertex as usize)? * world));
    }
    let variance = sum / normal.dot(&d).powi(2);
    Some(if variance.is_finite() { variance.min(f64::from(f32::MAX)) } else { f64::from(f32::MAX) })
}
