//! Discs with a field of normals: scantle's own PLY, which keeps every bit, and the PLY of 3D Gaussians
//! that viewers of splats open.

mod disc;
mod gaussian;
mod own;
#[cfg(test)]
mod tests;

pub use disc::discs;
pub use gaussian::{read as read_gaussians, write as write_gaussians};
pub use own::{read, write};

use super::format::Format;
use super::ply;
use crate::error::Fault;
use crate::numeric::vector::{Vec3, dot, length};
use crate::points::Splats;
use crate::report::Content;

/// How far from unit length, and from a right angle, the vectors of a splat may be.
const UNIT: f64 = 1e-3;

/// Which kind of splats a PLY file holds, if any: told by the properties of its vertices.
pub fn kind_of(bytes: &[u8]) -> Option<Format> {
    let names = ply::vertex_properties(bytes);
    let has = |wanted: &[&str]| wanted.iter().all(|name| names.iter().any(|n| n == name));
    if has(&["radius", "kappa_u"]) {
        Some(Format::Splats)
    } else if has(&["scale_0", "rot_0"]) {
        Some(Format::Gaussians)
    } else {
        None
    }
}

/// Counts and bounds for a report.
pub fn content(splats: &Splats) -> Content {
    let bounds = splats.bounds();
    Content {
        splats: Some(splats.splats.len() as u64),
        bounds: (!bounds.is_empty()).then_some([bounds.lo, bounds.hi]),
        ..Content::default()
    }
}

/// What both readers promise: finite numbers, radii and errors that are not negative, normals and tangents
/// of unit length at right angles, attributes of one length. Cost: linear.
pub fn check(splats: &Splats) -> Result<(), Fault> {
    for (index, splat) in splats.splats.iter().enumerate() {
        let fault = |problem: String| Err(Fault::element("splat", index, problem));
        let vectors = [splat.centre, splat.normal, splat.tangent, splat.field];
        let [u, v] = splat.slopes;
        let numbers = [splat.radius, splat.error, u, v];
        if !vectors
            .as_flattened()
            .iter()
            .chain(&numbers)
            .all(|c| c.is_finite())
        {
            return fault("has a number that is not finite".to_owned());
        }
        if splat.radius < 0.0 {
            return fault(format!("has the radius {}", splat.radius));
        }
        if splat.error < 0.0 {
            return fault(format!("has the error {}", splat.error));
        }
        let is_unit = |vector: Vec3| (length(vector) - 1.0).abs() <= UNIT;
        for (what, vector) in [("normal", splat.normal), ("tangent", splat.tangent)] {
            if !is_unit(vector) {
                return fault(format!("has a {what} of length {}", length(vector)));
            }
        }
        let slant = dot(splat.normal, splat.tangent);
        if slant.abs() > UNIT {
            return fault(format!("has a tangent that leaves its plane by {slant}"));
        }
    }
    let count = splats.splats.len();
    let colors = splats.colors.as_ref().map(Vec::len);
    let classes = splats.classes.as_ref().map(Vec::len);
    for (what, length) in [("colours", colors), ("classes", classes)] {
        if let Some(length) = length.filter(|length| *length != count) {
            return Err(Fault::whole(format!("{length} {what} for {count} splats")));
        }
    }
    Ok(())
}
