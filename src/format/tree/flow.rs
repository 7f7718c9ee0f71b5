//! Lists and maps in brackets: JSON, Python's literals, and what YAML calls flow style.

use std::borrow::Cow;

use super::{Budget, Fault, Node, Parsed, Value, insert, shown};

/// What is allowed between the brackets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Style {
    /// RFC 8259: double quotes, no comments, nothing after the last comma.
    Json,
    /// What `ast.literal_eval` takes: also tuples, bytes, texts that follow each other, comments.
    Python,
    /// Words without quotes, single quotes, comments.
    Yaml,
}

/// A JSON document.
pub fn json(text: &str) -> Parsed<Node<'_>> {
    document(text, Style::Json)
}

/// A literal of Python: a dict, list, tuple, text or number, with its comments.
pub fn python(text: &str) -> Parsed<Node<'_>> {
    document(text, Style::Python)
}

fn document(text: &str, style: Style) -> Parsed<Node<'_>> {
    let mut cursor = Cursor::new(text, style);
    let node = cursor.value(0)?;
    cursor.skip_space();
    match cursor.peek() {
        None => Ok(node),
        Some(_) => Err(cursor.fault("more after the end")),
    }
}

/// A place in the text, with its line.
pub(super) struct Cursor<'a> {
    pub text: &'a str,
    pub at: usize,
    pub line: usize,
    pub budget: Budget,
    style: Style,
}

impl<'a> Cursor<'a> {
    pub fn new(text: &'a str, style: Style) -> Self {
        Self { text, at: 0, line: 1, budget: Budget::new(), style }
    }

    pub fn fault(&self, reason: impl Into<String>) -> Fault {
        Fault::new(self.line, reason)
    }

    pub fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    pub fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }

    pub fn next(&mut self) -> Option<char> {
        let c = self.peek()?;
        self.at += c.len_utf8();
        self.line += usize::from(c == '\n');
        Some(c)
    }

    fn take(&mut self, wanted: char) -> bool {
        let found = self.peek() == Some(wanted);
        if found {
            self.next();
        }
        found
    }

    /// White space, line ends and comments.
    fn skip_space(&mut self) {
        while let Some(c) = self.peek() {
            if c == '#' && self.style != Style::Json {
                while self.peek().is_some_and(|c| c != '\n') {
                    self.next();
                }
            } else if matches!(c, ' ' | '\t' | '\r' | '\n') {
                self.next();
            } else {
                break;
            }
        }
    }

    /// The next value, after white space.
    pub fn value(&mut self, depth: usize) -> Parsed<Node<'a>> {
        self.skip_space();
        let line = self.line;
        self.budget.take(line, depth)?;
        let value = match self.peek() {
            Some('[') => Value::List(self.list(']', depth)?),
            Some('(') if self.style == Style::Python => Value::List(self.list(')', depth)?),
            Some('{') => self.map(depth)?,
            _ => Value::Text(self.scalar()?),
        };
        Ok(Node { line, value })
    }

    fn list(&mut self, end: char, depth: usize) -> Parsed<Vec<Node<'a>>> {
        let mut list = Vec::new();
        self.next();
        self.skip_space();
        while !self.take(end) {
            list.push(self.value(depth + 1)?);
            self.comma(end)?;
        }
        Ok(list)
    }

    fn map(&mut self, depth: usize) -> Parsed<Value<'a>> {
        let mut map = Vec::new();
        self.next();
        self.skip_space();
        while !self.take('}') {
            if self.style == Style::Json && self.peek() != Some('"') {
                return Err(self.fault("a key is a text in double quotes"));
            }
            let key = self.scalar()?;
            self.skip_space();
            if !self.take(':') {
                return Err(self.fault(format!("no ':' after {}", shown(&key))));
            }
            let value = self.value(depth + 1)?;
            insert(&mut map, key, value)?;
            self.comma('}')?;
        }
        Ok(Value::Map(map))
    }

    /// What follows an item: a comma, or the list's end, which stays.
    fn comma(&mut self, end: char) -> Parsed<()> {
        self.skip_space();
        if self.take(',') {
            self.skip_space();
            return if self.style == Style::Json && self.peek() == Some(end) {
                Err(self.fault(format!("nothing between ',' and '{end}'")))
            } else {
                Ok(())
            };
        }
        match self.peek() {
            Some(c) if c == end => Ok(()),
            Some(c) => Err(self.fault(format!("'{}' where ',' or '{end}' belongs", shown(&c.to_string())))),
            None => Err(self.fault(format!("the file ends before '{end}'"))),
        }
    }

    /// A quoted text, or a word or number.
    fn scalar(&mut self) -> Parsed<Cow<'a, str>> {
        if self.quote().is_none() {
            return self.word().map(Cow::Borrowed);
        }
        let mut text = self.quoted()?;
        // Python's texts that follow each other are one.
        while self.style == Style::Python {
            self.skip_space();
            if self.quote().is_none() {
                break;
            }
            let more = self.quoted()?;
            text.to_mut().push_str(&more);
        }
        Ok(text)
    }

    fn word(&mut self) -> Parsed<&'a str> {
        let ends = |c: char| matches!(c, ',' | '[' | ']' | '{' | '}' | '(' | ')' | '\n' | '\r' | '"' | '\'' | ':');
        let rest = self.rest();
        let line = &rest[..rest.find(ends).unwrap_or(rest.len())];
        // A comment needs a space before it in YAML, not in Python.
        let comment = match self.style {
            Style::Json => None,
            Style::Python => line.find('#'),
            Style::Yaml => line.find(" #"),
        };
        let word = line[..comment.unwrap_or(line.len())].trim_end_matches([' ', '\t']);
        let broken = self.style != Style::Yaml && word.contains([' ', '\t']);
        if word.is_empty() || broken {
            let found = rest.chars().next().map_or("the file's end".into(), |c| format!("'{}'", shown(&c.to_string())));
            return Err(self.fault(if broken {
                format!("'{}' is no value", shown(word))
            } else {
                format!("{found} where a value belongs")
            }));
        }
        self.at += word.len();
        Ok(word)
    }

    /// The quotation mark that comes next, if one does; before it Python may have a b.
    pub fn quote(&self) -> Option<char> {
        let rest = match self.style {
            Style::Python => self.rest().strip_prefix('b').unwrap_or(self.rest()),
            _ => self.rest(),
        };
        rest.chars().next().filter(|c| *c == '"' || (*c == '\'' && self.style != Style::Json))
    }

    /// A text in quotes, which come next.
    pub fn quoted(&mut self) -> Parsed<Cow<'a, str>> {
        if self.style == Style::Python {
            self.take('b');
        }
        let begun = self.line;
        let quote = self.next();
        let start = self.at;
        let mut changed: Option<String> = None;
        loop {
            let before = self.at;
            let c = match self.next() {
                None | Some('\n' | '\r') => return Err(Fault::new(begun, "a text has no end")),
                c if c == quote => {
                    // YAML doubles a single quote.
                    if self.style == Style::Yaml && quote == Some('\'') && self.take('\'') {
                        Some('\'')
                    } else {
                        return Ok(changed.map_or(Cow::Borrowed(&self.text[start..before]), Cow::Owned));
                    }
                }
                Some('\\') if !(self.style == Style::Yaml && quote == Some('\'')) => Some(self.escape()?),
                c => c,
            };
            let same = self.at - before == c.map_or(0, char::len_utf8);
            if changed.is_some() || !same {
                let text = changed.get_or_insert_with(|| self.text[start..before].to_owned());
                text.extend(c);
            }
        }
    }

    /// What a backslash and the next characters stand for.
    fn escape(&mut self) -> Parsed<char> {
        let digits = match self.next() {
            Some(c @ ('"' | '\'' | '\\' | '/')) => return Ok(c),
            Some('n') => return Ok('\n'),
            Some('t') => return Ok('\t'),
            Some('r') => return Ok('\r'),
            Some('b') => return Ok('\u{8}'),
            Some('f') => return Ok('\u{c}'),
            Some('x') => 2,
            Some('u') => 4,
            _ => return Err(self.fault("a backslash before what has none")),
        };
        let code = self.rest().get(..digits).and_then(|hex| u32::from_str_radix(hex, 16).ok()).and_then(char::from_u32);
        // Names of cameras: pairs of surrogates are not worth their code.
        let code = code.ok_or_else(|| self.fault("a backslash before what is no character"))?;
        self.at += digits;
        Ok(code)
    }
}
