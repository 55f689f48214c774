//! Volumes: dense and sparse voxel grids, and the conversions from and to meshes.

pub mod bits;
pub mod isosurface;
mod numbers;
pub mod octree;
pub mod smooth_mc;
pub mod surface;
pub mod trace;
pub mod voxelize;

use crate::error::Fault;
use crate::numeric::vector::Vec3;
use crate::report::Content;
use bits::BitGrid;
use octree::Octree;

/// Where the voxels of a grid are: `position = origin + i axes[0] + j axes[1] + k axes[2]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Voxels along i, j, k (x, y, z where the axes are not turned).
    pub dims: [usize; 3],
    /// Centre of voxel (0, 0, 0).
    pub origin: Vec3,
    /// The step from a voxel to its neighbour along i, j and k.
    pub axes: [Vec3; 3],
}

impl Frame {
    /// A grid along the coordinate axes, with `origin` the centre of voxel (0, 0, 0).
    pub fn straight(dims: [usize; 3], origin: Vec3, spacing: Vec3) -> Self {
        let [x, y, z] = spacing;
        Frame {
            dims,
            origin,
            axes: [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]],
        }
    }

    /// Length of the step along each axis.
    pub fn spacing(&self) -> Vec3 {
        self.axes.map(crate::numeric::vector::length)
    }

    /// Whether each axis points along its own positive coordinate axis.
    pub fn is_straight(&self) -> bool {
        (0..3).all(|a| {
            (0..3).all(|b| {
                if a == b {
                    self.axes[a][b] > 0.0
                } else {
                    self.axes[a][b] == 0.0
                }
            })
        })
    }

    /// Whether the axes are left-handed.
    pub fn is_mirrored(&self) -> bool {
        use crate::numeric::vector::{cross, dot, normalize};
        let [x, y, z] = self.axes.map(normalize);
        dot(cross(x, y), z) < 0.0
    }

    /// Number of voxels.
    pub fn len(&self) -> usize {
        self.dims.iter().product()
    }

    /// Whether there is no voxel.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A grid of values in space.
#[derive(Debug, Clone, PartialEq)]
pub struct Volume {
    /// Where its voxels are.
    pub frame: Frame,
    /// What they hold.
    pub data: Data,
}

/// The values of a grid. Vectors hold x fastest, then y, then z.
#[derive(Debug, Clone, PartialEq)]
pub enum Data {
    /// One bit each, all stored.
    Bits(BitGrid),
    /// One bit each, only what is set stored.
    Sparse(Octree),
    /// Bytes.
    U8(Vec<u8>),
    /// Signed bytes.
    I8(Vec<i8>),
    /// Unsigned 16-bit numbers.
    U16(Vec<u16>),
    /// Signed 16-bit numbers.
    I16(Vec<i16>),
    /// Unsigned 32-bit numbers.
    U32(Vec<u32>),
    /// Signed 32-bit numbers.
    I32(Vec<i32>),
    /// Unsigned 64-bit numbers.
    U64(Vec<u64>),
    /// Signed 64-bit numbers.
    I64(Vec<i64>),
    /// Single precision.
    F32(Vec<f32>),
    /// Double precision.
    F64(Vec<f64>),
}

/// Runs an expression with `$v` bound to the vector inside a [`Data`] of numbers, `$bits` for the others.
#[macro_export]
macro_rules! with_samples {
    ($data:expr, $v:ident => $numbers:expr, $b:pat => $bits:expr) => {
        match $data {
            $crate::volume::Data::U8($v) => $numbers,
            $crate::volume::Data::I8($v) => $numbers,
            $crate::volume::Data::U16($v) => $numbers,
            $crate::volume::Data::I16($v) => $numbers,
            $crate::volume::Data::U32($v) => $numbers,
            $crate::volume::Data::I32($v) => $numbers,
            $crate::volume::Data::U64($v) => $numbers,
            $crate::volume::Data::I64($v) => $numbers,
            $crate::volume::Data::F32($v) => $numbers,
            // What is a conversion for the others is none here.
            #[allow(clippy::unnecessary_cast)]
            $crate::volume::Data::F64($v) => $numbers,
            $b => $bits,
        }
    };
}

impl Data {
    /// The name of the sample type: `bit`, `u8`, ... `f64`.
    pub fn sample_type(&self) -> &'static str {
        match self {
            Data::Bits(_) | Data::Sparse(_) => "bit",
            Data::U8(_) => "u8",
            Data::I8(_) => "i8",
            Data::U16(_) => "u16",
            Data::I16(_) => "i16",
            Data::U32(_) => "u32",
            Data::I32(_) => "i32",
            Data::U64(_) => "u64",
            Data::I64(_) => "i64",
            Data::F32(_) => "f32",
            Data::F64(_) => "f64",
        }
    }
}

impl Volume {
    /// Whether it holds bits, densely or sparsely.
    pub fn is_binary(&self) -> bool {
        matches!(self.data, Data::Bits(_) | Data::Sparse(_))
    }

    /// What every reader promises: as many samples as the frame says, a frame of finite numbers
    /// whose axes span space.
    pub fn check(&self) -> Result<(), Fault> {
        let dims = self.frame.dims;
        let wanted = self.frame.len();
        let found = with_samples!(&self.data, v => v.len(), bits => match bits {
            Data::Bits(grid) if grid.dims() == dims => wanted,
            Data::Sparse(tree) if tree.dims() == dims => wanted,
            _ => 0,
        });
        if found != wanted {
            return Err(Fault::whole(format!(
                "{found} samples for a grid of {dims:?}, which has {wanted}"
            )));
        }
        let [a, b, c] = self.frame.axes;
        if !self
            .frame
            .origin
            .iter()
            .chain(self.frame.axes.iter().flatten())
            .all(|v| v.is_finite())
        {
            return Err(Fault::whole("origin or spacing is not finite"));
        }
        let unit = [a, b, c].map(crate::numeric::vector::normalize);
        let volume =
            crate::numeric::vector::dot(unit[0], crate::numeric::vector::cross(unit[1], unit[2]));
        if volume == 0.0 {
            return Err(Fault::whole(
                "the axes of the grid do not span space: a spacing is 0 or two axes are parallel",
            ));
        }
        Ok(())
    }

    /// Calls `f(z, row)` for each slice z from 0 up, with its samples as numbers, x fastest.
    ///
    /// One slice is held at a time, so a sparse volume is never expanded whole.
    #[cfg(test)]
    fn for_each_slice<E>(
        &self,
        mut f: impl FnMut(usize, &[f64]) -> Result<(), E>,
    ) -> Result<(), E> {
        let [nx, ny, nz] = self.frame.dims;
        let mut slice = vec![0.0; nx * ny];
        let mut bits = BitGrid::new([nx, ny, 1]);
        for z in 0..nz {
            with_samples!(&self.data, v => {
                for (to, from) in slice.iter_mut().zip(&v[z * nx * ny..]) {
                    *to = *from as f64;
                }
            }, _ => {
                self.read_bit_slices(z, &mut bits);
                for y in 0..ny {
                    for x in 0..nx {
                        slice[y * nx + x] = f64::from(u8::from(bits.get(x, y, 0)));
                    }
                }
            });
            f(z, &slice)?;
        }
        Ok(())
    }

    /// Copies the slices from `z0` on into `out`, whose x and y dims are those of the volume; the
    /// number of slices is `out`'s. Numbers other than 0 count as set.
    pub fn read_bit_slices(&self, z0: usize, out: &mut BitGrid) {
        let [nx, ny, depth] = out.dims();
        match &self.data {
            Data::Bits(grid) => out.copy_slices(grid, z0),
            Data::Sparse(tree) => tree.read_slices(z0, out),
            data => with_samples!(data, v => {
                out.clear();
                for z in 0..depth {
                    for y in 0..ny {
                        for x in 0..nx {
                            if v[((z0 + z) * ny + y) * nx + x] as f64 != 0.0 {
                                out.set(x, y, z);
                            }
                        }
                    }
                }
            }, _ => {}),
        }
    }

    /// Number of voxels that are not 0.
    pub fn count_set(&self) -> u64 {
        with_samples!(&self.data, v => v.iter().filter(|s| **s as f64 != 0.0).count() as u64, bits => match bits {
            Data::Bits(grid) => grid.count(),
            Data::Sparse(tree) => tree.count(),
            _ => 0,
        })
    }

    /// The smallest and the largest value, those that are no number left aside; `None` where there
    /// is no number.
    pub fn range(&self) -> Option<[f64; 2]> {
        if self.frame.is_empty() {
            return None;
        }
        let [lo, hi] = with_samples!(&self.data, v => v
            .iter()
            .map(|sample| *sample as f64)
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], s| [lo.min(s), hi.max(s)]), _ => {
            let set = self.count_set();
            [set == self.frame.len() as u64, set > 0].map(|bit| f64::from(u8::from(bit)))
        });
        (lo <= hi).then_some([lo, hi])
    }

    /// Dimensions, type and the outer bounds of the voxels, for a report.
    pub fn content(&self) -> Content {
        let mut bounds = crate::spatial::aabb::Aabb::EMPTY;
        for corner in 0..8 {
            let mut p = self.frame.origin;
            for a in 0..3 {
                let steps = if corner >> a & 1 == 1 {
                    self.frame.dims[a] as f64 - 0.5
                } else {
                    -0.5
                };
                p = crate::numeric::vector::add(
                    p,
                    crate::numeric::vector::scale(self.frame.axes[a], steps),
                );
            }
            bounds = bounds.with(p);
        }
        Content {
            dims: Some(self.frame.dims.map(|d| d as u64)),
            sample_type: Some(self.data.sample_type().to_owned()),
            bounds: (!self.frame.is_empty()).then_some([bounds.lo, bounds.hi]),
            ..Content::default()
        }
    }
}
