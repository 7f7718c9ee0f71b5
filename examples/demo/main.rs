//! `make demo`: the main job. A simulated rig scans its room, a fixed camera is calibrated from the
//! shots and compared with the truth; the rig moves to a second station and finds its pose; then the
//! same solver calibrates a real surveillance camera. Results go to target/demo.

#[path = "../../tests/support/data.rs"]
mod data;
#[path = "../../tests/support/meva.rs"]
mod meva;
mod picture;
mod real;
mod stations;

use std::error::Error;
use std::io::{IsTerminal, Write};
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use ptzcal::calibrate::{Calibration, CalibrationOptions, Correspondences, DistortionModel, calibrate_camera};
use ptzcal::control::Log;
use ptzcal::format::{OpenCvCamera, write_camera, write_opencv_yaml, write_ply};
use ptzcal::geometry::Camera;
use ptzcal::report::Report;
use ptzcal::rig::{FixedCamera, Progress, Rig, RigOptions, RigParts, Scan, ScanOptions, ScanRegion, scan_region};
use ptzcal::sim::{SimOptions, Simulator};

/// What is shared by the parts of the demo.
pub type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let folder = data::target().join("demo");
    std::fs::create_dir_all(&folder)?;
    println!("1  A simulated rig (sim:room) scans its room; a fixed camera watches.");
    let simulator = Simulator::new(SimOptions::parse("sim:room?seed=1")?)?;
    let mut rig = open(&simulator)?;
    // 47 x 43 positions = 2021 shots over the field of view of the fixed camera.
    let region = ScanRegion {
        pan: [-26f64, 14.0].map(f64::to_radians),
        tilt: [-19f64, 16.0].map(f64::to_radians),
        pan_steps: 47,
        tilt_steps: 43,
    };
    let begun = Instant::now();
    let scan = watch(&mut rig, &simulator, &region, &[0])?;
    let counts = scan.counts();
    println!(
        "   {} shots in {:.1} s: the head camera saw {} spots, the fixed camera {}",
        counts.shots,
        begun.elapsed().as_secs_f64(),
        counts.head,
        counts.fixed[0]
    );

    println!("2  The fixed camera is calibrated from the shots.");
    let set = scan.correspondences(0)?;
    let options = CalibrationOptions { distortion: DistortionModel::Radial2, ..Default::default() };
    let begun = Instant::now();
    let calibration = calibrate_camera(&set, &options)?;
    let truth = simulator.truth().fixed[0];
    describe(&calibration, &truth, begun.elapsed().as_secs_f64());
    save(&folder, &scan, &calibration)?;
    report(&folder, &scan, &set, &calibration)?;
    picture::spots(&folder, &simulator, &mut rig, &calibration.camera)?;
    picture::residuals(&folder, &simulator, &set, &calibration)?;
    rig.close()?;

    println!("3  The rig moves to a second station and finds its pose by roof edges.");
    stations::run()?;

    println!("4  The same solver on a real surveillance camera (MEVA G341).");
    real::run(&folder)?;

    println!("Results: {}", folder.display());
    let used = calibration.inliers.iter().filter(|i| **i).count();
    println!(
        "fixed camera: f {:.1} px (truth {:.1}), centre within {:.1} mm, {used} of {} shots used",
        calibration.camera.intrinsics.fx,
        truth.intrinsics.fx,
        (calibration.camera.centre() - truth.centre()).norm() * 1e3,
        counts.shots,
    );
    Ok(())
}

/// A rig on the simulator's devices, with the model that its owner would know.
pub fn open(simulator: &Simulator) -> Outcome<Rig> {
    let parts = RigParts {
        model: simulator.nominal_rig(),
        ptz: Box::new(simulator.ptz()),
        laser: Box::new(simulator.laser()),
        frames: Box::new(simulator.head_frames()),
        clock: simulator.clock(),
        log: Log::silent(),
    };
    Ok(Rig::open(parts, RigOptions::default())?)
}

/// Scans with a progress bar while the given fixed cameras watch.
pub fn watch(rig: &mut Rig, simulator: &Simulator, region: &ScanRegion, cameras: &[usize]) -> Outcome<Scan> {
    let truth = simulator.truth();
    let mut fixed = Vec::new();
    for &i in cameras {
        let camera = &truth.fixed[i];
        fixed.push(FixedCamera::new(Box::new(simulator.fixed_frames(i)?), camera.width, camera.height));
    }
    let mut bar = Bar { terminal: std::io::stdout().is_terminal(), shown: 0 };
    let mut report = |p: &Progress<'_>| {
        bar.show(p);
        ControlFlow::Continue(())
    };
    let scan = scan_region(rig, region, &ScanOptions::default(), &mut fixed, &mut report)?;
    if scan.is_complete() { Ok(scan) } else { Err(format!("the scan ended early: {:?}", scan.end).into()) }
}

/// A line that fills up; on a terminal it stays in its place, in a file it is a line a tenth.
struct Bar {
    terminal: bool,
    shown: usize,
}

impl Bar {
    fn show(&mut self, p: &Progress<'_>) {
        let steps = if self.terminal { 200 } else { 10 };
        let part = p.done * steps / p.total.max(1);
        if part == self.shown && p.done < p.total || p.done == 0 {
            return;
        }
        self.shown = part;
        let filled = 40 * p.done / p.total.max(1);
        let left = p.seconds_left.map_or(String::new(), |s| format!(", {s:.0} s of the rig's time left"));
        let line = format!("   [{}{}] {}/{}{left}", "#".repeat(filled), ".".repeat(40 - filled), p.done, p.total);
        let end = if !self.terminal || p.done == p.total { "\n" } else { "" };
        let start = if self.terminal { "\r\x1b[K" } else { "" };
        print!("{start}{line}{end}");
        let _ = std::io::stdout().flush();
    }
}

fn describe(c: &Calibration, truth: &Camera, seconds: f64) {
    let (k, t) = (&c.camera.intrinsics, &truth.intrinsics);
    let n = c.covariance.nrows();
    let sigma = |i: usize| c.covariance[(i, i)].sqrt();
    println!("   solved in {:.0} ms, residual {:.3} px rms", seconds * 1e3, c.rms);
    println!("   {:<10} {:>10} {:>10} {:>10}", "", "found", "truth", "sigma");
    for (name, found, truth, i) in
        [("fx (px)", k.fx, t.fx, 0), ("fy (px)", k.fy, t.fy, 1), ("cx (px)", k.cx, t.cx, 3), ("cy (px)", k.cy, t.cy, 4)]
    {
        println!("   {name:<10} {found:>10.3} {truth:>10.3} {:>10.3}", sigma(i));
    }
    let (centre, true_centre) = (c.camera.centre(), truth.centre());
    for (i, axis) in ["x", "y", "z"].iter().enumerate() {
        println!(
            "   {:<10} {:>10.2} {:>10.2} {:>10.2}",
            format!("{axis} (mm)"),
            centre[i] * 1e3,
            true_centre[i] * 1e3,
            sigma(n - 3 + i) * 1e3
        );
    }
    println!("   sigma takes the rig's model as exact; this one is off by about 1.5 mm at the points, on purpose.");
    println!(
        "   Where that matters, rig and cameras are adjusted together: \"Adjust rig and cameras together\" in README.md."
    );
}

/// One page for the person who signs for the camera.
fn report(folder: &Path, scan: &Scan, set: &Correspondences, c: &Calibration) -> Outcome<()> {
    let mut report = Report::new("A fixed camera of the simulated room")?;
    report.add_calibration("fixed camera", c, Some(set), None)?;
    report.add_scan("scan", scan)?;
    report.save(&folder.join("report.html"))?;
    println!("   how good it is, for people: report.html");
    Ok(())
}

fn save(folder: &Path, scan: &Scan, c: &Calibration) -> Outcome<()> {
    write_camera(&folder.join("camera.json"), &c.record(None))?;
    // OpenCV's file has no place for skew; ours is a fraction of a pixel across the image.
    let mut camera = c.camera;
    camera.intrinsics.skew = 0.0;
    write_opencv_yaml(&folder.join("camera.yaml"), &OpenCvCamera { camera, rms: Some(c.rms) })?;
    let cloud = scan.cloud();
    write_ply(&folder.join("cloud.ply"), &cloud)?;
    println!("   {} points in cloud.ply, the camera in camera.json and camera.yaml", cloud.positions.len());
    Ok(())
}
