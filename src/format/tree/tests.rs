use super::*;

fn text(line: usize, text: &str) -> Node<'_> {
    Node { line, value: Value::Text(Cow::Borrowed(text)) }
}

fn list(line: usize, items: Vec<Node<'_>>) -> Node<'_> {
    Node { line, value: Value::List(items) }
}

fn map<'a>(line: usize, entries: Vec<(&'a str, Node<'a>)>) -> Node<'a> {
    Node { line, value: Value::Map(entries.into_iter().map(|(k, v)| (Cow::Borrowed(k), v)).collect()) }
}

fn fault(parsed: Parsed<Node<'_>>) -> (usize, String) {
    let fault = parsed.unwrap_err();
    (fault.line, fault.reason)
}

#[test]
fn yaml_is_read_as_others_read_it() {
    let source = "%YAML:1.0\n---\n# a camera\nname: \"wide # \\\"1\\\"\" # the first\nplain: a b:c # d\n\
        quoted: 'it''s'\nempty:\nmatrix: !!opencv-matrix\n   rows: 1\n   data: [ 1., -2e+00,\n       3 ]\n\
        flow: {a: [1, 2,], 'b': x y}\nlist:\n- 1\n- [2, 3]\n- key: v\n  other: w\n-\n  - deep\n  - - a\n    - b\n\
        indented:\n  - 4\n...\n\n";
    let wanted = map(
        4,
        vec![
            ("name", text(4, "wide # \"1\"")),
            ("plain", text(5, "a b:c")),
            ("quoted", text(6, "it's")),
            ("empty", text(7, "")),
            (
                "matrix",
                map(
                    8,
                    vec![
                        ("rows", text(9, "1")),
                        ("data", list(10, vec![text(10, "1."), text(10, "-2e+00"), text(11, "3")])),
                    ],
                ),
            ),
            ("flow", map(12, vec![("a", list(12, vec![text(12, "1"), text(12, "2")])), ("b", text(12, "x y"))])),
            (
                "list",
                list(
                    13,
                    vec![
                        text(14, "1"),
                        list(15, vec![text(15, "2"), text(15, "3")]),
                        map(16, vec![("key", text(16, "v")), ("other", text(17, "w"))]),
                        list(19, vec![text(19, "deep"), list(20, vec![text(20, "a"), text(21, "b")])]),
                    ],
                ),
            ),
            ("indented", list(22, vec![text(23, "4")])),
        ],
    );
    assert_eq!(yaml(source).unwrap(), wanted);
    assert_eq!(yaml(&source.replace('\n', "\r\n")).unwrap(), wanted);
}

#[test]
fn yaml_beyond_the_part_that_is_read_is_refused_with_its_line() {
    for (source, line, word) in [
        ("", 1, "empty"),
        ("# only\n---\n", 3, "empty"),
        ("a: 1\n---\nb: 2\n", 2, "second document"),
        ("a: 1\n...\nb: 2\n", 3, "document's end"),
        ("a: 1\na: 2\n", 2, "twice"),
        ("a: 1\n   b: 2\n", 2, "deeper"),
        ("a:\n  b: 1\n c: 2\n", 3, "deeper"),
        ("a:\n\tb: 1\n", 2, "tab"),
        ("a: &x 1\n", 1, "no YAML"),
        ("a: *x\n", 1, "no YAML"),
        ("a: |\n  text\n", 1, "no YAML"),
        ("? a\n: b\n", 1, "key"),
        ("a: 1\nwords\n", 2, "not a key"),
        ("words\n", 1, "not a key"),
        ("a: \"no end\nb: 1\n", 1, "no end"),
        ("a: \"x\" y\n", 1, "after a value"),
        ("a: [1, 2\n", 2, "ends before"),
        ("a: [1 2] 3\n", 1, "after a value"),
        ("a: [1, [2}]\n", 1, "belongs"),
        ("a: {b 1}\n", 1, "no ':'"),
        ("a: [1, , 2]\n", 1, "where a value belongs"),
    ] {
        let (found, reason) = fault(yaml(source));
        assert!(found == line && reason.contains(word), "{source:?}: line {found}: {reason}");
    }
}

#[test]
fn json_and_python_differ_where_they_should() {
    let source = "{\"a\": [1, -2.5e3], \"b\": {\"c\": \"x\\u0041\\n\"},\n\"d\": true}";
    let wanted = map(
        1,
        vec![
            ("a", list(1, vec![text(1, "1"), text(1, "-2.5e3")])),
            ("b", map(1, vec![("c", text(1, "xA\n"))])),
            ("d", text(2, "true")),
        ],
    );
    assert_eq!(json(source).unwrap(), wanted);
    assert_eq!(python(source).unwrap(), wanted);
    let own = "# a model\n{ 'a': (1, 2,), # two\n  'b': b'x''y'\n  \"z\", }\n";
    let wanted = map(2, vec![("a", list(2, vec![text(2, "1"), text(2, "2")])), ("b", text(3, "xyz"))]);
    assert_eq!(python(own).unwrap(), wanted);
    for source in
        [own, "{'a': 1}", "{\"a\": [1,]}", "{\"a\": 1,}", "{\"a\": (1)}", "{a: 1}", "{\"a\": 1 2}", "{\"a\": \"\\q\"}"]
    {
        assert!(json(source).is_err(), "{source}");
    }
    for source in
        ["{'a': array([1])}", "{'a': 1 + 2}", "{'a': [1}", "{'a': 1", "{'a': 1} {", "{'a': 1, 'a': 2}", "{'a': '\n'}"]
    {
        assert!(python(source).is_err(), "{source}");
    }
}

#[test]
fn xml_is_a_map_a_list_or_a_text() {
    let source = "<?xml version=\"1.0\"?>\n<opencv_storage>\n<a>1</a>\n<m type_id=\"opencv-matrix\">\n  <rows>2</rows>\n  \
        <data>\n    1. 2.</data></m>\n<names>\n  <_>\"a &amp; b\"</_>\n  <_>c</_></names>\n<none/>\n</opencv_storage>\n";
    let wanted = map(
        2,
        vec![
            ("a", text(3, "1")),
            ("m", map(4, vec![("rows", text(5, "2")), ("data", text(6, "1. 2."))])),
            ("names", list(8, vec![text(9, "a & b"), text(10, "c")])),
            ("none", text(11, "")),
        ],
    );
    assert_eq!(xml(source).unwrap(), wanted);
    for (source, word) in [
        ("", "no element"),
        ("<a><b>1</b>", "in the middle"),
        ("<a><b>1</a>", "not XML"),
        ("<a><b>1</b><b>2</b></a>", "twice"),
        ("<a>1<b>2</b></a>", "mixes"),
        ("<a/><a/>", "second document"),
        ("<!DOCTYPE a [<!ENTITY x \"y\">]><a>&x;</a>", "DOCTYPE"),
        ("<a>&x;</a>", "entity"),
        ("words", "outside"),
    ] {
        let (_, reason) = fault(xml(source));
        assert!(reason.contains(word), "{source}: {reason}");
    }
}

/// Memory and stack are bounded whatever the file says.
#[test]
fn depth_and_number_are_bounded() {
    let many = 200_000;
    for deep in ["[".repeat(many), "{\"a\":".repeat(many), "(".repeat(many), "{'a':(".repeat(many)] {
        assert!(python(&deep).is_err() && json(&deep).is_err() && yaml(&deep).is_err());
    }
    assert!(fault(json(&"[".repeat(many))).1.contains("levels"));
    assert!(fault(xml(&"<a>".repeat(many))).1.contains("levels"));
    assert!(fault(yaml(&"- ".repeat(many))).1.contains("levels"));
    let stairs: String = (0..many / 100).map(|i| " ".repeat(i) + "a:\n").collect();
    assert!(fault(yaml(&stairs)).1.contains("levels"));
    let long = format!("[{}1]", "1,".repeat(MOST_VALUES));
    assert!(fault(json(&long)).1.contains("values"));
    assert!(fault(yaml(&("a: ".to_owned() + &long))).1.contains("values"));
    let keys: String = (0..2000).map(|i| format!("k{i}: 1\n")).collect();
    assert!(fault(yaml(&keys)).1.contains("keys"));
}

/// Any text ends in a tree or in a fault with a line of the text.
#[test]
fn fuzz_trees() {
    use crate::fuzz::{Random, fuzz_inputs};
    let mut random = Random(3);
    let pieces: Vec<&str> = "a b1 -2.5e3 : :  , [ ] { } ( ) - -- --- ... \" ' \\ \\n \\u00 # ! !!t & * | > % <a> </a> <_> </_> <b/> &amp; \n \r\n \t é b' ?"
        .split(' ')
        .chain([" ", "  ", "\n", "\n  ", ": ", "- ", "key: ", "\n- ", ",\n", "=\"x\"", "<?xml?>", "<!--", "-->"])
        .collect();
    let (mut trees, mut faults) = (0u64, 0u64);
    for _ in 0..fuzz_inputs() {
        let mut source = String::new();
        for _ in 0..random.below(24) {
            source += pieces[random.below(pieces.len() as u64) as usize];
        }
        let most = source.lines().count() + 1;
        for parsed in [yaml(&source), json(&source), python(&source), xml(&source)] {
            match parsed {
                Ok(node) => {
                    trees += 1;
                    assert!(node.line <= most, "{source:?}");
                }
                Err(fault) => {
                    faults += 1;
                    assert!(fault.line >= 1 && fault.line <= most, "{source:?}: line {}", fault.line);
                }
            }
        }
    }
    assert!(trees > fuzz_inputs() / 100 && faults > fuzz_inputs(), "{trees} {faults}");
}
