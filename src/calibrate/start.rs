//! First estimates of the camera: by consensus over projection matrices when the intrinsics are
//! free (over radial cameras when a lens is fitted too), over poses when the lens is known.

use nalgebra::{Matrix2, Matrix3, Matrix3x4, Vector2, Vector3};

use super::consensus::{CHI2_MEDIAN, Consensus, Model, Solver, few, median, search};
use super::division_camera::image_centre;
use super::freedom::blank_distortion;
use super::lens_fit::{self, WIDEST};
use super::measurement::{Measurement, PointMeasurement};
use super::radial_alignment::{self, Alignment, ThirdRow};
use super::{DistortionModel, dlt};
use crate::control::Cancel;
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::linalg::symmetric_eigen3;
use crate::geometry::rigid::nearest_rotation;
use crate::geometry::{Camera, Distortion, Intrinsics, Rigid, homography};

/// Squared distance, in units of the noise, within which points are taken for a lens's fit.
const SEVERAL: f64 = 16.0;

pub(crate) struct Start {
    pub camera: Camera,
    /// Noise in units of the assumed one.
    pub noise_factor: f64,
}

/// How a start is looked for.
#[derive(Clone, Copy)]
pub(crate) struct Search<'a> {
    pub width: u32,
    pub height: u32,
    /// The lens that is fitted.
    pub model: DistortionModel,
    pub robust: bool,
    /// All measurements count where none of them is an outlier, not only as many as a start needs.
    pub whole: bool,
    pub seed: u64,
    pub cancel: &'a Cancel,
}

impl Search<'_> {
    fn run<M: Model>(&self, measurements: &[&Measurement], solver: &Solver<'_, M>) -> Result<Consensus<M>> {
        let found = if self.robust {
            search(measurements, solver, self.seed, self.cancel)?
        } else {
            let some = if self.whole { measurements.to_vec() } else { few(measurements, self.seed) };
            (solver.fit)(&some).map(|p| Consensus::of(p, median(&some, &p, &mut Vec::new())))
        };
        found.filter(|c| c.noise_factor.is_finite()).ok_or_else(|| {
            Error::degenerate(Degeneracy::IllConditioned, "no projection matrix puts the points in front of a camera")
        })
    }

    /// Free intrinsics: DLT, then K, R, t from it.
    pub fn projection(&self, measurements: &[&Measurement]) -> Result<Start> {
        let frame = frame_of(&few(measurements, self.seed))?;
        let minimal = |sample: &[&Measurement]| dlt::minimal(&frame, sample.first_chunk()?);
        let found =
            self.run(measurements, &Solver { sample: dlt::MIN_POINTS, minimal: &minimal, fit: &dlt::inverse_depth })?;
        let (intrinsics, pose) = super::decompose::decompose(&found.projection)?;
        let camera = self.camera(intrinsics, blank_distortion(self.model), pose);
        Ok(Start { camera, noise_factor: found.noise_factor })
    }

    /// Free intrinsics and lens: radial alignment, best first, with and without a free principal
    /// point (which little relief does not determine).
    ///
    /// # Errors
    /// `TooFewPoints` below seven points: lines, which the lens bends, are no help here.
    pub fn radial(&self, all: &[&Measurement]) -> Result<Vec<Start>> {
        let measurements: &[&Measurement] = &all.iter().filter(|m| m.as_point().is_some()).cloned().collect::<Vec<_>>();
        if measurements.len() < radial_alignment::MIN_POINTS {
            return Err(Error::TooFewPoints { given: measurements.len(), needed: radial_alignment::MIN_POINTS });
        }
        let centre = image_centre(self.width, self.height);
        let (few, many) = lens_fit::terms(self.model);
        let alignment = |terms| {
            Alignment::of(measurements, centre, terms)
                .ok_or_else(|| Error::degenerate(Degeneracy::ImageCollapsed, "the image points coincide"))
        };
        let (coarse, fine) = (alignment(few)?, alignment(many)?);
        let minimal = |sample: &[&Measurement]| coarse.fit_once(sample, ThirdRow::Free);
        let fit = |half: &[&Measurement]| fine.fit(half, ThirdRow::Free);
        let solver = Solver { sample: radial_alignment::MIN_POINTS, minimal: &minimal, fit: &fit };
        let found = self.run(measurements, &solver)?;
        let limit = SEVERAL * found.noise_factor * found.noise_factor;
        let near: Vec<&Measurement> =
            measurements.iter().filter(|m| found.projection.distance(m) <= limit).copied().collect();
        let reach = near.iter().flat_map(|m| m.pixels()).map(|m| (m - centre).norm()).fold(0.0, f64::max);
        let fits = [Some(found.projection), fine.fit(&near, ThirdRow::Free), fine.fit(&near, ThirdRow::Square)];
        let cameras = fits.iter().flatten().filter_map(|r| {
            let camera = lens_fit::camera(r, self.model, reach, self.width, self.height)?;
            let mut distances: Vec<f64> = all.iter().map(|m| m.distance(&camera)).collect();
            let middle = distances.len() / 2;
            let median = *distances.select_nth_unstable_by(middle, f64::total_cmp).1;
            median.is_finite().then(|| Start { camera, noise_factor: (median / CHI2_MEDIAN).sqrt() })
        });
        let mut starts: Vec<Start> = cameras.collect();
        starts.sort_by(|a, b| a.noise_factor.total_cmp(&b.noise_factor));
        if starts.is_empty() {
            return Err(Error::degenerate(
                Degeneracy::IllConditioned,
                "no camera with this lens sees half of the points",
            ));
        }
        Ok(starts)
    }

    /// Known lens: the pose alone, also from a plane.
    pub fn pose(&self, measurements: &[&Measurement], lens: &(Intrinsics, Distortion), planar: bool) -> Result<Start> {
        // A fisheye lens sees what the plane of the pose's closed form cannot hold: the refinement does.
        let wide = matches!(lens.1, Distortion::Fisheye(_));
        let mut normalised = Vec::with_capacity(measurements.len());
        for (i, m) in measurements.iter().enumerate() {
            match normalise(m, lens, i) {
                Ok(n) if wide && n.pixels().iter().any(|p| p.norm() > WIDEST) => {}
                Err(_) if wide => {}
                n => normalised.push(n?),
            }
        }
        let sample = if planar { 4 } else { dlt::MIN_POINTS };
        if normalised.len() < sample {
            return Err(Error::TooFewPoints { given: normalised.len(), needed: sample });
        }
        let normalised: Vec<&Measurement> = normalised.iter().collect();
        let found = if planar {
            self.run(&normalised, &Solver { sample, minimal: &pose_from_plane, fit: &pose_from_plane })?
        } else {
            let frame = frame_of(&normalised)?;
            let minimal = |sample: &[&Measurement]| nearest_pose(&dlt::minimal(&frame, sample.first_chunk()?)?);
            let fit = |some: &[&Measurement]| nearest_pose(&dlt::inverse_depth(some)?);
            self.run(&normalised, &Solver { sample, minimal: &minimal, fit: &fit })?
        };
        let p = found.projection;
        let pose = Rigid { rotation: p.fixed_columns::<3>(0).into(), translation: p.column(3).into() };
        Ok(Start { camera: self.camera(lens.0, lens.1, pose), noise_factor: found.noise_factor })
    }

    /// Starts with guessed focal lengths, for sets on which the DLT gives an absurd camera.
    pub fn guesses(&self, measurements: &[&Measurement]) -> Vec<Start> {
        let (w, h) = (self.width as f64, self.height as f64);
        [0.6, 1.0, 1.6, 2.5, 4.0]
            .iter()
            .filter_map(|f| {
                let lens = (Intrinsics::new(f * w, (w - 1.0) * 0.5, (h - 1.0) * 0.5), blank_distortion(self.model));
                self.pose(measurements, &lens, false).ok()
            })
            .collect()
    }

    fn camera(&self, intrinsics: Intrinsics, distortion: Distortion, pose: Rigid) -> Camera {
        Camera { width: self.width, height: self.height, intrinsics, distortion, pose }
    }
}

/// The measurement on the normalised plane of a known lens.
fn normalise(m: &Measurement, lens: &(Intrinsics, Distortion), index: usize) -> Result<Measurement> {
    let (k, distortion) = lens;
    let outside = || Error::invalid("uv", format!("point {index} is outside the lens model"));
    m.map_pixels(|pixel, covariance| {
        let ideal = distortion.undistort(k.to_normalised(pixel)).ok_or_else(outside)?;
        let jacobian = distortion.distort_with_jacobian(ideal).ok_or_else(outside)?.by_point;
        let inverse = (Matrix2::new(k.fx, k.skew, 0.0, k.fy) * jacobian).try_inverse().ok_or_else(outside)?;
        Ok((ideal, inverse * covariance * inverse.transpose()))
    })
}

fn frame_of(measurements: &[&Measurement]) -> Result<dlt::Frame> {
    dlt::Frame::of(measurements)
        .ok_or_else(|| Error::degenerate(Degeneracy::ImageCollapsed, "the image points coincide"))
}

/// [R | t] nearest to a projection matrix of normalised pixels.
fn nearest_pose(p: &Matrix3x4<f64>) -> Option<Matrix3x4<f64>> {
    let m: Matrix3<f64> = p.fixed_columns::<3>(0).into();
    let rotation = nearest_rotation(&m)?;
    let scale = (rotation.transpose() * m).trace() / 3.0;
    matrix(&rotation, &(p.column(3) / scale))
}

/// [R | t] from points in a plane by their homography.
fn pose_from_plane(measurements: &[&Measurement]) -> Option<Matrix3x4<f64>> {
    let measurements: Vec<&PointMeasurement> = measurements.iter().filter_map(|m| m.as_point()).collect();
    let points: Vec<Vector3<f64>> = measurements.iter().filter_map(|m| m.position()).collect();
    if points.len() != measurements.len() || points.len() < 4 {
        return None;
    }
    let centre = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let scatter = points.iter().map(|x| (x - centre) * (x - centre).transpose()).sum::<Matrix3<f64>>();
    let (_, [e1, _, normal]) = symmetric_eigen3(&scatter)?;
    let e2 = normal.cross(&e1);
    let flat: Vec<Vector2<f64>> =
        points.iter().map(|x| Vector2::new(e1.dot(&(x - centre)), e2.dot(&(x - centre)))).collect();
    let pixels: Vec<Vector2<f64>> = measurements.iter().map(|m| m.pixel).collect();
    let h = homography::estimate(&flat, &pixels).ok()?;
    let scale = 2.0 / (h.column(0).norm() + h.column(1).norm());
    // The centroid is in front of the camera: fixes the homography's sign.
    let h = h * scale.copysign(h.m33);
    let (r1, r2): (Vector3<f64>, Vector3<f64>) = (h.column(0).into(), h.column(1).into());
    let plane_rotation = nearest_rotation(&Matrix3::from_columns(&[r1, r2, r1.cross(&r2)]))?;
    let rotation = plane_rotation * Matrix3::from_rows(&[e1.transpose(), e2.transpose(), normal.transpose()]);
    let translation = Vector3::from(h.column(2)) - rotation * centre;
    matrix(&rotation, &translation)
}

fn matrix(rotation: &Matrix3<f64>, translation: &Vector3<f64>) -> Option<Matrix3x4<f64>> {
    let mut p = Matrix3x4::zeros();
    p.fixed_columns_mut::<3>(0).copy_from(rotation);
    p.set_column(3, translation);
    p.iter().all(|v| v.is_finite()).then_some(p)
}
