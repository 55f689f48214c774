//! The records of a `.shp` file.

use super::rings;
use crate::error::Fault;
use crate::report::{Tally, Warning};
use crate::vector::{Shape, Vec2};

/// Bytes of the header of the file, and of that of a record.
const HEADER: usize = 100;
const RECORD: usize = 8;

/// What a file holds.
#[derive(Debug)]
pub struct Shapes {
    /// In the order of the records.
    pub shapes: Vec<Shape>,
    /// The kind of shape that the header says.
    pub kind: i32,
}

/// Whole numbers and floats at places of a record, if they are there.
#[derive(Debug, Clone, Copy)]
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn whole(self, at: usize) -> Option<i32> {
        let bytes = self.0.get(at..at + 4)?;
        Some(i32::from_le_bytes(bytes.try_into().ok()?))
    }

    fn count(self, at: usize) -> Option<usize> {
        usize::try_from(self.whole(at)?).ok()
    }

    fn place(self, at: usize) -> Option<Vec2> {
        let (pairs, _) = self.0.get(at..at + 16)?.as_chunks::<8>();
        let place: Vec2 = std::array::from_fn(|axis| f64::from_le_bytes(pairs[axis]));
        place.iter().all(|c| c.is_finite()).then_some(place)
    }

    fn places(self, at: usize, count: usize) -> Option<Vec<Vec2>> {
        let end = at.checked_add(count.checked_mul(16)?)?;
        self.0.get(at..end)?;
        (0..count).map(|n| self.place(at + 16 * n)).collect()
    }

    /// Lines or rings: how many parts and places there are, where parts start, and the places.
    fn parts(self) -> Option<Vec<Vec<Vec2>>> {
        let (parts, count) = (self.count(36)?, self.count(40)?);
        let table = parts.checked_mul(4)?.checked_add(44)?;
        self.0.get(..table)?;
        let places = self.places(table, count)?;
        let starts: Option<Vec<usize>> = (0..parts).map(|n| self.count(44 + 4 * n)).collect();
        let mut starts = starts?;
        starts.push(count);
        let pairs = starts.windows(2);
        pairs
            .map(|pair| Some(places.get(pair[0]..pair[1])?.to_vec()))
            .collect()
    }
}

fn big(bytes: &[u8], at: usize) -> Option<i32> {
    Some(i32::from_be_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
}

/// What of the file looks wrong, by number of the record from 0.
#[derive(Debug, Default)]
struct Wrong {
    damaged: Tally,
    short: Tally,
    unclosed: Tally,
    orphans: Tally,
}

/// Reads all records.
///
/// Errs where a record that is not the last to be seen claims a length with which none can follow it.
pub fn read(bytes: &[u8], warnings: &mut Vec<Warning>) -> Result<Shapes, Fault> {
    let kind = Bytes(bytes).whole(32).filter(|_| bytes.len() >= HEADER);
    let kind = kind.ok_or_else(|| {
        let has = bytes.len();
        Fault::whole(format!("has {has} bytes, but the header takes {HEADER}"))
    })?;
    if ![0, 1, 3, 5, 8, 11, 13, 15, 18, 21, 23, 25, 28].contains(&kind) {
        let problem = format!("holds shapes of kind {kind}; points, lines and polygons are read");
        return Err(Fault::byte(32, problem));
    }
    let claimed = big(bytes, 24).unwrap_or(0).max(0) as usize * 2;
    let end = if claimed >= HEADER {
        claimed.min(bytes.len())
    } else {
        bytes.len()
    };
    let mut shapes = Vec::new();
    let mut wrong = Wrong::default();
    let mut at = HEADER;
    let mut lost = false;
    while at + RECORD <= end {
        let number = shapes.len();
        let length = big(bytes, at + 4).and_then(|words| usize::try_from(words).ok());
        let length = length.and_then(|words| words.checked_mul(2)).unwrap_or(0);
        let start = at + RECORD;
        if length < 4 {
            let problem =
                format!("it has {length} bytes by its header at byte {at}, at least 4 are needed");
            return Err(Fault::element("shape", number, problem));
        }
        let Some(record) = bytes.get(start..start + length) else {
            let there = bytes.len() - start;
            // Behind the lost end nothing can stand: with such a length in the midst of a whole file it
            // is the length that is wrong.
            if claimed == bytes.len() {
                let problem = format!(
                    "it has {length} bytes by its header at byte {at}, but {there} are left in the file"
                );
                return Err(Fault::element("shape", number, problem));
            }
            shapes.push(Shape::Empty);
            lost = true;
            break;
        };
        shapes.push(shape(Bytes(record), number as u64, &mut wrong));
        at = start + length;
    }
    if lost || claimed > bytes.len() {
        let first = shapes.len() as u64 - u64::from(lost);
        let message = format!(
            "the end of the file is lost: {claimed} bytes by its header, {} are there; shapes cut off",
            bytes.len()
        );
        warnings.push(Warning::new("truncated", message, 1, Some(first)));
    }
    wrong.warn(warnings);
    Ok(Shapes { shapes, kind })
}

impl Wrong {
    fn warn(self, warnings: &mut Vec<Warning>) {
        let mut warn = |tally: Tally, code, message| tally.warn(code, message, warnings);
        warn(
            self.damaged,
            "damaged-shapes",
            "shapes that are damaged; left empty",
        );
        let message =
            "shapes with lines of one place or rings of less than three; those parts are left out";
        warn(self.short, "short-parts", message);
        let message = "shapes with rings whose end is not their start; closed";
        warn(self.unclosed, "unclosed-rings", message);
        let message = "shapes with holes in no ring; they are taken for areas";
        warn(self.orphans, "holes-in-nothing", message);
    }
}

/// The shape of a record; empty where it is null or damaged.
fn shape(record: Bytes, number: u64, wrong: &mut Wrong) -> Shape {
    let read = match record.whole(0).map(|kind| kind % 10) {
        _ if record.whole(0) == Some(0) => return Shape::Empty,
        Some(1) => record.place(4).map(|place| Shape::Points(vec![place])),
        Some(8) => record
            .count(36)
            .and_then(|count| record.places(40, count))
            .map(Shape::Points),
        Some(3) => record.parts().map(|mut lines| {
            let all = lines.len();
            lines.retain(|line| line.len() > 1);
            if lines.len() < all {
                wrong.short.note(number);
            }
            Shape::Lines(lines)
        }),
        Some(5) => record.parts().map(|parts| {
            let settled = rings::settle(parts);
            let marks = [
                (&mut wrong.short, settled.is_short),
                (&mut wrong.unclosed, settled.is_unclosed),
                (&mut wrong.orphans, settled.has_orphans),
            ];
            for (tally, _) in marks.into_iter().filter(|(_, is)| *is) {
                tally.note(number);
            }
            Shape::Polygons(settled.polygons)
        }),
        _ => None,
    };
    match read {
        Some(Shape::Points(all)) if all.is_empty() => Shape::Empty,
        Some(Shape::Lines(all)) if all.is_empty() => Shape::Empty,
        Some(Shape::Polygons(all)) if all.is_empty() => Shape::Empty,
        Some(shape) => shape,
        None => {
            wrong.damaged.note(number);
            Shape::Empty
        }
    }
}
