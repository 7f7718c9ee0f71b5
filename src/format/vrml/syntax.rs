//! The syntax of VRML97, whatever its nodes are called: nodes have fields, a field has numbers, words,
//! texts or nodes.

use std::collections::BTreeMap;
use std::rc::Rc;

/// Nodes inside each other.
const MAX_DEPTH: usize = 64;

#[derive(Debug, Default)]
pub struct Node {
    pub kind: String,
    pub fields: BTreeMap<String, Field>,
    /// Nodes below each other from here on, those that USE brings included.
    height: usize,
}

/// What follows a field's name: numbers, or nodes, or words and texts, which are passed over.
#[derive(Debug, Default)]
pub struct Field {
    pub numbers: Vec<f64>,
    /// TRUE, FALSE; NULL; texts.
    pub words: Vec<String>,
    pub nodes: Vec<Rc<Node>>,
}

impl Node {
    pub fn field(&self, name: &str) -> Option<&Field> {
        self.fields.get(name)
    }

    pub fn numbers(&self, name: &str) -> &[f64] {
        self.field(name).map_or(&[], |f| &f.numbers)
    }

    /// The one node of a field.
    pub fn node(&self, name: &str) -> Option<&Rc<Node>> {
        self.field(name)?.nodes.first()
    }

    pub fn is(&self, name: &str, word: &str) -> bool {
        self.field(name).is_some_and(|f| f.words.first().is_some_and(|w| w == word))
    }
}

#[derive(Debug, Clone, PartialEq)]
enum Token<'a> {
    /// { } [ ]
    Mark(u8),
    Number(f64),
    Word(&'a str),
    Text,
}

pub struct Parser<'a> {
    text: &'a str,
    at: usize,
    line: usize,
    named: BTreeMap<String, Rc<Node>>,
}

type Parsed<T> = Result<T, String>;

impl<'a> Parser<'a> {
    pub fn new(text: &'a str) -> Self {
        Self { text, at: 0, line: 1, named: BTreeMap::new() }
    }

    /// All nodes of the file.
    pub fn nodes(&mut self) -> Parsed<Vec<Rc<Node>>> {
        let mut nodes = Vec::new();
        loop {
            match self.peek()? {
                None => return Ok(nodes),
                Some(Token::Word("ROUTE")) => {
                    // ROUTE a.b TO c.d
                    for _ in 0..4 {
                        self.next()?;
                    }
                }
                Some(_) => nodes.push(self.node(0)?),
            }
        }
    }

    fn wrong<T>(&self, what: impl std::fmt::Display) -> Parsed<T> {
        Err(format!("line {}: {what}", self.line))
    }

    fn skip_space(&mut self) {
        let bytes = self.text.as_bytes();
        while let Some(b) = bytes.get(self.at) {
            match b {
                b'\n' => self.line += 1,
                b'#' => {
                    while bytes.get(self.at).is_some_and(|b| *b != b'\n') {
                        self.at += 1;
                    }
                    continue;
                }
                b' ' | b'\t' | b'\r' | b',' => {}
                _ => break,
            }
            self.at += 1;
        }
    }

    fn peek(&mut self) -> Parsed<Option<Token<'a>>> {
        let (at, line) = (self.at, self.line);
        let token = self.next();
        (self.at, self.line) = (at, line);
        token
    }

    fn next(&mut self) -> Parsed<Option<Token<'a>>> {
        self.skip_space();
        let rest = &self.text.as_bytes()[self.at..];
        let Some(first) = rest.first() else { return Ok(None) };
        if b"{}[]".contains(first) {
            self.at += 1;
            return Ok(Some(Token::Mark(*first)));
        }
        if *first == b'"' {
            let mut escaped = false;
            let end = rest.iter().skip(1).position(|b| {
                let end = *b == b'"' && !escaped;
                escaped = *b == b'\\' && !escaped;
                end
            });
            let Some(end) = end else { return self.wrong("a text does not end") };
            self.line += rest[..end].iter().filter(|b| **b == b'\n').count();
            self.at += end + 2;
            return Ok(Some(Token::Text));
        }
        let end = rest.iter().position(|b| b" \t\r\n,{}[]#\"".contains(b)).unwrap_or(rest.len());
        // The end is an ASCII byte, and so between two characters.
        let Some(word) = self.text.get(self.at..self.at + end) else { return self.wrong("not text") };
        self.at += end;
        let starts_number = matches!(first, b'0'..=b'9' | b'-' | b'+' | b'.');
        if !starts_number {
            return Ok(Some(Token::Word(word)));
        }
        let number = match word.strip_prefix("0x").or_else(|| word.strip_prefix("0X")) {
            Some(hex) => u32::from_str_radix(hex, 16).ok().map(f64::from),
            None => word.parse::<f64>().ok().filter(|v| v.is_finite()),
        };
        match number {
            Some(number) => Ok(Some(Token::Number(number))),
            None => self.wrong(format!("'{}' is no number", word.escape_debug())),
        }
    }

    fn expect(&mut self) -> Parsed<Token<'a>> {
        match self.next()? {
            Some(token) => Ok(token),
            None => self.wrong("the file ends too early"),
        }
    }

    /// A node, from its name, DEF or USE on.
    fn node(&mut self, depth: usize) -> Parsed<Rc<Node>> {
        match self.expect()? {
            Token::Word(word) => self.node_called(word, depth),
            other => self.wrong(format!("{other:?} where a node should be")),
        }
    }

    fn node_called(&mut self, word: &str, depth: usize) -> Parsed<Rc<Node>> {
        if depth > MAX_DEPTH {
            return self.wrong(format!("more than {MAX_DEPTH} nodes inside each other"));
        }
        let name = |token| if let Token::Word(name) = token { Some(name) } else { None };
        match word {
            "DEF" => {
                let Some(name) = name(self.expect()?) else { return self.wrong("DEF without a name") };
                let node = self.node(depth + 1)?;
                self.named.insert(name.into(), node.clone());
                Ok(node)
            }
            "USE" => {
                let Some(name) = name(self.expect()?) else { return self.wrong("USE without a name") };
                match self.named.get(name) {
                    Some(node) => Ok(node.clone()),
                    None => self.wrong(format!("USE of {name}, which is not defined")),
                }
            }
            "PROTO" | "EXTERNPROTO" => self.wrong("prototypes are not read"),
            kind => {
                if self.expect()? != Token::Mark(b'{') {
                    return self.wrong(format!("{kind} without {{"));
                }
                let mut node = Node { kind: kind.into(), ..Node::default() };
                loop {
                    match self.expect()? {
                        Token::Mark(b'}') => break,
                        Token::Word(field) => {
                            let value = self.field(depth)?;
                            node.fields.insert(field.into(), value);
                        }
                        other => return self.wrong(format!("{other:?} where a field should be")),
                    }
                }
                let below = node.fields.values().flat_map(|f| &f.nodes).map(|n| n.height).max();
                node.height = 1 + below.unwrap_or(0);
                if node.height > MAX_DEPTH {
                    return self.wrong(format!("more than {MAX_DEPTH} nodes inside each other"));
                }
                Ok(Rc::new(node))
            }
        }
    }

    fn field(&mut self, depth: usize) -> Parsed<Field> {
        let mut field = Field::default();
        match self.expect()? {
            Token::Mark(b'[') => loop {
                match self.expect()? {
                    Token::Mark(b']') => break,
                    token => self.value(token, &mut field, depth)?,
                }
            },
            first => {
                let number = matches!(first, Token::Number(_));
                self.value(first, &mut field, depth)?;
                while number && matches!(self.peek()?, Some(Token::Number(_))) {
                    let token = self.expect()?;
                    self.value(token, &mut field, depth)?;
                }
            }
        }
        // Lists of a million numbers are grown by doubling.
        field.numbers.shrink_to_fit();
        Ok(field)
    }

    fn value(&mut self, token: Token<'a>, field: &mut Field, depth: usize) -> Parsed<()> {
        match token {
            Token::Number(v) => field.numbers.push(v),
            Token::Text => field.words.push(String::new()),
            Token::Word(word @ ("TRUE" | "FALSE" | "NULL")) => field.words.push(word.into()),
            Token::Word(word) => {
                let node = self.node_called(word, depth + 1)?;
                field.nodes.push(node);
            }
            Token::Mark(mark) => return self.wrong(format!("'{}' where a value should be", mark as char)),
        }
        Ok(())
    }
}
