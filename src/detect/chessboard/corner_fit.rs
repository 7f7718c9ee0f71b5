//! One corner to a fraction of a pixel: Gauss-Newton on its image, which is where two straight edges
//! cross, blurred by a Gaussian, under light that varies linearly.
//!
//! The blurred product of two step edges at an angle is the orthant probability of two correlated
//! normal variables: the product of two error functions plus the integral of their joint density over
//! the correlation (Plackett, Biometrika 1954; Drezner and Wesolowsky 1990).

use nalgebra::{SMatrix, SVector};

use crate::image::pyramid::Grey;

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
/// Correlations of the edges that are too small to matter, and exponents.
const PERPENDICULAR: f64 = 0.02;
const NEGLIGIBLE: f64 = -8.0;

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
            let normal = model.normal(&window, profile);
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
        let count = window.pixels.len() as f64;
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
    /// x, y and level.
    pixels: Vec<[f64; 3]>,
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
        let mut pixels = Vec::with_capacity(((right - left + 1.0) * (bottom - top + 1.0)) as usize);
        for y in top as usize..=bottom as usize {
            let dy = y as f64 - cy;
            for (x, level) in image.row(y).iter().enumerate().take(right as usize + 1).skip(left as usize) {
                let dx = x as f64 - cx;
                let along_u = (dx * v[1] - dy * v[0]) / area;
                let along_v = (u[0] * dy - u[1] * dx) / area;
                if dx * dx + dy * dy <= RADIUS * RADIUS && along_u.abs() <= free_u && along_v.abs() <= free_v {
                    pixels.push([x as f64, y as f64, *level as f64]);
                }
            }
        }
        (pixels.len() >= 2 * PARAMETERS).then_some(Self { pixels })
    }

    /// Sum of squares about the mean.
    fn variation(&self) -> f64 {
        let mean = self.pixels.iter().map(|p| p[2]).sum::<f64>() / self.pixels.len() as f64;
        self.pixels.iter().map(|p| (p[2] - mean) * (p[2] - mean)).sum()
    }
}

struct Normal {
    cost: f64,
    matrix: Matrix,
    gradient: Vector,
}

/// The corner's image between -1 and 1 and its derivatives with respect to z of either edge.
struct Shape {
    value: f64,
    slopes: [f64; 2],
}

impl Model {
    /// Mean level and amplitude by linear regression on the shape.
    fn start_levels(&mut self, window: &Window, profile: &EdgeProfile) -> Option<()> {
        let [mut s, mut ss, mut l, mut sl] = [0.0; 4];
        let edges = self.edges();
        for [x, y, level] in &window.pixels {
            let shape = edges.shape(x - self.p[0], y - self.p[1], profile).value;
            s += shape;
            ss += shape * shape;
            l += level;
            sl += shape * level;
        }
        let n = window.pixels.len() as f64;
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

    fn is_possible(&self, start: &Start) -> bool {
        let moved = (self.p[0] - start.position[0]).hypot(self.p[1] - start.position[1]);
        let crossing = (self.p[3] - self.p[2]).sin();
        self.p.iter().all(|v| v.is_finite()) && moved < 0.5 * RADIUS && self.p[4] < 0.8 * RADIUS && crossing > 0.1
    }

    fn normal(&self, window: &Window, profile: &EdgeProfile) -> Normal {
        let p = &self.p;
        let edges = self.edges();
        let [n1, n2] = edges.normals;
        let mut matrix = [[0.0f64; PARAMETERS]; PARAMETERS];
        let mut gradient = [0.0f64; PARAMETERS];
        let mut cost = 0.0;
        for [x, y, level] in &window.pixels {
            let (dx, dy) = (x - p[0], y - p[1]);
            let Shape { value, slopes: [q1, q2] } = edges.shape(dx, dy, profile);
            let (ox, oy) = (x - self.origin[0], y - self.origin[1]);
            let light = 1.0 + p[7] * ox + p[8] * oy;
            let reflectance = p[5] + p[6] * value;
            let scale = p[6] * light * edges.sharpness;
            let (s1, s2) = (scale * q1, scale * q2);
            let (d1, d2) = (n1[0] * dx + n1[1] * dy, n2[0] * dx + n2[1] * dy);
            let row = [
                -(s1 * n1[0] + s2 * n2[0]),
                -(s1 * n1[1] + s2 * n2[1]),
                // An edge turned moves across itself by the distance along it.
                -s1 * (n1[1] * dx - n1[0] * dy),
                s2 * (-n2[1] * dx + n2[0] * dy),
                -(s1 * d1 + s2 * d2) * edges.sharpness,
                light,
                value * light,
                reflectance * ox,
                reflectance * oy,
            ];
            let residual = level - reflectance * light;
            cost += residual * residual;
            for (k, a) in row.iter().enumerate() {
                gradient[k] += a * residual;
                // One half is enough.
                for (m, b) in matrix[k][..=k].iter_mut().zip(&row) {
                    *m += a * b;
                }
            }
        }
        let matrix = Matrix::from_fn(|i, j| matrix[i.max(j)][i.min(j)]);
        Normal { cost, matrix, gradient: Vector::from(gradient) }
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
    fn shape(&self, dx: f64, dy: f64, profile: &EdgeProfile) -> Shape {
        let [z1, z2] = self.normals.map(|n| (n[0] * dx + n[1] * dy) * self.sharpness);
        let ([e1, g1], [e2, g2]) = (profile.at(z1), profile.at(z2));
        let mut shape = Shape { value: e1 * e2, slopes: [g1 * e2, e1 * g2] };
        if self.weight != 0.0 {
            self.add_correlation(z1, z2, &mut shape);
        }
        shape
    }

    /// 2 / pi times the integral of exp(-(z1^2 - 2 z1 z2 sin t + z2^2) / (2 cos^2 t)) over t from 0 to
    /// asin(correlation), by Gauss's rule with two nodes.
    fn add_correlation(&self, z1: f64, z2: f64, shape: &mut Shape) {
        for [sine, inverse] in self.nodes {
            let exponent = -0.5 * (z1 * z1 - 2.0 * z1 * z2 * sine + z2 * z2) * inverse;
            if exponent > NEGLIGIBLE {
                let term = self.weight * exponent.exp();
                shape.value += term;
                shape.slopes[0] -= term * (z1 - z2 * sine) * inverse;
                shape.slopes[1] -= term * (z2 - z1 * sine) * inverse;
            }
        }
    }
}
