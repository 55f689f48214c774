//! The natural neighbours of a point in its plane.

use crate::numeric::vector::{Vec3, cross};

/// Most corners of a cell: six as a rule. What would add more is passed over.
const MOST: usize = 24;
/// Half the side of the square in which a cell is cut out, in the spacing: neighbours farther than
/// three times the spacing are across a gap, and touch no cell.
const HALF: f64 = 1.5;
/// The owner of a side that no neighbour cut.
const OPEN: u32 = u32::MAX;

/// Two unit vectors across a unit normal, which turn with it to the right: `u x v = n`.
///
/// Source: Duff and others, "Building an orthonormal basis, revisited", 2017.
#[inline]
pub fn across(n: Vec3) -> (Vec3, Vec3) {
    let sign = 1.0f64.copysign(n[2]);
    let a = -1.0 / (sign + n[2]);
    let b = n[0] * n[1] * a;
    let u = [1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]];
    (u, cross(n, u))
}

#[derive(Debug, Clone, Copy, Default)]
struct Corner {
    at: [f64; 2],
    /// Who cut the side that begins here.
    owner: u32,
}

/// The Voronoi cell of the origin in the plane, cut neighbour by neighbour.
pub struct Cell {
    corners: [Corner; MOST],
    count: usize,
    /// Square of the distance of the farthest corner.
    reach: f64,
}

impl Cell {
    /// The cell without neighbours, a square around the origin.
    pub fn new(spacing: f64) -> Self {
        let h = HALF * spacing;
        let mut corners = [Corner::default(); MOST];
        for (corner, at) in corners.iter_mut().zip([[-h, -h], [h, -h], [h, h], [-h, h]]) {
            *corner = Corner { at, owner: OPEN };
        }
        Cell {
            corners,
            count: 4,
            reach: 2.0 * h * h,
        }
    }

    /// Cuts off what is nearer to `q` than to the origin.
    pub fn cut(&mut self, q: [f64; 2], owner: u32) {
        let square = q[0] * q[0] + q[1] * q[1];
        // Half of the way to it, squared.
        if 0.25 * square >= self.reach || square == 0.0 || self.count == MOST {
            return;
        }
        let half = 0.5 * square;
        let mut sides = [0.0; MOST];
        let mut cut = false;
        for (side, corner) in sides.iter_mut().zip(&self.corners[..self.count]) {
            *side = corner.at[0] * q[0] + corner.at[1] * q[1] - half;
            cut |= *side > 0.0;
        }
        if !cut {
            return;
        }
        let corners = self.corners;
        let count = self.count;
        self.count = 0;
        for i in 0..count {
            let j = if i + 1 == count { 0 } else { i + 1 };
            let (a, b) = (corners[i], corners[j]);
            let (sa, sb) = (sides[i], sides[j]);
            if sa <= 0.0 {
                self.push(a);
            }
            if (sa <= 0.0) != (sb <= 0.0) {
                let t = sa / (sa - sb);
                let at = std::array::from_fn(|c| a.at[c] + t * (b.at[c] - a.at[c]));
                let owner = if sa <= 0.0 { owner } else { a.owner };
                self.push(Corner { at, owner });
            }
        }
        let count = self.count;
        let far = |c: &Corner| c.at[0] * c.at[0] + c.at[1] * c.at[1];
        self.reach = self.corners[..count].iter().map(far).fold(0.0, f64::max);
    }

    #[inline]
    fn push(&mut self, corner: Corner) {
        self.corners[self.count] = corner;
        self.count += 1;
    }

    /// Those who cut sides that are left: the natural neighbours.
    pub fn owners(&self) -> impl Iterator<Item = u32> {
        let corners = &self.corners[..self.count];
        corners.iter().map(|c| c.owner).filter(|o| *o != OPEN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::vector::{dot, length, normalize, sub};

    #[test]
    fn axes_are_right_handed() {
        for n in [
            [0.0, 0.0, 1.0],
            [0.0, 0.0, -1.0],
            [1.0, 0.0, 0.0],
            [0.3, -0.5, -0.2],
        ] {
            let n = normalize(n);
            let (u, v) = across(n);
            assert!(dot(u, n).abs() < 1e-15 && (length(u) - 1.0).abs() < 1e-15);
            assert!(length(sub(cross(u, v), n)) < 1e-15);
        }
    }

    #[test]
    fn a_lattice_has_four_natural_neighbours_and_a_hexagon_six() {
        let mut square = Cell::new(1.0);
        for (owner, [x, y]) in (0u32..).zip([
            [1, 0],
            [0, 1],
            [-1, 0],
            [0, -1],
            [1, 1],
            [2, 0],
            [-1, 1],
            [1, -1],
            [-1, -1],
        ]) {
            square.cut([f64::from(x), f64::from(y)], owner);
        }
        let mut owners: Vec<u32> = square.owners().collect();
        owners.sort_unstable();
        assert_eq!(owners, [0, 1, 2, 3]);
        let mut hexagon = Cell::new(1.0);
        for owner in 0..12u32 {
            let size = if owner < 6 { 1.0 } else { 1.8 };
            let (sin, cos) = (f64::from(owner) * std::f64::consts::FRAC_PI_3).sin_cos();
            hexagon.cut([size * cos, size * sin], owner);
        }
        let mut owners: Vec<u32> = hexagon.owners().collect();
        owners.sort_unstable();
        assert_eq!(owners, [0, 1, 2, 3, 4, 5]);
    }

    #[test]
    fn what_is_beyond_a_gap_is_no_neighbour() {
        let mut cell = Cell::new(1.0);
        cell.cut([3.5, 0.0], 0);
        cell.cut([2.0, 0.0], 1);
        assert_eq!(cell.owners().collect::<Vec<_>>(), [1]);
    }
}
