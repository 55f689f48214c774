//! Where a NRRD header puts its samples.

use super::header::Header;
use crate::error::Fault;
use crate::io::header::{Field, excerpt};
use crate::numeric::vector::{Vec3, cross, normalize};
use crate::volume::Frame;

/// The three axes of a grid, before it is known that they can be held.
#[derive(Debug)]
pub struct Layout {
    /// Samples along x, y, z.
    pub dims: [u64; 3],
    origin: Vec3,
    axes: [Vec3; 3],
}

impl Layout {
    /// The frame, of dims that were found to fit.
    pub fn frame(&self, dims: [usize; 3]) -> Frame {
        Frame {
            dims,
            origin: self.origin,
            axes: self.axes,
        }
    }
}

/// Reads sizes and placement: `space directions` and `space origin`, else `spacings` and `axis mins`.
pub fn layout(header: &Header) -> Result<Layout, Fault> {
    let sizes = header.sizes()?;
    let count = sizes.len();
    // The first axis of four holds the components of a sample; only one component is a grid of numbers.
    let first = count.saturating_sub(3);
    if first == 1 && sizes[0] != 1 {
        return Err(Fault::whole(format!(
            "4 axes of {sizes:?}: the first holds {} values per voxel, but one is read",
            sizes[0]
        )));
    }
    let mut dims = [1; 3];
    for (to, from) in dims.iter_mut().zip(&sizes[first..]) {
        *to = *from;
    }
    let (origin, axes) = match header.get("spacedirections") {
        Some(field) => placed(header, field, count, first)?,
        None => spaced(header, &sizes, first)?,
    };
    Ok(Layout { dims, origin, axes })
}

/// By direction vectors.
fn placed(
    header: &Header,
    field: &Field,
    count: usize,
    first: usize,
) -> Result<(Vec3, [Vec3; 3]), Fault> {
    let found = vectors(field)?;
    if found.len() != count {
        return Err(field.fault(format!("{} vectors for {count} axes", found.len())));
    }
    let mut axes = [[0.0, 0.0, 1.0]; 3];
    for (axis, vector) in found[first..].iter().enumerate() {
        axes[axis] =
            vector.ok_or_else(|| field.fault(format!("axis {} has no direction", axis + first)))?;
    }
    if count == 2 {
        axes[2] = normalize(cross(axes[0], axes[1]));
    }
    let origin = match header.get("spaceorigin") {
        Some(field) => match vectors(field)?.as_slice() {
            [Some(origin)] => *origin,
            other => {
                return Err(field.fault(format!("{} vectors, but one is needed", other.len())));
            }
        },
        None => [0.0; 3],
    };
    Ok((origin, axes))
}

/// By spacing and smallest coordinate along each axis.
fn spaced(header: &Header, sizes: &[u64], first: usize) -> Result<(Vec3, [Vec3; 3]), Fault> {
    let count = sizes.len();
    let numbers = |name: &str| -> Result<Vec<f64>, Fault> {
        match header.get(name) {
            Some(field) => field.list(count, "a number"),
            None => Ok(vec![f64::NAN; count]),
        }
    };
    let spacings = numbers("spacings")?;
    let mins = numbers("axismins")?;
    let maxs = numbers("axismaxs")?;
    let cells: Vec<bool> = match header.get("centers") {
        Some(field) => {
            let words: Vec<String> = field.list(count, "a centering")?;
            words.iter().map(|word| word == "cell").collect()
        }
        None => vec![false; count],
    };
    let mut origin = [0.0; 3];
    let mut axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for axis in first..count {
        // Samples at the middle of cells span as many steps as there are samples, others one less.
        let steps = sizes[axis] as f64 - if cells[axis] { 0.0 } else { 1.0 };
        let between = (maxs[axis] - mins[axis]) / steps;
        let step = [spacings[axis], between]
            .into_iter()
            .find(|s| s.is_finite())
            .unwrap_or(1.0);
        let to = axis - first;
        axes[to][to] = step;
        if mins[axis].is_finite() {
            origin[to] = mins[axis] + if cells[axis] { 0.5 * step } else { 0.0 };
        }
    }
    if let (None, Some(field)) = (header.get("axismins"), header.get("spaceorigin"))
        && let [Some(placed)] = vectors(field)?.as_slice()
    {
        origin = *placed;
    }
    Ok((origin, axes))
}

/// The vectors `(a,b,c)` of a field, `none` as `None`. Vectors of a plane get a third component of 0.
fn vectors(field: &Field) -> Result<Vec<Option<Vec3>>, Fault> {
    let mut found = Vec::new();
    let mut rest = field.text.as_str();
    while !rest.is_empty() {
        if let Some(after) = rest.strip_prefix("none") {
            found.push(None);
            rest = after.trim_start();
            continue;
        }
        let inside = rest.strip_prefix('(').and_then(|r| r.split_once(')'));
        let Some((inside, after)) = inside else {
            return Err(field.fault(format!("{:?} is not a vector", excerpt(rest))));
        };
        let mut vector = [0.0; 3];
        let parts: Vec<_> = inside.split(',').map(str::trim).collect();
        if !(2..=3).contains(&parts.len()) {
            return Err(field.fault(format!(
                "the vector ({}) has {} components, but 2 or 3 are read",
                excerpt(inside),
                parts.len()
            )));
        }
        for (to, part) in vector.iter_mut().zip(&parts) {
            *to = part
                .parse()
                .map_err(|_| field.fault(format!("{:?} is not a number", excerpt(part))))?;
        }
        found.push(Some(vector));
        rest = after.trim_start();
    }
    Ok(found)
}
