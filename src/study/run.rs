//! The noise study (thesis VII, VIII.D): Monte Carlo over trials, noise levels and methods.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use nalgebra::{DMatrix, DVector};

use super::expected::{Expected, expected};
use super::information::NoiseLevel;
use super::method::{Method, ShotNoise, estimate, pinhole};
use super::moments::{Draw, PointSet};
use super::normals::Normals;
use super::setup::SetUp;
use super::statistics::{Cell, HandOff, Sums};
use crate::calibrate::decompose;
use crate::control::{Cancel, unpoisoned};
use crate::error::{Error, Result};
use crate::geometry::{Camera, RIG_PARAMETERS, Rigid};

/// Most trials of a study, noise levels, distances, and estimates in all.
pub const MAX_TRIALS: usize = 100_000;
pub const MAX_LEVELS: usize = 10_000;
pub const MAX_DISTANCES: usize = 1000;
pub const MAX_ESTIMATES: usize = 100_000_000;
/// Most noise, px: beyond this nothing is seen.
pub const MAX_NOISE: f64 = 1000.0;
/// Most threads.
pub const MAX_THREADS: usize = 1024;

/// Which noise the levels share.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum Draws {
    /// A trial's noise is drawn once and scaled to every level (common random numbers): differences
    /// between levels are theirs and not luck's, and nearly all the work is shared.
    #[default]
    Common = 0,
    /// Every level draws its own.
    Independent = 1,
}

#[derive(Debug, Clone)]
pub struct StudyOptions {
    pub methods: Vec<Method>,
    pub levels: Vec<NoiseLevel>,
    pub trials: usize,
    pub draws: Draws,
    pub seed: u64,
    /// Distances from the fixed camera at which points are handed off, metres.
    pub distances: Vec<f64>,
    /// Worker threads; the result does not depend on them.
    pub threads: usize,
    pub cancel: Cancel,
}

impl Default for StudyOptions {
    fn default() -> Self {
        Self {
            methods: vec![Method::DltExact, Method::DltCascade, Method::ClosedForm, Method::JointMl],
            levels: vec![NoiseLevel { head: 0.2, fixed: 0.2 }],
            trials: 100,
            draws: Draws::Common,
            seed: 1,
            distances: vec![1.0, 2.0, 3.0, 4.0, 5.0],
            threads: 1,
            cancel: Cancel::new(),
        }
    }
}

impl StudyOptions {
    /// Levels of a whole grid, the head camera's noise outermost.
    pub fn grid(head: &[f64], fixed: &[f64]) -> Vec<NoiseLevel> {
        head.iter().flat_map(|&head| fixed.iter().map(move |&fixed| NoiseLevel { head, fixed })).collect()
    }

    /// # Errors
    /// `InvalidArgument`, `NotFinite`.
    pub fn validate(&self) -> Result<()> {
        let within = |name, count: usize, most: usize| match count {
            0 => Err(Error::invalid(name, "none")),
            n if n > most => Err(Error::invalid(name, format!("{n}; {most} are possible"))),
            _ => Ok(()),
        };
        within("trials", self.trials, MAX_TRIALS)?;
        within("levels", self.levels.len(), MAX_LEVELS)?;
        within("methods", self.methods.len(), Method::ALL.len())?;
        within("threads", self.threads, MAX_THREADS)?;
        within("trials", self.trials * self.levels.len() * self.methods.len(), MAX_ESTIMATES)?;
        if self.distances.len() > MAX_DISTANCES {
            return Err(Error::invalid("distances", format!("{}; {MAX_DISTANCES} are possible", self.distances.len())));
        }
        for (index, level) in self.levels.iter().enumerate() {
            for s in [level.head, level.fixed] {
                if !s.is_finite() {
                    return Err(Error::NotFinite { name: "levels", index });
                }
                if !(0.0..=MAX_NOISE).contains(&s) {
                    return Err(Error::invalid("levels", format!("noise of {s} px")));
                }
            }
        }
        check_distances(&self.distances)?;
        match (1..self.methods.len()).find(|i| self.methods[..*i].contains(&self.methods[*i])) {
            Some(i) => Err(Error::invalid("methods", format!("{} twice", self.methods[i].name()))),
            None => Ok(()),
        }
    }
}

pub(super) fn check_distances(distances: &[f64]) -> Result<()> {
    for (index, d) in distances.iter().enumerate() {
        if !d.is_finite() {
            return Err(Error::NotFinite { name: "distances", index });
        }
        if *d <= 0.0 {
            return Err(Error::invalid("distances", format!("{d} m")));
        }
    }
    Ok(())
}

/// The answer of a study.
#[derive(Debug, Clone)]
pub struct Study {
    pub set_up: SetUp,
    pub options: StudyOptions,
    /// For every method, in the order asked for, one for every level.
    pub cells: Vec<Cell>,
    /// For every level what the closed-form covariance of [`Method::JointMl`] predicts; empty when no
    /// method takes shots.
    pub expected: Vec<Expected>,
}

impl Study {
    /// Runs it. `progress` hears on the calling thread how many of how many trials are done.
    ///
    /// # Errors
    /// Those of [`StudyOptions::validate`] and of the set-up; `Degenerate` when the shots do not
    /// determine the camera; `Cancelled`.
    pub fn run(
        set_up: &SetUp,
        options: &StudyOptions,
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Self> {
        options.validate()?;
        set_up.site.validate()?;
        // Exact points have no depth to be unsure of: what is expected is about shots.
        let of_shots = options.methods.iter().any(|m| m.takes_shots());
        let levels = options.levels.iter().filter(|_| of_shots);
        let expected = levels.map(|l| expected(set_up, l, &options.distances)).collect::<Result<_>>()?;
        let trials = Trials::new(set_up, options)?;
        let sums = trials.run(&mut progress)?;
        let levels = options.levels.len();
        let cell = |(i, sums): (usize, Sums)| {
            sums.finish(options.methods[i / levels], options.levels[i % levels], options.distances.len())
        };
        let cells = sums.into_iter().enumerate().map(cell).collect();
        Ok(Self { set_up: set_up.clone(), options: options.clone(), cells, expected })
    }

    /// The cells of a method, one for each level; empty when it was not asked for.
    pub fn cells_of(&self, method: Method) -> &[Cell] {
        let levels = self.options.levels.len();
        let place = self.options.methods.iter().position(|m| *m == method);
        place.and_then(|i| self.cells.get(i * levels..(i + 1) * levels)).unwrap_or_default()
    }
}

/// Everything that trials share.
struct Trials<'a> {
    set_up: &'a SetUp,
    options: &'a StudyOptions,
    points: Option<PointSet>,
    control: Option<PointSet>,
    handoff: HandOff,
    /// Nearest and farthest shot.
    depths: [f64; 2],
    /// Root of the rig prior's covariance.
    rig_root: DMatrix<f64>,
}

impl<'a> Trials<'a> {
    fn new(set_up: &'a SetUp, options: &'a StudyOptions) -> Result<Self> {
        let wanted = |method| options.methods.contains(&method);
        let site = &set_up.site;
        let printed = wanted(Method::DltCascadePrinted);
        let points = if printed || wanted(Method::DltExact) {
            let points: Vec<_> = set_up.shots.iter().map(|s| s.point).collect();
            Some(PointSet::new(&points, &site.camera)?)
        } else {
            None
        };
        if printed && set_up.control.is_empty() {
            return Err(Error::invalid("control", "the cascade as printed needs points that the head camera sees"));
        }
        let head = site.rig.head_camera(0.0, 0.0);
        let control = if printed { Some(PointSet::new(&set_up.control, &head)?) } else { None };
        let depth = |least: f64, most: fn(f64, f64) -> f64| set_up.shots.iter().map(|s| s.depth).fold(least, most);
        Ok(Self {
            set_up,
            options,
            points,
            control,
            handoff: HandOff::new(&site.camera, &options.distances),
            depths: [depth(f64::INFINITY, f64::min), depth(0.0, f64::max)],
            rig_root: root(site.rig_prior.covariance())?,
        })
    }

    /// Sums of all cells. Blocks of trials are shared out among the threads and added in their order.
    fn run(&self, progress: &mut impl FnMut(usize, usize) -> ControlFlow<()>) -> Result<Vec<Sums>> {
        let total = self.options.trials;
        let length = total.div_ceil(64);
        let blocks = total.div_ceil(length);
        let (next, done, stop) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicBool::new(false));
        let results = std::sync::Mutex::new(vec![None; blocks]);
        let work = |progress: &mut dyn FnMut() -> ControlFlow<()>| {
            loop {
                let block = next.fetch_add(1, Ordering::Relaxed);
                if block >= blocks || stop.load(Ordering::Relaxed) {
                    return;
                }
                let trials = block * length..total.min((block + 1) * length);
                let mut sums = vec![Sums::default(); self.options.methods.len() * self.options.levels.len()];
                for trial in trials {
                    if self.options.cancel.is_cancelled() || stop.load(Ordering::Relaxed) {
                        return stop.store(true, Ordering::Relaxed);
                    }
                    self.trial(trial, &mut sums);
                    done.fetch_add(1, Ordering::Relaxed);
                    if progress().is_break() {
                        return stop.store(true, Ordering::Relaxed);
                    }
                }
                unpoisoned(&results)[block] = Some(sums);
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..self.options.threads.min(blocks) {
                scope.spawn(|| work(&mut || ControlFlow::Continue(())));
            }
            work(&mut || progress(done.load(Ordering::Relaxed), total));
        });
        let results = results.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        let mut blocks = results.into_iter().map(|block| block.ok_or(Error::Cancelled));
        let mut sums = blocks.next().unwrap_or(Err(Error::Cancelled))?;
        for block in blocks {
            sums.iter_mut().zip(&block?).for_each(|(sum, later)| sum.append(later));
        }
        Ok(sums)
    }

    fn trial(&self, trial: usize, sums: &mut [Sums]) {
        let levels: Vec<usize> = (0..self.options.levels.len()).collect();
        match self.options.draws {
            Draws::Common => self.levels(trial, &levels, sums),
            Draws::Independent => {
                for level in levels {
                    self.levels(self.options.trials * (level + 1) + trial, &[level], sums);
                }
            }
        }
    }

    /// All methods at some levels with noise number `draw`.
    fn levels(&self, draw: usize, levels: &[usize], sums: &mut [Sums]) {
        /// Streams of a draw: points, control points, shots, rig.
        const STREAMS: u64 = 4;
        let (options, site) = (self.options, &self.set_up.site);
        let normals = |stream: u64| Normals::new(options.seed, draw as u64 * STREAMS + stream);
        let mut fixed = self.points.as_ref().map(|set| Solutions::new(set, &mut normals(0)));
        let mut head = self.control.as_ref().map(|set| Solutions::new(set, &mut normals(1)));
        let noise = options.methods.iter().any(|m| m.takes_shots()).then(|| {
            let step = self.rig_step(&mut normals(3));
            ShotNoise::draw(site, self.set_up.shots.len(), &step, &mut normals(2))
        });
        for &index in levels {
            let level = &options.levels[index];
            let measured = noise.as_ref().map(|n| n.measure(site, &self.set_up.shots, level));
            for (m, method) in options.methods.iter().enumerate() {
                let from_points = |fixed: &mut Option<Solutions>| {
                    fixed.as_mut()?.at(level.fixed).and_then(|p| pinhole(site, &p).ok())
                };
                let camera = match method {
                    Method::DltExact => from_points(&mut fixed),
                    Method::DltCascadePrinted => from_points(&mut fixed).and_then(|camera| {
                        let (_, pose) = decompose::decompose(&head.as_mut()?.at(level.head)?).ok()?;
                        Some(moved(&camera, &site.rig.head_to_world(0.0, 0.0).after(&pose)))
                    }),
                    _ => measured.as_ref().and_then(|measured| {
                        estimate(*method, site, measured, level, self.depths, &options.cancel).ok()
                    }),
                };
                let cell = &mut sums[m * options.levels.len() + index];
                cell.add(camera.as_ref(), &site.camera, &self.handoff);
            }
        }
    }

    /// The true rig's parameters less the believed ones.
    fn rig_step(&self, normals: &mut Normals) -> [f64; RIG_PARAMETERS] {
        let unit = normals.pairs(RIG_PARAMETERS);
        let step = &self.rig_root * DVector::from_iterator(RIG_PARAMETERS, unit.iter().map(|[x, _]| *x));
        std::array::from_fn(|i| step[i])
    }
}

/// The camera calibrated from points that eq. (23) moved: it stands where the points were taken to.
fn moved(camera: &Camera, motion: &Rigid) -> Camera {
    Camera { pose: camera.pose.after(&motion.inverse()), ..*camera }
}

/// Lower triangular root of a covariance, zero for parameters that are fixed or of which nothing is known.
fn root(covariance: &DMatrix<f64>) -> Result<DMatrix<f64>> {
    let n = covariance.nrows();
    let held: Vec<usize> = (0..n).filter(|i| covariance[(*i, *i)] > 0.0 && covariance[(*i, *i)].is_finite()).collect();
    let mut all = DMatrix::zeros(n, n);
    if held.is_empty() {
        return Ok(all);
    }
    let block = DMatrix::from_fn(held.len(), held.len(), |i, j| covariance[(held[i], held[j])]);
    let l = nalgebra::Cholesky::new(block)
        .ok_or_else(|| Error::invalid("rig prior", "its covariance is not positive definite"))?
        .unpack();
    for (i, a) in held.iter().enumerate() {
        for (j, b) in held.iter().enumerate() {
            all[(*a, *b)] = l[(i, j)];
        }
    }
    Ok(all)
}

/// DLT of a point set with one noise, solved once for every level that asks.
struct Solutions<'a> {
    set: &'a PointSet,
    draw: Draw,
    known: Vec<(f64, Option<nalgebra::Matrix3x4<f64>>)>,
}

impl<'a> Solutions<'a> {
    fn new(set: &'a PointSet, normals: &mut Normals) -> Self {
        Self { set, draw: set.draw(normals), known: Vec::new() }
    }

    fn at(&mut self, sigma: f64) -> Option<nalgebra::Matrix3x4<f64>> {
        if let Some((_, p)) = self.known.iter().find(|(s, _)| *s == sigma) {
            return *p;
        }
        let p = self.set.solve(&self.draw, sigma);
        self.known.push((sigma, p));
        p
    }
}
