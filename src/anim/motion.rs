//! What moves in an animation, and what looks wrong.

use super::Clip;
use crate::numeric::vector::{Vec3, length, sub};
use crate::progress::Progress;
use crate::report::{Tally, Warning};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

/// What moves in an animation.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Motion {
    /// Vertices of every frame.
    pub vertices: u64,
    /// Frames.
    pub frames: u64,
    /// Frames per second.
    pub rate: f64,
    /// Time of the first frame in seconds.
    pub start_s: f64,
    /// Seconds from the first frame to the last.
    pub duration_s: f64,
    /// Vertices that are not at one place in all frames.
    pub moving_vertices: u64,
    /// Frames in which no vertex is elsewhere than in the frame before.
    pub repeated_frames: u64,
    /// The longest way of a vertex from one frame to the next, in the file's unit; null where there is
    /// one frame, or the way is infinite.
    pub longest_step: Option<f64>,
    /// The frame at which that way ends.
    pub longest_step_frame: Option<u64>,
    #[serde(skip)]
    first_repeated: Option<u64>,
}

/// Measures what moves. Cost: two passes over the positions, on all threads.
pub fn motion(clip: &Clip, progress: &dyn Progress) -> Motion {
    let (vertices, frames) = (clip.vertices(), clip.frames());
    progress.stage("motion", 0);
    let steps: Vec<(f64, bool)> = (1..frames)
        .into_par_iter()
        .map(|f| step(clip.frame(f - 1), clip.frame(f)))
        .collect();
    let mut repeated = Tally::default();
    let mut longest: Option<(f64, u64)> = None;
    for (f, (way, repeats)) in (1..).zip(&steps) {
        if *repeats {
            repeated.note(f);
        }
        if longest.is_none_or(|(most, _)| *way > most) {
            longest = Some((*way, f));
        }
    }
    let longest = longest.filter(|(way, _)| way.is_finite());
    let moves = |v: &usize| (1..frames).any(|f| clip.frame(f)[*v] != clip.frame(0)[*v]);
    Motion {
        vertices: vertices as u64,
        frames: frames as u64,
        rate: clip.rate,
        start_s: clip.start,
        duration_s: frames.saturating_sub(1) as f64 / clip.rate,
        moving_vertices: (0..vertices).into_par_iter().filter(moves).count() as u64,
        repeated_frames: repeated.count(),
        longest_step: longest.map(|(way, _)| way),
        longest_step_frame: longest.map(|(_, f)| f),
        first_repeated: repeated.first(),
    }
}

/// The longest way of a vertex between two frames, and whether none moves.
fn step(before: &[Vec3], after: &[Vec3]) -> (f64, bool) {
    let ways = before.iter().zip(after).map(|(a, b)| length(sub(*b, *a)));
    (ways.fold(0.0, f64::max), before == after)
}

impl Motion {
    /// What looks wrong: one frame alone, nothing that moves, frames that repeat the one before.
    pub fn warnings(&self) -> Vec<Warning> {
        let one = |code: &str, message: &str| vec![Warning::new(code, message, 1, None)];
        if self.frames == 1 {
            return one("one-frame", "an animation of one frame");
        }
        if self.moving_vertices == 0 {
            return one("static-animation", "all frames are equal; nothing moves");
        }
        if self.repeated_frames == 0 {
            return Vec::new();
        }
        vec![Warning::new(
            "repeated-frames",
            "frames equal to the frame before",
            self.repeated_frames,
            self.first_repeated,
        )]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;

    fn found(frames: &[[Vec3; 2]]) -> (Motion, Vec<String>) {
        let clip = Clip::cloud(2, frames.concat(), 1.0, 10.0);
        let motion = motion(&clip, &Silent);
        let said = motion.warnings().iter().map(in_words).collect();
        (motion, said)
    }

    fn in_words(warning: &Warning) -> String {
        format!("{} {} {:?}", warning.code, warning.count, warning.first)
    }

    #[test]
    fn steps_and_repeats_are_found() {
        let at = |x: f64| [[0.0; 3], [x, 3.0, 0.0]];
        let (motion, said) = found(&[at(0.0), at(1.0), at(1.0), at(-4.0), at(-4.0)]);
        assert_eq!((motion.frames, motion.moving_vertices), (5, 1));
        assert_eq!(motion.longest_step, Some(5.0));
        assert_eq!(motion.longest_step_frame, Some(3));
        assert_eq!((motion.start_s, motion.duration_s), (1.0, 0.4));
        assert_eq!(said, ["repeated-frames 2 Some(2)"]);
        let (motion, said) = found(&[at(1.0)]);
        assert_eq!((motion.longest_step, motion.duration_s), (None, 0.0));
        assert_eq!(said, ["one-frame 1 None"]);
        assert_eq!(found(&[at(1.0), at(1.0)]).1, ["static-animation 1 None"]);
        assert!(found(&[at(1.0), at(2.0), at(1.0)]).1.is_empty());
    }
}
