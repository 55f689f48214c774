//! Where a vertex may go.
//!
//! All offsets are from the middle of the vertex's edge, in voxels along the axes of the grid.

use crate::numeric::vector::{Vec3, scale};
use crate::trade::named;
use schemars::JsonSchema;
use serde::Serialize;

/// Share by which a region is kept smaller than the one in which no voxel's centre is passed: a
/// centre is never touched.
pub const STRICT: f64 = 1e-6;

/// The region that a vertex may not leave.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Constraint {
    /// The octahedron of half a voxel around its first place. No voxel changes sides.
    Diamond,
    /// Its edge, from one voxel's centre to the next. No voxel changes sides.
    CellEdge,
    /// The cell in whose centre it starts, for the dual surface, which has a vertex for each cell and
    /// not for each edge. No voxel changes sides.
    CellCenter,
    /// The box of a voxel around its first place.
    CellSize,
}
named!(Constraint { Diamond = "diamond", CellEdge = "cell-edge", CellCenter = "cell-center", CellSize = "cell-size" });

impl Constraint {
    /// Whether no voxel's centre can change sides while every vertex stays in its region.
    pub const fn is_faithful(self) -> bool {
        !matches!(self, Constraint::CellSize)
    }
}

/// The region of one vertex.
#[derive(Debug, Clone, Copy)]
pub struct Region {
    /// Its shape.
    pub constraint: Constraint,
    /// Half of the shape's extent, in voxels.
    pub reach: f64,
    /// The axis of the vertex's edge.
    pub axis: usize,
    /// 1 where the outside lies up along the axis, -1 where it lies down.
    pub outward: f64,
    /// How far it may go inwards along its edge, in voxels.
    pub inward: f64,
    /// The components that may not change.
    pub fixed: [bool; 3],
}

impl Region {
    /// The offset clipped towards the middle of the region: along the line there, for a diamond;
    /// component by component, for the others (card of the method; a vector clipped as a whole keeps
    /// more volume than the paper's figures).
    pub fn clip(&self, offset: Vec3) -> Vec3 {
        let mut v = offset;
        for a in 0..3 {
            if self.fixed[a] {
                v[a] = 0.0;
            }
        }
        match self.constraint {
            Constraint::Diamond => {
                let sum = v[0].abs() + v[1].abs() + v[2].abs();
                if sum > self.reach {
                    v = self.within(scale(v, self.reach / sum));
                }
            }
            Constraint::CellEdge => {
                for a in 0..3 {
                    v[a] = if a == self.axis {
                        v[a].clamp(-self.reach, self.reach)
                    } else {
                        0.0
                    };
                }
            }
            Constraint::CellSize | Constraint::CellCenter => {
                v = v.map(|c| c.clamp(-self.reach, self.reach));
            }
        }
        let inward = -self.outward * v[self.axis];
        if inward > self.inward {
            v = scale(v, self.inward / inward);
        }
        v
    }

    /// An offset whose sum is over the reach by its rounding alone, brought back.
    fn within(&self, mut v: Vec3) -> Vec3 {
        while v[0].abs() + v[1].abs() + v[2].abs() > self.reach {
            v = scale(v, 1.0 - f64::EPSILON);
        }
        v
    }

    /// The closest point of the region, where a component `a` weighs `metric[a]` per voxel.
    pub fn project(&self, offset: Vec3, metric: Vec3) -> Vec3 {
        if self.constraint != Constraint::Diamond {
            return self.clip(offset);
        }
        let mut v = offset;
        for a in 0..3 {
            if self.fixed[a] {
                v[a] = 0.0;
            }
        }
        self.clip(closest_in_diamond(v, metric, self.reach))
    }
}

/// The point closest to `v` in the octahedron of half-extent `reach`, in voxels, where lengths along
/// axis `a` weigh `metric[a]`.
///
/// All components shrink by a multiplier over their metric squared; it is the largest of those that
/// some components alone would ask for.
fn closest_in_diamond(v: Vec3, metric: Vec3, reach: f64) -> Vec3 {
    let size = v.map(f64::abs);
    if size[0] + size[1] + size[2] <= reach {
        return v;
    }
    let give = metric.map(|m| 1.0 / (m * m));
    let mut most: f64 = 0.0;
    for subset in 1..8usize {
        let mut excess = -reach;
        let mut total = 0.0;
        for a in 0..3 {
            if subset >> a & 1 == 1 {
                excess += size[a];
                total += give[a];
            }
        }
        most = most.max(excess / total);
    }
    std::array::from_fn(|a| (size[a] - most * give[a]).max(0.0).copysign(v[a]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;

    fn region(constraint: Constraint) -> Region {
        Region {
            constraint,
            reach: 0.5 * (1.0 - STRICT),
            axis: 1,
            outward: 1.0,
            inward: 1.0,
            fixed: [false; 3],
        }
    }

    #[test]
    fn clipped_offsets_are_exactly_within() {
        let mut rng = Rng::new(1, 0);
        let region = region(Constraint::Diamond);
        for _ in 0..100_000 {
            let v = [(); 3].map(|()| rng.range(-2.0, 2.0));
            for w in [region.clip(v), region.project(v, [1.0, 1.0, 3.0])] {
                assert!(w[0].abs() + w[1].abs() + w[2].abs() <= region.reach);
            }
        }
    }

    #[test]
    fn the_closest_point_is_closer_than_any_other() {
        let mut rng = Rng::new(2, 0);
        let region = region(Constraint::Diamond);
        for metric in [[1.0; 3], [1.0, 1.0, 5.0], [0.1, 3.0, 1.0]] {
            for _ in 0..300 {
                let v = [(); 3].map(|()| rng.range(-2.0, 2.0));
                let far = |w: Vec3| {
                    (0..3)
                        .map(|a| (metric[a] * (w[a] - v[a])).powi(2))
                        .sum::<f64>()
                };
                let best = far(region.project(v, metric));
                for _ in 0..300 {
                    let other = region.clip([(); 3].map(|()| rng.range(-0.6, 0.6)));
                    assert!(best <= far(other) * (1.0 + 1e-5) + 1e-12);
                }
            }
        }
    }
}
