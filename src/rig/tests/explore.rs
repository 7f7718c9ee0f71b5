//! Exploring the simulator's room, against where its fixed cameras truly see the spot.

use std::ops::ControlFlow::{Break, Continue};

use crate::control::Log;
use crate::device::PanTiltZoom;
use crate::error::Error;
use crate::rig::*;
use crate::sim::{SimOptions, Simulator};

fn rig(simulator: &Simulator) -> Rig {
    let parts = RigParts {
        model: simulator.nominal_rig(),
        ptz: Box::new(simulator.ptz()),
        laser: Box::new(simulator.laser()),
        frames: Box::new(simulator.head_frames()),
        clock: simulator.clock(),
        log: Log::silent(),
    };
    Rig::open(parts, RigOptions::default()).unwrap()
}

fn fixed(simulator: &Simulator) -> Vec<FixedCamera> {
    let camera = |(i, c): (usize, &crate::geometry::Camera)| {
        FixedCamera::new(Box::new(simulator.fixed_frames(i).unwrap()), c.width, c.height)
    };
    simulator.truth().fixed.iter().enumerate().map(camera).collect()
}

/// Whether each fixed camera sees the spot at readings on a grid of two degrees.
fn truth(simulator: &Simulator) -> Vec<([f64; 2], Vec<bool>)> {
    let (mut ptz, clock) = (simulator.ptz(), simulator.clock());
    let mut all = Vec::new();
    for pan in (-98..=98).step_by(2) {
        for tilt in (-24..=24).step_by(2) {
            let at = [pan, tilt].map(|a| f64::from(a).to_radians());
            ptz.move_absolute(at[0], at[1]).unwrap();
            clock.sleep(4.0);
            all.push((at, simulator.spot_truth().fixed.iter().map(Option::is_some).collect()));
        }
    }
    all
}

#[test]
fn the_visible_range_of_both_cameras_is_found() {
    for seed in 1..4 {
        let simulator = Simulator::new(SimOptions { seed, ..SimOptions::default() }).unwrap();
        let truth = truth(&simulator);
        let mut calls = 0;
        let explored = explore(&mut rig(&simulator), &ExploreOptions::default(), &mut fixed(&simulator), &mut |p| {
            assert_eq!(p.done, calls);
            calls += 1;
            Continue(())
        })
        .unwrap();
        let shots = explored.scan.shots.len();
        for (camera, found) in explored.cameras.iter().enumerate() {
            let found = found.as_ref().unwrap();
            let r = &found.region;
            let inside =
                |at: &[f64; 2]| (r.pan[0]..=r.pan[1]).contains(&at[0]) && (r.tilt[0]..=r.tilt[1]).contains(&at[1]);
            let visible = truth.iter().filter(|(_, seen)| seen[camera]);
            let (all, covered) = (visible.clone().count(), visible.filter(|(at, _)| inside(at)).count());
            let within: Vec<_> = truth.iter().filter(|(at, _)| inside(at)).collect();
            let share = within.iter().filter(|(_, seen)| seen[camera]).count() as f64 / within.len() as f64;
            println!(
                "seed {seed}, camera {camera}: {shots} shots, pan {:?} tilt {:?} deg, {covered} of {all} visible inside, share {:.2} (truly {share:.2}), {} seen",
                r.pan.map(f64::to_degrees),
                r.tilt.map(f64::to_degrees),
                found.share,
                found.seen
            );
            assert!(shots < 60);
            // Shots are some 8 degrees apart in the end, and the range ends half way to the next miss.
            assert!(covered as f64 > 0.88 * all as f64);
            assert!((found.share - share).abs() < 0.2);
            assert_eq!(found.mask.len(), r.len());
        }
    }
}

#[test]
fn an_exploration_stops_is_cancelled_and_refuses() {
    let simulator = Simulator::new(SimOptions::default()).unwrap();
    let (mut rig, mut cameras) = (rig(&simulator), fixed(&simulator));
    let all = ExploreOptions::default();
    let stopped = explore(&mut rig, &all, &mut cameras, &mut |p| if p.done == 3 { Break(()) } else { Continue(()) });
    let stopped = stopped.unwrap();
    assert_eq!((stopped.scan.end, stopped.scan.shots.len()), (ScanEnd::Stopped, 3));
    let options = ExploreOptions::default();
    let cancelled = explore(&mut rig, &options, &mut cameras, &mut |p| {
        if p.done == 2 {
            options.scan.cancel.cancel();
        }
        Continue(())
    });
    assert_eq!(cancelled.unwrap().scan.end, ScanEnd::Cancelled);
    // Where no camera looks.
    let behind = ExploreOptions { pan: [1.4, 1.7], max_shots: 20, ..ExploreOptions::default() };
    let never = explore(&mut rig, &behind, &mut cameras, &mut |_| Continue(()));
    assert!(matches!(&never, Err(Error::NotFound { reason }) if reason.contains("no fixed camera")), "{never:?}");
    for bad in [
        ExploreOptions { pan: [0.5, 0.5], ..all.clone() },
        ExploreOptions { tilt: [0.5, 0.1], ..all.clone() },
        ExploreOptions { tilt: [2.0, 3.0], ..all.clone() },
        ExploreOptions { pan: [f64::NAN, 1.0], ..all.clone() },
        ExploreOptions { max_shots: 0, ..all.clone() },
        ExploreOptions { tolerance: 0.0, ..all.clone() },
        ExploreOptions { spacing: f64::NAN, ..all.clone() },
        ExploreOptions { scan: ScanOptions { frames_per_state: 0, ..ScanOptions::default() }, ..all.clone() },
    ] {
        assert!(explore(&mut rig, &bad, &mut cameras, &mut |_| Continue(())).is_err(), "{bad:?}");
    }
    assert!(explore(&mut rig, &all, &mut [], &mut |_| Continue(())).is_err());
    assert!(fire_shots(&mut rig, &[], &all.scan, &mut cameras, &mut |_| Continue(())).is_err());
    assert!(fire_shots(&mut rig, &[(9.0, 0.0)], &all.scan, &mut cameras, &mut |_| Continue(())).is_err());
}

#[test]
fn shots_are_fired_again_where_they_were() {
    let simulator = Simulator::new(SimOptions::default()).unwrap();
    let (mut rig, mut cameras) = (rig(&simulator), fixed(&simulator));
    let readings = [(0.1, 0.05), (-0.2, 0.1), (0.0, -0.15)];
    let fire = |rig: &mut Rig, cameras: &mut [FixedCamera]| {
        fire_shots(rig, &readings, &ScanOptions::default(), cameras, &mut |_| Continue(())).unwrap()
    };
    let (a, b) = (fire(&mut rig, &mut cameras), fire(&mut rig, &mut cameras));
    assert!(a.is_complete() && b.is_complete());
    for (i, ((a, b), (pan, tilt))) in a.shots.iter().zip(&b.shots).zip(readings).enumerate() {
        assert_eq!((a.index, b.index), (i as u32, i as u32));
        assert!((a.pan - pan).abs() < 2e-3 && (a.tilt - tilt).abs() < 2e-3);
        let (a, b) = (a.head.unwrap(), b.head.unwrap());
        assert!((a.x - b.x).hypot(a.y - b.y) < 2.0);
    }
}
