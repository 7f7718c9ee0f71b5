//! What cameras saw of a few shots at once, one shot in each lane of a block: rows for the cameras'
//! normal equations, and sums for the shots' own unknowns.

use super::eliminate::Own;
use super::linearise::{ShotPoint, View};
use crate::calibrate::block::{Block, LANES, Lanes, POINT, Products, RESIDUAL};
use crate::calibrate::freedom::Unknown;
use crate::geometry::Camera;

pub(super) struct Tile<'a> {
    /// Of each shot, with its inverse depth.
    points: &'a [(ShotPoint, f64)],
    block: Box<Block>,
    /// Derivatives of the points by the ray's columns, and by the shots' own unknowns.
    by_common: Vec<[Lanes; 3]>,
    by_local: Vec<[Lanes; 3]>,
    /// Sums for the own unknowns as in [`Own`].
    information: [[Lanes; 3]; 3],
    gradient: [Lanes; 3],
    coupling: Vec<Lanes>,
    width: usize,
}

/// One camera's place in a tile's sums.
pub(super) struct Seer<'a> {
    pub camera: &'a Camera,
    pub unknowns: &'a [Unknown],
    /// First of its columns among the batch's.
    pub place: usize,
}

/// Squared residuals, as they are and under the robust loss.
#[derive(Default)]
pub(super) struct Misfit {
    pub chi2: f64,
    pub cost: f64,
}

impl<'a> Tile<'a> {
    /// `width`: columns of the batch; `locals`: own unknowns of a shot.
    pub fn new(points: &'a [(ShotPoint, f64)], width: usize, locals: usize) -> Self {
        let common = points.first().map_or(0, |(point, _)| point.common);
        let mut by_common = vec![[[0.0; LANES]; 3]; common];
        let mut by_local = vec![[[0.0; LANES]; 3]; locals];
        for (lane, (point, _)) in points.iter().enumerate() {
            let derivatives =
                point.by_common.iter().zip(&mut by_common).chain(point.by_local.iter().zip(&mut by_local));
            derivatives.for_each(|(from, to)| to.iter_mut().zip(from.iter()).for_each(|(to, x)| to[lane] = *x));
        }
        let none = [0.0; LANES];
        Self {
            points,
            block: Block::new(),
            by_common,
            by_local,
            information: [[none; 3]; 3],
            gradient: [none; 3],
            coupling: vec![none; locals * width],
            width,
        }
    }

    /// Adds what a camera saw of each shot. `None` when it cannot have seen one.
    pub fn add(
        &mut self,
        seer: &Seer<'_>,
        views: &[Option<&View>; LANES],
        huber: f64,
        products: &mut Products,
    ) -> Option<Misfit> {
        let Some(first) = views.iter().position(Option::is_some) else { return Some(Misfit::default()) };
        for (lane, view) in views.iter().enumerate().take(self.points.len()) {
            // A shot that was not seen may be behind the camera: another stands in, and weighs nothing.
            let (point, rho) = &self.points[if view.is_some() { lane } else { first }];
            let pixel = view.map_or_else(Default::default, |v| v.pixel);
            let whitening = view.map_or_else(Default::default, |v| v.whitening);
            self.block.set(lane, &point.xyz.push(*rho), &pixel, &whitening);
        }
        self.block.project(seer.camera, self.points.len())?;
        let (common, count) = (self.by_common.len(), self.by_common.len() + seer.unknowns.len());
        products.take(&self.block, seer.unknowns, common);
        for (k, by) in self.by_common.iter().enumerate() {
            for (to, row) in products.column(k).into_iter().zip(&self.block.rows) {
                *to = along(row, by);
            }
        }
        let mut by_local: Vec<[Lanes; 2]> =
            self.by_local.iter().map(|by| self.block.rows.each_ref().map(|row| along(row, by))).collect();
        for (to, row) in by_local[0].iter_mut().zip(&self.block.rows) {
            to.iter_mut().zip(&row[POINT + 3]).for_each(|(to, x)| *to += x);
        }
        for (to, row) in products.column(count).into_iter().zip(&self.block.rows) {
            *to = row[RESIDUAL];
        }
        let (misfit, roots) = weigh(&self.block.squares(), huber);
        if let Some(roots) = roots {
            let scale = |column: &mut Lanes| column.iter_mut().zip(&roots).for_each(|(x, root)| *x *= root);
            (0..=count).for_each(|k| products.column(k).into_iter().for_each(scale));
            by_local.iter_mut().flatten().for_each(scale);
        }
        for (a, [dx, dy]) in by_local.iter().enumerate() {
            for (b, [ex, ey]) in by_local.iter().enumerate().take(a + 1) {
                add_products(&mut self.information[a][b], [dx, dy], [ex, ey]);
            }
            let [x, y] = products.column(count);
            add_products(&mut self.gradient[a], [dx, dy], [x, y]);
            for k in 0..count {
                let place = if k < common { k } else { seer.place + k - common };
                let [x, y] = products.column(k);
                add_products(&mut self.coupling[a * self.width + place], [dx, dy], [x, y]);
            }
        }
        products.add();
        Some(misfit)
    }

    /// The sums of one shot.
    pub fn own(&self, lane: usize) -> Own {
        let mut own = Own::new(self.by_local.len(), self.width);
        own.information = self.information.each_ref().map(|row| row.each_ref().map(|sum| sum[lane]));
        own.gradient = self.gradient.each_ref().map(|sum| sum[lane]);
        own.coupling.iter_mut().zip(&self.coupling).for_each(|(to, sum)| *to = sum[lane]);
        own
    }
}

/// The derivative of a pixel coordinate along a change of the points.
fn along(row: &[Lanes], by: &[Lanes; 3]) -> Lanes {
    let [x, y, z] = [&row[POINT], &row[POINT + 1], &row[POINT + 2]];
    std::array::from_fn(|l| x[l] * by[0][l] + y[l] * by[1][l] + z[l] * by[2][l])
}

/// sum += a . b in every lane.
fn add_products(sum: &mut Lanes, a: [&Lanes; 2], b: [&Lanes; 2]) {
    for l in 0..LANES {
        sum[l] += a[0][l] * b[0][l] + a[1][l] * b[1][l];
    }
}

/// Of squared residuals, with the roots of the weights when one is not 1.
fn weigh(squares: &Lanes, huber: f64) -> (Misfit, Option<Lanes>) {
    let (mut misfit, mut roots, mut robust) = (Misfit::default(), [1.0; LANES], false);
    for (squared, root) in squares.iter().zip(&mut roots) {
        misfit.chi2 += squared;
        if *squared > huber * huber {
            let length = squared.sqrt();
            misfit.cost += huber * (2.0 * length - huber);
            (*root, robust) = ((huber / length).sqrt(), true);
        } else {
            misfit.cost += squared;
        }
    }
    (misfit, robust.then_some(roots))
}
