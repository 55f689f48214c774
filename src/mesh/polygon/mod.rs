//! Polygons: splitting a face of many corners into triangles.
//!
//! A face of n corners becomes n - 2 triangles over its own vertices. A strictly convex face is
//! split as a fan around its first corner; any other by clipping ears, decided by exact
//! orientations in the projection along the largest component of the face's normal. What has no
//! ears left (an outline that crosses itself, or lies on a line) is finished as a fan.

mod clip;
#[cfg(test)]
mod tests;

use super::{Mesh, Polygons};
use crate::error::Fault;
use crate::numeric::predicates::orient2d;
use crate::numeric::vector::Vec3;
use crate::report::{Tally, Warning};
use clip::Scratch;
use rayon::prelude::*;

/// Faces that one task splits.
const FACES_PER_TASK: usize = 2048;

impl Polygons {
    /// Adds a face at the end.
    ///
    /// Offsets are 32 bits wide: [`set_faces`] refuses a list with more corners than they count.
    pub fn push(&mut self, face: &[u32]) {
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        self.corners.extend_from_slice(face);
        self.starts.push(self.corners.len() as u32);
    }

    /// The corners of face `f`.
    pub fn face(&self, f: usize) -> &[u32] {
        &self.corners[self.starts[f] as usize..self.starts[f + 1] as usize]
    }
}

/// Gives a mesh its faces: as they are, and split into triangles.
///
/// `polygons` stays `None` when every face is a triangle. A face of fewer than three corners
/// encloses nothing and is kept out, with a counted warning; a face that repeats a vertex is kept.
/// Faces that had to be finished as a fan are counted in a warning too.
///
/// # Errors
///
/// When a corner refers to a vertex that is not there, or when there are 2^32 corners or more.
///
/// # Cost
///
/// Linear in the corners for triangles and convex faces; a concave face of n corners takes about
/// n log n steps where corners are spread evenly, and never more than 4096 n.
pub fn set_faces(
    mesh: &mut Mesh,
    faces: Polygons,
    warnings: &mut Vec<Warning>,
) -> Result<(), Fault> {
    if u32::try_from(faces.corners.len()).is_err() {
        return Err(Fault::whole(format!(
            "the faces have {} corners, but at most {} can be held",
            faces.corners.len(),
            u32::MAX
        )));
    }
    check_range(&faces, mesh.positions.len())?;
    let faces = without_short(faces, warnings);
    if faces.starts.windows(2).all(|w| w[1] - w[0] == 3) {
        mesh.triangles = triples(&faces.corners);
        mesh.polygons = None;
        return Ok(());
    }
    let positions = &mesh.positions;
    let parts: Vec<(Vec<[u32; 3]>, Tally)> = (0..faces.len().div_ceil(FACES_PER_TASK))
        .into_par_iter()
        .map_init(Scratch::default, |scratch, task| {
            let range =
                task * FACES_PER_TASK..faces.len().min(task.saturating_add(1) * FACES_PER_TASK);
            let corners = (faces.starts[range.end] - faces.starts[range.start]) as usize;
            let mut triangles = Vec::with_capacity(corners - 2 * range.len());
            let mut fanned = Tally::default();
            for f in range {
                if triangulate_with(scratch, positions, faces.face(f), &mut triangles)
                    == Split::Fanned
                {
                    fanned.note(f as u64);
                }
            }
            (triangles, fanned)
        })
        .collect();
    let mut fanned = Tally::default();
    let mut triangles = Vec::with_capacity(faces.corners.len() - 2 * faces.len());
    for (part, tally) in parts {
        triangles.extend_from_slice(&part);
        fanned.add(tally);
    }
    fanned.warn(
        "fanned-faces",
        "the outline of a face crosses itself or encloses no area; split as a fan",
        warnings,
    );
    mesh.triangles = triangles;
    mesh.polygons = Some(faces);
    Ok(())
}

fn triples(corners: &[u32]) -> Vec<[u32; 3]> {
    corners
        .chunks_exact(3)
        .map(|c| [c[0], c[1], c[2]])
        .collect()
}

fn check_range(faces: &Polygons, count: usize) -> Result<(), Fault> {
    let bad = faces
        .corners
        .par_iter()
        .position_first(|v| *v as usize >= count);
    let Some(corner) = bad else { return Ok(()) };
    let face = faces.starts.partition_point(|s| *s as usize <= corner) - 1;
    Err(Fault::element(
        "face",
        face,
        format!(
            "refers to vertex {}, but there are {count}",
            faces.corners[corner]
        ),
    ))
}

fn without_short(faces: Polygons, warnings: &mut Vec<Warning>) -> Polygons {
    let mut short = Tally::default();
    for (f, w) in faces.starts.windows(2).enumerate() {
        if w[1] - w[0] < 3 {
            short.note(f as u64);
        }
    }
    if short.is_empty() {
        return faces;
    }
    short.warn(
        "short-faces",
        "a face has fewer than three corners; left out",
        warnings,
    );
    let mut kept = Polygons::default();
    for face in faces.iter().filter(|face| face.len() >= 3) {
        kept.push(face);
    }
    kept
}

/// How a face was split.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Split {
    /// Into triangles that cover it, each turning as the face does (or of no area, where the
    /// outline folds back on itself).
    Covered,
    /// In part or whole as a fan: the outline crosses itself or lies on one line.
    Fanned,
}

/// Splits one face into triangles, appended to `triangles`: n - 2 of them for n corners, none for
/// fewer than three.
///
/// The triangles turn as the face does. The result depends on the corners' order and places alone;
/// moving the face by a vector that leaves all coordinates exact, or scaling it by a power of two,
/// changes nothing.
///
/// # Cost
///
/// As [`set_faces`].
///
/// # Source
///
/// Ear clipping: Meisters, "Polygons have ears", 1975; normal by Newell's method (Sutherland,
/// Sproull and Schumacker, 1974).
#[cfg(test)]
fn triangulate(positions: &[Vec3], face: &[u32], triangles: &mut Vec<[u32; 3]>) -> Split {
    triangulate_with(&mut Scratch::default(), positions, face, triangles)
}

fn triangulate_with(
    scratch: &mut Scratch,
    positions: &[Vec3],
    face: &[u32],
    triangles: &mut Vec<[u32; 3]>,
) -> Split {
    match face.len() {
        0..3 => return Split::Covered,
        3 => {
            triangles.push([face[0], face[1], face[2]]);
            return Split::Covered;
        }
        _ => {}
    }
    let flat = &mut scratch.flat;
    if !project(positions, face, flat) {
        fan(face, 0..face.len(), triangles);
        return Split::Fanned;
    }
    if is_strictly_convex(flat) {
        fan(face, 0..face.len(), triangles);
        return Split::Covered;
    }
    scratch.clip(face, triangles)
}

/// Triangles around the first of the given corners.
fn fan(face: &[u32], corners: impl IntoIterator<Item = usize>, triangles: &mut Vec<[u32; 3]>) {
    let mut corners = corners.into_iter().map(|c| face[c]);
    let (Some(apex), Some(mut last)) = (corners.next(), corners.next()) else {
        return;
    };
    for next in corners {
        triangles.push([apex, last, next]);
        last = next;
    }
}

/// The face seen along its dominant axis, so that it turns counter-clockwise, scaled by a power of
/// two to a size near 1. False when the normal is zero.
fn project(positions: &[Vec3], face: &[u32], flat: &mut Vec<[f64; 2]>) -> bool {
    let at = |c: usize| positions[face[c] as usize];
    let largest = face
        .iter()
        .flat_map(|v| positions[*v as usize])
        .fold(0.0f64, |m, c| m.max(c.abs()));
    let shrink = power_of_two_below(largest).recip();
    let origin = at(0).map(|c| c * shrink);
    let from_origin = |c: usize| {
        let p = at(c);
        [0, 1, 2].map(|a| p[a] * shrink - origin[a])
    };
    let extent = (1..face.len())
        .flat_map(from_origin)
        .fold(0.0f64, |m, c| m.max(c.abs()));
    // A second scaling, so that the products of a small face far from the origin do not underflow.
    let grow = power_of_two_below(extent).recip();
    let mut normal = [0.0; 3];
    let mut p = [0.0; 3];
    for c in 1..=face.len() {
        let q = from_origin(c % face.len()).map(|x| x * grow);
        for (a, n) in normal.iter_mut().enumerate() {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            *n += p[b] * q[c] - p[c] * q[b];
        }
        p = q;
    }
    let size = normal.map(f64::abs);
    let axis = if size[0] >= size[1] && size[0] >= size[2] {
        0
    } else if size[1] >= size[2] {
        1
    } else {
        2
    };
    if size[axis] == 0.0 || !size[axis].is_finite() {
        return false;
    }
    let (mut u, mut v) = ((axis + 1) % 3, (axis + 2) % 3);
    if normal[axis] < 0.0 {
        std::mem::swap(&mut u, &mut v);
    }
    flat.clear();
    flat.extend((0..face.len()).map(|c| [at(c)[u] * shrink, at(c)[v] * shrink]));
    true
}

/// The largest power of two not above a positive number, held to what has a normal reciprocal.
fn power_of_two_below(value: f64) -> f64 {
    const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
    f64::from_bits(value.clamp(f64::MIN_POSITIVE * 4.0, 1e307).to_bits() & EXPONENT)
}

/// Whether every corner turns left and the outline goes round once.
fn is_strictly_convex(flat: &[[f64; 2]]) -> bool {
    let n = flat.len();
    let mut flips = 0;
    for i in 0..n {
        let (a, b, c) = (flat[i], flat[(i + 1) % n], flat[(i + 2) % n]);
        if orient2d(a, b, c) <= 0 {
            return false;
        }
        // Edges of a convex outline change between rising and falling twice.
        flips += usize::from((a < b) != (b < c));
    }
    flips == 2
}
