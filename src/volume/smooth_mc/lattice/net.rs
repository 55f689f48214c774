//! The curves of a surface from its triangles.
//!
//! Two vertices on a face of a cell follow each other on a curve where an edge of the mesh joins them
//! and triangles of both cells of that face meet in it. Where a face holds four vertices there may be
//! edges of the mesh that merely split a polygon of one cell; where sides do not tell, what is inside is
//! kept apart.

use super::{Lattice, MOST, refused};
use crate::error::Fault;
use crate::mesh::Mesh;
use crate::report::Warning;
use crate::volume::isosurface::cases::{slot, step_code, step_of};
use crate::volume::isosurface::{Loops, NONE, Surface, axis_of};
use rayon::prelude::*;

/// Vertices or triangles that one thread works on at a time.
const CHUNK: usize = 1 << 12;

/// Sides of a face on which the triangles of an edge lie.
const BELOW: u8 = 1;
const ABOVE: u8 = 2;
const WITHIN: u8 = 4;

/// Vertices at one place become one.
pub(super) struct Welded {
    /// The number of each vertex of the mesh; `NONE` where no triangle uses it.
    pub vertex_of: Vec<u32>,
    pub places: Vec<[i32; 3]>,
    /// Whether the next edge along the axis holds a vertex too.
    pub thin: Vec<bool>,
    pub duplicates: u64,
}

/// Numbers the places in the order of the vertices that are first there.
///
/// Sorted by axis, row and place along it, vertices at one place follow each other, and so do those of
/// neighbouring edges of one line.
pub(super) fn weld(places: &[[i32; 3]], used: &[bool]) -> Welded {
    let mut keys: Vec<u128> = (places.par_iter().zip(used).enumerate())
        .filter(|(_, (_, used))| **used)
        .map(|(v, (place, _))| {
            let axis = axis_of(*place);
            let part = |a: usize| u128::from((place[a % 3] + MOST) as u32);
            let line = (axis as u128) << 62 | part(axis + 1) << 31 | part(axis + 2);
            (line << 31 | part(axis)) << 32 | v as u128
        })
        .collect();
    keys.par_sort_unstable();
    let vertex = |key: u128| key as u32;
    let mut vertex_of = vec![NONE; places.len()];
    let mut thin = vec![false; places.len()];
    let mut duplicates = 0;
    let mut before: Option<(u128, u32)> = None;
    for run in keys.chunk_by(|a, b| a >> 32 == b >> 32) {
        let (at, first) = (run[0] >> 32, vertex(run[0]));
        for key in run {
            vertex_of[vertex(*key) as usize] = first;
        }
        duplicates += run.len() as u64 - 1;
        if let Some((line, other)) = before
            && at - line == 2
        {
            thin[first as usize] = true;
            thin[other as usize] = true;
        }
        before = Some((at, first));
    }
    let mut welded = Welded {
        vertex_of,
        places: Vec::with_capacity(places.len()),
        thin: Vec::with_capacity(places.len()),
        duplicates,
    };
    for v in 0..places.len() {
        let first = welded.vertex_of[v];
        welded.vertex_of[v] = match first {
            NONE => NONE,
            _ if first as usize == v => {
                welded.places.push(places[v]);
                welded.thin.push(thin[v]);
                welded.places.len() as u32 - 1
            }
            // The first of a place has its number by now.
            _ => welded.vertex_of[first as usize],
        };
    }
    welded
}

/// The corners of triangles at each vertex: those of `v` are `corners[starts[v]..starts[v + 1]]`, each
/// three times the triangle and the corner's number in it.
struct Corners {
    starts: Vec<u32>,
    corners: Vec<u32>,
}

impl Corners {
    fn new(triangles: &[[u32; 3]], vertices: usize) -> Self {
        let mut starts = vec![0u32; vertices + 1];
        for v in triangles.iter().flatten() {
            starts[*v as usize + 1] += 1;
        }
        for v in 0..vertices {
            starts[v + 1] += starts[v];
        }
        let mut next = starts.clone();
        let mut corners = vec![0; 3 * triangles.len()];
        for (corner, v) in triangles.iter().flatten().enumerate() {
            let at = &mut next[*v as usize];
            corners[*at as usize] = corner as u32;
            *at += 1;
        }
        Corners { starts, corners }
    }

    #[inline]
    fn of(&self, v: usize) -> &[u32] {
        &self.corners[self.starts[v] as usize..self.starts[v + 1] as usize]
    }
}

/// The surface with all that follows from the triangles.
pub(super) struct Net {
    surface: Surface,
    vertex_of: Vec<u32>,
    inverted: bool,
    warnings: Vec<Warning>,
}

impl Net {
    /// Errs for triangles that reach over more than one cell or are turned opposite ways.
    pub(super) fn new(mesh: &Mesh, welded: Welded) -> Result<Net, Fault> {
        let mut warnings = Vec::new();
        let mut warn = |code: &str, message: &str, count: u64, first: Option<u64>| {
            if count > 0 {
                warnings.push(Warning::new(code, message, count, first));
            }
        };
        let renumbered: Vec<[u32; 3]> = mesh
            .triangles
            .par_iter()
            .map(|t| t.map(|v| welded.vertex_of[v as usize]))
            .collect();
        check_cells(&renumbered, &welded.places)?;
        let degenerate = |[a, b, c]: [u32; 3]| a == b || b == c || c == a;
        let first = renumbered.iter().position(|t| degenerate(*t));
        let mut triangles = renumbered;
        if let Some(first) = first {
            let before = triangles.len();
            triangles.retain(|t| !degenerate(*t));
            warn(
                "degenerate-triangles",
                "triangles with two corners at one position, taken for none",
                (before - triangles.len()) as u64,
                Some(first as u64),
            );
        }
        let mut corners = Corners::new(&triangles, welded.places.len());
        let repeated = repeated(&triangles, &corners);
        if !repeated.is_empty() {
            warn(
                "duplicate-triangles",
                "triangles with the corners of an earlier one, taken for none",
                repeated.len() as u64,
                None,
            );
            let mut at = 0;
            let mut left = repeated.iter().peekable();
            triangles.retain(|_| {
                at += 1;
                left.next_if(|t| **t == at - 1).is_none()
            });
            corners = Corners::new(&triangles, welded.places.len());
        }
        let mut surface = Surface {
            cells: count_cells(&triangles, &welded.places),
            places: welded.places,
            thin: welded.thin,
            ..Surface::default()
        };
        link(&mut surface, &triangles, &corners);
        check_sides(&surface)?;
        let inverted = turn_outwards(&mut surface);
        if inverted {
            warn(
                "inside-out",
                "the mesh encloses more negative than positive space: taken inside out",
                1,
                None,
            );
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        surface.loops = Loops {
            lengths: vec![3; triangles.len()],
            corners: triangles.into_flattened(),
        };
        Ok(Net {
            surface,
            vertex_of: welded.vertex_of,
            inverted,
            warnings,
        })
    }

    pub(super) fn give(self, lattice: &mut Lattice) {
        lattice.surface = self.surface;
        lattice.vertex_of = self.vertex_of;
        lattice.inverted = self.inverted;
        lattice.warnings = self.warnings;
    }
}

/// The lower corner of the cell that holds all three corners, or the lower one of two.
#[inline]
fn cell_of(triangle: &[u32; 3], places: &[[i32; 3]]) -> Option<[i32; 3]> {
    let [p, q, r] = triangle.map(|v| places[v as usize]);
    let mut cell = [0; 3];
    for a in 0..3 {
        let low = p[a].min(q[a]).min(r[a]) & !1;
        if p[a].max(q[a]).max(r[a]) > low + 2 {
            return None;
        }
        cell[a] = low;
    }
    Some(cell)
}

fn check_cells(triangles: &[[u32; 3]], places: &[[i32; 3]]) -> Result<(), Fault> {
    let over = |t: &&[u32; 3]| cell_of(t, places).is_none();
    let count = triangles.par_iter().filter(over).count();
    if count == 0 {
        return Ok(());
    }
    let total = triangles.len();
    let share = 100.0 * count as f64 / total as f64;
    let first = triangles.iter().position(|t| over(&t)).unwrap_or(0);
    Err(refused(format!(
        "{count} of {total} triangles ({share:.1} %) reach over more than one cell of the lattice, the first is {first}: a simplified mesh"
    )))
}

fn count_cells(triangles: &[[u32; 3]], places: &[[i32; 3]]) -> u64 {
    let mut cells: Vec<u128> = triangles
        .par_iter()
        .filter_map(|t| cell_of(t, places))
        .map(|cell| {
            cell.iter()
                .fold(0, |key, c| key << 31 | u128::from((c + MOST) as u32))
        })
        .collect();
    // Triangles of one cell often follow each other.
    cells.dedup();
    cells.par_sort_unstable();
    cells.dedup();
    cells.len() as u64
}

/// Triangles with the corners of an earlier one, in the same sense.
fn repeated(triangles: &[[u32; 3]], corners: &Corners) -> Vec<u32> {
    let from_least = |t: [u32; 3]| {
        let at = (0..3).min_by_key(|i| t[*i]).unwrap_or(0);
        [t[at], t[(at + 1) % 3], t[(at + 2) % 3]]
    };
    (0..triangles.len() as u32)
        .into_par_iter()
        .with_min_len(CHUNK)
        .filter(|t| {
            let own = from_least(triangles[*t as usize]);
            corners.of(own[0] as usize).iter().any(|corner| {
                let other = corner / 3;
                other < *t && from_least(triangles[other as usize]) == own
            })
        })
        .collect()
}

/// What lies in one direction from a vertex: at the lower end of its edge, across, at the upper end.
#[derive(Debug, Clone, Copy, Default)]
struct Candidates {
    sides: [u8; 3],
    triangles: [u8; 3],
    vertices: [u32; 3],
}

impl Candidates {
    /// The one that follows on the curve.
    fn choose(&self, lower_inside: bool) -> Option<usize> {
        // On a face of four the edge across splits a polygon.
        match (self.sides[0], self.sides[2]) {
            (0, 0) => (self.sides[1] != 0).then_some(1),
            (_, 0) => Some(0),
            (0, _) => Some(2),
            _ => Some(match self.rank(0).cmp(&self.rank(2)) {
                std::cmp::Ordering::Greater => 0,
                std::cmp::Ordering::Less => 2,
                std::cmp::Ordering::Equal if lower_inside => 0,
                std::cmp::Ordering::Equal => 2,
            }),
        }
    }

    /// How much speaks for an edge being the end of two polygons and no diagonal of one: a triangle on
    /// each side, or one at all where the surface ends. Those that split polygons of both cells have
    /// four. A triangle within the face may be of either cell.
    fn rank(&self, kind: usize) -> u32 {
        match (self.triangles[kind], self.sides[kind]) {
            (1, _) => 3,
            (2, WITHIN) => 3,
            (2, sides) if sides == BELOW | ABOVE => 3,
            (2, sides) => sides.count_ones(),
            _ => 0,
        }
    }
}

/// What one vertex knows of its neighbours.
#[derive(Debug, Clone, Copy, Default)]
struct Star {
    candidates: [Candidates; 4],
    /// Over 0 where triangles say that the lower end is inside.
    vote: i32,
}

/// The slot of a step to a vertex on a face of the cell, and the axis across its own that it takes.
#[inline]
fn slot_of(axis: usize, step: [i32; 3]) -> Option<(u8, usize)> {
    let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
    let along = match (step[next], step[last]) {
        (0, s) if s != 0 => last,
        (s, 0) if s != 0 => next,
        _ => return None,
    };
    let fits = step[axis].abs() <= 1 && step[axis].abs() + step[along].abs() == 2;
    fits.then(|| (slot(axis, along, step[along] > 0), along))
}

#[inline]
fn step_between(from: [i32; 3], to: [i32; 3]) -> [i32; 3] {
    std::array::from_fn(|a| to[a] - from[a])
}

impl Star {
    fn new(v: usize, places: &[[i32; 3]], triangles: &[[u32; 3]], corners: &Corners) -> Star {
        let mut star = Star::default();
        for corner in corners.of(v) {
            let (t, i) = (triangles[*corner as usize / 3], *corner as usize % 3);
            let (next, last) = (t[(i + 1) % 3], t[(i + 2) % 3]);
            star.see(v, next, last, 1, places);
            star.see(v, last, next, -1, places);
        }
        star
    }

    /// An edge of the mesh to `w` in a triangle with `third`, which `turn` says to come after it.
    #[inline]
    fn see(&mut self, v: usize, w: u32, third: u32, turn: i32, places: &[[i32; 3]]) {
        let at = places[v];
        let axis = axis_of(at);
        let step = step_between(at, places[w as usize]);
        let Some((slot, along)) = slot_of(axis, step) else {
            return;
        };
        let across = 3 - axis - along;
        let side = (places[third as usize][across] - at[across]).signum();
        let candidates = &mut self.candidates[usize::from(slot)];
        let kind = (step[axis] + 1) as usize;
        candidates.vertices[kind] = w;
        candidates.triangles[kind] = candidates.triangles[kind].saturating_add(1);
        candidates.sides[kind] |= match side {
            -1 => BELOW,
            1 => ABOVE,
            _ => WITHIN,
        };
        // The component along the axis of the product of the step with the way into the cell. A
        // polygon's diagonal is passed both ways and adds nothing.
        let cyclic = if along == (axis + 1) % 3 { 1 } else { -1 };
        self.vote += turn * side * step[along].signum() * cyclic;
    }
}

/// Which end of each edge is inside, and the links that both vertices agree on.
fn link(surface: &mut Surface, triangles: &[[u32; 3]], corners: &Corners) {
    let places = &surface.places;
    let n = places.len();
    let chosen: Vec<([u32; 4], [u8; 4], bool)> = (0..n)
        .into_par_iter()
        .with_min_len(CHUNK)
        .map(|v| {
            let star = Star::new(v, places, triangles, corners);
            let lower_inside = star.vote > 0;
            let (mut to, mut steps) = ([NONE; 4], [0; 4]);
            for slot in 0..4 {
                let candidates = &star.candidates[slot];
                if let Some(kind) = candidates.choose(lower_inside) {
                    let w = candidates.vertices[kind];
                    to[slot] = w;
                    steps[slot] = step_code(step_between(places[v], places[w as usize]));
                }
            }
            (to, steps, lower_inside)
        })
        .collect();
    let linked: Vec<([u32; 4], [u8; 4])> = (0..n)
        .into_par_iter()
        .with_min_len(CHUNK)
        .map(|v| {
            let (to, codes, _) = chosen[v];
            let (mut links, mut steps) = ([NONE; 4], [0; 4]);
            for slot in 0..4 {
                if to[slot] == NONE {
                    continue;
                }
                let w = to[slot] as usize;
                let back = step_between(places[w], places[v]);
                if let Some((back, _)) = slot_of(axis_of(places[w]), back)
                    && chosen[w].0[usize::from(back)] == v as u32
                {
                    links[slot] = to[slot] << 2 | u32::from(back);
                    steps[slot] = codes[slot];
                }
            }
            (links, steps)
        })
        .collect();
    surface.lower_inside = chosen.iter().map(|c| c.2).collect();
    (surface.links, surface.steps) = linked.into_iter().unzip();
}

/// Whether a link joins vertices that agree on which side is inside.
fn agrees(surface: &Surface, v: usize, slot: usize) -> bool {
    let link = surface.links[v][slot];
    if link == NONE {
        return true;
    }
    let w = (link >> 2) as usize;
    let step = step_of(surface.steps[v][slot]);
    let (a, b) = (axis_of(surface.places[v]), axis_of(surface.places[w]));
    if a == b {
        return surface.lower_inside[v] == surface.lower_inside[w];
    }
    // Both edges end at one voxel.
    let seen = |of: usize, lower: bool| surface.lower_inside[of] == lower;
    seen(v, step[a] < 0) == seen(w, step[b] > 0)
}

fn check_sides(surface: &Surface) -> Result<(), Fault> {
    let count = |v: usize| (0..4).filter(|slot| !agrees(surface, v, *slot)).count();
    let disagreeing: usize = (0..surface.len())
        .into_par_iter()
        .with_min_len(CHUNK)
        .map(count)
        .sum();
    if disagreeing == 0 {
        return Ok(());
    }
    let total = 4 * surface.len();
    let share = 100.0 * disagreeing as f64 / total as f64;
    let problem = format!(
        "{disagreeing} of {total} neighbours ({share:.1} %) disagree on which side is inside: triangles are turned opposite ways"
    );
    Err(Fault::whole(problem).with_hint("make all triangles counter-clockwise from outside"))
}

/// Exchanges inside and outside of a closed surface that encloses less than nothing.
fn turn_outwards(surface: &mut Surface) -> bool {
    if surface.links.iter().flatten().any(|link| *link == NONE) {
        return false;
    }
    let of_face = |v: usize| {
        let place = surface.places[v];
        match (axis_of(place), surface.lower_inside[v]) {
            (0, true) => i64::from(place[0]),
            (0, false) => -i64::from(place[0]),
            _ => 0,
        }
    };
    let doubled: i64 = (0..surface.len()).map(of_face).sum();
    if doubled < 0 {
        surface.lower_inside.iter_mut().for_each(|l| *l = !*l);
    }
    doubled < 0
}
