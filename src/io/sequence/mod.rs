//! Animations as sequences: a mesh file for each frame.

mod find;
mod write;

pub use find::{find, is_sequence};
pub use write::{places, write};

use super::format::Format;
use super::read_mesh;
use super::refusal::RAISE;
use super::source::Source;
use crate::anim::Clip;
use crate::error::{Error, Fault, Result};
use crate::mesh::{Mesh, Polygons};
use crate::numeric::vector::Vec3;
use crate::report::{Input, Warning};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Files that are read at a time.
const TASK: usize = 16;

/// Reads mesh files as the frames of a clip, in the order given, with `rate` frames per second from
/// time 0 on.
///
/// The mesh of the clip is the first file's; of the others only the positions are kept. Returns a line
/// for the report for each file too, and the warnings of all: each code once, with the counts added up
/// and as its first the number of a frame.
///
/// # Errors
///
/// What reading a file errs with. A file with another number of vertices than the first, or with
/// other faces, polylines or points, is named with the first that differs. A sequence that takes more
/// than `limit` bytes is refused before it is read.
///
/// # Cost
///
/// Linear in the bytes, several files at a time; 24 bytes of memory a position.
pub fn read(
    paths: &[PathBuf],
    format: Option<Format>,
    rate: f64,
    limit: u64,
) -> Result<(Clip, Vec<Input>, Vec<Warning>)> {
    let Some((first, others)) = paths.split_first() else {
        return Err(Error::Geometry(Fault::whole("a sequence of no files")));
    };
    let open = |path: &PathBuf| {
        let source = Source::open(&path.to_string_lossy(), limit)?;
        read_mesh(&source, format)
    };
    let (mesh, input, warnings) = open(first)?;
    let (vertices, frames) = (mesh.positions.len(), paths.len());
    let needed = vertices as u128 * frames as u128 * size_of::<Vec3>() as u128;
    if needed > u128::from(limit) {
        let what = format!("an animation of {frames} frames of {vertices} vertices");
        return Err(Error::over_memory(what, needed, limit, Some(RAISE)));
    }
    let mut positions = Vec::with_capacity(vertices * frames);
    positions.extend_from_slice(&mesh.positions);
    let mut inputs = vec![input];
    let mut all = Gathered::default();
    all.add(0, warnings);
    for (task, paths) in others.chunks(TASK).enumerate() {
        let read: Vec<_> = paths.par_iter().map(open).collect();
        for (i, (path, read)) in paths.iter().zip(read).enumerate() {
            let frame = 1 + task * TASK + i;
            let (other, input, warnings) = read?;
            expect_same(&mesh, &other, frame, first).map_err(|fault| Error::Malformed {
                path: path.clone(),
                fault,
            })?;
            positions.extend_from_slice(&other.positions);
            inputs.push(input);
            all.add(frame, warnings);
        }
    }
    let clip = Clip {
        mesh,
        positions,
        start: 0.0,
        rate,
    };
    clip.check().map_err(|fault| Error::Malformed {
        path: first.clone(),
        fault,
    })?;
    Ok((clip, inputs, all.warnings))
}

/// The warnings of all frames, each code once.
#[derive(Default)]
struct Gathered {
    warnings: Vec<Warning>,
}

impl Gathered {
    fn add(&mut self, frame: usize, warnings: Vec<Warning>) {
        for warning in warnings {
            match self.warnings.iter_mut().find(|w| w.code == warning.code) {
                Some(known) => known.count += warning.count,
                None => self.warnings.push(Warning {
                    message: format!("in all frames together: {}", warning.message),
                    first: Some(frame as u64),
                    ..warning
                }),
            }
        }
    }
}

/// Errs where a mesh is not the first one with its vertices elsewhere.
fn expect_same(a: &Mesh, b: &Mesh, frame: usize, first: &Path) -> Result<(), Fault> {
    let first = format!("frame 0 ({})", first.display());
    let [here, there] = [b.positions.len(), a.positions.len()];
    if here != there {
        let problem = format!("{here} vertices, but {first} has {there}");
        return Err(Fault::whole(problem));
    }
    let [here, there] = [b.face_count(), a.face_count()];
    if here != there {
        let problem = format!("{here} faces, but {first} has {there}");
        return Err(Fault::whole(problem));
    }
    if let Some((f, here, there)) = differing_face(a, b) {
        let [here, there] = [here, there].map(|face| listed(&face));
        let problem = format!("has corners {here} in frame {frame}, but {there} in {first}");
        return Err(Fault::element("face", f, problem));
    }
    if a.segments != b.segments || a.points != b.points {
        let problem = format!("frame {frame} has other polylines or points than {first}");
        return Err(Fault::whole(problem));
    }
    Ok(())
}

/// The first face whose corners differ, and both lists of them. The meshes have as many faces.
fn differing_face(a: &Mesh, b: &Mesh) -> Option<(usize, Vec<u32>, Vec<u32>)> {
    if a.polygons.is_none() && b.polygons.is_none() {
        let mut pairs = a.triangles.iter().zip(&b.triangles);
        let f = pairs.position(|(a, b)| a != b)?;
        return Some((f, b.triangles[f].to_vec(), a.triangles[f].to_vec()));
    }
    let mut pairs = faces(a).zip(faces(b)).enumerate();
    pairs.find_map(|(f, (a, b))| (a != b).then(|| (f, b.to_vec(), a.to_vec())))
}

/// The faces as stored.
fn faces(mesh: &Mesh) -> Box<dyn Iterator<Item = &[u32]> + '_> {
    match &mesh.polygons {
        Some(polygons) => Box::new(Polygons::iter(polygons)),
        None => Box::new(mesh.triangles.iter().map(<[u32; 3]>::as_slice)),
    }
}

/// The first few corners of a face.
fn listed(corners: &[u32]) -> String {
    const SHOWN: usize = 8;
    let shown: Vec<String> = corners.iter().take(SHOWN).map(u32::to_string).collect();
    let more = if corners.len() > SHOWN { ", ..." } else { "" };
    shown.join(", ") + more
}

#[cfg(test)]
mod tests;
