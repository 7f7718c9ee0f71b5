//! From corners to grids: a corner with four neighbours is a seed, and the grid grows from it, each
//! next corner near where the last ones point. Only neighbours predict, so that perspective and
//! lenses may bend the grid as they like.

use super::saddle::Saddle;

/// Corners farther apart than this, in pixels of the level, are a coarser level's.
const MAX_STEP: f32 = 44.0;
const MIN_STEP: f32 = 3.0;
const CELL: f32 = 11.0;
/// Sine of the greatest angle between an edge and the way to the next corner.
const MAX_TURN: f32 = 0.5;
/// Sine of the greatest angle between edges that ought to be parallel.
const MAX_SKEW: f32 = 0.45;
/// How far a corner may be from its prediction, in steps.
const TOLERANCE: f32 = 0.28;
/// A seed's opposite neighbours: difference of their distances over the larger.
const MAX_UNEVEN: f32 = 0.4;
/// Greatest distance from the seed, in corners: one more than the largest board.
const REACH: i32 = 128;
/// Fewest corners of a grid.
const MIN_CORNERS: usize = 6;

/// Corners in rows and columns.
#[derive(Debug, Clone)]
pub struct Grid {
    pub columns: usize,
    pub rows: usize,
    /// Row by row; indices into the saddles. From one column to the next, and then from one row to
    /// the next, one turns as from x to y.
    pub corners: Vec<Option<u32>>,
    /// Whether the square between the first corner, the next one in its row and the next one in its column is bright.
    pub first_is_bright: bool,
}

/// All grids among the corners; no corner is in two.
pub fn grids(saddles: &[Saddle], size: [usize; 2]) -> Vec<Grid> {
    let buckets = Buckets::new(saddles, size);
    let mut used = vec![false; saddles.len()];
    let mut lattice = Lattice::new(saddles, &buckets);
    let mut grids = Vec::new();
    for seed in 0..saddles.len() {
        if used[seed] || !lattice.start(seed, &used) {
            continue;
        }
        lattice.grow(&used);
        if lattice.cells.len() >= MIN_CORNERS {
            lattice.cells.iter().for_each(|(_, s)| used[*s as usize] = true);
            grids.extend(lattice.grid());
        }
        lattice.clear();
    }
    grids
}

/// Corners by place.
struct Buckets {
    columns: usize,
    rows: usize,
    /// Where each cell's corners begin in `items`.
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Buckets {
    fn new(saddles: &[Saddle], [width, height]: [usize; 2]) -> Self {
        let [columns, rows] = [width, height].map(|s| s / CELL as usize + 1);
        let mut buckets = Self { columns, rows, starts: vec![0; columns * rows + 1], items: vec![0; saddles.len()] };
        let cells: Vec<usize> = saddles.iter().map(|s| buckets.cell(s.position)).collect();
        cells.iter().for_each(|c| buckets.starts[c + 1] += 1);
        for c in 0..columns * rows {
            buckets.starts[c + 1] += buckets.starts[c];
        }
        let mut next = buckets.starts.clone();
        for (i, c) in cells.iter().enumerate() {
            buckets.items[next[*c] as usize] = i as u32;
            next[*c] += 1;
        }
        buckets
    }

    fn place(&self, [x, y]: [f32; 2]) -> (usize, usize) {
        // Negative numbers become 0.
        (((x / CELL) as usize).min(self.columns - 1), ((y / CELL) as usize).min(self.rows - 1))
    }

    fn cell(&self, position: [f32; 2]) -> usize {
        let (column, row) = self.place(position);
        row * self.columns + column
    }

    /// Corners within `radius` in x and y, and others.
    fn near(&self, [x, y]: [f32; 2], radius: f32) -> impl Iterator<Item = u32> + '_ {
        let (left, top) = self.place([x - radius, y - radius]);
        let (right, bottom) = self.place([x + radius, y + radius]);
        (top..=bottom).flat_map(move |row| {
            let cells = row * self.columns;
            let (from, to) = (self.starts[cells + left] as usize, self.starts[cells + right + 1] as usize);
            self.items[from..to].iter().copied()
        })
    }
}

type Cell = [i32; 2];

/// The neighbours of a cell, right, down, left, up.
const SIDES: [Cell; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];
const SIDE: usize = 2 * REACH as usize + 1;

/// A grid as it grows; the seed is cell (0, 0).
struct Lattice<'a> {
    saddles: &'a [Saddle],
    buckets: &'a Buckets,
    /// Corner + 1 of each cell, 0 for none.
    table: Vec<u32>,
    cells: Vec<(Cell, u32)>,
}

impl<'a> Lattice<'a> {
    fn new(saddles: &'a [Saddle], buckets: &'a Buckets) -> Self {
        Self { saddles, buckets, table: vec![0; SIDE * SIDE], cells: Vec::new() }
    }

    fn clear(&mut self) {
        for ([i, j], _) in self.cells.drain(..) {
            self.table[index([i, j])] = 0;
        }
    }

    fn set(&mut self, cell: Cell, saddle: u32) {
        self.table[index(cell)] = saddle + 1;
        self.cells.push((cell, saddle));
    }

    fn get(&self, cell: Cell) -> Option<[f32; 2]> {
        let inside = cell.iter().all(|c| c.abs() <= REACH);
        let saddle = if inside { self.table[index(cell)] } else { 0 };
        (saddle > 0).then(|| self.saddles[saddle as usize - 1].position)
    }

    /// Sets the seed and its four neighbours, if it has them.
    fn start(&mut self, seed: usize, used: &[bool]) -> bool {
        let Saddle { position, edges } = self.saddles[seed];
        let mut nearest = [(MAX_STEP, None); 4];
        // Wider only while there is need: most boards at the right level have small squares.
        for radius in [0.3 * MAX_STEP, MAX_STEP] {
            for other in self.buckets.near(position, radius).filter(|o| !used[*o as usize]) {
                let there = &self.saddles[other as usize];
                let way = sub(there.position, position);
                let distance = way[0].hypot(way[1]);
                if !(MIN_STEP..=radius).contains(&distance) {
                    continue;
                }
                let along = edges.map(|e| dot(e, way));
                let axis = (along[1].abs() > along[0].abs()) as usize;
                let turned = cross(edges[axis], way).abs() > MAX_TURN * distance;
                // Bright and dark are exchanged from a corner to the next.
                if turned || !parallel(there.edges[0], edges[1]) || !parallel(there.edges[1], edges[0]) {
                    continue;
                }
                let side = axis + 2 * (along[axis] < 0.0) as usize;
                if distance < nearest[side].0 {
                    nearest[side] = (distance, Some(other));
                }
            }
            if nearest.iter().all(|n| n.1.is_some()) {
                break;
            }
        }
        let [Some(right), Some(down), Some(left), Some(up)] = nearest.map(|n| n.1) else { return false };
        let even = |a: f32, b: f32| (a - b).abs() <= MAX_UNEVEN * a.max(b);
        if !even(nearest[0].0, nearest[2].0) || !even(nearest[1].0, nearest[3].0) {
            return false;
        }
        self.set([0, 0], seed as u32);
        for (side, neighbour) in SIDES.into_iter().zip([right, down, left, up]) {
            self.set(side, neighbour);
        }
        true
    }

    /// Adds corners until none fits any more.
    fn grow(&mut self, used: &[bool]) {
        let mut next = 0;
        while let Some(&([i, j], _)) = self.cells.get(next) {
            next += 1;
            for [di, dj] in SIDES {
                let cell = [i + di, j + dj];
                if cell.iter().any(|c| c.abs() > REACH) || self.table[index(cell)] > 0 {
                    continue;
                }
                if let Some(found) = self.find(cell, [di, dj], used) {
                    self.set(cell, found);
                }
            }
        }
    }

    /// The corner of an empty cell, `side` of one that is there.
    fn find(&self, cell: Cell, side: Cell, used: &[bool]) -> Option<u32> {
        let base_cell = [cell[0] - side[0], cell[1] - side[1]];
        let base = self.get(base_cell)?;
        let predicted = self.predict(cell, side)?;
        let step = sub(predicted, base);
        let length = step[0].hypot(step[1]);
        let across = self.direction(base_cell, [side[1].abs(), side[0].abs()]);
        let width = across.map_or(length, |a| a[0].hypot(a[1]));
        let tolerance = TOLERANCE * length.min(1.5 * width);
        // Edges along the row first where the square to the lower right is bright.
        let even = (cell[0] + cell[1]) % 2 == 0;
        let mut best = (tolerance, None);
        for other in self.buckets.near(predicted, tolerance) {
            let there = &self.saddles[other as usize];
            let away = sub(there.position, predicted);
            let distance = away[0].hypot(away[1]);
            let along = there.edges[(even != (side[1] == 0)) as usize];
            let aside = there.edges[(even == (side[1] == 0)) as usize];
            let fits = parallel(along, step) && across.is_none_or(|a| parallel(aside, a));
            if distance < best.0 && fits && !used[other as usize] && !self.holds(other, cell) {
                best = (distance, Some(other));
            }
        }
        best.1
    }

    /// Whether a corner has a place near `cell` already.
    fn holds(&self, saddle: u32, [i, j]: Cell) -> bool {
        let around = |i: i32, j: i32| (-2..=2).flat_map(move |a| (-2..=2).map(move |b| [i + a, j + b]));
        around(i, j).any(|c| c.iter().all(|c| c.abs() <= REACH) && self.table[index(c)] == saddle + 1)
    }

    /// From a cell to the next along an axis, by what is there.
    fn direction(&self, cell: Cell, axis: Cell) -> Option<[f32; 2]> {
        let [before, after] = [-1, 1].map(|s| self.get([cell[0] + s * axis[0], cell[1] + s * axis[1]]));
        let here = self.get(cell)?;
        match (before, after) {
            (Some(b), Some(a)) => Some(sub(a, b).map(|d| 0.5 * d)),
            (Some(b), None) => Some(sub(here, b)),
            (None, Some(a)) => Some(sub(a, here)),
            (None, None) => None,
        }
    }

    /// The mean of what the line and the lines beside it predict; `side` points from what is there.
    fn predict(&self, [i, j]: Cell, [di, dj]: Cell) -> Option<[f32; 2]> {
        let back = |n: i32| self.get([i - n * di, j - n * dj]);
        let base = back(1)?;
        let mut sum = [0.0f32; 2];
        let mut count = 0.0;
        let mut vote = |p: [f32; 2]| {
            sum = [sum[0] + p[0], sum[1] + p[1]];
            count += 1.0;
        };
        if let Some(second) = back(2) {
            let step = sub(base, second);
            // In perspective steps grow or shrink along a line.
            let change = back(3).map_or([0.0; 2], |third| sub(step, sub(second, third)));
            vote([0, 1].map(|k| base[k] + step[k] + change[k]));
        }
        for s in [-1, 1] {
            let beside = [i + s * dj, j + s * di];
            if let (Some(there), Some(behind)) = (self.get(beside), self.get([beside[0] - di, beside[1] - dj])) {
                vote([0, 1].map(|k| base[k] + there[k] - behind[k]));
            }
        }
        (count > 0.0).then(|| sum.map(|s| s / count))
    }

    /// The grid without border lines that hold next to nothing; `None` when nothing is left.
    fn grid(&self) -> Option<Grid> {
        let bounds = |axis: usize| {
            let of = |c: &(Cell, u32)| c.0[axis];
            Some([self.cells.iter().map(of).min()?, self.cells.iter().map(of).max()?])
        };
        let ([left, right], [top, bottom]) = (bounds(0)?, bounds(1)?);
        let (columns, rows) = ((right - left + 1) as usize, (bottom - top + 1) as usize);
        let mut corners = vec![None; columns * rows];
        for ([i, j], saddle) in &self.cells {
            corners[(j - top) as usize * columns + (i - left) as usize] = Some(*saddle);
        }
        let first_is_bright = (left + top) % 2 == 0;
        Some(Grid { columns, rows, corners, first_is_bright })
    }
}

fn index([i, j]: Cell) -> usize {
    (j + REACH) as usize * SIDE + (i + REACH) as usize
}

fn sub(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[1] - a[1] * b[0]
}

/// Whether a unit vector and another lie along one direction, roughly.
fn parallel(unit: [f32; 2], other: [f32; 2]) -> bool {
    cross(unit, other).abs() <= MAX_SKEW * other[0].hypot(other[1])
}
