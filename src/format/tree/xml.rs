//! XML as OpenCV's FileStorage writes it: an element is a map of its children, a list where they are
//! all named `_`, or its text. Attributes are passed over; a document type is refused.

use std::borrow::Cow;

use quick_xml::Reader;
use quick_xml::escape::resolve_predefined_entity;
use quick_xml::events::Event;

use super::{Budget, Fault, Node, Parsed, Value, insert};

/// An element that has begun.
struct Open<'a> {
    name: Cow<'a, str>,
    line: usize,
    text: String,
    children: Vec<(Cow<'a, str>, Node<'a>)>,
    items: Vec<Node<'a>>,
}

impl<'a> Open<'a> {
    fn new(name: Cow<'a, str>, line: usize) -> Self {
        Self { name, line, text: String::new(), children: Vec::new(), items: Vec::new() }
    }

    fn close(self) -> Parsed<(Cow<'a, str>, Node<'a>)> {
        let kinds = [!self.children.is_empty(), !self.items.is_empty(), !self.text.trim().is_empty()];
        let value = match kinds {
            [true, false, false] => Value::Map(self.children),
            [false, true, false] => Value::List(self.items),
            [false, false, _] => Value::Text(Cow::Owned(unquoted(self.text.trim()).to_owned())),
            _ => return Err(Fault::new(self.line, format!("{} mixes texts, items and keys", self.name))),
        };
        Ok((self.name, Node { line: self.line, value }))
    }
}

/// FileStorage puts texts with spaces in quotes.
fn unquoted(text: &str) -> &str {
    text.strip_prefix('"').and_then(|t| t.strip_suffix('"')).unwrap_or(text)
}

/// The root element of a document, whose own name does not matter.
pub fn xml(text: &str) -> Parsed<Node<'_>> {
    let mut reader = Reader::from_str(text);
    let mut budget = Budget::new();
    let mut open: Vec<Open<'_>> = Vec::new();
    let mut root = None;
    // Lines are counted from event to event: each byte once.
    let (mut line, mut seen) = (1, 0);
    loop {
        let event = reader.read_event();
        let position = usize::try_from(reader.buffer_position()).unwrap_or(usize::MAX).min(text.len());
        let at = line;
        line += text.as_bytes().get(seen..position).map_or(0, |b| b.iter().filter(|b| **b == b'\n').count());
        seen = seen.max(position);
        let malformed = |reason: String| Fault::new(line, reason);
        match event.map_err(|e| malformed(format!("not XML: {e}")))? {
            Event::Start(start) => {
                budget.take(at, open.len())?;
                open.push(Open::new(Cow::Owned(start.name().as_ref().to_owned()), at));
            }
            Event::Empty(start) => {
                budget.take(at, open.len())?;
                let element = Open::new(Cow::Owned(start.name().as_ref().to_owned()), at);
                close(element, &mut open, &mut root)?;
            }
            // The reader has checked that the names agree.
            Event::End(_) => {
                let element = open.pop().ok_or_else(|| malformed("an element ends that did not begin".into()))?;
                close(element, &mut open, &mut root)?;
            }
            Event::Text(piece) => append(&mut open, &piece, line)?,
            Event::GeneralRef(name) => {
                let resolved = name.resolve_char_ref().map_err(|e| malformed(format!("not XML: {e}")))?;
                if let Some(c) = resolved {
                    append(&mut open, c.encode_utf8(&mut [0; 4]), line)?;
                } else {
                    let entity = resolve_predefined_entity(&name);
                    append(&mut open, entity.ok_or_else(|| malformed("an entity of its own".into()))?, line)?;
                }
            }
            Event::CData(_) | Event::DocType(_) => return Err(malformed("neither CDATA nor DOCTYPE is read".into())),
            Event::Decl(_) | Event::Comment(_) | Event::PI(_) => {}
            Event::Eof if open.is_empty() => return root.ok_or_else(|| malformed("no element".into())),
            Event::Eof => return Err(malformed("the file ends in the middle".into())),
        }
    }
}

fn append(open: &mut [Open<'_>], text: &str, line: usize) -> Parsed<()> {
    match open.last_mut() {
        Some(element) => element.text.push_str(text),
        None if text.trim().is_empty() => {}
        None => return Err(Fault::new(line, "text outside of the document")),
    }
    Ok(())
}

fn close<'a>(element: Open<'a>, open: &mut [Open<'a>], root: &mut Option<Node<'a>>) -> Parsed<()> {
    let (name, node) = element.close()?;
    match open.last_mut() {
        Some(parent) if name == "_" => parent.items.push(node),
        Some(parent) => insert(&mut parent.children, name, node)?,
        None if root.is_none() => *root = Some(node),
        None => return Err(Fault::new(node.line, "a second document")),
    }
    Ok(())
}
