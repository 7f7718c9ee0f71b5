//! The programs of tests/cpp and examples/cpp, with every C++ compiler that is there, with and without
//! exceptions, with sanitizers, and with cv::Mat where OpenCV is installed.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::super::programs::{SANITIZERS, call, has_sanitizers};
use super::super::tools::{compiler, has, library, root, run, text};

const NO_EXCEPTIONS: &str = "-fno-exceptions";

/// The C++ compiler, and the other usual ones.
fn compilers() -> Vec<String> {
    let mut all = vec![compiler(true)];
    for other in ["g++", "clang++"] {
        if !all.iter().any(|c| c == other) && has(other, &format!("the C++ headers with {other}")) {
            all.push(other.to_owned());
        }
    }
    all
}

fn command(compiler: &str, standard: &str, flags: &[&str]) -> Command {
    let mut command = Command::new(compiler);
    command.args([&format!("-std={standard}"), "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-g", "-pthread"]);
    for folder in ["include", "bindings/cpp", "tests/c"] {
        command.arg("-I").arg(root().join(folder));
    }
    command.args(flags);
    command
}

fn build(compiler: &str, sources: &[PathBuf], folder: &Path, flags: &[&str], libraries: &[&str]) -> PathBuf {
    let program = folder.join(sources[0].file_stem().unwrap());
    let path = library().folder().to_str().unwrap();
    let mut command = command(compiler, "c++17", flags);
    command.args(sources).arg("-o").arg(&program);
    run(command.arg(format!("-L{path}")).arg("-lptzcal").arg(format!("-Wl,-rpath,{path}")).args(libraries));
    program
}

fn source(path: &str) -> PathBuf {
    root().join(path)
}

/// Flags of OpenCV's headers, as those of a system: its warnings are not ours.
fn opencv(left_out: &str) -> Option<Vec<String>> {
    if !has("pkg-config", left_out) {
        return None;
    }
    let output = Command::new("pkg-config").args(["--cflags", "opencv4"]).output().unwrap();
    if !output.status.success() {
        has("OpenCV (libopencv-dev)", left_out);
        return None;
    }
    Some(text(&output).split_whitespace().map(|flag| flag.replace("-I", "-isystem")).collect())
}

#[test]
fn the_headers_are_clean_for_every_compiler_and_standard() {
    let folder = tempfile::tempdir().unwrap();
    let all = folder.path().join("all.cpp");
    std::fs::write(&all, "#include <ptzcal.hpp>\nint main() {}\n").unwrap();
    for compiler in compilers() {
        for standard in ["c++17", "c++20"] {
            for flags in [&[][..], &[NO_EXCEPTIONS]] {
                run(command(&compiler, standard, flags).arg("-fsyntax-only").arg(&all));
            }
        }
    }
}

#[test]
fn cpp_programs_run() {
    let sanitizers = has_sanitizers();
    for (i, compiler) in compilers().iter().enumerate() {
        let flags: &[&str] = if i == 0 && sanitizers { &SANITIZERS } else { &[] };
        for name in ["errors", "callbacks", "objects", "workflow", "results"] {
            let folder = tempfile::tempdir().unwrap();
            call(&build(compiler, &[source(&format!("tests/cpp/{name}.cpp"))], folder.path(), flags, &[]), &[]);
        }
        let folder = tempfile::tempdir().unwrap();
        call(&build(compiler, &[source("tests/cpp/results.cpp")], folder.path(), &[NO_EXCEPTIONS], &[]), &[]);
    }
}

/// Optimised differently, so that neither half's inline functions stand in for the other's unseen.
#[test]
fn both_kinds_of_translation_units_link() {
    for compiler in compilers() {
        let halves = ["throws", "answers"].map(|name| source(&format!("tests/cpp/both_modes/{name}.cpp")));
        for order in [&[0, 1], &[1, 0]] {
            let folder = tempfile::tempdir().unwrap();
            let sources: Vec<PathBuf> = order.iter().map(|i: &usize| halves[*i].clone()).collect();
            call(&build(&compiler, &sources, folder.path(), &[], &[]), &[]);
        }
    }
}

#[test]
fn matrices_of_opencv_pass() {
    let Some(flags) = opencv("cv::Mat") else { return };
    let flags: Vec<&str> = flags.iter().map(String::as_str).collect();
    let folder = tempfile::tempdir().unwrap();
    let libraries = ["-lopencv_calib3d", "-lopencv_imgproc", "-lopencv_core"];
    let cxx = compiler(true);
    call(&build(&cxx, &[source("tests/cpp/opencv.cpp")], folder.path(), &flags, &libraries), &[]);
    let example = build(&cxx, &[source("examples/cpp/opencv_frames.cpp")], folder.path(), &flags, &libraries);
    let said = text(&run(&mut Command::new(example)));
    assert!(number(&said, "differ by ") < 1e-9 && number(&said, "spot at (") > 0.0, "{said}");
}

#[test]
fn the_cpp_examples_keep_their_promises() {
    let folder = tempfile::tempdir().unwrap();
    let example = |name: &str| {
        let source = source(&format!("examples/cpp/{name}.cpp"));
        text(&run(&mut Command::new(build(&compiler(true), &[source], folder.path(), &["-O1"], &[]))))
    };
    let said = example("calibrate_fixed_camera");
    let (found, truth) = (number(&said, ": f "), number(&said, "truth "));
    assert!((found / truth - 1.0).abs() < 0.003 && number(&said, "within ") < 3.0, "{said}");
    let said = example("click_to_point");
    assert!(number(&said, "looks there: within ") < 3.0, "{said}");
}

/// The number that follows the last `after`.
fn number(said: &str, after: &str) -> f64 {
    let rest = said.rsplit(after).next().unwrap();
    rest.split([' ', ')', ',']).next().unwrap().parse().unwrap_or_else(|_| panic!("{after}: {said}"))
}
