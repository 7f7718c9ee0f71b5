//! Numbers and texts as the files hold them.

/// Shortest digits that read back exactly, with the point and the exponent's sign that YAML 1.1
/// readers want to see in a number: 8.4519e+02.
pub(super) fn number(value: f64) -> String {
    let text = format!("{value:e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let point = if mantissa.contains('.') { "" } else { ".0" };
    let (sign, digits) = exponent.strip_prefix('-').map_or(('+', exponent), |digits| ('-', digits));
    if digits == "0" { format!("{mantissa}{point}") } else { format!("{mantissa}{point}e{sign}{digits:0>2}") }
}

/// Numbers with something between them.
pub(super) fn numbers(values: &[f64], between: &str) -> String {
    values.iter().map(|v| number(*v)).collect::<Vec<_>>().join(between)
}

/// A text in double quotes, as YAML reads it.
pub(super) fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if (c as u32) < 0x20 => quoted += &format!("\\x{:02x}", c as u32),
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}
