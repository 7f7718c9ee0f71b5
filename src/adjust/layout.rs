//! Which column of the normal equations is which unknown, and the state that steps move.

use nalgebra::{DMatrix, DVector, Vector3};

use super::problem::{Adjustment, CameraSetup, camera_name, compact_rows, plane_name, rig_name, spread, station_name};
use crate::calibrate::CalibrationOptions;
use crate::calibrate::freedom::{self, Freedom};
use crate::error::Result;
use crate::geometry::rigid::{exp, log, log_by_turn, nearest_rotation};
use crate::geometry::{Camera, Plane, RIG_PARAMETERS, RigModel, Rigid};

/// The unknowns' values at one iteration.
#[derive(Debug, Clone)]
pub(super) struct State {
    pub rig: RigModel,
    pub stations: Vec<Rigid>,
    pub cameras: Vec<Camera>,
    /// In the world; the sides of their normals mean nothing.
    pub planes: Vec<Plane>,
    /// Per shot: inverse depth, and the head's true angles beyond those of the readings.
    pub locals: Vec<[f64; 3]>,
}

/// Unknowns of a plane.
pub(super) const PLANE: usize = 3;

/// Unknowns of one camera.
#[derive(Debug, Clone)]
pub(super) struct CameraColumns {
    pub first: usize,
    pub freedom: Freedom,
}

/// A prior on some columns: x ~ N(mean, information^-1).
#[derive(Debug, Clone)]
pub(super) struct ColumnPrior {
    /// Parameters of the group that something is believed of, and their information.
    pub parameters: Vec<usize>,
    pub information: DMatrix<f64>,
    pub group: Group,
    /// Columns that move them, each with its parameter: their own, and all free ones of a rotation, whose
    /// vector changes with each turn.
    pub columns: Vec<(usize, usize)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Group {
    Rig,
    Station(usize),
    Camera(usize),
}

impl Group {
    /// Its parameters that are a rotation's vector.
    fn rotation(self) -> std::ops::Range<usize> {
        match self {
            Self::Rig => 0..0,
            Self::Station(_) => 0..3,
            Self::Camera(_) => freedom::ROTATION..freedom::CENTRE,
        }
    }
}

#[derive(Debug, Clone)]
pub(super) struct Layout {
    /// The rig's free parameters, from column 0.
    pub rig: Vec<usize>,
    /// Per station its first column and its free parameters.
    pub stations: Vec<(usize, Vec<usize>)>,
    pub cameras: Vec<CameraColumns>,
    /// First column of each plane's three: turns about its tangents, distance.
    pub planes: Vec<usize>,
    pub priors: Vec<ColumnPrior>,
    pub count: usize,
}

impl Layout {
    pub fn of(input: &Adjustment) -> Result<Self> {
        let belief = input.rig_prior().belief(rig_name)?;
        let rig: Vec<usize> = (0..RIG_PARAMETERS).filter(|i| belief.free[*i]).collect();
        let mut layout = Self {
            count: rig.len(),
            rig,
            stations: Vec::new(),
            cameras: Vec::new(),
            planes: Vec::new(),
            priors: Vec::new(),
        };
        let columns: Vec<(usize, usize)> = layout.rig.iter().copied().enumerate().collect();
        layout.add_prior(Group::Rig, belief.held, &columns, &belief.information);
        for (index, station) in input.stations().iter().enumerate() {
            let belief = station.prior.belief(|i| station_name(index, i))?;
            let free: Vec<usize> = (0..6).filter(|i| belief.free[*i]).collect();
            let first = layout.count;
            layout.count += free.len();
            let columns: Vec<(usize, usize)> = free.iter().enumerate().map(|(c, p)| (first + c, *p)).collect();
            layout.add_prior(Group::Station(index), belief.held, &columns, &belief.information);
            layout.stations.push((first, free));
        }
        for (index, setup) in input.cameras().iter().enumerate() {
            layout.add_camera(index, setup)?;
        }
        layout.add_planes(input.planes().len());
        Ok(layout)
    }

    fn add_camera(&mut self, index: usize, setup: &CameraSetup) -> Result<()> {
        let mut freedom = Freedom::of(&options(setup));
        let first = self.count;
        let mut held = None;
        if let Some((camera, prior)) = &setup.prior {
            let coefficients = camera.distortion.coefficients().len();
            let belief = prior.belief(|i| camera_name(index, i, coefficients))?;
            let rows = compact_rows(coefficients);
            let fixed: Vec<usize> = rows.iter().zip(&belief.free).filter(|(_, f)| !**f).map(|(r, _)| *r).collect();
            freedom.unknowns.retain(|u| !fixed.contains(&u.parameter));
            let parameters: Vec<usize> = belief.held.iter().map(|h| rows[*h]).collect();
            held = Some((parameters, spread(&belief.information, coefficients)));
        }
        self.count += freedom.count();
        if let Some((mut parameters, information)) = held {
            let columns: Vec<(usize, usize)> =
                freedom.unknowns.iter().enumerate().map(|(k, u)| (first + k, u.parameter)).collect();
            parameters.retain(|p| columns.iter().any(|(_, own)| own == p));
            self.add_prior(Group::Camera(index), parameters, &columns, &information);
        }
        self.cameras.push(CameraColumns { first, freedom });
        Ok(())
    }

    pub fn add_planes(&mut self, count: usize) {
        for _ in 0..count {
            self.planes.push(self.count);
            self.count += PLANE;
        }
    }

    /// `columns`: all of the group, each with its parameter.
    fn add_prior(&mut self, group: Group, held: Vec<usize>, columns: &[(usize, usize)], all: &DMatrix<f64>) {
        if held.is_empty() {
            return;
        }
        let n = held.len();
        let information = DMatrix::from_fn(n, n, |i, j| all[(held[i], held[j])]);
        let turn = group.rotation();
        let turns = held.iter().any(|p| turn.contains(p));
        let moves = |p: &usize| held.contains(p) || (turns && turn.contains(p));
        let columns = columns.iter().filter(|(_, p)| moves(p)).copied().collect();
        self.priors.push(ColumnPrior { parameters: held, information, group, columns });
    }

    /// Names of all columns.
    pub fn names(&self, state: &State) -> Vec<String> {
        let mut names: Vec<String> = self.rig.iter().map(|i| rig_name(*i)).collect();
        for (index, (_, free)) in self.stations.iter().enumerate() {
            names.extend(free.iter().map(|i| station_name(index, *i)));
        }
        for (index, columns) in self.cameras.iter().enumerate() {
            let coefficients = state.cameras[index].distortion.coefficients().len();
            let compact = compact_rows(coefficients);
            names.extend(columns.freedom.unknowns.iter().map(|u| {
                let i = compact.iter().position(|r| *r == u.parameter).unwrap_or(0);
                if u.tied.is_some() {
                    format!("camera {index} focal length")
                } else {
                    camera_name(index, i, coefficients)
                }
            }));
        }
        names.extend((0..self.planes.len()).flat_map(|p| (0..PLANE).map(move |i| plane_name(p, i))));
        names
    }
}

/// The options of a calibration of this camera alone.
pub(super) fn options(setup: &CameraSetup) -> CalibrationOptions {
    CalibrationOptions {
        distortion: setup.distortion,
        fixed_lens: setup.fixed_lens,
        skew_sigma: setup.skew_sigma,
        aspect_sigma: setup.aspect_sigma,
        ..CalibrationOptions::default()
    }
}

impl ColumnPrior {
    /// Values minus the prior's mean, and their derivatives by the columns.
    pub fn offset(&self, input: &Adjustment, state: &State) -> (DVector<f64>, DMatrix<f64>) {
        let all = self.group_offset(input, state);
        let offset = DVector::from_iterator(self.parameters.len(), self.parameters.iter().map(|p| all[*p]));
        let turn = self.group.rotation();
        let by_turn = log_by_turn(&Vector3::from_iterator(all[turn.clone()].iter().copied().chain([0.0; 3])));
        let by_columns = DMatrix::from_fn(self.parameters.len(), self.columns.len(), |i, j| {
            let (p, q) = (self.parameters[i], self.columns[j].1);
            if turn.contains(&p) && turn.contains(&q) {
                by_turn[(p - turn.start, q - turn.start)]
            } else {
                f64::from(u8::from(p == q))
            }
        });
        (offset, by_columns)
    }

    /// Of all parameters of the group.
    fn group_offset(&self, input: &Adjustment, state: &State) -> Vec<f64> {
        match self.group {
            Group::Rig => {
                let (now, mean) = (state.rig.parameters(), input.rig().parameters());
                now.iter().zip(&mean).map(|(a, b)| a - b).collect()
            }
            Group::Station(i) => {
                let mean = input.stations()[i].pose.unwrap_or_default();
                let now = &state.stations[i];
                let turn = log(&(now.rotation * mean.rotation.transpose()));
                turn.iter().copied().chain((now.translation - mean.translation).iter().copied()).collect()
            }
            Group::Camera(i) => input.cameras()[i].prior.as_ref().map_or_else(Vec::new, |(mean, _)| {
                let now = &state.cameras[i];
                let (a, b) = (freedom::parameters(now), freedom::parameters(mean));
                let mut all: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
                let turn = log(&(now.pose.rotation * mean.pose.rotation.transpose()));
                all[freedom::ROTATION..freedom::CENTRE].copy_from_slice(turn.as_slice());
                all[freedom::CENTRE..].copy_from_slice((now.centre() - mean.centre()).as_slice());
                all
            }),
        }
    }
}

impl State {
    /// The state after a step of the columns; locals are left to the caller. `None` when it leaves
    /// what can be.
    pub fn moved(&self, layout: &Layout, step: &[f64]) -> Option<Self> {
        let mut by_rig = [0.0; RIG_PARAMETERS];
        for (i, s) in layout.rig.iter().zip(step) {
            by_rig[*i] = *s;
        }
        let rig = self.rig.moved(&by_rig);
        // An absurd focal length or a scale through zero is no step to take.
        let e = &rig.encoders;
        if by_rig[4].abs() > 1.0
            || e.pan_scale * self.rig.encoders.pan_scale <= 0.0
            || e.tilt_scale * self.rig.encoders.tilt_scale <= 0.0
        {
            return None;
        }
        let mut stations = self.stations.clone();
        for (station, (first, free)) in stations.iter_mut().zip(&layout.stations) {
            if free.is_empty() {
                continue;
            }
            let mut change = [0.0; 6];
            for (k, i) in free.iter().enumerate() {
                change[*i] = step[first + k];
            }
            let turn = Vector3::from_column_slice(&change[..3]);
            if turn.norm() > 1.5 {
                return None;
            }
            station.rotation = nearest_rotation(&(exp(&turn) * station.rotation))?;
            station.translation += Vector3::from_column_slice(&change[3..]);
        }
        let cameras = self
            .cameras
            .iter()
            .zip(&layout.cameras)
            .map(|(camera, c)| {
                let own = &step[c.first..c.first + c.freedom.count()];
                if own.is_empty() { Some(*camera) } else { freedom::moved(camera, &c.freedom, own) }
            })
            .collect::<Option<Vec<_>>>()?;
        let planes = self.planes.iter().zip(&layout.planes).map(|(p, first)| turned(p, &step[*first..first + PLANE]));
        let planes = planes.collect::<Option<Vec<_>>>()?;
        Some(Self { rig, stations, cameras, planes, locals: self.locals.clone() })
    }
}

/// A plane after a step: its normal moved along the tangents, and its distance.
fn turned(plane: &Plane, step: &[f64]) -> Option<Plane> {
    let [a, b] = plane.tangents();
    if step[0].hypot(step[1]) > 1.5 {
        return None;
    }
    let normal = (plane.normal + a * step[0] + b * step[1]).try_normalize(0.0)?;
    let distance = plane.distance + step[2];
    distance.is_finite().then_some(Plane { normal, distance })
}
