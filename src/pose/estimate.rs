//! The verb: pose of one station relative to another from the roof edges that both measured.

use nalgebra::{DMatrix, SMatrix, Vector3, Vector4};

use super::plane_registration::{MatchedPlane, maximum_likelihood, plane_to_plane};
use super::procrustes::procrustes;
use super::roof_edge::RoofEdges;
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::rigid::log;
use crate::geometry::{Line3, Plane, Rigid};

/// How the pose is computed from the edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum PoseMethod {
    /// The thesis's: rigid Procrustes on points of the edges.
    #[default]
    RoofEdgeProcrustes = 0,
    /// Closed form on the planes themselves; about 1.6 times more accurate (maths.md section 7).
    PlaneToPlane = 1,
    /// The planes weighted by their full covariances; the most accurate.
    MaximumLikelihood = 2,
}

/// How the pose of a station is estimated.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseOptions {
    pub method: PoseMethod,
    /// Distance along an edge of the second point on it, metres; `None`: the mean distance of the
    /// edges from the stations. The thesis's 1 mm weighs directions far too little.
    pub lever: Option<f64>,
    /// Planes that meet at a smaller angle make no edge, radians.
    pub min_plane_angle: f64,
    /// Two edges at a smaller angle are taken as parallel, radians.
    pub min_edge_angle: f64,
    /// Refuse stations whose planes, registered, still differ by more than this (radians; distances
    /// count relative to the edges' mean distance) and by more than five standard deviations.
    pub max_disagreement: f64,
}

impl Default for PoseOptions {
    fn default() -> Self {
        Self {
            method: PoseMethod::default(),
            lever: None,
            min_plane_angle: 5f64.to_radians(),
            min_edge_angle: 5f64.to_radians(),
            max_disagreement: 0.2,
        }
    }
}

/// The pose of station b in station a's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseEstimate {
    /// Station b's frame to station a's, X_a = R X_b + t: thesis eq. (24). Its translation is the
    /// position of b in a's frame. The inverse, [`a_to_b`](Self::a_to_b), is eq. (25).
    pub b_to_a: Rigid,
    /// Root mean square distance between the two stations' points on the edges, metres.
    pub residual_rms: f64,
    /// Largest difference that is left between two matched planes: of their unit normals and of their
    /// distances relative to the edges' mean distance.
    pub disagreement: f64,
    /// Covariance of (w, t) of `b_to_a`: w the rotation vector in `R <- exp([w]x) R`, radians about
    /// the axes of a's frame; t the position of b, metres. First order in those of the planes.
    pub covariance: SMatrix<f64, 6, 6>,
    /// How much better the best-determined direction is than the worst; 1 at best. It grows without
    /// bound as the edges (or, for the methods on planes, the normals) become dependent.
    pub condition: f64,
}

impl PoseEstimate {
    /// Station a's frame to station b's: thesis eq. (25), the extrinsics of a camera at b.
    pub fn a_to_b(&self) -> Rigid {
        self.b_to_a.inverse()
    }

    /// Position of station b in a's frame, metres.
    pub fn position(&self) -> Vector3<f64> {
        self.b_to_a.translation
    }

    /// Angle between the two stations' frames, radians.
    pub fn rotation_angle(&self) -> f64 {
        log(&self.b_to_a.rotation).norm()
    }
}

/// Estimates the pose of `station_b` relative to `station_a` from two or more edges, listed in the
/// same order in both, each as the same ordered pair of planes.
///
/// [`PoseMethod::RoofEdgeProcrustes`] takes, for every pair of edges that are not parallel, the feet
/// of their common perpendicular and the points one lever along each edge, weighted by the squared
/// sine of the pair's angle because the feet's noise grows with its inverse; two edges give the
/// thesis's four points.
///
/// Errors: `InvalidArgument` for unequal or too few edges, for bad options, and for stations that
/// did not see the same planes (edges or planes in another order); `Degenerate` for planes of an
/// edge that are nearly parallel and for edges that all are.
pub fn estimate_pose_roof_edges(
    station_a: &RoofEdges,
    station_b: &RoofEdges,
    options: &PoseOptions,
) -> Result<PoseEstimate> {
    let registration = Registration::new(station_a, station_b, options)?;
    let normals = registration.normals();
    let solution = registration.solve(&normals)?;
    let covariance = registration.covariance(&normals, &solution.b_to_a)?;
    let disagreement = registration.check_agreement(&normals, &solution.b_to_a, &covariance)?;
    Ok(PoseEstimate {
        b_to_a: solution.b_to_a,
        residual_rms: solution.residual_rms,
        disagreement,
        covariance: covariance.fixed_view::<6, 6>(0, 0).into_owned(),
        condition: solution.condition,
    })
}

/// The n of every plane of station a and of station b.
type Normals = [Vec<Vector3<f64>>; 2];

struct Solution {
    b_to_a: Rigid,
    residual_rms: f64,
    condition: f64,
}

/// All that stays fixed while the planes are moved to propagate their covariance.
struct Registration<'a> {
    stations: [&'a RoofEdges; 2],
    options: &'a PoseOptions,
    /// Mean distance of the edges from the stations, metres.
    distance: f64,
    lever: f64,
    /// Pairs of edges that are not parallel, with their weights.
    pairs: Vec<(usize, usize, f64)>,
    /// Indices of the same plane in both stations.
    matches: Vec<(usize, usize)>,
    /// Condition of the best pair of directions.
    condition: f64,
}

impl<'a> Registration<'a> {
    fn new(a: &'a RoofEdges, b: &'a RoofEdges, options: &'a PoseOptions) -> Result<Self> {
        check_options(options)?;
        let (count, other) = (a.edges().len(), b.edges().len());
        if count != other {
            return Err(Error::invalid("station_b", format!("{other} edges, station_a has {count}")));
        }
        if count < 2 {
            return Err(Error::invalid("station_a", format!("{count} edges, at least 2 are needed")));
        }
        let lines = [a.lines(options.min_plane_angle)?, b.lines(options.min_plane_angle)?];
        let distance = lines.iter().flatten().map(|e| e.line.point.norm()).sum::<f64>() / (2 * count) as f64;
        let lever = options.lever.unwrap_or(distance);
        let (mut pairs, mut condition) = (Vec::new(), f64::INFINITY);
        for i in 0..count {
            for j in i + 1..count {
                let direction = |s: usize, k: usize| lines[s][k].line.direction;
                let sines = [0, 1].map(|s| direction(s, i).cross(&direction(s, j)).norm());
                if sines.iter().all(|s| *s > options.min_edge_angle.sin()) {
                    pairs.push((i, j, sines[0] * sines[1]));
                    let cosine = direction(0, i).dot(&direction(0, j)).abs();
                    condition = condition.min((1.0 + cosine) / (1.0 - cosine));
                }
            }
        }
        if pairs.is_empty() {
            let limit = options.min_edge_angle.to_degrees();
            return Err(Error::degenerate(
                Degeneracy::Parallel,
                format!("all edges are parallel to {limit:.1} degrees: the translation along them is unobservable"),
            ));
        }
        let mut matches = Vec::new();
        for pair in a.edges().iter().zip(b.edges()).flat_map(|(e, f)| [(e[0], f[0]), (e[1], f[1])]) {
            if !matches.contains(&pair) {
                matches.push(pair);
            }
        }
        Ok(Self { stations: [a, b], options, distance, lever, pairs, matches, condition })
    }

    fn normals(&self) -> Normals {
        self.stations.map(|s| s.planes().iter().map(|p| p.n).collect())
    }

    fn solve(&self, normals: &Normals) -> Result<Solution> {
        let [points_a, points_b] = [self.edge_points(0, normals)?, self.edge_points(1, normals)?];
        let weights: Vec<f64> = self.pairs.iter().flat_map(|(_, _, w)| [*w; 4]).collect();
        let fit = procrustes(&points_b, &points_a, Some(&weights))?;
        if self.options.method == PoseMethod::RoofEdgeProcrustes {
            let condition = fit.condition.max(self.condition);
            return Ok(Solution { b_to_a: fit.transform, residual_rms: fit.rms, condition });
        }
        let planes = self.matched_planes(normals);
        let (mut b_to_a, condition) = plane_to_plane(&planes)?;
        if self.options.method == PoseMethod::MaximumLikelihood {
            b_to_a = maximum_likelihood(&planes, b_to_a)?.b_to_a;
        }
        let square = |((a, b), w): ((&Vector3<f64>, &Vector3<f64>), &f64)| w * (b_to_a.apply(b) - a).norm_squared();
        let total: f64 = points_a.iter().zip(&points_b).zip(&weights).map(square).sum();
        Ok(Solution { b_to_a, residual_rms: (total / weights.iter().sum::<f64>()).sqrt(), condition })
    }

    /// The thesis's points: for each pair of edges the feet of their common perpendicular, and the
    /// points one lever further along each edge.
    fn edge_points(&self, station: usize, normals: &Normals) -> Result<Vec<Vector3<f64>>> {
        let parallel = || Error::degenerate(Degeneracy::Parallel, "two lines, or the planes of an edge, are parallel");
        let line = |edge: usize| -> Option<Line3> {
            let [first, second] = self.stations[station].edges()[edge].map(|i| normals[station][i]);
            Plane::new(first, 1.0)?.intersect(&Plane::new(second, 1.0)?, 1e-9)
        };
        let mut points = Vec::with_capacity(4 * self.pairs.len());
        for (i, j, _) in &self.pairs {
            let (one, other) = line(*i).zip(line(*j)).ok_or_else(parallel)?;
            let (p, q) = one.common_perpendicular(&other, 1e-9).ok_or_else(parallel)?;
            points.extend([p, p + one.direction * self.lever, q, q + other.direction * self.lever]);
        }
        Ok(points)
    }

    fn matched_planes(&self, normals: &Normals) -> Vec<MatchedPlane> {
        let [a, b] = self.stations.map(|s| s.planes());
        let matched = |(i, j): &(usize, usize)| MatchedPlane {
            a: normals[0][*i],
            b: normals[1][*j],
            covariance_a: a[*i].covariance,
            covariance_b: b[*j].covariance,
        };
        self.matches.iter().map(matched).collect()
    }

    /// What is left between two matched planes: the difference of their unit normals, and that of
    /// their distances relative to the edges'.
    fn disagreements(&self, normals: &Normals, b_to_a: &Rigid) -> Vec<Vector4<f64>> {
        let difference = |(i, j): &(usize, usize)| {
            let a = Plane { normal: normals[0][*i].normalize(), distance: 1.0 / normals[0][*i].norm() };
            let b = Plane { normal: normals[1][*j].normalize(), distance: 1.0 / normals[1][*j].norm() };
            let b = b.transform(b_to_a);
            (a.normal - b.normal).push((a.distance - b.distance) / self.distance)
        };
        self.matches.iter().map(difference).collect()
    }

    /// Covariance of (w, t) and of all disagreements: central differences of the whole chain by
    /// the coordinates of every plane, times the planes' covariances.
    fn covariance(&self, normals: &Normals, b_to_a: &Rigid) -> Result<DMatrix<f64>> {
        let size = 6 + 4 * self.matches.len();
        let outputs = |normals: &Normals| -> Result<Vec<f64>> {
            let pose = self.solve(normals)?.b_to_a;
            let w = log(&(pose.rotation * b_to_a.rotation.transpose()));
            let left = self.disagreements(normals, &pose);
            let all = w.iter().chain(pose.translation.iter()).chain(left.iter().flat_map(|d| d.iter()));
            Ok(all.copied().collect())
        };
        let mut covariance = DMatrix::zeros(size, size);
        for (s, station) in self.stations.iter().enumerate() {
            for (k, plane) in station.planes().iter().enumerate() {
                if plane.covariance.amax() == 0.0 {
                    continue;
                }
                let step = 1e-6 * plane.n.norm();
                let mut jacobian = DMatrix::zeros(size, 3);
                for axis in 0..3 {
                    let at = |offset: f64| {
                        let mut moved = normals.clone();
                        moved[s][k][axis] += offset;
                        outputs(&moved)
                    };
                    for (row, (plus, minus)) in at(step)?.into_iter().zip(at(-step)?).enumerate() {
                        jacobian[(row, axis)] = (plus - minus) / (2.0 * step);
                    }
                }
                covariance += &jacobian * plane.covariance * jacobian.transpose();
            }
        }
        Ok((&covariance + covariance.transpose()) * 0.5)
    }

    /// The largest disagreement; an error when it is beyond both its limit and its noise.
    fn check_agreement(&self, normals: &Normals, b_to_a: &Rigid, covariance: &DMatrix<f64>) -> Result<f64> {
        let mut largest = 0.0f64;
        for (i, difference) in self.disagreements(normals, b_to_a).iter().enumerate() {
            let size = difference.norm();
            let variance: f64 = (0..4).map(|k| covariance[(6 + 4 * i + k, 6 + 4 * i + k)]).sum();
            if size > self.options.max_disagreement && size > 5.0 * variance.sqrt() {
                let (a, b) = self.matches[i];
                return Err(Error::invalid(
                    "station_b",
                    format!(
                        "its plane {b} is not plane {a} of station_a (they differ by {size:.2}): \
                         are edges and planes listed in the same order?"
                    ),
                ));
            }
            largest = largest.max(size);
        }
        Ok(largest)
    }
}

fn check_options(options: &PoseOptions) -> Result<()> {
    let positive = |name, value: f64| {
        if value > 0.0 && value.is_finite() {
            Ok(())
        } else {
            Err(Error::invalid(name, format!("{value} is not positive")))
        }
    };
    let angle = |name, value: f64| {
        positive(name, value)?;
        if value < std::f64::consts::FRAC_PI_2 { Ok(()) } else { Err(Error::invalid(name, "a right angle or more")) }
    };
    options.lever.map_or(Ok(()), |lever| positive("lever", lever))?;
    angle("min_plane_angle", options.min_plane_angle)?;
    angle("min_edge_angle", options.min_edge_angle)?;
    if options.max_disagreement.is_nan() || options.max_disagreement < 0.0 {
        return Err(Error::invalid("max_disagreement", format!("{}", options.max_disagreement)));
    }
    Ok(())
}
