//! The paper's octree of discs, with its corners put right, and made only where rays go.
//!
//! Linsen, Müller and Rosenthal (2007), section 4.2: a leaf splits when it would hold the centres of
//! more than a few discs; then each disc is also put into every other leaf that it may touch. What
//! a cell becomes depends on the discs that reach it alone, so cells of some depth wait until a
//! ray comes by; the tree below is the one that would have been there from the start.

use super::disc::{Hit, Plate, Ray};
use super::tree::Visits;
use crate::numeric::vector::{Vec3, add, scale};
use crate::points::Splat;
use crate::spatial::aabb::Aabb;
use std::ops::ControlFlow;
use std::sync::OnceLock;

/// Most centres in a leaf. The paper says "small".
pub(super) const LEAF_DISCS: usize = 16;
/// Cells of this depth are not split.
pub(super) const MOST_DEPTH: u32 = 20;
/// Cells of this depth wait for a ray.
pub(super) const WAITING_DEPTH: u32 = 4;

/// By this cells are wider than they are: more than rounding can move a hit out of the cell it is in.
const SLACK: f64 = 1.0 / (1u64 << 40) as f64;
/// Directions flatter than this against an axis are taken as this flat.
const FLAT: f64 = 1e-30;

/// The corners of the square around a disc, in radii along its axes.
///
/// The paper has (0, 0), (0, 1), (1, 0) and (1, 1), which is a quarter of it.
pub(super) const SQUARE: [[f64; 2]; 4] = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]];

/// What a link leads to: the kind in its upper two bits, a number below.
const NODE: u32 = 0;
const LEAF: u32 = 1 << 30;
const WAITING: u32 = 2 << 30;
const KIND: u32 = 3 << 30;

/// A cube.
#[derive(Debug, Clone, Copy)]
struct Cell {
    lo: Vec3,
    side: f64,
    depth: u32,
}

/// A tree below a cell. The last of its links is that of the cell.
#[derive(Debug, Default)]
struct Part {
    nodes: Vec<[u32; 8]>,
    /// Where the discs of each leaf begin in `discs`, and at last where they end.
    starts: Vec<u32>,
    discs: Vec<u32>,
    plates: Vec<Plate>,
    root: u32,
    depth: u32,
    waiting: Vec<Waiting>,
}

/// A cell that waits for a ray.
#[derive(Debug)]
struct Waiting {
    cell: Cell,
    /// The discs with their centre in it.
    homes: Vec<u32>,
    /// Those, and all that may touch it.
    all: Vec<u32>,
    part: OnceLock<Part>,
}

/// The octree of an object's discs.
#[derive(Debug)]
pub(super) struct Octree {
    cell: Cell,
    top: Part,
    corners: [[f64; 2]; 4],
}

/// How much of an octree is there.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Extent {
    /// Nodes and leaves that are there.
    pub nodes: u64,
    /// Those of the whole tree.
    pub full: u64,
    pub leaves: u64,
    pub depth: u64,
    /// Discs in leaves, each counted in every leaf.
    pub refs: u64,
    pub bytes: u64,
}

impl Octree {
    /// The octree over discs in a box.
    ///
    /// Cost: O(n) at first, O(n log n) and a few references per disc when rays have gone everywhere.
    pub fn new(splats: &[Splat], bounds: Aabb) -> Octree {
        Octree::with_corners(splats, bounds, SQUARE)
    }

    /// The octree with other corners in its test of a disc against a cell.
    pub(super) fn with_corners(splats: &[Splat], bounds: Aabb, corners: [[f64; 2]; 4]) -> Octree {
        let side = bounds.extent().into_iter().fold(0.0, f64::max);
        let centre = if bounds.is_empty() {
            [0.0; 3]
        } else {
            bounds.centre()
        };
        let cell = Cell {
            lo: centre.map(|c| c - 0.5 * side),
            side,
            depth: 0,
        };
        let sized = (0..splats.len() as u32).filter(|i| splats[*i as usize].radius > 0.0);
        let all: Vec<u32> = sized.collect();
        let builder = Builder {
            splats,
            corners: &corners,
        };
        let top = builder.part(cell, all.clone(), all, WAITING_DEPTH);
        Octree { cell, top, corners }
    }

    /// As [`super::tree::Tree::walk`].
    pub fn walk(
        &self,
        splats: &[Splat],
        ray: &Ray,
        limit: f64,
        visits: &mut Visits,
        visit: &mut impl FnMut(Hit) -> ControlFlow<(), f64>,
    ) -> ControlFlow<()> {
        let steep = |a: usize| {
            let d = ray.direction[a];
            if d.abs() > FLAT { d } else { FLAT.copysign(d) }
        };
        let mut walk = Walk {
            builder: Builder {
                splats,
                corners: &self.corners,
            },
            ray,
            inverse: std::array::from_fn(|a| 1.0 / steep(a)),
            first: (0..3).fold(0, |m, a| m | usize::from(ray.direction[a] < 0.0) << a),
            far: limit,
            visits,
            visit,
        };
        walk.go(&self.top, self.top.root, self.cell)
    }

    /// How much of it is there.
    pub fn extent(&self, splats: &[Splat]) -> Extent {
        let mut extent = Extent::default();
        self.top.count(splats, &mut extent);
        extent.bytes += size_of::<Octree>() as u64;
        extent
    }
}

impl Part {
    fn count(&self, splats: &[Splat], extent: &mut Extent) {
        let leaves = self.starts.len().saturating_sub(1) as u64;
        let nodes = self.nodes.len() as u64 + leaves;
        extent.nodes += nodes;
        extent.full += nodes;
        extent.leaves += leaves;
        extent.depth = extent.depth.max(self.depth.into());
        extent.refs += self.discs.len() as u64;
        extent.bytes += size_of_val(self.nodes.as_slice()) as u64
            + size_of_val(self.starts.as_slice()) as u64
            + size_of_val(self.discs.as_slice()) as u64
            + size_of_val(self.plates.as_slice()) as u64;
        for waiting in &self.waiting {
            let lists = waiting.homes.len() + waiting.all.len();
            extent.bytes += (size_of::<Waiting>() + lists * size_of::<u32>()) as u64;
            match waiting.part.get() {
                Some(part) => part.count(splats, extent),
                None => extent.full += nodes_of(splats, waiting.cell, &waiting.homes),
            }
        }
    }
}

/// Nodes and leaves of the tree that a cell would become.
fn nodes_of(splats: &[Splat], cell: Cell, homes: &[u32]) -> u64 {
    if !cell.splits(splats, homes) {
        return 1;
    }
    let below = cell.shared_out(splats, homes);
    let nodes = (0..8).map(|i| nodes_of(splats, cell.child(i), &below[i]));
    1 + nodes.sum::<u64>()
}

impl Cell {
    fn child(&self, i: usize) -> Cell {
        let side = 0.5 * self.side;
        let along = |a: usize| if i >> a & 1 == 1 { side } else { 0.0 };
        Cell {
            lo: add(self.lo, [along(0), along(1), along(2)]),
            side,
            depth: self.depth + 1,
        }
    }

    /// Whether a cell with these centres is split: not where all are one, which no split parts.
    fn splits(&self, splats: &[Splat], homes: &[u32]) -> bool {
        let centre = |i: &u32| splats[*i as usize].centre;
        homes.len() > LEAF_DISCS
            && self.depth < MOST_DEPTH
            && homes.iter().any(|i| centre(i) != centre(&homes[0]))
    }

    /// The centres by the child that they are in.
    fn shared_out(&self, splats: &[Splat], homes: &[u32]) -> [Vec<u32>; 8] {
        let middle = self.child(7).lo;
        let mut below: [Vec<u32>; 8] = Default::default();
        for i in homes {
            let centre = splats[*i as usize].centre;
            let child = (0..3).fold(0, |c, a| c | usize::from(centre[a] >= middle[a]) << a);
            below[child].push(*i);
        }
        below
    }

    /// Whether the tight box around a disc reaches into it.
    fn is_reached(&self, splat: &Splat) -> bool {
        let bounds = splat.bounds();
        (0..3).all(|a| {
            bounds.lo[a] <= self.lo[a] + self.side + SLACK && bounds.hi[a] >= self.lo[a] - SLACK
        })
    }

    /// Whether no plane of the cell has all corners of a disc's square on its outer side.
    fn may_hold(&self, splat: &Splat, corners: &[[f64; 2]; 4]) -> bool {
        let [u, v] = [splat.tangent, splat.bitangent()].map(|axis| scale(axis, splat.radius));
        let corners = corners.map(|[x, y]| add(splat.centre, add(scale(u, x), scale(v, y))));
        (0..3).all(|a| {
            let (lo, hi) = (self.lo[a] - SLACK, self.lo[a] + self.side + SLACK);
            corners.iter().any(|c| c[a] >= lo) && corners.iter().any(|c| c[a] <= hi)
        })
    }
}

/// Makes parts of the tree.
#[derive(Clone, Copy)]
struct Builder<'a> {
    splats: &'a [Splat],
    corners: &'a [[f64; 2]; 4],
}

impl Builder<'_> {
    /// The tree below a cell, as far as the cells of a depth, which wait.
    fn part(&self, cell: Cell, homes: Vec<u32>, all: Vec<u32>, waiting_depth: u32) -> Part {
        let mut part = Part {
            starts: vec![0],
            depth: cell.depth,
            ..Part::default()
        };
        part.root = self.grow(cell, homes, all, waiting_depth, &mut part);
        let plate = |i: &u32| Plate::new(&self.splats[*i as usize]);
        part.plates = part.discs.iter().map(plate).collect();
        part
    }

    /// Both phases at once: whether a cell splits is decided by the centres in it, and the discs that
    /// reach it are handed down. `all` holds `homes`, both in rising order.
    fn grow(
        &self,
        cell: Cell,
        homes: Vec<u32>,
        all: Vec<u32>,
        waiting_depth: u32,
        part: &mut Part,
    ) -> u32 {
        part.depth = part.depth.max(cell.depth);
        if !cell.splits(self.splats, &homes) {
            let fits = |i: &u32| {
                let splat = &self.splats[*i as usize];
                homes.binary_search(i).is_ok() || cell.may_hold(splat, self.corners)
            };
            part.discs.extend(all.iter().copied().filter(fits));
            part.starts.push(part.discs.len() as u32);
            return LEAF | (part.starts.len() - 2) as u32;
        }
        if cell.depth == waiting_depth {
            part.waiting.push(Waiting {
                cell,
                homes,
                all,
                part: OnceLock::new(),
            });
            return WAITING | (part.waiting.len() - 1) as u32;
        }
        let below = cell.shared_out(self.splats, &homes);
        drop(homes);
        let at = part.nodes.len();
        part.nodes.push([0; 8]);
        for (i, homes) in below.into_iter().enumerate() {
            let child = cell.child(i);
            let reached = |i: &u32| child.is_reached(&self.splats[*i as usize]);
            let all = all.iter().copied().filter(reached).collect();
            part.nodes[at][i] = self.grow(child, homes, all, waiting_depth, part);
        }
        NODE | at as u32
    }
}

/// A ray on its way through the tree.
struct Walk<'a, F> {
    builder: Builder<'a>,
    ray: &'a Ray,
    inverse: Vec3,
    /// The child that a ray in this direction comes to first.
    first: usize,
    far: f64,
    visits: &'a mut Visits,
    visit: &'a mut F,
}

impl<F: FnMut(Hit) -> ControlFlow<(), f64>> Walk<'_, F> {
    /// Whether the ray meets a cell, which is a little wider, by the limit.
    #[inline]
    fn meets(&self, cell: &Cell) -> bool {
        let (mut start, mut end) = (0.0_f64, self.far);
        for a in 0..3 {
            let origin = self.ray.origin[a];
            let lo = (cell.lo[a] - SLACK - origin) * self.inverse[a];
            let hi = (cell.lo[a] + cell.side + SLACK - origin) * self.inverse[a];
            start = start.max(lo.min(hi));
            end = end.min(lo.max(hi));
        }
        // More than rounding moves both ends.
        start - end <= SLACK * (1.0 + start.abs())
    }

    fn go(&mut self, part: &Part, link: u32, cell: Cell) -> ControlFlow<()> {
        if !self.meets(&cell) {
            return ControlFlow::Continue(());
        }
        let number = (link & !KIND) as usize;
        match link & KIND {
            LEAF => self.leaf(part, number),
            WAITING => {
                let waiting = &part.waiting[number];
                let below = waiting.part.get_or_init(|| {
                    let (homes, all) = (waiting.homes.clone(), waiting.all.clone());
                    self.builder.part(waiting.cell, homes, all, u32::MAX)
                });
                self.go(below, below.root, cell)
            }
            _ => {
                // Children whose number differs from the first in fewer bits come earlier.
                (0..8).try_for_each(|i| {
                    let i = i ^ self.first;
                    self.go(part, part.nodes[number][i], cell.child(i))
                })
            }
        }
    }

    fn leaf(&mut self, part: &Part, leaf: usize) -> ControlFlow<()> {
        let range = part.starts[leaf] as usize..part.starts[leaf + 1] as usize;
        self.visits.leaves += 1;
        self.visits.tests += range.len() as u64;
        for (plate, disc) in part.plates[range.clone()].iter().zip(&part.discs[range]) {
            match plate.meet(self.ray) {
                Some((t, off)) if t <= self.far => {
                    let hit = Hit {
                        t,
                        off,
                        disc: *disc,
                    };
                    self.far = (self.visit)(hit)?;
                }
                _ => {}
            }
        }
        ControlFlow::Continue(())
    }
}
