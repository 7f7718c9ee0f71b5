//! Every export against every bad argument, one at a time, made from the header: NULL, NaN and
//! infinity, impossible sizes and counts. The answer must be the documented status, and no output
//! may have been touched. A verb that joins the header is tried without a line written for it.

use std::fmt::Write as _;
use std::fs;

use super::declarations::{self, Declarations, Function, Param};
use super::programs::{Link, SANITIZERS, VALGRIND, call, compile, has_sanitizers};
use super::tools::has;

/// Counts beyond PTZCAL_MAX_COUNT, and such that times 8, 16 or 24 bytes they wrap round to little.
const COUNTS: [&str; 5] =
    ["PTZCAL_MAX_COUNT + (size_t)1", "SIZE_MAX / 24 + 1", "SIZE_MAX / 16 + 1", "SIZE_MAX / 8 + 1", "SIZE_MAX"];

/// The C expression of a good argument.
fn good(found: &Declarations, f: &Function, p: &Param) -> String {
    let fixture = |kind: &str| format!("fixture_{}", kind.trim_start_matches("const ").trim_start_matches("ptzcal_"));
    match p.kind.as_str() {
        "double" => "0.5".into(),
        "int32_t" | "uint32_t" | "uint64_t" => "1".into(),
        "size_t" if p.name == "size" => format!("sizeof({})", f.params[0].kind.trim_end_matches(" *")),
        "size_t" => "4".into(),
        "ptrdiff_t" => "64".into(),
        "const double *" => "numbers".into(),
        "const uint8_t *" => "fixture_flags".into(),
        "const uint16_t *" => "fixture_millimetres".into(),
        "const float *" => "fixture_metres".into(),
        "const uint32_t *" | "const int32_t *" | "const size_t *" => format!("fixture_{}", p.name),
        "double *" | "float *" | "char *" | "uint8_t *" | "uint32_t *" | "uint64_t *" | "int32_t *" | "size_t *" => {
            "(void *)output".into()
        }
        "const ptzcal_image *const *" => "fixture_images".into(),
        "const char *" if p.name == "path" => "\"file\"".into(),
        "const char *" if f.name.contains("camera") => "\"sim:fixed/0\"".into(),
        "const char *" => "\"sim:room\"".into(),
        "void *" => "NULL".into(),
        kind if kind.ends_with("_fn") => fixture(kind),
        kind => match (kind.strip_suffix(" **"), kind.strip_suffix(" *")) {
            (Some(handle), _) if found.handles.iter().any(|h| h == handle) => {
                // A second one of its kind has a place of its own.
                let first = f.params.iter().find(|q| q.kind == p.kind).is_none_or(|q| q.name == p.name);
                format!("&{}_{}", if first { "made" } else { "other" }, &handle[7..])
            }
            (_, Some(kind)) => fixture(kind),
            _ => panic!("{}: no good value is known for '{kind}': add it to hostile.rs", f.name),
        },
    }
}

/// One call with argument `at` replaced; `about` names the case.
fn attempt(found: &Declarations, f: &Function, at: usize, bad: &str, wanted: &[&str]) -> String {
    let args: Vec<String> =
        f.params.iter().enumerate().map(|(i, p)| if i == at { bad.to_owned() } else { good(found, f, p) }).collect();
    let about = format!("{} with {} = {}", f.name, f.params[at].name, bad.replace(['"', '\\'], ""));
    let call = format!("{}({})", f.name, args.join(", "));
    if f.returns == "ptzcal_status" {
        let wanted: Vec<String> = wanted.iter().map(|w| format!("s == PTZCAL_STATUS_{w}")).collect();
        let wanted = if wanted.is_empty() {
            "s != PTZCAL_STATUS_NULL_POINTER && s != PTZCAL_STATUS_PANIC".into()
        } else {
            wanted.join(" || ")
        };
        format!("  before(); {{ ptzcal_status s = {call}; after(\"{about}\", s, {wanted}); }}\n")
    } else {
        format!("  before(); (void){call}; after(\"{about}\", PTZCAL_STATUS_OK, 1);\n")
    }
}

/// All attempts on one function.
fn attempts(found: &Declarations, f: &Function) -> String {
    let mut out = String::new();
    // What ends a handle is tried with NULL in its place only.
    let params = if f.name.ends_with("_close") { &f.params[..1] } else { &f.params[..] };
    for (at, p) in params.iter().enumerate() {
        let mut try_it = |bad: &str, wanted: &[&str]| out += &attempt(found, f, at, bad, wanted);
        let is_struct = found.structs.iter().any(|s| p.kind.trim_start_matches("const ") == format!("{} *", s.name));
        if p.may_be_null {
            try_it("NULL", &[]);
        } else if (p.kind.ends_with('*') && p.kind != "void *") || p.kind.ends_with("_fn") {
            try_it("NULL", &["NULL_POINTER"]);
        }
        if p.kind == "const char *" {
            try_it("long_string", &["INVALID_ARGUMENT"]);
            try_it("\"\\xff\"", &["INVALID_ARGUMENT"]);
        }
        if p.kind == "double" {
            try_it("NAN", &["NOT_FINITE"]);
            try_it("-INFINITY", &["NOT_FINITE", "INVALID_ARGUMENT"]);
        }
        if p.kind == "const double *" {
            let wanted: &[&str] = if p.may_be_infinite { &["OK", "TOO_FEW_POINTS"] } else { &["NOT_FINITE"] };
            try_it("nan_first", wanted);
            try_it("infinite_first", wanted);
            try_it("(const double *)(const void *)((const char *)numbers + 1)", &["INVALID_ARGUMENT"]);
        }
        if p.kind == "size_t" && p.name == "size" {
            for size in ["0", "4", "SIZE_MAX", "((size_t)1 << 32) + 64"] {
                try_it(size, &["INVALID_ARGUMENT"]);
            }
        } else if p.kind == "size_t" {
            COUNTS.iter().for_each(|n| try_it(n, &["INVALID_ARGUMENT"]));
        }
        if is_struct && !f.name.ends_with("_init") {
            for size in [0u32, 3, 1 << 20, u32::MAX] {
                try_it(&format!("(void *)sized({size}u)"), &["INVALID_ARGUMENT"]);
            }
        }
    }
    out
}

fn program() -> String {
    let found = declarations::read();
    let mut code = String::from(
        r#"#include "fixtures.h"
#include <math.h>
#include <string.h>

static double numbers[256], nan_first[256], infinite_first[256];
static double output[256];
static uint32_t garbage[256];
static char long_string[PTZCAL_MAX_STRING + 2];

/* A struct whose struct_size is impossible. */
static void *sized(uint32_t size) { taint(garbage, sizeof garbage); garbage[0] = size; return garbage; }

"#,
    );
    for h in &found.handles {
        writeln!(code, "static {h} *made_{0}, *other_{0};", &h[7..]).unwrap();
    }
    code += "\nstatic void before(void)\n{\n  taint(output, sizeof output);\n";
    for h in &found.handles {
        writeln!(code, "  made_{0} = other_{0} = NULL;", &h[7..]).unwrap();
    }
    code += r#"}

static void after(const char *about, ptzcal_status status, int as_wanted)
{
  if (!as_wanted) { fprintf(stderr, "%s: %s\n", about, ptzcal_status_name(status)); exit(1); }
  if (status == PTZCAL_STATUS_OK && made_error) { fprintf(stderr, "%s: success with an error\n", about); exit(1); }
  if (status == PTZCAL_STATUS_NULL_POINTER || status == PTZCAL_STATUS_NOT_FINITE || status == PTZCAL_STATUS_INVALID_ARGUMENT) {
    if (!is_tainted(output, sizeof output)) { fprintf(stderr, "%s: an output was touched\n", about); exit(1); }
    if (made_error && (ptzcal_error_status(made_error) != status || !*ptzcal_error_message(made_error))) {
      fprintf(stderr, "%s: the error does not say so\n", about); exit(1);
    }
"#;
    for h in found.handles.iter().filter(|h| *h != "ptzcal_error") {
        writeln!(
            code,
            "    if (made_{0} || other_{0}) {{ fprintf(stderr, \"%s: a handle came out\\n\", about); exit(1); }}",
            &h[7..]
        )
        .unwrap();
    }
    code += "  }\n";
    for h in &found.handles {
        let ends = found.functions.iter().any(|f| f.name == format!("{h}_close"));
        for made in ["made", "other"] {
            let end = if ends {
                format!("(void){h}_close({made}_{}, NULL)", &h[7..])
            } else {
                format!("{h}_free({made}_{})", &h[7..])
            };
            writeln!(code, "  {end};").unwrap();
        }
    }
    code += r#"}

int main(void)
{
  size_t i;
  for (i = 0; i < 256; i++) numbers[i] = nan_first[i] = infinite_first[i] = 1.0 + (double)i;
  memset(long_string, 'x', sizeof long_string - 1);
  nan_first[0] = NAN;
  infinite_first[0] = -INFINITY;
  make_fixtures();
"#;
    found.functions.iter().for_each(|f| code += &attempts(&found, f));
    code + "  free_fixtures();\n  return 0;\n}\n"
}

fn compiled(folder: &tempfile::TempDir, flags: &[&str]) -> std::path::PathBuf {
    let source = folder.path().join("hostile.c");
    let code = program();
    assert!(code.matches("before();").count() > 300, "the attempts were not made");
    fs::write(&source, code).unwrap();
    compile(&source, folder.path(), Link::Shared, flags)
}

#[test]
fn every_export_refuses_every_bad_argument() {
    let folder = tempfile::tempdir().unwrap();
    call(&compiled(&folder, &[]), &[]);
}

#[test]
fn every_export_refuses_every_bad_argument_under_valgrind() {
    if has("valgrind", "bad arguments under valgrind") {
        let folder = tempfile::tempdir().unwrap();
        call(&compiled(&folder, &[]), &VALGRIND);
    }
}

#[test]
fn every_export_refuses_every_bad_argument_with_sanitizers() {
    if has_sanitizers() {
        let folder = tempfile::tempdir().unwrap();
        // Misaligned pointers are made on purpose: the library refuses them, the sanitizer would too.
        let flags = [&SANITIZERS[..], &["-fno-sanitize=alignment"]].concat();
        call(&compiled(&folder, &flags), &[]);
    }
}
