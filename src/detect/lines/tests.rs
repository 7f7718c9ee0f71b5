//! Segments against edges whose place is known.

use std::f64::consts::PI;

use nalgebra::Vector2;
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use super::*;
use crate::image::{Image, PixelFormat};

/// Rotated rectangles, blurred by a Gaussian and the pixels' own area, with noise.
#[derive(Clone)]
struct Scene {
    size: [u32; 2],
    /// Centre, half sides, turn (radians), step against the background.
    boxes: Vec<([f64; 2], [f64; 2], f64, f64)>,
    background: f64,
    /// Change of the light from left to right, and from top to bottom, grey levels.
    light: [f64; 2],
    blur: f64,
    noise: f64,
    seed: u64,
}

impl Default for Scene {
    fn default() -> Self {
        let boxes = vec![([100.3, 80.6], [60.0, 40.0], 0.2, 80.0)];
        Self { size: [200, 160], boxes, background: 60.0, light: [0.0; 2], blur: 0.9, noise: 2.0, seed: 1 }
    }
}

/// By the error function's series and continued fraction in one: Marsaglia, J. Stat. Soft. 2004.
fn cdf(x: f64) -> f64 {
    if x.abs() > 8.0 {
        return if x > 0.0 { 1.0 } else { 0.0 };
    }
    let (mut s, mut t, mut i) = (x, x, 1.0);
    while (s + t * x * x / (i + 2.0)) != s {
        i += 2.0;
        t *= x * x / i;
        s += t;
    }
    0.5 + s * (-0.5 * x * x - 0.918_938_533_204_672_7).exp()
}

struct Random(ChaCha8Rng);

impl Random {
    fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    fn uniform(&mut self) -> f64 {
        self.0.next_u32() as f64 / 2f64.powi(32)
    }

    fn normal(&mut self) -> f64 {
        let (a, b) = (self.uniform(), self.uniform());
        (-2.0 * (1.0 - a).ln()).sqrt() * (2.0 * PI * b).cos()
    }
}

impl Scene {
    fn render(&self) -> Image {
        const SAMPLES: usize = 3;
        let mut random = Random::new(self.seed);
        let [w, h] = self.size.map(|n| n as usize);
        let mut image = Image::new(PixelFormat::Gray8, self.size[0], self.size[1]);
        // Steps are looked up: 64 a standard deviation.
        let table: Vec<f64> = (-1024..=1024).map(|i| cdf(i as f64 / 128.0)).collect();
        let step = |d: f64| {
            let z = (d / self.blur * 128.0).clamp(-1023.0, 1023.0) + 1024.0;
            let (i, f) = (z as usize, z.fract());
            table[i] + f * (table[i + 1] - table[i])
        };
        for (i, pixel) in image.data.iter_mut().enumerate() {
            let (x, y) = ((i % w) as f64, (i / w) as f64);
            let mut sum = 0.0;
            for k in 0..SAMPLES * SAMPLES {
                let at = |k: usize| (k as f64 + 0.5) / SAMPLES as f64 - 0.5;
                let (x, y) = (x + at(k % SAMPLES), y + at(k / SAMPLES));
                sum += self.background;
                for (centre, half, turn, contrast) in &self.boxes {
                    let (dx, dy) = (x - centre[0], y - centre[1]);
                    let (sin, cos) = turn.sin_cos();
                    let [u, v] = [cos * dx + sin * dy, cos * dy - sin * dx];
                    let inside = |u: f64, half: f64| step(u + half) - step(u - half);
                    sum += contrast * inside(u, half[0]) * inside(v, half[1]);
                }
            }
            let light = self.light[0] * x / w as f64 + self.light[1] * y / h as f64;
            let level = sum / (SAMPLES * SAMPLES) as f64 + light + self.noise * random.normal();
            *pixel = level.round().clamp(0.0, 255.0) as u8;
        }
        image
    }

    /// The boxes' sides as segments with the bright side on the right.
    fn sides(&self) -> Vec<[Vector2<f64>; 2]> {
        let mut sides = Vec::new();
        for (centre, half, turn, contrast) in &self.boxes {
            let (sin, cos) = turn.sin_cos();
            let corner = |a: f64, b: f64| {
                let (u, v) = (a * half[0], b * half[1]);
                Vector2::new(centre[0] + cos * u - sin * v, centre[1] + sin * u + cos * v)
            };
            let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            for i in 0..4 {
                let [a, b] = [corners[i], corners[(i + 1) % 4]];
                // Clockwise in the image, the inside is on the right.
                sides.push(if *contrast > 0.0 { [a, b] } else { [b, a] });
            }
        }
        sides
    }
}

fn detect(image: &Image, options: &LineOptions) -> Vec<LineSegment> {
    detect_line_segments(&image.view().unwrap(), options).unwrap()
}

/// Distances of the segment's points from a line, towards its bright side.
fn off(segment: &LineSegment, side: &[Vector2<f64>; 2]) -> [f64; 2] {
    let d = (side[1] - side[0]).normalize();
    segment.points.map(|p| Vector2::new(-d.y, d.x).dot(&(p - side[0])))
}

/// The segment that shows a side, its bright side on the same hand.
fn showing<'a>(segments: &'a [LineSegment], side: &[Vector2<f64>; 2]) -> Option<&'a LineSegment> {
    let d = (side[1] - side[0]).normalize();
    segments.iter().find(|s| s.direction().dot(&d) > 0.99 && off(s, side).iter().all(|o| o.abs() < 1.0))
}

#[test]
fn the_sides_of_a_box_are_found_where_they_are() {
    let scene = Scene::default();
    let segments = detect(&scene.render(), &LineOptions::default());
    assert_eq!(segments.len(), 4, "{segments:?}");
    for side in scene.sides() {
        let s = showing(&segments, &side).unwrap();
        assert!(off(s, &side).iter().all(|o| o.abs() < 0.05), "{:?}", off(s, &side));
        assert!((s.contrast - 80.0).abs() < 4.0, "{}", s.contrast);
        assert!((s.blur - 0.9).abs() < 0.15, "{}", s.blur);
        for i in 0..2 {
            let along = (s.ends[i] - side[i]).dot(&s.direction());
            assert!(along.abs() < 4.0, "{along}");
        }
    }
}

#[test]
fn covariances_hold_and_are_near_the_bound() {
    // Turn, blur, noise.
    for (turn, blur, noise) in [
        (0.03, 0.4, 0.5),
        (0.4, 0.5, 0.5),
        (1.2, 0.7, 0.0),
        (0.1, 0.8, 2.0),
        (0.7, 1.2, 5.0),
        (1.4, 2.0, 2.0),
        (PI / 4.0, 0.9, 4.0),
    ] {
        let (mut nees, mut n, mut square, mut bound) = (0.0, 0.0, 0.0, 0.0);
        for seed in 0..60 {
            let mut random = Random::new(seed);
            let centre = [100.0 + random.uniform(), 100.0 + random.uniform()];
            let boxes = vec![(centre, [60.0, 40.0], turn, 90.0)];
            let scene = Scene { size: [200, 200], boxes, blur, noise, seed, ..Scene::default() };
            let segments = detect(&scene.render(), &LineOptions::default());
            for side in scene.sides() {
                let s = showing(&segments, &side).unwrap();
                for o in off(s, &side) {
                    nees += o * o / s.variance;
                    square += o * o;
                    n += 1.0;
                }
                // An infinitely wide window and known levels: sigma^2 2 s sqrt(pi) / (c^2 length) each
                // for the middle, twice for points at a radius of gyration.
                let s2 = blur * blur + 1.0 / 12.0;
                bound += 2.0 * 2.0 * (noise * noise + 1.0 / 12.0) * 2.0 * s2.sqrt() * PI.sqrt()
                    / (90.0f64.powi(2) * s.length());
            }
        }
        println!(
            "turn {turn} blur {blur} noise {noise}: rms {:.4} bound {:.4} nees {:.3}",
            (square / n).sqrt(),
            (bound / n).sqrt(),
            nees / n
        );
    }
}

#[test]
fn noise_shows_no_lines() {
    for (seed, noise) in [(1, 2.0), (2, 10.0), (3, 30.0)] {
        let scene = Scene { size: [640, 480], boxes: vec![], background: 120.0, noise, seed, ..Scene::default() };
        let image = scene.render();
        let options = LineOptions { min_contrast: 1.0, min_length: 8.0, ..Default::default() };
        println!("{noise}: {:?}", detect(&image, &options).len());
    }
}
