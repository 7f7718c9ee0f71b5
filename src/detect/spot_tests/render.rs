//! Rendered frames, and the figures that are held against their truth.

use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use crate::detect::spot::*;
use crate::error::Result;
use crate::image::{Image, PixelFormat};

pub(super) struct Random(ChaCha8Rng);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// In [low, high).
    pub(super) fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Box and Muller.
    pub(super) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform(f64::MIN_POSITIVE, 1.0).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform(0.0, 1.0)).cos()
    }
}

/// A scene in light, before the camera.
#[derive(Clone)]
pub(super) struct Light {
    pub(super) width: usize,
    pub(super) height: usize,
    values: Vec<f64>,
}

impl Light {
    pub(super) fn new(width: usize, height: usize, f: impl Fn(f64, f64) -> f64) -> Self {
        let values = (0..width * height).map(|i| f((i % width) as f64, (i / width) as f64)).collect();
        Self { width, height, values }
    }

    /// Smooth shading with texture.
    pub(super) fn room(width: usize, height: usize) -> Self {
        Self::new(width, height, |x, y| {
            let tiles = ((x / 23.0).floor() + (y / 31.0).floor()) % 2.0;
            70.0 + 25.0 * (x / 37.0).sin() * (y / 29.0).cos() + 40.0 * x / width as f64 + 18.0 * tiles
        })
    }

    pub(super) fn with(&self, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut out = self.clone();
        for (i, v) in out.values.iter_mut().enumerate() {
            *v += f((i % self.width) as f64, (i / self.width) as f64);
        }
        out
    }

    pub(super) fn with_spot(&self, x: f64, y: f64, amplitude: f64, sigma: f64) -> Self {
        self.with(|u, v| amplitude * (-((u - x).powi(2) + (v - y).powi(2)) / (2.0 * sigma * sigma)).exp())
    }

    /// A person: a large textured upright ellipse that hides what is behind, its edge as sharp as a lens
    /// leaves it.
    pub(super) fn with_person(&self, x: f64, y: f64, scale: f64) -> Self {
        let mut out = self.clone();
        let (a, b) = (12.0 * scale, 34.0 * scale);
        for (i, value) in out.values.iter_mut().enumerate() {
            let (u, v) = ((i % self.width) as f64 - x, (i / self.width) as f64 - y);
            let (p, q) = (u / a, v / b);
            let radius = p.hypot(q);
            let outside = (radius - 1.0) * radius / (p / a).hypot(q / b).max(1e-9);
            let cover = (0.5 - outside / 1.6).clamp(0.0, 1.0);
            let clothes = 70.0 + 35.0 * (5.0 * q).sin() + 15.0 * (9.0 * p + 4.0 * q).cos();
            *value += cover * (clothes - *value);
        }
        out
    }

    /// Exposed, with noise of variance read^2 + shot x level.
    pub(super) fn shoot(&self, camera: &Camera, random: &mut Random) -> Image {
        let mut image = Image::new(PixelFormat::Gray8, self.width as u32, self.height as u32);
        for (byte, light) in image.data.iter_mut().zip(&self.values) {
            let level = camera.gain * light + camera.offset;
            let noise = (camera.read * camera.read + camera.shot * level.max(0.0)).sqrt();
            *byte = (level + noise * random.normal()).round().clamp(0.0, 255.0) as u8;
        }
        image
    }
}

#[derive(Clone, Copy)]
pub(super) struct Camera {
    pub(super) gain: f64,
    pub(super) offset: f64,
    pub(super) read: f64,
    pub(super) shot: f64,
}

pub(super) const CAMERA: Camera = Camera { gain: 1.0, offset: 0.0, read: 2.0, shot: 0.0 };

pub(super) fn detect(on: &Image, off: &Image, options: &SpotOptions) -> Result<Spot> {
    detect_spot(&[on.view().unwrap()], &[off.view().unwrap()], options)
}

pub(super) fn shoot_and_detect(on: &Light, off: &Light, camera: &Camera, random: &mut Random) -> Result<Spot> {
    detect(&on.shoot(camera, random), &off.shoot(camera, random), &SpotOptions::default())
}

pub(super) fn assert_at(spot: &Spot, x: f64, y: f64, within: f64) {
    let error = (spot.x - x).hypot(spot.y - y);
    assert!(error <= within, "{error:.3} px off: {spot:?}");
}

/// Root mean square of the 2D error, sqrt(NEES / 2), and the mean error along x and y.
pub(super) fn statistics(results: &[([f64; 2], Spot)]) -> (f64, f64, [f64; 2]) {
    let n = results.len() as f64;
    let (mut square, mut nees, mut mean) = (0.0, 0.0, [0.0; 2]);
    for (truth, s) in results {
        let [ex, ey] = [s.x - truth[0], s.y - truth[1]];
        let [xx, xy, yy] = s.covariance;
        square += ex * ex + ey * ey;
        nees += (yy * ex * ex - 2.0 * xy * ex * ey + xx * ey * ey) / (xx * yy - xy * xy);
        mean = [mean[0] + ex / n, mean[1] + ey / n];
    }
    ((square / n).sqrt(), (nees / n / 2.0).sqrt(), mean)
}

/// The mean of the thresholded difference, weighted by it: what is usually done.
pub(super) fn intensity_weighted(on: &Image, off: &Image, threshold: i32) -> [f64; 2] {
    let mut sums = [0.0; 3];
    for (i, (a, b)) in on.data.iter().zip(&off.data).enumerate() {
        let d = *a as i32 - *b as i32;
        if d > threshold {
            let (x, y) = (i % on.width as usize, i / on.width as usize);
            sums = [sums[0] + d as f64, sums[1] + d as f64 * x as f64, sums[2] + d as f64 * y as f64];
        }
    }
    [sums[1] / sums[0], sums[2] / sums[0]]
}
