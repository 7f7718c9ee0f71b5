//! The manual: its links lead somewhere, and it builds without a warning where Doxygen is installed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn pages() -> Vec<PathBuf> {
    let folders = ["", "docs", "bindings/python"].map(|folder| root().join(folder));
    let entries = folders.iter().flat_map(|f| fs::read_dir(f).unwrap()).map(|e| e.unwrap().path());
    let mut pages: Vec<PathBuf> = entries.filter(|p| p.extension().is_some_and(|e| e == "md")).collect();
    pages.sort();
    pages
}

#[test]
fn links_lead_to_files() {
    let pages = pages();
    assert!(pages.len() > 10);
    let mut links = 0;
    for page in pages {
        let text = fs::read_to_string(&page).unwrap();
        for target in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let file = target.split('#').next().unwrap();
            if file.is_empty() || file.contains("://") || file.contains(char::is_whitespace) {
                continue;
            }
            links += 1;
            assert!(page.parent().unwrap().join(file).exists(), "{}: {target}", page.display());
        }
    }
    assert!(links > 30);
}

/// Undocumented parameters and references that lead nowhere are warnings, and warnings fail (Doxyfile).
#[test]
fn the_manual_builds_without_a_warning() {
    if Command::new("doxygen").arg("--version").output().is_err() {
        println!("SKIPPED the manual: doxygen is not installed");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut doxygen = Command::new("doxygen");
    let output = doxygen.arg("docs/Doxyfile").env("PTZCAL_DOCS", folder.path()).current_dir(root()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for page in ["index.html", "md_docs_guide.html", "ptzcal_8h.html"] {
        assert!(folder.path().join("html").join(page).exists(), "{page}");
    }
}

/// A name in the man page that the header does not have would be looked for in vain.
#[test]
fn the_man_page_names_what_there_is() {
    let header = fs::read_to_string(root().join("include/ptzcal.h")).unwrap();
    let page = fs::read_to_string(root().join("docs/ptzcal.3")).unwrap();
    let names: Vec<&str> = page
        .split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'))
        .filter(|word| word.starts_with("ptzcal_") || word.starts_with("PTZCAL_STATUS"))
        .collect();
    assert!(names.len() > 20);
    for name in names {
        let found =
            header.match_indices(name).any(|(i, _)| !header[i + name.len()..].starts_with(char::is_alphanumeric));
        assert!(found, "{name} is not in the header");
    }
}

#[test]
fn the_man_page_has_no_error() {
    let Ok(output) = Command::new("groff").args(["-mdoc", "-Tutf8", "-ww"]).arg(root().join("docs/ptzcal.3")).output()
    else {
        println!("SKIPPED the man page: groff is not installed");
        return;
    };
    assert!(output.status.success() && output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}
