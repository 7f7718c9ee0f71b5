//! 30 % gross outliers in 2021 laser shots: how often does the calibration fail?

use nalgebra::{Matrix2, Vector2};
use ptzcal::calibrate::{CalibrationOptions, Correspondences, Observation, calibrate_camera};

use super::figure::Figure;
use super::thesis::{Noise, near, rig, world};

pub fn run(runs: usize, report: &mut impl FnMut(Vec<Figure>)) {
    let truth = near();
    let shots = world(&truth, 2021);
    let rig = rig();
    let sigma = 0.5;
    let covariance = Matrix2::identity() * (sigma * sigma);
    let mut failures = 0;
    let mut worst = 0.0f64;
    for run in 0..runs {
        let mut noise = Noise::new(7000 + run as u64);
        let mut set = Correspondences::new(800, 600).expect("a size");
        for s in &shots {
            // Half of the outliers are wrong in the fixed camera, half in the head camera.
            let (bad_fixed, bad_head) = (noise.uniform() < 0.15, noise.uniform() < 0.15 / 0.85);
            let mut spot = s.head + noise.pixel(sigma);
            let mut pixel = s.fixed + noise.pixel(sigma);
            if bad_fixed {
                pixel = Vector2::new(noise.uniform() * 800.0, noise.uniform() * 600.0);
            } else if bad_head {
                spot = Vector2::new(340.0 + noise.uniform() * 200.0, 288.0 + 4.0 * noise.gaussian());
            }
            let shot = rig.measure(s.pan, s.tilt, &spot, &covariance).expect("a depth").point;
            set.add(Observation::Shot { shot, pixel, pixel_covariance: covariance }).expect("a shot");
        }
        let options = CalibrationOptions { seed: run as u64, ..Default::default() };
        match calibrate_camera(&set, &options) {
            Ok(c) => {
                let error = (c.camera.centre() - truth.centre()).norm();
                worst = worst.max(error);
                // Ten times the bound of the whole set.
                failures += usize::from(error > 4e-3);
            }
            Err(_) => failures += 1,
        }
    }
    report(vec![Figure {
        goal: "30 %",
        setup: format!("NEAR, 2021 shots, 0.5 px, worst centre {:.2} mm: failures", worst * 1e3),
        figure: failures as f64,
        unit: "",
        bound: 0.0,
        ratio: failures as f64,
        limit: 0.0,
        runs,
    }]);
}
