//! What the header declares, read back from its text.

use super::header;

pub struct Param {
    /// As written, such as `const double *`.
    pub kind: String,
    pub name: String,
    /// Its comment says that it may be NULL.
    pub may_be_null: bool,
    /// Its comment says that its numbers may be infinite.
    pub may_be_infinite: bool,
}

pub struct Function {
    pub name: String,
    pub returns: String,
    pub params: Vec<Param>,
    pub comment: String,
}

impl Function {
    /// The version that introduced it, as its comment says; empty if it does not.
    pub fn since(&self) -> &str {
        let line = self.comment.lines().filter_map(|l| l.trim_start_matches([' ', '*']).strip_prefix("Since ")).next();
        line.map_or("", |l| l.trim_end_matches('.'))
    }
}

pub struct Struct {
    pub name: String,
    pub members: Vec<String>,
}

#[derive(Default)]
pub struct Declarations {
    pub functions: Vec<Function>,
    pub structs: Vec<Struct>,
    /// Types that C knows by name only.
    pub handles: Vec<String>,
}

pub fn read() -> Declarations {
    parse(&header::text())
}

pub fn parse(text: &str) -> Declarations {
    let start = text.find("extern \"C\" {\n#endif\n").expect("the preface") + "extern \"C\" {\n#endif\n".len();
    let mut rest = &text[start..];
    let mut comment = "";
    let mut found = Declarations::default();
    loop {
        rest = rest.trim_start();
        if rest.is_empty() {
            return found;
        } else if rest.starts_with("/*") {
            let (head, tail) = rest.split_at(rest.find("*/").unwrap() + 2);
            (comment, rest) = (head, tail);
        } else if rest.starts_with('#') {
            rest = rest.split_once('\n').map_or("", |(_, tail)| tail);
        } else if rest.starts_with("} /* extern") {
            rest = rest.split_once('\n').unwrap().1;
        } else {
            let (head, tail) = rest.split_at(declaration_length(rest));
            declaration(head, comment, &mut found);
            (comment, rest) = ("", tail);
        }
    }
}

/// Up to the semicolon outside all braces and comments.
fn declaration_length(text: &str) -> usize {
    let mut depth = 0;
    let mut at = 0;
    while at < text.len() {
        if text[at..].starts_with("/*") {
            at += text[at..].find("*/").unwrap() + 2;
            continue;
        }
        match text.as_bytes()[at] {
            b'{' => depth += 1,
            b'}' => depth -= 1,
            b';' if depth == 0 => return at + 1,
            _ => {}
        }
        at += 1;
    }
    panic!("no end: {text}");
}

fn declaration(text: &str, comment: &str, found: &mut Declarations) {
    if let Some(rest) = text.strip_prefix("typedef struct ") {
        match rest.split_once(" {") {
            Some((name, body)) => {
                found.structs.push(Struct { name: name.to_owned(), members: members(body) });
            }
            None => found.handles.push(rest.split(' ').next().unwrap().to_owned()),
        }
    } else if !text.starts_with("typedef") && !text.starts_with("enum") {
        found.functions.push(function(text, comment));
    }
}

fn members(body: &str) -> Vec<String> {
    let mut code = String::new();
    let mut rest = body;
    while let Some((head, tail)) = rest.split_once("/*") {
        code.push_str(head);
        rest = tail.split_once("*/").unwrap().1;
    }
    code.push_str(rest.split('}').next().unwrap());
    code.split(';').map(str::trim).filter(|l| !l.is_empty()).map(member_name).collect()
}

/// `double rotation[9]` is `rotation`.
pub fn member_name(declaration: &str) -> String {
    declaration.split('[').next().unwrap().rsplit([' ', '*']).next().unwrap().to_owned()
}

fn function(text: &str, comment: &str) -> Function {
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let (head, tail) = text.split_once('(').unwrap();
    let (returns, name) = split_name(head);
    let inside = tail.split(')').next().unwrap();
    let params = if inside == "void" { Vec::new() } else { inside.split(", ").map(|p| param(p, comment)).collect() };
    Function { name, returns, params, comment: comment.to_owned() }
}

fn param(text: &str, comment: &str) -> Param {
    let (kind, name) = split_name(text);
    let about = param_comment(comment, &name);
    // "may be NULL when ..." is a condition, and another test's matter.
    let may_be_null = about.contains("may be NULL") && !about.contains("may be NULL when");
    let may_be_infinite = about.contains("may be infinite");
    Param { kind, name, may_be_null, may_be_infinite }
}

/// `const double *xyz` is (`const double *`, `xyz`).
fn split_name(text: &str) -> (String, String) {
    let at = text.rfind([' ', '*']).unwrap() + 1;
    (text[..at].trim().to_owned(), text[at..].to_owned())
}

/// Names that a comment documents, in its order.
pub fn documented(comment: &str) -> Vec<&str> {
    comment.lines().filter_map(|l| l.trim().strip_prefix("* @param ")?.split(' ').next()).collect()
}

pub fn param_comment(comment: &str, name: &str) -> String {
    let mut lines = comment.lines().map(|l| l.trim().trim_start_matches('*').trim());
    let begins = |l: &str| l.strip_prefix("@param ").is_some_and(|l| l.split(' ').next() == Some(name));
    let first = lines.by_ref().find(|l| begins(l)).unwrap_or_default().to_owned();
    lines.take_while(|l| !l.is_empty() && !l.starts_with('@')).fold(first, |all, l| all + " " + l)
}

/// The header is the manual: nothing may be left out of it.
#[test]
fn every_function_is_documented() {
    let found = read();
    for f in &found.functions {
        let names: Vec<&str> = f.params.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(documented(&f.comment), names, "the @param lines of {}", f.name);
        assert_eq!(f.comment.contains("@return "), f.returns != "void", "the @return line of {}", f.name);
        assert!(f.since().starts_with("0."), "{} does not say since when it is there", f.name);
        let rule = ["free", "shared", "exclusive"].iter().find(|r| f.comment.contains(&format!("* Threads: {r}.")));
        let rule = rule.unwrap_or_else(|| panic!("{} has no 'Threads:' line", f.name));
        let changes = |p: &Param| found.handles.iter().any(|h| p.kind == format!("{h} *"));
        assert_eq!(f.params.iter().any(changes), *rule == "exclusive", "the 'Threads:' line of {}", f.name);
    }
}

#[test]
fn every_function_has_the_common_form() {
    let found = read();
    assert!(
        found.functions.len() > 50 && found.structs.len() > 5 && found.handles.len() > 5,
        "the header was not read"
    );
    for f in &found.functions {
        assert!(f.name.starts_with("ptzcal_"), "{}", f.name);
        for (i, p) in f.params.iter().enumerate() {
            let is_error = p.kind == "ptzcal_error **";
            assert_eq!(is_error, p.name == "error" && p.kind.ends_with("**"), "{}: {}", f.name, p.name);
            assert!(
                !is_error || (p.may_be_null && i + 1 == f.params.len()),
                "{}: the error is last, and optional",
                f.name
            );
        }
        if f.name.ends_with("_free") {
            assert!(f.returns == "void" && f.params.len() == 1 && f.params[0].may_be_null, "{}", f.name);
        }
    }
    for s in &found.structs {
        assert_eq!(s.members[0], "struct_size", "{}", s.name);
        let init = format!("{}_init", s.name);
        let read_only = s.name == "ptzcal_progress";
        assert!(read_only || found.functions.iter().any(|f| f.name == init), "{init} is missing");
    }
    for h in &found.handles {
        let ends = [format!("{h}_free"), format!("{h}_close")];
        assert!(found.functions.iter().any(|f| ends.contains(&f.name)), "{h} cannot be freed");
    }
}
