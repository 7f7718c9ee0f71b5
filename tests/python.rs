//! The Python package and its examples against the library of this build.
//!
//! Python is `PYTHON` or python3. NumPy comes with it, or pip puts it into target/python-venv; where
//! neither is to be had the tests are skipped, and say so.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::time::Duration;

#[path = "support/board_pictures.rs"]
mod board_pictures;
#[path = "support/data.rs"]
mod data;
#[path = "support/library.rs"]
mod library;
#[path = "support/python.rs"]
mod python_programs;
#[path = "support/thesis.rs"]
mod thesis;

use library::{library, root};
use python_programs::{environment, output, system_python};

fn has_numpy(python: &Path) -> bool {
    output(Command::new(python).args(["-c", "import numpy"]), Duration::from_secs(60)).0
}

/// A Python with NumPy.
fn python() -> Option<&'static Path> {
    static PYTHON: OnceLock<Option<PathBuf>> = OnceLock::new();
    let system = system_python();
    let found = PYTHON.get_or_init(|| {
        if has_numpy(&system) { Some(system) } else { environment("python-venv", &["numpy"], "numpy") }
    });
    found.as_deref()
}

/// Runs Python with the package and this build's library; its output.
fn run(arguments: &[&str]) -> Option<String> {
    Some(run_by(python()?, &[&["-W", "error"], arguments].concat()))
}

/// The same by a Python of one's own, whose packages may warn.
fn run_by(python: &Path, arguments: &[&str]) -> String {
    let mut command = Command::new(python);
    command
        .args(arguments)
        .current_dir(root())
        .env("PTZCAL_LIBRARY", library().shared())
        .env("PYTHONPATH", root().join("bindings/python"))
        .env("PYTHONDONTWRITEBYTECODE", "1");
    let (success, text) = output(&mut command, Duration::from_secs(300));
    assert!(success, "python {}:\n{text}", arguments.join(" "));
    text
}

#[test]
fn package() {
    if let Some(text) = run(&["-m", "unittest", "discover", "-s", "bindings/python/tests"]) {
        assert!(text.contains("\nOK"), "{text}");
    }
}

#[test]
fn example_calibrates_from_points() {
    if let Some(text) = run(&["examples/python/calibrate_from_points.py"]) {
        let focal = text.lines().next().unwrap().split_whitespace().collect::<Vec<_>>();
        let (value, sigma): (f64, f64) = (focal[1].parse().unwrap(), focal[3].parse().unwrap());
        assert!((value - 845.19).abs() < 4.0 * sigma && sigma < 5.0, "{text}");
    }
}

#[test]
fn example_calibrates_a_real_camera() {
    let Some(meva) = data::folder("meva") else { return };
    let points = meva.join("corr/G341.csv");
    let example = "examples/python/calibrate_from_points.py";
    if let Some(text) = run(&[example, points.to_str().unwrap(), "1920", "1080"]) {
        let focal: f64 = text.split_whitespace().nth(1).unwrap().parse().unwrap();
        assert!((focal / 3361.2 - 1.0).abs() < 0.005, "{text}");
    }
}

#[test]
fn example_detects_a_spot() {
    if let Some(text) = run(&["examples/python/detect_spot.py"]) {
        assert!(text.starts_with("spot at (") && text.contains("signal to noise"), "{text}");
    }
}

#[test]
fn plots_and_images_of_pillow() {
    let Some(python) = environment("plots-venv", &["numpy", "matplotlib"], "numpy, matplotlib") else { return };
    // Pillow comes with matplotlib.
    for tests in ["test_plots.py", "test_images.py"] {
        let text = run_by(&python, &["-m", "unittest", "discover", "-s", "bindings/python/tests", "-p", tests]);
        assert!(text.contains("\nOK\n"), "{text}");
    }
}

#[test]
fn example_calibrates_a_fleet() {
    let packages = ["numpy", "dask", "distributed"];
    let Some(python) = environment("fleet-venv", &packages, "numpy, dask.distributed") else { return };
    let text = run_by(&python, &["examples/python/calibrate_fleet.py", "--cameras", "20", "--workers", "2"]);
    assert!(text.contains("18 of 20 cameras in "), "{text}");
    // Those that see one wall only are refused, by name; the others do not suffer.
    assert!(["camera 9: ", "camera 19: "].iter().all(|name| text.contains(&format!("{name}degenerate"))), "{text}");
}

#[test]
fn example_surveys_two_stations() {
    if let Some(text) = run(&["examples/python/survey_two_stations.py"]) {
        let line = text.lines().find_map(|l| l.strip_prefix("B is turned by ")).unwrap();
        let angle: f64 = line.split(' ').next().unwrap().parse().unwrap();
        assert!((angle - 1.1f64.to_degrees()).abs() < 0.1, "{text}");
        assert!(text.lines().last().unwrap().starts_with("B is at ("), "{text}");
    }
}

#[test]
fn example_surveys_a_path() {
    if let Some(text) = run(&["examples/python/survey_path.py"]) {
        assert!(text.contains("loop 0"), "{text}");
        // "camera 0 ... off 1.2 mm, 2.0 expected": within four standard deviations of three numbers.
        let cameras: Vec<&str> = text.lines().filter(|l| l.starts_with("camera ")).collect();
        assert_eq!(cameras.len(), 2, "{text}");
        for line in cameras {
            let numbers = line.split("off ").nth(1).unwrap();
            let (off, expected) = numbers.split_once(" mm, ").unwrap();
            let (off, expected) = (off, expected.split(' ').next().unwrap());
            let (off, expected): (f64, f64) = (off.parse().unwrap(), expected.parse().unwrap());
            assert!(off < 4.0 * expected && expected < 20.0, "{line}");
        }
    }
}

#[test]
fn example_scans_the_simulator() {
    if let Some(text) = run(&["examples/python/scan_simulator.py", "16", "12"]) {
        let line = text.lines().last().unwrap();
        let within: f64 = line.split("centre within ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!(within < 3.0, "{line}");
    }
}

#[test]
fn example_exports_a_model() {
    let folder = tempfile::tempdir().unwrap();
    let to = folder.path().to_str().unwrap();
    let Some(text) = run(&["examples/python/export_model.py", to, "24", "16"]) else { return };
    let line = text.lines().last().unwrap();
    let mesh = ptzcal::format::read_mesh(&folder.path().join("model.glb")).unwrap();
    assert!(line.contains(&format!("{} triangles", mesh.triangles.len())), "{line}");
    assert!(mesh.untextured().len() * 20 < mesh.triangles.len() && mesh.triangles.len() > 400, "{line}");
    let cloud = ptzcal::format::read_cloud(&folder.path().join("cloud.pcd")).unwrap().cloud;
    assert!(line.starts_with(&format!("{} points", cloud.len())), "{line}");
    assert!(ptzcal::format::read_mesh(&folder.path().join("model.wrl")).unwrap().textures.len() == mesh.textures.len());
    ptzcal::format::read_depth(&folder.path().join("depth.png"), 0.001).unwrap();
}

#[test]
fn example_makes_a_precision_label() {
    let folder = tempfile::tempdir().unwrap();
    let to = folder.path().to_str().unwrap();
    let Some(text) = run(&["examples/python/precision_label.py", to]) else { return };
    assert!(text.contains("chosen shots; any number leaves"), "{text}");
    for name in ["label.csv", "label.json", "label.svg", "handoff.svg", "errors.svg", "grid.svg", "scatter.svg"] {
        assert!(folder.path().join(name).metadata().unwrap().len() > 500, "{name}");
    }
}

#[test]
fn example_looks_where_it_is_clicked() {
    if let Some(text) = run(&["examples/python/click_to_point.py", "16", "12"]) {
        let line = text.lines().last().unwrap();
        let within: f64 = line.split("within ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!(within < 12.0, "{text}");
    }
}

#[test]
fn example_calibrates_from_rgbd() {
    let Some(folder) = data::folder("rgbd_nyu") else { return };
    let file = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let (colour, depth, fixed) = (file("color4.png"), file("depth4.pgm"), file("color5.png"));
    let pictures = tempfile::tempdir().unwrap();
    let to = pictures.path().to_str().unwrap();
    let example = "examples/python/calibrate_from_rgbd.py";
    let lens = ["518", "519", "325.5", "253.5"];
    let Some(text) = run(&[&[example, &colour, &depth, &fixed], &lens[..], &["--pictures", to]].concat()) else {
        return;
    };
    let focal = text.lines().find_map(|l| l.strip_prefix("fx ")).unwrap();
    let focal: f64 = focal.split("+-").next().unwrap().trim().parse().unwrap();
    assert!((focal / 518.0 - 1.0).abs() < 0.01, "{text}");
    for name in ["matches.png", "residuals.png"] {
        assert!(image::open(pictures.path().join(name)).unwrap().width() >= 640);
    }
}

#[test]
fn example_adjusts_rig_and_cameras() {
    let Some(text) = run(&["examples/python/adjust_rig_and_cameras.py", "20", "14"]) else { return };
    let (believed, adjusted) = text.split_once("rig adjusted").unwrap();
    assert!(believed.contains("the laser line should not be fixed"), "{text}");
    assert!(!adjusted.contains("warning") && adjusted.contains("weakest: "), "{text}");
    let number = |line: &str, after: &str| -> f64 {
        let rest = line.split(after).nth(1).unwrap().trim_start();
        rest.split([' ', ')']).next().unwrap().parse().unwrap()
    };
    let cameras: Vec<&str> =
        adjusted.lines().filter(|l| l.contains("camera ") && l.contains("centre within")).collect();
    assert_eq!(cameras.len(), 2, "{text}");
    for line in cameras {
        let (off, sigma) = (number(line, "within"), number(line, "sigma"));
        assert!(off < 3.5 * sigma && sigma < 4.0, "{line}");
    }
}

fn write_pgm(path: &Path, width: u32, height: u32, grey: &[u8]) {
    let mut file = File::create(path).unwrap();
    write!(file, "P5\n{width} {height}\n255\n").unwrap();
    file.write_all(grey).unwrap();
}

/// The first number behind `what` and the one behind the next "+-".
fn measured(line: &str, what: &str) -> (f64, f64) {
    let mut words = line.split(what).nth(1).unwrap_or_else(|| panic!("{what}: {line}")).split_whitespace();
    let mut number = || words.next().unwrap().trim_end_matches(',').parse().unwrap_or(f64::NAN);
    let value = number();
    number();
    (value, number())
}

/// Rendered pictures of two zoom positions, with two that are no use.
#[test]
fn example_calibrates_a_ptz_from_a_folder() {
    use nalgebra::Vector3;
    use ptzcal::geometry::{Camera, Intrinsics, Rigid, rigid};
    let folder = tempfile::tempdir().unwrap();
    let spec = ptzcal::rig_calibration::ChessboardSpec { columns: 9, rows: 6, square: 0.04 };
    let rig = thesis::rig();
    let mut noise = thesis::Noise::new(8);
    let turns = [[0.5, 0.1], [-0.4, 0.4], [0.1, -0.5], [0.4, 0.4], [-0.3, -0.4], [0.0, 0.5], [-0.5, 0.0]];
    for (zoom, f, near, far) in [("1x", 800.0, 1.0, 2.5), ("3x", 2400.0, 2.4, 5.0)] {
        let camera = Camera { intrinsics: Intrinsics::new(f, 360.0, 288.0), ..rig.head_camera(0.0, 0.0) };
        let inner = folder.path().join(zoom);
        std::fs::create_dir(&inner).unwrap();
        for (i, [x, y]) in turns.into_iter().enumerate() {
            let z = near + (far - near) * i as f64 / 6.0;
            let rotation = rigid::exp(&Vector3::new(x, y, 0.1));
            let l = rig.laser;
            let hit = Vector3::new(l.x0 + l.vx * z, l.y0 + l.vy * z, z);
            let pose = Rigid { rotation, translation: hit - rotation * Vector3::new(0.02, 0.02, 0.0) };
            let scene = board_pictures::Scene {
                camera: &camera,
                spec: &spec,
                pose,
                line: l,
                beam: 0.0015,
                blur: 0.8,
                noise: 2.0,
            };
            for (image, end) in scene.render(&mut noise).iter().zip(["off", "on"]) {
                write_pgm(&inner.join(format!("view{i}-{end}.pgm")), image.width, image.height, &image.data);
            }
        }
    }
    let grey = vec![90; 720 * 576];
    write_pgm(&folder.path().join("1x/empty-off.pgm"), 720, 576, &grey);
    write_pgm(&folder.path().join("1x/empty-on.pgm"), 720, 576, &grey);
    let output = folder.path().join("zoom.json");
    let example = "examples/python/calibrate_ptz_from_folder.py";
    let paths = [folder.path().to_str().unwrap(), output.to_str().unwrap()];
    let Some(text) = run(&[example, paths[0], "9x6", "0.04", paths[1]]) else { return };
    println!("{text}");
    let line = |start: &str| text.lines().find(|l| l.starts_with(start)).unwrap_or_else(|| panic!("{start}: {text}"));
    assert!(line("zoom 1 empty-off.pgm").contains("NOT USED: no chessboard"), "{text}");
    assert_eq!(text.lines().filter(|l| l.contains("NOT USED")).count(), 1, "{text}");
    assert!(line("zoom 1:").contains("7 of 8 views") && line("zoom 3:").contains("7 of 7 views"), "{text}");
    for (zoom, f) in [("zoom 1:", 800.0), ("zoom 3:", 2400.0)] {
        let (found, sigma) = measured(line(zoom), "fx ");
        assert!((found - f).abs() < 4.0 * sigma && sigma < 0.01 * f, "{text}");
    }
    for laser in text.lines().filter(|l| l.starts_with("  laser")) {
        for (what, truth) in [("x0 ", 100.0), ("y0 ", 5.0), ("vx ", -5.0), ("vy ", 3.0)] {
            let (found, sigma) = measured(laser, what);
            // Printed to two decimals.
            assert!((found - truth).abs() < 4.0 * sigma + 0.01 && sigma < 2.0, "{what}: {laser}");
        }
    }
    assert!(line("the laser at 2 positions").contains("one line"), "{text}");
    let curve = ptzcal::format::read_zoom_curve(&output).unwrap();
    assert_eq!(curve.range(), [1.0, 3.0]);
}

/// The same on photographs: lens only, one position.
#[test]
fn example_calibrates_a_camera_from_photographs() {
    let Some(photographs) = data::folder("bouguet_opencv_stereo14") else { return };
    let folder = tempfile::tempdir().unwrap();
    for i in 1..=14 {
        let name = format!("left{i:02}");
        let grey = image::open(photographs.join(&name).with_extension("jpg")).unwrap().to_luma8();
        write_pgm(&folder.path().join(name).with_extension("pgm"), grey.width(), grey.height(), grey.as_raw());
    }
    let example = "examples/python/calibrate_ptz_from_folder.py";
    let Some(text) = run(&[example, folder.path().to_str().unwrap(), "9x6", "0.03"]) else { return };
    println!("{text}");
    let line = text.lines().find(|l| l.starts_with("zoom 0: 14 of 14 views used")).unwrap();
    let ((fx, sigma), (cx, _)) = (measured(line, "fx "), measured(line, "cx "));
    assert!((fx - 532.99).abs() < 2.0 && sigma < 1.0 && (cx - 341.76).abs() < 2.0, "{text}");
    assert!(text.contains("no laser line") && text.contains("no rig over zoom"), "{text}");
}

/// The README's block in a language that names `what`.
fn readme(language: &str, what: &str) -> String {
    let text = std::fs::read_to_string(root().join("README.md")).unwrap();
    let fence = format!("```{language}\n");
    let mut blocks = text.split(&fence).skip(1).map(|b| b.split("```").next().unwrap());
    blocks.find(|b| b.contains(what)).expect("the README's block").to_owned()
}

#[test]
fn the_readme_adjusts_rig_and_cameras() {
    let scan = "import numpy as np\nimport ptzcal\n\
        with ptzcal.Rig.open('sim:room') as rig:\n\
        \x20   region = ptzcal.Region(-0.45, 0.25, -0.33, 0.28, 12, 8)\n\
        \x20   scan, model = rig.scan_region(region, ['sim:fixed/0']), rig.model\n\
        \x20   truth = rig.simulator().true_camera(0).centre\n";
    let off = "\nprint('off', np.linalg.norm(result.calibrations[camera].camera.centre - truth))\n";
    if let Some(text) = run(&["-c", &(scan.to_owned() + &readme("python", "ptzcal.Adjustment") + off)]) {
        let off: f64 = text.lines().last().unwrap().strip_prefix("off ").unwrap().parse().unwrap();
        assert!(off < 3e-3, "{text}");
    }
}
