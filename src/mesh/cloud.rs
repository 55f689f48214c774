//! What is in a cloud, and what looks wrong with it.

use super::Mesh;
use super::identify::identify;
use super::topology::Found;
use crate::error::{Error, Result};
use crate::report::Warning;
use schemars::JsonSchema;
use serde::Serialize;

/// What the points of a cloud carry, and which of them look wrong.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CloudInventory {
    /// Points, duplicates and all.
    pub points: u64,
    /// Points at the place of an earlier one, to the bit.
    pub duplicate_points: Found,
    /// Whether points have normals.
    pub normals: bool,
    /// Normals that are 0: they point nowhere.
    pub zero_normals: Found,
    /// Normals whose length is not 1 to a thousandth, those that are 0 left out.
    pub long_or_short_normals: Found,
    /// Whether points have colours.
    pub colours: bool,
    /// How many points each class has, by rising number; empty without classes.
    pub classes: Vec<ClassCount>,
    /// Smallest and largest coordinates: `[[x, y, z], [x, y, z]]`, null where there is no point.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// The diagonal of those, in the file's unit; null where it overflows or there is no point.
    pub diagonal: Option<f64>,
}

/// How many points a class has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ClassCount {
    /// Its number, as LAS has them: 2 is ground, 6 is a building.
    pub class: u8,
    /// How many points are of it.
    pub points: u64,
}

impl CloudInventory {
    /// What looks wrong, as warnings for a report.
    pub fn warnings(&self) -> Vec<Warning> {
        let kinds = [
            (
                "duplicate-points",
                "points at the place of an earlier one",
                self.duplicate_points,
            ),
            (
                "long-or-short-normals",
                "normals that are not of unit length",
                self.long_or_short_normals,
            ),
        ];
        let kinds = kinds.into_iter().filter(|(_, _, found)| found.count > 0);
        let warnings =
            kinds.map(|(code, what, found)| Warning::new(code, what, found.count, found.first));
        warnings.collect()
    }
}

/// Finds what is in a cloud; indices are those of its points, from 0.
///
/// Errs when the cloud is not what [`Mesh::check`] promises. Cost: O(n log n), 12 bytes per point.
pub fn inventory(cloud: &Mesh) -> Result<CloudInventory> {
    cloud.check().map_err(Error::Geometry)?;
    let same = identify(&cloud.positions);
    let duplicates = same.iter().zip(0u32..).map(|(same, v)| *same != v);
    let square = |n: &[f64; 3]| n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    let normals = cloud.normals.as_deref().unwrap_or_default();
    let bounds = cloud.bounds();
    let [lo, hi] = [bounds.lo, bounds.hi];
    let diagonal = [0, 1, 2].map(|axis| hi[axis] - lo[axis]);
    let diagonal = diagonal[0].hypot(diagonal[1]).hypot(diagonal[2]);
    Ok(CloudInventory {
        points: cloud.positions.len() as u64,
        duplicate_points: found(duplicates),
        normals: cloud.normals.is_some(),
        zero_normals: found(normals.iter().map(|n| *n == [0.0; 3])),
        long_or_short_normals: found(
            normals
                .iter()
                .map(|n| *n != [0.0; 3] && (square(n).sqrt() - 1.0).abs() > 1e-3),
        ),
        colours: cloud.colors.is_some(),
        classes: counts(cloud.classes.as_deref().unwrap_or_default()),
        bounds: (!bounds.is_empty()).then_some([lo, hi]),
        diagonal: Some(diagonal).filter(|d| d.is_finite() && !bounds.is_empty()),
    })
}

/// How many are true, and the first.
fn found(all: impl Iterator<Item = bool>) -> Found {
    let mut found = Found::default();
    for (index, _) in (0u64..).zip(all).filter(|(_, is_it)| *is_it) {
        found.count += 1;
        found.first = found.first.or(Some(index));
    }
    found
}

fn counts(classes: &[u8]) -> Vec<ClassCount> {
    let mut points = [0u64; 256];
    for class in classes {
        points[usize::from(*class)] += 1;
    }
    let counts = (0u8..=255).zip(points).filter(|(_, points)| *points > 0);
    counts
        .map(|(class, points)| ClassCount { class, points })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_looks_wrong_is_counted_with_the_first() {
        let cloud = Mesh {
            positions: vec![[0.0; 3], [1.0, 2.0, 2.0], [-0.0, 0.0, 0.0], [1.0, 2.0, 2.0]],
            points: vec![0, 1, 2, 3],
            normals: Some(vec![
                [0.0; 3],
                [0.0, 0.6, 0.8],
                [0.0, 0.0, 1.01],
                [1.0, 0.0, 0.0],
            ]),
            classes: Some(vec![6, 2, 2, 255]),
            ..Mesh::default()
        };
        let inventory = inventory(&cloud).expect("a cloud");
        let found = |count, first| Found {
            count,
            first: Some(first),
        };
        assert_eq!(inventory.duplicate_points, found(2, 2));
        assert_eq!(inventory.zero_normals, found(1, 0));
        assert_eq!(inventory.long_or_short_normals, found(1, 2));
        let classes: Vec<_> = inventory
            .classes
            .iter()
            .map(|c| (c.class, c.points))
            .collect();
        assert_eq!(classes, [(2, 2), (6, 1), (255, 1)]);
        assert_eq!(inventory.diagonal, Some(3.0));
        let codes: Vec<_> = inventory.warnings().into_iter().map(|w| w.code).collect();
        assert_eq!(codes, ["duplicate-points", "long-or-short-normals"]);
    }
}
