//! Smoothing that keeps every voxel on its side.
//!
//! A surface that marching cubes took from a binary volume is a staircase; its vertices lie halfway
//! between a voxel inside and one outside. Each may move as long as it stays in its [`Region`]: with
//! the octahedron ("diamond") of half a voxel around its first place, or on its edge, no triangle of
//! any split of the cells' polygons can pass the centre of a voxel, so that the smooth surface stands
//! for the same volume. (Exhaustive: for all 256 cells and any three corners of a polygon, no centre
//! lies in the interior of the hull of their octahedra, nor does one where the corners of a cell are
//! shared out among labels; as octahedra touch centres at their tips, they are kept smaller by a
//! millionth. The tests make the search.)
//!
//! Two energies are minimised under that constraint. `laplacian` is the paper's: each vertex goes to
//! the mean of its neighbours and is clipped. `bilaplacian` (`fair`) is smoother, for it does not
//! shrink, and holds what is enclosed to what the voxels hold.
//!
//! Source: "Constrained smoothing of marching cubes surfaces" (WSCG), sections 3 and 4, with these
//! repairs: the sign of its equation (2); its test for the end compares with the first place, which
//! never gets small, where steps are meant; ties of its rounding are settled by parity ([`lattice`]).

pub mod cesn;
mod fair;
pub mod lattice;
mod neighbours;
#[cfg(test)]
mod paper;
mod parts;
pub mod region;
mod relax;
pub mod taubin;
#[cfg(test)]
mod tests;
mod trade;

use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::numeric::vector::{Vec3, dot, sub};
use crate::progress::Progress;
use crate::trade::named;
use crate::volume::Volume;
use crate::volume::isosurface::cases::step_of;
use crate::volume::isosurface::{Border, Loops, NONE, Select, Surface, axis_of, inside};
use fair::Fair;
use parts::Parts;
use rayon::prelude::*;
use region::{Constraint, Region, STRICT};
use relax::Relax;
use schemars::JsonSchema;
use serde::Serialize;
pub use trade::TRADE;

/// What is made small.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Energy {
    /// The way of each vertex to the mean of its neighbours, as in the paper.
    Laplacian,
    /// The bending of the curves in which the surface meets the planes of voxel centres, with what is
    /// enclosed held to the voxels.
    Bilaplacian,
}
named!(Energy { Laplacian = "laplacian", Bilaplacian = "bilaplacian" });

/// In which order vertices are moved, for [`Energy::Laplacian`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Update {
    /// All at once, from where all were.
    Jacobi,
    /// One after the other, each from where those before have gone. One thread.
    GaussSeidel,
}
named!(Update { Jacobi = "jacobi", GaussSeidel = "gauss-seidel" });

/// What is done where the surface is one voxel thick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Thin {
    /// Vertices go half as far, so that nothing vanishes. Where what is enclosed is held, they go half as
    /// far inwards, and parts that have gone flat all the same are filled from their first places.
    Guard,
    /// Vertices stay.
    Keep,
    /// Nothing: parts may lose their thickness.
    Off,
}
named!(Thin { Guard = "guard", Keep = "keep", Off = "off" });

/// How a surface is smoothed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Params {
    /// Where vertices may go.
    pub constraint: Constraint,
    /// What is made small.
    pub energy: Energy,
    /// In which order vertices are moved.
    pub update: Update,
    /// The longest step at which it ends, in the smallest spacing.
    pub threshold: f64,
    /// Most steps.
    pub max_iterations: u32,
    /// Share of the region's extent that is used.
    pub scale: f64,
    /// What is done where the surface is one voxel thick.
    pub thin: Thin,
}

impl Params {
    /// Fair, in the diamond, in twenty steps at most.
    pub const DEFAULT: Params = Params {
        constraint: Constraint::Diamond,
        energy: Energy::Bilaplacian,
        update: Update::Jacobi,
        threshold: 0.002,
        max_iterations: 20,
        scale: 1.0,
        thin: Thin::Guard,
    };

    /// Most steps of [`Energy::Laplacian`], where none are given.
    pub const LAPLACIAN_ITERATIONS: u32 = 2000;

    /// Errors when a value is out of its range.
    pub fn check(&self) -> Result<()> {
        if !(self.threshold > 0.0 && self.threshold <= 1.0) {
            return Err(Error::parameter(
                "threshold",
                self.threshold,
                "must be over 0 and at most 1",
            ));
        }
        if !(self.scale > 0.0 && self.scale <= 1.0) {
            return Err(Error::parameter(
                "scale",
                self.scale,
                "must be over 0 and at most 1",
            ));
        }
        Ok(())
    }
}

/// Why it ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Stop {
    /// The steps asked for are done.
    #[default]
    MaxIterations,
    /// No vertex moved by the threshold.
    Threshold,
    /// Every vertex and all its neighbours lie still.
    Still,
}

/// How far an energy was brought.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Outcome {
    iterations: u32,
    updates: u64,
    last_step: f64,
    stop: Stop,
}

impl Outcome {
    /// Where there is no vertex, which takes no step.
    const NOTHING: Outcome = Outcome {
        iterations: 0,
        updates: 0,
        last_step: 0.0,
        stop: Stop::Still,
    };
}

/// One closed part of the surface.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Component {
    /// Its vertices.
    pub vertices: u64,
    /// What the voxels within it hold, in voxels; below 0 for a cavity, null for an open part.
    pub voxels: Option<i64>,
    /// What marching cubes encloses, in voxels.
    pub volume_before: f64,
    /// What is enclosed now, in voxels.
    pub volume_after: f64,
}

/// What smoothing did.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Stats {
    /// Steps done.
    pub iterations: u32,
    /// Why it ended.
    pub stop_reason: Stop,
    /// The longest way of a vertex in the last step, in the smallest spacing.
    pub max_step_last: f64,
    /// Vertices moved in all steps, over vertices times steps: the rest lay still.
    pub awake_share: f64,
    /// Vertices where the surface ends.
    pub boundary_vertices: u64,
    /// Vertices where it is one voxel thick.
    pub thin_vertices: u64,
    /// The longest way from a first place, in voxels: the sum along the axes, at most one half in the
    /// diamond.
    pub max_displacement: f64,
    /// Parts that do not touch; where there are labels, the labels.
    pub components: u64,
    /// The parts, largest first; the smallest are left out where there are over 32.
    pub largest: Vec<Component>,
    /// Parts that keep less than a tenth of what marching cubes encloses.
    pub vanishing: u64,
    /// Root mean square of the angle between chords of the curves in which the surface of marching
    /// cubes meets the planes of voxel centres, in degrees; null where there is no curve.
    pub turning_before_deg: Option<f64>,
    /// The same of the smooth surface.
    pub turning_after_deg: Option<f64>,
    /// All parts, or where there are labels, all labels, that of the rest first.
    #[serde(skip)]
    pub parts: Vec<Component>,
    /// What the voxels hold, in voxels; null where the surface is open.
    pub voxels: Option<i64>,
    /// What marching cubes encloses, in voxels; null where the surface is open.
    pub volume_before: Option<f64>,
    /// What is enclosed now, in voxels; null where the surface is open.
    pub volume_after: Option<f64>,
}

/// The way of each vertex in voxels, the triangles, and what is said of them.
pub type Made = (Vec<Vec3>, Vec<[u32; 3]>, Stats);

/// Most parts that are listed.
const LISTED: usize = 32;

/// Moves the vertices of a surface. Returns the offset of each, in voxels along the axes of the grid,
/// and the triangles.
///
/// `spacing` are the lengths of the steps of the grid; only their ratios matter. `given` are the
/// triangles of a mesh, which stay; without them polygons are split along the shortest diagonals of
/// the smooth surface. Cost: per vertex and step some 200 bytes and operations.
pub fn smooth(
    surface: &Surface,
    given: Option<&[[u32; 3]]>,
    spacing: Vec3,
    params: &Params,
    progress: &dyn Progress,
) -> Result<Made> {
    params.check()?;
    let smallest = spacing.iter().copied().fold(f64::INFINITY, f64::min);
    let metric = spacing.map(|s| s / smallest);
    let regions = |vertex: usize| region(surface, vertex, params);
    let parts = Parts::find(surface);
    let before = parts.enclosed(surface);
    progress.stage("smooth", u64::from(params.max_iterations));
    let (mut offsets, outcome) = match params.energy {
        _ if surface.is_empty() => (Vec::new(), Outcome::NOTHING),
        Energy::Laplacian => {
            // Neighbours are those of the split that the paper's tables have.
            let fans = given.is_none().then(|| surface.fans());
            let triangles = given.or(fans.as_deref()).unwrap_or_default();
            Relax::new(surface, triangles, metric, &regions).run(params, &|| progress.advance(1))
        }
        Energy::Bilaplacian => {
            let reach = 0.5 * params.scale * (1.0 - STRICT);
            let fair = Fair::new(surface, metric, reach, &regions);
            let target = parts.target(surface, metric);
            fair.run(params.threshold, params.max_iterations, &target, &|| {
                progress.advance(1)
            })
        }
    };
    progress.stage("split", 0);
    let triangles = match given {
        Some(triangles) => triangles.to_vec(),
        None => surface.triangles(&surface.on_grid(metric, |v| offsets[v])),
    };
    let after = match params.energy {
        Energy::Laplacian => parts.enclosed_by(surface, &triangles, |v| offsets[v]),
        Energy::Bilaplacian => {
            progress.stage("fill", 0);
            let kept = (params.thin != Thin::Off).then_some(&before[..]);
            parts.fill(surface, &triangles, metric, &regions, kept, &mut offsets)
        }
    };
    let turned = [
        turning(surface, metric, |_| [0.0; 3]),
        turning(surface, metric, |v| offsets[v]),
    ];
    let volumes = [&before, &after];
    let stats = stats(surface, params, &outcome, &offsets, &parts, volumes, turned);
    Ok((offsets, triangles, stats))
}

/// Root mean square of the angle between one chord and the next of the curves in which a surface meets
/// the planes of voxel centres, in degrees: what is left of the staircase, and what the shape itself turns.
///
/// `metric` is the spacing over the smallest one, `offset` in voxels; `None` where there is no curve. The
/// mean is taken of the squared distances between the directions, which needs no angle of each.
pub fn turning(
    surface: &Surface,
    metric: Vec3,
    offset: impl Fn(usize) -> Vec3 + Sync,
) -> Option<f64> {
    let chord = |v: usize, slot: usize| {
        let step = step_of(surface.steps[v][slot]);
        let d = sub(offset((surface.links[v][slot] >> 2) as usize), offset(v));
        std::array::from_fn(|a| (0.5 * f64::from(step[a]) + d[a]) * metric[a])
    };
    let square = |v: usize, c: usize| -> f64 {
        let (a, b): (Vec3, Vec3) = (chord(v, 2 * c), chord(v, 2 * c + 1));
        let size = (dot(a, a) * dot(b, b)).sqrt();
        if size > 0.0 {
            2.0 + 2.0 * dot(a, b) / size
        } else {
            0.0
        }
    };
    // Sums of fixed chunks, so that they never follow the threads.
    let partial: Vec<(f64, u64)> = surface
        .links
        .par_chunks(1 << 12)
        .enumerate()
        .map(|(chunk, links)| {
            let (mut squares, mut count) = (0.0, 0);
            for (i, links) in links.iter().enumerate() {
                for c in 0..2 {
                    if links[2 * c] != NONE && links[2 * c + 1] != NONE {
                        squares += square((chunk << 12) + i, c);
                        count += 1;
                    }
                }
            }
            (squares, count)
        })
        .collect();
    let squares: f64 = partial.iter().map(|p| p.0).sum();
    let count = partial.iter().map(|p| p.1).sum::<u64>() as f64;
    let mean = 0.5 * (squares / count).sqrt();
    (count > 0.0).then(|| 2.0 * mean.min(1.0).asin().to_degrees())
}

/// Any mesh, each vertex to the mean of its neighbours within the box of a voxel around its first place:
/// what [`Constraint::CellSize`] is where no grid is known.
///
/// Returns the positions; the figures that need a grid are null or 0. Vertices at the end of the mesh move
/// by their neighbours there alone. Cost: as [`smooth`].
pub fn smooth_in_boxes(
    mesh: &Mesh,
    spacing: Vec3,
    params: &Params,
    progress: &dyn Progress,
) -> Result<(Vec<Vec3>, Stats)> {
    params.check()?;
    progress.stage("smooth", u64::from(params.max_iterations));
    let (positions, outcome) = relax::in_boxes(mesh, spacing, params, &|| progress.advance(1));
    let nothing = Surface::default();
    let parts = Parts::find(&nothing);
    let mut stats = stats(
        &nothing,
        params,
        &outcome,
        &[],
        &parts,
        [&vec![], &vec![]],
        [None; 2],
    );
    let way = |(a, b): (&Vec3, &Vec3)| {
        let d = sub(*a, *b);
        (0..3)
            .map(|axis| (d[axis] / spacing[axis]).abs())
            .fold(0.0, f64::max)
    };
    stats.max_displacement = positions
        .iter()
        .zip(&mesh.positions)
        .map(way)
        .fold(0.0, f64::max);
    stats.awake_share = if outcome.iterations > 0 { 1.0 } else { 0.0 };
    (stats.voxels, stats.volume_before, stats.volume_after) = (None, None, None);
    Ok((positions, stats))
}

/// The dual surface, which has a vertex in each cell, relaxed within the cells: constrained elastic
/// surface nets, for [`Constraint::CellCenter`].
///
/// Returns what [`extract`](crate::volume::isosurface::extract) and [`smooth`] do; the surface has no
/// curves. Errs and costs as [`cesn::cesn`].
pub fn smooth_net(
    volume: &Volume,
    select: &Select,
    border: Border,
    params: &Params,
    progress: &dyn Progress,
) -> Result<(Surface, Made)> {
    params.check()?;
    let steps = (params.threshold, params.max_iterations);
    let net = cesn::cesn(volume, select, border, steps.0, steps.1, progress)?;
    let n = net.places.len();
    let surface = Surface {
        places: net.places,
        lower_inside: vec![false; n],
        thin: vec![false; n],
        links: vec![[NONE; 4]; n],
        steps: vec![[0; 4]; n],
        loops: Loops {
            lengths: vec![3; net.triangles.len()],
            corners: net.triangles.as_flattened().to_vec(),
        },
        cells: n as u64,
        ..Surface::default()
    };
    let outcome = Outcome {
        iterations: net.iterations,
        updates: n as u64 * u64::from(net.iterations),
        last_step: net.last_step,
        stop: net.stop,
    };
    let parts = Parts::find(&surface);
    let before = parts.enclosed_by(&surface, &net.triangles, |_| [0.0; 3]);
    let after = parts.enclosed_by(&surface, &net.triangles, |v| net.offsets[v]);
    let volumes = [&before, &after];
    let mut stats = stats(
        &surface,
        params,
        &outcome,
        &net.offsets,
        &parts,
        volumes,
        [None; 2],
    );
    for part in stats.largest.iter_mut().chain(&mut stats.parts) {
        part.voxels = None;
    }
    let closed = border == Border::Closed;
    stats.voxels = closed.then(|| inside(volume, select).count() as i64);
    let sum = |of: &[f64]| closed.then(|| of.iter().fold(0.0, |a, b| a + b));
    (stats.volume_before, stats.volume_after) = (sum(&before), sum(&after));
    Ok((surface, (net.offsets, net.triangles, stats)))
}

/// Where a vertex may go.
fn region(surface: &Surface, vertex: usize, params: &Params) -> Region {
    // One in the middle of a face or cell has no axis of its own, and is not thin.
    let axis = axis_of(surface.places[vertex]) % 3;
    let links = surface.links[vertex];
    let mut fixed = [false; 3];
    let mut reach = 0.5 * params.scale * (1.0 - STRICT);
    if surface.is_on_edge(vertex) {
        // Where a curve ends the surface does, in the plane across it.
        for slot in 0..4 {
            fixed[(axis + 1 + slot / 2) % 3] |= links[slot] == NONE;
        }
    } else if params.constraint == Constraint::CellEdge {
        reach = 0.0;
    }
    let mut inward = f64::INFINITY;
    if surface.thin[vertex] {
        match (params.thin, params.energy) {
            (Thin::Off, _) => {}
            (Thin::Keep, _) => reach = 0.0,
            (Thin::Guard, Energy::Laplacian) => reach *= 0.5,
            // What is enclosed is held, for which vertices go outwards.
            (Thin::Guard, Energy::Bilaplacian) => inward = 0.5 * reach,
        }
    }
    Region {
        constraint: params.constraint,
        reach,
        axis,
        outward: if surface.lower_inside[vertex] {
            1.0
        } else {
            -1.0
        },
        inward,
        fixed,
    }
}

fn stats(
    surface: &Surface,
    params: &Params,
    outcome: &Outcome,
    offsets: &[Vec3],
    parts: &Parts,
    [before, after]: [&Vec<f64>; 2],
    [turning_before_deg, turning_after_deg]: [Option<f64>; 2],
) -> Stats {
    let n = surface.len() as u64;
    let mut listed: Vec<Component> = (0..parts.len())
        .map(|part| Component {
            vertices: parts.sizes[part],
            voxels: parts.voxels[part],
            volume_before: before[part],
            volume_after: after[part],
        })
        .collect();
    let all = listed.clone();
    if !surface.sides.is_empty() {
        // What is outside of all labels is none.
        listed.remove(0);
    }
    listed.sort_by_key(|c| std::cmp::Reverse(c.vertices));
    let count = listed.len() as u64;
    let vanishing = listed
        .iter()
        .filter(|c| c.voxels.is_some() && c.volume_after.abs() < 0.1 * c.volume_before.abs())
        .count();
    listed.truncate(LISTED);
    let labels = usize::from(!surface.sides.is_empty());
    let closed = parts.voxels[labels.min(parts.len())..]
        .iter()
        .all(Option::is_some);
    let sum =
        |of: &[f64]| closed.then(|| of[labels.min(of.len())..].iter().fold(0.0, |a, b| a + b));
    let way = |v: &Vec3| match params.constraint {
        Constraint::CellSize | Constraint::CellCenter => {
            v.iter().fold(0.0, |m: f64, c| m.max(c.abs()))
        }
        _ => v.iter().map(|c| c.abs()).sum(),
    };
    Stats {
        iterations: outcome.iterations,
        stop_reason: outcome.stop,
        max_step_last: outcome.last_step,
        awake_share: outcome.updates as f64 / (n * u64::from(outcome.iterations)).max(1) as f64,
        boundary_vertices: surface.ends() as u64,
        thin_vertices: surface.thin.iter().filter(|t| **t).count() as u64,
        max_displacement: offsets.par_iter().map(way).reduce(|| 0.0, f64::max),
        components: count,
        largest: listed,
        vanishing: vanishing as u64,
        turning_before_deg,
        turning_after_deg,
        parts: all,
        voxels: closed.then(|| parts.voxels.iter().flatten().sum()),
        volume_before: sum(before),
        volume_after: sum(after),
    }
}
