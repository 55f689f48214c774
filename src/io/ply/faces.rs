//! The elements that refer to vertices: faces, triangle strips, edges, points.

use super::header::{Element, Scalar, Shape};
use super::rows::{self, Binary, Rows, skip_property};
use super::{Reader, TASK};
use crate::error::Fault;
use rayon::prelude::*;

/// Where the list of a face's or a strip's vertices stands among its properties.
pub fn list_of(element: &Element) -> Option<usize> {
    let list = element
        .property("vertex_indices")
        .or_else(|| element.property("vertex_index"))?;
    match element.properties[list].shape {
        Shape::List { item, .. } if item.is_integer() => Some(list),
        _ => None,
    }
}

/// Where the whole numbers of these names stand among an element's properties.
pub fn columns_of<const N: usize>(element: &Element, names: [&str; N]) -> Option<[usize; N]> {
    let mut columns = [0; N];
    for (column, name) in columns.iter_mut().zip(names) {
        *column = element.property(name)?;
        match element.properties[*column].shape {
            Shape::Scalar(scalar) if scalar.is_integer() => {}
            _ => return None,
        }
    }
    Some(columns)
}

impl Reader<'_> {
    /// Faces one by one.
    pub fn face_rows(&mut self, element: &Element, rows: &mut impl Rows) -> Result<(), Fault> {
        let vertices = self.vertices;
        let most = rows.most(element);
        let room = usize::try_from(element.count).map_or(most, |count| count.min(most));
        self.faces.starts.reserve(room.saturating_add(1));
        let mut face = Vec::new();
        for_each_list(element, rows, |item, count, rows| {
            face.clear();
            for _ in 0..count {
                face.push(rows.index(item, vertices)?);
            }
            self.faces.push(&face);
            Ok(())
        })
    }

    /// Faces of a binary file all at once, when there is nothing but triangles of 32-bit indices
    /// counted by a byte, and all refer to vertices that are there; else false.
    pub fn triangle_block<const BIG: bool>(
        &mut self,
        element: &Element,
        rows: &mut Binary<BIG>,
    ) -> bool {
        let Some((before, stride)) = triangle_row(element) else {
            return false;
        };
        let bytes = rows.rest();
        let length = usize::try_from(element.count)
            .ok()
            .and_then(|count| count.checked_mul(stride))
            .filter(|length| *length <= bytes.len());
        let (Some(length), Ok(vertices), false) =
            (length, u32::try_from(self.vertices), self.has_strips())
        else {
            return false;
        };
        let mut triangles = vec![[0; 3]; length / stride];
        let all_are = triangles
            .par_chunks_mut(TASK)
            .zip(bytes[..length].par_chunks(TASK * stride))
            .all(|(triangles, bytes)| {
                let mut is_good = true;
                for (triangle, row) in triangles.iter_mut().zip(bytes.chunks_exact(stride)) {
                    let row = &row[before..before + 13];
                    *triangle = [1, 5, 9].map(|at| word::<BIG>(&row[at..at + 4]));
                    is_good &= row[0] == 3 && triangle.iter().all(|v| *v < vertices);
                }
                is_good
            });
        if all_are {
            rows.advance(length);
            self.triangles = triangles;
        }
        all_are
    }

    fn has_strips(&self) -> bool {
        self.header.elements.iter().any(|e| e.name == "tristrips")
    }

    /// Strips one by one: every vertex from the third on makes a triangle with the two before it,
    /// turned over every second time; -1 begins a new strip.
    pub fn strip_rows(&mut self, element: &Element, rows: &mut impl Rows) -> Result<(), Fault> {
        let vertices = self.vertices;
        for_each_list(element, rows, |item, count, rows| {
            let mut last = [0; 2];
            let mut length = 0u64;
            for _ in 0..count {
                let value = rows.scalar(item)?;
                if value == -1.0 || item == Scalar::U32 && value == f64::from(u32::MAX) {
                    length = 0;
                    continue;
                }
                let vertex = rows.vertex(value, vertices)?;
                let [a, b] = last;
                match length {
                    0 | 1 => {}
                    _ if length.is_multiple_of(2) => self.faces.push(&[a, b, vertex]),
                    _ => self.faces.push(&[b, a, vertex]),
                }
                last = [b, vertex];
                length += 1;
            }
            Ok(())
        })
    }

    /// Edges as segments; those without both ends are stepped over.
    pub fn edge_rows(&mut self, element: &Element, rows: &mut impl Rows) -> Result<(), Fault> {
        let Some(columns) = columns_of(element, ["vertex1", "vertex2"]) else {
            return rows::skip(element, rows);
        };
        let mut segments = Vec::new();
        for_each_index(element, rows, columns, self.vertices, |edge| {
            segments.push(edge);
        })?;
        self.mesh.segments = segments;
        Ok(())
    }

    /// Vertices that stand alone.
    pub fn point_rows(&mut self, element: &Element, rows: &mut impl Rows) -> Result<(), Fault> {
        let Some(columns) = columns_of(element, ["vertex_index"]) else {
            return rows::skip(element, rows);
        };
        let mut points = Vec::new();
        for_each_index(element, rows, columns, self.vertices, |[point]| {
            points.push(point);
        })?;
        self.mesh.points = points;
        Ok(())
    }
}

/// Of a row that has one list, of 32-bit indices counted by a byte, and else numbers: the bytes
/// before the list, and of all when the list has three items.
fn triangle_row(element: &Element) -> Option<(usize, usize)> {
    let list = list_of(element)?;
    let (mut before, mut stride) = (0, 0usize);
    for (at, property) in element.properties.iter().enumerate() {
        let size = match property.shape {
            Shape::Scalar(scalar) => scalar.size(),
            Shape::List { count, item } => {
                if at != list || count.size() != 1 || item.size() != 4 {
                    return None;
                }
                before = stride;
                13
            }
        };
        stride += size;
    }
    Some((before, stride))
}

#[inline]
fn word<const BIG: bool>(bytes: &[u8]) -> u32 {
    let raw = [bytes[0], bytes[1], bytes[2], bytes[3]];
    if BIG {
        u32::from_be_bytes(raw)
    } else {
        u32::from_le_bytes(raw)
    }
}

/// Hands over the type and length of each row's vertex list, and the rows to read it from.
fn for_each_list<R: Rows>(
    element: &Element,
    rows: &mut R,
    mut each: impl FnMut(Scalar, u64, &mut R) -> Result<(), Fault>,
) -> Result<(), Fault> {
    if element.count == 0 {
        return Ok(());
    }
    let list = list_of(element).ok_or_else(|| {
        Fault::line(
            element.line,
            format!(
                "the {} element has no list vertex_indices of whole numbers",
                element.name
            ),
        )
    })?;
    for index in 0..element.count {
        rows.start(index)?;
        for (at, property) in element.properties.iter().enumerate() {
            match property.shape {
                Shape::List { count, item } if at == list => {
                    let count = rows.count(count)?;
                    each(item, count, rows)?;
                }
                shape => skip_property(shape, rows)?,
            }
        }
        rows.end();
    }
    Ok(())
}

/// Hands over the indices in some columns of each row.
fn for_each_index<const N: usize>(
    element: &Element,
    rows: &mut impl Rows,
    columns: [usize; N],
    vertices: u64,
    mut each: impl FnMut([u32; N]),
) -> Result<(), Fault> {
    for index in 0..element.count {
        rows.start(index)?;
        let mut indices = [0; N];
        for (at, property) in element.properties.iter().enumerate() {
            match (property.shape, columns.iter().position(|c| *c == at)) {
                (Shape::Scalar(scalar), Some(slot)) => {
                    indices[slot] = rows.index(scalar, vertices)?;
                }
                (shape, _) => skip_property(shape, rows)?,
            }
        }
        rows.end();
        each(indices);
    }
    Ok(())
}
