//! Rows of coefficients: through time or by frequencies.

use super::matrices::{LARGEST, NUMBERS, State, about, pair};
use super::predictor::Predictor;
use crate::anim::compress::coder::Coder;
use crate::anim::compress::integers::{Context, Integers, class_of};

/// Numbers a row is foreseen from.
const KNOWN: usize = 4;

/// What a row costs through time, about: by the best of three ways to foresee it.
pub fn through_time(row: &[f64]) -> f64 {
    let at = |f: usize, ago: usize| f.checked_sub(ago).map_or(0.0, |f| row[f]);
    let mut costs = [0.0; 3];
    for (f, x) in row.iter().enumerate() {
        costs[0] += about(*x);
        costs[1] += about(x - at(f, 1));
        costs[2] += about(x - 2.0 * at(f, 1) + at(f, 2));
    }
    costs.into_iter().fold(f64::INFINITY, f64::min)
}

/// Codes a row through time; returns its numbers, and the magnitudes of what was not foreseen.
pub fn times(
    model: &mut Integers<5>,
    coder: &mut impl Coder,
    state: &State,
    given: Option<&[f64]>,
    (price, usual): (f64, f64),
) -> (Vec<f64>, Vec<f32>) {
    let frames = state.rows[0].len();
    let (mut numbers, mut sizes) = (vec![0.0; frames], vec![0.0f32; frames]);
    let mut predictor = Predictor::<KNOWN>::new([1.0, 0.0, 0.0, 0.0], usual.max(1.0));
    let mut mean = usual;
    for f in 0..frames {
        let known = std::array::from_fn(|i| f.checked_sub(i + 1).map_or(0.0, |f| numbers[f]));
        let expected = predictor.expected(&known).round();
        let size = |ago: usize| f.checked_sub(ago).map_or(usual, |f| f64::from(sizes[f]));
        let before = f64::from(state.rows[0][f]);
        let context = Context {
            cells: [
                class_of(mean),
                pair(size(1), size(2)),
                pair(mean, before),
                state.met.min(NUMBERS - 1) * 8 + f.min(7),
                pair(mean, usual),
            ],
            set: 0,
        };
        let number = given.map_or(0, |given| {
            model.quantised(&context, given[f] - expected, price)
        });
        let number = model.code(coder, &context, number);
        sizes[f] = number.unsigned_abs() as f32;
        numbers[f] = (expected + f64::from(number)).clamp(-LARGEST, LARGEST);
        mean += (f64::from(sizes[f]) - mean) * 0.15;
        predictor.meet(&known, numbers[f]);
    }
    (numbers, sizes)
}

/// Codes a row by frequencies; returns its numbers and their magnitudes.
pub fn frequencies(
    model: &mut Integers<5>,
    coder: &mut impl Coder,
    state: &State,
    given: Option<&[f64]>,
    price: f64,
) -> (Vec<f64>, Vec<f32>) {
    let frames = state.rows[0].len();
    let usual = state.size() / (frames as f64).sqrt();
    let (mut numbers, mut sizes) = (vec![0.0; frames], vec![0.0f32; frames]);
    for k in 0..frames {
        let lower = |j: usize| {
            k.checked_sub(j)
                .map_or(4.0 * usual, |k| f64::from(sizes[k]))
        };
        let near = (2.0 * lower(1) + lower(2) + 0.5 * lower(3)) / 3.5;
        let last = |row: usize, k: usize| f64::from(state.rows[row][k.min(frames - 1)]);
        let before = (2.0 * last(0, k) + last(0, k.saturating_sub(1)) + last(0, k + 1)) / 4.0;
        let context = Context {
            cells: [
                class_of(near),
                pair(near, before),
                pair(near, usual),
                (k * NUMBERS / frames) * 8 + state.met.min(7),
                pair((near + before + last(1, k)) / 3.0, usual),
            ],
            set: 0,
        };
        let number = given.map_or(0, |given| model.quantised(&context, given[k], price));
        let number = model.code(coder, &context, number);
        sizes[k] = number.unsigned_abs() as f32;
        numbers[k] = f64::from(number);
    }
    (numbers, sizes)
}
