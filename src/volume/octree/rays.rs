//! Rays through the octree.

use super::Octree;
use crate::numeric::vector::Vec3;
use crate::volume::trace::{GridRay, Visits};
use wide::f32x4;

/// Slices that the profile of a node tells apart.
const SLICES: usize = 64;

/// By how much of its edge a child is swollen for the choice of children, at least: far more than
/// single precision rounds by, far less than what costs time.
const SWELL: f64 = 1.0 / (1u64 << 12) as f64;

/// Directions are held to at least this share of their largest component for the choice of children:
/// across the largest grid that moves a ray by less than [`SWELL`] of a voxel.
const LEAST: f64 = 1.0 / (1u64 << 40) as f64;

/// What rays ask of an octree: each node with its grandchildren, two levels in one.
///
/// Grandchild `i` of a node of edge `4 e` lies at `e (b0 + 2 b3, b1 + 2 b4, b2 + 2 b5)` from its lower
/// corner, where `b` are the bits of `i`; those of nodes of edge 16 are bricks.
pub trait Nodes {
    /// A node or a brick.
    type At: Copy;

    /// Voxels along x, y, z.
    fn dims(&self) -> [usize; 3];

    /// Edge of the root in voxels, a power of 4 from 16 on.
    fn edge(&self) -> usize;

    /// The root.
    fn root(&self) -> Self::At;

    /// Which children a node has.
    fn masks(&self, node: Self::At) -> Masks;

    /// A child of a node that is a node, or a brick, of its own.
    fn below(&self, node: Self::At, child: usize) -> Self::At;

    /// The voxels of a brick: voxel (x, y, z) is bit `x + 4 y + 16 z`.
    fn brick(&self, brick: Self::At) -> u64;
}

/// The children of a node.
#[derive(Debug, Clone, Copy)]
pub struct Masks {
    /// Which are nodes, or bricks, of their own.
    pub mixed: u64,
    /// Which are all set.
    pub full: u64,
    /// Which slices across z hold a set voxel: one bit per slice of a node of up to 64 voxels, one
    /// per 64th of a larger one.
    pub profile: u64,
}

/// An octree laid out for rays.
#[derive(Debug)]
pub struct RayTree<'a> {
    tree: &'a Octree,
    edge: usize,
    levels: Vec<Vec<Node>>,
}

/// A node and its grandchildren.
#[derive(Debug, Clone, Copy)]
struct Node {
    masks: Masks,
    /// Index of the first in the next level, or among the bricks.
    first: u32,
}

impl<'a> RayTree<'a> {
    /// The tree with the profiles of its nodes.
    ///
    /// Cost: one pass over the bricks and the nodes; 32 bytes held for each node of every second level.
    pub fn new(tree: &'a Octree) -> Self {
        let mut levels = Vec::new();
        let mut below: Vec<u64> = tree.bricks.iter().map(|bits| layers(*bits)).collect();
        let mut edge = 4;
        let mut rest = &tree.levels[..];
        while let [above @ .., lower] = rest {
            edge *= 4;
            let child_slices = (edge / 4).min(SLICES);
            let count = above.last().map_or(1, |upper| upper.mixed.len());
            let node = |index: usize| {
                let (mut mixed, mut full) = (0, 0);
                let first = match above.last() {
                    // With an odd number of levels the root has children in one corner.
                    None => {
                        mixed = u64::from(lower.mixed[0]);
                        full = u64::from(lower.full[0]);
                        lower.first[0]
                    }
                    Some(upper) => {
                        let first = upper.first[index] as usize;
                        let mut next = first;
                        for child in 0..8 {
                            if upper.mixed[index] >> child & 1 == 1 {
                                mixed |= u64::from(lower.mixed[next]) << (8 * child);
                                full |= u64::from(lower.full[next]) << (8 * child);
                                next += 1;
                            } else if upper.full[index] >> child & 1 == 1 {
                                full |= 0xff << (8 * child);
                            }
                        }
                        lower.first.get(first).copied().unwrap_or(0)
                    }
                };
                let profile = profile([mixed, full], &below[first as usize..], child_slices);
                Node {
                    masks: Masks {
                        mixed,
                        full,
                        profile,
                    },
                    first,
                }
            };
            let nodes: Vec<Node> = (0..count).map(node).collect();
            below = nodes.iter().map(|node| node.masks.profile).collect();
            levels.push(nodes);
            rest = above.split_last().map_or(&[], |(_, above)| above);
        }
        levels.reverse();
        RayTree { tree, edge, levels }
    }

    /// Bytes held, those of the octree included.
    pub fn bytes(&self) -> u64 {
        let nodes: usize = self.levels.iter().map(Vec::len).sum();
        self.tree.bytes() + (nodes * size_of::<Node>()) as u64
    }

    /// Whether a ray hits a set voxel: see [`any_hit`].
    pub fn any_hit(&self, ray: &GridRay, masked: bool, visits: &mut Visits) -> bool {
        any_hit(self, ray, masked, visits)
    }
}

impl Nodes for RayTree<'_> {
    /// Its depth and its index; of a brick the index counts.
    type At = [u32; 2];

    fn dims(&self) -> [usize; 3] {
        self.tree.dims
    }

    fn edge(&self) -> usize {
        self.edge
    }

    fn root(&self) -> [u32; 2] {
        [0, 0]
    }

    #[inline]
    fn masks(&self, [depth, index]: [u32; 2]) -> Masks {
        self.levels[depth as usize][index as usize].masks
    }

    #[inline]
    fn below(&self, [depth, index]: [u32; 2], child: usize) -> [u32; 2] {
        let node = &self.levels[depth as usize][index as usize];
        [depth + 1, node.first + below(node.masks.mixed, child)]
    }

    #[inline]
    fn brick(&self, [_, index]: [u32; 2]) -> u64 {
        self.tree.bricks[index as usize]
    }
}

/// How many of the children that are nodes come before one of them.
#[inline]
pub fn below(mixed: u64, child: usize) -> u32 {
    (mixed & ((1 << child) - 1)).count_ones()
}

/// Whether a ray hits a set voxel, by the rule of [`GridRay::hits`].
///
/// With `masked`, a node is left at once when none of its slices between those in which the ray enters
/// and leaves it holds anything; without, only what is empty as a whole is left out. The answer is the
/// same. Cost: the nodes on the way, front to back, until one voxel is hit.
///
/// Revelles, Ureña and Lastra, "An efficient parametric algorithm for octree traversal" (2000), for
/// two levels at once; the mask is that of Forest, Barthe and Paulin, "Real-time hierarchical
/// binary-scene voxelization" (2009). Children are chosen in single precision with room for its
/// rounding, so some that the ray just misses are looked at; voxels and full cubes are hit by the rule
/// alone.
pub fn any_hit<N: Nodes>(nodes: &N, ray: &GridRay, masked: bool, visits: &mut Visits) -> bool {
    let dims = nodes.dims().map(|d| d as f64);
    let [start, end] = ray.cuboid([0.0; 3], dims);
    if start.is_nan() || end.is_nan() || start > end {
        return false;
    }
    let edge = nodes.edge() as f64;
    let (way, length) = Way::new(ray, [start, end], edge, masked);
    let child = Edge {
        edge: edge / 4.0,
        inverse: 4.0 / edge,
    };
    enter(
        nodes,
        &way,
        nodes.root(),
        child,
        [0.0; 3],
        [0.0, length],
        visits,
    )
}

/// The edge of a node's children, and one over it.
#[derive(Clone, Copy)]
struct Edge {
    edge: f64,
    inverse: f64,
}

/// Whether the ray hits a voxel of a node, which it is in between two parameters.
fn enter<N: Nodes>(
    nodes: &N,
    way: &Way,
    node: N::At,
    child: Edge,
    corner: Vec3,
    span: [f64; 2],
    visits: &mut Visits,
) -> bool {
    let masks = nodes.masks(node);
    let slabs = Slabs::new(way, corner, child.inverse, span);
    if way.masked && masks.profile & slabs.slices(way, child.edge) == 0 {
        return false;
    }
    visits.nodes += 1;
    let met = slabs.met(&way.children, masks.mixed | masks.full);
    if met & masks.full != 0 && hits_full(way, met & masks.full, corner, child.edge) {
        return true;
    }
    let mut rest = in_order(met & masks.mixed, way.flip);
    while rest != 0 {
        let order = rest.trailing_zeros() as usize;
        rest &= rest - 1;
        let below = nodes.below(node, order ^ way.flip);
        let place = places(order);
        let corner = std::array::from_fn(|a| corner[a] + place[a] as f64 * child.edge);
        let within = slabs.within(place);
        let span = within.map(|t| span[0] + f64::from(t) * child.edge);
        let hits = if child.edge == 4.0 {
            hits_brick(nodes.brick(below), way, corner, span, visits)
        } else {
            let grandchild = Edge {
                edge: child.edge / 4.0,
                inverse: child.inverse * 4.0,
            };
            enter(nodes, way, below, grandchild, corner, span, visits)
        };
        if hits {
            return true;
        }
    }
    false
}

/// Whether the ray hits one of the children of a mask, which are all set.
#[cold]
fn hits_full(way: &Way, full: u64, corner: Vec3, edge: f64) -> bool {
    let mut rest = full;
    while rest != 0 {
        let place = places(rest.trailing_zeros() as usize ^ way.flip);
        rest &= rest - 1;
        let corner = std::array::from_fn(|a| corner[a] + place[a] as f64 * edge);
        let [first, last] = way.ray.cuboid(way.turned_back(corner, edge), [edge; 3]);
        if first <= last {
            return true;
        }
    }
    false
}

/// Whether the ray hits a voxel of a brick.
#[inline]
fn hits_brick(bits: u64, way: &Way, corner: Vec3, span: [f64; 2], visits: &mut Visits) -> bool {
    visits.nodes += 1;
    let slabs = Slabs::new(way, corner, 1.0, span);
    let mut rest = bits & slabs.met(&way.voxels, bits);
    if rest == 0 {
        return false;
    }
    let corner = way.turned_back(corner, 4.0);
    while rest != 0 {
        let bit = rest.trailing_zeros() as usize;
        rest &= rest - 1;
        visits.voxels += 1;
        let voxel = [bit & 3, bit >> 2 & 3, bit >> 4];
        let voxel = std::array::from_fn(|a| corner[a] + voxel[a] as f64);
        let [first, last] = way.ray.cuboid(voxel, [1.0; 3]);
        if first <= last {
            return true;
        }
    }
    false
}

/// A ray in the tree, turned so that it goes upwards along all axes, from where it enters the grid; its
/// longest component is 1, so that its parameter counts voxels.
struct Way<'a> {
    ray: &'a GridRay,
    edge: f64,
    origin: Vec3,
    direction: Vec3,
    inverse: [f32; 3],
    /// By what children in the order of the ray differ from those of a node.
    flip: usize,
    is_turned: [bool; 3],
    /// The children of a node, and the voxels of a brick, by their place in the order of the ray.
    children: [&'static Rows; 3],
    voxels: [&'static Rows; 3],
    /// Whether the profiles of nodes are asked.
    masked: bool,
    /// What children are swollen by, in voxels.
    haze: f64,
}

impl<'a> Way<'a> {
    /// The ray between two parameters, and its length.
    #[inline]
    fn new(ray: &'a GridRay, [start, end]: [f64; 2], edge: f64, masked: bool) -> (Self, f64) {
        let direction = ray.crossing();
        let longest = direction.iter().fold(0.0f64, |m, d| m.max(d.abs()));
        let is_turned = direction.map(|d| d < 0.0);
        let origin = std::array::from_fn(|a| {
            let place = if direction[a] == 0.0 {
                ray.origin[a]
            } else {
                ray.at(start, a)
            };
            if is_turned[a] { edge - place } else { place }
        });
        // No way through the root is longer; parameters may overflow.
        let (length, direction) = if longest > 0.0 {
            (
                ((end - start) * longest).min(2.0 * edge),
                direction.map(|d| (d / longest).abs()),
            )
        } else {
            (0.0, [0.0; 3])
        };
        let turned = is_turned.map(usize::from);
        let way = Way {
            ray,
            edge,
            origin,
            direction,
            inverse: direction.map(|d| (1.0 / d.max(LEAST)) as f32),
            flip: (turned[0] * 0b001_001) | (turned[1] * 0b010_010) | (turned[2] * 0b100_100),
            is_turned,
            children: [0, 1, 2].map(|a| &MORTON[turned[a]][a]),
            voxels: [0, 1, 2].map(|a| &ROWS[turned[a]][a]),
            masked,
            haze: 2.0 * ray.haze(),
        };
        (way, length)
    }

    /// The lower corner, in the grid, of a cube with this lower corner in the turned tree.
    #[inline]
    fn turned_back(&self, corner: Vec3, edge: f64) -> Vec3 {
        std::array::from_fn(|a| {
            if self.is_turned[a] {
                self.edge - edge - corner[a]
            } else {
                corner[a]
            }
        })
    }
}

/// When a ray is in the four slabs of a node's children across each axis: parameters counted in their
/// edge from where it enters the node.
struct Slabs {
    enter: [f32x4; 3],
    leave: [f32x4; 3],
    /// Where the ray enters, across z, and where it leaves, at most.
    z: [f32; 2],
}

impl Slabs {
    #[inline]
    fn new(way: &Way, corner: Vec3, per_edge: f64, [start, end]: [f64; 2]) -> Self {
        let swell = (SWELL + way.haze * per_edge) as f32;
        let last = ((end - start) * per_edge) as f32;
        let index = f32x4::new([0.0, 1.0, 2.0, 3.0]);
        let place: [f32; 3] = std::array::from_fn(|a| {
            ((way.origin[a] + start * way.direction[a] - corner[a]) * per_edge) as f32
        });
        let planes = |a: usize, moved: f32| {
            (index + f32x4::splat(moved - place[a])) * f32x4::splat(way.inverse[a])
        };
        Slabs {
            enter: [0, 1, 2].map(|a| planes(a, -swell).fast_max(f32x4::ZERO)),
            leave: [0, 1, 2].map(|a| planes(a, 1.0 + swell).fast_min(f32x4::splat(last))),
            z: [
                place[2] - swell,
                place[2] + last * way.direction[2] as f32 + swell,
            ],
        }
    }

    /// When the ray is in the child at a place.
    #[inline]
    fn within(&self, [x, y, z]: [usize; 3]) -> [f32; 2] {
        let [ex, ey, ez] = self.enter.each_ref().map(f32x4::as_array);
        let [lx, ly, lz] = self.leave.each_ref().map(f32x4::as_array);
        // Without the care for what is no number that f32::max takes.
        let greater = |a: f32, b: f32| if a > b { a } else { b };
        let less = |a: f32, b: f32| if a < b { a } else { b };
        [
            greater(ex[x], greater(ey[y], ez[z])),
            less(lx[x], less(ly[y], lz[z])),
        ]
    }

    /// The children among `asked` that the ray meets, and maybe others: a child is met when it is
    /// entered, across every axis, before it is left across any.
    #[inline]
    fn met(&self, rows: &[&Rows; 3], asked: u64) -> u64 {
        let [_, ey, ez] = self.enter;
        let [_, ly, lz] = self.leave;
        let row = |a: usize, met: u32| rows[a][met as usize & 15];
        let between = |enter: f32x4, leave: f32x4, from: f32, to: f32| {
            let met = enter.simd_le(f32x4::splat(to)) & leave.simd_ge(f32x4::splat(from));
            met.to_bitmask()
        };
        let mut met = 0;
        let (enter, leave) = (self.enter[0].as_array(), self.leave[0].as_array());
        for j in 0..4 {
            let [enter, leave] = [enter[j], leave[j]];
            if enter <= leave {
                let y = row(1, between(ey, ly, enter, leave));
                let z = row(2, between(ez, lz, enter, leave));
                met |= row(0, 1 << j) & y & z;
            }
        }
        if met & asked == 0 {
            return 0;
        }
        let mut both = 0;
        let (enter, leave) = (ey.as_array(), ly.as_array());
        for j in 0..4 {
            let [enter, leave] = [enter[j], leave[j]];
            if enter <= leave {
                both |= row(1, 1 << j) & row(2, between(ez, lz, enter, leave));
            }
        }
        met & both
    }

    /// The slices of the node's profile between those in which the ray enters and leaves it.
    #[inline]
    fn slices(&self, way: &Way, edge: f64) -> u64 {
        let count = (4.0 * edge).min(SLICES as f64) as f32;
        let scale = count / 4.0;
        let last = count as i32 - 1;
        let low = ((self.z[0] * scale) as i32).clamp(0, last);
        let high = ((self.z[1] * scale) as i32).clamp(0, last);
        let (low, high) = if way.is_turned[2] {
            (last - high, last - low)
        } else {
            (low, high)
        };
        (u64::MAX << low) & (u64::MAX >> (63 - high))
    }
}

/// The place of a child among the four along each axis.
#[inline]
fn places(child: usize) -> [usize; 3] {
    [0, 1, 2].map(|a| (child >> a & 1) | (child >> (a + 3) & 1) << 1)
}

/// By a mask of the four places along an axis, what lies at one of them.
type Rows = [u64; 16];

/// The bits of a brick whose x (or y, or z) is among those of a mask of four, and those whose mirror
/// image is.
const ROWS: [[Rows; 3]; 2] = tables([0, 1, 2, 3, 4, 5]);

/// The same of a node's children.
const MORTON: [[Rows; 3]; 2] = tables([0, 3, 1, 4, 2, 5]);

/// With the lower and the upper bit of x, of y and of z at these bits of an index.
const fn tables(bits: [u32; 6]) -> [[Rows; 3]; 2] {
    let mut tables = [[[0; 16]; 3]; 2];
    let mut entry = 0;
    while entry < 2 * 3 * 16 * 64 {
        let (turned, a) = (entry / (3 * 16 * 64), entry / (16 * 64) % 3);
        let (mask, index) = (entry / 64 % 16, entry % 64);
        let place = (index >> bits[2 * a] & 1) | (index >> bits[2 * a + 1] & 1) << 1;
        let place = if turned == 1 { 3 - place } else { place };
        if mask >> place & 1 == 1 {
            tables[turned][a][mask] |= 1 << index;
        }
        entry += 1;
    }
    tables
}

/// Which layers across z of a brick hold a set voxel.
fn layers(bits: u64) -> u64 {
    (0..4).fold(0, |layers, z| {
        layers | u64::from(bits >> (16 * z) & 0xffff != 0) << z
    })
}

/// The profile of a node with these masks by those of its children, each of `slices` slices.
fn profile([mixed, full]: [u64; 2], below: &[u64], slices: usize) -> u64 {
    let all = u64::MAX >> (SLICES - slices);
    let mut quarters = [0u64; 4];
    let mut below = below.iter();
    for child in 0..64 {
        let quarter = &mut quarters[places(child)[2]];
        if mixed >> child & 1 == 1 {
            *quarter |= below.next().copied().unwrap_or(0);
        } else if full >> child & 1 == 1 {
            *quarter |= all;
        }
    }
    let mut slices = slices;
    while 4 * slices > SLICES {
        quarters = quarters.map(in_pairs);
        slices /= 2;
    }
    (0..4).fold(0, |all, z| all | quarters[z] << (z * slices))
}

/// Bit `i` of the result is the or of bits 2 i and 2 i + 1.
fn in_pairs(bits: u64) -> u64 {
    (0..32).fold(0, |pairs, i| {
        pairs | u64::from(bits >> (2 * i) & 3 != 0) << i
    })
}

/// A mask of children in the order in which a ray comes to them: bit `i` is child `i ^ flip`.
#[inline]
fn in_order(mask: u64, flip: usize) -> u64 {
    const LOWER: [u64; 6] = [
        0x5555_5555_5555_5555,
        0x3333_3333_3333_3333,
        0x0f0f_0f0f_0f0f_0f0f,
        0x00ff_00ff_00ff_00ff,
        0x0000_ffff_0000_ffff,
        0x0000_0000_ffff_ffff,
    ];
    let mut mask = mask;
    for (bit, lower) in LOWER.iter().enumerate() {
        if flip >> bit & 1 == 1 {
            mask = (mask & lower) << (1 << bit) | (mask >> (1 << bit)) & lower;
        }
    }
    mask
}
