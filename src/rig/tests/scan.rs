//! Small scans with the fake rig.

use std::ops::ControlFlow::{self, Break, Continue};
use std::path::PathBuf;

use nalgebra::Vector2;

use crate::calibrate::{CalibrationOptions, calibrate_camera};
use crate::control::Clock;
use crate::detect::spot::SpotOptions;
use crate::error::Error;
use crate::rig::fake::{Event, Fake, Habits, SIZE, fixed_camera, laser_hit, model};
use crate::rig::*;

/// A journal's path, removed afterwards.
pub struct Scratch(pub PathBuf, #[expect(dead_code, reason = "removes the directory")] tempfile::TempDir);

impl Scratch {
    pub fn new() -> Self {
        let directory = tempfile::tempdir().unwrap();
        Self(directory.path().join("scan.journal"), directory)
    }
}

pub fn region(pan_steps: u32, tilt_steps: u32) -> ScanRegion {
    ScanRegion { pan: [-0.3, 0.3], tilt: [-0.22, 0.16], pan_steps, tilt_steps }
}

pub fn fixed(fake: &Fake, cameras: usize) -> Vec<FixedCamera> {
    (0..cameras)
        .map(|i| FixedCamera {
            distortion: crate::calibrate::DistortionModel::None,
            ..FixedCamera::new(fake.fixed_frames(i), SIZE.0, SIZE.1)
        })
        .collect()
}

fn on(_: &Progress<'_>) -> ControlFlow<()> {
    Continue(())
}

pub fn journalled(scratch: &Scratch) -> ScanOptions {
    ScanOptions { journal: Some(scratch.0.clone()), journal_sync: false, ..ScanOptions::default() }
}

/// Every spot is where the laser's point is seen, every point where it is.
fn check_truth(scan: &Scan) {
    for shot in &scan.shots {
        let hit = laser_hit(shot.pan, shot.tilt);
        if let Ok(spot) = shot.head {
            let truth = model().head_camera(shot.pan, shot.tilt).project(&hit).unwrap();
            assert!((Vector2::new(spot.x, spot.y) - truth).norm() < 0.2, "{shot:?} {truth}");
            let point = shot.point.unwrap().point;
            let depth = model().head_camera(shot.pan, shot.tilt).pose.apply(&hit).z;
            assert!((point.rho - 1.0 / depth).abs() < 6.0 * point.variance.sqrt(), "{shot:?}");
        }
        for (i, spot) in shot.fixed.iter().enumerate().filter_map(|(i, s)| Some((i, s.ok()?))) {
            let truth = fixed_camera(i).project(&hit).unwrap();
            assert!((Vector2::new(spot.x, spot.y) - truth).norm() < 0.2, "{i} {shot:?} {truth}");
        }
    }
}

/// The head only moves with the laser off.
pub fn check_history(fake: &Fake) {
    let mut on = false;
    for event in &fake.world().history {
        match event {
            Event::Laser(state) => on = *state,
            Event::Move(..) => assert!(!on, "moved with the laser on"),
            _ => {}
        }
    }
    assert!(!fake.world().laser_lit);
}

#[test]
fn a_scan_measures_the_room_and_its_cameras() {
    let fake = Fake::new();
    let mut rig = fake.rig();
    let region = region(12, 9);
    let options = ScanOptions { coarse_shots: 30, ..ScanOptions::default() };
    let (mut calls, mut left, start) = (0, Vec::new(), fake.now());
    let scan = scan_region(&mut rig, &region, &options, &mut fixed(&fake, 2), &mut |p| {
        assert_eq!((p.done, p.total), (calls, 108));
        assert_eq!(p.shot.is_some(), calls > 0);
        calls += 1;
        left.extend(p.seconds_left.map(|left| (fake.now() - start, left)));
        Continue(())
    })
    .unwrap();
    assert!(scan.is_complete() && calls == 109);
    let (total, at_end) = left[107];
    assert!(at_end == 0.0 && left[10..].iter().all(|(past, left)| ((past + left) / total - 1.0).abs() < 0.4));
    check_history(&fake);
    check_truth(&scan);
    let counts = scan.counts();
    assert!(counts.head >= 105 && counts.fixed.iter().all(|n| *n >= 100), "{counts:?}");
    assert!(scan.search_calibrations.iter().all(Option::is_some));

    for (i, found) in counts.fixed.iter().enumerate() {
        let set = scan.correspondences(i).unwrap();
        assert!(set.len() > 98 && set.len() <= *found);
        let options = CalibrationOptions { distortion: crate::calibrate::DistortionModel::None, ..Default::default() };
        let calibration = calibrate_camera(&set, &options).unwrap();
        let truth = fixed_camera(i);
        let error = (calibration.camera.centre() - truth.centre()).norm();
        assert!(error < 0.05, "camera {i}: centre off by {error} m");
    }
    assert!(scan.correspondences(2).is_err());
    let points = scan.points();
    assert!(points.len() >= 105);
    for p in &points {
        let shot = &scan.shots[p.shot];
        let off = p.position - laser_hit(shot.pan, shot.tilt);
        // Along the laser's line, within its own uncertainty.
        assert!(off.norm() < 6.0 * p.covariance.trace().sqrt() + 1e-3, "{shot:?} {off}");
        assert!(p.colour[0] > 30 && p.colour[0] < 160, "the colour is that with the laser off");
    }
}

#[test]
fn a_scan_is_the_same_every_time() {
    let scan = || {
        let fake = Fake::new();
        scan_region(&mut fake.rig(), &region(5, 3), &ScanOptions::default(), &mut fixed(&fake, 1), &mut on).unwrap()
    };
    assert_eq!(scan().shots, scan().shots);
}

#[test]
fn frames_without_timestamps_are_dropped_until_they_are_new() {
    let fake = Fake::with(Habits { stamped: false, ..Habits::default() });
    let scan =
        scan_region(&mut fake.rig(), &region(4, 3), &ScanOptions::default(), &mut fixed(&fake, 1), &mut on).unwrap();
    assert!(scan.is_complete() && scan.counts().head >= 11, "{:?}", scan.counts());
    check_truth(&scan);
}

#[test]
fn several_frames_are_averaged() {
    let variance = |frames_per_state| {
        let fake = Fake::new();
        let options = ScanOptions { frames_per_state, ..ScanOptions::default() };
        let scan = scan_region(&mut fake.rig(), &region(4, 3), &options, &mut fixed(&fake, 1), &mut on).unwrap();
        check_truth(&scan);
        assert!(scan.is_complete() && scan.counts().head >= 11);
        scan.shots.iter().filter_map(|s| Some(s.head.ok()?.covariance[0])).sum::<f64>()
    };
    let ratio = variance(1) / variance(4);
    assert!((2.5..6.0).contains(&ratio), "{ratio}");
}

#[test]
fn a_known_camera_is_gated_from_the_start() {
    let fake = Fake::new();
    let mut cameras = fixed(&fake, 2);
    cameras[0].known = Some(fixed_camera(0));
    // This one is said to look elsewhere: what it sees contradicts that, and is not taken.
    let mut wrong = fixed_camera(1);
    wrong.intrinsics.cx += 70.0;
    cameras[1].known = Some(wrong);
    let scan = scan_region(&mut fake.rig(), &region(5, 4), &ScanOptions::default(), &mut cameras, &mut on).unwrap();
    check_truth(&scan);
    let counts = scan.counts();
    assert!(counts.fixed[0] >= 18 && counts.fixed[1] == 0, "{counts:?}");
    assert!(scan.search_calibrations.iter().all(Option::is_none));
}

#[test]
fn cameras_without_enough_coarse_shots_are_searched_over_whole_frames_until_there_are() {
    for (steps, calibrated) in [((5, 3), false), ((8, 7), true)] {
        let fake = Fake::new();
        let options = ScanOptions { coarse_shots: 4, ..ScanOptions::default() };
        let region = region(steps.0, steps.1);
        let scan = scan_region(&mut fake.rig(), &region, &options, &mut fixed(&fake, 1), &mut on).unwrap();
        assert!(scan.is_complete() && scan.search_calibrations[0].is_some() == calibrated);
        assert!(scan.counts().fixed[0] * 10 >= region.len() * 9);
        check_truth(&scan);
    }
}

#[test]
fn a_stopped_scan_keeps_its_shots_and_resumes_from_its_journal() {
    let scratch = Scratch::new();
    let options = ScanOptions { coarse_shots: 20, ..journalled(&scratch) };
    let region = region(8, 7);
    let mut before: Vec<Shot> = Vec::new();
    let mut lit = 0;
    for stop_at in [0, 5, 19, 30, 1000] {
        let fake = Fake::new();
        let mut announced = Vec::new();
        let scan = scan_region(&mut fake.rig(), &region, &options, &mut fixed(&fake, 1), &mut |p| {
            // Acknowledged is written.
            let size = std::fs::metadata(&scratch.0).unwrap().len();
            assert_eq!(size, 44 + (44 + 2 * 64) * p.done as u64);
            announced.extend(p.shot.cloned());
            if p.done >= stop_at { Break(()) } else { Continue(()) }
        })
        .unwrap();
        check_history(&fake);
        check_truth(&scan);
        assert_eq!(scan.resumed, before.len());
        let wanted = if stop_at < 1000 { ScanEnd::Stopped } else { ScanEnd::Complete };
        assert_eq!(scan.end, wanted);
        // Marks of the coarse pass aside, old shots are what they were.
        for (old, new) in before.iter().zip(&scan.shots) {
            assert_eq!((old.index, old.head, old.point, old.colour), (new.index, new.head, new.point, new.colour));
        }
        assert_eq!(announced.len(), scan.shots.len() - before.len());
        lit += fake.world().history.iter().filter(|e| **e == Event::Laser(true)).count();
        before = scan.shots;
    }
    let mut indices: Vec<u32> = before.iter().map(|s| s.index).collect();
    indices.sort_unstable();
    assert_eq!(indices, (0..56).collect::<Vec<_>>());
    assert_eq!(lit, 56, "no position is measured twice");
}

#[test]
fn a_cut_journal_is_mended_and_said_so() {
    let scratch = Scratch::new();
    let options = journalled(&scratch);
    let run = || {
        let fake = Fake::new();
        scan_region(&mut fake.rig(), &region(3, 2), &options, &mut fixed(&fake, 1), &mut on)
    };
    assert!(run().unwrap().is_complete());
    let bytes = std::fs::read(&scratch.0).unwrap();
    std::fs::write(&scratch.0, &bytes[..bytes.len() - 10]).unwrap();
    let scan = run().unwrap();
    assert_eq!(scan.repair, Some(JournalRepair { kept: 5, damaged: 0, cut_bytes: 162 }));
    assert!(scan.is_complete() && scan.resumed == 5 && scan.shots.len() == 6);
    // Another region, or another number of cameras, is another scan.
    let fake = Fake::new();
    let other = scan_region(&mut fake.rig(), &region(3, 3), &options, &mut fixed(&fake, 1), &mut on);
    assert!(matches!(other, Err(Error::FileMismatch { .. })));
    let other = scan_region(&mut fake.rig(), &region(3, 2), &options, &mut fixed(&fake, 2), &mut on);
    assert!(matches!(other, Err(Error::FileMismatch { .. })));
    assert!(!fake.world().history.iter().any(|e| matches!(e, Event::Move(..))));
}

#[test]
fn arguments_are_checked_before_anything_moves() {
    let fake = Fake::new();
    let mut rig = fake.rig();
    let calls = fake.world().calls;
    let good = ScanOptions::default();
    let far = ScanRegion { pan: [-2.0, 0.0], ..region(3, 3) };
    let refused = |rig: &mut Rig, region: &ScanRegion, options: &ScanOptions, cameras: &mut [FixedCamera]| {
        scan_region(rig, region, options, cameras, &mut on).unwrap_err()
    };
    assert!(matches!(refused(&mut rig, &far, &good, &mut []), Error::Unreachable { .. }));
    assert!(matches!(refused(&mut rig, &region(0, 1), &good, &mut []), Error::InvalidArgument { .. }));
    let gate = |change: fn(&mut GateOptions)| {
        let mut options = good.clone();
        change(&mut options.gate);
        options
    };
    for bad in [
        ScanOptions { frames_per_state: 0, ..good.clone() },
        ScanOptions { attempts: 0, ..good.clone() },
        ScanOptions { laser_latency: f64::NAN, ..good.clone() },
        ScanOptions { spot: SpotOptions { min_signal_to_noise: f64::NAN, ..SpotOptions::default() }, ..good.clone() },
        gate(|g| g.depth_range = [2.0, 1.0]),
        gate(|g| g.half_width = f64::NAN),
        gate(|g| g.sigmas = 0.0),
    ] {
        assert!(matches!(refused(&mut rig, &region(2, 2), &bad, &mut []), Error::InvalidArgument { .. }));
    }
    let mut mismatched = fixed(&fake, 1);
    mismatched[0].known = Some(crate::geometry::Camera { width: 10, ..fixed_camera(0) });
    assert!(matches!(refused(&mut rig, &region(2, 2), &good, &mut mismatched), Error::InvalidArgument { .. }));
    assert_eq!(fake.world().calls, calls);
}

#[test]
fn frames_of_another_size_are_a_device_error() {
    let fake = Fake::new();
    let mut cameras = fixed(&fake, 1);
    cameras[0].width = 100;
    let scan = scan_region(&mut fake.rig(), &region(2, 2), &ScanOptions::default(), &mut cameras, &mut on).unwrap();
    assert!(
        matches!(&scan.end, ScanEnd::Failed(e) if e.to_string().contains("240 x 180 where 100 x 180")),
        "{:?}",
        scan.end
    );
    assert!(!fake.world().laser_lit);
}

#[test]
fn cameras_without_frames_end_the_scan_with_the_laser_off() {
    let fake = Fake::new();
    let mut rig = fake.rig();
    let scan = scan_region(&mut rig, &region(3, 2), &ScanOptions::default(), &mut fixed(&fake, 1), &mut |p| {
        fake.world().habits.blind = p.done == 2;
        Continue(())
    })
    .unwrap();
    assert!(matches!(scan.end, ScanEnd::Failed(Error::DeviceTimeout { .. })), "{:?}", scan.end);
    assert_eq!(scan.shots.len(), 2);
    check_history(&fake);
}

#[test]
fn the_lasers_time_on_is_kept_while_frames_are_waited_for() {
    let fake = Fake::new();
    let mut rig = fake.rig();
    // The fixed camera goes blind as soon as the laser is on.
    struct BlindWhenLit(Box<dyn crate::device::FrameSource>, Fake);
    impl crate::device::FrameSource for BlindWhenLit {
        fn next_frame(
            &mut self,
            since: f64,
            timeout: f64,
            frame: &mut crate::device::Frame,
        ) -> crate::error::Result<()> {
            if self.1.world().laser_lit {
                self.1.sleep(timeout);
                return Err(Error::DeviceTimeout { what: "blind camera", seconds: timeout });
            }
            self.0.next_frame(since, timeout, frame)
        }
    }
    let frames = Box::new(BlindWhenLit(fake.fixed_frames(0), fake.clone()));
    let mut cameras = [FixedCamera::new(frames, SIZE.0, SIZE.1)];
    let scan = scan_region(&mut rig, &region(2, 1), &ScanOptions::default(), &mut cameras, &mut on).unwrap();
    assert!(matches!(scan.end, ScanEnd::Failed(Error::DeviceTimeout { .. })), "{:?}", scan.end);
    let longest = fake.longest_time_on();
    assert!(longest > 1.9 && longest < 2.0 + 1e-6, "{longest}");
    check_history(&fake);
}

#[test]
fn a_scan_waits_for_the_laser_s_share_of_time() {
    let scanned = |duty: f64| {
        let fake = Fake::new();
        let options = RigOptions { laser_duty: duty, laser_duty_window: 5.0, ..RigOptions::default() };
        let mut rig = Rig::open(fake.parts(), options).unwrap();
        let scan = scan_region(&mut rig, &region(4, 3), &ScanOptions::default(), &mut [], &mut on).unwrap();
        check_history(&fake);
        check_truth(&scan);
        assert_eq!(scan.shots.iter().filter(|s| s.point.is_some()).count(), 12);
        (fake.greatest_share_on(5.0), fake.now())
    };
    let (free, short) = scanned(1.0);
    let share = 0.5 * free;
    let (kept, long) = scanned(share);
    assert!(kept <= share + 1e-9 && kept > 0.5 * share, "{kept} of {share}, {free} without a limit");
    assert!(long > short);
}
