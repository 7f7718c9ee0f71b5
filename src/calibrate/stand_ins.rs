//! Points that stand for measurements where sets of points are judged or normalised: a point's own
//! position, and two points on every line.

use nalgebra::{Matrix3, Vector3};

use super::line_measurement::LineMeasurement;
use super::measurement::{Measurement, PointMeasurement};

/// A position and its covariance.
pub(crate) type StandIn = (Vector3<f64>, Matrix3<f64>);

/// Lines as a set: where they come nearest to each other and to the points, and how far they are
/// from there.
pub(crate) struct Bundle {
    pub centre: Vector3<f64>,
    /// Root mean square distance of points and lines from the centre: 0 when they all meet in it.
    pub size: f64,
}

impl Bundle {
    pub fn of<'a>(
        points: impl Iterator<Item = Vector3<f64>> + Clone,
        lines: impl Iterator<Item = &'a LineMeasurement> + Clone,
    ) -> Option<Self> {
        // Least squares on the distances; parallel lines leave the centre free along them, where the
        // mean of their points is as good as any.
        let across = |line: &LineMeasurement| Matrix3::identity() - line.direction * line.direction.transpose();
        let given = points.clone().chain(lines.clone().map(|l| l.point));
        let n = given.clone().count() as f64;
        let mean = given.sum::<Vector3<f64>>() / n;
        let anchor = 1e-9 * n;
        let (mut h, mut g) = (Matrix3::identity() * anchor, Vector3::zeros());
        for x in points.clone() {
            h += Matrix3::identity();
            g += x - mean;
        }
        for line in lines.clone() {
            h += across(line);
            g += across(line) * (line.point - mean);
        }
        let centre = mean + h.cholesky()?.solve(&g);
        let squares = points.map(|x| (x - centre).norm_squared()).sum::<f64>()
            + lines.map(|line| (across(line) * (line.point - centre)).norm_squared()).sum::<f64>();
        let size = (squares / n).sqrt();
        (size.is_finite() && centre.iter().all(|v| v.is_finite())).then_some(Self { centre, size })
    }
}

/// Of points with a position, and of lines: on both sides of their point nearest to the bundle's
/// centre, a bundle's size away, whatever point of the line the user named. `None` for numbers that
/// overflow.
pub(crate) fn stand_ins(
    measurements: &[&Measurement],
    position: impl Fn(&PointMeasurement) -> Option<StandIn>,
) -> Option<Vec<StandIn>> {
    let mut found: Vec<StandIn> = Vec::with_capacity(measurements.len());
    found.extend(measurements.iter().filter_map(|m| position(m.as_point()?)));
    let lines = || measurements.iter().filter_map(|m| m.as_line());
    if lines().next().is_none() {
        return Some(found);
    }
    let bundle = Bundle::of(found.iter().map(|(x, _)| *x), lines())?;
    for line in lines() {
        let near = line.parameter_near(&bundle.centre);
        for s in [near - bundle.size, near + bundle.size] {
            let covariance = line
                .errors()
                .iter()
                .map(|[point, direction]| {
                    let e = point + direction * s;
                    e * e.transpose()
                })
                .sum();
            found.push((line.point + line.direction * s, covariance));
        }
    }
    Some(found)
}
