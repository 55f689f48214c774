//! Well-known text of coordinate reference systems, of versions 1 and 2, as a tree.

use crate::error::Fault;

/// Deeper nesting than any definition has.
const DEEPEST: usize = 64;

/// `KEYWORD[...]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// In capitals.
    pub keyword: String,
    /// What stands within, in order.
    pub parts: Vec<Part>,
}

/// One of the things within brackets.
#[derive(Debug, Clone, PartialEq)]
pub enum Part {
    /// In quotes.
    Text(String),
    /// A number.
    Number(f64),
    /// A word without quotes: the direction of an axis.
    Word,
    /// Another with brackets of its own.
    Node(Node),
}

impl Node {
    /// The text that stands first.
    pub fn name(&self) -> Option<&str> {
        match self.parts.first() {
            Some(Part::Text(name)) => Some(name),
            _ => None,
        }
    }

    /// The nodes right within.
    pub fn children(&self) -> impl Iterator<Item = &Node> {
        self.parts.iter().filter_map(|part| match part {
            Part::Node(node) => Some(node),
            _ => None,
        })
    }

    /// The first child of one of these keywords.
    pub fn child(&self, keywords: &[&str]) -> Option<&Node> {
        self.children()
            .find(|node| keywords.contains(&node.keyword.as_str()))
    }

    /// Its numbers, in order.
    pub fn numbers(&self) -> impl Iterator<Item = f64> {
        self.parts.iter().filter_map(|part| match part {
            Part::Number(value) => Some(*value),
            _ => None,
        })
    }

    /// The part on the ground of a compound or bound system; else the system itself.
    pub fn horizontal(&self) -> &Node {
        const SYSTEMS: [&str; 12] = [
            "PROJCS",
            "PROJCRS",
            "PROJECTEDCRS",
            "GEOGCS",
            "GEOGCRS",
            "GEOGRAPHICCRS",
            "GEODCRS",
            "GEODETICCRS",
            "COMPD_CS",
            "COMPOUNDCRS",
            "BOUNDCRS",
            "SOURCECRS",
        ];
        match self.keyword.as_str() {
            "COMPD_CS" | "COMPOUNDCRS" | "BOUNDCRS" | "SOURCECRS" => {
                self.child(&SYSTEMS).map_or(self, Node::horizontal)
            }
            _ => self,
        }
    }

    /// Its own number in the EPSG registry: `AUTHORITY["EPSG","32733"]` or `ID["EPSG",32733]`.
    pub fn epsg(&self) -> Option<u32> {
        let authority = self.child(&["AUTHORITY", "ID"])?;
        if !authority.name()?.eq_ignore_ascii_case("EPSG") {
            return None;
        }
        match authority.parts.get(1)? {
            Part::Text(code) => code.parse().ok(),
            Part::Number(code) => Some(*code as u32),
            _ => None,
        }
    }
}

/// The first text in quotes, or all where there is none.
pub fn first_name(text: &str) -> &str {
    text.split('"').nth(1).unwrap_or(text)
}

/// Reads a definition. Errs where brackets or quotes do not end. Cost: linear.
pub fn parse(text: &str) -> Result<Node, Fault> {
    let mut parser = Parser { text, at: 0 };
    parser.node(0)
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Parser<'a> {
    fn peek(&mut self) -> Option<u8> {
        let bytes = self.text.as_bytes();
        while bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
        bytes.get(self.at).copied()
    }

    fn fault(&self, problem: &str) -> Fault {
        let at = self.at;
        Fault::whole(format!(
            "the WKT of its coordinate reference system {problem} at its byte {at}"
        ))
    }

    /// Up to the next mark of the syntax.
    fn word(&mut self) -> &'a str {
        self.peek();
        let rest = &self.text[self.at..];
        let end = rest.find(['[', ']', '(', ')', ',', '"']);
        let word = &rest[..end.unwrap_or(rest.len())];
        self.at += word.len();
        word.trim()
    }

    fn node(&mut self, depth: usize) -> Result<Node, Fault> {
        let keyword = self.word().to_ascii_uppercase();
        if keyword.is_empty() || !matches!(self.peek(), Some(b'[' | b'(')) {
            return Err(self.fault("has no keyword with brackets"));
        }
        self.within(keyword, depth)
    }

    /// The rest of a node whose bracket comes next.
    fn within(&mut self, keyword: String, depth: usize) -> Result<Node, Fault> {
        if depth > DEEPEST {
            return Err(self.fault("is nested too deep"));
        }
        self.at += 1;
        let mut parts = Vec::new();
        loop {
            match self.peek() {
                Some(b']' | b')') => {
                    self.at += 1;
                    return Ok(Node { keyword, parts });
                }
                Some(b',') => self.at += 1,
                Some(b'"') => parts.push(Part::Text(self.quoted()?)),
                Some(_) => parts.push(self.part(depth)?),
                None => return Err(self.fault("ends within brackets")),
            }
        }
    }

    fn part(&mut self, depth: usize) -> Result<Part, Fault> {
        let word = self.word();
        match self.peek() {
            Some(b'[' | b'(') => {
                let keyword = word.to_ascii_uppercase();
                self.within(keyword, depth + 1).map(Part::Node)
            }
            _ if word.is_empty() => Err(self.fault("has quotes where none can be")),
            _ => Ok(word.parse().map_or(Part::Word, Part::Number)),
        }
    }

    fn quoted(&mut self) -> Result<String, Fault> {
        self.at += 1;
        let rest = &self.text[self.at..];
        let end = rest
            .find('"')
            .ok_or_else(|| self.fault("has quotes that do not end"))?;
        self.at += end + 1;
        Ok(rest[..end].to_owned())
    }
}
