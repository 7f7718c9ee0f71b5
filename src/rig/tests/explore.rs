//! Exploring the simulator's room: its ends and refusals. What it finds: tests/explore.rs.

use std::ops::ControlFlow::{Break, Continue};

use crate::control::Log;
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
    // Where one of them sees nothing: the other's range, and the reason.
    let one = ExploreOptions { pan: [-0.55, -0.47], max_shots: 20, ..ExploreOptions::default() };
    let one = explore(&mut rig, &one, &mut cameras, &mut |_| Continue(())).unwrap();
    assert!(one.cameras[0].as_ref().is_ok_and(|v| v.seen > 2));
    assert!(matches!(&one.cameras[1], Err(Error::NotFound { reason }) if reason.contains("camera 1 saw")));
    for bad in [
        ExploreOptions { pan: [0.5, 0.5], ..all.clone() },
        ExploreOptions { tilt: [0.5, 0.1], ..all.clone() },
        ExploreOptions { tilt: [2.0, 3.0], ..all.clone() },
        ExploreOptions { pan: [f64::NAN, 1.0], ..all.clone() },
        ExploreOptions { max_shots: 0, ..all.clone() },
        ExploreOptions { max_shots: 501, ..all.clone() },
        ExploreOptions { tolerance: 0.0, ..all.clone() },
        ExploreOptions { tolerance: 0.009, ..all.clone() },
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
