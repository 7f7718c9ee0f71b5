//! The health check from pictures: shots fired in the simulator's room, a fixed camera that somebody
//! moves, the same shots fired again.

use std::ops::ControlFlow::{Break, Continue};

use nalgebra::{Vector3, Vector6};
use ptzcal::calibrate::{Calibration, CalibrationOptions, DistortionModel, calibrate_camera};
use ptzcal::control::Log;
use ptzcal::health::{HealthOptions, HealthReport, Verdict, check_health, choose_shots, pair_shots};
use ptzcal::rig::{FixedCamera, Rig, RigOptions, RigParts, Scan, ScanOptions, ScanRegion, fire_shots, scan_region};
use ptzcal::sim::{SimOptions, Simulator};

struct Room {
    simulator: Simulator,
    rig: Rig,
    fixed: Vec<FixedCamera>,
    calibration: Calibration,
    before: Scan,
    readings: Vec<(f64, f64)>,
}

impl Room {
    fn new(seed: u64) -> Self {
        let simulator = Simulator::new(SimOptions { seed, ..SimOptions::default() }).unwrap();
        let parts = RigParts {
            model: simulator.nominal_rig(),
            ptz: Box::new(simulator.ptz()),
            laser: Box::new(simulator.laser()),
            frames: Box::new(simulator.head_frames()),
            clock: simulator.clock(),
            log: Log::silent(),
        };
        let mut rig = Rig::open(parts, RigOptions::default()).unwrap();
        let camera = simulator.truth().fixed[0];
        let mut fixed =
            vec![FixedCamera::new(Box::new(simulator.fixed_frames(0).unwrap()), camera.width, camera.height)];
        let region = ScanRegion { pan: [-0.5, 0.33], tilt: [-0.34, 0.3], pan_steps: 14, tilt_steps: 10 };
        let before =
            scan_region(&mut rig, &region, &ScanOptions::default(), &mut fixed, &mut |_| Continue(())).unwrap();
        let set = before.correspondences(0).unwrap();
        // With the room's kind of lens: a wrong one moves spots as no camera does.
        let options = CalibrationOptions { distortion: DistortionModel::Radial2, ..CalibrationOptions::default() };
        let calibration = calibrate_camera(&set, &options).unwrap();
        let chosen = choose_shots(&before, 0, 10).unwrap();
        let readings = chosen.iter().map(|i| (before.shots[*i].pan, before.shots[*i].tilt)).collect();
        Self { simulator, rig, fixed, calibration, before, readings }
    }

    /// The check after firing again; given up after `most` shots.
    fn check(&mut self, most: usize) -> HealthReport {
        let options = ScanOptions::default();
        let again = fire_shots(&mut self.rig, &self.readings, &options, &mut self.fixed, &mut |p| {
            if p.done == most { Break(()) } else { Continue(()) }
        });
        let shots = pair_shots(&self.before, &again.unwrap(), 0).unwrap();
        check_health(&self.simulator.nominal_rig(), &self.calibration, &shots, &HealthOptions::default()).unwrap()
    }
}

#[test]
fn a_camera_is_unchanged_moved_or_it_cannot_be_told() {
    for seed in 1..=3 {
        let mut room = Room::new(seed);
        let report = room.check(10);
        assert_eq!(report.verdict, Verdict::Unchanged, "{}", report.reason);
        assert!(report.statistic.unwrap().probability > 1e-3 && report.refitted.is_none());
        let few = room.check(3);
        assert_eq!(few.verdict, Verdict::CannotTell, "{}", few.reason);
        assert!(few.statistic.is_none() && few.refitted.is_none());

        let (turn, shift) = (Vector3::new(0.006, -0.011, 0.004), Vector3::new(0.02, -0.015, 0.01));
        room.simulator.move_fixed_camera(0, &turn, &shift).unwrap();
        let report = room.check(10);
        assert_eq!(report.verdict, Verdict::CameraMoved, "{}", report.reason);
        assert!(report.statistic.unwrap().probability < 1e-6);
        let (change, covariance) = report.change.unwrap();
        let error = change - Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z);
        let nees = error.dot(&(covariance.try_inverse().unwrap() * error));
        println!(
            "seed {seed}: turn to {:.4} deg, centre to {:.2} mm, NEES {nees:.1} of 6",
            error.fixed_rows::<3>(0).norm().to_degrees(),
            error.fixed_rows::<3>(3).norm() * 1e3
        );
        // Chi-square with 6 degrees of freedom exceeds 22.5 once in a thousand.
        assert!(nees < 22.5, "{error:?}");
        assert!(report.refitted.is_some());
    }
}

#[test]
fn a_camera_that_is_not_there_is_not_moved() {
    let simulator = Simulator::new(SimOptions::default()).unwrap();
    let (none, nan) = (Vector3::zeros(), Vector3::new(0.0, f64::NAN, 0.0));
    assert!(simulator.move_fixed_camera(2, &none, &none).is_err());
    assert!(simulator.move_fixed_camera(0, &nan, &none).is_err());
}
