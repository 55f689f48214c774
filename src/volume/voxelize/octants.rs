//! Triangles that span at most two voxels along each axis: the eight octants around one corner.
//!
//! Seen from the corner `c` that the (at most eight) voxels share, a triangle touches an octant
//! exactly when a vertex lies in it, an edge passes through it, or one of the axes through `c`
//! pierces the triangle beside it. All of that follows from the signs of the vertices' coordinates,
//! of the three cross products of consecutive vertices (whose components say on which side of `c`
//! an edge passes, seen along each axis) and of their determinant. Where one of them is too near to
//! 0 for its rounding error the triangle is left to the exact code.

use super::kernel::Triangle;
use wide::f64x4;

/// Products of coordinates up to 1, each off by half a unit roundoff, and their differences: below 4
/// roundoffs; and the determinant, three such times 1: below 32.
const CROSS_ERROR: f64 = 8.0 * f64::EPSILON;
const VOLUME_ERROR: f64 = 32.0 * f64::EPSILON;

/// The octants that a segment passes through: from octant `i` to octant `j`, with bit `a` of `turn`
/// for a positive component `a` of the cross product of its ends, at `i | j << 3 | turn << 6`.
const PASSED: [u8; 512] = {
    let mut table = [0; 512];
    let mut entry = 0;
    while entry < 512 {
        table[entry] = passed(entry & 7, entry >> 3 & 7, entry >> 6);
        entry += 1;
    }
    table
};

const fn passed(from: usize, to: usize, turn: usize) -> u8 {
    let differ = from ^ to;
    // How many of the other planes the segment crosses before plane `a`.
    let mut rank = [0; 3];
    let mut a = 0;
    while a < 3 {
        let b = (a + 1) % 3;
        if differ >> a & 1 == 1 && differ >> b & 1 == 1 {
            // With t the parameter at which a plane is crossed: t_a < t_b exactly when the component
            // of the cross product along the third axis has the sign of the product of the two
            // coordinates of the first end.
            let same = (from >> a & 1) == (from >> b & 1);
            let positive = turn >> ((a + 2) % 3) & 1 == 1;
            if same == positive {
                rank[b] += 1;
            } else {
                rank[a] += 1;
            }
        }
        a += 1;
    }
    let (mut octant, mut mask, mut step) = (from, 1 << from, 0);
    while step < 3 {
        let mut a = 0;
        while a < 3 {
            if differ >> a & 1 == 1 && rank[a] == step {
                octant ^= 1 << a;
                mask |= 1 << octant;
            }
            a += 1;
        }
        step += 1;
    }
    mask
}

/// The octants on the lower and on the upper side of each axis.
const BESIDE: [[u8; 2]; 3] = [[0x55, 0xaa], [0x33, 0xcc], [0x0f, 0xf0]];

/// The octants around `centre` that a triangle within one voxel of it touches, bit `x + 2 y + 4 z`;
/// `None` where only exact arithmetic can tell.
#[inline(always)]
pub fn touched(q: &Triangle, centre: [f64; 3]) -> Option<u8> {
    // Lane i: vertex i, and the vertex after it.
    let at = |a: usize| {
        f64x4::new([
            q[0][a] - centre[a],
            q[1][a] - centre[a],
            q[2][a] - centre[a],
            1.0,
        ])
    };
    let next = |p: f64x4| {
        let [a, b, c, d] = p.to_array();
        f64x4::new([b, c, a, d])
    };
    let (x, y, z) = (at(0), at(1), at(2));
    let (x1, y1, z1) = (next(x), next(y), next(z));
    // Lane 3 is made to be far from 0.
    let apart = f64x4::new([0.0, 0.0, 0.0, 1.0]);
    let yz = y * z1 - z * y1 + apart;
    let zx = z * x1 - x * z1 + apart;
    let xy = x * y1 - y * x1 + apart;
    let least = yz.abs().fast_min(zx.abs()).fast_min(xy.abs());
    let clear = least.simd_gt(f64x4::splat(CROSS_ERROR)).to_bitmask()
        & x.abs()
            .fast_min(y.abs())
            .fast_min(z.abs())
            .simd_gt(f64x4::splat(0.0))
            .to_bitmask();
    if clear != 0xf {
        return None;
    }
    let zero = f64x4::splat(0.0);
    let above = |p: f64x4| p.simd_gt(zero).to_bitmask() as usize & 7;
    let (ox, oy, oz) = (above(x), above(y), above(z));
    let (cx, cy, cz) = (above(yz), above(zx), above(xy));
    let octant = |i: usize| (ox >> i & 1) | (oy >> i & 1) << 1 | (oz >> i & 1) << 2;
    let turn = |i: usize| (cx >> i & 1) | (cy >> i & 1) << 1 | (cz >> i & 1) << 2;
    let (o0, o1, o2) = (octant(0), octant(1), octant(2));
    let mut mask = PASSED[o0 | o1 << 3 | turn(0) << 6]
        | PASSED[o1 | o2 << 3 | turn(1) << 6]
        | PASSED[o2 | o0 << 3 | turn(2) << 6];
    // An axis whose point is on one side of all edges pierces the triangle.
    let pierced = |c: usize| c == 0 || c == 7;
    if pierced(cx) || pierced(cy) || pierced(cz) {
        let sum = |c: f64x4| {
            let [a, b, c, _] = c.to_array();
            a + b + c
        };
        let n = [sum(yz), sum(zx), sum(xy)];
        let volume = n[0] * (q[0][0] - centre[0])
            + n[1] * (q[0][1] - centre[1])
            + n[2] * (q[0][2] - centre[2]);
        if volume.abs() <= VOLUME_ERROR {
            return None;
        }
        for (axis, signs) in [cx, cy, cz].into_iter().enumerate() {
            if pierced(signs) {
                let upper = (signs == 7) == (volume > 0.0);
                // The four octants around this half of the axis.
                mask |= BESIDE[axis][usize::from(upper)];
            }
        }
    }
    Some(mask)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;
    use crate::volume::voxelize::kernel;

    #[test]
    fn octants_are_those_the_exact_test_finds() {
        let mut decided = 0;
        for i in 0..40_000 {
            let mut rng = Rng::new(5, i);
            // Some with corners on a coarse lattice, where signs are 0, and some in a single voxel.
            let coarse = i % 4 == 0;
            let mut coordinate = |a: usize| {
                let c = rng.range(if i % 5 == a as u64 { 3.5 } else { 3.0 }, 5.0);
                if coarse { (c * 4.0).round() / 4.0 } else { c }
            };
            let q: Triangle = std::array::from_fn(|_| std::array::from_fn(&mut coordinate));
            let Some(mask) = touched(&q, [4.0; 3]) else {
                continue;
            };
            decided += 1;
            for octant in 0..8 {
                let at = [3 + (octant & 1), 3 + (octant >> 1 & 1), 3 + (octant >> 2)];
                assert_eq!(
                    mask >> octant & 1 == 1,
                    kernel::touches(&q, at, 1),
                    "{q:?} {at:?}"
                );
            }
        }
        assert!(decided > 25_000, "{decided}");
    }
}
