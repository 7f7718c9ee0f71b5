//! What a function of the C header is in C++: whose it is, its name, what goes in and what comes out.

use super::super::declarations::{self, Declarations, Function, Param};
use super::lengths::{self, Length};

/// Written by hand in devices.hpp, and declared so.
pub const HAND: [(&str, &str); 11] = [
    ("ptzcal_rig_options_set_ptz", "outcome<void> set_ptz(ptzcal::ptz head);"),
    ("ptzcal_rig_options_set_laser", "outcome<void> set_laser(laser_callback set);"),
    ("ptzcal_rig_options_set_frames", "outcome<void> set_frames(frame_callback next_frame);"),
    ("ptzcal_rig_options_set_clock", "outcome<void> set_clock(clock_now_callback now, clock_sleep_callback sleep);"),
    ("ptzcal_rig_options_set_log", "outcome<void> set_log(log_callback log);"),
    ("ptzcal_head_options_set_ptz", "outcome<void> set_ptz(ptzcal::ptz head);"),
    ("ptzcal_head_options_set_laser", "outcome<void> set_laser(laser_callback set);"),
    ("ptzcal_head_options_set_frames", "outcome<void> set_frames(frame_callback next_frame);"),
    ("ptzcal_head_options_set_log", "outcome<void> set_log(log_callback log);"),
    ("ptzcal_head_options_set_on_move_end", "outcome<void> set_on_move_end(move_end_callback hears);"),
    (
        "ptzcal_scan_options_add_camera",
        "outcome<std::uint32_t> add_camera(frame_callback next_frame, std::uint32_t width, std::uint32_t height);",
    ),
];

/// Types that are written by hand: errors, and what has callbacks in it.
pub const HAND_TYPES: [&str; 3] = ["ptzcal_error", "ptzcal_ptz", "ptzcal_progress"];

/// Options keep the callbacks that they were given, and what is opened with them keeps them too.
pub const HOLDERS: [&str; 5] =
    ["ptzcal_rig_options", "ptzcal_head_options", "ptzcal_scan_options", "ptzcal_rig", "ptzcal_head"];

#[derive(Clone, Debug, PartialEq)]
pub enum Role {
    This,
    /// Number of rows of arrays: told by them.
    Count,
    Capacity,
    Needed,
    Error,
    Progress,
    User,
    /// A number, an enum, a truth value: its C++ type.
    Scalar(String),
    Text,
    /// An input struct or handle, which may be left out.
    Object {
        options: bool,
    },
    Images,
    Array {
        element: String,
        length: Length,
    },
    /// An array of rows with gaps between them.
    Pixels {
        element: String,
    },
    OutScalar(String),
    OutStruct,
    OutHandle,
    OutArray {
        element: String,
        length: Length,
    },
    /// An array of the capacity's size.
    OutBuffer {
        element: String,
        each: String,
    },
}

pub struct Argument<'a> {
    pub c: &'a Param,
    pub role: Role,
    /// Of an object: plain data, not a handle.
    pub is_struct: bool,
}

/// How a method is reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    Method,
    Static,
    Free,
}

pub struct Call<'a> {
    pub c: &'a Function,
    pub kind: Kind,
    /// C type that it belongs to; empty for functions of the namespace.
    pub owner: String,
    pub name: String,
    pub arguments: Vec<Argument<'a>>,
}

impl Call<'_> {
    pub fn is_const(&self) -> bool {
        self.arguments.first().is_some_and(|a| a.c.kind.starts_with("const "))
    }

    pub fn outputs(&self) -> impl Iterator<Item = &Argument<'_>> {
        self.arguments.iter().filter(|a| a.is_output())
    }

    /// Makes what it belongs to, under the name `_new`.
    pub fn is_new(&self) -> bool {
        self.kind == Kind::Static && self.c.name == format!("{}_new", self.owner)
    }
}

impl Argument<'_> {
    pub fn is_output(&self) -> bool {
        use Role::*;
        matches!(self.role, OutScalar(_) | OutStruct | OutHandle | OutArray { .. } | OutBuffer { .. })
    }

    /// `ptzcal_camera` of `const ptzcal_camera *`.
    pub fn object(&self) -> &str {
        base(&self.c.kind)
    }
}

pub fn base(kind: &str) -> &str {
    kind.trim_start_matches("const ")
        .trim_end_matches(['*', ' '])
        .trim_end_matches("const")
        .trim_end_matches(['*', ' '])
}

/// Functions that have a body of this form: not `_init`, `_free`, `_close`, errors and what is in `HAND`.
pub fn calls<'a>(found: &'a Declarations, enums: &[String]) -> Vec<Call<'a>> {
    let by_hand = |f: &Function| {
        HAND.iter().any(|(name, _)| *name == f.name)
            || ["_init", "_free", "_close"].iter().any(|end| f.name.ends_with(end))
            || f.name.starts_with("ptzcal_error_")
    };
    found.functions.iter().filter(|f| !by_hand(f)).map(|f| call(found, enums, f)).collect()
}

fn call<'a>(found: &'a Declarations, enums: &[String], c: &'a Function) -> Call<'a> {
    let types: Vec<&str> =
        found.handles.iter().map(String::as_str).chain(found.structs.iter().map(|s| s.name.as_str())).collect();
    let of = |kind: &str| types.iter().find(|t| **t == base(kind)).map(|t| (*t).to_owned());
    let begins = |owner: &String| c.name.starts_with(&format!("{owner}_"));
    let first = c.params.first().and_then(|p| of(&p.kind)).filter(begins);
    let is_method = first.is_some() && !c.params[0].kind.ends_with("**");
    let made = c.params.iter().filter(|p| !p.kind.starts_with("const") && p.kind.contains('*'));
    let made = made.filter_map(|p| of(&p.kind)).find(begins);
    let (kind, owner) = match (is_method, first, made) {
        (true, Some(owner), _) => (Kind::Method, owner),
        (_, _, Some(owner)) => (Kind::Static, owner),
        _ => (Kind::Free, String::new()),
    };
    let rest = c.name.strip_prefix(&format!("{owner}_")).unwrap_or(c.name.strip_prefix("ptzcal_").unwrap());
    // What is got as a struct and copied as an array keeps the two apart.
    let is_got = |short: &&str| found.functions.iter().any(|f| f.name == format!("{owner}_get_{short}"));
    let copied = rest.strip_prefix("copy_").filter(|short| !is_got(short));
    let short = rest.strip_prefix("get_").or(copied).unwrap_or(rest);
    let name = match (kind, short) {
        (Kind::Static, "new") => "make".to_owned(),
        (Kind::Static, s) => s.strip_prefix("new_").map_or(s.to_owned(), |from| format!("from_{from}")),
        (_, s) => s.to_owned(),
    };
    let mut call = Call { c, kind, owner, name, arguments: Vec::new() };
    for (i, param) in c.params.iter().enumerate() {
        let role = if i == 0 && kind == Kind::Method { Role::This } else { role(found, enums, c, param) };
        let is_struct = found.structs.iter().any(|s| s.name == base(&param.kind));
        call.arguments.push(Argument { c: param, role, is_struct });
    }
    if call.name == "get" {
        // `get()` is the C handle: what is got tells the name.
        let got = call.outputs().next().map(|a| a.object().to_owned()).expect("what is got");
        call.name = got["ptzcal_".len()..].to_owned();
    }
    call
}

fn role(found: &Declarations, enums: &[String], f: &Function, p: &Param) -> Role {
    let about = &about(f, &p.name);
    let has_capacity = f.params.iter().any(|p| p.name == "capacity");
    let is_struct = found.structs.iter().any(|s| s.name == base(&p.kind));
    let is_handle = found.handles.iter().any(|h| h == base(&p.kind));
    match p.kind.as_str() {
        "ptzcal_error **" => Role::Error,
        "ptzcal_progress_fn" => Role::Progress,
        "void *" => Role::User,
        "const char *" => Role::Text,
        "const ptzcal_image *const *" => Role::Images,
        "size_t" if p.name == "capacity" => Role::Capacity,
        "size_t" if is_count(&p.name) => Role::Count,
        "size_t *" if has_capacity && (p.name == "needed" || p.name == "count") => Role::Needed,
        kind if !kind.contains('*') => Role::Scalar(scalar(kind, about, enums)),
        kind if kind.ends_with("**") && is_handle => Role::OutHandle,
        kind if is_struct && !kind.starts_with("const") => Role::OutStruct,
        _ if is_struct || is_handle => Role::Object { options: is_struct && base(&p.kind).ends_with("_options") },
        kind => {
            let input = kind.starts_with("const ");
            let element = cpp_number(base(kind));
            let has_stride = f.params.iter().any(|p| p.name == "stride");
            match (lengths::read(&f.name, &p.name, about), buffer(f, p)) {
                (length, Some(rows)) => {
                    let each = length.filter(|_| rows).map_or("1".to_owned(), |l| l.each);
                    Role::OutBuffer { element, each }
                }
                // Memory with a stride is the caller's, also where it is written to.
                (Some(length), _) if input || has_stride => Role::Array { element, length },
                (Some(length), _) => Role::OutArray { element, length },
                _ if !input => Role::OutScalar(scalar(base(kind), about.trim_start_matches("Receives "), enums)),
                _ if has_stride => Role::Pixels { element },
                _ => panic!("{}: how long is {}? Its comment does not say", f.name, p.name),
            }
        }
    }
}

/// Is it a buffer of the capacity's size? Of rows, every output is one; of numbers, the one before it.
fn buffer(f: &Function, p: &Param) -> Option<bool> {
    let at = f.params.iter().position(|p| p.name == "capacity")?;
    let rows = counts_rows(&about(f, "capacity"));
    let is_output = !p.kind.starts_with("const ");
    (is_output && (rows || f.params[at - 1].name == p.name)).then_some(rows)
}

/// What the comment says of an argument.
pub fn about(f: &Function, name: &str) -> String {
    let line = declarations::param_comment(&f.comment, name);
    line.strip_prefix("@param ").and_then(|l| l.strip_prefix(name)).unwrap_or_default().trim().to_owned()
}

/// The capacity counts points, matches, ... and not numbers.
fn counts_rows(about: &str) -> bool {
    about.starts_with("Number of ") || about.contains("each array")
}

/// A size that the arrays tell: n, m, n_lines.
fn is_count(name: &str) -> bool {
    name == "n" || name == "m" || name.starts_with("n_")
}

fn scalar(kind: &str, about: &str, enums: &[String]) -> String {
    let word = about.strip_prefix("A ptzcal_").and_then(|a| a.split([' ', ',', ';', '.', ':']).next());
    let word = word.or(about.strip_prefix("a ptzcal_").and_then(|a| a.split([' ', ',', ';', '.', ':']).next()));
    // PTZCAL_LABEL_HANDOFF is a quantity too.
    if let Some(name) = word.filter(|w| enums.iter().any(|e| e == w) && !about.contains("or PTZCAL_")) {
        return format!("ptzcal::{name}");
    }
    let truth = ["1 or 0", "1: ", "0: "].iter().any(|begin| about.starts_with(begin));
    if truth && kind != "double" { "bool".to_owned() } else { cpp_number(kind) }
}

pub fn cpp_number(kind: &str) -> String {
    match kind {
        "double" | "float" | "char" => kind.to_owned(),
        _ => format!("std::{kind}"),
    }
}
