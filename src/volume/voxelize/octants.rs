//! Triangles that span few voxels along each axis: most of the work of a fine mesh.
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
//! inside of the triangle's bounds. Only signs are asked for, so single precision does: where a number
//! is too near to 0 for its rounding error, the triangle is left to the exact code.

use wide::{f32x4, f64x4};

/// Most voxels along an axis.
pub const EDGE: usize = 8;

/// Bounds on the rounding errors of signs, for triangles and corners in a box of `edge` voxels.
///
/// With u the unit roundoff of single precision: a coordinate is rounded once when it is taken
/// relative to the box and once when it is to the corner, which is 2 u edge. A difference of two
/// products of those is off by 12 u edge^2, with its own roundings; a sum of three such by 48; and the
/// determinant, three of these times edge, by 256 u edge^3.
struct Errors {
    coordinate: f32x4,
    cross: f32x4,
    area: f32x4,
    volume: f32,
}

impl Errors {
    #[inline(always)]
    fn within(edge: usize) -> Self {
        let edge = edge as f32;
        let unit = 0.5 * f32::EPSILON;
        Errors {
            coordinate: f32x4::splat(2.0 * unit * edge),
            cross: f32x4::splat(16.0 * unit * edge * edge),
            area: f32x4::splat(64.0 * unit * edge * edge),
            volume: 256.0 * unit * edge * edge * edge,
        }
    }
}

/// The octants that a segment passes through: from octant `i` to octant `j`, with the signs of the
/// cross product of its ends in the bits of `turn`, at `i | j << 3 | turn << 6`.
///
/// A bit of `turn` is set where the number is negative. The cross product is turned: z, x, y.
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

/// The octants on the upper side of each axis.
const UPPER: [u8; 3] = [0xaa, 0xcc, 0xf0];

/// The octants beside which the axes through a corner pierce a triangle, at
/// `below | above << 3 | positive << 6`: the axes on the negative and on the positive side of all
/// edges, turned (z, x, y), and the sign of the determinant.
const PIERCED: [u8; 128] = {
    let mut table = [0; 128];
    let mut entry = 0;
    while entry < 128 {
        let (below, above, positive) = (entry & 7, entry >> 3 & 7, entry >> 6 == 1);
        let mut axis = 0;
        while axis < 3 {
            let place = (axis + 1) % 3;
            let negative = below >> place & 1 == 1;
            if (below | above) >> place & 1 == 1 {
                // The axis meets the plane at determinant / normal, and around that half of it lie
                // four octants. The determinant is that of corner less vertex.
                let upper = negative == positive;
                table[entry] |= if upper { UPPER[axis] } else { !UPPER[axis] };
            }
            axis += 1;
        }
        entry += 1;
    }
    table
};

/// The cells around a corner that a mask of octants leaves out: bits `x + 8 y` of the lower slice, and
/// of the upper one from bit 16 on.
const LEFT_OUT: [u32; 256] = {
    let mut table = [0; 256];
    let mut entry = 0;
    while entry < 256 {
        let mut octant = 0;
        while octant < 8 {
            if entry >> octant & 1 == 0 {
                table[entry] |= 1 << ((octant & 1) + 8 * (octant >> 1 & 1) + 16 * (octant >> 2));
            }
            octant += 1;
        }
        entry += 1;
    }
    table
};

/// A triangle relative to the lowest cell that its closed bounds meet.
#[derive(Clone, Copy)]
pub struct Small([f32x4; 3]);

/// A triangle as a corner of the grid sees it.
#[derive(Clone, Copy)]
pub struct Seen {
    /// The octants that it touches: bit `x + 2 y + 4 z`.
    pub octants: u8,
    /// Whether only exact arithmetic can tell.
    pub doubtful: bool,
    /// Whether it surely has an area.
    pub has_area: bool,
}

/// The outer product of two points, turned: z, x, y.
#[inline(always)]
fn cross(p: f32x4, q: f32x4, turned_p: f32x4, turned_q: f32x4) -> f32x4 {
    p * turned_q - turned_p * q
}

/// y, z, x.
#[inline(always)]
fn turned(p: f32x4) -> f32x4 {
    let [x, y, z, w] = p.to_array();
    f32x4::new([y, z, x, w])
}

/// Which of the three numbers are negative.
#[inline(always)]
fn signs(p: f32x4) -> usize {
    p.to_bitmask() as usize & 7
}

impl Small {
    /// The triangle whose bounds begin with the cell `low`; the fourth number of all is 0.
    #[inline(always)]
    pub fn new(q: &[f64x4; 3], low: f64x4) -> Self {
        Small(q.map(|corner| {
            let [x, y, z, _] = (corner - low).to_array();
            f32x4::new([x as f32, y as f32, z as f32, 0.0])
        }))
    }

    /// The triangle as a corner of the box sees it.
    #[inline(always)]
    fn seen_from(&self, corner: f32x4, errors: &Errors) -> Seen {
        let [p0, p1, p2] = self.0.map(|q| corner - q);
        let [t0, t1, t2] = [turned(p0), turned(p1), turned(p2)];
        let c0 = cross(p0, p1, t0, t1);
        let c1 = cross(p1, p2, t1, t2);
        let c2 = cross(p2, p0, t2, t0);
        let least = c0.abs().fast_min(c1.abs()).fast_min(c2.abs());
        let nearest = p0.abs().fast_min(p1.abs()).fast_min(p2.abs());
        let near = least.simd_le(errors.cross) | nearest.simd_le(errors.coordinate);
        let (o0, o1, o2) = (signs(p0), signs(p1), signs(p2));
        let (s0, s1, s2) = (signs(c0), signs(c1), signs(c2));
        // An axis that is on one side of all edges pierces the triangle.
        let (below, above) = (s0 & s1 & s2, !(s0 | s1 | s2) & 7);
        let normal = c0 + c1 + c2;
        let [z, x, y, _] = (normal * turned(t0)).to_array();
        let volume = x + y + z;
        let octants = PASSED[o0 | o1 << 3 | s0 << 6]
            | PASSED[o1 | o2 << 3 | s1 << 6]
            | PASSED[o2 | o0 << 3 | s2 << 6]
            | PIERCED[below | above << 3 | usize::from(volume > 0.0) << 6];
        let doubtful =
            (near.to_bitmask() & 7 != 0) | ((below | above != 0) & (volume.abs() <= errors.volume));
        let has_area = normal.abs().simd_gt(errors.area).to_bitmask() & 7 != 0;
        Seen {
            octants,
            doubtful,
            has_area,
        }
    }

    /// The voxels that a triangle in a box of 2 x 2 x 2 touches: the octants around its middle.
    #[inline(always)]
    pub fn pairs(&self) -> Seen {
        self.seen_from(f32x4::new([1.0, 1.0, 1.0, 0.0]), &Errors::within(2))
    }

    /// The voxels that a triangle in a box of `size` voxels, each at most `edge` and that at most
    /// [`EDGE`], touches: a slice for each z, in it bit `x + 8 y`; and whether it surely has an area.
    /// `None` where only exact arithmetic can tell.
    #[inline(always)]
    pub fn cells(&self, size: [usize; 3], edge: usize) -> Option<([u64; EDGE], bool)> {
        let errors = Errors::within(edge);
        // Planes between cells; one above, where there is but one cell.
        let [nx, ny, nz] = size.map(|s| (s - 1).max(1));
        let mut left_out = [0u64; EDGE];
        let (mut doubtful, mut has_area) = (false, false);
        for z in 0..nz {
            let (mut lower, mut upper) = (0, 0);
            for y in 0..ny {
                for x in 0..nx {
                    let corner = [x as f32 + 1.0, y as f32 + 1.0, z as f32 + 1.0, 0.0];
                    let seen = self.seen_from(f32x4::new(corner), &errors);
                    doubtful |= seen.doubtful;
                    has_area |= seen.has_area;
                    let out = u64::from(LEFT_OUT[usize::from(seen.octants)]);
                    lower |= (out & 0xffff) << (x + 8 * y);
                    upper |= (out >> 16) << (x + 8 * y);
                }
            }
            left_out[z % EDGE] |= lower;
            left_out[(z + 1) % EDGE] |= upper;
        }
        if doubtful {
            return None;
        }
        let row = u64::MAX >> (64 - size[0]);
        let slice = row * (0x0101_0101_0101_0101 & u64::MAX >> (64 - 8 * size[1]));
        let mut cells = [0; EDGE];
        for z in 0..size[2].min(EDGE) {
            cells[z] = slice & !left_out[z];
        }
        Some((cells, has_area))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;
    use crate::volume::voxelize::overlap::touches;
    use crate::volume::voxelize::triangle::Triangle;

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
            let seen = Small::new(&lanes, f64x4::new([3.0, 3.0, 3.0, 0.0])).pairs();
            if seen.doubtful {
                continue;
            }
            let mask = seen.octants;
            decided += 1;
            for octant in 0..8 {
                let at = [3 + (octant & 1), 3 + (octant >> 1 & 1), 3 + (octant >> 2)];
                assert_eq!(mask >> octant & 1 == 1, touches(&q, at, 1), "{q:?} {at:?}");
            }
        }
        assert!(decided > 25_000, "{decided}");
    }

    #[test]
    fn cells_are_those_the_exact_test_finds() {
        let mut decided = 0;
        for i in 0..20_000 {
            let mut rng = Rng::new(6, i);
            let size: [usize; 3] = std::array::from_fn(|_| 1 + rng.below(EDGE));
            let coarse = i % 8 == 0;
            let q: Triangle = std::array::from_fn(|_| {
                std::array::from_fn(|a| {
                    let c = rng.range(7.0, 7.0 + size[a] as f64);
                    if coarse { (c * 8.0).round() / 8.0 } else { c }
                })
            });
            let lanes = q.map(|[x, y, z]| f64x4::new([x, y, z, 0.0]));
            let small = Small::new(&lanes, f64x4::new([7.0, 7.0, 7.0, 0.0]));
            let Some((slices, _)) = small.cells(size, EDGE) else {
                continue;
            };
            decided += 1;
            for cell in 0..512 {
                let at = [cell & 7, cell >> 3 & 7, cell >> 6];
                let inside = (0..3).all(|a| (at[a] as usize) < size[a]);
                let wanted = inside && touches(&q, at.map(|c| c + 7), 1);
                let set = slices[cell as usize >> 6] >> (cell & 63) & 1 == 1;
                assert_eq!(set, wanted, "{q:?} {at:?} {size:?}");
            }
        }
        assert!(decided > 15_000, "{decided}");
    }
}
