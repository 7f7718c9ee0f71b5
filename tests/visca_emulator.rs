//! A whole scan through real bytes: rig, driver and emulated camera against the simulator's own head.

use std::ops::ControlFlow::Continue;
use std::time::Instant;

use ptzcal::Error;
use ptzcal::control::{Log, LogLevel};
use ptzcal::device::visca::models::Model;
use ptzcal::device::{Address, PanTiltZoom, Surroundings, open_ptz};
use ptzcal::rig::{Rig, RigOptions, RigParts, Scan, ScanEnd, ScanOptions, ScanRegion, scan_region};
use ptzcal::sim::visca_device::{EmulatorOptions, ServerBuilder, ViscaDevice};
use ptzcal::sim::{SimOptions, Simulator};

/// The encoder step of the EVI-D100 is a 14.4th of a degree.
const DIRECT: &str = "sim:room?cameras=0&step_deg=0.06944444444444445";

fn simulator(address: &str) -> Simulator {
    Simulator::new(SimOptions::parse(address).unwrap()).unwrap()
}

fn region(pan_steps: u32, tilt_steps: u32) -> ScanRegion {
    ScanRegion { pan: [-0.45, 0.4], tilt: [-0.3, 0.3], pan_steps, tilt_steps }
}

fn rig(simulator: &Simulator, ptz: Box<dyn PanTiltZoom>) -> Rig {
    let parts = RigParts {
        model: simulator.nominal_rig(),
        ptz,
        laser: Box::new(simulator.laser()),
        frames: Box::new(simulator.head_frames()),
        clock: simulator.clock(),
        log: Log::to(|level, message| {
            if level < LogLevel::Debug {
                println!("{level:?}: {message}");
            }
        }),
    };
    Rig::open(parts, RigOptions::default()).unwrap()
}

fn scan(simulator: &Simulator, ptz: Box<dyn PanTiltZoom>, region: &ScanRegion) -> Scan {
    let start = Instant::now();
    let mut rig = rig(simulator, ptz);
    let scan = scan_region(&mut rig, region, &ScanOptions::default(), &mut [], &mut |_| Continue(())).unwrap();
    println!(
        "{} shots, {} spots, {:.0} s of the rig's time in {:.1} s",
        scan.shots.len(),
        scan.counts().head,
        simulator.clock().now(),
        start.elapsed().as_secs_f64()
    );
    scan
}

fn direct(seed: u64, region: &ScanRegion) -> Scan {
    let simulator = simulator(&format!("{DIRECT}&seed={seed}"));
    scan(&simulator, Box::new(simulator.ptz()), region)
}

/// Distances, metres, of the points that two scans have measured at the same positions. Their
/// readings must be the same.
fn distances(a: &Scan, b: &Scan) -> Vec<f64> {
    let points = |scan: &Scan| scan.points().into_iter().map(|p| (scan.shots[p.shot].index, p)).collect::<Vec<_>>();
    let others = points(b);
    let mut distances = Vec::new();
    for (index, point) in points(a) {
        let Some((_, other)) = others.iter().find(|(i, _)| *i == index) else { continue };
        let (from, to) = (&a.shots[point.shot], &b.shots[other.shot]);
        assert!((from.pan - to.pan).abs() < 1e-6 && (from.tilt - to.tilt).abs() < 1e-6, "{from:?} {to:?}");
        distances.push((point.position - other.position).norm());
    }
    distances
}

fn median(distances: impl IntoIterator<Item = Vec<f64>>) -> f64 {
    let mut all: Vec<f64> = distances.into_iter().flatten().collect();
    all.sort_by(f64::total_cmp);
    all[all.len() / 2]
}

/// Asserts that a scan differs from direct ones about as they differ from each other.
/// (Medians of 12 and 41 points with depths of 1 to 6 m: chance alone makes half as much again.)
fn assert_as_good(scan: &Scan, direct: &[Scan], least_points: usize) {
    let against = |scan: &Scan, others: &[&Scan]| median(others.iter().map(|other| distances(other, scan)));
    let others = |i: usize| (0..direct.len()).filter(|j| *j != i).map(|j| &direct[j]).collect::<Vec<_>>();
    let worst = (0..direct.len()).map(|i| against(&direct[i], &others(i))).fold(0.0, f64::max);
    let off = against(scan, &direct.iter().collect::<Vec<_>>());
    let points = distances(&direct[0], scan).len();
    println!("median distance to other scans: {:.2} mm; of direct ones, at most {:.2} mm", off * 1e3, worst * 1e3);
    assert!(points >= least_points && off < 2.0 * worst, "{points} points, {off} against {worst}");
}

/// Without noise of pictures and rest positions nothing is left that may differ.
#[test]
fn a_scan_through_bytes_is_the_same_to_the_last_bit_that_matters() {
    let (region, calm) = (region(12, 9), "noise=0&shot=0&repeatability_deg=0");
    let direct = simulator(&format!("{DIRECT}&{calm}"));
    let direct = scan(&direct, Box::new(direct.ptz()), &region);
    for model in ["evi-d100", "ptzoptics"] {
        let simulator = simulator(&format!("sim:room?cameras=0&{calm}&visca={model}"));
        let through_bytes = scan(&simulator, simulator.open_ptz(Log::silent()).unwrap(), &region);
        assert!(through_bytes.is_complete(), "{:?}", through_bytes.end);
        let distances = distances(&direct, &through_bytes);
        let worst = distances.iter().fold(0.0, |worst: f64, d| worst.max(*d));
        println!("{model}: {} points, at most {worst:.1e} m apart", distances.len());
        assert!(distances.len() > 90 && worst < 1e-6, "{worst}");
    }
}

#[test]
fn a_scan_through_bytes_is_as_good_as_a_direct_one() {
    let region = region(12, 9);
    let direct: Vec<Scan> = (1..=3).map(|seed| direct(seed, &region)).collect();
    let by_bytes = |seed: u32| {
        let simulator = simulator(&format!("sim:room?cameras=0&seed={seed}&visca=evi-d100"));
        let scan = scan(&simulator, simulator.open_ptz(Log::silent()).unwrap(), &region);
        assert!(scan.is_complete(), "{:?}", scan.end);
        direct.iter().map(|d| distances(d, &scan)).collect::<Vec<_>>()
    };
    let noise = median([[0, 1], [0, 2], [1, 2]].map(|[i, j]| distances(&direct[i], &direct[j])));
    let off = median((4..=6).flat_map(by_bytes));
    println!("median distance of points of two scans: {:.2} mm, one by bytes: {:.2} mm", noise * 1e3, off * 1e3);
    // Medians of about 300 and 900 distances, of which each third is independent: 10 % each.
    assert!((0.7..1.35).contains(&(off / noise)), "{off} against {noise}");
}

/// A scan ends when the plug is pulled, and goes on from its journal when it is in again: the same
/// rig, whose driver opens the line anew.
#[test]
fn a_scan_survives_a_bad_line_and_a_pulled_plug() {
    let region = region(8, 6);
    let direct: Vec<Scan> = (1..=4).map(|seed| direct(seed, &region)).collect();
    let simulator = simulator("sim:room?cameras=0&seed=5&step_deg=0");
    let faults = [
        "drop-byte=0.0005",
        "garble-byte=0.0005",
        "lose=0.002",
        "wrong-address=0.002",
        "delay=0.01:0.3",
        "duplicate=0.01",
        "split=0.02:0.05",
        "unplug@20:4",
    ];
    let options =
        EmulatorOptions { faults: faults.iter().map(|f| f.parse().unwrap()).collect(), ..EmulatorOptions::default() };
    let device = ViscaDevice::with_simulator(&options, &simulator).unwrap();
    let head = device.head(1, Some(&Model::EVI_D100), Log::silent()).unwrap();
    let mut rig = rig(&simulator, Box::new(head));
    let folder = tempfile::tempdir().unwrap();
    let options = ScanOptions { journal: Some(folder.path().join("journal")), ..ScanOptions::default() };
    let mut ends = Vec::new();
    let scan = loop {
        let scan = scan_region(&mut rig, &region, &options, &mut [], &mut |_| Continue(())).unwrap();
        // However it ends, the laser is off.
        assert!(!rig.laser().is_on());
        ends.push(scan.end.clone());
        if scan.is_complete() || ends.len() == 5 {
            break scan;
        }
        simulator.clock().sleep(5.0);
    };
    println!("{ends:?}, {} s", simulator.clock().now());
    assert!(scan.is_complete() && scan.resumed > 0, "{ends:?}");
    assert!(ends.iter().any(|end| matches!(end, ScanEnd::Failed(Error::DeviceLost { .. }))), "{ends:?}");
    assert_eq!(device.emulator().times_unplugged(), 1);
    assert_as_good(&scan, &direct, 40);
}

#[test]
fn a_scan_through_a_pseudo_terminal_in_real_time() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("camera");
    let region = region(4, 3);
    let direct: Vec<Scan> = (1..=6).map(|seed| direct(seed, &region)).collect();
    let simulator = simulator("sim:room?cameras=0&seed=7&step_deg=0&real_time=5");
    let device = ViscaDevice::with_simulator(&EmulatorOptions::default(), &simulator).unwrap();
    let mut builder = ServerBuilder::new(&device);
    builder.pty(&path).unwrap();
    let _server = builder.start().unwrap();
    let address = Address::parse(&format!("visca://{}?model=auto", path.display())).unwrap();
    let surroundings = Surroundings { clock: simulator.clock(), ..Surroundings::default() };
    let head = open_ptz(&address, &surroundings).unwrap();
    let scan = scan(&simulator, head, &region);
    assert!(scan.is_complete(), "{:?}", scan.end);
    assert_as_good(&scan, &direct, 10);
}

#[path = "../examples/visca_emulator.rs"]
#[allow(dead_code)]
mod example;

#[test]
fn the_example_reads_its_arguments() {
    let parse = |text: &str| example::Arguments::parse(text.split_whitespace().map(str::to_owned));
    let read =
        parse("--tcp 127.0.0.1:5678 --model evi-d30,brc-300 --fault unplug@3:1 --speed 20 --baud 38400").unwrap();
    let read = read.unwrap();
    assert_eq!(read.options.models, [&Model::EVI_D30, &Model::BRC_300]);
    assert!(read.pty.is_none() && read.tcp.len() == 1 && read.options.faults.len() == 1 && read.speed == 20.0);
    assert!(parse("").unwrap().unwrap().pty.is_some());
    assert_eq!(parse("--help").unwrap(), None);
    for bad in ["--model vcr", "--speed 0", "--speed fast", "--fault noise=1", "--ip here", "--pty", "camera"] {
        assert!(parse(bad).is_err(), "{bad}");
    }
}
