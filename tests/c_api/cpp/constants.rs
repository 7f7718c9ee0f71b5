//! constants.hpp: a type for each enum of the C header, and its numbers.

const HEAD: &str = "\
// Made from ptzcal.h (make header): do not edit.
//
// An enum of the C API is a type of its own here, which turns into the number that the C structs hold:
// camera.distortion_model = distortion_model::radial2; numbers of structs turn into it when asked:
// distortion_model(camera.distortion_model).
#ifndef PTZCAL_CONSTANTS_HPP
#define PTZCAL_CONSTANTS_HPP

#include <ptzcal.h>

#include \"mode.hpp\"

#include <cstdint>

PTZCAL_BEGIN
";

/// C++ keywords that are values of an enum.
fn value_name(name: &str) -> String {
    let name = name.to_lowercase();
    if name == "auto" { name + "_" } else { name }
}

pub fn write(header: &str) -> String {
    let mut text = HEAD.to_owned();
    for (name, int, values) in enums(header) {
        let width = if int == "int32_t" { "std::int32_t" } else { "std::uint32_t" };
        let prefix = format!("PTZCAL_{}_", name.to_uppercase());
        text.push_str(&format!("\nstruct {name} {{\n  enum value : {width} {{\n"));
        for value in values {
            text.push_str(&format!("    {} = {value},\n", value_name(value.strip_prefix(&prefix).unwrap())));
        }
        text.push_str(&format!(
            "  }};
  constexpr {name}() noexcept = default;
  constexpr {name}(value known) noexcept : number_(known) {{}}
  explicit constexpr {name}({width} number) noexcept : number_(number) {{}}
  constexpr operator {width}() const noexcept {{ return number_; }}

 private:
  {width} number_ = 0;
}};
"
        ));
    }
    text.push('\n');
    for name in numbers(header) {
        let short = name.strip_prefix("PTZCAL_").unwrap().to_lowercase();
        text.push_str(&format!("inline constexpr std::uint32_t {short} = {name};\n"));
    }
    text + "\nPTZCAL_END\n\n#endif\n"
}

/// (name without prefix, integer type, values) of the enums.
pub fn enums(header: &str) -> Vec<(String, String, Vec<String>)> {
    let mut found = Vec::new();
    for part in header.split("\nenum {\n").skip(1) {
        let (body, rest) = part.split_once("\n};\ntypedef ").unwrap();
        let (int, rest) = rest.split_once(" ptzcal_").unwrap();
        let lines = body.lines().map(str::trim).filter(|l| l.starts_with("PTZCAL_"));
        let values = lines.filter_map(|l| Some(l.split_once(" = ")?.0.to_owned())).collect();
        found.push((rest.split(';').next().unwrap().to_owned(), int.to_owned(), values));
    }
    found
}

/// Names of the constants that are no enum's; that of the ABI has the name of a function.
fn numbers(header: &str) -> Vec<&str> {
    let defines = header.lines().filter_map(|l| l.strip_prefix("#define PTZCAL_").map(|_| &l["#define ".len()..]));
    defines
        .filter_map(|l| l.split_once(' '))
        .filter(|(name, v)| v.parse::<u32>().is_ok() && *name != "PTZCAL_ABI_VERSION")
        .map(|(name, _)| name)
        .collect()
}
