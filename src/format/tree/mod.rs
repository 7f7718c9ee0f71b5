//! Text files of others as one kind of tree, of texts, lists and maps, in which everything knows its
//! line: YAML, XML, JSON and Python's literals differ in their marks only, once a reader looks for keys.
//!
//! Bounded: bytes by the caller, depth and number of values here. A key that is there twice is refused.

mod flow;
mod xml;
mod yaml;

use std::borrow::Cow;

pub(super) use flow::{json, python};
pub(super) use xml::xml;
pub(super) use yaml::yaml;

use super::file::format_error;
use crate::error::{Error, Result};

/// Levels of lists and maps in each other.
const DEEPEST: usize = 32;
/// Texts, lists and maps of a file.
const MOST_VALUES: usize = 1_000_000;

/// What is wrong, and in which line.
#[derive(Debug)]
pub(super) struct Fault {
    line: usize,
    reason: String,
}

impl Fault {
    fn new(line: usize, reason: impl Into<String>) -> Self {
        Self { line, reason: reason.into() }
    }

    pub fn of_file(self, name: &str) -> Error {
        format_error(name, format!("line {}: {}", self.line, self.reason))
    }
}

type Parsed<T> = std::result::Result<T, Fault>;

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Node<'a> {
    /// Where it begins, from 1.
    line: usize,
    value: Value<'a>,
}

#[derive(Debug, Clone, PartialEq)]
enum Value<'a> {
    /// A number, a word or a quoted text: which of them, the reader of the key knows.
    Text(Cow<'a, str>),
    List(Vec<Node<'a>>),
    Map(Vec<(Cow<'a, str>, Node<'a>)>),
}

/// Counts what a file makes us keep.
struct Budget(usize);

impl Budget {
    fn new() -> Self {
        Self(MOST_VALUES)
    }

    fn take(&mut self, line: usize, depth: usize) -> Parsed<()> {
        self.0 = self.0.checked_sub(1).ok_or_else(|| Fault::new(line, format!("over {MOST_VALUES} values")))?;
        if depth > DEEPEST {
            return Err(Fault::new(line, format!("over {DEEPEST} levels of lists and maps")));
        }
        Ok(())
    }
}

/// Adds a key with its value to a map. The search is linear: camera files have few keys, and the
/// number of those is bounded.
fn insert<'a>(map: &mut Vec<(Cow<'a, str>, Node<'a>)>, key: Cow<'a, str>, node: Node<'a>) -> Parsed<()> {
    const MOST_KEYS: usize = 1000;
    if map.len() == MOST_KEYS {
        return Err(Fault::new(node.line, format!("over {MOST_KEYS} keys")));
    }
    if map.iter().any(|(k, _)| *k == key) {
        return Err(Fault::new(node.line, format!("{key} is there twice")));
    }
    map.push((key, node));
    Ok(())
}

/// A node with its way from the root, for messages.
#[derive(Clone)]
pub(super) struct Place<'a> {
    file: &'a str,
    path: String,
    node: &'a Node<'a>,
}

impl<'a> Place<'a> {
    pub fn root(file: &'a str, node: &'a Node<'a>) -> Self {
        Self { file, path: String::new(), node }
    }

    /// An error that names file, line and key.
    pub fn wrong(&self, reason: impl std::fmt::Display) -> Error {
        let key = if self.path.is_empty() { String::new() } else { format!("{}: ", self.path) };
        format_error(self.file, format!("line {}: {key}{reason}", self.node.line))
    }

    /// What the file says is right, and nothing that this library has.
    pub fn unsupported(&self, reason: impl std::fmt::Display) -> Error {
        Error::Unsupported { what: format!("{}: line {}: {}: {reason}", self.file, self.node.line, self.path) }
    }

    fn below(&self, key: &str, node: &'a Node<'a>) -> Self {
        let path = if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) };
        Self { file: self.file, path, node }
    }

    /// The keys of a map with their values.
    pub fn entries(&self) -> Result<impl Iterator<Item = (&'a str, Self)> + '_> {
        let Value::Map(map) = &self.node.value else { return Err(self.wrong("no keys with values")) };
        Ok(map.iter().map(|(key, node)| (key.as_ref(), self.below(key, node))))
    }

    /// The value of a key of this map, in any case of letters: OpenCV's older samples wrote Camera_Matrix.
    pub fn get(&self, key: &str) -> Result<Option<Self>> {
        Ok(self.entries()?.find(|(k, _)| k.eq_ignore_ascii_case(key)).map(|(_, place)| place))
    }

    pub fn need(&self, key: &str) -> Result<Self> {
        self.get(key)?.ok_or_else(|| self.wrong(format!("{key} is missing")))
    }

    pub fn text(&self) -> Result<&'a str> {
        match &self.node.value {
            Value::Text(text) => Ok(text.trim()),
            _ => Err(self.wrong("neither a number nor a text")),
        }
    }

    pub fn real(&self) -> Result<f64> {
        let text = self.text()?;
        real(text).ok_or_else(|| self.wrong(format!("'{}' is not a finite number", shown(text))))
    }

    /// A whole number, such as a size.
    pub fn count(&self) -> Result<u32> {
        let text = self.text()?;
        text.parse().map_err(|_| self.wrong(format!("'{}' is not a whole number", shown(text))))
    }

    /// The items of a list.
    pub fn items(&self) -> Result<Vec<Self>> {
        let Value::List(list) = &self.node.value else { return Err(self.wrong("not a list")) };
        Ok(list.iter().enumerate().map(|(i, node)| self.below(&i.to_string(), node)).collect())
    }

    /// The numbers of a list, or of a text that white space parts.
    pub fn reals(&self) -> Result<Vec<f64>> {
        if let Value::Text(text) = &self.node.value {
            let number =
                |word| real(word).ok_or_else(|| self.wrong(format!("'{}' is not a finite number", shown(word))));
            return text.split_whitespace().map(number).collect();
        }
        self.items()?.iter().map(Self::real).collect()
    }

    /// Exactly so many numbers.
    pub fn numbers<const N: usize>(&self) -> Result<[f64; N]> {
        let values = self.reals()?;
        values.try_into().map_err(|v: Vec<f64>| self.wrong(format!("{} numbers, not {N}", v.len())))
    }

    pub fn is_map(&self) -> bool {
        matches!(self.node.value, Value::Map(_))
    }
}

/// A finite number.
pub(super) fn real(text: &str) -> Option<f64> {
    text.parse().ok().filter(|v: &f64| v.is_finite())
}

/// As much of a text as a message bears.
pub(super) fn shown(text: &str) -> String {
    const MOST: usize = 40;
    let mut start: String = text.chars().take(MOST).flat_map(char::escape_debug).collect();
    if text.chars().nth(MOST).is_some() {
        start.push_str("...");
    }
    start
}

#[cfg(test)]
mod tests;
