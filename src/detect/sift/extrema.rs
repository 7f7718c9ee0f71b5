//! Extrema of the difference of Gaussians over place and scale, and their refinement by a quadratic
//! (Brown and Lowe 2002), with the tests for contrast and against edges.

use nalgebra::{Matrix3, Vector3};

use super::kernels::{GROUP, differences, peaks};
use super::rows::Aligned;
use super::scale_space::{INTERVALS, LEVELS, Octave};

/// Pixels along the border that hold no keypoint.
pub const BORDER: usize = 5;
/// Steps of a pixel or a level that the refinement may take.
const MAX_STEPS: usize = 5;
/// How far from its sample an extremum may be: more than a half, so that one halfway between two samples
/// is not passed to and fro.
const MOST_OFFSET: f64 = 0.6;
/// Share of the contrast threshold that a sample must pass before it is refined.
const COARSE: f64 = 0.5;
const DIFFERENCES: usize = LEVELS - 1;

/// What a keypoint must be.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Least |difference of Gaussians| at the refined extremum, grey levels.
    pub contrast: f64,
    /// Greatest ratio of the principal curvatures.
    pub edge_ratio: f64,
}

/// A refined extremum, in the pixels of its octave.
#[derive(Debug, Clone, Copy)]
pub struct Extremum {
    pub x: f64,
    pub y: f64,
    /// In levels; an integer plus a fraction.
    pub level: f64,
    /// Difference of Gaussians, grey levels.
    pub value: f64,
    /// The level that it is nearest to.
    pub layer: usize,
    /// Second derivatives xx, xy, yy of the difference.
    pub curvature: [f64; 3],
}

/// Room on both sides of a row: of a neighbour, and what keeps rows aligned.
const MARGIN: usize = 16;

/// The differences of three rows, and what is needed to search the middle one.
pub struct Search {
    width: usize,
    stride: usize,
    /// Rows y - 1, y, y + 1 by y modulo 3, of each difference.
    rows: Aligned,
    next: usize,
    flags: Vec<[u8; GROUP]>,
    /// Groups of pixels with flags.
    hits: Vec<u32>,
}

impl Search {
    pub fn new(width: usize) -> Self {
        let stride = width.next_multiple_of(GROUP) + 2 * MARGIN;
        Self {
            width,
            stride,
            rows: Aligned::new(3 * DIFFERENCES * stride),
            next: 0,
            flags: vec![[0; GROUP]; width.div_ceil(GROUP)],
            hits: vec![0; width.div_ceil(GROUP)],
        }
    }

    /// With its margins.
    #[inline]
    fn row(&self, difference: usize, y: usize) -> &[f32] {
        let start = (3 * difference + y % 3) * self.stride;
        &self.rows.all()[start..start + self.stride]
    }

    /// The extrema of row `y`, which only grows from call to call; the octave has all rows that REACH demands.
    pub fn extrema(&mut self, octave: &Octave, y: usize, limits: &Limits, found: &mut Vec<Extremum>) {
        if y < BORDER || y + BORDER >= octave.height() || self.width <= 2 * BORDER {
            return;
        }
        for y in self.next.max(y - 1)..y + 2 {
            let mut rows = self.rows.all_mut().chunks_exact_mut(3 * self.stride);
            let start = y % 3 * self.stride + MARGIN;
            let out = [(); DIFFERENCES].map(|()| match rows.next() {
                Some(rows) => &mut rows[start..start + self.width],
                None => Default::default(),
            });
            differences(out, std::array::from_fn(|level| octave.row(level, y)));
        }
        self.next = y + 2;
        let coarse = (COARSE * limits.contrast) as f32;
        let (mut flags, mut hits) = (std::mem::take(&mut self.flags), std::mem::take(&mut self.hits));
        for layer in 1..=INTERVALS {
            let here = self.row(layer, y);
            let around =
                [self.row(layer, y - 1), self.row(layer, y + 1), self.row(layer - 1, y), self.row(layer + 1, y)];
            let n = peaks(&mut flags, &mut hits, here, around.map(|row| &row[MARGIN..]), coarse);
            let near = [layer, layer - 1, layer + 1].map(|d| [y - 1, y, y + 1].map(|y| &self.row(d, y)[MARGIN..]));
            for &i in &hits[..n] {
                // Byte x is 1 where pixel x is flagged.
                let mut group = u128::from_le_bytes(flags[i as usize]);
                while group != 0 {
                    let x = GROUP * i as usize + group.trailing_zeros() as usize / 8;
                    group &= group - 1;
                    if (BORDER..self.width - BORDER).contains(&x) && is_extremum(&near, x) {
                        found.extend(refine(octave, layer, x, y, limits));
                    }
                }
            }
        }
        (self.flags, self.hits) = (flags, hits);
    }
}

/// Among all 26 neighbours; equals do not disqualify. `rows`: three of each difference, its own first.
fn is_extremum(rows: &[[&[f32]; 3]; 3], x: usize) -> bool {
    let v = rows[0][1][x];
    let sign = v.signum();
    let least = sign * v;
    rows.as_flattened().iter().all(|row| {
        let [a, b, c] = [row[x - 1], row[x], row[x + 1]].map(|n| sign * n);
        (a <= least) & (b <= least) & (c <= least)
    })
}

/// The extremum of the quadratic through the neighbours of a sample, if it passes the tests.
fn refine(octave: &Octave, layer: usize, column: usize, row: usize, limits: &Limits) -> Option<Extremum> {
    let (mut layer, mut column, mut row) = (layer, column, row);
    for _ in 0..MAX_STEPS {
        // Differences of the 3 x 3 x 3 samples, by level, row, column.
        let mut d = [[[0.0f64; 3]; 3]; 3];
        for (l, plane) in d.iter_mut().enumerate() {
            for (r, line) in plane.iter_mut().enumerate() {
                let (fine, coarse) = (octave.row(layer + l - 1, row + r - 1), octave.row(layer + l, row + r - 1));
                for (c, value) in line.iter_mut().enumerate() {
                    *value = f64::from(coarse[column + c - 1] - fine[column + c - 1]);
                }
            }
        }
        let v = d[1][1][1];
        let gradient = 0.5 * Vector3::new(d[1][1][2] - d[1][1][0], d[1][2][1] - d[1][0][1], d[2][1][1] - d[0][1][1]);
        let (xx, yy, ss) =
            (d[1][1][2] + d[1][1][0] - 2.0 * v, d[1][2][1] + d[1][0][1] - 2.0 * v, d[2][1][1] + d[0][1][1] - 2.0 * v);
        let xy = 0.25 * (d[1][2][2] - d[1][2][0] - d[1][0][2] + d[1][0][0]);
        let xs = 0.25 * (d[2][1][2] - d[2][1][0] - d[0][1][2] + d[0][1][0]);
        let ys = 0.25 * (d[2][2][1] - d[2][0][1] - d[0][2][1] + d[0][0][1]);
        let hessian = Matrix3::new(xx, xy, xs, xy, yy, ys, xs, ys, ss);
        let offset = -(hessian.try_inverse()? * gradient);
        if !offset.iter().all(|o| o.is_finite()) {
            return None;
        }
        if offset.amax() < MOST_OFFSET {
            let value = v + 0.5 * gradient.dot(&offset);
            let (trace, determinant) = (xx + yy, xx * yy - xy * xy);
            let e = limits.edge_ratio;
            let blob = determinant > 0.0 && trace * trace * e < (e + 1.0) * (e + 1.0) * determinant;
            return (blob && value.abs() >= limits.contrast).then(|| Extremum {
                x: column as f64 + offset.x,
                y: row as f64 + offset.y,
                level: layer as f64 + offset.z,
                value,
                layer,
                curvature: [xx, xy, yy],
            });
        }
        // At most to the next sample along each axis.
        let step = |at: usize, offset: f64, least: usize, end: usize| {
            let to = at as i64 + offset.round().clamp(-1.0, 1.0) as i64;
            (least as i64 <= to && to < end as i64).then_some(to as usize)
        };
        column = step(column, offset.x, BORDER, octave.width() - BORDER)?;
        row = step(row, offset.y, BORDER, octave.height() - BORDER)?;
        layer = step(layer, offset.z, 1, INTERVALS + 1)?;
    }
    None
}
