//! What a VTK file in XML says of its image, before any of its samples are looked at.

use crate::error::Fault;
use crate::io::header::excerpt;
use crate::io::samples::{ByteOrder, SampleType};
use crate::io::xml::{Element, Reader};
use crate::numeric::vector::{Vec3, add, scale};
use crate::report::Warning;
use crate::volume::Frame;
use std::borrow::Cow;

/// Where on the image the samples of an array are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// At its points.
    Points,
    /// In its cells.
    Cells,
}

/// What `compressor` names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Packing {
    /// Nothing.
    None,
    /// zlib.
    Zlib,
    /// A name that is not known.
    Other(String),
}

/// The points of the image along an axis: the first and the last.
type Extent = [[i64; 2]; 3];

/// An array of samples.
#[derive(Debug)]
pub struct Array<'a> {
    /// Where its samples are.
    pub place: Place,
    /// What it holds inline.
    pub text: Cow<'a, [u8]>,
    element: Element<'a>,
}

/// The bytes of the appended arrays.
#[derive(Debug, Clone, Copy)]
pub enum Appended<'a> {
    /// As they are.
    Raw(&'a [u8]),
    /// As text.
    Base64(&'a [u8]),
}

/// An image of one piece.
#[derive(Debug)]
pub struct Image<'a> {
    /// The order of the bytes of numbers.
    pub order: ByteOrder,
    /// Bytes of the numbers before the data of an array.
    pub width: usize,
    /// How arrays are packed that are not text.
    pub packing: Packing,
    /// The appended arrays.
    pub appended: Option<Appended<'a>>,
    extent: Extent,
    origin: Vec3,
    axes: [Vec3; 3],
    arrays: Vec<Array<'a>>,
    /// The names of the arrays that points and cells say are their scalars.
    scalars: [Option<String>; 2],
    /// The line of the piece.
    line: u64,
}

/// Whether a text begins with an element `VTKFile`.
pub fn is_document(text: &[u8]) -> bool {
    let first = || Reader::new(text).child().ok().flatten();
    text.starts_with(b"<") && first().is_some_and(|element| element.name == "VTKFile")
}

impl<'a> Image<'a> {
    /// The image of a document. Its text is not looked at behind a raw appended part.
    pub fn parse(bytes: &'a [u8]) -> Result<Image<'a>, Fault> {
        let mut reader = Reader::new(bytes);
        let Some(file) = reader.child()? else {
            return Err(Fault::whole("holds no element"));
        };
        if file.name != "VTKFile" {
            return Err(file.fault("is the root, but VTKFile is needed"));
        }
        let kind = file.need("type")?;
        if kind != "ImageData" {
            let kind = excerpt(kind);
            return Err(file.fault(format_args!("holds {kind:?}, but ImageData is needed")));
        }
        let order = byte_order(&file)?;
        let width = header_width(&file)?;
        let mut found = None;
        let mut appended = None;
        while let Some(child) = reader.child()? {
            match child.name {
                "ImageData" if found.is_some() => {
                    return Err(child.fault("stands twice"));
                }
                "ImageData" => found = Some(image(&mut reader, &child)?),
                "AppendedData" => {
                    appended = Some(appended_data(&reader, &child)?);
                    break;
                }
                _ => reader.skip()?,
            }
        }
        let found = found.ok_or_else(|| file.fault("holds no ImageData"))?;
        Ok(Image {
            order,
            width,
            packing: packing(&file),
            appended,
            ..found
        })
    }

    /// The array that is the volume: the one that `Scalars` names, else the first of one component.
    /// Warns of the others.
    pub fn chosen(&self, warnings: &mut Vec<Warning>) -> Result<&Array<'a>, Fault> {
        let mut chosen = None;
        for (place, scalars) in [Place::Points, Place::Cells].into_iter().zip(&self.scalars) {
            let Some(name) = scalars.as_deref().filter(|name| !name.is_empty()) else {
                continue;
            };
            let of_name = |array: &&Array| array.place == place && array.name() == name;
            let array = self.arrays.iter().find(of_name).ok_or_else(|| {
                let name = excerpt(name);
                let problem = format!("Scalars is {name:?}, but there is no array of this name");
                Fault::line(self.line, problem)
            })?;
            chosen = chosen.or(Some(array));
        }
        let array = match chosen {
            Some(array) => array,
            None => {
                let is_one = |array: &&Array| array.components() == Ok(1);
                self.arrays.iter().find(is_one).ok_or_else(|| {
                    let count = self.arrays.len();
                    let problem = format!("none of its {count} arrays has one component");
                    Fault::line(self.line, problem)
                })?
            }
        };
        let components = array.components()?;
        if components != 1 {
            return Err(array.fault(format_args!("has {components} components, one is needed")));
        }
        let others = self.arrays.len() as u64 - 1;
        if others > 0 {
            let name = excerpt(array.name());
            let message = format!("arrays beside {name:?}; left out");
            warnings.push(Warning::new("vti-arrays", message, others, None));
        }
        Ok(array)
    }

    /// Samples along each axis.
    pub fn sizes(&self, place: Place) -> [u64; 3] {
        self.extent.map(|[first, last]| {
            let cells = last.abs_diff(first);
            match place {
                Place::Points => cells.saturating_add(1),
                Place::Cells => cells.max(1),
            }
        })
    }

    /// Where the samples are.
    pub fn frame(&self, place: Place, dims: [usize; 3]) -> Frame {
        let mut origin = self.origin;
        for (axis, [first, last]) in self.axes.into_iter().zip(self.extent) {
            if first != 0 {
                origin = add(origin, scale(axis, first as f64));
            }
            if place == Place::Cells && first < last {
                origin = add(origin, scale(axis, 0.5));
            }
        }
        Frame {
            dims,
            origin,
            axes: self.axes,
        }
    }
}

impl Array<'_> {
    /// Its name; empty where it has none.
    pub fn name(&self) -> &str {
        self.element.get("Name").unwrap_or_default()
    }

    /// A fault at the line of the array: its name, then the problem.
    pub fn fault(&self, problem: impl std::fmt::Display) -> Fault {
        let name = excerpt(self.name());
        Fault::line(self.element.line, format!("the array {name:?} {problem}"))
    }

    fn components(&self) -> Result<u64, Fault> {
        let found = self.element.numbers("NumberOfComponents", "a count")?;
        Ok(found.map_or(1, |[count]: [u64; 1]| count))
    }

    /// The type of its samples.
    pub fn sample_type(&self) -> Result<SampleType, Fault> {
        Ok(match self.element.need("type")? {
            "Int8" => SampleType::I8,
            "UInt8" => SampleType::U8,
            "Int16" => SampleType::I16,
            "UInt16" => SampleType::U16,
            "Int32" => SampleType::I32,
            "UInt32" => SampleType::U32,
            "Int64" => SampleType::I64,
            "UInt64" => SampleType::U64,
            "Float32" => SampleType::F32,
            "Float64" => SampleType::F64,
            other => {
                let other = excerpt(other);
                let problem = format_args!("has the type {other:?}, which is no number");
                return Err(self.fault(problem));
            }
        })
    }

    /// Whether its samples are written as text.
    pub fn is_text(&self) -> bool {
        self.format() == "ascii"
    }

    /// How it is stored: `ascii`, `binary`, `appended` or a word that is not known.
    pub fn format(&self) -> &str {
        self.element.get("format").unwrap_or("ascii")
    }

    /// Where in the appended data it begins.
    pub fn offset(&self) -> Result<usize, Fault> {
        let found = self.element.numbers("offset", "a number of bytes")?;
        let [offset] = found.ok_or_else(|| self.fault("has no offset"))?;
        Ok(offset)
    }
}

fn byte_order(file: &Element) -> Result<ByteOrder, Fault> {
    match file.get("byte_order") {
        None | Some("LittleEndian") => Ok(ByteOrder::Little),
        Some("BigEndian") => Ok(ByteOrder::Big),
        Some(other) => Err(file.fault(format_args!(
            "byte_order: {:?} is neither LittleEndian nor BigEndian",
            excerpt(other)
        ))),
    }
}

fn header_width(file: &Element) -> Result<usize, Fault> {
    match file.get("header_type") {
        None | Some("UInt32") => Ok(4),
        Some("UInt64") => Ok(8),
        Some(other) => Err(file.fault(format_args!(
            "header_type: {:?} is neither UInt32 nor UInt64",
            excerpt(other)
        ))),
    }
}

fn packing(file: &Element) -> Packing {
    match file.get("compressor") {
        None | Some("") => Packing::None,
        Some("vtkZLibDataCompressor") => Packing::Zlib,
        Some(other) => Packing::Other(excerpt(other)),
    }
}

/// The image of an element that was begun, without what its file says.
fn image<'a>(reader: &mut Reader<'a>, element: &Element) -> Result<Image<'a>, Fault> {
    let extent = extent(element, "WholeExtent")?;
    let vector = |name: &str, default: f64| -> Result<Vec3, Fault> {
        Ok(element.numbers(name, "a number")?.unwrap_or([default; 3]))
    };
    let spacing = vector("Spacing", 1.0)?;
    let straight = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let rows: [f64; 9] = element
        .numbers("Direction", "a number")?
        .unwrap_or(straight);
    let axis = |a: usize| scale(std::array::from_fn(|row| rows[3 * row + a]), spacing[a]);
    let mut image = Image {
        order: ByteOrder::Little,
        width: 4,
        packing: Packing::None,
        appended: None,
        extent,
        origin: vector("Origin", 0.0)?,
        axes: std::array::from_fn(axis),
        arrays: Vec::new(),
        scalars: [None, None],
        line: 0,
    };
    while let Some(child) = reader.child()? {
        if child.name != "Piece" {
            reader.skip()?;
            continue;
        }
        if image.line > 0 {
            return Err(child
                .fault(format_args!(
                    "is a second piece, the first in line {}; one is read",
                    image.line
                ))
                .with_hint("write the image in one piece"));
        }
        image.line = child.line;
        piece(reader, &child, &mut image)?;
    }
    if image.line == 0 {
        return Err(element.fault("holds no Piece"));
    }
    Ok(image)
}

/// The first and the last point along each axis.
fn extent(element: &Element, name: &str) -> Result<Extent, Fault> {
    element.need(name)?;
    let [a, b, c, d, e, f] = element.numbers(name, "an index")?.unwrap_or([0; 6]);
    let extent: Extent = [[a, b], [c, d], [e, f]];
    for (axis, [first, last]) in extent.into_iter().enumerate() {
        if last < first {
            return Err(element.fault(format_args!(
                "{name}: from {first} to {last} there is no point along axis {axis}"
            )));
        }
    }
    Ok(extent)
}

/// The arrays of a piece that was begun.
fn piece<'a>(
    reader: &mut Reader<'a>,
    element: &Element,
    image: &mut Image<'a>,
) -> Result<(), Fault> {
    let extent = extent(element, "Extent")?;
    if extent != image.extent {
        let [whole, piece] = [image.extent, extent].map(|e| {
            let numbers = e.as_flattened().iter().map(i64::to_string);
            numbers.collect::<Vec<_>>().join(" ")
        });
        return Err(element.fault(format_args!(
            "has the extent {piece}, but the whole image has {whole}"
        )));
    }
    while let Some(child) = reader.child()? {
        let place = match child.name {
            "PointData" => Place::Points,
            "CellData" => Place::Cells,
            _ => {
                reader.skip()?;
                continue;
            }
        };
        image.scalars[place as usize] = child.get("Scalars").map(str::to_owned);
        while let Some(element) = reader.child()? {
            if element.name == "DataArray" {
                let text = reader.text()?;
                image.arrays.push(Array {
                    place,
                    text,
                    element,
                });
            } else {
                reader.skip()?;
            }
        }
    }
    Ok(())
}

/// What follows the underscore in an element that was begun.
fn appended_data<'a>(reader: &Reader<'a>, element: &Element) -> Result<Appended<'a>, Fault> {
    let Some(bytes) = reader.rest().trim_ascii_start().strip_prefix(b"_") else {
        return Err(element.fault("does not begin with an underscore"));
    };
    match element.get("encoding") {
        Some("raw") => {
            // The data may hold any bytes, so its end is found from the end of the file.
            let tag = b"</AppendedData";
            let end = bytes.windows(tag.len()).rposition(|w| w == tag);
            Ok(Appended::Raw(&bytes[..end.unwrap_or(bytes.len())]))
        }
        None | Some("base64") => {
            let end = bytes.iter().position(|b| *b == b'<');
            let end = end.ok_or_else(|| element.fault("has no end"))?;
            Ok(Appended::Base64(&bytes[..end]))
        }
        Some(other) => Err(element.fault(format_args!(
            "encoding: {:?} is neither raw nor base64",
            excerpt(other)
        ))),
    }
}
