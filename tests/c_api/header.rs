//! include/ptzcal.h: made from src/capi with cbindgen, topic by topic, and kept in step.
//!
//! cbindgen sorts a header by kind of item. A manual is read by topic, so each file of src/capi is
//! translated on its own and its module comment becomes the heading of its chapter.

use std::fs;
use std::path::{Path, PathBuf};

/// The chapters, in the order of the header: a type stands before the functions that use it.
const TOPICS: &[&str] = &[
    "version",
    "status",
    "error",
    "args",
    "cancel",
    "log",
    "shot",
    "progress",
    "image",
    "picture",
    "depth",
    "camera",
    "undistort",
    "rig_model",
    "detect",
    "spot_detector",
    "chessboard",
    "sift",
    "sift_matching",
    "lines",
    "lines_3d",
    "correspondences",
    "calibration_options",
    "calibrate",
    "calibration_check",
    "uncertainty",
    "linear_methods",
    "boards",
    "laser_line",
    "zoom_curve",
    "rig_calibrated",
    "rig_views",
    "rig_calibration",
    "rgbd",
    "roof_edges",
    "pose",
    "planes",
    "plane_regions",
    "registration",
    "devices",
    "simulator",
    "angle_map",
    "rig_options",
    "head_options",
    "head",
    "head_control",
    "angle_learning",
    "probe",
    "rig",
    "scan_options",
    "scan",
    "scan_planes",
    "cloud",
    "cloud_data",
    "mesh",
    "explore",
    "health",
    "adjustment",
    "adjustment_shots",
    "adjusted",
    "adjusted_check",
    "adjusted_points",
    "adjustment_planes",
    "network",
    "adjust",
    "site",
    "set_up",
    "study",
    "label",
    "plan",
    "pointing",
    "locating",
    "sweep",
    "camera_list",
    "report",
    "file",
];

/// What stands before the first chapter: conventions and rules that hold for all of them.
const PREFACE: &str = include_str!("../../src/capi/preface.h");

pub fn path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("include/ptzcal.h")
}

pub fn text() -> String {
    fs::read_to_string(path()).expect("include/ptzcal.h is committed")
}

fn generate() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut text = PREFACE.to_owned();
    for topic in TOPICS {
        let file = root.join("src/capi").join(topic).with_extension("rs");
        let source = fs::read_to_string(&file).unwrap();
        let mut config = cbindgen::Config::from_file(root.join("cbindgen.toml")).unwrap();
        // Enums and callback types that no function names still belong to C.
        config.export.include = public_names(&source);
        let mut chapter = Vec::new();
        cbindgen::Builder::new().with_config(config).with_src(&file).generate().unwrap().write(&mut chapter);
        text.push_str(&heading(&source));
        text.push_str(&polish(&String::from_utf8(chapter).unwrap()));
    }
    text + "\n#ifdef __cplusplus\n} /* extern \"C\" */\n#endif\n\n#endif /* PTZCAL_H */\n"
}

fn public_names(source: &str) -> Vec<String> {
    let items = ["pub enum ", "pub struct ", "pub type "];
    let name = |line: &str| {
        let rest = items.iter().find_map(|item| line.strip_prefix(item))?;
        Some(rest.split(|c: char| !c.is_alphanumeric() && c != '_').next()?.to_owned())
    };
    source.lines().filter_map(name).collect()
}

/// The module's comment: its first line is the chapter's title.
fn heading(source: &str) -> String {
    let lines: Vec<&str> = source.lines().map_while(|l| l.strip_prefix("//!")).map(|l| l.trim_start()).collect();
    let body: String = lines[1..].iter().map(|l| format!(" * {l}").trim_end().to_owned() + "\n").collect();
    format!("\n/* {:=<96}\n * {}\n{body} * {:=<93} */\n\n", "", lines[0], "")
}

/// What cbindgen cannot be told.
fn polish(chapter: &str) -> String {
    const C23: &str = "#if __STDC_VERSION__ >= 202311L\n";
    const END: &str = "#endif // __STDC_VERSION__ >= 202311L\n";
    let mut text = chapter.trim_start().replace("\nPTZCAL_NOEXCEPT;", " PTZCAL_NOEXCEPT;");
    for (name, int) in enums(&text) {
        // One form that is C99, C23 and C++ alike: an integer type, and constants of it.
        text = text.replace(&format!("enum {name}\n{C23}  : {int}\n{END} {{"), "enum {").replace(
            &format!("{C23}typedef enum {name} {name};\n#else\ntypedef {int} {name};\n{END}"),
            &format!("typedef {int} {name};\n"),
        );
    }
    let mut lines: Vec<String> = Vec::new();
    let mut callback = false;
    for line in text.lines() {
        // Types are known by their short names, in their own chapter too.
        let line = if line.starts_with("typedef struct") {
            line.to_owned()
        } else {
            line.replace("struct ptzcal_", "ptzcal_")
        };
        callback |= line.starts_with("typedef") && line.contains("(*ptzcal_");
        let ends = callback && line.ends_with(");");
        callback &= !ends;
        match &mut lines[..] {
            // A comment of one line stands on one line.
            [.., open, one] if line.trim() == "*/" && open.trim() == "/**" && one.starts_with(' ') => {
                let text = one.trim().trim_start_matches("* ").to_owned();
                open.push_str(&format!(" {text} */"));
                lines.pop();
            }
            // A callback that throws would unwind through Rust, which ends the program: since C++17
            // its type says so.
            _ if ends => lines.push(line.replace(");", ") PTZCAL_CALLBACK_NOEXCEPT;")),
            _ => lines.push(line),
        }
    }
    lines.join("\n") + "\n"
}

/// (name, integer type) of the enums of a chapter.
fn enums(chapter: &str) -> Vec<(String, String)> {
    let lines: Vec<&str> = chapter.lines().collect();
    let heads = lines.windows(3).filter_map(|w| Some((w[0].strip_prefix("enum ")?, w[2].strip_prefix("  : ")?)));
    heads.map(|(name, int)| (name.to_owned(), int.to_owned())).collect()
}

#[test]
fn every_file_with_exports_is_a_chapter() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/capi");
    for entry in fs::read_dir(folder).unwrap() {
        let file = entry.unwrap().path();
        let topic = file.file_stem().unwrap().to_str().unwrap();
        let exports = fs::read_to_string(&file).unwrap().contains("\n#[unsafe(no_mangle)]");
        assert!(!exports || TOPICS.contains(&topic), "{topic} is missing in TOPICS");
    }
}

/// `PTZCAL_UPDATE_HEADER=1 cargo test --test c_api header` writes it anew.
#[test]
fn the_header_is_what_the_sources_make() {
    let made = generate();
    if std::env::var_os("PTZCAL_UPDATE_HEADER").is_some() {
        fs::write(path(), &made).unwrap();
    }
    let committed = text();
    let line = made.lines().zip(committed.lines()).position(|(a, b)| a != b).map_or(0, |i| i + 1);
    assert!(made == committed, "include/ptzcal.h differs from src/capi from line {line}: run `make header`");
}
