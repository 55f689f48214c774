//! XML as files of data have it: elements, attributes and text, one after the other.
//!
//! Tags must match, attributes stand once, entities be those of XML itself or numbers. Comments and
//! processing instructions are passed over; a document type that declares anything is refused.
//! Nothing is expanded, so a document takes no more room than its bytes and its open elements.
//! Source: W3C, "Extensible Markup Language (XML) 1.0", fifth edition.

use super::header::excerpt;
use crate::error::Fault;
use std::borrow::Cow;

/// The start of an element.
#[derive(Debug, Clone)]
pub struct Element<'a> {
    /// Its name.
    pub name: &'a str,
    /// The line of its tag, from 1.
    pub line: u64,
    attributes: Vec<(&'a str, Cow<'a, str>)>,
}

impl Element<'_> {
    /// The value of an attribute.
    pub fn get(&self, name: &str) -> Option<&str> {
        let found = self.attributes.iter().find(|(known, _)| *known == name);
        found.map(|(_, value)| &**value)
    }

    /// The value of an attribute that must be there.
    pub fn need(&self, name: &str) -> Result<&str, Fault> {
        self.get(name)
            .ok_or_else(|| self.fault(format_args!("has no attribute {name}")))
    }

    /// The value of an attribute as `N` numbers; `None` where it is not there.
    pub fn numbers<T, const N: usize>(
        &self,
        name: &str,
        what: &str,
    ) -> Result<Option<[T; N]>, Fault>
    where
        T: std::str::FromStr,
    {
        let Some(text) = self.get(name) else {
            return Ok(None);
        };
        let number = |word: &str| {
            word.parse::<T>()
                .map_err(|_| self.fault(format_args!("{name}: {:?} is not {what}", excerpt(word))))
        };
        let numbers: Vec<T> = text
            .split_whitespace()
            .map(number)
            .collect::<Result<_, _>>()?;
        let count = numbers.len();
        let numbers = numbers
            .try_into()
            .map_err(|_| self.fault(format_args!("{name}: {count} values, but {N} are needed")));
        numbers.map(Some)
    }

    /// A fault at the line of the tag: the name, then the problem.
    pub fn fault(&self, problem: impl std::fmt::Display) -> Fault {
        Fault::line(self.line, format!("<{}> {problem}", self.name))
    }
}

/// What comes next.
enum Event<'a> {
    Start(Element<'a>),
    Text(&'a [u8]),
    End,
}

/// Goes through a document from its first byte on.
#[derive(Debug, Clone)]
pub struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    /// The line of `at`, from 1.
    line: u64,
    /// The elements that are open, with the lines of their tags.
    open: Vec<(&'a str, u64)>,
    /// Whether the tag read last ends its element too.
    closes: bool,
    has_root: bool,
}

impl<'a> Reader<'a> {
    /// A reader before the first byte.
    pub fn new(bytes: &'a [u8]) -> Self {
        let mark = b"\xef\xbb\xbf";
        Reader {
            bytes: bytes.strip_prefix(mark).unwrap_or(bytes),
            at: 0,
            line: 1,
            open: Vec::new(),
            closes: false,
            has_root: false,
        }
    }

    /// The next child of the element that is open; `None` when that ends, or the document.
    pub fn child(&mut self) -> Result<Option<Element<'a>>, Fault> {
        loop {
            match self.next()? {
                Some(Event::Start(element)) => return Ok(Some(element)),
                Some(Event::Text(_)) => {}
                Some(Event::End) | None => return Ok(None),
            }
        }
    }

    /// Goes behind the end of the element that is open.
    pub fn skip(&mut self) -> Result<(), Fault> {
        let depth = self.open.len();
        while self.open.len() >= depth && self.next()?.is_some() {}
        Ok(())
    }

    /// The text of the element that is open, without that of its children, as it stands; goes behind
    /// its end. Parts that are blank are left out.
    pub fn text(&mut self) -> Result<Cow<'a, [u8]>, Fault> {
        let mut text = Cow::Borrowed(&[][..]);
        loop {
            match self.next()? {
                Some(Event::Text(part)) if part.trim_ascii().is_empty() => {}
                Some(Event::Text(part)) if text.is_empty() => text = part.into(),
                Some(Event::Text(part)) => text.to_mut().extend_from_slice(part),
                Some(Event::Start(_)) => self.skip()?,
                Some(Event::End) | None => return Ok(text),
            }
        }
    }

    /// All bytes from here on, which need be no XML.
    pub fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// The next event; `None` at the end of the document.
    fn next(&mut self) -> Result<Option<Event<'a>>, Fault> {
        if std::mem::take(&mut self.closes) {
            self.open.pop();
            return Ok(Some(Event::End));
        }
        loop {
            let rest = self.rest();
            if rest.is_empty() {
                return match self.open.last() {
                    Some((name, line)) => Err(Fault::line(
                        self.line,
                        format!("the file ends within <{name}> of line {line}"),
                    )),
                    None => Ok(None),
                };
            }
            if rest[0] != b'<' {
                let end = rest.iter().position(|b| *b == b'<').unwrap_or(rest.len());
                return self.text_part(end, 0..end).map(Some);
            }
            if rest.starts_with(b"<![CDATA[") {
                let end = self.find(9, b"]]>", "a CDATA section")?;
                return self.text_part(end + 3, 9..end).map(Some);
            }
            if rest.starts_with(b"<!--") {
                let end = self.find(4, b"-->", "a comment")?;
                self.advance(end + 3);
            } else if rest.starts_with(b"<?") {
                let end = self.find(2, b"?>", "a processing instruction")?;
                self.advance(end + 2);
            } else if rest.starts_with(b"<!") {
                let end = self.find(2, b">", "a document type")?;
                if rest[..end].contains(&b'[') {
                    let problem = "a document type with declarations of its own is not read";
                    return Err(Fault::line(self.line, problem));
                }
                self.advance(end + 1);
            } else if rest.starts_with(b"</") {
                return self.end_tag().map(Some);
            } else {
                return self.start_tag().map(Some);
            }
        }
    }

    /// Goes on by `count` bytes.
    fn advance(&mut self, count: usize) {
        self.line = self.line_after(count);
        self.at += count;
    }

    /// The line `count` bytes further on.
    fn line_after(&self, count: usize) -> u64 {
        let passed = &self.bytes[self.at..self.at + count];
        self.line + passed.iter().filter(|b| **b == b'\n').count() as u64
    }

    /// Where `end` is, looked for from `from` bytes on from here.
    fn find(&self, from: usize, end: &[u8], what: &str) -> Result<usize, Fault> {
        let rest = self.rest();
        let place = rest[from..].windows(end.len()).position(|w| w == end);
        place
            .map(|at| from + at)
            .ok_or_else(|| Fault::line(self.line, format!("{what} has no end")))
    }

    /// Text in this range from here, after which to go on by `count` bytes.
    fn text_part(
        &mut self,
        count: usize,
        range: std::ops::Range<usize>,
    ) -> Result<Event<'a>, Fault> {
        let text = &self.rest()[range];
        if self.open.is_empty() && !text.trim_ascii().is_empty() {
            let problem = if self.has_root {
                "text after the last element"
            } else {
                "text before the first element"
            };
            return Err(Fault::line(self.line, problem));
        }
        self.advance(count);
        Ok(Event::Text(text))
    }

    /// `</name>`.
    fn end_tag(&mut self) -> Result<Event<'a>, Fault> {
        let end = self.find(2, b">", "an end tag")?;
        let name = self.rest()[2..end].trim_ascii_end();
        match self.open.pop() {
            Some((open, _)) if open.as_bytes() == name => {}
            Some((open, line)) => {
                let problem = format!(
                    "</{}> where <{open}> of line {line} is open",
                    excerpt(&String::from_utf8_lossy(name))
                );
                return Err(Fault::line(self.line, problem));
            }
            None => return Err(Fault::line(self.line, "an end tag where nothing is open")),
        }
        self.advance(end + 1);
        Ok(Event::End)
    }

    /// `<name attribute="value" ...>`.
    fn start_tag(&mut self) -> Result<Event<'a>, Fault> {
        let line = self.line;
        if self.open.is_empty() && self.has_root {
            return Err(Fault::line(line, "a second root element"));
        }
        let mut tag = Tag {
            bytes: self.rest(),
            at: 1,
            line,
        };
        let name = tag.name()?;
        let mut attributes: Vec<(&str, Cow<str>)> = Vec::new();
        loop {
            let has_blank = tag.skip_blanks();
            match tag.bytes.get(tag.at) {
                Some(b'>') => {
                    tag.at += 1;
                    break;
                }
                Some(b'/') if tag.bytes.get(tag.at + 1) == Some(&b'>') => {
                    tag.at += 2;
                    self.closes = true;
                    break;
                }
                None => return Err(tag.fault(format_args!("the tag <{name} is cut short"))),
                Some(_) if !has_blank => {
                    return Err(tag.fault("no blank before the name of an attribute"));
                }
                Some(_) => {}
            }
            let (key, value) = tag.attribute()?;
            if attributes.iter().any(|(known, _)| *known == key) {
                return Err(tag.fault(format_args!("the attribute {key} stands twice")));
            }
            attributes.push((key, value));
        }
        self.advance(tag.at);
        self.open.push((name, line));
        self.has_root = true;
        Ok(Event::Start(Element {
            name,
            line,
            attributes,
        }))
    }
}

/// A start tag that is being read.
struct Tag<'a> {
    bytes: &'a [u8],
    at: usize,
    /// The line of its first byte.
    line: u64,
}

impl<'a> Tag<'a> {
    fn fault(&self, problem: impl std::fmt::Display) -> Fault {
        let passed = &self.bytes[..self.at.min(self.bytes.len())];
        let lines = passed.iter().filter(|b| **b == b'\n').count();
        Fault::line(self.line + lines as u64, problem.to_string())
    }

    /// Whether there was a blank.
    fn skip_blanks(&mut self) -> bool {
        let rest = &self.bytes[self.at..];
        let blanks = rest.len() - rest.trim_ascii_start().len();
        self.at += blanks;
        blanks > 0
    }

    fn name(&mut self) -> Result<&'a str, Fault> {
        let rest = &self.bytes[self.at..];
        let is_end = |b: &u8| b.is_ascii_whitespace() || b"/>=<\"'&".contains(b);
        let end = rest.iter().position(is_end).unwrap_or(rest.len());
        match std::str::from_utf8(&rest[..end]) {
            Ok(name) if !name.is_empty() => {
                self.at += end;
                Ok(name)
            }
            Ok(_) => Err(self.fault("a name is missing")),
            Err(_) => Err(self.fault("a name is not UTF-8")),
        }
    }

    fn attribute(&mut self) -> Result<(&'a str, Cow<'a, str>), Fault> {
        let key = self.name()?;
        self.skip_blanks();
        if self.bytes.get(self.at) != Some(&b'=') {
            return Err(self.fault(format_args!("the attribute {key} has no value")));
        }
        self.at += 1;
        self.skip_blanks();
        let Some(quote @ (b'"' | b'\'')) = self.bytes.get(self.at) else {
            return Err(self.fault(format_args!("the value of {key} has no quotes")));
        };
        let rest = &self.bytes[self.at + 1..];
        let end = rest.iter().position(|b| b == quote || *b == b'<');
        let Some(end) = end.filter(|end| rest[*end] == *quote) else {
            return Err(self.fault(format_args!("the value of {key} has no end")));
        };
        let value = self.unescaped(&rest[..end])?;
        self.at += end + 2;
        Ok((key, value))
    }

    /// A value with each entity as what it stands for.
    fn unescaped(&self, value: &'a [u8]) -> Result<Cow<'a, str>, Fault> {
        let text = std::str::from_utf8(value).map_err(|_| self.fault("a value is not UTF-8"))?;
        if !text.contains('&') {
            return Ok(text.into());
        }
        let mut plain = String::with_capacity(text.len());
        let mut parts = text.split('&');
        plain.push_str(parts.next().unwrap_or_default());
        for part in parts {
            let (entity, after) = part.split_once(';').unwrap_or((part, ""));
            let Some(character) = character(entity) else {
                return Err(self.fault(format_args!("&{}; stands for nothing", excerpt(entity))));
            };
            plain.push(character);
            plain.push_str(after);
        }
        Ok(plain.into())
    }
}

/// The character that an entity stands for.
fn character(entity: &str) -> Option<char> {
    let number = |digits: &str, base| char::from_u32(u32::from_str_radix(digits, base).ok()?);
    match entity {
        "lt" => Some('<'),
        "gt" => Some('>'),
        "amp" => Some('&'),
        "apos" => Some('\''),
        "quot" => Some('"'),
        _ => match entity.strip_prefix("#x") {
            Some(digits) => number(digits, 16),
            None => number(entity.strip_prefix('#')?, 10),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Goes through a document: `name(attribute=value)` and text, ends as `.`.
    fn outline(text: &str) -> Result<String, String> {
        let mut reader = Reader::new(text.as_bytes());
        let mut outline = String::new();
        while let Some(event) = reader.next().map_err(|fault| fault.to_string())? {
            match event {
                Event::Start(element) => {
                    outline += &format!("{}@{}", element.name, element.line);
                    for (key, value) in &element.attributes {
                        outline += &format!("({key}={value})");
                    }
                }
                Event::Text(text) => outline += &String::from_utf8_lossy(text.trim_ascii()),
                Event::End => outline += ".",
            }
        }
        Ok(outline)
    }

    #[test]
    fn elements_attributes_and_text_come_in_order() {
        let text = "\u{feff}<?xml version=\"1.0\"?>\n<!DOCTYPE a>\n<a b = \"1\"\n c='&lt;&#65;&#x42;\"'>\
                    \nx<!-- <no> -->y<![CDATA[<z>]]>\n<d/><e></e ></a>\n<!-- end -->\n";
        assert_eq!(outline(text).unwrap(), "a@3(b=1)(c=<AB\")xy<z>d@6.e@6..");
    }

    #[test]
    fn children_text_and_rest_are_taken_apart() {
        let text = b"<a> <b k='1 2'>1<c>no</c>2 </b><d><e/></d><f/>_\x00\xff<";
        let mut reader = Reader::new(text);
        assert_eq!(reader.child().unwrap().unwrap().name, "a");
        let b = reader.child().unwrap().unwrap();
        assert_eq!(b.numbers("k", "a number"), Ok(Some([1, 2])));
        assert_eq!(b.numbers::<u8, 3>("l", "a number"), Ok(None));
        assert_eq!(
            b.numbers::<u8, 3>("k", "a number").unwrap_err().to_string(),
            "1: <b> k: 2 values, but 3 are needed"
        );
        assert_eq!(reader.text().unwrap(), &b"12 "[..]);
        assert_eq!(reader.child().unwrap().unwrap().name, "d");
        reader.skip().unwrap();
        assert_eq!(reader.child().unwrap().unwrap().name, "f");
        reader.skip().unwrap();
        assert_eq!(reader.rest(), b"_\x00\xff<");
    }

    #[test]
    fn what_is_no_xml_is_named_with_its_line() {
        for (text, wanted) in [
            ("<a>\n<b>\n</a>", "3: </a> where <b> of line 2 is open"),
            ("<a>\n<b/>\n", "3: the file ends within <a> of line 1"),
            (
                "<a>\n<b c=\"1\" c=\"2\"/></a>",
                "2: the attribute c stands twice",
            ),
            ("<a\nb=1>", "2: the value of b has no quotes"),
            ("<a\nb>", "2: the attribute b has no value"),
            ("<a b=\"1>\n</a>", "1: the value of b has no end"),
            (
                "<a b=\"1\"c=\"2\"/>",
                "1: no blank before the name of an attribute",
            ),
            ("<a b=\"&c;\"/>", "1: &c; stands for nothing"),
            ("<a b=\"&#xd800;\"/>", "1: &#xd800; stands for nothing"),
            ("<a b=\"1\"", "1: the tag <a is cut short"),
            ("<a/>\n<b/>", "2: a second root element"),
            ("\na", "1: text before the first element"),
            ("<a/>\nb", "1: text after the last element"),
            ("<a>\n< b/></a>", "2: a name is missing"),
            ("<a/></a>", "1: an end tag where nothing is open"),
            ("<!-- a", "1: a comment has no end"),
            ("<a><![CDATA[</a>", "1: a CDATA section has no end"),
            (
                "<!DOCTYPE a [<!ENTITY b \"c\">]><a/>",
                "1: a document type with declarations of its own is not read",
            ),
        ] {
            assert_eq!(outline(text).unwrap_err(), wanted, "{text}");
        }
    }

    proptest! {
        #[test]
        fn any_text_is_read_or_refused(text in "[<>/a=\"'&;!?\\-\\[\\] \n]{0,40}") {
            let _ = outline(&text);
        }
    }
}
