//! What is no spot, and what disturbs one: people, drift, reflections, hot pixels, bad input.

use super::render::*;
use crate::detect::spot::*;
use crate::error::{Error, Result};
use crate::image::{Image, PixelFormat};

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
