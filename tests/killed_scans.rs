//! Scans killed at random moments, through the bytes of an emulated camera: a resumed scan holds
//! every shot that the host was told of, once.
//!
//! PTZCAL_KILLS sets how often (40).

use std::collections::BTreeSet;
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::ops::ControlFlow::{Break, Continue};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use ptzcal::control::Log;
use ptzcal::rig::{
    FixedCamera, Progress, Rig, RigOptions, RigParts, Scan, ScanEnd, ScanOptions, ScanRegion, scan_region,
};
use ptzcal::sim::{SimOptions, Simulator};

/// Set in the process that is killed: where its files are.
const FOLDER: &str = "PTZCAL_KILLED_SCAN";
const REGION: ScanRegion = ScanRegion { pan: [-0.3, 0.3], tilt: [-0.15, 0.15], pan_steps: 5, tilt_steps: 4 };

fn scan(folder: &Path, progress: &mut dyn FnMut(&Progress<'_>) -> std::ops::ControlFlow<()>) -> Scan {
    let simulator = Simulator::new(SimOptions::parse("sim:room?cameras=1&visca=evi-d100").unwrap()).unwrap();
    let parts = RigParts {
        model: simulator.nominal_rig(),
        ptz: simulator.open_ptz(Log::silent()).unwrap(),
        laser: Box::new(simulator.laser()),
        frames: Box::new(simulator.head_frames()),
        clock: simulator.clock(),
        log: Log::silent(),
    };
    let mut rig = Rig::open(parts, RigOptions::default()).unwrap();
    let camera = simulator.truth().fixed[0];
    let mut cameras = [FixedCamera::new(Box::new(simulator.fixed_frames(0).unwrap()), camera.width, camera.height)];
    let options = ScanOptions { journal: Some(folder.join("journal")), ..ScanOptions::default() };
    scan_region(&mut rig, &REGION, &options, &mut cameras, progress).unwrap()
}

/// Only in the process that is killed: scans, and notes each shot that it hears of.
#[test]
fn the_scan_that_is_killed() {
    let Some(folder) = std::env::var_os(FOLDER) else { return };
    let folder = Path::new(&folder);
    let mut heard = OpenOptions::new().append(true).create(true).open(folder.join("heard")).unwrap();
    let scan = scan(folder, &mut |progress| {
        if let Some(shot) = progress.shot {
            heard.write_all(format!("{}\n", shot.index).as_bytes()).unwrap();
        }
        Continue(())
    });
    assert_eq!(scan.end, ScanEnd::Complete);
    fs::write(folder.join("complete"), "").unwrap();
}

/// What the host was told of, each shot once over all lives of the scan.
fn heard(folder: &Path) -> BTreeSet<u32> {
    let text = fs::read_to_string(folder.join("heard")).unwrap_or_default();
    let lines: Vec<u32> = text.lines().map(|line| line.parse().unwrap()).collect();
    let set: BTreeSet<u32> = lines.iter().copied().collect();
    assert_eq!(set.len(), lines.len(), "a shot was measured twice: {lines:?}");
    set
}

/// `lives`: how often the scan was killed so far.
fn check(folder: &Path, lives: usize) -> usize {
    let heard = heard(folder);
    let resumed = scan(folder, &mut |_| Break(()));
    let kept: BTreeSet<u32> = resumed.shots.iter().map(|shot| shot.index).collect();
    assert_eq!(kept.len(), resumed.shots.len(), "a shot is there twice");
    assert!(heard.is_subset(&kept), "{heard:?} was heard, {kept:?} was kept");
    // In each life at most one was written and not yet told.
    assert!(kept.len() <= heard.len() + lives, "{heard:?} was heard, {kept:?} was kept");
    for shot in &resumed.shots {
        let (pan, tilt) = REGION.position(shot.index);
        assert!((shot.pan - pan).abs() < 2e-3 && (shot.tilt - tilt).abs() < 2e-3, "{shot:?}");
    }
    kept.len()
}

#[test]
fn a_killed_scan_loses_nothing_that_was_heard() {
    let kills: usize = std::env::var("PTZCAL_KILLS").map_or(40, |n| n.parse().unwrap());
    let (mut done, mut completed, mut kept_at_kills) = (0, 0, BTreeSet::new());
    let mut random = 12_345u64;
    while done < kills {
        let folder = tempfile::tempdir().unwrap();
        for lives in 1.. {
            let mut child = Command::new(std::env::current_exe().unwrap())
                .args(["--exact", "the_scan_that_is_killed", "--nocapture"])
                .env(FOLDER, folder.path())
                .stdout(Stdio::null())
                .spawn()
                .unwrap();
            random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            std::thread::sleep(Duration::from_micros((random >> 33) % 700_000));
            child.kill().unwrap();
            let ended = child.wait().unwrap();
            if folder.path().join("complete").exists() {
                completed += 1;
                assert_eq!(check(folder.path(), lives), REGION.len());
                break;
            }
            assert!(!ended.success());
            done += 1;
            kept_at_kills.insert(check(folder.path(), lives));
        }
    }
    println!("{done} kills, {completed} scans completed; shots kept at a kill: {kept_at_kills:?}");
    assert!(kept_at_kills.len() > 3, "the kills did not hit scans at work: {kept_at_kills:?}");
}
