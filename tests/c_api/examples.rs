//! The C examples and the README's, built and run; what they print is what users are promised.

use std::fs;
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

#[test]
fn the_c_example_turns_the_head_to_a_click() {
    let folder = tempfile::tempdir().unwrap();
    let source = root().join("examples/c/click_to_point.c");
    let program = compile(&source, folder.path(), Link::Shared, &[]);
    let said = text(&run(Command::new(program).current_dir(folder.path())));
    // What was clicked on is on the floor, and at the centre of the head's picture: by the room's truth.
    let line = said.lines().last().unwrap();
    let number = |after: &str| -> f64 {
        let rest = &line[line.find(after).unwrap() + after.len()..];
        rest.trim_start().split([' ', ',']).next().unwrap().parse().unwrap()
    };
    let simulator = ptzcal::sim::Simulator::new(ptzcal::sim::SimOptions::parse("sim:room").unwrap()).unwrap();
    let (camera, rig) = (simulator.truth().fixed[0], simulator.nominal_rig());
    let ray = camera.back_project(&nalgebra::Vector2::new(150.0, 560.0)).unwrap();
    let point = ray.at((1.2 - ray.origin.y) / ray.direction.y);
    let head = rig.head_camera(number("pan").to_radians(), number("tilt").to_radians());
    let off =
        head.project(&point).unwrap() - nalgebra::Vector2::new(head.width as f64 - 1.0, head.height as f64 - 1.0) / 2.0;
    assert!(off.norm() < 3.0 && (number("is") - (point - camera.centre()).norm()).abs() < 0.02, "{line}: {off}");
    for file in ["hall.html", "hall.json"] {
        assert!(folder.path().join(file).metadata().unwrap().len() > 1000);
    }
}

/// The error's text reaches the user: an error that is read before the call that makes it has none.
#[test]
fn the_c_example_says_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let program = compile(&root().join("examples/c/click_to_point.c"), folder.path(), Link::Shared, &[]);
    // The rig model of the example is the reader's to fill in.
    let devices = ["visca:///dev/null", "gpio:///dev/gpiochip99/laser", "v4l2:///dev/video99", "sim:fixed/0"];
    let output = Command::new(program).args(devices).current_dir(folder.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.starts_with("PTZCAL_STATUS_INVALID_ARGUMENT: ") && said.contains("image size 0 x 0"), "{said}");
}

#[test]
fn the_c_example_ties_two_stations() {
    let folder = tempfile::tempdir().unwrap();
    let program = compile(&root().join("examples/c/survey_two_stations.c"), folder.path(), Link::Shared, &[]);
    let said = text(&run(Command::new(program).current_dir(folder.path())));
    let line = said.lines().find(|l| l.contains("B is at (")).unwrap_or_else(|| panic!("{said}"));
    let numbers = line.split("B is at (").nth(1).unwrap().split([',', ')', ' ']).filter_map(|n| n.parse::<f64>().ok());
    let found: Vec<f64> = numbers.collect();
    let truth = |address: &str| {
        let options = ptzcal::sim::SimOptions::parse(address).unwrap();
        ptzcal::sim::Simulator::new(options).unwrap().truth().station
    };
    let [a, b] = ["sim:room?station=1", "sim:room?station=2"].map(truth);
    let expected = a.apply(&b.centre());
    let off = (expected - nalgebra::Vector3::new(found[0], found[1], found[2])).norm();
    let sigma = 1e-3 * found[3];
    assert!(off < 3.0 * sigma && sigma < 0.01, "{line}: {expected}");
    for file in ["room.ply", "room.glb"] {
        assert!(folder.path().join(file).metadata().unwrap().len() > 10_000);
    }
}

#[test]
fn the_c_example_makes_a_precision_label() {
    let folder = tempfile::tempdir().unwrap();
    let program = compile(&root().join("examples/c/precision_label.c"), folder.path(), Link::Shared, &[]);
    let said = text(&run(Command::new(program).current_dir(folder.path())));
    assert!(said.starts_with("5 mm at 0.2 px: a grid of"), "{said}");
    // The closed form says what the simulation finds.
    for row in said.lines().skip(2) {
        let numbers: Vec<f64> =
            row.split_whitespace().filter_map(|n| n.trim_matches(['(', ')']).parse().ok()).collect();
        let [.., simulated, expected] = numbers[..] else { panic!("{row}") };
        assert!((simulated / expected - 1.0).abs() < 0.25, "{row}");
    }
    for file in ["label.csv", "label.svg"] {
        assert!(folder.path().join(file).metadata().unwrap().len() > 500);
    }
}

/// Code in the guide is code of an example that is built and run.
#[test]
fn the_guide_shows_what_is_tested() {
    let read = |path: &str| fs::read_to_string(root().join(path)).unwrap();
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let programs: Vec<String> =
        ["click_to_point.c", "calibrate_fixed_camera.c"].map(|name| words(&read(&format!("examples/c/{name}")))).into();
    let guide = read("docs/guide.md");
    let blocks: Vec<&str> = guide.split("```c\n").skip(1).map(|b| b.split("```").next().unwrap()).collect();
    assert!(blocks.len() > 5);
    for block in blocks {
        assert!(programs.iter().any(|p| p.contains(&words(block))), "in no example:\n{block}");
    }
}

/// Every status has its cure.
#[test]
fn the_page_of_errors_is_complete() {
    let page = fs::read_to_string(root().join("docs/errors.md")).unwrap();
    let header = fs::read_to_string(root().join("include/ptzcal.h")).unwrap();
    let statuses = header.lines().filter_map(|l| l.trim().strip_prefix("PTZCAL_STATUS_")?.split_once(" = -"));
    let names: Vec<&str> = statuses.map(|(name, _)| name).collect();
    assert!(names.len() > 30);
    for name in names {
        assert!(page.contains(&format!("| {name} |")), "{name}");
    }
}

#[test]
fn the_c_example_calibrates_a_camera_from_a_depth_camera() {
    let Some(frames) = crate::data::folder("rgbd_nyu") else { return };
    let folder = tempfile::tempdir().unwrap();
    let source = root().join("examples/c/calibrate_from_depth_camera.c");
    let mut command = Command::new(compile(&source, folder.path(), Link::Shared, &[]));
    command.args(["color4.png", "depth4.pgm", "color5.png"].map(|name| frames.join(name)));
    let matches = folder.path().join("matches.png");
    let said = text(&run(command.args(["518", "519", "325.5", "253.5"]).arg(&matches)));
    let focal = said.lines().find_map(|l| l.strip_prefix("fx ")).unwrap();
    let focal: f64 = focal.split(' ').next().unwrap().parse().unwrap();
    assert!((focal / 518.0 - 1.0).abs() < 0.01, "{said}");
    assert_eq!(image::open(matches).unwrap().width(), 1280);
}

/// What the README's adjustment takes for granted: a scan of the simulated room.
const BEFORE: &str = r#"#include <math.h>
#include <ptzcal.h>
#include <stdio.h>

int main(void)
{
  ptzcal_rig_options *rig_options;
  ptzcal_scan_options *scan_options;
  ptzcal_calibration_options *options;
  ptzcal_calibration *calibration = NULL;
  ptzcal_error *error = NULL;
  ptzcal_rig *rig = NULL;
  ptzcal_scan *scan = NULL;
  ptzcal_simulator *simulator = NULL;
  ptzcal_rig_model model;
  ptzcal_camera found, truth;
  ptzcal_region region;
  double at[3], there[3];
  ptzcal_rig_options_new(&rig_options, NULL);
  ptzcal_rig_options_set_address(rig_options, "sim:room", NULL);
  ptzcal_rig_open(rig_options, &rig, NULL);
  ptzcal_scan_options_new(&scan_options, NULL);
  ptzcal_scan_options_add_camera_address(scan_options, "sim:fixed/0", NULL, NULL);
  ptzcal_region_init(&region, sizeof region);
  region.pan_min = -0.45, region.pan_max = 0.25, region.tilt_min = -0.33, region.tilt_max = 0.28;
  region.pan_steps = 12, region.tilt_steps = 8;
  ptzcal_rig_scan_region(rig, &region, scan_options, NULL, NULL, &scan, NULL);
  ptzcal_rig_model_init(&model, sizeof model);
  ptzcal_rig_get_model(rig, &model, NULL);
  ptzcal_calibration_options_new(&options, NULL);
  ptzcal_calibration_options_set_distortion(options, PTZCAL_DISTORTION_MODEL_RADIAL2, NULL);
"#;

const AFTER: &str = r#"
  ptzcal_rig_simulator(rig, &simulator, NULL);
  ptzcal_camera_init(&found, sizeof found);
  ptzcal_camera_init(&truth, sizeof truth);
  ptzcal_calibration_get_camera(calibration, &found, NULL);
  ptzcal_simulator_true_camera(simulator, 0, &truth, NULL);
  if (ptzcal_camera_centre(&found, at, NULL) || ptzcal_camera_centre(&truth, there, NULL)) return 1;
  printf("off %g\n", sqrt(pow(at[0] - there[0], 2) + pow(at[1] - there[1], 2) + pow(at[2] - there[2], 2)));
  return 0;
}
"#;

#[test]
fn the_readme_adjusts_rig_and_cameras() {
    let folder = tempfile::tempdir().unwrap();
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    let mut blocks = readme.split("```c\n").skip(1).map(|b| b.split("```").next().unwrap());
    let block = blocks.find(|b| b.contains("ptzcal_adjustment_new")).expect("the README's adjustment");
    let source = folder.path().join("readme.c");
    fs::write(&source, format!("{BEFORE}{block}{AFTER}")).unwrap();
    let said = text(&run(&mut Command::new(compile(&source, folder.path(), Link::Shared, &[]))));
    let off: f64 = said.lines().last().unwrap().strip_prefix("off ").unwrap().parse().unwrap();
    assert!(off < 3e-3, "{said}");
}
