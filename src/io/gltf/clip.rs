//! Reading an animation as a clip.

use super::accessor::Reader;
use super::animation::{self, Moving};
use super::assemble::assemble;
use super::document::{self, Buffers};
use super::pose::{self, Stage};
use super::scene;
use crate::anim::Clip;
use crate::error::Fault;
use crate::io::refusal::{RAISE, Refusal, expect_room};
use crate::io::source::Source;
use crate::numeric::vector::Vec3;
use crate::report::{Tally, Warning};
use rayon::prelude::*;

/// Seconds may miss a whole number of frames by this share of one and still be it: single precision
/// holds no tenths.
const WHOLE: f64 = 1e-3;

/// Reads an animation of the default scene, sampled `fps` times a second from 0 seconds to its end.
///
/// The vertices, faces and their order are those of [`super::read`]. Nodes that move carry their
/// meshes; morph targets are blended by their weights, which are those of the node, or the mesh, where
/// nothing moves them; vertices of a skin follow its joints, by weights that are made to add up to 1.
/// A frame is taken at its time in single precision, in which the file has the times of its keys: a key
/// at a frame's time is met exactly. Where the end falls between two frames there is one more, which
/// shows the end. `animation` names one or is its number; without it the first is taken, and where
/// there are others a warning says so. Normals stay only where nothing moves.
///
/// # Errors
///
/// What [`super::read`] errs with; no animation, or none of that name; a track, skin or morph target
/// whose numbers do not fit; more than the limit of the source.
///
/// # Cost
///
/// Frames times vertices, for each joint and each morph target that a vertex follows; on all threads.
pub fn read_clip(
    source: &Source,
    fps: f64,
    animation: Option<&str>,
    warnings: &mut Vec<Warning>,
) -> Result<Clip, Refusal> {
    let opened = document::open(source.bytes(), warnings)?;
    let moving: Moving = serde_json::from_slice(opened.json)
        .map_err(|e| Fault::whole(format!("its animations, skins or morph targets: {e}")))?;
    let (index, entry) = animation::choose(&moving, animation, warnings)?;
    let document = &opened.document;
    let placed = scene::placed(document)?;
    let buffers = Buffers::new(source, &document.buffers, opened.chunk);
    let mut reader = Reader { document, buffers };
    let mut assembled = assemble(&mut reader, &placed, source.limit())?;
    let mut mesh = std::mem::take(&mut assembled.mesh);
    let targets: Vec<usize> = document
        .nodes
        .iter()
        .map(|node| targets_of(&moving, node.mesh))
        .collect();
    let animation = animation::tracks(&mut reader, index, entry, &targets, warnings)?;

    let limit = source.limit();
    let frames = frames(animation.end(), fps)?;
    let vertices = mesh.positions.len();
    let needed = frames as u128 * vertices as u128 * size_of::<Vec3>() as u128;
    let what = || format!("an animation of {frames} frames of {vertices} vertices");
    expect_room(what, needed, limit, RAISE)?;
    let mut weightless = Tally::default();
    let mut parts = Vec::with_capacity(assembled.parts.len());
    for part in &assembled.parts {
        let place = &placed[part.placed];
        let posed = pose::posed(&mut reader, &moving, place, part, limit, &mut weightless)?;
        parts.push(posed);
    }
    assembled.warn_posed(warnings);
    pose::warn_weightless(weightless, warnings);

    let stage = Stage::of(document)?;
    let mut positions = vec![[0.0; 3]; frames as usize * vertices];
    positions
        .par_chunks_mut(vertices.max(1))
        .enumerate()
        .for_each(|(f, positions)| {
            let time = f64::from((f as f64 / fps) as f32);
            let places = stage.places(&animation, time);
            for part in &parts {
                let into = &mut positions[part.base..part.base + part.len()];
                part.pose(&animation, &places, time, into);
            }
        });
    let first = positions.get(..vertices).unwrap_or_default();
    mesh.normals = mesh.normals.filter(|_| mesh.positions == first);
    mesh.positions = first.to_vec();
    Ok(Clip {
        mesh,
        positions,
        start: 0.0,
        rate: fps,
    })
}

/// Morph targets of a mesh: those of its first primitive, as all have as many.
fn targets_of(moving: &Moving, mesh: Option<usize>) -> usize {
    let mesh = mesh.and_then(|mesh| moving.meshes.get(mesh));
    let primitive = mesh.and_then(|mesh| mesh.primitives.first());
    primitive.map_or(0, |primitive| primitive.targets.len())
}

/// Frames from 0 to the end, both counted.
fn frames(end: f64, fps: f64) -> Result<u64, Fault> {
    let steps = end * fps;
    if !(steps.is_finite() && fps > 0.0) {
        let problem = format!("{end} seconds at {fps} frames per second cannot be sampled");
        return Err(Fault::whole(problem));
    }
    let slack = WHOLE.max(f64::from(f32::EPSILON) * steps);
    Ok(((steps - slack).ceil().max(0.0) as u64).saturating_add(1))
}

#[cfg(test)]
mod tests {
    use super::frames;

    #[test]
    fn the_end_is_a_frame() {
        let of = |end, fps| frames(end, fps).expect("a number");
        assert_eq!(of(0.0, 24.0), 1);
        assert_eq!(of(1.0, 24.0), 25);
        assert_eq!(of(f64::from(0.7f32), 10.0), 8);
        assert_eq!(of(f64::from(47.0f32 / 24.0), 24.0), 48);
        assert_eq!(of(0.75, 10.0), 9);
        assert!(frames(1.0, 0.0).is_err() && frames(1.0, f64::NAN).is_err());
        assert!(frames(f64::MAX, 1e10).is_err());
    }
}
