//! What a station saw in which direction: how near and how far, on the faces of a cube around it, in cells that
//! are as fine as the measurements fill them.
//!
//! Two stations' views tell whether a pose between them can be true. Where one sees through a place in
//! which the other has a surface, it cannot.

use nalgebra::Vector3;

use super::kernels::{cells_of_directions, direction};

/// Most cells along the side of a face: 2 degrees.
const MAX_SIDE: usize = 45;
/// Fewest: 18 degrees.
const MIN_SIDE: usize = 5;
/// Measurements in a cell that holds any, on average. At random, a third of the cells is empty then, and the
/// neighbours of a direction are rarely missing; finer cells of a sparse scan know nothing of each other.
const FILLED: f64 = 1.6;

/// Most parts along the side of a face: 6 degrees, as wide as a piece of furniture.
const MAX_PARTS: usize = 15;

/// Least cosine between planes that may be one.
const ALIKE: f64 = 0.94;

/// The measurements of one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cell {
    near: f64,
    far: f64,
    /// One of them: which does not matter.
    place: Vector3<f64>,
    /// The unit normal of its plane.
    normal: Option<Vector3<f64>>,
}

#[derive(Clone, PartialEq)]
pub(crate) struct View {
    /// Cells along the side of a face.
    side: usize,
    /// Which cell is in which direction, six faces, row by row; `EMPTY` where nothing was measured.
    index: Vec<u32>,
    cells: Vec<Cell>,
}

const EMPTY: u32 = u32::MAX;
/// Measurements whose coordinates are held at a time.
const BLOCK: usize = 1024;

impl std::fmt::Debug for View {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "View of {} directions", self.count())
    }
}

/// What a view says about a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sight {
    /// Nothing was measured there, or something before it.
    Unknown,
    /// The same surface was measured there.
    Surface,
    /// The view goes through it.
    Contradiction,
}

impl View {
    /// Of so many places, with the unit normals of their planes.
    pub fn of(
        count: usize,
        place: impl Fn(usize) -> Vector3<f64>,
        normal: impl Fn(usize) -> Option<Vector3<f64>>,
    ) -> Self {
        let [u, v, ranges] = directions(count, &place);
        let used = u.iter().filter(|u| !u.is_nan()).count();
        let (mut side, mut cells) = (MAX_SIDE, vec![EMPTY; count]);
        let (mut index, filled) = loop {
            cells_of_directions(&mut cells, &u, &v, side as u32, (6 * side * side) as u32);
            let mut held = vec![false; 6 * side * side + 1];
            cells.iter().for_each(|c| held[*c as usize] = true);
            let filled = held[..6 * side * side].iter().filter(|h| **h).count();
            if used as f64 >= FILLED * filled as f64 || side == MIN_SIDE {
                break (vec![EMPTY; 6 * side * side], filled);
            }
            side = (side * 4 / 5).max(MIN_SIDE);
        };
        let mut held: Vec<Cell> = Vec::with_capacity(filled);
        for (i, (cell, range)) in cells.iter().zip(&ranges).enumerate() {
            let Some(index) = index.get_mut(*cell as usize) else { continue };
            match held.get_mut(*index as usize) {
                None => {
                    *index = held.len() as u32;
                    held.push(Cell { near: *range, far: *range, place: place(i), normal: normal(i) });
                }
                Some(cell) => {
                    cell.near = if *range < cell.near { *range } else { cell.near };
                    cell.far = if *range > cell.far { *range } else { cell.far };
                }
            }
        }
        Self { side, index, cells: held }
    }

    /// How many [`places`](Self::places) there are.
    pub fn count(&self) -> usize {
        self.cells.len()
    }

    fn cell(&self, index: usize) -> Option<&Cell> {
        self.cells.get(self.index[index] as usize)
    }

    /// How many parts the view has.
    pub fn parts(&self) -> usize {
        6 * self.side.min(MAX_PARTS).pow(2)
    }

    /// One place for each direction in which something was measured: in which part of the view, where, and its
    /// plane's unit normal.
    pub fn places(&self) -> impl Iterator<Item = (usize, Vector3<f64>, Option<Vector3<f64>>)> {
        let places = (0..self.index.len()).filter_map(|index| Some((index, self.cell(index)?)));
        places.map(|(index, c)| (self.part_of(index), c.place, c.normal))
    }

    fn part_of(&self, index: usize) -> usize {
        let [face, row, column] = self.face_row_column(index);
        let parts = self.side.min(MAX_PARTS);
        (face * parts + row * parts / self.side) * parts + column * parts / self.side
    }

    fn face_row_column(&self, index: usize) -> [usize; 3] {
        [index / (self.side * self.side), index / self.side % self.side, index % self.side]
    }

    /// What was seen at a place on a plane, to `tolerance` times its distance and `margin` metres.
    /// Neighbouring directions are looked at too: surfaces seen from two places are not cut into the
    /// same cells.
    pub fn sight(&self, place: &Vector3<f64>, normal: Option<&Vector3<f64>>, margin: f64, tolerance: f64) -> Sight {
        let Some(index) = cell_of(place, self.side) else { return Sight::Unknown };
        let range = place.norm();
        let slack = margin + tolerance * range;
        let (mut before, mut known) = (true, 0);
        let [face, row, column] = self.face_row_column(index);
        for r in row.saturating_sub(1)..(row + 2).min(self.side) {
            for c in column.saturating_sub(1)..(column + 2).min(self.side) {
                let Some(cell) = self.cell((face * self.side + r) * self.side + c) else { continue };
                let alike = normal.zip(cell.normal).is_none_or(|(n, m)| n.dot(&m) >= ALIKE);
                if alike && cell.reaches(place, range, slack) {
                    return Sight::Surface;
                }
                before &= cell.lies_beyond(place, range, slack);
                known += 1;
            }
        }
        // Between the rays of a sparse scan there may be anything.
        if before && known >= 3 { Sight::Contradiction } else { Sight::Unknown }
    }
}

impl Cell {
    /// Whether its surface passes a place at this range.
    fn reaches(&self, place: &Vector3<f64>, range: f64, slack: f64) -> bool {
        match &self.normal {
            Some(m) => m.dot(&(place - self.place)).abs() <= slack,
            None => range >= self.near - slack && range <= self.far + slack,
        }
    }

    /// Whether it was seen behind a place at this range, and its surface would be there too.
    fn lies_beyond(&self, place: &Vector3<f64>, range: f64, slack: f64) -> bool {
        self.near > range + slack && self.normal.is_none_or(|m| m.dot(&(self.place - place)) > slack)
    }
}

/// Directions on the faces of a cube, and ranges: see [`kernels::directions`](super::kernels::directions).
fn directions(count: usize, place: impl Fn(usize) -> Vector3<f64>) -> [Vec<f64>; 3] {
    let [mut u, mut v, mut range] = [0; 3].map(|_| vec![0.0; count]);
    let [mut x, mut y, mut z] = [[0.0; BLOCK]; 3];
    for start in (0..count).step_by(BLOCK) {
        let end = count.min(start + BLOCK);
        for i in start..end {
            let p = place(i);
            (x[i - start], y[i - start], z[i - start]) = (p.x, p.y, p.z);
        }
        let (x, y, z) = (&x[..end - start], &y[..end - start], &z[..end - start]);
        super::kernels::directions(&mut u[start..end], &mut v[start..end], &mut range[start..end], x, y, z);
    }
    [u, v, range]
}

/// The cell of a direction, on faces of so many cells a side; `None` for the origin and what is not finite.
fn cell_of(place: &Vector3<f64>, side: usize) -> Option<usize> {
    let ([u, v], mut cell) = (direction(place.x, place.y, place.z), [0]);
    cells_of_directions(&mut cell, &[u], &[v], side as u32, EMPTY);
    (cell[0] != EMPTY).then_some(cell[0] as usize)
}
