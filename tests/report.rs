//! Reports: what they say is what was found, and they fit a telephone and paper (in a real browser, where
//! one is installed).

#[path = "support/boards.rs"]
mod boards;
#[path = "support/data.rs"]
mod data;
#[path = "support/thesis.rs"]
mod thesis;

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::Command;

use nalgebra::Vector3;
use ptzcal::adjust::{AdjustOptions, Adjustment, CameraSetup, Station, adjust};
use ptzcal::calibrate::{CalibrationOptions, DistortionModel, calibrate_camera, calibrate_from_boards};
use ptzcal::control::Log;
use ptzcal::device::{Frame, FrameSource};
use ptzcal::error::Status;
use ptzcal::geometry::Distortion;
use ptzcal::report::Report;
use ptzcal::rig::{FixedCamera, Rig, RigOptions, RigParts, ScanOptions, ScanRegion, scan_region};
use ptzcal::sim::{SimOptions, Simulator};

/// A simulated room, scanned, calibrated alone and as a survey.
fn report() -> Report {
    let simulator = Simulator::new(SimOptions::parse("sim:room?seed=1").unwrap()).unwrap();
    let parts = RigParts {
        model: simulator.nominal_rig(),
        ptz: Box::new(simulator.ptz()),
        laser: Box::new(simulator.laser()),
        frames: Box::new(simulator.head_frames()),
        clock: simulator.clock(),
        log: Log::silent(),
    };
    let mut rig = Rig::open(parts, RigOptions::default()).unwrap();
    let camera = simulator.truth().fixed[0];
    let mut cameras = [FixedCamera::new(Box::new(simulator.fixed_frames(0).unwrap()), camera.width, camera.height)];
    let region = ScanRegion { pan: [-0.45, 0.25], tilt: [-0.33, 0.28], pan_steps: 22, tilt_steps: 16 };
    let mut watch = |_: &ptzcal::rig::Progress<'_>| ControlFlow::Continue(());
    let scan = scan_region(&mut rig, &region, &ScanOptions::default(), &mut cameras, &mut watch).unwrap();
    let set = scan.correspondences(0).unwrap();
    let options = CalibrationOptions { distortion: DistortionModel::Radial2, ..Default::default() };
    let calibration = calibrate_camera(&set, &options).unwrap();
    let mut picture = Frame::empty();
    let mut frames = simulator.fixed_frames(0).unwrap();
    frames.next_frame(simulator.clock().now(), 1.0, &mut picture).unwrap();

    let mut survey = Adjustment::new(scan.model).unwrap();
    survey.add_station(Station::world()).unwrap();
    let setup = CameraSetup { distortion: DistortionModel::Radial2, ..CameraSetup::new(camera.width, camera.height) };
    survey.add_camera(setup).unwrap();
    scan.add_to(&mut survey, 0, &[Some(0)]).unwrap();
    let adjusted = adjust(&survey, &AdjustOptions { pointing_sigma: [9e-5; 2], ..Default::default() }).unwrap();

    let mut report = Report::new("The hall, <north> & south").unwrap();
    report.add_note("A simulated room, seed 1.").unwrap();
    report.add_calibration("hall", &calibration, Some(&set), Some(&picture.image.view().unwrap())).unwrap();
    report.add_scan("first scan", &scan).unwrap();
    report.add_survey("survey", &adjusted).unwrap();
    report.add_input("nothing", b"").unwrap();
    let set_of_boards = views();
    let of_boards = calibrate_from_boards(&set_of_boards, &options).unwrap();
    report.add_board_calibration("head camera", &of_boards, &set_of_boards).unwrap();
    let html = report.to_html();
    // What is written is what was found.
    let place = |text: &str| html.split(text).nth(1).unwrap_or_else(|| panic!("no {text}"));
    let cell = |text: &str| -> f64 {
        let rest = place(&format!("<td>{text}</td><td class=\"n\">"));
        rest.split('<').next().unwrap().parse().unwrap()
    };
    let sigma = calibration.covariance[(0, 0)].sqrt();
    assert!((cell("focal length x") - calibration.camera.intrinsics.fx).abs() < 0.1 * sigma);
    assert!((cell("position z") - calibration.camera.centre().z).abs() < 1e-3);
    let used = calibration.inliers.iter().filter(|i| **i).count();
    assert!(html.contains(&format!("{used} of {} measurements were used", set.len())));
    assert!(
        html.contains(&format!("of {} measurements were used", 225 * 12)) && html.contains("12 of 12 views were used")
    );
    let seen = scan.counts();
    assert!(html.contains(&format!("<td>head</td><td class=\"n\">{}</td>", seen.head)));
    assert!(html.contains(&format!("<td>fixed 0</td><td class=\"n\">{}</td>", seen.fixed[0])));
    report
}

/// Twelve views of a board by a lens.
fn views() -> ptzcal::calibrate::Boards {
    let camera = boards::head(Distortion::BrownConrady([-0.2, 0.05, 0.0, 0.0, 0.0]));
    boards::with_spots(&camera, &boards::poses(12, 1.0, 4.0), 0.2, &mut thesis::Noise::new(4))
}

#[test]
fn a_report_says_what_was_found_and_fits_every_page() {
    let report = report();
    let html = report.to_html();
    assert_eq!(html, report.to_html());
    assert!(html.contains("<title>The hall, &lt;north&gt; &amp; south</title>") && !html.contains("<north>"));
    // SHA-256 of nothing (FIPS 180-4).
    assert!(html.contains("e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"));
    assert!(
        !html.contains("<script") && !html.contains("NaN") && !html.contains("inf"),
        "no scripts, no numbers that are none"
    );
    let folder = data::target().join("report");
    fs::create_dir_all(&folder).unwrap();
    report.save(&folder.join("report.html")).unwrap();
    let Some(browser) = browser() else {
        println!("SKIPPED the report in a browser: chromium is not installed");
        return;
    };
    for width in [390, 1280] {
        let [inner, scroll] = layout(&browser, &folder, width);
        assert!(scroll <= inner, "at {inner} px the page is {scroll} px wide");
    }
}

fn browser() -> Option<String> {
    ["chromium", "chromium-browser", "google-chrome"]
        .into_iter()
        .map(str::to_owned)
        .find(|name| Command::new(name).arg("--version").output().is_ok_and(|o| o.status.success()))
}

/// Width of a window, and of what the report needs in it.
fn layout(browser: &str, folder: &Path, width: u32) -> [u32; 2] {
    let page = format!(
        "<html><body><iframe id=\"f\" src=\"report.html\" style=\"width:{width}px;height:900px;border:0\"></iframe>\
         <p id=\"o\"></p><script>const f=document.getElementById('f');f.onload=()=>{{\
         const d=f.contentDocument.documentElement;\
         document.getElementById('o').textContent='WID'+'THS '+d.clientWidth+' '+d.scrollWidth+' E'+'ND';}}</script></body></html>"
    );
    let frame = folder.join(format!("frame{width}.html"));
    fs::write(&frame, page).unwrap();
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files"])
        .args(["--virtual-time-budget=10000", "--dump-dom"])
        .arg(format!("file://{}", frame.canonicalize().unwrap().display()))
        .output()
        .unwrap();
    let dom = String::from_utf8_lossy(&output.stdout);
    let widths = dom.split("WIDTHS ").last().and_then(|rest| rest.split(" END").next());
    let mut numbers = widths.unwrap_or_default().split(' ').map(|n| n.parse().unwrap());
    let mut next = || numbers.next().unwrap_or_else(|| panic!("the browser says: {dom}"));
    [next(), next()]
}

#[test]
fn what_does_not_belong_together_is_refused_and_leaves_nothing() {
    let mut report = Report::new("empty").unwrap();
    let empty = report.to_html();
    assert_eq!(report.set_up(&Vector3::zeros()).unwrap_err().status(), Status::InvalidArgument);
    assert_eq!(report.set_up(&Vector3::new(0.0, f64::NAN, 0.0)).unwrap_err().status(), Status::NotFinite);
    let long = "x".repeat(200_000);
    assert_eq!(report.add_note(&long).unwrap_err().status(), Status::InvalidArgument);
    assert_eq!(report.add_input(&long, b"").unwrap_err().status(), Status::InvalidArgument);
    assert_eq!(Report::new(&long).unwrap_err().status(), Status::InvalidArgument);
    assert_eq!(report.to_html(), empty);
    assert_eq!(report.save(Path::new("/no/such/folder/report.html")).unwrap_err().status(), Status::FileIo);
}
