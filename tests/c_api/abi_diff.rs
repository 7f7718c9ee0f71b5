//! The ABI against that of the last release, whose header is tests/abi/released.h.
//!
//! What a C program depends on is what its header declared, so libabigail compares two libraries
//! that are made from the two headers alone: the Rust types behind the handles may change as they
//! like. That the real library has the declared functions and layouts is checked elsewhere
//! (exports.rs, layout.rs). Growth is allowed (COMPATIBILITY.md): new functions, new constants, and
//! new members at the end of a struct.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::tools::{has, root, run, strict};
use super::{declarations, header};

/// `make release-abi` writes it anew: at a release only.
fn released() -> String {
    fs::read_to_string(root().join("tests/abi/released.h")).unwrap()
}

/// `new` without the members that its structs have gained at their ends since `old`.
fn without_growth(new: &str, old: &str) -> String {
    let old = declarations::parse(old).structs;
    let mut text = new.to_owned();
    for s in declarations::parse(new).structs {
        let Some(known) = old.iter().find(|o| o.name == s.name) else { continue };
        if s.members.len() > known.members.len() && s.members.starts_with(&known.members) {
            let begin = text.find(&format!("typedef struct {} {{", s.name)).unwrap();
            let end = begin + text[begin..].find(&format!("}} {};", s.name)).unwrap();
            let last = known.members.last().unwrap();
            let is_last = |l: &str| declarations::member_name(l.trim_end_matches(';')) == *last && l.ends_with(';');
            let kept: usize = {
                let lines = text[begin..end].split_inclusive('\n');
                let before = lines.take_while(|l| !is_last(l.trim())).map(str::len).sum::<usize>();
                before + text[begin + before..].find('\n').unwrap() + 1
            };
            text.replace_range(begin + kept..end, "");
        }
    }
    text
}

/// What libabigail sees of a library of empty functions with the header's declarations.
fn abi_of(header: &str, folder: &Path, name: &str) -> PathBuf {
    let (source, library) = (folder.join(format!("{name}.c")), folder.join("libptzcal.so"));
    let mut code = header.to_owned();
    for f in declarations::parse(header).functions {
        let params: Vec<String> = f.params.iter().map(|p| format!("{} {}", p.kind, p.name)).collect();
        let params = if params.is_empty() { "void".to_owned() } else { params.join(", ") };
        let result = if f.returns == "void" { "" } else { "return 0;" };
        code += &format!("{} {}({params}) {{ {result} }}\n", f.returns, f.name);
    }
    fs::write(&source, code).unwrap();
    let flags = ["-Wno-unused-parameter", "-g", "-shared", "-fPIC", "-nostdlib", "-o"];
    run(strict(false, "c99").args(flags).arg(&library).arg(&source));
    let abi = folder.join(format!("{name}.abi"));
    run(Command::new("abidw").args(["--no-comp-dir-path", "--no-corpus-path", "--out-file"]).arg(&abi).arg(library));
    abi
}

/// What libabigail says about a program built with `old` that meets `new`; empty when it runs.
fn breaks(old: &str, new: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let new = abi_of(&without_growth(new, old), folder.path(), "new");
    let old = abi_of(old, folder.path(), "old");
    let output = Command::new("abidiff").arg("--no-added-syms").arg(old).arg(new).output().unwrap();
    // Bits of the exit status: 1 error, 2 usage, 4 change, 8 incompatible change.
    let code = output.status.code().unwrap();
    assert!(code & 3 == 0, "abidiff: {}", String::from_utf8_lossy(&output.stderr));
    if code == 0 { String::new() } else { String::from_utf8(output.stdout).unwrap() }
}

#[test]
fn programs_built_with_the_released_header_still_run() {
    if has("abidw", "the ABI against the released one") {
        let report = breaks(&released(), &header::text());
        assert!(report.is_empty(), "the ABI is broken:\n{report}");
    }
}

/// The check itself: it lets growth pass and finds every kind of break.
#[test]
fn the_check_tells_growth_from_breaks() {
    if !has("abidw", "the ABI check's own check") {
        return;
    }
    let text = header::text();
    let breaks = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        !breaks(&text, &text.replacen(from, to, 1)).is_empty()
    };
    let version = "uint32_t ptzcal_abi_version(void) PTZCAL_NOEXCEPT;";
    assert!(!breaks(version, &format!("{version}\nint ptzcal_new_verb(int x) PTZCAL_NOEXCEPT;")), "a new function");
    assert!(!breaks("} ptzcal_camera;", "  /** New. */\n  double more;\n} ptzcal_camera;"), "a new member");
    assert!(breaks(version, ""), "a lost function");
    assert!(breaks(version, "uint64_t ptzcal_abi_version(void) PTZCAL_NOEXCEPT;"), "another result");
    assert!(breaks("double half_width,", "float half_width,"), "another argument");
    assert!(breaks("double distortion[8];", "double distortion[9];"), "another layout");
    assert!(breaks("  double skew;\n", "  uint64_t skew;\n"), "another type of the same size");
    assert!(breaks("  double skew;\n", ""), "a lost member");
}

/// `NAME value` of every constant.
fn constants(header: &str) -> BTreeSet<String> {
    let of_enum = |l: &str| Some(l.strip_prefix("  ")?.strip_suffix(',')?.replace(" = ", " "));
    let of_define = |l: &str| l.strip_prefix("#define ").map(str::to_owned);
    let lines = header.lines().filter_map(|l| of_enum(l).or_else(|| of_define(l)));
    lines
        .filter(|l| l.starts_with("PTZCAL_") && l.split(' ').nth(1).is_some_and(|v| v.parse::<i64>().is_ok()))
        .collect()
}

/// A number that was given to a name once means the same for ever. (Needs no tool.)
#[test]
fn released_constants_and_functions_are_kept() {
    let (old, new) = (released(), header::text());
    let pinned = constants(&old);
    assert!(pinned.len() > 40, "the constants were not read");
    let lost: Vec<_> = pinned.difference(&constants(&new)).cloned().collect();
    assert!(lost.is_empty(), "changed or lost: {lost:?}");
    let names =
        |text: &str| -> BTreeSet<String> { declarations::parse(text).functions.into_iter().map(|f| f.name).collect() };
    let lost: Vec<_> = names(&old).difference(&names(&new)).cloned().collect();
    assert!(lost.is_empty(), "lost: {lost:?}");
}
