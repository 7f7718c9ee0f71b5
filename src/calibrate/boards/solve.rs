//! The calibration from boards as a whole: starts in turn, gates, verdict.

use nalgebra::{DMatrix, Matrix6};

use super::advice::advise;
use super::fit::{Fitted, Fitter, sheet};
use super::start::Starts;
use super::views::Boards;
use super::{BoardCalibration, BoardPose};
use crate::calibrate::freedom::ROTATION;
use crate::calibrate::residuals;
use crate::calibrate::solve::{MAX_RMS, plausible, validate};
use crate::calibrate::{Calibration, CalibrationOptions, FitCheck};
use crate::error::{Degeneracy, Error, Result};
use crate::geometry::{Camera, Rigid};

/// Boards whose normals are nearer to each other than this (radians, 15 degrees) are to blame when the
/// focal length stays open.
const PARALLEL: f64 = 0.26;

/// Calibrates a camera from views of boards: closed form, then maximum likelihood.
///
/// With `fixed_lens` only the poses are found. A single view is enough when it is tilted: the
/// principal point is then expected at the image's centre to within 5 % of its width. The common noise
/// of corners without a covariance is estimated from the residuals with 2 N - p degrees of freedom.
///
/// # Errors
/// `TooFewPoints`, `Degenerate` (parallel boards, a focal length that stays open: the detail says what
/// to add), `NoConsensus` (robust, and fewer than half of the views or two fifths of the corners
/// agree), `InvalidArgument` (names a view that is mirrored, or does not fit at all),
/// `NoConvergence`, `LensNotMonotone`, `BehindCamera` (only when not robust), `Cancelled`.
pub fn calibrate_from_boards(boards: &Boards, options: &CalibrationOptions) -> Result<BoardCalibration> {
    let fitted = fit(boards, options)?;
    let result = report(boards, &fitted);
    verdict(boards, options, &fitted, &result)?;
    Ok(result)
}

/// The fit alone, without the gates on its quality.
pub(crate) fn fit(boards: &Boards, options: &CalibrationOptions) -> Result<Fitted> {
    validate(options)?;
    if boards.views().is_empty() {
        return Err(Error::TooFewPoints { given: 0, needed: super::views::MIN_CORNERS });
    }
    let fitter = Fitter::new(boards, options);
    let corners: usize = boards.views().iter().map(|v| v.corners.len()).sum();
    let needed = fitter.parameters(boards.views().len()).div_ceil(2);
    if corners < needed {
        return Err(Error::TooFewPoints { given: corners, needed });
    }
    let starts = Starts::new(boards, options)?;
    let mut first_error = None;
    let mut angle = f64::INFINITY;
    for camera in starts.cameras() {
        options.cancel.check()?;
        let Some(start) = starts.poses(camera) else { continue };
        // A wrong focal length tilts boards: the start that tilts them least counts.
        angle = angle.min(largest_angle(start.poses.iter()));
        match fitter.run(start, &starts.first()) {
            Ok(fitted) if options.fixed_lens.is_some() || plausible(&fitted.state.camera) => {
                check_sides(boards, &fitted)?;
                return Ok(fitted);
            }
            Err(Error::Cancelled) => return Err(Error::Cancelled),
            Err(e) => {
                first_error.get_or_insert(e);
            }
            Ok(_) => {}
        }
    }
    if let Some(view) = starts.plane.iter().position(|plane| !plane) {
        return Err(Error::invalid("views", format!("view {view}: its corners are no image of a plane board")));
    }
    if options.fixed_lens.is_none() && angle < PARALLEL {
        return Err(Error::degenerate(Degeneracy::ParallelBoards, "the focal length stays open"));
    }
    Err(first_error
        .unwrap_or_else(|| Error::degenerate(Degeneracy::IllConditioned, "no plausible camera explains the views")))
}

/// The largest angle between the normals of two boards.
fn largest_angle<'a>(poses: impl Iterator<Item = &'a Rigid> + Clone) -> f64 {
    let cosines =
        poses.clone().flat_map(|a| poses.clone().map(|b| a.rotation.column(2).dot(&b.rotation.column(2)).abs()));
    cosines.fold(1.0, f64::min).clamp(0.0, 1.0).acos()
}

/// All boards must be seen from one side: a view whose corners are paired in mirrored order fits a
/// board seen from behind just as well.
fn check_sides(boards: &Boards, fitted: &Fitted) -> Result<()> {
    let side = |v: usize| {
        let pose = &fitted.state.poses[v];
        pose.rotation.column(2).dot(&pose.apply(&super::start::centroid(&boards.views()[v]).push(0.0))) > 0.0
    };
    let used: Vec<usize> = (0..boards.views().len()).filter(|v| fitted.selection.views[*v]).collect();
    let front = used.iter().filter(|v| side(**v)).count();
    let usual = if 2 * front == used.len() { side(used[0]) } else { 2 * front > used.len() };
    match used.iter().find(|v| side(**v) != usual) {
        None => Ok(()),
        Some(view) => Err(Error::invalid(
            "views",
            format!("view {view} is mirrored: its corners show the board from behind, against the other views"),
        )),
    }
}

/// What the fit found, for the caller.
pub(crate) fn report(boards: &Boards, fitted: &Fitted) -> BoardCalibration {
    let (state, selection) = (&fitted.state, &fitted.selection);
    let sheet = sheet(boards);
    let (mut residuals, mut views) = (Vec::new(), Vec::new());
    let mut covariances = fitted.covariance.poses.iter();
    for (v, view) in boards.views().iter().enumerate() {
        let camera = Camera { pose: state.poses[v], ..state.camera };
        let points = view.corners.iter().map(|c| (sheet.point(&state.bend, &c.board), c.pixel));
        let own = residuals::of_points(&camera, points);
        let used = selection.views[v];
        let counted: Vec<f64> = own
            .iter()
            .zip(&selection.corners[v])
            .filter(|(r, inlier)| **inlier || (!used && r.x.is_finite()))
            .map(|(r, _)| r.norm_squared())
            .collect();
        views.push(BoardPose {
            pose: state.poses[v],
            covariance: if used { covariances.next().copied().unwrap_or_default() } else { Matrix6::zeros() },
            used,
            corners: view.corners.len(),
            inliers: selection.corners[v].iter().filter(|i| **i).count(),
            rms: if counted.is_empty() {
                f64::INFINITY
            } else {
                (counted.iter().sum::<f64>() / counted.len() as f64).sqrt()
            },
        });
        residuals.extend(own);
    }
    let inliers: Vec<bool> = selection.corners.concat();
    let sum: f64 = residuals.iter().zip(&inliers).filter(|(_, i)| **i).map(|(r, _)| r.norm_squared()).sum();
    let calibration = Calibration {
        camera: state.camera,
        covariance: lens_covariance(&fitted.covariance.globals, state.camera.distortion.coefficients().len()),
        residuals,
        rms: (sum / selection.corner_count().max(1) as f64).sqrt(),
        inliers,
        noise_factor: fitted.noise_factor,
        condition: fitted.covariance.condition,
        iterations: fitted.iterations,
        check: FitCheck::new(fitted.chi2, fitted.freedom, Vec::new(), Vec::new()),
    };
    let advice = advise(boards, &state.poses, selection);
    BoardCalibration { calibration, views, bending: state.bend, advice }
}

/// In the order of [`Calibration::covariance`]: the lens, then a pose that was not free.
fn lens_covariance(globals: &DMatrix<f64>, coefficients: usize) -> DMatrix<f64> {
    let lens = 5 + coefficients.min(ROTATION - 5);
    DMatrix::from_fn(lens + 6, lens + 6, |i, j| if i < lens && j < lens { globals[(i, j)] } else { 0.0 })
}

/// The last gates.
pub(crate) fn verdict(
    boards: &Boards,
    options: &CalibrationOptions,
    fitted: &Fitted,
    result: &BoardCalibration,
) -> Result<()> {
    let diagonal = f64::from(boards.width()).hypot(f64::from(boards.height()));
    let worst = result.views.iter().enumerate().filter(|(_, v)| v.used).max_by(|a, b| a.1.rms.total_cmp(&b.1.rms));
    if let Some((view, worst)) = worst
        && worst.rms > MAX_RMS * diagonal
    {
        let rms = worst.rms;
        return Err(Error::invalid("views", format!("view {view} does not fit the others: {rms:.1} px rms")));
    }
    if options.fixed_lens.is_some() {
        return Ok(());
    }
    let (k, c) = (&result.calibration.camera.intrinsics, &result.calibration.covariance);
    let deviation = (c[(0, 0)].max(0.0).sqrt() / k.fx).max(c[(1, 1)].max(0.0).sqrt() / k.fy);
    if deviation.is_nan() || deviation > options.max_focal_deviation {
        let used = fitted.state.poses.iter().zip(&fitted.selection.views).filter(|(_, used)| **used).map(|(p, _)| p);
        let parallel = largest_angle(used) < PARALLEL;
        let kind = if parallel { Degeneracy::ParallelBoards } else { Degeneracy::IllConditioned };
        let advice = result.advice.first().map_or(String::new(), |a| format!("; {a}"));
        let detail = format!(
            "the focal length is determined to {:.1} % only (limit {:.1} %){advice}",
            100.0 * deviation,
            100.0 * options.max_focal_deviation
        );
        return Err(Error::degenerate(kind, detail));
    }
    result.calibration.camera.check_lens()
}
