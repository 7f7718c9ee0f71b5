//! The largest connected part of what lies on a plane. Two faces that are not the same plane can both
//! lie within the threshold of a third one that passes through them; one part tells which plane it is,
//! and the others belong to it if they lie on that.

use nalgebra::Vector3;

/// Cells along the longer side, as many as measurements allow, and measurements for each cell.
const MAX_CELLS: usize = 24;
const MIN_CELLS: usize = 3;
const PER_CELL: f64 = 4.0;

/// Which places make the largest connected part, on a grid in the plane with this normal.
pub(super) fn largest(places: &[Vector3<f64>], normal: &Vector3<f64>) -> Vec<usize> {
    let first = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
    let second = normal.cross(&first);
    let flat: Vec<[f64; 2]> = places.iter().map(|p| [first.dot(p), second.dot(p)]).collect();
    let bound = |k: usize, pick: fn(f64, f64) -> f64, start: f64| flat.iter().map(|p| p[k]).fold(start, pick);
    let low = [0, 1].map(|k| bound(k, f64::min, f64::INFINITY));
    let high = [0, 1].map(|k| bound(k, f64::max, f64::NEG_INFINITY));
    let count = ((places.len() as f64 / PER_CELL).sqrt() as usize).clamp(MIN_CELLS, MAX_CELLS);
    let size = (high[0] - low[0]).max(high[1] - low[1]) / count as f64;
    if !(size > 0.0 && size.is_finite()) {
        return (0..places.len()).collect();
    }
    let step = |k: usize, v: f64| (((v - low[k]) / size) as usize).min(count - 1);
    let cells: Vec<usize> = flat.iter().map(|p| step(0, p[0]) * count + step(1, p[1])).collect();
    let mut held = vec![0usize; count * count];
    cells.iter().for_each(|c| held[*c] += 1);
    let parts = label(&held, count);
    let mut sizes = vec![0usize; count * count + 1];
    cells.iter().for_each(|c| sizes[parts[*c]] += 1);
    // Of equals the first.
    let best = (0..sizes.len()).rev().max_by_key(|part| sizes[*part]).unwrap_or(0);
    cells.iter().enumerate().filter(|(_, c)| parts[**c] == best).map(|(i, _)| i).collect()
}

/// Numbers from 1 of the connected parts (corners touch too) of cells that hold something; 0 elsewhere.
fn label(held: &[usize], side: usize) -> Vec<usize> {
    let (mut parts, mut number) = (vec![0; held.len()], 0);
    let mut open = Vec::new();
    for start in 0..held.len() {
        if held[start] == 0 || parts[start] != 0 {
            continue;
        }
        number += 1;
        parts[start] = number;
        open.push(start);
        while let Some(cell) = open.pop() {
            let (row, column) = (cell / side, cell % side);
            for r in row.saturating_sub(1)..(row + 2).min(side) {
                for c in column.saturating_sub(1)..(column + 2).min(side) {
                    let next = r * side + c;
                    if held[next] > 0 && parts[next] == 0 {
                        parts[next] = number;
                        open.push(next);
                    }
                }
            }
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_of_a_cell_parts_and_a_corner_joins() {
        // Two squares of 10 x 10 places and of 6 x 6, 1 m apart in z and y.
        let square = |n: usize, y: f64| {
            (0..n * n).map(move |i| Vector3::new(5.0, y + (i % n) as f64 * 0.1, (i / n) as f64 * 0.1))
        };
        let mut places: Vec<_> = square(6, 2.0).collect();
        places.extend(square(10, 0.0));
        assert_eq!(largest(&places, &Vector3::x()), (36..136).collect::<Vec<_>>());
        assert_eq!(label(&[1, 0, 0, 0, 1, 0, 0, 0, 1], 3), [1, 0, 0, 0, 1, 0, 0, 0, 1]);
        assert_eq!(label(&[1, 0, 1, 1, 0, 1, 1, 0, 0], 3), [1, 0, 2, 1, 0, 2, 1, 0, 0]);
    }

    #[test]
    fn one_place_is_a_part() {
        assert_eq!(largest(&[Vector3::x(); 4], &Vector3::x()), [0, 1, 2, 3]);
        assert_eq!(largest(&[Vector3::x()], &Vector3::z()), [0]);
        assert!(largest(&[], &Vector3::z()).is_empty());
    }
}
