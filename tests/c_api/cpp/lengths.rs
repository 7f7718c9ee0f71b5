//! How long an array is, as its comment says: "n x 3 numbers", "36 numbers", "n pairs of noises".

/// A product: numbers and names of constants, and what is counted at run time.
#[derive(Clone, Debug, PartialEq)]
pub struct Length {
    /// Numbers for each of `of`; the whole length without.
    pub each: String,
    /// Names of arguments, such as `n`, or `columns` and `rows`.
    pub of: Vec<String>,
}

/// Arrays whose comments are for people only.
const SAID_OTHERWISE: [(&str, &str, &str); 3] = [
    ("ptzcal_adjustment_add_scan", "cameras", "n numbers"),
    ("ptzcal_site_set_room", "boxes", "n x 6 numbers"),
    ("ptzcal_site_set_plane", "normal", "3 numbers"),
];

/// Nothing when the comment speaks of no array.
pub fn read(function: &str, param: &str, comment: &str) -> Option<Length> {
    let said = SAID_OTHERWISE.iter().find(|(f, p, _)| (*f, *p) == (function, param)).map(|(_, _, length)| *length);
    let text = said.unwrap_or(comment.strip_prefix("Receives ").unwrap_or(comment));
    let words: Vec<&str> = text.split_whitespace().map(|w| w.trim_end_matches([':', ',', ';', '.'])).collect();
    let mut factors = vec![*words.first()?];
    let mut at = 1;
    while words.get(at) == Some(&"x") {
        factors.push(words.get(at + 1)?);
        at += 2;
    }
    let each = match &words[at..] {
        ["numbers" | "bytes" | "indices" | "distances", ..] => 1,
        ["standard", "deviations", ..] | ["working", "distances", ..] => 1,
        ["pairs", ..] => 2,
        ["points", ..] => 3,
        ["shots", "of", each, ..] => each.parse().ok()?,
        _ => return None,
    };
    let (mut number, mut names, mut of) = (each, Vec::new(), Vec::new());
    for factor in factors {
        if let Ok(n) = factor.parse::<usize>() {
            number *= n;
        } else if factor.starts_with("PTZCAL_") {
            names.push(factor);
        } else {
            of.push(factor.to_owned());
        }
    }
    let each = match names[..] {
        [] => number.to_string(),
        [name] if number == 1 => name.to_owned(),
        _ => return None,
    };
    Some(Length { each, of })
}

#[test]
fn lengths_are_read_from_comments() {
    let length = |comment| read("", "", comment).map(|l| (l.each, l.of.join(" ")));
    let is = |each: &str, of: &str| Some((each.to_owned(), of.to_owned()));
    assert_eq!(length("n x 3 numbers: points, metres."), is("3", "n"));
    assert_eq!(length("Receives 36 numbers: of point and direction."), is("36", ""));
    assert_eq!(length("15 x 15 numbers, row-major."), is("225", ""));
    assert_eq!(length("Receives columns x rows x 2 numbers: pixels."), is("2", "columns rows"));
    assert_eq!(length("PTZCAL_RIG_PARAMETERS standard deviations."), is("PTZCAL_RIG_PARAMETERS", ""));
    assert_eq!(length("n pairs of noises, px."), is("2", "n"));
    assert_eq!(length("n shots of 4 numbers: pan."), is("4", "n"));
    assert_eq!(length("Receives 0 (far) to 1 (near)."), None);
    assert_eq!(length("Receives 1 where there are normals."), None);
    assert_eq!(length("Receives the standard deviation of pan."), None);
}
