//! What the readers of clouds share.

use super::refusal::{RAISE, Refusal, expect_room};
use crate::error::Fault;
use crate::mesh::Mesh;
use crate::report::{Tally, Warning};

/// The way out where a point has a coordinate that is none.
pub const SKIP: &str = "commands that have --skip-bad leave such points out with it";

/// Vertices are numbered with 32 bits, and take memory: errs where a file states too many of them.
///
/// `row` is the number of bytes that one takes while it is read.
pub fn expect_points(count: u64, row: usize, limit: u64) -> Result<(), Refusal> {
    if u32::try_from(count).is_err() {
        let most = u32::MAX;
        let problem = format!("holds {count} points, but at most {most} can be held");
        return Err(Fault::whole(problem).into());
    }
    let needed = u128::from(count) * row as u128;
    expect_room(|| format!("reading {count} points"), needed, limit, RAISE)
}

/// Bytes of a point with its attributes.
pub fn bytes_of(normals: bool, colors: bool, classes: bool) -> usize {
    let some = |has: bool, bytes: usize| if has { bytes } else { 0 };
    let point = size_of::<[f64; 3]>() + size_of::<u32>();
    point + some(normals, 24) + some(colors, 16) + some(classes, 1)
}

/// The cloud of all vertices of a mesh that has nothing but vertices yet. Errs where there is none.
pub fn of_all(mut mesh: Mesh) -> Result<Mesh, Fault> {
    if mesh.positions.is_empty() {
        return Err(Fault::whole("holds no points"));
    }
    mesh.points = (0..mesh.positions.len() as u32).collect();
    Ok(mesh)
}

/// Leaves out the points of a cloud that have a coordinate, or a component of their normal or colour,
/// which is not finite; a warning counts them and names the first.
pub fn skip_bad(cloud: &mut Mesh, warnings: &mut Vec<Warning>) {
    let is_whole = |values: &[f64]| values.iter().all(|v| v.is_finite());
    let mut skipped = Tally::default();
    let keeps: Vec<bool> = (0..cloud.positions.len())
        .map(|v| {
            let normal = cloud.normals.as_ref().map(|normals| normals[v]);
            let color = cloud.colors.as_ref().map(|colors| colors[v]);
            let keeps = is_whole(&cloud.positions[v])
                && normal.is_none_or(|normal| is_whole(&normal))
                && color.is_none_or(|color| is_whole(&color.map(f64::from)));
            if !keeps {
                skipped.note(v as u64);
            }
            keeps
        })
        .collect();
    if skipped.is_empty() {
        return;
    }
    retain(&mut cloud.positions, &keeps);
    if let Some(normals) = &mut cloud.normals {
        retain(normals, &keeps);
    }
    if let Some(colors) = &mut cloud.colors {
        retain(colors, &keeps);
    }
    if let Some(classes) = &mut cloud.classes {
        retain(classes, &keeps);
    }
    cloud.points.truncate(cloud.positions.len());
    let message = "points with a number that is not finite; left out";
    skipped.warn("skipped-points", message, warnings);
}

/// Classes as numbers, where all of them are whole and fit a byte; else none, with a counted warning.
pub fn classes(values: &[f64], warnings: &mut Vec<Warning>) -> Option<Vec<u8>> {
    let mut none = Tally::default();
    for (v, value) in (0u64..).zip(values) {
        if f64::from(*value as u8) != *value {
            none.note(v);
        }
    }
    if none.is_empty() {
        return Some(values.iter().map(|value| *value as u8).collect());
    }
    let message = "classes that are no whole number from 0 to 255; none is read";
    none.warn("unknown-classes", message, warnings);
    None
}

fn retain<T>(values: &mut Vec<T>, keeps: &[bool]) {
    let mut keeps = keeps.iter();
    values.retain(|_| keeps.next().is_some_and(|keeps| *keeps));
}

/// A byte of colour as a share of 1.
pub fn from_byte(byte: u8) -> f32 {
    (f64::from(byte) / 255.0) as f32
}

/// The nearest byte of a share of 1.
pub fn to_byte(channel: f32) -> u8 {
    (channel * 255.0).round() as u8
}

/// Whether a colour is made of whole 255ths.
pub fn is_of_bytes(color: &[f32]) -> bool {
    let is_whole = |c: &f32| from_byte(to_byte(*c)).to_bits() == c.to_bits();
    color.iter().all(is_whole)
}

/// How many colours are not whole bytes, and the first of them.
pub fn rounded_colors(mesh: &Mesh) -> (u64, Option<u64>) {
    let colors = mesh.colors.iter().flatten();
    let mut rounded = (0u64..)
        .zip(colors)
        .filter(|(_, color)| !is_of_bytes(&color[..]));
    let first = rounded.next().map(|(v, _)| v);
    (first.map_or(0, |_| 1) + rounded.count() as u64, first)
}

/// Warns of fields that are not read, by their names.
pub fn warn_of_ignored(names: &[String], warnings: &mut Vec<Warning>) {
    const SHOWN: usize = 12;
    if names.is_empty() {
        return;
    }
    let more = if names.len() > SHOWN { ", ..." } else { "" };
    let list = names[..names.len().min(SHOWN)].join(", ");
    let message = format!("properties that are not read: {list}{more}");
    let count = names.len() as u64;
    warnings.push(Warning::new("ignored-properties", message, count, None));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_that_are_none_are_left_out_with_what_they_carry() {
        let nan = f64::NAN;
        let mut cloud = of_all(Mesh {
            positions: vec![[0.0; 3], [1.0, nan, 0.0], [2.0; 3], [3.0; 3]],
            normals: Some(vec![[1.0, 0.0, 0.0], [0.0; 3], [nan; 3], [0.0, 0.0, 1.0]]),
            colors: Some((0..4).map(|i| [i as f32; 4]).collect()),
            classes: Some(vec![1, 2, 3, 4]),
            ..Mesh::default()
        })
        .expect("points");
        let mut warnings = Vec::new();
        skip_bad(&mut cloud, &mut warnings);
        assert_eq!(cloud.positions, [[0.0; 3], [3.0; 3]]);
        assert_eq!(cloud.normals, Some(vec![[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]));
        assert_eq!(cloud.colors, Some(vec![[0.0; 4], [3.0; 4]]));
        assert_eq!(cloud.classes, Some(vec![1, 4]));
        assert!(cloud.is_cloud() && cloud.check().is_ok());
        assert_eq!((warnings[0].count, warnings[0].first), (2, Some(1)));
    }

    #[test]
    fn too_many_points_are_refused_before_room_is_made() {
        let said = |count, limit| expect_points(count, 28, limit).expect_err("refused");
        assert!(matches!(
            said(100, 2799),
            Refusal::OverMemory { needed: 2800, .. }
        ));
        let fault = said(1 << 32, u64::MAX).fault().to_string();
        assert_eq!(
            fault,
            "holds 4294967296 points, but at most 4294967295 can be held"
        );
        assert!(expect_points(100, 28, 2800).is_ok());
    }
}
