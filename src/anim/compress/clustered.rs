//! The methods of clusters: streams for a target, and how many clusters.

use super::encode::{Bits, Encoder, Made, Told};
use super::local::{self, Analysis, Floor, Goal, Space};
use super::params::Target;
use super::search::{self, Trial};
use super::spectrum::Trajectories;
use crate::error::{Error, Result};
use crate::progress::Progress;

/// Numbers of clusters that are tried where none is asked for.
const TRIED: [usize; 7] = [4, 6, 8, 10, 14, 20, 30];
/// Bits of the points of frames of reference, where no error tells how many suit.
const SEED_BITS: u32 = 16;

/// Bytes that the heads of a few sections take.
const SECTIONS: f64 = 40.0;

impl Encoder<'_> {
    /// A stream of clusters for a target; see [`Encoder::make`].
    pub(super) fn make_clustered(&self, target: Target, progress: &dyn Progress) -> Result<Made> {
        if let Target::Max(bound) = target {
            return self.within_bound(bound, progress);
        }
        let mut told = Vec::new();
        for window in &self.windows {
            let share = window.frames() as f64 / self.header.frames as f64;
            let goal = match (self.clusters.components, target, self.squared_error(target)) {
                (Some(components), ..) => Goal::Components(components),
                (None, Target::Bpvf(bits), _) => {
                    let positions = (window.vertices * window.frames()) as f64;
                    // What the heads of its sections take is known only after.
                    let share = self.overhead() / self.windows.len() as f64;
                    Goal::Bits(bits * positions - share - 8.0 * SECTIONS)
                }
                (None, _, error) => Goal::SquaredError(error.unwrap_or_default() * share),
            };
            told.push(self.window_for(window, goal, target)?);
            progress.advance(1);
        }
        let best = self.trial_of(told, 0.0);
        if self.clusters.components.is_none() {
            self.check_reached(target, &best)?;
        }
        Ok(self.assemble(self.method, best, 1))
    }

    /// A stream in which no vertex is farther than a bound: the shortest of several errors that are then
    /// corrected.
    fn within_bound(&self, bound: f64, progress: &dyn Progress) -> Result<Made> {
        let local = bound / self.header.unit();
        let first = local / 12f64.sqrt();
        // A failed trial is one of more bits than any other.
        let trial = |step: f64| {
            let made: Result<Vec<Told>> = (0..self.windows.len())
                .map(|number| {
                    let window = &self.windows[number];
                    let positions = (window.vertices * window.frames()) as f64;
                    let goal = Goal::SquaredError(positions * step * step);
                    let mut told = self.window_for(window, goal, Target::Max(bound))?;
                    self.correct(number, self.method, local, &mut told);
                    Ok(told)
                })
                .collect();
            progress.advance(1);
            match made {
                Ok(told) => self.trial_of(told, step),
                Err(_) => Trial {
                    step,
                    bits: f64::INFINITY,
                    squared_error: f64::INFINITY,
                    made: Vec::new(),
                },
            }
        };
        let (best, trials) = search::least_bits(first, [first / 64.0, first * 64.0], trial);
        if best.made.is_empty() {
            let problem = "cannot be reached with these bits; give more, or none";
            return Err(Error::parameter("target-max", bound, problem));
        }
        Ok(self.assemble(self.method, best, trials))
    }

    fn trial_of(&self, made: Vec<Told>, step: f64) -> Trial<Vec<Told>> {
        let bytes: usize = made.iter().map(Told::bytes).sum();
        Trial {
            step,
            bits: 8.0 * bytes as f64,
            squared_error: made.iter().map(|told| told.squared_error).sum(),
            made,
        }
    }

    /// A window by as many clusters as are asked for, or the number of them that is shortest.
    fn window_for(&self, window: &Trajectories, goal: Goal, target: Target) -> Result<Told> {
        let space = self.method.space().unwrap_or(Space::Relative);
        let counts = match (self.clusters.count, space) {
            (_, Space::Whole) => vec![1],
            (Some(count), _) => vec![count],
            (None, _) => TRIED.to_vec(),
        };
        let mut best: Option<Told> = None;
        let mut failed = None;
        for count in counts {
            match self.window_of(window, space, count, goal, target) {
                Ok(told) => {
                    // Of a budget of bits the error is what differs.
                    let figure = |told: &Told| match goal {
                        Goal::Bits(_) => told.squared_error,
                        _ => told.bytes() as f64,
                    };
                    if best
                        .as_ref()
                        .is_none_or(|best| figure(&told) < figure(best))
                    {
                        best = Some(told);
                    }
                }
                Err(error) => failed = Some(error),
            }
        }
        best.ok_or_else(|| failed.expect("one of them was tried"))
    }

    fn window_of(
        &self,
        window: &Trajectories,
        space: Space,
        count: usize,
        goal: Goal,
        target: Target,
    ) -> Result<Told> {
        let seed_bits = match goal {
            Goal::SquaredError(error) => Analysis::fitting_seed_bits(window, error),
            _ => SEED_BITS,
        };
        let chosen = self.clusters;
        let params = local::Params {
            space,
            clusters: count,
            bits: match goal {
                // Components that are counted say nothing of how fine they are.
                Goal::Components(_) => chosen.bits.or(local::Params::DEFAULT.bits),
                _ => chosen.bits,
            },
            seed_bits,
            frame: chosen.frame,
            allocate: chosen.allocate,
            rounding: chosen.rounding,
            ..local::Params::DEFAULT
        };
        let ground = self.ground;
        let analysis = Analysis::new(*window, &ground.triangles, &ground.hierarchy, &params)?;
        let made = analysis
            .encode(goal)
            .map_err(|floor| self.unreached(target, &floor))?;
        let mut members = vec![0usize; analysis.clusters()];
        for label in analysis.labels() {
            members[label as usize] += 1;
        }
        let each = made.components.iter().zip(&members);
        let numbers: usize = each
            .map(|(l, count)| l * (3 * count + window.frames()))
            .sum();
        let seeds = match space {
            Space::Relative => 9 * made.clusters * window.frames(),
            _ => 0,
        };
        Ok(Told {
            window: made.window,
            parts: made.parts,
            squared_error: made.squared_error,
            bits: Bits {
                labels: made.label_bits,
                seeds: made.seed_bits,
                basis: made.basis_bits,
                weights: made.coefficient_bits + made.range_bits,
                ..Bits::default()
            },
            components: made.components,
            numbers: numbers + seeds,
            ..Told::default()
        })
    }

    /// The error of a target that is below what the bits allow.
    fn unreached(&self, target: Target, floor: &Floor) -> Error {
        let least = self.as_target(target, floor.squared_error);
        let way = match floor.bits {
            Some(bits) => format!("--bits {bits} would reach it"),
            None => "no number of bits reaches it".to_owned(),
        };
        let problem = format!("cannot be reached; the least with these bits is {least:.6e}, {way}");
        Error::parameter(target.option(), target.value(), problem)
    }
}
