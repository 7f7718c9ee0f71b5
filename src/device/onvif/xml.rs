//! What a camera answers, as a small tree. Names lose their prefix: cameras bind the strangest ones,
//! and no two elements of ONVIF that matter here differ in their namespace alone.
//!
//! Everything is bounded: bytes by the caller, depth and count here. A document type is refused
//! (SOAP 1.2 has none), so that there are no entities but XML's own five.

use quick_xml::escape::resolve_predefined_entity;
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

const MAX_DEPTH: usize = 64;
const MAX_ELEMENTS: usize = 50_000;
const MAX_ATTRIBUTES: usize = 256;

/// What was read, or what is wrong with it.
pub type Read<T> = std::result::Result<T, String>;

#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Element {
    /// Without prefix.
    pub name: String,
    /// Names without prefix.
    attributes: Vec<(String, String)>,
    text: String,
    children: Vec<Element>,
}

impl Element {
    /// The root of a document; the error says what is wrong with it.
    pub fn parse(document: &[u8]) -> Read<Self> {
        let text = std::str::from_utf8(document).map_err(|_| "it is not UTF-8")?;
        let mut reader = Reader::from_str(text.trim_start_matches('\u{feff}'));
        let mut open: Vec<Self> = Vec::new();
        let mut root = None;
        let mut count = 0;
        loop {
            let event = reader.read_event().map_err(|e| format!("it is not XML: {e}"))?;
            match event {
                Event::Start(start) => {
                    count += 1;
                    if open.len() == MAX_DEPTH || count > MAX_ELEMENTS {
                        return Err(format!("it has over {MAX_DEPTH} levels or {MAX_ELEMENTS} elements"));
                    }
                    open.push(Self::begin(&start)?);
                }
                Event::Empty(start) => {
                    count += 1;
                    if count > MAX_ELEMENTS {
                        return Err(format!("it has over {MAX_ELEMENTS} elements"));
                    }
                    close(Self::begin(&start)?, &mut open, &mut root)?;
                }
                // The reader has checked that the names agree.
                Event::End(_) => {
                    let element = open.pop().ok_or("an element ends that did not begin")?;
                    close(element, &mut open, &mut root)?;
                }
                Event::Text(text) => append(&mut open, &text),
                Event::CData(data) => append(&mut open, &data),
                Event::GeneralRef(name) => {
                    if let Some(c) = name.resolve_char_ref().map_err(|e| format!("it is not XML: {e}"))? {
                        append(&mut open, c.encode_utf8(&mut [0; 4]));
                    } else {
                        let text = resolve_predefined_entity(&name);
                        append(&mut open, text.ok_or("it has entities of its own")?);
                    }
                }
                Event::DocType(_) => return Err("it has a document type, which SOAP forbids".into()),
                Event::Decl(_) | Event::Comment(_) | Event::PI(_) => {}
                Event::Eof if open.is_empty() => return root.ok_or_else(|| "it is empty".into()),
                Event::Eof => return Err("it ends in the middle".into()),
            }
        }
    }

    fn begin(start: &BytesStart<'_>) -> Read<Self> {
        let mut attributes = Vec::new();
        // The reader's own check for twins takes the square of their number.
        for attribute in start.attributes().with_checks(false) {
            let attribute = attribute.map_err(|e| format!("it is not XML: {e}"))?;
            if attributes.len() == MAX_ATTRIBUTES {
                return Err(format!("an element has over {MAX_ATTRIBUTES} attributes"));
            }
            let value =
                attribute.normalized_value(XmlVersion::Implicit1_0).map_err(|e| format!("it is not XML: {e}"))?;
            attributes.push((attribute.key.local_name().as_ref().to_owned(), value.into_owned()));
        }
        Ok(Self { name: start.local_name().as_ref().to_owned(), attributes, ..Self::default() })
    }

    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, value)| value.trim())
    }

    /// Its own text, without white space around it.
    pub fn text(&self) -> &str {
        self.text.trim()
    }

    pub fn children(&self) -> impl Iterator<Item = &Self> {
        self.children.iter()
    }

    pub fn all<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Self> {
        self.children.iter().filter(move |c| c.name == name)
    }

    pub fn child(&self, name: &str) -> Option<&Self> {
        self.children.iter().find(|c| c.name == name)
    }

    /// Down a path of names.
    pub fn at(&self, path: &[&str]) -> Option<&Self> {
        path.iter().try_fold(self, |element, name| element.child(name))
    }

    /// The text at the end of a path; `None` when it is empty too.
    pub fn text_at(&self, path: &[&str]) -> Option<&str> {
        self.at(path).map(Self::text).filter(|text| !text.is_empty())
    }
}

fn append(open: &mut [Element], text: &str) {
    if let Some(element) = open.last_mut() {
        element.text.push_str(text);
    }
}

fn close(element: Element, open: &mut [Element], root: &mut Option<Element>) -> Read<()> {
    match open.last_mut() {
        Some(parent) => parent.children.push(element),
        None if root.is_none() => *root = Some(element),
        None => return Err("it has more than one root".into()),
    }
    Ok(())
}

/// Text as it stands in an element or attribute.
pub fn escaped(text: &str) -> String {
    quick_xml::escape::escape(text).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_document_becomes_a_tree() {
        let text = "\u{feff}<?xml version=\"1.0\"?><a:r xmlns:a='u' t=\"1 &lt; 2\"><!-- no -->\
                    <b> x &amp; <![CDATA[<y>]]>&#33; </b><a:b a:k='v'/></a:r>";
        let root = Element::parse(text.as_bytes()).unwrap();
        assert_eq!((root.name.as_str(), root.attribute("t")), ("r", Some("1 < 2")));
        let texts: Vec<_> = root.all("b").map(Element::text).collect();
        assert_eq!(texts, ["x & <y>!", ""]);
        assert_eq!(root.children().nth(1).unwrap().attribute("k"), Some("v"));
        assert_eq!((root.text_at(&["b"]), root.text_at(&["b", "c"])), (Some("x & <y>!"), None));
        assert_eq!(Element::parse(format!("<a>{}</a>", escaped("1<2&\"'")).as_bytes()).unwrap().text(), "1<2&\"'");
    }

    #[test]
    fn what_is_no_reply_is_refused_with_a_reason() {
        let bomb = "<!DOCTYPE l [<!ENTITY a \"ha\"><!ENTITY b \"&a;&a;\">]><l>&b;</l>";
        let external = "<!DOCTYPE r SYSTEM \"file:///etc/passwd\"><r/>";
        let deep = "<a>".repeat(100_000);
        let many = format!("<r>{}</r>", "<a/>".repeat(MAX_ELEMENTS));
        let attributes: String = (0..100_000).map(|i| format!(" a{i}='x'")).collect();
        let wide = format!("<r{attributes}/>");
        let wrong: [(&[u8], &str); 14] = [
            (b"", "empty"),
            (b"   ", "empty"),
            (b"\xff\xfe<a/>", "UTF-8"),
            (b"<a>", "middle"),
            (b"<a><b></a>", "XML"),
            (b"</a>", "XML"),
            (b"<a/><b/>", "root"),
            (b"<a>&nbsp;</a>", "entities"),
            (b"<a>&#0;</a>", "XML"),
            (b"<a b='&x;'/>", "XML"),
            (bomb.as_bytes(), "document type"),
            (external.as_bytes(), "document type"),
            (deep.as_bytes(), "levels"),
            (many.as_bytes(), "elements"),
        ];
        for (text, reason) in wrong {
            let error = Element::parse(text).unwrap_err();
            assert!(error.contains(reason), "{}: {error}", String::from_utf8_lossy(&text[..text.len().min(40)]));
        }
        assert!(Element::parse(wide.as_bytes()).unwrap_err().contains("attributes"));
    }
}
