//! The fields that are read, and their values in bytes.

use super::header::{Field, Header, Scalar};
use crate::error::Fault;
use crate::io::cloud::from_byte;

/// Which field is what.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    pub position: [usize; 3],
    pub normal: Option<[usize; 3]>,
    /// Red, green and blue packed in four bytes.
    pub color: Option<usize>,
    /// Whether the fourth of them is alpha.
    pub has_alpha: bool,
    pub class: Option<usize>,
}

impl Layout {
    /// Errs where there is no x, y or z.
    pub fn new(header: &Header) -> Result<Layout, Fault> {
        let find = |name: &str| {
            let is_it = |field: &Field| field.count == 1 && field.name == name;
            header.fields.iter().position(is_it)
        };
        let packed = |name: &str| {
            let is_packed = |at: &usize| {
                let scalar = header.fields[*at].scalar;
                matches!(scalar, Scalar::F32 | Scalar::U32 | Scalar::I32)
            };
            find(name).filter(is_packed)
        };
        let all = |names: [&str; 3]| {
            let [a, b, c] = names.map(find);
            Some([a?, b?, c?])
        };
        let position = all(["x", "y", "z"]).ok_or_else(|| {
            let missing = ["x", "y", "z"]
                .into_iter()
                .find(|name| find(name).is_none());
            let problem = format!("FIELDS: no field is named {}", missing.unwrap_or_default());
            Fault::line(header.fields_line, problem)
        })?;
        let rgba = packed("rgba");
        Ok(Layout {
            position,
            normal: all(["normal_x", "normal_y", "normal_z"]),
            color: rgba.or_else(|| packed("rgb")),
            has_alpha: rgba.is_some(),
            class: find("classification").or_else(|| find("class")),
        })
    }

    /// The fields that are not read, but for those that fill up rows.
    pub fn ignored(&self, fields: &[Field]) -> Vec<String> {
        let read = self.position.into_iter();
        let read = read.chain(self.normal.into_iter().flatten());
        let read: Vec<usize> = read.chain(self.color).chain(self.class).collect();
        let others = fields.iter().enumerate();
        let others = others.filter(|(at, field)| !read.contains(at) && !field.is_padding());
        others.map(|(_, field)| field.name.clone()).collect()
    }
}

/// Where the values of one field stand: that of point `i` at `start + i * step`.
#[derive(Debug, Clone, Copy)]
pub struct Column {
    pub scalar: Scalar,
    pub start: usize,
    pub step: usize,
}

impl Column {
    /// The bytes of a value, as a number of 64 bits.
    #[inline]
    pub fn bits(self, bytes: &[u8], point: usize) -> u64 {
        let at = self.start + point * self.step;
        let mut raw = [0; 8];
        let size = self.scalar.size();
        raw[..size].copy_from_slice(&bytes[at..at + size]);
        u64::from_le_bytes(raw)
    }

    /// A value.
    #[inline]
    pub fn value(self, bytes: &[u8], point: usize) -> f64 {
        let bits = self.bits(bytes, point);
        match self.scalar {
            Scalar::I8 => f64::from(bits as i8),
            Scalar::U8 => f64::from(bits as u8),
            Scalar::I16 => f64::from(bits as i16),
            Scalar::U16 => f64::from(bits as u16),
            Scalar::I32 => f64::from(bits as i32),
            Scalar::U32 => f64::from(bits as u32),
            Scalar::I64 => bits as i64 as f64,
            Scalar::U64 => bits as f64,
            Scalar::F32 => f64::from(f32::from_bits(bits as u32)),
            Scalar::F64 => f64::from_bits(bits),
        }
    }
}

/// Columns of points that stand row by row.
pub fn by_rows(fields: &[Field]) -> Vec<Column> {
    let step = fields.iter().map(Field::bytes).sum();
    let mut start = 0;
    let columns = fields.iter().map(|field| {
        let column = Column {
            scalar: field.scalar,
            start,
            step,
        };
        start += field.bytes();
        column
    });
    columns.collect()
}

/// Columns that stand one after the other, as packed data has them; padding is not among them.
pub fn by_fields(fields: &[Field], points: usize) -> Vec<Column> {
    let mut start = 0;
    let columns = fields.iter().map(|field| {
        let column = Column {
            scalar: field.scalar,
            start,
            step: field.bytes(),
        };
        if !field.is_padding() {
            start += field.bytes() * points;
        }
        column
    });
    columns.collect()
}

/// Colours that are packed as `0xAARRGGBB`; all are opaque where no alpha is told, or all are 0, which
/// is how files have it that know of none.
pub fn colors(packed: &[u32], has_alpha: bool) -> Vec<[f32; 4]> {
    let has_alpha = has_alpha && packed.iter().any(|color| color >> 24 != 0);
    let color = |color: &u32| {
        let [blue, green, red, alpha] = color.to_le_bytes();
        let alpha = if has_alpha { alpha } else { u8::MAX };
        [red, green, blue, alpha].map(from_byte)
    };
    packed.iter().map(color).collect()
}
