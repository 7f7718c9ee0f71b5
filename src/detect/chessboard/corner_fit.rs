//! One corner to a fraction of a pixel: Gauss-Newton on its image, which is where two straight edges
//! cross, blurred by a Gaussian, under light that varies linearly.
//!
//! The blurred product of two step edges at an angle is the orthant probability of two correlated
//! normal variables: the product of two error functions plus the integral of their joint density over
//! the correlation (Plackett, Biometrika 1954; Drezner and Wesolowsky 1990).

#![allow(unsafe_code)]

use nalgebra::{SMatrix, SVector};

use crate::image::exponential::exponential;
use crate::image::pyramid::Grey;
use crate::vectors::for_each_processor;

/// Pixels that are worked on together, see [`crate::vectors`].
const LANES: usize = 8;
type Lanes = [f64; LANES];

const PARAMETERS: usize = 9;
type Matrix = SMatrix<f64, PARAMETERS, PARAMETERS>;
type Vector = SVector<f64, PARAMETERS>;

const MAX_ITERATIONS: usize = 10;
/// After a step of the centre below this what is left is a hundredth of it, pixels.
const SETTLED: f64 = 0.02;
/// Part of a step that is taken when it turns back.
const BACK: f64 = 0.6;
/// Of the window, pixels: lenses bend longer edges.
const RADIUS: f64 = 6.5;
/// Blurs to keep from the next edges.
const EDGE_BLURS: f64 = 1.5;
/// That of a pixel's own area and a good lens; below it, edges between pixels have no place.
const MIN_BLUR: f64 = 0.45;
/// Greatest change of the light from the window's middle to its rim, relative.
const MAX_GRADIENT: f64 = 0.5;
/// Variance of rounding to whole grey levels: no fit is better.
const QUANTISATION: f64 = 1.0 / 12.0;
/// Of a window.
const MAX_PIXELS: usize = 14 * 14;
/// Correlations of the edges that are too small to matter.
const PERPENDICULAR: f64 = 0.02;

/// What is known of a corner before it is fitted; pixels of the image.
#[derive(Debug, Clone, Copy)]
pub struct Start {
    pub position: [f64; 2],
    /// To the next corners along row and column; the second is turned from the first as y from x.
    pub steps: [[f64; 2]; 2],
    /// Standard deviation of the blur.
    pub blur: f64,
    /// Whether the square between the steps is bright.
    pub bright: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerFit {
    pub position: [f64; 2],
    /// xx, xy, yy, px^2.
    pub covariance: [f64; 3],
    pub blur: f64,
    /// Half the difference of bright and dark, grey levels.
    pub amplitude: f64,
    /// Mean square of the residuals, and variance of the window's pixels.
    pub residual: f64,
    pub variance: f64,
}

/// erf(z / sqrt 2) and its derivative at multiples of 1 / `STEPS`, up to `REACH`.
#[derive(Debug, Clone)]
pub struct EdgeProfile(Vec<[f64; 2]>);

const STEPS: f64 = 64.0;
const REACH: f64 = 5.0;

impl EdgeProfile {
    pub fn new() -> Self {
        let density = |z: f64| (2.0 / std::f64::consts::PI).sqrt() * (-0.5 * z * z).exp();
        let mut value = 0.0;
        let table = (0..=(STEPS * REACH) as usize + 1).map(|i| {
            let z = i as f64 / STEPS;
            let here = [value, density(z)];
            // Simpson's rule.
            value += (density(z) + 4.0 * density(z + 0.5 / STEPS) + density(z + 1.0 / STEPS)) / (6.0 * STEPS);
            here
        });
        Self(table.collect())
    }

    /// Value and derivative, linear between the entries: right to 3e-5.
    #[inline(always)]
    fn at(&self, z: f64) -> [f64; 2] {
        let t = z.abs() * STEPS;
        if t >= STEPS * REACH {
            return [z.signum(), 0.0];
        }
        let i = t as usize;
        let f = t - i as f64;
        let ([v0, d0], [v1, d1]) = (self.0[i], self.0[i + 1]);
        [(v0 + f * (v1 - v0)).copysign(z), d0 + f * (d1 - d0)]
    }
}

/// Centre, directions of the two edges, blur, mean level, amplitude, gradient of the light.
struct Model {
    p: Vector,
    /// Where the light is 1.
    origin: [f64; 2],
}

impl Start {
    /// `None` when there is no such corner.
    pub fn fit(&self, image: &Grey<'_>, profile: &EdgeProfile) -> Option<CornerFit> {
        let window = Window::new(self, image)?;
        let angle = |v: [f64; 2]| v[1].atan2(v[0]);
        let mut model = Model { p: Vector::zeros(), origin: self.position };
        model.p.as_mut_slice()[..5].copy_from_slice(&[
            self.position[0],
            self.position[1],
            angle(self.steps[0]),
            angle(self.steps[1]),
            self.blur.max(MIN_BLUR),
        ]);
        model.start_levels(&window, profile)?;
        let mut last = [0.0; 2];
        for _ in 0..MAX_ITERATIONS {
            let normal = normal(&model, &window, profile);
            let factor = normal.matrix.cholesky()?;
            let step = factor.solve(&normal.gradient);
            let moved = step[0].hypot(step[1]);
            // Sharp images have steps that go too far and come back.
            let back = step[0] * last[0] + step[1] * last[1] < 0.0;
            last = [step[0], step[1]];
            model.p += step * (if back { BACK } else { 1.0 } / moved.max(1.0));
            model.p[4] = model.p[4].max(MIN_BLUR);
            if !model.is_possible(self) {
                return None;
            }
            if moved < SETTLED {
                // What the step takes off the cost, which is all but quadratic by now.
                let cost = normal.cost - step.dot(&normal.gradient);
                return self.judge(&model, cost, &factor.inverse(), &window);
            }
        }
        None
    }

    fn judge(&self, model: &Model, cost: f64, inverse: &Matrix, window: &Window) -> Option<CornerFit> {
        let count = window.count as f64;
        let noise = (cost / (count - PARAMETERS as f64)).max(QUANTISATION);
        let fit = CornerFit {
            position: [model.p[0], model.p[1]],
            covariance: [inverse[(0, 0)], inverse[(0, 1)], inverse[(1, 1)]].map(|c| noise * c),
            blur: model.p[4],
            amplitude: if self.bright { model.p[6] } else { -model.p[6] },
            residual: cost / count,
            variance: window.variation() / count,
        };
        // Light that changes more is an edge of something else.
        let even = model.p[7].hypot(model.p[8]) * RADIUS < MAX_GRADIENT;
        (even && fit.amplitude > 0.0 && fit.covariance.iter().all(|c| c.is_finite())).then_some(fit)
    }
}

/// The pixels of a corner: a disc cut off before the next edges.
struct Window {
    count: usize,
    pixels: Vec<Pixels>,
}

/// Some of a window's pixels; those that are none weigh 0.
#[derive(Clone, Copy)]
struct Pixels {
    x: Lanes,
    y: Lanes,
    level: Lanes,
    weight: Lanes,
}

impl Window {
    fn new(start: &Start, image: &Grey<'_>) -> Option<Self> {
        let [u, v] = start.steps;
        let area = u[0] * v[1] - u[1] * v[0];
        let [cx, cy] = start.position;
        if area.is_nan() || area < 1.0 {
            return None;
        }
        // Distances between parallel edges, and how much of them is free.
        let free = |side: [f64; 2]| {
            let distance = area / side[0].hypot(side[1]);
            (1.0 - EDGE_BLURS * start.blur / distance).max(0.5)
        };
        let [free_u, free_v] = [free(v), free(u)];
        let [left, right] = [(cx - RADIUS).ceil(), (cx + RADIUS).floor()];
        let [top, bottom] = [(cy - RADIUS).ceil(), (cy + RADIUS).floor()];
        // A corner at the image's border has no whole window.
        let inside = left >= 0.0 && top >= 0.0 && right < image.width() as f64 && bottom < image.height() as f64;
        if !inside {
            return None;
        }
        let mut count = 0;
        let none = Pixels { x: [cx; LANES], y: [cy; LANES], level: [0.0; LANES], weight: [0.0; LANES] };
        let mut pixels: Vec<Pixels> = Vec::with_capacity(MAX_PIXELS / LANES + 1);
        for y in top as usize..=bottom as usize {
            let dy = y as f64 - cy;
            for (x, level) in image.row(y).iter().enumerate().take(right as usize + 1).skip(left as usize) {
                let dx = x as f64 - cx;
                let along_u = (dx * v[1] - dy * v[0]) / area;
                let along_v = (u[0] * dy - u[1] * dx) / area;
                if dx * dx + dy * dy <= RADIUS * RADIUS && along_u.abs() <= free_u && along_v.abs() <= free_v {
                    let lane = count % LANES;
                    if lane == 0 {
                        pixels.push(none);
                    }
                    if let Some(p) = pixels.last_mut() {
                        (p.x[lane], p.y[lane], p.level[lane]) = (x as f64, y as f64, *level as f64);
                        p.weight[lane] = 1.0;
                    }
                    count += 1;
                }
            }
        }
        (count >= 2 * PARAMETERS).then_some(Self { count, pixels })
    }

    /// Sum of squares about the mean.
    fn variation(&self) -> f64 {
        let levels = || self.pixels.iter().flat_map(|p| p.level).take(self.count);
        let mean = levels().sum::<f64>() / self.count as f64;
        levels().map(|l| (l - mean) * (l - mean)).sum()
    }
}

struct Normal {
    cost: f64,
    matrix: Matrix,
    gradient: Vector,
}

/// The corner's image between -1 and 1 and its derivatives with respect to z of either edge.
struct Shape {
    value: Lanes,
    slopes: [Lanes; 2],
}

impl Model {
    /// Mean level and amplitude by linear regression on the shape.
    fn start_levels(&mut self, window: &Window, profile: &EdgeProfile) -> Option<()> {
        let [s, ss, l, sl] = level_sums(self, window, profile);
        let n = window.count as f64;
        let determinant = n * ss - s * s;
        self.p[6] = (n * sl - s * l) / determinant;
        self.p[5] = (l - self.p[6] * s) / n;
        (determinant > 1e-6 * n * ss).then_some(())
    }

    fn edges(&self) -> Edges {
        let [(s1, c1), (s2, c2)] = [self.p[2].sin_cos(), self.p[3].sin_cos()];
        let sharpness = 1.0 / self.p[4];
        // Both normals point into the square between the edges.
        let normals = [[-s1, c1], [s2, -c2]];
        let correlation = (-(s1 * s2 + c1 * c2)).clamp(-0.995, 0.995);
        let end = correlation.asin();
        let nodes = [-1.0, 1.0].map(|side| {
            let (sine, cosine) = (0.5 * end * (1.0 + side / 3f64.sqrt())).sin_cos();
            [sine, 1.0 / (cosine * cosine)]
        });
        let weight = if correlation.abs() > PERPENDICULAR { end / std::f64::consts::PI } else { 0.0 };
        Edges { normals, sharpness, nodes, weight }
    }

    /// Of the pixels from the centre.
    #[inline(always)]
    fn offsets(&self, pixels: &Pixels) -> (Lanes, Lanes) {
        let (mut dx, mut dy) = ([0.0; LANES], [0.0; LANES]);
        for l in 0..LANES {
            (dx[l], dy[l]) = (pixels.x[l] - self.p[0], pixels.y[l] - self.p[1]);
        }
        (dx, dy)
    }

    fn is_possible(&self, start: &Start) -> bool {
        let moved = (self.p[0] - start.position[0]).hypot(self.p[1] - start.position[1]);
        let crossing = (self.p[3] - self.p[2]).sin();
        self.p.iter().all(|v| v.is_finite()) && moved < 0.5 * RADIUS && self.p[4] < 0.8 * RADIUS && crossing > 0.1
    }
}

for_each_processor! {
    /// Sums of shape, shape^2, level and shape x level.
    fn level_sums(model: &Model, window: &Window, profile: &EdgeProfile) -> [f64; 4] {
        let edges = model.edges();
        let mut sums = [[0.0; LANES]; 4];
        for pixels in &window.pixels {
            let (dx, dy) = model.offsets(pixels);
            let shape = edges.shape(&dx, &dy, profile).value;
            for l in 0..LANES {
                let (shape, level) = (pixels.weight[l] * shape[l], pixels.level[l]);
                sums[0][l] += shape;
                sums[1][l] += shape * shape;
                sums[2][l] += level;
                sums[3][l] += shape * level;
            }
        }
        sums.map(|lanes| lanes.iter().sum())
    }

    fn normal(model: &Model, window: &Window, profile: &EdgeProfile) -> Normal {
        let p = &model.p;
        let edges = model.edges();
        let [n1, n2] = edges.normals;
        // The lower half, row after row.
        let mut products = [[0.0; LANES]; PARAMETERS * (PARAMETERS + 1) / 2];
        let mut gradient = [[0.0; LANES]; PARAMETERS];
        let mut cost = [0.0; LANES];
        for pixels in &window.pixels {
            let (dx, dy) = model.offsets(pixels);
            let Shape { value, slopes: [q1, q2] } = edges.shape(&dx, &dy, profile);
            let mut rows = [[0.0; LANES]; PARAMETERS];
            let mut residual = [0.0; LANES];
            for l in 0..LANES {
                let (dx, dy, w) = (dx[l], dy[l], pixels.weight[l]);
                let (ox, oy) = (pixels.x[l] - model.origin[0], pixels.y[l] - model.origin[1]);
                let light = w * (1.0 + p[7] * ox + p[8] * oy);
                let reflectance = p[5] + p[6] * value[l];
                let scale = p[6] * light * edges.sharpness;
                let (s1, s2) = (scale * q1[l], scale * q2[l]);
                let (d1, d2) = (n1[0] * dx + n1[1] * dy, n2[0] * dx + n2[1] * dy);
                rows[0][l] = -(s1 * n1[0] + s2 * n2[0]);
                rows[1][l] = -(s1 * n1[1] + s2 * n2[1]);
                // An edge turned moves across itself by the distance along it.
                rows[2][l] = -s1 * (n1[1] * dx - n1[0] * dy);
                rows[3][l] = s2 * (-n2[1] * dx + n2[0] * dy);
                rows[4][l] = -(s1 * d1 + s2 * d2) * edges.sharpness;
                rows[5][l] = light;
                rows[6][l] = value[l] * light;
                rows[7][l] = w * reflectance * ox;
                rows[8][l] = w * reflectance * oy;
                // The level of what is no pixel is 0, too.
                residual[l] = pixels.level[l] - reflectance * light;
            }
            for l in 0..LANES {
                cost[l] += residual[l] * residual[l];
            }
            let mut next = 0;
            for k in 0..PARAMETERS {
                for l in 0..LANES {
                    gradient[k][l] += rows[k][l] * residual[l];
                }
                for m in 0..=k {
                    for l in 0..LANES {
                        products[next + m][l] += rows[k][l] * rows[m][l];
                    }
                }
                next += k + 1;
            }
        }
        let sum = |lanes: Lanes| lanes.iter().sum::<f64>();
        let matrix = Matrix::from_fn(|i, j| sum(products[i.max(j) * (i.max(j) + 1) / 2 + i.min(j)]));
        Normal { cost: sum(cost), matrix, gradient: Vector::from(gradient.map(sum)) }
    }
}

struct Edges {
    normals: [[f64; 2]; 2],
    sharpness: f64,
    /// Sine and 1 / cosine^2 at the nodes of the integral over the correlation.
    nodes: [[f64; 2]; 2],
    /// Of either node.
    weight: f64,
}

impl Edges {
    #[inline(always)]
    fn shape(&self, dx: &Lanes, dy: &Lanes, profile: &EdgeProfile) -> Shape {
        let mut z = [[0.0; LANES]; 2];
        for (z, n) in z.iter_mut().zip(self.normals) {
            for ((z, dx), dy) in z.iter_mut().zip(dx).zip(dy) {
                *z = (n[0] * dx + n[1] * dy) * self.sharpness;
            }
        }
        let mut shape = Shape { value: [0.0; LANES], slopes: [[0.0; LANES]; 2] };
        let [z1, z2] = &z;
        for (l, (z1, z2)) in z1.iter().zip(z2).enumerate() {
            let ([e1, g1], [e2, g2]) = (profile.at(*z1), profile.at(*z2));
            shape.value[l] = e1 * e2;
            shape.slopes[0][l] = g1 * e2;
            shape.slopes[1][l] = e1 * g2;
        }
        if self.weight != 0.0 {
            self.add_correlation(&z, &mut shape);
        }
        shape
    }

    /// 2 / pi times the integral of exp(-(z1^2 - 2 z1 z2 sin t + z2^2) / (2 cos^2 t)) over t from 0 to
    /// asin(correlation), by Gauss's rule with two nodes.
    #[inline(always)]
    fn add_correlation(&self, [z1, z2]: &[Lanes; 2], shape: &mut Shape) {
        for [sine, inverse] in self.nodes {
            for l in 0..LANES {
                let (z1, z2) = (z1[l], z2[l]);
                let exponent = -0.5 * (z1 * z1 - 2.0 * z1 * z2 * sine + z2 * z2) * inverse;
                let term = self.weight * exponential(exponent);
                shape.value[l] += term;
                shape.slopes[0][l] -= term * (z1 - z2 * sine) * inverse;
                shape.slopes[1][l] -= term * (z2 - z1 * sine) * inverse;
            }
        }
    }
}
