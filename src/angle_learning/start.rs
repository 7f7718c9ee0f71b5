//! Where every frame looks, from the turns between frames: the start of the adjustment.

use nalgebra::{Matrix3, Vector3};

use super::pairs::Pair;
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::angle_map::Mounting;
use crate::geometry::rigid::{log, rotation_y};

/// A turn of less than this says nothing of its axis, radians.
const LEAST_TURN: f64 = 2e-3;
/// Accepted share of turns against the rest.
const MAX_CONTRADICTIONS: f64 = 0.1;

pub struct Start {
    /// Frames that hang together, the reference first.
    pub frames: Vec<usize>,
    /// Pan and tilt of each of them.
    pub angles: Vec<[f64; 2]>,
    pub mounting: Mounting,
}

/// `raw`: of every frame, the device's pan and tilt; `cells`: its column and row in the grid.
///
/// # Errors
/// `NotFound`: an axis does not turn the picture; `Ambiguous`: turns contradict each other;
/// `Degenerate`: axes that make no pan-tilt head.
pub fn start(raw: &[[f64; 2]], cells: &[[usize; 2]], pairs: &[Pair], reference: usize) -> Result<Start> {
    let Chain { frames, parents, orientation } = chain(raw.len(), pairs, reference);
    let connected: Vec<&Pair> =
        pairs.iter().filter(|p| orientation[p.a].is_some() && orientation[p.b].is_some()).collect();
    // Camera to world, the reference's camera.
    let at = |k: usize| orientation[k].unwrap_or_else(Matrix3::identity);
    let along = |axis: usize, of: &dyn Fn(&Pair) -> Vector3<f64>| {
        let turns = connected.iter().filter(|p| cells[p.a][1 - axis] == cells[p.b][1 - axis]);
        let turns = turns.map(|p| of(p) * (raw[p.b][axis] - raw[p.a][axis]).signum());
        direction(["pan", "tilt"][axis], turns.collect())
    };
    let mut pan = along(0, &|p| at(p.a) * -log(&p.rotation))?;
    let mut tilt = along(1, &|p| -log(&p.rotation))?;
    // Positive tilt turns up, about the camera's x axis; positive pan right, about its y axis.
    if tilt.x < 0.0 {
        tilt = -tilt;
    }
    let [right, down, ahead] = [Vector3::x(), Vector3::y(), Vector3::z()].map(|e| at(reference) * e);
    if pan.dot(&down) < 0.0 {
        pan = -pan;
    }
    // In the world the tilt axis is across the pan axis.
    let off = pan.dot(&(at(reference) * tilt)).abs();
    if tilt.x < 0.5 || off > 0.2 {
        let detail = format!(
            "the tilt axis lies along ({:.2}, {:.2}, {:.2}) of the camera and {:.1} degrees off perpendicular to the pan axis: \
             this is no pan-tilt head with an upright camera",
            tilt.x,
            tilt.y,
            tilt.z,
            off.asin().to_degrees()
        );
        return Err(Error::degenerate(Degeneracy::IllConditioned, detail));
    }
    let forward = (ahead - pan * pan.dot(&ahead)).try_normalize(0.05);
    let forward = forward.unwrap_or_else(|| right.cross(&pan).normalize());
    let axes = Matrix3::from_columns(&[pan.cross(&forward), pan, forward]).transpose();
    let mounting =
        Mounting { collimation: tilt.z.clamp(-1.0, 1.0).asin(), roll: (-tilt.y).atan2(tilt.x), trunnion: 0.0 };
    let (s, c) = mounting.roll.sin_cos();
    let mount = rotation_y(mounting.collimation) * Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
    let mut angles: Vec<Option<[f64; 2]>> = vec![None; raw.len()];
    for &k in &frames {
        let d = axes * at(k) * mount.transpose();
        let mut pan = (-d[(2, 0)]).atan2(d[(0, 0)]);
        let tilt = (-d[(1, 2)]).atan2(d[(1, 1)]);
        if let Some([near, _]) = parents[k].and_then(|p| angles[p]) {
            pan += std::f64::consts::TAU * ((near - pan) / std::f64::consts::TAU).round();
        }
        angles[k] = Some([pan, tilt]);
    }
    let angles = frames.iter().filter_map(|k| angles[*k]).collect();
    Ok(Start { frames, angles, mounting })
}

/// The tree of the strongest pairs (Prim).
struct Chain {
    /// Frames in its order.
    frames: Vec<usize>,
    parents: Vec<Option<usize>>,
    /// Camera to world of each frame in the tree.
    orientation: Vec<Option<Matrix3<f64>>>,
}

fn chain(count: usize, pairs: &[Pair], root: usize) -> Chain {
    let mut orientation = vec![None; count];
    let mut parents = vec![None; count];
    let mut frames = vec![root];
    orientation[root] = Some(Matrix3::identity());
    loop {
        let open = pairs.iter().filter(|p| orientation[p.a].is_some() != orientation[p.b].is_some());
        let Some(p) = open.max_by_key(|p| p.matches.len()) else { break };
        let (from, to, turn) =
            if orientation[p.a].is_some() { (p.a, p.b, p.rotation.transpose()) } else { (p.b, p.a, p.rotation) };
        orientation[to] = orientation[from].map(|q: Matrix3<f64>| q * turn);
        parents[to] = Some(from);
        frames.push(to);
    }
    Chain { frames, parents, orientation }
}

/// The common direction of rotation vectors.
fn direction(name: &str, turns: Vec<Vector3<f64>>) -> Result<Vector3<f64>> {
    let turns: Vec<Vector3<f64>> = turns.into_iter().filter(|t| t.norm() > LEAST_TURN).collect();
    let none = || Error::NotFound { reason: format!("{name} does not turn the picture: does the head move?") };
    let longest = turns.iter().max_by(|a, b| a.norm().total_cmp(&b.norm())).ok_or_else(none)?;
    // About either sense of the longest, so that contradictions do not cancel what they contradict.
    let sum: Vector3<f64> = turns.iter().map(|t| if t.dot(longest) < 0.0 { -t } else { *t }).sum();
    let axis = sum.try_normalize(1e-9).ok_or_else(none)?;
    let with = turns.iter().filter(|t| t.dot(&axis) > 0.0).count();
    let less = with.min(turns.len() - with);
    if less as f64 > MAX_CONTRADICTIONS * turns.len() as f64 {
        let reason =
            format!("{name} turns the picture one way {with} times of {}, and else the other way", turns.len());
        return Err(Error::Ambiguous { reason });
    }
    Ok(if 2 * with >= turns.len() { axis } else { -axis })
}
