//! What of a mesh, a molecule or an animation a format leaves out.

use super::format::Format;
use super::{cloud, las, pdb, pointcache};
use crate::anim::Clip;
use crate::error::number;
use crate::mesh::{Mesh, Polygons};
use crate::points::Splats;
use crate::protein::Molecule;
use crate::report::Warning;
use crate::terrain::Grid;

/// What of a molecule a format leaves out.
pub fn dropped_of_molecule(molecule: &Molecule, format: Format) -> Vec<Warning> {
    let mut lost = Vec::new();
    let mut note = |code: &str, message: String, count: u64| {
        if count > 0 {
            lost.push(Warning::new(code, message, count, None));
        }
    };
    match format {
        Format::Pdb => {
            let [places, radii] = pdb::rounded(molecule);
            let message = "pdb files hold coordinates to 0.001; rounded".to_owned();
            note("rounded-coordinates", message, places);
            let message = "pdb files hold radii to 0.01; rounded".to_owned();
            note("rounded-radii", message, radii);
        }
        Format::Xyzr | Format::SpheresCsv => {
            let name = format.name();
            let models = molecule.models.len().saturating_sub(1) as u64;
            note(
                "dropped-models",
                format!("{name} files hold one model; left out"),
                models,
            );
            let first = molecule
                .models
                .first()
                .map_or(0..0, |model| model.atoms.clone());
            let atoms = molecule.atoms_in(&first);
            let named = atoms.iter().filter(|atom| !atom.name.is_empty()).count() as u64;
            note(
                "dropped-names",
                format!("{name} files hold no names of atoms; left out"),
                named,
            );
            let sized = atoms.iter().filter(|atom| atom.radius.is_none()).count() as u64;
            let message = "atoms have no radius of their own; that of their element is written";
            note("radii-of-elements", message.to_owned(), sized);
        }
        _ => {}
    }
    lost
}

/// What of a terrain a format leaves out.
pub fn dropped_of_terrain(grid: &Grid, format: Format) -> Vec<Warning> {
    let is_lost = format == Format::AsciiGrid && grid.crs.is_some();
    let message = format!(
        "{} files hold no coordinate reference system; left out",
        format.name()
    );
    let lost = is_lost.then(|| Warning::new("dropped-crs", message, 1, None));
    lost.into_iter().collect()
}

/// What of an animation a format leaves out.
pub fn dropped_of_clip(clip: &Clip, format: Format) -> Vec<Warning> {
    let (name, mesh) = (format.name(), &clip.mesh);
    let is_cache = format != Format::Glb;
    let normals = mesh
        .normals
        .as_ref()
        .filter(|_| is_cache || clip.frames() > 1);
    let of_caches = |count: usize| if is_cache { count } else { 0 };
    let parts = [
        ("dropped-faces", "faces", of_caches(mesh.face_count())),
        (
            "dropped-segments",
            "polylines",
            of_caches(mesh.segments.len()),
        ),
        (
            "dropped-normals",
            "normals of moving vertices",
            normals.map_or(0, Vec::len),
        ),
        (
            "dropped-colours",
            "vertex colours",
            of_caches(mesh.colors.as_ref().map_or(0, Vec::len)),
        ),
        (
            "split-polygons",
            "faces of more than three corners",
            mesh.polygons
                .as_ref()
                .filter(|_| !is_cache)
                .map_or(0, Polygons::len),
        ),
    ];
    let parts = parts.into_iter().filter(|(_, _, count)| *count > 0);
    let mut lost: Vec<Warning> = parts
        .map(|(code, what, count)| {
            let message = format!("{name} files hold no {what}; left out");
            Warning::new(code, message, count as u64, None)
        })
        .collect();
    if is_cache && let (count @ 1.., first) = pointcache::rounded(clip) {
        let message = format!("positions that {name} files, in single precision, round");
        lost.push(Warning::new("rounded-coordinates", message, count, first));
    }
    lost
}

/// What of splats a format leaves out.
pub fn dropped_of_splats(splats: &Splats, format: Format) -> Vec<Warning> {
    let mut lost = Vec::new();
    if format == Format::Gaussians {
        let count = splats.splats.len() as u64;
        let message =
            "gaussians files hold single precision, and no field of normals, counts or sources";
        lost.push(Warning::new("dropped-fields", message, count, None));
        let classes = splats.classes.as_ref().map_or(0, Vec::len) as u64;
        if classes > 0 {
            let message = "gaussians files hold no classes; left out";
            lost.push(Warning::new("dropped-classes", message, classes, None));
        }
    }
    lost
}

/// What of a mesh a format leaves out.
pub fn dropped(mesh: &Mesh, format: Format) -> Vec<Warning> {
    let mut lost = Vec::new();
    let mut note = |code: &str, what: &str, count: usize| {
        if count > 0 {
            lost.push(Warning::new(
                code,
                format!("{} files hold no {what}; left out", format.name()),
                count as u64,
                None,
            ));
        }
    };
    let holds = format.holds();
    if !holds.normals {
        note(
            "dropped-normals",
            "vertex normals",
            mesh.normals.as_ref().map_or(0, Vec::len),
        );
    }
    if !holds.colors {
        note(
            "dropped-colours",
            "vertex colours",
            mesh.colors.as_ref().map_or(0, Vec::len),
        );
    }
    if !holds.classes {
        note(
            "dropped-classes",
            "classes of vertices",
            mesh.classes.as_ref().map_or(0, Vec::len),
        );
    }
    if !holds.faces {
        note("dropped-faces", "faces", mesh.face_count());
        return lost_of_cloud(mesh, format, lost);
    }
    if format != Format::Ply {
        note(
            "dropped-labels",
            "labels of faces",
            mesh.sides.as_ref().map_or(0, Vec::len),
        );
    }
    if !holds.segments {
        note("dropped-segments", "polylines", mesh.segments.len());
    }
    // A cloud needs no word of its own where vertices may stand without faces.
    let holds_points = holds.points || (format == Format::Off && mesh.is_cloud());
    if !holds_points {
        note("dropped-points", "points", mesh.points.len());
    }
    if !holds.polygons {
        note(
            "split-polygons",
            "faces of more than three corners",
            mesh.polygons.as_ref().map_or(0, Polygons::len),
        );
    }
    lost
}

/// What else a format leaves out that holds all vertices and nothing but them.
fn lost_of_cloud(mesh: &Mesh, format: Format, mut lost: Vec<Warning>) -> Vec<Warning> {
    let name = format.name();
    let mut note = |code: &str, message: String, count: u64, first: Option<u64>| {
        if count > 0 {
            lost.push(Warning::new(code, message, count, first));
        }
    };
    let message = format!("{name} files hold no polylines; left out");
    note(
        "dropped-segments",
        message,
        mesh.segments.len() as u64,
        None,
    );
    let is_las = matches!(format, Format::Las | Format::Laz);
    if is_las {
        let (count, first, step) = las::rounded(mesh);
        let step = number(step);
        let message =
            format!("coordinates that are no multiple of the step of up to {step} are rounded");
        note("rounded-coordinates", message, count, first);
    } else {
        let (count, first) = cloud::rounded_colors(mesh);
        let message = format!("{name} files hold colours in bytes; rounded");
        note("rounded-colours", message, count, first);
    }
    if is_las || format == Format::Xyz {
        let colors = mesh.colors.iter().flatten();
        let count = colors.filter(|color| color[3] != 1.0).count() as u64;
        let message = format!("{name} files hold no opacity; left out");
        note("dropped-opacity", message, count, None);
    }
    lost
}
