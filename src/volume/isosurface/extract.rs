//! From the voxels to the surface, slab by slab.

use super::cases::{CASES, Link};
use super::junction::Junctions;
use super::slab::{Extent, Labels, SLAB, Slab, Source};
use super::{Border, Loops, NONE, Select, Surface};
use crate::error::{Error, Result};
use crate::progress::Progress;
use crate::volume::Volume;
use rayon::prelude::*;

/// Most vertices of a surface: two bits of a neighbour's number are its slot.
const MOST_VERTICES: u64 = (NONE >> 2) as u64;

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

pub(super) fn too_many(vertices: u64) -> Result<()> {
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
pub(super) struct Part {
    base: u32,
    pub(super) surface: Surface,
    pending: Vec<Pending>,
    pub(super) junctions: Junctions,
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
    pub(super) fn add_link(&mut self, link: &Link, ids: &[u32; 12]) {
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
