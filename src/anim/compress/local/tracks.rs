//! The points that carry the frames of reference, over time, on a lattice.
//!
//! A difference to the point as it was decoded one frame before, in whole steps, is the same as the
//! difference of two points of one lattice; so errors cannot add up, and how a difference is foreseen
//! is free.

use super::predictor::Predictor;
use crate::anim::compress::coder::Coder;
use crate::anim::compress::integers::{CLASSES, Context, Integers, class_of};
use crate::numeric::vector::Vec3;

/// No number of a lattice is larger.
const LARGEST: i32 = 1 << 29;

/// Points at whole numbers of steps from a corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice {
    /// The corner.
    pub lo: Vec3,
    /// The step.
    pub step: f64,
}

impl Lattice {
    /// The numbers of the nearest point.
    pub fn numbers(&self, p: Vec3) -> [i32; 3] {
        std::array::from_fn(|axis| {
            let steps = (p[axis] - self.lo[axis]) / self.step;
            let most = f64::from(LARGEST);
            // A lattice of no extent has one point.
            if steps.is_finite() {
                steps.round().clamp(-most, most) as i32
            } else {
                0
            }
        })
    }

    /// The point of these numbers.
    pub fn point(&self, numbers: [i32; 3]) -> Vec3 {
        std::array::from_fn(|axis| self.lo[axis] + f64::from(numbers[axis]) * self.step)
    }
}

const VIEWS: usize = 4;
/// What a step of a point is foreseen from: its own last two, and the last two of two other points.
const KNOWN: usize = 6;

/// One point while it is followed.
struct Track {
    predictor: Predictor<KNOWN>,
    /// Points that are coded before it and may move alike.
    beside: [Option<usize>; 2],
    /// Mean magnitude of the last misses, for each axis.
    sizes: [f64; 3],
    /// The last miss of each axis.
    last: [f64; 3],
}

/// Codes points over all frames: point `t` of frame `f` is at `f * count + t`; `together` of them
/// belong to one cluster. `given` are the numbers where they are not read.
///
/// Cost: `36` products for each number.
pub fn code(
    coder: &mut impl Coder,
    frames: usize,
    count: usize,
    together: usize,
    given: Option<&[[i32; 3]]>,
) -> Vec<[i32; 3]> {
    let mut all = vec![[0i32; 3]; frames * count];
    first(coder, &mut all[..count], given);
    let mut tracks: Vec<Track> = (0..count)
        .map(|t| Track {
            predictor: Predictor::new([0.5, 0.0, 0.0, 0.0, 0.0, 0.0], 16.0),
            beside: beside(&all[..count], t, together),
            sizes: [16.0; 3],
            last: [16.0; 3],
        })
        .collect();
    let pairs = CLASSES * CLASSES;
    let mut model = Integers::<VIEWS>::new([CLASSES * 3, pairs, pairs, pairs], 3);
    for frame in 1..frames {
        // The mean miss of the points before in this frame.
        let mut here = 16.0;
        for (t, track) in tracks.iter_mut().enumerate() {
            for axis in 0..3 {
                let at = frame * count + t;
                let moved = |t: usize, ago: usize| match frame.checked_sub(ago + 1) {
                    Some(before) => {
                        let before = all[before * count + t][axis];
                        f64::from(all[(frame - ago) * count + t][axis]) - f64::from(before)
                    }
                    None => 0.0,
                };
                let other = |i: usize, ago: usize| track.beside[i].map_or(0.0, |t| moved(t, ago));
                let known = [
                    moved(t, 1),
                    moved(t, 2),
                    other(0, 0),
                    other(0, 1),
                    other(1, 0),
                    other(1, 1),
                ];
                let before = all[at - count][axis];
                let expected = track.predictor.expected(&known).round() as i32;
                let expected = before.saturating_add(expected).clamp(-LARGEST, LARGEST);
                let pair = |x: f64, y: f64| class_of(x) * CLASSES + class_of(y);
                let (size, last) = (track.sizes[axis], track.last[axis]);
                let context = Context {
                    cells: [
                        class_of(size) * 3 + axis,
                        pair(size, here),
                        pair(last, here),
                        pair(size, track.sizes.iter().sum::<f64>() / 3.0),
                    ],
                    set: t % together,
                };
                let miss = given.map_or(0, |given| given[at][axis] - expected);
                let miss = model.code(coder, &context, miss);
                let number = expected.saturating_add(miss).clamp(-LARGEST, LARGEST);
                all[at][axis] = number;
                track
                    .predictor
                    .meet(&known, f64::from(number) - f64::from(before));
                let miss = f64::from(miss.unsigned_abs().min(1 << 20));
                track.last[axis] = miss;
                track.sizes[axis] += (miss - size) * 0.2;
                here += (miss - here) * 0.15;
            }
        }
    }
    all
}

/// The points of the first frame, each by its distance to the one before.
fn first(coder: &mut impl Coder, numbers: &mut [[i32; 3]], given: Option<&[[i32; 3]]>) {
    let mut model = Integers::<1>::new([1], 1);
    let context = Context { cells: [0], set: 0 };
    let mut last = [0; 3];
    for (t, number) in numbers.iter_mut().enumerate() {
        for axis in 0..3 {
            let miss = given.map_or(0, |given| given[t][axis] - last[axis]);
            let miss = model.code(coder, &context, miss);
            last[axis] = last[axis].saturating_add(miss).clamp(-LARGEST, LARGEST);
        }
        *number = last;
    }
}

/// Two points before `t` that may move as it does: those of its own cluster, or else the nearest ones
/// that stand in its place in other clusters.
fn beside(first: &[[i32; 3]], t: usize, together: usize) -> [Option<usize>; 2] {
    let place = t % together;
    let mut near: Vec<usize> = (t - place..t).rev().collect();
    if place < 2 {
        let apart = |u: &usize| -> f64 {
            let (a, b) = (first[*u], first[t]);
            (0..3)
                .map(|axis| (f64::from(a[axis]) - f64::from(b[axis])).powi(2))
                .sum()
        };
        let others: Vec<usize> = (0..t - place).collect();
        let nearest = others
            .into_iter()
            .min_by(|a, b| apart(a).total_cmp(&apart(b)));
        near.extend(nearest);
    }
    [near.first().copied(), near.get(1).copied()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anim::compress::coder::{Reader, Writer};

    #[test]
    fn tracks_come_back_and_smooth_ones_are_short() {
        let (frames, count) = (120, 12);
        let lattice = Lattice {
            lo: [-1.0, 2.0, 5.0],
            step: 1e-4,
        };
        let at = |f: usize, t: usize| -> [f64; 3] {
            let (f, t) = (0.05 * f as f64, t as f64);
            [f.sin() + 0.1 * t, (f + 0.1 * t).cos() + 3.0, 5.0 + 0.3 * f]
        };
        let given: Vec<[i32; 3]> = (0..frames * count)
            .map(|i| lattice.numbers(at(i / count, i % count)))
            .collect();
        let mut writer = Writer::new();
        assert_eq!(code(&mut writer, frames, count, 3, Some(&given)), given);
        let bits = writer.spent() / given.len() as f64 / 3.0;
        assert!(bits < 3.0, "{bits} bits a number");
        let bytes = writer.finish();
        assert_eq!(
            code(&mut Reader::new(&bytes), frames, count, 3, None),
            given
        );
        let p = lattice.point(given[5]);
        assert!((p[0] - at(0, 5)[0]).abs() <= 0.5001e-4);
    }

    #[test]
    fn noise_is_read_without_a_panic() {
        let bytes: Vec<u8> = (0..200u32).map(|i| (i * 7919 % 251) as u8).collect();
        let all = code(&mut Reader::new(&bytes), 40, 9, 3, None);
        assert_eq!(all.len(), 360);
        let still = Lattice {
            lo: [1.0; 3],
            step: 0.0,
        };
        assert_eq!(still.numbers([1.0; 3]), [0; 3]);
    }
}
