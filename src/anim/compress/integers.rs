//! Signed whole numbers, small ones mostly, coded by what is known around them.

use super::coder::Coder;
use super::mixing::{Adaptive, Mixture};

/// Magnitudes below this are told apart one by one, larger ones by their size in bits.
const SINGLE: u32 = 6;
/// Sizes in bits that are told apart above.
const SIZES: u32 = 32;
const DECISIONS: usize = (SINGLE + SIZES) as usize;
/// Bits met before a context forgets.
const MEMORY: u16 = 180;

/// What is known of a number before it is coded: for each of `N` points of view a cell, and the set
/// of weights they are mixed by.
#[derive(Debug, Clone, Copy)]
pub struct Context<const N: usize> {
    /// A cell for each point of view.
    pub cells: [usize; N],
    /// The set of weights.
    pub set: usize,
}

/// A model of signed whole numbers that learns as they pass.
#[derive(Debug, Clone)]
pub struct Integers<const N: usize> {
    /// For each point of view, cell and decision.
    said: [Vec<[Adaptive; DECISIONS]>; N],
    mixture: Mixture<N>,
    /// The highest bit below the leading one, for each size.
    mantissa: [Adaptive; SIZES as usize],
    sign: Adaptive,
}

impl<const N: usize> Integers<N> {
    /// A model of so many cells for each point of view, and so many sets of weights.
    pub fn new(cells: [usize; N], sets: usize) -> Self {
        Integers {
            said: cells.map(|cells| vec![[Adaptive::NEW; DECISIONS]; cells]),
            mixture: Mixture::new(sets * DECISIONS),
            mantissa: [Adaptive::NEW; SIZES as usize],
            sign: Adaptive::NEW,
        }
    }

    #[inline]
    fn odds(&self, context: &Context<N>, decision: usize) -> [i32; N] {
        let said = std::array::from_fn(|i| self.said[i][context.cells[i]][decision]);
        Mixture::odds(&said)
    }

    /// Whether the number goes on beyond a decision.
    #[inline]
    fn decide(
        &mut self,
        coder: &mut impl Coder,
        context: &Context<N>,
        decision: u32,
        more: bool,
    ) -> bool {
        let decision = decision as usize;
        let set = context.set * DECISIONS + decision;
        let odds = self.odds(context, decision);
        let one = self.mixture.one(set, &odds);
        let more = coder.bit(one, more);
        self.mixture.meet(set, &odds, one, more);
        for (said, cell) in self.said.iter_mut().zip(context.cells) {
            said[cell][decision].meet(more, MEMORY);
        }
        more
    }

    /// Codes a number; returns the one the stream holds.
    pub fn code(&mut self, coder: &mut impl Coder, context: &Context<N>, value: i32) -> i32 {
        let given = value.unsigned_abs();
        let mut magnitude = 0;
        while magnitude < SINGLE && self.decide(coder, context, magnitude, given > magnitude) {
            magnitude += 1;
        }
        if magnitude == SINGLE {
            magnitude += self.large(coder, context, given.saturating_sub(SINGLE));
        }
        if magnitude == 0 {
            return 0;
        }
        let negative = coder.bit(self.sign.one(), value < 0);
        self.sign.meet(negative, MEMORY);
        let magnitude = magnitude.min(i32::MAX as u32) as i32;
        if negative { -magnitude } else { magnitude }
    }

    /// What is beyond the magnitudes told apart one by one: its size in bits, then its bits.
    fn large(&mut self, coder: &mut impl Coder, context: &Context<N>, beyond: u32) -> u32 {
        let leading = beyond.saturating_add(1);
        let given = leading.ilog2();
        let mut size = 0;
        while size < SIZES - 1 && self.decide(coder, context, SINGLE + size, given > size) {
            size += 1;
        }
        let mut made = 1u64;
        if size > 0 {
            let place = &mut self.mantissa[size as usize];
            let high = coder.bit(place.one(), leading >> (size - 1) & 1 == 1);
            place.meet(high, MEMORY);
            made = made << 1 | u64::from(high);
            made = made << (size - 1) | coder.number(u64::from(leading), size - 1);
        }
        (made - 1).min(u64::from(u32::MAX)) as u32
    }

    /// How many bits more a magnitude takes than the one below it, as far as the model knows now;
    /// none is said of those that are not told apart one by one.
    pub fn step_cost(&self, context: &Context<N>, magnitude: u32) -> Option<f64> {
        if magnitude == 0 || magnitude >= SINGLE {
            return None;
        }
        let more = |decision: u32| {
            let odds = self.odds(context, decision as usize);
            let set = context.set * DECISIONS + decision as usize;
            f64::from(self.mixture.one(set, &odds)) / 65_536.0
        };
        let (below, here) = (more(magnitude - 1), more(magnitude));
        let sign = f64::from(u8::from(magnitude == 1));
        // Both share the decisions before.
        Some(sign - (below * (1.0 - here) / (1.0 - below)).log2())
    }

    /// The whole number for a value in units of a step: the nearest, or one nearer to zero where the
    /// bits saved outweigh the squared error added; a bit weighs as much as `price` squared steps.
    pub fn quantised(&self, context: &Context<N>, value: f64, price: f64) -> i32 {
        let size = value.abs();
        let mut magnitude = size.round().min(f64::from(i32::MAX)) as u32;
        while let Some(bits) = self.step_cost(context, magnitude) {
            let here = size - f64::from(magnitude);
            let below = here + 1.0;
            if below * below >= here * here + price * bits {
                break;
            }
            magnitude -= 1;
        }
        let magnitude = magnitude as i32;
        if value < 0.0 { -magnitude } else { magnitude }
    }
}

/// Bounds between the classes of [`class_of`].
const BOUNDS: [f64; 19] = [
    0.02, 0.06, 0.12, 0.2, 0.3, 0.45, 0.65, 0.9, 1.3, 1.9, 3.0, 5.0, 9.0, 16.0, 30.0, 60.0, 120.0,
    250.0, 600.0,
];

/// Number of classes of [`class_of`].
pub const CLASSES: usize = BOUNDS.len() + 1;

/// Steps of a small magnitude that classes are told by.
const FINE: f64 = 128.0;
/// Classes of magnitudes below 8.
const SMALL: [u8; 1024] = {
    let mut table = [0; 1024];
    let (mut i, mut class) = (0, 0);
    while i < 1024 {
        while i as f64 / FINE > BOUNDS[class] {
            class += 1;
        }
        table[i] = class as u8;
        i += 1;
    }
    table
};

/// The class of an expected magnitude, for use as a cell: how many bounds it is above.
#[inline]
pub fn class_of(expected: impl Into<f64>) -> usize {
    let expected = expected.into();
    match SMALL.get((expected * FINE) as usize) {
        // Between two steps there is one bound at most.
        Some(class) => {
            let class = usize::from(*class);
            class + usize::from(expected > BOUNDS[class])
        }
        None => BOUNDS.partition_point(|bound| expected > *bound),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anim::compress::coder::{Reader, Writer};
    use crate::numeric::rng::Rng;

    fn model() -> Integers<2> {
        Integers::new([CLASSES, 4], 1)
    }

    fn context(before: i32, at: usize) -> Context<2> {
        Context {
            cells: [class_of(f64::from(before).abs()), at % 4],
            set: 0,
        }
    }

    fn round_trip(values: &[i32]) -> usize {
        let mut writer = Writer::new();
        let (mut model_out, mut before) = (model(), 0);
        for (i, value) in values.iter().enumerate() {
            let held = model_out.code(&mut writer, &context(before, i), *value);
            assert_eq!(held, *value);
            before = held;
        }
        let bytes = writer.finish();
        let mut reader = Reader::new(&bytes);
        let (mut model_in, mut before) = (model(), 0);
        for (i, value) in values.iter().enumerate() {
            before = model_in.code(&mut reader, &context(before, i), 0);
            assert_eq!(before, *value, "number {i}");
        }
        bytes.len()
    }

    #[test]
    fn classes_are_those_of_the_bounds() {
        for i in 0..60_000 {
            let x = f64::from(i) * 0.0117;
            let class = BOUNDS.partition_point(|bound| x > *bound);
            assert_eq!(class_of(x), class, "{x}");
        }
        assert_eq!(class_of(1e9f64), CLASSES - 1);
    }

    #[test]
    fn numbers_of_every_size_come_back() {
        let mut values = vec![0, 1, -1, 5, -5, 6, -6, 7, -7, i32::MAX, -i32::MAX];
        for bits in 0..31 {
            values.extend([1 << bits, -(1 << bits), (1 << bits) - 1]);
        }
        round_trip(&values);
    }

    #[test]
    fn a_geometric_source_costs_little_more_than_its_entropy() {
        let mut rng = Rng::new(5, 0);
        let values: Vec<i32> = (0..50_000)
            .map(|_| {
                let mut m = 0;
                while rng.unit() < 0.3 && m < 30 {
                    m += 1;
                }
                if rng.unit() < 0.5 { -m } else { m }
            })
            .collect();
        // Each stop or go has the entropy of 0.3, and there are 1/0.7 of them; then a sign for 30 %.
        let h = -(0.3f64 * 0.3f64.log2() + 0.7 * 0.7f64.log2());
        let ideal = values.len() as f64 * (h / 0.7 + 0.3) / 8.0;
        let bytes = round_trip(&values) as f64;
        assert!(bytes < 1.02 * ideal, "{bytes} for {ideal}");
    }

    #[test]
    fn cheap_zeros_are_preferred_where_bits_are_dear() {
        let mut model = model();
        let mut writer = Writer::new();
        for i in 0..500 {
            model.code(&mut writer, &context(0, i), 0);
        }
        let context = context(0, 1);
        assert_eq!(model.quantised(&context, 0.6, 0.0), 1);
        assert_eq!(model.quantised(&context, -0.6, 0.1), 0);
        assert_eq!(model.quantised(&context, -7.4, 0.1), -7);
        assert!(model.step_cost(&context, 1).unwrap() > 5.0);
    }
}
