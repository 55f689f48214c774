//! Splats as a mesh, for programs that know triangles alone.

use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::numeric::vector::{add, scale};
use crate::points::Splats;
use std::f64::consts::TAU;

/// The discs as regular polygons of so many sides, split into fans of triangles.
///
/// Corners lie on the rims: each polygon is within its disc, and lacks at most `1 - cos(pi / sides)` of the
/// radius. Every corner has the field's normal there, and the colour and class of its disc. Errs with
/// [`Error::Parameter`] for fewer than three sides and with [`Error::Limit`] where there are 2^32 corners
/// or more. Cost: linear in the corners.
pub fn discs(splats: &Splats, sides: usize) -> Result<Mesh> {
    if sides < 3 {
        return Err(Error::parameter("sides", sides, "a polygon has at least 3"));
    }
    let count = splats.splats.len() as u128 * sides as u128;
    if count > u128::from(u32::MAX) {
        return Err(Error::Limit {
            what: "discs as polygons".into(),
            needed: format!("{count} vertices"),
            limit: format!("{} vertices", u32::MAX),
            hint: None,
        });
    }
    let turns: Vec<[f64; 2]> = (0..sides)
        .map(|side| {
            let (sin, cos) = (side as f64 / sides as f64 * TAU).sin_cos();
            [cos, sin]
        })
        .collect();
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    let mut triangles = Vec::with_capacity(splats.splats.len() * (sides - 2));
    for splat in &splats.splats {
        let first = positions.len() as u32;
        for turn in &turns {
            let [along, across] = turn.map(|share| share * splat.radius);
            let offset = add(
                scale(splat.tangent, along),
                scale(splat.bitangent(), across),
            );
            positions.push(add(splat.centre, offset));
            normals.push(splat.normal_at(along, across));
        }
        triangles.extend((1..sides as u32 - 1).map(|side| [first, first + side, first + side + 1]));
    }
    Ok(Mesh {
        positions,
        triangles,
        normals: Some(normals),
        colors: splats
            .colors
            .as_deref()
            .map(|colors| repeated(colors, sides)),
        classes: splats
            .classes
            .as_deref()
            .map(|classes| repeated(classes, sides)),
        ..Mesh::default()
    })
}

/// Each value so many times.
fn repeated<T: Copy>(values: &[T], times: usize) -> Vec<T> {
    let each = values
        .iter()
        .flat_map(|value| std::iter::repeat_n(*value, times));
    each.collect()
}
