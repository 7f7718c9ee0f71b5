//! The whole way in the simulator: scan with default noise, detect, calibrate, compare with the truth.

use std::ops::ControlFlow;

use ptzcal::calibrate::{CalibrationOptions, DistortionModel, calibrate_camera};
use ptzcal::control::Log;
use ptzcal::rig::{FixedCamera, Rig, RigOptions, RigParts, ScanOptions, ScanRegion, scan_region};
use ptzcal::sim::{SimOptions, Simulator};

use super::Figure;

pub fn run(report: &mut impl FnMut(Vec<Figure>)) {
    for seed in [1, 2, 3] {
        match scan(seed) {
            Ok(figures) => report(figures),
            Err(e) => println!("sim:room?seed={seed}: {e}"),
        }
    }
}

/// 2021 shots with two fixed cameras watching.
fn scan(seed: u64) -> ptzcal::Result<Vec<Figure>> {
    let simulator = Simulator::new(SimOptions { seed, ..Default::default() })?;
    let parts = RigParts {
        model: simulator.nominal_rig(),
        ptz: Box::new(simulator.ptz()),
        laser: Box::new(simulator.laser()),
        frames: Box::new(simulator.head_frames()),
        clock: simulator.clock(),
        log: Log::silent(),
    };
    let mut rig = Rig::open(parts, RigOptions::default())?;
    let truth = simulator.truth().fixed;
    let mut fixed = Vec::new();
    for (i, camera) in truth.iter().enumerate() {
        fixed.push(FixedCamera::new(Box::new(simulator.fixed_frames(i)?), camera.width, camera.height));
    }
    let region = ScanRegion {
        pan: [-26f64, 23.0].map(f64::to_radians),
        tilt: [-20f64, 18.0].map(f64::to_radians),
        pan_steps: 47,
        tilt_steps: 43,
    };
    let scan = scan_region(&mut rig, &region, &ScanOptions::default(), &mut fixed, &mut |_| ControlFlow::Continue(()))?;
    let mut figures = Vec::new();
    for (i, (name, truth)) in ["NEAR", "FAR"].iter().zip(&truth).enumerate() {
        let options = CalibrationOptions { distortion: DistortionModel::Radial2, ..Default::default() };
        let c = calibrate_camera(&scan.correspondences(i)?, &options)?;
        let centre = (c.camera.centre() - truth.centre()).norm() * 1e3;
        let focal = (c.camera.intrinsics.fx / truth.intrinsics.fx - 1.0).abs() * 100.0;
        let figure = |what: &str, figure: f64, unit, bound: f64| Figure {
            goal: "e2e",
            setup: format!(
                "sim:room seed {seed}, {name}, {} shots used: {what}",
                c.inliers.iter().filter(|i| **i).count()
            ),
            figure,
            unit,
            bound,
            ratio: figure / bound,
            limit: 1.0,
            runs: 1,
        };
        figures.push(figure("centre off by", centre, "mm", 3.0));
        figures.push(figure("focal length off by", focal, "%", 0.3));
    }
    Ok(figures)
}
