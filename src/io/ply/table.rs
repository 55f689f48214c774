//! The vertices of a PLY file as columns of numbers, for what is stored in one and is no mesh.

use super::header::{Element, Encoding, Header, Shape};
use super::rows::{self, Ascii, Binary, Rows, skip_property};
use crate::error::Fault;
use crate::io::cloud;
use crate::io::source::Source;
use crate::report::Warning;

/// Columns of the vertex element, by the names that were asked for.
#[derive(Debug)]
pub struct Table {
    /// Values of each name; none where the file has no property of it.
    pub columns: Vec<Option<Vec<f64>>>,
    /// How many vertices there are.
    pub rows: usize,
    /// The line that announces them.
    pub line: u64,
    /// The comments of the header, without the word.
    pub comments: Vec<String>,
}

/// The names of the properties of the vertex element, where bytes begin as a PLY file does.
pub fn vertex_properties(bytes: &[u8]) -> Vec<String> {
    let header = Header::parse(bytes).ok();
    let elements = header.into_iter().flat_map(|header| header.elements);
    let vertex = elements
        .into_iter()
        .find(|element| element.name == "vertex");
    let properties = vertex.into_iter().flat_map(|vertex| vertex.properties);
    properties.map(|property| property.name).collect()
}

/// Reads the properties of these names of all vertices; others are stepped over, with a counted warning.
///
/// Errs as a mesh does: a header that is none, fewer rows than it announces, a value that is no number.
/// Cost: linear in the bytes.
pub fn table(source: &Source, names: &[&str], warnings: &mut Vec<Warning>) -> Result<Table, Fault> {
    let bytes = source.bytes();
    let header = Header::parse(bytes)?;
    let vertex = header
        .elements
        .iter()
        .find(|element| element.name == "vertex");
    let vertex = vertex
        .ok_or_else(|| Fault::line(header.lines, "the header announces no vertex element"))?;
    let slots = slots_of(vertex, names);
    let mut ignored = Vec::new();
    for element in header.elements.iter().filter(|element| element.count > 0) {
        let is_read = |at: usize| element.name == "vertex" && slots[at].is_some();
        let properties = element.properties.iter().enumerate();
        let others = properties.filter(|(at, _)| !is_read(*at));
        ignored.extend(others.map(|(_, property)| format!("{}.{}", element.name, property.name)));
    }
    let columns = match header.encoding {
        Encoding::Ascii => {
            let mut rows = Ascii::new(&bytes[header.data..], header.lines);
            let columns = columns(&header, &slots, names.len(), &mut rows)?;
            rows.finish(warnings);
            columns
        }
        Encoding::Little => {
            let mut rows = Binary::<false>::new(bytes, header.data);
            columns(&header, &slots, names.len(), &mut rows)?
        }
        Encoding::Big => {
            let mut rows = Binary::<true>::new(bytes, header.data);
            columns(&header, &slots, names.len(), &mut rows)?
        }
    };
    cloud::warn_of_ignored(&ignored, warnings);
    let columns = columns.into_iter().enumerate();
    let columns = columns.map(|(slot, column)| slots.contains(&Some(slot)).then_some(column));
    Ok(Table {
        columns: columns.collect(),
        rows: vertex.count as usize,
        line: vertex.line,
        comments: header.comments,
    })
}

/// Which of the names each property has.
fn slots_of(vertex: &Element, names: &[&str]) -> Vec<Option<usize>> {
    let slot = |property: &super::header::Property| {
        let is_number = matches!(property.shape, Shape::Scalar(_));
        names
            .iter()
            .position(|name| is_number && *name == property.name)
    };
    vertex.properties.iter().map(slot).collect()
}

/// The columns of the vertices; the elements before them are stepped over, those after them not reached.
fn columns(
    header: &Header,
    slots: &[Option<usize>],
    count: usize,
    rows: &mut impl Rows,
) -> Result<Vec<Vec<f64>>, Fault> {
    let mut columns = vec![Vec::new(); count];
    for element in &header.elements {
        if element.name != "vertex" {
            rows::skip(element, rows)?;
            continue;
        }
        rows.begin(element);
        let most = rows.most(element);
        let room = usize::try_from(element.count).map_or(most, |count| count.min(most));
        for slot in slots.iter().flatten() {
            columns[*slot].reserve_exact(room);
        }
        for index in 0..element.count {
            rows.start(index)?;
            for (property, slot) in element.properties.iter().zip(slots) {
                match (property.shape, slot) {
                    (Shape::Scalar(scalar), Some(slot)) => {
                        columns[*slot].push(rows.scalar(scalar)?)
                    }
                    (shape, _) => skip_property(shape, rows)?,
                }
            }
            rows.end();
        }
        break;
    }
    Ok(columns)
}
