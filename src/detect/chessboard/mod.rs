//! Chessboards: the inner corners of a board of known or unknown size, in order, to a few hundredths
//! of a pixel, with their covariances.
//!
//! From the coarsest level of an image pyramid to the finest: corners by the ChESS response
//! (`response`), their edges by a quadratic (`saddle`), grids grown from neighbour to neighbour
//! (`lattice`), the board's size and first corner (`board`). The first level with the whole board is
//! enough. The corners are then fitted, with blur and light, where the image has most detail (`refine`,
//! `corner_fit`).

mod board;
mod corner_fit;
mod lattice;
mod refine;
#[cfg(test)]
mod render;
mod response;
mod saddle;
#[cfg(test)]
mod tests;

use crate::error::{Error, Result};
use crate::image::ImageView;
use crate::image::pyramid::{Grey, Pyramid, to_full_size};
use board::Board;
use refine::{Refined, refine};
use saddle::Saddle;

/// Least and greatest number of inner corners along a side of a board.
pub const MIN_SIDE: u32 = 3;
pub const MAX_SIDE: u32 = 128;
/// Shorter image sides hold no board: squares are at least 4.5 pixels, and corners 4 from the border.
const MIN_IMAGE_SIDE: usize = 16;
/// Least response: a contrast of about 12 grey levels.
const THRESHOLD: u8 = 5;
/// Most corners of a level.
const MAX_PEAKS: usize = 1 << 16;
/// Incomplete boards that are looked at closely, the fullest first.
const MAX_PARTS: usize = 8;
/// Fewest corners that are a board, whatever its size.
const MIN_FOUND: usize = 8;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChessboardOptions {
    /// Inner corners in a row and in a column: 3 to 128 each. `None`: any size; the larger number is
    /// then that of the columns.
    pub size: Option<[u32; 2]>,
    /// Least share of the corners that must be found, 0 to 1. Never fewer than 8 corners.
    pub min_found: f64,
}

impl Default for ChessboardOptions {
    fn default() -> Self {
        Self { size: None, min_found: 0.5 }
    }
}

impl ChessboardOptions {
    fn check(&self) -> Result<()> {
        if let Some([columns, rows]) = self.size {
            let sides = MIN_SIDE..=MAX_SIDE;
            if !sides.contains(&columns) || !sides.contains(&rows) {
                let reason = format!("{columns} x {rows} inner corners; {MIN_SIDE} to {MAX_SIDE} are possible");
                return Err(Error::invalid("size", reason));
            }
        }
        if !(0.0..=1.0).contains(&self.min_found) {
            return Err(Error::invalid("min_found", format!("{} is no share", self.min_found)));
        }
        Ok(())
    }
}

/// An inner corner in the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChessboardCorner {
    /// Pixels.
    pub x: f64,
    pub y: f64,
    /// xx, xy, yy, px^2: from the noise about the fit.
    pub covariance: [f64; 3],
}

/// A board found.
///
/// The corners go row by row. From column to column and then from row to row one turns clockwise as
/// seen in the image (as from x to y), so that a mirrored view is read as its mirror image. Of the
/// orders that are left, those come first whose first corner has a dark square outside (diagonally,
/// towards the board's corner); if there are two or more, or none, the one whose first corner has
/// the least x + y. With one even and one odd number of corners the order is the board's own,
/// however the camera is turned; otherwise a view turned by 180 degrees (or 90 on square boards)
/// cannot be told from one that is not.
#[derive(Debug, Clone, PartialEq)]
pub struct Chessboard {
    pub columns: usize,
    pub rows: usize,
    /// Row by row; `None` where the corner is hidden, outside the image or unlike a corner.
    pub corners: Vec<Option<ChessboardCorner>>,
    /// Standard deviation of the image's blur, pixels.
    pub blur: f64,
}

impl Chessboard {
    pub fn found(&self) -> usize {
        self.corners.iter().flatten().count()
    }
}

/// Finds one chessboard.
///
/// A partly hidden board is found when some corner of each of its outer rows and columns is seen: what
/// is left of it could otherwise be any part.
///
/// # Errors
/// `InvalidArgument` for impossible options and images too small for the board; `NoChessboard` with what
/// there is instead; `ManyChessboards` for two whole boards of the size whose squares look alike large.
/// When those of one look about twice as large or more, that one is taken; of boards of unknown size or partly
/// hidden, the one with most corners.
pub fn detect_chessboard(image: &ImageView<'_>, options: &ChessboardOptions) -> Result<Chessboard> {
    options.check()?;
    let size = options.size.map(|s| s.map(|n| n as usize));
    let [w, h] = [image.width() as usize, image.height() as usize];
    let [c, r] = size.unwrap_or([MIN_SIDE as usize; 2]);
    // Squares of 4 pixels, the outer ones included.
    if w.min(h) < (4 * c.min(r)).max(MIN_IMAGE_SIDE) || w.max(h) < 4 * c.max(r) {
        return Err(Error::invalid("image", format!("{w} x {h} pixels cannot show {c} x {r} corners")));
    }
    Search { pyramid: Pyramid::new(Grey::of(image), MIN_IMAGE_SIDE), size, min_found: options.min_found }.run()
}

struct Search<'a> {
    pyramid: Pyramid<'a>,
    size: Option<[usize; 2]>,
    min_found: f64,
}

/// What was seen so far.
#[derive(Default)]
struct Seen {
    /// Boards with corners missing, and their levels.
    parts: Vec<(Board, usize)>,
    /// Places that look like corners.
    corners: usize,
    /// Size of the largest grid.
    grid: Option<[usize; 2]>,
    /// Grids too large for the board: their corners' mean and greatest distance from it, and their number.
    others: Vec<([f64; 2], f64, usize)>,
}

impl Search<'_> {
    fn run(&self) -> Result<Chessboard> {
        let mut seen = Seen::default();
        for level in (0..self.pyramid.levels().len()).rev() {
            if let Some(board) = self.search(level, &mut seen)? {
                return Ok(board);
            }
        }
        // The fullest first; of equals, the one of the coarser level.
        let mut parts = std::mem::take(&mut seen.parts);
        parts.sort_by_key(|(board, _)| std::cmp::Reverse(board.count()));
        // Part of a larger board that another level shows in full.
        let others = std::mem::take(&mut seen.others);
        parts.retain(|(board, level)| {
            let ([x, y], _) = disc(board, *level);
            let within = |([ox, oy], radius, n): &([f64; 2], f64, usize)| {
                *n >= board.count() && (x - ox).hypot(y - oy) < *radius
            };
            !others.iter().any(within)
        });
        let found = parts.into_iter().take(MAX_PARTS).find_map(|(board, level)| self.confirm(board, level, &mut seen));
        found.ok_or_else(|| Error::NoChessboard { reason: seen.reason(self.size) })
    }

    /// The whole board at one level; what is not whole, or of unknown size and perhaps part of a larger
    /// one, is kept for later.
    fn search(&self, level: usize, seen: &mut Seen) -> Result<Option<Chessboard>> {
        let image = &self.pyramid.levels()[level];
        let peaks = response::peaks(image, THRESHOLD, MAX_PEAKS);
        let saddles: Vec<Saddle> = peaks.into_iter().filter_map(|p| Saddle::at(image, p)).collect();
        seen.corners = seen.corners.max(saddles.len());
        let mut whole: Option<Chessboard> = None;
        for grid in lattice::grids(&saddles, [image.width(), image.height()]) {
            let board = match Board::new(&grid, &saddles, self.size) {
                Ok(board) if board.columns.max(board.rows) <= MAX_SIDE as usize => board,
                Ok(other) | Err(other) => {
                    seen.see([other.columns, other.rows]);
                    let (middle, radius) = disc(&other, level);
                    match self.size {
                        // Larger than any board: it may go on where it was not followed.
                        None => seen.others.push((middle, f64::INFINITY, other.count())),
                        Some([c, r]) if other.columns * other.rows > c * r => {
                            seen.others.push((middle, radius, other.count()));
                        }
                        Some(_) => {}
                    }
                    continue;
                }
            };
            seen.see([board.columns, board.rows]);
            if !self.enough(&board, board.count()) {
                continue;
            }
            if self.size.is_none() || board.count() < board.points.len() {
                seen.parts.push((board, level));
            } else if let Some(board) = self.confirm(board, level, seen) {
                if let Some(other) = whole {
                    let reason = format!("two have {} x {} corners", other.columns, other.rows);
                    return Err(Error::ManyChessboards { reason });
                }
                whole = Some(board);
            }
        }
        Ok(whole)
    }

    /// The board with its corners fitted, if it is one.
    fn confirm(&self, mut board: Board, level: usize, seen: &mut Seen) -> Option<Chessboard> {
        let refined = refine(&self.pyramid, level, &mut board);
        if !self.enough(&board, refined.count()) {
            return None;
        }
        let mut rest = board.clone();
        rest.strip(self.size);
        if rest.points.len() < board.points.len() {
            // Border lines were clutter; without them the rest may be any part of a known size.
            let rest = if self.size.is_none() { rest.oriented(None).ok() } else { None };
            return rest.and_then(|rest| self.confirm(rest, refined.level, seen));
        }
        if self.size.is_some()
            && let Some(size) = refine::larger(&self.pyramid, &board, &refined)
        {
            seen.see(size);
            return None;
        }
        Some(finish(&board, &refined))
    }

    fn enough(&self, board: &Board, found: usize) -> bool {
        let least = (self.min_found * board.points.len() as f64).ceil() as usize;
        let sides = board.columns.min(board.rows) >= MIN_SIDE as usize;
        sides && found >= least.max(MIN_FOUND)
    }
}

impl Seen {
    /// A grid; which side is longer is all that counts.
    fn see(&mut self, [a, b]: [usize; 2]) {
        let [columns, rows] = [a.max(b), a.min(b)];
        if self.grid.is_none_or(|[c, r]| columns * rows > c * r) {
            self.grid = Some([columns, rows]);
        }
    }

    fn reason(&self, wanted: Option<[usize; 2]>) -> String {
        match (self.grid, wanted) {
            (Some([c, r]), Some([columns, rows])) if [c, r] != [columns, rows] && [r, c] != [columns, rows] => {
                format!("the largest grid has {c} x {r} corners, not {columns} x {rows}")
            }
            (Some([c, r]), _) => format!("too few corners of a grid of {c} x {r} are seen"),
            (None, _) if self.corners == 0 => "nothing looks like the corner of four squares".to_string(),
            (None, _) => format!("{} places look like corners, but they make no grid", self.corners),
        }
    }
}

/// Mean of the board's corners in the full image, and the greatest distance from it.
fn disc(board: &Board, level: usize) -> ([f64; 2], f64) {
    let points = || board.points.iter().flatten().map(|p| to_full_size(level, *p));
    let n = board.count().max(1) as f64;
    let middle = points().fold([0.0; 2], |m, p| [m[0] + p[0] / n, m[1] + p[1] / n]);
    (middle, points().map(|p| (p[0] - middle[0]).hypot(p[1] - middle[1])).fold(0.0, f64::max))
}

fn finish(board: &Board, refined: &Refined) -> Chessboard {
    let scale = (1u64 << refined.level) as f64;
    let corner = |f: corner_fit::CornerFit| {
        let [x, y] = to_full_size(refined.level, f.position);
        ChessboardCorner { x, y, covariance: f.covariance.map(|c| scale * scale * c) }
    };
    let fits = refined.fits.iter();
    let blur = fits.clone().flatten().map(|f| f.blur).sum::<f64>() / refined.count().max(1) as f64;
    Chessboard {
        columns: board.columns,
        rows: board.rows,
        corners: fits.map(|f| f.map(corner)).collect(),
        blur: scale * blur,
    }
}
