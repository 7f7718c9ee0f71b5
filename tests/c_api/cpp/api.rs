//! api.hpp: the structs and handles of the C header as types with methods, and the functions that
//! belong to none.

use super::super::declarations::{Declarations, Struct};
use super::bodies;
use super::constants;
use super::functions::{self, Argument, Call, HAND, HAND_TYPES, HOLDERS, Kind, Role};

const HEAD: &str = "\
// Made from ptzcal.h (make header), which is the manual: do not edit.
#ifndef PTZCAL_API_HPP
#define PTZCAL_API_HPP

#include \"callbacks.hpp\"
#include \"constants.hpp\"
#include \"error.hpp\"
#include \"handle.hpp\"
#include \"view.hpp\"

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

PTZCAL_BEGIN
";

pub fn write(found: &Declarations, header: &str) -> String {
    let enums: Vec<String> = constants::enums(header).into_iter().map(|(name, ..)| name).collect();
    let calls = functions::calls(found, &enums);
    let handles: Vec<&String> = found.handles.iter().filter(|h| !HAND_TYPES.contains(&h.as_str())).collect();
    let structs: Vec<&Struct> = found.structs.iter().filter(|s| !HAND_TYPES.contains(&s.name.as_str())).collect();
    let mut text = HEAD.to_owned();
    text.push('\n');
    for name in structs.iter().map(|s| &s.name) {
        text.push_str(&format!("struct {};\n", short(name)));
    }
    for name in &handles {
        text.push_str(&format!("class {};\n", short(name)));
    }
    for s in structs {
        text.push_str(&record(&s.name, &calls));
    }
    for h in &handles {
        let closes = found.functions.iter().any(|f| f.name == format!("{h}_close"));
        text.push_str(&class(h, closes, &calls));
    }
    text.push_str("\n// What functions with several outputs return.\n");
    for call in &calls {
        text.push_str(&result_struct(call));
    }
    for call in calls.iter().filter(|c| c.kind == Kind::Free) {
        text.push('\n');
        text.push_str(&comment(call, ""));
        text.push_str(&declaration(call, ""));
    }
    for call in &calls {
        text.push_str(&bodies::write(call, is_handle(found, &call.owner)));
    }
    for h in handles.iter().filter(|h| found.functions.iter().any(|f| f.name == format!("{h}_close"))) {
        text.push_str(&bodies::close(h));
    }
    text + "\nPTZCAL_END\n\n#endif\n"
}

fn is_handle(found: &Declarations, name: &str) -> bool {
    found.handles.iter().any(|h| h == name)
}

/// `camera` of `ptzcal_camera`.
pub fn short(name: &str) -> &str {
    name.strip_prefix("ptzcal_").unwrap()
}

/// A struct of the C API with its set-up and its methods.
fn record(c: &str, calls: &[Call]) -> String {
    let name = short(c);
    let methods = methods(c, calls);
    format!(
        "
struct {name} : {c} {{
  {name}() noexcept {{ {c}_init(this, sizeof({c})); }}
  {name}(const {c} &c) noexcept : {c}(c) {{}}
{methods}}};
"
    )
}

fn class(c: &str, closes: bool, calls: &[Call]) -> String {
    let name = short(c);
    let holder = if HOLDERS.contains(&c) { "public detail::holder, " } else { "" };
    let (before, free) = if closes {
        let close = format!(
            "\nnamespace detail {{\ninline void {name}_close({c} *open) noexcept {{ {c}_close(open, nullptr); }}\n}}\n"
        );
        (close, format!("detail::{name}_close"))
    } else {
        (String::new(), format!("{c}_free"))
    };
    let constructors = match calls.iter().find(|call| call.owner == c && call.is_new()) {
        Some(new) if bodies::inputs(new).is_empty() => {
            format!("  {name}() : handle(detail::make<{c}>({c}_new)) {{}}\n")
        }
        Some(new) => {
            let one = if bodies::inputs(new).len() == 1 { "explicit " } else { "" };
            let names: Vec<&str> = bodies::inputs(new).iter().map(|a| a.c.name.as_str()).collect();
            // Where all may be left out, leaving all out means the empty handle, not a new one.
            let all_optional = bodies::inputs(new).iter().all(|a| default(a).is_some());
            let arguments = parameters(new, !all_optional);
            let signature = format!("  {one}{name}({arguments}) : {name}(make({})) {{}}", names.join(", "));
            format!("  {name}() noexcept = default;\n#ifndef PTZCAL_NO_EXCEPTIONS\n{}#endif\n", wrap(&signature))
        }
        None => format!("  {name}() noexcept = default;\n"),
    };
    let close = if closes {
        "\n  // Closes it; it is gone whatever comes of it. The destructor does the same, and says nothing.\n  outcome<void> close();\n"
    } else {
        ""
    };
    let by_hand =
        HAND.iter().filter(|(f, _)| f.starts_with(&format!("{c}_set_")) || f.starts_with(&format!("{c}_add_")));
    let by_hand: String = by_hand.map(|(f, line)| format!("\n  // {f}\n{}", wrap(&format!("  {line}")))).collect();
    let methods = methods(c, calls);
    format!(
        "{before}
class {name} : {holder}public detail::handle<{c}, {free}> {{
 public:
  using handle::handle;
{constructors}{close}{by_hand}{methods}}};
"
    )
}

fn methods(owner: &str, calls: &[Call]) -> String {
    let of: Vec<&Call> = calls.iter().filter(|c| c.owner == owner).collect();
    let results = of.iter().filter(|c| has_result_struct(c)).map(|c| format!("  struct {}_result;\n", c.name));
    let results: String = results.collect();
    let methods = of.iter().map(|c| format!("\n{}{}", comment(c, "  "), declaration(c, "  ")));
    results + &methods.collect::<String>()
}

pub fn has_result_struct(call: &Call) -> bool {
    call.outputs().count() > 1
}

/// Type of one output.
pub fn output_type(a: &Argument) -> String {
    match &a.role {
        Role::OutScalar(kind) => kind.clone(),
        Role::OutStruct | Role::OutHandle => format!("ptzcal::{}", short(a.object())),
        Role::OutArray { element, length } if length.of.is_empty() => format!("std::array<{element}, {}>", length.each),
        Role::OutBuffer { element, .. } if element == "char" => "std::string".to_owned(),
        Role::OutArray { element, .. } | Role::OutBuffer { element, .. } => format!("std::vector<{element}>"),
        _ => unreachable!("no output"),
    }
}

/// What a call answers, without `outcome`.
pub fn value_type(call: &Call) -> String {
    let outputs: Vec<&Argument> = call.outputs().collect();
    match outputs[..] {
        [] => "void".to_owned(),
        [one] => output_type(one),
        _ if call.kind == Kind::Free => format!("ptzcal::{}_result", call.name),
        _ => format!("ptzcal::{}::{}_result", short(&call.owner), call.name),
    }
}

pub fn return_type(call: &Call) -> String {
    match call.c.returns.as_str() {
        "ptzcal_status" if call.c.name != "ptzcal_error_status" => format!("outcome<{}>", value_type(call)),
        "const char *" => "std::string".to_owned(),
        "int32_t" => "bool".to_owned(),
        kind => functions::cpp_number(kind),
    }
}

fn result_struct(call: &Call) -> String {
    if !has_result_struct(call) {
        return String::new();
    }
    let scope = if call.kind == Kind::Free { String::new() } else { format!("{}::", short(&call.owner)) };
    let members: String = call.outputs().map(|a| format!("  {} {};\n", output_type(a), a.c.name)).collect();
    format!("\nstruct {scope}{}_result {{\n{members}}};\n", call.name)
}

fn declaration(call: &Call, indent: &str) -> String {
    let is_static = if call.kind == Kind::Static { "static " } else { "" };
    let is_const = if call.kind == Kind::Method && call.is_const() { " const" } else { "" };
    wrap(&format!("{indent}{is_static}{} {}({}){is_const};", return_type(call), call.name, parameters(call, true)))
}

/// The arguments; with defaults for the last ones that may be left out.
pub fn parameters(call: &Call, with_defaults: bool) -> String {
    let inputs = bodies::inputs(call);
    let last_needed = inputs.iter().rposition(|a| default(a).is_none()).map_or(0, |i| i + 1);
    let each = inputs.iter().enumerate().map(|(i, a)| match default(a) {
        Some(value) if with_defaults && i >= last_needed => format!("{} = {value}", parameter(a)),
        _ => parameter(a),
    });
    each.collect::<Vec<_>>().join(", ")
}

fn default(a: &Argument) -> Option<String> {
    match a.role {
        _ if !a.c.may_be_null && a.role != Role::Images => None,
        Role::Object { options: true } => Some(format!("ptzcal::{}()", short(a.object()))),
        _ => Some("{}".to_owned()),
    }
}

fn parameter(a: &Argument) -> String {
    let name = &a.c.name;
    match &a.role {
        Role::Scalar(kind) => format!("{kind} {name}"),
        Role::Text => format!("ptzcal::c_string {name}"),
        Role::Object { options } => {
            let object = if a.is_struct { a.object().to_owned() } else { format!("ptzcal::{}", short(a.object())) };
            if a.c.may_be_null && !options {
                format!("ptzcal::optional_ref<{object}> {name}")
            } else {
                format!("const {object} &{name}")
            }
        }
        Role::Images => format!("ptzcal::view<const ptzcal::image> {name}"),
        Role::Array { element, .. } if !a.c.kind.starts_with("const ") => format!("ptzcal::view<{element}> {name}"),
        Role::Array { element, .. } | Role::Pixels { element } => format!("ptzcal::view<const {element}> {name}"),
        Role::Progress => format!("const ptzcal::progress_callback &{name}"),
        other => unreachable!("{other:?} is no input"),
    }
}

/// The C comment up to its @param lines, and those of the inputs.
fn comment(call: &Call, indent: &str) -> String {
    let lines = call.c.comment.lines().map(|l| l.trim().trim_start_matches("/**").trim_start_matches("*/"));
    let lines = lines.map(|l| l.trim_start_matches('*').trim()).skip_while(|l| l.is_empty());
    let summary = lines.take_while(|l| !l.starts_with('@')).collect::<Vec<_>>().join(" ");
    let mut text = comment_lines(summary.trim(), indent, "");
    for a in bodies::inputs(call) {
        text.push_str(&comment_lines(&format!("{}: {}", a.c.name, functions::about(call.c, &a.c.name)), indent, "  "));
    }
    text + &format!("{indent}// C: {}\n", call.c.name)
}

fn comment_lines(text: &str, indent: &str, inner: &str) -> String {
    let mut lines = vec![String::new()];
    for word in text.replace("may be NULL", "may be left out").split_whitespace() {
        let line = lines.last_mut().unwrap();
        if !line.is_empty() && indent.len() + 4 + inner.len() + line.len() + word.len() > 100 {
            lines.push(word.to_owned());
        } else {
            line.push_str(if line.is_empty() { "" } else { " " });
            line.push_str(word);
        }
    }
    lines.iter().map(|l| format!("{indent}// {inner}{l}\n")).collect()
}

/// Breaks a long line of code after commas.
pub fn wrap(line: &str) -> String {
    let indent = line.len() - line.trim_start().len() + 4;
    let mut text = String::new();
    let mut width = 0;
    for part in line.split_inclusive(", ") {
        if width > 0 && width + part.trim_end().len() > 110 {
            text.truncate(text.trim_end().len());
            text.push_str(&format!("\n{}", " ".repeat(indent)));
            width = indent;
        }
        text.push_str(part);
        width += part.len();
    }
    text + "\n"
}
