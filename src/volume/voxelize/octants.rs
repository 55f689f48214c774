//! Triangles that span at most four voxels along each axis: most of the work of a fine mesh.
//!
//! Seen from a corner `c` of the grid, a triangle touches one of the eight octants around it exactly
//! when a vertex lies in it, an edge passes through it, or one of the axes through `c` pierces the
//! triangle beside it. All of that follows from the signs of the vertices' coordinates, of the three
//! cross products of consecutive vertices (whose components say on which side of `c` an edge passes,
//! seen along each axis) and of their determinant.
//!
//! And a convex set touches a cube exactly when it touches, at each of the cube's corners, the octant
//! that holds the cube: a plane that separates the two can be moved to the cube's extreme corner, and
//! leaves that octant on the cube's side. So the voxels follow from the octants at the few corners
//! inside of the triangle's bounds. Where a sign is too near to 0 for its rounding error, the triangle
//! is left to the exact code.

use wide::f64x4;

/// Most voxels along an axis.
pub const EDGE: f64 = 4.0;
/// Coordinates are below 4, each off by half a unit roundoff of that. Differences of two of their
/// products: below 4 roundoffs of 16; sums of three: below 32; and the determinant, three of those
/// times 4: below 128 of 64.
const CROSS_ERROR: f64 = 8.0 * 16.0 * f64::EPSILON;
const AREA_ERROR: f64 = 32.0 * 16.0 * f64::EPSILON;
const VOLUME_ERROR: f64 = 128.0 * 64.0 * f64::EPSILON;

/// The octants that a segment passes through: from octant `i` to octant `j`, with the signs of the
/// cross product of its ends in the bits of `turn`, at `i | j << 3 | turn << 6`.
///
/// A bit is set where the number is negative. The cross product is turned: z, x, y.
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
            // The component along the third axis, c, stands at (c + 1) mod 3.
            let positive = turn >> a & 1 == 0;
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

/// The octants on the lower and on the upper side of each axis, in codes whose bits say "below".
const BESIDE: [[u8; 2]; 3] = [[0xaa, 0x55], [0xcc, 0x33], [0xf0, 0x0f]];

/// The outer product of two points, turned: z, x, y.
#[inline(always)]
fn cross(p: f64x4, q: f64x4, turned_p: f64x4, turned_q: f64x4) -> f64x4 {
    p * turned_q - turned_p * q
}

/// y, z, x.
#[inline(always)]
fn turned(p: f64x4) -> f64x4 {
    let [x, y, z, w] = p.to_array();
    f64x4::new([y, z, x, w])
}

/// The octants around `centre`, no corner farther than [`EDGE`], that a triangle touches: bit `x + 2 y + 4 z`, where x, y
/// and z are 1 *below* the centre; and whether the triangle surely has an area. `None` where only
/// exact arithmetic can tell.
///
/// The fourth number of the corners and of the centre is 0.
#[inline(always)]
pub fn touched(q: &[f64x4; 3], centre: f64x4) -> Option<(u8, bool)> {
    let [p0, p1, p2] = [q[0] - centre, q[1] - centre, q[2] - centre];
    let [t0, t1, t2] = [turned(p0), turned(p1), turned(p2)];
    let (c0, c1, c2) = (
        cross(p0, p1, t0, t1),
        cross(p1, p2, t1, t2),
        cross(p2, p0, t2, t0),
    );
    let least = c0.abs().fast_min(c1.abs()).fast_min(c2.abs());
    let nearest = p0.abs().fast_min(p1.abs()).fast_min(p2.abs());
    let doubtful = least.simd_le(f64x4::splat(CROSS_ERROR)) | nearest.simd_le(f64x4::ZERO);
    if doubtful.to_bitmask() & 7 != 0 {
        return None;
    }
    let signs = |p: f64x4| p.to_bitmask() as usize & 7;
    let (o0, o1, o2) = (signs(p0), signs(p1), signs(p2));
    let (s0, s1, s2) = (signs(c0), signs(c1), signs(c2));
    let mut mask = PASSED[o0 | o1 << 3 | s0 << 6]
        | PASSED[o1 | o2 << 3 | s1 << 6]
        | PASSED[o2 | o0 << 3 | s2 << 6];
    // An axis that is on one side of all edges pierces the triangle.
    let below = s0 & s1 & s2;
    let pierced = below | !(s0 | s1 | s2) & 7;
    if pierced != 0 {
        let [nz, nx, ny, _] = (c0 + c1 + c2).to_array();
        let [x, y, z, _] = p0.to_array();
        let volume = nx * x + ny * y + nz * z;
        if volume.abs() <= VOLUME_ERROR {
            return None;
        }
        for axis in 0..3 {
            let place = (axis + 1) % 3;
            if pierced >> place & 1 == 1 {
                // The axis meets the plane at volume / normal, and around that half of it lie four octants.
                let upper = (below >> place & 1 == 1) == (volume < 0.0);
                mask |= BESIDE[axis][usize::from(upper)];
            }
        }
    }
    let area = (c0 + c1 + c2)
        .abs()
        .simd_gt(f64x4::splat(AREA_ERROR))
        .to_bitmask()
        & 7;
    Some((mask, area != 0))
}

/// The voxels that a triangle touches, bit `x + 4 y + 16 z` from the voxel at `low` on, among `size`
/// voxels, at most [`EDGE`], that hold all of it; and whether it surely has an area. `None` as in
/// [`touched`].
#[inline]
pub fn cells(q: &[f64x4; 3], low: f64x4, size: [usize; 3]) -> Option<(u64, bool)> {
    // Planes between cells; one above, where there is but one cell.
    let [nx, ny, nz] = size.map(|s| (s - 1).max(1));
    let mut has_area = false;
    // For each line of corners along x, a byte for each cell: the octants over y and z that it needs
    // at its lower and at its upper corner.
    let mut along = [[0u32; 3]; 3];
    for z in 0..nz {
        for y in 0..ny {
            let mut octants = 0;
            for x in 0..nx {
                let centre =
                    low + f64x4::new([x as f64 + 1.0, y as f64 + 1.0, z as f64 + 1.0, 0.0]);
                let (mask, area) = touched(q, centre)?;
                octants |= u32::from(mask) << (8 * x);
                has_area |= area;
            }
            let above = (octants & 0x0055_5555) << 8 | 0x55;
            let below = octants >> 1 & 0x5555_5555 | 0x55u32 << (8 * nx);
            along[z][y] = above & below;
        }
    }
    let mut cells = 0;
    let mut rows = [[0u32; 4]; 3];
    for z in 0..nz {
        for y in 0..size[1] {
            let above = if y > 0 { along[z][y - 1] } else { u32::MAX };
            let below = if y < ny { along[z][y] >> 2 } else { u32::MAX };
            rows[z][y] = above & below & 0x1111_1111;
        }
    }
    for z in 0..size[2] {
        for y in 0..size[1] {
            let above = if z > 0 { rows[z - 1][y] } else { u32::MAX };
            let below = if z < nz { rows[z][y] >> 4 } else { u32::MAX };
            // The lowest bit of each byte, gathered.
            let nibble = (above & below & 0x0101_0101).wrapping_mul(0x0102_0408) >> 24 & 0xf;
            cells |= u64::from(nibble) << (4 * y + 16 * z);
        }
    }
    let x = 0xf >> (4 - size[0]);
    Some((cells & (x * 0x1111_1111_1111_1111), has_area))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;
    use crate::volume::voxelize::kernel::{self, Triangle};

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
            let lanes = q.map(|[x, y, z]| f64x4::new([x, y, z, 0.0]));
            let Some((mask, _)) = touched(&lanes, f64x4::new([4.0, 4.0, 4.0, 0.0])) else {
                continue;
            };
            decided += 1;
            for octant in 0..8 {
                let at = [4 - (octant & 1), 4 - (octant >> 1 & 1), 4 - (octant >> 2)];
                assert_eq!(
                    mask >> octant & 1 == 1,
                    kernel::touches(&q, at, 1),
                    "{q:?} {at:?}"
                );
            }
        }
        assert!(decided > 25_000, "{decided}");
    }

    #[test]
    fn cells_are_those_the_exact_test_finds() {
        let mut decided = 0;
        for i in 0..20_000 {
            let mut rng = Rng::new(6, i);
            let size: [usize; 3] = std::array::from_fn(|_| 1 + rng.below(4));
            let coarse = i % 8 == 0;
            let q: Triangle = std::array::from_fn(|_| {
                std::array::from_fn(|a| {
                    let c = rng.range(7.0, 7.0 + size[a] as f64);
                    if coarse { (c * 8.0).round() / 8.0 } else { c }
                })
            });
            let lanes = q.map(|[x, y, z]| f64x4::new([x, y, z, 0.0]));
            let Some((mask, _)) = cells(&lanes, f64x4::new([7.0, 7.0, 7.0, 0.0]), size) else {
                continue;
            };
            decided += 1;
            for cell in 0..64 {
                let at = [cell & 3, cell >> 2 & 3, cell >> 4];
                let inside = (0..3).all(|a| (at[a] as usize) < size[a]);
                let wanted = inside && kernel::touches(&q, at.map(|c| c + 7), 1);
                assert_eq!(mask >> cell & 1 == 1, wanted, "{q:?} {at:?} {size:?}");
            }
        }
        assert!(decided > 15_000, "{decided}");
    }
}
