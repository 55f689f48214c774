//! Rows of values, from text and from bytes.

use super::header::{Element, Scalar, Shape};
use crate::error::{At, Fault};
use crate::io::text::{Lines, Words, line_end, number, shown, words};
use crate::report::{Tally, Warning};

/// The element whose rows are read, as far as faults speak of it.
#[derive(Debug, Clone, Default)]
struct Table {
    /// What one row is called.
    kind: &'static str,
    plural: String,
    count: u64,
    /// The row at hand.
    index: u64,
}

impl Table {
    fn new(element: &Element) -> Self {
        Table {
            kind: match element.name.as_str() {
                "vertex" => "vertex",
                "face" => "face",
                "tristrips" => "strip",
                "edge" => "edge",
                "point" => "point",
                _ => "row",
            },
            plural: element.plural(),
            count: element.count,
            index: 0,
        }
    }

    fn ends_after(&self, read: u64) -> String {
        let Table { count, plural, .. } = self;
        format!("the file ends after {read} of {count} {plural}")
    }
}

/// Something that gives the values of rows, one after the other.
pub trait Rows {
    /// Begins the rows of an element.
    fn begin(&mut self, element: &Element);
    /// Begins a row.
    fn start(&mut self, index: u64) -> Result<(), Fault>;
    /// The next value of the row.
    fn scalar(&mut self, scalar: Scalar) -> Result<f64, Fault>;
    /// Steps over values.
    fn skip(&mut self, scalar: Scalar, count: u64) -> Result<(), Fault>;
    /// Ends a row.
    fn end(&mut self);
    /// A fault of this row: the problem goes on from its name, as in `has no corners`.
    fn fault(&self, problem: String) -> Fault;
    /// At most how many rows of this element can still come, so that room is made for no more.
    fn most(&self, element: &Element) -> usize;

    /// The next value, as the length of a list.
    #[inline]
    fn count(&mut self, scalar: Scalar) -> Result<u64, Fault> {
        let value = self.scalar(scalar)?;
        if value >= 0.0 && value.fract() == 0.0 && value <= f64::from(u32::MAX) {
            Ok(value as u64)
        } else {
            Err(self.fault(format!("has a list of length {value}")))
        }
    }

    /// The next value, as the index of one of `vertices` vertices.
    #[inline]
    fn index(&mut self, scalar: Scalar, vertices: u64) -> Result<u32, Fault> {
        let value = self.scalar(scalar)?;
        self.vertex(value, vertices)
    }

    /// A value as the index of one of `vertices` vertices, which are no more than 32 bits count.
    #[inline]
    fn vertex(&self, value: f64, vertices: u64) -> Result<u32, Fault> {
        if value >= 0.0 && value.fract() == 0.0 && value < vertices as f64 {
            Ok(value as u32)
        } else {
            Err(self.fault(format!(
                "refers to vertex {value}, but there are {vertices}"
            )))
        }
    }
}

/// Steps over one property of a row.
#[inline]
pub fn skip_property(shape: Shape, rows: &mut impl Rows) -> Result<(), Fault> {
    match shape {
        Shape::Scalar(scalar) => rows.skip(scalar, 1),
        Shape::List { count, item } => {
            let count = rows.count(count)?;
            rows.skip(item, count)
        }
    }
}

/// Steps over all rows of an element.
pub fn skip(element: &Element, rows: &mut impl Rows) -> Result<(), Fault> {
    if element.properties.is_empty() {
        // Rows of nothing take no bytes, however many there are said to be.
        return Ok(());
    }
    rows.begin(element);
    for index in 0..element.count {
        rows.start(index)?;
        for property in &element.properties {
            skip_property(property.shape, rows)?;
        }
        rows.end();
    }
    Ok(())
}

/// Rows of text: each is a line.
pub struct Ascii<'a> {
    lines: Lines<'a>,
    words: Words<'a>,
    table: Table,
    extra: Tally,
}

impl<'a> Ascii<'a> {
    /// The rows of a text that follows `before` lines.
    pub fn new(text: &'a [u8], before: u64) -> Self {
        Ascii {
            lines: Lines::with_end(text, line_end(text), before),
            words: words(b""),
            table: Table::default(),
            extra: Tally::default(),
        }
    }

    /// Warns of what was left over.
    pub fn finish(mut self, warnings: &mut Vec<Warning>) {
        self.extra.warn(
            "extra-values",
            "a line has more values than its element has properties; not read",
            warnings,
        );
        let mut after = Tally::default();
        while let Some(line) = self.lines.next() {
            if words(line).next().is_some() {
                after.note(self.lines.number());
            }
        }
        after.warn(
            "trailing-lines",
            "lines follow the last element; not read",
            warnings,
        );
    }

    #[inline]
    fn word(&mut self) -> Result<&'a [u8], Fault> {
        self.words
            .next()
            .ok_or_else(|| self.fault("has fewer values than its element asks for".into()))
    }
}

impl Rows for Ascii<'_> {
    fn begin(&mut self, element: &Element) {
        self.table = Table::new(element);
    }

    #[inline]
    fn start(&mut self, index: u64) -> Result<(), Fault> {
        self.table.index = index;
        loop {
            let Some(line) = self.lines.next() else {
                let line = self.lines.number();
                return Err(Fault::line(line, self.table.ends_after(index)));
            };
            self.words = words(line);
            if self.words.clone().next().is_some() {
                return Ok(());
            }
        }
    }

    #[inline]
    fn scalar(&mut self, _: Scalar) -> Result<f64, Fault> {
        let word = self.word()?;
        number(word).ok_or_else(|| {
            let line = self.lines.number();
            Fault::line(line, format!("{} is not a number", shown(word)))
        })
    }

    #[inline]
    fn skip(&mut self, _: Scalar, count: u64) -> Result<(), Fault> {
        (0..count).try_for_each(|_| self.word().map(|_| ()))
    }

    #[inline]
    fn end(&mut self) {
        if self.words.next().is_some() {
            self.extra.note(self.lines.number());
        }
    }

    #[cold]
    fn fault(&self, problem: String) -> Fault {
        let kind = self.table.kind;
        Fault::line(self.lines.number(), format!("{kind} {problem}"))
    }

    fn most(&self, element: &Element) -> usize {
        // A digit and a blank for each value.
        self.lines.bytes_left() / (2 * element.properties.len().max(1)) + 1
    }
}

/// Rows of bytes, of either order.
pub struct Binary<'a, const BIG: bool> {
    bytes: &'a [u8],
    at: usize,
    table: Table,
}

impl<'a, const BIG: bool> Binary<'a, BIG> {
    /// The rows that begin at a byte of a file.
    pub fn new(bytes: &'a [u8], at: usize) -> Self {
        Binary {
            bytes,
            at,
            table: Table::default(),
        }
    }

    /// The bytes still to come.
    pub fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// Steps over bytes that are known to be there.
    pub fn advance(&mut self, length: usize) {
        self.at += length;
    }

    /// The bytes of all rows of an element, each `stride` long; a fault when they are not there.
    pub fn block(&mut self, element: &Element, stride: usize) -> Result<&'a [u8], Fault> {
        let whole = (self.rest().len() / stride) as u64;
        if whole < element.count {
            let problem = Table::new(element).ends_after(whole);
            return Err(Fault::byte(self.bytes.len(), problem));
        }
        let length = element.count as usize * stride;
        let block = &self.rest()[..length];
        self.at += length;
        Ok(block)
    }

    #[inline]
    fn take(&mut self, length: usize) -> Result<&'a [u8], Fault> {
        match self.rest().get(..length) {
            Some(bytes) => {
                self.at += length;
                Ok(bytes)
            }
            None => Err(self.truncated()),
        }
    }

    #[cold]
    fn truncated(&self) -> Fault {
        Fault::byte(self.bytes.len(), self.table.ends_after(self.table.index))
    }
}

impl<const BIG: bool> Rows for Binary<'_, BIG> {
    fn begin(&mut self, element: &Element) {
        self.table = Table::new(element);
    }

    #[inline]
    fn start(&mut self, index: u64) -> Result<(), Fault> {
        self.table.index = index;
        Ok(())
    }

    #[inline]
    fn scalar(&mut self, scalar: Scalar) -> Result<f64, Fault> {
        self.take(scalar.size())
            .map(|bytes| decode::<BIG>(scalar, bytes))
    }

    #[inline]
    fn skip(&mut self, scalar: Scalar, count: u64) -> Result<(), Fault> {
        let length = usize::try_from(count)
            .ok()
            .and_then(|count| count.checked_mul(scalar.size()))
            .ok_or_else(|| self.truncated())?;
        self.take(length).map(|_| ())
    }

    fn end(&mut self) {}

    #[cold]
    fn fault(&self, problem: String) -> Fault {
        let Table { kind, index, .. } = self.table;
        Fault::new(At::Element(kind, index), problem)
    }

    fn most(&self, element: &Element) -> usize {
        let least: usize = element
            .properties
            .iter()
            .map(|p| match p.shape {
                Shape::Scalar(scalar) => scalar.size(),
                Shape::List { count, .. } => count.size(),
            })
            .fold(0, usize::saturating_add);
        self.rest().len() / least.max(1) + 1
    }
}

/// The value at the start of some bytes, of which there are enough.
#[inline]
pub fn decode<const BIG: bool>(scalar: Scalar, bytes: &[u8]) -> f64 {
    macro_rules! value {
        ($type:ty) => {{
            let mut raw = [0; size_of::<$type>()];
            raw.copy_from_slice(&bytes[..size_of::<$type>()]);
            f64::from(if BIG {
                <$type>::from_be_bytes(raw)
            } else {
                <$type>::from_le_bytes(raw)
            })
        }};
    }
    match scalar {
        Scalar::I8 => value!(i8),
        Scalar::U8 => value!(u8),
        Scalar::I16 => value!(i16),
        Scalar::U16 => value!(u16),
        Scalar::I32 => value!(i32),
        Scalar::U32 => value!(u32),
        Scalar::F32 => value!(f32),
        Scalar::F64 => value!(f64),
    }
}
