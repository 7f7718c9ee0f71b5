//! Maximum likelihood of the laser's line with all board poses and the lens.

use nalgebra::{DMatrix, Vector2, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use super::{LaserCalibration, MIN_BOARDS, least_squares};
use crate::calibrate::boards::Boards;
use crate::calibrate::boards::adjust::Prior;
use crate::calibrate::boards::fit::{Fitted, Fitter, sheet};
use crate::calibrate::boards::model::{self, GLOBALS, LASER, State};
use crate::calibrate::boards::solve::{fit, report, verdict};
use crate::calibrate::freedom::ROTATION;
use crate::calibrate::solve::OUTLIER;
use crate::calibrate::{Calibration, CalibrationOptions};
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::rig_model::LaserLine;
use crate::geometry::{Plane, Rigid};

/// Range of the spots' depths over their mean below which offset and slope cannot be told apart.
const MIN_RANGE: f64 = 0.02;
/// Sine of the smallest angle between laser and board (2 degrees).
const MIN_SINE: f64 = 0.035;
/// Relative standard deviation of the baseline, which is that of every depth, above which nothing was
/// measured.
const MAX_BASELINE_DEVIATION: f64 = 0.2;
/// Pairs of boards that are tried for the first line.
const MAX_PAIRS: usize = 500;

/// Calibrates the laser's line from views of boards with spots; positions on the boards in metres.
///
/// The lens is found from the same corners; or it is known exactly (`options.fixed_lens`); or it was
/// measured elsewhere: `lens`, whose covariance is then its prior. A lens from these same views must
/// not be given as `lens`: they would count twice. Wrong spots are set aside when `options.robust`.
///
/// # Errors
/// Those of [`calibrate_from_boards`](crate::calibrate::calibrate_from_boards); `TooFewSpots` (spots
/// on fewer than 2 boards), `Degenerate` (boards at one distance, a laser along a board, spots that do
/// not move, a baseline that stays open), `NoConsensus` (fewer than half of the spots agree),
/// `InvalidArgument` (a baseline below 1 mm; both kinds of known lens).
pub fn calibrate_laser_line(
    boards: &Boards,
    lens: Option<&Calibration>,
    options: &CalibrationOptions,
) -> Result<LaserCalibration> {
    let given = boards.views().iter().filter(|v| v.spot.is_some()).count();
    if given < MIN_BOARDS {
        return Err(Error::TooFewSpots { given, needed: MIN_BOARDS });
    }
    let mut options = options.clone();
    let mut fitter = Fitter::new(boards, &options);
    if let Some(lens) = lens {
        if options.fixed_lens.is_some() {
            return Err(Error::invalid("lens", "the options fix the lens already"));
        }
        options.fixed_lens = Some((lens.camera.intrinsics, lens.camera.distortion));
        let (free, priors) = lens_priors(lens)?;
        fitter = Fitter::new(boards, &options).with_lens_priors(&free, priors);
    }
    let fitter = fitter.with_laser();
    let posed = fit(boards, &options)?;
    verdict(boards, &options, &posed, &report(boards, &posed))?;

    let points = spots_in_space(boards, &posed);
    if points.len() < MIN_BOARDS {
        return Err(Error::TooFewSpots { given: points.len(), needed: MIN_BOARDS });
    }
    check_depths(points.iter().map(|(_, p)| p.z))?;
    check_motion(boards, &points)?;
    let (mut state, mut selection) = (posed.state.clone(), posed.selection.clone());
    let distance = |line: &LaserLine, view: usize| {
        fitter.spot_distance(&State { laser: *line, ..posed.state.clone() }, view, posed.noise_factor)
    };
    let line = first_line(&points, &distance, options.robust, options.seed)?;
    check_angles(&points, &line, &posed.state.poses)?;
    state.laser = line;
    points.iter().for_each(|(view, _)| selection.spots[*view] = true);
    let fitted = fitter.run_laser(state, selection, posed.noise_factor)?;
    answer(boards, &options, lens, &fitted, given)
}

/// The lens as it was measured: which parameters are free, and where they are expected.
fn lens_priors(lens: &Calibration) -> Result<(Vec<usize>, Vec<Prior>)> {
    let camera = &lens.camera;
    let mean: Vec<f64> = camera.intrinsics.to_array().iter().chain(camera.distortion.coefficients()).copied().collect();
    if lens.covariance.nrows() < mean.len() || mean.len() > ROTATION {
        return Err(Error::invalid("lens", "its covariance is not that of its parameters"));
    }
    let free: Vec<usize> = (0..mean.len()).filter(|i| lens.covariance[(*i, *i)] > 0.0).collect();
    let n = free.len();
    let sigma: Vec<f64> = free.iter().map(|i| lens.covariance[(*i, *i)].sqrt()).collect();
    // The ridge keeps parameters that were tied (fx = fy) together without a division by zero.
    let correlation = DMatrix::from_fn(n, n, |i, j| {
        lens.covariance[(free[i], free[j])] / (sigma[i] * sigma[j]) + if i == j { 1e-9 } else { 0.0 }
    });
    let singular = || Error::invalid("lens", "its covariance is not positive definite");
    let l = nalgebra::Cholesky::new(correlation).ok_or_else(singular)?.unpack();
    let inverse = l.solve_lower_triangular(&DMatrix::identity(n, n)).ok_or_else(singular)?;
    let priors = (0..n)
        .map(|i| {
            let mut row = [0.0; GLOBALS];
            free.iter().enumerate().for_each(|(j, parameter)| row[*parameter] = inverse[(i, j)] / sigma[j]);
            Prior { row, value: free.iter().map(|p| row[*p] * mean[*p]).sum() }
        })
        .collect();
    Ok((free, priors))
}

/// Where the rays of the spots meet the boards, with their views; the camera's frame.
fn spots_in_space(boards: &Boards, fitted: &Fitted) -> Vec<(usize, Vector3<f64>)> {
    let used = |view: &usize| fitted.selection.views[*view];
    let point = |view: usize| {
        let pose = &fitted.state.poses[view];
        let ray = fitted.state.camera.back_project(&boards.views()[view].spot?.pixel)?;
        let normal: Vector3<f64> = pose.rotation.column(2).into();
        let point = Plane::new(normal, normal.dot(&pose.translation))?.intersect_ray(&ray)?;
        Some((view, point))
    };
    (0..boards.views().len()).filter(used).filter_map(point).collect()
}

fn check_depths(depths: impl Iterator<Item = f64>) -> Result<()> {
    let (mut low, mut high) = (f64::INFINITY, 0.0f64);
    for z in depths {
        (low, high) = (low.min(z), high.max(z));
    }
    if high - low < MIN_RANGE * 0.5 * (low + high) {
        let detail = format!("all spots are {low:.3} to {high:.3} m away");
        return Err(Error::degenerate(Degeneracy::OneDistance, detail));
    }
    Ok(())
}

/// Spots that stay in one place while the distance changes belong to no laser beside the camera.
fn check_motion(boards: &Boards, points: &[(usize, Vector3<f64>)]) -> Result<()> {
    let pixels: Vec<Vector2<f64>> =
        points.iter().filter_map(|(v, _)| boards.views()[*v].spot.map(|s| s.pixel)).collect();
    let middle = pixels.iter().sum::<Vector2<f64>>() / pixels.len() as f64;
    let extent = pixels.iter().map(|p| (p - middle).norm()).fold(0.0, f64::max);
    if extent < 1.0 {
        let detail = format!("the spots stay within {extent:.2} px: the laser must stand beside the camera");
        return Err(Error::degenerate(Degeneracy::Coincident, detail));
    }
    Ok(())
}

fn check_angles(points: &[(usize, Vector3<f64>)], line: &LaserLine, poses: &[Rigid]) -> Result<()> {
    let beam = Vector3::new(line.vx, line.vy, 1.0).normalize();
    match points.iter().find(|(view, _)| poses[*view].rotation.column(2).dot(&beam).abs() < MIN_SINE) {
        None => Ok(()),
        Some((view, _)) => {
            let detail = format!("view {view}: the laser runs along its board");
            Err(Error::degenerate(Degeneracy::IllConditioned, detail))
        }
    }
}

/// A line that many spots agree on: of those through two of the points the one of least robust cost.
/// The noise is known from the corners, so that near boards, which say most, are not given up for a
/// narrow agreement of far ones.
fn first_line(
    points: &[(usize, Vector3<f64>)],
    distance: &dyn Fn(&LaserLine, usize) -> Result<f64>,
    robust: bool,
    seed: u64,
) -> Result<LaserLine> {
    let positions: Vec<Vector3<f64>> = points.iter().map(|(_, p)| *p).collect();
    let all = least_squares(&positions)?;
    if !robust {
        return Ok(all);
    }
    let n = points.len();
    let mut pairs: Vec<(usize, usize)> = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for i in 0..MAX_PAIRS.min(pairs.len()) {
        let left = (pairs.len() - i) as u64;
        pairs.swap(i, i + ((u128::from(rng.next_u64()) * u128::from(left)) >> 64) as usize);
    }
    pairs.truncate(MAX_PAIRS);
    let cost = |line: &LaserLine| -> Result<f64> {
        points.iter().map(|(view, _)| Ok((distance(line, *view)? / OUTLIER).ln_1p())).sum()
    };
    let mut best = (cost(&all)?, all);
    for (i, j) in pairs {
        let Ok(line) = least_squares(&[positions[i], positions[j]]) else { continue };
        let cost = cost(&line)?;
        if cost < best.0 {
            best = (cost, line);
        }
    }
    Ok(best.1)
}

fn answer(
    boards: &Boards,
    options: &CalibrationOptions,
    lens: Option<&Calibration>,
    fitted: &Fitted,
    given: usize,
) -> Result<LaserCalibration> {
    let (state, used) = (&fitted.state, &fitted.selection.spots);
    let count = used.iter().filter(|u| **u).count();
    if count < MIN_BOARDS || 2 * count < given {
        return Err(Error::NoConsensus { inliers: count, total: given });
    }
    let sheet = sheet(boards);
    let predicted = |view: usize| model::spot(state, &sheet, &state.poses[view]).map(|p| p.pixel);
    let residuals: Vec<Option<Vector2<f64>>> = (0..used.len())
        .map(|view| boards.views()[view].spot.zip(predicted(view)).map(|(spot, at)| spot.pixel - at))
        .collect();
    let meeting = |view: usize| model::meet(&state.laser, &state.poses[view], &sheet, &state.bend);
    check_depths((0..used.len()).filter(|v| used[*v]).filter_map(meeting).map(|m| m.point.z))?;
    let sum: f64 = residuals.iter().zip(used).filter(|(_, u)| **u).flat_map(|(r, _)| r).map(|r| r.norm_squared()).sum();
    let boards = report(boards, fitted);
    let coefficients = boards.calibration.camera.distortion.coefficients().len();
    let kept: Vec<usize> = (0..5 + coefficients).chain(LASER..GLOBALS).collect();
    let globals = &fitted.covariance.globals;
    let covariance = DMatrix::from_fn(kept.len(), kept.len(), |i, j| globals[(kept[i], kept[j])]);
    let result = LaserCalibration {
        line: state.laser,
        boards,
        covariance,
        residuals,
        used: used.clone(),
        rms: (sum / count as f64).sqrt(),
    };
    if options.fixed_lens.is_none() || lens.is_some() {
        result.boards.calibration.camera.check_lens()?;
    }
    check_baseline(&result)?;
    Ok(result)
}

fn check_baseline(result: &LaserCalibration) -> Result<()> {
    result.rig_model().validate()?;
    let baseline = Vector2::new(result.line.x0, result.line.y0);
    let along = baseline.normalize();
    let c = result.line_covariance();
    let deviation = (c.fixed_view::<2, 2>(0, 0) * along).dot(&along).max(0.0).sqrt() / baseline.norm();
    if deviation.is_nan() || deviation > MAX_BASELINE_DEVIATION {
        let detail = format!(
            "the laser's distance from the camera is determined to {:.0} % only (limit {:.0} %)",
            100.0 * deviation,
            100.0 * MAX_BASELINE_DEVIATION
        );
        return Err(Error::degenerate(Degeneracy::OneDistance, detail));
    }
    Ok(())
}
