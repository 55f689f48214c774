//! Faces as a list of corners, coded as they stand: no face, corner or vertex changes its place.
//!
//! A face mostly shares an edge with one of the last ones, or its corners with them; what is left is
//! coded by its distance to a corner before. Both the order and the turn of every face survive, which
//! coders that walk the mesh (edgebreaker, valence) give up.

use super::coder::Coder;
use super::integers::{CLASSES, Context, Integers, class_of};
use crate::error::Fault;
use crate::mesh::Polygons;

/// Edges and corners of the last faces that are looked at.
const EDGES: usize = 48;
const CORNERS: usize = 48;

/// What the corners of a face are told by, learning as faces pass.
struct Walk {
    vertices: u32,
    /// Directed edges of the last faces, turned round as a neighbour has them, latest last.
    edges: Vec<[u32; 2]>,
    /// Corners of the last faces, latest last, each once.
    corners: Vec<u32>,
    /// The vertex after the last one met for the first time.
    next: u32,
    met: Vec<bool>,
    count: Integers<1>,
    edge: Integers<3>,
    turn: Integers<2>,
    recent: Integers<3>,
    fresh: Integers<2>,
    jump: Integers<3>,
    leap: Integers<2>,
    /// The last numbers of each kind: corners, edge, turn, place among recent corners, jumps.
    last: [i32; 6],
}

impl Walk {
    fn new(vertices: u32) -> Self {
        Walk {
            vertices,
            edges: Vec::new(),
            corners: Vec::new(),
            next: 0,
            met: vec![false; vertices as usize],
            count: Integers::new([8], 1),
            edge: Integers::new([CLASSES, CLASSES * 8, 64], 1),
            turn: Integers::new([8, 64], 1),
            recent: Integers::new([CLASSES * 8, 64 * 2, CLASSES * CLASSES], 1),
            fresh: Integers::new([16, 2], 1),
            jump: Integers::new([CLASSES * 8, CLASSES, 16], 1),
            leap: Integers::new([CLASSES, 8], 1),
            last: [3, 0, 0, 0, 0, 0],
        }
    }

    /// Codes one face; returns the one the stream holds.
    fn face(&mut self, coder: &mut impl Coder, given: &[u32]) -> Result<Vec<u32>, Fault> {
        let small = |n: i32| n.clamp(0, 7) as usize;
        let count = {
            let context = Context {
                cells: [small(self.last[0])],
                set: 0,
            };
            self.count.code(coder, &context, given.len() as i32).max(0)
        };
        // More corners than there are vertices repeat one: it is allowed, but not without end.
        if count as u64 > 2 * u64::from(self.vertices) + 8 {
            return Err(Fault::whole(format!(
                "a face has {count} corners, but there are {} vertices",
                self.vertices
            )));
        }
        self.last[0] = count;
        let count = count as usize;
        let mut face = vec![0; count];
        let shared = self.shared(coder, given, count);
        let (first, known) = match shared {
            Some((turn, edge)) => {
                face[turn] = edge[0];
                face[(turn + 1) % count] = edge[1];
                (turn + 2, 2)
            }
            None => (0, 0),
        };
        for i in known..count {
            let at = (first + i - known) % count;
            let before = match i {
                0 => self.corners.last().copied().unwrap_or(0),
                _ => face[(at + count - 1) % count],
            };
            let given = given.get(at).copied().unwrap_or(0);
            let corner = self.corner(coder, given, before, i.min(3) + 4 * (known / 2))?;
            face[at] = corner;
            self.keep(corner);
        }
        if let Some((_, edge)) = shared {
            edge.into_iter().for_each(|corner| self.keep(corner));
        }
        for i in 0..count {
            self.edges.push([face[(i + 1) % count], face[i]]);
        }
        if self.edges.len() > 4 * EDGES {
            self.edges.drain(..self.edges.len() - EDGES);
        }
        Ok(face)
    }

    /// The edge that a face shares with one of the last ones, and the corner it begins at.
    fn shared(
        &mut self,
        coder: &mut impl Coder,
        given: &[u32],
        count: usize,
    ) -> Option<(usize, [u32; 2])> {
        if count < 3 {
            return None;
        }
        let at = |i: usize| [given[i], given[(i + 1) % given.len()]];
        let last = self.edges.iter().rev().take(EDGES);
        let found = last.enumerate().find_map(|(place, edge)| {
            let turn = (0..given.len()).find(|i| at(*i) == *edge)?;
            Some((place as i32 + 1, turn as i32))
        });
        let (place, turn) = found.unwrap_or((0, 0));
        let before = self.last[1];
        let context = Context {
            cells: [
                class_of(before as f32),
                class_of(before as f32) * 8 + self.last[2].clamp(0, 7) as usize,
                (before.min(7) * 8 + self.last[5].min(7)) as usize,
            ],
            set: 0,
        };
        let place = self.edge.code(coder, &context, place).unsigned_abs();
        self.last[5] = before;
        self.last[1] = place.min(1 << 20) as i32;
        let edge = match place {
            0 => None,
            place => self.edges.iter().rev().nth(place as usize - 1).copied(),
        }?;
        let before = self.last[2].clamp(0, 7) as usize;
        let context = Context {
            cells: [before, before * 8 + place.min(7) as usize],
            set: 0,
        };
        let turn = self.turn.code(coder, &context, turn).unsigned_abs();
        self.last[2] = turn.min(7) as i32;
        Some((turn as usize % count, edge))
    }

    /// Codes one corner, of which the one before in the face is known.
    fn corner(
        &mut self,
        coder: &mut impl Coder,
        given: u32,
        before: u32,
        kind: usize,
    ) -> Result<u32, Fault> {
        let last = self.corners.iter().rev().take(CORNERS);
        let place = last.enumerate().find(|(_, corner)| **corner == given);
        let place = place.map_or(0, |(place, _)| place as i32 + 1);
        let edge = self.last[1].min(7) as usize;
        let class = class_of(self.last[3] as f32);
        let context = Context {
            cells: [
                class * 8 + kind,
                (edge * 8 + kind) * 2,
                class * CLASSES + class_of(self.last[1] as f32),
            ],
            set: 0,
        };
        let place = self.recent.code(coder, &context, place).unsigned_abs();
        self.last[3] = place.min(1 << 20) as i32;
        if place > 0 {
            let corner = self.corners.iter().rev().nth(place as usize - 1);
            return corner
                .copied()
                .ok_or_else(|| Fault::whole("a face refers to a corner before the first"));
        }
        let is_fresh = self.met.get(given as usize).is_some_and(|met| !met);
        let context = Context {
            cells: [kind + 8 * usize::from(self.last[4] & 1 == 1), 0],
            set: 0,
        };
        let fresh = self.fresh.code(coder, &context, i32::from(is_fresh)) != 0;
        self.last[4] = self.last[4] << 1 & 0xff | i32::from(fresh);
        let class = class_of(self.last[5] as f32);
        let (base, jump) = match fresh {
            true => {
                let context = Context {
                    cells: [class_of(self.last[4] as f32), kind],
                    set: 0,
                };
                let base = i64::from(self.next);
                let jump = i64::from(given) - base;
                (base, self.leap.code(coder, &context, jump as i32))
            }
            false => {
                let context = Context {
                    cells: [class * 8 + kind, class, kind],
                    set: 0,
                };
                let base = i64::from(before);
                let jump = (i64::from(given) - base) as i32;
                (base, self.jump.code(coder, &context, jump))
            }
        };
        let corner = base + i64::from(jump);
        match u32::try_from(corner).ok().filter(|v| *v < self.vertices) {
            Some(corner) => Ok(corner),
            None => Err(Fault::whole(format!(
                "a face refers to vertex {corner}, but there are {}",
                self.vertices
            ))),
        }
    }

    /// Takes a corner among the recent ones.
    fn keep(&mut self, corner: u32) {
        let met = &mut self.met[corner as usize];
        if !std::mem::replace(met, true) {
            self.next = (corner + 1).min(self.vertices.saturating_sub(1));
        }
        let from = self.corners.len().saturating_sub(CORNERS);
        if let Some(at) = self.corners[from..].iter().rposition(|c| *c == corner) {
            self.corners.remove(from + at);
        }
        self.corners.push(corner);
        if self.corners.len() > 4 * CORNERS {
            self.corners.drain(..self.corners.len() - CORNERS);
        }
    }
}

/// Codes faces over so many vertices; returns those the stream holds.
///
/// `faces` is their number. Errs where a stream refers to what is not there. Cost: about a hundred
/// steps for each corner.
pub fn code<'a>(
    coder: &mut impl Coder,
    vertices: u32,
    faces: usize,
    mut given: impl Iterator<Item = &'a [u32]>,
) -> Result<Polygons, Fault> {
    let mut walk = Walk::new(vertices);
    let mut made = Polygons {
        starts: vec![0],
        corners: Vec::new(),
    };
    for f in 0..faces {
        let face = walk.face(coder, given.next().unwrap_or(&[]));
        let face = face.map_err(|fault| Fault::element("face", f, fault.problem))?;
        made.corners.extend(face);
        made.starts.push(made.corners.len() as u32);
    }
    Ok(made)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anim::compress::coder::{Reader, Writer};
    use crate::mesh::{Mesh, shapes};
    use crate::numeric::rng::Rng;

    fn round_trip(vertices: u32, faces: &[Vec<u32>]) -> usize {
        let mut writer = Writer::new();
        let given = || faces.iter().map(Vec::as_slice);
        let held = code(&mut writer, vertices, faces.len(), given()).unwrap();
        assert!(held.iter().eq(given()));
        let bytes = writer.finish();
        let mut reader = Reader::new(&bytes);
        let back = code(&mut reader, vertices, faces.len(), std::iter::empty()).unwrap();
        assert!(back.iter().eq(given()));
        bytes.len()
    }

    fn of(mesh: &Mesh) -> Vec<Vec<u32>> {
        mesh.triangles.iter().map(|t| t.to_vec()).collect()
    }

    #[test]
    fn faces_come_back_in_their_order_and_turn() {
        let sphere = shapes::icosphere([0.0; 3], 1.0, 4);
        let faces = of(&sphere);
        let bits = 8 * round_trip(sphere.positions.len() as u32, &faces);
        assert!(
            bits < 20 * faces.len(),
            "{} bits for {} faces",
            bits,
            faces.len()
        );
        let mut rng = Rng::new(11, 0);
        let mut shuffled = faces.clone();
        for i in (1..shuffled.len()).rev() {
            shuffled.swap(i, rng.below(i + 1));
            let turn = rng.below(3);
            shuffled[i].rotate_left(turn);
        }
        round_trip(sphere.positions.len() as u32, &shuffled);
    }

    #[test]
    fn an_even_sheet_costs_little() {
        let sheet = shapes::sheet(1.0, 1.0, 60, 60);
        let faces = of(&sheet);
        let bits = 8 * round_trip(sheet.positions.len() as u32, &faces);
        assert!(
            bits < 3 * faces.len(),
            "{} bits for {} faces",
            bits,
            faces.len()
        );
    }

    #[test]
    fn polygons_and_odd_faces_come_back() {
        let faces = vec![
            vec![0, 1, 2, 3],
            vec![3, 2, 5],
            vec![],
            vec![7],
            vec![7, 7],
            vec![1, 1, 1],
            vec![9, 0, 9, 0, 9, 0, 4],
            vec![2, 1, 0],
            vec![0, 1, 2],
        ];
        round_trip(10, &faces);
        round_trip(1, &[vec![0, 0, 0]]);
        round_trip(0, &[]);
    }

    #[test]
    fn noise_is_refused_or_read_without_a_panic() {
        for seed in 0..50 {
            let mut rng = Rng::new(seed, 1);
            let bytes: Vec<u8> = (0..40).map(|_| rng.below(256) as u8).collect();
            let mut reader = Reader::new(&bytes);
            if let Ok(faces) = code(&mut reader, 20, 30, std::iter::empty()) {
                assert!(faces.corners.iter().all(|v| *v < 20));
            }
        }
    }
}
