//! The health check: its false alarms, its power, and what it says of each thing that can happen, over
//! many simulated set-ups: half of them the camera NEAR the rig, half FAR from it.

#[path = "support/health.rs"]
mod checks;
#[path = "support/thesis.rs"]
mod thesis;

use checks::{Change, Tally, tally};
use ptzcal::health::Verdict::{CameraMoved, CannotTell, RigMoved, Unchanged};

/// `PTZCAL_HEALTH_RUNS=1000` for the figures of the README.
fn runs() -> usize {
    std::env::var("PTZCAL_HEALTH_RUNS").ok().and_then(|n| n.parse().ok()).unwrap_or(60)
}

fn of(change: Change) -> Tally {
    let t = tally(&change, runs());
    println!("{change:?}: {:?} (unchanged, camera, rig, cannot tell); nees {:.2}", t.said, t.nees);
    t
}

#[test]
fn an_unchanged_camera_is_called_so_but_for_one_in_a_hundred() {
    let n = runs().max(300);
    let t = tally(&Change::Nothing, n);
    let alarms = 1.0 - t.share(Unchanged);
    println!("false alarms: {alarms:.4} of {n}");
    // 1 % and four standard deviations of counting.
    assert!(alarms < 0.01 + 4.0 * (0.01 * 0.99 / n as f64).sqrt());
}

#[test]
fn a_moved_camera_is_noticed_and_refitted() {
    for (degrees, noticed) in [(0.1, 0.95), (0.5, 0.99), (1.0, 0.99)] {
        let t = of(Change::CameraTurned { degrees });
        assert!(t.share(Unchanged) <= 1.0 - noticed && t.share(RigMoved) < 0.05);
    }
    for change in [Change::CameraTurned { degrees: 1.0 }, Change::CameraMoved { metres: 0.05 }] {
        let t = of(change);
        assert!(t.share(CameraMoved) > 0.9);
        // Mean of chi-square over its six degrees of freedom.
        assert!(t.nees > 0.7 && t.nees < 1.4, "{}", t.nees);
        assert!(t.turn < 0.06 && t.centre < 4e-3, "{t:?}");
    }
    assert!(of(Change::TurnedAndScene { degrees: 0.5, shots: 2 }).share(CameraMoved) > 0.7);
}

#[test]
fn what_is_not_the_camera_is_not_called_the_camera() {
    for degrees in [0.1, 0.5, 1.0] {
        let t = of(Change::HeadZero { degrees });
        assert!(t.share(CameraMoved) < 0.1 && t.share(Unchanged) < 0.05);
    }
    assert!(of(Change::HeadZero { degrees: 1.0 }).share(RigMoved) > 0.7);
    assert!(of(Change::LaserMoved { slope: 1e-3 }).share(RigMoved) > 0.85);
    for shots in [1, 3, 5] {
        assert!(of(Change::SceneChanged { shots }).share(Unchanged) > 0.9);
    }
    assert!(of(Change::Outliers { shots: 2 }).share(Unchanged) > 0.85);
}

#[test]
fn too_few_spots_are_no_answer() {
    assert_eq!(of(Change::Missing { left: 3 }).share(CannotTell), 1.0);
    assert!(of(Change::Missing { left: 6 }).share(Unchanged) > 0.9);
}
