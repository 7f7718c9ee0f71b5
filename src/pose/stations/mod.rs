//! The pose between two stations from the planes that both saw, without being told which are the same:
//! poses that bring planes together ([`correspond`]), of them the one that agrees with what either
//! station saw ([`judge`]), then maximum likelihood over all planes that it brings together.
//!
//! Three planes in different directions fix a pose, and three others that meet at the same angles fix
//! another: in rooms that is the rule. What the stations saw decides, or nothing does.

mod correspond;
mod judge;
mod unobservable;

use nalgebra::{Matrix6, Vector3};

use self::correspond::{Side, candidates, matched, partial};
use self::judge::{Verdict, judge};
use self::unobservable::check_span;
use super::plane_registration::{MatchedPlane, PlanePose, maximum_likelihood, plane_to_plane};
use super::planes::{FoundPlane, StationPlanes};
use super::roof_edge::RoofEdges;
use crate::error::{Error, Result};
use crate::geometry::chi_square::upper_tail;
use crate::geometry::rigid::log;
use crate::geometry::{Plane, Rigid};

/// Poses that are judged roughly, and those of them that are judged by all places.
const ROUGH: usize = 300;
const FINE: usize = 24;
/// Places for a rough judgement and for a fine one, of each view.
const ROUGH_PLACES: usize = 150;
const FINE_PLACES: usize = 3000;
/// Rounds of matching and fitting.
const ROUNDS: usize = 5;
/// Least number of places at which surfaces must meet.
const MIN_MET: usize = 30;
/// Places off the matched planes at which surfaces must meet to confirm a pose.
const MIN_CONFIRMED: usize = 15;
/// Of the disagreement that is allowed, how much where no plane is to spare.
const STRICTER: f64 = 0.25;
/// Share of the best score below which another pose is out, however little contradicts it: the true one sees at
/// least so much of what a wrong one with nearer stations does.
const FAR_WORSE: f64 = 0.7;
/// Chance below which it is no luck that another pose is contradicted more often. A room has a handful of poses
/// that are alike, so that of pairs of stations that nothing tells apart one in a hundred may be linked wrongly.
const LUCK: f64 = 1e-3;
/// Probability below which the planes' differences contradict their covariances.
const BEYOND_CHANCE: f64 = 1e-3;

/// What is known of a pose beforehand, from odometry say.
#[derive(Debug, Clone, PartialEq)]
pub struct PosePrior {
    /// Station b's frame to station a's.
    pub b_to_a: Rigid,
    /// Standard deviation of the angle by which it may be off, radians.
    pub rotation_sigma: f64,
    /// Standard deviation of the distance by which its position may be off, metres.
    pub position_sigma: f64,
}

/// How two stations are registered.
#[derive(Debug, Clone, PartialEq)]
pub struct StationOptions {
    /// Planes are the same that, registered, differ by no more than this angle, radians.
    pub max_angle: f64,
    /// And by no more than this in their distance, metres.
    pub max_distance: f64,
    /// Of the places that both stations saw, the least share where both saw a surface.
    pub min_agreement: f64,
    /// Another pose that scores this share of the best one's score makes it ambiguous; so does any that is not
    /// contradicted more often beyond chance.
    pub max_runner_up: f64,
    /// Only poses within three standard deviations of it are considered.
    pub prior: Option<PosePrior>,
}

impl Default for StationOptions {
    fn default() -> Self {
        Self { max_angle: 4f64.to_radians(), max_distance: 0.1, min_agreement: 0.93, max_runner_up: 0.93, prior: None }
    }
}

impl StationOptions {
    pub(crate) fn check(&self) -> Result<()> {
        if !(self.max_angle > 0.0 && self.max_angle <= 0.3) {
            return Err(Error::invalid("max_angle", format!("{} is not in 0 to 0.3 rad", self.max_angle)));
        }
        if !(self.max_distance > 0.0 && self.max_distance.is_finite()) {
            return Err(Error::invalid("max_distance", format!("{} m", self.max_distance)));
        }
        for (name, share) in [("min_agreement", self.min_agreement), ("max_runner_up", self.max_runner_up)] {
            if !(0.0..=1.0).contains(&share) {
                return Err(Error::invalid(name, format!("{share} is no share")));
            }
        }
        let Some(prior) = &self.prior else { return Ok(()) };
        if !prior.b_to_a.is_finite() {
            return Err(Error::NotFinite { name: "prior", index: 0 });
        }
        if crate::geometry::rigid::rotation_defect(&prior.b_to_a.rotation) > 1e-3 {
            return Err(Error::invalid("prior", "its rotation is none"));
        }
        for (name, sigma) in [("rotation_sigma", prior.rotation_sigma), ("position_sigma", prior.position_sigma)] {
            if !(sigma > 0.0 && sigma.is_finite()) {
                return Err(Error::invalid(name, format!("{sigma} is not a positive standard deviation")));
            }
        }
        Ok(())
    }
}

/// The pose of station b in station a's frame, from planes.
#[derive(Debug, Clone, PartialEq)]
pub struct StationPose {
    /// Station b's frame to station a's, X_a = R X_b + t.
    pub b_to_a: Rigid,
    /// Covariance of (w, t): w the rotation vector in `R <- exp([w]x) R`, radians about the axes of a's
    /// frame; t the position of b, metres. Larger where the planes' differences contradict theirs.
    pub covariance: Matrix6<f64>,
    /// Numbers of the planes that are the same, in a and in b.
    pub matches: Vec<[usize; 2]>,
    /// Sum of squares of the planes' differences, in their standard deviations.
    pub chi_square: f64,
    /// Three for each pair of planes, less six.
    pub degrees_of_freedom: usize,
    /// How much better the best-determined direction is than the worst; 1 at best.
    pub condition: f64,
    /// Of the places that both stations saw, the share where both saw a surface.
    pub agreement: f64,
    /// The score of the best other pose, relative to this one's; 0 where there is none.
    pub runner_up: f64,
}

/// Degrees of freedom of the errors of planes that are worse than stated, and rounds of weighing them.
const FREEDOM: f64 = 4.0;
const ROBUST_ROUNDS: usize = 20;

/// Finds the pose between two stations from the planes that both saw. Any number of other planes, and
/// of parallel ones, may be among them.
///
/// # Errors
/// `Degenerate` where the planes of a station, or those that both saw, leave a part of the pose
/// unobservable: the message says which, as numbers; `NoSharedPlanes` where no pose brings three planes
/// in three directions together, or none that agrees with what the stations saw; `AmbiguousStations`
/// where another pose agrees as well, nearly or but for chance, or where nothing confirms the only one;
/// `InvalidArgument` and `NotFinite` for bad options.
pub fn register_stations(a: &StationPlanes, b: &StationPlanes, options: &StationOptions) -> Result<StationPose> {
    options.check()?;
    for (name, station) in [("station_a", a), ("station_b", b)] {
        check_span(name, station.planes.iter().map(|p| p.estimate.n.normalize()))?;
    }
    let pair = Pair { stations: [a, b], sides: [side(a), side(b)], options };
    let ranked = pair.ranked();
    let Some(best) = ranked.first() else {
        return Err(Error::NoSharedPlanes {
            reason: "no pose brings three planes in three directions together".to_owned(),
        });
    };
    if best.verdict.met < MIN_MET || best.verdict.agreement() < options.min_agreement {
        let Verdict { met, crossed, .. } = best.verdict;
        return Err(Error::NoSharedPlanes {
            reason: format!(
                "by the best of {} poses, the stations see a surface in the same place {met} times, and {crossed} \
                 times one sees through a surface of the other",
                ranked.len()
            ),
        });
    }
    // Another pose is possible unless it fits far worse, or the stations contradict it beyond chance.
    let possible = |other: &Judged| {
        let share = other.verdict.score() / best.verdict.score();
        share > options.max_runner_up || share > FAR_WORSE && best.verdict.chance_over(&other.verdict) > LUCK
    };
    let runner_up = ranked[1..].iter().find(|r| r.differs(best, options));
    let relative = runner_up.map_or(0.0, |r| (r.verdict.score() / best.verdict.score()).max(0.0));
    if let Some(other) = ranked[1..].iter().find(|r| r.differs(best, options) && possible(r)) {
        return Err(Error::AmbiguousStations { reason: pair.difference(best, other) });
    }
    if let Some((direction, _)) = pair.sliding(best).iter().find(|(_, r)| possible(r)) {
        return Err(unobservable::sliding(direction));
    }
    let pose = pair.conclude(best, relative)?;
    if options.prior.is_none() && !pair.confirmed(best, &pose) {
        return Err(Error::AmbiguousStations {
            reason: format!(
                "the {} planes that this pose brings together would fit so by chance, and nothing else that both \
                 stations saw confirms it",
                best.matches.len()
            ),
        });
    }
    Ok(pose)
}

/// The pose between two stations from planes that are known to be the same: pairs of their numbers in
/// a and in b.
///
/// # Errors
/// `InvalidArgument` for numbers of no plane; `Degenerate` for planes that leave a part of the pose
/// unobservable, as in [`register_stations`].
pub fn register_matched(a: &StationPlanes, b: &StationPlanes, matches: &[[usize; 2]]) -> Result<StationPose> {
    let stations = [a, b];
    let planes = |k: usize| matches.iter().map(move |pair| pair[k]);
    for (k, station) in stations.iter().enumerate() {
        let mut named = vec![false; station.planes.len()];
        for i in planes(k) {
            match named.get_mut(i) {
                None => return Err(Error::invalid("matches", format!("there is no plane {i}"))),
                Some(true) => return Err(Error::invalid("matches", format!("plane {i} is matched twice"))),
                Some(named) => *named = true,
            }
        }
    }
    for (k, name) in ["what is matched of station_a", "what is matched of station_b"].into_iter().enumerate() {
        check_span(name, planes(k).map(|i| stations[k].planes[i].estimate.n.normalize()))?;
    }
    let options = StationOptions::default();
    let pair = Pair { stations: [a, b], sides: [side(a), side(b)], options: &options };
    let (b_to_a, _) = plane_to_plane(&pair.matched_planes(matches))?;
    let verdict = pair.judge(&b_to_a, matches, FINE_PLACES);
    pair.conclude(&Judged { b_to_a, matches: matches.to_vec(), verdict }, 0.0)
}

/// The same edges of both stations, where two of their common planes meet, for
/// [`estimate_pose_roof_edges`](super::estimate_pose_roof_edges): the thesis's method. Planes that meet
/// at less than `min_angle` (radians) make none.
pub fn common_roof_edges(
    a: &StationPlanes,
    b: &StationPlanes,
    matches: &[[usize; 2]],
    min_angle: f64,
) -> Result<[RoofEdges; 2]> {
    let mut edges = [RoofEdges::new(), RoofEdges::new()];
    for (k, (station, edges)) in [a, b].into_iter().zip(&mut edges).enumerate() {
        for pair in matches {
            let plane = station.planes.get(pair[k]);
            let plane = plane.ok_or_else(|| Error::invalid("matches", format!("there is no plane {}", pair[k])))?;
            edges.add_plane(plane.estimate.clone())?;
        }
    }
    let unit = |station: &StationPlanes, i: usize| station.planes[i].estimate.n.normalize();
    for (i, p) in matches.iter().enumerate() {
        for (j, q) in matches.iter().enumerate().skip(i + 1) {
            let sine = |s: &StationPlanes, k: usize| unit(s, p[k]).cross(&unit(s, q[k])).norm();
            if sine(a, 0).min(sine(b, 1)) > min_angle.sin() {
                edges[0].add_edge(i, j)?;
                edges[1].add_edge(i, j)?;
            }
        }
    }
    Ok(edges)
}

fn side(station: &StationPlanes) -> Side {
    let weight = |p: &FoundPlane| p.support.area.sqrt();
    Side::new(station.planes.iter().map(|p| p.estimate.plane()).collect(), station.planes.iter().map(weight).collect())
}

/// A pose that brings planes together, and what the views say of it.
struct Judged {
    b_to_a: Rigid,
    matches: Vec<[usize; 2]>,
    verdict: Verdict,
}

impl Judged {
    /// Whether it is another pose, not the same one fitted to other planes.
    fn differs(&self, other: &Self, options: &StationOptions) -> bool {
        apart(&self.b_to_a, &other.b_to_a, 2.5 * options.max_angle, 5.0 * options.max_distance)
    }
}

fn apart(p: &Rigid, q: &Rigid, angle: f64, distance: f64) -> bool {
    log(&(p.rotation * q.rotation.transpose())).norm() > angle || (p.translation - q.translation).norm() > distance
}

struct Pair<'a> {
    stations: [&'a StationPlanes; 2],
    sides: [Side; 2],
    options: &'a StationOptions,
}

impl Pair<'_> {
    fn matched_planes(&self, matches: &[[usize; 2]]) -> Vec<MatchedPlane> {
        let matched = |[i, j]: &[usize; 2]| {
            let [a, b] = [&self.stations[0].planes[*i].estimate, &self.stations[1].planes[*j].estimate];
            MatchedPlane { a: a.n, b: b.n, covariance_a: a.covariance, covariance_b: b.covariance }
        };
        matches.iter().map(matched).collect()
    }

    fn judge(&self, b_to_a: &Rigid, matches: &[[usize; 2]], places: usize) -> Verdict {
        let used: Vec<Plane> = matches.iter().map(|[i, _]| self.sides[0].planes[*i]).collect();
        judge(&self.stations[0].view, &self.stations[1].view, b_to_a, &used, places)
    }

    /// Poses that bring planes together, fitted to them, the best first.
    fn ranked(&self) -> Vec<Judged> {
        let [a, b] = &self.sides;
        let mut rough: Vec<Judged> = Vec::new();
        for candidate in candidates(a, b, self.options).into_iter().take(ROUGH) {
            let Some((b_to_a, matches)) = self.settle(candidate.b_to_a) else { continue };
            // Many candidates settle on the same pose.
            if rough.iter().all(|r| apart(&r.b_to_a, &b_to_a, 1e-3, 1e-3)) {
                rough.push(Judged { verdict: self.judge(&b_to_a, &matches, ROUGH_PLACES), b_to_a, matches });
            }
        }
        sort_by_score(&mut rough, |pose| pose);
        rough.truncate(FINE);
        for judged in &mut rough {
            judged.verdict = self.judge(&judged.b_to_a, &judged.matches, FINE_PLACES);
        }
        sort_by_score(&mut rough, |pose| pose);
        rough
    }

    /// Matches planes and fits the pose to them until both stay; `None` where they do not fix it.
    fn settle(&self, mut b_to_a: Rigid) -> Option<(Rigid, Vec<[usize; 2]>)> {
        let [a, b] = &self.sides;
        let mut matches = matched(a, b, &b_to_a, self.options);
        for _ in 0..ROUNDS {
            b_to_a = plane_to_plane(&self.matched_planes(&matches)).ok()?.0;
            let again = matched(a, b, &b_to_a, self.options);
            if again == matches {
                break;
            }
            matches = again;
        }
        check_span("", matches.iter().map(|[i, _]| a.planes[*i].normal)).ok()?;
        Some((b_to_a, matches))
    }

    /// Other poses by which the stations share planes in two directions only, the best first, with the direction
    /// in which each can slide.
    fn sliding(&self, best: &Judged) -> Vec<(Vector3<f64>, Judged)> {
        let [a, b] = &self.sides;
        let judged = |(b_to_a, direction), places| {
            (direction, Judged { b_to_a, matches: Vec::new(), verdict: self.judge(&b_to_a, &[], places) })
        };
        let mut found: Vec<(Vector3<f64>, Judged)> = partial(a, b, self.options)
            .into_iter()
            .map(|pose| judged(pose, ROUGH_PLACES))
            // A rough score errs by a tenth.
            .filter(|(_, pose)| pose.verdict.score() > 0.8 * FAR_WORSE * best.verdict.score())
            .filter(|(_, pose)| pose.differs(best, self.options))
            .collect();
        sort_by_score(&mut found, |(_, pose)| pose);
        found.truncate(FINE);
        let mut fine: Vec<_> = found.into_iter().map(|(d, pose)| judged((pose.b_to_a, d), FINE_PLACES)).collect();
        sort_by_score(&mut fine, |(_, pose)| pose);
        fine
    }

    fn difference(&self, best: &Judged, other: &Judged) -> String {
        let turn = log(&(other.b_to_a.rotation * best.b_to_a.rotation.transpose())).norm().to_degrees();
        let shift = (other.b_to_a.translation - best.b_to_a.translation).norm();
        format!(
            "another pose, turned by {turn:.1} degrees and {shift:.2} m away, agrees with what the stations saw as well \
             ({:.1} and {:.1} % of the places that both saw)",
            100.0 * other.verdict.agreement(),
            100.0 * best.verdict.agreement(),
        )
    }

    /// Whether more speaks for a pose than the planes that were needed to make it. Any two corners of rooms
    /// fit each other, and the heights of rooms are alike: 1 in 20 pairs of partial views would be given
    /// a wrong pose.
    fn confirmed(&self, best: &Judged, pose: &StationPose) -> bool {
        let &Verdict { confirmed, refuted, .. } = &best.verdict;
        if refuted > confirmed.max(MIN_CONFIRMED) {
            return false;
        }
        // The planes that fit to their noise, and whether they do without any one of them, or but one.
        let planes = self.matched_planes(&best.matches);
        let fits = |p: &MatchedPlane| upper_tail(p.distance(&pose.b_to_a), 3.0) >= BEYOND_CHANCE;
        let normals = |used: &dyn Fn(usize) -> bool| {
            let used = planes.iter().enumerate().filter(|(k, _)| used(*k));
            used.map(|(_, p)| p.a.normalize()).collect::<Vec<_>>()
        };
        let spare = |used: &dyn Fn(usize) -> bool| {
            let needed =
                |left_out: &usize| check_span("", normals(&|k| used(k) && k != *left_out).into_iter()).is_err();
            (0..planes.len()).filter(|k| used(*k)).filter(needed).count() <= 1 && normals(used).len() > 3
        };
        let met_elsewhere = confirmed >= MIN_CONFIRMED;
        if spare(&|k| fits(&planes[k])) || met_elsewhere && spare(&|_| true) {
            return true;
        }
        // No more planes than needed: then nearly everything else must agree.
        met_elsewhere && 1.0 - pose.agreement <= STRICTER * (1.0 - self.options.min_agreement)
    }

    fn conclude(&self, best: &Judged, runner_up: f64) -> Result<StationPose> {
        let planes = self.matched_planes(&best.matches);
        let (start, condition) = plane_to_plane(&planes)?;
        let mut fit = maximum_likelihood(&planes, start)?;
        let degrees_of_freedom = 3 * planes.len() - 6;
        let freedom = degrees_of_freedom as f64;
        let chi_square = fit.chi_square;
        // Stated covariances are believed, unless the differences contradict them: some walls are not
        // plane, some instruments bend them, and some planes are not the same after all.
        if upper_tail(chi_square, freedom) < BEYOND_CHANCE {
            fit = robust(&planes, fit)?;
        }
        Ok(StationPose {
            b_to_a: fit.b_to_a,
            covariance: fit.covariance,
            matches: best.matches.clone(),
            chi_square,
            degrees_of_freedom,
            condition,
            agreement: best.verdict.agreement(),
            runner_up,
        })
    }
}

/// Maximum likelihood with errors by Student's t (Lange, Little and Taylor, JASA 1989), of a scale that is
/// fitted too.
fn robust(planes: &[MatchedPlane], mut fit: PlanePose) -> Result<PlanePose> {
    let (count, mut scale) = (planes.len() as f64, (fit.chi_square / (3 * planes.len() - 6) as f64).max(1.0));
    for _ in 0..ROBUST_ROUNDS {
        let distances: Vec<f64> = planes.iter().map(|p| p.distance(&fit.b_to_a)).collect();
        let weight = |d: &f64| (FREEDOM + 3.0) / (FREEDOM + d / scale);
        let weights: Vec<f64> = distances.iter().map(weight).collect();
        // As many equations as are left by the pose's six parameters.
        let sum: f64 = weights.iter().zip(&distances).map(|(w, d)| w * d).sum();
        scale = (sum / (3.0 * count - 6.0)).max(1.0);
        let weighted: Vec<MatchedPlane> = planes.iter().zip(&weights).map(|(p, w)| p.scaled(scale / w)).collect();
        fit = maximum_likelihood(&weighted, fit.b_to_a)?;
    }
    Ok(fit)
}

fn sort_by_score<T>(poses: &mut [T], judged: impl Fn(&T) -> &Judged) {
    poses.sort_by(|p, q| judged(q).verdict.score().total_cmp(&judged(p).verdict.score()));
}
