//! Writing a clip as a GLB file that browsers play.

use super::write::{Parts, container, invalid, local_origin, single, write_binary};
use crate::anim::Clip;
use crate::mesh::Mesh;
use crate::numeric::vector::{Vec3, sub};
use serde_json::{Value, json};
use std::io::{self, Write};

/// Writes a clip as one node: its first frame as [`super::write`] writes a mesh, a morph target for
/// each further frame, and an animation of their weights.
///
/// At the time of a frame, counted from 0 at the clip's rate, the weight of its own target is 1 and all
/// others are 0, so that frame is shown exactly; between two frames positions go along straight lines.
/// Targets are offsets from the first frame, in single precision: a position comes back to 2^-24 of
/// the larger of its distance from its place in the first frame and the distance of that place from
/// the middle, to which the node is moved where the clip is far from the origin. Normals are written
/// only of a clip of one frame: without them a viewer shades the faces as they move. The time of the
/// first frame is not written; a clip of one frame has no animation.
///
/// Errs for coordinates beyond single precision, named by frame and vertex, and for 4 GiB or more.
/// Browsers hold a target in a layer of a texture: some draw no more than 256.
pub fn write_clip(clip: &Clip, out: &mut dyn Write) -> io::Result<()> {
    let centre = local_origin(&clip.positions, clip.bounds());
    let mut base: Mesh = clip.mesh_at(0);
    if clip.frames() > 1 {
        base.normals = None;
    }
    if base.is_empty() {
        base.points = (0..base.positions.len() as u32).collect();
    }
    let parts = Parts::of(&base, centre)?;
    let mut document = parts.document(centre);
    let written = Written {
        clip,
        centre,
        stored: clip.frame(0).iter().map(|p| single(*p, centre)).collect(),
    };
    let mut length = parts.length;
    if clip.frames() > 1 {
        written.describe(&mut document, &mut length)?;
    }
    container(&document, length, out, |out| {
        write_binary(&base, centre, out)?;
        written.write_targets(out)?;
        written.write_keys(out)
    })
}

/// What is written of a clip.
struct Written<'a> {
    clip: &'a Clip,
    centre: Vec3,
    /// The first frame as it is written.
    stored: Vec<[f32; 3]>,
}

impl Written<'_> {
    /// Morph targets.
    fn targets(&self) -> usize {
        self.clip.frames() - 1
    }

    /// The offsets of the target of frame `f` from what is written of the first.
    fn offsets(&self, f: usize) -> impl Iterator<Item = [f32; 3]> {
        let pairs = self.clip.frame(f).iter().zip(&self.stored);
        pairs.map(|(p, stored)| {
            let wanted = sub(*p, self.centre);
            sub(wanted, stored.map(f64::from)).map(|c| c as f32)
        })
    }

    /// The time of a frame, as it is written.
    fn time(&self, f: usize) -> f32 {
        (f as f64 / self.clip.rate) as f32
    }

    /// Adds targets and animation to the document of the first frame, and their bytes to its length.
    fn describe(&self, document: &mut Value, length: &mut u128) -> io::Result<()> {
        let (frames, targets, vertices) =
            (self.clip.frames(), self.targets(), self.clip.vertices());
        if (1..frames).any(|f| self.time(f) <= self.time(f - 1)) {
            let problem = format!(
                "the times of {frames} frames at {} a second are not apart in single precision",
                self.clip.rate
            );
            return Err(invalid(problem));
        }
        let mut add = |mut accessor: Value, bytes: usize, target: Option<u32>| {
            let mut view =
                json!({ "buffer": 0, "byteOffset": *length as u64, "byteLength": bytes });
            if let Some(target) = target {
                view["target"] = json!(target);
            }
            *length += bytes as u128;
            let view = push(document, "bufferViews", view);
            accessor["bufferView"] = json!(view);
            push(document, "accessors", accessor)
        };
        let mut morphs = Vec::with_capacity(targets);
        for f in 1..frames {
            let [min, max] = self.range(f)?;
            let accessor = json!({
                "componentType": 5126, "count": vertices, "type": "VEC3", "min": min, "max": max,
            });
            let accessor = add(accessor, 12 * vertices, Some(34962));
            morphs.push(json!({ "POSITION": accessor }));
        }
        let end = f64::from(self.time(frames - 1));
        let times = json!({
            "componentType": 5126, "count": frames, "type": "SCALAR", "min": [0.0], "max": [end],
        });
        let times = add(times, 4 * frames, None);
        let count = frames * targets;
        let weights = json!({ "componentType": 5126, "count": count, "type": "SCALAR" });
        let weights = add(weights, 4 * count, None);
        document["animations"] = json!([{
            "name": "frames",
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "weights" } }],
            "samplers": [{ "input": times, "output": weights, "interpolation": "LINEAR" }],
        }]);
        document["meshes"][0]["weights"] = json!(vec![0.0; targets]);
        let primitives = document["meshes"][0]["primitives"].as_array_mut();
        for primitive in primitives.into_iter().flatten() {
            primitive["targets"] = json!(morphs);
        }
        document["buffers"][0]["byteLength"] = json!(*length as u64);
        Ok(())
    }

    /// The smallest and largest offset of a frame along each axis.
    fn range(&self, f: usize) -> io::Result<[[f32; 3]; 2]> {
        let (mut min, mut max) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for (v, offset) in self.offsets(f).enumerate() {
            if !offset.iter().all(|c| c.is_finite()) {
                let [x, y, z] = self.clip.frame(f)[v];
                return Err(invalid(format!(
                    "frame {f}, vertex {v} at ({x}, {y}, {z}) is beyond single precision, which \
                     glTF holds"
                )));
            }
            min = std::array::from_fn(|a| min[a].min(offset[a]));
            max = std::array::from_fn(|a| max[a].max(offset[a]));
        }
        Ok([min, max])
    }

    fn write_targets(&self, out: &mut dyn Write) -> io::Result<()> {
        let mut bytes = Vec::with_capacity(12 * self.clip.vertices());
        for f in 1..self.clip.frames() {
            bytes.clear();
            bytes.extend(self.offsets(f).flatten().flat_map(f32::to_le_bytes));
            out.write_all(&bytes)?;
        }
        Ok(())
    }

    /// The times, and the weights at each: the frame's own target alone.
    fn write_keys(&self, out: &mut dyn Write) -> io::Result<()> {
        if self.targets() == 0 {
            return Ok(());
        }
        for f in 0..self.clip.frames() {
            out.write_all(&self.time(f).to_le_bytes())?;
        }
        let mut weights = vec![0u8; 4 * self.targets()];
        for f in 0..self.clip.frames() {
            weights.fill(0);
            if let Some(own) = f.checked_sub(1) {
                weights[4 * own..][..4].copy_from_slice(&1f32.to_le_bytes());
            }
            out.write_all(&weights)?;
        }
        Ok(())
    }
}

/// Adds an element to a list of the document. Returns its index.
fn push(document: &mut Value, list: &str, element: Value) -> usize {
    match document[list].as_array_mut() {
        Some(all) => {
            all.push(element);
            all.len() - 1
        }
        None => {
            document[list] = json!([element]);
            0
        }
    }
}
