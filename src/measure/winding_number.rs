//! The generalised winding number of a mesh at single points.
//!
//! Solid angles near by, and far away the dipole that a group of triangles looks like. It shares
//! nothing with the fill of `volume::voxelize`, which counts crossings along rows and closes
//! borders by strips: one judges the other. Sources: Jacobson, Kavan, Sorkine-Hornung 2013, "Robust
//! inside-outside segmentation using generalized winding numbers"; Barill, Dickson, Schmidt, Levin,
//! Jacobson 2018, "Fast winding numbers for soups and clouds"; Van Oosterom and Strackee 1983.

use crate::numeric::vector::{Vec3, add, cross, dot, length, scale, sub};
use std::f64::consts::{PI, TAU};

/// Triangles of a leaf.
const LEAF: usize = 8;
/// A group is seen as a dipole from this many times its radius: at a glance, and looking closely.
const FAR: [f64; 2] = [3.0, 12.0];
/// Sums at a glance that are this near to a half are looked at closely.
const DOUBT: f64 = 0.15;
/// A winding number this near to a half, looked at closely, may be on either side of it.
const TIE: f64 = 0.01;

/// Which points are inside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// Winding number above one half.
    Winding,
    /// Winding number that is odd when rounded: behind an odd number of closed surfaces.
    Parity,
}

/// Triangles, grouped.
pub struct WindingNumber {
    triangles: Vec<[Vec3; 3]>,
    nodes: Vec<Node>,
}

struct Node {
    centre: Vec3,
    radius: f64,
    /// Sum of the triangles' normals, each as long as its area.
    area: Vec3,
    first: usize,
    count: usize,
    /// The second child, where the first is the next node; 0 for a leaf.
    second: usize,
}

impl WindingNumber {
    /// Groups triangles. Cost: O(n log^2 n).
    pub fn new(mut triangles: Vec<[Vec3; 3]>) -> Self {
        let mut nodes = Vec::new();
        if !triangles.is_empty() {
            let count = triangles.len();
            group(&mut triangles, 0..count, &mut nodes);
        }
        WindingNumber { triangles, nodes }
    }

    /// Whether a point is inside; `None` where it may be either: its winding number is within 0.01
    /// of a half, or no number. Cost: about O(log n), more near the surface.
    pub fn is_inside(&self, p: Vec3, rule: Rule) -> Option<bool> {
        let from_half = |w: f64| (w - (w.floor() + 0.5)).abs();
        let mut w = self.at(p, FAR[0]);
        if from_half(w) < DOUBT {
            w = self.at(p, FAR[1]);
        }
        if !w.is_finite() || from_half(w) < TIE {
            return None;
        }
        Some(match rule {
            Rule::Winding => w > 0.5,
            Rule::Parity => w.round().rem_euclid(2.0) == 1.0,
        })
    }

    /// The winding number at a point, groups being dipoles from `far` times their radius on.
    fn at(&self, p: Vec3, far: f64) -> f64 {
        let (mut sum, mut at) = (0.0, 0);
        let mut stack = Vec::with_capacity(64);
        while let Some(node) = self.nodes.get(at) {
            let way = sub(node.centre, p);
            let distance = length(way);
            if distance > far * node.radius {
                sum +=
                    dot(node.area, scale(way, 1.0 / distance)) / (distance * distance) / (4.0 * PI);
            } else if node.second == 0 {
                let of = &self.triangles[node.first..node.first + node.count];
                sum += of.iter().map(|t| solid_angle(t, p)).sum::<f64>() / TAU;
            } else {
                stack.push(node.second);
                at += 1;
                continue;
            }
            match stack.pop() {
                Some(next) => at = next,
                None => break,
            }
        }
        sum
    }
}

/// Half the solid angle that a triangle takes up from a point.
fn solid_angle(triangle: &[Vec3; 3], p: Vec3) -> f64 {
    let unit = |q: &Vec3| {
        let way = sub(*q, p);
        scale(way, 1.0 / length(way))
    };
    let [a, b, c] = [unit(&triangle[0]), unit(&triangle[1]), unit(&triangle[2])];
    dot(a, cross(b, c)).atan2(1.0 + dot(a, b) + dot(b, c) + dot(c, a))
}

/// Adds the node of a range of triangles, and those below it.
fn group(triangles: &mut [[Vec3; 3]], range: std::ops::Range<usize>, nodes: &mut Vec<Node>) {
    let (first, count) = (range.start, range.len());
    let part = &mut triangles[range.clone()];
    let middle = |t: &[Vec3; 3]| scale(add(add(t[0], t[1]), t[2]), 1.0 / 3.0);
    let (mut area, mut centre, mut weight) = ([0.0; 3], [0.0; 3], 0.0);
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for t in part.iter() {
        let normal = scale(cross(sub(t[1], t[0]), sub(t[2], t[0])), 0.5);
        let (size, at) = (length(normal), middle(t));
        area = add(area, normal);
        centre = add(centre, scale(at, size));
        weight += size;
        for a in 0..3 {
            (lo[a], hi[a]) = (lo[a].min(at[a]), hi[a].max(at[a]));
        }
    }
    let centre = if weight > 0.0 {
        scale(centre, 1.0 / weight)
    } else {
        scale(add(lo, hi), 0.5)
    };
    let far = part.iter().flatten().map(|q| length(sub(*q, centre)));
    let radius = far.fold(0.0, f64::max);
    let at = nodes.len();
    nodes.push(Node {
        centre,
        radius,
        area,
        first,
        count,
        second: 0,
    });
    if count > LEAF {
        let axis = (0..3)
            .max_by(|a, b| (hi[*a] - lo[*a]).total_cmp(&(hi[*b] - lo[*b])))
            .unwrap_or(0);
        let half = count / 2;
        part.select_nth_unstable_by(half, |a, b| middle(a)[axis].total_cmp(&middle(b)[axis]));
        group(triangles, range.start..range.start + half, nodes);
        nodes[at].second = nodes.len();
        group(triangles, range.start + half..range.end, nodes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::mesh::shapes::{cuboid, icosphere, joined, open_box, torus_knot};
    use crate::numeric::rng::Rng;

    fn of(mesh: &Mesh) -> WindingNumber {
        WindingNumber::new((0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect())
    }

    /// The sum over all triangles.
    fn direct(mesh: &Mesh, p: Vec3) -> f64 {
        let angles = (0..mesh.triangles.len()).map(|t| solid_angle(&mesh.corners(t), p));
        angles.sum::<f64>() / TAU
    }

    #[test]
    fn groups_look_like_their_triangles() {
        let ball = icosphere([0.0; 3], 1.0, 3);
        let shapes = [
            (
                joined(ball.clone(), &icosphere([0.3, 0.0, 0.1], 1.2, 2)),
                2.0,
            ),
            (open_box([-1.0; 3], [1.0; 3]), 2.0),
            (torus_knot(2, 3, 0.4, 96, 24), 4.0),
        ];
        for (mesh, reach) in &shapes {
            let tree = of(mesh);
            for i in 0..2000 {
                let mut rng = Rng::new(7, i);
                let p = [(); 3].map(|()| rng.range(-reach, *reach));
                let w = direct(mesh, p);
                let error = |far| (tree.at(p, far) - w).abs();
                assert!(error(FAR[0]) < DOUBT, "{} at {p:?}", error(FAR[0]));
                assert!(error(FAR[1]) < TIE, "{} at {p:?}", error(FAR[1]));
                for (rule, inside) in [
                    (Rule::Winding, w > 0.5),
                    (Rule::Parity, w.round().abs() % 2.0 == 1.0),
                ] {
                    let found = tree.is_inside(p, rule);
                    assert!(found.is_none_or(|found| found == inside), "{w} at {p:?}");
                }
            }
        }
    }

    #[test]
    fn closed_surfaces_leave_no_point_open() {
        let cube = of(&cuboid([0.0; 3], [1.0; 3]));
        assert_eq!(cube.is_inside([0.5, 0.5, 0.999], Rule::Winding), Some(true));
        assert_eq!(
            cube.is_inside([0.5, 0.5, 1.001], Rule::Winding),
            Some(false)
        );
        let twice = of(&joined(
            cuboid([0.0; 3], [1.0; 3]),
            &cuboid([0.0; 3], [1.0; 3]),
        ));
        assert_eq!(twice.is_inside([0.5; 3], Rule::Winding), Some(true));
        assert_eq!(twice.is_inside([0.5; 3], Rule::Parity), Some(false));
        let nothing = WindingNumber::new(Vec::new());
        assert_eq!(nothing.is_inside([0.5; 3], Rule::Winding), Some(false));
        // In the plane of an opening either is right.
        let open = of(&open_box([0.0; 3], [1.0; 3]));
        let top = [0.5, 0.5, 1.0];
        assert_eq!(open.is_inside(top, Rule::Winding), None);
    }
}
