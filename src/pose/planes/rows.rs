//! Measurements as rows of numbers, in columns: what planes are counted and fitted in.
//!
//! A measurement is a row (a, b), and a plane n . X = 1 is met where n . a = b. For a point, a is its place
//! and b is 1. For a shot along o + d / rho with the weight w (one over its standard deviation), a is
//! (o rho + d) w and b is rho w, so that a / b is its place. Least squares of n . a - b is a fit of either.

use nalgebra::{Matrix3, Vector3};

use super::kernels::{Columns, Cut, Sums};
use crate::geometry::linalg::symmetric_eigen3;

/// a, b, and the origins of the rays where they are not all the station's.
const COLUMNS: usize = 4;
const WITH_ORIGINS: usize = 7;

/// What the rows are.
#[derive(Debug, Clone, Copy)]
pub(super) enum Kind {
    /// Points with one standard deviation in every direction, metres. Their places are told from a middle of
    /// them, so that the squares of large coordinates do not hide small distances.
    Points {
        sigma: f64,
        middle: Vector3<f64>,
    },
    Shots,
}

impl Kind {
    /// What rows' places are told from.
    pub fn middle(&self) -> Vector3<f64> {
        match self {
            Self::Points { middle, .. } => *middle,
            Self::Shots => Vector3::zeros(),
        }
    }

    /// Distances from a plane in standard deviations.
    pub fn cut(&self, n: &Vector3<f64>) -> Cut {
        match self {
            Self::Points { sigma, middle } => {
                let scale = 1.0 / (n.norm() * sigma);
                Cut { slope: (n * scale).into(), offset: (1.0 - n.dot(middle)) * scale, n: [0.0; 3] }
            }
            // The prediction of rho is n . d / (1 - n . o).
            Self::Shots => Cut { slope: (*n).into(), offset: 1.0, n: (*n).into() },
        }
    }

    /// The plane through three rows or more, without checks: total least squares of points, linear ones of shots.
    pub fn solve(&self, sums: &Sums) -> Option<Vector3<f64>> {
        let n = match self {
            Self::Points { middle, .. } => {
                let (centre, spread) = sums.about_centre();
                let (_, axes) = symmetric_eigen3(&spread)?;
                axes[2] / axes[2].dot(&(centre + middle))
            }
            Self::Shots => sums.squares().cholesky()?.solve(&Vector3::from(sums.products)),
        };
        n.iter().all(|v| v.is_finite()).then_some(n)
    }

    /// The plane through exactly three rows.
    pub fn through(&self, rows: [[f64; 4]; 3]) -> Option<Vector3<f64>> {
        let middle = self.middle();
        let [p, q, r] = rows.map(|[x, y, z, b]| Vector3::new(x, y, z) + middle * b);
        let [i, j, k] = rows.map(|row| row[3]);
        let (qr, rp, pq) = (q.cross(&r), r.cross(&p), p.cross(&q));
        let n = (qr * i + rp * j + pq * k) / p.dot(&qr);
        n.iter().all(|v| v.is_finite()).then_some(n)
    }
}

impl Sums {
    pub fn squares(&self) -> Matrix3<f64> {
        let [xx, xy, xz, yy, yz, zz] = self.squares;
        Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }

    /// Of points: their centre, and their mean products about it.
    pub fn about_centre(&self) -> (Vector3<f64>, Matrix3<f64>) {
        let count = self.count as f64;
        let centre = Vector3::from(self.products) / count;
        (centre, self.squares() / count - centre * centre.transpose())
    }
}

/// Rows in columns.
#[derive(Debug, Clone, Default)]
pub(super) struct Rows {
    columns: Vec<Vec<f64>>,
}

impl Rows {
    pub fn new(with_origins: bool, capacity: usize) -> Self {
        let count = if with_origins { WITH_ORIGINS } else { COLUMNS };
        Self { columns: (0..count).map(|_| Vec::with_capacity(capacity)).collect() }
    }

    /// Of points, by their coordinates from the middle.
    pub fn of_points([x, y, z]: [Vec<f64>; 3]) -> Self {
        let b = vec![1.0; x.len()];
        Self { columns: vec![x, y, z, b] }
    }

    pub fn count(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    pub fn push(&mut self, a: &Vector3<f64>, b: f64, origin: &Vector3<f64>) {
        let numbers = [a.x, a.y, a.z, b, origin.x, origin.y, origin.z];
        self.columns.iter_mut().zip(numbers).for_each(|(column, number)| column.push(number));
    }

    /// So many rows, to be filled in: the numbers of a and b.
    pub fn resize(&mut self, count: usize) -> [&mut [f64]; 4] {
        self.columns.iter_mut().for_each(|c| c.resize(count, 0.0));
        let [x, y, z, b, ..] = self.columns.as_mut_slice() else { unreachable!("there are always four columns") };
        [x, y, z, b]
    }

    pub fn clear(&mut self) {
        self.columns.iter_mut().for_each(Vec::clear);
    }

    pub fn columns(&self) -> Columns<'_> {
        self.part(0, self.count())
    }

    /// The rows from `start` to before `end`.
    pub fn part(&self, start: usize, end: usize) -> Columns<'_> {
        let column = |k: usize| &self.columns[k][start..end];
        let origin = (self.columns.len() == WITH_ORIGINS).then(|| [column(4), column(5), column(6)]);
        Columns { a: [column(0), column(1), column(2)], b: column(3), origin }
    }

    pub fn row(&self, i: usize) -> [f64; 4] {
        [0, 1, 2, 3].map(|k| self.columns[k][i])
    }

    /// Where a measurement is, from the middle.
    pub fn place(&self, i: usize) -> Vector3<f64> {
        let [x, y, z, b] = self.row(i);
        Vector3::new(x, y, z) / b
    }

    /// Some of the rows.
    pub fn gather(&self, chosen: &[u32]) -> Self {
        let of = |column: &Vec<f64>| chosen.iter().map(|i| column[*i as usize]).collect();
        Self { columns: self.columns.iter().map(of).collect() }
    }

    /// The same in place of what another one holds.
    pub fn gather_into(&self, chosen: &[u32], to: &mut Self) {
        for (column, to) in self.columns.iter().zip(&mut to.columns) {
            to.clear();
            to.extend(chosen.iter().map(|i| column[*i as usize]));
        }
    }

    /// Leaves these rows only, in rising order.
    pub fn keep(&mut self, chosen: &[u32]) {
        for column in &mut self.columns {
            for (to, from) in chosen.iter().enumerate() {
                column[to] = column[*from as usize];
            }
            column.truncate(chosen.len());
        }
    }
}
