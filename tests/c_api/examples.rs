//! The C examples, built and run as the README says; what they print is what users are promised.

use std::process::Command;

use super::programs::{Link, compile};
use super::tools::{root, run, text};

#[test]
fn the_c_example_calibrates_a_camera_through_callbacks() {
    let folder = tempfile::tempdir().unwrap();
    let source = root().join("examples/c/calibrate_fixed_camera.c");
    let said = text(&run(&mut Command::new(compile(&source, folder.path(), Link::Shared, &[]))));
    let line = said.lines().find(|l| l.contains("fixed camera: f")).expect("the example's result").to_owned();
    let number = |after: &str| -> f64 {
        let rest = &line[line.find(after).unwrap() + after.len()..];
        rest.trim_start().split([' ', ')']).next().unwrap().parse().unwrap()
    };
    let (found, truth, off) = (number(": f "), number("truth "), number("within "));
    assert!((found / truth - 1.0).abs() < 0.003 && off < 3.0, "{line}");
}
