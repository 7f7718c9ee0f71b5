//! Real data, which the project does not contain: beside the checkout, or where PTZCAL_DATA says.
#![allow(dead_code)]

use std::io::Write;
use std::path::PathBuf;

/// The folder `name` of the real data; `None`, with a line that says so, where it is absent.
pub fn folder(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("PTZCAL_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    let path = root.join(name);
    if path.is_dir() {
        return Some(path);
    }
    // Past a test runner's capture.
    let _ = writeln!(std::io::stderr(), "SKIPPED: real data {name} is not in {} (set PTZCAL_DATA)", root.display());
    None
}

/// Where results go: cargo's target folder.
pub fn target() -> PathBuf {
    let path = std::env::var_os("CARGO_TARGET_DIR")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("target"), PathBuf::from);
    let _ = std::fs::create_dir_all(&path);
    path
}

/// Rows of numbers from a text file; whatever is no number is skipped, with the row if nothing is left.
pub fn numbers(path: &std::path::Path) -> std::io::Result<Vec<Vec<f64>>> {
    let text = std::fs::read_to_string(path)?;
    let row = |line: &str| -> Vec<f64> {
        line.split(|c: char| c == ',' || c.is_whitespace()).filter_map(|w| w.parse().ok()).collect()
    };
    Ok(text.lines().map(row).filter(|r| !r.is_empty()).collect())
}

/// A photograph, as the library reads it.
pub fn picture(path: &std::path::Path) -> ptzcal::image::Image {
    ptzcal::format::read_picture(path).unwrap_or_else(|e| panic!("{e}"))
}
