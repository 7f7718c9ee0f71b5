//! The board's corners to a fraction of a pixel: at the finest level of the pyramid whose pixels the
//! blur still fills, and those that the search missed.

use super::board::Board;
use super::corner_fit::{CornerFit, EdgeProfile, Start};
use crate::image::pyramid::{Grey, Pyramid};

/// Blurs that a level shows well, pixels of the level.
const MIN_BLUR: f64 = 1.0;
const MAX_BLUR: f64 = 2.2;
/// What is assumed at first, and what is too far from it for the windows that were chosen by it.
const FIRST_BLUR: f64 = 1.2;
const SURPRISING_BLUR: f64 = 1.6;
/// Levels below the one where the board was found: its squares are a dozen pixels and more there.
const FINER: usize = 2;
/// A corner moves less than this from where the search saw it, in steps to the next one.
const MAX_MOVE: f64 = 0.3;
/// Corners that were missed are sought this near to where the others want them, in steps.
const MAX_MISS: f64 = 0.15;
/// Rounds of seeking: holes wider than twice this are not worth the time.
const MAX_FILLS: usize = 4;
/// Least amplitude over the board's median: the rest is something else in the corner's place.
const MIN_RELATIVE_AMPLITUDE: f64 = 0.15;
/// Greatest share of a window's variance that is neither corner nor noise, and the same for a board's median.
/// Photographs have 0.05 at most.
const MAX_MISFIT: f64 = 0.12;
/// Least amplitude over the median of corners beyond the border that make the board larger.
const MIN_ALIKE: f64 = 0.6;
/// Triples of pixels that tell the noise.
const NOISE_SAMPLE: usize = 4096;

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

/// `found` is the level where the board was found; its points are moved to where the corners were fitted.
pub fn refine(pyramid: &Pyramid<'_>, found: usize, board: &mut Board) -> Refined {
    let profile = EdgeProfile::new();
    let at = |level: usize, blur: f64| Fitter { image: &pyramid.levels()[level], profile: &profile, blur };
    let seen = board.clone();
    let mut level = found.saturating_sub(FINER);
    *board = moved(&seen, found, level);
    let mut fits = at(level, FIRST_BLUR).all(board);
    while level < found && (typical_blur(&fits) > MAX_BLUR || 2 * count(&fits) < seen.count()) {
        level += 1;
        *board = moved(&seen, found, level);
        fits = at(level, FIRST_BLUR).all(board);
    }
    while level > 0 && level + FINER <= found && typical_blur(&fits) < MIN_BLUR {
        settle(board, &fits);
        *board = moved(board, level, level - 1);
        level -= 1;
        fits = at(level, FIRST_BLUR).all(board);
    }
    let mut blur = typical_blur(&fits);
    if blur > SURPRISING_BLUR {
        fits = at(level, blur).all(board);
        blur = typical_blur(&fits);
    }
    settle(board, &fits);
    at(level, blur).fill(board, &mut fits);
    judge(&mut fits, noise_variance(&pyramid.levels()[level]));
    settle(board, &fits);
    Refined { level, fits }
}

/// The board's true size when it goes on beyond what was asked for: corners where the next row or
/// column would be.
pub fn larger(pyramid: &Pyramid<'_>, board: &Board, refined: &Refined) -> Option<[usize; 2]> {
    let image = &pyramid.levels()[refined.level];
    let profile = EdgeProfile::new();
    let fitter = Fitter { image, profile: &profile, blur: typical_blur(&refined.fits) };
    let amplitude = median(refined.fits.iter().flatten().map(|f| f.amplitude))?;
    let noise = noise_variance(image);
    let (columns, rows) = (board.columns as isize, board.rows as isize);
    let mut size = [board.columns, board.rows];
    let sides: [([isize; 2], [isize; 2]); 4] =
        [([0, 0], [-1, 0]), ([columns - 1, 0], [1, 0]), ([0, 0], [0, -1]), ([0, rows - 1], [0, 1])];
    for ([i, j], [di, dj]) in sides {
        let last = if di != 0 { rows - 1 } else { columns - 1 };
        // Some spread over the side are enough.
        let spread = [0, last, last / 2].into_iter().chain(1..last).filter_map(|n| {
            let [i, j] = [i + n * dj.abs(), j + n * di.abs()];
            let (here, inside) = (board.get(i, j)?, board.get(i - di, j - dj)?);
            Some(((j * columns + i) as usize, [0, 1].map(|k| 2.0 * here[k] - inside[k])))
        });
        let there = spread.take(3).filter(|(index, position)| {
            let fit = fitter.one(board, *index, *position, !board.is_bright(*index), MAX_MISS);
            fit.is_some_and(|f| misfit(&f, noise) < MAX_MISFIT && f.amplitude > MIN_ALIKE * amplitude)
        });
        size[(di == 0) as usize] += (there.count() >= 2) as usize;
    }
    (size != [board.columns, board.rows]).then_some(size)
}

/// Share of a window's variance that is neither corner nor noise.
fn misfit(fit: &CornerFit, noise: f64) -> f64 {
    (fit.residual - 1.5 * noise) / fit.variance.max(1e-9)
}

fn count(fits: &[Option<CornerFit>]) -> usize {
    fits.iter().flatten().count()
}

fn typical_blur(fits: &[Option<CornerFit>]) -> f64 {
    median(fits.iter().flatten().map(|f| f.blur)).unwrap_or(FIRST_BLUR)
}

/// The board's points at another level.
fn moved(board: &Board, from: usize, to: usize) -> Board {
    let scale = 2f64.powi(from as i32 - to as i32);
    let mut board = board.clone();
    for point in board.points.iter_mut().flatten() {
        *point = point.map(|c| scale * (c + 0.5) - 0.5);
    }
    board
}

fn settle(board: &mut Board, fits: &[Option<CornerFit>]) {
    board.points.iter_mut().zip(fits).for_each(|(point, fit)| *point = fit.map(|f| f.position));
}

/// Fits corners of a board at one level.
struct Fitter<'a> {
    image: &'a Grey<'a>,
    profile: &'a EdgeProfile,
    blur: f64,
}

impl Fitter<'_> {
    fn all(&self, board: &Board) -> Vec<Option<CornerFit>> {
        let points = board.points.iter().enumerate();
        points.map(|(i, p)| self.one(board, i, (*p)?, board.is_bright(i), MAX_MOVE)).collect()
    }

    /// A corner near `position`, with the steps of the board's corner `index`; `None` when it is farther
    /// away than `max_move` steps.
    fn one(&self, board: &Board, index: usize, position: [f64; 2], bright: bool, max_move: f64) -> Option<CornerFit> {
        let steps = board.steps(index)?;
        let fit = Start { position, steps, blur: self.blur, bright }.fit(self.image, self.profile)?;
        let moved = (fit.position[0] - position[0]).hypot(fit.position[1] - position[1]);
        let step = steps.map(|s| s[0].hypot(s[1])).into_iter().fold(f64::INFINITY, f64::min);
        (moved <= (max_move * step).max(1.0)).then_some(fit)
    }

    /// Seeks the corners that are missing where the others say they are, outwards from them.
    fn fill(&self, board: &mut Board, fits: &mut [Option<CornerFit>]) {
        for _ in 0..MAX_FILLS {
            let empty = (0..fits.len()).filter(|i| fits[*i].is_none());
            let find = |i: usize| {
                let fit = self.one(board, i, board.predict(i)?, board.is_bright(i), MAX_MISS)?;
                Some((i, fit))
            };
            let found: Vec<(usize, CornerFit)> = empty.filter_map(find).collect();
            if found.is_empty() {
                break;
            }
            for (i, fit) in found {
                fits[i] = Some(fit);
                board.points[i] = Some(fit.position);
            }
        }
    }
}

/// Drops what is no corner, or all when the board as a whole is none: grids of dots, blurred, look like
/// boards but for this.
fn judge(fits: &mut [Option<CornerFit>], noise: f64) {
    let typical = median(fits.iter().flatten().map(|f| misfit(f, noise))).unwrap_or(0.0);
    let amplitude = median(fits.iter().flatten().map(|f| f.amplitude)).unwrap_or(0.0);
    let good = |f: &CornerFit| {
        typical <= MAX_MISFIT && misfit(f, noise) <= MAX_MISFIT && f.amplitude >= MIN_RELATIVE_AMPLITUDE * amplitude
    };
    fits.iter_mut().for_each(|fit| *fit = fit.filter(good));
}

/// From the median second difference along rows, most of which show no edge.
fn noise_variance(image: &Grey<'_>) -> f64 {
    let (width, height) = (image.width(), image.height());
    let step = (width * height / NOISE_SAMPLE).max(1);
    let places = (0..width * height).step_by(step).map(|i| (i % width, i / width));
    let inner = places.filter(|(x, _)| *x + 2 < width);
    let bend = inner.map(|(x, y)| {
        let row = &image.row(y)[x..x + 3];
        (row[0] as f64 - 2.0 * row[1] as f64 + row[2] as f64).abs()
    });
    // Median absolute deviation of a normal variable; 1 + 4 + 1 variances.
    median(bend).map_or(0.0, |m| (m / 0.6745).powi(2) / 6.0)
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
