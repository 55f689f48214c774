//! Accessors: typed values in buffers, of any component type, strided and sparse.

use super::document::{Accessor, Buffers, Document, Sparse};
use crate::error::Fault;
use crate::io::header::excerpt;
use crate::io::refusal::Refusal;

/// Elements that an accessor without any bytes behind it may have: enough for every small file, and
/// no way to ask for memory.
const BARE_ELEMENTS: u64 = 1 << 16;

/// The type of a component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u64) -> Option<Component> {
        Some(match code {
            5120 => Component::I8,
            5121 => Component::U8,
            5122 => Component::I16,
            5123 => Component::U16,
            5125 => Component::U32,
            5126 => Component::F32,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Component::I8 | Component::U8 => 1,
            Component::I16 | Component::U16 => 2,
            Component::U32 | Component::F32 => 4,
        }
    }

    /// The value that stands for 1 in a normalised number.
    fn unit(self) -> f64 {
        match self {
            Component::I8 => 127.0,
            Component::U8 => 255.0,
            Component::I16 => 32767.0,
            Component::U16 => 65535.0,
            Component::U32 => f64::from(u32::MAX),
            Component::F32 => 1.0,
        }
    }

    /// The number in the first bytes, which are there.
    fn number(self, bytes: &[u8]) -> f64 {
        match (self, bytes) {
            (Component::I8, [a, ..]) => f64::from(*a as i8),
            (Component::U8, [a, ..]) => f64::from(*a),
            (Component::I16, [a, b, ..]) => f64::from(i16::from_le_bytes([*a, *b])),
            (Component::U16, [a, b, ..]) => f64::from(u16::from_le_bytes([*a, *b])),
            (Component::U32, [a, b, c, d, ..]) => f64::from(u32::from_le_bytes([*a, *b, *c, *d])),
            (Component::F32, [a, b, c, d, ..]) => f64::from(f32::from_le_bytes([*a, *b, *c, *d])),
            _ => 0.0,
        }
    }
}

/// What an element is made of.
#[derive(Debug, Clone, Copy)]
struct Layout {
    component: Component,
    /// Components of an element.
    width: usize,
    normalized: bool,
}

impl Layout {
    fn bytes(self) -> usize {
        self.component.bytes() * self.width
    }

    fn element<const N: usize>(self, bytes: &[u8], default: [f64; N]) -> [f64; N] {
        let mut value = default;
        let size = self.component.bytes();
        for (to, from) in value
            .iter_mut()
            .zip(bytes.chunks_exact(size))
            .take(self.width)
        {
            *to = self.component.number(from);
            if self.normalized {
                // The lowest signed number would fall below -1 (glTF 2.0, section 3.6.2.2).
                *to = (*to / self.component.unit()).max(-1.0);
            }
        }
        value
    }
}

/// Reads accessors of a document.
pub struct Reader<'a> {
    /// Accessors and views.
    pub document: &'a Document,
    /// Bytes of the buffers.
    pub buffers: Buffers<'a>,
}

impl<'a> Reader<'a> {
    /// The elements of an accessor as vectors of N numbers, of which the accessor may hold any
    /// number of components in `widths`; the others are as in `default`.
    ///
    /// Everything is checked against the bytes that are there before room is made.
    pub fn vectors<const N: usize>(
        &mut self,
        index: usize,
        widths: std::ops::RangeInclusive<usize>,
        default: [f64; N],
    ) -> Result<Vec<[f64; N]>, Refusal> {
        let (accessor, layout) = self.layout(index)?;
        if !widths.contains(&layout.width) || layout.width > N {
            return Err(Fault::element(
                "accessor",
                index,
                format!(
                    "is of type {}, which has no use here",
                    excerpt(&accessor.kind)
                ),
            )
            .into());
        }
        let mut values = self.elements(index, accessor, layout, |bytes| {
            layout.element(bytes, default)
        })?;
        if let Some(sparse) = &accessor.sparse {
            let places = self.sparse_places(index, sparse, accessor.count)?;
            let bytes = self.strip(
                index,
                sparse.values.buffer_view,
                sparse.values.byte_offset,
                None,
                layout.bytes(),
                sparse.count,
            )?;
            let elements = bytes.chunks_exact(layout.bytes());
            for (place, bytes) in places.into_iter().zip(elements) {
                values[place] = layout.element(bytes, default);
            }
        }
        Ok(values)
    }

    /// The elements of an accessor of unsigned integers.
    pub fn indices(&mut self, index: usize) -> Result<Vec<u32>, Refusal> {
        let (accessor, layout) = self.layout(index)?;
        let fits = layout.width == 1
            && matches!(
                layout.component,
                Component::U8 | Component::U16 | Component::U32
            );
        if !fits || accessor.sparse.is_some() {
            return Err(Fault::element(
                "accessor",
                index,
                format!(
                    "holds {} of component type {}, but indices are plain unsigned scalars",
                    excerpt(&accessor.kind),
                    accessor.component_type
                ),
            )
            .into());
        }
        self.elements(index, accessor, layout, |bytes| {
            layout.component.number(bytes) as u32
        })
    }

    fn layout(&self, index: usize) -> Result<(&'a Accessor, Layout), Refusal> {
        let all = &self.document.accessors;
        let accessor = all.get(index).ok_or_else(|| {
            Fault::element(
                "accessor",
                index,
                format!("is referred to, but there are {}", all.len()),
            )
        })?;
        let component = Component::of(accessor.component_type).ok_or_else(|| {
            Fault::element(
                "accessor",
                index,
                format!("component type {} is none", accessor.component_type),
            )
        })?;
        let width = match accessor.kind.as_str() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" | "MAT2" => 4,
            "MAT3" => 9,
            "MAT4" => 16,
            other => {
                let problem = format!("type {:?} is none", excerpt(other));
                return Err(Fault::element("accessor", index, problem).into());
            }
        };
        let layout = Layout {
            component,
            width,
            normalized: accessor.normalized,
        };
        Ok((accessor, layout))
    }

    /// The elements without the sparse ones; zeros where there is no buffer view.
    fn elements<T: Clone>(
        &mut self,
        index: usize,
        accessor: &Accessor,
        layout: Layout,
        element: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, Refusal> {
        let size = layout.bytes();
        let Some(view) = accessor.buffer_view else {
            if accessor.sparse.is_none() {
                // Zeros by the letter; in files that exist, the data is in an extension.
                let problem = "has no data: neither a bufferView nor sparse values";
                return Err(Fault::element("accessor", index, problem).into());
            }
            let most = BARE_ELEMENTS.max(self.buffers.file_bytes());
            if accessor.count > most {
                return Err(Fault::element(
                    "accessor",
                    index,
                    format!(
                        "{} elements of zeros without a bufferView, but at most {most} are read",
                        accessor.count
                    ),
                )
                .into());
            }
            return Ok(vec![element(&vec![0; size]); accessor.count as usize]);
        };
        let stride = self
            .document
            .buffer_views
            .get(view)
            .and_then(|v| v.byte_stride);
        let bytes = self.strip(
            index,
            view,
            accessor.byte_offset,
            stride,
            size,
            accessor.count,
        )?;
        let step = stride.map_or(size, |s| usize::try_from(s).unwrap_or(usize::MAX));
        Ok(bytes.chunks(step).map(element).collect())
    }

    /// The elements that sparse values replace, in increasing order.
    fn sparse_places(
        &mut self,
        index: usize,
        sparse: &Sparse,
        count: u64,
    ) -> Result<Vec<usize>, Refusal> {
        let fault = |problem: String| Fault::element("accessor", index, problem);
        let from = &sparse.indices;
        let component = Component::of(from.component_type)
            .filter(|c| matches!(c, Component::U8 | Component::U16 | Component::U32))
            .ok_or_else(|| {
                fault(format!(
                    "sparse indices of component type {}, which is not unsigned",
                    from.component_type
                ))
            })?;
        let size = component.bytes();
        let bytes = self.strip(
            index,
            from.buffer_view,
            from.byte_offset,
            None,
            size,
            sparse.count,
        )?;
        let places: Vec<usize> = bytes
            .chunks_exact(size)
            .map(|bytes| component.number(bytes) as usize)
            .collect();
        match places.iter().find(|p| **p as u64 >= count) {
            Some(place) => Err(fault(format!(
                "a sparse value for element {place}, but there are {count}"
            ))
            .into()),
            None => Ok(places),
        }
    }

    /// The bytes from the first of `count` elements to the end of the last.
    fn strip(
        &mut self,
        index: usize,
        view: usize,
        offset: u64,
        stride: Option<u64>,
        size: usize,
        count: u64,
    ) -> Result<&[u8], Refusal> {
        let fault = |problem: String| Fault::element("accessor", index, problem);
        let views = &self.document.buffer_views;
        let about = views.get(view).ok_or_else(|| {
            fault(format!(
                "refers to bufferView {view}, but there are {}",
                views.len()
            ))
        })?;
        let step = stride.unwrap_or(size as u64);
        if step < size as u64 {
            return Err(fault(format!(
                "elements of {size} bytes, but bufferView {view} has a stride of {step}"
            ))
            .into());
        }
        if count == 0 {
            return Ok(&[]);
        }
        let length = u128::from(step) * u128::from(count - 1) + size as u128;
        if u128::from(offset) + length > u128::from(about.byte_length) {
            return Err(fault(format!(
                "{count} elements from byte {offset} on end at byte {} of bufferView {view}, which has {}",
                u128::from(offset) + length,
                about.byte_length
            )).into());
        }
        let buffer = self.buffers.get(about.buffer)?;
        let end = u128::from(about.byte_offset) + u128::from(about.byte_length);
        if end > buffer.len() as u128 {
            return Err(Fault::element(
                "bufferView",
                view,
                format!(
                    "ends at byte {end} of buffer {}, which has {}",
                    about.buffer,
                    buffer.len()
                ),
            )
            .into());
        }
        // Both are within the buffer now, so they fit.
        let start = (about.byte_offset + offset) as usize;
        Ok(&buffer[start..start + length as usize])
    }
}
