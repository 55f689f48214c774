//! World files: six numbers beside a raster that say where its cells are.

use super::refusal::Refusal;
use super::source::Source;
use super::text;
use crate::error::Fault;
use crate::report::Warning;
use crate::terrain::Transform;

/// The place of the cells by the world file beside a raster, of the first of these extensions that is there.
pub fn beside(source: &Source, extensions: &[&str]) -> Result<Option<Transform>, Fault> {
    for extension in extensions {
        match source.sibling(extension) {
            Ok(Some(bytes)) => return parse(&bytes).map(Some),
            Ok(None) => {}
            Err(Refusal::Fault(fault)) => return Err(fault),
            Err(Refusal::OverMemory { what, .. }) => {
                return Err(Fault::whole(format!("{what} is too large")));
            }
        }
    }
    Ok(None)
}

/// `across x, across y, down x, down y`, and the centre of the first cell.
fn parse(bytes: &[u8]) -> Result<Transform, Fault> {
    let numbers: Option<Vec<f64>> = text::words(bytes).map(text::number).collect();
    match numbers.as_deref() {
        Some([a, d, b, e, x, y]) if numbers.iter().flatten().all(|n| n.is_finite()) => {
            let mut transform = Transform {
                origin: [*x, *y],
                across: [*a, *d],
                down: [*b, *e],
            };
            transform.origin = transform.place(-0.5, -0.5);
            Ok(transform)
        }
        Some(others) => {
            let count = others.len();
            let problem = format!("its world file has {count} numbers, but 6 are needed");
            Err(Fault::whole(problem))
        }
        None => Err(Fault::whole("its world file has words that are no numbers")),
    }
}

/// The six lines of a transform.
pub fn write(transform: &Transform) -> String {
    let [x, y] = transform.place(0.5, 0.5);
    let (a, d) = (transform.across, transform.down);
    let lines = [a[0], a[1], d[0], d[1], x, y].map(|n| format!("{n:?}\n"));
    lines.concat()
}

/// Cells of size 1 counted from the lower left corner, for rasters that have no place.
pub fn of_cells(rows: usize) -> Transform {
    Transform::north_up([0.0, rows as f64], [1.0, 1.0])
}

/// Tells that a raster has no place on the map.
pub fn warn_of_none(warnings: &mut Vec<Warning>) {
    let message = "no place on the map; cells are of size 1 and counted from the lower left";
    warnings.push(Warning::new("no-georeference", message, 1, None));
}
