//! Meshes to voxels: surface and solid, dense and sparse, exact.
//!
//! After Forest, Barthe and Paulin (Real-Time Hierarchical Binary-Scene Voxelization, 2009): a
//! surface is sampled along one axis, or robustly along three, and a pyramid stands over the voxels.
//! The paper works at the resolution of a frame buffer, whose depth slices are not cubes and whose
//! last slice holds one depth only; here voxels are cubes, the lower face of each belongs to it, and
//! the upper face of the grid to the last voxel. Conservative voxelization, to which the paper only
//! points, is the default. What "exact" means: a vertex is brought to grid coordinates by one
//! difference from a point that moves with the model, one sum and one division, each rounded to
//! nearest; all that follows is decided as rational arithmetic would decide it.

mod dense;
mod fill;
mod lattice;
mod lazy;
mod lines;
mod near_lines;
mod octants;
mod overlap;
mod pyramid;
mod raster;
mod span;
mod trade;
mod triangle;
mod winding;

pub use lattice::Lattice;
pub use lazy::{Extent, Lazy};
pub use overlap::touches;
pub use trade::TRADE;
pub use triangle::Triangle;

use super::bits::BitGrid;
use super::octree::{self, Census};
use super::{Data, Volume};
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::progress::Progress;
use crate::report::{Accuracy, Modelled, Warning};
use crate::trade::named;
use fill::Filling;
use raster::{Counts, Surface};
use schemars::JsonSchema;
use serde::Serialize;
use winding::Border;

/// Which voxels a surface sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Those in which it meets the line through the voxel centres along z.
    Z,
    /// Those in which it meets such a line along x, y or z: 6-separating.
    ThreeAxis,
    /// All whose closed cube it meets: 26-separating, and nothing is missed.
    Conservative,
    /// None: only what the fill adds.
    None,
}
named!(Mode { Z = "z", ThreeAxis = "three-axis", Conservative = "conservative", None = "none" });

impl Mode {
    /// The axes along which lines through centres are followed; none where voxels are touched.
    fn axes(self) -> Option<&'static [usize]> {
        match self {
            Mode::Z => Some(&[2]),
            Mode::ThreeAxis => Some(&[0, 1, 2]),
            Mode::None => Some(&[]),
            Mode::Conservative => None,
        }
    }
}

/// Which voxels are set for being inside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Fill {
    /// None.
    None,
    /// Those whose centre is behind an odd number of surfaces, seen along x.
    Parity,
    /// Those whose centre has a winding number above one half.
    Winding,
}
named!(Fill { None = "none", Parity = "parity", Winding = "winding" });

/// How the grid is held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Storage {
    /// Densely up to [`DENSE_BYTES`], sparsely above.
    Auto,
    /// One bit per voxel.
    Dense,
    /// An octree over bricks, never held densely.
    Sparse,
}
named!(Storage { Auto = "auto", Dense = "dense", Sparse = "sparse" });

/// Along which axes the levels of the pyramid halve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Levels {
    /// x and y; z keeps its resolution (the paper's default).
    Xy,
    /// All three: an octree.
    Xyz,
}
named!(Levels { Xy = "xy", Xyz = "xyz" });

/// How fine the grid is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Size {
    /// Voxels along the longest side of the box.
    Resolution(u32),
    /// Edge of a voxel in the mesh's unit.
    VoxelSize(f64),
}

/// A grid of up to this many bytes is held densely unless asked otherwise: 1024^3 voxels.
pub const DENSE_BYTES: u128 = 1 << 27;

/// What [`voxelize`] is asked for.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Params {
    /// How fine the grid is.
    #[serde(flatten)]
    pub size: Size,
    /// Which voxels the surface sets.
    pub mode: Mode,
    /// Which voxels are set for being inside.
    pub fill: Fill,
    /// Voxels of margin on each side; without `bounds` only.
    pub pad: u32,
    /// The box to cover: lower corner, then upper; the model's own, padded, where none is given.
    pub bounds: Option<[f64; 6]>,
    /// How the grid is held.
    pub grid: Storage,
    /// Along which axes the levels of the pyramid halve.
    pub levels: Levels,
    /// Bytes that may be held.
    #[serde(skip)]
    pub max_memory: u64,
}

impl Params {
    /// What holds when nothing is said.
    pub const DEFAULT: Params = Params {
        size: Size::Resolution(128),
        mode: Mode::Conservative,
        fill: Fill::None,
        pad: 1,
        bounds: None,
        grid: Storage::Auto,
        levels: Levels::Xyz,
        max_memory: u64::MAX,
    };

    /// Errs where a value is out of its range.
    pub fn check(&self) -> Result<()> {
        match self.size {
            Size::Resolution(n) if n < 1 || n as usize > octree::MAX_DIM => {
                return Err(Error::parameter(
                    "resolution",
                    n,
                    format!("is not in 1..={}", octree::MAX_DIM),
                ));
            }
            Size::VoxelSize(h) if !(h.is_finite() && h > 0.0) => {
                return Err(Error::parameter(
                    "voxel-size",
                    h,
                    "is not a positive number",
                ));
            }
            _ => {}
        }
        if self.pad as usize > octree::MAX_DIM {
            return Err(Error::parameter(
                "pad",
                self.pad,
                format!("is not in 0..={}", octree::MAX_DIM),
            ));
        }
        if let Some(b) = self.bounds {
            let text = b.map(|v| format!("{v:?}")).join(",");
            if b.iter().any(|v| !v.is_finite()) {
                return Err(Error::parameter(
                    "bounds",
                    text,
                    "has a number that is not finite",
                ));
            }
            if (0..3).any(|a| !(b[a + 3] - b[a]).is_finite()) {
                return Err(Error::parameter("bounds", text, "an extent overflows"));
            }
            if (0..3).any(|a| b[a] > b[a + 3]) {
                return Err(Error::parameter(
                    "bounds",
                    text,
                    "the lower corner (first three) exceeds the upper (last three)",
                ));
            }
            if matches!(self.size, Size::Resolution(_)) && (0..3).all(|a| b[a] == b[a + 3]) {
                return Err(Error::parameter(
                    "bounds",
                    text,
                    "has no extent to divide into voxels",
                ));
            }
        }
        if self.mode == Mode::None && self.fill == Fill::None {
            return Err(Error::parameter(
                "mode",
                "none",
                "sets nothing without --fill",
            ));
        }
        Ok(())
    }
}

/// Which way round a fill took the triangles.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Orientation {
    /// The triangles that were turned round to agree with their patch; empty for none.
    pub reversed: Vec<bool>,
    /// Whether the whole was then turned round, for enclosing more negative than positive space.
    pub inverted: bool,
}

/// A level of the pyramid over the voxels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct LevelStats {
    /// 0 for the voxels themselves; each level doubles the edge.
    pub level: u32,
    /// Nodes along x, y, z of the full level.
    pub dims: [u64; 3],
    /// Nodes that hold a set voxel.
    pub nodes: u64,
}

/// What [`voxelize`] made.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Stats {
    /// Voxels along x, y, z.
    pub dims: [u64; 3],
    /// Edges of a voxel, in the mesh's unit.
    pub spacing: [f64; 3],
    /// Lower corner of voxel (0, 0, 0), in the mesh's unit.
    pub origin: [f64; 3],
    /// Which voxels the surface set.
    pub mode: Mode,
    /// Which voxels were set for being inside.
    pub fill: Fill,
    /// Voxels set, surface and inside together.
    pub set_voxels: u64,
    /// Voxels whose centre is inside; null without a fill.
    pub inside_voxels: Option<u64>,
    /// Voxels whose centres parity and winding number judge differently; null without a fill.
    pub fill_disagreement: Option<u64>,
    /// Directed edges along which the triangles do not cancel; null without a fill.
    pub border_edges: Option<u64>,
    /// Share of the voxels that is set.
    pub occupancy: f64,
    /// How the grid was held: `dense` or `sparse`.
    pub grid: Storage,
    /// The pyramid over the voxels.
    pub levels: Vec<LevelStats>,
    /// Bytes of the grid at one bit per voxel (rows filled up to 64 bits).
    pub dense_bytes: u64,
    /// Bytes of the octree's child masks.
    pub sparse_bytes: u64,
    /// Triangles of the mesh.
    pub triangles: u64,
    /// Those whose corners lie on one line in grid coordinates; met as the segments or points they are.
    pub degenerate_triangles: u64,
    /// Nodes of the octree, voxels included, that no larger full cube stands for.
    #[serde(skip)]
    pub octree_nodes: u64,
    /// Bytes that the grid took in memory.
    #[serde(skip)]
    pub held_bytes: u64,
    /// What looks wrong.
    #[serde(skip)]
    pub warnings: Vec<Warning>,
    #[serde(skip)]
    lattice: Lattice,
    #[serde(skip)]
    orientation: Orientation,
}

/// The voxels that a mesh sets.
///
/// Voxel `(i, j, k)` is the cube from `origin + h (i, j, k)` to `origin + h (i + 1, j + 1, k + 1)`.
/// The model is what triangles, segments and points use: other vertices count for nothing. Errs for parameters out of range, for a model without size or too far from the grid, and when
/// the grid would not fit in `max_memory`. Cost: linear in the triangles and in the rows of voxels
/// they span; a fill adds one pass over the triangles and one over the rows. The result is the same
/// on any number of threads and for any order and winding of the triangles.
pub fn voxelize(mesh: &Mesh, params: &Params, progress: &dyn Progress) -> Result<(Volume, Stats)> {
    params.check()?;
    progress.stage("fit", 0);
    let bounds = mesh.used_bounds();
    let lattice = Lattice::fit(bounds, params)?;
    lattice.check_reach(bounds)?;
    let bytes = BitGrid::bytes_for(lattice.dims);
    let dense = match params.grid {
        Storage::Auto => bytes <= DENSE_BYTES,
        Storage::Dense => true,
        Storage::Sparse => false,
    };
    if dense && bytes > u128::from(params.max_memory) {
        let [x, y, z] = lattice.dims;
        let what = format!("a dense grid of {x} x {y} x {z} voxels");
        return Err(Error::over_memory(
            what,
            bytes,
            params.max_memory,
            Some("use --grid sparse, or lower --resolution"),
        ));
    }
    let border = match params.fill {
        Fill::None => None,
        _ => {
            progress.stage("border", 0);
            Some(Border::of(mesh, &lattice))
        }
    };
    let surface = Surface::new(mesh, lattice, params.mode);
    let filling = border.as_ref().map(|border| {
        Filling::new(
            &surface.reversing(&border.reversed),
            params.fill,
            &lattice,
            border,
            progress,
        )
    });
    let (data, counts) = if dense {
        let mut grid = BitGrid::new(lattice.dims);
        if let Some(filling) = &filling {
            filling.set(&mut grid);
        }
        progress.stage("rasterize", surface.len() as u64);
        let counts = surface.rasterize(&mut grid, progress);
        (Data::Bits(grid), counts)
    } else {
        let (tree, counts) =
            surface.rasterize_sparse(filling.as_ref(), params.max_memory, progress)?;
        (Data::Sparse(tree), counts)
    };
    let counts = match (&filling, params.mode) {
        (Some(filling), Mode::None) => filling.counts,
        _ => counts,
    };
    progress.stage("pyramid", 0);
    let volume = Volume {
        frame: lattice.frame(),
        data,
    };
    let stats = describe(mesh, params, &lattice, &volume, counts, filling.zip(border));
    Ok((volume, stats))
}

fn describe(
    mesh: &Mesh,
    params: &Params,
    lattice: &Lattice,
    volume: &Volume,
    counts: Counts,
    inside: Option<(Filling, Border)>,
) -> Stats {
    let (census, grid, held_bytes) = match &volume.data {
        Data::Bits(bits) => (
            octree::census(bits),
            Storage::Dense,
            BitGrid::bytes_for(bits.dims()) as u64,
        ),
        Data::Sparse(tree) => (tree.census(), Storage::Sparse, tree.bytes()),
        _ => (Census::default(), params.grid, 0),
    };
    let levels = match params.levels {
        Levels::Xyz => pyramid::octree_levels(&census, lattice.dims),
        Levels::Xy => pyramid::column_levels(volume),
    };
    let set_voxels = census.nodes.first().copied().unwrap_or(0);
    let mut warnings = warnings(mesh, params, counts, inside.as_ref());
    if set_voxels == 0 {
        let why = if mesh.is_empty() {
            "no voxel is set: the model has no triangle, segment or point"
        } else if lattice.misses(mesh.used_bounds()) {
            "no voxel is set: the model lies outside of the box to cover"
        } else {
            "no voxel is set"
        };
        warnings.push(Warning::new("nothing-set", why, 1, None));
    }
    let orientation = inside.as_ref().map(|(filling, border)| Orientation {
        reversed: border.reversed.clone(),
        inverted: filling.inverted,
    });
    let filling = inside.as_ref().map(|(filling, _)| filling);
    Stats {
        dims: lattice.dims.map(|d| d as u64),
        spacing: [lattice.h; 3],
        origin: lattice.origin(),
        mode: params.mode,
        fill: params.fill,
        set_voxels,
        inside_voxels: filling.map(Filling::count),
        fill_disagreement: filling.map(|f| f.disagreeing),
        border_edges: inside.as_ref().map(|(_, border)| border.len() as u64),
        occupancy: set_voxels as f64 / volume.frame.len().max(1) as f64,
        grid,
        levels,
        dense_bytes: BitGrid::bytes_for(lattice.dims) as u64,
        sparse_bytes: census.mask_bytes(),
        triangles: mesh.triangles.len() as u64,
        degenerate_triangles: counts.degenerate,
        octree_nodes: census.made(),
        held_bytes,
        warnings,
        lattice: *lattice,
        orientation: orientation.unwrap_or_default(),
    }
}

/// What a user should know of the input, beside what its reader said.
fn warnings(
    mesh: &Mesh,
    params: &Params,
    counts: Counts,
    inside: Option<&(Filling, Border)>,
) -> Vec<Warning> {
    let mut found = Vec::new();
    let mut warn = |code: &str, message: &str, count: u64, first| {
        if count > 0 {
            found.push(Warning::new(code, message, count, first));
        }
    };
    warn(
        "degenerate-triangles",
        "triangles whose corners lie on one line",
        counts.degenerate,
        counts.first,
    );
    let thin = (mesh.segments.len() + mesh.points.len()) as u64;
    if matches!(params.mode, Mode::Z | Mode::ThreeAxis) {
        warn(
            "no-area",
            "segments and points meet no line through voxel centres; use --mode conservative",
            thin,
            None,
        );
    }
    if let Some((filling, border)) = inside {
        warn(
            "open-surface",
            "edges along which the surface is open or inconsistent",
            border.len() as u64,
            None,
        );
        warn(
            "reversed-triangles",
            "triangles wound against their patch, taken the other way round",
            border.reversed_count(),
            None,
        );
        warn(
            "inside-out",
            "the surface is wound inside out, and was taken so",
            u64::from(filling.inverted),
            None,
        );
    }
    found
}

impl Stats {
    /// Proven bounds on the error, none of them measured; the last is the one that [`TRADE`] names.
    ///
    /// What is inside is told by the winding number: parity on an open surface has no bound.
    pub fn bounds(&self) -> Vec<Accuracy> {
        let (to_surface, by) = match self.mode {
            _ if self.fill == Fill::Parity && self.border_edges != Some(0) => (
                None,
                "no bound: the surface is open, and parity sets whole rows behind its openings",
            ),
            Mode::Conservative => (
                Some(3f64.sqrt() / 2.0),
                "closed box overlap: half the diagonal of a voxel",
            ),
            Mode::Z | Mode::ThreeAxis => (
                Some(0.5),
                "the surface meets an arm of half a voxel through the centre",
            ),
            Mode::None => (Some(0.0), "only voxels whose centre is inside are set"),
        };
        let (missed, why) = match self.mode {
            Mode::Conservative => (Some(0.0), "every voxel that the surface meets is set"),
            _ => (
                None,
                "no bound: what lies between the lines through the centres is missed",
            ),
        };
        let measure = |measure: &str, unit: &str, bound, reference: &str| Accuracy {
            measure: measure.to_owned(),
            unit: unit.to_owned(),
            bound,
            reached: None,
            reference: reference.to_owned(),
            verified: false,
        };
        vec![
            measure(
                "largest distance from the centre of a set voxel to the model",
                "voxel",
                to_surface,
                by,
            ),
            measure(
                "largest distance from the surface to the nearest set voxel",
                "voxel",
                missed,
                why,
            ),
            measure(
                trade::TWO_SIDED.name,
                trade::TWO_SIDED.unit,
                to_surface
                    .zip(missed)
                    .map(|(there, back)| f64::max(there, back) * self.spacing[0]),
                "the larger of both distances above, times the edge of a voxel",
            ),
        ]
    }

    /// The grid the voxels stand in.
    pub fn lattice(&self) -> Lattice {
        self.lattice
    }

    /// Which way round the fill took the triangles; as they are without a fill.
    pub fn orientation(&self) -> &Orientation {
        &self.orientation
    }

    /// Octree nodes made against the nodes of the full tree.
    pub fn modelled(&self) -> Modelled {
        let full = full_nodes(self.dims);
        Modelled::new("octree nodes", self.octree_nodes, full, self.held_bytes)
    }
}

/// Nodes of all levels of the full octree of a grid, voxels included.
fn full_nodes(dims: [u64; 3]) -> u64 {
    let longest = dims.into_iter().fold(1, u64::max);
    let levels = longest.next_power_of_two().trailing_zeros();
    let level = |l: u32| dims.map(|d| d.div_ceil(1 << l)).iter().product::<u64>();
    (0..=levels).map(level).sum()
}

#[cfg(test)]
mod tests;
