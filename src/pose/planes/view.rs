//! What a station saw in which direction: how near and how far, on the faces of a cube around it, in cells that
//! are as fine as the measurements fill them.
//!
//! Two stations' views tell whether a pose between them can be true. Where one sees through a place in
//! which the other has a surface, it cannot.

use nalgebra::Vector3;

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
    /// Six faces, row by row.
    cells: Vec<Option<Cell>>,
    /// Cells that hold something.
    count: usize,
}

impl std::fmt::Debug for View {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "View of {} directions", self.count)
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
    /// Of places, with the unit normals of their planes.
    pub fn of(measurements: impl Iterator<Item = (Vector3<f64>, Option<Vector3<f64>>)> + Clone) -> Self {
        let mut side = MAX_SIDE;
        loop {
            let (view, used) = Self::of_cells(side, measurements.clone());
            let filled = used as f64 / view.count.max(1) as f64;
            if filled >= FILLED || side == MIN_SIDE {
                return view;
            }
            side = (side * 4 / 5).max(MIN_SIDE);
        }
    }

    fn of_cells(
        side: usize,
        measurements: impl Iterator<Item = (Vector3<f64>, Option<Vector3<f64>>)>,
    ) -> (Self, usize) {
        let mut cells = vec![None; 6 * side * side];
        let mut used = 0;
        for (place, normal) in measurements {
            let Some(index) = cell_of(&place, side) else { continue };
            let range = place.norm();
            used += 1;
            match &mut cells[index] {
                None => cells[index] = Some(Cell { near: range, far: range, place, normal }),
                Some(cell) => {
                    cell.near = cell.near.min(range);
                    cell.far = cell.far.max(range);
                }
            }
        }
        let count = cells.iter().flatten().count();
        (Self { side, cells, count }, used)
    }

    /// How many [`places`](Self::places) there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// How many parts the view has.
    pub fn parts(&self) -> usize {
        6 * self.side.min(MAX_PARTS).pow(2)
    }

    /// One place for each direction in which something was measured: in which part of the view, where, and its
    /// plane's unit normal.
    pub fn places(&self) -> impl Iterator<Item = (usize, Vector3<f64>, Option<Vector3<f64>>)> {
        let places = self.cells.iter().enumerate().filter_map(|(index, c)| Some((index, c.as_ref()?)));
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
                let Some(cell) = &self.cells[(face * self.side + r) * self.side + c] else { continue };
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

/// The cell of a direction, on faces of so many cells a side; `None` for the origin and what is not finite.
fn cell_of(place: &Vector3<f64>, side: usize) -> Option<usize> {
    let axis = place.iamax();
    let size = place[axis].abs();
    if !(size > 0.0 && place.iter().all(|v| v.is_finite())) {
        return None;
    }
    let face = 2 * axis + usize::from(place[axis] < 0.0);
    // Of equal angles, to a fifth of a degree, rather than of equal sides: the arctangent up to 45 degrees as a share
    // of the right angle (Rajan et al., "Efficient approximations for the arctangent function", IEEE SPM 2006).
    let step = |v: f64| {
        let t = v / size;
        let angle = t * (0.5 + 0.1737 * (1.0 - t.abs())) + 0.5;
        ((angle * side as f64) as usize).min(side - 1)
    };
    Some((face * side + step(place[(axis + 1) % 3])) * side + step(place[(axis + 2) % 3]))
}
