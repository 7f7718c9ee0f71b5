//! An octave of the Gaussian scale space that flows past: rows come in at the top, and every level
//! keeps as many as its users look back on. Memory thus grows with the image's width only, and what is
//! worked on stays in the cache.
//!
//! The levels beyond twice the first one's blur have nothing that half the pixels would not show. They
//! are those of the next octave, interpolated ([`super::raised`]).

use super::doubling::{self, Doubling};
use super::kernels::{LANES, Lanes, filter_columns, filter_row};
use super::raised::Raised;
use super::rows::{Aligned, Rows};

/// Scales an octave (Lowe's s), and the levels that take them: s + 3.
pub const INTERVALS: usize = 3;
pub const LEVELS: usize = INTERVALS + 3;
/// Levels of the octave's own pixels: up to twice the first one's blur.
const OWN: usize = INTERVALS + 1;
/// Blur of an octave's first level, in its pixels.
pub const SIGMA: f64 = 1.6;
/// Rows that all levels have above and below the one that is worked on: the widest descriptor's radius
/// (38), the steps of a refinement (5) and a gradient's neighbour.
pub const REACH: usize = 46;
/// Rows of the interpolated levels: the steps of a refinement and a neighbour.
pub const NEAR: usize = 6;
/// Rows that a level works out together, so that its sources are read from memory once.
pub const BATCH: usize = 8;
/// How far the row that is searched may be behind the last level of the octave's own pixels: the filters
/// of the next octave's levels (radii 5 and 6) and its batches, the interpolation, and what is near, in
/// pixels of which the next octave has half.
const BEHIND: usize = 2 * (5 + 6 + 2 * BATCH + 3) + NEAR + 4;
/// Groups of columns that are worked out together, for the same reason.
const COLUMNS: usize = 4;
/// Room left and right of a row that is filtered; no kernel is wider.
pub const MARGIN: usize = 16;
/// What a row has at least beyond its end, of no meaning: windows are read in groups of pixels.
pub const PADDING: usize = 40;

/// Half of a Gaussian filter, from the centre out to 4 sigma: with 3.5 photographs have fewer right matches.
struct Gaussian {
    weights: Vec<f32>,
}

impl Gaussian {
    fn new(sigma: f64) -> Self {
        let radius = ((4.0 * sigma).round() as usize).clamp(1, MARGIN);
        let raw: Vec<f64> = (0..=radius).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp()).collect();
        let sum = 2.0 * raw.iter().sum::<f64>() - 1.0;
        Self { weights: raw.iter().map(|w| (w / sum) as f32).collect() }
    }

    fn radius(&self) -> usize {
        self.weights.len() - 1
    }
}

/// What becomes of an octave's input.
#[derive(Debug, Clone, Copy)]
pub enum Input {
    /// It is the first level.
    Level,
    /// It is blurred, by so many pixels of the octave.
    Blurred(f64),
    /// It is doubled by linear interpolation, and then blurred.
    Doubled(f64),
}

pub struct Octave {
    width: usize,
    height: usize,
    /// The input where it is blurred first, and the levels of the octave's own pixels.
    rows: Vec<Rows>,
    /// From each of `rows` to the next.
    filters: Vec<Gaussian>,
    /// Instead of the first of them.
    doubling: Option<Doubling>,
    /// The levels above.
    raised: [Raised; LEVELS - OWN],
    /// Rows filtered along their columns, with margins.
    lines: Aligned,
}

impl Octave {
    pub fn new(width: usize, height: usize, input: Input) -> Self {
        let (first_blur, doubled) = match input {
            Input::Level => (None, false),
            Input::Blurred(sigma) => (Some(sigma), false),
            Input::Doubled(sigma) => (Some(sigma), true),
        };
        let step = |level: usize| SIGMA * (level as f64 / INTERVALS as f64).exp2();
        let between = (1..OWN).map(|l| (step(l).powi(2) - step(l - 1).powi(2)).sqrt());
        let filters: Vec<Gaussian> = first_blur.into_iter().chain(between).map(Gaussian::new).collect();
        let filled = width.next_multiple_of(LANES);
        let stride = (width + PADDING).next_multiple_of(LANES);
        let inputs = filters.len() + 1 - OWN;
        let rows = (0..=filters.len()).map(|i| {
            // How far the last level is behind this one.
            let lag: usize = filters[i..].iter().map(|f| f.radius() + BATCH).sum();
            let capacity = if i < inputs {
                2 * filters[i].radius() + 1 + 2 * BATCH
            } else {
                lag + BEHIND.max(REACH) + REACH + 2 * BATCH + 2
            };
            Rows::new(stride, capacity.min(height))
        });
        let rows = rows.collect();
        let doubling = filters.first().filter(|_| doubled).map(|blur| Doubling::new(&blur.weights));
        let raised = [0; LEVELS - OWN].map(|_| Raised::new(width, height));
        Self { width, height, rows, filters, doubling, raised, lines: Aligned::new(BATCH * (filled + 2 * MARGIN)) }
    }

    pub fn width(&self) -> usize {
        self.width
    }

    pub fn height(&self) -> usize {
        self.height
    }

    /// Row `y` of a level.
    #[inline(always)]
    pub fn row(&self, level: usize, y: usize) -> &[f32] {
        let row = if level < OWN { self.padded_row(level, y) } else { self.raised[level - OWN].row(y) };
        &row[..self.width]
    }

    /// Row `y` of a level of the octave's own pixels with at least [`PADDING`] numbers behind it.
    #[inline]
    pub fn padded_row(&self, level: usize, y: usize) -> &[f32] {
        self.rows[self.rows.len() - OWN + level].row(y)
    }

    /// How many rows a level of the octave's own pixels has had so far.
    pub fn rows(&self, level: usize) -> usize {
        self.rows[self.rows.len() - OWN + level].count()
    }

    /// Width or height of the next octave: every second pixel of this one, and one on the border or beyond.
    pub fn half(size: usize) -> usize {
        size / 2 + 1
    }

    /// Every second pixel of row 2 `y` of the level with twice the first one's blur, for the next octave:
    /// false if it is not there yet. Beyond the border the last pixel is repeated.
    pub fn hand(&self, y: usize, next: &mut Octave) -> bool {
        let y = (2 * y).min(self.height - 1);
        if y >= self.rows(INTERVALS) {
            return false;
        }
        let from = self.row(INTERVALS, y);
        next.push(|row| {
            row.iter_mut().zip(from.iter().step_by(2)).for_each(|(out, v)| *out = *v);
            if let ([.., out], [.., last]) = (row, from) {
                *out = *last;
            }
        });
        true
    }

    /// Works out the interpolated levels up to and without row `end`; whether the next octave had what
    /// that takes.
    pub fn raise(&mut self, next: &Octave, end: usize) -> bool {
        if next.rows(LEVELS - OWN) < Raised::needed(end).min(next.height) {
            return false;
        }
        for (i, raised) in self.raised.iter_mut().enumerate() {
            raised.advance(next, i + 1, end);
        }
        true
    }

    /// Takes the next row, which `fill` writes.
    pub fn push(&mut self, fill: impl FnOnce(&mut [f32])) {
        let width = if self.doubling.is_some() { self.width / 2 } else { self.width };
        fill(&mut self.rows[0].push()[..width]);
    }

    /// Works out the next few rows of every level that has its sources; whether there were any. To be
    /// called after every row until there are none: the levels keep what is needed no longer than that.
    pub fn advance(&mut self) -> bool {
        let mut any = false;
        for (i, gaussian) in self.filters.iter().enumerate() {
            let (before, after) = self.rows.split_at_mut(i + 1);
            let (source, target) = (&before[i], &mut after[0]);
            let doubling = self.doubling.as_ref().filter(|_| i == 0);
            // Beyond the last row it is repeated.
            let ready = match doubling {
                _ if source.count() == if doubling.is_some() { self.height / 2 } else { self.height } => self.height,
                Some(_) => 2 * source.count().saturating_sub(doubling::RADIUS),
                None => source.count().saturating_sub(gaussian.radius()),
            };
            if ready >= target.count() + BATCH || (ready == self.height && ready > target.count()) {
                let ys = target.count()..ready.min(target.count() + BATCH);
                let (size, lines) = ([self.width, self.height], self.lines.all_mut());
                match doubling {
                    Some(doubling) => doubling::blur(source, target, doubling, ys, size, lines),
                    None => blur(source, target, gaussian, ys, size, lines),
                }
                any = true;
            }
        }
        any
    }
}

/// Rows `ys` of the source, blurred: a few columns at a time along them, and what has its neighbours
/// then across, so that what is between the two stays in the nearest cache.
fn blur(
    source: &Rows,
    target: &mut Rows,
    gaussian: &Gaussian,
    ys: std::ops::Range<usize>,
    [width, height]: [usize; 2],
    lines: &mut [f32],
) {
    let (groups, radius) = (width.div_ceil(LANES), gaussian.radius());
    let long = groups * LANES + 2 * MARGIN;
    // Row y + i - radius, where the image ends the last one.
    let mut rows: [&[Lanes]; BATCH + 2 * MARGIN] = [&[]; BATCH + 2 * MARGIN];
    let rows = &mut rows[..ys.len() + 2 * radius];
    for (i, row) in rows.iter_mut().enumerate() {
        *row = source.row((ys.start + i).saturating_sub(radius).min(height - 1)).as_chunks().0;
    }
    target.extend(ys.len());
    for x in (0..groups).step_by(COLUMNS) {
        let columns = x..groups.min(x + COLUMNS);
        // The last group of columns lacks its neighbours on the right.
        let across = x.saturating_sub(1)..if columns.end == groups { groups } else { columns.end - 1 };
        filter_columns(lines, long, MARGIN, columns.clone(), rows, &gaussian.weights);
        for (y, line) in ys.clone().zip(lines.chunks_exact_mut(long)) {
            if x == 0 {
                let first = line[MARGIN];
                line[..MARGIN].fill(first);
            }
            if columns.end == groups {
                let last = line[MARGIN + width - 1];
                line[MARGIN + width..].fill(last);
            }
            let out = &mut target.row_mut(y).as_chunks_mut().0[across.clone()];
            filter_row(out, &line[MARGIN - radius + LANES * across.start..], &gaussian.weights);
        }
    }
}
