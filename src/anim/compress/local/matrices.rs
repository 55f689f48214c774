//! Components in a stream: a column of weights over a cluster and a row of coefficients over time.
//!
//! Columns go from coarse to fine vertices, each number by what those around it foretell; rows go either
//! through time, foreseen from the last numbers, or by frequencies, whichever seems shorter. All are
//! whole numbers of a step, so zero is exact.

use super::layout::Group;
use super::rows::{frequencies, through_time, times};
use crate::anim::compress::coder::Coder;
use crate::anim::compress::hierarchy::Hierarchy;
use crate::anim::compress::integers::{CLASSES, Context, Integers, class_of};
use crate::anim::compress::mixing::Adaptive;
use crate::anim::compress::prediction::Weights;
use crate::anim::compress::spectrum::Cosines;

/// Squared steps that a bit outweighs.
pub const PRICE: f64 = 0.08;
/// Numbers of components after which columns are foreseen anew from those that are known.
const STAGES: [usize; 5] = [1, 2, 4, 8, 16];
/// How much more affine functions of the known columns vary than others.
const AFFINE: f64 = 100.0;
/// Components that are told apart.
pub const NUMBERS: usize = 32;
/// Frames at most for rows that go by frequencies: their table grows with the square.
const WAVES: usize = 2048;
/// No exponent is larger.
const EXPONENTS: i32 = 800;
/// No number is larger.
pub const LARGEST: f64 = (1u32 << 30) as f64;

/// How finely the numbers of a cluster are held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Steps {
    /// Columns times their singular value, and rows, in this one step.
    Even(f64),
    /// One step for all columns, one for all rows.
    Ranges {
        /// That of columns.
        columns: f64,
        /// That of rows.
        rows: f64,
    },
}

impl Steps {
    fn row(&self) -> f64 {
        match self {
            Steps::Even(step) | Steps::Ranges { rows: step, .. } => *step,
        }
    }

    /// What a bit weighs; plain rounding where steps are those of ranges.
    fn price(&self) -> f64 {
        match self {
            Steps::Even(_) => PRICE,
            Steps::Ranges { .. } => 0.0,
        }
    }
}

/// `2^(exponent / 4)`.
fn power(exponent: i32) -> f64 {
    const ROOTS: [f64; 4] = [
        1.0,
        1.189207115002721,
        std::f64::consts::SQRT_2,
        1.681792830507429,
    ];
    let whole = exponent.div_euclid(4);
    // A power of two by its bits.
    ROOTS[exponent.rem_euclid(4) as usize] * f64::from_bits(((1023 + whole) as u64) << 52)
}

/// What the components of all clusters teach.
#[derive(Debug, Clone)]
pub struct Models {
    columns: Integers<6>,
    times: Integers<5>,
    waves: Integers<5>,
    scales: Integers<1>,
    whose: Integers<1>,
    foreseen: [Adaptive; 2],
    waved: [Adaptive; 2],
    last: i32,
    clusters: i32,
    cosines: Option<Cosines>,
}

/// What is known of one cluster's components.
#[derive(Debug, Clone)]
pub struct State<'a> {
    group: &'a Group,
    /// How finely its numbers are held.
    pub steps: Steps,
    weights: Weights,
    places: Vec<f64>,
    /// Columns not yet among the places, each times its size.
    fresh: Vec<Vec<f64>>,
    /// Magnitudes of the numbers of the last column, for each row of the matrix.
    column: Vec<f32>,
    /// Magnitudes of the last two rows.
    pub rows: [Vec<f32>; 2],
    exponent: i32,
    /// Components met.
    pub met: usize,
}

impl<'a> State<'a> {
    /// None met yet.
    pub fn new(group: &'a Group, frames: usize, steps: Steps) -> Self {
        State {
            group,
            steps,
            weights: Weights::even(&group.hierarchy),
            places: Vec::new(),
            fresh: Vec::new(),
            column: vec![0.0; group.rows()],
            rows: [vec![0.0; frames], vec![0.0; frames]],
            exponent: 0,
            met: 0,
        }
    }

    /// What the singular value of the component at hand is, in steps of a row.
    pub fn size(&self) -> f64 {
        power(self.exponent)
    }

    fn column_step(&self) -> f64 {
        match self.steps {
            Steps::Even(_) => 1.0 / self.size(),
            Steps::Ranges { columns, .. } => columns,
        }
    }

    /// After a component: columns that are known foretell the next.
    fn learn(&mut self, mut column: Vec<f64>) {
        self.met += 1;
        if self.met > STAGES[STAGES.len() - 1] {
            return;
        }
        let size = self.size();
        column.iter_mut().for_each(|x| *x *= size);
        self.fresh.push(column);
        let count = self.group.vertices.len();
        if !STAGES.contains(&self.met) || count == 0 {
            return;
        }
        let known = self.places.len() / count;
        let dims = known + 3 * self.fresh.len();
        let mut places = Vec::with_capacity(count * dims);
        for rank in 0..count {
            places.extend_from_slice(&self.places[rank * known..(rank + 1) * known]);
            for column in &self.fresh {
                places.extend((0..3).map(|axis| column[axis * count + rank]));
            }
        }
        self.fresh.clear();
        self.places = places;
        self.weights = Weights::new(&self.group.hierarchy, &self.places, dims, AFFINE);
    }
}

/// The cost of a number of this size, about: for comparisons.
pub fn about(x: f64) -> f64 {
    (1.0 + x.abs()).ln()
}

impl Models {
    /// Nothing met yet.
    pub fn new(clusters: usize, frames: usize) -> Self {
        let pairs = CLASSES * CLASSES;
        let levels = Hierarchy::LEVELS;
        let columns = [
            CLASSES * levels,
            CLASSES * levels,
            pairs,
            pairs,
            levels * NUMBERS,
            pairs,
        ];
        let rows = [CLASSES, pairs, pairs, NUMBERS * 8, pairs];
        Models {
            columns: Integers::new(columns, levels),
            times: Integers::new(rows, 1),
            waves: Integers::new(rows, 1),
            scales: Integers::new([4], 1),
            whose: Integers::new([1], 1),
            foreseen: [Adaptive::NEW; 2],
            waved: [Adaptive::NEW; 2],
            last: -1,
            clusters: clusters as i32,
            cosines: (frames <= WAVES).then(|| Cosines::new(frames)),
        }
    }

    /// Codes whose component is next.
    pub fn whose(&mut self, coder: &mut impl Coder, cluster: usize) -> usize {
        let on = (cluster as i32 - self.last - 1).rem_euclid(self.clusters);
        let context = Context { cells: [0], set: 0 };
        let on = self.whose.code(coder, &context, on);
        self.last = self
            .last
            .wrapping_add(1)
            .wrapping_add(on)
            .rem_euclid(self.clusters);
        self.last as usize
    }

    /// Codes the size of a component: its singular value, known in quarters of powers of two.
    pub fn scale(&mut self, coder: &mut impl Coder, state: &mut State, sigma: f64) {
        let steps = sigma / state.steps.row();
        let wanted = match (4.0 * steps.log2()).round() {
            wanted if wanted.is_finite() => wanted.clamp(-100.0, f64::from(EXPONENTS)) as i32,
            _ => 0,
        };
        let context = Context {
            cells: [state.met.min(3)],
            set: 0,
        };
        let change = self.scales.code(coder, &context, wanted - state.exponent);
        state.exponent = state
            .exponent
            .saturating_add(change)
            .clamp(-EXPONENTS, EXPONENTS);
    }

    /// Codes a column; returns the one the stream holds. `given` is that of a unit vector.
    pub fn column(
        &mut self,
        coder: &mut impl Coder,
        state: &mut State,
        given: Option<&[f64]>,
    ) -> Vec<f64> {
        let step = state.column_step();
        let hierarchy = &state.group.hierarchy;
        let count = hierarchy.len();
        let scaled: Option<Vec<f64>> = given.map(|given| given.iter().map(|x| x / step).collect());
        let foreseen = scaled.as_deref().is_some_and(|scaled| {
            let (mut plain, mut missed) = (0.0, 0.0);
            for field in scaled.chunks_exact(count) {
                for (rank, x) in field.iter().enumerate() {
                    plain += about(*x);
                    missed += about(*x - state.weights.expected(hierarchy, rank, field));
                }
            }
            missed < plain
        });
        let bit = &mut self.foreseen[usize::from(state.met > 0)];
        let foreseen = coder.bit(bit.one(), foreseen);
        bit.meet(foreseen, 60);
        let mut held = vec![0.0; 3 * count];
        let mut sizes = vec![0.0f32; 3 * count];
        let usual = 1.0 / (step * (3.0 * count as f64).sqrt());
        for axis in 0..3 {
            let (done, here) = sizes.split_at_mut(axis * count);
            let numbers = &mut held[axis * count..(axis + 1) * count];
            for rank in 0..count {
                let expected = match foreseen {
                    true => state.weights.expected(hierarchy, rank, numbers).round(),
                    false => 0.0,
                };
                let near = Near {
                    here,
                    other: done.chunks_exact(count).last(),
                    before: &state.column[axis * count..(axis + 1) * count],
                };
                let context = near.context(hierarchy, rank, state.met, usual);
                let number = scaled.as_deref().map_or(0, |scaled| {
                    let apart = scaled[axis * count + rank] - expected;
                    self.columns.quantised(&context, apart, state.steps.price())
                });
                let number = self.columns.code(coder, &context, number);
                here[rank] = number.unsigned_abs() as f32;
                numbers[rank] = (expected + f64::from(number)).clamp(-LARGEST, LARGEST);
            }
        }
        state.column = sizes;
        held.iter_mut().for_each(|x| *x *= step);
        held
    }

    /// Codes a row, the last of a component; returns the one the stream holds.
    pub fn row(
        &mut self,
        coder: &mut impl Coder,
        state: &mut State,
        column: &[f64],
        given: Option<&[f64]>,
    ) -> Vec<f64> {
        let step = state.steps.row();
        let scaled: Option<Vec<f64>> = given.map(|given| given.iter().map(|x| x / step).collect());
        let frames = state.rows[0].len();
        let usual = state.size() / (frames as f64).sqrt();
        let waves = match (&self.cosines, &scaled) {
            (Some(cosines), Some(scaled)) => {
                let mut out = vec![0.0; frames];
                cosines.transform(scaled, &mut out);
                Some(out)
            }
            _ => None,
        };
        let mut waved = waves
            .as_deref()
            .zip(scaled.as_deref())
            .is_some_and(|(waves, times)| {
                waves.iter().map(|x| about(*x)).sum::<f64>() < through_time(times)
            });
        if self.cosines.is_some() {
            let bit = &mut self.waved[usize::from(state.met > 0)];
            waved = coder.bit(bit.one(), waved);
            bit.meet(waved, 60);
        }
        let price = state.steps.price();
        let (mut held, sizes) = match waved {
            true => {
                let given = waves.as_deref();
                let (numbers, sizes) = frequencies(&mut self.waves, coder, state, given, price);
                let mut out = vec![0.0; frames];
                if let Some(cosines) = &self.cosines {
                    cosines.inverse(&numbers, &mut out);
                }
                (out, sizes)
            }
            false => times(
                &mut self.times,
                coder,
                state,
                scaled.as_deref(),
                (price, usual),
            ),
        };
        held.iter_mut().for_each(|x| *x *= step);
        state.rows.swap(0, 1);
        state.rows[0] = sizes;
        state.learn(column.to_vec());
        held
    }
}

/// A cell for two magnitudes.
pub fn pair(x: f64, y: f64) -> usize {
    class_of(x) * CLASSES + class_of(y)
}

/// Magnitudes that are known around a number of a column.
struct Near<'a> {
    /// Those of this axis.
    here: &'a [f32],
    /// Those of the axis before.
    other: Option<&'a [f32]>,
    /// Those of this axis in the column before.
    before: &'a [f32],
}

impl Near<'_> {
    fn context(&self, hierarchy: &Hierarchy, rank: usize, met: usize, usual: f64) -> Context<6> {
        let ring = &hierarchy.rings.of(rank)[..hierarchy.inner[rank] as usize];
        let sum: f32 = ring.iter().map(|u| self.here[*u as usize]).sum();
        let coarser = match ring.len() {
            0 => usual,
            n => f64::from(sum / n as f32),
        };
        let before = f64::from(self.before[rank]);
        let own = self.other.map_or(before, |other| f64::from(other[rank]));
        let level = hierarchy.level(rank);
        Context {
            cells: [
                class_of(coarser) * Hierarchy::LEVELS + level,
                class_of((own + before) / 2.0) * Hierarchy::LEVELS + level,
                pair(coarser, own),
                pair(coarser, usual),
                level * NUMBERS + met.min(NUMBERS - 1),
                pair((2.0 * coarser + own + before) / 4.0, usual),
            ],
            set: level,
        }
    }
}
