//! Random numbers that depend on a seed and an index only, never on who asks first.

/// Random numbers for one element.
///
/// The sequence is SplitMix64 (Steele, Lea, Flood 2014) started from a mix of seed and index, so
/// that elements can be drawn in any order and on any thread.
#[derive(Debug, Clone)]
pub struct Rng(u64);

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Rng {
    /// The numbers of element `index` under `seed`.
    pub fn new(seed: u64, index: u64) -> Self {
        Rng(mix(seed.wrapping_add(0x9e37_79b9_7f4a_7c15))
            ^ mix(index.wrapping_mul(0xd1b5_4a32_d192_ed03)))
    }

    /// Sixty-four random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.0)
    }

    /// Uniform in `[0, 1)`, a multiple of 2^-53.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Uniform in `[low, high)`.
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform among `0..count`, for counts far below 2^53.
    pub fn below(&mut self, count: usize) -> usize {
        ((self.unit() * count as f64) as usize).min(count.saturating_sub(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_spread_and_repeatable() {
        let mean = (0..10_000).map(|i| Rng::new(1, i).unit()).sum::<f64>() / 10_000.0;
        assert!((mean - 0.5).abs() < 0.01, "{mean}");
        assert_eq!(Rng::new(3, 5).bits(), Rng::new(3, 5).bits());
        assert_ne!(Rng::new(3, 5).bits(), Rng::new(3, 6).bits());
        assert_ne!(Rng::new(3, 5).bits(), Rng::new(4, 5).bits());
    }
}
