//! Programs in Python, for a limited time, and environments with packages for them.
#![allow(dead_code)]

use std::env;
use std::fs::File;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// What making an environment may take.
const LIMIT: Duration = Duration::from_secs(180);

/// Runs a command for a limited time; what it printed, and whether it succeeded.
pub fn output(command: &mut Command, limit: Duration) -> (bool, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("output");
    let file = File::create(&path).unwrap();
    let errors = file.try_clone().unwrap();
    let Ok(mut child) = command.stdin(Stdio::null()).stdout(file).stderr(errors).spawn() else {
        return (false, format!("{command:?} cannot be started"));
    };
    let end = Instant::now() + limit;
    let success = loop {
        match child.try_wait().unwrap() {
            Some(status) => break Some(status.success()),
            None if Instant::now() < end => sleep(Duration::from_millis(20)),
            None => {
                let _ = child.kill();
                let _ = child.wait();
                break None;
            }
        }
    };
    let mut text = String::from_utf8_lossy(&std::fs::read(&path).unwrap()).into_owned();
    if success.is_none() {
        text += &format!("\n{command:?} took longer than {limit:?}");
    }
    (success == Some(true), text)
}

/// `PYTHON`, or python3.
pub fn system_python() -> PathBuf {
    PathBuf::from(env::var_os("PYTHON").unwrap_or("python3".into()))
}

/// The Python of target/`folder`, into which pip puts packages; they are there once `imports` can be
/// imported. `None`, with a line that says so, where they cannot be had.
pub fn environment(folder: &str, packages: &[&str], imports: &str) -> Option<PathBuf> {
    let target = env::var_os("CARGO_TARGET_DIR")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("target"), PathBuf::from);
    let folder = target.join(folder);
    let python = folder.join("bin/python");
    let has = || output(Command::new(&python).args(["-c", &format!("import {imports}")]), Duration::from_secs(60)).0;
    if has() {
        return Some(python);
    }
    let mut make = Command::new(system_python());
    let mut fill = Command::new(&python);
    fill.args(["-m", "pip", "install", "--quiet", "--retries", "1", "--timeout", "15"]).args(packages);
    if output(make.args(["-m", "venv"]).arg(&folder), LIMIT).0 && output(&mut fill, LIMIT).0 && has() {
        return Some(python);
    }
    // Past the test runner's capture.
    let _ = writeln!(
        std::io::stderr(),
        "SKIPPED: python3 with {} is not installed, and pip cannot install it",
        packages.join(", ")
    );
    None
}
