//! Voxels made when a ray first comes near them.
//!
//! The root holds all primitives. A node that a ray enters hands its primitives on to the grandchildren
//! that they touch, and one of edge 16 sets its voxels; what no ray enters stays a list.

use super::Params;
use super::lattice::Lattice;
use super::raster::Surface;
use super::span::Span;
use super::triangle::Clip;
use crate::error::Result;
use crate::mesh::Mesh;
use crate::progress::Progress;
use crate::report::Modelled;
use crate::volume::octree::{Nodes, RayMasks, any_hit, below};
use crate::volume::trace::{GridRay, Visits};
use std::sync::OnceLock;
use wide::f64x4;

/// An octree of the voxels that a surface sets, made as far as rays go into it.
pub struct Lazy<'a> {
    surface: Surface<'a>,
    lattice: Lattice,
    edge: usize,
    root: Node,
}

/// A cube that the surface touches.
struct Node {
    /// Its lower corner over its edge.
    place: [u32; 3],
    edge: u32,
    /// The primitives that touch it.
    primitives: Box<[u32]>,
    made: OnceLock<Made>,
}

/// The children of a node: nodes, or bricks where its edge is 16, in the order of the bits that are set.
struct Made {
    mixed: u64,
    nodes: Box<[Node]>,
    bricks: Box<[u64]>,
}

/// A node, or a brick of one.
#[derive(Clone, Copy)]
pub struct At<'t> {
    node: &'t Node,
    brick: u32,
}

/// How much rays have made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Extent {
    /// Cubes of any edge, voxels included, that are known to hold a set voxel.
    pub nodes: u64,
    /// Voxels set.
    pub set_voxels: u64,
    /// Bytes held, lists of primitives included.
    pub bytes: u64,
}

impl<'a> Lazy<'a> {
    /// The surface of a mesh in the grid that `params` asks for; no voxel is set yet, and none is filled.
    ///
    /// Errs as [`super::voxelize`] does, but for memory: 4 bytes are held for each primitive and each
    /// node made that it touches. Cost: one pass over the primitives.
    pub fn new(mesh: &'a Mesh, params: &Params, progress: &dyn Progress) -> Result<Self> {
        params.check()?;
        progress.stage("fit", 0);
        let bounds = mesh.bounds();
        let lattice = Lattice::fit(bounds, params)?;
        lattice.check_reach(bounds)?;
        let surface = Surface::new(mesh, lattice, params.mode);
        let longest = lattice.dims.into_iter().fold(1, usize::max);
        let mut edge = 16;
        while edge < longest {
            edge *= 4;
        }
        Ok(Lazy {
            surface,
            lattice,
            edge,
            root: Node {
                place: [0; 3],
                edge: edge as u32,
                primitives: (0..surface.len() as u32).collect(),
                made: OnceLock::new(),
            },
        })
    }

    /// The grid that the voxels stand in.
    pub fn lattice(&self) -> Lattice {
        self.lattice
    }

    /// Whether a ray hits a set voxel: see [`any_hit`]. Makes the nodes on its way.
    pub fn any_hit(&self, ray: &GridRay, visits: &mut Visits) -> bool {
        // What is not made has no profile, so there is no mask to ask.
        any_hit(&self, ray, false, visits)
    }

    /// How much is made. The same for the same rays, in any order.
    pub fn extent(&self) -> Extent {
        let mut extent = Extent::default();
        self.root.add_to(&mut extent);
        // The root may be twice as large as the cube around the grid, which it then holds alone.
        let longest = self.lattice.dims.into_iter().fold(1, usize::max);
        extent.nodes -= u64::from(self.edge >= 2 * longest.next_power_of_two());
        extent
    }

    /// Octree nodes made against the nodes of the full tree.
    pub fn modelled(&self) -> Modelled {
        let Extent { nodes, bytes, .. } = self.extent();
        let full = super::full_nodes(self.lattice.dims.map(|d| d as u64));
        Modelled::new("octree nodes", nodes, full, bytes)
    }

    /// The children of a node, made by the first who asks.
    fn made<'t>(&self, node: &'t Node) -> &'t Made {
        node.made.get_or_init(|| {
            if node.edge == 16 {
                self.set(node)
            } else {
                self.split(node)
            }
        })
    }

    /// The cubes of a node's grandchildren within the grid, counted in their own edge.
    fn cubes(&self, node: &Node, edge: u32) -> Clip {
        let lo = node.place.map(|c| (4 * c) as i32);
        let dims = self.lattice.dims.map(|d| d.div_ceil(edge as usize) as i32);
        Clip::new(lo, std::array::from_fn(|a| (lo[a] + 3).min(dims[a] - 1)))
    }

    fn split(&self, node: &Node) -> Made {
        let edge = node.edge / 4;
        let clip = self.cubes(node, edge);
        let mut lists: [Vec<u32>; 64] = std::array::from_fn(|_| Vec::new());
        let mut rows: Vec<Span> = Vec::new();
        for index in &node.primitives {
            let lanes = self.surface.lanes(*index as usize);
            // Exact, and by the closed test of a voxel, so no voxel of a cube can be missed.
            let scaled = lanes.map(|lane| lane * f64x4::splat(1.0 / f64::from(edge)));
            super::overlap::overlap(&scaled, &clip, &mut rows, &mut |x0, x1, y, z| {
                for x in x0..=x1 {
                    lists[child([x, y, z].map(|c| c as usize & 3))].push(*index);
                }
            });
        }
        let mixed = mask(&lists, |list| !list.is_empty());
        let nodes = lists
            .into_iter()
            .enumerate()
            .filter(|(_, list)| !list.is_empty());
        let nodes = nodes.map(|(i, list)| {
            let at = |a: usize| (i >> a & 1 | (i >> (a + 3) & 1) << 1) as u32;
            Node {
                place: std::array::from_fn(|a| 4 * node.place[a] + at(a)),
                edge,
                primitives: list.into_boxed_slice(),
                made: OnceLock::new(),
            }
        });
        Made {
            mixed,
            nodes: nodes.collect(),
            bricks: Box::default(),
        }
    }

    fn set(&self, node: &Node) -> Made {
        let lo = node.place.map(|c| (16 * c) as i32);
        let last = self.lattice.dims.map(|d| d as i32 - 1);
        let clip = Clip::new(lo, std::array::from_fn(|a| (lo[a] + 15).min(last[a])));
        let mut bricks = [0u64; 64];
        let mut rows = Vec::new();
        for index in &node.primitives {
            let lanes = self.surface.lanes(*index as usize);
            self.surface.set(
                *index as usize,
                &lanes,
                &clip,
                &mut rows,
                &mut |x0, x1, y, z| {
                    for x in x0..=x1 {
                        let at = [x, y, z].map(|c| c as usize & 15);
                        let bit = (at[0] & 3) + 4 * (at[1] & 3) + 16 * (at[2] & 3);
                        bricks[child(at.map(|c| c / 4))] |= 1 << bit;
                    }
                },
            );
        }
        Made {
            mixed: mask(&bricks, |bits| *bits != 0),
            nodes: Box::default(),
            bricks: bricks.into_iter().filter(|bits| *bits != 0).collect(),
        }
    }
}

impl<'t> Nodes for &'t Lazy<'_> {
    type At = At<'t>;

    fn dims(&self) -> [usize; 3] {
        self.lattice.dims
    }

    fn edge(&self) -> usize {
        self.edge
    }

    fn root(&self) -> At<'t> {
        At {
            node: &self.root,
            brick: 0,
        }
    }

    fn masks(&self, at: At<'t>) -> RayMasks {
        RayMasks {
            mixed: self.made(at.node).mixed,
            full: 0,
            profile: u64::MAX,
        }
    }

    fn below(&self, at: At<'t>, child: usize) -> At<'t> {
        let made = self.made(at.node);
        let brick = below(made.mixed, child);
        let node = made.nodes.get(brick as usize).unwrap_or(at.node);
        At { node, brick }
    }

    fn brick(&self, at: At<'t>) -> u64 {
        self.made(at.node).bricks[at.brick as usize]
    }
}

impl Node {
    fn add_to(&self, extent: &mut Extent) {
        extent.bytes += (size_of::<Node>() + size_of_val(&*self.primitives)) as u64;
        extent.nodes += 1;
        let Some(made) = self.made.get() else {
            return;
        };
        // The level between: an octant of the children, eight bits of the mask.
        extent.nodes += (0..8).filter(|o| made.mixed >> (8 * o) & 0xff != 0).count() as u64;
        for node in &made.nodes {
            node.add_to(extent);
        }
        for bits in &made.bricks {
            let set = u64::from(bits.count_ones());
            extent.nodes += 1 + octants(*bits) + set;
            extent.set_voxels += set;
            extent.bytes += 8;
        }
    }
}

/// Octants of a brick that hold a set voxel.
fn octants(bits: u64) -> u64 {
    let across_x = bits | bits >> 1;
    let across_y = across_x | across_x >> 4;
    let across_z = across_y | across_y >> 16;
    u64::from((across_z & 0x0000_0505_0000_0505).count_ones())
}

/// The bit of a child at a place among the four along each axis.
fn child(place: [usize; 3]) -> usize {
    (0..3).fold(0, |bits, a| {
        bits | (place[a] & 1) << a | (place[a] >> 1) << (a + 3)
    })
}

fn mask<T>(items: &[T; 64], is_set: impl Fn(&T) -> bool) -> u64 {
    items
        .iter()
        .enumerate()
        .fold(0, |mask, (i, item)| mask | u64::from(is_set(item)) << i)
}
