//! Real kernel devices without hardware: a GPIO chip and cameras in a small virtual machine.
//!
//! The tests of `inside` are marked as ignored; those here boot the machine and run them in it. The
//! machine is the program `run-in-vm`, beside the checkout or where PTZCAL_RUN_IN_VM says; without
//! it, or where it cannot work, a line says that these tests are skipped.
#![cfg(target_os = "linux")]

mod inside;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

#[test]
fn lasers_on_gpio_lines_in_the_machine() {
    run_inside(&["inside::laser::"], &[]);
}

#[cfg(feature = "v4l2")]
#[test]
fn v4l2_cameras_in_the_machine() {
    let share = tempfile::tempdir().unwrap();
    let folder = share.path().to_str().unwrap();
    if run_inside(&["inside::camera::", "inside::scene::"], &[("PTZCAL_VM_SHARE", folder)]) {
        inside::scene::check(share.path());
    }
}

/// Its device, v4l2loopback, is compiled for the machine once.
#[cfg(feature = "v4l2")]
#[test]
fn motion_jpeg_in_the_machine() {
    run_inside(&["inside::motion_jpeg::"], &[("PTZCAL_VM_LOOPBACK", "1")]);
}

/// Runs the ignored tests of modules in the machine; false when there is none to be had.
fn run_inside(modules: &[&str], settings: &[(&str, &str)]) -> bool {
    let program = std::env::var_os("PTZCAL_RUN_IN_VM")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/vm/run-in-vm"), PathBuf::from);
    let skipped = |why: &str| {
        // Past a test runner's capture.
        let _ = writeln!(std::io::stderr(), "SKIPPED: {modules:?} need a virtual machine: {why}");
        false
    };
    if !program.is_file() {
        return skipped(&format!("there is no {} (set PTZCAL_RUN_IN_VM)", program.display()));
    }
    let guard = env!("CARGO_BIN_EXE_ptzcal-laser-guard");
    let output = Command::new(program)
        .arg(std::env::current_exe().unwrap())
        .args(modules)
        .args(["--ignored", "--nocapture", "--test-threads=1"])
        .env("PTZCAL_LASER_GUARD", guard)
        .env("PTZCAL_VM_FILES", guard)
        .env("PTZCAL_VM_TIMEOUT", "180")
        .envs(settings.iter().copied())
        .output()
        .unwrap();
    let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    if output.status.code() == Some(77) {
        return skipped(text.trim());
    }
    // The figures measured inside.
    print!("{text}");
    assert!(output.status.success(), "{modules:?} failed in the machine: {}", output.status);
    assert!(!text.contains(" 0 passed"), "no test was run in the machine");
    true
}
