//! Discs in a hierarchy of boxes, four to a leaf, which are tested at once.

use super::disc::{Hit, Plate, Ray};
use super::tree::{Aim, Visits};
use crate::spatial::aabb::Aabb;
use crate::spatial::wide_bvh::{LEAF, Leaf, NONE, WideBvh};
use std::ops::ControlFlow;
use wide::f64x4 as Lanes;

/// Four discs, one in each lane: centres, normals, squares of radii.
#[derive(Debug, Clone, Copy)]
struct Packet {
    centre: [Lanes; 3],
    normal: [Lanes; 3],
    square: Lanes,
}

/// The hierarchy.
#[derive(Debug, Clone)]
pub(super) struct Boxes {
    tree: WideBvh,
    leaves: Vec<Leaf>,
    packets: Vec<Packet>,
}

impl Boxes {
    /// The hierarchy over discs with these boxes, of which the empty ones are left out.
    pub fn new(plates: &[Plate], bounds: impl Fn(u32) -> Aabb + Sync) -> Boxes {
        let (tree, leaves) = WideBvh::build(plates.len() as u32, |i| {
            if plates[i as usize].square > 0.0 {
                bounds(i)
            } else {
                Aabb::EMPTY
            }
        });
        let packets = leaves
            .iter()
            .map(|leaf| {
                // A lane without a disc has one without size, which nothing meets.
                let lanes = leaf.map(|i| plates.get(i as usize).copied().unwrap_or_default());
                let axis = |f: fn(&Plate) -> f64| Lanes::new(lanes.each_ref().map(f));
                Packet {
                    centre: [
                        axis(|p| p.centre[0]),
                        axis(|p| p.centre[1]),
                        axis(|p| p.centre[2]),
                    ],
                    normal: [
                        axis(|p| p.normal[0]),
                        axis(|p| p.normal[1]),
                        axis(|p| p.normal[2]),
                    ],
                    square: axis(|p| p.square),
                }
            })
            .collect();
        Boxes {
            tree,
            leaves,
            packets,
        }
    }

    /// Leaves, and bytes of all.
    pub fn size(&self) -> (u64, u64) {
        let lists = size_of_val(self.leaves.as_slice()) as u64
            + size_of_val(self.packets.as_slice()) as u64;
        (self.leaves.len() as u64, self.tree.bytes() + lists)
    }

    /// As [`super::tree::Tree::walk`].
    #[inline]
    pub fn walk(
        &self,
        ray: &Ray,
        aim: &Aim,
        limit: f64,
        visits: &mut Visits,
        mut visit: impl FnMut(Hit) -> ControlFlow<(), f64>,
    ) -> ControlFlow<()> {
        let mut far = limit;
        self.tree
            .walk(&aim.slabs(), aim.limit(limit), |leaf, limit| {
                let items = &self.leaves[leaf];
                visits.leaves += 1;
                visits.tests += items.iter().filter(|item| **item != NONE).count() as u64;
                let (t, off, mut mask) = self.packets[leaf].meet(ray);
                if mask == 0 {
                    return ControlFlow::Continue(limit);
                }
                let (t, off) = (t.to_array(), off.to_array());
                while mask != 0 {
                    let lane = mask.trailing_zeros() as usize % LEAF;
                    mask &= mask - 1;
                    let hit = Hit {
                        t: t[lane],
                        off: off[lane],
                        disc: items[lane],
                    };
                    if hit.t <= far {
                        far = visit(hit)?;
                    }
                }
                ControlFlow::Continue(aim.limit(far))
            })
    }
}

impl Packet {
    /// [`Plate::meet`] of four, operation by operation: the ways, the squares, and who is met.
    #[inline(always)]
    fn meet(&self, ray: &Ray) -> (Lanes, Lanes, u32) {
        let origin = ray.origin.map(Lanes::splat);
        let direction = ray.direction.map(Lanes::splat);
        let dot = |a: &[Lanes; 3], b: &[Lanes; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let [n, c] = [&self.normal, &self.centre];
        let away = [c[0] - origin[0], c[1] - origin[1], c[2] - origin[2]];
        let t = dot(n, &away) / dot(n, &direction);
        let place = |a: usize| (origin[a] + direction[a] * t) - c[a];
        let off = [place(0), place(1), place(2)];
        let off = dot(&off, &off) / self.square;
        let met = t.simd_gt(Lanes::splat(ray.least))
            & t.simd_lt(Lanes::splat(f64::INFINITY))
            & off.simd_le(Lanes::splat(1.0));
        (t, off, met.to_bitmask())
    }
}
