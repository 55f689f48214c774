//! The records of points.

use super::header::{Header, u16_at, u32_at};
use crate::numeric::vector::Vec3;
use crate::report::{Tally, Warning};

/// How the record of a point is laid out.
#[derive(Debug, Clone, Copy)]
pub struct Records {
    scale: [f64; 3],
    offset: [f64; 3],
    color: Option<usize>,
    is_new: bool,
}

/// Points that stand one after the other.
#[derive(Debug, Default)]
pub struct Part {
    pub positions: Vec<Vec3>,
    /// Of 16 bits.
    pub colors: Vec<[u16; 3]>,
    pub classes: Vec<u8>,
    /// Those that are marked as withheld.
    withheld: Vec<u32>,
}

impl Records {
    /// As the header says.
    pub fn of(header: &Header) -> Records {
        Records {
            scale: header.scale,
            offset: header.offset,
            color: header.color(),
            is_new: header.is_new(),
        }
    }

    /// Takes a point. A coordinate is its whole number times the scale, and the offset added, each rounded
    /// once.
    #[inline]
    pub fn take(&self, record: &[u8], part: &mut Part) {
        let position = [0, 1, 2].map(|axis| {
            let steps = u32_at(record, 4 * axis) as i32;
            f64::from(steps) * self.scale[axis] + self.offset[axis]
        });
        // Points of the older kind have flags in the upper bits of their class.
        let (class, is_withheld) = if self.is_new {
            (record[16], record[15] & 4 != 0)
        } else {
            (record[15] & 31, record[15] & 128 != 0)
        };
        if is_withheld {
            part.withheld.push(part.positions.len() as u32);
        }
        part.positions.push(position);
        part.classes.push(class);
        if let Some(at) = self.color {
            part.colors
                .push([0, 2, 4].map(|channel| u16_at(record, at + channel)));
        }
    }
}

impl Part {
    /// All points of parts, in order; a warning counts those that are marked as withheld.
    pub fn joined(parts: Vec<Part>, warnings: &mut Vec<Warning>) -> Part {
        let mut all = Part::default();
        let mut withheld = Tally::default();
        for part in parts {
            let before = all.positions.len() as u64;
            let places = part.withheld.iter().map(|at| before + u64::from(*at));
            places.for_each(|place| withheld.note(place));
            all.positions.extend(part.positions);
            all.colors.extend(part.colors);
            all.classes.extend(part.classes);
        }
        let message = "points that the file marks as withheld; kept";
        withheld.warn("withheld-points", message, warnings);
        all
    }
}

/// Colours of 16 bits as shares of 1; none where all are black. Files that fill only the lower 8 bits are
/// read as if they had no more.
pub fn colors(stored: &[[u16; 3]], warnings: &mut Vec<Warning>) -> Option<Vec<[f32; 4]>> {
    let most = stored.iter().flatten().max().copied().unwrap_or_default();
    let count = stored.len() as u64;
    let mut warn = |code, message| warnings.push(Warning::new(code, message, count, Some(0)));
    let full = match most {
        0 if count > 0 => {
            warn(
                "black-colours",
                "points have a colour, but all are black; not read",
            );
            return None;
        }
        0 => return None,
        ..=255 => {
            warn(
                "colours-of-bytes",
                "colours of 16 bits of which 8 are used; read as bytes",
            );
            255.0
        }
        _ => 65535.0,
    };
    let share = |channel: u16| (f64::from(channel) / full) as f32;
    let color = |[red, green, blue]: &[u16; 3]| [share(*red), share(*green), share(*blue), 1.0];
    Some(stored.iter().map(color).collect())
}
