//! The step that reaches a target, by few trials.

/// What came of a trial.
#[derive(Debug, Clone)]
pub struct Trial<T> {
    /// The step it was made with.
    pub step: f64,
    /// Bits of what was made.
    pub bits: f64,
    /// Its squared error.
    pub squared_error: f64,
    /// What was made.
    pub made: T,
}

/// What a search is for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wanted {
    /// A squared error of this at most, and not much less.
    SquaredError(f64),
    /// So many bits at most, and not many less.
    Bits(f64),
}

impl Wanted {
    /// The number that a target is about, as a trial has it.
    fn of<T>(self, trial: &Trial<T>) -> f64 {
        match self {
            Wanted::SquaredError(_) => trial.squared_error,
            Wanted::Bits(_) => trial.bits,
        }
    }

    fn target(self) -> f64 {
        match self {
            Wanted::SquaredError(x) | Wanted::Bits(x) => x,
        }
    }

    /// How the number changes with the step, as a power, where nothing is known yet.
    fn power(self) -> f64 {
        match self {
            Wanted::SquaredError(_) => 1.8,
            Wanted::Bits(_) => -0.7,
        }
    }

    /// The share of the target that is near enough.
    fn near(self) -> f64 {
        match self {
            // Of the root, less than one percent.
            Wanted::SquaredError(_) => 0.983,
            Wanted::Bits(_) => 0.988,
        }
    }
}

/// Most rounds of trials.
const ROUNDS: usize = 16;
/// Steps that are nearer to one another than this, as logarithms, are not told apart.
const NARROWEST: f64 = 0.003;

/// The best trial there is, and how many were made; the best of all misses the target where none
/// reaches it.
///
/// `first` is a step to begin with and `range` what steps may be. Trials run one after the other, for
/// each takes all the memory there is need of.
pub fn search<T>(
    wanted: Wanted,
    first: f64,
    range: [f64; 2],
    trial: impl Fn(f64) -> Trial<T>,
) -> (Trial<T>, u64) {
    let mut all = vec![trial(first.clamp(range[0], range[1]))];
    let target = wanted.target();
    // A little below the target, so that it is not passed by a hair.
    let aim = target * (1.0 + 2.0 * wanted.near()) / 3.0;
    let fits = |trial: &Trial<T>| wanted.of(trial) <= target;
    let mut count = 1;
    for _ in 1..ROUNDS {
        let near = |trial: &&Trial<T>| fits(trial) && wanted.of(trial) >= wanted.near() * target;
        if all.iter().any(|trial| near(&trial)) {
            break;
        }
        let Some(step) = next(wanted, aim, range, &all) else {
            break;
        };
        all.push(trial(step));
        count += 1;
        thin(wanted, aim, &mut all);
    }
    // Of those that fit the one of most error or bits, of the others the nearest.
    let best = all.into_iter().reduce(|best, other| {
        let (x, y) = (wanted.of(&best), wanted.of(&other));
        let better = match (x <= target, y <= target) {
            (true, true) => y > x,
            (false, false) => y < x,
            (_, fits) => fits,
        };
        if better { other } else { best }
    });
    (best.expect("a trial was made"), count)
}

/// The next step to try: by a power law between the two trials that the aim lies between, or away
/// from the nearest where all are on one side; none where nothing is left between them, or beyond.
fn next<T>(wanted: Wanted, aim: f64, range: [f64; 2], all: &[Trial<T>]) -> Option<f64> {
    // Grows with the step, from below 0 to above.
    let sign = wanted.power().signum();
    let off = |trial: &Trial<T>| sign * (wanted.of(trial).max(f64::MIN_POSITIVE) / aim).ln();
    let steps = |trial: &&Trial<T>, other: &&Trial<T>| trial.step.total_cmp(&other.step);
    let below = all.iter().filter(|trial| off(trial) < 0.0).max_by(steps);
    let above = all.iter().filter(|trial| off(trial) >= 0.0).min_by(steps);
    match (below, above) {
        (Some(below), Some(above)) => {
            let width = (above.step / below.step).ln();
            if width < NARROWEST {
                return None;
            }
            // Where the curve jumps, a line through its ends would creep along one of them.
            let share = -off(below) / (off(above) - off(below));
            let share = if share.is_finite() {
                share.clamp(0.1, 0.9)
            } else {
                0.5
            };
            Some(below.step * (share * width).exp())
        }
        (nearest, None) | (None, nearest) => {
            let nearest = nearest?;
            let way = (-off(nearest) / wanted.power().abs()).clamp(-3.0, 3.0);
            // A little farther, so that the aim comes to lie between.
            let step = nearest.step * (1.1 * way).exp();
            let step = step.clamp(range[0], range[1]);
            (step != nearest.step).then_some(step)
        }
    }
}

/// Lets go of trials that no longer tell: all but the two nearest on each side of the aim.
fn thin<T>(wanted: Wanted, aim: f64, all: &mut Vec<Trial<T>>) {
    all.sort_by(|a, b| wanted.of(a).total_cmp(&wanted.of(b)));
    let middle = all.partition_point(|trial| wanted.of(trial) < aim);
    let to = all.len().min(middle + 2);
    all.truncate(to);
    all.drain(..middle.saturating_sub(2));
}

/// The step of least bits, by trials at ever closer steps about the first; and how many were made.
pub fn least_bits<T: Send>(
    first: f64,
    range: [f64; 2],
    trial: impl Fn(f64) -> Trial<T> + Sync,
) -> (Trial<T>, u64) {
    let at = |step: f64| trial(step.clamp(range[0], range[1]));
    let mut best = at(first);
    let (mut factor, mut count) = (1.6f64, 1);
    while factor > 1.07 && count < 16 {
        let (low, high) = rayon::join(|| at(best.step / factor), || at(best.step * factor));
        count += 2;
        let side = if low.bits < high.bits { low } else { high };
        if side.bits < best.bits {
            best = side;
        } else {
            factor = factor.powf(0.5);
        }
    }
    (best, count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model(step: f64) -> Trial<()> {
        Trial {
            step,
            bits: 1e5 * (1.0 / step).powf(0.6) + 2e4,
            squared_error: 3.0 * step.powf(1.7) + 1e-9,
            made: (),
        }
    }

    #[test]
    fn targets_are_reached_from_far_steps() {
        for first in [1e-6, 1e-3, 0.5] {
            for target in [1e-6, 1e-3, 0.1] {
                let (trial, count) =
                    search(Wanted::SquaredError(target), first, [1e-9, 4.0], model);
                assert!(trial.squared_error <= target && trial.squared_error > 0.98 * target);
                assert!(count <= 9, "{count} trials from {first} to {target}");
            }
            let (trial, _) = search(Wanted::Bits(1e6), first, [1e-9, 4.0], model);
            assert!(trial.bits <= 1e6 && trial.bits > 0.98e6);
        }
    }

    #[test]
    fn what_cannot_be_reached_ends_at_the_floor() {
        let (trial, _) = search(Wanted::SquaredError(1e-12), 1e-3, [1e-9, 4.0], model);
        assert!(trial.squared_error > 1e-12 && trial.squared_error < 2e-9);
        let (trial, _) = search(Wanted::Bits(1e3), 1e-3, [1e-9, 4.0], model);
        assert!(trial.bits > 1e3 && trial.step > 3.9);
    }

    #[test]
    fn the_least_of_a_valley_is_found() {
        let valley = |step: f64| Trial {
            bits: 1.0 / step + 40.0 * step,
            ..model(step)
        };
        let (trial, _) = least_bits(3.0, [1e-9, 10.0], valley);
        assert!(trial.bits < 1.01 * 2.0 * 40f64.sqrt(), "{}", trial.bits);
    }
}
