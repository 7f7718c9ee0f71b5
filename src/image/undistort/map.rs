//! The map of an ideal picture: where each of its pixels lies in the source image.
//!
//! The ideal picture is divided into square cells. In a cell the position is a bicubic polynomial,
//! interpolated at Chebyshev's nodes, whose leading error is greatest, and equal, at the extremes of the next Chebyshev
//! polynomial (Trefethen, "Approximation Theory and Approximation Practice", chapter 4): nine of
//! those, the corners among them, are computed exactly as well, and a cell whose polynomial is off by
//! more than [`TOLERANCE`] at one of them is divided into four. The smallest cells, where the lens
//! ends or something else is not smooth, hold the exact position of each pixel.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::geometry::{Camera, Distortion};

/// Bits of a position behind the point. Sources have sides of up to 2^16 pixels.
pub const FRACTION_BITS: u32 = 14;
const ONE: f64 = (1 << FRACTION_BITS) as f64;

/// Sides of the largest cells and of the smallest, powers of two.
pub const LARGEST: u32 = 128;
const SMALLEST: u32 = 8;
/// Greatest error of a polynomial where it is checked, pixels: half of what is promised.
const TOLERANCE: f64 = 1.0 / 128.0;
/// Positions of a polynomial stay within these, so that they fit 32 bits.
const NEAR: std::ops::Range<f64> = -65536.0..131_000.0;

/// A square of the ideal picture; it may stick out of it at the right and at the bottom.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    pub x: u32,
    pub y: u32,
    pub size: u32,
    pub content: Content,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// Nothing of the source is here.
    Outside,
    Cubic(Cubic),
    /// Each pixel's position, row by row.
    Exact(Box<[[i32; 2]]>),
}

/// Positions as bicubic polynomials of u and v, which run from -1 to 1 over the cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Cubic {
    /// What the polynomials are relative to, in units of 2^-14 pixels.
    pub base: [i32; 2],
    /// By power of v: those of x by power of u, then those of y, in units of 2^-14 pixels.
    coefficients: [[f32; 8]; 4],
}

/// One row of a cubic cell.
#[derive(Debug, Clone, Copy)]
pub struct CubicRow {
    pub base: [i32; 2],
    /// By power of u: of x, then of y.
    pub coefficients: [f32; 8],
    /// From a pixel of the row to the next, in u.
    pub step: f32,
}

impl Cubic {
    /// Row `y` of a cell of the side `size`.
    pub fn row(&self, y: u32, size: u32) -> CubicRow {
        let step = 2.0 / size as f32;
        let v = (y as f32 + 0.5) * step - 1.0;
        let [c0, c1, c2, c3] = &self.coefficients;
        let coefficients = std::array::from_fn(|i| ((c3[i] * v + c2[i]) * v + c1[i]) * v + c0[i]);
        CubicRow { base: self.base, coefficients, step }
    }
}

impl CubicRow {
    /// Position of the pixel `x` of the row. The vector kernels compute the same, operation by operation.
    pub fn position(&self, x: usize) -> [i32; 2] {
        let u = (x as f32 + 0.5) * self.step - 1.0;
        let [x0, x1, x2, x3, y0, y1, y2, y3] = self.coefficients;
        let x = ((x3 * u + x2) * u + x1) * u + x0;
        let y = ((y3 * u + y2) * u + y1) * u + y0;
        [self.base[0].wrapping_add(x as i32), self.base[1].wrapping_add(y as i32)]
    }
}

/// The cells of an ideal picture: of each [`LARGEST`] rows of pixels those that lie in them.
pub fn bands(camera: &Camera, ideal: &Camera) -> Vec<Vec<Cell>> {
    let view = View::new(camera, ideal);
    let band = |y: u32| {
        let mut map = Map { view: &view, cells: Vec::new() };
        for x in (0..ideal.width).step_by(LARGEST as usize) {
            map.add(x, y, LARGEST);
        }
        map.cells
    };
    (0..ideal.height).step_by(LARGEST as usize).map(band).collect()
}

/// The exact map.
pub struct View<'a> {
    camera: &'a Camera,
    size: [u32; 2],
    /// From pixels of the ideal picture to directions in the camera's frame.
    directions: Matrix3<f64>,
    /// Tangent of the angle up to which the lens grows: beyond it, it would fold back.
    radius: f64,
}

impl<'a> View<'a> {
    /// `ideal` has no lens; its centre is not looked at.
    pub fn new(camera: &'a Camera, ideal: &Camera) -> Self {
        let k = &ideal.intrinsics;
        let inverse = Matrix3::new(
            1.0 / k.fx,
            -k.skew / (k.fx * k.fy),
            (k.skew * k.cy / k.fy - k.cx) / k.fx,
            0.0,
            1.0 / k.fy,
            -k.cy / k.fy,
            0.0,
            0.0,
            1.0,
        );
        let directions = camera.pose.rotation * ideal.pose.rotation.transpose() * inverse;
        let radius = camera.distortion.monotone_radius();
        Self { camera, size: [ideal.width, ideal.height], directions, radius }
    }

    fn direction(&self, x: f64, y: f64) -> Vector3<f64> {
        self.directions * Vector3::new(x, y, 1.0)
    }

    fn image(&self, d: &Vector3<f64>) -> Option<Vector2<f64>> {
        let beyond = self.radius.is_finite() && (d.z <= 0.0 || d.xy().norm() > self.radius * d.z);
        if beyond { None } else { self.camera.project_camera_point(d) }
    }

    /// Where a pixel of the ideal picture lies in the source image; `None` where the lens has no image.
    pub fn position(&self, x: f64, y: f64) -> Option<Vector2<f64>> {
        self.image(&self.direction(x, y))
    }

    /// Has certainly nothing between these directions an image? Those without one are separated from
    /// the lens's cone by a plane, or, where the cone is wider than a half-space, fill a convex cone.
    fn is_blind(&self, corners: &[Vector3<f64>; 4]) -> bool {
        if self.radius.is_finite() {
            let towards = corners.iter().sum::<Vector3<f64>>().xy();
            let normal = (towards / towards.norm()).push(-self.radius);
            corners.iter().all(|d| normal.dot(d) > 0.0)
        } else if matches!(self.camera.distortion, Distortion::Fisheye(_)) {
            corners.iter().all(|d| self.image(d).is_none())
        } else {
            corners.iter().all(|d| d.z <= 0.0)
        }
    }
}

struct Map<'a> {
    view: &'a View<'a>,
    cells: Vec<Cell>,
}

impl Map<'_> {
    /// Adds the cells of a square, as few as can be.
    fn add(&mut self, x: u32, y: u32, size: u32) {
        let [width, height] = self.view.size;
        if x >= width || y >= height {
            return;
        }
        let content = match self.approximate(x, y, size) {
            Some(content) => content,
            None if size > SMALLEST => {
                let half = size / 2;
                for (x, y) in [(x, y), (x + half, y), (x, y + half), (x + half, y + half)] {
                    self.add(x, y, half);
                }
                return;
            }
            None => self.exact(x, y),
        };
        self.cells.push(Cell { x, y, size, content });
    }

    /// `None` where that is not good enough.
    fn approximate(&self, x: u32, y: u32, size: u32) -> Option<Content> {
        let half = f64::from(size) / 2.0;
        let at = |u: f64, v: f64| {
            self.view.direction(f64::from(x) - 0.5 + half * (1.0 + u), f64::from(y) - 0.5 + half * (1.0 + v))
        };
        if self.view.is_blind(&[at(-1.0, -1.0), at(1.0, -1.0), at(-1.0, 1.0), at(1.0, 1.0)]) {
            return Some(Content::Outside);
        }
        let mut error: f64 = 0.0;
        let mut polynomials = [[[0.0; 4]; 4]; 2];
        let mut values = [[[0.0; 4]; 4]; 2];
        for (j, v) in NODES.into_iter().enumerate() {
            for (i, u) in NODES.into_iter().enumerate() {
                let position = self.view.image(&at(u, v))?;
                (values[0][j][i], values[1][j][i]) = (position.x, position.y);
            }
        }
        for (polynomial, values) in polynomials.iter_mut().zip(&values) {
            *polynomial = interpolate(values);
        }
        for v in [-1.0, 0.0, 1.0] {
            for u in [-1.0, 0.0, 1.0] {
                let position = self.view.image(&at(u, v))?;
                error = error.max((position.x - value(&polynomials[0], u, v)).abs());
                error = error.max((position.y - value(&polynomials[1], u, v)).abs());
            }
        }
        // Of |u|, |v| <= 1 no value is farther from the constant than the other coefficients' sum.
        let range = |p: &[[f64; 4]; 4]| {
            let constant = p[0][0];
            let rest = p.iter().flatten().map(|c| c.abs()).sum::<f64>() - constant.abs();
            [constant - rest, constant + rest]
        };
        let ranges = polynomials.each_ref().map(range);
        let margin = 2.0 + 4.0 * error;
        let size = [self.view.camera.width, self.view.camera.height];
        if ranges.iter().zip(size).any(|(r, s)| r[1] < -margin || r[0] > f64::from(s) + margin) {
            return Some(Content::Outside);
        }
        let near = ranges.iter().flatten().all(|v| NEAR.contains(v));
        (near && error <= TOLERANCE).then(|| Content::Cubic(Cubic::new(&polynomials)))
    }

    fn exact(&self, x: u32, y: u32) -> Content {
        let pixels = (y..y + SMALLEST).flat_map(|y| (x..x + SMALLEST).map(move |x| (x, y)));
        let sides = [self.view.camera.width, self.view.camera.height].map(f64::from);
        let fixed = |(x, y): (u32, u32)| match self.view.position(f64::from(x), f64::from(y)) {
            // What is far outside is outside.
            Some(p) => std::array::from_fn(|i| (p[i].clamp(-4.0, sides[i] + 4.0) * ONE).floor() as i32),
            None => [-4 << FRACTION_BITS; 2],
        };
        Content::Exact(pixels.map(fixed).collect())
    }
}

impl Cubic {
    /// From the polynomials of x and y, by powers of v and then of u, pixels.
    fn new(polynomials: &[[[f64; 4]; 4]; 2]) -> Self {
        let base = polynomials.map(|p| p[0][0].floor());
        let mut coefficients = [[0.0; 8]; 4];
        for (axis, polynomial) in polynomials.iter().enumerate() {
            for (to, from) in coefficients.iter_mut().zip(polynomial) {
                for (to, from) in to[4 * axis..].iter_mut().zip(from) {
                    *to = (from * ONE) as f32;
                }
            }
            coefficients[0][4 * axis] = ((polynomial[0][0] - base[axis]) * ONE) as f32;
        }
        Self { base: base.map(|b| (b * ONE) as i32), coefficients }
    }
}

/// Roots of Chebyshev's polynomial T4: cos(pi (2 k + 1) / 8).
const NODES: [f64; 4] =
    [0.923_879_532_511_286_7, 0.382_683_432_365_089_8, -0.382_683_432_365_089_8, -0.923_879_532_511_286_7];

/// Coefficients of the powers of the cubic through the values at the nodes.
fn interpolate_line(f: [f64; 4]) -> [f64; 4] {
    let [n0, n1, ..] = NODES;
    // Sums of even and odd parts against T0 to T3.
    let (even, odd) = ([f[0] + f[3], f[1] + f[2]], [f[0] - f[3], f[1] - f[2]]);
    let t0 = (even[0] + even[1]) / 4.0;
    let t1 = (n0 * odd[0] + n1 * odd[1]) / 2.0;
    let t2 = (even[0] - even[1]) * FRAC_1_SQRT_2 / 2.0;
    let t3 = (n1 * odd[0] - n0 * odd[1]) / 2.0;
    [t0 - t2, t1 - 3.0 * t3, 2.0 * t2, 4.0 * t3]
}

/// The same of two variables: values by v, then u; coefficients likewise.
fn interpolate(values: &[[f64; 4]; 4]) -> [[f64; 4]; 4] {
    let rows = values.map(interpolate_line);
    let mut coefficients = [[0.0; 4]; 4];
    for i in 0..4 {
        for (j, c) in interpolate_line(rows.map(|row| row[i])).into_iter().enumerate() {
            coefficients[j][i] = c;
        }
    }
    coefficients
}

fn value(p: &[[f64; 4]; 4], u: f64, v: f64) -> f64 {
    let line = |c: [f64; 4], t: f64| ((c[3] * t + c[2]) * t + c[1]) * t + c[0];
    line(p.map(|row| line(row, u)), v)
}
