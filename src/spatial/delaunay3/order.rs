//! The order in which points are inserted: random samples of growing size, each along a space-filling
//! curve.
//!
//! Random rounds keep the expected cost low whatever the points are; the curve keeps what is read near
//! what was read last (Amenta, Choi and Rote 2003, "Incremental constructions con BRIO"). All is
//! drawn from where a point lies in the bounding box, so that neither the order in which points are
//! given nor a shift of them all changes anything.

/// Bits of a coordinate along the curve.
const BITS: u32 = 20;
/// Each round but the last holds one point of eight of those after it; the first stays above this.
const SMALLEST_ROUND: usize = 64;
/// Rounds at most; above the bits of the curve stand three for the round.
const ROUNDS: u32 = 7;

/// The index of a cell along a Hilbert curve of 2^[`BITS`] cells a side.
///
/// Source: Skilling 2004, "Programming the Hilbert curve".
fn hilbert(mut cell: [u32; 3]) -> u64 {
    let mut bit = 1 << (BITS - 1);
    while bit > 1 {
        let below = bit - 1;
        for axis in 0..3 {
            if cell[axis] & bit != 0 {
                cell[0] ^= below;
            } else {
                let swapped = (cell[0] ^ cell[axis]) & below;
                cell[0] ^= swapped;
                cell[axis] ^= swapped;
            }
        }
        bit >>= 1;
    }
    cell[1] ^= cell[0];
    cell[2] ^= cell[1];
    let mut turned = 0;
    let mut bit = 1 << (BITS - 1);
    while bit > 1 {
        if cell[2] & bit != 0 {
            turned ^= bit - 1;
        }
        bit >>= 1;
    }
    let [x, y, z] = cell.map(|c| spread(c ^ turned));
    x << 2 | y << 1 | z
}

/// The bits of a number, two zeros after each.
fn spread(value: u32) -> u64 {
    let mut v = u64::from(value);
    v = (v | v << 32) & 0x001f_0000_0000_ffff;
    v = (v | v << 16) & 0x001f_0000_ff00_00ff;
    v = (v | v << 8) & 0x100f_00f0_0f00_f00f;
    v = (v | v << 4) & 0x10c3_0c30_c30c_30c3;
    (v | v << 2) & 0x1249_2492_4924_9249
}

/// The indices of `points` in the order of insertion: by round and curve, then by coordinates, the
/// heavier of coincident points first, then by index.
pub fn insertion_order(points: &[[f64; 4]]) -> Vec<u32> {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for point in points {
        for axis in 0..3 {
            low[axis] = low[axis].min(point[axis]);
            high[axis] = high[axis].max(point[axis]);
        }
    }
    // Halves, so that the widest box does not overflow.
    let extent = (0..3).fold(0.0, |most: f64, axis| {
        most.max(high[axis] * 0.5 - low[axis] * 0.5)
    });
    let cells = f64::from(1u32 << BITS);
    let rounds = (0..ROUNDS)
        .take_while(|r| points.len() >> (3 * r) > SMALLEST_ROUND)
        .count();
    let mut keyed: Vec<(u64, u32)> = points
        .iter()
        .zip(0u32..)
        .map(|(point, index)| {
            let cell = [0, 1, 2].map(|axis| {
                let along = (point[axis] * 0.5 - low[axis] * 0.5) / extent;
                ((along * cells) as u32).min((1 << BITS) - 1)
            });
            let key = hilbert(cell);
            let drawn = mix(key).trailing_zeros() / 3;
            let round = drawn.min(rounds as u32);
            (u64::from(ROUNDS - round) << (3 * BITS) | key, index)
        })
        .collect();
    keyed.sort_unstable();
    let mut start = 0;
    while start < keyed.len() {
        let same = keyed[start..].iter().take_while(|k| k.0 == keyed[start].0);
        let end = start + same.count();
        if end - start > 1 {
            keyed[start..end].sort_unstable_by(|a, b| {
                let [ax, ay, az, aw] = points[a.1 as usize];
                let [bx, by, bz, bw] = points[b.1 as usize];
                let places = [ax, ay, az].partial_cmp(&[bx, by, bz]);
                let places = places.unwrap_or(std::cmp::Ordering::Equal);
                places.then(bw.total_cmp(&aw)).then(a.1.cmp(&b.1))
            });
        }
        start = end;
    }
    keyed.into_iter().map(|(_, index)| index).collect()
}

/// Spreads a key over all bits (the finalizer of SplitMix64).
fn mix(mut z: u64) -> u64 {
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_steps_to_neighbours() {
        // The first cells of the curve fill a small cube; each step moves by one along one axis.
        let side = 8u32;
        let mut cells = Vec::new();
        for x in 0..side {
            for y in 0..side {
                for z in 0..side {
                    cells.push((hilbert([x, y, z]), [x, y, z]));
                }
            }
        }
        cells.sort_unstable();
        for (index, pair) in cells.windows(2).enumerate() {
            let step: u32 = (0..3).map(|k| pair[0].1[k].abs_diff(pair[1].1[k])).sum();
            assert_eq!(step, 1, "after {index}");
            assert_eq!(pair[0].0, index as u64);
        }
    }

    #[test]
    fn the_order_is_that_of_the_places() {
        let mut rng = crate::numeric::rng::Rng::new(3, 0);
        let mut points: Vec<[f64; 4]> = (0..3000)
            .map(|_| [rng.unit(), rng.unit(), rng.unit(), 0.0])
            .collect();
        let places = |points: &[[f64; 4]]| -> Vec<[f64; 4]> {
            insertion_order(points)
                .iter()
                .map(|i| points[*i as usize])
                .collect()
        };
        let first = places(&points);
        points.reverse();
        assert_eq!(places(&points), first);
        let mut order = insertion_order(&points);
        order.sort_unstable();
        assert!(order.iter().copied().eq(0..3000));
    }
}
