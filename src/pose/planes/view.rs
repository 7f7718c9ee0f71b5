//! What a station saw in which direction: how near and how far, on the faces of a cube around it.
//!
//! Two stations' views tell whether a pose between them can be true. Where one sees through a place in
//! which the other has a surface, it cannot.

use nalgebra::Vector3;

/// Cells along the side of a face: 2 degrees.
const SIDE: usize = 45;

/// Least cosine between planes that may be one.
const ALIKE: f64 = 0.94;

/// Cosine between a ray and a plane's normal below which the ray hardly sees it.
const GRAZING: f64 = 0.17;

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
    /// The view goes through it, or there is a surface across it.
    Contradiction,
}

impl View {
    /// Of places, with the unit normals of their planes.
    pub fn of(measurements: impl Iterator<Item = (Vector3<f64>, Option<Vector3<f64>>)>) -> Self {
        let mut cells = vec![None; 6 * SIDE * SIDE];
        for (place, normal) in measurements {
            let Some(index) = cell_of(&place) else { continue };
            let range = place.norm();
            match &mut cells[index] {
                None => cells[index] = Some(Cell { near: range, far: range, place, normal }),
                Some(cell) => {
                    cell.near = cell.near.min(range);
                    cell.far = cell.far.max(range);
                }
            }
        }
        let count = cells.iter().flatten().count();
        Self { cells, count }
    }

    /// How many [`places`](Self::places) there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// One place for each direction in which something was measured, with its plane's unit normal.
    pub fn places(&self) -> impl Iterator<Item = (Vector3<f64>, Option<Vector3<f64>>)> {
        self.cells.iter().flatten().map(|c| (c.place, c.normal))
    }

    /// What was seen at a place on a plane, to `tolerance` times its distance and `margin` metres.
    /// Neighbouring directions are looked at too: surfaces seen from two places are not cut into the
    /// same cells.
    pub fn sight(&self, place: &Vector3<f64>, normal: Option<&Vector3<f64>>, margin: f64, tolerance: f64) -> Sight {
        let Some(index) = cell_of(place) else { return Sight::Unknown };
        let range = place.norm();
        let slack = margin + tolerance * range;
        // A face that is turned away is hidden behind what stands there: a box shows each station other sides.
        let turned_away = normal.is_some_and(|n| n.dot(place) < GRAZING * range);
        let (mut nearest, mut known, mut across) = (f64::INFINITY, 0, false);
        let (face, row, column) = (index / (SIDE * SIDE), index / SIDE % SIDE, index % SIDE);
        for r in row.saturating_sub(1)..(row + 2).min(SIDE) {
            for c in column.saturating_sub(1)..(column + 2).min(SIDE) {
                let Some(cell) = &self.cells[(face * SIDE + r) * SIDE + c] else { continue };
                if range >= cell.near - slack && range <= cell.far + slack {
                    if normal.zip(cell.normal).is_none_or(|(n, m)| n.dot(&m) >= ALIKE) {
                        return Sight::Surface;
                    }
                    across |= !turned_away;
                }
                nearest = nearest.min(cell.near);
                known += 1;
            }
        }
        // Between the rays of a sparse scan there may be anything.
        let through = known >= 3 && range < nearest - slack;
        if across || through { Sight::Contradiction } else { Sight::Unknown }
    }
}

/// The cell of a direction; `None` for the origin and what is not finite.
fn cell_of(place: &Vector3<f64>) -> Option<usize> {
    let axis = place.iamax();
    let size = place[axis].abs();
    if !(size > 0.0 && place.iter().all(|v| v.is_finite())) {
        return None;
    }
    let face = 2 * axis + usize::from(place[axis] < 0.0);
    // Of equal angles rather than of equal sides.
    let step = |v: f64| {
        let angle = (v / size).atan() / std::f64::consts::FRAC_PI_2 + 0.5;
        ((angle * SIDE as f64) as usize).min(SIDE - 1)
    };
    Some((face * SIDE + step(place[(axis + 1) % 3])) * SIDE + step(place[(axis + 2) % 3]))
}
