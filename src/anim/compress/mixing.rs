//! Probabilities that learn, and their mixture.
//!
//! Each context of a decision keeps a probability of its own; a mixture weighs what the contexts
//! say, in the domain of log odds, and learns the weights as it goes. All of it is in whole numbers,
//! so that every machine reads a stream as every other. Source: M. Mahoney, "Adaptive weighing of
//! context models for lossless data compression" (2005).

/// One nat of log odds.
const NAT: i32 = 256;
/// The largest log odds: eight nats.
const LARGEST: i32 = 8 * NAT - 1;
/// Probabilities stay this far from 0 and from 1.
const MARGIN: i32 = 24;
const WHOLE: i32 = 1 << 16;

/// The logistic function at every half nat from -8 to 8, in 2^16.
const LOGISTIC: [i32; 33] = [
    22, 36, 60, 98, 162, 267, 439, 720, 1179, 1921, 3108, 4971, 7812, 11955, 17625, 24743, 32768,
    40793, 47911, 53581, 57724, 60565, 62428, 63615, 64357, 64816, 65097, 65269, 65374, 65438,
    65476, 65500, 65514,
];

/// The probability of these log odds, in 2^16.
#[inline]
fn squash(odds: i32) -> i32 {
    let at = odds.clamp(-LARGEST, LARGEST) + 8 * NAT;
    let (step, rest) = ((at / (NAT / 2)) as usize, at % (NAT / 2));
    let (low, high) = (LOGISTIC[step], LOGISTIC[step + 1]);
    (low + (high - low) * rest / (NAT / 2)).clamp(MARGIN, WHOLE - MARGIN)
}

/// The log odds of every probability, in steps of 2^-12.
#[derive(Debug)]
struct Stretch([i16; 4096]);

impl Stretch {
    const TABLE: Stretch = Stretch::new();

    /// The smallest odds whose probability reaches the middle of each step.
    const fn new() -> Self {
        let mut table = [0; 4096];
        let (mut odds, mut p) = (-LARGEST, 0);
        while p < 4096 {
            let wanted = p as i32 * 16 + 8;
            while odds < LARGEST {
                let at = odds + 8 * NAT;
                let (step, rest) = ((at / (NAT / 2)) as usize, at % (NAT / 2));
                let (low, high) = (LOGISTIC[step], LOGISTIC[step + 1]);
                if low + (high - low) * rest / (NAT / 2) >= wanted {
                    break;
                }
                odds += 1;
            }
            table[p] = odds as i16;
            p += 1;
        }
        Stretch(table)
    }
}

static STRETCH: Stretch = Stretch::TABLE;

/// The log odds of a probability in 2^16.
#[inline]
fn stretch(p: i32) -> i32 {
    i32::from(STRETCH.0[(p >> 4) as usize])
}

/// A probability that learns from the bits it meets: their mean at first, then ever more that of
/// the last ones.
#[derive(Debug, Clone, Copy)]
pub struct Adaptive {
    one: u16,
    met: u16,
}

impl Adaptive {
    /// Nothing met yet.
    pub const NEW: Adaptive = Adaptive {
        one: 1 << 15,
        met: 0,
    };

    /// The probability of a one, in 2^16.
    #[inline]
    pub fn one(self) -> u32 {
        i32::from(self.one).clamp(MARGIN, WHOLE - MARGIN) as u32
    }

    /// Meets a bit; after `limit` of them, [`LONGEST`] at most, each counts as much as the one before.
    #[inline]
    pub fn meet(&mut self, bit: bool, limit: u16) {
        debug_assert!(limit <= LONGEST);
        let share = SHARES[usize::from(self.met)];
        let one = u64::from(self.one);
        // Towards what was met by two parts of 2 n + 3, rounded down.
        let moved = |apart: u64| ((apart * share) >> 32) as u16;
        if bit {
            self.one += moved(2 * ((1 << 16) - 1 - one));
        } else {
            self.one -= moved(2 * one);
        }
        self.met = (self.met + 1).min(limit);
    }
}

/// Bits met before a probability forgets, at most.
const LONGEST: u16 = 255;

/// What a number below 2^17 is multiplied with, to be divided by `2 n + 3` once 32 bits are dropped;
/// exact, as 2^17 times the excess over 2^32 stays below 2^32.
const SHARES: [u64; LONGEST as usize + 1] = {
    let mut shares = [0; LONGEST as usize + 1];
    let mut n = 0;
    while n < shares.len() {
        shares[n] = (1u64 << 32).div_ceil(2 * n as u64 + 3);
        n += 1;
    }
    shares
};

/// What `N` contexts say about one decision, and how much each is believed.
#[derive(Debug, Clone)]
pub struct Mixture<const N: usize> {
    /// In 2^16, for each set of weights.
    weights: Vec<[i32; N]>,
}

impl<const N: usize> Mixture<N> {
    /// How fast weights learn.
    const RATE: i64 = 2;

    /// Several sets of weights, all alike at first.
    pub fn new(sets: usize) -> Self {
        // Contexts that agree share what they see; so together they may claim more than each does.
        let weight = 2 * WHOLE / N as i32;
        Mixture {
            weights: vec![[weight; N]; sets],
        }
    }

    /// The log odds that the contexts name.
    #[inline]
    pub fn odds(said: &[Adaptive; N]) -> [i32; N] {
        std::array::from_fn(|i| stretch(said[i].one() as i32))
    }

    /// The probability of a one by one set of weights, in 2^16.
    #[inline]
    pub fn one(&self, set: usize, odds: &[i32; N]) -> u32 {
        let weights = self.weights[set].iter().zip(odds);
        let sum: i64 = weights.map(|(w, o)| i64::from(*w) * i64::from(*o)).sum();
        squash((sum >> 16).clamp(-i64::from(LARGEST), i64::from(LARGEST)) as i32) as u32
    }

    /// Meets the bit that had the probability `one`.
    #[inline]
    pub fn meet(&mut self, set: usize, odds: &[i32; N], one: u32, bit: bool) {
        let aim = if bit { WHOLE - 1 } else { 0 };
        let missed = i64::from(aim) - i64::from(one);
        for (weight, odds) in self.weights[set].iter_mut().zip(odds) {
            let change = (i64::from(*odds) * missed * Self::RATE) >> 14;
            *weight = weight
                .saturating_add(change as i32)
                .clamp(-(WHOLE << 4), WHOLE << 4);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_the_logistic_function() {
        for (i, value) in LOGISTIC.iter().enumerate() {
            let x = i as f64 / 2.0 - 8.0;
            let exact = 65_536.0 / (1.0 + (-x).exp());
            assert!(
                (f64::from(*value) - exact).abs() <= 0.5,
                "{x}: {value} {exact}"
            );
        }
    }

    #[test]
    fn odds_and_probabilities_are_inverse() {
        for p in (64..65_472).step_by(16) {
            let back = squash(stretch(p));
            assert!((back - p).abs() <= 16 + p.min(WHOLE - p) / 64, "{p} {back}");
        }
        for odds in -LARGEST..LARGEST {
            assert!(squash(odds) <= squash(odds + 1));
        }
    }

    #[test]
    fn shares_are_those_of_a_division() {
        for n in 0..=u64::from(LONGEST) {
            for apart in (0..1 << 17).step_by(7).chain([(1 << 17) - 2]) {
                assert_eq!((apart * SHARES[n as usize]) >> 32, apart / (2 * n + 3));
            }
        }
    }

    #[test]
    fn a_probability_learns_its_source() {
        let mut p = Adaptive::NEW;
        for i in 0..10_000 {
            p.meet(i % 10 == 0, LONGEST);
        }
        assert!(
            (f64::from(p.one()) / 65_536.0 - 0.1).abs() < 0.02,
            "{}",
            p.one()
        );
    }

    #[test]
    fn a_mixture_learns_whom_to_believe() {
        let mut mixture = Mixture::<2>::new(1);
        let (mut right, mut wrong) = (Adaptive::NEW, Adaptive::NEW);
        for _ in 0..50 {
            right.meet(true, LONGEST);
            wrong.meet(false, LONGEST);
        }
        let odds = Mixture::odds(&[right, wrong]);
        for _ in 0..1000 {
            let one = mixture.one(0, &odds);
            mixture.meet(0, &odds, one, true);
        }
        assert!(mixture.one(0, &odds) > 64_000);
    }
}
