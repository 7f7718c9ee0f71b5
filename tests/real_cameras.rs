//! Real cameras from measured 2D-3D points against their published calibrations; skipped, with a line,
//! where the data are absent. `make accuracy` shows the same figures.

#[path = "support/data.rs"]
mod data;
#[allow(dead_code)]
#[path = "../examples/accuracy/figure.rs"]
mod figure;
#[path = "support/meva.rs"]
mod meva;
#[path = "../examples/accuracy/real.rs"]
mod real;

use figure::Figure;

#[test]
fn published_calibrations_are_recovered() {
    real::run(&mut |figures: Vec<Figure>| {
        for f in figures {
            assert!(f.met(), "{}: {} {}, published {}", f.setup, f.figure, f.unit, f.bound);
        }
    });
}
