//! Driving a head over its range and taking its pictures.

use std::ops::ControlFlow;

use nalgebra::Vector2;

use super::pairs::{Features, MIN_MATCHES, Pair, features, pair};
use super::start::start;
use super::{AngleLearningOptions, AngleViews, LearnedAngles, solve, tracks};
use crate::control::{Cancel, Clock, Log, LogLevel};
use crate::device::{Frame, FrameSource, PanTiltZoom, PtzCapabilities, PtzPosition};
use crate::error::{Error, Result};
use crate::geometry::rigid::log as rotation_vector;
use crate::geometry::{Camera, Rigid};
use crate::rig::settle::{Mover, SettleOptions};

/// First move of the exploration, its least and its greatest, shares of an axis's range.
const FIRST_MOVE: f64 = 0.02;
const MOVES: [f64; 2] = [0.0012, 0.35];
/// A turn by this share of the picture gives its scale well enough to plan with.
const ENOUGH_TURN: f64 = 0.08;
/// Positions within this share of an axis's range are the same where the device does not tell its step.
const DEFAULT_STEP: f64 = 1e-3;
const NAMES: [&str; 2] = ["pan", "tilt"];

/// What the work is done with.
pub struct LearningParts<'a> {
    pub head: &'a mut dyn PanTiltZoom,
    /// Frames of the camera on the head.
    pub frames: &'a mut dyn FrameSource,
    /// Its lens; the pose does not matter.
    pub camera: Camera,
    /// The clock that stamps the frames.
    pub clock: &'a dyn Clock,
    pub log: &'a Log,
}

/// How far the work is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LearningProgress {
    /// Frames taken, and to be taken; 0 in all while the plan is made.
    pub frames: usize,
    pub total: usize,
}

/// Turns the head over its range and learns its angles. Zoom is left as it is: the camera must be the
/// one for it. The head is stopped on every way out that is an error.
///
/// # Errors
/// `InvalidArgument` for options, a camera or a range that make no sense, and for more frames than
/// allowed; `NotFound` without texture, and when an axis does not turn the picture; `TooFewMatches` when
/// frames have too little in common, or too little of an axis's range was tied together; `Ambiguous` for
/// an axis that turns both ways; `Cancelled`; the devices' own, also for a head that never stands still;
/// those of [`solve`].
pub fn learn_angles(
    parts: &mut LearningParts<'_>,
    options: &AngleLearningOptions,
    cancel: &Cancel,
    progress: &mut dyn FnMut(&LearningProgress) -> ControlFlow<()>,
) -> Result<LearnedAngles> {
    options.validate()?;
    parts.camera.validate()?;
    parts.camera.check_lens()?;
    let result = Session::new(parts, options, cancel).and_then(|mut s| {
        let plan = s.plan(progress)?;
        s.take(&plan, progress)?;
        s.answer()
    });
    if result.is_err() {
        // The first error is the one to report.
        let _ = parts.head.stop();
    }
    result
}

struct Session<'a> {
    head: &'a mut dyn PanTiltZoom,
    source: &'a mut dyn FrameSource,
    clock: &'a dyn Clock,
    log: &'a Log,
    camera: Camera,
    options: &'a AngleLearningOptions,
    cancel: &'a Cancel,
    capabilities: PtzCapabilities,
    settle: SettleOptions,
    pictures: [Frame; 2],
    features: Vec<Features>,
    raw: Vec<[f64; 2]>,
    cells: Vec<[usize; 2]>,
}

/// Positions of each axis.
type Plan = [Vec<f64>; 2];

impl<'a> Session<'a> {
    fn new(parts: &'a mut LearningParts<'_>, options: &'a AngleLearningOptions, cancel: &'a Cancel) -> Result<Self> {
        let mut c = parts.head.capabilities();
        let spans = [c.pan_range, c.tilt_range].map(|[low, high]| high - low);
        if let Some(axis) = spans.iter().position(|s| !(*s > 0.0 && s.is_finite())) {
            let range = [c.pan_range, c.tilt_range][axis];
            return Err(Error::invalid("head", format!("it reports the {} range {range:?}", NAMES[axis])));
        }
        for (step, span) in [(&mut c.pan_step, spans[0]), (&mut c.tilt_step, spans[1])] {
            if !(*step > 0.0 && step.is_finite()) {
                *step = DEFAULT_STEP * span;
            }
        }
        let overshoot = options.approach * spans[0].min(spans[1]);
        Ok(Self {
            head: &mut *parts.head,
            source: &mut *parts.frames,
            clock: parts.clock,
            log: parts.log,
            camera: Camera { pose: Rigid::identity(), ..parts.camera },
            options,
            cancel,
            capabilities: c,
            settle: SettleOptions { tolerance: 0.0, overshoot, ..options.settle },
            pictures: [Frame::empty(), Frame::empty()],
            features: Vec::new(),
            raw: Vec::new(),
            cells: Vec::new(),
        })
    }

    fn range(&self, axis: usize) -> [f64; 2] {
        [self.capabilities.pan_range, self.capabilities.tilt_range][axis]
    }

    /// Goes there from below, and gives where the device says it is and what is seen.
    fn look(&mut self, target: [f64; 2]) -> Result<([f64; 2], Features)> {
        let PtzPosition { pan, tilt, .. } = Mover {
            ptz: &mut *self.head,
            capabilities: &self.capabilities,
            frames: &mut *self.source,
            size: [self.camera.width, self.camera.height],
            clock: self.clock,
            log: self.log,
            settle: self.settle,
            frame_options: self.options.frames,
            // Both axes move before every frame, so that each frame has an error of its own.
            approached: &mut false,
            pictures: &mut self.pictures,
            earliest_look: 1.0,
        }
        .approach(Vector2::from(target), self.cancel)?
        .position;
        let at = if self.capabilities.reports_position { [pan, tilt] } else { target };
        Ok((at, features(&self.pictures[1].image.view()?, &self.camera)?))
    }

    /// The positions to go to: neighbours are a share of the picture apart.
    fn plan(&mut self, progress: &mut dyn FnMut(&LearningProgress) -> ControlFlow<()>) -> Result<Plan> {
        tell(progress, 0, 0)?;
        let centre = [0, 1].map(|axis| 0.5 * self.range(axis).iter().sum::<f64>());
        let (at, seen) = self.look(centre)?;
        if seen.rays.len() < MIN_MATCHES {
            let reason =
                format!("{} features in the picture: the scene has no texture, or is dark or blurred", seen.rays.len());
            return Err(Error::NotFound { reason });
        }
        let mut plan = [Vec::new(), Vec::new()];
        for (axis, positions) in plan.iter_mut().enumerate() {
            let scale = self.explore(axis, centre, at, &seen, progress)?;
            let [low, high] = self.range(axis);
            // The lowest position is approached from below, too.
            let low = low + self.settle.overshoot;
            let step = self.options.step * self.field_of_view(axis) / scale;
            let count = ((high - low) / step).ceil().min(1e6) as usize + 1;
            let count = count.max(self.options.min_positions);
            *positions = (0..count.min(1 << 16)).map(|i| low + (high - low) * i as f64 / (count - 1) as f64).collect();
        }
        let total = plan[0].len() * plan[1].len();
        if total > self.options.max_frames {
            let reason = format!(
                "{} x {} frames are needed: zoom out (and use that lens), or allow more",
                plan[0].len(),
                plan[1].len()
            );
            return Err(Error::invalid("max_frames", reason));
        }
        Ok(plan)
    }

    /// Radians across the middle of the picture.
    fn field_of_view(&self, axis: usize) -> f64 {
        let [w, h] = [self.camera.width, self.camera.height].map(|s| f64::from(s) - 1.0);
        let ends = if axis == 0 { [[0.0, h / 2.0], [w, h / 2.0]] } else { [[w / 2.0, 0.0], [w / 2.0, h]] };
        let rays = ends.map(|[x, y]| self.camera.back_project(&Vector2::new(x, y)).map(|r| r.direction.normalize()));
        match rays {
            [Some(a), Some(b)] => a.cross(&b).norm().atan2(a.dot(&b)),
            // A fisheye's image circle may end inside the picture.
            _ => w.min(h) / self.camera.intrinsics.fx,
        }
    }

    /// Radians per device's unit about the centre: small moves grow until the picture turns enough, and
    /// shrink until it is recognised.
    fn explore(
        &mut self,
        axis: usize,
        centre: [f64; 2],
        at: [f64; 2],
        seen: &Features,
        progress: &mut dyn FnMut(&LearningProgress) -> ControlFlow<()>,
    ) -> Result<f64> {
        let [low, high] = self.range(axis);
        let (mut share, mut best, mut lost) = (FIRST_MOVE, None, false);
        while (MOVES[0]..=MOVES[1]).contains(&share) {
            tell(progress, 0, 0)?;
            let mut target = centre;
            target[axis] += share * (high - low);
            let (there, now) = self.look(target)?;
            let moved = (there[axis] - at[axis]).abs();
            match pair([0, 1], seen, &now, &self.camera)? {
                Some(p) if moved > 0.0 => {
                    let turn = rotation_vector(&p.rotation).norm();
                    best = Some((turn, turn / moved));
                    if lost || turn > ENOUGH_TURN * self.field_of_view(axis) {
                        break;
                    }
                    share *= 2.0;
                }
                Some(_) => share *= 2.0,
                None if best.is_some() => break,
                None => {
                    lost = true;
                    share *= 0.5;
                }
            }
        }
        match best {
            Some((turn, scale)) if turn > 0.01 * self.field_of_view(axis) => Ok(scale),
            Some(_) => Err(Error::NotFound {
                reason: format!("{} does not turn the picture: does the head move?", NAMES[axis]),
            }),
            None => {
                let detail = format!("nothing is recognised after a small move in {}", NAMES[axis]);
                Err(Error::TooFewMatches { needed: MIN_MATCHES, detail })
            }
        }
    }

    fn take(&mut self, plan: &Plan, progress: &mut dyn FnMut(&LearningProgress) -> ControlFlow<()>) -> Result<()> {
        let total = plan[0].len() * plan[1].len();
        for (row, tilt) in plan[1].iter().enumerate() {
            for (column, pan) in plan[0].iter().enumerate() {
                tell(progress, self.raw.len(), total)?;
                let (at, seen) = self.look([*pan, *tilt])?;
                self.raw.push(at);
                self.features.push(seen);
                self.cells.push([column, row]);
            }
        }
        tell(progress, total, total)
    }

    fn pairs(&self) -> Result<Vec<Pair>> {
        const NEIGHBOURS: [[isize; 2]; 6] = [[1, 0], [0, 1], [1, 1], [-1, 1], [2, 0], [0, 2]];
        let mut pairs = Vec::new();
        for (a, cell) in self.cells.iter().enumerate() {
            self.cancel.check()?;
            for by in NEIGHBOURS {
                let Some(column) = cell[0].checked_add_signed(by[0]) else { continue };
                let there = [column, cell[1] + by[1].unsigned_abs()];
                if let Some(b) = self.cells.iter().position(|c| *c == there) {
                    pairs.extend(pair([a, b], &self.features[a], &self.features[b], &self.camera)?);
                }
            }
        }
        Ok(pairs)
    }

    fn answer(&self) -> Result<LearnedAngles> {
        let pairs = self.pairs()?;
        let mut matches = vec![0; self.raw.len()];
        for p in &pairs {
            matches[p.a] += p.matches.len();
            matches[p.b] += p.matches.len();
        }
        let reference = (0..matches.len()).max_by_key(|k| matches[*k]).unwrap_or(0);
        let start = start(&self.raw, &self.cells, &pairs, reference)?;
        // Frames that see too few points hang loose; without them others may.
        let mut used: Vec<usize> = start.frames.clone();
        let tracks = loop {
            let mut number = vec![None; self.raw.len()];
            used.iter().enumerate().for_each(|(i, k)| number[*k] = Some(i));
            let tracks = tracks(&self.features, &pairs, &number);
            let mut seen = vec![0; used.len()];
            tracks.iter().flatten().for_each(|s| seen[s.frame] += 1);
            let before = used.len();
            let mut count = seen.iter();
            used.retain(|_| count.next().is_some_and(|c| *c >= MIN_MATCHES));
            if used.len() == before {
                break tracks;
            }
        };
        self.check_cover(&used)?;
        if used.len() < self.raw.len() {
            self.log.write(LogLevel::Warning, || {
                format!(
                    "{} of {} frames have too little in common with others",
                    self.raw.len() - used.len(),
                    self.raw.len()
                )
            });
        }
        let angles = used.iter().filter_map(|k| start.frames.iter().position(|f| f == k).map(|i| start.angles[i]));
        let views = AngleViews {
            raw: used.iter().map(|k| self.raw[*k]).collect(),
            angles: angles.collect(),
            mounting: start.mounting,
            tracks,
        };
        solve(&views, &self.camera, self.options, self.cancel)
    }

    fn check_cover(&self, used: &[usize]) -> Result<()> {
        for (axis, name) in NAMES.iter().enumerate() {
            let places = used.iter().map(|k| self.raw[*k][axis]);
            let (least, greatest) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), r| (a.min(r), b.max(r)));
            let [low, high] = self.range(axis);
            let share = ((greatest - least) / (high - low)).max(0.0);
            if share < self.options.min_cover {
                let detail = format!(
                    "pictures are tied together over {:.0} % of the {name} range ({} of {} frames)",
                    100.0 * share,
                    used.len(),
                    self.raw.len()
                );
                return Err(Error::TooFewMatches { needed: MIN_MATCHES, detail });
            }
        }
        Ok(())
    }
}

fn tell(progress: &mut dyn FnMut(&LearningProgress) -> ControlFlow<()>, frames: usize, total: usize) -> Result<()> {
    match progress(&LearningProgress { frames, total }) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(Error::Cancelled),
    }
}
