//! From a grid to the board that was asked for: its size, and which corner is the first.

use super::lattice::Grid;
use super::saddle::Saddle;

/// A border line with at most this share of its corners is clutter beside the board.
const STRAY: f64 = 0.25;
/// The same where the grid is larger than the board.
const STRAY_BEYOND: f64 = 0.5;

/// Corners of a board where they were found; pixels of a level.
#[derive(Debug, Clone)]
pub struct Board {
    pub columns: usize,
    pub rows: usize,
    /// Row by row.
    pub points: Vec<Option<[f64; 2]>>,
    /// Whether the square between the first corner, the next in its row and the next in its column is bright.
    pub first_is_bright: bool,
}

impl Board {
    /// Without border lines that hold next to nothing, and turned as the size demands (any size for `None`):
    /// if colours allow so that the square outside the first corner is dark, and then so that the
    /// first corner is as near to the upper left as can be. Unturned, as the error, when the size is another.
    pub fn new(grid: &Grid, saddles: &[Saddle], size: Option<[usize; 2]>) -> Result<Self, Self> {
        let points = grid.corners.iter().map(|c| c.map(|c| saddles[c as usize].position.map(f64::from)));
        let mut board = Self {
            columns: grid.columns,
            rows: grid.rows,
            points: points.collect(),
            first_is_bright: grid.first_is_bright,
        };
        board.strip(size);
        board.oriented(size)
    }

    /// Turned as [`new`](Self::new) says.
    pub fn oriented(self, size: Option<[usize; 2]>) -> Result<Self, Self> {
        let unturned = self.clone();
        let mut turns = vec![self];
        for _ in 0..3 {
            turns.extend(turns.last().map(Self::turned));
        }
        let found = [turns[0].columns, turns[0].rows];
        let wanted = size.unwrap_or([found[0].max(found[1]), found[0].min(found[1])]);
        let fitting = turns.into_iter().filter(|b| [b.columns, b.rows] == wanted);
        let corner = |b: &Self| b.points.iter().flatten().next().map_or(0.0, |p| p[0] + p[1]);
        let order = |a: &Self, b: &Self| (a.first_is_bright, corner(a)).partial_cmp(&(b.first_is_bright, corner(b)));
        fitting.min_by(|a, b| order(a, b).unwrap_or(std::cmp::Ordering::Equal)).ok_or(unturned)
    }

    pub fn count(&self) -> usize {
        self.points.iter().flatten().count()
    }

    pub fn get(&self, column: isize, row: isize) -> Option<[f64; 2]> {
        let inside = column >= 0 && row >= 0 && column < self.columns as isize && row < self.rows as isize;
        if inside { self.points[row as usize * self.columns + column as usize] } else { None }
    }

    /// Whether the square between a corner, the next in its row and the next in its column is bright.
    pub fn is_bright(&self, index: usize) -> bool {
        self.first_is_bright == (index / self.columns + index % self.columns).is_multiple_of(2)
    }

    /// To the next corner along row and column, by what is there; along a row or column beside it where
    /// the corner's own is empty.
    pub fn steps(&self, index: usize) -> Option<[[f64; 2]; 2]> {
        let (i, j) = ((index % self.columns) as isize, (index / self.columns) as isize);
        let along = |di: isize, dj: isize| {
            let at = |n: isize, side: isize| self.get(i + n * di + side * dj, j + n * dj + side * di);
            [0, -1, 1].into_iter().find_map(|side| match (at(-1, side), at(0, side), at(1, side)) {
                (Some(a), _, Some(b)) => Some([0, 1].map(|k| 0.5 * (b[k] - a[k]))),
                (Some(a), Some(b), _) | (_, Some(a), Some(b)) => Some([0, 1].map(|k| b[k] - a[k])),
                _ => None,
            })
        };
        Some([along(1, 0)?, along(0, 1)?])
    }

    /// Where an empty corner must be by those about it: the mean of what lines through it say.
    pub fn predict(&self, index: usize) -> Option<[f64; 2]> {
        let (i, j) = ((index % self.columns) as isize, (index / self.columns) as isize);
        let mut votes = Vec::new();
        for (di, dj) in [(1, 0), (0, 1), (1, 1), (1, -1)] {
            let at = |n: isize| self.get(i + n * di, j + n * dj);
            let line = |weights: &[(isize, f64)]| -> Option<[f64; 2]> {
                let mut sum = [0.0; 2];
                for (n, weight) in weights {
                    let p = at(*n)?;
                    sum = [sum[0] + weight * p[0], sum[1] + weight * p[1]];
                }
                Some(sum)
            };
            // Polynomials through the neighbours: between them where there are some, else beyond.
            let between = line(&[(-2, -1.0 / 6.0), (-1, 4.0 / 6.0), (1, 4.0 / 6.0), (2, -1.0 / 6.0)])
                .or_else(|| line(&[(-1, 0.5), (1, 0.5)]));
            match between {
                Some(p) => votes.push(p),
                None => {
                    votes.extend([1, -1].into_iter().filter_map(|s| line(&[(s, 3.0), (2 * s, -3.0), (3 * s, 1.0)])))
                }
            }
        }
        let n = votes.len() as f64;
        let sum = votes.iter().fold([0.0; 2], |s, v| [s[0] + v[0], s[1] + v[1]]);
        (n > 0.0).then(|| sum.map(|s| s / n))
    }

    fn turned(&self) -> Self {
        let (columns, rows) = (self.rows, self.columns);
        let points = (0..rows).flat_map(|row| {
            (0..columns).map(move |column| self.points[column * self.columns + self.columns - 1 - row])
        });
        let first_is_bright = self.first_is_bright == self.columns.is_multiple_of(2);
        Self { columns, rows, points: points.collect(), first_is_bright }
    }

    /// Takes border lines off that are clutter, which may turn the board.
    pub fn strip(&mut self, size: Option<[usize; 2]>) {
        for _ in 0..self.columns + self.rows {
            // How full the first row is, whichever of the four it is.
            let share = |b: &Self| b.points[..b.columns].iter().flatten().count() as f64 / b.columns as f64;
            let (mut emptiest, mut least) = (0, f64::INFINITY);
            let mut turned = self.clone();
            let mut turns = Vec::new();
            for turn in 0..4 {
                let here = share(&turned);
                if here < least {
                    (emptiest, least) = (turn, here);
                }
                turns.push(turned.clone());
                turned = turned.turned();
            }
            let fits = |[c, r]: [usize; 2]| self.columns <= c && self.rows <= r || self.columns <= r && self.rows <= c;
            let limit = if size.is_none_or(fits) { STRAY } else { STRAY_BEYOND };
            let lonely = (least * turns[emptiest].columns as f64) < 1.5;
            if (least > limit && !lonely) || turns[emptiest].rows < 2 {
                break;
            }
            // Without its first row.
            let mut board = turns.swap_remove(emptiest);
            board.points.drain(..board.columns);
            board.rows -= 1;
            board.first_is_bright = !board.first_is_bright;
            *self = board;
        }
    }
}
