//! Polygons: splitting a face of many corners into triangles.
//!
//! A face of n corners becomes n - 2 triangles over its own vertices. A strictly convex face is
//! split as a fan around its first corner; any other by clipping ears, decided by exact
//! orientations in the projection along the largest component of the face's normal. What has no
//! ears left (an outline that crosses itself, or lies on a line) is finished as a fan.

use super::{Mesh, Polygons};
use crate::error::Fault;
use crate::numeric::predicates::orient2d;
use crate::numeric::vector::Vec3;
use crate::report::{Tally, Warning};
use rayon::prelude::*;
use std::collections::VecDeque;

/// Faces that one task splits.
const FACES_PER_TASK: usize = 2048;
/// Steps that clipping may take per corner before the rest becomes a fan: it bounds the time that
/// an outline made for the purpose can take, and is far over what outlines of maps and parts need.
const STEPS_PER_CORNER: usize = 4096;
/// Corners from which on a grid is worth its making.
const GRID_FROM: usize = 24;

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
pub fn triangulate(positions: &[Vec3], face: &[u32], triangles: &mut Vec<[u32; 3]>) -> Split {
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

/// What clipping needs, kept from face to face.
#[derive(Default)]
struct Scratch {
    flat: Vec<[f64; 2]>,
    next: Vec<usize>,
    previous: Vec<usize>,
    waiting: VecDeque<usize>,
    /// `Gone` once clipped.
    state: Vec<State>,
    grid: Grid,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Waiting,
    Tried,
    Gone,
}

/// How much is asked of an ear. Later ones are tried only when the earlier find none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Rule {
    /// Turns left, and no other corner touches it but those at the ends of its base.
    Clear,
    /// The same, but other corners may lie at its tip (a hole joined by a bridge).
    SharedTip,
    /// A tip on the line through its neighbours: a triangle of no area.
    Flat,
}

impl Scratch {
    fn clip(&mut self, face: &[u32], triangles: &mut Vec<[u32; 3]>) -> Split {
        let n = face.len();
        self.next.clear();
        self.next.extend((0..n).map(|i| (i + 1) % n));
        self.previous.clear();
        self.previous.extend((0..n).map(|i| (i + n - 1) % n));
        self.state.clear();
        self.state.resize(n, State::Waiting);
        self.waiting.clear();
        self.waiting.extend(0..n);
        self.grid.fill(&self.flat);
        let mut left = n;
        let mut steps = n.saturating_mul(STEPS_PER_CORNER);
        let mut rule = Rule::Clear;
        let mut first = 0;
        while left > 3 && steps > 0 {
            let Some(tip) = self.waiting.pop_front() else {
                rule = match rule {
                    Rule::Clear => Rule::SharedTip,
                    Rule::SharedTip => Rule::Flat,
                    Rule::Flat => break,
                };
                steps = steps.saturating_sub(left);
                self.wait_all(first);
                continue;
            };
            if self.state[tip] == State::Gone {
                continue;
            }
            self.state[tip] = State::Tried;
            steps -= 1;
            if !self.is_ear(tip, rule, &mut steps) {
                continue;
            }
            let (p, q) = (self.previous[tip], self.next[tip]);
            triangles.push([face[p], face[tip], face[q]]);
            self.next[p] = q;
            self.previous[q] = p;
            self.state[tip] = State::Gone;
            left -= 1;
            if first == tip {
                first = q;
            }
            // Clipping an ear makes ears of its neighbours alone (O'Rourke 1998, 1.6.5).
            if rule != Rule::Clear {
                rule = Rule::Clear;
                self.waiting.clear();
                self.state
                    .iter_mut()
                    .filter(|s| **s == State::Waiting)
                    .for_each(|s| *s = State::Tried);
                steps = steps.saturating_sub(n);
            }
            for corner in [p, q] {
                if self.state[corner] == State::Tried {
                    self.state[corner] = State::Waiting;
                    self.waiting.push_back(corner);
                }
            }
        }
        let rest = std::iter::successors(Some(first), |c| Some(self.next[*c])).take(left);
        fan(face, rest, triangles);
        if left == 3 {
            Split::Covered
        } else {
            Split::Fanned
        }
    }

    fn wait_all(&mut self, first: usize) {
        let mut corner = first;
        loop {
            self.state[corner] = State::Waiting;
            self.waiting.push_back(corner);
            corner = self.next[corner];
            if corner == first {
                return;
            }
        }
    }

    fn is_ear(&self, tip: usize, rule: Rule, steps: &mut usize) -> bool {
        let (p, q) = (self.previous[tip], self.next[tip]);
        let [a, b, c] = [self.flat[p], self.flat[tip], self.flat[q]];
        let turn = orient2d(a, b, c);
        if rule == Rule::Flat {
            return turn == 0;
        }
        if turn <= 0 {
            return false;
        }
        let blocks = |i: usize| {
            let x = self.flat[i];
            self.state[i] != State::Gone
                && ![p, tip, q].contains(&i)
                && x != a
                && x != c
                && (x != b || rule == Rule::Clear)
                && orient2d(a, b, x) >= 0
                && orient2d(b, c, x) >= 0
                && orient2d(c, a, x) >= 0
        };
        !self.grid.any_near([a, b, c], steps, blocks)
    }
}

/// Corners sorted into square cells.
#[derive(Default)]
struct Grid {
    side: usize,
    lo: [f64; 2],
    per_unit: [f64; 2],
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Grid {
    fn fill(&mut self, flat: &[[f64; 2]]) {
        self.side = if flat.len() < GRID_FROM {
            1
        } else {
            (flat.len() as f64).sqrt() as usize
        };
        self.lo = flat
            .iter()
            .fold([f64::INFINITY; 2], |m, p| [m[0].min(p[0]), m[1].min(p[1])]);
        let hi = flat.iter().fold([f64::NEG_INFINITY; 2], |m, p| {
            [m[0].max(p[0]), m[1].max(p[1])]
        });
        self.per_unit = [0, 1].map(|a| self.side as f64 / (hi[a] - self.lo[a]));
        let cells = self.side * self.side;
        self.starts.clear();
        self.starts.resize(cells + 1, 0);
        for p in flat {
            let cell = self.row(p[1]) * self.side + self.column(p[0]);
            self.starts[cell + 1] += 1;
        }
        for cell in 0..cells {
            self.starts[cell + 1] += self.starts[cell];
        }
        self.items.clear();
        self.items.resize(flat.len(), 0);
        // Filled from the back, the offsets end as they began.
        for (i, p) in flat.iter().enumerate().rev() {
            let cell = self.row(p[1]) * self.side + self.column(p[0]);
            self.starts[cell + 1] -= 1;
            self.items[self.starts[cell + 1] as usize] = i as u32;
        }
        self.starts.rotate_left(1);
        self.starts[cells] = flat.len() as u32;
    }

    // Rounding is monotone: what lies between two coordinates lies between their cells.
    fn column(&self, x: f64) -> usize {
        (((x - self.lo[0]) * self.per_unit[0]) as usize).min(self.side - 1)
    }

    fn row(&self, y: f64) -> usize {
        (((y - self.lo[1]) * self.per_unit[1]) as usize).min(self.side - 1)
    }

    /// Whether a test holds for any corner in the cells that a triangle's box touches.
    fn any_near(
        &self,
        triangle: [[f64; 2]; 3],
        steps: &mut usize,
        test: impl Fn(usize) -> bool,
    ) -> bool {
        let [a, b, c] = triangle;
        let lo = [0, 1].map(|i| a[i].min(b[i]).min(c[i]));
        let hi = [0, 1].map(|i| a[i].max(b[i]).max(c[i]));
        let columns = self.column(lo[0])..=self.column(hi[0]);
        for row in self.row(lo[1])..=self.row(hi[1]) {
            let from = self.starts[row * self.side + columns.start()];
            let to = self.starts[row * self.side + columns.end() + 1];
            *steps = steps.saturating_sub(1 + (to - from) as usize);
            for i in &self.items[from as usize..to as usize] {
                if test(*i as usize) {
                    return true;
                }
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::vector::{cross, dot, sub};
    use proptest::prelude::*;

    fn split(outline: &[Vec3]) -> (Vec<[u32; 3]>, Split) {
        let face: Vec<u32> = (0..outline.len() as u32).collect();
        let mut triangles = Vec::new();
        let split = triangulate(outline, &face, &mut triangles);
        (triangles, split)
    }

    fn flat(outline: &[[f64; 2]]) -> Vec<Vec3> {
        outline.iter().map(|p| [p[0], p[1], 0.0]).collect()
    }

    /// Twice the signed area of a triangle seen from above.
    fn area(points: &[Vec3], [a, b, c]: [u32; 3]) -> f64 {
        let [a, b, c] = [a, b, c].map(|v| points[v as usize]);
        cross(sub(b, a), sub(c, a))[2]
    }

    /// Triangles that all turn left and whose areas add up to the outline's cover it once.
    fn assert_covers(points: &[Vec3], triangles: &[[u32; 3]]) {
        let n = points.len();
        assert_eq!(triangles.len(), n - 2);
        let outline: f64 = (0..n)
            .map(|i| {
                let (p, q) = (points[i], points[(i + 1) % n]);
                p[0] * q[1] - p[1] * q[0]
            })
            .sum();
        let sum: f64 = triangles.iter().map(|t| area(points, *t)).sum();
        for t in triangles {
            assert!(area(points, *t) >= 0.0, "{t:?} turns the wrong way");
        }
        assert!(
            (sum - outline).abs() <= 1e-9 * outline,
            "{sum} for {outline}"
        );
    }

    #[test]
    fn a_convex_face_is_a_fan() {
        let square = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        let fan = (vec![[0, 1, 2], [0, 2, 3]], Split::Covered);
        assert_eq!(split(&square), fan);
        let clockwise: Vec<_> = square.iter().rev().copied().collect();
        assert_eq!(split(&clockwise), fan);
    }

    #[test]
    fn a_dart_is_cut_at_its_notch() {
        let dart = flat(&[[0.0, 0.0], [2.0, -1.0], [0.5, 0.0], [2.0, 1.0]]);
        let (triangles, how) = split(&dart);
        assert_eq!(how, Split::Covered);
        assert_covers(&dart, &triangles);
        assert!(triangles.iter().all(|t| t.contains(&2) && t.contains(&0)));
    }

    #[test]
    fn a_corner_in_the_middle_of_a_side_makes_no_flat_triangle() {
        let outline = flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]);
        for turn in 0..5 {
            let mut turned = outline.clone();
            turned.rotate_left(turn);
            let (triangles, how) = split(&turned);
            assert_eq!(how, Split::Covered);
            assert_covers(&turned, &triangles);
            assert!(triangles.iter().all(|t| area(&turned, *t) > 0.0));
        }
    }

    #[test]
    fn a_hole_joined_by_a_bridge_stays_open() {
        // A square of side 4, a bridge from its first corner to a square hole of side 2.
        let outline = flat(&[
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 4.0],
            [0.0, 4.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 3.0],
            [3.0, 3.0],
            [3.0, 1.0],
            [1.0, 1.0],
        ]);
        let (triangles, how) = split(&outline);
        assert_eq!(how, Split::Covered);
        assert_covers(&outline, &triangles);
    }

    #[test]
    fn outlines_that_cannot_be_covered_still_give_every_triangle() {
        let star: Vec<_> = (0..5)
            .map(|i| {
                let angle = f64::from(i) * 0.8 * std::f64::consts::PI;
                [angle.cos(), angle.sin()]
            })
            .collect();
        let bow = [[0.0, 0.0], [3.0, 2.0], [3.0, 0.0], [0.0, 1.0]];
        let line = [[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0], [1.5, 1.5]];
        for outline in [&star[..], &bow, &line, &[[7.0, 7.0]; 6]] {
            assert_eq!(split(&flat(outline)).0.len(), outline.len() - 2);
        }
        assert_eq!(split(&flat(&line)).1, Split::Fanned);
    }

    #[test]
    fn an_outline_of_many_corners_is_clipped_in_time() {
        // A comb: every second corner is a deep notch.
        let n = 20_000;
        let mut comb: Vec<_> = (0..n)
            .map(|i| [f64::from(i), if i % 2 == 0 { 0.0 } else { 100.0 }])
            .collect();
        comb.push([f64::from(n), -1.0]);
        comb.push([0.0, -1.0]);
        comb.reverse();
        let points = flat(&comb);
        let (triangles, how) = split(&points);
        assert_eq!((triangles.len(), how), (comb.len() - 2, Split::Covered));
    }

    #[test]
    fn faces_are_kept_beside_their_triangles() {
        let mut mesh = Mesh {
            positions: flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]),
            ..Mesh::default()
        };
        let mut faces = Polygons::default();
        faces.push(&[0, 1]);
        faces.push(&[0, 1, 2, 3]);
        faces.push(&[1, 1, 2]);
        faces.push(&[]);
        let mut warnings = Vec::new();
        set_faces(&mut mesh, faces.clone(), &mut warnings).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [1, 1, 2]]);
        let kept = mesh.polygons.as_ref().unwrap();
        assert_eq!(kept.iter().map(<[u32]>::len).collect::<Vec<_>>(), [4, 3]);
        assert_eq!(warnings.len(), 1);
        assert_eq!((&*warnings[0].code, warnings[0].count), ("short-faces", 2));
        assert_eq!(warnings[0].first, Some(0));

        faces.push(&[3, 4, 0]);
        let fault = set_faces(&mut mesh, faces, &mut warnings).unwrap_err();
        let message = "face 4: refers to vertex 4, but there are 4";
        assert_eq!(fault.to_string(), message);
    }

    /// Outlines that go round the origin once: star-shaped, often concave.
    fn star_shaped() -> impl Strategy<Value = Vec<[f64; 2]>> {
        prop::collection::vec(0.1..1.0f64, 4..60).prop_map(|radii| {
            let step = std::f64::consts::TAU / radii.len() as f64;
            let at =
                |(i, r): (usize, &f64)| [r * (i as f64 * step).cos(), r * (i as f64 * step).sin()];
            radii.iter().enumerate().map(at).collect()
        })
    }

    proptest! {
        #[test]
        fn star_shaped_outlines_are_covered(outline in star_shaped()) {
            let points = flat(&outline);
            let (triangles, how) = split(&points);
            prop_assert_eq!(how, Split::Covered);
            assert_covers(&points, &triangles);
        }

        #[test]
        fn size_place_and_axis_change_nothing(outline in star_shaped(), power in -900..900i32) {
            // Multiples of 2^-20, so that the move is exact.
            let grid: Vec<Vec3> = outline
                .iter()
                .map(|p| [(p[0] * 1048576.0).round() / 1048576.0, (p[1] * 1048576.0).round() / 1048576.0, 0.0])
                .collect();
            let expected = split(&grid);
            let scaled: Vec<_> = grid.iter().map(|p| p.map(|c| c * 2f64.powi(power))).collect();
            prop_assert_eq!(&split(&scaled), &expected);
            let moved: Vec<_> = grid.iter().map(|p| [p[0] + 3e9, p[1] - 1e9, p[2] + 5.0]).collect();
            prop_assert_eq!(&split(&moved), &expected);
            let turned: Vec<_> = grid.iter().map(|p| [p[1], p[2], p[0]]).collect();
            prop_assert_eq!(&split(&turned), &expected);
        }

        #[test]
        fn any_outline_gives_every_triangle(outline in prop::collection::vec(prop::array::uniform3(-3..3i32), 3..40)) {
            let points: Vec<Vec3> = outline.iter().map(|p| p.map(f64::from)).collect();
            prop_assert_eq!(split(&points).0.len(), points.len() - 2);
            // The area vector does not depend on how a closed outline is split.
            let (mut sum, mut around) = ([0.0; 3], [0.0; 3]);
            for [a, b, c] in split(&points).0 {
                let [a, b, c] = [a, b, c].map(|v| points[v as usize]);
                for (s, n) in sum.iter_mut().zip(cross(sub(b, a), sub(c, a))) {
                    *s += n;
                }
            }
            for i in 0..points.len() {
                for (s, n) in around.iter_mut().zip(cross(points[i], points[(i + 1) % points.len()])) {
                    *s += n;
                }
            }
            prop_assert!(dot(sub(sum, around), sub(sum, around)) == 0.0);
        }
    }
}
