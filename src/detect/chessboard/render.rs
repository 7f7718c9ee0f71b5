//! Pictures of boards whose corners are known: perspective, lens, light, blur and noise. Nothing here
//! is shared with the detector.

use nalgebra::{Rotation3, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use crate::image::{Image, PixelFormat};

/// Samples a pixel and direction.
const SAMPLES: usize = 4;

/// A board in front of a camera; squares have side 1.
#[derive(Debug, Clone)]
pub struct Scene {
    pub image: [u32; 2],
    pub board: [usize; 2],
    pub focal: f64,
    /// Ray = distorted (1 + bend |distorted|^2): positive for barrel distortion.
    pub bend: f64,
    /// Of the board's middle, squares.
    pub place: [f64; 3],
    /// Rotation vector.
    pub turn: [f64; 3],
    pub dark: f64,
    pub bright: f64,
    /// Change of the light from the left of the image to the right, and from top to bottom.
    pub light: [f64; 2],
    /// Standard deviations: pixels, grey levels.
    pub blur: f64,
    pub noise: f64,
    /// Rectangles in front: left, top, right, bottom, level.
    pub hidden: Vec<[f64; 5]>,
    /// Amplitude of the background's texture.
    pub clutter: f64,
    pub mirrored: bool,
    pub seed: u64,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            image: [640, 480],
            board: [9, 6],
            focal: 600.0,
            bend: 0.0,
            place: [0.0, 0.0, 16.0],
            turn: [0.0; 3],
            dark: 25.0,
            bright: 225.0,
            light: [0.0; 2],
            blur: 1.0,
            noise: 3.0,
            hidden: Vec::new(),
            clutter: 0.0,
            mirrored: false,
            seed: 1,
        }
    }
}

impl Scene {
    fn centre(&self) -> [f64; 2] {
        self.image.map(|s| 0.5 * s as f64 - 0.5)
    }

    fn rotation(&self) -> Rotation3<f64> {
        Rotation3::new(Vector3::from(self.turn))
    }

    /// The inner corners in the image, row by row of the board.
    pub fn corners(&self) -> Vec<[f64; 2]> {
        let [columns, rows] = self.board;
        let rotation = self.rotation();
        let [cx, cy] = self.centre();
        let mut corners = Vec::new();
        for (j, i) in (0..rows).flat_map(|j| (0..columns).map(move |i| (j, i))) {
            let on = Vector3::new(i as f64 - 0.5 * (columns - 1) as f64, j as f64 - 0.5 * (rows - 1) as f64, 0.0);
            let p = rotation * on + Vector3::from(self.place);
            let (x, y) = (p.x / p.z, p.y / p.z);
            let r = x.hypot(y);
            // d (1 + bend d^2) = r by Newton's method.
            let d = (0..30).fold(r, |d, _| d - (d * (1.0 + self.bend * d * d) - r) / (1.0 + 3.0 * self.bend * d * d));
            let s = if r > 0.0 { d / r } else { 1.0 };
            let u = cx + self.focal * s * x;
            corners.push([if self.mirrored { 2.0 * cx - u } else { u }, cy + self.focal * s * y]);
        }
        corners
    }

    /// Where a place of the image lies on the board, squares from the board's corner.
    fn on_board(&self, u: f64, v: f64, inverse: &Rotation3<f64>) -> Option<[f64; 2]> {
        let [cx, cy] = self.centre();
        let (x, y) = ((u - cx) / self.focal, (v - cy) / self.focal);
        let s = 1.0 + self.bend * (x * x + y * y);
        let ray = inverse * Vector3::new(s * x, s * y, 1.0);
        let origin = inverse * -Vector3::from(self.place);
        let t = -origin.z / ray.z;
        let [columns, rows] = self.board.map(|n| n as f64);
        (t > 0.0).then(|| [origin.x + t * ray.x + 0.5 * (columns + 1.0), origin.y + t * ray.y + 0.5 * (rows + 1.0)])
    }

    /// Light of a sample of the image, without blur.
    fn level(&self, u: f64, v: f64, inverse: &Rotation3<f64>, waves: &[[f64; 3]]) -> f64 {
        let [cx, cy] = self.centre();
        let [width, height] = self.image.map(f64::from);
        let u = if self.mirrored { 2.0 * cx - u } else { u };
        let light = 1.0 + self.light[0] * (u - cx) / width + self.light[1] * (v - cy) / height;
        if let Some(h) = self.hidden.iter().find(|h| u >= h[0] && v >= h[1] && u < h[2] && v < h[3]) {
            return h[4] * light;
        }
        let [columns, rows] = self.board.map(|n| n as f64);
        let inside = |[a, b]: [f64; 2], m: f64| a > -m && b > -m && a < columns + 1.0 + m && b < rows + 1.0 + m;
        let here = self.on_board(u, v, inverse);
        let level = match here {
            Some(p) if inside(p, 0.0) => {
                // Edges are ramps as wide as a sample: point samples would move them.
                let d = 1.0 / SAMPLES as f64;
                let right = self.on_board(u + d, v, inverse).unwrap_or(p);
                let below = self.on_board(u, v + d, inverse).unwrap_or(p);
                let wave = |k: usize| {
                    let slope = (right[k] - p[k]).hypot(below[k] - p[k]);
                    let nearest = p[k].round();
                    let sign = if nearest.rem_euclid(2.0) < 0.5 { 1.0 } else { -1.0 };
                    sign * (2.0 * (p[k] - nearest) / slope).clamp(-1.0, 1.0)
                };
                0.5 * (self.bright + self.dark) - 0.5 * (self.bright - self.dark) * wave(0) * wave(1)
            }
            Some(p) if inside(p, 1.0) => self.bright,
            _ => {
                let texture: f64 = waves.iter().map(|[fx, fy, phase]| (fx * u + fy * v + phase).sin().signum()).sum();
                0.5 * (self.dark + self.bright) + self.clutter * texture / 3.0
            }
        };
        level * light
    }

    pub fn render(&self) -> Image {
        let [width, height] = self.image.map(|s| s as usize);
        let (wide, high) = (width * SAMPLES, height * SAMPLES);
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let inverse = self.rotation().inverse();
        let mut uniform = || rng.next_u32() as f64 / 2f64.powi(32);
        let waves: Vec<[f64; 3]> =
            (0..6).map(|_| [uniform() - 0.5, uniform() - 0.5, 6.0 * uniform()].map(|v| 0.8 * v)).collect();
        let at = |i: usize| (i as f64 + 0.5) / SAMPLES as f64 - 0.5;
        let mut fine = vec![0f32; wide * high];
        for (y, row) in fine.chunks_exact_mut(wide).enumerate() {
            for (x, pixel) in row.iter_mut().enumerate() {
                *pixel = self.level(at(x), at(y), &inverse, &waves) as f32;
            }
        }
        let fine = blurred(&fine, wide, high, self.blur * SAMPLES as f64);
        let mut image = Image::new(PixelFormat::Gray8, width as u32, height as u32);
        for (y, row) in image.data.chunks_exact_mut(width).enumerate() {
            for (x, pixel) in row.iter_mut().enumerate() {
                let block = (0..SAMPLES).flat_map(|j| {
                    let start = (y * SAMPLES + j) * wide + x * SAMPLES;
                    &fine[start..start + SAMPLES]
                });
                let mean = block.sum::<f32>() as f64 / (SAMPLES * SAMPLES) as f64;
                // Box and Muller.
                let (a, b) = (uniform(), uniform());
                let normal = (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos();
                *pixel = (mean + self.noise * normal).round().clamp(0.0, 255.0) as u8;
            }
        }
        image
    }
}

fn blurred(image: &[f32], width: usize, height: usize, sigma: f64) -> Vec<f32> {
    let reach = (4.0 * sigma).ceil() as isize;
    let mut kernel: Vec<f32> =
        (-reach..=reach).map(|i| (-0.5 * (i as f64 / sigma.max(1e-9)).powi(2)).exp() as f32).collect();
    let sum: f32 = kernel.iter().sum();
    kernel.iter_mut().for_each(|k| *k /= sum);
    let clamped = |i: isize, n: usize| i.clamp(0, n as isize - 1) as usize;
    let mut across = vec![0f32; image.len()];
    for (row, out) in image.chunks_exact(width).zip(across.chunks_exact_mut(width)) {
        let padded: Vec<f32> = (-reach..width as isize + reach).map(|i| row[clamped(i, width)]).collect();
        for (k, weight) in kernel.iter().enumerate() {
            out.iter_mut().zip(&padded[k..]).for_each(|(o, p)| *o += weight * p);
        }
    }
    let mut down = vec![0f32; image.len()];
    for (y, out) in down.chunks_exact_mut(width).enumerate() {
        for (k, weight) in kernel.iter().enumerate() {
            let from = clamped(y as isize + k as isize - reach, height) * width;
            out.iter_mut().zip(&across[from..from + width]).for_each(|(o, p)| *o += weight * p);
        }
    }
    down
}
