//! What the surroundings are expected to be where nobody shot yet.

use std::collections::BTreeSet;

use nalgebra::{Vector3, Vector4};

use super::next::ScannedShot;
use super::setup::Site;

/// Of more scanned shots than these, evenly chosen ones predict depths.
const PREDICTORS: usize = 4096;
const NEIGHBOURS: usize = 6;
/// Depths that stand for all that occur.
const DEPTHS: usize = 7;
/// A neighbour so far off (radians) tells as much as knowing nothing: 16 degrees.
const FAR: f64 = 16.0 * std::f64::consts::PI / 180.0;

/// The surroundings as far as they are scanned.
pub struct Surroundings {
    found: Vec<Found>,
    /// Of them the first at every position.
    places: Vec<usize>,
    /// Depths that occur, the same number of places between them.
    depths: Vec<f64>,
    /// Share of the places in view that were seen.
    seen: f64,
}

struct Found {
    /// Of the laser, unit length.
    direction: Vector3<f64>,
    rho: f64,
    /// Was it seen? `None` where it could not: it is out of the fixed camera's view.
    seen: Option<bool>,
}

/// One of the things that a shot at a position may find.
#[derive(Debug, Clone, Copy)]
pub struct Possibility {
    /// How likely it is; what is missing to 1 is a spot that the fixed camera does not see.
    pub chance: f64,
    /// Along the head camera's axis, metres.
    pub depth: f64,
}

impl Surroundings {
    pub fn new(site: &Site, scanned: &[ScannedShot]) -> Self {
        let every = scanned.len().div_ceil(PREDICTORS);
        let taken: Vec<&ScannedShot> = scanned.iter().step_by(every).collect();
        let found = |s: &&ScannedShot| Found {
            direction: direction(site, s.pan, s.tilt),
            rho: 1.0 / s.depth,
            seen: (s.seen || site.shot(s.pan, s.tilt, s.depth).is_some()).then_some(s.seen),
        };
        let found: Vec<Found> = taken.iter().map(found).collect();
        let mut positions = BTreeSet::new();
        let first = |i: &usize| positions.insert([taken[*i].pan.to_bits(), taken[*i].tilt.to_bits()]);
        let places: Vec<usize> = (0..taken.len()).filter(first).collect();
        let mut sorted: Vec<f64> = places.iter().map(|i| taken[*i].depth).collect();
        sorted.sort_by(f64::total_cmp);
        let depths = (0..DEPTHS).map(|k| sorted[(sorted.len() - 1) * k / (DEPTHS - 1)]).collect();
        let in_view: Vec<bool> = places.iter().filter_map(|i| found[*i].seen).collect();
        let saw = in_view.iter().filter(|seen| **seen).count();
        let seen = (saw as f64 + 1.0) / (in_view.len() as f64 + 2.0);
        Self { found, places, depths, seen }
    }

    /// Depth at a position, and the chance that the fixed camera sees a spot there: the share of the
    /// neighbours that were not hidden and whose depth is in view here.
    ///
    /// The depth is that of the plane through the nearest neighbours, whose inverse depth is linear in
    /// the direction, kept between the least and the greatest among them. A place counts as often as it
    /// was shot: next to one that is worth repeating its surface is taken to go on.
    pub fn expect(&self, site: &Site, pan: f64, tilt: f64) -> Option<(f64, f64)> {
        let near = self.neighbours(0..self.found.len(), &direction(site, pan, tilt))?;
        let saw = |(neighbour, weight): &(&Found, f64)| {
            let sees = neighbour.seen != Some(false) && site.shot(pan, tilt, 1.0 / neighbour.rho).is_some();
            if sees { *weight } else { 0.0 }
        };
        let saw: f64 = near.weighted.iter().map(saw).sum();
        Some((1.0 / near.within(near.plane.w), saw / near.weight))
    }

    /// What may be found at a position that nobody shot at. Around every neighbour the surface may differ
    /// from their plane as it does there; far from all of them it may be at any depth that occurs.
    pub fn possibilities(&self, site: &Site, pan: f64, tilt: f64) -> Vec<Possibility> {
        let d = direction(site, pan, tilt);
        let Some(near) = self.neighbours(self.places.iter().copied(), &d) else { return Vec::new() };
        let all = near.weight + 1.0 / (FAR * FAR);
        let around = near.weighted.iter().filter(|(f, _)| f.seen != Some(false)).map(|(f, weight)| {
            let differs = f.rho - near.plane.dot(&(f.direction - d).push(1.0));
            Possibility { chance: weight / all, depth: 1.0 / near.within(near.plane.w + differs) }
        });
        let any = self.seen / (FAR * FAR * all * DEPTHS as f64);
        let elsewhere = self.depths.iter().map(|depth| Possibility { chance: any, depth: *depth });
        around.chain(elsewhere).filter(|p| site.shot(pan, tilt, p.depth).is_some()).collect()
    }

    /// The nearest of some of the shots, and the plane through them; `None` when they give none.
    fn neighbours(&self, among: impl Iterator<Item = usize>, d: &Vector3<f64>) -> Option<Near<'_>> {
        let mut near: Vec<(f64, usize)> = among.map(|i| ((self.found[i].direction - d).norm_squared(), i)).collect();
        let count = NEIGHBOURS.min(near.len());
        near.select_nth_unstable_by(count - 1, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.truncate(count);
        let reach = near.iter().map(|(squared, _)| squared).sum::<f64>() / count as f64;
        // rho = slope.(f - d) + rho0, the slope held to zero where neighbours leave it open.
        let (mut h, mut g) = (nalgebra::Matrix4::zeros(), Vector4::zeros());
        let (mut least, mut greatest, mut all) = (f64::INFINITY, 0.0f64, 0.0);
        let mut weighted = Vec::with_capacity(count);
        for (squared, i) in &near {
            let found = &self.found[*i];
            let row = (found.direction - d).push(1.0);
            let weight = 1.0 / (squared + 0.01 * reach + 1e-12);
            h += row * row.transpose() * weight;
            g += row * (found.rho * weight);
            (least, greatest) = (least.min(found.rho), greatest.max(found.rho));
            all += weight;
            weighted.push((found, weight));
        }
        let ridge = 1e-6 * h.trace();
        (0..3).for_each(|i| h[(i, i)] += ridge);
        Some(Near { weighted, weight: all, plane: h.cholesky()?.solve(&g), range: [least, greatest] })
    }
}

/// The neighbours of a direction.
struct Near<'a> {
    /// With their weights, and the weights' sum.
    weighted: Vec<(&'a Found, f64)>,
    weight: f64,
    /// Inverse depth's slope by direction, and inverse depth there.
    plane: Vector4<f64>,
    /// Least and greatest inverse depth among them.
    range: [f64; 2],
}

impl Near<'_> {
    fn within(&self, rho: f64) -> f64 {
        rho.clamp(self.range[0], self.range[1])
    }
}

fn direction(site: &Site, pan: f64, tilt: f64) -> Vector3<f64> {
    site.rig.laser_in_world(pan, tilt).1.normalize()
}
