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
    let (mut nees_of_all, mut all) = (0.0, 0.0);
    // Turn, blur, noise.
    for (turn, blur, noise) in [(0.1, 0.8, 2.0), (0.7, 1.2, 5.0), (1.4, 2.0, 2.0), (PI / 4.0, 0.9, 4.0)] {
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
                // Cramer-Rao with known levels and blur and an infinitely wide window: Fisher's
                // information of a pixel's length of the edge is c^2 / (2 s sqrt(pi) sigma^2). Half of it
                // is for the middle of the line, half for its slope.
                let (s2, sigma2) = (blur * blur + 1.0 / 12.0, noise * noise + 1.0 / 12.0);
                bound += 4.0 * 2.0 * sigma2 * (s2 * PI).sqrt() / (90.0f64.powi(2) * s.length());
            }
        }
        let case = format!("turn {turn} blur {blur} noise {noise}");
        let ratio = (square / bound).sqrt();
        println!("{case}: rms {:.4} px, {ratio:.2} of the bound, NEES {:.2}", (square / n).sqrt(), nees / n);
        // Levels are unknown, and the window has 9 to 17 pixels: that alone makes 1.28 for a blur of a
        // pixel.
        assert!(ratio < 1.55, "{case}: {ratio}");
        // 480 squares: their mean is good to 6.5 %.
        assert!((0.75..1.25).contains(&(nees / n)), "{case}: {}", nees / n);
        (nees_of_all, all) = (nees_of_all + nees, all + n);
    }
    assert!((0.85..1.15).contains(&(nees_of_all / all)), "{}", nees_of_all / all);
}

#[test]
fn light_and_the_next_edge_do_not_move_a_line() {
    // Without noise what is left is bias. Strips of 4 to 9 pixels: an edge that near is within reach. At
    // 4 pixels the two ramps, of two standard deviations each, run into each other.
    for (width, turn) in [(4.0, 0.0), (5.0, 0.3), (6.0, 1.2), (9.0, 0.8)] {
        let boxes = vec![([100.2, 80.4], [70.0, 0.5 * width], turn, 100.0)];
        let scene = Scene { boxes, light: [60.0, 20.0], noise: 0.0, ..Scene::default() };
        let segments = detect(&scene.render(), &LineOptions::default());
        let sides = scene.sides();
        for side in [&sides[0], &sides[2]] {
            let s = showing(&segments, side).unwrap_or_else(|| panic!("{width} {turn}: {segments:?}"));
            let worst = off(s, side).map(f64::abs).into_iter().fold(0.0, f64::max);
            println!("{width} {turn}: {worst:.4}");
            assert!(worst < if width > 4.0 { 0.05 } else { 0.1 }, "strip of {width} px at {turn}: {worst}");
        }
    }
}

#[test]
fn noise_shows_no_lines() {
    for (seed, noise) in [(1, 2.0), (2, 10.0), (3, 30.0)] {
        let scene = Scene { size: [640, 480], boxes: vec![], background: 120.0, noise, seed, ..Scene::default() };
        let image = scene.render();
        let options = LineOptions { min_contrast: 1.0, min_length: 8.0, ..Default::default() };
        let found = detect(&image, &options).len();
        assert!(found <= 1, "noise {noise}: {found}");
    }
}

#[test]
fn lines_that_cross_and_lines_in_pieces_are_whole() {
    // A dark bar lies across a bright one.
    let boxes = vec![([150.0, 80.3], [130.0, 15.0], 0.1, 60.0), ([150.0, 80.0], [10.0, 60.0], 0.1, -50.0)];
    let scene = Scene { size: [300, 160], boxes, noise: 1.5, ..Scene::default() };
    let segments = detect(&scene.render(), &LineOptions::default());
    for side in [&scene.sides()[0], &scene.sides()[2]] {
        let s = showing(&segments, side).unwrap();
        assert!(s.length() > 250.0, "{}", s.length());
        assert!(off(s, side).iter().all(|o| o.abs() < 5.0 * s.variance.sqrt()), "{:?} {}", off(s, side), s.variance);
    }
    // Two boxes in a row, 20 pixels apart: their long sides continue each other.
    let (sin, cos) = 0.1f64.sin_cos();
    let boxes = [0.0, 120.0].map(|s| ([90.3 + s * cos, 70.0 + s * sin], [50.0, 20.0], 0.1, 60.0));
    let scene = Scene { size: [300, 160], boxes: boxes.to_vec(), noise: 1.5, ..Scene::default() };
    let segments = detect(&scene.render(), &LineOptions::default());
    assert_eq!(segments.len(), 6, "{segments:?}");
    for side in [&scene.sides()[0], &scene.sides()[2]] {
        let s = showing(&segments, side).unwrap();
        assert!((s.length() - 220.0).abs() < 6.0 && (s.support - 200.0).abs() < 8.0, "{s:?}");
        assert!(off(s, side).iter().all(|o| o.abs() < 5.0 * s.variance.sqrt()), "{:?} {}", off(s, side), s.variance);
    }
    let pieces = detect(&scene.render(), &LineOptions { max_gap: 0.0, ..Default::default() });
    assert_eq!(pieces.len(), 8);
    // Two boxes whose sides nearly continue each other, a pixel apart, are two.
    let boxes = vec![([80.0, 80.0], [50.0, 20.0], 0.0, 60.0), ([200.0, 81.5], [50.0, 20.0], 0.0, 60.0)];
    let scene = Scene { size: [280, 160], boxes, noise: 1.5, ..Scene::default() };
    let segments = detect(&scene.render(), &LineOptions::default());
    assert!(segments.iter().all(|s| s.length() < 110.0), "{segments:?}");
    assert_eq!(segments.len(), 8);
}

#[test]
fn soft_edges_are_found_too() {
    for blur in [0.5, 1.0, 2.0, 3.0] {
        let scene = Scene { blur, noise: 1.0, ..Scene::default() };
        let segments = detect(&scene.render(), &LineOptions { min_contrast: 20.0, ..Default::default() });
        let found = scene.sides().iter().filter(|side| showing(&segments, side).is_some()).count();
        assert_eq!(found, 4, "blur {blur}");
    }
}

#[test]
fn a_round_edge_is_not_straight_and_a_bent_one_lies_about_its_points() {
    // A disc of radius 400 px: 100 pixels of its rim leave their chord by 3 pixels.
    let (w, h) = (300usize, 200usize);
    let mut image = Image::new(PixelFormat::Gray8, w as u32, h as u32);
    let centre = Vector2::new(150.0, 480.0);
    for (i, pixel) in image.data.iter_mut().enumerate() {
        let d = (Vector2::new((i % w) as f64, (i / w) as f64) - centre).norm() - 400.0;
        *pixel = (60.0 + 100.0 * cdf(-d)).round() as u8;
    }
    let segments = detect(&image, &LineOptions::default());
    assert!(!segments.is_empty());
    for s in &segments {
        assert!(s.length() < 150.0, "{}", s.length());
        for p in s.points {
            let d = (p - centre).norm() - 400.0;
            // Chord and rim part by up to 5 pixels between the ends.
            assert!(d.abs() < 0.35, "{d} of {} px", s.length());
        }
    }
}

#[test]
fn tiny_flat_and_huge_images_have_no_lines() {
    for [w, h] in [[1, 1], [2, 2], [3, 3], [1, 100], [100, 1], [7, 5]] {
        let mut image = Image::new(PixelFormat::Gray8, w, h);
        image.data.iter_mut().enumerate().for_each(|(i, p)| *p = (i * 97 % 256) as u8);
        assert!(detect(&image, &LineOptions::default()).is_empty(), "{w} x {h}");
    }
    for format in [PixelFormat::Gray8, PixelFormat::Rgb24, PixelFormat::Nv12, PixelFormat::Yuyv] {
        let mut image = Image::new(format, 64, 48);
        image.data.fill(130);
        assert!(detect(&image, &LineOptions::default()).is_empty(), "{format:?}");
    }
    // As wide as can be.
    let row = [9u8; 1 << 16];
    let data = row.repeat(2);
    let view = ImageView::new(PixelFormat::Gray8, 1 << 16, 2, &[(&data, 1 << 16)]).unwrap();
    assert!(detect_line_segments(&view, &LineOptions::default()).unwrap().is_empty());
    // A hundred megapixels of hard checks: a byte a pixel besides them, and seconds.
    let row: Vec<u8> = (0..12_000).map(|x| if x / 1_500 % 2 == 0 { 60 } else { 160 }).collect();
    let data = row.repeat(8_400);
    let view = ImageView::new(PixelFormat::Gray8, 12_000, 8_400, &[(&data, 12_000)]).unwrap();
    let found = detect_line_segments(&view, &LineOptions::default()).unwrap();
    assert_eq!(found.len(), 7);
    assert!(found.iter().all(|s| s.length() > 8_390.0), "{found:?}");
}

#[test]
fn impossible_options_are_refused() {
    let image = Image::new(PixelFormat::Gray8, 32, 32);
    let good = LineOptions::default();
    for bad in [
        LineOptions { min_length: 7.9, ..good },
        LineOptions { min_length: f64::NAN, ..good },
        LineOptions { min_contrast: 0.0, ..good },
        LineOptions { min_contrast: 300.0, ..good },
        LineOptions { max_gap: -1.0, ..good },
        LineOptions { max_gap: f64::INFINITY, ..good },
        LineOptions { max_segments: 0, ..good },
    ] {
        let e = detect_line_segments(&image.view().unwrap(), &bad).unwrap_err();
        assert!(matches!(e, Error::InvalidArgument { .. }), "{bad:?}");
    }
}

#[test]
fn dark_and_bright_sides_are_told_apart_in_every_direction() {
    for turn in 0..16 {
        let turn = f64::from(turn) * PI / 8.0 + 0.03;
        for contrast in [60.0, -50.0] {
            let boxes = vec![([100.3, 100.6], [60.0, 40.0], turn, contrast)];
            let scene = Scene { size: [200, 200], boxes, ..Scene::default() };
            let segments = detect(&scene.render(), &LineOptions::default());
            assert_eq!(segments.len(), 4, "{turn} {contrast}");
            assert!(scene.sides().iter().all(|side| showing(&segments, side).is_some()), "{turn} {contrast}");
            assert!(segments.iter().all(|s| (s.contrast - contrast.abs()).abs() < 5.0));
        }
    }
}
