//! What is measured, written and reported of a smooth surface.

use super::input::Piece;
use super::known::Known;
use super::result::{Body, Stats};
use super::select::Inside;
use super::{Args, Asked, beside};
use crate::destination::LABEL;
use crate::job::{Found, Job};
use scantle::error::{Error, Result, number};
use scantle::image::colour::{CLAY, OKABE_ITO};
use scantle::measure::smooth_error::{self, Smoothed, Voxels};
use scantle::mesh::Mesh;
use scantle::render::preview::{self, Panel, What};
use scantle::report::{Measures, Modelled, Warning};
use scantle::volume::isosurface::{self, Select, Surface};
use scantle::volume::smooth_mc::{self, Made, Params};

/// Measures what was made, writes and reports it.
pub fn finish(
    job: &mut Job,
    piece: Piece,
    (offsets, triangles, smoothing): Made,
    params: &Params,
    args: &Args,
    known: &Known,
) -> Result<Found<Asked, Stats>> {
    let memory = known.memory;
    job.warn(thin_warning(&smoothing));
    let smoothed = Smoothed {
        surface: &piece.surface,
        spacing: piece.frame.spacing(),
        offsets: &offsets,
        triangles: &triangles,
    };
    let verified = args
        .verify
        .verify
        .then(|| {
            let voxels = piece.voxels(args.border);
            smooth_error::measure(&smoothed, voxels, memory, job.progress())
        })
        .transpose()?;
    let compared = beside::compare(job, &piece, &smoothed, params, args, memory)?;
    let bodies = bodies(job, &piece, &smoothed, &smoothing, args, known)?;
    let mirrored = piece.frame.is_mirrored();
    let positions = piece.positions(&offsets);
    let mut mesh = match &piece.mesh {
        Some((mesh, lattice)) => Mesh {
            triangles: turned(&mesh.triangles, lattice.inverted),
            colors: mesh.colors.clone(),
            ..Mesh::from_triangles(positions, Vec::new())
        },
        None => Mesh::from_triangles(positions, turned(&triangles, mirrored)),
    };
    if let Inside::Labels(values) = &piece.inside {
        let name = |side: u16| match usize::from(side) {
            0 => 0,
            i => values[i - 1] as i32,
        };
        let of = |t: &[u32; 3]| piece.surface.sides_of(t).unwrap_or_default().map(name);
        mesh.sides = Some(triangles.iter().map(of).collect());
    }
    if job.is_pattern(LABEL) {
        for (i, body) in bodies.iter().enumerate() {
            let own = piece.surface.triangles_around(i as u16 + 1, &triangles);
            let own = Mesh::from_triangles(mesh.positions.clone(), turned(&own, mirrored));
            job.write_each(LABEL, &number(body.label), &own.compacted())?;
        }
    } else {
        job.write_mesh(&mesh)?;
    }
    let turned_by = known.directions(&piece, &mesh)?;
    let stats = Stats::new(&piece, smoothing, &offsets, triangles.len())
        .with(bodies, verified, compared, turned_by);
    let summary = stats.summary();
    let accuracy = stats.accuracy(params);
    let wrong = stats.wrong(params);
    job.write_preview(|_| picture(&piece, &mesh, &stats));
    let made = modelled(&piece.surface, piece.frame.dims);
    let asked = Asked {
        inside: piece.inside,
        border: args.border,
        reference: args.reference.clone(),
        params: *params,
    };
    Ok(Found::new(asked, stats, summary)
        .accuracy(Measures::Many(accuracy))
        .modelled(made)
        .check("max-error", args.max_error.max_error)
        .beyond_measure(wrong))
}

/// The bodies, where there are several.
fn bodies(
    job: &mut Job,
    piece: &Piece,
    smoothed: &Smoothed,
    smoothing: &smooth_mc::Stats,
    args: &Args,
    known: &Known,
) -> Result<Vec<Body>> {
    let (Inside::Labels(values), Some(volume)) = (&piece.inside, &piece.volume) else {
        return Ok(Vec::new());
    };
    let names = &known.names;
    let mut bodies = Vec::with_capacity(values.len());
    for (i, value) in values.iter().enumerate() {
        let own = piece
            .surface
            .triangles_around(i as u16 + 1, smoothed.triangles);
        let mut misclassified_voxels = None;
        if args.verify.verify {
            let bits = isosurface::inside(volume, &Select::Equal(*value));
            let around = Smoothed {
                triangles: &own,
                ..*smoothed
            };
            let voxels = Voxels::Given(&bits);
            misclassified_voxels = around.misclassified(voxels, known.memory, job.progress())?;
        }
        let part = &smoothing.parts[i + 1];
        let voxels = part.voxels.unwrap_or(0);
        let percent = |volume: f64| 100.0 * volume / voxels as f64;
        bodies.push(Body {
            label: *value,
            name: names.get(&number(*value)).cloned(),
            triangles: own.len() as u64,
            voxels,
            volume_before_percent: percent(part.volume_before),
            volume_percent: percent(part.volume_after),
            misclassified_voxels,
        });
    }
    Ok(bodies)
}

/// Smooths a mesh of which nothing is known but the size of a cell: what is left of the method then is
/// the box around each vertex.
pub fn of_any_mesh(
    job: &mut Job,
    mesh: Mesh,
    params: &Params,
    args: &Args,
) -> Result<Found<Asked, Stats>> {
    let Some(spacing) = args.spacing else {
        let problem = "is needed: the mesh is not one of marching cubes, and shows no grid";
        return Err(Error::parameter("spacing", "DX,DY,DZ", problem));
    };
    let message =
        "the mesh is not one of marching cubes: voxels are not known, and may change sides";
    job.warn(vec![Warning::new("no-lattice", message, 1, None)]);
    let (positions, smoothing) =
        smooth_mc::smooth_in_boxes(&mesh, spacing, params, job.progress())?;
    let smooth = Mesh {
        positions,
        normals: None,
        ..mesh.clone()
    };
    job.write_mesh(&smooth)?;
    let stats = Stats::of_any_mesh(&mesh, spacing, smoothing);
    let summary = stats.summary();
    let accuracy = stats.accuracy(params);
    job.write_preview(|_| side_by_side(&mesh, &smooth, &stats));
    let asked = Asked {
        inside: Inside::Set,
        border: args.border,
        reference: args.reference.clone(),
        params: *params,
    };
    Ok(Found::new(asked, stats, summary)
        .accuracy(Measures::Many(accuracy))
        .check("max-error", args.max_error.max_error))
}

/// Triangles, turned over where that is asked for.
fn turned(triangles: &[[u32; 3]], over: bool) -> Vec<[u32; 3]> {
    let turn = |[a, b, c]: &[u32; 3]| if over { [*a, *c, *b] } else { [*a, *b, *c] };
    triangles.iter().map(turn).collect()
}

fn thin_warning(stats: &smooth_mc::Stats) -> Vec<Warning> {
    let message = "parts keep less than a tenth of their volume; --thin guard holds more";
    if stats.vanishing == 0 {
        return Vec::new();
    }
    vec![Warning::new(
        "vanishing-parts",
        message,
        stats.vanishing,
        None,
    )]
}

/// Says so where there is no surface.
pub fn empty(surface: &Surface) -> Vec<Warning> {
    let message = "the surface is empty: no voxel is inside, or all are and the border is open";
    let warning = || Warning::new("empty-surface", message, 1, None);
    surface.is_empty().then(warning).into_iter().collect()
}

/// Cells that hold the surface, of those of the volume.
pub fn modelled(surface: &Surface, dims: [usize; 3]) -> Modelled {
    let full = dims.iter().map(|n| *n as u64 + 1).product();
    Modelled::new("cells", surface.cells, full, surface.bytes())
}

/// The surface of marching cubes, and beside it the smooth one.
fn picture(piece: &Piece, smooth: &Mesh, stats: &Stats) -> Result<Vec<u8>> {
    let before = Mesh::from_triangles(
        piece.positions(&vec![[0.0; 3]; piece.surface.len()]),
        smooth.triangles.clone(),
    );
    side_by_side(&before, smooth, stats)
}

fn side_by_side(before: &Mesh, smooth: &Mesh, stats: &Stats) -> Result<Vec<u8>> {
    let panels = [
        Panel {
            label: "marching cubes",
            what: What::Mesh(before),
            colour: CLAY,
        },
        Panel {
            label: "smooth",
            what: What::Mesh(smooth),
            colour: OKABE_ITO[2],
        },
    ];
    let params = preview::Params {
        up: preview::Up::Z,
        ..preview::Params::DEFAULT
    };
    preview::side_by_side(&panels, &stats.turned(), "", &params)
}
