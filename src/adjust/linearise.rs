//! The normal equations of all shots at one state, each shot's own unknowns eliminated.

use std::collections::BTreeSet;

use faer::Mat;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::batch::{Batch, Groups, merged};
use super::eliminate::{Eliminated, Own};
use super::gram::Gram;
use super::layout::{Layout, PLANE, State};
use super::plane_hit::PlaneHit;
use super::problem::{AdjustOptions, Adjustment};
use super::tile::{Misfit, Seer, Tile};
use crate::calibrate::block::{LANES, Products};
use crate::error::{Error, Result};
use crate::geometry::{Plane, RIG_PARAMETERS};

/// Rig and station: what a shot's ray depends on.
const COMMON: usize = RIG_PARAMETERS + 6;
/// Inverse depth of what is taken for infinitely far, 1/m: a hit there says nothing more.
const LEAST_RHO: f64 = 1e-6;
/// A row of the head camera's equations or a plane's: ray, plane, right-hand side.
pub(super) const ROW: usize = COMMON + PLANE + 1;

/// What, besides the head camera, says something of a shot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Witness {
    Camera(usize),
    /// The shot hit it.
    Plane(usize),
}

/// One spot of one shot, or that it hit a plane.
#[derive(Clone)]
pub(super) struct View {
    /// `None`: the head camera.
    pub by: Option<Witness>,
    /// Zero for a plane: the distance from it, and nothing.
    pub pixel: Vector2<f64>,
    /// L^-1 with L L^T the covariance of the pixel.
    pub whitening: Matrix2<f64>,
}

impl View {
    /// Numbers that are measured.
    pub fn rows(&self) -> usize {
        if self.is_plane() { 1 } else { 2 }
    }

    pub fn is_plane(&self) -> bool {
        matches!(self.by, Some(Witness::Plane(_)))
    }
}

/// All measurements in the order in which they are worked through.
pub(super) struct Problem<'a> {
    pub input: &'a Adjustment,
    pub layout: &'a Layout,
    /// Of shot i: views[spans[i]..spans[i + 1]].
    pub views: Vec<View>,
    pub spans: Vec<usize>,
    /// 1 / variance of a move's pan and tilt; zero: exact.
    pointing: [f64; 2],
    pub huber: f64,
    /// Per camera the unit of its soft priors on skew and aspect, px: the first focal length, so that
    /// they stay linear.
    focals: Vec<f64>,
    batches: Vec<Batch>,
    /// Pairs of station and camera, and of station and plane: each has a sum of its own.
    cameras: Vec<(usize, usize)>,
    planes: Vec<(usize, usize)>,
}

/// Sums of rows that come one at a time: of each station's head, and of each pair of station and plane.
struct Singles {
    heads: Vec<Gram>,
    planes: Vec<Gram>,
}

pub(super) struct System {
    /// Lower triangle.
    pub h: Mat<f64>,
    pub g: Vec<f64>,
    /// Data under the robust loss, and priors.
    pub cost: f64,
    /// Sum of squared whitened residuals of used views, with the locals' priors.
    pub chi2: f64,
    pub eliminated: Vec<Eliminated>,
}

/// A shot's homogeneous point X = xyz; rho in the world, with derivatives.
pub(super) struct ShotPoint {
    pub xyz: Vector3<f64>,
    /// By the free rig parameters, then the station's.
    pub by_common: [Vector3<f64>; COMMON],
    pub common: usize,
    /// By inverse depth (weight: 1), pan, tilt (weight: 0).
    pub by_local: [Vector3<f64>; 3],
}

impl<'a> Problem<'a> {
    pub fn new(input: &'a Adjustment, layout: &'a Layout, start: &State, options: &AdjustOptions) -> Result<Self> {
        let mut views = Vec::new();
        let mut spans = vec![0];
        let mut groups = Groups::new();
        let mut pairs = BTreeSet::new();
        for (index, shot) in input.shots().iter().enumerate() {
            let head = shot.head.iter().map(|(pixel, covariance)| (None, pixel, covariance));
            let fixed = shot.sightings.iter().map(|s| (Some(Witness::Camera(s.camera)), &s.pixel, &s.covariance));
            for (by, pixel, covariance) in head.chain(fixed) {
                let whitening = whitening(covariance)
                    .ok_or_else(|| Error::invalid("covariance", format!("of shot {index} is singular")))?;
                views.push(View { by, pixel: *pixel, whitening });
            }
            let mut witnesses: Vec<Witness> = shot.sightings.iter().map(|s| Witness::Camera(s.camera)).collect();
            if let Some(plane) = input.plane_of(index) {
                let by = Witness::Plane(plane);
                let rho = start.locals[index][0];
                let hit = PlaneHit::of(&start.planes[plane], &point(input, layout, start, index), rho);
                let unit = input.planes()[plane] * hit.met_at(rho).abs().max(LEAST_RHO);
                // The row that does not exist weighs nothing.
                let whitening = Matrix2::new(1.0 / unit, 0.0, 0.0, 0.0);
                views.push(View { by: Some(by), pixel: Vector2::zeros(), whitening });
                witnesses.push(by);
            }
            spans.push(views.len());
            witnesses.sort_unstable();
            for witness in &witnesses {
                pairs.insert((shot.station, *witness));
            }
            groups.entry((shot.station, witnesses)).or_default().push(index);
        }
        let pairs_with = |choose: fn(Witness) -> Option<usize>| {
            pairs.iter().filter_map(|(station, witness)| Some((*station, choose(*witness)?))).collect()
        };
        let cameras = pairs_with(|w| if let Witness::Camera(i) = w { Some(i) } else { None });
        let planes = pairs_with(|w| if let Witness::Plane(i) = w { Some(i) } else { None });
        let batches = merged(layout, groups)
            .into_iter()
            .map(|((station, witnesses), shots)| Batch::new(layout, station, witnesses.into_iter(), shots))
            .collect();
        let information = |sigma: f64| if sigma > 0.0 { 1.0 / (sigma * sigma) } else { 0.0 };
        let pointing = options.pointing_sigma.map(information);
        let focals = start.cameras.iter().map(|c| c.intrinsics.fx).collect();
        Ok(Self { input, layout, views, spans, pointing, huber: options.huber, focals, batches, cameras, planes })
    }

    /// Number of a shot's own unknowns.
    pub fn local_count(&self) -> usize {
        if self.pointing == [0.0; 2] { 1 } else { 3 }
    }

    pub fn columns_of(&self, batch: usize) -> &[usize] {
        &self.batches[batch].columns
    }

    pub fn span(&self, shot: usize) -> std::ops::Range<usize> {
        self.spans[shot]..self.spans[shot + 1]
    }

    /// The shot's point at a state.
    pub fn point(&self, state: &State, shot: usize) -> ShotPoint {
        point(self.input, self.layout, state, shot)
    }

    pub fn batch_count(&self) -> usize {
        self.batches.len()
    }

    /// The beliefs about a move's pan and tilt, in the rows of a shot's own unknowns.
    pub fn pointing_matrix(&self) -> Matrix3<f64> {
        let held = |k| if self.local_count() == 3 { self.pointing_information(k) } else { 1.0 };
        Matrix3::from_diagonal(&Vector3::new(0.0, held(0), held(1)))
    }

    /// The same measurements with other unknowns.
    pub fn with_layout<'b>(&'b self, layout: &'b Layout) -> Problem<'b> {
        let batch = |b: &Batch| Batch::new(layout, b.station, b.witnesses.iter().map(|(w, _)| *w), b.shots.clone());
        Problem {
            input: self.input,
            layout,
            views: self.views.clone(),
            spans: self.spans.clone(),
            pointing: self.pointing,
            huber: self.huber,
            focals: self.focals.clone(),
            batches: self.batches.iter().map(batch).collect(),
            cameras: self.cameras.clone(),
            planes: self.planes.clone(),
        }
    }

    /// `None` when a used spot cannot be predicted at this state.
    pub fn linearise(&self, state: &State, used: &[bool]) -> Option<System> {
        let n = self.layout.count;
        let mut h = Mat::<f64>::zeros(n, n);
        let mut g = vec![0.0; n];
        let (mut cost, mut chi2) = (0.0, 0.0);
        let locals = self.local_count();
        let rig = self.layout.rig.len();
        let width = |station: usize, own: usize| rig + self.layout.stations[station].1.len() + own + 1;
        let of_camera = |(s, c): &(usize, usize)| Products::new(width(*s, self.layout.cameras[*c].freedom.count()));
        let mut cameras: Vec<Products> = self.cameras.iter().map(of_camera).collect();
        let mut singles = Singles {
            heads: (0..self.input.stations().len()).map(|_| Gram::new(rig + 1)).collect(),
            planes: self.planes.iter().map(|(s, _)| Gram::new(width(*s, PLANE))).collect(),
        };
        let mut eliminated: Vec<Eliminated> = (0..self.input.shots().len()).map(|_| Eliminated::default()).collect();
        for (b, batch) in self.batches.iter().enumerate() {
            let w = batch.columns.len();
            let mut couplings = Gram::new(w + 1);
            for shots in batch.shots.chunks(LANES) {
                let points: Vec<(ShotPoint, f64)> =
                    shots.iter().map(|shot| (self.point(state, *shot), state.locals[*shot][0])).collect();
                let mut tile = Tile::new(&points, w, locals);
                for (camera, place, views) in self.seen(batch, shots, used) {
                    let pair = self.cameras.binary_search(&(batch.station, camera)).ok()?;
                    let unknowns = &self.layout.cameras[camera].freedom.unknowns;
                    let seer = Seer { camera: &state.cameras[camera], unknowns, place };
                    let misfit = tile.add(&seer, &views, self.huber, &mut cameras[pair])?;
                    chi2 += misfit.chi2;
                    cost += misfit.cost;
                }
                for (lane, &shot) in shots.iter().enumerate() {
                    if !self.span(shot).any(|v| used[v]) {
                        continue;
                    }
                    let mut own = tile.own(lane);
                    let misfit = self.add_singly(state, shot, &points[lane], used, batch, &mut own, &mut singles)?;
                    chi2 += misfit.chi2;
                    cost += misfit.cost;
                    eliminated[shot] = own.eliminate(&mut couplings, b)?;
                }
            }
            let sum = couplings.finish();
            for (i, &ci) in batch.columns.iter().enumerate() {
                for (j, &cj) in batch.columns.iter().enumerate().take(i + 1) {
                    h[(ci.max(cj), ci.min(cj))] -= sum[(i, j)];
                }
                g[ci] -= sum[(w, i)];
            }
        }
        for (station, gram) in singles.heads.iter_mut().enumerate() {
            let columns = self.layout.common_columns(station);
            let sum = gram.finish();
            add(&mut h, &mut g, &columns[..rig], |i, j| sum[(i, j)]);
        }
        for ((station, plane), gram) in self.planes.iter().zip(&mut singles.planes) {
            let columns = self.layout.pair_columns(*station, Witness::Plane(*plane));
            let sum = gram.finish();
            add(&mut h, &mut g, &columns, |i, j| sum[(i, j)]);
        }
        for ((station, camera), products) in self.cameras.iter().zip(&cameras) {
            let columns = self.layout.pair_columns(*station, Witness::Camera(*camera));
            add(&mut h, &mut g, &columns, |i, j| products.at(j, i));
        }
        self.add_priors(state, &mut h, &mut g, &mut cost);
        cost.is_finite().then_some(System { h, g, cost, chi2, eliminated })
    }

    /// What no camera's block has of a shot: what the head camera saw, which plane it hit, and what is known
    /// of its pointing.
    #[allow(clippy::too_many_arguments)]
    fn add_singly(
        &self,
        state: &State,
        shot: usize,
        (point, rho): &(ShotPoint, f64),
        used: &[bool],
        batch: &Batch,
        own: &mut Own,
        singles: &mut Singles,
    ) -> Option<Misfit> {
        let mut misfit = Misfit::default();
        for view in self.span(shot).filter(|v| used[*v]).map(|v| &self.views[v]) {
            let mut rows = [[0.0; ROW]; 2];
            let (squared, weight) = match view.by {
                None => {
                    let residual = self.head_rows(state, shot, view, &mut rows, own)?;
                    let sum = &mut singles.heads[batch.station];
                    rows.iter().for_each(|r| sum.row().copy_from_slice(&r[..=self.layout.rig.len()]));
                    residual
                }
                Some(Witness::Camera(_)) => continue,
                Some(Witness::Plane(plane)) => {
                    let place = batch.place(Witness::Plane(plane))?;
                    let residual = self.plane_row(&state.planes[plane], *rho, view, point, &mut rows, own, place)?;
                    let pair = self.planes.binary_search(&(batch.station, plane)).ok()?;
                    singles.planes[pair].row().copy_from_slice(&rows[0][..=point.common + PLANE]);
                    residual
                }
            };
            misfit.chi2 += squared;
            misfit.cost += if weight < 1.0 { self.huber * (2.0 * squared.sqrt() - self.huber) } else { squared };
        }
        if self.local_count() == 3 {
            for k in 0..2 {
                let (angle, information) = (state.locals[shot][k + 1], self.pointing_information(k));
                own.information[k + 1][k + 1] += information;
                own.gradient[k + 1] -= angle * information;
                misfit.chi2 += angle * angle * information;
                misfit.cost += angle * angle * information;
            }
        }
        Some(misfit)
    }

    /// Of each camera that saw one of the shots: itself, its place in the batch's columns, and of each shot
    /// what it saw.
    fn seen(&self, batch: &Batch, shots: &[usize], used: &[bool]) -> Vec<(usize, usize, [Option<&View>; LANES])> {
        let of_camera = |(witness, place): &(Witness, usize)| match witness {
            Witness::Camera(camera) => Some((*camera, *place, [None; LANES])),
            Witness::Plane(_) => None,
        };
        // Cameras come before planes, in their order.
        let mut seen: Vec<_> = batch.witnesses.iter().map_while(of_camera).collect();
        for (lane, &shot) in shots.iter().enumerate() {
            for v in self.span(shot).filter(|v| used[*v]) {
                if let Some(Witness::Camera(camera)) = self.views[v].by
                    && let Ok(k) = seen.binary_search_by_key(&camera, |(c, ..)| *c)
                {
                    seen[k].2[lane] = Some(&self.views[v]);
                }
            }
        }
        seen
    }

    /// An exact angle among a shot's unknowns (only the other one is noisy) is held by a belief far
    /// tighter than any head.
    fn pointing_information(&self, axis: usize) -> f64 {
        if self.pointing[axis] > 0.0 { self.pointing[axis] } else { 1e24 }
    }

    /// Whitened rows of the head camera: over the rig's free parameters, then the right-hand side.
    /// Returns the squared residual and its robust weight.
    fn head_rows(
        &self,
        state: &State,
        shot: usize,
        view: &View,
        rows: &mut [[f64; ROW]; 2],
        own: &mut Own,
    ) -> Option<(f64, f64)> {
        let spot = state.rig.spot_image(state.locals[shot][0])?;
        let (residual, squared, weight, w) = self.weigh(view, &spot.pixel);
        for (k, &i) in self.layout.rig.iter().enumerate() {
            let d = w * spot.by[i];
            (rows[0][k], rows[1][k]) = (d.x, d.y);
        }
        let rig = self.layout.rig.len();
        (rows[0][rig], rows[1][rig]) = (residual.x, residual.y);
        let by_rho = w * spot.by_rho;
        own.add(&[by_rho, Vector2::zeros(), Vector2::zeros()], &residual, rows, &[(0, 0, rig)]);
        Some((squared, weight))
    }

    /// Whitened row of a plane, the second left empty: over the ray's columns, the plane's, then the
    /// right-hand side.
    #[allow(clippy::too_many_arguments)]
    fn plane_row(
        &self,
        plane: &Plane,
        rho: f64,
        view: &View,
        point: &ShotPoint,
        rows: &mut [[f64; ROW]; 2],
        own: &mut Own,
        place: usize,
    ) -> Option<(f64, f64)> {
        let hit = PlaneHit::of(plane, point, rho);
        let (residual, squared, weight, w) = self.weigh(view, &Vector2::new(hit.distance, 0.0));
        let row = &mut rows[0];
        for (k, by) in point.by_common.iter().enumerate().take(point.common) {
            row[k] = w.m11 * plane.normal.dot(by);
        }
        for (k, by) in hit.by_plane.iter().enumerate() {
            row[point.common + k] = w.m11 * by;
        }
        row[point.common + PLANE] = residual.x;
        let by_local = hit.by_local.map(|by| Vector2::new(w.m11 * by, 0.0));
        own.add(&by_local, &residual, rows, &[(0, 0, point.common), (point.common, place, PLANE)]);
        Some((squared, weight))
    }

    /// Whitened and weighted residual, squared length before weighting, weight, whitening with weight.
    fn weigh(&self, view: &View, predicted: &Vector2<f64>) -> (Vector2<f64>, f64, f64, Matrix2<f64>) {
        let residual = view.whitening * (view.pixel - predicted);
        let squared = residual.norm_squared();
        let weight = if squared > self.huber * self.huber { self.huber / squared.sqrt() } else { 1.0 };
        let root = weight.sqrt();
        (residual * root, squared, weight, view.whitening * root)
    }

    fn add_priors(&self, state: &State, h: &mut Mat<f64>, g: &mut [f64], cost: &mut f64) {
        for prior in &self.layout.priors {
            let (offset, by_columns) = prior.offset(self.input, state);
            let pull = &prior.information * &offset;
            *cost += offset.dot(&pull);
            let pull = by_columns.tr_mul(&pull);
            let information = by_columns.tr_mul(&(&prior.information * &by_columns));
            for (i, &(ci, _)) in prior.columns.iter().enumerate() {
                g[ci] -= pull[i];
                for (j, &(cj, _)) in prior.columns.iter().enumerate().take(i + 1) {
                    h[(ci.max(cj), ci.min(cj))] += information[(i, j)];
                }
            }
        }
        for ((camera, c), focal) in state.cameras.iter().zip(&self.layout.cameras).zip(&self.focals) {
            let now = crate::calibrate::freedom::parameters(camera);
            for prior in &c.freedom.priors {
                let value: f64 = prior.iter().zip(&now).map(|(a, b)| a * b).sum::<f64>() / focal;
                *cost += value * value;
                let row: Vec<f64> = c.freedom.unknowns.iter().map(|u| u.derivative(prior) / focal).collect();
                for (i, a) in row.iter().enumerate() {
                    g[c.first + i] -= a * value;
                    for (j, b) in row.iter().enumerate().take(i + 1) {
                        h[(c.first + i, c.first + j)] += a * b;
                    }
                }
            }
        }
    }
}

/// A shot's point at a state, with its derivatives.
pub(super) fn point(input: &Adjustment, layout: &Layout, state: &State, shot: usize) -> ShotPoint {
    let s = &input.shots()[shot];
    let [rho, pan, tilt] = state.locals[shot];
    let ray = state.rig.laser_ray(s.pan, s.tilt, [pan, tilt]);
    let station = &state.stations[s.station];
    let q = &station.rotation;
    let arm = q * (ray.direction + ray.origin * rho);
    let mut by_common = [Vector3::zeros(); COMMON];
    let mut common = 0;
    for &i in &layout.rig {
        by_common[common] = q * (ray.direction_by[i] + ray.origin_by[i] * rho);
        common += 1;
    }
    for &i in &layout.stations[s.station].1 {
        by_common[common] = if i < 3 { Vector3::ith(i, 1.0).cross(&arm) } else { Vector3::ith(i - 3, rho) };
        common += 1;
    }
    let origin = q * ray.origin + station.translation;
    let turned = |by: &[Vector3<f64>; 2]| q * (by[1] + by[0] * rho);
    ShotPoint {
        xyz: arm + station.translation * rho,
        by_common,
        common,
        by_local: [origin, turned(&ray.by_pan), turned(&ray.by_tilt)],
    }
}

impl Layout {
    /// Columns that the ray of a shot from this station depends on.
    pub fn common_columns(&self, station: usize) -> Vec<usize> {
        let (first, free) = &self.stations[station];
        (0..self.rig.len()).chain(*first..first + free.len()).collect()
    }

    fn pair_columns(&self, station: usize, witness: Witness) -> Vec<usize> {
        let mut columns = self.common_columns(station);
        columns.extend(self.witness_columns(witness));
        columns
    }

    pub fn witness_columns(&self, witness: Witness) -> std::ops::Range<usize> {
        match witness {
            Witness::Camera(camera) => {
                let c = &self.cameras[camera];
                c.first..c.first + c.freedom.count()
            }
            Witness::Plane(plane) => self.planes[plane]..self.planes[plane] + PLANE,
        }
    }
}

/// Adds a sum of products, the right-hand side as its last row.
fn add(h: &mut Mat<f64>, g: &mut [f64], columns: &[usize], sum: impl Fn(usize, usize) -> f64) {
    let w = columns.len();
    for (i, &ci) in columns.iter().enumerate() {
        for (j, &cj) in columns.iter().enumerate().take(i + 1) {
            h[(ci.max(cj), ci.min(cj))] += sum(i, j);
        }
        g[ci] += sum(w, i);
    }
}

fn whitening(c: &Matrix2<f64>) -> Option<Matrix2<f64>> {
    let l11 = c.m11.sqrt();
    let l21 = c.m21 / l11;
    let l22 = (c.m22 - l21 * l21).sqrt();
    let w = Matrix2::new(1.0 / l11, 0.0, -l21 / (l11 * l22), 1.0 / l22);
    w.iter().all(|v| v.is_finite()).then_some(w)
}
