//! How far one animation is from another, frame by frame.
//!
//! Two errors carry the name of Karni and Gotsman, and papers seldom say which they mean: both are the
//! root of the squared error as a share of that of something simple, in percent. About the centroid:
//! every frame drawn together to its centre ("Compression of soft-body animation sequences", 2004).
//! About the mean: every vertex resting at its mean over time. What is 0 of 0 is 0.

use crate::anim::Clip;
use crate::anim::compress::TRADE;
use crate::error::{Error, Fault, Result};
use crate::numeric::vector::Vec3;
use crate::report::{Accuracy, Measures};
use schemars::JsonSchema;
use serde::Serialize;

/// How far an animation is from another.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct AnimationError {
    /// Root of the squared error, in percent of that of frames drawn together to their centroids;
    /// null where those have no extent and there is an error.
    pub kg_centroid_percent: Option<f64>,
    /// Root of the squared error, in percent of that of vertices resting at their means over time;
    /// null where nothing moves and there is an error.
    pub kg_mean_percent: Option<f64>,
    /// Root of the mean squared distance of a vertex.
    pub rmse: f64,
    /// The vertex that is farthest.
    pub max_error: Farthest,
    /// Every frame.
    pub per_frame: Vec<FrameError>,
}

/// The vertex that is farthest from where it should be.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct Farthest {
    /// How far.
    pub distance: f64,
    /// In percent of the diagonal of the box around the first frame; null where it has none.
    pub percent_of_diagonal: Option<f64>,
    /// The frame, counted from 0.
    pub frame: u64,
    /// The vertex, counted from 0.
    pub vertex: u64,
}

/// How far a frame is from another.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct FrameError {
    /// Root of the sum of the squared distances, as the paper draws it.
    pub l2: f64,
    /// Root of the mean squared distance.
    pub rms: f64,
    /// Largest distance.
    pub max: f64,
}

impl AnimationError {
    /// The measures for a report, against what `reference` says; the first, in percent, is the one
    /// that checks are about.
    pub fn accuracy(&self, reference: &str) -> Measures {
        let measure = |measure: &str, unit: &str, reached| Accuracy {
            measure: measure.to_owned(),
            unit: unit.to_owned(),
            bound: None,
            reached,
            reference: reference.to_owned(),
            verified: true,
        };
        let (first, largest) = (TRADE.error, self.max_error.distance);
        Measures::Many(vec![
            measure(first.name, first.unit, self.kg_centroid_percent),
            measure("error about the means", "percent", self.kg_mean_percent),
            measure("root mean square distance", "file unit", Some(self.rmse)),
            measure("largest distance", "file unit", Some(largest)),
        ])
    }
}

/// Takes the frames of an animation one after the other.
#[derive(Debug)]
pub struct Meter<'a> {
    reference: &'a Clip,
    first: usize,
    frames: Vec<FrameError>,
    squared: f64,
    farthest: Farthest,
}

impl<'a> Meter<'a> {
    /// Measures against a clip, from its frame `first` on.
    pub fn new(reference: &'a Clip, first: usize) -> Self {
        Meter {
            reference,
            first,
            frames: Vec::new(),
            squared: 0.0,
            farthest: Farthest::default(),
        }
    }

    /// The next frame, of as many vertices as the reference has. Cost: linear.
    pub fn frame(&mut self, positions: &[Vec3]) {
        let at = self.first + self.frames.len();
        let (mut squared, mut largest, mut vertex) = (0.0, 0.0f64, 0);
        for (v, (p, q)) in positions.iter().zip(self.reference.frame(at)).enumerate() {
            let apart = (0..3).fold(0.0, |sum, i| sum + (p[i] - q[i]) * (p[i] - q[i]));
            squared += apart;
            if apart > largest {
                (largest, vertex) = (apart, v);
            }
        }
        let max = largest.sqrt();
        if max > self.farthest.distance {
            self.farthest = Farthest {
                distance: max,
                frame: at as u64,
                vertex: vertex as u64,
                ..self.farthest
            };
        }
        self.squared += squared;
        self.frames.push(FrameError {
            l2: squared.sqrt(),
            rms: (squared / positions.len() as f64).sqrt(),
            max,
        });
    }

    /// What came of it. Cost: two passes over the frames of the reference.
    pub fn finish(mut self) -> AnimationError {
        let frames = self.first..self.first + self.frames.len();
        let positions = (self.frames.len() * self.reference.vertices()) as f64;
        let share = |norm: f64| match (self.squared, norm) {
            (0.0, _) => Some(0.0),
            (_, norm) if norm > 0.0 => Some(100.0 * (self.squared / norm).sqrt()),
            _ => None,
        };
        let bounds = crate::spatial::aabb::Aabb::around(self.reference.frame(frames.start));
        let diagonal = (0..3).map(|i| bounds.hi[i] - bounds.lo[i]);
        let diagonal = diagonal.fold(0.0, |sum, side| sum + side * side).sqrt();
        self.farthest.percent_of_diagonal =
            (diagonal > 0.0).then(|| 100.0 * self.farthest.distance / diagonal);
        AnimationError {
            kg_centroid_percent: share(about_centroids(self.reference, frames.clone())),
            kg_mean_percent: share(about_means(self.reference, frames)),
            rmse: (self.squared / positions).sqrt(),
            max_error: self.farthest,
            per_frame: self.frames,
        }
    }
}

/// Sum of the squared distances of vertices to the centroids of their frames.
fn about_centroids(clip: &Clip, frames: std::ops::Range<usize>) -> f64 {
    let of = |f: usize| {
        let frame = clip.frame(f);
        (0..3)
            .map(|i| spread(frame.len(), || frame.iter().map(|p| p[i])))
            .sum::<f64>()
    };
    frames.map(of).sum()
}

/// Sum of the squared distances of vertices to their means over time.
fn about_means(clip: &Clip, frames: std::ops::Range<usize>) -> f64 {
    let of = |v: usize| {
        let at = |i: usize| frames.clone().map(move |f| clip.frame(f)[v][i]);
        (0..3).map(|i| spread(frames.len(), || at(i))).sum::<f64>()
    };
    (0..clip.vertices()).map(of).sum()
}

/// Sum of the squared distances of numbers to their mean.
fn spread<I: Iterator<Item = f64>>(count: usize, numbers: impl Fn() -> I) -> f64 {
    // From the first on, so that far places lose no digits.
    let first = numbers().next().unwrap_or(0.0);
    let mean = numbers().map(|x| x - first).sum::<f64>() / count as f64;
    numbers()
        .map(|x| (x - first - mean) * (x - first - mean))
        .sum()
}

/// How far `other` is from `reference`.
///
/// Errs with [`Error::Geometry`] where they have not as many vertices and frames, with all four
/// numbers. Cost: linear.
pub fn animation_error(reference: &Clip, other: &Clip) -> Result<AnimationError> {
    let counts = |clip: &Clip| [clip.vertices(), clip.frames()];
    let ([v, f], [w, g]) = (counts(reference), counts(other));
    if (v, f) != (w, g) {
        let problem = format!(
            "{v} vertices and {f} frames cannot be compared with {w} vertices and {g} frames"
        );
        return Err(Error::Geometry(Fault::whole(problem)));
    }
    let mut meter = Meter::new(reference, 0);
    (0..f).for_each(|f| meter.frame(other.frame(f)));
    Ok(meter.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clip(positions: Vec<Vec3>, vertices: usize) -> Clip {
        Clip::cloud(vertices, positions, 0.0, 24.0)
    }

    #[test]
    fn errors_are_what_is_worked_out_by_hand() {
        // Two vertices over two frames: about centroids 4 * 1, about means 2 * (1/2 + 1/2).
        let reference = clip(
            vec![
                [-1.0, 0.0, 0.0],
                [1.0, 0.0, 0.0],
                [-1.0, 1.0, 0.0],
                [1.0, 1.0, 0.0],
            ],
            2,
        );
        let mut other = reference.clone();
        other.positions[3][2] = 0.3;
        other.positions[0][2] = 0.4;
        let error = animation_error(&reference, &other).unwrap();
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        near(
            error.kg_centroid_percent.unwrap(),
            100.0 * (0.25f64 / 4.0).sqrt(),
        );
        near(
            error.kg_mean_percent.unwrap(),
            100.0 * (0.25f64 / 1.0).sqrt(),
        );
        near(error.rmse, (0.25f64 / 4.0).sqrt());
        near(error.max_error.distance, 0.4);
        near(error.max_error.percent_of_diagonal.unwrap(), 20.0);
        assert_eq!((error.max_error.frame, error.max_error.vertex), (0, 0));
        near(error.per_frame[1].l2, 0.3);
        near(error.per_frame[1].rms, 0.3 / 2f64.sqrt());
    }

    #[test]
    fn nothing_of_nothing_is_nothing() {
        let still = clip(vec![[2.0; 3]; 6], 3);
        let error = animation_error(&still, &still).unwrap();
        assert_eq!(error.kg_centroid_percent, Some(0.0));
        assert_eq!(error.kg_mean_percent, Some(0.0));
        let mut moved = still.clone();
        moved.positions[0][0] = 3.0;
        let error = animation_error(&still, &moved).unwrap();
        assert_eq!(
            (error.kg_centroid_percent, error.kg_mean_percent),
            (None, None)
        );
        assert!(animation_error(&still, &clip(vec![[2.0; 3]; 6], 2)).is_err());
    }

    #[test]
    fn far_places_change_nothing() {
        let near: Vec<Vec3> = (0..40)
            .map(|i| [(i * i % 7) as f64, (i % 5) as f64, i as f64])
            .collect();
        let (a, mut b) = (clip(near.clone(), 8), clip(near, 8));
        b.positions[13][1] += 0.25;
        let far = |clip: &Clip| {
            let mut clip = clip.clone();
            let moved = |p: &Vec3| p.map(|x| x + 2f64.powi(30));
            clip.positions = clip.positions.iter().map(moved).collect();
            clip.mesh.positions = clip.positions[..8].to_vec();
            clip
        };
        let here = animation_error(&a, &b).unwrap();
        let there = animation_error(&far(&a), &far(&b)).unwrap();
        assert!(
            (here.kg_centroid_percent.unwrap() - there.kg_centroid_percent.unwrap()).abs() < 1e-9
        );
        assert!((here.kg_mean_percent.unwrap() - there.kg_mean_percent.unwrap()).abs() < 1e-9);
    }
}
