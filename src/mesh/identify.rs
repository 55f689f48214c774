//! Which vertices are at the same place.

use crate::numeric::vector::Vec3;
use rayon::prelude::*;

/// For each vertex the smallest index among those at bit-identical positions; -0 equals 0.
///
/// There are at most 2^32 vertices. Cost: O(n log n), 12 bytes per vertex.
pub fn identify(positions: &[Vec3]) -> Vec<u32> {
    // Half a hash and the index in one word: sorting words is several times faster than sorting
    // positions, and the few runs of equal hashes that hold different positions are sorted after.
    let mut keys: Vec<u64> = positions
        .par_iter()
        .enumerate()
        .map(|(v, p)| hash(bits(*p)) << 32 | v as u64)
        .collect();
    keys.par_sort_unstable();
    let mut representative: Vec<u32> = (0..positions.len() as u32).collect();
    let place = |key: u64| bits(positions[key as u32 as usize]);
    for run in keys.chunk_by_mut(|a, b| a >> 32 == b >> 32) {
        if run.len() == 1 {
            continue;
        }
        let first = place(run[0]);
        if run.iter().any(|key| place(*key) != first) {
            run.par_sort_unstable_by_key(|key| (place(*key), *key));
        }
        for same in run.chunk_by(|a, b| place(*a) == place(*b)) {
            for key in same {
                representative[*key as u32 as usize] = same[0] as u32;
            }
        }
    }
    representative
}

/// The bits of a position, alike for 0 and -0.
#[inline]
fn bits(p: Vec3) -> [u64; 3] {
    p.map(|c| (c + 0.0).to_bits())
}

/// Thirty-two bits that depend on all others (the multipliers are those of xxHash, Collet 2012).
#[inline]
fn hash([x, y, z]: [u64; 3]) -> u64 {
    let mut h = x.wrapping_mul(0x9e37_79b1_85eb_ca87);
    h = (h ^ h >> 29 ^ y).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
    h = (h ^ h >> 31 ^ z).wrapping_mul(0x1656_67b1_9e37_79f9);
    (h ^ h >> 33).wrapping_mul(0xc2b2_ae3d_27d4_eb4f) >> 32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;
    use std::collections::HashMap;

    #[test]
    fn equal_positions_get_their_smallest_index() {
        // 70,000 positions make some hashes of 32 bits collide; a third of them repeat.
        let positions: Vec<Vec3> = (0..100_000)
            .map(|i| {
                let mut rng = Rng::new(1, i % 70_000);
                std::array::from_fn(|_| rng.unit())
            })
            .collect();
        let mut first: HashMap<[u64; 3], u32> = HashMap::new();
        let wanted: Vec<u32> = positions
            .iter()
            .enumerate()
            .map(|(v, p)| *first.entry(bits(*p)).or_insert(v as u32))
            .collect();
        assert_eq!(identify(&positions), wanted);
    }

    #[test]
    fn minus_0_is_0() {
        let positions = [[0.0, 1.0, 0.0], [0.0, 1.0, 1e-300], [-0.0, 1.0, -0.0]];
        assert_eq!(identify(&positions), [0, 1, 0]);
    }
}
