//! The health check: its false alarms, its power, and what it says of each thing that can happen, over
//! many simulated set-ups.

#[path = "support/health.rs"]
mod checks;
#[path = "support/thesis.rs"]
mod thesis;

use checks::{Change, Tally, tally};
use ptzcal::health::Verdict;

fn runs(default: usize) -> usize {
    std::env::var("PTZCAL_HEALTH_RUNS").ok().and_then(|n| n.parse().ok()).unwrap_or(default)
}

fn print(name: &str, t: &Tally) {
    println!("{name:<40} {t:?}");
}

#[test]
fn figures() {
    let n = runs(200);
    print("nothing", &tally(&Change::Nothing, n));
    for degrees in [0.02, 0.05, 0.1, 0.2, 0.5, 1.0] {
        print(&format!("camera turned {degrees}"), &tally(&Change::CameraTurned { degrees }, n));
    }
    for metres in [0.002, 0.01, 0.05] {
        print(&format!("camera moved {metres}"), &tally(&Change::CameraMoved { metres }, n));
    }
    for degrees in [0.02, 0.05, 0.1, 0.2, 0.5, 1.0] {
        print(&format!("head zero {degrees}"), &tally(&Change::HeadZero { degrees }, n));
    }
    for degrees in [0.1, 0.5, 1.0] {
        print(&format!("rig moved {degrees}"), &tally(&Change::RigMoved { degrees, metres: 0.02 }, n));
    }
    print("laser moved", &tally(&Change::LaserMoved { slope: 1e-3 }, n));
    for shots in [1, 2, 3, 5] {
        print(&format!("scene changed {shots}"), &tally(&Change::SceneChanged { shots }, n));
    }
    print("1 outlier", &tally(&Change::Outliers { shots: 1 }, n));
    print("2 outliers", &tally(&Change::Outliers { shots: 2 }, n));
    print("turned, scene at 2", &tally(&Change::TurnedAndScene { degrees: 0.3, shots: 2 }, n));
    print("3 seen", &tally(&Change::Missing { left: 3 }, n));
    print("6 seen", &tally(&Change::Missing { left: 6 }, n));
    assert!(matches!(Verdict::Unchanged, Verdict::Unchanged));
}
