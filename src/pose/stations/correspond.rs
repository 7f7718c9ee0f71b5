//! Which planes of two stations may be the same, by their geometry alone: rotations that turn normals
//! into normals, then translations that explain their distances. The two are separate problems
//! (Pathak, Birk, Vaskevicius and Poppinga, "Fast registration based on noisy planes with unknown
//! correspondences for 3-D mapping", IEEE T-RO 2010).
//!
//! Normals point away from the stations, so that every one has its sign, and both stations' frames are
//! right-handed: a set of planes has no mirror image to be taken for.

use std::collections::BTreeSet;

use nalgebra::{Matrix3, Vector3};

use super::super::procrustes::kabsch;
use super::StationOptions;
use crate::geometry::rigid::log;
use crate::geometry::{Plane, Rigid};

/// The largest planes of each station that poses are made from.
const CONSIDERED: usize = 24;
/// Least sine between two planes that fix a rotation, and least volume of three unit normals that fix
/// a translation.
const MIN_SINE: f64 = 0.25;
const MIN_VOLUME: f64 = 0.1;
/// Most rotations, pairs of planes for one rotation, and translations of each.
const ROTATIONS: usize = 64;
const PAIRS: usize = 64;
const TRANSLATIONS: usize = 12;
/// Rotations for which poses that slide are tried (as many as turn a box into itself), and at which steps: metres,
/// to how many either way.
const SLIDING: usize = 24;
const STEP: f64 = 0.1;
const REACH: i32 = 80;

/// One station's planes, and what each counts.
pub(super) struct Side {
    pub planes: Vec<Plane>,
    pub weights: Vec<f64>,
    /// The largest ones, in falling order.
    pub largest: Vec<usize>,
}

impl Side {
    pub fn new(planes: Vec<Plane>, weights: Vec<f64>) -> Self {
        let mut largest: Vec<usize> = (0..planes.len()).collect();
        largest.sort_by(|i, j| weights[*j].total_cmp(&weights[*i]).then(i.cmp(j)));
        largest.truncate(CONSIDERED);
        Self { planes, weights, largest }
    }
}

/// A pose from b to a, and the weight of the planes that it brings together.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub b_to_a: Rigid,
    pub weight: f64,
}

/// Poses that bring three planes or more in three directions together, the heaviest first.
pub(super) fn candidates(a: &Side, b: &Side, options: &StationOptions) -> Vec<Candidate> {
    let mut all = Vec::new();
    for (rotation, _) in rotations(a, b, options) {
        all.extend(translations(a, b, &rotation, options));
    }
    all.sort_by(|p: &Candidate, q| q.weight.total_cmp(&p.weight));
    all
}

/// Pairs of planes that a rotation makes parallel, with their common weight.
fn parallel(a: &Side, b: &Side, rotation: &Matrix3<f64>, max_angle: f64) -> Vec<(usize, usize, f64)> {
    let least = max_angle.cos();
    let mut pairs = Vec::new();
    for j in &b.largest {
        let turned = rotation * b.planes[*j].normal;
        for i in &a.largest {
            if a.planes[*i].normal.dot(&turned) >= least {
                pairs.push((*i, *j, a.weights[*i].min(b.weights[*j])));
            }
        }
    }
    pairs
}

/// The weight of the best partner of each plane of a.
fn one_each(pairs: impl Iterator<Item = (usize, usize, f64)>, planes: usize) -> f64 {
    let mut best = vec![0.0f64; planes];
    pairs.for_each(|(i, _, w)| best[i] = best[i].max(w));
    best.iter().sum()
}

/// Rotations from b to a that make planes in two directions parallel, with the weight of these planes.
pub(super) fn rotations(a: &Side, b: &Side, options: &StationOptions) -> Vec<(Matrix3<f64>, f64)> {
    let mut found: Vec<(Matrix3<f64>, f64)> = Vec::new();
    let near = |r: &Matrix3<f64>, s: &Matrix3<f64>| (r.transpose() * s).trace() >= 1.0 + 2.0 * options.max_angle.cos();
    for (p, q) in pairs_of(&a.largest) {
        let of_a = [a.planes[p].normal, a.planes[q].normal];
        let Some(frame_a) = frame(&of_a) else { continue };
        for (r, s) in pairs_of(&b.largest).flat_map(|(r, s)| [(r, s), (s, r)]) {
            let of_b = [b.planes[r].normal, b.planes[s].normal];
            let angle = |n: &[Vector3<f64>; 2]| n[0].dot(&n[1]).clamp(-1.0, 1.0).acos();
            if (angle(&of_a) - angle(&of_b)).abs() > 2.0 * options.max_angle {
                continue;
            }
            let Some(frame_b) = frame(&of_b) else { continue };
            let rotation = frame_a * frame_b.transpose();
            if !options.allows_rotation(&rotation) || found.iter().any(|(known, _)| near(known, &rotation)) {
                continue;
            }
            let pairs = parallel(a, b, &rotation, options.max_angle);
            let rotation = aligned(a, b, &pairs).unwrap_or(rotation);
            found.push((rotation, one_each(pairs.into_iter(), a.planes.len())));
        }
    }
    found.sort_by(|(_, v), (_, w)| w.total_cmp(v));
    found.truncate(ROTATIONS);
    found
}

/// The rotation by all planes that one made parallel: two small ones alone may be degrees off.
fn aligned(a: &Side, b: &Side, pairs: &[(usize, usize, f64)]) -> Option<Matrix3<f64>> {
    let correlation: Matrix3<f64> =
        pairs.iter().map(|(i, j, w)| a.planes[*i].normal * b.planes[*j].normal.transpose() * (w * w)).sum();
    kabsch(&correlation).ok().map(|(rotation, _)| rotation)
}

fn pairs_of(indices: &[usize]) -> impl Iterator<Item = (usize, usize)> {
    indices.iter().enumerate().flat_map(move |(k, i)| indices[k + 1..].iter().map(move |j| (*i, *j)))
}

/// Right-handed axes: along the sum of two unit vectors, along their difference, across both.
fn frame([u, v]: &[Vector3<f64>; 2]) -> Option<Matrix3<f64>> {
    let across = u.cross(v);
    if across.norm() < MIN_SINE {
        return None;
    }
    let (sum, across) = ((u + v).normalize(), across.normalize());
    Some(Matrix3::from_columns(&[sum, across.cross(&sum), across]))
}

/// Translations that bring three planes or more together, for one rotation.
fn translations(a: &Side, b: &Side, rotation: &Matrix3<f64>, options: &StationOptions) -> Vec<Candidate> {
    let mut pairs = parallel(a, b, rotation, options.max_angle);
    pairs.sort_by(|p, q| q.2.total_cmp(&p.2).then((p.0, p.1).cmp(&(q.0, q.1))));
    pairs.truncate(PAIRS);
    // X_a = R X_b + t: u . t = h_a - h_b for planes u . X_a = h_a.
    let offset = |(i, j): (usize, usize)| a.planes[i].distance - b.planes[j].distance;
    let (mut found, mut tried) = (Vec::<Candidate>::new(), BTreeSet::new());
    for (k, p) in pairs.iter().enumerate() {
        for (l, q) in pairs.iter().enumerate().skip(k + 1) {
            let across = a.planes[p.0].normal.cross(&a.planes[q.0].normal);
            if across.norm() < MIN_VOLUME {
                continue;
            }
            for r in &pairs[l + 1..] {
                let normals = [p, q, r].map(|(i, _, _)| a.planes[*i].normal);
                if across.dot(&normals[2]).abs() < MIN_VOLUME || p.1 == q.1 || q.1 == r.1 || r.1 == p.1 {
                    continue;
                }
                let right = Vector3::from([p, q, r].map(|(i, j, _)| offset((*i, *j))));
                let rows = Matrix3::from_rows(&normals.map(|n| n.transpose()));
                let Some(translation) = rows.try_inverse().map(|m| m * right) else { continue };
                let cell = <[f64; 3]>::from(translation / options.max_distance).map(|v| v.round() as i64);
                if !options.allows_position(&translation) || !tried.insert(cell) {
                    continue;
                }
                let agrees = |(i, j, _): &(usize, usize, f64)| {
                    (a.planes[*i].normal.dot(&translation) - offset((*i, *j))).abs() <= options.max_distance
                };
                let weight = one_each(pairs.iter().filter(|p| agrees(p)).copied(), a.planes.len());
                found.push(Candidate { b_to_a: Rigid { rotation: *rotation, translation }, weight });
            }
        }
    }
    found.sort_by(|p, q| q.weight.total_cmp(&p.weight));
    found.truncate(TRANSLATIONS);
    found
}

/// Poses by which the stations share planes in two directions only, and the direction in which they
/// can slide: at steps along it, for what the stations saw to judge.
pub(super) fn partial(a: &Side, b: &Side, options: &StationOptions) -> Vec<(Rigid, Vector3<f64>)> {
    let mut found = Vec::new();
    for (rotation, _) in rotations(a, b, options).into_iter().take(SLIDING) {
        let pairs = parallel(a, b, &rotation, options.max_angle);
        let mut best: Option<(f64, Vector3<f64>, Vector3<f64>)> = None;
        for (k, p) in pairs.iter().enumerate() {
            for q in &pairs[k + 1..] {
                let (u, v) = (a.planes[p.0].normal, a.planes[q.0].normal);
                let across = u.cross(&v);
                if across.norm() < MIN_SINE || p.1 == q.1 {
                    continue;
                }
                let [g, h] = [p, q].map(|(i, j, _)| a.planes[*i].distance - b.planes[*j].distance);
                let nearest = (v.cross(&across) * g + across.cross(&u) * h) / across.norm_squared();
                let agrees = |(i, j, _): &(usize, usize, f64)| {
                    let n = a.planes[*i].normal;
                    let off = n.dot(&nearest) - (a.planes[*i].distance - b.planes[*j].distance);
                    n.dot(&across).abs() <= MIN_VOLUME && off.abs() <= options.max_distance
                };
                let weight = one_each(pairs.iter().filter(|p| agrees(p)).copied(), a.planes.len());
                if best.as_ref().is_none_or(|(w, _, _)| weight > *w) {
                    best = Some((weight, nearest, across.normalize()));
                }
            }
        }
        let Some((_, nearest, direction)) = best else { continue };
        for step in -REACH..=REACH {
            let translation = nearest + direction * (f64::from(step) * STEP);
            if options.allows_position(&translation) {
                found.push((Rigid { rotation, translation }, direction));
            }
        }
    }
    found
}

/// The planes that a pose brings together, each with one other: the nearest to each other first.
pub(super) fn matched(a: &Side, b: &Side, b_to_a: &Rigid, options: &StationOptions) -> Vec<[usize; 2]> {
    let mut near = Vec::new();
    for (j, plane) in b.planes.iter().enumerate() {
        let moved = plane.transform(b_to_a);
        for (i, known) in a.planes.iter().enumerate() {
            let angle = known.normal.cross(&moved.normal).norm().atan2(known.normal.dot(&moved.normal));
            let apart = (known.distance - moved.distance).abs();
            if angle <= options.max_angle && apart <= options.max_distance {
                near.push((angle / options.max_angle + apart / options.max_distance, i, j));
            }
        }
    }
    near.sort_by(|p, q| p.0.total_cmp(&q.0).then((p.1, p.2).cmp(&(q.1, q.2))));
    let mut matches: Vec<[usize; 2]> = Vec::new();
    for (_, i, j) in near {
        if matches.iter().all(|m| m[0] != i && m[1] != j) {
            matches.push([i, j]);
        }
    }
    matches.sort_unstable();
    matches
}

impl StationOptions {
    fn allows_rotation(&self, rotation: &Matrix3<f64>) -> bool {
        let Some(prior) = &self.prior else { return true };
        let off = log(&(rotation * prior.b_to_a.rotation.transpose())).norm();
        off <= 3.0 * prior.rotation_sigma + self.max_angle
    }

    fn allows_position(&self, position: &Vector3<f64>) -> bool {
        let Some(prior) = &self.prior else { return true };
        (position - prior.b_to_a.translation).norm() <= 3.0 * prior.position_sigma + self.max_distance
    }
}
