//! What a calibrated camera was measured with, in the form that figures and sentences need.

use nalgebra::{Vector2, Vector3};

use crate::adjust::Adjusted;
use crate::calibrate::{BoardCalibration, Boards, Calibration, Correspondences, Observation};
use crate::error::{Error, Result};

/// A point that the camera saw.
#[derive(Debug, Clone, Copy)]
pub struct SeenPoint {
    pub pixel: Vector2<f64>,
    /// Metres, world frame; `None` at infinity or not known.
    pub world: Option<Vector3<f64>>,
    /// Measured minus predicted, px; may be infinite.
    pub residual: Vector2<f64>,
    pub used: bool,
}

/// A segment that the camera saw of a line.
#[derive(Debug, Clone, Copy)]
pub struct SeenLine {
    pub ends: [Vector2<f64>; 2],
    pub used: bool,
}

#[derive(Debug, Clone, Default)]
pub struct Seen {
    pub points: Vec<SeenPoint>,
    pub lines: Vec<SeenLine>,
}

impl Seen {
    pub fn used(&self) -> impl Iterator<Item = &SeenPoint> {
        self.points.iter().filter(|p| p.used)
    }

    /// All pixels that were used: points, and the ends of segments.
    pub fn used_pixels(&self) -> Vec<Vector2<f64>> {
        let ends = self.lines.iter().filter(|l| l.used).flat_map(|l| l.ends);
        self.used().map(|p| p.pixel).chain(ends).collect()
    }

    /// Depths of the used points along the camera's axis, metres, ascending.
    pub fn depths(&self, calibration: &Calibration) -> Vec<f64> {
        let depth = |x: Vector3<f64>| calibration.camera.pose.apply(&x).z;
        let mut depths: Vec<f64> = self.used().filter_map(|p| p.world).map(depth).filter(|z| z.is_finite()).collect();
        depths.sort_by(f64::total_cmp);
        depths
    }
}

/// The measurements of a set with what the calibration made of each.
///
/// # Errors
/// `InvalidArgument` for a set that is not the calibration's.
pub fn of_set(calibration: &Calibration, set: &Correspondences) -> Result<Seen> {
    let camera = &calibration.camera;
    if set.len() != calibration.residuals.len() {
        let reason = format!("{} measurements, the calibration has {}", set.len(), calibration.residuals.len());
        return Err(Error::invalid("correspondences", reason));
    }
    if (set.width(), set.height()) != (camera.width, camera.height) {
        let reason = format!("{} x {}, the camera has {} x {}", set.width(), set.height(), camera.width, camera.height);
        return Err(Error::invalid("correspondences", reason));
    }
    let mut seen = Seen::default();
    for ((observation, residual), used) in
        set.observations().iter().zip(&calibration.residuals).zip(&calibration.inliers)
    {
        let point = |pixel: &Vector2<f64>, world| SeenPoint { pixel: *pixel, world, residual: *residual, used: *used };
        match observation {
            Observation::Point { world, pixel, .. } => seen.points.push(point(pixel, Some(*world))),
            Observation::Shot { shot, pixel, .. } => seen.points.push(point(pixel, shot.point())),
            Observation::Line(line) => seen.lines.push(SeenLine { ends: line.ends, used: *used }),
        }
    }
    Ok(seen)
}

/// All corners of all boards. Their places in space are the boards', of which the lens does not depend
/// on depths as a camera in a room does: they are left out.
///
/// # Errors
/// `InvalidArgument` for boards that are not the calibration's.
pub fn of_boards(found: &BoardCalibration, boards: &Boards) -> Result<Seen> {
    let calibration = &found.calibration;
    let corners = boards.views().iter().flat_map(|v| v.corners());
    let count = corners.clone().count();
    if count != calibration.residuals.len() || boards.views().len() != found.views.len() {
        let reason = format!(
            "{count} corners in {} views, the calibration has {} in {}",
            boards.views().len(),
            calibration.residuals.len(),
            found.views.len()
        );
        return Err(Error::invalid("boards", reason));
    }
    let points = corners.zip(&calibration.residuals).zip(&calibration.inliers);
    let points =
        points.map(|((c, residual), used)| SeenPoint { pixel: c.pixel, world: None, residual: *residual, used: *used });
    Ok(Seen { points: points.collect(), lines: Vec::new() })
}

/// The sightings of one camera of a survey.
pub fn of_survey(survey: &Adjusted, camera: usize) -> Seen {
    let Some(calibration) = survey.cameras.get(camera) else { return Seen::default() };
    let shots = survey.input.shots().iter().enumerate();
    let sightings = shots.flat_map(|(shot, s)| {
        let own = s.sightings.iter().filter(move |sighting| sighting.camera == camera);
        own.map(move |sighting| (shot, sighting.pixel))
    });
    let points = sightings.zip(&calibration.residuals).zip(&calibration.inliers);
    let points = points.map(|(((shot, pixel), residual), used)| SeenPoint {
        pixel,
        world: survey.shot_point(shot).ok().map(|(point, _)| point),
        residual: *residual,
        used: *used,
    });
    Seen { points: points.collect(), lines: Vec::new() }
}
