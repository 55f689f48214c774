//! Areas as closed polyhedra through the terrain.

use crate::numeric::vector::Vec3;
use crate::terrain::pyramid::{Found, Meets, Pyramid};
use crate::terrain::surface::Surface;
use crate::vector::Vec2;
use crate::vector::rings::{edges, winding};

/// Rings that share their caps, extruded.
///
/// Sides are two triangles for each edge; a cap is a fan of each ring from its first vertex, whose triangles
/// cancel where they leave the ring (Schneider and Klein 2007, section 4.2.1): 4 k - 4 triangles for a ring of
/// k vertices, whatever the terrain.
#[derive(Debug, Clone, PartialEq)]
pub struct Polyhedron {
    /// Rings on the map in local coordinates, outer ones counter-clockwise.
    pub rings: Vec<Vec<Vec2>>,
    /// Local heights of the caps.
    pub caps: [f64; 2],
}

/// A triangle of a polyhedron, counter-clockwise from outside, with its outward normal, not of unit length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Face {
    /// Corners.
    pub corners: [Vec3; 3],
    /// Exactly level or upright.
    pub normal: Vec3,
}

impl Polyhedron {
    /// How many triangles it has.
    pub fn triangles(&self) -> u64 {
        let of = |ring: &Vec<Vec2>| (4 * ring.len() as u64).saturating_sub(4);
        self.rings.iter().map(of).sum()
    }

    /// The box around it.
    pub fn bounds(&self) -> crate::spatial::aabb::Aabb {
        let mut bounds = crate::spatial::aabb::Aabb::EMPTY;
        for p in self.rings.iter().flatten() {
            for z in self.caps {
                bounds = bounds.with([p[0], p[1], z]);
            }
        }
        bounds
    }

    /// Calls with each triangle.
    pub fn visit(&self, mut call: impl FnMut(Face)) {
        let [low, high] = self.caps;
        let at = |p: Vec2, z: f64| [p[0], p[1], z];
        for ring in &self.rings {
            for (a, b) in edges(ring) {
                let normal = [b[1] - a[1], a[0] - b[0], 0.0];
                for corners in [
                    [at(a, low), at(b, low), at(b, high)],
                    [at(a, low), at(b, high), at(a, high)],
                ] {
                    call(Face { corners, normal });
                }
            }
            let Some(&pivot) = ring.first() else {
                continue;
            };
            for pair in ring[1..].windows(2) {
                let [a, b] = [pair[0], pair[1]];
                call(Face {
                    corners: [at(pivot, high), at(a, high), at(b, high)],
                    normal: [0.0, 0.0, 1.0],
                });
                call(Face {
                    corners: [at(pivot, low), at(b, low), at(a, low)],
                    normal: [0.0, 0.0, -1.0],
                });
            }
        }
    }
}

/// Edges up to which a polygon's own shape is asked for heights; larger ones take their box.
const SHAPE_EDGES: usize = 512;

/// Heights under rings: over all nodes that their area or border meets.
///
/// `to_lattice` brings local places to the lattice. Conservative. Cost: the nodes along the border, by the edges.
pub fn heights_under(
    rings: &[Vec<Vec2>],
    pyramid: &Pyramid,
    to_lattice: impl Fn(Vec2) -> Vec2,
) -> Found {
    let rings: Vec<Vec<Vec2>> = rings
        .iter()
        .map(|ring| ring.iter().map(|p| to_lattice(*p)).collect())
        .collect();
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for p in rings.iter().flatten() {
        for a in 0..2 {
            low[a] = low[a].min(p[a]);
            high[a] = high[a].max(p[a]);
        }
    }
    // More than the roundings of the way to the lattice.
    let slack = 1e-6;
    let (low, high) = (low.map(|c| c - slack), high.map(|c| c + slack));
    if rings.iter().map(Vec::len).sum::<usize>() > SHAPE_EDGES {
        return pyramid.over_box(low, high);
    }
    pyramid.over(|lo, hi| {
        if (0..2).any(|a| hi[a] < low[a] || high[a] < lo[a]) {
            return Meets::No;
        }
        let (lo, hi) = (lo.map(|c| c - slack), hi.map(|c| c + slack));
        let cut = |(a, b)| crate::terrain::pyramid::segment_meets_box(a, b, lo, hi);
        if rings.iter().flat_map(|ring| edges(ring)).any(cut) {
            return Meets::Partly;
        }
        // No border in the box: all of it is inside, or none.
        match winding(rings.iter().map(Vec::as_slice), lo) {
            0 => Meets::No,
            _ => Meets::Wholly,
        }
    })
}

/// What caps are away from the heights: more than any rounding of them.
pub fn margin(surface: &Surface) -> f64 {
    let [low, high] = surface.range();
    1e-6 * (high - low) + 1e-3 * surface.square_area().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn polyhedra_are_closed_for_any_ring() {
        let rings = [
            vec![[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]],
            vec![[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]],
            vec![[1.0, 1.0], [1.0, 2.0], [2.0, 1.0]],
        ];
        let polyhedron = Polyhedron {
            rings: rings.to_vec(),
            caps: [-1.0, 3.0],
        };
        let mut count: BTreeMap<[[u64; 3]; 2], i32> = BTreeMap::new();
        let (mut triangles, mut volume) = (0, 0.0);
        polyhedron.visit(|face| {
            triangles += 1;
            let [a, b, c] = face.corners;
            volume += crate::numeric::vector::dot(a, crate::numeric::vector::cross(b, c)) / 6.0;
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let key = |p: Vec3| p.map(f64::to_bits);
                *count.entry([key(from), key(to)]).or_default() += 1;
                *count.entry([key(to), key(from)]).or_default() -= 1;
            }
        });
        assert_eq!(triangles, polyhedron.triangles());
        assert_eq!(triangles, 12 + 12 + 8);
        assert!(count.values().all(|sum| *sum == 0));
        // Areas by sign: 4, 0 and -0.5, four high.
        assert!((volume - 4.0 * (4.0 - 0.5)).abs() < 1e-12, "{volume}");
    }
}
