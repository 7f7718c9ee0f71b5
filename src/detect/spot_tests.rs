//! Spot detection on rendered frames whose truth is known.

use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

use super::spot::*;
use crate::error::{Error, Result};
use crate::image::{Image, ImageView, PixelFormat};

struct Random(ChaCha8Rng);

impl Random {
    fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// In [low, high).
    fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Box and Muller.
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform(f64::MIN_POSITIVE, 1.0).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform(0.0, 1.0)).cos()
    }
}

/// A scene in light, before the camera.
#[derive(Clone)]
struct Light {
    width: usize,
    height: usize,
    values: Vec<f64>,
}

impl Light {
    fn new(width: usize, height: usize, f: impl Fn(f64, f64) -> f64) -> Self {
        let values = (0..width * height).map(|i| f((i % width) as f64, (i / width) as f64)).collect();
        Self { width, height, values }
    }

    /// Smooth shading with texture.
    fn room(width: usize, height: usize) -> Self {
        Self::new(width, height, |x, y| {
            let tiles = ((x / 23.0).floor() + (y / 31.0).floor()) % 2.0;
            70.0 + 25.0 * (x / 37.0).sin() * (y / 29.0).cos() + 40.0 * x / width as f64 + 18.0 * tiles
        })
    }

    fn with(&self, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut out = self.clone();
        for (i, v) in out.values.iter_mut().enumerate() {
            *v += f((i % self.width) as f64, (i / self.width) as f64);
        }
        out
    }

    fn with_spot(&self, x: f64, y: f64, amplitude: f64, sigma: f64) -> Self {
        self.with(|u, v| amplitude * (-((u - x).powi(2) + (v - y).powi(2)) / (2.0 * sigma * sigma)).exp())
    }

    /// A person: a large textured upright ellipse that hides what is behind, its edge as sharp as a lens
    /// leaves it.
    fn with_person(&self, x: f64, y: f64, scale: f64) -> Self {
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
    fn shoot(&self, camera: &Camera, random: &mut Random) -> Image {
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
struct Camera {
    gain: f64,
    offset: f64,
    read: f64,
    shot: f64,
}

const CAMERA: Camera = Camera { gain: 1.0, offset: 0.0, read: 2.0, shot: 0.0 };

fn detect(on: &Image, off: &Image, options: &SpotOptions) -> Result<Spot> {
    detect_spot(&[on.view().unwrap()], &[off.view().unwrap()], options)
}

fn shoot_and_detect(on: &Light, off: &Light, camera: &Camera, random: &mut Random) -> Result<Spot> {
    detect(&on.shoot(camera, random), &off.shoot(camera, random), &SpotOptions::default())
}

fn assert_at(spot: &Spot, x: f64, y: f64, within: f64) {
    let error = (spot.x - x).hypot(spot.y - y);
    assert!(error <= within, "{error:.3} px off: {spot:?}");
}

/// Root mean square of the 2D error, sqrt(NEES / 2), and the mean error along x and y.
fn statistics(results: &[([f64; 2], Spot)]) -> (f64, f64, [f64; 2]) {
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
fn intensity_weighted(on: &Image, off: &Image, threshold: i32) -> [f64; 2] {
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

#[test]
fn centre_reaches_the_bound_and_its_covariance_is_true() {
    let mut random = Random::new(1);
    // Amplitude, sigma of the spot; read noise, shot noise of the camera.
    for (amplitude, sigma, read, shot) in [
        (120.0, 1.2, 2.0, 0.0),
        (120.0, 2.2, 2.0, 0.0),
        (40.0, 1.2, 2.0, 0.0),
        (90.0, 1.5, 1.0, 0.1),
        (30.0, 4.0, 2.0, 0.0),
    ] {
        let camera = Camera { read, shot, ..CAMERA };
        let background = Light::new(100, 100, |x, y| 70.0 + 0.3 * x + 0.2 * y);
        let (mut results, mut usual) = (Vec::new(), 0.0);
        let trials = 600;
        for _ in 0..trials {
            let truth = [random.uniform(46.0, 54.0), random.uniform(46.0, 54.0)];
            let lit = background.with_spot(truth[0], truth[1], amplitude, sigma);
            let (on, off) = (lit.shoot(&camera, &mut random), background.shoot(&camera, &mut random));
            let spot = detect(&on, &off, &SpotOptions::default()).unwrap();
            let c = intensity_weighted(&on, &off, 30);
            usual += ((c[0] - truth[0]).powi(2) + (c[1] - truth[1]).powi(2)) / trials as f64;
            results.push((truth, spot));
        }
        let (rms, nees, mean) = statistics(&results);
        let noise = 2.0 * (read * read + 1.0 / 12.0) + shot * 2.0 * (85.0 + 0.25 * amplitude);
        let bound = (2.0 * noise / (std::f64::consts::FRAC_PI_2 * amplitude * amplitude)).sqrt();
        assert!(rms < 1.12 * bound, "A {amplitude} sigma {sigma}: rms {rms}, bound {bound}");
        assert!(amplitude < 100.0 || rms < 0.5 * usual.sqrt(), "rms {rms}, usual {}", usual.sqrt());
        assert!((0.9..1.1).contains(&nees), "A {amplitude} sigma {sigma}: sqrt(NEES / 2) = {nees}");
        let standard_error = rms / (2.0 * trials as f64).sqrt();
        assert!(mean.iter().all(|m| m.abs() < 4.0 * standard_error), "bias {mean:?}");
    }
}

#[test]
fn dark_frames_have_no_spot() {
    let mut random = Random::new(2);
    let room = Light::room(96, 72);
    for i in 0..500 {
        let camera = Camera { read: [0.3, 1.0, 3.0, 8.0][i % 4], shot: [0.0, 0.2][i / 4 % 2], ..CAMERA };
        let result = shoot_and_detect(&room, &room, &camera, &mut random);
        assert!(matches!(result, Err(Error::NotFound { .. })), "{i}: {result:?}");
    }
}

/// Bloomed: the clipped core is wider than the light, as charge spills over.
#[test]
fn saturated_spots_are_unbiased_and_say_so() {
    let mut random = Random::new(3);
    let background = Light::room(120, 110);
    for (amplitude, sigma, halo) in [
        (400.0, 1.5, 0.0),
        (900.0, 2.5, 60.0),
        (3000.0, 2.0, 120.0),
        (2000.0, 6.0, 80.0),
        (5000.0, 1.3, 0.0),
        (800.0, 1.6, 200.0),
    ] {
        let mut results = Vec::new();
        for _ in 0..200 {
            let truth = [random.uniform(50.0, 68.0), random.uniform(48.0, 66.0)];
            let lit = background.with_spot(truth[0], truth[1], amplitude, sigma).with_spot(
                truth[0],
                truth[1],
                halo,
                3.0 * sigma,
            );
            let spot = shoot_and_detect(&lit, &background, &CAMERA, &mut random).unwrap();
            assert!(spot.saturated);
            results.push((truth, spot));
        }
        let (rms, nees, mean) = statistics(&results);
        // The shape under the clipping is not quite Gaussian: what that shifts is far below the core's size.
        assert!(rms < 0.025 * sigma, "A {amplitude}: rms {rms}");
        assert!(mean.iter().all(|m| m.abs() < 0.025 * sigma), "A {amplitude}: bias {mean:?}");
        assert!(nees < 1.1, "A {amplitude}: sqrt(NEES / 2) = {nees}");
    }
}

/// Neighbouring pixels of decoded video are not independent.
#[test]
fn correlated_noise_is_noticed() {
    let mut random = Random::new(17);
    let room = Light::room(128, 96);
    let mut shoot = |light: &Light| {
        let noise: Vec<f64> = (0..129 * 97).map(|_| 5.0 * random.normal()).collect();
        let mut image = light.shoot(&Camera { read: 0.3, ..CAMERA }, &mut random);
        for (i, byte) in image.data.iter_mut().enumerate() {
            let at = i / 128 * 129 + i % 128;
            let mean = (noise[at] + noise[at + 1] + noise[at + 129] + noise[at + 130]) / 4.0;
            *byte = (*byte as f64 + mean).round().clamp(0.0, 255.0) as u8;
        }
        image
    };
    let mut results = Vec::new();
    for i in 0..200 {
        let truth = [50.0 + 0.07 * i as f64, 50.0 - 0.031 * i as f64];
        let (lit, off) = (shoot(&room.with_spot(truth[0], truth[1], 90.0, 1.6)), shoot(&room));
        results.push((truth, detect(&lit, &off, &SpotOptions::default()).unwrap()));
        let dark = detect(&shoot(&room), &off, &SpotOptions::default());
        assert!(matches!(dark, Err(Error::NotFound { .. })), "{dark:?}");
    }
    let (_, nees, _) = statistics(&results);
    assert!((0.8..1.2).contains(&nees), "sqrt(NEES / 2) = {nees}");
}

#[test]
fn exposure_drift_is_taken_out() {
    let mut random = Random::new(4);
    let room = Light::room(160, 120);
    for (gain, offset) in [(0.8, 0.0), (1.2, 0.0), (0.9, 12.0), (1.1, -9.0), (1.5, 5.0)] {
        let drifted = Camera { gain, offset, ..CAMERA };
        for _ in 0..20 {
            let [x, y] = [random.uniform(10.0, 150.0), random.uniform(10.0, 110.0)];
            let off = room.shoot(&CAMERA, &mut random);
            let on = room.with_spot(x, y, 60.0, 1.4).shoot(&drifted, &mut random);
            assert_at(&detect(&on, &off, &SpotOptions::default()).unwrap(), x, y, 0.3);
            let dark = room.shoot(&drifted, &mut random);
            let result = detect(&dark, &off, &SpotOptions::default());
            assert!(matches!(result, Err(Error::NotFound { .. })), "{gain} {offset}: {result:?}");
        }
    }
}

#[test]
fn a_weak_reflection_is_passed_over_and_a_strong_one_reported() {
    let mut random = Random::new(5);
    let room = Light::room(160, 120);
    for amplitude in [50.0, 110.0, 600.0] {
        for _ in 0..20 {
            let [x, y] = [random.uniform(10.0, 70.0), random.uniform(10.0, 110.0)];
            let lit = |ratio: f64| room.with_spot(x, y, amplitude, 1.6).with_spot(x + 70.0, y, ratio * amplitude, 1.6);
            assert_at(&shoot_and_detect(&lit(0.3), &room, &CAMERA, &mut random).unwrap(), x, y, 0.3);
            let result = shoot_and_detect(&lit(0.8), &room, &CAMERA, &mut random);
            assert!(matches!(result, Err(Error::Ambiguous { .. })), "{amplitude}: {result:?}");
        }
    }
}

#[test]
fn a_moving_person_never_makes_a_spot() {
    let mut random = Random::new(6);
    let room = Light::room(200, 150);
    let (mut found, mut refused) = (0, 0);
    for i in 0..300 {
        let scale = random.uniform(0.3, 1.6);
        let start = [random.uniform(20.0, 180.0), random.uniform(20.0, 130.0)];
        let step = random.uniform(0.2, 12.0);
        let (before, after) =
            (room.with_person(start[0], start[1], scale), room.with_person(start[0] + step, start[1], scale));
        let result = shoot_and_detect(&after, &before, &CAMERA, &mut random);
        assert!(result.is_err(), "no laser, run {i}: {result:?}");
        let [x, y] = [random.uniform(6.0, 194.0), random.uniform(6.0, 144.0)];
        match shoot_and_detect(&after.with_spot(x, y, 170.0, 1.6), &before, &CAMERA, &mut random) {
            Ok(spot) => {
                // Beside the person, or on it, where the change of the clothes bends the fit.
                let sigma = (spot.covariance[0] + spot.covariance[2]).sqrt();
                assert_at(&spot, x, y, 0.25 + 4.0 * sigma);
                found += 1;
            }
            Err(Error::Ambiguous { .. } | Error::NotFound { .. }) => refused += 1,
            Err(other) => panic!("{other}"),
        }
    }
    assert_eq!(found + refused, 300);
    assert!(found >= 200, "{found} of 300");
}

#[test]
fn spots_at_the_border_are_found_where_they_are() {
    let mut random = Random::new(7);
    let room = Light::room(64, 48);
    let mut results = Vec::new();
    for i in 0..400 {
        let t = random.uniform(0.0, 1.0);
        let edge = random.uniform(0.0, 1.5);
        let [x, y] = [[edge, 47.0 * t], [63.0 - edge, 47.0 * t], [63.0 * t, edge], [63.0 * t, 47.0 - edge]][i % 4];
        let spot = shoot_and_detect(&room.with_spot(x, y, 80.0, 1.4), &room, &CAMERA, &mut random).unwrap();
        results.push(([x, y], spot));
    }
    let (rms, nees, _) = statistics(&results);
    assert!(rms < 0.12 && (0.85..1.15).contains(&nees), "rms {rms} nees {nees}");
}

/// Planes with padded rows, and their strides.
type Planes = Vec<(Vec<u8>, isize)>;

/// The grey image in another format, with rows padded and, at will, stored bottom up.
fn convert(grey: &Image, format: PixelFormat, bottom_up: bool) -> Planes {
    let (w, h) = (grey.width as usize, grey.height as usize);
    let plane = |plane: usize| {
        let row_bytes = format.row_bytes(plane, grey.width).unwrap();
        let (rows, stride) = (format.rows(plane, grey.height), row_bytes + 5);
        let mut data = vec![77u8; stride * rows];
        for y in 0..rows {
            let at = if bottom_up { rows - 1 - y } else { y } * stride;
            for (i, byte) in data[at..at + row_bytes].iter_mut().enumerate() {
                *byte = match format {
                    PixelFormat::Rgba32 | PixelFormat::Bgra32 if i % 4 == 3 => 255,
                    PixelFormat::Yuyv if i % 2 == 1 => 128,
                    _ if plane > 0 => 128,
                    _ => grey.data[y.min(h - 1) * w + i * w / row_bytes],
                };
            }
        }
        (data, if bottom_up { -(stride as isize) } else { stride as isize })
    };
    (0..format.planes()).map(plane).collect()
}

fn view(format: PixelFormat, size: [u32; 2], planes: &Planes) -> ImageView<'_> {
    let planes: Vec<(&[u8], isize)> = planes.iter().map(|(data, stride)| (data.as_slice(), *stride)).collect();
    ImageView::new(format, size[0], size[1], &planes).unwrap()
}

#[test]
fn all_formats_and_strides_give_the_same_spot() {
    use PixelFormat::*;
    let mut random = Random::new(8);
    let room = Light::room(98, 75);
    let on = room.with_spot(41.3, 30.8, 90.0, 1.5).shoot(&CAMERA, &mut random);
    let off = room.shoot(&CAMERA, &mut random);
    let wanted = detect(&on, &off, &SpotOptions::default()).unwrap();
    for format in [Gray8, Rgb24, Bgr24, Rgba32, Bgra32, Yuyv, Nv12, I420] {
        for bottom_up in [false, true] {
            let [on, off] = [&on, &off].map(|image| convert(image, format, bottom_up));
            let [on, off] = [&on, &off].map(|planes| view(format, [98, 75], planes));
            let spot = detect_spot(&[on], &[off], &SpotOptions::default()).unwrap();
            assert_eq!(spot, wanted, "{format:?} {bottom_up}");
        }
    }
}

/// Light of one colour, as RGB.
fn shoot_rgb(background: &Light, spots: &[([f64; 2], [f64; 3])], random: &mut Random) -> Image {
    let mut image = Image::new(PixelFormat::Rgb24, background.width as u32, background.height as u32);
    for c in 0..3 {
        let lit = spots.iter().fold(background.clone(), |light, (at, rgb)| light.with_spot(at[0], at[1], rgb[c], 1.5));
        let grey = lit.shoot(&CAMERA, random);
        image.data[c..].iter_mut().step_by(3).zip(grey.data).for_each(|(byte, v)| *byte = v);
    }
    image
}

#[test]
fn the_lasers_colour_counts() {
    let mut random = Random::new(9);
    let room = Light::room(120, 90);
    let off = shoot_rgb(&room, &[], &mut random);
    let red = ([40.3, 50.6], [90.0, 12.0, 6.0]);
    let lamp = ([90.2, 20.7], [100.0, 100.0, 100.0]);
    let with = |colour| SpotOptions { colour, ..SpotOptions::default() };

    let on = shoot_rgb(&room, &[red], &mut random);
    for colour in [LaserColour::Red, LaserColour::Unknown, LaserColour::White] {
        assert_at(&detect(&on, &off, &with(colour)).unwrap(), 40.3, 50.6, 0.15);
    }
    // Another colour is told apart, and so is white light that came on.
    assert!(matches!(detect(&on, &off, &with(LaserColour::Green)), Err(Error::NotFound { .. })));
    let on = shoot_rgb(&room, &[lamp], &mut random);
    assert!(matches!(detect(&on, &off, &with(LaserColour::Red)), Err(Error::NotFound { .. })));
    assert_at(&detect(&on, &off, &with(LaserColour::White)).unwrap(), 90.2, 20.7, 0.15);
}

#[test]
fn averaging_frames_lowers_the_error_as_it_should() {
    let mut random = Random::new(10);
    let room = Light::room(64, 64);
    let mut results = [const { Vec::new() }; 2];
    for _ in 0..200 {
        let truth = [random.uniform(28.0, 36.0), random.uniform(28.0, 36.0)];
        let lit = room.with_spot(truth[0], truth[1], 50.0, 1.4);
        for (results, n) in results.iter_mut().zip([1, 4]) {
            let mut shoot =
                |light: &Light| -> Vec<Image> { (0..n).map(|_| light.shoot(&CAMERA, &mut random)).collect() };
            let (on, off) = (shoot(&lit), shoot(&room));
            let on: Vec<ImageView<'_>> = on.iter().map(|i| i.view().unwrap()).collect();
            let off: Vec<ImageView<'_>> = off.iter().map(|i| i.view().unwrap()).collect();
            results.push((truth, detect_spot(&on, &off, &SpotOptions::default()).unwrap()));
        }
    }
    let [(one, nees_one, _), (four, nees_four, _)] = [&results[0], &results[1]].map(|r| statistics(r));
    assert!((0.42..0.60).contains(&(four / one)), "{four} of {one}");
    assert!((0.88..1.12).contains(&nees_one) && (0.88..1.12).contains(&nees_four), "{nees_one} {nees_four}");
}

#[test]
fn only_the_area_is_searched() {
    let mut random = Random::new(11);
    let room = Light::room(160, 120);
    // A stronger spot elsewhere would win, or make it ambiguous.
    let lit = room.with_spot(50.4, 60.7, 70.0, 1.5).with_spot(120.0, 30.0, 120.0, 1.5);
    let (on, off) = (lit.shoot(&CAMERA, &mut random), room.shoot(&CAMERA, &mut random));
    let region = Some(Region { x: 30, y: 40, width: 40, height: 41 });
    let band = Some(Band { polyline: vec![[-50.0, 30.0], [70.0, 67.0], [200.0, 90.0]], half_width: 9.0 });
    assert!(!(50.0..51.0).contains(&detect(&on, &off, &SpotOptions::default()).map_or(0.0, |s| s.x)));
    for (region, band) in [(region, None), (None, band.clone()), (region, band)] {
        let options = SpotOptions { region, band, ..SpotOptions::default() };
        assert_at(&detect(&on, &off, &options).unwrap(), 50.4, 60.7, 0.2);
    }
}

#[test]
fn frames_without_noise_work() {
    let room = Light::room(80, 60);
    let silent = Camera { read: 0.0, ..CAMERA };
    let mut random = Random::new(12);
    let off = room.shoot(&silent, &mut random);
    assert!(matches!(detect(&off, &off, &SpotOptions::default()), Err(Error::NotFound { .. })));
    for amplitude in [6.0, 40.0, 150.0] {
        let on = room.with_spot(30.37, 25.81, amplitude, 1.3).shoot(&silent, &mut random);
        let spot = detect(&on, &off, &SpotOptions::default()).unwrap();
        assert_at(&spot, 30.37, 25.81, 0.6 / amplitude + 0.005);
        assert!(spot.covariance[0] > 0.0);
    }
    // All black, and all white, where nothing can be seen.
    let black = Light::new(80, 60, |_, _| 0.0);
    let on = black.with_spot(40.0, 30.0, 90.0, 1.5).shoot(&silent, &mut random);
    assert_at(&detect(&on, &black.shoot(&silent, &mut random), &SpotOptions::default()).unwrap(), 40.0, 30.0, 0.05);
    let white = Light::new(80, 60, |_, _| 300.0);
    let on = white.with_spot(40.0, 30.0, 90.0, 1.5).shoot(&silent, &mut random);
    assert!(detect(&on, &white.shoot(&silent, &mut random), &SpotOptions::default()).is_err());
}

#[test]
fn hot_pixels_lines_and_large_patches_are_no_spots() {
    let mut random = Random::new(13);
    let room = Light::room(120, 90);
    let refused = |light: Light, random: &mut Random| {
        let result = shoot_and_detect(&light, &room, &CAMERA, random);
        assert!(matches!(result, Err(Error::NotFound { .. } | Error::Ambiguous { .. })), "{result:?}");
    };
    for _ in 0..20 {
        let [x, y] = [random.uniform(10.0, 110.0).round(), random.uniform(10.0, 80.0).round()];
        refused(room.with(|u, v| if u == x && v == y { 90.0 } else { 0.0 }), &mut random);
        let slope = random.uniform(-1.0, 1.0);
        let line = |u: f64, v: f64| 90.0 * (-(v - y - slope * (u - x)).powi(2) / 3.0).exp();
        refused(room.with(line), &mut random);
        // A line that is broken by what it falls on.
        refused(room.with(|u, v| if ((u / 9.0) as u32).is_multiple_of(3) { 0.0 } else { line(u, v) }), &mut random);
        refused(room.with(|u, v| if (u - x).abs() < 30.0 && (v - y).abs() < 50.0 { 60.0 } else { 0.0 }), &mut random);
    }
}

#[test]
fn a_misshapen_spot_has_a_larger_covariance() {
    let mut random = Random::new(14);
    let room = Light::room(96, 72);
    let trace = |s: &Spot| s.covariance[0] + s.covariance[2];
    for _ in 0..20 {
        let [x, y] = [random.uniform(30.0, 60.0), random.uniform(25.0, 45.0)];
        let round = shoot_and_detect(&room.with_spot(x, y, 80.0, 1.5), &room, &CAMERA, &mut random).unwrap();
        let comet = room.with_spot(x, y, 80.0, 1.3).with_spot(x + 3.5, y, 35.0, 2.5);
        let Ok(comet) = shoot_and_detect(&comet, &room, &CAMERA, &mut random) else { continue };
        assert!(trace(&comet) > 20.0 * trace(&round), "{round:?} {comet:?}");
    }
}

#[test]
fn a_single_grey_image_is_searched_strictly() {
    let mut random = Random::new(15);
    let wall = Light::new(160, 120, |x, y| 70.0 + 0.1 * x + 0.15 * y);
    let alone = |light: &Light, random: &mut Random| {
        detect_spot(&[light.shoot(&CAMERA, random).view().unwrap()], &[], &SpotOptions::default())
    };
    for _ in 0..20 {
        let [x, y] = [random.uniform(5.0, 60.0), random.uniform(5.0, 115.0)];
        let lit = wall.with_spot(x, y, 120.0, 1.6);
        assert_at(&alone(&lit, &mut random).unwrap(), x, y, 0.3);
        let two = alone(&lit.with_spot(x + 80.0, y, 80.0, 1.6), &mut random);
        assert!(matches!(two, Err(Error::Ambiguous { .. })), "{two:?}");
        let none = alone(&wall, &mut random);
        assert!(matches!(none, Err(Error::NotFound { .. })), "{none:?}");
    }
}

#[test]
fn senseless_input_is_refused_and_nothing_panics() {
    let mut random = Random::new(16);
    let grey = |w: u32, h: u32| Image::new(PixelFormat::Gray8, w, h);
    let (small, large) = (grey(8, 8), grey(9, 8));
    let rgb = Image::new(PixelFormat::Rgb24, 8, 8);
    let invalid = |result: Result<Spot>| assert!(matches!(result, Err(Error::InvalidArgument { .. })), "{result:?}");
    let options = SpotOptions::default();
    invalid(detect_spot(&[], &[], &options));
    invalid(detect(&small, &large, &options));
    invalid(detect(&small, &rgb, &options));
    let view = small.view().unwrap();
    invalid(detect_spot(&[view, large.view().unwrap()], &[view], &options));
    invalid(detect_spot(&[view], &vec![view; 300], &options));
    for (min_signal_to_noise, max_area, ambiguity_ratio) in
        [(f64::NAN, 9, 0.5), (-1.0, 9, 0.5), (8.0, 0, 0.5), (8.0, 9, f64::NAN), (8.0, 9, -0.5), (8.0, 9, 0.0)]
    {
        let options = SpotOptions { min_signal_to_noise, max_area, ambiguity_ratio, ..SpotOptions::default() };
        invalid(detect(&small, &small, &options));
    }
    let region = Some(Region { x: 8, y: 0, width: 4, height: 4 });
    invalid(detect(&small, &small, &SpotOptions { region, ..options.clone() }));
    let band = Some(Band { polyline: vec![[0.0, 0.0], [f64::NAN, 4.0]], half_width: 2.0 });
    let result = detect(&small, &small, &SpotOptions { band, ..options.clone() });
    assert!(matches!(result, Err(Error::NotFinite { .. })));

    // Any size, format and content: random bytes, flat ones, and single changed pixels.
    use PixelFormat::*;
    for i in 0..3000 {
        let format = [Gray8, Rgb24, Bgr24, Rgba32, Bgra32, Yuyv, Nv12, I420][i % 8];
        let mut side = || 1 + (random.uniform(0.0, 1.0).powi(3) * 40.0) as u32;
        let (w, h) = (side(), side());
        let w = if format == Yuyv { w + w % 2 } else { w };
        let level = random.uniform(0.0, 256.0) as u8;
        let mut fill = |kind: usize| {
            let mut image = Image::new(format, w, h);
            let n = image.data.len();
            match kind {
                0 => image.data.iter_mut().for_each(|b| *b = random.uniform(0.0, 256.0) as u8),
                1 => image.data.fill(level),
                _ => {
                    image.data.fill(level / 2);
                    for _ in 0..6 {
                        image.data[random.uniform(0.0, n as f64) as usize] = random.uniform(0.0, 256.0) as u8;
                    }
                }
            }
            image
        };
        let (on, off) = (fill(i / 8 % 3), fill(i / 24 % 3));
        let colour = [LaserColour::Unknown, LaserColour::Red, LaserColour::Blue, LaserColour::White][i / 72 % 4];
        let options = SpotOptions { colour, min_signal_to_noise: [0.0, 8.0][i % 2], ..SpotOptions::default() };
        let results = [detect(&on, &off, &options), detect_spot(&[on.view().unwrap()], &[], &options)];
        for s in results.into_iter().flatten() {
            let [xx, xy, yy] = s.covariance;
            assert!(s.x.is_finite() && s.y.is_finite() && xx > 0.0 && xx * yy > xy * xy, "{s:?}");
        }
    }
}
