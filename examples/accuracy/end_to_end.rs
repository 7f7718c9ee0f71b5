//! The whole way in the simulator: scan with default noise, detect, calibrate, compare with the truth.

use std::ops::ControlFlow;

use ptzcal::calibrate::{CalibrationOptions, DistortionModel, calibrate_camera};
use ptzcal::control::Log;
use ptzcal::rig::{FixedCamera, Rig, RigOptions, RigParts, ScanOptions, ScanRegion, scan_region};
use ptzcal::sim::{SimOptions, Simulator};

use super::figure::Figure;

/// What each fixed camera sees of the room, as the rig's pan and tilt in degrees.
const REGIONS: [(&str, [f64; 2], [f64; 2]); 2] =
    [("NEAR", [-26.0, 14.0], [-19.0, 16.0]), ("FAR", [-20.0, 34.0], [-17.0, 12.0])];

pub fn run(report: &mut impl FnMut(Vec<Figure>)) {
    for camera in 0..REGIONS.len() {
        for seed in [1, 2, 3] {
            match scan(camera, seed) {
                Ok(figures) => report(figures),
                Err(e) => println!("sim:room?seed={seed}: {e}"),
            }
        }
    }
}

/// 2021 shots over what one fixed camera sees.
fn scan(camera: usize, seed: u64) -> ptzcal::Result<Vec<Figure>> {
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
    let truth = simulator.truth().fixed[camera];
    let mut fixed = [FixedCamera::new(Box::new(simulator.fixed_frames(camera)?), truth.width, truth.height)];
    let (name, pan, tilt) = REGIONS[camera];
    let region =
        ScanRegion { pan: pan.map(f64::to_radians), tilt: tilt.map(f64::to_radians), pan_steps: 47, tilt_steps: 43 };
    let scan = scan_region(&mut rig, &region, &ScanOptions::default(), &mut fixed, &mut |_| ControlFlow::Continue(()))?;
    let options = CalibrationOptions { distortion: DistortionModel::Radial2, ..Default::default() };
    let c = calibrate_camera(&scan.correspondences(0)?, &options)?;
    let centre = (c.camera.centre() - truth.centre()).norm() * 1e3;
    let focal = (c.camera.intrinsics.fx / truth.intrinsics.fx - 1.0).abs() * 100.0;
    let used = c.inliers.iter().filter(|i| **i).count();
    let figure = |what: &str, figure: f64, unit, bound: f64| Figure {
        goal: "e2e",
        setup: format!("sim:room seed {seed}, {name}, {used} shots used: {what}"),
        figure,
        unit,
        bound,
        ratio: figure / bound,
        limit: 1.0,
        runs: 1,
    };
    Ok(vec![figure("centre off by", centre, "mm", 3.0), figure("focal length off by", focal, "%", 0.3)])
}
