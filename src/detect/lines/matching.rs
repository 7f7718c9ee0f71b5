//! Which line in space is which segment, by a first camera.
//!
//! Both ends of the question have covariances, and so has the first camera: how far a segment is off a
//! line's image is measured as a calibration would, lens and all, and in standard deviations. What is
//! told apart by less than chance is not matched: a wrong match costs more than a missing one.

use nalgebra::{Matrix2, Vector2};

use super::LineSegment;
use crate::calibrate::ObservedLine;
use crate::calibrate::line_measurement::LineMeasurement;
use crate::error::{Error, Result};
use crate::geometry::{Camera, MeasuredLine};

/// Points of a line's image between its ends: so many show where it leaves the view.
const POINTS: usize = 33;
/// Sine of the greatest angle between a segment and a line's image, 15 degrees.
const MAX_SINE: f64 = 0.26;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineMatchOptions {
    /// Standard deviation of the first camera's projections, pixels.
    pub camera_sigma: f64,
    /// Greatest distance in standard deviations.
    pub max_distance: f64,
    /// A match is certain when the squared distance (in standard deviations) of the next candidate is
    /// greater by this.
    pub min_lead: f64,
    /// Least share of the shorter one of segment and image that they have in common, 0 to 1.
    pub min_overlap: f64,
    /// Must the bright side be the same? It is where both cameras see the same surfaces on both sides
    /// of a line; directions of the lines must then be those of `lift_segments`.
    pub same_polarity: bool,
}

impl Default for LineMatchOptions {
    fn default() -> Self {
        Self { camera_sigma: 2.0, max_distance: 3.0, min_lead: 9.0, min_overlap: 0.5, same_polarity: true }
    }
}

impl LineMatchOptions {
    fn check(&self) -> Result<()> {
        let positive = |name, value: f64| {
            let right = value > 0.0 && value.is_finite();
            if right { Ok(()) } else { Err(Error::invalid(name, format!("{value} is not positive"))) }
        };
        positive("camera_sigma", self.camera_sigma)?;
        positive("max_distance", self.max_distance)?;
        if !(self.min_lead >= 0.0 && self.min_lead.is_finite()) {
            return Err(Error::invalid("min_lead", format!("{} is negative", self.min_lead)));
        }
        if !(0.0..=1.0).contains(&self.min_overlap) {
            return Err(Error::invalid("min_overlap", format!("{} is no share", self.min_overlap)));
        }
        Ok(())
    }
}

/// A line and its segment, by their indices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineMatch {
    pub line: usize,
    pub segment: usize,
    /// Of the segment's points from the line's image, to its right seen in the segment's direction, px.
    pub residual: Vector2<f64>,
    /// Squared distance in standard deviations: of two degrees of freedom.
    pub distance: f64,
}

impl LineMatch {
    /// What a calibration takes.
    pub fn observation(&self, lines: &[MeasuredLine], segments: &[LineSegment]) -> Option<ObservedLine> {
        Some(observed(lines.get(self.line)?, segments.get(self.segment)?))
    }
}

/// A line and the segment that it is, as a calibration takes them.
pub(crate) fn observed(line: &MeasuredLine, segment: &LineSegment) -> ObservedLine {
    ObservedLine {
        point: line.point,
        direction: line.direction,
        covariance: Some(line.covariance),
        ends: segment.points,
        end_covariances: Some(segment.covariances()),
    }
}

/// Matches lines in space with the segments of a camera's image, each with one at most, in the order of
/// the lines. Lines that the camera does not see, and those with more than one candidate (but for
/// pieces of one line), have none.
///
/// # Errors
/// `InvalidArgument` for impossible options or a camera that is none; `NotFinite` for lines or
/// segments that are not finite.
pub fn match_lines(
    lines: &[MeasuredLine],
    camera: &Camera,
    segments: &[LineSegment],
    options: &LineMatchOptions,
) -> Result<Vec<LineMatch>> {
    options.check()?;
    camera.validate()?;
    for (index, l) in lines.iter().enumerate() {
        let numbers = l.point.iter().chain(l.direction.iter()).chain(l.covariance.iter()).chain(&l.extent);
        if !numbers.into_iter().all(|v| v.is_finite()) {
            return Err(Error::NotFinite { name: "lines", index });
        }
    }
    super::check_segments(segments)?;
    let mut candidates = Vec::new();
    for (line, l) in lines.iter().enumerate() {
        let Some(seen) = Image::of(l, camera) else { continue };
        let near = segments.iter().enumerate().filter(|(_, s)| seen.is_near(s, options));
        candidates.extend(near.filter_map(|(segment, s)| {
            let (residual, distance) = distance(l, s, camera, options.camera_sigma)?;
            Some(LineMatch { line, segment, residual, distance })
        }));
    }
    let within = options.max_distance * options.max_distance;
    // The next best of a line or of a segment; pieces of one line do not stand against each other.
    let certain = |m: &&LineMatch| {
        m.distance <= within
            && candidates.iter().filter(|c| (c.line == m.line) != (c.segment == m.segment)).all(|rival| {
                rival.distance >= m.distance + options.min_lead
                    || (rival.line == m.line && same_line(&segments[m.segment], &segments[rival.segment], m, rival))
                    || (rival.segment == m.segment && same_in_space(&lines[m.line], &lines[rival.line], m, rival))
            })
    };
    Ok(candidates.iter().filter(certain).copied().collect())
}

/// Distances of a segment's points from a line's image, px, and squared in standard deviations of all
/// that is noisy.
fn distance(
    line: &MeasuredLine,
    segment: &LineSegment,
    camera: &Camera,
    camera_sigma: f64,
) -> Option<(Vector2<f64>, f64)> {
    let (off, covariance) = LineMeasurement::new(&observed(line, segment), 1.0, false).residual(camera)?;
    let covariance = covariance + Matrix2::identity() * (camera_sigma * camera_sigma);
    let distance = off.dot(&(covariance.try_inverse()? * off));
    distance.is_finite().then_some((off, distance))
}

/// The better one of two pieces of one line in the image.
fn same_line(a: &LineSegment, b: &LineSegment, this: &LineMatch, rival: &LineMatch) -> bool {
    let n = a.normal();
    let straight = b.points.iter().all(|p| n.dot(&(p - a.points[0])).abs() < 1.0);
    straight && a.direction().dot(&b.direction()) > 0.99 && wins(a.support, b.support, this.segment, rival.segment)
}

/// The better one of two pieces of one line in space.
fn same_in_space(a: &MeasuredLine, b: &MeasuredLine, this: &LineMatch, rival: &LineMatch) -> bool {
    let sigma2 = (a.covariance + b.covariance).fixed_view::<3, 3>(0, 0).trace();
    let off = b.ends().map(|x| (x - a.point).cross(&a.direction).norm_squared());
    let length = |l: &MeasuredLine| l.extent[1] - l.extent[0];
    a.direction.dot(&b.direction).abs() > 0.99
        && off.iter().all(|d| *d < 9.0 * sigma2)
        && wins(length(a), length(b), this.line, rival.line)
}

fn wins(a: f64, b: f64, i: usize, j: usize) -> bool {
    a > b || (a == b && i < j)
}

/// The piece of a line's image that is in view: a polygon, since lenses bend it.
struct Image(Vec<Vector2<f64>>);

impl Image {
    fn of(line: &MeasuredLine, camera: &Camera) -> Option<Self> {
        let [from, to] = line.extent;
        let seen = |i: usize| {
            let s = from + (to - from) * (i as f64 / (POINTS - 1) as f64);
            let x = line.at(s);
            let pixel = camera.project(&x).filter(|p| camera.contains(p))?;
            // Far outside the view a lens polynomial folds back into the image.
            let ray = camera.back_project(&pixel)?;
            ((x - ray.origin).normalize().dot(&ray.direction) > 0.999).then_some(pixel)
        };
        let points: Vec<_> = (0..POINTS).filter_map(seen).collect();
        (points.len() >= 2).then_some(Self(points))
    }

    /// Alike in direction, with enough in common: the cheap tests. How far it is away is another.
    fn is_near(&self, s: &LineSegment, options: &LineMatchOptions) -> bool {
        let (u, n) = (s.direction(), s.normal());
        let along = |p: &Vector2<f64>| u.dot(&(p - s.ends[0]));
        // The part of the image beside the segment.
        let beside = |w: &[Vector2<f64>]| {
            let (a, b) = (along(&w[0]), along(&w[1]));
            let (low, high) = (a.min(b).max(0.0), a.max(b).min(s.length()));
            (high - low).max(0.0)
        };
        let common: f64 = self.0.windows(2).map(beside).sum();
        let length: f64 = self.0.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        if common <= 0.0 || common < options.min_overlap * length.min(s.length()) {
            return false;
        }
        let (Some(first), Some(last)) = (self.0.first(), self.0.last()) else { return false };
        let chord = (last - first) / (last - first).norm();
        let turned = u.perp(&chord).abs();
        let forward = u.dot(&chord) > 0.0;
        let off = self.0.iter().map(|p| n.dot(&(p - s.ends[0])).abs()).fold(f64::INFINITY, f64::min);
        // Lines in space may be far less certain than the camera: a generous limit.
        let reach = 20.0 * options.max_distance * options.camera_sigma;
        turned <= MAX_SINE && off <= reach && (forward || !options.same_polarity)
    }
}
