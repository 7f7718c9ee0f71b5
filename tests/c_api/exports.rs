//! The exported symbols: the shared library, the header and tests/abi/exports.txt agree.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::process::Command;

use super::declarations;
use super::tools::{has, library, root, run, text};

type Names = BTreeSet<String>;

/// Names, and the versions that their comments say.
fn declared() -> BTreeMap<String, String> {
    declarations::read().functions.iter().map(|f| owned((&f.name, f.since()))).collect()
}

fn listed() -> BTreeMap<String, String> {
    let list = fs::read_to_string(root().join("tests/abi/exports.txt")).unwrap();
    let lines = list.lines().filter(|l| !l.starts_with('#'));
    lines.map(|l| l.split_once(' ').unwrap_or_else(|| panic!("{l}: since when?"))).map(owned).collect()
}

fn owned((name, version): (&str, &str)) -> (String, String) {
    (name.to_owned(), version.to_owned())
}

/// A name that leaves the list breaks programs; a new one is added by hand, so that nothing is
/// exported by accident.
#[test]
fn the_header_declares_the_listed_functions() {
    assert_eq!(declared(), listed(), "header (left), tests/abi/exports.txt (right)");
}

#[test]
fn the_library_exports_the_listed_functions() {
    if !has("nm", "exported symbols") {
        return;
    }
    let symbols =
        text(&run(Command::new("nm").args(["-D", "--defined-only", "--format=posix"]).arg(library().shared())));
    let exported: Names = symbols.lines().map(|l| l.split(' ').next().unwrap().to_owned()).collect();
    let listed: Names = listed().into_keys().collect();
    assert_eq!(exported, listed, "libptzcal.so (left), tests/abi/exports.txt (right)");
}

#[test]
fn the_soname_is_the_abi_number_and_the_library_stays_loaded() {
    if !has("readelf", "soname") {
        return;
    }
    let dynamic = text(&run(Command::new("readelf").args(["-d", "-W"]).arg(library().shared())));
    let soname = format!("[libptzcal.so.{}]", ptzcal::capi::version::PTZCAL_ABI_VERSION);
    assert!(dynamic.contains(&soname), "{soname} is not in\n{dynamic}");
    assert!(dynamic.contains("NODELETE"), "{dynamic}");
    for line in dynamic.lines().filter(|l| l.contains("(NEEDED)")) {
        let system = ["libc.so.6", "libm.so.6", "libgcc_s.so.1", "ld-linux"];
        assert!(system.iter().any(|s| line.contains(s)), "it needs more than the system: {line}");
    }
}

/// cargo-c takes the soname from there.
#[test]
fn cargo_c_is_told_the_abi_number() {
    let manifest = fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let library = manifest.split("[package.metadata.capi.library]").nth(1).expect("the section of cargo-c");
    let version = format!("version = \"{}.0.0\"", ptzcal::capi::version::PTZCAL_ABI_VERSION);
    assert!(library.split("\n[").next().unwrap().contains(&version), "{version} is missing");
}
