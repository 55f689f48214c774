//! Animation as one frame after the other: each vertex goes on from where the last frame left it, as
//! the vertices around it do.
//!
//! It asks nothing of the motion, so it is the floor that every other method has to be below. What is
//! told of a frame is the change since the last one as a decoder has it, so no error grows. Source:
//! J. Yang, C. Kim and S. Lee, "Compression of 3-D triangle mesh sequences based on vertex-wise motion
//! vector prediction" (2002), with weights that follow the shape.

use super::coder::{Coder, Reader, Writer};
use super::container::{push_number, take_f64, take_number};
use super::field::{self, Fields, Wanted};
use super::hierarchy::Hierarchy;
use super::prediction::Weights;
use super::spectrum::Trajectories;
use crate::error::Fault;
use crate::numeric::vector::Vec3;

/// Squared steps that a bit outweighs.
const PRICE: f64 = 0.08;
/// How much more affine motion is expected than any other.
const AFFINE: f64 = 100.0;
/// Bytes of a part, before it ends.
const PART: f64 = 4096.0;

/// A window as a stream holds it.
#[derive(Debug, Clone, Default)]
pub struct Encoded {
    /// The payload of its first section: the first frame.
    pub window: Vec<u8>,
    /// The payloads of its parts: frames in their order.
    pub parts: Vec<Vec<u8>>,
    /// The squared error, in local units.
    pub squared_error: f64,
    /// Bits of the first frame.
    pub shape_bits: f64,
    /// Bits of the others.
    pub motion_bits: f64,
}

/// Frames while they are coded.
struct State<'a> {
    hierarchy: &'a Hierarchy,
    weights: Weights,
    fields: Fields,
    step: f64,
    /// The last frame: x, y and z by rank.
    last: [Vec<f64>; 3],
}

fn by_rank(trajectories: &Trajectories, hierarchy: &Hierarchy, frame: usize) -> [Vec<f64>; 3] {
    std::array::from_fn(|axis| {
        let at = |v: &u32| trajectories.at(frame, *v as usize, axis);
        hierarchy.vertices.iter().map(at).collect()
    })
}

impl<'a> State<'a> {
    /// Codes the first frame.
    fn new(
        coder: &mut impl Coder,
        hierarchy: &'a Hierarchy,
        step: f64,
        given: Option<&[Vec<f64>; 3]>,
    ) -> Self {
        let given = given.map(|given| [0, 1, 2].map(|axis| given[axis].as_slice()));
        let last = field::shape(coder, hierarchy, given, step, PRICE);
        let mut state = State {
            hierarchy,
            weights: Weights::even(hierarchy),
            fields: Fields::new(hierarchy),
            step,
            last,
        };
        let [x, y, z] = &state.last;
        let places = x.iter().zip(y).zip(z).flat_map(|((x, y), z)| [*x, *y, *z]);
        let places: Vec<f64> = places.collect();
        state.weights = Weights::new(hierarchy, &places, 3, AFFINE);
        state
    }

    /// Codes the next frame.
    fn frame(&mut self, coder: &mut impl Coder, given: Option<&[Vec<f64>; 3]>) {
        for axis in 0..3 {
            let last = &self.last[axis];
            let change: Option<Vec<f64>> = given.map(|given| {
                given[axis]
                    .iter()
                    .zip(last)
                    .map(|(now, last)| now - last)
                    .collect()
            });
            let wanted = Wanted {
                values: change.as_deref(),
                step: self.step,
                price: PRICE,
            };
            let held = self
                .fields
                .code(coder, self.hierarchy, &self.weights, &wanted);
            for (last, change) in self.last[axis].iter_mut().zip(held) {
                *last += change;
            }
        }
    }

    /// The squared distance of the last frame from the given one.
    fn error(&self, given: &[Vec<f64>; 3]) -> f64 {
        let axes = self.last.iter().zip(given);
        axes.flat_map(|(held, given)| held.iter().zip(given))
            .map(|(held, given)| (held - given) * (held - given))
            .sum()
    }

    /// The last frame in the order of the vertices.
    fn positions(&self) -> Vec<Vec3> {
        let mut out = vec![[0.0; 3]; self.hierarchy.len()];
        for (rank, v) in self.hierarchy.vertices.iter().enumerate() {
            out[*v as usize] = std::array::from_fn(|axis| self.last[axis][rank]);
        }
        out
    }
}

/// Codes the first `frames` frames of a window with a step, in local units.
///
/// Cost: one pass over the vertices for each frame.
pub fn encode(
    trajectories: &Trajectories,
    hierarchy: &Hierarchy,
    step: f64,
    frames: usize,
) -> Encoded {
    let mut made = Encoded::default();
    let mut writer = Writer::new();
    let first = by_rank(trajectories, hierarchy, 0);
    let mut state = State::new(&mut writer, hierarchy, step, Some(&first));
    made.squared_error += state.error(&first);
    made.shape_bits = writer.spent();
    made.window.extend_from_slice(&step.to_le_bytes());
    made.window.extend(writer.finish());
    let (mut part, mut count) = (Writer::new(), 0);
    for frame in 1..frames {
        let given = by_rank(trajectories, hierarchy, frame);
        state.frame(&mut part, Some(&given));
        made.squared_error += state.error(&given);
        count += 1;
        if part.spent() >= 8.0 * PART || frame + 1 == frames {
            made.motion_bits += part.spent();
            let mut payload = Vec::new();
            push_number(&mut payload, count);
            payload.extend(std::mem::take(&mut part).finish());
            made.parts.push(payload);
            count = 0;
        }
    }
    made
}

/// Reads the frames of a window, as far as there are parts, in local coordinates; a window that is cut
/// off stands still from there on.
pub fn decode(
    hierarchy: &Hierarchy,
    frames: usize,
    mut window: &[u8],
    parts: &[&[u8]],
) -> Result<Vec<Vec<Vec3>>, Fault> {
    let step = take_f64(&mut window).filter(|step| step.is_finite() && *step > 0.0);
    let step = step.ok_or_else(|| Fault::whole("a window's step is no number above 0; damaged"))?;
    let mut reader = Reader::new(window);
    let mut state = State::new(&mut reader, hierarchy, step, None);
    reader.check()?;
    let mut made = vec![state.positions()];
    for mut part in parts.iter().copied() {
        let left = frames - made.len();
        let count = take_number(&mut part).and_then(|count| usize::try_from(count).ok());
        let Some(count) = count.filter(|count| *count <= left) else {
            return Err(Fault::whole(
                "a window's part has more frames than are left; damaged",
            ));
        };
        let mut reader = Reader::new(part);
        for _ in 0..count {
            state.frame(&mut reader, None);
            made.push(state.positions());
        }
        reader.check()?;
    }
    let last = state.positions();
    made.resize(frames, last);
    Ok(made)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn frames_come_back_with_no_growing_error() {
        let mesh = shapes::icosphere([0.0; 3], 1.0, 3);
        let edges = mesh
            .triangles
            .iter()
            .flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
        let vertices = mesh.positions.len();
        let hierarchy = Hierarchy::new(vertices, edges).unwrap();
        let frames = 40;
        let positions: Vec<Vec3> = (0..frames)
            .flat_map(|f| {
                let t = f as f64 * 0.2;
                mesh.positions
                    .iter()
                    .map(move |p| [p[0] + t.sin(), p[1] * (1.0 + 0.3 * t.cos()), p[2]])
            })
            .collect();
        let trajectories = Trajectories {
            positions: &positions,
            vertices,
            origin: [0.0; 3],
            scale: 1.0,
        };
        let step = 1e-3;
        let made = encode(&trajectories, &hierarchy, step, frames);
        let parts: Vec<&[u8]> = made.parts.iter().map(Vec::as_slice).collect();
        let back = decode(&hierarchy, frames, &made.window, &parts).unwrap();
        let mut total = 0.0;
        for (f, frame) in back.iter().enumerate() {
            let given = &positions[f * vertices..(f + 1) * vertices];
            let error: f64 = frame
                .iter()
                .zip(given)
                .map(|(a, b)| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>())
                .sum();
            // Numbers that are rounded down miss by a step at most.
            assert!(
                (error / (3 * vertices) as f64).sqrt() < 0.6 * step,
                "frame {f}"
            );
            total += error;
        }
        assert!((total / made.squared_error - 1.0).abs() < 1e-9);
        let bits = 8.0 * made.parts.iter().map(Vec::len).sum::<usize>() as f64;
        assert!(bits / ((vertices * (frames - 1)) as f64) < 3.0);
    }
}
