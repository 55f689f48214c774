//! Parallel sums that do not depend on the number of threads.

use rayon::prelude::*;

/// Items per partial sum; fixed, so that the order of additions never follows the threads.
const CHUNK: usize = 4096;

/// The sum of `value` over `items`, with the same bits on any number of threads.
pub fn sum_by<T: Sync>(items: &[T], value: impl Fn(&T) -> f64 + Sync) -> f64 {
    let partial: Vec<f64> = items
        .par_chunks(CHUNK)
        .map(|chunk| chunk.iter().map(&value).sum())
        .collect();
    partial.into_iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_do_not_change_a_bit() {
        let values: Vec<f64> = (0..50_000)
            .map(|i| (f64::from(i) * 0.37).sin() * 1e6)
            .collect();
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("a pool");
            pool.install(|| sum_by(&values, |v| *v)).to_bits()
        };
        assert_eq!(on(1), on(8));
    }
}
