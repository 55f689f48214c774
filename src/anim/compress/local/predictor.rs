//! Linear prediction that learns from the numbers that pass.

/// How much of what was learnt is kept from one number to the next.
const KEPT: f64 = 0.998;

/// Foresees a number from `N` known ones, by the weights that would have been the best up to now.
///
/// Recursive least squares with forgetting; only sums, products and quotients, so that every machine
/// foresees the same. Source: S. Haykin, "Adaptive filter theory" (1986), on the exponentially
/// weighted algorithm.
#[derive(Debug, Clone)]
pub struct Predictor<const N: usize> {
    weights: [f64; N],
    inverse: [[f64; N]; N],
    trust: f64,
}

fn product<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b)
}

impl<const N: usize> Predictor<N> {
    /// Begins with these weights; a number of the size `size` outweighs them.
    pub fn new(weights: [f64; N], size: f64) -> Self {
        let trust = 1.0 / (size * size);
        Predictor {
            weights,
            inverse: Self::diagonal(trust),
            trust,
        }
    }

    fn diagonal(trust: f64) -> [[f64; N]; N] {
        std::array::from_fn(|i| std::array::from_fn(|j| if i == j { trust } else { 0.0 }))
    }

    /// The number to expect beside these.
    pub fn expected(&self, known: &[f64; N]) -> f64 {
        let expected = product(&self.weights, known);
        if expected.abs() < 1e9 { expected } else { 0.0 }
    }

    /// Meets the number that stood beside these.
    pub fn meet(&mut self, known: &[f64; N], number: f64) {
        let gain: [f64; N] = std::array::from_fn(|i| product(&self.inverse[i], known));
        let told = product(&gain, known);
        // What tells nothing must not make the past forgotten.
        if !(told > 1e-6 && told < 1e12) {
            return;
        }
        let missed = number - product(&self.weights, known);
        let share = 1.0 / (KEPT + told);
        let mut sound = true;
        for i in 0..N {
            self.weights[i] += gain[i] * share * missed;
            for j in 0..N {
                self.inverse[i][j] = (self.inverse[i][j] - gain[i] * gain[j] * share) / KEPT;
            }
            let own = self.inverse[i][i];
            sound &= own > 0.0 && own < 100.0 * self.trust && self.weights[i].abs() < 1e6;
        }
        if !sound {
            self.inverse = Self::diagonal(self.trust);
            self.weights = self.weights.map(|w| if w.abs() < 4.0 { w } else { 0.0 });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wave_is_foreseen_from_its_last_two_numbers() {
        let mut predictor = Predictor::new([1.0, 0.0], 1.0);
        let wave = |t: usize| 50.0 * (0.2 * t as f64).sin();
        for t in 2..100 {
            let known = [wave(t - 1), wave(t - 2)];
            let missed = predictor.expected(&known) - wave(t);
            assert!(t < 20 || missed.abs() < 0.05, "{t}: {missed}");
            predictor.meet(&known, wave(t));
        }
    }

    #[test]
    fn stillness_and_leaps_keep_it_finite() {
        let mut predictor = Predictor::new([1.0; 3], 16.0);
        for t in 0..5000u32 {
            let value = match t % 700 {
                0 => 1e8,
                1..300 => 0.0,
                t => f64::from(t * 7919 % 13),
            };
            let known = [value, value, -value];
            assert!(predictor.expected(&known).is_finite());
            predictor.meet(&known, 3.0);
        }
    }
}
