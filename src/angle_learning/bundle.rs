//! Pan and tilt of every frame, the mounting and the lever arms from scene points that several frames
//! see: a bundle adjustment in which the camera turns about the head's two axes and does nothing else.
//!
//! A camera whose centre is not on the axes moves as it turns, and near things shift against far ones.
//! Pictures give only the product of lever arms and inverse depth, so that the length of all lever arms
//! together is a fixed gauge, points have inverse depths in its unit, and the prior is that of the product.
//! (With both free, the most probable lever arms are too long: smaller depths cost less.) What turning and
//! shifting have in common becomes part of the angles' covariance. Depths near each other are alike: all
//! have a mean, and each frame one about it, so that a thousand points of one wall do not count as a
//! thousand times the prior.
//!
//! Errors are taken to have the t distribution with 4 degrees of freedom (K. L. Lange, R. J. A. Little and
//! J. M. G. Taylor, Robust statistical modeling using the t distribution, JASA 84, 1989), fitted by
//! Levenberg-Marquardt with the points eliminated; its information is (v + 2) / (v + 4) of the weighted one.

use nalgebra::{Cholesky, DMatrix, DVector, Matrix2x3, Matrix3, Matrix3x2, SMatrix, Vector2, Vector3};

use crate::control::Cancel;
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::angle_map::Mounting;
use crate::geometry::rigid::{log, rotation_x, rotation_y};
use crate::geometry::{Camera, Rigid};

/// Degrees of freedom of the errors' distribution.
const FREEDOM: f64 = 4.0;
/// Prior standard deviations of collimation, roll and trunnion, radians: what mechanics gets wrong at most.
const MOUNTING_PRIOR: [f64; 3] = [0.05, 0.3, 0.01];
const MAX_ITERATIONS: usize = 60;
/// A step that lowers the cost (minus twice a log likelihood) by less is far within the standard deviations;
/// and the most that may be left when the iterations are used up.
const CONVERGED: f64 = 1e-3;
const NEARLY: f64 = 0.1;
/// Times that the noise is estimated anew.
const ROUNDS: usize = 4;
/// Parameters that all frames share: mounting, lever arms, mean inverse depth.
const COMMON: usize = 8;
const MEAN: usize = 7;
/// Parameters that a pose may depend on: what all frames share, pan and tilt.
const POSE: usize = COMMON + 2;
/// Parameters of a frame: pan, tilt, mean inverse depth.
const OWN: usize = 3;

/// What a frame sees of a scene point.
#[derive(Debug, Clone, Copy)]
pub struct Sight {
    pub frame: usize,
    pub pixel: Vector2<f64>,
    /// Standard deviation relative to others.
    pub sigma: f64,
}

/// What is known beforehand of depths and lever arms.
#[derive(Debug, Clone, Copy)]
pub struct DepthPrior {
    /// 1 / m, for lever arms of the gauge's length: mean of all inverse depths, and standard deviation of
    /// this mean, of a frame's mean from it and of a point's depth from that.
    pub inverse_depth: f64,
    pub sigma: f64,
    /// Metres: tilt_y, tilt_z, pan_x, pan_z as in a rig's axis offsets; their length is the gauge.
    pub levers: [f64; 4],
    pub lever_sigma: f64,
}

impl DepthPrior {
    /// `scene`: inverse depths, mean and standard deviation; `levers`: tilt_y, tilt_z, pan_x, pan_z.
    pub fn new([mean, sigma]: [f64; 2], levers: [f64; 4], lever_sigma: f64) -> Self {
        let length = length(&levers);
        if length > lever_sigma {
            // Of a product of two independent numbers.
            let relative = lever_sigma / length;
            let variance = sigma.powi(2) + (mean * relative).powi(2) + (relative * sigma).powi(2);
            return Self { inverse_depth: mean, sigma: variance.sqrt(), levers, lever_sigma: lever_sigma.max(1e-6) };
        }
        // Unknown: the centre may be ahead of the axes or behind them, by a standard deviation.
        let arm = lever_sigma.max(1e-3);
        let share = (lever_sigma / arm) * 0.5f64.sqrt();
        Self {
            inverse_depth: 0.0,
            sigma: (share * mean.hypot(sigma)).max(1e-6),
            levers: [0.0, arm, 0.0, arm],
            lever_sigma: arm,
        }
    }
}

fn length(levers: &[f64; 4]) -> f64 {
    levers.iter().map(|l| l * l).sum::<f64>().sqrt()
}

/// Where every frame looks, and the rest.
#[derive(Debug, Clone)]
pub struct State {
    pub mounting: Mounting,
    levers: [f64; 4],
    /// Mean inverse depth.
    pub mean: f64,
    /// Pan and tilt, radians.
    pub angles: Vec<[f64; 2]>,
    means: Vec<f64>,
    /// Directions (unit) and inverse depths from the pan axis, in the frame of the axes.
    points: Vec<(Vector3<f64>, f64)>,
}

pub struct Solution {
    pub state: State,
    /// Of pan and tilt, frame after frame, given that the pan of the reference is exact.
    pub covariance: DMatrix<f64>,
    pub mounting_sigma: [f64; 3],
    /// Of the mean inverse depth.
    pub mean_sigma: f64,
    /// px, of every sight, track after track.
    pub residuals: Vec<Vec<Vector2<f64>>>,
}

pub struct Problem<'a> {
    pub camera: &'a Camera,
    pub tracks: &'a [Vec<Sight>],
    pub prior: DepthPrior,
    /// The frame whose pan is the gauge.
    pub reference: usize,
    pub cancel: &'a Cancel,
}

/// Camera to the axes' frame, and the camera's centre in it, metres.
pub fn camera_pose(m: &Mounting, levers: &[f64; 4], [pan, tilt]: [f64; 2]) -> (Matrix3<f64>, Vector3<f64>) {
    let rotation_z = |angle: f64| {
        let (s, c) = angle.sin_cos();
        Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
    };
    let tilting = rotation_z(m.trunnion) * rotation_x(tilt);
    let centre = tilting * Vector3::new(0.0, levers[0], levers[1]) + Vector3::new(levers[2], 0.0, levers[3]);
    let rotation = rotation_y(pan) * tilting * rotation_y(m.collimation) * rotation_z(m.roll);
    (rotation, rotation_y(pan) * centre)
}

/// A frame's pose and its derivatives by what all frames share, pan and tilt.
struct Pose {
    camera: Camera,
    rotation: SMatrix<f64, 3, POSE>,
    centre: SMatrix<f64, 3, POSE>,
}

impl State {
    pub fn new(mounting: Mounting, angles: Vec<[f64; 2]>, problem: &Problem<'_>) -> Self {
        let prior = &problem.prior;
        let mut state = Self {
            mounting,
            levers: prior.levers,
            mean: prior.inverse_depth,
            means: vec![prior.inverse_depth; angles.len()],
            angles,
            points: vec![],
        };
        state.points =
            problem.tracks.iter().map(|track| (state.direction(track, problem.camera), prior.inverse_depth)).collect();
        state
    }

    /// Lever arm ahead of the pan axis, metres.
    pub fn ahead(&self) -> f64 {
        self.levers[1] + self.levers[3]
    }

    /// The mean direction of a track's sights.
    fn direction(&self, track: &[Sight], camera: &Camera) -> Vector3<f64> {
        let rays = track.iter().filter_map(|s| {
            let ray = Camera { pose: Rigid::identity(), ..*camera }.back_project(&s.pixel)?;
            Some(camera_pose(&self.mounting, &[0.0; 4], self.angles[s.frame]).0 * ray.direction.normalize())
        });
        rays.fold(Vector3::zeros(), |a, b| a + b).try_normalize(1e-9).unwrap_or(Vector3::z())
    }

    fn pose_at(&self, camera: &Camera, frame: usize, step: &[f64; POSE]) -> Camera {
        let m = Mounting {
            collimation: self.mounting.collimation + step[0],
            roll: self.mounting.roll + step[1],
            trunnion: self.mounting.trunnion + step[2],
        };
        let levers = std::array::from_fn(|i| self.levers[i] + step[3 + i]);
        let [pan, tilt] = self.angles[frame];
        let (rotation, centre) = camera_pose(&m, &levers, [pan + step[COMMON], tilt + step[COMMON + 1]]);
        Camera { pose: Rigid::from_centre(rotation.transpose(), &centre), ..*camera }
    }

    fn pose(&self, camera: &Camera, frame: usize) -> Pose {
        const H: f64 = 1e-6;
        let here = self.pose_at(camera, frame, &[0.0; POSE]);
        let (mut rotation, mut centre) = (SMatrix::<f64, 3, POSE>::zeros(), SMatrix::<f64, 3, POSE>::zeros());
        for i in 0..POSE {
            let at = |h: f64| {
                let mut step = [0.0; POSE];
                step[i] = h;
                self.pose_at(camera, frame, &step)
            };
            let (plus, minus) = (at(H), at(-H));
            let turn = log(&(plus.pose.rotation * minus.pose.rotation.transpose())) / (2.0 * H);
            rotation.set_column(i, &turn);
            centre.set_column(i, &((plus.centre() - minus.centre()) / (2.0 * H)));
        }
        Pose { camera: here, rotation, centre }
    }

    fn moved(&self, step: &DVector<f64>, points: &[Vector3<f64>]) -> Self {
        let mut next = self.clone();
        next.mounting.collimation += step[0];
        next.mounting.roll += step[1];
        next.mounting.trunnion += step[2];
        (0..4).for_each(|i| next.levers[i] += step[3 + i]);
        let shrink = length(&self.levers) / length(&next.levers);
        next.levers.iter_mut().for_each(|l| *l *= shrink);
        next.mean += step[MEAN];
        for (k, angles) in next.angles.iter_mut().enumerate() {
            let at = COMMON + OWN * k;
            angles[0] += step[at];
            angles[1] += step[at + 1];
            next.means[k] += step[at + 2];
        }
        for ((direction, depth), by) in next.points.iter_mut().zip(points) {
            *direction = (*direction + tangent(direction) * by.xy()).normalize();
            *depth += by.z;
        }
        next
    }
}

/// Two directions across a unit vector.
fn tangent(b: &Vector3<f64>) -> Matrix3x2<f64> {
    let other = Vector3::ith(b.iamin(), 1.0);
    let u = b.cross(&other).normalize();
    Matrix3x2::from_columns(&[u, b.cross(&u)])
}

impl Problem<'_> {
    /// # Errors
    /// `Cancelled`; `Degenerate` when the tracks leave a direction open; `NoConvergence`.
    pub fn solve(&self, start: State) -> Result<Solution> {
        let (mut state, mut noise) = (start, 1.0);
        for round in 0..ROUNDS {
            let mut damping = 1e-4;
            let mut cost = self.cost(&state, noise);
            let (mut done, mut last) = (false, f64::INFINITY);
            for _ in 0..MAX_ITERATIONS {
                self.cancel.check()?;
                let linear = self.linearise(&state, noise);
                let mut lowered = false;
                while damping < 1e8 {
                    let next = linear.step(damping).map(|(step, points)| state.moved(&step, &points));
                    let value = next.as_ref().map_or(f64::INFINITY, |s| self.cost(s, noise));
                    if let Some(next) = next.filter(|_| value < cost) {
                        last = cost - value;
                        done = last < CONVERGED;
                        (state, cost, damping, lowered) = (next, value, damping * 0.1, true);
                        break;
                    }
                    damping *= 10.0;
                }
                if !lowered || done {
                    done = true;
                    break;
                }
            }
            if !done && last > NEARLY && round + 1 == ROUNDS {
                return Err(Error::NoConvergence {
                    iterations: MAX_ITERATIONS,
                    detail: "of the frames' angles".into(),
                });
            }
            noise = self.noise(&state, noise);
        }
        self.finish(state, noise)
    }

    fn residual(&self, state: &State, poses: &[Camera], point: usize, sight: &Sight) -> Option<Vector2<f64>> {
        let (direction, depth) = state.points[point];
        let seen = poses[sight.frame].project_homogeneous(&direction, depth)?;
        Some(sight.pixel - seen.pixel)
    }

    fn cameras(&self, state: &State) -> Vec<Camera> {
        (0..state.angles.len()).map(|k| state.pose_at(self.camera, k, &[0.0; POSE])).collect()
    }

    /// Minus twice the logarithm of the posterior.
    fn cost(&self, state: &State, noise: f64) -> f64 {
        let poses = self.cameras(state);
        let mut sum = self.priors(state).iter().map(|(_, value, sigma)| (value / sigma).powi(2)).sum::<f64>();
        sum += state.means.iter().map(|m| ((m - state.mean) / self.prior.sigma).powi(2)).sum::<f64>();
        for (p, track) in self.tracks.iter().enumerate() {
            for sight in track {
                // A sight that the point left behind costs as much as one at the other end of the picture.
                let far = f64::from(self.camera.width);
                let r = self.residual(state, &poses, p, sight).map_or(far * far, |r| r.norm_squared());
                sum += (FREEDOM + 2.0) * (r / (FREEDOM * (noise * sight.sigma).powi(2))).ln_1p();
            }
            let (_, depth) = state.points[p];
            sum += ((depth - state.means[track[0].frame]) / self.prior.sigma).powi(2);
        }
        sum
    }

    /// Index, deviation and standard deviation.
    fn priors(&self, state: &State) -> Vec<(usize, f64, f64)> {
        let m = &state.mounting;
        let mounting = [m.collimation, m.roll, m.trunnion].into_iter().zip(MOUNTING_PRIOR);
        let levers = (0..4).map(|i| (state.levers[i] - self.prior.levers[i], self.prior.lever_sigma));
        let mean = (state.mean - self.prior.inverse_depth, self.prior.sigma);
        let all = mounting.chain(levers).chain([mean]);
        all.enumerate().map(|(i, (value, sigma))| (i, value, sigma)).collect()
    }

    fn linearise(&self, state: &State, noise: f64) -> Linear {
        let n = COMMON + OWN * state.angles.len();
        let poses: Vec<Pose> = (0..state.angles.len()).map(|k| state.pose(self.camera, k)).collect();
        let size = length(&state.levers);
        let mut linear = Linear {
            hessian: DMatrix::zeros(n, n),
            gradient: DVector::zeros(n),
            points: Vec::new(),
            levers: state.levers.map(|l| l / size),
            reference: COMMON + OWN * self.reference,
        };
        for (i, value, sigma) in self.priors(state) {
            linear.hessian[(i, i)] += sigma.powi(-2);
            linear.gradient[i] -= value / sigma.powi(2);
        }
        let w = self.prior.sigma.powi(-2);
        for (k, own) in state.means.iter().enumerate() {
            let i = COMMON + OWN * k + 2;
            for (a, b, sign) in [(i, i, 1.0), (MEAN, MEAN, 1.0), (i, MEAN, -1.0), (MEAN, i, -1.0)] {
                linear.hessian[(a, b)] += sign * w;
            }
            linear.gradient[i] -= w * (own - state.mean);
            linear.gradient[MEAN] += w * (own - state.mean);
        }
        for (p, track) in self.tracks.iter().enumerate() {
            linear.points.push(self.point(state, &poses, p, track, noise, &mut linear.hessian, &mut linear.gradient));
        }
        linear
    }

    #[allow(clippy::too_many_arguments)]
    fn point(
        &self,
        state: &State,
        poses: &[Pose],
        p: usize,
        track: &[Sight],
        noise: f64,
        hessian: &mut DMatrix<f64>,
        gradient: &mut DVector<f64>,
    ) -> PointBlock {
        let (direction, depth) = state.points[p];
        let across = tangent(&direction);
        let mean = COMMON + OWN * track[0].frame + 2;
        let mut columns: Vec<usize> = (0..COMMON).collect();
        for s in track {
            let at = COMMON + OWN * s.frame;
            columns.extend([at, at + 1]);
        }
        columns.push(mean);
        let m = columns.len();
        let mut block = PointBlock {
            columns,
            cross: DMatrix::zeros(m, 3),
            own: Matrix3::zeros(),
            right: Vector3::zeros(),
            seen: Matrix3::zeros(),
        };
        for (i, sight) in track.iter().enumerate() {
            let pose = &poses[sight.frame];
            let Some(seen) = pose.camera.project_homogeneous(&direction, depth) else { continue };
            let residual = sight.pixel - seen.pixel;
            let sigma = noise * sight.sigma;
            let weight = (FREEDOM + 2.0) / (FREEDOM + residual.norm_squared() / sigma.powi(2)) / sigma.powi(2);
            let by_pose: SMatrix<f64, 2, POSE> = seen.by_rotation * pose.rotation + seen.by_centre * pose.centre;
            let by_direction = seen.by_point * across;
            let by_point = Matrix2x3::from_columns(&[
                by_direction.column(0).into_owned(),
                by_direction.column(1).into_owned(),
                seen.by_weight,
            ]);
            let local: [usize; POSE] =
                std::array::from_fn(|k| if k < COMMON { k } else { COMMON + 2 * i + k - COMMON });
            let hh = by_pose.transpose() * by_pose * weight;
            let hr = by_pose.transpose() * residual * weight;
            let hx = by_pose.transpose() * by_point * weight;
            for (a, &la) in local.iter().enumerate() {
                gradient[block.columns[la]] += hr[a];
                for (b, &lb) in local.iter().enumerate() {
                    hessian[(block.columns[la], block.columns[lb])] += hh[(a, b)];
                }
                for k in 0..3 {
                    block.cross[(la, k)] += hx[(a, k)];
                }
            }
            block.seen += by_point.transpose() * by_point * weight;
            block.right += by_point.transpose() * residual * weight;
        }
        block.own = block.seen;
        let w = self.prior.sigma.powi(-2);
        let off = depth - state.means[track[0].frame];
        block.own[(2, 2)] += w;
        block.right.z -= w * off;
        block.cross[(m - 1, 2)] -= w;
        hessian[(mean, mean)] += w;
        gradient[mean] += w * off;
        block
    }

    /// Expectation maximisation of the distribution's scale, less what the points take for themselves.
    fn noise(&self, state: &State, noise: f64) -> f64 {
        let poses = self.cameras(state);
        let taken: f64 = self.linearise(state, noise).points.iter().map(PointBlock::freedom).sum();
        let count: usize = self.tracks.iter().map(Vec::len).sum();
        let left = (2.0 * count as f64 - taken - 2.0 * state.angles.len() as f64).max(1.0);
        let mut variance = noise * noise;
        for _ in 0..30 {
            let mut sum = 0.0;
            for (p, track) in self.tracks.iter().enumerate() {
                for s in track {
                    if let Some(r) = self.residual(state, &poses, p, s) {
                        let square = r.norm_squared() / s.sigma.powi(2);
                        sum += (FREEDOM + 2.0) / (FREEDOM + square / variance) * square;
                    }
                }
            }
            // What is exact in a simulation must not divide by zero.
            variance = (sum / left).max(1e-6);
        }
        variance.sqrt()
    }

    fn finish(&self, state: State, noise: f64) -> Result<Solution> {
        let linear = self.linearise(&state, noise);
        let n = linear.gradient.len();
        let open = || Error::degenerate(Degeneracy::IllConditioned, "the matches do not tie all frames together");
        let reduced = linear.reduced(0.0).ok_or_else(open)?.hessian;
        let scale: Vec<f64> = (0..n).map(|i| reduced[(i, i)].max(1e-300).sqrt().recip()).collect();
        let scaled = DMatrix::from_fn(n, n, |i, j| reduced[(i, j)] * scale[i] * scale[j]);
        let inverse = Cholesky::new(scaled).ok_or_else(open)?.inverse();
        let loss = (FREEDOM + 4.0) / (FREEDOM + 2.0);
        let entry = |i: usize, j: usize| loss * inverse[(i, j)] * scale[i] * scale[j];
        let frames = state.angles.len();
        let place = |i: usize| COMMON + OWN * (i / 2) + i % 2;
        let covariance = DMatrix::from_fn(2 * frames, 2 * frames, |i, j| entry(place(i), place(j)));
        if covariance.iter().any(|v| !v.is_finite()) {
            return Err(open());
        }
        let poses = self.cameras(&state);
        let far = Vector2::repeat(f64::from(self.camera.width));
        let residuals = self
            .tracks
            .iter()
            .enumerate()
            .map(|(p, track)| track.iter().map(|s| self.residual(&state, &poses, p, s).unwrap_or(far)).collect());
        Ok(Solution {
            residuals: residuals.collect(),
            covariance,
            mounting_sigma: std::array::from_fn(|i| entry(i, i).max(0.0).sqrt()),
            mean_sigma: entry(MEAN, MEAN).max(0.0).sqrt(),
            state,
        })
    }
}

/// The normal equations of one point, and how they are tied to the rest.
struct PointBlock {
    columns: Vec<usize>,
    cross: DMatrix<f64>,
    own: Matrix3<f64>,
    right: Vector3<f64>,
    /// `own` without the prior.
    seen: Matrix3<f64>,
}

impl PointBlock {
    /// Residuals that the point explains by itself.
    fn freedom(&self) -> f64 {
        self.own.try_inverse().map_or(0.0, |inverse| (inverse * self.seen).trace())
    }
}

struct Reduced {
    hessian: DMatrix<f64>,
    gradient: DVector<f64>,
    inverses: Vec<Matrix3<f64>>,
}

struct Linear {
    hessian: DMatrix<f64>,
    gradient: DVector<f64>,
    points: Vec<PointBlock>,
    /// The gauges: the lever arms' direction, whose length is fixed, and the index of the pan that is.
    levers: [f64; 4],
    reference: usize,
}

impl Linear {
    /// Normal equations without the points (Schur complement), and the points' damped inverses.
    fn reduced(&self, damping: f64) -> Option<Reduced> {
        let (mut hessian, mut gradient) = (self.hessian.clone(), self.gradient.clone());
        for i in 0..hessian.nrows() {
            hessian[(i, i)] *= 1.0 + damping;
        }
        // After the damping, which would hold the lever arms' other directions, too.
        for (a, b) in (0..4).flat_map(|a| (0..4).map(move |b| (a, b))) {
            hessian[(3 + a, 3 + b)] += 1e14 * self.levers[a] * self.levers[b];
        }
        hessian[(self.reference, self.reference)] += 1e20;
        let mut inverses = Vec::with_capacity(self.points.len());
        for p in &self.points {
            let mut own = p.own;
            (0..3).for_each(|i| own[(i, i)] = own[(i, i)] * (1.0 + damping) + 1e-12);
            let inverse = own.try_inverse()?;
            let taken = &p.cross * inverse;
            for (a, &i) in p.columns.iter().enumerate() {
                let row = taken.row(a);
                gradient[i] -= row[0] * p.right[0] + row[1] * p.right[1] + row[2] * p.right[2];
                for (b, &j) in p.columns.iter().enumerate() {
                    hessian[(i, j)] -= row[0] * p.cross[(b, 0)] + row[1] * p.cross[(b, 1)] + row[2] * p.cross[(b, 2)];
                }
            }
            inverses.push(inverse);
        }
        Some(Reduced { hessian, gradient, inverses })
    }

    fn step(&self, damping: f64) -> Option<(DVector<f64>, Vec<Vector3<f64>>)> {
        let Reduced { hessian, gradient, inverses } = self.reduced(damping)?;
        let n = gradient.len();
        let scale = DVector::from_fn(n, |i, _| hessian[(i, i)].max(1e-300).sqrt().recip());
        let scaled = DMatrix::from_fn(n, n, |i, j| hessian[(i, j)] * scale[i] * scale[j]);
        let step = Cholesky::new(scaled)?.solve(&gradient.component_mul(&scale)).component_mul(&scale);
        let points = self.points.iter().zip(inverses).map(|(p, inverse)| {
            let mut right = p.right;
            for (a, &i) in p.columns.iter().enumerate() {
                (0..3).for_each(|k| right[k] -= p.cross[(a, k)] * step[i]);
            }
            inverse * right
        });
        let points: Vec<Vector3<f64>> = points.collect();
        (step.iter().all(|v| v.is_finite())).then_some((step, points))
    }
}
