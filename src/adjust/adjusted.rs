//! The answer of a joint adjustment: estimates, their covariance, and what follows from them.

use faer::Mat;
use nalgebra::{DMatrix, Matrix2, Matrix3, Matrix4, Matrix4x3, SMatrix, Vector2, Vector3};

use super::check;
use super::eliminate::Eliminated;
use super::layout::{Layout, PLANE, State};
use super::linearise::{Problem, ShotPoint, Witness};
use super::problem::{AdjustOptions, Adjustment, camera_name, compact_rows, plane_name, rig_name, station_name};
use super::weakness;
use crate::calibrate::check::SURE;
use crate::calibrate::{Calibration, FitCheck, Weakness};
use crate::error::{Error, Result};
use crate::geometry::linalg::symmetric_eigen3;
use crate::geometry::{InverseDepthPoint, Plane, RIG_PARAMETERS, RigModel, Rigid};

/// What the solver leaves.
#[derive(Debug, Clone)]
pub(super) struct Solution {
    pub state: State,
    pub layout: Layout,
    /// Per view, in the problem's order.
    pub used: Vec<bool>,
    /// Of the layout's columns.
    pub covariance: DMatrix<f64>,
    /// Normal equations, lower triangle.
    pub normal: Mat<f64>,
}

/// A survey solved. It holds its input, so that it can be solved again with the same bits.
#[derive(Debug, Clone)]
pub struct Adjusted {
    pub input: Adjustment,
    pub options: AdjustOptions,
    pub rig: RigModel,
    /// Station to world.
    pub stations: Vec<Rigid>,
    /// Each camera with its own block of the covariance, which contains what is not known of the rig.
    /// Residuals and inliers are of its sightings in the order of the shots.
    pub cameras: Vec<Calibration>,
    /// In the world.
    pub planes: Vec<Plane>,
    /// Of all parameters: the rig's ([`RigParameter`](crate::geometry::RigParameter)), six of every
    /// station (as [`Station::prior`](super::Station::prior)), those of every camera (as
    /// [`Calibration::covariance`]), then three of every plane: what moves its normal along its
    /// [`tangents`](Plane::tangents), radians, and its distance, metres. Rows of fixed parameters are zero.
    pub covariance: DMatrix<f64>,
    /// Per shot: was the head camera's spot used?
    pub head_inliers: Vec<bool>,
    /// Per shot: did it hit the plane that it was said to hit? False where none was named.
    pub plane_inliers: Vec<bool>,
    /// Noise by the residuals' median over stated noise, at least 1.
    pub noise_factor: f64,
    /// Does the model fit?
    pub check: FitCheck,
    pub iterations: usize,
    solution: Solution,
    eliminated: Vec<Eliminated>,
    columns: Vec<Vec<usize>>,
    locals: usize,
}

impl Adjusted {
    pub(super) fn new(
        problem: &Problem<'_>,
        solution: Solution,
        eliminated: Vec<Eliminated>,
        chi2: f64,
        factor: f64,
        iterations: usize,
        options: &AdjustOptions,
    ) -> Result<Self> {
        let check = check::check(problem, &solution, chi2);
        let mut adjusted = Self {
            input: problem.input.clone(),
            options: options.clone(),
            rig: solution.state.rig,
            stations: solution.state.stations.clone(),
            cameras: Vec::new(),
            planes: solution.state.planes.clone(),
            covariance: DMatrix::zeros(0, 0),
            head_inliers: Vec::new(),
            plane_inliers: Vec::new(),
            noise_factor: factor,
            check,
            iterations,
            columns: (0..problem.batch_count()).map(|b| problem.columns_of(b).to_vec()).collect(),
            locals: problem.local_count(),
            solution,
            eliminated,
        };
        // Noise that the residuals show beyond the stated one belongs to the covariance.
        let excess = adjusted.check.spread();
        if adjusted.check.probability < SURE && excess > 1.0 {
            adjusted.solution.covariance *= excess * excess;
        }
        adjusted.covariance = adjusted.expand();
        let mut residuals = vec![Vec::new(); adjusted.input.cameras().len()];
        let mut inliers = residuals.iter().map(|_| Vec::new()).collect::<Vec<Vec<bool>>>();
        for shot in 0..adjusted.input.shots().len() {
            let (mut head, mut plane) = (false, false);
            let point = problem.point(&adjusted.solution.state, shot);
            for v in problem.span(shot) {
                let view = &problem.views[v];
                let used = adjusted.solution.used[v];
                let camera = match view.by {
                    Some(Witness::Camera(camera)) => camera,
                    Some(Witness::Plane(_)) => {
                        plane = used;
                        continue;
                    }
                    None => {
                        head = used;
                        continue;
                    }
                };
                let rho = adjusted.solution.state.locals[shot][0];
                let predicted = adjusted.solution.state.cameras[camera].project_homogeneous(&point.xyz, rho);
                residuals[camera].push(predicted.map_or(Vector2::repeat(f64::INFINITY), |p| view.pixel - p.pixel));
                inliers[camera].push(used);
            }
            adjusted.head_inliers.push(head);
            adjusted.plane_inliers.push(plane);
        }
        adjusted.demand_stations(options.max_station_deviation)?;
        let places = adjusted.places();
        for (index, (residuals, inliers)) in residuals.into_iter().zip(inliers).enumerate() {
            let calibration = adjusted.camera(index, &places, residuals, inliers);
            let k = &calibration.camera.intrinsics;
            let deviation = calibration.covariance[(0, 0)].max(calibration.covariance[(1, 1)]).sqrt() / k.fx;
            if deviation.is_nan() || deviation > options.max_focal_deviation {
                let detail = format!(
                    "the focal length is determined to {:.1} % only (limit {:.1} %)",
                    100.0 * deviation,
                    100.0 * options.max_focal_deviation
                );
                let fault = Error::degenerate(crate::error::Degeneracy::NoRelief, detail);
                return Err(Error::in_camera(index, fault));
            }
            adjusted.cameras.push(calibration);
        }
        Ok(adjusted)
    }

    /// Refuses a station that can slide or turn: where parallel walls are all that ties it, say.
    fn demand_stations(&self, limit: f64) -> Result<()> {
        let places = self.places();
        for (index, (_, free)) in self.solution.layout.stations.iter().enumerate() {
            let mut ranges: Vec<f64> = self
                .input
                .shots()
                .iter()
                .zip(&self.solution.state.locals)
                .filter(|(shot, local)| shot.station == index && local[0] > 0.0)
                .map(|(_, local)| 1.0 / local[0])
                .collect();
            if free.is_empty() || ranges.is_empty() {
                continue;
            }
            let middle = ranges.len() / 2;
            let range = *ranges.select_nth_unstable_by(middle, f64::total_cmp).1;
            let first = places[1 + index].start;
            for (what, at, most, unit) in
                [("turns about", first, limit, "rad"), ("slides along", first + 3, limit * range, "m")]
            {
                let block = self.covariance.fixed_view::<3, 3>(at, at).into_owned();
                let Some((values, vectors)) = symmetric_eigen3(&block) else { continue };
                let worst = (0..3).max_by(|a, b| values[*a].total_cmp(&values[*b])).unwrap_or(0);
                let deviation = values[worst].max(0.0).sqrt();
                if deviation.is_nan() || deviation > most {
                    let v = vectors[worst];
                    let detail = format!(
                        "station {index} {what} ({:.2}, {:.2}, {:.2}): it is determined there to {deviation:.2} {unit} only \
                         (limit {most:.2}); shots of planes across that direction, or of a shared camera, would tell",
                        v.x, v.y, v.z
                    );
                    return Err(Error::degenerate(crate::error::Degeneracy::IllConditioned, detail));
                }
            }
        }
        Ok(())
    }

    fn camera(
        &self,
        index: usize,
        places: &[std::ops::Range<usize>],
        residuals: Vec<Vector2<f64>>,
        inliers: Vec<bool>,
    ) -> Calibration {
        let place = &places[1 + self.stations.len() + index];
        let used = inliers.iter().filter(|i| **i).count();
        let sum: f64 = residuals.iter().zip(&inliers).filter(|(_, i)| **i).map(|(r, _)| r.norm_squared()).sum();
        Calibration {
            camera: self.solution.state.cameras[index],
            covariance: self.covariance.view((place.start, place.start), (place.len(), place.len())).into_owned(),
            residuals,
            inliers,
            rms: if used > 0 { (sum / used as f64).sqrt() } else { 0.0 },
            noise_factor: self.noise_factor,
            condition: self.condition(),
            iterations: self.iterations,
            check: self.check.clone(),
        }
    }

    fn condition(&self) -> f64 {
        let c = &self.solution.covariance;
        let h = &self.solution.normal;
        // Largest variance at unit diagonal: within the number of parameters of the condition number.
        (0..c.nrows()).map(|i| c[(i, i)] * h[(i, i)]).fold(1.0, f64::max)
    }

    /// Where each group begins and ends in [`covariance`](Self::covariance): the rig, every station,
    /// every camera, every plane.
    pub fn places(&self) -> Vec<std::ops::Range<usize>> {
        let cameras = self.solution.state.cameras.iter().map(|c| 11 + c.distortion.coefficients().len());
        let lengths = std::iter::once(RIG_PARAMETERS).chain(self.stations.iter().map(|_| 6)).chain(cameras);
        let lengths = lengths.chain(self.planes.iter().map(|_| PLANE));
        let mut next = 0;
        let place = |length| {
            next += length;
            next - length..next
        };
        lengths.map(place).collect()
    }

    /// Names of all parameters in the order of [`covariance`](Self::covariance).
    pub fn parameter_names(&self) -> Vec<String> {
        let mut names: Vec<String> = (0..RIG_PARAMETERS).map(rig_name).collect();
        names.extend((0..self.stations.len()).flat_map(|s| (0..6).map(move |i| station_name(s, i))));
        for (index, camera) in self.solution.state.cameras.iter().enumerate() {
            let coefficients = camera.distortion.coefficients().len();
            names.extend((0..11 + coefficients).map(|i| camera_name(index, i, coefficients)));
        }
        names.extend((0..self.planes.len()).flat_map(|p| (0..PLANE).map(move |i| plane_name(p, i))));
        names
    }

    /// The columns' covariance over all parameters.
    fn expand(&self) -> DMatrix<f64> {
        let places = self.places();
        let layout = &self.solution.layout;
        // Of each parameter the column that moves it.
        let mut columns: Vec<Option<usize>> = vec![None; places.last().map_or(0, |p| p.end)];
        for (column, parameter) in layout.rig.iter().enumerate() {
            columns[*parameter] = Some(column);
        }
        for ((first, free), place) in layout.stations.iter().zip(&places[1..]) {
            for (k, parameter) in free.iter().enumerate() {
                columns[place.start + parameter] = Some(first + k);
            }
        }
        for (index, c) in layout.cameras.iter().enumerate() {
            let place = &places[1 + self.stations.len() + index];
            let rows = compact_rows(self.solution.state.cameras[index].distortion.coefficients().len());
            for (k, unknown) in c.freedom.unknowns.iter().enumerate() {
                for (row, _) in rows.iter().enumerate().filter(|(_, p)| unknown.moves(**p)) {
                    columns[place.start + row] = Some(c.first + k);
                }
            }
        }
        for (first, place) in layout.planes.iter().zip(&places[1 + self.stations.len() + layout.cameras.len()..]) {
            for k in 0..PLANE {
                columns[place.start + k] = Some(first + k);
            }
        }
        let c = &self.solution.covariance;
        let at = |i: usize, j: usize| columns[i].zip(columns[j]).map_or(0.0, |(i, j)| c[(i, j)]);
        DMatrix::from_fn(columns.len(), columns.len(), at)
    }

    /// Covariance of a plane's unit normal and distance, in this order (metres).
    ///
    /// # Errors
    /// `InvalidArgument` for an index that does not exist.
    pub fn plane_covariance(&self, plane: usize) -> Result<Matrix4<f64>> {
        let Some(it) = self.planes.get(plane) else {
            return Err(Error::invalid("plane", format!("{plane} of {}", self.planes.len())));
        };
        let [a, b] = it.tangents();
        let mut by = Matrix4x3::zeros();
        by.fixed_view_mut::<3, 1>(0, 0).copy_from(&a);
        by.fixed_view_mut::<3, 1>(0, 1).copy_from(&b);
        by[(3, 2)] = 1.0;
        let first = self.places()[1 + self.stations.len() + self.cameras.len() + plane].start;
        let own = self.covariance.fixed_view::<PLANE, PLANE>(first, first).into_owned();
        Ok(by * own * by.transpose())
    }

    /// Covariance of the rig's parameters.
    pub fn rig_covariance(&self) -> SMatrix<f64, RIG_PARAMETERS, RIG_PARAMETERS> {
        self.covariance.fixed_view::<RIG_PARAMETERS, RIG_PARAMETERS>(0, 0).into_owned()
    }

    /// Solves the input again: the same bits.
    pub fn resolve(&self) -> Result<Self> {
        super::adjust(&self.input, &self.options)
    }

    /// What the data determine worst. `None` only when the eigenvalues cannot be had.
    pub fn weakest(&self) -> Option<Weakness> {
        weakness::weakest(&self.input, &self.solution)
    }

    /// The estimated point of a shot in the world (metres) with its covariance (m^2), which contains
    /// that of rig, station and cameras.
    ///
    /// # Errors
    /// `InvalidArgument` for an index that does not exist, `Unreachable` for a shot at infinity or
    /// one of which no spot was used.
    pub fn shot_point(&self, shot: usize) -> Result<(Vector3<f64>, Matrix3<f64>)> {
        let eliminated = self
            .eliminated
            .get(shot)
            .ok_or_else(|| Error::invalid("shot", format!("{shot} of {}", self.eliminated.len())))?;
        let local = self.solution.state.locals[shot];
        if !eliminated.is_used() || local[0] <= 1e-9 {
            return Err(Error::Unreachable { reason: format!("shot {shot} has no depth") });
        }
        let point = super::linearise::point(&self.input, &self.solution.layout, &self.solution.state, shot);
        let columns = &self.columns[eliminated.batch];
        let (position, by_common, by_local) = metric(&point, local[0]);
        let width = columns.len();
        // L^-T of each local's derivative, so that both parts of the covariance are sums of squares.
        let mut total = DMatrix::<f64>::zeros(3, width);
        for (k, by) in by_common.iter().enumerate() {
            total.set_column(k, by);
        }
        let mut covariance = Matrix3::zeros();
        let by_root = eliminated.by_root(&by_local, self.locals);
        for (a, by) in by_root.iter().enumerate().take(self.locals) {
            covariance += by * by.transpose();
            for (k, b) in eliminated.coupling[a * width..(a + 1) * width].iter().enumerate() {
                let column = total.column(k) - by * *b;
                total.set_column(k, &column);
            }
        }
        let c = &self.solution.covariance;
        let block = DMatrix::from_fn(width, width, |i, j| c[(columns[i], columns[j])]);
        covariance += (&total * block * total.transpose()).fixed_view::<3, 3>(0, 0);
        Ok((position, covariance))
    }

    /// Measures a new spot of the head camera with the adjusted rig: its point in the world (metres)
    /// with its covariance (m^2), the rig's and the station's included.
    ///
    /// # Errors
    /// `InvalidArgument` (station, spot, covariance), `Unreachable` at or beyond infinity.
    pub fn measure(
        &self,
        station: usize,
        pan: f64,
        tilt: f64,
        spot: &Vector2<f64>,
        covariance: &Matrix2<f64>,
    ) -> Result<(Vector3<f64>, Matrix3<f64>)> {
        let pose = self
            .stations
            .get(station)
            .ok_or_else(|| Error::invalid("station", format!("{station} of {}", self.stations.len())))?;
        if !(pan.is_finite() && tilt.is_finite()) {
            return Err(Error::NotFinite { name: "pan and tilt", index: 0 });
        }
        let measured = self.rig.measure(pan, tilt, spot, covariance)?.point;
        let far = || Error::Unreachable { reason: "the spot lies at or beyond infinity".into() };
        let own = measured.point().filter(|_| measured.rho > 1e-9).ok_or_else(far)?;
        let InverseDepthPoint { rho, variance, .. } = measured;
        let weight = covariance.try_inverse().ok_or_else(|| Error::invalid("covariance", "is singular"))?;
        let moved = self.rig.measured_point_by(pan, tilt, rho, &weight).ok_or_else(far)?;
        let mut by = DMatrix::<f64>::zeros(3, RIG_PARAMETERS + 6);
        for (i, moved) in moved.iter().enumerate() {
            by.set_column(i, &(pose.rotation * moved));
        }
        let arm = pose.rotation * own;
        for i in 0..3 {
            by.set_column(RIG_PARAMETERS + i, &Vector3::ith(i, 1.0).cross(&arm));
            by.set_column(RIG_PARAMETERS + 3 + i, &Vector3::ith(i, 1.0));
        }
        let first = self.places()[1 + station].start;
        let at = |k: usize| if k < RIG_PARAMETERS { k } else { first + k - RIG_PARAMETERS };
        let n = RIG_PARAMETERS + 6;
        let block = DMatrix::from_fn(n, n, |i, j| self.covariance[(at(i), at(j))]);
        let along = pose.rotation * (self.rig.laser_ray(pan, tilt, [0.0; 2]).direction / (-rho * rho));
        let total = (&by * block * by.transpose()).fixed_view::<3, 3>(0, 0) + along * along.transpose() * variance;
        Ok((pose.apply(&own), total))
    }
}

/// The metric point with its derivatives by the ray's columns and by the shot's own unknowns.
fn metric(point: &ShotPoint, rho: f64) -> (Vector3<f64>, Vec<Vector3<f64>>, [Vector3<f64>; 3]) {
    let position = point.xyz / rho;
    let by_common = point.by_common.iter().take(point.common).map(|by| by / rho).collect();
    let [depth, pan, tilt] = point.by_local;
    (position, by_common, [(depth - position) / rho, pan / rho, tilt / rho])
}
