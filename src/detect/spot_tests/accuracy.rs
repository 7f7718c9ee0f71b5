//! How near the centre is to the truth, and whether its covariance says so.

use super::render::*;
use crate::detect::spot::*;
use crate::error::Error;
use crate::image::{Image, ImageView};

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
