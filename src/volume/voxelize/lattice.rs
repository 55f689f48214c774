//! Where the voxels are, and the way from file coordinates to grid coordinates.

use super::{Params, Size};
use crate::error::{Error, Fault, Result, number};
use crate::numeric::vector::{Vec3, sub};
use crate::spatial::aabb::Aabb;
use crate::volume::Frame;
use crate::volume::octree::MAX_DIM;
use wide::f64x4;

/// Coordinates nearer to 0 than this many voxels are 0: products of three of them then stay in the
/// range in which the predicates are exact.
const SMALLEST: f64 = 1.0 / (1u128 << 100) as f64;
/// Coordinates may be at most this many voxels (2^300) for the same reason.
const LARGEST: f64 = 2.037_035_976_334_486e90;
/// A side that is within this share of a whole number of voxels is that number: the rounding of a
/// difference and a quotient.
const WHOLE: f64 = 8.0 * f64::EPSILON;

/// A grid of cubic voxels along the coordinate axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice {
    /// The point that coordinates are taken from, in the mesh's unit: the lower corner of the box
    /// covered. It moves with the mesh, exactly, so that what is left does not depend on the place.
    pub anchor: Vec3,
    /// From the lower corner of voxel (0, 0, 0) to `anchor`, in the mesh's unit.
    pub margin: Vec3,
    /// Edge of a voxel, in the mesh's unit.
    pub h: f64,
    /// Voxels along x, y, z.
    pub dims: [usize; 3],
}

impl Lattice {
    /// The grid that the parameters ask for around a mesh with these bounds.
    ///
    /// With `bounds` it starts at their lower corner and covers them; without, it is centred on the
    /// mesh and padded. Errs when a side would have more than [`MAX_DIM`] voxels or no size.
    pub fn fit(mesh: Aabb, params: &Params) -> Result<Self> {
        let given = params.bounds.map(|b| Aabb {
            lo: [b[0], b[1], b[2]],
            hi: [b[3], b[4], b[5]],
        });
        let around = given.unwrap_or(if mesh.is_empty() {
            Aabb {
                lo: [0.0; 3],
                hi: [0.0; 3],
            }
        } else {
            mesh
        });
        let extent = around.extent();
        let longest = extent[0].max(extent[1]).max(extent[2]);
        if !longest.is_finite() {
            return Err(Error::Geometry(Fault::whole(format!(
                "the model spans {:?} to {:?}: its extent overflows",
                around.lo, around.hi
            ))));
        }
        let h = match params.size {
            Size::VoxelSize(h) => h,
            // What has no extent gets a voxel of unit size around it.
            Size::Resolution(_) if longest == 0.0 => 1.0,
            Size::Resolution(n) => longest / f64::from(n),
        };
        if h < f64::MIN_POSITIVE {
            let problem = format!(
                "the longest side, {longest:?}, gives voxels of {h:?}, below the smallest normal number"
            );
            return Err(Error::Geometry(
                Fault::whole(problem).with_hint("scale the model up"),
            ));
        }
        let pad = if given.is_some() {
            0.0
        } else {
            f64::from(params.pad)
        };
        let mut dims = [0; 3];
        for a in 0..3 {
            let voxels = match params.size {
                Size::Resolution(n) if extent[a] == longest && longest > 0.0 => f64::from(n),
                _ => whole(extent[a] / h),
            } + 2.0 * pad;
            if voxels > MAX_DIM as f64 {
                return Err(Error::Limit {
                    what: format!("a grid with voxels of {}", number(h)),
                    needed: format!("{} voxels along {}", number(voxels), ["x", "y", "z"][a]),
                    limit: format!("{MAX_DIM} voxels"),
                    hint: Some("lower --resolution, or raise --voxel-size".to_owned()),
                });
            }
            dims[a] = voxels as usize;
        }
        let margin = match given {
            Some(_) => [0.0; 3],
            None => std::array::from_fn(|a| {
                let covered = (dims[a] as f64 - 2.0 * pad) * h;
                pad * h + 0.5 * (covered - extent[a])
            }),
        };
        Ok(Lattice {
            anchor: around.lo,
            margin,
            h,
            dims,
        })
    }

    /// Lower corner of voxel (0, 0, 0), in the mesh's unit.
    pub fn origin(&self) -> Vec3 {
        sub(self.anchor, self.margin)
    }

    /// A point in grid coordinates: the difference, the sum and the quotient are each rounded once.
    #[inline]
    pub fn to_grid(&self, p: Vec3) -> Vec3 {
        let [x, y, z, _] = self.in_lanes()(p).to_array();
        [x, y, z]
    }

    /// A function that brings points to grid coordinates, as vectors whose fourth number is 0.
    #[inline(always)]
    pub(super) fn in_lanes(&self) -> impl Fn(Vec3) -> f64x4 {
        let lanes = |[x, y, z]: Vec3| f64x4::new([x, y, z, 0.0]);
        let (anchor, margin) = (lanes(self.anchor), lanes(self.margin));
        let h = f64x4::splat(self.h);
        move |p| {
            let q = (lanes(p) - anchor + margin) / h;
            q & q.abs().simd_ge(f64x4::splat(SMALLEST))
        }
    }

    /// A function that brings points to where [`Lattice::in_lanes`] does, but for the rounding of a
    /// product instead of a quotient: within the grid they are less than 2^-34 voxels apart.
    #[inline(always)]
    pub(super) fn near_lanes(&self) -> impl Fn(Vec3) -> f64x4 {
        let lanes = |[x, y, z]: Vec3| f64x4::new([x, y, z, 0.0]);
        let (anchor, margin) = (lanes(self.anchor), lanes(self.margin));
        let per_h = f64x4::splat(1.0 / self.h);
        move |p| (lanes(p) - anchor + margin) * per_h
    }

    /// Checks that no coordinate of a mesh with these bounds is too far from the grid to compute with.
    pub fn check_reach(&self, mesh: Aabb) -> Result<()> {
        if mesh.is_empty() {
            return Ok(());
        }
        for (corner, name) in [(mesh.lo, "lower"), (mesh.hi, "upper")] {
            let q = self.to_grid(corner);
            if q.iter().any(|c| c.abs() > LARGEST || c.is_nan()) {
                let problem = format!(
                    "the {name} corner of the model lies {q:?} voxels from the grid, over 2^300"
                );
                return Err(Error::Geometry(
                    Fault::whole(problem).with_hint("choose --bounds nearer to the model's size"),
                ));
            }
        }
        Ok(())
    }

    /// Whether a box lies wholly outside of the grid.
    pub(super) fn misses(&self, mesh: Aabb) -> bool {
        let (lo, hi) = (self.to_grid(mesh.lo), self.to_grid(mesh.hi));
        (0..3).any(|a| hi[a] < 0.0 || lo[a] > self.dims[a] as f64)
    }

    /// The same grid as the frame of a volume, which names the centre of the first voxel.
    pub fn frame(&self) -> Frame {
        let centre = std::array::from_fn(|a| self.anchor[a] + (0.5 * self.h - self.margin[a]));
        Frame::straight(self.dims, centre, [self.h; 3])
    }
}

/// The number of voxels that cover a side of `voxels`: rounded up, but for a side that is a whole
/// number up to rounding; at least 1.
fn whole(voxels: f64) -> f64 {
    let near = voxels.round();
    if (voxels - near).abs() <= WHOLE * voxels {
        near.max(1.0)
    } else {
        voxels.ceil().max(1.0)
    }
}
