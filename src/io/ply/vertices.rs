//! The vertex element: positions, normals, colours and classes.

use super::header::{Element, Property, Scalar, Shape};
use super::rows::{Binary, Rows, decode, skip_property};
use super::{Reader, TASK};
use crate::error::Fault;
use crate::io::cloud::SKIP;
use crate::numeric::vector::Vec3;
use rayon::prelude::*;

/// The properties of a vertex that are read; their places here are the slots of a row.
const NAMES: [&str; 11] = [
    "x",
    "y",
    "z",
    "nx",
    "ny",
    "nz",
    "red",
    "green",
    "blue",
    "alpha",
    "classification",
];
const ALPHA: usize = 9;
const CLASS: usize = 10;
/// What else classes are called, the last by CloudCompare.
const CLASSES: [&str; 3] = ["class", "Classification", "scalar_Classification"];

/// Which property of the vertex element is what.
#[derive(Debug)]
pub struct Layout {
    /// The slot of each property that is read.
    pub slots: Vec<Option<usize>>,
    /// What a value is divided by: colours of whole numbers are fractions of the largest.
    divisors: [f64; NAMES.len()],
    normals: bool,
    colors: bool,
    pub classes: bool,
}

impl Layout {
    /// Fails when there is no x, y or z. Normals and colours are read when they are whole.
    pub fn new(element: &Element) -> Result<Layout, Fault> {
        let slot = |p: &Property| {
            let name = p.name.strip_prefix("diffuse_").unwrap_or(&p.name);
            let name = if CLASSES.contains(&name) {
                NAMES[CLASS]
            } else {
                name
            };
            let slot = NAMES.iter().position(|s| *s == name)?;
            matches!(p.shape, Shape::Scalar(_)).then_some(slot)
        };
        let mut slots: Vec<_> = element.properties.iter().map(slot).collect();
        for at in 1..slots.len() {
            // `red` and `diffuse_red` are one slot: the first is read.
            if slots[at].is_some() && slots[..at].contains(&slots[at]) {
                slots[at] = None;
            }
        }
        let has = |slot: usize| slots.contains(&Some(slot));
        if let Some(missing) = (0..3).find(|slot| !has(*slot)) {
            return Err(Fault::line(
                element.line,
                format!("the vertex element has no property {}", NAMES[missing]),
            ));
        }
        let (normals, colors, classes) = ((3..6).all(has), (6..ALPHA).all(has), has(CLASS));
        let is_read = |slot: usize| match slot {
            0..3 => true,
            3..6 => normals,
            6..=ALPHA => colors,
            _ => true,
        };
        for slot in &mut slots {
            *slot = slot.filter(|slot| is_read(*slot));
        }
        let mut divisors = [1.0; NAMES.len()];
        for (property, slot) in element.properties.iter().zip(&slots) {
            if let (Shape::Scalar(scalar), Some(slot @ 6..=ALPHA)) = (property.shape, slot) {
                divisors[*slot] = match scalar {
                    Scalar::F32 | Scalar::F64 => 1.0,
                    Scalar::U16 | Scalar::I16 => 65535.0,
                    _ => 255.0,
                };
            }
        }
        Ok(Layout {
            slots,
            divisors,
            normals,
            colors,
            classes,
        })
    }

    /// Where the value of each slot stands in a row without lists.
    fn offsets(&self, element: &Element) -> [Option<(usize, Scalar)>; NAMES.len()] {
        let mut offsets = [None; NAMES.len()];
        let mut at = 0;
        for (property, slot) in element.properties.iter().zip(&self.slots) {
            if let Shape::Scalar(scalar) = property.shape {
                if let Some(slot) = slot {
                    offsets[*slot] = Some((at, scalar));
                }
                at += scalar.size();
            }
        }
        offsets
    }
}

/// Vertices are numbered with 32 bits.
fn check_count(element: &Element) -> Result<(), Fault> {
    if element.count > u64::from(u32::MAX) {
        return Err(Fault::line(
            element.line,
            format!(
                "the header announces {} vertices, but at most {} can be held",
                element.count,
                u32::MAX
            ),
        ));
    }
    Ok(())
}

impl Reader<'_> {
    /// Vertices one by one.
    pub fn vertex_rows(&mut self, element: &Element, rows: &mut impl Rows) -> Result<(), Fault> {
        let room = rows.most(element);
        let room = usize::try_from(element.count).map_or(room, |count| count.min(room));
        let Layout {
            normals,
            colors,
            classes,
            ..
        } = self.layout;
        self.mesh.positions.reserve_exact(room);
        let mut all_normals = Vec::with_capacity(if normals { room } else { 0 });
        let mut all_colors = Vec::with_capacity(if colors { room } else { 0 });
        let mut values = [0.0; NAMES.len()];
        values[ALPHA] = 1.0;
        for index in 0..element.count {
            rows.start(index)?;
            for (property, slot) in element.properties.iter().zip(&self.layout.slots) {
                match (property.shape, slot) {
                    (Shape::Scalar(scalar), Some(slot)) => values[*slot] = rows.scalar(scalar)?,
                    (shape, _) => skip_property(shape, rows)?,
                }
            }
            rows.end();
            if let Some(slot) = values.iter().position(|v| !v.is_finite())
                && !self.keeps_bad
            {
                let (name, value) = (NAMES[slot], values[slot]);
                let fault = rows.fault(format!("has {name} = {value}, which is not finite"));
                return Err(match self.is_cloud() {
                    true => fault.with_hint(SKIP),
                    false => fault,
                });
            }
            let [x, y, z, nx, ny, nz, ..] = values;
            self.mesh.positions.push([x, y, z]);
            if normals {
                all_normals.push([nx, ny, nz]);
            }
            if colors {
                all_colors.push([6, 7, 8, 9].map(|s| (values[s] / self.layout.divisors[s]) as f32));
            }
            if classes {
                self.classes.push(values[CLASS]);
            }
        }
        check_count(element)?;
        self.mesh.normals = normals.then_some(all_normals);
        self.mesh.colors = colors.then_some(all_colors);
        Ok(())
    }

    /// Vertices of a binary file all at once; false when their rows have lists.
    pub fn vertex_block<const BIG: bool>(
        &mut self,
        element: &Element,
        rows: &mut Binary<BIG>,
    ) -> Result<bool, Fault> {
        let Some(stride) = element.stride() else {
            return Ok(false);
        };
        let block = rows.block(element, stride)?;
        check_count(element)?;
        let offsets = self.layout.offsets(element);
        let vertices = || block.par_chunks_exact(stride).with_min_len(TASK);
        let value = move |row: &[u8], slot: usize| {
            offsets[slot].map_or(1.0, |(at, scalar)| decode::<BIG>(scalar, &row[at..]))
        };
        self.mesh.positions = match offsets {
            [
                Some((x, Scalar::F32)),
                Some((y, Scalar::F32)),
                Some((z, Scalar::F32)),
                ..,
            ] if y == x + 4 && z == x + 8 => vertices()
                .map(|row| floats::<BIG>(&row[x..x + 12]))
                .collect(),
            _ => vertices()
                .map(|row| [0, 1, 2].map(|slot| value(row, slot)))
                .collect(),
        };
        if self.layout.normals {
            let normal = |row: &[u8]| [3, 4, 5].map(|slot| value(row, slot));
            self.mesh.normals = Some(vertices().map(normal).collect());
        }
        if self.layout.colors {
            let divisors = self.layout.divisors;
            let channel = |row: &[u8], slot: usize| (value(row, slot) / divisors[slot]) as f32;
            let color = |row: &[u8]| [6, 7, 8, 9].map(|slot| channel(row, slot));
            self.mesh.colors = Some(vertices().map(color).collect());
        }
        if self.layout.classes {
            self.classes = vertices().map(|row| value(row, CLASS)).collect();
        }
        Ok(true)
    }
}

/// Three 32-bit numbers of 12 bytes.
#[inline]
fn floats<const BIG: bool>(bytes: &[u8]) -> Vec3 {
    [0, 4, 8].map(|at| decode::<BIG>(Scalar::F32, &bytes[at..at + 4]))
}
