//! Marching cubes: the surface between what is inside of a volume and what is outside.
//!
//! Voxels are points at their centres, and eight neighbours are the corners of a cell. A vertex lies
//! on each edge between a voxel inside and one outside: halfway where the volume is binary, where the
//! level is met by linear interpolation where it holds amounts. The polygons of a cell are those of
//! [`cases`]: the surface is closed and manifold, whatever the voxels are, but where the volume ends
//! and [`Border::Open`] is asked for.
//!
//! Only cells that the surface passes are looked at: crossed edges are found 64 at a time as bits,
//! twice, first to count and then to number. Cost: a few operations per 64 voxels, and about a hundred
//! for each vertex; memory is that of the surface. Source: W. E. Lorensen and H. E. Cline, "Marching
//! Cubes", 1987; the numbering by rows follows W. Schroeder, R. Maynard and B. Geveci, "Flying Edges",
//! 2015.

pub mod cases;
mod junction;
pub(in crate::volume) mod slab;
#[cfg(test)]
mod tests;
mod triangulate;

use crate::error::{Error, Result};
use crate::numeric::vector::{Vec3, add, scale};
use crate::progress::Progress;
use crate::trade::named;
use crate::volume::bits::BitGrid;
use crate::volume::{Data, Frame, Volume};
use crate::with_samples;
use cases::{CASES, Link};
use junction::Junctions;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
pub use slab::Labels;
use slab::{Extent, SLAB, Slab, Source};

/// No neighbour.
pub const NONE: u32 = u32::MAX;

/// Most vertices of a surface: two bits of a neighbour's number are its slot.
const MOST_VERTICES: u64 = (NONE >> 2) as u64;

/// What counts as inside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Select {
    /// Every value but 0.
    Set,
    /// One value.
    Equal(f64),
    /// This value and larger ones.
    AtLeast(f64),
}

impl Select {
    /// Whether a value is inside; one that is no number never is.
    #[inline]
    pub fn takes(&self, value: f64) -> bool {
        match self {
            Select::Set => value != 0.0 && !value.is_nan(),
            Select::Equal(label) => value == *label,
            Select::AtLeast(level) => value >= *level,
        }
    }
}

/// What happens where the volume ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Border {
    /// What lies beyond is outside, and the surface is closed half a voxel before it.
    Closed,
    /// The surface ends at the outermost voxel centres.
    Open,
}
named!(Border { Closed = "closed", Open = "open" });

/// Polygons as a list of their lengths and a list of their corners.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Loops {
    /// Corners of each polygon.
    pub lengths: Vec<u8>,
    /// Vertices, polygon after polygon, counter-clockwise from outside.
    pub corners: Vec<u32>,
}

/// The surface of a binary volume: vertices on the edges between voxels, and how they follow each
/// other.
///
/// Every vertex lies on two curves, each the cut of the surface with a plane of voxel centres: curve 0
/// in the plane of its edge's axis and the next axis (x, y, z, x), curve 1 in that of the axis after.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surface {
    /// Twice the place of each vertex in voxels from the centre of voxel (0, 0, 0). One coordinate is
    /// odd: the axis of its edge.
    pub places: Vec<[i32; 3]>,
    /// Whether the lower end of its edge is the one inside.
    pub lower_inside: Vec<bool>,
    /// Whether what is inside, or outside, is one voxel thick along its edge.
    pub thin: Vec<bool>,
    /// The neighbours on curve 0 down and up, on curve 1 down and up: four times the vertex, and the
    /// slot in which it names this one; [`NONE`] where a curve ends.
    pub links: Vec<[u32; 4]>,
    /// The steps to the neighbours, as [`cases::step_code`] writes them.
    pub steps: Vec<[u8; 4]>,
    /// The polygons; where there are labels, counter-clockwise from outside of the higher one.
    pub loops: Loops,
    /// Cells that hold a part of it.
    pub cells: u64,
    /// Where there are labels, those on both sides of each vertex on an edge: inside, which is the
    /// higher one, and outside; else empty.
    pub sides: Vec<[u16; 2]>,
    /// Where three labels meet there are vertices in the middle of faces and cells too. Curves that end
    /// there without going on: that vertex, and four times the vertex that names it plus its slot, in
    /// order.
    pub arms: Vec<(u32, u32)>,
}

/// The axis of the edge that a vertex lies on.
#[inline]
pub fn axis_of(place: [i32; 3]) -> usize {
    // One coordinate is odd.
    ((place[1] & 1) + 2 * (place[2] & 1)) as usize
}

impl Surface {
    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        let each = 12 + 2 + 16 + 4 + if self.sides.is_empty() { 0 } else { 4 };
        let loops = self.loops.lengths.len() + 4 * self.loops.corners.len();
        (each * self.len() + loops + 8 * self.arms.len()) as u64
    }

    /// Number of vertices where the surface ends.
    pub fn ends(&self) -> usize {
        let ends = |v: &usize| self.is_on_edge(*v) && self.links[*v].contains(&NONE);
        (0..self.len()).filter(ends).count()
    }

    /// Whether a vertex lies on an edge between voxels, as all do but those where three labels meet.
    #[inline]
    pub fn is_on_edge(&self, vertex: usize) -> bool {
        self.places[vertex].iter().map(|c| c & 1).sum::<i32>() == 1
    }

    /// Whether there is no surface.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// The labels inside and outside of a triangle or polygon; `None` where there are no labels.
    #[inline]
    pub fn sides_of(&self, corners: &[u32]) -> Option<[u16; 2]> {
        if self.sides.is_empty() {
            return None;
        }
        // Every polygon has a corner on an edge, and all that do have the same labels.
        let v = corners.iter().find(|v| self.is_on_edge(**v as usize))?;
        Some(self.sides[*v as usize])
    }

    /// Those of the triangles that bound a label, turned outwards from it.
    pub fn triangles_around(&self, label: u16, triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
        let around = |t: &[u32; 3]| match self.sides_of(t) {
            Some([inside, _]) if inside == label => Some(*t),
            Some([_, outside]) if outside == label => Some([t[0], t[2], t[1]]),
            _ => None,
        };
        triangles.iter().filter_map(around).collect()
    }

    /// Where vertices are in space: each in the middle of its edge, moved by so many voxels along it.
    pub fn positions(&self, frame: &Frame, moved: impl Fn(usize) -> Vec3 + Sync) -> Vec<Vec3> {
        (0..self.len())
            .into_par_iter()
            .with_min_len(1 << 12)
            .map(|v| {
                let offset = moved(v);
                let mut p = frame.origin;
                for a in 0..3 {
                    let steps = f64::from(self.places[v][a]) * 0.5 + offset[a];
                    p = add(p, scale(frame.axes[a], steps));
                }
                p
            })
            .collect()
    }
}

/// Crossed edges along x, y, z that start in a row, and the number of the first.
#[derive(Debug, Clone, Copy, Default)]
struct Row {
    base: [u32; 3],
}

/// The surface of what is selected.
///
/// Vertices are numbered by slice, row and axis of their edge, then along x. Errs where there are over
/// 2^30 vertices. Cost: see the module.
pub fn extract(
    volume: &Volume,
    select: &Select,
    border: Border,
    progress: &dyn Progress,
) -> Result<Surface> {
    let extent = Extent::new(volume.frame.dims, border == Border::Closed);
    from_slabs(volume, &Source::Select(select), extent, progress)
}

/// The walls between labels, and between them and the rest, all in one.
///
/// A cell of two labels is cut as if the higher one were inside. Where more meet, there is a vertex in
/// the middle of each face on which three or four of them meet and one in the middle of the cell, to
/// which all that lies on its faces is joined: nothing is left between the labels, and none overlap. The
/// surface is closed half a voxel before the end of the volume. Errs and costs as [`extract`].
///
/// Source of the idea: H.-C. Hege, M. Seebass, D. Stalling and M. Zoeckler, "A generalized marching cubes
/// algorithm based on non-binary classifications", 1997.
pub fn extract_labels(
    volume: &Volume,
    labels: &Labels,
    progress: &dyn Progress,
) -> Result<Surface> {
    let extent = Extent::new(volume.frame.dims, true);
    from_slabs(volume, &Source::Labels(labels), extent, progress)
}

fn from_slabs(
    volume: &Volume,
    source: &Source,
    extent: Extent,
    progress: &dyn Progress,
) -> Result<Surface> {
    if volume.frame.is_empty() {
        return Ok(Surface::default());
    }
    let starts: Vec<usize> = extent.slices().step_by(SLAB).collect();
    progress.stage("extract", 2 * starts.len() as u64);
    let counts: Vec<Vec<[u32; 3]>> = starts
        .par_iter()
        .map(|first| {
            let slab = Slab::read(volume, source, &extent, *first);
            progress.advance(1);
            count(&slab)
        })
        .collect();
    let total: u64 = counts
        .iter()
        .flatten()
        .flatten()
        .map(|c| u64::from(*c))
        .sum();
    too_many(total)?;
    let rows = number(&counts);
    let parts: Vec<Part> = starts
        .par_iter()
        .map(|first| {
            let slab = Slab::read(volume, source, &extent, *first);
            let part = Part::new(&slab, &extent, &rows);
            progress.advance(1);
            part
        })
        .collect();
    join(parts)
}

fn too_many(vertices: u64) -> Result<()> {
    if vertices > MOST_VERTICES {
        return Err(Error::Limit {
            what: "the surface".into(),
            needed: format!("{vertices} vertices"),
            limit: format!("{MOST_VERTICES} vertices"),
            hint: Some("take a part of the volume".into()),
        });
    }
    Ok(())
}

/// Crossed edges of each row that the slab stands for.
fn count(slab: &Slab) -> Vec<[u32; 3]> {
    let rows = (0..slab.count).flat_map(|k| (0..slab.ny).map(move |y| (k, y)));
    rows.map(|(k, y)| {
        std::array::from_fn(|axis| {
            let words = slab.crossed(axis, k as isize, y);
            words.iter().map(|w| w.count_ones()).sum()
        })
    })
    .collect()
}

/// Numbers for the vertices of each row, and one row past the last slice of each slab's.
fn number(counts: &[Vec<[u32; 3]>]) -> Vec<Row> {
    let mut next = 0;
    let mut rows: Vec<Row> = counts
        .iter()
        .flatten()
        .map(|count| Row {
            base: count.map(|n| {
                let base = next;
                next += n;
                base
            }),
        })
        .collect();
    rows.push(Row { base: [next; 3] });
    rows
}

/// A neighbour to be named by a vertex of the next slab.
struct Pending {
    vertex: u32,
    slot: u8,
    link: u32,
    step: u8,
}

/// What one slab adds to the surface.
struct Part {
    base: u32,
    surface: Surface,
    pending: Vec<Pending>,
    junctions: Junctions,
}

impl Part {
    fn new(slab: &Slab, extent: &Extent, rows: &[Row]) -> Part {
        let row_of = |k: usize, y: usize| (slab.first + k - extent.first()) * slab.ny + y;
        let base = rows[row_of(0, 0)].base[0];
        let end = rows[row_of(slab.count, 0).min(rows.len() - 1)].base[0];
        let owned = (end - base) as usize;
        let mut part = Part {
            base,
            surface: Surface {
                places: Vec::with_capacity(owned),
                lower_inside: Vec::with_capacity(owned),
                thin: Vec::with_capacity(owned),
                links: vec![[NONE; 4]; owned],
                steps: vec![[0; 4]; owned],
                loops: Loops {
                    lengths: Vec::with_capacity(owned),
                    corners: Vec::with_capacity(4 * owned),
                },
                ..Surface::default()
            },
            pending: Vec::new(),
            junctions: Junctions::default(),
        };
        for k in 0..slab.count {
            for y in 0..slab.ny {
                part.add_vertices(slab, k, y);
            }
        }
        for k in 0..slab.count {
            if slab.first + k >= extent.end(2) {
                break;
            }
            for y in extent.first()..extent.end(1) {
                let bases = [(k, y), (k, y + 1), (k + 1, y), (k + 1, y + 1)]
                    .map(|(k, y)| rows.get(row_of(k, y)).copied().unwrap_or_default());
                part.add_cells(slab, extent, [k, y], bases);
            }
        }
        part
    }

    fn add_vertices(&mut self, slab: &Slab, k: usize, y: usize) {
        for axis in 0..3 {
            let words = slab.crossed(axis, k as isize, y);
            for (i, word) in words.iter().enumerate() {
                if *word == 0 {
                    continue;
                }
                let inside = slab.inside(k, y)[i];
                let thin = slab.thin(axis, k, y, i);
                let mut left = *word;
                while left != 0 {
                    let bit = left.trailing_zeros() as usize;
                    left &= left - 1;
                    // The margin's grid starts one voxel before the volume's.
                    let lower = [64 * i + bit, y, slab.first + k].map(|at| 2 * (at as i32 - 1));
                    let mut place = lower;
                    place[axis] += 1;
                    self.surface.places.push(place);
                    match slab.labels_at([64 * i + bit, y, k], axis) {
                        Some([low, high]) => {
                            self.surface.lower_inside.push(low > high);
                            self.surface.sides.push([low.max(high), low.min(high)]);
                        }
                        None => self.surface.lower_inside.push(inside >> bit & 1 == 1),
                    }
                    self.surface.thin.push(thin >> bit & 1 == 1);
                }
            }
        }
    }

    /// The polygons and links of a row of cells; `bases` are the rows at its four edges along x.
    fn add_cells(&mut self, slab: &Slab, extent: &Extent, [k, y]: [usize; 2], bases: [Row; 4]) {
        let stride = slab.stride;
        let k1 = k as isize;
        let inside =
            [(k, y), (k, y + 1), (k + 1, y), (k + 1, y + 1)].map(|(k, y)| slab.inside(k, y));
        let along_x = [(k1, y), (k1, y + 1), (k1 + 1, y), (k1 + 1, y + 1)]
            .map(|(k, y)| slab.crossed(0, k, y));
        // Along y from the row below and above, along z from the row before and behind.
        let across = [
            slab.crossed(1, k1, y),
            slab.crossed(1, k1 + 1, y),
            slab.crossed(2, k1, y),
            slab.crossed(2, k1, y + 1),
        ];
        let (first, end) = (extent.first(), extent.end(0));
        let mut at_x = bases.map(|row| row.base[0]);
        let mut at_across = [
            bases[0].base[1],
            bases[2].base[1],
            bases[0].base[2],
            bases[1].base[2],
        ];
        // The edges at the start of the first cell are the ends of none.
        for (at, words) in at_across.iter_mut().zip(across) {
            *at += (words[0] >> first & 1) as u32;
        }
        let last_y = y + 1 == extent.end(1);
        let last_z = slab.first + k + 1 == extent.end(2);
        let next =
            |words: &[u64], i: usize| words[i] >> 1 | words.get(i + 1).map_or(0, |word| word << 63);
        for i in 0..stride {
            let here = across.map(|words| words[i]);
            let after = across.map(|words| next(words, i));
            let x = along_x.map(|words| words[i]);
            let or = |w: [u64; 4]| w[0] | w[1] | w[2] | w[3];
            let mut active = or(x) | or(here) | or(after);
            if active == 0 {
                continue;
            }
            if 64 * i < first {
                active &= u64::MAX << (first - 64 * i).min(63);
            }
            if 64 * (i + 1) > end {
                active &= (1u64 << (end.saturating_sub(64 * i) % 64)).wrapping_sub(1);
            }
            let corner = inside.map(|words| words[i]);
            let corner_after = inside.map(|words| next(words, i));
            while active != 0 {
                let bit = active.trailing_zeros();
                active &= active - 1;
                let one = |w: u64| (w >> bit & 1) as usize;
                let mut ids = [0u32; 12];
                let mut case = 0;
                for n in 0..4 {
                    ids[n] = at_x[n];
                    at_x[n] += one(x[n]) as u32;
                    // The end of the cell before is the start of this one.
                    ids[4 + 2 * n] = at_across[n].wrapping_sub(1);
                    ids[5 + 2 * n] = at_across[n];
                    at_across[n] += one(after[n]) as u32;
                    case |= (one(corner[n]) | one(corner_after[n]) << 1) << (2 * n);
                }
                let at = [64 * i + bit as usize, y, k];
                let last = [at[0] + 1 == end, last_y, last_z];
                match slab.labels_of_cell(at) {
                    None => self.add_cell(case, &ids, last),
                    Some(labels) => {
                        let high = labels.into_iter().fold(0, u16::max);
                        let low = labels.into_iter().fold(u16::MAX, u16::min);
                        if labels.into_iter().all(|l| l == high || l == low) {
                            let bit = |c: usize| usize::from(labels[c] == high) << c;
                            self.add_cell((0..8).map(bit).sum(), &ids, last);
                        } else {
                            let place = [at[0], at[1], slab.first + k].map(|c| 2 * c as i32 - 1);
                            self.surface.cells += 1;
                            self.add_junction(&labels, &ids, place);
                        }
                    }
                }
            }
        }
    }

    #[inline]
    fn add_cell(&mut self, case: usize, ids: &[u32; 12], last: [bool; 3]) {
        let case = &CASES[case];
        self.surface.cells += 1;
        for polygon in case.loops() {
            self.surface.loops.lengths.push(polygon.len() as u8);
            let corners = polygon.iter().map(|edge| ids[usize::from(*edge)]);
            self.surface.loops.corners.extend(corners);
        }
        // Each face is linked once: by the cell above it, or where there is none by the one below.
        for axis in 0..3 {
            for link in case.links(2 * axis) {
                self.add_link(link, ids);
            }
            if last[axis] {
                for link in case.links(2 * axis + 1) {
                    self.add_link(link, ids);
                }
            }
        }
    }

    #[inline]
    fn add_link(&mut self, link: &Link, ids: &[u32; 12]) {
        let vertices = link.edges.map(|e| ids[usize::from(e)]);
        for end in 0..2 {
            let to = vertices[1 - end] << 2 | u32::from(link.slots[1 - end]);
            let (vertex, slot, step) = (vertices[end], link.slots[end], link.steps[end]);
            let own = (vertex - self.base) as usize;
            if let Some(links) = self.surface.links.get_mut(own) {
                links[usize::from(slot)] = to;
                self.surface.steps[own][usize::from(slot)] = step;
            } else {
                self.pending.push(Pending {
                    vertex,
                    slot,
                    link: to,
                    step,
                });
            }
        }
    }
}

/// The parts one after the other, with what each knows of the next one's vertices.
fn join(parts: Vec<Part>) -> Result<Surface> {
    let mut all = Surface::default();
    let vertices = parts.iter().map(|p| p.surface.len()).sum();
    let loops = parts.iter().map(|p| p.surface.loops.lengths.len()).sum();
    let corners = parts.iter().map(|p| p.surface.loops.corners.len()).sum();
    all.places.reserve_exact(vertices);
    all.lower_inside.reserve_exact(vertices);
    all.thin.reserve_exact(vertices);
    all.links.reserve_exact(vertices);
    all.steps.reserve_exact(vertices);
    all.loops.lengths.reserve_exact(loops);
    all.loops.corners.reserve_exact(corners);
    let mut pending: Vec<Pending> = Vec::new();
    let mut junctions = Junctions::default();
    for part in parts {
        all.places.extend(part.surface.places);
        all.lower_inside.extend(part.surface.lower_inside);
        all.thin.extend(part.surface.thin);
        all.links.extend(part.surface.links);
        all.steps.extend(part.surface.steps);
        all.loops.lengths.extend(part.surface.loops.lengths);
        all.loops.corners.extend(part.surface.loops.corners);
        all.cells += part.surface.cells;
        all.sides.extend(part.surface.sides);
        pending.extend(part.pending);
        junctions.extend(part.junctions);
    }
    for p in pending {
        all.links[p.vertex as usize][usize::from(p.slot)] = p.link;
        all.steps[p.vertex as usize][usize::from(p.slot)] = p.step;
    }
    junctions.finish(&mut all)?;
    Ok(all)
}

/// How far each vertex lies from the middle of its edge, in voxels along it, where `level` is met by
/// linear interpolation; 0 where the edge leaves the volume. Cost: two values a vertex.
pub fn at_level(volume: &Volume, surface: &Surface, level: f64) -> Vec<f64> {
    let [nx, ny, nz] = volume.frame.dims;
    let value = |p: [i32; 3]| -> Option<f64> {
        let [x, y, z] = p.map(|c| usize::try_from(c).ok());
        let (x, y, z) = (x?, y?, z?);
        if x >= nx || y >= ny || z >= nz {
            return None;
        }
        let at = (z * ny + y) * nx + x;
        Some(
            with_samples!(&volume.data, v => v[at] as f64, bits => match bits {
                Data::Bits(grid) => f64::from(u8::from(grid.get(x, y, z))),
                Data::Sparse(tree) => f64::from(u8::from(tree.get(x, y, z))),
                _ => 0.0,
            }),
        )
    };
    let meets = |place: &[i32; 3]| {
        let axis = axis_of(*place);
        let mut low = place.map(|c| c.div_euclid(2));
        let a = value(low)?;
        low[axis] += 1;
        let b = value(low)?;
        let t = (level - a) / (b - a);
        t.is_finite().then(|| t.clamp(0.0, 1.0) - 0.5)
    };
    surface
        .places
        .par_iter()
        .with_min_len(1 << 12)
        .map(|place| meets(place).unwrap_or(0.0))
        .collect()
}

/// The different values of a volume, ascending; `None` where there are more than `most`, or one is no
/// number. Cost: one pass.
pub fn values(volume: &Volume, most: usize) -> Option<Vec<f64>> {
    let mut found: Vec<f64> = Vec::new();
    let mut last = f64::NAN;
    let mut add = |value: f64| {
        if value == last {
            return true;
        }
        last = value;
        match found.binary_search_by(|v| v.total_cmp(&value)) {
            Ok(_) => true,
            Err(at) => {
                found.insert(at, value);
                found.len() <= most && !value.is_nan()
            }
        }
    };
    let all = with_samples!(&volume.data, v => v.iter().all(|value| add(*value as f64)), _ => {
        add(0.0) && add(1.0)
    });
    all.then_some(found)
}

/// What is inside, as bits.
pub fn inside(volume: &Volume, select: &Select) -> BitGrid {
    let dims = volume.frame.dims;
    let mut all = BitGrid::new(dims);
    let slice = all.stride() * dims[1];
    if slice > 0 {
        all.words_mut()
            .par_chunks_mut(slice)
            .enumerate()
            .for_each(|(z, out)| {
                let mut bits = BitGrid::new([dims[0], dims[1], 1]);
                select.read(volume, z, &mut bits);
                out.copy_from_slice(bits.words());
            });
    }
    all
}
