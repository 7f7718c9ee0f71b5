//! The built library, for tests that are programs in other languages.
#![allow(dead_code)]

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use std::time::SystemTime;

pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The library as a user has it: libptzcal.so.N, libptzcal.so, libptzcal.a, in a folder of its own.
pub struct Library {
    folder: tempfile::TempDir,
}

impl Library {
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    pub fn shared(&self) -> PathBuf {
        self.folder().join("libptzcal.so")
    }

    pub fn archive(&self) -> PathBuf {
        self.folder().join("libptzcal.a")
    }
}

pub fn library() -> &'static Library {
    static LIBRARY: OnceLock<Library> = OnceLock::new();
    LIBRARY.get_or_init(|| {
        // `cargo test` builds all crate types of the library beside this test's executable.
        let built = env::current_exe().unwrap().parent().unwrap().to_owned();
        if !is_fresh(&built) {
            build(&built);
            assert!(is_fresh(&built), "cargo built no libptzcal.so and libptzcal.a in {}", built.display());
        }
        let folder = tempfile::tempdir().unwrap();
        let soname = format!("libptzcal.so.{}", ptzcal::capi::version::PTZCAL_ABI_VERSION);
        for (from, to) in [("libptzcal.so", "libptzcal.so"), ("libptzcal.so", &soname), ("libptzcal.a", "libptzcal.a")]
        {
            std::os::unix::fs::symlink(built.join(from), folder.path().join(to)).unwrap();
        }
        Library { folder }
    })
}

fn modified(path: &Path) -> Option<SystemTime> {
    fs::metadata(path).and_then(|m| m.modified()).ok()
}

fn newest(folder: &Path) -> Option<SystemTime> {
    let entries = fs::read_dir(folder).ok()?.flatten().map(|e| e.path());
    entries.filter_map(|p| if p.is_dir() { newest(&p) } else { modified(&p) }).max()
}

fn is_fresh(built: &Path) -> bool {
    let sources = newest(&root().join("src")).max(modified(&root().join("Cargo.toml")));
    ["libptzcal.so", "libptzcal.a"].iter().all(|name| modified(&built.join(name)) >= sources)
}

/// For who runs the test's executable by hand.
fn build(built: &Path) {
    let target = built.parent().unwrap();
    let profile = target.file_name().unwrap().to_str().unwrap();
    let profile = if profile == "debug" { "test" } else { profile };
    let mut cargo = Command::new(env::var_os("CARGO").unwrap_or("cargo".into()));
    cargo.args(["build", "--lib", "--profile", profile, "--target-dir"]).arg(target.parent().unwrap());
    run(cargo.current_dir(root()));
}

/// Runs a command that must succeed; its output is told when it does not.
pub fn run(command: &mut Command) -> Output {
    let output = command.output().unwrap_or_else(|e| panic!("{command:?}: {e}"));
    assert!(
        output.status.success(),
        "{command:?}: {}\n{}\n{}",
        output.status,
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    output
}
