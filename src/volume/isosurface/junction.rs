//! Cells in which three labels or more meet.

use super::cases::{FACES, axis_of, edge_between, link, slot, step_code};
use super::extract::{Part, too_many};
use super::{NONE, Surface};
use crate::error::Result;
use std::collections::BTreeMap;

/// Twice the place of a vertex, as [`Surface::places`] holds it.
type Place = [i32; 3];

/// An end of a segment on a face: a vertex on an edge, or that in the middle of the face.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    Edge(u32),
    Middle(Place),
}

/// A curve from a vertex on an edge to the middle of a face.
struct Arm {
    vertex: u32,
    slot: u8,
    step: u8,
    middle: Place,
}

/// What is joined to the middles of faces and cells, which are numbered last.
#[derive(Default)]
pub(super) struct Junctions {
    /// The middle of a cell, and segments on its faces, the higher label to the right from outside.
    cones: Vec<(Place, [End; 2])>,
    arms: Vec<Arm>,
}

/// What lies on a face of a cell: segments between two of its edges, or arms to its middle.
enum OnFace {
    Segments(Vec<[usize; 2]>),
    Arms(Vec<(usize, bool)>),
}

/// How the labels at the corners divide a face. Both cells of a face divide it alike.
///
/// Labels that alternate: the higher one is kept apart; two equal ones between two others are joined.
fn divide(face: usize, labels: &[u16; 8]) -> OnFace {
    let at = |i: usize| labels[FACES[face][i % 4]];
    let edge = |i: usize| edge_between(FACES[face][i % 4], FACES[face][(i + 1) % 4]);
    let crossed: Vec<usize> = (0..4).filter(|i| at(*i) != at(*i + 1)).collect();
    // From the edge where a walk enters the higher label to the one where it leaves it.
    let directed = |enters: usize, leaves: usize| {
        if at(enters + 1) > at(enters) {
            [edge(enters), edge(leaves)]
        } else {
            [edge(leaves), edge(enters)]
        }
    };
    match crossed[..] {
        [] => OnFace::Segments(Vec::new()),
        [i, j] => OnFace::Segments(vec![directed(i, j)]),
        _ if crossed.len() == 4 && (at(0) == at(2) || at(1) == at(3)) => {
            let two = at(0) == at(2) && at(1) == at(3);
            // The corners kept apart: the higher ones of two labels, else those that differ.
            let apart = if two {
                usize::from(at(1) > at(0))
            } else {
                usize::from(at(0) == at(2))
            };
            OnFace::Segments(
                [apart, apart + 2]
                    .map(|i| directed((i + 3) % 4, i))
                    .to_vec(),
            )
        }
        _ => OnFace::Arms(
            crossed
                .into_iter()
                .map(|i| (edge(i), at(i + 1) > at(i)))
                .collect(),
        ),
    }
}

/// Twice the middle of a face from the cell's lower corner.
fn middle_of(face: usize) -> Place {
    let mut middle = [1; 3];
    middle[face / 2] = 2 * (face % 2) as i32;
    middle
}

impl Part {
    /// The walls in a cell of three labels or more, whose middle is at `place`.
    pub(super) fn add_junction(&mut self, labels: &[u16; 8], ids: &[u32; 12], place: Place) {
        let corner = place.map(|c| c - 1);
        let from = |offset: Place| std::array::from_fn(|a| corner[a] + offset[a]);
        let mut segments: Vec<[End; 2]> = Vec::new();
        let mut meets = false;
        for face in 0..6 {
            let owned = face % 2 == 0;
            match divide(face, labels) {
                OnFace::Segments(found) => {
                    for edges in found {
                        segments.push(edges.map(|e| End::Edge(ids[e])));
                        if owned {
                            self.add_link(&link(face, edges), ids);
                        }
                    }
                }
                OnFace::Arms(arms) => {
                    meets = true;
                    let middle = from(middle_of(face));
                    for (edge, inwards) in arms {
                        let ends = [End::Edge(ids[edge]), End::Middle(middle)];
                        segments.push(if inwards { ends } else { [ends[1], ends[0]] });
                        if owned {
                            let mid = super::cases::doubled_midpoint(edge);
                            let axis = axis_of(edge);
                            let along = 3 - axis - face / 2;
                            let to = middle_of(face);
                            self.junctions.arms.push(Arm {
                                vertex: ids[edge],
                                slot: slot(axis, along, mid[along] == 0),
                                step: step_code(std::array::from_fn(|a| to[a] - mid[a])),
                                middle,
                            });
                        }
                    }
                }
            }
        }
        if meets {
            let cones = segments.into_iter().map(|ends| (place, ends));
            self.junctions.cones.extend(cones);
        } else {
            self.add_loops(&segments);
        }
    }

    /// Segments between edges alone are closed polygons, as in a cell of two labels.
    fn add_loops(&mut self, segments: &[[End; 2]]) {
        let mut left: Vec<[End; 2]> = segments.to_vec();
        while let Some([first, mut end]) = left.pop() {
            let mut corners = vec![first];
            while end != first {
                corners.push(end);
                let Some(next) = left.iter().position(|s| s[0] == end) else {
                    break;
                };
                end = left.swap_remove(next)[1];
            }
            self.surface.loops.lengths.push(corners.len() as u8);
            let ids = corners.iter().filter_map(|c| match c {
                End::Edge(id) => Some(*id),
                End::Middle(_) => None,
            });
            self.surface.loops.corners.extend(ids);
        }
    }
}

impl Junctions {
    pub(super) fn extend(&mut self, other: Junctions) {
        self.cones.extend(other.cones);
        self.arms.extend(other.arms);
    }

    /// Numbers the middles by their places, and joins all to them.
    pub(super) fn finish(self, surface: &mut Surface) -> Result<()> {
        let mut middles: Vec<Place> = Vec::new();
        for (cell, ends) in &self.cones {
            middles.push(*cell);
            middles.extend(ends.iter().filter_map(|end| match end {
                End::Middle(place) => Some(*place),
                End::Edge(_) => None,
            }));
        }
        middles.sort_unstable_by_key(|[x, y, z]| [*z, *y, *x]);
        middles.dedup();
        let base = surface.len() as u32;
        too_many(surface.len() as u64 + middles.len() as u64)?;
        let number = |place: &Place| {
            let key = |[x, y, z]: &Place| [*z, *y, *x];
            let found = middles.binary_search_by_key(&key(place), key);
            base + found.expect("every middle is in the list") as u32
        };
        let id = |end: &End| match end {
            End::Edge(id) => *id,
            End::Middle(place) => number(place),
        };
        let added = middles.len();
        surface.places.extend(&middles);
        surface.lower_inside.resize(surface.places.len(), false);
        surface.thin.resize(surface.places.len(), false);
        surface.links.resize(surface.places.len(), [NONE; 4]);
        surface.steps.resize(surface.places.len(), [0; 4]);
        if added > 0 {
            surface.sides.resize(surface.places.len(), [0; 2]);
        }
        for (cell, ends) in &self.cones {
            surface.loops.lengths.push(3);
            surface
                .loops
                .corners
                .extend([id(&ends[0]), id(&ends[1]), number(cell)]);
        }
        for arm in &self.arms {
            let (vertex, slot) = (arm.vertex as usize, usize::from(arm.slot));
            let to = number(&arm.middle);
            // Curve 1 of a middle is never one.
            surface.links[vertex][slot] = to << 2 | 2;
            surface.steps[vertex][slot] = arm.step;
            surface
                .arms
                .push((to, arm.vertex << 2 | u32::from(arm.slot)));
        }
        self.lines(surface, &number);
        surface.arms.sort_unstable();
        Ok(())
    }

    /// The lines where three labels meet, from the middle of a face to those of its cells, and on through
    /// a cell that two of them enter.
    fn lines(&self, surface: &mut Surface, number: &impl Fn(&Place) -> u32) {
        let mut faces_of: BTreeMap<Place, Vec<Place>> = BTreeMap::new();
        for (cell, ends) in &self.cones {
            for end in ends {
                if let End::Middle(face) = end {
                    let faces = faces_of.entry(*cell).or_default();
                    if !faces.contains(face) {
                        faces.push(*face);
                    }
                }
            }
        }
        for (cell, faces) in &faces_of {
            let own = number(cell);
            let through = faces.len() == 2;
            for (i, face) in faces.iter().enumerate() {
                let middle = number(face);
                let step: Place = std::array::from_fn(|a| cell[a] - face[a]);
                let up = step.iter().sum::<i32>() > 0;
                let slot = usize::from(up);
                let back = if through { i as u32 } else { 2 };
                surface.links[middle as usize][slot] = own << 2 | back;
                surface.steps[middle as usize][slot] = step_code(step);
                if through {
                    surface.links[own as usize][i] = middle << 2 | slot as u32;
                    surface.steps[own as usize][i] = step_code(step.map(|s| -s));
                } else {
                    surface.arms.push((own, middle << 2 | slot as u32));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::cases::EDGES;
    use super::*;

    /// Every crossed edge of a face has one end on it, from whichever cell it is seen.
    #[test]
    fn faces_are_divided_alike_from_both_cells() {
        for code in 0..256usize {
            let four: Vec<u16> = (0..4).map(|i| (code >> (2 * i) & 3) as u16).collect();
            for axis in 0..3 {
                let mut all = Vec::new();
                for face in [2 * axis, 2 * axis + 1] {
                    let mut labels = [9; 8];
                    let corners: Vec<usize> =
                        (0..8).filter(|c| c >> axis & 1 == face % 2).collect();
                    for (c, l) in corners.iter().zip(&four) {
                        labels[*c] = *l;
                    }
                    let flat = |edge: usize| {
                        let mut mid = super::super::cases::doubled_midpoint(edge);
                        mid[axis] = 0;
                        mid
                    };
                    let mut found: Vec<[Place; 2]> = match divide(face, &labels) {
                        OnFace::Segments(s) => s.into_iter().map(|s| s.map(flat)).collect(),
                        OnFace::Arms(arms) => arms
                            .into_iter()
                            .map(|(e, inwards)| {
                                let ends = [flat(e), [9; 3]];
                                if inwards { ends } else { [ends[1], ends[0]] }
                            })
                            .collect(),
                    };
                    if face % 2 == 1 {
                        // Seen from the other side, left is right.
                        found.iter_mut().for_each(|s| s.reverse());
                    }
                    found.sort();
                    all.push(found);
                }
                assert_eq!(all[0], all[1], "{four:?} across axis {axis}");
                let crossed = EDGES
                    .iter()
                    .filter(|e| e.iter().all(|c| c >> axis & 1 == 0))
                    .filter(|e| {
                        let place = |c: usize| {
                            let corners: Vec<usize> =
                                (0..8).filter(|c| c >> axis & 1 == 0).collect();
                            four[corners.iter().position(|d| *d == c).expect("a corner")]
                        };
                        place(e[0]) != place(e[1])
                    })
                    .count();
                let ends = all[0].iter().flatten().filter(|p| **p != [9; 3]).count();
                assert_eq!(ends, crossed);
            }
        }
    }
}
