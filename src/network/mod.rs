//! Stations along a path, tied by the planes that they share: each pair of stations is registered on its
//! own ([`register_stations`]), planes that are the same become one, loops of stations are closed as a test,
//! and the shots that hit the planes enter the joint adjustment ([`adjust`](crate::adjust::adjust)), which
//! puts all stations and every fixed camera that any of them lit into one frame, with their covariance.

mod loops;
mod merge;

use std::ops::ControlFlow;

use crate::adjust::{Adjustment, Station};
use crate::control::Cancel;
use crate::error::{Error, Result};
use crate::geometry::InverseDepthPoint;
use crate::pose::{
    FindPlanesOptions, PosePrior, StationOptions, StationPlanes, StationPose, find_planes_in_shots, register_stations,
};
pub use loops::LoopClosure;

/// Stations of one survey: every pair is tried.
const MAX_STATIONS: usize = 100;

/// How stations are tied.
#[derive(Debug, Clone)]
pub struct TieOptions {
    pub planes: FindPlanesOptions,
    /// Without a prior, unless there is one pair: what is known of the stations' poses, the survey says.
    pub stations: StationOptions,
    /// Pairs of stations to register; `None`: all.
    pub pairs: Option<Vec<[usize; 2]>>,
    /// Chance below which a loop of stations does not close: the tie is refused.
    pub min_closure: f64,
    pub cancel: Cancel,
}

impl Default for TieOptions {
    fn default() -> Self {
        Self {
            planes: FindPlanesOptions::default(),
            stations: StationOptions::default(),
            pairs: None,
            min_closure: 1e-6,
            cancel: Cancel::new(),
        }
    }
}

/// Two stations and what their planes say of them.
#[derive(Debug, Clone)]
pub struct Link {
    pub stations: [usize; 2],
    /// The second station's pose in the frame of the first; or why there is none.
    pub pose: Result<StationPose>,
}

/// What ties the stations of a survey.
#[derive(Debug, Clone)]
pub struct Ties {
    /// Every pair that was tried.
    pub links: Vec<Link>,
    /// Loops of links, and how well each closes.
    pub loops: Vec<LoopClosure>,
    /// Planes that were added to the survey.
    pub planes: usize,
    /// Shots that hit one of them.
    pub shots: usize,
}

/// Finds the planes that the stations of a survey share, and adds them to it with the shots that hit them.
/// Adjusting the survey then finds the stations; their poses need not be known, but what the survey says of
/// them (odometry, with its covariance) settles what planes alone leave ambiguous. Shots that the head camera
/// did not see say nothing here. A survey that is refused is left as it was.
///
/// `progress` hears how many steps are done and how many there are (each station is one, then each pair), and
/// stops the work by `Break`.
///
/// # Errors
/// `BadState` when a station without a pose shares planes with none of the others (the message has the
/// reason of each pair); `AmbiguousStations` when a loop of stations does not close; `InvalidArgument` for
/// bad options, for one prior of several pairs and for more than a hundred stations; `Cancelled`.
pub fn tie_stations(
    survey: &mut Adjustment,
    options: &TieOptions,
    mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Ties> {
    let count = survey.stations().len();
    if count > MAX_STATIONS {
        return Err(Error::invalid("stations", format!("{count}, more than {MAX_STATIONS}")));
    }
    options.stations.check()?;
    let pairs = pairs(count, options)?;
    let steps = count + pairs.len();
    let mut tell = |done: usize| match progress(done, steps) {
        ControlFlow::Continue(()) => options.cancel.check(),
        ControlFlow::Break(()) => Err(Error::Cancelled),
    };
    let mut seen = Vec::new();
    for station in 0..count {
        tell(station)?;
        seen.push(Seen::of(survey, station, options)?);
    }
    let mut links = Vec::new();
    for [a, b] in pairs {
        tell(count + links.len())?;
        let pose = match (&seen[a].planes, &seen[b].planes) {
            (Ok(from), Ok(to)) => {
                let prior = options.stations.prior.clone().or_else(|| odometry(survey, a, b));
                register_stations(from, to, &StationOptions { prior, ..options.stations.clone() })
            }
            (Err(e), _) | (_, Err(e)) => Err(e.clone()),
        };
        links.push(Link { stations: [a, b], pose });
    }
    tell(steps)?;
    let loops = loops::close(count, &links);
    if let Some(open) = loops.iter().find(|l| l.probability < options.min_closure) {
        return Err(Error::AmbiguousStations { reason: open.to_string() });
    }
    demand_tied(survey, &links)?;
    let planes = merge::planes(&seen, &links);
    let mut tied = survey.clone();
    let mut shots = 0;
    for plane in &planes {
        let index = tied.add_plane(options.planes.flatness.clamp(1e-6, 1.0))?;
        for &(station, own) in plane {
            for shot in seen[station].hits(own) {
                tied.set_plane(shot, index)?;
                shots += 1;
            }
        }
    }
    *survey = tied;
    Ok(Ties { links, loops, planes: planes.len(), shots })
}

fn pairs(count: usize, options: &TieOptions) -> Result<Vec<[usize; 2]>> {
    let all = || (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b])).collect();
    let pairs: Vec<[usize; 2]> = options.pairs.clone().unwrap_or_else(all);
    for (i, [a, b]) in pairs.iter().enumerate() {
        if a == b || *a >= count || *b >= count {
            return Err(Error::invalid("pairs", format!("{a} and {b} of {count} stations")));
        }
        if pairs[..i].iter().any(|[c, d]| [c, d] == [a, b] || [d, c] == [a, b]) {
            return Err(Error::invalid("pairs", format!("{a} and {b} twice")));
        }
    }
    if options.stations.prior.is_some() && pairs.len() > 1 {
        return Err(Error::invalid("prior", format!("one for {} pairs: give the stations' poses", pairs.len())));
    }
    if !(0.0..=1.0).contains(&options.min_closure) {
        return Err(Error::invalid("min_closure", format!("{} is no probability", options.min_closure)));
    }
    Ok(pairs)
}

/// What the survey says of the pose of b in the frame of a, as far as it says something of both.
fn odometry(survey: &Adjustment, a: usize, b: usize) -> Option<PosePrior> {
    let told = |station: usize| {
        let station = &survey.stations()[station];
        let c = station.prior.covariance();
        let worst = |first: usize| (first..first + 3).map(|i| c[(i, i)]).fold(0.0, f64::max);
        let (turn, shift) = (worst(0), worst(3));
        (turn.is_finite() && shift.is_finite()).then_some((station.pose?, turn, shift))
    };
    let ((from, turn_a, shift_a), (to, turn_b, shift_b)) = (told(a)?, told(b)?);
    let b_to_a = from.inverse().after(&to);
    // What is fixed is known to a millimetre.
    let floor = 1e-6;
    Some(PosePrior {
        b_to_a,
        rotation_sigma: (turn_a + turn_b + floor).sqrt(),
        position_sigma: (shift_a + shift_b + turn_a * b_to_a.translation.norm_squared() + floor).sqrt(),
    })
}

/// The planes that one station saw.
struct Seen {
    planes: Result<StationPlanes>,
    /// Of each measurement of `planes` its shot in the survey.
    shots: Vec<usize>,
}

impl Seen {
    fn of(survey: &Adjustment, station: usize, options: &TieOptions) -> Result<Self> {
        let (mut shots, mut points) = (Vec::new(), Vec::<InverseDepthPoint>::new());
        for (index, shot) in survey.shots().iter().enumerate().filter(|(_, s)| s.station == station) {
            let Some((pixel, covariance)) = &shot.head else { continue };
            if survey.plane_of(index).is_some() {
                continue;
            }
            if let Ok(depth) = survey.rig().measure(shot.pan, shot.tilt, pixel, covariance) {
                shots.push(index);
                points.push(depth.point);
            }
        }
        let planes = match find_planes_in_shots(&points, &options.planes) {
            Err(e @ (Error::InvalidArgument { .. } | Error::Cancelled)) => return Err(e),
            found => found,
        };
        Ok(Self { planes, shots })
    }

    /// The shots that hit a plane.
    fn hits(&self, plane: usize) -> impl Iterator<Item = usize> + '_ {
        let labels = self.planes.as_ref().map_or(&[][..], |p| &p.labels);
        let hit = move |label: &Option<u16>| label.is_some_and(|l| usize::from(l) == plane);
        labels.iter().zip(&self.shots).filter(move |(label, _)| hit(label)).map(|(_, shot)| *shot)
    }
}

/// Every station hangs, by links, on one with a pose, or on one that cameras may place.
fn demand_tied(survey: &Adjustment, links: &[Link]) -> Result<()> {
    let stations = survey.stations();
    let placed = |(index, station): (usize, &Station)| station.pose.is_some() || shares_camera(survey, index);
    let mut reached: Vec<bool> = stations.iter().enumerate().map(placed).collect();
    let mut grown = true;
    while grown {
        grown = false;
        for link in links.iter().filter(|l| l.pose.is_ok()) {
            let [a, b] = link.stations;
            if reached[a] != reached[b] {
                (reached[a], reached[b], grown) = (true, true, true);
            }
        }
    }
    let Some(lost) = reached.iter().position(|r| !r) else { return Ok(()) };
    let reasons: Vec<String> = links
        .iter()
        .filter(|l| l.stations.contains(&lost))
        .filter_map(|l| Some(format!("{} and {}: {}", l.stations[0], l.stations[1], l.pose.as_ref().err()?)))
        .collect();
    Err(Error::BadState { reason: format!("station {lost} shares no planes with the others ({})", reasons.join("; ")) })
}

fn shares_camera(survey: &Adjustment, station: usize) -> bool {
    let sees = |wanted: &dyn Fn(usize) -> bool, camera: usize| {
        let sightings = survey.shots().iter().filter(|s| wanted(s.station)).flat_map(|s| &s.sightings);
        sightings.filter(|s| s.camera == camera).count() >= 6
    };
    (0..survey.cameras().len()).any(|camera| sees(&|s| s == station, camera) && sees(&|s| s != station, camera))
}
