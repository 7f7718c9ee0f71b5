//! Bodies of the C++ functions: checked lengths, one call of the C API, its outcome.

use super::api::{has_result_struct, output_type, parameters, return_type, short, value_type, wrap};
use super::functions::{Argument, Call, HOLDERS, Kind, Role};
use super::lengths::Length;

/// Arguments of the C++ function.
pub fn inputs<'a, 'b>(call: &'b Call<'a>) -> Vec<&'b Argument<'a>> {
    use Role::*;
    let is_input = |a: &&Argument| {
        matches!(a.role, Scalar(_) | Text | Object { .. } | Images | Array { .. } | Pixels { .. } | Progress)
    };
    call.arguments.iter().filter(is_input).collect()
}

pub fn write(call: &Call, of_handle: bool) -> String {
    let scope = if call.kind == Kind::Free { String::new() } else { format!("{}::", short(&call.owner)) };
    let is_const = if call.kind == Kind::Method && call.is_const() { " const" } else { "" };
    let head = format!("inline {} {scope}{}({}){is_const}", return_type(call), call.name, parameters(call, false));
    let body = if call.c.returns == "ptzcal_status" { body(call, of_handle) } else { plain(call, of_handle) };
    format!("\n{}{{\n{body}}}\n", wrap(&head))
}

pub fn close(c: &str) -> String {
    let name = short(c);
    format!(
        "
inline outcome<void> {name}::close()
{{
  detail::call call_;
  const auto code_ = {c}_close(detach(), call_.error());
  hand_over(call_);
  return call_.finish(code_);
}}
"
    )
}

/// Functions that cannot fail.
fn plain(call: &Call, of_handle: bool) -> String {
    let value = c_call(call, of_handle);
    let is_truth = return_type(call) == "bool";
    format!("  return {value}{};\n", if is_truth { " != 0" } else { "" })
}

fn body(call: &Call, of_handle: bool) -> String {
    let mut text = "  detail::call call_;\n".to_owned();
    text.push_str(&counts(call));
    text.push_str(&checks(call));
    for a in call.arguments.iter().filter(|a| a.role == Role::Images) {
        let name = &a.c.name;
        text.push_str(&format!("  std::vector<const ptzcal_image *> {name}_;\n  for (const auto &image_ : {name}) {name}_.push_back(&image_);\n"));
    }
    for a in call.outputs() {
        text.push_str(&local(a));
    }
    let fills = call.arguments.iter().any(|a| a.role == Role::Capacity);
    if fills {
        text.push_str(&fill(call, of_handle));
    } else {
        text.push_str(&wrap(&format!("  const auto code_ = {};", c_call(call, of_handle))));
    }
    if call.owner == "ptzcal_head" && call.kind == Kind::Method {
        text.push_str("  hand_over(call_);\n");
    }
    text + &finish(call)
}

/// How many rows the arrays have: told by the first one that says so.
fn counts(call: &Call) -> String {
    let counted = call.arguments.iter().filter(|a| a.role == Role::Count);
    let each = counted.map(|count| {
        let n = &count.c.name;
        for a in &call.arguments {
            match &a.role {
                Role::Array { length, .. } if length.of == [n.clone()] => {
                    return format!("  const std::size_t {n}_ = {}.size() / {};\n", a.c.name, length.each);
                }
                Role::Images if n.strip_prefix("n_") == Some(&a.c.name) => {
                    return format!("  const std::size_t {n}_ = {}.size();\n", a.c.name);
                }
                _ => {}
            }
        }
        panic!("{}: no array tells {n}", call.c.name)
    });
    each.collect()
}

fn checks(call: &Call) -> String {
    let checks = call.arguments.iter().filter_map(|a| {
        let name = &a.c.name;
        match &a.role {
            Role::Array { length, .. } => {
                let check = if a.c.may_be_null { "rows_or_none" } else { "rows" };
                Some(format!("call_.{check}(\"{name}\", {name}.size(), {}, {})", rows(call, length), length.each))
            }
            Role::Pixels { .. } => Some(format!(
                "call_.at_least(\"{name}\", {name}.size(), height == 0 ? 0 : (height - std::size_t(1)) * stride + width)"
            )),
            _ => None,
        }
    });
    let checks: Vec<String> = checks.collect();
    if checks.is_empty() {
        return String::new();
    }
    format!("  if (!({})) return call_.refuse<{}>();\n", checks.join(" &&\n        "), value_type(call))
}

/// Product of what is counted.
fn rows(call: &Call, length: &Length) -> String {
    let factor = |name: &String| {
        let argument = call.arguments.iter().find(|a| a.c.name == *name);
        match argument.map(|a| &a.role) {
            Some(Role::Count) => format!("{name}_"),
            Some(Role::Scalar(_)) => format!("std::size_t({name})"),
            _ => panic!("{}: what is {name}?", call.c.name),
        }
    };
    if length.of.is_empty() { "1".to_owned() } else { length.of.iter().map(factor).collect::<Vec<_>>().join(" * ") }
}

/// An output's variable.
fn local(a: &Argument) -> String {
    let name = &a.c.name;
    match &a.role {
        Role::OutScalar(_) => {
            format!("  {} {name}_ = 0;\n", super::functions::cpp_number(super::functions::base(&a.c.kind)))
        }
        Role::OutHandle => format!("  {} *{name}_ = nullptr;\n", a.object()),
        Role::OutArray { length, .. } if length.of.is_empty() => format!("  {} {name}_{{}};\n", output_type(a)),
        Role::OutArray { element, length } => {
            let of = length.of.iter().map(|n| format!("{n}_")).collect::<Vec<_>>().join(" * ");
            let each = if length.each == "1" { String::new() } else { format!(" * {}", length.each) };
            format!("  std::vector<{element}> {name}_({of}{each});\n")
        }
        _ => format!("  {} {name}_;\n", output_type(a)),
    }
}

/// Buffers: asked for their size first where copying is cheap; where the call is the work itself,
/// offered what is mostly enough.
fn fill(call: &Call, of_handle: bool) -> String {
    let guess = if call.c.name.contains("_copy_") { 0 } else { 4096 };
    let resize = |capacity: &str| {
        let each = call.arguments.iter().filter_map(|a| match &a.role {
            Role::OutBuffer { each, .. } if each == "1" => Some(format!("    {}_.resize({capacity});\n", a.c.name)),
            Role::OutBuffer { each, .. } => Some(format!("    {}_.resize({capacity} * {each});\n", a.c.name)),
            _ => None,
        });
        each.collect::<String>()
    };
    format!(
        "  std::size_t needed_ = 0;
  const auto code_ = detail::fill({guess}, needed_, [&](std::size_t capacity_) {{
{}    return {};
  }});
  if (code_ == PTZCAL_STATUS_OK) {{
{}  }}
",
        resize("capacity_"),
        wrap(&c_call(call, of_handle)).trim_end(),
        resize("needed_"),
    )
}

fn finish(call: &Call) -> String {
    let values: Vec<String> = call.outputs().map(value).collect();
    if values.is_empty() {
        return "  return call_.finish(code_);\n".to_owned();
    }
    let opened_with =
        call.arguments.iter().find(|a| matches!(a.role, Role::Object { .. }) && HOLDERS.contains(&a.object()));
    match (opened_with, HOLDERS.contains(&call.owner.as_str()) && call.kind == Kind::Static) {
        (Some(options), true) => format!(
            "  {} opened_({}_);\n  opened_.share({});\n  return call_.finish(code_, std::move(opened_));\n",
            value_type(call),
            call.outputs().next().unwrap().c.name,
            options.c.name
        ),
        _ if has_result_struct(call) => {
            wrap(&format!("  return call_.finish(code_, {}{{{}}});", value_type(call), values.join(", ")))
        }
        _ => format!("  return call_.finish(code_, {});\n", values[0]),
    }
}

fn value(a: &Argument) -> String {
    let name = &a.c.name;
    match &a.role {
        Role::OutScalar(kind) if kind.starts_with("ptzcal::") => format!("{kind}({name}_)"),
        Role::OutHandle => format!("ptzcal::{}({name}_)", short(a.object())),
        Role::OutBuffer { element, .. } if element == "char" => format!("detail::text(std::move({name}_))"),
        _ => format!("std::move({name}_)"),
    }
}

fn c_call(call: &Call, of_handle: bool) -> String {
    let arguments = call.arguments.iter().map(|a| {
        let name = &a.c.name;
        match &a.role {
            Role::This if of_handle => "get()".to_owned(),
            Role::This => "this".to_owned(),
            Role::Count => format!("{name}_"),
            Role::Capacity => "capacity_".to_owned(),
            Role::Needed => "&needed_".to_owned(),
            Role::Error => "call_.error()".to_owned(),
            Role::Progress => format!("detail::progress_function({name})"),
            Role::User => "detail::progress_user(progress)".to_owned(),
            Role::Scalar(_) => name.clone(),
            Role::Text => format!("{name}.get()"),
            Role::Object { options } if a.is_struct && (*options || !a.c.may_be_null) => format!("&{name}"),
            Role::Object { .. } if a.is_struct || !a.c.may_be_null => format!("{name}.get()"),
            Role::Object { .. } => format!("detail::pointer({name})"),
            Role::Images => format!("{name}_.data()"),
            Role::Array { .. } | Role::Pixels { .. } => format!("{name}.data()"),
            Role::OutArray { .. } | Role::OutBuffer { .. } => format!("{name}_.data()"),
            Role::OutScalar(_) | Role::OutStruct | Role::OutHandle => format!("&{name}_"),
        }
    });
    format!("{}({})", call.c.name, arguments.collect::<Vec<_>>().join(", "))
}
