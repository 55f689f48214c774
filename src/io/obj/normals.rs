//! The normals of clouds: corners have those of a mesh, but a cloud has no corners.

use super::{Part, statements};
use crate::error::Fault;
use crate::io::text::{triple, words};
use crate::numeric::vector::Vec3;
use rayon::prelude::*;

/// The normals of a file of nothing but vertices that has one for each, as programs write scans; none for
/// any other file.
///
/// `texts` are the parts of the file, `starts` the lines before each. Errs as the reader of vertices does.
pub fn of_cloud(
    texts: &[&[u8]],
    end: u8,
    starts: &[(u64, u64)],
    parts: &[Part],
) -> Result<Option<Vec<Vec3>>, Fault> {
    let is_bare =
        |part: &Part| part.faces.is_empty() && part.segments.is_empty() && part.points.is_empty();
    let vertices: u64 = parts.iter().map(|part| part.positions.len() as u64).sum();
    let normals: u64 = parts.iter().map(|part| part.notes.normals.count()).sum();
    if normals != vertices || !parts.iter().all(is_bare) {
        return Ok(None);
    }
    let found: Vec<Result<Vec<Vec3>, Fault>> = texts
        .par_iter()
        .zip(starts)
        .map(|(text, (lines, _))| of_part(text, end, *lines))
        .collect();
    let found = found.into_iter().collect::<Result<Vec<_>, _>>()?;
    Ok(Some(found.concat()))
}

fn of_part(text: &[u8], end: u8, lines: u64) -> Result<Vec<Vec3>, Fault> {
    let mut normals = Vec::new();
    let mut statements = statements(text, end, lines);
    while let Some((line, statement)) = statements.next() {
        let mut words = words(&statement);
        if words.next() == Some(b"vn") {
            normals.push(triple(&mut words, line, "normal")?);
        }
    }
    Ok(normals)
}
