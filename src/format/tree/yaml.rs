//! The part of YAML that camera files use: one document of maps and lists, indented or in brackets,
//! texts on one line each, comments, tags (passed over). Refused are anchors and aliases, texts over
//! several lines, keys with '?', tabs that indent, and a second document.

use std::borrow::Cow;

use super::flow::{Cursor, Style};
use super::{Node, Parsed, Value, insert, shown};

/// A YAML document, of OpenCV's header too (`%YAML:1.0`, which YAML itself does not know).
pub fn yaml(text: &str) -> Parsed<Node<'_>> {
    let mut yaml = Yaml { cursor: Cursor::new(text, Style::Yaml) };
    yaml.header()?;
    let node = match yaml.next_line()? {
        Some(indent) => yaml.block(indent, 0)?,
        None => return Err(yaml.cursor.fault("the file is empty")),
    };
    match yaml.next_line()? {
        None => Ok(node),
        Some(_) => Err(yaml.cursor.fault("neither of the map before nor of a deeper one")),
    }
}

struct Yaml<'a> {
    cursor: Cursor<'a>,
}

impl<'a> Yaml<'a> {
    /// What stands before the document: directives, comments, its mark.
    fn header(&mut self) -> Parsed<()> {
        loop {
            let line = self.line();
            let text = line.trim_end();
            if !(text.is_empty() || text.starts_with(['%', '#']) || text == "---") {
                return Ok(());
            }
            if self.cursor.rest().is_empty() {
                return Ok(());
            }
            self.skip_line();
            if text == "---" {
                return Ok(());
            }
        }
    }

    /// What is left of the line.
    fn line(&self) -> &'a str {
        let rest = self.cursor.rest();
        &rest[..rest.find('\n').unwrap_or(rest.len())]
    }

    fn skip_line(&mut self) {
        self.cursor.at += self.line().len();
        self.cursor.next();
    }

    fn skip_spaces(&mut self) {
        let line = self.line();
        self.cursor.at += line.len() - line.trim_start_matches(' ').len();
    }

    /// Is nothing left of the line but a comment?
    fn line_is_done(&self) -> bool {
        let line = self.line().trim_start();
        line.is_empty() || line.starts_with('#')
    }

    /// Column of the cursor, from 0.
    fn column(&self) -> usize {
        let before = &self.cursor.text[..self.cursor.at];
        self.cursor.at - before.rfind('\n').map_or(0, |i| i + 1)
    }

    /// Goes to the next line with something on it, from the start of a line; its indentation. `None` at
    /// the document's end.
    fn next_line(&mut self) -> Parsed<Option<usize>> {
        while !self.cursor.rest().is_empty() {
            if self.column() == 0 && self.line().trim_end() == "..." {
                self.skip_line();
                while !self.cursor.rest().is_empty() {
                    if !self.line_is_done() {
                        return Err(self.cursor.fault("more after the document's end"));
                    }
                    self.skip_line();
                }
                return Ok(None);
            }
            if self.column() == 0 && self.line().trim_end() == "---" {
                return Err(self.cursor.fault("a second document"));
            }
            if !self.line_is_done() {
                self.skip_spaces();
                if self.cursor.peek() == Some('\t') {
                    return Err(self.cursor.fault("indented by a tab"));
                }
                return Ok(Some(self.column()));
            }
            self.skip_line();
        }
        Ok(None)
    }

    /// To the end of a line on which nothing but a comment may be left.
    fn end_line(&mut self) -> Parsed<()> {
        if !self.line_is_done() {
            let found = shown(self.line().trim());
            return Err(self.cursor.fault(format!("'{found}' after a value")));
        }
        self.skip_line();
        Ok(())
    }

    /// The list, map or value that begins here, in this column.
    fn block(&mut self, indent: usize, depth: usize) -> Parsed<Node<'a>> {
        let line = self.cursor.line;
        if self.at_item() {
            self.cursor.budget.take(line, depth)?;
            return Ok(Node { line, value: Value::List(self.list(indent, depth)?) });
        }
        if self.at_key() {
            self.cursor.budget.take(line, depth)?;
            return Ok(Node { line, value: Value::Map(self.map(indent, depth)?) });
        }
        if depth == 0 && !matches!(self.cursor.peek(), Some('[' | '{')) {
            return Err(self.cursor.fault(format!("'{}' is not a key and a value", shown(self.line().trim()))));
        }
        self.inline(depth)
    }

    /// Does an item of a list begin here?
    fn at_item(&self) -> bool {
        let line = self.line().trim_end();
        line == "-" || line.starts_with("- ")
    }

    /// Does a key begin here, with its colon on this line?
    fn at_key(&self) -> bool {
        let line = self.line();
        let quote = self.cursor.quote();
        let after = match quote {
            Some(quote) => line[1..].find(quote).map(|i| &line[i + 2..]),
            None if line.starts_with(['[', '{']) => None,
            None => plain_key(line).map(|key| &line[key.len()..]),
        };
        after.is_some_and(|rest| is_colon(rest.trim_start()))
    }

    fn list(&mut self, indent: usize, depth: usize) -> Parsed<Vec<Node<'a>>> {
        let mut list = Vec::new();
        loop {
            self.cursor.next();
            self.skip_spaces();
            let item = if self.line_is_done() {
                self.below(indent, false, depth)?
            } else if self.at_item() || self.at_key() {
                self.block(self.column(), depth + 1)?
            } else {
                self.inline(depth + 1)?
            };
            list.push(item);
            if !self.continues(indent)? || !self.at_item() {
                return Ok(list);
            }
        }
    }

    fn map(&mut self, indent: usize, depth: usize) -> Parsed<Vec<(Cow<'a, str>, Node<'a>)>> {
        let mut map = Vec::new();
        loop {
            let line = self.cursor.line;
            if !self.at_key() {
                return Err(self.cursor.fault(format!("'{}' is not a key and a value", shown(self.line().trim()))));
            }
            let key = match self.cursor.quote() {
                Some(_) => self.cursor.quoted()?,
                None => {
                    let key = plain_key(self.line()).unwrap_or_default();
                    self.cursor.at += key.len();
                    if key.starts_with(['?', '&', '*', '!', '|', '>', '@', '`']) {
                        return Err(self.cursor.fault(format!("'{}': no YAML that is read here", shown(key))));
                    }
                    Cow::Borrowed(key.trim_end())
                }
            };
            self.skip_spaces();
            // The colon.
            self.cursor.next();
            self.skip_spaces();
            self.skip_tag()?;
            let node = if self.line_is_done() {
                // The items of a list may stand below their key without being indented.
                self.below(indent, true, depth)?
            } else {
                self.inline(depth + 1)?
            };
            insert(&mut map, key, Node { line, ..node })?;
            if !self.continues(indent)? {
                return Ok(map);
            }
        }
    }

    /// A tag says how a program keeps the value.
    fn skip_tag(&mut self) -> Parsed<()> {
        if self.cursor.peek() == Some('!') {
            let line = self.line();
            self.cursor.at += line.find([' ', '\r']).unwrap_or(line.len());
            self.skip_spaces();
        }
        Ok(())
    }

    /// The value on the lines below, which are indented deeper, or are `items` of the same indentation;
    /// an empty text when there is none.
    fn below(&mut self, indent: usize, items: bool, depth: usize) -> Parsed<Node<'a>> {
        let line = self.cursor.line;
        self.skip_line();
        if let Some(found) = self.next_line()?
            && (found > indent || (items && found == indent && self.at_item()))
        {
            return self.block(found, depth + 1);
        }
        self.cursor.budget.take(line, depth + 1)?;
        Ok(Node { line, value: Value::Text(Cow::Borrowed("")) })
    }

    /// Is the next line one of this block? The end of the block is no fault; a deeper line is.
    fn continues(&mut self, indent: usize) -> Parsed<bool> {
        match self.next_line()? {
            Some(found) if found > indent => Err(self.cursor.fault("indented deeper than what it follows")),
            Some(found) => Ok(found == indent),
            None => Ok(false),
        }
    }

    /// A value on this line; brackets may go on over the next ones.
    fn inline(&mut self, depth: usize) -> Parsed<Node<'a>> {
        let line = self.cursor.line;
        let node = match self.cursor.peek() {
            Some('[' | '{') => self.cursor.value(depth)?,
            Some('&' | '*' | '|' | '>' | '?' | '@' | '`' | '%') => {
                return Err(self.cursor.fault(format!("'{}': no YAML that is read here", shown(self.line().trim()))));
            }
            _ => {
                self.cursor.budget.take(line, depth)?;
                let text =
                    if self.cursor.quote().is_some() { self.cursor.quoted()? } else { Cow::Borrowed(self.plain()) };
                Node { line, value: Value::Text(text) }
            }
        };
        self.end_line()?;
        Ok(node)
    }

    /// A text without quotes, up to a comment or the line's end.
    fn plain(&mut self) -> &'a str {
        let line = self.line();
        let text = line[..line.find(" #").unwrap_or(line.len())].trim_end();
        self.cursor.at += text.len();
        text
    }
}

/// The line up to the first colon that ends a key.
fn plain_key(line: &str) -> Option<&str> {
    let found = line
        .match_indices([':', '#'])
        .find(|(i, mark)| if *mark == "#" { line[..*i].ends_with(' ') } else { is_colon(&line[*i..]) });
    found.filter(|(i, mark)| *mark == ":" && *i > 0).map(|(i, _)| &line[..i])
}

fn is_colon(text: &str) -> bool {
    text.strip_prefix(':').is_some_and(|rest| rest.is_empty() || rest.starts_with([' ', '\t', '\r']))
}
