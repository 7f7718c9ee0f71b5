//! Instructions of the hot paths, counted by callgrind: unlike times they are the same on a busy
//! machine, so a slow-down is seen. They depend on the compiler and the processor's vector units:
//! counts of others are not compared.
//!
//! `PTZCAL_UPDATE_COUNTS=1 cargo test --test instruction_counts` writes the file anew.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Command;
use std::{env, fs};

#[path = "support/boards.rs"]
mod boards;
#[path = "support/room.rs"]
mod room;
#[path = "support/thesis.rs"]
mod thesis;
#[path = "../benches/work/mod.rs"]
mod work;

/// Names the task that a child of this test does.
const TASK: &str = "PTZCAL_COUNTED_TASK";
/// Greatest growth that passes. Rounding alone changes counts of iterative solvers by a percent or two.
const TOLERANCE: f64 = 0.10;

fn file() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/instruction_counts.txt")
}

/// What counts depend on, beside the sources.
fn built_with() -> String {
    let output =
        Command::new("rustc").arg("--version").output().map(|o| String::from_utf8_lossy(&o.stdout).trim().to_owned());
    format!("{}, {}", output.unwrap_or_else(|_| "unknown compiler".into()), vectors())
}

#[cfg(target_arch = "x86_64")]
fn vectors() -> &'static str {
    // Callgrind hides what lies beyond.
    if is_x86_feature_detected!("avx2") { "x86-64 with AVX2" } else { "x86-64" }
}

#[cfg(not(target_arch = "x86_64"))]
fn vectors() -> &'static str {
    env::consts::ARCH
}

/// What callgrind counts: the second time, when caches are filled and buffers made.
#[inline(never)]
fn counted_work(work: &mut work::Work) {
    work();
}

/// In a child under callgrind: one of the tasks.
#[test]
fn counted_task() {
    let Ok(name) = env::var(TASK) else { return };
    let task = work::TASKS.iter().find(|t| t.name == name).expect("a task");
    let mut work = (task.prepare)(task.counted);
    work();
    counted_work(&mut work);
}

fn count(task: &work::Task, folder: &std::path::Path) -> u64 {
    let out = folder.join("callgrind.out");
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--collect-atstart=no", "--toggle-collect=*counted_work*"])
        .arg(format!("--callgrind-out-file={}", out.display()))
        .arg(env::current_exe().unwrap())
        .args(["--exact", "counted_task", "--test-threads=1"])
        .env(TASK, task.name)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {said}{}", task.name, String::from_utf8_lossy(&output.stdout));
    let line = said.lines().find_map(|l| l.split("Collected :").nth(1)).unwrap_or_else(|| panic!("{said}"));
    line.trim().parse().unwrap()
}

fn expected() -> (String, BTreeMap<String, u64>) {
    let text = fs::read_to_string(file()).unwrap_or_default();
    let of = text.lines().find_map(|l| l.strip_prefix("# built with ")).unwrap_or_default();
    let rows = text.lines().filter(|l| !l.starts_with('#')).filter_map(|l| l.split_once(": "));
    (of.to_owned(), rows.map(|(name, n)| (name.to_owned(), n.parse().unwrap())).collect())
}

#[test]
fn hot_paths_take_no_more_instructions_than_they_did() {
    if Command::new("valgrind").arg("--version").output().is_err() {
        println!("SKIPPED instruction counts: valgrind is not installed");
        return;
    }
    let update = env::var_os("PTZCAL_UPDATE_COUNTS").is_some();
    let (of, expected) = expected();
    let here = built_with();
    if !update && of != here {
        println!("SKIPPED instruction counts: they are of {of}, this is {here}");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut text = format!("# Instructions of one call, see instruction_counts.rs.\n# built with {here}\n");
    let mut slower = Vec::new();
    for task in work::TASKS {
        let counted = count(task, folder.path());
        text += &format!("{}: {counted}\n", task.name);
        let before = expected.get(task.name).copied().unwrap_or(0);
        println!(
            "{:48} {counted:>12}, was {before:>12}: {:+.1} %",
            task.name,
            1e2 * (counted as f64 / before as f64 - 1.0)
        );
        if counted as f64 > before as f64 * (1.0 + TOLERANCE) {
            slower.push(task.name);
        }
    }
    if update {
        fs::write(file(), text).unwrap();
        return;
    }
    assert!(slower.is_empty(), "more instructions than before, or never counted: {slower:?}");
}
