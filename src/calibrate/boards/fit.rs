//! Adjusts and sets outliers aside in turn until the set stands still: corners by their distance,
//! views of which half of the corners are off, laser spots.

use nalgebra::{Matrix2, Vector2, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_core::SeedableRng;

use super::adjust::{
    Adjusted, CAUTIOUS, CONFIDENT, Covariance, Loss, Prior, Problem, Seen, Stop, ViewData, adjust_pose,
};
use super::model::{self, BEND, GLOBALS, LASER, Sheet, State};
use super::start::{Start, pose_under, positions, reversed};
use super::views::{BoardCorner, BoardView, Boards, MIN_CORNERS};
use crate::calibrate::CalibrationOptions;
use crate::calibrate::consensus::{CHI2_MEDIAN, some};
use crate::calibrate::freedom::{Freedom, ROTATION, Unknown};
use crate::calibrate::measurement::squared_distance;
use crate::calibrate::residuals;
use crate::calibrate::solve::{ASSUMED_SIGMA, MAX_ROUNDS, OUTLIER, significant};
use crate::error::{Error, Result};
use crate::geometry::rig_model::LaserLine;
use crate::geometry::{Camera, Rigid};

/// Distance, in units of the noise, beyond which Cauchy's loss lets go while outliers are still in.
const CAUCHY: f64 = 3.0;
/// Ends of adjustments (squared steps, of all unknowns together, in units of the noise): while the noise
/// itself is sought, residuals then move by far less than that; while outliers are; and of the last.
const ROUGH: f64 = 1.0;
const COARSE: f64 = 1e-4;
const FINE: f64 = 1e-10;
/// Corners of a view that say enough while lens and noise are found roughly.
const ROUGH_CORNERS: usize = 64;
/// One view cannot tell the principal point from the board's tilt: it is then expected at the image's
/// centre, to within this part of the image's width.
const CENTRE_SIGMA: f64 = 0.05;

/// What is used.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Selection {
    /// False for a view that is set aside as a whole.
    pub views: Vec<bool>,
    pub corners: Vec<Vec<bool>>,
    /// False also where there is no spot.
    pub spots: Vec<bool>,
}

impl Selection {
    pub fn corner_count(&self) -> usize {
        self.corners.iter().flatten().filter(|c| **c).count()
    }

    fn spot_count(&self) -> usize {
        self.spots.iter().filter(|s| **s).count()
    }
}

pub(crate) struct Fitted {
    /// Poses of all views; of those set aside the best that could be had.
    pub state: State,
    pub selection: Selection,
    /// Of the used views only.
    pub covariance: Covariance,
    /// Estimated noise over assumed noise.
    pub noise_factor: f64,
    /// Sum of squared whitened residuals, priors not counted, and its degrees of freedom.
    pub chi2: f64,
    pub freedom: usize,
    pub iterations: usize,
}

pub(crate) struct Fitter<'a> {
    boards: &'a Boards,
    options: &'a CalibrationOptions,
    unknowns: Vec<Unknown>,
    /// Lens priors in units of the focal length.
    freedom: Freedom,
    /// Other priors.
    priors: Vec<Prior>,
    sheet: Sheet,
    sigma: f64,
    /// Nobody stated the noise of a pixel: it is estimated.
    assumed: bool,
    /// That noise is one for all.
    common: bool,
}

/// An adjustment of all that is used, and the noise that it took for granted.
struct Begun {
    adjusted: Adjusted,
    factor: f64,
}

impl<'a> Fitter<'a> {
    pub fn new(boards: &'a Boards, options: &'a CalibrationOptions) -> Self {
        let freedom = Freedom::of(options);
        let stated = |v: &BoardView| {
            v.corners.iter().any(|c| c.pixel_covariance.is_some())
                || v.spot.is_some_and(|s| s.pixel_covariance.is_some())
        };
        let lens = freedom.unknowns.iter().filter(|u| u.parameter < ROTATION).copied();
        let mut fitter = Self {
            boards,
            options,
            unknowns: lens.collect(),
            freedom,
            priors: Vec::new(),
            sheet: sheet(boards),
            sigma: options.pixel_sigma.unwrap_or(ASSUMED_SIGMA),
            assumed: options.pixel_sigma.is_none()
                && boards.views().iter().any(|v| v.corners.iter().any(|c| c.pixel_covariance.is_none())),
            common: !boards.views().iter().any(stated),
        };
        if boards.bending() > 0.0 {
            for parameter in BEND..LASER {
                fitter.free(parameter);
                fitter.expect(parameter, 0.0, boards.bending());
            }
        }
        if boards.views().len() == 1 && options.fixed_lens.is_none() {
            let (w, h) = (f64::from(boards.width()), f64::from(boards.height()));
            fitter.expect(3, (w - 1.0) * 0.5, CENTRE_SIGMA * w);
            fitter.expect(4, (h - 1.0) * 0.5, CENTRE_SIGMA * w);
        }
        fitter
    }

    /// The laser's line too.
    pub fn with_laser(mut self) -> Self {
        (LASER..GLOBALS).for_each(|parameter| self.free(parameter));
        self
    }

    /// A lens that is fixed otherwise is free in these parameters, which `priors` hold.
    pub fn with_lens_priors(mut self, free: &[usize], priors: Vec<Prior>) -> Self {
        free.iter().for_each(|parameter| self.free(*parameter));
        self.priors.extend(priors);
        self
    }

    fn free(&mut self, parameter: usize) {
        self.unknowns.push(Unknown { parameter, tied: None });
    }

    fn expect(&mut self, parameter: usize, value: f64, sigma: f64) {
        let mut row = [0.0; GLOBALS];
        row[parameter] = 1.0 / sigma;
        self.priors.push(Prior { row, value: value / sigma });
    }

    /// Parameters of the adjustment of that many views.
    pub fn parameters(&self, views: usize) -> usize {
        self.unknowns.len() + model::POSE * views
    }

    /// From a closed-form start.
    pub fn run(&self, start: Start, plane: &[bool]) -> Result<Fitted> {
        let no_laser = LaserLine { x0: 0.0, y0: 0.0, vx: 0.0, vy: 0.0 };
        let state = State { camera: start.camera, bend: Vector3::zeros(), laser: no_laser, poses: start.poses };
        let mut selection = Selection {
            views: plane.to_vec(),
            corners: self.boards.views().iter().map(|v| vec![true; v.corners.len()]).collect(),
            spots: vec![false; plane.len()],
        };
        let distances = self.distances(&state);
        self.drop_invisible(&distances, &mut selection)?;
        let thin = self.thinned(&selection);
        let mut factor = self.floor(self.noise(&distances, &thin));
        let loss = if self.options.robust { Loss::Cauchy(CAUCHY) } else { Loss::Squares };
        let mut state = self.adjust(&state, &thin, factor, loss, ROUGH, None)?.0;
        if self.options.robust {
            // While the lens comes in the noise falls, and with it what an outlier is.
            for _ in 0..5 {
                let next = self.floor(self.noise(&self.distances(&state), &thin));
                if next > 0.7 * factor {
                    break;
                }
                factor = next;
                state = self.adjust(&state, &thin, factor, loss, ROUGH, None)?.0;
            }
        }
        self.reverse_poses(&mut state, &thin, factor, loss)?;
        self.settle(state, selection)
    }

    /// With no more corners of a view than say enough for the beginning, taken at random.
    fn thinned(&self, selection: &Selection) -> Selection {
        let mut random = ChaCha8Rng::seed_from_u64(self.options.seed);
        let mut thin = selection.clone();
        for corners in &mut thin.corners {
            let used: Vec<usize> = (0..corners.len()).filter(|c| corners[*c]).collect();
            if used.len() > ROUGH_CORNERS {
                corners.fill(false);
                some(&used, ROUGH_CORNERS, &mut random).iter().for_each(|c| corners[*c] = true);
            }
        }
        thin
    }

    /// From a state near the solution whose selection may still have wrong spots.
    pub fn run_laser(&self, mut state: State, selection: Selection, factor: f64) -> Result<Fitted> {
        if self.options.robust {
            state = self.adjust(&state, &selection, self.floor(factor), Loss::Cauchy(CAUCHY), COARSE, None)?.0;
        }
        self.settle(state, selection)
    }

    /// From a state near the solution: outliers set aside until the selection stands still.
    fn settle(&self, mut state: State, mut selection: Selection) -> Result<Fitted> {
        let mut distances = self.distances(&state);
        let mut factor = self.floor(self.noise(&distances, &selection));
        let mut begun = None;
        if self.options.robust {
            for round in 0..MAX_ROUNDS {
                let poses = state.poses.clone();
                let next = self.classify(&mut state, &distances, &selection, factor)?;
                if next != selection || state.poses != poses {
                    begun = None;
                }
                if next == selection && round > 0 {
                    break;
                }
                selection = next;
                let (adjusted_state, adjusted) =
                    self.adjust(&state, &selection, factor, Loss::Squares, COARSE, begun.take())?;
                state = adjusted_state;
                begun = Some(Begun { adjusted, factor });
                distances = self.distances(&state);
                factor = self.floor(self.noise(&distances, &selection));
            }
        }
        self.finish(state, selection, factor, begun)
    }

    /// The last adjustment, at the noise that its own residuals show.
    fn finish(&self, state: State, selection: Selection, factor: f64, begun: Option<Begun>) -> Result<Fitted> {
        let (mut state, mut adjusted) = self.adjust(&state, &selection, factor, Loss::Squares, FINE, begun)?;
        let used = selection.views.iter().filter(|v| **v).count();
        let equations = 2 * (selection.corner_count() + selection.spot_count());
        let freedom = equations.saturating_sub(self.parameters(used));
        let spread = if freedom > 0 { (adjusted.chi2() / freedom as f64).sqrt() } else { 1.0 };
        let mut noise_factor = spread;
        if self.assumed {
            noise_factor = self.floor(factor * spread);
            let begun = Some(Begun { adjusted, factor });
            (state, adjusted) = self.adjust(&state, &selection, noise_factor, Loss::Squares, FINE, begun)?;
        }
        let mut covariance = adjusted.covariance(&self.unknowns)?;
        if !self.assumed && spread > significant(freedom) {
            // Known noises that the residuals contradict: the covariance says what the data show.
            covariance.globals *= spread * spread;
            covariance.poses.iter_mut().for_each(|c| *c *= spread * spread);
        }
        let (chi2, iterations) = (adjusted.chi2(), adjusted.iterations);
        Ok(Fitted { state, selection, covariance, noise_factor, chi2, freedom, iterations })
    }

    /// Adjusts the used views; the state that comes back has the poses of all. Goes on with what was begun
    /// from there with the same selection and loss.
    fn adjust(
        &self,
        state: &State,
        selection: &Selection,
        factor: f64,
        loss: Loss,
        step: f64,
        begun: Option<Begun>,
    ) -> Result<(State, Adjusted)> {
        let used: Vec<usize> = (0..selection.views.len()).filter(|v| selection.views[*v]).collect();
        let views: Vec<ViewData> = used
            .iter()
            .map(|&v| self.data(v, &selection.corners[v], selection.spots[v], factor))
            .collect::<Result<_>>()?;
        let equations = 2 * (selection.corner_count() + selection.spot_count());
        if equations < self.parameters(used.len()) {
            let needed = self.parameters(used.len()).div_ceil(2);
            return Err(Error::TooFewPoints { given: equations / 2, needed });
        }
        let focal = state.camera.intrinsics.fx;
        let scaled = self.freedom.priors.iter().map(|p| {
            let mut row = [0.0; GLOBALS];
            row[..ROTATION].iter_mut().zip(p).for_each(|(to, from)| *to = from / focal);
            Prior { row, value: 0.0 }
        });
        let priors: Vec<Prior> = scaled.chain(self.priors.iter().cloned()).collect();
        let problem = Problem { views: &views, unknowns: &self.unknowns, priors: &priors, sheet: self.sheet, loss };
        let poses = used.iter().map(|v| state.poses[*v]).collect();
        let adjusted = match begun.filter(|_| self.common || !self.assumed) {
            Some(mut begun) => {
                if self.assumed {
                    begun.adjusted.scale(begun.factor / factor);
                }
                problem.go_on(&mut begun.adjusted, &self.stop(step))?;
                begun.adjusted
            }
            None => problem.adjust(State { poses, ..state.clone() }, &self.stop(step))?,
        };
        let mut all = State { poses: state.poses.clone(), ..adjusted.state.clone() };
        for (v, pose) in used.iter().zip(&adjusted.state.poses) {
            all.poses[*v] = *pose;
        }
        Ok((all, adjusted))
    }

    fn stop(&self, step: f64) -> Stop<'a> {
        let damping = if step == ROUGH { CAUTIOUS } else { CONFIDENT };
        Stop { max_iterations: self.options.max_iterations, step, damping, cancel: &self.options.cancel }
    }

    fn seen(&self, pixel: &Vector2<f64>, covariance: Option<&Matrix2<f64>>, factor: f64) -> Result<Seen> {
        let common = if self.assumed { self.sigma * factor } else { self.sigma };
        let covariance = covariance.copied().unwrap_or_else(|| Matrix2::identity() * (common * common));
        Seen::new(*pixel, &covariance).ok_or_else(|| Error::invalid("uv covariance", "is singular"))
    }

    fn data(&self, view: usize, used: &[bool], spot: bool, factor: f64) -> Result<ViewData> {
        let v = &self.boards.views()[view];
        let mut data = ViewData::default();
        for (c, _) in v.corners.iter().zip(used).filter(|(_, used)| **used) {
            data.add(&c.board, &self.seen(&c.pixel, c.pixel_covariance.as_ref(), factor)?);
        }
        let spot = v.spot.filter(|_| spot);
        data.spot = spot.map(|s| self.seen(&s.pixel, s.pixel_covariance.as_ref(), factor)).transpose()?;
        Ok(data)
    }

    /// Squared distances of all corners of every view, in units of the stated or assumed noise.
    fn distances(&self, state: &State) -> Vec<Vec<f64>> {
        (0..state.poses.len()).map(|view| self.view_distances(state, &state.poses[view], view)).collect()
    }

    fn view_distances(&self, state: &State, pose: &Rigid, view: usize) -> Vec<f64> {
        let camera = Camera { pose: *pose, ..state.camera };
        let corners = &self.boards.views()[view].corners;
        let points = corners.iter().map(|c| (self.sheet.point(&state.bend, &c.board), c.pixel));
        let common = 1.0 / (self.sigma * self.sigma);
        let distance = |(c, r): (&BoardCorner, &Vector2<f64>)| match &c.pixel_covariance {
            _ if !r.x.is_finite() => f64::INFINITY,
            None => r.norm_squared() * common,
            Some(covariance) => squared_distance(r, covariance),
        };
        corners.iter().zip(&residuals::of_points(&camera, points)).map(distance).collect()
    }

    /// By what a corner's squared distance must be divided when the noise is `factor` times the assumed one.
    fn unit(&self, corner: &BoardCorner, factor: f64) -> f64 {
        if self.assumed && corner.pixel_covariance.is_none() { factor * factor } else { 1.0 }
    }

    /// Squared distance of a view's spot from where the laser meets the board.
    pub fn spot_distance(&self, state: &State, view: usize, factor: f64) -> Result<f64> {
        let Some(spot) = &self.boards.views()[view].spot else { return Ok(f64::INFINITY) };
        let seen = self.seen(&spot.pixel, spot.pixel_covariance.as_ref(), factor)?;
        let predicted = model::spot(state, &self.sheet, &state.poses[view]);
        Ok(predicted.map_or(f64::INFINITY, |p| seen.whiten(&(spot.pixel - p.pixel)).norm_squared()))
    }

    /// Noise from the median distance of the used corners, in units of the assumed one.
    fn noise(&self, distances: &[Vec<f64>], selection: &Selection) -> f64 {
        let mut d = Vec::with_capacity(selection.corner_count());
        let used = selection.views.iter().enumerate().filter(|(_, used)| **used);
        for (view, _) in used.clone() {
            let corners = distances[view].iter().zip(&selection.corners[view]);
            d.extend(corners.filter(|(_, used)| **used).map(|(d, _)| *d));
        }
        if d.is_empty() {
            return f64::INFINITY;
        }
        // Parameters take up some of the residuals: the median of what is left.
        let taken = self.parameters(used.count()) / 2;
        let rank = ((d.len() + taken) / 2).min(d.len() - 1);
        (*d.select_nth_unstable_by(rank, f64::total_cmp).1 / CHI2_MEDIAN).sqrt()
    }

    /// A stated noise is never taken for smaller; an assumed one has no floor but rounding.
    fn floor(&self, factor: f64) -> f64 {
        factor.max(if self.assumed { 1e-6 } else { 1.0 })
    }

    /// Corners that the first estimate puts behind the camera or outside the lens are left out.
    fn drop_invisible(&self, distances: &[Vec<f64>], selection: &mut Selection) -> Result<()> {
        let mut before = 0;
        for (view, d) in distances.iter().enumerate() {
            let visible: Vec<bool> = d.iter().map(|d| d.is_finite()).collect();
            if !self.options.robust
                && let Some(index) = visible.iter().position(|v| !v)
            {
                return Err(Error::BehindCamera { index: before + index });
            }
            before += d.len();
            selection.views[view] &= enough(&visible);
            selection.corners[view] = if selection.views[view] { visible } else { vec![false; d.len()] };
        }
        Ok(())
    }

    /// What agrees with a state. A view that does not gets a new chance from a pose of its own.
    fn classify(
        &self,
        state: &mut State,
        distances: &[Vec<f64>],
        before: &Selection,
        factor: f64,
    ) -> Result<Selection> {
        let limit = OUTLIER * if self.assumed { 1.0 } else { factor * factor };
        let agreeing = |view: usize, distances: &[f64]| -> Vec<bool> {
            let corners = self.boards.views()[view].corners.iter().zip(distances);
            corners.map(|(c, d)| *d <= limit * self.unit(c, factor)).collect()
        };
        let mut next = before.clone();
        for (view, own) in distances.iter().enumerate() {
            let mut mask = agreeing(view, own);
            if !enough(&mask) {
                self.pose_afresh(state, view, factor)?;
                mask = agreeing(view, &self.view_distances(state, &state.poses[view], view));
            }
            next.views[view] = enough(&mask);
            next.corners[view] = if next.views[view] { mask } else { vec![false; mask.len()] };
            if self.unknowns.iter().any(|u| u.parameter >= LASER) {
                next.spots[view] = next.views[view] && self.spot_distance(state, view, factor)? <= limit;
            }
        }
        let (used, all) = (next.corner_count(), next.corners.iter().map(Vec::len).sum());
        let views = next.views.iter().filter(|v| **v).count();
        if 2 * views < next.views.len() || used * 5 < all * 2 {
            return Err(Error::NoConsensus { inliers: used, total: all });
        }
        Ok(next)
    }

    /// Poses a view from nothing but its corners and the lens.
    fn pose_afresh(&self, state: &mut State, view: usize, factor: f64) -> Result<()> {
        let board = &self.boards.views()[view];
        let Some(pose) = pose_under(&state.camera, board, self.options) else { return Ok(()) };
        state.poses[view] = pose;
        let data = self.data(view, &vec![true; board.corners.len()], false, factor)?;
        match adjust_pose(&data, state, pose, self.sheet, Loss::Cauchy(CAUCHY), &self.stop(COARSE)) {
            Ok((pose, _)) => state.poses[view] = pose,
            Err(Error::Cancelled) => return Err(Error::Cancelled),
            // The closed form's pose stays.
            Err(_) => {}
        }
        Ok(())
    }

    /// Reverses the tilt of boards that fit better so.
    fn reverse_poses(&self, state: &mut State, selection: &Selection, factor: f64, loss: Loss) -> Result<()> {
        for (view, board) in self.boards.views().iter().enumerate().filter(|(v, _)| selection.views[*v]) {
            let other = reversed(&state.poses[view], board);
            let cost = |pose: &Rigid| -> f64 {
                let d = self.view_distances(state, pose, view);
                let corners = board.corners.iter().zip(&d).zip(&selection.corners[view]);
                let used = corners.filter(|(_, used)| **used).map(|((c, d), _)| d / self.unit(c, factor));
                used.map(|d| d.min(CAUCHY * CAUCHY * 10.0)).sum()
            };
            // Far apart in cost, they cannot change places.
            if cost(&other) > 16.0 * cost(&state.poses[view]) {
                continue;
            }
            let data = self.data(view, &selection.corners[view], selection.spots[view], factor)?;
            let adjust = |pose| adjust_pose(&data, state, pose, self.sheet, loss, &self.stop(COARSE));
            if let (Ok((_, own)), Ok((pose, cost))) = (adjust(state.poses[view]), adjust(other))
                && cost < own
            {
                state.poses[view] = pose;
            }
        }
        Ok(())
    }
}

/// Enough of a view's corners agree for it to count.
fn enough(mask: &[bool]) -> bool {
    let used = mask.iter().filter(|m| **m).count();
    used >= MIN_CORNERS && 2 * used >= mask.len()
}

/// The frame of a sheet's monomials: the middle of all corners, and the farthest from there.
pub(crate) fn sheet(boards: &Boards) -> Sheet {
    let all: Vec<Vector2<f64>> = boards.views().iter().flat_map(|v: &BoardView| positions(v)).collect();
    let (low, high) =
        all.iter().fold((Vector2::repeat(f64::MAX), Vector2::repeat(f64::MIN)), |(l, h), p| (l.inf(p), h.sup(p)));
    let centre = (low + high) * 0.5;
    Sheet { centre, scale: all.iter().fold(0.0f64, |m, p| m.max((p - centre).norm())) }
}
