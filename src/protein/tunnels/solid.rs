//! The surface of a solid that a function of places tells: where it is 0 or more is inside.

use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::numeric::vector::Vec3;
use crate::progress::Progress;
use crate::spatial::aabb::Aabb;
use crate::volume::bits::BitGrid;
use crate::volume::isosurface::{self, Border, Select};
use crate::volume::{Data, Frame, Volume};
use rayon::prelude::*;

/// Most points of a grid along a side: a surface counts its places in half steps of 32 bits.
const MOST_POINTS: f64 = (1 << 29) as f64;

/// Bytes for each of the vertices that a surface of a given area has while it is made: it, its places, its
/// triangles and what they are found from.
const BYTES_PER_VERTEX: f64 = 160.0;

/// Vertices on a surface of area 1 over cells of side 1, on average over all directions.
const VERTICES: f64 = 1.5;

/// Vertices are found to this share of the spacing.
const PRECISION: f64 = 1e-9;

/// Points at equal distances along x, y and z.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lattice {
    origin: Vec3,
    spacing: f64,
    dims: [usize; 3],
}

impl Lattice {
    /// Points around a box, with at least one outside of it on every side, of which one would be at the
    /// origin of the coordinates.
    ///
    /// Errs where the spacing is no length above 0, or so small that it makes over 2^29 points along a
    /// side.
    pub fn around(bounds: &Aabb, spacing: f64) -> Result<Self> {
        if !(spacing > 0.0 && spacing.is_finite()) {
            let problem = "must be above 0, and finite";
            return Err(Error::parameter("spacing", spacing, problem));
        }
        if bounds.is_empty() {
            return Ok(Lattice {
                origin: [0.0; 3],
                spacing,
                dims: [1; 3],
            });
        }
        let first = bounds.lo.map(|c| (c / spacing).floor() - 1.0);
        let points: Vec3 =
            std::array::from_fn(|a| (bounds.hi[a] / spacing).ceil() + 2.0 - first[a]);
        let is_few = |points: &f64| points.is_finite() && *points <= MOST_POINTS;
        if let Some(points) = points.iter().find(|points| !is_few(points)) {
            let problem = format!("makes {points} points along a side, over {MOST_POINTS}");
            return Err(Error::parameter("spacing", spacing, problem));
        }
        Ok(Lattice {
            origin: first.map(|steps| spacing * steps),
            spacing,
            dims: points.map(|points| points as usize),
        })
    }

    /// The lattice moved down along all axes, by a share of the spacing from 0 to below 1.
    pub fn moved(mut self, share: f64) -> Self {
        self.origin = self.origin.map(|c| c - share * self.spacing);
        self
    }

    /// Bytes that the surface of a solid of this area takes while it is made.
    pub fn bytes(&self, area: f64) -> u128 {
        let vertices = VERTICES * area / (self.spacing * self.spacing);
        // A conversion that ends at the largest number.
        BitGrid::bytes_for(self.dims) + (BYTES_PER_VERTEX * vertices) as u128
    }

    fn point(&self, at: [usize; 3]) -> Vec3 {
        std::array::from_fn(|a| self.origin[a] + self.spacing * at[a] as f64)
    }

    /// All points for which a test holds, but for those of the outermost layers, which are taken to be
    /// outside.
    pub fn select(&self, holds: impl Fn(Vec3) -> bool + Sync) -> BitGrid {
        let [nx, ny, nz] = self.dims;
        let mut bits = BitGrid::new(self.dims);
        let slice = bits.stride() * ny;
        let fill = |(z, out): (usize, &mut [u64])| {
            let mut one = BitGrid::new([nx, ny, 1]);
            if z == 0 || z + 1 == nz {
                return;
            }
            for y in 1..ny.saturating_sub(1) {
                for x in 1..nx.saturating_sub(1) {
                    if holds(self.point([x, y, z])) {
                        one.set(x, y, 0);
                    }
                }
            }
            out.copy_from_slice(one.words());
        };
        if slice > 0 {
            let slices = bits.words_mut().par_chunks_mut(slice);
            slices.enumerate().for_each(fill);
        }
        bits
    }

    /// The points of a selection, x fastest.
    pub fn points<'a>(&'a self, selected: &'a BitGrid) -> impl Iterator<Item = Vec3> + 'a {
        let [nx, ny, nz] = self.dims;
        let rows = (0..nz).flat_map(move |z| (0..ny).map(move |y| (y, z)));
        rows.flat_map(move |(y, z)| {
            let here = (0..nx).filter(move |x| selected.get(*x, y, z));
            here.map(move |x| self.point([x, y, z]))
        })
    }

    /// The closed surface of what `value` is 0 or more in, of which `inside` are the points of this lattice.
    ///
    /// `value` has to be continuous, and to change by no more than its argument moves. Vertices lie on the
    /// edges between neighbouring points, where it is 0 to a billionth of the spacing. Errs where there
    /// are over 2^30 vertices. Cost: about ten values for each vertex.
    pub fn surface(
        &self,
        inside: BitGrid,
        value: impl Fn(Vec3) -> f64 + Sync,
        progress: &dyn Progress,
    ) -> Result<Mesh> {
        let volume = Volume {
            frame: Frame::straight(self.dims, self.origin, [self.spacing; 3]),
            data: Data::Bits(inside),
        };
        let surface = isosurface::extract(&volume, &Select::Set, Border::Closed, progress)?;
        drop(volume);
        let vertex = |v: usize| {
            let place = surface.places[v];
            let axis = isosurface::axis_of(place);
            let low = place.map(|c| c.div_euclid(2) as usize);
            let mut high = low;
            high[axis] += 1;
            let (low, high) = (self.point(low), self.point(high));
            let on_edge = |t: f64| {
                let mut p = low;
                p[axis] = low[axis] + t * (high[axis] - low[axis]);
                p
            };
            on_edge(root(|t| value(on_edge(t)), PRECISION * self.spacing))
        };
        let all = (0..surface.len()).into_par_iter();
        let positions: Vec<Vec3> = all.with_min_len(1 << 8).map(vertex).collect();
        let triangles = surface.triangles(&positions);
        Ok(Mesh::from_triangles(positions, triangles))
    }
}

/// Where between 0 and 1 a function of two signs at the ends is 0, to within `small` in its value or in
/// its argument's last bits.
///
/// False position, with a halving every third step, which bounds the steps.
fn root(value: impl Fn(f64) -> f64, small: f64) -> f64 {
    let ([mut a, mut b], mut steps) = ([0.0, 1.0], 0);
    let [mut at_a, mut at_b] = [value(a), value(b)];
    while b - a > f64::EPSILON && steps < 180 {
        steps += 1;
        let linear = a + (b - a) * (at_a / (at_a - at_b));
        let t = match linear > a && linear < b && steps % 3 != 0 {
            true => linear,
            false => 0.5 * (a + b),
        };
        let at_t = value(t);
        if at_t.abs() <= small {
            return t;
        }
        if (at_t < 0.0) == (at_a < 0.0) {
            (a, at_a) = (t, at_t);
        } else {
            (b, at_b) = (t, at_t);
        }
    }
    0.5 * (a + b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_root_is_found_however_flat_or_steep() {
        let near = |f: &dyn Fn(f64) -> f64, at: f64| {
            let found = root(f, 1e-12);
            let is_near = (found - at).abs() < 1e-9 || f(found).abs() <= 1e-12;
            assert!(is_near, "{found} {at}");
        };
        near(&|t| t - 0.3, 0.3);
        near(&|t| 0.7 - t, 0.7);
        near(&|t| (t - 0.25).powi(3), 0.25);
        near(&|t| if t < 0.9 { -1e-3 } else { 1.0 }, 0.9);
        near(&|t| t - 1.0, 1.0);
    }

    #[test]
    fn hostile_spacings_are_refused() {
        let bounds = Aabb {
            lo: [0.0; 3],
            hi: [1.0; 3],
        };
        for spacing in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300, 1e-9] {
            assert!(Lattice::around(&bounds, spacing).is_err(), "{spacing}");
        }
        let lattice = Lattice::around(&bounds, 0.5).expect("a lattice");
        assert_eq!(lattice.dims, [5; 3]);
        assert_eq!(lattice.point([0, 2, 4]), [-0.5, 0.5, 1.5]);
        // The origin is a point to the last bit, however the spacing is.
        let lattice = Lattice::around(&bounds, 0.1).expect("a lattice");
        assert_eq!(lattice.point([1; 3]), [0.0; 3]);
        let all = lattice.select(|_| true);
        assert_eq!(all.count(), 11 * 11 * 11);
    }
}
