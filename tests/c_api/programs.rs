//! The programs of tests/c, as users build and run them: against the shared library, against the
//! archive, under valgrind, and with gcc's address and undefined-behaviour sanitizers.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::tools::{compiler, has, library, root, run, strict};

/// What a program that links libptzcal.a needs besides (`rustc --print native-static-libs`).
const SYSTEM: [&str; 6] = ["-lgcc_s", "-lutil", "-lrt", "-lpthread", "-lm", "-ldl"];

pub enum Link {
    Shared,
    Archive,
}

/// Compiles one program into `folder`.
pub fn compile(source: &Path, folder: &Path, link: Link, flags: &[&str]) -> PathBuf {
    let program = folder.join(source.file_stem().unwrap());
    let cpp = source.extension().is_some_and(|e| e == "cpp");
    let mut command = strict(cpp, if cpp { "c++17" } else { "c99" });
    command.args(["-g", "-D_POSIX_C_SOURCE=200809L", "-pthread", "-I"]).arg(root().join("tests/c"));
    command.args(flags).arg(source).arg("-o").arg(&program);
    match link {
        Link::Shared => {
            let path = library().folder().to_str().unwrap();
            command.arg(format!("-L{path}")).arg("-lptzcal").arg(format!("-Wl,-rpath,{path}"));
        }
        Link::Archive => {
            command.arg(library().archive()).args(SYSTEM);
        }
    }
    run(command.args(["-lm", "-ldl"]));
    program
}

/// The program with its two arguments: the shared library, and a folder to write in.
pub fn call(program: &Path, wrapper: &[&str]) {
    let mut words = wrapper.iter();
    let mut command = words.next().map_or_else(|| Command::new(program), Command::new);
    command.args(words);
    if !wrapper.is_empty() {
        command.arg(program);
    }
    let folder = program.parent().unwrap();
    run(command.arg(library().shared()).arg(folder).current_dir(folder));
}

pub const VALGRIND: [&str; 7] = [
    "valgrind",
    "--quiet",
    "--error-exitcode=99",
    "--leak-check=full",
    "--errors-for-leak-kinds=definite,indirect,possible",
    "--child-silent-after-fork=yes",
    concat!("--suppressions=", env!("CARGO_MANIFEST_DIR"), "/tests/c_api/valgrind.supp"),
];

pub const SANITIZERS: [&str; 3] =
    ["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer"];

pub fn has_sanitizers() -> bool {
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("empty.c");
    fs::write(&source, "int main(void) { return 0; }\n").unwrap();
    let program = folder.path().join("empty");
    let built = Command::new(compiler(false)).args(SANITIZERS).arg(&source).arg("-o").arg(&program).output();
    let works = built.is_ok_and(|o| o.status.success()) && Command::new(program).status().is_ok_and(|s| s.success());
    works || has("sanitizers", "the C programs with address and undefined-behaviour sanitizers")
}

fn sources() -> Vec<PathBuf> {
    let entries = fs::read_dir(root().join("tests/c")).unwrap().map(|e| e.unwrap().path());
    let mut sources: Vec<PathBuf> = entries.filter(|p| p.extension().is_some_and(|e| e == "c" || e == "cpp")).collect();
    sources.sort();
    assert!(sources.len() > 8, "the programs of tests/c are missing");
    sources
}

fn all(link: fn() -> Link, flags: &[&str], wrapper: &[&str]) {
    for source in sources() {
        let folder = tempfile::tempdir().unwrap();
        call(&compile(&source, folder.path(), link(), flags), wrapper);
    }
}

#[test]
fn programs_run_with_the_shared_library() {
    all(|| Link::Shared, &[], &[]);
}

#[test]
fn programs_run_with_the_archive() {
    all(|| Link::Archive, &[], &[]);
}

#[test]
fn programs_run_under_valgrind() {
    if has("valgrind", "the C programs under valgrind") {
        all(|| Link::Shared, &[], &VALGRIND);
    }
}

#[test]
fn programs_run_with_sanitizers() {
    if has_sanitizers() {
        all(|| Link::Shared, &SANITIZERS, &[]);
    }
}
