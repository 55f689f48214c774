//! The steps: what is done to a mesh, to atoms, to discs or to an animation, and what of it is rounding.

use super::motion::Motion;
use super::subject::Subject;
use crate::anim::Clip;
use crate::mesh::Mesh;
use crate::numeric::rng::Rng;
use crate::numeric::vector::{length, sub};
use crate::points::Splats;
use crate::protein::clearance::Ball;
use crate::trade::Change;
use schemars::JsonSchema;
use serde::Serialize;

/// A change of some size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Step {
    /// Scaled by two to this power.
    Scale(i32),
    /// Moved by about so many extents along x, half as far back along y, a quarter along z.
    Shift(f64),
    /// Turned by 90 degrees about this axis of the coordinates.
    QuarterTurn(usize),
    /// A change that has no size; [`Change::Turn`] is by one radian about (1, 2, 3).
    Plain(Change),
}

/// A mesh, atoms or an animation after a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Changed {
    /// What became of it.
    pub subject: Subject,
    /// How it was moved, if it was.
    pub motion: Motion,
    /// Where vertices have other numbers: which each was.
    pub order: Option<Vec<usize>>,
    /// Where coordinates were rounded: what at the old place `subject` is, moved exactly.
    pub rounded: Option<Subject>,
    /// How far that moved vertices or atoms.
    pub rounding: Rounding,
}

/// How far vertices or atoms were moved that should have stayed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct Rounding {
    /// The largest distance, in the input's unit.
    pub max: f64,
    /// The same over the longest side of the input's box.
    pub relative: f64,
    /// The most that a coordinate changed, in units of the last place of the input's largest.
    pub ulps: f64,
}

impl Rounding {
    fn between(from: &Subject, to: &Subject) -> Self {
        let mut found = Rounding::default();
        let points = from.points();
        let all = points.as_flattened().iter();
        let largest = all.fold(0.0f64, |most, c| most.max(c.abs()));
        let ulp = largest.next_up() - largest;
        for (a, b) in points.iter().zip(&to.points()) {
            let moved = sub(*b, *a);
            found.max = found.max.max(length(moved));
            let most = moved.iter().fold(0.0f64, |most, c| most.max(c.abs()));
            found.ulps = found.ulps.max(most / ulp);
        }
        found.relative = found.max / from.extent();
        found
    }
}

/// Triangles without area that are added.
const DEGENERATE: u64 = 64;

impl Step {
    /// Changes a mesh, atoms or an animation; `seed` draws orders and bits. Errs, with the reason, where the step cannot
    /// be taken. Faces of more corners than three become the triangles they were split into where
    /// elements change. Cost: a copy.
    pub fn apply(self, subject: &Subject, seed: u64) -> Result<Changed, String> {
        match self {
            Step::Scale(exponent) => moved(subject, Motion::scale(exponent), true),
            Step::Shift(extents) => {
                // A power of two has one bit, so adding it keeps as many bits as can be kept.
                let about = (extents * subject.extent()).log2().round();
                let far = about.exp2();
                moved(subject, Motion::shift([far, -0.5 * far, 0.25 * far]), true)
            }
            Step::QuarterTurn(axis) => moved(subject, Motion::quarter_turn(axis), true),
            Step::Plain(Change::Turn) => moved(subject, Motion::turn([1.0, 2.0, 3.0], 1.0), false),
            Step::Plain(Change::Jitter) => {
                let changed = subject.with_points(|index, p| {
                    let mut rng = Rng::new(seed, index as u64);
                    p.map(|c| [c.next_down(), c, c.next_up()][rng.below(3)])
                });
                let rounding = Rounding::between(subject, &changed);
                finite(Changed {
                    subject: changed,
                    motion: Motion::NONE,
                    order: None,
                    rounded: None,
                    rounding,
                })
            }
            Step::Plain(change) => {
                let (subject, order) = match subject {
                    Subject::Mesh(mesh) => {
                        let (mesh, order) = rearranged(change, mesh, seed)?;
                        (Subject::Mesh(mesh), order)
                    }
                    Subject::Atoms(balls) => {
                        (Subject::Atoms(reordered(change, balls, seed)?), None)
                    }
                    Subject::Splats(splats) => (
                        Subject::Splats(rearranged_splats(change, splats, seed)?),
                        None,
                    ),
                    Subject::Clip(clip) => {
                        let (clip, order) = renumbered(change, clip, seed)?;
                        (Subject::Clip(clip), order)
                    }
                };
                Ok(Changed {
                    subject,
                    motion: Motion::NONE,
                    order,
                    rounded: None,
                    rounding: Rounding::default(),
                })
            }
        }
    }
}

/// The clip with other elements, or in another order, in all its frames; and which vertex each was.
fn renumbered(change: Change, clip: &Clip, seed: u64) -> Result<(Clip, Order), String> {
    let (mesh, order) = rearranged(change, &clip.mesh, seed)?;
    let frames = (0..clip.frames()).map(|f| clip.frame(f));
    let positions = match &order {
        Some(order) => frames.flat_map(|at| order.iter().map(|v| at[*v])).collect(),
        None => clip.positions.clone(),
    };
    let changed = Clip {
        mesh,
        positions,
        ..*clip
    };
    Ok((changed, order))
}

/// Which vertex each was, where they have other numbers.
type Order = Option<Vec<usize>>;

/// The atoms in another order, or twice: they have no elements to change.
fn reordered(change: Change, balls: &[Ball], seed: u64) -> Result<Vec<Ball>, String> {
    let mut changed = balls.to_vec();
    match change {
        Change::VertexOrder => shuffle(&mut changed, seed),
        Change::DuplicateFaces => changed.extend_from_within(..),
        _ => return Err("atoms have no faces".to_owned()),
    }
    Ok(changed)
}

/// The discs in another order, or twice: they have no elements to change.
fn rearranged_splats(change: Change, splats: &Splats, seed: u64) -> Result<Splats, String> {
    let mut order: Vec<usize> = (0..splats.splats.len()).collect();
    match change {
        Change::VertexOrder => shuffle(&mut order, seed),
        Change::DuplicateFaces => order.extend_from_within(..),
        _ => return Err("splats have no faces".to_owned()),
    }
    Ok(Splats {
        splats: order.iter().map(|i| splats.splats[*i]).collect(),
        colors: taken(splats.colors.as_deref(), &order),
        classes: taken(splats.classes.as_deref(), &order),
    })
}

/// Those of these indices, where there are any.
fn taken<T: Copy>(items: Option<&[T]>, order: &[usize]) -> Option<Vec<T>> {
    items.map(|items| order.iter().map(|i| items[*i]).collect())
}

/// The mesh with other elements, or in another order; and which vertex each was.
fn rearranged(change: Change, mesh: &Mesh, seed: u64) -> Result<(Mesh, Order), String> {
    let mut order = None;
    let mut changed = Mesh {
        polygons: None,
        ..mesh.clone()
    };
    match change {
        Change::VertexOrder => order = Some(permute_vertices(&mut changed, seed)),
        Change::FaceOrder => {
            shuffle(&mut changed.triangles, seed);
            shuffle(&mut changed.segments, seed);
            shuffle(&mut changed.points, seed);
        }
        Change::SplitVertices => {
            let own;
            (changed, own) = split(mesh);
            order = Some(own);
        }
        Change::DuplicateFaces => {
            changed.triangles.extend_from_within(..);
            changed.segments.extend_from_within(..);
            changed.points.extend_from_within(..);
        }
        Change::DegenerateFaces => {
            if mesh.triangles.is_empty() {
                return Err("there is no triangle to add others at".to_owned());
            }
            for i in 0..DEGENERATE {
                let mut rng = Rng::new(seed, i);
                let [a, b, _] = mesh.triangles[rng.below(mesh.triangles.len())];
                let flat = if i % 2 == 0 { [a, a, a] } else { [a, b, b] };
                changed.triangles.push(flat);
            }
        }
        Change::Scale | Change::Shift | Change::QuarterTurn | Change::Turn | Change::Jitter => {
            return Err(format!("{} is no change of elements", change.name()));
        }
    }
    Ok((changed, order))
}

/// A mesh, atoms or an animation moved. `exactly` says that the motion, undone, gives back what was really moved.
fn moved(subject: &Subject, motion: Motion, exactly: bool) -> Result<Changed, String> {
    let changed = subject.moved(&motion);
    let back = subject.taken_back(&changed, &motion);
    let rounding = Rounding::between(subject, &back);
    // Only what moves to the same place again stands for what was moved.
    let is_rounded = !back.stands_as(subject);
    let stands = exactly && is_rounded && back.moved(&motion).stands_as(&changed);
    finite(Changed {
        subject: changed,
        motion,
        order: None,
        rounded: stands.then_some(back),
        rounding,
    })
}

fn finite(changed: Changed) -> Result<Changed, String> {
    if changed.subject.is_finite() {
        Ok(changed)
    } else {
        Err("coordinates overflow".to_owned())
    }
}

/// Fisher and Yates (1938), each exchange drawn from the seed and its place.
fn shuffle<T>(items: &mut [T], seed: u64) {
    for last in (1..items.len()).rev() {
        items.swap(last, Rng::new(seed, last as u64).below(last + 1));
    }
}

/// Gives the vertices other numbers. Returns which each was.
fn permute_vertices(mesh: &mut Mesh, seed: u64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..mesh.positions.len()).collect();
    shuffle(&mut order, seed);
    let mut place = vec![0u32; order.len()];
    for (new, old) in order.iter().enumerate() {
        place[*old] = new as u32;
    }
    take(mesh, &order);
    let to_new = |v: &mut u32| *v = place[*v as usize];
    mesh.triangles
        .as_flattened_mut()
        .iter_mut()
        .for_each(to_new);
    mesh.segments.as_flattened_mut().iter_mut().for_each(to_new);
    mesh.points.iter_mut().for_each(to_new);
    order
}

/// Makes the vertices those of these old indices.
fn take(mesh: &mut Mesh, order: &[usize]) {
    mesh.positions = order.iter().map(|v| mesh.positions[*v]).collect();
    mesh.normals = taken(mesh.normals.as_deref(), order);
    mesh.colors = taken(mesh.colors.as_deref(), order);
    mesh.classes = taken(mesh.classes.as_deref(), order);
}

/// The same elements, none of which shares a vertex, and which vertex each was. Vertices that no element
/// uses are kept first.
fn split(mesh: &Mesh) -> (Mesh, Vec<usize>) {
    let mut changed = Mesh {
        polygons: None,
        ..mesh.clone()
    };
    let mut used = vec![false; mesh.positions.len()];
    let elements = mesh.triangles.as_flattened().iter();
    let elements = elements
        .chain(mesh.segments.as_flattened())
        .chain(&mesh.points);
    elements.for_each(|v| used[*v as usize] = true);
    let mut order: Vec<usize> = (0..used.len()).filter(|v| !used[*v]).collect();
    let mut own = |v: &mut u32| {
        order.push(*v as usize);
        *v = order.len() as u32 - 1;
    };
    changed
        .triangles
        .as_flattened_mut()
        .iter_mut()
        .for_each(&mut own);
    changed
        .segments
        .as_flattened_mut()
        .iter_mut()
        .for_each(&mut own);
    changed.points.iter_mut().for_each(&mut own);
    take(&mut changed, &order);
    (changed, order)
}
