//! The whole way in the simulator: a scan, and the fixed cameras calibrated from it.

use std::ops::ControlFlow::Continue;
use std::time::Instant;

use crate::adjust::{Adjustment, CameraSetup, Station};
use crate::calibrate::{CalibrationOptions, DistortionModel, calibrate_camera};
use crate::control::{Log, LogLevel};
use crate::device::recording::Recording;
use crate::error::Result;
use crate::rig::*;
use crate::sim::{SimOptions, Simulator, SpotTruth};

fn rig(simulator: &Simulator, options: RigOptions) -> Rig {
    let parts = RigParts {
        model: simulator.nominal_rig(),
        ptz: Box::new(simulator.ptz()),
        laser: Box::new(simulator.laser()),
        frames: Box::new(simulator.head_frames()),
        clock: simulator.clock(),
        log: Log::to(|level, message| {
            if level != LogLevel::Debug {
                println!("{level:?}: {message}");
            }
        }),
    };
    Rig::open(parts, options).unwrap()
}

fn fixed(simulator: &Simulator) -> Vec<FixedCamera> {
    let camera = |(i, camera): (usize, &crate::geometry::Camera)| FixedCamera {
        distortion: DistortionModel::Radial2,
        ..FixedCamera::new(Box::new(simulator.fixed_frames(i).unwrap()), camera.width, camera.height)
    };
    simulator.truth().fixed.iter().enumerate().map(camera).collect()
}

/// The thesis's region: pan -29 to 25, tilt -21 to 19 degrees.
fn region(pan_steps: u32, tilt_steps: u32) -> ScanRegion {
    ScanRegion {
        pan: [-29.0, 25.0].map(f64::to_radians),
        tilt: [-21.0, 19.0].map(f64::to_radians),
        pan_steps,
        tilt_steps,
    }
}

/// Spots found by each camera, the head's first, and those more than 1.5 px from the truth.
fn compare(scan: &Scan, truths: &[SpotTruth]) -> Vec<(usize, usize)> {
    let mut sums = vec![(0, 0); 1 + scan.fixed_sizes.len()];
    for (shot, truth) in scan.shots.iter().zip(truths) {
        let seen = std::iter::once((&shot.head, &truth.head)).chain(shot.fixed.iter().zip(&truth.fixed));
        for ((camera, (sighting, pixel)), sum) in seen.enumerate().zip(&mut sums) {
            let Ok(spot) = sighting else { continue };
            sum.0 += 1;
            let off = pixel.map_or(f64::INFINITY, |p| (p.x - spot.x).hypot(p.y - spot.y));
            if off > 1.5 {
                println!("camera {camera}, shot {}: {off:.1} px off, {spot:?}", shot.index);
                sum.1 += 1;
            }
        }
    }
    sums
}

/// Error of a calibrated camera's centre, metres, and relative error of its focal length.
#[derive(Debug)]
struct CameraError {
    centre: f64,
    focal: f64,
}

/// Scans and calibrates the fixed cameras.
fn run(address: &str, region: &ScanRegion) -> (Scan, Vec<Result<CameraError>>) {
    let simulator = Simulator::new(SimOptions::parse(address).unwrap()).unwrap();
    let mut rig = rig(&simulator, RigOptions::default());
    let start = Instant::now();
    let options = ScanOptions::default();
    let mut truths = Vec::new();
    let scan = scan_region(&mut rig, region, &options, &mut fixed(&simulator), &mut |p| {
        // The head still stands there.
        truths.extend(p.shot.map(|_| simulator.spot_truth()));
        Continue(())
    })
    .unwrap();
    println!(
        "{address}: {} shots in {:.1} s ({:.0} s of the rig's time), {:?}, {:?}",
        scan.shots.len(),
        start.elapsed().as_secs_f64(),
        simulator.clock().now(),
        scan.counts(),
        scan.end,
    );
    for (i, (found, wrong)) in compare(&scan, &truths).into_iter().enumerate() {
        println!("camera {i}: {found} spots, {wrong} wrong");
        // A person who walks on between shot and truth makes one differ.
        assert!(wrong <= 1 + found / 50, "camera {i}: {wrong} of {found} spots are wrong");
    }
    let errors = simulator
        .truth()
        .fixed
        .iter()
        .enumerate()
        .map(|(i, truth)| {
            let options = CalibrationOptions { distortion: DistortionModel::Radial2, ..CalibrationOptions::default() };
            let c = calibrate_camera(&scan.correspondences(i)?, &options)?;
            let centre = (c.camera.centre() - truth.centre()).norm();
            let focal = (c.camera.intrinsics.fx / truth.intrinsics.fx - 1.0).abs();
            println!("fixed camera {i}: centre off by {:.2} mm, focal length by {:.3} %", centre * 1e3, focal * 100.0);
            Ok(CameraError { centre, focal })
        })
        .collect();
    (scan, errors)
}

#[test]
fn a_scan_ends_once_its_camera_is_known_well_enough() {
    let simulator = Simulator::new(SimOptions::parse("sim:room").unwrap()).unwrap();
    let near = |simulator: &Simulator| fixed(simulator).into_iter().take(1).collect::<Vec<_>>();
    let run = |target_accuracy| {
        let options = ScanOptions { target_accuracy, ..ScanOptions::default() };
        let mut rig = rig(&simulator, RigOptions::default());
        scan_region(&mut rig, &region(20, 16), &options, &mut near(&simulator), &mut |_| Continue(()))
    };
    let scan = run(0.002).unwrap();
    assert_eq!(scan.end, ScanEnd::TargetMet);
    assert!(!scan.is_complete() && scan.shots.len() > 80 && scan.shots.len() < 300, "{}", scan.shots.len());
    let options = CalibrationOptions { distortion: DistortionModel::Radial2, ..CalibrationOptions::default() };
    let found = calibrate_camera(&scan.correspondences(0).unwrap(), &options).unwrap();
    let off = (found.camera.centre() - simulator.truth().fixed[0].centre()).norm();
    // Three times the wanted rms: but for one scan in some hundreds.
    assert!(off < 0.006, "{off}");
    // What is left of the region lies between what was visited.
    let visited = |rows: std::ops::Range<u32>| scan.shots.iter().any(|s| rows.contains(&(s.index / 20)));
    assert!((0..16).step_by(4).all(|row| visited(row..row + 4)));
    let mut path: Vec<u32> = (0..20).collect();
    super::super::scan::spread(&mut path);
    assert_eq!(path, [0, 8, 16, 4, 12, 2, 10, 18, 6, 14, 1, 9, 17, 5, 13, 3, 11, 19, 7, 15]);
    for target in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(run(target).is_err());
    }
    // A target that is out of reach changes nothing but the order.
    assert!(run(1e-9).unwrap().is_complete());
}

#[test]
fn a_small_scan_calibrates_the_simulated_cameras() {
    let (scan, errors) = run("sim:room", &region(14, 11));
    assert!(scan.is_complete() && scan.counts().head > 120, "{:?}", scan.counts());
    let [near, far] = <[_; 2]>::try_from(errors).unwrap().map(std::result::Result::unwrap);
    assert!(near.centre < 3e-3 && near.focal < 0.003, "{near:?}");
    assert!(far.centre < 20e-3 && far.focal < 0.01, "{far:?}");

    // Its shots in a joint adjustment: one fixed camera under another number, the other left out.
    let mut input = Adjustment::new(scan.model).unwrap();
    input.add_station(Station::world()).unwrap();
    let camera = |(width, height)| CameraSetup::new(width, height);
    for _ in 0..2 {
        input.add_camera(camera(scan.fixed_sizes[0])).unwrap();
    }
    assert_eq!(scan.add_to(&mut input, 0, &[Some(1), None]), Ok(0));
    let (counts, shots) = (scan.counts(), input.shots());
    assert_eq!(shots.len(), counts.shots);
    assert_eq!(shots.iter().filter(|s| s.head.is_some()).count(), counts.head);
    let seen: Vec<&crate::adjust::Sighting> = shots.iter().flat_map(|s| &s.sightings).collect();
    assert!(seen.len() == counts.fixed[0] && seen.iter().all(|s| s.camera == 1));
    for (shot, from) in shots.iter().zip(&scan.shots) {
        assert_eq!((shot.station, shot.pan, shot.tilt), (0, from.pan, from.tilt));
        assert_eq!(shot.head.map(|h| [h.0.x, h.0.y]), from.head.ok().map(|h| [h.x, h.y]));
    }
    input.add_camera(camera((640, 480))).unwrap();
    let before = input.clone();
    for (station, cameras) in
        [(1, &[Some(1), None][..]), (0, &[Some(1)]), (0, &[Some(3), None]), (0, &[Some(2), None]), (0, &[Some(0); 2])]
    {
        assert!(scan.add_to(&mut input, station, cameras).is_err());
        assert_eq!(input, before);
    }
}

#[test]
fn lies_people_and_drift_do_not_spoil_a_scan() {
    let (scan, errors) = run("sim:room?ptz_lies=1&person=1&drift=0.1&seed=5", &region(10, 8));
    assert!(scan.is_complete());
    // What the other camera sees of so few shots does not calibrate it.
    let near = errors[0].as_ref().unwrap();
    assert!(near.centre < 5e-3 && near.focal < 0.005, "{near:?}");
}

/// A recorded scan, scanned again from its folder, measures the same.
#[test]
fn a_recording_is_scanned_like_the_rig() {
    for (frames_per_state, address) in [(1, "sim:room?seed=5"), (3, "sim:room?seed=6&format=yuyv")] {
        let folder = tempfile::tempdir().unwrap();
        let simulator = Simulator::new(SimOptions::parse(address).unwrap()).unwrap();
        let mut rig = rig(&simulator, RigOptions::default());
        let options = ScanOptions { frames_per_state, record: Some(folder.path().into()), ..ScanOptions::default() };
        let scan =
            scan_region(&mut rig, &region(6, 4), &options, &mut fixed(&simulator), &mut |_| Continue(())).unwrap();
        assert_eq!(scan.end, ScanEnd::Complete);

        let recording = Recording::open(folder.path()).unwrap();
        let info = recording.info();
        let parts = RigParts {
            model: info.rig,
            ptz: Box::new(recording.ptz()),
            laser: Box::new(recording.laser()),
            frames: Box::new(recording.frames(0).unwrap()),
            clock: recording.clock(),
            log: Log::silent(),
        };
        let mut again = Rig::open(parts, RigOptions::default()).unwrap();
        let mut cameras: Vec<FixedCamera> = info.cameras[1..]
            .iter()
            .enumerate()
            .map(|(i, (w, h))| FixedCamera {
                distortion: DistortionModel::Radial2,
                ..FixedCamera::new(Box::new(recording.frames(1 + i).unwrap()), *w, *h)
            })
            .collect();
        let options = ScanOptions { record: None, ..options };
        let replayed = scan_region(&mut again, &region(6, 4), &options, &mut cameras, &mut |_| Continue(())).unwrap();
        assert_eq!(replayed.end, ScanEnd::Complete);
        assert_eq!(replayed.shots.len(), scan.shots.len());
        for (a, b) in scan.shots.iter().zip(&replayed.shots) {
            assert_eq!((a.index, a.pan, a.tilt), (b.index, b.pan, b.tilt));
            for (a, b) in std::iter::once((&a.head, &b.head)).chain(a.fixed.iter().zip(&b.fixed)) {
                match (a, b) {
                    (Ok(a), Ok(b)) => assert!((a.x - b.x).hypot(a.y - b.y) < 1e-6, "{a:?} {b:?}"),
                    (a, b) => assert_eq!(a, b),
                }
            }
        }
    }
}
