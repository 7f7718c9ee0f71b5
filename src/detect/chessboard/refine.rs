//! The board's corners to a fraction of a pixel: at the finest level of the pyramid whose pixels the
//! blur still fills, and those that the search missed.

use super::board::Board;
use super::corner_fit::{CornerFit, EdgeProfile, Start};
use crate::image::pyramid::{Grey, Pyramid};

/// Blur from which on a finer level would show nothing new, pixels of the level.
const RESOLVED: f64 = 1.0;
/// A corner moves less than this from where the search saw it, in steps to the next one.
const MAX_MOVE: f64 = 0.3;
/// Corners that were missed are sought this near to where the others want them, in steps.
const MAX_MISS: f64 = 0.15;
/// Least amplitude over the board's median: the rest is something else in the corner's place.
const MIN_RELATIVE_AMPLITUDE: f64 = 0.15;

/// The board's corners at a level of the pyramid.
#[derive(Debug, Clone)]
pub struct Refined {
    pub level: usize,
    /// As the board's points.
    pub fits: Vec<Option<CornerFit>>,
}

impl Refined {
    pub fn count(&self) -> usize {
        self.fits.iter().flatten().count()
    }
}

/// `level` is where the board was found; its points are moved to where the corners were fitted.
pub fn refine(pyramid: &Pyramid<'_>, mut level: usize, board: &mut Board) -> Refined {
    let profile = EdgeProfile::new();
    let levels = pyramid.levels();
    let mut fits = fit_all(&levels[level], board, 1.0, &profile);
    loop {
        let blur = median(fits.iter().flatten().map(|f| f.blur)).unwrap_or(0.0);
        if level == 0 || blur >= RESOLVED {
            break;
        }
        let finer = enlarged(board, &fits);
        let there = fit_all(&levels[level - 1], &finer, (2.0 * blur).max(0.5), &profile);
        if there.iter().flatten().count() * 2 < fits.iter().flatten().count() {
            break;
        }
        (level, *board, fits) = (level - 1, finer, there);
    }
    settle(board, &fits);
    fill(&levels[level], board, &mut fits, &profile);
    drop_faint(&mut fits);
    settle(board, &fits);
    Refined { level, fits }
}

fn fit_all(image: &Grey<'_>, board: &Board, blur: f64, profile: &EdgeProfile) -> Vec<Option<CornerFit>> {
    let fit = |(index, point): (usize, &Option<[f64; 2]>)| {
        fit_one(image, board, index, (*point)?, blur, MAX_MOVE, profile)
    };
    board.points.iter().enumerate().map(fit).collect()
}

fn fit_one(
    image: &Grey<'_>,
    board: &Board,
    index: usize,
    position: [f64; 2],
    blur: f64,
    max_move: f64,
    profile: &EdgeProfile,
) -> Option<CornerFit> {
    let steps = board.steps(index)?;
    let fit = Start { position, steps, blur, bright: board.is_bright(index) }.fit(image, profile)?;
    let moved = (fit.position[0] - position[0]).hypot(fit.position[1] - position[1]);
    let step = steps.map(|s| s[0].hypot(s[1])).into_iter().fold(f64::INFINITY, f64::min);
    (moved <= (max_move * step).max(1.0)).then_some(fit)
}

/// At the next finer level; corners that could not be fitted stay where they were seen.
fn enlarged(board: &Board, fits: &[Option<CornerFit>]) -> Board {
    let mut finer = board.clone();
    for (point, fit) in finer.points.iter_mut().zip(fits) {
        *point = fit.map(|f| f.position).or(*point).map(|p| p.map(|c| 2.0 * c + 0.5));
    }
    finer
}

fn settle(board: &mut Board, fits: &[Option<CornerFit>]) {
    board.points.iter_mut().zip(fits).for_each(|(point, fit)| *point = fit.map(|f| f.position));
}

/// Seeks the corners that are missing where the others say they are, outwards from them.
fn fill(image: &Grey<'_>, board: &mut Board, fits: &mut [Option<CornerFit>], profile: &EdgeProfile) {
    let Some(blur) = median(fits.iter().flatten().map(|f| f.blur)) else { return };
    for _ in 0..board.columns + board.rows {
        let empty = (0..fits.len()).filter(|i| fits[*i].is_none());
        let found: Vec<(usize, CornerFit)> = empty
            .filter_map(|i| {
                let position = board.predict(i)?;
                Some((i, fit_one(image, board, i, position, blur, MAX_MISS, profile)?))
            })
            .collect();
        if found.is_empty() {
            break;
        }
        for (i, fit) in found {
            fits[i] = Some(fit);
            board.points[i] = Some(fit.position);
        }
    }
}

fn drop_faint(fits: &mut [Option<CornerFit>]) {
    let Some(typical) = median(fits.iter().flatten().map(|f| f.amplitude)) else { return };
    for fit in fits.iter_mut() {
        *fit = fit.filter(|f| f.amplitude >= MIN_RELATIVE_AMPLITUDE * typical);
    }
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
