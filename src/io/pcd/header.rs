//! The header of a PCD file: fields, counts and how the points are stored.

use crate::error::Fault;
use crate::io::header::{Field as Line, Lines};
use crate::io::text::shown;

/// How points are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    Ascii,
    Binary,
    Compressed,
}

/// The type of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Scalar {
    fn new(kind: &str, size: usize) -> Option<Scalar> {
        Some(match (kind, size) {
            ("I", 1) => Scalar::I8,
            ("U", 1) => Scalar::U8,
            ("I", 2) => Scalar::I16,
            ("U", 2) => Scalar::U16,
            ("I", 4) => Scalar::I32,
            ("U", 4) => Scalar::U32,
            ("I", 8) => Scalar::I64,
            ("U", 8) => Scalar::U64,
            ("F", 4) => Scalar::F32,
            ("F", 8) => Scalar::F64,
            _ => return None,
        })
    }

    /// Bytes of a value.
    pub fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::I64 | Scalar::U64 | Scalar::F64 => 8,
        }
    }
}

/// A column: `count` numbers of each point.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    pub name: String,
    pub scalar: Scalar,
    pub count: usize,
}

impl Field {
    /// Bytes of it in a point.
    pub fn bytes(&self) -> usize {
        self.scalar.size() * self.count
    }

    /// Whether it is there only to fill up rows.
    pub fn is_padding(&self) -> bool {
        self.name == "_"
    }
}

/// What the header says.
#[derive(Debug, Clone)]
pub struct Header {
    pub fields: Vec<Field>,
    /// The line of `FIELDS`.
    pub fields_line: u64,
    pub points: u64,
    /// Whether the sensor stood elsewhere than at the origin, or was turned.
    pub is_moved: bool,
    pub encoding: Encoding,
    /// Where the values begin.
    pub data: usize,
    /// Lines up to and with `DATA`.
    pub lines: u64,
}

/// The most fields, and the most numbers of a field: so that their bytes can be added up.
const MOST: usize = 1 << 16;

impl Header {
    /// Reads the lines up to `DATA`.
    pub fn parse(bytes: &[u8]) -> Result<Header, Fault> {
        let mut lines = Lines::new(bytes);
        let mut found = Found::default();
        loop {
            let Some((number, text)) = lines.next() else {
                let problem = "the file ends within the header, before DATA";
                return Err(Fault::line(lines.number() + 1, problem));
            };
            let text = text.trim();
            if text.is_empty() || text.starts_with('#') {
                continue;
            }
            let (name, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
            let line = Line {
                name: name.to_owned(),
                text: rest.trim().to_owned(),
                line: number,
            };
            if found.take(line)? {
                return found.finish(lines.offset(), number);
            }
        }
    }
}

/// The lines of a header by what they say.
#[derive(Debug, Default)]
struct Found {
    fields: Option<Line>,
    sizes: Option<Line>,
    kinds: Option<Line>,
    counts: Option<Line>,
    width: Option<Line>,
    height: Option<Line>,
    viewpoint: Option<Line>,
    points: Option<Line>,
    data: Option<Line>,
}

impl Found {
    /// Takes a line; true for the last one.
    fn take(&mut self, line: Line) -> Result<bool, Fault> {
        let is_last = line.name == "DATA";
        let place = match line.name.as_str() {
            "VERSION" => return check_version(&line).map(|()| false),
            // Files before version 0.5 call them so.
            "FIELDS" | "COLUMNS" => &mut self.fields,
            "SIZE" => &mut self.sizes,
            "TYPE" => &mut self.kinds,
            "COUNT" => &mut self.counts,
            "WIDTH" => &mut self.width,
            "HEIGHT" => &mut self.height,
            "VIEWPOINT" => &mut self.viewpoint,
            "POINTS" => &mut self.points,
            "DATA" => &mut self.data,
            name => {
                let word = shown(name.as_bytes());
                let problem = format!("{word} is no keyword of a PCD header");
                return Err(Fault::line(line.line, problem));
            }
        };
        if place.is_some() {
            return Err(line.fault("stands in the header twice"));
        }
        *place = Some(line);
        Ok(is_last)
    }

    fn finish(self, data: usize, lines: u64) -> Result<Header, Fault> {
        let missing = |name: &str| Fault::line(lines, format!("the header has no {name}"));
        let fields = self.fields.as_ref().ok_or_else(|| missing("FIELDS"))?;
        let encoding = self.data.as_ref().ok_or_else(|| missing("DATA"))?;
        Ok(Header {
            fields_line: fields.line,
            points: self.count_points().map_err(|name| match name {
                Uncounted::Missing(name) => missing(name),
                Uncounted::Fault(fault) => fault,
            })?,
            is_moved: self.is_moved()?,
            encoding: match encoding.text.as_str() {
                "ascii" => Encoding::Ascii,
                "binary" => Encoding::Binary,
                "binary_compressed" => Encoding::Compressed,
                other => {
                    let problem = format!("{} is no encoding", shown(other.as_bytes()));
                    let hint = "ascii, binary and binary_compressed are";
                    return Err(encoding.fault(problem).with_hint(hint));
                }
            },
            fields: self.columns(fields)?,
            data,
            lines,
        })
    }

    fn columns(&self, line: &Line) -> Result<Vec<Field>, Fault> {
        let names: Vec<&str> = line.text.split_whitespace().collect();
        let count = names.len();
        if count > MOST {
            return Err(line.fault(format!("{count} fields, but at most {MOST} are read")));
        }
        // Without these lines every field is one number of single precision.
        let sizes = match &self.sizes {
            Some(line) => line.list::<usize>(count, "a size")?,
            None => vec![4; count],
        };
        let kinds = match &self.kinds {
            Some(line) => line.list::<char>(count, "a type")?,
            None => vec!['F'; count],
        };
        let counts = match &self.counts {
            Some(line) => line.list::<usize>(count, "a count")?,
            None => vec![1; count],
        };
        let fields = names.iter().zip(sizes).zip(kinds).zip(counts);
        let fields = fields.map(|(((name, size), kind), count)| {
            let kind = kind.to_string();
            let fault = |at: &Option<Line>, problem: String| {
                let name = shown(name.as_bytes());
                at.as_ref()
                    .unwrap_or(line)
                    .fault(format!("field {name} has {problem}"))
            };
            let Some(scalar) = Scalar::new(&kind, size) else {
                let problem = format!("type {kind} of {size} bytes, which is none");
                return Err(fault(&self.kinds, problem));
            };
            if !(1..=MOST).contains(&count) {
                let problem = format!("{count} numbers, not 1 to {MOST}");
                return Err(fault(&self.counts, problem));
            }
            Ok(Field {
                name: (*name).to_owned(),
                scalar,
                count,
            })
        });
        fields.collect()
    }

    /// The number of points, which may be stated twice.
    fn count_points(&self) -> Result<u64, Uncounted> {
        let whole = |line: &Line| {
            line.one::<u64>("a number of points")
                .map_err(Uncounted::Fault)
        };
        let stated = self.points.as_ref().map(whole).transpose()?;
        let Some(width) = &self.width else {
            return stated.ok_or(Uncounted::Missing("POINTS"));
        };
        let height = self.height.as_ref().map_or(Ok(1), whole)?;
        let across = whole(width)?;
        let product = across.checked_mul(height).ok_or_else(|| {
            Uncounted::Fault(width.fault(format!("{across} by {height} are too many points")))
        })?;
        match (&self.points, stated) {
            (Some(line), Some(stated)) if stated != product => {
                let problem =
                    format!("is {stated}, but WIDTH {across} by HEIGHT {height} are {product}");
                Err(Uncounted::Fault(line.fault(problem)))
            }
            _ => Ok(product),
        }
    }

    fn is_moved(&self) -> Result<bool, Fault> {
        match &self.viewpoint {
            Some(line) => {
                let values = line.list::<f64>(7, "a number")?;
                Ok(values != [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
            }
            None => Ok(false),
        }
    }
}

/// Why points are not counted.
enum Uncounted {
    Missing(&'static str),
    Fault(Fault),
}

fn check_version(line: &Line) -> Result<(), Fault> {
    let known = ["0.7", ".7", "0.6", ".6", "0.5", ".5"];
    if known.contains(&line.text.as_str()) {
        return Ok(());
    }
    let version = shown(line.text.as_bytes());
    Err(line.fault(format!("{version} is not known, only 0.5, 0.6 and 0.7")))
}

/// Whether bytes begin as a PCD file does: with its comment, or with a keyword after comments.
pub fn is_document(bytes: &[u8]) -> bool {
    if bytes.starts_with(b"# .PCD") {
        return true;
    }
    let start = &bytes[..bytes.len().min(1 << 12)];
    let mut lines = start
        .split(|b| *b == b'\n')
        .take(16)
        .map(<[u8]>::trim_ascii);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with(b"#"));
    let words = ["VERSION .", "VERSION 0.", "FIELDS ", "COLUMNS "];
    first.is_some_and(|line| words.iter().any(|word| line.starts_with(word.as_bytes())))
}
