//! What keeps every vertex of every frame within a bound: the few that are farther are moved back.

use super::coder::{Coder, Reader, Writer};
use super::container::take_f64;
use super::integers::{CLASSES, Context, Integers, class_of};
use crate::error::Fault;
use crate::numeric::vector::Vec3;

/// Corrections of a window, frame after frame.
#[derive(Debug, Clone)]
pub struct Corrections {
    step: f64,
    /// Whether a vertex has a correction: by those of its index before it and in the frame before.
    flags: Integers<2>,
    numbers: Integers<2>,
    before: Vec<bool>,
}

impl Corrections {
    /// For so many vertices, with a step.
    fn new(vertices: usize, step: f64) -> Self {
        Corrections {
            step,
            flags: Integers::new([16, 4], 1),
            numbers: Integers::new([3, CLASSES], 1),
            before: vec![false; vertices],
        }
    }

    /// The step with which a correction ends within the bound: half of a cube's diagonal is below it by
    /// what rounding of coordinates may take.
    fn step_for(bound: f64) -> f64 {
        2.0 * bound * (1.0 - 1e-6) / 3f64.sqrt()
    }

    /// Codes one frame; `decoded` is moved, where the stream says so, by what `given` asks for.
    fn frame(
        &mut self,
        coder: &mut impl Coder,
        decoded: &mut [Vec3],
        given: Option<(&[Vec3], f64)>,
    ) -> u64 {
        let (mut last, mut count) = (0usize, 0);
        for (v, place) in decoded.iter_mut().enumerate() {
            let apart: Option<Vec3> = given.and_then(|(given, bound)| {
                let apart: Vec3 = std::array::from_fn(|i| given[v][i] - place[i]);
                let length = apart.iter().map(|x| x * x).sum::<f64>().sqrt();
                (length > bound).then_some(apart)
            });
            let next = self.before.get(v + 1).copied().unwrap_or(false);
            let context = Context {
                cells: [
                    last & 3 | usize::from(self.before[v]) << 2 | usize::from(next) << 3,
                    (last & 0xff).count_ones().min(3) as usize,
                ],
                set: 0,
            };
            let moved = self.flags.code(coder, &context, i32::from(apart.is_some())) != 0;
            last = last << 1 | usize::from(moved);
            self.before[v] = moved;
            if !moved {
                continue;
            }
            count += 1;
            let mut size = 0.0f32;
            for axis in 0..3 {
                let wanted = apart.map_or(0.0, |apart| (apart[axis] / self.step).round());
                let context = Context {
                    cells: [axis, class_of(size)],
                    set: 0,
                };
                let number = self.numbers.code(coder, &context, wanted as i32);
                size += (number as f32).abs();
                place[axis] += f64::from(number) * self.step;
            }
        }
        count
    }
}

/// Corrections as a stream holds them.
#[derive(Debug, Clone)]
pub struct Encoder {
    state: Corrections,
    writer: Writer,
    bound: f64,
    /// Vertices of frames that were moved.
    pub count: u64,
}

impl Encoder {
    /// For so many vertices, none of which may be farther than the bound.
    pub fn new(vertices: usize, bound: f64) -> Self {
        Encoder {
            state: Corrections::new(vertices, Corrections::step_for(bound.min(1e30))),
            writer: Writer::new(),
            bound,
            count: 0,
        }
    }

    /// Takes the next frame and moves what is decoded of it where it has to.
    pub fn frame(&mut self, decoded: &mut [Vec3], given: &[Vec3]) {
        // A little below the bound, so that rounding of coordinates does not pass it.
        let bound = self.bound * (1.0 - 1e-6);
        self.count += self
            .state
            .frame(&mut self.writer, decoded, Some((given, bound)));
    }

    /// Bits spent up to now.
    pub fn spent(&self) -> f64 {
        self.writer.spent()
    }

    /// The payload of the section.
    pub fn finish(self) -> Vec<u8> {
        let mut payload = self.state.step.to_le_bytes().to_vec();
        payload.extend(self.writer.finish());
        payload
    }
}

/// Reads corrections, frame after frame.
#[derive(Debug)]
pub struct Decoder {
    state: Corrections,
    reader: Reader,
}

impl Decoder {
    /// From the payload of the section.
    pub fn new(vertices: usize, mut payload: &[u8]) -> Result<Self, Fault> {
        let step = take_f64(&mut payload).filter(|step| step.is_finite() && *step > 0.0);
        let problem = "the step of its corrections is no number above 0; damaged";
        let step = step.ok_or_else(|| Fault::whole(problem))?;
        Ok(Decoder {
            state: Corrections::new(vertices, step),
            reader: Reader::new(payload),
        })
    }

    /// Moves what is decoded of the next frame.
    pub fn frame(&mut self, decoded: &mut [Vec3]) {
        self.state.frame(&mut self.reader, decoded, None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;

    #[test]
    fn every_vertex_ends_within_the_bound_on_both_sides() {
        let mut rng = Rng::new(4, 0);
        let (vertices, frames, bound) = (500, 6, 0.01);
        let given: Vec<Vec<Vec3>> = (0..frames)
            .map(|_| {
                (0..vertices)
                    .map(|_| std::array::from_fn(|_| rng.unit()))
                    .collect()
            })
            .collect();
        let noise = |rng: &mut Rng| rng.range(-1.0, 1.0).powi(9) * 0.1;
        let near: Vec<Vec<Vec3>> = given
            .iter()
            .map(|frame| {
                let moved = frame.iter().map(|p| p.map(|x| x + noise(&mut rng)));
                moved.collect()
            })
            .collect();
        let mut encoder = Encoder::new(vertices, bound);
        let mut held = near.clone();
        for (held, given) in held.iter_mut().zip(&given) {
            encoder.frame(held, given);
        }
        assert!(
            encoder.count > 100 && encoder.count < 2500,
            "{}",
            encoder.count
        );
        let payload = encoder.finish();
        let mut decoder = Decoder::new(vertices, &payload).unwrap();
        for (f, mut frame) in near.into_iter().enumerate() {
            decoder.frame(&mut frame);
            assert_eq!(frame, held[f]);
            for (p, q) in frame.iter().zip(&given[f]) {
                let apart = (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>().sqrt();
                assert!(apart <= bound, "{apart}");
            }
        }
    }
}
